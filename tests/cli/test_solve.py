"""``pymoo-psi solve``: the library's run, limits, boxes, studies, failures, interruption."""

import json
import os
import signal
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import (
    PSI,
    Decision,
    FailureTolerant,
    Formulation,
    QMCSampling,
    Recorded,
    Restricted,
    SurrogatePSI,
    VectorizedSphereChute,
    investigate,
    nsga3,
    rank_of_efficiency,
)
from pymoo_psi.analysis import alike
from pymoo_psi.files import read_table
from tests.cli.conftest import joined
from tests.helpers.exact_csv import EXACT


def written(path="o.csv"):
    return pd.read_csv(path, **EXACT)


@pytest.mark.parametrize(
    ("words", "problem", "psi"),
    [
        (["chute", "--mu", 0.4, "--model", "rolling"],
         VectorizedSphereChute(0.4, model="rolling"), PSI(200)),
        (["chute", "--limits", "f1<=2.2, f4<=1.5"],
         VectorizedSphereChute(), PSI(200, limits={"f1": 2.2, "f4": 1.5})),
        (["chute", "--bounds", "x1=0.2:0.6, x2=:3"],
         Restricted(VectorizedSphereChute(), {"x1": (0.2, 0.6), "x2": (None, 3)}), PSI(200)),
                *((["bnh", "--sampling", engine, "--seed", 3], get_problem("bnh"),
           PSI(200, sampling=QMCSampling(engine))) for engine in ("sobol", "halton", "lhs")),
        (["bnh", "--algorithm", "surrogate", "--points", 24, "--seed", 3, "--limits", "f1<=60"],
         get_problem("bnh"), SurrogatePSI(24, limits={"f1": 60})),
    ],
)  # fmt: skip
def test_the_pareto_set_is_the_librarys(said, words, problem, psi):
    printed = said("solve", "--out", "o.csv", "--points", 200, *words)  # the last one counts
    result = minimize(problem, psi, seed=3)
    found = written().set_index("test").loc[result.opt.get("test_point")]
    objectives = [name for name in found if name[0] == "f"]
    np.testing.assert_array_equal(found[objectives], result.F)
    np.testing.assert_array_equal(found[[n for n in found if n[0] == "x"]], result.opt.get("X"))
    assert found["efficiency_rank"].tolist() == rank_of_efficiency(result.F).rank.tolist()
    assert found["place"].tolist() == rank_of_efficiency(result.F).place.tolist()
    assert f"{len(found)} designs written to o.csv" in printed


def test_a_problem_is_solved_as_asked(said):
    from models import Beam

    asked = Formulation(
        ["mass", "stiffness"], maximize=["stiffness"], limits={"height": (80, 180), "stress": 120},
        computed={"stiffness": "5 / deflection"},
    )  # fmt: skip
    Decision(asked).to_json("asked.json")
    options = ["--compute", "stiffness=5/deflection", "--objectives", "mass,stiffness",
               "--maximize", "stiffness", "--limits", "80<=height<=180,stress<=120"]  # fmt: skip
    table = investigate(Beam(), 200).under(asked)
    for words in (["--decision", "asked.json"], options):
        said("solve", "models:Beam", "--points", 200, *words, "--out", "o.csv")
        assert sorted(written()["test"]) == table.numbers[table.pareto()].tolist()


def test_mixed_variables_are_restricted(said):
    words = ["solve", "models:Mixed", "--points", 64, "--out", "o.csv"]
    said(*words, "--bounds", "n=2:4,steel=S235|S460", "--study", "s.db")
    table = read_table("s.db")
    assert {*table.column("steel")} == {"S235", "S460"}
    assert {*table.column("n")} == {2, 3, 4}
    said(*words, "--bounds", "steel=S355,a=0.5", "--limits", "n<=3")
    assert ({*written()["steel"]}, {*written()["a"]}) == ({"S355"}, {0.5})


def test_a_proposal_outside_of_narrower_bounds_is_reported(said):
    words = ["solve", "models:Mixed", "--points", 16, "--study", "s.db"]
    assert "outside the bounds" not in said(*words)
    printed = " ".join(said(*words, "--bounds", "n=5:9").split())
    assert (
        'The proposal is outside the bounds of the problem; exclude it by --limits "n>=5".'
        in printed
    )
    assert "outside the bounds" not in said(*words, "--bounds", "n=5:9", "--limits", "n>=5")


@pytest.mark.filterwarnings("default:no test has")
def test_an_output_of_some_designs_may_have_a_limit(said):
    words = ["solve", "models:Mixed", "--study", "m.db", "--points"]
    said(*words, 1)  # which has none
    said(*words, 16, "--limits", "load<=0.8", "--out", "o.csv")
    assert (written()["load [kN]"] <= 0.8).all()


def test_nsga3_continues_a_study(said):
    words = ["solve", "osy", "--algorithm", "nsga3", "--points", 200]
    said(*words, "--out", "alone.csv")
    alone = written("alone.csv")[["f1", "f2"]].to_numpy().tolist()
    assert sorted(alone) == sorted(nsga3(get_problem("osy"), n_evaluations=200, seed=1).F.tolist())
    problem = Recorded(FailureTolerant(get_problem("osy")), study="osy.db")
    minimize(problem, NSGA2(20), ("n_gen", 1), seed=1)  # the seed gives the same first designs
    for stored in (20, 200):
        printed = said(*words, "--study", "osy.db", "--out", "o.csv")
        added = f"{200 - stored} tests, " if stored < 200 else "no new test."
        assert f"This run: {added}" in printed
    table = read_table("osy.db")
    assert sorted(written("o.csv")["test"]) == sorted(table.numbers[table.pareto()])
    assert all(F in table.F.tolist() for F in alone)


def test_a_model_that_hangs_or_dies_fails_alone(said):
    """With --jobs or --timeout no design is evaluated in the process of the command."""
    words = ["solve", "models:Hard", "--points", 16, "--study", "s.db", "--study-key"]
    assert "16 tests, 2 failed" in said(*words, "v1", "--jobs", 2, "--timeout", 2)
    assert "key" in said(*words, "v2", code=2)


def test_failures_are_counted_and_tried_again(said):
    words = ["--points", 64, "--study", "s.db"]
    printed = joined(said("solve", "models:Root", *words))
    assert "Caution: 32 of 64 tests failed: OSError: no licence; ValueError: " in printed
    for points, given, left in ((64, [], 32), (66, ["--retry", "failed"], 0)):
        words[1] = points
        printed = said("solve", "models:Mended", *words, *given)
        assert (read_table("s.db").status == "failed").sum() == left
    assert "; 32 evaluated again." in printed


def test_failures_that_differ_in_numbers_alone_are_one_reason(run):
    """Exit codes and names are none of these numbers."""
    reasons = ["step 3: f1 is 0.5", "step 12: f1 is 7e-3", "step 3: f2 is 1", "exit code 3: at 1"]
    assert alike([*reasons, "exit code 4: at 1", "exit code 4: at 22"]) == [
        *["step …: f1 is …"] * 2,
        "step 3: f2 is 1",
        "exit code 3: at 1",
        *["exit code 4: at …"] * 2,
    ]


@pytest.mark.parametrize("algorithm", ["psi", "surrogate", "nsga3"])
def test_a_command_answers_with_the_whole_study(said, algorithm):
    """With its Pareto set, however few tests the command has added."""
    words = ["solve", "bnh", "--study", "s.db", "--out", "o.csv"]
    said(*words, "--points", 96)
    (before,) = read_table("s.db").best().names
    more = ["--algorithm", algorithm, "--points", 12 if algorithm == "nsga3" else "+12"]
    printed = joined(said(*words, *more, "--bounds", "x1=0.3:0.7"))
    said("rank", "s.db", "--out", "ranked.csv")
    ranked = written("ranked.csv")
    columns = ["place", "test", "f1", "f2", "mu1", "mu2", "mu3", "efficiency_rank"]
    optimal = ranked[ranked["pareto"]].reset_index(drop=True)
    pd.testing.assert_frame_equal(written("o.csv")[columns], optimal[columns], check_dtype=False)
    table = read_table("s.db")
    n_new = (table.take(table.pareto())["run"] == 2).sum()
    (best,) = table.best().names
    assert f"This run: 12 tests, {n_new} of them not dominated" in printed
    assert f"Proposed: {best} (f1 " in printed
    assert best == before or f"(before: {before})" in printed


@pytest.mark.parametrize(
    ("words", "shape"),
    [
        (["dtlz2", "--n-obj", 4, "--n-var=7"], [7, 4]),
        (["models:Sized", "--length", 2.5], [2, 2]),
        (["models:Sized", "--length", 2.5, "--n-ribs", 5], [5, 2]),
        (["models:Long", "--steel", "False"], [2, 2]),
    ],
)
def test_a_problem_is_made_of_options(said, words, shape):
    said("solve", *words, "--points", 64, "--out", "o.csv")
    assert [sum(name[0] == letter for name in written()) for letter in "xf"] == shape


def test_a_runner_of_a_module_evaluates(said):
    Path("site_runner.py").write_text(
        "from pymoo_psi import ProcessRunner\nrunner = ProcessRunner(n_jobs=1)\n"
    )
    words = ["solve", "models:Mended", "--points", 8]
    printed = said(*words, "--cluster", "site_runner:runner")
    assert printed.startswith(said(*words).partition("Next: ")[0])


@pytest.fixture
def interruptible():
    """A job in the background ignores SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("more", [["--study", "s.db"], ["--algorithm", "nsga3"]])
def test_an_interruption_is_reported_in_a_line(run, more, interruptible):
    code, printed, err = run("solve", "models:Stopped", "--points", 100, "--out", "o.csv", *more)
    kept = "see s.db; the same command" if "s.db" in more else "nothing is kept"
    assert (code, printed, err.count("\n")) == (130, "", 1)
    assert err.startswith(f"pymoo-psi: interrupted; {kept}")
    assert "s.db" not in more or len(read_table("s.db")) == 6
    assert not [name for name in os.listdir() if name.endswith((".csv", ".tmp"))]


@pytest.mark.parametrize("algorithm", ["psi", "surrogate"])
def test_texts_of_a_decision_limit_every_search(said, algorithm):
    decision = {"objectives": ["f1", "f2"], "limits": {"steel": ["S355"]}}
    Path("d.json").write_text(json.dumps(decision))
    options = ("--points", 24, "--decision", "d.json", "--algorithm", algorithm, "--out", "o.csv")
    assert "(steel = S355)" in said("solve", "models:Mixed", *options)
    assert set(read_table("o.csv")["steel"]) == {"S355"}
