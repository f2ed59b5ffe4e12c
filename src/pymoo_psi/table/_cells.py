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

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import counted, invalid
from pymoo_psi.errors import ArgumentValueError

Array: TypeAlias = NDArray[np.float64]
# The numbers of a column by decimal mark; NaN of a blank cell, None of any other.
_Values: TypeAlias = dict[str, list[float | None]]

EMPTY = "it is empty; it must hold a line of column names, then the designs"

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
    head: Mapping[str, Any] | None = None
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


# From rows to cells


def in_a_line(name: str) -> str:
    """Return the name of a column without line breaks, which could not be typed as an option."""
    return re.sub(r"\s*[\r\n]\s*", " ", name.strip())


def cells_of_rows(
    rows: list[list[Any]], ends: list[int], separator: str, head: Mapping[str, Any] | None = None
) -> Cells:
    """Return rows as columns under the names in the first row."""
    if not rows:
        raise UnfitError(EMPTY)
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


def cells_of_frame(frame: Any) -> Cells:
    """Return the cells of a data frame; an index that does not count the rows names them."""
    import pandas as pd  # only where there is a frame

    if len(frame) == 0 or not frame.columns.is_unique:
        raise invalid("source", "a frame with rows, whose columns have different names", frame)
    label = None
    if not isinstance(frame.index, pd.RangeIndex):
        label = str(frame.index.name or "index")
        frame = frame.rename_axis(label).reset_index()
    frame = frame.astype(object).where(frame.notna(), None)
    return Cells({str(name): frame[name].tolist() for name in frame}, label=label)


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
