"""Designs of a family of problems whose parameters are uncertain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    Received,
    boolean,
    integer,
    invalid,
    job_count,
    known_name,
    mapping,
)
from pymoo_psi.parallel import in_order, in_parallel
from pymoo_psi.pareto import Robustness, rank_scenario, tally
from pymoo_psi.problems import (
    FailureTolerant,
    design_space,
    evaluated,
    scenario_problem,
    scenario_values,
)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def robustness(
    make_problem: Callable[..., Any],
    X: ArrayLike | Sequence[Mapping[str, Any]],
    *,
    uncertainty: Mapping[str, Any],
    n_scenarios: int = 256,
    normalize: bool = True,
    keep_bounds: bool = True,
    names: Sequence[str] | None = None,
    n_jobs: int = 1,
) -> Robustness:
    """Rank designs in many scenarios of uncertain parameters of their problem.

    In every scenario the designs are evaluated by the problem of that scenario and ranked by
    efficiency among themselves. A design that is infeasible there, whose evaluation fails, or that
    has an objective that is not finite, is left out of that ranking and counts as infeasible. It is
    an error if all fail, unless ``make_problem`` returns ``FailureTolerant(problem)``.

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
        keep_bounds: Count a design that lies outside the bounds of a scenario's problem as
            infeasible there. The chute's bound on the slope, for one, is 3.5 μ.
        names: Names of the objectives; those of the problem's attribute ``names`` unless given, or
            else f1, f2, …. One in its attribute ``maximize`` is reported in its own direction.
        n_jobs: Processes to work in, -1 for one per core. The result does not depend on it.

    Returns:
        Shares, statistics of the objectives and regret for each design.

    Raises:
        ArgumentValueError: A count is out of range, a distribution gives no finite values, no
            problem can be made in a scenario, it is of another size or does not take a parameter,
            or all designs fail in a scenario.
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
        >>> result.to_frame()[["x1", "x2", "optimum_share", "f1_worst"]].round(3)
             x1   x2  optimum_share  f1_worst
        2  0.30  0.1          0.688     2.318
        3  0.35  0.1          0.312     2.228
        4  0.40  0.1          0.000     2.159
        1  0.25  0.1          0.000     2.435
        0  0.20  0.1          0.000     2.589
    """
    normalize, keep_bounds = boolean("normalize", normalize), boolean("keep_bounds", keep_bounds)
    n_jobs = job_count("n_jobs", n_jobs)
    designs = _designs(X)
    if not mapping("uncertainty", uncertainty, "names to distributions"):
        raise invalid("uncertainty", "one parameter or more", uncertainty)
    points = scenario_values(
        integer("n_scenarios", n_scenarios, minimum=1),
        {f"uncertainty[{name!r}]": given for name, given in uncertainty.items()},
    )
    rows = [dict(zip(uncertainty, row, strict=True)) for row in points.tolist()]

    # The first scenario has the sizes that all must have, and shows mistakes before any work.
    first = scenario_problem("make_problem", make_problem, rows[0])
    if designs.ndim == 2 and designs.shape[1] != first.n_var:
        shown = Received(f"an array of shape {designs.shape}")
        raise invalid("X", f"of {first.n_var} variables, as the problem", shown)
    m, sizes = first.n_obj, (first.n_var, first.n_obj)
    given = getattr(first, "names", None) or {}
    own = [given.get(f"f{j + 1}", f"f{j + 1}") for j in range(m)]
    more = [known_name("maximize", name, own) for name in getattr(first, "maximize", None) or ()]
    sign = [-1.0 if name in more else 1.0 for name in own]
    objectives = own if names is None else list(names)
    if len(objectives) != m:
        raise invalid("names", f"{m} names", objectives)

    def ranked(parameters: dict[str, float]) -> tuple[Mask, Array]:
        problem = scenario_problem("make_problem", make_problem, parameters, sizes)
        F, feasible, reasons = evaluated(problem, designs)
        if all(reasons) and not isinstance(problem, FailureTolerant):  # likely a mistake
            remedy = "if designs may fail, make FailureTolerant(problem)"
            raise invalid("make_problem", "of problems that evaluate X", reasons[0], remedy)
        if keep_bounds:
            feasible = feasible & _within_bounds(problem, designs)
        return rank_scenario(F, feasible, normalize=normalize)

    # In order, as the last digits of the sums depend on it, and must not on the processes.
    found = tally(
        in_order(in_parallel(ranked, rows, n_jobs)),
        X=designs if designs.ndim == 2 else tuple(designs),
        parameters=tuple(uncertainty),
        scenarios=points,
        objectives=objectives,
    )
    return replace(found, mean=found.mean * sign, worst=found.worst * sign)


def _designs(X: Any) -> NDArray[Any]:
    """Return designs as pymoo evaluates them: a matrix, or an array of mappings."""
    # By next(iter(X)), as X[0] of a data frame is a column of that name.
    if not isinstance(X, np.ndarray) and len(X) and isinstance(next(iter(X)), Mapping):
        designs = np.fromiter(X, object)
    else:
        designs = np.array(X)
    if designs.ndim != 2 and not (designs.ndim == 1 and designs.dtype == object):
        shape = Received(f"an array of shape {designs.shape}")
        raise invalid("X", "two-dimensional (n designs, n_var variables)", shape)
    if len(designs) == 0:
        raise invalid("X", "of at least one design", Received("none"))
    return designs


def _within_bounds(problem: Any, designs: NDArray[Any]) -> Mask:
    """``(n,)`` which designs lie within the bounds of a problem."""
    space = design_space(problem)
    inside = np.ones(len(designs), dtype=bool)
    for variable, column in zip(space.variables, space.to_matrix(designs).T, strict=True):
        if variable.kind in (Kind.REAL, Kind.INTEGER):
            values = column.astype(np.float64)
            inside &= (values >= variable.lower) & (values <= variable.upper)
    return inside
