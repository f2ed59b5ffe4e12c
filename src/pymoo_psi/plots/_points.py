"""Designs as points: the one way in which a plane of two columns is drawn.

Every design is in one group. Groups differ in marker and lightness; one without designs is not
drawn. The key says what the markers mean, and the best designs have their names beside them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pymoo_psi._numbers import needs_logarithms, number
from pymoo_psi._output import with_unit
from pymoo_psi._validation import Array, Mask, Names, counted
from pymoo_psi.analysis import within_limits, written_limits
from pymoo_psi.files import read_table
from pymoo_psi.pareto import nondominated
from pymoo_psi.plots._style import (
    ABOVE,
    ACCENT,
    NOTE,
    Style,
    literal,
    name_axis,
    name_points,
    raised,
    set_log,
    view,
)
from pymoo_psi.table import (
    VARIABLE,
    Column,
    Kind,
    Limit,
    TestTable,
    error_column,
    has_errors,
    value_ranks,
)

Ends = tuple[float, float]
Groups = Mapping[str, tuple[Style, Mask]]
"""Groups of designs by name: how their markers are drawn, and ``(n,)`` which designs these are."""

PARETO = "not dominated"
_SPREAD = 0.6  # share of the distance between two options
_GOLDEN = 0.6180339887498949  # multiples of it modulo 1 are the evenest sequence
NAMED = 8  # designs that all have names; of more only the marked one has
_LETTERS = 26  # of their names
_MANY = 50  # from here on the markers of a group shrink and fade, so that their density shows
_RASTERIZED = 1000  # more markers would fill a vector file, drawn one by one
_OPEN = Limit()[:2]  # no limit
_REJECTED = "0.95"  # the ground beyond limits
_NARROW = 0.12  # share of a vertical axis that has no room for the name of a limit
_RIGHT = ("axes fraction", "data")  # coordinates of names on the right
_BEYOND = 0.5  # an axis shows designs that are nearer than this share of the feasible range
# How groups are drawn. Those of a higher zorder are on top.
_INFEASIBLE: Style = {"marker": "x", "color": "0.5", "markersize": 3.2, "zorder": 2.8}
_OUTSIDE: Style = {
    "color": "0.6",
    "markersize": 3.2,
    "clip_on": False,
    "zorder": 6.0,
    "in_layout": False,
}
_HOLLOW: Style = {"marker": "o", "markerfacecolor": "white", "zorder": 3.0}
_DOMINATED = _HOLLOW | {"color": "0.5", "markersize": 2.8}
_PARETO: Style = _HOLLOW | {
    "color": "0.35",
    "markerfacecolor": "0.35",
    "markeredgecolor": "white",
    "markersize": 4.2,
    "zorder": 3.5,
}
_DOT = _DOMINATED | {"markeredgewidth": 0.0, "markerfacecolor": "0.75"}  # no ring is seen
_FAINTEST = 0.6  # opacity of the markers of very many designs
_BELOW_POINTS = 3.4  # place in the order of drawing below the Pareto-optimal points, 3.5
_FRONT: Style = {"color": "0.15", "linewidth": 0.8, "zorder": 3.3}  # of two objectives
_MARKED: Style = {  # the chosen or proposed design
    "linestyle": "none",
    "marker": "o",
    "markersize": 8.5,
    "color": ACCENT,
    "markeredgecolor": "white",
    "markeredgewidth": 1.2,
    "zorder": 7.0,
}


@dataclass(frozen=True, eq=False)
class Coordinate:
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
        unit: Its unit, for limits.
    """

    places: Array
    ends: Ends
    label: str = ""
    options: Sequence[Any] = ()
    log: bool = False
    limits: Ends = _OPEN
    sign: int = 0
    errors: Array | None = None
    unit: str = ""

    def shows(self, values: Array) -> Mask:
        """Return which of ``(n,)`` values are within the ends of the axis."""
        low, high = self.ends
        return (values >= low) & (values <= high)

    def set_axis(self, axes: Axes, letter: str) -> None:
        """Set ends, scale and texts of the axis "x" or "y", and shade what is beyond limits."""
        axes.set(**{f"{letter}lim": self.ends})
        figure: Any = axes.figure
        if self.log:
            set_log(axes, letter, figure.decimal)
        across = {"x": "v", "y": "h"}[letter]
        draw_span = getattr(axes, f"ax{across}span")
        draw_line = getattr(axes, f"ax{across}line")
        is_inside = self.shows(np.array(self.limits))
        for limit, is_dashed, end in zip(self.limits, is_inside, self.ends, strict=True):
            if np.isfinite(limit):
                draw_span(*sorted((limit, end)), facecolor=_REJECTED, linewidth=0, zorder=0)
            if is_dashed:
                draw_line(limit, color="0.4", ls="--", lw=0.8, zorder=1.5)
                self._name_limit(axes, letter, limit)
        figure.fit(name_axis, axes, letter, self.label, self.options, self.sign)

    def _name_limit(self, axes: Axes, letter: str, limit: float) -> None:
        """Write the value of a limit at its line: above the axes, or on the line.

        On a line so near the upper end that it has no room there, it is below the line.
        """
        figure: Any = axes.figure
        value = raised(number(limit, mark=figure.decimal))
        text = literal(f"limit {value} {self.unit}")
        if letter == "x":
            axes.annotate(text, (limit, 1), (0, 2), ABOVE, ha="center", va="bottom", **NOTE)
            return
        up, align = 2, "bottom"
        place = axes.get_yaxis_transform().transform((1, limit))
        if axes.transAxes.inverted().transform(place)[1] > 1 - _NARROW:
            up, align = -2, "top"
        axes.annotate(text, (1, limit), (-2, up), _RIGHT, ha="right", va=align, **NOTE)


@dataclass(frozen=True, eq=False)
class Points:
    """Designs in planes of two of their columns.

    Attributes:
        columns: Columns by name, as coordinates.
        groups: Groups of designs.
        named: Texts for designs by their row, that which is marked first: the name, and, if all
            Pareto-optimal designs have names, the place, which is in the name, too.
        word: "proposed" or "marked".
    """

    columns: Mapping[str, Coordinate]
    groups: Groups
    named: Mapping[int, Sequence[str]] = field(default_factory=dict)
    word: str = ""

    @property
    def marked(self) -> list[int]:
        """The row of the design that is marked; empty if there is none."""
        return [*self.named][:1]

    def draw(self, axes: Axes, first: str, second: str, *, is_detailed: bool = False) -> None:
        """Draw the designs over two columns, with the limits and what is beyond them.

        Args:
            axes: The axes.
            first: Name of the column across.
            second: Name of the column upwards.
            is_detailed: Whether designs have names, or places for want of room; whether those
                outside have an arrow at the edge; and whether the key counts the marked design by
                its own mark only.
        """
        x = self.columns[first]
        y = self.columns[second]
        mark = _MARKED
        if is_detailed and len(x.places) <= _MANY:  # the mark hides none of its neighbours
            mark = mark | {"zorder": _BELOW_POINTS}
        for row in self.marked:
            label = f"{self.word}: {self.named[row][0]}"
            axes.plot(x.places[row], y.places[row], label=label, **mark)
        if PARETO in self.groups and x.sign * y.sign != 0:
            _draw_front(axes, x, y, self.groups[PARETO][1])
            _draw_errors(axes, x, y, self.groups[PARETO][1])
        for name, (style, mask) in self.groups.items():
            rows = mask & x.shows(x.places) & y.shows(y.places)
            n = int(mask.sum())
            label = f"{n} {name}"
            if is_detailed and mask[self.marked].any():
                rows[self.marked] = False
                n -= 1
                label = f"{counted(n, 'other')} {name}"
            if n:
                axes.plot(x.places[rows], y.places[rows], label=label, **_markers(style, n))
        x.set_axis(axes, "x")
        y.set_axis(axes, "y")
        if is_detailed:
            self._mark_outside(axes, x, y)
            first_name: Style = {"color": ACCENT, "fontweight": "bold"}
            name_points(axes, np.column_stack([x.places, y.places]), self.named, first_name)

    def _mark_outside(self, axes: Axes, x: Coordinate, y: Coordinate) -> None:
        """Draw an arrow at the edge of axes for each design outside."""
        label = f"{counted(self.outside.sum(), 'design')} outside the axes"
        sides = {
            "<": x.places < x.ends[0],
            ">": x.places > x.ends[1],
            "v": y.places < y.ends[0],
            "^": y.places > y.ends[1],
        }
        for marker, is_there in sides.items():
            rows = is_there & self.outside
            if rows.any():
                across = np.clip(x.places[rows], *x.ends)
                up = np.clip(y.places[rows], *y.ends)
                axes.plot(across, up, marker, label=label, **_OUTSIDE)

    @property
    def outside(self) -> Mask:
        """``(n,)`` which designs of the groups are outside the ends of a column."""
        is_drawn = np.any([mask for _, mask in self.groups.values()], axis=0)
        is_visible = [column.shows(column.places) for column in self.columns.values()]
        return np.asarray(is_drawn & ~np.all(is_visible, axis=0))

    def counts(self, table: TestTable) -> str:
        """Return how many designs each marker has, and how many are outside, as sentences."""
        n_failed = np.sum(table.status == "failed")
        noun = table.schema.words["row"] if table.repeats.any() else "design"
        text = counted(len(table), noun)
        if n_failed:
            text += f", {n_failed} {table.schema.words['failed']}"
        if not self.columns:
            return f"{text}."
        groups = groups_in_words(self.groups)
        if len(table) > 1 and groups == f"{len(table)} {PARETO}":
            text += ", none of them dominated"
        elif groups:
            text += f": {groups}"
        if self.outside.any():
            text += f". {counted(self.outside.sum(), 'design')} outside the axes"
        for row in self.marked:
            text += f". The blue dot is {table.names[row]}"
        limits = written_limits(table.limits, table.schema.units)
        if limits:
            text += f". Limits, dashed where an axis shows them: {', '.join(limits)}"
        return f"{text}."


def _markers(style: Style, n: int) -> Style:
    """Return how the markers of n designs are drawn: many are smaller and fainter."""
    shrink = float(np.clip((_MANY / n) ** 0.3, 0.4, 1.0))
    return {
        "markeredgewidth": 0.6 * shrink**0.5,
        "alpha": max(shrink, _FAINTEST),
        "linestyle": "none",
        "rasterized": n > _RASTERIZED,
        **style,
        "markersize": style["markersize"] * shrink,
    }


def _draw_front(axes: Axes, x: Coordinate, y: Coordinate, rows: Mask) -> None:
    """Draw the staircase of two objectives: there is no design between two of them.

    A single one, the best in both objectives, is a corner of what all of them reach. Designs
    outside the axes count, too.
    """
    F = np.column_stack([x.places[rows], y.places[rows]]) * [x.sign, y.sign]
    if len(np.unique(F, axis=0)) > 1:  # a single point has no line
        front = F[nondominated(F)]
        front = front[np.argsort(front[:, 0], kind="stable")]
        stairs = front.repeat(2, axis=0)
        across, up = stairs[1:, 0], stairs[:-1, 1]
        if len(front) == 1:
            worst = F.max(axis=0)
            across, up = np.append(stairs[:, 0], worst[0]), np.append(worst[1], stairs[:, 1])
        axes.plot(x.sign * across, y.sign * up, label="best trade-offs of the two", **_FRONT)


def _draw_errors(axes: Axes, x: Coordinate, y: Coordinate, rows: Mask) -> None:
    """Draw the standard errors of designs, if they are known."""
    if x.errors is not None and y.errors is not None:
        bars: Style = {"fmt": "none", "ecolor": "0.6", "elinewidth": 0.6, "zorder": 2.4}
        axes.errorbar(
            x.places[rows], y.places[rows], xerr=x.errors[rows], yerr=y.errors[rows], **bars
        )


def groups_in_words(groups: Groups) -> str:
    """Return how many designs are in each group."""
    texts = []
    for name, (_, mask) in groups.items():
        if mask.any():
            texts.append(f"{mask.sum()} {name}")
    return ", ".join(texts)


def opened_table(source: Any) -> TestTable:
    """Return the table in a source, as :func:`pymoo_psi.read_table` opens it."""
    if isinstance(source, TestTable):  # which may be empty
        return source
    return read_table(source)


def points_of_table(table: TestTable, names: Names, marked: Sequence[int] = ()) -> Points:
    """Return the tests over columns.

    Args:
        table: The tests.
        names: Names of the columns.
        marked: Row of the design that is marked; empty if it is the proposed one.
    """
    named = {row: [literal(table.names[row], _LETTERS)] for row in marked}
    word = "marked"
    if names and table.schema.objectives and table.feasible().any():
        ranking = table.feasible_ranking()
        front = ranking.by_place[: ranking.pareto.sum()]
        rows = ranking.rows[front].tolist()
        if len(front) <= NAMED:
            for place, row in zip(ranking.place[front], rows, strict=True):
                named[row] = [f"{place}. {literal(table.names[row], _LETTERS)}", str(place)]
        elif not named:
            named = {rows[0]: [literal(table.names[rows[0]], _LETTERS)]}
        if next(iter(named)) in ranking.rows[ranking.salukvadze]:
            word = "proposed"
    columns = {name: _coordinate(table, name, [*named][:1]) for name in names}
    return Points(columns, _groups(table), named, word)


def _groups(table: TestTable) -> Groups:
    """Return the groups of tests: Pareto-optimal, dominated and infeasible ones."""
    feasible = table.feasible()
    pareto = table.pareto()[table.ranked_as]  # with the repeated tests of a design
    style = _DOMINATED
    if feasible.sum() > _MANY:
        style = _DOT
    beyond = within_limits(table).replace(" within", "beyond")
    return {
        PARETO: (_PARETO, pareto),
        "dominated": (style, feasible & ~pareto),
        beyond: (_INFEASIBLE, ~feasible & (table.status != "failed")),
    }


def _coordinate(table: TestTable, name: str, marked: Sequence[int]) -> Coordinate:
    """Return a column of tests as a coordinate whose axis shows the marked row, if there is one."""
    column = table.schema[name]
    values = table.column(name)
    label = with_unit(name, column.unit)
    is_variable = column.role == VARIABLE
    if is_variable and column.kind in (Kind.BINARY, Kind.CHOICE):
        options, ranks = value_ranks(values)
        aside = _SPREAD * (table.numbers.astype(np.float64) * _GOLDEN % 1 - 0.5)
        return Coordinate(ranks + aside, (-0.5, len(options) - 0.5), label, options)
    values = values.astype(np.float64)
    if is_variable:
        ends, is_log = _axis_of_variable(column, values, values[marked])
    else:
        ends, is_log = _axis_of_output(values, table.feasible(), values[marked])
    if is_log:
        label += ", log"
    sign = 0
    errors = None
    if name in table.schema.objectives:
        sign = -1 if column.maximize else 1
        if has_errors(table):
            errors = table.column(error_column(name))
    limits = table.limits.get(name, Limit())[:2]
    return Coordinate(values, ends, label, (), is_log, limits, sign, errors, column.unit)


def _axis_of_variable(column: Column, values: Array, shown: Array) -> tuple[Ends, bool]:
    """Return the ends of the axis of a variable with its bounds, and whether it is logarithmic."""
    bounds = np.array([column.lower, column.upper], float)  # NaN if unknown
    is_log = column.kind is Kind.LOG
    low, high = _ends(values, np.append(shown, bounds), is_log)
    if column.kind is Kind.INTEGER:
        return (np.floor(low) + 0.5, np.ceil(high) - 0.5), is_log
    return (low, high), is_log


def _axis_of_output(values: Array, feasible: Mask, shown: Array) -> tuple[Ends, bool]:
    """Return the ends of the axis of another column, and whether it is logarithmic.

    An axis that shows every infeasible design would show nothing else: designs farther from the
    feasible ones than a share of their range are outside.
    """
    inner = values[feasible]
    low, high = view(inner)
    inside = inner[(inner >= low) & (inner <= high)]
    if (inner > 0).all() and needs_logarithms(inside):
        return _ends(inner, shown, is_log=True), True
    near = values
    if len(np.unique(inner)) > 1:
        reach = _BEYOND * (high - low)
        near = values[(values >= low - reach) & (values <= high + reach)]
    return _ends(near, shown, is_log=False), False


def _ends(values: Array, shown: Array, is_log: bool) -> Ends:
    """Return the ends of an axis of values, given what it shows in any case."""
    if not is_log:
        return view(values, *shown)
    # A marked design need not be feasible, and so not positive.
    low, high = np.exp(view(np.log(values), *np.log(shown[shown > 0]))).tolist()
    return low, high
