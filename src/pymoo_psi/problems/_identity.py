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
        maximize: The objectives that ``out["F"]`` holds with the sign turned, by the user's names;
            all that the attribute has, unless ``names`` are given.
        units: Units by the user's names, as for ``names``; also of further outputs.

    Raises:
        ArgumentValueError: There is no such column, or two would have one name.
        ArgumentTypeError: A name or unit is not text, or an argument of another type.
    """
    own = getattr(problem, "maximize", None) or ()
    if maximize is None:
        maximize = own
    collection("maximize", maximize, "a list of objectives", "one goes into a list too")
    if maximize and names is None and not set(own) <= set(maximize):
        rule = f"a list with what the problem says itself, {', '.join(own)}"
        raise invalid("maximize", rule, maximize, "or change the problem's attribute")
    names, units = (
        mapping(
            name,
            getattr(problem, name, None) or {} if given is None else given,
            "names to texts",
            "also as an attribute of the problem",
        )
        for name, given in (("names", names), ("units", units))
    )
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


def problem_identity(problem: Any, space: DesignSpace) -> dict[str, Any]:
    """Return what is known of a problem without its bounds, as plain values.

    Name, variables, sizes and bounds are not everything, such as a constant of the model.
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
