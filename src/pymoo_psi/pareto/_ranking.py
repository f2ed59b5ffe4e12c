"""Ranks of efficiency: a Pareto set contracted to a few subsets worth looking at.

U is the componentwise minimum (ideal) and N the componentwise maximum (nadir) of a Pareto set.
With d = f − U and e the unit vector from U to N, a point has three geometric criteria (paper,
Section 5):

    μ1 = |d|            the distance to U,
    μ2 = |d − (d·e) e|  the distance to the utopian line UN,
    μ3 = d·e            the distance from U of the projection onto UN,

so that μ1² = μ2² + μ3². Let P12, P13, P23 be the sets of points that are Pareto optimal, both
criteria minimised, in the pairs (μ1, μ2), (μ1, μ3), (μ2, μ3). The rank of efficiency of a
Pareto-optimal point is

    Re = 3·[in P23] + 2·[in P13] + 1·[in P12],      0 = unranked.

M6, the points in all three, is the Salukvadze optimum: the points nearest to U. Since
μ1² = μ2² + μ3², P12 and P13 lie inside P23, so that ranks 1 and 2 do not occur.

The paper (Section 5; Cheshankov et al., 2004) names the criteria and the ranks; the formula is
inferred from its tables, all of which it reproduces.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    Received,
    boolean,
    collection,
    finite_array,
    integer,
    invalid,
    known_name,
    objective_matrix,
    wrong_type,
)
from pymoo_psi.pareto._dominance import (
    LAST_PLACES,
    levels,
    nondominated,
    nondominated_pair,
    settled,
    unit_lengths,
)

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

RANKING_COLUMNS = ("mu1", "mu2", "mu3", "rank", "pareto")
"""The columns that follow the objectives in the frame of a ranking."""


@dataclass(frozen=True, eq=False)
class Objectives:
    """The objective values of n designs in the original units and directions, with their names.

    Attributes:
        values: ``(n, m)`` finite objective values as given; a copy of its own.
        sign: ``(m,)`` 1 for an objective to be minimised, -1 for one to be maximised.
        names: The m column names of a data frame; f1, f2, … for an array.
        labels: The row labels of a data frame; 0, 1, … for an array.
    """

    values: Array
    sign: Array
    names: tuple[Any, ...]
    labels: Any

    @classmethod
    def of(cls, F: Any, maximize: Collection[Any] = ()) -> Objectives:
        """Check and keep objective values.

        Args:
            F: ``(n, m)`` array or data frame, n, m >= 1; the feasible designs of a test table, with
                their names; a ranking; or a result of pymoo, whose ``F`` is minimised.
            maximize: Which are to be maximised, by name or column index from 0.

        Raises:
            ArgumentValueError: The values are not finite, or there is no such objective.
            ArgumentTypeError: The values are not real numbers, or ``maximize`` is no collection.
        """
        collection("maximize", maximize, "a list of objectives", "one goes into a list too")
        if isinstance(F, Objectives):
            return F
        if isinstance(F, EfficiencyRanking) or hasattr(
            F, "feasible_ranking"
        ):  # the latter a test table
            if len(maximize):
                rule = "left out where a table or ranking has directions of its own"
                raise invalid("maximize", rule, list(maximize))
            return (
                F.objectives
                if isinstance(F, EfficiencyRanking)
                else F.feasible_ranking().objectives
            )
        if hasattr(F, "F") and hasattr(F, "opt"):  # a result of pymoo; of one objective it is (1,)
            F = F.F if F.F is None else np.atleast_2d(F.F)
        # A data frame by what it offers, so that arrays do not pay for importing pandas.
        named = all(hasattr(F, name) for name in ("columns", "index", "to_numpy"))
        values = objective_matrix("F", _numbers(F) if named else F).copy()
        n, m = values.shape
        names = tuple(F.columns) if named else tuple(f"f{j + 1}" for j in range(m))
        labels = F.index if named else range(n)
        objectives = cls(values, np.ones(m), names, labels)
        objectives.sign[[objectives.column("maximize", entry) for entry in maximize]] = -1.0
        return objectives

    @property
    def minimized(self) -> Array:
        """``(n, m)`` the values with the sign of those to be maximised turned."""
        return self.values * self.sign

    def original(self, minimized: Array) -> Array:
        """Return ``(..., m)`` minimised values in the original directions."""
        return np.asarray(minimized * self.sign + 0.0)  # no -0.0

    def headings(self, units: Mapping[Any, str]) -> list[str]:
        """Return the names for readers, each with its unit, and "(max)" if it is maximised."""
        return [
            f"{name}{f' [{units[name]}]' if units.get(name) else ''}{' (max)' if sign < 0 else ''}"
            for name, sign in zip(self.names, self.sign.tolist(), strict=True)
        ]

    def column(self, argument: str, entry: Any) -> int:
        """Return the index of an objective that an argument gives by name, or else by index."""
        m, count = len(self.names), self.names.count(entry)
        if count == 1:
            return self.names.index(entry)
        if count == 0 and isinstance(entry, str):
            known_name(argument, entry, [name for name in self.names if isinstance(name, str)])
        if count or integer(argument, entry, minimum=0) >= m:
            raise invalid(argument, f"names that only one column has, or from 0 to {m - 1}", entry)
        return int(entry)

    def rows(self, indices: NDArray[np.intp]) -> Objectives:
        """Return the same objectives of some of the designs."""
        labels = [self.labels[i] for i in indices.tolist()]
        return Objectives(self.values[indices], self.sign, self.names, labels)

    def turned(self, name: str, value: ArrayLike) -> Array:
        """Return a point in the original directions as one that is minimised."""
        point = finite_array(name, value)
        if point.shape != self.sign.shape:
            raise invalid(name, f"of shape {self.sign.shape}", Received(f"shape {point.shape}"))
        return point * self.sign


def _numbers(frame: Any) -> Array:
    """Return the values of a data frame; a missing value is NaN."""
    for name, dtype in zip(frame.columns, frame.dtypes, strict=True):
        # Nothing is converted: text, dates and objects are no numbers until the user says so.
        if getattr(dtype, "kind", "O") not in "fiub":
            remedy = f"give F[[...]], the objectives; F.set_index({name!r}) names the designs"
            found = Received(f"dtype {dtype}")
            raise wrong_type(f"column {name!r} of F", "of real numbers", found, remedy)
    return np.asarray(frame.to_numpy(dtype=np.float64, na_value=np.nan))


@dataclass(frozen=True, eq=False, repr=False)
class EfficiencyRanking(Shown):
    """The ranking of the n rows of an objective matrix.

    Attributes:
        criteria: ``(n, 3)`` geometric criteria μ1, μ2, μ3, of the dominated rows too.
        rank: ``(n,)`` rank of efficiency, 0 to 6; dominated rows have rank 0.
        pareto: ``(n,)`` which rows are Pareto optimal.
        frame: The points U and N and the scale in which the criteria are measured, all objectives
            minimised.
        objectives: What was ranked, in the original units and directions, with names and labels.
        salukvadze: Indices of the Salukvadze optimum: the Pareto-optimal rows nearest to U, equal
            up to rounding. They are the rows of rank 6, and there is usually one. Only if several
            rows are equally near to U but differ in μ2 and μ3, as on a sphere around U, is M6
            empty and are they all listed here.
        rows: ``(n,)`` the rows of the table or array that are ranked; 0, 1, … for an array, of
            which all rows are.

    Example:
        The last row is dominated; of the others, the second is nearest to U = (0, 0).

        >>> ranking = rank_of_efficiency([[0, 4], [1, 1], [4, 0], [4, 4]])
        >>> ranking.pareto.tolist(), ranking.salukvadze.tolist()
        ([True, True, True, False], [1])
    """

    criteria: Array
    rank: NDArray[np.int64]
    pareto: NDArray[np.bool_]
    frame: UtopianFrame
    salukvadze: NDArray[np.intp]
    objectives: Objectives
    rows: NDArray[np.intp]

    def __repr__(self) -> str:
        """Return how much is ranked and which design is the best."""
        n, m = self.objectives.values.shape
        size = f"{n} designs by {m} objectives: {self.pareto.sum()} Pareto optimal"
        return f"EfficiencyRanking({size}, the best is {self.name_of(int(self.salukvadze[0]))})"

    def name_of(self, row: int) -> str:
        """Return what sentences call a design: its label if that is a text, else "design 3".

        Example:
            >>> rank_of_efficiency([[1, 4], [2, 2], [4, 1]]).name_of(2)
            'design 2'
        """
        label = self.objectives.labels[row]
        return label if isinstance(label, str) else f"design {label}"

    @property
    def ideal(self) -> Array:
        """``(m,)`` the point U in the original directions.

        Example:
            >>> rank_of_efficiency([[1, 4], [2, 2], [4, 1]]).ideal
            array([1., 1.])
        """
        return self.objectives.original(self.frame.ideal)

    @property
    def nadir(self) -> Array:
        """``(m,)`` the point N in the original directions.

        Example:
            The dominated row does not count.

            >>> rank_of_efficiency([[1, 4], [2, 2], [4, 1], [9, 9]]).nadir
            array([4., 4.])
        """
        return self.objectives.original(self.frame.nadir)

    def subset(self, rank: int) -> NDArray[np.intp]:
        """Return the indices of M_rank, the Pareto-optimal rows with this rank, nearest U first.

        Example:
            >>> ranking = rank_of_efficiency([[1, 4], [2, 2], [4, 1], [9, 9]])
            >>> ranking.subset(6), ranking.subset(0)
            (array([1]), array([0, 2]))
        """
        members = np.flatnonzero(self.pareto & (self.rank == rank))
        return members[np.argsort(self.criteria[members, 0], kind="stable")]

    def to_frame(self, *, names: Sequence[Any] | None = None) -> pd.DataFrame:
        """Return a table of the ranked designs, the best rank and the nearest to U first.

        Args:
            names: Names of the objectives; by default those of the data frame that was ranked,
                or f1, f2, ….

        Returns:
            One row per design, its index its row, or the label of the row in the data
            frame that was ranked; columns: the objectives, ``mu1``, ``mu2``, ``mu3``, ``rank``,
            ``pareto``.

        Raises:
            ArgumentValueError: The number of names differs, or an objective has the name of
                another one or of one of the other columns.

        Example:
            >>> ranking = rank_of_efficiency([[1, 5], [3, 3], [5, 1]])
            >>> print(ranking.to_frame(names=["cost", "mass"]).round(2))
               cost  mass   mu1   mu2   mu3  rank  pareto
            1   3.0   3.0  0.71  0.00  0.71     6    True
            0   1.0   5.0  1.00  0.71  0.71     0    True
            2   5.0   1.0  1.00  0.71  0.71     0    True
        """
        import pandas as pd

        objectives, m = self.objectives, len(self.objectives.names)
        columns = list(objectives.names if names is None else names)
        if len(columns) != m or len({*columns, *RANKING_COLUMNS}) < m + 5:
            rule = f"{m} different names other than {', '.join(RANKING_COLUMNS)}"
            raise invalid("names", rule, columns, "give others by names=[...]")
        frame = pd.DataFrame(objectives.values, columns=columns, index=pd.Index(objectives.labels))
        frame[["mu1", "mu2", "mu3"]] = self.criteria
        frame["rank"], frame["pareto"] = self.rank, self.pareto
        return frame.iloc[self.order]

    @property
    def order(self) -> NDArray[np.intp]:
        """``(n,)`` indices, the best rank and the nearest to U first, the dominated rows last.

        Example:
            >>> rank_of_efficiency([[9, 9], [1, 4], [2, 2], [4, 1]]).order
            array([2, 1, 3, 0])
        """
        return np.lexsort((self.criteria[:, 0], -self.rank, ~self.pareto))


def rank_of_efficiency(
    F: Any,
    *,
    normalize: bool = True,
    ideal: ArrayLike | None = None,
    nadir: ArrayLike | None = None,
    maximize: Collection[Any] = (),
) -> EfficiencyRanking:
    """Rank the rows of any objective matrix by efficiency.

    Dominated rows get rank 0 and do not move U or N. Values of a criterion that are equal up to
    rounding count as equal, so that rounding noise decides nothing.

    Args:
        F: ``(n, m)`` finite objective values, minimised unless ``maximize`` says otherwise; n,
            m >= 1. Of a pandas data frame the names of columns and rows are kept. Or a result of
            pymoo; or a test table or ranking, which have directions of their own: of a table the
            feasible designs are taken, called by their ``names``.
        normalize: Measure each objective in units of its range N − U, which makes the ranks
            independent of the objectives' units. ``False`` measures plain Euclidean distances,
            as the paper does.
        ideal: ``(m,)`` the point U, in the directions of ``F``; by default the best values over
            the Pareto-optimal rows. It must be at least as good as they are.
        nadir: ``(m,)`` the point N, as for ``ideal``; by default the worst values over the
            Pareto-optimal rows.
        maximize: The objectives to be maximised: column indices from 0 or, of a data frame, names.
            ``F`` holds their own values. pymoo's ``res.F`` holds them negative, and is ranked as
            it is; for names and signs of your own rank
            ``pd.DataFrame(res.F * [1, -1], columns=["cost", "yield"])``.

    Returns:
        The ranking, its arrays in the order of the rows of ``F``.

    Raises:
        ArgumentValueError: ``F`` has the wrong shape, is empty or holds NaN or infinity; ``ideal``
            or ``nadir`` does not fit; ``maximize`` names no objective.
        ArgumentTypeError: ``F`` does not hold real numbers.

    Example:
        >>> ranking = rank_of_efficiency([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0], [1.0, 1.0]])
        >>> ranking.rank.tolist(), ranking.salukvadze.tolist()
        ([0, 6, 0, 0], [1])

        >>> import pandas as pd
        >>> F = pd.DataFrame({"cost": [1, 2, 5], "yield": [10, 30, 40]}, index=["A", "B", "C"])
        >>> rank_of_efficiency(F, maximize=["yield"]).to_frame().round(2)
           cost  yield   mu1   mu2   mu3  rank  pareto
        B   2.0   30.0  0.42  0.06  0.41     6    True
        A   1.0   10.0  1.00  0.71  0.71     0    True
        C   5.0   40.0  1.00  0.71  0.71     0    True
    """
    objectives = Objectives.of(F, maximize)
    pareto = nondominated(objectives.minimized)
    return ranking_of(objectives, pareto, normalize=normalize, ideal=ideal, nadir=nadir)


def ranking_of(
    objectives: Objectives,
    pareto: NDArray[np.bool_],
    *,
    normalize: bool,
    ideal: ArrayLike | None = None,
    nadir: ArrayLike | None = None,
    rows: ArrayLike | None = None,
) -> EfficiencyRanking:
    """Return :func:`rank_of_efficiency` of objectives whose Pareto-optimal rows are known.

    Args:
        objectives: What is ranked.
        pareto: ``(n,)`` which of its designs are Pareto optimal.
        normalize: As for :func:`rank_of_efficiency`.
        ideal: As for :func:`rank_of_efficiency`.
        nadir: As for :func:`rank_of_efficiency`.
        rows: ``(n,)`` which rows of a table the designs are; 0 to n - 1 by default.
    """
    normalize = boolean("normalize", normalize)
    F = objectives.minimized
    F[pareto] = front = settled(F[pareto])
    best, worst = front.min(axis=0), front.max(axis=0)
    U = best if ideal is None else objectives.turned("ideal", ideal)
    N = worst if nadir is None else objectives.turned("nadir", nadir)
    if (best < U).any():
        rule = f"no worse than the best value of {objectives.names[int(np.argmax(best < U))]!r}"
        raise invalid("ideal, or the better end of ranges,", rule, ideal, "leave it out")
    if (N < U).any():
        raise invalid("nadir", "no better than the ideal", nadir)
    with np.errstate(over="ignore"):
        if not np.isfinite(N - U).all():
            raise invalid("F", "of finite range", Received(f"{U} to {N}"))
    frame = UtopianFrame(U, N, normalize)

    measured, units = frame.measured(F)
    mu1, mu2, mu3 = map(levels, measured[pareto].T, frame.noise(front, units))
    p12 = nondominated_pair(mu1, mu2, mu3)
    p13 = nondominated_pair(mu1, mu3, mu2)
    # P12 and P13 lie inside P23, since μ1² = μ2² + μ3². Levels know this only up to their
    # tolerance; without it, ranks 1 and 2 would occur.
    p23 = nondominated_pair(mu2, mu3, mu1) | p12 | p13
    rank = np.zeros(len(F), dtype=np.int64)
    rank[pareto] = 3 * p23 + 2 * p13 + 1 * p12
    salukvadze = np.flatnonzero(pareto)[mu1 == 0]
    with np.errstate(over="ignore"):  # a dominated design may be infinitely far
        criteria = measured * units
    ranked = np.asarray(np.arange(len(F)) if rows is None else rows, dtype=np.intp)
    return EfficiencyRanking(criteria, rank, pareto, frame, salukvadze, objectives, ranked)


def ranking_from(F: Any, normalize: bool, maximize: Collection[Any]) -> EfficiencyRanking:
    """Return F if it is a ranking, or else the ranking of F."""
    if isinstance(F, EfficiencyRanking):
        return F
    return rank_of_efficiency(F, normalize=normalize, maximize=maximize)


def measured_in(ranking: EfficiencyRanking) -> str:
    """Return in what the distances of a ranking are measured, as a sentence without its end."""
    if ranking.frame.normalize:
        return "Normalised: distances in units of the ranges"
    return "Not normalised: plain distances, as in the paper"


def front_of(ranking: EfficiencyRanking) -> tuple[NDArray[np.intp], Array]:
    """Return the Pareto-optimal rows, and their objectives, minimised and settled."""
    front, objectives = np.flatnonzero(ranking.pareto), ranking.objectives
    return front, settled(objectives.values[front] * objectives.sign)


class UtopianFrame:
    """The points U and N and the scale in which distances are measured.

    Attributes:
        ideal: ``(m,)`` the positive utopian point U.
        nadir: ``(m,)`` the negative utopian point N, nowhere below U.
        normalize: Measure every objective in units of N − U; an objective with N = U, which
            tells no design from another, then counts for nothing.
        scale: ``(m,)`` the length by which each objective is divided.
        line: ``(m,)`` the way from U to N in the scale; 0 in a constant objective.
    """

    def __init__(self, ideal: Array, nadir: Array, normalize: bool) -> None:
        self.ideal, self.nadir, self.normalize = ideal, nadir, normalize
        lengths = unit_lengths(ideal, nadir)
        self._varying = np.isfinite(lengths)
        self.scale = lengths if normalize else np.ones_like(ideal)
        self.line: Array = np.where(self._varying, nadir - ideal, 0.0) / self.scale
        line = self.line / (self.line.max() or 1.0)
        self._direction: Array = line / (np.linalg.norm(line) or 1.0)  # e, or zero if N = U

    def scaled(self, F: Array) -> Array:
        """Return ``(n, m)`` points as d = f − U in the scale; if normalised, N is at 1."""
        return np.asarray((F - self.ideal) / self.scale)

    def distances(self, F: Array) -> Array:
        """Return the ``(n, 3)`` criteria (μ1, μ2, μ3) of the ``(n, m)`` points ``F``."""
        measured, units = self.measured(F)
        return measured * units

    def measured(self, F: Array) -> tuple[Array, Array]:
        """Return the criteria of points in units in which no square over- or underflows.

        Args:
            F: ``(n, m)`` points.

        Returns:
            ``(n, 3)`` criteria μ1, μ2, μ3 and the ``(3,)`` units by which to multiply them.
        """
        longest = int(self.line.argmax())
        e = self._direction
        with np.errstate(over="ignore", invalid="ignore"):  # far outside UN: an infinite distance
            d, line = self.scaled(F), self.line
            unit = float(line[longest] or np.abs(d[np.isfinite(d)]).max(initial=0.0) or 1.0)
            across_unit = float(np.delete(line, longest).max(initial=0.0) or unit)
            # Off the line UN. Where objectives differ much in size, d − (d·e) e would drown the
            # small ones in the rounding error of the large one. Here the point of the line with
            # the same value of the largest is taken away first, and no objective's difference
            # meets another's.
            across = d - (d[:, longest] / unit)[:, None] * line
            across -= (across @ e)[:, None] * e
            d /= unit
            criteria = [_row_norm(d), _row_norm(across / across_unit), d @ e]
            measured = np.column_stack(criteria)
        measured[np.isnan(measured)] = np.inf
        return measured, np.array([unit, across_unit, unit])

    def noise(self, F: Array, units: Array) -> Array:
        """Bound the rounding errors of the ``(3,)`` criteria of the ``(n, m)`` points ``F``.

        An error in one objective moves a point along its axis. μ3 feels the part of it along UN,
        μ2 that across, and μ1 all of it at most.

        Args:
            F: The points.
            units: ``(3,)`` the units of the criteria, from :meth:`measured`.
        """
        e2 = self._direction**2
        across = np.sqrt([np.delete(e2, j).sum() for j in range(len(e2))])  # not 1 − e2: it cancels
        parts = np.array([np.ones_like(e2), across, self._direction])
        bounds = np.hypot.reduce(parts * self.sizes(F) / units[:, None], axis=1)
        return np.asarray(LAST_PLACES * bounds)

    def sizes(self, F: Array) -> Array:
        """Return ``(m,)`` how large values are in the scale: ``LAST_PLACES`` of it is noise."""
        size = np.maximum(np.abs(F).max(axis=0), np.maximum(abs(self.ideal), abs(self.nadir)))
        return np.where(self._varying, size / self.scale, 0.0)


def _row_norm(rows: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", rows, rows)))
