"""Processes killed again and again in the middle of their work, and what is left of it.

    python -m benchmarks.kills [recorded] [surrogate] [asynchronous] [KILLS]

``recorded``: NSGA-III over a ``Recorded`` problem. After every kill each test that was stored must
still be there, with the same values, and must never be evaluated again; in the end table and front
must be, bit for bit, those of a run that nobody disturbed. Anything else ends with an error.

``surrogate``: SurrogatePSI with a study, likewise.

``asynchronous``: SurrogatePSI whose four workers do not wait for each other. What it proposes
depends on which design is done first, so there is no other run to compare with; but no test may be
lost, or evaluated again, and all that was proposed must be tested.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine
from pymoo_psi import FailureTolerant, JoblibRunner, Recorded, SurrogatePSI, TestTable, nsga3
from pymoo_psi.algorithms import _run
from pymoo_psi.study import Study
from pymoo_psi.table import read_table

EVALUATIONS = 20  # for each kill
FURTHER = 3  # evaluations in one of which, or between which, a kill comes


class Logged(ElementwiseProblem):
    """A model with constraints and failures that notes in a file what it evaluates."""

    def __init__(self, log: Path, **kwargs: Any) -> None:
        super().__init__(n_var=3, n_obj=2, n_ieq_constr=1, xl=0, xu=1, **kwargs)
        self.log = log

    def _evaluate(self, x: Any, out: Any, *args: Any, **kwargs: Any) -> None:
        append(self.log, x.tobytes().hex())
        time.sleep(0.002)
        if x[2] > 0.8:
            raise ArithmeticError("no convergence")
        out["F"] = [x[0] + x[2] ** 2, 1 - x[0] + x[1] ** 2]
        out["G"] = np.floor(3 * x[1] + 2 * x[2]) - 1


_allowed = float("inf")  # lines that this process may still write; then it waits for its kill


def append(log: Path, line: str) -> None:
    """Add a line to a file, whole whatever happens to this process."""
    global _allowed
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.write(file, f"{line}\n".encode())
    os.close(file)
    _allowed -= 1
    while _allowed <= 0:
        signal.pause()


def lines(log: Path) -> list[str]:
    """Return the lines of a file, none if there is no such file."""
    return log.read_text().splitlines() if log.exists() else []


def started(job: Callable[[], object], allowed: float = float("inf")) -> int:
    """Begin a job in a fork of this process that may write so many lines; return its id."""
    global _allowed
    pid = os.fork()
    if pid == 0:
        try:
            _allowed = allowed
            job()
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    return pid


def killed(job: Callable[[], object], log: Path, kills: int, lines_each: int) -> Iterator[int]:
    """Kill a job again and again, then let it end.

    Args:
        job: What is begun anew after every kill.
        log: The file in which it notes its work.
        kills: How often it is killed.
        lines_each: How many notes it writes at most before it is killed.

    Yields:
        The number of the kill, after each; ``kills`` after the end.
    """
    chance = random.Random(1)
    for kill in range(kills):
        wanted = chance.randrange(lines_each) if kill else 0  # at first while the file is made
        # On a busy machine the kill comes late; it must not come after the end.
        seen, pid = len(lines(log)), started(job, wanted + FURTHER)
        while len(lines(log)) < seen + wanted:
            assert os.waitpid(pid, os.WNOHANG) == (0, 0), f"it ended before kill {kill + 1}"
            time.sleep(0.001)
        time.sleep(chance.uniform(0, 0.01))
        os.kill(pid, signal.SIGKILL)
        assert os.waitpid(pid, 0)[1] == signal.SIGKILL, f"it ended before kill {kill + 1}"
        yield kill
    assert os.waitpid(started(job), 0)[1] == 0
    yield kills


def recorded(folder: Path, kills: int) -> None:
    """Kill a recorded run of NSGA-III."""
    log, path = folder / "log", folder / "run.db"

    _run.SECONDS = 0.0  # a commit for each result, so that kills come between them

    def search(log: Path, study: Path) -> Any:
        problem = Recorded(FailureTolerant(Logged(log)), study=study)
        return nsga3(problem, n_evaluations=EVALUATIONS * kills, seed=1)

    stored, checked = _checked(lambda: search(log, path), log, path, kills)
    expected, result = search(folder / "log 2", folder / "undisturbed.db"), search(log, path)
    assert stored.equals(expected.problem.table), "the table is another one"
    for name in ("X", "F", "G", "test_point"):
        assert result.opt.get(name).tobytes() == expected.opt.get(name).tobytes(), name
    assert checked == len(lines(log)), "the finished run was evaluated again"
    lost = checked - len(stored)
    print(
        f"recorded: {kills} kills, {len(stored)} tests, table and front of {len(expected.opt)} bit "
        f"for bit those of an undisturbed run; {lost} evaluations under way were repeated"
    )


def surrogate(folder: Path, kills: int) -> None:
    """Kill a run that learns from its tests."""
    log, path = folder / "log", folder / "run.db"

    def search(log: Path, study: Path) -> SurrogatePSI:
        algorithm = SurrogatePSI(EVALUATIONS * kills, study=study)
        return minimize(Logged(log), algorithm, seed=1).algorithm

    stored, checked = _checked(lambda: search(log, path), log, path, kills)
    expected, found = search(folder / "log 2", folder / "undisturbed.db"), search(log, path)
    assert stored.equals(expected.table), "the table is another one"
    assert found.table.equals(expected.table), "the run that goes on has another table"
    assert checked == len(lines(log)), "the finished run was evaluated again"
    lost = checked - len(stored)
    print(
        f"surrogate: {kills} kills, {len(stored)} tests, table bit for bit that of an undisturbed "
        f"run; {lost} evaluations under way were repeated"
    )


def asynchronous(folder: Path, kills: int) -> None:
    """Kill a run that learns from its tests while others are being made."""
    log, path, n = folder / "log", folder / "run.db", EVALUATIONS * kills

    def search() -> SurrogatePSI:
        problem = Logged(log, elementwise_runner=JoblibRunner(4, in_process=False))
        algorithm = SurrogatePSI(n, study=path, asynchronous=True)
        return minimize(problem, algorithm, seed=1).algorithm

    # its workers write on while this process is late to kill it
    stored, checked = _checked(search, log, path, kills, EVALUATIONS)
    found = search()
    assert found.table.equals(stored), "the run that goes on has another table"
    assert stored.numbers.tolist() == list(range(1, n + 1)), "a proposal was not tested"
    assert checked == len(lines(log)), "the finished run was evaluated again"
    proposed = Study(path).proposals(1, n)
    units = np.array([content["point"] for *_, content in proposed])
    assert np.array_equal(stored.X[-len(units) :].astype(float), units), "another design was tested"
    early = sum("pending" in content for *_, content in proposed)
    assert early, "no round was proposed before the end of the last one"
    print(
        f"asynchronous: {kills} kills, {n} tests, {early} of {len(units)} proposed while others "
        f"were being tested; {checked - n} evaluations under way were repeated"
    )


def _checked(
    job: Callable[[], object], log: Path, path: Path, kills: int, lines_each: int = 2 * EVALUATIONS
) -> tuple[TestTable, int]:
    """Kill a job; return what is stored in the end, and how many designs were evaluated."""
    stored, checked = TestTable.empty(), 0
    for _ in killed(job, log, kills, lines_each):
        designs = {row.tobytes().hex() for row in stored.X}
        again = [line for line in lines(log)[checked:] if line in designs]
        assert not again, f"{len(again)} stored designs were evaluated again"
        checked = len(lines(log))
        table = read_table(path) if path.exists() else TestTable.empty()
        left = table.rows(np.isin(table.numbers, stored.numbers))
        assert len(stored) == 0 or left.equals(stored), "stored tests were lost or changed"
        stored = table
    return stored, checked


CASES = {"recorded": recorded, "surrogate": surrogate, "asynchronous": asynchronous}


def main(cases: list[str], kills: int) -> None:
    """Run the cases."""
    print(describe_machine())
    for case in cases or list(CASES):
        began = time.monotonic()
        with tempfile.TemporaryDirectory(dir=os.getcwd()) as folder:
            CASES[case](Path(folder), kills)
        print(f"{time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    main([word for word in sys.argv[1:] if not word.isdigit()], *numbers or [30])
