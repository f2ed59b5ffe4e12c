"""Uniformly distributed sequences: Sobol's LPτ test points, and how well points cover a cube."""

from pymoo_psi.sequences._covering import covering_radius
from pymoo_psi.sequences._lp_tau import lp_tau

__all__ = ["covering_radius", "lp_tau"]
