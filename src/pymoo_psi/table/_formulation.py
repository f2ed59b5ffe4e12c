"""What is asked of tests: objectives, directions, limits, constraints that hold, computed columns.

In Parameter Space Investigation the problem is formulated after the tests, and often anew
(Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995, Chapter 1): a limit was
too tight, an objective was forgotten, a constraint turns out to be negotiable.

A limit is given as a number (the greatest value allowed), as a pair ``(lower, upper)`` with
``None`` for an open end, or as a text such as ``">= 1, <= 5"``; on a column of texts as the text
allowed, or a list of these. Several limits are a mapping from columns to these, or texts such as
``"f1<=60, 1<=x1<=2, rail=yes, material in steel, alu"``, as on the command line. Everything that
takes limits reads them here.
"""

from __future__ import annotations

import csv
import json
import numbers
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypedDict

import msgspec
import numpy as np

from pymoo_psi._output import Shown, whole_file
from pymoo_psi._validation import (
    Columns,
    Entries,
    FilePath,
    Names,
    Received,
    Values,
    boolean,
    collection,
    distinct,
    finite_number,
    instance,
    invalid,
    known_name,
    mapping,
    wrong_type,
)
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table._expression import Expression
from pymoo_psi.table._layout import RESERVED, Layout, column_names, real_column, unit_texts

if TYPE_CHECKING:
    import pandas as pd

_VERSION = 1  # of the file

Limit: TypeAlias = float | str | Sequence[float | None] | Names
"""The greatest value allowed, a pair (lower, upper) with None for an open end, or a text such as
``">= 1, <= 5"``; of a column of texts the text allowed, or a list of them."""
Limits: TypeAlias = Mapping[str, Limit] | Names
"""Limits on objectives, variables and outputs by name; or texts such as ``"f1<=60, x1<=2"``."""
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
_TEXTS = re.compile(r"(?P<name>[^<>=]*[^<>=\s])(?:\s*=\s*|\s+in\s+)(?P<text>[^<>=]*)")
_STATEMENT = re.compile(r"[<>=]|\S\s+in\s")  # an entry with one of these does not continue a list
_TURNED = {"<=": ">=", ">=": "<="}  # 1 <= x is x >= 1
_SIDE = re.compile(rf"\s*(?P<sign><=|>=)\s*(?P<number>{NUMBER})\s*")
# Five or five thousand, as in a file: see the rule for numbers in read_table.
_AMBIGUOUS = re.compile(r"[+-]?[1-9][0-9]{0,2}\.[0-9]{3}")


class FormulationFields(TypedDict, total=False):
    """The attributes of a :class:`Formulation`, as arguments."""

    objectives: Names
    maximize: Names
    limits: Limits | None
    omitted: Names
    computed: Mapping[str, str]
    units: Mapping[str, str]
    normalize: bool
    ranges: Mapping[str, Sequence[float]] | None
    chosen: str | None
    reason: str
    positions: Sequence[Entries]
    decided: Entries | None
    page: Entries


@dataclass(frozen=True)
class Formulation(Shown):
    """A formulation of a problem, applied to tests by :meth:`TestTable.under`.

    All columns are named, and all values are in the original direction. Attributes that are not
    given leave the table unchanged: its objectives, directions and constraints.

    Attributes:
        objectives: Names of the objectives, any columns of numbers; by default the table's. A
            variable or constraint named here becomes an objective only (an equality by its absolute
            value). The table's other objectives become outputs.
        maximize: Objectives to be maximised, in addition to those of the table.
        limits: Limits on objectives, variables and outputs by name, in the original direction,
            ``{"mass": 30, "width": (0.2, 0.4), "gain": (0.9, None)}``: at most 30, from 0.2 to 0.4,
            and at least 0.9. A number is the greatest value allowed; for a maximised objective it
            is refused, because it is ambiguous. On columns of texts, the allowed text or a list:
            ``{"rail": "yes", "material": ["steel", "alu"]}``. Or texts, ``"mass<=30, gain>=0.9,
            rail=yes, material in steel, alu"``.
        omitted: Constraints that are omitted and become outputs; a limit on such a column replaces
            the bound.
        computed: Further columns by name, each an expression of others, such as ``"mass /
            stress"``. Each may use those before it. Names with other characters than letters,
            digits and ``_`` are written in backquotes. An expression may contain + - * / ** and
            parentheses, abs, sqrt, exp, log (natural), log2, log10, sin, cos, tan (of radians),
            asin, acos, atan, sinh, cosh, tanh, min, max and pi.
        units: Units of columns by name, which are also those of the limits; a table with a column
            in another unit is refused.
        normalize: Whether designs are ranked in units of the objectives' ranges.
        ranges: Fixed ranges ``(lower, upper)`` of all objectives, independent of the limits. An
            empty mapping uses those of the Pareto set, None those of the table. Equal ends are
            refused for an objective in which designs differ.
        chosen: Name of the chosen design, as in :attr:`TestTable.names`; None if none is chosen.
        reason: Why it was chosen.
        positions: Positions of people, one mapping for each person and date: ``name``; ``date`` in
            ISO 8601, or empty; ``chosen``, the name of a design or None; ``limits``, ``weights``
            and ``aspiration`` of objectives by name; ``reason``. Positions with the same name are a
            history. They are kept by date, each once, so that positions of several files can be
            joined in any order.
        decided: The decision of a group, None if there is none: ``chosen``, the name of a design,
            and, where they are known, ``date``; ``agree`` and ``dissent``, lists of names.
        page: Other settings of the decision page, without effect on the decision.

    Raises:
        ArgumentValueError: A name is given twice, or a limit or an expression cannot be read.
        ArgumentTypeError: A name is not text, or a limit is not made of numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[1.0], [2.0], [4.0]], [[3.0, 6], [2, 2], [1, 4]])
        >>> formulation = Formulation(
        ...     objectives=["f1", "ratio"], limits={"x1": (None, 3)}, computed={"ratio": "f2 / f1"})
        >>> print(table.under(formulation).to_frame()[["f1", "ratio", "status", "violated"]])
                     f1  ratio      status violated
        test_point
        1           3.0    2.0          ok
        2           2.0    1.0          ok
        3           1.0    4.0  infeasible    x1<=3
    """

    objectives: Names = ()
    maximize: Names = ()
    limits: Limits | None = field(default_factory=dict)
    omitted: Names = ()
    computed: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    normalize: bool = True
    ranges: Mapping[str, Sequence[float]] | None = None
    chosen: str | None = None
    reason: str = ""
    positions: Sequence[Entries] = ()
    decided: Entries | None = None
    page: Entries = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check what can be checked without a table, and take copies."""
        self._check_columns()
        self._check_limits()
        self._check_ranges()
        self._check_decisions()

    def _check_columns(self) -> None:
        for group in ("objectives", "maximize", "omitted"):
            names = column_names(group, getattr(self, group))
            for name in names:
                if names.count(name) > 1:
                    raise invalid(group, "columns that are named once", name)
            self._set(group, names)
        for group in ("computed", "page"):
            entries = mapping(group, getattr(self, group), "columns to values")
            column_names(group, tuple(entries))
            self._set(group, dict(entries))
        for text in self.computed.values():
            Expression.of(text)
        self._set("units", unit_texts(self.units))

    def _check_limits(self) -> None:
        limits = limits_of(self.limits)
        column_names("limits", tuple(limits))
        self._set("limits", limits)

    def _check_ranges(self) -> None:
        boolean("normalize", self.normalize)
        if self.ranges is None:
            return
        ranges = {}
        pairs = mapping("ranges", self.ranges, "objectives to pairs (lower, upper)")
        for name, pair in pairs.items():
            ranges[name] = [*ends(name, pair)]
            if not np.isfinite(ranges[name]).all():
                raise invalid(f"the range of {name!r}", "of two finite numbers", ranges[name])
        self._set("ranges", ranges)

    def _check_decisions(self) -> None:
        if self.chosen is not None:
            instance("chosen", self.chosen, str)
        instance("reason", self.reason, str)
        rule = "a list of mappings, one for each person and date"
        positions = {}
        for entries in collection("positions", self.positions, rule):
            position = _checked("a position", entries, _Position)
            position["limits"] = limits_of(position["limits"], "the limits of a position")
            content = json.dumps(position, sort_keys=True)
            key = (position["date"], position["name"], position["chosen"] or "", content)
            positions[key] = position
        # In one order, each once, whatever files they come from and in whatever order.
        self._set("positions", [positions[key] for key in sorted(positions)])
        if self.decided is not None:
            self._set("decided", _checked("decided", self.decided, _Decision))

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _stated(self) -> Values:
        """Return the attributes that differ from their defaults."""
        default = Formulation()
        stated = {}
        for name in ATTRIBUTES:
            value = getattr(self, name)
            if value != getattr(default, name):
                stated[name] = value
        return stated

    def __repr__(self) -> str:
        """Return the call that makes it."""
        arguments = [f"{name}={value!r}" for name, value in self._stated().items()]
        return f"Formulation({', '.join(arguments)})"

    def to_frame(self) -> pd.DataFrame:
        """Return a table of the attributes that differ from their defaults.

        Example:
            >>> print(Formulation(maximize=["gain"], limits={"mass": 30}).to_frame())
                           value
            maximize    ('gain',)
            limits    {'mass': 30}
        """
        from pandas import Series

        return Series(self._stated()).map(str).to_frame("value")

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of numbers that it uses, without those that it computes.

        Example:
            >>> Formulation(["mass", "r"], limits={"x1": 3}, computed={"r": "f2 / f1"}).columns
            ('mass', 'x1', 'f2', 'f1')
        """
        names = [*self.objectives, *self.maximize, *self.omitted]
        for name, limit in limits_of(self.limits).items():
            if not isinstance(limit, list):
                names.append(name)
        for text in self.computed.values():
            names += Expression.of(text).columns
        return tuple(name for name in dict.fromkeys(names) if name not in self.computed)

    def without_columns(self) -> Formulation:
        """Return it without objectives and computed columns, for a table that has them already.

        Example:
            >>> Formulation(["mass", "gain"], limits={"mass": 30}).without_columns().objectives
            ()
        """
        return replace(self, objectives=(), maximize=(), omitted=(), computed={}, units={})

    def beside(self, other: Formulation) -> Formulation:
        """Return it with the limits of another on other columns, normalised if both are.

        So a formulation adds to that of a file, or of a problem, without dropping its limits.

        Example:
            >>> of_file = Formulation(limits="mass<=50, x1>=2")
            >>> Formulation(limits={"mass": 30}).beside(of_file).limits
            {'mass': 30, 'x1': (2, None)}
        """
        limits = limits_of(other.limits) | limits_of(self.limits)
        return replace(self, limits=limits, normalize=self.normalize and other.normalize)

    def completed(self, other: Formulation, objectives: Names) -> Formulation:
        """Return it with what it leaves open, as the tests to which it applies have it.

        Without a chosen design it takes their choice and its reason, without positions or a
        decision of a group those of the tests. Fixed ranges that are None are
        those of the tests if the objectives are the same, else those of the Pareto set.

        Args:
            other: The formulation of the tests.
            objectives: Their objectives.

        Example:
            >>> fixed = Formulation(ranges={"f1": (0, 2), "f2": (0, 3)}, chosen="A")
            >>> Formulation().completed(fixed, ["f1", "f2"]) == fixed
            True
            >>> Formulation(["f1"]).completed(fixed, ["f1", "f2"]).ranges
            {}
        """
        changes: Values = {
            "positions": self.positions or other.positions,
            "decided": self.decided or other.decided,
        }
        if self.chosen is None:
            changes |= {"chosen": other.chosen, "reason": other.reason}
        if self.ranges is None:
            is_same = {*(self.objectives or objectives)} == {*objectives}
            changes["ranges"] = other.ranges if is_same else {}
        return replace(self, **changes)

    def to_json(self, path: FilePath) -> None:
        """Write the formulation as JSON, to be read by :meth:`read_json` or edited by hand.

        Raises:
            OSError: The file cannot be written.

        Example:
            >>> import os, tempfile
            >>> formulation = Formulation(maximize=["gain"], limits={"mass": (None, 30)})
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     formulation.to_json(os.path.join(folder, "formulation.json"))
            ...     print(Path(folder, "formulation.json").read_text())
            ...     Formulation.read_json(os.path.join(folder, "formulation.json")) == formulation
            {
             "maximize": ["gain"],
             "limits": {"mass": [null, 30]},
             "version": 1
            }
            <BLANKLINE>
            True
        """
        # One line for each attribute: short enough to be read, and to be edited by hand.
        lines = []
        for name, value in self._stated().items():
            text = json.dumps(value, ensure_ascii=False, allow_nan=False)
            lines.append(f'"{name}": {text}')
        lines.append(f'"version": {_VERSION}')
        content = ",\n ".join(lines)
        with whole_file(path) as file:
            file.write_text(f"{{\n {content}\n}}\n", encoding="utf-8")

    @classmethod
    def read_json(cls, path: FilePath) -> Formulation:
        """Read a formulation, or a decision that the page saved; the file may be untrusted.

        Raises:
            ArgumentValueError: The file is not a formulation, or an entry is not valid.
            OSError: The file cannot be opened.

        Example:
            >>> import os, tempfile
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = Path(folder, "formulation.json")
            ...     _ = path.write_text('{"computed": {"r": "mass / stress"}}')
            ...     Formulation.read_json(path).computed
            {'r': 'mass / stress'}
        """
        return cls.from_json(Path(path).read_bytes(), path)

    @classmethod
    def from_json(cls, content: bytes, where: object) -> Formulation:
        """Return the formulation in the content of such a file; ``where`` names it in messages.

        Raises:
            ArgumentValueError: It is no formulation.

        Example:
            >>> Formulation.from_json(b'{"limits": {"f1": 60}}', "a request").limits
            {'f1': 60}
        """
        try:
            entries = json.loads(
                content.decode("utf-8-sig"),
                object_pairs_hook=distinct,
                parse_constant=_number,
                parse_float=_number,
                parse_int=_number,
            )
            if not isinstance(entries, dict):
                raise invalid("it", "an object of JSON", entries)
            version = entries.pop("version", _VERSION)  # a file written by hand needs none
            if version != _VERSION:
                raise invalid("its version", f"{_VERSION}", version)
            for name in entries:
                known_name("an entry", name, ATTRIBUTES)
            return cls(**entries)
        except (ValueError, TypeError, RecursionError) as error:
            raise ArgumentValueError(
                f"{where} must be a formulation, as Formulation.to_json and 'Save decision' of the "
                f"page write it: {error}"
            ) from None


class _Position(msgspec.Struct, forbid_unknown_fields=True):
    """What somebody holds; see :attr:`Formulation.positions`."""

    name: Annotated[str, msgspec.Meta(min_length=1)]
    date: str = ""
    chosen: str | None = None
    limits: Values = {}
    weights: dict[str, Annotated[float, msgspec.Meta(ge=0)]] = {}
    aspiration: dict[str, float] = {}
    reason: str = ""


class _Decision(msgspec.Struct, forbid_unknown_fields=True):
    """The decision of a group; see :attr:`Formulation.decided`."""

    chosen: str
    date: str = ""
    agree: list[str] = []
    dissent: list[str] = []


def _checked(where: str, entries: Any, kind: Any) -> Values:
    """Return entries as a class has them, complete."""
    plain = msgspec.to_builtins(entries, enc_hook=lambda value: np.asarray(value).tolist())
    try:
        values: Values = msgspec.to_builtins(msgspec.convert(plain, kind))
    except msgspec.ValidationError as error:
        raise ArgumentValueError(f"{where}: {error}") from None
    return values


def _number(text: str) -> float:
    """Return a number of JSON, which is finite here."""
    number = float(text)
    if not np.isfinite(number):
        raise ValueError(f"{text:.20} is no finite number")
    return int(text) if text.lstrip("-").isdecimal() else number


ATTRIBUTES = [attribute.name for attribute in fields(Formulation)]


def formulated(
    formulation: Formulation, layout: Layout, columns: Columns
) -> tuple[Layout, Columns]:
    """Return the layout that a formulation gives a table, and its columns.

    Args:
        formulation: The formulation.
        layout: That of the table.
        columns: ``(n,)`` its columns, in the original direction.

    Raises:
        ArgumentValueError: A column is unknown, or cannot be used as stated.
    """
    whole = dict(columns)
    for name, text in formulation.computed.items():
        if name in whole or name in RESERVED:
            raise invalid("a name in computed", "unlike other columns", name)
        whole[name] = Expression.of(text).values(whole)
    objectives = tuple(formulation.objectives) or layout.objectives
    _check_names(formulation, layout, objectives, whole)
    for name in objectives:
        if name in layout.variables:  # other columns are of float64
            whole[name] = real_column(name, whole[name])
        if name in layout.equalities:
            whole[name] = np.abs(whole[name])
    return _formulated_layout(formulation, layout, objectives), whole


def _check_names(
    formulation: Formulation, layout: Layout, objectives: Names, columns: Columns
) -> None:
    """Refuse names of columns that are not there, and units that are not those of the table."""
    for name in objectives:
        known_name("objectives", name, columns)
    for name in formulation.maximize:
        known_name("maximize", name, objectives, "only objectives have a direction")
    for name in formulation.omitted:
        known_name("omitted", name, layout.constraints)
    for name, unit in formulation.units.items():
        known_name("units", name, columns)
        if layout.units.get(name, unit) != unit:
            raise invalid(
                f"the unit of {name!r}",
                f"that of the formulation, {unit}",
                layout.units[name],
                "convert its values",
            )


def _formulated_layout(
    formulation: Formulation, layout: Layout, objectives: tuple[str, ...]
) -> Layout:
    """Return the layout of a table under a formulation with these objectives."""
    changes: Values = {"objectives": objectives}
    without = {*objectives, *formulation.omitted}
    for group in ("variables", "inequalities", "equalities"):
        changes[group] = tuple(name for name in getattr(layout, group) if name not in without)
    # What was something else before becomes an output.
    taken = {*objectives, *changes["inequalities"], *changes["equalities"]}
    former = (*layout.outputs, *layout.objectives, *layout.constraints, *formulation.computed)
    changes["outputs"] = tuple(name for name in former if name not in taken)
    is_variable = [name not in without for name in layout.variables]
    return replace(
        layout,
        **changes,
        lower=layout.lower[is_variable],
        upper=layout.upper[is_variable],
        kinds=tuple(compress(layout.kinds, is_variable)),
        maximize=(*layout.maximize, *formulation.maximize),
        units={**layout.units, **formulation.units},
    )


# Limits: how they are written, and what they allow


def entries_of(texts: Names) -> list[str]:
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


def limits_of(limits: Any, argument: str = "limits") -> Values:
    """Return limits in any of their forms as a mapping from columns to numbers or pairs.

    Args:
        limits: A mapping, a text, a list of texts, or None for no limits.
        argument: What messages call it, such as ``--limits``.

    Returns:
        Numbers or pairs by column, with None for an open end; of columns of texts lists of the
        texts allowed.

    Raises:
        ArgumentValueError: A text is not a limit, one side of a column has two limits, or a number
            may have a point between thousands.
        ArgumentTypeError: It has none of these forms.

    Example:
        >>> limits_of("f1<=2.5, yield>=80, 1<=x1<=2")
        {'f1': (None, 2.5), 'yield': (80, None), 'x1': (1, 2)}
        >>> limits_of({"f1": 2.5, "yield": ">= 80"})
        {'f1': 2.5, 'yield': (80, None)}
        >>> limits_of("rail=yes, material in steel, alu, f1<=2")
        {'rail': ['yes'], 'material': ['steel', 'alu'], 'f1': (None, 2)}
    """
    if limits is None:
        return {}
    if isinstance(limits, str):
        limits = [limits]
    if isinstance(limits, (list, tuple)) and all(isinstance(text, str) for text in limits):
        limits = _limits_of_texts(limits, argument)
    rule = "columns to numbers, such as {'f1': 2.5}, or be texts such as 'f1<=2.5'"
    limit_by_column = {}
    for column, limit in mapping(argument, limits, rule).items():
        limit_by_column[column] = _normal(column, limit)
    return limit_by_column


def _normal(column: str, limit: Any) -> Any:
    """Return a limit as JSON can hold it: a number, a pair with None for an open end, or texts."""
    if isinstance(limit, str):
        if re.search("[<>=]", limit) is None:
            return [limit]
        sides = sides_of_text(f"{column!r} in limits", limit)
        return _normal(column, (sides.get(">="), sides.get("<=")))
    if is_of_texts(limit):
        return list(limit)
    lower, upper = (None if np.isinf(end) else plain_number(end) for end in ends(column, limit))
    if upper is None or isinstance(limit, (tuple, list)):
        return lower, upper
    return upper


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
        if side is None or side["sign"] in sides:
            raise invalid(argument, "such as '<= 250' or '>= 3, <= 250'", text)
        sides[side["sign"]] = finite_number(argument, float(side["number"]))
    return sides


def _limits_of_texts(texts: Names, argument: str) -> Values:
    limits: Values = {}
    listed: list[str] = []  # the texts of the entry before, if it is a list
    for entry in entries_of(texts):
        if listed and not _STATEMENT.search(entry):
            listed.append(entry)
            continue
        column, limit = _limit_of_entry(entry, argument)
        listed = []
        if "=" not in entry:  # column in text
            listed = limit
        match limits.get(column), limit:
            case None, _:
                limits[column] = limit
            case ((least, None), (None, greatest)) | ((None, greatest), (least, None)):
                limits[column] = (least, greatest)
            case _:
                raise invalid(argument, "given once for each side of a column", Received(entry))
    return limits


def _limit_of_entry(entry: str, argument: str) -> tuple[str, Any]:
    """Return the column of an entry, and the pair (least, greatest) or the list of one text."""
    match = _TEXTS.fullmatch(entry)
    if match is not None:
        return match["name"], [match["text"].strip()]
    match = _LIMIT.fullmatch(entry)
    # Two signs that state the same side are no limit, nor is the absence of both.
    if match is None or _TURNED.get(match["left"]) == match["right"]:
        raise invalid(
            argument,
            "of the form column<=number, number<=column<=number, column=text or "
            "column in text, text, joined by commas",
            Received(entry or "nothing"),
            "use <= or >=, plain numbers with a decimal point, and no units",
        )
    sides = {}
    if match["left"]:
        sides[_TURNED[match["left"]]] = _number_of_one_meaning(match["first"], entry, argument)
    if match["right"]:
        sides[match["right"]] = _number_of_one_meaning(match["last"], entry, argument)
    return match["name"], (sides.get(">="), sides.get("<="))


def _number_of_one_meaning(number: str, text: str, argument: str) -> float:
    """Return a number; one that people write for five and for five thousand alike is refused."""
    if _AMBIGUOUS.fullmatch(number):
        raise invalid(
            argument,
            "of numbers that can be read in one way",
            Received(f"{text}, whose point may be decimal or separate thousands"),
            f"write {number.replace('.', '')}, or one decimal more or less",
        )
    return finite_number(argument, float(number))


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
    values = []
    for value, unbounded in zip(pair, OPEN, strict=False):
        number = unbounded if value is None else value
        if isinstance(number, numbers.Real) and not isinstance(number, bool):
            values.append(float(number))
    if limit is None or len(pair) != 2 or len(values) != 2:
        raise wrong_type(f"{column!r} in limits", "a number or a pair (lower, upper)", limit)
    low, high = values
    # Not so of NaN either, nor of two infinite ends with one sign.
    if not (low <= high and low < np.inf and high > -np.inf):
        raise invalid(f"{column!r} in limits", "(lower, upper) in increasing order", limit)
    return low, high


def limits_on(limits: Limits | None, layout: Layout) -> dict[str, Allowed]:
    """Return what limits allow, numbers in the order of the table's columns and texts after them.

    Raises:
        ArgumentValueError: A column of numbers is unknown, is named twice, or is a constraint; a
            limit is NaN, its lower end is above the upper one, or it is unclear which end a number
            is.
        ArgumentTypeError: The limits have none of the forms that they may have.
    """
    free = [name for name in layout.columns if name not in layout.constraints]
    on_numbers = {}
    on_texts: dict[str, Allowed] = {}
    for name, limit in limits_of(limits).items():
        if isinstance(limit, list):
            on_texts[name] = limit
            continue
        remedy = ""
        if name in layout.constraints:
            remedy = "leave the constraint out by Formulation(omitted=...) to give it other limits"
        known_name("a name in limits", name, free, remedy)
        if name in layout.maximize and not isinstance(limit, tuple):
            remedy = f"say ({limit}, None) for at least or (None, {limit}) for at most"
            raise invalid(
                f"{name!r}, which is maximised, in limits",
                "a pair (lower, upper)",
                limit,
                remedy,
            )
        on_numbers[name] = ends(name, limit)
    # The order of the columns, not of the mapping: columns of violations stand in it.
    allowed: dict[str, Allowed] = {}
    for name in free:
        if on_numbers.get(name, OPEN) != OPEN:
            allowed[name] = on_numbers[name]
    return allowed | on_texts


def limit_text(name: str, limit: Any) -> str:
    """Return a limit in its written form, which :func:`limits_of` reads.

    It cannot read a list without texts, nor names and texts that contain < > or =.

    Example:
        >>> limit_text("mass", 30.0), limit_text("width", (0.25, 1.125)), limit_text("time, s", 5.0)
        ('mass<=30', '0.25<=width<=1.1250', '"time, s<=5"')
        >>> limit_text("rail", ["yes"]), limit_text("material", ["steel", "alu"])
        ('rail=yes', 'material in steel, alu')
    """
    if is_of_texts(limit):
        if len(limit) == 1:
            return _entry(f"{name}={limit[0]}")
        first, *others = limit or ["nothing"]
        return ", ".join(map(_entry, [f"{name} in {first}", *others]))
    lower, upper = ends(name, limit)
    if upper == np.inf:
        return _entry(f"{name}>={_digits(lower)}")
    if lower == -np.inf:
        return _entry(f"{name}<={_digits(upper)}")
    return _entry(f"{_digits(lower)}<={name}<={_digits(upper)}")


def _entry(text: str) -> str:
    """Return a text as an entry of a list, which :func:`entries_of` reads."""
    if "," not in text:
        return text
    doubled = text.replace('"', '""')
    return f'"{doubled}"'


def _digits(number: float) -> str:
    """Return a number as it is written in a limit, where its point is a decimal one."""
    text = str(plain_number(number))
    if _AMBIGUOUS.fullmatch(text):
        text += "0"
    return text


def plain_number(value: float) -> float:
    """Return a number as an integer where that is the same, so that files and names have 30."""
    # Beyond 2^53 not every integer is a float64, and digits would be shown that are not there.
    if value.is_integer() and abs(value) < 2**53:
        return int(value)
    return value
