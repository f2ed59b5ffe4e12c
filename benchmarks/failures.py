"""SurrogatePSI where the model fails in a region beside the Pareto front, or at random.

Two checkouts of the package are compared on the same seeds, each by a run of its own. Finished runs
are kept in a file, so that an interrupted benchmark continues:

    PYTHONPATH=OTHER_CHECKOUT/src python -m benchmarks.failures --entry plain --results runs.jsonl
    PYTHONPATH=src python -m benchmarks.failures --entry learned --results runs.jsonl
    python -m benchmarks.failures --table plain learned --results runs.jsonl

The table has for each problem the mean share of failures in the last quarter of the tests, and the
median hypervolume at the end. Pairs of runs with the same seed are compared by Wilcoxon's
signed-rank test with Holm's correction. A run is stuck if its hypervolume is more than 0.2 below
the median of the first entry.

The model of each problem raises an error in its region, and returns nothing by which one could see
the region coming. The runs begin with scrambled Sobol' points.
"""

from __future__ import annotations

import argparse
import json
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from scipy.stats import wilcoxon

from benchmarks.engineering import SteppedCantilever
from benchmarks.hard import Problem
from benchmarks.machine import output, sized
from pymoo_psi import QMCSampling, SurrogatePSI
from pymoo_psi.comparison import holm

Array = NDArray[np.float64]
# Whether a model fails, given a design, its objectives and its constraints.
Fails = Callable[[Array, Array, Array], bool]

HERE = Path(__file__).parent
N_EVALUATIONS = sized(96, 24)
STUCK = 0.2  # below the median of a problem


class Tube(ElementwiseProblem):
    """A rectangular tube in bending, in mm: width, height and wall; mass in kg and deflection."""

    def __init__(self) -> None:
        super().__init__(n_var=3, n_obj=2, xl=[40, 60, 2], xu=[120, 220, 30])

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        width, height, wall = x
        inner_width = max(width - 2 * wall, 0.0)
        inner_height = max(height - 2 * wall, 0.0)
        inertia = (width * height**3 - inner_width * inner_height**3) / 12
        area = width * height - inner_width * inner_height
        deflection = 1e4 * 3000**3 / (48 * 210_000 * inertia)
        out["F"] = [area * 3000 * 7.85e-6, deflection]


class Corner(ElementwiseProblem):
    """A model that runs in a corner of its bounds; the best designs are at the far end of it."""

    def __init__(self) -> None:
        super().__init__(n_var=5, n_obj=2, xl=0, xu=1)

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        if x[0] + x[1] > 0.5:
            raise ArithmeticError("no convergence")
        bowl = (x[0] - 0.2) ** 2 + 0.1 * (x[1] - 0.2) ** 2
        out["F"] = [-bowl, (x[2:] ** 2).sum() + 0.1 * x[0]]


class Failing(ElementwiseProblem):
    """A problem whose model fails in a region.

    Args:
        problem: The problem, whose model does not fail.
        fails: Whether the model fails.
        hidden: Constraints that the model does not return.
    """

    def __init__(self, problem: Any, fails: Fails, hidden: tuple[int, ...] = ()) -> None:
        self.problem = problem
        self.fails = fails
        self.kept = [j for j in range(problem.n_ieq_constr) if j not in hidden]
        super().__init__(
            n_var=problem.n_var,
            n_obj=problem.n_obj,
            n_ieq_constr=len(self.kept),
            xl=problem.xl,
            xu=problem.xu,
        )

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        values = self.problem.evaluate(x[None], return_as_dictionary=True)
        F = values["F"][0]
        G = np.zeros(0)
        if self.problem.n_ieq_constr:
            G = values["G"][0]
        if self.fails(x, F, G):
            raise ArithmeticError("no convergence")
        out["F"] = F
        if self.kept:
            out["G"] = G[self.kept]


def _tube_fails(x: Array, F: Array, G: Array) -> bool:
    width, height, wall = x
    return bool(2 * wall >= width or height / wall > 45)


def _member_buckles(x: Array, F: Array, G: Array) -> bool:
    square = 1 + x[2] ** 2  # of the length of a member of the truss
    return bool(80 * square**1.5 > 4e8 * x[2] * x[1] ** 2)


def _is_in_ball(x: Array, F: Array, G: Array) -> bool:
    centre = np.array([0.35, *np.full(len(x) - 1, 0.5)])
    return bool(((x - centre) ** 2).sum() < 0.25**2)


def _is_in_stripes(x: Array, F: Array, G: Array) -> bool:
    return bool(np.sin(9 * np.pi * x[0]) > 0.6)


def _is_slender(x: Array, F: Array, G: Array) -> bool:
    return bool(x[5] > 16 * x[0])  # the step at the wall


def _at_random(x: Array, F: Array, G: Array) -> bool:
    return zlib.crc32(np.round(x, 12).tobytes()) % 10 == 0


def _violates(*hidden: int) -> Fails:
    return lambda x, F, G: bool((G[list(hidden)] > 0).any())


def _hiding(name: str, *hidden: int, **options: Any) -> Failing:
    """Return a problem of pymoo whose model fails where some constraints, which it hides, do."""
    return Failing(get_problem(name, **options), _violates(*hidden), hidden)


_dtlz2 = partial(get_problem, "dtlz2", n_var=7, n_obj=3)
_welded_beam = partial(get_problem, "welded_beam")


# Ways to learn from failures were compared on these, so that their numbers are optimistic.
TUNED = {
    "tube": Problem(lambda: Failing(Tube(), _tube_fails), (9.0, 0.31), (100.0, 10.0)),
    "osy": Problem(lambda: _hiding("osy", 1), (-274.0, 4.0), (-42.0, 76.0)),
    "dtlz2_ball": Problem(lambda: Failing(_dtlz2(), _is_in_ball), (0.0,) * 3, (1.0,) * 3),
    "truss2d": Problem(
        lambda: Failing(get_problem("truss2d"), _member_buckles), (0.004, 8430.0), (0.0515, 1e5)
    ),
}
HELD_OUT = {
    "bnh": Problem(lambda: _hiding("bnh", 0), (0.0, 4.0), (136.0, 50.0)),
    "dtlz7_stripes": Problem(
        lambda: Failing(get_problem("dtlz7", n_var=6, n_obj=2), _is_in_stripes),
        (0.0, 2.3),
        (0.86, 4.0),
    ),
    "carside": Problem(lambda: _hiding("carside", 0, 6, 8), (23.7, 3.58, 10.6), (42.8, 4.0, 12.6)),
    "stepped_cantilever": Problem(
        lambda: Failing(SteppedCantilever(), _is_slender), (63_000.0, 0.6), (142_000.0, 3.0)
    ),
}
# Most designs fail.
MOSTLY = {
    "srn": Problem(lambda: _hiding("srn", 0, 1), (10.0, -217.0), (225.0, 0.0)),
    "tnk": Problem(lambda: _hiding("tnk", 1), (0.04, 0.04), (1.04, 1.04)),
    "welded_beam": Problem(
        lambda: _hiding("welded_beam", 0, 1, 2, 3), (2.9, 4.4e-4), (36.9, 7.5e-3)
    ),
    "corner": Problem(Corner, (-0.1, 0.0), (0.0, 0.3)),
}
RANDOM = {
    "random_welded_beam": Problem(
        lambda: Failing(_welded_beam(), _at_random), (2.9, 4.4e-4), (36.9, 7.5e-3)
    ),
    "random_dtlz2": Problem(lambda: Failing(_dtlz2(), _at_random), (0.0,) * 3, (1.0,) * 3),
}
PROBLEMS = TUNED | HELD_OUT | MOSTLY | RANDOM


def run(name: str, entry: str, seed: int) -> dict[str, Any]:
    """Return what is kept of a run."""
    problem = PROBLEMS[name]
    algorithm = SurrogatePSI(N_EVALUATIONS, sampling=QMCSampling("sobol"))
    table = minimize(problem.make(), algorithm, seed=seed).algorithm.table
    quarter = N_EVALUATIONS // 4
    return {
        "problem": name,
        "entry": entry,
        "seed": seed,
        "failures": float(table.failed()[-quarter:].mean()),
        "hypervolume": problem.measured(table.F[table.feasible()]),
    }


def compared(runs: pd.DataFrame, first: str, second: str) -> pd.DataFrame:
    """Return a table of two entries, a row for each problem, from their runs on the same seeds."""
    rows = []
    for name in PROBLEMS:
        of_problem = runs[runs["problem"] == name].set_index("seed")
        a = of_problem[of_problem["entry"] == first]
        b = of_problem[of_problem["entry"] == second]
        seeds = a.index.intersection(b.index)
        if len(seeds) == 0:
            continue
        a = a.loc[seeds]
        b = b.loc[seeds]
        gain = b["hypervolume"] - a["hypervolume"]
        p = 1.0
        if (gain != 0).any():
            p = wilcoxon(gain).pvalue
        row = {
            "problem": name,
            "seeds": len(seeds),
            f"failures, {first}": a["failures"].mean(),
            f"failures, {second}": b["failures"].mean(),
            f"hypervolume, {first}": a["hypervolume"].median(),
            f"hypervolume, {second}": b["hypervolume"].median(),
            "better": (gain > 0).sum(),
            "worse": (gain < 0).sum(),
            "p": p,
            f"stuck, {first}": (a["hypervolume"] < a["hypervolume"].median() - STUCK).sum(),
            f"stuck, {second}": (b["hypervolume"] < a["hypervolume"].median() - STUCK).sum(),
        }
        rows.append(row)
    table = pd.DataFrame(rows)
    table["p"] = holm(table["p"].to_numpy())
    return table


def main() -> None:
    """Perform the runs that are not kept yet, or print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", default=sized([*TUNED, *HELD_OUT], ["tube"]))
    parser.add_argument(
        "--entry", default=sized("learned", "quick"), help="a name for the checkout that runs"
    )
    parser.add_argument("--results", type=Path, default=output(HERE / "failures.jsonl"))
    parser.add_argument("--seeds", type=int, default=sized(10, 1))
    parser.add_argument("--table", nargs=2, metavar=("FIRST", "SECOND"))
    options = parser.parse_args()
    runs = pd.DataFrame(columns=["problem", "entry", "seed"])
    if options.results.exists():
        runs = pd.read_json(options.results, lines=True)
    if options.table:
        table = compared(runs[runs["problem"].isin(options.problems)], *options.table)
        print(table.to_string(index=False, float_format="%.3f"))
        return
    done = set(zip(runs["problem"], runs["entry"], runs["seed"], strict=True))
    for seed in range(options.seeds):
        for name in options.problems:
            if (name, options.entry, seed) in done:
                continue
            row = run(name, options.entry, seed)
            with options.results.open("a") as file:
                file.write(json.dumps(row) + "\n")
            print(row, flush=True)


if __name__ == "__main__":
    main()
