"""Scalarising functions: one number for each design, the least of which is chosen.

Compromise programming takes the designs nearest to the utopian point U in a weighted L_p norm.
With d = (f − U) / (N − U), or d = f − U without normalising, the distance is

    (Σ_j (w_j d_j)^p)^(1/p),      max_j w_j d_j  for p = ∞

(Yu 1973; Zeleny 1973). At p = 1 the objectives trade off fully, at p = ∞ the worst of them alone
counts.

The achievement function (Wierzbicki 1980) measures from a reference point r that the user aspires
to instead of U: max_j w_j (f_j − r_j) / (N_j − U_j). It is below 0 where a design is better than r
in every objective, and then still prefers the design that is better by most.

The bulge (Das, Structural Optimization 18, 1999) is how far a design lies beyond the plane that the
extreme designs span, on the side of U. Where it is largest is the knee: from there, every objective
improves at a higher price than between the extremes. A set that is straight or bulges away from U
has none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto._ranking import EfficiencyRanking, front_of
from pymoo_psi.pareto._rounding import LAST_PLACES, levels, unit_lengths

Array = NDArray[np.float64]

# Bulges below this share of the ranges are none. A plane through extremes is right to about
# 1e-16 / 1e-6 of them, see below, and no one chooses by a billionth.
_STRAIGHT = 1e-9
# Extremes whose directions from U differ by less than this span no plane: the set is degenerate.
_FLAT = 1e-6


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


def knee(ranking: EfficiencyRanking) -> NDArray[np.intp]:
    """Return the indices of the Pareto-optimal rows that bulge most, equal up to rounding.

    The extreme design of an objective is the one that is worst in it for the best in all others:
    of least largest, then least sum of the others, in units of the ranges (Deb and Jain 2014). The
    result does not depend on units: a plane stays a plane in any.

    Returns:
        No index if no design lies beyond the plane, if the extremes span none, or none that faces
        U, so that no objective could be given up for the others.
    """
    front, values = front_of(ranking)
    best = values.min(axis=0)
    lengths = unit_lengths(best, values.max(axis=0))
    d = ((values - best) / lengths)[:, np.isfinite(lengths)]
    bulge = _bulges(d)
    if bulge.max(initial=0.0) <= _STRAIGHT:
        return front[:0]
    most: NDArray[np.intp] = front[levels(-bulge, _STRAIGHT) == 0]
    return most


def _bulges(d: Array) -> Array:
    """Return how far ``(n, m)`` points lie beyond the plane of the extremes; 0 if there is none."""
    n, m = d.shape
    extremes = np.empty((m, m))
    for j in range(m if m > 1 else 0):
        others = np.delete(d, j, axis=1)
        extremes[j] = d[np.lexsort((d[:, j], others.sum(axis=1), others.max(axis=1)))[0]]
    if m < 2 or np.linalg.matrix_rank(extremes, tol=_FLAT) < m:
        return np.zeros(n)
    normal = np.linalg.solve(extremes, np.ones(m))  # the plane is d·normal = 1
    if (normal <= 0).any():
        return np.zeros(n)
    bulges: Array = (1 - d @ normal) / np.linalg.norm(normal)
    return bulges
