"""Parameter Space Investigation on arrays, for many cheap designs.

``minimize(problem, PSI(n))`` goes in blocks small enough to be watched. Here the points pass
through the problem in large blocks, and only what is wanted is kept.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Collection, Generator, Iterator, Mapping
from contextlib import closing
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import integer, invalid, job_count, known_name
from pymoo_psi.algorithms._blocks import LEAST, Keep, arriving, raise_failure
from pymoo_psi.algorithms._outputs import table_of_values
from pymoo_psi.algorithms._plan import Plan
from pymoo_psi.algorithms._repeats import Repeats
from pymoo_psi.algorithms._sampling import UniformSampling, uniform_sampling
from pymoo_psi.algorithms._store import COMPUTED, SECONDS, Memory, stored_at_termination
from pymoo_psi.parallel import JoblibRunner, Result, Values, Waiting, active_workers, progress_bar
from pymoo_psi.problems._evaluation import (
    columns_of_values,
    evaluate_designs,
    stream_designs,
    streams,
)
from pymoo_psi.problems._failures import FAILURE_ACTIONS, untolerant
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.table import Limits, TestTable, bounds_of

_KEPT = ("all", "feasible", "pareto")
# Rows from which on a Pareto set is sifted on the way. Each time there are twice as many rows as
# were left, so that all sifting together takes as long as the last one, or twice that.
_WORTH_SIFTING = 2**17
# Points that may be evaluated beyond the block that is asked for, while that has not all results:
# as many as can be held easily where all are going to be tested, and a few for each worker where a
# termination may end the run. At 8 a worker, the slowest of a block takes as long as 8 others.
_FAR = 4096
_NEAR = 8


def investigate(
    problem: Any,
    n_points: int,
    *,
    first: int = 1,
    sampling: UniformSampling | None = None,
    seed: int | None = None,
    limits: Limits | None = None,
    keep: str = "all",
    block_size: int | None = None,
    progress: bool = False,
    n_jobs: int = 1,
    share: tuple[int, int] | None = None,
    study: str | PathLike[str] | None = None,
    study_key: str | None = None,
    retry: str | Collection[int] = (),
    on_failure: str = "record",
    names: Mapping[str, str] | None = None,
    maximize: Collection[str] | None = None,
    units: Mapping[str, str] | None = None,
) -> TestTable:
    """Test the points of a uniform sequence and return the table of tests.

    The result is that of ``minimize(problem, PSI(n_points)).algorithm.table``; a vectorised
    problem is evaluated at millions of points in seconds, on as many cores as are asked for.
    Memory grows with what is kept, and with the size of a block and the number of cores. A design
    that occurs again is not evaluated again, as in :class:`PSI`, except where ``n_jobs`` is not 1.

    Args:
        problem: A pymoo problem with finite bounds.
        n_points: How many points to test.
        first: Number of the first point, from 1.
        sampling: Where the points come from; as for :class:`PSI`.
        seed: Seed of a randomised sampling.
        limits: Limits that a feasible design must keep, for ``keep``; see :class:`TestTable`.
        keep: ``"all"`` tests, the ``"feasible"`` ones or the ``"pareto"`` set of these.
        block_size: Points tested at a time; by default 65 536 of a vectorised problem, else 64.
        progress: Show a progress bar, in a terminal or a notebook.
        n_jobs: Processes for a vectorised problem, or workers of the cluster that
            ``joblib.parallel_config`` names; -1 for as many as there are. The table does not
            depend on it. A problem that is evaluated one design at a time has a runner of its own,
            :class:`~pymoo_psi.JoblibRunner`.
        share: As for :class:`PSI`.
        study: Name of a study file, as for :class:`PSI`.
        study_key: As for :class:`PSI`.
        retry: As for :class:`PSI`.
        on_failure: As for :class:`PSI`.
        names: As for :class:`PSI`.
        maximize: As for :class:`PSI`.
        units: As for :class:`PSI`.

    Returns:
        The table of the tests kept, by number.

    Raises:
        ArgumentValueError: A count is out of range, ``keep`` or a limit is unknown, or the
            problem does not fit, as for :class:`PSI`.
        ArgumentTypeError: An argument has the wrong type.
        StudyError: As for :class:`PSI`.
        EvaluationError: A design failed and ``on_failure`` is ``"raise"``.
        WorkerError: The problem cannot be sent to processes, or one of them was lost.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 10_000, keep="pareto")
        >>> bool(table.pareto().all())
        True
    """
    require_problem(problem)
    n_points = integer("n_points", n_points, minimum=1)
    first = integer("first", first, minimum=1)
    if block_size is None:
        # 65 536 designs fill NumPy's loops and take some megabytes; 64 let a progress bar move.
        block_size = 64 if problem.elementwise else 65_536
    block_size = integer("block_size", block_size, minimum=1)
    keep = known_name("keep", keep, _KEPT)
    if job_count("n_jobs", n_jobs) != 1 and problem.elementwise:
        rule = "1 for a problem that is evaluated one design at a time"
        remedy = "give the problem elementwise_runner=JoblibRunner(n_jobs)"
        raise invalid("n_jobs", rule, n_jobs, remedy)
    stop = known_name("on_failure", on_failure, FAILURE_ACTIONS) == "raise"
    problem, stop = untolerant(problem, stop)
    plan = Plan.of(
        problem,
        n_points,
        first=first,
        sampling=uniform_sampling(sampling),
        seed=seed,
        limits=limits,
        memory=Memory.of(study, retry, share),
        study_key=study_key,
        names=names,
        maximize=maximize,
        units=units,
    )
    kept = Keep(keep, limits)
    workers = active_workers(n_jobs)
    threads = 1 if workers.kind == "cluster" else workers.count  # a cluster's are elsewhere
    done = 0
    tables = [plan.table]
    size = least = 0  # how many rows there are, and had been left when they were sifted last
    with progress_bar(progress) as bar:

        def show(_: TestTable, tested: int) -> None:
            nonlocal done
            done += tested
            bar(done / len(plan.points))

        blocks = tested(plan, kept, stop=stop, block_size=block_size, n_jobs=n_jobs, show=show)
        with stored_at_termination(), closing(blocks):
            for table, _ in blocks:
                tables.append(table)
                size += len(table)
                if keep == "pareto" and size > max(2 * least, _WORTH_SIFTING):
                    front = by_number(tables)
                    tables = [front.rows(kept.mask(front, threads))]
                    size = least = len(tables[0])
    found = by_number(tables)
    if keep == "pareto":
        found = found.rows(kept.mask(found, threads))
    # A limit on what no test gives is refused; of failed tests alone nobody knows what they give.
    if keep != "all" or (found.status != "failed").any():
        bounds_of(limits, found.layout)
    return found


def tested(
    plan: Plan,
    keep: Keep,
    *,
    stop: bool,
    block_size: int,
    n_jobs: int,
    show: Callable[[TestTable, int], None],
) -> Generator[tuple[TestTable, int]]:
    """Test all points of a plan and give what is kept of each block, blocks in any order.

    Whoever may leave amid them closes this, which ends the workers.

    Args:
        plan: What is tested.
        keep: What is kept.
        stop: Whether a design that fails ends the run.
        block_size: Points in a block, at most.
        n_jobs: Workers for a vectorised problem, as joblib has them.
        show: Is given tests as they arrive, those of the study as well, or those of them that are
            kept, and how many have arrived.

    Yields:
        The tests kept, and for how many tests of the block the model was called.
    """
    # Designs that can occur again are looked up, so that a model is called once for each.
    if plan.problem.elementwise or (plan.space.finite and n_jobs == 1):
        tests = Investigation(plan, stop, whole=True, show=lambda table: show(table, len(table)))
        try:
            for start in range(0, len(plan.points), block_size):
                table, evaluated = tests.tested(start, block_size)
                yield table.rows(keep.mask(table)), evaluated
        finally:
            tests.close()
    else:
        for table, n_tested, evaluated in arriving(
            plan, keep, stop=stop, block_size=block_size, n_jobs=n_jobs
        ):
            show(table, n_tested)
            yield table, evaluated


def by_number(tables: list[TestTable]) -> TestTable:
    """Return tables that have no test in common as one, by number."""
    table = tables[0].extended(*tables[1:])
    if (np.diff(table.numbers) < 0).any():
        table = table.rows(np.argsort(table.numbers))
    return table


PROPOSAL_ROUND = "proposal_round"
"""Name of the output that tells points of the sequence, 0, from proposals, by their round."""


class Investigation:
    """The testing of a problem: its points are evaluated, or taken from a study.

    The designs of a model that is evaluated one by one are a single stream to its workers: while
    a block still waits for its slowest design, the other workers are at the next points. A design
    that occurs again, as only variables that are not real can make it, takes the known result.

    Args:
        plan: What is tested.
        stop: Whether a design that fails ends the run.
        whole: Whether all points are going to be tested, or the run may be ended before.
        show: Is given the tests as they arrive, those of the study as well.

    Attributes:
        space: The variables of the problem.
        layout: The columns of the test table that the problem promises: names, senses, bounds.
        numbers: ``(n,)`` the numbers of the points, rising.
        points: ``(n, n_var)`` the points of the unit cube.
        rounds: ``(n,)`` in which round each was proposed, 0 if it is of a sequence; it becomes a
            column of the table. ``None`` where nothing is proposed.
    """

    def __init__(
        self,
        plan: Plan,
        stop: bool,
        *,
        whole: bool,
        show: Callable[[TestTable], None] | None = None,
    ) -> None:
        problem = plan.problem
        self.problem, self.memory, self.stop = problem, plan.memory, stop
        self.space, self.layout = plan.space, plan.table.layout
        cut = plan.points.cut(range(len(plan.points)))
        self.numbers, self.points = cut.numbers, cut.units
        self._piece = 1  # how many designs take a few seconds, as far as pieces have shown
        self._streams, runner = streams(problem), problem.elementwise_runner
        self._ahead = 0  # points that may be evaluated beyond the block that is asked for
        if self._streams and isinstance(runner, JoblibRunner):
            self._ahead = _FAR if whole else _NEAR * active_workers(runner.n_jobs).count
        self.rounds: NDArray[np.float64] | None = None
        self._show = show
        self._called = np.zeros(len(self.numbers), dtype=bool)  # points with a call of the model
        self._hand = TestTable.empty(self.layout)  # tests that are not given out yet
        self._repeats = Repeats() if self.space.finite else None
        if self._repeats is not None:
            self._repeats.learn(self.memory.everything(self.layout))
        self._stream: Generator[bool] | None = None
        self._look_from(0)

    def aim(self, numbers: NDArray[np.int64], points: NDArray[np.float64]) -> None:
        """Take other points, the first of which are those tested so far; nothing is under way."""
        self.numbers, self.points = numbers, points
        called = np.zeros(len(numbers), dtype=bool)
        called[: len(self._called)] = self._called[: len(numbers)]
        self._called = called
        self._look_from(self._end)

    def _look_from(self, start: int) -> None:
        """Begin anew at a point; nothing is being evaluated then."""
        self._start = self._end = self._opened = start  # of the block asked for; of those looked at
        self._missing = np.zeros(len(self.numbers), dtype=bool)  # looked at, and not in hand
        self._waiting: Waiting = deque()  # those of them that nobody evaluates yet
        self._rows = np.zeros(0, dtype=np.intp)  # likewise, of a model evaluated in pieces
        self._group: list[Result] = []  # results that have arrived and are not stored
        if self._repeats is not None:
            self._repeats.forget()

    def __getstate__(self) -> dict[str, Any]:
        """Copies begin where this one is; what is being evaluated stays here."""
        transient = {"_stream", "_missing", "_waiting", "_rows", "_group", "_show"}
        return {name: v for name, v in self.__dict__.items() if name not in transient}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Start as one that has nothing under way."""
        self.__dict__.update(state, _stream=None, _show=None)
        self._look_from(self._end)

    def tested(self, start: int, count: int) -> tuple[TestTable, int]:
        """Test consecutive points; what arrives is stored within a second or two.

        Args:
            start: Index of the first of them, the one after those of the last call.
            count: How many, at most.

        Returns:
            The tests, and for how many of them the model was called.

        Raises:
            EvaluationError: A design failed and the run is to stop; it is in the study as failed.
        """
        end = min(start + count, len(self.numbers))
        if self._stream is None:
            self._look_from(start)
            self._open(end)
        else:
            self._open(end + self._ahead)
        self._start, self._end = start, end
        with stored_at_termination():
            try:
                # Where all is stored there is nothing to test, and the study is not even locked.
                if self._stream is None and self._missing.any():
                    self._stream = self._arrivals()
                while self._stream is not None:
                    if not self._missing[start:end].any() and self._missing[end:].any():
                        break  # at the points ahead
                    if not next(self._stream, False):
                        # Nothing is under way: the lock is given back, workers are kept.
                        self._stream = None
                self._flush()
            except BaseException:
                self.close()
                raise
        numbers, first, last = self._hand.numbers, self.numbers[start], self.numbers[end - 1]
        table = by_number([self._hand.rows((numbers >= first) & (numbers <= last))])
        self._hand = self._hand.rows(numbers > last)
        return table, int(self._called[start:end].sum())

    def close(self) -> None:
        """Give up what is being evaluated; what has arrived is stored, and kept for later."""
        if self._stream is not None:
            stream, self._stream = self._stream, None
            stream.close()

    def _open(self, end: int) -> None:
        """Look at the points up to an index: what is stored is in hand, the others wait."""
        start, self._opened = self._opened, max(self._opened, min(end, len(self.numbers)))
        numbers = self.numbers[start : self._opened]
        if len(numbers) == 0:
            return
        stored = self.memory.recall(self.layout, numbers)
        stored = stored.rows(~np.isin(stored.numbers, self._hand.numbers))
        if len(stored):
            self._give(stored)
        rows = start + np.flatnonzero(~np.isin(numbers, self._hand.numbers))
        X = self.space.matrix(self.points[rows])
        if self._repeats is not None:
            self._repeats.learn(stored)
            new, known = self._repeats.met(rows.tolist(), X)
            self._group += [(i, values, 0.0) for i, values in known]
            self._missing[rows] = True
            self._missing[[i for i, _ in known]] = False
            X, rows = X[np.isin(rows, new)], np.array(new, dtype=np.intp)
        else:
            self._missing[rows] = True
        if self._streams:
            self._waiting.extend(zip(rows.tolist(), self.space.designs(X), strict=True))
        else:
            self._rows = np.concatenate([self._rows, rows])

    def _arrivals(self) -> Generator[bool]:
        """Evaluate the points that wait; each step brings at least one result."""
        with self.memory.writing():
            self._flush()
            end = self._end
            if self.memory.study is not None:
                # Again: another process may have stored some before this one had the lock.
                self._look_from(self._start)
            self._end = end
            self._open(end + self._ahead)
            try:
                yield from self._one_by_one() if self._streams else self._in_pieces()
            finally:
                self._flush()

    def _one_by_one(self) -> Iterator[bool]:
        began, computed = time.monotonic(), 0.0
        while self._waiting:
            results = stream_designs(self.problem, self._waiting, one_by_one=self.stop)
            with closing(results):
                for index, values, seconds in results:
                    self._called[index] = True
                    self._arrive(index, values, seconds)
                    computed += seconds
                    if (
                        (self.stop and values["failure"])
                        or computed >= COMPUTED
                        or time.monotonic() - began >= SECONDS
                    ):
                        self._flush()
                        began, computed = time.monotonic(), 0.0
                    yield True

    def _in_pieces(self) -> Iterator[bool]:
        """Evaluate points of vectorised models, or by a runner that takes batches.

        The pieces grow until one takes about a second; however slow the model, a piece has a
        design for every worker.
        """
        problem = self.problem
        if self.memory.study is None and not (problem.elementwise and self.stop):
            least = len(self.points)
        elif problem.elementwise:
            least = active_workers(getattr(problem.elementwise_runner, "n_jobs", -1)).count
        else:
            least = LEAST
        while len(self._rows):
            size = max(least, self._piece)
            piece, self._rows = self._rows[:size], self._rows[size:]
            X = self.space.matrix(self.points[piece])
            began = time.monotonic()
            out = evaluate_designs(problem, self.space.designs(X))
            took = max(time.monotonic() - began, 1e-6)
            # a first design, which loads libraries, says little: at most 100 times as many
            self._piece = int(len(piece) * min(SECONDS / took, 100))
            self._called[piece] = True
            if self._repeats is None:
                self._missing[piece] = False
                self._put(piece, X, out, np.full(len(piece), took / len(piece)))
            else:
                for k, index in enumerate(piece.tolist()):
                    values = {name: column[k] for name, column in out.items()}
                    self._arrive(index, values, took / len(piece))
                self._flush()
            yield True

    def _arrive(self, index: int, values: Values, seconds: float) -> None:
        """Take the values of a point, and of those with the same design."""
        again = [] if self._repeats is None else self._repeats.arrived(index, values)
        self._group += [(index, values, seconds), *((i, values, 0.0) for i in again)]
        self._missing[[index, *again]] = False

    def _flush(self) -> None:
        """Store the results that have arrived."""
        group, self._group = self._group, []
        if group:
            indices, values, seconds = zip(*group, strict=True)
            rows = np.array(indices)
            out = columns_of_values(self.problem, list(values))
            self._put(rows, self.space.matrix(self.points[rows]), out, np.array(seconds))

    def table(self, rows: NDArray[np.intp], X: NDArray[Any], out: Mapping[str, Any]) -> TestTable:
        """Return the tests of evaluated points, given by their indices."""
        if self.rounds is not None:
            # An output of that name is the model's.
            out = {PROPOSAL_ROUND: self.rounds[rows], **out}
        return table_of_values(self.layout, self.numbers[rows], X, out)

    def _put(
        self, rows: NDArray[np.intp], X: NDArray[Any], out: Mapping[str, Any], seconds: ArrayLike
    ) -> None:
        """Make tests of evaluated points, store them and have them in hand."""
        tests = self.table(rows, X, out)
        self.memory.keep(tests, seconds)
        self._give(tests)
        if self.stop:
            raise_failure(tests)

    def _give(self, tests: TestTable) -> None:
        self._hand = self._hand.extended(tests)
        if self._show is not None:
            self._show(tests)
