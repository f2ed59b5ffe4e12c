"""What is read off a picture; and pictures that are left out, as they take most of the time."""

import io
import os
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from pymoo_psi.plots import plot_objectives


def saved_empty(figure, file, *args, **options):
    """Write a file or a stream, as ``Figure.savefig``, but nothing into it."""
    if isinstance(file, str | os.PathLike):
        Path(file).touch()
    else:
        file.write("" if isinstance(file, io.TextIOBase) else b"")


def texts(figure):
    """The names in the legends of a page, and those beside what they name."""
    found = [text for legend in figure.legends for text in legend.get_texts()]
    found += [text for ax in figure.axes for text in ax.texts]
    return [text.get_text() for text in found]


def shown(figure):
    return [ax for ax in figure.axes if ax.axison]


def plane(table, **options):
    """The only axes of a figure of two objectives."""
    (ax,) = shown(plot_objectives(table, **options))
    return ax


def assert_readable(figure):
    """No text is smaller than 7 points, and no name over another or off the axes it is in."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    for text in figure.findobj(Text):
        assert text.get_fontsize() >= 7 or not text.get_text()
        assert "$" not in text.get_text().replace(r"\$", "")  # raised digits are smaller
    for ax in figure.axes:
        names = [name for name in ax.texts if name.get_visible()]
        boxes = [Text.get_window_extent(name) for name in names]
        for k, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[:k]), names[k]
            is_inside = box.overlaps(ax.bbox) and ax.axison
            assert not is_inside or ax.bbox.padded(2).contains(*box.p0), names[k]


def assert_whole(figure, *, draw=False):
    """Nothing leaves the page, and its legends lie on no axes; a page that no test saves is drawn."""
    canvas = FigureCanvasAgg(figure)
    renderer = canvas.get_renderer()
    if draw or any(ax.name == "3d" for ax in figure.axes):
        canvas.draw()  # only drawing looks at a space from its side
    elif (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)  # what is where, at two thirds of the cost of drawing it as well
    boxes = {ax: ax.get_tightbbox(renderer) for ax in shown(figure)}
    legends = {legend: legend.get_window_extent(renderer) for legend in figure.legends}
    others = [text.get_window_extent(renderer) for text in figure.texts]
    others += [text.get_window_extent(renderer) for ax in figure.axes for text in ax.texts]
    size = np.array(canvas.get_width_height())
    for box in (*boxes.values(), *legends.values(), *others):
        assert (box.min >= -1).all()
        assert (box.max <= size + 1).all()
    for legend, place in legends.items():
        assert not [ax for ax, box in boxes.items() if place.overlaps(box)], legend
