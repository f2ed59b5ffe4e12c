"""The groups designs are drawn in: by rank, with the markers of the paper's figures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto import EfficiencyRanking
from pymoo_psi.plots._style import MARKERS, Marker

DOMINATED, OPTIMUM, PROTOTYPE = -1, 6, 7
"""Groups beside the ranks 0 to 5; a higher group is drawn on top."""

_SHAPES = {".": "circle", "^": "triangle", "s": "square", "D": "diamond", "*": "star", "x": "x"}
_OTHERS = {
    DOMINATED: Marker("x", "0.8", 2.5, level=1.0),
    PROTOTYPE: Marker("x", "#000000", 8.0, level=7.0),
}
_PIXELS = 1.55  # per point; a screen is looked at from further away than a print
_PATHS = {  # on a square of 16, for the legend
    "circle": '<circle cx="8" cy="8" r="3"/>',
    "triangle": '<path d="M8 3 L13 13 H3 Z"/>',
    "square": '<path d="M4 4 H12 V12 H4 Z"/>',
    "diamond": '<path d="M8 2 L13 8 L8 14 L3 8 Z"/>',
    "star": '<path d="M8 1 L10 6 H15 L11 9 L12 14 L8 11 L4 14 L5 9 L1 6 H6 Z"/>',
    "x": '<path d="M3.5 3.5 L12.5 12.5 M12.5 3.5 L3.5 12.5" stroke-width="2.2"/>',
}


class Look(NamedTuple):
    """How a group is drawn: Bokeh's name of the marker, colour, size in pixels."""

    shape: str
    colour: str
    size: float

    @property
    def svg(self) -> str:
        """The marker as a picture for the legend."""
        paint = f'fill="{self.colour}" stroke="{self.colour}"'
        return f'<svg width="16" height="16" aria-hidden="true" {paint}>{_PATHS[self.shape]}</svg>'


def look(group: int) -> Look:
    """Return how a group is drawn."""
    marker = {**MARKERS, **_OTHERS}.get(group, MARKERS[0])
    colour = marker.colour
    if not colour.startswith("#"):  # matplotlib writes greys as a share of white
        colour = "#" + f"{round(255 * float(colour)):02X}" * 3
    return Look(_SHAPES[marker.shape], colour, round(max(marker.size * _PIXELS, 3.5), 1))


def group_name(group: int) -> str:
    """Return what the page calls a group."""
    names = {
        PROTOTYPE: "prototype",
        OPTIMUM: "Salukvadze optimum",
        0: "unranked",
        DOMINATED: "dominated",
    }
    return names.get(group, f"rank {group}")


def groups_of(ranking: EfficiencyRanking) -> NDArray[np.int32]:
    """Return the ``(n,)`` groups of ranked designs; the optimum is one whatever its rank."""
    groups = np.where(ranking.pareto, ranking.rank, DOMINATED).astype(np.int32)
    groups[ranking.salukvadze] = OPTIMUM
    return groups
