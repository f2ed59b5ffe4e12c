"""A run that is watched and steered in the browser: ``python -m benchmarks.live [PART …]``.

The parts, all of them by default:

- ``updates``: a study of 20 000 tests of four objectives gets 100 more, ten times, without limits
  and under two. "server" is the time to read them and to make the message, "browser" that from the
  message to the page with its new ranks, charts and table, "queue" that of a run to read what
  people ask of it. The ranks of the page are compared with Python's.
- ``dialogue``: in a real browser, 300 tests of 0.1 s by surrogates on two workers: two watch,
  one directs, pauses, extends, continues and ends the run; server and run are killed and started
  again. Nothing is lost or evaluated twice.

This requires Chromium on the PATH and playwright (extra ``test``).
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, Error, sync_playwright
from pymoo.core.problem import ElementwiseProblem
from pymoo.problems import get_problem

from benchmarks.machine import describe_machine
from pymoo_psi import investigate, live, read_table
from pymoo_psi.page import designs_of_page, rows_of
from pymoo_psi.server import GrowingStudy
from pymoo_psi.study import Study

SIZE = 20_000
MORE = 100
STEPS = 10
PORT = 8769
SWITCHES = ["--no-sandbox", "--disable-gpu"]
# The server does not exist here: its messages are given to the page.
WITHOUT_SERVER = "window.EventSource = class { }"
GROW = """(rows) => {
  const start = performance.now()
  decisionPage.grow([rows])
  return performance.now() - start
}"""
LIMIT = "decisionPage.set({...decisionPage.state(), limits: %s})"
LIMITS = {"f1": [None, 0.3], "f2": [None, 0.8]}


class Model(ElementwiseProblem):
    """A model of two variables and objectives that takes 0.1 s."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(n_var=2, n_obj=2, xl=[0, 0], xu=[1, 1], **kwargs)

    def _evaluate(self, x: Any, out: Any, *args: Any, **kwargs: Any) -> None:
        time.sleep(0.1)
        with open("evaluated.txt", "a") as file:
            file.write(f"{x.tolist()}\n")
        out["F"] = [x[0], 1 - x[0] ** 0.5 + (x[1] - 0.3) ** 2]


@contextmanager
def chromium() -> Iterator[Browser]:
    """A headless browser."""
    program = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=SWITCHES)
        yield browser
        browser.close()


def updates(folder: Path, browser: Browser) -> None:
    """Grow a study and its page, and print the medians."""
    problem = get_problem("dtlz2", n_var=7, n_obj=4)
    path = folder / "study.db"
    investigate(problem, SIZE, study=path)
    growing = GrowingStudy(path, steer=True)
    growing.look()
    file = folder / "page.html"
    file.write_text(growing.page(), encoding="utf-8")
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    page.add_init_script(WITHOUT_SERVER)
    page.goto(file.as_uri())
    page.wait_for_selector("body[data-ready]", timeout=120_000)
    times: dict[str, list[float]] = {}
    for step in range(1, 2 * STEPS + 1):
        name = "browser"
        if step > STEPS:
            name = "browser, two limits"
        if step == STEPS + 1:
            page.evaluate(LIMIT % json.dumps({"f1": [None, 0.8], "x3": [0.2, None]}))
            page.wait_for_timeout(1000)
        investigate(problem, SIZE + step * MORE, study=path)
        n_before = len(growing.tests)
        start = time.perf_counter()
        growing.look()
        new = growing.tests.rows(np.arange(n_before, len(growing.tests)))
        rows = rows_of(designs_of_page(new))
        json.dumps({"rows": [rows]} | growing.progress)
        times.setdefault("server", []).append(1e3 * (time.perf_counter() - start))
        times.setdefault(name, []).append(page.evaluate(GROW, rows))
        assert page.evaluate("decisionPage.data.n") == SIZE + step * MORE
        start = time.perf_counter()
        growing.study.facts()
        times.setdefault("queue", []).append(1e3 * (time.perf_counter() - start))
        page.wait_for_timeout(1000)
        table = growing.tests
        if step > STEPS:
            table = table.under(limits={"f1": 0.8, "x3": (0.2, None)})
        ranking = table.feasible_ranking()
        best = page.evaluate("decisionPage.ranking.best")
        assert best == ranking.rows[ranking.salukvadze].tolist()
        assert page.evaluate("decisionPage.ranking.front.length") == ranking.pareto.sum()
    page.close()
    for name, values in times.items():
        print(f"{name}: {statistics.median(values):.1f} ms, at most {max(values):.1f} ms")


def begin(folder: Path) -> subprocess.Popen[bytes]:
    """Begin the run of the dialogue, or continue it."""
    words = ["solve", "benchmarks.live:Model", "--study", "run.db", "--algorithm", "surrogate"]
    words += ["--points", "300", "--jobs", "2", "--seed", "1"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(
        [sys.executable, "-m", "pymoo_psi", *words],
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    )


class Visitor:
    """Somebody in front of the page."""

    def __init__(self, browser: Browser, address: str) -> None:
        self.page = browser.new_page(viewport={"width": 1366, "height": 768})
        self.page.goto(address)
        self.page.wait_for_selector("#live:not([hidden])")

    def until(self, expression: str) -> None:
        """Wait until an expression is true; the page may be loaded anew meanwhile."""
        while True:
            with suppress(Error):
                if self.page.evaluate(expression):
                    return
            self.page.wait_for_timeout(50)

    def says(self, text: str) -> None:
        """Wait until the page says something."""
        self.until(f"document.getElementById('live').textContent.includes({json.dumps(text)})")

    def press(self, name: str) -> None:
        """Press a button of the steering."""
        self.page.click(f"[name={name}]")


def dialogue(folder: Path, browser: Browser) -> None:
    """Watch and steer a run, kill it and its server, go on, and compare what is left."""
    path = folder / "run.db"
    run = begin(folder)
    with live(path, steer=True, port=PORT) as view:
        anna, bo = Visitor(browser, view.address), Visitor(browser, view.address)
        anna.until("decisionPage.data.n >= 40")
        anna.page.fill("#steerer", "Anna")
        anna.press("pause")
        bo.says("Paused.")
        n_paused = len(read_table(path))
        anna.page.evaluate(LIMIT % json.dumps(LIMITS))
        anna.press("search")
        bo.says("Anna: search: f1, f2 within f1<=0.3, f2<=0.8")
        anna.page.fill("#more", "20")
        anna.press("more")
        bo.says("of 320 tests")
        assert len(read_table(path)) == n_paused
        anna.press("continue")
        bo.until(f"decisionPage.data.n >= {n_paused + 60}")
    anna.until("!document.getElementById('offline').hidden")
    n_before = len(read_table(path))
    while len(read_table(path)) < n_before + 10:  # the run goes on
        time.sleep(0.1)
    with live(path, steer=True, port=PORT) as again:
        assert again.address == view.address
        anna.until("document.getElementById('offline').hidden")
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        bo.says("No run is at work")
        n_killed = len(read_table(path))
        run = begin(folder)
        bo.until(f"decisionPage.data.n >= {n_killed + 40}")
        bo.page.fill("#steerer", "Bo")
        bo.press("stop")
        assert run.wait() == 0
        anna.says("Bo: stop: done")
        n_stopped = len(read_table(path))
        anna.until(f"decisionPage.data.n == {n_stopped}")
        assert n_stopped < 320
        run = begin(folder)
        anna.says("All tests are done.")
        anna.until("decisionPage.data.n == 320")
        front = anna.page.evaluate("decisionPage.ranking.front.length")
        run.wait()
    table = read_table(path)
    evaluated = (folder / "evaluated.txt").read_text().splitlines()
    assert len(table) == len({*evaluated}) == 320
    within = table.under(limits={name: limit[1] for name, limit in LIMITS.items()})
    assert front == within.feasible_ranking().pareto.sum()
    directed = [
        point for point, _, _, content in Study(path).proposals(1, 400) if "request" in content
    ]
    share = within.eligible()[np.isin(table.numbers, directed)].mean()
    assert share >= 0.8
    print(f"{len(directed)} proposals after 'Search here', {100 * share:.0f} % within the limits")
    print(f"{len(evaluated)} evaluations of 320 tests, with a run killed, stopped and continued")
    print(*[remark for remark in table.remarks if remark.startswith("Steered")], sep="\n")


def main(names: list[str]) -> None:
    """Do the parts named, or all."""
    print(describe_machine())
    parts = {"updates": updates, "dialogue": dialogue}
    for name in names or parts:
        with tempfile.TemporaryDirectory() as folder, chromium() as browser:
            parts[name](Path(folder), browser)
        os.chdir(Path(__file__).parent)


if __name__ == "__main__":
    from benchmarks import live as module  # workers must find Model under its name

    module.main(sys.argv[1:])
