"""Requirements: rules on the variables, checked before a model runs."""

from __future__ import annotations

import hashlib
import inspect
import re
import sysconfig
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from pymoo_psi._validation import (
    AnyArray,
    Array,
    Names,
    Received,
    Values,
    collection,
    invalid,
    known_name,
    wrong_type,
)
from pymoo_psi.problems._design_space import column_titles, design_space
from pymoo_psi.problems._pymoo import leave_failed_out, require_problem
from pymoo_psi.problems._wrapped import (
    Evaluate,
    WrappedProblem,
    checks_requirements,
    layers,
)

Columns: TypeAlias = Mapping[str, AnyArray]
Rule: TypeAlias = str | Callable[[Columns], Any]

_SIGN = re.compile(r"(<=|>=|=)")
_FACTORS = {"<=": -1.0, "=": 0.0, ">=": 1.0}
_LARGE = 2.0**60  # beside it, a constant does not count
_LINEAR = 1e-9  # largest relative difference between an equality and a linear one
_ACCURACY = 5e-3  # of the terms of an equality, as designs of others are weighed or rounded
# Where installed packages are, and Python itself.
_PACKAGES = tuple(map(sysconfig.get_path, ("stdlib", "purelib", "platlib")))


@dataclass(frozen=True)
class Requirement:
    """A rule on variables.

    Attributes:
        name: Its name, in tables and messages.
        rule: An inequality or a linear equality of expressions, or a function of the columns.
    """

    name: str
    rule: Rule

    @property
    def columns(self) -> list[str]:
        """The variables that its expressions use; empty for a function."""
        if callable(self.rule):
            return []
        columns = []
        for term in self._terms[0]:
            columns += term.columns
        return columns

    @property
    def source(self) -> str:
        """What a function does, empty for a text: its code, and all that it uses."""
        return _content(self.rule, []) if callable(self.rule) else ""

    @property
    def text(self) -> str:
        """The name of its column in a table."""
        if callable(self.rule) or self.rule == self.name:
            return self.name
        return f"{self.name}: {self.rule}"

    def violation(self, columns: Columns) -> Array:
        """Return ``(n,)`` amounts by which designs violate the rule, <= 0 where they meet it.

        Args:
            columns: ``(n,)`` values of the variables by name.

        Raises:
            ArgumentValueError: A function returns no truth value for each design.
        """
        if self.is_equality:
            return self._deviation(columns)
        if not callable(self.rule):
            terms, sign = self._terms
            values = [term.values(columns) for term in terms]
            with np.errstate(invalid="ignore"):
                differences = [sign * (b - a) for a, b in pairwise(values)]
                amounts = np.max(differences, 0)
            return np.where(np.isnan(amounts), np.inf, amounts)  # NaN meets no rule
        met = np.asarray(self.rule(columns))
        shape = next(iter(columns.values())).shape
        if met.shape != shape or met.dtype != bool:
            raise invalid(
                f"what {self.name!r} returns",
                f"truth values of shape {shape}",
                Received(f"an array of shape {met.shape} and dtype {met.dtype}"),
            )
        return np.where(met, 0.0, 1.0)

    @property
    def is_equality(self) -> bool:
        """Whether it is an equality."""
        return not callable(self.rule) and self._terms[1] == 0

    def equality(self, variables: Names) -> list[float]:
        """Return the coefficients of all variables in an equality, and what they add up to.

        Raises:
            ArgumentValueError: It is not linear, or has less than two variables.
        """
        n = len(variables)
        random = np.random.default_rng(0).uniform(-1, 1, (8, n))
        points = np.vstack([_LARGE * np.eye(n), np.zeros((1, n)), random, _LARGE * random])
        columns = dict(zip(variables, points.T, strict=True))
        with np.errstate(all="ignore"):
            left, right = (term.values(columns) for term in self._terms[0])
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
        return [*coefficients.tolist(), -values[n].item()]

    def _deviation(self, columns: Columns) -> Array:
        """Return ``(n,)`` amounts by which designs miss an equality, 0 where they are accurate."""
        amounts, sizes = self.deviation(columns)
        return np.where(amounts > _ACCURACY * sizes, amounts, 0.0)

    def deviation(self, columns: Columns) -> tuple[Array, Array]:
        """Return ``(n,)`` amounts by which designs miss an equality, and the sizes of its terms."""
        *coefficients, total = self.equality([*columns])
        amounts: Any = -total
        sizes: Any = abs(total)
        for coefficient, values in zip(coefficients, columns.values(), strict=True):
            if coefficient != 0:
                amounts = amounts + coefficient * values
                sizes = sizes + np.abs(coefficient * values)
        return np.nan_to_num(np.abs(amounts), nan=np.inf), sizes

    @cached_property
    def _terms(self) -> tuple[list[Any], float]:
        """The expressions between the signs, and the factor of b - a for neighbours a, b.

        The factor is 0 for an equality.
        """
        from pymoo_psi.table import Expression  # imports pandas, which most problems do not need

        parts = _SIGN.split(str(self.rule))
        signs = parts[1::2]
        if len(set(signs)) != 1 or signs[1:].count("="):
            raise invalid(
                f"the requirement {self.name!r}",
                "an inequality such as 'height <= 4*width' or '1 <= height/width <= 4', or an "
                "equality such as 'a + b + c = 1'",
                self.rule,
            )
        terms = [Expression.of(part) for part in parts[::2]]
        return terms, _FACTORS[signs[0]]


def _content(value: Any, functions: list[Any]) -> str:
    """Return what a function does, or what another value is, the same in every process.

    It has the code of functions and all that they use; of those of installed packages, the names.

    Args:
        value: The function or other value.
        functions: Those whose content is given already; more are added.
    """
    call = getattr(value, "__func__", getattr(type(value), "__call__", None))  # noqa: B004
    text = ""
    parts: dict[Any, Any]
    if isinstance(value, partial):
        parts = {"function": value.func, **dict(enumerate(value.args)), **value.keywords}
    elif inspect.isfunction(value):
        is_installed = value.__code__.co_filename.startswith(_PACKAGES)
        if value in functions or (functions and is_installed):
            return value.__qualname__
        functions.append(value)
        text = _code(value)
        parts = _used(value)
    elif inspect.isfunction(call):  # a method, or an object that can be called
        parts = {"function": call, **getattr(getattr(value, "__self__", value), "__dict__", {})}
    else:
        return _identity(value)
    contents = {name: _content(part, functions) for name, part in parts.items()}
    return f"{text}{contents}"


def _code(function: Any) -> str:
    """Return the code of a function as it was written, if that is known."""
    code = function.__code__
    text = ""
    with suppress(OSError):  # typed into an interpreter
        text = inspect.getsource(code)
    if text and function.__name__ != "<lambda>":
        return text
    constants = [constant for constant in code.co_consts if not inspect.iscode(constant)]
    # Several lambdas may stand on one line.
    return f"{text}{code.co_code!r}{constants}{code.co_names}"


def _used(function: Any) -> Values:
    """Return the values that a function uses, by name, and the default values of its arguments."""
    used = {"defaults": function.__defaults__, "keywords": function.__kwdefaults__}
    used |= inspect.getclosurevars(function).nonlocals
    codes = [function.__code__]
    for code in codes:  # those of functions within it are added
        codes += filter(inspect.iscode, code.co_consts)
        for name in code.co_names:
            if name in function.__globals__:
                used[name] = function.__globals__[name]
    return used


def _identity(value: Any) -> str:
    """Return a text that differs for different numbers, arrays and other data."""
    import joblib  # only where a function has data

    try:
        return str(joblib.hash(value))
    except Exception:  # a module, an open file, a compiled function
        return str(getattr(value, "__qualname__", type(value).__qualname__))


def requirements_of(rules: Any, variables: Names) -> tuple[Requirement, ...]:
    """Return checked requirements.

    Args:
        rules: Rules by name, or a list of rules; None is none.
        variables: The names of the variables.

    Raises:
        ArgumentValueError: A rule cannot be read, or uses an unknown variable.
        ArgumentTypeError: A rule is neither a text nor a function.
    """
    if rules is None:
        rules = ()
    if not isinstance(rules, Mapping):
        rules = collection("requirements", rules, "rules by name, or a list of rules")
        rules = _by_name(rules)
    requirements = [Requirement(str(name), rule) for name, rule in rules.items()]
    for requirement in requirements:
        where = f"the requirement {requirement.name!r}"
        if not isinstance(requirement.rule, str) and not callable(requirement.rule):
            raise wrong_type(where, "an inequality as text, or a function", requirement.rule)
        for column in requirement.columns:
            known_name(f"a name in {where}", column, variables)
        if requirement.is_equality:
            requirement.equality(variables)  # one that is not linear is refused here
    return tuple(requirements)


def _by_name(rules: Iterable[Any]) -> Values:
    """Return rules by their names, functions of the same name with a number."""
    rule_by_name: Values = {}
    for rule in rules:
        name = str(getattr(rule, "__name__", rule))
        unique = name
        number = 1
        while rule_by_name.get(unique, rule) != rule:
            number += 1
            unique = f"{name} {number}"
        rule_by_name[unique] = rule
    return rule_by_name


class Required(WrappedProblem):
    """Any pymoo problem whose model runs only for designs that meet requirements.

    Each requirement is one more inequality constraint, the last columns of ``G``. A design that
    violates one has infinite objectives and 0 for all other constraints, and the model does not
    run for it. PSI, ``SurrogatePSI`` and ``investigate`` wrap a problem in this themselves if it
    has an attribute ``requirements`` or if they are given some.

    A linear equality of real variables makes one of them dependent on the others. The designs of
    PSI, ``SurrogatePSI``, ``investigate`` and samplings then meet it and fill what is left of the
    bounds evenly. Other algorithms of pymoo are refused, as their designs would not meet it.

    Args:
        problem: A pymoo problem.
        requirements: Rules by name, or a list of rules: inequalities of expressions of the
            variables, ``"height <= 4*width"`` or ``"1 <= height/width <= 4"``; linear equalities,
            ``"a + b + c = 1"``; or functions that take ``(n,)`` columns by name and return ``(n,)``
            truth values. The problem's attribute unless given.

    Attributes:
        required: The requirements.
        n_not_run: How many designs were not evaluated because they violate one.

    Raises:
        ArgumentValueError: A rule cannot be read, or uses an unknown variable; an equality is not
            linear, or of variables that are not real; designs within the bounds do not meet it.
        ArgumentTypeError: A rule is neither a text nor a function, or ``problem`` is no problem.

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
    checks_requirements = True

    def __init__(self, problem: Any, requirements: Any = None) -> None:
        require_problem(problem)
        if requirements is None:
            requirements = getattr(problem, "requirements", None)
        self._space = design_space(problem)
        self.required = requirements_of(requirements, self._space.titles)
        self.rules = requirements
        self.n_not_run = 0
        n = problem.n_ieq_constr
        super().__init__(problem, n_ieq_constr=n + len(self.required))
        self.requirements = None  # they are constraints here
        self.names = column_titles(problem, self._space)
        for k, requirement in enumerate(self.required, n + 1):
            self.names[f"g{k}"] = requirement.text
        equalities = [*self._space.equalities]
        for requirement in self.required:
            if requirement.is_equality:
                equalities.append(tuple(requirement.equality(self._space.titles)))
        if equalities:
            self.space = replace(self._space, equalities=tuple(equalities))
            self._space = design_space(self)

    def evaluate(self, X: Any, *args: Any, **kwargs: Any) -> Any:
        """Evaluate designs like pymoo's ``evaluate``; those that do not run are no optimum."""
        leave_failed_out(kwargs.get("algorithm"))
        return super().evaluate(X, *args, **kwargs)

    def amounts(self, matrix: AnyArray) -> Array:
        """Return ``(n, k)`` amounts by which n designs violate k requirements, <= 0 where met.

        Args:
            matrix: ``(n, n_var)`` designs, rows of a test table.
        """
        columns = {}
        for title, column in zip(self._space.titles, matrix.T, strict=True):
            # by a list, as a matrix of several kinds of variables holds objects
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
        }
        if not len(met):
            return out
        for name, values in evaluate(X[met]).items():
            if name not in out:  # a further value of the model, None where it did not run
                out[name] = np.full(n, None, dtype=object)
            column = out[name]
            if name == "G":
                column = column[:, :n_ieq]
            for row, value in zip(met, values, strict=True):
                column[row] = value
        return out

    def around(self, problem: Any) -> Required:
        """Return the same requirements around another problem, with constraints of its own."""
        return Required(problem, self.rules)


def requirement_texts(problem: Any) -> list[str]:
    """Return what identifies the requirements of a problem: rules, and the code of functions."""
    texts = []
    for layer in layers(problem):
        if checks_requirements(layer):
            for requirement in layer.required:
                code = hashlib.sha256(requirement.source.encode()).hexdigest()[:16]
                texts.append(
                    f"{requirement.text} {code}" if requirement.source else requirement.text
                )
    return texts


def with_requirements(problem: Any, requirements: Any = None) -> Any:
    """Return a problem as :class:`Required` if it has requirements or the argument has some."""
    if checks_requirements(problem):
        if requirements is None or requirements == problem.rules:
            return problem
        problem = problem.wrapped
    if requirements is None:
        requirements = getattr(problem, "requirements", None)
    return Required(problem, requirements) if requirements else problem


def without_requirements(problem: Any) -> Any:
    """Return the problem within a wrapper that checks requirements, or else the problem itself."""
    return problem.wrapped if checks_requirements(problem) else problem
