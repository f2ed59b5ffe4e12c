"""Scalarising functions: one number for each design, the least of which is chosen.

Compromise programming takes the designs nearest to the utopian point U in a weighted L_p norm.
With d = (f − U) / (N − U), or d = f − U without normalising, the distance is

    (Σ_j (w_j d_j)^p)^(1/p),      max_j w_j d_j  for p = ∞

(Yu 1973; Zeleny 1973). At p = 1 the objectives trade off fully, at p = ∞ the worst of them alone
counts.

The achievement function (Wierzbicki 1980) measures from a reference point r that the user aspires
to instead of U: max_j w_j (f_j − r_j) / (N_j − U_j). It is below 0 where a design is better than r
in every objective, and then still prefers the design that is better by most.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto._ranking import EfficiencyRanking, front_of
from pymoo_psi.pareto._rounding import LAST_PLACES, levels

Array = NDArray[np.float64]


# NumPy 1 tells of an overflow where it divides denormal numbers by one another.
@np.errstate(over="ignore")
def nearest_compromise(ranking: EfficiencyRanking, p: float, weights: Array) -> NDArray[np.intp]:
    """Return the indices of the Pareto-optimal rows nearest to U, equal up to rounding.

    For p = ∞ many rows may share the worst term. Of these the one with the least sum of terms is
    taken: the augmented Chebyshev distance max + ρ Σ in the limit of a small ρ.

    Args:
        ranking: Gives U, the scale and the rows.
        p: Order of the norm, 1 <= p <= inf.
        weights: ``(m,)`` weights >= 0.
    """
    (front, F), frame = front_of(ranking), ranking.frame
    d = frame.scaled(F)
    unit = d.max() or 1.0  # so that no sum of terms overflows
    terms, noise = weights * (d / unit), LAST_PLACES * (weights * (frame.sizes(F) / unit))
    for order in (p, 1.0) if np.isinf(p) else (p,):
        tolerance = float(_norm(noise[None, :], order)[0])
        nearest = levels(_norm(terms, order), tolerance) == 0
        front, terms = front[nearest], terms[nearest]
    return front


@np.errstate(over="ignore")  # likewise
def highest_achievement(
    ranking: EfficiencyRanking, point: Array, weights: Array
) -> NDArray[np.intp]:
    """Return the indices of the Pareto-optimal rows of the least achievement function.

    As for p = ∞ above, ties in the worst term are decided by the sum of the terms. With U for the
    reference point both choose the same.

    Args:
        ranking: Gives the scale and the rows.
        point: ``(m,)`` the reference point, minimised; anywhere.
        weights: ``(m,)`` weights >= 0.
    """
    (front, F), frame = front_of(ranking), ranking.frame
    d = (F - point) / frame.scale
    unit = np.abs(d).max() or 1.0
    terms = weights * (d / unit)
    sizes = np.maximum(frame.sizes(F), np.abs(point / frame.scale))
    noise = LAST_PLACES * (weights * (sizes / unit))
    for measure, tolerance in ((np.max, noise.max()), (np.sum, noise.sum())):
        best = levels(measure(terms, axis=1), float(tolerance)) == 0
        front, terms = front[best], terms[best]
    return front


def _norm(terms: Array, p: float) -> Array:
    """Return the L_p norms of rows >= 0, which do not underflow at a large p."""
    largest: Array = terms.max(axis=1)
    if np.isinf(p):
        return largest
    share = terms / np.where(largest > 0, largest, 1.0)[:, None]
    norms: Array = largest * (share**p).sum(axis=1) ** (1 / p)
    return norms
