"""Columns computed from others by a text such as ``mass / (width * height)``.

The text is never Python: a grammar of its own knows numbers, columns, four operations, powers and
elementary functions, so that a text from anybody's file can run nothing. What it may cost is
bounded too: it is short, all numbers are float64, whose powers take no time, and it is computed by
one pass over a list of steps.

    sum     = product, {("+" | "-"), product}
    product = signed, {("*" | "/"), signed}
    signed  = ("+" | "-"), signed | power
    power   = atom, ["**", signed]
    atom    = number | name | function, "(", sum, {",", sum}, ")" | "(", sum, ")"
"""

from __future__ import annotations

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

_LONGEST = 2000  # characters: a few hundred operations, seconds for a million tests
_DEEPEST = 50  # levels, four of Python's frames each, whose stack ends at 1000 frames
_ONE: dict[str, Callable[[Any], Any]] = {
    "abs": np.abs, "sqrt": np.sqrt, "exp": np.exp,
    "log": np.log, "log2": np.log2, "log10": np.log10,
    "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh,
}  # fmt: skip
# Not fmin and fmax, which would pass over a NaN and make a number of what is not known.
_MANY: dict[str, Callable[[Any, Any], Any]] = {"min": np.minimum, "max": np.maximum}
_OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "**": np.power,
}  # fmt: skip
CONSTANTS = {"pi": np.pi}
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[^\W\d]\w*)|`(?P<quoted>(?:[^`]|``)+)`|(?P<mark>\*\*|[-+*/(),])|(?P<other>\S)|$)"
)


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
    steps: tuple[float | str | tuple[Callable[..., Any], int], ...]

    @classmethod
    def of(cls, text: str) -> Expression:
        """Return the expression of a text.

        Args:
            text: Numbers with a decimal point; columns by their names, in backquotes where these
                are not of letters, digits and ``_``; ``+ - * / **`` and parentheses; abs, sqrt,
                exp, log (natural), log2, log10, sin, cos, tan (of radians), asin, acos, atan,
                sinh, cosh, tanh, min, max; pi.

        Raises:
            ArgumentValueError: It is no such text, too long, or nested too deep.
            ArgumentTypeError: It is no text.
        """
        if not isinstance(text, str):
            raise wrong_type("an expression", "text", text)
        if len(text) > _LONGEST:
            rule, found = f"of at most {_LONGEST} characters", Received(f"{len(text)}")
            raise invalid("an expression", rule, found)
        steps = _Parser(text).parsed()
        if not any(isinstance(step, str) and step not in CONSTANTS for step in steps):
            raise invalid("an expression", "one of a column or more", text)
        return cls(text, tuple(steps))

    @property
    def columns(self) -> list[str]:
        """The names in it, but for those of constants."""
        return [step for step in self.steps if isinstance(step, str) and step not in CONSTANTS]

    def values(self, columns: Mapping[str, NDArray[Any]]) -> Array:
        """Return the ``(n,)`` values; NaN or infinite where there is no finite one.

        Args:
            columns: ``(n,)`` each, by name; a column goes before a constant of its name.

        Raises:
            ArgumentValueError: There is no such column.
            ArgumentTypeError: A column holds no numbers.
        """
        stack: list[Any] = []
        # Division by zero, logarithms below zero and overflow are told by the values.
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
        if name not in columns and name in CONSTANTS:
            return np.float64(CONSTANTS[name])
        return real_column(
            name, columns[known_name(f"a column of {self.text!r:.60}", name, columns)]
        )


class _Parser:
    """Recursive descent over the tokens of a text; steps are appended operands first."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = [found for found in _TOKEN.finditer(text) if found.lastgroup]
        self.at = 0
        self.depth = 0
        self.steps: list[Any] = []

    def parsed(self) -> list[Any]:
        self.sum()
        if self.at < len(self.tokens):
            raise self.unexpected("an operation")
        return self.steps

    def sum(self) -> None:
        self.product()
        while mark := self.taken("+", "-"):
            self.product()
            self.steps.append((_OPERATIONS[mark], 2))

    def product(self) -> None:
        self.signed()
        while mark := self.taken("*", "/"):
            self.signed()
            self.steps.append((_OPERATIONS[mark], 2))

    def signed(self) -> None:
        # Every way down leads through here, so that this one count bounds the recursion.
        self.depth += 1
        if self.depth > _DEEPEST:
            raise invalid(
                f"the expression {self.text!r:.60}",
                f"nested at most {_DEEPEST} levels deep",
                Received("more"),
            )
        if mark := self.taken("+", "-"):
            self.signed()
            if mark == "-":
                self.steps.append((np.negative, 1))
        else:
            self.power()
        self.depth -= 1

    def power(self) -> None:
        self.atom()
        if self.taken("**"):
            self.signed()  # 2**-1, and 2**3**2 = 2**(3**2), as in mathematics
            self.steps.append((_OPERATIONS["**"], 2))

    def atom(self) -> None:
        if self.taken("("):
            self.sum()
            self.require(")")
            return
        token = self.tokens[self.at] if self.at < len(self.tokens) else None
        if token is None or token.lastgroup in ("mark", "other"):
            raise self.unexpected("a number, a column or a parenthesis")
        self.at += 1
        if token.lastgroup == "number":
            self.steps.append(float(token["number"]))
        elif token.lastgroup == "quoted":
            self.steps.append(token["quoted"].replace("``", "`"))
        elif self.taken("("):
            self.function(token["name"])
        else:
            self.steps.append(token["name"])

    def function(self, name: str) -> None:
        known_name(f"a function of {self.text!r:.60}", name, [*_ONE, *_MANY])
        self.sum()
        count = 1
        while self.taken(","):
            self.sum()
            count += 1
        self.require(")")
        if (count == 1) != (name in _ONE):
            rule = "of one value" if name in _ONE else "of two values or more"
            raise invalid(f"{name}() of {self.text!r:.60}", rule, Received(count))
        self.steps.append((_ONE.get(name) or _MANY[name], count))

    def taken(self, *marks: str) -> str:
        """Return the next token and pass over it if it is one of these marks; else nothing."""
        if self.at < len(self.tokens) and (mark := self.tokens[self.at]["mark"]) in marks:
            self.at += 1
            return str(mark)
        return ""

    def require(self, mark: str) -> None:
        if not self.taken(mark):
            raise self.unexpected(f"{mark!r} or an operation")

    def unexpected(self, rule: str) -> Exception:
        found, remedy = "its end", ""
        if self.at < len(self.tokens):
            token = self.tokens[self.at]
            start = token.start(token.lastgroup or 0)
            found = f"{self.text[start : start + 20]!r} at character {start + 1}"
            remedy = "names of other than letters, digits and _ stand in backquotes"
            if token["other"] == "^":
                remedy = "powers are written width**2"
        name = f"the expression {self.text!r:.60}"
        return invalid(name, f"continued by {rule}", Received(found), remedy)
