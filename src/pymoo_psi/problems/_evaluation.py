"""The evaluation of designs some of which may fail: values, checked, or the reason for none.

What a model gives counts only where it is what the problem promises. A design fails if its
evaluation raises, is lost by a runner, or gives values that are missing, of another shape, no
numbers, NaN, or infinite though the design is feasible.
"""

from __future__ import annotations

import copy
from collections.abc import Generator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import LoopedElementwiseEvaluation, Problem

from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel import (
    MOMENT,
    JoblibRunner,
    Result,
    Values,
    Waiting,
    evaluate_here,
    one_line,
    same_folder,
)
from pymoo_psi.pareto import competes, meets_constraints

# A call for many designs that raises says nothing of any of them. They are evaluated again in
# parts of this size, and those of a part that raises, one by one: 64 designs so take at most 128
# evaluations, and one culprit among 65 536 is found in 1100 calls.
_PART = 64


def evaluate_designs(
    problem: Any, X: Any, *args: Any, stop: bool = False, **kwargs: Any
) -> dict[str, Any]:
    """Evaluate designs as pymoo's ``evaluate``; one that fails has a reason instead of values.

    The model gets copies of the designs, and its values are copied: whatever it does to either
    afterwards, or to an array that it returns again and again, the values stay with their design.

    Args:
        problem: A pymoo problem, elementwise or not.
        X: n designs as the problem takes them.
        *args: For the model, as pymoo passes them.
        stop: Raise at a design that fails. Designs that are evaluated together or in processes
            are finished first.
        **kwargs: For the model, as pymoo passes them.

    Returns:
        ``F`` ``(n, m)``, infinite where a design failed; ``G`` ``(n, n_ieq)`` and ``H``
        ``(n, n_eq)``, 0 there; ``failure`` ``(n,)``, the reasons, empty where a design did not
        fail; and what else the model gives, NaN or None where it does not.

    Raises:
        EvaluationError: A design failed and ``stop`` is true.
    """
    model = _Model(problem, args, kwargs, stop)
    # A problem with a `do` of its own transforms designs or values on the way, as pymoo's
    # ZeroToOne does; its model must not be reached around it.
    with same_folder(), np.errstate():  # both are as before, whatever the model sets
        if problem.elementwise and type(problem).do is Problem.do:
            out = model.columns(problem.elementwise_runner(model, X))
        else:
            out = _together(model, X)
    if problem.callback is not None:
        problem.callback(copy.copy(X), out)
    return out


def streams(problem: Any) -> bool:
    """Whether a problem's designs can go to the workers one after the other.

    Others are evaluated in batches: by a vectorised model, a runner that is not ours, or where a
    callback of the problem expects batches.
    """
    runner = type(problem.elementwise_runner)
    return bool(
        problem.elementwise
        and type(problem).do is Problem.do
        and problem.callback is None
        and runner.__call__ in (JoblibRunner.__call__, LoopedElementwiseEvaluation.__call__)
    )


def stream_designs(problem: Any, waiting: Waiting, *, one_by_one: bool) -> Generator[Result]:
    """Evaluate the designs of a queue and give the values of each as soon as they are there.

    A design that fails has its reason as ``failure``, as in :func:`evaluate_designs`.

    Args:
        problem: A pymoo problem that :func:`streams`.
        waiting: The designs with their indices; more may be added while the results are read.
        one_by_one: Give the values of a design before the next one is evaluated, where that is
            done in this process; otherwise cheap designs come in groups.
    """
    model, runner = _Model(problem, (), {}, stop=False), problem.elementwise_runner
    if isinstance(runner, JoblibRunner):
        yield from runner.stream(model, waiting)
    else:
        yield from evaluate_here(model, waiting, moment=0.0 if one_by_one else MOMENT)


def columns_of_values(problem: Any, rows: list[Values]) -> dict[str, Any]:
    """Return the values of designs, one dictionary each, as :func:`evaluate_designs` does."""
    return _Model(problem, (), {}, stop=False).columns(rows)


class _Model:
    """What a runner runs: pymoo's function, with checked values or the reason for none."""

    def __init__(self, problem: Any, args: Any, kwargs: Any, stop: bool) -> None:
        self.problem, self.args, self.kwargs, self.stop = problem, args, kwargs, stop
        self.sizes = {"F": problem.n_obj, "G": problem.n_ieq_constr, "H": problem.n_eq_constr}
        self.function = problem.elementwise_func(problem, args, kwargs)

    def __call__(self, x: Any) -> Values:
        """Return the values of one design."""
        try:
            return self.checked(self.function(copy.copy(x)))
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a legacy model exits; Rust and asyncio have their own
            return self.failed(x, error)

    def lost(self, x: Any, reason: str) -> Values:
        """Return what stands for the values of a design whose evaluation a runner has lost."""
        return self.failed(x, EvaluationError(x, reason))

    def failed(self, x: Any, error: BaseException) -> Values:
        """Return the reason why a design failed, or raise if the run is to stop."""
        cause: BaseException | None = error
        if isinstance(error, EvaluationError):
            reason, cause = error.reason, error.original
        elif isinstance(error, _BadValues):
            reason, cause = str(error), None
        else:
            reason = one_line(error)
        if self.stop:
            raise EvaluationError(x, reason, cause) from cause
        return {"failure": reason}

    def raw(self, X: Any) -> dict[str, Any]:
        """Return what a vectorised model gives for designs, as it gives it."""
        designs = copy.copy(X)
        if isinstance(X, list) or (X.dtype == object and X.ndim == 1):  # dictionaries, by name
            for i, x in enumerate(X):
                designs[i] = copy.copy(x)
        out: dict[str, Any] = dict.fromkeys(self.sizes)
        if type(self.problem).do is Problem.do:
            # without pymoo's `do`, which reshapes (m, n) to (n, m) and fills what is missing
            self.problem._evaluate_vectorized(designs, out, *self.args, **self.kwargs)
        else:
            out |= self.problem.do(designs, [*self.sizes], *self.args, **self.kwargs)
        return out

    def checked(self, raw: Values) -> Values:
        """Return the values of one design as arrays of their own.

        Raises:
            _BadValues: A value cannot be used.
        """
        stands_for_nan = self.problem.replace_nan_values_by
        row: Values = {"failure": ""}
        for name, size in self.sizes.items():
            numbers = row[name] = _floats(name, raw.get(name), size)
            if numbers.size != size or (numbers.ndim > 1 and max(numbers.shape) != size):
                raise _BadValues(f"{name} has shape {numbers.shape} instead of {(size,)}")
            numbers = row[name] = numbers.reshape(size)
            if stands_for_nan is not None:
                numbers[np.isnan(numbers)] = stands_for_nan
            # The greatest of some numbers is NaN if one of them is, and sooner found than all.
            if size and np.isnan(np.maximum.reduce(numbers)):
                raise _BadValues(f"{name} is {numbers.tolist()}")
        if not np.isfinite(row["F"]).all() and meets_constraints(row["G"], row["H"]):
            raise _BadValues(f"F is {row['F'].tolist()} though the design is feasible")
        for name, value in raw.items():
            if name not in row and value is not None:
                mutable = isinstance(value, (np.ndarray, list, dict))
                row[name] = copy.copy(value) if mutable else value
        return row

    def columns(self, rows: list[Values]) -> dict[str, Any]:
        """Return the values of designs, one dictionary each, as one dictionary of arrays."""
        out: dict[str, Any] = {}
        for name, size in self.sizes.items():
            failed = np.full(size, np.inf if name == "F" else 0.0)
            column = [row.get(name, failed) for row in rows]
            out[name] = np.array(column).reshape(len(rows), size)
        out["failure"] = np.fromiter((row["failure"] for row in rows), object)
        for name in dict.fromkeys(name for row in rows for name in row):
            if name not in out:
                out[name] = value_column([row.get(name) for row in rows])
        return out


class _BadValues(Exception):  # noqa: N818 - only ever a reason, and never leaves this module
    """What a model returned cannot be used."""


def _together(model: _Model, X: Any) -> dict[str, Any]:
    """Evaluate designs by calls for as many as possible; see :func:`evaluate_designs`."""
    n = len(X)
    part = n - 1
    # A square matrix may be the wrong way round and would not show it: then one design less.
    if n == 1 or n not in model.sizes.values():
        try:
            raw = model.raw(X)
            given = {name: _matrix(name, raw.get(name), n, m) for name, m in model.sizes.items()}
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # see __call__
            if n == 1:
                return model.columns([model.failed(X[0], error)])
            part = _PART if n > _PART else 1
        else:
            return _checked_rows(model, X, raw, given)
    rows: list[Values] = []
    for start in range(0, n, part):
        out = _together(model, X[start : start + part])
        rows += [{name: column[i] for name, column in out.items()} for i in range(len(out["F"]))]
    return model.columns(rows)


def _checked_rows(
    model: _Model, X: Any, raw: dict[str, Any], given: dict[str, NDArray[np.float64]]
) -> dict[str, Any]:
    """Return the values of n designs; rows that are not all finite are looked at one by one.

    Args:
        model: What gave the values.
        X: The designs.
        raw: The values, of which those beside F, G and H are taken.
        given: ``F``, ``G`` and ``H``, each ``(n, size)``.
    """
    n, out = len(X), dict[str, Any](given)
    feasible = meets_constraints(out["G"], out["H"])
    doubtful = np.isnan(np.hstack([*given.values()])).any(axis=1)
    doubtful |= feasible & ~competes(out["F"], feasible)
    out["failure"] = np.full(n, "", dtype=object)
    for i in np.flatnonzero(doubtful):
        try:
            row = model.checked({name: array[i] for name, array in given.items()})
        except _BadValues as error:
            failed = model.columns([model.failed(X[i], error)])
            row = {name: column[0] for name, column in failed.items()}
        for name, value in row.items():
            out[name][i] = value
    for name, value in raw.items():
        if name in given or value is None:
            continue
        array = isinstance(value, np.ndarray) and value.ndim > 0
        many = (array or isinstance(value, list)) and len(value) == n
        if many and type(value) is np.ndarray and value.dtype.kind in "fiub":
            out[name] = value.copy()  # a million rows one by one would take a second
        else:
            out[name] = value_column(list(value) if many else [value] * n)
    return out


def _matrix(name: str, value: Any, n: int, size: int) -> NDArray[np.float64]:
    """Return values of n designs as an ``(n, size)`` array; their shape must be exact."""
    if size == 0 and np.size(value) <= 1:  # None, or nothing of any shape
        return np.zeros((n, 0))
    if isinstance(value, list):  # as in pymoo, a list holds the columns
        value = np.ma.column_stack(value)
    array = _floats(name, value, size)
    if array.shape != (n, size) and (size, array.shape) != (1, (n,)):
        raise _BadValues(f"{name} has shape {array.shape} instead of {(n, size)}")
    return array.reshape(n, size)


def _floats(name: str, value: Any, size: int) -> NDArray[np.float64]:
    """Return values as a new array of floats, NaN where they are masked."""
    if value is None:
        if size:
            raise _BadValues(f"{name} is missing")
        return np.zeros(0)
    try:
        array = np.asarray(value)
        if array.dtype == np.float64 and not isinstance(value, np.ma.MaskedArray):
            return array.copy()
        if array.dtype.kind == "c" and not array.imag.any():
            value = array.real
        elif array.dtype.kind in "cmM":  # NumPy would drop a half, or count nanoseconds
            raise TypeError(f"it holds {array.dtype}")
        with np.errstate(over="ignore"):  # of long doubles
            return np.ma.array(value, dtype=np.float64).filled(np.nan)
    except (TypeError, ValueError, OverflowError) as error:
        raise _BadValues(f"{name} is not an array of numbers: {error}") from error


def value_column(values: list[Any]) -> NDArray[Any]:
    """Return another value of all designs as an array; NaN or None where a design has none."""
    # NumPy would take what lies under the mask for the value.
    values = [None if np.ma.is_masked(value) else value for value in values]
    present = [value for value in values if value is not None]
    if not present:
        return np.full(len(values), np.nan)
    try:
        arrays = [np.asarray(value) for value in present]
    except ValueError:  # lists in it differ in length
        return np.fromiter(values, object)
    if any(a.shape != arrays[0].shape or a.dtype.kind not in "fiub" for a in arrays):
        return np.fromiter(values, object)
    nothing = np.full(arrays[0].shape, np.nan)
    return np.array([nothing if value is None else value for value in values])
