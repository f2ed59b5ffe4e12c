"""What is asked of tests: objectives, directions, limits, constraints that hold, computed columns.

In Parameter Space Investigation the problem is formulated after the tests, and often anew
(Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995, Chapter 1): a limit was
too tight, an objective was forgotten, a constraint turns out to be negotiable.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import compress
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias, TypedDict

import numpy as np

from pymoo_psi._output import whole_file
from pymoo_psi._validation import (
    AnyArray,
    Received,
    boolean,
    collection,
    distinct,
    finite_number,
    flat,
    instance,
    invalid,
    known_name,
)
from pymoo_psi._validation import mapping as mapping_of
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table._designs import real_column
from pymoo_psi.table._expression import Expression
from pymoo_psi.table._layout import RESERVED, Layout, column_names, unit_texts
from pymoo_psi.table._limits import Limits, allowed_by, ends, is_of_texts, limits_of, plain_number

Columns: TypeAlias = Mapping[str, AnyArray]

_VERSION = 2  # of the file; 1 had no positions
_NO_POSITION: dict[str, Any] = {
    "name": "",
    "date": "",
    "chosen": None,
    "limits": {},
    "weights": {},
    "aspiration": {},
    "reason": "",
}


class FormulationFields(TypedDict, total=False):
    """The attributes of a :class:`Formulation`, as arguments."""

    objectives: Sequence[str]
    maximize: Sequence[str]
    limits: Limits | None
    relaxed: Sequence[str]
    computed: Mapping[str, str]
    units: Mapping[str, str]
    normalize: bool
    ranges: Mapping[str, Sequence[float]] | None
    chosen: str | None
    reason: str
    positions: Sequence[Mapping[str, Any]]
    decided: Mapping[str, Any] | None
    page: Mapping[str, Any]


@dataclass(frozen=True)
class Formulation:
    """A formulation of a problem, applied to tests by :meth:`TestTable.under`.

    All columns are named, and all values are in the original direction. What is not said stays as
    the table has it: the objectives, their directions, and the constraints.

    Attributes:
        objectives: Names of the objectives: any columns of numbers, the table's unless given. A
            variable or constraint named here becomes an objective only (an equality counts by its
            absolute value). The table's other objectives become outputs.
        maximize: Objectives to be maximised, beside those of which the table says so.
        limits: Limits on objectives, variables and outputs by name, in the original direction,
            ``{"mass": 30, "width": (0.2, 0.4), "gain": (0.9, None)}``: at most 30, from 0.2 to
            0.4, and at least 0.9. A number is the greatest value allowed; for a maximised
            objective it is refused, as it could mean either. On columns of texts, the text allowed
            or a list: ``{"rail": "yes", "material": ["steel", "alu"]}``. Or texts,
            ``"mass<=30, gain>=0.9, rail=yes, material in steel, alu"``.
        relaxed: Constraints that are left out and become outputs; another bound than theirs is a
            limit on such a column.
        computed: Further columns by name, each an expression of others, such as
            ``"mass / stress"``. Each may use those before it. Names of other than letters, digits
            and ``_`` stand in backquotes; an expression knows + - * / ** and parentheses, abs,
            sqrt, exp, log (natural), log2, log10, sin, cos, tan (of radians), asin, acos, atan,
            sinh, cosh, tanh, min, max and pi, and nothing of Python.
        units: Units of columns by name, those of the limits, too; a table that has a column in
            another unit is refused.
        normalize: Whether designs are ranked in units of the objectives' ranges.
        ranges: The ranges ``(lower, upper)`` of all objectives, fixed whatever the limits; empty:
            those of the Pareto set; None: as the table has it. Equal ends are refused for an
            objective in which designs differ.
        chosen: Name of the chosen design, as in :attr:`TestTable.names`; None if none is chosen.
        reason: Why it was chosen.
        positions: What people hold, one mapping for each person and date: ``name``; ``date``, as
            ISO 8601 has it, or empty; ``chosen``, the name of a design or None; ``limits``,
            ``weights`` and ``aspiration`` of objectives by name; ``reason``. Under one name they
            are a history.
        decided: The decision of a group, None if there is none: ``date``; ``chosen``, the name of
            a design; ``agree`` and ``dissent``, lists of names.
        page: What else the decision page showed; changes no decision.

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

    objectives: Sequence[str] = ()
    maximize: Sequence[str] = ()
    limits: Limits | None = field(default_factory=dict)
    relaxed: Sequence[str] = ()
    computed: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    normalize: bool = True
    ranges: Mapping[str, Sequence[float]] | None = None
    chosen: str | None = None
    reason: str = ""
    positions: Sequence[Mapping[str, Any]] = ()
    decided: Mapping[str, Any] | None = None
    page: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check what can be checked without a table, and take copies."""
        for group in ("objectives", "maximize", "relaxed"):
            names = column_names(group, getattr(self, group))
            for name in names:
                if names.count(name) > 1:
                    raise invalid(group, "columns that are named once", name)
            self._set(group, names)
        for group in ("computed", "page"):
            entries = mapping_of(group, getattr(self, group), "columns to values")
            column_names(group, tuple(entries))
            self._set(group, dict(entries))
        limits = limits_of(self.limits)
        if "state" in self.page:  # former pages had limits on texts there
            state = dict(mapping_of("page.state", self.page["state"], "settings to values"))
            categories = state.pop("categories", {})
            texts = mapping_of("page.state.categories", categories, "columns to lists")
            limits = {**texts, **limits}
            self._set("page", {**self.page, "state": state})
        column_names("limits", tuple(limits))
        self._set("limits", {name: _json_limit(name, limit) for name, limit in limits.items()})
        if self.ranges is not None:
            pairs = mapping_of("ranges", self.ranges, "objectives to pairs (lower, upper)")
            ranges = {name: [*ends(name, pair)] for name, pair in pairs.items()}
            for name, pair in ranges.items():
                if not np.isfinite(pair).all():
                    raise invalid(f"the range of {name!r}", "of two finite numbers", pair)
            self._set("ranges", ranges)
        self._set("units", unit_texts(self.units))
        for text in self.computed.values():
            Expression.of(text)
        boolean("normalize", self.normalize)
        if self.chosen is not None:
            instance("chosen", self.chosen, str)
        instance("reason", self.reason, str)
        rule = "a list of mappings, one for each person and date"
        positions = [_position(one) for one in collection("positions", self.positions, rule)]
        self._set("positions", sorted(positions, key=lambda one: str(one["date"])))
        if self.decided is not None:
            self._set("decided", _decided(self.decided))

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of numbers that it uses, apart from those that it computes.

        Example:
            >>> Formulation(["mass", "r"], limits={"x1": 3}, computed={"r": "f2 / f1"}).columns
            ('mass', 'x1', 'f2', 'f1')
        """
        names = [*self.objectives, *self.maximize, *self.relaxed]
        for name, limit in limits_of(self.limits).items():
            if not is_of_texts(limit):
                names.append(str(name))
        for text in self.computed.values():
            names += Expression.of(text).columns
        return tuple(name for name in dict.fromkeys(names) if name not in self.computed)

    def without_columns(self) -> Formulation:
        """Return it without what names or computes columns, for a table that has them already.

        Example:
            >>> Formulation(["mass", "gain"], limits={"mass": 30}).without_columns().objectives
            ()
        """
        return replace(self, objectives=(), maximize=(), relaxed=(), computed={}, units={})

    def to_json(self, path: str | PathLike[str]) -> None:
        """Write the formulation as JSON, which :meth:`read_json` reads and hands can edit.

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
             "limits": {"mass": [null, 30]}
            }
            <BLANKLINE>
            True
        """
        default = Formulation()
        # One line for each attribute: short enough to be read, and to be edited by hand.
        lines = []
        for name in ATTRIBUTES:
            value = getattr(self, name)
            if value != getattr(default, name):
                text = json.dumps(value, ensure_ascii=False, allow_nan=False)
                lines.append(f'"{name}": {text}')
        if self.positions or self.decided:
            lines.append(f'"version": {_VERSION}')
        content = ",\n ".join(lines)
        with whole_file(path) as file:
            file.write_text(f"{{\n {content}\n}}\n", encoding="utf-8")

    @classmethod
    def read_json(cls, path: str | PathLike[str]) -> Formulation:
        """Read a formulation, or a decision that the page saved; the file may be untrusted.

        Raises:
            ArgumentValueError: The file is no formulation, or what it says is none.
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
                parse_constant=_no_number,
            )
            if not isinstance(entries, dict):
                raise invalid("it", "an object of JSON", entries)
            version = entries.pop("version", 1)
            if version not in range(1, _VERSION + 1):
                remedy = "a newer pymoo-psi reads it"
                raise invalid("its version", f"1 to {_VERSION}", version, remedy)
            for name in entries:
                known_name("an entry", name, ATTRIBUTES)
            for place, text in flat(entries).items():
                if re.fullmatch(r"-?(Infinity|\d{309,})", text):  # 1e400, and its digits
                    raise invalid(place, "a number below 1e308", Received(text))
            return cls(**entries)
        except (ValueError, TypeError, RecursionError) as error:
            raise ArgumentValueError(
                f"{where} must be a formulation, as Formulation.to_json and 'Save decision' of the "
                f"page write it: {error}"
            ) from None


def _position(entries: Any) -> dict[str, Any]:
    """Return a position of somebody, checked and complete."""
    what = "name, date, chosen, limits, weights, … to values"
    whole = {**_NO_POSITION, **mapping_of("a position", entries, what)}
    for key in whole:
        known_name("an entry of a position", key, _NO_POSITION)
    _require_texts("of a position", whole, ("name", "date", "reason"))
    if not whole["name"]:
        raise invalid("the name of a position", "a text that is not empty", "")
    if whole["chosen"] is not None:
        _require_texts("of a position", whole, ("chosen",))
    limits = limits_of(whole["limits"], "the limits of a position")
    whole["limits"] = {name: _json_limit(name, limit) for name, limit in limits.items()}
    for key in ("weights", "aspiration"):
        numbers = mapping_of(f"the {key} of a position", whole[key], "objectives to numbers")
        whole[key] = {}
        for name, value in numbers.items():
            number = finite_number(f"the {key} of {name!r} in a position", value)
            if key == "weights" and number < 0:
                raise invalid(f"the weight of {name!r} in a position", "0 or more", value)
            whole[key][name] = number
    return whole


def _decided(entries: Any) -> dict[str, Any]:
    """Return the decision of a group, checked."""
    keys = ("date", "chosen", "agree", "dissent")
    given = dict(mapping_of("decided", entries, "date, chosen, agree and dissent to values"))
    if {*given} != {*keys}:
        raise invalid("decided", f"of the entries {', '.join(keys)}", [*given])
    _require_texts("in decided", given, ("date", "chosen"))
    for key in ("agree", "dissent"):
        given[key] = [*column_names(f"decided[{key!r}]", given[key])]
    return given


def _require_texts(where: str, entries: Mapping[str, Any], keys: Sequence[str]) -> None:
    for key in keys:
        instance(f"the {key} {where}", entries[key], str)


ATTRIBUTES = [attribute.name for attribute in fields(Formulation)]


def formulated(
    formulation: Formulation, layout: Layout, columns: Columns
) -> tuple[Layout, dict[str, AnyArray]]:
    """Return the layout that a formulation gives a table, and its columns.

    Args:
        formulation: The formulation.
        layout: That of the table.
        columns: ``(n,)`` its columns, in the original direction.

    Raises:
        ArgumentValueError: A column is not there, or cannot be what it is named for.
    """
    whole = dict(columns)
    for name, text in formulation.computed.items():
        if name in whole or name in RESERVED:
            raise invalid("a computed column", "named unlike other columns", name)
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
    formulation: Formulation, layout: Layout, objectives: Sequence[str], columns: Columns
) -> None:
    """Refuse names of columns that are not there, and units that are not those of the table."""
    for name in objectives:
        known_name("objectives", name, columns)
    for name in formulation.maximize:
        known_name("maximize", name, objectives, "only objectives have a direction")
    for name in formulation.relaxed:
        known_name("relaxed", name, layout.constraints)
    for name, unit in formulation.units.items():
        known_name("units", name, columns)
        if layout.units.get(name, unit) != unit:
            raise invalid(
                f"the unit of {name!r}",
                f"that of the decision, {unit}",
                layout.units[name],
                "convert its values",
            )


def _formulated_layout(
    formulation: Formulation, layout: Layout, objectives: tuple[str, ...]
) -> Layout:
    """Return the layout of a table under a formulation with these objectives."""
    without = {*objectives, *formulation.relaxed}
    kept = [name not in without for name in layout.variables]
    inequalities = tuple(name for name in layout.inequalities if name not in without)
    equalities = tuple(name for name in layout.equalities if name not in without)
    # What was something else before becomes an output.
    taken = {*objectives, *inequalities, *equalities}
    former = (*layout.outputs, *layout.objectives, *layout.constraints, *formulation.computed)
    outputs = tuple(name for name in former if name not in taken)
    maximized = {*layout.maximize, *formulation.maximize}
    return replace(
        layout,
        variables=tuple(compress(layout.variables, kept)),
        objectives=objectives,
        inequalities=inequalities,
        equalities=equalities,
        outputs=outputs,
        lower=layout.lower[kept],
        upper=layout.upper[kept],
        kinds=tuple(compress(layout.kinds, kept)),
        maximize=tuple(name for name in (*objectives, *outputs) if name in maximized),
        units={**layout.units, **formulation.units},
    )


def _json_limit(name: Any, limit: Any) -> Any:
    """Return a limit as a number, pair or list of texts that JSON can hold; an open end is None."""
    allowed = allowed_by(name, limit)
    if isinstance(allowed, list):
        return allowed
    low, high = allowed
    lower = None if np.isinf(low) else plain_number(low)
    upper = None if np.isinf(high) else plain_number(high)
    if isinstance(limit, (tuple, list)) or upper is None:
        return lower, upper
    return upper


def _no_number(word: str) -> Any:
    raise ValueError(f"{word} is no number of JSON")
