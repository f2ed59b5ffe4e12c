"""Figures of test tables, rankings, sensitivities, fits to measurements and comparisons.

Values are in the original units and direction. A constraint or an output may take the place of an
objective.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.ticker import NullLocator

from pymoo_psi._numbers import number
from pymoo_psi._output import with_unit
from pymoo_psi._validation import (
    Array,
    Names,
    Received,
    counted,
    invalid,
    known_name,
)
from pymoo_psi.analysis import Histogram, histogram
from pymoo_psi.pareto import rank_of_efficiency, with_units
from pymoo_psi.plots._points import (
    BLUE,
    OPTIMUM,
    ORANGE,
    PARETO,
    Marker,
    groups_by_place,
    name_axis,
    opened_table,
    points_of_table,
)
from pymoo_psi.plots._style import (
    Drawing,
    Style,
    curves,
    legend_of,
    literal,
    new_figure,
    panels,
    row_height,
)
from pymoo_psi.table import Kind, Schema, TestTable

if TYPE_CHECKING:  # figures of tables need neither of these, nor pymoo and SciPy
    from pymoo_psi.comparison import Comparison


MATRIX = 6  # variables, or objectives, beside which the text on the axes is still readable
_MANY = 100  # lines; from here on those of a group are thin and overlap as a density
_FAINTEST = 0.02  # opacity of a line
_LETTERS = 66  # letters of ticks over the width of a column of a journal

_PANELS = 3  # panels side by side
# Indicators with their labels.
_INDICATORS = {
    "hypervolume": "hypervolume of all evaluated\ndesigns (share of the box)",
    "igd_plus": "IGD+ (units of N − U)",
    "epsilon": "additive epsilon (units of N − U)",
    "optimum_distance": "optimum distance (units of N − U)",
}
# The groups in a histogram, and how their stairs are drawn.
_STAIRS: dict[str, Style] = {
    "all": {"fill": True, "facecolor": "0.9"},
    "feasible": {"fill": True, "facecolor": "#A6CBE8"},
    PARETO: {"edgecolor": ORANGE, "linewidth": 1.5},
}


# Histograms, and objectives against variables


def plot_table(
    table: Any,
    *,
    variables: Names | None = None,
    objectives: Names | None = None,
    title: str = "",
) -> Drawing:
    """Return an overview of a table: histograms of variables, and objectives against variables.

    Up to six variables and six objectives make a matrix. It has a column for each variable, with
    its histogram on top, and a row for each objective. With more variables or objectives there are
    histograms only, six in a row; name some of the columns to get their matrix.

    Args:
        table: A test table, or anything else that :func:`pymoo_psi.read_table` opens, such as a
            data frame or a result of pymoo.
        variables: Names of variables or other columns; all variables by default.
        objectives: Names of objectives or other columns; all objectives by default, none for
            histograms only.
        title: Subject of the table, with which the caption begins.

    Raises:
        ArgumentValueError: A column is not in the table, or there is no variable.
        ArgumentTypeError: ``table`` is none, and cannot be read as one.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1, 3.0], [0.5, 4.0]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> len(plot_table(table.under(limits={"f1": 1.5})).axes)
        6
    """
    table = opened_table(table)
    schema = table.schema
    tops = _column_names("variables", variables, schema.variables, schema)
    rows = _column_names("objectives", objectives, schema.objectives, schema)
    if not tops:
        raise invalid("variables", "one or more", Received("none"))
    if max(len(tops), len(rows)) > MATRIX:
        rows = []
    points = points_of_table(table, [])
    if rows:
        points = points_of_table(table, [*tops, *rows])
    histograms = [histogram(table, name) for name in tops]
    n = len(tops)
    n_columns = min(n, MATRIX)
    with panels(n * (1 + len(rows)), n_columns, sharey="row") as (figure, axes):
        for ax, bars in zip(axes, histograms, strict=False):
            _draw_histogram(ax, bars, table)
            label = schema[bars.variable].heading
            if rows:  # the planes below have the name
                label = ""
            name_axis(ax, "x", label, bars.values)
            if rows and not bars.values:  # options have an interval each, and are aligned
                ax.set_xlim(points.columns[bars.variable].ends)
        for ax in axes[:n:n_columns]:
            name_axis(ax, "y", "% of each group")
        for ax, (objective, variable) in zip(axes[n:], product(rows, tops), strict=True):
            points.draw(ax, variable, objective)
            ax.label_outer()
        legend_of(figure, axes)
        sentences = ["Histograms: the share of each group in each interval."]
        if rows:
            sentences.append("Below, objectives against variables.")
        figure.describe(title, *sentences, points.counts(table), _outside(histograms))
    return figure


def _column_names(argument: str, names: Names | None, default: Names, schema: Schema) -> list[str]:
    """Return the names of columns of a table, by default those given."""
    if names is None:
        names = default
    return [known_name(argument, name, schema.names) for name in names]


def _draw_histogram(axes: Axes, bars: Histogram, table: TestTable) -> None:
    """Draw the share of each group in each interval."""
    if table.schema[bars.variable].kind is Kind.LOG:
        axes.set_xscale("log")
    groups = {
        "all": (bars.tested, len(table)),
        "feasible": (bars.feasible, table.feasible().sum()),
        PARETO: (bars.pareto, table.pareto().sum()),
    }
    if bars.variable not in table.schema.variables:
        # The intervals of a dependent column span the feasible designs; others are outside.
        del groups["all"]
    for name, (counts, n) in groups.items():
        label = f"bars: {name} ({n})"
        axes.stairs(100.0 * counts / max(n, 1), bars.edges, label=label, **_STAIRS[name])


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


def plot_objectives(
    table: Any,
    *,
    objectives: Names | None = None,
    design: int | str | None = None,
    title: str = "",
) -> Drawing:
    """Return the objectives against each other, each pair once.

    Args:
        table: A test table, or anything else that :func:`pymoo_psi.read_table` opens, such as a
            data frame or a result of pymoo.
        objectives: Names of two to seven objectives or other columns; all objectives by default.
        design: Number or label of a design to be marked, such as the chosen one.
        title: Subject of the table, with which the caption begins.

    Raises:
        ArgumentValueError: A column or the design is not in the table, or there are too few or too
            many objectives.
        ArgumentTypeError: ``table`` is none, and cannot be read as one.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        >>> sum(ax.axison for ax in plot_objectives(table).axes)
        3
    """
    table = opened_table(table)
    schema = table.schema
    names = _column_names("objectives", objectives, schema.objectives, schema)
    if not 2 <= len(names) <= MATRIX + 1:
        rule = f"from 2 to {MATRIX + 1} to draw in pairs"
        raise invalid("objectives", rule, len(names), "name those to be drawn")
    chosen = None
    if design is not None:
        chosen = table.row_of(design)
    points = points_of_table(table, names, chosen)
    n = len(names) - 1
    with new_figure(28.0 + n * row_height(n)) as figure:
        for ax, first, second in _planes(figure, n):
            points.draw(ax, names[first], names[second])
            ax.label_outer()
        legend_of(figure, figure.axes)
        figure.describe(title, "Objectives in pairs.", points.counts(table))
    return figure


def _planes(figure: Drawing, n: int) -> Iterator[tuple[Axes, int, int]]:
    """Yield axes for each pair of ``n + 1`` columns, and the places of the two."""
    grid = figure.add_gridspec(n, n)
    for second in range(1, n + 1):
        for first in range(second):
            yield figure.add_subplot(grid[second - 1, first]), first, second


# Parallel coordinates


def plot_ranking(
    ranking: Any,
    *,
    units: Mapping[Any, str] | None = None,
    title: str = "",
    row: int | None = None,
) -> Drawing:
    """Return the Pareto-optimal designs of a ranking as parallel coordinates.

    Each design is a line, darker for places 2 to 10. The best value of each objective in the Pareto
    set, or of its fixed range, is at 0, the worst at 1. :func:`plot_objectives` draws
    the objectives of a table in pairs.

    Args:
        ranking: A ranking, or anything that :func:`pymoo_psi.rank_of_efficiency` ranks: an array of
            objectives, a data frame, a test table, a result of pymoo.
        units: Units of objectives by name, those of a table by default.
        title: Subject of the ranking, with which the caption begins.
        row: Row of a design whose line is marked, such as the chosen one.

    Raises:
        ArgumentTypeError: ``ranking`` is none, and cannot be ranked.

    Example:
        >>> figure = plot_ranking([[1, 5], [2, 2], [5, 1]])
        >>> [ax.get_ylabel() for ax in figure.axes]
        ['share of the range (0 is best)']
    """
    ranking = rank_of_efficiency(ranking)
    objectives = with_units(ranking, units).objectives
    frame = ranking.frame
    shares = (objectives.minimized - frame.ideal) / ranking.lengths
    measure = "fixed range" if frame.is_fixed else "range"
    names = [literal(name, 30) for name in objectives.headings()]
    height = 60.0
    if len(names) > MATRIX:
        height = 90.0
    with panels(1, 1, height=height) as (figure, (ax,)):
        for name, (marker, mask) in groups_by_place(ranking).items():
            if mask.any():
                lines = _lines(shares[mask], marker)
                lines.set_label(f"{name} ({mask.sum()})")
                ax.add_collection(lines)
        if row is not None:
            label = literal(ranking.name_of(row))
            ax.plot(shares[row], "ko--", markersize=4.0, linewidth=2.0, zorder=7.0, label=label)
        top = max(1.05, shares[ranking.pareto].max() + 0.05)  # beyond fixed ranges, too
        ax.set(ylim=(-0.05, top), ylabel=f"share of the {measure} (0 is best)")
        _name_objectives(ax, names, ranking.ideal, ranking.nadir)
        legend_of(figure, [ax])
        optimal = counted(ranking.pareto.sum(), "Pareto-optimal design")
        figure.describe(
            title,
            f"{optimal} of {len(ranking.place)}.",
            "Each is a line; where many overlap, it is darker. The best values are at 0, the worst "
            "at 1.",
        )
    return figure


def _lines(shares: Array, marker: Marker) -> LineCollection:
    """Return a line for each of ``(n, m)`` designs of a group, the fainter the more there are."""
    n = len(shares)
    width = 1.0
    if n > _MANY:
        width = 0.4
    if marker is OPTIMUM:
        width = 2.0
    places = np.broadcast_to(np.arange(shares.shape[1]), shares.shape)
    return LineCollection(
        list(np.dstack([places, shares])),
        colors=marker.colour,
        linewidths=width,
        alpha=min(1.0, max(_FAINTEST, _MANY / n)),
        zorder=marker.level,
        rasterized=n > _MANY,
    )


def _name_objectives(axes: Axes, names: list[str], best: Array, worst: Array) -> None:
    """Write names and best values below parallel coordinates, the worst values on top, or at 1."""
    places = np.arange(len(names))
    rotation = 0
    if len("".join(names)) + 2 * len(names) > _LETTERS:
        rotation = 90
    below = [f"{number(value)}\n{name}" for value, name in zip(best, names, strict=True)]
    axes.set_xticks(places, below, rotation=rotation)
    low, high = axes.get_ylim()
    level = (1 - low) / (high - low)
    if high <= 1.05:
        level = 1.0
    axes.secondary_xaxis(level).set_xticks(places, [number(value) for value in worst])
    axes.set_xlim(-0.4, len(names) - 0.6)


# Sensitivities


def plot_sensitivities(sensitivities: pd.DataFrame, *, title: str = "") -> Drawing:
    """Return bars of the first-order sensitivities with their bands, one panel for each column.

    Args:
        sensitivities: From :func:`pymoo_psi.analysis.sensitivities`.
        title: Subject of the tests, with which the caption begins.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> from pymoo_psi.analysis import sensitivities
        >>> table = investigate(VectorizedSphereChute(0.4), 256)
        >>> figure = plot_sensitivities(sensitivities(table, ["f1", "f2"]))
        >>> [ax.get_title() for ax in figure.axes]
        ['f1', 'f2']
    """
    index = sensitivities.index
    columns = index.unique("column").tolist()
    variables = index.unique("variable").tolist()
    n_columns = min(_PANELS, len(columns))
    height = 16 + 5.0 * len(variables)
    n = len(columns)
    with panels(n, n_columns, head=22, height=height, sharey="row") as (figure, axes):
        for ax, column in zip(axes, columns, strict=True):
            # A sensitivity is between 0 and 1; its estimate need not be.
            estimates = sensitivities.loc[column].loc[variables].clip(0, 1)
            _draw_sensitivities(ax, estimates)
            name = literal(column, 24)
            if estimates["first_order"].isna().all():
                name += ": constant"
            ax.set_title(name)
        figure.describe(
            title,
            "First-order sensitivities: the share of a column's variance that each variable "
            "explains alone, with 95 % bands. The rest of the variance is interaction.",
        )
    return figure


def _draw_sensitivities(ax: Axes, estimates: pd.DataFrame) -> None:
    """Draw a bar and its band for each variable, from top to bottom."""
    places = np.arange(len(estimates))
    ax.barh(places, estimates["first_order"], 0.62, color="#0072B2", linewidth=0)
    ax.hlines(places, estimates["lower"], estimates["upper"], color="black", linewidth=0.9)
    ax.set(xlim=(0, 1), xlabel="share of the variance", ylim=(len(places) - 0.4, -0.6))
    ax.set_yticks(places, [literal(name, 32) for name in estimates.index])
    ax.grid(visible=False, axis="y")


def plot_sections(sections: pd.DataFrame, *, title: str = "") -> Drawing:
    """Return the sections through a design: a row of panels for each column, one for each variable.

    Args:
        sections: From :func:`pymoo_psi.algorithms.sections`, whose ``attrs`` have the units.
        title: Subject of the tests, with which the caption begins.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> from pymoo_psi.algorithms import sections
        >>> figure = plot_sections(sections(investigate(VectorizedSphereChute(0.4), 64)))
        >>> len(figure.axes)
        8
    """
    n_columns = min(sections["variable"].nunique(), _PANELS + 1)
    lines: list[Any] = list(sections.groupby(["column", "variable"], sort=False))
    units = sections.attrs.get("units", {})
    with panels(len(lines), n_columns, head=22, height=38.0) as (figure, axes):
        firsts: dict[Any, Axes] = {}
        for ax, ((column, variable), line) in zip(axes, lines, strict=True):
            # The same axis for all variables, so that slopes can be compared.
            ax.sharey(firsts.setdefault(column, ax))
            options = _draw_section(ax, line)
            name_axis(ax, "x", with_unit(variable, units.get(variable, "")), options)
            name_axis(ax, "y", with_unit(column, units.get(column, "")))
        figure.describe(
            title,
            "Sections through a design (dashed): what surrogates of the tests expect where one "
            "variable changes, with a band of two standard deviations. Nothing was evaluated.",
        )
    return figure


def _draw_section(ax: Axes, line: pd.DataFrame) -> list[object]:
    """Draw an expected curve and its band; of options, points with bars; return the options."""
    values = line["value"].tolist()
    design = line["design"].iloc[0]
    options: list[object] = []
    if not all(isinstance(value, (int, float)) for value in values):
        options = values
        design = values.index(design)
        values = list(range(len(values)))
    expected, low, high = line[["expected", "low", "high"]].to_numpy(float).T
    if options or len(values) < 3:
        ax.vlines(values, low, high, color=BLUE, linewidth=3, alpha=0.4)
        ax.plot(values, expected, "o", color=BLUE, markersize=3)
    else:
        ax.fill_between(values, low, high, color=BLUE, alpha=0.2, linewidth=0)
        ax.plot(values, expected, color=BLUE)
    ax.axvline(design, color="black", linewidth=0.8, linestyle="--")
    return options


# Comparisons of algorithms


def plot_indicators(comparison: Comparison) -> Drawing:
    """Return the four indicators against evaluations, with medians as lines, quartiles as bands.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> [ax.get_ylabel().split()[0] for ax in plot_indicators(comparison).axes]
        ['hypervolume', 'IGD+', 'additive', 'optimum']
    """
    with panels(4, 2, height=61.0) as (figure, axes):
        for ax, indicator in zip(axes, _INDICATORS, strict=True):
            plot_indicator(comparison, indicator, ax)
        legend_of(figure, axes, 4)
        n_seeds = comparison.measures["seed"].dropna().nunique()
        seeds = counted(max(n_seeds, 1), "seed")
        budgets = ", ".join(map(str, comparison.evaluations))
        figure.describe(
            f"{comparison.problem}: quality against evaluations, medians and quartiles",
            f"{budgets} evaluations, {seeds}.",
        )
    return figure


def plot_fronts(comparison: Comparison) -> Drawing:
    """Return the fronts that the algorithms found with the most evaluations, objectives in pairs.

    Of several seeds the first is drawn, of many objectives the first seven.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> from pymoo_psi.plots import plot_fronts
        >>> comparison = compare(get_problem("bnh"), n_evaluations=32, algorithms=["psi", "nsga3"])
        >>> len(plot_fronts(comparison).axes)
        1
    """
    most = comparison.evaluations[-1]
    fronts: dict[str, Array] = {}
    for run in comparison.runs:
        if run.task.n_evaluations == most:
            fronts.setdefault(run.task.algorithm, run.F)
    n = min(MATRIX, comparison.runs[0].F.shape[1] - 1)
    with new_figure(28.0 + n * row_height(n)) as figure:
        for ax, first, second in _planes(figure, n):
            for (name, F), style in zip(fronts.items(), curves(), strict=False):
                style |= {"linestyle": "none", "markersize": 3.0, "markerfacecolor": "none"}
                label = f"{literal(name, 30)} ({len(F)})"
                ax.plot(F[:, first], F[:, second], label=label, **style)
            name_axis(ax, "x", f"f{first + 1}")
            name_axis(ax, "y", f"f{second + 1}")
            ax.label_outer()
        legend_of(figure, figure.axes)
        figure.describe(
            f"{comparison.problem}: fronts of the algorithms, objectives in pairs, minimised",
            f"{most} evaluations, the first seed.",
        )
    return figure


def plot_indicator(comparison: Comparison, indicator: str, ax: Axes) -> None:
    """Draw the medians of an indicator as lines and the quartiles as bands.

    Infinite values are left out, and a line above the axes says so.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.
        ax: Axes to draw on.
    """
    frame = comparison.summary().set_index("algorithm")
    columns = [indicator, f"{indicator}_q1", f"{indicator}_q3"]
    values = frame[columns].to_numpy(float)
    finite = values[np.isfinite(values)]
    ax.set_xscale("log")
    if indicator != "hypervolume" and len(finite) and (finite > 0).all():
        ax.set_yscale("log")
    for name, style in zip(comparison.algorithms, curves(), strict=False):
        rows = frame.loc[[name]]
        median, lower, upper = rows[columns].replace(np.inf, np.nan).to_numpy(float).T
        x = rows["evaluations"].to_numpy(float)
        ax.fill_between(x, lower, upper, color=style["color"], alpha=0.18, linewidth=0)
        ax.plot(x, median, markersize=4.0, linewidth=0.9, label=literal(name, 30), **style)
    ax.set_xticks(comparison.evaluations, [str(n) for n in comparison.evaluations])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.margins(x=0.1)
    ax.set(xlabel="evaluations", ylabel=_INDICATORS[indicator])
    if len(finite) < values.size:
        ax.set_title("infinite values are not drawn", loc="right", fontsize=7)
