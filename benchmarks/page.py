"""The decision page in headless Chromium: how long it loads, and how long a slider's step takes.

    python -m benchmarks.page [300 20000 100000]

Designs of four objectives and four variables, all Pareto optimal or a half of them dominated: a
limit on a variable frees dominated designs. At the largest size also two and eight objectives, best
where x1 is least: every step of a lower limit on it rejects the front and frees another one.
The limit is dragged, all charts and the table in view. After each drag the page's ranks are
compared with Python's.

A line of the table is a drag of 20 steps. Two times are given in milliseconds, as medians: from the
event to the painted frame by the clock, half a frame of waiting included, and of the processor for
the page's main thread, which other work on the machine lengthens less; its greatest is the first
step's, which looks for what dominates each design. Aims: painted within 33 ms at 20 000 designs,
within 100 ms at 100 000.
"""

from __future__ import annotations

import shutil
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from playwright.sync_api import Page, sync_playwright

from benchmarks.machine import describe_machine
from pymoo_psi import rank_of_efficiency
from pymoo_psi.page import decision_page

VARIABLES = ["x1", "x2", "x3", "x4"]
STEPS = 20


def designs(n: int, kind: str, m: int = 4) -> pd.DataFrame:
    """Return designs on a convex front, or some of them a little behind it."""
    rng = np.random.default_rng(1)
    F = np.abs(rng.normal(size=(n, m)))
    F = (1.2 - F / np.linalg.norm(F, axis=1)[:, None]) ** 1.5
    X = rng.random((n, len(VARIABLES)))
    if kind == "some dominated":
        F += 0.1 * rng.random((n, 1)) ** 4
    elif kind == "best at the least x1":
        F += 0.1 * X[:, :1] ** 4
    return pd.DataFrame(np.hstack([F, X]), columns=[*(f"f{j + 1}" for j in range(m)), *VARIABLES])


def objectives_of(frame: pd.DataFrame) -> list[str]:
    """Return the names of the objectives."""
    return [name for name in frame if name.startswith("f")]


def busy(page: Page, session: Any) -> float:
    """Return the processor time of the main thread so far, in milliseconds."""
    page.evaluate("new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))")
    found = session.send("Performance.getMetrics")["metrics"]
    return 1000 * next(m["value"] for m in found if m["name"] == "TaskDuration")


# A step of a slider, from the event, anywhere between two frames, to the frame after the one that
# draws it: by then it is painted.
STEP = """(thumb, value) => new Promise((painted) => {
  const start = performance.now()
  thumb.value = value
  thumb.dispatchEvent(new Event('input'))
  requestAnimationFrame(() => requestAnimationFrame(() => painted(performance.now() - start)))
})"""


HEADS = ["designs", "objectives", "set", "limit on", "painted", "processor", "its greatest"]
WIDTHS = [8, 11, 21, 9, 8, 10, 13]


def print_line(cells: Sequence[object]) -> None:
    """Print cells of the table below their heads, times without decimals."""
    texts = [f"{cell:.0f}" if isinstance(cell, float) else str(cell) for cell in cells]
    print(
        "".join(f"{text:>{width}}" for text, width in zip(texts, WIDTHS, strict=True)), flush=True
    )


def measured(
    page: Page, frame: pd.DataFrame, path: Path, names: Sequence[str], kind: str, rising: bool
) -> str:
    """Print the times of one page's steps; return those of its loading."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(path.as_uri())
    page.wait_for_selector("body[data-ready]", timeout=120_000)
    ready, loaded = page.evaluate("decisionPage.ready"), busy(page, session)
    m = len(objectives_of(frame))
    for name in names:
        label = f"{name}, {'lower' if rising else 'upper'} limit"
        thumb = page.get_by_label(label).element_handle()  # not looked for anew at every step
        assert thumb is not None
        thumb.evaluate("(thumb) => { thumb.closest('details').open = true }")
        clock, processor = [], []
        for k in range(1, STEPS + 1):
            before = busy(page, session)
            clock.append(thumb.evaluate(STEP, 25 * k if rising else 1000 - 25 * k))
            processor.append(busy(page, session) - before)
        low, high = page.evaluate("(name) => decisionPage.state().limits[name]", name)
        left = frame[frame[name] >= low if rising else frame[name] <= high]
        ranking = rank_of_efficiency(left[objectives_of(frame)])
        best, optimal = page.evaluate(
            "(({ranking}) => [ranking.best, ranking.front.length])(decisionPage)"
        )
        assert best == left.index[ranking.salukvadze].tolist()
        assert optimal == ranking.pareto.sum()
        times = statistics.median(clock), statistics.median(processor), max(processor)
        print_line([len(frame), m, kind, name, *map(float, times)])
        page.evaluate("decisionPage.set({})")
    size = path.stat().st_size / 1e6
    return (
        f"{len(frame)} designs of {m} objectives: {size:.1f} MB, ready after {ready:.0f} ms, "
        f"{loaded:.0f} ms of the processor"
    )


def main() -> None:
    """Measure pages of the sizes that are given."""
    print(describe_machine())
    sizes = [int(word) for word in sys.argv[1:]] or [300, 20_000, 100_000]
    print_line(HEADS)
    loading = []
    program = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright, TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(
            executable_path=program, args=["--no-sandbox", "--disable-gpu"]
        )
        for n in sizes:
            sets = [("all optimal", 4), ("some dominated", 4)]
            sets += [("all optimal", 8)]
            if n == max(sizes):
                sets += [("best at the least x1", m) for m in (2, 8)]
            for kind, m in sets:
                frame = designs(n, kind, m)
                path = Path(folder, "page.html")
                decision_page(frame, objectives_of(frame), variables=VARIABLES).save(path)
                page = browser.new_page(viewport={"width": 1400, "height": 2000})
                rising = kind == "best at the least x1"
                limited = ("x1",) if rising else ("f1", "x1")
                loading.append(measured(page, frame, path, limited, kind, rising))
                page.close()
        browser.close()
    print(*loading, sep="\n")


if __name__ == "__main__":
    main()
