"""What a problem is recognised by, where runs on it or a reference for it are kept."""

from __future__ import annotations

import json
from typing import Any

from pymoo_psi.algorithms.memory import problem_identity
from pymoo_psi.host import design_space

__all__ = ["problem_text"]


def problem_text(problem: Any) -> str:
    """Return name, variables, bounds, sizes and own fingerprint of a problem as JSON."""
    space = design_space(problem)
    bounds = {"lower": space.lower.tolist(), "upper": space.upper.tolist()}
    return json.dumps({**problem_identity(problem, space), **bounds}, sort_keys=True, indent=1)
