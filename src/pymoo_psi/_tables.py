"""Tables for readers: short ones in a notebook, and LaTeX for a paper."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

ROWS = 10  # that a notebook shows: a table of 100 000 tests is asked for by to_frame()
_COLUMNS = 24


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

    Numbers of a column have the same number of decimals, enough to tell them apart. Greek letters
    in names need LuaLaTeX or XeLaTeX.

    Args:
        columns: Of each the heading, such as ``"f1 [mm]"``, and its values, numbers or texts as
            they are to be read.
    """
    import pandas as pd

    headings, values = zip(*columns, strict=True)
    cells = [_texts(list(column)) for column in values]
    numeric = [all(re.fullmatch(r"[-+.\de]*|nan|inf", text) for text in texts) for texts in cells]
    frame = pd.DataFrame(dict(enumerate(cells))).set_axis(list(headings), axis=1)
    sides = "".join("r" if right else "l" for right in numeric)
    return frame.to_latex(index=False, escape=True, column_format=sides)


def _texts(values: list[Any]) -> list[str]:
    """Return the cells of a column."""
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values):
        return [str(value) for value in values]
    known = [value for value in values if math.isfinite(value)]
    most = max(map(abs, known), default=0.0)
    decimals = 0
    if not all(float(value).is_integer() for value in known):
        # four digits of the largest value, and three of the difference of the ends
        spread = max(known) - min(known) or most
        decimals = max(3 - math.floor(math.log10(most)), 2 - math.floor(math.log10(spread)), 0)
    form = f".{decimals}f" if most < 1e7 and decimals <= 8 else ".4g"
    return [f"{value + 0:{form}}" for value in values]  # plus 0: -0.0 is 0 to a reader
