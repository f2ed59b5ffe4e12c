"""Uniformly distributed sequences: Sobol's LPτ test points in their natural order."""

from pymoo_psi.sequences._lp_tau import lp_tau

__all__ = ["lp_tau"]
