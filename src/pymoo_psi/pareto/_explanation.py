"""Why a design: how far it is from the best, and what others would gain and lose.

Everything is measured against the Pareto set: the best value of an objective is that of the
Pareto-optimal designs, and its range is that of all Pareto-optimal designs, whatever the limits.
Shares are of this range; a difference beyond it is given in units only. The step from a design that
improves an objective goes to the Pareto-optimal design that gives up least: of those that are
better in it by 1 % of its range or more (or, if there is none, better at all) the one whose
greatest loss in another objective, in units of the ranges, is the least.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_psi._validation import Array, Received, Rows, collection, counted, integer, invalid
from pymoo_psi.pareto._dominance import without_rounding
from pymoo_psi.pareto._ranking import EfficiencyRanking, is_table, rank_of_efficiency, with_units
from pymoo_psi.pareto._sentences import (
    capital,
    decimal_mark,
    listed,
    number,
    percent,
    sentence,
    wrapped,
)

# Shares and distances closer than this, relatively, are equal: far above rounding, so that designs
# that lie symmetrically tie, and far below any difference that counts.
_TIE = 1e-9
# Of the range. On a dense front the least step that is better at all is hardly another design.
_STEP = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class DesignComparison:
    """The gains and losses of k designs compared with the first of them.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        rows: ``(k,)`` the rows of the designs in the ranking; the others are compared with the
            first.
        gains: ``(k, m)`` by how much each design is better than the first, in the units of the
            objectives; negative where it is worse, 0 where both are equal up to rounding. Positive
            is better for minimised and maximised objectives.
        shares: ``(k, m)`` the gains as shares of the ranges of the Pareto set; NaN where a design
            differs in an objective in which all Pareto-optimal designs are equal.

    Example:
        >>> two = compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [0, 1])
        >>> two.gains.tolist(), two.shares.round(3).tolist()
        ([[0.0, 0.0], [-1.0, 5.0]], [[0.0, 0.0], [-0.25, 0.625]])
    """

    ranking: EfficiencyRanking
    rows: Rows
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
        sentences = []
        for k, name in enumerate(others, start=1):
            difference = self.difference(k)
            text = sentence("against", design=capital(name), other=first, difference=difference)
            sentences.append(text)
        return tuple(sentences)

    def difference(self, k: int) -> str:
        """Return where the k-th design compared is better than the first, and where worse.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0]).difference(1)
            'better in f1 by 1 (25 % of its range); worse in f2 by 5 (62 %)'
        """
        gains = self.gains[k]
        shares = np.abs(self.shares[k])
        # The largest first, NaN last; those that are equal up to rounding as they are.
        order = np.argsort(-np.round(shares / _TIE), kind="stable")
        better = order[gains[order] > 0]
        worse = order[gains[order] < 0]
        changes = self.changes(np.abs(gains), shares, [*better, *worse])
        parts = []
        if len(better):
            parts.append(sentence("better", changes=", ".join(changes[: len(better)])))
        if len(worse):
            parts.append(sentence("worse", changes=", ".join(changes[len(better) :])))
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
            name = self.ranking.objectives.names[j]
            unit = self.ranking.objectives.units.get(name, "")
            if unit == "%":  # "9 %" of a share would be another amount
                unit = "points"
            amount = f"{number(sizes[j])} {unit}".strip()
            template = "change" if texts else "first change"
            if not shares[j] <= 1 + _TIE:  # NaN is refused, too
                template = "bare change"
            share = percent(shares[j])
            texts.append(sentence(template, objective=name, amount=amount, share=share))
        return texts


@dataclass(frozen=True, eq=False, repr=False)
class Explanation:
    """Why one design: its distances from the best, and the steps that improve an objective.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        row: The row of the design in the ranking.
        behind: ``(m,)`` how far it is from the best value of each objective among the
            Pareto-optimal designs, in the unit of the objective, >= 0.
        shares: ``(m,)`` the same as shares of the ranges: 0 the best, 1 as far as the worst of the
            Pareto set, more only for a dominated design. 0 in an objective that is equal for all,
            NaN if a dominated design differs in it.
        neighbours: ``(m,)`` for each objective the row of the Pareto-optimal design that gives up
            least, see :func:`explain`; of those that tie the nearest, then the one that gains most;
            -1 where none is better.
        steps: The neighbours compared with the design: their gains and losses. The design itself
            is first, then the neighbours, each once, in the order of the objectives.
        dominated_by: The row of the nearest Pareto-optimal design that is nowhere worse and
            somewhere better; -1 if the design is Pareto optimal itself.
        switching: Of the optimum of a test table, until which limits and values it stays so, as
            sentences (``TestTable.switching``).
        decimal: The decimal mark of the table, "" without one.

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
    switching: tuple[str, ...] = ()
    decimal: str = ""

    def __repr__(self) -> str:
        """Return :attr:`sentences` and :attr:`switching`, wrapped at 80 columns."""
        return wrapped([*self.sentences, *self.switching])

    @property
    def weakest(self) -> tuple[Any, ...]:
        """The objective that loses the greatest share of its range; all of them if several tie.

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

        The first sentence places it among the others. The second gives its distances from the best,
        the weakest objective first. One sentence for the step towards each objective follows, in
        the same order.

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
        # By share, and NaN, which compares with nothing, first.
        order = np.lexsort((-np.round(np.nan_to_num(self.shares) / _TIE), ~np.isnan(self.shares)))
        with decimal_mark(self.decimal):
            distances = self._distances(order[self.behind[order] > 0])
            return (self._standing(), distances, *self._step_sentences(order))

    def _standing(self) -> str:
        """Return what the design is among the others."""
        ranking = self.ranking
        design = capital(ranking.name_of(self.row))
        if self.dominated_by >= 0:
            pair = _compared(ranking, [self.row, self.dominated_by])
            other = ranking.name_of(self.dominated_by)
            difference = pair.difference(1)
            return sentence("dominated", design=design, other=other, difference=difference)
        n_optimal = ranking.pareto.sum()
        n_optima = len(ranking.salukvadze)
        if n_optimal == 1:
            kind = "single"
        elif self.row not in ranking.salukvadze:
            kind = "ranked"
        elif n_optima > 1:
            kind = "optima"
        else:
            kind = "optimum"
        front = counted(n_optimal, "Pareto-optimal design")
        return sentence(
            kind,
            design=design,
            front=front,
            place=ranking.place[self.row],
            count=n_optima,
        )

    def _distances(self, columns: Rows) -> str:
        """Return how far the design is from the best, in the objectives where it is behind."""
        if not len(columns):
            return sentence("all best")
        changes = self.steps.changes(self.behind, self.shares, columns)
        parts = [sentence("behind", changes=", ".join(changes))]
        if len(changes) > 1 and self.weakest:
            parts.append(sentence("weakest", objectives=listed(self.weakest)))
        best = np.flatnonzero(np.isfinite(self.ranking.lengths) & (self.behind == 0))
        if len(best):
            names = [self.ranking.objectives.names[j] for j in best]
            parts.append(sentence("best", objectives=listed(names)))
        return "; ".join(parts) + "."

    def _step_sentences(self, order: Rows) -> list[str]:
        """Return one sentence for each neighbour, objectives that share it together.

        Args:
            order: ``(m,)`` the objectives in the order of the sentences.
        """
        names = self.ranking.objectives.names
        rows = self.steps.rows.tolist()
        sentences = []
        for row in dict.fromkeys(self.neighbours[order].tolist()):
            if row < 0:
                continue
            shared = [names[j] for j in order if self.neighbours[j] == row]
            objectives = listed(shared)
            design = self.ranking.name_of(row)
            difference = self.steps.difference(rows.index(row))
            text = sentence("step", objectives=objectives, design=design, difference=difference)
            sentences.append(text)
        return sentences


@np.errstate(over="ignore", invalid="ignore")  # a dominated design may be infinitely far
def explain(
    F: Any,
    design: int | str | None = None,
    *,
    row: int | None = None,
    normalize: bool | None = None,
    maximize: Collection[Any] = (),
    units: Mapping[Any, str] | None = None,
) -> Explanation:
    """Explain a design: how far it is from the best, and what improving an objective costs.

    The range of an objective extends from its best to its worst value among the Pareto-optimal
    designs. For each objective the explanation names the design that gives up least. Candidates are
    the Pareto-optimal designs that are better in this objective by 1 % of its range or more, or, if
    there is none, better at all. The one with the smallest greatest loss in another objective, in
    units of the ranges, is named; of those that tie, the nearest in Euclidean distance in these
    units. Values that are equal up to rounding are equal.

    Args:
        F: A test table, of which the feasible designs count; ``(n, m)`` objective values, an array
            or a data frame, whose names and labels are used; a ranking, which has
            directions of its own; or anything else that :func:`pymoo_psi.rank_of_efficiency` takes.
        design: The number of the design's test or its label; for an array its row from 0. By
            default the Salukvadze optimum. A data frame with the labels 0, 1, … is like an array;
            write other integer labels as texts, because ``3`` may be a label or a row.
        row: The row of the design in ``F``, from 0, instead of ``design``.
        normalize: Affects the place in the sentences, as for :func:`pymoo_psi.rank_of_efficiency`;
            distances here are always in units of the ranges.
        maximize: The objectives to be maximised: column indices or, of a data frame, names.
        units: Units by name, for the sentences; by default those of a test table.

    Returns:
        Numbers and sentences (``print`` it).

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` does not fit, or there is no such design.
        ArgumentTypeError: ``F`` does not hold real numbers; ``design`` is no integer or text.

    Example:
        >>> import pandas as pd
        >>> F = pd.DataFrame({"cost": [1, 2, 5], "yield": [10, 30, 40]}, index=["A", "B", "C"])
        >>> print(explain(F, "B", maximize=["yield"], units={"cost": "€"}))
        B is the Salukvadze optimum: the nearest of 3 Pareto-optimal designs to the
        ideal point.
        Behind the best in yield by 10 (33 % of its range), cost by 1 € (25 %); weakest
        in yield.
        Towards yield C gives up least: better in yield by 10 (33 % of its range); worse
        in cost by 3 € (75 %).
        Towards cost A gives up least: better in cost by 1 € (25 % of its range); worse
        in yield by 20 (67 %).
    """
    if is_table(F) and normalize is not None:
        F = F.under(normalize=normalize)  # the ranking and what keeps its optimum are of one table
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    ranking = with_units(ranking, units)
    if row is not None:
        if design is not None:
            raise invalid("design", "left out where row is given", design)
        row = _row_of_row("row", row, F, ranking)
    elif design is not None:
        row = _row_of_design(design, F, ranking)
    else:
        row = int(ranking.salukvadze[0])

    view = _View.of(ranking, row)
    m = len(view.design)
    neighbours = np.array([view.neighbour(j) for j in range(m)], dtype=np.intp)
    dominated_by = -1
    if not ranking.pareto[row]:
        dominated_by = view.dominating()
    steps = _compared(ranking, list(dict.fromkeys([row, *neighbours[neighbours >= 0].tolist()])))
    switching = ()
    decimal = ""
    if is_table(F):
        decimal = F.decimal
        if row in ranking.salukvadze:
            switching = tuple(F.switching())
    behind = view.design - view.values.min(axis=0)
    shares = _shares(behind, ranking.lengths)
    return Explanation(
        ranking, row, behind, shares, neighbours, steps, dominated_by, switching, decimal
    )


@dataclass(frozen=True, eq=False)
class _View:
    """The Pareto set as seen from a design; values that are equal up to rounding coincide.

    Attributes:
        design: ``(m,)`` the objectives of the design, minimised.
        front: ``(k,)`` rows of the Pareto-optimal designs.
        values: ``(k, m)`` their objectives.
        lengths: ``(m,)`` the ranges of the objectives, infinite for one that is constant.
        losses: ``(k,)`` the greatest loss of a step to each of them, in shares of the ranges.
        distances: ``(k,)`` how far each of them is, in the same unit.
    """

    design: Array
    front: Rows
    values: Array
    lengths: Array
    losses: Array
    distances: Array

    @classmethod
    def of(cls, ranking: EfficiencyRanking, row: int) -> _View:
        """Return the view from a row of a ranking."""
        front = np.flatnonzero(ranking.pareto)
        values = _values(ranking, np.append(row, front))
        design = values[0]
        steps = (values[1:] - design) / ranking.lengths
        distances = np.sqrt((steps**2).sum(axis=1))
        distances[np.isnan(distances)] = np.inf
        losses = np.fmax(steps, 0).max(axis=1)
        return cls(design, front, values[1:], ranking.lengths, losses, distances)

    def neighbour(self, j: int) -> int:
        """Return the row of the design that is better in objective j and gives up least, or -1.

        Those count that are better by a step or more, or if there is none, better at all.
        """
        gains = self.design[j] - self.values[:, j]
        better = gains > 0
        clearly = better & (gains >= _STEP * self.lengths[j])  # a step of a tiny range is 0
        if clearly.any():
            better = clearly
        candidates = np.flatnonzero(better)
        if len(candidates) == 0:
            return -1
        candidates = self._nearest(candidates, _TIE)
        return int(self.front[candidates[self.values[candidates, j].argmin()]])

    def dominating(self) -> int:
        """Return the row of the nearest design that is nowhere worse."""
        # The least loss need not be 0: a value in a chain of close ones may be in another group
        # here than among all designs, where the dominance was found.
        return int(self.front[self._nearest(np.arange(len(self.front)), 0.0)[0]])

    def _nearest(self, candidates: Rows, tie: float) -> Rows:
        """Return the nearest of the candidates that give up least, all of them if several tie."""
        losses = self.losses[candidates]
        candidates = candidates[losses <= losses.min() + tie]
        distances = self.distances[candidates]
        return np.asarray(candidates[distances <= distances.min() * (1 + _TIE)])


def compare_designs(
    F: Any,
    designs: Sequence[int | str] | None = None,
    *,
    rows: Sequence[int] | None = None,
    normalize: bool | None = None,
    maximize: Collection[Any] = (),
    units: Mapping[Any, str] | None = None,
) -> DesignComparison:
    """Compare designs with the first of them by gains and losses.

    Args:
        F: A test table, objective values or a ranking, as for :func:`explain`; the ranges are those
            of its Pareto-optimal designs.
        designs: Two designs or more, each as for :func:`explain`.
        rows: The rows of the designs in ``F``, from 0, instead of ``designs``.
        normalize: Affects the ranking in the result.
        maximize: As for :func:`explain`.
        units: As for :func:`explain`.

    Returns:
        Numbers and sentences (``print`` it). As a frame:
        ``pd.DataFrame(comparison.gains, labels, names)``.

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` does not fit, there is no such design, or
            there are fewer than two.
        ArgumentTypeError: ``F`` does not hold real numbers; ``designs`` or ``rows`` is no list.

    Example:
        >>> print(compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0, 2]))
        Design 0 against design 1: better in f1 by 1 (25 % of its range); worse in f2 by
        5 (62 %).
        Design 2 against design 1: better in f2 by 3 (38 % of its range); worse in f1 by
        3 (75 %).
    """
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    ranking = with_units(ranking, units)
    if rows is None:
        entries = collection("designs", designs, "a list of designs")
        ranked = [_row_of_design(design, F, ranking) for design in entries]
    elif designs is None:
        ranked = [_row_of_row("rows", row, F, ranking) for row in rows]
    else:
        raise invalid("designs", "left out where rows are given", designs)
    if len(ranked) < 2:
        raise invalid("designs", "two designs or more", Received(f"{len(ranked)}"))
    return _compared(ranking, ranked)


@np.errstate(over="ignore", invalid="ignore")
def _compared(ranking: EfficiencyRanking, rows: Sequence[int]) -> DesignComparison:
    """Return the comparison of one design or more with the first."""
    values = _values(ranking, np.append(rows, np.flatnonzero(ranking.pareto)))[: len(rows)]
    gains = values[0] - values + 0.0  # no -0.0
    shares = _shares(gains, ranking.lengths)
    return DesignComparison(ranking, np.array(rows, dtype=np.intp), gains, shares)


def alternative(ranking: EfficiencyRanking, chosen: Rows, row: int) -> str:
    """Return the choice of a selector, and its gains and losses compared with a design.

    Args:
        ranking: The ranking of all designs.
        chosen: The rows that the selector chooses, of which the first is described; may be empty.
        row: The design, in most cases the optimum.
    """
    if not len(chosen):
        return "no design stands out."
    first = int(chosen[0])
    name = ranking.name_of(row)
    if row not in chosen:
        difference = _compared(ranking, [row, first]).difference(1)
        design = ranking.name_of(first)
        text = sentence("against", design=design, other=name, difference=difference)
    elif row in ranking.salukvadze:
        text = f"{name}, the optimum itself."
    else:
        text = f"{name}."
    if len(chosen) > 1:
        text += f" It is the first of {len(chosen)} that are chosen."
    return text


def _values(ranking: EfficiencyRanking, rows: Rows) -> Array:
    """Return the objectives of designs, minimised; values equal up to rounding coincide."""
    objectives = ranking.objectives
    return without_rounding(objectives.values[rows] * objectives.sign)


def _shares(differences: Array, lengths: Array) -> Array:
    """Return differences in units of the ranges; NaN for one where the range is 0."""
    shares = differences / lengths + 0.0  # no -0.0
    shares[np.isinf(lengths) & (differences != 0)] = np.nan
    return shares


def _row_of_design(design: int | str, F: Any, ranking: EfficiencyRanking) -> int:
    """Return the row in the ranking of a design by its label or its number."""
    if not is_table(F):
        return ranking.row_of(design)
    return _ranked_row("design", F.row_of(design), F, ranking)


def _row_of_row(name: str, row: int, F: Any, ranking: EfficiencyRanking) -> int:
    """Return the row in the ranking of a row of F."""
    n = len(ranking.rows)
    if is_table(F):
        n = len(F)
    if integer(name, row, minimum=0) >= n:
        raise invalid(name, f"a row of F, from 0 to {n - 1}", row)
    if is_table(F):
        return _ranked_row(name, row, F, ranking)
    return row


def _ranked_row(name: str, row: int, table: Any, ranking: EfficiencyRanking) -> int:
    """Return the row in the ranking of a row of a table, of which the feasible ones are ranked."""
    rows = ranking.rows.tolist()
    if row not in rows:
        violated, names = table.violations()
        reasons = np.array(names)[violated[row]]
        received = f"{table.names[row]}, which failed"
        if len(reasons):
            received = f"{table.names[row]}, which violates {', '.join(reasons)}"
        raise invalid(name, "a feasible design", Received(received))
    return int(rows.index(row))
