"""A run that is watched and steered in the browser: ``python -m benchmarks.live [PART …]``.

The parts, all of them by default:

- ``updates``: a study of 20 000 tests of four objectives gets 100 more, ten times, without limits
  and under two. "server" is the time to read them and to make the message, "browser" that from the
  message to the page with its new ranks, charts and table, "queue" that of a run to read what
  people ask of it. The ranks of the page are compared with Python's.
- ``slowdown``: a run adds 300 tests of 0.1 s to a study of 20 000, on two workers, with and without
  a server and a client that reads its events, in turns. The tests sleep; in ``computing`` they
  compute, so that it costs what server and client take of two cores.
- ``attack``: such a run without and with a server that gets 10 000 requests of strangers and of
  somebody with the address, oversized bodies, and readers that never read. All are refused or
  bounded, the run has the same tests, and another visitor still reads every one of them.
- ``dialogue``: in a real browser, 300 tests of 0.1 s by surrogates on two workers: two watch,
  one directs, pauses, extends, continues and ends the run; server and run are killed and started
  again. Nothing is lost or evaluated twice.

Updates and dialogue require Chromium on the PATH and playwright (extra ``test``).
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from functools import partial
from http.client import HTTPConnection
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.problems import get_problem

from benchmarks.machine import describe_machine, sized
from pymoo_psi import investigate, live, read_table
from pymoo_psi.page import designs_of_page, rows_of
from pymoo_psi.server import GrowingStudy
from pymoo_psi.study import Study

if TYPE_CHECKING:
    from playwright.sync_api import Browser

    from pymoo_psi.server import LiveView

SIZE = sized(20_000, 500)
ADDED = sized(300, 40)
MORE = sized(100, 20)
STEPS = sized(10, 2)
PAIRS = sized(3, 1)  # runs with a server, and as many without
N_REQUESTS = sized(10_000, 200)
PORT = 8769
CORES = os.cpu_count() or 1
TICKS = r"\) \S (?:\S+ ){10}(\d+) (\d+)"  # of user and system
PEAK = r"VmHWM:\s+(\d+)()"
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
    """A model of two variables and objectives that takes 0.1 s, or what SECONDS says.

    It sleeps, or computes if BUSY is set.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(n_var=2, n_obj=2, xl=[0, 0], xu=[1, 1], **kwargs)

    def _evaluate(self, x: Any, out: Any, *args: Any, **kwargs: Any) -> None:
        seconds = float(os.environ.get("SECONDS", "0.1"))
        out["F"] = [x[0], 1 - x[0] ** 0.5 + (x[1] - 0.3) ** 2]
        if seconds == 0:
            return
        begun = time.time()
        if "BUSY" in os.environ:
            end = time.process_time() + seconds
            while time.process_time() < end:
                pass
        else:
            time.sleep(seconds)
        with open("evaluated.txt", "a") as file:
            file.write(f"{json.dumps([x.tolist(), begun, time.time()])}\n")


def evaluated(folder: Path) -> tuple[list[tuple[float, ...]], float]:
    """The designs that were evaluated, and the seconds from the first to the last."""
    lines = (folder / "evaluated.txt").read_text().splitlines()
    designs, begun, ended = zip(*map(json.loads, lines), strict=True)
    return list(map(tuple, designs)), max(ended) - min(begun)


@contextmanager
def chromium() -> Iterator[Browser]:
    """A headless browser."""
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=SWITCHES)
        yield browser
        browser.close()


def updates(folder: Path) -> None:
    """Grow a study and its page, and print the medians."""
    with chromium() as browser:
        grow(folder, browser)


def grow(folder: Path, browser: Browser) -> None:
    """Grow a study and its page."""
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
        new = growing.tests.take(np.arange(n_before, len(growing.tests)))
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


def begin(folder: Path, *words: str, **environment: str) -> subprocess.Popen[bytes]:
    """Begin a run on two workers, or continue it."""
    command = [sys.executable, "-m", "pymoo_psi", "solve", "benchmarks.live:Model"]
    paths = os.pathsep.join(filter(None, sys.path))
    return subprocess.Popen(
        [*command, "--study", "run.db", "--jobs", "2", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": paths} | environment,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    )


class Reader(Thread):
    """Somebody who reads the page and then its events."""

    def __init__(self, address: str) -> None:
        super().__init__(daemon=True)
        self.n_tests = 0
        self._address = urlsplit(address)
        self.start()

    def run(self) -> None:
        """Read until the server ends."""
        connection = HTTPConnection(self._address.netloc)
        with closing(connection), suppress(OSError):
            connection.request("GET", self._address.path)
            place = re.findall(rb'"from":"([^"]+)"', connection.getresponse().read())[0]
            connection.request("GET", f"{self._address.path}events?from={place.decode()}")
            for line in connection.getresponse():
                if line.startswith(b"data: "):
                    self.n_tests = json.loads(line[6:])["tests"]

    def wait_for(self, n_tests: int) -> None:
        """Wait until so many tests have come."""
        while self.n_tests < n_tests:
            assert self.is_alive()
            time.sleep(0.05)


class Trial:
    """A run that adds 300 tests to a copy of a study of 20 000."""

    def __init__(self, study: Path, folder: Path) -> None:
        folder.mkdir()
        shutil.copy(study, folder)
        self._folder = folder
        self.path = folder / study.name

    def seconds(self, meanwhile: Callable[[], None] = lambda: None, **environment: str) -> float:
        """Do the run; return the seconds from the first evaluation to the last.

        Args:
            meanwhile: What is done from the first evaluation on.
            environment: That of the run.
        """
        run = begin(self._folder, "--points", f"{SIZE + ADDED}", **environment)
        while not (self._folder / "evaluated.txt").exists():
            time.sleep(0.05)
        meanwhile()
        assert run.wait() == 0
        designs, seconds = evaluated(self._folder)
        assert len({*designs}) == len(designs) == ADDED
        assert len(read_table(self.path)) == SIZE + ADDED
        return seconds


@contextmanager
def read(path: Path) -> Iterator[LiveView]:
    """Serve a study, and read what is sent; all tests must have come at the end."""
    with live(path, steer=True, port=PORT) as view:
        reader = Reader(view.address)
        reader.wait_for(SIZE)
        yield view
        reader.wait_for(SIZE + ADDED)


def study_of_many(folder: Path) -> Path:
    """Return a study of 20 000 tests."""
    assert begin(folder, "--points", f"{SIZE}", SECONDS="0").wait() == 0
    return folder / "run.db"


def of_server(view: LiveView, pattern: str) -> list[int]:
    """Numbers that the system knows of the process of a server."""
    text = ""
    for name in ("status", "stat"):
        text += Path(f"/proc/{view._process.pid}/{name}").read_text()
    return [int(number) for number in re.findall(pattern, text)[0] if number]


def slowdown(folder: Path, **environment: str) -> None:
    """Run with and without a server and a reader, in turns, and print the times."""
    study = study_of_many(folder)
    ratios = []
    for pair in range(PAIRS):
        alone = Trial(study, folder / f"alone-{pair}").seconds(**environment)
        trial = Trial(study, folder / f"watched-{pair}")
        with read(trial.path) as view:
            before = sum(of_server(view, TICKS))
            watched = trial.seconds(**environment)
            ticks = sum(of_server(view, TICKS)) - before
        ratios.append(100 * (watched / alone - 1))
        share = ticks / os.sysconf("SC_CLK_TCK") / watched / CORES
        print(f"{alone:.2f} s alone, {watched:.2f} s watched: {ratios[-1]:.2f} % slower", end="; ")
        print(f"the server takes {100 * share:.2f} % of {CORES} cores", flush=True)
    print(f"median: {statistics.median(ratios):.2f} % slower")


def never_read(address: str) -> socket.socket:
    """Ask for the page and read nothing of it."""
    parts = urlsplit(address)
    connection = socket.create_connection((parts.hostname, parts.port))
    connection.sendall(f"GET {parts.path} HTTP/1.1\r\nHost: {parts.netloc}\r\n\r\n".encode())
    return connection


def asked(address: str, number: int) -> str:
    """Do one of the attacks; return its name and the status of the answer."""
    parts = urlsplit(address)
    own = {"Origin": f"http://{parts.netloc}"}
    evil = {"Origin": "http://evil.example"}
    request = json.dumps({"action": "continue", "name": "Eve"})
    attacks = {
        "wrong token": ("GET", "/wrong/", None, {}),
        "foreign host": ("GET", parts.path, None, {"Host": "evil.example"}),
        "foreign origin": ("GET", f"{parts.path}events?from=x-0", None, evil),
        "foreign request": ("POST", f"{parts.path}steer", request, evil),
        "path": ("GET", f"{parts.path}../../run.db", None, {}),
        "long body": ("POST", f"{parts.path}steer", b"x" * 2**20, own),
        "own request": ("POST", f"{parts.path}steer", request, own),
        "page": ("GET", parts.path, None, {}),
    }
    name = [*attacks][number % len(attacks)]
    with closing(HTTPConnection(parts.netloc)) as connection:
        try:
            connection.request(*attacks[name])
            answer = connection.getresponse()
            answer.read()
        except ConnectionError:  # the server has closed before all was sent
            return f"{name}: closed"
    return f"{name}: {answer.status}"


def attack(folder: Path) -> None:
    """Attack the server of a run, and print what it answers."""
    study = study_of_many(folder)
    alone = Trial(study, folder / "alone").seconds()
    trial = Trial(study, folder / "attacked")
    statuses: Counter[str] = Counter()

    def meanwhile() -> None:
        with ThreadPoolExecutor(16) as threads:
            statuses.update(threads.map(partial(asked, view.address), range(N_REQUESTS)))

    with read(trial.path) as view:
        slow = [never_read(view.address) for _ in range(30)]
        attacked = trial.seconds(meanwhile)
        (peak,) = of_server(view, PEAK)
        for connection in slow:
            connection.close()
    print(f"{N_REQUESTS} requests; the server has at most {peak / 1e3:.0f} MB")
    for name, count in sorted(statuses.items()):
        print(f"  {name}: {count}")
    print(f"the run takes {attacked:.2f} s, {alone:.2f} s without server; its tests are the same")


class Visitor:
    """Somebody in front of the page."""

    def __init__(self, browser: Browser, address: str) -> None:
        self.page = browser.new_page(viewport={"width": 1366, "height": 768})
        self.page.goto(address)
        self.page.wait_for_selector("#live:not([hidden])")

    def until(self, expression: str) -> None:
        """Wait until an expression is true; the page may be loaded anew meanwhile."""
        from playwright.sync_api import Error

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


def dialogue(folder: Path) -> None:
    """Watch and steer a run, kill it and its server, go on, and compare what is left."""
    with chromium() as browser:
        talk(folder, browser)


def talk(folder: Path, browser: Browser) -> None:
    """Watch and steer a run in a browser."""
    path = folder / "run.db"
    words = ["--algorithm", "surrogate", "--points", "300", "--seed", "1"]
    run = begin(folder, *words)
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
        run = begin(folder, *words)
        bo.until(f"decisionPage.data.n >= {n_killed + 40}")
        bo.page.fill("#steerer", "Bo")
        bo.press("stop")
        assert run.wait() == 0
        anna.says("Bo: stop: done")
        n_stopped = len(read_table(path))
        anna.until(f"decisionPage.data.n == {n_stopped}")
        assert n_stopped < 320
        run = begin(folder, *words)
        anna.says("All planned tests are done")
        anna.until("decisionPage.data.n == 320")
        front = anna.page.evaluate("decisionPage.ranking.front.length")
        run.wait()
    table = read_table(path)
    designs, _ = evaluated(folder)
    assert len(table) == len({*designs}) == 320
    within = table.under(limits={name: limit[1] for name, limit in LIMITS.items()})
    assert front == within.feasible_ranking().pareto.sum()
    directed = [point for point, _, _, content in Study(path).proposals() if "request" in content]
    share = within.feasible()[np.isin(table.numbers, directed)].mean()
    assert share >= 0.8
    print(f"{len(directed)} proposals after 'Search here', {100 * share:.0f} % within the limits")
    print(f"{len(designs)} evaluations of 320 tests, with a run killed, stopped and continued")
    print(*[remark for remark in table.remarks if remark.startswith("Steered")], sep="\n")


def main(names: list[str]) -> None:
    """Do the parts named, or all."""
    print(describe_machine())
    # In this order: a process that has driven a browser had better not fork.
    parts = {
        "slowdown": slowdown,
        "computing": partial(slowdown, BUSY="yes"),
        "attack": attack,
        "updates": updates,
        "dialogue": dialogue,
    }
    for name in names or sized([*parts], ["slowdown", "attack", "updates"]):
        with tempfile.TemporaryDirectory() as folder:
            parts[name](Path(folder))
        os.chdir(Path(__file__).parent)


if __name__ == "__main__":
    from benchmarks import live as module  # workers must find Model under its name

    module.main(sys.argv[1:])
