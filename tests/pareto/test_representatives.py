"""A few designs for many: the bound of farthest-first traversal against all choices there are."""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import rank_of_efficiency, representatives
from tests.helpers.fronts import in_shares


def distances(F, normalize):
    """Of all pairs of Pareto-optimal rows, and which rows these are."""
    front, points = in_shares(F, normalize=normalize)
    return front, np.linalg.norm(points[:, None] - points, axis=2)


@given(
    F=st.tuples(st.integers(1, 10), st.integers(1, 4)).flatmap(
        lambda shape: arrays(float, shape, elements=st.integers(0, 9).map(float))
    ),
    k=st.integers(1, 4),
    normalize=st.booleans(),
)
def test_no_choice_covers_with_less_than_half_the_radius(F, k, normalize):
    ranking = rank_of_efficiency(F, normalize=normalize)
    front, apart = distances(F, normalize)
    few = representatives(F, k, normalize=normalize)
    assert few.rows[0] == ranking.salukvadze[0]
    assert ranking.pareto[few.rows].all()
    best = min(
        apart[:, list(chosen)].min(axis=1).max()
        for chosen in combinations(range(len(front)), min(k, len(front)))
    )
    assert few.radius <= 2 * best + 1e-12
    # All designs that differ are chosen before any is chosen twice.
    assert len(few.rows) == min(k, len(np.unique(F[front], axis=0)))

    # Each stands for those that are nearest to it.
    to = apart[:, np.searchsorted(front, few.rows)]
    owner = (to <= to.min(axis=1, keepdims=True) + 1e-12).argmax(axis=1)
    assert few.shares.tolist() == pytest.approx(
        np.bincount(owner, minlength=len(few.rows)) / len(front)
    )
    assert few.shares.sum() == pytest.approx(1)
    assert few.radius == pytest.approx(to.min(axis=1).max())


def test_labels_and_senses_are_kept():
    F = pd.DataFrame({"cost": [1, 2, 5, 9], "yield": [10, 30, 40, 5]}, index=list("ABCD"))
    few = representatives(F, 2, maximize=["yield"])
    assert F.index[few.rows].tolist() == ["B", "C"]  # C and A are 0.822 and 0.712 from B
    assert few.shares.tolist() == pytest.approx([2 / 3, 1 / 3])
