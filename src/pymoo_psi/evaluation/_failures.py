"""Problems some of whose designs fail, for any algorithm of pymoo."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymoo.core.problem import Problem

from pymoo_psi._validation import known_name
from pymoo_psi.evaluation._evaluator import evaluate_designs
from pymoo_psi.problems._pymoo import require_problem

FAILED = 1e10  # the violation of a failed design: above any other, and finite for sums and ratios


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
        problem = without_tolerance(problem)
        self.on_failure = known_name("on_failure", on_failure, ("record", "raise"))
        self.wrapped = problem
        self.failures: list[Failure] = []
        super().__init__(
            n_obj=problem.n_obj,
            n_ieq_constr=problem.n_ieq_constr + 1,
            n_eq_constr=problem.n_eq_constr,
            vtype=problem.vtype,
            elementwise=problem.elementwise,
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

    @property
    def elementwise_runner(self) -> Any:
        """What runs the evaluations: the wrapped problem's, also where it is changed here."""
        return self.wrapped.elementwise_runner

    @elementwise_runner.setter
    def elementwise_runner(self, runner: Any) -> None:
        self.wrapped.elementwise_runner = runner

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
        stop = self.on_failure == "raise"
        out = evaluate_designs(self.wrapped, X, *args, stop=stop, **kwargs)
        failed = out["failure"] != ""
        for i in np.flatnonzero(failed):
            self.failures.append(Failure(copy.copy(X[i]), out["failure"][i]))
        out["G"] = np.column_stack([out["G"], np.where(failed, FAILED, 0.0)])
        if "dG" in out:
            gradients = np.reshape(out["dG"], (len(X), -1, self.n_var))
            out["dG"] = np.concatenate([gradients, np.zeros((len(X), 1, self.n_var))], axis=1)
        out.update(dict.fromkeys(set(return_values_of) - set(out)))
        formatted: dict[str, Any] = self._format_dict(out, len(X), return_values_of)
        return formatted

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        """Evaluate as pymoo's wrappers of problems do."""
        out.update(self.do(x, ["F", "G", "H"], *args, **kwargs))


def without_tolerance(problem: Any) -> Any:
    """Return the problem within a ``FailureTolerant``; PSI records failures itself."""
    return problem.wrapped if isinstance(problem, FailureTolerant) else problem
