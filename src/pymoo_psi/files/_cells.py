"""From the rows that people write into files to columns, and the numbers in these.

A cell is the first of these that fits:

- blank: nothing, a word for it, or an error of a spreadsheet;
- a number: an optional sign, digits, a decimal mark and an exponent; or digits in groups of three;
  or as Fortran writes it. In a column in which all have one, "%" may follow;
- a date or time;
- like a number to a reader, though it is none by these rules: a column of such cells is refused;
- any other text.

Points and commas have two meanings, which depend on the notation:

- with a decimal point, commas may divide thousands: 1.5, 1,250.5;
- with a decimal comma, points may divide thousands: 1,5, 1.250,5.

The notation of a column is found by the first of these rules that applies:

1. ``decimal`` decides where the user gives it.
2. A column that only one notation can read, such as one with 1.5, 0.125 or 1.250.000, has that
   notation and is certain.
3. A single mark, as in 1.250, is a decimal mark if it is one in all certain columns of the file. It
   is also one if it is a point, commas separate the cells of the file, and every number in the
   column has three digits behind it, as programs print them.
4. Any other column is refused, so that no number is read that could be another one.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, compress
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from pymoo_psi._kinds import plain
from pymoo_psi._names import EDIT, argument
from pymoo_psi._validation import Array, Head, Mask, Names, counted, invalid
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table import free_name

RowsByLine: TypeAlias = dict[int, list[Any]]
"""The cells of each row by the number of the line on which it ends."""

_LONGEST = 100  # the most characters in which something like a number is searched

# Nothing, words for it, and errors of spreadsheets in any language, such as #DIV/0! and #WERT!, or
# cells too wide to show.
_BLANK = re.compile(
    r"|nan|n/?a|<na>|null|none|k\. ?a\.|--?|[–—?]|#[^\W\d][\w/]*[!?]|#n/?[adv]|##+", re.IGNORECASE
)
# The forms of a number without its sign, the part of each that float() does not read, and what it
# reads instead. Numbers have a decimal point; where it is a comma, both marks are swapped before.
_FORMS = {
    "plain": (r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:e[+-]?[0-9]+)?", None, ""),
    "infinite": (r"inf(?:inity)?", None, ""),
    # The same gap divides all groups of a number; nobody groups digits in front of an exponent.
    "grouped": (
        r"[1-9][0-9]{0,2}(?P<gap>[, \u00a0\u2009\u202f'’])[0-9]{3}(?:(?P=gap)[0-9]{3})*"
        r"(?:\.[0-9]*)?",
        r"[^0-9.+-]",
        "",
    ),
    # Fortran writes 1D+03 and 1.5D3, and 0.12+103 for an exponent of three digits.
    "Fortran": (r"(?:[0-9]+d[+-]|(?:[0-9]+\.[0-9]*|\.[0-9]+)d[+-]?)[0-9]+", "[dD]", "e"),
    "long": (r"(?:0?\.[0-9]+|[1-9]\.[0-9]{3,})[+-][123][0-9]{2}", "(?<=[0-9])(?=[+-])", "e"),
}
_NUMBER = re.compile(
    "[+-]?(?:" + "|".join(f"(?P<{form}>{text})" for form, (text, *_) in _FORMS.items()) + ")",
    re.IGNORECASE,
)
# Signs of plain numbers with a decimal point, one on each line.
_PLAIN = re.compile(r"(?:[0-9.e+\-]+(?:\n|\Z))*", re.IGNORECASE)
_MINUS = str.maketrans(dict.fromkeys("−–﹣－", "-"))  # the minus signs of typesetters
SWAPPED = str.maketrans(".,", ",.")
_PRINTED = re.compile(r"[+-]?[0-9]+\.[0-9]{3}")
# Digits that no program writes for a number: postal codes, numbers of articles.
_CODE = re.compile(r"0[0-9]+")
_DATE_OR_TIME = re.compile(
    r"\d{4}-\d\d?-\d\d?(?:[T ].*)?|\d\d?[./]\d\d?[./]\d{2,4}|\d\d?:\d\d(?::\d\d)?"
)
_TIME = re.compile(r"\d+:\d\d(?::\d\d(?:\.\d+)?)?")  # 1:30 or 1:30:00.5
# Texts that a reader may take for a number, though they are none by the rules: $5, ~5, 5 kg, 1/2,
# =A1; but not a digit in front of words: 3D printing, 2K moulding, 2-part, 5 bolts M8.
_NUMBERLIKE = re.compile(
    r"=|\W*(?:(?:EUR|USD|GBP|CHF|JPY|CNY|AED|AUD|BGN|BRL|CAD|CZK|DKK|HUF|IDR|INR|KRW|MXN|MYR|NOK"
    r"|NZD|PLN|RMB|RON|RUB|SEK|SGD|THB|TRY|TWD|UAH|VND|ZAR|Fr|kr|[A-Z]{1,3}(?=\$)|Rs|US|zł|ca"
    # Others may be names: RP-1 is a fuel, INR18650 a battery, EUR1 a pallet.
    r"|Rp(?=[. ]+\d\d)|circa|approx|about)\b\W*|(?:EUR|USD|GBP|CHF)(?=\d\d))?\d"
    r"(?!\w*[-‐‑][^\W\d]|[\w.,]*[\s-]*[^\W\d]+[\s-]+[^\W\d]{4,})",
    re.IGNORECASE,
)
_LEADING = re.compile(r"\A\W*\d[\d.,'’]*(?:e[+-]?\d+)?", re.IGNORECASE)

# Names of rows that hold sums of others, of those that spreadsheets have below a table, and of
# those that hold what is asked for, above it or below.
_SUM = re.compile(
    r"\W*(?:(?:(?:grand|sub)[ -]?)?totals?|sums?|(?:gesamt|zwischen)?summe|(?:ins)?gesamt"
    r"|totale|totaal|somme|suma|soma|Σ|∑)\W*",
    re.IGNORECASE,
)
_STATISTIC = re.compile(
    r"\W*(?:average|avg|mean|median|mittelwert|durchschnitt|moyenne|promedio|Ø"
    r"|(?:min|max)(?:imum)?|(?:std|standard)[. -]*dev(?:iation)?|std|stdev|standardabweichung"
    r"|stabw|écart[- ]type|σ|variance|varianz|count|anzahl)\W*",
    re.IGNORECASE,
)
_ASKED = re.compile(
    r"\W*(?:ideal|utopia|nadir|targets?|goals?|ziele?|soll|(?:ideal|soll|ziel)[- ]?werte?"
    r"|(?:lower|upper)?[- ]?(?:limits?|bounds?)|grenz[- ]?werte?|requirements?|anforderung(?:en)?"
    r"|(?:ideal|target|limit)[- ]values?|objectifs?|cible|objetivo)\W*",
    re.IGNORECASE,
)


class UnfitError(ArgumentValueError):
    """A source is no table; :func:`read_table` adds which source it is.

    Args:
        problem: What is wrong.
        remedy: What to do, which may name options of the command.
    """

    def __init__(self, problem: str, remedy: str = "") -> None:
        if remedy:
            problem = f"{problem}; {remedy}"
        super().__init__(problem)


@dataclass(frozen=True)
class Cells:
    """The rows of a source: texts, or the values of a source whose cells have types.

    Attributes:
        columns: The cells by name, as many in each column.
        rows: The numbers of the rows, from 1 unless rows before them were left out.
        lines: The numbers of the lines on which the rows end; empty if the source has no lines.
        remarks: Sentences on rows that are left out.
    """

    columns: dict[str, list[Any]]
    rows: Sequence[int]
    lines: Sequence[int] = ()
    remarks: Names = ()

    def kept(self, is_kept: list[bool], why: str) -> Cells:
        """Return the rows that a mask selects.

        Args:
            is_kept: The mask.
            why: Why the others are left out.

        Raises:
            UnfitError: None is selected.
        """
        n_out = is_kept.count(False)
        if n_out == 0:
            return self
        if n_out == len(is_kept):
            raise UnfitError(f"none of its {counted(n_out, 'row')} counts: {why}")
        return Cells(
            {name: list(compress(cells, is_kept)) for name, cells in self.columns.items()},
            list(compress(self.rows, is_kept)),
            list(compress(self.lines, is_kept)),
            [*self.remarks, f"{counted(n_out, 'row')} left out: {why}."],
        )

    def where(self, i: int) -> str:
        """Return the place of the i-th row, for messages."""
        if self.lines:
            return f"row {self.rows[i]} (line {self.lines[i]})"
        return f"row {self.rows[i]}"

    def without(self, i: int) -> str:
        """Say how to leave the i-th row out."""
        if self.lines:
            return f"leave it out by {argument('skip_rows', [self.lines[i]])}"
        return "leave it out of the source"

    def place(self, name: str, i: int) -> str:
        """Return what the i-th row holds in a column, for messages."""
        cell = self.columns[name][i]
        content = repr(cell)
        if is_blank(cell):
            content = "no number"
        return f"{self.where(i)} holds {content:.40} in the column {name!r}"


class TextColumn(NamedTuple):
    """The n cells of a column, and the numbers in them.

    Attributes:
        name: The name of the column.
        cells: The cells as they are written.
        numbers: ``(n,)`` numbers, NaN where a cell is blank; ``None`` if the column has others.
        decimal: The decimal mark with which they were read.
        problem: Why a column that may hold numbers cannot be read; else empty.
        remedy: What to do then, if a table is ranked.
        unit: ``"%"`` if all its numbers are per cents.
        codes: ``(n,)`` the numbers of a column of codes, which are texts unless the user calls it
            one of numbers.
    """

    name: str
    cells: list[Any]
    numbers: Array | None = None
    decimal: str = "."
    problem: str = ""
    remedy: str = ""
    unit: str = ""
    codes: Array | None = None

    @property
    def texts(self) -> list[str]:
        """The cells as texts without spaces around them."""
        return [str(cell).strip() for cell in self.cells]

    def has_numbers(self) -> bool:
        """Say whether it is a column of numbers; if that is not certain, it is refused."""
        if self.problem or all(map(is_blank, self.cells)):
            self.require_numbers()
        return self.numbers is not None

    def may_hold_numbers(self) -> bool:
        """Say whether it holds numbers, or what a reader may take for some."""
        return self.numbers is not None or self.codes is not None or self.problem != ""

    def require_numbers(self) -> Array:
        """Return the ``(n,)`` numbers.

        Raises:
            ArgumentValueError: The column cannot be read for certain, or holds no number.
        """
        if self.numbers is not None:
            return self.numbers
        if self.codes is not None:
            return self.codes
        if self.problem:
            raise UnfitError(self.problem, self.remedy)
        raise UnfitError(
            f"its column {self.name!r} holds no number at all",
            "name objectives that do, or save what a spreadsheet has not computed yet",
        )

    def holds_times(self) -> bool:
        """Say whether its texts are times such as 1:30, which may be durations."""
        texts = [text for text in self.texts if not is_blank(text)]
        return bool(texts) and all(map(_TIME.fullmatch, texts))

    def gaps(self) -> Mask:
        """``(n,)`` which cells hold neither a finite number nor a text."""
        if self.numbers is not None:
            return ~np.isfinite(self.numbers)
        return np.array(list(map(is_blank, self.cells)))


# From rows to cells


def cells_of_rows(rows: RowsByLine) -> Cells:
    """Return rows as cells whose columns have the texts in the first row, as they are, as names.

    Columns without a name are left out.

    Raises:
        ArgumentValueError: There is no row, they differ in length, or a name occurs twice.
    """
    if not rows:
        raise UnfitError("it is empty; it must hold a line of column names, then the designs")
    usual, _ = Counter(map(len, rows.values())).most_common(1)[0]
    for end, row in rows.items():
        if len(row) != usual:
            raise UnfitError(
                f"line {end} has {counted(len(row), 'cell')}, most lines {usual}",
                "complete it, or, if it is a title or a note, leave it out by "
                f"{argument('skip_rows', [end])}",
            )
    _, *lines = rows
    columns: dict[str, list[Any]] = {}
    for name, *cells in zip(*rows.values(), strict=True):
        if name in columns:
            raise UnfitError(
                f"its header names the column {name!r} twice",
                f"rename one, or leave titles out by {argument('skip_rows')}",
            )
        if name != "":
            columns[str(name)] = cells
    return Cells(columns, range(1, len(rows)), lines)


def named_cells(rows: RowsByLine) -> Cells:
    """Return rows that people wrote as cells with names.

    Raises:
        ArgumentValueError: The rows differ in length, hold no names or nothing below them, or a
            name occurs twice.
    """
    if len(rows) < 2:
        raise UnfitError("it must hold a line of column names, and below it a line for each design")
    first, *_ = rows
    header, *others = rows.values()
    names = []
    for name in map(str, header):
        # A file without names would lose its first design as names, and nobody would notice.
        if is_number(name):
            raise UnfitError(
                f"its first line must name the columns, and holds numbers, {name!r:.40}",
                "put a line of names above them, or leave lines above it out by "
                f"{argument('skip_rows')}",
            )
        # A line break could not be typed in an option.
        names.append(re.sub(r"\s*[\r\n]\s*", " ", name.strip()))
    if names[0] == "":
        names[0] = "index"  # data frames write the numbers of rows without a name
    # Columns without a name are blank, as by a comma at the end of every line.
    nameless = compress(zip(*others, strict=False), [name == "" for name in names])
    if not all(map(is_blank, chain(*nameless))):
        raise UnfitError(
            "a name is empty in its first line, which must name the columns",
            f"if it is a title, skip it by {argument('skip_rows', [first])}; else complete it",
        )
    return cells_of_rows({**rows, first: names})


def cells_of_frame(frame: Any) -> tuple[Cells, Head]:
    """Return the cells of a data frame, and as head what its index says."""
    names = []
    for name in frame.columns:
        if isinstance(name, tuple):  # of several levels
            name = " ".join(map(str, name)).strip()
        names.append(str(name))
    if len(frame) == 0 or len({*names}) < len(names):
        raise invalid("source", "a frame with rows, whose columns have different names", frame)
    frame, head = _with_index(frame.set_axis(names, axis="columns"))
    columns = {}
    for name, column in frame.items():
        columns[name] = column.astype(object).where(column.notna(), None).tolist()
        if column.dtype == object:
            columns[name] = list(map(plain, columns[name]))
    return Cells(columns, range(1, len(frame) + 1)), head


def _with_index(frame: Any) -> tuple[Any, Head]:
    """Return a data frame with its index as columns, and what these say of the rows.

    An index with a name or of texts names the rows; several levels are variables, as of groups.
    Integers without a name, as of a frame that is filtered or sorted, number the rows.
    """
    import pandas as pd

    index = frame.index
    is_unnamed = index.name is None and pd.api.types.is_integer_dtype(index)
    if is_unnamed and index.equals(pd.RangeIndex(len(frame))):
        return frame, {}
    levels: list[str] = []
    for name in index.names:
        level = "index" if name is None else str(name)
        levels.append(free_name(level, [*frame.columns, *levels], "index"))
    frame = frame.reset_index(names=levels)
    if is_unnamed:
        return frame, {}
    label = ", ".join(levels)
    if len(levels) == 1:
        return frame, {"label": label}
    frame.insert(0, label, [", ".join(map(str, key)) for key in index])
    return frame, {"label": label, "variables": levels}


# From cells to numbers


def is_blank(cell: Any) -> bool:
    """Say whether a cell holds nothing, a word for it, or an error of a spreadsheet."""
    if not isinstance(cell, str):
        return cell is None or cell != cell
    return _BLANK.fullmatch(cell.strip()) is not None


def is_number(cell: Any) -> bool:
    """Say whether a cell is a plain number in any notation."""
    cell = _plain(cell)
    numbers = (_number(cell, mark) for mark in ".,")
    return any(number == number and number is not None for number in numbers)


def _plain(cell: Any) -> Any:
    """Return a text without spaces around it and with ASCII minus signs."""
    if not isinstance(cell, str):
        return cell
    if not cell.isascii():
        cell = cell.translate(_MINUS)
    return cell.strip()


def read_columns(
    cells: Cells,
    decimal: str | None = None,
    labels: Collection[str | None] = (),
    separator: str = "",
) -> dict[str, TextColumn]:
    """Return columns with their numbers, by the rules at the top of this module.

    Args:
        cells: The cells.
        decimal: The decimal mark, ``"."`` or ``","``, if the user gave it.
        labels: Columns that name designs. A design called 1.2 says nothing about decimals.
        separator: The mark between the cells of a text.
    """
    if decimal not in (None, ".", ","):
        raise invalid("decimal", "'.' or ','", decimal)
    readings: dict[str, dict[str, Array]] = {}
    certain: set[str] = set()
    for name, column in cells.columns.items():
        readings[name] = _readings(column, decimal or ".,")
        if len(readings[name]) == 1 and name not in labels:
            certain |= {*readings[name]}
    columns = {}
    for name, column in cells.columns.items():
        columns[name] = TextColumn(name, column)
        if readings[name]:
            columns[name] = _read(columns[name], readings[name], cells, certain, separator)
        else:
            columns[name] = _unread(columns[name], cells, decimal or ".,")
    return columns


def _readings(cells: list[Any], marks: str) -> dict[str, Array]:
    """Return the numbers in a column by the decimal marks with which all its cells are numbers."""
    cells = list(map(_plain, cells))
    if all(str(cell).endswith("%") or is_blank(cell) for cell in cells):
        cells = [str(cell).rstrip("% \u00a0\u202f") for cell in cells]
    readings = {}
    for mark in marks:
        numbers = _numbers(cells, mark)
        if numbers is not None:
            readings[mark] = numbers
    return readings


def _numbers(cells: list[Any], mark: str) -> Array | None:
    """Return the numbers in a column, NaN where a cell is blank; None if one holds anything else.

    NumPy parses plain numbers in a tenth of the time in which cells are read one by one.

    Args:
        cells: The cells, without spaces around them.
        mark: The decimal mark.
    """
    types = {*map(type, cells)}
    if types == {float}:
        return np.array(cells)
    if types == {str}:
        text = "\n".join(cells)
        if mark == ",":
            text = text.translate(SWAPPED)
        lines = text.split("\n")
        if len(lines) == len(cells) and _PLAIN.fullmatch(text):
            with suppress(ValueError):  # such as the exponents of Fortran
                return np.array(lines, dtype=np.float64)
    numbers = []
    for cell in cells:
        number = _number(cell, mark)
        if number is None:
            return None
        numbers.append(number)
    return np.array(numbers)


def _number(cell: Any, mark: str) -> float | None:
    """Return the number in a cell, NaN if it is blank, ``None`` if it holds anything else."""
    if isinstance(cell, str):
        text = cell.translate(SWAPPED) if mark == "," else cell
        match = _NUMBER.fullmatch(text)
        if match is not None:
            _, part, replacement = _FORMS[str(match.lastgroup)]  # the group of the form ends last
            return float(re.sub(part, replacement, text) if part else text)
    elif isinstance(cell, (int, float)) and not isinstance(cell, bool):
        return float(str(cell))  # infinite for an integer beyond float64
    if is_blank(cell):
        return np.nan
    return None


def _read(
    column: TextColumn,
    readings: dict[str, Array],
    cells: Cells,
    certain: set[str],
    separator: str,
) -> TextColumn:
    """Return a column with the one of its readings, by decimal marks, that is right.

    Args:
        column: The column.
        readings: One or both.
        cells: All cells.
        certain: The decimal marks of the columns that only one can read.
        separator: The mark between the cells of a text.
    """
    mark, *_ = readings
    *_, others = readings.values()
    is_number = ~np.isnan(readings[mark])
    texts = [cell.strip() for cell in compress(column.cells, is_number) if isinstance(cell, str)]
    if "%" not in column.name and "".join(texts[:1]).endswith("%"):
        column = column._replace(unit="%")
    is_unclear = is_number & (readings[mark] != others)
    if is_unclear.any():
        row = int(is_unclear.argmax())
        # Such a number has one mark. It is the decimal mark if it is in all certain columns, or if
        # there are none and a program printed the numbers.
        mark, other = ".," if "." in column.cells[row] else ",."
        is_printed = separator == "," and all(map(_PRINTED.fullmatch, texts))
        if certain != {mark} and (certain or not is_printed):
            either = f"{readings[other][row]:.15g} or {readings[mark][row]:.15g}"
            # Two options, or one remedy where a command has none.
            options = dict.fromkeys(argument("decimal", decimal) for decimal in (other, mark))
            return column._replace(
                problem=f"{cells.place(column.name, row)}, either {either}",
                remedy=f"state the decimal mark by {' or '.join(options)}",
            )
    if any(map(_CODE.fullmatch, texts)) and all(map(str.isdecimal, texts)):
        return column._replace(codes=readings[mark])
    if not is_number.any():
        return column
    return column._replace(numbers=readings[mark], decimal=mark)


def _unread(column: TextColumn, cells: Cells, marks: str) -> TextColumn:
    """Return a column that no notation can read: one of texts, or with what is wrong in it."""
    readings = [[_number(_plain(cell), mark) for cell in column.cells] for mark in marks]
    numbers = min(readings, key=lambda numbers: numbers.count(None))
    texts = dict(compress(enumerate(column.texts), [number is None for number in numbers]))
    has_numbers = np.isfinite(np.array(numbers, dtype=np.float64)).any()
    # Numbers of one unit, such as 5 k Euro, or texts? One number alone would rank nothing.
    units = {_LEADING.sub("", text, count=1) for text in texts.values()}
    has_one_unit = len(units) == 1 < len({*texts.values()})
    for row, text in texts.items():
        # One number is enough: taken for text, the column would silently be no objective.
        is_like_number = has_one_unit or _NUMBERLIKE.match(text[:_LONGEST])
        if has_numbers or (is_like_number and not _DATE_OR_TIME.fullmatch(text)):
            remedy = f"write it without a unit, or {cells.without(row)}"
            others = argument("objectives")
            if others != EDIT:
                remedy += f", or name other columns by {others}"
            problem = f"{cells.place(column.name, row)}, no plain number"
            return column._replace(problem=problem, remedy=remedy)
    return column


# A row that is computed from others


def require_designs(
    columns: Mapping[str, TextColumn],
    labels: Collection[str],
    label: str | None,
    cells: Cells,
) -> None:
    """Refuse rows named as a sum, one at an end named as a statistic or goal, and a sum below all.

    The sum of two may be a design that has a name.

    Args:
        columns: The columns.
        labels: Those that name or number designs.
        label: The one that names them; if there is none, the first column may have names.
        cells: The cells.

    Raises:
        ArgumentValueError: There is such a row.
    """
    if not columns:  # of a file of results alone
        return
    naming = columns[label or next(iter(columns))]
    numbers = []
    for name, column in columns.items():
        if column.numbers is not None and name not in labels:
            numbers.append(column.numbers)
    last = len(naming.cells) - 1
    for column in columns.values():
        if column.numbers is not None:
            continue
        names = column.texts
        for row, name in enumerate(names):
            is_asked = False
            is_computed = _SUM.fullmatch(name) is not None
            if is_computed and column is not naming:  # it may be the name of a supplier
                parts = [part for part in numbers if math.isfinite(part[row] or np.nan)]
                is_computed = bool(_are_sums(parts, row)[2:].any())
            elif column is naming and row in (0, last) and names.count(name) == 1:
                # Names that recur, or stand between others, are those of levels.
                is_computed = is_computed or _STATISTIC.fullmatch(name) is not None
                is_asked = _ASKED.fullmatch(name) is not None
            if is_computed or is_asked:
                reason = "computed from others"
                if is_asked:
                    reason = "values asked for"
                raise UnfitError(
                    f"{cells.where(row)} is named {name!r}, as {reason}",
                    f"{cells.without(row)}, or rename it if it is a design",
                )
    may_be_sum = last > 2 or (last == 2 and is_blank(naming.cells[last]))
    if may_be_sum and _are_sums(numbers, last)[-1]:
        raise UnfitError(
            f"{cells.where(last)} is the sum of all others",
            f"{cells.without(last)}, or put it above another row if it is a design",
        )


@np.errstate(over="ignore", invalid="ignore")
def _are_sums(columns: Collection[Array], row: int) -> Mask:
    """``(row + 1,)`` whether the numbers of a row, some not 0, are sums of the 0, 1, … rows above.

    Args:
        columns: ``(n,)`` numbers of each column; one that is NaN counts as 0.
        row: The row.
    """
    terms = np.nan_to_num([numbers[row::-1] for numbers in columns]).reshape(-1, row + 1)
    terms[:, 0] *= -1
    rounding = 1e-9 * np.cumsum(np.abs(terms), axis=1)  # deviations may add up to 1e-16 for 0
    are_sums = np.abs(np.cumsum(terms, axis=1)) <= rounding
    return np.asarray(are_sums.all(axis=0) & terms.any())
