"""What the first tests would have decided, against the tables of the first tests themselves."""

import numpy as np
import pytest
from pymoo.problems import get_problem

from pymoo_psi import TestTable, investigate, lp_tau, rank_of_efficiency
from pymoo_psi.analysis import convergence, convergence_sentence
from pymoo_psi.table import Schema
from tests.helpers.refusals import refused


@pytest.fixture(scope="module")
def bnh():
    return investigate(get_problem("bnh"), 300)


@pytest.mark.parametrize("limits", [None, {"f1": 40.0}])
@pytest.mark.parametrize("normalize", [True, False])
def test_each_row_is_the_investigation_of_as_many_tests(bnh, limits, normalize):
    asked = bnh.under(limits=limits, normalize=normalize)
    found, last = convergence(asked), asked.ranking()
    assert found.index.tolist() == [9, 18, 37, 75, 150, 300]
    span = (last.nadir - last.ideal) if normalize else 1.0
    for n, step in found.iterrows():
        few = investigate(get_problem("bnh"), n).under(limits=limits)
        front = few.take(few.pareto())
        assert (step["feasible"], step["pareto"]) == (few.feasible().sum(), len(front))
        best = rank_of_efficiency(front.F, normalize=normalize).salukvadze[0]
        assert step["optimum"] == front.numbers[best]
        assert step["mu1"] == pytest.approx(np.linalg.norm((front.F[best] - last.ideal) / span))
    assert found["hypervolume"].is_monotonic_increasing  # each front dominates the one before
    assert found["hypervolume"].iloc[-1] == 1
    # The whole front is beyond these.
    fixed = convergence(asked.under(ranges={"f1": (0, 1e-3), "f2": (0, 1e-3)}))
    assert fixed["hypervolume"].tolist() == found["hypervolume"].tolist()
    np.testing.assert_array_equal(found["moved"][1:] == 0, np.diff(found["optimum"]) == 0)
    steps = np.abs(np.diff(bnh.F[found["optimum"] - 1], axis=0)) / (last.nadir - last.ideal)
    np.testing.assert_allclose(found["moved"], [np.nan, *steps.max(axis=1)])


def test_rows_in_another_order_are_the_same_tests(bnh):
    assert convergence(bnh.take(np.argsort(bnh.F[:, 0]))).equals(convergence(bnh))


@pytest.mark.parametrize("columns", [1, 2])
def test_a_design_that_is_best_in_everything_is_named(columns):
    """Distances have no unit then: no share of one, and no infinite share, of nothing."""
    X = lp_tau(64, 2, first=2)
    value = np.where(np.arange(64) < 40, 3.0, 1.0) + 1e-3 * X[:, 0]
    schema = Schema.of(2, [f"drag {k}" for k in range(columns)], maximize=["drag 0"])
    F = np.column_stack([value] * columns)
    found = convergence(TestTable.of(range(1, 65), X, F, schema=schema))
    assert found["pareto"].iloc[-1] == 1
    assert found[["mu1", "hypervolume"]].isna().all(axis=None)
    said = convergence_sentence(found)
    assert "from 32 to 64 tests, changed the design that is the best" in said
    assert "%" not in said


def test_too_little_to_tell():
    X = lp_tau(64, 2)
    late = np.where(np.arange(64) < 40, 1.0, -1.0)[:, None]
    table = TestTable.of(range(1, 65), X, X, late)  # without bounds
    found = convergence(table)
    assert found["optimum"][:3].tolist() == [0, 0, 0]
    assert np.isinf(found["mu1"][:3]).all()
    assert convergence_sentence(found).startswith("Too few tests to tell: 24 of 64 are within")
    few = convergence_sentence(convergence(TestTable.of(range(1, 13), X[:12], X[:12])))
    assert "12 of 12 are within the limits; 16 are needed" in few
    refused("of 8 tests or more, got 7 tests", convergence, table.take(np.arange(7)))
    refused(r"none of 16 tests is feasible \(0 failed\)", convergence, table.take(np.arange(16)))
