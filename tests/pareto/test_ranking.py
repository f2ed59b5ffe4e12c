"""Ranks of efficiency: their invariances, obvious cases, and what is refused."""

import itertools

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi import TestTable, cautions, explain, rank_of_efficiency, read_table
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import nondominated
from tests.helpers.exact import best_rows
from tests.helpers.refusals import refused


def test_designs_of_one_place_keep_their_order():
    """Though their distances differ by rounding."""
    F = 7.1 + np.array([*itertools.permutations([0.1, 0.2, 0.3, 0.7, 0.9])])
    assert rank_of_efficiency(F).by_place.tolist() == list(range(120))


@pytest.mark.parametrize("normalize", [True, False])
def test_distances_of_designs_that_one_dominates_need_a_range(normalize):
    frame = rank_of_efficiency([[1, 1], [2, 1], [300, 4]], normalize=normalize).to_frame()
    assert frame["mu1"].isna().tolist() == [False, normalize, normalize]


CURVE = np.array([[0.0, 1.0], [0.25, 0.5], [1.0, 0.0]])


@pytest.mark.parametrize(
    ("ideal", "is_narrow"),
    [([-1.0, 0.0], False), ([0.5, 0.0], True), ([0.5, 2.0], True), ([0.0, 2.0], True)],
)
def test_given_ideal_and_nadir(ideal, is_narrow):
    """Designs that are better than the ideal point in an objective are not far from it there."""
    ranking = rank_of_efficiency(CURVE, ideal=ideal, nadir=[1.0, 2.0])
    lengths = np.subtract([1.0, 2.0], ideal)
    distances = np.maximum(CURVE - ideal, 0) / np.where(lengths, lengths, 1)
    np.testing.assert_allclose(ranking.criteria[:, 0], np.hypot(*distances.T))
    assert ("ranges" in [caution.kind for caution in cautions(ranking)]) == is_narrow
    for row in range(3):
        behind = np.maximum(CURVE[row] - ideal, 0)
        np.testing.assert_array_equal(explain(ranking, row).behind, behind)
    assert [explain(ranking, row).best_in for row in range(3)] == [["f1"], [], ["f2"]]


@pytest.mark.parametrize("given", ["ideal", "nadir"])
def test_one_given_point_fixes_the_frame(given):
    both = {"ideal": [0.0, 0.0], "nadir": [1.0, 1.0]}
    both[given] = {"ideal": [-1.0, -3.0], "nadir": [2.0, 4.0]}[given]
    expected = rank_of_efficiency(CURVE, **both)
    # It stays where the other point is given later, and where distances are plain.
    one = {given: both.pop(given)}
    ranking = rank_of_efficiency(CURVE, **one)
    of_ranking = rank_of_efficiency(rank_of_efficiency(CURVE), **one)
    for found in (ranking, of_ranking, rank_of_efficiency(ranking, **both)):
        np.testing.assert_array_equal(found.criteria, expected.criteria)
    assert rank_of_efficiency(ranking, normalize=False).frame.is_fixed


def test_a_table_is_ranked_under_its_formulation():
    F = [[0, 9], [1, 1], [2, 0]]
    table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], F).under(normalize=False)
    plain = rank_of_efficiency(F, normalize=False)
    np.testing.assert_array_equal(rank_of_efficiency(table).criteria, plain.criteria)
    normalized = rank_of_efficiency(table, normalize=True)
    np.testing.assert_array_equal(normalized.criteria, rank_of_efficiency(F).criteria)
    fixed = table.under(ranges={"f1": (0, 9), "f2": (0, 9)})
    assert rank_of_efficiency(fixed, normalize=True).nadir.tolist() == [9, 9]


@given(
    seed=st.integers(0, 2**32 - 1),
    m=st.integers(1, 6),
    levels=st.sampled_from([2, 5, 1000]),
    n=st.sampled_from([70, 300]),
    size=st.sampled_from([1.0, 1e300, 1e-300]),
)
def test_nondominated_agrees_with_all_pairs(seed, m, levels, n, size):
    """Many values are equal, and some are a zero with a sign."""
    rng = np.random.default_rng(seed)
    F = np.round(rng.dirichlet(np.ones(m), size=rng.integers(0, n)) * levels) * size
    F[rng.random(F.shape) < 0.02] = -0.0
    assert nondominated(F).tolist() == best_rows(F)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_nondominated_refuses_what_has_no_order(value):
    refused("F must be finite", nondominated, np.array([[1.0, value]]), error=ArgumentValueError)


def test_a_dense_front_is_no_chain_of_ties():
    """Neighbours closer than the rounding of a large offset do not make one level of all."""
    x = np.linspace(0, 1, 20_001)
    ranking = rank_of_efficiency(np.column_stack([1.7e9 + x, 1 - np.sqrt(x)]))
    # Times around 1.7e9 are spaced by 2.4e-7, and their range of 1 is the unit of distances.
    assert np.ptp(ranking.criteria[ranking.salukvadze, 0]) < 20 * np.spacing(1.7e9)
    assert len(ranking.salukvadze) < 200


FRAME = pd.DataFrame({"cost": [1.0, 2.0], "mass": [2.0, 1.0]})


@pytest.mark.parametrize(
    ("F", "options", "kind", "message"),
    [
        ([[1.0, np.nan]], {}, ValueError, r"F must be finite, got nan at index \[0, 1\]; leave out"),
        ([["a", "b"]], {}, TypeError, r"F must be an array of real numbers, got \[\['a', 'b'\]\]"),
        (np.ma.masked_equal([[1.0, 2.0], [2.0, 1.0]], 1.0), {}, ValueError, "F must be without masked"),
        (None, {}, TypeError, "None if it found no feasible design"),
        (np.zeros((0, 2)), {}, ValueError, r"one or more of each, got shape \(0, 2\); use F"),
        (FRAME.assign(in_stock=[True, False]), {}, TypeError, "'in_stock' of F must be of real numbers"),
        (FRAME, {"nadir": [3.0, 0.0]}, ValueError, "nadir must be no better than the ideal"),
        (FRAME, {"maximize": ["costs"]}, ValueError, "'costs'; did you mean 'cost'"),
        (FRAME.set_axis(["a", "a"], axis=1), {"maximize": ["a"]}, ValueError, "maximize must be names that only one column has"),
    ],
)  # fmt: skip
def test_mistakes(F, options, kind, message):
    refused(message, rank_of_efficiency, F, error=kind, **options)


@pytest.mark.parametrize("names", [["F", "opt"], ["feasible_ranking", "trades"], ["opt", "get"]])
def test_a_frame_is_a_frame_whatever_its_columns_are_called(names):
    frame = pd.DataFrame([[1.0, 2.0], [2.0, 1.0], [3.0, 3.0]], columns=names)
    expected, ranking = rank_of_efficiency(frame.to_numpy()), rank_of_efficiency(frame)
    assert ranking.objectives.names == tuple(names)
    np.testing.assert_array_equal(ranking.place, expected.place)
    assert explain(frame).sentences == explain(frame, row=int(expected.salukvadze[0])).sentences
    assert read_table(frame).schema.objectives == tuple(names)
