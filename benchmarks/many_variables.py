"""Sixty variables: all at once, or the most influential ones in turn, at equal evaluations.

    python -m benchmarks.many_variables

A stepped cantilever with sixty heights is to be light and stiff under a limit on the stress. PSI
tests all sixty variables at once. Then, with as many evaluations, it tests a quarter of the points
on all sixty; their sensitivities order the variables. The other points are tested in rounds: eight
variables are free in their whole range, the others are fixed at the best design so far.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pymoo.core.problem import Problem

from benchmarks.machine import describe_machine, sized
from pymoo_psi import Restricted, TestTable, investigate, nsga3, read_table
from pymoo_psi.analysis import sensitivities
from pymoo_psi.pareto import UtopianFrame, hypervolume

VARIABLES = 60
TOGETHER = 8
BUDGETS = sized((1024, 4096), (256,))


class Cantilever(Problem):
    """Heights of 60 segments, from the wall to the tip, 4 m long and 80 mm wide; load 5 kN."""

    def __init__(self) -> None:
        super().__init__(n_var=VARIABLES, n_obj=2, n_ieq_constr=1, xl=60.0, xu=300.0)
        self.names = {"f1": "mass", "f2": "deflection", "g1": "stress"}
        self.units = {"mass": "kg", "deflection": "mm"}
        for j in range(1, VARIABLES + 1):
            self.names[f"x{j}"] = f"h{j}"
            self.units[f"h{j}"] = "mm"

    def _evaluate(self, x, out, *args, **kwargs):
        length = 4000.0
        width = 80.0
        force = 5000.0
        modulus = 210e3
        strength = 160.0
        part = length / VARIABLES
        near = part * np.arange(VARIABLES)  # the end of each segment towards the wall
        arm = length - near  # from both ends of a segment to the tip
        tip = length - near - part
        mass = 7.85e-6 * width * part * x.sum(axis=1)
        # Castigliano: F/E ∫ s² / I ds, with I = b h³ / 12
        bending = force / modulus * (arm**3 - tip**3) / 3 / (width * x**3 / 12)
        stress = (force * arm / (width * x**2 / 6)).max(axis=1)
        out["F"] = np.column_stack([mass, bending.sum(axis=1)])
        out["G"] = stress[:, None] / strength - 1


def in_turn(problem: Problem, budget: int) -> TestTable:
    """Spend a quarter of a budget on all variables, the rest on eight at a time, in turn."""
    with TemporaryDirectory() as folder:
        return _in_turn(problem, budget, Path(folder, "tests.db"))


def _in_turn(problem: Problem, budget: int, study: Path) -> TestTable:
    table = investigate(problem, budget // 4, study=study)
    # For each variable, the largest share that it explains of any objective or constraint.
    indices = sensitivities(table)["first_order"]
    order = indices.groupby(level="variable").max().sort_values(ascending=False).index
    rounds = -(-VARIABLES // TOGETHER)
    points = (budget - len(table)) // rounds
    for k in range(rounds):
        free = order[k * TOGETHER : (k + 1) * TOGETHER]
        best = np.flatnonzero(table.pareto())[table.ranking().salukvadze[0]]
        fixed = dict(zip(table.schema.variables, table.X[best].tolist(), strict=True))
        for name in free:
            del fixed[name]
        investigate(Restricted(problem, fixed), points, study=study)
        table = read_table(study)  # of all runs
    return table


def main() -> None:
    """Print the quality of both, and of NSGA-III, with U and N of the three fronts together."""
    print(describe_machine())
    problem = Cantilever()
    for budget in BUDGETS:
        at_once = investigate(problem, budget)
        turns = in_turn(problem, budget)
        fronts = {
            "all at once": at_once.F[at_once.pareto()],
            "eight in turn": turns.F[turns.pareto()],
            "nsga3": nsga3(problem, n_evaluations=budget, seed=1).F,
        }
        union = np.vstack(list(fronts.values()))
        frame = UtopianFrame(union.min(axis=0), union.max(axis=0), normalize=True)
        for name, F in fronts.items():
            mu1 = frame.distances(F).min()
            volume, _ = hypervolume(frame.scaled(F), 1.1)
            print(f"{budget} evaluations, {name}: mu1 {mu1:.3f}, hypervolume {volume:.3f}")


if __name__ == "__main__":
    main()
