"""The next designs to look at: the box of the feasible set, and sections through a design."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, finite_number, integer, invalid
from pymoo_psi.table._designs import column_kinds, design_row
from pymoo_psi.table._judgement import JudgedRecords
from pymoo_psi.table._layout import Key, Limits
from pymoo_psi.table._records import Records

Array = NDArray[np.float64]


def section_points(design: Any, variable: int, n: int, lower: float, upper: float) -> NDArray[Any]:
    """Return the designs of a one-at-a-time section: one variable runs, the others stay.

    Args:
        design: ``(n_var,)`` the design the section goes through.
        variable: Index of the variable that runs.
        n: Number of designs, 2 or more.
        lower: Where the variable starts.
        upper: Where it ends.

    Returns:
        ``(n, n_var)`` designs, to be evaluated by the problem. If the variable is an integer the
        values are rounded and each is taken once, so that there may be fewer.

    Raises:
        ArgumentValueError: A number is out of range, or the variable is not in the design, or is a
            choice or a boolean.
        ArgumentTypeError: A number is none.

    Example:
        >>> section_points([0.2, 0.4], 1, 3, 0.0, 1.0)
        array([[0.2, 0. ],
               [0.2, 0.5],
               [0.2, 1. ]])
    """
    row = design_row("design", design, [f"x{j + 1}" for j in range(np.size(design))])
    j, n = integer("variable", variable, minimum=0), integer("n", n, minimum=2)
    if j >= len(row):
        raise invalid("variable", f"an index from 0 to {len(row) - 1}", j)
    kind = column_kinds(row[None])[j]
    if kind not in ("real", "integer"):
        raise invalid("variable", "a real number or an integer", Received(f"one that is {kind}"))
    lower, upper = finite_number("lower", lower), finite_number("upper", upper)
    if lower > upper:
        raise invalid("lower", "at most upper", Received(f"{lower} > {upper}"))
    values = np.linspace(lower, upper, n)
    steps = values.tolist() if kind == "real" else np.unique(np.rint(values)).astype(int).tolist()
    points = np.tile(row, (len(steps), 1))
    points[:, j] = steps
    return points


def section_of_table(
    table: Records,
    design: int | ArrayLike,
    variable: Key,
    n: int,
    lower: float | None,
    upper: float | None,
) -> NDArray[Any]:
    """Return the designs of a section of a table; see :meth:`TestTable.section_points`."""
    j = table.layout.variable(variable)
    start = float(table.layout.lower[j]) if lower is None else lower
    end = float(table.layout.upper[j]) if upper is None else upper
    return section_points(design_of(table, design), j, n, start, end)


def design_of(table: Records, design: int | ArrayLike) -> NDArray[Any]:
    """Return a design as ``(n_var,)`` a row, be it given so or by the number of its test point."""
    if isinstance(design, (int, np.integer)):
        rows = np.flatnonzero(table.numbers == design)
        if len(rows) == 0:
            raise invalid("design", "a tested point's number, or a design", int(design))
        row: NDArray[Any] = table.X[rows[0]]
        return row
    kinds = column_kinds(table.X) if len(table) else ()
    return design_row("design", design, table.layout.variables, kinds)


def box_of_feasible_set(
    table: JudgedRecords, *, limits: Limits | None, margin: float
) -> tuple[Array, Array]:
    """Return the box of the feasible designs; see :meth:`TestTable.refined_bounds`."""
    margin = finite_number("margin", margin)
    if margin < 0:
        raise invalid("margin", "0 or more", margin)
    feasible = table.feasible(limits)
    if not feasible.any():
        raise invalid(
            "the feasible set",
            "of at least one design to span a box",
            Received(f"none of {len(table)} tests"),
            "loosen the limits, or test more points",
        )
    lower, upper = table.layout.lower.copy(), table.layout.upper.copy()
    for j, kind in enumerate(column_kinds(table.X)):
        if kind not in ("real", "integer"):
            continue
        column = table.X[feasible, j].astype(np.float64)
        low, high = column.min(), column.max()
        width = high - low
        low, high = low - margin * width, high + margin * width
        if kind == "integer":
            low, high = np.floor(low), np.ceil(high)
        lower[j], upper[j] = np.fmax(low, lower[j]), np.fmin(high, upper[j])
    return lower, upper
