"""Acceptability: for how many weights of the objectives a design is the best, or near it.

A weighted distance to the ideal point needs weights, which are seldom known. The rank
acceptability of a design is the share of the possible weights for which it has a certain place
(SMAA-2; Lahdelma and Salminen, Operations Research 49, 2001). The weights are LPτ points, mapped
to the simplex.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from pymoo_psi._numbers import percents
from pymoo_psi._validation import Array, Integers, Rows, integer, invalid, is_real
from pymoo_psi.pareto._dominance import first_equal
from pymoo_psi.pareto._ranking import EfficiencyRanking, rank_of_efficiency
from pymoo_psi.pareto._sentences import sentence
from pymoo_psi.sequences import MAX_DIMENSIONS, lp_tau

_N_WEIGHTS = 8192  # a power of 2, so that they are evenly distributed
_MANY = 10_000  # designs above which there are fewer weights
_N_WEIGHTS_OF_MANY = 2048
_BLOCK = 300_000  # products that are computed at once, so that the cache of a core holds them
_P_MOST = 32  # the exponent from which on powers of distances would underflow
CHEBYSHEV_SUM = 1e-9  # the part of the sum in the Chebyshev distance, which breaks ties
_MOST_BLOCKS = 256  # so many weights of the simplex are tried for each one within a factor
_FACTOR = 2.0  # the factor between weights in the sentence
_MOST_WEIGHTS = MAX_DIMENSIONS + 1  # of sum 1, so that the last one follows from the others


def acceptability(
    F: Any,
    *,
    factor: float | None = None,
    p: float = 2,
    places: int = 3,
    normalize: bool | None = None,
    maximize: Collection[Any] = (),
) -> Array:
    """Return for which share of the weights each design is the best, the second, the third.

    The distance is that of :class:`pymoo_psi.CompromiseProgramming`: the L_p norm of the weighted
    differences from the ideal point. A weight multiplies a difference before it is squared (p = 2),
    so that twice the weight counts four times. The weights sum to 1 and are uniformly distributed:
    8192 LPτ points, or 2048 for more than 10 000 optimal designs. An objective in which all
    Pareto-optimal designs are equal has no weight. Standard errors of the shares are usually below
    0.003.

    Args:
        F: ``(n, m)`` objective values, or anything else that
            :func:`pymoo_psi.rank_of_efficiency` accepts, or a ranking. The Pareto-optimal designs
            differ in at most 52 objectives.
        factor: Only weights between 1 / factor and factor times equal ones; all unless given. It is
            any number above 1 with up to 16 objectives, and from 2 on with 52.
        p: Order of the norm, from 1 to 32, or ``numpy.inf``; 2 is that of the Salukvadze optimum.
        places: Number k of places.
        normalize: As for :func:`pymoo_psi.rank_of_efficiency`.
        maximize: As for :func:`pymoo_psi.rank_of_efficiency`.

    Returns:
        ``(n, k)`` shares, from 0 to 1, of a table those of the designs that its
        ``feasible_ranking()`` ranks. Equal designs share a place; dominated ones have none.

    Raises:
        ArgumentValueError: ``F`` does not fit, or another argument is out of its range.

    Example:
        Known weights leave no doubt; weights within a factor of two leave some.

        >>> F = [[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]
        >>> acceptability(F)[:, 0].round(2), acceptability(F, factor=1.5)[:, 0].round(2)
        (array([0.25, 0.46, 0.3 ]), array([0., 1., 0.]))
    """
    require_norm(p, factor)
    places = integer("places", places, minimum=1)
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    terms, weighted = weighted_terms(ranking)
    n_weights = _N_WEIGHTS
    if len(terms) > _MANY:
        n_weights = _N_WEIGHTS_OF_MANY
    weights = simplex_weights(n_weights, len(weighted), factor)
    first = first_equal(terms)
    different = np.flatnonzero(first == np.arange(len(first)))
    nearest = different[nearest_designs(terms[np.ix_(different, weighted)], weights, p, places)]
    shares = np.zeros((len(ranking.pareto), places))
    for place, designs in enumerate(nearest.T):
        counts = np.bincount(designs, minlength=len(terms))
        shares[ranking.front, place] = counts[first] / n_weights
    return shares


def weight_shares(ranking: EfficiencyRanking) -> Array:
    """Return ``(n,)`` shares of the weights within a factor of two for which designs are the best.

    They are 0 for all designs where there is nothing to weigh.
    """
    if not 2 <= np.count_nonzero(np.ptp(ranking.optimal, axis=0)) <= _MOST_WEIGHTS:
        return np.zeros(len(ranking.pareto))
    return acceptability(ranking, factor=_FACTOR, places=1)[:, 0]


def weights_sentence(ranking: EfficiencyRanking, row: int, shares: Array) -> str:
    """Say for how many weights within a factor of two a design is the best, and which one else.

    Args:
        ranking: The ranking.
        row: Row of the design; a Pareto-optimal one.
        shares: ``(n,)`` :func:`weight_shares` of the ranking.

    Returns:
        The sentence; none if there is nothing to weigh.
    """
    if not shares.any():
        return ""
    design = ranking.name_of(row)
    others = shares.copy()
    others[row] = 0.0
    other = int(others.argmax())
    if others[other] == 0:
        return sentence("all weights", design=design)
    texts = percents(shares)
    return sentence(
        "weights",
        design=design,
        share=texts[row],
        other=ranking.name_of(other),
        rest=texts[other],
    )


def require_norm(p: float, factor: float | None) -> None:
    """Refuse an order of the norm or a factor of weights that is out of its range."""
    # The comparisons reject NaN, too.
    if not is_real(p) or not (1 <= p <= _P_MOST or p == np.inf):
        raise invalid("p", f"a number from 1 to {_P_MOST}, or inf", p)
    if factor is not None and not (is_real(factor) and factor > 1):
        raise invalid("factor", "a number above 1, or None for all weights", factor)


def weighted_terms(ranking: EfficiencyRanking) -> tuple[Array, Rows]:
    """Return what weights multiply: distances of the Pareto-optimal designs from the ideal point.

    Returns:
        ``(k, m)`` their distances in each objective, from 0 to 1; and the objectives that have a
        weight: those that are not equal for all, or the first one.
    """
    terms = np.maximum(ranking.frame.scaled(ranking.optimal), 0.0)
    terms /= terms.max() or 1.0  # no sum overflows
    weighted = np.flatnonzero(np.ptp(terms, axis=0))
    if not len(weighted):
        weighted = np.arange(1)
    return terms, weighted


def simplex_weights(n: int, m: int, factor: float | None) -> Array:
    """Return ``(n, m)`` weights of sum 1, uniformly distributed; n is a power of 2.

    Raises:
        ArgumentValueError: Hardly any are within the factor, or m is more than 52.
    """
    if m == 1:
        return np.ones((n, 1))
    low = 0.0
    high = 1.0
    if factor is not None:
        low = 1 / (m * factor)
        high = factor / m
    blocks = []
    missing = n
    for first in range(1, 1 + n * _MOST_BLOCKS, n):
        cube = (lp_tau(n, m - 1, first=first) + 0.5 / n) % 1.0  # off the faces
        weights = low + (1 - m * low) * _on_simplex(cube)
        blocks.append(weights[(weights <= high).all(axis=1)][:missing])
        missing -= len(blocks[-1])
        if missing == 0:
            return np.concatenate(blocks)
    rule = f"larger for {m} objectives"
    raise invalid("factor", rule, factor, "hardly any weights are within it")


def _on_simplex(cube: Array) -> Array:
    """Return ``(n, m)`` uniform points of the simplex from uniform ones of the unit cube.

    Each coordinate breaks a part off what is left of 1, so that near points stay near.
    """
    n, last = cube.shape
    weights = np.empty((n, last + 1))
    left = np.ones(n)
    for j in range(last):
        weights[:, j] = left * (1 - cube[:, j] ** (1 / (last - j)))
        left = left - weights[:, j]
    weights[:, last] = left
    return np.maximum(weights, 0.0)


def nearest_designs(designs: Array, weights: Array, p: float, places: int) -> Integers:
    """Return ``(k, places)`` the nearest design for each weight, the second nearest, ….

    Args:
        designs: ``(n, m)`` different terms from 0 to 1, before they are weighted.
        weights: ``(k, m)`` weights.
        p: Order of the norm.
        places: How many places; at most n are returned.
    """
    weights = weights / weights.max(axis=1)[:, None]
    if not np.isinf(p):
        weights = weights**p
        designs = designs**p  # no root is taken, as it changes no order
    terms = np.ascontiguousarray(designs.T)
    nearest = []
    for block in np.array_split(weights, weights.size * len(designs) // _BLOCK + 1):
        distances = weighted_distances(terms, block, p)
        best = []
        for _ in range(min(places, len(designs))):
            best.append(distances.argmin(axis=1))
            distances[np.arange(len(block)), best[-1]] = np.inf
        nearest.append(np.column_stack(best))
    return np.concatenate(nearest)


def weighted_distances(terms: Array, weights: Array, p: float) -> Array:
    """Return ``(k, n)`` distances, which for a finite p are still to the power p.

    Args:
        terms: ``(m, n)`` terms of n designs, to the power p if it is finite.
        weights: ``(k, m)`` weights, likewise.
        p: Order of the norm.
    """
    if not np.isinf(p):
        return weights @ terms
    distances = np.zeros((len(weights), terms.shape[1]))
    for weight, term in zip(weights.T, terms, strict=True):
        np.maximum(distances, weight[:, None] * term, out=distances)
    return distances + CHEBYSHEV_SUM * weights @ terms
