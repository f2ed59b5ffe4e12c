"""Executors: they evaluate points, in this process or in workers, and return tests in any order.

The designs of a model that is evaluated one by one are a single stream to its workers, none of
which waits for another. Points of a vectorised model are evaluated in pieces that take about a
second, in this process or in others, where each piece is generated, evaluated and filtered.
"""

from __future__ import annotations

import time
import zlib
from collections import deque
from collections.abc import Generator
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pymoo.core.problem import LoopedElementwiseEvaluation

from pymoo_psi._validation import Mask, Numbers, Values, invalid
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._sources import Points
from pymoo_psi.parallel import Runner, Waiting
from pymoo_psi.problems import Seeded, stream_designs, streams
from pymoo_psi.study import LAST
from pymoo_psi.table import TestTable

# Points that may wait for workers; the executor takes more when fewer wait.
_WAITING = 4096
# Points for each worker that may be evaluated ahead where a termination may end the run. With 8,
# the slowest design of a block takes as long as 8 others.
_AHEAD_OF_WORKER = 8
# Seconds that a piece takes, about: a commit of some milliseconds does not count beside them, and
# not much more is lost when the process is killed.
_SECONDS = 1.0
# The same for a runner of another package: its workers wait for the slowest design of each piece.
_SECONDS_OF_OTHERS = 10.0
# Designs in the first piece: enough to measure the cost of one and to keep the workers of a runner
# of another package busy, and few enough that a model of seconds a design loses minutes only.
_SMALLEST = 64
# The most designs in a piece: 65 536 fill NumPy's loops and take some megabytes; 512, where they
# are evaluated one by one, let a progress bar move.
_LARGEST, _LARGEST_ELEMENTWISE = 65_536, 512
# Pieces for each worker, at least, so that the last ones end at about the same time.
_PIECES = 8
# Pieces for each worker that are evaluated, wait for it, or are evaluated and wait to be read.
_PIECES_AHEAD = 4
# Tests in a block, from which on the share of its Pareto set predicts that of later blocks.
_PREDICTIVE = 4096


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
        return Block(self.numbers[rows], self.tests.take(rows), n_called)


class Executor:
    """Evaluates points; it knows nothing of studies, of points still to come, or of algorithms.

    It makes tasks of points: single designs, or pieces of many points. Workers take waiting tasks.
    A subclass writes:

    - ``room``: how many more points to submit now; 0 while enough of them wait.
    - ``submit``: take points to evaluate, with numbers above those of all earlier points. It may be
      called while others are evaluated, but not during a pause.
    - ``wait``: wait for another task, or for a moment; return its seconds of a worker, or 0.
    - ``take``: take the tests of the evaluated points, in the order of their evaluation.

    Attributes:
        elastic: Whether workers may join and leave.
        in_rounds: Whether points that are submitted may wait for all that are being evaluated.
        may_end_early: Whether a termination may end the run before all points are tested; if not,
            points are evaluated ahead of the blocks that are asked for.
    """

    elastic = False
    in_rounds = False
    may_end_early = True

    def __init__(self) -> None:
        self._reset()

    def _reset(self) -> None:
        """Forget all points."""
        self._points = Points.none()
        self._waiting: Waiting = deque()  # tasks that no worker has begun, by their first number
        self._held: Waiting = deque()  # those that workers must not begin, during a pause
        self._is_paused = False
        # all tasks that are not evaluated, by their first number: of designs None, or the pieces
        self._pending: dict[int, Any] = {}
        self._evaluated: list[Any] = []
        self._results: Generator[Any] | None = None

    def __getstate__(self) -> Values:
        """Copies have the settings; what is being evaluated stays with the executor."""
        copied = object.__new__(type(self))
        vars(copied).update(vars(self))
        copied._reset()
        return vars(copied)

    @property
    def n_workers(self) -> int:
        """How many workers evaluate designs now without waiting for one another, or 0."""
        return 0

    @property
    def n_ahead(self) -> int:
        """How many points to submit beyond those that are awaited, so that no worker waits."""
        if self.may_end_early:
            return 0
        return LAST

    def pause(self) -> None:
        """Let no worker begin another task."""
        self._is_paused = True
        with suppress(IndexError):  # a runner may take some at the same time
            while True:
                self._held.append(self._waiting.popleft())

    def resume(self) -> None:
        """Let workers begin tasks again."""
        self._is_paused = False
        self._waiting.extend(self._held)
        self._held.clear()

    @property
    def n_pending_tasks(self) -> int:
        """How many tasks wait for workers or are evaluated; none of those held by a pause."""
        return len(self._pending) - len(self._held)

    @property
    def n_free(self) -> int:
        """How many workers have no task; negative while tasks wait for workers."""
        return self.n_workers - self.n_pending_tasks

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
        self._reset()


class OneByOne(Executor):
    """Sends designs to workers that do not wait for one another, or evaluates them here.

    Args:
        model: A model whose designs can be evaluated one by one.
    """

    def __init__(self, model: Model) -> None:
        super().__init__()
        self._model = model
        self._runner = model.problem.elementwise_runner
        self._has_workers = isinstance(self._runner, Runner)
        self.elastic = getattr(self._runner, "elastic", False)
        self.in_rounds = getattr(self._runner, "in_rounds", False)

    @property
    def n_workers(self) -> int:
        """How many workers evaluate designs now without waiting for one another, or 0."""
        if not self._has_workers:
            return 0
        return int(self._runner.n_workers)

    @property
    def n_ahead(self) -> int:
        """How many points to submit beyond those that are awaited, so that no worker waits."""
        if self.may_end_early or not self._has_workers:
            return _AHEAD_OF_WORKER * self.n_workers  # 0 in this process
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


class PieceTask:
    """Returns the tests of a piece that are needed, and the seconds of one of its points.

    It is sent to processes, which are not those of an earlier run if the values of the problem
    depend on something else.

    Args:
        model: The model, under whose formulation tests are needed.
        keep: Which tests: ``"all"``, the ``"feasible"`` ones, or their ``"pareto"`` set.
    """

    def __init__(self, model: Model, keep: str) -> None:
        self.problem = model.problem
        self._model = model
        self._keep = keep

    def __call__(self, piece: Points) -> tuple[TestTable, float]:
        """Evaluate the points of a piece."""
        began = time.monotonic()
        tests = self._model.evaluated(piece)
        seconds = (time.monotonic() - began) / len(piece)
        return self.needed(tests), seconds

    def needed(self, tests: TestTable) -> TestTable:
        """Return the tests of a block that are needed; of a Pareto set, perhaps more than these.

        If more than half of a large block is kept, later blocks are not filtered: little of them
        would be left out, and all tests are filtered together in the end.
        """
        if self._keep == "all":
            return tests
        table = self._model.under_so_far(tests)
        if self._keep == "feasible":
            return tests.take(table.feasible())
        kept = tests.take(table.pareto())
        if 2 * len(kept) > len(tests) > _PREDICTIVE:
            self._keep = "all"
        return kept


class InPieces(Executor):
    """Evaluates points by calls for many, in this process or in others.

    Args:
        task: What evaluates a piece.
        smallest: The number of points in the smallest piece, and in the first ones.
        largest: The same for the largest one.
        seconds: What a piece takes; it shrinks or grows until it does.
        runner: What evaluates pieces; ``None`` is this process.
    """

    def __init__(
        self,
        task: PieceTask,
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
        while len(self._points) and len(self._waiting) < self._n_waiting and not self._is_paused:
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


def executor_of(
    model: Model, options: RunOptions, n_points: int | None = None
) -> OneByOne | InPieces:
    """Return the executor for a model.

    Args:
        model: The model.
        options: The options of the run.
        n_points: How many points there are; ``None`` evaluates together what is submitted together.

    Raises:
        ArgumentValueError: The model is noisy, and is called for several designs together.
    """
    if streams(model.inner):
        return OneByOne(model)
    if model.noisy:
        rule = "called for one design at a time, as each test has its own seed, if it is noisy"
        remedy = "make an ElementwiseProblem with a runner of this package"
        raise invalid("problem", rule, model.inner, remedy)
    runner = options.runner
    smallest = _SMALLEST
    largest = _LARGEST
    seconds = _SECONDS
    if n_points is None:
        smallest = LAST
        largest = LAST
    elif model.problem.elementwise:
        largest = _LARGEST_ELEMENTWISE
        if isinstance(model.problem.elementwise_runner, LoopedElementwiseEvaluation):
            smallest = 1
        else:
            seconds = _SECONDS_OF_OTHERS
    elif runner is not None and runner.n_workers != 1:
        points_of_a_worker = -(-n_points // (_PIECES * max(1, runner.n_workers)))
        largest = min(_LARGEST, max(_SMALLEST, points_of_a_worker))
    largest = options.block_size or largest
    task = PieceTask(model, options.keep)
    return InPieces(task, min(smallest, largest), largest, seconds, runner)
