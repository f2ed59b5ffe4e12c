"""How well a set of points stands for a Pareto front, and which points stand for many.

All objectives are minimised. The indicators are moocore's: the hypervolume (Zitzler and Thiele
1998), IGD+ (Ishibuchi et al. 2015) and the additive epsilon indicator (Zitzler et al. 2003).
"""

from __future__ import annotations

import moocore
import numpy as np
from numpy.typing import NDArray

__all__ = ["attainment_surfaces", "epsilon_additive", "hypervolume", "igd_plus", "spread_subset"]

Array = NDArray[np.float64]


def hypervolume(F: Array, reference_point: float) -> float:
    """Return the share of a cube that a set dominates, 0 to 1; exact, and 0 for no points.

    Args:
        F: ``(n, m)`` points, n >= 0; those not below the reference point count for nothing.
        reference_point: r > 0; the cube reaches from 0 to r in every objective. A point below 0
            counts as one at 0.
    """
    within = F[(reference_point > F).all(axis=1)]
    if len(within) == 0:
        return 0.0
    volume = moocore.hypervolume(np.maximum(within, 0.0), ref=reference_point)
    return float(volume / reference_point ** F.shape[1])


def igd_plus(F: Array, reference: Array) -> float:
    """Return how much a set is worse than the points of a reference set, in the mean.

    Of each point of the reference set, the distance to what the nearest point of ``F``
    dominates; 0 if all are dominated.

    Args:
        F: ``(n, m)`` points, n >= 0; infinite for no points.
        reference: ``(k, m)`` the reference set, k >= 1.
    """
    return float(moocore.igd_plus(F, ref=reference)) if len(F) else np.inf


def epsilon_additive(F: Array, reference: Array) -> float:
    """Return by how much a set must be improved to dominate all of a reference set.

    Args:
        F: ``(n, m)`` points, n >= 0; infinite for no points.
        reference: ``(k, m)`` the reference set, k >= 1.
    """
    return float(moocore.epsilon_additive(F, ref=reference)) if len(F) else np.inf


def spread_subset(F: Array, size: int) -> NDArray[np.intp]:
    """Return the indices of points that cover a set evenly: farthest first (Gonzalez 1985).

    The best point of each objective comes first; then always the point farthest from those
    chosen. No point of the set is farther from the nearest chosen one than twice what the best
    choice of as many points could reach.

    Args:
        F: ``(n, m)`` points, in units in which distances have a meaning.
        size: How many points, at least m; all, if there are no more.
    """
    if len(F) <= size:
        return np.arange(len(F))
    chosen = list(dict.fromkeys(F.argmin(axis=0).tolist()))
    columns = np.ascontiguousarray(F.T)
    far = np.full(len(F), np.inf)
    for i in range(size):
        if i == len(chosen):
            chosen.append(int(far.argmax()))
        squares = np.zeros(len(F))
        for column in columns:  # a column at a time: no (n, m) array in every step
            squares += (column - column[chosen[i]]) ** 2
        np.minimum(far, squares, out=far)
    return np.array(chosen)


def attainment_surfaces(fronts: list[Array], percentiles: list[float]) -> dict[float, Array]:
    """Return what a share of the runs attains, for two objectives (Fonseca et al. 2001).

    Args:
        fronts: The ``(n_i, 2)`` points that each run has found.
        percentiles: Shares of the runs in percent.

    Returns:
        For each percentile the ``(k, 2)`` corners of its surface by rising first objective; none
        where so many runs have no points.
    """
    found = [front for front in fronts if len(front)]
    surfaces = {p: np.zeros((0, 2)) for p in percentiles}
    if found:
        sets = np.repeat(np.arange(len(found)), [len(front) for front in found])
        # A run without points attains nothing: of r runs, p percent are so many of those with some.
        scale = len(fronts) / len(found)
        wanted = [p * scale for p in percentiles if p * scale <= 100 * (1 + 1e-12)]
        points = moocore.eaf(np.column_stack([np.vstack(found), sets]), percentiles=wanted)
        for p in percentiles:
            at = points[np.isclose(points[:, 2], p * scale)][:, :2]
            surfaces[p] = at[np.lexsort((-at[:, 1], at[:, 0]))]
    return surfaces
