"""Algorithms: sampling, PSI, learning from its tests, NSGA-III as the alternative, refinement."""

from pymoo_psi.algorithms._investigate import investigate
from pymoo_psi.algorithms._nsga3 import nsga3
from pymoo_psi.algorithms._psi import PSI
from pymoo_psi.algorithms._refinement import Refinement, refine
from pymoo_psi.algorithms._sampling import LPTauSampling, QMCSampling
from pymoo_psi.algorithms._surrogate import SurrogatePSI

__all__ = [
    "PSI",
    "LPTauSampling",
    "QMCSampling",
    "Refinement",
    "SurrogatePSI",
    "investigate",
    "nsga3",
    "refine",
]
