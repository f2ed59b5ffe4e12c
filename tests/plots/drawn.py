"""What is read off a picture."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


def texts(owner):
    """The names in the legends of a page, or of axes."""
    legends = owner.legends if isinstance(owner, Figure) else [owner.get_legend()]
    return [text.get_text() for legend in legends for text in legend.get_texts()]


def shown(figure):
    return [ax for ax in figure.axes if ax.axison]


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
