"""Sixty variables: all at once, or the most influential ones in turn, at equal evaluations.

    python -m benchmarks.many_variables

A stepped cantilever: sixty heights, light and stiff under a limit of stress. PSI tests all sixty
at once; then, with as many evaluations, a quarter of the points on all sixty, whose sensitivities
order the variables, and the rest in rounds: eight variables free in their whole ranges, the others
fixed at the best design so far.
"""

from __future__ import annotations

import numpy as np
from pymoo.core.problem import Problem

from benchmarks.machine import describe_machine
from pymoo_psi import Restricted, TestTable, investigate, nsga3
from pymoo_psi.pareto import UtopianFrame, hypervolume
from pymoo_psi.table import sensitivities

VARIABLES, TOGETHER = 60, 8
BUDGETS = (1024, 4096)


class Cantilever(Problem):
    """Heights of 60 segments, from the wall to the tip, 4 m long and 80 mm wide; load 5 kN."""

    names = {f"x{j + 1}": f"h{j + 1}" for j in range(VARIABLES)} | {
        "f1": "mass", "f2": "deflection", "g1": "stress",
    }  # fmt: skip
    units = {"mass": "kg", "deflection": "mm"} | {f"h{j + 1}": "mm" for j in range(VARIABLES)}

    def __init__(self) -> None:
        super().__init__(n_var=VARIABLES, n_obj=2, n_ieq_constr=1, xl=60.0, xu=300.0)

    def _evaluate(self, x, out, *args, **kwargs):
        length, width, force, modulus, strength = 4000.0, 80.0, 5000.0, 210e3, 160.0
        part = length / VARIABLES
        near = part * np.arange(VARIABLES)  # the wall's end of a segment, and its arms to the tip
        arm, tip = length - near, length - near - part
        mass = 7.85e-6 * width * part * x.sum(axis=1)
        # Castigliano: F/E ∫ s² / I ds, with I = b h³ / 12
        bending = force / modulus * (arm**3 - tip**3) / 3 / (width * x**3 / 12)
        stress = (force * arm / (width * x**2 / 6)).max(axis=1)
        out["F"] = np.column_stack([mass, bending.sum(axis=1)])
        out["G"] = stress[:, None] / strength - 1


def in_turn(problem: Problem, budget: int) -> TestTable:
    """Spend a quarter of a budget on all variables, the rest on eight at a time, in turn."""
    table = investigate(problem, budget // 4)
    # Of a variable, the largest share that it explains of any criterion or constraint.
    found = sensitivities(table, n_resamples=2)["first_order"]
    order = found.groupby(level="variable").max().sort_values(ascending=False).index
    rounds = -(-VARIABLES // TOGETHER)
    points = (budget - len(table)) // rounds
    for k in range(rounds):
        free = order[k * TOGETHER : (k + 1) * TOGETHER]
        best = np.flatnonzero(table.pareto())[table.ranking().salukvadze[0]]
        values = dict(zip(table.layout.variables, table.X[best].tolist(), strict=True))
        part = Restricted(problem, {n: x for n, x in values.items() if n not in free})
        tests = investigate(part, points)
        table = TestTable.combined({"before": table, f"round {k + 1}": tests})
    return table


def main() -> None:
    """Print the quality of both, and of NSGA-III, against the U and N of all that was found."""
    print(describe_machine())
    problem = Cantilever()
    for budget in BUDGETS:
        at_once, turns = investigate(problem, budget), in_turn(problem, budget)
        fronts = {
            "all at once": at_once.F[at_once.pareto()],
            "eight in turn": turns.F[turns.pareto()],
            "nsga3": nsga3(problem, n_evaluations=budget, seed=1).F,
        }
        every = np.vstack(list(fronts.values()))
        frame = UtopianFrame(every.min(axis=0), every.max(axis=0), True)
        for name, F in fronts.items():
            mu1 = frame.distances(F)[:, 0].min()
            volume = hypervolume(frame.scaled(F), 1.1)
            print(f"{budget} evaluations, {name}: mu1 {mu1:.3f}, hypervolume {volume:.3f}")


if __name__ == "__main__":
    main()
