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

from pymoo_psi._validation import invalid
from pymoo_psi.pareto._feasibility import competes
from pymoo_psi.pareto._ranking import rank_of_efficiency

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ScenarioRanking:
    """The ranking of n designs in one scenario.

    Attributes:
        F: ``(n, m)`` objective values, of no meaning where infeasible.
        feasible: ``(n,)`` which designs are ranked.
        pareto: ``(n,)`` which are Pareto optimal.
        rank: ``(n,)`` ranks of efficiency, 0 for dominated and infeasible designs.
        optimum: ``(n,)`` which are the Salukvadze optimum.
        regret: ``(n,)`` μ1 less the least μ1 of the scenario; 0 where infeasible.
    """

    F: Array
    feasible: Mask
    pareto: Mask
    rank: NDArray[np.int64]
    optimum: Mask
    regret: Array


def rank_scenario(F: Array, feasible: Mask, *, normalize: bool) -> ScenarioRanking:
    """Rank the feasible designs of a scenario.

    Args:
        F: ``(n, m)`` objective values, all minimised.
        feasible: ``(n,)`` which designs are; one with an objective that is not finite is not.
        normalize: As for :func:`pymoo_psi.rank_of_efficiency`.
    """
    feasible = competes(F, feasible)
    rows = np.flatnonzero(feasible)
    pareto, optimum = np.zeros(len(F), dtype=bool), np.zeros(len(F), dtype=bool)
    rank, regret = np.zeros(len(F), dtype=np.int64), np.zeros(len(F))
    if len(rows):
        ranking = rank_of_efficiency(F[rows], normalize=normalize)
        pareto[rows], rank[rows] = ranking.pareto, ranking.rank
        optimum[rows[ranking.salukvadze]] = True
        mu1 = ranking.criteria[:, 0]
        regret[rows] = mu1 - mu1[ranking.pareto].min()
    return ScenarioRanking(F, feasible, pareto, rank, optimum, regret)


@dataclass(frozen=True, eq=False, repr=False)
class Robustness:
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
        mean: ``(n, m)`` mean of every criterion.
        spread: ``(n, m)`` standard deviation of every criterion, of the scenarios as they are.
        worst: ``(n, m)`` largest value of every criterion.
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

        Example:
            >>> from pymoo.problems.functional import FunctionalProblem
            >>> from scipy.stats import uniform
            >>> from pymoo_psi import robustness
            >>> line = FunctionalProblem(1, [lambda x: x[0]], xl=0, xu=1)
            >>> loads = {"load": uniform(1, 2)}
            >>> robustness(lambda load: line, [[0.9], [0.2]], uncertainty=loads).order
            array([1, 0])
        """
        return np.lexsort(
            (self.mean_regret, self.infeasible_share, -self.efficient_share, -self.optimum_share)
        )

    def to_frame(self) -> pd.DataFrame:
        """Return one row per design, the most robust first; its index is the row in ``X``.

        Returns:
            Columns: the variables, the four shares, ``mean_regret``, ``worst_regret``, and
            ``f1_mean``, ``f1_spread``, ``f1_worst`` for every objective.

        Example:
            >>> from pymoo.problems.functional import FunctionalProblem
            >>> from scipy.stats import uniform
            >>> from pymoo_psi import robustness
            >>> line = FunctionalProblem(1, [lambda x: x[0]], xl=0, xu=1)
            >>> loads = {"load": uniform(1, 2)}
            >>> result = robustness(lambda load: line, [[0.9], [0.2]], uncertainty=loads)
            >>> print(result.to_frame()[["x1", "optimum_share", "f1_worst"]])
                x1  optimum_share  f1_worst
            1  0.2            1.0       0.2
            0  0.9            0.0       0.9
        """
        import pandas as pd

        frame = pd.DataFrame(list(self.X)) if isinstance(self.X, tuple) else pd.DataFrame(self.X)
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
    rankings: Iterable[ScenarioRanking],
    *,
    X: Any,
    parameters: Sequence[str],
    scenarios: Array,
    objectives: Sequence[str],
) -> Robustness:
    """Sum up the scenarios, one or more, in the order in which they come."""
    counts: Any = 0
    total: _Moments | None = None
    for ranking in rankings:
        total = _Moments.zero(*ranking.F.shape) if total is None else total
        counts = counts + np.array(
            [ranking.optimum, ranking.rank >= 5, ranking.pareto, ~ranking.feasible], dtype=np.int64
        )
        total.add(ranking)
    if total is None:
        raise invalid("scenarios", "one or more", len(scenarios))
    optimum, efficient, pareto, infeasible = counts / len(scenarios)
    never = total.count == 0
    with np.errstate(invalid="ignore"):  # 0 / 0 where a design is never feasible
        spread = np.sqrt(total.squares / total.count[:, None])
        mean_regret = total.regret / total.count
    return Robustness(
        X, tuple(parameters), scenarios, tuple(objectives),
        optimum, efficient, pareto, infeasible,
        mean=np.where(never[:, None], np.nan, total.mean),
        spread=spread,
        worst=np.where(never[:, None], np.nan, total.worst),
        mean_regret=mean_regret,
        worst_regret=np.where(never, np.nan, total.worst_regret),
    )  # fmt: skip


@dataclass(eq=False)
class _Moments:
    """Running sums over the scenarios in which each design is feasible (Welford's method)."""

    count: NDArray[np.int64]
    mean: Array
    squares: Array
    worst: Array
    regret: Array
    worst_regret: Array

    @classmethod
    def zero(cls, n: int, m: int) -> _Moments:
        zero = np.zeros((n, m))
        lowest = np.full((n, m), -np.inf)
        return cls(np.zeros(n, dtype=np.int64), zero, zero.copy(), lowest, np.zeros(n), np.zeros(n))

    def add(self, ranking: ScenarioRanking) -> None:
        there = ranking.feasible
        F = ranking.F[there]
        self.count[there] += 1
        delta = F - self.mean[there]
        self.mean[there] += delta / self.count[there, None]
        self.squares[there] += delta * (F - self.mean[there])
        self.worst[there] = np.maximum(self.worst[there], F)
        self.regret[there] += ranking.regret[there]
        self.worst_regret[there] = np.maximum(self.worst_regret[there], ranking.regret[there])
