"""Test tables and rankings in planes: objectives over variables and in pairs, histograms.

Values are in the original units and direction. Every tested design is in one group; the groups
differ by marker and by lightness. In the place of an objective may be a constraint or an output.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from pymoo_psi._validation import Received, counted, instance, invalid, known_name
from pymoo_psi.errors import PsiError
from pymoo_psi.pareto import EfficiencyRanking, number
from pymoo_psi.plots._style import (
    GREY,
    HUGE,
    MARKERS,
    Drawing,
    Group,
    Marker,
    core,
    draw_points,
    labelled,
    legend_of,
    literal,
    new_figure,
    panels,
    row_height,
    view,
)
from pymoo_psi.table import Histogram, Key, Kind, Layout, Limits, TestTable, bounds_of, histogram

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MATRIX = 6  # variables, and objectives, beside which the text on the axes is still readable
_OPEN = (-np.inf, np.inf)  # no limit
_LETTERS = 90  # of text over the width of a figure, in the size of axis labels
_SPREAD = 0.6  # of the distance between two values
_GOLDEN = 0.6180339887498949  # multiples of it modulo 1 are the evenest sequence
_LINES = 2000  # of a group; more would be one grey area, and take long to draw
_BARE = 60  # lines beyond which those of a group are thin and have no marks
_TEXT = 100  # letters over the width of a figure, in the size of ticks
# Axes of objectives reach beyond the feasible designs and the prototype by this share of their
# range: on those that show every failed design nothing else is seen.
_MARGIN = 1.0

_FEASIBLE, _PARETO = "feasible, dominated", "Pareto optimal"
_GROUPS = {
    "infeasible": Marker(".", GREY, 4.5, level=2.0),
    "beyond the limits": Marker("x", "0.5", 2.4, level=2.1),
    _FEASIBLE: MARKERS[4]._replace(size=2.6),
    _PARETO: Marker("D", "#E69F00", 3.8, level=3.5),
}
_OUTLINE = [withStroke(linewidth=3.0, foreground="white")]  # apart from a crowd
_PROTOTYPE: dict[str, Any] = {
    **MARKERS[6]._replace(size=8.25).look(width=0.7), "path_effects": _OUTLINE, "zorder": 6.0,
    "label": "prototype",
}  # fmt: skip
_CHOSEN: dict[str, Any] = {
    "linestyle": "none", "marker": "o", "markersize": 9.0, "markerfacecolor": "none",
    "markeredgecolor": MARKERS[6].colour, "markeredgewidth": 1.6, "path_effects": _OUTLINE,
    "zorder": 7.0, "label": "proposed or chosen",
}  # fmt: skip
# Of each group of a histogram: its part of a bin, its look.
_BARS: dict[str, tuple[tuple[float, float], dict[str, Any]]] = {
    "tested": ((0.0, 1.0), {"facecolor": "0.9", "edgecolor": "0.55"}),
    "feasible": ((0.08, 0.5), {"facecolor": MARKERS[4].colour}),
    "pareto": (
        (0.5, 0.92), {"facecolor": "#E69F00", "edgecolor": "white", "hatch": "////"},
    ),
}  # fmt: skip


def plot_table(
    table: TestTable,
    limits: Limits | None = None,
    *,
    variables: Sequence[Key] | None = None,
    objectives: Sequence[Key] | None = None,
    title: str = "",
) -> Drawing:
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
        title: What the table is of; begins the caption.

    Raises:
        ArgumentValueError: A column is not in the table, or there is no variable.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1, 3.0], [0.5, 4.0]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> len(plot_table(table, {"f1": 1.5}).axes)
        6
    """
    tests = Tests.of(table, limits)
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
    with panels(len(columns) * (1 + len(rows)), wide) as (figure, axes):
        tops = axes[: len(columns)]
        for j, (top, name) in enumerate(zip(tops, columns, strict=True)):
            found = histogram(table, name, limits=limits)
            _draw_bars(top, found, tested=name not in others)
            label = "% of each group" if j % wide == 0 else ""
            name_axes(top, "" if rows else layout.label_of(name), label, found.values)
            below = axes[j + wide :: wide] if rows else []
            for ax, objective in zip(below, rows, strict=True):
                tests.draw(ax, name, objective)
                ax.label_outer()
            if rows and table.kinds[layout.variable(name)].real:
                top.set_xlim(below[0].get_xlim())  # others have a bin for each value
        for top in tops:
            top.set_ylim(0, max(ax.get_ylim()[1] for ax in tops))
        legend_of(figure, labelled(axes), ncols=3, fontsize=7)
        what = "Histograms: the share of each group that an interval holds."
        what += " Below, objectives against variables." if rows else ""
        figure.describe(title, what, tests.counts([(n, o) for n in columns for o in rows]))
    return figure


def plot_objectives(
    table: TestTable,
    limits: Limits | None = None,
    *,
    objectives: Sequence[Key] | None = None,
    design: int | None = None,
    title: str = "",
) -> Drawing:
    """Return the objectives against each other, each pair once.

    Args:
        table: A test table.
        limits: Limits on columns.
        objectives: Names or indices of two to seven objectives; all by default. Constraints and
            further outputs may be among them, by name.
        design: Number of a test point to be marked, such as the one that was chosen.
        title: What the table is of; begins the caption.

    Raises:
        ArgumentValueError: A column or the design is not in the table, or there are too few or too
            many objectives.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        >>> sum(ax.axison for ax in plot_objectives(table).axes)
        3
    """
    names = _objective_names(objectives, checked(table).layout)
    if not 2 <= len(names) <= MATRIX + 1:
        rule = f"from 2 to {MATRIX + 1} to draw in pairs"
        raise invalid("objectives", rule, len(names), "name those to be drawn")
    if design is not None and design not in table.numbers:
        raise invalid("design", "the number of a test point of the table", design)
    tests = Tests.of(table, limits, table.rows(table.numbers == design))
    with triangle(names) as (figure, pairs, _):
        for (first, second), ax in pairs.items():
            tests.draw(ax, first, second)
        legend_of(figure, labelled(pairs.values()), ncols=3, fontsize=7)
        figure.describe(title, "Objectives in pairs.", tests.counts(list(pairs)))
    return figure


@contextmanager
def triangle(
    names: Sequence[str], below: float = 0.0
) -> Iterator[tuple[Drawing, dict[tuple[str, str], Axes], GridSpec]]:
    """Give a figure with axes for each pair of names, above a row of ``below`` mm; its grid."""
    wide, height = len(names) - 1, row_height(len(names) - 1)
    heights = [height] * wide + [below] * bool(below)
    with new_figure(28.0 + sum(heights)) as figure:
        cells = figure.add_gridspec(len(heights), max(wide, 1), height_ratios=heights)
        pairs = {
            (names[j], names[k + 1]): figure.add_subplot(cells[k, j])
            for k in range(wide)
            for j in range(k + 1)
        }
        yield figure, pairs, cells
        for (first, second), ax in pairs.items():  # names at the left and below only
            if second != names[-1]:
                ax.set_xlabel("")
                ax.tick_params(labelbottom=False)
            if first != names[0]:
                ax.set_ylabel("")
                ax.tick_params(labelleft=False)


def checked(table: object) -> TestTable:
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
        places: ``(n,)`` where the designs are drawn; tests of the same option side by side.
        options: The values at 0, 1, … of a choice or a binary variable; empty for numbers.
        ends: Of the axis.
    """

    places: Array
    options: tuple[Any, ...]
    ends: tuple[float, float]

    @classmethod
    def of_variable(cls, table: TestTable, name: str) -> Column:
        """Return a variable; options and whole numbers have half a step on each side."""
        j = table.layout.variable(name)
        kind, cells = table.kinds[j], table.X[:, j]
        if not kind.real and kind is not Kind.INTEGER:
            options = sorted({*cells.tolist()}, key=str)
            index = {option: k for k, option in enumerate(options)}
            places = np.array([index[cell] for cell in cells.tolist()], np.float64)
            aside = _SPREAD * (table.numbers.astype(np.float64) * _GOLDEN % 1 - 0.5)
            return cls(places + aside, tuple(options), (-0.5, len(options) - 0.5))
        bounds = [b for b in (table.layout.lower[j], table.layout.upper[j]) if np.isfinite(b)]
        x = cells.astype(np.float64)
        known = np.array([*x, *bounds])
        if kind is Kind.INTEGER and len(x) and np.ptp(known) <= 30:
            return cls(x, (), (known.min() - 0.5, known.max() + 0.5))
        if kind is Kind.LOG:
            low, high = view(np.log(x), *np.log(bounds))
            return cls(x, (), (float(np.exp(low)), float(np.exp(high))))
        return cls(x, (), view(x, *bounds))


@dataclass(frozen=True, eq=False)
class Tests:
    """The tests of a table as they are drawn under limits."""

    table: TestTable
    bounds: dict[str, tuple[float, float]]
    groups: dict[str, Group]
    marked: tuple[tuple[TestTable, dict[str, Any]], ...]

    @classmethod
    def of(cls, table: TestTable, limits: Limits | None, chosen: TestTable | None = None) -> Tests:
        kept, front = checked(table).feasible(limits), table.pareto(limits)
        masks = (table.status == "infeasible", (table.status == "ok") & ~kept, kept & ~front, front)
        groups = {
            name: Group(np.flatnonzero(mask), marker)
            for (name, marker), mask in zip(_GROUPS.items(), masks, strict=True)
            if mask.any() or name in (_FEASIBLE, _PARETO)
        }
        pairs = ((table.prototype, _PROTOTYPE), (chosen, _CHOSEN))
        marked = tuple((designs, look) for designs, look in pairs if designs is not None)
        return cls(table, dict(bounds_of(limits, table.layout)), groups, marked)

    def of_marked(self, name: str) -> list[Array]:
        """Return the values of prototypes and of the chosen design in a column of numbers."""
        found = []
        for designs, _ in self.marked:
            try:
                values = designs.column(name).astype(np.float64)
            except (PsiError, ValueError):  # there is no such column; a choice
                values = np.zeros(0)
            found.append(values if np.isfinite(values).all() else np.zeros(0))
        return found

    @cached_property
    def _core(self) -> NDArray[np.intp]:
        return np.concatenate([self.groups[_FEASIBLE].rows, self.groups[_PARETO].rows])

    def near(self, name: str) -> Mask:
        """``(n,)`` which tests are near the feasible and the marked ones in a column.

        Of a variable all are. A column in which the feasible ones do not differ leaves none out.
        """
        if name in self.table.layout.variables:
            return np.ones(len(self.table), dtype=bool)
        values = self.table.column(name)
        known: Mask = np.abs(values) < HUGE
        inner = np.concatenate([core(values[self._core]), *self.of_marked(name)])
        low, high = inner.min(initial=np.inf), inner.max(initial=-np.inf)
        if high > low:  # also refuses the infinities of no such tests
            wider = _MARGIN * (high - low)
            known &= (values >= low - wider) & (values <= high + wider)
        return known

    def column(self, name: str) -> Column:
        if name in self.table.layout.variables:
            return Column.of_variable(self.table, name)
        values = self.table.column(name)
        ends = view(values[self.near(name)], *np.concatenate([[], *self.of_marked(name)]))
        return Column(values, (), ends)

    def draw(self, axes: Axes, first: str, second: str) -> None:
        """Draw the tests in the plane of two columns, with the limits and what is beyond them."""
        x, y = self.column(first), self.column(second)
        shown = self.near(first) & self.near(second)
        draw_points(axes, x.places, y.places, self.groups, shown)
        places = zip(self.of_marked(first), self.of_marked(second), self.marked, strict=True)
        for across, up, (_, look) in places:
            if len(across) and len(across) == len(up):
                axes.plot(across, up, **look)
        axes.set(xlim=x.ends, ylim=y.ends)
        for letter, name in (("x", first), ("y", second)):
            if self.table.layout.is_log(name):
                axes.set(**{f"{letter}scale": "log"})
            _draw_limits(axes, letter, name, self.bounds.get(name, _OPEN))
        layout = self.table.layout
        name_axes(axes, layout.label_of(first), layout.label_of(second), x.options)
        if y.options:
            axes.set_yticks(range(len(y.options)), [literal(name, 14) for name in y.options])

    def counts(self, planes: Sequence[tuple[str, str]]) -> str:
        """Return how many designs there are and how many are not seen."""
        failed, columns = self.table.status == "failed", {name for pair in planes for name in pair}
        seen = np.ones(len(self.table), dtype=bool)
        for name in columns:
            low, high = self.column(name).ends
            places = self.column(name).places
            seen &= self.near(name) & (places >= low) & (places <= high)
        facts = [f"{counted(len(self.table), 'design')} tested"]
        facts += [f"{failed.sum()} failed"] if failed.any() else []
        if n := int((~seen & ~failed).sum()):
            facts.append(f"{n} far from the others outside of the axes")
        return f"{', '.join(facts)}."


def _draw_bars(axes: Axes, found: Histogram, *, tested: bool) -> None:
    """Draw the bars of each group; ``tested`` not where some of the tested are in no bin."""
    edges, width = found.edges, np.diff(found.edges)
    if len(width) > 1 and not np.allclose(width, width[0]):  # of a logarithmic scale
        axes.set_xscale("log")
    for group, ((start, end), look) in _BARS.items():
        if group == "tested" and not tested:
            continue
        counts = getattr(found, group)
        heights = 100.0 * counts / max(int(counts.sum()), 1)
        axes.bar(
            edges[:-1] + start * width, heights, (end - start) * width, align="edge",
            linewidth=0.5, label=f"bars: {group.replace('pareto', _PARETO)} ({counts.sum()})",
            **look,
        )  # fmt: skip
    if len(edges) > 1:
        axes.set_xlim(edges[0], edges[-1])


def _draw_limits(axes: Axes, letter: str, name: str, ends: tuple[float, float]) -> None:
    """Shade what is beyond the limits of the quantity on an axis; the legend names them."""
    span, line = (axes.axvspan, axes.axvline) if letter == "x" else (axes.axhspan, axes.axhline)
    style: dict[str, Any] = {"linestyle": {"x": "-.", "y": "--"}[letter], "zorder": 4.5}
    low, high = getattr(axes, f"get_{letter}lim")()
    for sign, limit, beyond in zip("≥≤", ends, (low, high), strict=True):
        if np.isfinite(limit):
            span(*sorted((limit, beyond)), fc="0.93", linewidth=0, zorder=0)
            label = f"limit {literal(name, 24)} {sign} {number(limit, 6)}"
            line(limit, label=label, color="0.25", linewidth=1.0, **style)
    getattr(axes, f"set_{letter}lim")(low, high)


def name_axes(axes: Axes, x: str, y: str, options: Sequence[object] = ()) -> None:
    """Write as much text on axes as fits beside the others; options are at 0, 1 and so on."""
    grid = axes.get_gridspec()
    letters = _LETTERS // (grid.ncols if grid else 1)
    axes.set_xlabel(literal(x, letters))
    axes.set_ylabel(literal(y, 22))
    if axes.get_xscale() == "linear":
        axes.locator_params(axis="x", nbins=4)
    if axes.get_yscale() == "linear":
        axes.locator_params(axis="y", nbins=4)
    if options:
        places = range(0, len(options), -(-len(options) // 12))
        names = [literal(options[place], 14) for place in places]
        upright = sum(len(name) + 2 for name in names) > letters
        axes.set_xticks(places, names, rotation=90 if upright else 0)
        axes.xaxis.grid(visible=False)


# Any ranked Pareto set


def plot_ranking(
    ranking: EfficiencyRanking,
    *,
    units: Mapping[Any, str] | None = None,
    title: str = "",
    pairs: bool = True,
    row: int | None = None,
) -> Drawing:
    """Return the Pareto-optimal designs of a ranking, with ranks and the Salukvadze optimum.

    Up to seven objectives are drawn in pairs. Below, or alone, are parallel coordinates: a line for
    each design, from the best value of each objective at the bottom to the worst of the Pareto set.
    A value far from all others is outside of the axes; the caption says how many are.

    Args:
        ranking: From :func:`pymoo_psi.rank_of_efficiency` or ``table.ranking()``.
        units: Units of objectives by name, such as ``table.layout.units``.
        title: What the designs are; begins the caption.
        pairs: Whether to draw pairs; parallel coordinates only if not.
        row: A design whose line is marked, such as the chosen one.

    Raises:
        ArgumentTypeError: ``ranking`` is none.

    Example:
        >>> from pymoo_psi import rank_of_efficiency
        >>> figure = plot_ranking(rank_of_efficiency([[1, 5], [2, 2], [5, 1]]))
        >>> [ax.get_ylabel() for ax in figure.axes]
        ['f2', 'share of the range (0 is best)']
    """
    instance("ranking", ranking, EfficiencyRanking, "rank_of_efficiency(F) gives one")
    headings = ranking.objectives.headings({} if units is None else units)
    values, groups = ranking.objectives.values, rank_groups(ranking)
    few = pairs and len(headings) <= MATRIX + 1
    front = ranking.pareto if row is None else ranking.pareto | (np.arange(len(values)) == row)
    with triangle(
        headings if few else headings[:1], below=60.0 if len(headings) <= MATRIX else 90.0
    ) as (figure, planes, cells):
        for (first, second), ax in planes.items():
            x, y = (values[:, headings.index(name)] for name in (first, second))
            draw_points(ax, x, y, groups, ranking.pareto)
            ax.set(xlim=view(x[front]), ylim=view(y[front]))
            name_axes(ax, first, second)
        below = figure.add_subplot(cells[-1, :])
        clipped = _draw_parallel(below, ranking, groups, headings, row)
        looks = [group.look(name) for name, group in groups.items()]
        entries = {look["label"]: Line2D([], [], **look) for look in looks}
        legend_of(figure, entries | labelled([below]), ncols=3)
        optimal = counted(int(ranking.pareto.sum()), "Pareto-optimal design")
        shown = f"{optimal} of {len(values)}, by rank of efficiency, each a line from the best to "
        shown += "the worst value of every objective."
        out = f"{counted(clipped, 'design')} far from the others outside of the axes."
        figure.describe(title, shown, *([out] if clipped else []))
    return figure


def rank_groups(ranking: EfficiencyRanking) -> dict[str, Group]:
    """Return the Pareto-optimal designs by rank of efficiency; the Salukvadze optimum by itself."""
    optimum = np.zeros(len(ranking.rank), dtype=bool)
    optimum[ranking.salukvadze] = True
    free = ranking.pareto & ~optimum
    groups = {
        f"rank {rank}" if rank else "unranked": Group(
            np.flatnonzero(free & (ranking.rank == rank)), MARKERS[rank]
        )
        for rank in (0, 3, 4, 5)
    }
    # Of several optima, equally near to U, none may have rank 6.
    rank = " (rank 6)" if (ranking.rank == 6).any() else ""
    groups[f"Salukvadze optimum{rank}"] = Group(np.flatnonzero(optimum), MARKERS[6])
    return {name: group for name, group in groups.items() if len(group.rows)}


def near_ranked(
    values: NDArray[np.float64], groups: Mapping[str, Group], margin: float = 0.15
) -> NDArray[np.bool_]:
    """``(n,)`` which points lie in the smallest box around the ranked ones, widened by a share."""
    core = values[np.concatenate([g.rows for name, g in groups.items() if name != "unranked"])]
    low, high = core.min(axis=0), core.max(axis=0)
    wider = margin * (high - low)
    inside: NDArray[np.bool_] = ((values >= low - wider) & (values <= high + wider)).all(axis=1)
    return inside


def _draw_parallel(
    axes: Axes,
    ranking: EfficiencyRanking,
    groups: Mapping[str, Group],
    headings: list[str],
    marked: int | None,
) -> int:
    """Draw a line for each design through its objectives, each from its best to its worst value.

    Returns:
        How many designs have a value outside of the axes.
    """
    values, sign = ranking.objectives.values, ranking.objectives.sign
    # Ends without those far away, which are worst where the objective is minimised.
    front = (values[ranking.pareto] * sign).T
    inner = [found if len(found := core(column)) else column for column in front]
    ideal, nadir = np.array([[np.min(column), np.max(column)] for column in inner]).T * sign
    shares = (values - ideal) / np.where(nadir == ideal, 1.0, nadir - ideal)
    place = np.arange(len(headings))
    for group in groups.values():
        rows = group.rows[:: -(-len(group.rows) // _LINES)]
        many, best = len(group.rows) > _BARE, group.marker is MARKERS[6]
        lines = LineCollection(
            [np.column_stack([place, share]) for share in shares[rows]],
            colors=group.marker.colour, linewidths=2.0 if best else 0.4 if many else 1.0,
            alpha=0.5 if many else 1.0, zorder=group.marker.level, rasterized=many,
        )  # fmt: skip
        axes.add_collection(lines)
    if marked is not None and marked not in ranking.salukvadze:
        look: dict[str, Any] = {"linewidth": 2.0, "color": "black", "linestyle": "--"}
        axes.plot(
            place,
            shares[marked],
            label="proposed or chosen",
            zorder=7.0,
            marker="o",
            markersize=4.0,
            **look,
        )
    axes.set_xlim(-0.4, len(place) - 0.6)
    axes.set_ylim(-0.05, 1.05)
    ends = zip(headings, *(map(number, column.tolist()) for column in (ideal, nadir)), strict=True)
    labels = [f"{literal(name, 30)}\nbest {low}\nworst {high}" for name, low, high in ends]
    longest = max(len(line) for label in labels for line in label.split("\n"))
    axes.set_xticks(place, labels, rotation=90 if (longest + 2) * len(labels) > _TEXT else 0)
    axes.set_ylabel("share of the range (0 is best)")
    drawn = shares[ranking.pareto]
    return int(((drawn < -0.05) | (drawn > 1.05)).any(axis=1).sum())
