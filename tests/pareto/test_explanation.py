"""Why a design, against loops in exact fractions; what the sentences say is what the numbers say."""

import re
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import TestTable, compare_designs, explain, rank_of_efficiency
from pymoo_psi.table import Schema
from tests.helpers.refusals import refused

small_sets = st.tuples(st.integers(1, 9), st.integers(1, 4)).flatmap(
    lambda shape: arrays(float, shape, elements=st.integers(0, 6).map(float))
)


def by_hand(F, i):
    """Distances, ranges, and for each objective all neighbours that tie, in exact fractions."""
    rows = [[Fraction(v) for v in row] for row in F.tolist()]
    front = [
        k for k, r in enumerate(rows)
        if not any(all(a <= b for a, b in zip(o, r, strict=True)) and o != r for o in rows)
    ]  # fmt: skip
    m = len(rows[0])
    best = [min(rows[k][j] for k in front) for j in range(m)]
    ranges = [max(rows[k][j] for k in front) - best[j] for j in range(m)]
    behind = [rows[i][j] - best[j] for j in range(m)]

    def changes(k):
        return [(rows[k][j] - rows[i][j]) / ranges[j] for j in range(m) if ranges[j]]

    def cost(k):
        return max(0, *changes(k), 0), sum(change**2 for change in changes(k))

    neighbours = []
    for j in range(m):
        better = [k for k in front if rows[k][j] < rows[i][j]]
        near = [k for k in better if cost(k) == min(map(cost, better))]
        most = min((rows[k][j] for k in near), default=0)
        neighbours.append([k for k in near if rows[k][j] == most])
    return front, behind, ranges, neighbours


@given(F=small_sets, data=st.data())
def test_distances_and_neighbours_are_those_of_the_definition(F, data):
    i = data.draw(st.integers(0, len(F) - 1))
    front, behind, ranges, neighbours = by_hand(F, i)
    why = explain(F, i)
    assert why.behind.tolist() == [float(b) for b in behind]
    for share, b, r in zip(why.shares, behind, ranges, strict=True):
        if r == 0 and b:
            assert np.isnan(share)
        else:
            assert share == pytest.approx(float(b / r) if r else 0)
    for found, ties in zip(why.neighbours.tolist(), neighbours, strict=True):
        assert found in (ties or [-1])
    by = why.dominated_by
    assert by in ([-1] if i in front else front)
    if i not in front:
        assert (F[by] <= F[i]).all()
        assert (F[by] < F[i]).any()
    np.testing.assert_array_equal(why.steps.gains, F[i] - F[why.steps.rows])


@given(F=small_sets, data=st.data())
def test_directions_do_not_matter(F, data):
    """A maximised objective and its negative minimised have the same gains and shares."""
    i = data.draw(st.integers(0, len(F) - 1))
    sign = data.draw(arrays(int, F.shape[1], elements=st.sampled_from([1, -1])))
    maximize = np.flatnonzero(sign < 0).tolist()
    plain, turned = explain(F, i), explain(F * sign, i, maximize=maximize)
    np.testing.assert_array_equal(plain.shares, turned.shares)
    np.testing.assert_array_equal(plain.neighbours, turned.neighbours)
    np.testing.assert_array_equal(plain.steps.gains, turned.steps.gains)
    assert plain.costs == turned.costs


@given(F=small_sets, factor=st.sampled_from([1e-300, 1e-9, 7.0, 1e12, 1e290]))
def test_units_change_the_amounts_only(F, factor):
    plain, scaled = explain(F, 0), explain(F * factor, 0)
    np.testing.assert_allclose(scaled.shares, plain.shares, rtol=1e-9)
    assert scaled.neighbours.tolist() == plain.neighbours.tolist()


@given(F=small_sets)
def test_what_one_gains_the_other_loses(F):
    there, back = compare_designs(F, [0, len(F) - 1]), compare_designs(F, [len(F) - 1, 0])
    np.testing.assert_array_equal(there.gains[1], -back.gains[1])
    swap = {"lower": "higher", "higher": "lower"}
    turned = re.sub("lower|higher", lambda found: swap[found[0]], there.difference(1))
    assert sorted(turned.split(". But ")) == sorted(back.difference(1).split(". But "))


def test_rounding_is_no_difference():
    F = np.array([[0.3, 1.0], [0.1 + 0.2, 1.0], [0.0, 2.0]])
    assert compare_designs(F, [0, 1]).gains.tolist() == [[0, 0], [0, 0]]
    assert compare_designs(F, [0, 1]).sentences == (
        "Design 1 against design 0: equal in all objectives.",
    )
    assert explain(F, 1).dominated_by == -1
    assert explain(F, 1).neighbours.tolist() == [2, -1]
    F = [[0.1 + 0.2, 1.0], [0.5, 0.5], [1.0, 0.3]]  # the first reaches the end of the fixed range
    fixed = rank_of_efficiency(F, ideal=[0.3, 0.3], nadir=[1.0, 1.0])
    assert explain(fixed, 0).behind.tolist() == [0.0, 0.7]


DENSE = np.column_stack([np.arange(1025) / 1024, (np.arange(1025)[::-1] / 1024) ** 2])


@pytest.mark.parametrize(
    ("F", "row", "neighbours"),
    [
        (DENSE, 512, [501, 523]),  # 11 / 1024; 0.25 -> 0.2394
        (DENSE, 5, [4, 11]),  # in f1 nothing is so much better
        # Better by a hundredth exactly.
        ([[0.0, 100.0], [49.0, 51.0], [49.5, 50.4], [50.0, 50.0], [100.0, 0.0]], 3, [1, 4]),
    ],
)
def test_a_step_is_a_hundredth_of_the_range(F, row, neighbours):
    """On a dense front the nearest better design of all would tell nothing."""
    assert explain(F, row).neighbours.tolist() == neighbours


CARS = pd.DataFrame({"price": [20.0, 30.0], "range": [200.0, 400.0]})
ROWS = [[1.0, 4.0], [2.0, 2.0], [4.0, 1.0], [5.0, 5.0]]


def labelled(labels):
    return pd.DataFrame(ROWS, index=labels, columns=["a", "b"])


def table_of(labels=None):
    """Tests 10 to 14, of which the first is infeasible and the last dominated."""
    X, G = np.linspace(0, 1, 5)[:, None], [[1.0], [0.0], [0.0], [0.0], [0.0]]
    schema = Schema.of(1, ["a", "b"], ["g"], units={"a": "kg"})
    notes = {} if labels is None else {"notes": {"name": labels}, "label": "name"}
    return TestTable.of(range(10, 15), X, [[0.0, 0.0], *ROWS], G, schema=schema, **notes)


ARRAY = np.array(ROWS)
LETTERS = labelled(["A", "B", "C", "C"])
INTEGERS = labelled([3, 2, 1, 0])
PLAIN = table_of()
LABELLED = table_of(["A", "B", "C", "D", "E"])
NUMBERED = table_of(["A", "11", "13", "D", "E"])
REVERSED = table_of([14, 13, 12, 11, 10])


@pytest.mark.parametrize(
    ("source", "design", "row"),
    [
        (ARRAY, 2, 2),
        (ARRAY, None, 1),  # the Salukvadze optimum
        (labelled(range(4)), 2, 2),
        (rank_of_efficiency(ROWS), 2, 2),
        (LETTERS, "B", 1),
        (rank_of_efficiency(LETTERS), "B", 1),
        (INTEGERS, "3", 0),
        (rank_of_efficiency(INTEGERS), "3", 0),
        (PLAIN, None, 1),
        (PLAIN, 12, 1),  # row 2 of the table and row 1 of the ranking of the feasible designs
        (PLAIN, "12", 1),
        (PLAIN.feasible_ranking(), 12, 1),
        (LABELLED, 12, 1),
        (LABELLED, "12", 1),
        (LABELLED, "C", 1),
        (LABELLED.feasible_ranking(), "C", 1),
        (NUMBERED, "13", 1),
        (REVERSED, "name 12", 1),
    ],
)
def test_a_design_goes_by_label_or_number(source, design, row):
    assert explain(source, design).row == row
    if design is not None:
        assert compare_designs(source, [design, design]).rows.tolist() == [row, row]


@pytest.mark.parametrize(
    ("source", "design", "message"),
    [
        (ARRAY, 4, "design must be the name .* or row, got 4"),
        (LETTERS, 1, "design must be the name .* as a text, .* got 1"),
        (LETTERS, "C", "the name of one design as a text, .* got 'C'"),
        (LETTERS, "D", "the name of one design as a text, .* got 'D'"),
        (INTEGERS, 3, "as a text, .* got 3; of labelled"),
        (PLAIN, 3, "the name of one design as a text, .* the number of a test, or row, got 3"),
        (PLAIN, 10, "be a feasible .* infeasible; violations"),
        (LABELLED, "A", "be a feasible .* infeasible; violations"),
        (LABELLED, "F", "design must be"),
        (NUMBERED, 14, "of labelled designs give the name"),
        (REVERSED, 12, "got 12; .* give the name, or row="),
        (REVERSED, "1", "the name of one design"),  # no label, though the number of a test
    ],
)
def test_what_names_no_design_is_refused(source, design, message):
    refused(message, explain, source, design)
    refused("design", compare_designs, source, [design, design])


def test_rows_are_those_of_the_source():
    of_ranking = explain(PLAIN.feasible_ranking(), row=1, units={"a": "kg"})
    assert of_ranking.sentences == explain(PLAIN, row=2).sentences == explain(PLAIN, 12).sentences
    assert compare_designs(PLAIN, rows=[2, 1]).rows.tolist() == [1, 0]


def test_a_name_of_the_users_is_not_respelt():
    frame = labelled(["test rig", "mTorr", "row 3", "B"])
    starts = [re.split("[,.]", explain(frame, row=i).standing)[0] for i in range(3)]
    assert starts == ["test rig", "Proposed: mTorr", "Row 3"]


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: explain(CARS, 0, units={"prize": "k€"}), ValueError, "units must be one of 'price'"),
        (lambda: explain(CARS, 0, units="k€"), TypeError, "units must be a mapping from names to units, got 'k€'"),
        (lambda: explain(CARS, 2.5), TypeError, "design must be an integer >= 0, got 2.5"),
        (lambda: explain(CARS, True), TypeError, "design must be an integer >= 0, got True"),
        (lambda: explain(ARRAY, row=4), ValueError, "row must be a row of F, from 0 to 3, got 4"),
        (lambda: explain(PLAIN, row=0), ValueError, "row must be a feasible design, got .* infeasible"),
        (lambda: explain(CARS, row=-1), ValueError, "row must be an integer >= 0, got -1"),
        (lambda: explain(CARS, 0, row=0), ValueError, "design must be left out where row is given, got 0"),
        (lambda: compare_designs(CARS, rows=[0, -1]), ValueError, "rows must be an integer >= 0, got -1"),
        (lambda: compare_designs(CARS, rows=[1]), ValueError, "designs must be two designs or more, got 1"),
        (lambda: compare_designs(CARS), TypeError, "designs must be a list of designs, got None"),
        (lambda: compare_designs(CARS, [0, 1], rows=[0, 1]), ValueError, "designs must be left out where rows are"),
    ],
)  # fmt: skip
def test_mistakes(call, kind, message):
    refused(message, call, error=kind)
