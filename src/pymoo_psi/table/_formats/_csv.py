"""CSV and other texts in rows and columns.

What we write: the first line names the columns, the rows follow, and below them, after a blank line
at which a spreadsheet ends its table, a comment of JSON says what the columns are. Numbers have as
many digits as it takes to read the same number back; no text is a formula.

What we read: also semicolons, tabs, bars or spaces between the cells, titles and comments.
"""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any, TypeAlias

from pymoo_psi._validation import invalid
from pymoo_psi.table._cells import (
    EMPTY,
    Cells,
    RowsByLine,
    UnfitError,
    cells_of_rows,
    is_blank,
    is_number,
)
from pymoo_psi.table._formats._format import (
    FileFormat,
    SourceFile,
    blocks_of_rows,
    texts_in,
)
from pymoo_psi.table._head import (
    HEAD_REMEDY,
    MARKS,
    Head,
    StoredTests,
    is_of_tests,
    tests_of_rows,
)

# The number of a line in its file, and the line.
Line: TypeAlias = tuple[int, str]

_SEPARATORS = ",;\t|"
_ABOVE_HEADER = re.compile(r'"*#|\s*$')  # comments and blank lines
# What a spreadsheet runs as a formula: a cell that begins with a sign, full-width ones too, or with
# a gap that it drops, unless it is a number; a sign alone, which people write for "none", is one.
# Apostrophes in front count with the text, so that no two texts are written alike. logic.js has
# this rule for what the page exports; the cells of tests/formulas.py try both.
_LEADING = "'=+-@＝＋－＠\t\r\n"
_FORMULA = re.compile(
    r"'*(?![+-]?([0-9.,]*(e[+-]?[0-9]+)?%?|inf|infinity|nan)\Z)[=+\-@＝＋－＠\t\r\n]", re.IGNORECASE
)


class CsvFile(FileFormat):
    """A text in rows and columns, a line of names first."""

    suffix = ".csv"
    writes = ("tests", "designs")

    def recognizes(self, file: SourceFile) -> bool:
        """Return True, as any text may be one."""
        return True

    def read(self, file: SourceFile) -> Cells | StoredTests:
        """Return the cells of a text, or the tests that :meth:`write` wrote."""
        try:
            head, text = split_head(file.text)
        except ValueError as error:
            raise UnfitError(f"{error}; {HEAD_REMEDY}") from None
        if is_of_tests(head):
            rows = csv.reader(StringIO(text.removeprefix("#\n"), newline=""))
            return tests_of_rows(file.path, head, rows, written_text)
        cells = cells_of_text(text, file.skip_rows)
        if head is None:
            return cells
        columns = {}
        for name, column in cells.columns.items():
            columns[written_text(name)] = column
        return replace(cells, columns=columns, head=head)

    def write(self, path: Path, columns: Mapping[str, Any], head: Head) -> None:
        """Write columns, and below them the head, if it is not empty."""
        texts = [*columns]
        for column in columns.values():
            texts += texts_in(column)
        # Spreadsheets take a file for UTF-8 by its mark, others stumble over it: only where needed.
        encoding = "utf-8"
        if not all(map(str.isascii, texts)):
            encoding = "utf-8-sig"
        # In tests all texts are in quotation marks, so that every reader takes "#" in them for
        # text. Until Python 3.13 the csv module leaves a carriage return unquoted, which breaks
        # the row.
        quoting: Any = csv.QUOTE_MINIMAL
        if is_of_tests(head) or any("\r" in text for text in texts):
            quoting = csv.QUOTE_NONNUMERIC
        with path.open("w", encoding=encoding, newline="") as file:
            writer = csv.writer(file, quoting=quoting, lineterminator="\n")
            writer.writerow(map(inert, columns))
            for block in blocks_of_rows(columns):
                for name, cells in block.items():
                    if not _is_numeric(columns[name]):
                        block[name] = list(map(inert, cells))
                writer.writerows(zip(*block.values(), strict=True))
            if head:
                file.write(f"\n{comment(head)}\n")


def _is_numeric(column: Any) -> bool:
    return column.dtype.kind in "biuf"


# Formulas


def inert(cell: Any) -> Any:
    """Return a cell as it is written: a text that would be a formula is led by an apostrophe."""
    # Only the first letter is checked at first, as most cells are no formulas.
    if isinstance(cell, str) and cell[:1] in _LEADING and _FORMULA.match(cell):
        return f"'{cell}"
    return cell


def written_text(cell: str) -> str:
    """Return the text of which :func:`inert` made a cell."""
    if cell[:1] == "'" and _FORMULA.match(cell[1:]):
        return cell[1:]
    return cell


# The head


def comment(head: Head) -> str:
    """Return the comment of JSON that says what the columns are."""
    text = json.dumps(head)  # in ASCII: a unit alone does not make the file need a mark
    # Commas in texts would begin cells for a spreadsheet, which may be formulas.
    escaped = {",": r"\u002c", ";": r"\u003b"}

    def without_commas(string: re.Match[str]) -> str:
        return re.sub("[,;]", lambda mark: escaped[mark[0]], string[0])

    return "# " + re.sub(r'"(?:[^"\\]|\\.)*"', without_commas, text)


def split_head(text: str) -> tuple[Head | None, str]:
    """Return what a text says of its columns, if it does, and the text without that.

    It is the last line, or the first in files of version 0.2.0. A blank comment then takes its
    place, so that lines keep their numbers.

    Raises:
        ValueError: The line is damaged.
    """
    first, _, below = text.partition("\n")
    above, _, last = text.rstrip().rpartition("\n")
    if _is_head(first):
        return _head_of_line(first), f"#\n{below}"
    if _is_head(last):
        return _head_of_line(last), f"{above}\n"
    return None, text


def _is_head(line: str) -> bool:
    return line.lstrip('"').startswith("#") and any(mark in line for mark in MARKS)


def _head_of_line(line: str) -> Head:
    # A spreadsheet program may have taken the line for cells.
    if line.startswith('"'):
        line = ",".join(next(csv.reader([line])))
    try:
        return dict(json.loads(line.rstrip(",\r\n ").removeprefix("#")))
    except (ValueError, TypeError, RecursionError):
        raise ValueError("the line that says what its columns are is damaged") from None


# Texts of other programs and people


def cells_of_text(text: str, skip_rows: Collection[int] = ()) -> Cells:
    """Return the cells of a text.

    By the csv module, as pandas fills short rows up and joins rows between stray quotation marks.
    Lines that begin with ``#`` are comments, unless all designs do: labels may be #1, #2, …. One
    that could be a design among others is refused.

    Raises:
        ArgumentValueError: It is no table of named columns with one row or more.
    """
    whole = [*enumerate(StringIO(text, newline=""), start=1)]
    last = max(skip_rows, default=0)
    if last > len(whole):
        raise invalid("skip_rows", f"numbers of lines of the file, 1 to {len(whole)}", last)
    lines = []
    for number, line in whole:
        if number not in skip_rows:
            lines.append((number, line))
    n_above = 0
    while n_above < len(lines) and _ABOVE_HEADER.match(lines[n_above][1]):
        n_above += 1
    lines = lines[n_above:]
    if not lines:
        raise UnfitError(EMPTY)
    separator = _separator(lines)
    try:
        rows = _rows(lines, separator)
    except csv.Error as error:
        raise UnfitError(f"it is no text in rows and columns: {error}") from None
    return cells_of_rows(_without_comments(rows), separator)


def _without_comments(rows: RowsByLine) -> RowsByLine:
    """Return the rows that are no comments.

    Raises:
        ArgumentValueError: A row may be a comment or a design.
    """
    designs = {}
    comments = {}
    for end, row in rows.items():
        is_comment = row[0].startswith("#") and not is_blank(row[0])
        if is_comment:
            comments[end] = row
        else:
            designs[end] = row
    if len(designs) < 2:  # the names of all designs begin so
        return rows
    n_cells = len(next(iter(rows.values())))
    for end, row in comments.items():
        if len(row) == n_cells > 1 and all(row):
            raise UnfitError(
                f"line {end} begins with # and has a cell in each column",
                f"leave it out by --skip-rows {end} if it is a comment, "
                "or begin its name otherwise",
            )
    return designs


def _separator(lines: Sequence[Line]) -> str:
    """Return the mark between cells: the one with which all rows are as long as the header.

    Spaces divide cells only where no mark does.
    """
    # The first line may be a title without any mark, the last one is a design.
    last = next(line for _, line in reversed(lines) if line.strip())
    ends = lines[0][1] + last
    merits = {}
    for mark in _SEPARATORS:
        if mark in ends:
            with suppress(csv.Error):  # quotation marks that stand elsewhere than at cells
                merits[mark] = _merit([*_rows(lines, mark).values()])
    if merits:
        return max(merits, key=merits.__getitem__)
    with suppress(csv.Error):
        usual, _ = Counter(map(len, _rows(lines, " ").values())).most_common(1)[0]
        if usual > 1:
            return " "
    return ","


def _merit(rows: list[list[str]]) -> tuple[bool, float, int]:
    """Return by what the best of several separators is chosen, the most important first."""
    if not rows:
        return False, 0, 0
    usual, count = Counter(map(len, rows)).most_common(1)[0]
    # Of uneven readings that with the longest usual row, so that the message names the row that
    # differs.
    if count < len(rows):
        return False, usual, count
    # Of several even ones, as names or decimals may have commas, the one with most numbers.
    n_cells = 0
    n_numbers = 0
    for row in rows[1:]:
        n_cells += len(row)
        n_numbers += sum(map(is_number, row))
    return True, n_numbers / max(1, n_cells), usual


def _rows(lines: Sequence[Line], separator: str) -> RowsByLine:
    """Return the rows that are not blank."""
    rows = {}
    texts = [line for _, line in lines]
    if separator == " ":
        # Several spaces align printed columns; at the end of a line they begin no cell.
        texts = [f"{line.strip()}\n" for line in texts]
    reader = csv.reader(
        texts,
        delimiter=separator,
        # Else in 'a, "b, c"' the marks would be text and its comma a separator.
        skipinitialspace=separator != "\t",
        strict=True,
    )
    for row in reader:
        if any(cell.strip() for cell in row):
            # csv counts the lines it was given, users those of the file.
            number, _ = lines[reader.line_num - 1]
            rows[number] = row
    return rows
