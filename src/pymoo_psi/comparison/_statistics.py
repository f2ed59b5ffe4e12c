"""Whether one algorithm is better than another, and how sure that is.

Of two algorithms with runs by chance, the rank-sum test of Wilcoxon, Mann and Whitney asks whether
the runs of one tend to be better; ties share their mean rank, and the p value is exact with them,
too. A deterministic algorithm has one value; the exact sign test then asks
whether the median run of the other is better than it. The p values of all pairs and budgets are
corrected together by Holm's method (Scand. J. Statist. 6, 1979), which bounds the probability of
even one false claim. The effect size is that of Vargha and Delaney (J. Educ. Behav. Stat. 25,
2000): the probability that a run of one is better than a run of the other, ties counted half.
"""

from __future__ import annotations

import itertools
from math import comb, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

INDICATORS = {"hypervolume": 1, "igd_plus": -1, "epsilon": -1, "optimum_distance": -1}
"""The indicators of quality: 1 where more is better, -1 where less is."""

_EXACT_RUNS = 40
"""Runs of an algorithm up to which p values are exact; such a test takes a twentieth of a second.

With more, the normal approximation with its correction for ties is right to a few per cent at the
usual levels of significance, and too large far below them.
"""


def holm(p: Array) -> Array:
    """Return p values corrected by Holm's method; NaN stays NaN and does not count.

    Args:
        p: ``(n,)`` p values.
    """
    corrected = np.full(len(p), np.nan)
    tested = np.flatnonzero(~np.isnan(p))
    order = tested[np.argsort(p[tested], kind="stable")]
    # Of k p values the least counts k-fold, the next (k - 1)-fold, and none less than the one
    # before it.
    factors = np.arange(len(order), 0, -1)
    corrected[order] = np.minimum(np.maximum.accumulate(p[order] * factors), 1.0)
    return corrected


def effect_size(a: Array, b: Array) -> float:
    """Return the probability that a value of ``a`` is above one of ``b``, ties counted half."""
    above = (a[:, None] > b).mean() + 0.5 * (a[:, None] == b).mean()
    return float(above)


def p_value(a: Array, b: Array, *, fixed: tuple[bool, bool]) -> float:
    """Return the two-sided p value that runs of two algorithms do not differ.

    Args:
        a: Values of the runs of one.
        b: Values of the runs of the other.
        fixed: Which of the two are deterministic; NaN if both are.
    """
    from scipy.stats import binomtest, mannwhitneyu  # heavy to import

    if all(fixed):
        return np.nan
    if any(fixed):
        value, runs = (a[0], b) if fixed[0] else (b[0], a)
        different = runs[runs != value]  # the sign test drops ties: they speak for neither
        if len(different) == 0:
            return 1.0
        return float(binomtest(int((different > value).sum()), len(different)).pvalue)
    # Ranks stand for the values: infinite ones have theirs, but no differences. Twice the mean
    # rank of those that tie is an integer.
    _, place, count = np.unique(np.concatenate([a, b]), return_inverse=True, return_counts=True)
    ranks = (2 * np.cumsum(count) - count + 1)[place]
    if max(len(a), len(b)) > _EXACT_RUNS:
        found = mannwhitneyu(ranks[: len(a)], ranks[len(a) :], method="asymptotic")
        return float(found.pvalue)
    ways = _ways(ranks, len(a))
    observed = int(ranks[: len(a)].sum())
    # Two-sided: the smaller tail twice, which passes 1 where both tails hold the observed sum.
    lower, upper = ways[: observed + 1].sum(), ways[observed:].sum()
    return min(1.0, 2.0 * float(min(lower, upper) / ways.sum()))


def _ways(ranks: NDArray[np.intp], size: int) -> Array:
    """Count the choices of some of the runs that have a certain sum of ranks.

    If two algorithms do not differ, any choice of as many runs as one of them has is as likely
    to be its runs.

    Args:
        ranks: ``(n,)`` the ranks of all runs, integers >= 1.
        size: How many runs are chosen, k <= n.

    Returns:
        ``(s + 1,)`` for each sum from 0 to that of all ranks how many choices have it; as floats,
        which hold integers exactly up to 2^53 and lose no more than the last digits beyond.
    """
    ways = np.zeros((size + 1, int(ranks.sum()) + 1))  # by runs chosen and sum of their ranks
    ways[0, 0] = 1
    for rank in ranks:
        ways[1:, rank:] += ways[:-1, :-rank].copy()  # those without this run, and it
    chosen: Array = ways[size]
    return chosen


def shift(a: Array, b: Array, *, fixed: bool) -> tuple[float, float, float]:
    """Return by how much values of ``b`` lie above those of ``a``, and a 95 % interval of it.

    The estimate is the median of all differences (Hodges and Lehmann, Ann. Math. Stat. 34, 1963);
    the interval holds the shifts that the test of :func:`p_value` does not reject at 5 %.

    Args:
        a: Values of the runs of one.
        b: Values of the runs of the other.
        fixed: Whether one of the two is the value of a deterministic algorithm.

    Returns:
        The estimate, and the ends, NaN where so few runs reject nothing; all NaN where values are
        infinite on both sides.

    Example:
        >>> shift(np.arange(6.0), np.arange(6.0) + 10, fixed=False)
        (10.0, 7.0, 13.0)
    """
    with np.errstate(invalid="ignore"):
        differences = np.sort((b[:, None] - a).ravel())
    n = len(differences)
    if np.isnan(differences).any():
        return np.nan, np.nan, np.nan
    if fixed:  # how many runs of the other are above it: binomial
        ways = np.array([comb(n, k) / 2**n for k in range(n + 1)])
    elif max(len(a), len(b)) > _EXACT_RUNS:  # as of p values, and their ways would fill the memory
        deviation = sqrt(n * (len(a) + len(b) + 1) / 12)
        ways = np.exp(-0.5 * ((np.arange(n + 1) - n / 2) / deviation) ** 2)
    else:  # of how many pairs the second is above: the rank sum, less the least it can be
        ways = _ways(np.arange(1, len(a) + len(b) + 1), len(a))[len(a) * (len(a) + 1) // 2 :]
    beyond = int(np.searchsorted(np.cumsum(ways) / ways.sum(), 0.025, side="right"))
    estimate = float(np.median(differences))
    if beyond == 0:
        return estimate, np.nan, np.nan
    return estimate, float(differences[beyond - 1]), float(differences[-beyond])


def least_p(n_a: int, n_b: int, *, fixed: tuple[bool, bool]) -> float:
    """Return the smallest p value that so many runs can give; see :func:`p_value`."""
    if all(fixed):
        return 1.0
    # All runs on one side: 2 of 2^n patterns of signs, 2 of C(n_a + n_b, n_a) choices of ranks.
    # Of integers, which floats cannot hold where there are many runs.
    return 2 / (2 ** (n_b if fixed[0] else n_a) if any(fixed) else comb(n_a + n_b, n_a))


def pairwise_tests(measures: pd.DataFrame, indicator: str) -> pd.DataFrame:
    """Compare every pair of algorithms at every budget.

    Args:
        measures: One row per run: ``algorithm``, ``evaluations``, ``seed`` (missing where the
            algorithm is deterministic) and the indicator.
        indicator: One of :data:`INDICATORS`.

    Returns:
        Columns ``evaluations``, ``better`` and ``worse`` (names, by the effect size), ``effect``
        (the probability that a run of ``better`` is the better one, 0.5 to 1), ``p``, ``least_p``
        (the smallest that so many runs could give), ``p_holm``.
    """
    import pandas as pd

    names = list(dict.fromkeys(measures["algorithm"]))
    rows: list[dict[str, Any]] = []
    for budget, group in measures.groupby("evaluations", sort=True):
        by_name = dict(iter(group.groupby("algorithm")))
        for first, second in itertools.combinations(names, 2):
            pair = [by_name[first], by_name[second]]
            # Turned where less is better, so that more is better for all.
            values = [INDICATORS[indicator] * runs[indicator].to_numpy(float) for runs in pair]
            fixed = tuple(bool(runs["seed"].isna().all()) for runs in pair)
            effect = effect_size(*values)
            better, worse = (first, second) if effect >= 0.5 else (second, first)
            rows.append(
                {
                    "evaluations": budget,
                    "better": better,
                    "worse": worse,
                    "effect": max(effect, 1 - effect),
                    "p": p_value(*values, fixed=(fixed[0], fixed[1])),
                    "least_p": least_p(*map(len, values), fixed=(fixed[0], fixed[1])),
                }
            )
    frame = pd.DataFrame(rows, columns=["evaluations", "better", "worse", "effect", "p", "least_p"])
    frame["p_holm"] = holm(frame["p"].to_numpy(float))
    return frame
