"""How a ranking of designs holds from scenario to scenario of uncertain parameters.

A scenario gives every design its objective values, and says which designs are feasible in it.
These are ranked anew, with U, N and the scale of that scenario.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._output import Shown
from pymoo_psi._validation import Received, boolean, invalid
from pymoo_psi.pareto import rank_of_efficiency
from pymoo_psi.problems import Robust, design_space, layers, tolerates_failures

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class Robustness(Shown):
    """What becomes of n designs in S scenarios.

    Shares are of all S scenarios, regret of those in which the design is feasible, NaN if it is in
    none. Regret is measured in the frame of each scenario: how much farther from that scenario's U
    the design is than the nearest design.

    Attributes:
        X: ``(n, n_var)`` the designs, or ``(n,)`` mappings.
        scenarios: ``(S, k)`` the values of the k uncertain parameters.
        optimum_share: ``(n,)`` share of scenarios in which the design is the Salukvadze optimum.
        efficient_share: ``(n,)`` share in which its rank of efficiency is 5 or 6.
        pareto_share: ``(n,)`` share in which it is Pareto optimal among the designs.
        infeasible_share: ``(n,)`` share in which it is infeasible.
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
    """

    X: Any
    scenarios: Array
    optimum_share: Array
    efficient_share: Array
    pareto_share: Array
    infeasible_share: Array
    mean_regret: Array
    worst_regret: Array

    def __repr__(self) -> str:
        """Return how many designs there are, and which row is the first by :attr:`order`."""
        n, scenarios = len(self.optimum_share), len(self.scenarios)
        return f"Robustness({n} designs, {scenarios} scenarios: row {self.order[0]} is the first)"

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
            Columns: the variables, the four shares, ``mean_regret``, ``worst_regret``.
        """
        import pandas as pd

        frame = pd.DataFrame(list(self.X))
        # Mappings name their variables; the columns of a matrix have numbers only.
        frame.columns = [f"x{c + 1}" if isinstance(c, int) else c for c in frame.columns]
        shares = [f"{kind}_share" for kind in ("optimum", "efficient", "pareto", "infeasible")]
        for name in (*shares, "mean_regret", "worst_regret"):
            frame[name] = getattr(self, name)
        return frame.iloc[self.order]


def robustness(
    make_problem: Callable[..., Any],
    X: Any,
    *,
    uncertainty: Mapping[str, Any],
    n_scenarios: int = 256,
    normalize: bool = True,
) -> Robustness:
    """Rank designs in many scenarios of uncertain parameters of their problem.

    In every scenario the designs are evaluated by the problem of that scenario and ranked by
    efficiency among themselves. A design that is infeasible there, lies outside the bounds of that
    scenario's problem, whose evaluation fails, or that has an objective that is not finite, is left
    out of that ranking and counts as infeasible. It is an error if all fail, unless
    ``make_problem`` returns ``FailureTolerant(problem)``. Statistics of the objectives over the
    same scenarios are those of :class:`pymoo_psi.Robust`.

    Args:
        make_problem: Called with the uncertain parameters by name, returns a pymoo problem. The
            numbers of variables and objectives must be the same in all scenarios.
        X: ``(n, n_var)`` designs, or a list of mappings for a problem with named variables.
            Give the whole Pareto set: U and N of a scenario are taken from these designs. With only
            the best few of them another one may be the optimum even where nothing is uncertain.
        uncertainty: For each parameter its distribution, from ``scipy.stats`` or anything else
            with the quantile function ``ppf`` or ``icdf``; the parameters are independent.
        n_scenarios: How many scenarios: LPτ points, taken through the quantile functions.
        normalize: Measure each objective in units of its range in the scenario, as for
            :func:`pymoo_psi.rank_of_efficiency`.

    Returns:
        Shares and regret for each design.

    Raises:
        ArgumentValueError: A count is out of range, a distribution gives no finite values, a
            problem does not take a parameter, or all designs fail in a scenario.
        ArgumentTypeError: An argument has the wrong type; ``make_problem`` gives no problem.

    Example:
        >>> from scipy.stats import uniform
        >>> from pymoo_psi import VectorizedSphereChute
        >>> designs = [[0.2, 0.1], [0.25, 0.1], [0.3, 0.1], [0.35, 0.1], [0.4, 0.1]]
        >>> result = robustness(
        ...     lambda mu, c: VectorizedSphereChute(mu, c=c, model="rolling"),
        ...     designs,
        ...     uncertainty={"mu": uniform(0.3, 0.2), "c": uniform(0.2, 0.2)},
        ...     n_scenarios=16,
        ...     normalize=False,
        ... )
        >>> result.to_frame()[["x1", "x2", "optimum_share", "worst_regret"]].round(3)
             x1   x2  optimum_share  worst_regret
        2  0.30  0.1          0.688         0.022
        3  0.35  0.1          0.312         0.028
        4  0.40  0.1          0.000         0.075
        1  0.25  0.1          0.000         0.114
        0  0.20  0.1          0.000         0.264
    """
    normalize = boolean("normalize", normalize)
    robust = Robust(make_problem, uncertainty=uncertainty, n_scenarios=n_scenarios)
    # By next(iter(X)), as X[0] of a data frame is a column of that name.
    named = not isinstance(X, np.ndarray) and len(X) and isinstance(next(iter(X)), Mapping)
    designs = np.fromiter(X, object) if named else np.array(X)
    if not len(designs) or not (named or designs.shape[1:] == (robust.n_var,)):
        rule = f"designs of {robust.n_var} variables, in an array (n, n_var), n >= 1"
        raise invalid("X", rule, Received(f"an array of shape {designs.shape}"))
    matrix, ranked = robust.space.to_matrix(designs), []
    F, feasible, reasons = robust.in_scenarios(matrix)
    for k, problem in enumerate(robust.problems):
        tolerant = any(map(tolerates_failures, layers(problem)))
        if all(reasons[k]) and not tolerant:  # likely a mistake
            remedy = "if designs may fail, make FailureTolerant(problem)"
            raise invalid("make_problem", "of problems that evaluate X", reasons[k, 0], remedy)
        for variable, column in zip(design_space(problem).variables, matrix.T, strict=True):
            if variable.kind is not Kind.CHOICE:
                values = column.astype(np.float64)
                feasible[k] &= (variable.lower <= values) & (values <= variable.upper)
        ranked.append(_ranked(F[k], feasible[k], normalize))
    marks, regret = (np.array(arrays) for arrays in zip(*ranked, strict=True))
    with warnings.catch_warnings():  # of a design that is never feasible nothing is known
        warnings.simplefilter("ignore", RuntimeWarning)
        mean_regret, worst_regret = np.nanmean(regret, axis=0), np.nanmax(regret, axis=0)
    (optimum, efficient, pareto), infeasible = marks.mean(axis=0), (~feasible).mean(axis=0)
    shares = optimum, efficient, pareto, infeasible
    return Robustness(designs, robust.parameters, *shares, mean_regret, worst_regret)


def _ranked(F: Array, feasible: Mask, normalize: bool) -> tuple[Mask, Array]:
    """Rank the feasible designs of a scenario.

    Returns:
        ``(3, n)`` which designs are the Salukvadze optimum, of rank 5 or 6, Pareto optimal;
        ``(n,)`` their regret, μ1 less the least μ1 of the scenario, NaN where infeasible.
    """
    rows, n = np.flatnonzero(feasible), len(F)
    marks, regret = np.zeros((3, n), bool), np.full(n, np.nan)
    if len(rows):
        ranking = rank_of_efficiency(F[rows], normalize=normalize)
        marks[0, rows[ranking.salukvadze]] = True
        # 5 and 6 are the ranks of P23 and one more pair at least: nearest to U in two respects.
        marks[1, rows], marks[2, rows] = ranking.rank >= 5, ranking.pareto
        # The least of the Pareto-optimal designs is the least of all: with f >= U a dominated one
        # is farther from U than the one that dominates it.
        mu1 = ranking.criteria[:, 0]
        regret[rows] = mu1 - mu1[ranking.pareto].min()
    return marks, regret
