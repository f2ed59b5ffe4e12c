"""The covering radius against the definition on a fine grid."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pymoo_psi import lp_tau
from pymoo_psi.sequences import covering_radius


def grid(d, n):
    return np.array(np.meshgrid(*[np.linspace(0, 1, n)] * d)).reshape(d, -1).T


@pytest.mark.parametrize(("d", "n"), [(1, 2001), (2, 301), (3, 46)])
@pytest.mark.parametrize("count", [1, 2, 5, 64])
def test_it_is_the_distance_of_the_farthest_place(d, n, count):
    places, step = grid(d, n), 1 / (n - 1)
    random = np.random.default_rng(count).random((count, d))
    for points in (lp_tau(count, d), random, np.vstack([random, random[:1]])):
        farthest = cKDTree(points).query(places)[0].max()
        # the farthest place of all is within half a diagonal of a cell from one of the grid
        assert farthest - 1e-12 <= covering_radius(points) <= farthest + step * np.sqrt(d) / 2


def test_points_on_a_line_have_one_too():
    points = np.column_stack([np.linspace(0, 1, 9), np.full(9, 0.5), np.full(9, 0.5)])
    assert covering_radius(points) == pytest.approx(np.sqrt(0.5 + 1 / 256), rel=0.02)


def test_in_many_dimensions_it_is_at_least_that_of_a_corner():
    corner = np.sqrt(((1 - lp_tau(256, 8)) ** 2).sum(axis=1)).min()
    radius = covering_radius(lp_tau(256, 8))
    assert corner <= radius <= np.sqrt(8)
    assert covering_radius(lp_tau(1024, 8)) < radius
