"""Limits on the columns of a table: how they are written, and what they allow.

A limit is given as a number (the greatest value allowed), as a pair ``(lower, upper)`` with
``None`` for an open end, or as a text such as ``">= 1, <= 5"``; on a column of texts as the text
allowed, or a list of these. Several limits are a mapping from columns to these, or texts such as
``"f1<=60, 1<=x1<=2, rail=yes, material in steel, alu"``, as on the command line. Everything that
takes limits reads them here.
"""

from __future__ import annotations

import csv
import numbers
import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from pymoo_psi._validation import (
    Received,
    finite_number,
    invalid,
    known_name,
    mapping,
    wrong_type,
)
from pymoo_psi.table._layout import Layout, index_of

Limit: TypeAlias = float | str | Sequence[float | None] | Sequence[str]
"""The greatest value allowed, a pair (lower, upper) with None for an open end, or a text such as
``">= 1, <= 5"``; of a column of texts the text allowed, or a list of them."""
Limits: TypeAlias = (
    Mapping[str, Limit]
    | Mapping[int, Limit]
    | Mapping[str | int, Limit]
    | Sequence[str]  # which a text is, too
)
"""Limits on objectives, variables and outputs by name, and on objectives also by index from 0; or
texts such as ``"f1<=60, x1<=2"``."""
Ends: TypeAlias = tuple[float | None, float | None]
Allowed: TypeAlias = tuple[float, float] | list[str]
"""What a limit allows: the least and the greatest value in the original direction, infinite if
open; of a column of texts, these."""

OPEN = (-np.inf, np.inf)
"""The limit that allows every value."""

NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_LIMIT = re.compile(
    rf"(?:(?P<first>{NUMBER})\s*(?P<left><=|>=)\s*)?(?P<name>.*?[^<>=\s])"
    rf"(?:\s*(?P<right><=|>=)\s*(?P<last>{NUMBER}))?",
    re.DOTALL,
)
_TEXTS = re.compile(r"(?P<name>[^<>=]*[^<>=\s])(?:\s*=\s*|(?P<list>\s+in\s+))(?P<text>[^<>=]*)")
_TURNED = {"<=": ">=", ">=": "<="}  # 1 <= x is x >= 1
_SIDE = re.compile(rf"\s*(?P<sign><=|>=)\s*(?P<number>{NUMBER})\s*")
# Five or five thousand, as in a file: see the rule for numbers in read_table.
_AMBIGUOUS = re.compile(r"[+-]?[1-9][0-9]{0,2}\.[0-9]{3}")


def entries_of(texts: Sequence[str]) -> list[str]:
    """Return the entries of lists with commas; quotation marks keep a comma in a name.

    Example:
        >>> entries_of(['"time, s",mass', "cost"])
        ['time, s', 'mass', 'cost']
    """
    entries = []
    for text in texts:
        line = re.sub(r"[\n\0]", " ", text)  # csv refuses \0 before Python 3.11
        rows = csv.reader([line], skipinitialspace=True)
        cells = [cell.strip() for cell in next(rows, [])]
        # An empty text stays an empty entry, to be refused: it is not the absence of a list.
        entries += cells or [""]
    return entries


def limits_of(limits: Any, argument: str = "limits") -> dict[str | int, Any]:
    """Return limits in any of their forms as a mapping from columns to numbers or pairs.

    Args:
        limits: A mapping, a text, a list of texts, or None for no limits.
        argument: What messages call it, such as ``--limits``.

    Returns:
        Numbers or pairs by column; of columns of texts lists of the texts allowed.

    Raises:
        ArgumentValueError: A text is not a limit, one side of a column has two limits, or a number
            may have a point between thousands.
        ArgumentTypeError: It has none of these forms.

    Example:
        >>> limits_of("f1<=2.5, yield>=80, 1<=x1<=2")
        {'f1': (None, 2.5), 'yield': (80.0, None), 'x1': (1.0, 2.0)}
        >>> limits_of({"f1": 2.5, "yield": ">= 80"})
        {'f1': 2.5, 'yield': (80.0, None)}
        >>> limits_of("rail=yes, material in steel, alu, f1<=2")
        {'rail': ['yes'], 'material': ['steel', 'alu'], 'f1': (None, 2.0)}
    """
    if limits is None:
        return {}
    if isinstance(limits, str):
        limits = [limits]
    if isinstance(limits, (list, tuple)) and all(isinstance(text, str) for text in limits):
        return _limits_of_texts(limits, argument)
    rule = "columns to numbers, such as {'f1': 2.5}, or be texts such as 'f1<=2.5'"
    limit_by_column = {}
    for column, limit in mapping(argument, limits, rule).items():
        if isinstance(limit, str) and re.search("[<>=]", limit):
            limit = _limit_of_sides(sides_of_text(f"the limit on {column!r}", limit))
        elif isinstance(limit, str):
            limit = [limit]
        elif is_of_texts(limit):
            limit = list(limit)
        limit_by_column[column] = limit
    return limit_by_column


def is_of_texts(limit: Any) -> bool:
    """Whether a limit is a list of the texts that it allows; an empty one allows none."""
    if not isinstance(limit, (list, tuple, set, frozenset)):
        return False
    return all(isinstance(text, str) for text in limit)


def sides_of_text(argument: str, text: str) -> dict[str, float]:
    """Return the sides of a limit such as ``">= 1, <= 5"``: numbers by sign.

    Args:
        argument: What messages call the limit.
        text: The limit.

    Raises:
        ArgumentValueError: The text is something else, or gives a side twice.

    Example:
        >>> sides_of_text("the limit on stress", ">= 1, <= 250")
        {'>=': 1.0, '<=': 250.0}
    """
    sides: dict[str, float] = {}
    for part in str(text).split(","):
        side = _SIDE.fullmatch(part)
        if side is None:
            raise invalid(argument, "such as '<= 250' or '>= 3, <= 250'", text)
        value = finite_number(argument, float(side["number"]))
        _add_side(sides, side["sign"], value, text, argument)
    return sides


def _add_side(sides: dict[str, Any], sign: str, value: Any, text: str, argument: str) -> None:
    """Add a side of a limit, or the texts that it allows, to those of its column."""
    if sign in sides or (sides and "in" in (sign, *sides)):
        raise invalid(argument, "given once for each side of a column", Received(text))
    sides[sign] = value


def _limit_of_sides(sides: Mapping[str, Any]) -> Any:
    if "in" in sides:
        return sides["in"]
    return sides.get(">="), sides.get("<=")


def _limits_of_texts(texts: Sequence[str], argument: str) -> dict[str | int, Any]:
    sides_by_column: dict[str | int, dict[str, Any]] = {}
    allowed: list[str] | None = None  # of the list that an entry may continue
    for entry in entries_of(texts):
        match = _TEXTS.fullmatch(entry)
        if allowed is not None and match is None and not re.search("[<>=]", entry):
            allowed.append(entry)
            continue
        allowed = None
        if match is not None:
            listed = [match["text"].strip()]
            _add_side(sides_by_column.setdefault(match["name"], {}), "in", listed, entry, argument)
            if match["list"]:
                allowed = listed
            continue
        match = _LIMIT.fullmatch(entry)
        if match is None or not (match["left"] or match["right"]):
            raise invalid(
                argument,
                "of the form column<=number, number<=column<=number, column=text or "
                "column in text, text, joined by commas",
                Received(entry or "nothing"),
                "use <= or >=, plain numbers with a decimal point, and no units",
            )
        sides = sides_by_column.setdefault(match["name"], {})
        for sign, number in ((_TURNED.get(match["left"]), "first"), (match["right"], "last")):
            if sign:
                value = _number_of_one_meaning(match[number], entry, argument)
                _add_side(sides, sign, value, entry, argument)
    return {column: _limit_of_sides(sides) for column, sides in sides_by_column.items()}


def _number_of_one_meaning(number: str, text: str, argument: str) -> float:
    """Return a number; one that people write for five and for five thousand alike is refused."""
    if _AMBIGUOUS.fullmatch(number):
        raise invalid(
            argument,
            "of numbers with one meaning",
            Received(f"{text}, with a decimal point or one between thousands"),
            f"write {number.replace('.', '')}, or one decimal more or less",
        )
    return finite_number(argument, float(number))


def allowed_by(column: Any, limit: Any) -> Allowed:
    """Return what a limit allows; a number is the greatest value.

    Args:
        column: Name of the column, for messages.
        limit: A number, a pair of numbers or None, or texts.

    Raises:
        ArgumentValueError: A number is NaN, or the lower one is above the upper one.
        ArgumentTypeError: It has none of these forms.
    """
    if is_of_texts(limit):
        return [*limit]
    return ends(column, limit)


def ends(column: Any, limit: Any) -> tuple[float, float]:
    """Return the least and the greatest value that a limit allows; a number is the greatest.

    Args:
        column: Name of the column, for messages.
        limit: A number, or a pair of numbers or None.

    Raises:
        ArgumentValueError: A number is NaN, or the lower one is above the upper one.
        ArgumentTypeError: It is neither a number nor a pair of numbers or None.
    """
    pair = limit if isinstance(limit, (tuple, list)) else (None, limit)
    if limit is None or len(pair) != 2 or not all(map(_is_end, pair)):
        raise wrong_type(f"the limit on {column!r}", "a number or a pair (lower, upper)", limit)
    lower, upper = pair
    low = -np.inf if lower is None else float(lower)
    high = np.inf if upper is None else float(upper)
    # Not so of NaN either, nor of two infinite ends with one sign.
    if not (low <= high and low < np.inf and high > -np.inf):
        raise invalid(f"the limit on {column!r}", "(lower, upper) in increasing order", limit)
    return low, high


def _is_end(value: Any) -> bool:
    """Whether a value can be an end of a limit: a number or None."""
    if value is None:
        return True
    return isinstance(value, numbers.Real) and not isinstance(value, (bool, np.bool_))


def limits_by_name(limits: Limits | None, objectives: Sequence[str]) -> dict[str, Any]:
    """Return limits in any of their forms by the names of columns; an index is of an objective."""
    limit_by_name = {}
    for key, limit in limits_of(limits).items():
        name = key
        if not isinstance(key, str):
            name = objectives[index_of("objective", key, objectives)]
        if name in limit_by_name:
            raise invalid("limits", "given once for a column", limits)
        limit_by_name[str(name)] = limit
    return limit_by_name


def limits_on(limits: Limits | None, layout: Layout) -> dict[str, Allowed]:
    """Return what limits allow, numbers in the order of the table's columns and texts after them.

    Raises:
        ArgumentValueError: A column of numbers is unknown, is named twice, or is a constraint; a
            limit is NaN, its lower end is above the upper one, or it is unclear which end a number
            is.
        ArgumentTypeError: The limits have none of the forms that they may have.
    """
    allowed = {}
    free = [name for name in layout.columns if name not in layout.constraints]
    by_name = limits_by_name(limits, layout.objectives)
    for name, limit in by_name.items():
        allowed[name] = allowed_by(name, limit)
        if is_of_texts(limit):
            continue
        remedy = ""
        if name in layout.constraints:
            remedy = "leave the constraint out by Formulation(relaxed=...) to give it other limits"
        known_name("a limit", name, free, remedy)
        if name in layout.maximize and not isinstance(limit, (tuple, list)):
            remedy = f"say ({limit}, None) for at least or (None, {limit}) for at most"
            raise invalid(
                f"the limit on {name!r}, which is maximised,",
                "a pair (lower, upper)",
                limit,
                remedy,
            )
    # The order of the columns, not of the mapping: columns of violations stand in it.
    ordered = {}
    for name in layout.columns:
        if name in allowed and not is_of_texts(by_name[name]) and allowed[name] != OPEN:
            ordered[name] = allowed[name]
    return ordered | {name: texts for name, texts in allowed.items() if is_of_texts(texts)}


def limit_text(name: str, limit: Allowed) -> str:
    """Return a limit in its written form, which :func:`limits_of` reads.

    Example:
        >>> limit_text("mass", (-np.inf, 30.0)), limit_text("width", (0.25, 0.75))
        ('mass<=30', '0.25<=width<=0.75')
        >>> limit_text("rail", ["yes"]), limit_text("material", ["steel", "alu"])
        ('rail=yes', 'material in steel, alu')
    """
    if isinstance(limit, list):
        if len(limit) == 1:
            return f"{name}={limit[0]}"
        return f"{name} in {', '.join(limit) or 'nothing'}"
    lower, upper = limit
    low = plain_number(lower)
    high = plain_number(upper)
    if np.isinf(upper):
        return f"{name}>={low}"
    if np.isinf(lower):
        return f"{name}<={high}"
    return f"{low}<={name}<={high}"


def plain_number(value: float) -> float:
    """Return a number as an integer where that is the same, so that files and names have 30."""
    # Beyond 2^53 not every integer is a float64, and digits would be shown that are not there.
    if value.is_integer() and abs(value) < 2**53:
        return int(value)
    return value
