"""Which rows of a matrix of objectives, all minimised, are Pareto optimal."""

from __future__ import annotations

import moocore
import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.pareto._rounding import settled

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def nondominated(F: Array) -> Mask:
    """Mark the rows of ``F`` that no other row dominates; equal rows are kept together.

    Values of an objective that differ by no more than rounding noise, 1.4e-14 of their size,
    are equal.

    Args:
        F: ``(n, m)`` objective values without NaN, all minimised; n may be 0, m up to 255.

    Returns:
        ``(n,)`` mask. A row dominates another if it is nowhere worse and somewhere better.

    Raises:
        ArgumentValueError: There are more than 255 objectives.

    Example:
        >>> nondominated(np.array([[1.0, 2.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]))
        array([ True,  True, False,  True])
    """
    if len(F) == 0:
        return np.zeros(0, dtype=bool)
    if F.shape[1] > 255:
        raise invalid("F", "of at most 255 objectives", Received(f"{F.shape[1]}"))
    F = settled(F)
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
        b: ``(n,)`` second criterion likewise.
        other: ``(n,)`` third criterion likewise, which decides between equal points.

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
