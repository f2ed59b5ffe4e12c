"""Any ranked Pareto set: its criteria in pairs and beside each other, by rank of efficiency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pymoo_psi._markers import GREY, MARKERS, Marker
from pymoo_psi._validation import counted, instance
from pymoo_psi.paper._figures import RankedPoints
from pymoo_psi.pareto import EfficiencyRanking, UtopianFrame
from pymoo_psi.plots._designs import label_axes
from pymoo_psi.plots._style import enlarge_markers, literal, new_page, view
from pymoo_psi.plots._table import MATRIX, row_height, share_axes

_LINES = 2000  # of a group; more would be one grey area, and take long to draw
_BARE = 60  # lines beyond which those of a group are thin and have no marks
_TEXT = 100  # letters over the width of a page, in the size of ticks


def ranking_page(
    ranking: EfficiencyRanking, *, units: Mapping[Any, str] | None = None, title: str = ""
) -> Figure:
    """Return the Pareto-optimal designs of a ranking, with ranks and the Salukvadze optimum.

    Up to seven criteria are drawn in pairs. Below, or alone, are parallel coordinates: a line for
    each design, from the best value of each criterion at the bottom to the worst of the Pareto set.

    Args:
        ranking: From :func:`pymoo_psi.rank_of_efficiency` or ``table.ranking()``.
        units: Units of criteria by name, such as ``table.layout.units``.
        title: What the designs are.

    Raises:
        ArgumentTypeError: ``ranking`` is none.

    Example:
        >>> from pymoo_psi import rank_of_efficiency
        >>> page = ranking_page(rank_of_efficiency([[1, 5], [2, 2], [5, 1]]))
        >>> [ax.get_ylabel() for ax in page.axes]
        ['f2', 'share of the range (0 is best)']
    """
    instance("ranking", ranking, EfficiencyRanking, "rank_of_efficiency(F) gives one")
    headings = ranking.objectives.headings({} if units is None else units)
    optimum = np.zeros(len(ranking.rank), dtype=bool)
    optimum[ranking.salukvadze] = True
    front = ranking.pareto
    values = ranking.objectives.values[front]
    points = RankedPoints(tuple(headings), values, ranking.rank[front], optimum[front])
    wide = len(headings) - 1 if 2 <= len(headings) <= MATRIX + 1 else 0
    labels, upright = _ends(headings, ranking)
    height = 92.0 + 40.0 * upright + wide * row_height(wide)
    with new_page(height) as figure:
        cells = figure.add_gridspec(wide + 1, max(wide, 1), height_ratios=[1.0] * wide + [1.2])
        pairs = np.array(
            [[figure.add_subplot(cells[k, j]) for j in range(wide)] for k in range(wide)], object
        )
        for k, line in enumerate(pairs):
            for j, ax in enumerate(line[: k + 1]):
                draw_points(ax, points.along((j, k + 1)))
                ax.set_xlim(view(values[:, j]))
                ax.set_ylim(view(values[:, k + 1]))
                label_axes(ax, wide, (headings[j], headings[k + 1]), ())
            for ax in line[k + 1 :]:
                ax.set_axis_off()
        if wide:
            share_axes(pairs)
        _draw_parallel(figure.add_subplot(cells[-1, :]), points, ranking, labels, upright)
        marks = [
            Line2D([], [], **_mark(_marker(points, members)), label=f"{name} ({len(members)})")
            for name, members in points.groups().items()
        ]
        enlarge_markers(figure.legend(handles=marks, loc="outside lower center", ncols=3))
        shown = f"{counted(len(values), 'Pareto-optimal design')} of {len(front)}"
        figure.suptitle(f"{title}\n{shown}, by rank of efficiency".strip())
    return figure


def draw_points(axes: Axes, points: RankedPoints) -> None:
    """Draw points of two coordinates, each rank with its colour and marker, the optimum a star."""
    for name, members in points.groups().items():
        marker = _marker(points, members)
        axes.plot(
            *points.values[members].T, **_mark(marker), zorder=marker.level,
            label=f"{name} ({len(members)})", rasterized=name == "unranked",
        )  # fmt: skip


def _marker(points: RankedPoints, members: Any) -> Marker:
    if points.optimum[members[0]]:
        return MARKERS[6]
    rank = int(points.rank[members[0]])
    if rank > 0:
        return MARKERS[rank]
    # Of hundreds the dots are fine; a few such would not be seen.
    return MARKERS[0]._replace(size=float(np.clip(60 / len(members) ** 0.5, MARKERS[0].size, 5.0)))


def _mark(marker: Marker) -> dict[str, Any]:
    return marker.look("none" if marker.colour == GREY else "black")


def _draw_parallel(
    axes: Axes, points: RankedPoints, ranking: EfficiencyRanking, labels: list[str], upright: bool
) -> None:
    """Draw a line for each design through its criteria, each from its best to its worst value."""
    frame = UtopianFrame(ranking.frame.ideal, ranking.frame.nadir, True)
    shares = frame.scaled(points.values * ranking.objectives.sign)
    place = np.arange(len(points.names))
    for members in points.groups().values():
        marker = _marker(points, members)
        step = -(-len(members) // _LINES)
        bare = len(members) > _BARE
        lines = [np.column_stack([place, share]) for share in shares[members[::step]]]
        width = 2.0 if marker is MARKERS[6] else 0.4 if bare else 1.0
        lines_of = LineCollection(
            lines, colors=marker.colour, linewidths=width, alpha=0.5 if bare else 1.0,
            zorder=marker.level, rasterized=bare,
        )  # fmt: skip
        axes.add_collection(lines_of)
        if not bare or len(place) == 1:
            at = np.tile(place, len(lines)), np.concatenate(lines)[:, 1]
            axes.plot(*at, **_mark(marker), zorder=marker.level)
    axes.set_xlim(-0.4, len(place) - 0.6)
    low, high = shares.min(initial=0.0), shares.max(initial=1.0)
    axes.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
    axes.set_xticks(place, labels, rotation=90 if upright else 0)
    axes.set_ylabel("share of the range (0 is best)")


def _ends(headings: list[str], ranking: EfficiencyRanking) -> tuple[list[str], bool]:
    """Return under each criterion its best and worst value, and whether upright, to have room."""
    ends = zip(headings, ranking.ideal.tolist(), ranking.nadir.tolist(), strict=True)
    lines = [(literal(name), f"best {low:.4g}", f"worst {high:.4g}") for name, low, high in ends]
    if max(len(text) + 2 for line in lines for text in line) <= _TEXT // len(headings):
        return ["\n".join(line) for line in lines], False
    return [f"{name}\n{best}, {worst}" for name, best, worst in lines], True
