"""The parts of a report: paragraphs, lists, tables and pictures, as the template takes them."""

from __future__ import annotations

import io
import re
from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from matplotlib import rc_context
from matplotlib.lines import Line2D

_MANY = 1000  # marks of a line that are drawn as an image, or they would fill the file
_DPI = 200  # of the marks that are too many for a drawing of each, as on good paper
# A number, with or without its share: columns of such cells stand to the right.
_NUMBER = re.compile(r"[-+−]?[\d.,]+(e[-+]?\d+)?([  ]%)?|—|∞|-?inf|nan|")


@dataclass(frozen=True)
class Table:
    """A table of texts: its head, its rows, and what it shows."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""

    @property
    def numeric(self) -> list[bool]:
        """Which columns hold numbers."""
        return [all(map(_NUMBER.fullmatch, column)) for column in zip(*self.rows, strict=True)]


@dataclass(frozen=True)
class Items:
    """A list of texts; cautions are to be seen first."""

    lines: tuple[str, ...]
    cautions: bool = False


@dataclass(frozen=True, eq=False)
class Picture:
    """What draws a figure of matplotlib, and in words what it shows."""

    draw: Callable[[], Any]
    caption: str

    def image(self) -> str:
        """Return the picture as the address of an image that holds it.

        As an image of its own nothing drawn in it can reach the rest of the document.
        """
        figure = self.draw()
        for line in figure.findobj(Line2D):
            if np.size(line.get_xdata()) > _MANY:
                line.set_rasterized(True)
        drawn = io.StringIO()
        with rc_context({"svg.fonttype": "path"}):  # whatever fonts the reader has
            figure.savefig(drawn, format="svg", dpi=_DPI, metadata={"Date": None})
        # Texts are drawn; their comments could hold what no XML may.
        svg = re.sub(r"<!--.*?-->", "", drawn.getvalue(), flags=re.DOTALL)
        return f"data:image/svg+xml;base64,{b64encode(svg.encode('utf-8')).decode('ascii')}"


Part: TypeAlias = str | Table | Items | Picture


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it."""

    title: str
    parts: tuple[Part, ...]
