"""The cost of the algorithms themselves: wall time outside the evaluations.

    python -m benchmarks.overhead

4096 evaluations of ``VectorizedSphereChute`` in one process; the problem counts and times them.
"""

from __future__ import annotations

import numpy as np
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, sized
from pymoo_psi import PSI, VectorizedSphereChute, investigate
from pymoo_psi.comparison._runs import SEARCHES, Search, Task, perform

BUDGET = sized(4096, 256)
ROUNDS = sized(7, 1)


ALGORITHMS = {
    "investigate": Search(lambda problem, n, seed: investigate(problem, n)),
    "minimize(PSI)": Search(lambda problem, n, seed: minimize(problem, PSI(n)).F),
    "nsga3": SEARCHES["nsga3"],
    "nsga2": SEARCHES["nsga2"],
}


def main() -> None:
    """Print the median times, and the ratios to those of both ways to run PSI.

    A ratio is the median of the ratios of the rounds; in a round, the machine has the same load for
    all algorithms.
    """
    print(describe_machine())
    problem = VectorizedSphereChute(0.4)
    table = minimize(problem, PSI(BUDGET)).algorithm.table
    assert investigate(problem, BUDGET).equals(table), "the two ways of PSI give different tables"
    outside = {name: np.zeros(ROUNDS) for name in ALGORITHMS}
    inside = {name: np.zeros(ROUNDS) for name in ALGORITHMS}
    for k in range(ROUNDS):
        for name in ALGORITHMS:
            run = perform(problem, ALGORITHMS, None, Task(name, BUDGET, seed=k))
            assert run.n_evaluated == BUDGET, name
            outside[name][k] = run.seconds - run.evaluation_seconds
            inside[name][k] = run.evaluation_seconds
    for name, seconds in outside.items():
        ms = seconds * 1e3
        print(
            f"{name:14} outside the evaluations {np.median(ms):7.1f} ms "
            f"({ms.min():.1f} to {ms.max():.1f}), "
            f"in them {np.median(inside[name]) * 1e3:6.1f} ms",
            end="; ",
        )
        for base in ("minimize(PSI)", "investigate"):
            print(f"{np.median(seconds / outside[base]):5.2f} times {base}", end=" ")
        print()


if __name__ == "__main__":
    main()
