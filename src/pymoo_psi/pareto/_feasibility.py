"""Which designs are feasible: the one place where the rule is written."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EQ_TOLERANCE = 1e-4
"""pymoo's: an equality constraint is met where |h| <= 1e-4."""


def violated_constraints(G: Array, H: Array, tolerance: float = EQ_TOLERANCE) -> Mask:
    """Return which constraints are violated; one that is NaN is.

    Args:
        G: ``(..., n_ieq)`` inequality constraints, met where g <= 0.
        H: ``(..., n_eq)`` equality constraints, met where |h| <= tolerance.
        tolerance: Of equality constraints.

    Returns:
        ``(..., n_ieq + n_eq)`` mask, the inequalities first.
    """
    return np.concatenate([~(G <= 0), ~(np.abs(H) <= tolerance)], axis=-1)


def meets_constraints(G: Array, H: Array, tolerance: float = EQ_TOLERANCE) -> Mask:
    """``(...,)`` which designs meet every constraint; those without any do."""
    return np.asarray(~violated_constraints(G, H, tolerance).any(axis=-1))


def constraint_violation(G: Array, H: Array, tolerance: float = EQ_TOLERANCE) -> Array:
    """``(n,)`` pymoo's measure: the sum of what ``(n, n_ieq)`` G and ``(n, n_eq)`` H exceed."""
    return np.asarray(
        np.maximum(G, 0).sum(axis=1) + np.maximum(np.abs(H) - tolerance, 0).sum(axis=1)
    )


def competes(F: Array, feasible: Mask) -> Mask:
    """``(...,)`` which feasible designs have finite objectives, ``(..., m)`` F, too.

    Only these are compared with each other: the others are neither optimal nor dominated.
    """
    return np.asarray(feasible & np.isfinite(F).all(axis=-1))
