"""The cost of a study: 10^6 tests of a vectorised model are stored, read and recalled.

Then single designs are evaluated by ``Recorded``, and read again.

    python -m benchmarks.storage [TESTS]
    python -m benchmarks.storage --kills 30

They are compared with SQLite itself for the same cells: ``executemany`` into the same table, in one
transaction, without blocks or locks.

With ``--kills`` nothing is timed. Eight processes test the shares of a run into one folder; they
are killed and restarted at random moments, until there have been so many kills, and then finish.
The model writes every call to a file. No stored test may be lost or evaluated again, and the table
of the folder must be bit-identical to that of one undisturbed run.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
import sqlite3
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, sized
from pymoo_psi import PSI, Recorded, VectorizedSphereChute, investigate
from pymoo_psi.files import read_table

T = TypeVar("T")


def timed(label: str, tests: int, function: Callable[[], T]) -> T:
    """Call a function and print how many tests a second it processes."""
    began = time.perf_counter()
    result = function()
    seconds = time.perf_counter() - began
    print(f"{label}: {seconds:.1f} s, {tests / seconds:.0f} tests a second", flush=True)
    return result


def plain_copy(study: str, path: str) -> None:
    """Print the time of ``executemany`` for the rows of a study."""
    with closing(sqlite3.connect(study)) as db:
        (statement,) = db.execute("SELECT sql FROM sqlite_master WHERE name = 'tests'").fetchone()
        rows = db.execute("SELECT * FROM tests").fetchall()
    marks = ", ".join("?" * len(rows[0]))
    with closing(sqlite3.connect(path)) as db:
        db.execute(statement)

        def insert() -> None:
            db.executemany(f"INSERT INTO tests VALUES ({marks})", rows)
            db.commit()

        timed("plain executemany of the same rows", len(rows), insert)


def single_designs(study: str) -> None:
    """Print the median times of a new and of a known design by ``Recorded``."""
    problem = Recorded(VectorizedSphereChute(0.4), study=study)
    points = np.random.default_rng(1).random((200, problem.n_var))
    designs = problem.xl + points * (problem.xu - problem.xl)
    for label in ("new", "known"):
        times = []
        for design in designs:
            began = time.perf_counter()
            problem.evaluate(design)
            times.append(time.perf_counter() - began)
        print(f"a {label} design by Recorded: {1000 * np.median(times):.2f} ms", flush=True)


SHARES = 8
POINTS = sized(8000, 400)


class Noted(ElementwiseProblem):
    """A model of a few milliseconds that writes every design to a file before evaluating it."""

    def __init__(self, log: str = "") -> None:
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0.0, xu=1.0)
        self.log = log

    def fingerprint(self) -> dict[str, Any]:
        """Return nothing, as the log changes no value."""
        return {}

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        if self.log:
            file = os.open(self.log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            os.write(file, x.tobytes())  # at once: a kill leaves all of it, or nothing
            os.close(file)
            time.sleep(0.003)
        out["F"] = [x[0] ** 2 + x[1], (1 - x[0]) ** 2 + x[1]]
        out["G"] = [x[0] - 0.9]


def test_share(folder: str, k: int, log: str) -> None:
    """Test what is left of a share."""
    minimize(Noted(log), PSI(POINTS, study=folder, share=(k, SHARES), block_size=20))


class Shares:
    """The processes that test the shares of a run.

    Args:
        parent: A folder for the study and the logs.

    Attributes:
        folder: The folder of the study.
        processes: The running process of each share.
        runs: For each process, its log and the designs stored before it.
    """

    def __init__(self, parent: str) -> None:
        self.folder = os.path.join(parent, "runs")
        self.processes: dict[int, Any] = {}
        self.runs: list[tuple[str, set[bytes]]] = []
        self._parent = parent
        for k in range(1, SHARES + 1):
            self.start(k)

    def start(self, k: int) -> None:
        """Start a process for a share."""
        path = os.path.join(self.folder, f"share-{k}-of-{SHARES}.db")
        stored = set()
        if os.path.exists(path):
            stored = {x.tobytes() for x in read_table(path).X}
        log = os.path.join(self._parent, f"{len(self.runs)}.log")
        self.runs.append((log, stored))
        fork = multiprocessing.get_context("fork")
        self.processes[k] = fork.Process(target=test_share, args=(self.folder, k, log))
        self.processes[k].start()

    def kill_one(self, chance: random.Random) -> bool:
        """Kill a process and start it again; return whether the kill came before its end."""
        alive = [k for k, process in self.processes.items() if process.is_alive()]
        assert alive, "all shares were finished before the last kill"
        k = chance.choice(alive)
        process = self.processes[k]
        process.kill()
        process.join()
        self.start(k)
        return process.exitcode == -signal.SIGKILL

    def finish(self) -> None:
        """Wait for all processes."""
        for process in self.processes.values():
            process.join()
            assert process.exitcode == 0

    def n_calls(self) -> int:
        """Return the number of calls of the model, none of them for a stored test."""
        calls = 0
        for log, stored in self.runs:
            if not os.path.exists(log):
                continue
            content = Path(log).read_bytes()
            designs = [content[i : i + 16] for i in range(0, len(content), 16)]
            assert not stored.intersection(designs), "a stored test was evaluated again"
            calls += len(designs)
        return calls


def kill(kills: int) -> None:
    """Kill and restart the processes of a run, and check what is stored in the end."""
    chance = random.Random(1)
    with tempfile.TemporaryDirectory(dir=os.getcwd()) as parent:
        shares = Shares(parent)
        n_killed = 0
        while n_killed < kills:
            time.sleep(chance.uniform(0, 0.4))
            if shares.kill_one(chance):
                n_killed += 1
        shares.finish()
        calls = shares.n_calls()
        table = read_table(shares.folder)
    whole = minimize(Noted(), PSI(POINTS)).algorithm.table
    assert table.equals(whole), "the folder is not the undisturbed run"
    print(
        f"{n_killed} kills over {SHARES} shares of {POINTS} points: {calls} calls of the model, "
        f"{calls - POINTS} of them repeated, as they were interrupted or not yet stored; no stored "
        "test was evaluated again or lost; the table is bit-identical to that of one run"
    )


def main(tests: int) -> None:
    """Print all figures."""
    print(describe_machine())
    problem = VectorizedSphereChute(0.4)
    with tempfile.TemporaryDirectory(dir=os.getcwd()) as folder:
        study = os.path.join(folder, "study.db")
        table = timed("investigate without a study", tests, lambda: investigate(problem, tests))
        timed("investigate with a study", tests, lambda: investigate(problem, tests, study=study))
        print(f"{os.path.getsize(study) / tests:.0f} bytes a test")
        stored = timed("read_table", tests, lambda: read_table(study))
        assert stored.equals(table), "the study does not return what was tested"
        timed("the finished run again", tests, lambda: investigate(problem, tests, study=study))
        plain_copy(study, os.path.join(folder, "plain.db"))
        single_designs(study)
        small = os.path.join(folder, "small.db")
        for name in ("the first time", "again"):
            run = PSI(4096, study=small)
            label = f"minimize with PSI(4096) and a study, {name}"
            timed(label, 4096, partial(minimize, problem, run))


if __name__ == "__main__":
    arguments = sys.argv[1:]
    if not arguments:
        main(sized(10**6, 2**12))
    elif arguments[0] == "--kills":
        kill(int(arguments[1]))
    else:
        main(int(arguments[0]))
