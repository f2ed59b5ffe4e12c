"""Names, senses and units from a model's file through ``solve``, ``rank`` and ``export``."""

import json
import re
import sys
import warnings

import pandas as pd
import pytest

from pymoo_psi.cli import main

MODELS = '''
from pymoo.core.problem import Problem

class Beam(Problem):
    """A cantilever; as pymoo has it, both criteria minimised."""
    def __init__(self):
        super().__init__(n_var=3, n_obj=2, n_ieq_constr=1, xl=[20, 30, 1], xu=[60, 120, 2])
    def name(self):
        return "Beam"
    def _evaluate(self, X, out, *args, **kwargs):
        b, h, l = X.T
        out["F"] = [b * h * l * 7.85e-3, -630e3 * b * h**3 / 12 / (l * 1e3) ** 3]
        out["G"] = 6e3 * l * 1e3 / b / h**2 - 120
        out["heat"] = 20 + b

class Named(Beam):
    names = {"x1": "width", "x2": "height", "x3": "length",
             "f1": "mass", "f2": "stiffness", "g1": "stress"}
    maximize = ["stiffness"]
    units = {"width": "mm", "mass": "kg", "stiffness": "N/mm", "heat": "°C"}
'''


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    (tmp_path / "named_models.py").write_text(MODELS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))

    def command(*words):
        code = main([str(word).replace("models:", "named_models:") for word in words])
        captured = capsys.readouterr()
        assert code == (2 if captured.err else 0), captured
        return captured.out + captured.err

    yield command
    sys.modules.pop("named_models", None)


def optimum(printed):
    return re.search(r"\(test_point (\d+)\)", printed)[1]


def test_files_rank_as_the_run_that_wrote_them(run, tmp_path):
    printed = run("solve", "models:Named", "--points", "256", "--study", "s.db", "--out", "f.csv")
    assert "mass [kg]" in printed
    assert "stiffness [N/mm] (max)" in printed
    # "#" begins a comment to any reader of CSV that knows such lines.
    front = pd.read_csv("f.csv", comment="#")
    assert front.columns.tolist() == [
        *("test_point", "width", "height", "length", "mass", "stiffness", "heat"),
        *("mu1", "mu2", "mu3", "rank"),
    ]  # fmt: skip
    assert (front["stiffness"] > 0).all()
    assert (front["heat"] == front["width"] + 20).all()
    best = str(front["test_point"][0])
    run("export", "s.db", "--out", "all.csv")
    run("export", "s.db", "--out", "all.parquet")
    for file in ("f.csv", "s.db", "all.csv", "all.parquet"):
        for out in ("ranked.csv", "ranked.json", "again.csv"):
            printed = run("rank", file, "--out", out)
            assert optimum(printed) == best, (file, out)
            assert "maximise stiffness: best" in printed
            assert "(in N/mm)" in printed
            file = out
    run("page", "again.csv", "--out", "page.html")
    # The same designs as of the model without senses.
    run("solve", "models:Beam", "--points", "256", "--out", "plain.csv")
    plain = pd.read_csv("plain.csv")
    assert plain["test_point"].tolist() == front["test_point"].tolist()
    assert (plain["f2"] == -front["stiffness"]).all()
    assert plain["rank"].tolist() == front["rank"].tolist()


def test_a_plain_file_ranked_with_a_sense_keeps_it(run, tmp_path):
    (tmp_path / "set.csv").write_text("id,cost,yield\nA,1,2\nB,2,5\nC,3,6\nD,9,1\n", "utf-8")
    said = run("rank", "set.csv", "--maximize", "yield", "--out", "ranked.csv")
    again = run("rank", "ranked.csv", "--out", "again.csv")
    assert "maximise yield: best 6, worst 2" in said
    assert "maximise yield: best 6, worst 2" in again
    assert (tmp_path / "again.csv").read_text("utf-8").count("pymoo_psi_designs") == 1
    # A sense that the file has is not lost where another one is typed.
    assert "maximise yield: best 6" in run("rank", "ranked.csv", "--maximize", "cost")
    # Without a sense a file is as plain as ever.
    run("rank", "set.csv", "--objectives", "cost,yield", "--out", "plain.csv")
    assert (tmp_path / "plain.csv").read_text("utf-8").startswith("row,id,cost")


def test_the_first_line_is_read_as_spreadsheets_write_it(run, tmp_path):
    (tmp_path / "set.csv").write_text("id,cost,yield\nA,1,2\nB,2,5\nC,3,6\n", "utf-8")
    run("rank", "set.csv", "--maximize", "yield", "--out", "ranked.csv")
    text = (tmp_path / "ranked.csv").read_text("utf-8")
    head, rest = text.split("\n", 1)
    quoted = '"' + head.replace('"', '""') + '",,,,,,,,'
    (tmp_path / "quoted.csv").write_text(f"\ufeff{quoted}\r\n{rest}", "utf-8")
    assert "maximise yield: best 6" in run("rank", "quoted.csv")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda head, rest: head[:-3] + "\n" + rest, "its first line, which says what the columns are, is damaged"),
        (lambda head, rest: head.replace(": 1,", ": 2,") + "\n" + rest, "of a later version; remove it, and say --objectives"),
        (lambda head, rest: head.replace('"yield"]', '"gain"]') + "\n" + rest, "damaged|'gain', which is no column"),
        (lambda head, rest: head + "\n" + rest.replace("yield", "gain"), "names the objective 'yield', which is no column"),
    ],
)  # fmt: skip
def test_a_first_line_that_does_not_fit_is_refused(run, tmp_path, change, message):
    (tmp_path / "set.csv").write_text("id,cost,yield\nA,1,2\nB,2,5\nC,3,6\n", "utf-8")
    run("rank", "set.csv", "--maximize", "yield", "--out", "ranked.csv")
    text = change(*(tmp_path / "ranked.csv").read_text("utf-8").split("\n", 1))
    (tmp_path / "changed.csv").write_text(text, "utf-8")
    assert re.search(message, run("rank", "changed.csv"))


def test_boxes_and_limits_have_the_models_names(run, tmp_path):
    printed = run(
        "solve", "models:Named", "--points", "128", "--limits", "stiffness>=500,mass<=60",
        "--box", "width=25:40", "--out", "front.csv",
    )  # fmt: skip
    front = pd.read_csv("front.csv", comment="#")
    assert front["stiffness"].min() >= 500
    assert front["width"].between(25, 40).all()
    assert re.search(r"--box \S*width=25", printed)
    assert "did you mean 'width'" in run("solve", "models:Named", "--box", "widht=25:40")
    words = ("solve", "models:Named", "--points", "64", "--limits", "100<=stiffness<=500")
    run(*words, "--out", "soft.csv")
    assert pd.read_csv("soft.csv", comment="#")["stiffness"].between(100, 500).all()


def test_names_that_a_ranking_has_are_refused_before_the_run(run, tmp_path):
    source = MODELS.replace('"mass"', '"rank"')
    (tmp_path / "named_models.py").write_text(source, encoding="utf-8")
    assert "unlike the columns of a ranking, got 'rank'" in run("solve", "models:Named")


def test_json_has_the_units(run, tmp_path):
    run("solve", "models:Named", "--points", "64", "--out", "front.csv")
    run("rank", "front.csv", "--out", "ranked.json")
    content = json.loads((tmp_path / "ranked.json").read_text("utf-8"))
    assert content["units"]["stiffness"] == "N/mm"
    assert content["maximized"] == ["stiffness"]


def test_what_is_not_kept_is_told_in_one_line(tmp_path, monkeypatch, capsys):
    source = MODELS.replace('out["heat"] = 20 + b', 'out["heat"] = [[1, 2]] * len(b)')
    (tmp_path / "named_models.py").write_text(source, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    words = ["solve", "named_models:Beam", "--points", "512", "--out", "front.csv"]
    with warnings.catch_warnings():
        warnings.resetwarnings()  # the tests make errors of them, the command does not
        assert main(words) == 0
    sys.modules.pop("named_models", None)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("pymoo-psi: warning: out['heat'] is not kept in the table: ")
    assert "heat" not in pd.read_csv(tmp_path / "front.csv").columns
