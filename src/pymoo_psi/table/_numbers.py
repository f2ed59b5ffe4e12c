"""The one rule for numbers in files that people write.

A plain number is an optional sign, digits, a decimal mark and an exponent; behind all numbers of a
column there may be a per cent sign. Points and commas have two meanings, one in each notation:

- with a decimal point, commas may divide thousands: 1.5, 1,250.5;
- with a decimal comma, points may: 1,5, 1.250,5.

1. Where ``decimal`` or ``thousands`` is given, it decides.
2. Else a number that only one notation allows, such as 1.5, 0.125 or 1.250.000, decides for its
   column.
3. Else the mark, as in 1.250, is a decimal mark if it is one in all columns of the file that are
   certain; or if it is a point in a file with commas between its cells, and all numbers of the
   column have three digits behind it, as programs print them.
4. Else the column is refused: no number is read that could be another one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import invalid

_BLANKS = {
    *("", "nan", "na", "n/a", "<na>", "null", "none", "-", "--", "–", "—", "?"),
}
# Errors of spreadsheets in any language, #DIV/0! as #WERT!, and of columns that are too narrow.
_ERROR = re.compile(r"#[^\W\d][\w/]*[!?]|#n/?[adv]|##+", re.IGNORECASE)
_MINUS = str.maketrans(dict.fromkeys("−–﹣－", "-"))  # the minus signs of typesetters
_OTHER = {".": ",", ",": "."}
_GAPS = {" ": " \u00a0\u2009\u202f", "'": "'’"}
_LONGEST = 100  # characters of a number; a longer text is none, and costs no time
# A plain number as programs write it, whose point cannot divide thousands.
_CERTAIN = re.compile(
    r"\s*[+-]?(?![1-9][0-9]{0,2}\.[0-9]{3}\s*$)(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?\s*"
)
_PRINTED = re.compile(r"[+-]?[0-9]+\.[0-9]{3}%?")
# What a reader may take for a number, though it is none by the rule: $5, ~5, 5 kg, 1/2, =A1.
_NUMBERLIKE = re.compile(
    r"=|\W*(?:(?:EUR|USD|GBP|CHF|JPY|CNY|US|ca|circa|approx|about)\b\W*)?\d", re.IGNORECASE
)
_MARKED = re.compile(r"[+-]?\d[\d.,'’\s]*(?:e[+-]?\d+)?", re.IGNORECASE)
# Dates and times are text beyond doubt, though they begin like numbers.
_DATE = re.compile(r"\d{4}-\d\d?-\d\d?(?:[T ].*)?|\d\d?[./]\d\d?[./]\d{2,4}|\d\d?:\d\d(?::\d\d)?")


class PerCent(float):
    """The number in a workbook's cell that is shown in per cent: 0.85 for 85 %."""


class Column(NamedTuple):
    """The n cells of a column, and their numbers.

    Attributes:
        cells: The cells as they are written.
        numbers: ``(n,)`` numbers, NaN where a cell is blank; ``None`` if it is no column of them.
        unit: "%" if all numbers have it.
        problem: Of a column that may be one of numbers but cannot be read: the index of a cell, and
            what is wrong with it and what settles it; ``{line}`` stands for its line.
    """

    cells: list[Any]
    numbers: NDArray[np.float64] | None = None
    unit: str = ""
    problem: tuple[int, str] | None = None


class _Notation(NamedTuple):
    pattern: re.Pattern[str]
    translation: dict[int, str]  # from its numbers to those of Python


class _Scan(NamedTuple):
    """The cells of a column with what they say of its notation."""

    cells: list[Any]
    values: dict[str, NDArray[np.float64]]  # (n,) numbers by decimal mark, NaN where there is none
    texts: list[int]  # rows of texts
    units: dict[str, int]  # each unit with its first row
    certain: dict[str, int]  # decimal marks of certain numbers, each with its first row
    open: list[int]  # rows of numbers that the notations read differently


def is_blank(cell: Any) -> bool:
    """Say whether a cell holds nothing, or a word for it."""
    if isinstance(cell, str):
        text = cell.strip()
        return text.lower() in _BLANKS or (text[:1] == "#" and bool(_ERROR.fullmatch(text)))
    return cell is None or cell != cell


def is_number(cell: Any) -> bool:
    """Say whether a cell is a plain number in any notation."""
    if not isinstance(cell, str):
        return isinstance(cell, (int, float)) and not isinstance(cell, bool)
    return bool(_MARKED.fullmatch(cell.strip().translate(_MINUS).removesuffix("%")[:_LONGEST]))


def read_columns(
    columns: Mapping[str, list[Any]],
    decimal: str | None,
    thousands: str | None,
    separator: str = "",
    labels: Collection[str] = (),
) -> dict[str, Column]:
    """Return columns with their numbers; see the rule on top.

    Args:
        columns: n cells each: texts, or the values of a source whose cells have types.
        decimal: The decimal mark, ``"."`` or ``","``, if it is known.
        thousands: The mark between thousands, ``"."``, ``","``, ``" "`` or ``"'"``, if it is known.
        separator: The mark between the cells of a line; empty if there is none.
        labels: Columns that name designs: a design 1.2 says nothing of decimals.
    """
    notations = _notations(decimal, thousands)
    scans = {name: _scanned(cells, notations) for name, cells in columns.items()}
    # A column with texts is refused or holds no numbers: it decides for no other.
    marks = {
        mark
        for name, scan in scans.items()
        if name not in labels and not scan.texts
        for mark in scan.certain
    }
    return {name: _column(scan, marks, separator) for name, scan in scans.items()}


def _notations(decimal: str | None, thousands: str | None) -> dict[str, _Notation]:
    """Return the notations that are possible, by their decimal marks."""
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
        table = str.maketrans({**dict.fromkeys(gaps, ""), mark: ".", "∞": "inf"})
        notations[mark] = _Notation(pattern, table)
    return notations


def _scanned(cells: list[Any], notations: Mapping[str, _Notation]) -> _Scan:
    # The usual column of what programs write, recognised first as it takes a quarter of the time.
    if "." in notations and all(
        isinstance(c, str) and len(c) <= _LONGEST and _CERTAIN.fullmatch(c) for c in cells
    ):
        values = dict.fromkeys(notations, np.array([float(cell) for cell in cells]))
        pointed = next((i for i, cell in enumerate(cells) if "." in cell), None)
        return _Scan(cells, values, [], {"": 0}, {} if pointed is None else {".": pointed}, [])
    values = {mark: np.full(len(cells), np.nan) for mark in notations}
    scan = _Scan(cells, values, [], {}, {}, [])
    for i, cell in enumerate(cells):
        if is_blank(cell):
            continue
        found, unit = _readings(cell, notations)
        if not found:
            scan.texts.append(i)
            continue
        scan.units.setdefault(unit, i)
        for mark, value in found.items():
            values[mark][i] = value
        if len(found) < len(notations):
            scan.certain.setdefault(next(iter(found)), i)
        elif len({*found.values()}) > 1:
            scan.open.append(i)
    return scan


def _readings(cell: Any, notations: Mapping[str, _Notation]) -> tuple[dict[str, float], str]:
    """Return the number in a cell by decimal mark, none if it is no number, and its unit."""
    if not isinstance(cell, str):
        if isinstance(cell, bool) or not isinstance(cell, (int, float)):
            return {}, ""
        try:
            number = float(cell)
        except OverflowError:  # an integer beyond float64
            number = math.copysign(math.inf, cell)
        unit = "per cent by its format" if isinstance(cell, PerCent) else ""
        return dict.fromkeys(notations, number), unit
    text = cell.strip().translate(_MINUS)
    if len(text) > _LONGEST:
        return {}, ""
    body = text.removesuffix("%").rstrip()
    return {
        mark: float(body.translate(translation))
        for mark, (pattern, translation) in notations.items()
        if pattern.fullmatch(body)
    }, "%" if body != text else ""


def _column(scan: _Scan, marks: Collection[str], separator: str) -> Column:
    """Return the column of a scan.

    Args:
        scan: The scan.
        marks: The decimal marks of the columns of the file that are certain.
        separator: The mark between the cells of a line.
    """

    def refused(row: int, what: str) -> Column:
        return Column(scan.cells, problem=(row, what))

    # One number is enough: taken for text, the column would silently be no objective.
    looks = scan.texts[:1] if scan.units else [i for i in scan.texts if _is_numberlike(scan, i)]
    if looks:
        what = "text among numbers" if scan.units else "no plain number"
        text = str(scan.cells[looks[0]]).strip().translate(_MINUS)
        remedy = (
            "settle it by --decimal and --thousands"
            if len(text) <= _LONGEST and _MARKED.fullmatch(text)
            else "write the number alone and its unit in the column's name, leave its line out by "
            "--skip-rows {line}, or name the objectives by --objectives"
        )
        return refused(looks[0], f"{what}; {remedy}")
    if not scan.units:
        return Column(scan.cells)
    (first, _), *others = scan.units.items()
    for unit, row in others:
        what = f"in {unit or 'no unit'}, while the first of the column is in {first or 'none'}"
        return refused(row, f"{what}; give all numbers of a column in one unit")
    decimal, *further = scan.certain or [next(iter(scan.values))]
    for mark in further:
        what = f"with the decimal mark {mark}, while others of the column have {decimal}"
        return refused(scan.certain[mark], f"{what}; give all of them the same mark")
    if scan.open and not scan.certain:
        used = {mark for i in scan.open for mark in ".," if mark in scan.cells[i]}
        printed = all(
            isinstance(cell, str) and (is_blank(cell) or _PRINTED.fullmatch(cell.strip()))
            for cell in scan.cells
        )
        if len(used) == 1 and (used == {*marks} or (printed and separator == "," and not marks)):
            (decimal,) = used
        else:
            i = scan.open[0]
            mark = "." if "." in scan.cells[i] else ","
            one, other = (scan.values[m][i] for m in (_OTHER[mark], mark))
            remedy = f"settle it by --thousands '{mark}' or --decimal '{mark}'"
            return refused(i, f"either {one:.15g} or {other:.15g}; {remedy}")
    return Column(scan.cells, scan.values[decimal], "%" if first == "%" else "")


def _is_numberlike(scan: _Scan, row: int) -> bool:
    """Say whether a reader may take a text for a number."""
    cell = scan.cells[row]
    text = cell.strip()[:_LONGEST] if isinstance(cell, str) else ""
    return bool(_NUMBERLIKE.match(text)) and not _DATE.fullmatch(text)
