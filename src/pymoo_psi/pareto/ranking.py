"""Ranks of efficiency: a Pareto set contracted to a few subsets worth looking at.

Let P12, P13, P23 be the sets of points that are Pareto optimal, both criteria minimised, in the
pairs (μ1, μ2), (μ1, μ3), (μ2, μ3) of the geometric criteria (:mod:`pymoo_psi.pareto.geometry`).
The rank of efficiency of a Pareto-optimal point is

    Re = 3·[in P23] + 2·[in P13] + 1·[in P12],      0 = unranked.

M6, the points in all three, is the Salukvadze optimum: the points nearest to U. Since
μ1² = μ2² + μ3², P12 and P13 lie inside P23, so that ranks 1 and 2 do not occur.

The paper (Section 5; Cheshankov et al., 2004) names the criteria and the ranks; the formula is
inferred from its tables, all of which it reproduces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi.arguments import (
    Received,
    boolean,
    broken_rule,
    finite_array,
    integer,
    objective_matrix,
)
from pymoo_psi.pareto.dominance import levels, nondominated, nondominated_pair
from pymoo_psi.pareto.geometry import UtopianFrame

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["EfficiencyRanking", "rank_of_efficiency"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EfficiencyRanking:
    """The ranking of the n rows of an objective matrix.

    Attributes:
        criteria: ``(n, 3)`` geometric criteria μ1, μ2, μ3, of the dominated rows too.
        rank: ``(n,)`` rank of efficiency, 0 to 6; dominated rows have rank 0.
        pareto: ``(n,)`` which rows are Pareto optimal.
        frame: The points U and N and the scale in which the criteria are measured.
        salukvadze: Indices of the Salukvadze optimum: the Pareto-optimal rows nearest to U, equal
            up to rounding. They are the rows of rank 6, and there is usually one. Only if several
            rows are equally near to U but differ in μ2 and μ3, as on a sphere around U, is M6
            empty and are they all listed here.
    """

    criteria: Array
    rank: NDArray[np.int64]
    pareto: NDArray[np.bool_]
    frame: UtopianFrame
    salukvadze: NDArray[np.intp]

    @property
    def ideal(self) -> Array:
        """``(m,)`` the point U."""
        return self.frame.ideal

    @property
    def nadir(self) -> Array:
        """``(m,)`` the point N."""
        return self.frame.nadir

    def subset(self, rank: int) -> NDArray[np.intp]:
        """Return the indices of M_rank, the Pareto-optimal rows with this rank, nearest U first."""
        rank = integer("rank", rank, minimum=0)
        if rank > 6:
            raise broken_rule("rank", "0 to 6", rank)
        members = np.flatnonzero(self.pareto & (self.rank == rank))
        return members[np.argsort(self.criteria[members, 0], kind="stable")]

    def to_frame(self, F: ArrayLike, *, names: list[str] | None = None) -> pd.DataFrame:
        """Return a table of the ranked designs, the best rank and the nearest to U first.

        Args:
            F: The ``(n, m)`` objective values that were ranked.
            names: Names of the objectives; f1, f2, … unless given.

        Returns:
            One row per design, its index the row in ``F``; columns: the objectives, ``mu1``,
            ``mu2``, ``mu3``, ``rank``, ``pareto``.

        Raises:
            ArgumentValueError: ``F`` has another shape, or the number of names differs.
        """
        import pandas as pd

        values = objective_matrix("F", F)
        shape = (len(self.rank), len(self.ideal))
        if values.shape != shape:
            raise broken_rule("F", f"of shape {shape}", Received(f"shape {values.shape}"))
        columns = [f"f{j + 1}" for j in range(shape[1])] if names is None else list(names)
        if len(columns) != shape[1]:
            raise broken_rule("names", f"{shape[1]} names", columns)
        frame = pd.DataFrame(values, columns=columns)
        frame[["mu1", "mu2", "mu3"]] = self.criteria
        frame["rank"], frame["pareto"] = self.rank, self.pareto
        order = np.lexsort((self.criteria[:, 0], -self.rank, ~self.pareto))
        return frame.iloc[order]


def rank_of_efficiency(
    F: ArrayLike,
    *,
    normalize: bool = True,
    ideal: ArrayLike | None = None,
    nadir: ArrayLike | None = None,
) -> EfficiencyRanking:
    """Rank the rows of any objective matrix by efficiency.

    Dominated rows get rank 0 and do not move U or N. Values of a criterion that are equal up to
    rounding count as equal, so that rounding noise decides nothing.

    Args:
        F: ``(n, m)`` finite objective values, all minimised; n, m >= 1.
        normalize: Measure each objective in units of its range N − U, which makes the ranks
            independent of the objectives' units. ``False`` measures plain Euclidean distances,
            as the paper does.
        ideal: ``(m,)`` the point U; by default the minimum over the Pareto-optimal rows. It must
            be at least as good as they are.
        nadir: ``(m,)`` the point N; by default the maximum over the Pareto-optimal rows.

    Returns:
        The ranking, its arrays in the order of the rows of ``F``.

    Raises:
        ArgumentValueError: ``F`` has the wrong shape, is empty or holds NaN or infinity; ``ideal``
            or ``nadir`` does not fit.
        ArgumentTypeError: ``F`` does not hold real numbers.

    Example:
        >>> ranking = rank_of_efficiency([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0], [1.0, 1.0]])
        >>> ranking.rank.tolist(), ranking.salukvadze.tolist()
        ([0, 6, 0, 0], [1])
    """
    F = objective_matrix("F", F)
    return ranking_of(F, nondominated(F), normalize=normalize, ideal=ideal, nadir=nadir)


def ranking_of(
    F: Array,
    pareto: NDArray[np.bool_],
    *,
    normalize: bool,
    ideal: ArrayLike | None = None,
    nadir: ArrayLike | None = None,
) -> EfficiencyRanking:
    """Rank the rows of a checked matrix whose Pareto-optimal rows, one or more, are known."""
    normalize = boolean("normalize", normalize)
    front = F[pareto]
    U = front.min(axis=0) if ideal is None else _given_point("ideal", ideal, F.shape[1])
    N = front.max(axis=0) if nadir is None else _given_point("nadir", nadir, F.shape[1])
    _require_order("ideal", "at most the best value of every objective", U, front.min(axis=0))
    _require_order("nadir", "at least the ideal in every objective", -N, -U)
    frame = UtopianFrame(U, N, normalize)

    criteria = frame.distances(F)
    tolerance = frame.rounding(front)
    mu1, mu2, mu3 = (levels(column, tolerance) for column in criteria[pareto].T)
    rank = np.zeros(len(F), dtype=np.int64)
    rank[pareto] = (
        3 * nondominated_pair(mu2, mu3)
        + 2 * nondominated_pair(mu1, mu3)
        + 1 * nondominated_pair(mu1, mu2)
    )
    salukvadze = np.flatnonzero(pareto)[mu1 == 0]
    return EfficiencyRanking(criteria, rank, pareto, frame, salukvadze)


def _given_point(name: str, value: ArrayLike, m: int) -> Array:
    point = finite_array(name, value)
    if point.shape != (m,):
        raise broken_rule(name, f"of shape {(m,)}", Received(f"shape {point.shape}"))
    return point


def _require_order(name: str, rule: str, lower: Array, upper: Array) -> None:
    wrong = np.flatnonzero(lower > upper)
    if len(wrong):
        j = wrong[0]
        shown = f"{abs(lower[j])} against {abs(upper[j])} in objective {j + 1}"
        raise broken_rule(name, rule, Received(shown))
