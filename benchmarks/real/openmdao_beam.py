"""PSI in OpenMDAO: as the algorithm of its driver for pymoo, and on a model that may fail.

    pip install openmdao
    python -m benchmarks.real.openmdao_beam

The beam is a cantilever of 1 m with 5 kN at its end: mass against stiffness, stress limited.
"""

from __future__ import annotations

from typing import Any

import openmdao.api as om
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import PSI
from pymoo_psi.table import TestTable

FORMULAS = [
    "mass = 7.85e-3 * width * height",
    "stiffness = 52.5e-6 * width * height**3",
    "stress = 3e7 / (width * height**2)",
]


class PSIDriver(om.pymooDriver):  # type: ignore[misc]
    """OpenMDAO's driver for pymoo with PSI for an algorithm."""

    def get_algorithm(self, alg_name: str) -> Any:
        """Return PSI, whatever the option ``optimizer`` stands for."""
        return PSI


def model() -> om.Problem:
    """Return the beam, a component of three formulas."""
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("beam", om.ExecComp(FORMULAS, width=40, height=100), promotes=["*"])
    return problem


def by_the_driver(n_points: int = 64) -> TestTable:
    """Run PSI from OpenMDAO, by its driver."""
    problem = model()
    problem.model.add_design_var("width", lower=20, upper=60)
    problem.model.add_design_var("height", lower=40, upper=160)
    problem.model.add_objective("mass")
    problem.model.add_objective("stiffness", scaler=-1)
    problem.model.add_constraint("stress", upper=70)
    problem.driver = PSIDriver(optimizer="NSGA2", disp=False)
    problem.driver.alg_settings = {"n_points": n_points}
    problem.setup()
    problem.run_driver()
    return problem.driver.pymoo_results.algorithm.table


class Beam(ElementwiseProblem):  # type: ignore[misc]
    """The model as a problem of pymoo: with names, units, failures, on many processes."""

    def __init__(self, **kwargs: Any) -> None:
        self.names = {"x1": "width", "x2": "height", "f1": "mass", "f2": "stiffness"}
        self.units = {"width": "mm", "height": "mm", "mass": "kg", "stress": "MPa"}
        self.maximize = ["stiffness"]
        super().__init__(n_var=2, n_obj=2, xl=[20, 40], xu=[60, 160], **kwargs)

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        problem = model()
        problem.setup()
        problem["width"], problem["height"] = x
        if x[1] > 4 * x[0]:
            raise om.AnalysisError("no mesh: too slender")
        problem.run_model()
        out["F"] = [problem["mass"][0], -problem["stiffness"][0]]
        out["stress"] = problem["stress"][0]


def main() -> None:
    """Do both."""
    table = by_the_driver()
    print(table, table.best().to_frame(), sep="\n")
    table = minimize(Beam(), PSI(64)).algorithm.table
    print(table, table.under(limits={"stress": 70}).best().to_frame(), sep="\n")


if __name__ == "__main__":
    main()
