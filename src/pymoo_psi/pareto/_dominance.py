"""Which designs are feasible, and which of them are Pareto optimal; which values are equal.

All objectives are minimised. They are computed in floating point, so that their values are right up
to a few units in the last place only. Differences of that size say nothing about designs: they may
neither make a design Pareto optimal nor decide a rank.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FEW = 128  # rows that are compared with each other before moocore is imported, in 50 ms

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
        F: ``(n, m)`` finite objective values, all minimised; n may be 0, m up to 255.

    Returns:
        ``(n,)`` mask. A row dominates another if it is nowhere worse and somewhere better.

    Raises:
        ArgumentValueError: A value is NaN or infinite.

    Example:
        >>> nondominated(np.array([[1.0, 2.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]))
        array([ True,  True, False,  True])
    """
    if len(F) == 0:
        return np.zeros(0, dtype=bool)
    if not np.isfinite(F).all():  # moocore (0.3) gives wrong answers, or ends the process
        raise invalid("F", "finite", Received("NaN or infinity"))
    F = settled(F)
    if F.shape[1] == 1:  # moocore takes two objectives or more
        return np.asarray(F[:, 0] == F[:, 0].min(), dtype=bool)
    if len(F) <= _FEW:
        return _undominated(F)
    import moocore

    # moocore (0.3) takes an eighth to a half less time for rows in the order it begins with.
    order = np.argsort(F[:, 0 if F.shape[1] > 3 else -1])
    mask = np.empty(len(F), dtype=bool)
    mask[order] = moocore.is_nondominated(F[order], keep_weakly=True)
    return mask


def _undominated(F: Array) -> Mask:
    """Compare every row with every other; see `nondominated`."""
    columns = np.ascontiguousarray(F.T)  # rows next to each other: ten times faster
    one, other = columns[:, :, None], columns[:, None, :]
    dominates = (one <= other).all(axis=0) & (one < other).any(axis=0)
    return np.asarray(~dominates.any(axis=0))


def nondominated_pair(a: NDArray[np.intp], b: NDArray[np.intp], other: NDArray[np.intp]) -> Mask:
    """Mark the points (a_i, b_i) that no other point dominates, in O(n).

    Args:
        a: ``(n,)`` first criterion as integer levels (:func:`pymoo_psi.pareto._dominance.levels`),
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


NOISE = 64 * float(np.finfo(np.float64).eps)
"""Two values of an objective that differ by no more than this share of their size are equal.

A value that comes out of k roundings is wrong by up to k/2 eps, and by about sqrt(k)/2 eps if they
are independent: 64 eps, 1.4e-14 of the value, allows for sums of a hundred terms at the worst and
of thousands as a rule. The size is that of the values themselves, not of the column, so that one
design with a penalty of 1e20 does not make all others equal. Noise around zero has no size to be
compared with, and counts.
"""

LAST_PLACES = 8 * float(np.finfo(np.float64).eps)
"""What an objective adds to the rounding error of a distance, as a share of its size.

Two values, each right to a few units in the last place, and the operations on them. An objective
whose range is above ``NOISE`` keeps so at least three bits of its differences.
"""


def unit_lengths(low: Array, high: Array) -> Array:
    """Return what differences are divided by to be measured in units of a range.

    The one rule for a range of zero: a quantity that is constant up to rounding tells no design
    from another and counts for nothing, whatever is measured in it; its unit is infinite.

    Args:
        low: ``(m,)`` least values.
        high: ``(m,)`` greatest values.
    """
    length = high - low
    return np.where(length > NOISE * np.maximum(np.abs(low), np.abs(high)), length, np.inf)


def settled(F: Array) -> Array:
    """Return values in which those that are equal up to rounding are the same number.

    Args:
        F: ``(n, m)`` finite values. In each column the values that differ from the least of
            them by no more than its noise, ``NOISE`` times its size, become that least one.

    Returns:
        ``(n, m)`` values in the same order in every column; ``F`` itself if nothing changes.
    """
    result = F
    for j, column in enumerate(F.T):
        ordered = np.sort(column)
        starts = _starts(ordered, NOISE * np.abs(ordered))
        if not np.any(~starts[1:] & (ordered[1:] > ordered[:-1])):
            continue
        result = F.copy() if result is F else result
        least = ordered[starts]
        result[:, j] = least[np.searchsorted(least, column, side="right") - 1]
    return result


def levels(values: Array, tolerance: float) -> NDArray[np.intp]:
    """Number the distinct values of an array from 0 upwards; those within a tolerance are one.

    Args:
        values: ``(n,)`` finite values, n >= 1.
        tolerance: Values get the same number if they differ by no more than this from the least
            one with that number, so that a long chain of close values is not taken for one.

    Returns:
        ``(n,)`` integers in the order of the values.
    """
    order = np.argsort(values, kind="stable")
    numbers = np.empty(len(values), dtype=np.intp)
    numbers[order] = np.cumsum(_starts(values[order], tolerance)) - 1
    return numbers


def _starts(ordered: Array, tolerance: Array | float) -> NDArray[np.bool_]:
    """Mark where a group of values begins that are within a tolerance of its least one.

    Args:
        ordered: ``(n,)`` increasing values, n >= 1.
        tolerance: One for all, or ``(n,)`` that of each value as the least of a group.
    """
    with np.errstate(over="ignore"):
        reach = ordered + tolerance
    starts = np.append(True, ordered[1:] > reach[:-1])
    # A gap always begins a group. Between two gaps there may be a chain, each value close to the
    # next but the last far from the first, which is cut where the group's reach ends.
    first = np.flatnonzero(starts)
    last = np.append(first[1:], len(ordered)) - 1
    if (ordered[last] > reach[first]).any():
        following = np.searchsorted(ordered, reach, side="right").tolist()
        starts[:] = False
        i = 0
        while i < len(ordered):
            starts[i] = True
            i = following[i]  # beyond i, as no reach is below its value
    return starts
