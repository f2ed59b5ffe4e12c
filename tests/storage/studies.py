"""Tests to store, and what is compared of them and of folders."""

from pathlib import Path

import numpy as np

from pymoo_psi import TestTable
from pymoo_psi.storage import Study
from pymoo_psi.table import Layout

LAYOUT = Layout.of(2, 2, 1, lower=[0.0, 0.0], upper=[1.0, 2.0])
PROBLEM = {"problem": "chute", "kinds": ["real", "real"], "objectives": 2, "key": None}


def block(first, count, seed=0, failed=()):
    rng = np.random.default_rng([seed, first])
    X, F, G = rng.random((count, 2)), rng.normal(size=(count, 2)), rng.normal(size=(count, 1))
    X = np.random.default_rng(first).random((count, 2))
    numbers = np.arange(first, first + count)
    reasons = {number: f"reason {seed} of {number}" for number in failed}
    F[np.isin(numbers, list(failed))] = np.nan
    return TestTable.of(numbers, X, F, G, reasons=reasons, layout=LAYOUT)


def bits(table):
    """Everything a table holds, every number with all its bits."""
    cells = [table.numbers.tolist(), table.status.tolist(), dict(table.reasons)]
    cells += [[(type(x), repr(x)) for x in row] for row in table.X.tolist()]
    return [*cells, table.X.dtype, *(getattr(table, name).tobytes() for name in "FGH")]


def contents(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def new_study(folder):
    study = Study(folder / "a study #1?.db", wait=0)
    study.begin(LAYOUT, PROBLEM)
    return study
