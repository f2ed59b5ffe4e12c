"""The contract between a runner and the function it runs, for designs that fail.

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
import os
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from multiprocessing.pool import RemoteTraceback  # type: ignore[attr-defined]
from typing import Any, NoReturn

import cloudpickle

from pymoo_psi.errors import EvaluationError

Values = dict[str, Any]
Function = Callable[[Any], Values]
Waiting = deque[tuple[int, Any]]  # designs that nobody evaluates yet, each with its index
Result = tuple[int, Any, float]  # a design's index, its values, the seconds of its evaluation

_LONGEST = 400  # characters of a reason: some lines of a terminal or a cell of a table


def one_line(error: BaseException) -> str:
    """Return the type and the message of an exception as one line."""
    name = type(error).__name__
    try:
        text = " ".join(str(error).split())
    except Exception as failure:
        text = f"its message cannot be read: {type(failure).__name__}"
    text = f"{name}: {text}" if text else name
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


# Two guards, since the folder takes system calls that cost more than a cheap design: it is looked
# after once for many designs where they are evaluated one after the other.


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
    """End a process that a model forked and that comes back here.

    It would go on with the run, and its values be taken for those of its parent's design.
    """
    process = os.getpid()
    try:
        yield
    finally:
        if os.getpid() != process:
            os._exit(0)  # without the handlers and buffers that the parent will end with


def evaluate_to_travel(function: Function, design: Any) -> Values:
    """Evaluate in a worker, where whatever ends an evaluation is an error that can be sent.

    Raises:
        EvaluationError: The function raised.
    """
    try:
        with same_folder(), same_process():
            return function(design)
    except BaseException as error:
        # An interrupt can only come from the model here, elsewhere from the user, too.
        if isinstance(error, KeyboardInterrupt) and hasattr(function, "lost"):
            values: Values = function.lost(design, one_line(error))
            return values
        if isinstance(error, EvaluationError):
            error.original = _sendable(error.original)
        trace = "".join(traceback.format_exception(error))
        raise EvaluationError(design, one_line(error), _sendable(error), trace) from None


def raise_again(error: EvaluationError) -> NoReturn:
    """Raise an error of a design, its cause with the traceback from a worker if it was there."""
    original = error.original
    if isinstance(original, EvaluationError):  # of a problem that tells the design itself
        design, reason = original.design, original.reason
        raise_again(EvaluationError(design, reason, original.original, error.trace))
    there = remote_traceback(error)
    if original is None:
        raise error from there
    if there is not None:
        original.__cause__ = there
    raise error from original


def remote_traceback(error: EvaluationError) -> BaseException | None:
    """Return the traceback of a worker, to be shown as a cause; None if there is none."""
    return RemoteTraceback(f'\n"""\n{error.trace}"""') if error.trace else None


def _sendable(error: BaseException | None) -> BaseException | None:
    """Return the exception if pickling keeps it; many with own constructors do not survive."""
    try:
        copy = cloudpickle.loads(cloudpickle.dumps(error))
    except Exception:
        return None
    return error if type(copy).__name__ == type(error).__name__ else None
