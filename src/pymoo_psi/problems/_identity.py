"""What a table and a study say of a problem: its columns, and what makes it the problem it is."""

from __future__ import annotations

from typing import Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi.problems._design_space import DesignSpace
from pymoo_psi.table import Layout


def problem_layout(problem: Any, space: DesignSpace) -> Layout:
    """Return the columns of a problem's tests."""
    kinds = [variable.kind for variable in space.variables]
    discrete = np.array([kind in (Kind.BINARY, Kind.CHOICE) for kind in kinds])
    return Layout.of(
        space.names,
        problem.n_obj,
        problem.n_ieq_constr,
        problem.n_eq_constr,
        lower=np.where(discrete, np.nan, space.lower),  # of no meaning there
        upper=np.where(discrete, np.nan, space.upper),
        kinds=kinds,
    )


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
