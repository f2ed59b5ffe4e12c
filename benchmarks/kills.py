"""Processes that are killed repeatedly during their work, and what remains of it.

    python -m benchmarks.kills [recorded] [surrogate] [asynchronous] [evidence] [KILLS]

``recorded``: NSGA-III on a ``Recorded`` problem. After every kill, each stored test must still be
there with the same values, and must never be evaluated again. In the end, table and front must be
bit-identical to those of an undisturbed run. Otherwise an error is raised.

``surrogate``: SurrogatePSI with a study, under the same conditions.

``asynchronous``: SurrogatePSI with four workers that never wait for one another. Its proposals
depend on which design is finished first, so there is no undisturbed run to compare with. No test
may be lost or evaluated again, and all proposals must be tested.

``evidence``: four processes on one study: PSI, SurrogatePSI, NSGA-II on a ``Recorded`` problem, and
tests that people are asked for and tell. What a process has been told of as stored, it writes to a
file. In the end every design has one test with the right values, and all that was written is there.
"""

from __future__ import annotations

import os
import random
import signal
import sqlite3
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, sized
from pymoo_psi import (
    PSI,
    FailureTolerant,
    ProcessRunner,
    Recorded,
    Restricted,
    SurrogatePSI,
    TestTable,
    nsga3,
)
from pymoo_psi.algorithms import RunOptions, _run, ask_tests, tell_tests
from pymoo_psi.files import read_table
from pymoo_psi.study import Study

EVALUATIONS = 20  # for each kill
FURTHER = 3  # a kill comes during or between so many evaluations


class Logged(ElementwiseProblem):
    """A model with a constraint and failures that writes every evaluated design to a file."""

    def __init__(self, log: Path, **kwargs: Any) -> None:
        super().__init__(n_var=3, n_obj=2, n_ieq_constr=1, xl=0, xu=1, **kwargs)
        self.log = log

    def _evaluate(self, x: Any, out: Any, *args: Any, **kwargs: Any) -> None:
        append(self.log, x.tobytes().hex())
        time.sleep(0.002)
        if x[2] > 0.8:
            raise ArithmeticError("no convergence")
        *out["F"], out["G"] = values_of(x)


_allowed = float("inf")  # lines that this process may still write; then it waits for its kill


def append(log: Path, line: str) -> None:
    """Add a line to a file, completely or not at all if the process is killed."""
    global _allowed
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.write(file, f"{line}\n".encode())
    os.close(file)
    _allowed -= 1
    while _allowed <= 0:
        signal.pause()


def lines(log: Path) -> list[str]:
    """Return the lines of a file, none if there is no such file."""
    if not log.exists():
        return []
    return log.read_text().splitlines()


def started(job: Callable[[], object], allowed: float = float("inf")) -> int:
    """Start a job in a fork of this process that may write so many lines; return its id."""
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
    """Kill a job repeatedly, then let it finish.

    Args:
        job: The job, which is started again after every kill.
        log: The file in which it writes its evaluations.
        kills: How often it is killed.
        lines_each: Lines that it writes at most before it is killed.

    Yields:
        The number of the kill, after each; ``kills`` after the end.
    """
    chance = random.Random(1)
    for kill in range(kills):
        wanted = 0  # the first kill comes while the file is created
        if kill > 0:
            wanted = chance.randrange(lines_each)
        n_before = len(lines(log))
        # On a busy machine the kill comes late; it must not come after the end.
        pid = started(job, wanted + FURTHER)
        while len(lines(log)) < n_before + wanted:
            assert os.waitpid(pid, os.WNOHANG) == (0, 0), f"it ended before kill {kill + 1}"
            time.sleep(0.001)
        time.sleep(chance.uniform(0, 0.01))
        os.kill(pid, signal.SIGKILL)
        _, status = os.waitpid(pid, 0)
        assert status == signal.SIGKILL, f"it ended before kill {kill + 1}"
        yield kill
    _, status = os.waitpid(started(job), 0)
    assert status == 0
    yield kills


def recorded(folder: Path, kills: int) -> None:
    """Kill a recorded run of NSGA-III."""
    log = folder / "log"
    path = folder / "run.db"
    _run.SECONDS = 0.0  # a commit for each result, so that kills come between them

    def search(log: Path, study: Path) -> Any:
        problem = Recorded(FailureTolerant(Logged(log)), study=study)
        return nsga3(problem, n_evaluations=EVALUATIONS * kills, seed=1)

    stored, n_evaluated = _checked(lambda: search(log, path), log, path, kills)
    expected = search(folder / "log 2", folder / "undisturbed.db")
    result = search(log, path)
    assert stored.equals(expected.problem.table), "the table is another one"
    for name in ("X", "F", "G", "test_point"):
        assert result.opt.get(name).tobytes() == expected.opt.get(name).tobytes(), name
    assert n_evaluated == len(lines(log)), "the finished run was evaluated again"
    print(
        f"recorded: {kills} kills, {len(stored)} tests, table and front of {len(expected.opt)} "
        f"bit-identical to those of an undisturbed run; {n_evaluated - len(stored)} interrupted "
        "evaluations were repeated"
    )


def surrogate(folder: Path, kills: int) -> None:
    """Kill a run that learns from its tests."""
    log = folder / "log"
    path = folder / "run.db"

    def search(log: Path, study: Path) -> SurrogatePSI:
        algorithm = SurrogatePSI(EVALUATIONS * kills, study=study)
        return minimize(Logged(log), algorithm, seed=1).algorithm

    stored, n_evaluated = _checked(lambda: search(log, path), log, path, kills)
    expected = search(folder / "log 2", folder / "undisturbed.db")
    continued = search(log, path)
    assert stored.equals(expected.table), "the table is another one"
    assert continued.table.equals(expected.table), "the continued run has another table"
    assert n_evaluated == len(lines(log)), "the finished run was evaluated again"
    print(
        f"surrogate: {kills} kills, {len(stored)} tests, table bit-identical to that of an "
        f"undisturbed run; {n_evaluated - len(stored)} interrupted evaluations were repeated"
    )


def asynchronous(folder: Path, kills: int) -> None:
    """Kill a run that proposes designs while others are being tested."""
    log = folder / "log"
    path = folder / "run.db"
    n = EVALUATIONS * kills

    def search() -> SurrogatePSI:
        problem = Logged(log, elementwise_runner=ProcessRunner(4))
        algorithm = SurrogatePSI(n, study=path, asynchronous=True)
        return minimize(problem, algorithm, seed=1).algorithm

    # its workers write more lines before this process kills it
    stored, n_evaluated = _checked(search, log, path, kills, EVALUATIONS)
    continued = search()
    assert continued.table.equals(stored), "the continued run has another table"
    assert stored.numbers.tolist() == list(range(1, n + 1)), "a proposal was not tested"
    assert n_evaluated == len(lines(log)), "the finished run was evaluated again"
    proposals = [content for point, _, _, content in Study(path).proposals() if point <= n]
    points = np.array([content["point"] for content in proposals])
    tested = stored.X[-len(points) :].astype(float)
    assert np.array_equal(tested, points), "another design was tested"
    n_early = sum("pending" in content for content in proposals)
    assert n_early > 0, "no round was proposed before the end of the last one"
    print(
        f"asynchronous: {kills} kills, {n} tests, {n_early} of {len(points)} proposed while others "
        f"were being tested; {n_evaluated - n} interrupted evaluations were repeated"
    )


def _checked(
    job: Callable[[], object], log: Path, path: Path, kills: int, lines_each: int = 2 * EVALUATIONS
) -> tuple[TestTable, int]:
    """Kill a job; return what is stored in the end, and how many designs were evaluated."""
    stored = TestTable.empty()
    n_checked = 0
    for _ in killed(job, log, kills, lines_each):
        designs = {row.tobytes().hex() for row in stored.X}
        repeated = designs.intersection(lines(log)[n_checked:])
        assert not repeated, f"{len(repeated)} stored designs were evaluated again"
        n_checked = len(lines(log))
        table = TestTable.empty()
        if path.exists():
            table = read_table(path)
        if len(stored) > 0:
            remaining = table.take(np.isin(table.numbers, stored.numbers))
            assert remaining.equals(stored), "stored tests were lost or changed"
        stored = table
    return stored, n_checked


def evidence(folder: Path, kills: int) -> None:
    """Kill four processes at random that write different runs of one study."""
    log = folder / "log"
    path = folder / "study.db"
    kept = folder / "kept"  # the designs that a process knows to be stored
    options: dict[str, Any] = {"study": path, "study_wait": 600.0}
    n = EVALUATIONS * max(kills // 4, 1)

    def note(X: Any) -> None:
        for x in X:
            append(kept, np.array(x, dtype=float).tobytes().hex())

    def noted(algorithm: Any) -> None:
        note(algorithm.off.get("X"))

    def psi() -> None:
        minimize(Logged(log), PSI(n, block_size=8, **options), callback=noted)

    def learn() -> None:
        algorithm = SurrogatePSI(min(n, 200), batch=8, **options)
        minimize(Restricted(Logged(log), {"x1": (0.25, 0.5)}), algorithm, seed=1, callback=noted)

    def nsga2() -> None:
        problem = Recorded(FailureTolerant(Logged(log)), **options)
        minimize(problem, NSGA2(16), ("n_gen", -(-n // 16)), seed=1, callback=noted)

    def people() -> None:
        """Test designs of the sequence, by other values than the model's."""
        problem = Logged(folder / "log of people")
        asked = RunOptions(**options, seed=3, sampling="halton")
        while len(_tests_of(path, "halton")) < n // 4:
            frame = ask_tests(problem, 0, asked)
            if len(frame) == 0:
                frame = ask_tests(problem, 4, asked)
            X = frame[["x1", "x2", "x3"]].to_numpy()
            for row, x in enumerate(X):
                frame.loc[row, ["f1", "f2", "g1"]] = [*values_of(x)]
            tell_tests(frame, path)
            note(X)

    jobs = [psi, learn, nsga2, people]
    chance = random.Random(2)
    pids = {started(job): job for job in jobs}
    n_killed = 0
    while pids:
        time.sleep(chance.uniform(0.05, 0.4))
        for pid in [*pids]:
            ended, status = os.waitpid(pid, os.WNOHANG)
            if ended:
                assert status == 0
                del pids[pid]
        if pids and n_killed < kills:
            pid = chance.choice([*pids])
            os.kill(pid, signal.SIGKILL)
            _, status = os.waitpid(pid, 0)
            job = pids.pop(pid)
            if status == signal.SIGKILL:
                pids[started(job)] = job
                n_killed += 1
    n_evaluated = len(lines(log))
    for job in jobs:
        job()
    assert len(lines(log)) == n_evaluated, "a complete run was evaluated again"
    table = read_table(path)
    designs = [row.tobytes().hex() for row in table.X.astype(float)]
    assert len({*designs}) == len(designs), "a design has two tests"
    lost = {*lines(kept)}.difference(designs)
    assert not lost, f"{len(lost)} stored designs were lost"
    for x, f, status in zip(table.X, table.F, table.status, strict=True):
        if status == "failed":
            assert x[2] > 0.8
        else:
            assert tuple(f) == values_of(x)[:2]
    n_tested = len(table) - len(_tests_of(path, "halton"))
    print(
        f"evidence: {n_killed} kills of 4 processes, {len(table)} tests of "
        f"{len(Study(path).facts().runs)} runs, each design once and right, and all of "
        f"{len({*lines(kept)})} that were reported as stored; "
        f"{n_evaluated - n_tested} evaluations were interrupted or made by two at once"
    )


def _tests_of(path: Path, origin: str) -> list[int]:
    """Return the numbers of the tests of an origin."""
    if not path.exists():
        return []
    query = "SELECT test FROM tests WHERE status NOT NULL AND origin LIKE ? || '%'"
    with closing(sqlite3.connect(path, timeout=60)) as db:
        return [test for (test,) in db.execute(query, (origin,))]


def values_of(x: Any) -> tuple[float, float, float]:
    """Return the objectives and the constraint of a design."""
    constraint = float(np.floor(3 * x[1] + 2 * x[2]) - 1)
    return x[0] + x[2] ** 2, 1 - x[0] + x[1] ** 2, constraint


CASES = {
    "recorded": recorded,
    "surrogate": surrogate,
    "asynchronous": asynchronous,
    "evidence": evidence,
}


def main(words: list[str]) -> None:
    """Run the cases that are named, all by default."""
    print(describe_machine())
    kills = sized(30, 2)
    cases = []
    for word in words:
        if word.isdigit():
            kills = int(word)
        else:
            cases.append(word)
    for case in cases or CASES:
        began = time.monotonic()
        with tempfile.TemporaryDirectory(dir=os.getcwd()) as folder:
            CASES[case](Path(folder), kills)
        print(f"{time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
