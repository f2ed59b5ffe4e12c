"""Sentences about designs: the templates, and the format of names, numbers and shares.

The decision page fills the same templates, ``sentences.json``, so that the page, the command, the
report and Python use the same wording.
"""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from pymoo_psi._validation import Names

SENTENCES: dict[str, str] = {}
"""Templates by name, filled by ``str.format`` with texts only."""
for _group in json.loads(Path(__file__).with_name("sentences.json").read_text("utf-8")).values():
    SENTENCES.update(_group)

_MARK = ContextVar("_MARK", default=".")  # the decimal mark
_ALL = 100 - 1e-7  # per cent, up to rounding
_LONG = 1e9  # numbers from this size on have an exponent


def sentence(name: str, /, **values: object) -> str:
    """Return a template of :data:`SENTENCES`, filled."""
    return SENTENCES[name].format(**values)


def capital(text: str) -> str:
    """Return the name of a design at the start of a sentence; a name of the user's is kept."""
    if text.startswith(("design ", "row ", "test ")):
        return text[0].upper() + text[1:]
    return text


def listed(names: Sequence[Any], word: str = "and") -> str:
    """Return names as a sentence lists them: "a, b and c"."""
    *first, last = map(str, names)
    if not first:
        return last
    return f"{', '.join(first)} {word} {last}"


@contextmanager
def decimal_mark(mark: str) -> Iterator[None]:
    """Write numbers with a decimal mark, that of their source; "" leaves that in force."""
    before = _MARK.set(mark or _MARK.get())
    try:
        yield
    finally:
        _MARK.reset(before)


def localized(text: str) -> str:
    """Return the text of a number with the decimal mark in force."""
    return text.replace(".", _MARK.get())


def number(value: float, digits: int = 4) -> str:
    """Return a number with a few digits, but all of those before the point: 0.1235, 1235, 59 990.

    From five digits on, no-break spaces separate the thousands.
    """
    value = value + 0.0  # no -0
    text = f"{value:,.{digits}g}"
    if abs(value) < _LONG and (abs(value) >= 10**digits - 0.5 or value == round(value)):
        text = f"{value:,.0f}"
    text = re.sub(r"^(-?\d),(\d+)(?!,|\d)", r"\1\2", text)  # four digits stay together
    return localized(text.replace(",", "\N{NO-BREAK SPACE}"))


def percent(share: float) -> str:
    """Return a share with two digits, from 10 % on as a whole number; "—" for NaN."""
    if share != share:
        return "—"
    hundreds = 100 * share
    if 0 < hundreds < 0.01:
        return "less than 0.01 %"
    if 99.5 <= hundreds < _ALL:
        return "more than 99 %"
    if hundreds >= 9.95:
        return f"{hundreds:.0f} %"
    return localized(f"{hundreds:.2g} %")


def wrapped(sentences: Names, columns: int = 80) -> str:
    """Return sentences in lines of at most ``columns`` letters; no line starts with "%"."""
    lines = []
    for text in sentences:
        whole = text.replace(" %", "\0%")
        lines.append(textwrap.fill(whole, columns, break_on_hyphens=False))
    return "\n".join(lines).replace("\0", " ")
