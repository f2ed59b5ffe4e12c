"""Uniformly distributed sequences: Sobol's LPτ test points.

Example:
    The points come in natural order, numbered from 1 (the origin), for up to 51 dimensions, any
    number of them and from any number on. ``scipy.stats.qmc.Sobol`` orders its points by Gray code
    and, from dimension 3, has other points.

    >>> from pymoo_psi import lp_tau
    >>> lp_tau(3, 2, first=2)
    array([[0.5 , 0.5 ],
           [0.25, 0.75],
           [0.75, 0.25]])

    They start any algorithm of pymoo as :class:`pymoo_psi.LPTauSampling`; SciPy's engines do as
    :class:`pymoo_psi.QMCSampling`.

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
