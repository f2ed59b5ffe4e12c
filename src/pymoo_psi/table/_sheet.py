"""From the bytes of a file to rows of cells under names: encoding, dividers, header."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import import_module
from io import BytesIO, StringIO
from typing import Any
from warnings import catch_warnings, simplefilter

from pymoo_psi._validation import Remark, counted, invalid, known_name
from pymoo_psi.errors import PsiError
from pymoo_psi.table._cells import PerCent, is_blank, is_number

_DIVIDERS = ",;\t|"
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?\s*', re.IGNORECASE)  # Excel's own
_EMPTY = "it is empty; it must hold a line of column names, then the designs"
# The longer marks first: that of UTF-16 begins that of UTF-32.
_BYTE_ORDER_MARKS = {
    b"\xef\xbb\xbf": "utf-8-sig",
    b"\xff\xfe\x00\x00": "utf-32",
    b"\x00\x00\xfe\xff": "utf-32",
    b"\xff\xfe": "utf-16",
    b"\xfe\xff": "utf-16",
}


class UnfitError(Exception):
    """The content is no table; the reader of the file says which file."""


@dataclass(frozen=True)
class Sheet:
    """The cells of a file.

    Attributes:
        columns: The n cells of each column by its name, in the file's order; n >= 1. One column
            may have no name, as data frames write their row labels.
        lines: The line of the file on which each row ends.
        divider: The mark between cells; empty if cells have places of their own.
        hidden: The lines that it hides.
        remarks: What a reader must know about that, in sentences.
    """

    columns: dict[str, list[Any]]
    lines: list[int]
    divider: str
    hidden: Collection[int] = ()
    remarks: tuple[str, ...] = ()


def in_a_line(name: str) -> str:
    """Return the name of a column without line breaks, which could not be typed as an option."""
    return re.sub(r"\s*[\r\n]\s*", " ", name.strip())


def decoded(content: bytes, encoding: str | None) -> str:
    """Return the text in the bytes of a file.

    Args:
        content: The bytes.
        encoding: Its encoding; as a byte-order mark says, or UTF-8, unless given.

    Raises:
        UnfitError: It is no such text.
        ArgumentValueError: There is no such encoding.
    """
    marked = next(
        (name for mark, name in _BYTE_ORDER_MARKS.items() if content.startswith(mark)), ""
    )
    try:
        text = content.decode(encoding or marked or "utf-8")
    except LookupError:
        raise invalid("encoding", "one that Python knows, such as utf-16", encoding) from None
    except (UnicodeError, ValueError) as error:
        if encoding or marked:
            raise UnfitError(f"it is no text in {encoding or marked}: {error}") from None
        # Any bytes are text in cp1252, right or wrong; so it is not guessed.
        remedy = "give its encoding, of Windows mostly --encoding cp1252, or save it as CSV UTF-8"
        raise UnfitError(
            f"it is no UTF-8 text: {getattr(error, 'reason', error)}; {remedy}"
        ) from None
    # UTF-16 without a mark is valid UTF-8 where it has ASCII only: every second byte is a NUL.
    if "\0" in text:
        remedy = "give its encoding, such as --encoding utf-16-le"
        raise UnfitError(f"it is no text, as it holds null characters; {remedy}")
    # Where the encoding was given, as utf-16-le, Python leaves the mark at the front of the text.
    return text.removeprefix("\ufeff")


def sheet_of_text(text: str, skip_rows: Collection[int | str]) -> Sheet:
    """Return the cells of a text.

    Lines that begin with ``#`` may stand above the line that names the columns. If that line holds
    numbers, the names are taken from the comment above it.

    Raises:
        UnfitError: It is no table of named columns with one row or more.
    """
    lines = list(enumerate(StringIO(text, newline=""), start=1))
    _require_lines(skip_rows, len(lines))
    lines = [(number, line) for number, line in lines if number not in skip_rows]
    while lines and not lines[0][1].strip():
        lines.pop(0)
    divider = ""
    if lines and (found := _SEPARATOR_LINE.fullmatch(lines[0][1])):
        divider = found[1]
        lines.pop(0)
    comments = []
    while lines and (lines[0][1].startswith("#") or not lines[0][1].strip()):
        comments.append(lines.pop(0)[1])
    if not lines:
        raise UnfitError(_EMPTY)
    divider = divider or _divider(lines)
    rows, ends = _rows(lines, divider)
    if not rows:
        raise UnfitError(_EMPTY)
    # numpy.savetxt writes its header as a comment; the last line is next to the numbers.
    if comments and any(map(is_number, rows[0])):
        with suppress(UnfitError):
            named, _ = _rows([(1, comments[-1].lstrip("# "))], divider)
            if named and len(named[0]) == len(rows[0]) and not any(map(is_number, named[0])):
                rows, ends = [*named, *rows], [ends[0], *ends]
    marked = [
        end
        for (first, *_), end in zip(rows, ends, strict=True)
        if first.startswith("#") and not is_blank(first)
    ]
    # Labels may be #1, #2, …; one among others is rather a design that was commented out.
    if 0 < len(marked) < len(rows) - 1:
        out = ",".join(map(str, marked))
        remedy = f"leave it out by --skip-rows {out}, or begin its first cell otherwise"
        raise UnfitError(f"line {marked[0]} begins with #: a comment or a design; {remedy}")
    return _sheet(rows, ends, divider)


def sheet_of_workbook(content: bytes, skip_rows: Collection[int | str], name: str | None) -> Sheet:
    """Return the cells of a sheet of an .xlsx, by openpyxl.

    Raises:
        UnfitError: It is no table of named columns with one row or more.
        ArgumentValueError: There is no sheet of that name.
        PsiError: openpyxl is not installed.
    """
    try:
        openpyxl = import_module("openpyxl")
    except ImportError:
        raise PsiError(
            "a workbook needs openpyxl, which is not installed; pip install openpyxl, or save the "
            "sheet as CSV"
        ) from None

    def loaded(*, data_only: bool) -> dict[str, Any]:
        try:
            with catch_warnings():
                simplefilter("ignore")  # of drawings and the like, which are not read
                book = openpyxl.load_workbook(
                    BytesIO(content), data_only=data_only, keep_links=False
                )
        except Exception as error:  # of zip, XML, openpyxl
            raise UnfitError(f"it cannot be read as a workbook (.xlsx): {error}") from None
        return {sheet.title: sheet for sheet in book.worksheets}

    # As objects its cells take 1 GB. One stray cell at the far end is enough, if but with a format.
    def is_vast(sheet: Any) -> bool:
        return bool(sheet.max_row * sheet.max_column > 4_000_000)

    filled = {
        title: sheet
        for title, sheet in loaded(data_only=False).items()
        if is_vast(sheet)
        or any(cell.value is not None for row in sheet.iter_rows() for cell in row)
    }
    if name is not None:
        filled = {name: filled[known_name("sheet", name, filled)]}
    # Taking the first sheet would rank the wrong one in silence where a cover or notes come first.
    if len(filled) != 1:
        what = f"{len(filled)} sheets with cells: {', '.join(filled) or 'none'}"
        raise UnfitError(f"it has {what}; name the one with the designs by --sheet")
    ((title, sheet),) = filled.items()
    if is_vast(sheet):
        raise UnfitError(
            f"its cells reach from {sheet.dimensions.replace(':', ' to ')}, over four million; "
            f"delete those beside the table, or save the sheet as CSV"
        )
    table = list(sheet.iter_rows())
    # A formula and its value are never loaded both at once.
    formulas = any(cell.data_type == "f" for row in table for cell in row)
    values = list(loaded(data_only=True)[title].iter_rows()) if formulas else table
    hidden = {number for number, row in sheet.row_dimensions.items() if row.hidden}
    skipped = {*skip_rows} - {"hidden"}
    _require_lines(skipped, len(table))
    if "hidden" in skip_rows:
        skipped |= hidden
    rows, ends = [], []
    for number, cells in enumerate(zip(table, values, strict=True), start=1):
        row = list(map(_typed, *cells))
        if number not in skipped and any(cell != "" for cell in row):
            rows.append(row)
            ends.append(number)
    if not rows:
        raise UnfitError(_EMPTY)
    groups = [group for group in sheet.column_dimensions.values() if group.hidden]
    names = [
        str(cell)
        for j, cell in enumerate(rows[0], start=1)
        if cell != "" and any(group.min <= j <= group.max for group in groups)
    ]
    lines = [str(number) for number in ends[1:] if number in hidden]
    remarks = [
        Remark(
            f"Read although hidden in the sheet: {counted(len(which), what)} "
            f"({sign}{', '.join(which[:6])}{', …' if which[6:] else ''})",
            f"; {remedy}.",
        )
        for which, what, sign, remedy in (
            (lines, "row", "line ", "--skip-rows hidden leaves such rows out"),
            (names, "column", "", "--objectives says by which columns to rank"),
        )
        if which
    ]
    return replace(_sheet(rows, ends, ""), hidden=hidden, remarks=tuple(remarks))


def _require_lines(skip_rows: Collection[int | str], n: int) -> None:
    if other := [line for line in skip_rows if isinstance(line, str) or not 1 <= line <= n]:
        remedy = "only a workbook hides rows" if other[0] == "hidden" else ""
        raise invalid("skip_rows", f"numbers of lines of the file, 1 to {n}", other[0], remedy)


def _typed(cell: Any, saved: Any) -> Any:
    """Return a cell of a workbook as a number, a boolean or text; empty text for nothing.

    Args:
        cell: The cell, with its formula if it has one.
        saved: The same with the value of the formula, as it was when the workbook was saved.
    """
    value = saved.value
    if cell.data_type == "f" and value is None and saved.data_type == "n":
        # Libraries write formulas without values; as nothing they would pass for a gap.
        return cell.value if isinstance(cell.value, str) else "={}"
    if value is None or saved.data_type == "e":
        return ""
    if isinstance(value, (bool, str)):
        return "" if isinstance(value, str) and not value.strip() else value
    if isinstance(value, (int, float)):
        # Within quotation marks the sign is text.
        if "%" in re.sub(r'"[^"]*"|\\.', "", saved.number_format):
            return PerCent(value)
        return int(value) if isinstance(value, float) and value.is_integer() else value
    return str(value).removesuffix(" 00:00:00")  # of a date


def _divider(lines: Sequence[tuple[int, str]]) -> str:
    """Return the mark between cells: the one with which all rows are as long as the header.

    Spaces divide cells only where no mark does.
    """
    ends = lines[0][1] + next(line for _, line in reversed(lines) if line.strip())
    # The first line may be a title without any mark, the last one is a design.
    readings: dict[str, list[list[str]]] = {}
    for mark in _DIVIDERS:
        with suppress(UnfitError):  # quotation marks that stand elsewhere than at cells
            if mark in ends and (rows := _rows(lines, mark)[0]):
                readings[mark] = rows
    even = {
        mark: len(rows[0])
        for mark, rows in readings.items()
        if len({len(row) for row in rows}) == 1 and len(rows[0]) > 1
    }
    if len(even) > 1:  # names or decimals with commas: the cells tell which reading is meant
        shares = {mark: _share_of_numbers(readings[mark]) for mark in even}
        even = {mark: n for mark, n in even.items() if shares[mark] == max(shares.values())}
    if even:
        return max(even, key=lambda mark: even[mark])
    if readings:
        # No reading is even: the one with the longest usual row is taken, so that the message names
        # the row that differs.
        return max(readings, key=lambda mark: Counter(map(len, readings[mark])).most_common(1)[0])
    spaced, _ = _rows(lines, " ")
    divided = len({len(row) for row in spaced}) == 1 and len(spaced[0]) > 1
    # Unless all rows can be one number each, such as 1 250.
    return " " if divided and not all(is_number(" ".join(row)) for row in spaced[1:]) else ","


def _share_of_numbers(rows: Sequence[Sequence[str]]) -> float:
    cells = [cell for row in rows[1:] for cell in row]
    return sum(map(is_number, cells)) / max(1, len(cells))


def _rows(lines: Sequence[tuple[int, str]], divider: str) -> tuple[list[list[str]], list[int]]:
    """Return the rows that are not blank, and the line on which each ends."""
    if divider == " ":
        # Not csv, which finds empty cells between the spaces that align printed columns.
        filled = [(line.split(), number) for number, line in lines if line.strip()]
        return [row for row, _ in filled], [number for _, number in filled]
    # strict: else csv passes over a stray quotation mark and joins cells. skipinitialspace: else in
    # 'a, "b, c"' the marks would be part of the text and its comma a divider.
    reader = csv.reader(
        (line for _, line in lines),
        delimiter=divider,
        skipinitialspace=divider != "\t",
        strict=True,
    )
    rows, ends = [], []
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                rows.append(row)
                # csv counts the lines it was given, users those of the file.
                ends.append(lines[reader.line_num - 1][0])
    except csv.Error as error:
        number = lines[min(reader.line_num, len(lines)) - 1][0]
        raise UnfitError(f"it is no text in rows and columns: {error} in line {number}") from None
    return rows, ends


def _sheet(rows: list[list[Any]], ends: list[int], divider: str) -> Sheet:
    """Return rows as columns under the names in the first row."""
    _require_rectangle(rows, ends)
    header = [in_a_line(cell) if isinstance(cell, str) else cell for cell in rows[0]]
    # A file without names would lose its first design as names, and nobody would notice.
    if numbers := [cell for cell in header if is_number(cell)]:
        remedy = "put a line of names above them, or leave lines above it out by --skip-rows"
        raise UnfitError(
            f"its first line must name the columns, and holds numbers, {numbers[0]!r:.40}; {remedy}"
        )
    if len(rows) == 1:
        raise UnfitError("it holds column names, but no row")
    columns = [list(column) for column in zip(*rows[1:], strict=True)]
    named = [
        (str(name), column)
        for name, column in zip(header, columns, strict=True)
        if name != "" or not all(map(is_blank, column))  # a comma at the end of every line
    ]
    for name, count in Counter(name for name, _ in named).items():
        if count > 1:
            if name:
                raise UnfitError(f"its header names the column {name!r} {count} times")
            filled = [sum(not is_blank(cell) for cell in row) for row in rows]
            # A line of names fills most columns; above it are titles.
            n = next((i for i, k in enumerate(filled) if 2 * k > len(header)), 0) or 1
            skip = ",".join(map(str, ends[:n]))
            lines, them = ("line", "it is a title") if n == 1 else ("lines", "they are titles")
            remedy = f"leave {lines} {skip} out by --skip-rows {skip} if {them}"
            raise UnfitError(f"its header leaves columns without a name; {remedy}")
    return Sheet(dict(named), ends[1:], divider)


def _require_rectangle(rows: list[list[Any]], ends: list[int]) -> None:
    """Refuse rows that are not as long as the header; titles above the header are told apart."""
    lengths = [len(row) for row in rows]
    if len(set(lengths)) == 1:
        return
    body = lengths[-1]
    titles = next(i for i, n in enumerate(lengths) if n == body)
    if titles and set(lengths[titles:]) == {body} and titles < len(rows) - 1:
        out = ",".join(map(str, ends[:titles]))
        raise UnfitError(
            f"line {ends[0]} has {counted(lengths[0], 'cell')}, the lines below {body}; if it is a "
            f"title, leave it out by --skip-rows {out}"
        )
    i = next(i for i, n in enumerate(lengths) if n != lengths[0])
    cells = counted(lengths[i], "cell")
    remedy = f"complete it, or leave it out by --skip-rows {ends[i]}"
    raise UnfitError(f"row {i} (line {ends[i]}) has {cells}, the header {lengths[0]}; {remedy}")
