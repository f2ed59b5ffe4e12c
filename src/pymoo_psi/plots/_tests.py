"""A test table in planes: objectives over variables, objectives in pairs, histograms, sections.

Values are in the original units and direction. Every tested design is in one group; the groups
differ by marker and by lightness. In the place of an objective may be a constraint or an output.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pymoo_psi._validation import Received, counted, instance, invalid, known_name
from pymoo_psi.plots._markers import GREY, MARKERS, Marker
from pymoo_psi.plots._style import (
    CURVES,
    HUGE,
    Group,
    draw_points,
    legend_below,
    legend_of,
    literal,
    new_figure,
    on_axes,
    tick_counts,
    view,
)
from pymoo_psi.table import (
    Histogram,
    Key,
    Kind,
    Layout,
    Limits,
    TestTable,
    bounds_of,
    histogram,
)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MATRIX = 6  # variables, and objectives, beside which the text on the axes is still readable
_OPEN = (-np.inf, np.inf)  # no limit
_LETTERS = 90  # of text over the width of a figure, in the size of axis labels
_UPRIGHT = 18  # letters over the height of axes, likewise
_SPREAD = 0.6  # of the distance between two values
_GOLDEN = 0.6180339887498949  # multiples of it modulo 1 are the evenest sequence
_NUMBERED = 12  # bins over which there is space for the numbers

_FEASIBLE, _PARETO = "feasible, dominated", "Pareto optimal"
_GROUPS = {
    "infeasible": Marker(".", GREY, 4.5, level=2.0),
    "beyond the limits": Marker("x", "0.5", 2.4, level=2.1),
    _FEASIBLE: MARKERS[4]._replace(size=2.6),
    _PARETO: MARKERS[5]._replace(size=3.8, level=3.5),
}
_OUTLINE = [withStroke(linewidth=3.0, foreground="white")]  # apart from a crowd
_PROTOTYPE: dict[str, Any] = {
    **MARKERS[6]._replace(size=8.25).look(width=0.7), "path_effects": _OUTLINE, "zorder": 6.0,
    "label": "prototype",
}  # fmt: skip
_CHOSEN: dict[str, Any] = {
    "linestyle": "none", "marker": "o", "markersize": 9.0, "markerfacecolor": "none",
    "markeredgecolor": MARKERS[6].colour, "markeredgewidth": 1.6, "path_effects": _OUTLINE,
    "zorder": 7.0, "label": "chosen design",
}  # fmt: skip
# Of each group of a histogram: its name, its part of a bin, its look.
_BARS: dict[str, tuple[str, tuple[float, float], dict[str, Any]]] = {
    "tested": ("tested", (0.0, 1.0), {"facecolor": "0.9", "edgecolor": "0.55"}),
    "feasible": ("feasible", (0.08, 0.5), {"facecolor": MARKERS[4].colour}),
    "pareto": (
        _PARETO, (0.5, 0.92),
        {"facecolor": MARKERS[5].colour, "edgecolor": "black", "hatch": "////"},
    ),
}  # fmt: skip


def plot_table(
    table: TestTable,
    limits: Limits | None = None,
    *,
    variables: Sequence[Key] | None = None,
    objectives: Sequence[Key] | None = None,
    margin: float = 1.0,
    title: str = "",
) -> Figure:
    """Return an overview of a table: histograms of variables, objectives against variables.

    Up to six variables and six objectives make a matrix: a column for each variable, on top its
    histogram and below it a row for each objective. Of more there are the histograms alone, six
    in a row; name some of them for a matrix of these.

    Args:
        table: A test table.
        limits: Limits on columns.
        variables: Names or indices of the variables; all by default. With histograms alone other
            columns may be among them, by name.
        objectives: Names or indices of the objectives; all by default, none for histograms alone.
            Constraints and further outputs may be among them, by name.
        margin: The axes of objectives reach beyond the feasible designs and the prototype by this
            share of their range; ``float("inf")`` to show all designs.
        title: What the table is of.

    Raises:
        ArgumentValueError: A column is not in the table, there is no variable, or the margin is
            below 0.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1, 3.0], [0.5, 4.0]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> len(plot_table(table, {"f1": 1.5}).axes)
        6
    """
    tests = _Tests.of(table, limits, margin)
    layout = table.layout
    rows = _objective_names(objectives, layout)
    others = () if rows else layout.columns[len(layout.variables) :]
    keys = layout.variables if variables is None else variables
    columns = [str(k) if k in others else layout.variables[layout.variable(k)] for k in keys]
    if not columns:
        raise invalid("variables", "one or more", Received("none"))
    if max(len(columns), len(rows)) > MATRIX:
        rows = []
    wide = min(len(columns), MATRIX)
    high = 1 + len(rows) if rows else -(-len(columns) // wide)
    with _grid(high, wide) as (figure, grid):
        tops = grid.ravel()[: len(columns)]
        for ax, name in zip(tops, columns, strict=True):
            found = histogram(table, name, limits=limits)
            _draw_bars(ax, found, tested=name not in others)
            _label_axes(ax, wide, (layout.label_of(name), ax.get_ylabel()), found.values)
        for ax in tops:
            ax.set_ylim(0, max(ax.get_ylim()[1] for ax in tops))
        for ax in grid.ravel()[len(columns) :] if not rows else ():
            ax.set_axis_off()
        for axes, objective in zip(grid[1:], rows, strict=False):
            for ax, name in zip(axes, columns, strict=True):
                tests.draw(ax, name, objective, wide)
        for axes, name in zip(grid.T, columns, strict=True) if rows else ():
            if table.kinds[layout.variable(name)] is Kind.REAL:  # others have a bin for each value
                axes[0].set_xlim(axes[1].get_xlim())
        _share_axes(grid, below=bool(rows))
        _legends(figure, grid, tests if rows else None)
        figure.suptitle(tests.heading(title, [(n, o) for n in columns for o in rows]))
    return figure


def plot_objectives(
    table: TestTable,
    limits: Limits | None = None,
    *,
    objectives: Sequence[Key] | None = None,
    design: int | None = None,
    margin: float = 1.0,
    title: str = "",
) -> Figure:
    """Return the objectives against each other, each pair once.

    Args:
        table: A test table.
        limits: Limits on columns.
        objectives: Names or indices of two to seven objectives; all by default. Constraints and
            further outputs may be among them, by name.
        design: Number of a test point to be marked, such as the one that was chosen.
        margin: As for :func:`plot_table`.
        title: What the table is of.

    Raises:
        ArgumentValueError: A column or the design is not in the table, there are too few or too
            many objectives, or the margin is below 0.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        >>> sum(ax.axison for ax in plot_objectives(table).axes)
        3
    """
    tests = _Tests.of(table, limits, margin)
    names = _objective_names(objectives, table.layout)
    if not 2 <= len(names) <= MATRIX + 1:
        rule = f"from 2 to {MATRIX + 1} to draw in pairs"
        raise invalid("objectives", rule, len(names), "name those to be drawn")
    if design is not None and design not in table.numbers:
        raise invalid("design", "the number of a test point of the table", design)
    chosen = table.rows(table.numbers == design)
    wide = len(names) - 1
    with _grid(wide, wide) as (figure, grid):
        for k, second in enumerate(names[1:]):
            for ax, first in zip(grid[k], names[: k + 1], strict=False):
                tests.draw(ax, first, second, wide)
                if len(chosen):
                    ax.plot(chosen.column(first), chosen.column(second), **_CHOSEN)
            for ax in grid[k, k + 1 :]:
                ax.set_axis_off()
        _share_axes(grid)
        _legends(figure, grid, tests, [] if design is None else [_CHOSEN])
        figure.suptitle(tests.heading(title, [(a, b) for b in names for a in names if a != b]))
    return figure


def plot_histogram(
    table: TestTable,
    variable: Key,
    limits: Limits | None = None,
    *,
    bins: int = 10,
    ax: Axes | None = None,
    title: str = "",
) -> Axes:
    """Draw in each bin what share of the tested, feasible and Pareto-optimal designs it holds.

    The heights are per cent of each group: where the bars rise over the grey of the tested ones a
    group is denser than the tests. The counts are in the legend and over the bins.

    Args:
        table: A test table.
        variable: Name or index of the variable.
        limits: Limits on columns.
        bins: Equal bins of the bounds of a real variable; others have one bin for each value.
        ax: Axes to draw on; new ones by default.
        title: What the designs are; how many there are follows it.

    Returns:
        The axes.

    Raises:
        ArgumentValueError: The variable or a limited column is not in the table, or ``bins`` is
            below 1.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.2], [1.0]], [[1], [2], [3]])
        >>> ax = plot_histogram(table, "x1", {"f1": 2})
        >>> [text.get_text() for text in ax.get_legend().get_texts()]
        ['tested (3)', 'feasible (2)', 'Pareto optimal (1)']
    """
    found = histogram(_checked(table), variable, bins=bins, limits=limits)
    with on_axes(ax) as axes:
        _draw_bars(axes, found, numbers=True)
        axes.set_xlabel(literal(table.layout.label_of(found.variable)))
        tick_counts(axes, y=5)
        if found.values:
            name_places(axes, found.values, letters=60)
        else:
            tick_counts(axes, x=6)
        axes.set_title(f"{title}\n{counted(found.tested.sum(), 'design')} tested".strip())
        legend_below(axes, ncols=2)
    return axes


def plot_section(
    section: TestTable,
    variable: Key,
    *,
    at: float | None = None,
    limits: Limits | None = None,
    title: str = "",
) -> Figure:
    """Return the objectives along one variable, the others staying those of one design.

    Each objective has axes of its own, its feasible parts in bold, its limit shaded; its curve is
    interrupted where a design failed.

    Args:
        section: The tested designs of :func:`~pymoo_psi.table.section_points`, as a table with the
            layout of the whole: ``TestTable.of(range(1, n + 1), X, F, G, layout=table.layout)``.
        variable: Name or index of the variable that runs, a real one or an integer.
        at: Its value in the design that the section goes through, to be marked.
        limits: Limits on columns.
        title: What is drawn.

    Raises:
        ArgumentValueError: The variable is not there, no number, or not the only one that differs.
        ArgumentTypeError: ``section`` is no test table.

    Example:
        >>> from pymoo_psi import TestTable
        >>> from pymoo_psi.table import section_points
        >>> table = TestTable.of([1], X=[[1.0, 5.0]], F=[[6.0, 5.0]])
        >>> X = section_points(table, 1, "x1", 3, lower=0, upper=2)
        >>> section = TestTable.of([1, 2, 3], X, [[x1 + x2, x1 * x2] for x1, x2 in X])
        >>> [ax.get_ylabel() for ax in plot_section(section, "x1").axes]
        ['f1', 'f2']
    """
    layout = _checked(section).layout
    j = layout.variable(variable)
    if section.kinds[j] not in (Kind.REAL, Kind.INTEGER):
        received = Received(f"one that is a {section.kinds[j].value}")
        raise invalid("variable", "a real number or an integer", received)
    others = np.flatnonzero((section.X[:1] != section.X).any(axis=0))
    if {*others.tolist()} - {j}:
        names = ", ".join(layout.variables[k] for k in others if k != j)
        raise invalid("section", "of designs that differ in one variable", Received(names))
    tests = section.rows(np.argsort(section.X[:, j].astype(float), kind="stable"))
    x, feasible = tests.X[:, j].astype(float), tests.feasible(limits)
    bounds = bounds_of(limits, layout)
    wide = min(len(layout.objectives), 2)
    with _grid(-(-len(layout.objectives) // wide), wide) as (figure, grid):
        for ax, name in zip(grid.flat, layout.objectives, strict=False):
            f = tests.column(name)
            known = np.abs(f) < HUGE
            # matplotlib interrupts a line at NaN
            ax.plot(x, np.where(known, f, np.nan), color="0.55", linewidth=0.8)
            for label, mask, look in (
                ("not feasible", known & ~feasible, {"color": "0.45", "marker": "x"}),
                ("feasible", known & feasible, CURVES[0]),
            ):
                drawn = {"linestyle": "none", "linewidth": 1.8} | look
                label = f"{label} ({mask.sum()})"
                ax.plot(x, np.where(mask, f, np.nan), markersize=3.4, label=label, **drawn)
            if at is not None:
                label = f"{literal(layout.variables[j])} = {at:.5g}"
                ax.axvline(at, color="0.25", linestyle=":", linewidth=1.0, label=label)
            ax.set_xlim(view(x, *(() if at is None else (at,))))
            ax.set_ylim(view(f))
            _draw_limits(ax, "y", name, bounds.get(name, _OPEN))
            ax.set_xlabel(literal(layout.label_of(layout.variables[j])))
            ax.set_ylabel(_upright(layout.label_of(name), 28))
            tick_counts(ax, x=6, y=5)
        for ax in grid.flat[len(layout.objectives) :]:
            ax.set_axis_off()
        failed = int((tests.status == "failed").sum())
        note = f", {failed} failed" if failed else ""
        figure.suptitle(f"{title}\nsection of {counted(len(x), 'design')}{note}".strip())
        _legends(figure, grid)
    return figure


def _checked(table: object) -> TestTable:
    remedy = "PSI and investigate give one, TestTable.of(...) makes one of arrays"
    return instance("table", table, TestTable, remedy)


def _objective_names(keys: Sequence[Key] | None, layout: Layout) -> list[str]:
    others = layout.constraints + layout.outputs
    keys = layout.objectives if keys is None else keys
    return [
        known_name("objectives", key, others)
        if key in others
        else layout.objectives[layout.objective(key)]
        for key in keys
    ]


@dataclass(frozen=True, eq=False)
class Column:
    """The values of a column as places on an axis.

    Attributes:
        places: ``(n,)`` where the designs are drawn; tests of the same single value side by side.
        options: The values at 0, 1, … of a choice or a binary variable; empty for numbers.
        ends: Of the axis.
        whole: Whether the numbers are integers.
    """

    places: Array
    options: tuple[Any, ...]
    ends: tuple[float, float]
    whole: bool

    @classmethod
    def of_variable(cls, table: TestTable, name: str) -> Column:
        """Return a variable; single values have half a step on each side."""
        j = table.layout.variable(name)
        kind, cells = table.kinds[j], table.X[:, j]
        aside = _SPREAD * (table.numbers.astype(np.float64) * _GOLDEN % 1 - 0.5)
        if kind not in (Kind.REAL, Kind.INTEGER):
            options = sorted({*cells.tolist()}, key=str)
            index = {option: k for k, option in enumerate(options)}
            places = np.array([index[cell] for cell in cells.tolist()], np.float64)
            return cls(places + aside, tuple(options), (-0.5, len(options) - 0.5), False)
        bounds = [b for b in (table.layout.lower[j], table.layout.upper[j]) if np.isfinite(b)]
        x = cells.astype(np.float64)
        known = np.array([*x, *bounds])
        if kind is Kind.INTEGER and len(x) and np.ptp(known) <= 30:
            return cls(x + aside, (), (known.min() - 0.5, known.max() + 0.5), True)
        return cls(x, (), view(x, *bounds), kind is Kind.INTEGER)


@dataclass(frozen=True, eq=False)
class _Tests:
    """The tests of a table as they are drawn under limits."""

    table: TestTable
    bounds: dict[str, tuple[float, float]]
    groups: dict[str, Group]
    margin: float

    @classmethod
    def of(cls, table: TestTable, limits: Limits | None, margin: float) -> _Tests:
        if not margin >= 0:
            raise invalid("margin", "0 or more", margin)
        kept, front = _checked(table).feasible(limits), table.pareto(limits)
        masks = (table.status == "infeasible", (table.status == "ok") & ~kept, kept & ~front, front)
        groups = {
            name: Group(np.flatnonzero(mask), marker)
            for (name, marker), mask in zip(_GROUPS.items(), masks, strict=True)
            if mask.any() or name in (_FEASIBLE, _PARETO)
        }
        return cls(table, dict(bounds_of(limits, table.layout)), groups, margin)

    def of_prototype(self, name: str) -> Array:
        """``(k,)`` the values of the prototypes in a column of finite numbers, or none."""
        existing = self.table.prototype
        if existing is None or name not in existing.layout.columns:
            return np.zeros(0)
        try:
            values = existing.column(name).astype(np.float64)
        except ValueError:  # a choice
            return np.zeros(0)
        return values if np.isfinite(values).all() else np.zeros(0)

    @cached_property
    def _core(self) -> NDArray[np.intp]:
        return np.concatenate([self.groups[_FEASIBLE].rows, self.groups[_PARETO].rows])

    def near(self, name: str) -> Mask:
        """``(n,)`` which tests are near the feasible ones and the prototype in a column.

        Of a variable all are. A column in which the feasible ones do not differ leaves none out.
        """
        if name in self.table.layout.variables:
            return np.ones(len(self.table), dtype=bool)
        values = self.table.column(name)
        known: Mask = np.abs(values) < HUGE
        core = np.append(values[self._core], self.of_prototype(name))
        core = core[np.abs(core) < HUGE]
        low, high = core.min(initial=np.inf), core.max(initial=-np.inf)
        if high > low:  # also refuses the infinities of an empty core
            wider = self.margin * (high - low)
            known &= (values >= low - wider) & (values <= high + wider)
        return known

    def column(self, name: str) -> Column:
        if name in self.table.layout.variables:
            return Column.of_variable(self.table, name)
        values = self.table.column(name)
        ends = view(values[self.near(name)], *self.of_prototype(name))
        return Column(values, (), ends, False)

    def draw(self, axes: Axes, first: str, second: str, wide: int) -> None:
        """Draw the tests in the plane of two columns, with the limits and what is beyond them."""
        x, y = self.column(first), self.column(second)
        shown = self.near(first) & self.near(second)
        draw_points(axes, x.places, y.places, self.groups, shown)
        across, up = self.of_prototype(first), self.of_prototype(second)
        if len(across) and len(across) == len(up):
            axes.plot(across, up, **_PROTOTYPE)
        axes.set_xlim(x.ends)
        axes.set_ylim(y.ends)
        for letter, name in (("x", first), ("y", second)):
            _draw_limits(axes, letter, name, self.bounds.get(name, _OPEN))
        labels = (self.table.layout.label_of(first), self.table.layout.label_of(second))
        _label_axes(axes, wide, labels, x.options, whole=x.whole)

    def heading(self, title: str, planes: Sequence[tuple[str, str]]) -> str:
        """Return what is drawn, how many designs there are and which are not seen."""
        failed = self.table.status == "failed"
        facts = [f"{counted(len(self.table), 'design')} tested"]
        facts += [f"{failed.sum()} failed"] if failed.any() else []
        if not all((self.near(a) & self.near(b) | failed).all() for a, b in planes):
            facts.append("those far from the feasible ones, or without a value, outside the axes")
        return f"{title}\n{', '.join(facts)}".strip()


def _draw_bars(axes: Axes, found: Histogram, *, numbers: bool = False, tested: bool = True) -> None:
    """Draw the bars of each group; ``tested`` not where some of the tested are in no bin."""
    edges = found.edges
    width = np.diff(edges)
    top = 1.0
    for group, (name, (start, end), look) in _BARS.items():
        if group == "tested" and not tested:
            continue
        counts = getattr(found, group)
        heights = 100.0 * counts / max(int(counts.sum()), 1)
        top = max(top, heights.max(initial=0))
        bars = axes.bar(
            edges[:-1] + start * width, heights, (end - start) * width, align="edge",
            linewidth=0.5, label=f"{name} ({counts.sum()})", **look,
        )  # fmt: skip
        if numbers and group != "tested" and len(counts) <= _NUMBERED:
            axes.bar_label(bars, [str(n or "") for n in counts], padding=1.5, fontsize=6)
    if len(edges) > 1:
        axes.set_xlim(edges[0], edges[-1])
    axes.set_ylim(0, 1.1 * top)
    axes.set_ylabel("% of each group")


def _draw_limits(axes: Axes, letter: str, name: str, ends: tuple[float, float]) -> None:
    """Shade what is beyond the limits of the quantity on an axis; the view grows up to a limit.

    A limit farther off than half the view is named by the legend only.
    """
    span, line = (axes.axvspan, axes.axvline) if letter == "x" else (axes.axhspan, axes.axhline)
    line_style = {"x": "-.", "y": "--"}[letter]
    style: dict[str, Any] = {
        "color": "0.25", "linewidth": 1.0, "zorder": 4.5, "linestyle": line_style,
    }  # fmt: skip
    for sign, limit in zip("≥≤", ends, strict=True):
        if not np.isfinite(limit):
            continue
        low, high = getattr(axes, f"get_{letter}lim")()
        label = f"limit {literal(name, 24)} {sign} {limit:g}"
        if not low - 0.5 * (high - low) <= limit <= high + 0.5 * (high - low):
            axes.plot([], [], label=f"{label}, outside the axes", **style)
            continue
        pad = 0.05 * (high - low)
        low, high = min(low, limit - pad), max(high, limit + pad)
        getattr(axes, f"set_{letter}lim")(low, high)
        span(*((low, limit) if sign == "≥" else (limit, high)), fc="0.93", linewidth=0, zorder=0)
        line(limit, label=label, **style)


def _label_axes(
    axes: Axes, wide: int, names: tuple[str, str], values: Sequence[object], *, whole: bool = False
) -> None:
    """Write as much text on axes as fits on one of ``wide`` beside each other."""
    axes.set_xlabel(literal(names[0], _LETTERS // wide))
    axes.set_ylabel(_upright(names[1], _UPRIGHT))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    if values:
        name_places(axes, values, letters=_LETTERS // wide)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(max(3, 10 // wide), integer=whole))


def _upright(label: str, most: int) -> str:
    """Return the text of a vertical axis; a unit is on a line of its own where it does not fit."""
    name, bracket, rest = label.partition(" [" if " [" in label else " (max)")
    lines = [name, bracket.strip() + rest] if bracket and len(label) > most else [label]
    return "\n".join(literal(line, most) for line in lines)


def name_places(axes: Axes, values: Sequence[object], *, letters: int) -> None:
    """Name the places 0, 1, … of the horizontal axis; of more than twelve only some."""
    places = list(range(0, len(values), -(-len(values) // 12) or 1))
    names = [literal(values[place], 14) for place in places]
    turned = sum(len(name) + 2 for name in names) > letters
    axes.xaxis.set_ticks(places, names, rotation=90 if turned else 0)
    axes.xaxis.grid(visible=False)


def row_height(wide: int) -> float:
    """Return the height in mm of axes of which ``wide`` are beside each other, the fewer higher."""
    return {1: 60.0, 2: 46.0, 3: 40.0}.get(wide, 33.0)


@contextmanager
def _grid(high: int, wide: int) -> Iterator[tuple[Figure, Any]]:
    with new_figure(34.0 + high * row_height(wide)) as figure:  # 34 mm are for title and legends
        yield figure, figure.subplots(high, wide, squeeze=False)


def _share_axes(grid: Any, *, below: bool = True) -> None:
    """Leave names at the left and below only, and ticks where they are not those of the others."""
    for lines, letter, outer in ((grid, "y", 0), (grid.T if below else [], "x", -1)):
        side = {"x": "labelbottom", "y": "labelleft"}[letter]
        for line in lines:
            shown = [ax for ax in line if ax.axison]
            for ax in shown:
                if ax is not shown[outer]:
                    getattr(ax, f"set_{letter}label")("")
                    own, its = (getattr(one, f"get_{letter}lim")() for one in (ax, shown[outer]))
                    if np.allclose(own, its, rtol=1e-12, atol=0.0):
                        ax.tick_params(**{side: False})


def _legends(
    figure: Figure, grid: Any, tests: _Tests | None = None, marks: Sequence[dict[str, Any]] = ()
) -> None:
    """Put under the axes what bars, marks and limits mean; counts are of the whole table."""
    handles = [handle for ax in grid.ravel() for handle in ax.get_legend_handles_labels()[0]]
    bars = {str(h.get_label()): h for h in handles if isinstance(h, BarContainer)}
    lines = {str(line.get_label()): line for line in handles if isinstance(line, Line2D)}
    if tests is not None:
        looks = [group.look(name) for name, group in tests.groups.items()]
        looks += [_PROTOTYPE] if tests.table.prototype is not None else []
        limits = {label: line for label, line in lines.items() if label.startswith("limit ")}
        lines = {look["label"]: Line2D([], [], **look) for look in [*looks, *marks]} | limits
    text: dict[str, Any] = {"fontsize": 7, "title_fontsize": 7, "alignment": "left"}
    if bars:
        side, ncols = ("left", 1) if lines else ("center", 3)
        title = "histograms, % of each group"
        legend_of(figure, bars, loc=f"outside lower {side}", ncols=ncols, title=title, **text)
    if lines:
        side, ncols = "right" if bars else "center", 3 if max(map(len, lines)) <= 28 else 2
        legend_of(figure, lines, loc=f"outside lower {side}", ncols=ncols, **text)
