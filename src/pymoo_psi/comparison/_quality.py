"""How good the runs of a comparison are, and whether one algorithm is better than another.

All runs are measured against one reference. Of two algorithms with runs by chance, the rank-sum
test of Wilcoxon, Mann and Whitney asks whether the runs of one tend to be better; ties share their
mean rank, and the p value is exact with them, too. A deterministic algorithm has one value; the
exact sign test then asks whether the median run of the other is better than it. The p values of all
pairs and budgets are corrected together by Holm's method (Scand. J. Statist. 6, 1979), which bounds
the probability of even one false claim. The effect size is that of Vargha and Delaney (J. Educ.
Behav. Stat. 25, 2000): the probability that a run of one is better than a run of the other, ties
counted half.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

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

Array = NDArray[np.float64]

INDICATORS = {"hypervolume": 1, "igd_plus": -1, "epsilon": -1, "optimum_distance": -1}
"""The indicators of quality: 1 where more is better, -1 where less is."""

_REFERENCE_POINT = 1.1
"""Each coordinate of the reference point of the hypervolume, in units of N − U.

Beyond N, where the extreme points of a front would dominate nothing and count for nothing; 1.1 is
the customary choice (Ishibuchi et al., Evol. Comput. 26, 2018, discuss it).
"""
_REFERENCE_SIZE = 1000
"""Points that the reference set is thinned to, as IGD+ takes all distances to each of them."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The reference of a comparison.

    All designs that any run found, and the points of a known front if one is given, are put
    together, and those that no other dominates are kept. They span the scale: U and N are their
    best and worst values, and every objective is measured in units of N − U. An objective in
    which they all agree is measured up to the worst value that any run found. The reference set of
    IGD+ and of the additive epsilon indicator are 1000 of them, evenly spread; the reference point
    of the hypervolume is U + 1.1 (N − U).

    Attributes:
        frame: U, N and the scale.
        points: ``(k, m)`` the reference set, in the scale; none if no run found anything.
        n_union: Points it was thinned from.
        optimum: ``(m,)`` objectives, all minimised, of the best known Salukvadze optimum: of the
            point nearest to U.

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
        """Return the sizes."""
        k, m = self.points.shape
        return f"Reference({k} points of {self.n_union}, {m} objectives)"

    @classmethod
    def of(cls, fronts: Sequence[Array]) -> Reference:
        """Return the reference of sets of ``(n, m)`` objectives, all minimised.

        Example:
            Of the result in the example of :class:`Reference`:

            >>> again = Reference.of([run.F for run in result.runs])
            >>> again.n_union == result.reference.n_union
            True
        """
        # Each once and sorted: the order of the runs must not decide which points are kept.
        F = np.unique(np.vstack(fronts), axis=0)
        if len(F) == 0:
            nowhere = np.full(F.shape[1], np.nan)
            return cls(UtopianFrame(nowhere, nowhere, True), F, 0, nowhere)
        worst, F = F.max(axis=0), F[nondominated(F)]
        U, N = F.min(axis=0), F.max(axis=0)
        # Without a span of its own an objective would count for nothing, and runs that are worse
        # in it would pass for equal: a single best point would make all runs alike.
        frame = UtopianFrame(U, np.where(N > U, N, worst), normalize=True)
        scaled = frame.scaled(F)
        points = scaled[spread_subset(scaled, _REFERENCE_SIZE)]
        return cls(frame, points, len(F), F[frame.distances(F)[:, 0].argmin()])

    def measure(self, F: Array) -> dict[str, float]:
        """Return the quality of the ``(n, m)`` non-dominated objectives that a run found.

        The hypervolume is a share of the box from U to the reference point (Zitzler and Thiele
        1998), IGD+ that of Ishibuchi et al. (2015), epsilon that of Zitzler et al. (2003).
        ``optimum_distance`` is the distance, in the scale, from the Salukvadze optimum among them,
        by their own U and N as a user would find it, to the best known one.

        Example:
            Of the result in the example of :class:`Reference`:

            >>> result.reference.measure(np.zeros((0, 2)))["hypervolume"]
            0.0
        """
        scaled, igd, epsilon, distance = self.frame.scaled(F), np.inf, np.inf, np.inf
        if len(F):
            igd = float(igd_plus(scaled, ref=self.points))
            epsilon = float(epsilon_additive(scaled, ref=self.points))
            best = self.frame.scaled(F[rank_of_efficiency(F).salukvadze[:1]])
            distance = float(np.linalg.norm(best - self.frame.scaled(self.optimum)))
        return {
            "hypervolume": hypervolume(scaled, _REFERENCE_POINT)[0],
            "igd_plus": igd,
            "epsilon": epsilon,
            "optimum_distance": distance,
            "n_nondominated": len(F),
        }


_EXACT_RUNS = 40
"""Runs of an algorithm up to which p values are exact; such a test takes a twentieth of a second.

With more, the normal approximation with its correction for ties is right to a few per cent at the
usual levels of significance, and too large far below them.
"""


def holm(p: Array) -> Array:
    """Return p values corrected by Holm's method; NaN stays NaN and does not count.

    Args:
        p: ``(n,)`` p values.

    Example:
        >>> print(holm(np.array([0.01, 0.04, 0.03])))
        [0.03 0.06 0.06]
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
    """Return the probability that a value of ``a`` is above one of ``b``, ties counted half.

    Example:
        >>> effect_size(np.array([1.0, 3.0]), np.array([1.0, 2.0]))
        0.625
    """
    above = (a[:, None] > b).mean() + 0.5 * (a[:, None] == b).mean()
    return float(above)


def p_value(a: Array, b: Array, *, fixed: tuple[bool, bool]) -> float:
    """Return the two-sided p value that runs of two algorithms do not differ.

    Args:
        a: Values of the runs of one.
        b: Values of the runs of the other.
        fixed: Which of the two are deterministic; NaN if both are.

    Example:
        >>> round(p_value(np.arange(5.0), np.arange(5.0) + 10, fixed=(False, False)), 4)  # 2 / 252
        0.0079
    """
    from scipy.stats import binomtest, mannwhitneyu, rankdata  # heavy to import

    if all(fixed):
        return np.nan
    if any(fixed):
        value, runs = (a[0], b) if fixed[0] else (b[0], a)
        above, n = int((runs > value).sum()), int((runs != value).sum())
        return float(binomtest(above, n).pvalue) if n else 1.0  # the sign test drops ties
    # Ranks stand for the values: infinite ones have theirs, but no differences. Twice the mean
    # rank of those that tie is an integer.
    k, ranks = len(a), (2 * rankdata(np.concatenate([a, b]))).astype(int)
    if max(k, len(b)) > _EXACT_RUNS:
        return float(mannwhitneyu(ranks[:k], ranks[k:], method="asymptotic").pvalue)
    # If two algorithms do not differ, any k of the runs are as likely to be those of the first:
    # how many choices of so many runs have which sum of ranks. Floats hold integers up to 2^53,
    # and lose no more than the last digits beyond.
    ways = np.zeros((k + 1, int(ranks.sum()) + 1))
    ways[0, 0] = 1
    for rank in ranks:
        ways[1:, rank:] += ways[:-1, :-rank].copy()  # those without this run, and it
    observed = int(ranks[:k].sum())
    # Two-sided: the smaller tail twice, which passes 1 where both tails hold the observed sum.
    tail = min(ways[k, : observed + 1].sum(), ways[k, observed:].sum())
    return min(1.0, 2.0 * float(tail / ways[k].sum()))


def pairwise_tests(measures: pd.DataFrame, indicator: str) -> pd.DataFrame:
    """Compare every pair of algorithms at every budget.

    Args:
        measures: One row per run: ``algorithm``, ``evaluations``, ``seed`` (missing where the
            algorithm is deterministic) and the indicator.
        indicator: One of :data:`INDICATORS`.

    Returns:
        Columns ``evaluations``, ``better`` and ``worse`` (names, by the effect size), ``effect``
        (the probability that a run of ``better`` is the better one, 0.5 to 1), ``p``, ``p_holm``.
    """
    import pandas as pd

    rows: list[tuple[Any, ...]] = []
    for budget, group in measures.groupby("evaluations", sort=True):
        by_name = dict(iter(group.groupby("algorithm", sort=False)))
        for pair in itertools.combinations(by_name, 2):
            # Turned where less is better, so that more is better for all.
            a, b = (INDICATORS[indicator] * by_name[k][indicator].to_numpy(float) for k in pair)
            first, second = (bool(by_name[name]["seed"].isna().all()) for name in pair)
            effect, p = effect_size(a, b), p_value(a, b, fixed=(first, second))
            names = pair if effect >= 0.5 else pair[::-1]
            rows.append((budget, *names, max(effect, 1 - effect), p))
    frame = pd.DataFrame(rows, columns=["evaluations", "better", "worse", "effect", "p"])
    return frame.assign(p_holm=holm(frame["p"].to_numpy(float)))
