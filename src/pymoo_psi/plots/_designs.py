"""The tested designs of a table in a plane: a criterion against a variable or another criterion.

What is drawn of a criterion is in its own sense. In the place of a criterion may be a constraint
or an output.

Every tested design is in one group. The groups differ by marker and by lightness, so that a grey
print tells them apart; the larger a group, the smaller its markers and the lower it lies, so that
the many do not hide the few.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pymoo_psi._markers import GREY, MARKERS, Marker
from pymoo_psi._validation import instance
from pymoo_psi.plots._style import HUGE, literal, view
from pymoo_psi.table import Kind, Limits, TestTable, bounds_of, column_kinds, value_ranks

Array = NDArray[np.float64]

INFEASIBLE, BEYOND = "infeasible", "beyond the limits"
FEASIBLE, PARETO = "feasible, dominated", "Pareto optimal"

# Violates a constraint; violates a limit only; keeps all; keeps all and is not dominated.
GROUPS: dict[str, Marker] = {
    INFEASIBLE: Marker(".", GREY, 4.5, level=2.0),
    BEYOND: Marker("x", "0.5", 2.4, level=2.1),
    FEASIBLE: MARKERS[4]._replace(size=2.55),
    PARETO: MARKERS[5]._replace(size=3.75),
}
_PROTOTYPE = MARKERS[6]._replace(size=8.25)

_OPEN = (-np.inf, np.inf)  # no limit
_LIMIT_STYLES = {"x": "-.", "y": "--"}
_LETTERS = 90  # of text over the width of a page, in the size of axis labels
_UPRIGHT = 18  # letters over the height of axes, likewise
_MANY = 200  # from here on the markers of a group shrink, down to a fifth
_RASTERIZED = 2000  # markers that a vector format would draw one by one, slowly
_SPREAD = 0.6  # of the distance between two values
_GOLDEN = 0.6180339887498949  # multiples of it modulo 1 are the evenest sequence


def checked_table(table: object) -> TestTable:
    """Return what is to be drawn; it must be a test table."""
    remedy = "PSI and investigate give one, TestTable.of(...) makes one of arrays"
    return instance("table", table, TestTable, remedy)


def design_groups(table: TestTable, limits: Limits | None) -> NDArray[np.str_]:
    """``(n,)`` the group of each design; empty for the failed."""
    names = {"ok": BEYOND, "infeasible": INFEASIBLE, "failed": ""}
    group = np.full(len(table), "", dtype=f"<U{max(map(len, GROUPS))}")
    for status, name in names.items():
        group[table.status == status] = name
    group[table.feasible(limits)] = FEASIBLE
    group[table.pareto(limits)] = PARETO
    return group


def members_of(group: NDArray[np.str_]) -> dict[str, NDArray[np.intp]]:
    """Return the indices of the designs of each group; feasible ones also if there is none."""
    members = {name: np.flatnonzero(group == name) for name in GROUPS}
    kept = (FEASIBLE, PARETO)
    return {name: rows for name, rows in members.items() if len(rows) or name in kept}


@dataclass(frozen=True, eq=False)
class Plane:
    """Tested designs in the plane of a variable or criterion and a criterion.

    Attributes:
        names: What is on the horizontal and on the vertical axis.
        labels: The same with units, for the axes.
        abscissa: What is on the horizontal axis: a "criterion", a "real" or "integer" variable,
            or an "option", which is a choice or a boolean.
        options: The values of an "option", in order; empty for numbers.
        box: Lower and upper bound of the variable; NaN where there is none.
        numbers: ``(n,)`` numbers of the test points; those that failed are left out.
        values: ``(n, 2)`` the designs, an "option" by its index in ``options``.
        group: ``(n,)`` one of ``GROUPS``.
        limits: The least and the greatest value allowed of each quantity; infinite where open.
        prototype: ``(k, 2)`` the k existing designs.
    """

    names: tuple[str, str]
    labels: tuple[str, str]
    abscissa: Literal["criterion", "real", "integer", "option"]
    options: tuple[Any, ...]
    box: tuple[float, float]
    numbers: NDArray[np.int64]
    values: Array
    group: NDArray[np.str_]
    limits: tuple[tuple[float, float], tuple[float, float]]
    prototype: Array

    def nearby(self, margin: float) -> Plane:
        """Return the designs whose criteria are near those of the feasible and of the prototype.

        They reach beyond the range of these by the share ``margin`` of it on each side. A
        criterion in which these do not differ leaves no design out.
        """
        core = np.vstack([self.values[np.isin(self.group, (FEASIBLE, PARETO))], self.prototype])
        inside = np.ones(len(self.values), dtype=bool)
        # A variable has its box, which is shown whole.
        for k in (0, 1) if self.abscissa == "criterion" else (1,):
            low, high = core[:, k].min(initial=np.inf), core[:, k].max(initial=-np.inf)
            if high > low:  # also refuses the infinities of an empty core
                wider = margin * (high - low)
                inside &= (self.values[:, k] >= low - wider) & (self.values[:, k] <= high + wider)
        return replace(
            self,
            numbers=self.numbers[inside],
            values=self.values[inside],
            group=self.group[inside],
        )

    @property
    def is_spread(self) -> bool:
        """Whether the variable takes single values, with room between them."""
        x = self.values[:, 0]
        return self.abscissa == "option" or (
            self.abscissa == "integer" and len(x) > 0 and float(np.ptp(x)) <= 30
        )

    def places(self) -> Array:
        """``(n, 2)`` where the designs are drawn: those with the same single value side by side."""
        places = self.values.copy()
        if self.is_spread:
            places[:, 0] += aside(self.numbers)
        return places


def aside(numbers: NDArray[np.int64]) -> Array:
    """``(n,)`` how far from their place tests of the same single value are drawn.

    It follows from the ``(n,)`` numbers of the test points, so that a picture can be repeated.
    """
    return _SPREAD * (numbers.astype(np.float64) * _GOLDEN % 1 - 0.5)


def criteria_plane(
    table: TestTable, first: str, second: str, limits: Limits | None, group: NDArray[np.str_]
) -> Plane:
    """Return the designs in the plane of two criteria.

    Args:
        table: A test table.
        first: The criterion on the horizontal axis.
        second: The one on the vertical axis.
        limits: Limits on columns.
        group: From :func:`design_groups`, under these limits.
    """
    x, x_at = table.column(first), _of_prototype(table, first)
    return _plane(table, (first, second), limits, group, abscissa="criterion", x=x, x_at=x_at)


def variable_plane(
    table: TestTable, variable: int, criterion: str, limits: Limits | None, group: NDArray[np.str_]
) -> Plane:
    """Return the designs in the plane of a variable, horizontal, and a criterion, likewise."""
    layout, at = table.layout, table.prototype
    column = table.X[:, variable].tolist() + ([] if at is None else at.X[:, variable].tolist())
    objects = np.array(column, dtype=object)
    kind = column_kinds(objects[:, None])[0] if column else Kind.REAL
    options: tuple[Any, ...] = ()
    if kind not in (Kind.REAL, Kind.INTEGER):
        values, ranks = value_ranks(objects)
        options, column = tuple(values), ranks.tolist()
    n = len(table)
    return _plane(
        table, (layout.variables[variable], criterion), limits, group,
        abscissa="option" if options else "integer" if kind is Kind.INTEGER else "real",
        x=np.array(column[:n], dtype=np.float64), x_at=column[n:], options=options,
        box=(float(layout.lower[variable]), float(layout.upper[variable])),
    )  # fmt: skip


def _plane(
    table: TestTable,
    names: tuple[str, str],
    limits: Limits | None,
    group: NDArray[np.str_],
    *,
    abscissa: Literal["criterion", "real", "integer", "option"],
    x: Array,
    x_at: Sequence[float],
    options: tuple[Any, ...] = (),
    box: tuple[float, float] = (np.nan, np.nan),
) -> Plane:
    layout = table.layout
    values = np.column_stack([x, table.column(names[1])])
    drawn = (np.abs(values) < HUGE).all(axis=1) & (group != "")
    y_at = _of_prototype(table, names[1])
    at = np.column_stack([x_at, y_at] if len(x_at) and len(y_at) else [[], []]).astype(np.float64)
    bounds = bounds_of(limits, layout)
    return Plane(
        names=names,
        labels=(layout.label_of(names[0]), layout.label_of(names[1])),
        abscissa=abscissa,
        options=options,
        box=box,
        numbers=table.numbers[drawn],
        values=values[drawn],
        group=group[drawn],
        limits=(bounds.get(names[0], _OPEN), bounds.get(names[1], _OPEN)),
        prototype=at[np.isfinite(at).all(axis=1)],
    )


def _of_prototype(table: TestTable, name: str) -> list[float]:
    """Return the values of an objective or constraint of existing designs, if there are any."""
    at, layout = table.prototype, table.layout
    known = at is not None and name in layout.objectives + layout.constraints
    return at.column(name).tolist() if at is not None and known else []


def group_look(group: str, count: int) -> dict[str, Any]:
    """Return how the line of a group of ``count`` designs looks, with its label."""
    marker = GROUPS[group]
    # With 0.5 all groups would cover the same area, and single markers soon be too small.
    shrink = min(1.0, max(0.2, (_MANY / max(count, 1)) ** 0.3))
    look = marker._replace(size=marker.size * shrink).look
    edge = marker.colour if marker.shape == "x" else "none"
    return {
        **(look("black", 0.5 * shrink) if group == PARETO else look(edge)),
        "zorder": 3.0 + 1.0 / (1 + count),  # the rarer on top
        "label": f"{group} ({count})",
        "rasterized": count > _RASTERIZED,
    }


def prototype_look(name: str) -> dict[str, Any]:
    """Return how the prototype looks, on top of every group, with its label."""
    return {
        **_PROTOTYPE.look(width=0.7),
        "path_effects": [withStroke(linewidth=3.0, foreground="white")],  # apart from a crowd
        "zorder": _PROTOTYPE.level,
        "label": "prototype" if name in ("prototype", "") else f"prototype: {literal(name)}",
    }


def design_look() -> dict[str, Any]:
    """Return how the design that was chosen looks, above all others, with its label."""
    return {
        "linestyle": "none",
        "marker": "o",
        "markersize": 9.0,
        "markerfacecolor": "none",
        "markeredgecolor": _PROTOTYPE.colour,
        "markeredgewidth": 1.6,
        "path_effects": [withStroke(linewidth=3.0, foreground="white")],
        "zorder": _PROTOTYPE.level + 1,
        "label": "chosen design",
    }


def draw_plane(
    axes: Axes, plane: Plane, wide: int, ends: Sequence[tuple[float, float]] = ()
) -> None:
    """Draw the designs, each group with a marker of its own, the limits with what is beyond them.

    Args:
        axes: The axes.
        plane: The designs.
        wide: How many axes are beside each other on a page, and have text for that room.
        ends: Of the horizontal and the vertical axis; those of the designs unless given.
    """
    places = plane.places()
    for name, members in members_of(plane.group).items():
        axes.plot(*places[members].T, **group_look(name, len(members)))
    if len(plane.prototype):
        axes.plot(*plane.prototype.T, **prototype_look(""))
    drawn = np.vstack([places, plane.prototype])
    across, up = ends or (_ends(plane, drawn[:, 0]), view(drawn[:, 1]))
    axes.set_xlim(across)
    axes.set_ylim(up)
    for letter, name, limit in zip("xy", plane.names, plane.limits, strict=True):
        draw_limits(axes, letter, name, limit)
    label_axes(axes, wide, plane.labels, plane.options, whole=plane.abscissa == "integer")


def _ends(plane: Plane, x: Array) -> tuple[float, float]:
    """Return the ends of the horizontal axis; single values have half a step on each side."""
    if plane.options:
        return -0.5, len(plane.options) - 0.5
    if plane.is_spread:
        known = np.array([*x, *plane.box])
        known = np.rint(known[np.isfinite(known)])
        return float(known.min()) - 0.5, float(known.max()) + 0.5
    return view(x, *plane.box)


def label_axes(
    axes: Axes, wide: int, names: tuple[str, str], values: Sequence[object], *, whole: bool = False
) -> None:
    """Write as much text on axes as there is room for on one of ``wide`` beside each other.

    Args:
        axes: The axes.
        wide: How many there are beside each other.
        names: What is on the horizontal and on the vertical axis.
        values: What the places 0, 1, … of the horizontal axis are; none for numbers.
        whole: The numbers are integers.
    """
    axes.set_xlabel(literal(names[0], _LETTERS // wide))
    axes.set_ylabel(upright(names[1], _UPRIGHT))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    if values:
        name_places(axes, values, room=_LETTERS // wide)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(max(3, 10 // wide), integer=whole))


def upright(label: str, most: int) -> str:
    """Return the text of a vertical axis that has room for so many letters.

    A unit, and what is better, are on a line of their own where the name leaves no room for them.
    """
    name, bracket, rest = label.partition(" [" if " [" in label else " (max)")
    long = bracket and len(label) > most
    lines = [name, bracket.strip() + rest] if long else [label]
    return "\n".join(literal(line, most) for line in lines)


def name_places(axes: Axes, values: Sequence[object], *, room: int) -> None:
    """Name the places 0, 1, … of the horizontal axis, turned where there is little room.

    Args:
        axes: The axes.
        values: One for each place; of more than twelve only some are named.
        room: How many characters the axis has room for side by side.
    """
    step = -(-len(values) // 12) or 1
    places = list(range(0, len(values), step))
    names = [literal(values[place], 14) for place in places]
    turned = sum(len(name) + 2 for name in names) > room
    axes.xaxis.set_ticks(places, names, rotation=90 if turned else 0)
    axes.xaxis.grid(visible=False)


def draw_limits(axes: Axes, letter: str, name: str, ends: tuple[float, float]) -> None:
    """Draw the limits on the quantity of the x or y axis, what is beyond them shaded.

    A limit farther off than half the view is told by the legend only. The view, which is set
    before, stays or grows up to the limit.

    Args:
        axes: The axes.
        letter: ``"x"`` or ``"y"``.
        name: What is limited.
        ends: The least and the greatest value allowed; infinite where open.
    """
    span, line = (axes.axvspan, axes.axvline) if letter == "x" else (axes.axhspan, axes.axhline)
    for sign, limit in zip("≥≤", ends, strict=True):
        if not np.isfinite(limit):
            continue
        low, high = getattr(axes, f"get_{letter}lim")()
        reach, label = 0.5 * (high - low), f"limit {literal(name, 24)} {sign} {limit:g}"
        style: dict[str, Any] = {
            "color": "0.25",
            "linewidth": 1.0,
            "zorder": 4.5,
            "linestyle": _LIMIT_STYLES[letter],
        }
        if not low - reach <= limit <= high + reach:
            axes.plot([], [], label=f"{label}, outside the axes", **style)
            continue
        pad = 0.05 * (high - low)
        low, high = min(low, limit - pad), max(high, limit + pad)
        getattr(axes, f"set_{letter}lim")(low, high)
        beyond = (low, limit) if sign == "≥" else (limit, high)
        span(*beyond, facecolor="0.93", linewidth=0, zorder=0)
        line(limit, label=label, **style)
