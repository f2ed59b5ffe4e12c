"""The report as one HTML document: no script, no request, and pages for A4 and letter."""

from __future__ import annotations

import io
import re
from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import Any, TypeAlias

import numpy as np
from matplotlib import rc_context
from matplotlib.lines import Line2D

# Pictures are images of their own in the file: what is drawn in one cannot reach another, and the
# policy lets the document load nothing and run nothing, whatever a name in it looks like.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'"
_WORD = 24  # letters that a narrow column must hold unbroken
_MANY = 1000  # marks of a line that are drawn as an image, or they would fill the file
_DPI = 200  # of the marks that are too many for a drawing of each, as on good paper
# A number, with or without its unit or share: such cells stand to the right.
_NUMBER = re.compile(r"[-+−]?[\d.,]+(e[-+]?\d+)?( %)?|—|∞|-?inf|nan|")


@dataclass(frozen=True)
class Cells:
    """A table of texts: its head, its rows, and what it shows."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""


@dataclass(frozen=True)
class Items:
    """A list of texts; ``marked`` ones are to be seen first."""

    lines: tuple[str, ...]
    marked: bool = False


@dataclass(frozen=True, eq=False)
class Picture:
    """What draws a figure of matplotlib, and in words what it shows."""

    draw: Callable[[], Any]
    caption: str


Part: TypeAlias = str | Cells | Items | Picture


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it: paragraphs, lists, tables and pictures."""

    title: str
    parts: tuple[Part, ...]


def html_of(title: str, about: Sequence[str], sections: Sequence[Section]) -> str:
    """Return a document of sections, every text in it taken as text."""
    style = files("pymoo_psi.report").joinpath("report.css").read_text(encoding="utf-8")
    body = [f"<h1>{_text(title)}</h1>", *(f'<p class="about">{_text(line)}</p>' for line in about)]
    for section in sections:
        parts = [_part(part) for part in section.parts]
        body += ["<section>", f"<h2>{_text(section.title)}</h2>", *parts, "</section>"]
    return "\n".join([
        '<!DOCTYPE html>', '<html lang="en">', "<head>", '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="generator" content="pymoo-psi report">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{_text(title)}</title>", f"<style>\n{style}</style>", "</head>", "<body>", *body,
        "</body>", "</html>", "",
    ])  # fmt: skip


def _part(part: Part) -> str:
    if isinstance(part, str):
        return f"<p>{_text(part)}</p>"
    if isinstance(part, Items):
        lines = "".join(f"<li>{_text(line)}</li>" for line in part.lines)
        return f"<ul{' class=marked' if part.marked else ''}>{lines}</ul>"
    if isinstance(part, Cells):
        return _table(part)
    return (
        f'<figure><img src="{_image(part)}" alt="{_text(part.caption)}">'
        f"<figcaption>{_text(part.caption)}</figcaption></figure>"
    )


def _table(cells: Cells) -> str:
    # A column of numbers stands to the right, its head with it.
    right = [all(map(_NUMBER.fullmatch, column)) for column in zip(*cells.rows, strict=True)]

    def row(texts: Sequence[str], kind: str) -> str:
        sides = zip(texts, right or [False] * len(texts), strict=True)
        marks = []
        for text, number in sides:
            long = max(map(len, text.split()), default=0) > _WORD
            look = " class=n" if number else " class=long" if long else ""
            shown = _text(text).replace("_", "_<wbr>") if long else _text(text)
            marks.append(f"<{kind}{look}>{shown}</{kind}>")
        return f"<tr>{''.join(marks)}</tr>"

    # No caption element, which would be as narrow as the table.
    caption = f'<p class="caption">{_text(cells.caption)}</p>' if cells.caption else ""
    rows = "\n".join(row(texts, "td") for texts in cells.rows)
    return f"{caption}<table><thead>{row(cells.head, 'th')}</thead>\n<tbody>{rows}</tbody></table>"


def _text(text: str) -> str:
    """Return a text as HTML shows it: its marks as they are, no number apart from its per cent."""
    # Of the characters that HTML forbids only some that no one can see come this far.
    shown = re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]", "\N{REPLACEMENT CHARACTER}", text)
    return escape(shown.replace(" %", "\N{NO-BREAK SPACE}%"))


def _image(picture: Picture) -> str:
    """Return a picture as the address of an image that holds it."""
    figure = picture.draw()
    for line in figure.findobj(Line2D):
        if np.size(line.get_xdata()) > _MANY:
            line.set_rasterized(True)
    drawn = io.StringIO()
    with rc_context({"svg.fonttype": "path"}):  # whatever fonts the reader has
        figure.savefig(drawn, format="svg", dpi=_DPI, metadata={"Date": None})
    # Texts are drawn; their comments could hold what no XML may.
    svg = re.sub(r"<!--.*?-->", "", drawn.getvalue(), flags=re.DOTALL)
    return f"data:image/svg+xml;base64,{b64encode(svg.encode('utf-8')).decode('ascii')}"
