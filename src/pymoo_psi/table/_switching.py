"""The values of limits at which another design is recommended, and positions of several people.

The recommended design is the Salukvadze optimum of the designs within the limits. They are ranked
again at each value of a limit; the first value at which the design is recommended no more is the
answer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from pymoo_psi._validation import Array, Mask, Rows
from pymoo_psi.pareto import (
    capital,
    compare_designs,
    listed,
    nearest_to_ideal,
    number,
    percent,
    sentence,
    without_rounding,
)
from pymoo_psi.table._formulation import OPEN, limit_text

if TYPE_CHECKING:
    import pandas as pd

    from pymoo_psi.table._table import TestTable

Position: TypeAlias = Mapping[str, Any]
"""A name with its date, choice, limits, weights and aspirations, as a formulation has it."""

# Up to this number of values each is tried; of more, one in each of 64 parts, and then bisection.
_MOST_STEPS = 200
_PARTS = 64
_MOST_DESIGNS = 500  # ranking more Pareto-optimal designs again and again takes too long
_TIE = 1e-9  # regrets that differ by less are equal


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

    changes = [*_changes(table)]
    columns = ["column", "end", "direction", "present", "value", "design", "exact"]
    frame = pd.DataFrame(changes, columns=columns)
    designs = [change[columns.index("design")] for change in changes]
    frame["design"] = pd.Series(designs, index=frame.index, dtype=object)  # None stays None
    return frame


def _changes(table: TestTable) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of :func:`switching_values`.

    On the worse side of an objective a limit rejects no design without those that it dominates:
    only Pareto-optimal designs count.
    """
    layout = table.layout
    for name in dict.fromkeys([*layout.objectives, *layout.columns]):
        limit = table.limits.get(name, OPEN)
        if isinstance(limit, list):  # of texts
            limit = OPEN
        for i, end in enumerate(("lower", "upper")):
            is_set = np.isfinite(limit[i])
            is_worse = name in layout.objectives and (name in layout.maximize) == (end == "lower")
            directions = {}
            if is_worse or is_set:
                directions["tighter"] = table
            if is_set:
                free = [*limit]
                free[i] = OPEN[i]
                directions["looser"] = table.under(limits={**table.limits, name: free})
            for direction, tests in directions.items():
                candidates = tests.pareto() if is_worse else tests.eligible()
                present = limit[i] if is_set else np.nan
                change = _change(table, candidates, name, end, direction, present)
                yield (name, end, direction, present, *change)


def _change(
    table: TestTable, candidates: Mask, name: str, end: str, direction: str, present: float
) -> tuple[float, str | None, bool]:
    """Return at which value of a limit another design is recommended, which one, and if it is sure.

    Args:
        table: The tests.
        candidates: ``(n,)`` which designs count, those within the other limits.
        name: The column.
        end: "lower" or "upper".
        direction: "tighter" or "looser".
        present: The present limit.
    """
    ranking = table.feasible_ranking()
    best = ranking.rows[ranking.salukvadze[0]]
    sign = 1.0
    if end == "lower":
        sign = -1.0  # the greatest values are those that it rejects first
    values = sign * table.column(name).astype(np.float64)
    steps = np.flip(np.unique(values[candidates]))
    if direction == "looser":
        steps = np.flip(steps[steps > sign * present])

    def recommended(i: int) -> Rows:
        is_within = values < steps[i]  # each step leaves out the designs with its value
        if direction == "looser":
            is_within = values <= steps[i]
        rows = np.flatnonzero(candidates & is_within)
        if len(rows) == 0:
            return rows
        return np.asarray(rows[nearest_to_ideal(table.F[rows], ranking.frame)])

    is_exact = len(steps) <= _MOST_STEPS
    changed = _first_change(len(steps), lambda i: best in recommended(i))
    if changed == len(steps):
        return np.nan, None, is_exact
    design = None
    for row in recommended(changed)[:1]:
        design = str(table.names[row])
    return sign * steps[changed], design, is_exact


def _first_change(n: int, keeps_best: Callable[[int], bool]) -> int:
    """Return the first of n steps at which the best design changes, n if none.

    Up to 200 steps are tried one after the other. Of more, the last one of each of 64 parts is
    tried; the change within a part is found by bisection.

    Args:
        n: The number of steps.
        keeps_best: Whether the design is still the best at a step.
    """
    size = 1
    if n > _MOST_STEPS:
        size = -(-n // _PARTS)
    last = n - 1
    kept = -1  # the last step that is known to keep the best design
    for end in range(size - 1, last + size, size):
        changed = min(end, last)
        if not keeps_best(changed):
            break
        kept = changed
    if kept == last:
        return n
    while changed - kept > 1:
        middle = (kept + changed) // 2
        if keeps_best(middle):
            kept = middle
        else:
            changed = middle
    return changed


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
    """Return who holds which design, under which limits and weights, and why.

    Returns:
        Texts, one row for each name; empty columns are omitted.
    """
    import pandas as pd

    rows = []
    for position in latest_positions(table.formulation.positions):
        under = written_limits(table.under(limits=position["limits"]))
        for word, key in (("weight", "weights"), ("aspiration", "aspiration")):
            for objective, value in position[key].items():
                under.append(f"{word} of {objective} {number(value)}")
        row = {
            "name": position["name"],
            "choice": position["chosen"] or "none",
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
            sentences.append(pair.sentence("apart", 1, name=one["name"], holder=other["name"]))
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
