"""The quality of the runs of a comparison, and tests whether one algorithm is better than another.

All runs are measured against one reference. For two random algorithms, the rank-sum test of
Wilcoxon, Mann and Whitney tests whether the runs of one tend to be better; ties share their mean
rank, and the p value is exact with ties, too. A deterministic algorithm has a single value; then
the exact sign test tests whether the median run of the other algorithm is better than this value.
The p values of all pairs and budgets are corrected together by Holm's method (Scand. J. Statist. 6,
1979), which bounds the probability of one or more false claims. The effect size is that of Vargha
and Delaney (J. Educ. Behav. Stat. 25, 2000): the probability that a run of one algorithm is better
than a run of the other, with ties counted half.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._validation import Array
from pymoo_psi.pareto import (
    UtopianFrame,
    epsilon_additive,
    hypervolume,
    igd_plus,
    nondominated,
    rank_of_efficiency,
    spread_subset,
)

if TYPE_CHECKING:
    import pandas as pd


INDICATORS = {"hypervolume": 1, "igd_plus": -1, "epsilon": -1, "optimum_distance": -1}
"""The indicators of quality: 1 if more is better, -1 if less is better."""

_REFERENCE_POINT = 1.1
"""Each coordinate of the reference point of the hypervolume, in units of N − U.

It lies beyond N, where the extreme points of a front would dominate no volume; 1.1 is the customary
choice (Ishibuchi et al., Evol. Comput. 26, 2018, discuss it).
"""
_REFERENCE_SIZE = 1000
"""Points to which the reference set is thinned, as IGD+ takes all distances to each of them."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The reference of a comparison.

    It consists of the non-dominated points among the designs of all runs and the points of a known
    front, if there is one. They define the scale: U and N are their best and worst values, and
    every objective is measured in units of N − U. If they all have the same value of an objective,
    this objective is measured up to the worst value of any run. The reference set of IGD+ and of
    the additive epsilon indicator consists of 1000 of them, evenly spread; the reference point of
    the hypervolume is U + 1.1 (N − U).

    Attributes:
        frame: U, N and the scale.
        points: ``(k, m)`` the reference set, in the scale; empty if no run has a feasible design.
        n_union: Number of points before thinning.
        optimum: ``(m,)`` objectives, all minimised, of the best known Salukvadze optimum: the point
            nearest to U.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> bnh = get_problem("bnh")
        >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
        >>> reference = result.reference
        >>> bool((reference.points >= 0).all() and (reference.points <= 1).all())
        True
    """

    frame: UtopianFrame
    points: Array
    n_union: int
    optimum: Array

    def __repr__(self) -> str:
        """Return the numbers of points and objectives."""
        k, m = self.points.shape
        return f"Reference({k} points of {self.n_union}, {m} objectives)"

    @classmethod
    def of(cls, fronts: Sequence[Array]) -> Reference:
        """Return the reference of sets of ``(n, m)`` objectives, all minimised.

        Example:
            Of the result in the example of :class:`Reference`:

            >>> reference = Reference.of([run.F for run in result.runs])
            >>> reference.n_union == result.reference.n_union
            True
        """
        # Unique and sorted, so that the order of the runs does not decide which points are kept.
        F = np.unique(np.vstack(fronts), axis=0)
        if len(F) == 0:
            nowhere = np.full(F.shape[1], np.nan)
            return cls(UtopianFrame(nowhere, nowhere, normalize=True), F, 0, nowhere)
        worst = F.max(axis=0)
        F = F[nondominated(F)]
        U = F.min(axis=0)
        N = F.max(axis=0)
        # An objective without a range would count for nothing, and runs that are worse in it would
        # look equal: with a single best point, all runs would be alike.
        N = np.where(N > U, N, worst)
        frame = UtopianFrame(U, N, normalize=True)
        scaled = frame.scaled(F)
        points = scaled[spread_subset(scaled, _REFERENCE_SIZE)]
        nearest = frame.distances(F)[:, 0].argmin()
        return cls(frame, points, len(F), F[nearest])

    def measure(self, F: Array) -> dict[str, float]:
        """Return the quality of the ``(n, m)`` non-dominated objectives of a run.

        The hypervolume is a share of the box from U to the reference point (Zitzler and Thiele
        1998), IGD+ that of Ishibuchi et al. (2015), epsilon that of Zitzler et al. (2003).
        ``optimum_distance`` is the distance, in the scale, from the Salukvadze optimum of the run
        to the best known one. The former is determined with U and N of the run, as a user would do.

        Example:
            Of the result in the example of :class:`Reference`:

            >>> result.reference.measure(np.zeros((0, 2)))["hypervolume"]
            0.0
        """
        scaled = self.frame.scaled(F)
        quality = {
            "hypervolume": hypervolume(scaled, _REFERENCE_POINT)[0],
            "igd_plus": np.inf,
            "epsilon": np.inf,
            "optimum_distance": np.inf,
            "n_nondominated": len(F),
        }
        if len(F) > 0:
            quality["igd_plus"] = float(igd_plus(scaled, ref=self.points))
            quality["epsilon"] = float(epsilon_additive(scaled, ref=self.points))
            optimum = F[rank_of_efficiency(F).salukvadze[:1]]
            distance = self.frame.scaled(optimum) - self.frame.scaled(self.optimum)
            quality["optimum_distance"] = float(np.linalg.norm(distance))
        return quality


_EXACT_RUNS = 40
"""Number of runs of an algorithm up to which p values are exact; such a test takes 0.05 s.

With more runs, the normal approximation with its correction for ties has an error of a few per cent
at the usual levels of significance; far below them its p values are too large.
"""


def holm(p: Array) -> Array:
    """Return p values corrected by Holm's method; NaN stays NaN and is not counted.

    Args:
        p: ``(n,)`` p values.

    Example:
        >>> print(holm(np.array([0.01, 0.04, 0.03])))
        [0.03 0.06 0.06]
    """
    corrected = np.full(len(p), np.nan)
    tested = np.flatnonzero(~np.isnan(p))
    order = tested[np.argsort(p[tested], kind="stable")]
    # The smallest of k p values is multiplied by k, the next by k - 1, and so on; none becomes
    # smaller than the one before it.
    factors = np.arange(len(order), 0, -1)
    increasing = np.maximum.accumulate(p[order] * factors)
    corrected[order] = np.minimum(increasing, 1.0)
    return corrected


def effect_size(a: Array, b: Array) -> float:
    """Return the probability that a value of ``a`` is above one of ``b``; ties count half.

    Example:
        >>> effect_size(np.array([1.0, 3.0]), np.array([1.0, 2.0]))
        0.625
    """
    above = (a[:, None] > b).mean()
    equal = (a[:, None] == b).mean()
    return float(above + 0.5 * equal)


def p_value(a: Array, b: Array, *, fixed: tuple[bool, bool]) -> float:
    """Return the two-sided p value for the hypothesis that two algorithms do not differ.

    Args:
        a: Values of the runs of one.
        b: Values of the runs of the other.
        fixed: Which of the two are deterministic; NaN is returned if both are.

    Example:
        >>> round(p_value(np.arange(5.0), np.arange(5.0) + 10, fixed=(False, False)), 4)  # 2 / 252
        0.0079
    """
    a_fixed, b_fixed = fixed
    if a_fixed and b_fixed:
        return np.nan
    if a_fixed:
        return _sign_test(b, a[0])
    if b_fixed:
        return _sign_test(a, b[0])
    return _rank_sum_test(a, b)


def _sign_test(runs: Array, value: float) -> float:
    """Return the p value for the hypothesis that a value is the median of runs."""
    from scipy.stats import binomtest  # heavy to import

    above = int((runs > value).sum())
    different = int((runs != value).sum())  # the sign test ignores ties
    if different == 0:
        return 1.0
    return float(binomtest(above, different).pvalue)


def _rank_sum_test(a: Array, b: Array) -> float:
    """Return the p value of the rank-sum test; it is exact for few runs, with or without ties."""
    from scipy.stats import mannwhitneyu, rankdata  # heavy to import

    # Ranks replace the values, as infinite values have no differences. Ties share their mean rank;
    # twice the mean rank is an integer.
    k = len(a)
    ranks = (2 * rankdata(np.concatenate([a, b]))).astype(int)
    if max(k, len(b)) > _EXACT_RUNS:
        return float(mannwhitneyu(ranks[:k], ranks[k:], method="asymptotic").pvalue)
    # If the algorithms do not differ, any k of all runs are equally likely to be those of the
    # first. ways[j, t] is the number of ways to choose j runs with ranks that sum to t. Floats hold
    # integers up to 2^53 and lose only the last digits beyond.
    ways = np.zeros((k + 1, int(ranks.sum()) + 1))
    ways[0, 0] = 1
    for rank in ranks:
        ways[1:, rank:] += ways[:-1, :-rank].copy()  # without this run, and with it
    observed = int(ranks[:k].sum())
    # Two-sided: twice the smaller tail, which exceeds 1 if both tails include the observed sum.
    lower_tail = ways[k, : observed + 1].sum()
    upper_tail = ways[k, observed:].sum()
    share = float(min(lower_tail, upper_tail) / ways[k].sum())
    return min(1.0, 2.0 * share)


def pairwise_tests(measures: pd.DataFrame, indicator: str) -> pd.DataFrame:
    """Compare every pair of algorithms at every budget.

    Args:
        measures: One row per run: ``algorithm``, ``evaluations``, ``seed`` (missing if the
            algorithm is deterministic) and the indicator.
        indicator: One of :data:`INDICATORS`.

    Returns:
        Columns ``evaluations``, ``better`` and ``worse`` (names, by the effect size), ``effect``
        (the probability that a run of ``better`` is the better one, 0.5 to 1), ``p``, ``p_holm``.
    """
    import pandas as pd

    sign = INDICATORS[indicator]  # turns values so that more is better
    rows = []
    for budget, runs_of_budget in measures.groupby("evaluations", sort=True):
        by_name = dict(iter(runs_of_budget.groupby("algorithm", sort=False)))
        for names in itertools.combinations(by_name, 2):
            better, worse = names
            a = sign * by_name[better][indicator].to_numpy(float)
            b = sign * by_name[worse][indicator].to_numpy(float)
            fixed = (_deterministic(by_name[better]), _deterministic(by_name[worse]))
            p = p_value(a, b, fixed=fixed)
            effect = effect_size(a, b)
            if effect < 0.5:
                worse, better = names
                effect = 1 - effect
            rows.append((budget, better, worse, effect, p))
    frame = pd.DataFrame(rows, columns=["evaluations", "better", "worse", "effect", "p"])
    return frame.assign(p_holm=holm(frame["p"].to_numpy(float)))


def _deterministic(runs: pd.DataFrame) -> bool:
    """Return whether the runs of an algorithm have no seeds."""
    return bool(runs["seed"].isna().all())
