"""Evaluating designs some of which may fail."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.failures.tolerant import FailureTolerant
from pymoo_psi.pareto.feasibility import competes, meets_constraints

__all__ = ["Evaluated", "evaluate_guarded"]

Array = NDArray[np.float64]


class Evaluated(NamedTuple):
    """The values of n designs, and why those that failed did.

    Attributes:
        F: ``(n, m)`` objectives, infinite where a design failed.
        G: ``(n, n_ieq)`` inequality constraints.
        H: ``(n, n_eq)`` equality constraints.
        reasons: n reasons, empty for a design that did not fail.
    """

    F: Array
    G: Array
    H: Array
    reasons: list[str]


def evaluate_guarded(problem: Any, X: NDArray[Any]) -> Evaluated:
    """Evaluate designs; one that raises, gives NaN or the wrong shape, or is lost, has failed.

    A vectorised problem is asked for all designs at once. If that raises, the guard finds the
    culprits; if only the values of some designs are bad, these alone are evaluated once more.

    Args:
        problem: A pymoo problem.
        X: n designs as the problem takes them.
    """
    if problem.elementwise:
        return _guarded(problem, X)
    try:
        out = problem.evaluate(X, return_values_of=["F", "G", "H"], return_as_dictionary=True)
        F, G, H = (np.asarray(out[name], dtype=np.float64) for name in "FGH")
    except (Exception, SystemExit):  # whose fault it is, the guarded evaluation will find
        return _guarded(problem, X)
    bad = _bad_rows(F, G, H)
    if bad.all():
        return _guarded(problem, X)
    reasons = [""] * len(F)
    if bad.any():
        again = _guarded(problem, X[bad])
        F, G, H = F.copy(), G.copy(), H.copy()  # they may be the model's own
        F[bad], G[bad], H[bad] = again.F, again.G, again.H
        for i, reason in zip(np.flatnonzero(bad), again.reasons, strict=True):
            reasons[i] = reason
    return Evaluated(F, G, H, reasons)


def _bad_rows(F: Array, G: Array, H: Array) -> NDArray[np.bool_]:
    """``(n,)`` which designs have values that the guard would not let pass."""
    bad = np.isnan(np.hstack([F, G, H])).any(axis=1)
    feasible = meets_constraints(G, H)
    bad |= feasible & ~competes(F, feasible)
    return np.asarray(bad)


def _guarded(problem: Any, X: NDArray[Any]) -> Evaluated:
    """Evaluate through a :class:`FailureTolerant`, which checks one design after the other."""
    out = FailureTolerant(problem).evaluate(
        X, return_values_of=["F", "G", "H", "failure"], return_as_dictionary=True
    )
    reasons = [str(reason) for reason in out["failure"]]
    return Evaluated(out["F"], out["G"][:, :-1], out["H"], reasons)
