"""Whether proposals of repeats help a choice under noise: SurrogatePSI with and without them.

Usage:
    python -m benchmarks.repeats [--seeds 20] [--tests 100] [--problems zdt1,inventory]

Four noisy problems: three with normal noise of 5 % of the range of each objective over the true
Pareto set, and a simulated inventory, whose noise depends on the design. The choice is the proposed
design of the means; its regret is how much farther it truly is from the ideal point than the best
design, in percent of the ranges.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from benchmarks.machine import sized
from pymoo_psi import SurrogatePSI, lp_tau, nsga3, rank_of_efficiency
from pymoo_psi.algorithms._proposals import with_repeats

PROPOSALS = {"repeats": with_repeats, "new designs only": lambda points, *_: points}
NOISE = 0.05
N_REFERENCE = sized(2048, 128)


class Noisy(ElementwiseProblem):
    """A noisy problem whose true values are known.

    Args:
        inner: The problem without noise.
        seed: Of the noise of this run.
    """

    noisy = True

    def __init__(self, inner: Any, lengths: np.ndarray, seed: int) -> None:
        super().__init__(
            n_var=inner.n_var,
            n_obj=inner.n_obj,
            n_ieq_constr=inner.n_ieq_constr,
            xl=inner.xl,
            xu=inner.xu,
        )
        self.inner = inner
        self.deviations = NOISE * lengths
        self.run = seed

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, seed: int, **kwargs: Any) -> None:
        values = self.inner.evaluate(x, return_as_dictionary=True)
        generator = np.random.default_rng([seed, self.run])
        out["F"] = values["F"] + self.deviations * generator.standard_normal(self.n_obj)
        if self.n_ieq_constr:
            out["G"] = values["G"]


class Inventory(ElementwiseProblem):
    """Stock that is ordered up to a level when it is low: cost and unmet demand of 60 days.

    Args:
        seed: Of the demand of this run.
    """

    noisy = True

    def __init__(self, seed: int) -> None:
        super().__init__(n_var=2, n_obj=2, xl=[0.0, 1.0], xu=[60.0, 100.0])
        self.run = seed

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, seed: int, **kwargs: Any) -> None:
        generator = np.random.default_rng([seed, self.run])
        out["F"] = simulated(x[None], generator)[0]


def simulated(designs: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return ``(n, 2)`` cost and unmet demand of a day, delivered after two days."""
    low, quantity = designs.T
    stock = low + quantity
    arriving = np.zeros((2, len(stock)))
    cost = np.zeros(len(stock))
    unmet = np.zeros(len(stock))
    for _ in range(60):
        stock = stock + arriving[0]
        demand = generator.gamma(2.0, 5.0, len(stock))
        unmet += np.maximum(demand - stock, 0)
        stock = np.maximum(stock - demand, 0)
        is_low = stock + arriving[1] < low
        order = np.where(is_low, quantity, 0.0)
        cost += 0.1 * stock + 5.0 * is_low
        arriving = np.array([arriving[1], order])
    return np.column_stack([cost, unmet]) / 60


def truth_of(name: str, designs: np.ndarray) -> np.ndarray:
    """Return the true objectives of designs."""
    if name == "inventory":
        generator = np.random.default_rng(1)
        return np.array([simulated(np.tile(x, (2000, 1)), generator).mean(axis=0) for x in designs])
    return inner_of(name).evaluate(designs, return_values_of=["F"])


def inner_of(name: str) -> Any:
    """Return a problem without noise."""
    if name == "zdt1":
        return get_problem(name, n_var=4)
    return get_problem(name)


def reference_of(name: str) -> Any:
    """Return the ranking of the true Pareto set."""
    if name == "inventory":
        points = lp_tau(N_REFERENCE, 2)
        return rank_of_efficiency(truth_of(name, [0.0, 1.0] + points * [60.0, 99.0]))
    return rank_of_efficiency(nsga3(inner_of(name), n_evaluations=20_000, seed=1).F)


def choices(names: list[str], n_seeds: int, n_tests: int) -> Iterator[dict[str, Any]]:
    """Yield the regret of each run, with repeats and without."""
    for name in names:
        reference = reference_of(name)
        best = reference.criteria[reference.pareto, 0].min()
        for seed in range(n_seeds):
            if name == "inventory":
                problem: Any = Inventory(seed)
            else:
                problem = Noisy(inner_of(name), reference.nadir - reference.ideal, seed)
            for proposals, function in PROPOSALS.items():
                with patch("pymoo_psi.algorithms._surrogate.with_repeats", function):
                    run = minimize(problem, SurrogatePSI(n_tests, seed=seed))
                table = run.algorithm.table
                if len(np.unique(table.X, axis=0)) < len(table):
                    table = table.averaged()
                chosen = truth_of(name, table.best().X)
                distance = reference.frame.distances(chosen)[0, 0]
                yield {
                    "problem": name,
                    "proposals": proposals,
                    "seed": seed,
                    "designs": len(table),
                    "regret": 100 * (distance - best),
                }


def main() -> None:
    """Print the regrets of choices."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=sized(20, 1))
    parser.add_argument("--tests", type=int, default=sized(100, 40))
    parser.add_argument("--problems", default=sized("zdt1,kursawe,carside,inventory", "inventory"))
    options = parser.parse_args()
    names = options.problems.split(",")
    runs = pd.DataFrame(choices(names, options.seeds, options.tests))
    print(runs.groupby(["problem", "proposals"])[["designs", "regret"]].agg(["median", "mean"]))
    pairs = runs.pivot(index=["problem", "seed"], columns="proposals", values="regret")
    better = pairs["repeats"] < pairs["new designs only"]
    print("better with repeats:", better.groupby("problem").sum().to_dict())


if __name__ == "__main__":
    main()
