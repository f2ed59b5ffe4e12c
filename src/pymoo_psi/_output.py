"""What leaves the package: files, written whole and without formulas, and tables for readers."""

from __future__ import annotations

import csv
import html
import json
import math
import os
import re
import secrets
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

_ROWS = 8192  # written at a time, so that the memory for texts stays small
# What a spreadsheet runs as a formula: a cell that begins with a sign, full-width ones too, or with
# a gap that it drops, unless it is a number; a sign alone, which people write for "none", is one.
# Apostrophes in front count with the text, so that no two texts are written alike. logic.js has
# this rule for what the page exports; the cells of tests/formulas.py try both.
_LEADING = "'=+-@＝＋－＠\t\r\n"
_FORMULA = re.compile(
    r"'*(?![+-]?([0-9.,]*(e[+-]?[0-9]+)?%?|inf|infinity|nan)\Z)[=+\-@＝＋－＠\t\r\n]",
    re.IGNORECASE,
)

ROWS = 10  # that a notebook shows: a table of 100 000 tests is asked for by to_frame()
_COLUMNS = 24


@contextmanager
def whole_file(path: str | PathLike[str]) -> Iterator[Path]:
    """Give the path of a file to write, which then takes the place of ``path`` at once.

    If the body raises, ``path`` is as it was and what was written is removed. A link is followed,
    and the mode of a file that is replaced is kept. What is no file, such as ``/dev/null`` or a
    pipe, is not replaced but written to.

    Raises:
        OSError: The file cannot be written there.
    """
    target = Path(os.path.realpath(path))
    try:
        mode = os.stat(path).st_mode
    except OSError:  # there is none yet; any other reason shows when the new one is written
        mode = None
    replaced = mode is None or stat.S_ISREG(mode)
    # In the same folder, as os.replace() works within one file system only; by a name of its own
    # and not target's with a suffix, which may be as long as names can be; hidden from globs.
    written = target.with_name(f".{secrets.token_hex(8)}.tmp") if replaced else Path(path)
    try:
        yield written
        if replaced and mode is not None:
            os.chmod(written, stat.S_IMODE(mode))  # before, so that it never has wider rights
        if replaced:
            os.replace(written, target)
    except BaseException as error:  # an interruption, too
        # The other name tells the user nothing, and a full disk comes without any.
        if isinstance(error, OSError) and error.errno and error.filename in (None, str(written)):
            error.filename = str(path)
        if replaced:
            with suppress(FileNotFoundError):  # the body may not have come to write
                os.unlink(written)
        raise


def inert(cell: Any) -> Any:
    """Return a cell as it is written: a text that would be a formula is led by an apostrophe."""
    # The first letter alone is looked at before, as most cells are no formulas.
    if isinstance(cell, str) and cell[:1] in _LEADING and _FORMULA.match(cell):
        return f"'{cell}"
    return cell


def written_text(cell: str) -> str:
    """Return the text that :func:`inert` has made a cell of."""
    return cell[1:] if cell[:1] == "'" and _FORMULA.match(cell[1:]) else cell


def comment(content: Mapping[str, Any]) -> str:
    """Return the comment of JSON that says what the columns of a CSV are."""
    text = json.dumps(content, ensure_ascii=False)
    # Commas in texts would begin cells for a spreadsheet, which may be formulas.
    escaped = {",": r"\u002c", ";": r"\u003b"}
    strings = re.compile(r'"(?:[^"\\]|\\.)*"')
    text = strings.sub(lambda s: re.sub("[,;]", lambda mark: escaped[mark[0]], s[0]), text)
    return f"# {text}"


def write_csv(
    path: str | PathLike[str], columns: Mapping[str, Any], head: str = "", *, quoted: bool = False
) -> None:
    """Write ``(n,)`` columns as CSV, whole or not at all: every CSV of the package is written here.

    Numbers have as many digits as it takes to read the same number back; no text is a formula.

    Args:
        path: The file.
        columns: Arrays, or series of pandas, by name; None is a blank.
        head: A line of comment above the names.
        quoted: Whether all texts are in quotation marks, so that ``#`` in them is text to every
            reader.

    Raises:
        OSError: It cannot be written.
    """
    texts = {name for name, column in columns.items() if column.dtype.kind not in "biuf"}
    cells = (cell for name in texts for cell in columns[name].tolist() if isinstance(cell, str))
    # Until Python 3.13 the csv module leaves a carriage return unquoted, which breaks the row.
    quoted = quoted or any("\r" in text for text in (*columns, *cells))
    with whole_file(path) as written, written.open("w", encoding="utf-8", newline="") as file:
        file.write(f"{head}\n" if head else "")
        quoting: Any = csv.QUOTE_NONNUMERIC if quoted else csv.QUOTE_MINIMAL
        writer = csv.writer(file, quoting=quoting, lineterminator="\n")
        writer.writerow(map(inert, columns))
        for start in range(0, max(map(len, columns.values()), default=0), _ROWS):
            parts = ((n, column[start : start + _ROWS].tolist()) for n, column in columns.items())
            rows = (map(inert, part) if name in texts else part for name, part in parts)
            writer.writerows(zip(*rows, strict=True))


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
