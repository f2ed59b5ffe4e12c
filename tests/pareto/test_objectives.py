"""Ranks of whatever the user has: maximised objectives, data frames, published Pareto sets."""

import moocore
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import rank_of_efficiency
from pymoo_psi.pareto import RANKING_COLUMNS
from tests.helpers.draws import rarely
from tests.helpers.exact import assert_same_ranks, exact_ranking
from tests.helpers.refusals import refused

# Ties, duplicates and dominated rows are common on a grid; generic points have none.
sets = st.one_of(
    st.tuples(st.integers(1, 25), st.integers(2, 8)).flatmap(
        lambda shape: arrays(float, shape, elements=st.integers(0, 6).map(float))
    ),
    st.tuples(st.integers(2, 50), st.integers(2, 8), st.integers(0, 2**32 - 1)).map(
        lambda t: np.random.default_rng(t[2]).random(t[:2])
    ),
)


@given(data=st.data(), F=sets, normalize=st.booleans())
def test_ideal_and_nadir_are_in_the_original_directions(data, F, normalize):
    maximize = data.draw(st.lists(st.integers(0, F.shape[1] - 1), unique=True))
    F.setflags(write=False)
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    upwards = np.isin(np.arange(F.shape[1]), maximize)
    low, high = F[ranking.pareto].min(axis=0), F[ranking.pareto].max(axis=0)
    np.testing.assert_array_equal(ranking.ideal, np.where(upwards, high, low))
    np.testing.assert_array_equal(ranking.nadir, np.where(upwards, low, high))
    ends = {"ideal": ranking.ideal, "nadir": ranking.nadir}
    again = rank_of_efficiency(F, normalize=normalize, maximize=maximize, **ends)
    np.testing.assert_array_equal(again.criteria, ranking.criteria)


PUBLISHED = [
    "input1.dat",
    "ran.10pts.9d.10",
    "spherical-250-10-3d.txt.xz",
    "uniform-250-10-3d.txt.xz",
    "wrots_l10w100_dat.xz",
    "wrots_l100w10_dat.xz",
    "CPFs.txt.xz",
]


def published(name):
    """The data sets that ship with moocore: the first set of each, and parts of two as one."""
    data = moocore.get_dataset(name)
    return data[data[:, -1] == 1, :-1], data[:300, :-1]


@pytest.mark.parametrize("name", [*PUBLISHED[:3], *rarely(*PUBLISHED[3:])])
def test_published_sets(name):
    for F in published(name):
        exact, ranking = exact_ranking(F), rank_of_efficiency(F)
        assert exact.decided
        assert_same_ranks(ranking, exact)
        np.testing.assert_allclose(ranking.criteria, exact.criteria, atol=1e-13)


def test_a_data_frame_keeps_its_names_and_values():
    designs = pd.DataFrame(
        {"cost [€]": [1, 2, 5, 6], "Ertrag": [10.0, 30.0, 40.0, 5.0]}, index=["A", "B", "C", "D"]
    )
    ranking = rank_of_efficiency(designs, maximize=["Ertrag"])
    frame = ranking.to_frame()
    assert frame.columns.tolist() == ["place", "cost [€]", "Ertrag", *RANKING_COLUMNS[1:]]
    assert frame.index.tolist() == ["B", "A", "C", "D"]
    pd.testing.assert_frame_equal(
        frame[["cost [€]", "Ertrag"]].loc[designs.index], designs.astype(float)
    )
    assert ranking.salukvadze.tolist() == [1]  # positions, as in every array


def test_other_kinds_of_columns():
    frame = pd.DataFrame({"a": pd.array([1, 2], dtype="Int64"), "b": [1.5, 0.5]})
    assert rank_of_efficiency(frame).pareto.all()
    assert rank_of_efficiency(
        pd.DataFrame(np.eye(2), columns=[5, 0]), maximize=[5]
    ).ideal.tolist() == [1.0, 0.0]
    frame.loc[0, "a"] = pd.NA
    refused(r"F must be finite, got nan at index \[0, 0\]", rank_of_efficiency, frame)
