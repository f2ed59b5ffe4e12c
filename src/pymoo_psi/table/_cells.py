"""The one parser of numbers, booleans and blanks in files.

:func:`real`, :func:`integer` and :func:`boolean` read what programs write. :func:`read_columns`
reads what people write: decimal commas, thousands, currencies, units, %, the minus of typesetters.
A number is read only where there is one reading of it. The rules for marks, a point or a comma:

1. Where ``decimal`` or ``thousands`` is given, it decides.
2. Two different marks in a number, one of them several times, a mark with other than three digits
   behind it or more than three before it, behind a leading zero or before an exponent: each leaves
   one reading, and with it one for every cell of the column.
3. Otherwise, as in ``1.250``, the mark is the decimal one if the other columns of the file say so;
   or in a file that is divided by commas if it is a point with three digits behind it in every
   number of the column, as programs print three decimals. Else nothing is certain.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import invalid

BLANKS = {
    *("", "nan", "na", "n/a", "<na>", "null", "none", "-", "--", "–", "—", "?"),
}
# Errors of spreadsheets in any language, #DIV/0! as #WERT!, and of columns that are too narrow.
_ERROR = re.compile(r"#[^\W\d][\w/]*[!?]|#n/?[adv]|##+", re.IGNORECASE)
_FORMULA = re.compile(r"=[\w(+$'{-]")
_MINUS = str.maketrans(dict.fromkeys("−–﹣－", "-"))
_GAPS = " '’\u00a0\u2009\u202f"  # that divide thousands and nothing else
# Words that may stand beside a number without a doubt that it is one: currencies and the units of
# mechanics. A letter alone counts behind a space only: "304 L" is a volume, "304L" a steel.
_CODES = (
    "EUR|USD|GBP|CHF|JPY|CNY|INR|AUD|CAD|NZD|SEK|NOK|DKK|PLN|CZK|HUF|RON|TRY|RUB|UAH|BRL|MXN|ZAR|"
    "KRW|SGD|HKD|ILS"
)
_CURRENCY = rf"(?:(?:US|AU?|CA?|NZ|HK|NT|S|R)?\$|[€£¥₹₽₩₺₴₪¢]|{_CODES}|kr|zł|Kč|Fr\.)"
_BASES = (
    "kg|mg|[µμu]g|mm|cm|dm|km|[µμu]m|nm|ms|[µμu]s|ns|min|kN|MN|mN|Nm|Pa|kPa|MPa|GPa|hPa|bar|mbar|"
    "psi|kJ|MJ|GJ|kWh|MWh|Wh|kW|MW|GW|mW|kV|mV|mA|kA|kHz|MHz|GHz|Hz|rad|mrad|deg|rpm|mol|ml|mL|dB|"
    "lbs?|ft|in|°[CF]?|[mgshNJWVAKtlLΩÅd]"
)
_UNIT = rf"(?:{_BASES})(?:[²³]|\^?-?[23])?"
_SIZE = rf"(?:%|‰|ppm|{_CURRENCY}|{_UNIT}(?:[/·*]{_UNIT})*)"
_NUMBER = re.compile(
    rf"(?P<sign>[+-]?)\s*(?P<before>{_CURRENCY})?\s*(?P<inner>[+-]?)"
    rf"(?P<body>[1-9]\d{{0,2}}(?:(?P<gap>[{_GAPS}])\d{{3}})(?:(?P=gap)\d{{3}})*(?:[.,]\d*)?"
    r"|[\d.,]+)(?:(?<=[.,])(?:--?|—))?"  # of prices: 12,- and 12.--
    rf"(?P<exponent>[eE][+-]?\d+)?(?P<space>\s*)(?P<after>{_SIZE})?"
)
_LETTER = re.compile(r"[^\W\d_](?:[²³]|\^?-?[23])?")
_INFINITE = re.compile(r"[+-]?(?:inf|infinity|∞)", re.IGNORECASE)
# What a human takes for a number at the first glance, though it may be none.
_NUMBERLIKE = re.compile(rf"\W*(?:(?:{_CURRENCY}|ca|circa|approx|about)\W*)?\d")
# Dates and times are text beyond doubt, though they begin like numbers.
_DATE = re.compile(
    r"\d{4}-\d\d?-\d\d?(?:[T ]\d\d?:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:?\d\d)?)?"
    r"|\d\d?[./]\d\d?[./](?:\d{4}|\d\d)|\d\d?:\d\d(?::\d\d)?"
)
# Digits with at most one mark, or with one in front of every three and another one at most.
_BODY = re.compile(
    r"\d+(?:[.,]\d*)?|[.,]\d+|[1-9]\d{0,2}(?:\.\d{3})+(?:,\d*)?"
    r"|[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?"
)
_OPEN = re.compile(r"[1-9]\d{0,2}[.,]\d{3}")  # as many digits as thousands have, and decimals may
_DIGITS = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"  # as programs write them
_PLAIN = re.compile(rf"[+-]?{_DIGITS}")
# A plain number whose point, if it has one, cannot divide thousands.
_CERTAIN = re.compile(rf"\s*[+-]?(?![1-9]\d{{0,2}}\.\d{{3}}\s*$){_DIGITS}\s*")
# 18 digits are below 2^63, so that a column of them is one of int64 without a further check.
_WHOLE = re.compile(r"[+-]?\d{1,18}")
_CODE = re.compile(r"0\d+")  # whose zeros belong to it
INT64 = range(-(2**63), 2**63)
_LONGEST = (
    100  # characters of a number with sign and unit; some expressions take its square in time
)


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


def is_blank(cell: Any) -> bool:
    """Say whether a cell holds nothing, or a word for it."""
    if isinstance(cell, str):
        text = cell.strip()
        return text.lower() in BLANKS or (text[:1] == "#" and bool(_ERROR.fullmatch(text)))
    return cell is None or cell != cell


def is_number(cell: Any) -> bool:
    """Say whether a cell is a number as people write it, whatever its marks mean."""
    return not is_blank(cell) and _number(cell) is not None


def _is_numberlike(text: str) -> bool:
    """Say whether a human may take a text for a number."""
    # Cut, as a longer text is no number, and how it begins is all that a glance takes in.
    text = text.strip().translate(_MINUS)[:_LONGEST]
    return bool(_NUMBERLIKE.match(text)) and not _DATE.fullmatch(text)


class PerCent(float):
    """The share in a cell that shows it in per cent, such as 0.85 for 85 %."""

    unit = "per cent by its format"  # beside others it was probably meant as they are


@dataclass(frozen=True)
class Marks:
    """What is said of the marks in numbers.

    Attributes:
        decimal: ``"."`` or ``","``; ``None`` where the cells tell.
        thousands: ``"."``, ``","``, ``" "`` or ``"'"``, likewise.
    """

    decimal: str | None = None
    thousands: str | None = None

    def __post_init__(self) -> None:
        """Check the marks, and conclude from one to the other."""
        if self.decimal not in (None, ".", ","):
            raise invalid("decimal", "'.' or ','", self.decimal)
        if self.thousands not in (None, ".", ",", " ", "'"):
            raise invalid("thousands", "'.', ',', ' ' or \"'\"", self.thousands)
        if self.decimal is not None and self.decimal == self.thousands:
            raise invalid("thousands", "another mark than the decimal mark", self.thousands)
        # A gap between thousands says nothing: both 1 250.5 and 1 250,5 are usual.
        other = {".": ",", ",": "."}
        if self.decimal is None and self.thousands in other:
            object.__setattr__(self, "decimal", other[self.thousands])
        elif self.thousands is None and self.decimal in other:
            object.__setattr__(self, "thousands", other[self.decimal])


class Problem(NamedTuple):
    """Why a column cannot be read as numbers, though it may be one of numbers.

    Attributes:
        row: Index of the cell; -1 if its row has been left out.
        cell: The cell.
        what: What it is.
        remedy: What settles it; ``{line}`` stands for the line of the cell.
    """

    row: int
    cell: Any
    what: str
    remedy: str


@dataclass(frozen=True, eq=False)
class Column:
    """A column of a file.

    Attributes:
        cells: n cells as they were written; a number that programs might read otherwise as its
            digits with a decimal point.
        numbers: ``(n,)`` numbers, NaN where a cell is blank; ``None`` if it is no column of them.
        unit: Behind or before every number, or what the file says besides; often empty.
        problem: Why its numbers, if they are some, cannot be read.
    """

    cells: list[Any]
    numbers: NDArray[np.float64] | None = None
    unit: str = ""
    problem: Problem | None = None

    @classmethod
    def of(cls, cells: list[Any]) -> Column:
        """Return a column of cells that have types, as those of a test table have."""
        if all(isinstance(cell, (int, float)) and not isinstance(cell, bool) for cell in cells):
            return cls(cells, np.array(cells, dtype=np.float64))
        return cls(cells)

    @property
    def plain(self) -> NDArray[Any]:
        """``(n,)`` numbers or booleans if all cells are such, or blank; else cells as they are."""
        texts = [cell.strip() if isinstance(cell, str) else cell for cell in self.cells]
        coded = any(isinstance(cell, str) and _CODE.fullmatch(cell) for cell in texts)
        if self.numbers is not None and not coded:
            whole = all(
                _WHOLE.fullmatch(cell)
                if isinstance(cell, str)
                else type(cell) is int and cell in INT64
                for cell in texts
            )
            return np.array([int(cell) for cell in texts]) if whole else self.numbers
        if all(isinstance(cell, (str, bool)) and str(cell) in ("True", "False") for cell in texts):
            return np.array([str(cell) == "True" for cell in texts])
        return np.fromiter(self.cells, object)

    def some(self, rows: NDArray[np.intp]) -> Column:
        """Return some cells, read as the whole column is."""
        problem = self.problem
        if problem is not None:
            # The problem stays though its row may be gone: the column was never read.
            places = np.flatnonzero(rows == problem.row)
            problem = problem._replace(row=int(places[0]) if len(places) else -1)
        return replace(
            self,
            cells=[self.cells[i] for i in rows.tolist()],
            numbers=None if self.numbers is None else self.numbers[rows],
            problem=problem,
        )


def read_columns(
    columns: Mapping[str, Sequence[Any]],
    marks: Marks,
    divider: str = "",
    labels: Collection[str] = (),
) -> dict[str, Column]:
    """Return columns with their numbers.

    Args:
        columns: n cells each, texts or the values of a file whose cells have types.
        marks: What is said of the marks in numbers.
        divider: The mark between the cells of a line; empty if there is none.
        labels: Columns with numbers or names of designs: a design 1.2 says nothing of decimals.
    """
    scanned = {name: _scanned(list(cells), marks) for name, cells in columns.items()}
    decimals: set[str] = set()
    for name, scan in scanned.items():
        # A column with texts is refused or holds no numbers: it cannot vouch for others.
        if name not in labels and not scan.texts:
            decimals.update(scan.decimals.values())
    points = divider == "," and not decimals
    return {name: _read(scan, marks, decimals, points) for name, scan in scanned.items()}


class _Number(NamedTuple):
    sign: str
    body: str  # digits with points and commas, gaps removed
    exponent: str
    unit: str
    gap: str


class _Scan(NamedTuple):
    """The cells of a column with what they say of its marks."""

    cells: list[Any]
    found: list[_Number | float | None]  # None where a cell is blank or text
    texts: list[int]  # rows of texts
    decimals: dict[int, str]  # the decimal marks of which single numbers leave no doubt, by row


def _scanned(cells: list[Any], marks: Marks) -> _Scan:
    # The usual column of what programs write, told apart as it takes a tenth of the time.
    if marks.decimal in (None, ".") and all(
        isinstance(cell, str) and _CERTAIN.fullmatch(cell) for cell in cells
    ):
        decimals = {0: "."} if any("." in cell for cell in cells) else {}
        return _Scan(cells, [float(cell) for cell in cells], [], decimals)
    scan = _Scan(cells, [], [], {})
    for i, cell in enumerate(cells):
        number = None if is_blank(cell) else _number(cell)
        if number is None and not is_blank(cell):
            scan.texts.append(i)
        if isinstance(number, _Number) and (mark := _decimal_in(number, marks)):
            scan.decimals[i] = mark
        scan.found.append(number)
    return scan


def _number(cell: Any) -> _Number | float | None:
    """Return the number in a cell that is not blank, or None."""
    if not isinstance(cell, str):
        if isinstance(cell, bool) or not isinstance(cell, (int, float)):
            return None
        try:
            return cell if isinstance(cell, PerCent) else float(cell)
        except OverflowError:
            # Beyond float64: as infinity it is refused where the numbers must be finite.
            return math.inf if cell > 0 else -math.inf
    text = cell.strip().translate(_MINUS)
    if _INFINITE.fullmatch(text):
        return -math.inf if text.startswith("-") else math.inf
    match = _NUMBER.fullmatch(text) if len(text) <= _LONGEST else None
    if match is None or (match["sign"] and match["inner"]):
        return None
    before, after = match["before"] or "", match["after"] or ""
    if (before and after) or (_LETTER.fullmatch(after) and not match["space"]):
        return None
    body, gap = match["body"], match["gap"] or ""
    for mark in _GAPS:
        body = body.replace(mark, "")
    if not _BODY.fullmatch(body):
        return None  # a date, a version, an address
    return _Number(
        match["sign"] or match["inner"], body, match["exponent"] or "", before or after, gap
    )


def _decimal_in(number: _Number, said: Marks) -> str:
    """Return the decimal mark that a number can only have; empty if it has none or any."""
    marks = [mark for mark in number.body if mark in ".,"]
    if not marks:
        return ""
    # Where thousands are said to have gaps between them, points and commas are decimal marks.
    if said.thousands in (" ", "'") or len({*marks}) == 2:
        return marks[-1]
    if len(marks) > 1:
        return "," if marks[0] == "." else "."
    certain = number.gap or number.exponent or not _OPEN.fullmatch(number.body)
    return marks[0] if certain else ""


class _UnreadableError(Exception):
    """A column cannot be read; the arguments are row, what and remedy of :class:`Problem`."""


def _read(scan: _Scan, marks: Marks, of_file: set[str], points: bool) -> Column:
    try:
        numbers = _numbers_of(scan)
        if not numbers:
            return Column(scan.cells)
        decimal, thousands = _marks_of(scan, numbers, marks, of_file, points)
        values, cells = np.full(len(scan.cells), np.nan), list(scan.cells)
        for i, number in numbers.items():
            if isinstance(number, float):
                values[i] = number
                continue
            digits = _digits(number, decimal, thousands)
            if digits is None:
                what = f"no number with the decimal mark {decimal}"
                raise _UnreadableError(i, what, "correct it, or see --decimal and --thousands")
            values[i], text = float(digits), scan.cells[i].strip()
            # Who wrote 1.50 gets 1.50 back: only what programs would misread is written anew.
            if not _PLAIN.fullmatch(text) or float(text) != values[i]:
                cells[i] = digits
    except _UnreadableError as error:
        row, what, remedy = error.args
        return Column(scan.cells, problem=Problem(row, scan.cells[row], what, remedy))
    unit = next((n.unit for n in numbers.values() if isinstance(n, _Number)), "")
    return Column(cells, values, unit)


def _numbers_of(scan: _Scan) -> dict[int, _Number | float]:
    """Return the numbers of a column by row, none if it is text; refuse what is neither."""
    numbers = {i: number for i, number in enumerate(scan.found) if number is not None}
    texts = {i: scan.cells[i] for i in scan.texts if isinstance(scan.cells[i], str)}
    for i, text in texts.items():
        if _FORMULA.match(text):
            remedy = "save the file with values, as a spreadsheet program does"
            raise _UnreadableError(i, "a formula without its value", remedy)
    # One number is enough: taken for text, the column would silently be no objective.
    if scan.texts and numbers:
        remedy = (
            "correct it, leave out its line by --skip-rows {line}, or name the objectives by "
            "--objectives"
        )
        raise _UnreadableError(scan.texts[0], "text among numbers", remedy)
    # Text throughout is fine, unless a reader would see numbers in it: leaving such a column out
    # changes the ranking without a word.
    for i, text in texts.items():
        if _is_numberlike(text):
            what = "like a number, but none that can be read for certain"
            remedy = "write the number alone, or name the objectives by --objectives"
            raise _UnreadableError(i, what, remedy)
    # Nothing is converted: numbers stay those that the file shows, so that mm beside m is refused.
    units = {i: getattr(number, "unit", "") for i, number in numbers.items()}
    first = next(iter(units.values()), "")
    for i, unit in units.items():
        if unit != first:
            what = f"in {unit or 'no unit'}, while the first of the column is in {first or 'none'}"
            raise _UnreadableError(i, what, "give all numbers of a column in one unit")
    return numbers


def _marks_of(
    scan: _Scan,
    numbers: Mapping[int, _Number | float],
    marks: Marks,
    of_file: set[str],
    points: bool,
) -> tuple[str, str]:
    """Return the decimal mark and that of thousands; see the rules on top.

    Args:
        scan: The column.
        numbers: Its numbers by row.
        marks: What is said of them.
        of_file: The decimal marks of which the columns of the file leave no doubt.
        points: Whether points in front of three digits are decimal marks where all numbers of the
            column have them.
    """
    written = {i: number for i, number in numbers.items() if isinstance(number, _Number)}
    decimal = marks.decimal
    if decimal is None:
        said = next(iter(scan.decimals.values()), "")
        for i, mark in scan.decimals.items():
            if mark != said:
                what = f"with the decimal mark {mark}, while others of the column have {said}"
                raise _UnreadableError(i, what, "give all numbers of a column with the same marks")
        unsettled = {
            i: mark
            for i, number in written.items()
            for mark in ".,"
            if mark in number.body and i not in scan.decimals
        }
        used = {*unsettled.values()}
        printed = points and all(re.fullmatch(r"\d+\.\d{3}", n.body) for n in written.values())
        told = used == of_file and len(used) == 1  # columns of a file may contradict each other
        if unsettled and not said and not told and not printed:
            i, mark = next(iter(unsettled.items()))
            whole, decimals = (written[i].body.replace(mark, other) for other in ("", "."))
            remedy = f"settle it by --thousands '{mark}' or --decimal '{mark}'"
            raise _UnreadableError(i, f"either {whole} or {decimals}", remedy)
        decimal = said or next(iter(used), ".")
    return decimal, marks.thousands or ("," if decimal == "." else ".")


def _digits(number: _Number, decimal: str, thousands: str) -> str | None:
    """Return a number as programs write it, or None if it does not have these marks."""
    # The marks of the column may differ from those that this number alone would suggest, so it is
    # checked again against them, group by group: 1.25 is no number with points for thousands.
    whole, _, fraction = number.body.partition(decimal)
    if thousands in ".," and thousands in whole:
        if number.gap or not re.fullmatch(
            rf"[1-9]\d{{0,2}}(?:{re.escape(thousands)}\d{{3}})+", whole
        ):
            return None
        whole = whole.replace(thousands, "")
    if not (whole + fraction).isdecimal():
        return None
    return f"{number.sign}{whole}{'.' if fraction else ''}{fraction}{number.exponent}"
