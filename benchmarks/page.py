"""The decision page in headless Chromium: the time to load it and the time of a slider's step.

    python -m benchmarks.page [300 20000 100000]

The designs have four objectives and four variables and are all Pareto optimal, or partly dominated:
then a limit on a variable rejects optimal designs, and dominated ones become optimal. At the
largest size there are also two and eight objectives, best where x1 is least: every step of a lower
limit on x1 rejects the front and reveals another one. The limit is dragged while all charts and the
table are visible. After each drag, the ranks of the page are compared with Python's.

A line of the table is a drag of 20 steps, with times in milliseconds. "painted" is the median wall
time from the event to the painted frame, including half a frame of waiting. "processor" is the
median processor time of the page's main thread, which other work on the machine affects less; its
maximum is the first step's, which determines what dominates each design. The aims: painted within
33 ms at 20 000 designs and within 100 ms at 100 000.
"""

from __future__ import annotations

import shutil
import statistics
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from playwright.sync_api import Page, sync_playwright

from benchmarks.machine import describe_machine, sized
from pymoo_psi import Formulation, rank_of_efficiency, read_table
from pymoo_psi.page import decision_page

VARIABLES = ["x1", "x2", "x3", "x4"]
STEPS = 20
ALL_OPTIMAL = "all optimal"
SOME_DOMINATED = "some dominated"
BEST_AT_LEAST_X1 = "best at the least x1"


def designs(n: int, kind: str, m: int = 4) -> pd.DataFrame:
    """Return designs on a convex front, or some of them a little behind it."""
    rng = np.random.default_rng(1)
    F = np.abs(rng.normal(size=(n, m)))
    F = (1.2 - F / np.linalg.norm(F, axis=1)[:, None]) ** 1.5
    X = rng.random((n, len(VARIABLES)))
    if kind == SOME_DOMINATED:
        F += 0.1 * rng.random((n, 1)) ** 4
    elif kind == BEST_AT_LEAST_X1:
        F += 0.1 * X[:, :1] ** 4
    objectives = [f"f{j + 1}" for j in range(m)]
    return pd.DataFrame(np.hstack([F, X]), columns=[*objectives, *VARIABLES])


def objectives_of(frame: pd.DataFrame) -> list[str]:
    """Return the names of the objectives."""
    return [name for name in frame if name.startswith("f")]


def processor_milliseconds(page: Page, session: Any) -> float:
    """Return the processor time of the main thread so far."""
    page.evaluate("new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))")
    for metric in session.send("Performance.getMetrics")["metrics"]:
        if metric["name"] == "TaskDuration":
            return 1000 * metric["value"]
    raise LookupError("the browser reports no TaskDuration")


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
    """Print the cells of a line of the table, times without decimals."""
    line = ""
    for cell, width in zip(cells, WIDTHS, strict=True):
        text = str(cell)
        if isinstance(cell, float):
            text = f"{cell:.0f}"
        line += f"{text:>{width}}"
    print(line, flush=True)


@dataclass(frozen=True)
class Drag:
    """A slider that is dragged: a lower limit upwards or an upper limit downwards."""

    name: str
    is_lower: bool

    @property
    def label(self) -> str:
        """The label of the slider."""
        end = "upper"
        if self.is_lower:
            end = "lower"
        return f"{self.name}, {end} limit"

    def value(self, step: int) -> int:
        """Return the slider's value, 0 to 1000, at a step."""
        if self.is_lower:
            return 25 * step
        return 1000 - 25 * step

    def kept(self, frame: pd.DataFrame, low: float, high: float) -> pd.DataFrame:
        """Return the designs that keep the limit."""
        if self.is_lower:
            return frame[frame[self.name] >= low]
        return frame[frame[self.name] <= high]


def measure_drag(page: Page, session: Any, frame: pd.DataFrame, drag: Drag) -> list[float]:
    """Drag a slider, compare the ranks with Python's, and return the times of the steps."""
    thumb = page.get_by_label(drag.label).element_handle()  # once, not at every step
    assert thumb is not None
    thumb.evaluate("(thumb) => { (thumb.closest('details') ?? {}).open = true }")
    clock = []
    processor = []
    for k in range(1, STEPS + 1):
        before = processor_milliseconds(page, session)
        clock.append(thumb.evaluate(STEP, drag.value(k)))
        processor.append(processor_milliseconds(page, session) - before)
    low, high = page.evaluate("(name) => decisionPage.state().limits[name]", drag.name)
    kept = drag.kept(frame, low, high)
    ranking = rank_of_efficiency(kept[objectives_of(frame)])
    best, n_optimal = page.evaluate(
        "(({ranking}) => [ranking.best, ranking.front.length])(decisionPage)"
    )
    assert best == kept.index[ranking.salukvadze].tolist()
    assert n_optimal == ranking.pareto.sum()
    page.evaluate("decisionPage.set({})")
    times = [statistics.median(clock), statistics.median(processor), max(processor)]
    return [float(milliseconds) for milliseconds in times]


def measure_page(page: Page, frame: pd.DataFrame, path: Path, kind: str) -> str:
    """Print the times of the steps on a page; return those of its loading."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(path.as_uri())
    page.wait_for_selector("body[data-ready]", timeout=120_000)
    ready = page.evaluate("decisionPage.ready")
    loaded = processor_milliseconds(page, session)
    drags = [Drag("f1", is_lower=False), Drag("x1", is_lower=False)]
    if kind == BEST_AT_LEAST_X1:
        drags = [Drag("x1", is_lower=True)]
    m = len(objectives_of(frame))
    for drag in drags:
        times = measure_drag(page, session, frame, drag)
        print_line([len(frame), m, kind, drag.name, *times])
    size = path.stat().st_size / 1e6
    return (
        f"{len(frame)} designs of {m} objectives: {size:.1f} MB, ready after {ready:.0f} ms, "
        f"{loaded:.0f} ms of the processor"
    )


def cases(sizes: Sequence[int]) -> Iterator[tuple[int, str, int]]:
    """Yield the number of designs, their kind and the number of objectives of each page."""
    for n in sizes:
        yield n, ALL_OPTIMAL, 4
        yield n, SOME_DOMINATED, 4
        yield n, ALL_OPTIMAL, 8
        if n == max(sizes):
            yield n, BEST_AT_LEAST_X1, 2
            yield n, BEST_AT_LEAST_X1, 8


def main() -> None:
    """Measure pages of the given sizes."""
    print(describe_machine())
    sizes = [int(word) for word in sys.argv[1:]] or sized([300, 20_000, 100_000], [100])
    print_line(HEADS)
    loading = []
    program = shutil.which("chromium") or shutil.which("google-chrome")
    switches = ["--no-sandbox", "--disable-gpu"]
    with sync_playwright() as playwright, TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=program, args=switches)
        path = Path(folder, "page.html")
        for n, kind, m in cases(sizes):
            frame = designs(n, kind, m)
            asked = Formulation(objectives_of(frame))
            decision_page(read_table(frame, asked, variables=VARIABLES)).save(path)
            page = browser.new_page(viewport={"width": 1400, "height": 2000})
            loading.append(measure_page(page, frame, path, kind))
            page.close()
        browser.close()
    print(*loading, sep="\n")


if __name__ == "__main__":
    main()
