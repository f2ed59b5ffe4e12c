"""The executor of a run: it evaluates points, in this process or in workers, in any order.

Designs of a model that is evaluated one by one are put into the queue singly. Points of a
vectorised model are put there together, and a job evaluates and filters a piece of them.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pymoo.core.problem import LoopedElementwiseEvaluation

from pymoo_psi._validation import Mask, Numbers, Received, Values, invalid
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._sources import Points, RunOptions
from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel import Queue, Runner, raise_original
from pymoo_psi.problems import (
    CheckedFunction,
    streams,
)
from pymoo_psi.study import LAST
from pymoo_psi.table import TestTable

# Designs that may wait for workers; the executor takes more when fewer wait.
_WAITING = 4096
# Points for each worker that may be evaluated ahead where a termination may end the run. With 8,
# the slowest design of a block takes as long as 8 others.
_AHEAD_OF_WORKER = 8
# Seconds that a piece takes, about: a commit of some milliseconds does not count beside them, and
# not much more is lost when the process is killed.
_SECONDS = 1.0
# Designs in the first piece: enough to measure the cost of one and to keep the workers of a runner
# of another package busy, and few enough that a model of seconds a design loses minutes only.
_SMALLEST = 64
# The most designs in a piece, which fill NumPy's loops and take some megabytes.
_LARGEST = 65_536
# Pieces for each worker that may wait for it.
_PIECES_AHEAD = 4
# Tests in a piece, from which on the share of its Pareto set predicts that of later pieces.
_PREDICTIVE = 4096
# What is known of a design that violates a requirement.
_NOT_RUN: Values = {"failure": ""}


class Block(NamedTuple):
    """Tests of points.

    Attributes:
        numbers: ``(n,)`` the numbers of the points.
        tests: Their tests; fewer where an executor filters.
        is_called: Whether the model was called for them.
        seconds: ``(n,)`` what the evaluation of each took.
    """

    numbers: Numbers
    tests: TestTable
    is_called: bool = False
    seconds: ArrayLike = 0.0

    def rows(self, rows: Mask) -> Block:
        """Return some of a block that has all tests of its points."""
        return Block(self.numbers[rows], self.tests.take(rows), self.is_called)


class Evaluation(NamedTuple):
    """What a worker has returned.

    Attributes:
        numbers: The numbers of the points, one or those of a piece.
        values: The values of the design; or the tests of the piece that are needed.
        seconds: What it took.
    """

    numbers: Sequence[int] | Numbers
    values: Any
    seconds: float


class PieceTask:
    """Returns the numbers of the points of a piece, and the tests that are needed.

    It is sent to processes, which are not those of an earlier run if the values of the problem
    depend on something else.

    Args:
        model: The model, under whose formulation tests are needed.
        keep: Which tests; see :func:`needed_tests`.
    """

    def __init__(self, model: Model, keep: str) -> None:
        self.problem = model.problem
        self._model = model
        self._keep = keep

    def __call__(self, piece: Points) -> tuple[Numbers, TestTable]:
        """Evaluate the points of a piece."""
        tests = self._model.evaluated(piece)
        if np.isfinite(tests.F).any():
            self._model.require_outputs(tests.schema.names)
        needed = needed_tests(self._model, tests, self._keep)
        if self._keep == "pareto" and 2 * len(needed) > len(tests) > _PREDICTIVE:
            self._keep = "all"  # little of later pieces would be left out
        return piece.numbers, needed


def kept_rows(table: TestTable, keep: str) -> Mask:
    """``(n,)`` which tests are kept: ``"all"``, the ``"feasible"`` or the ``"pareto"`` ones."""
    if keep == "all":
        return np.ones(len(table), dtype=bool)
    if keep == "feasible":
        return table.feasible()
    return table.pareto()


def needed_tests(model: Model, tests: TestTable, keep: str) -> TestTable:
    """Return the tests of a block that are needed; of a Pareto set, perhaps more than these.

    If none of them is kept, one says whether all have failed.

    Args:
        model: The model, under whose formulation they are needed.
        tests: The tests.
        keep: Which tests are kept; see :func:`kept_rows`.
    """
    if keep == "all" or len(tests) == 0:
        return tests
    table = model.under_so_far(tests)
    rows = np.flatnonzero(kept_rows(table, keep))
    if len(rows) == 0:
        rows = np.array([table.failed().argmin()])
    return tests.take(rows)


class Executor:
    """Evaluates points; it knows nothing of studies, of points still to come, or of algorithms.

    The model is not called for a design that violates a requirement, nor, where designs recur, for
    one whose result is known or awaited.

    Args:
        model: The model.
        options: The options of the run.
        together: Whether points that are submitted together are evaluated together, if the model
            is called for several; whoever submits them knows the designs that recur.

    Attributes:
        has_designs: Whether designs are put into the queue, one by one, instead of points.
        recurs: Whether points may have the same design, as no variable is real.
        queue: The points that wait and that are being evaluated, by their numbers.

    Raises:
        ArgumentValueError: The model is noisy, and is called for several designs together.
    """

    def __init__(self, model: Model, options: RunOptions, together: bool = False) -> None:
        self._arguments = model, options, together
        self._model = model
        self.has_designs = streams(model.inner)
        # Workers evaluate points of which this process sees only the tests.
        is_here = model.problem.elementwise or options.runner is None
        self.recurs = model.space.finite and not model.noisy and is_here and not together
        if self.has_designs:
            runner = model.problem.elementwise_runner
            if not isinstance(runner, Runner):  # pymoo's, which is a loop
                runner = None
            function = CheckedFunction(model.inner, {}, seeded=model.noisy)
            self.queue = Queue(function, runner)
        else:
            if options.study is not None or self.recurs:
                options = replace(options, keep="all")
            self.queue = _queue_of_points(model, options, together)
        self._may_end_early = options.may_end_early
        self._known: dict[str, Values] = {}  # values by design, where designs recur
        self._n_checked = 0  # the number of the last point with violations that are counted
        self._reset()

    def _reset(self) -> None:
        """Forget all points."""
        # The outputs of points without failure, by number, while some outputs are awaited.
        self._outputs: dict[int, list[str]] = {}
        # The numbers of the points of each design under way, where designs recur; only the first
        # one is evaluated.
        self._under_way: dict[str, list[int]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies have the settings; what is being evaluated stays with the executor."""
        state = {"_known": self._known, "_n_checked": self._n_checked}
        return Executor, self._arguments, state

    def n_accepted(self, n_awaited: int) -> int:
        """Return how many more points to submit now; 0 while enough of them wait.

        Args:
            n_awaited: How many further ones are awaited.
        """
        queue = self.queue
        n_workers = queue.runner.n_workers
        enough = _WAITING
        if not self.has_designs:
            enough = queue.largest * max(1, _PIECES_AHEAD * n_workers)
        if queue.n_waiting >= enough:
            return 0
        n_ahead = LAST  # one slow design holds up none of the others
        if queue.n_pending == 0:  # nothing ahead of points whose tests are all stored
            n_ahead = 0
        elif self._may_end_early or (self.has_designs and type(queue.runner) is Runner):
            n_ahead = _AHEAD_OF_WORKER * n_workers  # 0 in this process
        return min(n_awaited + n_ahead, enough)

    def answers(self, points: Points) -> list[Block]:
        """Return the tests of the points for which the model is not called, if there are any.

        Those that violate a requirement count as not run, each once.
        """
        model = self._model
        values_by_number = {}
        if self._known:
            for number, key in zip(points.numbers.tolist(), self._keys(points), strict=True):
                if key in self._known:
                    values_by_number[number] = self._known[key]
        if model.has_requirements:
            is_unmet = ~model.meets_requirements(points.matrix(model.space))
            numbers = points.numbers[is_unmet]
            values_by_number |= dict.fromkeys(numbers.tolist(), _NOT_RUN)
            model.problem.n_not_run += np.count_nonzero(numbers > self._n_checked)
            self._n_checked = max(self._n_checked, numbers.max(initial=0))
        return self._answers(points, values_by_number)

    def submit(self, points: Points) -> list[Block]:
        """Put points that need an evaluation into the queue, numbered above all earlier ones.

        Returns:
            The tests of the others; see :meth:`answers`.
        """
        answers = self.answers(points)
        for block in answers:
            points = points.without(block.numbers)
        if self.recurs:
            points = self._first_of_designs(points)
        if len(points) and self.has_designs:
            self.queue.add(self._designs(points))
        elif len(points):
            self.queue.add([(int(points.numbers[0]), points)])
        return answers

    def _designs(self, points: Points) -> Iterable[tuple[int, Any]]:
        """Return designs by the numbers of points; those of a noisy model, each with a seed."""
        numbers = points.numbers.tolist()
        space = self._model.space
        designs: Any = space.designs(points.matrix(space))
        if self._model.noisy:
            seeds = [_seed(number, self._model.repeat) for number in numbers]
            designs = zip(designs, seeds, strict=True)
        return zip(numbers, designs, strict=True)

    def _keys(self, points: Points) -> list[str]:
        return self._model.keys(points.matrix(self._model.space))

    def _first_of_designs(self, points: Points) -> Points:
        """Return the first point of each design that is not under way; the others wait for it."""
        is_first = []
        for number, key in zip(points.numbers.tolist(), self._keys(points), strict=True):
            is_first.append(key not in self._under_way)
            self._under_way.setdefault(key, []).append(number)
        return points.at(np.array(is_first, dtype=bool))

    def learn(self, tests: TestTable) -> dict[int, Values]:
        """Learn the results of tests, where designs recur.

        Returns:
            The values of the points that have waited for these, by number.
        """
        values_by_number: dict[int, Values] = {}
        if not self.recurs:
            return values_by_number
        keys = self._model.keys(tests.X)
        for key, values in zip(keys, self._model.values(tests), strict=True):
            self._known.setdefault(key, values)
            others = self._under_way.pop(key, [])[1:]
            values_by_number |= dict.fromkeys(others, self._known[key])
        return values_by_number

    def wait(self) -> Evaluation | None:
        """Return another evaluation, or ``None`` after a moment without one."""
        try:
            result = self.queue.wait()
        except EvaluationError as error:  # of a piece, as each design has its own failure
            raise_original(error)
        if result is None:
            return None
        number, values, seconds = result
        if not self.has_designs:
            numbers, tests = values
            return Evaluation(numbers, tests, seconds)
        return Evaluation([number], values, seconds)

    def require_outputs(self, evaluation: Evaluation) -> None:
        """Refuse a formulation that uses an output which the first design without failure lacks.

        The task of a piece has refused it already.
        """
        if not self.has_designs or not self._model.awaited or evaluation.values["failure"]:
            return
        self._outputs[evaluation.numbers[0]] = [*evaluation.values]
        first = min(self._outputs)
        if first < self.queue.first_pending:  # the same one for any number of workers
            self._model.require_outputs(self._outputs[first])

    def blocks(self, points: Points, evaluations: Sequence[Evaluation]) -> list[Block]:
        """Return the tests of evaluated ones of points, and of those of the same designs."""
        if not evaluations:
            return []
        pieces, values, seconds = zip(*evaluations, strict=True)
        sizes = [*map(len, pieces)]
        numbers = np.concatenate(pieces)
        if self.has_designs:
            tests = self._tests(points, numbers, values)
        else:
            first, *others = values
            tests = first.extended(*others)
        block = Block(numbers, tests, True, np.repeat(np.divide(seconds, sizes), sizes))
        return [block, *self._answers(points, self.learn(tests))]

    def evaluate(self, points: Points) -> list[Block]:
        """Evaluate points, wait for all of them, and return their tests."""
        evaluations = []
        try:
            answers = self.submit(points)
            while self.queue.n_pending:
                evaluation = self.wait()
                if evaluation is not None:
                    evaluations.append(evaluation)
                    self.require_outputs(evaluation)
            return answers + self.blocks(points, evaluations)
        finally:
            self.close()

    def _answers(self, points: Points, values_by_number: Mapping[int, Values]) -> list[Block]:
        """Return the tests of points by their values, if there are any."""
        if not values_by_number:
            return []
        numbers = np.array([*values_by_number])
        return [Block(numbers, self._tests(points, numbers, [*values_by_number.values()]))]

    def _tests(self, points: Points, numbers: Numbers, values: Sequence[Values]) -> TestTable:
        """Return the tests of designs, by the numbers of their points and their values."""
        rows = np.searchsorted(points.numbers, numbers)
        return self._model.tests(points.at(rows), values)

    def close(self) -> None:
        """Drop points that are pending or not taken; workers with nothing to do are kept."""
        self.queue.close()
        self._reset()


def _seed(number: int, repeat: int) -> int:
    """Return the seed of a test of a noisy model, from 0 to 2³¹ - 1."""
    return zlib.crc32(f"{number} {repeat}".encode()) >> 1


def _queue_of_points(model: Model, options: RunOptions, together: bool) -> Queue:
    """Return the queue of a model that is called for several points."""
    if model.noisy:
        rule = "called for one design at a time, as each test has its own seed, if it is noisy"
        remedy = "make an ElementwiseProblem with a runner of this package"
        raise invalid("problem", rule, Received("one for many designs"), remedy)
    problem = model.problem
    smallest = _SMALLEST
    largest = _LARGEST
    if together:
        smallest = LAST
        largest = LAST
    elif problem.elementwise and isinstance(
        problem.elementwise_runner, LoopedElementwiseEvaluation
    ):
        smallest = 1
    largest = options.block_size or largest
    return Queue(
        PieceTask(model, options.keep),
        options.runner,
        in_pieces=True,
        smallest=min(smallest, largest),
        largest=largest,
        seconds=_SECONDS,
    )
