"""Rounding does not decide: dominance and ranks against exact rational arithmetic."""

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import cautions, rank_of_efficiency
from tests.helpers.exact import assert_same_ranks, exact_ranking
from tests.helpers.fronts import on_sphere

EPS = 2.0**-52
shapes = st.tuples(st.integers(1, 24), st.integers(1, 8))
seeds = st.integers(0, 2**32 - 1)


def drawn(make):
    """Sets that a random generator makes; no two values are close by chance."""
    return st.tuples(shapes, seeds).map(lambda t: make(np.random.default_rng(t[1]), *t[0]))


def grids(high, unit=1.0, shapes=shapes):
    return shapes.flatmap(
        lambda shape: arrays(float, shape, elements=st.integers(0, high).map(lambda k: k * unit))
    )


def on_scales(rng, n, m):
    """Objectives up to 18 orders of magnitude apart, none of the designs far from optimal."""
    return on_sphere(rng, n, m) * 10.0 ** rng.choice([-9, 0, 9], m)


def with_constants(rng, n, m):
    F = rng.integers(0, 7, (n, m)).astype(float)
    F[:, 0] = 10.0 ** rng.integers(-300, 300) * (1 + 1e-15 * rng.standard_normal(n))
    return F


KINDS = {
    "generic": drawn(lambda rng, n, m: rng.standard_normal((n, m))),
    "tied": grids(6),
    "clustered": drawn(
        lambda rng, n, m: rng.integers(1, 5, (n, m)) + 1e-15 * rng.integers(0, 4, (n, m))
    ),
    "1e+300": drawn(lambda rng, n, m: 1e300 * rng.standard_normal((n, m))),
    "mixed scales": drawn(on_scales),
    "mixed scales, tied": drawn(
        lambda rng, n, m: rng.integers(0, 5, (n, m)) * 10.0 ** rng.choice([-9, 0, 9], m)
    ),
    "600 orders apart": drawn(lambda rng, n, m: on_sphere(rng, n, m) * 10.0 ** rng.choice([-300, 0, 300], m)),
    "magnitudes within an objective": drawn(lambda rng, n, m: 10.0 ** rng.uniform(-20, 20, (n, m))),
    "constant columns": drawn(with_constants),
    "one distance from U": drawn(on_sphere),
    "one plane": drawn(lambda rng, n, m: rng.dirichlet(np.ones(m), n)),
    "large offset": drawn(lambda rng, n, m: 1e6 + rng.random((n, m))),
    "any floats": shapes.flatmap(
        lambda shape: arrays(float, shape, elements=st.floats(-1e307, 1e307))
    ),
    "neighbouring floats": drawn(
        lambda rng, n, m: 1 + rng.integers(0, 400, (n, m)) * EPS * rng.integers(0, 2, m)
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data(), normalize=st.booleans())
def test_ranks_agree_with_exact_arithmetic(kind, data, normalize):
    F = data.draw(KINDS[kind])
    maximize = data.draw(st.lists(st.integers(0, F.shape[1] - 1), unique=True))
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    assert {*ranking.rank} <= {0, 3, 4, 5, 6}
    assert ranking.pareto[ranking.salukvadze].all()
    assert (ranking.place[ranking.rank == 6] == 1).all()
    assert sorted(ranking.salukvadze) == np.flatnonzero(ranking.place == 1).tolist()
    exact = exact_ranking(F, normalize=normalize, maximize=maximize)
    event(f"decided: {exact.decided}")
    if exact.decided:
        assert_same_ranks(ranking, exact)
        expected = exact.criteria[ranking.pareto]
        error = np.abs(ranking.criteria[ranking.pareto] - expected)
        assert (error <= 1e-9 * np.abs(expected) + exact.noise + 2e-323).all()


A, B = 0.1 + 0.2, 0.3  # 0.30000000000000004 and 0.3

HARD = {
    "one design": ([[3.0, -4.0]], [6]),
    "two designs": ([[0.0, 1.0], [1.0, 0.0]], [6, 6]),
    "two designs an ulp apart": ([[1.0, 1.0 + EPS], [1.0 + EPS, 1.0]], [6, 6]),
    "all equal": ([[2.0, 5.0]] * 3, [6, 6, 6]),
    "a catalogue with noise": (
        [[0.0, 1.0, A], [0.3, 0.4, B], [1.0, 0.0, A], [0.3, 0.4, A], [0.3, 0.4, 2 * B]],
        [0, 6, 0, 6, 0],
    ),
    "a penalty hides nothing": ([[1e-9, 3.0], [2e-9, 2.0], [1e20, 1.0], [3e-9, 2.5]], [0, 6, 0, 0]),
    "the largest floats": ([[0.0, 1.7e308], [1e307, 1e307], [1.7e308, 0.0]], [0, 6, 0]),
    "huge beside tiny": (
        [[0.0, 1e-300], [2e299, 5e-301], [5e299, 3e-301], [1e300, 0.0]],
        [0, 6, 4, 0],
    ),
    "negative and around zero": ([[-1.0, 1.0], [-0.4, -0.4], [1.0, -1.0]], [0, 6, 0]),
}


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize(("F", "rank"), HARD.values(), ids=HARD)
def test_hard_cases(F, rank, normalize):
    assert rank_of_efficiency(F).rank.tolist() == rank
    exact = exact_ranking(np.array(F), normalize=normalize)
    assert exact.decided
    assert rank_of_efficiency(F, normalize=normalize).rank.tolist() == exact.rank


@given(
    seed=seeds,
    n=st.integers(5, 20),
    size=st.sampled_from([1e-290, 0.3, -7.0, 1e9]),
    normalize=st.booleans(),
)
def test_noise_in_a_constant_objective_has_no_range(seed, n, size, normalize):
    """Two designs of equal cost, computed in two ways, are not the two ends of a range."""
    rng = np.random.default_rng(seed)
    F = on_sphere(rng, n, 2)
    noisy = np.column_stack([F, size * (1 + 1e-15 * rng.standard_normal(n))])
    said, expected = (
        [
            str(c)
            for c in cautions(values, normalize=normalize)
            if c.kind not in ("constant", "weights")
        ]
        for values in (noisy, F)  # of three weights other shares are equal within a factor of two
    )
    assert said == expected
    ends = {"ideal": noisy.min(axis=0), "nadir": noisy.max(axis=0)}
    given_ends = rank_of_efficiency(noisy, normalize=normalize, **ends)
    assert given_ends.rank.tolist() == rank_of_efficiency(F, normalize=normalize).rank.tolist()
