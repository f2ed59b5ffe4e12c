"""Whether cautions tell right choices from wrong ones: how often more designs move the choice.

Usage:
    python -m benchmarks.cautions [--seeds 40]

Problems without noise, each with 64 and 256 scrambled Sobol' designs, and eight times as many from
the same sequence, which stand for the truth. Wrong is a proposed design that differs from that of
all designs by more than a tenth of a range. For each caution: how often the choice is wrong with it
and without it, and the difference within the same problem, the mean over problems weighted by how
much each of them says. The number behind it is that of the pairs of runs that are compared.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from pymoo.problems import get_problem
from scipy.stats import qmc

from benchmarks.engineering import TenBarTruss
from benchmarks.machine import sized
from pymoo_psi import VectorizedSphereChute, cautions, rank_of_efficiency

TIMES = 8
ELSEWHERE = 0.1


def problems() -> dict[str, Any]:
    """Return the problems by name."""
    found: dict[str, Any] = {"ten-bar truss": TenBarTruss(), "chute": VectorizedSphereChute()}
    for name in ("zdt1", "zdt2", "zdt3", "zdt6"):
        found[name] = get_problem(name, n_var=4)
    for name in ("dtlz1", "dtlz2", "dtlz4", "dtlz5", "dtlz7", *(f"wfg{i}" for i in range(1, 10))):
        found[name] = get_problem(name, n_var=6, n_obj=3)
    for name in ("bnh", "tnk", "truss2d", "welded_beam", "kursawe", "carside", "mw1", "mw7"):
        found[name] = get_problem(name)
    return found


def feasible(problem: Any, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the objectives of designs, and which of them count."""
    designs = problem.xl + points * (problem.xu - problem.xl)
    out = problem.evaluate(designs, return_as_dictionary=True)
    ok = np.isfinite(out["F"]).all(axis=1)
    if problem.n_ieq_constr:
        ok &= (out["G"] <= 0).all(axis=1)
    return out["F"], ok


def choices(n_seeds: int) -> Iterator[dict[str, Any]]:
    """Yield for each problem, number of designs and seed the cautions, and whether it is wrong."""
    for name, problem in problems().items():
        for n in sized((64, 256), (16, 32)):
            for seed in range(n_seeds):
                points = qmc.Sobol(problem.n_var, seed=seed).random(TIMES * n)
                F, ok = feasible(problem, points)
                few = F[:n][ok[:n]]
                if len(few) < 5:
                    continue
                before = rank_of_efficiency(few)
                after = rank_of_efficiency(F[ok])
                ranges = after.nadir - after.ideal
                chosen = few[before.salukvadze[0]]
                steps = np.abs(F[ok][after.salukvadze] - chosen) / np.where(ranges, ranges, np.inf)
                kinds = {caution.kind for caution in cautions(before)}
                wrong = steps.max(axis=1).min() > ELSEWHERE
                yield {"problem": name, "designs": n, "kinds": kinds, "wrong": float(wrong)}


def main() -> None:
    """Print how often choices are wrong with and without each caution."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=sized(40, 1))
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    runs = pd.DataFrame(choices(options.seeds))
    rows = []
    for n, of_size in runs.groupby("designs"):
        for kind in sorted(set().union(*of_size["kinds"])):
            has_it = of_size["kinds"].map(lambda kinds, kind=kind: kind in kinds)
            difference = weight = 0.0
            for _, of_problem in of_size.groupby("problem"):
                some = has_it[of_problem.index]
                if some.any() and not some.all():
                    pairs = some.sum() * (~some).sum() / len(some)
                    wrong = of_problem["wrong"]
                    difference += pairs * (wrong[some].mean() - wrong[~some].mean())
                    weight += pairs
            wrong = of_size["wrong"]
            row = (n, kind, has_it.sum(), wrong[has_it].mean(), wrong[~has_it].mean())
            rows.append((*row, difference / weight if weight else np.nan, weight))
    columns = ["designs", "caution", "runs", "wrong with it", "without", "within", "pairs"]
    print(pd.DataFrame(rows, columns=columns).round(2).to_string(index=False))


if __name__ == "__main__":
    main()
