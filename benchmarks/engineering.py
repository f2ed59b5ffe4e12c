"""Problems of engineering for the benchmarks: two of ten variables, and three with integers.

The first two are old test cases of weight minimisation with a single objective. The deflection,
which had a limit there, is the second objective here. The others have integers or choices.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Choice, Integer, Real

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


class PressureVessel(ElementwiseProblem):
    """A pressure vessel (Kannan and Kramer 1994), in inches.

    Variables: thickness of shell and head in sixteenths of an inch, which are integers; radius and
    length. Objectives: cost, and the volume that is missing to 1 728 000. Constraints: thickness by
    the radius, and the length.
    """

    def __init__(self) -> None:
        variables = {
            "shell": Integer(bounds=(1, 99)),
            "head": Integer(bounds=(1, 99)),
            "radius": Real(bounds=(10.0, 200.0)),
            "length": Real(bounds=(10.0, 240.0)),
        }
        super().__init__(vars=variables, n_obj=2, n_ieq_constr=2)

    def _evaluate(self, x: dict[str, Any], out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        shell = 0.0625 * x["shell"]
        head = 0.0625 * x["head"]
        r = x["radius"]
        length = x["length"]
        cost = 0.6224 * shell * r * length + 1.7781 * head * r**2
        cost += 3.1661 * shell**2 * length + 19.84 * shell**2 * r
        volume = np.pi * r**2 * length + 4 / 3 * np.pi * r**3
        out["F"] = [cost, abs(1_728_000 - volume)]
        out["G"] = [0.0193 * r - shell, 0.00954 * r - head]


class WeldedBeamOfMaterials(ElementwiseProblem):
    """The welded beam of four materials (Deb and Goyal 1996), in inches and psi.

    Variables: weld thickness and length, height and width of the beam, and the material.
    Objectives: cost and deflection of the tip. Constraints: shear, bending stress, buckling, and
    the weld is not thicker than the beam.
    """

    # modulus, shear modulus, allowed stress, cost of weld and of bar
    MATERIALS: ClassVar = {
        "steel": (30e6, 12e6, 30e3, 0.1047, 0.0481),
        "cast iron": (14e6, 6e6, 8e3, 0.0489, 0.0224),
        "aluminium": (10e6, 4e6, 5e3, 0.5235, 0.2405),
        "brass": (16e6, 6e6, 8e3, 0.5584, 0.2566),
    }
    LOAD = 6000.0
    ARM = 14.0

    def __init__(self) -> None:
        variables = {
            "h": Real(bounds=(0.0625, 2.0)),
            "l": Real(bounds=(0.1, 10.0)),
            "t": Real(bounds=(2.0, 20.0)),
            "b": Real(bounds=(0.0625, 2.0)),
            "material": Choice(options=[*self.MATERIALS]),
        }
        super().__init__(vars=variables, n_obj=2, n_ieq_constr=4)

    def _evaluate(self, x: dict[str, Any], out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        modulus, shear_modulus, allowed, weld_cost, bar_cost = self.MATERIALS[x["material"]]
        h, length, t, b = x["h"], x["l"], x["t"], x["b"]
        cost = (1 + weld_cost) * h**2 * length + bar_cost * t * b * (self.ARM + length)
        deflection = 4 * self.LOAD * self.ARM**3 / (modulus * t**3 * b)
        radius = np.hypot(length / 2, (h + t) / 2)
        inertia = 2 * np.sqrt(2) * h * length * (length**2 / 12 + (h + t) ** 2 / 4)
        direct = self.LOAD / (np.sqrt(2) * h * length)
        torsion = self.LOAD * (self.ARM + length / 2) * radius / inertia
        shear = np.sqrt(direct**2 + torsion**2 + direct * torsion * length / radius)
        bending = 6 * self.LOAD * self.ARM / (b * t**2)
        slenderness = 1 - t / (2 * self.ARM) * np.sqrt(modulus / (4 * shear_modulus))
        buckling = 4.013 * np.sqrt(modulus * shear_modulus * t**2 * b**6 / 36)
        buckling = buckling / self.ARM**2 * slenderness
        out["F"] = [cost, deflection]
        out["G"] = [
            shear / (0.577 * allowed) - 1,
            bending / allowed - 1,
            1 - buckling / self.LOAD,
            h / b - 1,
        ]


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
