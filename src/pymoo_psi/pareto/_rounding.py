"""Rounding: which values are equal up to it, and which ranges are too small to be one.

An objective is computed in floating point, so its values are right up to a few units in the last
place only. Differences of that size say nothing about designs: they may neither make a design
Pareto optimal nor decide a rank.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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

_LARGEST = float(np.finfo(np.float64).max)


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
        F: ``(n, m)`` values without NaN. In each column the values that differ from the least of
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
        values: ``(n,)`` values without NaN, n >= 1.
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
    with np.errstate(over="ignore", invalid="ignore"):  # infinity is equal to itself alone
        reach = np.where(np.isinf(ordered), ordered, np.minimum(ordered + tolerance, _LARGEST))
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
