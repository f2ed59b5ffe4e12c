"""What people write into files: from a text or a workbook to columns, and the numbers in them.

A plain number is an optional sign, digits, a decimal mark and an exponent. Points and commas
have two meanings, one in each notation:

- with a decimal point, commas may divide thousands: 1.5, 1,250.5;
- with a decimal comma, points may: 1,5, 1.250,5.

1. Where ``decimal`` or ``thousands`` is given, it decides.
2. Else a column that only one notation can read, as one with 1.5, 0.125 or 1.250.000, is of it.
3. Else the mark, as in 1.250, is a decimal mark if it is one in all columns of the file that are
   certain; or if it is a point in a file with commas between its cells, and all numbers of the
   column have three digits behind it, as programs print them.
4. Else the column is refused: no number is read that could be another one.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO, StringIO
from typing import Any, NamedTuple, TypeAlias
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._output import HEAD_SHEET, workbooks
from pymoo_psi._validation import counted, invalid, known_name
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table._format import Head, sheet_head

Array: TypeAlias = NDArray[np.float64]
# The numbers of a column by decimal mark; NaN of a blank cell, None of any other.
_Values: TypeAlias = dict[str, list[float | None]]
Row: TypeAlias = list[Any]

_SEPARATORS = ",;\t|"
_EMPTY = "it is empty; it must hold a line of column names, then the designs"

_BLANKS = {"", "nan", "na", "n/a", "<na>", "null", "none", "k.a.", "-", "--", "–", "—", "?"}
# Errors of spreadsheets in any language, #DIV/0! as #WERT!, and of columns that are too narrow.
_ERROR = re.compile(r"#[^\W\d][\w/]*[!?]|#n/?[adv]|##+", re.IGNORECASE)
_MINUS = str.maketrans(dict.fromkeys("−–﹣－", "-"))  # the minus signs of typesetters
_OTHER = {".": ",", ",": "."}
_GAPS = {" ": " \u00a0\u2009\u202f", "'": "'’"}
_LONGEST = 100  # characters of a number; a longer text is none, and costs no time
# What a reader may take for a number, though it is none by the rule: $5, ~5, 5 kg, 1/2, =A1; but
# not dates and times.
_NUMBERLIKE = re.compile(
    r"(?!\d{4}-\d\d?-\d\d?(?:[T ].*)?$|\d\d?[./]\d\d?[./]\d{2,4}$|\d\d?:\d\d(?::\d\d)?$)"
    r"(?:=|\W*(?:(?:EUR|USD|GBP|CHF|JPY|CNY|US|ca|circa|approx|about)\b\W*)?\d)",
    re.IGNORECASE,
)
_PRINTED = re.compile(r"[+-]?[0-9]+\.[0-9]{3}")
_MARKED = re.compile(r"[+-]?\d[\d.,'’\s]*(?:e[+-]?\d+)?", re.IGNORECASE)
# Words by which spreadsheets and people call rows that summarise others: sums, means, extremes.
_SUMMARY = re.compile(
    r"\b(sums?|totals?|subtotal|σ|summe|gesamt|insgesamt|gesamtsumme|zwischensumme|teilsumme|"
    r"ergebnis|gesamtergebnis|teilergebnis|somme|suma|totale|mean|average|avg|ø|mittel|mittelwert|"
    r"durchschnitt|moyenne|media|promedio|median|zentralwert|std|stdev|deviation|"
    r"standardabweichung|min|minimum|max|maximum|best|worst|ideal|nadir|utopia|bester|"
    r"schlechtester)\b",
    re.IGNORECASE,
)
_ROUNDED = 0.01  # relative; what is shown is often the rounded summary of unrounded numbers


class UnfitError(ArgumentValueError):
    """A source is no table; :func:`read_table` says which source."""


@dataclass(frozen=True)
class Cells:
    """The cells of a source that is no table of tests.

    Attributes:
        columns: The n cells of each column by its name, in the order of the source.
        lines: The line of the file on which each row ends; empty if there are no lines.
        separator: The mark between the cells of a text.
        head: What the source says of its columns, as :func:`designs_head` writes it.
        label: The column that names the designs, if the source says so.
        rows: The numbers of the rows, from 1 to n if empty.
    """

    columns: dict[str, list[Any]]
    lines: Sequence[int] = ()
    separator: str = ""
    head: Head | None = None
    label: str | None = None
    rows: Sequence[int] = ()

    def where(self, i: int) -> str:
        """Say where the i-th row stands."""
        return f"row {self.rows[i]}" + (f" (line {self.lines[i]})" if self.lines else "")

    def line(self, i: int) -> int:
        """Return the number by which the i-th row is left out."""
        return (self.lines or self.rows)[i]


class Column(NamedTuple):
    """The n cells of a column, and their numbers.

    Attributes:
        name: Its name.
        cells: The cells as they are written.
        numbers: ``(n,)`` numbers, NaN where a cell is blank; ``None`` if it is no column of them.
        problem: Of a column that may be one of numbers but cannot be read: what is wrong, and what
            settles it.
    """

    name: str
    cells: list[Any]
    numbers: Array | None = None
    problem: str = ""

    def required(self) -> Array:
        """Return the ``(n,)`` numbers.

        Raises:
            ArgumentValueError: It cannot be read for certain, or holds no number.
        """
        if self.numbers is None:
            remedy = "name objectives that do, or save what a spreadsheet has not computed yet"
            raise UnfitError(
                self.problem or f"its column {self.name!r} holds no number at all; {remedy}"
            )
        return self.numbers


# From bytes to cells


def decoded(content: bytes, encoding: str | None) -> str:
    """Return the text in the bytes of a file, by its byte-order mark or UTF-8 unless given.

    Raises:
        ArgumentValueError: It is no such text, or there is no such encoding.
    """
    wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        text = content.decode(encoding or ("utf-16" if wide else "utf-8-sig"))
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


def cells_of_text(text: str, skip_rows: Collection[int]) -> Cells:
    """Return the cells of a text.

    By the csv module, as pandas fills short rows up and joins rows between stray quotation marks.
    Lines that begin with ``#`` are comments, unless all designs do: labels may be #1, #2, …. One
    that could be a design among others is refused.

    Raises:
        ArgumentValueError: It is no table of named columns with one row or more.
    """
    whole = [*enumerate(StringIO(text, newline=""), start=1)]
    if (last := max(skip_rows, default=0)) > len(whole):
        raise invalid("skip_rows", f"numbers of lines of the file, 1 to {len(whole)}", last)
    lines = [(i, line) for i, line in whole if i not in skip_rows]
    plain = (k for k, (_, line) in enumerate(lines) if not re.match(r'"*#|\s*$', line))
    lines = lines[next(plain, len(lines)) :]
    if not lines:
        raise UnfitError(_EMPTY)
    separator = _separator(lines)
    try:
        rows, ends = _rows(lines, separator)
    except csv.Error as error:
        raise UnfitError(f"it is no text in rows and columns: {error}") from None
    marked = {k for k, row in enumerate(rows) if row[0][:1] == "#" and not is_blank(row[0])}
    if len(marked) < len(rows) - 1:
        for k in marked:
            if len(rows[k]) == len(rows[0]) > 1 and all(rows[k]):
                what = f"line {ends[k]} begins with # and has a cell in each column"
                out = f"leave it out by --skip-rows {ends[k]} if it is a comment"
                raise UnfitError(f"{what}; {out}, or begin its name otherwise")
        kept = [k for k in range(len(rows)) if k not in marked]
        rows, ends = [rows[k] for k in kept], [ends[k] for k in kept]
    return cells_of_rows(rows, ends, separator)


def rows_of_workbook(
    content: bytes, skip_rows: Collection[int], name: str | None
) -> tuple[Head | None, dict[int, Row]]:
    """Return what a sheet of ours says of its rows, and these by number, of one length.

    Raises:
        ArgumentValueError: It is no workbook, there is no sheet of that name, it is not known which
            one is meant, or the sheet hides rows that are not left out.
        PsiError: openpyxl is not installed.
    """
    openpyxl = workbooks()
    try:
        with catch_warnings():
            simplefilter("ignore")  # of drawings and the like, which are not read
            # Read-only: else one merged range or link of 100 bytes becomes a million cells.
            book = openpyxl.load_workbook(BytesIO(content), read_only=True, data_only=True)
            titles, head = [sheet.title for sheet in book.worksheets], None
            if titles[1:] == [HEAD_SHEET]:
                head = sheet_head(book[HEAD_SHEET].iter_rows(values_only=True))
                titles = titles[:1]
            # Taking the first sheet would rank the wrong one where a cover comes first.
            if name is None and len(titles) != 1:
                listed = ", ".join(titles) or "none"
                what = f"it has {counted(len(titles), 'sheet')}: {listed}"
                raise UnfitError(f"{what}; name the one with the designs by --sheet")
            sheet = book[titles[0] if name is None else known_name("sheet", name, titles)]
            sheet.reset_dimensions()  # what a file declares may be more than it holds
            numbered = enumerate(sheet.iter_rows(), start=1)
            shown = {i: [*map(_shown, row)] for i, row in numbered}
            rows = {i: row for i, row in shown.items() if not all(map(_nothing, row))}
            hidden = sorted(_hidden_rows(sheet) & rows.keys() - {*skip_rows})
    except PsiError:
        raise
    except Exception as error:  # of zip, XML, openpyxl
        raise UnfitError(f"it cannot be read as a workbook (.xlsx): {error}") from None
    if hidden:
        what = f"the sheet hides {counted(len(hidden), 'row')}"
        out = ",".join(map(str, hidden))
        raise UnfitError(f"{what}; show them, or leave them out by --skip-rows {out}")
    ends = (j for row in rows.values() for j, cell in enumerate(row, 1) if not _nothing(cell))
    width = max(ends, default=0)
    return head, {i: [*row, *[None] * width][:width] for i, row in rows.items()}


def _hidden_rows(sheet: Any) -> set[int]:
    """Return the hidden rows of a sheet, which openpyxl tells only where it loads everything."""
    from xml.etree.ElementTree import iterparse  # loaded where a workbook is read

    hidden, i = set(), 0
    with sheet._get_source() as file:
        for _, element in iterparse(file):
            if element.tag.endswith("}row"):
                i = int(element.get("r", i + 1))
                if element.get("hidden") in ("1", "true"):
                    hidden.add(i)
                element.clear()
    return hidden


def cells_of_sheet(rows: Mapping[int, Row], skip_rows: Collection[int], head: Head | None) -> Cells:
    """Return the cells of a sheet that people have written."""
    kept = {i: [*map(_typed, row)] for i, row in rows.items() if i not in skip_rows}
    return cells_of_rows([*kept.values()], [*kept], "", head)


def _shown(cell: Any) -> Any:
    """Return what a cell of a workbook holds, 0.85 in the format 0 % as the text that it shows."""
    value = cell.value
    if isinstance(value, (int, float)) and "%" in cell.number_format:
        return f"{100 * value:.15g} %"
    return value


def _nothing(cell: Any) -> bool:
    return cell is None or cell == ""


def _typed(cell: Any) -> Any:
    """Return a cell of a workbook as a number, a boolean or text; empty text for nothing."""
    if cell is None or isinstance(cell, str):
        return (cell or "").strip()
    return cell if isinstance(cell, (int, float)) else str(cell).removesuffix(" 00:00:00")  # a date


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
    return " " if len({len(row) for row in spaced}) == 1 and len(spaced[0]) > 1 else ","


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


def in_a_line(name: str) -> str:
    """Return the name of a column without line breaks, which could not be typed as an option."""
    return re.sub(r"\s*[\r\n]\s*", " ", name.strip())


def cells_of_rows(
    rows: list[list[Any]], ends: list[int], separator: str, head: Head | None = None
) -> Cells:
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
            raise UnfitError(f"{what}; rename all but one, or leave titles out by --skip-rows")
    return Cells(dict(named), ends[1:], separator, head)


# From cells to numbers


def is_blank(cell: Any) -> bool:
    """Say whether a cell holds nothing, or a word for it."""
    if isinstance(cell, str):
        text = cell.strip()
        return text.lower().replace(". ", ".") in _BLANKS or (
            text[:1] == "#" and bool(_ERROR.fullmatch(text))
        )
    return cell is None or cell != cell


def is_number(cell: Any) -> bool:
    """Say whether a cell is a plain number in any notation."""
    if not isinstance(cell, str):
        return isinstance(cell, (int, float)) and not isinstance(cell, bool)
    return bool(_MARKED.fullmatch(_plain(cell)[:_LONGEST]))


def read_columns(
    cells: Cells, decimal: str | None, thousands: str | None, labels: Collection[str]
) -> dict[str, Column]:
    """Return columns with their numbers; see the rule on top.

    Args:
        cells: Texts, or the values of a source whose cells have types.
        decimal: The decimal mark, ``"."`` or ``","``, if it is known.
        thousands: The mark between thousands, ``"."``, ``","``, ``" "`` or ``"'"``, if it is known.
        labels: Columns that name designs: a design 1.2 says nothing of decimals.
    """
    notations = _notations(decimal, thousands)
    readings = {name: _read(column, notations) for name, column in cells.columns.items()}
    certain = {
        marks[0]
        for name, values in readings.items()
        if name not in labels and len(marks := _marks(values)) == 1
    }
    return {name: _column(cells, name, values, certain) for name, values in readings.items()}


def _notations(
    decimal: str | None, thousands: str | None
) -> dict[str, tuple[re.Pattern[str], dict[int, str]]]:
    """Return patterns of numbers and translations to Python's, by possible decimal mark."""
    if decimal not in (None, ".", ","):
        raise invalid("decimal", "'.' or ','", decimal)
    if thousands not in (None, ".", ",", " ", "'") or thousands == (decimal or ""):
        raise invalid("thousands", "'.', ',', ' ' or \"'\", and not the decimal mark", thousands)
    known = decimal or _OTHER.get(thousands or "")
    notations = {}
    for mark in (known,) if known else (".", ","):
        # Without a word on thousands, a gap divides nothing else in a number.
        gaps = _GAPS.get(thousands or "", thousands or _OTHER[mark] + "".join(_GAPS.values()))
        d, t = re.escape(mark), f"[{gaps}]"
        # Nobody groups digits in front of an exponent.
        grouped = rf"[1-9][0-9]{{0,2}}(?P<gap>{t})[0-9]{{3}}(?:(?P=gap)[0-9]{{3}})*(?:{d}[0-9]*)?"
        plain = rf"(?:[0-9]+(?:{d}[0-9]*)?|{d}[0-9]+)(?:[eE][+-]?[0-9]+)?"
        pattern = re.compile(rf"[+-]?(?:{grouped}|{plain}|inf|infinity|∞)", re.IGNORECASE)
        notations[mark] = pattern, str.maketrans({**dict.fromkeys(gaps, ""), mark: ".", "∞": "inf"})
    return notations


def _read(
    cells: list[Any], notations: Mapping[str, tuple[re.Pattern[str], dict[int, str]]]
) -> _Values:
    plain = [cell if not isinstance(cell, str) else _plain(cell) for cell in cells]
    return {mark: [_number(cell, *how) for cell in plain] for mark, how in notations.items()}


def _marks(values: _Values) -> list[str]:
    """Return the decimal marks with which all cells of a column are numbers or blank."""
    return [mark for mark, numbers in values.items() if None not in numbers]


def _plain(cell: str) -> str:
    """Return a text without spaces about it and minus signs of typesetters."""
    return (cell if cell.isascii() else cell.translate(_MINUS)).strip()


def _number(cell: Any, pattern: re.Pattern[str], translation: dict[int, str]) -> float | None:
    """Return the number in a cell, NaN if it is blank, ``None`` if there is another text."""
    if isinstance(cell, str) and len(cell) <= _LONGEST and pattern.fullmatch(cell):
        return float(cell.translate(translation))
    if isinstance(cell, (int, float)) and not isinstance(cell, bool):
        return float(str(cell))  # infinite for an integer beyond float64
    return np.nan if is_blank(cell) else None


def _column(cells: Cells, name: str, values: _Values, certain: Collection[str]) -> Column:
    """Return a column by its readings and the decimal marks of the certain columns."""
    column = cells.columns[name]

    def refused(i: Any, what: str) -> Column:
        where = f"{cells.where(i)} holds {column[i]!r:.40} in the column {name!r}"
        return Column(name, column, problem=f"{where}, {what}")

    marks = _marks(values)
    if not marks:
        best = min(values.values(), key=lambda numbers: numbers.count(None))
        texts = [i for i, number in enumerate(best) if number is None]
        # One number is enough: taken for text, the column would silently be no objective.
        if mixed := any(number == number for number in best if number is not None):
            looks = texts
        else:
            looks = [i for i in texts if _NUMBERLIKE.match(str(column[i]).strip()[:_LONGEST])]
        if looks:
            what = f"no plain number{' like the others' * mixed}; write it without a unit, "
            what += "settle it by --decimal and --thousands, leave its line out by --skip-rows "
            what += f"{cells.line(looks[0])}, or name the objectives by --objectives"
            return refused(looks[0], what)
        return Column(name, column)
    one, two = np.array(values[marks[0]]), np.array(values[marks[-1]])
    if np.isnan(one).all():
        return Column(name, column)
    decimal = marks[0]
    if len(unclear := np.flatnonzero(~np.isnan(one) & (one != two))):
        i, used = unclear[0], {mark for i in unclear for mark in ".," if mark in column[i]}
        printed = all(is_blank(c) or _PRINTED.fullmatch(str(c).strip()) for c in column)
        decimal = "." if "." in column[i] else ","
        settled = used == certain or (printed and cells.separator == "," and not certain)
        if len(used) > 1 or not settled:
            readings = " or ".join(f"{values[m][i]:.15g}" for m in (_OTHER[decimal], decimal))
            remedy = f"settle it by --thousands '{decimal}' or --decimal '{decimal}'"
            return refused(i, f"either {readings}; {remedy}")
    return Column(name, column, np.array(values[decimal]))


# Rows that summarise others


def require_designs(cells: Cells, columns: Collection[Column]) -> None:
    """Refuse rows that summarise others, such as "Total".

    A name alone says nothing, as a design may be called Max, nor do a few equal numbers: a row is
    refused if it is called by such a word and holds these numbers, of all other rows or of those
    next to it.

    Raises:
        ArgumentValueError: There is such a row.
    """
    called: dict[int, str] = {}
    for column in columns:
        for i, cell in enumerate(column.cells if column.numbers is None else ()):
            if isinstance(cell, str) and _SUMMARY.search(cell):
                called[i] = cell.strip()
    n, numbers = len(cells.rows), [c.numbers for c in columns if c.numbers is not None]
    # Words in most of many rows are values of a column, such as the levels min and max.
    if not called or not numbers or len(called) > max(10, n // 2):
        return
    F = np.column_stack(numbers)
    F = np.where(np.isfinite(F), F, np.nan)
    order = sorted(called)
    others = np.setdiff1d(np.arange(n), order)
    # Sums of groups stand below or above these, so between the rows that summarise.
    groups = np.split(others, np.searchsorted(others, order))
    for k, i in enumerate(order):
        if any(_summarises(F[i], F[rows]) for rows in (others, groups[k], groups[k + 1])):
            out = ",".join(str(cells.line(j)) for j in order)
            what = f"{cells.where(i)} is called {called[i]!r:.40} and summarises other rows"
            raise UnfitError(f"{what}; leave it out by --skip-rows {out}, or rename it")


def _summarises(row: Array, F: Array) -> bool:
    """Whether a row holds sums, means, medians, deviations or extremes of other rows."""
    # One number, or one beside zeros, is no sign of a summary, nor are equal numbers.
    several = np.isfinite(row) & ((np.isfinite(F) & (F != 0)).sum(axis=0) > 1)
    if not several.any():
        return False
    F, row = F[:, several], row[several]
    with np.errstate(all="ignore"):
        functions = (np.nansum, np.nanmean, np.nanmedian, np.nanstd, np.nanmin, np.nanmax)
        found = np.array([function(F, axis=0) for function in functions])
        close = np.abs(found - row) <= _ROUNDED * np.abs(row)
    close[4] = (row == found[4]) | (row == found[5])
    varied = found[4] < found[5]
    # Beside sums there may be ratios of sums; but a design may be the best in many columns.
    summary = varied.any() and close[1:5, varied].all(axis=1).any()
    return bool(summary or close[0].mean() >= 0.5)
