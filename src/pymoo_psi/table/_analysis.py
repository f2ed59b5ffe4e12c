"""Histograms, costs of constraints, and alike failures.

A constraint whose limit is negotiable (a soft limit) can be looked at as an objective more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1): ``Formulation(objectives=[..., constraint])``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import instance, integer
from pymoo_psi.table._designs import value_ranks
from pymoo_psi.table._layout import Key, Limits, bounds_of
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
        >>> seen = histogram(table, "x1", bins=2)
        >>> seen.tested, seen.pareto
        (array([2, 1]), array([1, 0]))
    """

    variable: str
    edges: Array
    values: tuple[Any, ...]
    tested: NDArray[np.int64]
    feasible: NDArray[np.int64]
    pareto: NDArray[np.int64]
    outside: tuple[int, int] = (0, 0)


def histogram(
    table: TestTable, variable: Key, *, bins: int = 10, limits: Limits | None = None
) -> Histogram:
    """Count the tested, feasible and Pareto-optimal designs over the range of a variable.

    Args:
        table: The tests.
        variable: Name or index of the variable; or name of an objective, constraint or output, the
            bins of which span the feasible designs, and all if there is none, up to three times
            the middle half's range beyond that half: what lies beyond is in no bin.
        bins: Equal bins between the bounds of a real variable, and of an integer of which more
            than twice as many values were tested; others have one for each value.
        limits: Limits on columns.

    Raises:
        ArgumentValueError: There is no such column, or no bin.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.75], [1.0]], [[1], [2], [3]])
        >>> seen = histogram(table, "x1", bins=2, limits={"f1": 2})
        >>> seen.edges, seen.tested, seen.feasible
        (array([0. , 0.5, 1. ]), array([1, 2]), array([1, 1]))
    """
    bins = integer("bins", bins, minimum=1)
    layout, values = table.layout, ()
    every = np.ones(len(table), dtype=bool)
    masks = (every, table.feasible(limits), table.pareto(limits))
    if isinstance(variable, str) and variable in layout.columns[len(layout.variables) :]:
        name, place = variable, table.column(variable)
        known = np.isfinite(place)
        shown = place[known & masks[1]] if (known & masks[1]).any() else place[known]
        if len(shown):
            # One outlier would leave all others in a single bin (Tukey's outer fences).
            low, high = np.quantile(shown, [0.25, 0.75])
            far = 3 * (high - low) or np.inf
            shown = shown[(shown >= low - far) & (shown <= high + far)]
        edges = _edges(shown, np.nan, np.nan, bins)
    else:
        j = layout.variable(variable)
        name, place, known = layout.variables[j], table.X[:, j], every
        many = table.kinds[j] is Kind.INTEGER and len({*place.tolist()}) > 2 * bins
        if table.kinds[j].real or many:
            place = place.astype(np.float64)  # of variables of several kinds it is objects
            low, high = layout.lower[j], layout.upper[j]
            if table.kinds[j] is Kind.LOG:
                edges = np.exp(_edges(np.log(place), np.log(low), np.log(high), bins))
            else:
                edges = _edges(place, low, high, bins)
        else:
            options, place = value_ranks(place)
            values, edges = tuple(options), np.arange(-0.5, len(options))
    tested, feasible, pareto = (np.histogram(place[m & known], edges)[0] for m in masks)
    inside = place[masks[1] & known]
    outside = int((inside < edges[0]).sum()), int((inside > edges[-1]).sum())
    return Histogram(name, edges, values, tested, feasible, pareto, outside)


def alike(reasons: Iterable[str]) -> list[str]:
    """Return reasons of failures as lines; those that differ in decimals only have dots for these.

    Programs quote the design that they fail at, so that no two reasons are the same. Whole numbers
    stay: a program that exits with 3 fails otherwise than one that exits with 4. Of the folders
    that runs of a program leave, the first is named.
    """
    lines = [" ".join(reason.split()) for reason in reasons]
    dotted = [_DECIMALS.sub("…", _FOLDER.sub("", line)) for line in lines]
    count = Counter(same for _, same in {*zip(lines, dotted, strict=True)})
    folders = {
        s: "".join(_FOLDER.findall(line)) for line, s in zip(lines[::-1], dotted[::-1], strict=True)
    }
    pairs = zip(lines, dotted, strict=True)
    return [s + folders[s] if count[s] > 1 else line for line, s in pairs]


def constraint_costs(table: TestTable, limits: Limits | None = None) -> pd.DataFrame:
    """Return what each constraint and limit costs, and what relaxing it would gain.

    Returns:
        One row per constraint and then per limit. Columns: ``lower`` and ``upper``, the least and
        the greatest value allowed; ``rejects``, how many designs violate it; ``alone``, how many
        it alone rejects; and for each objective the best value among the feasible designs
        (``f1_feasible``) and among those it alone rejects (``f1_alone``); NaN where there are none.

    Example:
        Test 2 violates the constraint only; without it f1 = 1 would be had instead of 2.

        >>> X, F, G = [[0.1], [0.5], [0.9]], [[2], [1], [4]], [[0.0], [0.5], [0.0]]
        >>> print(constraint_costs(TestTable.of([1, 2, 3], X, F, G), {"f1": 3}))
                    lower  upper  rejects  alone  f1_feasible  f1_alone
        constraint
        g1           -inf    0.0        1      1          2.0       1.0
        f1           -inf    3.0        1      1          2.0       4.0
    """
    import pandas as pd

    mask, names = instance("table", table, TestTable).violations(limits)
    layout = table.layout
    bounds = [(-np.inf, 0.0)] * len(layout.inequalities)
    bounds += [(-layout.eq_tolerance, layout.eq_tolerance)] * len(layout.equalities)
    bounds += bounds_of(limits, layout).values()
    alone = mask & (mask.sum(axis=1) == 1)[:, None]
    lower, upper = np.array(bounds).reshape(len(names), 2).T
    counts = {"rejects": mask.sum(axis=0), "alone": alone.sum(axis=0)}
    index = pd.Index(names, name="constraint", dtype=object)
    frame = pd.DataFrame({"lower": lower, "upper": upper, **counts}, index=index)
    feasible = table.feasible(limits)
    for j, name in enumerate(layout.objectives):
        sign = layout.sign[j]
        frame[f"{name}_feasible"] = sign * _best(table.F[feasible, j])
        frame[f"{name}_alone"] = [sign * _best(table.F[column, j]) for column in alone.T]
    return frame


def _edges(place: Array, lower: float, upper: float, bins: int) -> Array:
    """Return equidistant edges between bounds, widened to all values; theirs without bounds."""
    known = np.array([lower, upper])
    points = np.concatenate([known[np.isfinite(known)], place])
    low, high = (float(points.min()), float(points.max())) if len(points) else (0.0, 1.0)
    size = max(abs(low), abs(high))
    # About a single value: half a unit, or space for the bins beside it.
    pad = max(0.5, 1e-9 * size) if high - low <= 1e-9 * size else 0.0
    return np.linspace(low - pad, high + pad, bins + 1)


def _best(values: Array) -> float:
    # Objectives of infeasible designs need not be finite, and -inf would be the best of all.
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else float("nan")
