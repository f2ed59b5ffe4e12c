"""From the text of a CSV file to columns of cells: separator, comments, decimal commas.

Lines that begin with ``#`` may stand above the line that names the columns; below it comes one
line for each design. Cells are kept as they are written, but for decimal commas.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from io import StringIO
from typing import Literal, NamedTuple, TypeAlias

Kind: TypeAlias = Literal["number", "blank", "text"]

_SEPARATORS = ",;\t"
_EMPTY = "it is empty; it must hold a line of column names, then the designs"
_BLANK = {"", "nan", "na", "n/a", "null", "none"}
_WITH_COMMA = re.compile(r"\s*[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?\s*")


class UnfitError(Exception):
    """The text is no table; the reader of the file says which file."""


class Cells(NamedTuple):
    """The cells of a table.

    Attributes:
        columns: The n cells of each column by its name, in the file's order; n >= 1. One column
            may have no name, as data frames write their row labels.
        lines: The line of the file on which each row ends.

    Example:
        >>> Cells({"cost": ["1.5", "2"]}, [2, 3]).columns
        {'cost': ['1.5', '2']}
    """

    columns: dict[str, list[str]]
    lines: list[int]


def real(text: str) -> float:
    """Return the number in a text, or raise ValueError; Python alone reads ``1_000``."""
    if "_" in text:
        raise ValueError(text)
    return float(text)


def integer(text: str) -> int:
    """Return the whole number in a text, or raise ValueError."""
    if "_" in text:
        raise ValueError(text)
    return int(text)


def boolean(text: str) -> bool:
    """Return what a text says, as Python or a spreadsheet writes it, or raise ValueError."""
    word = text.strip().lower()
    if word not in ("true", "false"):
        raise ValueError(text)
    return word == "true"


def kind_of(cell: str) -> Kind:
    """Return what a cell is; ``nan``, ``n/a`` and the like are blank.

    Example:
        >>> [kind_of(cell) for cell in ("1e-3", "N/A", "oak")]
        ['number', 'blank', 'text']
    """
    text = cell.strip()
    if text.lower() in _BLANK:
        return "blank"
    try:
        float(text)
    except ValueError:
        return "text"
    return "text" if "_" in text else "number"  # Python alone reads 1_000 as a number


def parsed(text: str) -> Cells:
    r"""Return the cells of a text in rows and columns.

    Raises:
        UnfitError: It is no table of named columns with one row or more.

    Example:
        >>> parsed("# a comment\ncost;mass\n1,5;4\n")
        Cells(columns={'cost': ['1.5'], 'mass': ['4']}, lines=[3])
    """
    lines = list(StringIO(text, newline=""))
    skipped = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    body = lines[skipped:]
    first = next((line for line in body if line.strip()), None)
    if first is None:
        raise UnfitError(_EMPTY)
    candidates = [mark for mark in _SEPARATORS if mark in first] or [","]
    try:
        tables = {mark: _rows(body, mark) for mark in candidates}
    except csv.Error as error:
        raise UnfitError(f"it is no text in rows and columns: {error}") from None
    separator = max(tables, key=lambda mark: _likelihood(tables[mark]))
    if not tables[separator][0]:
        raise UnfitError(_EMPTY)
    (first_row, *designs), (_, *ends) = tables[separator]
    header, ends = [name.strip() for name in first_row], [skipped + end for end in ends]
    _require_rectangle(header, designs, ends)
    columns = _named(header, [list(column) for column in zip(*designs, strict=True)])
    if separator == ";":
        columns = {name: _with_points(cells) for name, cells in columns.items()}
    return Cells(columns, ends)


_Rows: TypeAlias = tuple[list[list[str]], list[int]]


def _rows(lines: Sequence[str], separator: str) -> _Rows:
    """Return the rows that are not blank, and the line on which each ends."""
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=separator != "\t")
    found = [(row, reader.line_num) for row in reader if any(cell.strip() for cell in row)]
    return [row for row, _ in found], [end for _, end in found]


def _likelihood(table: _Rows) -> tuple[bool, int]:
    """Order readings of a text: all rows as long as the header, then many columns."""
    rows, _ = table
    return len({len(row) for row in rows}) == 1, len(rows[0]) if rows else 0


def _require_rectangle(header: list[str], rows: list[list[str]], ends: list[int]) -> None:
    for i, (row, end) in enumerate(zip(rows, ends, strict=True)):
        if len(row) != len(header):
            where = f"row {i + 1} (line {end})"
            raise UnfitError(f"{where} has {len(row)} cells, the header {len(header)}")
    if all(kind_of(name) == "number" for name in header):
        remedy = "put a line of names above them"
        raise UnfitError(f"its first line must name the columns, and holds numbers; {remedy}")
    if not rows:
        raise UnfitError("it holds column names, but no row")


def _named(header: list[str], columns: list[list[str]]) -> dict[str, list[str]]:
    named = [
        (name, column)
        for name, column in zip(header, columns, strict=True)
        if name or any(cell.strip() for cell in column)  # a comma at the end of every line
    ]
    for name, count in Counter(name for name, _ in named).items():
        if count > 1:
            what = f"names the column {name!r} {count} times" if name else "names not all columns"
            raise UnfitError(f"its header {what}")
    return dict(named)


def _with_points(cells: list[str]) -> list[str]:
    """Return a column with decimal points for decimal commas, unless it has both."""
    if any("." in cell and kind_of(cell) == "number" for cell in cells):
        return cells
    return [cell.replace(",", ".") if _WITH_COMMA.fullmatch(cell) else cell for cell in cells]
