"""A test table on one page: its designs over all variables, its criteria in pairs, a section."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from matplotlib.figure import Figure

from pymoo_psi.arguments import Received, broken_rule, instance
from pymoo_psi.figures.histograms import draw_histogram
from pymoo_psi.figures.page_parts import blank_page, draw_small, heading, legends, share, small
from pymoo_psi.figures.planes import checked_table, criteria_plane, variable_plane
from pymoo_psi.figures.sections import Section, draw_section
from pymoo_psi.figures.style import page_style
from pymoo_psi.investigation import TestTable
from pymoo_psi.investigation.layout import Key, Limits

__all__ = ["criteria_page", "section_page", "table_page"]

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
        raise broken_rule("variables", "one or more", Received("none"))
    if max(len(columns), len(rows)) > _MATRIX:
        rows = []
    wide = min(len(columns), _MATRIX)
    high = len(rows) or -(-len(columns) // wide) - 1
    with page_style():
        figure, grid = blank_page(1 + high, wide)
        for ax, j in zip(grid.ravel(), columns, strict=False):
            histogram = table.histogram(j, limits=limits)
            draw_histogram(histogram, ax=ax, legend=False, numbers=False)
            small(ax, wide, (histogram.variable, ax.get_ylabel()), histogram.values)
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
        raise broken_rule("criteria", rule, len(chosen), "name those to be drawn")
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
        >>> from pymoo_psi.figures import section
        >>> table = TestTable.of([1], X=[[1.0, 5.0]], F=[[6.0, 5.0]])
        >>> X = table.section_points(1, "x1", 3, lower=0, upper=2)
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
