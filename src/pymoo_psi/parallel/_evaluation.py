"""The evaluation of one design after another: its values, its errors, its seconds.

pymoo hands a runner a function ``f`` and the designs; the runner returns one dictionary of values
per design, in their order. What pymoo leaves open is a design without values:

- ``f(design)`` raises: the runner raises :class:`~pymoo_psi.errors.EvaluationError`, which names
  the design and has the exception as its cause.
- the evaluation is lost, because it ran out of time or its process died: the runner returns
  ``f.lost(design, reason)`` in the place of the design if ``f`` has such a method, as the function
  of :class:`~pymoo_psi.FailureTolerant` has, and else raises the same error.
"""

from __future__ import annotations

import contextlib
import math
import os
import statistics
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Any

import cloudpickle
import numpy as np

from pymoo_psi.errors import EvaluationError

Values = dict[str, Any]
Function = Callable[[Any], Values]
Waiting = deque[tuple[int, Any]]  # designs to be evaluated, each with its index
Result = tuple[int, Any, float]  # a design's index, its values, the seconds of its evaluation

MOMENT = 1e-3  # seconds between two measurements: long beside one, short beside sending a design
# Seconds that a chunk of designs lasts: long beside the message that brings it, some 0.1 ms.
CHUNK = 0.05
_LONGEST_REASON = 400  # characters: some lines of a terminal or a cell of a table


class Cost:
    """The seconds a design takes, by the last measurements.

    Whether designs are worth sending is decided by the median, because a first evaluation often
    loads libraries and a busy machine stalls. How many travel together is decided by the longest:
    where short and long designs come in runs, the median sends several behind a long one.
    """

    def __init__(self) -> None:
        self._samples: deque[float] = deque(maxlen=32)

    def add(self, seconds: float) -> None:
        """Add the seconds of a design."""
        self._samples.append(max(seconds, 1e-9))  # 0 where a clock is too coarse

    @property
    def measured(self) -> bool:
        """Whether any design has been measured."""
        return bool(self._samples)

    def worth_sending(self, designs: int, workers: int, overhead: float) -> bool:
        """Whether workers save at least twice the overhead, since both are estimates.

        Known is the cost by three designs, or by one that takes more than an import.
        """
        recent = list(self._samples)[-5:]
        if len(recent) < 3 and max(recent, default=0.0) < 1.0:
            return False
        seconds = statistics.median_low(recent)
        return designs * seconds * (1 - 1 / workers) > 2 * overhead

    def chunk(self, waiting: int, workers: int) -> int:
        """Return how many of the waiting designs travel together next, at least 1.

        No more than half of a worker's share, so that all workers end together.
        """
        longest = max(self._samples, default=math.inf)
        return max(1, min(int(CHUNK / longest), math.ceil(waiting / (2 * workers))))


def one_line(error: BaseException) -> str:
    """Return the type and the message of an exception as one line."""
    name = type(error).__name__
    try:
        text = " ".join(str(error).split())
    except Exception as failure:
        text = f"its message cannot be read: {type(failure).__name__}"
    text = f"{name}: {text}" if text else name
    return text if len(text) <= _LONGEST_REASON else f"{text[: _LONGEST_REASON - 3]}..."


@contextlib.contextmanager
def same_folder() -> Iterator[None]:
    """Undo a model's ``chdir``, which would move all relative file names of the process."""
    try:
        folder = os.getcwd()
    except OSError:  # it has been deleted: nowhere to come back to, as chdir("") is an error
        folder = ""
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # the model has deleted it
            os.chdir(folder)


@contextlib.contextmanager
def same_process() -> Iterator[None]:
    """End a process that a model forked and that returns here instead of ending."""
    process = os.getpid()
    try:
        yield
    finally:
        if os.getpid() != process:
            os._exit(0)  # without the handlers and buffers that the parent will end with


def evaluate_here(
    f: Function,
    waiting: Waiting,
    cost: Cost | None = None,
    enough: Callable[[int], bool] = lambda left: False,
    *,
    moment: float = MOMENT,
) -> Iterator[Result]:
    """Evaluate designs in this process until none waits or there is enough.

    Args:
        f: What to evaluate.
        waiting: The designs; they are taken from it.
        cost: Takes the measurements.
        enough: Given the number of designs left, says whether to stop; asked before the first
            design and after every measurement.
        moment: Seconds of work between two measurements; 0 gives the values of each design
            before the next one is evaluated.

    Raises:
        EvaluationError: A design raised; the results before it are given first.
    """
    cost = cost or Cost()
    while waiting and not enough(len(waiting)):
        found: list[tuple[int, Values]] = []
        failure: BaseException | None = None
        allowed = moment if cost.measured else 0.0
        began = now = perf_counter()
        # Nothing is given from within: whoever reads the results would have the model's settings.
        with same_folder(), np.errstate():
            while waiting and failure is None and (now - began < allowed or not found):
                index, design = waiting.popleft()
                try:
                    found.append((index, f(design)))
                except Exception as error:
                    if not isinstance(error, EvaluationError):
                        error = EvaluationError(design, one_line(error), error)
                    failure = error
                except BaseException as error:  # an interrupt
                    failure = error
                now = perf_counter()
        seconds = (now - began) / max(len(found), 1)
        cost.add(seconds)
        for index, values in found:
            yield index, values, seconds
        if failure is not None:
            raise failure


def evaluate_chunk(f: Function, chunk: list[Any]) -> Iterator[tuple[Values, float]]:
    """Give the values and the seconds of designs one after the other, in a worker.

    It stops early where they take longer than expected: those that are left are for others.

    Raises:
        EvaluationError: Whatever ended an evaluation, as an error that can be sent.
    """
    began = perf_counter()
    for design in chunk:
        start = perf_counter()
        if start - began > 2 * CHUNK:
            return
        values = _evaluate(f, design)
        yield values, perf_counter() - start


def _evaluate(f: Function, design: Any) -> Values:
    try:
        with same_folder():
            return f(design)
    except BaseException as error:
        # An interrupt can only come from the model here, elsewhere from the user, too.
        if isinstance(error, KeyboardInterrupt) and hasattr(f, "lost"):
            values: Values = f.lost(design, one_line(error))
            return values
        if isinstance(error, EvaluationError):
            error.original = _sendable(error.original)
        trace = "".join(traceback.format_exception(error))
        raise EvaluationError(design, one_line(error), _sendable(error), trace) from None


def _sendable(error: BaseException | None) -> BaseException | None:
    """Return the exception if pickling keeps it; many with own constructors do not survive."""
    try:
        copy = cloudpickle.loads(cloudpickle.dumps(error))
    except Exception:
        return None
    return error if type(copy).__name__ == type(error).__name__ else None
