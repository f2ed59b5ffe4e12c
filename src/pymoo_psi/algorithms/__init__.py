"""Algorithms: Parameter Space Investigation, and NSGA-III as the alternative, refinement."""

from pymoo_psi.algorithms.investigate import investigate
from pymoo_psi.algorithms.nsga3 import nsga3
from pymoo_psi.algorithms.psi import PSI
from pymoo_psi.algorithms.refine import Refinement, refine

__all__ = ["PSI", "Refinement", "investigate", "nsga3", "refine"]
