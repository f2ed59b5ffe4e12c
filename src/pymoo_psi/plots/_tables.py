"""Figures of test tables and rankings: histograms, planes of two columns, parallel coordinates.

Values are in the original units and direction. A constraint or an output may take the place of an
objective.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from pymoo_psi._names import asked_under_a_formulation
from pymoo_psi._validation import Array, Received, counted, instance, invalid, known_name
from pymoo_psi.pareto import EfficiencyRanking, number
from pymoo_psi.plots._points import (
    BLUE,
    OPTIMUM,
    ORANGE,
    PARETO,
    Group,
    Points,
    checked,
    name_axis,
    points_of_table,
    ranked_groups,
)
from pymoo_psi.plots._style import (
    Drawing,
    Style,
    legend_of,
    literal,
    new_figure,
    panels,
    row_height,
)
from pymoo_psi.table import Histogram, Layout, TestTable, histogram

MATRIX = 6  # variables, or objectives, beside which the text on the axes is still readable
_MANY = 60  # lines from here on those of a group are thin
_MOST = 2000  # lines of a group; more would be one grey area, and take long to draw
_LETTERS = 100  # of text over the width of a figure, in the size of ticks


# Bars of the groups in a histogram: their sides in shares of the interval, and their style.
_BARS: dict[str, tuple[float, float, Style]] = {
    "tested": (0.0, 1.0, {"facecolor": "0.9", "edgecolor": "0.55"}),
    "feasible": (0.08, 0.5, {"facecolor": BLUE}),
    "pareto": (0.5, 0.92, {"facecolor": ORANGE, "edgecolor": "white", "hatch": "////"}),
}


# Histograms, and objectives against variables


@asked_under_a_formulation
def plot_table(
    table: TestTable,
    *,
    variables: Sequence[str] | None = None,
    objectives: Sequence[str] | None = None,
    title: str = "",
) -> Drawing:
    """Return an overview of a table: histograms of variables, and objectives against variables.

    Up to six variables and six objectives make a matrix. It has a column for each variable, with
    its histogram on top, and a row for each objective. With more variables or objectives there are
    histograms only, six in a row; name some of the columns to get their matrix.

    Args:
        table: A test table.
        variables: Names of variables or other columns; all variables by default.
        objectives: Names of objectives or other columns; all objectives by default, none for
            histograms only.
        title: Subject of the table, with which the caption begins.

    Raises:
        ArgumentValueError: A column is not in the table, or there is no variable.
        ArgumentTypeError: ``table`` is not a test table.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1, 3.0], [0.5, 4.0]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> len(plot_table(table.under(limits={"f1": 1.5})).axes)
        6
    """
    layout = checked(table).layout
    tops = _known("variables", variables, layout.variables, layout)
    rows = _known("objectives", objectives, layout.objectives, layout)
    if not tops:
        raise invalid("variables", "one or more", Received("none"))
    if max(len(tops), len(rows)) > MATRIX:
        rows = []
    drawn = []
    if rows:
        drawn = [*tops, *rows]
    points = points_of_table(table, drawn)
    histograms = [histogram(table, name) for name in tops]
    n_columns = min(len(tops), MATRIX)
    with panels(len(tops) * (1 + len(rows)), n_columns) as (figure, axes):
        _draw_histograms(axes[: len(tops)], histograms, table, points)
        for ax in axes[: len(tops) : n_columns]:
            ax.set_ylabel("% of each group")
        planes = product(rows, tops)
        for ax, (objective, variable) in zip(axes[len(tops) :], planes, strict=True):
            points.draw(ax, variable, objective)
            ax.label_outer()
        legend_of(figure, axes)
        sentences = ["Histograms: the share of each group in each interval."]
        if rows:
            sentences.append("Below, objectives against variables.")
        figure.describe(title, *sentences, points.counts(table), _outside(histograms))
    return figure


def _known(
    argument: str, names: Sequence[str] | None, default: Sequence[str], layout: Layout
) -> list[str]:
    """Return the names of columns of a table, by default those given."""
    if names is None:
        names = default
    return [known_name(argument, name, layout.columns) for name in names]


def _draw_histograms(
    axes: Sequence[Axes], histograms: Sequence[Histogram], table: TestTable, points: Points
) -> None:
    """Draw histograms on one scale; name their axes, or align them with the planes below.

    Args:
        axes: Axes for each histogram.
        histograms: The histograms.
        table: The table.
        points: The designs on the planes below; without columns if there are none.
    """
    totals = {
        "tested": len(table),
        "feasible": table.feasible().sum(),
        "pareto": table.pareto().sum(),
    }
    for ax, bars in zip(axes, histograms, strict=True):
        _draw_histogram(ax, bars, table.layout, totals)
        name_axis(ax, "y", "")
        label = table.layout.label_of(bars.variable)
        if points.columns:  # the planes below have the name
            label = ""
        name_axis(ax, "x", label, bars.values)
        if points.columns and not bars.values:  # options have an interval each, and are aligned
            ax.set_xlim(points.columns[bars.variable].ends)
    highest = max(ax.get_ylim()[1] for ax in axes)
    for ax in axes:
        ax.set_ylim(0, highest)


def _draw_histogram(axes: Axes, bars: Histogram, layout: Layout, totals: Mapping[str, int]) -> None:
    """Draw the share of each group in each interval.

    Args:
        axes: The axes.
        bars: Edges of the intervals, and the numbers of designs in them.
        layout: Layout of the table.
        totals: The number of designs in each group.
    """
    edges = bars.edges
    widths = np.diff(edges)
    if len(widths) > 1 and not np.allclose(widths, widths[0]):
        axes.set_xscale("log")
    for group, (left, right, style) in _BARS.items():
        # The intervals of a dependent column span the feasible designs; other tests are outside.
        if group == "tested" and bars.variable not in layout.variables:
            continue
        n = totals[group]
        name = group.replace("pareto", PARETO)
        axes.bar(
            edges[:-1] + left * widths,
            100.0 * getattr(bars, group) / max(n, 1),
            (right - left) * widths,
            align="edge",
            linewidth=0.5,
            label=f"bars: {name} ({n})",
            **style,
        )
    if len(edges) > 1:
        axes.set_xlim(edges[0], edges[-1])


def _outside(histograms: Sequence[Histogram]) -> str:
    """Return a sentence on values outside the histograms; empty if there are none."""
    parts = []
    for bars in histograms:
        n = sum(bars.outside)
        if n:
            parts.append(f"{counted(n, 'value')} of {bars.variable}")
    if not parts:
        return ""
    return f"Outside the histograms: {', '.join(parts)}."


# Objectives in pairs


@asked_under_a_formulation
def plot_objectives(
    table: TestTable,
    *,
    objectives: Sequence[str] | None = None,
    design: int | str | None = None,
    title: str = "",
) -> Drawing:
    """Return the objectives against each other, each pair once.

    Args:
        table: A test table.
        objectives: Names of two to seven objectives or other columns; all objectives by default.
        design: Number or label of a design to be marked, such as the chosen one.
        title: Subject of the table, with which the caption begins.

    Raises:
        ArgumentValueError: A column or the design is not in the table, or there are too few or too
            many objectives.
        ArgumentTypeError: ``table`` is not a test table.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        >>> sum(ax.axison for ax in plot_objectives(table).axes)
        3
    """
    layout = checked(table).layout
    names = _known("objectives", objectives, layout.objectives, layout)
    if not 2 <= len(names) <= MATRIX + 1:
        rule = f"from 2 to {MATRIX + 1} to draw in pairs"
        raise invalid("objectives", rule, len(names), "name those to be drawn")
    chosen = None
    if design is not None:
        chosen = table.rows([table.row_of(design)])
    points = points_of_table(table, names, chosen)
    n = len(names) - 1
    with new_figure(28.0 + n * row_height(n)) as figure:
        grid = figure.add_gridspec(n, n)
        for row, second in enumerate(names[1:]):
            for column, first in enumerate(names[: row + 1]):
                ax = figure.add_subplot(grid[row, column])
                points.draw(ax, first, second)
                ax.label_outer()
        legend_of(figure, figure.axes)
        figure.describe(title, "Objectives in pairs.", points.counts(table))
    return figure


# Parallel coordinates


def plot_ranking(
    ranking: EfficiencyRanking,
    *,
    units: Mapping[Any, str] | None = None,
    title: str = "",
    row: int | None = None,
) -> Drawing:
    """Return the Pareto-optimal designs of a ranking as parallel coordinates.

    Each design is a line. The best value of each objective in the Pareto set is at the bottom, the
    worst on top. :func:`plot_objectives` draws the objectives of a table in pairs.

    Args:
        ranking: From :func:`pymoo_psi.rank_of_efficiency` or ``table.ranking()``.
        units: Units of objectives by name, such as ``table.layout.units``.
        title: Subject of the ranking, with which the caption begins.
        row: Row of a design whose line is marked, such as the chosen one.

    Raises:
        ArgumentTypeError: ``ranking`` is not a ranking.

    Example:
        >>> from pymoo_psi import rank_of_efficiency
        >>> figure = plot_ranking(rank_of_efficiency([[1, 5], [2, 2], [5, 1]]))
        >>> [ax.get_ylabel() for ax in figure.axes]
        ['share of the range (0 is best)']
    """
    instance("ranking", ranking, EfficiencyRanking, "rank_of_efficiency(F) returns one")
    shares, labels, rotation = _ranking_info(ranking, units or {})
    n = len(labels)
    height = 60.0
    if n > MATRIX:
        height = 90.0
    with panels(1, 1, height=height) as (figure, (ax,)):
        legend = []
        for name, group in ranked_groups(ranking).items():
            ax.add_collection(_lines(shares, group))
            label = name.replace("unranked", "rank 0").replace("rank", "rank of efficiency")
            if group.marker is OPTIMUM:
                label = "place 1, the Salukvadze optimum"
            legend.append(Line2D([], [], **group.style(label)))
        if row is not None and row not in ranking.salukvadze:
            style = {"marker": "o", "markersize": 4.0, "linewidth": 2.0}
            ax.plot(np.arange(n), shares[row], "k--", label="chosen", zorder=7.0, **style)
        ax.set(xlim=(-0.4, n - 0.6), ylim=(-0.05, 1.05))
        ax.set_ylabel("share of the range (0 is best)")
        ax.set_xticks(np.arange(n), labels, rotation=rotation)
        legend_of(figure, [ax], *legend, fontsize=8)
        optimal = counted(ranking.pareto.sum(), "Pareto-optimal design")
        figure.describe(
            title,
            f"{optimal} of {len(ranking.rank)}, by rank of efficiency.",
            "Each is a line from the best values in the Pareto set, at the bottom, to the worst.",
        )
    return figure


def _ranking_info(
    ranking: EfficiencyRanking, units: Mapping[Any, str]
) -> tuple[Array, list[str], int]:
    """Return what :func:`plot_ranking` draws.

    Args:
        ranking: The ranking.
        units: Units of objectives by name.

    Returns:
        ``(n, m)`` the values of the designs as shares of the way from best to worst; name, best
        and worst value of each objective; and the angle of these labels, so that they do not
        overlap.
    """
    values = ranking.objectives.values
    sign = ranking.objectives.sign
    front = values[ranking.pareto] * sign
    best = front.min(axis=0) * sign
    worst = front.max(axis=0) * sign
    lengths = np.where(worst == best, 1.0, worst - best)

    names = ranking.objectives.headings(units)
    labels = []
    longest = 0
    for name, low, high in zip(names, best.tolist(), worst.tolist(), strict=True):
        lines = [literal(name, 30), f"best {number(low)}", f"worst {number(high)}"]
        labels.append("\n".join(lines))
        longest = max(longest, *map(len, lines))
    rotation = 0
    if (longest + 2) * len(labels) > _LETTERS:
        rotation = 90
    return (values - best) / lengths, labels, rotation


def _lines(shares: Array, group: Group) -> LineCollection:
    """Return a line for each design of a group, or for a part of very many."""
    rows = np.flatnonzero(group.mask)
    n = len(rows)
    step = -(-n // _MOST)  # rounded up
    width = 1.0
    alpha = 1.0
    if n > _MANY:
        width = 0.4
        alpha = 0.5
    if group.marker is OPTIMUM:
        width = 2.0
    places = np.arange(shares.shape[1])
    lines = [np.column_stack([places, line]) for line in shares[rows[::step]]]
    return LineCollection(
        lines,
        colors=group.marker.colour,
        linewidths=width,
        alpha=alpha,
        zorder=group.marker.level,
        rasterized=n > _MANY,
    )
