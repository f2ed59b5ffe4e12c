"""What the tests share: examples without a time limit, what they run on, tables to draw."""

from importlib.metadata import version

import numpy as np
import pytest
from hypothesis import settings
from pymoo.problems import get_problem

from pymoo_psi import TestTable, VectorizedSphereChute, investigate
from pymoo_psi.plots import section
from pymoo_psi.table import Layout, section_points
from tests.plots.drawn import METALS, sphere

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def pytest_report_header():
    names = ("pymoo", "numpy", "scipy", "pandas", "matplotlib", "moocore", "joblib", "typer")
    return " ".join(f"{name}-{version(name)}" for name in names)


# Test tables that several files draw; a table never changes.


@pytest.fixture(scope="session")
def chute():
    table = investigate(VectorizedSphereChute(0.4, model="rolling"), 512)
    return table.with_prototype([0.6, 0.9], [1.9, 0.1, 0.6, 0.9], name="old chute")


@pytest.fixture(scope="session")
def osy():
    return investigate(get_problem("osy"), 1024)


@pytest.fixture(scope="session")
def mixed():
    k = np.arange(60)
    X = [[1 + i / 60, int(3 + i % 5), bool(i % 2), METALS[i % 3]] for i in k]
    F = np.column_stack([k % 7 + k / 60, (k * 5) % 11 - k / 60])
    layout = Layout.of(
        ["length", "count", "hollow", "metal"], 2, 1,
        lower=[1, 3, np.nan, np.nan], upper=[2, 7, np.nan, np.nan],
    )  # fmt: skip
    table = TestTable.of(1 + k, X, F, G=(k % 4 - 2.0)[:, None], layout=layout)
    return table.with_prototype([1.5, 5, True, "gold"], [3.0, 3.0])


@pytest.fixture
def curves():
    table = TestTable.of(
        [1, 2], [[0.0, 0.5], [0.25, 0.75]], sphere(np.array([[0.0, 0.5], [0.25, 0.75]]))
    )
    X = section_points(table, 2, "x1", 5, lower=0, upper=1)[[3, 0, 4, 1, 2]]
    F = sphere(X)
    F[1] = np.nan  # x1 = 0
    return section(table, 2, "x1", X, F, limits={"f2": 0.35})
