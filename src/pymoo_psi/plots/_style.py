"""The look of every figure: sizes, colours, axes, legends, names; and figures as files.

Each colour goes with a marker or a line style of its own, so that a grey print says the same; the
darker a rank, the higher. A figure has panel letters and no title: what it shows is its caption.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from string import ascii_lowercase
from textwrap import fill
from typing import Any, Literal, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._output import whole_file
from pymoo_psi._validation import integer, known_name

Array = NDArray[np.float64]

# The colours are those of Okabe and Ito, which colour-blind readers can tell apart.
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
    3: Marker("^", "#9ECAE1", 5.0, level=4.0),
    4: Marker("s", "#4292C6", 3.4, level=3.0),
    5: Marker("D", "#08519C", 5.0, level=5.0),
    6: Marker("*", "#D55E00", 11.0, level=6.0),
}

# The first, second and third curve on the same axes.
CURVES: tuple[dict[str, Any], ...] = (
    {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    {"color": "#D55E00", "linestyle": "--", "marker": "s"},
    {"color": "#000000", "linestyle": "-.", "marker": "^"},
)
HUGE = 1e300  # from here on the length of an axis may overflow; such values are penalties
_SUFFIXES = (".png", ".pdf", ".svg")
_WIDTH = 180.0  # of a figure in mm, over both columns of a journal
_SCREEN = 96  # dots per inch, as browsers count them
# A few values, this share of all, are outside of an axis if the others would take less than a
# fifth of it, and they are farther than four times the middle half from it.
_FEW, _FLAT, _FAR = 0.05, 1 / 5, 4.0
_MANY = 200  # from here on the markers of a group shrink
_RASTERIZED = 2000  # markers that a vector format would draw one by one, slowly

_STYLE: Any = {
    "figure.facecolor": "white",
    "figure.titlesize": 9.0,
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


class Drawing(Figure):
    """A figure with a caption, which stands beside it in reports and files.

    A notebook shows it without pyplot, which would register it as a window.

    Attributes:
        caption: What is shown, in plain text.
    """

    caption = ""

    def describe(self, *sentences: str) -> None:
        """Set the caption; the first is a title, which may be empty."""
        title, *rest = sentences
        self.caption = " ".join([*([f"{title}."] if title else []), *rest])

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        picture = BytesIO()
        self.savefig(picture, format="png", dpi=2 * _SCREEN)
        width, height = (round(_SCREEN * inches) for inches in self.get_size_inches())
        return picture.getvalue(), {"width": width, "height": height}


@contextmanager
def new_figure(
    height: float, *, width: float = _WIDTH, layout: Literal["constrained"] | None = "constrained"
) -> Iterator[Drawing]:
    """Give a figure of a size in mm to draw on, under the settings of this module.

    Several axes, unless too many for an alphabet, have letters in the end.
    """
    # Figure and not pyplot.figure, which would keep it in a list of open windows.
    with rc_context(_STYLE):
        figure = Drawing(figsize=(width / 25.4, height / 25.4), layout=layout)
        yield figure
        axes = [ax for ax in figure.axes if ax.axison or ax.name == "3d"]
        axes = [ax for ax in axes if ax.get_label() != "<colorbar>"]
        for letter, ax in zip(ascii_lowercase, axes if 1 < len(axes) <= 26 else (), strict=False):
            ax.set_title(f"({letter}) {ax.get_title('left')}".strip(), loc="left", fontsize=7.5)


@contextmanager
def panels(n: int, wide: int, *, head: float = 28.0) -> Iterator[tuple[Drawing, list[Any]]]:
    """Give a figure with n axes, so many beside each other, and ``head`` mm for the legend."""
    high = -(-n // wide)
    with new_figure(head + high * row_height(wide)) as figure:
        axes = figure.subplots(high, wide, squeeze=False).ravel().tolist()
        for ax in axes[n:]:
            ax.remove()
        yield figure, axes[:n]


def row_height(wide: int) -> float:
    """Return the height in mm of axes of which ``wide`` are beside each other, the fewer higher."""
    return {1: 60.0, 2: 46.0, 3: 40.0}.get(wide, 33.0)


def legend_of(figure: Figure, entries: Mapping[str, Any], **layout: Any) -> None:
    """Put a legend below the axes of a figure, small dots enlarged."""
    layout = {"loc": "outside lower center"} | layout
    legend: Legend = figure.legend(list(entries.values()), list(entries), **layout)
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and 0 < handle.get_markersize() < 5:
            handle.set_markersize(5)


def labelled(axes: Iterable[Axes]) -> dict[str, Any]:
    """Return what axes name in legends: each label once, with its handle."""
    pairs = [ax.get_legend_handles_labels() for ax in axes]
    return {label: handle for pair in pairs for handle, label in zip(*pair, strict=True)}


class Group(NamedTuple):
    """Designs that are drawn alike: their rows and their marker."""

    rows: NDArray[np.intp]
    marker: Marker

    def look(self, name: str) -> dict[str, Any]:
        """Return the arguments of ``plot``; the larger the group, the smaller its markers."""
        n = len(self.rows)
        shrink = float(np.clip((_MANY / max(n, 1)) ** 0.3, 0.3, 1.0))
        marker = self.marker._replace(size=self.marker.size * shrink)
        # Edges of many would cover the others; a cross has no other colour than its edge.
        edge = "none" if n > _MANY or marker.shape == "." else "black"
        edge = marker.colour if marker.shape == "x" else edge
        return {
            **marker.look(edge, 0.5 * shrink),
            "zorder": self.marker.level + 1 / (1 + n),  # the rarer on top
            "label": f"{name} ({n})",
            "rasterized": n > _RASTERIZED,
        }


def draw_points(
    axes: Axes, x: Array, y: Array, groups: Mapping[str, Group], shown: NDArray[np.bool_]
) -> None:
    """Draw designs in a plane, each group with its marker; legends count the whole group."""
    for name, group in groups.items():
        rows = group.rows[shown[group.rows]]
        axes.plot(x[rows], y[rows], **group.look(name))


def literal(name: object, most: int = 40) -> str:
    """Return a name on one line, as it is written: a ``$`` in it begins no formula.

    Of a name longer than ``most`` the middle is left out, as names that begin alike often end
    with a number.

    Example:
        >>> print(literal("a very long name of mesh 17", 16))
        a very l…mesh 17
    """
    text = " ".join((f"{name:.6g}" if isinstance(name, float) else str(name)).split())
    if len(text) > most:
        end = (most - 1) // 2
        text = f"{text[: most - 1 - end]}…{text[len(text) - end :]}"
    return text.replace("$", r"\$")


def view(values: ArrayLike, *further: float) -> tuple[float, float]:
    """Return the ends of an axis that shows the values, and numbers, unless beyond ``HUGE``.

    Of the values a few that are far from all others are outside of it, see :func:`core`.
    """
    known = np.append(core(np.asarray(values, float).ravel()), further)
    known = known[np.abs(known) < HUGE]
    if len(known) == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    pad = 0.05 * (high - low)  # as matplotlib's own margins
    if not high - low > 1e-9 * max(abs(low), abs(high)):  # one value but for rounding
        pad = 0.05 * abs(low) or 0.5
    return low - pad, high + pad


def core(values: Array) -> Array:
    """Return values without the few that would flatten the others on a common axis.

    Example:
        >>> float(core(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1000.0])).max())
        6.0
    """
    known = values[np.abs(values) < HUGE]
    if len(known) < 5:
        return known
    low, high = np.quantile(known, [0.25, 0.75])
    reach = _FAR * (high - low)
    inside = (known >= low - reach) & (known <= high + reach)
    few = len(known) - inside.sum() <= max(1, _FEW * len(known))
    return known[inside] if few and 0 < np.ptp(known[inside]) < _FLAT * np.ptp(known) else known


def save_figures(
    figures: Iterable[tuple[str, Figure]],
    directory: str | os.PathLike[str],
    dpi: int,
    suffix: str,
) -> tuple[Path, ...]:
    """Write figures by name as they are made; no file changes before the last one is ready.

    The caption of a figure is a text beside it, such as ``one.txt``.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_figures([("one", Figure())], folder, 20, ".png")]
        ['one.png']
    """
    dpi = integer("dpi", dpi, minimum=1)
    suffix = known_name("suffix", suffix, _SUFFIXES)
    ready = {}
    for name, figure in figures:
        drawn = BytesIO()
        figure.savefig(drawn, format=suffix[1:], dpi=dpi)
        ready[Path(directory, f"{name}{suffix}")] = drawn.getvalue()
        if caption := getattr(figure, "caption", ""):
            ready[Path(directory, f"{name}.txt")] = f"{fill(caption, 100)}\n".encode()
    for path, picture in ready.items():
        with whole_file(path) as written:
            written.write_bytes(picture)
    return tuple(path for path in ready if path.suffix == suffix)
