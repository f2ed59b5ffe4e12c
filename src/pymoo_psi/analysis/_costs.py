"""Why designs are infeasible or failed: the costs of constraints, and the reasons of failures.

A constraint whose limit is negotiable (a soft limit) can be looked at as an objective more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1): ``Formulation(objectives=[..., constraint])``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._validation import instance
from pymoo_psi.table import EQUALITY, INEQUALITY, TestTable

if TYPE_CHECKING:
    import pandas as pd

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
            bounds.append((limit.low, limit.high))
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
