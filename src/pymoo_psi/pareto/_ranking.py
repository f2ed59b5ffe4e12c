"""Ranks of efficiency: a few small subsets of a Pareto set that are worth a look.

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

Most points are unranked, so that ranks are no order of a set. The place of a Pareto-optimal point
is: 1 plus the number of Pareto-optimal points that are nearer to U. Points that are equally near,
up to rounding, share a place, and the places after it are left out: 1, 2, 2, 4. The Salukvadze
optimum has place 1.

The paper (Section 5; Cheshankov et al., 2004) names the criteria and the ranks; the formula is
inferred from its tables, all of which it reproduces.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._numbers import decimals_as_given
from pymoo_psi._output import Shown, with_unit
from pymoo_psi._validation import (
    Array,
    Mask,
    Received,
    Rows,
    boolean,
    counted,
    finite_array,
    integer,
    invalid,
    known_name,
    mapping,
    name_list,
    objective_matrix,
    require_shape,
    source_type,
    wrong_type,
)
from pymoo_psi.pareto._dominance import (
    LAST_PLACES,
    NOISE,
    Levels,
    levels,
    nondominated,
    nondominated_pair,
    unit_lengths,
    without_rounding,
)

if TYPE_CHECKING:
    import pandas as pd


RANKING_COLUMNS = ("place", "mu1", "mu2", "mu3", "efficiency_rank", "pareto")
"""The columns beside the objectives in the frame of a ranking; the place is the first column."""


# The geometry


class UtopianFrame:
    """The points U and N and the scale in which distances are measured.

    Attributes:
        ideal: ``(m,)`` the positive utopian point U.
        nadir: ``(m,)`` the negative utopian point N, nowhere below U.
        normalize: Measure every objective in units of N − U; an objective with N = U does not
            distinguish designs and has no weight.
        is_fixed: Whether U or N is given, so that it stays where it is without any design.
        lengths: ``(m,)`` the ranges N − U; infinite for an objective with N = U.
        scale: ``(m,)`` the length by which each objective is divided.
        line: ``(m,)`` the vector from U to N in the scale; 0 in a constant objective.
    """

    def __init__(
        self, ideal: Array, nadir: Array, normalize: bool, *, is_fixed: bool = False
    ) -> None:
        self.ideal = ideal
        self.nadir = nadir
        self.normalize = normalize
        self.is_fixed = is_fixed
        self.lengths: Array = unit_lengths(ideal, nadir)
        self.scale: Array = np.ones_like(ideal)
        if normalize:
            self.scale = self.lengths
        self.line: Array = np.where(np.isfinite(self.lengths), nadir - ideal, 0.0) / self.scale
        line = self.line / (self.line.max() or 1.0)
        self._direction = line / (np.linalg.norm(line) or 1.0)  # e, or zero if N = U

    def around(self, front: Array) -> UtopianFrame:
        """Return the frame of another ``(k, m)`` Pareto set: this one if its points are fixed."""
        if self.is_fixed:
            return self
        return UtopianFrame(front.min(axis=0), front.max(axis=0), self.normalize)

    def limited(self, F: Array) -> Array:
        """Return ``(n, m)`` points; where one is better than a fixed U, it counts as equal to U."""
        if self.is_fixed:
            return np.maximum(F, self.ideal)
        return F

    def scaled(self, F: Array) -> Array:
        """Return ``(n, m)`` points as d = f − U in the scale; if normalised, N is at 1."""
        d = self.limited(F) - self.ideal
        d /= self.scale
        return d

    def behind(self, F: Array) -> Array:
        """Return by how much ``(n, m)`` points are worse than U, in units of the objectives.

        It is 0 for what is better than a fixed U, or equal to it but for rounding.
        """
        behind = F - self.ideal
        behind[behind <= NOISE * np.abs(self.ideal)] = 0.0
        return behind

    def shares(self, differences: Array) -> Array:
        """Return ``(n, m)`` differences of points as shares of N − U; NaN of a range of 0."""
        shares = differences / self.lengths + 0.0  # no -0.0
        shares[np.isinf(self.lengths) & (differences != 0)] = np.nan
        return shares

    def distances(self, F: Array) -> Array:
        """Return the ``(n,)`` distances of ``(n, m)`` points to U, the criterion μ1."""
        with np.errstate(over="ignore", invalid="ignore"):  # far outside UN: an infinite distance
            distances = self._lengths(self.scaled(F))
        distances[np.isnan(distances)] = np.inf
        return distances

    def measured(self, F: Array) -> Array:
        """Return the ``(n, 3)`` criteria μ1, μ2, μ3 of ``(n, m)`` points."""
        e = self._direction
        longest = self.line.argmax()
        with np.errstate(over="ignore", invalid="ignore"):  # as above
            d = self.scaled(F)
            # Off the line UN. Where objectives differ much in size, d − (d·e) e would drown the
            # small ones in the rounding error of the large one. Here the point of the line with
            # the same value of the largest is subtracted first, and no objective's difference
            # meets another's.
            across = d - (d[:, longest] / (self.line[longest] or 1.0))[:, None] * self.line
            across -= (across @ e)[:, None] * e
            measured = np.array([self._lengths(d), self._lengths(across), d @ e]).T
        measured[np.isnan(measured)] = np.inf
        return measured

    def noise(self, F: Array) -> Array:
        """Bound the rounding errors of the ``(3,)`` criteria of the ``(n, m)`` points ``F``.

        An error in one objective moves a point along its axis. The part of it along UN is an error
        of μ3, the part across UN one of μ2; the error of μ1 is at most all of it.
        """
        e2 = self._direction**2
        across = np.sqrt([np.delete(e2, j).sum() for j in range(len(e2))])  # not 1 − e2: it cancels
        parts = np.array([np.ones_like(e2), across, self._direction])
        return np.asarray(np.hypot.reduce(LAST_PLACES * parts * self.sizes(F), axis=1))

    def sizes(self, F: Array) -> Array:
        """Return ``(m,)`` the size of values in the scale: ``LAST_PLACES`` of it is noise."""
        ends = np.maximum(np.abs(self.ideal), np.abs(self.nadir))
        size = np.maximum(np.abs(F).max(axis=0), ends)
        return np.where(np.isfinite(self.lengths), size / self.scale, 0.0)

    def _lengths(self, d: Array) -> Array:
        if self.normalize:
            return np.asarray(np.sqrt(np.einsum("ij,ij->i", d, d)))
        return np.asarray(np.hypot.reduce(d, axis=1))  # slow, but no square over- or underflows


# The objective values that are ranked


@dataclass(frozen=True, eq=False)
class Objectives:
    """The objective values of n designs in the original units and directions, with their names.

    Attributes:
        values: ``(n, m)`` finite objective values in the original directions; a copy.
        sign: ``(m,)`` 1 for an objective to be minimised, -1 for one to be maximised.
        names: The m column names of a data frame; f1, f2, … for an array.
        labels: The row labels of a data frame, where several rows have one with the number of the
            row from 1 appended; the names of the designs of a table; 0, 1, … for an array.
        numbers: The n numbers of the tests of a table, or of the rows of an array, from 0; none if
            a data frame has other labels.
        units: Units by name, those of a table.
        decimal: The decimal mark of a table, with which sentences and figures write numbers.
    """

    values: Array
    sign: Array
    names: tuple[Any, ...]
    labels: Any
    numbers: Sequence[int] = ()
    units: Mapping[Any, str] = field(default_factory=dict)
    decimal: str = "."

    @classmethod
    def of(cls, F: Any, maximize: Collection[Any] = ()) -> Objectives:
        """Return the objective values of any source, checked.

        Args:
            F: ``(n, m)`` array or data frame, n, m >= 1; or a result of pymoo, whose ``F`` is
                minimised.
            maximize: Which are to be maximised, by name or column index from 0.

        Raises:
            ArgumentValueError: The values are not finite, or there is no such objective.
            ArgumentTypeError: The values are not real numbers, or ``maximize`` is no collection.
        """
        name_list("maximize", maximize)
        kind = source_type(F)
        matrix = F
        if kind == "frame":
            matrix = _numbers(F)
        elif kind == "result":
            matrix = _objectives_of_result(F)
        values = objective_matrix("F", matrix).copy()
        n, m = values.shape
        numbers = range(n)
        names = [f"f{j + 1}" for j in range(m)]
        labels = numbers
        if kind == "frame":
            names = F.columns
            labels = F.index
            if labels.tolist() != list(numbers):  # an integer may be a label or a row
                numbers = range(0)
            if labels.has_duplicates:
                import pandas as pd

                unique = unique_names(labels.tolist(), range(1, n + 1))
                labels = pd.Index(unique, name=labels.name)
        objectives = cls(values, np.ones(m), tuple(names), labels, numbers)
        for entry in maximize:
            objectives.sign[objectives.column("maximize", entry)] = -1.0
        return objectives

    @property
    def minimized(self) -> Array:
        """``(n, m)`` the values with the sign of those to be maximised turned."""
        return self.values * self.sign

    def original(self, minimized: Array) -> Array:
        """Return ``(..., m)`` minimised values in the original directions."""
        return minimized * self.sign + 0.0  # no -0.0

    def headings(self) -> list[str]:
        """Return the names for readers, each with its unit, and "(max)" if it is maximised."""
        headings = []
        for name, sign in zip(self.names, self.sign.tolist(), strict=True):
            heading = with_unit(str(name), self.units.get(name, ""))
            if sign < 0:
                heading += " (max)"
            headings.append(heading)
        return headings

    def column(self, argument: str, entry: Any) -> int:
        """Return the index of an objective that an argument gives by name, or else by index."""
        if isinstance(entry, str) and entry not in self.names:
            known_name(argument, entry, [*map(str, self.names)])
        count = self.names.count(entry)
        if count == 1:
            return self.names.index(entry)
        last = len(self.names) - 1
        if count > 1 or integer(argument, entry, minimum=0) > last:
            raise invalid(argument, f"names that only one column has, or from 0 to {last}", entry)
        return int(entry)

    def in_order(self, argument: str, values: Any) -> Any:
        """Return values in the order of the objectives, where a mapping or a series names these."""
        if not hasattr(values, "keys") or not {*self.names} & {*values.keys()}:
            return values
        if not {*self.names} <= {*values.keys()}:
            raise invalid(
                argument, f"values of {', '.join(map(str, self.names))}", [*values.keys()]
            )
        return [values[name] for name in self.names]

    def turned(self, name: str, value: ArrayLike) -> Array:
        """Return a point in the original directions with all objectives minimised."""
        point = finite_array(name, self.in_order(name, value))
        require_shape(name, point, self.sign.shape)
        return point * self.sign


def unique_names(names: Iterable[Any], numbers: Sequence[int]) -> list[Any]:
    """Return names of designs, those that several designs share with their numbers appended."""
    unique = list(names)
    count = Counter(map(str, unique))
    for row, name in enumerate(unique):
        text = str(name)
        if count[text] > 1:
            while text in count:  # "A #1" may itself be the name of another design
                text = f"{text} #{numbers[row]}"
            unique[row] = text
    return unique


def row_of_design(design: int | str, numbers: Iterable[int], *names: Iterable[Any]) -> int:
    """Return the row of a design.

    Args:
        design: An integer, one of the numbers; or a text, one of the names.
        numbers: Numbers of the designs; none if an integer may mean several designs.
        names: Names of the designs. The first of these lists that has the text once decides.

    Raises:
        ArgumentValueError: It is no design, or several have this name.
        ArgumentTypeError: It is neither an integer nor a text.
    """
    groups = names
    remedy = ""
    if not isinstance(design, str):
        integer("design", design, minimum=0)
        groups = (numbers,)
        remedy = "of labelled designs give the name, or row="
    for group in groups:
        texts = list(map(str, group))
        if texts.count(str(design)) == 1:
            return texts.index(str(design))
    rule = "the name of one design as a text, or the number of a test, or row"
    raise invalid("design", rule, design, remedy)


def _objectives_of_result(result: Any) -> Any:
    """Return the ``(n, m)`` objectives of a result of pymoo, whose designs must be feasible."""
    violation = getattr(result, "CV", None)
    if violation is not None and np.any(violation > 0):
        rule = "a result of pymoo with feasible designs"
        remedy = "read_table(result) states what they violate"
        raise invalid("F", rule, Received("infeasible ones"), remedy)
    return np.atleast_2d(result.F)  # (m,) for an algorithm of one objective


def _numbers(frame: Any) -> Array:
    """Return the values of a data frame; a missing value is NaN."""
    for name, dtype in frame.dtypes.items():
        # Nothing is converted: truth values, texts and dates are no numbers until the user says so.
        if getattr(dtype, "kind", "O") not in "fiu":
            received = Received(f"dtype {dtype}")
            named = f"F.set_index({name!r}), or read_table(F), names the designs"
            remedy = f"give F[[...]], the objectives; {named}"
            raise wrong_type(f"column {name!r} of F", "of real numbers", received, remedy)
    return np.asarray(frame.to_numpy(dtype=np.float64, na_value=np.nan))


# The ranking


@dataclass(frozen=True, eq=False, repr=False)
class EfficiencyRanking(Shown):
    """The ranking of the n rows of an objective matrix.

    Attributes:
        criteria: ``(n, 3)`` geometric criteria μ1, μ2, μ3, for the dominated rows too.
        place: ``(n,)`` 1 plus the number of Pareto-optimal rows that are nearer to U; rows that are
            equally near, up to rounding, share a place. Dominated rows have none, which is 0 here.
        rank: ``(n,)`` rank of efficiency, 0 to 6: 6 for place 1, 0 for dominated rows.
        pareto: ``(n,)`` which rows are Pareto optimal.
        frame: The points U and N and the scale in which the criteria are measured, all objectives
            minimised.
        objectives: The ranked values, in the original units and directions, with names and labels.
        salukvadze: Indices of the Salukvadze optimum: the Pareto-optimal rows nearest to U, equal
            up to rounding. They are the rows of place 1, and there is usually one. Their rank is
            6, unless several rows are equally near to U but differ in μ2 and μ3, as on a sphere
            around U: then M6 is empty.
        rows: ``(n,)`` the rows of the table or array that are ranked; 0, 1, … for an array, of
            which all rows are.
        optimal: ``(k, m)`` objectives of the Pareto-optimal rows, minimised, in which values that
            are equal up to rounding are the same.
        measured_by: Another ranking with the frame of this one, with whose decimals differences
            are written; None if both are its own.

    Example:
        The last row is dominated; of the others, the second is nearest to U = (0, 0).

        >>> ranking = rank_of_efficiency([[0, 4], [1, 1], [4, 0], [4, 4]])
        >>> ranking.place.tolist(), ranking.salukvadze.tolist()
        ([2, 1, 2, 0], [1])
    """

    criteria: Array
    place: NDArray[np.int64]
    rank: NDArray[np.int64]
    pareto: Mask
    frame: UtopianFrame
    salukvadze: Rows
    objectives: Objectives
    rows: Rows
    optimal: Array
    measured_by: EfficiencyRanking | None = None

    @property
    def lengths(self) -> Array:
        """``(m,)`` ranges of which shares are given; infinite for an objective that is constant.

        They are the ranges of the Pareto-optimal designs, or the fixed ones.

        Example:
            >>> rank_of_efficiency([[0, 4], [1, 1], [4, 0]]).lengths
            array([4., 4.])
        """
        return self.frame.lengths

    @cached_property
    def front(self) -> Rows:
        """``(k,)`` indices of the Pareto-optimal rows."""
        return np.flatnonzero(self.pareto)

    @cached_property
    def decimals(self) -> list[int]:
        """For each objective the decimals, at most three, of its Pareto-optimal values; else 0."""
        if self.measured_by is not None:
            return self.measured_by.decimals
        return [decimals_as_given(values) for values in self.objectives.values[self.front].T]

    def __repr__(self) -> str:
        """Return the numbers of designs and objectives, and the best design."""
        n, m = self.objectives.values.shape
        best = self.name_of(int(self.salukvadze[0]))
        size = f"{counted(n, 'design')} by {counted(m, 'objective')}"
        return f"EfficiencyRanking({size}: {self.pareto.sum()} Pareto optimal, the best is {best})"

    def name_of(self, row: int) -> str:
        """Return the name of a design in sentences: its label if that is a text, else "design 3".

        If the index of the labels has a name, such as ``test``, it is "test 3".

        Example:
            >>> rank_of_efficiency([[1, 4], [2, 2], [4, 1]]).name_of(2)
            'design 2'
        """
        label = self.objectives.labels[row]
        if isinstance(label, str):
            return label
        word = getattr(self.objectives.labels, "name", None) or "design"
        return f"{word} {label}".replace("_", " ")

    def row_of(self, design: int | str) -> int:
        """Return the row of a design by its label or by the number of its test.

        Args:
            design: A label as a text; or an integer: the number of a test in the ranking of a
                table, the row in the ranking of an array.

        Raises:
            ArgumentValueError: There is no such design, or an integer may be a label or a row.
            ArgumentTypeError: It is neither an integer nor a text.

        Example:
            >>> import pandas as pd
            >>> ranking = rank_of_efficiency(pd.DataFrame({"cost": [1, 2]}, index=["A", "B"]))
            >>> ranking.row_of("B")
            1
        """
        return row_of_design(design, self.objectives.numbers, self.objectives.labels)

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

    def subset(self, rank: int) -> Rows:
        """Return the indices of M_rank, the Pareto-optimal rows with this rank, nearest U first.

        Example:
            >>> ranking = rank_of_efficiency([[1, 4], [2, 2], [4, 1], [9, 9]])
            >>> ranking.subset(6), ranking.subset(0)
            (array([1]), array([0, 2]))
        """
        if rank not in (0, 3, 4, 5, 6):
            raise invalid("rank", "0, 3, 4, 5 or 6", rank)
        rows = self.by_place
        return np.asarray(rows[self.pareto[rows] & (self.rank[rows] == rank)])

    def to_frame(self) -> pd.DataFrame:
        """Return a table of the ranked designs by place, the dominated ones last.

        Returns:
            One row per design, in the order of :attr:`by_place`, its index the label of the design
            in the data frame or table that was ranked, or its row in the array; columns: ``place``,
            missing for dominated designs, the objectives, ``mu1``, ``mu2``, ``mu3`` (missing for
            them where no range has a length), ``efficiency_rank``, ``pareto``.

        Raises:
            ArgumentValueError: An objective has the name of another one or of one of the other
                columns.

        Example:
            >>> ranking = rank_of_efficiency([[1, 5], [3, 3], [5, 1]])
            >>> print(ranking.to_frame().drop(columns="mu2").round(2))
               place   f1   f2   mu1   mu3  efficiency_rank  pareto
            1      1  3.0  3.0  0.71  0.71                6    True
            0      2  1.0  5.0  1.00  0.71                0    True
            2      2  5.0  1.0  1.00  0.71                0    True
        """
        names = self.objectives.names
        columns = (*names, *RANKING_COLUMNS)
        if len({*columns}) < len(columns):
            rule = f"different names other than {', '.join(RANKING_COLUMNS)}"
            raise invalid("objectives", rule, list(names), "rename columns of the frame")
        values = dict(zip(names, self.objectives.values.T, strict=True))
        return ranking_frame(self, values, self.objectives.labels)

    @property
    def by_place(self) -> Rows:
        """``(n,)`` indices by place, equal ones in their order; then the dominated rows by μ1.

        Example:
            >>> rank_of_efficiency([[9, 9], [1, 4], [2, 2], [4, 1]]).by_place
            array([2, 1, 3, 0])
        """
        distance = np.where(self.pareto, 0.0, self.criteria[:, 0])
        return np.lexsort((distance, self.place, ~self.pareto))


def rank_of_efficiency(
    F: Any,
    *,
    normalize: bool | None = None,
    ideal: ArrayLike | None = None,
    nadir: ArrayLike | None = None,
    maximize: Collection[Any] = (),
) -> EfficiencyRanking:
    """Rank the rows of any objective matrix by efficiency.

    The attribute ``place`` orders the Pareto-optimal rows; ``rank`` is the number of the paper.
    Dominated rows have no place, and do not affect U or N. Values of a criterion that are equal up
    to rounding count as equal.

    Args:
        F: ``(n, m)`` finite objective values, minimised unless ``maximize`` says otherwise; n, m >=
            1. A pandas data frame keeps the names of its columns and rows; rows that share a name
            get their number appended, "A #2" for the second row. A result of pymoo, a ranking and a
            test table work, too. Rankings and tables have their own directions; only the feasible
            designs of a table are ranked.
        normalize: Measure each objective in units of its range N − U, which makes the ranks
            independent of the objectives' units. ``False`` measures plain Euclidean distances,
            as the paper does. By default ``True``, or as the ranking or table has it.
        ideal: ``(m,)`` the point U, in the directions of ``F``, or by name; by default the fixed
            one of a ranking or table, or the best values over the Pareto-optimal rows. Rows that
            are better than it in an objective count as equal to it there.
        nadir: ``(m,)`` the point N, as for ``ideal``; by default the worst values over the
            Pareto-optimal rows.
        maximize: The objectives to be maximised: column indices from 0, or names of columns of a
            data frame. ``F`` contains their own values. pymoo's ``res.F`` contains their negatives
            and needs no ``maximize``; for your own names and signs rank
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
        >>> ranking = rank_of_efficiency(F, maximize=["yield"])
        >>> ranking.to_frame().drop(columns=["mu2", "mu3"]).round(2)
           place  cost  yield   mu1  efficiency_rank  pareto
        B      1   2.0   30.0  0.42                6    True
        A      2   1.0   10.0  1.00                0    True
        C      2   5.0   40.0  1.00                0    True
    """
    if normalize is not None:
        normalize = boolean("normalize", normalize)
    if source_type(F) == "table":
        F = F.feasible_ranking()
    if not isinstance(F, EfficiencyRanking):
        objectives = Objectives.of(F, maximize)
        pareto = nondominated(objectives.minimized)
        rows = np.arange(len(pareto))
        normalize = normalize is not False
        return ranking_of(objectives, pareto, rows, normalize=normalize, ideal=ideal, nadir=nadir)
    if len(maximize):
        rule = "left out where a table or ranking has directions of its own"
        raise invalid("maximize", rule, list(maximize))
    if normalize is None:
        normalize = F.frame.normalize
    if normalize == F.frame.normalize and ideal is None and nadir is None:
        return F
    if F.frame.is_fixed:
        ideal = F.ideal if ideal is None else ideal
        nadir = F.nadir if nadir is None else nadir
    return ranking_of(F.objectives, F.pareto, F.rows, normalize=normalize, ideal=ideal, nadir=nadir)


def ranking_of(
    objectives: Objectives,
    pareto: Mask,
    rows: Rows,
    *,
    normalize: bool,
    ideal: ArrayLike | None = None,
    nadir: ArrayLike | None = None,
) -> EfficiencyRanking:
    """Return :func:`rank_of_efficiency` of objectives whose Pareto-optimal rows are known.

    Args:
        objectives: What is ranked.
        pareto: ``(n,)`` which of its designs are Pareto optimal.
        rows: ``(n,)`` which rows of a table the designs are; 0 to n - 1 for those of an array.
        normalize: As for :func:`rank_of_efficiency`.
        ideal: As for :func:`rank_of_efficiency`.
        nadir: As for :func:`rank_of_efficiency`.
    """
    F = np.asfortranarray(objectives.minimized)  # by column, as without_rounding() has its values
    front = np.flatnonzero(pareto)
    optimal = without_rounding(F[front])
    F[front] = optimal
    frame = _frame(objectives, optimal, normalize, ideal, nadir)
    criteria = frame.measured(F)
    mu1, mu2, mu3 = map(levels, criteria[front].T, frame.noise(optimal))
    place = np.zeros(len(F), dtype=np.int64)
    counts = np.bincount(mu1)
    place[front] = 1 + (np.cumsum(counts) - counts)[mu1]
    rank = np.zeros(len(F), dtype=np.int64)
    rank[front] = _ranks(mu1, mu2, mu3)
    salukvadze = front[mu1 == 0]
    return EfficiencyRanking(
        criteria, place, rank, pareto, frame, salukvadze, objectives, rows, optimal
    )


def _frame(
    objectives: Objectives,
    front: Array,
    normalize: bool,
    ideal: ArrayLike | None,
    nadir: ArrayLike | None,
) -> UtopianFrame:
    """Return the frame of the points U and N: those that are given, or the ends of the front."""
    U = front.min(axis=0)
    if ideal is not None:
        U = objectives.turned("ideal", ideal)
    N = front.max(axis=0)
    if nadir is not None:
        N = objectives.turned("nadir", nadir)
    if (N < U).any():
        received = Received(f"{objectives.original(N)} and {objectives.original(U)}")
        raise invalid("nadir", "no better than the ideal", received, "leave both out")
    return UtopianFrame(U, N, normalize, is_fixed=ideal is not None or nadir is not None)


def _ranks(mu1: Levels, mu2: Levels, mu3: Levels) -> NDArray[np.int64]:
    """Return the ranks of efficiency of k Pareto-optimal points from the levels of their criteria.

    P12 and P13 lie inside P23, since μ1² = μ2² + μ3². Levels satisfy this only up to their
    tolerance; without the union, ranks 1 and 2 would occur.
    """
    p12 = nondominated_pair(mu1, mu2, mu3)
    p13 = nondominated_pair(mu1, mu3, mu2)
    p23 = nondominated_pair(mu2, mu3, mu1) | p12 | p13
    rank = np.zeros(len(mu1), dtype=np.int64)
    rank[p12] += 1
    rank[p13] += 2
    rank[p23] += 3
    return rank


# Parts of rankings for the rest of the package


def ranking_frame(
    ranking: EfficiencyRanking, columns: Mapping[Any, Any], index: Any = None
) -> pd.DataFrame:
    """Return a frame of columns between those of a ranking, by place.

    Args:
        ranking: The ranking of n designs.
        columns: Further ``(n,)`` columns by name.
        index: ``(n,)`` labels of the designs; 0, 1, … unless given.
    """
    import pandas as pd

    place = pd.arrays.IntegerArray(ranking.place.copy(), ~ranking.pareto)
    criteria = ranking.criteria
    if np.isinf(ranking.frame.scale).all():  # no range tells how far others are from the only one
        criteria = np.where(ranking.pareto[:, None], criteria, np.nan)
    measures = (*criteria.T, ranking.rank, ranking.pareto)
    behind = dict(zip(RANKING_COLUMNS[1:], measures, strict=True))
    frame = pd.DataFrame({"place": place, **columns, **behind}, index=index)
    return frame.iloc[ranking.by_place]


def with_units(ranking: EfficiencyRanking, units: Mapping[Any, str] | None) -> EfficiencyRanking:
    """Return a ranking with units of its objectives by name; None leaves those that it has."""
    if units is None:
        return ranking
    for name in mapping("units", units, "names to units"):
        known_name("units", name, [*map(str, ranking.objectives.names)])
    return replace(ranking, objectives=replace(ranking.objectives, units=units))


def measured_as(ranking: EfficiencyRanking, other: EfficiencyRanking) -> EfficiencyRanking:
    """Return a ranking for comparisons in the ranges and with the decimals of another one."""
    return replace(ranking, frame=other.frame, measured_by=other)


def measured_in(ranking: EfficiencyRanking) -> str:
    """Return the unit of the distances of a ranking, as a sentence without its full stop."""
    if not ranking.frame.normalize:
        return "Not normalised: plain distances, as in the paper"
    if ranking.frame.is_fixed:
        return "Each objective counts by its fixed range"
    return "Each objective counts by its range: best 0, worst 1"


def nearest_to_ideal(F: Array, frame: UtopianFrame) -> Rows:
    """Return the Salukvadze optimum of :func:`rank_of_efficiency` alone, which takes less time.

    Args:
        F: ``(n, m)`` objective values, minimised.
        frame: That of a ranking of such values: whether they are normalised, and fixed points.
    """
    front = np.flatnonzero(nondominated(F))
    nearest, _ = nearest_of_front(without_rounding(F[front]), frame)
    return front[nearest]


def nearest_of_front(F: Array, frame: UtopianFrame) -> tuple[Rows, UtopianFrame]:
    """Return the Salukvadze optimum of a Pareto set, and the frame in which it is measured.

    Args:
        F: ``(k, m)`` objective values without rounding noise, minimised, none of which dominates
            another.
        frame: As for :func:`nearest_to_ideal`.
    """
    frame = frame.around(F)
    distances = frame.distances(F)
    noise = np.hypot.reduce(LAST_PLACES * frame.sizes(F))
    return np.flatnonzero(distances <= distances.min() + noise), frame
