"""Arithmetic expressions of columns, such as ``mass / (width * height)``; a text may be untrusted.

All names and numbers of a text are replaced by placeholders. What remains may hold sums, products,
powers and calls of known functions only, and Python computes that with these placeholders as the
only names: a text runs nothing else. All numbers are float64, whose powers take no time.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any

import numpy as np

from pymoo_psi._validation import (
    AnyArray,
    Array,
    Received,
    Values,
    finite_number,
    instance,
    invalid,
    known_name,
)
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table._cells import real_column


def _least(*values: Any) -> Any:
    return reduce(np.minimum, values)


def _greatest(*values: Any) -> Any:
    return reduce(np.maximum, values)


# Not fmin and fmax, which would pass over a NaN and make a number of what is not known.
_OF_NUMPY = ("abs", "sqrt", "exp", "log", "log2", "log10", "sin", "cos", "tan")
_HYPERBOLIC = ("sinh", "cosh", "tanh")
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in (*_OF_NUMPY, *_HYPERBOLIC)},
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "min": _least,
    "max": _greatest,
}
_OF_SEVERAL = ("min", "max")
_ARITHMETIC = (
    ast.Expression,
    ast.BinOp,
    ast.UnaryOp,
    ast.Call,
    ast.Name,
    ast.Load,
    ast.Add,
    ast.Sub,
    ast.Mult,
    ast.Div,
    ast.Pow,
    ast.UAdd,
    ast.USub,
)
_CONSTANTS = {"pi": np.array(np.pi)}
_OPERAND = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[^\W\d]\w*)|`(?P<quoted>(?:[^`]|``)+)`"
)
_PLACEHOLDERS = re.compile(r"[_0-9*+\-/(),\s]*")


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
            ArgumentTypeError: It is not a text.
        """
        instance("an expression", text, str)
        plain, operands = _with_placeholders(text)
        try:
            _put_functions(operands, plain)
            _code(plain)
        except ArgumentValueError:
            raise
        # The last two are raised if it is nested deeply.
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise invalid(
                "an expression",
                "arithmetic of columns, such as 'mass / (width * height)'",
                text,
                "powers are width**2, names of other than letters, digits and _ in backquotes",
            ) from None
        return cls(text, plain, tuple(operands))

    @property
    def columns(self) -> list[str]:
        """The names in it, but for those of constants."""
        names = [operand for operand in self.operands if isinstance(operand, str)]
        return [name for name in names if name not in _CONSTANTS]

    def values(self, columns: Mapping[str, AnyArray]) -> Array:
        """Return the ``(n,)`` values; NaN or infinite where there is no finite one.

        Args:
            columns: ``(n,)`` each, by name; a column goes before a constant of its name.

        Raises:
            ArgumentValueError: There is no such column.
            ArgumentTypeError: A column does not hold numbers.
        """
        known = {**_CONSTANTS, **columns}
        values: Values = {"__builtins__": {}}
        for k, operand in enumerate(self.operands):
            values[f"_{k}"] = operand
            if isinstance(operand, str):
                if operand not in known:
                    known_name(f"a column of {self.text!r:.60}", operand, columns)
                values[f"_{k}"] = real_column(operand, known[operand])
        # Division by zero, logarithms below zero and overflow show in the values.
        with np.errstate(all="ignore"):
            result = eval(_code(self.plain), values)  # arithmetic alone, see `of`
        n = len(next(iter(columns.values()), ()))
        return np.array(np.broadcast_to(result, n), np.float64)


def _with_placeholders(text: str) -> tuple[str, list[Any]]:
    """Return a text with placeholders for numbers and names, and what they stand for."""
    operands: list[Any] = []

    def placeholder(match: re.Match[str]) -> str:
        if match["number"]:
            number = finite_number("a number of an expression", float(match["number"]))
            operands.append(np.float64(number))
        elif match["name"]:
            operands.append(match["name"])
        else:
            operands.append(match["quoted"].replace("``", "`"))
        return f" _{len(operands) - 1} "

    plain = " ".join(_OPERAND.sub(placeholder, text).split())
    return plain, operands


def _put_functions(operands: list[Any], plain: str) -> None:
    """Replace the names of functions among the operands of a text of placeholders by these.

    Raises:
        SyntaxError: The text holds more than arithmetic and calls.
        ArgumentValueError: There is no such function, or it takes another number of values.
    """
    if not _PLACEHOLDERS.fullmatch(plain):
        raise SyntaxError
    nodes = [*ast.walk(ast.parse(plain, mode="eval"))]
    if not all(isinstance(node, _ARITHMETIC) for node in nodes):
        raise SyntaxError
    for node in nodes:
        if not isinstance(node, ast.Call):
            continue
        k = int(ast.unparse(node.func)[1:])
        name = known_name("a function of an expression", operands[k], _FUNCTIONS)
        count = len(node.args)
        if count == 0 or (count > 1) != (name in _OF_SEVERAL):
            raise invalid(
                f"{name}() of an expression",
                "of one value, min and max of two values or more",
                Received(count),
            )
        operands[k] = _FUNCTIONS[name]


@lru_cache(maxsize=256)
def _code(plain: str) -> Any:
    return compile(plain, "an expression", "eval")
