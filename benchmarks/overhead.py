"""What the algorithms themselves cost: wall time outside the evaluations.

    python -m benchmarks.overhead

4096 evaluations of ``VectorizedSphereChute``, counted and timed by the problem, in one process.
"""

from __future__ import annotations

from statistics import median

import numpy as np
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine
from pymoo_psi import PSI, VectorizedSphereChute, investigate
from pymoo_psi.comparison._algorithms import SEARCHES
from pymoo_psi.comparison._runs import Task, perform

BUDGET = 4096
ROUNDS = 7


def main() -> None:
    """Print the medians, and the ratios to both ways of PSI.

    A ratio is the median of those of the rounds, in which all have the same load of the machine.
    """
    print(describe_machine())
    problem = VectorizedSphereChute(0.4)
    one, other = investigate(problem, BUDGET), minimize(problem, PSI(BUDGET)).algorithm.table
    assert one.equals(other), "the two ways of PSI do not give the same table"
    algorithms = {
        "investigate": SEARCHES["psi"],
        "minimize(PSI)": lambda p, n, s: minimize(p, PSI(n)).F,
        "nsga3": SEARCHES["nsga3"],
        "nsga2": SEARCHES["nsga2"],
    }
    spent: dict[str, list[tuple[float, float]]] = {name: [] for name in algorithms}
    for seed in range(ROUNDS):
        for name, search in algorithms.items():
            run = perform(problem, search, Task(name, BUDGET, seed), None)
            assert run.n_evaluated == BUDGET, name
            spent[name].append((run.seconds - run.evaluation_seconds, run.evaluation_seconds))
    outside = {name: np.array(times)[:, 0] for name, times in spent.items()}
    for name, times in spent.items():
        ratios = ", ".join(
            f"{median(outside[name] / outside[base]):5.2f} times {base}"
            for base in ("minimize(PSI)", "investigate")
        )
        print(
            f"{name:14} outside the evaluations {median(outside[name]) * 1e3:7.1f} ms "
            f"({outside[name].min() * 1e3:.1f} to {outside[name].max() * 1e3:.1f}), "
            f"in them {median(np.array(times)[:, 1]) * 1e3:6.1f} ms; {ratios}"
        )


if __name__ == "__main__":
    main()
