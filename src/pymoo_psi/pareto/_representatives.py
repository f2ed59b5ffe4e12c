"""Representatives of a Pareto set: a few designs that cover it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._output import Shown
from pymoo_psi._validation import Array, Rows, integer
from pymoo_psi.pareto._ranking import EfficiencyRanking, rank_of_efficiency

if TYPE_CHECKING:
    import pandas as pd

_TIE = 1e-12  # squared distances with a smaller relative difference are equal up to rounding


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
    nearest = np.full(len(F), np.inf)  # squared distances to the owners
    owner = np.zeros(len(F), dtype=np.intp)
    for i in range(size):
        if i == len(chosen):
            chosen.append(nearest.argmax())
        steps = F - F[chosen[i]]
        squares = np.einsum("ij,ij->i", steps, steps)
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
    front = ranking.front
    points = (ranking.optimal - ranking.optimal.min(axis=0)) / ranking.frame.scale
    start = np.searchsorted(front, ranking.salukvadze[0])
    size = min(k, len(front))
    chosen, owner, distance = farthest_first(points, [start], size)
    distinct = len(np.unique(owner))  # one that equals an earlier one owns nothing
    shares = np.bincount(owner, minlength=distinct) / len(front)
    return Representatives(ranking, front[chosen[:distinct]], shares, float(distance.max()))
