"""Algorithms: Parameter Space Investigation, and NSGA-III as the alternative."""

from pymoo_psi.algorithms.nsga3 import nsga3
from pymoo_psi.algorithms.psi import PSI

__all__ = ["PSI", "nsga3"]
