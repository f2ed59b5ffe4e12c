"""The cost of a study: 10^6 tests of a vectorised model are stored and read.

    python -m benchmarks.storage
    python -m benchmarks.storage --kills 30

They are compared with SQLite itself for the same cells: ``executemany`` into the same table, in one
transaction, without blocks or locks, and ``fetchall``. What the model takes is subtracted.

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
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, processor_seconds, sized
from pymoo_psi import PSI, VectorizedSphereChute, investigate
from pymoo_psi.files import read_table

TESTS = sized(10**6, 2**12)
TIMES = 1.6  # as long as SQLite itself


def rows(folder: str) -> Iterator[tuple[str, str, str, float]]:
    """Yield lines: what is measured, the figure, the limit, and the figure as a share of it."""
    problem = VectorizedSphereChute(0.4)
    path = os.path.join(folder, "study.db")
    tables = []
    bare = processor_seconds(lambda: tables.append(investigate(problem, TESTS)))
    stored = processor_seconds(lambda: investigate(problem, TESTS, study=path)) - bare
    read = processor_seconds(lambda: tables.append(read_table(path)))
    assert tables[0].equals(tables[1]), "the study does not return what was tested"
    with closing(sqlite3.connect(path)) as db:
        (table,) = db.execute("SELECT sql FROM sqlite_master WHERE name = 'tests'").fetchone()
        fetched = processor_seconds(lambda: db.execute("SELECT * FROM tests").fetchall())
        cells = db.execute("SELECT * FROM tests").fetchall()
    with closing(sqlite3.connect(os.path.join(folder, "plain.db"))) as db:
        db.execute(table)
        insert = f"INSERT INTO tests VALUES ({', '.join('?' * len(cells[0]))})"
        inserted = processor_seconds(lambda: (db.executemany(insert, cells), db.commit()))
    for label, seconds, rival, of_rival in (
        ("tests stored", stored, "executemany", inserted),
        ("tests read", read, "fetchall", fetched),
    ):
        limit = f"{TIMES} times the time of `{rival}`, {TESTS / of_rival:.0f}"
        yield label, f"{TESTS / seconds:.0f} a second", limit, seconds / of_rival / TIMES


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


def main() -> None:
    """Print the figures."""
    print(describe_machine())
    with tempfile.TemporaryDirectory(dir=os.getcwd()) as folder:
        for label, figure, limit, ratio in rows(folder):
            print(f"{label}: {figure}, limit {limit}, ratio {ratio:.2f}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:]:
        kill(int(sys.argv[2]))
    else:
        main()
