"""What a run has found: its Pareto set, and in a line each what failed and what is in the way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pymoo_psi.cli.output import counted
from pymoo_psi.investigation import TestTable
from pymoo_psi.investigation.constraints import broken_matrix
from pymoo_psi.pareto.feasibility import breaks_constraints

__all__ = ["Findings", "findings_of_result", "findings_of_table"]

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
