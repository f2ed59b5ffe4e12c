"""From the bytes of a text or a workbook to cells under the names of columns."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from io import BytesIO, StringIO
from typing import Any, NamedTuple
from warnings import catch_warnings, simplefilter

from pymoo_psi._validation import counted, invalid, known_name
from pymoo_psi.errors import PsiError
from pymoo_psi.table._numbers import PerCent, UnfitError, is_blank, is_number

_SEPARATORS = ",;\t|"
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?\s*', re.IGNORECASE)  # Excel's own
_GROUPED = re.compile(r"[1-9]\d{0,2}(?: \d{3})+(?:[.,]\d*)?")
_EMPTY = "it is empty; it must hold a line of column names, then the designs"
_VAST = 4_000_000  # cells of a sheet, which take 1 GB


class Cells(NamedTuple):
    """The cells of a source that is no table of tests.

    Attributes:
        columns: The n cells of each column by its name, in the order of the source.
        lines: The line of the file on which each row ends; empty if there are no lines.
        separator: The mark between the cells of a line; empty if there is none.
        head: What the source says of its columns, as :func:`designs_head` writes it.
        label: The column that names the designs, if the source says so.
    """

    columns: dict[str, list[Any]]
    lines: Sequence[int] = ()
    separator: str = ""
    head: Mapping[str, Any] | None = None
    label: str | None = None


def in_a_line(name: str) -> str:
    """Return the name of a column without line breaks, which could not be typed as an option."""
    return re.sub(r"\s*[\r\n]\s*", " ", name.strip())


def decoded(content: bytes, encoding: str | None) -> str:
    """Return the text in the bytes of a file, by its byte-order mark or UTF-8 unless given.

    Raises:
        ArgumentValueError: It is no such text, or there is no such encoding.
    """
    wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    encoding = encoding or ("utf-16" if wide else "utf-8-sig")
    try:
        text = content.decode(encoding)
    except UnicodeError as error:
        # Any bytes are text in cp1252, right or wrong; so it is not guessed.
        remedy = "give its encoding, of Windows mostly --encoding cp1252, or save it as CSV UTF-8"
        raise UnfitError(f"it is no text: {error}; {remedy}") from None
    except (LookupError, ValueError, TypeError):
        raise invalid("encoding", "one that Python knows, such as utf-16", encoding) from None
    # UTF-16 without a mark is valid UTF-8 where it has ASCII only: every second byte is a NUL.
    if "\0" in text:
        remedy = "give its encoding, such as --encoding utf-16-le"
        raise UnfitError(f"it is no text, as it holds null characters; {remedy}")
    return text.removeprefix("\ufeff")  # utf-16-le leaves the mark in the text


def cells_of_text(text: str, skip_rows: Collection[int | str]) -> Cells:
    """Return the cells of a text.

    By the csv module, as pandas fills short rows up and joins rows between stray quotation marks.
    Comments (``#``) may stand above the line that names the columns. If that line holds numbers,
    the names are taken from the comment above it, as numpy.savetxt writes them.

    Raises:
        ArgumentValueError: It is no table of named columns with one row or more.
    """
    lines = list(enumerate(StringIO(text, newline=""), start=1))
    _require_lines(skip_rows, len(lines))
    lines = [(i, line) for i, line in lines if i not in skip_rows]
    separator, comment = "", ""
    while lines and (not lines[0][1].strip() or lines[0][1].lstrip('"').startswith(("#", "sep="))):
        line = lines.pop(0)[1]
        if found := _SEPARATOR_LINE.fullmatch(line):
            separator = found[1]
        elif line.strip():
            comment = line.lstrip("# ")
    if not lines:
        raise UnfitError(_EMPTY)
    separator = separator or _separator(lines)
    try:
        rows, ends = _rows(lines, separator)
        names, _ = _rows([(1, comment)], separator)
    except csv.Error as error:
        raise UnfitError(f"it is no text in rows and columns: {error}") from None
    if rows and any(map(is_number, rows[0])) and names and len(names[0]) == len(rows[0]):
        rows, ends = [*names, *rows], [ends[0], *ends]
    pairs = zip(rows, ends, strict=True)
    marked = [end for row, end in pairs if row[0].startswith("#") and not is_blank(row[0])]
    # Labels may be #1, #2, …; one among others is rather a design that was commented out.
    if 0 < len(marked) < len(rows) - 1:
        remedy = f"leave it out by --skip-rows {_listed(marked)}, or begin its first cell otherwise"
        what = f"line {marked[0]} begins with #: a comment or a design"
        raise UnfitError(f"{what}; {remedy}")
    return _cells(rows, ends, separator)


def cells_of_workbook(content: bytes, skip_rows: Collection[int | str], name: str | None) -> Cells:
    """Return the cells of a sheet of an .xlsx, by openpyxl.

    Raises:
        ArgumentValueError: It is no table of named columns with one row or more, there is no sheet
            of that name, or the sheet hides rows.
        PsiError: openpyxl is not installed.
    """
    try:
        from openpyxl import load_workbook  # type: ignore[import-untyped]
    except ImportError:
        what = "a workbook needs openpyxl, which is not installed"
        raise PsiError(f"{what}; pip install openpyxl, or save the sheet as CSV") from None
    try:
        with catch_warnings():
            simplefilter("ignore")  # of drawings and the like, which are not read
            sheets = load_workbook(BytesIO(content), data_only=True).worksheets
    except Exception as error:  # of zip, XML, openpyxl
        raise UnfitError(f"it cannot be read as a workbook (.xlsx): {error}") from None
    if name is None:
        # Taking the first sheet would rank the wrong one where a cover or notes come first.
        sheets = [sheet for sheet in sheets if any(map(any, sheet.iter_rows(values_only=True)))]
        if len(sheets) != 1:
            titles = ", ".join(sheet.title for sheet in sheets) or "none"
            what = f"it has {len(sheets)} sheets with cells: {titles}"
            raise UnfitError(f"{what}; name the one with the designs by --sheet")
        name = sheets[0].title
    by_title = {sheet.title: sheet for sheet in sheets}
    sheet = by_title[known_name("sheet", name, by_title)]
    # One stray cell at the far end is enough.
    if sheet.max_row * sheet.max_column > _VAST:
        what = f"its cells reach from {sheet.dimensions.replace(':', ' to ')}, over four million"
        raise UnfitError(f"{what}; delete those beside the table, or save it as CSV")
    table = list(sheet.iter_rows())
    _require_lines({*skip_rows} - {"hidden"}, len(table))
    hidden = [i for i, row in sheet.row_dimensions.items() if row.hidden and i <= len(table)]
    if hidden and "hidden" not in skip_rows:
        what = f"the sheet hides {counted(len(hidden), 'row')} ({_listed(hidden)})"
        raise UnfitError(f"{what}; show them, or leave them out by --skip-rows hidden")
    skipped = {*skip_rows, *hidden}
    typed = [(i, [*map(_typed, row)]) for i, row in enumerate(table, start=1) if i not in skipped]
    typed = [(i, cells) for i, cells in typed if any(cell != "" for cell in cells)]
    return _cells([cells for _, cells in typed], [i for i, _ in typed], "")


def _typed(cell: Any) -> Any:
    """Return a cell of a workbook as a number, a boolean or text; empty text for nothing."""
    value = cell.value
    if value is None or cell.data_type == "e" or (isinstance(value, str) and not value.strip()):
        return ""
    if isinstance(value, (bool, str)):
        return value
    if isinstance(value, (int, float)):
        # Within quotation marks the sign is text.
        if "%" in re.sub(r'"[^"]*"|\\.', "", cell.number_format):
            return PerCent(value)
        return int(value) if isinstance(value, float) and value.is_integer() else value
    return str(value).removesuffix(" 00:00:00")  # of a date


def _require_lines(skip_rows: Collection[int | str], n: int) -> None:
    if other := [line for line in skip_rows if isinstance(line, str) or line > n]:
        remedy = "only a workbook hides rows" if other[0] == "hidden" else ""
        raise invalid("skip_rows", f"numbers of lines of the file, 1 to {n}", other[0], remedy)


def _listed(lines: Sequence[int]) -> str:
    return ",".join(map(str, lines))


def _separator(lines: Sequence[tuple[int, str]]) -> str:
    """Return the mark between cells: the one with which all rows are as long as the header.

    Spaces divide cells only where no mark does.
    """
    # The first line may be a title without any mark, the last one is a design.
    ends = lines[0][1] + next(line for _, line in reversed(lines) if line.strip())
    readings: dict[str, list[list[str]]] = {}
    for mark in filter(ends.__contains__, _SEPARATORS):
        with suppress(csv.Error):  # quotation marks that stand elsewhere than at cells
            if rows := _rows(lines, mark)[0]:
                readings[mark] = rows

    def merit(mark: str) -> tuple[Any, ...]:
        rows = readings[mark]
        cells = [cell for row in rows[1:] for cell in row]
        numbers = sum(map(is_number, cells)) / max(1, len(cells))
        usual, count = Counter(map(len, rows)).most_common(1)[0]
        # Of several, as names or decimals may have commas, the one with most numbers; of uneven
        # ones that with the longest usual row, so that the message names the row that differs.
        return (True, numbers, usual) if count == len(rows) else (False, usual, count)

    if readings:
        return max(readings, key=merit)
    spaced, _ = _rows(lines, " ")
    divided = len({len(row) for row in spaced}) == 1 and len(spaced[0]) > 1
    # Unless all rows can be one number each, such as 1 250.
    return " " if divided and not all(_GROUPED.fullmatch(" ".join(r)) for r in spaced[1:]) else ","


def _rows(lines: Sequence[tuple[int, str]], separator: str) -> tuple[list[list[str]], list[int]]:
    """Return the rows that are not blank, and the line on which each ends."""
    if separator == " ":
        # Not csv, which finds empty cells between the spaces that align printed columns.
        filled = [(line.split(), number) for number, line in lines if line.strip()]
        return [row for row, _ in filled], [number for _, number in filled]
    # skipinitialspace: else in 'a, "b, c"' the marks would be text and its comma a separator.
    reader = csv.reader(
        (line for _, line in lines),
        delimiter=separator,
        skipinitialspace=separator != "\t",
        strict=True,
    )
    rows, ends = [], []
    for row in reader:
        if any(cell.strip() for cell in row):
            rows.append(row)
            # csv counts the lines it was given, users those of the file.
            ends.append(lines[reader.line_num - 1][0])
    return rows, ends


def _cells(rows: list[list[Any]], ends: list[int], separator: str) -> Cells:
    """Return rows as columns under the names in the first row."""
    if not rows:
        raise UnfitError(_EMPTY)
    usual = Counter(map(len, rows)).most_common(1)[0][0]
    for end, row in zip(ends, rows, strict=True):
        if len(row) != usual:
            what = f"line {end} has {counted(len(row), 'cell')}, most lines {usual}"
            remedy = f"complete it, or leave it out by --skip-rows {end} if it is a title or a note"
            raise UnfitError(f"{what}; {remedy}")
    header = [in_a_line(cell) if isinstance(cell, str) else cell for cell in rows[0]]
    # A file without names would lose its first design as names, and nobody would notice.
    if numbers := [cell for cell in header if is_number(cell)]:
        what = f"its first line must name the columns, and holds numbers, {numbers[0]!r:.40}"
        remedy = "put a line of names above them, or leave lines above it out by --skip-rows"
        raise UnfitError(f"{what}; {remedy}")
    if len(rows) == 1:
        raise UnfitError("it holds column names, but no row")
    columns = zip(header, map(list, zip(*rows[1:], strict=True)), strict=True)
    named = [
        # One without a name numbers rows, as data frames write their index.
        (str(name) or "index", cells)
        for name, cells in columns
        if name != "" or not all(map(is_blank, cells))  # a comma at the end of every line
    ]
    for name, count in Counter(name for name, _ in named).items():
        if count > 1:
            what = f"its header names the column {name!r} {count} times"
            raise UnfitError(f"{what}; leave titles above the names out by --skip-rows")
    return Cells(dict(named), ends[1:], separator)
