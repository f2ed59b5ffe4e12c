"""How a ranking of designs holds from scenario to scenario, on arrays.

A scenario gives every design its objective values, and says which designs are feasible in it.
These are ranked anew, with U, N and the scale of that scenario. Scenarios come one by one and
only sums are kept, so that memory does not grow with their number.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._tables import Shown
from pymoo_psi.pareto._dominance import competes
from pymoo_psi.pareto._ranking import rank_of_efficiency

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def rank_scenario(F: Array, feasible: Mask, *, normalize: bool) -> tuple[Mask, Array]:
    """Rank the feasible designs of a scenario.

    Args:
        F: ``(n, m)`` objective values, all minimised.
        feasible: ``(n,)`` which designs are; one with an objective that is not finite is not.
        normalize: As for :func:`pymoo_psi.rank_of_efficiency`.

    Returns:
        ``(4, n)`` which designs are the Salukvadze optimum, of rank 5 or 6, Pareto optimal,
        infeasible; ``(n, m + 1)`` their objectives and their regret, μ1 less the least μ1 of the
        scenario, of no meaning where infeasible.
    """
    feasible = competes(F, feasible)
    rows = np.flatnonzero(feasible)
    marks = np.zeros((4, len(F)), dtype=bool)
    marks[3] = ~feasible
    regret = np.zeros(len(F))
    if len(rows):
        ranking = rank_of_efficiency(F[rows], normalize=normalize)
        marks[0, rows[ranking.salukvadze]] = True
        # 5 and 6 are the ranks of P23 and one more pair at least: nearest to U in two respects.
        marks[1, rows], marks[2, rows] = ranking.rank >= 5, ranking.pareto
        # The least of the Pareto-optimal designs is the least of all: with f >= U a dominated one
        # is farther from U than the one that dominates it.
        mu1 = ranking.criteria[:, 0]
        regret[rows] = mu1 - mu1[ranking.pareto].min()
    return marks, np.column_stack([F, regret])


@dataclass(frozen=True, eq=False, repr=False)
class Robustness(Shown):
    """What becomes of n designs in S scenarios.

    Shares are of all S scenarios. The statistics of criteria and regret are over the scenarios in
    which the design is feasible, NaN if it is in none. Regret is measured in the frame of each
    scenario: how much farther from that scenario's U the design is than the nearest design.

    Attributes:
        X: ``(n, n_var)`` the designs, or n designs as mappings.
        parameters: Names of the k uncertain parameters.
        scenarios: ``(S, k)`` their values.
        objectives: Names of the m objectives.
        optimum_share: ``(n,)`` share of scenarios in which the design is the Salukvadze optimum.
        efficient_share: ``(n,)`` share in which its rank of efficiency is 5 or 6.
        pareto_share: ``(n,)`` share in which it is Pareto optimal among the designs.
        infeasible_share: ``(n,)`` share in which it is infeasible.
        mean: ``(n, m)`` mean of every criterion, in its own sense.
        spread: ``(n, m)`` standard deviation of every criterion, of the scenarios as they are.
        worst: ``(n, m)`` worst value of every criterion: the largest, or of one that the problem
            says is maximised the least.
        mean_regret: ``(n,)`` mean regret.
        worst_regret: ``(n,)`` largest regret.

    Example:
        A lighter rod bends more; whatever the load, the middle one of three is the optimum.

        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from scipy.stats import uniform
        >>> from pymoo_psi import robustness
        >>> def rod(load):
        ...     return FunctionalProblem(1, [lambda x: x[0], lambda x: load / x[0]], xl=0, xu=9)
        >>> loads = {"load": uniform(0.5, 1.0)}
        >>> result = robustness(rod, [[0.5], [1.0], [2.0]], uncertainty=loads)
        >>> result.optimum_share
        array([0., 1., 0.])
        >>> result.order  # the first and the last tie in all but the regret
        array([1, 0, 2])
        >>> result.mean.round(2)  # the mean load is 1
        array([[0.5, 2. ], [1. , 1. ], [2. , 0.5]])
    """

    X: Any
    parameters: tuple[str, ...]
    scenarios: Array
    objectives: tuple[str, ...]
    optimum_share: Array
    efficient_share: Array
    pareto_share: Array
    infeasible_share: Array
    mean: Array
    spread: Array
    worst: Array
    mean_regret: Array
    worst_regret: Array

    def __repr__(self) -> str:
        """Return how much is compared and which row is the most robust."""
        best = int(self.order[0])
        return (
            f"Robustness({len(self.optimum_share)} designs in {len(self.scenarios)} scenarios of "
            f"{', '.join(self.parameters)}: row {best} is the optimum in "
            f"{100 * self.optimum_share[best]:.3g} %)"
        )

    @property
    def order(self) -> NDArray[np.intp]:
        """``(n,)`` indices of the designs, the most robust first.

        By the share as optimum, then in rank 5 or better, then by rarely being infeasible, then
        by mean regret.
        """
        return np.lexsort(
            (self.mean_regret, self.infeasible_share, -self.efficient_share, -self.optimum_share)
        )

    def to_frame(self) -> pd.DataFrame:
        """Return one row per design, the most robust first; its index is the row in ``X``.

        Returns:
            Columns: the variables, the four shares, ``mean_regret``, ``worst_regret``, and
            ``f1_mean``, ``f1_spread``, ``f1_worst`` for every objective.
        """
        import pandas as pd

        frame = pd.DataFrame(list(self.X)) if isinstance(self.X, tuple) else pd.DataFrame(self.X)
        # Mappings name their variables; the columns of a matrix have numbers only.
        frame.columns = [f"x{c + 1}" if isinstance(c, int) else c for c in frame.columns]
        for name in (
            "optimum_share", "efficient_share", "pareto_share", "infeasible_share",
            "mean_regret", "worst_regret",
        ):  # fmt: skip
            frame[name] = getattr(self, name)
        for j, name in enumerate(self.objectives):
            for statistic in ("mean", "spread", "worst"):
                frame[f"{name}_{statistic}"] = getattr(self, statistic)[:, j]
        return frame.iloc[self.order]


def tally(
    rankings: Iterable[tuple[Mask, Array]],
    *,
    X: Any,
    parameters: Sequence[str],
    scenarios: Array,
    objectives: Sequence[str],
) -> Robustness:
    """Sum up what :func:`rank_scenario` gives for one scenario or more, in the order given.

    Means and squares are updated by Welford's method (Technometrics 4, 1962), which does not
    cancel where a criterion varies little around a large mean.
    """
    n, k = len(X), len(objectives) + 1  # the regret goes with the objectives
    counts, regret = np.zeros((4, n), dtype=np.int64), np.zeros(n)
    mean, squares, worst = np.zeros((n, k)), np.zeros((n, k)), np.full((n, k), -np.inf)
    for number, (marks, values) in enumerate(rankings, start=1):
        counts += marks
        there = ~marks[3]
        delta = values[there] - mean[there]
        mean[there] += delta / (number - counts[3, there])[:, None]
        squares[there] += delta * (values[there] - mean[there])
        worst[there] = np.maximum(worst[there], values[there])
        regret[there] += values[there, -1]  # a plain sum: regrets are small, none is negative
    met = len(scenarios) - counts[3]
    for statistic in (mean, squares, worst):
        statistic[met == 0] = np.nan
    regret[met == 0] = np.nan
    spread = np.sqrt(squares / np.maximum(met, 1)[:, None])  # max: NaN, not 0 / 0
    optimum, efficient, pareto, infeasible = counts / len(scenarios)
    return Robustness(
        X, tuple(parameters), scenarios, tuple(objectives),
        optimum, efficient, pareto, infeasible,
        mean=mean[:, :-1], spread=spread[:, :-1], worst=worst[:, :-1],
        mean_regret=regret / np.maximum(met, 1), worst_regret=worst[:, -1],
    )  # fmt: skip
