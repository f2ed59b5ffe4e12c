"""Requirements: rules on the variables, checked before a model runs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from pymoo_psi._validation import (
    AnyArray,
    Array,
    Entries,
    Names,
    Values,
    collection,
    invalid,
    known_names,
    wrong_type,
)
from pymoo_psi.problems._design_space import design_space
from pymoo_psi.problems._pymoo import column_titles, numbered, require_problem
from pymoo_psi.problems._wrapped import Evaluate, WrappedProblem, layers

_SIGN = re.compile(r"(<=|>=|=)(?=[^`]*(?:`[^`]*`[^`]*)*\Z)")  # not in a name in backquotes
# The factor times b - a is the amount by which neighbours a, b violate the sign.
_FACTORS = {"<=": -1.0, ">=": 1.0}
_LARGE = 2.0**60  # a constant does not count beside so large a value
_LINEAR = 1e-9  # largest relative difference between an equality and a linear one
_ACCURACY = 5e-3  # share of an equality's terms: designs of people are weighed or rounded


@dataclass(frozen=True)
class Requirement:
    """A rule on variables.

    Attributes:
        name: Its name, in tables and messages.
        rule: An inequality or a linear equality of expressions.
        sign: The sign between the expressions.
        terms: The expressions in their order.
        equality: The coefficients of all variables in an equality, and what they add up to.
    """

    name: str
    rule: str
    sign: str
    terms: Sequence[Any]
    equality: tuple[float, ...] = ()

    @classmethod
    def of(cls, name: str, rule: Any, variables: Names) -> Requirement:
        """Return a rule on some variables, checked; see :func:`requirements_of`."""
        from pymoo_psi.table import Expression  # imports pandas, which most problems do not need

        where = f"the requirement {name!r}"
        if not isinstance(rule, str):
            raise wrong_type(where, "an inequality as text", rule)
        signs = _SIGN.findall(rule)
        if len(set(signs)) != 1 or signs[1:].count("="):
            raise invalid(
                where,
                "an inequality such as 'height <= 4*width' or '1 <= height/width <= 4', or an "
                "equality such as 'a + b + c = 1'",
                rule,
            )
        terms = [Expression.of(term) for term in _SIGN.split(rule)[::2]]
        for term in terms:
            known_names(f"a name in {where}", term.columns, variables)
        requirement = cls(name, rule, signs[0], terms)
        if requirement.sign == "=":
            return replace(requirement, equality=requirement._linear(variables))
        return requirement

    @property
    def text(self) -> str:
        """The name of its column in a table."""
        if self.rule == self.name:
            return self.name
        return f"{self.name}: {self.rule}"

    def violation(self, columns: Entries) -> Array:
        """Return ``(n,)`` amounts by which designs violate the rule, <= 0 where they meet it.

        Args:
            columns: ``(n,)`` values of the variables by name.
        """
        if self.equality:
            return self._deviation(columns)
        values = [term.values(columns) for term in self.terms]
        with np.errstate(invalid="ignore"):
            differences = [_FACTORS[self.sign] * (b - a) for a, b in pairwise(values)]
            amounts = np.max(differences, 0)
        return np.where(np.isnan(amounts), np.inf, amounts)  # NaN meets no rule

    def _deviation(self, columns: Entries) -> Array:
        """Return ``(n,)`` amounts by which designs miss an equality, 0 where they are accurate."""
        *coefficients, total = self.equality
        terms: list[Any] = [-total]
        for coefficient, values in zip(coefficients, columns.values(), strict=True):
            if coefficient != 0:
                terms.append(coefficient * values)
        amounts = np.nan_to_num(np.abs(sum(terms)), nan=np.inf)
        return np.where(amounts > _ACCURACY * sum(map(np.abs, terms)), amounts, 0.0)

    def _linear(self, variables: Names) -> tuple[float, ...]:
        """Return the coefficients of all variables in an equality, and what they add up to.

        Raises:
            ArgumentValueError: It is not linear, or has less than two variables.
        """
        # A linear function follows from its values at 0 and far away on each axis, where a constant
        # does not count. The rule is linear if both sides differ by it at random points, too.
        n = len(variables)
        random = np.random.default_rng(0).uniform(-1, 1, (8, n))
        points = np.vstack([_LARGE * np.eye(n), np.zeros((1, n)), random, _LARGE * random])
        columns = dict(zip(variables, points.T, strict=True))
        with np.errstate(all="ignore"):
            left, right = (term.values(columns) for term in self.terms)
            values = left - right
            coefficients = (values[:n] - values[n]) / _LARGE
            linear = points @ coefficients + values[n]
        is_linear = np.allclose(values, linear, rtol=_LINEAR, atol=0)
        if not is_linear or np.count_nonzero(coefficients) < 2:
            raise invalid(
                f"the requirement {self.name!r}",
                "an inequality, or an equality that is linear in two variables or more, such as "
                "'a + b + c = 1'",
                self.rule,
                "two inequalities allow a tolerance; equal bounds fix a variable",
            )
        return (*coefficients.tolist(), -values[n].item())


def requirements_of(rules: Any, variables: Names) -> tuple[Requirement, ...]:
    """Return checked requirements.

    Args:
        rules: Rules by name, or a list of texts; None is none.
        variables: The names of the variables.

    Raises:
        ArgumentValueError: A rule cannot be read, or uses an unknown variable.
        ArgumentTypeError: A rule is no text.
    """
    return tuple(Requirement.of(name, rule, variables) for name, rule in _named(rules).items())


def _named(rules: Any) -> Values:
    """Return rules by name; those of a list are their own names."""
    if rules is None:
        return {}
    if not isinstance(rules, Mapping):
        collection("requirements", rules, "rules by name, or a list of texts")
        rules = dict(zip(rules, rules, strict=True))
    return {str(name): rule for name, rule in rules.items()}


class Required(WrappedProblem):
    """Any pymoo problem whose model runs only for designs that meet requirements.

    Each requirement is an additional inequality constraint, in the last columns of ``G``. The model
    does not run for a design that violates one; its objectives are infinite and all other
    constraints are 0. PSI, ``SurrogatePSI`` and ``investigate`` wrap a problem themselves if it has
    an attribute ``requirements`` or if they receive this argument.

    A linear equality of real variables makes one of them dependent on the others. All designs of
    PSI, ``SurrogatePSI``, ``investigate`` and samplings meet it and fill the remaining region
    evenly. Other algorithms of pymoo are refused, because their designs would not meet it.

    Args:
        problem: A pymoo problem.
        requirements: Rules by name, or a list of texts: inequalities of expressions of the
            variables, ``"height <= 4*width"`` or ``"1 <= height/width <= 4"``; or linear
            equalities, ``"a + b + c = 1"``. Those of the problem's attribute hold, too, unless one
            has the same name.

    Attributes:
        required: The requirements.
        rule_names: The names of their columns, by the default names.
        n_not_run: How many designs were not evaluated because they violate one.

    Raises:
        ArgumentValueError: A rule cannot be read, or uses an unknown variable; an equality is not
            linear, or of variables that are not real; designs within the bounds do not meet it.
        ArgumentTypeError: A rule is no text, or ``problem`` is no problem.

    Example:
        >>> import numpy as np
        >>> from pymoo.problems import get_problem
        >>> problem = Required(get_problem("zdt1", n_var=2), ["x1 + x2 >= 0.5"])
        >>> problem.evaluate(np.array([[0.1, 0.1], [0.5, 0.0]]), return_values_of=["F", "G"])
        (array([[ inf,  inf], [0.5 , 0.29...]]), array([[0.3], [0. ]]))

        Designs of a mixture:

        >>> from pymoo_psi import investigate
        >>> mixture = Required(get_problem("zdt1", n_var=3), ["x1 + x2 + x3 = 1"])
        >>> investigate(mixture, 3).X.sum(axis=1).round(12)
        array([1., 1., 1.])
    """

    same_columns = True

    def __init__(self, problem: Any, requirements: Any = None) -> None:
        require_problem(problem)
        self._space = design_space(problem)
        self.rules = _named(getattr(problem, "requirements", None)) | _named(requirements)
        self.required = requirements_of(self.rules, self._space.titles)
        self.n_not_run = 0
        n = problem.n_ieq_constr
        super().__init__(problem, n_ieq_constr=n + len(self.required))
        self.requirements: None = None  # they are constraints here
        texts = [requirement.text for requirement in self.required]
        self.rule_names = numbered("g", texts, first=n + 1)
        self.names = column_titles(problem) | self.rule_names
        equalities = [rule.equality for rule in self.required if rule.equality]
        if equalities:
            self.space = replace(self._space, equalities=(*self._space.equalities, *equalities))
            self._space = design_space(self)

    def amounts(self, matrix: AnyArray) -> Array:
        """Return ``(n, k)`` amounts by which n designs violate k requirements, <= 0 where met.

        Args:
            matrix: ``(n, n_var)`` designs, rows of a test table.
        """
        columns = {}
        for title, column in zip(self._space.titles, matrix.T, strict=True):
            # The list gives the column a type: a matrix of several kinds of variables has objects.
            columns[title] = np.array(column.tolist())
        violations = [requirement.violation(columns) for requirement in self.required]
        return np.column_stack([np.zeros((len(matrix), 0)), *violations])

    def values_from(self, X: Any, evaluate: Evaluate) -> Values:
        """Return the values of all designs; those that meet the requirements are evaluated.

        Args:
            X: n designs as the problem takes them.
            evaluate: Returns the values of designs of the wrapped problem.
        """
        n = len(X)
        n_ieq = self.wrapped.n_ieq_constr
        amounts = self.amounts(self._space.to_matrix(X))
        met = np.flatnonzero((amounts <= 0).all(axis=1))
        self.n_not_run += n - len(met)
        out = {  # values of designs that are not evaluated
            "F": np.full((n, self.n_obj), np.inf),
            "G": np.hstack([np.zeros((n, n_ieq)), amounts]),
            "H": np.zeros((n, self.n_eq_constr)),
            "failure": np.full(n, "", dtype=object),
        }
        if not len(met):
            return out
        for name, values in evaluate(X[met]).items():
            # a further value of the model is None where it did not run
            column = out.setdefault(name, np.full(n, None))
            if name == "G":
                column = column[:, :n_ieq]
            for row, value in zip(met, values, strict=True):
                column[row] = value
        return out


def requirement_texts(problem: Any) -> list[str]:
    """Return the rules of a problem, which a study compares."""
    texts: list[str] = []
    for layer in layers(problem):
        if isinstance(layer, Required):
            texts.extend(requirement.text for requirement in layer.required)
    return texts


def with_requirements(problem: Any, requirements: Any = None) -> Any:
    """Return a problem as :class:`Required` if it has requirements or the argument has some."""
    rules = _named(requirements)
    if isinstance(problem, Required):
        rules = problem.rules | rules
        if rules == problem.rules:
            return problem
        problem = problem.wrapped
    if rules or getattr(problem, "requirements", None):
        return Required(problem, rules)
    return problem


def without_requirements(problem: Any) -> Any:
    """Return the problem within a wrapper that checks requirements, or else the problem itself."""
    return problem.wrapped if isinstance(problem, Required) else problem
