"""What is asked of tests: objectives, directions, limits, constraints that hold, computed columns.

In Parameter Space Investigation the problem is formulated after the tests, and often anew
(Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995, Chapter 1): a limit was
too tight, an objective was forgotten, a constraint turns out to be negotiable.

A computed column may be a text such as ``mass / (width * height)``. All names and numbers of it are
replaced by placeholders, what remains may hold sums, products, powers and calls of known functions
only, and Python computes that with these placeholders as the only names: a text from an untrusted
file runs nothing else. All numbers are float64, whose powers take no time.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache, reduce
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._output import whole_file
from pymoo_psi._validation import Received, boolean, instance, invalid, known_name, wrong_type
from pymoo_psi._validation import mapping as mapping_of
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table._designs import real_column
from pymoo_psi.table._layout import (
    RESERVED,
    Layout,
    Limit,
    bounds_of,
    column_names,
    ends,
    unit_texts,
)

Columns: TypeAlias = Mapping[str, NDArray[Any]]
Array = NDArray[np.float64]


def _least(*values: Any) -> Any:
    return reduce(np.minimum, values)


def _greatest(*values: Any) -> Any:
    return reduce(np.maximum, values)


# Not fmin and fmax, which would pass over a NaN and make a number of what is not known.
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": np.abs, "sqrt": np.sqrt, "exp": np.exp,
    "log": np.log, "log2": np.log2, "log10": np.log10,
    "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "min": _least, "max": _greatest,
}  # fmt: skip
_ARITHMETIC = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.Call, ast.Name, ast.Load,
    ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.UAdd, ast.USub,
)  # fmt: skip
_CONSTANTS = {"pi": np.pi}
_OPERAND = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[^\W\d]\w*)|`(?P<quoted>(?:[^`]|``)+)`"
)
_MARKS = re.compile(r"[_0-9*+\-/(),\s]*")


@dataclass(frozen=True)
class Formulation:
    """A formulation of a problem, applied to tests by :meth:`TestTable.under`.

    All columns are named, and all values are in the original direction. What is not said stays as
    the table has it: the objectives, their directions, and the constraints.

    Attributes:
        objectives: Names of the objectives: any columns of numbers, the table's unless given. A
            variable or a constraint among them is one no more (an equality counts by its absolute
            value). The table's other objectives become outputs.
        maximize: Objectives to be maximised, beside those of which the table says so.
        limits: Limits on objectives, variables and outputs, ``(lower, upper)`` with ``None`` for an
            open end; a number is an upper limit. Each becomes an inequality constraint, such as
            ``mass<=30`` with the value mass - 30.
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
            those of the Pareto set; None: as the table has it.
        chosen: Name of the chosen design, as in :attr:`TestTable.names`; None if none is chosen.
        reason: Why it was chosen.
        page: What else the decision page showed; changes no decision.

    Raises:
        ArgumentValueError: A name is given twice, a limit is none, or an
            expression cannot be read.
        ArgumentTypeError: A name is not text, a limit not of numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[1.0], [2.0], [4.0]], [[3.0, 6], [2, 2], [1, 4]])
        >>> asked = Formulation(
        ...     objectives=["f1", "ratio"], limits={"x1": (None, 3)}, computed={"ratio": "f2 / f1"})
        >>> print(table.under(asked).to_frame()[["f1", "ratio", "status", "violated"]])
                     f1  ratio      status violated
        test_point
        1           3.0    2.0          ok
        2           2.0    1.0          ok
        3           1.0    4.0  infeasible    x1<=3
    """

    objectives: Sequence[str] = ()
    maximize: Sequence[str] = ()
    limits: Mapping[str, Limit] = field(default_factory=dict)
    relaxed: Sequence[str] = ()
    computed: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    normalize: bool = True
    ranges: Mapping[str, Sequence[float]] | None = None
    chosen: str | None = None
    reason: str = ""
    page: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check what can be checked without a table, and take copies."""
        for group in ("objectives", "maximize", "relaxed"):
            names = column_names(group, getattr(self, group))
            if twice := [name for name in names if names.count(name) > 1]:
                raise invalid(group, "columns that are named once", twice[0])
            object.__setattr__(self, group, names)
        for group in ("limits", "computed", "page"):
            entries = mapping_of(group, getattr(self, group), "columns to values")
            column_names(group, tuple(entries))
            object.__setattr__(self, group, dict(entries))
        limits = {name: _plain(name, limit) for name, limit in self.limits.items()}
        object.__setattr__(self, "limits", limits)
        if self.ranges is not None:
            given = mapping_of("ranges", self.ranges, "objectives to pairs (lower, upper)")
            object.__setattr__(self, "ranges", {n: [*ends(n, pair)] for n, pair in given.items()})
        object.__setattr__(self, "units", unit_texts(self.units))
        for text in self.computed.values():
            Expression.of(text)
        boolean("normalize", self.normalize)
        instance("chosen", self.chosen or "", str)
        instance("reason", self.reason, str)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns that it uses, apart from those that it computes.

        Example:
            >>> Formulation(["mass", "r"], limits={"x1": 3}, computed={"r": "f2 / f1"}).columns
            ('mass', 'x1', 'f2', 'f1')
        """
        used = [*self.objectives, *self.maximize, *self.relaxed, *self.limits]
        for text in self.computed.values():
            used += Expression.of(text).columns
        return tuple(name for name in dict.fromkeys(used) if name not in self.computed)

    def to_json(self, path: str | PathLike[str]) -> None:
        """Write the formulation as JSON, which :meth:`read_json` reads and hands can edit.

        Raises:
            OSError: The file cannot be written.

        Example:
            >>> import os, tempfile
            >>> asked = Formulation(maximize=["gain"], limits={"mass": (None, 30)})
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     asked.to_json(os.path.join(folder, "asked.json"))
            ...     print(Path(folder, "asked.json").read_text())
            ...     Formulation.read_json(os.path.join(folder, "asked.json")) == asked
            {
             "maximize": ["gain"],
             "limits": {"mass": [null, 30]}
            }
            <BLANKLINE>
            True
        """
        blank, content = Formulation(), {f.name: getattr(self, f.name) for f in fields(self)}
        said = {name: value for name, value in content.items() if value != getattr(blank, name)}
        # One line for each attribute: short enough to be read, and to be edited by hand.
        texts = {n: json.dumps(v, ensure_ascii=False, allow_nan=False) for n, v in said.items()}
        lines = ",\n ".join(f'"{name}": {text}' for name, text in texts.items())
        with whole_file(path) as written:
            written.write_text(f"{{\n {lines}\n}}\n", encoding="utf-8")

    @classmethod
    def read_json(cls, path: str | PathLike[str]) -> Formulation:
        """Read a formulation, or a decision that the page saved; the file may be untrusted.

        Raises:
            ArgumentValueError: The file is no formulation, or what it says is none.
            OSError: The file cannot be opened.

        Example:
            >>> import os, tempfile
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = Path(folder, "asked.json")
            ...     _ = path.write_text('{"computed": {"r": "mass / stress"}}')
            ...     Formulation.read_json(path).computed
            {'r': 'mass / stress'}
        """
        content = Path(path).read_bytes()
        try:
            found = json.loads(
                content.decode("utf-8-sig"), object_pairs_hook=distinct, parse_constant=_no_number
            )
            if not isinstance(found, dict):
                raise invalid("it", "an object of JSON", found)
            for key in found:
                known_name("an entry", key, [f.name for f in fields(cls)])
            return cls(**found)
        except (ValueError, TypeError, RecursionError) as error:
            made = "as Formulation.to_json and 'Save decision' of the page write it"
            raise ArgumentValueError(f"{path} must be a formulation, {made}: {error}") from None


def formulated(
    formulation: Formulation, layout: Layout, columns: Columns
) -> tuple[Layout, dict[str, NDArray[Any]], tuple[str, ...]]:
    """Return the layout that a formulation gives a table, its columns, and which are limits.

    Args:
        formulation: What is asked.
        layout: That of the table.
        columns: ``(n,)`` its columns, in the original direction.

    Raises:
        ArgumentValueError: A column is not there, or cannot be what is asked of it.
    """
    whole = dict(columns)
    for name, text in formulation.computed.items():
        if name in whole or name in RESERVED:
            raise invalid("a computed column", "named unlike other columns", name)
        whole[name] = Expression.of(text).values(whole)
    objectives = tuple(formulation.objectives) or layout.objectives
    for name in objectives:
        known_name("objectives", name, whole)
        if name in layout.variables:  # other columns are of float64
            whole[name] = real_column(name, whole[name])
    for name in formulation.maximize:
        known_name("maximize", name, objectives, "only objectives have a direction")
    for name in formulation.relaxed:
        known_name("relaxed", name, layout.constraints)
    for name, unit in formulation.units.items():
        known_name("units", name, whole)
        if layout.units.get(name, unit) != unit:
            rule = f"that of the decision, {unit}"
            raise invalid(f"the unit of {name!r}", rule, layout.units[name], "convert its values")
    for name in set(objectives).intersection(layout.equalities):
        whole[name] = np.abs(whole[name])
    gone = {*objectives, *formulation.relaxed}
    kept = [j for j, name in enumerate(layout.variables) if name not in gone]
    inequalities, equalities = (
        tuple(name for name in group if name not in gone)
        for group in (layout.inequalities, layout.equalities)
    )
    former = (*layout.outputs, *layout.objectives, *layout.constraints, *formulation.computed)
    outputs = tuple(n for n in former if n not in (*objectives, *inequalities, *equalities))
    more = {*layout.maximize, *formulation.maximize}
    own = {} if {*objectives} ^ {*layout.objectives} else layout.ranges
    asked = replace(
        layout,
        variables=tuple(layout.variables[j] for j in kept),
        objectives=objectives,
        inequalities=inequalities,
        equalities=equalities,
        outputs=outputs,
        lower=layout.lower[kept],
        upper=layout.upper[kept],
        kinds=tuple(layout.kinds[j] for j in kept) if layout.kinds else (),
        maximize=tuple(name for name in (*objectives, *outputs) if name in more),
        units={**layout.units, **formulation.units},
        ranges=own if formulation.ranges is None else formulation.ranges,
    )
    limits = {}
    for name, (low, high) in bounds_of(formulation.limits, asked).items():
        values = real_column(name, whole[name])
        # NaN violates a constraint: a value that is not finite keeps no limit, see `within`.
        values = np.where(np.isfinite(values), values, np.nan)
        with np.errstate(over="ignore"):  # an infinite excess has the right sign
            # Differences of float64 have the sign of the comparison: gradual underflow sees to it.
            for sign, end, over in ((">=", low, low - values), ("<=", high, values - high)):
                if np.isfinite(end):
                    limits[f"{name}{sign}{_whole(end)}"] = over
    asked = replace(asked, inequalities=(*inequalities, *limits))
    return asked, whole | limits, tuple(limits)


def _plain(name: str, limit: Any) -> Any:
    """Return a limit as a number or pair that JSON can hold; an open end is None."""
    low, high = ends(name, limit)
    if low == np.inf or high == -np.inf:
        raise invalid(f"the limit on {name!r}", "one that a number can keep", limit)
    shown = tuple(None if np.isinf(end) else _whole(end) for end in (low, high))
    return shown if isinstance(limit, (tuple, list)) or high == np.inf else shown[1]


def _whole(value: float) -> float:
    """Return a number as an integer where that is the same, so that files and names have 30."""
    # Beyond 2^53 not every integer is a float64, and digits would be shown that are not there.
    return int(value) if value.is_integer() and abs(value) < 2**53 else value


def _no_number(word: str) -> Any:
    raise ValueError(f"{word} is no number of JSON")


def distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the entries of an object; of two with one name JSON would keep the last in silence."""
    entries = dict(pairs)
    if len(entries) < len(pairs):
        raise ValueError("a name occurs twice")
    return entries


# Expressions


@dataclass(frozen=True)
class Expression:
    """An arithmetic expression of columns.

    Attributes:
        text: As it was written.
        plain: The same with placeholders ``_0``, ``_1``, … for numbers and names.
        operands: What these stand for: numbers, names of columns or constants, and functions.
    """

    text: str
    plain: str
    operands: tuple[float | str | Callable[..., Any], ...]

    @classmethod
    def of(cls, text: str) -> Expression:
        """Return the expression of a text.

        Args:
            text: Numbers with a decimal point; columns by their names, in backquotes where these
                are not of letters, digits and ``_``; ``+ - * / **`` and parentheses; abs, sqrt,
                exp, log (natural), log2, log10, sin, cos, tan (of radians), asin, acos, atan,
                sinh, cosh, tanh, min, max; pi.

        Raises:
            ArgumentValueError: It is no such text, or nested too deep.
            ArgumentTypeError: It is no text.
        """
        if not isinstance(text, str):
            raise wrong_type("an expression", "text", text)
        operands: list[Any] = []

        def placeholder(found: re.Match[str]) -> str:
            quoted = (found["quoted"] or "").replace("``", "`")
            operands.append(float(found["number"]) if found["number"] else found["name"] or quoted)
            return f" _{len(operands) - 1} "

        plain = " ".join(_OPERAND.sub(placeholder, text).split())
        try:
            tree = ast.parse(plain if _MARKS.fullmatch(plain) else "", mode="eval")
            nodes = [*ast.walk(tree)]
            if not all(isinstance(node, _ARITHMETIC) for node in nodes):
                raise SyntaxError
            for call in (node for node in nodes if isinstance(node, ast.Call)):
                k, count = int(ast.unparse(call.func)[1:]), len(call.args)
                name = known_name("a function of an expression", operands[k], _FUNCTIONS)
                if (count > 1) != (name in ("min", "max")) or not count:
                    rule = "of two values or more" if name in ("min", "max") else "of one value"
                    raise invalid(f"{name}() of an expression", rule, Received(count))
                operands[k] = _FUNCTIONS[name]
            _code(plain)
        except ArgumentValueError:
            raise
        except (SyntaxError, ValueError, RecursionError, MemoryError):  # the last two: nested deep
            rule = "arithmetic of columns, such as 'mass / (width * height)'"
            remedy = "powers are width**2, names of other than letters, digits and _ in backquotes"
            raise invalid("an expression", rule, text, remedy) from None
        return cls(text, plain, tuple(operands))

    @property
    def columns(self) -> list[str]:
        """The names in it, but for those of constants."""
        return [name for name in self.operands if isinstance(name, str) and name not in _CONSTANTS]

    def values(self, columns: Mapping[str, NDArray[Any]]) -> Array:
        """Return the ``(n,)`` values; NaN or infinite where there is no finite one.

        Args:
            columns: ``(n,)`` each, by name; a column goes before a constant of its name.

        Raises:
            ArgumentValueError: There is no such column.
            ArgumentTypeError: A column holds no numbers.
        """
        names: dict[str, Any] = {"__builtins__": {}}
        for k, operand in enumerate(self.operands):
            value: Any = operand
            if isinstance(operand, float):
                value = np.float64(operand)
            elif isinstance(operand, str) and operand in _CONSTANTS and operand not in columns:
                value = np.float64(_CONSTANTS[operand])
            elif isinstance(operand, str):
                known_name(f"a column of {self.text!r:.60}", operand, columns)
                value = real_column(operand, columns[operand])
            names[f"_{k}"] = value
        # Division by zero, logarithms below zero and overflow show in the values.
        with np.errstate(all="ignore"):
            result = eval(_code(self.plain), names)  # arithmetic alone, see `of`
        return np.array(np.broadcast_to(result, len(next(iter(columns.values()), ()))), np.float64)


@lru_cache(maxsize=256)
def _code(plain: str) -> Any:
    return compile(plain, "an expression", "eval")
