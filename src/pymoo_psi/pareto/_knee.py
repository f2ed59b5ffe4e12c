"""The knee of a Pareto set: where it bulges most towards the utopian point.

The extreme designs span a plane, and the design farthest beyond it, on the side of U, is the knee
(Das, Structural Optimization 18, 1999, "maximum bulge"). From there, every objective improves at
a higher price than between the extremes. A set that is straight or bulges away from U has none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto._ranking import EfficiencyRanking, front_of
from pymoo_psi.pareto._rounding import levels, unit_lengths

Array = NDArray[np.float64]

# Bulges below this share of the ranges are none. A plane through extremes is right to about
# 1e-16 / 1e-6 of them, see below, and no one chooses by a billionth.
_STRAIGHT = 1e-9
# Extremes whose directions from U differ by less than this span no plane: the set is degenerate.
_FLAT = 1e-6


def knee(ranking: EfficiencyRanking) -> NDArray[np.intp]:
    """Return the indices of the Pareto-optimal rows that bulge most, equal up to rounding.

    The extreme design of an objective is the one that is worst in it for the best in all others:
    of least largest, then least sum of the others, in units of the ranges (Deb and Jain 2014). The
    result does not depend on units: a plane stays a plane in any.

    Returns:
        No index if no design lies beyond the plane, if the extremes span none, or none that faces
        U, so that no objective could be given up for the others.
    """
    front, values = front_of(ranking)
    best = values.min(axis=0)
    lengths = unit_lengths(best, values.max(axis=0))
    d = ((values - best) / lengths)[:, np.isfinite(lengths)]
    bulge = _bulges(d)
    if bulge.max(initial=0.0) <= _STRAIGHT:
        return front[:0]
    most: NDArray[np.intp] = front[levels(-bulge, _STRAIGHT) == 0]
    return most


def _bulges(d: Array) -> Array:
    """Return how far ``(n, m)`` points lie beyond the plane of the extremes; 0 if there is none."""
    n, m = d.shape
    extremes = np.empty((m, m))
    for j in range(m if m > 1 else 0):
        others = np.delete(d, j, axis=1)
        extremes[j] = d[np.lexsort((d[:, j], others.sum(axis=1), others.max(axis=1)))[0]]
    if m < 2 or np.linalg.matrix_rank(extremes, tol=_FLAT) < m:
        return np.zeros(n)
    normal = np.linalg.solve(extremes, np.ones(m))  # the plane is d·normal = 1
    if (normal <= 0).any():
        return np.zeros(n)
    bulges: Array = (1 - d @ normal) / np.linalg.norm(normal)
    return bulges
