"""Sentences about designs: the templates, and how names, numbers and shares are written.

The decision page fills the same templates, ``sentences.json``, so that the page, the command, the
report and Python say the same.
"""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

_GROUPS = json.loads(Path(__file__).with_name("sentences.json").read_text("utf-8"))
SENTENCES: dict[str, str] = {
    name: text for group in _GROUPS.values() for name, text in group.items()
}
"""Templates by name, filled by ``str.format`` with texts only."""

_LONG = 1e9  # from here on numbers have an exponent


def sentence(name: str, **values: object) -> str:
    """Return a template of :data:`SENTENCES`, filled."""
    return SENTENCES[name].format(**values)


def capital(text: str) -> str:
    """Begin a sentence with the name of a design; a name that the user gave stays as it is."""
    ours = text.startswith(("design ", "row ", "test point "))
    return text[0].upper() + text[1:] if ours else text


def listed(names: Sequence[Any], word: str = "and") -> str:
    """Return names as a sentence lists them: "a, b and c"."""
    *before, last = map(str, names)
    return f"{', '.join(before)} {word} {last}" if before else last


def number(value: float, digits: int = 4) -> str:
    """Return a number with a few digits, none lost before the point: 0.1235, 1235, 59 990.

    From five digits on thousands are apart, by a space at which no line breaks.
    """
    value = value + 0.0  # no -0
    whole = abs(value) < _LONG and (abs(value) >= 10**digits - 0.5 or value == round(value))
    text = f"{value:,.0f}" if whole else f"{value:,.{digits}g}"
    text = re.sub(r"^(-?\d),(\d+)(?!,|\d)", r"\1\2", text)  # four digits stay together
    return text.replace(",", "\N{NO-BREAK SPACE}")


def percent(share: float) -> str:
    """Return a share with two digits, above 10 % with none behind the point."""
    hundreds = 100 * share
    if 0 < hundreds < 0.01:
        return "less than 0.01 %"
    return f"{hundreds:.0f} %" if hundreds >= 9.95 else f"{hundreds:.2g} %"


def wrapped(sentences: Sequence[str], columns: int = 80) -> str:
    """Return sentences in lines of at most so many columns, no percent sign off its number."""
    whole = (text.replace(" %", "\0%") for text in sentences)
    lines = (textwrap.fill(text, columns, break_on_hyphens=False) for text in whole)
    return "\n".join(lines).replace("\0", " ")
