"""Tests from elsewhere: what of a source becomes tests of a study, and what is said of the rest."""

import numpy as np
import pandas as pd
import pytest
from pymoo.core.variable import Binary, Choice, Real
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import (
    LPTauSampling,
    ProgramProblem,
    Restricted,
    SurrogatePSI,
    investigate,
    read_table,
)
from pymoo_psi.algorithms import RunOptions, ask_tests, import_tests, tell_tests
from tests.algorithms.test_noisy import queue
from tests.helpers.draws import rarely
from tests.helpers.models import Model
from tests.helpers.refusals import refused


@pytest.fixture
def lab():
    return ProgramProblem(
        {"a": (0, 1)},
        None,
        {
            "f": {"unit": "kg"},
            "g": {},
            "h": {},
            "ratio": {"expression": "f/g"},
            "double": {"expression": "2*ratio + h"},
        },
        {"minimize": ["f", "ratio"]},
        {"double": "<= 50"},
    )


@pytest.fixture
def options(study_file):
    return RunOptions(study=study_file)


RESULTS = pd.DataFrame({"a": [0.5, 0.25, 0.75], "f": [1.5, 2.5, 1.0], "g": [2.0, 1.0, 3.0]})
WHOLE = RESULTS.assign(h=1.0)
NEEDED = "a column that the problem needs must be one of .* got"


def with_a_second(value):
    return WHOLE.assign(a=pd.Series([0.5, value, 0.75], dtype=object))


def test_a_contradiction_is_said_and_the_computed_value_counts(lab, options):
    frame = WHOLE.assign(ratio=[0.75, 99.0, 0.333333], double=[2.5, np.nan, 77.0])
    assert import_tests(lab, frame, options).remarks[1:] == (
        "ratio of 1 test is given otherwise than computed from f/g, which counts: "
        "99 in row 2, computed 2.5.",
        "double of 1 test is given otherwise than computed from 2*ratio + h, which counts: "
        "77 in row 3, computed 1.66667.",
    )
    asked = ask_tests(lab, 2, options)
    asked[["f", "g", "h", "ratio"]] = [[3.0, 4.0, 1.0, 0.75], [3.0, 4.0, 1.0, 8.0]]
    assert tell_tests(asked, options.study)[1:-1] == [
        "ratio of 1 test is given otherwise than computed from f/g, which counts: "
        "8 in row 2, computed 0.75."
    ]


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        # Operands of what is needed are needed, also where their results are given.
        (RESULTS, f"{NEEDED} 'h'"),
        (RESULTS.assign(ratio=1.0, double=1.0), f"{NEEDED} 'h'"),
        (WHOLE.drop(columns="a"), f"{NEEDED} 'a'"),
        (WHOLE.rename(columns={"f": "f [g]"}), r"'f \[g\]'"),
        (
            pd.concat([WHOLE, WHOLE.head(1).assign(f=4.0)]),
            "one of each design if the model is not noisy",
        ),
        (with_a_second(np.inf), "row 2, a must be one real number"),
        (with_a_second("1,5x"), "row 2, a must be one real number"),
        (with_a_second(""), "row 2, a must be one real number"),
    ],
)
def test_what_has_no_tests_of_the_problem_is_refused(lab, options, frame, message):
    refused(message, import_tests, lab, frame, options)
    assert not options.study.exists()


@pytest.mark.parametrize("form", ["study", "csv", *rarely("table", "frame")])
def test_every_test_of_a_noisy_model_is_taken_once(form, options, tmp_path):
    first = tmp_path / "a.db"
    investigate(queue(), 8, repeat=3, study=first)
    tests = read_table(first, average_by=False)
    tests.to_csv(tmp_path / "a.csv")
    source = {
        "study": first,
        "csv": tmp_path / "a.csv",
        "table": tests,
        "frame": pd.DataFrame({name: tests[name] for name in tests.schema.names}),
    }[form]
    for remark in ("24 of 24 tests taken", "0 of 24 tests taken, 24"):
        assert import_tests(queue(), source, options).remarks[0].startswith(remark)
    # Means are equal, in whatever order, and the study has the tests of these seeds.
    investigate(queue(), 8, repeat=2, study=options.study)
    means = read_table(options.study)
    np.testing.assert_array_equal(np.sort(means.F, axis=0), np.sort(read_table(first).F, axis=0))
    assert (means["tests"] == 3).all()


@pytest.mark.parametrize("form", ["csv", *rarely("table", "frame")])
def test_means_of_tests_are_no_tests(form, options, tmp_path):
    means = investigate(queue(), 8, repeat=3)
    means.to_csv(tmp_path / "means.csv")
    source = {"csv": tmp_path / "means.csv", "table": means, "frame": means.to_frame()}[form]
    refused(
        "single ones, got means with 'f1 standard error'; give the study",
        import_tests,
        queue(),
        source,
        options,
    )


BNH = get_problem("bnh")


def test_a_file_of_fifteen_digits_has_the_designs_of_the_study(options, study_file, tmp_path):
    problem = Model(lambda x: {"F": [x[0], 1 - x[1]]}, n_var=2, xl=0.1, xu=0.375)
    table = investigate(problem, 16, study=tmp_path / "whole.db")
    digits = [[float(f"{value:.15g}") for value in row] for row in np.hstack([table.X, table.F])]
    frame = pd.DataFrame(digits, columns=table.schema.names)
    assert (frame[["x1", "x2"]].to_numpy() != table.X).any()
    known = import_tests(problem, frame, RunOptions(study=tmp_path / "whole.db"))
    assert known.remarks == ("0 of 16 tests taken, 16 known already.",)
    import_tests(problem, frame, options)
    asked = ask_tests(problem, 2, options)[["x1", "x2"]]
    assert np.array_equal(asked, LPTauSampling().do(problem, 18).get("X")[16:])


def test_infeasible_rows_are_kept_and_surrogates_learn_from_them(options, tmp_path):
    table = investigate(BNH, 96)
    table.to_csv(tmp_path / "old.csv")
    tests = import_tests(BNH, tmp_path / "old.csv", options)
    assert tests.remarks[0] == "96 of 96 tests taken, 0 known already."
    assert tests.status.tolist() == table.status.tolist()
    new = minimize(BNH, SurrogatePSI(4, study=options.study), seed=1).algorithm.table
    assert (new["proposal_round"] > 0).all()  # the 96 tests stand for the first points


HOT = pd.DataFrame(
    {"x1": [1.0, 2.0], "x2": 0.5, "f1": [7.0, 8.0], "f2": 9.0, "heat": 5.0, "g1": -1.0, "g2": -1.0}
)


def test_choices_outside_a_box_are_tests_too(options, tmp_path):
    material = Model(
        lambda x: {"F": x["x"]},
        vars={"x": Real(bounds=(0, 1)), "m": Choice(options=["steel", 12, "12"])},
        n_obj=1,
    )
    whole = investigate(material, 12, study=tmp_path / "whole.db")
    part = Restricted(material, {"m": ["steel"]})
    assert import_tests(part, tmp_path / "whole.db", options).X.tolist() == whole.X.tolist()


@pytest.mark.parametrize("of_two_runs", [False, True])
def test_further_outputs_are_taken_and_failed_tests_are_counted(of_two_runs, options, tmp_path):
    """Those of a frame, too; a binary variable has no bounds."""
    problem = Model(
        lambda x: {"F": x["x"], "heat": x["x"] + x["lid"]},
        fails=lambda x: x["x"] > 0.8,
        vars={"x": Real(bounds=(0, 1)), "lid": Binary()},
        n_obj=1,
    )
    study = tmp_path / "a.db"
    investigate(problem, 16, study=study)
    if of_two_runs:
        minimize(problem, SurrogatePSI(4, study=study))
    table = read_table(study)
    tests = import_tests(problem, table.to_frame() if of_two_runs else study, options)
    ran = table.status != "failed"
    np.testing.assert_array_equal(tests["heat"], table["heat"][ran])
    assert [remark.split()[0] for remark in tests.remarks] == [f"{ran.sum()}", f"{(~ran).sum()}"]


def test_further_outputs_of_known_tests_of_a_noisy_model_are_not_added(options):
    frame = HOT[["x1", "x2", "f1", "f2", "heat"]]
    import_tests(queue(xu=5), frame.drop(columns="heat"), options)
    more = pd.concat([frame, frame.assign(f1=1.0)])
    for taken in ("2 of 4 tests taken, 2", "0 of 4 tests taken, 4"):
        assert import_tests(queue(xu=5), more, options).remarks == (
            f"{taken} known already.",
            "Further outputs of known tests are not added: the model is noisy.",
        )
    np.testing.assert_array_equal(
        read_table(options.study, average_by=False)["heat"], [np.nan, np.nan, 5.0, 5.0]
    )


def test_a_share_takes_no_tests_from_elsewhere(tmp_path):
    options = RunOptions(study=tmp_path / "shares", share=(1, 2))
    refused("share must be left out .* 'pymoo-psi export'", import_tests, queue(), RESULTS, options)
    assert not (tmp_path / "shares").exists()
