"""Tables for readers: short ones in a notebook, and LaTeX for a paper."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

ROWS = 10  # that a notebook shows: a table of 100 000 tests is asked for by to_frame()
_COLUMNS = 24

# What LaTeX takes for a command, and what its usual fonts have in formulas only.
_CHARACTERS = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    "<": "$<$", ">": "$>$", "|": "$|$", "−": "$-$", "≤": r"$\le$", "≥": r"$\ge$", "±": r"$\pm$",
    "·": r"$\cdot$", "×": r"$\times$", "°": r"$^\circ$", "²": "$^2$", "³": "$^3$", "µ": r"$\mu$",
    "∞": r"$\infty$", "…": r"\ldots{}",
} | {c: f"\\{c}" for c in "{}$&%#_"}  # fmt: skip
_GREEK = {
    "αβγδεζηθικλμ": "alpha beta gamma delta varepsilon zeta eta theta iota kappa lambda mu",
    "νξπρστυφχψω": "nu xi pi rho sigma tau upsilon varphi chi psi omega",
    "ΓΔΘΛΞΠΣΦΨΩ": "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega",
}
_CHARACTERS |= {
    letter: rf"$\{name}$"
    for letters, names in _GREEK.items()
    for letter, name in zip(letters, names.split(), strict=True)
}


class Shown:
    """What a notebook shows as its name and a short table."""

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        """Return the first n rows, for a reader, and how many there are."""
        frame = self.to_frame()  # type: ignore[attr-defined]  # of every class that is shown
        return frame.head(n), len(frame)

    def _repr_html_(self) -> str:
        """Return what Jupyter shows; names are data, and no markup of theirs is."""
        lines = [repr(self)]
        table = ""
        with suppress(ValueError):  # of names that do not fit into one table
            frame, n = self._first_rows(ROWS)
            table = frame.to_html(
                max_cols=_COLUMNS, na_rep="", notebook=True, float_format=lambda v: f"{v:.5g}"
            )
            lines += [f"The first {len(frame)} of {n} rows:"] if n > len(frame) else []
        return "".join(f"<p>{html.escape(line)}</p>\n" for line in lines) + table


def latex_table(columns: Iterable[tuple[str, Iterable[Any]]]) -> str:
    """Return columns as a ``tabular`` of LaTeX with the rules of its package booktabs.

    Numbers of a column have the same number of decimals, enough to tell them apart.

    Args:
        columns: Of each the heading, such as ``"f1 [mm]"``, and its values, numbers or texts as
            they are to be read. A letter with a number, such as f1 or mu2, is set as a symbol
            with its index.
    """
    headings, values = zip(*columns, strict=True)
    cells = [_cells(column) for column in values]
    sides = "".join("r" if right else "l" for right, _ in cells)
    rows = zip(*(texts for _, texts in cells), strict=True)
    lines = [
        rf"\begin{{tabular}}{{{sides}}}",
        r"\toprule",
        _row(map(_heading, headings)),
        r"\midrule",
        *(_row(row) for row in rows),
        r"\bottomrule",
        r"\end{tabular}",
    ]
    return "\n".join(lines) + "\n"


def _row(cells: Iterable[str]) -> str:
    return f"{' & '.join(cells)} \\\\"


def escaped(text: str) -> str:
    """Return text as LaTeX that prints just it; of other scripts than Greek by LuaLaTeX only."""
    return "".join(_CHARACTERS.get(c, c) for c in " ".join(text.split()))


def _heading(name: str) -> str:
    """Return a heading, its first word as a symbol if it is one: f1 as f with the index 1."""
    symbol = re.match(r"(mu|[A-Za-z])(\d+)(?= |$)", name)
    if symbol is None:
        return escaped(name)
    letter = symbol[1].replace("mu", r"\mu")
    rest = name[symbol.end() :]
    return f"${letter}_{{{symbol[2]}}}${' ' if rest else ''}{escaped(rest)}"


def _cells(column: Iterable[Any]) -> tuple[bool, list[str]]:
    """Return whether a column is of numbers, and the text of each of its cells."""
    values: Sequence[Any] = list(column)
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values):
        texts = [str(v) for v in values]
        if all(re.fullmatch(r"-?[\d.]*", text) for text in texts):  # numbers, with their decimals
            return True, [f"${text}$" if text else "" for text in texts]
        return False, [escaped(text) for text in texts]
    known = [abs(v) for v in values if math.isfinite(v)]
    most = max(known, default=0.0)
    if all(float(v).is_integer() for v in known) and most < 1e7:
        return True, [_number(v, ".0f") for v in values]
    signed = [v for v in values if math.isfinite(v)]
    span = max(signed) - min(signed)
    # Four digits of the largest value, and three of the difference of the ends.
    decimals = 3 - math.floor(math.log10(most or 1.0))
    if span > 0:
        decimals = max(decimals, 2 - math.floor(math.log10(span)))
    plain = most < 1e7 and decimals <= 8
    return True, [_number(v, f".{max(decimals, 0)}f" if plain else ".4g") for v in values]


def _number(value: float, form: str) -> str:
    if math.isnan(value):
        return "--"
    # Plus 0, as -0.0, a zero whose sign was turned, is 0 to a reader.
    digits, _, power = f"{value + 0:{form}}".replace("inf", r"\infty").partition("e")
    if power:
        digits += rf"\cdot 10^{{{int(power)}}}"
    return f"${digits}$"
