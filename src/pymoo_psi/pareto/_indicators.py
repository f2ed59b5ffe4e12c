"""Quality indicators of a set of points, and representatives of a Pareto set.

All objectives are minimised. IGD+ (Ishibuchi et al. 2015), the additive epsilon indicator (Zitzler
et al. 2003) and the ranks of nondominated sorting are moocore's own functions.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import moocore
import numpy as np
from moocore import epsilon_additive as epsilon_additive
from moocore import igd_plus as igd_plus
from moocore import pareto_rank as pareto_rank

from pymoo_psi._output import Shown
from pymoo_psi._validation import Array, Rows, integer
from pymoo_psi.pareto._ranking import EfficiencyRanking, front_of, rank_of_efficiency
from pymoo_psi.sequences import lp_tau

if TYPE_CHECKING:
    import pandas as pd

# By number of objectives, the number of points whose volume moocore (0.3) computes within half a
# second on a slow machine.
_EXACT = (0, *[10**6] * 4, 7000, 600, 190, 95, 60, 44, 36, 25, 20, 17, 15, 13)
_TIE = 1e-12  # squared distances with a smaller relative difference are equal up to rounding
_SHIFTS = 16
_PROBES = 2**11  # the number of points of each shift


def hypervolume(F: Array, reference_point: float) -> tuple[float, float]:
    """Return the share of a cube that a set dominates, 0 to 1, and its standard error.

    The value is exact, with error 0, if it takes about a second at most (Zitzler and Thiele 1998):
    for up to four objectives always, for eight objectives up to 95 points. The time grows with a
    power of the number of points about as high as the number of objectives. For larger sets it is
    the share of 2^15 LPτ points that are dominated, in 16 shifts of 2^11 points modulo 1 (Cranley
    and Patterson 1976), the same for all sets.

    Args:
        F: ``(n, m)`` points, n >= 0; only those below the reference point count.
        reference_point: r > 0; the cube is 0 to r in every objective. A point below 0 counts as
            one at 0.
    """
    inside = (reference_point > F).all(axis=1)
    points = np.maximum(F[inside], 0.0) / reference_point
    n, m = points.shape
    if n == 0:
        return 0.0, 0.0
    if m < len(_EXACT) and n <= _EXACT[m]:
        return float(moocore.hypervolume(points, ref=1.0)), 0.0
    low = points.min(axis=0)  # no point below it is dominated
    shares = []
    probes = lp_tau(_PROBES, m)
    for shift in np.random.default_rng(0).random((_SHIFTS, m)):
        free = low + (1 - low) * ((probes + shift) % 1)
        for point in points:
            free = free[~(point <= free).all(axis=1)]
        shares.append(1 - len(free) / _PROBES)
    volumes = np.array(shares) * np.prod(1 - low)
    return float(volumes.mean()), float(volumes.std(ddof=1) / np.sqrt(_SHIFTS))


def spread_subset(F: Array, size: int) -> Rows:
    """Return the indices of points that cover a set evenly, the best of each objective among them.

    After the best points of the objectives, farthest first: see :func:`farthest_first`.

    Args:
        F: ``(n, m)`` points, in units in which distances have a meaning.
        size: Number of points, at least m; all points if there are no more.
    """
    if len(F) <= size:
        return np.arange(len(F))
    best = list(dict.fromkeys(F.argmin(axis=0).tolist()))
    chosen, _, _ = farthest_first(F, best, size)
    return chosen


def farthest_first(F: Array, start: list[Any], size: int) -> tuple[Rows, Rows, Array]:
    """Choose points that cover a set: always the one farthest from those chosen (Gonzalez 1985).

    With one point to start from, no point of the set is farther from the nearest chosen one than
    twice what the best choice of as many points could reach.

    Args:
        F: ``(n, m)`` points, in units in which distances have a meaning.
        start: The points that are chosen first, one or more.
        size: Number of points, ``len(start)`` to n.

    Returns:
        ``(size,)`` their indices; ``(n,)`` which of them, 0 to ``size - 1``, is the nearest to each
        point, the first of equally near ones; ``(n,)`` the distance to it.
    """
    chosen = list(start)
    columns = np.ascontiguousarray(F.T)
    nearest = np.full(len(F), np.inf)  # squared distances to the owners
    owner = np.zeros(len(F), dtype=np.intp)
    for i in range(size):
        if i == len(chosen):
            chosen.append(nearest.argmax())
        squares = np.zeros(len(F))
        for column in columns:  # a column at a time: no (n, m) array in every step
            squares += (column - column[chosen[i]]) ** 2
        owner[squares < nearest * (1 - _TIE)] = i
        np.minimum(nearest, squares, out=nearest)
    return np.array(chosen), owner, np.sqrt(nearest)


@dataclass(frozen=True, eq=False)
class Representatives(Shown):
    """A few designs that cover a Pareto set, each for a share of it.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        rows: ``(k,)`` the rows of the representatives in the ranking, the Salukvadze optimum first;
            fewer than requested if the Pareto set has fewer different designs.
        shares: ``(k,)`` the share of the Pareto-optimal designs that each represents, the nearest
            ones; equally near designs belong to the first. The shares sum to 1.
        radius: The greatest distance of a Pareto-optimal design from its representative.

    Example:
        >>> few = representatives([[0, 9], [1, 8], [4, 4], [5, 3], [9, 0]], 2)
        >>> few.rows, few.shares, round(few.radius, 2)
        (array([2, 0]), array([0.6, 0.4]), 0.71)
    """

    ranking: EfficiencyRanking
    rows: Rows
    shares: Array
    radius: float

    def to_frame(self) -> pd.DataFrame:
        """Return the representatives with their places, objectives and shares of the Pareto set.

        Example:
            >>> F = [[0, 9], [1, 8], [4, 4], [5, 3], [9, 0]]
            >>> print(representatives(F, 2).to_frame()[["place", "f1", "f2", "share"]])
               place   f1   f2  share
            2      1  4.0  4.0    0.6
            0      4  0.0  9.0    0.4
        """
        row_in_frame = np.argsort(self.ranking.by_place)
        frame = self.ranking.to_frame().iloc[row_in_frame[self.rows]]
        return frame.assign(share=self.shares)


def representatives(
    F: Any, k: int, *, normalize: bool | None = None, maximize: Collection[Any] = ()
) -> Representatives:
    """Choose k designs that cover the Pareto set, the Salukvadze optimum among them.

    After the optimum, each step chooses the design that is farthest from those chosen (Gonzalez,
    Theoretical Computer Science 38, 1985). No design is farther from its representative than twice
    the distance that the best k designs could reach. Of equally distant designs the first is
    chosen.

    Args:
        F: ``(n, m)`` objective values, an array or a data frame, or a ranking of them, which has
            its own ``normalize`` and ``maximize``; dominated rows are left out.
        k: Number of designs, >= 1.
        normalize: Measure distances with each objective in units of its range over the Pareto
            set; ``False`` takes plain Euclidean distances.
        maximize: The objectives to be maximised: column indices or, of a data frame, names.

    Returns:
        The designs, with the share of the Pareto set that each represents.

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
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    front, values = front_of(ranking)
    points = ranking.frame.scaled(values)
    unit = points.max() or 1.0  # no square over- or underflows
    start = np.searchsorted(front, ranking.salukvadze[0])
    size = min(k, len(front))
    chosen, owner, distance = farthest_first(points / unit, [start], size)
    distinct = len(np.unique(owner))  # one that equals an earlier one owns nothing
    shares = np.bincount(owner, minlength=distinct) / len(front)
    radius = float((distance * unit).max())
    return Representatives(ranking, front[chosen[:distinct]], shares, radius)
