"""How a ranking of designs changes between scenarios of uncertain parameters.

A scenario determines the objective values of every design, and which designs are feasible. These
are ranked with U, N and the scale of that scenario.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._validation import Array, Designs, Entries, Mask, Received, invalid
from pymoo_psi.pareto import rank_of_efficiency
from pymoo_psi.problems import DesignSpace, Robust, design_space, untolerant

if TYPE_CHECKING:
    import pandas as pd


def robustness(
    make_problem: Callable[..., Any],
    X: Any,
    *,
    uncertainty: Entries,
    n_scenarios: int = 256,
    normalize: bool = True,
) -> pd.DataFrame:
    """Rank designs in many scenarios of uncertain parameters of their problem.

    In every scenario, the problem of that scenario evaluates the designs, and these are ranked by
    efficiency among themselves. A design counts as infeasible and is not ranked if it violates a
    constraint, lies outside the bounds of that scenario's problem, fails, or has an objective that
    is not finite. If all designs fail, this is an error, unless ``make_problem`` returns
    ``FailureTolerant(problem)``. For statistics of the objectives over the same scenarios, see
    :class:`pymoo_psi.Robust`.

    Args:
        make_problem: A function of the uncertain parameters, called with keyword arguments, that
            returns a pymoo problem. The numbers of variables and objectives must be the same in all
            scenarios.
        X: ``(n, n_var)`` designs, or a list of mappings for a problem with named variables. Give
            the whole Pareto set, as U and N of a scenario are taken from these designs: among the
            best few of them, another one may be the optimum even if nothing is uncertain.
        uncertainty: The distribution of each parameter by name, from ``scipy.stats`` or any other
            object with a quantile function ``ppf`` or ``icdf``. The parameters are independent.
        n_scenarios: Number of scenarios, which are LPτ points mapped by the quantile functions.
        normalize: Measure each objective in units of its range in the scenario, as for
            :func:`pymoo_psi.rank_of_efficiency`.

    Returns:
        One row per design, the most robust first; the index is the row in ``X``. After the
        variables the columns are

        - ``optimum_share``, the share of the scenarios in which the design is the Salukvadze
          optimum;
        - ``efficient_share``, the share in which its rank of efficiency is 5 or 6;
        - ``pareto_share``, the share in which it is Pareto optimal among the designs;
        - ``infeasible_share``, the share in which it is infeasible;
        - ``mean_regret`` and ``worst_regret``. The regret in a scenario is the distance from U
          beyond that of the nearest design, in the scale of the scenario. It refers to the
          scenarios in which the design is feasible, and is NaN if there are none. Normalised, an
          objective in which all Pareto-optimal designs are equal does not count: where one design
          dominates all others, every regret is 0.

        The order is by the largest ``optimum_share``, then the largest ``efficient_share``, then
        the smallest ``infeasible_share``, then the smallest ``mean_regret``.

    Raises:
        ArgumentValueError: A count is out of range, a distribution has infinite values, a problem
            does not take a parameter, or all designs fail in a scenario.
        ArgumentTypeError: An argument has the wrong type, or ``make_problem`` does not return a
            problem.

    Example:
        A lighter rod bends more. Under every load, the middle one of three rods is the optimum.

        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from scipy.stats import uniform
        >>> def rod(load):
        ...     return FunctionalProblem(1, [lambda x: x[0], lambda x: load / x[0]], xl=0, xu=9)
        >>> loads = {"load": uniform(0.5, 1.0)}
        >>> rods = robustness(rod, [[0.5], [1.0], [2.0]], uncertainty=loads)
        >>> rods["optimum_share"].to_dict()  # the first and the last tie in all but the regret
        {1: 1.0, 0: 0.0, 2: 0.0}

        The chute, whose friction is uncertain:

        >>> from pymoo_psi import VectorizedSphereChute
        >>> designs = [[0.2, 0.1], [0.25, 0.1], [0.3, 0.1], [0.35, 0.1], [0.4, 0.1]]
        >>> frame = robustness(
        ...     lambda mu, c: VectorizedSphereChute(mu, c=c, model="rolling"),
        ...     designs,
        ...     uncertainty={"mu": uniform(0.3, 0.2), "c": uniform(0.2, 0.2)},
        ...     n_scenarios=16,
        ...     normalize=False,
        ... )
        >>> frame[["x1", "x2", "optimum_share", "worst_regret"]].round(3)
             x1   x2  optimum_share  worst_regret
        2  0.30  0.1          0.688         0.022
        3  0.35  0.1          0.312         0.028
        4  0.40  0.1          0.000         0.075
        1  0.25  0.1          0.000         0.114
        0  0.20  0.1          0.000         0.264
    """
    import pandas as pd

    robust = Robust(make_problem, uncertainty=uncertainty, n_scenarios=n_scenarios)
    names = list(robust.space.variable_names)
    designs = _matrix(X, robust.space)
    F, feasible = _in_scenarios(robust, designs)
    counts = np.zeros((len(designs), 3))
    regret = np.full(feasible.shape, np.nan)
    for k, rows in enumerate(map(np.flatnonzero, feasible)):
        if len(rows) == 0:
            continue
        ranking = rank_of_efficiency(F[k][rows], normalize=normalize)
        # Ranks 5 and 6 need P23 and one more pair: nearest to U in two respects.
        counts[rows] += np.column_stack([ranking.place == 1, ranking.rank >= 5, ranking.pareto])
        # The minimum over the Pareto-optimal designs is that over all: as f >= U, a dominated
        # design is farther from U than the one that dominates it.
        mu1 = ranking.criteria[:, 0]
        regret[k, rows] = mu1 - mu1[ranking.pareto].min()
    frame = pd.DataFrame(designs, columns=names).infer_objects()
    frame[["optimum_share", "efficient_share", "pareto_share"]] = counts / len(feasible)
    frame["infeasible_share"] = (~feasible).mean(axis=0)
    regrets = pd.DataFrame(regret)  # whose mean and maximum omit NaN
    frame["mean_regret"] = regrets.mean()
    frame["worst_regret"] = regrets.max()
    order = ["optimum_share", "efficient_share", "infeasible_share", "mean_regret"]
    return frame.sort_values(order, ascending=[False, False, True, True], kind="stable")


def _matrix(X: Any, space: DesignSpace) -> Designs:
    """Return designs as an ``(n, n_var)`` matrix of the values of all variables.

    The columns of a frame are in any order, if they are called as the variables are.
    """
    names = space.variable_names
    if {*getattr(X, "columns", ())} == {*names}:
        X = X[[*names]]
    designs = np.array(X)
    if designs.ndim == 1 and len(designs) and isinstance(designs[0], Mapping):
        return space.to_matrix(designs)
    if len(designs) == 0 or designs.shape[1:] != (len(names),):
        rule = f"designs of {len(names)} variables, in an array (n, n_var), n >= 1"
        raise invalid("X", rule, Received(f"an array of shape {designs.shape}"))
    return designs


def _in_scenarios(robust: Robust, matrix: Designs) -> tuple[Array, Mask]:
    """Return the ``(S, n, m)`` objectives of designs in S scenarios, and which are feasible.

    Raises:
        ArgumentValueError: All designs fail in a scenario.
    """
    F, feasible, reasons = robust.in_scenarios(matrix)
    for k, problem in enumerate(robust.problems):
        if all(reasons[k]) and untolerant(problem) is problem:  # likely a mistake
            remedy = "if designs may fail, make FailureTolerant(problem)"
            raise invalid("make_problem", "of problems that evaluate X", reasons[k, 0], remedy)
        feasible[k] &= design_space(problem).are_near(matrix)
    return F, feasible
