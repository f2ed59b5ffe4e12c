"""Test tables that the pictures are of; a table never changes."""

import numpy as np
import pytest
from pymoo.problems import get_problem

from pymoo_psi import TestTable, VectorizedSphereChute, investigate
from pymoo_psi.comparison import compare
from pymoo_psi.table import Schema


@pytest.fixture(scope="session")
def chute():
    return investigate(VectorizedSphereChute(0.4, model="rolling"), 512)


@pytest.fixture(scope="session")
def osy():
    return investigate(get_problem("osy"), 1024)


@pytest.fixture(scope="session")
def mixed():
    k = np.arange(60)
    metals = ("steel", "brass", "tin")
    X = [[1 + i / 60, int(3 + i % 5), bool(i % 2), metals[i % 3]] for i in k]
    F = np.column_stack([k % 7 + k / 60, (k * 5) % 11 - k / 60])
    schema = Schema.of(
        ["length", "count", "hollow", "metal"], 2, 1,
        lower=[1, 3, np.nan, np.nan], upper=[2, 7, np.nan, np.nan],
    )  # fmt: skip
    return TestTable.of(1 + k, X, F, G=(k % 4 - 2.0)[:, None], schema=schema)


@pytest.fixture(scope="session")
def bnh():
    return compare(
        get_problem("bnh"), n_evaluations=(32, 64), seeds=4,
        algorithms=["psi", "psi-scrambled", "nsga3"],
    )  # fmt: skip
