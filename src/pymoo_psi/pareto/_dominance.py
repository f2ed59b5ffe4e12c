"""Which designs are feasible, and which of them are Pareto optimal; all objectives minimised."""

from __future__ import annotations

import moocore
import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.pareto._rounding import settled

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


def nondominated(F: Array) -> Mask:
    """Mark the rows of ``F`` that no other row dominates; equal rows are kept together.

    Values of an objective that differ by no more than rounding noise, 1.4e-14 of their size,
    are equal.

    Args:
        F: ``(n, m)`` objective values without NaN, all minimised; n may be 0, m up to 255.
            Infinity is worse, or better, than every number.

    Returns:
        ``(n,)`` mask. A row dominates another if it is nowhere worse and somewhere better.

    Raises:
        ArgumentValueError: A value is NaN.

    Example:
        >>> nondominated(np.array([[1.0, 2.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]))
        array([ True,  True, False,  True])
    """
    if len(F) == 0:
        return np.zeros(0, dtype=bool)
    F = settled(F)
    if not np.isfinite(F).all():
        if np.isnan(F).any():
            raise invalid("F", "without NaN", Received("NaN"))
        # Places have the order of the values. With infinities moocore (0.3) gives wrong answers,
        # or ends the process.
        places = [np.unique(column, return_inverse=True)[1] for column in F.T]
        F = np.column_stack(places).astype(np.float64)
    if F.shape[1] == 1:  # moocore takes two objectives or more
        return np.asarray(F[:, 0] == F[:, 0].min(), dtype=bool)
    return np.asarray(moocore.is_nondominated(F, keep_weakly=True), dtype=bool)


def front_numbers(F: Array) -> NDArray[np.intp]:
    """Return in which front each row is: 0 if no row dominates it, 1 if only such rows do, ….

    Args:
        F: ``(n, m)`` objective values without NaN, n >= 1, m >= 2.
    """
    return np.asarray(moocore.pareto_rank(F), dtype=np.intp)


def nondominated_pair(a: NDArray[np.intp], b: NDArray[np.intp], other: NDArray[np.intp]) -> Mask:
    """Mark the points (a_i, b_i) that no other point dominates, in O(n).

    Args:
        a: ``(n,)`` first criterion as integer levels (:func:`pymoo_psi.pareto._rounding.levels`),
            n >= 1.
        b: ``(n,)`` second criterion, as ``a``.
        other: ``(n,)`` third criterion, as ``a``, which decides between equal points.

    Returns:
        ``(n,)`` mask.
    """
    # The best b for each level of a; a point stays if it has that b and every smaller a is worse.
    best, least = (np.full(a.max() + 1, np.iinfo(np.intp).max) for _ in range(2))
    np.minimum.at(best, a, b)
    best_before = np.concatenate(([np.iinfo(np.intp).max], np.minimum.accumulate(best)[:-1]))
    mask: Mask = (b == best[a]) & (b < best_before[a])
    np.minimum.at(least, a[mask], other[mask])
    mask &= other == least[a]
    return mask
