"""Selectors in one pipeline, those of pymoo included, and several at once."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pymoo.decomposition.asf import ASF
from pymoo.decomposition.pbi import PBI
from pymoo.decomposition.tchebicheff import Tchebicheff
from pymoo.decomposition.weighted_sum import WeightedSum

from pymoo_psi import (
    CompromiseProgramming,
    EfficientSubset,
    SalukvadzeOptimum,
    TestTable,
    rank_of_efficiency,
)
from pymoo_psi.selection import compare_selectors
from tests.helpers.fronts import in_shares
from tests.helpers.refusals import refused

sets = st.one_of(
    st.tuples(st.integers(1, 20), st.integers(1, 5)).flatmap(
        lambda shape: arrays(float, shape, elements=st.integers(0, 6).map(float))
    ),
    st.tuples(st.integers(2, 40), st.integers(2, 8), st.integers(0, 2**32 - 1)).map(
        lambda t: np.random.default_rng(t[2]).random(t[:2])
    ),
)
F3 = np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]])


@given(F=sets, normalize=st.booleans(), rank=st.integers(3, 6))
def test_selectors_choose_what_the_ranking_says(F, normalize, rank):
    ranking = rank_of_efficiency(F, normalize=normalize)
    assert SalukvadzeOptimum(normalize=normalize).do(F).tolist() == ranking.salukvadze.tolist()
    chosen = EfficientSubset(rank, normalize=normalize).do(F)
    assert sorted(chosen) == np.flatnonzero(ranking.rank == rank).tolist()
    assert (np.diff(ranking.criteria[chosen, 0]) >= 0).all()


def by_hand(F, p, weights, normalize):
    """The nearest Pareto-optimal rows, from the definition of the norm.

    Sets with distances that differ by so little that the rounding of powers may decide, as 0.95^400
    leaves them, are passed over.
    """
    front, shares = in_shares(F, F.min(axis=0), normalize)
    terms = weights * shares
    if p == np.inf:
        keys = list(zip(terms.max(axis=1).round(9), terms.sum(axis=1).round(9), strict=True))
        return [i for i, key in zip(front.tolist(), keys, strict=True) if key == min(keys)]
    top = np.maximum(terms.max(axis=1), 5e-324)[:, None]
    gaps = top[:, 0] * ((terms / top) ** p).sum(axis=1) ** (1 / p)
    gaps -= gaps.min()
    assume(not ((gaps > 1e-14) & (gaps < 1e-9)).any())
    return front[gaps <= 1e-14].tolist()


@given(
    F=sets, p=st.sampled_from([1, 1.5, 2, 7, 400, np.inf]), normalize=st.booleans(), data=st.data()
)
def test_compromise_programming_agrees_with_the_oracle(F, p, normalize, data):
    weights = data.draw(arrays(float, F.shape[1], elements=st.sampled_from([1.0, 2.0, 5.0])))
    F.setflags(write=False)
    selector = CompromiseProgramming(p, weights=weights, normalize=normalize)
    assert selector.do(F).tolist() == by_hand(F, p, weights / weights.sum(), normalize)


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_rounding_errors_count_by_weight(unit):
    F = np.array([[0.0, 1e6 + 1], [1.001e-6, 1e6]]) * unit
    # The first is nearer by 1e-9, and rounding errs by 1e-16.
    assert CompromiseProgramming(1, weights=[1, 1e-6], normalize=False).do(F).tolist() == [0]
    shares = np.arange(50) / 49 * unit
    line = np.column_stack([shares, unit - shares])  # of one sum
    assert len(CompromiseProgramming(1, normalize=False).do(line)) == 50


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize("decomposition", [ASF(), Tchebicheff(), PBI(), WeightedSum()])
def test_decompositions_of_pymoo_choose_in_the_scale_said(decomposition, normalize):
    F = np.random.default_rng(7).random((60, 3)) * [1, 1e3, 1e-3] + [5, 0, -1]
    front, distances = in_shares(F, F.min(axis=0), normalize)
    selectors = {"equal": decomposition, "given": (decomposition, [0.6, 0.3, 0.1])}
    chosen = compare_selectors(pd.DataFrame(F), selectors, normalize=normalize)
    for name, weights in (("equal", np.ones(3)), ("given", np.array([0.6, 0.3, 0.1]))):
        assert chosen[name].tolist() == [front[decomposition.do(distances, weights).argmin()]]


class Fixed:
    def __init__(self, answer):
        self.answer = answer

    def do(self, F):
        F[:] = np.nan  # a selector may spoil what it is given
        return self.answer


def test_rows_are_those_of_all_designs():
    F = pd.DataFrame({"a": [9.0, 0, 1, 2, 3], "b": [9.0, 3, 2, 1, 0]})
    answers = [np.int64(1), [1, 2], np.array([2, 1, 3]), None, []]
    chosen = compare_selectors(F, dict(zip("abcde", map(Fixed, answers), strict=True)))
    # The first row is dominated: indices a selector returns count from the second.
    assert [rows.tolist() for rows in chosen.values()] == [[2], [2, 3], [3, 2, 4], [], []]


def test_a_front_of_one_design_is_chosen_whatever_the_selector():
    """pymoo's HighTradeoffPoints fails on fewer than three."""
    assert compare_selectors([[1.0, 1.0], [2.0, 3.0]], {"h": Fixed(7)})["h"].tolist() == [0]


def test_weights_of_a_decomposition_are_numbers():
    refused("ASF must be finite, got nan", compare_selectors, F3, {"ASF": (ASF(), [1, np.nan])})


def test_rows_of_a_table_are_those_of_all_tests():
    F = [[9, 9], [0, 3], [1, 1], [3, 0]]
    table = TestTable.of([1, 2, 3, 4], np.zeros((4, 0)), F).under(limits={"f1": 8})
    asked = {"best": SalukvadzeOptimum(), "ASF": ASF(), "other": Fixed(1)}
    assert table.take(SalukvadzeOptimum().do(table)).names == table.best().names == ["test 3"]
    assert [rows.tolist() for rows in compare_selectors(table, asked).values()] == [[2], [2], [2]]
    wide = TestTable.of([1, 2, 3], np.zeros((3, 0)), [[0, 100], [3, 40], [9, 0]])
    for normalize, best in ((True, 1), (False, 2)):
        stated = wide.under(normalize=normalize)
        for selector in (SalukvadzeOptimum(), CompromiseProgramming(2)):
            assert selector.do(stated).tolist() == [best]


@pytest.mark.parametrize(("ideal", "best"), [([0.0, -100.0], 0), ([3.0, 0.0], 1)])
def test_given_ranges_of_a_ranking_are_those_of_selectors(ideal, best):
    ranking = rank_of_efficiency(
        [[0.0, 9.0], [2.0, 5.0], [4.0, 1.0], [9.0, 0.0]], ideal=ideal, nadir=[4.0, 9.0]
    )
    chosen = compare_selectors(ranking, {"L2": CompromiseProgramming(2)})
    assert chosen["L2"].tolist() == ranking.salukvadze.tolist() == [best]
