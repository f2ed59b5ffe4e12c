"""Six problems of the suite RE (Tanabe and Ishibuchi, Applied Soft Computing 89, 2020).

No problem has constraints: where a practical design has some, the sum of their violations is the
last objective. Three require ``pip install cmo`` (GPL), which has them with constraints.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.core.problem import Problem

from benchmarks.comparison_problems import CMO
from benchmarks.questions import injector

Array = NDArray[np.float64]

# The areas in which reinforcement is sold, in square inches; 10 stands in the suite.
# fmt: off
AREAS = np.array((
    0.20, 0.31, 0.40, 0.44, 0.60, 0.62, 0.79, 0.80, 0.88, 0.93, 1.0, 1.20, 1.24, 1.32, 1.40, 1.55,
    1.58, 1.60, 1.76, 1.80, 1.86, 2.0, 2.17, 2.20, 2.37, 2.40, 2.48, 2.60, 2.64, 2.79, 2.80, 3.0,
    3.08, 3, 10, 3.16, 3.41, 3.52, 3.60, 3.72, 3.95, 3.96, 4.0, 4.03, 4.20, 4.34, 4.40, 4.65, 4.74,
    4.80, 4.84, 5.0, 5.28, 5.40, 5.53, 5.72, 6.0, 6.16, 6.32, 6.60, 7.11, 7.20, 7.80, 7.90, 8.0,
    8.40, 8.69, 9.0, 9.48, 10.27, 11.0, 11.06, 11.85, 12.0, 13.0, 14.0, 15.0,
))
# fmt: on


class OfFormula(Problem):
    """A problem whose objectives are a formula of designs."""

    def __init__(
        self, formula: Callable[[Array], Array], n_obj: int, xl: ArrayLike, xu: ArrayLike
    ) -> None:
        self.formula = formula
        super().__init__(n_var=len(np.asarray(xl)), n_obj=n_obj, xl=xl, xu=xu)

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        out["F"] = self.formula(X)


def truss(x: Array) -> Array:
    """Return volume and displacement of a truss of four bars."""
    a, b, c, d = x.T
    root = np.sqrt(2)
    volume = 200 * (2 * a + root * b + np.sqrt(c) + d)
    displacement = 0.01 * (2 / a + 2 * root / b - 2 * root / c + 2 / d)
    return np.column_stack([volume, displacement])


def concrete(x: Array) -> Array:
    """Return cost and violations of a beam of reinforced concrete."""
    nearest = np.abs(AREAS - x[:, :1]).argmin(axis=1)
    area = AREAS[nearest]
    width = x[:, 1]
    depth = x[:, 2]
    cost = 29.4 * area + 0.6 * width * depth
    moment = area * depth - 7.735 * area**2 / width - 180
    violation = np.maximum(-moment, 0) + np.maximum(depth / width - 4, 0)
    return np.column_stack([cost, violation])


class Violated(Problem):
    """A problem of which the violation of all constraints is one more objective."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        super().__init__(n_var=problem.n_var, n_obj=problem.n_obj + 1, xl=problem.xl, xu=problem.xu)

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        values = self.problem.evaluate(X, return_as_dictionary=True)
        violation = np.maximum(values["G"], 0).sum(axis=1)
        out["F"] = np.column_stack([values["F"], violation])


RE: dict[str, Callable[[], Problem]] = {
    "re21": lambda: OfFormula(truss, 2, [1, np.sqrt(2), np.sqrt(2), 1], [3] * 4),
    "re22": lambda: OfFormula(concrete, 2, [0.2, 0, 0], [15, 20, 40]),
    "re32": lambda: Violated(CMO["cre22"]()),
    "re37": lambda: OfFormula(injector, 3, [0] * 4, [1] * 4),
    "re42": lambda: Violated(CMO["cre32"]()),
    "re61": lambda: Violated(CMO["cre51"]()),
}
N_VAR = {"re21": 4, "re22": 3, "re32": 4, "re37": 4, "re42": 6, "re61": 3}
