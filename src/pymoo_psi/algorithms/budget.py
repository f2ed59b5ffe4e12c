"""Running any pymoo algorithm for an exact number of evaluations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pymoo.core.population import Population

__all__ = ["population_size", "run_within_budget"]


def population_size(n_obj: int, n_evaluations: int) -> int:
    """Return about 1.5 sqrt(n_evaluations), at least one design per objective.

    A larger budget so buys both more designs and more generations.
    """
    return max(n_obj, math.ceil(1.5 * math.sqrt(n_evaluations)))


def run_within_budget(algorithm: Any, problem: Any, n_evaluations: int, **shown: Any) -> Any:
    """Run an algorithm until a number of designs is evaluated, or until it ends by itself.

    A termination is asked only after a generation, so the budget is kept here: the last
    generation is cut to what is left. Designs of the first one that are evaluated already cost
    nothing and stay.

    Args:
        algorithm: A pymoo algorithm that is not set up yet.
        problem: A pymoo problem.
        n_evaluations: The budget, 1 or more.
        **shown: ``verbose`` or ``progress``, as for ``minimize``.

    Returns:
        The pymoo ``Result``.
    """
    algorithm.setup(problem, **shown)
    while algorithm.has_next():
        left = n_evaluations - algorithm.evaluator.n_eval
        infills = algorithm.infill()
        if infills is None or left == 0:
            break
        if isinstance(infills, Population):
            infills = _affordable(infills, left)
        algorithm.evaluator.eval(problem, infills, algorithm=algorithm)
        if algorithm.evaluator.n_eval == n_evaluations:
            algorithm.termination.terminate()
        algorithm.advance(infills=infills)
    result = algorithm.result()
    result.algorithm = algorithm
    return result


def _affordable(infills: Population, left: int) -> Population:
    """Return the designs that are evaluated and the first ``left`` of those that are not."""
    new = np.array([not individual.evaluated for individual in infills])
    return infills[~new | (np.cumsum(new) <= left)]
