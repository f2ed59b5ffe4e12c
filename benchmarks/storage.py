"""What a study costs: 10^6 tests of a vectorised model stored, read and found again.

    python -m benchmarks.storage [TESTS]
    python -m benchmarks.storage --kills 30

Beside it what SQLite itself takes for the same cells: ``executemany`` into the same table, in one
transaction, without blocks or locks.

With ``--kills`` nothing is timed: eight processes test the shares of a run into one folder and are
killed and started again, at random moments, until the kills are used up; then they come to an end.
The model writes down every call. No stored test may be lost or evaluated again, and the folder must
be, bit for bit, the table of one run that nobody disturbed.
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

from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine
from pymoo_psi import PSI, VectorizedSphereChute, investigate
from pymoo_psi.table import read_table

T = TypeVar("T")


def timed(label: str, tests: int, function: Callable[[], T]) -> T:
    """Call a function and print how many tests a second it deals with."""
    began = time.perf_counter()
    result = function()
    took = time.perf_counter() - began
    print(f"{label}: {took:.1f} s, {tests / took:.0f} tests a second", flush=True)
    return result


def plain_copy(study: str, path: str) -> None:
    """Print what ``executemany`` takes for the rows of a study."""
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


SHARES = 8
POINTS = 8000


class Noted(ElementwiseProblem):
    """A model of some milliseconds that writes every design to a file before it evaluates it."""

    def __init__(self, log: str = "") -> None:
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0.0, xu=1.0)
        self.log = log

    def fingerprint(self) -> dict[str, Any]:
        """Return nothing: the log changes no value."""
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


def kill(kills: int) -> None:
    """Kill and start again the processes of a run, and look what is stored in the end."""
    chance, fork = random.Random(1), multiprocessing.get_context("fork")
    with tempfile.TemporaryDirectory(dir=os.getcwd()) as parent:
        folder = os.path.join(parent, "runs")
        runs: list[tuple[str, set[bytes]]] = []  # the log of each, and what was stored before

        def started(k: int) -> Any:
            path = os.path.join(folder, f"share-{k}-of-{SHARES}.db")
            stored = read_table(path).X if os.path.exists(path) else ()
            runs.append((os.path.join(parent, f"{len(runs)}.log"), {x.tobytes() for x in stored}))
            process = fork.Process(target=test_share, args=(folder, k, runs[-1][0]))
            process.start()
            return process

        processes = {k: started(k) for k in range(1, SHARES + 1)}
        killed = 0
        while killed < kills:
            time.sleep(chance.uniform(0, 0.4))
            # A share that nobody has killed for long may be finished.
            left = [k for k, process in processes.items() if process.is_alive()]
            assert left, f"all shares were finished after {killed} kills"
            k = chance.choice(left)
            processes[k].kill()
            processes[k].join()
            killed += processes[k].exitcode == -signal.SIGKILL
            processes[k] = started(k)
        for process in processes.values():
            process.join()
            assert process.exitcode == 0
        calls = 0
        for log, stored in runs:
            content = Path(log).read_bytes() if os.path.exists(log) else b""
            designs = [content[i : i + 16] for i in range(0, len(content), 16)]
            assert not stored.intersection(designs), "a stored test was evaluated again"
            calls += len(designs)
        table = read_table(folder)
    whole = minimize(Noted(), PSI(POINTS)).algorithm.table
    assert table.equals(whole), "the folder is not the run that nobody disturbed"
    print(
        f"{killed} kills over {SHARES} shares of {POINTS} points: {calls} calls of the model, "
        f"{calls - POINTS} of them for tests that were under way or not yet stored; no stored test "
        "evaluated again or lost; the table is that of one run, bit for bit"
    )


def main(tests: int) -> None:
    """Print every figure."""
    print(describe_machine())
    problem = VectorizedSphereChute(0.4)
    with tempfile.TemporaryDirectory(dir=os.getcwd()) as folder:
        study = os.path.join(folder, "study.db")
        table = timed("investigate without a study", tests, lambda: investigate(problem, tests))
        timed("investigate with a study", tests, lambda: investigate(problem, tests, study=study))
        print(f"{os.path.getsize(study) / tests:.0f} bytes a test")
        stored = timed("read_table", tests, lambda: read_table(study))
        assert stored.equals(table), "the study does not give back what was tested"
        timed("the finished run again", tests, lambda: investigate(problem, tests, study=study))
        plain_copy(study, os.path.join(folder, "plain.db"))
        small = os.path.join(folder, "small.db")
        for name in ("the first time", "again"):
            run = PSI(4096, study=small)
            label = f"minimize with PSI(4096) and a study, {name}"
            timed(label, 4096, partial(minimize, problem, run))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--kills"]:
        kill(int(sys.argv[2]))
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 10**6)
