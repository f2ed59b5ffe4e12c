"""The values of limits at which another design is recommended.

The recommended design is the Salukvadze optimum of the designs within the limits. A path has the
values of a limit in one direction, and ranks again at each of them; the first value at which the
design is recommended no more is the answer. What would make several people agree is found by
ranking again, too, in the second half of this file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from pymoo_psi._validation import Array, Mask, Rows
from pymoo_psi.pareto import (
    capital,
    compare_designs,
    least_weighted,
    listed,
    nearest_to_ideal,
    number,
    percent,
    sentence,
    terms_from,
    without_rounding,
)
from pymoo_psi.table._formulation import OPEN, ends, limit_text

if TYPE_CHECKING:
    import pandas as pd

    from pymoo_psi.pareto import EfficiencyRanking, UtopianFrame
    from pymoo_psi.table._table import TestTable

Position: TypeAlias = Mapping[str, Any]
"""A name with its date, choice, limits, weights and aspirations, as a formulation has it."""

# Up to this number of values each is tried; of more, one in each of 64 parts, and then bisection.
_MOST_STEPS = 200
_PARTS = 64
_MOST_DESIGNS = 500  # ranking more Pareto-optimal designs again and again takes too long
_TIE = 1e-9  # regrets that differ by less are equal
_DOUBLINGS = 10  # a weight is doubled so often, at most, for two people to agree


def switching_values(table: TestTable) -> pd.DataFrame:
    """Return the values of limits at which the recommendation changes.

    Each limit is tightened and loosened; an objective without a limit on its worse side gets one.
    Everything else stays as it is. The returned value is the nearest change in a direction; more
    changes may follow beyond it, because ranges follow the limits. :meth:`TestTable.switching` is
    the same in a sentence.

    Args:
        table: The tests, under the formulation with the limits.

    Returns:
        One row for each change: ``column``; ``end``, "lower" or "upper"; ``direction``, "tighter"
        or "looser"; ``present``, NaN for a limit that is not set; ``value``, up to which the design
        stays recommended if the limit is tighter, or from which it no longer is if it is looser;
        NaN if it stays at any value; ``design``, which is recommended then, None if it is none or
        the same; ``exact``, whether every value was tried. If there are more than 200, values are
        tried in 64 steps, between which the change is found by bisection.

    Raises:
        ArgumentValueError: No design is feasible.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> switching_values(table)[["column", "direction", "value", "design"]]
          column direction  value        design
        0     f1   tighter    1.0  test point 1
        1     f2   tighter    1.0  test point 3
    """
    import pandas as pd

    paths = _of_limits(table, table.feasible_ranking())
    columns = ["column", "end", "direction", "present", "value", "design", "exact"]
    changes = [_change(table, path) for path in paths]
    frame = pd.DataFrame(changes, columns=columns)
    designs = [change[columns.index("design")] for change in changes]
    frame["design"] = pd.Series(designs, index=frame.index, dtype=object)  # None stays None
    return frame


class _End(NamedTuple):
    """An end of a limit.

    Attributes:
        name: "lower" or "upper".
        place: Its index in a pair.
        sign: Its direction: times this, the greatest values are those that it rejects first.
    """

    name: str
    place: int
    sign: float


_LOWER = _End("lower", 0, -1.0)
_UPPER = _End("upper", 1, 1.0)


class _Path(NamedTuple):
    """Values of a limit, in the order in which they are tried.

    Attributes:
        column: Its column.
        end: "lower" or "upper".
        direction: As in :func:`switching_values`.
        present: The present value.
        values: ``(k,)`` the values to be tried.
        at: Returns the rows that are recommended at the i-th of them.
        best: Row of the design that is recommended at present.
    """

    column: str
    end: str
    direction: str
    present: float
    values: Array
    at: Callable[[float], Rows]
    best: int


def _change(table: TestTable, path: _Path) -> tuple[Any, ...]:
    """Return a row of :func:`switching_values`: the first value of a path with another design."""
    count = len(path.values)
    changed = first_change(path.values, lambda value: path.best in path.at(value))
    value = np.nan
    design = None
    if changed < count:
        value = path.values[changed]
        rows = path.at(path.values[changed])
        if len(rows):
            design = str(table.names[rows[0]])
    return (*path[:4], value, design, count <= _MOST_STEPS)


def first_change(values: Array, keeps_best: Callable[[float], bool]) -> int:
    """Return the index of the first of k values at which the best design changes, k if none.

    Up to 200 values are tried one after the other. Of more, the last one of each of 64 parts is
    tried; the change within a part is found by bisection, in which the design is the best at
    ``values[kept]``, or ``kept`` is -1, and is not the best at ``values[changed]``.

    Args:
        values: ``(k,)`` the values, in the order in which they are tried.
        keeps_best: Whether the design is still the best at a value.
    """
    last = len(values) - 1
    size = 1
    if len(values) > _MOST_STEPS:
        size = -(-len(values) // _PARTS)
    kept = -1
    changed = min(size - 1, last)
    while kept < last and keeps_best(values[changed]):
        kept = changed
        changed = min(kept + size, last)
    if kept == last:
        return len(values)
    while changed - kept > 1:
        middle = (kept + changed) // 2
        if keeps_best(values[middle]):
            kept = middle
        else:
            changed = middle
    return changed


def _of_limits(table: TestTable, ranking: EfficiencyRanking) -> Iterator[_Path]:
    """Yield the paths of limits that are tightened, set or loosened.

    On the worse side of an objective a limit rejects no design without those that it dominates:
    only Pareto-optimal designs count.
    """
    layout = table.layout
    for name in dict.fromkeys([*layout.objectives, *layout.columns]):
        pair = _limit(table, name)
        for end in (_LOWER, _UPPER):
            is_set = np.isfinite(pair[end.place])
            is_worse = name in layout.objectives and end is _worse_end(table, name)
            tables = {}
            if is_worse or is_set:
                tables["tighter"] = table
            if is_set:
                free = [*pair]
                free[end.place] = OPEN[end.place]
                tables["looser"] = table.under(limits={**table.limits, name: free})
            for direction, tests in tables.items():
                candidates = tests.pareto() if is_worse else tests.eligible()
                yield _of_limit(table, ranking, candidates, name, end, direction)


def _worse_end(table: TestTable, objective: str) -> _End:
    """Return the end of a limit that rejects the worse values of an objective."""
    if objective in table.layout.maximize:
        return _LOWER
    return _UPPER


def _of_limit(
    table: TestTable,
    ranking: EfficiencyRanking,
    candidates: Mask,
    name: str,
    end: _End,
    direction: str,
) -> _Path:
    """Return the path of an end of a limit over the values that designs have.

    Args:
        table: The tests.
        ranking: The ranking of the feasible ones.
        candidates: ``(n,)`` which designs count, those within the other limits.
        name: The column.
        end: The end.
        direction: "tighter" or "looser".
    """
    limit = _limit(table, name)[end.place]
    values = end.sign * table.column(name).astype(np.float64)
    steps = np.flip(np.unique(values[candidates]))
    if direction == "looser":
        steps = np.flip(steps[steps > end.sign * limit])

    def at(value: float) -> Rows:
        bound = end.sign * value
        is_within = values < bound  # each step leaves out the designs with its value
        if direction == "looser":
            is_within = values <= bound
        return _recommended(ranking.frame, candidates & is_within, table.F)

    present = limit if np.isfinite(limit) else np.nan
    best = ranking.rows[ranking.salukvadze[0]]
    return _Path(name, end.name, direction, present, end.sign * steps, at, best)


def _limit(table: TestTable, name: str) -> tuple[float, float]:
    """Return the ends of the limit on a column, open ones for texts and without a limit."""
    limit = table.limits.get(name, OPEN)
    if isinstance(limit, list):
        return OPEN
    return limit


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
    changes = []
    for row in switching_values(table).dropna(subset="value").to_dict("records"):
        # The recommendation stays at the value of a tighter limit, and changes at that of a looser.
        template = f"{row['end']} {row['direction']}"
        is_up = template in ("upper looser", "lower tighter")
        limit = _with_unit(table, row["column"], _rounded(row["value"], is_up))
        other = row["design"] or "none"
        changes.append(sentence(template, column=row["column"], limit=limit, other=other))
    if not changes:
        return []
    design = capital(ranking.name_of(int(ranking.salukvadze[0])))
    return [sentence("stays", design=design, changes=listed(changes, "or"))]


def _with_unit(table: TestTable, name: str, value: float) -> str:
    """Return a value of a column with its unit."""
    return f"{number(value, 6)} {table.layout.units.get(name, '')}".strip()


def _rounded(value: float, is_up: bool) -> float:
    """Return a value with six digits, rounded up or down."""
    rounding = ROUND_CEILING if is_up else ROUND_FLOOR
    return float(Context(prec=6, rounding=rounding).create_decimal(repr(value)))


# Positions of several people


def latest_positions(positions: Sequence[Position]) -> list[Position]:
    """Return what each name holds last, in the order in which the names first occur.

    Args:
        positions: Those of a :class:`~pymoo_psi.table.Formulation`, in the order of their dates.
    """
    return [*{one["name"]: one for one in positions}.values()]


def positions_frame(table: TestTable) -> pd.DataFrame:
    """Return who holds which design since when, under which limits and weights, and why.

    Returns:
        Texts, one row for each name; empty columns are omitted.
    """
    import pandas as pd

    rows = []
    for position in latest_positions(table.formulation.positions):
        name = position["name"]
        history = [one for one in table.formulation.positions if one["name"] == name]
        before = [f"{one['chosen'] or 'none'} ({one['date'][:10]})" for one in history[:-1]]
        under = written_limits(table.under(limits=position["limits"]))
        for word, key in (("weight", "weights"), ("aspiration", "aspiration")):
            for objective, value in position[key].items():
                under.append(f"{word} of {objective} {number(value)}")
        row = {
            "name": name,
            "since": position["date"][:10],
            "choice": position["chosen"] or "none",
            "before": ", ".join(before),
            "under": "; ".join(under),
            "why": position["reason"],
        }
        rows.append(row)
    frame = pd.DataFrame(rows)
    return frame.loc[:, (frame != "").any()]


def written_limits(table: TestTable) -> list[str]:
    """Return the limits of a table as they can be typed, with their units."""
    texts = []
    for name, limit in table.limits.items():
        unit = table.layout.units.get(name, "")
        texts.append(f"{limit_text(name, limit)} {unit}".strip())
    return texts


def decision_sentences(decided: Position | None) -> list[str]:
    """Return what a group has decided, and who dissents."""
    if decided is None:
        return []
    on = ""
    if decided["date"]:
        on = f" on {decided['date'][:10]}"
    by = ""
    if decided["agree"]:
        by = f" by {listed(decided['agree'])}"
    sentences = [sentence("decided", on=on, design=decided["chosen"], by=by)]
    if decided["dissent"]:
        sentences.append(sentence("dissent", dissent=listed(decided["dissent"])))
    return sentences


def separation_sentences(table: TestTable) -> list[str]:
    """Return what separates the positions of a table's formulation, and what all regret least."""
    latest = latest_positions(table.formulation.positions)
    if not latest:
        return []
    free = table.under(limits={}).feasible_ranking()
    if table.eligible().any():
        free = replace(free, frame=table.feasible_ranking().frame)
    rows = {free.name_of(row): row for row in range(len(free.rows))}
    positions = [position for position in latest if position["chosen"] in rows]
    sentences = []
    for k, one in enumerate(positions):
        for other in positions[:k]:
            if one["chosen"] == other["chosen"]:
                continue
            pair = compare_designs(free, rows=[rows[other["chosen"]], rows[one["chosen"]]])
            gains = pair.gains[1]
            sentences += [
                pair.sentence("apart", 1, name=one["name"], holder=other["name"]),
                _reconciled(table, free.frame, one, other, gains < 0),
                _reconciled(table, free.frame, other, one, gains > 0),
            ]
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
    front = np.flatnonzero(ranking.pareto)
    values = without_rounding(np.vstack([choices, ranking.objectives.minimized[front]]))
    weights = np.ones(choices.shape)
    for i, position in enumerate(positions):
        for name, weight in position["weights"].items():
            weights[i, table.layout.objectives.index(name)] = weight
    most = weights.max(axis=1, keepdims=True)
    weights /= np.where(most > 0, most, 1.0)
    losses = (values[len(positions) :, None] - values[: len(positions)]) / lengths * weights
    regrets = losses.max(axis=2, initial=0.0) + 0.0  # no -0
    keys = (regrets.sum(axis=1), regrets.max(axis=1))
    best = np.lexsort(tuple(np.round(key / _TIE) for key in keys))[0]
    texts = []
    for position, regret in zip(positions, regrets[best], strict=True):
        texts.append(f"{position['name']} {percent(regret)}")
    design = capital(ranking.name_of(int(front[best])))
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
        end = _worse_end(table, name)
        pair = [*ends(name, one["limits"].get(name, OPEN))]
        pair[end.place] = _rounded(value, end is _UPPER)
        if pair[0] > pair[1]:  # the other end rejects that choice
            continue
        is_eligible = table.under(limits={**one["limits"], name: pair}).eligible()
        if row in _recommended(frame, is_eligible, table.F):
            word = {"lower": "at least", "upper": "at most"}[end.name]
            limit = f"{name} {word} {_with_unit(table, name, pair[end.place])}"
            return sentence("by limit", **names, limit=limit)
    tests = table.under(limits=one["limits"])
    if tests.eligible().any():
        first = _first_by_weights(tests, one)
        for name in better:
            weight = one["weights"].get(name) or 1.0
            for _ in range(_DOUBLINGS):
                weight *= 2
                if row in first(name, weight):
                    return sentence("by weight", **names, objective=name, weight=number(weight))
    return sentence("not by one", **names)
