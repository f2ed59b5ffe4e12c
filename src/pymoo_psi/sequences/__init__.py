"""Uniformly distributed sequences: Sobol's LPτ test points.

Example:
    The points are in natural order, numbered from 1 (the origin), in up to 51 dimensions. Any
    number of points may start at any number. ``scipy.stats.qmc.Sobol`` orders its points by Gray
    code and, from dimension 3 on, has other points.

    >>> from pymoo_psi import lp_tau
    >>> lp_tau(3, 2, first=2)
    array([[0.5 , 0.5 ],
           [0.25, 0.75],
           [0.75, 0.25]])

    :class:`pymoo_psi.LPTauSampling` starts any algorithm of pymoo from these points,
    :class:`pymoo_psi.QMCSampling` from those of SciPy's engines.

    >>> from pymoo.algorithms.moo.nsga2 import NSGA2
    >>> from pymoo_psi import LPTauSampling
    >>> algorithm = NSGA2(pop_size=100, sampling=LPTauSampling())
"""

from pymoo_psi.sequences._lp_tau import lp_tau

# Names that other subpackages share; they are no promise to users.
# isort: split
from pymoo_psi.sequences._lp_tau import MAX_DIMENSIONS as MAX_DIMENSIONS
from pymoo_psi.sequences._lp_tau import lp_tau_at as lp_tau_at

__all__ = [
    "lp_tau",
]
