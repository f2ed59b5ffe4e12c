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

import os
import sys
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from math import inf
from multiprocessing.pool import ExceptionWithTraceback  # type: ignore[attr-defined]
from time import perf_counter
from typing import Any

import cloudpickle
import numpy as np

from pymoo_psi._modules import REMEDY, version_of, versions
from pymoo_psi._validation import Values
from pymoo_psi.errors import EvaluationError, WorkerError

Function = Callable[[Any], Values]
Waiting = deque[tuple[int, Any]]  # designs to be evaluated, each with its index
# A design's index, its values, the seconds of its evaluation; an OSError stands for the values of a
# design that was lost, and says why: a TimeoutError if it took too long.
Result = tuple[int, Any, float]
# Results of the designs that were evaluated, the error that ended the evaluation, and the versions
# of the modules that the worker has imported.
Answer = tuple[list[Result], EvaluationError | None, dict[str, bytes]]


def one_line(error: BaseException) -> str:
    """Return the type and the message of an exception as one line."""
    text = " ".join(f"{type(error).__name__}: {error}".split()).removesuffix(":")
    if len(text) > 400:  # some lines of a terminal, or a cell of a table
        return f"{text[:397]}..."  # also within a word: a path or JSON may be one
    return text


@contextmanager
def same_folder() -> Iterator[None]:
    """Undo a model's ``chdir``, which would move all relative file names of the process."""
    folder = os.getcwd()
    try:
        yield
    finally:
        os.chdir(folder)


def evaluate_here(f: Function, waiting: Waiting, end: float = inf) -> Iterator[Result]:
    """Evaluate designs in this process until none waits, or until some time.

    Args:
        f: What to evaluate.
        waiting: The designs; they are taken from it.
        end: When to stop, by ``perf_counter``.

    Raises:
        EvaluationError: A design raised, as the ``original``.
    """
    while waiting and perf_counter() < end:
        index, design = waiting.popleft()
        began = perf_counter()
        with same_folder(), np.errstate():  # which a model may change
            try:
                values = f(design)
            except (KeyboardInterrupt, EvaluationError):
                raise
            except BaseException as error:  # a model exits; Rust and asyncio have their own
                raise EvaluationError(design, one_line(error), error) from error
        yield index, values, perf_counter() - began


def answer_of(f: Function, designs: Waiting) -> Answer:
    """Evaluate designs in this process; return the results, and the error of one that raised."""
    results = []
    try:
        for result in evaluate_here(f, designs):
            results.append(result)
    except EvaluationError as error:
        return results, error, {}
    return results, None, {}


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
        WorkerError: It cannot be loaded, or this process has another version of a module of the
            users.
    """
    try:
        function, sent = cloudpickle.loads(pickled)
    except BaseException as error:  # a module may exit when it is imported
        raise unloadable(one_line(error)) from error
    for name, version in versions().items():
        file = sys.modules[name].__file__ or ""
        if version != (sent.get(name) or version_of(file)):
            name = os.path.basename(file)
            raise WorkerError(
                f"a worker process has another version of {name} than the main process; {REMEDY}"
            )
    loaded: Function = function
    return loaded


def unloadable(reason: str) -> WorkerError:
    """Return the error for a function that a worker process cannot load."""
    return WorkerError(
        f"a worker process cannot load the problem: {reason}; define it in a module that can be "
        "imported, or in the main script"
    )


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


def sendable_result(result: Result) -> Result:
    """Return a result that can be pickled; a design whose values cannot be is lost."""
    try:
        cloudpickle.dumps(result)
    except Exception as error:
        reason = f"its values cannot be sent between processes: {one_line(error)}"
        return result[0], OSError(reason), 0.0
    return result


_loaded = lru_cache(maxsize=4)(loaded_function)  # those of the last runs


def answer_by(pickled: bytes, designs: Waiting) -> Answer:
    """Return the answer of a pickled function, to be sent; see :func:`answer_of`."""
    results, failure, _ = answer_of(_loaded(pickled), designs)
    sent = [sendable_result(result) for result in results]
    if failure is not None:
        failure = sendable(failure)
    return sent, failure, versions()
