"""How many designs lie where: tested, feasible and Pareto-optimal ones over a column."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_psi._numbers import spans_decades
from pymoo_psi._validation import Array, Integers, Mask, integer, known_name
from pymoo_psi.table import VARIABLE, Kind, TestTable, value_ranks


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
    outside: tuple[int, int] = (0, 0)
    logarithmic: bool = False


def histogram(table: TestTable, variable: str, *, bins: int = 10) -> Histogram:
    """Count the tested, feasible and Pareto-optimal designs over the range of a variable.

    Args:
        table: The tests.
        variable: Name of a variable, objective, constraint or output. Bins of all but variables
            span the feasible designs, or all if there are none, except for outliers
            beyond three times the interquartile range, which are in no bin. Of values that span
            more than three decades the bins are equal by their logarithm.
        bins: The number of equal bins between the bounds of a real variable. An integer with more
            than twice as many tested values has at most so many bins, each of the same number of
            integers; other columns have one bin for each value.

    Raises:
        ArgumentValueError: There is no such column, or no bin.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.75], [1.0]], [[1], [2], [3]])
        >>> counts = histogram(table.under(limits={"f1": 2}), "x1", bins=2)
        >>> counts.edges, counts.tested, counts.feasible
        (array([0. , 0.5, 1. ]), array([1, 2]), array([1, 1]))
    """
    bins = integer("bins", bins, minimum=1)
    known_name("variable", variable, table.schema.values)
    column = table.schema[variable]
    places = table.column(variable)
    feasible = table.feasible()
    kind = Kind.REAL
    if column.role == VARIABLE:
        kind = column.kind or Kind.REAL  # unknown without a design
        bounds = np.array([column.lower, column.upper], dtype=np.float64)  # NaN if unknown
        points = np.append(places, bounds)
    else:
        rows = np.isfinite(places)
        if feasible.any():
            rows = rows & feasible
        points = places[rows]
        positive = points[points > 0]
        near = positive[_is_near(np.log(positive))]
        if spans_decades(near) and len(positive) == len(points):
            kind = Kind.LOG
        else:
            near = points[_is_near(points)]
        points = near
    values: tuple[Any, ...] = ()
    if kind is Kind.LOG:
        points = points.astype(np.float64)
        edges = np.exp(_edges(np.log(points), bins))
        # Of a logarithm the exponential may miss a bound, and designs on it would be outside.
        is_finite = np.isfinite(points)
        edges[0] = points.min(initial=edges[0], where=is_finite)
        edges[-1] = points.max(initial=edges[-1], where=is_finite)
    elif kind is Kind.REAL:
        edges = _edges(points.astype(np.float64), bins)
    elif kind is Kind.INTEGER and len({*places.tolist()}) > 2 * bins:
        edges = _edges_of_integers(points.astype(np.float64), bins)
    else:
        options, places = value_ranks(places)
        values = tuple(options)
        edges = np.arange(-0.5, len(values))
    places = places.astype(np.float64)  # the array is of objects if variables have several kinds
    inside = places[feasible & np.isfinite(places)]
    return Histogram(
        variable=variable,
        edges=edges,
        values=values,
        tested=np.histogram(places, edges)[0],
        feasible=np.histogram(inside, edges)[0],
        pareto=np.histogram(places[table.pareto()], edges)[0],
        outside=(int((inside < edges[0]).sum()), int((inside > edges[-1]).sum())),
        logarithmic=kind is Kind.LOG,
    )


def _is_near(values: Array) -> Mask:
    """Return which values are no outliers: one would leave all others in a single bin."""
    if len(values) == 0:
        return np.zeros(0, dtype=bool)
    low, high = np.quantile(values, [0.25, 0.75])
    fence = 3 * (high - low) or np.inf  # Tukey's outer fences
    return np.asarray((values >= low - fence) & (values <= high + fence))


def _edges(points: Array, bins: int) -> Array:
    """Return equidistant edges from the least to the greatest of finite points."""
    points = points[np.isfinite(points)]
    if len(points) == 0:
        points = np.array([0.0, 1.0])
    low = float(points.min())
    high = float(points.max())
    size = max(abs(low), abs(high))
    if high - low <= 1e-9 * size:
        # About a single value: half a unit, or space for the bins beside it.
        pad = max(0.5, 1e-9 * size)
        low -= pad
        high += pad
    return np.linspace(low, high, bins + 1)


def _edges_of_integers(points: Array, bins: int) -> Array:
    """Return edges from below the least of finite integers, with as many integers in each bin."""
    points = points[np.isfinite(points)]
    n = points.max() - points.min() + 1
    width = np.ceil(n / bins)
    return np.asarray(points.min() - 0.5 + width * np.arange(np.ceil(n / width) + 1))
