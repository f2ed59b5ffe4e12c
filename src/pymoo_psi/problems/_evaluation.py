"""The evaluation of designs that may fail: checked values, or the reason why there are none.

:func:`evaluate_designs` is that of the package; :class:`FailureTolerant` is for algorithms of
pymoo.

Values of a model count only if they are what the problem promises. A design fails if its
evaluation raises, is lost by a runner, or gives values that are missing, of another shape, no
numbers, NaN, or infinite although the design is feasible. If the problem has pymoo's option
``replace_nan_values_by``, that number is its value instead of NaN, and no failure.
"""

from __future__ import annotations

import copy
import warnings
import zlib
from collections.abc import Sequence
from contextlib import suppress
from itertools import chain
from typing import Any, Literal

import numpy as np
from pymoo.core.problem import LoopedElementwiseEvaluation, Problem

from pymoo_psi._validation import AnyArray, Array, Entries, Mask, Values, known_name
from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel import Runner, one_line, same_folder
from pymoo_psi.pareto import competes, constraint_violation, meets_constraints
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.problems._requirements import with_requirements
from pymoo_psi.problems._wrapped import (
    WrappedProblem,
    Wrapper,
    has_same_values,
    require_model,
    untolerant,
    uses_wrapped_values,
)

# A call for many designs that raises does not say which of them failed. They are evaluated again
# in parts of this size, and the designs of a part that raises, one by one: 64 designs take at most
# 128 evaluations, and one culprit among 65 536 is found in 1100 calls.
_PART = 64
# Values of a design that failed.
_FAILED = {"F": np.inf, "G": 0.0, "H": 0.0}
# Constraint violation of a failed design: above any other, and finite for sums and ratios.
_VIOLATION = 1e10
FailedAs = Literal["constraint", "penalty"]


def evaluate_designs(problem: Any, X: Any, **kwargs: Any) -> Values:
    """Evaluate designs like pymoo's ``evaluate``; one that fails has a reason instead of values.

    The model gets copies of the designs, and its values are copied. So values stay with their
    design even if the model changes a design, or returns the same array again and again.

    Args:
        problem: A pymoo problem, elementwise or not; a :class:`FailureTolerant` gives failed
            designs values and no reason.
        X: n designs as the problem takes them.
        **kwargs: For the model, as pymoo passes them.

    Returns:
        ``F`` ``(n, m)``, infinite where a design failed; ``G`` ``(n, n_ieq)`` and ``H``
        ``(n, n_eq)``, 0 there; ``failure`` ``(n,)``, the reasons, empty where a design did not
        fail; and further values of the model, NaN or None where it gives none.
    """
    if uses_wrapped_values(problem):
        values: Values = problem.values_from(
            X, lambda designs: evaluate_designs(problem.wrapped, designs, **kwargs)
        )
        values.setdefault("failure", np.full(len(X), "", dtype=object))
        return values
    function = CheckedFunction(problem, kwargs)
    with same_folder():  # it is as before, whatever the model sets
        if _is_one_by_one(problem):
            rows = problem.elementwise_runner(function, X)
            out = columns_of_values(problem, rows)
        else:
            out = function.together(X)
    if problem.callback is not None:
        problem.callback(copy.copy(X), out)
    return out


def streams(problem: Any) -> bool:
    """Whether a problem's designs can go to the workers one after the other.

    Others are evaluated in batches: by a vectorised model, by a runner that is not ours, or because
    a callback of the problem expects batches.
    """
    while has_same_values(problem):
        problem = problem.wrapped
    ours = (Runner.__call__, LoopedElementwiseEvaluation.__call__)
    runner = type(problem.elementwise_runner)
    return _is_one_by_one(problem) and problem.callback is None and runner.__call__ in ours


def _is_one_by_one(problem: Any) -> bool:
    """Whether a problem's model is called for one design at a time.

    A problem that overrides ``do`` transforms designs or values there, like pymoo's ``ZeroToOne``,
    so its model must not be called directly.
    """
    return bool(problem.elementwise) and type(problem).do is Problem.do


def columns_of_values(problem: Any, rows: Sequence[Values]) -> Values:
    """Return the values of designs, one dictionary each, as :func:`evaluate_designs` does."""
    out = {}
    for name, size in _sizes(problem).items():
        failed = np.full(size, _FAILED[name])
        column = [row.get(name, failed) for row in rows]
        out[name] = np.array(column).reshape(len(rows), size)
    out["failure"] = np.fromiter((row["failure"] for row in rows), object)
    for name in dict.fromkeys(chain.from_iterable(rows)):
        if name not in out:
            out[name] = value_column([row.get(name) for row in rows])
    return out


def _sizes(problem: Any) -> dict[str, int]:
    return {"F": problem.n_obj, "G": problem.n_ieq_constr, "H": problem.n_eq_constr}


class CheckedFunction:
    """The function that a runner calls: pymoo's, with checked values or the reason for none.

    Args:
        problem: A problem.
        kwargs: For the model, as pymoo passes them.
        seeded: Whether it is called with pairs of a design and a number, which the model gets as
            ``seed=``.
    """

    def __init__(self, problem: Any, kwargs: Entries, *, seeded: bool = False) -> None:
        self.seeded = seeded
        self.wrappers: list[WrappedProblem] = []
        while has_same_values(problem):
            self.wrappers.append(problem)
            problem = problem.wrapped
        require_model(problem)
        self.problem = problem
        self.kwargs = kwargs
        self.sizes = _sizes(problem)
        self.function = problem.elementwise_func(problem, (), kwargs)

    def __call__(self, x: Any) -> Values:
        """Return the values of one design, as arrays of their own."""
        function = self.function
        if self.seeded:
            x, seed = x
            function = self.problem.elementwise_func(self.problem, (), {"seed": seed})
        try:
            design = x
            for wrapper in self.wrappers:
                design = wrapper.designs_within(design)
            raw = function(copy.copy(design))
            row = self._checked(raw)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a legacy model exits; Rust and asyncio have their own
            return {"failure": _reason(error)}
        flaw = _flaw(row)
        if flaw:
            return {"failure": flaw}
        _warn_of_failure(raw)
        for name, value in raw.items():
            if name not in row and value is not None:
                if isinstance(value, (np.ndarray, list, dict)):
                    value = copy.copy(value)
                row[name] = value
        return row | {"failure": ""}

    def lost(self, x: Any, reason: str) -> Values:
        """Return the reason for a design whose evaluation a runner has lost."""
        return {"failure": reason}

    def together(self, X: Any) -> Values:
        """Evaluate designs by calls for as many as possible; see :func:`evaluate_designs`."""
        if len(X) > 1 and len(X) in self.sizes.values():  # a row for each would not show
            return self._in_parts(X)
        try:
            raw = self._raw(X)
            out = self._checked(raw, len(X))
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # the same errors as for one design
            if len(X) == 1:
                return columns_of_values(self.problem, [{"failure": _reason(error)}])
            return self._in_parts(X)
        reasons = np.full(len(X), "", dtype=object)
        if isinstance(self.problem, Wrapper) and self.problem.gives_reasons:
            reasons[:] = raw["failure"]
        out["failure"] = _clear_failures(out, reasons)
        _warn_of_failure(raw)
        for name, value in raw.items():
            if name in out or not isinstance(value, (list, np.ndarray)):
                continue
            if len(value) == len(X):
                out[name] = value_column(value)
        return out

    def _checked(self, raw: Entries, *n_designs: int) -> Values:
        """Return the promised values of one design, or of some, as new arrays."""
        values = {}
        for name, size in self.sizes.items():
            array = _floats(name, raw.get(name), (*n_designs, size))
            if self.problem.replace_nan_values_by is not None:  # pymoo's option, as its evaluate
                array[np.isnan(array)] = self.problem.replace_nan_values_by
            values[name] = array
        return values

    def _in_parts(self, X: Any) -> Values:
        """Evaluate designs in parts or one by one."""
        size = _PART if len(X) > _PART else 1
        rows = []
        for start in range(0, len(X), size):
            part = self.together(X[start : start + size])
            for values in zip(*part.values(), strict=True):
                rows.append(dict(zip(part, values, strict=True)))
        return columns_of_values(self.problem, rows)

    def _raw(self, X: Any) -> Values:
        """Return the values of a vectorised model as they are."""
        designs = copy.copy(X)
        if getattr(self.problem, "vars", None):
            # the mappings are copied, not their values: the option of a choice may be anything
            designs[:] = list(map(copy.copy, X))
        out: Values = dict.fromkeys(self.sizes)
        if type(self.problem).do is Problem.do:
            # pymoo's `do` would reshape (m, n) to (n, m) and fill in what is missing.
            self.problem._evaluate_vectorized(designs, out, **self.kwargs)
        else:
            out |= self.problem.do(designs, [*self.sizes], **self.kwargs)
        for name in self.sizes:
            if isinstance(out[name], list):  # in pymoo, a list holds the columns
                out[name] = np.column_stack(out[name])
        return out


def _warn_of_failure(raw: Entries) -> None:
    """Warn of an output of a model that has the name of the reasons of failures."""
    value = raw.get("failure")
    if value is not None and not isinstance(value, str) and np.asarray(value).dtype.kind in "fiub":
        warnings.warn("out['failure'] is left out; give it another name", stacklevel=2)


def _clear_failures(out: Values, reasons: AnyArray) -> AnyArray:
    """Return the reasons why designs failed, and clear the values of those that did.

    Args:
        out: Values of n designs.
        reasons: ``(n,)`` the reasons that are known already; texts are added.
    """
    feasible = meets_constraints(out["G"], out["H"])
    doubtful = np.isnan(np.hstack([*out.values()])).any(axis=1)
    doubtful |= feasible & ~competes(out["F"], feasible)
    for i in np.flatnonzero(doubtful & (reasons == "")):
        reasons[i] = _flaw({name: array[i] for name, array in out.items()})
    for name, value in _FAILED.items():
        out[name][reasons != ""] = value
    return reasons


def _reason(error: BaseException) -> str:
    """Return why a design failed."""
    return error.reason if isinstance(error, EvaluationError) else one_line(error)


def _floats(name: str, value: Any, shape: tuple[int, ...]) -> Array:
    """Return values as a new array of floats of a shape, NaN where they are masked."""
    size = shape[-1]
    if value is None:
        if size:
            raise EvaluationError(None, f"{name} is missing")
        return np.zeros(shape)
    raw = np.asarray(value)
    if raw.dtype.kind == "O":
        raw = np.array(raw.tolist())
    if raw.dtype.kind not in "fiubO":  # NumPy would drop an imaginary part, count days, read texts
        raise EvaluationError(None, f"{name} is not an array of numbers: it holds {raw.dtype}")
    array = raw.astype(np.float64)
    if isinstance(value, np.ma.MaskedArray):
        array[value.mask] = np.nan
    # For many designs (m, n) is not (n, m), but the values of one may be a row or a column.
    row = len(shape) == 1 and array.size == size
    column = size == 1 and array.shape == shape[:1]
    if array.shape != shape and not row and not column:
        raise EvaluationError(None, f"{name} has shape {array.shape} instead of {shape}")
    return array.reshape(shape)


def _flaw(values: Values) -> str:
    """Return why values of a design cannot be used, empty if they can."""
    for name in ("F", "G", "H"):
        numbers = values[name]
        # The maximum is NaN if one of the numbers is, and faster than isnan of all of them.
        if numbers.size and np.isnan(np.maximum.reduce(numbers)):
            return f"{name} is {numbers.tolist()}"
    if not np.isfinite(values["F"]).all() and meets_constraints(values["G"], values["H"]):
        return f"F is {values['F'].tolist()} though the design is feasible"
    return ""


def value_column(values: list[Any] | AnyArray) -> AnyArray:
    """Return a further value of all designs as an array; NaN or None where a design has none."""
    present = [value for value in values if value is not None]
    with suppress(ValueError):  # its lists may differ in length
        array = np.array(present)
        if array.dtype.kind in "fiub":
            missing = np.full(array.shape[1:], np.nan)
            return np.array([missing if value is None else value for value in values])
    return np.fromiter(values, object)


# Failed designs in algorithms of pymoo


class FailureTolerant(Wrapper):
    """Any pymoo problem; failed designs become infeasible ones, so that the run continues.

    A design fails if its evaluation raises, runs out of time or loses its worker process (see
    :class:`~pymoo_psi.ProcessRunner`), or gives values that are missing, masked, complex, NaN or of
    the wrong shape, or an infinite objective although it is feasible. pymoo's algorithms would
    stop, or return wrong results without a warning after NaN. Here such a design gets infinite
    objectives and violates an additional inequality constraint, the last column of ``G``, which is
    0 for every other design. A failed design is never in the ``res.F`` of an algorithm. NaN is no
    failure if the problem was made with a number for it, pymoo's ``replace_nan_values_by``.

    MOEAD, ParallelMOEAD, KGB and DNSGA2 accept no constraints. For these ``failed_as="penalty"``
    gives failed designs finite objectives instead, worse than all before and always the same for
    the same design; the number of constraints is the wrapped problem's.

    ``pop.get("failure")`` returns the reason for each individual, empty if it did not fail;
    ``problem.failures`` also lists designs that an algorithm has dropped. PSI and ``investigate``
    keep failures in their table instead. Of several wrappers it must be the outermost; only
    ``Recorded`` may be around it, and :class:`Robust`, for which failed designs have no values.

    If a vectorised problem raises, its designs are evaluated again one by one, so that only those
    that raise fail. The model receives copies of the designs, which it may change. Bounds,
    variables, name, Pareto front, callback, runner and all other attributes are those of the
    wrapped problem.

    Args:
        problem: A pymoo problem, elementwise or not, with any constraints and variables.
        failed_as: ``"constraint"`` or ``"penalty"``.

    Attributes:
        wrapped: The problem.
        failures: The failed designs so far, in the order of evaluation, each with ``design`` and
            ``reason``.

    Raises:
        ArgumentTypeError: ``problem`` is no pymoo problem.
        ArgumentValueError: ``failed_as`` is unknown.

    Example:
        >>> import numpy as np
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> def root(x):
        ...     import math
        ...     return math.sqrt(x[0])
        >>> problem = FailureTolerant(FunctionalProblem(1, [root], xl=-1, xu=1))
        >>> problem.evaluate(np.array([[0.25], [-0.25]]))
        (array([[0.5],
               [inf]]), array([[0.e+00],
               [1.e+10]]))
        >>> [failure.design for failure in problem.failures]
        [array([-0.25])]
    """

    same_front = True

    def __init__(self, problem: Any, *, failed_as: FailedAs = "constraint") -> None:
        require_problem(problem)
        problem = with_requirements(untolerant(problem))
        known_name("failed_as", failed_as, ("constraint", "penalty"))
        self.failed_as: FailedAs = failed_as
        self.failures: list[EvaluationError] = []
        self._largest = np.full(problem.n_obj, -np.inf)  # size of every objective so far
        n_ieq_constr = problem.n_ieq_constr
        if self.failed_as == "constraint":
            n_ieq_constr += 1
        super().__init__(problem, n_ieq_constr=n_ieq_constr)

    def untolerant(self) -> Any:
        """Return the wrapped problem."""
        return self.wrapped

    def do(self, X: Any, return_values_of: Any, **kwargs: Any) -> Values:
        """Evaluate designs and note the failures; pymoo calls this from ``evaluate``."""
        out = evaluate_designs(self.wrapped, X, **kwargs)
        return self.tolerated(X, out, return_values_of)

    def tolerated(self, X: Any, out: Values, return_values_of: Any) -> Values:
        """Note the failures among values of :func:`evaluate_designs`, and make them infeasible."""
        failed = out["failure"] != ""
        for i in np.flatnonzero(failed):
            self.failures.append(EvaluationError(copy.copy(X[i]), out["failure"][i]))
        if self.failed_as == "constraint":
            out["G"] = np.column_stack([out["G"], np.where(failed, _VIOLATION, 0.0)])
        else:
            self._penalise(X, out, failed)
        return self.formatted(X, out, return_values_of)

    def _penalise(self, X: Any, out: Values, failed: Mask) -> None:
        """Give failed designs objectives that are worse than any that did not fail so far."""
        F = out["F"]
        largest = np.abs(F).max(axis=0, initial=-np.inf, where=np.isfinite(F))
        self._largest = np.maximum(self._largest, largest)
        # What fails before any other design must not be better than all that come later.
        largest = np.where(np.isfinite(self._largest), self._largest, _VIOLATION)
        # About as large as other values, since algorithms scale by the range of a population. A
        # power of 2, so that a design has the same objectives until the values double: dynamic
        # algorithms evaluate designs twice, and another value is to them a change of the problem.
        level = np.exp2(np.ceil(np.log2(largest + 1)))
        for i in np.flatnonzero(failed):
            # Each design gets another value, as some algorithms fail with equal ones.
            fraction = (1 + zlib.crc32(repr(X[i]).encode())) / 2**33
            F[i] = level * (1.0 + fraction)
        # pymoo reads this violation even if a problem has no constraints, and then leaves failed
        # designs out of its optimum
        violation = constraint_violation(out["G"], out["H"])
        out["CV"] = np.where(failed, _VIOLATION, violation)[:, None]
