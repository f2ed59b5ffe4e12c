"""Tables for display: HTML in a notebook, LaTeX for a paper."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from pymoo_psi.errors import PsiError

if TYPE_CHECKING:
    import pandas as pd

ROWS = 10  # in a notebook
_COLUMNS = 24

# Characters of LaTeX commands, and those that its usual fonts have in formulas only.
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
    """A base class of what a notebook shows by its repr, its sentences and its first rows."""

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        """Return the first n rows and the number of all."""
        frame = self.to_frame()  # type: ignore[attr-defined]  # of every class that is shown
        return frame.head(n), len(frame)

    def _repr_html_(self) -> str:
        """Return the HTML that Jupyter shows; markup in names is escaped."""
        lines = [repr(self), *getattr(self, "sentences", ())]
        table = ""
        with suppress(PsiError):  # names that do not fit into one table
            frame, n = self._first_rows(ROWS)
            table = frame.to_html(
                max_cols=_COLUMNS, na_rep="", notebook=True, float_format=lambda v: f"{v:.5g}"
            )
            lines += [f"The first {len(frame)} of {n} rows:"] if n > len(frame) else []
        return "".join(f"<p>{html.escape(line)}</p>\n" for line in lines) + table


def latex_table(columns: Iterable[tuple[str, Iterable[Any]]]) -> str:
    """Return columns as a ``tabular`` of LaTeX with the rules of its package booktabs.

    Numbers of a column have the same number of decimals, enough to distinguish them.

    Args:
        columns: Of each column the heading, such as ``"f1 [mm]"``, and its values, numbers or
            texts. A letter with a number, such as f1 or mu2, is set as a symbol with its index.
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
    """Return LaTeX that prints the text; other scripts than Greek need LuaLaTeX."""
    return "".join(_CHARACTERS.get(c, c) for c in " ".join(text.split()))


def _heading(name: str) -> str:
    """Return a heading, its first word as a symbol if it is one: f1 as f with index 1."""
    symbol = re.match(r"(mu|[A-Za-z])(\d+)(?= |$)", name)
    if symbol is None:
        return escaped(name)
    letter = symbol[1].replace("mu", r"\mu")
    rest = name[symbol.end() :]
    return f"${letter}_{{{symbol[2]}}}${' ' if rest else ''}{escaped(rest)}"


def _cells(column: Iterable[Any]) -> tuple[bool, list[str]]:
    """Return whether a column holds numbers, and the text of each cell."""
    values: Sequence[Any] = list(column)
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values):
        texts = [str(v) for v in values]
        if all(re.fullmatch(r"-?[\d.]*", text) for text in texts):  # numbers, with their decimals
            return True, [f"${text}$" if text else "" for text in texts]
        return False, [escaped(text) for text in texts]
    finite = [v for v in values if math.isfinite(v)]
    most = max(map(abs, finite), default=0.0)
    if all(float(v).is_integer() for v in finite) and most < 1e7:
        return True, [_number(v, ".0f") for v in values]
    extent = max(finite) - min(finite)
    # Four digits of the largest value, and three of the column's range.
    decimals = 3 - math.floor(math.log10(most or 1.0))
    if extent > 0:
        decimals = max(decimals, 2 - math.floor(math.log10(extent)))
    plain = most < 1e7 and decimals <= 8
    return True, [_number(v, f".{max(decimals, 0)}f" if plain else ".4g") for v in values]


def _number(value: float, form: str) -> str:
    if math.isnan(value):
        return "--"
    # + 0 turns -0.0 into 0.0
    digits, _, power = f"{value + 0:{form}}".replace("inf", r"\infty").partition("e")
    if power:
        digits += rf"\cdot 10^{{{int(power)}}}"
    return f"${digits}$"
