"""The engine: it streams designs to workers and gives tests, each stored before it is given.

The designs of a model that is evaluated one by one are a single stream to its workers: while a
block still waits for its slowest design, the other workers are at the next points. Points of a
vectorised model go in pieces that take about a second, here or in processes, where each is made,
evaluated and filtered; a few for each worker are on their way, so that memory does not grow with
the number of points. The table is the same for any number of workers and any size of a block.
"""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Generator, Iterator, Mapping
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import identity_text, integer, invalid
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._outputs import table_of_values, values_of_table
from pymoo_psi.algorithms._points import Points, Sequence
from pymoo_psi.algorithms._sampling import default_sampling, sampling_name
from pymoo_psi.algorithms._store import COMPUTED, SECONDS, Store, stored_at_termination
from pymoo_psi.errors import EvaluationError, PsiError, WorkerError
from pymoo_psi.parallel import (
    JoblibRunner,
    Result,
    Values,
    Waiting,
    active_workers,
    in_parallel,
    one_line,
)
from pymoo_psi.problems import (
    DesignSpace,
    columns_of_values,
    design_space,
    evaluate_designs,
    problem_identity,
    problem_layout,
    require_problem,
    stream_designs,
    streams,
    untolerant,
)
from pymoo_psi.table import (
    Layout,
    Limits,
    TestTable,
    bounds_of,
    design_keys,
    lacking,
    real_column,
)

# Designs in the first piece of a run with a study: enough to tell what one takes, and few enough
# that a model of seconds a design loses minutes only.
_LEAST = 64
# Pieces without a study: so many for each worker that the last ones end at about the same time.
_PIECES = 8
# Points that may be evaluated beyond the block that is asked for, while that has not all results:
# as many as can be held easily where all are going to be tested, and a few for each worker where a
# termination may end the run. At 8 a worker, the slowest of a block takes as long as 8 others.
_FAR = 4096
_NEAR = 8


@dataclass(frozen=True)
class Keep:
    """Which tests of a run are kept.

    Attributes:
        what: ``"all"`` tests, the ``"feasible"`` ones or the ``"pareto"`` set of these.
        limits: Limits that a feasible design must keep.
    """

    what: str = "all"
    limits: Limits | None = None

    def mask(self, tests: TestTable) -> NDArray[np.bool_]:
        """``(n,)`` which tests are kept."""
        if self.what == "all":
            return np.ones(len(tests), dtype=bool)
        if lacking(self.limits, tests.layout):
            return np.zeros(len(tests), dtype=bool)
        if self.what == "feasible":
            return tests.feasible(self.limits)
        return tests.pareto(self.limits)


class Block(NamedTuple):
    """Tests as they arrive.

    Attributes:
        tests: Those of n tests that are kept.
        called: ``(n,)`` for which of the n the model was called.
    """

    tests: TestTable
    called: NDArray[np.bool_]


class Engine:
    """The testing of points of a problem: they are evaluated, or taken from a study.

    Args:
        problem: A pymoo problem.
        n_points: How many points the run has, those of other shares too.
        options: The options of the run.
        keep: Which tests are given; in blocks, all.
        n_jobs: Processes for a vectorised problem, or workers of the cluster that joblib is
            configured for; -1 for all there are.
        whole: Whether all points are going to be tested, or the run may be ended before.
        further: How many designs are proposed later and numbered after the points.
        method: By what, for the study.

    Attributes:
        problem: The problem, not tolerant of failures.
        space: Its variables.
        table: The test table without tests: the columns that the problem promises, and what
            problem it is.
        points: The points; others may take their place between two blocks.
        store: The study, if there is one.
    """

    def __init__(
        self,
        problem: Any,
        n_points: int,
        options: RunOptions,
        *,
        keep: Keep | None = None,
        n_jobs: int = 1,
        whole: bool = True,
        further: int = 0,
        method: str = "",
    ) -> None:
        require_problem(problem)
        integer("n_points", n_points, minimum=1)
        self.problem, self._stop = untolerant(problem, options.on_failure == "raise")
        self.space = design_space(self.problem)
        columns = options.names, options.maximize, options.units
        layout = problem_layout(self.problem, self.space, *columns)
        n_dim = len(self.space.free.variables)
        sampling = options.sampling or default_sampling(n_dim)
        points = Sequence(options, n_points, sampling, n_dim)
        first, last = points.first, points.last + further
        for number in options.retry if options.retry != "failed" else ():
            if not first <= int(number) <= last:
                raise invalid("retry", f"numbers of points of this run, {first} to {last}", number)
        _require_limits(options.limits, layout, self.space)

        def identity() -> dict[str, Any]:
            name = sampling_name(sampling, n_points, options.seed) + method
            known = problem_identity(self.problem, self.space)
            known |= {"sampling": name, "key": options.study_key}
            return dict(json.loads(identity_text(known)))

        self.points: Sequence | Points = points
        self.store, self.table = Store(options), TestTable.empty(layout)
        # Shares must be of the same points, whether they are stored or not.
        if self.store.study is not None or self.store.share.of > 1:
            self.table = replace(self.table, problem=identity())
            self.store.begin(identity(), layout, (first, last))
        else:
            self.store.layout = layout
            with suppress(PsiError):  # a run without a study needs none that files can hold
                self.table = replace(self.table, problem=identity())
        self._keep = keep or Keep()
        self._streams, elementwise = streams(self.problem), self.problem.elementwise
        runner = self.problem.elementwise_runner
        workers = active_workers(getattr(runner, "n_jobs", -1)).count if elementwise else 1
        self._ahead = 0  # points that may be evaluated beyond the block that is asked for
        if self._streams and isinstance(runner, JoblibRunner):
            self._ahead = _FAR if whole else _NEAR * workers
        self._repeats = _Repeats() if self.space.finite and (elementwise or n_jobs == 1) else None
        if self._repeats is not None:
            self._repeats.learn(self.store.known_designs())
        # 65 536 designs fill NumPy's loops and take some megabytes; 64 let a progress bar move.
        self._largest = options.block_size or (64 if elementwise else 65_536)
        self._grows = self.store.study is not None or (elementwise and self._stop)
        self._least = workers if elementwise else min(_LEAST, self._largest)
        self._size = self._least if self._grows else self._largest  # of a piece
        count = 1 if n_jobs == 1 else active_workers(n_jobs).count
        self._n_jobs = n_jobs if count > 1 else 1
        if count > 1:
            self._size = min(self._size, max(_LEAST, -(-len(points) // (_PIECES * count))))
        self._hand = TestTable.empty(layout)  # tests that are not given out yet
        self._called = np.zeros(0, dtype=np.int64)  # numbers of those with a call of the model
        self._look_from(0, 0)

    def _look_from(self, start: int, end: int) -> None:
        """Begin at a row of the points; nothing is being evaluated then."""
        self._opened, self._end = start, end  # rows below were looked at; are asked for
        self._left = 0  # rows looked at and asked for that have not arrived
        self._waiting: Waiting = deque()  # designs that nobody evaluates yet, by row
        self._rows = np.zeros(0, dtype=np.intp)  # as these, of a model evaluated in pieces
        self._under_way: set[int] = set()  # rows that wait or are being evaluated one by one
        self._group: list[Result] = []  # results that have arrived and are not stored
        self._ready: list[Block] = []  # what has arrived and is not given
        self._steps: Generator[bool] | None = None
        if self._repeats is not None:
            self._repeats.waiting.clear()

    def __getstate__(self) -> dict[str, Any]:
        """Copies begin where this one is; what is being evaluated stays here."""
        here = {"_waiting", "_rows", "_under_way", "_group", "_ready", "_steps", "_lock"}
        return {name: value for name, value in self.__dict__.items() if name not in here}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Start as one that has nothing under way."""
        self.__dict__.update(state)
        self._look_from(0, 0)

    def tests(self) -> Generator[Block]:
        """Test all points; blocks come in any order, those of the study too.

        Close it early to stop the workers.

        Raises:
            EvaluationError: A design failed and the run is to stop; it is in the study as failed.
            WorkerError: A worker process was lost, or the problem cannot be sent to one.
        """
        self._look_from(0, len(self.points))
        if self._keep.what == "all":  # too large a table is refused now, not after hours
            np.empty((len(self.points), 1 + len(self.table.layout.columns)))
        with closing(self._run()) as steps:
            for _ in steps:
                ready, self._ready = self._ready, []
                yield from ready
        yield from self._ready

    def block(self, start: int, count: int) -> tuple[TestTable, int]:
        """Test consecutive points; what arrives is stored within a second or two.

        Args:
            start: Row of the first of them, the one after those of the last call.
            count: How many, at most.

        Returns:
            The tests, and for how many of them the model was called.

        Raises:
            EvaluationError: A design failed and the run is to stop; it is in the study as failed.
        """
        end = min(start + count, len(self.points))
        first, last = self.points.at(np.array([start, end - 1])).numbers
        self._end, self._left = end, sum(row < end for row in self._under_way)
        complete = None
        with stored_at_termination():
            try:
                while True:
                    if self._ready or complete is None:
                        self._take()
                        numbers = self._hand.numbers
                        mine = (numbers >= first) & (numbers <= last)
                        complete = int(mine.sum()) == end - start
                    # Where nothing is under way the lock is given back; workers are kept.
                    if complete and (self._steps is None or self._under_way):
                        break
                    if self._steps is None:
                        self._look_from(start, end)
                        self._steps = self._run()
                    if not next(self._steps, False):
                        self._steps = None
            except BaseException:
                self.close()
                raise
        tests, self._hand = by_number([self._hand.rows(mine)]), self._hand.rows(numbers > last)
        called, self._called = self._called, self._called[self._called > last]
        return tests, len(called) - len(self._called)

    def close(self) -> None:
        """Give up what is being evaluated; what has arrived is stored, and kept for later."""
        if self._steps is not None:
            steps, self._steps = self._steps, None
            steps.close()
        self._take()

    def tests_of(self, rows: range | NDArray[np.intp], X: Any, out: Mapping[str, Any]) -> TestTable:
        """Return the tests of evaluated designs, given by the rows of their points."""
        return table_of_values(self.table.layout, self.points.at(rows), X, out)

    def _take(self) -> None:
        """Have in hand what has arrived."""
        if self._ready:
            new = [block.tests.numbers[block.called] for block in self._ready]
            self._hand = self._hand.extended(*(block.tests for block in self._ready))
            self._called = np.concatenate([self._called, *new])
            self._ready = []

    def _run(self) -> Generator[bool]:
        """Evaluate the points that wait; each step brings at least one result."""
        with ExitStack() as self._lock:
            self._locked = self.store.study is None
            try:
                yield from self._one_by_one() if self._streams else self._in_pieces()
            finally:
                self._flush()

    def _open(self, until: int) -> None:
        """Look at the points below a row: what is stored is ready, the others wait."""
        rows, self._opened = np.arange(self._opened, until), until
        known = self._hand.numbers
        if self.store.study is not None:
            numbers = self.points.at(rows).numbers
            stored = self.store.recall(numbers)
            if len(stored) < len(numbers) and not self._locked:
                # From here on no other process tests points; one may have stored some meanwhile.
                self._lock.enter_context(self.store.writing())
                self._locked = True
                stored = self.store.recall(numbers)
            stored = stored.rows(~np.isin(stored.numbers, known))
            self._give(stored, called=False)
            if self._repeats is not None:
                self._repeats.learn(stored)
            known = np.append(known, stored.numbers)
        if len(known):
            rows = rows[~np.isin(self.points.at(rows).numbers, known)]
        if self._repeats is not None and len(rows):
            rows, again = self._repeats.new(rows, self._matrix(rows))
            self._put_again(again)
        self._left += int((rows < self._end).sum())
        if not self._streams:
            self._rows = np.append(self._rows, rows)
        elif len(rows):
            designs = self.space.designs(self._matrix(rows))
            self._waiting.extend(zip(rows.tolist(), designs, strict=True))
            self._under_way.update(rows.tolist())

    def _matrix(self, rows: NDArray[np.intp]) -> NDArray[Any]:
        return self.space.matrix(self.points.at(rows).units)

    def _one_by_one(self) -> Iterator[bool]:
        """Evaluate designs by workers that do not wait for each other."""

        def top_up(ahead: int) -> None:
            until = min(self._end + ahead, len(self.points))
            while self._opened < until and len(self._waiting) < _FAR:
                self._open(min(until, self._opened + _FAR))

        began, computed = time.monotonic(), 0.0
        top_up(0)
        while self._waiting:
            top_up(self._ahead)
            results = stream_designs(self.problem, self._waiting, one_by_one=self._stop)
            with closing(results):
                for row, values, seconds in results:
                    self._group.append((row, values, seconds))
                    self._under_way.discard(row)
                    self._left -= row < self._end
                    computed += seconds
                    if (
                        self._left == 0
                        or (self._stop and values["failure"])
                        or computed >= COMPUTED
                        or time.monotonic() - began >= SECONDS
                    ):
                        self._flush()
                        began, computed = time.monotonic(), 0.0
                    yield True
                    top_up(self._ahead)

    def _flush(self) -> None:
        """Store the results that have arrived."""
        group, self._group = self._group, []
        if group:
            indices, values, seconds = zip(*group, strict=True)
            rows = np.array(indices)
            out = columns_of_values(self.problem, list(values))
            self._put(self.tests_of(rows, self._matrix(rows), out), np.array(seconds))

    def _in_pieces(self) -> Iterator[bool]:
        """Evaluate points by calls for many, here or in processes."""
        every = self._grows or self._stop or self._repeats is not None
        task = _Task(self.problem, self.space, self.table.layout, self._keep, every)
        pieces = self._pieces()
        done = map(task, pieces) if self._n_jobs == 1 else _on_workers(task, pieces, self._n_jobs)
        for tests, kept, seconds in done:
            if every:
                self._put(tests, seconds, kept)
            else:
                self._ready.append(Block(tests, np.ones(len(kept), dtype=bool)))
            if self._grows:
                # The first designs, which load libraries, say little: at most 100 times as many.
                fitting = min(SECONDS / max(seconds, 1e-9), 100 * len(kept))
                self._size = max(self._least, min(self._largest, int(fitting)))
            yield True

    def _pieces(self) -> Iterator[Points]:
        while True:
            while len(self._rows) < self._size and self._opened < self._end:
                self._open(min(self._end, self._opened + self._largest))
            if len(self._rows) == 0:
                return
            piece, self._rows = self._rows[: self._size], self._rows[self._size :]
            yield self.points.at(piece)

    def _put(
        self, tests: TestTable, seconds: ArrayLike, kept: NDArray[np.bool_] | None = None
    ) -> None:
        """Store tests, and those of the same designs."""
        self.store.keep(tests, seconds)
        self._give(tests, called=True, kept=kept)
        if self._stop:
            raise_failure(tests)
        if self._repeats is not None:
            self._put_again(self._repeats.learn(tests))

    def _put_again(self, again: list[tuple[int, Values]]) -> None:
        """Store tests of designs whose values are known, given by the rows of their points."""
        if again:
            rows = np.array([row for row, _ in again])
            out = columns_of_values(self.problem, [values for _, values in again])
            tests = self.tests_of(rows, self._matrix(rows), out)
            self.store.keep(tests, 0.0)
            self._give(tests, called=False)

    def _give(
        self, tests: TestTable, *, called: bool, kept: NDArray[np.bool_] | None = None
    ) -> None:
        if self._keep.what != "all":
            kept = self._keep.mask(tests) if kept is None else kept
            self._ready.append(Block(tests.rows(kept), np.full(len(tests), called)))
        elif len(tests):
            self._ready.append(Block(tests, np.full(len(tests), called)))


class _Piece(NamedTuple):
    """What comes back of a piece of a vectorised model.

    Attributes:
        tests: All its tests, or those kept.
        kept: ``(n,)`` which of its n tests are kept.
        seconds: What the evaluation of a design took.
    """

    tests: TestTable
    kept: NDArray[np.bool_]
    seconds: float


@dataclass(frozen=True, eq=False)
class _Task:
    """The testing of some points; it is sent to processes.

    Attributes:
        problem: A problem, not tolerant of failures.
        space: Its variables.
        layout: The columns of its test table.
        keep: What is kept.
        every: Whether all tests come back, beside which are kept.
    """

    problem: Any
    space: DesignSpace
    layout: Layout
    keep: Keep
    every: bool

    def __call__(self, points: Points) -> _Piece:
        """Test some points."""
        began = time.monotonic()
        X = self.space.matrix(points.units)
        out = evaluate_designs(self.problem, self.space.designs(X))
        seconds = (time.monotonic() - began) / len(points)
        tests = table_of_values(self.layout, points, X, out)
        kept = self.keep.mask(tests)
        if not self.every and not kept.all():
            tests = tests.rows(kept)
        return _Piece(tests, kept, seconds)


def _on_workers(task: _Task, pieces: Iterator[Points], n_jobs: int) -> Iterator[_Piece]:
    try:
        with closing(in_parallel(task, pieces, n_jobs)) as done:
            for _, piece in done:
                yield piece
    except PsiError:
        raise
    except Exception as error:  # joblib's backends have errors of their own for this
        raise WorkerError(
            f"the workers did not give back what they were sent: {one_line(error)}; a problem must "
            "be one that pickle can send, and a block (block_size) fit into a worker's memory"
        ) from error


class _Repeats:
    """The results of a run by design, where designs recur as no variable is real.

    Attributes:
        known: The values of every design that is known.
        waiting: For each design being evaluated, the other rows with it.
    """

    def __init__(self) -> None:
        self.known: dict[tuple[str, ...], Values] = {}
        self.waiting: dict[tuple[str, ...], list[int]] = {}

    def learn(self, tests: TestTable) -> list[tuple[int, Values]]:
        """Learn the results of tests; return the rows that waited for them, with their values."""
        again: list[tuple[int, Values]] = []
        for key, values in zip(design_keys(tests.X), values_of_table(tests), strict=True):
            self.known.setdefault(key, values)
            again += [(row, values) for row in self.waiting.pop(key, ())]
        return again

    def new(
        self, rows: NDArray[np.intp], X: NDArray[Any]
    ) -> tuple[NDArray[np.intp], list[tuple[int, Values]]]:
        """Return which rows are to be evaluated, and those whose values are known.

        Args:
            rows: ``(k,)`` rows of points.
            X: ``(k, n_var)`` their designs.
        """
        new, again = [], []
        for row, key in zip(rows.tolist(), design_keys(X), strict=True):
            if key in self.known:
                again.append((row, self.known[key]))
            elif key in self.waiting:
                self.waiting[key].append(row)
            else:
                self.waiting[key] = []
                new.append(row)
        return np.array(new, dtype=np.intp), again


def _require_limits(limits: Limits | None, layout: Layout, space: DesignSpace) -> None:
    """Refuse limits that no test can meet, before there are tests."""
    # A column that the problem does not promise may be an output, which its tests will tell.
    if isinstance(limits, Mapping):
        columns = layout.columns
        limits = {k: v for k, v in limits.items() if k in columns or not isinstance(k, str)}
    limited = bounds_of(limits, layout)
    for name, variable in zip(layout.variables, space.variables, strict=True):
        if name in limited and variable.kind is Kind.CHOICE:
            plain = (o.item() if isinstance(o, np.generic) else o for o in variable.options)
            real_column(name, np.fromiter(plain, object))


def raise_failure(tests: TestTable) -> None:
    """Raise the error of the first test that failed, if there is one."""
    for number, reason in tests.reasons.items():
        raise EvaluationError(tests.X[tests.numbers == number][0], reason)


def by_number(tables: list[TestTable]) -> TestTable:
    """Return tables that have no test in common as one, by number."""
    table = tables[0].extended(*tables[1:])
    if (np.diff(table.numbers) < 0).any():
        table = table.rows(np.argsort(table.numbers))
    return table
