"""What a table and a study say of a problem: its columns, and what makes it the problem it is."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import collection, invalid, known_name, mapping
from pymoo_psi.problems._design_space import DesignSpace
from pymoo_psi.table import Layout


def problem_layout(
    problem: Any,
    space: DesignSpace,
    names: Mapping[str, str] | None = None,
    maximize: Collection[str] | None = None,
    units: Mapping[str, str] | None = None,
) -> Layout:
    """Return the columns of a problem's tests, under the user's names.

    Args:
        problem: A pymoo problem, which may have attributes ``names``, ``maximize`` and ``units``.
        space: Its variables.
        names: The user's names of columns by their default names, instead of the attribute.
        maximize: The criteria that ``out["F"]`` holds with the sign turned, by the user's names,
            likewise.
        units: Units by the user's names, likewise; also of further outputs.

    Raises:
        ArgumentValueError: There is no such column, or two would have one name.
        ArgumentTypeError: A name or unit is not text, or an argument of another type.
    """
    renamed = names is not None
    names = _mapping("names", names, getattr(problem, "names", None))
    units = _mapping("units", units, getattr(problem, "units", None))
    told = getattr(problem, "maximize", None)
    told = () if told is None else told
    if maximize is None:
        maximize = told
    elif maximize and not renamed and (lost := [name for name in told if name not in maximize]):
        rule = f"a list with what the problem says itself, {', '.join(told)}"
        remedy = f"add {lost[0]!r}, or change the problem's attribute"
        raise invalid("maximize", rule, maximize, remedy)
    rule = "a list of criteria, such as ['efficiency']"
    collection("maximize", maximize, rule, "one goes into a list too")
    kinds = [variable.kind for variable in space.variables]
    discrete = np.array([kind in (Kind.BINARY, Kind.CHOICE) for kind in kinds])
    plain = Layout.of(space.names, problem.n_obj, problem.n_ieq_constr, problem.n_eq_constr)
    for name in names:
        known_name("names", name, plain.columns)
    groups = (plain.variables, plain.objectives, plain.inequalities, plain.equalities)
    return Layout.of(
        *([names.get(name, name) for name in group] for group in groups),
        maximize=list(maximize),
        units=units,
        lower=np.where(discrete, np.nan, space.lower),  # of no meaning there
        upper=np.where(discrete, np.nan, space.upper),
        kinds=kinds,
    )


def _mapping(argument: str, given: Mapping[str, str] | None, attribute: Any) -> Mapping[str, str]:
    """Return what is told of a problem's columns: by the argument, or else by its attribute."""
    told = given if given is not None else {} if attribute is None else attribute
    whose = argument if given is not None else f"the attribute {argument} of the problem"
    return mapping(whose, told, "names to texts", f"see the argument {argument} of PSI")


def problem_identity(problem: Any, space: DesignSpace) -> dict[str, Any]:
    """Return what is known of a problem without its bounds, as plain values.

    Name, variables, sizes and bounds do not tell everything, such as a constant of the model.
    A problem adds to it by a method ``fingerprint()`` that returns a mapping, as the chute does
    with its parameters.
    """
    own = getattr(problem, "fingerprint", None)
    return {
        "problem": problem.name(),
        "variables": [[v.name, v.kind.value, *map(str, v.options)] for v in space.variables],
        "objectives": problem.n_obj,
        "inequality constraints": problem.n_ieq_constr,
        "equality constraints": problem.n_eq_constr,
        "parameters": own() if callable(own) else {},
    }
