"""Problems that say the names, units and limits of what they compute."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Choice, Integer, Real

from pymoo_psi._validation import finite_number, instance, invalid, known_name, mapping
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, EvaluationError
from pymoo_psi.problems._pymoo import OF_A_MODEL, require_known_keywords
from pymoo_psi.problems._requirements import requirements_of

_LIMIT = re.compile(r"\s*(<=|>=)\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*")


@dataclass(frozen=True)
class Setting:
    """A variable: an entry of the section ``[variables]``.

    Attributes:
        bounds: Lower and upper bound.
        choices: The options of a choice, instead of bounds.
        kind: ``"real"`` or ``"integer"``.
        scale: ``"linear"`` or ``"log"``.
        unit: Its unit.
    """

    bounds: Sequence[float] = ()
    choices: Sequence[Any] = ()
    kind: str = "real"
    scale: str = "linear"
    unit: str = ""

    def __post_init__(self) -> None:
        """Check the settings."""
        known_name("scale", self.scale, ("linear", "log"))
        known_name("kind", self.kind, ("real", "integer"))
        if len(self.bounds) != 2 * (not self.choices):
            raise invalid("a variable", "given by bounds = [lower, upper] or choices", self.bounds)
        low, high = (finite_number("a bound", end) for end in self.bounds or (1, 1))
        if low > high or (self.scale == "log" and low <= 0):
            rule = "in increasing order, on a logarithmic scale above 0"
            raise invalid("bounds", rule, self.bounds)

    @property
    def variable(self) -> Any:
        """What pymoo calls it."""
        if self.choices:
            return Choice(options=list(self.choices))
        return (Real if self.kind == "real" else Integer)(bounds=tuple(map(float, self.bounds)))


class NamedProblem(ElementwiseProblem):
    """A problem of named variables, one design at a time; what it computes is found by name.

    Args:
        variables: Settings of variables by name; two numbers are bounds.
        objectives: Names of what is optimised.
        maximize: Those of them that are maximised.
        limits: On what is computed, such as ``{"stress": "<= 250", "f": ">= 1, <= 5"}``.
        requirements: Rules on variables, see :class:`Requirement`.
        units: Units of what is computed.
        name: Name of the problem.
        **kwargs: pymoo's own.
    """

    def __init__(
        self,
        variables: Mapping[str, Any],
        objectives: Sequence[str],
        maximize: Sequence[str] = (),
        limits: Mapping[str, str] | None = None,
        requirements: Any = None,
        *,
        units: Mapping[str, str],
        name: str,
        **kwargs: Any,
    ) -> None:
        require_known_keywords(type(self).__name__, ElementwiseProblem, kwargs, taken=OF_A_MODEL)
        given = mapping("variables", variables, "names to settings")
        given = {n: {"bounds": v} if isinstance(v, (tuple, list)) else v for n, v in given.items()}
        settings = sections("variables", Setting, given)
        self.variables = {n: setting.variable for n, setting in settings.items()}
        self.log = [n for n, setting in settings.items() if setting.scale == "log"]
        self.units = {n: s.unit for n, s in settings.items() if s.unit} | dict(units)
        self.objectives, self.maximize, self._name = [*objectives], [*maximize], name
        given = mapping("limits", limits or {}, "names to limits")
        self.limits = [limit for n, text in given.items() for limit in _limits(n, text)]
        self.requirements = requirements or {}
        self._required = requirements_of(self.requirements, [*self.variables])
        names = {f"f{j + 1}": n for j, n in enumerate(self.objectives)}
        names |= {f"g{j + 1}": f"{n}{s}{end:.12g}" for j, (n, s, end) in enumerate(self.limits)}
        kwargs |= {"n_obj": len(self.objectives), "n_ieq_constr": len(self.limits)}
        if all(isinstance(v, Real) for v in self.variables.values()):
            low, high = zip(*(v.bounds for v in self.variables.values()), strict=True)
            super().__init__(n_var=len(low), xl=np.array(low), xu=np.array(high), **kwargs)
            names |= {f"x{j + 1}": n for j, n in enumerate(self.variables)}
        else:
            super().__init__(vars=self.variables, **kwargs)
        self.names = names

    def name(self) -> str:
        """Return the name of the problem."""
        return self._name

    def values(self, design: Mapping[str, Any]) -> Mapping[str, float]:
        """Return what the model computes for a design, by name.

        Raises:
            EvaluationError: The design fails.
        """
        raise NotImplementedError

    def objectives_and_constraints(self, found: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
        """Return pymoo's F and G of what is computed, numbers or arrays."""
        F = [-found[n] if n in self.maximize else found[n] for n in self.objectives]
        return F, [(found[n] - end) * (1 if sign == "<=" else -1) for n, sign, end in self.limits]

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        design = dict(x) if isinstance(x, Mapping) else dict(zip(self.variables, x, strict=True))
        columns = {n: np.array([value]) for n, value in design.items()}
        for required in self._required:
            if required.violation(columns)[0] > 0:
                remedy = "give the algorithm Required(problem)"
                raise EvaluationError(x, f"it violates the requirement {required.name}; {remedy}")
        found = self.values(design)
        out["F"], out["G"] = self.objectives_and_constraints(found)
        out.update({n: value for n, value in found.items() if n not in self.objectives})


def sections(where: str, kind: type[Any], given: Any) -> dict[str, Any]:
    """Return named entries as values of a class."""
    entries = mapping(where, given, "names to settings")
    return {name: section(f"{where}: {name}", kind, entry) for name, entry in entries.items()}


def section(where: str, kind: type[Any], given: Any) -> Any:
    """Return a section of the file as a value of its class."""
    kinds = {f.name: f.type for f in fields(kind)}
    for word, value in mapping(where, given, "settings to values").items():
        if kinds[known_name(f"a setting of {where}", word, kinds)] == "str":
            instance(f"{where}: {word}", value, str)
    try:
        return kind(**given)
    except (ArgumentValueError, ArgumentTypeError) as error:
        raise type(error)(f"{where}: {error}") from None


def _limits(name: str, text: str) -> list[tuple[str, str, float]]:
    """Return the limits of a text such as ``>= 3, <= 250``: output, sign and number."""
    found = [_LIMIT.fullmatch(part) for part in str(text).split(",")]
    limits = [(name, each[1], float(each[2])) for each in found if each]
    if len(limits) < len(found):
        raise invalid(f"the limit on {name}", "such as '<= 250' or '>= 3, <= 250'", text)
    return limits
