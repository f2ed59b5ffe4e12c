"""The test table: its arrays, the sets of designs, constraints and limits."""

import copy
import pickle
from functools import partial

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import Decision, TestTable, explain, write_table
from pymoo_psi.analysis import (
    average_repeats,
    constraint_costs,
    convergence,
    histogram,
    sensitivities,
    switching_sentences,
    switching_values,
)
from pymoo_psi.table import Schema
from tests.helpers.asked import freed, violations
from tests.helpers.exact import best_rows
from tests.helpers.refusals import refused

# A coarse grid makes ties, dominated designs and values on a limit common.
grid = st.integers(-2, 2).map(float)
odd = st.one_of(grid, st.sampled_from([np.nan, np.inf, -np.inf]))


@st.composite
def tables(draw, values=odd):
    n, m, n_ieq, n_eq = (draw(st.integers(*r)) for r in ((0, 12), (1, 3), (0, 3), (0, 2)))
    numbers = draw(st.lists(st.integers(1, 40), min_size=n, max_size=n, unique=True))
    X = draw(arrays(float, (n, 2), elements=grid))
    F = draw(arrays(float, (n, m), elements=values))
    G = draw(arrays(float, (n, n_ieq), elements=values))
    H = draw(arrays(float, (n, n_eq), elements=st.sampled_from([0.0, 5e-5, -1e-4, 2e-4, 1.0])))
    failed = draw(st.sets(st.sampled_from(numbers), max_size=2)) if n else set()
    for array in (X, F, G, H):
        array.setflags(write=False)
    return TestTable.of(
        np.array(numbers, dtype=int), X, F, G, H, reasons=dict.fromkeys(failed, "it broke")
    )


limits_on_f1 = st.one_of(st.none(), st.sampled_from([{"f1": 1.0}, {"f1": -1.0}, {"f1": np.inf}]))


def keeps(row, limits):
    if limits in (None, {"f1": np.inf}):
        return True
    return row[0] <= next(iter(limits.values())) and np.isfinite(row[0])


def rows(table):
    """Every test as (number, x, f, g, h, status)."""
    blocks = (table.numbers, table.X, table.F, table.G, table.H, table.status)
    return list(zip(*blocks, strict=True))


@given(table=tables())
def test_status_follows_from_reasons_constraints_and_criteria(table):
    for number, _, f, g, h, status in rows(table):
        is_met = all(v <= 0 for v in g) and all(abs(v) <= 1e-4 for v in h)
        is_known = np.isfinite(f).all()
        expected = "failed"
        if table.reasons.get(number) != "it broke" and (is_known or not is_met):
            expected = "ok" if is_met else "infeasible"
        assert status == expected
        assert (number in table.reasons) == (status == "failed")


@given(table=tables(), limits=limits_on_f1)
def test_feasible_and_pareto_agree_with_the_oracle(table, limits):
    feasible = [row for row in rows(table) if row[5] == "ok" and keeps(row[2], limits)]
    limited = table.under(limits=limits)
    assert limited.numbers[limited.feasible()].tolist() == [row[0] for row in feasible]
    optimal = {}
    for (number, x, f, *_), is_best in zip(
        feasible, best_rows([r[2] for r in feasible]), strict=True
    ):
        if is_best:
            optimal.setdefault(repr([*x, *f]), number)  # equal tests count once
    assert limited.numbers[limited.pareto()].tolist() == [*optimal.values()]


@given(table=tables())
def test_a_table_is_read_only_and_survives_copying(table):
    for other in (table, pickle.loads(pickle.dumps(table)), copy.copy(table), copy.deepcopy(table)):
        assert other.equals(table)
        for cells in (other.numbers, other.X, other.F, other.G, other.H, *other.data.values()):
            assert not cells.flags.writeable
    with pytest.raises(AttributeError):
        table.F = None


@pytest.mark.parametrize(
    ("X", "dtype", "same"),
    [
        ([[0.0, 1.0]], float, [0.0, 1.0]),
        ([[0, 1.0]], float, [0.0, 1.0]),
        (np.array([[1, 2]], dtype=np.int32), np.int64, [1, 2]),
        (np.array([[1, 2]], dtype=np.uint64), np.int64, [1, 2]),
        (np.array([[1, 2]], dtype=object), np.int64, [1, 2]),
        ([[True, False]], bool, [True, False]),
        ([[True, 0.5]], object, [True, 0.5]),
        ([["a", 1, np.float64(2)]], object, ["a", 1, 2.0]),
        ([{"b": np.int64(1), "a": np.True_}], object, [1, True]),
        (np.float32([[0.5]]), float, [0.5]),
        (np.array([["oak", "tin"]]), object, ["oak", "tin"]),
    ],
)
def test_designs_keep_the_types_of_their_values(X, dtype, same):
    table = TestTable.of([1], X, [[1.0]])
    assert table.X.dtype == dtype
    assert [(type(v), v) for v in table.X[0].tolist()] == [(type(v), v) for v in same]


KINDS = Schema.of(["a", "b", "c", "d"], 1, kinds=["real", "integer", "binary", "choice"])


def test_kinds_that_are_declared_hold_for_every_block():
    """Whatever a block happens to hold: a choice between 1 and 2 is no integer, 1 no integer."""
    one = TestTable.of([1], [[1, 2.0, 1, 1]], [[1.0]], schema=KINDS)
    two = TestTable.of([2], [[0.5, 3, False, "oak"]], [[1.0]], schema=KINDS)
    assert [(type(v), v) for v in one.X[0]] == [(float, 1.0), (int, 2), (bool, True), (int, 1)]
    assert one.schema.kinds == two.schema.kinds == KINDS.kinds
    joined = one.extended(two)
    assert joined.take([0]).equals(one)
    assert joined.refined_bounds()[0].tolist()[:2] == [0.5, 2.0]
    assert np.isnan(joined.refined_bounds()[0][2:]).all()


# Constraints


@settings(deadline=None)  # the first example imports pandas
@given(table=tables(), limits=limits_on_f1)
@example(TestTable.of([1], [[0.0]], [[np.inf, 1.0]], [[1.0]]), {"f1": 1.0})  # it ran
def test_costs_of_constraints_agree_with_the_oracle(table, limits):
    limited = table.under(limits=limits)
    costs = constraint_costs(limited)
    names = [
        *table.schema.constraints,
        *(limit.written(name) for name, limit in limited.limits.items()),
    ]
    assert costs.index.tolist() == names
    violated = {}
    for number, _, f, g, h, status in rows(limited):
        if status != "failed":
            checks = [v <= 0 for v in g] + [abs(v) <= 1e-4 for v in h]
            ran = all(checks) or np.isfinite(f).any()  # else a requirement kept the model from it
            checks += [not ran or keeps(f, limits)] if limited.limits else []
            violated[number] = [name for name, met in zip(names, checks, strict=True) if not met]
    assert violations(table, limits) == {n: tuple(b) for n, b in violated.items() if b}
    for name in names:
        alone = [f for number, _, f, *_ in rows(table) if violated.get(number) == [name]]
        assert costs.loc[name, "rejects"] == sum(name in b for b in violated.values())
        assert costs.loc[name, "alone"] == len(alone)
        for j, criterion in enumerate(table.schema.objectives):
            # Without it a design that lacks another objective would fail.
            best = min((f[j] for f in alone if np.isfinite(f).all()), default=np.nan)
            np.testing.assert_equal(costs.loc[name, f"{criterion}_alone"], best)
            best = min(table.F[limited.feasible(), j], default=np.nan)
            np.testing.assert_equal(costs.loc[name, f"{criterion}_feasible"], best)


# Errors

FG = ([[1.0, 2.0], [2.0, 1.0]], [[0.0], [1.0]])
PLAIN = TestTable.of([1, 2], [[0.0], [1.0]], *FG)


@pytest.mark.parametrize(
    "X", [pd.DataFrame({"x1": [0.0, 1.0]}), [{"x1": 0.0}, {"x1": 1.0}], np.array([[0.0], [1.0]])]
)
def test_designs_are_rows_mappings_or_a_frame(X):
    assert TestTable.of([1, 2], X, *FG).equals(PLAIN)


@pytest.mark.parametrize(
    "other",
    [
        "a table",
        PLAIN.take([0]),
        PLAIN.under(normalize=False),
        PLAIN.under(Decision(chosen="test 1")),
        PLAIN.with_outputs({"m": [1, 2]}),
        TestTable.of([1, 2], [[0.0], [1.5]], *FG),
        TestTable.of([1, 2], [[0.0], [1.0]], *FG, schema=Schema.of(1, 2, 1, kinds=["integer"])),
    ],
)
def test_tables_of_other_values_or_columns_are_not_equal(other):
    assert not PLAIN.equals(other)


OF_TABLES = (
    average_repeats,
    constraint_costs,
    convergence,
    sensitivities,
    switching_sentences,
    switching_values,
    partial(histogram, variable="x1"),
    partial(write_table, path="w.csv"),
)


@pytest.mark.parametrize(
    ("make", "kind", "message"),
    [
        (lambda: PLAIN.under(limits={"f12": 1.0}).feasible(), ValueError, "a name in limits must be one of 'f1', 'f2', 'x1', got 'f12'; did you mean 'f"),
        *[(partial(call, "t.csv"), TypeError, "table must be of type TestTable, got str; .*read_table") for call in OF_TABLES],
        (lambda: PLAIN.merge("t.csv"), TypeError, "other must be of type TestTable, got str"),
        (lambda: histogram(PLAIN, "x3"), ValueError, "variable must be one of .*'x1', got 'x3'"),
        (lambda: PLAIN.with_outputs({"heat": [1.0]}), ValueError, r"column 'heat' must be of shape \(2,\), got shape \(1,\)"),
        (lambda: PLAIN.with_outputs({"x1": [1.0, 2.0]}), ValueError, "names of a table must be distinct, .* got 'x1'"),
        (lambda: PLAIN.with_outputs({"m": [1, 2]}).extended(PLAIN.with_notes({"m": ["x", "y"]})), ValueError, "got role of m output against note"),
        (lambda: TestTable.of([1], 0.5, [[1.0]]), TypeError, "X must be .* rows, mappings or a frame, got 0.5"),
        (lambda: PLAIN.under(ranges={"f1": (1, 0)}), ValueError, "the range of 'f1' must be a pair .* got \\(1, 0\\)"),
        (lambda: PLAIN.under(ranges={"f1": (0, None)}), TypeError, "the range of 'f1' must be .* got \\(0, None\\)"),
        (lambda: PLAIN.under(objectives=np.array(["f1", "f2"])), TypeError, "objectives must be a list of names, got array"),
        (lambda: PLAIN.take([]).row_of("A"), ValueError, "design must be the name of one design as a text, or the number .*, got 'A'"),
        (lambda: PLAIN.take([[True], [False]]), ValueError, "selection must be a mask or indices of rows"),
        (lambda: PLAIN.take([[0], [1]]), ValueError, "selection must be a mask or indices of rows, got shape"),
        (lambda: PLAIN.take([1, 1]), ValueError, "distinct, got test 2 twice"),
        (lambda: PLAIN.extended(freed(PLAIN, "g1")), ValueError, "of one problem and formulation .* got formulation"),
        (lambda: TestTable.of([1], [["a"]], [[1.0]], schema=Schema.of(1, 1, kinds=["real"])), TypeError, "X must hold real values for x1, got 'a'"),
        (lambda: TestTable.of([1], [[0.0]], [[1.0], [2.0]]), ValueError, r"F must be of shape \(1, 1\), got shape \(2, 1\)"),
        (lambda: TestTable.of([1], [[0.0]], [[1.0]], reasons={0: "broken"}), ValueError, "reasons must be by the numbers of tests, got 0"),
        (lambda: TestTable.of([1], [[np.nan]], [[1.0]]), ValueError, "X, x1, must be finite, got nan"),
        (lambda: Schema.of(1, 1, units={"f1": "kg", "mas": "kg"}), ValueError, "column must be one of .*, got 'mas'"),
        (lambda: Schema.of(["a", "a"], 1), ValueError, "names of a table must be distinct, .* got 'a'"),
        (lambda: Schema.of(1, 1, lower=[1.0], upper=[0.0]), ValueError, "the bounds of 'x1' must be in increasing order, got 1 and 0"),
        (lambda: Schema.of(1, 1, kinds=["log"], lower=[0.0], upper=[1.0]), ValueError, "the lower bound of 'x1' must be above 0 on a log scale, got 0.0"),
        (lambda: PLAIN.refined_bounds(margin=-1), ValueError, "margin must be 0 or more, got -1"),
        (lambda: Schema.of([""], 1), ValueError, "the name of a column \\(variable\\) must be at least one character"),
        (lambda: PLAIN.with_notes({"m": ["x"]}), ValueError, r"column 'm' must be of shape \(2,\), got shape \(1,\)"),
        (lambda: PLAIN.with_notes({"x1": ["a", "b"]}), ValueError, "names of a table must be distinct, .* got 'x1'"),
        (lambda: PLAIN.to_csv("tests.xlsx"), ValueError, "path must be the name of a text file, .* got 'tests.xlsx'; write_table"),
        (lambda: PLAIN.column("f9"), ValueError, "column must be one of 'f1', 'f2', 'g1', 'x1', got 'f9'"),
        (lambda: PLAIN.under(limits={"x1": {1.0}}), TypeError, r"'x1' in limits must be a number or a pair .* got \{1.0\}"),
        (lambda: TestTable.of([0], [[0.0]], [[1.0]]), ValueError, "numbers must be one-dimensional, of integers from 1"),
        (lambda: TestTable.of([1, 2], [0.5, 0.6], [[1.0], [2.0]]), ValueError, r"X must be of shape \(n, n_var\), got shape \(2,\)"),
        (lambda: TestTable.of([1, 2], [{"x": 1.0}, {"y": 2.0}], [[1.0], [2.0]]), ValueError, "X must be mappings of the variables x, got {'y': 2.0}"),
        (lambda: TestTable.of([1], [[1j]], [[1.0]]), TypeError, "a value of x1 must be a number, .* got 1j; name options"),
    ],
)  # fmt: skip
def test_bad_arguments(make, kind, message):
    refused(message, make, error=kind)


@pytest.mark.parametrize(
    ("cells", "names"),
    [
        (("A", "A"), ["A #1", "A #2"]),
        (("A", ""), ["A", "test 2"]),
        (("old", 7), ["old", "id 7"]),
        (("", ""), ["test 1", "test 2"]),
    ],
)
def test_designs_are_called_by_their_label(cells, names):
    table = PLAIN.with_notes({"id": cells}, "id")
    assert table.names == names
    assert table.best().names[0] in explain(table).sentences[0]


@given(
    cells=st.lists(
        st.one_of(
            st.sampled_from(
                ["A", "A #1", "A #2", "A #1 #1", "7", "id 7", "test 2", "id 7 #1", 7, "", None]
            ),
            st.text("A# 12", max_size=6),
        ),
        min_size=2,
        max_size=8,
    )
)
@example(cells=["A", "A", "A #1"])
@example(cells=[7, "id 7"])
def test_names_are_distinct_and_lead_to_their_rows(cells):
    n = len(cells)
    table = TestTable.of(range(1, n + 1), np.zeros((n, 0)), [[k, -k] for k in range(n)])
    table = table.with_notes({"id": cells}, "id")
    assert len({*table.names}) == n
    assert [table.row_of(name) for name in table.names] == [*range(n)]
    assert [explain(table, name).row for name in table.names] == [*range(n)]


def test_a_design_with_other_objectives_is_no_repetition():
    """As of a model that is not deterministic, or of one that was mended meanwhile."""
    X, F = [[4.5], [4.5], [5], [4.5], [4.5]], [[0.3, 1], [0.2, 1], [0.1, 2], [0.3, 1], [0.2, 2]]
    table = TestTable.of([1, 2, 3, 4, 5], X, F)
    assert table.repeats.tolist() == [False, False, False, True, False]
    assert table.pareto().tolist() == [False, True, True, False, False]


def test_series_and_indices_of_its_frame_are_taken_by_test():
    table = TestTable.of([3, 5, 9], [[0.1], [0.5], [0.9]], [[2.0], [3.0], [1.0]])
    by_cost = table.to_frame().sort_values("f1")
    for selection in (by_cost["f1"] < 3, by_cost[:2].index, by_cost["f1"][:2] < 3):
        assert sorted(table.take(selection).numbers) == [3, 9]
    assert table.take(table.to_frame()["f1"].argsort()[:2]).numbers.tolist() == [9, 3]
    refused("selection must be", table.take, by_cost.index + 1)
    again = table.with_outputs({"price": by_cost["f1"] * 2}).with_notes({"note": by_cost["f1"]})
    assert again["price"].tolist() == [4, 6, 2]
    assert again["note"].tolist() == [2, 3, 1]
