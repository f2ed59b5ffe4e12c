"""The one rule for numbers in files that people write, and for rows that summarise others.

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

import re
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import invalid
from pymoo_psi.errors import ArgumentValueError

Array = NDArray[np.float64]

_BLANKS = {"", "nan", "na", "n/a", "<na>", "null", "none", "-", "--", "–", "—", "?"}
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
# What a reader may take for a number, though it is none by the rule: $5, ~5, 5 kg, 1/2, =A1; but
# not dates and times.
_NUMBERLIKE = re.compile(
    r"(?!\d{4}-\d\d?-\d\d?(?:[T ].*)?$|\d\d?[./]\d\d?[./]\d{2,4}$|\d\d?:\d\d(?::\d\d)?$)"
    r"(?:=|\W*(?:(?:EUR|USD|GBP|CHF|JPY|CNY|US|ca|circa|approx|about)\b\W*)?\d)",
    re.IGNORECASE,
)
_MARKED = re.compile(r"[+-]?\d[\d.,'’\s]*(?:e[+-]?\d+)?", re.IGNORECASE)
# Words by which spreadsheets and people call rows that summarise others, by what they hold.
_SUMMARIES = {
    word: kind
    for kind, words in {
        "sum": "total totals subtotal sum sums σ summe gesamt insgesamt gesamtsumme "
        "zwischensumme teilsumme ergebnis gesamtergebnis teilergebnis somme suma totale",
        "mean": "mean average avg ø mittel mittelwert durchschnitt moyenne media promedio",
        "median": "median zentralwert",
        "std": "std stdev deviation standardabweichung",
        "extreme": "min minimum max maximum best worst ideal nadir utopia bester schlechtester",
    }.items()
    for word in words.split()
}
_ROUNDED = 0.01  # relative; what is shown is often the rounded summary of unrounded numbers


class UnfitError(ArgumentValueError):
    """A source is no table; :func:`read_table` says which source."""


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
    numbers: Array | None = None
    unit: str = ""
    problem: tuple[int, str] | None = None


class _Notation(NamedTuple):
    pattern: re.Pattern[str]
    translation: dict[int, str]  # from its numbers to those of Python


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
    return bool(_MARKED.fullmatch(_plain(cell)[:_LONGEST]))


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
    readings = {name: _readings(cells, notations) for name, cells in columns.items()}
    # A column with texts is refused or holds no numbers: it decides for no other.
    marks = {
        mark
        for name, (values, texts) in readings.items()
        if name not in labels and not len(texts)
        for mark, rows in _certain(values).items()
        if len(rows)
    }
    return {
        name: _column(columns[name], *read, marks, separator) for name, read in readings.items()
    }


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


def _readings(
    cells: list[Any], notations: Mapping[str, _Notation]
) -> tuple[dict[str, Array], NDArray[np.intp]]:
    """Return ``(n,)`` numbers by decimal mark, NaN where there is none, and the rows of texts."""
    # The usual column of what programs write, recognised first as it takes a quarter of the time.
    if "." in notations and all(
        isinstance(c, str) and len(c) <= _LONGEST and _CERTAIN.fullmatch(c) for c in cells
    ):
        numbers = np.array([*map(float, cells)])
        pointed = np.array(["." in cell for cell in cells], dtype=bool)
        other = np.where(pointed, np.nan, numbers)
        return {m: numbers if m == "." else other for m in notations}, np.zeros(0, dtype=np.intp)
    blank = np.array([is_blank(cell) for cell in cells], dtype=bool)
    plain = [_plain(cell) if isinstance(cell, str) else cell for cell in cells]
    values = {mark: np.array([_number(c, how) for c in plain]) for mark, how in notations.items()}
    none = np.logical_and.reduce([np.isnan(column) for column in values.values()])
    return values, np.flatnonzero(none & ~blank)


def _plain(cell: str) -> str:
    """Return a text without spaces about it, per cent sign and minus signs of typesetters."""
    return cell.strip().translate(_MINUS).removesuffix("%").rstrip()


def _number(cell: Any, notation: _Notation) -> float:
    """Return the number in a cell, NaN if there is none."""
    if isinstance(cell, str):
        if len(cell) > _LONGEST or not notation.pattern.fullmatch(cell):
            return np.nan
        return float(cell.translate(notation.translation))
    if isinstance(cell, bool) or not isinstance(cell, (int, float)):
        return np.nan
    try:
        return float(cell)
    except OverflowError:  # an integer beyond float64
        return np.inf if cell > 0 else -np.inf


def _certain(values: Mapping[str, Array]) -> dict[str, NDArray[np.intp]]:
    """Return the rows of numbers that only one notation allows, by its decimal mark."""
    known = {mark: ~np.isnan(column) for mark, column in values.items()}
    one = np.add.reduce([*known.values()], dtype=int) == 1
    return {mark: np.flatnonzero(rows & one & (len(known) > 1)) for mark, rows in known.items()}


def _column(
    cells: list[Any],
    values: Mapping[str, Array],
    texts: NDArray[np.intp],
    marks: Collection[str],
    separator: str,
) -> Column:
    """Return a column by its readings and the marks of the certain columns of the file."""

    def refused(row: Any, what: str) -> Column:
        return Column(cells, problem=(int(row), what))

    decimal, *others = values
    first = values[decimal]
    known = np.flatnonzero(~np.logical_and.reduce([np.isnan(column) for column in values.values()]))
    # One number is enough: taken for text, the column would silently be no objective.
    looks = texts[:1] if len(known) else [i for i in texts if _is_numberlike(cells[i])]
    if len(looks):
        what = "text among numbers" if len(known) else "no plain number"
        remedy = "settle it by --decimal and --thousands, leave its line out by --skip-rows {line}"
        return refused(looks[0], f"{what}; {remedy}, or name the objectives by --objectives")
    if not len(known):
        return Column(cells)
    unit = _unit(cells[known[0]])
    if other := next((i for i in known if _unit(cells[i]) != unit), None):
        what = f"in {_unit(cells[other]) or 'no unit'}, while the first of the column is in "
        return refused(other, f"{what}{unit or 'none'}; give all numbers of a column in one unit")
    certain = sorted((rows[0], mark) for mark, rows in _certain(values).items() if len(rows))
    for row, mark in certain[1:]:
        what = f"with the decimal mark {mark}, while others of the column have {certain[0][1]}"
        return refused(row, f"{what}; give all of them the same mark")
    if certain:
        decimal = certain[0][1]
    elif others and len(open_rows := known[first[known] != values[others[0]][known]]):
        used = {mark for i in open_rows for mark in ".," if mark in cells[i]}
        printed = all(
            isinstance(cell, str) and (is_blank(cell) or _PRINTED.fullmatch(cell.strip()))
            for cell in cells
        )
        i = open_rows[0]
        decimal = "." if "." in cells[i] else ","
        settled = used == {*marks} or (printed and separator == "," and not marks)
        if len(used) > 1 or not settled:
            one, two = (values[mark][i] for mark in (_OTHER[decimal], decimal))
            remedy = f"settle it by --thousands '{decimal}' or --decimal '{decimal}'"
            return refused(i, f"either {one:.15g} or {two:.15g}; {remedy}")
    return Column(cells, values[decimal], "%" if unit == "%" else "")


def _unit(cell: Any) -> str:
    if isinstance(cell, str):
        return "%" if cell.rstrip().endswith("%") else ""
    return "per cent by its format" if isinstance(cell, PerCent) else ""


def _is_numberlike(cell: Any) -> bool:
    return isinstance(cell, str) and bool(_NUMBERLIKE.match(cell.strip()[:_LONGEST]))


def require_designs(
    texts: Mapping[str, list[Any]],
    F: Array,
    where: Callable[[int], str],
    line: Callable[[int], int],
) -> None:
    """Refuse rows that summarise others, such as "Total".

    A name alone says nothing, as a design may be called Max, nor do a few equal numbers: a row is
    refused if it is called by such a word and holds these numbers, of all other rows or of those
    next to it.

    Args:
        texts: The n cells of the columns that hold texts.
        F: ``(n, m)`` numbers; NaN where there are none.
        where: Says where the i-th row stands.
        line: The number by which the i-th row is left out.

    Raises:
        ArgumentValueError: There is such a row.
    """
    n, F = len(F), np.where(np.isfinite(F), F, np.nan)
    called: dict[int, tuple[str, str]] = {}
    for cells in texts.values():
        for i, cell in enumerate(cells):
            for word in re.findall(r"\w+", cell.lower()) if isinstance(cell, str) else ():
                if word in _SUMMARIES:
                    called[i] = (cell.strip(), _SUMMARIES[word])
    # Words in most of many rows are values of a column, such as the levels min and max.
    if len(called) > max(10, n // 2):
        return
    order = sorted(called)
    others = np.flatnonzero([i not in called for i in range(n)])
    # Sums of groups stand below or above these, so between the rows that summarise.
    groups = np.split(others, np.searchsorted(others, order))
    for k, i in enumerate(order):
        cell, kind = called[i]
        # Beside sums there may be ratios of sums; but a design may be the best in many columns.
        least = 0.5 if kind == "sum" else 1.0
        if any(_share(F[i], F[rows], kind) >= least for rows in (others, groups[k], groups[k + 1])):
            out = ",".join(str(line(j)) for j in order)
            what = f"{where(i)} is called {cell!r:.40} and summarises other rows"
            raise UnfitError(f"{what}; leave it out by --skip-rows {out}, or rename it")


def _share(row: Array, F: Array, kind: str) -> float:
    """Return in what share of the columns that can be compared a row holds a summary of others."""
    # One number, or one beside zeros, is no sign of a summary, nor are equal numbers.
    varied = np.isfinite(row) & ((np.isfinite(F) & (F != 0)).sum(axis=0) > 1)
    if len(F) and kind != "sum":
        varied &= np.fmin.reduce(F) < np.fmax.reduce(F)
    F, row = F[:, varied], row[varied]
    if F.shape[1] == 0:
        return 0.0
    with np.errstate(all="ignore"):
        if kind == "extreme":
            return float(np.mean((row == np.nanmin(F, axis=0)) | (row == np.nanmax(F, axis=0))))
        values = getattr(np, f"nan{kind}")(F, axis=0)  # nansum, nanmean, nanmedian, nanstd
        return float(np.mean(np.abs(values - row) <= _ROUNDED * np.abs(row)))
