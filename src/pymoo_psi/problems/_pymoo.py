"""What is checked before anything is handed to pymoo."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Collection, Mapping
from typing import Any

from pymoo.core.problem import Problem

from pymoo_psi.errors import ArgumentTypeError


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
    # every class on the way to object, since pymoo's constructors pass **kwargs up by name
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
