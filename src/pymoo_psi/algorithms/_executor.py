"""Executors: they evaluate points, in this process or in workers, and return tests in any order.

The designs of a model that is evaluated one by one are a single stream to its workers, none of
which waits for another. Points of a vectorised model are evaluated in pieces that take about a
second, in this process or in others, where each piece is generated, evaluated and filtered.
"""

from __future__ import annotations

import time
import warnings
import zlib
from collections import deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pymoo.core.problem import LoopedElementwiseEvaluation

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Array, Designs, Entries, Mask, Numbers, Values, invalid, mapping
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._sources import Points
from pymoo_psi.parallel import (
    Runner,
    Waiting,
)
from pymoo_psi.problems import (
    NO_OUTPUTS,
    Seeded,
    columns_of_values,
    design_space,
    evaluate_designs,
    known_limits,
    layers,
    problem_layout,
    stream_designs,
    streams,
    untolerant,
    with_requirements,
    without_requirements,
)
from pymoo_psi.study import LAST
from pymoo_psi.table import (
    PROPOSAL_ROUND,
    RESERVED,
    Formulation,
    Layout,
    TestTable,
    choice_values,
    limits_of,
)

Filter = Callable[[TestTable], TestTable]

# Points that may wait for workers: as many as can be held easily.
_WAITING = 4096
# Points for each worker that may be evaluated ahead where a termination may end the run. With 8,
# the slowest design of a block takes as long as 8 others.
_NEAR = 8
# A piece takes about so many seconds: a commit of some milliseconds does not count beside them, and
# not much more is lost when the process is killed.
_SECONDS = 1.0
# The same for a runner that is not ours: its workers wait for the slowest design of each piece.
_SECONDS_OF_OTHERS = 10.0
# Designs in the first piece: enough to measure the cost of one and to keep the workers busy of a
# runner that is not ours, and few enough that a model of seconds a design loses minutes only.
_SMALLEST = 64
# 65 536 designs fill NumPy's loops and take some megabytes; 512 let a progress bar move.
_LARGEST, _LARGEST_ELEMENTWISE = 65_536, 512
# Pieces for each worker, at least, so that the last ones end at about the same time.
_PIECES = 8
# Pieces for each worker that are under way, wait for it, or are done and wait to be read.
_PIECES_AHEAD = 4


class Block(NamedTuple):
    """Tests of points.

    Attributes:
        numbers: ``(n,)`` the numbers of the points.
        tests: Their tests; fewer where an executor filters.
        n_called: For how many of the points the model was called.
        seconds: ``(n,)`` what the evaluation of each took; 0 if the model was not called.
    """

    numbers: Numbers
    tests: TestTable
    n_called: int = 0
    seconds: ArrayLike = 0.0

    def rows(self, rows: Mask) -> Block:
        """Return some of a block that has all tests of its points."""
        n_called = 0
        if self.n_called:  # for all of them
            n_called = int(np.count_nonzero(rows))
        return Block(self.numbers[rows], self.tests.rows(rows), n_called)


class _Executor:
    """Evaluates points; it knows nothing of studies, of points still to come, or of algorithms.

    Copies have the settings; what is being evaluated stays with the executor. A subclass writes

    - ``room``: how many more points to submit now; 0 while enough of them wait.
    - ``submit(points)``: take points to evaluate, with numbers above those of all before, also
      while others are evaluated.
    - ``wait()``: wait until more is evaluated, or for a moment; return what it took, in seconds of
      a worker.
    - ``take()``: return the tests of the evaluated points, in the order of their evaluation.

    Attributes:
        elastic: Whether workers may join and leave.
        ahead: How many points to submit beyond those that are awaited.
    """

    elastic = False
    ahead = 0

    def __init__(self) -> None:
        self._clear()

    @property
    def n_workers(self) -> int:
        """How many workers evaluate designs now without waiting for one another, or 0."""
        return 0

    def _clear(self) -> None:
        self._points = Points.none()
        self._waiting: Waiting = deque()
        self._held: Waiting = deque()
        self._is_holding = False
        self._pending: dict[int, Any] = {}  # what waits or is evaluated, by the first number
        self._evaluated: list[Any] = []
        self._results: Generator[Any] | None = None

    def __getstate__(self) -> Values:
        """Return the settings, and no points."""
        return vars(self) | vars(_Executor())

    @property
    def n_pending(self) -> int:
        """How many points, or pieces of points, are to be evaluated and are not held back."""
        return len(self._pending) - len(self._held)

    def hold(self, on: bool) -> None:
        """Hold back what no worker has begun, or let it go on."""
        self._is_holding = on
        source, target = self._held, self._waiting
        if on:
            source, target = self._waiting, self._held
        target.extend(source)
        source.clear()

    @property
    def first_pending(self) -> int:
        """The number of the first pending point; the largest number if none is pending."""
        return next(iter(self._pending), LAST)

    @property
    def n_evaluated(self) -> int:
        """How many points are evaluated and not taken yet."""
        return len(self._evaluated)

    def close(self) -> None:
        """Drop points that are pending or not taken; workers with nothing to do are kept."""
        if self._results is not None:
            if not self._pending:
                next(self._results, None)  # the end, where workers become idle
            self._results.close()
        self._clear()


class Model:
    """The model of a run: a problem, its variables, and tests made of its values.

    Args:
        problem: A pymoo problem.
        options: The options of the run.
        repeat: Which of the tests of each design these are, from 1.

    Attributes:
        problem: The problem with its requirements, not tolerant of failures.
        inner: The same problem without its requirements.
        space: Its variables.
        layout: The columns that the problem promises.
        default_limits: The limits of the problem, by column.
        asked: The formulation of the run, with these limits where it says no others.
        repeat: Which of the tests of each design these are.
        noisy: Whether tests of the same design differ.
    """

    def __init__(self, problem: Any, options: RunOptions, repeat: int = 1) -> None:
        self.repeat = repeat
        self.noisy: bool = getattr(problem, "noisy", False)
        self.problem = with_requirements(untolerant(problem), options.requirements)
        self.inner = without_requirements(self.problem)
        self._limits = known_limits(self.problem)  # the first constraints, but not of a table
        names = mapping("names", options.names or {}, "names such as f1 to your own")
        log = options.log
        if log is not None:
            default_names = {own: name for name, own in names.items()}
            log = [default_names.get(name, name) for name in log]
        self.space = design_space(self.problem, log=log)
        columns = options.names, options.maximize, options.units
        layout = problem_layout(self.problem, self.space, *columns)
        self.layout = replace(layout, inequalities=layout.inequalities[len(self._limits) :])
        self.default_limits = limits_of_problem(self._limits)
        self.asked = self.asked_by(options.formulation or Formulation(limits=options.limits))

    def asked_by(self, formulation: Formulation) -> Formulation:
        """Return a formulation with the limits of the problem where it says no others."""
        limits = self.default_limits | limits_of(formulation.limits)
        return replace(formulation, limits=limits)

    @property
    def has_requirements(self) -> bool:
        """Whether designs must meet requirements before the problem is evaluated."""
        return self.problem is not self.inner

    def violations(self, X: Designs) -> Array:
        """``(n, k)`` by how much n designs violate the k requirements; <= 0 where they are met."""
        if not self.has_requirements:
            return np.zeros((len(X), 0))
        violations: Array = self.problem.amounts(X)
        return violations

    def designs(self, columns: Entries) -> Designs:
        """Return ``(n, n_var)`` designs of ``(n,)`` variables by name, choices as texts."""
        designs = []
        for name, kind in zip(self.layout.variables, self.layout.kinds, strict=True):
            cells = columns[name]
            if kind is Kind.CHOICE:
                cells = choice_values(cells)
            designs.append(cells.astype(object))
        return np.column_stack(designs)

    def requirement_columns(self, columns: Entries) -> dict[str, Array]:
        """Return the columns of the requirements of stored tests, by name."""
        if not self.has_requirements:
            return {}
        names = self.layout.inequalities[self.n_ieq_constr :]
        violations = self.violations(self.designs(columns))
        return dict(zip(names, violations.T, strict=True))

    def completed(self, columns: Entries) -> dict[str, Array]:
        """Return columns of stored tests that follow from others, or from files that are kept.

        Args:
            columns: The columns of the tests by name.
        """
        completed = self.requirement_columns(columns)
        *wrappers, model = layers(self.inner)
        if hasattr(model, "completed") and all(wrapper.same_columns for wrapper in wrappers):
            completed |= model.completed(columns)
        return completed

    @property
    def n_ieq_constr(self) -> int:
        """How many inequality constraints of the model a table has, before requirements."""
        return int(self.inner.n_ieq_constr) - len(self._limits)

    def constraints(self, tests: TestTable) -> Array:
        """Return the ``(n, n_ieq)`` constraints of tests as the problem has them, with its limits.

        The amounts are not known where a test lacks the output.
        """
        amounts = []
        for limit in self._limits:
            outputs = np.full(len(tests), np.nan)
            if limit.output in tests.layout.columns:
                outputs = tests.column(limit.output)
            amounts.append(limit.violation(outputs))
        return np.column_stack([*amounts, tests.G])

    def values(self, tests: TestTable) -> list[Values]:
        """Return the values of each test as its evaluation returned them."""
        names = ("F", "G", "H", *tests.layout.outputs, "failure")
        constraints = self.constraints(tests)
        has_run = np.isfinite(tests.F).all(axis=1)
        is_unknown: Mask = np.asarray(has_run & np.isnan(constraints).any(axis=1))
        reasons = []
        for number, lacks_output in zip(tests.numbers.tolist(), is_unknown, strict=True):
            reason = tests.reasons.get(number, "")
            if lacks_output:
                reason = "an output with a limit is not known; retry='incomplete' tests it again"
            reasons.append(reason)
        arrays = tests.F, constraints, tests.H
        rows = zip(*arrays, *tests.outputs.T.tolist(), reasons, strict=True)
        return [dict(zip(names, row, strict=True)) for row in rows]

    def tests(self, points: Points, values: Sequence[Values]) -> TestTable:
        """Return the tests of points.

        Args:
            points: The points.
            values: The values of each, as the problem without its requirements gives them.
        """
        X = points.matrix(self.space)
        # Requirements follow the model's own constraints; they are computed, whatever happened.
        n_ieq = self.inner.n_ieq_constr
        rows = []
        for row in values:
            if "G" in row:
                row = row | {"G": row["G"][:n_ieq]}
            rows.append(row)
        out = columns_of_values(self.inner, rows)
        out["G"] = np.hstack([out["G"], self.violations(X)])
        return self._table(points, X, out)

    def evaluated(self, kept: Filter | None, points: Points) -> tuple[TestTable, float]:
        """Return the kept tests of points, and the seconds of one; it is sent to processes."""
        began = time.monotonic()
        X = points.matrix(self.space)
        out = evaluate_designs(self.problem, self.space.designs(X))
        seconds = (time.monotonic() - began) / len(points)
        tests = self._table(points, X, out)
        if kept is not None:
            tests = kept(tests)
        return tests, seconds

    def _table(self, points: Points, X: Designs, out: Entries) -> TestTable:
        values = {**out, "G": out["G"][:, len(self._limits) :]}
        return table_of_values(self.layout, points, X, values)


def limits_of_problem(limits: Sequence[Any]) -> Values:
    """Return the limits of a problem by output, as ``(lower, upper)``."""
    sides: dict[str, dict[str, float]] = {}
    for limit in limits:
        sides.setdefault(limit.output, {})[limit.sign] = limit.value
    return {
        output: (of_output.get(">="), of_output.get("<=")) for output, of_output in sides.items()
    }


class OneByOne(_Executor):
    """Sends designs to workers that do not wait for one another, or evaluates them here.

    Args:
        model: A model whose designs can be evaluated one by one.
        may_end_early: Whether a termination may end the run before all points are tested.
    """

    def __init__(self, model: Model, may_end_early: bool) -> None:
        super().__init__()
        self._model = model
        self._may_end_early = may_end_early
        self._runner = model.problem.elementwise_runner
        self._has_workers = isinstance(self._runner, Runner)
        self.elastic = self._has_workers and self._runner.elastic

    @property
    def n_workers(self) -> int:
        """How many workers evaluate designs now without waiting for one another, or 0."""
        if not self._has_workers:
            return 0
        return int(self._runner.n_workers)

    @property
    def ahead(self) -> int:  # type: ignore[override]
        """How many points to submit beyond those that are awaited, so that no worker waits."""
        if not self._has_workers:
            return 0
        if self._may_end_early:
            return _NEAR * self.n_workers
        return LAST  # one slow design holds up none of the others

    @property
    def room(self) -> int:
        """How many more points to submit now."""
        if len(self._waiting) >= _WAITING:
            return 0
        return _WAITING

    def submit(self, points: Points) -> None:
        """Take points to evaluate."""
        matrix = points.matrix(self._model.space)
        numbers = points.numbers.tolist()
        # with their designs, which are not computed again for the tests
        points = replace(points, designs=matrix)
        self._points = self._points.joined(points)  # from the first pending one on
        self._pending |= dict.fromkeys(numbers)
        designs: Any = self._model.space.designs(matrix)
        if self._model.noisy:
            repeat = self._model.repeat
            # from 0 to 2³¹ - 1
            seeds = [zlib.crc32(f"{number} {repeat}".encode()) >> 1 for number in numbers]
            designs = list(map(Seeded, designs, seeds))
        self._waiting.extend(zip(numbers, designs, strict=True))

    def wait(self) -> float:
        """Wait for the values of another design, or for a moment."""
        if self._results is None:
            self._results = stream_designs(self._model.inner, self._waiting)
        result = next(self._results)
        if result is None:
            return 0.0
        self._evaluated.append(result)
        number, _, seconds = result
        del self._pending[number]
        return seconds

    def take(self) -> Block:
        """Return the tests of the evaluated points."""
        numbers, values, seconds = zip(*self._evaluated, strict=True)
        self._evaluated.clear()
        points = self._points.at(np.searchsorted(self._points.numbers, numbers))
        self._points = self._points.at(self._points.numbers >= self.first_pending)
        tests = self._model.tests(points, values)
        return Block(points.numbers, tests, len(points), seconds)


class InPieces(_Executor):
    """Evaluates points by calls for many, in this process or in others.

    Args:
        task: Returns the tests of a piece that are kept, and the seconds of one of its designs.
        smallest: The number of points in the smallest piece, and in the first ones.
        largest: The same for the largest one.
        seconds: What a piece takes; it shrinks or grows until it does.
        runner: What evaluates pieces; ``None`` is this process.
    """

    def __init__(
        self,
        task: Callable[[Points], tuple[TestTable, float]],
        smallest: int,
        largest: int,
        seconds: float,
        runner: Runner | None,
    ) -> None:
        super().__init__()
        self._task = task
        self._smallest = smallest
        self._largest = largest
        self._size = smallest
        self._seconds = seconds
        self._runner = runner

    @property
    def _n_waiting(self) -> int:
        """How many pieces may wait for workers, be evaluated, or be done and wait to be read."""
        if self._runner is None or self._runner.n_workers == 1:
            return 1
        return _PIECES_AHEAD * max(1, self._runner.n_workers)

    @property
    def room(self) -> int:
        """How many more points to submit now."""
        if len(self._points) > 0:
            return 0
        return self._largest

    def submit(self, points: Points) -> None:
        """Take points to evaluate."""
        self._points = self._points.joined(points)  # those that are in no piece
        self._cut()

    def _cut(self) -> None:
        """Cut as many pieces as workers need."""
        while len(self._points) and len(self._waiting) < self._n_waiting and not self._is_holding:
            piece = self._points.at(slice(0, self._size))
            self._points = self._points.at(slice(self._size, None))
            first = int(piece.numbers[0])
            self._pending[first] = piece
            self._waiting.append((first, piece))

    @property
    def n_evaluated(self) -> int:
        """How many points are evaluated and not taken yet."""
        return sum(len(piece) for piece, *_ in self._evaluated)

    def wait(self) -> float:
        """Wait for another piece."""
        if self._results is None:
            self._results = self._done_here()
            if self._runner is not None:
                self._results = self._runner.tasks(self._task, self._waiting)
        seconds: float
        first, (tests, seconds) = next(self._results)
        piece = self._pending.pop(first)
        self._evaluated.append((piece, tests, seconds))
        # The first designs load libraries and say little: at most 100 times as many follow.
        fitting = int(min(self._seconds / max(seconds, 1e-9), 100 * len(piece)))
        self._size = max(self._smallest, min(self._largest, fitting))
        self._cut()
        return seconds * len(piece)

    def _done_here(self) -> Generator[Any]:
        while self._waiting:
            first, piece = self._waiting.popleft()
            yield first, self._task(piece)

    def take(self) -> Block:
        """Return the tests of the evaluated points."""
        pieces, tables, seconds = zip(*self._evaluated, strict=True)
        self._evaluated.clear()
        numbers = np.concatenate([piece.numbers for piece in pieces])
        sizes = [len(piece) for piece in pieces]
        tests = tables[0].extended(*tables[1:])
        return Block(numbers, tests, len(numbers), np.repeat(seconds, sizes))


Executor = OneByOne | InPieces


def executor_of(
    model: Model,
    options: RunOptions,
    *,
    n_points: int | None = None,
    runner: Runner | None = None,
    may_end_early: bool = True,
    kept: Filter | None = None,
) -> Executor:
    """Return the executor for a model.

    Args:
        model: The model.
        options: The options of the run.
        n_points: How many points there are; ``None`` evaluates together what is submitted together.
        runner: What evaluates pieces of a vectorised model; ``None`` is this process.
        may_end_early: Whether a termination may end the run before all points are tested; if not,
            points are evaluated ahead of the blocks that are asked for.
        kept: Returns the tests of a piece that are needed; ``None`` for all.

    Raises:
        ArgumentValueError: The model is noisy, and is called for several designs together.
    """
    if streams(model.inner):
        return OneByOne(model, may_end_early)
    if model.noisy:
        rule = "called for one design at a time, as each test has its own seed, if it is noisy"
        remedy = "make an ElementwiseProblem with a runner of this package"
        raise invalid("problem", rule, model.inner, remedy)
    task = partial(model.evaluated, kept)
    if n_points is None:
        return InPieces(task, LAST, LAST, _SECONDS, runner)
    largest = _LARGEST
    smallest = _SMALLEST
    seconds = _SECONDS
    if model.problem.elementwise:
        largest = _LARGEST_ELEMENTWISE
        if isinstance(model.problem.elementwise_runner, LoopedElementwiseEvaluation):
            smallest = 1
        else:
            seconds = _SECONDS_OF_OTHERS
    elif runner is not None and runner.n_workers != 1:
        points_of_a_worker = -(-n_points // (_PIECES * max(1, runner.n_workers)))
        largest = min(largest, max(_SMALLEST, points_of_a_worker))
    largest = options.block_size or largest
    pieces = InPieces(task, min(smallest, largest), largest, seconds, runner)
    if not may_end_early:
        pieces.ahead = LAST
    return pieces


def table_of_values(layout: Layout, points: Points, X: Any, out: Entries) -> TestTable:
    """Return the tests of n designs with all numbers that the model returned.

    An output that is not a single number for any design, or has the name of another column, is left
    out with a warning, as a run need not end for it. If it is a number for some designs, these keep
    it: values of one design never affect those of another.

    Args:
        layout: The columns that the problem promises.
        points: The n points of the designs.
        X: ``(n, n_var)`` the designs.
        out: Their values, as :func:`evaluate_designs` returns them.
    """
    numbers = points.numbers
    has_failed = out["failure"].astype(bool)
    reasons = {}
    for row in np.flatnonzero(has_failed):
        reasons[int(numbers[row])] = out["failure"][row]
    candidates = dict(out)
    if points.rounds is not None:
        # first, and those of the points: a repeated design has the values of another point
        candidates.pop(PROPOSAL_ROUND, None)
        candidates = {PROPOSAL_ROUND: points.rounds} | candidates
    other_columns = {*layout.columns, *RESERVED}
    outputs = {}
    for name, values in candidates.items():
        if name in NO_OUTPUTS or name.startswith("__"):
            continue
        if name in other_columns:
            warn_of_output(name, "in the table by this name")
            continue
        column, odd = _numbers(values, len(numbers))
        if odd:
            example = f"{odd[0]!r:.40}"
            warn_of_output(name, f"in the table where it is no single number, such as {example}")
            if np.isnan(column).all():
                continue
        outputs[name] = np.where(has_failed, np.nan, column)
    return TestTable.of(
        numbers, X, out["F"], out["G"], out["H"], outputs=outputs, reasons=reasons, layout=layout
    )


def warn_of_output(name: str, where: str) -> None:
    """Warn that an output of a model is lost."""
    warnings.warn(f"out[{name!r}] is not kept {where}", stacklevel=3)


def _numbers(values: Any, n: int) -> tuple[Any, list[Any]]:
    """Return a number for each of n designs, NaN where there is none, and the other values."""
    column = np.asarray(values)
    if column.dtype.kind in "fiub" and column.size == n:
        return column.reshape(n), []
    numbers = np.full(n, np.nan)
    odd = []
    for i, value in enumerate(column):
        cell = np.asarray(value)
        if cell.size == 1 and cell.dtype.kind in "fiub":
            numbers[i] = cell.item()
        elif value is not None:
            odd.append(value)
    return numbers, odd
