"""The evaluation of one design after another: its values, its errors, its seconds.

pymoo gives a runner a function ``f`` and the designs; the runner returns a dictionary of values for
each design, in their order. pymoo does not define what happens to a design without values:

- ``f(design)`` raises: the runner raises :class:`~pymoo_psi.errors.EvaluationError`, which names
  the design and has the exception as its cause.
- the evaluation is lost because it ran out of time or its process died: the runner returns
  ``f.lost(design, reason)`` for the design if ``f`` has such a method, as the function of
  :class:`~pymoo_psi.FailureTolerant` has, and otherwise raises the same error.
"""

from __future__ import annotations

import math
import os
import statistics
import sys
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.pool import ExceptionWithTraceback  # type: ignore[attr-defined]
from time import perf_counter
from typing import Any, NamedTuple

import cloudpickle
import numpy as np

from pymoo_psi._modules import REMEDY, version_of, versions
from pymoo_psi._validation import Values
from pymoo_psi.errors import EvaluationError, WorkerError

Function = Callable[[Any], Values]
Waiting = deque[tuple[int, Any]]  # designs to be evaluated, each with its index
Result = tuple[int, Any, float]  # a design's index, its values, the seconds of its evaluation


class LostDesign(NamedTuple):
    """Stands for the values of a design that was lost."""

    reason: str


# Seconds of evaluations between two measurements: many times as long as a measurement takes, and
# shorter than sending a design to a worker.
_MEASURED_SECONDS = 1e-3
# Seconds that a chunk of designs takes: long beside the message that brings it, some 0.1 ms.
CHUNK_SECONDS = 0.05
# Seconds without a result after which the reader of results may do something else.
POLLING_SECONDS = 0.05


class Cost:
    """The seconds a design takes: the median of the last five measurements.

    A first evaluation often loads libraries, and a busy machine stalls.

    Attributes:
        samples: The measurements, to which others are appended.
    """

    def __init__(self) -> None:
        self.samples: deque[float] = deque(maxlen=5)

    @property
    def seconds(self) -> float:
        """Seconds of a design; infinite if none is measured."""
        if not self.samples:
            return math.inf
        return statistics.median_low(self.samples)

    def worth_sending(self, designs: int, workers: int, overhead: float) -> bool:
        """Whether workers save at least twice the overhead, since both are estimates.

        The cost is known from three designs, or from one that takes longer than an import.
        """
        is_known = len(self.samples) >= 3 or 1.0 <= self.seconds < math.inf
        return is_known and designs * self.seconds * (1 - 1 / workers) > 2 * overhead

    def chunk(self, waiting: int, workers: int, lasting: float) -> int:
        """Return how many of the waiting designs to send together next, at least 1.

        They are at most half of a worker's share, so that all workers end together.

        Args:
            waiting: The number of waiting designs.
            workers: The number of workers.
            lasting: Seconds that the designs may take.
        """
        # 0 seconds where a clock is too coarse
        n_lasting = int(lasting / max(self.seconds, 1e-9))
        half_share = math.ceil(waiting / (2 * workers))
        return max(1, min(n_lasting, half_share))


def one_line(error: BaseException) -> str:
    """Return the type and the message of an exception as one line."""
    text = " ".join(f"{type(error).__name__}: {error}".split()).removesuffix(":")
    if len(text) > 400:  # some lines of a terminal, or a cell of a table
        return f"{text[:397]}..."
    return text


@contextmanager
def same_folder() -> Iterator[None]:
    """Undo a model's ``chdir``, which would move all relative file names of the process."""
    folder = os.getcwd()
    try:
        yield
    finally:
        os.chdir(folder)


def evaluate_here(
    f: Function,
    waiting: Waiting,
    cost: Cost | None = None,
    enough: Callable[[int], bool] = lambda left: False,
    *,
    moment: float = _MEASURED_SECONDS,
) -> Iterator[Result]:
    """Evaluate designs in this process until none waits or ``enough`` says to stop.

    Args:
        f: What to evaluate.
        waiting: The designs; they are taken from it.
        cost: Takes the measurements.
        enough: Whether to stop, given the number of designs left; asked before the first design
            and after every measurement.
        moment: Seconds of work between two measurements; 0 yields the values of each design
            before the next one is evaluated.

    Raises:
        EvaluationError: A design raised, as the ``original``; the results before it are yielded
            first.
    """
    cost = cost or Cost()
    while waiting and not enough(len(waiting)):
        results: list[tuple[int, Values]] = []
        failure = None
        allowed = moment
        if cost.seconds == math.inf:
            allowed = 0.0
        began = perf_counter()
        now = began
        # Nothing is yielded from within: the reader of the results would have the model's settings.
        with same_folder(), np.errstate():
            try:
                while waiting and (now - began < allowed or not results):
                    index, design = waiting.popleft()
                    results.append((index, f(design)))
                    now = perf_counter()
            except (KeyboardInterrupt, EvaluationError) as error:
                failure = error
            except BaseException as error:  # a model exits; Rust and asyncio have their own
                failure = EvaluationError(design, one_line(error), error)
        seconds = (perf_counter() - began) / max(len(results), 1)
        cost.samples.append(seconds)
        for index, values in results:
            yield index, values, seconds
        if failure is not None:
            raise failure


def pickled_function(function: Function) -> bytes:
    """Return a function as it is sent to other processes, from ``__main__`` by value.

    The versions of modules go with it.

    Raises:
        WorkerError: It cannot be pickled.
    """
    try:
        return bytes(cloudpickle.dumps((function, versions())))
    except Exception as error:
        raise WorkerError(
            f"the problem cannot be sent to worker processes: {one_line(error)}; keep open "
            "files, locks and connections out of it, or run it without workers"
        ) from error


def loaded_function(pickled: bytes) -> Function:
    """Return a function that another process has pickled.

    Of a module that the other process does not have, the version must be that of the file.

    Raises:
        WorkerError: This process has another version of a module of the users.
    """
    function: Function
    function, sent = cloudpickle.loads(pickled)
    for name, version in versions().items():
        file = sys.modules[name].__file__ or ""
        if version != (sent.get(name) or version_of(file)):
            name = os.path.basename(file)
            raise WorkerError(
                f"a worker process has another version of {name} than the main process; {REMEDY}"
            )
    return function


def lost_values(function: Function, design: Any, reason: str) -> Values:
    """Return what a function gives for a lost design.

    Raises:
        EvaluationError: It has no method ``lost``.
    """
    if not hasattr(function, "lost"):
        raise EvaluationError(design, reason)
    values: Values = function.lost(design, reason)
    return values


def sendable(error: EvaluationError) -> EvaluationError:
    """Return an error that can be pickled; there, its cause is the traceback as text."""
    if error.original is not None:
        sent = ExceptionWithTraceback(error.original, error.original.__traceback__)
        try:
            cloudpickle.loads(cloudpickle.dumps(sent))
        except Exception:  # many with constructors of their own do not survive that
            sent.exc = RuntimeError(error.reason)
        error.original = sent
    return error
