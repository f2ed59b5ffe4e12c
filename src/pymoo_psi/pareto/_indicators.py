"""How well a set of points stands for a Pareto front, and which points stand for many.

All objectives are minimised. IGD+ (Ishibuchi et al. 2015), the additive epsilon indicator (Zitzler
et al. 2003) and the numbers of fronts are moocore's own functions.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import moocore
import numpy as np
from moocore import epsilon_additive as epsilon_additive
from moocore import igd_plus as igd_plus
from moocore import pareto_rank as pareto_rank
from numpy.typing import NDArray

from pymoo_psi._validation import integer
from pymoo_psi.pareto._ranking import EfficiencyRanking, front_of, ranking_from
from pymoo_psi.sequences import MAX_DIMENSIONS, lp_tau

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

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


@dataclass(frozen=True, eq=False)
class Representatives:
    """A few designs that cover a Pareto set, and what each of them stands for.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        rows: ``(k,)`` the representatives, the Salukvadze optimum first; fewer than asked for if
            the Pareto set has fewer different designs.
        shares: ``(k,)`` the share of the Pareto-optimal designs that each stands for: those
            nearer to it than to the others, or equally near to it and to later ones. They sum
            to 1.
        radius: How far a Pareto-optimal design is at most from its representative.

    Example:
        >>> few = representatives([[0, 9], [1, 8], [4, 4], [5, 3], [9, 0]], 2)
        >>> few.rows, few.shares, round(few.radius, 2)
        (array([2, 0]), array([0.6, 0.4]), 0.71)
    """

    ranking: EfficiencyRanking
    rows: Rows
    shares: Array
    radius: float


def representatives(
    F: Any, k: int, *, normalize: bool = True, maximize: Collection[Any] = ()
) -> Representatives:
    """Choose k designs that cover the Pareto set, the Salukvadze optimum among them.

    Farthest first: after the optimum always the design that is farthest from those chosen
    (Gonzalez, Theoretical Computer Science 38, 1985). So no design is farther from its
    representative than twice the distance that the best k designs could reach. The choice has no
    chance in it: of equally far designs the first is taken.

    Args:
        F: ``(n, m)`` objective values, an array or a data frame, or a ranking of them, which has
            its own ``normalize`` and ``maximize``; dominated rows are left out.
        k: How many, >= 1.
        normalize: Measure distances with each objective in units of its range over the Pareto
            set; ``False`` takes plain Euclidean distances.
        maximize: The objectives to be maximised: column indices or, of a data frame, names.

    Returns:
        The designs, with the share of the Pareto set that each stands for.

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` does not fit, or ``k`` is below 1.
        ArgumentTypeError: ``F`` does not hold real numbers; ``k`` is no integer.

    Example:
        >>> F = [[x / 100, (1 - x / 100) ** 2] for x in range(101)]
        >>> few = representatives(F, 3)
        >>> few.rows, few.shares.round(2), round(few.radius, 3)
        (array([ 41,   0, 100]), array([0.48, 0.19, 0.34]), 0.379)
    """
    k = integer("k", k, minimum=1)
    ranking = ranking_from(F, normalize, maximize)
    front, values = front_of(ranking)
    points = ranking.frame.scaled(values)
    unit = points.max() or 1.0  # so that no square over- or underflows
    start = int(np.searchsorted(front, ranking.salukvadze[0]))
    chosen, owner, distance = farthest_first(points / unit, [start], min(k, len(front)))
    distinct = len(dict.fromkeys(owner.tolist()))  # one that equals an earlier one owns nothing
    shares = np.bincount(owner, minlength=distinct) / len(front)
    radius = float((distance * unit).max())
    return Representatives(ranking, front[chosen[:distinct]], shares, radius)
