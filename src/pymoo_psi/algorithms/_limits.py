"""The limits of a run: what becomes of them while tests arrive.

A limit may be on an output of which nothing is known before a test has run without failing. Until
then, no test keeps it. Whether its name is a mistake is known when all tests are there, however
they were cut into blocks.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pymoo_psi._validation import Array
from pymoo_psi.pareto import constraint_violation
from pymoo_psi.table import Limits, TestTable, excess, limits_of


def under_limits(tests: TestTable, limits: Limits | None) -> TestTable:
    """Return tests of a run, perhaps not yet all of them, under its limits."""
    if not limits:
        return tests
    names = [name for name in limits_of(limits) if isinstance(name, str)]
    missing = [name for name in names if name not in tests.layout.columns]
    if missing:
        outputs = (*tests.layout.outputs, *missing)
        unknown = np.full((len(tests), len(missing)), np.nan)
        tests = replace(
            tests,
            layout=replace(tests.layout, outputs=outputs),
            outputs=np.hstack([tests.outputs, unknown]),
        )
    return tests.under(limits=limits)


def kept_tests(keep: str, limits: Limits | None, tests: TestTable) -> TestTable:
    """Return ``"all"`` tests, those ``"feasible"`` under limits or their ``"pareto"`` set."""
    if keep == "all":
        return tests
    table = under_limits(tests, limits)
    if keep == "pareto":
        return tests.rows(table.pareto())
    return tests.rows(table.feasible())


def total_violation(tests: TestTable, limits: Limits | None) -> Array:
    """``(n,)`` pymoo's constraint violation of designs, with that of the limits.

    It is infinite where a design failed, or a value that has a limit is none or not finite.
    """
    table = under_limits(tests, limits)
    total = constraint_violation(tests.G, tests.H, tests.layout.eq_tolerance)
    total = total + excess(table.limits, table.column, len(table))
    return np.where(tests.status == "failed", np.inf, total)
