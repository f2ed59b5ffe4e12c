"""What the first tests would have decided, against the tables of the first tests themselves."""

import dataclasses

import numpy as np
import pytest
from pymoo.problems import get_problem

from pymoo_psi import (
    PsiError,
    TestTable,
    VectorizedSphereChute,
    investigate,
    lp_tau,
    rank_of_efficiency,
)
from pymoo_psi.sequences import covering_radius
from pymoo_psi.table import Layout, convergence

LIMITS = {"f1": 40.0}


@pytest.fixture(scope="module")
def bnh():
    return investigate(get_problem("bnh"), 300)


@pytest.mark.parametrize("limits", [None, LIMITS])
@pytest.mark.parametrize("normalize", [True, False])
def test_each_row_is_the_investigation_of_as_many_tests(bnh, limits, normalize):
    found = convergence(bnh, limits, normalize=normalize)
    assert found.tests.tolist() == [9, 18, 37, 75, 150, 300]
    last = bnh.ranking(limits, normalize=normalize)
    for k, n in enumerate(found.tests.tolist()):
        few = investigate(get_problem("bnh"), n)
        assert found.feasible[k] == few.feasible(limits).sum()
        front = few.F[few.pareto(limits)]
        assert found.pareto[k] == len(front)
        best = rank_of_efficiency(front, normalize=normalize).salukvadze[0]
        assert found.optimum[k] == few.numbers[few.pareto(limits)][best]
        span = (last.nadir - last.ideal) if normalize else 1.0
        assert found.mu1[k] == pytest.approx(np.linalg.norm((front[best] - last.ideal) / span))
        unit = (few.X - bnh.layout.lower) / (bnh.layout.upper - bnh.layout.lower)
        assert found.covering_radius[k] == covering_radius(unit)
    assert found.mu1[-1] == pytest.approx(last.criteria[last.salukvadze[0], 0])
    assert (np.diff(found.hypervolume) >= 0).all()  # each front dominates the one before
    assert found.hypervolume[-1] == 1
    same = found.optimum[1:] == found.optimum[:-1]
    np.testing.assert_array_equal(found.moved[1:] == 0, same)


def test_senses_change_nothing(bnh):
    """A criterion that is maximised is minimised with the other sign."""
    turned = TestTable.of(
        bnh.numbers, bnh.X, bnh.F, bnh.G,
        layout=dataclasses.replace(bnh.layout, maximize=("f2",)),
    )  # fmt: skip
    for one, other in zip(
        vars(convergence(bnh)).values(), vars(convergence(turned)).values(), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-12)


@pytest.mark.parametrize("d", [1, 2, 5])
def test_the_estimate_is_exact_where_its_assumption_holds(d):
    """If what is missing shrinks like n^(-1/d), the gain of the next doubling is told exactly."""
    found = convergence(investigate(get_problem("bnh"), 64))
    n = found.tests.astype(float)
    missing = 2.0 * n ** (-1 / d)
    mu1, volume = 3.0 + missing, 1.0 - 0.1 * missing
    known = dataclasses.replace(found, mu1=mu1, hypervolume=volume, dimension=d)
    nearer, larger = known.gains()
    gain = missing[-1] - 2.0 * 128 ** (-1 / d)
    assert nearer == pytest.approx(gain / mu1[-1])
    assert larger == pytest.approx(0.1 * gain / volume[-1])


@pytest.mark.parametrize("mu", [0.2, 0.4, 0.6])
def test_what_is_expected_of_eight_times_the_tests_is_not_less_than_they_bring(mu):
    n = 128
    table = investigate(VectorizedSphereChute(mu, model="rolling"), 8 * n)
    before, after = convergence(table.rows(np.arange(n))), convergence(table)
    brought = 1 / after.hypervolume[-4] - 1  # what the first n dominate is a share of the last
    r = 2 ** (-1 / 2)
    expected = before.gains()[1] * (1 + r + r**2)
    assert brought <= expected


def test_too_little_to_tell():
    X = lp_tau(64, 2)
    late = np.where(np.arange(64) < 40, 1.0, -1.0)[:, None]
    layout = Layout.of(2, 2, 1)  # without a box
    table = TestTable.of(range(1, 65), X, X, late, layout=layout)
    found = convergence(table)
    assert found.optimum[:3].tolist() == [0, 0, 0]
    assert np.isinf(found.mu1[:3]).all()
    assert np.isnan(found.covering_radius).all()
    assert found.verdict().startswith("Too few tests to tell: 24 of 64 are feasible")
    with pytest.raises(PsiError, match="of 8 tests or more, got 7 tests"):
        convergence(table.rows(np.arange(7)))
    with pytest.raises(PsiError, match="with a feasible design"):
        convergence(table.rows(np.arange(16)))
