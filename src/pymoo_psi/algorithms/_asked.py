"""The formulation of a run: what becomes of it while tests arrive.

Its limits may use an output of which nothing is known before a test has run without failing. Until
then, no test keeps a limit on it. Whether its name is a mistake is known when all tests are there,
however they were cut into blocks.
"""

from __future__ import annotations

from collections import deque
from contextlib import closing
from dataclasses import replace

import numpy as np

from pymoo_psi._validation import Array
from pymoo_psi.parallel import Runner, Waiting
from pymoo_psi.pareto import constraint_violation, nondominated
from pymoo_psi.table import Formulation, TestTable

_TELLING = 4096  # tests, the share of whose front says what that of others will be
_WORTH_SENDING = 100_000  # designs, the dominance of which takes longer than to send them


def under(tests: TestTable, asked: Formulation) -> TestTable:
    """Return tests of a run, perhaps not yet all of them, under its formulation."""
    known = (*asked.computed, *tests.layout.columns)
    names = dict.fromkeys([*asked.columns, *asked.units])
    missing = [name for name in names if name not in known]
    if missing:
        outputs = (*tests.layout.outputs, *missing)
        unknown = np.full((len(tests), len(missing)), np.nan)
        tests = replace(
            tests,
            layout=replace(tests.layout, outputs=outputs),
            outputs=np.hstack([tests.outputs, unknown]),
        )
    return under_known(tests, asked)


def under_known(tests: TestTable, asked: Formulation) -> TestTable:
    """Return tests under a formulation; columns that no test has are refused."""
    if asked == Formulation():
        return tests
    return tests.under(asked)


class Kept:
    """Returns the tests of a block that are needed; of a Pareto set, perhaps more than these.

    Where a large block keeps more than half, nothing is gained by filtering the others, each for
    itself: all of them are filtered together in the end.

    Args:
        keep: Which tests: ``"all"``, the ``"feasible"`` ones, or their ``"pareto"`` set.
        asked: The formulation.
    """

    def __init__(self, keep: str, asked: Formulation) -> None:
        self._keep = keep
        self._asked = asked

    def __call__(self, tests: TestTable) -> TestTable:
        """Return the needed ones of a block."""
        if self._keep == "all":
            return tests
        table = under(tests, self._asked)
        if self._keep == "feasible":
            return tests.rows(table.feasible())
        kept = tests.rows(table.pareto())
        if 2 * len(kept) > len(tests) > _TELLING:
            self._keep = "all"
        return kept


def pareto_tests(tests: TestTable, asked: Formulation, runner: Runner | None) -> TestTable:
    """Return the Pareto set of tests; if they are many, a worker of a runner finds it."""
    table = under(tests, asked)
    rows = np.flatnonzero(table.eligible())
    if runner is None or len(rows) < _WORTH_SENDING:
        return tests.rows(table.pareto())
    F = table.F[rows]
    # as a part of the function: Dask keeps it, and passes it on, better than a task
    waiting: Waiting = deque([(0, None)])
    with closing(runner.tasks(lambda _: nondominated(F), waiting)) as results:
        ((_, mask),) = results
    rows = rows[mask]
    return tests.rows(rows[~table.rows(rows).repeats])


def total_violation(tests: TestTable, asked: Formulation) -> Array:
    """``(n,)`` pymoo's constraint violation of designs, with that of the limits.

    It is infinite where a design failed, or a value that has a limit is none or not finite.
    """
    table = under(tests, asked)
    total = constraint_violation(table.G, table.H, table.layout.eq_tolerance)
    excess = np.zeros(len(table))
    for name, limit in table.limits.items():
        excess += table.excess(name, limit)
    return np.where(table.status == "failed", np.inf, total + excess)
