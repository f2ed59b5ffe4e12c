"""What the pages of a test table are made of: small axes that share names, ticks and legends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pymoo_psi.figures.groups import group_look, literal, name_places, prototype_look
from pymoo_psi.figures.plane_axes import draw_plane
from pymoo_psi.figures.planes import DesignPlane
from pymoo_psi.figures.style import WIDTH, enlarged_markers, inches
from pymoo_psi.investigation import TestTable

__all__ = ["blank_page", "draw_small", "heading", "legends", "share", "small"]

_SCALE = 0.75  # of the markers on small axes
_LETTERS = 90  # of text over the width of a page


def blank_page(high: int, wide: int) -> tuple[Figure, Any]:
    """Return a figure 180 mm wide with axes in ``high`` rows and ``wide`` columns."""
    height = 34.0 + high * {1: 60.0, 2: 46.0, 3: 40.0}.get(wide, 33.0)
    figure = Figure(figsize=inches(WIDTH, height), layout="constrained")
    return figure, figure.subplots(high, wide, squeeze=False)


def draw_small(plane: DesignPlane, ax: Axes, wide: int, margin: float) -> None:
    """Draw what is near the feasible designs on one of ``wide`` axes beside each other."""
    draw_plane(plane.nearby(margin), ax=ax, legend=False)
    for line in ax.lines:
        line.set_markersize(_SCALE * line.get_markersize())
    small(ax, wide, plane.names, plane.options, whole=plane.abscissa == "integer")


def small(
    ax: Axes, wide: int, names: tuple[str, str], values: Sequence[object], *, whole: bool = False
) -> None:
    """Leave as much text on axes as there is room for."""
    ax.set_title("")
    ax.set_xlabel(literal(names[0], _LETTERS // wide))
    ax.set_ylabel(literal(names[1], 18))
    ax.yaxis.set_major_locator(MaxNLocator(4))
    if values:
        name_places(ax.xaxis, values, room=_LETTERS // wide)
    else:
        ax.xaxis.set_major_locator(MaxNLocator(max(3, 10 // wide), integer=whole))


def share(grid: Any, *, below: bool = True) -> None:
    """Leave names at the left and below only, and ticks where they are not those of the others."""
    for lines, letter, outer in ((grid, "y", 0), (grid.T if below else [], "x", -1)):
        side = {"x": "labelbottom", "y": "labelleft"}[letter]
        for line in lines:
            shown = [ax for ax in line if ax.axison]
            end = shown[outer]
            for ax in shown:
                if ax is not end:
                    getattr(ax, f"set_{letter}label")("")
                    own, its = (getattr(one, f"get_{letter}lim")() for one in (ax, end))
                    if np.allclose(own, its, rtol=1e-12, atol=0.0):
                        ax.tick_params(**{side: False})


def legends(figure: Figure, grid: Any, plane: DesignPlane | None, *, title: str = "") -> None:
    """Put under the axes what their lines mean, and what bars if there are any.

    The numbers are those of the whole table, whatever is outside of some axes.
    """
    handles = [handle for ax in grid.ravel() for handle in ax.get_legend_handles_labels()[0]]
    bars = {
        str(handle.get_label()): handle for handle in handles if isinstance(handle, BarContainer)
    }
    lines = {str(line.get_label()): line for line in handles if isinstance(line, Line2D)}
    if plane is not None:
        limits = {label: line for label, line in lines.items() if label.startswith("limit ")}
        looks = [group_look(name, len(members)) for name, members in plane.groups().items()]
        if len(plane.prototype):
            looks.append(prototype_look(plane.prototype_name, scale=_SCALE))
        lines = {look["label"]: Line2D([], [], **look) for look in looks} | limits
    if bars:
        place = "left" if lines else "center"
        _legend(figure, bars, place, "histograms, % of each group", 1 if lines else 3)
    if lines:
        place = "right" if bars else "center"
        _legend(figure, lines, place, title, 3 if max(map(len, lines)) <= 28 else 2)


def _legend(
    figure: Figure,
    handles: Mapping[str, Any],
    place: str,
    title: str,
    ncols: int,
) -> None:
    outside: Any = f"outside lower {place}"
    legend = figure.legend(
        list(handles.values()), list(handles), loc=outside,
        ncols=ncols, title=title or None, fontsize=7, title_fontsize=7, alignment="left",
    )  # fmt: skip
    enlarged_markers(legend)


def heading(
    figure: Figure, table: TestTable, planes: Iterable[Iterable[DesignPlane]], margin: float,
    title: str,
) -> None:  # fmt: skip
    """Write over the axes what is drawn, how many designs there are and which are not seen."""
    failed = int(np.sum(table.status == "failed"))
    facts = [f"{len(table)} designs tested"] + ([f"{failed} failed"] if failed else [])
    if any(len(p.nearby(margin).values) < len(p.values) for row in planes for p in row):
        facts.append("those far from the feasible ones outside the axes")
    figure.suptitle(f"{title}\n{', '.join(facts)}".strip(), fontsize=9)
