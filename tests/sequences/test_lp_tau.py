"""LPτ against its published points, its defining properties and a slow oracle."""

import json
from importlib import resources

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi import lp_tau
from pymoo_psi.sequences import MAX_DIMENSIONS
from tests.helpers.refusals import refused

DATA = json.loads(
    resources.files("pymoo_psi").joinpath("lp_tau_directions.json").read_text("utf-8")
)


def oracle(number, n_dim):
    """One point by the definition, digit by digit: exclusive or of m_k / 2^k as integers."""
    index, point = number - 1, []
    for entry in DATA["dimensions"][:n_dim]:
        m, s, value = list(entry["m"]), entry["degree"], 0
        for k in range(len(m), 32):
            new = 1 if s == 0 else m[k - s] ^ (m[k - s] << s)
            for q, bit in enumerate(
                format(entry["poly_inner"], "b").zfill(s - 1) if s > 1 else "", 1
            ):
                if bit == "1":
                    new ^= m[k - q] << q
            m.append(new)
        for k in range(32):
            value ^= (index >> k & 1) * m[k] << (31 - k)
        point.append(value / 2**32)
    return point


def test_published_points():
    points = lp_tau(6, 6)
    for number, expected in DATA["check_points_6d"].items():
        np.testing.assert_array_equal(points[int(number) - 1], expected)
    np.testing.assert_array_equal(points[0], np.zeros(6))


@given(number=st.integers(1, 2**31), n_dim=st.integers(1, MAX_DIMENSIONS))
def test_any_point_agrees_with_the_definition(number, n_dim):
    np.testing.assert_array_equal(lp_tau(1, n_dim, first=number)[0], oracle(number, n_dim))


@given(n=st.integers(0, 300), n_dim=st.integers(1, MAX_DIMENSIONS), data=st.data())
def test_a_later_start_continues_the_sequence(n, n_dim, data):
    k = data.draw(st.integers(0, n))
    first = data.draw(st.integers(1, 10**6))
    whole = lp_tau(n, n_dim, first=first)
    np.testing.assert_array_equal(whole[k:], lp_tau(n - k, n_dim, first=first + k))


def test_every_coordinate_fills_the_binary_grid():
    """2^m points have all multiples of 2^-m as coordinates, in each of the 51 dimensions."""
    points = np.sort(lp_tau(1024, MAX_DIMENSIONS), axis=0)
    np.testing.assert_array_equal(points, np.repeat(np.arange(1024)[:, None] / 1024, 51, axis=1))


@pytest.mark.parametrize("first", [1, 257, 513])
def test_two_dimensions_are_a_zero_net(first):
    """Each elementary rectangle of area 1/256 holds exactly one of 256 aligned points."""
    points = lp_tau(256, 2, first=first)
    for k in range(9):
        cells = np.floor(points * [2**k, 2 ** (8 - k)]).astype(int)
        assert len({tuple(cell) for cell in cells}) == 256


def test_the_last_point_has_a_number():
    assert lp_tau(1, 51, first=2**52).max() < 1


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        ((-1, 2), ValueError, "n_points must be an integer >= 0, got -1"),
        ((2.5, 2), TypeError, "n_points must be an integer >= 0, got 2.5"),
        ((4, 0), ValueError, "n_dim must be an integer >= 1, got 0"),
        ((4, 52), ValueError, "n_dim must be at most 51 for LPτ, got 52; use QMCSampling"),
    ],
)
def test_bad_arguments(arguments, kind, message):
    refused(message, lp_tau, *arguments, error=kind)
