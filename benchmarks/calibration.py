"""Whether probabilities of ``table.confidence()`` hold: stated against observed, in bands.

Usage:
    python -m benchmarks.calibration [--seeds 20] [--out FILE.png]

Five problems, each with 256 LPτ designs whose true values are known. Normal noise of 0, 2, 5 and
10 % of the range of each objective over the true Pareto set is added, in one test of each design
whose noise is known, and in four tests from which it is estimated. Stated is what ``confidence``
says of the proposed design and of all designs called Pareto optimal; observed is how often it is
true of the noiseless values.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from pymoo.problems import get_problem

from benchmarks.machine import sized
from pymoo_psi import TestTable, lp_tau, rank_of_efficiency
from pymoo_psi.analysis import average_repeats
from pymoo_psi.table import Schema

N_DESIGNS = sized(256, 32)
NOISE = (0.0, 0.02, 0.05, 0.1)
BANDS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
NEAR = 1.05


def problems() -> dict[str, Any]:
    """Return the problems by name: fronts convex, concave, linear, of two and three objectives."""
    return {
        "ZDT1": get_problem("zdt1", n_var=4),
        "ZDT2": get_problem("zdt2", n_var=4),
        "DTLZ1": get_problem("dtlz1", n_var=5, n_obj=3),
        "DTLZ2": get_problem("dtlz2", n_var=6, n_obj=3),
        "WFG5": get_problem("wfg5", n_var=6, n_obj=3),
    }


def truth_of(problem: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the values of the designs, the ranges, and which are truly optimal and near best."""
    points = lp_tau(N_DESIGNS, problem.n_var, first=2)
    F = problem.evaluate(problem.xl + points * (problem.xu - problem.xl), return_values_of=["F"])
    ranking = rank_of_efficiency(F)
    distance = ranking.criteria[:, 0]
    near = distance <= NEAR * distance[ranking.pareto].min()
    return F, ranking.nadir - ranking.ideal, ranking.pareto, near


def decisions(n_seeds: int) -> Iterator[dict[str, Any]]:
    """Yield, for each problem, noise, number of tests and seed, what is stated and what is true."""
    for name, problem in problems().items():
        F, ranges, pareto, near = truth_of(problem)
        objectives = [f"f{j + 1}" for j in range(F.shape[1])]
        for noise in NOISE:
            for tests in (1, 4):
                for seed in range(n_seeds):
                    generator = np.random.default_rng([seed, tests])
                    steps = generator.standard_normal((tests, *F.shape))
                    values = np.concatenate(F + noise * ranges * steps)
                    numbers = np.arange(1, len(values) + 1)
                    label = np.tile(np.arange(len(F)), tests).astype(str)
                    no_variables = np.zeros((len(values), 0))
                    extra = {"label": label}
                    if tests == 1:  # the noise is known
                        errors = np.tile(noise * ranges, (len(values), 1)).T
                        names = [f"{name} standard error" for name in objectives]
                        outputs = dict(zip(names, errors, strict=True))
                        schema = Schema.of(0, objectives, outputs=names)
                        table = TestTable.of(
                            numbers,
                            no_variables,
                            values,
                            outputs=outputs,
                            schema=schema,
                            notes=extra,
                        )
                    else:
                        table = TestTable.of(numbers, no_variables, values, notes=extra)
                        table = average_repeats(table, "label")
                    frame = table.confidence()
                    ranking = table.feasible_ranking()
                    chosen = ranking.salukvadze[0]
                    called = frame["pareto"].to_numpy() >= 0.9
                    yield {
                        "problem": name,
                        "noise": noise,
                        "tests": tests,
                        "stated": frame["near_best"].iloc[chosen],
                        "observed": near[chosen],
                        "likeliest stated": frame["near_best"].max(),
                        "likeliest observed": near[frame["near_best"].argmax()],
                        "called optimal": called.sum(),
                        "truly optimal": (called & pareto).sum(),
                    }


def main() -> None:
    """Print and draw how far stated probabilities hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=sized(20, 1))
    parser.add_argument("--out", help="a picture")
    options = parser.parse_args()
    pd.set_option("display.width", 200, "display.max_columns", 20)
    runs = pd.DataFrame(decisions(options.seeds))
    runs["observed"] = runs["observed"].astype(float)
    runs["likeliest observed"] = runs["likeliest observed"].astype(float)
    noisy = runs[runs["noise"] > 0]
    columns = {
        name: (name, "mean")
        for name in ("stated", "observed", "likeliest stated", "likeliest observed")
    }
    sums = {name: (name, "sum") for name in ("called optimal", "truly optimal")}
    for keys in (["noise", "tests"], ["problem", "tests"]):
        groups = runs if keys[0] == "noise" else noisy
        print(groups.groupby(keys).agg(**columns, **sums).round(2), end="\n\n")
    curves = []
    for what, stated, observed in (
        ("proposed design", "stated", "observed"),
        ("likeliest design", "likeliest stated", "likeliest observed"),
    ):
        for tests, of_tests in noisy.groupby("tests"):
            band = pd.cut(of_tests[stated], BANDS, include_lowest=True)
            curve = of_tests.groupby(band, observed=True).agg(
                runs=(stated, "size"), stated=(stated, "mean"), observed=(observed, "mean")
            )
            print(f"{what}, {tests} test(s) of each design\n{curve.round(2)}", end="\n\n")
            label = f"{what}, {tests} tests"
            if tests == 1:
                label = f"{what}, known noise"
            curves.append((label, curve))
    if options.out:
        draw(curves, options.out)


def draw(curves: list[tuple[str, pd.DataFrame]], path: str) -> None:
    """Draw the reliability diagram."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.5, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.fill_between([0, 1], [-0.1, 0.9], [0.1, 1.1], color="0.9")
    for label, curve in curves:
        axes.plot(curve["stated"], curve["observed"], "o-", label=label)
    axes.set(xlim=(0, 1), ylim=(0, 1), xlabel="stated probability", ylabel="observed share")
    axes.legend()
    figure.savefig(path, dpi=150)


if __name__ == "__main__":
    main()
