"""Logarithmic variables for algorithms that know none."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi.problems._design_space import design_space
from pymoo_psi.problems._pymoo import WrappedProblem, require_problem
from pymoo_psi.problems._restricted import pymoo_variable


class LogScaled(WrappedProblem):
    """Any pymoo problem, its logarithmic variables given by their common logarithms.

    For algorithms of pymoo, which search evenly between bounds. PSI, ``SurrogatePSI``,
    ``investigate``, samplings and ``nsga3`` take such variables as they are.

    Args:
        problem: A pymoo problem.
        log: Names of variables whose bounds are above 0; those of the problem's attribute ``log``
            unless given.

    Raises:
        ArgumentValueError: There is no such variable, it is not real, or its bounds are not above
            0.
        ArgumentTypeError: ``problem`` is no pymoo problem.

    Example:
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> import numpy as np
        >>> wide = FunctionalProblem(1, [lambda x: x[0], lambda x: 1 / x[0]], xl=1e-5, xu=1e5)
        >>> problem = LogScaled(wide, ["x1"])
        >>> problem.bounds(), problem.original(np.array([[2.0]]))
        ((array([-5.]), array([5.])), array([[100.]]))
    """

    _same_front = False

    def __init__(self, problem: Any, log: Collection[str] | None = None) -> None:
        require_problem(problem)
        self._given = design_space(problem, log=log)
        self.log = ()  # to others, these variables are plain ones
        self.space = replace(
            self._given,
            variables=tuple(
                replace(v, kind=Kind.REAL, lower=np.log10(v.lower), upper=np.log10(v.upper))
                if v.kind is Kind.LOG
                else v
                for v in self._given.variables
            ),
        )
        free = self.space.free
        if self.space.named:
            changed: dict[str, Any] = {"vars": {v.name: pymoo_variable(v) for v in free.variables}}
        else:
            changed = {"xl": free.lower, "xu": free.upper}
        super().__init__(problem, **changed)

    def original(self, X: Any) -> Any:
        """Return designs as the problem within takes them."""
        matrix = self.space.to_matrix(X).copy()
        for j, variable in enumerate(self._given.variables):
            if variable.kind is Kind.LOG and not variable.fixed:
                values = 10.0 ** matrix[:, j].astype(np.float64)
                matrix[:, j] = np.clip(values, variable.lower, variable.upper)
        return self._given.designs(matrix)

    def evaluate(self, X: Any, *args: Any, **kwargs: Any) -> Any:
        """Evaluate designs, or one, as pymoo's ``evaluate``, by that of the problem within."""
        one = isinstance(X, Mapping) or (not self.space.named and np.ndim(X) == 1)
        given = self.original([X])[0] if one else self.original(X)
        return self.wrapped.evaluate(given, *args, **kwargs)

    def do(self, X: Any, return_values_of: Any, *args: Any, **kwargs: Any) -> Any:
        """Evaluate designs; pymoo calls this from ``evaluate``."""
        return self.wrapped.do(self.original(X), return_values_of, *args, **kwargs)
