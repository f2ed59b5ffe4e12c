"""From the rows that people write into files to columns, and the numbers in these.

A plain number is an optional sign, digits, a decimal mark and an exponent. Points and commas have
two meanings, which depend on the notation:

- with a decimal point, commas may divide thousands: 1.5, 1,250.5;
- with a decimal comma, points may divide thousands: 1,5, 1.250,5.

The notation of a column is found by the first of these rules that applies:

1. ``decimal`` or ``thousands`` decides where the user gives it.
2. A column that only one notation can read, such as one with 1.5, 0.125 or 1.250.000, has that
   notation and is certain.
3. A single mark, as in 1.250, is a decimal mark if it is one in all certain columns of the file. It
   is also one if it is a point, commas separate the cells of the file, and every number in the
   column has three digits behind it, as programs print them.
4. Any other column is refused, so that no number is read that could be another one.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from pymoo_psi._validation import (
    Array,
    Mask,
    counted,
    invalid,
)
from pymoo_psi.errors import ArgumentValueError

# The numbers in a column by decimal mark; NaN for a blank cell, None for any other text.
_Readings: TypeAlias = dict[str, list[float | None]]
RowsByLine: TypeAlias = dict[int, list[Any]]
"""The cells of each row by the number of the line on which it ends."""

EMPTY = "it is empty; it must hold a line of column names, then the designs"

_BLANKS = {"", "nan", "na", "n/a", "<na>", "null", "none", "k.a.", "-", "--", "–", "—", "?"}
# Errors of spreadsheets in any language, such as #DIV/0! and #WERT!, and cells too wide to show.
_ERROR = re.compile(r"#[^\W\d][\w/]*[!?]|#n/?[adv]|##+", re.IGNORECASE)
_MINUS = str.maketrans(dict.fromkeys("−–﹣－", "-"))  # the minus signs of typesetters
_OTHER = {".": ",", ",": "."}
_GAPS = {" ": " \u00a0\u2009\u202f", "'": "'’"}
_LONGEST = 100  # characters of a number; a longer text is not searched for one
# Texts that a reader may take for a number, though they are none by the rules: $5, ~5, 5 kg, 1/2,
# =A1; but not a digit in front of words: 3D printing, 2K moulding, 2-part, 5 bolts M8.
_NUMBERLIKE = re.compile(
    r"=|\W*(?:(?:EUR|USD|GBP|CHF|JPY|CNY|US|ca|circa|approx|about)\b\W*)?\d"
    r"(?!\w*[-‐‑][^\W\d]|[\w.,]*[\s-]*[^\W\d]+[\s-]+[^\W\d]{4,})",
    re.IGNORECASE,
)
_MOMENT = re.compile(  # dates and times
    r"\d{4}-\d\d?-\d\d?(?:[T ].*)?|\d\d?[./]\d\d?[./]\d{2,4}|\d\d?:\d\d(?::\d\d)?"
)
_LEADING = re.compile(r"\W*\d[\d.,'’]*(?:e[+-]?\d+)?", re.IGNORECASE)
_PRINTED = re.compile(r"[+-]?[0-9]+\.[0-9]{3}")
_MARKED = re.compile(r"[+-]?\d[\d.,'’\s]*(?:e[+-]?\d+)?", re.IGNORECASE)
# What spreadsheets and people call rows that summarise others: sums, means, extremes.
_SUMMARY = re.compile(
    r"(?<![^\W_])(sums?|totals?|subtotal|σ|∑|summe|gesamt|insgesamt|gesamtsumme|zwischensumme|"
    r"teilsumme|ergebnis|gesamtergebnis|teilergebnis|zusammen|somme|suma|summa|totale|mean|average|"
    r"avg|ø|mittel|mittelwert|durchschnitt|moyenne|media|promedio|median|zentralwert|std|stdev|"
    r"deviation|итого|всего|сумма|среднее|сума|общо|підсумок|разом|razem|celkem|spolu|ukupno|kokku|"
    r"összesen|toplam|ortalama|totaal|gemiddelde|totalt|gennemsnit|keskiarvo|yhteensä|soma|média|"
    r"jumlah|tổng|σύνολο|المجموع|סך הכל|รวม|합계|평균|合计|总计|合計|平均|"
    r"standardabweichung|min|minimum|max|maximum|best|worst|ideal|nadir|utopia|bester|"
    r"schlechtester)(?![^\W_])",
    re.IGNORECASE,
)
_ROUNDED = 0.01  # relative; a summary is often rounded, and computed from unrounded numbers


class UnfitError(ArgumentValueError):
    """A source is no table; :func:`read_table` adds which source it is.

    Attributes:
        problem: What is wrong, without the remedy, which may name options of the command.
    """

    def __init__(self, problem: str, remedy: str = "") -> None:
        self.problem = problem
        if remedy:
            problem = f"{problem}; {remedy}"
        super().__init__(problem)


@dataclass(frozen=True)
class Cells:
    """The cells of a source, column by column.

    Attributes:
        columns: The n cells of each column by its name, in the order of the source.
        lines: The line of the file on which each row ends; empty if there are no lines.
        separator: The mark between the cells of a text.
        head: What the source says of its columns: of designs, as :func:`designs_head` returns it;
            of a table of tests, as :meth:`FileFormat.write` gets it. Empty if it says nothing.
        label: The column that names the designs, if the source tells.
        rows: The numbers of the rows; from 1 to n if empty.
        metadata: The file that would be read as head, if it were there.
    """

    columns: dict[str, list[Any]]
    lines: Sequence[int] = ()
    separator: str = ""
    head: dict[str, Any] = field(default_factory=dict)
    label: str | None = None
    rows: Sequence[int] = ()
    metadata: str = ""

    def where(self, i: int) -> str:
        """Return the place of the i-th row, for messages."""
        if self.lines:
            return f"row {self.rows[i]} (line {self.lines[i]})"
        return f"row {self.rows[i]}"

    def place(self, name: str, i: int) -> str:
        """Return what the i-th row holds in a column, for messages."""
        content = repr(self.columns[name][i])
        if is_blank(self.columns[name][i]):
            content = "no number"
        return f"{self.where(i)} holds {content:.40} in the column {name!r}"

    def line(self, i: int) -> int:
        """Return the number by which ``skip_rows`` leaves the i-th row out."""
        numbers = self.lines or self.rows
        return numbers[i]


class Column(NamedTuple):
    """The n cells of a column, and the numbers in them.

    Attributes:
        name: The name of the column.
        cells: The cells as they are written.
        numbers: ``(n,)`` numbers, NaN where a cell is blank; ``None`` if the column has others.
        problem: Why a column that may hold numbers cannot be read, and what to do; else empty.
    """

    name: str
    cells: list[Any]
    numbers: Array | None = None
    problem: str = ""

    def require_numbers(self) -> Array:
        """Return the ``(n,)`` numbers.

        Raises:
            ArgumentValueError: The column cannot be read for certain, or holds no number.
        """
        if self.numbers is not None:
            return self.numbers
        if self.problem:
            raise UnfitError(self.problem)
        raise UnfitError(
            f"its column {self.name!r} holds no number at all",
            "name objectives that do, or save what a spreadsheet has not computed yet",
        )


# From rows to cells


def in_a_line(name: str) -> str:
    """Return the name of a column without line breaks, which could not be typed in an option."""
    return re.sub(r"\s*[\r\n]\s*", " ", name.strip())


def cells_of_rows(rows: RowsByLine, separator: str = "") -> Cells:
    """Return rows as columns under the names in the first row.

    Args:
        rows: The cells of each row by the number of its line.
        separator: The mark between the cells of a text.

    Raises:
        ArgumentValueError: The rows differ in length, hold no names or nothing below them, or a
            name occurs twice.
    """
    if not rows:
        raise UnfitError(EMPTY)
    _require_one_length(rows)
    header, *designs = rows.values()
    if not designs:
        raise UnfitError("it holds column names, but no row")
    names = []
    columns = {}
    for name, cells in zip(_names(header), zip(*designs, strict=True), strict=True):
        if name == "":
            if all(map(is_blank, cells)):  # a comma at the end of every line
                continue
            name = "index"  # data frames write the numbers of rows without a name
        names.append(name)
        columns[name] = list(cells)
    for name, count in Counter(names).items():
        if count > 1:
            raise UnfitError(
                f"its header names the column {name!r} {count} times",
                "rename all but one, or leave titles out by --skip-rows",
            )
    return Cells(columns, [*rows][1:], separator)


def cells_as_written(rows: RowsByLine, head: dict[str, Any]) -> Cells:
    """Return the rows of a file of ours as columns under the names in the first row, as they are.

    Raises:
        ArgumentValueError: The rows differ in length.
    """
    if not rows:
        return Cells({}, head=head)
    _require_one_length(rows)
    header, *tests = rows.values()
    columns = {str(name): [row[j] for row in tests] for j, name in enumerate(header)}
    return Cells(columns, head=head)


def _require_one_length(rows: RowsByLine) -> None:
    usual, _ = Counter(map(len, rows.values())).most_common(1)[0]
    for end, row in rows.items():
        if len(row) != usual:
            raise UnfitError(
                f"line {end} has {counted(len(row), 'cell')}, most lines {usual}",
                f"complete it, or leave it out by --skip-rows {end} if it is a title or a note",
            )


def _names(header: list[Any]) -> list[str]:
    """Return the names in a header, empty where there is none."""
    names = []
    for cell in header:
        name = cell
        if isinstance(cell, str):
            name = in_a_line(cell)
        # A file without names would lose its first design as names, and nobody would notice.
        if is_number(name):
            raise UnfitError(
                f"its first line must name the columns, and holds numbers, {name!r:.40}",
                "put a line of names above them, or leave lines above it out by --skip-rows",
            )
        names.append(str(name))
    return names


def cells_of_frame(frame: Any) -> Cells:
    """Return the cells of a data frame; an index other than row numbers names the rows."""
    import pandas as pd  # only where there is a frame

    if len(frame) == 0 or not frame.columns.is_unique:
        raise invalid("source", "a frame with rows, whose columns have different names", frame)
    label = None
    if not isinstance(frame.index, pd.RangeIndex):
        label = str(frame.index.name or "index")
        frame = frame.rename_axis(label).reset_index()
    frame = frame.astype(object).where(frame.notna(), None)
    columns = {str(name): frame[name].tolist() for name in frame}
    return Cells(columns, label=label)


# From cells to numbers


def is_blank(cell: Any) -> bool:
    """Say whether a cell holds nothing, a word for it, or an error of a spreadsheet."""
    if not isinstance(cell, str):
        return cell is None or cell != cell
    text = cell.strip()
    if text.lower().replace(". ", ".") in _BLANKS:
        return True
    return text.startswith("#") and _ERROR.fullmatch(text) is not None


def is_number(cell: Any) -> bool:
    """Say whether a cell is a plain number in any notation."""
    if isinstance(cell, str):
        return _MARKED.fullmatch(_plain(cell)[:_LONGEST]) is not None
    return _is_numeric(cell)


def _is_numeric(cell: Any) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool)


def _plain(cell: Any) -> Any:
    """Return a text without spaces around it and with ASCII minus signs."""
    if not isinstance(cell, str):
        return cell
    if not cell.isascii():
        cell = cell.translate(_MINUS)
    return cell.strip()


def read_columns(
    cells: Cells, decimal: str | None, thousands: str | None, labels: Collection[str]
) -> dict[str, Column]:
    """Return columns with their numbers, by the rules at the top of this module.

    Args:
        cells: Texts, or the values of a source whose cells have types.
        decimal: The decimal mark, ``"."`` or ``","``, if the user gave it.
        thousands: The mark between thousands, ``"."``, ``","``, ``" "`` or ``"'"``, if the user
            gave it.
        labels: Columns that name designs. A design called 1.2 says nothing about decimals.
    """
    notations = _notations(decimal, thousands)
    readings = {}
    certain = set()
    for name, column in cells.columns.items():
        plain = list(map(_plain, column))
        readings[name] = {n.decimal: list(map(n.number, plain)) for n in notations}
        marks = _possible_marks(readings[name])
        if len(marks) == 1 and name not in labels:
            certain.add(marks[0])
    columns = {}
    for name in cells.columns:
        columns[name] = _column(cells, name, readings[name], certain)
    return columns


class _Notation(NamedTuple):
    """How numbers with one decimal mark are written, and the translation to Python's."""

    decimal: str
    pattern: re.Pattern[str]
    translation: dict[int, str]

    def number(self, cell: Any) -> float | None:
        """Return the number in a cell, NaN if it is blank, ``None`` if it holds anything else."""
        if isinstance(cell, str) and len(cell) <= _LONGEST and self.pattern.fullmatch(cell):
            return float(cell.translate(self.translation))
        if _is_numeric(cell):
            return float(str(cell))  # infinite for an integer beyond float64
        if is_blank(cell):
            return np.nan
        return None


def _notations(decimal: str | None, thousands: str | None) -> list[_Notation]:
    """Return the notations that the decimal mark and the mark between thousands allow."""
    if decimal not in (None, ".", ","):
        raise invalid("decimal", "'.' or ','", decimal)
    if thousands not in (None, ".", ",", " ", "'") or thousands == (decimal or ""):
        raise invalid("thousands", "'.', ',', ' ' or \"'\", and not the decimal mark", thousands)
    if decimal is None and thousands in _OTHER:
        decimal = _OTHER[thousands]
    return [_notation(mark, thousands) for mark in decimal or ".,"]


def _notation(decimal: str, thousands: str | None) -> _Notation:
    if thousands is None:
        gaps = _OTHER[decimal] + "".join(_GAPS.values())
    else:
        gaps = _GAPS.get(thousands, thousands)
    mark = re.escape(decimal)
    # The same gap divides all groups of a number; nobody groups digits in front of an exponent.
    group = rf"(?P<gap>[{gaps}])[0-9]{{3}}(?:(?P=gap)[0-9]{{3}})*"
    grouped = rf"[1-9][0-9]{{0,2}}{group}(?:{mark}[0-9]*)?"
    plain = rf"(?:[0-9]+(?:{mark}[0-9]*)?|{mark}[0-9]+)(?:[eE][+-]?[0-9]+)?"
    pattern = re.compile(rf"[+-]?(?:{grouped}|{plain}|inf|infinity|∞)", re.IGNORECASE)
    translation = dict.fromkeys(gaps, "") | {decimal: ".", "∞": "inf"}
    return _Notation(decimal, pattern, str.maketrans(translation))


def _possible_marks(readings: _Readings) -> list[str]:
    """Return the decimal marks with which all cells of a column are numbers or blank."""
    return [mark for mark, numbers in readings.items() if None not in numbers]


def _column(cells: Cells, name: str, readings: _Readings, certain: set[str]) -> Column:
    """Return a column by its readings and the decimal marks of the certain columns."""
    column = cells.columns[name]
    marks = _possible_marks(readings)
    if not marks:
        return Column(name, column, problem=_problem_of_texts(cells, name, readings))
    first = np.array(readings[marks[0]])
    last = np.array(readings[marks[-1]])
    if np.isnan(first).all():
        return Column(name, column)
    ambiguous = np.flatnonzero(~np.isnan(first) & (first != last)).tolist()
    if not ambiguous:
        return Column(name, column, first)
    i = ambiguous[0]
    decimal = _mark_in(column[i])
    # It is a decimal mark if all certain columns agree, or else if a program printed the numbers.
    is_one_mark = all(_mark_in(column[k]) == decimal for k in ambiguous)
    if certain:
        is_decimal = certain == {decimal}
    else:
        is_decimal = cells.separator == "," and all(map(_is_printed, column))
    if is_one_mark and is_decimal:
        return Column(name, column, np.array(readings[decimal]))
    numbers = f"{readings[_OTHER[decimal]][i]:.15g} or {readings[decimal][i]:.15g}"
    remedy = f"settle it by --thousands '{decimal}' or --decimal '{decimal}'"
    return Column(name, column, problem=f"{cells.place(name, i)}, either {numbers}; {remedy}")


def _mark_in(cell: str) -> str:
    """Return the mark in a number that may be read in two ways, and so has one mark."""
    if "." in cell:
        return "."
    return ","


def _is_printed(cell: Any) -> bool:
    return is_blank(cell) or _PRINTED.fullmatch(str(cell).strip()) is not None


def _problem_of_texts(cells: Cells, name: str, readings: _Readings) -> str:
    """Return what is wrong with a column that no notation can read; empty if it is one of texts."""
    numbers = min(readings.values(), key=lambda numbers: numbers.count(None))
    others = [i for i, number in enumerate(numbers) if number is None]
    rule = "no plain number"
    # One number is enough: taken for text, the column would silently be no objective.
    if any(number is not None and number == number for number in numbers):
        rule = "no plain number like the others"
    else:
        texts = {i: str(cells.columns[name][i]).strip() for i in others}
        # Numbers of one unit, such as 5 k Euro, or texts? One number alone would rank nothing.
        units = {_LEADING.sub("", text, count=1) for text in texts.values()}
        have_one_unit = len(units) == 1 < len({*texts.values()}) and _LEADING.match(
            texts[others[0]]
        )
        others = []
        for i, text in texts.items():
            if not _MOMENT.fullmatch(text) and (have_one_unit or _looks_like_number(text)):
                others.append(i)
    if not others:
        return ""
    return (
        f"{cells.place(name, others[0])}, {rule}; write it without a unit, settle it by "
        "--decimal and --thousands, leave its line out by --skip-rows "
        f"{cells.line(others[0])}, or name the objectives by --objectives"
    )


def _looks_like_number(text: str) -> bool:
    return _NUMBERLIKE.match(text[:_LONGEST]) is not None


# Rows that summarise others


def require_designs(cells: Cells, columns: Collection[Column]) -> None:
    """Refuse rows that summarise others, such as "Total".

    A name alone says nothing, since a design may be called Max, nor do a few equal numbers. A row
    is refused if it has such a name and its numbers summarise all other rows, or those next to it.

    Raises:
        ArgumentValueError: There is such a row.
    """
    names: dict[int, str] = {}
    numbers = []
    for column in columns:
        if column.numbers is not None:
            numbers.append(column.numbers)
        else:
            names |= _names_of_summaries(column.cells)
    n = len(cells.rows)
    if numbers:
        nameless = _nameless_sum(cells.columns.get(cells.label or ""), np.array(numbers).T)
        names |= dict.fromkeys(nameless, "")
    # Words in most of many rows are values of a column, such as the levels min and max.
    if not names or not numbers or len(names) > max(10, n // 2):
        return
    F = np.column_stack(numbers)
    F = np.where(np.isfinite(F), F, np.nan)
    named = sorted(names)
    others = np.setdiff1d(np.arange(n), named)
    # The sum of a group is directly above or below it.
    groups = np.split(others, np.searchsorted(others, named))
    for k, i in enumerate(named):
        if any(_summarises(F[i], F[rows]) for rows in (others, groups[k], groups[k + 1])):
            skipped = ",".join(map(str, map(cells.line, named)))
            called = "has no name"
            remedy = "name it"
            if names[i]:
                called = f"is called {names[i]!r:.40}"
                remedy = "rename it"
            raise UnfitError(
                f"{cells.where(i)} {called} and summarises other rows",
                f"leave it out by --skip-rows {skipped}, or {remedy}",
            )


def _nameless_sum(labels: Sequence[Any] | None, F: Array) -> list[int]:
    """Return the row that may be one of sums without a name, if there is one.

    Among designs with names a blank one is enough to suspect it; without any names, it is the last
    row, which must be the sum of three rows or more in all of several columns.
    """
    if labels is not None:
        blanks = [i for i, label in enumerate(labels) if is_blank(label)]
        return blanks if len(blanks) == 1 else []
    above = F[:-1]
    if len(above) < 3 or F.shape[1] < 2 or (above == 0).all(axis=0).any():
        return []
    with np.errstate(all="ignore"):
        is_sum = np.allclose(np.nansum(above, axis=0), F[-1], rtol=1e-9, atol=0)
    return [len(above)] if is_sum else []


def _names_of_summaries(column: list[Any]) -> dict[int, str]:
    """Return the cells that hold a word for a summary, by row."""
    names = {}
    for i, cell in enumerate(column):
        if isinstance(cell, str) and _SUMMARY.search(cell):
            names[i] = cell.strip()
    return names


def _summarises(row: Array, F: Array) -> bool:
    """Say whether a row holds sums, means, medians, deviations or extremes of other rows."""
    # One number, or one beside zeros, is no sign of a summary, nor are equal numbers.
    several = np.isfinite(row) & ((np.isfinite(F) & (F != 0)).sum(axis=0) > 1)
    if not several.any():
        return False
    F = F[:, several]
    row = row[several]
    least = np.nanmin(F, axis=0)
    greatest = np.nanmax(F, axis=0)
    varied = least < greatest

    def close(summary: Array) -> Mask:
        return np.abs(summary - row) <= _ROUNDED * np.abs(row)

    matches = [(row == least) | (row == greatest)]
    with np.errstate(all="ignore"):
        sums = close(np.nansum(F, axis=0))
        for summary in (np.nanmean, np.nanmedian, np.nanstd):
            matches.append(close(summary(F, axis=0)))
    if varied.any() and any(match[varied].all() for match in matches):
        return True
    # Beside sums there may be ratios of sums; but a design may be the best in many columns.
    return bool(sums.mean() >= 0.5)
