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
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, nullcontext, suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, identity_text, integer, invalid, mapping
from pymoo_psi.algorithms._limits import kept_tests, require_limits
from pymoo_psi.algorithms._run import (
    SECONDS,
    Points,
    RunOptions,
    Store,
    in_groups,
    stored_at_termination,
)
from pymoo_psi.errors import PsiError
from pymoo_psi.parallel import JoblibRunner, Result, Values, Waiting, active_workers, in_parallel
from pymoo_psi.problems import (
    DesignSpace,
    columns_of_values,
    design_space,
    evaluate_designs,
    problem_identity,
    problem_layout,
    required,
    stream_designs,
    streams,
    untolerant,
    without_requirements,
)
from pymoo_psi.study import LAST
from pymoo_psi.table import (
    PROPOSAL_ROUND,
    RESERVED,
    Layout,
    TestTable,
    design_keys,
)

Rows = NDArray[np.intp]
Kept = Callable[[TestTable], TestTable]
# Those of n tests that are kept, and ``(n,)`` for which of the n the model was called.
Block = tuple[TestTable, NDArray[np.bool_]]

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
_ENDED = object()


class Engine:
    """The testing of points of a problem: they are evaluated, or taken from a study.

    Args:
        problem: A pymoo problem.
        n_points: How many points the run has, those of other shares too; ``None`` if designs are
            given as ``points``, one batch after the other.
        options: The options of the run.
        keep: Which tests are given, ``"all"``, ``"feasible"`` or ``"pareto"``; in blocks, all.
        n_jobs: Processes for a vectorised problem; -1 for as many as there are cores.
        whole: Whether all points are going to be tested, or the run may be ended before.
        method: By what designs are proposed later, for the study.

    Attributes:
        problem: The problem, not tolerant of failures.
        model: It without its requirements.
        space: Its variables.
        table: The test table without tests: the columns that the problem promises, and what
            problem it is.
        points: The points; others may take their place between two blocks.
        store: The study, if there is one.
        n_workers: How many workers evaluate designs without waiting for each other, or 0.
        extend: Adds points while workers have nothing to do, or ``None``: then they wait for the
            end of the block.
    """

    def __init__(
        self,
        problem: Any,
        n_points: int | None,
        options: RunOptions,
        *,
        keep: str = "all",
        n_jobs: int = 1,
        whole: bool = True,
        method: str = "",
    ) -> None:
        self.problem = required(untolerant(problem), options.requirements)
        self.model = without_requirements(self.problem)
        names = mapping("names", options.names or {}, "names such as f1 to your own")
        default = {own: name for name, own in names.items()}
        log = options.log if options.log is None else [default.get(n, n) for n in options.log]
        self.space = design_space(self.problem, log=log)
        columns = options.names, options.maximize, options.units
        layout = problem_layout(self.problem, self.space, *columns)
        self._keep, self._limits = keep, options.limits
        require_limits(options.limits, layout)
        n_dim = len(self.space.searched)
        self.points = Points(np.zeros(0, dtype=np.int64), n_dim)
        if n_points is not None:
            integer("n_points", n_points, minimum=1)
            if options.fill:
                n_points = self._points_to_fill(n_points, options)
            self.points = options.points(n_points, n_dim)
        self.table = TestTable.empty(layout)
        # Shares must be of the same points, whether they are stored or not; a run without a study
        # needs no identity that a file can hold.
        strict = options.study is not None or options.part.of > 1
        with nullcontext() if strict else suppress(PsiError):
            sampling = options.sampling_in(n_dim)
            name = sampling.identity(n_points, options.seed) if n_points else ""
            identity = problem_identity(self.problem, self.space)
            text = identity_text(identity | {"sampling": name + method, "key": options.study_key})
            self.table = replace(self.table, problem=json.loads(text))
        self.store = Store(options, self.table)
        elementwise, runner = self.problem.elementwise, self.problem.elementwise_runner
        self._streams = streams(self.model)
        workers = active_workers(getattr(runner, "n_jobs", -1)) if elementwise else 1
        self.n_workers = self._ahead = 0  # points evaluated beyond the block that is asked for
        if self._streams and isinstance(runner, JoblibRunner):
            self.n_workers, self._ahead = workers, _FAR if whole else _NEAR * workers
        self.extend: Callable[[], None] | None = None
        recurring = self.space.finite and (elementwise or n_jobs == 1)
        self._repeats = _Repeats(self.store.known()) if recurring else None
        self._n_jobs = 1 if n_jobs == 1 else active_workers(n_jobs)
        # 65 536 designs fill NumPy's loops and take some megabytes; 64 let a progress bar move.
        # With a study there are few at first, and then as many as take a second.
        self._largest = options.block_size or (64 if elementwise else 65_536)
        self._least = min(workers if elementwise else _LEAST, self._largest)
        if n_points is None:  # models may take a batch for what belongs together
            self._largest = self._least = LAST
        self._size = self._largest if self.store.study is None else self._least
        if self._n_jobs > 1:
            many = -(-len(self.points) // (_PIECES * self._n_jobs))
            self._size = min(self._size, max(_LEAST, many))
        # Rows of points below the first were looked at, below the second they are asked for.
        self._opened = self._wanted = 0
        self._under_way: dict[int, None] = {}  # rows without a test among those looked at, in order
        self._arrived: list[Block] = []  # tests of the others that are not given yet
        self._steps: Generator[None] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Copies begin at the next block; what is being evaluated stays here."""
        return {**self.__dict__, "_under_way": {}, "_arrived": [], "_lock": None, "_steps": None}

    def tests(self) -> Generator[Block]:
        """Test all points; blocks come in any order, those of the study too.

        Close it early to stop the workers.

        Raises:
            WorkerError: A worker process was lost, or the problem cannot be sent to one.
        """
        self._wanted = len(self.points)
        with closing(self._run(0)) as steps:
            for _ in steps:
                while self._arrived:
                    yield self._arrived.pop(0)
        yield from self._arrived

    def block(self, start: int, count: int) -> tuple[TestTable, int]:
        """Test consecutive points; what arrives is stored within a second or two.

        Args:
            start: Row of the first of them, the one after those of the last call.
            count: How many, at most.

        Returns:
            The tests, and for how many of them the model was called.
        """
        self._wanted = end = min(start + count, len(self.points))
        last = self.points.numbers[end - 1]
        with stored_at_termination(self.store):
            try:
                while sum((t.numbers <= last).sum() for t, _ in self._arrived) < end - start:
                    if self._steps is None:
                        self._steps = self._run(start + sum(len(t) for t, _ in self._arrived))
                    if next(self._steps, _ENDED) is _ENDED:
                        self._steps = None
                if self._steps is not None and not self._under_way:
                    deque(self._steps, maxlen=0)  # which gives the lock back; workers are kept
                    self._steps = None
            except BaseException:
                self.close()
                raise
        tests = self.arrived()
        called = np.concatenate([called for _, called in self._arrived])
        mine = tests.numbers <= last
        self._arrived = [] if mine.all() else [(tests.rows(~mine), called[~mine])]
        return by_number([tests.rows(mine)]), int(called[mine].sum())

    @property
    def n_idle(self) -> int:
        """How many designs are to be added, or 0 as long as workers need not wait for the block.

        A quarter as many as there are workers are to wait, lest these do while some are proposed.
        """
        free = self.n_workers - len(self._under_way)
        return free + max(1, self.n_workers // 4) if self.extend and free >= 0 else 0

    def arrived(self) -> TestTable:
        """Return the tests that no block has given yet, as they have arrived."""
        return self.table.extended(*(tests for tests, _ in self._arrived))

    def close(self) -> None:
        """Give up what is being evaluated; what has arrived is in the study, if there is one."""
        if self._steps is not None:
            self._steps.close()
        self._steps, self._arrived, self._under_way = None, [], {}

    def tests_of(self, rows: Rows, values: Sequence[Values], X: Any = None) -> TestTable:
        """Return the tests of points, given by their rows and values, of designs X if others."""
        points = self.points.at(rows)
        X = points.matrix(self.space) if X is None else X
        n = self.model.n_ieq_constr  # what is behind these is computed, whatever happened
        values = [v | {"G": v["G"][:n]} if "G" in v else v for v in values]
        out = columns_of_values(self.model, values)
        out["G"] = np.hstack([out["G"], self.amounts(X)])
        return table_of_values(self.table.layout, points, X, out)

    def amounts(self, X: NDArray[Any]) -> NDArray[np.float64]:
        """Return ``(n, k)`` by how much designs violate the requirements, if there are any."""
        return np.zeros((len(X), 0)) if self.problem is self.model else self.problem.amounts(X)

    def _run(self, start: int) -> Generator[None]:
        """Test the points from a row on, step by step; nothing is being evaluated yet."""
        self._opened, self._under_way = start, {}
        if self._repeats is not None:
            self._repeats.waiting.clear()
        with ExitStack() as self._lock:
            self._locked = self.store.study is None
            yield from self._one_by_one() if self._streams else self._in_pieces()

    def _open(self, until: int) -> Rows:
        """Return the rows of points below one that are to be evaluated; give the other tests."""
        rows, self._opened = np.arange(self._opened, until), until
        if self.store.study is not None:
            numbers = self.points.numbers[rows]
            stored = self.store.recall(numbers)
            if len(stored) < len(numbers) and not self._locked:
                # From here on no other process tests points; one may have stored some meanwhile.
                self._lock.enter_context(self.store.writing())
                self._locked = True
                stored = self.store.recall(numbers)
            self._put(stored, len(stored), None, called=False)
            rows = rows[~np.isin(numbers, stored.numbers)]
        if self.problem is not self.model and len(rows):
            unmet = (self.amounts(self.points.at(rows).matrix(self.space)) > 0).any(axis=1)
            self.problem.n_not_run += int(unmet.sum())
            self._put_known([(row, {"failure": ""}) for row in rows[unmet].tolist()])
            rows = rows[~unmet]
        if self._repeats is not None:
            rows, again = self._repeats.new(rows, self.points.at(rows).matrix(self.space))
            self._put_known(again)
        return rows

    def _points_to_fill(self, n_points: int, options: RunOptions) -> int:
        """Return how many points it takes until so many meet the requirements."""
        if self.problem is self.model:
            return n_points
        n_dim = len(self.space.searched)
        if not options.sampling_in(n_dim).extendable or options.share:
            rule = "used without share and with a sequence that can be continued"
            raise invalid("fill", rule, True)
        for doublings in range(11):
            n = n_points << doublings
            above = self.problem.amounts(options.points(n, n_dim).matrix(self.space))
            met = np.flatnonzero((above <= 0).all(axis=1))
            if len(met) >= n_points:
                return int(met[n_points - 1]) + 1
        raise invalid("requirements", "met by one point in 1000", Received(f"{len(met)} of {n}"))

    def _one_by_one(self) -> Generator[None]:
        """Evaluate designs by workers that do not wait for each other."""
        waiting: Waiting = deque()

        def top_up(ahead: int) -> None:
            n = -1
            while n < len(self.points):
                n = len(self.points)
                until = min(self._wanted + ahead, n)
                while self._opened < until and len(waiting) < _FAR:
                    rows = self._open(min(until, self._opened + _FAR))
                    matrix = self.points.at(rows).matrix(self.space)
                    waiting.extend(zip(rows.tolist(), self.space.designs(matrix), strict=True))
                    self._under_way |= dict.fromkeys(rows.tolist())
                if self.extend and ahead and until == n and self.n_idle:
                    self.extend()

        def at_once(result: Result) -> bool:
            del self._under_way[result[0]]
            complete = next(iter(self._under_way), self._wanted) >= self._wanted
            return complete or bool(self.extend)

        def keep(rows: Rows, values: Sequence[Values], seconds: ArrayLike) -> None:
            self._put(self.tests_of(rows, values), len(rows), seconds)

        top_up(0)
        if waiting:
            top_up(self._ahead)
            results = stream_designs(self.model, waiting)
            for _ in in_groups(results, keep, at_once):
                yield
                top_up(self._ahead)

    def _in_pieces(self) -> Generator[None]:
        """Evaluate points by calls for many, here or in processes."""
        every = self.store.study is not None or self._repeats is not None
        kept = partial(kept_tests, "all" if every else self._keep, self._limits)
        task = partial(_tested, self.problem, self.space, self.table.layout, kept)
        if self._n_jobs == 1:
            done = (pair for pair in enumerate(map(task, self._pieces())))
        else:
            done = in_parallel(task, self._pieces(), self._n_jobs)
        with closing(done):
            for _, (tests, n, seconds) in done:
                self._put(tests, n, seconds)
                if self.store.study is not None:
                    # The first designs load libraries and say little: at most 100 times as many.
                    fitting = min(SECONDS / max(seconds, 1e-9), 100 * n)
                    self._size = max(self._least, min(self._largest, int(fitting)))
                yield

    def _pieces(self) -> Iterator[Points]:
        while self._opened < self._wanted:
            rows = self._open(min(self._wanted, self._opened + self._largest))
            while len(rows):
                piece, rows = rows[: self._size], rows[self._size :]
                yield self.points.at(piece)

    def _put(
        self, tests: TestTable, n: int, seconds: ArrayLike | None, *, called: bool = True
    ) -> None:
        """Give tests, and those of the same designs; store them with what each of them took.

        Args:
            tests: The tests; where neither a study nor repeats need all, those that are kept.
            n: How many they were; of fewer tests the others were left out where they were tested.
            seconds: One number or ``(n,)``; None where they are stored already.
            called: Whether the model was called.
        """
        if seconds is not None:
            self.store.keep(tests, seconds)
        if n:
            kept = tests if len(tests) < n else kept_tests(self._keep, self._limits, tests)
            self._arrived.append((kept, np.full(n, called)))
        if self._repeats is not None:
            self._put_known(self._repeats.learn(tests))

    def _put_known(self, known: list[tuple[int, Values]]) -> None:
        """Store and give tests whose values are known without the model, by rows of points."""
        if known:
            rows, values = zip(*known, strict=True)
            self._put(self.tests_of(np.array(rows), values), len(rows), 0.0, called=False)


def _tested(
    problem: Any, space: DesignSpace, layout: Layout, kept: Kept, points: Points
) -> tuple[TestTable, int, float]:
    """Return the kept tests of n points, n, and the seconds of one; it is sent to processes."""
    began = time.monotonic()
    X = points.matrix(space)
    out = evaluate_designs(problem, space.designs(X))
    seconds = (time.monotonic() - began) / len(points)
    return kept(table_of_values(layout, points, X, out)), len(points), seconds


class _Repeats:
    """The results of a run by design, where designs recur as no variable is real.

    Attributes:
        known: The values of every design that is known.
        waiting: For each design being evaluated, the other rows with it.
    """

    def __init__(self, tests: TestTable) -> None:
        self.known: dict[tuple[str, ...], Values] = {}
        self.waiting: dict[tuple[str, ...], list[int]] = {}
        self.learn(tests)

    def learn(self, tests: TestTable) -> list[tuple[int, Values]]:
        """Learn the results of tests; return the rows that waited for them, with their values."""
        again: list[tuple[int, Values]] = []
        for key, values in zip(design_keys(tests.X), values_of_table(tests), strict=True):
            self.known.setdefault(key, values)
            again += [(row, values) for row in self.waiting.pop(key, ())]
        return again

    def new(self, rows: Rows, X: NDArray[Any]) -> tuple[Rows, list[tuple[int, Values]]]:
        """Return which rows of points, with designs X, to evaluate, and those of known values."""
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


# What pymoo knows by itself and its users put beside the outputs of a model; and our reasons.
NO_OUTPUTS = {
    *("F", "G", "H", "dF", "dG", "dH", "ddF", "ddG", "ddH", "CV", "cv", "feas", "X", "hash"),
    "failure",
}


def table_of_values(layout: Layout, points: Points, X: Any, out: Mapping[str, Any]) -> TestTable:
    """Return the tests of n designs with all numbers that the model gave.

    What is no single number for any design, or has the name of another column, is left out with a
    warning: the values of the other columns count, and a run is not to end for it. What is one for
    some designs stays theirs, whatever others of the same block have.

    Args:
        layout: The columns that the problem promises.
        points: The n points that they are of.
        X: ``(n, n_var)`` the designs.
        out: Their values, as :func:`evaluate_designs` returns them.
    """
    numbers = points.numbers
    if points.rounds is not None:
        # First, whatever the first design gives; a repeated design has the round of its own point.
        out = {PROPOSAL_ROUND: None} | dict(out) | {PROPOSAL_ROUND: points.rounds}
    reasons = {n: r for n, r in zip(numbers.tolist(), out["failure"], strict=True) if r}
    taken, outputs = {*layout.columns, *RESERVED}, {}
    for name, values in out.items():
        if name in NO_OUTPUTS or str(name).startswith("__"):
            continue
        column, odd = _numbers(values, len(numbers))
        fits = isinstance(name, str) and name not in taken
        if fits and not (odd and np.isnan(column).all()):
            outputs[name] = np.where(out["failure"] == "", column, np.nan)
        if odd or not fits:
            why = f"where it is no single number, such as {odd[0]!r:.40}" if odd else "by this name"
            warnings.warn(f"out[{name!r}] is not kept in the table {why}", stacklevel=2)
    return TestTable.of(
        numbers, X, out["F"], out["G"], out["H"], outputs=outputs, reasons=reasons, layout=layout
    )


def _numbers(values: Any, n: int) -> tuple[NDArray[Any], list[Any]]:
    """Return a number for each of n designs, NaN where there is none, and what is no number."""
    column = np.asarray(values)
    if column.dtype.kind in "fiub" and column.size == n:
        return column.reshape(n), []
    cells = [np.asarray(value) for value in column]
    known = [cell.size == 1 and cell.dtype.kind in "fiub" for cell in cells]
    numbers = [cell.item() if ok else np.nan for cell, ok in zip(cells, known, strict=True)]
    odd = [v for v, ok in zip(column, known, strict=True) if not ok and v is not None]
    return np.array(numbers, dtype=np.float64), odd


def values_of_table(tests: TestTable) -> list[Values]:
    """Return the values of each test as its evaluation has given them."""
    names = ("F", "G", "H", *tests.layout.outputs, "failure")
    reasons = [tests.reasons.get(number, "") for number in tests.numbers.tolist()]
    rows = zip(tests.F, tests.G, tests.H, *tests.outputs.T.tolist(), reasons, strict=True)
    return [dict(zip(names, row, strict=True)) for row in rows]


def by_number(tables: list[TestTable]) -> TestTable:
    """Return tables that have no test in common as one, by number."""
    # Blocks of workers come in any order; rows that are sorted then need no second copy.
    first, *others = sorted(tables, key=lambda t: t.numbers.min() if len(t) else 0)
    table = first.extended(*others)
    if (np.diff(table.numbers) < 0).any():
        table = table.rows(np.argsort(table.numbers))
    return table
