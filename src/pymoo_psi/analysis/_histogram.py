"""How many designs lie where: tested, feasible and Pareto-optimal ones over a column."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_psi._numbers import needs_logarithms
from pymoo_psi._validation import AnyArray, Array, Integers, Mask, integer, known_name
from pymoo_psi.table import VARIABLE, Kind, TestTable, require_table, value_ranks


@dataclass(frozen=True, eq=False)
class Histogram:
    """How many designs have a variable, or another column, in each of k bins.

    Attributes:
        variable: Name of the variable or column.
        edges: ``(k + 1,)`` edges of the bins; the last bin includes its upper edge. For single
            values the edges are -1/2, 1/2, …, between which they are drawn.
        values: The k values of an integer, a binary variable or a choice, one to a bin; empty
            where bins are intervals.
        tested: ``(k,)`` numbers of tested designs.
        feasible: ``(k,)`` numbers of feasible ones within the limits.
        pareto: ``(k,)`` numbers of Pareto-optimal ones among these.
        outside: How many feasible designs lie below the first edge and above the last one.
        logarithmic: Whether bins are equal by their logarithm.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.2], [1.0]], [[1], [2], [3]])
        >>> counts = histogram(table, "x1", bins=2)
        >>> counts.tested, counts.pareto
        (array([2, 1]), array([1, 0]))
    """

    variable: str
    edges: Array
    values: tuple[Any, ...]
    tested: Integers
    feasible: Integers
    pareto: Integers
    outside: tuple[int, int]
    logarithmic: bool


def histogram(table: TestTable, variable: str, *, bins: int = 10) -> Histogram:
    """Count the tested, feasible and Pareto-optimal designs over the range of a variable.

    Args:
        table: The tests.
        variable: Name of a variable, objective, constraint or output. Bins of all but variables
            span the feasible designs, or all if there are none, except for outliers
            beyond three times the interquartile range, which are in no bin. Of values over two
            decades or more, most of them in the first tenth of their range, the bins are equal by
            their logarithm.
        bins: The number of equal bins between the bounds of a real variable. An integer with more
            than twice as many tested values has at most so many bins, each of the same number of
            integers, or some of one more; other columns have one bin for each value.

    Raises:
        ArgumentValueError: There is no such column, or no bin.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.75], [1.0]], [[1], [2], [3]])
        >>> counts = histogram(table.under(limits={"f1": 2}), "x1", bins=2)
        >>> counts.edges, counts.tested, counts.feasible
        (array([0. , 0.5, 1. ]), array([1, 2]), array([1, 1]))
    """
    require_table(table)
    bins = integer("bins", bins, minimum=1)
    known_name("variable", variable, table.schema.values)
    places = table.column(variable)
    feasible = table.feasible()
    kind, points = _kind_and_points(table, variable)
    if kind is Kind.INTEGER and len({*places.tolist()}) <= 2 * bins:
        kind = Kind.CHOICE
    values: tuple[Any, ...] = ()
    if kind in (Kind.CHOICE, Kind.BINARY):
        options, places = value_ranks(places)
        values = tuple(options)
        edges = np.arange(-0.5, len(values))
    else:
        edges = _edges(points, bins, kind)
    places = places.astype(np.float64)  # the array is of objects if variables have several kinds
    inside = places[feasible & np.isfinite(places)]
    return Histogram(
        variable=variable,
        edges=edges,
        values=values,
        tested=np.histogram(places, edges)[0],
        feasible=np.histogram(inside, edges)[0],
        pareto=np.histogram(places[table.pareto()[table.ranked_as]], edges)[0],
        outside=(int((inside < edges[0]).sum()), int((inside > edges[-1]).sum())),
        logarithmic=kind is Kind.LOG,
    )


def _kind_and_points(table: TestTable, name: str) -> tuple[Kind, AnyArray]:
    """Return the kind of a column, and what bins of its numbers span: bounds, or usual values."""
    column = table.schema[name]
    places = table.column(name)
    if column.role == VARIABLE:
        return column.kind or Kind.REAL, np.append(places, [column.lower, column.upper])
    rows = np.isfinite(places)
    feasible = table.feasible()
    if feasible.any():
        rows = rows & feasible
    points = places[rows]
    if len(points) == 0:
        return Kind.REAL, points
    if (points > 0).all():
        near = points[_is_near(np.log(points))]
        if needs_logarithms(near):
            return Kind.LOG, near
    return Kind.REAL, points[_is_near(points)]


def _is_near(values: Array) -> Mask:
    """Return which values are no outliers: one would leave all others in a single bin."""
    low, high = np.quantile(values, [0.25, 0.75])
    fence = 3 * (high - low) or np.inf  # Tukey's outer fences
    return np.asarray((values >= low - fence) & (values <= high + fence))


def _edges(points: AnyArray, bins: int, kind: Kind) -> Array:
    """Return edges from the least to the greatest of the finite points, of bins that are equal.

    They are so by logarithms, or have the same number of integers, where the kind says so.
    """
    points = points.astype(np.float64)
    points = points[np.isfinite(points)]
    if len(points) == 0:
        points = np.array([0.0, 1.0])
    low = float(points.min())
    high = float(points.max())
    if kind is Kind.INTEGER:
        n = int(high - low) + 1
        bins = next((fewer for fewer in range(bins, bins // 2, -1) if n % fewer == 0), bins)
        return np.asarray(low - 0.5 + n * np.arange(bins + 1) // bins)
    size = max(abs(low), abs(high))
    if high - low <= 1e-9 * size:
        # About a single value: half a unit, or space for the bins beside it.
        pad = max(0.5, 1e-9 * size)
        return np.linspace(low - pad, high + pad, bins + 1)
    if kind is Kind.LOG:
        return np.geomspace(low, high, bins + 1)
    return np.linspace(low, high, bins + 1)
