"""What the package asks of pymoo's problems, and reads off them, before it works with them."""

from pymoo_psi.host.checks import require_known_keywords, require_problem
from pymoo_psi.host.design_space import DesignSpace, Variable, design_space
from pymoo_psi.host.releases import random_generator

__all__ = [
    "DesignSpace",
    "Variable",
    "design_space",
    "random_generator",
    "require_known_keywords",
    "require_problem",
]
