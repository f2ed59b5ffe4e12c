"""How every figure looks: curves, pages, legends, names; and pages as files.

Each colour goes with a marker or a line style of its own, so that a grey print says the same.
"""

from __future__ import annotations

import os
import re
import tempfile
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.container import Container
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator
from numpy.typing import NDArray

from pymoo_psi._validation import integer

# The first, second and third curve on the same axes.
CURVES: tuple[dict[str, Any], ...] = (
    {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    {"color": "#D55E00", "linestyle": "--", "marker": "s"},
    {"color": "#000000", "linestyle": "-.", "marker": "^"},
)

FIGURE_SUFFIXES = (".png", ".pdf", ".svg")
# From here on the length of an axis may overflow; such values are penalties or mistakes.
HUGE = 1e300
LETTERS = 96  # of a line of a title over the width of a page
FILE_LETTERS = 60  # of a file's name as a title, also over axes that are narrower
_WIDTH = 180.0  # of a page in mm, over both columns of a journal
_SCREEN = 96  # dots per inch, as browsers count them

_PAGE: Any = {
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


class Page(Figure):
    """A figure that a notebook shows without pyplot, which would register it as a window."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        # Asked for only where IPython has no printer of figures, which `%matplotlib` sets: so a
        # page is shown once. Twice as fine as its size on the screen, for screens that are so.
        picture = BytesIO()
        self.savefig(picture, format="png", dpi=2 * _SCREEN)
        width, height = (round(_SCREEN * inches) for inches in self.get_size_inches())
        return picture.getvalue(), {"width": width, "height": height}


class PageAxes(Axes):
    """Axes of a page of their own, which a notebook shows by them."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]] | None:
        page = self.get_figure()
        return page._repr_png_() if isinstance(page, Page) else None


@contextmanager
def new_page(
    height: float, *, width: float = _WIDTH, layout: Literal["constrained"] | None = "constrained"
) -> Iterator[Figure]:
    """Give a page to draw on, its size in mm; matplotlib's settings are the pages' meanwhile.

    It is known to no window system, and a notebook shows it.
    """
    # Figure and not pyplot.figure, which would keep it in a list of open windows.
    with rc_context(_PAGE):
        yield Page(figsize=(width / 25.4, height / 25.4), layout=layout)


@contextmanager
def on_axes(ax: Axes | None) -> Iterator[Axes]:
    """Give the axes to draw on: those given, in whatever style, or new ones in the pages' style."""
    if ax is not None:
        yield ax
        return
    with new_page(90.0, width=120.0) as figure:
        yield figure.add_subplot(axes_class=PageAxes)


def tick_counts(axes: Axes, *, x: int | None = None, y: int | None = None) -> None:
    """Set how many intervals an axis has at the most."""
    for axis, count in ((axes.xaxis, x), (axes.yaxis, y)):
        if count is not None:
            axis.set_major_locator(MaxNLocator(count))


def logarithmic(axes: Axes, letter: str, ticks: Sequence[float]) -> None:
    """Make an axis logarithmic, with ticks at so many times a power of ten, as plain numbers."""
    getattr(axes, f"set_{letter}scale")("log")
    axis = axes.xaxis if letter == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=ticks))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def enlarge_markers(legend: Legend) -> None:
    """Let the small dots of a legend be seen."""
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and 0 < handle.get_markersize() < 5:
            handle.set_markersize(5)


def legend_below(axes: Axes, *, ncols: int) -> None:
    """Put a legend under the axes and the text of their horizontal axis."""
    legend = axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=4.5, ncols=ncols,
        frameon=False, columnspacing=1.2, handletextpad=0.5,
    )  # fmt: skip
    enlarge_markers(legend)


def named_legend(
    owner: Axes | Figure,
    entries: Iterable[tuple[str, Artist | Container]],
    *,
    loc: Any,
    ncols: int = 1,
    title: str = "",
    handlelength: float = 2.0,
) -> Legend:
    """Put a legend in axes or on a page, in which every name stands as it is given."""
    names, handles = zip(*entries, strict=True)
    legend: Legend = owner.legend(
        list(handles), [" "] * len(names), loc=loc, ncols=ncols, title=title or None, fontsize=7,
        title_fontsize=7, alignment="left", handlelength=handlelength,
    )  # fmt: skip
    # Given above, a name that begins with an underscore would be left out.
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_text(name)
    return legend


def literal(name: object, most: int = 40) -> str:
    """Return a name on one line, as it is written: a ``$`` in it begins no formula.

    Args:
        name: A name or a value.
        most: Characters; of a longer name the middle is left out, as names that begin alike often
            end with a number.
    """
    text = " ".join((f"{name:.6g}" if isinstance(name, float) else str(name)).split())
    if len(text) > most:
        end = (most - 1) // 2
        text = f"{text[: most - 1 - end]}…{text[len(text) - end :]}"
    return text.replace("$", r"\$")


def wrapped(text: str, letters: int) -> str:
    """Return text in lines of so many letters; a number stays with its sign and its unit."""
    kept = re.sub(r"(?<=[<>=≤≥]) | (?=(?:%|[<>]=) )", "\0", text)
    return "\n".join(textwrap.wrap(kept, letters)).replace("\0", " ")


def view(values: NDArray[np.float64], *further: float) -> tuple[float, float]:
    """Return the ends of an axis that shows the values, and numbers, unless beyond ``HUGE``."""
    known = np.array([*values, *further])
    known = known[np.abs(known) < HUGE]
    if len(known) == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    pad = 0.05 * (high - low)  # as matplotlib's own margins
    if not high - low > 1e-9 * max(abs(low), abs(high)):  # one value but for rounding
        pad = 0.05 * abs(low) or 0.5
    return low - pad, high + pad


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
    # In the target's own folder, as files are replaced at once only within a file system.
    with tempfile.TemporaryDirectory(dir=target, prefix=".figures.") as folder:
        ready = []
        for name, figure in pages:
            ready.append(Path(folder, name))
            figure.savefig(ready[-1], dpi=dpi)
        for path in ready:
            os.replace(path, target / path.name)
    return tuple(target / path.name for path in ready)
