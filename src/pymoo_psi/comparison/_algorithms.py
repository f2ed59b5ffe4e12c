"""The algorithms that are compared: each spends a budget on a problem.

``psi``
    Parameter Space Investigation with the LPτ points. Deterministic: one run.
``psi-scrambled``
    The same with SciPy's scrambled Sobol' points. Different seeds show how much depends on the
    choice of points.
``nsga3``
    NSGA-III (:func:`pymoo_psi.nsga3`).
``psi+nsga3``
    Half the budget for PSI, the rest for NSGA-III, which starts from the best test points.
``psi-scrambled+nsga3``
    The same with scrambled points.
``surrogate``
    LPτ points, then designs that surrogates propose (:class:`pymoo_psi.SurrogatePSI`); for a few
    hundred evaluations.
``surrogate-scrambled``
    The same with scrambled points.

``nsga2``
    NSGA-II with the population size of :func:`pymoo_psi.nsga3`.

The first LPτ points are the corner of the lower bounds and the middle of the bounds. Many test
problems have Pareto-optimal designs there by coincidence, which says nothing about a method. The
variants with scrambled points avoid this.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import ReferenceDirectionSurvival
from pymoo.core.algorithm import Algorithm
from pymoo.core.termination import NoTermination
from pymoo.optimize import minimize
from pymoo.termination.default import DefaultTermination

from pymoo_psi._validation import collection, invalid, known_name, wrong_type
from pymoo_psi.algorithms import (
    PSI,
    QMCSampling,
    UniformSampling,
    investigate,
    nsga3,
    operators,
    population_size,
    reference_directions,
    run_within_budget,
)

DEFAULT_ALGORITHMS = ("psi", "psi-scrambled", "nsga3", "psi+nsga3")

Search = Callable[[Any, int, int], object]
"""Takes a problem, a number of evaluations and a seed, and evaluates designs."""


def searches(algorithms: Collection[str] | Mapping[str, Any]) -> dict[str, Search]:
    """Return the search of each algorithm by name.

    Args:
        algorithms: Names; or a mapping from the user's names to such names, to pymoo algorithms,
            which are copied for each run, or to functions that take a number of evaluations and
            return a new algorithm.

    Raises:
        ArgumentValueError: A name is unknown, or there is none.
        ArgumentTypeError: The argument is something else.
    """
    if not isinstance(algorithms, Mapping):
        names = collection("algorithms", algorithms, "names or a mapping")
        algorithms = {known_name("algorithms", name, SEARCHES): name for name in names}
    if not algorithms:
        raise invalid("algorithms", f"one or more, such as {', '.join(DEFAULT_ALGORITHMS)}", [])
    return {str(name): _search(name, algorithm) for name, algorithm in algorithms.items()}


def _search(name: Any, algorithm: Any) -> Search:
    """Return the search of one entry of a mapping of algorithms."""
    if isinstance(algorithm, type):
        rule = "a name, an algorithm or a function"
        remedy = f"give lambda n: {algorithm.__name__}(...)"
        raise wrong_type(f"algorithms[{name!r}]", rule, algorithm, remedy)
    if isinstance(algorithm, Algorithm):
        return partial(_run_algorithm, lambda _: algorithm)
    if callable(algorithm):
        return partial(_run_algorithm, algorithm)
    return SEARCHES[known_name("algorithms", algorithm, SEARCHES)]


# The searches. They are functions of the module, so that they can be sent to processes.


def _investigate(sampling: UniformSampling | None, problem: Any, n: int, seed: int) -> None:
    """Investigate the parameter space with the points of a sampling."""
    investigate(problem, n, sampling=sampling, seed=seed)


def _nsga3(problem: Any, n: int, seed: int) -> None:
    nsga3(problem, n_evaluations=n, seed=seed)


def _psi_then_nsga3(sampling: UniformSampling | None, problem: Any, n: int, seed: int) -> None:
    """Spend half the budget on PSI with the points of a sampling, the rest on NSGA-III."""
    n_psi = n // 2
    n_nsga3 = n - n_psi
    tested = minimize(problem, PSI(n_psi, sampling=sampling), seed=seed).pop
    size = population_size(problem.n_obj, n_nsga3)
    # NSGA-III's own selection among the tests: feasible designs first, the best, well spread.
    survival = ReferenceDirectionSurvival(reference_directions(problem.n_obj, size))
    random = np.random.default_rng(seed)
    n_start = min(size, len(tested))
    start = survival.do(problem, tested, n_survive=n_start, random_state=random)
    nsga3(problem, n_evaluations=n_nsga3, seed=seed, sampling=start)


def _propose(sampling: UniformSampling | None, problem: Any, n: int, seed: int) -> None:
    """Test the points of a sampling, then designs that surrogates propose."""
    from pymoo_psi.algorithms import SurrogatePSI  # brings half of SciPy, a second

    minimize(problem, SurrogatePSI(n, sampling=sampling), seed=seed)


def _nsga2(problem: Any, n: int, seed: int) -> None:
    size = population_size(problem.n_obj, n)
    _run_algorithm(lambda _: NSGA2(pop_size=size, **operators(problem)), problem, n, seed)


def _run_algorithm(make: Callable[[int], Any], problem: Any, n: int, seed: int) -> None:
    """Run the algorithm that a function returns for a budget."""
    # A copy even if it was made for this run: all instances of SPEA2 share one survival, which
    # would carry the ideal point of one run into the next.
    algorithm = copy.deepcopy(make(n))
    algorithm.seed = seed
    # The budget ends the run, not the default criteria of NSGA-II and others, which ended long
    # runs before half of their evaluations.
    if algorithm.termination is None or isinstance(algorithm.termination, DefaultTermination):
        algorithm.termination = NoTermination()
    run_within_budget(algorithm, problem, n)


_SCRAMBLED = QMCSampling("sobol")
SEARCHES: dict[str, Search] = {
    "psi": partial(_investigate, None),
    "psi-scrambled": partial(_investigate, _SCRAMBLED),
    "nsga3": _nsga3,
    "nsga2": _nsga2,
    "surrogate": partial(_propose, None),
    "surrogate-scrambled": partial(_propose, _SCRAMBLED),
    "psi+nsga3": partial(_psi_then_nsga3, None),
    "psi-scrambled+nsga3": partial(_psi_then_nsga3, _SCRAMBLED),
}
