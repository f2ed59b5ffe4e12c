"""Limits on columns: how they are written, and what they allow.

A limit is given as a number (the greatest value allowed), as a pair ``(lower, upper)`` with
``None`` for an open end, or as a text such as ``">= 1, <= 5"``; on a column of texts as the text
allowed, or a list of these, and on a binary one as True or False. Numbers in texts have a decimal
point. Several limits are a mapping from columns to these, or texts such as
``"f1<=60, 1<=x1<=2, rail=yes, material in steel, alu"``, as on the command line. Everything that
takes limits reads them here, once: :func:`limits_of` returns a :class:`Limit` for each column.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._numbers import number
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Names,
    Received,
    finite_number,
    invalid,
    known_name,
    mapping,
    wrong_type,
)
from pymoo_psi.pareto import listed
from pymoo_psi.table._cells import blank, real_column
from pymoo_psi.table._schema import Schema, column_names

_AS_TYPED = 15  # digits
NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_LIMIT = re.compile(
    rf"(?:(?P<first>{NUMBER})\s*(?P<left><=|>=)\s*)?(?P<name>[^<>=]*?[^<>=\s])"
    rf"(?:\s*(?P<right><=|>=)\s*(?P<last>{NUMBER}))?",
    re.DOTALL,
)
_TEXTS = re.compile(r"(?P<name>[^<>=]*[^<>=\s])(?:\s*=\s*|\s+in\s+)(?P<text>[^<>=]*)")
_STATEMENT = re.compile(r"[<>=]|\S\s+in\s")  # an entry with one of these does not continue a list
_TURNED = {"<=": ">=", ">=": "<="}  # 1 <= x is x >= 1
_SIDE = re.compile(rf"\s*(?P<sign><=|>=)\s*(?P<number>{NUMBER})\s*")
# Five or five thousand to a reader of decimal commas.
_AMBIGUOUS = re.compile(r"(?<![\w.])[1-9][0-9]{0,2}\.[0-9]{3}(?![\w.])")
_FORM = "a number or a pair (lower, upper)"


class Limit(NamedTuple):
    """What a limit allows, in the original direction: numbers from lower to upper, or some texts.

    Attributes:
        lower: The least value allowed, infinite if there is none.
        upper: The greatest value allowed, infinite if there is none.
        texts: The texts allowed in a column of texts; None for a limit on numbers.
        is_bare: Whether it was given as a number without a side, the greatest value of a column
            that is minimised.

    Example:
        >>> Limit.of("mass", 30.0).excess("mass", np.array([29.0, 32.0]))
        array([0., 2.])
    """

    lower: float = -math.inf
    upper: float = math.inf
    texts: tuple[str, ...] | None = None
    is_bare: bool = False

    @classmethod
    def of(cls, column: str, value: Any) -> Limit:
        """Return the limit in any of its forms: a number, a pair, a text, or a list of texts.

        Raises:
            ArgumentValueError: A number is NaN, the lower one is above the upper one, or a text is
                no limit.
            ArgumentTypeError: It has none of these forms.
        """
        argument = f"{column!r} in limits"
        if isinstance(value, Limit):
            limit = value
        elif isinstance(value, (tuple, list)):
            limit = _limit_of_list(argument, value)
        elif isinstance(value, str) and re.search("[<>=]", value):
            limit = limit_of_text(argument, value)
        elif isinstance(value, (str, bool, np.bool_)):
            limit = cls(texts=(str(value),))
        else:
            limit = cls(upper=value, is_bare=True)
        return limit._checked(argument)

    def _checked(self, argument: str) -> Limit:
        """Return it with floats as ends; refuse ends in the wrong order, NaN, and other values."""
        lower = _end(argument, self.lower)
        upper = _end(argument, self.upper)
        if not (lower <= upper and lower < math.inf and upper > -math.inf):
            received = Received(f"({lower:g}, {upper:g})")
            raise invalid(argument, "(lower, upper) in increasing order", received)
        return Limit(lower, upper, self.texts, self.is_bare and upper < math.inf)

    def fitted(self, name: str, schema: Schema) -> Limit:
        """Return the limit as a column has it: "True" on a binary column is the number 1.

        Raises:
            ArgumentValueError: The column is unknown or a constraint, has values of another kind,
                or it is unclear which side of it a number limits.
        """
        if self.texts is not None:
            return self._fitted_texts(name, schema)
        remedy = ""
        if name in schema.constraints:
            remedy = "leave the constraint out by Formulation(omitted=...) to give it other limits"
        free = [name for name in schema.values if name not in schema.constraints]
        column = schema[known_name("a name in limits", name, free, remedy)]
        if self.is_bare and (column.maximize or column.kind is Kind.BINARY):
            upper = self.plain
            what = "maximised" if column.maximize else "true or false"
            raise invalid(
                f"{name!r}, which is {what}, in limits",
                "a pair (lower, upper)",
                upper,
                f"say ({upper}, None) for at least or (None, {upper}) for at most",
            )
        return self

    def _fitted_texts(self, name: str, schema: Schema) -> Limit:
        texts = self.texts or ()
        kind = schema[known_name("a name in limits", name, schema.names)].kind
        if name in schema.notes or kind is Kind.CHOICE:
            return self
        if kind is Kind.BINARY and texts and {*texts} <= {"False", "True"}:
            numbers = [float(text == "True") for text in texts]
            return Limit(min(numbers), max(numbers))
        raise invalid(
            f"{name!r} in limits",
            "numbers, as its values are",
            self.plain,
            "a limit on numbers is such as '<= 250'",
        )

    def excess(self, name: str, cells: AnyArray) -> Array:
        """``(n,)`` by how much cells exceed it.

        It is infinite if a number is not finite, and 1 if a text is not allowed.

        Args:
            name: The name of the column, for messages.
            cells: ``(n,)`` its cells.

        Raises:
            ArgumentTypeError: They are other values than numbers.
        """
        if self.texts is not None:
            return np.where(np.isin(texts_of(cells), self.texts), 0.0, 1.0)
        values = real_column(name, cells)
        # Infinity is what a division by zero leaves: nothing that is known to be large enough.
        excess = np.where(np.isfinite(values), self.violation(values), np.inf)
        return np.asarray(np.maximum(excess, 0))

    def violation(self, values: Any) -> Any:
        """Return the amounts by which numbers violate it, <= 0 where they keep it."""
        # Differences of float64 have the sign of the comparison: gradual underflow sees to it.
        with np.errstate(over="ignore", invalid="ignore"):
            return np.maximum(self.lower - values, values - self.upper)

    def missing(self, cells: AnyArray) -> list[str]:
        """Return the texts allowed that no cell has: they may be misspelt.

        Example:
            >>> Limit(texts=("oak", "tni")).missing(np.array(["oak", "tin"], dtype=object))
            ['tni']
        """
        if not self.texts:
            return []
        present = {*texts_of(cells).tolist()}
        return [text for text in self.texts if text not in present]

    @property
    def plain(self) -> Any:
        """The limit as JSON can hold it: a number, a pair with None for an open end, or texts."""
        if self.texts is not None:
            return [*self.texts]
        high = None if self.upper == math.inf else plain_number(self.upper)
        if self.is_bare:
            return high
        low = None if self.lower == -math.inf else plain_number(self.lower)
        return [low, high]

    def written(self, name: str) -> str:
        """Return it in its written form, which :func:`limits_of` reads.

        It cannot read a list without texts, names that are numbers, nor names and texts that
        contain " in ", < > or =, a line break, or blanks at an end.

        Example:
            >>> Limit(upper=30.0).written("mass"), Limit(0.25, 1.125).written("width")
            ('mass<=30', '0.25<=width<=1.1250')
            >>> Limit(texts=("tin", "oak")).written("material"), Limit(upper=5.0).written("time, s")
            ('material in tin, oak', '"time, s<=5"')
        """
        if self.texts is not None:
            texts = self.texts or ("nothing",)
            sign = " in " if len(texts) > 1 else "="
            return ", ".join(map(entry_of, (f"{name}{sign}{texts[0]}", *texts[1:])))
        if self.upper == math.inf:
            return entry_of(f"{name}>={_digits(self.lower)}")
        if self.lower == -math.inf:
            return entry_of(f"{name}<={_digits(self.upper)}")
        return entry_of(f"{_digits(self.lower)}<={name}<={_digits(self.upper)}")

    def in_words(self, name: str, unit: str = "", mark: str = ".") -> str:
        """Return it as sentences name it, with the unit of its column and a decimal mark.

        Example:
            >>> Limit(upper=30.0).in_words("mass", "kg"), Limit(0.25, 1.5).in_words("width")
            ('mass at most 30 kg', 'width from 0.25 to 1.5')
            >>> Limit(texts=("tin", "oak")).in_words("material")
            'material = tin or oak'
        """
        low = number(self.lower, _AS_TYPED, mark=mark)
        high = number(self.upper, _AS_TYPED, mark=mark)
        if self.texts is not None:
            allowed = f"= {listed(self.texts or ['nothing'], 'or')}"
        elif self.lower == -math.inf:
            allowed = f"at most {high}"
        elif self.upper == math.inf:
            allowed = f"at least {low}"
        elif self.lower == self.upper:
            allowed = f"= {low}"
        else:
            allowed = f"from {low} to {high}"
        return f"{name} {allowed} {unit}".strip()


def _limit_of_list(argument: str, values: Sequence[Any]) -> Limit:
    """Return the limit of a list of texts, or of a pair (lower, upper)."""
    if all(isinstance(text, str) for text in values):
        return Limit(texts=tuple(values))
    if len(values) != 2:
        raise wrong_type(argument, _FORM, values)
    lower, upper = values
    if lower is None:
        lower = -math.inf
    if upper is None:
        upper = math.inf
    return Limit(lower, upper)


def _end(argument: str, value: Any) -> float:
    """Return an end of a limit as a float."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise wrong_type(argument, _FORM, value)
    return float(value)


AnyLimit: TypeAlias = float | str | Sequence[float | None] | Names | Limit
"""The greatest value allowed, a pair (lower, upper) with None for an open end, or a text such as
``">= 1, <= 5"``; of a column of texts the text allowed, or a list of them; True or False."""
Limits: TypeAlias = Mapping[str, AnyLimit] | Names
"""Limits on objectives, variables and outputs by name; or texts such as ``"f1<=60, x1<=2"``."""


def limits_of(limits: Limits | None, argument: str = "limits") -> dict[str, Limit]:
    """Return limits in any of their forms by column.

    Args:
        limits: A mapping, a text, a list of texts, or None for no limits.
        argument: What messages call it, such as ``--limits``.

    Raises:
        ArgumentValueError: A text is not a limit, or a column of texts has two limits.
        ArgumentTypeError: It has none of these forms.

    Example:
        >>> limits = limits_of("f1<=2.5, yield>=80, 1<=x1<=2, material in steel, alu")
        >>> [limit.written(name) for name, limit in limits.items()]
        ['f1<=2.5', 'yield>=80', '1<=x1<=2', 'material in steel, alu']
        >>> limits_of({"f1": 2.5, "yield": ">= 80"})["yield"]
        Limit(lower=80.0, upper=inf, texts=None, is_bare=False)
    """
    if limits is None:
        return {}
    if isinstance(limits, str):
        limits = [limits]
    if isinstance(limits, (list, tuple)) and all(isinstance(text, str) for text in limits):
        return _limits_of_texts(limits, argument)
    rule = "columns to numbers, such as {'f1': 2.5}, or be texts such as 'f1<=2.5'"
    limits = mapping(argument, limits, rule)
    names = column_names(argument, [*limits])
    return {name: Limit.of(name, limits[name]) for name in names}


def _limits_of_texts(texts: Names, argument: str) -> dict[str, Limit]:
    limits: dict[str, Limit] = {}
    listing = ""  # the column of the entry before, if texts may follow it
    for entry in entries_of(texts):
        if listing and not _STATEMENT.search(entry):
            allowed = limits[listing].texts or ()
            limits[listing] = Limit(texts=(*allowed, entry))
            continue
        name, limit = _limit_of_entry(entry, argument)
        listing = name
        if limit.texts is None or "=" in entry:  # not "column in text"
            listing = ""
        if name in limits:
            former = limits[name]
            if former.texts is not None or limit.texts is not None:
                raise invalid(argument, "given once for a column of texts", Received(entry))
            # Both hold.
            limit = Limit(max(former.lower, limit.lower), min(former.upper, limit.upper))
        limits[name] = limit._checked(f"{name!r} in limits")
    return limits


def _limit_of_entry(entry: str, argument: str) -> tuple[str, Limit]:
    """Return the column of an entry, and its limit."""
    match = _TEXTS.fullmatch(entry)
    if match is not None:
        return match["name"], Limit(texts=(match["text"].strip(),))
    match = _LIMIT.fullmatch(entry)
    # Two signs that state the same side are no limit, nor is the absence of both.
    if match is None or _TURNED.get(match["left"]) == match["right"]:
        raise invalid(
            argument,
            "of the form column<=number, number<=column<=number, column=text or "
            "column in text, text, joined by commas",
            Received(entry or "nothing"),
            "join limits by commas; use <= or >=, plain numbers with a decimal point, and no units",
        )
    ends: dict[str, float] = {}
    if match["left"]:
        ends[_TURNED[match["left"]]] = finite_number(argument, float(match["first"]))
    if match["right"]:
        ends[match["right"]] = finite_number(argument, float(match["last"]))
    return match["name"], Limit(ends.get(">=", -math.inf), ends.get("<=", math.inf))


def limit_of_text(argument: str, text: str) -> Limit:
    """Return a limit such as ``">= 1, <= 5"``.

    Args:
        argument: What messages call the limit.
        text: The limit.

    Raises:
        ArgumentValueError: The text is something else, or gives a side twice.

    Example:
        >>> limit_of_text("the limit on stress", ">= 1, <= 250").plain
        [1, 250]
    """
    ends: dict[str, float] = {}
    for part in str(text).split(","):
        side = _SIDE.fullmatch(part)
        if side is None or side["sign"] in ends:
            raise invalid(argument, "such as '<= 250' or '>= 3, <= 250'", text)
        ends[side["sign"]] = finite_number(argument, float(side["number"]))
    return Limit(ends.get(">=", -math.inf), ends.get("<=", math.inf))._checked(argument)


def require_decimal_points(texts: Names, argument: str) -> None:
    """Refuse limits on a file of decimal commas with a point that may separate thousands.

    Whoever writes 2,5 into files may type 1.250 for 1250.
    """
    for text in texts:
        match = _AMBIGUOUS.search(text)
        if match is not None:
            rule = "of numbers that can be read in one way, beside decimal commas"
            remedy = f"write {match[0].replace('.', '')} or {match[0]}0"
            raise invalid(argument, rule, Received(text), remedy)


def entries_of(texts: Names) -> list[str]:
    """Return the entries of lists with commas; quotation marks keep a comma in a name.

    Example:
        >>> entries_of(['"time, s",mass', "cost"])
        ['time, s', 'mass', 'cost']
    """
    entries = []
    for text in texts:
        rows = csv.reader([text.replace("\n", " ")], skipinitialspace=True)
        cells = [cell.strip() for cell in next(rows, [])]
        # An empty text stays an empty entry, to be refused: it is not the absence of a list.
        entries += cells or [""]
    return entries


def texts_of(cells: AnyArray) -> AnyArray:
    """``(n,)`` the texts of cells; a missing one is empty."""
    return np.where(blank(cells), "", cells).astype(str)


def entry_of(text: str) -> str:
    """Return a text as an entry of a list, which :func:`entries_of` reads."""
    if not {",", '"'} & {*text}:
        return text
    doubled = text.replace('"', '""')
    return f'"{doubled}"'


def _digits(number: float) -> str:
    """Return a number as it is written in a limit, also for a file of decimal commas."""
    text = str(plain_number(number))
    if _AMBIGUOUS.search(text):
        text += "0"
    return text


def plain_number(value: float) -> float:
    """Return a number as an integer where that is the same, so that files and names have 30."""
    # Beyond 2^53 not every integer is a float64, and digits would be shown that are not there.
    if value.is_integer() and abs(value) < 2**53:
        return int(value)
    return value
