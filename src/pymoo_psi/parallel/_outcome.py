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

import traceback
from collections.abc import Callable
from typing import Any, NoReturn

import cloudpickle

from pymoo_psi.errors import EvaluationError

Values = dict[str, Any]
Function = Callable[[Any], Values]

_LONGEST = 400  # characters of a reason


def one_line(error: BaseException) -> str:
    """Return the type and the message of an exception as one line."""
    text = " ".join(str(error).split())
    name = type(error).__name__
    text = f"{name}: {text}" if text else name
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def evaluate_to_travel(function: Function, design: Any) -> Values:
    """Evaluate in a worker, so that what is raised can be sent; an exit is an error here."""
    try:
        return function(design)
    except EvaluationError as error:
        travelling = _sendable(error.original)
        raise EvaluationError(design, error.reason, travelling, error.trace) from None
    except (Exception, SystemExit) as error:
        trace = "".join(traceback.format_exception(error))
        raise EvaluationError(design, one_line(error), _sendable(error), trace) from None


def raise_again(error: EvaluationError) -> NoReturn:
    """Raise an error that came from a worker, its cause with the traceback from there."""
    if error.original is None:
        raise error from (_RemoteTraceback(error.trace) if error.trace else None)
    if error.trace:
        error.original.__cause__ = _RemoteTraceback(error.trace)
    raise error from error.original


def lost_design(function: Function, design: Any, reason: str) -> Values:
    """Return the values that stand for a design whose evaluation is lost.

    Raises:
        EvaluationError: The function does not provide for such designs.
    """
    lost: Callable[[Any, str], Values] | None = getattr(function, "lost", None)
    if lost is None:
        raise EvaluationError(design, reason)
    return lost(design, reason)


class _RemoteTraceback(Exception):  # noqa: N818 - a carrier of text, not an error of its own
    """The traceback of a worker, shown as the cause of the exception that it belongs to."""

    def __str__(self) -> str:
        return f'\n"""\n{self.args[0]}"""'


def _sendable(error: BaseException | None) -> BaseException | None:
    """Return the exception if pickling keeps it; many with own constructors do not survive."""
    try:
        copy = cloudpickle.loads(cloudpickle.dumps(error))
    except Exception:
        return None
    return error if type(copy).__name__ == type(error).__name__ else None
