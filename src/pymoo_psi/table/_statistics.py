"""Where the feasible designs lie: histograms of variables, dependence of criteria on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import integer
from pymoo_psi.table._designs import column_kinds, values_in_order
from pymoo_psi.table._judgement import JudgedRecords
from pymoo_psi.table._layout import Key, Limits
from pymoo_psi.table._limits import limit_vector

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class Histogram:
    """How many designs have a variable in each of k bins.

    Attributes:
        variable: Name of the variable.
        edges: ``(k + 1,)`` edges of the bins; the last bin holds its upper edge. If the variable
            takes single values only, the places -1/2, 1/2, … at which these are drawn.
        values: The k values of an integer, a boolean or a choice, one to a bin; empty for a real
            variable.
        tested: ``(k,)`` numbers of tested designs.
        feasible: ``(k,)`` numbers of feasible ones within the limits.
        pareto: ``(k,)`` numbers of Pareto-optimal ones among these.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.2], [1.0]], [[1], [2], [3]])
        >>> histogram = table.histogram("x1", bins=2)
        >>> histogram.tested, histogram.pareto
        (array([2, 1]), array([1, 0]))
    """

    variable: str
    edges: Array
    values: tuple[Any, ...]
    tested: NDArray[np.int64]
    feasible: NDArray[np.int64]
    pareto: NDArray[np.int64]

    def __repr__(self) -> str:
        """Return what is counted."""
        return (
            f"Histogram({self.variable} in {len(self.tested)} bins: {self.tested.sum()} tested, "
            f"{self.feasible.sum()} feasible, {self.pareto.sum()} Pareto optimal)"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Dependence:
    """The tested designs seen in the plane of a variable and a criterion.

    Attributes:
        variable: Name of the variable.
        criterion: Name of the criterion.
        numbers: ``(n,)`` numbers of the test points.
        x: ``(n,)`` values of the variable.
        f: ``(n,)`` values of the criterion; NaN or infinite where it could not be computed.
        feasible: ``(n,)`` which designs are feasible within the limits.
        pareto: ``(n,)`` which are Pareto optimal among these.
        limit: The limit on the criterion; infinity if there is none.

    Example:
        >>> from pymoo_psi import TestTable
        >>> seen = TestTable.of([1, 2], [[0.1], [0.5]], [[3.0], [2.0]]).dependence("f1", "x1")
        >>> seen.x[seen.pareto], seen.f[seen.pareto]
        (array([0.5]), array([2.]))
    """

    variable: str
    criterion: str
    numbers: NDArray[np.int64]
    x: NDArray[Any]
    f: Array
    feasible: Mask
    pareto: Mask
    limit: float

    def __repr__(self) -> str:
        """Return what depends on what, and how many designs show it."""
        return (
            f"Dependence({self.criterion} on {self.variable}: {len(self.f)} tested, "
            f"{self.feasible.sum()} feasible, {self.pareto.sum()} Pareto optimal)"
        )


def histogram_of_variable(
    table: JudgedRecords, variable: Key, *, bins: int, limits: Limits | None
) -> Histogram:
    """Count designs over the range of a variable; see :meth:`TestTable.histogram`."""
    bins = integer("bins", bins, minimum=1)
    j = table.layout.variable(variable)
    column = table.X[:, j]
    values: tuple[Any, ...] = ()
    if column_kinds(table.X)[j] == "real":
        place = column.astype(np.float64)
        edges = _equal_bins(*_range(place, table.layout.lower[j], table.layout.upper[j]), bins)
    else:
        values = tuple(values_in_order(column))
        seat = {(type(value), value): k for k, value in enumerate(values)}
        place = np.array([seat[type(value), value] for value in column.tolist()], dtype=np.float64)
        edges = np.asarray(np.arange(len(values) + 1) - 0.5, dtype=np.float64)
    masks = (np.ones(len(table), dtype=bool), table.feasible(limits), table.pareto(limits))
    tested, feasible, pareto = (_counts(place[mask], edges) for mask in masks)
    return Histogram(table.layout.variables[j], edges, values, tested, feasible, pareto)


def dependence_on_variable(
    table: JudgedRecords, criterion: Key, variable: Key, *, limits: Limits | None
) -> Dependence:
    """Project the designs onto a variable and a criterion; see :meth:`TestTable.dependence`."""
    layout = table.layout
    i, j = layout.objective(criterion), layout.variable(variable)
    x = table.X[:, j]
    if column_kinds(table.X)[j] == "real":
        x = x.astype(np.float64)
    return Dependence(
        layout.variables[j],
        layout.objectives[i],
        table.numbers,
        x,
        table.F[:, i],
        table.feasible(limits),
        table.pareto(limits),
        limit_vector(limits, layout).get(i, np.inf),
    )


def _range(place: Array, lower: float, upper: float) -> tuple[float, float]:
    """Return the range of the box, widened to every value; where there is no box, the values'."""
    known = np.array([lower, upper])
    points = np.concatenate([known[np.isfinite(known)], place])
    return (float(points.min()), float(points.max())) if len(points) else (0.0, 1.0)


def _equal_bins(low: float, high: float, bins: int) -> Array:
    """Return ``(bins + 1,)`` equidistant edges; about the range if it has no room for them."""
    edges = np.asarray(np.linspace(low, high, bins + 1), dtype=np.float64)
    if (np.diff(edges) > 0).all():
        return edges
    pad = max(0.5, 1e-9 * max(abs(low), abs(high)))
    return np.asarray(np.linspace(low - pad, high + pad, bins + 1), dtype=np.float64)


def _counts(place: Array, edges: Array) -> NDArray[np.int64]:
    if len(edges) < 2:
        return np.zeros(0, dtype=np.int64)
    return np.histogram(place, edges)[0].astype(np.int64)
