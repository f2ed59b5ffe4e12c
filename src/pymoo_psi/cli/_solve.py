"""What a run has found: its Pareto set, and in a line each what failed and what is in the way.

``pymoo-psi solve``: from a problem to a ranked Pareto set.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi._validation import Received, integer, invalid
from pymoo_psi.algorithms import PSI, investigate, nsga3
from pymoo_psi.cli._output import counted, print_frame, require_output, run_bar, say, write_csv
from pymoo_psi.evaluation import FailureTolerant
from pymoo_psi.pareto._feasibility import breaks_constraints
from pymoo_psi.pareto._objectives import Objectives
from pymoo_psi.pareto._ranking import ranking_of
from pymoo_psi.storage import Study
from pymoo_psi.table import TestTable
from pymoo_psi.table._constraints import broken_matrix

_REASONS = 3  # that are told, of all there are
_LONGEST = 120  # characters of a reason


@dataclass(frozen=True, eq=False)
class Findings:
    """The end of a run.

    Attributes:
        designs: One row per Pareto-optimal design: ``test_point`` for PSI, the variables.
        F: ``(n, m)`` their objectives.
        counts: How many designs were tested, stored before, and failed.
        failures: Why designs failed, in a line; none if none did.
        obstacles: Why no design is feasible, in lines; none if one is.
    """

    designs: pd.DataFrame
    F: NDArray[np.float64]
    counts: str
    failures: tuple[str, ...]
    obstacles: tuple[str, ...]


def findings_of_table(table: TestTable, limits: Mapping[str, float], n_new: int) -> Findings:
    """Return what is in a table of tests.

    Args:
        table: All tests.
        limits: Limits on criteria.
        n_new: How many were evaluated now, not taken from a study.
    """
    rows = np.flatnonzero(table.pareto(limits))
    if table.F.shape[1] == 1:
        rows = rows[:1]  # as pymoo does
    front = table.rows(rows)
    designs = pd.DataFrame({"test_point": front.numbers})
    for name, column in zip(table.layout.variables, front.X.T, strict=True):
        designs[name] = column
    failed = int((table.status == "failed").sum())
    stored = f", {len(table) - n_new} of them from the study" if n_new < len(table) else ""
    counts = f"{len(table)} tested{stored}" + (f", {failed} failed" if failed else "")
    failures = _failures(table.reasons.values())
    obstacles: tuple[str, ...] = ()
    if len(rows) == 0:
        broken, names = broken_matrix(table, limits)
        n = len(table) - failed
        obstacles = (*_most_broken(broken, names, f"of {n} that were computed"), *failures)
    return Findings(designs, front.F, counts, failures, obstacles)


def findings_of_result(result: Any, n_evaluations: int) -> Findings:
    """Return what is in a pymoo result whose problem is ``FailureTolerant``."""
    reasons = [failure.reason for failure in result.problem.failures]
    counts = f"{n_evaluations} evaluated" + (f", {len(reasons)} failed" if reasons else "")
    failures = _failures(reasons)
    if result.F is None:
        G, H = result.pop.get("G", "H")
        failed = np.array([bool(reason) for reason in result.pop.get("failure")])
        G, H = G[~failed, :-1], H[~failed]
        broken = breaks_constraints(G, H)
        names = [f"g{j + 1}" for j in range(G.shape[1])]
        names += [f"h{j + 1}" for j in range(H.shape[1])]
        lines = _most_broken(broken, names, f"of the last {len(G)}")
        return Findings(pd.DataFrame(), np.empty((0, 0)), counts, failures, (*lines, *failures))
    X, F = result.opt.get("X", "F")
    named = len(X) > 0 and isinstance(X[0], dict)
    designs = pd.DataFrame(list(X)) if named else pd.DataFrame(X).rename(columns=_variable)
    return Findings(designs, F, counts, failures, ())


def _most_broken(broken: NDArray[np.bool_], names: Sequence[str], of: str) -> tuple[str, ...]:
    """Say which constraint or limit is broken most, and how many designs break it alone."""
    if not broken.any():
        return ()
    rejects = broken.sum(axis=0)
    j = int(rejects.argmax())
    alone = int((broken[:, j] & (broken.sum(axis=1) == 1)).sum())
    return (f"Infeasible: {int(broken.any(axis=1).sum())} {of}; {names[j]} rejects most: "
            f"{int(rejects[j])}, {alone} of them alone.",)  # fmt: skip


def _failures(reasons: Iterable[str]) -> tuple[str, ...]:
    """Say in a line why designs failed, the most frequent reason first."""
    counts = Counter(" ".join(reason.split()) for reason in reasons)
    if not counts:
        return ()
    top = counts.most_common(_REASONS)
    told = [f"{n} × {_short(reason)}" for reason, n in top]
    rest = sum(counts.values()) - sum(n for _, n in top)
    told += [f"{rest} × {counted(len(counts) - len(top), 'other reason')}"] if rest else []
    return (f"Failed: {'; '.join(told)}",)


def _short(reason: str) -> str:
    return reason if len(reason) <= _LONGEST else f"{reason[: _LONGEST - 1]}…"


def _variable(j: int) -> str:
    return f"x{j + 1}"


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
            raise invalid(option, "used with --algorithm psi", algorithm)
    for option, needed in (("--study-key", study_key is not None), ("--retry", bool(retry))):
        if needed and study is None:
            raise invalid(option, "used with --study FILE.db", Received("no --study"))
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
