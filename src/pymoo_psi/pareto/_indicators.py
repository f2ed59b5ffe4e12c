"""How well a set of points stands for a Pareto front, and which points stand for many.

All objectives are minimised. The indicators are moocore's: the hypervolume (Zitzler and Thiele
1998), IGD+ (Ishibuchi et al. 2015) and the additive epsilon indicator (Zitzler et al. 2003).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._output import Shown
from pymoo_psi._validation import integer
from pymoo_psi.pareto._ranking import EfficiencyRanking, front_of, ranking_from
from pymoo_psi.sequences import MAX_DIMENSIONS, lp_tau

if TYPE_CHECKING:
    import pandas as pd

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
        import moocore

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
    import moocore

    return float(moocore.igd_plus(F, ref=reference)) if len(F) else np.inf


def epsilon_additive(F: Array, reference: Array) -> float:
    """Return by how much a set must be improved to dominate all of a reference set.

    Args:
        F: ``(n, m)`` points, n >= 0; infinite for no points.
        reference: ``(k, m)`` the reference set, k >= 1.
    """
    import moocore

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


@dataclass(frozen=True, eq=False, repr=False)
class Representatives(Shown):
    """A few designs that cover a Pareto set, and what each of them stands for.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        rows: ``(k,)`` the representatives, the Salukvadze optimum first; fewer than asked for if
            the Pareto set has fewer different designs.
        shares: ``(k,)`` the share of the Pareto-optimal designs that each stands for: those
            nearer to it than to the others, or equally near to it and to later ones. They sum
            to 1.
        farthest: ``(k,)`` distance to the farthest design that each stands for.

    Example:
        >>> few = representatives([[0, 9], [1, 8], [4, 4], [5, 3], [9, 0]], 2)
        >>> few.rows, few.shares, few.farthest.round(2)
        (array([2, 0]), array([0.6, 0.4]), array([0.71, 0.16]))
    """

    ranking: EfficiencyRanking
    rows: Rows
    shares: Array
    farthest: Array

    def __repr__(self) -> str:
        """Return how many stand for how many, and how closely."""
        n = int(self.ranking.pareto.sum())
        return f"Representatives({len(self.rows)} of {n} Pareto optimal, radius {self.radius:.3g})"

    @property
    def radius(self) -> float:
        """How far a Pareto-optimal design is at most from its representative.

        Example:
            >>> round(representatives([[0, 9], [1, 8], [4, 4], [5, 3], [9, 0]], 3).radius, 2)
            0.16
        """
        return float(self.farthest.max())

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each representative, in the order of :attr:`rows`.

        Returns:
            Index: the row in ``F``, or the label in the data frame that was given. Columns: the
            objectives, ``share``, ``farthest``.

        Example:
            >>> print(representatives([[0, 9], [1, 8], [4, 4], [9, 0]], 3).to_frame().round(2))
                f1   f2  share  farthest
            2  4.0  4.0   0.25      0.00
            0  0.0  9.0   0.50      0.16
            3  9.0  0.0   0.25      0.00
        """
        import pandas as pd

        chosen = self.ranking.objectives.rows(self.rows)
        frame = pd.DataFrame(chosen.values, pd.Index(chosen.labels), list(chosen.names))
        frame.insert(len(chosen.names), "share", self.shares)  # refuses a name that is taken
        frame.insert(len(chosen.names) + 1, "farthest", self.farthest)
        return frame


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
        >>> few
        Representatives(3 of 101 Pareto optimal, radius 0.379)
        >>> few.rows, few.shares.round(2)
        (array([ 41,   0, 100]), array([0.48, 0.19, 0.34]))
    """
    k = integer("k", k, minimum=1)
    ranking = ranking_from(F, normalize, maximize)
    front, values = front_of(ranking)
    points = ranking.frame.scaled(values)
    unit = points.max() or 1.0  # so that no square over- or underflows
    start = int(np.searchsorted(front, ranking.salukvadze[0]))
    chosen, owner, distance = farthest_first(points / unit, [start], min(k, len(front)))
    distinct = len(dict.fromkeys(owner.tolist()))  # one that equals an earlier one owns nothing
    farthest = np.zeros(distinct)
    np.maximum.at(farthest, owner, distance * unit)
    shares = np.bincount(owner, minlength=distinct) / len(front)
    return Representatives(ranking, front[chosen[:distinct]], shares, farthest)
