"""Compromise programming: the designs nearest to the utopian point U in a weighted L_p norm.

With d = (f − U) / (N − U), or d = f − U without normalising, the distance is

    (Σ_j (w_j d_j)^p)^(1/p),      max_j w_j d_j  for p = ∞

(Yu 1973; Zeleny 1973). At p = 1 the objectives trade off fully, at p = ∞ the worst of them alone
counts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto._ranking import EfficiencyRanking
from pymoo_psi.pareto._rounding import LAST_PLACES, levels, settled

Array = NDArray[np.float64]


def nearest_compromise(ranking: EfficiencyRanking, p: float, weights: Array) -> NDArray[np.intp]:
    """Return the indices of the Pareto-optimal rows nearest to U, equal up to rounding.

    For p = ∞ many rows may share the worst term. Of these the one with the least sum of terms is
    taken: the augmented Chebyshev distance max + ρ Σ in the limit of a small ρ.

    Args:
        ranking: Gives U, the scale and the rows.
        p: Order of the norm, 1 <= p <= inf.
        weights: ``(m,)`` weights >= 0.
    """
    front = np.flatnonzero(ranking.pareto)
    F, frame = settled(ranking.objectives.minimized[front]), ranking.frame
    d = frame.scaled(F)
    unit = d.max() or 1.0  # so that no sum of terms overflows
    terms, noise = weights * (d / unit), LAST_PLACES * (weights * (frame.sizes(F) / unit))
    for order in (p, 1.0) if np.isinf(p) else (p,):
        tolerance = float(_norm(noise[None, :], order)[0])
        nearest = levels(_norm(terms, order), tolerance) == 0
        front, terms = front[nearest], terms[nearest]
    return front


def _norm(terms: Array, p: float) -> Array:
    """Return the L_p norms of rows >= 0, which do not underflow at a large p."""
    largest: Array = terms.max(axis=1)
    if np.isinf(p):
        return largest
    share = terms / np.where(largest > 0, largest, 1.0)[:, None]
    norms: Array = largest * (share**p).sum(axis=1) ** (1 / p)
    return norms
