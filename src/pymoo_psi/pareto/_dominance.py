"""Feasibility, dominance, and equality up to rounding.

All objectives are minimised. They are computed in floating point, so that their values are correct
to a few units in the last place only. Differences of that size say nothing about designs: they must
neither make a design Pareto optimal nor decide a rank.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._numbers import NumberFormat
from pymoo_psi._validation import Array, Mask, Rows, objective_matrix, real_array

Levels = Rows

_READ = 1000  # designs; of more, nobody compares all
_PAIRS = 1_000_000  # that are compared at once: a few megabytes
_FEW = 128  # rows that are compared in pairs: it takes no longer, and moocore is not imported
_COMPARED = 1000  # designs by which it is judged which objectives conflict

_WORST = np.iinfo(np.intp).max

EQ_TOLERANCE = 1e-4
"""pymoo's tolerance: an equality constraint is met where |h| <= 1e-4."""


def violated_constraints(G: Array, H: Array, tolerance: float = EQ_TOLERANCE) -> Mask:
    """Return which constraints are violated; NaN violates a constraint.

    Args:
        G: ``(..., n_ieq)`` inequality constraints, met where g <= 0.
        H: ``(..., n_eq)`` equality constraints, met where |h| <= tolerance.
        tolerance: Tolerance of equality constraints.

    Returns:
        ``(..., n_ieq + n_eq)`` mask, the inequalities first.
    """
    return np.concatenate([~(G <= 0), ~(np.abs(H) <= tolerance)], axis=-1)


def meets_constraints(G: Array, H: Array) -> Mask:
    """``(...,)`` which designs meet every constraint; without constraints all do."""
    return np.asarray(~violated_constraints(G, H).any(axis=-1))


def constraint_violation(G: Array, H: Array, tolerance: float = EQ_TOLERANCE) -> Array:
    """``(n,)`` pymoo's measure: the sum by which ``(n, n_ieq)`` G and ``(n, n_eq)`` H exceed 0."""
    inequalities = np.maximum(G, 0).sum(axis=1)
    equalities = np.maximum(np.abs(H) - tolerance, 0).sum(axis=1)
    return np.asarray(inequalities + equalities)


def competes(F: Array, feasible: Mask) -> Mask:
    """``(...,)`` which designs are feasible and have finite objectives ``(..., m)`` F.

    Only these are compared with each other: the others are neither optimal nor dominated.
    """
    return feasible & np.isfinite(F).all(axis=-1)


def nondominated(F: ArrayLike) -> Mask:
    """Mark the rows of ``F`` that no other row dominates; equal rows are kept together.

    Values of an objective that differ by no more than rounding noise, 1.4e-14 of their size,
    are equal.

    Args:
        F: ``(n, m)`` finite objective values, all minimised; n may be 0, m up to 255.

    Returns:
        ``(n,)`` mask. A row dominates another if it is nowhere worse and somewhere better.

    Raises:
        ArgumentValueError: A value is NaN or infinite, or ``F`` has another shape.
        ArgumentTypeError: ``F`` does not hold real numbers.

    Example:
        >>> nondominated([[1.0, 2.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]])
        array([ True,  True, False,  True])
    """
    F = real_array("F", F)
    if F.size == 0:
        return np.ones(len(F), dtype=bool)
    # Of NaN and infinity moocore (0.3) gives wrong answers, or ends the process.
    F = without_rounding(objective_matrix("F", F))
    n, m = F.shape
    if m == 1:  # moocore takes two objectives or more
        return np.asarray(F[:, 0] == F[:, 0].min(), dtype=bool)
    if n <= _FEW:
        return ~dominated_by(F, F)
    import moocore  # here, as the import takes some 20 ms

    # Rows that are sorted so save moocore (0.3) up to a third of the time.
    column = 0
    if m <= 3:
        column = -1
    order = np.argsort(F[:, column])
    mask = np.empty(n, dtype=bool)
    mask[order] = moocore.is_nondominated(F.take(order, axis=0), keep_weakly=True)
    return mask


def dominated_by(F: Array, others: Array) -> Mask:
    """Mark the rows of ``(n, m)`` F that some row of ``(k, m)`` others dominates.

    Args:
        F: Objectives without rounding noise, minimised.
        others: Those of the other rows.
    """
    masks = []
    for block in np.array_split(F, len(F) * len(others) // _PAIRS + 1):
        is_nowhere_worse = np.ones((len(others), len(block)), dtype=bool)  # than rows of the block
        is_better = ~is_nowhere_worse
        for other, column in zip(others.T[:, :, None], block.T, strict=True):
            is_nowhere_worse &= other <= column
            is_better |= other < column
        masks.append((is_nowhere_worse & is_better).any(axis=0))
    return np.concatenate(masks)


def enough_digits(F: Array, formats: list[NumberFormat]) -> list[NumberFormat]:
    """Return formats with one more digit if a design looks dominated as its objectives are written.

    Args:
        F: ``(n, m)`` objectives of designs none of which dominates another, minimised.
        formats: ``(m,)`` how the objectives are written.
    """
    if len(F) > _READ:
        return formats
    columns = [one.rounded(column) for one, column in zip(formats, F.T, strict=True)]
    if nondominated(np.column_stack(columns)).all():
        return formats
    longer = []
    for one, column, written in zip(formats, F.T, columns, strict=True):
        n_more = len(np.unique(written)) < len(np.unique(column))
        longer.append(replace(one, decimals=one.decimals + n_more))
    return longer


def nondominated_pair(a: Levels, b: Levels, other: Levels) -> Mask:
    """Mark the points (a_i, b_i) that no other point dominates, in O(n).

    Args:
        a: ``(n,)`` first criterion as integer levels (:func:`pymoo_psi.pareto._dominance.levels`),
            n >= 1.
        b: ``(n,)`` second criterion, as ``a``.
        other: ``(n,)`` third criterion, as ``a``, which decides between equal points.

    Returns:
        ``(n,)`` mask.
    """
    # A point stays if its b is the best for its a, and better than for every smaller a.
    best = _least_by_level(a, b, a.max() + 1)
    best_before = np.append(_WORST, np.minimum.accumulate(best)[:-1])
    mask: Mask = (b == best[a]) & (b < best_before[a])
    least = _least_by_level(a[mask], other[mask], len(best))
    mask &= other == least[a]
    return mask


def _least_by_level(levels: Levels, values: Levels, count: int) -> Levels:
    """Return ``(count,)`` the least value at each level; `_WORST` where there is none."""
    least = np.full(count, _WORST)
    np.minimum.at(least, levels, values)
    return least


NOISE = 64 * np.finfo(np.float64).eps
"""Two values of an objective that differ by no more than this share of their size are equal.

The error of a value after k roundings is at most k/2 eps, and about sqrt(k)/2 eps if they are
independent: 64 eps, 1.4e-14 of the value, allows for sums of a hundred terms in the worst case and
typically of thousands. The size is that of the values themselves, not of the column, so that one
design with a penalty of 1e20 does not make all others equal. Noise around zero has no size to
compare it with, and counts as a difference.
"""

LAST_PLACES = 8 * np.finfo(np.float64).eps
"""The contribution of an objective to the rounding error of a distance, as a share of its size.

It allows for two values, each correct to a few units in the last place, and the operations on them.
An objective whose range is above ``NOISE`` thus keeps at least three bits of its differences.
"""


def unit_lengths(low: Array, high: Array) -> Array:
    """Return the lengths of ranges, by which differences are divided.

    The one rule for a range of zero: a quantity that is constant up to rounding does not
    distinguish designs and has no weight; its length is infinite.

    Args:
        low: ``(m,)`` least values.
        high: ``(m,)`` greatest values.
    """
    lengths = high - low
    noise = NOISE * np.maximum(np.abs(low), np.abs(high))
    return np.where(lengths > noise, lengths, np.inf)


def first_equal(F: Array) -> Rows:
    """Return ``(n,)`` the index of the first row of ``(n, m)`` F that is equal to each."""
    order = np.lexsort(F.T)  # which keeps the order of equal rows
    ordered = F[order]
    starts = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))
    first = np.empty(len(F), dtype=np.intp)
    first[order] = order[starts][np.cumsum(starts) - 1]
    return first


def without_rounding(F: Array) -> Array:
    """Return the values, with the same number for those that are equal up to rounding.

    Args:
        F: ``(n, m)`` finite values. In each column the values that differ from the least of
            them by no more than its noise, ``NOISE`` times its size, become that least one.

    Returns:
        ``(n, m)`` values in the same order in every column, stored by column: what follows takes
        the least and the greatest of columns, which then is many times faster.
    """
    return np.array([_column_without_rounding(column) for column in F.T]).T


def _column_without_rounding(column: Array) -> Array:
    ordered = np.sort(column)
    starts = _starts(ordered, NOISE * np.abs(ordered))
    differs = ordered[1:] > ordered[:-1]
    if not np.any(differs & ~starts[1:]):
        return column
    least = ordered[starts]
    return least[np.searchsorted(least, column, side="right") - 1]


def levels(values: Array, tolerance: float) -> Levels:
    """Number the distinct values of an array from 0 upwards; those within a tolerance are one.

    Args:
        values: ``(n,)`` finite values, n >= 1.
        tolerance: Values get the same number if they differ by no more than this from the least
            one with that number, so that a long chain of close values is not one value.

    Returns:
        ``(n,)`` integers in the order of the values.
    """
    order = np.argsort(values)
    starts = _starts(values[order], tolerance)
    numbers = np.empty(len(values), dtype=np.intp)
    numbers[order] = np.cumsum(starts) - 1
    return numbers


def _starts(ordered: Array, tolerance: Array | float) -> Mask:
    """Mark the first value of each group: the values within a tolerance of its least one.

    Args:
        ordered: ``(n,)`` increasing values, n >= 1.
        tolerance: One for all, or ``(n,)`` that of each value as the least of a group.
    """
    with np.errstate(over="ignore"):
        reach = ordered + tolerance
    starts = np.append(True, ordered[1:] > reach[:-1])
    if starts.all():
        return starts
    # A gap always begins a group. Between two gaps there may be a chain, each value close to the
    # next but the last far from the first. It is cut where the reach of its first value ends.
    first = np.flatnonzero(starts)
    last = np.append(first[1:], len(ordered)) - 1
    if (ordered[last] > reach[first]).any():
        following = np.searchsorted(ordered, reach, side="right").tolist()
        starts[:] = False
        i = 0
        while i < len(ordered):
            starts[i] = True
            i = following[i]  # it lies beyond i, as no reach is below its value
    return starts


def conflicting_pairs(F: Array) -> list[tuple[int, int]]:
    """Return all pairs of objectives, those whose ranks are the most opposed first.

    Args:
        F: ``(n, m)`` minimised objectives of Pareto-optimal designs; the first 1000 are compared.
    """
    import pandas as pd

    likeness = pd.DataFrame(F[:_COMPARED]).corr(method="spearman")
    values = likeness.fillna(1.0).to_numpy()  # an objective that is constant conflicts with none
    pairs = combinations(range(F.shape[1]), 2)
    return sorted(pairs, key=lambda pair: float(values[pair]))
