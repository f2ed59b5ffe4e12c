"""Sentences about designs: the templates, and names in them.

The decision page fills the same templates, ``sentences.json``, so that the page, the command, the
report and Python use the same wording.
"""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pymoo_psi._validation import Names

SENTENCES: dict[str, str] = {}
"""Templates by name, filled by ``str.format`` with texts only."""
for _group in json.loads(Path(__file__).with_name("sentences.json").read_text("utf-8")).values():
    SENTENCES.update(_group)


def sentence(name: str, /, **values: object) -> str:
    """Return a template of :data:`SENTENCES`, filled."""
    return SENTENCES[name].format(**values)


def capital(text: str) -> str:
    """Return the name of a design at the start of a sentence; a name of the user's is kept."""
    if re.match(r"(?:design|row|test) \d", text):
        return text[0].upper() + text[1:]
    return text


def with_article(name: str) -> str:
    """Return the name of a column in a sentence: "the price", but "f1"."""
    if re.match(r"[^\W\d_]{3,}(?!\w)", name):
        return f"the {name}"
    return name


def listed(names: Sequence[Any], word: str = "and") -> str:
    """Return names as a sentence lists them: "a, b and c"."""
    *first, last = map(str, names)
    if not first:
        return last
    return f"{', '.join(first)} {word} {last}"


def wrapped(sentences: Names, columns: int = 80) -> str:
    """Return sentences in lines of at most ``columns`` letters; no line starts with "%"."""
    lines = []
    for text in sentences:
        whole = text.replace(" %", "\0%")
        lines.append(textwrap.fill(whole, columns, break_on_hyphens=False))
    return "\n".join(lines).replace("\0", " ")
