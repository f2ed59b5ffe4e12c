"""The decision page in headless Chromium: how long it loads, and how long a slider's step takes.

    python -m benchmarks.page [300 20000 100000]

Designs of four criteria and four variables, all Pareto optimal or a half of them dominated, which
is the harder set: a limit on a variable frees dominated designs. First the page's ranks under the
last limits are compared with Python's.

Two times are told: by the clock, and of the processor for the page's main thread, which other work
on the machine does not lengthen.
"""

from __future__ import annotations

import shutil
import statistics
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
from playwright.sync_api import Page, sync_playwright

from benchmarks.machine import describe_machine
from pymoo_psi import rank_of_efficiency
from pymoo_psi.page import decision_page

CRITERIA = ["f1", "f2", "f3", "f4"]
VARIABLES = ["x1", "x2", "x3", "x4"]
STEPS = 20


def designs(n: int, dominated: bool) -> pd.DataFrame:
    """Return designs on a convex front, or some of them a little behind it."""
    rng = np.random.default_rng(1)
    F = np.abs(rng.normal(size=(n, 4)))
    F = (1.2 - F / np.linalg.norm(F, axis=1)[:, None]) ** 1.5
    if dominated:
        F += 0.1 * rng.random((n, 1)) ** 4
    return pd.DataFrame(np.hstack([F, rng.random((n, 4))]), columns=[*CRITERIA, *VARIABLES])


def steps(frame: pd.DataFrame, name: str) -> Iterator[float]:
    """Yield upper limits as a hand draws a slider down: from all designs to a half of them."""
    yield from np.quantile(frame[name], np.linspace(1.0, 0.5, STEPS + 1)[1:]).tolist()


def busy(page: Page, session: Any) -> float:
    """Return the processor time of the main thread so far, in milliseconds."""
    page.evaluate("new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))")
    found = session.send("Performance.getMetrics")["metrics"]
    return 1000 * next(m["value"] for m in found if m["name"] == "TaskDuration")


def measured(page: Page, frame: pd.DataFrame, path: Path) -> None:
    """Print the times of one page."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(path.as_uri())
    page.wait_for_selector("body[data-ready]", timeout=120_000)
    ready = page.evaluate("decisionPage.ready")
    print(f"  {path.stat().st_size / 1e6:.1f} MB; ready after {ready:.0f} ms, ", end="")
    print(f"of which the processor {busy(page, session):.0f} ms")
    for name in ("f1", "x1"):
        clock, processor = [], []
        for limit in steps(frame, name):
            before = busy(page, session)
            clock.append(page.evaluate(
                """([name, limit]) => { const {state, set, step} = decisionPage
                set({...state(), limits: {[name]: [null, limit]}}); return step.last }""",
                [name, limit],
            ))  # fmt: skip
            processor.append(busy(page, session) - before)
        left = frame[frame[name] <= limit]
        ranking = rank_of_efficiency(left[CRITERIA])
        best, optimal = page.evaluate(
            "(({ranking}) => [ranking.best, ranking.front.length])(decisionPage)"
        )
        assert best == left.index[ranking.salukvadze].tolist()
        assert optimal == ranking.pareto.sum()
        print(
            f"  a step of a limit on {name}: {statistics.median(clock):.0f} ms by the clock, "
            f"{statistics.median(processor):.0f} ms of the processor (at most "
            f"{max(processor):.0f}); {optimal} of {len(left)} optimal at the end"
        )


def main() -> None:
    """Measure pages of the sizes that are given."""
    print(describe_machine())
    sizes = [int(word) for word in sys.argv[1:]] or [300, 20_000, 100_000]
    program = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright, TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(
            executable_path=program, args=["--no-sandbox", "--disable-gpu"]
        )
        for n in sizes:
            for dominated in (False, True):
                frame = designs(n, dominated)
                path = Path(folder, "page.html")
                decision_page(frame, CRITERIA, variables=VARIABLES).save(path)
                print(f"{n} designs, {'some dominated' if dominated else 'all optimal'}")
                page = browser.new_page(viewport={"width": 1400, "height": 900})
                measured(page, frame, path)
                page.close()
        browser.close()


if __name__ == "__main__":
    main()
