"""Why a design: how far it is from the best, and what others would give and take.

Everything is measured against the Pareto set: the best and the worst value of an objective are
those of the Pareto-optimal designs, and their difference is its range. The step from a design that
improves an objective goes to the Pareto-optimal design that gives up least: of those that are
better in it by 1 % of its range or more (or, if there is none, better at all) the one whose
greatest loss in another objective, in units of the ranges, is the least.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import collection, counted, integer, invalid
from pymoo_psi.pareto._dominance import settled, unit_lengths
from pymoo_psi.pareto._ranking import EfficiencyRanking, ranking_from
from pymoo_psi.pareto._sentences import capital, listed, number, percent, sentence, wrapped

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

# Shares and distances closer than this, relatively, are equal: far above rounding, so that designs
# that lie symmetrically tie, and far below any difference that counts.
_TIE = 1e-9
# Of the range. On a dense front the least step that is better at all is hardly another design.
_STEP = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class DesignComparison:
    """What k designs give and take against the first of them.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        rows: ``(k,)`` which designs are compared; the others with the first.
        units: Units of objectives by name.
        gains: ``(k, m)`` by how much each design is better than the first, in the units of the
            objectives; below 0 where it is worse, 0 where both are equal up to rounding. More is
            better here for each objective, whether it is minimised or maximised.
        shares: ``(k, m)`` the gains as shares of the ranges of the Pareto set; NaN where a design
            differs in an objective in which all Pareto-optimal designs are equal.

    Example:
        >>> two = compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [0, 1])
        >>> two.gains.tolist(), two.shares.round(3).tolist()
        ([[0.0, 0.0], [-1.0, 5.0]], [[0.0, 0.0], [-0.25, 0.625]])
    """

    ranking: EfficiencyRanking
    rows: Rows
    units: Mapping[Any, str]
    gains: Array
    shares: Array

    def __repr__(self) -> str:
        """Return :attr:`sentences`, wrapped at 80 columns."""
        return wrapped(self.sentences)

    @property
    def sentences(self) -> tuple[str, ...]:
        """One sentence for each design after the first: where it is better, where worse.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [0, 1]).sentences
            ('Design 1 against design 0: better in f2 by 5 (62 % of its range); worse in f1 by 1
            (25 %).',)
        """
        first, *others = (self.ranking.name_of(row) for row in self.rows)
        return tuple(
            sentence("against", design=capital(name), other=first, difference=self.difference(k))
            for k, name in enumerate(others, start=1)
        )

    def difference(self, k: int) -> str:
        """Return where the k-th design compared is better than the first, and where worse.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0]).difference(1)
            'better in f1 by 1 (25 % of its range); worse in f2 by 5 (62 %)'
        """
        gains, sizes = np.abs(self.gains[k]), np.abs(self.shares[k])
        # The largest first, NaN last; those that are equal up to rounding as they are.
        order = np.argsort(-np.round(sizes / _TIE), kind="stable")
        better, worse = order[self.gains[k][order] > 0], order[self.gains[k][order] < 0]
        changes = self.changes(gains, sizes, [*better, *worse])
        sides = (("better", changes[: len(better)]), ("worse", changes[len(better) :]))
        parts = [sentence(side, changes=", ".join(found)) for side, found in sides if found]
        return "; ".join(parts) or sentence("equal")

    def changes(self, sizes: Array, shares: Array, columns: Iterable[int]) -> list[str]:
        """Return by how much some objectives change, as parts of a sentence.

        Example:
            >>> two = compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [0, 1])
            >>> two.changes(two.gains[1], two.shares[1], [1])
            ['f2 by 5 (62 % of its range)']
        """
        texts: list[str] = []
        for j in columns:
            name, known = self.ranking.objectives.names[j], "change" if texts else "first change"
            amount, share = f"{number(sizes[j])} {self.units.get(name, '')}".strip(), shares[j]
            template = "bare change" if np.isnan(share) else known
            texts.append(sentence(template, objective=name, amount=amount, share=percent(share)))
        return texts


@dataclass(frozen=True, eq=False, repr=False)
class Explanation:
    """Why one design: its distances from the best, and the steps that improve an objective.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        row: The design.
        behind: ``(m,)`` how far it is from the best value of each objective among the
            Pareto-optimal designs, in the unit of the objective, >= 0.
        shares: ``(m,)`` the same as shares of the ranges: 0 the best, 1 the worst of the Pareto
            set, more only for a dominated design. 0 in an objective that is equal for all, NaN if
            a dominated design differs in it.
        neighbours: ``(m,)`` for each objective, of the Pareto-optimal designs that are better in it
            by 1 % of its range or, if there is none, better at all, the one whose greatest loss in
            another objective, in units of the ranges, is the least; of those that tie the nearest,
            then the one that gains most; -1 where none is better.
        steps: The neighbours against the design: gains, and what they cost. The design itself
            stands first, then the neighbours, each once, in the order of the objectives.
        dominated_by: The nearest Pareto-optimal design that is nowhere worse and somewhere better;
            -1 if there is none, because the design is Pareto optimal itself.

    Example:
        >>> why = explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 1)
        >>> why.shares, why.weakest, why.neighbours
        (array([0.25 , 0.375]), ('f2',), array([0, 2]))
    """

    ranking: EfficiencyRanking
    row: int
    behind: Array
    shares: Array
    neighbours: Rows
    steps: DesignComparison
    dominated_by: int

    def __repr__(self) -> str:
        """Return :attr:`sentences`, wrapped at 80 columns."""
        return wrapped(self.sentences)

    @property
    def weakest(self) -> tuple[Any, ...]:
        """The objective with the greatest share of its range lost; all of them if several tie.

        Empty if the design is the best in each.

        Example:
            >>> explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 0).weakest
            ('f2',)
        """
        most = np.nanmax(np.append(self.shares, 0.0))
        tied = (self.shares >= most * (1 - _TIE)) & (most > 0)
        return tuple(self.ranking.objectives.names[j] for j in np.flatnonzero(tied))

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the design is, how far from the best, and what each step costs.

        First what it is among the others, second its distances from the best, the weakest
        objective first, then one sentence for the step towards each objective, in the same order.

        Example:
            >>> for line in explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 1).sentences:
            ...     print(line)
            Design 1 is the Salukvadze optimum: the nearest of 3 Pareto-optimal designs to the
            ideal point.
            Behind the best in f2 by 3 (38 % of its range), f1 by 1 (25 %); weakest in f2.
            Towards f2 design 2 gives up least: better in f2 by 3 (38 % of its range); worse in f1
            by 3 (75 %).
            Towards f1 design 0 gives up least: better in f1 by 1 (25 % of its range); worse in f2
            by 5 (62 %).
        """
        names = self.ranking.objectives.names
        # By share, and NaN, which compares with nothing, first.
        order = np.lexsort((-np.round(np.nan_to_num(self.shares) / _TIE), ~np.isnan(self.shares)))
        neighbours, rows = self.neighbours[order].tolist(), self.steps.rows.tolist()
        steps = [
            sentence(  # one for a neighbour towards several objectives
                "step",
                objectives=listed([names[j] for j in order if self.neighbours[j] == row]),
                design=self.ranking.name_of(row),
                difference=self.steps.difference(rows.index(row)),
            )
            for row in dict.fromkeys(neighbours)
            if row >= 0
        ]
        return (self._standing(), self._distances(order[self.behind[order] > 0]), *steps)

    def _standing(self) -> str:
        """Return what the design is among the others."""
        ranking, optima, other = self.ranking, self.ranking.salukvadze, self.dominated_by
        design, n = capital(ranking.name_of(self.row)), int(ranking.pareto.sum())
        if other >= 0:
            pair = _compared(ranking, [self.row, other], self.steps.units)
            names = {"design": design, "other": ranking.name_of(other)}
            return sentence("dominated", **names, difference=pair.difference(1))
        kind = "ranked" if self.row not in optima else "optima" if len(optima) > 1 else "optimum"
        front, rank = counted(n, "Pareto-optimal design"), ranking.rank[self.row]
        kind = "single" if n == 1 else kind
        return sentence(kind, design=design, front=front, rank=rank, count=len(optima))

    def _distances(self, columns: Rows) -> str:
        """Return how far the design is from the best, where it is not the best itself."""
        names, frame = self.ranking.objectives.names, self.ranking.frame
        if not len(columns):
            return sentence("all best")
        changes = self.steps.changes(self.behind, self.shares, columns)
        parts = [sentence("behind", changes=", ".join(changes))]
        if len(changes) > 1 and self.weakest:
            parts.append(sentence("weakest", objectives=listed(self.weakest)))
        varying = np.isfinite(unit_lengths(frame.ideal, frame.nadir))
        if best := [names[j] for j in np.flatnonzero(varying & (self.behind == 0))]:
            parts.append(sentence("best", objectives=listed(best)))
        return "; ".join(parts) + "."


@np.errstate(over="ignore", invalid="ignore")  # a dominated design may be infinitely far
def explain(
    F: Any,
    i: int | str,
    *,
    normalize: bool = True,
    maximize: Collection[Any] = (),
    units: Mapping[Any, str] | None = None,
) -> Explanation:
    """Say why a design: how far it is from the best, and what improving an objective costs.

    The range of an objective is that of the Pareto-optimal rows, from the best to the worst value.
    Towards an objective, of the Pareto-optimal rows that are better in it by 1 % of its range or
    more (if there is none, better at all), that one is named that gives up least: its greatest loss
    in another objective, in units of the ranges, is the least. Of rows that tie it is the nearest,
    in the Euclidean distance in these units. Values that are equal up to rounding are equal.

    Args:
        F: ``(n, m)`` objective values, an array or a data frame, whose names and labels are used;
            or a ranking, which has its own ``normalize`` and ``maximize``; or anything else that
            :func:`pymoo_psi.rank_of_efficiency` takes. Of a test table the rows are its feasible
            designs, its ``names`` their labels; its method ``explain`` goes by test point.
        i: The row of the design, from 0; or its label if that is a text. An integer is always a
            row, whatever the labels are.
        normalize: Of the rank in the sentences, as for
            :func:`pymoo_psi.rank_of_efficiency`; distances here are always in units of the ranges.
        maximize: The objectives to be maximised: column indices or, of a data frame, names.
        units: Units by name, for the sentences; a test table's own unless given.

    Returns:
        Numbers and sentences (``print`` it).

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` does not fit, or there is no such row.
        ArgumentTypeError: ``F`` does not hold real numbers; ``i`` is no integer.

    Example:
        >>> import pandas as pd
        >>> F = pd.DataFrame({"cost": [1, 2, 5], "yield": [10, 30, 40]}, index=["A", "B", "C"])
        >>> print(explain(F, 1, maximize=["yield"], units={"cost": "€"}))
        B is the Salukvadze optimum: the nearest of 3 Pareto-optimal designs to the
        ideal point.
        Behind the best in yield by 10 (33 % of its range), cost by 1 € (25 %); weakest
        in yield.
        Towards yield C gives up least: better in yield by 10 (33 % of its range); worse
        in cost by 3 € (75 %).
        Towards cost A gives up least: better in cost by 1 € (25 % of its range); worse
        in yield by 20 (67 %).
    """
    ranking = ranking_from(F, normalize, maximize)
    row = _row("i", i, ranking)
    front, values, (own,), lengths = _measured(ranking, [row])
    behind, steps = own - values.min(axis=0), (values - own) / lengths
    distance = np.sqrt((steps**2).sum(axis=1))
    distance[np.isnan(distance)] = np.inf
    loss = np.fmax(steps, 0).max(axis=1)

    def giving_up_least(rows: Rows, tie: float) -> Rows:
        """The nearest of those that give up least, all of them if several tie."""
        rows = rows[loss[rows] <= loss[rows].min() + tie]
        return np.asarray(rows[distance[rows] <= distance[rows].min() * (1 + _TIE)])

    neighbours = np.full(len(own), -1, dtype=np.intp)
    for j in range(len(own)):
        gain = own[j] - values[:, j]
        clearly = (gain > 0) & (gain >= _STEP * lengths[j])  # of tiny ranges that is 0
        if (gain > 0).any():
            rows = giving_up_least(np.flatnonzero(clearly if clearly.any() else gain > 0), _TIE)
            neighbours[j] = front[rows[values[rows, j].argmin()]]
    dominated_by = -1
    if not ranking.pareto[row]:
        # The least loss, not none: a value in a chain of close ones may be settled otherwise
        # here than among all designs, where the dominance was found.
        dominated_by = int(front[giving_up_least(np.arange(len(front)), 0.0)[0]])
    others = list(dict.fromkeys(neighbours[neighbours >= 0].tolist()))
    comparison = _compared(ranking, [row, *others], _units(F, units, ranking))
    shares = _shares(behind, lengths)
    return Explanation(ranking, row, behind, shares, neighbours, comparison, dominated_by)


def compare_designs(
    F: Any,
    rows: Sequence[int | str],
    *,
    normalize: bool = True,
    maximize: Collection[Any] = (),
    units: Mapping[Any, str] | None = None,
) -> DesignComparison:
    """Say what designs give and take against the first of them.

    Args:
        F: ``(n, m)`` objective values, as for :func:`explain`; the ranges are those of its
            Pareto-optimal rows.
        rows: Two rows or more, as for :func:`explain`; the others are compared with the first.
        normalize: Of the ranking that the result carries.
        maximize: As for :func:`explain`.
        units: As for :func:`explain`.

    Returns:
        Numbers and sentences (``print`` it). As a frame:
        ``pd.DataFrame(comparison.gains, labels, names)``.

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` does not fit, there is no such row, or
            there are fewer than two.
        ArgumentTypeError: ``F`` does not hold real numbers; ``rows`` is no list of integers.

    Example:
        >>> print(compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0, 2]))
        Design 0 against design 1: better in f1 by 1 (25 % of its range); worse in f2 by
        5 (62 %).
        Design 2 against design 1: better in f2 by 3 (38 % of its range); worse in f1 by
        3 (75 %).
    """
    if len(collection("rows", rows, "a list of rows of F")) < 2:
        raise invalid("rows", "two rows or more", list(rows))
    ranking = ranking_from(F, normalize, maximize)
    at = [_row("rows", row, ranking) for row in rows]
    return _compared(ranking, at, _units(F, units, ranking))


@np.errstate(over="ignore", invalid="ignore")
def _compared(
    ranking: EfficiencyRanking, rows: Sequence[int], units: Mapping[Any, str]
) -> DesignComparison:
    """Return the comparison of one design or more with the first."""
    _, _, own, lengths = _measured(ranking, rows)
    gains = own[0] - own + 0.0  # no -0.0
    shares = _shares(gains, lengths)
    return DesignComparison(ranking, np.array(rows, dtype=np.intp), units, gains, shares)


def alternative(
    ranking: EfficiencyRanking, chosen: Rows, row: int, units: Mapping[Any, str]
) -> str:
    """Return what a selector chooses, and what that gives and takes against a design.

    Args:
        ranking: Of all designs.
        chosen: The rows that the selector chooses, of which the first is described; may be empty.
        row: The design, in most cases the optimum.
        units: Units of objectives by name.
    """
    if not len(chosen):
        return "no design stands out."
    first, own = int(chosen[0]), ranking.name_of(row)
    text = f"{own}, the optimum itself." if row in ranking.salukvadze else f"{own}."
    if row not in chosen:
        difference = _compared(ranking, [row, first], units).difference(1)
        text = sentence("against", design=ranking.name_of(first), other=own, difference=difference)
    return text + (f" It is the first of {len(chosen)} that are chosen." if len(chosen) > 1 else "")


def _measured(ranking: EfficiencyRanking, rows: Sequence[int]) -> tuple[Rows, Array, Array, Array]:
    """Return the Pareto-optimal rows, their values, those of ``rows``, and the ranges.

    All are minimised, and values that are equal up to rounding are the same number. The range of
    an objective that is constant is infinite.
    """
    front, objectives = np.flatnonzero(ranking.pareto), ranking.objectives
    wanted = np.concatenate([front, np.array(rows, dtype=np.intp)])
    together = settled(objectives.values[wanted] * objectives.sign)
    lengths = unit_lengths(ranking.frame.ideal, ranking.frame.nadir)
    return front, together[: len(front)], together[len(front) :], lengths


def _shares(differences: Array, lengths: Array) -> Array:
    """Return differences in units of the ranges; NaN for one where the range is 0."""
    return np.where(np.isinf(lengths) & (differences != 0), np.nan, differences / lengths + 0.0)


def _units(
    F: Any, units: Mapping[Any, str] | None, ranking: EfficiencyRanking
) -> Mapping[Any, str]:
    """Return the units that are given, or those of a test table, of all its columns."""
    if units is None:
        return getattr(getattr(F, "layout", None), "units", {})
    names = ranking.objectives.names
    if unknown := [name for name in units if name not in names]:
        raise invalid("units", f"of objectives among {', '.join(map(str, names))}", unknown[0])
    return units


def _row(name: str, value: Any, ranking: EfficiencyRanking) -> int:
    """Return the row of a design that is given by its row or its label."""
    labels = list(ranking.objectives.labels)
    if isinstance(value, str):  # an integer is always a row, whatever the labels are
        if labels.count(value) != 1:
            raise invalid(name, "a row of F from 0, or the label of just one row", value)
        return labels.index(value)
    row = integer(name, value, minimum=0)
    if row >= len(labels):
        raise invalid(name, f"a row of F, 0 to {len(labels) - 1}", row)
    return row
