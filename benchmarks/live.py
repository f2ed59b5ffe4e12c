"""Updates of the page of a growing study, and their cost: ``python -m benchmarks.live``.

A study of 20 000 tests of four objectives gets 100 more, ten times. "server" is the time to read
them and to make the message, "browser" that from the message to the page with its new ranks,
charts and table, "queue" that of a run to read, once a second, what people ask of it. The aims: 20
ms, 50 ms, and 1 % of a second. The ranks of the page are compared with Python's.

This requires Chromium on the PATH and playwright (extra ``test``).
"""

from __future__ import annotations

import json
import shutil
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright
from pymoo.problems import get_problem

from benchmarks.machine import describe_machine
from pymoo_psi import investigate
from pymoo_psi.page import designs_of_page, rows_of
from pymoo_psi.server import GrowingStudy

SIZE = 20_000
MORE = 100
STEPS = 10
SWITCHES = ["--no-sandbox", "--disable-gpu"]
# The server does not exist here: its messages are given to the page.
WITHOUT_SERVER = "window.EventSource = class { }"
GROW = """(rows) => {
  const start = performance.now()
  decisionPage.grow([rows])
  return performance.now() - start
}"""


def main() -> None:
    """Grow a study and its page, and print the medians."""
    print(describe_machine())
    problem = get_problem("dtlz2", n_var=7, n_obj=4)
    server = []
    browser_times = []
    queue = []
    program = shutil.which("chromium") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder, "study.db")
        investigate(problem, SIZE, study=path)
        growing = GrowingStudy(path, steer=True)
        growing.look()
        file = Path(folder, "page.html")
        file.write_text(growing.page(), encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=program, args=SWITCHES)
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.add_init_script(WITHOUT_SERVER)
        page.goto(file.as_uri())
        page.wait_for_selector("body[data-ready]", timeout=120_000)
        for step in range(1, STEPS + 1):
            investigate(problem, SIZE + step * MORE, study=path)
            n_before = len(growing.tests)
            start = time.perf_counter()
            growing.look()
            new = growing.tests.rows(np.arange(n_before, len(growing.tests)))
            rows = rows_of(designs_of_page(new))
            json.dumps({"rows": [rows]} | growing.progress)
            server.append(1e3 * (time.perf_counter() - start))
            browser_times.append(page.evaluate(GROW, rows))
            assert page.evaluate("decisionPage.data.n") == SIZE + step * MORE
            start = time.perf_counter()
            growing.study.facts()
            queue.append(1e3 * (time.perf_counter() - start))
            page.wait_for_timeout(1000)
        ranking = growing.tests.feasible_ranking()
        best = page.evaluate("decisionPage.ranking.best")
        assert best == ranking.rows[ranking.salukvadze].tolist()
        assert page.evaluate("decisionPage.ranking.front.length") == ranking.pareto.sum()
        browser.close()
    times = {"server": server, "browser": browser_times, "queue": queue}
    for name, values in times.items():
        print(f"{name}: {statistics.median(values):.1f} ms, at most {max(values):.1f} ms")


if __name__ == "__main__":
    main()
