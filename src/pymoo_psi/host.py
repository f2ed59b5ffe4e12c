"""What the package needs to know of pymoo, its host: keyword arguments and box bounds."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_psi.arguments import Received, broken_rule
from pymoo_psi.errors import ArgumentTypeError

__all__ = ["box_bounds", "require_known_keywords", "require_problem"]

Array = NDArray[np.float64]


def require_known_keywords(
    owner: str, base: type, given: Mapping[str, Any], *, taken: Collection[str] = ()
) -> None:
    """Refuse keyword arguments that ``base`` does not name; pymoo itself swallows any.

    Args:
        owner: Name of the callable, for the message.
        base: The pymoo class; keywords of its constructor and its bases' are allowed.
        given: The keyword arguments received.
        taken: Keywords of ``base`` that the owner sets itself.

    Raises:
        ArgumentTypeError: There is a keyword that is not allowed.
    """
    known = {
        name
        for cls in base.__mro__[:-1]
        for name, parameter in inspect.signature(cls).parameters.items()
        if parameter.kind is not inspect.Parameter.VAR_KEYWORD and name not in taken
    }
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise ArgumentTypeError(f"{owner} got an unknown keyword argument {name!r}{hint}")


def require_problem(problem: object) -> None:
    """Refuse anything that is not a pymoo problem."""
    if not isinstance(problem, Problem):
        hint = "; pass an instance, not the class" if isinstance(problem, type) else ""
        raise ArgumentTypeError(f"problem must be a pymoo Problem, got {problem!r:.80}{hint}")


def box_bounds(problem: Any) -> tuple[Array, Array]:
    """Return the bounds of the box of a pymoo problem.

    Returns:
        Lower and upper bounds, ``(n_var,)`` each.

    Raises:
        ArgumentTypeError: The variables are not all continuous.
        ArgumentValueError: A bound is missing, infinite or the wrong way round.
    """
    if getattr(problem, "vars", None) is not None or problem.vtype not in (None, float):
        raise ArgumentTypeError(
            f"{problem.name()} must have continuous variables, got "
            f"{'mixed variables' if problem.vtype is None else problem.vtype!r}"
        )
    bounds = []
    for name, value in (("xl", problem.xl), ("xu", problem.xu)):
        bound = np.full(problem.n_var, np.nan) if value is None else np.asarray(value, dtype=float)
        if not np.isfinite(bound).all():
            raise broken_rule(
                f"{name} of {problem.name()}",
                "finite for every variable",
                value,
                "test points are laid out in a box",
            )
        bounds.append(bound)
    lower, upper = bounds
    if (lower > upper).any():
        j = int(np.flatnonzero(lower > upper)[0])
        raise broken_rule(
            f"xl of {problem.name()}",
            "at most xu",
            Received(f"{lower[j]} > {upper[j]} for variable {j + 1}"),
        )
    return lower, upper
