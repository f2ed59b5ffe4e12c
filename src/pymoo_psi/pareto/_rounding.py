"""Which values are equal up to rounding, and what a difference is measured in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def unit_lengths(low: Array, high: Array) -> Array:
    """Return what differences are divided by to be measured in units of a span.

    The one rule for a span of zero: a quantity that is constant tells no design from another and
    counts for nothing, whatever is measured in it; its unit is infinite.

    Args:
        low: ``(m,)`` least values.
        high: ``(m,)`` greatest values.
    """
    span = high - low
    return np.where(span > 0, span, np.inf)


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
    ordered = values[order]
    starts = np.diff(ordered, prepend=-np.inf) > tolerance
    first = np.flatnonzero(starts)
    last = np.append(first[1:], len(ordered)) - 1
    for k in np.flatnonzero(ordered[last] - ordered[first] > tolerance):  # chains: seldom any
        i = int(first[k])
        while ordered[last[k]] - ordered[i] > tolerance:
            i = int(np.searchsorted(ordered, ordered[i] + tolerance, side="right"))
            starts[i] = True
    result = np.empty(len(values), dtype=np.intp)
    result[order] = np.cumsum(starts) - 1
    return result
