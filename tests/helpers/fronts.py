"""Sets of designs that bend, and what is asked of any set: its front, in shares of its ranges."""

import numpy as np

from pymoo_psi import rank_of_efficiency


def on_sphere(rng, n, m):
    """Random points on the part of the unit sphere without negative coordinates."""
    F = np.abs(rng.standard_normal((n, m)))
    return F / np.linalg.norm(F, axis=1)[:, None]


def in_shares(F, point=0.0, normalize=True):
    """Rows, and a point, in units of the ranges of the Pareto-optimal rows; and which these are."""
    front = np.flatnonzero(rank_of_efficiency(F).pareto)
    lengths = np.ptp(F[front], axis=0)
    lengths = np.where(lengths == 0, np.inf, lengths) if normalize else 1.0
    return front, (F[front] - point) / lengths
