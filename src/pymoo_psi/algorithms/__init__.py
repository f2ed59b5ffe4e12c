"""Algorithms: sampling, Parameter Space Investigation, NSGA-III as the alternative, refinement."""

from pymoo_psi.algorithms._investigate import investigate
from pymoo_psi.algorithms._nsga3 import nsga3
from pymoo_psi.algorithms._psi import PSI
from pymoo_psi.algorithms._refinement import Refinement, refine
from pymoo_psi.algorithms._sampling import LPTauSampling, QMCSampling

__all__ = ["PSI", "LPTauSampling", "QMCSampling", "Refinement", "investigate", "nsga3", "refine"]
