"""How the designs of each rank of efficiency are drawn, on paper and on the decision page.

The colours are those of Okabe and Ito, which colour-blind readers can tell apart. No distinction
rests on colour alone: each goes with a marker of its own, so that a grey print says the same.
"""

from typing import Any, NamedTuple

GREY = "0.68"  # a share of white, in matplotlib's notation


class Marker(NamedTuple):
    """Shape and colour in matplotlib's notation, the diameter in points.

    Of two markers the one of the higher level is on top.
    """

    shape: str
    colour: str
    size: float
    level: float

    def look(self, edge: str = "black", width: float = 0.5) -> dict[str, Any]:
        """Return the arguments of matplotlib's ``plot`` for such markers without a line."""
        return {
            "linestyle": "none",
            "marker": self.shape,
            "markersize": self.size,
            "markerfacecolor": self.colour,
            "markeredgecolor": edge,
            "markeredgewidth": width,
        }


# By rank, the rarer ranks on top; ranks 1 and 2 do not occur.
MARKERS = {
    0: Marker(".", GREY, 2.0, level=2.0),
    3: Marker("^", "#56B4E9", 5.0, level=4.0),
    4: Marker("s", "#0072B2", 3.4, level=3.0),
    5: Marker("D", "#E69F00", 5.0, level=5.0),
    6: Marker("*", "#D55E00", 11.0, level=6.0),
}
