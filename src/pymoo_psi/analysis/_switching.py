"""The values of limits at which another design is recommended.

The recommended design b is the Salukvadze optimum of the designs within the limits: the one of
their Pareto set that is nearest to the ideal point U, objectives measured by their lengths L, the
ranges from U to the nadir point N. A limit that moves over the values of a column lets designs in
or out one after the other, sorted by their values. Three things may change the recommendation:

1. b is left out, at its own value.
2. A design comes in that dominates b.
3. A design p is nearer to U than b. Nothing else counts, as a dominated design is no nearer than
   the one that dominates it. Squared distances differ by the sum of (p - b) (p + b - 2U) / L² over
   the objectives, in which U and L follow from the designs that are left.

The first two are known without ranking. For the third, U and N are found for all values in one pass
over the sorted designs. U is the least of all designs up to a value. N is the greatest of those of
them that none dominates: a design counts from its own value to that of the first design that
dominates it. Over a stretch of values, bounds of U and L bound the sum of each p from below. If one
may be negative, the stretch is halved; a value at which the sum of some p is negative, or nearly
so, is ranked, as rounding decides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._numbers import as_given, decimals_as_given, one_sided
from pymoo_psi._validation import Array, Mask, Rows
from pymoo_psi.pareto import (
    LAST_PLACES,
    UtopianFrame,
    listed,
    nearest_of_front,
    nearest_to_ideal,
    nondominated,
    sentence,
    unit_lengths,
    with_article,
    without_rounding,
)
from pymoo_psi.table import Limit, TestTable, require_table

if TYPE_CHECKING:
    import pandas as pd


def switching_values(table: TestTable) -> pd.DataFrame:
    """Return the values of limits at which the recommendation changes.

    Each limit is tightened and loosened; an objective without a limit on its worse side gets one.
    Everything else stays as it is. The returned value is the nearest change in a direction; more
    changes may follow beyond it, because ranges follow the limits. :func:`switching_sentences`
    states the same in sentences.

    Args:
        table: The tests, under the formulation with the limits.

    Returns:
        One row for each change: ``column``; ``end``, "lower" or "upper"; ``direction``, "tighter"
        or "looser"; ``present``, NaN for a limit that is not set; ``value``, up to which the design
        stays recommended if the limit is tighter, or from which it no longer is if it is looser;
        NaN if it stays at any value; ``design``, which is recommended then, None if it is none or
        the same.

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

    require_table(table)
    columns = ["column", "end", "direction", "present", "value", "design"]
    frame = pd.DataFrame([*_changes(table)], columns=columns, dtype=object)  # None stays None
    return frame.astype({"present": np.float64, "value": np.float64})


def _changes(table: TestTable) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of :func:`switching_values`."""
    schema = table.schema
    for name in dict.fromkeys([*schema.objectives, *schema.values]):
        limit = table.limits.get(name, Limit())  # infinite at both ends if it is one on texts
        for end, sign, present in (("lower", -1.0, limit.lower), ("upper", 1.0, limit.upper)):
            is_set = bool(np.isfinite(present))
            is_worse = name in schema.objectives and schema[name].maximize == (end == "lower")
            directions = {}
            if is_worse or (is_set and limit.lower < limit.upper):
                directions["tighter"] = table
            if is_set:
                directions["looser"] = _without_end(table, name, end)
            for direction, tests in directions.items():
                candidates = tests.feasible()
                if is_worse:  # it rejects no design without those that it dominates
                    candidates = tests.pareto()
                values = np.where(candidates, sign * table.column(name).astype(np.float64), np.nan)
                change, design = _change(table, values, direction, sign * present)
                shown = present if is_set else np.nan
                yield (name, end, direction, shown, sign * change, design)


def _without_end(table: TestTable, name: str, end: str) -> TestTable:
    """Return the tests without the lower or the upper end of the limit on a column."""
    limit = table.limits.get(name, Limit())
    free = limit._replace(upper=np.inf)
    if end == "lower":
        free = limit._replace(lower=-np.inf)
    return table.under(limits={**table.limits, name: free})


def _change(
    table: TestTable, values: Array, direction: str, present: float
) -> tuple[float, str | None]:
    """Return at which value of an upper limit another design is recommended, and which one.

    Args:
        table: The tests.
        values: ``(n,)`` the values that it limits; NaN of designs that do not count.
        direction: "tighter" or "looser".
        present: The present limit.
    """
    ranking = table.feasible_ranking()
    best = ranking.rows[ranking.salukvadze[0]]
    rows = np.flatnonzero(np.isfinite(values))
    rows = rows[np.argsort(values[rows], kind="stable")]
    steps, places = np.unique(values[rows], return_inverse=True)
    F = without_rounding(table.F[rows])
    b = F[rows == best][0]
    # At a place the limit lets in the designs up to there. Places are tried in order; at a last one
    # the best design is left out, or one that dominates it comes in.
    if direction == "tighter":
        own = int(np.searchsorted(steps, values[best]))
        tried = range(len(steps) - 2, own - 1, -1)
        last = [own - 1]
        ends = steps[1:]  # it stays recommended at the value of the place before
    else:
        first = int(np.searchsorted(steps, present, side="right"))
        dominates = (b >= F).all(axis=1) & (b > F).any(axis=1)
        last = places[dominates][:1].tolist()
        tried = range(first, min(last, default=len(steps)))
        ends = steps
    doubtful = _doubtful(F, places, table.pareto()[rows], b, ranking.frame, tried)
    for place in chain(doubtful, last):
        inside = np.sort(rows[places <= place])
        if len(inside) == 0:
            return steps[0], None
        recommended = _recommended(table, inside)
        if best not in recommended:
            return ends[place], str(table.names[recommended[0]])
    return np.nan, None


def _recommended(table: TestTable, rows: Rows) -> Rows:
    """Return which of some designs are the nearest to their ideal point."""
    frame = table.feasible_ranking().frame
    if table.pareto()[rows].all():  # none of them dominates another
        nearest, _ = nearest_of_front(without_rounding(table.F[rows]), frame)
    else:
        nearest = nearest_to_ideal(table.F[rows], frame)
    return rows[nearest]


def _doubtful(
    F: Array, places: Rows, are_optimal: Mask, b: Array, frame: UtopianFrame, tried: range
) -> Iterator[int]:
    """Yield the places up to which a design may be nearer to the ideal point than b, in order.

    Args:
        F: ``(n, m)`` objectives of the designs by increasing place, minimised.
        places: ``(n,)`` their places.
        are_optimal: ``(n,)`` which of them none dominates.
        b: ``(m,)`` the objectives of the best design.
        frame: Whether distances are normalised, and fixed points.
        tried: The places.
    """
    if not tried:
        return
    kept = places <= max(tried[0], tried[-1])
    lasting = are_optimal[kept]
    if not lasting.all():  # leave out those that are dominated as soon as they come in
        kept[kept] = nondominated(np.column_stack([F, places])[kept])
        lasting = nondominated(F[kept])
    F = frame.limited(F[kept])
    places = places[kept]
    U, scales = _frames(F, lasting, frame)
    rows = np.searchsorted(places, tried, side="right") - 1
    yield from _nearer(F.T, places, frame.limited(b), U[rows].T, scales[rows].T, tried)


def _frames(F: Array, lasting: Mask, frame: UtopianFrame) -> tuple[Array, Array]:
    """Return ``(n, m)`` ideal points of the designs up to each of n, and the scales there.

    Args:
        F: ``(n, m)`` objectives, none dominated by one before.
        lasting: ``(n,)`` which of them none dominates that comes later.
        frame: Whether distances are normalised, and fixed points.
    """
    if frame.is_fixed:
        return np.resize(frame.ideal, F.shape), np.resize(frame.scale, F.shape)
    U = np.minimum.accumulate(F)
    if not frame.normalize:
        return U, np.ones(F.shape)
    return U, unit_lengths(U, _nadirs(F, lasting))


def _nadirs(F: Array, lasting: Mask) -> Array:
    """Return ``(n, m)`` nadir points of the designs up to each of n; see :func:`_frames`."""
    N = np.maximum.accumulate(np.where(lasting[:, None], F, -np.inf))
    columns = np.ascontiguousarray(F.T)
    # Another one counts until the first that dominates it.
    for row in np.flatnonzero((F > N).any(axis=1)):
        dominates = (columns[:, row + 1 :] <= F[row][:, None]).all(axis=0)
        end = row + 1 + int(dominates.argmax())
        N[row:end] = np.maximum(N[row:end], F[row])
    return N


def _nearer(
    F: Array, places: Rows, b: Array, U: Array, scales: Array, tried: range
) -> Iterator[int]:
    """Yield the places up to which a design may be nearer to the ideal point than b, in order.

    Places are halved as long as a design may be nearer at one of them.

    Args:
        F: ``(m, n)`` objectives of the designs, transposed as that takes less time.
        places: ``(n,)`` their places.
        b: ``(m,)`` the objectives of the best design.
        U: ``(m, k)`` the ideal points at the places tried.
        scales: ``(m, k)`` the lengths by which objectives are divided there.
        tried: The k places.
    """
    near = (places <= max(tried[0], tried[-1])) & _may_be_nearer(F, b[:, None], U, scales)
    if not near.any():
        return
    if len(tried) == 1:
        yield tried[0]
        return
    half = len(tried) // 2
    for part in (slice(half), slice(half, None)):
        yield from _nearer(F[:, near], places[near], b, U[:, part], scales[:, part], tried[part])


@np.errstate(over="ignore", invalid="ignore")
def _may_be_nearer(F: Array, b: Array, U: Array, scales: Array) -> Mask:
    """Return which ``(m, n)`` points may be nearer than b to one of k ideal points.

    A term (p - b) (p + b - 2U) / L² of the difference is least at the greatest or the least U, and,
    if it is negative, with the least L. Squared distances that differ by less than rounding does in
    any ranking are equal.

    Args:
        F: ``(m, n)`` the points.
        b: ``(m, 1)`` the one with which they are compared.
        U: ``(m, k)`` the ideal points.
        scales: ``(m, k)`` the lengths L by which objectives are divided.
    """
    lowest = U.min(axis=1, keepdims=True)
    highest = U.max(axis=1, keepdims=True)
    longest = scales.max(axis=1, keepdims=True)
    difference = F - b
    total = F + b - 2 * np.where(difference < 0, lowest, highest)
    is_negative = (difference < 0) != (total < 0)
    scale = np.where(is_negative, scales.min(axis=1, keepdims=True), longest)
    least = np.sum((difference / scale) * (total / scale), axis=0)
    distance = np.sum(((b - highest) / longest) ** 2)
    return np.asarray(~(least >= -LAST_PLACES * distance))


def switching_sentences(table: TestTable) -> list[str]:
    """Return sentences on the tighter and the looser limits that change the best design.

    :func:`switching_values` returns the numbers. The list is empty if no limit changes the best
    design.

    Raises:
        ArgumentValueError: There is no design to rank.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> switching_sentences(table)[0]
        'Tighter limits: if f1 must be below 1, test 1 is proposed; if f2 must be below 1, test 3 is
        proposed.'
    """
    require_table(table)
    sentences = []
    values = switching_values(table).dropna(subset="value").to_dict("records")
    for direction in ("tighter", "looser"):
        changes = []
        best = []
        for row in values:
            if row["direction"] != direction:
                continue
            if is_best(row):
                best.append(row["column"])
            else:
                changes.append(change_text(table, row))
        if best:
            condition = sentence("better", objectives=with_article(listed(best, "or")))
            changes.append(f"{condition}, {sentence('none')}")
        if changes:
            sentences.append(sentence(direction, changes="; ".join(changes)))
    return sentences


def is_best(row: Mapping[Any, Any]) -> bool:
    """Return whether a change of the :func:`switching_values` says that no design is better."""
    return bool(np.isnan(row["present"])) and not row["design"]


def change_text(table: TestTable, row: Mapping[Any, Any]) -> str:
    """Return a change of the :func:`switching_values` of a table as a part of a sentence."""
    template = f"{row['end']} {row['direction']}"
    limit = changed_limit(table, row)
    other = sentence("none")
    if row["design"]:
        other = sentence("other", design=row["design"])
    condition = sentence(template, column=with_article(row["column"]), limit=limit)
    return f"{condition}, {other}"


def changed_limit(table: TestTable, row: Mapping[Any, Any], digits: int = 6) -> str:
    """Return the value of a change of the :func:`switching_values` of a table with its unit.

    Args:
        table: The table.
        row: The change.
        digits: The digits of the value; it has more where designs lie between.
    """
    ranking = table.feasible_ranking()
    column = row["column"]
    decimals = decimals_as_given(table.column(column)[ranking.rows[ranking.pareto]])
    # The recommendation stays at the value of a tighter limit, and changes at that of a looser.
    is_up = (row["end"], row["direction"]) in (("upper", "looser"), ("lower", "tighter"))
    tests = table
    if row["direction"] == "looser":
        tests = _without_end(table, column, row["end"])
    cells = tests.column(column)[tests.feasible()].astype(np.float64)
    value = row["value"]
    if row["direction"] == "tighter":  # which has no effect at the value: 9.799999999999999 is 9.8
        value = as_given(value)
    text = one_sided(value, is_up, cells, digits, decimals, table.decimal)
    return f"{text} {table.schema.units.get(column, '')}".strip()
