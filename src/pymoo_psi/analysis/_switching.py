"""The values of limits at which another design is recommended.

The recommended design is the Salukvadze optimum of the designs within the limits. They are ranked
again at each value of a limit; the first value at which the design is recommended no more is the
answer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._validation import Mask, Rows
from pymoo_psi.pareto import (
    capital,
    decimal_mark,
    listed,
    nearest_to_ideal,
    number,
    sentence,
)
from pymoo_psi.table import Limit, TestTable

if TYPE_CHECKING:
    import pandas as pd

# Up to this number of values each is tried; of more, one in each of 64 parts, and then bisection.
_MOST_STEPS = 200
_PARTS = 64
_MOST_DESIGNS = 500  # ranking more Pareto-optimal designs again and again takes too long


def switching_values(table: TestTable) -> pd.DataFrame:
    """Return the values of limits at which the recommendation changes.

    Each limit is tightened and loosened; an objective without a limit on its worse side gets one.
    Everything else stays as it is. The returned value is the nearest change in a direction; more
    changes may follow beyond it, because ranges follow the limits. :func:`switching` states the
    same in a sentence.

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
          column direction  value  design
        0     f1   tighter    1.0  test 1
        1     f2   tighter    1.0  test 3
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
    schema = table.schema
    for name in dict.fromkeys([*schema.objectives, *schema.values]):
        limit = table.limits.get(name, Limit())  # infinite at both ends if it is one on texts
        sides = (
            ("lower", limit.low, Limit(high=limit.high)),
            ("upper", limit.high, Limit(low=limit.low)),
        )
        for end, value, free in sides:
            is_set = np.isfinite(value)
            present = value if is_set else np.nan
            is_worse = name in schema.objectives and schema[name].maximize == (end == "lower")
            directions = {}
            if is_worse or is_set:
                directions["tighter"] = table
            if is_set:
                directions["looser"] = table.under(limits={**table.limits, name: free})
            for direction, tests in directions.items():
                candidates = tests.eligible()
                if is_worse:
                    candidates = tests.pareto()
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


def switching(table: TestTable) -> list[str]:
    """Return a sentence on the limits up to which the best design stays the best.

    :func:`switching_values` returns the numbers. The list is empty if more than 500 designs are
    Pareto optimal, or if no limit changes the best design.

    Raises:
        ArgumentValueError: There is no design to rank.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> switching(table)[0]
        'Test 2 stays proposed until f1 below 1 (then test 1) or f2 below 1 (then test 3).'
    """
    ranking = table.feasible_ranking()
    if ranking.pareto.sum() > _MOST_DESIGNS:
        return []
    design = capital(ranking.name_of(int(ranking.salukvadze[0])))
    with decimal_mark(table.decimal):
        changes = [*_change_texts(table)]
    if not changes:
        return []
    return [sentence("stays", design=design, changes=listed(changes, "or"))]


def _change_texts(table: TestTable) -> Iterator[str]:
    """Yield the changes of :func:`switching_values` as parts of a sentence."""
    units = table.schema.units
    for row in switching_values(table).dropna(subset="value").to_dict("records"):
        # The recommendation stays at the value of a tighter limit, and changes at that of a looser.
        template = f"{row['end']} {row['direction']}"
        is_up = template in ("upper looser", "lower tighter")
        column = row["column"]
        limit = f"{number(_rounded(row['value'], is_up), 6)} {units.get(column, '')}".strip()
        yield sentence(template, column=column, limit=limit, other=row["design"] or "none")


def _rounded(value: float, is_up: bool) -> float:
    """Return a value with six digits, rounded up or down."""
    rounding = ROUND_CEILING if is_up else ROUND_FLOOR
    return float(Context(prec=6, rounding=rounding).create_decimal(repr(value)))
