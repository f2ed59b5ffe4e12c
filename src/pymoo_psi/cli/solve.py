"""``pymoo-psi solve``: from a problem to a ranked Pareto set."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi.algorithms import PSI, investigate, nsga3
from pymoo_psi.arguments import Received, broken_rule, integer
from pymoo_psi.cli.findings import Findings, findings_of_result, findings_of_table
from pymoo_psi.cli.output import counted, print_frame, require_output, run_bar, say, write_csv
from pymoo_psi.failures import FailureTolerant
from pymoo_psi.investigation import TestTable
from pymoo_psi.investigation.study import Study
from pymoo_psi.pareto.objectives import Objectives
from pymoo_psi.pareto.ranking import ranking_of

__all__ = ["run_solve"]

_SHOWN = 12


def run_solve(
    problem: Problem,
    algorithm: str,
    points: int,
    *,
    seed: int,
    limits: Mapping[str, float],
    study: Path | None,
    study_key: str | None,
    retry: str | tuple[int, ...],
    out: Path | None,
) -> int:
    """Search, print the best-ranked designs, and write the Pareto set if a file is named.

    Returns:
        0, or 1 if no design is feasible.
    """
    for option, needed in (("--study", study is not None), ("--limits", bool(limits))):
        if needed and algorithm != "psi":
            raise broken_rule(option, "used with --algorithm psi", algorithm)
    for option, needed in (("--study-key", study_key is not None), ("--retry", bool(retry))):
        if needed and study is None:
            raise broken_rule(option, "used with --study FILE.db", Received("no --study"))
    require_output(out, (".csv",), study)
    if algorithm == "nsga3":
        problem = FailureTolerant(problem)
        with run_bar(f"nsga3 on {problem.name()}", points) as show:
            result = nsga3(problem, n_evaluations=points, seed=seed, callback=show.evaluations)
        found = findings_of_result(result, points)
    elif study is None and not problem.elementwise:
        found = findings_of_table(_on_arrays(problem, points, limits), limits, points)
    else:
        found = _stored(problem, points, limits, study, study_key, retry)
    return _report(problem.name(), algorithm, found, out)


def _on_arrays(problem: Problem, points: int, limits: Mapping[str, float]) -> TestTable:
    """Test a vectorised problem without an object for each design, in the blocks of ``PSI``."""
    points = integer("n_points", points, minimum=1)
    size = max(64, -(-points // 32))
    blocks = []
    with run_bar(f"psi on {problem.name()}", points) as show:
        for start in range(0, points, size):
            count = min(size, points - start)
            blocks.append(investigate(problem, count, first=1 + start, limits=limits))
            show.block(blocks[-1], limits)
    return TestTable.empty(blocks[0].layout).extended(*blocks)


def _stored(
    problem: Problem,
    points: int,
    limits: Mapping[str, float],
    study: Path | None,
    study_key: str | None,
    retry: str | tuple[int, ...],
) -> Findings:
    algorithm = PSI(points, limits=limits, study=study, study_key=study_key, retry=retry)
    try:
        with run_bar(f"psi on {problem.name()}", points) as show:
            result = minimize(problem, algorithm, callback=show.psi)
    except KeyboardInterrupt:
        if study is not None:
            stored = len(Study(study).numbers()) if study.exists() else 0
            say(f"{stored} of {points} designs are in {study}; the same command continues.")
        raise
    return findings_of_table(result.algorithm.table, limits, result.algorithm.evaluator.n_eval)


def _report(name: str, algorithm: str, found: Findings, out: Path | None) -> int:
    if len(found.F) == 0:
        say(f"{name}: no feasible design, {found.counts}")
        for line in found.obstacles:
            say(line)
        if out is not None:
            say(f"{out} is not written.")
        return 1
    frame = ranked_designs(found)
    title = f"{name} by {algorithm}: {counted(len(frame), 'Pareto-optimal design')}, {found.counts}"
    variables = [name for name in found.designs.columns if name != "test_point"]
    print_frame(frame.head(_SHOWN), f"{title}, best ranks first", spare=variables)
    for line in found.failures:
        say(line)
    if out is not None:
        write_csv(frame, out)
        say(f"All {len(frame)} written to {out}")
    return 0


def ranked_designs(found: Findings) -> pd.DataFrame:
    """Return the Pareto set, the best rank of efficiency first.

    Columns: ``test_point`` for PSI, the variables, f1 …, ``mu1``, ``mu2``, ``mu3``, ``rank``.
    """
    known = np.ones(len(found.F), dtype=bool)
    ranked = ranking_of(Objectives.of(found.F), known, normalize=True).to_frame(found.F)
    ranked = ranked.drop(columns="pareto")
    return found.designs.join(ranked).loc[ranked.index]
