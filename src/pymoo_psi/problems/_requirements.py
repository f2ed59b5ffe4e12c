"""Requirements: rules on the variables, checked before a model runs."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, collection, invalid, known_name, wrong_type

Array = NDArray[np.float64]
Columns: TypeAlias = Mapping[str, NDArray[Any]]
Rule: TypeAlias = str | Callable[[Columns], Any]

_SIGN = re.compile(r"(<=|>=)")


@dataclass(frozen=True)
class Requirement:
    """A rule on variables.

    Attributes:
        name: Its name, in tables and messages.
        rule: An inequality of expressions, or a function of the columns.
    """

    name: str
    rule: Rule

    @property
    def columns(self) -> list[str]:
        """The names that its expressions use; empty of a function."""
        return [] if callable(self.rule) else [n for term in self._terms()[0] for n in term.columns]

    def violation(self, columns: Columns) -> Array:
        """Return ``(n,)`` by how much designs violate the rule, <= 0 where they meet it.

        Args:
            columns: ``(n,)`` values of the variables by name.

        Raises:
            ArgumentValueError: A function returns no truth value for each design.
        """
        if not callable(self.rule):
            terms, sign = self._terms()
            values = [term.values(columns) for term in terms]
            with np.errstate(invalid="ignore"):
                above = np.max([sign * (b - a) for a, b in pairwise(values)], 0)
            return np.where(np.isnan(above), np.inf, above)  # what is no number keeps no rule
        met = np.asarray(self.rule(columns))
        shape = next(iter(columns.values())).shape
        if met.shape != shape or met.dtype != bool:
            found = Received(f"an array of shape {met.shape} and dtype {met.dtype}")
            rule = f"truth values of shape {shape}, of columns of the variables"
            raise invalid(f"what the requirement {self.name!r} returns", rule, found)
        return np.where(met, 0.0, 1.0)

    def _terms(self) -> tuple[list[Any], float]:
        from pymoo_psi.table import Expression  # pandas, for which a problem would wait

        parts = _SIGN.split(str(self.rule))
        if len(parts) == 1 or len({*parts[1::2]}) > 1:
            rule = "an inequality such as 'height <= 4*width' or '1 <= height/width <= 4'"
            raise invalid(f"the requirement {self.name!r}", rule, self.rule)
        return [Expression.of(part) for part in parts[::2]], -1.0 if parts[1] == "<=" else 1.0


def requirements_of(given: Any, variables: Sequence[str]) -> tuple[Requirement, ...]:
    """Return requirements from what a user gives.

    Args:
        given: Rules by name, or a list of rules; None is none.
        variables: The names of the variables.

    Raises:
        ArgumentValueError: A rule cannot be read, or uses what is no variable.
        ArgumentTypeError: A rule is neither a text nor a function.
    """
    if not isinstance(given, Mapping):
        rules = collection("requirements", given or (), "rules by name, or a list of rules")
        given = {getattr(rule, "__name__", rule): rule for rule in rules}
    found = [Requirement(str(name), rule) for name, rule in given.items()]
    for each in found:
        where = f"the requirement {each.name!r}"
        if not isinstance(each.rule, str) and not callable(each.rule):
            raise wrong_type(where, "an inequality as text, or a function", each.rule)
        for column in each.columns:
            known_name(f"a name in {where}", column, variables)
    return tuple(found)
