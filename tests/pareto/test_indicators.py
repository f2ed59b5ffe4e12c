"""Indicators of the quality of a set, against their definitions."""

import itertools

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi.comparison import Reference
from pymoo_psi.pareto import UtopianFrame, hypervolume, spread_subset
from tests.helpers.draws import rarely

points = arrays(
    np.float64, st.tuples(st.integers(1, 8), st.just(2)), elements=st.integers(-1, 6).map(float)
)


@given(points)
@example(np.array([[5.0, 0.0]]))  # none is better than the reference
def test_hypervolume_is_the_share_of_grid_cells_dominated(F):
    cells = list(itertools.product(range(5), range(5)))
    dominated = [any(f[0] <= a and f[1] <= b for f in F) for a, b in cells]
    assert hypervolume(F.tolist(), 5.0) == (pytest.approx(np.mean(dominated)), 0.0)


@pytest.mark.parametrize("size", [(1, 40), (300, 8), (40, 16), (5, 17), *rarely((2000, 6))])
def test_what_would_take_long_is_sampled(size):
    """Of the plane sum f = 1, n random points; of one point the volume is known."""
    n, m = size
    F = np.random.default_rng(m).dirichlet(np.ones(m), n)
    share, error = hypervolume(F, 1.1)
    assert (share, error) == pytest.approx(hypervolume(F[::-1], 1.1), rel=1e-12)
    slow = np.random.default_rng(0).random((4_000, m)) * 1.1
    dominated = np.mean([(place >= F).all(axis=1).any() for place in slow])
    assert share == pytest.approx(dominated, abs=4 * (error + 0.5 / np.sqrt(len(slow))))
    assert (error > 0) == (n > 1)
    assert hypervolume(F[:1], 1.1)[0] == pytest.approx(np.prod(1 - F[0] / 1.1))


@given(points, points)
def test_igd_plus_and_epsilon_by_their_definitions(F, R):
    found = Reference(UtopianFrame(np.zeros(2), np.ones(2), True), R, R[0]).measure(F)
    distances = [min(np.linalg.norm(np.maximum(f - r, 0)) for f in F) for r in R]
    assert found["igd_plus"] == pytest.approx(np.mean(distances))
    assert found["epsilon"] == pytest.approx(max(min(max(f - r) for f in F) for r in R))


@given(arrays(np.float64, (40, 3), elements=st.floats(0, 1)), st.integers(3, 12))
def test_a_spread_subset_covers_half_as_well_as_any(F, size):
    chosen = spread_subset(F, size)
    assert len(set(chosen.tolist())) <= len(chosen) == size
    assert set(F.argmin(axis=0).tolist()) <= set(chosen.tolist())
    gaps = np.linalg.norm(F[:, None] - F[chosen], axis=2).min(axis=1)
    # Gonzalez: the points chosen after the best of each objective are this far apart, so that no
    # choice of so many points could cover them all closer than half.
    later = F[chosen[3:]]
    if len(later) > 1:
        apart = np.linalg.norm(later[:, None] - later, axis=2)[~np.eye(len(later), dtype=bool)]
        assert gaps.max() <= apart.min() + 1e-9
