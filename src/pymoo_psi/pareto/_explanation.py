"""Why a design: how far it is from the best, and what others would gain and lose.

Everything is measured against the Pareto set of the designs within the limits: the best value and
the range of an objective are those of the Pareto-optimal designs, unless ranges are fixed. Shares
are of this range; a difference beyond it is given in units only. The step from a design that
improves an objective goes to the Pareto-optimal design that gives up least: of those that are
better in it by 1 % of its range or more (or, if there is none, better at all) the one whose
greatest loss in another objective, in units of the ranges, is the least.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_psi._numbers import number, percent
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Received,
    Rows,
    collection,
    counted,
    integer,
    invalid,
    source_type,
)
from pymoo_psi.pareto._dominance import without_rounding
from pymoo_psi.pareto._ranking import (
    EfficiencyRanking,
    rank_of_efficiency,
    with_units,
)
from pymoo_psi.pareto._sentences import SENTENCES, capital, listed, sentence, wrapped

# Shares and distances closer than this, relatively, are equal: far above rounding, so that designs
# that lie symmetrically tie, and far below any difference that counts.
TIE = 1e-9
# A step is at least this share of the range: on a dense front, the least step is hardly another
# design.
STEP = 0.01
MOST_COSTS = 5  # objectives named in a sentence, those with the greatest shares of a range


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
            ('Design 1 against design 0: f2 5 lower. But f1 1 higher.',)
        """
        return tuple(self.sentence("against", k) for k in range(1, len(self.rows)))

    def sentence(self, template: str, k: int, **texts: str) -> str:
        """Return a template about the k-th design compared and the first one, filled.

        Args:
            template: Its name among those of the package.
            k: From 1.
            **texts: What it needs beside the two designs and their difference.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [0, 1]).sentence("instead", 1)
            'Design 1 is chosen instead of design 0: f2 5 lower. But f1 1 higher.'
        """
        other = self.ranking.name_of(self.rows[0])
        design = self.ranking.name_of(self.rows[k])
        if SENTENCES[template].startswith("{design}"):
            design = capital(design)
        difference = self.difference(k)
        return sentence(template, design=design, other=other, difference=difference, **texts)

    def difference(self, k: int) -> str:
        """Return where the k-th design compared is better than the first, and where worse.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0]).difference(1)
            'f1 1 lower. But f2 5 higher'
        """
        better, worse = self.changes(k)
        if better and worse:
            return sentence("mixed", better=listed(better), worse=listed(worse))
        return listed(better or worse or [sentence("equal")])

    def changes(self, k: int) -> tuple[list[str], list[str]]:
        """Return the gains of the k-th design compared against the first, and its losses.

        Of each, the objectives in which it changes by the greatest share of the range are first.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0]).changes(1)
            (['f1 1 lower'], ['f2 5 higher'])
        """
        return self._sides(k, self._change)

    def losses(self, k: int) -> list[str]:
        """Return the losses of the k-th design compared, each with its share of the range.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0]).losses(1)
            ['f2 5 higher (62 %)']
        """
        return self._sides(k, self._change_and_share)[1]

    def amounts(self, k: int) -> tuple[str, str]:
        """Return what the k-th design compared gains against the first, and what it gives up.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0]).amounts(1)
            ('1 of f1', '5 of f2')
        """
        better, worse = self._sides(k, self._quantity)
        return listed(better), listed(worse)

    def _sides(self, k: int, text: Callable[[int, int], str]) -> tuple[list[str], list[str]]:
        """Return texts on the objectives in which the k-th design gains, and in which it loses.

        The greatest changes are first, by the shares of the ranges.
        """
        order = by_size(np.abs(self.shares[k]))
        gains = self.gains[k, order]
        return [text(k, j) for j in order[gains > 0]], [text(k, j) for j in order[gains < 0]]

    def _change(self, k: int, j: int) -> str:
        """Return by how much an objective of the k-th design differs from that of the first."""
        return change_of(self.ranking, j, -self.gains[k, j])

    def _change_and_share(self, k: int, j: int) -> str:
        """Return the same with the share of the range."""
        return self._change(k, j) + _share(self.ranking, abs(self.shares[k, j]))

    def _quantity(self, k: int, j: int) -> str:
        """Return how much of an objective the k-th design gains or loses: "1 kg of mass"."""
        amount = _amount(self.ranking, j, self.gains[k, j])
        return f"{amount} of {self.ranking.objectives.names[j]}"


def change_of(ranking: EfficiencyRanking, j: int, change: float) -> str:
    """Return by how much an objective changes.

    Args:
        ranking: The ranking of the designs.
        j: The objective.
        change: The change of its value, minimised.

    Example:
        >>> change_of(rank_of_efficiency([[1.0, 9.0], [2.0, 4.0]]), 1, -5.0)
        'f2 5 lower'
    """
    template = "lower"
    if change * ranking.objectives.sign[j] > 0:
        template = "higher"
    name = ranking.objectives.names[j]
    return sentence(template, objective=name, amount=_amount(ranking, j, change))


def _amount(ranking: EfficiencyRanking, j: int, change: float) -> str:
    """Return the size of a change of an objective with its unit and the decimals of its values."""
    objectives = ranking.objectives
    unit = objectives.units.get(objectives.names[j], "")
    if unit == "%":  # "9 %" of a share would be another amount
        unit = "points"
    size = number(abs(change), 3, ranking.decimals[j], mark=objectives.decimal)
    return f"{size} {unit}".strip()


def _share(ranking: EfficiencyRanking, share: float, template: str = "share") -> str:
    """Return a share of a range, as it follows an amount; empty beyond the range."""
    if not within_range(share):
        return ""
    return sentence(template, share=percent(share, ranking.objectives.decimal))


@dataclass(frozen=True, eq=False, repr=False)
class Explanation:
    """Why one design: its distances from the best, and the steps that improve an objective.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        row: The row of the design in the ranking.
        behind: ``(m,)`` how far it is from the best value of each objective among the
            Pareto-optimal designs, or of its fixed range, in the unit of the objective, >= 0.
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
        trades: What answers to questions give up for what.

    Example:
        >>> why = explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 1)
        >>> why.shares, why.neighbours
        (array([0.25 , 0.375]), array([0, 2]))
    """

    ranking: EfficiencyRanking
    row: int
    behind: Array
    shares: Array
    neighbours: Rows
    steps: DesignComparison
    dominated_by: int
    trades: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return :attr:`sentences`, wrapped at 80 columns."""
        return wrapped(self.sentences)

    @property
    def best_in(self) -> list[Any]:
        """The objectives in which no design is better; one that is equal for all does not count.

        Example:
            >>> explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 0).best_in
            ['f1']
        """
        # Whatever ranges are fixed.
        is_best = (np.ptp(self.ranking.optimal, axis=0) > 0) & (self.neighbours < 0)
        return [self.ranking.objectives.names[j] for j in np.flatnonzero(is_best)]

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the design is, what it costs, and what each step costs.

        The first sentence says what it is among the others. The second has its distances from the
        best values, the greatest share first. One sentence for the step towards each objective
        follows, in the same order; the design named gives up least.

        Example:
            >>> for line in explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 1).sentences:
            ...     print(line)
            Proposed: design 1, the nearest to the best values.
            What it costs against the best: 3 in f2 (38 % of its range) and 1 in f1 (25 %).
            Design 2: f2 3 lower. But f1 3 higher.
            Design 0: f1 1 lower. But f2 5 higher.
        """
        steps = [self.steps.sentence("step", k) for k in self.step_order()]
        standing = " ".join(filter(None, [self.standing, self.ties]))
        return (standing, self.costs, *self.trades, *steps)

    @property
    def standing(self) -> str:
        """What the design is among the others, and in which objectives it is the best.

        Example:
            >>> explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 0).standing
            'Design 0, the best in f1: place 2 of the 3 designs that no other dominates.'
        """
        return self.standing_of(self.ranking.name_of(self.row))

    def standing_of(self, design: str) -> str:
        """Return :attr:`standing` with another name of the design, such as one with its values."""
        ranking = self.ranking
        if self.dominated_by >= 0:
            other = ranking.name_of(self.dominated_by)
            difference = _compared(ranking, [self.row, self.dominated_by]).difference(1)
            design = capital(design)
            return sentence("dominated", design=design, other=other, difference=difference)
        n_optimal = ranking.pareto.sum()
        best = ""
        if n_optimal == 1:
            best = sentence("only")
        elif self.best_in:
            best = sentence("best", objectives=listed(self.best_in))
        if self.row in ranking.salukvadze:
            return sentence("optimum", design=design, best=best or sentence("nearest"))
        design = ", ".join(filter(None, [capital(design), best]))
        place = ranking.place[self.row]
        return sentence("ranked", design=design, place=place, front=n_optimal)

    @property
    def ties(self) -> str:
        """How many designs share the place of the proposed one; empty if none does.

        Example:
            >>> explain([[1.0, 2.0], [2.0, 1.0]], 0).ties
            '2 designs are equally near to the best values.'
        """
        n_optima = len(self.ranking.salukvadze)
        if self.row not in self.ranking.salukvadze or n_optima == 1:
            return ""
        return sentence("ties", count=n_optima)

    @property
    def costs(self) -> str:
        """How far the design is from the best values, the greatest share of a range first.

        Example:
            >>> explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 0).costs
            'What it costs against the best: 8 in f2 (100 % of its range).'
        """
        return self.costs_with("{}{}")

    def costs_with(self, form: str) -> str:
        """Return :attr:`costs` with its amounts, and their shares of a range, in another form.

        Example:
            >>> explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 0).costs_with("*{}*{}")
            'What it costs against the best: *8 in f2* (100 % of its range).'
        """
        changes = [form.format(*amount) for amount in self._amounts()]
        measure = "fixed" if self.ranking.frame.is_fixed else "best"
        if not changes:
            return sentence(f"all {measure}")
        return sentence(f"costs {measure}", changes=listed(changes))

    def _amounts(self) -> list[tuple[str, str]]:
        """Return the amounts in :attr:`costs`, each with its share of a range behind it."""
        order = by_size(self.shares)
        columns = order[self.behind[order] > 0]
        amounts: list[tuple[str, str]] = []
        template = "first share"
        for j in columns[:MOST_COSTS]:
            name = self.ranking.objectives.names[j]
            amount = _amount(self.ranking, j, self.behind[j])
            share = _share(self.ranking, self.shares[j], template)
            amounts.append((sentence("change", objective=name, amount=amount), share))
            template = "share"
        if len(columns) > MOST_COSTS:
            amounts.append((counted(len(columns) - MOST_COSTS, "other objective"), ""))
        return amounts

    def step_order(self) -> list[int]:
        """Return which of :attr:`steps` improve an objective, the one farthest behind first.

        Example:
            >>> explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 1).step_order()
            [2, 1]
        """
        rows = self.steps.rows.tolist()
        towards = dict.fromkeys(self.neighbours[by_size(self.shares)].tolist())
        return [rows.index(row) for row in towards if row >= 0]


@np.errstate(over="ignore", invalid="ignore")  # a dominated design may be infinitely far
def explain(
    F: Any,
    design: int | str | None = None,
    *,
    row: int | None = None,
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
            Of :class:`pymoo_psi.Preferences` the explanation adds what the answers give up.
        design: The number of the design's test or its label; for an array its row from 0. By
            default the Salukvadze optimum, of preferences the proposal. A data frame with the
            labels 0, 1, … is like an array; write other integer labels as texts, because ``3`` may
            be a label or a row.
        row: The row of the design in ``F``, from 0, instead of ``design``.
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
        Proposed: B, the nearest to the best values.
        What it costs against the best: 10 in yield (33 % of its range) and 1 € in cost
        (25 %).
        C: yield 10 higher. But cost 3 € higher.
        A: cost 1 € lower. But yield 20 lower.
    """
    trades: tuple[str, ...] = ()
    if source_type(F) == "preferences":
        trades = F.trades(units)
        if row is None and design is None:
            row = F.row
        F = F.ranking
    ranking = with_units(rank_of_efficiency(F, maximize=maximize), units)
    if row is None and design is None:
        row = int(ranking.salukvadze[0])
    elif row is None:
        row = _row_of_design(design, F, ranking)
    elif design is None:
        row = ranked_row("row", row, F, ranking)
    else:
        raise invalid("design", "left out where row is given", design)
    return _explanation_of(ranking, row, trades)


def _explanation_of(ranking: EfficiencyRanking, row: int, trades: tuple[str, ...]) -> Explanation:
    """Return :func:`explain` of a row of a ranking."""
    front = ranking.front
    values = _values(ranking, np.append(row, front))
    own = values[:1]
    behind = ranking.frame.behind(own)
    # The Pareto set as seen from the design.
    gains = own - values[1:]
    steps = gains / ranking.lengths
    losses = np.fmax(-steps, 0).max(axis=1)
    distances = np.linalg.norm(steps, axis=1)
    distances[np.isnan(distances)] = np.inf
    neighbours = np.full(len(ranking.lengths), -1)
    for j, gain in enumerate(gains.T):
        nearest = _least_loss(gain, STEP * ranking.lengths[j], losses, distances)
        if len(nearest):
            neighbours[j] = front[nearest[gain[nearest].argmax()]]
    dominated_by = -1
    if not ranking.pareto[row]:
        # The least loss need not be 0: a value in a chain of close ones may be in another group
        # here than among all designs, where the dominance was found.
        dominating = np.flatnonzero(losses == losses.min())
        dominated_by = int(front[_least(dominating, distances)[0]])
    targets = dict.fromkeys(neighbours[neighbours >= 0].tolist())
    return Explanation(
        ranking=ranking,
        row=row,
        behind=behind[0],
        shares=ranking.frame.shares(behind)[0],
        neighbours=neighbours,
        steps=_compared(ranking, [row, *targets]),
        dominated_by=dominated_by,
        trades=trades,
    )


def _least_loss(gain: Array, step: float, losses: Array, distances: Array) -> Rows:
    """Return which Pareto-optimal designs give up least for an objective, and are the nearest.

    Args:
        gain: ``(k,)`` by how much they are better in it.
        step: By how much they should be; if none is, those that are better at all count.
        losses: ``(k,)`` their greatest losses in another one, in units of the ranges.
        distances: ``(k,)`` how far they are, in the same units.
    """
    better = np.flatnonzero(gain > 0)
    far = better[gain[better] >= step]
    if len(far):
        better = far
    return _least(better, losses, distances)


def compare_designs(
    F: Any,
    designs: Sequence[int | str] | None = None,
    *,
    rows: Sequence[int] | None = None,
    maximize: Collection[Any] = (),
    units: Mapping[Any, str] | None = None,
) -> DesignComparison:
    """Compare designs with the first of them by gains and losses.

    Args:
        F: A test table, objective values or a ranking, as for :func:`explain`; the ranges are those
            of its Pareto-optimal designs.
        designs: Two designs or more, each as for :func:`explain`.
        rows: The rows of the designs in ``F``, from 0, instead of ``designs``.
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
        Design 0 against design 1: f1 1 lower. But f2 5 higher.
        Design 2 against design 1: f2 3 lower. But f1 3 higher.
    """
    ranking = with_units(rank_of_efficiency(F, maximize=maximize), units)
    if rows is None:
        entries = collection("designs", designs, "a list of designs")
        ranked = [_row_of_design(design, F, ranking) for design in entries]
    elif designs is None:
        ranked = [ranked_row("rows", row, F, ranking) for row in rows]
    else:
        raise invalid("designs", "left out where rows are given", designs)
    if len(ranked) < 2:
        raise invalid("designs", "two designs or more", Received(f"{len(ranked)}"))
    return _compared(ranking, ranked)


def _least(rows: Rows, *measures: Array) -> Rows:
    """Return the rows of the least measure; each measure decides between those that tie before."""
    for measure in measures:
        measured = measure[rows]
        rows = rows[measured <= measured.min(initial=np.inf) + TIE]
    return rows


@np.errstate(over="ignore", invalid="ignore")
def _compared(ranking: EfficiencyRanking, rows: Sequence[int]) -> DesignComparison:
    """Return the comparison of one design or more with the first."""
    values = _values(ranking, np.append(rows, ranking.front))[: len(rows)]
    gains = values[0] - values + 0.0  # no -0.0
    shares = ranking.frame.shares(gains)
    return DesignComparison(ranking, np.array(rows, dtype=np.intp), gains, shares)


def _values(ranking: EfficiencyRanking, rows: Rows) -> Array:
    """Return the objectives of designs, minimised; values equal up to rounding coincide."""
    objectives = ranking.objectives
    return without_rounding(objectives.values[rows] * objectives.sign)


def within_range(share: float) -> bool:
    """Whether a difference is within the range of its objective; beyond it, only units tell."""
    return share <= 1 + TIE  # NaN is not


def by_size(shares: AnyArray) -> Rows:
    """Return the positions of shares, the largest first, NaN last; those that tie as they are."""
    return np.argsort(-np.round(shares / TIE), kind="stable")


def _row_of_design(design: Any, F: Any, ranking: EfficiencyRanking) -> int:
    """Return the row in the ranking of a design by its label or its number."""
    if source_type(F) != "table":
        return ranking.row_of(design)
    return ranked_row("design", F.row_of(design), F, ranking)


def ranked_row(name: str, row: int, F: Any, ranking: EfficiencyRanking) -> int:
    """Return the row in the ranking of a row of F.

    Of a table only feasible designs are ranked, and each once, by its first test.
    """
    is_table = source_type(F) == "table"
    n = len(F) if is_table else len(ranking.rows)
    if integer(name, row, minimum=0) >= n:
        raise invalid(name, f"a row of F, from 0 to {n - 1}", row)
    if not is_table:
        return int(row)
    row = int(F.ranked_as[row])
    ranked = np.flatnonzero(ranking.rows == row)
    if not len(ranked):
        received = Received(f"{F.names[row]}, which is {F.status[row]}")
        remedy = "violations() and reasons of the table say why"
        raise invalid(name, "a feasible design", received, remedy)
    return int(ranked[0])
