"""A test table on one page: its designs over all variables, or its criteria in pairs.

The axes of a page are small, and share names, ticks and legends.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.plots._designs import (
    Plane,
    checked_table,
    criteria_plane,
    design_groups,
    design_look,
    draw_plane,
    group_look,
    label_axes,
    members_of,
    prototype_look,
    variable_plane,
)
from pymoo_psi.plots._histogram import draw_bars
from pymoo_psi.plots._style import enlarge_markers, named_legend, new_page, view
from pymoo_psi.table import Key, Layout, Limits, TestTable, histogram

MATRIX = 6  # variables, and criteria, beside which the text on the axes is still readable


def table_page(
    table: TestTable,
    limits: Limits | None = None,
    *,
    variables: Sequence[Key] | None = None,
    criteria: Sequence[Key] | None = None,
    margin: float = 1.0,
    title: str = "",
) -> Figure:
    """Return an overview of a table: histograms of variables, criteria against variables.

    Up to six variables and six criteria make a matrix: a column for each variable, on top its
    histogram and below it a row for each criterion. Of more there are the histograms alone, six
    in a row on a page as high as it takes; name some of them for a matrix of these.

    Args:
        table: A test table.
        limits: Limits on columns.
        variables: Names or indices of the variables on the page; all by default. On a page of
            histograms alone there may be other columns among them, by name.
        criteria: Names or indices of the criteria; all by default, none for histograms alone.
            Constraints and further outputs may be among them, by name.
        margin: The axes of criteria reach beyond the feasible designs and the prototype by this
            share of their range; ``float("inf")`` to show all designs.
        title: What the table is of.

    Raises:
        ArgumentValueError: A variable or criterion is not in the table, there is no variable, or
            the margin is below 0.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        A column for each variable: its histogram, and below it a plane for each criterion.

        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1, 3.0], [0.5, 4.0]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> len(table_page(table, {"f1": 1.5}).axes)
        6
    """
    layout = checked_table(table).layout
    _check_margin(margin)
    rows = _criteria(criteria, layout)
    others = () if rows else layout.columns[len(layout.variables) :]
    keys = layout.variables if variables is None else variables
    columns: list[Any] = [key if key in others else layout.variable(key) for key in keys]
    if not columns:
        raise invalid("variables", "one or more", Received("none"))
    if max(len(columns), len(rows)) > MATRIX:
        rows = []
    wide = min(len(columns), MATRIX)
    high = 1 + len(rows) if rows else -(-len(columns) // wide)
    group = design_groups(table, limits)
    planes = [[variable_plane(table, j, i, limits, group) for j in columns] for i in rows]
    with grid_page(high, wide) as (figure, grid):
        tops = grid.ravel()[: len(columns)]
        for ax, j in zip(tops, columns, strict=True):
            found = histogram(table, j, limits=limits)
            draw_bars(ax, found, numbers=False, tested=j not in others)
            label = layout.label_of(found.variable)
            label_axes(ax, wide, (label, ax.get_ylabel()), found.values)
        for ax in tops:
            ax.set_ylim(0, max(ax.get_ylim()[1] for ax in tops))
        for ax in grid.ravel()[len(columns) :] if not rows else ():
            ax.set_axis_off()
        counts = [
            _draw_near(ax, plane, wide, margin)
            for axes, row in zip(grid[1:] if rows else (), planes, strict=True)
            for ax, plane in zip(axes, row, strict=True)
        ]
        # A histogram shows its bins from edge to edge, a plane its designs with a margin; without a
        # box of the variable either may reach farther.
        for column, plane in zip(grid.T, planes[0], strict=True) if rows else ():
            if plane.abscissa == "real":
                ends = [end for ax in column[:2] for end in ax.get_xlim()]
                for ax in column:
                    ax.set_xlim(min(ends), max(ends))
        share_axes(grid, below=bool(rows))
        design_legends(figure, grid, table, group if rows else None, title="points")
        figure.suptitle(_heading(table, title, counts))
    return figure


def criteria_page(
    table: TestTable,
    limits: Limits | None = None,
    *,
    criteria: Sequence[Key] | None = None,
    design: int | None = None,
    margin: float = 1.0,
    title: str = "",
) -> Figure:
    """Return the criteria against each other, each pair once.

    Args:
        table: A test table.
        limits: Limits on columns.
        criteria: Names or indices of two to seven criteria; all by default. Constraints and
            further outputs may be among them, by name.
        design: Number of a test point to be marked, such as the one that was chosen.
        margin: As for :func:`table_page`.
        title: What the table is of.

    Raises:
        ArgumentValueError: A criterion or the design is not in the table, there are too few or too
            many criteria, or the margin is below 0.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        Of three criteria there are three pairs.

        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        >>> sum(ax.axison for ax in criteria_page(table).axes)
        3
    """
    layout = checked_table(table).layout
    _check_margin(margin)
    chosen = _criteria(criteria, layout)
    if not 2 <= len(chosen) <= MATRIX + 1:
        rule = f"from 2 to {MATRIX + 1} to draw in pairs"
        raise invalid("criteria", rule, len(chosen), "name those to be drawn")
    if design is not None and design not in table.numbers:
        raise invalid("design", "the number of a test point of the table", design)
    marked = table.rows(table.numbers == design)
    wide = len(chosen) - 1
    group = design_groups(table, limits)
    counts = []
    ends = {}  # of each criterion, so that the axes of a row and of a column agree
    for name in chosen:
        alone = criteria_plane(table, name, name, limits, group).nearby(margin)
        ends[name] = view(np.vstack([alone.values, alone.prototype])[:, 0])
    with grid_page(wide, wide) as (figure, grid):
        for k, second in enumerate(chosen[1:]):
            for ax, first in zip(grid[k], chosen[: k + 1], strict=False):
                plane = criteria_plane(table, first, second, limits, group)
                counts.append(_draw_near(ax, plane, wide, margin, (ends[first], ends[second])))
                if len(marked):
                    ax.plot(marked.column(first), marked.column(second), **design_look())
            for ax in grid[k, k + 1 :]:
                ax.set_axis_off()
        share_axes(grid)
        marks = [] if design is None else [design_look()]
        design_legends(figure, grid, table, group, marks=marks)
        figure.suptitle(_heading(table, title, counts))
    return figure


def _check_margin(margin: float) -> None:
    if not margin >= 0:
        raise invalid("margin", "0 or more", margin)


def _criteria(keys: Sequence[Key] | None, layout: Layout) -> list[str]:
    """Return the names of what is drawn as criteria."""
    others = layout.constraints + layout.outputs
    keys = layout.objectives if keys is None else keys
    return [
        key if isinstance(key, str) and key in others else layout.objectives[layout.objective(key)]
        for key in keys
    ]


def row_height(wide: int) -> float:
    """Return the height in mm of axes of which ``wide`` are beside each other, the fewer higher."""
    return {1: 60.0, 2: 46.0, 3: 40.0}.get(wide, 33.0)


@contextmanager
def grid_page(high: int, wide: int) -> Iterator[tuple[Figure, Any]]:
    """Give a page with axes in ``high`` rows and ``wide`` columns, an array of them."""
    with new_page(34.0 + high * row_height(wide)) as figure:  # 34 mm are for title and legends
        yield figure, figure.subplots(high, wide, squeeze=False)


def _draw_near(
    ax: Any, plane: Plane, wide: int, margin: float, ends: Sequence[tuple[float, float]] = ()
) -> tuple[int, int]:
    """Draw what is near the feasible designs; return how many that are, and of how many."""
    near = plane.nearby(margin)
    draw_plane(ax, near, wide, ends)
    return len(near.values), len(plane.values)


def _heading(table: TestTable, title: str, counts: Sequence[tuple[int, int]]) -> str:
    """Return what is drawn, how many designs there are and which are not seen.

    Args:
        table: The designs.
        title: What they are.
        counts: Of each plane how many are near the feasible ones, and of how many.
    """
    failed = int(np.sum(table.status == "failed"))
    facts = [f"{counted(len(table), 'design')} tested"] + ([f"{failed} failed"] if failed else [])
    if any(near < known for near, known in counts):
        facts.append("those far from the feasible ones outside the axes")
    if any(known < len(table) - failed for _, known in counts):
        facts.append("unknown values and those beyond 1e300 not drawn")
    return f"{title}\n{', '.join(facts)}".strip()


def share_axes(grid: Any, *, below: bool = True) -> None:
    """Leave names at the left and below only, and ticks where they are not those of the others."""
    for lines, letter, outer in ((grid, "y", 0), (grid.T if below else [], "x", -1)):
        side = {"x": "labelbottom", "y": "labelleft"}[letter]
        for line in lines:
            shown = [ax for ax in line if ax.axison]
            end = shown[outer]
            for ax in shown:
                if ax is not end:
                    getattr(ax, f"set_{letter}label")("")
                    own, its = (getattr(one, f"get_{letter}lim")() for one in (ax, end))
                    if np.allclose(own, its, rtol=1e-12, atol=0.0):
                        ax.tick_params(**{side: False})


def design_legends(
    figure: Figure,
    grid: Any,
    table: TestTable | None = None,
    group: NDArray[np.str_] | None = None,
    *,
    marks: Sequence[dict[str, Any]] = (),
    title: str = "",
) -> None:
    """Put under the axes what their lines mean, and what bars if there are any.

    With ``group``, the ``(n,)`` groups of the designs of a table, the numbers in the legend are
    those of the whole table, whatever is outside of some axes.
    """
    handles = [handle for ax in grid.ravel() for handle in ax.get_legend_handles_labels()[0]]
    bars = {
        str(handle.get_label()): handle for handle in handles if isinstance(handle, BarContainer)
    }
    lines = {str(line.get_label()): line for line in handles if isinstance(line, Line2D)}
    if table is not None and group is not None:
        limits = {label: line for label, line in lines.items() if label.startswith("limit ")}
        looks = [group_look(name, len(members)) for name, members in members_of(group).items()]
        if table.prototype is not None:
            looks.append(prototype_look(", ".join(table.prototype.names)))
        looks += marks
        lines = {look["label"]: Line2D([], [], **look) for look in looks} | limits
    if bars:
        side, ncols = ("left", 1) if lines else ("center", 3)
        place, heading = f"outside lower {side}", "histograms, % of each group"
        enlarge_markers(named_legend(figure, bars.items(), loc=place, ncols=ncols, title=heading))
    if lines:
        place, ncols = f"outside lower {'right' if bars else 'center'}", 2
        if max(map(len, lines)) <= 28:  # characters that fit three times beside the bars' legend
            ncols = 3
        enlarge_markers(named_legend(figure, lines.items(), loc=place, ncols=ncols, title=title))
