"""Whether one algorithm is better than another, and how sure that is.

Of two algorithms with runs by chance, the Mann-Whitney U test asks whether the runs of one tend to
be better. An algorithm that leaves nothing to chance has one value; the exact sign test then asks
whether the median run of the other is better than it. The p values of all pairs and budgets are
corrected together by Holm's method (Scand. J. Statist. 6, 1979), which bounds the probability of
even one false claim. The effect size is that of Vargha and Delaney (J. Educ. Behav. Stat. 25,
2000): the probability that a run of one is better than a run of the other, ties counted half.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

INDICATORS = {"hypervolume": 1, "igd_plus": -1, "epsilon": -1, "optimum_distance": -1}
"""The indicators of quality: 1 where more is better, -1 where less is."""


def holm(p: Array) -> Array:
    """Return p values corrected by Holm's method; NaN stays NaN and does not count.

    Args:
        p: ``(n,)`` p values.
    """
    corrected = np.full(len(p), np.nan)
    tested = np.flatnonzero(~np.isnan(p))
    order = tested[np.argsort(p[tested], kind="stable")]
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
        fixed: Which of the two leave nothing to chance; NaN if both do.
    """
    from scipy.stats import binomtest, mannwhitneyu

    if all(fixed):
        return np.nan
    if any(fixed):
        value, runs = (a[0], b) if fixed[0] else (b[0], a)
        different = runs[runs != value]
        if len(different) == 0:
            return 1.0
        return float(binomtest(int((different > value).sum()), len(different)).pvalue)
    if np.unique(np.concatenate([a, b])).size == 1:
        return 1.0
    # Ranks stand for the values: infinite ones have theirs, but no differences.
    _, ranks = np.unique(np.concatenate([a, b]), return_inverse=True)
    return float(mannwhitneyu(ranks[: len(a)], ranks[len(a) :]).pvalue)


def least_p(n_a: int, n_b: int, *, fixed: tuple[bool, bool]) -> float:
    """Return the smallest p value that so many runs can give; see :func:`p_value`."""
    from math import comb

    if all(fixed):
        return 1.0
    return 2.0 / (2 ** (n_b if fixed[0] else n_a) if any(fixed) else comb(n_a + n_b, n_a))


def pairwise_tests(measures: pd.DataFrame, indicator: str) -> pd.DataFrame:
    """Compare every pair of algorithms at every budget.

    Args:
        measures: One row per run: ``algorithm``, ``evaluations``, ``seed`` (missing where nothing
            is left to chance) and the indicator.
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
