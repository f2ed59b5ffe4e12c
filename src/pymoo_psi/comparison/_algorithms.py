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

Further algorithms of pymoo go by their short names, such as ``nsga2``, with a population that grows
with the budget as that of :func:`pymoo_psi.nsga3` does.
"""

from __future__ import annotations

import copy
import inspect
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
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

# By short name the module and the class, which are imported when they are asked for.
_PYMOO = {
    "moead": "moead:MOEAD",
    "nsga2": "nsga2:NSGA2",
    "sms": "sms:SMSEMOA",
    "spea2": "spea2:SPEA2",
    "unsga3": "unsga3:UNSGA3",
}


@dataclass(frozen=True)
class NamedAlgorithm:
    """An algorithm as it takes part in a comparison.

    Attributes:
        name: What tables call it.
        search: Takes a problem, a number of evaluations and a seed, and evaluates designs.
        seeded: Whether the seed makes a difference.
        learns: Whether it fits surrogates, whose time grows with the square of the budget.
    """

    name: str
    search: Callable[[Any, int, int], object]
    seeded: bool = True
    learns: bool = False


def named_algorithms(algorithms: Collection[str] | Mapping[str, Any]) -> tuple[NamedAlgorithm, ...]:
    """Return the algorithms asked for.

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
        algorithms = {known_name("algorithms", name, {*_OURS, *_PYMOO}): name for name in names}
    if not algorithms:
        raise invalid("algorithms", f"one or more, such as {', '.join(DEFAULT_ALGORITHMS)}", [])
    return tuple(_named(str(name), what) for name, what in algorithms.items())


def _named(name: str, what: Any) -> NamedAlgorithm:
    if isinstance(what, type):
        rule, remedy = "a name, an algorithm or a function", f"give lambda n: {what.__name__}(...)"
        raise wrong_type(f"algorithms[{name!r}]", rule, what, remedy)
    if isinstance(what, Algorithm):
        return NamedAlgorithm(name, partial(_made, lambda _: what))
    if callable(what):
        return NamedAlgorithm(name, partial(_made, what))
    if known_name("algorithms", what, {*_OURS, *_PYMOO}) in _PYMOO:
        return NamedAlgorithm(name, partial(_from_pymoo, _PYMOO[what]))
    # Without a sampling that is scrambled, and without NSGA-III, no seed is asked.
    return NamedAlgorithm(name, _OURS[what], what != "psi", what.startswith("surrogate"))


# The searches. They are functions of the module, as processes are sent them.


def _investigate(sampling: UniformSampling | None, problem: Any, n: int, seed: int) -> None:
    """Investigate the parameter space with the points of a sampling."""
    investigate(problem, n, sampling=sampling, seed=seed)


def _nsga3(problem: Any, n: int, seed: int) -> None:
    nsga3(problem, n_evaluations=n, seed=seed)


def _investigate_then_nsga3(
    sampling: UniformSampling | None, problem: Any, n: int, seed: int
) -> None:
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


_SCRAMBLED = QMCSampling("sobol")
_OURS: dict[str, Callable[[Any, int, int], object]] = {
    "psi": partial(_investigate, None),
    "psi-scrambled": partial(_investigate, _SCRAMBLED),
    "nsga3": _nsga3,
    "surrogate": partial(_learn, None),
    "surrogate-scrambled": partial(_learn, _SCRAMBLED),
    "psi+nsga3": partial(_investigate_then_nsga3, None),
    "psi-scrambled+nsga3": partial(_investigate_then_nsga3, _SCRAMBLED),
}


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


def _from_pymoo(place: str, problem: Any, n: int, seed: int) -> None:
    """Search with pymoo's ``module:class``, with a population that suits the budget."""
    module, _, name = place.partition(":")
    cls = getattr(import_module(f"pymoo.algorithms.moo.{module}"), name)
    size = population_size(problem.n_obj, n)
    arguments = inspect.signature(cls).parameters
    # MOEA/D asks for directions only, NSGA-II for a size only, U-NSGA-III for both.
    options = {"ref_dirs": reference_directions(problem.n_obj, size), "pop_size": size}
    options = {name: value for name, value in options.items() if name in arguments}
    _made(lambda _: cls(**options, **operators(problem)), problem, n, seed)
