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
from pymoo_psi.plots._style import Group, draw_points, legend_of, literal, view
from pymoo_psi.plots._test_table import MATRIX, name_axes, triangle

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
    values, groups = ranking.objectives.values, rank_groups(ranking)
    names = headings if len(headings) <= MATRIX + 1 else headings[:1]  # too many for pairs
    with triangle(names, below=80.0) as (figure, pairs, cells):
        for (first, second), ax in pairs.items():
            x, y = (values[:, headings.index(name)] for name in (first, second))
            draw_points(ax, x, y, groups, ranking.pareto)
            ax.set(xlim=view(x[ranking.pareto]), ylim=view(y[ranking.pareto]))
            name_axes(ax, first, second)
        _draw_parallel(figure.add_subplot(cells[-1, :]), ranking, groups, headings)
        looks = [group.look(name) for name, group in groups.items()]
        entries = {look["label"]: Line2D([], [], **look) for look in looks}
        legend_of(figure, entries, ncols=3)
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
    axes: Axes, ranking: EfficiencyRanking, groups: Mapping[str, Group], headings: list[str]
) -> None:
    """Draw a line for each design through its objectives, each from its best to its worst value."""
    ideal, nadir = (np.asarray(end) for end in (ranking.ideal, ranking.nadir))
    shares = (ranking.objectives.values - ideal) / np.where(nadir == ideal, 1.0, nadir - ideal)
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
    drawn = shares[ranking.pareto]
    axes.set_xlim(-0.4, len(place) - 0.6)
    axes.set_ylim(view([drawn.min(initial=0.0), drawn.max(initial=1.0)]))
    ends = zip(headings, ranking.ideal.tolist(), ranking.nadir.tolist(), strict=True)
    labels = [f"{literal(name, 30)}\nbest {low:.4g}\nworst {high:.4g}" for name, low, high in ends]
    longest = max(len(line) for label in labels for line in label.split("\n"))
    axes.set_xticks(place, labels, rotation=90 if (longest + 2) * len(labels) > _TEXT else 0)
    axes.set_ylabel("share of the range (0 is best)")
