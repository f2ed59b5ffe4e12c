"""NSGA-III, the alternative optimiser, with settings that follow from problem and budget."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.nsga3 import NSGA3, comp_by_cv_then_random
from pymoo.core.mixed import (
    MixedVariableDuplicateElimination,
    MixedVariableMating,
    MixedVariableSampling,
)
from pymoo.core.population import Population
from pymoo.core.result import Result
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.crossover.ux import UX
from pymoo.operators.mutation.bitflip import BitflipMutation
from pymoo.operators.mutation.pm import PM
from pymoo.operators.repair.rounding import RoundingRepair
from pymoo.operators.sampling.rnd import BinaryRandomSampling, IntegerRandomSampling
from pymoo.operators.selection.tournament import TournamentSelection

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import integer, invalid
from pymoo_psi.problems import (
    LogScaled,
    design_space,
    require_known_keywords,
    require_problem,
    required,
    seed_ties,
)


def nsga3(
    problem: Any,
    n_evaluations: int,
    *,
    seed: int | None = None,
    verbose: bool = False,
    progress: bool = False,
    **kwargs: Any,
) -> Result:
    """Minimise a problem by pymoo's NSGA-III and return the Result; ``minimize`` is not needed.

    Exactly ``n_evaluations`` designs are asked for, of which those that violate the problem's
    ``requirements`` are not evaluated; variables of its ``log`` are searched in the logarithm.
    The population holds about 1.5 sqrt(n_evaluations) designs, so that a larger budget buys both
    more designs and more generations; the last generation is cut to the budget. Variables that
    are integer, binary or of several types have the operators that pymoo names for them.

    It takes no formulation, as where it searches depends on the objectives: within limits on
    variables it searches by :class:`~pymoo_psi.Restricted`, and what it has evaluated is asked
    anew where :class:`~pymoo_psi.Recorded` keeps it, ``recorded.table.under(formulation)``.

    Args:
        problem: A pymoo problem with two or more objectives.
        n_evaluations: The budget, 1 or more.
        seed: Seed of the run, which can be repeated with it.
        verbose: As for ``minimize``.
        progress: As for ``minimize``.
        **kwargs: Further arguments of pymoo's ``NSGA3``, such as ``sampling``, ``ref_dirs``,
            ``callback``; and ``termination`` as for ``minimize``.

    Returns:
        The pymoo ``Result``: ``res.X`` and ``res.F`` are the designs found, ``res.pop`` the last
        population. How many designs requirements kept from being evaluated is ``n_not_run`` of a
        :class:`~pymoo_psi.Required` that is given as the problem.

    Raises:
        ArgumentValueError: The budget is below 1, or the problem has one objective.
        ArgumentTypeError: The problem is no pymoo problem, or a keyword is unknown.

    Example:
        >>> from pymoo_psi import SphereChute
        >>> res = nsga3(SphereChute(0.4, model="rolling"), n_evaluations=300, seed=1)
        >>> res.algorithm.evaluator.n_eval
        300
    """
    require_problem(problem)
    problem = required(problem)
    scaled = any(v.kind is Kind.LOG for v in design_space(problem).variables)
    problem = LogScaled(problem) if scaled else problem
    budget = integer("n_evaluations", n_evaluations, minimum=1)
    require_known_keywords("nsga3", NSGA3, kwargs)
    if problem.n_obj < 2:
        remedy = "use PSI, or one of pymoo's algorithms for a single objective"
        rule = "at least 2 for NSGA-III"
        raise invalid("the number of objectives of problem", rule, problem.n_obj, remedy)
    size = population_size(problem.n_obj, budget)
    if "ref_dirs" not in kwargs:
        kwargs["ref_dirs"] = reference_directions(problem.n_obj, size)
        kwargs.setdefault("pop_size", size)
    kwargs = operators(problem) | kwargs
    # pymoo's default would end a run by its own rules, before the budget is used up
    kwargs.setdefault("termination", ("n_eval", budget))
    algorithm = NSGA3(seed=seed, **kwargs)
    result = run_within_budget(algorithm, problem, budget, verbose=verbose, progress=progress)
    if scaled:
        result.problem = problem.wrapped
        shared = {id(each): each for group in (result.pop, result.opt) for each in group}
        found = Population.create(*shared.values())
        found.set("X", problem.original(found.get("X")))
        if result.X is not None:
            result.X = result.opt.get("X")
    return result


def operators(problem: Any) -> dict[str, Any]:
    """Return what pymoo's genetic algorithms need for variables that are not real in a vector.

    As its documentation has it (pages *Mixed Variable Problem*, *Discrete Variables* and *Binary
    Variables*); with NSGA-III's own selection, since pymoo's mating for mixed variables draws
    parents at random.
    """
    if getattr(problem, "vars", None):
        same = MixedVariableDuplicateElimination()
        selection = TournamentSelection(func_comp=comp_by_cv_then_random)
        mating = MixedVariableMating(selection, eliminate_duplicates=same)
        return {"sampling": MixedVariableSampling(), "mating": mating, "eliminate_duplicates": same}
    if problem.vtype is int:
        whole = {"vtype": float, "repair": RoundingRepair()}
        sampling, crossover, mutation = IntegerRandomSampling(), SBX(**whole), PM(**whole)
    elif problem.vtype is bool:
        sampling, crossover, mutation = BinaryRandomSampling(), UX(), BitflipMutation()
    else:
        return {}
    return {"sampling": sampling, "crossover": crossover, "mutation": mutation}


def population_size(n_obj: int, n_evaluations: int) -> int:
    """Return about 1.5 sqrt(n_evaluations), at least one design per objective.

    A larger budget so buys both more designs and more generations.
    """
    return max(n_obj, math.ceil(1.5 * math.sqrt(n_evaluations)))


def reference_directions(n_obj: int, n_points: int) -> NDArray[np.float64]:
    """Return at most ``n_points`` (but at least ``n_obj``) directions of Das and Dennis.

    With as many partitions as fit. Where these are fewer than the objectives, so that no
    direction lies inside the simplex, a second, inner layer is added if it fits (Deb and Jain,
    IEEE Trans. Evol. Comput. 18(4), 2014, Section IV).

    Returns:
        ``(h, n_obj)`` array of non-negative rows with sum 1.
    """
    from pymoo.util.ref_dirs import get_reference_directions  # SciPy, a fifth of a second
    from pymoo.util.reference_direction import (
        get_number_of_uniform_points,
        get_partition_closest_to_points,
    )

    # Only with as many partitions as objectives does a direction lie inside the simplex (Das and
    # Dennis, SIAM J. Optim. 8(3), 1998).
    outer = max(get_partition_closest_to_points(n_points, n_obj), 1)
    left = n_points - get_number_of_uniform_points(outer, n_obj)
    layers = [(outer, 1.0)]
    if outer < n_obj and left >= n_obj:
        layers.append((min(get_partition_closest_to_points(left, n_obj), outer), 0.5))
    layer = partial(get_reference_directions, "das-dennis", n_obj)
    return np.vstack([layer(n_partitions=p, scaling=scaling) for p, scaling in layers])


def run_within_budget(algorithm: Any, problem: Any, n_evaluations: int, **setup: Any) -> Any:
    """Run an algorithm until a number of designs is evaluated, or until it ends by itself.

    A termination is asked only after a generation, so the budget is kept here: the last
    generation is cut to what is left. Designs of the first one that are evaluated already cost
    nothing and stay. NSGA-III's ties are drawn with the algorithm's seed.

    Args:
        algorithm: A pymoo algorithm that is not set up yet.
        problem: A pymoo problem.
        n_evaluations: The budget, 1 or more.
        **setup: For pymoo's ``setup``, such as ``verbose``.

    Returns:
        The pymoo ``Result``.
    """
    seed_ties(algorithm)
    algorithm.setup(problem, **setup)
    # a budget may be used up by its start
    while algorithm.has_next() and (left := n_evaluations - algorithm.evaluator.n_eval) > 0:
        if (infills := algorithm.infill()) is None:  # it has nothing more to ask for
            break
        if isinstance(infills, Population):  # a single individual is affordable, as left > 0
            new = np.array([not individual.evaluated for individual in infills])
            infills = infills[~new | (np.cumsum(new) <= left)]
        algorithm.evaluator.eval(problem, infills, algorithm=algorithm)
        if algorithm.evaluator.n_eval == n_evaluations:
            algorithm.termination.terminate()
        algorithm.advance(infills=infills)
    result = algorithm.result()
    result.algorithm = algorithm
    return result
