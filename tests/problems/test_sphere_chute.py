"""The chute as pymoo problems: the same values one by one and in arrays, the box, errors."""

import numpy as np
import pytest

from pymoo_psi import SphereChute, VectorizedSphereChute, lp_tau
from tests.helpers.refusals import refused


@pytest.mark.parametrize("model", ["rolling", "full"])
def test_both_problems_give_the_same_values(model):
    X = lp_tau(20, 2, first=3) * [1.4, 5.9] + [0, 0.1]
    options = {"model": model, "c": 0.4, "omega0": (1.0, -2.0, 3.0)}
    F, G = VectorizedSphereChute(0.4, **options).evaluate(X)
    F1, G1 = SphereChute(0.4, **options).evaluate(X)
    np.testing.assert_array_equal(F1, F)
    np.testing.assert_array_equal(G1, G)


@pytest.mark.parametrize("make", [SphereChute, VectorizedSphereChute])
def test_a_stall_violates_the_constraint(make):
    F, G = make(1.0, c=0.1, omega0=(0, -20, 0)).evaluate(np.array([[0.0, 0.1], [3.0, 0.1]]))
    assert 0 < G[0, 0] < 1
    assert G[1, 0] == 0
    assert np.isinf(F[0, :2]).all()
    assert np.isfinite(F[1]).all()


@pytest.mark.parametrize("make", [SphereChute, VectorizedSphereChute])
@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"mu": 0}, ValueError, "mu must be positive, got 0.0"),
        ({"lower": (np.nan, 0.1)}, ValueError, "lower must be finite, got nan"),
        ({"elementwise_runer": 1}, TypeError, "did you mean 'elementwise_runner'"),
    ],
)
def test_bad_problem_arguments(make, options, kind, message):
    refused(message, make, error=kind, **options)
