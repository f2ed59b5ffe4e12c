"""What results from elsewhere are worth: random tests and proposals against a run from scratch.

    python -m benchmarks.evidence [SEEDS]

For each problem, 64 random designs are taken into a study as a table, then SurrogatePSI proposes 32
more. Its hypervolume is given as a share of that of SurrogatePSI with 96 evaluations from scratch:
the median of the seeds and the extremes. Hypervolumes are measured within the ranges of the fronts
of all runs of the problem.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from benchmarks.comparison_problems import PROBLEMS
from benchmarks.machine import describe_machine, sized
from pymoo_psi import SurrogatePSI, TestTable
from pymoo_psi.algorithms import RunOptions, import_tests
from pymoo_psi.files import read_table
from pymoo_psi.pareto import hypervolume

NAMES = ("osy", "welded_beam", "zdt3")
N_GIVEN, N_PROPOSED = 64, 32
WORST = 1.1  # the reference point, in units of the ranges


def given_tests(problem: Any, seed: int) -> pd.DataFrame:
    """Return random tests of a problem, as somebody else has made them."""
    random = np.random.default_rng(seed)
    X = random.uniform(problem.xl, problem.xu, (N_GIVEN, problem.n_var))
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    columns = {}
    for letter, values in (("x", X), ("f", F), ("g", G)):
        for j, column in enumerate(values.T, 1):
            columns[f"{letter}{j}"] = column
    return pd.DataFrame(columns)


def with_given(problem: Any, seed: int) -> TestTable:
    """Return given tests and those that are proposed from them."""
    with tempfile.TemporaryDirectory() as folder:
        study = Path(folder, "study.db")
        import_tests(problem, given_tests(problem, seed), RunOptions(study=study))
        minimize(problem, SurrogatePSI(N_PROPOSED, study=study), seed=seed)
        return read_table(study)


def main(words: list[str]) -> None:
    """Print a line for each problem."""
    n_seeds = int(words[0]) if words else sized(7, 1)
    print(describe_machine())
    for name in NAMES:
        problem = PROBLEMS[name]() if name in PROBLEMS else get_problem(name)
        fronts = []
        for seed in range(1, n_seeds + 1):
            alone = SurrogatePSI(N_GIVEN + N_PROPOSED)
            tables = with_given(problem, seed), minimize(problem, alone, seed=seed).algorithm.table
            fronts.append([table.F[table.pareto()] for table in tables])
        whole = np.vstack([front for pair in fronts for front in pair])
        low, high = whole.min(axis=0), whole.max(axis=0)
        shares = []
        for pair in fronts:
            volumes = []
            for front in pair:
                scaled = (front - low) / (high - low)
                volumes.append(hypervolume(scaled, WORST)[0])
            shares.append(volumes[0] / volumes[1])
        least, middle, greatest = np.quantile(shares, [0, 0.5, 1])
        print(f"{name}: {middle:.3f} [{least:.3f}, {greatest:.3f}] of {n_seeds} seeds")


if __name__ == "__main__":
    main(sys.argv[1:])
