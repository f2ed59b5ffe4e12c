"""Runners, and the queue of a run that they work on.

Whatever this package evaluates, it puts into a :class:`Queue`: the designs of an algorithm, the
points of a vectorised problem, or tasks. From there to its result, a design

1. waits (:meth:`Queue.add`) until the runner takes a job, some designs or a piece of the points;
   the time that the last jobs took says how many (:meth:`Queue.take`);
2. is under way in a worker of the runner (:meth:`Runner.results`);
3. has values, which the reader gets (:meth:`Queue.results_of`, :meth:`Queue.wait`). A design that
   raises ends the reading by an error. For one that is lost, as its process died or took too long,
   the function may have values of its own; otherwise it also ends the reading;
4. or waits again if its worker has left it to others (:meth:`Queue.take_back`).
"""

from __future__ import annotations

import math
import secrets
import statistics
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing
from itertools import islice
from types import MappingProxyType
from typing import Any, NoReturn

from pymoo_psi._modules import accept, require_unchanged, versions
from pymoo_psi._validation import Values, invalid, positive_number
from pymoo_psi.errors import EvaluationError, WorkerError
from pymoo_psi.parallel._evaluation import (
    Function,
    Result,
    Waiting,
    evaluate_here,
    lost_values,
)

# Seconds that the designs of a job take: long beside the message that brings it, some 0.1 ms.
_JOB_SECONDS = 0.05
# The least part of these seconds that is worth a job of its own.
_WORTHWHILE = 0.04
# Seconds of a job for each worker that there is: this process sends some hundreds of jobs a second,
# and a thousand workers must not ask for more.
_SECONDS_OF_WORKER = 0.002
# The first designs load libraries and say little: at most so many times as many follow.
_GROWTH = 10
# Jobs for each worker that are under way: one is evaluated while the next one waits beside it.
JOBS_AHEAD = 2


class Runner:
    """An ``elementwise_runner`` of this package; this base class evaluates in this process.

    A subclass writes ``n_workers`` and ``results``.

    Attributes:
        samples: Those of the last queue of designs; see :class:`Queue`.
        elastic: Whether workers may join and leave during a run.
        in_rounds: Whether designs that are added may wait for all that are being evaluated.
    """

    elastic = False
    in_rounds = False

    def __init__(self, timeout: float | None = None) -> None:
        self.timeout: float | None = (
            None if timeout is None else positive_number("timeout", timeout)
        )
        if timeout and sys.platform == "win32":
            raise invalid("timeout", "None on Windows", timeout)
        self.samples: deque[tuple[int, float]] = deque(maxlen=5)
        self._name = secrets.token_hex(8)
        self._problem: Any = None  # whose designs it was called for last

    def __getstate__(self) -> Values:
        """Copies and pickles have the settings; measurements stay here."""
        return self.__dict__ | {"samples": deque(maxlen=5), "_problem": None}

    @property
    def n_workers(self) -> int:
        """How many workers there are now; 0 for this process, or if none has joined yet."""
        return 0

    def results(self, queue: Queue) -> Generator[Result | None]:
        """Yield the results of a queue in any order, and ``None`` after moments without one.

        Raises:
            EvaluationError: A design raised or was lost.
            WorkerError: The function cannot be sent to workers, they cannot load it, or all of them
                are gone.
        """
        return queue.evaluated_here()

    def __call__(self, f: Function, X: Iterable[Any]) -> list[Values]:
        """Return ``f`` of each design of ``X``, in their order; pymoo calls this."""
        problem = getattr(f, "problem", f)
        if problem is not self._problem:  # a later change of its files does not end its run
            require_unchanged(problem)
            self._problem = problem
        values_of_designs = dict(enumerate(X))
        with closing(Queue(f, self)) as queue:
            queue.add(values_of_designs.items())
            for index, values, _ in queue:
                values_of_designs[index] = values
        return [*values_of_designs.values()]


class Queue:
    """Designs, points or tasks that wait, that are being evaluated, and that are done.

    Each has an index. More may be added while results are read, so that no worker waits for the
    slowest design of a batch.

    Args:
        function: What evaluates a design.
        runner: What evaluates; ``None`` is this process.
        in_pieces: Whether the function evaluates many points of a vectorised problem together. Then
            points are added, by the number of the first one, of which each job takes a piece.
        smallest: The number of points in the smallest job, and in the first ones.
        largest: The same for the largest job.
        seconds: What a job takes; it shrinks or grows until it does.

    Attributes:
        function: What evaluates a design.
        runner: What calls it.
        largest: The number of points in the largest job.
        samples: How many designs or points the last jobs had, and the seconds that one took. Their
            median counts: a first evaluation often loads libraries, and a busy machine stalls.
        waiting: What no worker has begun, with its index.
        is_paused: Whether no worker may begin anything.
    """

    def __init__(
        self,
        function: Callable[[Any], Any],
        runner: Runner | None = None,
        *,
        in_pieces: bool = False,
        smallest: int = 1,
        largest: int = sys.maxsize,
        seconds: float = _JOB_SECONDS,
    ) -> None:
        self.function = function
        self.runner: Runner = runner or Runner()
        self._in_pieces = in_pieces
        self._smallest = smallest
        self.largest = largest
        self._seconds = seconds
        self.samples: deque[tuple[int, float]] = deque(maxlen=5)
        if not in_pieces:
            self.samples = self.runner.samples  # of all batches
        self._reset()

    def _reset(self) -> None:
        """Forget whatever was added."""
        self.waiting: Waiting = deque()
        self.is_paused = False
        self._under_way: dict[int, Any] = {}  # what was taken and is not done, by its index
        self._results: Generator[Result | None] | None = None
        self._versions: dict[str, bytes] = {}  # those of the modules that were accepted

    # As its reader sees it

    @property
    def n_pending(self) -> int:
        """How many of what was added have no result yet, and are not held by a pause."""
        n_pending = len(self._under_way)
        if not self.is_paused:
            n_pending += len(self.waiting)
        return n_pending

    @property
    def first_pending(self) -> int:
        """The first index without a result; the largest number if there is none."""
        # what waits again is in the order in which jobs end
        return min([*self._under_way, *dict([*self.waiting])], default=sys.maxsize)

    @property
    def n_waiting(self) -> int:
        """How many designs or points no worker has begun."""
        if self._in_pieces:
            return sum(len(points) for _, points in [*self.waiting])
        return len(self.waiting)

    def add(self, designs: Iterable[tuple[int, Any]]) -> None:
        """Add designs with their indices."""
        self.waiting.extend(designs)

    def wait(self) -> Result | None:
        """Return another result, or ``None`` after a moment without one.

        Returns:
            The index, the values, and the seconds of the evaluation.

        Raises:
            EvaluationError: As for :meth:`Runner.results`, as the next one.
            WorkerError: As for :meth:`Runner.results`.
        """
        if self._results is None:
            self._results = self.runner.results(self)
        return next(self._results)

    def __iter__(self) -> Iterator[Result]:
        """Yield results until nothing is pending, in any order."""
        while self.n_pending:
            result = self.wait()
            if result is not None:
                yield result

    def close(self) -> None:
        """Give up what is not done; workers with nothing to do are kept."""
        if self._results is not None:
            if not self._under_way and not self.waiting:
                next(self._results, None)  # the end, where workers become idle
            self._results.close()
        self._reset()

    # As a runner sees it

    @property
    def is_ready(self) -> bool:
        """Whether there is something that may be begun."""
        return len(self.waiting) > 0 and not self.is_paused

    def evaluated_here(self) -> Generator[Result | None]:
        """Evaluate what waits in this process; yield results, and ``None`` when a pause begins."""
        while self.is_ready:
            designs = self.take()
            for result in self.results_of(evaluate_here(self.function, designs)):
                yield result
                if self.is_paused:
                    self.take_back(designs)
                    yield None

    def take(self) -> Waiting:
        """Take the designs of the next job, or the next piece of the points that wait."""
        size = self._size()
        if self._in_pieces:
            self._cut_first_piece(size)
            size = 1
        taken = deque(islice(self.waiting, size))
        # Only then removed, as the reader may look at the same time: joblib has threads of its own.
        self._under_way.update(taken)
        for _ in taken:
            self.waiting.popleft()
        return taken

    def _cut_first_piece(self, size: int) -> None:
        """Let the rest of the first points that wait be the second ones."""
        first, points = self.waiting[0]
        if len(points) > size:
            rest = points.at(slice(size, None))
            self.waiting[0] = first, points.at(slice(0, size))
            self.waiting.insert(1, (int(rest.numbers[0]), rest))

    def take_back(self, designs: Waiting) -> None:
        """Let designs of a job that are not evaluated wait for another one."""
        while designs:
            index, design = designs.pop()
            if index in self._under_way:
                del self._under_way[index]
                self.waiting.appendleft((index, design))

    def _size(self) -> int:
        """Return how many designs or points the next job has, at least 1.

        They take the seconds of a job, by the last ones, and are at most half of a worker's share,
        so that all workers end together, unless that is too little to be worth a message.
        """
        if not self.samples:
            return self._smallest
        last_size, _ = self.samples[-1]
        # 0 seconds where a clock is too coarse
        seconds = max(statistics.median_low([seconds for _, seconds in self.samples]), 1e-9)
        size = min(int(self.job_seconds / seconds), _GROWTH * last_size, self.largest)
        n_workers = self.runner.n_workers
        if n_workers > 1:
            share = math.ceil(self.n_waiting / n_workers)
            worthwhile = math.ceil(_WORTHWHILE * self._seconds / seconds)
            size = min(size, max(math.ceil(share / 2), min(worthwhile, share)))
        return max(size, self._smallest)

    @property
    def job_seconds(self) -> float:
        """Seconds that the designs of a job should take."""
        return max(self._seconds, _SECONDS_OF_WORKER * self.runner.n_workers)

    def results_of(
        self,
        results: Iterable[Result],
        failure: EvaluationError | None = None,
        versions_of_worker: Mapping[str, bytes] = MappingProxyType({}),
    ) -> Generator[Result]:
        """Yield the results of a job; what they are of is under way no more.

        Args:
            results: The results.
            failure: The error that ended the job.
            versions_of_worker: The versions of the modules that its worker has imported.

        Raises:
            EvaluationError: A design raised or was lost.
            WorkerError: The worker has another version of a module than this process or others.
        """
        if versions_of_worker:
            self._versions = self._versions or versions()
            accept(self._versions, versions_of_worker)
        n_measured = 0
        measured_seconds = 0.0
        for index, values, seconds in results:
            design = self._under_way.pop(index)
            if isinstance(values, OSError):
                yield index, lost_values(self.function, design, str(values)), 0.0
                continue
            n_measured += len(design) if self._in_pieces else 1
            measured_seconds += seconds
            yield index, values, seconds
        if n_measured:
            self.samples.append((n_measured, measured_seconds / n_measured))
        if failure is not None:
            raise failure

    def go_on_with(self, runner: Runner) -> Generator[Result | None]:
        """Let another runner evaluate what was under way when workers were lost, and the rest."""
        self.waiting.extendleft(self._under_way.items())
        self._under_way = {}
        self.runner = runner
        return runner.results(self)


def raise_original(error: EvaluationError) -> NoReturn:
    """Raise what a task has raised, or that its worker was lost.

    Raises:
        WorkerError: The worker was lost.
        Exception: What the task raised.
    """
    if error.original is None:
        raise WorkerError(f"a worker process failed: {error.reason}") from error
    raise error.original from error.original.__cause__
