"""Surrogates do what the textbook says, and the search on them goes where it is told to go."""

import numpy as np
import pytest
from pymoo.core.problem import Problem
from pymoo.core.variable import Binary, Choice, Integer, Real
from scipy.optimize import approx_fprime

from pymoo_psi.algorithms import _proposals
from pymoo_psi.algorithms._proposals import Goal, KnownTests, _risk, _survivors, encoded, propose
from pymoo_psi.algorithms._surrogate_models import (
    Fit,
    GaussianProcess,
    Scale,
    _matern,
    _negative_log_likelihood,
    scales,
    without_penalties,
)
from pymoo_psi.pareto import nondominated
from pymoo_psi.problems import design_space
from pymoo_psi.sequences import lp_tau


@pytest.fixture(scope="module")
def data():
    Z = lp_tau(40, 3)
    y = np.sin(4 * Z[:, 0]) + Z[:, 1] ** 2
    return Z, (y - y.mean()) / y.std()


# Gaussian processes


def test_the_gradient_of_the_likelihood_is_its_difference_quotient(data):
    x = np.array([-0.5, 0.2, 0.7, np.log(1e-3)])
    numeric = approx_fprime(x, lambda at: _negative_log_likelihood(*data, at)[0], 1e-6)
    np.testing.assert_allclose(_negative_log_likelihood(*data, x)[1], numeric, rtol=1e-4, atol=1e-4)


def test_leaving_a_test_out_is_predicting_it_from_the_others(data):
    """The closed form against the long way: a system of equations for each test."""
    Z, t = data
    lengths = np.log([0.5, 0.7, 2.0, 1e-4])
    process = GaussianProcess(Z, t, lengths)
    K = _matern(Z / np.exp(lengths[:3]), Z / np.exp(lengths[:3]))[0] + 1e-4 * np.eye(len(Z))
    means, variances = process.left_out(t)
    for i in range(len(Z)):
        rest = np.arange(len(Z)) != i
        weights = np.linalg.solve(K[np.ix_(rest, rest)], K[rest, i])
        mean = process.mean + weights @ (t[rest] - process.mean)
        variance = process.variance * (K[i, i] - weights @ K[rest, i])
        np.testing.assert_allclose(means[i], mean, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(variances[i], variance, rtol=1e-6)


# Scales


def test_a_scale_is_monotone_and_comes_back():
    y = np.array([-3.0, 0.0, 1e-3, 2.0, 500.0])
    for unit in (np.inf, 0.1, 10.0):
        scale = Scale.of(y, 0.0, unit)
        np.testing.assert_allclose(scale.back(scale.to(y)), y, atol=1e-9)
        assert (np.diff(scale.to(y)) > 0).all()
        numeric = np.log((scale.to(y + 1e-6) - scale.to(y - 1e-6)) / 2e-6).sum()
        assert scale.log_slope(y) == pytest.approx(numeric, abs=1e-4)


def test_only_heavy_tails_may_be_logarithmic():
    u = (np.arange(64) + 0.5) / 64
    assert len(scales(u, u, constraint=False)) == 1
    assert [np.isinf(s.unit) for s in scales(1 / u**2, 1 / u**2, constraint=False)] == [True, False]
    # the sign of a constraint stays where it is
    assert scales(1 / u**2 - 5, 1 / u**2 - 5, constraint=True)[1].origin == 0


# The search


def goal(n_obj, n_ieq, bounds=()):
    return Goal(n_obj, n_ieq, 0, bounds, np.zeros(2), np.ones(2))


@pytest.mark.parametrize("m", [1, 2, 3])
def test_survivors_are_feasible_then_optimal_then_the_least_violated(m):
    random = np.random.default_rng(m)
    F = random.random((60, m))
    C = np.where(np.arange(60)[:, None] < 20, random.random((60, 2)), -1.0)
    order = _survivors(F, C, 60, 0.5)
    assert sorted(order) == list(range(60))
    assert (order[:40] >= 20).all()
    assert (np.diff(C[order[40:]].sum(axis=1)) >= 0).all()
    first = order[: int(nondominated(F[20:]).sum())]
    if m <= 2:
        assert set(first) == set(20 + np.flatnonzero(nondominated(F[20:])))
    assert nondominated(F[20:])[order[0] - 20]
    np.testing.assert_array_equal(_survivors(F, C, 7, 0.5), order[:7])


def test_surrogates_see_designs_and_not_points():
    variables = {
        "a": Real(bounds=(-1, 3)),
        "n": Integer(bounds=(2, 5)),
        "b": Binary(),
        "c": Choice(options=["x", "y", 7]),
    }
    space = design_space(Problem(vars=variables, n_obj=1))
    U = lp_tau(200, 4)
    X = space.matrix(U)
    again = space.points(X)
    np.testing.assert_array_equal(space.matrix(again), X)
    np.testing.assert_allclose(encoded(space, again), encoded(space, U))
    assert encoded(space, U).shape == (200, 6)
    # the ends of the cube are designs too
    np.testing.assert_array_equal(space.matrix(np.ones((1, 4)))[0], [3.0, 5, True, 7])


@pytest.fixture(scope="module")
def tests():
    points = lp_tau(40, 2)
    Y = np.column_stack([
        points[:, 0], (points[:, 1] - 0.3) ** 2 - points[:, 0], 0.5 - points.sum(axis=1)
    ])  # fmt: skip
    return KnownTests(points, Y, Y[:, 2] <= 0, np.zeros(40, dtype=bool))


@pytest.mark.parametrize("turn", range(len(_proposals.TURNS)))
def test_proposals_are_new_feasible_and_repeatable(tests, turn):
    fit, sought = Fit.of(tests.points, tests.Y, 40, 2), goal(2, 1)
    made, again = (
        propose(tests, fit, sought, np.asarray, 6, turn, np.random.default_rng(1)) for _ in range(2)
    )
    np.testing.assert_array_equal(made.points, again.points)
    assert made.kind == _proposals.TURNS[turn][0]
    assert ((made.points >= 0) & (made.points <= 1)).all()
    every = np.vstack([tests.points, made.points])
    assert len(np.unique(every.round(6), axis=0)) == 46
    x, y = made.points.T
    assert (x + y > 0.45).all()
    # the front is y = 0.3, and where that is forbidden its bound
    on_front = np.abs(y - np.maximum(0.3, 0.5 - x)) < 0.05
    assert on_front.mean() >= 0.5
    np.testing.assert_allclose(made.predicted[:, 0], x, atol=0.05)


@pytest.mark.parametrize("turn", range(len(_proposals.TURNS)))
def test_where_no_design_keeps_a_limit_those_nearest_to_it_are_proposed_but_not_all_alike(
    tests, turn
):
    fit, sought = Fit.of(tests.points, tests.Y, 40, 2), goal(2, 1, [(0, -np.inf, -0.5)])
    made = propose(tests, fit, sought, np.asarray, 6, turn, np.random.default_rng(1)).points
    x, y = made.T
    assert x.min() < 0.01
    assert y[x.argmin()] > 0.45
    assert np.median(x) < 0.2
    gaps = np.linalg.norm(made[:, None] - made, axis=2)[np.triu_indices(6, 1)]
    assert gaps.min() > 0.01


def test_designs_near_failures_are_avoided_but_not_in_every_round():
    known = lp_tau(64, 2)
    failed, known = known[known[:, 0] > 0.7], known[known[:, 0] < 0.7]
    risk = _risk(known, failed, 0)
    assert (risk(failed) > 0).all()
    assert (risk(known) < 0).all()
    assert risk(np.array([[9.0, 9.0]])) < 0  # far from everything nothing is known
    assert (_risk(known, failed, _proposals._FORGIVING - 1)(failed) == 0).all()


@pytest.mark.parametrize(
    ("uniform", "all_of_them", "expected"),
    [
        ([1, 2, np.inf, np.inf], [1, 2, np.inf, np.inf, 9, np.inf], [1, 2, 2, 2, 9, 2]),
        ([1, 2, 1e9, np.inf, np.inf, 1e9], [1, 1e9, np.inf, 3e4], [1, 2, 2, 2]),
        ([1, 2, np.inf], [1, 2, np.inf], [1, 2, np.inf]),  # a single one may be a pole
        ([1, 2, 9e3, 9e3], [1, 2, 9e3, 1e9], [1, 2, 9e3, 1e9]),  # dear, and not senseless
        ([0, 0, 1, 1], [0, 1, 1e9], [0, 1, 1e9]),  # what has two values has no span to be beyond
        ([np.inf, np.inf], [np.inf, 1], [np.inf, 1]),
        ([], [3, np.inf], [3, np.inf]),
        ([-1.7e308, 1.7e308, 1.7e308], [1.7e308], [1.7e308]),
    ],
)
def test_only_what_several_uniform_tests_share_far_beyond_all_others_is_no_value(
    uniform, all_of_them, expected
):
    columns = [np.array(values, dtype=float)[:, None] for values in (all_of_them, uniform)]
    np.testing.assert_array_equal(without_penalties(*columns)[:, 0], expected)
