"""Designs of a family of problems whose parameters are uncertain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import (
    Received,
    boolean,
    integer,
    invalid,
    job_count,
    known_name,
    wrong_type,
)
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, PsiError
from pymoo_psi.parallel._tasks import in_order, in_parallel
from pymoo_psi.pareto import Robustness, meets_constraints
from pymoo_psi.pareto._scenarios import rank_scenario, tally
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.sequences import lp_tau
from pymoo_psi.sequences._scenarios import quantiles

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
    """See how designs rank when parameters of their problem are uncertain.

    In every scenario the designs are evaluated by the problem of that scenario and ranked by
    efficiency among themselves. A design that is infeasible there, or has an objective that is
    not finite, is left out of that ranking. A model that raises ends it: where designs may fail,
    ``make_problem`` returns ``FailureTolerant(problem)``, and they count as infeasible.

    Args:
        make_problem: Called with the uncertain parameters by name, returns a pymoo problem. The
            number of objectives must be the same in all scenarios.
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
            else f1, f2, …. An objective in its attribute ``maximize`` is told in its own sense.
        n_jobs: Processes to work in, -1 for one per core. The result does not depend on it.

    Returns:
        Shares, statistics of the criteria and regret for each design.

    Raises:
        ArgumentValueError: A count is out of range, a distribution gives no finite values, or no
            problem can be made in a scenario or evaluated there as the others, or the problem
            does not take a parameter.
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
    if not callable(make_problem):
        remedy = "give its class, or a function that makes it of the uncertain parameters"
        raise wrong_type("make_problem", "callable", make_problem, remedy)
    normalize, keep_bounds = boolean("normalize", normalize), boolean("keep_bounds", keep_bounds)
    n_jobs = job_count("n_jobs", n_jobs)
    designs = _designs(X)
    points = scenarios(uncertainty, n_scenarios)
    parameters = tuple(uncertainty)

    # The first scenario tells how many objectives all must have, and mistakes before any work.
    first = _problem(make_problem, dict(zip(parameters, points[0].tolist(), strict=True)))
    m, told = first.n_obj, getattr(first, "names", None) or {}
    own = [told.get(f"f{j + 1}", f"f{j + 1}") for j in range(m)]
    more = [known_name("maximize", name, own) for name in getattr(first, "maximize", None) or ()]
    sign = [-1.0 if name in more else 1.0 for name in own]
    objectives = own if names is None else list(names)
    if len(objectives) != m:
        raise invalid("names", f"{m} names", objectives)

    def ranked(row: list[float]) -> tuple[Mask, Array]:
        problem = _problem(make_problem, dict(zip(parameters, row, strict=True)))
        if problem.n_obj != m:
            shown = Received(f"{m} and {problem.n_obj}")
            raise invalid("make_problem", "of one number of objectives", shown)
        F, feasible = _evaluated(problem, designs, keep_bounds)
        return rank_scenario(F, feasible, normalize=normalize)

    # In order, as the last digits of the sums depend on it, and must not on the processes.
    found = tally(
        in_order(in_parallel(ranked, points.tolist(), n_jobs)),
        X=designs if designs.ndim == 2 else tuple(designs),
        parameters=parameters,
        scenarios=points,
        objectives=objectives,
    )
    return replace(found, mean=found.mean * sign, worst=found.worst * sign)


def scenarios(uncertainty: Mapping[str, Any], n_scenarios: int) -> Array:
    """Return quasi-random values of uncertain parameters.

    They are the LPτ points after the origin, which has no quantile under an unbounded
    distribution, taken through the quantile functions.

    Args:
        uncertainty: Distributions by parameter, as for :func:`robustness`.
        n_scenarios: How many.

    Returns:
        ``(n_scenarios, k)`` values, a column for each parameter.
    """
    if not isinstance(uncertainty, Mapping):
        raise wrong_type("uncertainty", "a mapping from parameters to distributions", uncertainty)
    if not uncertainty:
        raise invalid("uncertainty", "one or more parameters", uncertainty)
    n_scenarios = integer("n_scenarios", n_scenarios, minimum=1)
    points = lp_tau(n_scenarios, len(uncertainty), first=2)
    return quantiles("uncertainty", uncertainty, points)


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


def _problem(make_problem: Callable[..., Any], parameters: Mapping[str, float]) -> Any:
    """Return the problem of a scenario."""
    try:
        problem = make_problem(**parameters)
        require_problem(problem)
    except PsiError as error:
        where = ", ".join(f"{name}={value:g}" for name, value in parameters.items())
        # The kind of the mistake is kept: callers tell a wrong type from a wrong value.
        kind = ArgumentTypeError if isinstance(error, TypeError) else ArgumentValueError
        raise kind(f"the scenario {where} must give a problem: {error}") from error
    require_problem(problem, parameters)
    return problem


def _evaluated(problem: Any, designs: NDArray[Any], keep_bounds: bool) -> tuple[Array, Mask]:
    """Return the ``(n, m)`` objectives of the designs in a scenario, and which are feasible."""
    if designs.ndim == 2 and designs.shape[1] != problem.n_var:
        shown = Received(f"an array of shape {designs.shape}")
        raise invalid("X", f"of {problem.n_var} variables, as the problem", shown)
    own = designs.copy()  # a model that changes its designs must not change the next scenario's
    if own.ndim == 1:
        own[:] = [dict(design) for design in designs]
    out = problem.evaluate(own, return_values_of=["F", "G", "H"], return_as_dictionary=True)
    feasible = meets_constraints(out["G"], out["H"])
    if keep_bounds and designs.ndim == 2:
        for bound, sign in ((problem.xl, 1), (problem.xu, -1)):
            if bound is not None:
                feasible &= (sign * designs >= sign * np.asarray(bound)).all(axis=1)
    elif keep_bounds:
        for name, variable in (getattr(problem, "vars", None) or {}).items():
            low, high = getattr(variable, "bounds", (None, None))  # a choice has none
            if low is not None and high is not None:
                inside = [name not in d or low <= d[name] <= high for d in designs]
                feasible &= np.array(inside)
    return np.asarray(out["F"], dtype=np.float64), feasible
