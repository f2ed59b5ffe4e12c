"""What the package asks of pymoo's problems, and reads off them, before it works with them."""

from pymoo_psi.host.checks import require_known_keywords, require_problem
from pymoo_psi.host.design_space import DesignSpace, Variable, design_space

__all__ = ["DesignSpace", "Variable", "design_space", "require_known_keywords", "require_problem"]
