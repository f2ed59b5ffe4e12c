"""Problems whose outputs have names, units and limits."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import msgspec
import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Choice, Integer, Real

from pymoo_psi._validation import (
    Entries,
    Names,
    Values,
    finite_number,
    invalid,
    known_name,
    mapping,
)
from pymoo_psi.errors import ArgumentTypeError, EvaluationError
from pymoo_psi.problems._design_space import numbered
from pymoo_psi.problems._pymoo import NO_OUTPUTS, OF_A_MODEL, require_known_keywords
from pymoo_psi.problems._requirements import requirements_of
from pymoo_psi.problems._wrapped import changes_designs_only, within_same_columns
from pymoo_psi.table import sides_of_text

# A message of msgspec; null stands for what is not given.
_MISFIT = re.compile(r"Expected `(.+?)(?: \| null)?`, got `(.+)` - at `\$\.(.+)`")


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

    bounds: Sequence[int | float] = ()
    choices: Sequence[str | bool | int | float] = ()
    kind: str = "real"
    scale: str = "linear"
    unit: str = ""

    def __post_init__(self) -> None:
        """Check the settings."""
        known_name("scale", self.scale, ("linear", "log"))
        known_name("kind", self.kind, ("real", "integer"))
        n_bounds = 0 if self.choices else 2
        if len(self.bounds) != n_bounds:
            raise invalid("a variable", "given by bounds = [lower, upper] or choices", self.bounds)
        if self.choices:
            if len({*map(str, self.choices)}) < len(self.choices):
                raise invalid("choices", "options of which no two are the same", self.choices)
            return
        low, high = (finite_number("bounds", end) for end in self.bounds)
        if low > high or (self.scale == "log" and low <= 0):
            raise invalid(
                "bounds", "in increasing order, on a logarithmic scale above 0", self.bounds
            )

    @property
    def variable(self) -> Any:
        """The variable in pymoo."""
        if self.choices:
            return Choice(options=list(self.choices))
        kind = Real if self.kind == "real" else Integer
        return kind(bounds=tuple(map(float, self.bounds)))


@dataclass(frozen=True)
class OutputLimit:
    """A limit on an output: a constraint.

    Attributes:
        output: Name of the output.
        sign: ``"<="`` or ``">="``.
        value: The limit.
    """

    output: str
    sign: str
    value: float

    @property
    def text(self) -> str:
        """The name of its constraint, with all digits of the limit."""
        number = f"{self.value:.12g}"  # studies of version 0.3 write 1e+12, too
        if float(number) != self.value:
            number = repr(self.value)
        return f"{self.output}{self.sign}{number}"

    def violation(self, output: Any) -> Any:
        """Return the amounts by which values of the output violate it, <= 0 where they meet it."""
        excess = output - self.value
        return excess if self.sign == "<=" else -excess


class NamedProblem(ElementwiseProblem):
    """A problem with named variables and outputs that evaluates one design at a time.

    Args:
        variables: Settings of variables by name; two numbers are bounds.
        objectives: Names of the outputs that are optimised.
        maximize: Those of them that are maximised.
        limits: On outputs, such as ``{"stress": "<= 250", "f": ">= 1, <= 5"}``.
        requirements: Rules on variables, see :class:`Requirement`.
        units: Units of outputs.
        name: Name of the problem.
        **kwargs: pymoo's own.
    """

    has_named_outputs = True  # in one study, other outputs may become objectives and limits

    def __init__(
        self,
        variables: Entries,
        objectives: Names,
        maximize: Names = (),
        limits: Entries | None = None,
        requirements: Any = None,
        *,
        units: Mapping[str, str],
        name: str,
        **kwargs: Any,
    ) -> None:
        require_known_keywords(type(self).__name__, ElementwiseProblem, kwargs, taken=OF_A_MODEL)
        settings = _settings(variables)
        self.variables = {name: setting.variable for name, setting in settings.items()}
        self.log = [name for name, setting in settings.items() if setting.scale == "log"]
        self.units = units_of(settings) | dict(units)
        self.objectives = [*objectives]
        if not objectives or len(set(objectives)) < len(objectives):
            raise invalid("objectives", "outputs named once, one or more", self.objectives)
        self.maximize = [*maximize]
        self.limits = _limits(limits)
        self.requirements = requirements
        self._required = requirements_of(requirements, [*self.variables])
        self._name = name
        limit_texts = [limit.text for limit in self.limits]
        self.names = numbered("f", self.objectives) | numbered("g", limit_texts)
        kwargs |= {"n_obj": len(self.objectives), "n_ieq_constr": len(self.limits)}
        if all(isinstance(variable, Real) for variable in self.variables.values()):
            # pymoo takes such variables as a vector, without names.
            self.names |= numbered("x", self.variables)
            bounds = np.array([variable.bounds for variable in self.variables.values()])
            super().__init__(n_var=len(bounds), xl=bounds[:, 0], xu=bounds[:, 1], **kwargs)
        else:
            super().__init__(vars=self.variables, **kwargs)

    def name(self) -> str:
        """Return the name of the problem."""
        return self._name

    def values(self, design: Entries) -> Entries:
        """Return the outputs of a design by name.

        Raises:
            EvaluationError: The design fails.
        """
        raise NotImplementedError

    def _evaluate(self, x: Any, out: Values, *args: Any, **kwargs: Any) -> None:
        design = dict(x if isinstance(x, Mapping) else zip(self.variables, x, strict=True))
        columns = {name: np.array([value]) for name, value in design.items()}
        for requirement in self._required:
            if requirement.violation(columns)[0] > 0:
                raise EvaluationError(
                    x,
                    f"it violates the requirement {requirement.name}; "
                    "give the algorithm Required(problem)",
                )
        if "seed" in kwargs:
            design["seed"] = kwargs["seed"]
        outputs = dict(self.values(design))
        out["G"] = [limit.violation(outputs[limit.output]) for limit in self.limits]
        out["F"] = []
        for name in self.objectives:
            value = outputs.pop(name)
            if name in self.maximize:
                value = -value
            out["F"].append(value)
        require_output_names(outputs)
        out.update(outputs)


def require_output_names(names: Collection[str]) -> None:
    """Check that no output has the name of an entry of pymoo's ``out``, which it would replace."""
    for name in names:
        if name in NO_OUTPUTS:
            rule = "named unlike the entries that pymoo has for a design"
            raise invalid("an output", rule, name, "rename it, such as 'force' instead of 'F'")


def known_limits(problem: Any) -> Sequence[OutputLimit]:
    """Return the limits on outputs that are the first constraints of a problem.

    A table shows them as limits, which can be changed without a test.
    """
    while changes_designs_only(problem) or within_same_columns(problem) is not problem:
        problem = problem.wrapped
    return problem.limits if isinstance(problem, NamedProblem) else []


def _settings(variables: Any) -> dict[str, Setting]:
    """Return the settings of variables, of which some may be given by their bounds alone."""
    entries = {}
    for name, entry in mapping("variables", variables, "names to settings").items():
        entries[name] = {"bounds": entry} if isinstance(entry, (tuple, list)) else entry
    if not entries:
        raise invalid("variables", "one or more", variables)
    return sections("variables", Setting, entries)


def _limits(texts: Any) -> list[OutputLimit]:
    """Return the limits of texts by output; a text may have two."""
    limits: list[OutputLimit] = []
    if texts is None:
        return limits
    for output, text in mapping("limits", texts, "outputs to texts, as '<= 250'").items():
        for sign, value in sides_of_text(f"the limit on {output}", text).items():
            limits.append(OutputLimit(output, sign, value))
    return limits


def units_of(entries: Entries) -> dict[str, str]:
    """Return the units of variables or outputs that have one, by name."""
    return {name: entry.unit for name, entry in entries.items() if entry.unit}


def sections(where: str, kind: type[Any], entries: Any) -> Values:
    """Return named entries of a file as values of a class."""
    entries = mapping(where, entries, "names to settings")
    return {name: section(f"{where}: {name}", kind, entry) for name, entry in entries.items()}


def section(where: str, kind: type[Any], entry: Any) -> Any:
    """Return a section of a file as a value of its class, whose annotations are its schema."""
    settings = [setting.name for setting in fields(kind)]
    for word in mapping(where, entry, "settings to values"):
        known_name(f"a setting of {where}", word, settings)
    # NumPy's numbers and arrays, and ranges, become Python's numbers and lists.
    plain = msgspec.to_builtins(entry, enc_hook=lambda value: np.asarray(value).tolist())
    try:
        return msgspec.convert(plain, kind)
    except msgspec.ValidationError as error:
        problem = error.__cause__  # an error of the class itself
        if problem is None:
            message = str(error).replace("array", "list")
            problem = ArgumentTypeError(_MISFIT.sub(r"\3 must be of type \1, got \2", message))
        raise type(problem)(f"{where}: {problem}") from None
