"""One-at-a-time sections: the criteria along one variable, through a chosen design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.plots._designs import checked_table, draw_limits, upright
from pymoo_psi.plots._style import CURVES, HUGE, literal, tick_counts, view
from pymoo_psi.plots._table import design_legends, grid_page
from pymoo_psi.table import Key, Kind, Layout, Limits, TestTable, bounds_of, column_kinds, design_of

Array = NDArray[np.float64]

_UPRIGHT = 28  # letters over the height of axes, of which there are at most two beside each other


def section_page(
    table: TestTable,
    design: int | ArrayLike,
    variable: Key,
    X: ArrayLike,
    F: ArrayLike,
    G: ArrayLike | None = None,
    H: ArrayLike | None = None,
    *,
    limits: Limits | None = None,
    title: str = "",
) -> Figure:
    """Return the criteria along one variable, the others staying those of one design.

    The designs are those of :func:`~pymoo_psi.table.section_points`, evaluated by their problem.
    Each criterion has axes of its own, its feasible parts in bold, its limit shaded; its curve is
    interrupted where a design failed.

    Args:
        table: The table the design is from.
        design: Number of the test point the section goes through, or ``(n_var,)`` a design.
        variable: Name or index of the variable that runs, a real one or an integer.
        X: ``(k, n_var)`` the designs of the section, in any order.
        F: ``(k, m)`` their criteria, as the problem gives them: all minimised.
        G: ``(k, n_ieq)`` their inequality constraints.
        H: ``(k, n_eq)`` their equality constraints.
        limits: Limits on columns.
        title: What is drawn; the design follows it.

    Raises:
        ArgumentValueError: The design or variable is not there, the arrays do not fit the table,
            or X differs from the design in another variable.
        ArgumentTypeError: ``table`` is no test table, or an array holds what it cannot.

    Example:
        >>> from pymoo_psi import TestTable
        >>> from pymoo_psi.table import section_points
        >>> table = TestTable.of([1], X=[[1.0, 5.0]], F=[[6.0, 5.0]])
        >>> X = section_points(table, 1, "x1", 3, lower=0, upper=2)
        >>> F = [[x1 + x2, x1 * x2] for x1, x2 in X]
        >>> [ax.get_ylabel() for ax in section_page(table, 1, "x1", X, F).axes]
        ['f1', 'f2']
    """
    curves = section_of(table, design, variable, X, F, G, H, limits)
    names = table.layout.objectives
    wide = min(len(names), 2)
    with grid_page(-(-len(names) // wide), wide) as (figure, grid):
        for i, name in enumerate(names):
            draw_section(grid.flat[i], curves, i, name)
        for ax in grid.flat[len(names) :]:
            ax.set_axis_off()
        failed = int((~np.isfinite(curves.F)).any(axis=1).sum())
        note = f", {failed} failed" if failed else ""
        through = f"section through {curves.through}: {counted(len(curves.x), 'design')}{note}"
        figure.suptitle(f"{title}\n{through}".strip())
        design_legends(figure, grid)
    return figure


@dataclass(frozen=True, eq=False)
class Section:
    """The criteria along a variable.

    Attributes:
        variable: Name of the variable.
        layout: The columns of the table.
        through: What the design is called that the section goes through.
        at: That design's value of the variable.
        x: ``(k,)`` values of the variable, growing.
        F: ``(k, m)`` criteria, each in its own sense; NaN or infinite where a design failed.
        feasible: ``(k,)`` which designs meet the constraints and keep the limits.
        limits: The least and the greatest value allowed of columns that are limited.
    """

    variable: str
    layout: Layout
    through: str
    at: float
    x: Array
    F: Array
    feasible: NDArray[np.bool_]
    limits: Mapping[str, tuple[float, float]]


def section_of(
    table: TestTable,
    design: int | ArrayLike,
    variable: Key,
    X: ArrayLike,
    F: ArrayLike,
    G: ArrayLike | None,
    H: ArrayLike | None,
    limits: Limits | None,
) -> Section:
    """Check that the designs are a section and put them in order; see :func:`section_page`."""
    layout = checked_table(table).layout
    j = layout.variable(variable)
    row = design_of(table, design)
    tests = TestTable.of(np.arange(1, np.shape(F)[0] + 1), X, F, G, H, layout=layout)
    kind = column_kinds(np.vstack([tests.X, row]))[j]
    if kind not in (Kind.REAL, Kind.INTEGER):
        received = Received(f"one that is a {kind.value}")
        raise invalid("variable", "a real number or an integer", received)
    others = row != tests.X
    others[:, j] = False
    if others.any():
        i, k = (int(place) for place in np.argwhere(others)[0])
        rule = f"the design's in every variable but {layout.variables[j]!r}"
        raise invalid("X", rule, Received(f"another {layout.variables[k]!r} in row {i}"))
    x = tests.X[:, j].astype(np.float64)
    order = np.argsort(x, kind="stable")
    return Section(
        layout.variables[j],
        layout,
        f"test point {design}" if isinstance(design, (int, np.integer)) else "the design",
        float(row[j]),
        x[order],
        tests.F[order] * layout.sign,
        tests.feasible(limits)[order],
        bounds_of(limits, layout),
    )


def draw_section(axes: Axes, curves: Section, criterion: int, name: str) -> None:
    """Draw one criterion, by its index and name, along the variable."""
    f = curves.F[:, criterion]
    known = np.abs(f) < HUGE
    # Matplotlib interrupts a line at NaN.
    axes.plot(curves.x, np.where(known, f, np.nan), color="0.55", linestyle="-", linewidth=0.8)
    for group, members, look in (
        (
            "not feasible",
            known & ~curves.feasible,
            {"color": "0.45", "linestyle": "none", "marker": "x", "markeredgewidth": 0.7},
        ),
        (
            "feasible",
            known & curves.feasible,
            {"color": CURVES[0]["color"], "linestyle": "-", "marker": "o", "linewidth": 1.8},
        ),
    ):
        values = np.where(members, f, np.nan)
        label = f"{group} ({members.sum()})"
        axes.plot(curves.x, values, markersize=3.4, label=label, **look)
    axes.axvline(
        curves.at, color="0.25", linestyle=":", linewidth=1.0,
        label=f"{curves.through}: {literal(curves.variable)} = {curves.at:.5g}",
    )  # fmt: skip
    axes.set_xlim(view(curves.x, curves.at))
    axes.set_ylim(view(f))
    if name in curves.limits:
        draw_limits(axes, "y", name, curves.limits[name])
    axes.set_xlabel(literal(curves.layout.label_of(curves.variable)))
    axes.set_ylabel(upright(curves.layout.label_of(name), _UPRIGHT))
    tick_counts(axes, x=6, y=5)
