"""Tests that people make: `ask` and `tell`, two files at once, repeats, corrections, mixtures."""

import json
import subprocess
import sys
from functools import partial

import numpy as np
import pandas as pd
import pytest
from pymoo.core.variable import Binary, Choice, Integer
from pymoo.problems import get_problem

from pymoo_psi import ProgramProblem
from pymoo_psi.algorithms import RunOptions, ask_tests, tell_tests
from pymoo_psi.cli import main
from pymoo_psi.files import read_table
from tests.helpers.exact_csv import EXACT
from tests.helpers.models import Model
from tests.helpers.refusals import refused
from tests.helpers.studies import sql

ALLOY = """
name = "alloy"
[variables]
a = {bounds = [0, 0.6], unit = "kg"}
b = {bounds = [0, 0.6]}
c = {bounds = [0, 1]}
mould = {choices = ["sand", "steel", 12]}
[outputs]
strength = {unit = "MPa"}
where = {}
cost = {expression = "3*a + 2*b + c"}
[objectives]
maximize = ["strength"]
minimize = ["cost"]
[limits]
where = "<= 0.5"
[requirements]
mix = "a + b + c = 1"
"""


@pytest.fixture
def alloy(tmp_path, in_folder):
    (tmp_path / "alloy.toml").write_text(ALLOY, "utf-8")


def asked(name, *words):
    assert main(["ask", "alloy.toml", "--study", "lab.db", "--out", name, *map(str, words)]) == 0
    reader = partial(pd.read_csv, **EXACT) if name.endswith(".csv") else pd.read_excel
    return reader(name).astype({"failure": object})


@pytest.fixture
def told(said):
    """Tell the study a frame; return what the command says."""

    def command(frame, *words, code=0):
        frame.to_csv("told.csv", index=False)
        return said("tell", "told.csv", "--study", "lab.db", *words, code=code)

    return command


def filled(frame, rows=slice(None)):
    frame = frame.copy()
    frame.loc[rows, "strength [MPa]"] = 200 + 10 * frame["test"]
    frame.loc[rows, "where"] = 0.25
    return frame


def stored():
    """The strengths by test, and how often the study was changed."""
    tests = sql("lab.db", "SELECT test, strength FROM tests WHERE status NOT NULL ORDER BY test")
    return dict(tests), len(sql("lab.db", "SELECT * FROM log"))


def test_a_missing_package_is_noticed_before_designs_are_asked(
    alloy, tmp_path, monkeypatch, capsys
):
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    assert main(["ask", "alloy.toml", "--study", "lab.db", "--out", "asked.xlsx"]) == 2
    assert "pip install openpyxl" in capsys.readouterr().err
    assert not (tmp_path / "lab.db").exists()


def test_two_files_in_turns_lose_nothing(alloy, told):
    first, second = asked("first.csv", "--points", 3), asked("second.xlsx", "--points", 2)
    assert [*first["test"], *second["test"]] == [1, 2, 3, 4, 5]
    designs = pd.concat([first, second])[["a [kg]", "b", "c", "mould"]]
    assert len(designs.drop_duplicates()) == 5
    assert "no outputs of the study: heat." in told(filled(second, [1]).assign(heat=7))
    repeated = filled(first, [0, 2])
    repeated = pd.concat([repeated, repeated.tail(1)], ignore_index=True)
    repeated.loc[3, "strength [MPa]"] = 231.5
    for frame in (repeated, repeated, repeated.iloc[::-1], filled(second, [1])):
        told(frame)
        assert stored() == ({1: 210, 3: 230, 5: 250, 6: 231.5}, 0)
    assert "Pending tests: 4." in told(filled(first))
    assert asked("again.csv", "--points", 0)["test"].tolist() == [4]
    repeated.loc[2, "strength [MPa]"] = 229
    assert "a file without those of tests 3, 6" in told(repeated.iloc[2:3], code=2)
    assert "Test 3 corrected: strength = 229 instead of 230." in told(repeated)
    assert stored() == ({1: 210, 2: 220, 3: 229, 5: 250, 6: 231.5}, 1)
    # The test that other runs look for.
    assert sql("lab.db", "SELECT repeat FROM tests WHERE test = 3") == [(1,)]


def test_a_later_result_corrects_the_former_one(alloy, told):
    frame = filled(asked("next.csv"), [0, 1])
    told(frame)
    other = frame.iloc[[1]].assign(**{"strength [MPa]": 500})
    assert "Test 2 corrected: strength = 500 instead of 220." in told(other)
    ((content,),) = sql("lab.db", "SELECT what FROM log")
    assert json.loads(content)["cells"]["strength"] == 220
    other[["strength [MPa]", "where", "failure"]] = [np.nan, np.nan, "cracked"]
    assert "reason = cracked instead of none" in told(other)
    assert read_table("lab.db").reasons == {2: "cracked"}
    told(frame)
    assert stored() == ({1: 210, 2: 220}, 3)


def test_fifteen_digits_are_the_design_asked_for(alloy, told):
    frame = filled(asked("next.csv"))
    digits = ["a [kg]", "b", "c"]
    pending = ask_tests(ProgramProblem.from_toml("alloy.toml"), 0, RunOptions(study="lab.db"))
    exact = pending[["a", "b", "c"]].to_numpy()
    assert (frame[digits].to_numpy() != exact).any()
    frame.loc[0, "c"] -= 0.001
    frame.loc[3, "mould"] = "steel"
    told(frame)
    table = read_table("lab.db")
    assert (table.X[1:, :3].astype(float) == exact[1:]).all()
    assert (table.column("c")[0], table.column("mould")[3]) == (frame.loc[0, "c"], "steel")
    assert table.status.tolist() == ["ok"] * 4  # shares are weighed


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("test", 99, "a test that was asked for"),
        ("test", 1.5, "row 2, test must be one integer number"),
        ("mould", "wood", "did you mean|'sand'"),
        ("failure", "cracked", "either results or the reason"),
        ("strength [MPa]", np.inf, "row 2, strength must be one real number"),
        ("strength [MPa]", "firm", "strength"),
    ],
)
def test_a_wrong_row_is_refused_with_all_others(alloy, column, value, message):
    frame = filled(asked("next.csv"))
    frame[column] = frame[column].astype(object)
    frame.loc[1, column] = value
    refused(
        message,
        tell_tests,
        frame.rename(columns={"strength [MPa]": "strength", "a [kg]": "a"}),
        "lab.db",
    )
    assert stored() == ({}, 0)


def test_a_variable_named_as_a_column_of_the_sheet_is_refused(study_file):
    problem = ProgramProblem({"failure": (0, 1)}, None, {"f": {}}, {"minimize": ["f"]})
    refused("unlike the column failure", ask_tests, problem, 2, RunOptions(study=study_file))
    assert not study_file.exists()


@pytest.mark.parametrize(
    ("name", "second", "names"),
    [
        ("a: b", {"choices": [1, 2]}, None),
        ("a", {"bounds": [1, 2]}, {"x1": "width", "f1": "f", "f2": "cost"}),
    ],
    ids=["a choice of numbers", "a variable of another name"],
)
def test_requirements_hold_for_what_was_tested(study_file, name, second, names):
    problem = ProgramProblem(
        {name: {"bounds": [0, 1]}, "n": second},
        None,
        {"f": {}, "cost": {}},
        {"minimize": ["f", "cost"]},
        requirements={"r": f"`{name}` + n <= 2.5"},
    )
    frame = ask_tests(problem, 2, RunOptions(study=study_file, names=names))
    width, n = frame.columns[1:3]
    frame[[width, n, "f", "cost"]] = [[1, 1, 5, 5], [1, 2, 4, 4]]
    tell_tests(frame, study_file)
    assert read_table(study_file).status.tolist() == ["ok", "infeasible"]


SMALL = Model(
    dict,
    vars={"n": Integer(bounds=(1, 3)), "on": Binary(), "c": Choice(options=["a", "b"])},
    n_obj=1,
)


def test_discrete_designs_are_asked_for_once_by_either_algorithm(tmp_path):
    options = RunOptions(study=tmp_path / "small.db")
    frames = [ask_tests(SMALL, 5, options), ask_tests(SMALL, 6, options, with_surrogates=True)]
    designs = pd.concat(frames)
    assert len(designs[["n", "on", "c"]].drop_duplicates()) == 11
    designs["f1"] = designs["n"].astype(float)
    designs["on"] = designs["on"].map(lambda on: str(bool(on)).upper())  # as spreadsheets do
    tell_tests(designs, options.study)
    assert read_table(options.study).X[:, 1].tolist() == [on == "TRUE" for on in designs["on"]]
    refused("at most 1", ask_tests, SMALL, 2, options)


def results_of(problem, frame):
    out = problem.evaluate(frame[["x1", "x2"]].to_numpy(float), return_as_dictionary=True)
    frame = frame.copy()
    frame[["f1", "f2", "g1", "g2"]] = np.hstack([out["F"], out["G"]])
    return frame


def test_surrogates_know_results_and_pending_designs(tmp_path, in_folder):
    problem = get_problem("bnh")
    options = RunOptions(study="bnh.db", seed=1)
    frames = []
    for _ in range(8):
        frames.append(ask_tests(problem, 4, options, with_surrogates=True))
        tell_tests(results_of(problem, frames[-1].iloc[1:]), options.study)
    designs = pd.concat(frames)
    assert len(designs[["x1", "x2"]].drop_duplicates()) == len({*designs["test"]}) == 32
    table = read_table(options.study)
    proposed = table.column("proposal_round") > 0
    assert proposed.sum() == 9
    assert table.pareto()[proposed].mean() > 0.7
    words = "ask bnh --study bnh.db --out next.csv --points 2 --algorithm surrogate --limits f1<=5"
    assert main(words.split()) == 0
    directed = pd.read_csv("next.csv")
    assert (4 * directed["x1"] ** 2 + 4 * directed["x2"] ** 2 < 7).all()


@pytest.mark.slow
def test_processes_that_ask_at_once_get_different_designs(alloy):
    asked("first.csv")
    command = [sys.executable, "-m", "pymoo_psi", "ask", "alloy.toml", "--study", "lab.db"]
    processes = [subprocess.Popen([*command, "--out", name]) for name in ("a.csv", "b.csv")]
    assert [process.wait() for process in processes] == [0, 0]
    assert sorted([*pd.read_csv("a.csv")["test"], *pd.read_csv("b.csv")["test"]]) == [*range(5, 13)]
