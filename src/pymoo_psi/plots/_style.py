"""How the figures look: names of the quantities, colours with their markers, page sizes.

The colours are those of Okabe and Ito, which colour-blind readers can tell apart. No distinction
rests on colour alone: each goes with a marker or a line style of its own, so that a grey print
says the same.

Pages as files, all of them or none.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from pymoo_psi._validation import integer, known_name

WIDTH = 180.0
"""Width of a page in mm, over both columns of a journal."""

ABOVE = 29.0
"""Room in points between axes and title for :func:`legend_above`."""

GREY = "0.68"


class Quantity(NamedTuple):
    """A symbol, as mathematical text, and what it means."""

    symbol: str
    meaning: str


class Marker(NamedTuple):
    """How the designs of one rank are drawn.

    ``size`` is the diameter in points; of two markers the one of the higher level is on top.
    """

    shape: str
    colour: str
    size: float
    level: float


MARKERS = {
    0: Marker(".", GREY, 2.0, level=2.0),
    3: Marker("^", "#56B4E9", 5.0, level=4.0),
    4: Marker("s", "#0072B2", 3.4, level=3.0),
    5: Marker("D", "#E69F00", 5.0, level=5.0),
    6: Marker("*", "#D55E00", 11.0, level=6.0),
}
"""By rank of efficiency, the rarer ranks on top; ranks 1 and 2 do not occur."""

CURVES: tuple[dict[str, Any], ...] = (
    {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    {"color": "#D55E00", "linestyle": "--", "marker": "s"},
    {"color": "#000000", "linestyle": "-.", "marker": "^"},
)
"""Colour, line style and marker of the first, second and third curve on the same axes."""

_QUANTITIES = {
    "u1": Quantity("$u_1$", r"slope $\tan\,\alpha$"),
    "u2": Quantity("$u_2$", "plane speed $v_P$"),
    "f1": Quantity("$f_1$", "time"),
    "f2": Quantity("$f_2$", "energy balance"),
    "f3": Quantity("$f_3$", "height"),
    "f4": Quantity("$f_4$", "plane speed"),
    "mu1": Quantity(r"$\mu_1$", "distance to $U$"),
    "mu2": Quantity(r"$\mu_2$", "distance to line $UN$"),
    "mu3": Quantity(r"$\mu_3$", "distance along $UN$"),
    "eta": Quantity(r"$\eta$", "share of the way"),
    "c": Quantity("$c$", "initial speed of the centre"),
    "f1S": Quantity("$f_1^S$", "time"),
    "f2S": Quantity("$f_2^S$", "energy balance"),
    "f3S": Quantity("$f_3^S$", r"height $\tan\,\alpha$"),
    "f4S": Quantity("$f_4^S$", "plane speed $v_P$"),
    "vCfS": Quantity("$v_{Cf}^S$", "exit speed"),
}

_MODELS = {
    "full": "full model (slip, then roll)",
    "rolling": "rolling model (rolls from the start)",
}

_PAGE: Any = {
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.88",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "mathtext.fontset": "dejavusans",
    "text.usetex": False,
}


def page_style() -> Any:
    """Return a context in which axes are made in the style of the pages."""
    return rc_context(_PAGE)


def quantity(name: str) -> Quantity:
    """Return the symbol and the meaning of a quantity, such as ``"f1"``."""
    return _QUANTITIES[known_name("quantity", name, tuple(_QUANTITIES))]


def axis_label(name: str, *, unit: bool = True) -> str:
    """Return the text on an axis: symbol, meaning and, unless ``unit`` is false, the unit."""
    symbol, meaning = quantity(name)
    return f"{symbol}, {meaning} (dimensionless)" if unit else f"{symbol}, {meaning}"


def model_name(model: str) -> str:
    """Return what a title calls a model."""
    return _MODELS[known_name("model", model, tuple(_MODELS))]


def subject(model: str, mu: float) -> str:
    """Return what a title says of the case: the model and the friction coefficient."""
    return rf"{model_name(model)}, $\mu$ = {mu:g}"


def inches(width: float, height: float) -> tuple[float, float]:
    """Return a size given in mm as matplotlib wants it."""
    return width / 25.4, height / 25.4


@contextmanager
def on_axes(ax: Axes | None, *, three_d: bool = False) -> Iterator[Any]:
    """Give the axes to draw on: those given, in whatever style, or new ones in the pages' style.

    A new figure is known to no window system.
    """
    if ax is not None:
        yield ax
        return
    with page_style():
        figure = Figure(figsize=inches(120.0, 90.0), layout="constrained")
        yield figure.add_subplot(projection="3d") if three_d else figure.add_subplot()


def enlarged_markers(legend: Legend) -> None:
    """Let the small dots of a legend be seen."""
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and 0 < handle.get_markersize() < 5:
            handle.set_markersize(5)


def legend_above(axes: Axes, *, ncols: int) -> None:
    """Put a legend of two rows between the axes and their title, which is set with ``ABOVE``."""
    legend = axes.legend(
        loc="lower left", bbox_to_anchor=(0, 0.98), ncols=ncols, borderpad=0, borderaxespad=0.3,
        columnspacing=1.5, handlelength=2.6, handletextpad=0.5, labelspacing=0.2, frameon=False,
        fontsize=8,
    )  # fmt: skip
    legend.set_in_layout(False)  # the title keeps room for it


def save_pages(
    pages: Iterable[tuple[str, Figure]], directory: str | os.PathLike[str], dpi: int
) -> tuple[Path, ...]:
    """Write pages as they are made; no file changes before the last one is ready.

    Args:
        pages: Names of files, with what is to be in them.
        directory: An existing folder; files of these names in it are replaced.
        dpi: Dots per inch.

    Returns:
        The paths written.
    """
    dpi = integer("dpi", dpi, minimum=1)
    target = Path(directory)
    with tempfile.TemporaryDirectory(dir=target, prefix=".figures.") as folder:
        ready = []
        for name, figure in pages:
            ready.append(Path(folder, name))
            figure.savefig(ready[-1], dpi=dpi)
        for path in ready:
            os.replace(path, target / path.name)
    return tuple(target / path.name for path in ready)
