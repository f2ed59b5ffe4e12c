"""Evaluating in this process, with an eye on what it costs."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter
from typing import Any

from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel._chunks import Cost
from pymoo_psi.parallel._outcome import Function, Values, one_line

_GLANCE = 1e-3  # seconds between two looks at the cost


def evaluate_while(
    f: Function,
    designs: list[Any],
    cost: Cost,
    enough: Callable[[int], bool],
    clock: Callable[[], float] = perf_counter,
) -> list[Values]:
    """Evaluate designs one after the other, measuring their cost, until there is enough.

    Args:
        f: What to evaluate.
        designs: The designs.
        cost: Takes a measurement for every design, or for every millisecond of cheap ones.
        enough: Given the number of designs left, says whether to stop; asked before the first
            design and after every measurement.
        clock: Seconds from anywhere.

    Returns:
        The values of the first designs, at most of all.
    """
    results: list[Values] = []
    n = len(designs)
    while len(results) < n and not enough(n - len(results)):
        known = cost.seconds
        size = 1 if math.isnan(known) else max(1, int(_GLANCE / known))
        block = designs[len(results) : len(results) + size]
        began = clock()
        try:
            for design in block:
                results.append(f(design))
        except EvaluationError:
            raise
        except Exception as error:
            culprit = designs[len(results)]
            raise EvaluationError(culprit, one_line(error), error) from error
        cost.add(len(block), clock() - began)
    return results
