"""The values of limits, objectives and weights at which another design is recommended.

The recommended design is the Salukvadze optimum of the designs within the limits or, for weights,
the first by the achievement function. Every answer comes from ranking again, also what would make
several people agree, at the end of this file.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from pymoo_psi._validation import Array, Mask, Rows, Values, instance, known_name, mapping
from pymoo_psi.pareto import (
    EfficiencyRanking,
    capital,
    compare_designs,
    listed,
    nondominated,
    number,
    percent,
    rank_of_efficiency,
    sentence,
)
from pymoo_psi.selection._selectors import ReferencePoint
from pymoo_psi.table import OPEN, Limit, TestTable, ends

if TYPE_CHECKING:
    import pandas as pd

Position: TypeAlias = Mapping[str, Any]
"""A name with its date, choice, limits, weights and aspirations, as a formulation has it."""

_MOST_STEPS = 200  # up to so many values each is tried; of more every 64th part, then halves
_PARTS = 64
_FINE = np.arange(1, 2**20 + 1) / 2**20  # steps of values and weights, in shares of the way
_TIE = 1e-9  # regrets that differ by less are equal
_GREATEST_FACTOR = 1024.0  # of a weight
_DOUBLINGS = 10  # of a weight on which two may agree

_COLUMNS = ("kind", "column", "end", "direction", "present", "value", "design", "exact")


def switching_values(
    table: TestTable,
    *,
    kinds: Collection[str] = ("limit", "value", "weight"),
    weights: Mapping[str, float] | None = None,
    aspiration: Mapping[str, float] | None = None,
) -> pd.DataFrame:
    """Return the values of limits, objectives and weights at which the recommendation changes.

    Each limit is tightened and loosened; an objective without a limit on its worse side gets one.
    Each objective value of the recommended design, and each weight, is changed in both directions.
    Everything else stays as it is. The returned value is the nearest change in a direction; more
    changes may follow beyond it, because ranges follow the limits.

    Args:
        table: The tests, under the formulation with the limits.
        kinds: What changes: "limit", "value", "weight".
        weights: Weights of objectives by name, 1 by default. With weights or an aspiration, the
            recommendation is the first design of the achievement function, see
            :class:`ReferencePoint`.
        aspiration: Aspired values of objectives by name, by default the best ones.

    Returns:
        One row for each change: ``kind``, "limit", "value" or "weight"; ``column``; ``end``,
        "lower" or "upper", of a limit; ``direction``, "tighter" or "looser" of a limit, "better" or
        "worse" of a value, "less" or "more" of a weight; ``present``, NaN for a limit that is not
        set; ``value``, up to which the design stays recommended, or, for a looser limit, from which
        it no longer is; NaN if it stays at any value; ``design``, which is recommended then, None
        if it is none or the same; ``exact``, whether every value was tried. Values and weights are
        tried in 64 steps, between which the change is found by bisection.

    Raises:
        ArgumentValueError: No design is feasible, a weight names no objective, or a kind is none.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> frame = switching_values(table)
        >>> frame[["kind", "column", "direction", "value", "design"]].head(2)
            kind column direction  value        design
        0  limit     f1   tighter    1.0  test point 1
        1  limit     f2   tighter    1.0  test point 3
    """
    import pandas as pd

    search = _Search(instance("table", table, TestTable))
    for kind in kinds:
        known_name("kinds", kind, ("limit", "value", "weight"))
    preference = {"weights": weights or {}, "aspiration": aspiration or {}}
    for name, wanted in preference.items():
        for column in mapping(name, wanted, "objectives to numbers"):
            known_name(name, column, table.layout.objectives)
    rows: list[tuple[Any, ...]] = []
    if "limit" in kinds:
        rows += search.of_limits()
    if "value" in kinds:
        rows += search.of_values()
    if "weight" in kinds and (weights or aspiration):
        rows += search.of_weights(preference)
    frame = pd.DataFrame(rows, columns=list(_COLUMNS))
    designs = [row[_COLUMNS.index("design")] for row in rows]
    frame["design"] = pd.Series(designs, index=frame.index, dtype=object)  # None stays None
    return frame


class _Search:
    """Changes of the recommended design of a table.

    Attributes:
        kept: ``(n,)`` which tests are recommendable under all limits.
        best: Row of the test that is recommended.
    """

    def __init__(self, table: TestTable) -> None:
        self.table = table
        self.layout = table.layout
        self.F = table.F
        self.kept = table.eligible()
        self.ranking = table.feasible_ranking()
        self.best = self.ranking.rows[self.ranking.salukvadze[0]]
        self.options: Values = {"normalize": table.formulation.normalize}
        if table.formulation.ranges:
            frame = self.ranking.frame
            self.options |= {"ideal": frame.ideal, "nadir": frame.nadir}

    def recommended(self, mask: Mask, F: Array) -> Rows:
        """Return the rows that are recommended of the tests of a mask; none if there are none."""
        rows = np.flatnonzero(mask)
        if len(rows) == 0:
            return rows
        return rows[rank_of_efficiency(F[rows], **self.options).salukvadze]

    def first_change(
        self, steps: Array, at: Callable[[float], Rows], best: int
    ) -> tuple[float, str | None, bool]:
        """Return the first of some steps at which a design is recommended no more.

        Args:
            steps: ``(k,)`` values in the order in which they are tried.
            at: Returns what is recommended at a value.
            best: Row of the design.

        Returns:
            The value, NaN if there is none; the name of the design that is recommended there, None
            if there is none; and whether every step before was tried.
        """
        count = len(steps)
        is_exact = count <= _MOST_STEPS
        stride = 1
        if not is_exact:
            stride = -(-count // _PARTS)
        before = -1
        while before < count - 1:
            step = min(before + stride, count - 1)
            rows = at(steps[step])
            if best in rows:
                before = step
                continue
            while step - before > 1:
                middle = (step + before) // 2
                rows_there = at(steps[middle])
                if best in rows_there:
                    before = middle
                else:
                    step, rows = middle, rows_there
            names = [str(self.table.names[row]) for row in rows[:1]]
            return float(steps[step]), next(iter(names), None), is_exact
        return np.nan, None, is_exact

    def of_limits(self) -> list[tuple[Any, ...]]:
        """Return the changes as limits are tightened, set or loosened."""
        rows = []
        for name in dict.fromkeys([*self.layout.objectives, *self.layout.columns]):
            pair = self._ends(name)
            worse = ""
            if name in self.layout.objectives:
                worse = "lower" if name in self.layout.maximize else "upper"
            for end, limit in zip(("lower", "upper"), pair, strict=True):
                if np.isfinite(limit):
                    rows.append(self.of_limit(name, end, limit, end == worse, self.kept))
                    kept = self._without(name, end).eligible()
                    rows.append(self.of_limit(name, end, limit, end == worse, kept, "looser"))
                elif end == worse:
                    rows.append(self.of_limit(name, end, np.nan, True, self.kept))
        return rows

    def of_limit(
        self,
        name: str,
        end: str,
        limit: float,
        is_worse: bool,
        kept: Mask,
        direction: str = "tighter",
    ) -> tuple[Any, ...]:
        """Return the change as a limit moves in a direction over the values that designs have.

        Args:
            name: The column.
            end: The end.
            limit: The limit, NaN if there is none.
            is_worse: Whether it is on the worse side of an objective: then it rejects no design
                without those that it dominates, and only Pareto-optimal designs count.
            kept: ``(n,)`` which tests are within the other limits and, unless it is loosened, this.
            direction: "tighter" or "looser".
        """
        values = self.table.column(name).astype(np.float64)
        sign = 1.0
        if end == "lower":
            sign = -1.0
        candidates = kept.copy()
        if is_worse:
            candidates[kept] = nondominated(self.F[kept])
        steps = np.flip(np.unique(sign * values[candidates]))
        if direction == "looser":
            steps = np.flip(steps[steps > sign * limit])

        def at(value: float) -> Rows:
            within = sign * values <= sign * value
            if direction == "tighter":  # at each step the designs with its value leave
                within &= values != value
            return self.recommended(candidates & within, self.F)

        change = self.first_change(sign * steps, at, self.best)
        return ("limit", name, end, direction, limit, *change)

    def _without(self, name: str, end: str) -> TestTable:
        """Return the table without one end of a limit."""
        low, high = self._ends(name)
        if end == "upper":
            high = np.inf
        else:
            low = -np.inf
        return self.table.under(limits={**self.table.limits, name: (low, high)})

    def _ends(self, name: str) -> tuple[float, float]:
        """Return the ends of the limit on a column, open ones for texts and without a limit."""
        limit = self.table.limits.get(name, OPEN)
        if isinstance(limit, list):
            return OPEN
        return limit

    def of_values(self) -> list[tuple[Any, ...]]:
        """Return the changes as an objective of the recommended design is another one."""
        optimal = self.kept.copy()
        optimal[self.kept] = nondominated(self.F[self.kept])
        # Designs that neither are Pareto optimal nor dominated by this one never count.
        candidates = optimal | (self.kept & (self.F[self.best] <= self.F).all(axis=1))
        rows = []
        for j, name in enumerate(self.layout.objectives):
            length = np.ptp(self.F[optimal, j])
            if length > 0:
                rows.append(self.moved(j, name, "better", -length, candidates))
                rows.append(self.moved(j, name, "worse", length, candidates))
        return rows

    def moved(
        self, j: int, name: str, direction: str, length: float, candidates: Mask
    ) -> tuple[Any, ...]:
        """Return the change as objective j of the recommended design moves by up to a length."""
        sign = self.layout.sign[j]
        start = self.F[self.best, j]
        low, high = self._ends(name)
        steps = start + length * _FINE
        if "ideal" in self.options:  # nothing is better than the better end of a fixed range
            steps = steps[steps >= self.options["ideal"][j]]

        def at(value: float) -> Rows:
            F = self.F.copy()
            F[self.best, j] = sign * value
            mask = candidates.copy()
            mask[self.best] = low <= value <= high
            return self.recommended(mask, F)

        value, *change = self.first_change(sign * steps, at, self.best)
        value -= sign * length * _FINE[0]  # up to which it stays
        return ("value", name, "", direction, sign * start, value, *change)

    def of_weights(self, preference: Position) -> list[tuple[Any, ...]]:
        """Return the changes of the first design by weights and aspirations."""
        rows = []
        for name in self.layout.objectives:
            at = partial(_first, self.table, self.ranking, preference, name)
            present = float(preference["weights"].get(name, 1.0))
            best = at(present)[0]
            for direction, factor in (("less", 1 / _GREATEST_FACTOR), ("more", _GREATEST_FACTOR)):
                steps = (present or 1.0) * factor**_FINE
                if present == 0:
                    steps = _FINE
                change = self.first_change(steps, at, best)
                rows.append(("weight", name, "", direction, present, *change))
        return rows


def _first(
    table: TestTable, ranking: EfficiencyRanking, preference: Position, name: str, weight: float
) -> Rows:
    """Return the rows of a table that come first by weights and aspirations.

    Args:
        table: The table.
        ranking: Its ranking.
        preference: ``weights`` and ``aspiration`` by objective.
        name: An objective with another weight.
        weight: This weight.
    """
    weights = {**preference["weights"], name: weight}
    objectives = table.layout.objectives
    pairs = zip(objectives, ranking.ideal, strict=True)
    selector = ReferencePoint(
        [preference["aspiration"].get(objective, ideal) for objective, ideal in pairs],
        weights=[weights.get(objective, 1.0) for objective in objectives],
        normalize=table.formulation.normalize,
    )
    return np.asarray(ranking.rows[selector.do(ranking)])


def switching_sentences(table: TestTable, frame: pd.DataFrame) -> list[str]:
    """Return switching values of limits and of values as sentences.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> switching_sentences(table, switching_values(table))[0]
        'Test point 2 stays proposed until f1 at most 1 (then test point 1) or f2 at most 1 (then
        test point 3).'
    """
    ranking = table.feasible_ranking()
    design = capital(ranking.name_of(int(ranking.salukvadze[0])))
    sentences = []
    for kind, template in (("limit", "stays"), ("value", "stays by value")):
        changes = []
        for row in frame[frame["value"].notna()].to_dict("records"):
            if row["kind"] != kind:
                continue
            unit = table.layout.units.get(row["column"], "")
            value = f"{_limit_words(row['end'], row['value'])} {unit}".strip()
            other = row["design"] or "none"
            changes.append(sentence("until", column=row["column"], value=value, other=other))
        if changes:
            sentences.append(sentence(template, design=design, changes=listed(changes, "or")))
    return sentences


def _limit_words(end: str, value: float) -> str:
    """Return a limit, or without an end a value, rounded so that the limit lets the value pass."""
    if end == "upper":
        return f"at most {number(_rounded(value, ROUND_CEILING), 6)}"
    if end == "lower":
        return f"at least {number(_rounded(value, ROUND_FLOOR), 6)}"
    return number(value)


# Positions of several people


def latest_positions(positions: Sequence[Position]) -> list[Position]:
    """Return what each name holds last, in the order in which the names first occur.

    Args:
        positions: Those of a :class:`~pymoo_psi.table.Formulation`, in the order of their dates.
    """
    return [*{one["name"]: one for one in positions}.values()]


def group_sentences(table: TestTable) -> list[str]:
    """Return the positions of a table's formulation, what separates them, and what was decided."""
    formulation = table.formulation
    sentences = position_sentences(formulation.positions)
    sentences += separation_sentences(table)
    return sentences + decision_sentences(formulation.decided)


def position_sentences(positions: Sequence[Position]) -> list[str]:
    """Return what each name holds since when, and what it held before."""
    sentences = []
    for held in latest_positions(positions):
        history = [one for one in positions if one["name"] == held["name"]]
        former = [f"{one['chosen'] or 'none'} ({one['date'][:10]})" for one in history[:-1]]
        design = held["chosen"] or "none"
        if former:
            design += f", before {', '.join(former)}"
        text = sentence("position", name=held["name"], date=held["date"][:10], design=design)
        sentences.append(text)
    return sentences


def decision_sentences(decided: Position | None) -> list[str]:
    """Return what a group has decided, and who dissents."""
    if decided is None:
        return []
    agree = listed(decided["agree"] or ["nobody"])
    date = decided["date"][:10]
    sentences = [sentence("decided", date=date, design=decided["chosen"], agree=agree)]
    if decided["dissent"]:
        sentences.append(sentence("dissent", dissent=listed(decided["dissent"])))
    return sentences


def separation_sentences(table: TestTable) -> list[str]:
    """Return what separates the positions of a table's formulation, and what all regret least."""
    if not table.formulation.positions:
        return []
    free = table.under(limits={}).feasible_ranking()
    rows = {free.name_of(row): row for row in range(len(free.rows))}
    held = []
    for one in latest_positions(table.formulation.positions):
        if one["chosen"] in rows:
            held.append(one)
    sentences = []
    for k, one in enumerate(held):
        for other in held[:k]:
            if one["chosen"] == other["chosen"]:
                continue
            places = [rows[other["chosen"]], rows[one["chosen"]]]
            pair = compare_designs(free, rows=places)
            text = sentence(
                "apart",
                name=one["name"],
                other=other["name"],
                design=one["chosen"],
                base=other["chosen"],
                difference=pair.difference(1),
            )
            sentences.append(text)
            sentences.append(_reconciled(table, one, other, pair.gains[1] < 0))
            sentences.append(_reconciled(table, other, one, pair.gains[1] > 0))
    if sentences and table.eligible().any():
        choices = [free.objectives.minimized[rows[one["chosen"]]] for one in held]
        sentences.append(_least_regret(table, held, choices, free.lengths))
    return sentences


def _least_regret(
    table: TestTable, held: Sequence[Position], choices: Sequence[Array], lengths: Array
) -> str:
    """Return which design all regret least.

    The regret of a design for a position is its greatest loss against the choice of the position,
    in shares of the ranges, each multiplied by the weight of the objective over the greatest one.

    Args:
        table: The tests.
        held: The positions.
        choices: Their choices, each ``(m,)`` objectives, minimised.
        lengths: ``(m,)`` the ranges.
    """
    ranking = table.feasible_ranking()
    minimized = ranking.objectives.minimized[ranking.pareto]
    columns = []
    for one, choice in zip(held, choices, strict=True):
        weights = np.array([one["weights"].get(name, 1.0) for name in table.layout.objectives])
        losses = (minimized - choice) / lengths * (weights / (weights.max() or 1.0))
        columns.append(losses.max(axis=1, initial=0.0) + 0.0)  # no -0
    regrets = np.column_stack(columns)
    keys = (regrets.sum(axis=1), regrets.max(axis=1))
    best = np.lexsort(tuple(np.round(key / _TIE) for key in keys))[0]
    texts = [
        f"{one['name']} {percent(share)}" for one, share in zip(held, regrets[best], strict=True)
    ]
    design = capital(ranking.name_of(int(np.flatnonzero(ranking.pareto)[best])))
    return sentence("least regret", design=design, regrets=", ".join(texts))


def _reconciled(table: TestTable, one: Position, other: Position, is_better: Mask) -> str:
    """Return the limit or the weight with which the choice of another comes first for one.

    Tried are a limit at each value in which that choice is better, then twice to 1024 times the
    weight of each such objective.

    Args:
        table: The tests.
        one: A position.
        other: Another one.
        is_better: ``(m,)`` in which objectives the choice of the other is better.
    """
    layout = table.layout
    names = {"name": one["name"], "other": other["name"], "design": other["chosen"]}
    row = table.names.index(other["chosen"])
    better = np.array(layout.objectives)[is_better].tolist()
    for name in better:
        value = float(table.column(name)[row])
        low, high = ends(name, one["limits"].get(name, (None, None)))
        words = "at most"
        if name in layout.maximize:
            words = "at least"
            low = value = _rounded(value, ROUND_FLOOR)
        else:
            high = value = _rounded(value, ROUND_CEILING)
        if low > high:  # the other end rejects that choice
            continue
        if row in _proposed(table, {**one["limits"], name: [low, high]}):
            unit = layout.units.get(name, "")
            limit = f"{name} {words} {number(value, 6)} {unit}".strip()
            return sentence("by limit", **names, limit=limit)
    tests = table.under(limits=one["limits"])
    if not tests.eligible().any():
        return sentence("not by one", **names)
    ranking = tests.feasible_ranking()
    for name in better:
        weight = one["weights"].get(name) or 1.0
        for _ in range(_DOUBLINGS):
            weight *= 2
            if row in _first(tests, ranking, one, name, weight):
                return sentence("by weight", **names, objective=name, weight=number(weight))
    return sentence("not by one", **names)


def _rounded(value: float, direction: str) -> float:
    """Return a value with six digits, rounded in the direction in which a limit lets it pass."""
    return float(Context(prec=6, rounding=direction).create_decimal(repr(value)))


def _proposed(table: TestTable, limits: Mapping[str, Limit]) -> Rows:
    """Return the rows of the designs that are proposed under limits."""
    tests = table.under(limits=limits)
    if not tests.eligible().any():
        return np.array([], dtype=np.intp)
    ranking = tests.feasible_ranking()
    return ranking.rows[ranking.salukvadze]
