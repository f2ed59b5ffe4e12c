"""Designs as points: the one way in which a plane of two columns is drawn.

Every design is in one group; the groups differ by marker and by lightness.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from pymoo_psi._validation import counted, instance
from pymoo_psi.pareto import EfficiencyRanking, number
from pymoo_psi.plots._style import literal, view
from pymoo_psi.table import Kind, TestTable, value_ranks

Array = NDArray[np.float64]

GREY = "0.68"  # a share of white, in matplotlib's notation
ORANGE, BLUE = "#E69F00", "#4292C6"
_LETTERS = 90  # of text over the width of a figure, in the size of axis labels
_SPREAD = 0.6  # of the distance between two options
_GOLDEN = 0.6180339887498949  # multiples of it modulo 1 are the evenest sequence
_MANY = 200  # from here on the markers of a group shrink
_RASTERIZED = 1000  # markers that would fill a file of a vector format, drawn one by one
_OPEN = (-np.inf, np.inf)  # no limit


class Group(NamedTuple):
    """Designs that are drawn alike: their rows, and a marker with its diameter in points.

    Of two groups the one of the higher level is on top.
    """

    rows: NDArray[np.intp]
    shape: str
    colour: str
    size: float
    level: float

    def look(self, name: str) -> dict[str, Any]:
        """Return the arguments of ``plot``; the larger the group, the smaller its markers."""
        n = len(self.rows)
        shrink = float(np.clip((_MANY / max(n, 1)) ** 0.3, 0.3, 1.0))
        # Edges of many would cover the others; a cross has no other colour than its edge.
        edge = "none" if n > _MANY or self.shape == "." else "black"
        return {
            "linestyle": "none",
            "marker": self.shape,
            "markersize": self.size * shrink,
            "markerfacecolor": self.colour,
            "markeredgecolor": self.colour if self.shape == "x" else edge,
            "markeredgewidth": 0.5 * shrink,
            "zorder": self.level,
            "label": f"{name} ({n})",
            "rasterized": n > _RASTERIZED,
        }


# By rank, the rarer ranks on top; ranks 1 and 2 do not occur.
MARKERS: dict[int, tuple[str, str, float, float]] = {
    0: (".", GREY, 4.5, 2.0),
    3: ("^", "#9ECAE1", 5.0, 4.0),
    4: ("s", BLUE, 3.4, 3.0),
    5: ("D", "#08519C", 5.0, 5.0),
    6: ("*", "#D55E00", 11.0, 6.0),
}
_INFEASIBLE, _BEYOND, _DOMINATED = "infeasible", "beyond the limits", "feasible, dominated"
PARETO = "Pareto optimal"
_GROUPS = {
    _INFEASIBLE: (".", GREY, 4.5, 2.0),
    _BEYOND: ("x", "0.5", 2.4, 2.1),
    _DOMINATED: ("s", BLUE, 2.6, 3.0),
    PARETO: ("D", ORANGE, 3.8, 3.5),
}
_CHOSEN: dict[str, Any] = {
    "linestyle": "none", "marker": "o", "markersize": 9.0, "markerfacecolor": "none",
    "markeredgecolor": "#D55E00", "markeredgewidth": 1.6, "zorder": 7.0,
    "path_effects": [withStroke(linewidth=3.0, foreground="white")],  # apart from a crowd
    "label": "proposed or chosen",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Column:
    """The values of a column as places on an axis.

    Attributes:
        places: ``(n,)`` where the designs are drawn; tests of the same option side by side.
        ends: Of the axis.
        label: Name and unit.
        options: The values at 0, 1, … of a choice or a binary variable; empty for numbers.
        log: Whether the axis is logarithmic.
        limits: The lower and the upper one.
        name: Of the limits in the legend.
        mark: Place of the chosen design; NaN if there is none.
    """

    places: Array
    ends: tuple[float, float]
    label: str = ""
    options: tuple[Any, ...] = ()
    log: bool = False
    limits: tuple[float, float] = _OPEN
    name: str = ""
    mark: float = np.nan

    @property
    def seen(self) -> NDArray[np.bool_]:
        """``(n,)`` which designs are within the ends of the axis."""
        return (self.places >= self.ends[0]) & (self.places <= self.ends[1])

    def place_on(self, axes: Axes, letter: str) -> None:
        """Give an axis its ends, scale, texts, and shade what is beyond the limits."""
        scale = "log" if self.log else "linear"
        axes.set(**{f"{letter}lim": self.ends, f"{letter}scale": scale})
        span, line = (axes.axvspan, axes.axvline) if letter == "x" else (axes.axhspan, axes.axhline)
        style: dict[str, Any] = {"linestyle": {"x": "-.", "y": "--"}[letter], "zorder": 4.5}
        for sign, limit, end in zip("≥≤", self.limits, self.ends, strict=True):
            if np.isfinite(limit):
                span(*sorted((limit, end)), fc="0.93", linewidth=0, zorder=0)
                label = f"limit {literal(self.name, 24)} {sign} {number(limit, 6)}"
                line(limit, label=label, color="0.25", linewidth=1.0, **style)
        name_axis(axes, letter, self.label, self.options)


def name_axis(axes: Axes, letter: str, label: str, options: Sequence[object] = ()) -> None:
    """Write as much text on an axis as fits beside others; options are at 0, 1 and so on."""
    grid = axes.get_gridspec()
    letters = _LETTERS // (grid.ncols if grid else 1)
    axes.set(**{f"{letter}label": literal(label, letters if letter == "x" else 22)})
    axis = axes.xaxis if letter == "x" else axes.yaxis
    if options:
        places = range(0, len(options), -(-len(options) // 12))
        names = [literal(options[place], 14) for place in places]
        upright = letter == "x" and sum(len(name) + 2 for name in names) > letters
        axis.set_ticks(places, names, rotation=90 if upright else 0)
        axis.grid(visible=False)
    elif axis.get_scale() == "linear":
        few = 3 if letter == "x" and letters < 20 else 4  # ticks, with texts beside each other
        axes.locator_params(axis=letter, nbins=few)  # type: ignore[arg-type]  # "x" or "y"


@dataclass(frozen=True, eq=False)
class Points:
    """Designs in planes of two of their columns.

    Attributes:
        columns: By name.
        groups: By name.
    """

    columns: Mapping[str, Column]
    groups: Mapping[str, Group]

    def draw(self, axes: Axes, first: str, second: str) -> None:
        """Draw the designs over two columns, with the limits and what is beyond them."""
        x, y = self.columns[first], self.columns[second]
        seen = x.seen & y.seen
        for name, group in self.groups.items():
            rows = group.rows[seen[group.rows]]
            axes.plot(x.places[rows], y.places[rows], **group.look(name))
        if not np.isnan(x.mark):
            axes.plot(x.mark, y.mark, **_CHOSEN)
        x.place_on(axes, "x")
        y.place_on(axes, "y")

    def counts(self, table: TestTable) -> str:
        """Return how many designs there are, and how many are not seen."""
        failed, out = table.status == "failed", np.zeros(len(table), dtype=bool)
        for column in self.columns.values():
            out |= ~column.seen
        n = int(failed.sum())
        facts = f"{counted(len(table), 'design')} tested{f', {n} failed' * bool(n)}."
        far = int((out & ~failed).sum())
        more = f" {counted(far, 'design')} far from the others outside of the axes." if far else ""
        return facts + more


def checked(table: object) -> TestTable:
    """Return what is a test table."""
    remedy = "PSI and investigate give one, TestTable.of(...) makes one of arrays"
    return instance("table", table, TestTable, remedy)


def points_of_table(
    table: TestTable, names: Sequence[str], chosen: TestTable | None = None
) -> Points:
    """Return the tests over columns, with a chosen design."""
    feasible, front, layout = table.feasible(), table.pareto(), table.layout
    meets_constraints = table.under(limits={}).feasible()
    violates = ~meets_constraints & (table.status != "failed")
    masks = (violates, meets_constraints & ~feasible, feasible & ~front, front)
    groups = {
        name: Group(np.flatnonzero(mask), *marker)
        for (name, marker), mask in zip(_GROUPS.items(), masks, strict=True)
        if mask.any() or name in (_DOMINATED, PARETO)
    }
    bounds = table.limits

    def column(name: str) -> Column:
        label, log, limited = layout.label_of(name), layout.is_log(name), bounds.get(name, _OPEN)
        if name in layout.variables:
            places, ends, options = _variable(table, name)
            return Column(places, ends, label, options, log, limited, name)
        places = table.column(name)
        mark = np.nan if chosen is None else float(chosen.column(name)[0])
        inner = places[feasible] if len(np.unique(places[feasible])) > 1 else places
        low, high = view(inner, mark)
        # Beyond the feasible designs by their range: on axes that show every failed design nothing
        # else is seen.
        near = (places >= low - (high - low)) & (places <= high + (high - low))
        return Column(places, view(places[near], mark), label, (), log, limited, name, mark)

    return Points({name: column(name) for name in names}, groups)


def _variable(table: TestTable, name: str) -> tuple[Array, tuple[float, float], tuple[Any, ...]]:
    """Return places, ends and options; options and whole numbers have half a step on each side."""
    j = table.layout.variable(name)
    kind, cells = table.kinds[j], table.X[:, j]
    if not kind.real and kind is not Kind.INTEGER:
        options, places = value_ranks(cells)
        aside = _SPREAD * (table.numbers.astype(np.float64) * _GOLDEN % 1 - 0.5)
        return places + aside, (-0.5, len(options) - 0.5), tuple(options)
    x = cells.astype(np.float64)
    bounds = [b for b in (table.layout.lower[j], table.layout.upper[j]) if np.isfinite(b)]
    known = np.array([*x, *bounds])
    if kind is Kind.INTEGER and len(x) and np.ptp(known) <= 30:
        return x, (known.min() - 0.5, known.max() + 0.5), ()
    if kind is Kind.LOG:
        low, high = np.exp(view(np.log(x), *np.log(bounds))).tolist()
        return x, (low, high), ()
    return x, view(x, *bounds), ()


def ranked_groups(ranking: EfficiencyRanking) -> dict[str, Group]:
    """Return the Pareto-optimal designs by rank of efficiency; the Salukvadze optimum by itself."""
    optimum = np.zeros(len(ranking.rank), dtype=bool)
    optimum[ranking.salukvadze] = True
    free = ranking.pareto & ~optimum
    # Of several optima, equally near to U, none may have rank 6.
    top = f"Salukvadze optimum{' (rank 6)' * bool((ranking.rank == 6).any())}"
    masks = {rank: free & (ranking.rank == rank) for rank in (0, 3, 4, 5)} | {6: optimum}
    names = {0: "unranked", 6: top}
    return {
        names.get(rank, f"rank {rank}"): Group(np.flatnonzero(mask), *MARKERS[rank])
        for rank, mask in masks.items()
        if mask.any()
    }
