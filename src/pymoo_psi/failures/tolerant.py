"""Problems some of whose designs fail: a guard that makes these infeasible, with the reason."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

from pymoo.core.problem import Problem

from pymoo_psi.arguments import known_name
from pymoo_psi.failures.guard import Guard, columns
from pymoo_psi.host import require_problem
from pymoo_psi.runners.outcome import Values

__all__ = ["Failure", "FailureTolerant", "unguarded"]


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
