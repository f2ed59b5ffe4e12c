"""The Gaussian processes of the surrogates against linear algebra written out, and their values.

No proposal shows these clearly enough, so that these tests look at the functions themselves.
"""

import numpy as np
import pytest

from pymoo_psi import lp_tau
from pymoo_psi.algorithms._surrogate_models import (
    Covariance,
    GaussianProcess,
    OutputFit,
    scales,
    without_penalties,
)
from tests.helpers.draws import rarely

N, D = 12, 3
LENGTHS = np.log([0.4, 0.9, 2.0])
BENDS = [0.5, 0.01, -1.5]
SHARES = np.log([1e-3, 0.7, 0.3])  # of noise, linear and quadratic trends


def covariance(a, b):
    """Of the values at two designs: Matérn's kernel, ν = 5/2, and Legendre's polynomials."""
    rates = np.sinh(BENDS)
    ends = np.clip([a, b], 0, 1)
    bent = (np.exp(rates * ends) - 1) / (np.exp(rates) - 1) + [a, b] - ends
    r = np.sqrt(5 * (((bent[0] - bent[1]) / np.exp(LENGTHS)) ** 2).sum())
    linear, quadratic = np.exp(SHARES[1:])
    u, v = 2 * a - 1, 2 * b - 1
    trends = linear * 3 * u @ v + quadratic * 5 / 4 * (3 * u**2 - 1) @ (3 * v**2 - 1)
    return (1 + r + r**2 / 3) * np.exp(-r) + trends / D


def covariances(A, B):
    return np.array([[covariance(a, b) for b in B] for a in A])


@pytest.fixture(scope="module")
def tests():
    Z = np.random.default_rng(1).random((N, D))
    t = np.sin(3 * Z[:, 0]) + Z[:, 1] * Z[:, 2]
    return Z, (t - t.mean()) / t.std()


@pytest.fixture(scope="module")
def process(tests):
    Z, t = tests
    return GaussianProcess(Covariance(Z, np.concatenate([LENGTHS, BENDS, SHARES])), t)


def test_predictions_are_those_of_the_conditional_normal_distribution(tests, process):
    Z, t = tests
    at = np.random.default_rng(2).random((40, D)) * 1.5 - 0.25  # beyond the cube, too
    K, k = covariances(Z, Z) + np.exp(SHARES[0]) * np.eye(N), covariances(at, Z)
    inverse = np.linalg.inv(K)
    mean = inverse.sum(axis=0) @ t / inverse.sum()
    variance = (t - mean) @ inverse @ (t - mean) / N
    np.testing.assert_allclose(process(at), mean + k @ inverse @ (t - mean), rtol=1e-9)
    prior = np.array([covariance(z, z) for z in at])
    expected = variance * (prior - np.einsum("ij,jk,ik->i", k, inverse, k))
    np.testing.assert_allclose(process.deviation(at) ** 2, expected, rtol=1e-6)


EVEN = np.linspace(1.0, 2.0, 20)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([*EVEN, 1e9, 1e9], [*EVEN, 2, 2]),
        ([*EVEN, np.inf, np.inf], [*EVEN, 2, 2]),
        ([*EVEN, 1e9, np.inf, 1e9, np.inf], [*EVEN, 2, 2, 2, 2]),
        ([*EVEN, 1e9], [*EVEN, 1e9]),  # one test may be a pole
        ([*EVEN, 30.0, 30.0], [*EVEN, 30, 30]),  # not far enough to stand for none
        ([*(1 / EVEN), 1e3, 1e6, 1e9, 1e9], [*(1 / EVEN), 1e3, 1e6, 1e9, 1e9]),
        ([*-EVEN, -1e9, -1e9], [*-EVEN, -1e9, -1e9]),  # nor does the best value
    ],
)
def test_a_far_value_of_several_tests_is_a_penalty(values, expected):
    """Whatever proposals have: the tests at uniform points decide, and each objective for itself."""
    F = np.column_stack([values, np.arange(float(len(values)))])
    found = without_penalties(np.vstack([F, [[1.5, 2e9], [3e10, 1.0]]]), F)
    np.testing.assert_array_equal(found[:-2, 0], expected)
    np.testing.assert_array_equal(found[:, 1], [*F[:, 1], 2e9, 1.0])
    assert found[-2, 0] == 1.5
    assert found[-1, 0] == (3e10 if values == expected else 2)


def test_what_is_left_out_is_predicted_from_the_others(tests, process):
    """Each value from all others, with the mean and the variance of all (equation 5.12)."""
    Z, t = tests
    K = covariances(Z, Z) + np.exp(SHARES[0]) * np.eye(N)
    for i, (mean, variance) in enumerate(zip(*process.left_out(t), strict=True)):
        others = np.delete(np.arange(N), i)
        weights = np.linalg.solve(K[np.ix_(others, others)], K[others, i])
        assert mean == pytest.approx(process.mean + weights @ (t[others] - process.mean))
        assert variance == pytest.approx(process.variance * (K[i, i] - weights @ K[others, i]))


def inverse_inertia(width, height):
    """The deflection of a rectangular profile, which has a pole where it vanishes."""
    return 1e3 / (width * height**3)


def resonance(ratio, damping):
    return 1 / np.sqrt((1 - ratio**2) ** 2 + (2 * damping * ratio) ** 2)


def queue(arrivals, service):
    return arrivals / (service * (service - arrivals))


def second_order(load, length):
    return 1 / np.maximum(1 - load * length**2, 1e-4) - 1


def of(output, *bounds):
    """An output of variables between bounds, as one of designs in the unit cube."""
    low, high = np.transpose(bounds)
    return lambda Z: output(*(low + Z * (high - low)).T)


@pytest.mark.parametrize(
    "case",
    [
        (2, of(inverse_inertia, (1, 60), (4, 160))),
        (2, of(resonance, (0.2, 2), (1e-3, 0.1))),
        (3, lambda Z: (1 / (Z + 1e-3)).sum(axis=1)),
        *rarely(
            (2, of(queue, (0.1, 1), (1.001, 2))),
            (2, of(second_order, (0, 0.3), (0.2, 1.8))),
            (2, of(lambda width, height: 1 / (width * height**2), (1, 60), (4, 160))),
            (2, lambda Z: 1 / (abs(Z[:, 0] * Z[:, 1] - 0.1) + 1e-9)),
            (3, lambda Z: 1 / (abs(Z[:, 0] * Z[:, 1] - 0.3) + 1e-9) ** 2),
            (2, lambda Z: np.tan(1.56 * Z[:, 0]) * (1 + Z[:, 1])),
            (4, lambda Z: 1 / (Z[:, 0] + 0.002) ** 3 + Z[:, 1:].sum(axis=1)),
        ),
    ],
)
def test_beside_a_pole_predictions_are_those_of_a_reciprocal(case):
    d, output = case
    Z, y = lp_tau(128, d), output(lp_tau(128, d))
    at, errors = np.random.default_rng(0).random((1000, d)), {}
    for scale in scales(y, y, constraint=False):
        process = OutputFit.on_scale(Z, y, scale, 0.0).process(Z, scale.to(y))
        mean, width = process(at), 2 * process.deviation(at)
        predicted = scale.back(np.array([mean - width, mean, mean + width]))
        if scale.reciprocal:
            assert np.abs(predicted).max() <= 2 * y.max()
        errors[scale] = np.median(np.abs(predicted[1] - output(at)))
    assert errors[OutputFit.of(Z, y, y, constraint=False).scale] <= 1.3 * min(errors.values())
