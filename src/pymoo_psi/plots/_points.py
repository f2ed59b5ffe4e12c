"""Designs as points: the one way in which a plane of two columns is drawn.

Every design is in one group. Groups differ in marker and lightness; one without designs is not
drawn. The caption says what the markers mean, and the best designs have their names beside them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from pymoo_psi._output import with_unit
from pymoo_psi._validation import Array, Mask, Names, Rows, counted
from pymoo_psi.analysis import written_limits
from pymoo_psi.files import read_table
from pymoo_psi.pareto import EfficiencyRanking, nondominated
from pymoo_psi.plots._style import ACCENT, INK, Style, literal, set_log, spans_decades, view
from pymoo_psi.table import Kind, Limit, TestTable, error_column, has_errors, value_ranks

Ends = tuple[float, float]

GREY = "0.68"  # a share of white, in matplotlib's notation
BLUE = "#4292C6"
PARETO = "dominated by no other"
_LETTERS = 90  # letters of axis labels over the width of a figure
_MOST_OPTIONS = 12  # options that have a tick each
_SPREAD = 0.6  # share of the distance between two options
_GOLDEN = 0.6180339887498949  # multiples of it modulo 1 are the evenest sequence
_NAMED = 8  # designs that are named where there is room
_MANY = 200  # from here on the markers of a group shrink
_RASTERIZED = 1000  # more markers would fill a vector file, drawn one by one
_OPEN = (-np.inf, np.inf)  # no limit
_BETTER = {1: "less is better", -1: "more is better", 0: ""}
_SHAPES = {".": "dots", "x": "crosses", "o": "circles"}
_MARKED: Style = {  # the chosen or proposed design
    "linestyle": "none",
    "marker": "*",
    "markersize": 10.0,
    "color": ACCENT,
    "markeredgecolor": "white",
    "markeredgewidth": 0.5,
    "zorder": 7.0,
    "label": "_marked",
}


class Marker(NamedTuple):
    """How a group of designs is drawn.

    Attributes:
        shape: The shape, in matplotlib's notation.
        colour: Its colour.
        size: Diameter in points.
        level: Groups of a higher level are drawn on top.
        face: Its colour inside, if it is an outline.
    """

    shape: str
    colour: str
    size: float
    level: float
    face: str | None = None

    def style(self, name: str, n: int) -> Style:
        """Return the arguments of ``plot`` for ``n`` designs; more of them are drawn smaller."""
        shrink = np.clip((_MANY / n) ** 0.3, 0.3, 1.0)
        return {
            "linestyle": "none",
            "marker": self.shape,
            "color": self.colour,
            "markersize": self.size * shrink,
            "markerfacecolor": self.face or self.colour,
            "markeredgewidth": 0.8 * shrink,
            "zorder": self.level,
            "label": f"{name} ({n})",
            "rasterized": n > _RASTERIZED,
        }


Groups = Mapping[str, tuple[Marker, Mask]]
"""Groups of designs by name: how they are drawn, and ``(n,)`` which designs these are."""

_DOMINATED = Marker(".", "0.62", 4.5, 3.0)
_OPTIMUM = Marker("*", ACCENT, 11.0, 6.0)
_REST = Marker(".", GREY, 4.5, 2.0)
_INFEASIBLE = Marker("x", "0.7", 2.6, 2.1)
_PARETO = Marker("o", INK, 3.6, 3.5, "white")
_CROWD = Marker("o", "0.45", 3.6, 3.5)  # outlines of many would be a black area
# By rank, rarer ranks on top; ranks 1 and 2 do not occur, 6 is the optimum's.
_RANKS = {
    0: _REST,
    3: Marker("^", "#9ECAE1", 5.0, 4.0),
    4: Marker("s", BLUE, 3.4, 3.0),
    5: Marker("D", "#08519C", 5.0, 5.0),
}


@dataclass(frozen=True, eq=False)
class Column:
    """The values of a column as places on an axis.

    Attributes:
        places: ``(n,)`` where the designs are drawn; tests with the same option are side by side.
        ends: Ends of the axis.
        label: Name and unit.
        options: The values at 0, 1, … of a choice or a binary variable; empty for numbers.
        log: Whether the axis is logarithmic.
        limits: The lower and the upper limit, infinite where there is none.
        sign: 1 for an objective to be minimised, -1 for one to be maximised, 0 for another column.
        errors: ``(n,)`` standard errors of an objective, if they are known.
    """

    places: Array
    ends: Ends
    label: str = ""
    options: tuple[Any, ...] = ()
    log: bool = False
    limits: Ends = _OPEN
    sign: int = 0
    errors: Array | None = None

    @property
    def visible(self) -> Mask:
        """``(n,)`` which designs are within the ends of the axis."""
        low, high = self.ends
        return (self.places >= low) & (self.places <= high)

    def set_axis(self, axes: Axes, letter: str) -> None:
        """Set ends, scale and texts of the axis "x" or "y", and shade what is beyond limits."""
        axes.set(**{f"{letter}lim": self.ends})
        if self.log:
            set_log(axes, letter, (1.0,))
        across = {"x": "v", "y": "h"}[letter]
        draw_span = getattr(axes, f"ax{across}span")
        draw_line = getattr(axes, f"ax{across}line")
        for limit, end in zip(self.limits, self.ends, strict=True):
            if np.isfinite(limit):
                draw_span(*sorted((limit, end)), facecolor="0.93", linewidth=0, zorder=0)
                draw_line(limit, color="0.25", ls="--", lw=1.0, zorder=4.5)
        name_axis(axes, letter, self.label, self.options, _BETTER[self.sign])


def name_axis(
    axes: Axes, letter: str, label: str, options: Sequence[object] = (), better: str = ""
) -> None:
    """Write name and ticks of the axis "x" or "y", as much text as fits beside others.

    Args:
        axes: The axes.
        letter: Which axis.
        label: Its name.
        options: Texts at 0, 1, …; empty for an axis of numbers.
        better: Which of its values are better, behind the name or below it.
    """
    axis: Any = getattr(axes, f"{letter}axis")
    grid: Any = axes.get_gridspec()
    room = _LETTERS // grid.ncols
    n_ticks = 4
    if room < 25:
        n_ticks = 3
    if letter == "y":
        room = 22
    text = literal(label, room)
    if better:
        apart = " "
        if letter == "y" or len(f"{text}, {better}") > room:
            apart = "\n"
        text = f"{text},{apart}{better}"
    axis.set_label_text(text)
    if options:
        step = -(-len(options) // _MOST_OPTIONS)  # rounded up
        names = [literal(option, 14) for option in options[::step]]
        rotation = 0
        if letter == "x" and len("  ".join(names)) > room:
            rotation = 90
        axis.set_ticks(range(0, len(options), step), names, rotation=rotation)
        axis.grid(visible=False)
    elif axis.get_scale() == "linear":
        axis.get_major_locator().set_params(nbins=n_ticks)


@dataclass(frozen=True, eq=False)
class Points:
    """Designs in planes of two of their columns.

    Attributes:
        columns: Columns by name.
        groups: Groups of designs.
        named: Names of designs by their row, that which is marked first.
    """

    columns: Mapping[str, Column]
    groups: Groups
    named: Mapping[int, str] = field(default_factory=dict)

    def draw(self, axes: Axes, first: str, second: str) -> None:
        """Draw the designs over two columns, with the limits and what is beyond them."""
        x = self.columns[first]
        y = self.columns[second]
        visible = x.visible & y.visible
        for name, (marker, mask) in self.groups.items():
            if mask.any():
                rows = mask & visible
                axes.plot(x.places[rows], y.places[rows], **marker.style(name, mask.sum()))
        if PARETO in self.groups and x.sign * y.sign != 0:
            _, optimal = self.groups[PARETO]
            _draw_front(axes, x, y, np.flatnonzero(visible & optimal))
        for row in list(self.named)[:1]:
            axes.plot(x.places[row], y.places[row], **_MARKED)
        x.set_axis(axes, "x")
        y.set_axis(axes, "y")

    def counts(self, table: TestTable) -> str:
        """Return how many designs each marker has, and how many are outside, as sentences."""
        has_failed = table.status == "failed"
        text = counted(len(table), "design")
        if has_failed.any():
            text += f", {has_failed.sum()} {table.schema.words['failed']}"
        if not self.columns:
            return f"{text}."
        groups = []
        for name, (marker, mask) in self.groups.items():
            if mask.any():
                groups.append(f"{mask.sum()} {name} ({_SHAPES[marker.shape]})")
        if groups:
            text += f": {', '.join(groups)}"
        is_visible = [column.visible for column in self.columns.values()]
        n_far = np.sum(~has_failed & ~np.all(is_visible, axis=0))
        if n_far:
            text += f". {counted(n_far, 'design')} outside the axes"
        for name in list(self.named.values())[:1]:
            text += f". The star is {name}"
        limits = written_limits(table)
        if limits:
            text += f". Limits are dashed: {', '.join(limits)}"
        return f"{text}."


def _draw_front(axes: Axes, x: Column, y: Column, rows: Rows) -> None:
    """Draw the front of two objectives as a line, and error bars if errors are known."""
    rows = rows[np.argsort(x.places[rows], kind="stable")]
    u = x.places[rows]
    v = y.places[rows]
    front = nondominated(np.column_stack([x.sign * u, y.sign * v]))
    axes.plot(u[front], v[front], color="0.55", linewidth=0.8, zorder=2.5, label="_front")
    if x.errors is not None and y.errors is not None:
        bars: Style = {"fmt": "none", "ecolor": "0.6", "elinewidth": 0.6, "zorder": 2.4}
        axes.errorbar(u, v, xerr=x.errors[rows], yerr=y.errors[rows], **bars)


def opened_table(source: Any) -> TestTable:
    """Return the table in a source, as :func:`pymoo_psi.read_table` opens it."""
    if isinstance(source, TestTable):  # which may be empty
        return source
    return read_table(source)


# Test tables


def points_of_table(table: TestTable, names: Names, marked: Sequence[int] = ()) -> Points:
    """Return the tests over columns.

    Args:
        table: The tests.
        names: Names of the columns.
        marked: Row of the design that is marked; empty if it is the proposed one.
    """
    rows = list(marked)
    if names and table.schema.objectives and table.feasible().any():
        ranking = table.feasible_ranking()
        best = ranking.by_place[: ranking.pareto.sum()]
        rows += ranking.rows[best[:_NAMED]].tolist()
    columns = {name: _column(table, name, marked) for name in names}
    return Points(columns, _groups(table), {row: table.names[row] for row in rows})


def _groups(table: TestTable) -> dict[str, tuple[Marker, Mask]]:
    """Return the tests that are not failed in groups by name."""
    feasible = table.feasible()
    pareto = table.pareto()
    optimal = _PARETO
    if pareto.sum() > _MANY:
        optimal = _CROWD
    return {
        "beyond the limits": (_INFEASIBLE, ~feasible & (table.status != "failed")),
        "dominated": (_DOMINATED, feasible & ~pareto),
        PARETO: (optimal, pareto),
    }


def _column(table: TestTable, name: str, marked: Sequence[int]) -> Column:
    """Return a column of tests, whose axis shows the marked row, if there is one."""
    schema = table.schema
    column = schema[name]
    label = column.heading
    values = table.column(name)
    limit = table.limits.get(name, Limit())
    limits = (limit.low, limit.high)
    if name not in schema.variables:
        is_log, ends = _axis_of_dependent(values, table.feasible(), values[list(marked)])
        sign = 0
        errors = None
        if name in schema.objectives:
            label = with_unit(name, column.unit)
            sign = -1 if column.maximize else 1
            if has_errors(table):
                errors = table.column(error_column(name))
        return Column(values, ends, label, log=is_log, limits=limits, sign=sign, errors=errors)
    if column.kind in (Kind.BINARY, Kind.CHOICE):
        options, ranks = value_ranks(values)
        aside = _SPREAD * (table.numbers.astype(np.float64) * _GOLDEN % 1 - 0.5)
        return Column(ranks + aside, (-0.5, len(options) - 0.5), label, tuple(options))
    places = values.astype(np.float64)
    ends = _ends_of_variable(table, name, places)
    return Column(places, ends, label, log=column.kind is Kind.LOG, limits=limits)


def _ends_of_variable(table: TestTable, name: str, places: Array) -> Ends:
    """Return the ends of an axis that shows the bounds of a variable, and whole steps of it."""
    column = table.schema[name]
    bounds = np.array([column.lower, column.upper], dtype=float)  # NaN if there are none
    if column.kind is Kind.LOG:
        return _log_view(places, bounds)
    low, high = view(places, *bounds)
    if column.kind is Kind.INTEGER:
        return np.floor(low) + 0.5, np.ceil(high) - 0.5
    return low, high


def _axis_of_dependent(values: Array, feasible: Mask, marked: Array) -> tuple[bool, Ends]:
    """Return whether the axis of an output is logarithmic, and its ends.

    An axis that shows every infeasible design would show nothing else: designs farther from the
    feasible ones than their range are outside, but the marked ones are inside.
    """
    inner = values[feasible]
    if spans_decades(inner):
        return True, _log_view(inner, marked)
    if len(np.unique(inner)) <= 1:
        inner = values
    low, high = view(inner, *marked)
    reach = high - low
    near = values[(values >= low - reach) & (values <= high + reach)]
    return False, view(near, *marked)


def _log_view(values: Array, further: Array) -> Ends:
    low, high = np.exp(view(np.log(values), *np.log(further))).tolist()
    return low, high


# Rankings


def ranked_groups(ranking: EfficiencyRanking) -> Groups:
    """Return the Pareto-optimal designs in groups by rank, and the Salukvadze optimum."""
    groups = {}
    for rank, marker in _RANKS.items():
        groups[f"rank {rank}"] = (marker, (ranking.place > 1) & (ranking.rank == rank))
    return groups | {"Salukvadze optimum": (_OPTIMUM, ranking.place == 1)}
