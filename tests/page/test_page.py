"""The decision page in Python: what it holds, what it opens with, and what is refused."""

import json

import numpy as np
import pandas as pd
import pytest
from pymoo.problems import get_problem

from pymoo_psi import Decision, Formulation, TestTable, investigate, rank_of_efficiency
from pymoo_psi.page import decision_page
from pymoo_psi.pareto import SENTENCES, nondominated
from pymoo_psi.table import Schema
from tests.helpers.beams import OBJECTIVES, beams, page_of_beams
from tests.helpers.documents import column_of, payload_of
from tests.helpers.refusals import refused


def test_all_designs_are_there_with_every_digit():
    page, frame = page_of_beams(), beams()
    assert repr(page) == "DecisionPage('Beams <&> such': 400 designs)"
    sent = payload_of(page)
    assert [(c["name"], c["role"], c["unit"], c["maximize"]) for c in sent["columns"][:5]] == [
        ("mass", "objective", "kg", False),
        ("cost, total", "objective", "", False),
        ("strength", "objective", "", True),
        ("width", "variable", "mm", False),
        ("material", "variable", "", False),
    ]
    assert sent["names"] == [*frame["number"], "prototype"]
    for name in [*OBJECTIVES, "width"]:
        np.testing.assert_array_equal(column_of(sent, name)[:-1], frame[name])
    optimal = nondominated((frame[OBJECTIVES] * [1, 1, -1]).to_numpy())
    np.testing.assert_array_equal(column_of(sent, "optimal"), optimal)
    assert sent["sentences"] == SENTENCES


def test_numbers_of_runs_are_no_columns_of_a_page(tmp_path):
    problem = get_problem("bnh")
    investigate(problem, 8, study=tmp_path / "s.db")
    investigate(problem, 8, study=tmp_path / "s.db", sampling="sobol", seed=1)
    columns = payload_of(decision_page(tmp_path / "s.db"))["columns"]
    assert [column["name"] for column in columns] == ["f1", "f2", "x1", "x2"]


def test_a_page_has_what_its_table_knows():
    schema = Schema.of(
        1, ["mass", "gain"], 1, outputs=["heat"], maximize=["gain"], units={"mass": "kg"}
    )
    table = TestTable.of(
        [1, 2, 3, 4],
        [[0.1], [0.2], [0.3], [0.4]],
        [[1, -1], [2, -4], [3, -3], [np.inf, np.inf]],
        G=[[-1], [-1], [1], [0]],
        outputs={"heat": [5, 6, 7, 8]},
        reasons={4: "no mesh"},
        schema=schema,
    )
    page = decision_page(table)
    sent = payload_of(page)
    assert sent["names"] == ["test 1", "test 2"]
    assert [column_of(sent, name).tolist() for name in ("gain", "heat")] == [[1, 4], [5, 6]]
    remark = "2 of 4 tests are on the page (2 ok, 1 infeasible, 1 failed)."
    assert f'<p class="hint">{remark}</p>' in page.html()


def test_existing_designs_have_names_of_their_own():
    old = beams().iloc[[3]].set_index("number")
    assert payload_of(page_of_beams(prototype=old))["names"][-1] == "B1004 (existing)"


def content(**changes):
    """A decision on the beams, as the page writes it."""
    return {
        "objectives": OBJECTIVES,
        "maximize": ["strength"],
        "limits": {"mass": [None, 0.6], "width": [3, None], "material": ["steel"]},
        "computed": {"ratio": "strength / mass"},
        "normalize": True,
        "chosen": "B1089",
        "reason": "lighter than the old one",
        "page": {"date": "2026-01-31", "state": {}},
    } | changes


def test_a_page_opens_with_a_decision(tmp_path):
    path = tmp_path / "d.json"
    path.write_text(json.dumps(content()))
    page = decision_page(beams(), Decision.read_json(path))
    assert content().items() <= payload_of(page)["opens_with"].items()
    assert len(page.table) == 400  # limits can be moved on the page


REJECTED = TestTable.of([1], [[0.0]], [[1.0, 2.0]], [[1.0]])


@pytest.mark.parametrize(
    ("table", "received"), [(REJECTED, "in 1 design"), (REJECTED.take([]), "in 0 designs")]
)
def test_a_page_needs_a_feasible_design(table, received):
    refused(f"of one feasible design or more, got none {received}", decision_page, table)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"formulation": Formulation(["mas"])}, "got 'mas'; did you mean 'mass'?"),
        (
            {"formulation": Formulation(OBJECTIVES, limits={"depth": 1.0})},
            "a name in limits must be one of .* got 'depth'",
        ),
        (
            {"formulation": Formulation(OBJECTIVES, limits={"material": 1.0})},
            "only columns of numbers can be limited",
        ),
        (
            {
                "formulation": Formulation(
                    OBJECTIVES, maximize=["strength"], limits={"strength": 0.5}
                )
            },
            r"\(0.5, None\) for at least",
        ),
        (
            {
                "source": beams().assign(proposal_round=1),
                "formulation": Formulation(OBJECTIVES, limits={"proposal_round": 1}),
            },
            "a limit of a page must be one of .* got 'proposal_round'; leave out the rows",
        ),
        ({"source": beams().iloc[:0]}, "a frame with rows"),
        (
            {"source": rank_of_efficiency([[1, 2], [2, 1]])},
            r"source must be .*, got EfficiencyRanking\(",
        ),
        ({"prototype": 9}, r"prototype must be of shape \(n, m\)"),
        (
            {"prototype": beams().assign(mass=[np.nan, *range(1, len(beams()))])},
            r"the prototype: row 1 .* by read_table\(\.\.\., drop_incomplete=True\)",
        ),
    ],
)
def test_mistakes(change, message):
    refused(message, page_of_beams, **change)


@pytest.mark.parametrize(
    ("values", "ends", "log"),
    [
        ([*np.linspace(1, 3, 298), 1e30, 1e30], [1, 3], False),
        ([*np.linspace(-1, 3, 299), -1e30], [-1, 3], False),
        ([*np.logspace(0, 6, 300), 1e30], [1, 1e6], True),
        ([0.0] * 290 + [1.0] * 10, [0, 1], False),
        ([5.0] * 4, [5, 5], False),
        ([1.0, 1000.0], [1, 1000], False),
        ([np.finfo(float).max, -np.finfo(float).max, 5e-324], None, False),
    ],
)
def test_outliers_set_no_scale(values, ends, log):
    rows = np.arange(len(values))
    frame = pd.DataFrame({"a": rows, "b": -rows, "heat": values})
    heat = payload_of(decision_page(frame, ["a", "b"]))["columns"][2]
    assert ends is None or heat["axis"] == pytest.approx(ends)
    assert heat["log"] is log


@pytest.mark.parametrize(
    ("columns", "decimals"),
    [
        # Where the optimal designs have no digits, those of other designs count.
        ({"a": [0, 1, 2], "b": [1, 0, 2], "heat": [np.nan, np.nan, 1 / 3]}, [0, 0, 4]),
        ({"a": [0, 1, 2], "b": [1, 0, 2], "heat": [0.0, 0.0, 1 / 3]}, [0, 0, 4]),
        # Short numbers are written as in the file.
        ({"a": [1.5, 2.0, 65.4], "b": [300.0, 49.65, 20.5], "c": [0, 100 / 3, 100]}, [1, 2, 1]),
    ],
)
def test_numbers_have_the_decimals_that_tell_designs_apart(columns, decimals):
    sent = payload_of(decision_page(pd.DataFrame(columns), ["a", "b"]))
    assert [one["notation"]["decimals"] for one in sent["columns"][:3]] == decimals


def test_scales_and_digits_are_those_of_the_optimal_designs():
    """Dominated designs, however many, set neither range nor scale nor digits."""
    front, behind = np.linspace(1, 2, 31), np.linspace(2.1, 7, 40)
    optimal = pd.DataFrame({"a": front, "b": front[::-1], "heat": np.sqrt(front)})
    dominated = pd.DataFrame({"a": behind, "b": behind, "heat": 1000 * np.sqrt(behind)})
    alone, both = (
        [{fact: column[fact] for fact in ("log", "notation")} for column in columns[:3]]
        for columns in (
            payload_of(decision_page(frame, ["a", "b"]))["columns"]
            for frame in (optimal, pd.concat([dominated, optimal]))
        )
    )
    assert both == alone


def test_no_design_looks_dominated_as_its_objectives_are_written(said, in_folder):
    """One digit more where two designs would seem to have the same value; elsewhere none."""
    a, b = [37.0649, 37.1351, 1 / 3, 99.777], [16.4512, 16.2349, 55.512, 1 / 3]
    pd.DataFrame({"a": a, "b": b}).to_csv("t.csv", index=False)
    sent = payload_of(decision_page("t.csv", ["a", "b"]))
    assert [one["notation"]["decimals"] for one in sent["columns"]] == [2, 1]
    printed = said("rank", "t.csv", "--objectives", "a,b")
    assert all(text in printed for text in ("37.06", "37.14", "16.5", "16.2"))
