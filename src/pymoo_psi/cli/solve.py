"""``pymoo-psi solve``: from a problem to a ranked Pareto set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi.algorithms import PSI, nsga3
from pymoo_psi.arguments import broken_rule
from pymoo_psi.cli.output import print_frame, require_output, run_bar, say, write_csv
from pymoo_psi.failures import FailureTolerant
from pymoo_psi.investigation.study import Study
from pymoo_psi.pareto import rank_of_efficiency

__all__ = ["run_solve"]

_SHOWN = 12


def run_solve(
    problem: Problem,
    algorithm: str,
    points: int,
    *,
    seed: int,
    study: Path | None,
    study_key: str | None,
    out: Path | None,
) -> int:
    """Search, print the best-ranked designs, and write the Pareto set if a file is named."""
    if study is not None and algorithm != "psi":
        raise broken_rule("--study", "used with --algorithm psi", algorithm)
    require_output(out, (".csv",), study)
    try:
        with run_bar(f"{algorithm} on {problem.name()}", points) as show:
            if algorithm == "psi":
                result = minimize(
                    problem, PSI(points, study=study, study_key=study_key), callback=show.psi
                )
            else:
                problem = FailureTolerant(problem)
                result = nsga3(problem, n_evaluations=points, seed=seed, callback=show.evaluations)
    except KeyboardInterrupt:
        if study is not None:
            stored = len(Study(study).numbers()) if study.exists() else 0
            say(f"{stored} of {points} designs are in {study}; the same command continues.")
        raise
    counts = _counts(result, points)
    if result.F is None:
        say(f"{problem.name()}: no feasible design, {counts}")
        return 1
    frame = ranked_designs(result)
    title = f"{problem.name()} by {algorithm}: {len(frame)} Pareto-optimal designs, {counts}"
    variables = list(
        frame.columns[: frame.columns.get_loc("f1")].drop("test_point", errors="ignore")
    )
    print_frame(frame.head(_SHOWN), f"{title}, best ranks first", spare=variables)
    if out is not None:
        write_csv(frame, out)
        say(f"All {len(frame)} written to {out}")
    return 0


def _counts(result: Any, points: int) -> str:
    table = getattr(result.algorithm, "table", None)
    if table is None:
        failures = len(result.problem.failures)
        return f"{points} evaluated" + (f", {failures} failed" if failures else "")
    failed = int((table.status == "failed").sum())
    new = result.algorithm.evaluator.n_eval
    stored = f", {len(table) - new} of them from the study" if new < len(table) else ""
    return f"{len(table)} tested{stored}" + (f", {failed} failed" if failed else "")


def ranked_designs(result: Any) -> pd.DataFrame:
    """Return the Pareto set of a pymoo result, the best rank of efficiency first.

    Columns: ``test_point`` for PSI, the variables, f1 …, ``mu1``, ``mu2``, ``mu3``, ``rank``.
    """
    X, F = result.opt.get("X", "F")
    ranked = rank_of_efficiency(F).to_frame(F).drop(columns="pareto")
    named = len(X) > 0 and isinstance(X[0], dict)
    designs = pd.DataFrame(list(X)) if named else pd.DataFrame(X).rename(columns=_variable)
    if result.opt.has("test_point"):
        designs.insert(0, "test_point", result.opt.get("test_point"))
    return designs.join(ranked).loc[ranked.index]


def _variable(j: int) -> str:
    return f"x{j + 1}"
