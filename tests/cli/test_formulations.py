"""Formulations and experiments from the command line: an engineer's day with a beam."""

import json
import re

import numpy as np
import pandas as pd
import pytest
from pymoo.problems import get_problem

from pymoo_psi import Formulation, TestTable, investigate
from pymoo_psi.cli._app import main
from pymoo_psi.problems import Restricted
from tests.table.exact_csv import EXACT

BEAM = '''
import numpy as np
from pymoo.core.problem import Problem

class Beam(Problem):
    """A cantilever of 2 m with a box section under 5 kN at its end, made of steel."""

    names = {"x1": "height", "x2": "width", "x3": "wall",
             "f1": "mass", "f2": "deflection", "g1": "overstress"}
    units = {"height": "mm", "width": "mm", "wall": "mm", "mass": "kg",
             "deflection": "mm", "overstress": "MPa", "stress": "MPa"}

    def __init__(self):
        super().__init__(n_var=3, n_obj=2, n_ieq_constr=1, xl=[60, 40, 2], xu=[200, 120, 10])

    def _evaluate(self, x, out, *args, **kwargs):
        height, width, wall = x.T
        area = height * width - (height - 2 * wall) * (width - 2 * wall)
        inertia = (width * height**3 - (width - 2 * wall) * (height - 2 * wall)**3) / 12
        stress = 5000 * 2000 * height / 2 / inertia
        out["F"] = np.column_stack([7.85e-6 * 2000 * area, 5000 * 2000**3 / (3 * 210e3 * inertia)])
        out["G"] = stress - 160
        out["stress"] = stress
'''


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Run the command in a folder with the model; return what it prints, or its error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "beam.py").write_text(BEAM, "utf-8")

    def command(*words, code=0):
        found = main([*map(str, words)])
        printed = capsys.readouterr()
        assert found == code, printed.err
        return printed.out + printed.err

    return command


ASKED = ["--criterion", "stiffness = 5 / deflection", "--maximize", "stiffness",
         "--limits", "mass<=40, 80<=height<=180, stress<=120"]  # fmt: skip


def by_hand(table):
    """The formulation above on plain arrays: F minimised, and which tests are feasible."""
    F = np.column_stack([table.F, -5 / table.F[:, 1]])
    height, stress = table.X[:, 0], table.column("stress")
    inside = (table.F[:, 0] <= 40) & (height >= 80) & (height <= 180) & (stress <= 120)
    return F, inside & (table.status == "ok")


def test_an_engineers_day(run, tmp_path):
    """The same from the command line and from Python, and both as by hand."""
    from beam import Beam

    run("solve", "beam:Beam", "--points", 256, "--study", "coarse.db", "--out", "front.csv")
    coarse = investigate(Beam(), 256)
    run("rank", "coarse.db", *ASKED, "--out", "first.csv")
    F, feasible = by_hand(coarse)
    first = pd.read_csv("first.csv", comment="#")
    assert sorted(first["test_point"]) == coarse.numbers[feasible].tolist()
    # The part of the box where these are, with 256 tests more.
    box = f"height={first['height'].min()}:{first['height'].max()},width=50:100"
    run("solve", "beam:Beam", "--points", 256, "--study", "refined.db", "--box", box)
    printed = run("combine", "coarse.db", "new=refined.db", "--out", "all.csv")
    assert "512 tests (256 of coarse, 256 of new) written to all.csv" in printed
    part = {"height": (first["height"].min(), first["height"].max()), "width": (50, 100)}
    refined = investigate(Restricted(Beam(), part), 256)
    table = TestTable.combined({"coarse": coarse, "new": refined})
    assert TestTable.read_csv("all.csv").equals(table)
    printed = run("rank", "all.csv", *ASKED, "--out", "ranked.csv")
    asked = Formulation(
        objectives=["mass", "deflection", "stiffness"], maximize=["stiffness"],
        limits={"mass": 40, "height": (80, 180), "stress": 120},
        computed={"stiffness": "5 / deflection"},
    )  # fmt: skip
    judged = table.under(asked)
    F, feasible = by_hand(table)
    assert judged.feasible().tolist() == feasible.tolist()
    np.testing.assert_allclose(judged.F, F, rtol=1e-15)
    assert feasible[:256].any()
    assert feasible[256:].any()
    ranked = pd.read_csv("ranked.csv", comment="#")
    assert sorted(ranked["test_point"]) == judged.numbers[feasible].tolist()
    best = judged.rows(judged.pareto()).numbers[judged.ranking().salukvadze]
    assert ranked["test_point"][0] == best[0]
    row = table.numbers == best[0]
    assert ranked["experiment"][0] == table.column("experiment")[row][0]
    assert "maximise stiffness: best" in printed
    # What was ranked ranks alike again.
    told = [line for line in printed.splitlines() if "imise" in line]
    assert len(told) == 3
    assert [line for line in run("rank", "ranked.csv").splitlines() if "imise" in line] == told
    run("page", "all.csv", *ASKED, "--out", "page.html")
    page = (tmp_path / "page.html").read_text("utf-8")
    assert all(name in page for name in ("stiffness", "experiment", "coarse"))
    assert not [name for name in ranked.columns if "=" in name]  # of limits, as mass<=40
    # The formulation as a file: from Python to the command, and by solve, too.
    asked.to_json("asked.json")
    run("rank", "all.csv", "--formulation", "asked.json", "--out", "again.csv")
    pd.testing.assert_frame_equal(pd.read_csv("again.csv", comment="#"), ranked)
    run("solve", "beam:Beam", "--points", 256, "--formulation", "asked.json", "--out", "solved.csv")
    solved = pd.read_csv("solved.csv", comment="#")
    assert sorted(solved["test_point"]) == coarse.numbers[coarse.under(asked).pareto()].tolist()


def test_a_relaxed_constraint_and_single_options_on_top_of_a_file(run):
    from beam import Beam

    run("solve", "beam:Beam", "--points", 128, "--study", "s.db")
    table = TestTable.read_study("s.db")
    Formulation(relaxed=["overstress"], limits={"overstress": 20}).to_json("soft.json")
    run("rank", "s.db", "--formulation", "soft.json", "--limits", "mass<=30", "--out", "o.csv")
    inside = (table.column("overstress") <= 20) & (table.F[:, 0] <= 30)
    found = pd.read_csv("o.csv", comment="#")["test_point"]
    assert sorted(found) == table.numbers[inside].tolist()
    run(
        "rank",
        "s.db",
        "--relax",
        "overstress",
        "--limits",
        "overstress<=20,mass<=30",
        "--out",
        "p.csv",
    )
    assert sorted(pd.read_csv("p.csv", comment="#")["test_point"]) == sorted(found)
    told = run("rank", "s.db", "--limits", "overstress<=20", code=2)
    assert "a constraint is limited when it is left out by --relax" in told
    run("rank", "s.db", "--criterion", "overstress", "--out", "q.csv")
    assert len(pd.read_csv("q.csv", comment="#")) == 128
    assert investigate(Beam(), 128).equals(table)


def test_why_no_design_is_left_and_limits_of_no_end_are_told_as_they_are(run):
    run("solve", "beam:Beam", "--points", 32, "--study", "s.db")
    told = run("rank", "s.db", "--criterion", "r=mass/0", code=2)
    assert "rejects most" in told
    assert re.search(r"; \d+ failed: r is inf$", told.strip())
    printed = run("rank", "s.db", "--limits", "mass<=inf, mass>=-inf, deflection>=0")
    assert printed.startswith("Limits: deflection >= 0\n")


SHEET = "name;cost [EUR];power;weight\nA;1,5;100;4\nB;2;150;3\nC;4;160;\nD;3;0;2\nE;2,5;140;2,5\n"


def test_files_of_others_are_judged_alike(run, tmp_path):
    (tmp_path / "set.csv").write_text(SHEET, "utf-8")
    words = ["rank", "set.csv", "--objectives", "cost [EUR]", "--out", "o.csv"]
    printed = run(*words, "--criterion", "specific=weight/power", "--limits", "power<=150")
    # C is beyond the limit, D has no specific weight: 2 / 0.
    assert "1 design beyond the limits: left out." in printed
    assert "2 designs without a finite specific: left out." in printed
    found = pd.read_csv("o.csv", comment="#", **EXACT).set_index("name")
    assert sorted(found.index) == ["A", "B", "E"]
    assert found["specific"].to_dict() == {"A": 4 / 100, "B": 3 / 150, "E": 2.5 / 140}
    # The costs cannot be a name in an expression but in backquotes; more of value is better.
    printed = run(*words, "--criterion", "value=power / `cost [EUR]`", "--maximize", "value")
    assert "maximise value: best 75" in printed
    ranked = run("rank", "o.csv")
    assert "maximise value" in ranked
    assert "it tells no constraints" in run(
        "rank", "set.csv", "--formulation", relaxed(tmp_path), code=2
    )
    assert "none of its 5 designs keeps" in run(*words, "--limits", "power>=900", code=2)
    assert "has a column 'power' already" in run(
        "rank", "set.csv", "--formulation", taken(tmp_path), code=2
    )


def relaxed(folder):
    (folder / "relaxed.json").write_text(json.dumps({"relaxed": ["g"]}), "utf-8")
    return folder / "relaxed.json"


def taken(folder):
    (folder / "taken.json").write_text(json.dumps({"computed": {"power": "weight"}}), "utf-8")
    return folder / "taken.json"


def test_what_cannot_be_combined_is_told_in_a_line(run, tmp_path):
    (tmp_path / "set.csv").write_text(SHEET, "utf-8")
    run("solve", "beam:Beam", "--points", 8, "--study", "a.db")
    run("solve", "zdt1", "--points", 8, "--study", "b.db")
    for words, message in [
        (["a.db", "b.db"], "the experiment 'b' must be tests of the problem of the others"),
        (
            ["a.db", "a.db"],
            "NAME=FILE must be of different names, each its own or that of the file, got a twice",
        ),
        (["a.db", "set.csv"], "set.csv must be a study or a table of tests"),
        (["a.db", "c=none.db"], "none.db: No such file"),
    ]:
        assert message in run("combine", *words, "--out", "o.csv", code=2)
    assert "--out must be another file" in run("combine", "a.db", "--out", "a.db", code=2)


@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_a_sense_outlives_a_ranking_by_other_criteria(run, tmp_path, suffix):
    """A criterion that is left out for once is maximised when it is taken again."""
    table = investigate(get_problem("bnh"), 64, names={"f2": "gain"}, maximize=["gain"])
    table.to_csv("all.csv")
    whole, part = table.to_frame(), tmp_path / f"part.{suffix}"
    run("rank", "all.csv", "--criterion", "loss=-gain", "--objectives", "f1", "--out", part)
    for file, options in ((part, ()), ("all.csv", ("--limits", "f1<=100"))):
        printed = run("rank", file, "--objectives", "f1,gain", *options)
        assert "maximise gain" in printed
    assert whole["gain"].max() <= 0  # turned by the sense
    printed = run("rank", part)
    assert "gain: best" not in printed
    assert "minimise loss" in printed


def test_a_design_that_two_experiments_tested_is_ranked_once(run):
    table = investigate(get_problem("bnh"), 32)
    both = TestTable.combined({"a": table, "b": table})
    both.to_csv("all.csv")
    printed = run("rank", "all.csv", "--out", "ranked.csv")
    assert f"{table.eligible().sum()} of them tested a design once more" in printed
    ranked = pd.read_csv("ranked.csv", comment="#")
    assert ranked["pareto"].sum() == both.pareto().sum() == table.pareto().sum()
    best = both.rows(both.pareto()).numbers[both.ranking().salukvadze]
    assert ranked["test_point"][ranked["rank"] == 6].tolist() == best.tolist()
