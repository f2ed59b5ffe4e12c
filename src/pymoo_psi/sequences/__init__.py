"""Uniformly distributed sequences: Sobol's LPτ test points in their natural order."""

from pymoo_psi.sequences.lp_tau import MAX_DIMENSIONS, lp_tau

__all__ = ["MAX_DIMENSIONS", "lp_tau"]
