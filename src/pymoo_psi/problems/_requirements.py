"""Requirements: rules on the variables, checked before a model runs."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, collection, invalid, known_name, wrong_type
from pymoo_psi.problems._design_space import design_space, given_names
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.problems._wrapped import (
    Evaluate,
    WrappedProblem,
    checks_requirements,
    known_expressions,
)

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
        return [] if callable(self.rule) else [n for term in self._terms[0] for n in term.columns]

    @property
    def text(self) -> str:
        """What a table calls it."""
        own = callable(self.rule) or self.rule == self.name
        return self.name if own else f"{self.name}: {self.rule}"

    def violation(self, columns: Columns) -> Array:
        """Return ``(n,)`` by how much designs violate the rule, <= 0 where they meet it.

        Args:
            columns: ``(n,)`` values of the variables by name.

        Raises:
            ArgumentValueError: A function returns no truth value for each design.
        """
        if not callable(self.rule):
            terms, sign = self._terms
            values = [term.values(columns) for term in terms]
            with np.errstate(invalid="ignore"):
                above = np.max([sign * (b - a) for a, b in pairwise(values)], 0)
            return np.where(np.isnan(above), np.inf, above)  # what is no number keeps no rule
        met = np.asarray(self.rule(columns))
        shape = next(iter(columns.values())).shape
        if met.shape != shape or met.dtype != bool:
            found = Received(f"an array of shape {met.shape} and dtype {met.dtype}")
            raise invalid(f"what {self.name!r} returns", f"truth values of shape {shape}", found)
        return np.where(met, 0.0, 1.0)

    @cached_property
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


class Required(WrappedProblem):
    """Any pymoo problem whose model runs only for designs that meet requirements.

    Each requirement is one more inequality constraint, the last columns of ``G``. A design that
    violates one has infinite objectives and 0 for all other constraints, and the model does not
    see it. PSI, ``SurrogatePSI`` and ``investigate`` make this of a problem by themselves where it
    has an attribute ``requirements`` or where they are given some.

    Args:
        problem: A pymoo problem.
        requirements: Rules by name, or a list of rules: inequalities of expressions of the
            variables, ``"height <= 4*width"`` or ``"1 <= height/width <= 4"``, or functions that
            take ``(n,)`` columns by name and return ``(n,)`` truth values. The problem's attribute
            unless given.

    Attributes:
        required: The requirements.
        n_not_run: How many designs violated one when they were to be evaluated.

    Raises:
        ArgumentValueError: A rule cannot be read, or uses what is no variable.
        ArgumentTypeError: A rule is neither a text nor a function, or ``problem`` is no problem.

    Example:
        >>> import numpy as np
        >>> from pymoo.problems import get_problem
        >>> problem = Required(get_problem("zdt1", n_var=2), ["x1 + x2 >= 0.5"])
        >>> problem.evaluate(np.array([[0.1, 0.1], [0.5, 0.0]]), return_values_of=["F", "G"])
        (array([[ inf,  inf], [0.5 , 0.29...]]), array([[0.3], [0. ]]))
    """

    same_front = False
    checks_requirements = True

    def __init__(self, problem: Any, requirements: Any = None) -> None:
        require_problem(problem)
        if requirements is None:
            requirements = getattr(problem, "requirements", None)
        self._space = design_space(problem)
        self.required = requirements_of(requirements, self._space.titles)
        self.given = requirements
        self.n_not_run = 0
        n = problem.n_ieq_constr
        super().__init__(problem, n_ieq_constr=n + len(self.required))
        self.requirements = None  # they are constraints here
        texts = {f"g{n + k}": each.text for k, each in enumerate(self.required, 1)}
        self.names = given_names(problem, self._space) | texts

    def amounts(self, matrix: NDArray[Any]) -> Array:
        """Return ``(n, k)`` by how much n designs violate the k requirements, <= 0 where met.

        Args:
            matrix: ``(n, n_var)`` designs, rows of a test table.
        """
        # lists, as a matrix of several kinds of variables holds objects
        rows = zip(self._space.titles, matrix.T, strict=True)
        columns = {name: np.array(column.tolist()) for name, column in rows}
        none = np.zeros((len(matrix), 0))
        return np.column_stack([none, *(each.violation(columns) for each in self.required)])

    def values_from(self, X: Any, evaluate: Evaluate) -> dict[str, Any]:
        """Return the values of all designs; those that meet the requirements are evaluated.

        Args:
            X: n designs as the problem takes them.
            evaluate: Returns values of some of them for the problem within.
        """
        above, n = self.amounts(self._space.to_matrix(X)), len(X)
        met, n_ieq = np.flatnonzero((above <= 0).all(axis=1)), self.wrapped.n_ieq_constr
        out: dict[str, Any] = {  # of designs that are not evaluated
            "F": np.full((n, self.n_obj), np.inf),
            "G": np.hstack([np.zeros((n, n_ieq)), above]),
            "H": np.zeros((n, self.n_eq_constr)),
        }
        self.n_not_run += n - len(met)
        for name, values in evaluate(X[met]).items() if len(met) else ():
            if name not in out:  # what else the model gives, nothing where it did not run
                out[name] = np.full(n, None, dtype=object)
            column = out[name][:, :n_ieq] if name == "G" else out[name]
            for row, value in zip(met, values, strict=True):
                column[row] = value
        return out

    def around(self, problem: Any) -> Required:
        """Return the same requirements around another problem, which has other constraints."""
        return Required(problem, self.given)

    @property
    def known_expressions(self) -> Mapping[str, Any]:
        """Those of the wrapped problem: the columns are the same."""
        return known_expressions(self.wrapped)


def required(problem: Any, requirements: Any = None) -> Any:
    """Return a problem with its requirements, or those given, as :class:`Required`."""
    if checks_requirements(problem):
        if requirements is None or requirements == problem.given:
            return problem
        problem = problem.wrapped
    given = requirements if requirements is not None else getattr(problem, "requirements", None)
    return Required(problem, given) if given else problem


def without_requirements(problem: Any) -> Any:
    """Return the problem within a wrapper that checks requirements, or else the problem itself."""
    return problem.wrapped if checks_requirements(problem) else problem
