"""Tested designs drawn in a plane: groups, limits and what is beyond them, the prototype."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pymoo_psi.arguments import boolean
from pymoo_psi.figures.groups import (
    draw_limit,
    group_look,
    legend_below,
    literal,
    name_places,
    prototype_look,
    view,
)
from pymoo_psi.figures.planes import DesignPlane
from pymoo_psi.figures.style import on_axes

__all__ = ["draw_plane"]

Array = NDArray[np.float64]


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
        >>> from pymoo_psi.figures import criteria_plane
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
