"""The values of limits, objectives and weights at which another design is recommended.

The recommended design is the Salukvadze optimum of the designs within the limits or, for weights,
the first by the achievement function. Every answer comes from ranking again.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._names import asked_under_a_formulation
from pymoo_psi._validation import Array, Mask, Rows, instance, known_name, mapping
from pymoo_psi.pareto import (
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
from pymoo_psi.table import Limit, TestTable, ends

if TYPE_CHECKING:
    import pandas as pd

_MOST_STEPS = 200  # up to so many values each is tried; of more every 64th part, then halves
_PARTS = 64
_TRIED_VALUES = 16  # of an objective of the recommended design, on each side
_HALVINGS = 16
_TIE = 1e-9  # regrets that differ by less are equal
_GREATEST_FACTOR = 1024.0  # of a weight

_COLUMNS = ("kind", "column", "end", "direction", "present", "value", "design", "exact")


@asked_under_a_formulation
def switching_values(
    table: TestTable,
    *,
    kinds: Collection[str] = ("limit", "value", "weight"),
    weights: Mapping[str, float] | None = None,
    aspiration: Mapping[str, float] | None = None,
) -> pd.DataFrame:
    """Return at which values of limits, objectives and weights another design is recommended.

    Limits that are in force are tightened and loosened, and those that no objective has on its
    worse side are set; the objectives of the recommended design are changed as if it were offered
    otherwise; all else stays. The value is that of the next change in a direction. As ranges follow
    the limits, there may be more changes beyond it.

    Args:
        table: The tests, under the formulation with the limits.
        kinds: What changes: "limit", "value", "weight".
        weights: Weights of objectives by name, 1 unless given; with these or an aspiration, what
            changes the first design of the achievement function, see :class:`ReferencePoint`.
        aspiration: Wanted values of objectives by name, the best ones unless given.

    Returns:
        One row for each change: ``kind``, "limit", "value" or "weight"; ``column``; ``end``,
        "lower" or "upper", of a limit; ``direction``, "tighter" or "looser" of a limit, "better" or
        "worse" of a value, "less" or "more" of a weight; ``present``, NaN for a limit that is not
        set; ``value``, up to which the design stays recommended, or of a looser limit, from which
        it does not; NaN if it stays at any; ``design`` that is recommended then, None if it is
        none or the same; ``exact``, whether every value was tried or none can be between.

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
    rows = []
    if "limit" in kinds:
        rows += search.of_limits()
    if "value" in kinds:
        rows += search.of_values()
    given = [("weights", weights or {}), ("aspiration", aspiration or {})]
    for name, wanted in given:
        for column in mapping(name, wanted, "objectives to numbers"):
            known_name(name, column, table.layout.objectives)
    if "weight" in kinds and (weights or aspiration):
        rows += search.of_weights(weights or {}, aspiration or {})
    frame = pd.DataFrame(rows, columns=list(_COLUMNS))
    designs = [row[_COLUMNS.index("design")] for row in rows]
    frame["design"] = pd.Series(designs, index=frame.index, dtype=object)  # None stays None
    return frame


class _Search:
    """Changes of the recommended design of a table.

    Attributes:
        kept: ``(n,)`` which tests are recommendable under all limits.
        optima: Rows of the tests that are recommended, equally near to the ideal point.
    """

    def __init__(self, table: TestTable) -> None:
        self.table = table
        self.layout = table.layout
        self.F = table.F
        self.kept = table.eligible()
        formulation = table.formulation
        self.options: dict[str, Any] = {"normalize": formulation.normalize}
        if formulation.ranges:
            frame = table.feasible_ranking().frame
            self.options |= {"ideal": frame.ideal, "nadir": frame.nadir}
        self.names = table.names
        self.optima = table.feasible_ranking().rows[table.feasible_ranking().salukvadze]

    def recommended(self, mask: Mask, F: Array | None = None) -> Rows:
        """Return the rows that are recommended of some tests; none if there are none.

        Args:
            mask: ``(n,)`` which tests there are.
            F: ``(n, m)`` their objectives, minimised, if other than the table's.
        """
        rows = np.flatnonzero(mask)
        if len(rows) == 0:
            return rows
        values = self.F if F is None else F
        return rows[rank_of_efficiency(values[rows], **self.options).salukvadze]

    def changes(self, rows: Rows) -> bool:
        """Whether the first recommended design is recommended no more."""
        return self.optima[0] not in rows

    def name_of(self, rows: Rows) -> str | None:
        """Return the name of the first of some rows; None without any."""
        if len(rows) == 0:
            return None
        return str(self.names[rows[0]])

    def first_change(self, count: int, at: Callable[[int], Rows]) -> tuple[int, Rows, bool]:
        """Return the first of some steps that changes the recommendation, and what it is then.

        Args:
            count: The number of steps.
            at: Gives what is recommended after step k, from 0.

        Returns:
            The step, ``count`` if none changes it; the rows; whether all steps before were tried.
        """
        is_exact = count <= _MOST_STEPS
        stride = 1
        if not is_exact:
            stride = -(-count // _PARTS)
        before = -1
        for step in [*range(stride - 1, count, stride), count - 1]:
            if step <= before:
                continue
            rows = at(step)
            if self.changes(rows):
                while step - before > 1:
                    middle = (step + before) // 2
                    rows_there = at(middle)
                    if self.changes(rows_there):
                        step, rows = middle, rows_there
                    else:
                        before = middle
                return step, rows, is_exact
            before = step
        return count, self.optima, is_exact

    # Limits

    def of_limits(self) -> list[tuple[Any, ...]]:
        """Return the changes as limits are tightened, set or loosened."""
        rows = []
        for name in dict.fromkeys([*self.layout.objectives, *self.layout.columns]):
            pair = self.table.limits.get(name, (-np.inf, np.inf))
            worse = ""
            if name in self.layout.objectives:
                worse = "lower" if name in self.layout.maximize else "upper"
            for end, limit in zip(("lower", "upper"), pair, strict=True):
                is_set = np.isfinite(limit)
                if is_set or end == worse:
                    rows.append(self.of_limit(name, end, limit, end == worse, "tighter"))
                if is_set:
                    rows.append(self.of_limit(name, end, limit, end == worse, "looser"))
        return rows

    def of_limit(
        self, name: str, end: str, limit: float, is_worse: bool, direction: str
    ) -> tuple[Any, ...]:
        """Return the change as a limit moves in a direction over the values that designs have.

        Args:
            name: The column.
            end: The end.
            limit: The limit, infinite if there is none.
            is_worse: Whether it is on the worse side of an objective: then it rejects no design
                without those that it dominates, and only Pareto-optimal designs count.
            direction: "tighter" or "looser".
        """
        sign = -1.0 if end == "lower" else 1.0
        values = sign * self.table.column(name).astype(np.float64)
        is_tighter = direction == "tighter"
        candidates = self.kept.copy()
        if not is_tighter:
            candidates = self._without(name, end).eligible()
        if is_worse:
            candidates[candidates] = nondominated(self.F[candidates])
        steps = np.unique(values[candidates])
        if is_tighter:
            steps = np.flip(steps)  # at each the designs with this value leave
        if not is_tighter:
            steps = steps[steps > sign * limit]

        def at(step: int) -> Rows:
            if is_tighter:
                return self.recommended(candidates & (values < steps[step]))
            return self.recommended(candidates & (values <= steps[step]))

        step, rows, is_exact = self.first_change(len(steps), at)
        value = np.nan
        design = None
        if step < len(steps):
            value = sign * steps[step]
            design = self.name_of(rows)
        present = limit if np.isfinite(limit) else np.nan
        return ("limit", name, end, direction, present, value, design, is_exact)

    def _without(self, name: str, end: str) -> TestTable:
        """Return the table without one end of a limit."""
        low, high = self.table.limits[name]
        if end == "upper":
            high = np.inf
        else:
            low = -np.inf
        pair = [None if np.isinf(low) else low, None if np.isinf(high) else high]
        limits: dict[str, Limit] = {**self.table.limits, **self.table.allowed_texts}
        limits[name] = pair
        if pair == [None, None]:
            del limits[name]
        return self.table.under(limits=limits)

    # Values of the recommended design

    def of_values(self) -> list[tuple[Any, ...]]:
        """Return the changes as an objective of the recommended design is another one."""
        row = int(self.optima[0])
        front = self.F[self.kept][nondominated(self.F[self.kept])]
        lengths = np.ptp(front, axis=0)
        # Designs that neither are Pareto optimal nor dominated by this one never count.
        candidates = self.kept.copy()
        is_dominated = (self.F[row] <= self.F).all(axis=1)
        candidates[candidates] = nondominated(self.F[candidates]) | is_dominated[candidates]
        rows = []
        for j, name in enumerate(self.layout.objectives):
            if not lengths[j] > 0:
                continue
            for direction, way in (("better", -1.0), ("worse", 1.0)):
                rows.append(self.moved(row, j, name, direction, way * lengths[j], candidates))
        return rows

    def moved(
        self, row: int, j: int, name: str, direction: str, length: float, candidates: Mask
    ) -> tuple[Any, ...]:
        """Return the change as objective j of the recommended design moves by up to a length."""
        sign = float(self.layout.sign[j])
        low, high = self.table.limits.get(name, (-np.inf, np.inf))
        start = float(self.F[row, j])

        def at(value: float) -> Rows:
            F = self.F.copy()
            F[row, j] = value
            mask = candidates.copy()
            mask[row] = low <= sign * value <= high
            return self.recommended(mask, F)

        steps = start + length * np.arange(1, _TRIED_VALUES + 1) / _TRIED_VALUES
        if "ideal" in self.options:  # nothing is better than the better end of a fixed range
            steps = steps[steps >= self.options["ideal"][j]]
        value = np.nan
        design = None
        before = start
        for step in steps.tolist():
            rows = at(step)
            if self.changes(rows):
                value, rows = _halved(before, step, at, rows, self.changes)
                design = self.name_of(rows)
                break
            before = step
        return ("value", name, "", direction, sign * start, sign * value, design, False)

    # Weights

    def of_weights(
        self, weights: Mapping[str, float], aspiration: Mapping[str, float]
    ) -> list[tuple[Any, ...]]:
        """Return the changes of the first design by weights and aspirations.

        The more an objective weighs, the better is the first design in it: a design that is first
        no more is not first again, and halving finds the change.
        """
        ranking = self.table.feasible_ranking()
        objectives = self.layout.objectives
        given = [float(weights.get(name, 1.0)) for name in objectives]
        pairs = zip(objectives, ranking.ideal, strict=True)
        point = [aspiration.get(name, ideal) for name, ideal in pairs]

        def first(j: int, weight: float) -> Rows:
            changed = [*given]
            changed[j] = weight
            normalize = self.options["normalize"]
            selector = ReferencePoint(point, weights=changed, normalize=normalize)
            return np.asarray(ranking.rows[selector.do(ranking)])

        rows = []
        for j, name in enumerate(objectives):
            present = given[j]
            best = first(j, present)
            for direction, factor in (("less", 1 / _GREATEST_FACTOR), ("more", _GREATEST_FACTOR)):
                far = present * factor or float(direction == "more")
                then = first(j, far)
                value = np.nan
                design = None
                if best[0] not in then:
                    value, then = _halved(
                        present,
                        far,
                        partial(first, j),
                        then,
                        partial(_lacks, int(best[0])),
                        n=3 * _HALVINGS,
                    )
                    design = self.name_of(then)
                rows.append(("weight", name, "", direction, present, value, design, True))
        return rows


def _lacks(row: int, rows: Rows) -> bool:
    return row not in rows


def _halved(
    stays: float,
    changed: float,
    at: Callable[[float], Rows],
    rows: Rows,
    changes: Callable[[Rows], bool],
    n: int = _HALVINGS,
) -> tuple[float, Rows]:
    """Return the last value at which a recommendation stays, by halving, and what comes then."""
    for _ in range(n):
        middle = (stays + changed) / 2
        rows_there = at(middle)
        if changes(rows_there):
            changed, rows = middle, rows_there
        else:
            stays = middle
    return stays, rows


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
            words = {"": "", "lower": "at least ", "upper": "at most "}
            unit = table.layout.units.get(row["column"], "")
            value = f"{words[row['end']]}{number(row['value'])} {unit}".strip()
            other = row["design"] or "none"
            changes.append(sentence("until", column=row["column"], value=value, other=other))
        if changes:
            sentences.append(sentence(template, design=design, changes=listed(changes, "or")))
    return sentences


# Positions of several people


def latest_positions(positions: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return what each name holds last, in the order in which the names first occur.

    Args:
        positions: Those of a :class:`~pymoo_psi.table.Formulation`, in the order of their dates.
    """
    return [*{one["name"]: one for one in positions}.values()]


def position_sentences(positions: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what each name holds since when, and what it held before."""
    sentences = []
    for held in latest_positions(positions):
        history = [one for one in positions if one["name"] == held["name"]]
        parts = {
            "name": held["name"],
            "date": held["date"][:10],
            "design": held["chosen"] or "none",
        }
        if len(history) == 1:
            sentences.append(sentence("position", **parts))
            continue
        former = [f"{one['chosen'] or 'none'} ({one['date'][:10]})" for one in history[:-1]]
        sentences.append(sentence("moved", former=", ".join(former), **parts))
    return sentences


def decision_sentences(decided: Mapping[str, Any] | None) -> list[str]:
    """Return what a group has decided, and who dissents."""
    if decided is None:
        return []
    agree = listed(decided["agree"] or ["nobody"])
    parts = {"date": decided["date"][:10], "design": decided["chosen"], "agree": agree}
    sentences = [sentence("decided", **parts)]
    if decided["dissent"]:
        sentences.append(sentence("dissent", dissent=listed(decided["dissent"])))
    return sentences


def group_sentences(table: TestTable) -> list[str]:
    """Return the positions of a table's formulation, what separates them, and what was decided."""
    formulation = table.formulation
    sentences = position_sentences(formulation.positions)
    sentences += separation_sentences(table)
    return sentences + decision_sentences(formulation.decided)


def separation_sentences(table: TestTable) -> list[str]:
    """Return what separates the positions of a table's formulation, and what all regret least.

    The regret of a design for a position is its greatest loss against the choice of the position,
    in shares of the ranges, each multiplied by the weight of the objective over the greatest one.
    """
    if not table.formulation.positions:
        return []
    free = table.under(limits={}).feasible_ranking()
    rows = dict(zip(map(free.name_of, range(len(free.rows))), range(len(free.rows)), strict=True))
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
            pair = compare_designs(free, rows=places, units=_objective_units(table))
            names = {"name": one["name"], "other": other["name"]}
            designs = {"design": one["chosen"], "base": other["chosen"]}
            difference = pair.difference(1)
            sentences.append(sentence("apart", **names, **designs, difference=difference))
            sentences.append(_reconciled(table, one, other, pair.gains[1] < 0))
            sentences.append(_reconciled(table, other, one, pair.gains[1] > 0))
    if not sentences or not table.eligible().any():
        return sentences
    ranking = table.feasible_ranking()
    minimized = ranking.objectives.minimized[ranking.pareto]
    regrets = []
    for one in held:
        choice = free.objectives.minimized[rows[one["chosen"]]]
        given = np.array([one["weights"].get(name, 1.0) for name in table.layout.objectives])
        losses = (minimized - choice) / free.lengths * (given / (given.max() or 1.0))
        regrets.append(np.maximum(losses.max(axis=1), 0.0))
    matrix = np.array(regrets)
    keys = (matrix.sum(axis=0), matrix.max(axis=0))
    best = np.lexsort(tuple(np.round(key / _TIE) for key in keys))[0]
    texts = []
    for one, share in zip(held, matrix[:, best].tolist(), strict=True):
        texts.append(f"{one['name']} {percent(share)}")
    design = capital(ranking.name_of(int(np.flatnonzero(ranking.pareto)[best])))
    return [*sentences, sentence("least regret", design=design, regrets=", ".join(texts))]


def _objective_units(table: TestTable) -> dict[str, str]:
    units = table.layout.units
    return {name: units[name] for name in table.layout.objectives if name in units}


def _reconciled(
    table: TestTable, one: Mapping[str, Any], other: Mapping[str, Any], is_better: Mask
) -> str:
    """Return the limit or the weight with which the choice of another comes first for one.

    Tried are a limit at each value in which that choice is better, then twice to 1024 times the
    weight of each such objective.

    Args:
        table: The tests.
        one: A position.
        other: Another one.
        is_better: ``(m,)`` in which objectives the choice of the other is better.
    """
    wanted = other["chosen"]
    layout = table.layout
    names = {"name": one["name"], "other": other["name"], "design": wanted}
    row = table.names.index(wanted)
    better = [*compress(layout.objectives, is_better)]
    for name in better:
        is_upper = name not in layout.maximize
        value = _outward(float(table.column(name)[row]), is_upper)
        low, high = ends(name, one["limits"].get(name, (None, None)))
        pair = [low, value]
        words = "at most"
        if name in layout.maximize:
            pair = [value, high]
            words = "at least"
        if pair[0] > pair[1]:  # the other end rejects that choice
            continue
        limits = {**one["limits"], name: tuple(None if np.isinf(x) else x for x in pair)}
        if wanted in _proposed(table, limits):
            unit = layout.units.get(name, "")
            limit = f"{name} {words} {number(value, 6)} {unit}".strip()
            return sentence("by limit", **names, limit=limit)
    tests = table.under(limits=one["limits"])
    if not tests.eligible().any():
        return sentence("not by one", **names)
    ranking = tests.feasible_ranking()
    pairs = zip(layout.objectives, ranking.ideal, strict=True)
    point = [one["aspiration"].get(name, ideal) for name, ideal in pairs]
    for name in better:
        weights = [one["weights"].get(objective, 1.0) for objective in layout.objectives]
        j = layout.objectives.index(name)
        weights[j] = weights[j] or 1.0
        for _ in range(10):
            weights[j] *= 2
            selector = ReferencePoint(point, weights=weights, normalize=table.formulation.normalize)
            if wanted in map(ranking.name_of, selector.do(ranking).tolist()):
                weight = number(weights[j])
                return sentence("by weight", **names, objective=name, weight=weight)
    return sentence("not by one", **names)


def _outward(value: float, is_upper: bool) -> float:
    """Return a value with six digits, so that a limit there lets it pass."""
    near = float(f"{value:.6g}")
    if near == value or (near > value) == is_upper:
        return near
    step = 10.0 ** (np.floor(np.log10(abs(value))) - 5)
    if not is_upper:
        step = -step
    return float(f"{near + step:.6g}")


def _proposed(table: TestTable, limits: Mapping[str, Any]) -> list[str]:
    """Return the names of the designs that are proposed under limits."""
    tests = table.under(limits=dict(limits))
    if not tests.eligible().any():
        return []
    ranking = tests.feasible_ranking()
    return [ranking.name_of(row) for row in ranking.salukvadze.tolist()]
