"""The values of limits, objectives and weights at which another design is recommended.

The recommended design is the Salukvadze optimum of the designs within the limits or, for weights,
the first by the achievement function. Every answer comes from ranking again, also what would make
several people agree, at the end of this file.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from pymoo_psi._validation import Array, Mask, Rows, known_name, mapping
from pymoo_psi.pareto import (
    capital,
    compare_designs,
    least_weighted,
    listed,
    nearest_to_ideal,
    nondominated,
    number,
    percent,
    sentence,
    terms_from,
    without_rounding,
)
from pymoo_psi.table._formulation import OPEN, ends

if TYPE_CHECKING:
    import pandas as pd

    from pymoo_psi.pareto import UtopianFrame
    from pymoo_psi.table._table import TestTable

Position: TypeAlias = Mapping[str, Any]
"""A name with its date, choice, limits, weights and aspirations, as a formulation has it."""

At: TypeAlias = Callable[[float], Rows]
"""Returns the rows that are recommended at a value."""

# Up to this number of values each is tried; of more, every 64th part, which is then halved.
_MOST_STEPS = 200
_PARTS = 64
# Steps of values and weights, as shares of the way to the end.
_FINE = np.arange(1, 2**20 + 1) / 2**20
_MOST_DESIGNS = 500  # Pareto optimal, of which it is said; of more ranking again takes long
_TIE = 1e-9  # regrets that differ by less are equal
_GREATEST_FACTOR = 1024.0  # by which a weight is multiplied at most
_DOUBLINGS = 10  # how often a weight is doubled, at most, so that two people agree


class _Change(NamedTuple):
    """A row of :func:`switching_values`."""

    kind: str
    column: str
    end: str
    direction: str
    present: float
    value: float
    design: str | None
    exact: bool


class _First(NamedTuple):
    """The first step at which a design is recommended no more.

    Attributes:
        value: The value there, NaN if there is none.
        design: The name of the design that is recommended there, None if there is none.
        exact: Whether every step before was tried.
    """

    value: float
    design: str | None
    exact: bool


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
    changes may follow beyond it, because ranges follow the limits. :meth:`TestTable.switching` is
    the same in sentences.

    Args:
        table: The tests, under the formulation with the limits.
        kinds: What changes: "limit", "value", "weight".
        weights: Weights of objectives by name, 1 by default. With weights or an aspiration, the
            recommendation is the first design of the achievement function, see
            :class:`~pymoo_psi.ReferencePoint`.
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
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> frame = switching_values(table)
        >>> frame[["kind", "column", "direction", "value", "design"]].head(2)
            kind column direction  value        design
        0  limit     f1   tighter    1.0  test point 1
        1  limit     f2   tighter    1.0  test point 3
    """
    import pandas as pd

    for kind in kinds:
        known_name("kinds", kind, ("limit", "value", "weight"))
    preference = {"weights": weights or {}, "aspiration": aspiration or {}}
    for name, values in preference.items():
        for column in mapping(name, values, "objectives to numbers"):
            known_name(name, column, table.layout.objectives)
    search = _Search(table)
    changes: list[_Change] = []
    if "limit" in kinds:
        changes += search.of_limits()
    if "value" in kinds:
        changes += search.of_values()
    if "weight" in kinds and (weights or aspiration):
        changes += search.of_weights(preference)
    frame = pd.DataFrame(changes, columns=_Change._fields)
    designs = [change.design for change in changes]
    frame["design"] = pd.Series(designs, index=frame.index, dtype=object)  # None stays None
    return frame


class _Search:
    """Changes of the recommended design of a table.

    Attributes:
        is_eligible: ``(n,)`` which tests are recommendable under all limits.
        optimal: ``(n,)`` which of them are Pareto optimal.
        frame: The points U and N and the scale of its ranking.
        designs: Rows of its designs, each the first of the tests that repeat it.
        best: Row of the test that is recommended.
    """

    def __init__(self, table: TestTable) -> None:
        self.table = table
        self.layout = table.layout
        self.F = table.F
        self.is_eligible = table.eligible()
        self.optimal = self._optimal(self.is_eligible)
        ranking = table.feasible_ranking()
        self.frame = ranking.frame
        self.designs = ranking.rows
        self.best = ranking.rows[ranking.salukvadze[0]]

    def _optimal(self, is_eligible: Mask) -> Mask:
        """Return ``(n,)`` which tests of a mask are Pareto optimal among them."""
        optimal = is_eligible.copy()
        optimal[is_eligible] = nondominated(self.F[is_eligible])
        return optimal

    def first_change(self, steps: Array, at: At, best: int) -> _First:
        """Return the first of some steps at which a design is recommended no more.

        Args:
            steps: ``(k,)`` values in the order in which they are tried.
            at: Returns what is recommended at a value.
            best: Row of the design.
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
            design = None
            if len(rows):
                design = str(self.table.names[rows[0]])
            return _First(float(steps[step]), design, is_exact)
        return _First(np.nan, None, is_exact)

    def of_limits(self) -> Iterator[_Change]:
        """Yield the changes as limits are tightened, set or loosened."""
        for name in dict.fromkeys([*self.layout.objectives, *self.layout.columns]):
            pair = self._limit(name)
            worse = ""
            if name in self.layout.objectives:
                worse = "lower" if name in self.layout.maximize else "upper"
            for end, limit in zip(("lower", "upper"), pair, strict=True):
                is_set = np.isfinite(limit)
                # On the worse side of an objective a limit rejects no design without those that it
                # dominates: only Pareto-optimal designs count.
                if end == worse:
                    yield self.of_limit(name, end, limit, self.optimal, "tighter")
                elif is_set:
                    yield self.of_limit(name, end, limit, self.is_eligible, "tighter")
                if is_set:
                    free = (OPEN[0], pair[1])
                    if end == "upper":
                        free = (pair[0], OPEN[1])
                    limits = {**self.table.limits, name: free}
                    candidates = self.table.under(limits=limits).eligible()
                    if end == worse:
                        candidates = self._optimal(candidates)
                    yield self.of_limit(name, end, limit, candidates, "looser")

    def of_limit(
        self, name: str, end: str, limit: float, candidates: Mask, direction: str
    ) -> _Change:
        """Return the change as a limit moves over the values that candidates have.

        Args:
            name: The column.
            end: The end.
            limit: The limit, infinite if there is none.
            candidates: ``(n,)`` which tests are within the other limits and, unless it is loosened,
                within this.
            direction: "tighter" or "looser".
        """
        sign = 1.0
        if end == "lower":
            sign = -1.0
        values = sign * self.table.column(name).astype(np.float64)
        steps = np.flip(np.unique(values[candidates]))
        if direction == "looser":
            steps = np.flip(steps[steps > sign * limit])

        def at(value: float) -> Rows:
            within = values <= value
            if direction == "tighter":  # each step leaves out the designs with its value
                within &= values < value
            return _recommended(self.frame, candidates & within, self.F)

        value, design, exact = self.first_change(steps, at, self.best)
        present = np.nan
        if np.isfinite(limit):
            present = limit
        return _Change("limit", name, end, direction, present, sign * value, design, exact)

    def _limit(self, name: str) -> tuple[float, float]:
        """Return the ends of the limit on a column, open ones for texts and without a limit."""
        limit = self.table.limits.get(name, OPEN)
        if isinstance(limit, list):
            return OPEN
        return limit

    def of_values(self) -> Iterator[_Change]:
        """Yield the changes as an objective of the recommended design is another one."""
        # Designs that neither are Pareto optimal nor dominated by this one never count.
        candidates = self.optimal | (self.is_eligible & (self.F[self.best] <= self.F).all(axis=1))
        # Another test of the recommended design is no other design.
        candidates &= np.isin(np.arange(len(candidates)), self.designs)
        for j, name in enumerate(self.layout.objectives):
            length = np.ptp(self.F[self.optimal, j])
            if length > 0:
                yield self.moved(j, name, "better", -length, candidates)
                yield self.moved(j, name, "worse", length, candidates)

    def moved(self, j: int, name: str, direction: str, length: float, candidates: Mask) -> _Change:
        """Return the change as objective j of the recommended design moves by up to a length."""
        sign = self.layout.sign[j]
        start = self.F[self.best, j]
        low, high = self._limit(name)
        steps = start + length * _FINE
        if self.frame.is_fixed:  # nothing is better than a fixed range
            steps = steps[steps >= self.frame.ideal[j]]

        def at(value: float) -> Rows:
            F = self.F.copy()
            F[self.best, j] = value
            mask = candidates.copy()
            mask[self.best] = low <= sign * value <= high
            return _recommended(self.frame, mask, F)

        value, design, exact = self.first_change(steps, at, self.best)
        value -= length * _FINE[0]  # the value up to which the design stays
        return _Change("value", name, "", direction, sign * start, sign * value, design, exact)

    def of_weights(self, preference: Position) -> Iterator[_Change]:
        """Yield the changes of the first design by weights and aspirations."""
        first = _first_by_weights(self.table, preference)
        for name in self.layout.objectives:
            at = partial(first, name)
            present = float(preference["weights"].get(name, 1.0))
            best = at(present)[0]
            for direction, factor in (("less", 1 / _GREATEST_FACTOR), ("more", _GREATEST_FACTOR)):
                steps = present * factor**_FINE
                if present == 0:
                    if direction == "less":
                        continue
                    steps = _FINE
                change = self.first_change(steps, at, best)
                yield _Change("weight", name, "", direction, present, *change)


def _recommended(frame: UtopianFrame, mask: Mask, F: Array) -> Rows:
    """Return the rows that are recommended of the tests of a mask; none if there are none.

    Args:
        frame: That of a ranking of the tests.
        mask: ``(n,)`` which of them count.
        F: ``(n, m)`` their objectives, minimised.
    """
    rows = np.flatnonzero(mask)
    if len(rows) == 0:
        return rows
    return np.asarray(rows[nearest_to_ideal(F[rows], frame)])


def _first_by_weights(table: TestTable, preference: Position) -> Callable[[str, float], Rows]:
    """Return a function from an objective and its weight to the rows that then come first.

    Args:
        table: The table.
        preference: Other ``weights``, and ``aspiration``, by objective.
    """
    ranking = table.feasible_ranking()
    ideal = dict(zip(table.layout.objectives, ranking.ideal.tolist(), strict=True))
    point = np.array([*(ideal | preference["aspiration"]).values()])
    terms = terms_from(ranking, point * table.layout.sign)

    def first(name: str, weight: float) -> Rows:
        weights = dict.fromkeys(ideal, 1.0) | preference["weights"] | {name: weight}
        shares = np.array([*weights.values()])
        return np.asarray(ranking.rows[least_weighted(*terms, shares / shares.max())])

    return first


def switching_sentences(table: TestTable) -> list[str]:
    """Return :meth:`TestTable.switching`."""
    ranking = table.feasible_ranking()
    if ranking.pareto.sum() > _MOST_DESIGNS:
        return []
    frame = switching_values(table, kinds=("limit", "value"))
    design = ranking.name_of(int(ranking.salukvadze[0]))
    names = {"stays": capital(design), "stays by value": design}
    changes: dict[str, list[str]] = {"limit": [], "value": []}
    for row in frame[frame["value"].notna()].to_dict("records"):
        unit = table.layout.units.get(row["column"], "")
        value = f"{_limit_words(row['end'], row['value'])} {unit}".strip()
        other = row["design"] or "none"
        text = sentence("until", column=row["column"], value=value, other=other)
        changes[row["kind"]].append(text)
    sentences = []
    for texts, (template, name) in zip(changes.values(), names.items(), strict=True):
        if texts:
            sentences.append(sentence(template, design=name, changes=listed(texts, "or")))
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
    for latest in latest_positions(positions):
        before = []
        for position in positions:
            if position["name"] == latest["name"] and position is not latest:
                before.append(f"{position['chosen'] or 'none'} ({position['date'][:10]})")
        design = latest["chosen"] or "none"
        if before:
            design += f", before {', '.join(before)}"
        text = sentence("position", name=latest["name"], date=latest["date"][:10], design=design)
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
    latest = latest_positions(table.formulation.positions)
    positions = [position for position in latest if position["chosen"] in rows]
    sentences = []
    for k, one in enumerate(positions):
        for other in positions[:k]:
            if one["chosen"] == other["chosen"]:
                continue
            pair = compare_designs(free, rows=[rows[other["chosen"]], rows[one["chosen"]]])
            text = sentence(
                "apart",
                name=one["name"],
                other=other["name"],
                design=one["chosen"],
                base=other["chosen"],
                difference=pair.difference(1),
            )
            sentences.append(text)
            sentences.append(_reconciled(table, free.frame, one, other, pair.gains[1] < 0))
            sentences.append(_reconciled(table, free.frame, other, one, pair.gains[1] > 0))
    if sentences and table.eligible().any():
        choices = free.objectives.minimized[[rows[one["chosen"]] for one in positions]]
        sentences.append(_least_regret(table, positions, choices, free.lengths))
    return sentences


def _least_regret(
    table: TestTable, positions: Sequence[Position], choices: Array, lengths: Array
) -> str:
    """Return which design all regret least.

    The regret of a design for a position is its greatest loss against the choice of the position,
    in shares of the ranges, each multiplied by the weight of the objective over the greatest one.

    Args:
        table: The tests.
        positions: The p positions.
        choices: ``(p, m)`` objectives of their choices, minimised.
        lengths: ``(m,)`` the ranges.
    """
    ranking = table.feasible_ranking()
    front = ranking.objectives.minimized[ranking.pareto]
    values = without_rounding(np.vstack([choices, front]))
    columns = []
    for position, choice in zip(positions, values, strict=False):
        weights = np.array([position["weights"].get(name, 1.0) for name in table.layout.objectives])
        losses = (values[len(positions) :] - choice) / lengths * (weights / (weights.max() or 1.0))
        columns.append(losses.max(axis=1, initial=0.0) + 0.0)  # no -0
    regrets = np.column_stack(columns)
    keys = (regrets.sum(axis=1), regrets.max(axis=1))
    best = np.lexsort(tuple(np.round(key / _TIE) for key in keys))[0]
    texts = []
    for position, regret in zip(positions, regrets[best], strict=True):
        texts.append(f"{position['name']} {percent(regret)}")
    design = capital(ranking.name_of(int(np.flatnonzero(ranking.pareto)[best])))
    return sentence("least regret", design=design, regrets=", ".join(texts))


def _reconciled(
    table: TestTable, frame: UtopianFrame, one: Position, other: Position, is_better: Mask
) -> str:
    """Return the limit or the weight with which the choice of another comes first for one.

    Tried are a limit at each value in which that choice is better, then twice to 1024 times the
    weight of each such objective.

    Args:
        table: The tests.
        frame: That of a ranking of them.
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
        is_eligible = table.under(limits={**one["limits"], name: [low, high]}).eligible()
        if row in _recommended(frame, is_eligible, table.F):
            unit = layout.units.get(name, "")
            limit = f"{name} {words} {number(value, 6)} {unit}".strip()
            return sentence("by limit", **names, limit=limit)
    tests = table.under(limits=one["limits"])
    if not tests.eligible().any():
        return sentence("not by one", **names)
    first = _first_by_weights(tests, one)
    for name in better:
        weight = one["weights"].get(name) or 1.0
        for _ in range(_DOUBLINGS):
            weight *= 2
            if row in first(name, weight):
                return sentence("by weight", **names, objective=name, weight=number(weight))
    return sentence("not by one", **names)


def _rounded(value: float, direction: str) -> float:
    """Return a value with six digits, rounded in the direction in which a limit lets it pass."""
    return float(Context(prec=6, rounding=direction).create_decimal(repr(value)))
