"""The style of all figures (size, colours, axes, names), and figures as files.

One accent colour marks the proposed or chosen design, all else is grey; curves differ in line style
and lightness, so that a grey print shows the same. No text is smaller than 7 points in any width. A
figure has panel letters and no title; its caption says what it shows. Names stand beside what they
name. They are placed when the figure is drawn, as its size decides where there is room.
"""

from __future__ import annotations

import copy
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from io import BytesIO, StringIO
from itertools import cycle, product
from pathlib import Path
from string import ascii_lowercase
from textwrap import fill
from typing import Any, TypeAlias

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.lines import Line2D
from matplotlib.path import Path as Line
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation, Text
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator, ScalarFormatter
from matplotlib.transforms import Bbox, ScaledTranslation
from numpy.typing import ArrayLike

from pymoo_psi._numbers import NumberFormat, number
from pymoo_psi._output import whole_file
from pymoo_psi._validation import Array, finite_number, invalid, known_name
from pymoo_psi.page import without_outliers

for weight in ("regular", "bold"):
    fontManager.addfont(Path(__file__).with_name(f"inter-{weight}.ttf"))

Style: TypeAlias = dict[str, Any]
ACCENT = "#0B5CAD"
INK = "#1A1A1A"
WIDTH = 180.0  # default width of a figure in mm, over both columns of a journal
NARROW = 120.0  # narrower figures have half as many panels side by side
HALO = withStroke(linewidth=2.4, foreground="white")  # around texts over lines and points
# Names beside what they name, by an offset in points.
BESIDE: Style = {"textcoords": "offset points", "annotation_clip": False}
# Names of lines that are no axes.
NOTE: Style = BESIDE | {"fontsize": 7, "color": "0.35", "zorder": 6, "path_effects": [HALO]}
ABOVE = ("data", "axes fraction")  # coordinates of names above axes


# Figures

_SETTINGS: Any = {
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "font.size": 7.5,
    "font.family": ["Inter", "DejaVu Sans"],  # that of the page; the second has other scripts
    "legend.handlelength": 1.2,
    "legend.handletextpad": 0.7,
    "axes.titlesize": 7.5,
    "axes.labelsize": 7.5,
    "figure.labelsize": 7.5,
    "figure.constrained_layout.h_pad": 0.08,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "0.45",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.5,
    "legend.fontsize": 7.0,
    "legend.title_fontsize": 7.0,
    "legend.frameon": False,
    "xtick.labelcolor": "0.3",
    "ytick.labelcolor": "0.3",
    "xtick.color": "0.45",
    "ytick.color": "0.45",
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.2,
    "lines.solid_capstyle": "round",
}
_NARROW_HEIGHT = 0.85  # of rows of panels in a narrower figure, as a share
_SCREEN = 96  # dots per inch of browsers


class Drawing(Figure):
    """A figure with a caption, which stands beside it in reports and files.

    A notebook shows it without pyplot.

    Attributes:
        caption: Description of the figure in plain text.
        placed: Functions that place names when the figure is drawn, each with its arguments.
        fitted: Functions of what follows from the width, each with its arguments; see :meth:`fit`.
        is_divisible: Whether its panels can be arranged in fewer columns.
        decimal: The decimal mark of its numbers.
    """

    caption: str = ""
    placed: tuple[tuple[Any, ...], ...] = ()
    fitted: tuple[tuple[Any, ...], ...] = ()
    is_divisible = False
    decimal = "."

    def draw(self, renderer: RendererBase) -> None:
        """Draw the figure, its names where there is room in its present size."""
        layout = self.get_layout_engine()
        if layout is not None:
            layout.execute(self)
        for place, *arguments in self.placed:
            place(*arguments)
        super().draw(renderer)

    def describe(self, title: str, *sentences: str) -> None:
        """Set the caption. An empty title or sentence is left out."""
        if title:
            title += "."
        self.caption = " ".join(filter(None, [title, *sentences]))

    def fit(self, function: Callable[..., None], *arguments: Any) -> None:
        """Let :meth:`resize` call a function of what follows from the width."""
        self.fitted += ((function, *arguments),)

    def resize(self, width: float) -> None:
        """Set the width in mm; texts keep their size.

        In a narrow figure panels that can be divided stand in half as many columns.
        """
        _require_width(width)
        size = self.get_size_inches()
        if width < NARROW <= size[0] * 25.4 and self.is_divisible:
            n = len(self.axes)
            before: Any = self.axes[0].get_gridspec()
            n_columns = max(before.ncols // 2, 1)
            grid: Any = self.add_gridspec(-(-n // n_columns), n_columns)
            for ax, place in zip(self.axes, grid, strict=False):
                ax.set_subplotspec(place)
                if place.is_first_col():
                    ax.tick_params(labelleft=True)
            size[1] *= _NARROW_HEIGHT * grid.nrows / before.nrows
        self.set_size_inches(width / 25.4, size[1])
        with rc_context(_SETTINGS):
            for function, *arguments in self.fitted:
                function(*arguments)

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        picture = BytesIO()
        self.savefig(picture, format="png", dpi=2 * _SCREEN)
        width, height = self.get_size_inches()
        size = {"width": round(_SCREEN * width), "height": round(_SCREEN * height)}
        return picture.getvalue(), size


def _require_width(width: float) -> None:
    """Refuse a width that is none of a figure in mm."""
    if not 10 <= finite_number("width", width) <= 1000:
        raise invalid("width", "10 to 1000 mm", width)


@contextmanager
def new_figure(height: float, width: float = WIDTH) -> Iterator[Drawing]:
    """Yield an empty figure of a height in mm, and give it its width in mm when it is complete."""
    # Figure and not pyplot.figure, which would keep it in a list of open windows.
    with rc_context(_SETTINGS):
        figure = Drawing(figsize=(WIDTH / 25.4, height / 25.4), layout="constrained")
        yield figure
    figure.resize(width)


@contextmanager
def panels(
    n: int,
    n_columns: int,
    *,
    head: float = 14.0,
    height: float | None = None,
    width: float = WIDTH,
    **shared: Any,
) -> Iterator[tuple[Drawing, list[Any]]]:
    """Yield a figure and its ``n`` axes, filled row by row.

    Args:
        n: Number of axes.
        n_columns: Number of axes in a row.
        head: Height in mm for what is above and below all axes.
        height: Height of a row in mm; by default fewer axes in a row are higher.
        width: Width in mm.
        **shared: ``sharex`` and ``sharey`` of :meth:`matplotlib.figure.Figure.subplots`.
    """
    if height is None:
        height = {1: 60.0, 2: 46.0, 3: 40.0}.get(n_columns, 33.0)
    n_rows = -(-n // n_columns)  # rounded up
    with new_figure(head + n_rows * height, width) as figure:
        axes = figure.subplots(n_rows, n_columns, squeeze=False, **shared).ravel().tolist()
        for ax in axes[n:]:
            ax.remove()
        yield figure, axes[:n]


def add_letters(figure: Figure) -> None:
    """Write a letter above each of several axes."""
    lettered = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
    for letter, ax in zip(ascii_lowercase, lettered, strict=False):
        ax.set_title(f"({letter})", loc="right")  # the name of the vertical axis is on the left


# Heights in mm, for pairs of columns.
_PANEL_HEIGHT = 33.0
_HEIGHT_OF_ONE = 60.0
_HEADING_HEIGHT = 7.0
_AXIS_HEIGHT = 9.0
_PADS = 6.0  # above and below the axes


def stack_pairs(figure: Drawing) -> None:
    """Set the height of a figure of pairs of columns."""
    grid: Any = figure.axes[0].get_gridspec()
    height = _PANEL_HEIGHT
    if len(figure.axes) == 1:
        height = _HEIGHT_OF_ONE
    total = _PADS + grid.nrows * (height + _HEADING_HEIGHT + _AXIS_HEIGHT)
    figure.set_figheight((total + height_of_key(figure)) / 25.4)


# Axes

_TICKS_WIDTH = 34.0  # left of axes
_TICK_WIDTH = 24.0  # of a number at an axis, with the room beside it
_MOST_TICKS = 6
_LEAST_TICKS = 3  # where there is room
_MOST_OPTIONS = 12  # options that have a tick each
_LETTER_WIDTH = 4.0  # points, about
# Where better values are, by the sign of an objective: in words, or by an arrow for want of room.
_BETTER = {1: "{}, less is better", -1: "{}, more is better", 0: "{}"}
_ARROWS = {
    "x": {1: "← {}", -1: "{} →", 0: "{}"},
    "y": {1: "↓ {}", -1: "↑ {}", 0: "{}"},
}


def name_axis(
    axes: Axes, letter: str, label: str, options: Sequence[object] = (), sign: int = 0
) -> None:
    """Write name and ticks of the axis "x" or "y", as much text as fits beside others.

    Args:
        axes: The axes.
        letter: Which axis.
        label: Its name; empty if it has its name, or none.
        options: Texts at 0, 1, …; empty for an axis of numbers.
        sign: 1 where less is better, -1 where more is better, else 0.
    """
    figure: Any = axes.figure
    grid: Any = axes.get_gridspec()
    room = figure.get_figwidth() * 72 / grid.ncols - _TICKS_WIDTH
    n_ticks = int(np.clip(room // _TICK_WIDTH, 1, _MOST_TICKS))
    if letter == "y":  # its name is above the axes, its ticks are above one another
        head_axes(axes)
        room += _TICKS_WIDTH / 2
        n_ticks = _MOST_TICKS - 1
    axis: Any = getattr(axes, f"{letter}axis")
    if label:
        _write_label(axis, letter, label, sign, room)
    if options:
        _write_options(axis, letter, options, room)
    else:
        _set_ticks(axis, n_ticks, figure.decimal)


def _write_label(axis: Any, letter: str, label: str, sign: int, room: float) -> None:
    """Write the name of an axis with where better values are, as much of it as has room."""
    axis.set_label_text(_BETTER[sign].format(literal(label)))
    for most in range(40, 2, -3):
        if extent(axis.label).width * 72 <= room * axis.figure.dpi:
            break
        axis.set_label_text(_ARROWS[letter][sign].format(literal(label, most)))


def _write_options(axis: Any, letter: str, options: Sequence[object], room: float) -> None:
    """Write options at 0, 1, …, or some of very many, upright if they have no room."""
    step = -(-len(options) // _MOST_OPTIONS)  # rounded up
    names = [literal(option, 14) for option in options[::step]]
    rotation = 0
    if letter == "x" and len("  ".join(names)) * _LETTER_WIDTH > room:
        rotation = 90
    axis.set_ticks(range(0, len(options), step), names, rotation=rotation)
    axis.grid(visible=False)


def _set_ticks(axis: Any, n: int, mark: str) -> None:
    """Let an axis of numbers have about n ticks, with a decimal mark."""
    low, high = sorted(axis.get_view_interval())
    if axis.get_scale() == "linear" or high < 10 * low:  # else a power of ten is on the axis
        least = min(n, _LEAST_TICKS)
        axis.set_major_locator(MaxNLocator(n, steps=[1, 2, 5, 10], min_n_ticks=least))
        axis.set_major_formatter(_Ticks(mark))
        return
    factors = [1.0]
    if high < 100 * low:
        factors = [1.0, 2.0, 5.0]
    axis.get_major_locator().set_params(subs=factors, numticks=n + 1)


class _Ticks(ScalarFormatter):
    """Numbers at ticks, in one format, with a decimal mark."""

    def __init__(self, mark: str) -> None:
        super().__init__()
        self.mark = mark

    def format_ticks(self, values: list[float]) -> list[str]:
        """Return the numbers at all ticks."""
        written = NumberFormat.of(values, mark=self.mark)
        text: Callable[[float], str] = written.text
        if written.has_powers:  # ticks are round numbers
            text = partial(number, mark=self.mark)
        return [raised(text(value)) for value in values]


def set_log(axes: Axes, letter: str, mark: str = ".") -> None:
    """Give the axis "x" or "y" a logarithmic scale, without raised digits, which are small."""
    axes.set(**{f"{letter}scale": "log"})
    axis = getattr(axes, f"{letter}axis")
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=5))
    axis.set_minor_locator(NullLocator())

    def text(value: float, _: object) -> str:
        """Return the number at a tick: as a power of ten if the ends of the axis need it."""
        low, high = sorted(axis.get_view_interval())
        if low >= 1e-3 and high <= 1e5:
            return number(value, mark=mark)
        return raised(NumberFormat(0, has_powers=True).text(value))

    axis.set_major_formatter(text)


_RAISED = str.maketrans("−0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")  # in full size, unlike those of formulas


def raised(text: str) -> str:
    """Return the text of a number with minus signs and its power of ten raised.

    Example:
        >>> raised("1.67e9"), raised("1e-4"), raised("-12.5")
        ('1.67×10⁹', '10⁻⁴', '−12.5')
    """
    text = text.replace("-", "−")
    factor, exponent, power = text.partition("e")
    if not exponent or power == "0":
        return factor
    if factor == "1":
        return f"10{power.translate(_RAISED)}"
    return f"{factor}×10{power.translate(_RAISED)}"


_AXIS_TO_NAME = 5.0  # points from the vertical axis up to its name
_LINE_HEIGHT = 9.5  # points


def head_axes(axes: Axes) -> None:
    """Move the name of the vertical axis above it, and above names such as those of limits."""
    above = _AXIS_TO_NAME
    if any(getattr(text, "xycoords", "") == ABOVE for text in axes.texts):
        above += _LINE_HEIGHT
    shift = ScaledTranslation(0, above / 72, axes.figure.dpi_scale_trans)
    axes.yaxis.label.set(rotation=0, ha="left", va="bottom")
    axes.yaxis.set_label_coords(0, 1, axes.transAxes + shift)


_OUTLIERS = 0.05  # at most this share of the values may be outliers
_LEAST_SHARE = 0.2  # of the axis; outliers that leave less to the other values are left out
_HUGE = 1e300  # the length of an axis may overflow from here on; such values are penalties


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
        if is_few and np.ptp(core) < _LEAST_SHARE * np.ptp(near):
            near = core
    inside = np.append(near, further)
    inside = inside[np.abs(inside) < _HUGE]
    if len(inside) == 0:
        return 0.0, 1.0
    low = float(inside.min())
    high = float(inside.max())
    pad = 0.08 * (high - low)  # for the markers and names at the ends
    if high - low <= 1e-9 * max(abs(low), abs(high)):  # one value but for rounding
        pad = 0.05 * abs(low) or 0.5
    return low - pad, high + pad


# Curves and keys

# Colour-blind readers can tell them apart; most are those of Okabe and Ito. The lengths of the
# three have no common factor, so that a style is repeated only after their product.
_COLOURS = ("#0B5CAD", "#1A1A1A", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")


def curves() -> Iterator[Style]:
    """Yield colour, line style and marker of the first curve on common axes, the second, …."""
    styles = zip(cycle(_COLOURS), cycle(_LINES), cycle(_MARKERS), strict=False)
    for colour, line, marker in styles:
        yield {"color": colour, "linestyle": line, "marker": marker}


_LEAST_MARKER = 3.0  # the least size of a marker in a key
_KEY_WIDTH = 0.95  # share of the width of the figure for a key


def add_key(figure: Drawing, axes: Sequence[Axes], heading: str = "") -> None:
    """Write what is labelled in axes above all of them, below a heading if there is one.

    Of the same label there is one mark of each kind, one over the other.
    """
    marks: dict[str, dict[type, Any]] = {}
    for ax in axes:
        for mark, label in zip(*ax.get_legend_handles_labels(), strict=True):
            marks.setdefault(label, {}).setdefault(type(mark), mark)
    handles = [tuple(kinds.values()) for kinds in marks.values()]
    figure.legends.clear()
    style: Style = {"title": heading, "alignment": "left"}
    _add_legend(figure, handles, list(marks), loc="outside upper left", **style)


def add_list(figure: Drawing, names: Sequence[str]) -> None:
    """Write names in columns below all axes, after the key above them."""
    handles = [Line2D([], [], linestyle="none") for _ in names]
    _add_legend(figure, handles, names, loc="outside lower left", handlelength=0, handletextpad=0)


def _add_legend(
    figure: Drawing, handles: Sequence[Any], labels: Sequence[str], **options: Any
) -> None:
    """Add a legend in as few rows as the width of the figure allows."""
    n = len(labels)
    for n_rows in range(1, n + 1):
        n_columns = -(-n // n_rows)  # rounded up
        legend = figure.legend(handles, labels, ncols=n_columns, **options)
        for handle in legend.legend_handles:
            if isinstance(handle, Line2D):
                handle.set_markersize(max(handle.get_markersize(), _LEAST_MARKER))
        if n_columns == 1 or legend.get_window_extent().width <= _KEY_WIDTH * figure.bbox.width:
            break
        legend.remove()


def height_of_key(figure: Drawing) -> float:
    """Return the height in mm of the key and the list of names; 0 if there are none."""
    layout: Any = figure.get_layout_engine()
    height = 0.0
    for legend in figure.legends:
        height += legend.get_window_extent().height / figure.dpi + 2 * layout.get()["h_pad"]
    return height * 25.4


# Names


def literal(name: object, most: int = 40) -> str:
    """Return a name on one line as it is written; a ``$`` in it begins no formula.

    A name longer than ``most`` loses its middle, as names that begin alike often end with a number.

    Example:
        >>> print(literal("a very long name of mesh 17", 16))
        a very l…mesh 17
    """
    text = " ".join(str(name).split())
    if len(text) > most:
        text = f"{text[: most // 2]}…{text[-((most - 1) // 2) :]}"
    return text.replace("$", r"\$")


def extent(text: Text) -> Bbox:
    """Return the box of a text in pixels of its figure, without that to which an arrow points.

    Where a figure was drawn before, texts would be measured in the pixels of that picture.
    """
    figure: Any = text.figure
    renderer: Any = RendererAgg  # matplotlib declares no types for it
    return Text.get_window_extent(text, renderer(1, 1, figure.dpi))


def name_lines(axes: Axes) -> None:
    """Write the labels of lines at their right ends, in their colours, none over another."""
    figure: Any = axes.figure
    names = []
    for line in axes.lines:
        points = np.asarray(line.get_xydata())
        points = points[np.isfinite(points).all(axis=1)]
        if len(points):
            style = BESIDE | {"color": line.get_color(), "va": "center"}
            names.append(axes.annotate(str(line.get_label()), points[-1], (5, 0), **style))
    figure.placed += ((_spread, axes, names),)


def _spread(axes: Axes, names: list[Annotation]) -> None:
    """Move names at right ends up until each is above the one below."""
    level = -np.inf
    heights = [extent(name).height * 72 / axes.figure.dpi for name in names]
    line = max(heights, default=0.0) + _CLEARANCE
    for name in sorted(names, key=lambda name: name.xy[1]):
        end = axes.transData.transform(name.xy)[1] * 72 / axes.figure.dpi
        level = max(level + line, end)
        name.xyann = (5, level - end)


_REACHES = (4.5, 8.0, 14.0, 20.0, 28.0, 40.0)  # points from a point to its name
_BESIDE_MARK = 1.5  # points more to the first name, whose dot is larger
# Where the box of a name is: its direction from the point, and which of its shares is there.
_DIRECTIONS = np.array(
    [(1, 0, 0, 0.5), (-1, 0, 1, 0.5)]
    + [(0, up, share, (1 - up) / 2) for share in (0.5, 0, 1, 0.25, 0.75) for up in (1, -1)]
    + [(right, up, (1 - right) / 2, (1 - up) / 2) for right in (1, -1) for up in (1, -1)]
)
_LEADER_FROM = 10.0  # points from which on a line leads from the point to its name
_BETWEEN_NAMES = 5.0  # points between names on a line
_MARKER_RADIUS = 4.0  # points
_COST_OF_POINT = 1000.0  # of a point in the way, in points of distance
_POINTS_PER_LINE = 1000  # a line in the way is as bad as so many points: a name would interrupt it
_CLEARANCE = 1.0  # points from a line to a name, and from one name to the next
# Names beside points.
_NAME_STYLE: Style = BESIDE | {
    "fontsize": 7,
    "va": "bottom",
    "path_effects": [HALO],
    "zorder": 8,
    "in_layout": False,
    "arrowprops": {
        "arrowstyle": "-",
        "color": "0.5",
        "linewidth": 0.5,
        "shrinkA": 0,
        "shrinkB": 3,
    },
}
_Place: TypeAlias = tuple[float, Bbox, Line | None]
"""The place of a name, its box and a line from afar; its cost is the distance in points, and more
for what it would cover."""


def name_points(
    axes: Axes, places: Array, names: Mapping[int, Sequence[str]], style: Style
) -> None:
    """Write names beside points, each where there is room when the figure is drawn.

    Args:
        axes: The axes.
        places: ``(n, 2)`` all points, which names avoid.
        names: Names by the row of their point, the most important first; each a text, and perhaps a
            shorter one for want of room.
        style: How the first name is written.
    """
    figure: Any = axes.figure
    placed = []
    for row, texts in names.items():
        placed.append(
            (axes.annotate(texts[0], places[row], (0, 0), **_NAME_STYLE | style), texts, row)
        )
        style = {}
    figure.placed += ((_place, axes, places, placed),)


def _place(
    axes: Axes, places: Array, names: Sequence[tuple[Annotation, Sequence[str], int]]
) -> None:
    """Write each name at its best place: the short text, then the long one where it has room."""
    dots = axes.transData.transform(places)
    annotations = [name for name, *_ in names]
    texts = [extent(text) for text in axes.texts if text.get_visible() and text not in annotations]
    curves = []
    for line in axes.lines:
        if line.get_linestyle() != "None":
            curves.append(line.get_transform().transform_path(line.get_path()))
    best: dict[int, _Place] = {}

    def place_of(name: Annotation, text: str, row: int) -> _Place:
        """Write a text, and return its best place beside what is there, and the other names."""
        others = [best[other] for other in best.keys() - {row}]
        taken = [box.padded(_BETWEEN_NAMES * axes.figure.dpi / 72, 0) for _, box, _ in others]
        leaders = [leader for *_, leader in others if leader is not None]
        name.set_visible(True)  # an invisible one has no size
        name.set_text(text)
        extra = _BESIDE_MARK if name is annotations[0] else 0.0
        return _best_place(axes, dots, row, extent(name), curves + leaders, texts + taken, extra)

    for name, words, row in names:
        best[row] = place_of(name, words[-1], row)
    for name, words, row in names:
        if len(words) > 1:
            place = place_of(name, words[0], row)
            if place[0] < _COST_OF_POINT:
                best[row] = place
            else:
                name.set_text(words[-1])
    for name, _, row in names:
        cost, box, leader = best[row]
        name.set_visible(cost < np.inf)
        arrow: Any = name.arrow_patch
        arrow.set_visible(leader is not None)
        if name.get_visible():
            name.xyann = tuple((box.p0 - dots[row]) / axes.figure.dpi * 72 + 1)


def _best_place(
    axes: Axes,
    dots: Array,
    row: int,
    text: Bbox,
    lines: Sequence[Line],
    taken: Sequence[Bbox],
    extra: float,
) -> _Place:
    """Return the best place of a text near its dot, whose cost is infinite if there is no room.

    Args:
        axes: The axes.
        dots: ``(n, 2)`` all dots.
        row: The row of that of the text.
        text: A box of the size of the text.
        lines: Lines, which texts avoid.
        taken: Boxes of other texts, over which there is no room.
        extra: By how many points its dot is larger than others.
    """
    point = axes.figure.dpi / 72
    size = text.padded(point).size
    dot = dots[row]
    others = np.delete(dots, row, axis=0)
    best: _Place = (np.inf, Bbox.null(), None)
    for reach, side in product(_REACHES, _DIRECTIONS):
        if best[0] < reach:  # whatever is farther costs more
            break
        low = dot + (reach + extra) * point * side[:2] - side[2:] * size
        box = Bbox([low, low + size])
        if box.count_overlaps(taken) or not all(map(axes.bbox.contains, *box.corners().T)):
            continue
        clear = box.padded(_CLEARANCE * point)
        n_bad = _POINTS_PER_LINE * sum(line.intersects_bbox(clear, filled=False) for line in lines)
        leader = None
        radius = reach  # it would name the nearest dot
        if reach > _LEADER_FROM:
            radius = _MARKER_RADIUS
            leader = Line([dot, (box.p0 + box.p1) / 2])
            n_bad += _crossed(leader, others, taken, _MARKER_RADIUS * point)
        n_bad += box.padded(radius * point).count_contains(others)
        if reach + _COST_OF_POINT * n_bad < best[0]:
            best = (reach + _COST_OF_POINT * n_bad, box, leader)
    return best


def _crossed(leader: Line, dots: Array, texts: Sequence[Bbox], radius: float) -> int:
    """Return how many dots and texts a straight line crosses."""
    begin, end = np.asarray(leader.vertices)
    way = end - begin
    along = np.clip((dots - begin) @ way / (way @ way), 0.0, 1.0)
    distances = np.hypot(*(dots - begin - np.outer(along, way)).T)
    n_texts = sum(leader.intersects_bbox(text, filled=False) for text in texts)
    return int(np.sum(distances < radius)) + n_texts


# Files


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


def save_figures(
    figures: Mapping[str, Figure] | Iterable[tuple[str, Figure]],
    folder: str | os.PathLike[str],
    *,
    dpi: int = 150,
    suffix: str = ".png",
    width: float | None = None,
) -> tuple[Path, ...]:
    """Write figures to files; no file changes before the last figure is drawn.

    The caption of a figure is written to a text file beside it, such as ``one.txt``.

    Args:
        figures: Figures by their file name without suffix: a mapping, or pairs of a name and a
            figure, of which each is drawn before the next one is made.
        folder: Folder of the files; it is made if necessary.
        dpi: Resolution in dots per inch.
        suffix: Suffix of a format of matplotlib, such as ``.png`` or ``.pdf``. Fonts in PDF are
            TrueType, as journals demand.
        width: Width in mm, such as 90 and 180 for one and two columns. Texts keep their size, 7
            points or more, and panels of narrow figures stand in fewer columns.

    Returns:
        The files of the figures.

    Raises:
        OSError: The folder or a file cannot be written.
        ArgumentValueError: matplotlib writes no files with the suffix.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_figures({"one": Figure()}, folder, dpi=20)]
        ['one.png']
    """
    # Before the figures, whose computation may take long.
    known_name("suffix", suffix, [f".{name}" for name in Figure().canvas.get_supported_filetypes()])
    if width is not None:
        _require_width(width)
    Path(folder).mkdir(parents=True, exist_ok=True)
    paths = []
    contents = {}
    if isinstance(figures, Mapping):
        figures = figures.items()
    for name, figure in figures:
        if width is not None:
            figure = copy.deepcopy(figure)
            if isinstance(figure, Drawing):
                figure.resize(width)
            else:
                figure.set_figwidth(width / 25.4)
        picture = BytesIO()
        with rc_context({"pdf.fonttype": 42, "ps.fonttype": 42}):
            figure.savefig(picture, format=suffix[1:], dpi=dpi)
        paths.append(Path(folder, f"{name}{suffix}"))
        contents[paths[-1]] = picture.getvalue()
        if isinstance(figure, Drawing) and figure.caption:
            contents[Path(folder, f"{name}.txt")] = f"{fill(figure.caption, 100)}\n".encode()
    for path, content in contents.items():
        with whole_file(path) as temporary:
            temporary.write_bytes(content)
    return tuple(paths)
