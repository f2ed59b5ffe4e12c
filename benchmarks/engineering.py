"""Problems of engineering for the benchmarks: two of ten variables, and a gear train of integers.

The first two are old test cases of weight minimisation with a single objective. The deflection,
which had a limit there, is the second objective here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Integer

Array = NDArray[np.float64]


class TenBarTruss(Problem):
    """The ten-bar cantilever truss (Haug and Arora, Applied Optimal Design, 1979), in inches, kips.

    Variables: cross sections, 0.1 to 35. Objectives: weight in lb and the largest displacement of a
    node. Constraints: the stress of each member, at most 25 ksi.
    """

    NODES = np.array([(720, 360), (720, 0), (360, 360), (360, 0), (0, 360), (0, 0)], dtype=float)
    MEMBERS = np.array(
        [(4, 2), (2, 0), (5, 3), (3, 1), (2, 3), (0, 1), (4, 3), (5, 2), (2, 1), (3, 0)]
    )
    MODULUS = 1e4
    DENSITY = 0.1
    LOAD = 100.0
    STRESS = 25.0

    def __init__(self) -> None:
        super().__init__(n_var=10, n_obj=2, n_ieq_constr=10, xl=0.1, xu=35.0)
        ends = self.NODES[self.MEMBERS]
        along = ends[:, 1] - ends[:, 0]
        self.lengths = np.linalg.norm(along, axis=1)
        elongation = np.zeros((10, 12))
        for member, (a, b) in enumerate(self.MEMBERS):
            unit = along[member] / self.lengths[member]
            elongation[member, 2 * a : 2 * a + 2] = -unit
            elongation[member, 2 * b : 2 * b + 2] = unit
        # (10, 8): elongation of each member by displacements of the four free nodes
        self.elongation = elongation[:, :8]

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        stiffness = self.MODULUS * X / self.lengths
        B = self.elongation
        K = np.einsum("mi,nm,mj->nij", B, stiffness, B)
        load = np.zeros(8)
        load[[3, 7]] = -self.LOAD
        loads = np.broadcast_to(load[:, None], (len(X), 8, 1))
        displacement = np.linalg.solve(K, loads)[..., 0]
        stress = self.MODULUS * (displacement @ B.T) / self.lengths
        weight = self.DENSITY * X @ self.lengths
        out["F"] = np.column_stack([weight, np.abs(displacement).max(axis=1)])
        out["G"] = np.abs(stress) / self.STRESS - 1


class SteppedCantilever(Problem):
    """The cantilever of five rectangular steps (Thanedar and Vanderplaats 1995), in cm and N.

    Variables: five widths, 1 to 5, and five heights, 30 to 65, beginning at the wall. Objectives:
    volume and deflection of the tip. Constraints: the bending stress in each step, at most 14 000,
    and heights of at most twenty widths.
    """

    STEP = 100.0
    LOAD = 50_000.0
    MODULUS = 2e7
    STRESS = 14_000.0

    def __init__(self) -> None:
        lower = np.repeat([1.0, 30.0], 5)
        upper = np.repeat([5.0, 65.0], 5)
        super().__init__(n_var=10, n_obj=2, n_ieq_constr=10, xl=lower, xu=upper)

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        width = X[:, :5]
        height = X[:, 5:]
        arms = self.STEP * np.arange(5, 0, -1)  # from the tip to the wall's end of each step
        stress = 6 * self.LOAD * arms / (width * height**2)
        # Castigliano: the derivative by the load of the integral of M^2 / (E I) over a step
        cubes = (arms**3 - (arms - self.STEP) ** 3) / 3
        stiffness = self.MODULUS * width * height**3 / 12
        deflection = (self.LOAD * cubes / stiffness).sum(axis=1)
        volume = self.STEP * (width * height).sum(axis=1)
        out["F"] = np.column_stack([volume, deflection])
        out["G"] = np.hstack([stress / self.STRESS - 1, height / (20 * width) - 1])


class GearTrain(ElementwiseProblem):
    """The gear train of four wheels (Kannan and Kramer 1994; Deb and Srinivasan 2006).

    Variables: numbers of teeth, 12 to 60. Objectives: the error of the ratio 1/6.931, and the
    largest number of teeth. Constraint: an error of at most a half of the ratio.
    """

    def __init__(self) -> None:
        variables = {name: Integer(bounds=(12, 60)) for name in ("a", "b", "c", "d")}
        super().__init__(vars=variables, n_obj=2, n_ieq_constr=1)

    def _evaluate(self, x: dict[str, Any], out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        error = abs(6.931 - x["c"] * x["d"] / (x["a"] * x["b"]))
        out["F"] = [error, max(x.values())]
        out["G"] = [error / 6.931 - 0.5]
