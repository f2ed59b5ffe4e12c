"""One-at-a-time sections: the criteria along one variable, through a chosen design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, boolean, invalid
from pymoo_psi.plots._designs import checked_table, draw_limit, legend_below, literal, view
from pymoo_psi.plots._style import CURVES, on_axes
from pymoo_psi.table import Kind, Layout, TestTable
from pymoo_psi.table._designs import column_kinds
from pymoo_psi.table._layout import Key, Limits
from pymoo_psi.table._limits import limit_vector
from pymoo_psi.table.analysis import design_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Section:
    """The criteria along a variable, all others staying those of one design.

    Attributes:
        layout: Names of variables and criteria.
        variable: Name of the variable that runs.
        design: Number of the test point the section goes through; 0 for a design of one's own.
        at: That design's value of the variable.
        x: ``(k,)`` values of the variable, growing.
        F: ``(k, m)`` criteria; NaN or infinite where a design failed.
        feasible: ``(k,)`` which designs meet the constraints and keep the limits.
        limits: ``(m,)`` limits on the criteria; infinity where there is none.

    Example:
        >>> table = TestTable.of([1], X=[[1.0, 5.0]], F=[[6.0]])
        >>> from pymoo_psi.table import section_points
        >>> X = section_points(table, 1, "x1", 3, lower=0, upper=2)
        >>> F = X.sum(axis=1, keepdims=True)
        >>> curves = section(table, 1, "x1", X, F, limits={"f1": 6.5})
        >>> curves.x, curves.feasible
        (array([0., 1., 2.]), array([ True,  True, False]))
    """

    layout: Layout
    variable: str
    design: int
    at: float
    x: Array
    F: Array
    feasible: NDArray[np.bool_]
    limits: Array

    def runs(self, criterion: Key) -> list[slice]:
        """Return where the curve of a criterion is whole: runs of designs that did not fail.

        Example:
            >>> table = TestTable.of([1], X=[[1.0]], F=[[1.0]])
            >>> X, F = [[0.0], [1.0], [2.0], [3.0]], [[0], [1], [np.nan], [3]]
            >>> curves = section(table, 1, "x1", X, F)
            >>> curves.runs("f1")
            [slice(0, 2, None), slice(3, 4, None)]
        """
        known = np.isfinite(self.F[:, self.layout.objective(criterion)])
        steps = np.flatnonzero(np.diff(np.r_[False, known, False]))
        return [slice(int(a), int(b)) for a, b in zip(steps[::2], steps[1::2], strict=True)]


def section(
    table: TestTable,
    design: int | ArrayLike,
    variable: Key,
    X: ArrayLike,
    F: ArrayLike,
    G: ArrayLike | None = None,
    H: ArrayLike | None = None,
    *,
    limits: Limits | None = None,
) -> Section:
    """Put together the evaluated designs of :meth:`TestTable.section_points`.

    Args:
        table: The table the design is from.
        design: Number of the test point the section goes through, or ``(n_var,)`` a design.
        variable: Name or index of the variable that runs, a real one or an integer.
        X: ``(k, n_var)`` the designs of the section, in any order.
        F: ``(k, m)`` their criteria.
        G: ``(k, n_ieq)`` their inequality constraints.
        H: ``(k, n_eq)`` their equality constraints.
        limits: Limits on criteria.

    Raises:
        ArgumentValueError: The design or variable is not there, the arrays do not fit the table,
            or X differs from the design in another variable.
        ArgumentTypeError: An array holds what it cannot.

    Example:
        >>> table = TestTable.of([1, 2], X=[[1.0, 5.0], [2.0, 4.0]], F=[[6.0], [6.0]])
        >>> from pymoo_psi.table import section_points
        >>> X = section_points(table, 2, "x1", 3, lower=0, upper=4)
        >>> section(table, 2, "x1", X, F=X.sum(axis=1, keepdims=True)).F.ravel()
        array([4., 6., 8.])
    """
    layout = checked_table(table).layout
    j = layout.variable(variable)
    own = not isinstance(design, (int, np.integer))
    row = design_of(table, design)
    tests = TestTable.of(np.arange(1, np.shape(F)[0] + 1), X, F, G, H, layout=layout)
    kinds = column_kinds(np.vstack([tests.X, row]))
    if kinds[j] not in (Kind.REAL, Kind.INTEGER):
        raise invalid(
            "variable", "a real number or an integer", Received(f"one that is a {kinds[j].value}")
        )
    others = row != tests.X
    others[:, j] = False
    if others.any():
        i, k = (int(place) for place in np.argwhere(others)[0])
        rule = f"the design's in every variable but {layout.variables[j]!r}"
        raise invalid("X", rule, Received(f"another {layout.variables[k]!r} in row {i}"))
    x = tests.X[:, j].astype(np.float64)
    order = np.argsort(x, kind="stable")
    bounds = limit_vector(limits, layout)
    return Section(
        layout,
        layout.variables[j],
        0 if own else int(design),  # type: ignore[arg-type]
        float(row[j]),
        x[order],
        tests.F[order],
        tests.feasible(limits)[order],
        np.array([bounds.get(i, np.inf) for i in range(len(layout.objectives))]),
    )


def draw_section(
    curves: Section, criterion: Key = 0, *, ax: Axes | None = None, legend: bool = True,
    title: str = "",
) -> Axes:  # fmt: skip
    """Draw one criterion along the variable, its feasible parts in bold, its limit shaded.

    The curve is interrupted where a design failed.

    Args:
        curves: From :func:`section`.
        criterion: Name or index of the criterion.
        ax: Axes to draw on; new ones by default.
        legend: Put a legend with the numbers of designs under the axes.
        title: What is drawn; the design follows it.

    Returns:
        The axes.

    Raises:
        ArgumentValueError: There is no such criterion.

    Example:
        >>> table = TestTable.of([1], X=[[1.0, 5.0]], F=[[6.0]])
        >>> from pymoo_psi.table import section_points
        >>> X = section_points(table, 1, "x1", 3, lower=0, upper=2)
        >>> curves = section(table, 1, "x1", X, F=X.sum(axis=1, keepdims=True))
        >>> draw_section(curves, "f1").get_title()
        'section through test point 1: 3 designs'
    """
    legend = boolean("legend", legend)
    i = curves.layout.objective(criterion)
    f, name = curves.F[:, i], curves.layout.objectives[i]
    known = np.isfinite(f)
    with on_axes(ax) as axes:
        for run in curves.runs(i):
            axes.plot(curves.x[run], f[run], color="0.55", linestyle="-", linewidth=0.8)
        looks: dict[str, tuple[NDArray[np.bool_], dict[str, Any]]] = {
            "not feasible": (
                known & ~curves.feasible,
                {"color": "0.45", "marker": "x", "markersize": 3.4, "markeredgewidth": 0.7},
            ),
            "feasible": (
                known & curves.feasible,
                {"color": CURVES[0]["color"], "marker": "o", "markersize": 3.4, "linewidth": 1.8},
            ),
        }
        for group, (members, look) in looks.items():
            line = {"linestyle": "-" if group == "feasible" else "none"}
            axes.plot(
                curves.x, np.where(members, f, np.nan),
                label=f"{group} ({members.sum()})", **line, **look,
            )  # fmt: skip
        through = f"test point {curves.design}" if curves.design else "the design"
        axes.axvline(
            curves.at, color="0.25", linestyle=":", linewidth=1.0,
            label=f"{through}: {literal(curves.variable)} = {curves.at:.5g}",
        )  # fmt: skip
        axes.set_xlim(view(curves.x, curves.at))
        axes.set_ylim(view(f))
        if np.isfinite(curves.limits[i]):
            draw_limit(axes, "y", name, float(curves.limits[i]))
        axes.set_xlabel(literal(curves.variable))
        axes.set_ylabel(literal(name))
        axes.xaxis.set_major_locator(MaxNLocator(6))
        axes.yaxis.set_major_locator(MaxNLocator(5))
        failed = f", {(~known).sum()} failed" if not known.all() else ""
        axes.set_title(f"{title}\nsection through {through}: {len(f)} designs{failed}".strip())
        if legend:
            legend_below(axes)
    return axes  # type: ignore[no-any-return]
