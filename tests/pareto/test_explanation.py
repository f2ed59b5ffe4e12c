"""Why a design, against loops in exact fractions; what the sentences say is what the numbers say."""

import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import TestTable, compare_designs, explain, rank_of_efficiency
from pymoo_psi.table import Layout
from tests.refusals import refused

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
    assert bool(why.weakest) == bool((why.shares > 0).any())
    if i in front:
        assert why.dominated_by == -1
    else:
        by = why.dominated_by
        assert by in front
        assert (F[by] <= F[i]).all()
        assert (F[by] < F[i]).any()
    gains = F[i] - F[why.steps.rows]
    np.testing.assert_array_equal(why.steps.gains, gains)


@given(F=small_sets, data=st.data())
def test_directions_do_not_matter(F, data):
    """A maximised objective and its negative minimised have the same gains and shares."""
    i = data.draw(st.integers(0, len(F) - 1))
    sign = np.array(
        data.draw(st.lists(st.sampled_from([1, -1]), min_size=F.shape[1], max_size=F.shape[1]))
    )
    maximize = np.flatnonzero(sign < 0).tolist()
    plain, turned = explain(F, i), explain(F * sign, i, maximize=maximize)
    np.testing.assert_array_equal(plain.shares, turned.shares)
    np.testing.assert_array_equal(plain.neighbours, turned.neighbours)
    np.testing.assert_array_equal(plain.steps.gains, turned.steps.gains)
    assert plain.sentences == turned.sentences


@given(F=small_sets, factor=st.sampled_from([1e-300, 1e-9, 7.0, 1e12, 1e290]))
def test_units_change_the_amounts_only(F, factor):
    plain, scaled = explain(F, 0), explain(F * factor, 0)
    np.testing.assert_allclose(scaled.shares, plain.shares, rtol=1e-9)
    assert scaled.neighbours.tolist() == plain.neighbours.tolist()
    assert scaled.weakest == plain.weakest


@given(F=small_sets)
def test_what_one_gains_the_other_loses(F):
    rows = [0, len(F) - 1]
    there, back = compare_designs(F, rows), compare_designs(F, rows[::-1])
    np.testing.assert_array_equal(there.gains[1], -back.gains[1])
    swap = {"better": "worse", "worse": "better"}
    turned = re.sub("better|worse", lambda found: swap[found[0]], there.difference(1))
    one, other = (text.replace(" of its range", "") for text in (turned, back.difference(1)))
    assert sorted(one.split("; ")) == sorted(other.split("; "))


def test_rounding_is_no_difference():
    F = np.array([[0.3, 1.0], [0.1 + 0.2, 1.0], [0.0, 2.0]])
    assert compare_designs(F, [0, 1]).gains.tolist() == [[0, 0], [0, 0]]
    assert compare_designs(F, [0, 1]).sentences == (
        "Design 1 against design 0: equal in all objectives.",
    )
    assert explain(F, 1).dominated_by == -1
    assert explain(F, 1).neighbours.tolist() == [2, -1]


def test_a_step_is_a_hundredth_of_the_range_where_there_is_one():
    """On a dense front the nearest better design of all would tell nothing."""
    x = np.arange(1025) / 1024
    F = np.column_stack([x, (1 - x) ** 2])
    assert explain(F, 512).neighbours.tolist() == [501, 523]  # 11 / 1024; 0.25 -> 0.2394
    assert explain(F, 5).neighbours.tolist() == [4, 11]  # in f1 nothing is so much better


CARS = pd.DataFrame({"price": [20.0, 30.0], "range": [200.0, 400.0]})
ROWS = [[1.0, 4.0], [2.0, 2.0], [4.0, 1.0], [5.0, 5.0]]


def labelled(labels):
    return pd.DataFrame(ROWS, index=labels, columns=["a", "b"])


def table_of(labels=None):
    """Tests 10 to 14, of which the first is infeasible and the last dominated."""
    layout = Layout.of(1, ["a", "b"], ["g"], units={"a": "kg"})
    extra = {}
    if labels is not None:
        layout = replace(layout, label="name")
        extra = {"name": labels}
    X = np.linspace(0, 1, 5)[:, None]
    G = [[1.0], [0.0], [0.0], [0.0], [0.0]]
    numbers = [10, 11, 12, 13, 14]
    return TestTable.of(numbers, X, [[0.0, 0.0], *ROWS], G, layout=layout, extra=extra)


@pytest.mark.parametrize("F", [np.array(ROWS), labelled(range(4)), rank_of_efficiency(ROWS)])
def test_a_design_of_an_array_goes_by_its_row(F):
    assert explain(F, 2).row == explain(F, row=2).row == 2
    assert compare_designs(F, [2, 0]).rows.tolist() == [2, 0]
    assert compare_designs(F, rows=[2, 0]).rows.tolist() == [2, 0]
    assert explain(F).row == 1  # the Salukvadze optimum
    refused("design must be the name .* or row, got 4", explain, F, 4)
    refused("row must be a row of F, from 0 to 3, got 4", explain, F, row=4)


def test_a_design_with_a_label_goes_by_its_label():
    frame = labelled(["A", "B", "C", "C"])
    for F in (frame, rank_of_efficiency(frame)):
        assert explain(F, "B").row == explain(F, row=1).row == 1
        assert compare_designs(F, ["B", "A"]).rows.tolist() == [1, 0]
        refused("design must be the name .* as a text, .* got 1", explain, F, 1)
        for label in ("C", "D"):
            refused(f"the name of one design as a text, .* got '{label}'", explain, F, label)
    names = ["pA-7", "mTorr", "row 3", "B"]
    starts = [re.split(" is | has ", str(explain(labelled(names), row=i)))[0] for i in range(3)]
    assert starts == ["pA-7", "mTorr", "Row 3"]  # a name of the user's is not respelt


def test_labels_that_are_integers_are_not_taken_for_rows():
    frame = labelled([3, 2, 1, 0])
    for F in (frame, rank_of_efficiency(frame)):
        assert explain(F, "3").row == explain(F, row=0).row == 0
        assert compare_designs(F, ["3", "1"]).rows.tolist() == [0, 2]
        refused("as a text, such as '3', .* got 3", explain, F, 3)
        refused("name of one design as a text, .* got 0", compare_designs, F, [0, 1])


@pytest.mark.parametrize("labels", [None, ["A", "B", "C", "D", "E"], ["A", "11", "13", "D", "E"]])
def test_a_design_of_a_table_goes_by_its_label_or_the_number_of_its_test(labels):
    """Test 12 is row 2 of the table and row 1 of the ranking of the feasible designs."""
    table = table_of(labels)
    ranking = table.feasible_ranking()
    for number in (12, 14):
        why = explain(table, number)
        row = table.numbers.tolist().index(number)
        name = table.names[row]
        assert why.row == row - 1
        assert why.ranking.rows[why.row] == row
        others = [
            table.explain(number),
            table.explain(name),
            table.explain(row=row),
            explain(table, name),
            explain(table, row=row),
            explain(ranking, number, units={"a": "kg"}),
            explain(ranking, name, units={"a": "kg"}),
        ]
        assert {other.sentences for other in others} == {why.sentences}
    assert explain(table).sentences == table.explain().sentences == explain(table, 12).sentences
    two = compare_designs(table, [12, 11])
    assert two.sentences == compare_designs(table, table.names[2:0:-1]).sentences
    assert two.sentences == compare_designs(table, rows=[2, 1]).sentences
    assert two.sentences == compare_designs(ranking, [12, 11], units={"a": "kg"}).sentences
    for infeasible in (10, table.names[0]):
        refused("be a feasible .* infeasible; violations", explain, table, infeasible)
    refused(
        "design must be the name of one design as a text, .* or the number of a test or row, got 3",
        explain,
        table,
        3,
    )
    refused("design must be", explain, table, "F")
    refused("row must be a feasible design, got .* infeasible", explain, table, row=0)


def test_integers_that_label_other_tests_are_refused():
    table = table_of([14, 13, 12, 11, 10])
    refused("such as 'name 14', .* got 12; .* give the name, or row=", explain, table, 12)
    assert explain(table, "name 12").row == explain(table, row=2).row == 1
    refused("the name of one design", explain, table, "1")  # no label, though the number of a test
    assert explain(table_of(), "12").row == 1  # without labels that are numbers
    assert explain(table_of(["A", "B", "C", "D", "E"]), "12").row == 1


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: explain(CARS, 0, units={"prize": "k€"}), ValueError, "units must be one of 'price'"),
        (lambda: explain(CARS, 2.5), TypeError, "design must be an integer >= 0, got 2.5"),
        (lambda: explain(CARS, True), TypeError, "design must be an integer >= 0, got True"),
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
