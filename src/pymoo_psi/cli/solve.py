"""``pymoo-psi solve``: from a problem to a ranked Pareto set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi.algorithms import PSI, nsga3
from pymoo_psi.cli.output import print_frame, progress_bar, say, write_csv
from pymoo_psi.pareto import rank_of_efficiency

__all__ = ["run_solve"]

_SHOWN = 12


def run_solve(problem: Problem, algorithm: str, points: int, seed: int, out: Path | None) -> int:
    """Search, print the best-ranked designs, and write the Pareto set if a file is named."""
    with progress_bar() as bar:
        task = bar.add_task(f"{algorithm} on {problem.name()}", total=points)

        def advance(algorithm: Any) -> None:
            bar.update(task, completed=algorithm.evaluator.n_eval)

        if algorithm == "psi":
            result = minimize(problem, PSI(points), callback=advance)
        else:
            result = nsga3(problem, n_evaluations=points, seed=seed, callback=advance)
    if result.F is None:
        say(f"{problem.name()}: none of {points} designs is feasible")
        return 1
    frame = ranked_designs(result)
    count = f"{len(frame)} Pareto-optimal feasible designs of {points} evaluated"
    title = f"{problem.name()} by {algorithm}: {count}, best ranks first"
    variables = list(
        frame.columns[: frame.columns.get_loc("f1")].drop("test_point", errors="ignore")
    )
    print_frame(frame.head(_SHOWN), title, spare=variables)
    if out is not None:
        write_csv(frame, out)
        say(f"All {len(frame)} written to {out}")
    return 0


def ranked_designs(result: Any) -> pd.DataFrame:
    """Return the Pareto set of a pymoo result, the best rank of efficiency first.

    Columns: ``test_point`` for PSI, x1 …, f1 …, ``mu1``, ``mu2``, ``mu3``, ``rank``.
    """
    X, F = result.opt.get("X", "F")
    ranked = rank_of_efficiency(F).to_frame(F).drop(columns="pareto")
    designs = pd.DataFrame(X).rename(columns=lambda j: f"x{j + 1}" if isinstance(j, int) else j)
    if result.opt.has("test_point"):
        designs.insert(0, "test_point", result.opt.get("test_point"))
    return designs.join(ranked).loc[ranked.index]
