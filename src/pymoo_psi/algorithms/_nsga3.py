"""NSGA-III, the alternative optimiser, with settings chosen from the problem and the budget."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga3 import NSGA3, comp_by_cv_then_random
from pymoo.core.mixed import (
    MixedVariableDuplicateElimination,
    MixedVariableMating,
    MixedVariableSampling,
)
from pymoo.core.population import Population
from pymoo.core.repair import NoRepair
from pymoo.core.result import Result
from pymoo.core.sampling import Sampling
from pymoo.operators.crossover.ox import OrderCrossover
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.crossover.ux import UX
from pymoo.operators.mutation.bitflip import BitflipMutation
from pymoo.operators.mutation.inversion import InversionMutation
from pymoo.operators.mutation.pm import PM
from pymoo.operators.repair.rounding import RoundingRepair
from pymoo.operators.sampling.rnd import (
    BinaryRandomSampling,
    IntegerRandomSampling,
    PermutationRandomSampling,
)
from pymoo.operators.selection.tournament import TournamentSelection

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Array, Values, integer, invalid
from pymoo_psi.problems import (
    LogScaled,
    design_space,
    is_permutation,
    require_known_keywords,
    require_no_permutation,
    require_problem,
    seed_ties,
    untolerant,
    with_requirements,
)

_Convert = Callable[[Any], Any]


def nsga3(
    problem: Any,
    n_evaluations: int,
    *,
    seed: int | None = None,
    verbose: bool = False,
    progress: bool = False,
    **kwargs: Any,
) -> Result:
    """Minimise a problem with pymoo's NSGA-III and return the Result, without ``minimize``.

    The run uses exactly ``n_evaluations`` designs. Designs that violate the problem's
    ``requirements`` are not evaluated. Variables in its ``log`` are searched on a logarithmic
    scale: crossover, mutation and samplings of pymoo work on their logarithms, everything else on
    their values. The population has about 1.5 sqrt(n_evaluations) designs, so that a larger budget
    gives both more designs and more generations; the last generation is cut to the budget. Integer,
    binary and mixed variables use the operators that pymoo recommends; permutations, of a problem
    with ``permutation = True`` or by ``sampling=PermutationRandomSampling()``, stay permutations.

    There is no argument for a formulation, because the search depends on the objectives. To limit
    variables, use :class:`~pymoo_psi.Restricted`. To see the evaluated designs under another
    formulation, wrap the problem in :class:`~pymoo_psi.Recorded` and use
    ``recorded.table.under(formulation)``.

    Args:
        problem: A pymoo problem with two or more objectives.
        n_evaluations: The budget, 1 or more.
        seed: Seed of the run; the same seed repeats it. By default pymoo draws one, whereas the
            command takes 1.
        verbose: As for ``minimize``.
        progress: As for ``minimize``.
        **kwargs: Further arguments of pymoo's ``NSGA3``, such as ``sampling``, ``ref_dirs``,
            ``callback``; and ``termination`` as for ``minimize``.

    Returns:
        The pymoo ``Result``: ``res.X`` and ``res.F`` are the best designs, ``res.pop`` is the last
        population. To count the designs that were not evaluated because of requirements, pass a
        :class:`~pymoo_psi.Required` as the problem and read its ``n_not_run``.

    Raises:
        ArgumentValueError: The budget is below 1, the problem has a single objective, or it is one
            of permutations of pymoo and there is no ``sampling``.
        ArgumentTypeError: The problem is not a pymoo problem, or a keyword is unknown.

    Example:
        >>> from pymoo_psi import SphereChute
        >>> res = nsga3(SphereChute(0.4, model="rolling"), n_evaluations=300, seed=1)
        >>> res.algorithm.evaluator.n_eval
        300
    """
    require_problem(problem)
    if "sampling" not in kwargs and not getattr(problem, "permutation", False):
        require_no_permutation(problem)
    problem = with_requirements(problem)
    budget = integer("n_evaluations", n_evaluations, minimum=1)
    require_known_keywords("nsga3", NSGA3, kwargs)
    if problem.n_obj < 2:
        rule = "at least 2 for NSGA-III"
        remedy = "use PSI, or one of pymoo's algorithms for a single objective"
        raise invalid("the number of objectives of problem", rule, problem.n_obj, remedy)
    size = population_size(problem.n_obj, budget)
    if "ref_dirs" not in kwargs:
        kwargs["ref_dirs"] = reference_directions(problem.n_obj, size)
        kwargs.setdefault("pop_size", size)
    kwargs = operators(problem, kwargs.get("sampling")) | kwargs
    # pymoo's default termination could end the run before the budget is used up
    kwargs.setdefault("termination", ("n_eval", budget))
    algorithm = NSGA3(seed=seed, **kwargs)
    vary_logarithms(algorithm, problem)
    return run_within_budget(algorithm, problem, budget, verbose=verbose, progress=progress)


@dataclass(frozen=True)
class _Converted:
    """An operator of pymoo for another problem, whose designs are converted.

    Attributes:
        operator: The operator, which takes a problem and a population, or a number of designs.
        problem: The problem that it is for.
        before: Converts designs for it.
        after: Converts designs that it returns.
    """

    operator: Any
    problem: Any
    before: _Convert
    after: _Convert

    def __call__(self, _: Any, given: Any, *args: Any, **kwargs: Any) -> Population:
        """Return the population that the operator returns, converted."""
        if isinstance(given, Population):
            copies = [individual.copy(deep=False) for individual in given]
            given = _converted(Population.create(*copies), self.before)
        returned = self.operator(self.problem, given, *args, **kwargs)
        return _converted(returned, self.after)

    do = __call__


def _converted(population: Population, convert: _Convert) -> Population:
    if len(population) > 0:
        population.set("X", convert(population.get("X")))
    return population


def vary_logarithms(algorithm: Any, problem: Any) -> None:
    """Make a genetic algorithm vary the logarithms of the variables that have such a scale.

    Samplings of pymoo fill the logarithms. Everything else has the values themselves: populations,
    repairs, starts and samplings of users.
    """
    if Kind.LOG not in [variable.kind for variable in design_space(problem).variables]:
        return
    seed_ties(algorithm)  # the mating does not show its selection afterwards
    scaled = LogScaled(untolerant(problem))  # only its variables are used
    mating = algorithm.mating
    if not isinstance(mating.repair, NoRepair):
        mating.repair = _Converted(mating.repair, problem, scaled.original, scaled.scaled)
    algorithm.mating = _Converted(mating, scaled, scaled.scaled, scaled.original)
    first = algorithm.initialization
    is_pymoos = type(first.sampling).__module__.startswith("pymoo.")
    if is_pymoos and isinstance(first.sampling, Sampling):
        first.sampling = _Converted(first.sampling, scaled, scaled.scaled, scaled.original)


def operators(problem: Any, sampling: Any = None) -> Values:
    """Return the operators with which pymoo's genetic algorithms search other than real variables.

    They are those of pymoo's documentation (pages *Mixed Variable Problem*, *Discrete Variables*,
    *Binary Variables* and *Permutations*), except for NSGA-III's selection: pymoo's mating for
    mixed variables draws parents at random.

    Args:
        problem: The problem.
        sampling: The sampling of the first designs, if it is chosen: those of permutations stay
            permutations.
    """
    if is_permutation(problem) or isinstance(sampling, PermutationRandomSampling):
        return _operators(PermutationRandomSampling(), OrderCrossover(), InversionMutation())
    if getattr(problem, "vars", None):
        selection = TournamentSelection(func_comp=comp_by_cv_then_random)
        duplicates = MixedVariableDuplicateElimination()
        return {
            "sampling": MixedVariableSampling(),
            "mating": MixedVariableMating(selection, eliminate_duplicates=duplicates),
            "eliminate_duplicates": duplicates,
        }
    if problem.vtype is int:
        rounded = {"vtype": float, "repair": RoundingRepair()}
        return _operators(IntegerRandomSampling(), SBX(**rounded), PM(**rounded))
    if problem.vtype is bool:
        return _operators(BinaryRandomSampling(), UX(), BitflipMutation())
    return {}


def _operators(sampling: Sampling, crossover: Any, mutation: Any) -> Values:
    return {"sampling": sampling, "crossover": crossover, "mutation": mutation}


def population_size(n_obj: int, n_evaluations: int) -> int:
    """Return about 1.5 sqrt(n_evaluations), at least one design per objective.

    So a larger budget gives both more designs and more generations.
    """
    return max(n_obj, math.ceil(1.5 * math.sqrt(n_evaluations)))


def reference_directions(n_obj: int, n_points: int) -> Array:
    """Return at most ``n_points``, but at least ``n_obj``, directions of Das and Dennis.

    There are as many partitions as fit. If these are fewer than the objectives, so that no
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

    layer = partial(get_reference_directions, "das-dennis", n_obj)
    outer = max(get_partition_closest_to_points(n_points, n_obj), 1)
    directions = layer(n_partitions=outer, scaling=1.0)
    # A direction inside the simplex needs as many partitions as there are objectives (Das and
    # Dennis, SIAM J. Optim. 8(3), 1998).
    left = n_points - get_number_of_uniform_points(outer, n_obj)
    if outer < n_obj and left >= n_obj:
        inner = min(get_partition_closest_to_points(left, n_obj), outer)
        directions = np.vstack([directions, layer(n_partitions=inner, scaling=0.5)])
    return np.asarray(directions)


def run_within_budget(algorithm: Any, problem: Any, n_evaluations: int, **setup: Any) -> Any:
    """Run an algorithm until a number of designs is evaluated, or until it ends by itself.

    pymoo checks a termination only after each generation, so the budget is kept here: the last
    generation is cut to what is left. Designs of the first generation that are already evaluated
    cost nothing and stay. NSGA-III breaks ties with the algorithm's seed.

    Args:
        algorithm: A pymoo algorithm that is not set up yet.
        problem: A pymoo problem.
        n_evaluations: The budget, 1 or more.
        **setup: Arguments of pymoo's ``setup``, such as ``verbose``.

    Returns:
        The pymoo ``Result``.
    """
    seed_ties(algorithm)
    algorithm.setup(problem, **setup)
    evaluator = algorithm.evaluator
    # the setup may have used up the budget already
    while algorithm.has_next() and evaluator.n_eval < n_evaluations:
        infills = algorithm.infill()
        if infills is None:  # the algorithm has no further designs
            break
        if isinstance(infills, Population):  # a single individual is always within the budget
            # those that are evaluated already, and as many others as are left
            is_new = np.array([not individual.evaluated for individual in infills])
            n_left = n_evaluations - evaluator.n_eval
            infills = infills[~is_new | (np.cumsum(is_new) <= n_left)]
        evaluator.eval(problem, infills, algorithm=algorithm)
        if evaluator.n_eval == n_evaluations:
            algorithm.termination.terminate()
        algorithm.advance(infills=infills)
    result = algorithm.result()
    result.algorithm = algorithm
    return result
