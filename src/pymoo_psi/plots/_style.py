"""The look of every figure: sizes, colours, axes, legends, names; and figures as files.

Each colour goes with a marker or a line style of its own, so that a grey print says the same; the
darker a rank, the higher. A figure has panel letters and no title: what it shows is its caption.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from io import BytesIO
from itertools import cycle
from pathlib import Path
from string import ascii_lowercase
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._output import whole_file

Array = NDArray[np.float64]

# The colours are those of Okabe and Ito, which colour-blind readers can tell apart. The lengths of
# the three have no common factor: a look comes again after their product only.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
HUGE = 1e300  # from here on the length of an axis may overflow; such values are penalties
_WIDTH = 180.0  # of a figure in mm, over both columns of a journal
_SCREEN = 96  # dots per inch, as browsers count them
# A few values, this share of all, are outside of an axis if the others would take less than a
# fifth of it, and they are farther than four times the middle half from it.
_FEW, _FLAT, _FAR = 0.05, 1 / 5, 4.0
_STYLE: Any = {
    "figure.facecolor": "white",
    "axes.facecolor": "white",
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
        self.caption = " ".join(filter(None, [f"{title}." if title else "", *rest]))

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        picture = BytesIO()
        self.savefig(picture, format="png", dpi=2 * _SCREEN)
        width, height = (round(_SCREEN * inches) for inches in self.get_size_inches())
        return picture.getvalue(), {"width": width, "height": height}


@contextmanager
def new_figure(height: float) -> Iterator[Drawing]:
    """Give a figure of a height in mm to draw on, under the settings of this module.

    Several axes, unless too many for an alphabet, have letters in the end.
    """
    # Figure and not pyplot.figure, which would keep it in a list of open windows.
    with rc_context(_STYLE):
        figure = Drawing(figsize=(_WIDTH / 25.4, height / 25.4), layout="constrained")
        yield figure
        axes = [ax for ax in figure.axes if ax.axison or ax.name == "3d"]
        axes = [ax for ax in axes if ax.get_label() != "<colorbar>"]
        for letter, ax in zip(ascii_lowercase, axes if 1 < len(axes) <= 26 else (), strict=False):
            ax.set_title(f"({letter}) {ax.get_title('left')}".strip(), loc="left", fontsize=7.5)


@contextmanager
def panels(
    n: int, wide: int, *, head: float = 28.0, height: float = 0.0
) -> Iterator[tuple[Drawing, list[Any]]]:
    """Give a figure with n axes of a height in mm, ``wide`` in a row, and ``head`` for a legend."""
    high = -(-n // wide)
    with new_figure(head + high * (height or row_height(wide))) as figure:
        axes = figure.subplots(high, wide, squeeze=False).ravel().tolist()
        for ax in axes[n:]:
            ax.remove()
        yield figure, axes[:n]


def row_height(wide: int) -> float:
    """Return the height in mm of axes of which ``wide`` are beside each other, the fewer higher."""
    return {1: 60.0, 2: 46.0, 3: 40.0}.get(wide, 33.0)


def curves() -> Iterator[dict[str, Any]]:
    """Give colour, line style and marker of the first curve on common axes, the second, …."""
    for colour, line, marker in zip(cycle(_COLOURS), cycle(_LINES), cycle(_MARKERS), strict=False):
        yield {"color": colour, "linestyle": line, "marker": marker}


def legend_of(figure: Figure, axes: Iterable[Axes], *more: Any, **layout: Any) -> None:
    """Put a legend of what axes name, each label once, below them; small dots are enlarged."""
    pairs = [ax.get_legend_handles_labels() for ax in axes]
    entries = {label: handle for pair in pairs for handle, label in zip(*pair, strict=True)}
    entries |= {handle.get_label(): handle for handle in more}
    layout = {"ncols": 3, "fontsize": 7} | layout
    handles, labels = [*entries.values()], [*entries]
    legend = figure.legend(handles, labels, loc="outside lower center", **layout)
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and 0 < handle.get_markersize() < 5:
            handle.set_markersize(5)


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
    dpi: int = 150,
    suffix: str = ".png",
) -> tuple[Path, ...]:
    """Write figures by name as they are made; no file changes before the last one is ready.

    The caption of a figure is a text beside it, such as ``one.txt``. The suffix is that of a format
    of matplotlib, such as ``.png`` or ``.pdf``.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_figures([("one", Figure())], folder, 20, ".png")]
        ['one.png']
    """
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
