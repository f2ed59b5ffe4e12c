"""Experiments joined: one table over all tests, each with where it is from."""

from dataclasses import replace

import numpy as np
import pandas as pd
from pymoo.problems import get_problem

from pymoo_psi import Formulation, TestTable, investigate, rank_of_efficiency
from pymoo_psi.table import Layout, read_table
from tests.refusals import refused

LAYOUT = Layout.of(1, ["mass", "gain"], 1, lower=[0.0], upper=[1.0], maximize=["gain"])
COARSE = TestTable.of(
    [2, 9], [[0.5], [0.75]], [[3.0, -1.0], [1.0, -2.0]], [[-1.0], [-1.0]],
    outputs={"heat": [4.0, 5.0]}, layout=LAYOUT,
)  # fmt: skip
FINE = TestTable.of(
    [1, 2, 3], [[0.75], [0.8], [0.9]], [[1.0, -2.0], [0.0, -1.0], [np.nan, np.nan]],
    [[-1.0], [0.5], [-1.0]], reasons={3: "it broke"},
    layout=replace(LAYOUT, lower=[0.7], upper=[2.0]),
)  # fmt: skip


def test_sets_and_ranks_are_those_of_the_union_and_say_where_tests_are_from():
    table = TestTable.combined({"coarse": COARSE, "fine": FINE})
    assert table.experiments == ("coarse", "fine")
    assert table.numbers.tolist() == [2, 9, 10, 11, 12]
    assert table.column("experiment").tolist() == ["coarse"] * 2 + ["fine"] * 3
    assert table.column("number").tolist() == [2, 9, 1, 2, 3]
    assert table.reasons == {12: "it broke"}
    for block in ("X", "F", "G", "status"):
        union = np.concatenate([getattr(COARSE, block), getattr(FINE, block)])
        np.testing.assert_array_equal(getattr(table, block), union)
    np.testing.assert_array_equal(table.column("heat"), [4, 5, np.nan, np.nan, np.nan])
    assert (table.layout.lower.tolist(), table.layout.upper.tolist()) == ([0.0], [2.0])
    # A design that both experiments have tested counts once.
    assert table.repeats.tolist() == [False, False, True, False, False]
    assert table.pareto().tolist() == [False, True, False, False, False]
    assert table.ranking().rank.tolist() == rank_of_efficiency([[1.0, -2.0]]).rank.tolist()
    boundless = replace(FINE, layout=replace(FINE.layout, lower=[np.nan]))
    assert np.isnan(TestTable.combined({"a": COARSE, "b": boundless}).layout.lower).all()


def test_where_tests_are_from_survives_parts_files_and_formulations(tmp_path):
    table = TestTable.combined({"coarse": COARSE, "fine": FINE})
    table.to_csv(tmp_path / "all.csv")
    assert read_table(tmp_path / "all.csv").equals(table)
    frame = pd.read_csv(tmp_path / "all.csv", index_col="test_point")
    assert frame["experiment"].tolist() == table.column("experiment").tolist()
    assert frame["number"].tolist() == table.column("number").tolist()
    assert table.take([3, 0]).column("experiment").tolist() == ["fine", "coarse"]
    asked = Formulation(limits={"x1": (0.75, None)})
    apart = {"coarse": COARSE.under(asked), "fine": FINE.under(asked)}
    assert table.under(asked).equals(TestTable.combined(apart))


def test_what_is_not_one_problem_is_refused():
    table = TestTable.of([1], [[0.1]], [[1.0]])
    other = TestTable.of([1], [[0.1]], [[1.0]], layout=Layout.of(1, ["mass"]))
    sub = table.under(Formulation(objectives=["r"], computed={"r": "f1 * 2"}))
    turned = replace(table, layout=replace(table.layout, maximize=("f1",)))
    bnh = investigate(get_problem("bnh"), 4)
    another = replace(bnh, problem={**bnh.problem, "parameters": {"c": 1}})
    for tables, message in [
        (
            {"a": table, "b": other},
            "tables must be of one problem and formulation .*objectives .*f1.* against .*mass",
        ),
        ({"a": table, "b": sub}, "under one formulation .*, got several; give each"),
        ({"a": table, "b": turned}, "direction of f1 min against max"),
        ({"a": bnh, "b": another}, "parameters"),
        (
            {"a": table, "b": replace(table, F=[[2.0]])},
            "1.0 and 2.0 as f1 of test point 1 of a and test point 1 of b",
        ),
        ([table], "experiments must be tables by name"),
    ]:
        refused(message, TestTable.combined, tables)
    named = TestTable.of([1], [[0.1]], [[1.0]], layout=Layout.of(["number"], 1))
    refused(
        "an extra column must be .* named unlike other columns, got 'number'",
        TestTable.combined,
        {"a": named},
    )
