"""Tests of differences between algorithms, against counting and textbooks."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi.comparison import holm, p_value


def test_holm_against_the_textbook():
    # Holm (1979): 0.005, 0.01, 0.03, 0.04 of four tests.
    np.testing.assert_allclose(holm(np.array([0.01, 0.04, 0.03, 0.005])), [0.03, 0.06, 0.06, 0.02])
    assert np.isnan(holm(np.array([0.5, np.nan]))[1])
    assert holm(np.array([0.5, np.nan]))[0] == 0.5


LOW, HIGH, ONE = np.arange(5.0), np.arange(5.0) + 10, np.array(0.0)


@pytest.mark.parametrize(
    ("a", "b", "p"),
    [
        (LOW, HIGH, 2 / 252),  # All orders are equally likely: 2 of C(10, 5) are as far apart.
        (ONE - 1, LOW, 2 / 32),  # Against one value: 2 of 2^5 signs.
        (LOW, ONE - 1, 2 / 32),
        (ONE, np.zeros(5), 1),
        (ONE, ONE + 10, np.nan),
    ],
)
def test_p_values_by_counting(a, b, p):
    assert p_value(a, b) == pytest.approx(p, nan_ok=True)


def by_counting(a, b):
    """The two-sided p value over all choices of runs, as a fraction."""
    everything = [*a, *b]
    ranks = [
        sum(Fraction(other < value) for other in everything)
        + sum(Fraction(other == value) for other in everything) / 2
        for value in everything
    ]
    observed = sum(ranks[: len(a)])
    sums = [sum(chosen) for chosen in itertools.combinations(ranks, len(a))]
    lower = Fraction(sum(value <= observed for value in sums), len(sums))
    upper = Fraction(sum(value >= observed for value in sums), len(sums))
    return min(Fraction(1), 2 * min(lower, upper))


tied = st.lists(st.sampled_from([0.0, 1.0, 1.5, 7.0, np.inf]), min_size=1, max_size=6)


@given(tied, tied)
def test_p_values_of_tied_runs_are_exact(a, b):
    p = p_value(np.array(a), np.array(b))
    assert p == pytest.approx(float(by_counting(a, b)), rel=1e-14)
    assert p_value(np.array(b), np.array(a)) == pytest.approx(p, rel=1e-14)


def test_a_thousand_runs_have_p_values():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=1100), 0.5 + rng.normal(size=1100)
    assert p_value(a, b) < 1e-20
