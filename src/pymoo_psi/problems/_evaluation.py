"""The evaluation of designs some of which may fail: values, checked, or the reason for none.

What a model gives counts only where it is what the problem promises. A design fails if its
evaluation raises, is lost by a runner, or gives values that are missing, of another shape, no
numbers, NaN, or infinite though the design is feasible.
"""

from __future__ import annotations

import copy
from collections.abc import Generator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import LoopedElementwiseEvaluation, Problem

from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel import (
    JoblibRunner,
    Result,
    Values,
    Waiting,
    evaluate_here,
    one_line,
    same_folder,
)
from pymoo_psi.pareto import competes, meets_constraints
from pymoo_psi.problems._wrapped import (
    WrappedProblem,
    changes_designs_only,
    uses_wrapped_values,
)

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
    if uses_wrapped_values(problem):

        def within(designs: Any) -> dict[str, Any]:
            return evaluate_designs(problem.wrapped, designs, *args, stop=stop, **kwargs)

        values: dict[str, Any] = problem.values_from(X, within)
        reasons = values.get("failure", [None] * len(X))
        return values | {"failure": np.array([reason or "" for reason in reasons], dtype=object)}
    model = _Model(problem, args, kwargs, stop)
    # A problem with a `do` of its own transforms designs or values on the way, as pymoo's
    # ZeroToOne does; its model must not be reached around it.
    with same_folder(), np.errstate():  # both are as before, whatever the model sets
        if problem.elementwise and type(problem).do is Problem.do:
            out = columns_of_values(problem, problem.elementwise_runner(model, X))
        else:
            out = model.together(X)
    if problem.callback is not None:
        problem.callback(copy.copy(X), out)
    return out


def streams(problem: Any) -> bool:
    """Whether a problem's designs can go to the workers one after the other.

    Others are evaluated in batches: by a vectorised model, a runner that is not ours, or where a
    callback of the problem expects batches.
    """
    while changes_designs_only(problem):
        problem = problem.wrapped
    runner = type(problem.elementwise_runner)
    return bool(
        problem.elementwise
        and type(problem).do is Problem.do
        and problem.callback is None
        and runner.__call__ in (JoblibRunner.__call__, LoopedElementwiseEvaluation.__call__)
    )


def stream_designs(problem: Any, waiting: Waiting) -> Generator[Result]:
    """Evaluate the designs of a queue and give the values of each as soon as they are there.

    A design that fails has its reason as ``failure``, as in :func:`evaluate_designs`.

    Args:
        problem: A pymoo problem that :func:`streams`.
        waiting: The designs with their indices; more may be added while the results are read.
    """
    model, runner = _Model(problem, (), {}, stop=False), problem.elementwise_runner
    if isinstance(runner, JoblibRunner):
        yield from runner.stream(model, waiting)
    else:
        yield from evaluate_here(model, waiting)


def columns_of_values(problem: Any, rows: Sequence[Values]) -> dict[str, Any]:
    """Return the values of designs, one dictionary each, as :func:`evaluate_designs` does."""
    out: dict[str, Any] = {}
    for name, size in _sizes(problem).items():
        failed = np.full(size, np.inf if name == "F" else 0.0)
        column = [row.get(name, failed) for row in rows]
        out[name] = np.array(column).reshape(len(rows), size)
    out["failure"] = np.fromiter((row["failure"] for row in rows), object)
    for name in dict.fromkeys(name for row in rows for name in row):
        if name not in out:
            out[name] = value_column([row.get(name) for row in rows])
    return out


def _sizes(problem: Any) -> dict[str, int]:
    return {"F": problem.n_obj, "G": problem.n_ieq_constr, "H": problem.n_eq_constr}


class _Model:
    """What a runner runs: pymoo's function, with checked values or the reason for none."""

    def __init__(self, problem: Any, args: Any, kwargs: Any, stop: bool) -> None:
        self.wrappers: list[WrappedProblem] = []
        while changes_designs_only(problem):
            self.wrappers.append(problem)
            problem = problem.wrapped
        self.problem, self.args, self.kwargs, self.stop = problem, args, kwargs, stop
        self.sizes = _sizes(problem)
        self.function = problem.elementwise_func(problem, args, kwargs)

    def __call__(self, x: Any) -> Values:
        """Return the values of one design, as arrays of their own."""
        try:
            design = x
            for wrapper in self.wrappers:
                design = wrapper.designs_within(design)
            raw = self.function(copy.copy(design))
            row = {n: _floats(x, n, raw.get(n), (size,)) for n, size in self.sizes.items()}
            if flaw := _flaw(row):
                raise EvaluationError(x, flaw)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a legacy model exits; Rust and asyncio have their own
            return self.failed(x, error)
        for name, value in raw.items():
            if name not in row and value is not None:
                mutable = isinstance(value, (np.ndarray, list, dict))
                row[name] = copy.copy(value) if mutable else value
        return row | {"failure": ""}

    def lost(self, x: Any, reason: str) -> Values:
        """Return what stands for the values of a design whose evaluation a runner has lost."""
        return self.failed(x, EvaluationError(x, reason))

    def failed(self, x: Any, error: BaseException) -> Values:
        """Return the reason why a design failed, or raise if the run is to stop."""
        if not isinstance(error, EvaluationError):
            error = EvaluationError(x, one_line(error), error)
        if self.stop:
            raise error from error.original
        return {"failure": error.reason}

    def together(self, X: Any) -> dict[str, Any]:
        """Evaluate designs by calls for as many as possible; see :func:`evaluate_designs`."""
        n = len(X)
        try:
            raw = self._raw(X)
            out = {k: _floats(X[0], k, raw.get(k), (n, m)) for k, m in self.sizes.items()}
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # as of one design
            if n == 1:
                return columns_of_values(self.problem, [self.failed(X[0], error)])
            size = _PART if n > _PART else 1
            parts = [self.together(X[i : i + size]) for i in range(0, n, size)]
            rows = [
                dict(zip(part, row, strict=True))
                for part in parts
                for row in zip(*part.values(), strict=True)
            ]
            return columns_of_values(self.problem, rows)
        feasible = meets_constraints(out["G"], out["H"])
        doubtful = np.isnan(np.hstack([*out.values()])).any(axis=1)
        doubtful |= feasible & ~competes(out["F"], feasible)
        reasons = np.full(n, "", dtype=object)
        for i in np.flatnonzero(doubtful):
            flaw = _flaw({name: array[i] for name, array in out.items()})
            reasons[i] = self.failed(X[i], EvaluationError(X[i], flaw))["failure"]
            out["F"][i], out["G"][i], out["H"][i] = np.inf, 0.0, 0.0
        out["failure"] = reasons
        for name, value in raw.items():
            if name not in out and isinstance(value, (list, np.ndarray)) and len(value) == n:
                out[name] = value_column(value)
        return out

    def _raw(self, X: Any) -> dict[str, Any]:
        """Return what a vectorised model gives for designs, as it gives it."""
        designs = copy.copy(X)
        if getattr(self.problem, "vars", None):  # not of their values: a choice may be of any kind
            designs[:] = [copy.copy(x) for x in X]
        out: dict[str, Any] = dict.fromkeys(self.sizes)
        if type(self.problem).do is Problem.do:
            # without pymoo's `do`, which reshapes (m, n) to (n, m) and fills what is missing
            self.problem._evaluate_vectorized(designs, out, *self.args, **self.kwargs)
        else:
            out |= self.problem.do(designs, [*self.sizes], *self.args, **self.kwargs)
        # as in pymoo, a list holds the columns
        lists = {name: out[name] for name in self.sizes if isinstance(out[name], list)}
        return out | {name: np.column_stack(value) for name, value in lists.items()}


def _floats(design: Any, name: str, value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return values as a new array of floats of a shape, NaN where they are masked."""
    size = shape[-1]
    if value is None:
        if size:
            raise EvaluationError(design, f"{name} is missing")
        return np.zeros(shape)
    try:
        if (found := np.asarray(value)).dtype.kind in "cmM":
            raise TypeError(f"it holds {found.dtype}")  # NumPy would drop a half, or count days
        array = np.array(found, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise EvaluationError(design, f"{name} is not an array of numbers: {error}") from error
    if isinstance(value, np.ma.MaskedArray):
        array[value.mask] = np.nan
    # Of many designs (m, n) is not (n, m), but the values of one may be a row or a column.
    one = len(shape) == 1 and array.size == size
    if not one and array.shape != shape and (size, array.shape) != (1, shape[:1]):
        rule = f"{name} has shape {array.shape} instead of {shape}"
        raise EvaluationError(design, rule)
    return array.reshape(shape)


def _flaw(values: Values) -> str:
    """Return why values of a design cannot be used, empty if they can."""
    for name in ("F", "G", "H"):
        numbers = values[name]
        # The greatest of some numbers is NaN if one of them is, and sooner found than all.
        if numbers.size and np.isnan(np.maximum.reduce(numbers)):
            return f"{name} is {numbers.tolist()}"
    if not np.isfinite(values["F"]).all() and meets_constraints(values["G"], values["H"]):
        return f"F is {values['F'].tolist()} though the design is feasible"
    return ""


def value_column(values: list[Any] | NDArray[Any]) -> NDArray[Any]:
    """Return another value of all designs as an array; NaN or None where a design has none."""
    if type(values) is np.ndarray and values.dtype.kind in "fiub":
        return values.copy()
    present = [value for value in values if value is not None]
    with suppress(ValueError):  # lists in it differ in length
        found = np.array(present)
        if found.dtype.kind in "fiub":
            nothing = np.full(found.shape[1:], np.nan)
            return np.array([nothing if value is None else value for value in values])
    return np.fromiter(values, object)
