"""The groups of tested designs, and what the figures of a test table have in common.

Every tested design is in one group. The groups differ by marker and by lightness, so that a grey
print tells them apart; the larger a group, the smaller its markers and the lower it lies, so that
the many do not hide the few.

The tested designs in a plane: a criterion against a variable, or against another criterion.

Tested designs drawn in a plane: groups, limits and what is beyond them, the prototype.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pymoo_psi._validation import boolean, instance, invalid
from pymoo_psi.plots._style import GREY, MARKERS, Marker, enlarged_markers, on_axes
from pymoo_psi.table import Dependence, Kind, Prototype, TestTable, dependence
from pymoo_psi.table._designs import column_kinds, values_in_order
from pymoo_psi.table._layout import Key, Limits
from pymoo_psi.table._limits import limit_vector

Array = NDArray[np.float64]

INFEASIBLE, BEYOND = "infeasible", "beyond the limits"
FEASIBLE, PARETO = "feasible, dominated", "Pareto optimal"

GROUPS: dict[str, Marker] = {
    INFEASIBLE: Marker(".", GREY, 6.0, level=2.0),
    BEYOND: Marker("x", "0.5", 3.2, level=2.1),
    FEASIBLE: MARKERS[4],
    PARETO: MARKERS[5],
}
"""Breaks a constraint; breaks a limit only; keeps all; keeps all and is not dominated."""

PROTOTYPE = MARKERS[6]
LIMIT: dict[str, Any] = {"color": "0.25", "linewidth": 1.0, "zorder": 4.5}
_SHADE: dict[str, Any] = {"facecolor": "0.93", "linewidth": 0, "zorder": 0}
_LIMIT_STYLES = {"x": "-.", "y": "--"}

_MANY = 200  # from here on the markers of a group shrink
_RASTERIZED = 2000


def group_look(group: str, count: int, *, scale: float = 1.0) -> dict[str, Any]:
    """Return how the line of a group of ``count`` designs looks, with its label."""
    marker = GROUPS[group]
    shrink = scale * min(1.0, max(0.2, (_MANY / max(count, 1)) ** 0.3))
    edged = group == PARETO
    return {
        "linestyle": "none",
        "marker": marker.shape,
        "markersize": marker.size * shrink,
        "markerfacecolor": marker.colour,
        "markeredgecolor": "black" if edged else marker.colour if marker.shape == "x" else "none",
        "markeredgewidth": 0.5 * shrink if edged else 0.5,
        "zorder": 3.0 + 1.0 / (1 + count),  # the rarer on top
        "label": f"{group} ({count})",
        "rasterized": count > _RASTERIZED,
    }


def prototype_look(name: str, *, scale: float = 1.0) -> dict[str, Any]:
    """Return how the prototype looks, on top of every group, with its label."""
    return {
        "linestyle": "none",
        "marker": PROTOTYPE.shape,
        "markersize": PROTOTYPE.size * scale,
        "markerfacecolor": PROTOTYPE.colour,
        "markeredgecolor": "black",
        "markeredgewidth": 0.7,
        "path_effects": [withStroke(linewidth=3.0, foreground="white")],  # apart from a crowd
        "zorder": PROTOTYPE.level,
        "label": prototype_label(name),
    }


def prototype_label(name: str) -> str:
    """Return what a legend calls the prototype."""
    return "prototype" if name in ("prototype", "") else f"prototype: {literal(name)}"


def literal(name: object, most: int = 40) -> str:
    """Return a name on one line, as it is written: a ``$`` in it begins no formula.

    Args:
        name: A name or a value.
        most: Characters; of a longer name the beginning is kept.
    """
    text = " ".join((f"{name:.6g}" if isinstance(name, float) else str(name)).split())
    text = text if len(text) <= most else f"{text[: most - 1]}…"
    return text.replace("$", r"\$")


def view(values: Array, *further: float) -> tuple[float, float]:
    """Return the ends of an axis that shows the values, and numbers where they are finite.

    Example:
        >>> view(np.array([0.0, 2.0]), np.nan)
        (-0.1, 2.1)
    """
    known = np.array([*values, *further])
    known = known[np.isfinite(known)]
    if len(known) == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    pad = 0.05 * (high - low)
    if not high - low > 1e-9 * max(abs(low), abs(high)):  # one value
        pad = 0.05 * abs(low) or 0.5
    return low - pad, high + pad


def draw_limit(axes: Axes, letter: str, name: str, limit: float) -> None:
    """Draw a limit on the quantity of the x or y axis, what is beyond it shaded.

    A limit farther off than half the view is told by the legend only. The view, which is set
    before, stays or grows up to the limit.
    """
    low, high = getattr(axes, f"get_{letter}lim")()
    reach, label = 0.5 * (high - low), f"limit {literal(name, 24)} ≤ {limit:g}"
    style = LIMIT | {"linestyle": _LIMIT_STYLES[letter]}
    if not low - reach <= limit <= high + reach:
        axes.plot([], [], label=f"{label}, outside the axes", **style)
        return
    pad = 0.05 * (high - low)
    low, high = min(low, limit - pad), max(high, limit + pad)
    getattr(axes, f"set_{letter}lim")(low, high)
    if letter == "x":
        axes.axvspan(limit, high, **_SHADE)
        axes.axvline(limit, label=label, **style)
    else:
        axes.axhspan(limit, high, **_SHADE)
        axes.axhline(limit, label=label, **style)


def name_places(axis: Axis, values: Sequence[object], *, room: int) -> None:
    """Name the places 0, 1, … of an axis by values, turned where there is little room.

    Args:
        axis: A horizontal axis.
        values: One for each place; of more than twelve only some are named.
        room: How many characters the axis has room for side by side.
    """
    step = -(-len(values) // 12) or 1
    places = list(range(0, len(values), step))
    names = [literal(values[place], 14) for place in places]
    turned = sum(len(name) + 2 for name in names) > room
    axis.set_ticks(places, names, rotation=90 if turned else 0)
    axis.grid(visible=False)


def legend_below(axes: Axes) -> None:
    """Put a legend of two columns under the axes."""
    enlarged_markers(
        axes.legend(
            loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=4.5, ncols=2, frameon=False
        )
    )


_HUGE = 1e300  # beyond it the length of an axis may overflow
_SPREAD = 0.6  # of the distance between two values
_GOLDEN = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class DesignPlane:
    """The tested designs in the plane of a variable or criterion and a criterion.

    Attributes:
        names: What is on the horizontal and on the vertical axis.
        abscissa: What is on the horizontal axis: a "criterion", a "real" or "integer" variable,
            or an "option", which is a choice or a boolean.
        options: The values of an "option", in order; empty for numbers.
        box: Lower and upper bound of the variable; NaN where there is none.
        numbers: ``(n,)`` numbers of the test points.
        values: ``(n, 2)`` the designs, an "option" by its index in ``options``.
        group: ``(n,)`` "infeasible", "beyond the limits", "feasible, dominated" or
            "Pareto optimal".
        limits: Limits on the two quantities; infinity where there is none.
        prototype: ``(k, 2)`` the prototype, k = 0 or 1.
        prototype_name: What it is called.
        not_drawn: How many tested designs are not among the n: failed ones, and those that
            :meth:`nearby` left out.

    Example:
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0], [1.0]])
        >>> plane = variable_plane(table, "f1", "x1")
        >>> plane.names, plane.values.tolist()
        (('x1', 'f1'), [[0.1, 2.0], [0.5, 1.0]])
    """

    names: tuple[str, str]
    abscissa: Literal["criterion", "real", "integer", "option"]
    options: tuple[Any, ...]
    box: tuple[float, float]
    numbers: NDArray[np.int64]
    values: Array
    group: NDArray[np.str_]
    limits: tuple[float, float]
    prototype: Array
    prototype_name: str
    not_drawn: int

    def groups(self) -> dict[str, NDArray[np.intp]]:
        """Return the indices of the designs of each group; feasible ones also if there is none.

        Example:
            >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0], [1.0]])
            >>> variable_plane(table, "f1", "x1").groups()
            {'feasible, dominated': array([0]), 'Pareto optimal': array([1])}
        """
        groups = {name: np.flatnonzero(self.group == name) for name in GROUPS}
        kept = (FEASIBLE, PARETO)
        return {name: members for name, members in groups.items() if len(members) or name in kept}

    def nearby(self, margin: float = 1.0) -> DesignPlane:
        """Return the designs whose criteria are near those of the feasible and of the prototype.

        A criterion in which these do not differ leaves no design out.

        Args:
            margin: How far beyond their range on each side, as a share of it; 0 or more.

        Raises:
            ArgumentValueError: The margin is below 0.

        Example:
            The infeasible design far off would leave no room for the others.

            >>> table = TestTable.of(
            ...     [1, 2, 3], X=[[0.1], [0.5], [0.9]], F=[[2.0], [1.0], [99.0]], G=[[0], [0], [1]]
            ... )
            >>> near = variable_plane(table, "f1", "x1").nearby()
            >>> near.numbers, near.not_drawn
            (array([1, 2]), 1)
        """
        if not margin >= 0:
            raise invalid("margin", "0 or more", margin)
        core = np.vstack([self.values[np.isin(self.group, (FEASIBLE, PARETO))], self.prototype])
        inside = np.ones(len(self.values), dtype=bool)
        for k in (0, 1) if self.abscissa == "criterion" else (1,):
            low, high = core[:, k].min(initial=np.inf), core[:, k].max(initial=-np.inf)
            if high > low:
                wider = margin * (high - low)
                inside &= (self.values[:, k] >= low - wider) & (self.values[:, k] <= high + wider)
        return replace(
            self,
            numbers=self.numbers[inside],
            values=self.values[inside],
            group=self.group[inside],
            not_drawn=self.not_drawn + int(np.sum(~inside)),
        )

    def spread(self) -> Array:
        """``(n, 2)`` where the designs are drawn: those with the same single value side by side.

        Where follows from the number of the test point, so that a picture can be repeated.

        Example:
            >>> table = TestTable.of([1, 2], X=[[3], [3]], F=[[2.0], [1.0]])
            >>> places = variable_plane(table, "f1", "x1").spread()
            >>> places[:, 1], bool(places[0, 0] != places[1, 0])
            (array([2., 1.]), True)
        """
        places = self.values.copy()
        if self.is_spread:
            places[:, 0] += _SPREAD * (self.numbers * _GOLDEN % 1 - 0.5)
        return places

    @property
    def is_spread(self) -> bool:
        """Whether the variable takes single values, with room between them.

        Example:
            >>> whole = TestTable.of([1, 2], X=[[1], [4]], F=[[2.0], [1.0]])
            >>> real = TestTable.of([1, 2], X=[[1.0], [4.0]], F=[[2.0], [1.0]])
            >>> [variable_plane(table, "f1", "x1").is_spread for table in (whole, real)]
            [True, False]
        """
        x = self.values[:, 0]
        return self.abscissa == "option" or (
            self.abscissa == "integer" and len(x) > 0 and float(np.ptp(x)) <= 30
        )


def dependence_plane(dependence: Dependence) -> DesignPlane:
    """Return a dependence of a test table as points to draw.

    It knows neither box nor prototype, and what breaks a limit counts as infeasible;
    :func:`variable_plane` takes all that from the table.

    Args:
        dependence: From :func:`pymoo_psi.table.dependence`.

    Example:
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0], [1.0]])
        >>> dependence_plane(dependence(table, "f1", "x1")).group.tolist()
        ['feasible, dominated', 'Pareto optimal']
    """
    dependence = instance("dependence", dependence, Dependence, "take that of a TestTable")
    group = np.where(dependence.feasible, FEASIBLE, INFEASIBLE)
    group[dependence.pareto] = PARETO
    return _over_variable(dependence, group, None, (np.nan, np.nan), ())


def variable_plane(
    table: TestTable, criterion: Key, variable: Key, *, limits: Limits | None = None
) -> DesignPlane:
    """Return the projection of the designs onto a variable and a criterion.

    Args:
        table: A test table.
        criterion: Name or index of the criterion, on the vertical axis.
        variable: Name or index of the variable, on the horizontal axis.
        limits: Limits on criteria.

    Raises:
        ArgumentValueError: The criterion, the variable or a limited criterion is not in the
            table, or a limit is NaN.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0], [1.0]])
        >>> variable_plane(table, "f1", "x1", limits={"f1": 1.5}).group.tolist()
        ['beyond the limits', 'Pareto optimal']
    """
    layout = checked_table(table).layout
    i, j = layout.objective(criterion), layout.variable(variable)
    box = float(layout.lower[j]), float(layout.upper[j])
    seen = dependence(table, i, j, limits=limits)
    here = table.prototype
    place = () if here is None else (here.x.tolist()[j], float(here.f[i]))
    return _over_variable(seen, _groups(table, limits), here, box, place)


def criteria_plane(
    table: TestTable, first: Key, second: Key, *, limits: Limits | None = None
) -> DesignPlane:
    """Return the designs in the plane of two criteria.

    Args:
        table: A test table.
        first: Name or index of the criterion on the horizontal axis.
        second: Name or index of the one on the vertical axis.
        limits: Limits on criteria.

    Raises:
        ArgumentValueError: A criterion is not in the table, or a limit is NaN.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> plane = criteria_plane(table, "f1", "f2", limits={"f1": 1.5})
        >>> plane.limits, plane.group.tolist()
        ((1.5, inf), ['beyond the limits', 'Pareto optimal'])
    """
    layout, prototype = checked_table(table).layout, table.prototype
    columns = [layout.objective(first), layout.objective(second)]
    bounds = limit_vector(limits, layout)
    group = _groups(table, limits)
    drawn = _drawn(table.F[:, columns], group)
    return DesignPlane(
        names=(layout.objectives[columns[0]], layout.objectives[columns[1]]),
        abscissa="criterion",
        options=(),
        box=(np.nan, np.nan),
        numbers=table.numbers[drawn],
        values=table.F[drawn][:, columns],
        group=group[drawn],
        limits=(bounds.get(columns[0], np.inf), bounds.get(columns[1], np.inf)),
        prototype=np.zeros((0, 2)) if prototype is None else prototype.f[None, columns],
        prototype_name="" if prototype is None else prototype.name,
        not_drawn=int(np.sum(~drawn)),
    )


def checked_table(table: object) -> TestTable:
    """Return what is to be drawn; it must be a test table."""
    remedy = "PSI and investigate give one, TestTable.of(...) makes one of arrays"
    return instance("table", table, TestTable, remedy)


def _groups(table: TestTable, limits: Limits | None) -> NDArray[np.str_]:
    """``(n,)`` the group of each design; empty for the failed."""
    names = {"ok": BEYOND, "infeasible": INFEASIBLE, "failed": ""}
    group = np.full(len(table), "", dtype=f"<U{max(map(len, GROUPS))}")
    for status, name in names.items():
        group[table.status == status] = name
    group[table.feasible(limits)] = FEASIBLE
    group[table.pareto(limits)] = PARETO
    return group


def _drawn(values: Array, group: NDArray[np.str_]) -> NDArray[np.bool_]:
    mask: NDArray[np.bool_] = (np.abs(values) < _HUGE).all(axis=1) & (group != "")
    return mask


def _over_variable(
    dependence: Dependence,
    group: NDArray[np.str_],
    prototype: Prototype | None,
    box: tuple[float, float],
    place: tuple[Any, ...],
) -> DesignPlane:
    column = np.array([*dependence.x.tolist(), *place[:1]], dtype=object)
    kind = column_kinds(column[:, None])[0] if len(column) else Kind.REAL
    options: tuple[Any, ...] = ()
    if kind not in (Kind.REAL, Kind.INTEGER):
        options = tuple(values_in_order(column))
        seat = {(type(value), value): k for k, value in enumerate(options)}
        column = np.array([seat[type(value), value] for value in column.tolist()])
    x = column.astype(np.float64)
    n = len(dependence.f)
    values = np.column_stack([x[:n], dependence.f])
    drawn = _drawn(values, group)
    return DesignPlane(
        names=(dependence.variable, dependence.criterion),
        abscissa="option" if options else "integer" if kind is Kind.INTEGER else "real",
        options=options,
        box=box,
        numbers=dependence.numbers[drawn],
        values=values[drawn],
        group=group[drawn],
        limits=(np.inf, dependence.limit),
        prototype=np.column_stack([x[n:], place[1:]]) if place else np.zeros((0, 2)),
        prototype_name="" if prototype is None else prototype.name,
        not_drawn=int(np.sum(~drawn)),
    )


def draw_plane(
    points: DesignPlane, *, ax: Axes | None = None, legend: bool = True, title: str = ""
) -> Axes:
    """Draw the designs, each group with a marker of its own, the limits with what is beyond them.

    Args:
        points: From :func:`variable_plane`, :func:`criteria_plane` or :func:`dependence_plane`.
        ax: Axes to draw on; new ones by default.
        legend: Put a legend with the number of designs of each group under the axes.
        title: What the designs are; how many there are follows it.

    Returns:
        The axes.

    Example:
        >>> from pymoo_psi import TestTable
        >>> from pymoo_psi.plots import criteria_plane
        >>> table = TestTable.of([1, 2], X=[[0.1], [0.5]], F=[[2.0, 1.0], [1.0, 2.0]])
        >>> ax = draw_plane(criteria_plane(table, "f1", "f2"))
        >>> ax.get_xlabel(), ax.get_ylabel(), ax.get_title()
        ('f1', 'f2', '2 designs tested')
    """
    legend = boolean("legend", legend)
    with on_axes(ax) as axes:
        places = points.spread()
        for name, members in points.groups().items():
            axes.plot(*places[members].T, **group_look(name, len(members)))
        if len(points.prototype):
            axes.plot(*points.prototype.T, **prototype_look(points.prototype_name))
        drawn = np.vstack([places, points.prototype])
        axes.set_xlim(_ends(points, drawn[:, 0]))
        axes.set_ylim(view(drawn[:, 1]))
        for letter, name, limit in zip("xy", points.names, points.limits, strict=True):
            if np.isfinite(limit):
                draw_limit(axes, letter, name, limit)
        axes.set_xlabel(
            literal(points.names[0]) + (" (points spread sideways)" if points.is_spread else "")
        )
        axes.set_ylabel(literal(points.names[1]))
        axes.yaxis.set_major_locator(MaxNLocator(5))
        if points.options:
            name_places(axes.xaxis, points.options, room=60)
        else:
            axes.xaxis.set_major_locator(MaxNLocator(6, integer=points.abscissa == "integer"))
        tested = len(points.values) + points.not_drawn
        note = f", {points.not_drawn} not drawn" if points.not_drawn else ""
        axes.set_title(f"{title}\n{tested} designs tested{note}".strip())
        if legend:
            legend_below(axes)
    return axes  # type: ignore[no-any-return]


def _ends(points: DesignPlane, x: Array) -> tuple[float, float]:
    """Return the ends of the horizontal axis; single values have half a step on each side."""
    if points.options:
        return -0.5, len(points.options) - 0.5
    if points.is_spread:
        known = np.array([*x, *points.box])
        known = np.rint(known[np.isfinite(known)])
        return float(known.min()) - 0.5, float(known.max()) + 0.5
    return view(x, *points.box)
