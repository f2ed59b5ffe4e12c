"""The groups of tested designs, and what the figures of a test table have in common.

Every tested design is in one group. The groups differ by marker and by lightness, so that a grey
print tells them apart; the larger a group, the smaller its markers and the lower it lies, so that
the many do not hide the few.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from pymoo_psi.figures.style import GREY, MARKERS, Marker, enlarged_markers

__all__ = [
    "BEYOND",
    "FEASIBLE",
    "GROUPS",
    "INFEASIBLE",
    "LIMIT",
    "PARETO",
    "PROTOTYPE",
    "draw_limit",
    "group_look",
    "legend_below",
    "literal",
    "name_places",
    "prototype_label",
    "prototype_look",
    "view",
]

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
