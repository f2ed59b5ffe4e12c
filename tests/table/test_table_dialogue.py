"""Histograms and refined boxes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import TestTable, lp_tau
from pymoo_psi.analysis import histogram
from pymoo_psi.table import Schema
from tests.helpers.refusals import refused

ring = lp_tau(512, 2)
RING = TestTable.of(
    np.arange(1, 513),
    ring,
    np.column_stack([ring[:, 0], 1 - ring[:, 1], ring.sum(axis=1)]),
    G=np.abs(ring - 0.5).max(axis=1, keepdims=True) - 0.3,  # feasible in [0.2, 0.8]^2
    schema=Schema.of(2, 3, 1, lower=[0.0, 0.0], upper=[1.0, 1.0]),
)
MIXED = TestTable.of(
    [1, 2, 3, 4],
    [
        {"size": 0.5, "teeth": np.int64(12), "hard": np.bool_(True), "steel": np.str_("C45"), "code": 1},
        {"size": 1.5, "teeth": 17, "hard": False, "steel": "C60", "code": "1"},
        {"size": 0.7, "teeth": 14, "hard": True, "steel": "C45", "code": 1.5},
        {"size": 0.9, "teeth": 12, "hard": True, "steel": "16MnCr5", "code": True},
    ],
    [[1.0], [2.0], [3.0], [4.0]],
    G=[[0.0], [-1.0], [-1.0], [1.0]],
    schema=Schema.of(
        ["size", "teeth", "hard", "steel", "code"], 1, 1,
        lower=[0.0, 10, *[np.nan] * 3], upper=[2.0, 20, *[np.nan] * 3],
    ),
)  # fmt: skip


# Histograms


@given(
    column=arrays(float, st.integers(0, 30), elements=st.floats(-3, 3)),
    bins=st.integers(1, 7),
    boxed=st.booleans(),
    limit=st.floats(-3, 3),
)
def test_a_histogram_counts_every_design_once(column, bins, boxed, limit):
    box = {"lower": [-2.0], "upper": [2.0]} if boxed else {}
    F = np.column_stack([column, -column])
    table = TestTable.of(range(1, len(F) + 1), F[:, :1], F, schema=Schema.of(1, 2, **box))
    limited = table.under(limits={"f1": limit})
    seen = histogram(limited, "x1", bins=bins)
    optimal = limited.pareto()[limited.ranked_as]  # with the repeated tests of a design
    masks = (np.ones(len(table), dtype=bool), limited.feasible(), optimal)
    expected = [np.histogram(column[mask], seen.edges)[0] for mask in masks]
    np.testing.assert_array_equal([seen.tested, seen.feasible, seen.pareto], expected)
    assert seen.tested.sum() == len(table)
    assert len(seen.edges) == bins + 1
    assert (np.diff(seen.edges) > 0).all()
    assert not boxed or seen.edges[0] <= -2 < 2 <= seen.edges[-1]


@pytest.mark.parametrize(
    ("variable", "values", "tested", "feasible"),
    [
        ("teeth", (12, 14, 17), [2, 1, 1], [1, 0, 1]),
        ("steel", ("16MnCr5", "C45", "C60"), [1, 2, 1], [0, 1, 1]),
        ("code", (True, 1, 1.5, "1"), [1] * 4, [0, 1, 0, 1]),
    ],
)
def test_a_choice_has_one_bin_for_each_value(variable, values, tested, feasible):
    bins = histogram(MIXED.under(limits={"f1": 2.0}), variable)
    assert [(type(v), v) for v in bins.values] == [(type(v), v) for v in values]
    assert (bins.edges == np.arange(len(values) + 1) - 0.5).all()
    assert bins.tested.tolist() == tested
    assert bins.feasible.tolist() == feasible


@pytest.mark.parametrize(("last", "sizes"), [(59, {4}), (60, {4, 5}), (61, {6}), (120, {10, 11})])
def test_many_whole_numbers_share_bins(last, sizes):
    tubes = np.arange(20, last + 1)  # so many that bars of single values could not be read
    many = histogram(TestTable.of(tubes, tubes[:, None], tubes[:, None]), "x1")
    assert (many.values, many.edges[0], many.edges[-1]) == ((), 19.5, last + 0.5)
    assert {*many.tested.tolist()} == {*np.diff(many.edges)} == sizes


# The refined box


@given(limit=st.floats(0.2, 1.0), margin=st.floats(0, 2))
def test_the_refined_box_holds_the_feasible_set(limit, margin):
    limited = RING.under(limits={"f1": limit})
    inside = RING.X[limited.feasible()]
    if len(inside) == 0:
        refused("none of .* is feasible", limited.refined_bounds, error=ValueError, margin=margin)
        return
    low, high = inside.min(axis=0), inside.max(axis=0)
    np.testing.assert_array_equal(limited.refined_bounds(), [low, high])
    more = margin * (high - low)
    expected = np.clip([low - more, high + more], 0, 1)
    np.testing.assert_allclose(limited.refined_bounds(margin=margin), expected)


def test_refined_bounds_of_mixed_variables():
    lower, upper = MIXED.under(limits={"f1": 2.0}).refined_bounds(margin=0.3)
    np.testing.assert_allclose(lower, [0.2, 10, np.nan, np.nan, np.nan])
    np.testing.assert_allclose(upper, [1.8, 19, np.nan, np.nan, np.nan])
    objective = MIXED.schema.variables[0]
    asked = MIXED.under(objectives=[objective, "f1"], limits={"f1": 2.0})
    np.testing.assert_allclose(asked.refined_bounds(margin=0.3), [lower, upper])
