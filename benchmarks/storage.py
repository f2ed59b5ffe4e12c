"""What a study costs: 10^6 tests of a vectorised model stored, read and found again.

    python -m benchmarks.storage [TESTS]

Beside it what SQLite itself takes for the same cells: ``executemany`` into the same table, in one
transaction, without checksums, blocks or locks.
"""

from __future__ import annotations

import os
import sqlite3
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from typing import TypeVar

from pymoo.optimize import minimize

from benchmarks.machine import describe_machine
from pymoo_psi import PSI, TestTable, VectorizedSphereChute, investigate

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


def main(tests: int) -> None:
    """Print every figure."""
    print(describe_machine())
    problem = VectorizedSphereChute(0.4)
    with tempfile.TemporaryDirectory(dir=os.getcwd()) as folder:
        study = os.path.join(folder, "study.db")
        table = timed("investigate without a study", tests, lambda: investigate(problem, tests))
        timed("investigate with a study", tests, lambda: investigate(problem, tests, study=study))
        print(f"{os.path.getsize(study) / tests:.0f} bytes a test")
        stored = timed("TestTable.read_study", tests, lambda: TestTable.read_study(study))
        assert stored.equals(table), "the study does not give back what was tested"
        timed("the finished run again", tests, lambda: investigate(problem, tests, study=study))
        plain_copy(study, os.path.join(folder, "plain.db"))
        small = os.path.join(folder, "small.db")
        for name in ("the first time", "again"):
            run = PSI(4096, study=small)
            label = f"minimize with PSI(4096) and a study, {name}"
            timed(label, 4096, partial(minimize, problem, run))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10**6)
