"""Two problems of structural engineering with ten variables each, for the benchmarks.

Both are old test cases of weight minimisation with one criterion; the limit on the deflection is
the second criterion here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

Array = NDArray[np.float64]


class TenBarTruss(Problem):
    """The ten-bar cantilever truss (Haug and Arora, Applied Optimal Design, 1979), in inches, kips.

    Variables: cross sections, 0.1 to 35. Criteria: weight in lb and the largest displacement of a
    node. Constraints: the stress of each member, at most 25 ksi.
    """

    NODES = np.array([(720, 360), (720, 0), (360, 360), (360, 0), (0, 360), (0, 0)], dtype=float)
    MEMBERS = np.array(
        [(4, 2), (2, 0), (5, 3), (3, 1), (2, 3), (0, 1), (4, 3), (5, 2), (2, 1), (3, 0)]
    )
    MODULUS, DENSITY, LOAD, STRESS = 1e4, 0.1, 100.0, 25.0

    def __init__(self) -> None:
        super().__init__(n_var=10, n_obj=2, n_ieq_constr=10, xl=0.1, xu=35.0)
        ends = self.NODES[self.MEMBERS]
        along = ends[:, 1] - ends[:, 0]
        self.lengths = np.linalg.norm(along, axis=1)
        # (10, 8): elongation of a member for displacements of the four free nodes
        self.elongation = np.zeros((10, 12))
        for member, (a, b) in enumerate(self.MEMBERS):
            unit = along[member] / self.lengths[member]
            self.elongation[member, 2 * a : 2 * a + 2] = -unit
            self.elongation[member, 2 * b : 2 * b + 2] = unit
        self.elongation = self.elongation[:, :8]

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        stiffness = self.MODULUS * X / self.lengths
        B = self.elongation
        K = np.einsum("mi,nm,mj->nij", B, stiffness, B)
        load = np.zeros(8)
        load[[3, 7]] = -self.LOAD
        moved = np.linalg.solve(K, np.broadcast_to(load[:, None], (len(X), 8, 1)))[..., 0]
        stress = self.MODULUS * (moved @ B.T) / self.lengths
        out["F"] = np.column_stack([self.DENSITY * X @ self.lengths, np.abs(moved).max(axis=1)])
        out["G"] = np.abs(stress) / self.STRESS - 1


class SteppedCantilever(Problem):
    """The cantilever of five rectangular steps (Thanedar and Vanderplaats 1995), in cm and N.

    Variables: five widths, 1 to 5, and five heights, 30 to 65, from the wall on. Criteria: volume
    and deflection of the tip. Constraints: the bending stress in each step, at most 14 000, and
    heights of at most twenty widths.
    """

    STEP, LOAD, MODULUS, STRESS = 100.0, 50_000.0, 2e7, 14_000.0

    def __init__(self) -> None:
        lower, upper = np.repeat([1.0, 30.0], 5), np.repeat([5.0, 65.0], 5)
        super().__init__(n_var=10, n_obj=2, n_ieq_constr=10, xl=lower, xu=upper)

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        width, height = X[:, :5], X[:, 5:]
        arms = self.STEP * np.arange(5, 0, -1)  # from the tip to the wall's end of each step
        stress = 6 * self.LOAD * arms / (width * height**2)
        # Castigliano: the integral of M^2 / (E I) over a step, by the load
        cubes = (arms**3 - (arms - self.STEP) ** 3) / 3
        deflection = (self.LOAD * cubes / (self.MODULUS * width * height**3 / 12)).sum(axis=1)
        out["F"] = np.column_stack([self.STEP * (width * height).sum(axis=1), deflection])
        out["G"] = np.hstack([stress / self.STRESS - 1, height / (20 * width) - 1])
