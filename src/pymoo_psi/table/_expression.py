"""Columns computed from others by a text such as ``mass / (width * height)``.

Python's parser reads the text and nothing evaluates it as Python: all names and numbers are
replaced by placeholders first, and only sums, products, powers and calls of known functions are
accepted, so that a text from an untrusted file runs nothing. All numbers are float64, whose powers
take no time.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid, known_name, wrong_type
from pymoo_psi.table._designs import real_column

Array = NDArray[np.float64]
Step = float | str | tuple[Callable[..., Any], int]

_ONE: dict[str, Callable[[Any], Any]] = {
    "abs": np.abs, "sqrt": np.sqrt, "exp": np.exp,
    "log": np.log, "log2": np.log2, "log10": np.log10,
    "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh,
}  # fmt: skip
# Not fmin and fmax, which would pass over a NaN and make a number of what is not known.
_MANY: dict[str, Callable[[Any, Any], Any]] = {"min": np.minimum, "max": np.maximum}
_OPERATIONS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide,
    ast.Pow: np.power,
}  # fmt: skip
_SIGNS: dict[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: np.positive,
    ast.USub: np.negative,
}
_CONSTANTS = {"pi": np.pi}
_OPERAND = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[^\W\d]\w*)|`(?P<quoted>(?:[^`]|``)+)`"
)
_MARKS = re.compile(r"[_0-9*+\-/(),\s]*")


@dataclass(frozen=True)
class Expression:
    """An arithmetic expression of columns.

    Attributes:
        text: As it was written.
        steps: What is done, one after the other, with a stack of values: a number is put on it; a
            text is a column, put on it, or a constant; a function takes as many values as stand
            beside it from the stack, and puts its own there.
    """

    text: str
    steps: tuple[Step, ...]

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
        operands: list[float | str] = []

        def placeholder(found: re.Match[str]) -> str:
            quoted = (found["quoted"] or "").replace("``", "`")
            operands.append(float(found["number"]) if found["number"] else found["name"] or quoted)
            return f" _{len(operands) - 1} "

        plain = " ".join(_OPERAND.sub(placeholder, text).split())
        try:
            if not _MARKS.fullmatch(plain):
                raise SyntaxError
            return cls(text, tuple(_steps(ast.parse(plain, mode="eval").body, operands)))
        except (SyntaxError, RecursionError, MemoryError):  # the parser's, of deep nesting
            rule = "arithmetic of columns, such as 'mass / (width * height)'"
            remedy = "powers are width**2, names of other than letters, digits and _ in backquotes"
            raise invalid("an expression", rule, text, remedy) from None

    @property
    def columns(self) -> list[str]:
        """The names in it, but for those of constants."""
        return [step for step in self.steps if isinstance(step, str) and step not in _CONSTANTS]

    def values(self, columns: Mapping[str, NDArray[Any]]) -> Array:
        """Return the ``(n,)`` values; NaN or infinite where there is no finite one.

        Args:
            columns: ``(n,)`` each, by name; a column goes before a constant of its name.

        Raises:
            ArgumentValueError: There is no such column.
            ArgumentTypeError: A column holds no numbers.
        """
        stack: list[Any] = []
        # Division by zero, logarithms below zero and overflow show in the values.
        with np.errstate(all="ignore"):
            for step in self.steps:
                if isinstance(step, float):
                    stack.append(np.float64(step))
                elif isinstance(step, str):
                    stack.append(self._operand(step, columns))
                else:
                    function, count = step
                    operands = stack[-count:]
                    del stack[-count:]
                    # min and max of more than two are those of the first two, and so on
                    stack.append(reduce(function, operands) if count > 1 else function(*operands))
        n = len(next(iter(columns.values()), ()))
        return np.array(np.broadcast_to(stack.pop(), (n,)), dtype=np.float64)

    def _operand(self, name: str, columns: Mapping[str, NDArray[Any]]) -> Any:
        if name not in columns and name in _CONSTANTS:
            return np.float64(_CONSTANTS[name])
        known_name(f"a column of {self.text!r:.60}", name, columns)
        return real_column(name, columns[name])


def _steps(tree: ast.expr, operands: list[float | str]) -> list[Step]:
    """Return a tree as steps, operands first; without recursion, as sums are nested deep."""
    pending: list[ast.expr] = [tree]
    steps: list[Step] = []
    while pending:  # each node before its operands, the last of these first: steps backwards
        node = pending.pop()
        if isinstance(node, ast.Name):
            steps.append(operands[int(node.id[1:])])
        elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
            steps.append((_OPERATIONS[type(node.op)], 2))
            pending += [node.left, node.right]
        elif isinstance(node, ast.UnaryOp) and type(node.op) in _SIGNS:
            steps.append((_SIGNS[type(node.op)], 1))
            pending.append(node.operand)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            name, count = operands[int(node.func.id[1:])], len(node.args)
            known_name("a function of an expression", name, [*_ONE, *_MANY])
            functions = _ONE if count == 1 else _MANY
            if name not in functions or not count:
                rule = "of one value" if name in _ONE else "of two values or more"
                raise invalid(f"{name}() of an expression", rule, Received(count))
            steps.append((functions[str(name)], count))
            pending += node.args
        else:
            raise SyntaxError
    return steps[::-1]
