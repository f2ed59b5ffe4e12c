"""How sure a decision on the means of repeated tests is.

The noise of an objective is taken to be normal and independent. Its variance is pooled from the
differences between tests of the same designs, unless a design has five tests or more.
"""

from __future__ import annotations

import numpy as np

from pymoo_psi._validation import Array, Integers
from pymoo_psi.pareto._dominance import nondominated, unit_lengths
from pymoo_psi.pareto._ranking import EfficiencyRanking

NEAR_BEST = 0.05
"""Designs at most 5 % farther from the ideal point than the best one are as good as it."""

_MANY_TESTS = 5  # of a design, from which on the variance is its own
_SAMPLES = 1000
_MANY = 2000  # designs above which there are fewer samples
_SAMPLES_OF_MANY = 200
_FEWEST_FOR_PRIOR = 5  # designs for each objective from which on means are shrunk
_LEAST_VARIANCE = 1e-9  # on scaled objectives, so that no matrix is singular
_SEED = 1
_ROUNDING = 1e-9  # the relative difference up to which distances are equal


@np.errstate(divide="ignore", invalid="ignore")
def standard_errors(squares: Array, counts: Integers) -> Array:
    """Return the ``(n,)`` standard errors of the means of designs.

    Args:
        squares: ``(n,)`` sums of the squared deviations from the means.
        counts: ``(n,)`` numbers of tests.

    Returns:
        Not finite if no design has two tests, or this one has none.
    """
    degrees = np.maximum(counts - 1, 0)
    pooled = squares.sum() / degrees.sum()
    variances = np.where(counts < _MANY_TESTS, pooled, squares / degrees)
    return np.sqrt(variances / counts)


def probabilities(
    ranking: EfficiencyRanking, errors: Array, counts: Array | None = None
) -> tuple[Array, Array]:
    """Return what is probable of the true values of designs whose means are ranked.

    Args:
        ranking: The ranking of the means of n designs.
        errors: ``(n, m)`` their standard errors.
        counts: ``(n,)`` the numbers of tests of which these are estimates; None if they are known
            exactly.

    Returns:
        ``(n, m)`` expected true values, in the original directions, and ``(n, 3)`` the
        probabilities of being Pareto optimal, the nearest to the ideal point, and at most 5 %
        farther.
    """
    means, factors = _posterior(ranking.objectives.minimized, errors)
    n_samples = _SAMPLES
    if len(means) > _MANY:
        n_samples = _SAMPLES_OF_MANY
    generator = np.random.default_rng(_SEED)
    times = np.zeros((len(means), 3))
    for _ in range(n_samples):
        steps = generator.standard_normal(means.shape)
        if counts is not None:
            steps *= _noise_ratios(generator, means.shape, counts)
        sample = means + np.einsum("ijk,ik->ij", factors, steps)
        is_pareto = nondominated(sample)
        frame = ranking.frame.around(sample[is_pareto])
        distance = frame.distances(sample)
        least = distance[is_pareto].min()
        if np.isinf(frame.scale).all():  # one design is the best in all: no other is near
            distance[~is_pareto] = np.inf
        is_best = is_pareto & (distance <= least * (1 + _ROUNDING))
        is_near = distance <= least * (1 + NEAR_BEST)
        times += np.column_stack([is_pareto, is_best, is_near])
    return ranking.objectives.original(means), times / n_samples


def _noise_ratios(generator: np.random.Generator, shape: tuple[int, int], counts: Array) -> Array:
    """Return ``(n, m)`` random ratios of the true noise of designs to its estimate.

    By these, values of normal distributions become those of Student's. Designs with few tests have
    one estimate, and so one ratio of each objective.
    """
    is_pooled = ~(counts >= _MANY_TESTS)  # also where a number is not known
    pooled = max(np.fmax(counts - 1, 0).sum(), 1)
    degrees = np.where(is_pooled, pooled, counts - 1)[:, None]
    ratios = np.sqrt(degrees / generator.chisquare(degrees, shape))
    ratios[is_pooled] = ratios[is_pooled.argmax()]
    return ratios


def _posterior(values: Array, errors: Array) -> tuple[Array, Array]:
    """Return the normal distribution of the true values of each design, given its means.

    The designs themselves say how true values are distributed (empirical Bayes): normally, with
    the covariance of the means less that of their errors. So a mean that is unlike those of the
    other designs is pulled towards them. Of few designs, means stay as they are.

    Args:
        values: ``(n, m)`` means.
        errors: ``(n, m)`` their standard errors.

    Returns:
        ``(n, m)`` expectations, and ``(n, m, m)`` factors L of the covariances L Lᵀ.
    """
    n, m = values.shape
    if n < _FEWEST_FOR_PRIOR * m:
        return values, errors[:, :, None] * np.eye(m)
    lengths = unit_lengths(values.min(axis=0), values.max(axis=0))
    lengths = np.where(np.isfinite(lengths), lengths, 1.0)
    scaled = values / lengths
    noise = ((errors / lengths) ** 2)[:, :, None] * np.eye(m)
    spread = np.atleast_2d(np.cov(scaled.T)) - noise.mean(axis=0)
    root = _factors(spread, _LEAST_VARIANCE)
    prior = root @ root.T
    gains = prior @ np.linalg.inv(prior + noise)
    center = scaled.mean(axis=0)
    means = center + np.einsum("ijk,ik->ij", gains, scaled - center)
    factors = _factors(prior - gains @ prior, 0.0) * lengths[:, None]
    # What has no error is known: rounding would break ties, and equal designs would not be equal.
    is_exact = errors == 0
    factors[is_exact] = 0.0
    return np.where(is_exact, values, means * lengths), factors


def _factors(covariances: Array, least: float) -> Array:
    """Return ``(..., m, m)`` L, so that L Lᵀ are covariances with eigenvalues of at least one."""
    sizes, axes = np.linalg.eigh(covariances)
    return np.asarray(axes * np.sqrt(np.maximum(sizes, least))[..., None, :])
