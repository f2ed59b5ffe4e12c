"""The style of all figures (size, colours, axes, legends, names), and figures as files.

Each colour comes with its own marker or line style, so that a grey print shows the same. Higher
ranks are darker. A figure has panel letters and no title; its caption says what it shows.
"""

from __future__ import annotations

import copy
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO, StringIO
from itertools import cycle
from pathlib import Path
from string import ascii_lowercase
from textwrap import fill
from typing import Any, TypeAlias

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._output import whole_file
from pymoo_psi._validation import finite_number, invalid, known_name
from pymoo_psi.page import without_outliers

Style: TypeAlias = dict[str, Any]

# The colours are those of Okabe and Ito, which colour-blind readers can tell apart. The lengths of
# the three have no common factor, so that a style is repeated only after their product.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
_HUGE = 1e300  # the length of an axis may overflow from here on; such values are penalties
_LEAST_TEXT = 0.75  # least scale of texts; those of ticks then have 5 points, as journals demand
_WIDTH = 180.0  # width of a figure in mm, over both columns of a journal
_SCREEN = 96  # dots per inch of browsers
_OUTLIERS = 0.05  # at most this share of the values may be outliers
_FLAT = 1 / 5  # outliers are left out if the other values would take less of the axis than this
_SETTINGS: Any = {
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
    "legend.edgecolor": "none",
    "lines.linewidth": 1.5,
}


class Drawing(Figure):
    """A figure with a caption, which stands beside it in reports and files.

    A notebook shows it without pyplot.

    Attributes:
        caption: Description of the figure in plain text.
    """

    caption = ""

    def describe(self, title: str, *sentences: str) -> None:
        """Set the caption. An empty title or sentence is left out."""
        parts = list(sentences)
        if title:
            parts.insert(0, f"{title}.")
        self.caption = " ".join(filter(None, parts))

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        picture = BytesIO()
        self.savefig(picture, format="png", dpi=2 * _SCREEN)
        width, height = self.get_size_inches()
        size = {"width": round(_SCREEN * width), "height": round(_SCREEN * height)}
        return picture.getvalue(), size


@contextmanager
def new_figure(height: float) -> Iterator[Drawing]:
    """Yield an empty figure of a height in mm, under the settings of this module.

    On leaving, its axes get letters.
    """
    # Figure and not pyplot.figure, which would keep it in a list of open windows.
    with rc_context(_SETTINGS):
        figure = Drawing(figsize=(_WIDTH / 25.4, height / 25.4), layout="constrained")
        yield figure
        _add_letters(figure)


def _add_letters(figure: Figure) -> None:
    """Write a letter above each of several axes; none if there are more than letters."""
    lettered = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
    if not 1 < len(lettered) <= len(ascii_lowercase):
        return
    for letter, ax in zip(ascii_lowercase, lettered, strict=False):
        ax.set_title(f"({letter})", loc="left", fontsize=7.5)


@contextmanager
def panels(
    n: int,
    n_columns: int,
    *,
    head: float = 28.0,
    height: float | None = None,
    **shared: Any,
) -> Iterator[tuple[Drawing, list[Any]]]:
    """Yield a figure and its ``n`` axes, filled row by row.

    Args:
        n: Number of axes.
        n_columns: Number of axes in a row.
        head: Height in mm for legend and captions of axes.
        height: Height of a row in mm, see :func:`row_height` by default.
        **shared: ``sharex`` and ``sharey`` of :meth:`matplotlib.figure.Figure.subplots`.
    """
    if height is None:
        height = row_height(n_columns)
    n_rows = -(-n // n_columns)  # rounded up
    with new_figure(head + n_rows * height) as figure:
        axes = figure.subplots(n_rows, n_columns, squeeze=False, **shared).ravel().tolist()
        for ax in axes[n:]:
            ax.remove()
        yield figure, axes[:n]


def row_height(n_columns: int) -> float:
    """Return the height in mm of axes in rows of ``n_columns``: fewer are higher."""
    heights = {1: 60.0, 2: 46.0, 3: 40.0}
    return heights.get(n_columns, 33.0)


def curves() -> Iterator[Style]:
    """Yield colour, line style and marker of the first curve on common axes, the second, …."""
    styles = zip(cycle(_COLOURS), cycle(_LINES), cycle(_MARKERS), strict=False)
    for colour, line, marker in styles:
        yield {"color": colour, "linestyle": line, "marker": marker}


def legend_of(figure: Figure, axes: Iterable[Axes], n_columns: int = 2) -> None:
    """Add one legend below the axes, in which each label occurs once and marks are large and plain.

    Two columns have room in the width of a column of a journal.
    """
    entries: dict[Any, Any] = {}
    for ax in axes:
        artists, labels = ax.get_legend_handles_labels()
        entries.update(zip(labels, artists, strict=True))
    place: Any = "outside lower center"
    legend = figure.legend(
        list(entries.values()), list(entries), loc=place, ncols=n_columns, fontsize=7
    )
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):
            handle.set(alpha=1.0, linewidth=1.5, markersize=max(5.0, handle.get_markersize()))


def literal(name: object, most: int = 40) -> str:
    """Return a name on one line as it is written; a ``$`` in it begins no formula.

    A name longer than ``most`` loses its middle, as names that begin alike often end with a number.

    Example:
        >>> print(literal("a very long name of mesh 17", 16))
        a very l…mesh 17
    """
    text = str(name)
    if isinstance(name, float):
        text = f"{name:.6g}"
    text = " ".join(text.split())
    if len(text) > most:
        text = f"{text[: most // 2]}…{text[-((most - 1) // 2) :]}"
    return text.replace("$", r"\$")


def view(values: ArrayLike, *further: float) -> tuple[float, float]:
    """Return the ends of an axis that shows values.

    Args:
        values: Values, whose outliers the axis does not show, as on the page.
        *further: Single values, which it shows. Values of ``1e300`` and more are ignored.
    """
    near = np.asarray(values, float).ravel()
    near = near[np.abs(near) < _HUGE]
    if len(near):
        core = without_outliers(near)
        is_few = len(near) - len(core) <= max(1, _OUTLIERS * len(near))
        if is_few and np.ptp(core) < _FLAT * np.ptp(near):
            near = core
    inside = np.append(near, further)
    inside = inside[np.abs(inside) < _HUGE]
    if len(inside) == 0:
        return 0.0, 1.0
    low = float(inside.min())
    high = float(inside.max())
    pad = 0.05 * (high - low)  # matplotlib has the same margins
    # One value but for rounding has a margin of its size.
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        pad = 0.05 * abs(low) or 0.5
    return low - pad, high + pad


def places_between(
    values: ArrayLike, worst: float, best: float
) -> tuple[NDArray[np.float64], bool]:
    """Return where values are on an axis from the worst value (0) to the best (1).

    Args:
        values: ``(n,)`` values of an objective.
        worst: The worst value.
        best: The best value.

    Returns:
        ``(n,)`` places, 1 where both ends are equal, and whether the axis is logarithmic, as it
        spans more than three decades.

    Example:
        >>> places_between([2.0, 3.0], 4.0, 2.0)
        (array([1. , 0.5]), False)
    """
    points = np.asarray(values, dtype=float)
    ends = np.array([worst, best])
    is_log = spans_decades(ends)
    if is_log:
        points, ends = np.log10(np.maximum(points, np.finfo(float).tiny)), np.log10(ends)
    if ends[0] == ends[1]:
        return np.ones(len(points)), False
    with np.errstate(over="ignore"):
        half = ends / 2  # no overflow
        return (points / 2 - half[0]) / (half[1] - half[0]), is_log


def spans_decades(values: ArrayLike) -> bool:
    """Whether positive values span more than three decades, which only a log axis shows."""
    near = np.asarray(values, dtype=float)
    return bool(near.min() > 0 and near.max() / 1e3 > near.min())


def svg_of(figure: Figure, dpi: int) -> str:
    """Return a figure as SVG, in which texts are paths, whatever fonts its reader has.

    Args:
        figure: The figure.
        dpi: Resolution of what is drawn as an image, in dots per inch.
    """
    text = StringIO()
    with rc_context({"svg.fonttype": "path"}):
        figure.savefig(text, format="svg", dpi=dpi, metadata={"Date": None})
    # The comments beside the paths hold the texts, and so what no XML may hold.
    return re.sub(r"<!--.*?-->", "", text.getvalue(), flags=re.DOTALL)


def _resized(figure: Figure, width: float) -> Figure:
    """Return a copy of a figure in another width in mm.

    Texts become less smaller than the width, and the height with them. Names of axes, such as
    "f1, time", continue on another line in a narrower figure.
    """
    figure = copy.deepcopy(figure)
    inches = figure.get_size_inches().tolist()
    scale = width / 25.4 / inches[0]
    size = min(1.0, max(_LEAST_TEXT, scale**0.5))
    figure.set_size_inches(inches[0] * scale, inches[1] * max(scale, size))
    for text in figure.findobj(Text):
        text.set_fontsize(text.get_fontsize() * size)
    if scale < 1:
        for ax in figure.axes:
            for axis in (ax.xaxis, ax.yaxis):
                axis.label.set_text(axis.label.get_text().replace(", ", ",\n", 1))
    return figure


def save_figures(
    figures: Mapping[str, Figure] | Iterable[tuple[str, Figure]],
    directory: str | os.PathLike[str],
    dpi: int = 150,
    suffix: str = ".png",
    *,
    width: float | None = None,
) -> tuple[Path, ...]:
    """Write figures to files; no file changes before the last figure is drawn.

    The caption of a figure is written to a text file beside it, such as ``one.txt``.

    Args:
        figures: Figures by their file name without suffix: a mapping, or pairs of a name and a
            figure, of which each is drawn before the next one is made.
        directory: Folder of the files; it is made if necessary.
        dpi: Resolution in dots per inch.
        suffix: Suffix of a format of matplotlib, such as ``.png`` or ``.pdf``. Fonts in PDF are
            TrueType, as journals demand.
        width: Width in mm, such as 90 and 180 for one and two columns. Narrow figures are
            relatively higher, and their texts up to a quarter smaller.

    Returns:
        The files of the figures.

    Raises:
        OSError: The folder or a file cannot be written.
        ArgumentValueError: matplotlib writes no files with the suffix.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_figures({"one": Figure()}, folder, 20, ".png")]
        ['one.png']
    """
    # Before the figures, whose computation may take long.
    known_name("suffix", suffix, [f".{name}" for name in Figure().canvas.get_supported_filetypes()])
    if width is not None and not 10 <= finite_number("width", width) <= 1000:
        raise invalid("width", "10 to 1000 mm", width)
    Path(directory).mkdir(parents=True, exist_ok=True)
    paths = []
    contents = {}
    if isinstance(figures, Mapping):
        figures = figures.items()
    for name, figure in figures:
        picture = BytesIO()
        if width is not None:
            figure = _resized(figure, width)
        with rc_context({"pdf.fonttype": 42, "ps.fonttype": 42}):
            figure.savefig(picture, format=suffix[1:], dpi=dpi)
        path = Path(directory, f"{name}{suffix}")
        paths.append(path)
        contents[path] = picture.getvalue()
        caption = getattr(figure, "caption", "")
        if caption:
            lines = fill(caption, 100)
            contents[Path(directory, f"{name}.txt")] = f"{lines}\n".encode()
    for path, content in contents.items():
        with whole_file(path) as temporary:
            temporary.write_bytes(content)
    return tuple(paths)
