"""Histograms, costs of constraints, and alike failures.

A constraint whose limit is negotiable (a soft limit) can be looked at as an objective more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1): ``Formulation(objectives=[..., constraint])``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._names import asked_under_a_formulation
from pymoo_psi._validation import instance, integer
from pymoo_psi.table._designs import value_ranks
from pymoo_psi.table._layout import Key
from pymoo_psi.table._table import TestTable

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

_FOLDER = re.compile(r"; see \S.*$")
_DECIMALS = re.compile(r"\d*\.\d+(?:[eE][+-]?\d+)?|\d+(?:\.\d*)?[eE][+-]?\d+")


@dataclass(frozen=True, eq=False)
class Histogram:
    """How many designs have a variable, or another column, in each of k bins.

    Attributes:
        variable: Name of the variable or column.
        edges: ``(k + 1,)`` edges of the bins; the last bin holds its upper edge. If the variable
            takes single values only, the places -1/2, 1/2, … at which these are drawn.
        values: The k values of an integer, a binary variable or a choice, one to a bin; empty
            where bins are intervals.
        tested: ``(k,)`` numbers of tested designs.
        feasible: ``(k,)`` numbers of feasible ones within the limits.
        pareto: ``(k,)`` numbers of Pareto-optimal ones among these.
        outside: How many feasible designs lie below the first edge and above the last one.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.2], [1.0]], [[1], [2], [3]])
        >>> counts = histogram(table, "x1", bins=2)
        >>> counts.tested, counts.pareto
        (array([2, 1]), array([1, 0]))
    """

    variable: str
    edges: Array
    values: tuple[Any, ...]
    tested: NDArray[np.int64]
    feasible: NDArray[np.int64]
    pareto: NDArray[np.int64]
    outside: tuple[int, int] = (0, 0)


@asked_under_a_formulation
def histogram(table: TestTable, variable: Key, *, bins: int = 10) -> Histogram:
    """Count the tested, feasible and Pareto-optimal designs over the range of a variable.

    Args:
        table: The tests.
        variable: Name or index of the variable; or name of an objective, constraint or output, the
            bins of which span the feasible designs, and all if there is none, up to three times
            the middle half's range beyond that half: what lies beyond is in no bin.
        bins: Equal bins between the bounds of a real variable, and of an integer of which more
            than twice as many values were tested; others have one for each value.

    Raises:
        ArgumentValueError: There is no such column, or no bin.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.75], [1.0]], [[1], [2], [3]])
        >>> counts = histogram(table.under(limits={"f1": 2}), "x1", bins=2)
        >>> counts.edges, counts.tested, counts.feasible
        (array([0. , 0.5, 1. ]), array([1, 2]), array([1, 1]))
    """
    bins = integer("bins", bins, minimum=1)
    layout = table.layout
    feasible = table.feasible()
    values: tuple[Any, ...] = ()
    if isinstance(variable, str) and variable in layout.columns[len(layout.variables) :]:
        name = variable
        places = table.column(name)
        counted = np.isfinite(places)
        edges = _edges_of_dependent(places[counted], feasible[counted], bins)
    else:
        j = layout.variable(variable)
        name = layout.variables[j]
        counted = np.ones(len(table), dtype=bool)
        places, edges, values = _places_of_variable(table, j, bins)

    def count(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
        return np.histogram(places[mask & counted], edges)[0]

    inside = places[feasible & counted]
    n_below = int((inside < edges[0]).sum())
    n_above = int((inside > edges[-1]).sum())
    return Histogram(
        variable=name,
        edges=edges,
        values=values,
        tested=count(counted),
        feasible=count(feasible),
        pareto=count(table.pareto()),
        outside=(n_below, n_above),
    )


def _edges_of_dependent(places: Array, feasible: NDArray[np.bool_], bins: int) -> Array:
    """Return the edges of bins for an objective, constraint or output with these values."""
    if feasible.any():
        places = places[feasible]
    if len(places):
        # One outlier would leave all others in a single bin (Tukey's outer fences).
        low, high = np.quantile(places, [0.25, 0.75])
        fence = 3 * (high - low) or np.inf
        places = places[(places >= low - fence) & (places <= high + fence)]
    return _edges(places, np.nan, np.nan, bins)


def _places_of_variable(
    table: TestTable, j: int, bins: int
) -> tuple[NDArray[Any], Array, tuple[Any, ...]]:
    """Return where designs lie on the axis of a variable, edges of bins, and its single values."""
    kind, cells = table.kinds[j], table.X[:, j]
    many_integers = kind is Kind.INTEGER and len({*cells.tolist()}) > 2 * bins
    if not kind.real and not many_integers:
        values, ranks = value_ranks(cells)
        return ranks, np.arange(-0.5, len(values)), tuple(values)
    places = cells.astype(np.float64)  # of variables of several kinds it is objects
    low, high = table.layout.lower[j], table.layout.upper[j]
    if kind is Kind.LOG:
        return places, np.exp(_edges(np.log(places), np.log(low), np.log(high), bins)), ()
    return places, _edges(places, low, high, bins), ()


def alike(reasons: Iterable[str]) -> list[str]:
    """Return reasons of failures as lines; those that differ in decimals only have dots for these.

    Programs quote the design that they fail at, so that no two reasons are the same. Whole numbers
    stay: a program that exits with 3 fails otherwise than one that exits with 4. Of the folders
    that runs of a program leave, the first is named.
    """
    lines = [" ".join(reason.split()) for reason in reasons]
    dotted = [_DECIMALS.sub("…", _FOLDER.sub("", line)) for line in lines]
    lines_by_pattern: dict[str, list[str]] = {}
    for line, pattern in zip(lines, dotted, strict=True):
        lines_by_pattern.setdefault(pattern, []).append(line)
    alike_lines = []
    for line, pattern in zip(lines, dotted, strict=True):
        same = lines_by_pattern[pattern]
        if len(set(same)) > 1:
            line = pattern + "".join(_FOLDER.findall(same[0]))
        alike_lines.append(line)
    return alike_lines


@asked_under_a_formulation
def constraint_costs(table: TestTable) -> pd.DataFrame:
    """Return what each constraint and limit costs, and what relaxing it would gain.

    Returns:
        One row per constraint and then per limit, as it is written. Columns: ``lower`` and
        ``upper``, the least and the greatest value allowed; ``rejects``, how many designs violate
        it; ``alone``, how many it alone rejects; and for each objective the best value among the
        feasible designs (``f1_feasible``) and among those it alone rejects (``f1_alone``); NaN
        where there are none.

    Example:
        Test 2 violates the constraint only; without it f1 = 1 would be had instead of 2.

        >>> X, F, G = [[0.1], [0.5], [0.9]], [[2], [1], [4]], [[0.0], [0.5], [0.0]]
        >>> table = TestTable.of([1, 2, 3], X, F, G).under(limits={"f1": 3})
        >>> print(constraint_costs(table))
                    lower  upper  rejects  alone  f1_feasible  f1_alone
        constraint
        g1           -inf    0.0        1      1          2.0       1.0
        f1<=3        -inf    3.0        1      1          2.0       4.0
    """
    import pandas as pd

    mask, names = instance("table", table, TestTable).violations()
    layout = table.layout
    bounds = [(-np.inf, 0.0)] * len(layout.inequalities)
    bounds += [(-layout.eq_tolerance, layout.eq_tolerance)] * len(layout.equalities)
    bounds += table.limits.values()
    lower, upper = np.array(bounds).reshape(len(names), 2).T
    alone = mask & (mask.sum(axis=1) == 1)[:, None]
    frame = pd.DataFrame(
        {
            "lower": lower,
            "upper": upper,
            "rejects": mask.sum(axis=0),
            "alone": alone.sum(axis=0),
        },
        index=pd.Index(names, name="constraint", dtype=object),
    )
    feasible = table.feasible()
    for j, name in enumerate(layout.objectives):
        sign = layout.sign[j]
        frame[f"{name}_feasible"] = sign * _best(table.F[feasible, j])
        frame[f"{name}_alone"] = [sign * _best(table.F[rows, j]) for rows in alone.T]
    return frame


def _edges(places: Array, lower: float, upper: float, bins: int) -> Array:
    """Return equidistant edges between bounds, widened to all values; theirs without bounds."""
    bounds = np.array([lower, upper])
    points = np.concatenate([bounds[np.isfinite(bounds)], places])
    low, high = 0.0, 1.0
    if len(points):
        low, high = float(points.min()), float(points.max())
    size = max(abs(low), abs(high))
    pad = 0.0
    if high - low <= 1e-9 * size:
        # About a single value: half a unit, or space for the bins beside it.
        pad = max(0.5, 1e-9 * size)
    return np.linspace(low - pad, high + pad, bins + 1)


def _best(values: Array) -> float:
    # Objectives of infeasible designs need not be finite, and -inf would be the best of all.
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else float("nan")
