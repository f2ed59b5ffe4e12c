"""Limits: how many designs they leave, what each costs, and why designs failed.

Sentences name limits and constraints as :func:`limit_words` does, in the terminal and in reports.

A constraint whose limit is negotiable (a soft limit) can be looked at as an objective more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1): ``Formulation(objectives=[..., constraint])``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._numbers import number
from pymoo_psi._validation import counted, instance
from pymoo_psi.table import EQUALITY, INEQUALITY, RUN, TestTable

if TYPE_CHECKING:
    import pandas as pd

_MOST_LIMITS = 3  # that a sentence names
_CONSTRAINT = re.compile(r"(.+?)\s*(<=|>=)\s*(.+)")  # the name of one that is a limit of a program
_FOLDER = re.compile(r"; see \S.*$")
# No exit code, as one of 3 is another failure than one of 4, and no digit of a name such as f1.
_NUMBER = re.compile(r"(?<!exit code )(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?!\w)")


def constraint_costs(table: TestTable) -> pd.DataFrame:
    """Return the cost of each constraint and limit, and the gain of relaxing it.

    Returns:
        One row per constraint and then per limit, as it is written. Columns: ``lower`` and
        ``upper``, the least and the greatest value allowed; ``rejects``, how many designs violate
        it; ``alone``, how many designs violate nothing else; and for each objective the best value
        among the feasible designs (``f1_feasible``) and among those that violate nothing else
        (``f1_alone``); NaN if there are none.

    Example:
        Test 2 violates only the constraint; without it f1 could be 1 instead of 2.

        >>> X, F, G = [[0.1], [0.5], [0.9]], [[2], [1], [4]], [[0.0], [0.5], [0.0]]
        >>> table = TestTable.of([1, 2, 3], X, F, G).under(limits={"f1": 3})
        >>> print(constraint_costs(table))
                    lower  upper  rejects  alone  f1_feasible  f1_alone
        constraint
        g1           -inf    0.0        1      1          2.0       1.0
        f1<=3        -inf    3.0        1      1          2.0       4.0
    """
    import pandas as pd

    mask, names = instance("table", table, TestTable).violations()
    schema = table.schema
    bounds = [(-np.inf, 0.0)] * len(schema.with_role(INEQUALITY))
    bounds += [(-schema.eq_tolerance, schema.eq_tolerance)] * len(schema.with_role(EQUALITY))
    for limit in table.limits.values():
        if limit.texts is None:
            bounds.append((limit.lower, limit.upper))
        else:
            bounds.append((np.nan, np.nan))
    alone = mask & (mask.sum(axis=1) == 1)[:, None]
    index = pd.Index(names, name="constraint", dtype=object)
    frame = pd.DataFrame(bounds, index, ["lower", "upper"], dtype=np.float64)
    frame["rejects"] = mask.sum(axis=0)
    frame["alone"] = alone.sum(axis=0)
    # Objectives of infeasible designs need not be finite, and -inf would be the best of all.
    F = pd.DataFrame(np.where(np.isfinite(table.F), table.F, np.nan))
    feasible = table.feasible()
    for j, (name, sign) in enumerate(zip(schema.objectives, schema.sign, strict=True)):
        frame[f"{name}_feasible"] = sign * F[j][feasible].min()
        frame[f"{name}_alone"] = [sign * F[j][rows].min() for rows in alone.T]
    return frame


def limit_words(table: TestTable) -> list[str]:
    """Return the constraints and then the limits of a table in words: "price at most 1400 €"."""
    units = table.schema.units
    texts = []
    for name in table.schema.constraints:
        parts = _CONSTRAINT.fullmatch(name)
        if parts is None:
            texts.append(name)
        else:
            side = "at most" if parts[2] == "<=" else "at least"
            texts.append(f"{parts[1]} {side} {parts[3]} {units.get(parts[1], '')}".strip())
    for name, limit in table.limits.items():
        texts.append(limit.in_words(name, units.get(name, "")))
    return texts


def within_limits(table: TestTable) -> str:
    """Return " within the limits", or nothing where there are none."""
    n = len(table.limits) + len(table.schema.constraints)
    if n == 0:
        return ""
    if n == 1:
        return " within the limit"
    return " within the limits"


def counts_sentence(table: TestTable, subject: str = "") -> str:
    """Return how many tests there are, within the limits, and not dominated.

    Args:
        table: The tests.
        subject: What they are tests of, if that is said.
    """
    words = table.schema.words
    n_within = int(table.feasible().sum())
    n_failed = int(table.failed().sum())
    size = counted(len(table), words["row"])
    failed = f", {number(n_failed)} {words['failed']}" if n_failed else ""
    limits = limit_words(table)
    named = ", ".join(limits[:_MOST_LIMITS])
    if len(limits) > _MOST_LIMITS:
        named += f" and {len(limits) - _MOST_LIMITS} more"
    within = f"{_are(n_within)}{within_limits(table)} ({named})"
    if subject:
        if RUN in table.schema.notes:
            size += f" of {counted(len({*table.column(RUN)}), 'run')}"
        text = f"{subject}: {size}{failed}"
        if limits:
            text += f"; {number(n_within)} {within}"
    elif limits:
        text = f"{number(n_within)} of {size} {within}{failed}"
    else:
        text = f"{size}{failed}"
    if n_within > 1:
        n_optimal = int(table.feasible_ranking().pareto.sum())
        text += f"; {number(n_optimal)} of them {_are(n_optimal)} not dominated"
    return f"{text}."


def _are(n: int) -> str:
    return "is" if n == 1 else "are"


def none_left_sentence(table: TestTable) -> str:
    """Say that no design is left, and without which limit one would be."""
    words = table.schema.words
    n_tests = (~table.failed()).sum()
    if not n_tests:
        return f"No design is left: {counted(len(table), words['row'])}, all {words['failed']}."
    limits = limit_words(table)
    if not limits:
        return f"No design is left: {counted(len(table), words['row'])}, none with all objectives."
    text = f"No design is left: none of {n_tests} meets the limits ({', '.join(limits)})."
    costs = constraint_costs(table)
    names = [*table.schema.constraints, *table.limits]
    alone = costs["alone"].to_numpy()
    if alone.any():
        n = alone.max()
        return f"{text} Without the limit on {names[alone.argmax()]} {n} {_are(n)} left."
    rejects = costs["rejects"].to_numpy()
    return f"{text} The limit on {names[rejects.argmax()]} rejects most, {rejects.max()}."


def alike(reasons: Iterable[str]) -> list[str]:
    """Return reasons of failures as lines; dots stand for numbers in which only they differ.

    Programs quote the design that they fail at, so that no two reasons are the same. Exit codes
    stay. Of the folders that runs of a program leave, the first is named.
    """
    lines = [" ".join(reason.split()) for reason in reasons]
    lines_by_pattern: dict[str, list[str]] = {}
    patterns = [_NUMBER.sub("…", _FOLDER.sub("", line)) for line in lines]
    for line, pattern in zip(lines, patterns, strict=True):
        lines_by_pattern.setdefault(pattern, []).append(line)
    for i, pattern in enumerate(patterns):
        same = lines_by_pattern[pattern]
        if len({*same}) > 1:
            lines[i] = pattern + "".join(_FOLDER.findall(same[0]))
    return lines
