"""The Gaussian processes of the surrogates against linear algebra written out, and their values.

No proposal shows these clearly enough, so that these tests look at the functions themselves.
"""

import numpy as np
import pytest

from pymoo_psi.algorithms._surrogate_models import Covariance, GaussianProcess, Kernel

N, D = 12, 3
LENGTHS = np.log([0.4, 0.9, 2.0])
BENDS = np.array([0.5, 0.01, -1.5])
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
    return GaussianProcess(Covariance(Z, Kernel(LENGTHS, BENDS, SHARES[:1], SHARES[1:])), t)


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


def test_what_is_left_out_is_predicted_from_the_others(tests, process):
    """Each value from all others, with the mean and the variance of all (equation 5.12)."""
    Z, t = tests
    K = covariances(Z, Z) + np.exp(SHARES[0]) * np.eye(N)
    for i, (mean, variance) in enumerate(zip(*process.left_out(), strict=True)):
        others = np.delete(np.arange(N), i)
        weights = np.linalg.solve(K[np.ix_(others, others)], K[others, i])
        assert mean == pytest.approx(process.mean + weights @ (t[others] - process.mean))
        assert variance == pytest.approx(process.variance * (K[i, i] - weights @ K[others, i]))
