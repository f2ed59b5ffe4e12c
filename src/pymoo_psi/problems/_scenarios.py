"""Scenarios: quasi-random values of uncertain quantities, a problem for each, designs in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid, mapping, wrong_type
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, PsiError
from pymoo_psi.pareto import competes, meets_constraints
from pymoo_psi.problems._evaluation import evaluate_designs
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.sequences import lp_tau

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def scenario_values(n_scenarios: int, **distributions: Mapping[str, Any]) -> list[Array]:
    """Return quasi-random values of independent uncertain quantities.

    They are LPτ points taken through the quantile functions. The first point is the centre, with
    all quantities at their medians: the origin has no quantile under an unbounded distribution.

    Args:
        n_scenarios: How many scenarios.
        **distributions: By argument of the user, distributions by name, from ``scipy.stats`` or
            anything else with the quantile function ``ppf`` or ``icdf``.

    Returns:
        For each argument ``(n_scenarios, k)`` finite values, a column for each distribution.

    Raises:
        ArgumentTypeError: A name is no text, or what it names is no distribution.
        ArgumentValueError: A distribution gives no finite values.
    """
    named = [
        (argument, name, distribution)
        for argument, given in distributions.items()
        for name, distribution in mapping(argument, given, "names to distributions").items()
    ]
    points = lp_tau(n_scenarios, len(named), first=2).T
    values: dict[str, list[Array]] = {argument: [] for argument in distributions}
    for (argument, name, distribution), column in zip(named, points, strict=True):
        # SciPy has both names: ppf of its old distributions, icdf of its new ones.
        quantile = getattr(distribution, "ppf", getattr(distribution, "icdf", None))
        where = f"{argument}[{name!r}]"
        if not isinstance(name, str) or not callable(quantile):
            rule = "a distribution such as scipy.stats.uniform(0.3, 0.2)"
            raise wrong_type(where, rule, distribution)
        found = np.asarray(quantile(column), dtype=np.float64)
        if found.shape != (n_scenarios,) or not np.isfinite(found).all():
            raise invalid(where, "a distribution with finite quantiles", Received(str(found)))
        values[argument].append(found)
    return [
        np.column_stack(columns) if columns else np.empty((n_scenarios, 0))
        for columns in values.values()
    ]


def scenario_problem(
    argument: str, make_problem: Callable[..., Any], parameters: Mapping[str, float], like: Any
) -> Any:
    """Return the problem of a scenario.

    Args:
        argument: The user's argument that makes the problem.
        make_problem: What makes it, called with the parameters by name.
        parameters: Their values in this scenario.
        like: ``(n_var, n_obj)`` of all scenarios; None for the first.

    Raises:
        ArgumentValueError: There is no problem in this scenario, or one of another size, or it
            does not take a parameter.
        ArgumentTypeError: What is made is no problem.
    """
    try:
        problem = make_problem(**parameters)
        require_problem(problem, parameters)
    except PsiError as error:
        where = ", ".join(f"{name}={value:g}" for name, value in parameters.items())
        kind = ArgumentTypeError if isinstance(error, TypeError) else ArgumentValueError
        raise kind(f"the scenario {where} must give a problem: {error}") from error
    sizes = (problem.n_var, problem.n_obj)
    if like is not None and sizes != like:
        rule = f"of {like[0]} variables and {like[1]} objectives in every scenario, as in the first"
        raise invalid(argument, rule, Received(f"{sizes[0]} and {sizes[1]}"))
    return problem


def evaluated(problem: Any, designs: Any, *args: Any, **kwargs: Any) -> tuple[Array, Mask, Any]:
    """Evaluate designs in a scenario.

    Returns:
        ``(n, m)`` their objectives; ``(n,)`` which are feasible with finite objectives, and
        ``(n,)`` why others failed, empty for those that did not.
    """
    out = evaluate_designs(problem, designs, *args, **kwargs)
    F, reasons = np.asarray(out["F"]), out["failure"]
    feasible = meets_constraints(out["G"], out["H"]) & (reasons == "")
    return F, competes(F, feasible), reasons
