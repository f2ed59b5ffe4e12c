"""A few designs that stand for a Pareto set."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._output import Shown
from pymoo_psi._validation import integer, invalid
from pymoo_psi.pareto._indicators import farthest_first
from pymoo_psi.pareto._ranking import EfficiencyRanking, front_of, ranking_from

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


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

        Raises:
            ArgumentValueError: An objective is called ``share`` or ``farthest``.

        Example:
            >>> print(representatives([[0, 9], [1, 8], [4, 4], [9, 0]], 3).to_frame().round(2))
                f1   f2  share  farthest
            2  4.0  4.0   0.25      0.00
            0  0.0  9.0   0.50      0.16
            3  9.0  0.0   0.25      0.00
        """
        import pandas as pd

        objectives = self.ranking.objectives.rows(self.rows)
        labels = pd.Index(objectives.labels)
        if taken := [name for name in ("share", "farthest") if name in objectives.names]:
            rule = "named other than share and farthest"
            raise invalid("the objectives", rule, taken[0], "rename the columns of F")
        frame = pd.DataFrame(objectives.values, columns=list(objectives.names), index=labels)
        frame.insert(len(objectives.names), "share", self.shares)
        frame.insert(len(objectives.names) + 1, "farthest", self.farthest)
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
