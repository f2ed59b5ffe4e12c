"""Figures of test tables, rankings, sensitivities, fits to measurements and comparisons.

Values are in the original units and direction. A constraint or an output may take the place of an
objective.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, combinations, pairwise, product
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import PowerNorm
from matplotlib.patheffects import withStroke
from matplotlib.ticker import NullLocator
from numpy.typing import ArrayLike

from pymoo_psi._numbers import NumberFormat, needs_logarithms
from pymoo_psi._output import with_unit
from pymoo_psi._validation import (
    Array,
    Integers,
    Mask,
    Names,
    counted,
    invalid,
    known_names,
)
from pymoo_psi.analysis import Histogram, histogram, within_limits
from pymoo_psi.pareto import (
    EfficiencyRanking,
    conflicting_pairs,
    rank_of_efficiency,
    ranked_row,
    with_units,
)
from pymoo_psi.plots._points import NAMED, PARETO, opened_table, points_of_table
from pymoo_psi.plots._style import (
    ABOVE,
    ACCENT,
    BESIDE,
    INK,
    NARROW,
    NOTE,
    WIDTH,
    Drawing,
    Style,
    add_key,
    add_list,
    curves,
    extent,
    head_axes,
    height_of_key,
    literal,
    name_axis,
    name_lines,
    new_figure,
    panels,
    raised,
    set_log,
    stack_pairs,
)
from pymoo_psi.table import Schema, TestTable

if TYPE_CHECKING:  # figures of tables need neither of these, nor pymoo and SciPy
    from pymoo_psi.comparison import Comparison

MATRIX = 6  # variables, or objectives, beside which the text on the axes is still readable
_PANELS = 3  # panels side by side


# Histograms, and objectives against variables

# How the stairs of a histogram are drawn.
_TESTED: Style = {"fill": True, "color": "0.9"}
_WITHIN: Style = {"fill": True, "color": "0.7"}
_OPTIMAL: Style = {"edgecolor": ACCENT, "linewidth": 1.2}


def plot_table(
    table: Any,
    *,
    variables: Names | None = None,
    objectives: Names | None = None,
    title: str = "",
    width: float = WIDTH,
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
        width: Width in mm, such as 90 and 180 for one and two columns of a journal.

    Raises:
        ArgumentValueError: A column is not in the table or a note, or the width is none of 10 to
            1000 mm.
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
    if not tops:  # designs without variables
        tops, rows = rows, []
    if max(len(tops), len(rows)) > MATRIX:
        rows = []
    histograms = [histogram(table, name) for name in tops]
    points = points_of_table(table, [*tops, *rows] if rows else [])
    n = len(tops)
    n_columns = min(n, MATRIX)
    with panels(n * (1 + len(rows)), n_columns, width=width, sharey="row") as (figure, axes):
        figure.decimal = table.decimal
        for ax, bars in zip(axes, histograms, strict=False):
            _draw_histogram(ax, bars, table)
            label = ""
            # The planes below have the name, unless outliers make their scale another one.
            if not rows or bars.logarithmic != points.columns[bars.variable].log:
                label = with_unit(bars.variable, schema[bars.variable].unit)
                if bars.logarithmic:
                    label += ", log"
            elif not bars.values:  # options have an interval each, and are aligned
                ax.set_xlim(points.columns[bars.variable].ends)
            figure.fit(name_axis, ax, "x", label, bars.values)
        for ax in axes[:n:n_columns]:
            figure.fit(name_axis, ax, "y", "share [%]")
        for ax, (objective, variable) in zip(axes[n:], product(rows, tops), strict=True):
            points.draw(ax, variable, objective)
            figure.fit(ax.label_outer)
        figure.fit(add_key, figure, axes)
        figure.is_divisible = not rows
        histogram_words = "Histograms: the share of each group in each interval."
        below = "Below, objectives against variables." if rows else ""
        figure.describe(title, histogram_words, below, points.counts(table), _outside(histograms))
    return figure


def _column_names(argument: str, names: Names | None, default: Names, schema: Schema) -> list[str]:
    """Return the names of columns of a table, by default those given."""
    if names is None:
        names = default
    return known_names(argument, names, schema.values)


def _draw_histogram(axes: Axes, bars: Histogram, table: TestTable) -> None:
    """Draw the share of each group in each interval."""
    if bars.logarithmic:
        set_log(axes, "x", table.decimal)
    feasible = table.feasible()
    words = within_limits(table).strip() or "not failed"
    tested = (len(table), "in all", bars.tested, _TESTED)
    within = (feasible.sum(), words, bars.feasible, _WITHIN)
    optimal = (table.pareto()[table.ranked_as].sum(), PARETO, bars.pareto, _OPTIMAL)
    groups = [tested, within, optimal]
    if feasible.all():
        groups = [tested, optimal]
    elif bars.variable not in table.schema.variables:
        groups = [within, optimal]  # the intervals span the feasible designs; others are outside
    for n, name, counts, style in groups:
        axes.stairs(100.0 * counts / max(n, 1), bars.edges, label=f"{n} {name}", **style)


def _outside(histograms: Sequence[Histogram]) -> str:
    """Return a sentence on values outside the histograms; empty if there are none."""
    outside = [bars for bars in histograms if any(bars.outside)]
    parts = [f"{counted(sum(bars.outside), 'value')} of {bars.variable}" for bars in outside]
    if not parts:
        return ""
    return f"Outside the histograms: {', '.join(parts)}."


# Objectives in pairs

_PAIRS = 4  # pairs of objectives, in two columns


def plot_objectives(
    table: Any,
    *,
    objectives: Names | None = None,
    design: int | str | None = None,
    title: str = "",
    width: float = WIDTH,
) -> Drawing:
    """Return objectives against each other, in pairs.

    By default these are the pairs that conflict most, four at most; of objectives that are named
    they are all pairs. The key names the proposed or marked design. Of eight Pareto-optimal designs
    and fewer each has its name beside it, or at the end of a line, where there is room, else its
    place in the ranking; the names are below the panels. The line is a staircase: it joins what
    designs reach in the two objectives, and there is no design between two of them. It has a single
    corner where one design is the best in both.

    Args:
        table: A test table, or anything else that :func:`pymoo_psi.read_table` opens, such as a
            data frame or a result of pymoo.
        objectives: Names of two to seven objectives or other columns.
        design: Number or label of a design to be marked, such as the chosen one; the proposed one
            by default.
        title: Subject of the table, with which the caption begins.
        width: Width in mm, such as 90 and 180 for one and two columns of a journal.

    Raises:
        ArgumentValueError: A column or the design is not in the table, a column is a note, there
            are too few or too many objectives, or the width is none of 10 to 1000 mm.
        ArgumentTypeError: ``table`` is none, and cannot be read as one.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        >>> len(plot_objectives(table).axes)
        3
    """
    table = opened_table(table)
    schema = table.schema
    names = _column_names("objectives", objectives, schema.objectives, schema)
    if len(names) < 2 or (objectives is not None and len(names) > MATRIX + 1):
        rule = f"from 2 to {MATRIX + 1} to draw in pairs"
        raise invalid("objectives", rule, len(names), "name those to be drawn")
    marked = []
    if design is not None:
        marked = [table.row_of(design)]
    pairs = list(combinations(names, 2))
    n_pairs = len(pairs)
    if objectives is None:
        conflicts = sorted(conflicting_pairs(table.F[table.pareto()])[:_PAIRS])
        pairs = [(names[j], names[k]) for j, k in conflicts]
    points = points_of_table(table, [*dict.fromkeys(chain(*pairs))], marked)
    n_columns = min(len(pairs), _PANELS)
    if len(pairs) == _PAIRS:
        n_columns = 2
    with panels(len(pairs), n_columns, width=width) as (figure, axes):
        figure.decimal = table.decimal
        figure.is_divisible = True
        for ax, (first, second) in zip(axes, pairs, strict=True):
            points.draw(ax, first, second, is_detailed=True)
        heading = ""
        sentence = ""
        if len(pairs) < n_pairs:
            heading = f"{len(pairs)} of {n_pairs} pairs of objectives: those that conflict most"
            sentence = f"{heading}."
        listed = [text for text, *places in points.named.values() if places]
        figure.fit(add_key, figure, axes, heading)
        figure.fit(add_list, figure, listed)
        figure.fit(stack_pairs, figure)
        figure.describe(title, sentence, points.counts(table))
    return figure


# Parallel coordinates

_DARK_PLACES = 10  # places up to which lines are darker
_FEW_PLACES = 3  # the same of few lines or in a narrow figure, and of many the places with names
_MOST_LINES = 500  # more fainter lines than these are drawn as their density
_SOLID_LINES = 15  # more lines than these are fainter, so that their density shows
_SHADES = ("0.25", "0.65")  # of the darker and the fainter lines
# The line of the marked design in parallel coordinates, and of the optimum, if it is another.
_MARKED_STYLE: Style = {
    "path_effects": [withStroke(linewidth=3.2, foreground="white")],
    "color": ACCENT,
    "linewidth": 2.0,
    "linestyle": "-",
    "markersize": 5.5,
}
_PROPOSED_STYLE: Style = {"color": INK, "linewidth": 1.2, "linestyle": "--", "markersize": 5.5}
_WORST_PLACE = -0.5  # place up to which an axis reaches for a marked design
_ROW_HEIGHT = 9.5  # mm
_LOW_ROW_HEIGHT = 7.0  # mm, of more rows than _HIGH_ROWS
_HIGH_ROWS = 12
_HEAD_HEIGHT = 10.2  # mm above the first row
_PADS_HEIGHT = 4.0  # mm above and below the axes
_LETTERS = 26  # letters of the name of a row or a line


def plot_ranking(
    ranking: Any,
    *,
    units: Mapping[Any, str] | None = None,
    title: str = "",
    row: int | None = None,
    values: bool = True,
    width: float = WIDTH,
) -> Drawing:
    """Return the Pareto-optimal designs of a ranking as parallel coordinates.

    An objective is a row, from its worst value on the left to its best on the right, those of the
    Pareto set or of the fixed range. It is logarithmic if most values over two decades or more
    would be in the first tenth of a straight row. Each design is a line, with its place and name at
    the end where there is room. Of more than eight designs only the first three have names, and the
    first ten darker lines, or three in a width of less than 120 mm; of more than 500 others the
    density of their lines is drawn.
    :func:`plot_objectives` draws the objectives of a table in pairs.

    Args:
        ranking: A ranking, or anything that :func:`pymoo_psi.rank_of_efficiency` ranks: an array of
            objectives, a data frame, a test table, a result of pymoo.
        units: Units of objectives by name, those of a table by default.
        title: Subject of the ranking, with which the caption begins.
        row: Row of the design in what is ranked that is marked, such as the chosen one; the
            optimum by default.
        values: Whether the values of the marked design are beside it.
        width: Width in mm, such as 90 and 180 for one and two columns of a journal.

    Raises:
        ArgumentTypeError: ``ranking`` is none, and cannot be ranked.
        ArgumentValueError: There is no such row, or a test there is not feasible; the width is none
            of 10 to 1000 mm.

    Example:
        >>> figure = plot_ranking([[1, 5], [2, 2], [5, 1]])
        >>> [text.get_text() for text in figure.axes[0].texts[4:8]]
        ['f1', '5', '1', '2']
    """
    source = ranking
    ranking = with_units(rank_of_efficiency(source), units)
    best = int(ranking.salukvadze[0])
    marked = best
    if row is not None:
        marked = ranked_row("row", row, source, ranking)
    marks = {marked: ("marked", _MARKED_STYLE), best: ("proposed", _PROPOSED_STYLE)}
    if marked == best:
        marks = {best: ("proposed", _MARKED_STYLE)}
    front = ranking.by_place[: ranking.pareto.sum()]
    n_named = _FEW_PLACES
    n_near = _DARK_PLACES
    if len(front) <= NAMED:
        n_named = NAMED
    if len(front) <= NAMED or width < NARROW:
        n_near = _FEW_PLACES
    named = [*dict.fromkeys([*marks, *front[:n_named].tolist()])]
    columns = enumerate(ranking.objectives.values.T)
    rows, is_log = zip(*(places_in_row(ranking, j, values) for j, values in columns), strict=True)
    # What is better than a fixed range counts as its best end.
    places = np.minimum(np.column_stack(rows), 1.0)
    # Rows reach beyond the range for designs worse than a fixed one, and for a marked design; but a
    # far worse one has an arrow at the edge, as the others need the room.
    edge = min(0.0, places[front].min(), max(_WORST_PLACE, places[[*marks]].min()))
    n = len(ranking.objectives.names)
    with new_figure(60 + n * _ROW_HEIGHT, width) as figure:  # its height follows from the names
        ax = figure.add_subplot()
        ax.set(xlim=(edge, 1))
        ax.axis("off")
        word = marks[marked][0] if values else ""
        _draw_rows(ax, ranking, is_log, marked, word)
        for design, (label, style) in marks.items():
            _draw_mark(ax, places[design], edge, label, style)
        _draw_lines(ax, ranking, places, n_near, [*marks])
        if np.any(ranking.place[front] > n_near):
            figure.fit(add_key, figure, [ax])
        names = _add_names(ax, ranking, named, n_near, marks)
        figure.fit(_name_lines, figure, ax, names, np.maximum(places[named, -1], edge), n)
        arrows = ""
        if np.any(places[[*marks]] < edge):
            arrows = "An arrow marks a value worse than its axis shows."
        figure.describe(title, *_ranking_in_words(ranking, is_log), arrows)
    return figure


def _ranking_in_words(ranking: EfficiencyRanking, is_log: Sequence[bool]) -> Iterator[str]:
    """Yield the sentences of a caption, given which axes are logarithmic."""
    measure = "from the worst to the best of them"
    if ranking.frame.is_fixed:
        measure = "in the fixed range"
    designs = counted(ranking.pareto.sum(), "design")
    yield f"The {designs} that no other dominates: values {measure}."
    if any(is_log):
        yield "Designs are ranked by values, not by their logarithms."


def places_in_row(
    ranking: EfficiencyRanking, objective: int, values: ArrayLike
) -> tuple[Array, bool]:
    """Return where values are in the row of an objective, and whether the row is logarithmic.

    Args:
        ranking: The ranking.
        objective: Index of the objective.
        values: ``(n,)`` values of it.

    Returns:
        ``(n,)`` places, 0 for the worst value of the range and 1 for the best, and whether the row
        is logarithmic. Worse values are below 0, infinitely far if the range is a single value.

    Example:
        >>> places_in_row(rank_of_efficiency([[4, 1], [2, 3]]), 0, [2, 3, 5])
        (array([ 1. ,  0.5, -0.5]), False)
    """
    objectives = ranking.objectives
    points = np.asarray(values, dtype=float)
    ends = np.array([ranking.nadir[objective], ranking.ideal[objective]])
    front = objectives.values[ranking.pareto, objective]
    is_log = needs_logarithms([*ends, *front.clip(ends.min(), ends.max())])
    if is_log:
        points = np.log(np.maximum(points, np.finfo(float).tiny))
        ends = np.log(ends)
    worst, best = ends
    if worst == best:
        is_worse = objectives.sign[objective] * (points - best) > 0
        return np.where(is_worse, -np.inf, 1.0), is_log
    return (points - worst) / (best - worst), is_log


_HEAD_LIFT = 16.0  # points from the first row to the head
_ROW_LIFT = -5.0  # points from a row to the lower line beside it
_LINE_HEIGHT = 9.5  # points from a line of text to the one above
_TEXT_GAP = 8.0  # points from the axes to texts
_BESIDE_AXES = ("axes fraction", "data")  # coordinates of the names of rows
_GROUND: Style = {"facecolor": "white", "linewidth": 0, "pad": 0}  # of a text over lines
# A text beside a row.
_BESIDE_ROW: Style = BESIDE | {"color": "0.3", "va": "center", "ha": "right", "fontsize": 7}


def _draw_rows(
    ax: Axes, ranking: EfficiencyRanking, is_log: Sequence[bool], row: int, word: str
) -> None:
    """Draw a row for each objective, with its worst and best value and that of a design.

    Args:
        ax: The axes.
        ranking: The ranking.
        is_log: ``(m,)`` which rows are logarithmic.
        row: Row of the design.
        word: What stands above its values; empty if they are not written.
    """
    objectives = ranking.objectives
    _write_row(ax, 0, _HEAD_LIFT, ("", "worst", "best", word))
    for j, (name, column) in enumerate(zip(objectives.names, objectives.values.T, strict=True)):
        ends = (ranking.nadir[j], ranking.ideal[j])
        heading = literal(with_unit(str(name), objectives.units.get(name, "")), _LETTERS)
        ax.axhline(j, color="0.8", linewidth=0.6, zorder=0)
        if is_log[j]:
            heading += ", log"
        front = column[ranking.pareto]
        written = NumberFormat.of(np.append(front, ends), front, objectives.decimal).text
        worst, best, value = [raised(written(value)) for value in (*ends, column[row])]
        if not word:
            value = ""
        _write_row(ax, j, _ROW_LIFT, (heading, worst, best, value))
    ax.annotate("better →", (0.5, 0), (0, _HEAD_LIFT), **_BESIDE_ROW | {"ha": "center"})
    if ax.get_xlim()[0] < 0:  # where the range begins
        ax.vlines(0, 0, len(is_log) - 1, color="0.8", linewidth=0.6, zorder=0)


def _write_row(ax: Axes, row: int, lift: float, texts: tuple[str, str, str, str]) -> None:
    """Write texts in two lines beside a row.

    Args:
        ax: The axes.
        row: The row.
        lift: From the row up to the lower line in points.
        texts: What stands on the left, above and below; what on the right, below and above.
    """
    above = lift + _LINE_HEIGHT
    corners: list[tuple[int, float, Style]] = [
        (0, above, {"fontweight": "bold", "color": INK, "xycoords": _BESIDE_AXES}),
        (0, lift, {"bbox": _GROUND}),  # lines may reach beyond a fixed range
        (1, lift, {"ha": "left"}),
        (1, above, {"ha": "left", "fontweight": "bold", "color": ACCENT}),
    ]
    for text, (end, height, style) in zip(texts, corners, strict=True):
        aside = _TEXT_GAP * (2 * end - 1)
        ax.annotate(text, (end, row), (aside, height), **_BESIDE_ROW | style)


def _draw_mark(ax: Axes, places: Array, edge: float, label: str, style: Style) -> None:
    """Draw the line of a marked design, with an arrow in each row where it is beyond the edge.

    Args:
        ax: The axes.
        places: ``(m,)`` where the design is in each row.
        edge: The worst place that the axes show.
        label: Its label in the key.
        style: How the line is drawn.
    """
    ax.plot(np.maximum(places, edge), range(len(places)), "o", zorder=5, clip_on=False, **style)
    ax.plot([], [], style["linestyle"], color=style["color"], label=label)
    for j in np.flatnonzero(places < edge):
        ax.plot(edge, j, "<", color=style["color"], markersize=9, zorder=6, clip_on=False)


def _draw_lines(
    ax: Axes, ranking: EfficiencyRanking, places: Array, n_near: int, marked: Sequence[int]
) -> None:
    """Draw a line for each Pareto-optimal design, the fainter the more there are.

    Args:
        ax: The axes.
        ranking: The ranking.
        places: ``(n, m)`` where its designs are in each row.
        n_near: The last place with a darker line.
        marked: Designs with marks of their own, which the key does not count again.
    """
    front = ranking.by_place[: ranking.pareto.sum()][::-1]  # the best on top
    is_near = ranking.place[front] <= n_near
    label = _places_in_words(ranking.place[front[is_near & ~np.isin(front, marked)]])
    places = places[front]
    n, m = places.shape
    lines = np.dstack([places, np.broadcast_to(np.arange(m), (n, m))])
    n_others = np.sum(~is_near)
    others = f"{n_others} more not dominated"
    dark, faint = _SHADES
    groups: list[tuple[Mask, str, Style]] = [
        (is_near, label, {"color": dark, "linewidth": 0.8, "zorder": 2.1})
    ]
    if 0 < n_others <= _MOST_LINES:
        style: Style = {"color": faint, "linewidth": 0.5, "alpha": min(1.0, _SOLID_LINES / n)}
        groups.append((~is_near, others, style))
    for rows, text, style in groups:
        group = LineCollection(
            list(lines[rows]), rasterized=n > _SOLID_LINES, clip_on=False, **style
        )
        group.set_in_layout(False)
        ax.add_collection(group)
        ax.plot([], [], color=style["color"], label=text)
        if n <= NAMED:
            dots: Style = {"markersize": 2.8, "color": style["color"], "clip_on": False}
            ax.plot(places[rows].T, range(m), "o", **dots)
    if n_others > _MOST_LINES:
        _draw_density(ax, places[~is_near])
        ax.plot([], [], "s", color=faint, label=f"{others}, as a density")


def _places_in_words(places: Integers) -> str:
    """Return places as a text; empty if there are none."""
    if len(places) == 0:
        return ""
    if places.min() == places.max():
        return f"place {places.min()}"
    return f"places {places.min()} to {places.max()}"


_DENSITY_ROWS = 40  # levels between two rows, at each of which lines are counted
_DENSITY_COLUMNS = 60  # intervals along a row
_DENSEST = 0.98  # quantile of the counts from which on the density is equally dark
_BLACK_AT = 3.5  # at so many times this count it would be black


def _draw_density(ax: Axes, places: Array) -> None:
    """Draw how many of ``(n, m)`` designs have their line where, the darker the more."""
    m = places.shape[1]
    margin = 2 / _DENSITY_COLUMNS
    ends = (min(0.0, places.min()) - margin, 1.0 + margin)
    counts = []
    for above, below in pairwise(places.T):
        for share in (np.arange(_DENSITY_ROWS) + 0.5) / _DENSITY_ROWS:
            across = (1 - share) * above + share * below
            counts.append(np.histogram(across, _DENSITY_COLUMNS, ends)[0])
    dense = np.quantile(counts, _DENSEST)
    ax.imshow(
        np.minimum(counts, dense),
        cmap="Greys",
        norm=PowerNorm(0.5, 0, _BLACK_AT * dense),
        extent=(*ends, m - 1, 0),
        aspect="auto",
        interpolation="gaussian",
        clip_on=False,
        zorder=-1,
    )


_TO_NEAREST_NAME = 5.2  # mm from the last row to the nearest name
_TO_NEXT_NAME = 3.3  # mm from one name to the next
_POLE_GAP = 3.0  # points from a pole to its name
# A name beside a line.
_FLAG_STYLE: Style = {"va": "center", "ha": "center", "in_layout": False}


def _add_names(
    ax: Axes,
    ranking: EfficiencyRanking,
    designs: Sequence[int],
    n_near: int,
    marks: Mapping[int, tuple[str, Style]],
) -> list[tuple[Any, Any]]:
    """Return the names of lines and the poles on which they stand, to be placed later."""
    names = []
    for design in designs:
        place = ranking.place[design]
        text = literal(ranking.name_of(design), _LETTERS)
        if ranking.pareto[design]:
            text = f"{place}. {text}"
        else:
            text += ", dominated"
        looks: Style = {"color": "0.2" if place <= n_near else "0.45"}
        if design in marks:
            looks = {"color": marks[design][1]["color"], "fontweight": "bold"}
        name = ax.annotate(text, (0, 0), (0, 0), fontsize=7, **BESIDE | looks | _FLAG_STYLE)
        (pole,) = ax.plot([], [], color=looks["color"], linewidth=0.5, clip_on=False)
        names.append((name, pole))
    return names


def _name_lines(
    figure: Drawing, ax: Axes, names: Sequence[tuple[Any, Any]], places: Array, n: int
) -> None:
    """Write names on poles at the ends of their lines, and give the figure its height.

    Args:
        figure: The figure.
        ax: Its axes.
        names: Names and poles; those without room, which are the last, are not shown.
        places: Where the lines end.
        n: Number of rows, below which the names are.
    """
    layout: Any = figure.get_layout_engine()
    layout.execute(figure)
    for artist in chain(*names):
        artist.set_visible(True)  # an invisible name has no size
    begin, end = ax.transData.inverted().transform([[0, 0], figure.bbox.size])[:, 0]
    pads = 2 * _POLE_GAP * figure.dpi / 72
    pixels = np.array([extent(name).width + pads for name, _ in names])
    levels, is_right = _flags(places, pixels * (end - begin) / figure.bbox.width, begin, end)
    for artist in chain(*names[len(levels) :]):
        artist.set_visible(False)
    height = _ROW_HEIGHT
    if n > _HIGH_ROWS:
        height = _LOW_ROW_HEIGHT
    for (name, pole), x, level, right in zip(names, places, levels, is_right, strict=False):
        y = n - 1 + (_TO_NEAREST_NAME + level * _TO_NEXT_NAME) / height
        pole.set_data([x, x], [n - 1, y])
        name.xy = (x, y)
        name.set(ha="left", position=(_POLE_GAP, 0))
        if not right:
            name.set(ha="right", position=(-_POLE_GAP, 0))
    below = _TO_NEAREST_NAME + (levels.max(initial=0) + 1) * _TO_NEXT_NAME
    ax.set_ylim(n - 1 + below / height, -_HEAD_HEIGHT / height)
    total = _HEAD_HEIGHT + (n - 1) * height + below + _PADS_HEIGHT
    figure.set_figheight((total + height_of_key(figure)) / 25.4)


def _flags(places: Array, widths: Array, begin: float, end: float) -> tuple[Array, Mask]:
    """Place names beside poles, none over another name or a pole.

    From the last pole to the first, a name is on the right of its pole if it ends before the figure
    and before each pole whose name is on the left. Without room for all, the last names are left
    out.

    Args:
        places: ``(n,)`` places of the poles.
        widths: ``(n,)`` widths of the names.
        begin: Where names may begin.
        end: Where they may end.

    Returns:
        The level of each name, the nearest 0, and whether it is on the right of its pole, for the
        names that have room.
    """
    is_right = np.full(len(places), True)
    last = end
    order = np.argsort(-places, kind="stable")
    for k in order:
        if places[k] + widths[k] > last:
            is_right[k] = False
            last = places[k]
    lows = np.where(is_right, places, places - widths)
    if np.any(lows < begin):
        return _flags(places[:-1], widths[:-1], begin, end)
    levels = np.full(len(places), -1)
    for k in [*order[is_right[order]], *order[~is_right[order]][::-1]]:
        # A name is below all names over it, and so below the ends of their poles.
        is_beside = (lows < lows[k] + widths[k]) & (lows + widths > lows[k])
        levels[k] = levels[is_beside].max() + 1
    return levels, is_right


# Sensitivities and sections


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
        >>> [ax.get_title(loc="left") for ax in figure.axes]
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
            ax.set_title(name, loc="left")
        figure.supxlabel("share of the variance")  # the label of one panel may be wider than it
        figure.describe(
            title,
            "First-order sensitivities: the share of a column's variance that each variable "
            "explains alone, with 95 % bands. The rest of the variance is interaction.",
        )
    return figure


def _draw_sensitivities(ax: Axes, estimates: pd.DataFrame) -> None:
    """Draw a bar and its band for each variable, from top to bottom."""
    places = np.arange(len(estimates))
    ax.barh(places, estimates["first_order"], 0.62, color=ACCENT, linewidth=0)
    ax.hlines(places, estimates["lower"], estimates["upper"], color="black", linewidth=0.9)
    ax.set(xlim=(0, 1), ylim=(len(places) - 0.4, -0.6))
    ax.set_yticks(places, [literal(name, 32) for name in estimates.index])
    ax.grid(visible=False, axis="y")


def plot_sections(sections: pd.DataFrame, *, title: str = "") -> Drawing:
    """Return the sections through a design: a row of panels for each column, one for each variable.

    Args:
        sections: From :func:`pymoo_psi.algorithms.sections`, whose ``attrs`` have the units and
            the decimal mark.
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
        figure.decimal = sections.attrs.get("decimal", ".")
        firsts: dict[Any, Axes] = {}
        for ax, ((column, variable), line) in zip(axes, lines, strict=True):
            # The same axis for all variables, so that slopes can be compared.
            ax.sharey(firsts.setdefault(column, ax))
            options = _draw_section(ax, line)
            figure.fit(name_axis, ax, "x", with_unit(variable, units.get(variable, "")), options)
            figure.fit(name_axis, ax, "y", with_unit(column, units.get(column, "")))
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
    is_number = [isinstance(value, (int, float)) for value in values]
    if not all(is_number) or isinstance(design, bool):
        options = values
        design = values.index(design)
        values = list(range(len(values)))
    expected, low, high = line[["expected", "lower", "upper"]].to_numpy(float).T
    if options or len(values) < 3:
        ax.vlines(values, low, high, color=ACCENT, linewidth=3, alpha=0.4)
        ax.plot(values, expected, "o", color=ACCENT, markersize=3)
    else:
        ax.fill_between(values, low, high, color=ACCENT, alpha=0.2, linewidth=0)
        ax.plot(values, expected, color=ACCENT)
    ax.axvline(design, color="black", linewidth=0.8, linestyle="--")
    ax.annotate("design", (design, 1), (0, 2), ABOVE, ha="center", va="bottom", **NOTE)
    return options


# Comparisons of algorithms

# Indicators with their labels, whose arrows say where better values are.
_INDICATORS = {
    "hypervolume": "↑ hypervolume of all designs as a share of the box",
    "igd_plus": "↓ IGD+ in units of N − U",
    "epsilon": "↓ additive epsilon in units of N − U",
    "optimum_distance": "↓ optimum distance in units of N − U",
}


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
        >>> [ax.get_ylabel().split()[1] for ax in plot_indicators(comparison).axes]
        ['hypervolume', 'IGD+', 'additive', 'optimum']
    """
    with panels(4, 2, height=61.0) as (figure, axes):
        for ax, indicator in zip(axes, _INDICATORS, strict=True):
            plot_indicator(comparison, indicator, ax)
            name_lines(ax)
        figure.is_divisible = True
        n_seeds = comparison.measures["seed"].dropna().nunique()
        seeds = counted(max(n_seeds, 1), "seed")
        budgets = ", ".join(map(str, comparison.evaluations))
        figure.describe(
            f"{comparison.problem}: quality against evaluations, medians and quartiles",
            f"{budgets} evaluations, {seeds}.",
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
        set_log(ax, "y")
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
    head_axes(ax)
    if len(finite) < values.size:
        ax.set_title("infinite values are not drawn", loc="right", fontsize=7)
