"""Problems with designs that fail, for any algorithm of pymoo."""

from __future__ import annotations

import copy
import zlib
from typing import Any

import numpy as np

from pymoo_psi._validation import (
    Mask,
    known_name,
)
from pymoo_psi.errors import EvaluationError
from pymoo_psi.pareto import constraint_violation
from pymoo_psi.problems._evaluation import evaluate_designs
from pymoo_psi.problems._pymoo import leave_failed_out, require_problem
from pymoo_psi.problems._requirements import with_requirements
from pymoo_psi.problems._wrapped import (
    WrappedProblem,
    layers,
    tolerates_failures,
    uses_wrapped_values,
)

# Constraint violation of a failed design: above any other, and finite for sums and ratios.
_VIOLATION = 1e10


class FailureTolerant(WrappedProblem):
    """Any pymoo problem, with failed designs as infeasible ones, so that a run continues.

    A design fails if its evaluation raises, runs out of time or loses its worker process (see
    :class:`~pymoo_psi.JoblibRunner`), or gives values that are missing, masked, complex, NaN or of
    the wrong shape, or an infinite objective although it is feasible. pymoo's algorithms would
    stop, or give wrong results without a warning after NaN. Here such a design gets infinite
    objectives and violates one more inequality constraint, the last column of ``G``, which is 0 for
    every other design. A failed design is never in the ``res.F`` of an algorithm.

    MOEAD, ParallelMOEAD, KGB and DNSGA2 accept no constraints. For these ``failed_as="penalty"``
    gives failed designs finite objectives instead, worse than all before and always the same for
    the same design; the number of constraints is the wrapped problem's.

    The reason is kept with the individual, ``pop.get("failure")``, empty for a design that did not
    fail, and with the design in ``problem.failures``, which also has designs that an algorithm
    has dropped. PSI and ``investigate`` keep failures in their table instead.

    If a vectorised problem raises for many designs, they are evaluated again one by one, so that
    only those that raise fail. The model gets copies of the designs, which it may change. Bounds,
    variables, name, Pareto front, callback and runner are the wrapped problem's, and so is every
    attribute that this class does not have.

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
    tolerates_failures = True

    def __init__(self, problem: Any, *, failed_as: str = "constraint") -> None:
        require_problem(problem)
        problem = with_requirements(untolerant(problem))
        self.failed_as = known_name("failed_as", failed_as, ("constraint", "penalty"))
        self.failures: list[EvaluationError] = []
        self._largest = np.full(problem.n_obj, -np.inf)  # size of every objective so far
        n_ieq_constr = problem.n_ieq_constr
        if self.failed_as == "constraint":
            n_ieq_constr += 1
        super().__init__(problem, n_ieq_constr=n_ieq_constr)

    def evaluate(self, X: Any, *args: Any, **kwargs: Any) -> Any:
        """Evaluate designs like pymoo's ``evaluate``, and keep failed ones out of the optimum."""
        leave_failed_out(kwargs.get("algorithm"))
        return super().evaluate(X, *args, **kwargs)

    def do(self, X: Any, return_values_of: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Evaluate designs and note the failures; pymoo calls this from ``evaluate``."""
        out = evaluate_designs(self.wrapped, X, *args, **kwargs)
        return self.tolerated(X, out, return_values_of)

    def tolerated(self, X: Any, out: dict[str, Any], return_values_of: Any) -> dict[str, Any]:
        """Note the failures among values of :func:`evaluate_designs`, and make them infeasible."""
        failed = out["failure"] != ""
        for i in np.flatnonzero(failed):
            self.failures.append(EvaluationError(copy.copy(X[i]), out["failure"][i]))
        if self.failed_as == "constraint":
            out["G"] = np.column_stack([out["G"], np.where(failed, _VIOLATION, 0.0)])
        else:
            self._penalise(X, out, failed)
        return self.formatted(X, out, return_values_of)

    def _penalise(self, X: Any, out: dict[str, Any], failed: Mask) -> None:
        """Give failed designs objectives that are worse than any that did not fail so far."""
        F = out["F"]
        sizes = np.where(np.isfinite(F), np.abs(F), -np.inf)
        self._largest = np.maximum(self._largest, sizes.max(axis=0, initial=-np.inf))
        largest = np.where(np.isfinite(self._largest), self._largest, _VIOLATION)
        # About as large as other values, since algorithms scale by the range of a population. A
        # power of 2, so that a design has the same objectives until the values double: dynamic
        # algorithms evaluate designs twice, and another value is to them a change of the problem.
        level = np.exp2(np.minimum(np.ceil(np.log2(largest + 1)), 1022))
        for i in np.flatnonzero(failed):
            vector = isinstance(X[i], np.ndarray) and X[i].dtype != object
            content = X[i].tobytes() if vector else repr(X[i]).encode()
            # different for each design, as some algorithms fail with equal ones
            fraction = (1 + zlib.crc32(content)) / 2**33
            F[i] = level * (1.0 + fraction)
        # pymoo reads this violation even if a problem has no constraints, and then leaves failed
        # designs out of its optimum
        violation = constraint_violation(out["G"], out["H"])
        out["CV"] = np.where(failed, _VIOLATION, violation)[:, None]


def untolerant(problem: Any) -> Any:
    """Return a problem without the ``FailureTolerant`` around it or within its wrappers.

    PSI records failures itself, in its table: there no constraint is to be added for them.
    """
    if tolerates_failures(problem):
        return problem.wrapped
    if not uses_wrapped_values(problem):  # Robust counts the scenarios that fail
        return problem
    inner = untolerant(problem.wrapped)
    if inner is problem.wrapped:
        return problem
    return problem.around(inner)


def tolerance_outside(problem: Any) -> Any:
    """Return a problem with the ``FailureTolerant`` within its wrappers moved around them.

    Failures are noted in the same list as before.
    """
    plain = untolerant(problem)
    if plain is problem or tolerates_failures(problem):
        return problem
    tolerant = next(filter(tolerates_failures, layers(problem)))
    return tolerant.around(with_requirements(plain))
