"""What the drawings of a test table are of, and what is read off them."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

LIMITS = {"f1": 2.2, "f4": 1.0}
METALS = ("steel", "brass", "tin")


def sphere(x):
    return np.column_stack([(x**2).sum(axis=1), ((x - 1) ** 2).sum(axis=1)])


def render(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas.get_renderer()


def texts(owner):
    legends = owner.legends if isinstance(owner, Figure) else [owner.get_legend()]
    return [text.get_text() for legend in legends for text in legend.get_texts()]
