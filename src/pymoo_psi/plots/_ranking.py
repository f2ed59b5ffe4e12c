"""Any ranked Pareto set: its objectives in pairs and as parallel coordinates, by rank."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from pymoo_psi._validation import counted, instance
from pymoo_psi.pareto import EfficiencyRanking
from pymoo_psi.plots._markers import MARKERS
from pymoo_psi.plots._style import Group, draw_points, legend_of, literal, new_figure, view
from pymoo_psi.plots._tests import MATRIX, _label_axes, _share_axes, row_height

_LINES = 2000  # of a group; more would be one grey area, and take long to draw
_BARE = 60  # lines beyond which those of a group are thin and have no marks
_TEXT = 100  # letters over the width of a figure, in the size of ticks


def plot_ranking(
    ranking: EfficiencyRanking, *, units: Mapping[Any, str] | None = None, title: str = ""
) -> Figure:
    """Return the Pareto-optimal designs of a ranking, with ranks and the Salukvadze optimum.

    Up to seven objectives are drawn in pairs. Below, or alone, are parallel coordinates: a line for
    each design, from the best value of each objective at the bottom to the worst of the Pareto set.

    Args:
        ranking: From :func:`pymoo_psi.rank_of_efficiency` or ``table.ranking()``.
        units: Units of objectives by name, such as ``table.layout.units``.
        title: What the designs are.

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
    values = ranking.objectives.values
    groups = rank_groups(ranking)
    wide = len(headings) - 1 if 2 <= len(headings) <= MATRIX + 1 else 0
    labels, upright = _ends(headings, ranking)
    with new_figure(92.0 + 40.0 * upright + wide * row_height(wide)) as figure:
        cells = figure.add_gridspec(wide + 1, max(wide, 1), height_ratios=[1.0] * wide + [1.2])
        pairs = np.array(
            [[figure.add_subplot(cells[k, j]) for j in range(wide)] for k in range(wide)], object
        )
        for k, line in enumerate(pairs):
            for j, ax in enumerate(line[: k + 1]):
                draw_points(ax, values[:, j], values[:, k + 1], groups, ranking.pareto)
                ax.set_xlim(view(values[ranking.pareto, j]))
                ax.set_ylim(view(values[ranking.pareto, k + 1]))
                _label_axes(ax, wide, (headings[j], headings[k + 1]), ())
            for ax in line[k + 1 :]:
                ax.set_axis_off()
        if wide:
            _share_axes(pairs)
        _draw_parallel(figure.add_subplot(cells[-1, :]), ranking, groups, labels, upright)
        looks = [group.look(name) for name, group in groups.items()]
        entries = {look["label"]: Line2D([], [], **look) for look in looks}
        legend_of(figure, entries, loc="outside lower center", ncols=3)
        optimal = counted(int(ranking.pareto.sum()), "Pareto-optimal design")
        shown = f"{optimal} of {len(values)}, by rank of efficiency"
        figure.suptitle(f"{title}\n{shown}".strip())
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
    labels: list[str],
    upright: bool,
) -> None:
    """Draw a line for each design through its objectives, each from its best to its worst value."""
    ideal, nadir = (np.asarray(end) for end in (ranking.ideal, ranking.nadir))
    length = np.where(nadir == ideal, 1.0, nadir - ideal)
    shares = (ranking.objectives.values - ideal) / length
    place = np.arange(len(labels))
    for name, group in groups.items():
        rows = group.rows[:: -(-len(group.rows) // _LINES)]
        bare = len(group.rows) > _BARE
        width = 2.0 if group.marker is MARKERS[6] else 0.4 if bare else 1.0
        lines = [np.column_stack([place, share]) for share in shares[rows]]
        axes.add_collection(
            LineCollection(
                lines, colors=group.marker.colour, linewidths=width, alpha=0.5 if bare else 1.0,
                zorder=group.marker.level, rasterized=bare,
            )
        )  # fmt: skip
        if not bare or len(place) == 1:
            at = np.tile(place, len(lines)), np.concatenate(lines)[:, 1]
            axes.plot(*at, **group.look(name))
    drawn = shares[ranking.pareto]
    low, high = drawn.min(initial=0.0), drawn.max(initial=1.0)
    axes.set_xlim(-0.4, len(place) - 0.6)
    axes.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
    axes.set_xticks(place, labels, rotation=90 if upright else 0)
    axes.set_ylabel("share of the range (0 is best)")


def _ends(headings: list[str], ranking: EfficiencyRanking) -> tuple[list[str], bool]:
    """Return each objective with its best and worst value, and whether to write it upright."""
    ends = zip(headings, ranking.ideal.tolist(), ranking.nadir.tolist(), strict=True)
    lines = [(literal(name), f"best {low:.4g}", f"worst {high:.4g}") for name, low, high in ends]
    if max(len(text) + 2 for line in lines for text in line) <= _TEXT // len(headings):
        return ["\n".join(line) for line in lines], False
    return [f"{name}\n{best}, {worst}" for name, best, worst in lines], True
