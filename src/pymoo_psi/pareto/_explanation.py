"""Why a design: how far it is from the best, and what others would give and take.

Everything is measured against the Pareto set: the best and the worst value of a criterion are
those of the Pareto-optimal designs, and their difference is its range. The neighbour of a design
towards a criterion is the nearest Pareto-optimal design, by the Euclidean distance in units of the
ranges, that is better in it by 1 % of its range or more, or, if there is none, better at all: the
smallest change that helps the criterion. What else changes on the way is the cost of that step.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._tables import Shown
from pymoo_psi._validation import Received, counted, integer, invalid
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.pareto._ranking import EfficiencyRanking, rank_of_efficiency
from pymoo_psi.pareto._rounding import settled, unit_lengths
from pymoo_psi.pareto._sentences import capital, label, listed, number, percent, wrapped

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

# Shares and distances closer than this, relatively, are told as equal. Far above rounding, so that
# designs that lie symmetrically tie; far below what anybody would call a difference.
_TIE = 1e-9
# Of the range. Nobody takes a smaller step, and on a dense front the nearest design that is better
# at all would tell nothing: there both differences are next to nothing.
_STEP = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class DesignComparison(Shown):
    """What k designs give and take against the first of them.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        rows: ``(k,)`` which designs are compared; the others with the first.
        units: Units of criteria by name.
        gains: ``(k, m)`` by how much each design is better than the first, in the units of the
            criteria; below 0 where it is worse, 0 where both are equal up to rounding. More is
            better here for each criterion, whether it is minimised or maximised.
        shares: ``(k, m)`` the gains as shares of the ranges of the Pareto set; NaN where a design
            differs in a criterion in which all Pareto-optimal designs are equal.

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
        """Return which designs are compared."""
        labels = [label(self.ranking, row) for row in self.rows]
        return f"DesignComparison({', '.join(labels[1:])} against {labels[0]})"

    def __str__(self) -> str:
        """Return a sentence for each design after the first, wrapped at 80 columns."""
        return wrapped(self.sentences)

    @property
    def sentences(self) -> tuple[str, ...]:
        """One sentence for each design after the first: where it is better, where worse.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [0, 1]).sentences
            ('Design 1 against design 0: better in f2 by 5 (62 % of its range); worse in f1 by 1
            (25 %).',)
        """
        first = label(self.ranking, self.rows[0])
        return tuple(
            f"{capital(label(self.ranking, row))} against {first}: {self.difference(k)}."
            for k, row in enumerate(self.rows[1:].tolist(), start=1)
        )

    def difference(self, k: int) -> str:
        """Return where the k-th design compared is better than the first, and where worse.

        Example:
            >>> compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0]).difference(1)
            'better in f1 by 1 (25 % of its range); worse in f2 by 5 (62 %)'
        """
        gains, shares = self.gains[k], self.shares[k]
        names = self.ranking.objectives.names
        order = np.argsort(-np.abs(shares), kind="stable")  # the largest first, NaN last
        parts, first = [], True
        for word, there in (("better", gains > 0), ("worse", gains < 0)):
            told = []
            for j in order[there[order]]:
                amount = _amount(abs(gains[j]), self.units.get(names[j]), abs(shares[j]), first)
                told.append(f"{names[j]} by {amount}")
                first = False
            if told:
                parts.append(f"{word} in {', '.join(told)}")
        return "; ".join(parts) or "equal in all criteria"

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each design and criterion.

        Returns:
            Columns: ``design`` (its row, or its label in the data frame that was given),
            ``criterion``, ``unit``, ``value``, ``gain`` against the first design (above 0 is
            better) and ``share``, the gain as a share of the range. To have the designs side by
            side: ``frame.pivot(index="criterion", columns="design", values="gain")``.

        Example:
            >>> two = compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [0, 1])
            >>> print(two.to_frame().drop(columns="unit"))
               design criterion  value  gain  share
            0       0        f1    1.0   0.0  0.000
            1       0        f2    9.0   0.0  0.000
            2       1        f1    2.0  -1.0 -0.250
            3       1        f2    4.0   5.0  0.625
        """
        import pandas as pd

        objectives = self.ranking.objectives
        m = len(objectives.names)
        return pd.DataFrame(
            {
                "design": [objectives.labels[row] for row in self.rows for _ in range(m)],
                "criterion": list(objectives.names) * len(self.rows),
                "unit": [self.units.get(name, "") for name in objectives.names] * len(self.rows),
                "value": objectives.values[self.rows].ravel(),
                "gain": self.gains.ravel(),
                "share": self.shares.ravel(),
            }
        )


@dataclass(frozen=True, eq=False, repr=False)
class Explanation(Shown):
    """Why one design: its distances from the best, and the steps to its neighbours.

    Attributes:
        ranking: The ranking of all n designs, with their objectives, names and labels.
        row: The design.
        units: Units of criteria by name.
        behind: ``(m,)`` how far it is from the best value of each criterion among the
            Pareto-optimal designs, in the unit of the criterion, >= 0.
        shares: ``(m,)`` the same as shares of the ranges: 0 the best, 1 the worst of the Pareto
            set, more only for a dominated design. 0 in a criterion that is equal for all, NaN if a
            dominated design differs in it.
        neighbours: ``(m,)`` for each criterion the nearest Pareto-optimal design, in units of the
            ranges, that is better in it by 1 % of its range or, if there is none, better at all;
            of designs equally near the one that gains most; -1 where none is better.
        steps: The neighbours against the design: gains, and what they cost. The design itself
            stands first, then the neighbours, each once, in the order of the criteria.
        dominated_by: The nearest Pareto-optimal design that is nowhere worse and somewhere better;
            -1 if there is none, because the design is Pareto optimal itself.

    Example:
        >>> why = explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 1)
        >>> why.shares, why.weakest, why.neighbours
        (array([0.25 , 0.375]), ('f2',), array([0, 2]))
    """

    ranking: EfficiencyRanking
    row: int
    units: Mapping[Any, str]
    behind: Array
    shares: Array
    neighbours: Rows
    steps: DesignComparison
    dominated_by: int

    def __repr__(self) -> str:
        """Return which design is explained, and where it is weakest."""
        weakest = ", ".join(map(str, self.weakest)) or "none"
        return f"Explanation({label(self.ranking, self.row)}: weakest criterion {weakest})"

    def __str__(self) -> str:
        """Return :attr:`sentences`, wrapped at 80 columns."""
        return wrapped(self.sentences)

    @property
    def weakest(self) -> tuple[Any, ...]:
        """The criterion with the greatest share of its range lost; all of them if several tie.

        Empty if the design is the best in each.

        Example:
            >>> explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 0).weakest
            ('f2',)
        """
        most = np.nanmax(np.append(self.shares, 0.0))
        if most == 0:
            return ()
        tied = self.shares >= most * (1 - _TIE)
        return tuple(self.ranking.objectives.names[j] for j in np.flatnonzero(tied))

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the design is, how far from the best, and what each step costs.

        First what it is among the others, second its distances from the best, the weakest
        criterion first, then one sentence for the step towards each criterion, in the same order.

        Example:
            >>> for line in explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 1).sentences:
            ...     print(line)
            Design 1 is the Salukvadze optimum: the nearest of 3 Pareto-optimal designs to the
            ideal point.
            Behind the best in f2 by 3 (38 % of its range), f1 by 1 (25 %); weakest in f2.
            Towards f2: design 2 is better in f2 by 3 (38 % of its range); worse in f1 by 3 (75 %).
            Towards f1: design 0 is better in f1 by 1 (25 % of its range); worse in f2 by 5 (62 %).
        """
        # By share, and NaN, which compares with nothing, first.
        order = np.lexsort((-np.nan_to_num(self.shares), ~np.isnan(self.shares)))
        at = {row: k for k, row in enumerate(self.steps.rows.tolist())}
        towards: dict[int, list[str]] = {}  # a neighbour towards several criteria is told once
        for j in order[self.neighbours[order] >= 0]:
            name = str(self.ranking.objectives.names[j])
            towards.setdefault(int(self.neighbours[j]), []).append(name)
        steps = [
            f"Towards {listed(names)}: {label(self.ranking, neighbour)} is "
            f"{self.steps.difference(at[neighbour])}."
            for neighbour, names in towards.items()
        ]
        return (self._standing(), self._distances(order), *steps)

    def _standing(self) -> str:
        """Return what the design is among the others."""
        ranking, row = self.ranking, self.row
        name, n = capital(label(ranking, row)), int(ranking.pareto.sum())
        front = counted(n, "Pareto-optimal design")
        if self.dominated_by >= 0:
            better = compared(ranking, [row, self.dominated_by], self.units)
            by = label(ranking, self.dominated_by)
            return f"{name} is dominated: {by} is {better.difference(1)}."
        if n == 1:
            return f"{name} is the only Pareto-optimal design."
        if row in ranking.salukvadze:
            if len(ranking.salukvadze) == 1:
                return (
                    f"{name} is the Salukvadze optimum: the nearest of {front} to the ideal point."
                )
            ties = f"{len(ranking.salukvadze)} of {front} that are equally near to the ideal point"
            return f"{name} is a Salukvadze optimum: one of {ties}."
        return f"{name} is one of {front}, of rank of efficiency {ranking.rank[row]}."

    def _distances(self, order: NDArray[np.intp]) -> str:
        """Return how far the design is from the best, criteria in the order given."""
        names, frame = self.ranking.objectives.names, self.ranking.frame
        behind = order[self.behind[order] > 0]
        if not len(behind):
            return "It is the best in every criterion."
        told = [
            f"{names[j]} by "
            + _amount(self.behind[j], self.units.get(names[j]), self.shares[j], first=k == 0)
            for k, j in enumerate(behind)
        ]
        parts = [f"Behind the best in {', '.join(told)}"]
        if len(told) > 1 and self.weakest:
            parts.append(f"weakest in {listed(self.weakest)}")
        constant = np.isinf(unit_lengths(frame.ideal, frame.nadir))
        for what, which in (("the best", ~constant), ("the same as all", constant)):
            if (there := np.flatnonzero(which & (self.behind == 0))).size:
                parts.append(f"{what} in {listed([names[j] for j in there])}")
        return "; ".join(parts) + "."

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each criterion.

        Returns:
            Index: the criteria. Columns: ``unit``, ``value`` of the design, ``best`` and ``worst``
            of the Pareto set, ``behind`` (how far from the best), ``share`` of the range,
            ``neighbour`` (row or label of the design of the step, missing where none is better),
            ``gain`` of the step in the criterion itself. What it costs in the others:
            ``explanation.steps.to_frame()``.

        Example:
            >>> why = explain([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], 0, units={"f1": "kg"})
            >>> print(why.to_frame())
               unit  value  best  worst  behind  share neighbour  gain
            f1   kg    1.0   1.0    5.0     0.0    0.0      None   NaN
            f2         9.0   1.0    9.0     8.0    1.0         1   5.0
        """
        import pandas as pd

        objectives = self.ranking.objectives
        at = {row: k for k, row in enumerate(self.steps.rows.tolist())}
        there = [int(row) for row in self.neighbours]
        return pd.DataFrame(
            {
                "unit": [self.units.get(name, "") for name in objectives.names],
                "value": objectives.values[self.row],
                "best": self.ranking.ideal,
                "worst": self.ranking.nadir,
                "behind": self.behind,
                "share": self.shares,
                "neighbour": pd.array(
                    [objectives.labels[row] if row >= 0 else None for row in there], dtype=object
                ),
                "gain": [
                    self.steps.gains[at[row], j] if row >= 0 else np.nan
                    for j, row in enumerate(there)
                ],
            },
            index=pd.Index(objectives.names),
        )


def explain(
    F: Any,
    i: int | str,
    *,
    normalize: bool = True,
    maximize: Collection[Any] = (),
    units: Mapping[Any, str] | None = None,
) -> Explanation:
    """Say why a design: how far it is from the best, and what a step to a neighbour costs.

    The range of a criterion is that of the Pareto-optimal rows, from the best to the worst value.
    The neighbour towards a criterion is the nearest Pareto-optimal row that is better in it by 1 %
    of its range or more (if there is none, better at all), in the Euclidean distance with each
    criterion in units of its range: the smallest change that helps. What the other criteria lose
    on that step is its cost. Values that are equal up to rounding are equal.

    Args:
        F: ``(n, m)`` objective values, an array or a data frame, whose names and labels are used.
        i: The row of the design, from 0; or its label if that is a text. An integer is always a
            row, whatever the labels are.
        normalize: Of the rank that the sentences tell, as for
            :func:`pymoo_psi.rank_of_efficiency`; distances here are always in units of the ranges.
        maximize: The objectives to be maximised: column indices or, of a data frame, names.
        units: Units of criteria by name, for the sentences and the frame.

    Returns:
        Numbers, a frame (``.to_frame()``) and sentences (``print`` it).

    Raises:
        ArgumentValueError: ``F``, ``maximize`` or ``units`` does not fit, or there is no such row.
        ArgumentTypeError: ``F`` does not hold real numbers; ``i`` is no integer.

    Example:
        >>> import pandas as pd
        >>> F = pd.DataFrame({"cost": [1, 2, 5], "yield": [10, 30, 40]}, index=["A", "B", "C"])
        >>> print(explain(F, 1, maximize=["yield"], units={"cost": "€"}))
        B is the Salukvadze optimum: the nearest of 3 Pareto-optimal designs to the
        ideal point.
        Behind the best in yield by 10 (33 % of its range), cost by 1 € (25 %); weakest
        in yield.
        Towards yield: C is better in yield by 10 (33 % of its range); worse in cost by
        3 € (75 %).
        Towards cost: A is better in cost by 1 € (25 % of its range); worse in yield by
        20 (67 %).
    """
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    return explained(ranking, _row("i", i, ranking), units or {})


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
        Numbers, a frame (``.to_frame()``) and sentences (``print`` it).

    Raises:
        ArgumentValueError: ``F``, ``maximize`` or ``units`` does not fit, there is no such row, or
            there are fewer than two.
        ArgumentTypeError: ``F`` does not hold real numbers; ``rows`` is no list of integers.

    Example:
        >>> print(compare_designs([[1.0, 9.0], [2.0, 4.0], [5.0, 1.0]], [1, 0, 2]))
        Design 0 against design 1: better in f1 by 1 (25 % of its range); worse in f2 by
        5 (62 %).
        Design 2 against design 1: better in f2 by 3 (38 % of its range); worse in f1 by
        3 (75 %).
    """
    if isinstance(rows, str) or not isinstance(rows, (Sequence, np.ndarray)):
        raise ArgumentTypeError(f"rows must be a list of rows of F, got {rows!r:.80}")
    if len(rows) < 2:
        raise invalid("rows", "two rows or more", list(rows))
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    return compared(ranking, [_row("rows", row, ranking) for row in rows], units or {})


@np.errstate(over="ignore", invalid="ignore")  # a dominated design may be infinitely far
def explained(ranking: EfficiencyRanking, row: int, units: Mapping[Any, str]) -> Explanation:
    """Return :func:`explain` of a design that is ranked already."""
    front, values, (own,), lengths = _measured(ranking, [row])
    behind = own - values.min(axis=0)
    distance = np.sqrt((((values - own) / lengths) ** 2).sum(axis=1))
    distance[np.isnan(distance)] = np.inf
    neighbours = np.full(len(own), -1, dtype=np.intp)
    for j in range(len(own)):
        better = values[:, j] < own[j]
        clearly = better & (own[j] - values[:, j] >= _STEP * lengths[j])  # of tiny ranges that is 0
        nearest = _nearest(clearly if clearly.any() else better, distance)
        if len(nearest):
            neighbours[j] = front[nearest[values[nearest, j].argmin()]]
    dominated_by = -1
    if not ranking.pareto[row]:
        # The least excess, not none: a value in a chain of close ones may be settled otherwise
        # here than among all designs, where the dominance was found.
        excess = np.fmax((values - own) / lengths, 0).max(axis=1)
        dominated_by = int(front[_nearest(excess == excess.min(), distance)[0]])
    others = list(dict.fromkeys(neighbours[neighbours >= 0].tolist()))
    steps = compared(ranking, [row, *others], units)
    shares = _shares(behind, lengths)
    return Explanation(ranking, row, units, behind, shares, neighbours, steps, dominated_by)


@np.errstate(over="ignore", invalid="ignore")
def compared(
    ranking: EfficiencyRanking, rows: Sequence[int], units: Mapping[Any, str]
) -> DesignComparison:
    """Return :func:`compare_designs` of designs that are ranked already, one or more."""
    names = ranking.objectives.names
    if unknown := [name for name in units if name not in names]:
        raise invalid("units", f"of criteria among {', '.join(map(str, names))}", unknown[0])
    _, _, own, lengths = _measured(ranking, rows)
    gains = own[0] - own + 0.0  # no -0.0
    shares = _shares(gains, lengths)
    return DesignComparison(ranking, np.array(rows, dtype=np.intp), units, gains, shares)


def instead(ranking: EfficiencyRanking, chosen: Rows, row: int, units: Mapping[Any, str]) -> str:
    """Return what a selector has chosen, and what that gives and takes against a design.

    Args:
        ranking: Of all designs.
        chosen: The rows that the selector has chosen, the first one to be told of; none or more.
        row: The design, in most cases the optimum.
        units: Units of criteria by name.
    """
    if not len(chosen):
        return "no design stands out."
    if row in chosen:
        optimum = ", the optimum itself" if row in ranking.salukvadze else ""
        text = f"{label(ranking, row)}{optimum}."
    else:
        (text,) = compared(ranking, [row, int(chosen[0])], units).sentences
        name = label(ranking, int(chosen[0]))  # which begins the sentence, there as a sentence does
        text = f"{name}{text[len(name) :]}"
    return text + (f" It is the first of {len(chosen)} that are chosen." if len(chosen) > 1 else "")


def _measured(ranking: EfficiencyRanking, rows: Sequence[int]) -> tuple[Rows, Array, Array, Array]:
    """Return the Pareto-optimal rows, their values, those of ``rows``, and the ranges.

    All are minimised, and values that are equal up to rounding are the same number. The range of
    a criterion that is constant is infinite.
    """
    front = np.flatnonzero(ranking.pareto)
    objectives, frame = ranking.objectives, ranking.frame
    wanted = np.concatenate([front, np.array(rows, dtype=np.intp)])
    together = settled(objectives.values[wanted] * objectives.sign)
    lengths = unit_lengths(frame.ideal, frame.nadir)
    return front, together[: len(front)], together[len(front) :], lengths


def _nearest(candidates: NDArray[np.bool_], distance: Array) -> Rows:
    """Return which candidates are nearest, all of them if several tie up to rounding."""
    rows = np.flatnonzero(candidates)
    least = distance[rows].min(initial=np.inf)
    nearest: Rows = rows[distance[rows] <= least * (1 + _TIE)]
    return nearest


def _shares(differences: Array, lengths: Array) -> Array:
    """Return differences in units of the ranges; NaN for one where the range is 0."""
    return np.where(np.isinf(lengths) & (differences != 0), np.nan, differences / lengths + 0.0)


def _row(name: str, value: Any, ranking: EfficiencyRanking) -> int:
    if isinstance(value, str):  # an integer is always a row, whatever the labels are
        labels = enumerate(ranking.objectives.labels)
        rows = [row for row, label in labels if isinstance(label, str) and label == value]
        if len(rows) == 1:
            return rows[0]
        found = Received(f"{value!r}, the label of {len(rows) or 'none'}")
        raise invalid(name, "a row of F from 0, or the label of just one row", found)
    row, n = integer(name, value, minimum=0), len(ranking.rank)
    if row >= n:
        raise invalid(name, f"a row of F, 0 to {n - 1}", Received(f"{row}"))
    return row


def _amount(value: float, unit: str | None, share: float, first: bool) -> str:
    """Return an amount with its unit and its share of the range, which the first one explains."""
    amount = f"{number(value)} {unit}" if unit else number(value)
    if np.isnan(share):  # of a criterion in which all Pareto-optimal designs are equal
        return amount
    return f"{amount} ({percent(share)}{' of its range' if first else ''})"
