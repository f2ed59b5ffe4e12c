"""How well a set of points stands for a Pareto front, and which points stand for many.

All objectives are minimised. The indicators are moocore's: the hypervolume (Zitzler and Thiele
1998), IGD+ (Ishibuchi et al. 2015) and the additive epsilon indicator (Zitzler et al. 2003).
"""

from __future__ import annotations

import moocore
import numpy as np
from numpy.typing import NDArray

from pymoo_psi.sequences import MAX_DIMENSIONS, lp_tau

Array = NDArray[np.float64]

# Points by objectives of which moocore (0.3) finds the volume in half a second on a slow machine.
_EXACT = (0, *[10**6] * 4, 7000, 600, 190, 95, 60, 44, 36, 25, 20, 17, 15, 13)
_TIE = 1e-12  # squares of distances that differ by less, relatively, differ by rounding only


def hypervolume(F: Array, reference_point: float) -> tuple[float, float]:
    """Return the share of a cube that a set dominates, 0 to 1, and its standard error.

    It is exact, its error 0, where that takes about a second at most (Zitzler and Thiele 1998): up
    to four objectives for any set, and with eight for 95 points, as the time grows with a power of
    their number about as high as that of the objectives. Beyond, it is the share of 2^15 LPτ points
    that are dominated, in 16 shifts of 2^11 points modulo 1 (Cranley and Patterson 1976), which are
    the same for all sets.

    Args:
        F: ``(n, m)`` points, n >= 0; those not below the reference point count for nothing.
        reference_point: r > 0; the cube reaches from 0 to r in every objective. A point below 0
            counts as one at 0.
    """
    points = np.maximum(F[(reference_point > F).all(axis=1)], 0.0) / reference_point
    n, m = points.shape
    if n == 0:
        return 0.0, 0.0
    if m < len(_EXACT) and n <= _EXACT[m]:
        return float(moocore.hypervolume(points, ref=1.0)), 0.0
    low = points.min(axis=0)  # nothing is dominated below
    probes, shares = lp_tau(2**11, m) if m <= MAX_DIMENSIONS else None, []
    rng = np.random.default_rng(0)
    for shift in rng.random((16, m)):
        places = rng.random((2**11, m)) if probes is None else (probes + shift) % 1
        places = low + (1 - low) * places
        dominated = np.zeros(len(places), dtype=bool)
        for point in points:
            dominated[~dominated] = (point <= places[~dominated]).all(axis=1)
        shares.append(dominated.mean())
    shares = np.array(shares) * np.prod(1 - low)
    return float(shares.mean()), float(shares.std(ddof=1) / 4)


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
    """Return the indices of points that cover a set evenly, the best of each objective among them.

    After the best points of the objectives, farthest first: see :func:`farthest_first`.

    Args:
        F: ``(n, m)`` points, in units in which distances have a meaning.
        size: How many points, at least m; all, if there are no more.
    """
    if len(F) <= size:
        return np.arange(len(F))
    chosen, _, _ = farthest_first(F, list(dict.fromkeys(F.argmin(axis=0).tolist())), size)
    return chosen


def farthest_first(
    F: Array, start: list[int], size: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Choose points that cover a set: always the one farthest from those chosen (Gonzalez 1985).

    With one point to start from, no point of the set is farther from the nearest chosen one than
    twice what the best choice of as many points could reach.

    Args:
        F: ``(n, m)`` points, in units in which distances have a meaning.
        start: The points that are chosen first, one or more.
        size: How many points, ``len(start)`` to n.

    Returns:
        ``(size,)`` their indices; ``(n,)`` which of them, 0 to ``size - 1``, is the nearest to each
        point, the first of equally near ones; ``(n,)`` the distance to it.
    """
    chosen = list(start)
    columns = np.ascontiguousarray(F.T)
    far, owner = np.full(len(F), np.inf), np.zeros(len(F), dtype=np.intp)
    for i in range(size):
        if i == len(chosen):
            chosen.append(int(far.argmax()))
        squares = np.zeros(len(F))
        for column in columns:  # a column at a time: no (n, m) array in every step
            squares += (column - column[chosen[i]]) ** 2
        owner[squares < far * (1 - _TIE)] = i
        np.minimum(far, squares, out=far)
    return np.array(chosen), owner, np.sqrt(far)
