"""Tables of runs made apart."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi import TestTable, lp_tau
from pymoo_psi.table import Schema
from tests.helpers.asked import freed
from tests.helpers.refusals import refused

SCHEMA = Schema.of(2, 2, 1, lower=[0.0, 0.0], upper=[1.0, 1.0])


def run(n, first=1, schema=SCHEMA):
    """An investigation of a made-up problem in which every fourth design or so fails."""
    X = lp_tau(n, 2, first=first)
    F = np.column_stack([X.sum(axis=1), np.where(X[:, 0] > 0.75, np.nan, X[:, 1])])
    return TestTable.of(np.arange(first, first + n), X, F, X[:, :1] - X[:, 1:], schema=schema)


@given(n=st.integers(0, 60), data=st.data())
def test_parts_with_any_overlap_give_the_whole(n, data):
    whole = run(n)
    order = data.draw(st.permutations(range(n)))
    a, b = (data.draw(st.integers(0, n)) for _ in range(2))
    first, second = whole.take(order[: max(a, b)]), whole.take(order[min(a, b) :])
    assert first.merge(second).equals(whole)
    assert second.merge(first).equals(whole)
    assert first.merge(first).equals(first.merge(TestTable.empty()))


def other_result():
    table = run(8)
    X = np.array(table.X)
    X[3] = -0.25
    return TestTable.of(table.numbers, X, table.F, table.G, schema=SCHEMA)


@pytest.mark.parametrize(
    ("make", "kind", "message"),
    [
        (lambda: run(8).merge(other_result()), ValueError, "tests must be the same for each number, got .* and -0.25 as x1 of test 4; do not join"),
        (lambda: run(8).merge(run(8, 9, SCHEMA.changed(upper={"x2": 2.0}))), ValueError, "got upper of x2 1.0 against 2.0"),
        (lambda: run(8).merge(run(8, 9, replace(SCHEMA, eq_tolerance=0.0))), ValueError, "got eq_tolerance 0.0001 against 0.0"),
        (lambda: run(8).merge(freed(run(8), "g1")), ValueError, "of one problem and formulation .* got formulation"),
    ],
)  # fmt: skip
def test_what_does_not_belong_together_is_refused(make, kind, message):
    refused(message, make, error=kind)


def test_outputs_of_tests_of_one_design_are_joined():
    whole = run(8)
    one, two = (
        TestTable.of(whole.numbers, whole.X, whole.F, whole.G, outputs={name: np.arange(8.0)},
                     schema=SCHEMA, notes={name.upper(): list("abcdefgh")})
        for name in ("heat", "noise")
    )  # fmt: skip
    both = one.merge(two.take([5, 2, 7]))
    assert both.schema.outputs == ("heat", "noise")
    np.testing.assert_array_equal(both.column("noise")[[2, 5, 7]], [2, 5, 7])
    assert both["NOISE"].tolist() == [None, None, "c", None, None, "f", None, "h"]
    last_bit = TestTable.of(whole.numbers, whole.X, whole.F * (1 + 2**-52), whole.G, schema=SCHEMA)
    assert whole.merge(last_bit).equals(whole)
    known = whole.take(whole.status != "failed")
    moved = replace(known, numbers=known.numbers + 8)
    assert len(whole.merge(moved)) == 8 + len(known)  # the same designs with the same results
