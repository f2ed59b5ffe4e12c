"""Test tables and rankings: objectives over variables and in pairs, histograms, parallel axes.

Values are in the original units and direction. In the place of an objective may be a constraint or
an output.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from pymoo_psi._renamed import asked_under_a_formulation
from pymoo_psi._validation import Received, counted, instance, invalid, known_name
from pymoo_psi.pareto import EfficiencyRanking, number
from pymoo_psi.plots._points import (
    BLUE,
    MARKERS,
    ORANGE,
    PARETO,
    checked,
    name_axis,
    points_of_table,
    ranked_groups,
)
from pymoo_psi.plots._style import Drawing, legend_of, literal, new_figure, panels, row_height
from pymoo_psi.table import Histogram, Layout, TestTable, histogram

Array = NDArray[np.float64]

MATRIX = 6  # variables, and objectives, beside which the text on the axes is still readable
_LINES = 2000  # of a group; more would be one grey area, and take long to draw
_BARE = 60  # lines beyond which those of a group are thin
_TEXT = 100  # letters over the width of a figure, in the size of ticks
# Of each group of a histogram: its part of a bin, its look.
_BARS: dict[str, tuple[tuple[float, float], dict[str, Any]]] = {
    "tested": ((0.0, 1.0), {"facecolor": "0.9", "edgecolor": "0.55"}),
    "feasible": ((0.08, 0.5), {"facecolor": BLUE}),
    "pareto": ((0.5, 0.92), {"facecolor": ORANGE, "edgecolor": "white", "hatch": "////"}),
}


@asked_under_a_formulation
def plot_table(
    table: TestTable,
    *,
    variables: Sequence[str] | None = None,
    objectives: Sequence[str] | None = None,
    title: str = "",
) -> Drawing:
    """Return an overview of a table: histograms of variables, objectives against variables.

    Up to six variables and six objectives make a matrix: a column for each variable, on top its
    histogram and below it a row for each objective. Of more there are the histograms alone, six
    in a row; name some of them for a matrix of these.

    Args:
        table: A test table.
        variables: Names of the variables, or of other columns; all variables by default.
        objectives: Names of the objectives, or of other columns; all objectives by default, none
            for histograms alone.
        title: What the table is of; begins the caption.

    Raises:
        ArgumentValueError: A column is not in the table, or there is no variable.
        ArgumentTypeError: ``table`` is no test table.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1, 3.0], [0.5, 4.0]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> len(plot_table(table.under(limits={"f1": 1.5})).axes)
        6
    """
    layout = checked(table).layout
    rows = _known("objectives", layout.objectives if objectives is None else objectives, layout)
    columns = _known("variables", layout.variables if variables is None else variables, layout)
    if not columns:
        raise invalid("variables", "one or more", Received("none"))
    rows = rows if max(len(columns), len(rows)) <= MATRIX else []
    points = points_of_table(table, [*columns, *rows] if rows else ())
    counts = [histogram(table, name) for name in columns]
    whole = (len(table), int(table.feasible().sum()), int(table.pareto().sum()))
    wide = min(len(columns), MATRIX)
    with panels(len(columns) * (1 + len(rows)), wide) as (figure, axes):
        tops = axes[: len(columns)]
        for j, (top, name, found) in enumerate(zip(tops, columns, counts, strict=True)):
            _draw_bars(top, found, whole, tested=name in layout.variables)
            name_axis(top, "x", "" if rows else layout.label_of(name), found.values)
            name_axis(top, "y", "" if j % wide else "% of each group")
            for ax, objective in zip(axes[j + wide :: wide], rows, strict=False):
                points.draw(ax, name, objective)
                ax.label_outer()
            if rows and not found.values:  # others have a bin for each value
                top.set_xlim(points.columns[name].ends)
        for top in tops:
            top.set_ylim(0, max(ax.get_ylim()[1] for ax in tops))
        legend_of(figure, axes)
        what = "Histograms: the share of each group that an interval holds."
        what += " Below, objectives against variables." if rows else ""
        parts = [f"{sum(each.outside)} by {each.variable}" for each in counts if any(each.outside)]
        out = f"In no interval, far from the others: {', '.join(parts)}." if parts else ""
        figure.describe(title, what, points.counts(table), out)
    return figure


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
        objectives: Names of two to seven objectives, or of other columns; all objectives by
            default.
        design: Number or label of a design to be marked, such as the one that was chosen.
        title: What the table is of; begins the caption.

    Raises:
        ArgumentValueError: A column or the design is not in the table, or there are too few or too
            many objectives.
        ArgumentTypeError: ``table`` is no test table.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        >>> sum(ax.axison for ax in plot_objectives(table).axes)
        3
    """
    layout = checked(table).layout
    names = _known("objectives", layout.objectives if objectives is None else objectives, layout)
    if not 2 <= len(names) <= MATRIX + 1:
        rule = f"from 2 to {MATRIX + 1} to draw in pairs"
        raise invalid("objectives", rule, len(names), "name those to be drawn")
    chosen = None
    if design is not None:
        chosen = table.rows([table.row_of(design)])
    points, wide = points_of_table(table, names, chosen), len(names) - 1
    with new_figure(28.0 + wide * row_height(wide)) as figure:
        cells = figure.add_gridspec(wide, wide)
        for k in range(wide):
            for j in range(k + 1):
                ax = figure.add_subplot(cells[k, j])
                points.draw(ax, names[j], names[k + 1])
                ax.label_outer()
        legend_of(figure, figure.axes)
        figure.describe(title, "Objectives in pairs.", points.counts(table))
    return figure


def _known(argument: str, names: Sequence[str], layout: Layout) -> list[str]:
    return [known_name(argument, name, layout.columns) for name in names]


def _draw_bars(axes: Axes, found: Histogram, whole: tuple[int, ...], *, tested: bool) -> None:
    """Draw the bars of each group; ``tested`` not where bins are those of the feasible designs."""
    edges, width = found.edges, np.diff(found.edges)
    if len(width) > 1 and not np.allclose(width, width[0]):  # of a logarithmic scale
        axes.set_xscale("log")
    for (group, ((start, end), look)), n in zip(_BARS.items(), whole, strict=True):
        if group == "tested" and not tested:
            continue
        axes.bar(
            edges[:-1] + start * width, 100.0 * getattr(found, group) / max(n, 1),
            (end - start) * width, align="edge", linewidth=0.5,
            label=f"bars: {group.replace('pareto', PARETO)} ({n})", **look,
        )  # fmt: skip
    if len(edges) > 1:
        axes.set_xlim(edges[0], edges[-1])


# Any ranked Pareto set


def plot_ranking(
    ranking: EfficiencyRanking,
    *,
    units: Mapping[Any, str] | None = None,
    title: str = "",
    row: int | None = None,
) -> Drawing:
    """Return the Pareto-optimal designs of a ranking as parallel coordinates, by rank.

    Each is a line from the best value of every objective at the bottom to the worst of the Pareto
    set. :func:`plot_objectives` of a table draws objectives in pairs.

    Args:
        ranking: From :func:`pymoo_psi.rank_of_efficiency` or ``table.ranking()``.
        units: Units of objectives by name, such as ``table.layout.units``.
        title: What the designs are; begins the caption.
        row: A design whose line is marked, such as the chosen one.

    Raises:
        ArgumentTypeError: ``ranking`` is none.

    Example:
        >>> from pymoo_psi import rank_of_efficiency
        >>> figure = plot_ranking(rank_of_efficiency([[1, 5], [2, 2], [5, 1]]))
        >>> [ax.get_ylabel() for ax in figure.axes]
        ['share of the range (0 is best)']
    """
    instance("ranking", ranking, EfficiencyRanking, "rank_of_efficiency(F) gives one")
    names = ranking.objectives.headings({} if units is None else units)
    values, sign = ranking.objectives.values, ranking.objectives.sign
    front = values[ranking.pareto] * sign
    best, worst = front.min(axis=0) * sign, front.max(axis=0) * sign
    shares = (values - best) / np.where(worst == best, 1.0, worst - best)
    place, looks = np.arange(len(names)), list[Line2D]()
    with panels(1, 1, height=60.0 if len(names) <= MATRIX else 90.0) as (figure, (axes,)):
        for name, group in ranked_groups(ranking).items():
            rows = group.rows[:: -(-len(group.rows) // _LINES)]
            many, top = len(group.rows) > _BARE, group.level == MARKERS[6][-1]
            lines = LineCollection(
                [np.column_stack([place, share]) for share in shares[rows]],
                colors=group.colour, linewidths=2.0 if top else 0.4 if many else 1.0,
                alpha=0.5 if many else 1.0, zorder=group.level, rasterized=many,
            )  # fmt: skip
            axes.add_collection(lines)
            looks.append(Line2D([], [], **group.look(name)))
        if row is not None and row not in ranking.salukvadze:
            look: dict[str, Any] = {"marker": "o", "markersize": 4.0, "linewidth": 2.0}
            axes.plot(place, shares[row], "k--", label="chosen", zorder=7.0, **look)
        axes.set(xlim=(-0.4, len(place) - 0.6), ylim=(-0.05, 1.05))
        ends = zip(names, best.tolist(), worst.tolist(), strict=True)
        labels = [f"{literal(n, 30)}\nbest {number(b)}\nworst {number(w)}" for n, b, w in ends]
        longest = max(len(line) for label in labels for line in label.split("\n"))
        axes.set_xticks(place, labels, rotation=90 if (longest + 2) * len(labels) > _TEXT else 0)
        axes.set_ylabel("share of the range (0 is best)")
        legend_of(figure, [axes], *looks, fontsize=8)
        optimal = counted(int(ranking.pareto.sum()), "Pareto-optimal design")
        shown = f"{optimal} of {len(ranking.rank)}, by rank of efficiency, each a line from the "
        shown += "best to the worst value of every objective."
        figure.describe(title, shown)
    return figure
