"""What is checked in the values of one design, and what stands for the values of a failed one.

Problems some of whose designs fail: a guard that makes these infeasible, with the reason.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymoo.core.problem import Problem

from pymoo_psi._validation import known_name
from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel._outcome import Values, one_line
from pymoo_psi.pareto._feasibility import meets_constraints
from pymoo_psi.problems._pymoo import require_problem

FAILED = 1e10  # the violation of a failed design: above any other, and finite for sums and ratios


@dataclass(frozen=True)
class Guard:
    """Checks the values of one design, and gives those that stand for a failed one.

    It goes to the workers in the place of the :class:`FailureTolerant` with all its failures.
    """

    n_var: int
    sizes: tuple[int, int, int]
    nan_stands_for: float | None
    stop: bool

    def row(self, design: Any, evaluate: Callable[[], Values]) -> Values:
        """Return the values of a design with the constraint and the reason added."""
        try:
            return self._checked(evaluate())
        except _BadValues as error:
            return self.failed(design, str(error))
        except EvaluationError as error:
            return self.failed(design, error.reason, error.original)
        except (Exception, SystemExit) as error:  # a legacy model may exit where it should raise
            return self.failed(design, one_line(error), error)

    def failed(self, design: Any, reason: str, cause: BaseException | None = None) -> Values:
        """Return the values of a failed design, or raise if the run must stop."""
        if self.stop:
            raise EvaluationError(design, reason, cause) from cause
        n_obj, n_ieq, n_eq = self.sizes
        return {
            "F": np.full(n_obj, np.inf),
            "G": np.append(np.zeros(n_ieq), FAILED),
            "H": np.zeros(n_eq),
            "failure": reason,
        }

    def split(self, out: Values, n: int) -> list[Values]:
        """Return the values that a vectorised problem gave for ``n`` designs, design by design."""
        rows: list[Values] = [{} for _ in range(n)]
        for name, value in out.items():
            if value is None:
                continue
            array = np.column_stack(value) if isinstance(value, list) else np.asarray(value)
            if array.ndim == 0 or len(array) != n:
                raise _BadValues(f"{name} has shape {array.shape} for {n} designs")
            for row, part in zip(rows, array, strict=True):
                row[name] = part
        return rows

    def _checked(self, raw: Values) -> Values:
        row = {name: value for name, value in raw.items() if value is not None}
        for name, size in zip("FGH", self.sizes, strict=True):
            row[name] = self._numbers(name, row.get(name, () if size == 0 else None), size)
        F, G, H = row["F"], row["G"], row["H"]
        if np.isinf(F).any() and meets_constraints(G, H):
            raise _BadValues(f"F is {F.tolist()} though the design is feasible")
        row["G"] = np.append(G, 0.0)
        if "dG" in row:
            gradients = np.reshape(row["dG"], (len(G), self.n_var))
            row["dG"] = np.vstack([gradients, np.zeros(self.n_var)])
        row["failure"] = ""
        return row

    def _numbers(self, name: str, value: Any, size: int) -> Any:
        if value is None:
            raise _BadValues(f"{name} is missing")
        try:
            numbers = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise _BadValues(f"{name} is not an array of numbers: {error}") from error
        if numbers.size != size:
            raise _BadValues(f"{name} has shape {numbers.shape} instead of {(size,)}")
        numbers = numbers.reshape(size)
        if self.nan_stands_for is not None:
            numbers = np.where(np.isnan(numbers), self.nan_stands_for, numbers)
        if np.isnan(numbers).any():
            raise _BadValues(f"{name} is {numbers.tolist()}")
        return numbers


class _BadValues(Exception):  # noqa: N818 - only ever a message, and never leaves this module
    """What a model returned cannot be used."""


def columns(rows: list[Values]) -> Values:
    """Return the values of designs, one dictionary each, as one dictionary of arrays.

    Where a design lacks a value that others have, as a failed one may, it has nan or None.
    """
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: _column([row.get(name) for row in rows]) for name in names}


def _column(values: list[Any]) -> Any:
    """Return one value of all designs as an array."""
    present = [value for value in values if value is not None]
    if len(present) < len(values):
        shape = np.shape(present[0])
        numeric = all(np.shape(v) == shape and np.asarray(v).dtype.kind in "fiub" for v in present)
        nothing = np.full(shape, np.nan) if numeric else None
        values = [nothing if value is None else value for value in values]
        if not numeric:
            column = np.empty(len(values), dtype=object)
            column[:] = values
            return column
    return np.array(values)


@dataclass(frozen=True)
class Failure:
    """A design that failed.

    Attributes:
        design: The design as the problem takes it.
        reason: Why, as one line.
    """

    design: Any
    reason: str

    def __deepcopy__(self, memo: dict[int, Any]) -> Failure:
        """Return itself: nothing changes it, and every generation of a history copies the list."""
        return self


class FailureTolerant(Problem):
    """Any pymoo problem, with designs that fail made infeasible and the run going on.

    A design fails if its evaluation raises, runs out of time or loses its worker process (see
    :class:`~pymoo_psi.JoblibRunner`), returns NaN or values of the wrong shape, or an infinite
    objective although it is feasible. pymoo's algorithms would stop, or, at NaN, quietly go
    astray. Here such a design gets infinite objectives and violates one more inequality
    constraint, the last column of ``G``, which is 0 for every other design.

    The reason is kept with the individual, ``pop.get("failure")``, empty for a design that did not
    fail, and with the design in ``problem.failures``, which also knows designs that an algorithm
    has long dropped.

    A vectorised problem that raises for many designs is evaluated again one by one, so that only
    the culprits fail. Bounds, variables, name, Pareto front, callback and runner are the wrapped
    problem's, and so is every attribute not found here.

    Args:
        problem: A pymoo problem, elementwise or not, with any constraints and variables.
        on_failure: ``"record"``, or ``"raise"`` to stop at the first failure with the design in
            the message.

    Attributes:
        wrapped: The problem.
        failures: The failed designs so far, in the order of evaluation.

    Raises:
        ArgumentTypeError: ``problem`` is no pymoo problem.
        ArgumentValueError: ``on_failure`` is unknown.
        EvaluationError: In use: a design failed and ``on_failure="raise"``.

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

    def __init__(self, problem: Any, *, on_failure: str = "record") -> None:
        require_problem(problem)
        self.on_failure = known_name("on_failure", on_failure, ("record", "raise"))
        self.wrapped = problem
        self.failures: list[Failure] = []
        self.guard = Guard(
            n_var=problem.n_var,
            sizes=(problem.n_obj, problem.n_ieq_constr, problem.n_eq_constr),
            nan_stands_for=problem.replace_nan_values_by,
            stop=self.on_failure == "raise",
        )
        super().__init__(
            n_obj=problem.n_obj,
            n_ieq_constr=problem.n_ieq_constr + 1,
            n_eq_constr=problem.n_eq_constr,
            vtype=problem.vtype,
            elementwise=problem.elementwise,
            elementwise_func=_Guarded,
            elementwise_runner=problem.elementwise_runner,
            requires_kwargs=problem.requires_kwargs,
            callback=problem.callback,
            strict=problem.strict,
            **problem.data,
        )
        self.n_var, self.xl, self.xu = problem.n_var, problem.xl, problem.xu
        if hasattr(problem, "vars"):
            self.vars = problem.vars

    def __getattr__(self, name: str) -> Any:
        """Give what only the wrapped problem has, to repairs and operators that ask for it."""
        if name.startswith("_") or "wrapped" not in self.__dict__:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self.wrapped, name)

    def name(self) -> str:
        """Return the name of the wrapped problem.

        Example:
            >>> from pymoo_psi import SphereChute
            >>> FailureTolerant(SphereChute()).name()
            'SphereChute'
        """
        return str(self.wrapped.name())

    def _calc_pareto_front(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_front(*args, **kwargs)

    def _calc_pareto_set(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_set(*args, **kwargs)

    def do(self, X: Any, return_values_of: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Evaluate designs and note the failures; pymoo calls this from ``evaluate``."""
        if self.elementwise:
            rows = self.elementwise_runner(self.elementwise_func(self, args, kwargs), X)
        else:
            rows = self._rows(X, args, kwargs)
        for design, row in zip(X, rows, strict=True):
            if row["failure"]:
                self.failures.append(Failure(copy.deepcopy(design), row["failure"]))
        out = columns(rows)
        out.update(dict.fromkeys(set(return_values_of) - set(out)))
        formatted: dict[str, Any] = self._format_dict(out, len(X), return_values_of)
        return formatted

    def _rows(self, X: Any, args: Any, kwargs: Any) -> list[Values]:
        """Evaluate a vectorised problem: together, or, if that fails, one by one."""

        def values(designs: Any) -> list[Values]:
            out: Values = {}
            self.wrapped._evaluate(designs, out, *args, **kwargs)
            return self.guard.split(out, len(designs))

        if len(X) > 1:
            try:
                together = values(X)
            except (Exception, SystemExit):  # whose fault it is will show
                together = []
            if together:
                return [
                    self.guard.row(x, lambda row=row: row)  # type: ignore[misc]
                    for x, row in zip(X, together, strict=True)
                ]
        return [self.guard.row(X[i], lambda i=i: values(X[i : i + 1])[0]) for i in range(len(X))]  # type: ignore[misc]

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        """Evaluate as pymoo's wrappers of problems do."""
        out.update(self.do(x, ["F", "G", "H"], *args, **kwargs))


def unguarded(problem: Any) -> Any:
    """Return the problem within a ``FailureTolerant``: PSI guards every problem itself."""
    return problem.wrapped if isinstance(problem, FailureTolerant) else problem


class _Guarded:
    """The function that the runner runs: pymoo's for the wrapped problem, guarded."""

    def __init__(self, problem: FailureTolerant, args: Any, kwargs: Any) -> None:
        wrapped = problem.wrapped
        self.function = wrapped.elementwise_func(wrapped, args, kwargs)
        self.guard = problem.guard

    def __call__(self, x: Any) -> Values:
        return self.guard.row(x, lambda: self.function(x))

    def lost(self, x: Any, reason: str) -> Values:
        """Return the values of a design whose evaluation a runner has lost."""
        return self.guard.failed(x, reason)
