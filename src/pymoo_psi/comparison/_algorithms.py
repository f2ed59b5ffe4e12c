"""The algorithms that are compared: each spends a budget on a problem.

``psi``
    Parameter Space Investigation with the LPτ points. Deterministic: one run.
``psi-scrambled``
    The same with SciPy's scrambled Sobol' points, whose seed shows the spread that the choice of
    points makes.
``nsga3``
    NSGA-III (:func:`pymoo_psi.nsga3`).
``psi+nsga3``
    Half the budget for PSI, the rest for NSGA-III, which starts from the best test points.
``psi-scrambled+nsga3``
    The same with scrambled points.
``surrogate``
    LPτ points, then designs that surrogates propose (:class:`pymoo_psi.SurrogatePSI`); for some
    hundred evaluations.
``surrogate-scrambled``
    The same with scrambled points.

The first LPτ points are the corner of the lower bounds and the middle of the box. Many test
problems have Pareto-optimal designs just there, which is luck and says nothing of a method; the
entries with scrambled points do not have it.

``nsga2``
    NSGA-II with the population size of :func:`pymoo_psi.nsga3`.
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
    """Return the searches of the algorithms asked for, by name.

    Args:
        algorithms: Names; or a mapping from names of the user's to such names, to pymoo
            algorithms, of which each run takes a copy, or to functions that take a number of
            evaluations and return a new one.

    Raises:
        ArgumentValueError: A name is unknown, or there is none.
        ArgumentTypeError: The argument is something else.
    """
    if not isinstance(algorithms, Mapping):
        names = collection("algorithms", algorithms, "names or a mapping")
        algorithms = {known_name("algorithms", name, SEARCHES): name for name in names}
    if not algorithms:
        raise invalid("algorithms", f"one or more, such as {', '.join(DEFAULT_ALGORITHMS)}", [])
    return {str(name): _search(name, what) for name, what in algorithms.items()}


def _search(name: Any, what: Any) -> Search:
    if isinstance(what, type):
        rule, remedy = "a name, an algorithm or a function", f"give lambda n: {what.__name__}(...)"
        raise wrong_type(f"algorithms[{name!r}]", rule, what, remedy)
    if isinstance(what, Algorithm):
        return partial(_made, lambda _: what)
    if callable(what):
        return partial(_made, what)
    return SEARCHES[known_name("algorithms", what, SEARCHES)]


# The searches. They are functions of the module, as processes are sent them.


def _investigate(sampling: UniformSampling | None, problem: Any, n: int, seed: int) -> None:
    """Investigate the parameter space with the points of a sampling."""
    investigate(problem, n, sampling=sampling, seed=seed)


def _nsga3(problem: Any, n: int, seed: int) -> None:
    nsga3(problem, n_evaluations=n, seed=seed)


def _psi_then_nsga3(sampling: UniformSampling | None, problem: Any, n: int, seed: int) -> None:
    """Spend half the budget on PSI with the points of a sampling, the rest on NSGA-III."""
    tested = minimize(problem, PSI(n // 2, sampling=sampling), seed=seed).pop
    left = n - n // 2
    size = population_size(problem.n_obj, left)
    survival = ReferenceDirectionSurvival(reference_directions(problem.n_obj, size))
    # NSGA-III's own choice among the tests: the feasible first, the best, well spread.
    size, random = min(size, len(tested)), np.random.default_rng(seed)
    start = survival.do(problem, tested, n_survive=size, random_state=random)
    nsga3(problem, n_evaluations=left, seed=seed, sampling=start)


def _learn(sampling: UniformSampling | None, problem: Any, n: int, seed: int) -> None:
    """Learn from tests that begin with the points of a sampling."""
    from pymoo_psi.algorithms import SurrogatePSI  # brings half of SciPy, a second

    minimize(problem, SurrogatePSI(n, sampling=sampling), seed=seed)


def _nsga2(problem: Any, n: int, seed: int) -> None:
    size = population_size(problem.n_obj, n)
    _made(lambda _: NSGA2(pop_size=size, **operators(problem)), problem, n, seed)


def _made(make: Callable[[int], Any], problem: Any, n: int, seed: int) -> None:
    """Search with the algorithm that a function makes for a budget."""
    # A copy also where it was made for this run: all instances of SPEA2 share one survival, which
    # would bring the ideal point of one run into the next.
    algorithm = copy.deepcopy(make(n))
    algorithm.seed = seed
    # The budget ends it, not the criteria that NSGA-II and others set for themselves: with these
    # a long run ended at less than half of its evaluations.
    if algorithm.termination is None or isinstance(algorithm.termination, DefaultTermination):
        algorithm.termination = NoTermination()
    run_within_budget(algorithm, problem, n)


_SCRAMBLED = QMCSampling("sobol")
SEARCHES: dict[str, Search] = {
    "psi": partial(_investigate, None),
    "psi-scrambled": partial(_investigate, _SCRAMBLED),
    "nsga3": _nsga3,
    "nsga2": _nsga2,
    "surrogate": partial(_learn, None),
    "surrogate-scrambled": partial(_learn, _SCRAMBLED),
    "psi+nsga3": partial(_psi_then_nsga3, None),
    "psi-scrambled+nsga3": partial(_psi_then_nsga3, _SCRAMBLED),
}
