"""Selectors that hold a preference: by their definitions, and against other packages."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import (
    CompromiseProgramming,
    EfficientSubset,
    Knee,
    ReferencePoint,
    SalukvadzeOptimum,
    rank_of_efficiency,
)
from pymoo_psi.selection import compare_selectors
from tests.helpers.fronts import in_shares
from tests.helpers.refusals import refused


@given(
    F=st.tuples(st.integers(1, 12), st.integers(1, 4)).flatmap(
        lambda shape: arrays(float, shape, elements=st.integers(0, 6).map(float))
    ),
    normalize=st.booleans(),
    data=st.data(),
)
def test_the_reference_point_by_its_definition(F, normalize, data):
    point = data.draw(arrays(float, F.shape[1], elements=st.integers(-3, 9).map(float)))
    weights = data.draw(arrays(float, F.shape[1], elements=st.sampled_from([1.0, 2.0, 5.0])))
    front, d = in_shares(F, point, normalize)
    keys = [(round(max(t), 9), round(sum(t), 9)) for t in (d * weights).tolist()]
    expected = [i for i, key in zip(front.tolist(), keys, strict=True) if key == min(keys)]
    assert ReferencePoint(point, weights=weights, normalize=normalize).do(F).tolist() == expected


@given(F=arrays(float, (9, 2), elements=st.integers(0, 20).map(float)))
def test_a_knee_is_the_least_sum_where_it_bulges(F):
    _, d = in_shares(F, rank_of_efficiency(F).ideal)
    expected = CompromiseProgramming(1).do(F).tolist() if d.sum(axis=1).min() < 1 - 1e-9 else []
    if np.isfinite(d).all() and d.any(axis=0).all():
        assert Knee().do(F).tolist() == expected


@pytest.mark.parametrize("m", [2, 3, 6])
def test_the_dent_in_a_plane_is_its_knee(m):
    """Shares of one are a plane; the third design is drawn from it towards the ideal."""
    shares = np.vstack([np.eye(m), np.random.default_rng(m).dirichlet(np.ones(m), 30)])
    assert Knee().do(shares).tolist() == []
    dented = shares * np.where(np.arange(m + 30) == m + 2, 0.9, 1.0)[:, None]
    for units in (np.ones(m), 10.0 ** np.arange(m)):
        assert Knee().do(dented * units + 7).tolist() == [m + 2]
    assert Knee().do(shares**0.5).tolist() == []  # bulges away from the ideal
    assert Knee().do(shares**2).shape == (1,)


CURVE = [[share, share, (1 - share) ** 2] for share in np.linspace(0, 1, 9)]


@pytest.mark.parametrize(
    "F",
    [
        CURVE,  # whose extremes span no plane
        CURVE[:1],
        [[0.0], [1.0]],
        [[1.0, 1.0], [1.0, 1.0]],
        # One weight of the plane through the extremes is negative: a loss counts as a gain.
        [[3, 4, 6], [4, 2, 4], [5, 0, 3], [0, 5, 3]],
        [[0, 0, 6], [4, 4, 3], [2, 2, 5], [5, 1, 1]],
        [[6, 0, 0], [4, 1, 5], [0, 6, 1], [2, 2, 0]],
    ],
)
def test_sets_without_a_knee(F):
    assert Knee().do(np.array(F, dtype=float)).tolist() == []


SELECTORS = {
    "Salukvadze": SalukvadzeOptimum(),
    "rank 5": EfficientSubset(5),
    "weights": CompromiseProgramming(1, weights=[3, 1]),
    "Chebyshev": CompromiseProgramming(np.inf),
    "knee": Knee(),
}


@given(F=arrays(float, (9, 2), elements=st.integers(0, 20).map(float)))
def test_directions_do_not_matter(F):
    cost = pd.DataFrame(F, columns=["cost", "yield"])
    gain = cost.assign(**{"yield": 7 - cost["yield"]})
    selectors = SELECTORS | {"aspiration": ReferencePoint([3.0, -1.0])}
    turned = SELECTORS | {  # by name
        "weights": CompromiseProgramming(1, weights={"yield": 1, "cost": 3}),
        "aspiration": ReferencePoint(pd.Series({"yield": 8.0, "cost": 3.0})),
    }
    for name, selector in selectors.items():
        found = turned[name].do(gain, maximize=["yield"])
        np.testing.assert_array_equal(found, selector.do(cost))
    other = compare_selectors(gain, turned, maximize=["yield"])
    np.testing.assert_equal(other, compare_selectors(cost, selectors))


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: EfficientSubset(7).do(np.eye(2)), ValueError, "rank must be 0, 3, 4, 5 or 6, got 7"),
        (lambda: CompromiseProgramming(0.5), ValueError, "p must be a number from 1 to inf, got 0.5"),
        (lambda: CompromiseProgramming("2"), ValueError, "p must be a number from 1 to inf, got '2'"),
        (lambda: CompromiseProgramming(weights=[1, -1]).do(np.eye(2)), ValueError, "weights must be a list of numbers >= 0"),
        (lambda: ReferencePoint([1, 2, 3]).do(np.eye(2)), ValueError, r"point must be of shape \(2,\)"),
    ],
)  # fmt: skip
def test_mistakes(call, kind, message):
    refused(message, call, error=kind)
