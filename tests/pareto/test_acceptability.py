"""Shares of the weights against closed forms and numerical integration."""

import numpy as np
import pytest

from pymoo_psi import CompromiseProgramming, acceptability, rank_of_efficiency
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import weight_shares, weights_sentence
from tests.helpers.refusals import refused

# Two and three objectives whose range over the Pareto set is 0 to 1.
TWO = np.array([[0.0, 1.0], [0.1, 0.7], [0.25, 0.4], [0.6, 0.15], [1.0, 0.0]])
THREE = np.array(
    [[0, 0.8, 1], [1, 0, 0.6], [0.7, 1, 0], [0.3, 0.35, 0.4], [0.5, 0.2, 0.5], [0.2, 0.6, 0.45]]
)


def integrated(F, p, factor=None, n=300):
    """The shares by the midpoint rule on a grid of the simplex, a triangle or an interval."""
    d, m = (F - F.min(axis=0)) / np.ptp(F, axis=0), F.shape[1]
    axes = np.meshgrid(*[(np.arange(n) + 0.5) / n] * (m - 1), indexing="ij")
    first = np.reshape(axes, (m - 1, -1))
    weights = np.vstack([first, 1 - first.sum(axis=0)]).T
    least, most = (0.0, 1.0) if factor is None else (1 / (m * factor), factor / m)
    weights = weights[((weights >= least) & (weights <= most)).all(axis=1)]
    places = np.linalg.norm(weights[:, None] * d, ord=p, axis=2).argsort(axis=1)
    return np.array([np.bincount(column, minlength=len(F)) for column in places.T]).T / len(weights)


@pytest.mark.parametrize(
    "F", [TWO, THREE, TWO * [300.0, 0.02] + [5.0, -1.0]], ids=["two", "three", "units"]
)
@pytest.mark.parametrize("p", [1, 2, 32, np.inf])
@pytest.mark.parametrize("factor", [None, 2.0, 1.2])
def test_shares_are_those_of_numerical_integration(F, p, factor):
    n = 300 if F.shape[1] == 3 else 20_000
    shares = acceptability(F, p=p, factor=factor)
    assert np.abs(shares - integrated(F, p, factor, n)[:, :3]).max() < 0.005


@pytest.mark.parametrize("p", [1, 2, np.inf])
def test_equal_weights_are_the_limit_of_a_small_factor(p):
    shares = acceptability(THREE, p=p, factor=1.0001)
    assert np.flatnonzero(shares[:, 0] == 1).tolist() == CompromiseProgramming(p).do(THREE)


def test_equal_designs_share_places_and_dominated_have_none():
    shares = acceptability(np.vstack([TWO, TWO[2], [2.0, 2.0]]))
    assert np.array_equal(shares[:5], acceptability(TWO))
    assert np.array_equal(shares[5], shares[2])
    assert not shares[6].any()


@pytest.mark.parametrize("constant", [3.0, 0.0, -1e9])
def test_an_objective_equal_for_all_has_no_weight(constant):
    F = np.insert(THREE, 1, constant, axis=1)
    assert np.array_equal(acceptability(F, factor=2), acceptability(THREE, factor=2))
    fixed, of_three = (
        acceptability(rank_of_efficiency(G, ideal=G.min(axis=0) - 1, nadir=G.max(axis=0) + 1))
        for G in (F, THREE)
    )
    assert np.array_equal(fixed, of_three)


def test_almost_all_weights_are_not_all():
    """The middle is the best for all weights if it is at 10^-1/2 or less."""
    ranking = rank_of_efficiency([[0.0, 1.0], [0.3163, 0.3163], [1.0, 0.0]])
    assert "in more than 99 % of the cases" in weights_sentence(ranking, 1, weight_shares(ranking))


@pytest.mark.parametrize(("n", "n_weights"), [(10_000, 8192), (10_001, 2048)])
def test_many_designs_have_fewer_weights(n, n_weights):
    x = np.arange(n) / n
    counts = n_weights * acceptability(np.column_stack([x, (1 - x) ** 2]), places=1)
    assert counts.sum() == n_weights
    assert (counts % 1 == 0).all()
    assert (counts % 4 != 0).any()


def test_a_single_optimum_is_best_for_all_weights():
    shares = acceptability([[3.0, 3.0], [1.0, 2.0], [1.0, 2.0]])
    assert shares.tolist() == [[0, 0, 0], [1, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    "wrong", [{"factor": 1}, {"factor": "2"}, {"p": 0.5}, {"p": "2"}, {"p": 33}, {"places": 0}]
)
def test_wrong_arguments_are_refused_by_name(wrong):
    refused(f"^{next(iter(wrong))} must be", acceptability, TWO, error=ArgumentValueError, **wrong)
