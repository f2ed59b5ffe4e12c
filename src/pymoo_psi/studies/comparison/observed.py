"""A problem that watches itself being evaluated, so that no algorithm keeps its own books."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_psi.errors import PsiError
from pymoo_psi.pareto import nondominated
from pymoo_psi.pareto.feasibility import competes, meets_constraints

__all__ = ["BudgetSpentError", "ObservedProblem"]

Array = NDArray[np.float64]


class BudgetSpentError(PsiError):
    """An algorithm asked for more evaluations than it was given."""


class ObservedProblem(Problem):
    """A problem that counts, times and keeps what an algorithm evaluates, and ends at a budget.

    Args:
        problem: The problem, whose variables, bounds, objectives and constraints it takes over.
        budget: How many designs may be evaluated.

    Attributes:
        observed: The problem.
        n_evaluated: Designs evaluated so far.
        evaluation_seconds: Wall time spent in the problem.
        bookkeeping_seconds: Wall time spent here, which is no part of the algorithm's.
    """

    def __init__(self, problem: Any, budget: int) -> None:
        super().__init__(
            n_obj=problem.n_obj,
            n_ieq_constr=problem.n_ieq_constr,
            n_eq_constr=problem.n_eq_constr,
            vtype=problem.vtype,
            requires_kwargs=problem.requires_kwargs,
            replace_nan_values_by=problem.replace_nan_values_by,
            **problem.data,
        )
        self.n_var, self.xl, self.xu = problem.n_var, problem.xl, problem.xu
        if hasattr(problem, "vars"):
            self.vars = problem.vars
        self.observed, self.budget = problem, budget
        self.n_evaluated = 0
        self.evaluation_seconds = self.bookkeeping_seconds = 0.0
        self._kept: list[tuple[Any, Array]] = []

    def name(self) -> str:
        """Return the name of the observed problem."""
        return str(self.observed.name())

    def __getattr__(self, name: str) -> Any:
        """Give what only the observed problem has, to repairs and operators that ask for it."""
        if name.startswith("_") or "observed" not in self.__dict__:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self.observed, name)

    def do(self, X: Any, return_values_of: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Evaluate designs; pymoo calls this from ``evaluate``."""
        began = time.perf_counter()
        if self.n_evaluated + len(X) > self.budget:
            raise BudgetSpentError(
                f"an algorithm must keep its budget of {self.budget} evaluations, got a request "
                f"for {self.n_evaluated + len(X)}"
            )
        wanted = list(dict.fromkeys([*return_values_of, "F", "G", "H"]))
        asked = time.perf_counter()
        out: dict[str, Any] = self.observed.do(X, wanted, *args, **kwargs)
        answered = time.perf_counter()
        self.n_evaluated += len(X)
        F, G, H = (np.asarray(out[name], dtype=np.float64) for name in "FGH")
        rows = np.flatnonzero(competes(F, meets_constraints(G, H)))
        self._kept.append((X[rows], F[rows]))
        self.evaluation_seconds += answered - asked
        self.bookkeeping_seconds += asked - began + time.perf_counter() - answered
        return out

    def front(self) -> tuple[Any, Array]:
        """Return the feasible designs that no evaluated one dominates, and their objectives."""
        if not self._kept:
            return np.zeros((0, self.n_var)), np.zeros((0, self.n_obj))
        X, F = (np.concatenate(parts) for parts in zip(*self._kept, strict=True))
        best = nondominated(F)
        return X[best], F[best]
