"""What the pages of a test table are made of: small axes that share names, ticks and legends.

A test table on one page: its designs over all variables, its criteria in pairs, a section.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pymoo_psi._validation import Received, instance, invalid
from pymoo_psi.plots._designs import (
    DesignPlane,
    checked_table,
    criteria_plane,
    draw_plane,
    group_look,
    literal,
    name_places,
    prototype_look,
    variable_plane,
)
from pymoo_psi.plots._histogram import draw_histogram
from pymoo_psi.plots._section import Section, draw_section
from pymoo_psi.plots._style import WIDTH, enlarged_markers, inches, page_style
from pymoo_psi.table import TestTable, histogram
from pymoo_psi.table._layout import Key, Limits

_SCALE = 0.75  # of the markers on small axes
_LETTERS = 90  # of text over the width of a page


def blank_page(high: int, wide: int) -> tuple[Figure, Any]:
    """Return a figure 180 mm wide with axes in ``high`` rows and ``wide`` columns."""
    height = 34.0 + high * {1: 60.0, 2: 46.0, 3: 40.0}.get(wide, 33.0)
    figure = Figure(figsize=inches(WIDTH, height), layout="constrained")
    return figure, figure.subplots(high, wide, squeeze=False)


def draw_small(plane: DesignPlane, ax: Axes, wide: int, margin: float) -> None:
    """Draw what is near the feasible designs on one of ``wide`` axes beside each other."""
    draw_plane(plane.nearby(margin), ax=ax, legend=False)
    for line in ax.lines:
        line.set_markersize(_SCALE * line.get_markersize())
    small(ax, wide, plane.names, plane.options, whole=plane.abscissa == "integer")


def small(
    ax: Axes, wide: int, names: tuple[str, str], values: Sequence[object], *, whole: bool = False
) -> None:
    """Leave as much text on axes as there is room for."""
    ax.set_title("")
    ax.set_xlabel(literal(names[0], _LETTERS // wide))
    ax.set_ylabel(literal(names[1], 18))
    ax.yaxis.set_major_locator(MaxNLocator(4))
    if values:
        name_places(ax.xaxis, values, room=_LETTERS // wide)
    else:
        ax.xaxis.set_major_locator(MaxNLocator(max(3, 10 // wide), integer=whole))


def share(grid: Any, *, below: bool = True) -> None:
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


def legends(figure: Figure, grid: Any, plane: DesignPlane | None, *, title: str = "") -> None:
    """Put under the axes what their lines mean, and what bars if there are any.

    The numbers are those of the whole table, whatever is outside of some axes.
    """
    handles = [handle for ax in grid.ravel() for handle in ax.get_legend_handles_labels()[0]]
    bars = {
        str(handle.get_label()): handle for handle in handles if isinstance(handle, BarContainer)
    }
    lines = {str(line.get_label()): line for line in handles if isinstance(line, Line2D)}
    if plane is not None:
        limits = {label: line for label, line in lines.items() if label.startswith("limit ")}
        looks = [group_look(name, len(members)) for name, members in plane.groups().items()]
        if len(plane.prototype):
            looks.append(prototype_look(plane.prototype_name, scale=_SCALE))
        lines = {look["label"]: Line2D([], [], **look) for look in looks} | limits
    if bars:
        place = "left" if lines else "center"
        _legend(figure, bars, place, "histograms, % of each group", 1 if lines else 3)
    if lines:
        place = "right" if bars else "center"
        _legend(figure, lines, place, title, 3 if max(map(len, lines)) <= 28 else 2)


def _legend(
    figure: Figure,
    handles: Mapping[str, Any],
    place: str,
    title: str,
    ncols: int,
) -> None:
    outside: Any = f"outside lower {place}"
    legend = figure.legend(
        list(handles.values()), list(handles), loc=outside,
        ncols=ncols, title=title or None, fontsize=7, title_fontsize=7, alignment="left",
    )  # fmt: skip
    enlarged_markers(legend)


def heading(
    figure: Figure, table: TestTable, planes: Iterable[Iterable[DesignPlane]], margin: float,
    title: str,
) -> None:  # fmt: skip
    """Write over the axes what is drawn, how many designs there are and which are not seen."""
    failed = int(np.sum(table.status == "failed"))
    facts = [f"{len(table)} designs tested"] + ([f"{failed} failed"] if failed else [])
    if any(len(p.nearby(margin).values) < len(p.values) for row in planes for p in row):
        facts.append("those far from the feasible ones outside the axes")
    figure.suptitle(f"{title}\n{', '.join(facts)}".strip(), fontsize=9)


_MATRIX = 6  # variables, and criteria, that a matrix has at most


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
        limits: Limits on criteria.
        variables: Names or indices of the variables on the page; all by default.
        criteria: Names or indices of the criteria; all by default, none for histograms alone.
        margin: The axes of criteria reach beyond the feasible designs and the prototype by this
            share of their range; ``float("inf")`` to show all designs.
        title: What the table is of.

    Raises:
        ArgumentValueError: A variable or criterion is not in the table, there is no variable, or
            the margin is below 0.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        A column for each variable: its histogram, and below it a plane for each criterion.

        >>> table = TestTable.of([1, 2], X=[[0.1, 3.0], [0.5, 4.0]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> len(table_page(table, {"f1": 1.5}).axes)
        6
    """
    layout = checked_table(table).layout
    columns = _chosen(variables, layout.variables, layout.variable)
    rows = _chosen(criteria, layout.objectives, layout.objective)
    if not columns:
        raise invalid("variables", "one or more", Received("none"))
    if max(len(columns), len(rows)) > _MATRIX:
        rows = []
    wide = min(len(columns), _MATRIX)
    high = len(rows) or -(-len(columns) // wide) - 1
    with page_style():
        figure, grid = blank_page(1 + high, wide)
        for ax, j in zip(grid.ravel(), columns, strict=False):
            counts = histogram(table, j, limits=limits)
            draw_histogram(counts, ax=ax, legend=False, numbers=False)
            small(ax, wide, (counts.variable, ax.get_ylabel()), counts.values)
        tops = grid.ravel()[: len(columns)]
        for ax in tops:
            ax.set_ylim(0, max(ax.get_ylim()[1] for ax in tops))
        for ax in grid.ravel()[len(columns) :] if not rows else ():
            ax.set_axis_off()
        planes = [[variable_plane(table, i, j, limits=limits) for j in columns] for i in rows]
        for k, row in enumerate(planes, start=1):
            for ax, top, plane in zip(grid[k], tops, row, strict=True):
                draw_small(plane, ax, wide, margin)
                if plane.abscissa == "real":
                    top.set_xlim(ax.get_xlim())
        share(grid, below=bool(rows))
        legends(figure, grid, planes[0][0] if rows else None, title="points")
        heading(figure, table, planes, margin, title)
    return figure


def criteria_page(
    table: TestTable,
    limits: Limits | None = None,
    *,
    criteria: Sequence[Key] | None = None,
    margin: float = 1.0,
    title: str = "",
) -> Figure:
    """Return the criteria against each other, each pair once.

    Args:
        table: A test table.
        limits: Limits on criteria.
        criteria: Names or indices of two to seven criteria; all by default.
        margin: As for :func:`table_page`.
        title: What the table is of.

    Raises:
        ArgumentValueError: A criterion is not in the table, there are too few or too many, or the
            margin is below 0.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        Of three criteria there are three pairs.

        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        >>> sum(ax.axison for ax in criteria_page(table).axes)
        3
    """
    layout = checked_table(table).layout
    chosen = _chosen(criteria, layout.objectives, layout.objective)
    if not 2 <= len(chosen) <= _MATRIX + 1:
        rule = f"from 2 to {_MATRIX + 1} to draw in pairs"
        raise invalid("criteria", rule, len(chosen), "name those to be drawn")
    wide = len(chosen) - 1
    planes = [
        [criteria_plane(table, first, second, limits=limits) for first in chosen[:k]]
        for k, second in enumerate(chosen[1:], start=1)
    ]
    with page_style():
        figure, grid = blank_page(wide, wide)
        for axes, row in zip(grid, planes, strict=True):
            for ax, plane in zip(axes, row, strict=False):
                draw_small(plane, ax, wide, margin)
            for ax in axes[len(row) :]:
                ax.set_axis_off()
        share(grid)
        legends(figure, grid, planes[0][0])
        heading(figure, table, planes, margin, title)
    return figure


def section_page(curves: Section, *, title: str = "") -> Figure:
    """Return a section with all criteria, two beside each other.

    Args:
        curves: From :func:`section`.
        title: What is drawn; the design follows it.

    Example:
        >>> from pymoo_psi.plots import section
        >>> table = TestTable.of([1], X=[[1.0, 5.0]], F=[[6.0, 5.0]])
        >>> from pymoo_psi.table import section_points
        >>> X = section_points(table, 1, "x1", 3, lower=0, upper=2)
        >>> F = [[x1 + x2, x1 * x2] for x1, x2 in X]
        >>> [ax.get_ylabel() for ax in section_page(section(table, 1, "x1", X, F)).axes]
        ['f1', 'f2']
    """
    curves = instance("curves", curves, Section, "section(...) makes one")
    count = len(curves.layout.objectives)
    wide = min(count, 2)
    with page_style():
        figure, grid = blank_page(-(-count // wide), wide)
        for i, ax in enumerate(grid.ravel()):
            if i < count:
                draw_section(curves, i, ax=ax, legend=False)
                design = ax.get_title()
                ax.set_title("")
            else:
                ax.set_axis_off()
        figure.suptitle(f"{title}\n{design}".strip(), fontsize=9)
        legends(figure, grid, None)
    return figure


def _chosen(
    keys: Sequence[Key] | None, names: tuple[str, ...], index: Callable[[Key], int]
) -> list[int]:
    return list(range(len(names))) if keys is None else [index(key) for key in keys]
