"""Why a design, against loops in exact fractions; what the sentences say is what the numbers say."""

import re
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import PsiError, compare_designs, explain

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


def test_a_step_gives_up_least_and_not_the_nearest():
    F = [[4, 4, 4], [3, 4.5, 6], [0, 5, 5], [0, 5, 5.5], [10, 0, 9], [9, 10, 0]]
    assert explain(F, 0).neighbours.tolist() == [2, 4, 5]


def test_a_step_is_a_hundredth_of_the_range_where_there_is_one():
    """On a dense front the nearest better design of all would tell nothing."""
    x = np.arange(1025) / 1024
    F = np.column_stack([x, (1 - x) ** 2])
    assert explain(F, 512).neighbours.tolist() == [501, 523]  # 11 / 1024; 0.25 -> 0.2394
    assert explain(F, 5).neighbours.tolist() == [4, 11]  # in f1 nothing is so much better


CARS = pd.DataFrame({"price": [20.0, 30.0], "range": [200.0, 400.0]})


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: explain(CARS, 0, units={"prize": "k€"}), ValueError, "units must be of objectives among price"),
        (lambda: explain(CARS, 2), ValueError, "i must be a row of F, 0 to 1, got 2"),
        (lambda: compare_designs(CARS, [0, -1]), ValueError, "rows must be an integer >= 0, got -1"),
    ],
)  # fmt: skip
def test_mistakes(call, kind, message):
    with pytest.raises(kind, match=message) as caught:
        call()
    assert isinstance(caught.value, PsiError)


def test_a_design_goes_by_its_row_or_by_a_label_that_is_a_text():
    """Integers are rows even where they are labels, too; one label of two rows is refused."""
    frame = pd.DataFrame({"a": [1.0, 2, 4], "b": [4.0, 2, 1]}, index=["A", "B", "B"])
    assert str(explain(frame, "A")) == str(explain(frame, 0))
    assert compare_designs(frame, [2, "A"]).rows.tolist() == [2, 0]
    numbered = frame.set_axis([2, 1, 0], axis=0)
    assert str(explain(numbered, 2)).startswith("Design 0 ")
    own = frame.set_axis(["pA-7", "mTorr", "row 3"], axis=0)
    started = [str(explain(own, i)).partition(" is ")[0] for i in range(3)]
    assert started == ["pA-7", "mTorr", "Row 3"]  # what the user has named is not respelt
    for label in ("B", "C"):
        with pytest.raises(PsiError, match=f"the label of just one row, got '{label}'"):
            explain(frame, label)
