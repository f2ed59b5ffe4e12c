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
dominates it. Over a part of the values U and L have bounds, and with them the sum for each p. A
part in which no sum can be negative changes nothing; another is divided, and only the designs that
may be nearer in it are compared further. A value that is left over is ranked, as rounding decides.
"""

from __future__ import annotations

from collections.abc import Iterator
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._validation import Array, Mask, Rows
from pymoo_psi.pareto import (
    LAST_PLACES,
    UtopianFrame,
    capital,
    decimal_mark,
    listed,
    nearest_to_ideal,
    nondominated,
    number,
    sentence,
    unit_lengths,
    without_rounding,
)
from pymoo_psi.table import Limit, Schema, TestTable

if TYPE_CHECKING:
    import pandas as pd

_CELLS = 2**18  # values that are compared at once: they fit into a cache
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

    changes = [*_changes(table)]
    columns = ["column", "end", "direction", "present", "value", "design"]
    frame = pd.DataFrame(changes, columns=columns)
    designs = [change[columns.index("design")] for change in changes]
    frame["design"] = pd.Series(designs, index=frame.index, dtype=object)  # None stays None
    return frame


def _changes(table: TestTable) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of :func:`switching_values`."""
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
            directions = {}
            if is_set or _is_worse(schema, name, end):
                directions["tighter"] = table
            if is_set:
                directions["looser"] = table.under(limits={**table.limits, name: free})
            for direction, tests in directions.items():
                change = _change(table, tests, name, end, direction, present)
                yield (name, end, direction, present, *change)


def _is_worse(schema: Schema, name: str, end: str) -> bool:
    """Say whether an end of a column is the worse one of an objective."""
    return name in schema.objectives and schema[name].maximize == (end == "lower")


def _change(
    table: TestTable, tests: TestTable, name: str, end: str, direction: str, present: float
) -> tuple[float, str | None]:
    """Return at which value of a limit another design is recommended, and which one.

    Args:
        table: The tests.
        tests: The tests under all limits that hold while this one moves.
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
    candidates = tests.eligible()
    if _is_worse(table.schema, name, end):  # it rejects no design without those that it dominates
        candidates = tests.pareto()
    rows = np.flatnonzero(candidates & np.isfinite(values))
    rows = rows[np.argsort(values[rows], kind="stable")]
    steps, places = np.unique(values[rows], return_inverse=True)
    F = without_rounding(np.vstack([table.F[rows], table.F[best]]))
    F, b = F[:-1], F[-1]
    # The limit lets in the designs up to a place; these places are tried one after the other.
    if direction == "tighter":
        certain = int(np.searchsorted(steps, values[best])) - 1
        tried = range(len(steps) - 2, certain, -1)
    else:
        certain = _dominated_from(b, F, places, len(steps))
        tried = range(int(np.searchsorted(steps, sign * present, side="right")), certain)
    changed = certain
    recommended: Rows = rows[:0]
    for place in _doubtful(F, places, tests.pareto()[rows], b, ranking.frame, tried):
        recommended = _recommended(table, rows[places <= place])
        if best not in recommended:
            changed = place
            break
    if changed == len(steps):
        return np.nan, None
    if changed == certain:
        recommended = _recommended(table, rows[places <= changed])
    design = None
    for row in recommended[:1]:
        design = str(table.names[row])
    if direction == "tighter":
        changed += 1  # it stays recommended at this value
    return sign * steps[changed], design


def _recommended(table: TestTable, rows: Rows) -> Rows:
    """Return the Salukvadze optimum of some rows of a table, in the order of the table."""
    if len(rows) == 0:
        return rows
    rows = np.sort(rows)
    return np.asarray(rows[nearest_to_ideal(table.F[rows], table.feasible_ranking().frame)])


def _dominated_from(b: Array, F: Array, places: Rows, n: int) -> int:
    """Return the first of n places at which a design dominates b, n if none does."""
    dominates = (b >= F).all(axis=1) & (b > F).any(axis=1)
    return int(places[dominates].min(initial=n))


def _doubtful(
    F: Array, places: Rows, lasting: Mask, b: Array, frame: UtopianFrame, tried: range
) -> Iterator[int]:
    """Yield the places up to which a design may be nearer to the ideal point than b, in order.

    Args:
        F: ``(n, m)`` objectives of the designs by increasing place, minimised.
        places: ``(n,)`` their places.
        lasting: ``(n,)`` which of them are known to be dominated by none.
        b: ``(m,)`` the objectives of the best design.
        frame: Whether distances are normalised, and fixed points.
        tried: The places.
    """
    if len(tried) == 0:
        return
    n_places = places[-1] + 1
    if not lasting.all():  # leave out those that are dominated as soon as they come in
        kept = nondominated(np.column_stack([F, places]))
        F, places, lasting = F[kept], places[kept], lasting[kept]
    U, N = frame.ideal, frame.nadir
    if not frame.is_fixed:
        U, N = _ends(F, places, lasting, n_places)
        U, N = U[tried], N[tried]
    U, N = np.broadcast_arrays(U, N, np.empty((len(tried), 1)))[:2]
    lengths = unit_lengths(U, N)
    inverse = np.ones_like(U)
    if frame.normalize:
        inverse = 1 / lengths
    # As in rankings: b is as near as p if the distances differ by no more than their noise.
    sizes = np.where(np.isfinite(lengths), np.maximum(np.abs(U), np.abs(N)), 0.0) * inverse
    noise = LAST_PLACES * np.linalg.norm(sizes, axis=1) * np.linalg.norm((b - U) * inverse, axis=1)
    waiting = [(0, len(tried), np.arange(len(F)))]
    while waiting:
        start, stop, rows = waiting.pop()
        if stop - start == 1:
            yield tried[start]
            continue
        n_parts = min(max(_CELLS // max(F[rows].size, 1), 2), stop - start)
        cuts = start + np.arange(n_parts + 1) * (stop - start) // n_parts
        bounds = []
        for array in (U, inverse):
            for end in (np.minimum, np.maximum):
                bounds.append(end.reduceat(array[:stop], cuts[:-1])[:, None])
        least = _least_difference(F[rows], b, *bounds)
        may_change = ~(least >= -np.minimum.reduceat(noise[:stop], cuts[:-1])[:, None])
        for k in reversed(range(n_parts)):
            last = max(tried[cuts[k]], tried[cuts[k + 1] - 1])
            nearer = rows[may_change[k] & (places[rows] <= last)]
            if len(nearer):
                waiting.append((cuts[k], cuts[k + 1], nearer))


def _ends(F: Array, places: Rows, lasting: Mask, k: int) -> tuple[Array, Array]:
    """Return ``(k, m)`` ideal and nadir points of the designs up to each of k places.

    Args:
        F: ``(n, m)`` objectives by increasing place.
        places: ``(n,)`` the places.
        lasting: ``(n,)`` which designs are known to be dominated by none.
        k: The number of places.
    """
    counts = np.searchsorted(places, np.arange(k), side="right")
    U = np.minimum.accumulate(F)[counts - 1]
    N = np.maximum.accumulate(np.where(lasting[:, None], F, -np.inf))[counts - 1]
    raises_nadir: Mask = np.any(N[places] < F, axis=1)
    if not raises_nadir.any():
        return U, N
    columns = np.ascontiguousarray(F.T)
    optimal = np.empty(0, dtype=np.intp)  # of those that raise it
    for row, place in enumerate(places):
        stays = (columns[:, optimal] < columns[:, [row]]).any(axis=0)
        for other in optimal[~stays]:
            while_optimal = slice(places[other], place)
            N[while_optimal] = np.maximum(N[while_optimal], F[other])
        optimal = optimal[stays]
        if raises_nadir[row]:
            optimal = np.append(optimal, row)
    for other in optimal:
        N[places[other] :] = np.maximum(N[places[other] :], F[other])
    return U, N


@np.errstate(over="ignore", invalid="ignore")
def _least_difference(
    F: Array, b: Array, U_low: Array, U_high: Array, inverse_low: Array, inverse_high: Array
) -> Array:
    """Bound the differences of the squared distances of ``(n, m)`` designs and that of b.

    Args:
        F: The objectives of the designs.
        b: ``(m,)`` those of the best design.
        U_low: ``(k, 1, m)`` least ideal points of k parts.
        U_high: As ``U_low``, the greatest.
        inverse_low: As ``U_low``, least reciprocal lengths.
        inverse_high: As ``U_low``, the greatest.

    Returns:
        ``(k, n)`` lower bounds.
    """
    difference = F - b
    offset = F + b - 2 * np.where(difference > 0, U_high, U_low)
    inverse = np.where((difference > 0) == (offset > 0), inverse_low, inverse_high)
    return np.asarray(np.sum((difference * inverse) * (offset * inverse), axis=2))


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
