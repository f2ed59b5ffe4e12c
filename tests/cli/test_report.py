"""The command's report says what ``rank`` and ``solve`` print of the same file and options."""

import json
import re
from html import unescape

import numpy as np
import pandas as pd
import pytest

from pymoo_psi.cli import main
from pymoo_psi.report._parts import Picture
from pymoo_psi.table import Layout, TestTable

COST = np.linspace(1, 9, 41)
CARS = pd.DataFrame({"cost, k€": COST, "range [km]": 500 - 3000 / (COST + 1) ** 1.5, "seats": 5})


def said(command, capsys, *words):
    """The sentences on the choice that a command prints, one long line."""
    assert main([command, *map(str, words)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    start = text.index("ormalised: ")
    return text[start:].partition(". ")[2].replace(" Caution: ", "\n").split("\n")


def texts(path):
    """The text of a report, and its items and paragraphs."""
    html = path.read_text("utf-8")
    parts = re.findall(r"<(?:p|li)[^>]*>(.*?)</(?:p|li)>", html)
    return [unescape(part).replace("\N{NO-BREAK SPACE}%", " %") for part in parts]


@pytest.fixture(autouse=True)
def undrawn(monkeypatch):
    """Leave pictures out, which take most of the time."""
    monkeypatch.setattr(Picture, "image", lambda picture: "data:image/svg+xml;base64,")


@pytest.fixture
def cars(tmp_path):
    file = tmp_path / "cars.csv"
    CARS.to_csv(file, index=False)
    return file


@pytest.fixture
def named(tmp_path):
    file = tmp_path / "named.csv"
    cars = CARS.drop(columns="seats").assign(name=[f"car {i}" for i in range(len(CARS))])
    cars.to_csv(file, index=False)
    return file


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("studies") / "tests.db"
    assert main(["solve", "bnh", "--points", "40", "--study", str(path)]) == 0
    return path


def check(reported, printed):
    """Every sentence that a command prints of reasons and cautions is one of the report."""
    reasons, *told = printed
    left = reasons
    for part in reported:
        left = left.replace(part, "", 1)
    assert left.strip() == ""
    assert [f"Caution: {text}" for text in told] == [p for p in reported if "Caution: " in p]


@pytest.mark.parametrize("options", [
    ["--maximize", "range [km]", "--objectives", '"cost, k€",range [km]'],
    ["--maximize", "range [km]", "--objectives", '"cost, k€",range [km]', "--no-normalize"],
    ["--maximize", "range [km]", "--objectives", '"cost, k€",range [km]', "--limits", '"cost, k€<=6"'],
])  # fmt: skip
def test_a_file_of_designs_is_told_as_by_rank(cars, tmp_path, capsys, options):
    out = tmp_path / "report.html"
    printed = said("rank", capsys, cars, *options)
    assert main(["report", str(cars), "--out", str(out), *options]) == 0
    check(texts(out), printed)


def test_any_column_of_numbers_is_limited_as_by_rank(tmp_path, capsys):
    """Also one that has no role, by an option and by a decision."""
    table, file, out = tmp_path / "set.csv", tmp_path / "decision.json", tmp_path / "report.html"
    frame = pd.DataFrame({"no": range(1, 10), "f1": range(9), "f2": range(9, 0, -1)})
    frame["heat"], frame["kind"] = [300, 20, 30, None, 50, 60, 70, 80, 90], "steel"
    frame.to_csv(table, index=False)
    file.write_text(decision(limits={"heat": [None, 70.0]}, chosen=None))
    roles = ["--objectives", "f1,f2"]
    for options in ([*roles, "--limits", "heat<=70"], ["--decision", file]):
        printed = said("rank", capsys, table, *options)
        assert main(["report", str(table), "--out", str(out), *map(str, options)]) == 0
        check(texts(out), printed)
        assert ">heat ≤ 70<" in out.read_text("utf-8")
        assert any("nearest of 5 Pareto-optimal designs" in text for text in texts(out))
    capsys.readouterr()
    assert main(["report", str(table), "--out", str(out), *roles, "--limits", "kind<=1"]) == 2
    assert "its column 'kind' holds no number at all" in capsys.readouterr().err
    options = [*roles, "--variables", "no,heat"]
    assert main(["report", str(table), "--out", str(out), *options]) == 0
    assert "some designs have no value of it: heat." in capsys.readouterr().out
    assert "some designs have no value of it: heat." in out.read_text("utf-8")


@pytest.mark.parametrize("options", [[], ["--limits", "f1<=60,x1>=1"], ["--relax", "g1"]])
def test_a_study_is_told_as_by_rank(study, tmp_path, capsys, options):
    out = tmp_path / "report.html"
    printed = said("rank", capsys, study, *options)
    assert main(["report", str(study), "--out", str(out), *options]) == 0
    check(texts(out), printed)


def test_preferences_are_told_as_by_rank(study, tmp_path, capsys):
    out = tmp_path / "report.html"
    prefer = ["--prefer", "knee", "--prefer", "weights:f1=1,f2=9", "--prefer", "tradeoff"]
    assert main(["rank", str(study), *prefer]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert main(["report", str(study), "--out", str(out), *prefer]) == 0
    told = [t for t in texts(out) if t.startswith(("knee: ", "weights:", "tradeoff: "))]
    assert len(told) == 3
    assert all(text in printed for text in told)


def test_a_choice_of_ones_own(study, tmp_path, capsys):
    out = tmp_path / "report.html"
    assert main(["report", str(study), "--out", str(out), "--design", "5", "--title", "Mine"]) == 0
    assert any(text.startswith("Chosen is test point 5, with f1 ") for text in texts(out))
    assert "<h1>Mine</h1>" in out.read_text("utf-8")


def test_a_design_of_a_file_with_test_points_is_chosen_by_these(tmp_path, capsys):
    file, out = tmp_path / "front.csv", tmp_path / "report.html"
    file.write_text("test_point,f1,f2\n3,1,5\n1,2,3\n2,4,1\n")
    assert main(["report", str(file), "--out", str(out), "--design", "1"]) == 0
    assert "Chosen is test point 1, with f1 2 and f2 3." in texts(out)
    file.write_text("test_point,f1,f2\n31,1,5\n1,2,3\n21,4,1\n")
    assert main(["report", str(file), "--out", str(out), "--design", "3"]) == 2
    told = "--design must be a number that the column 'test_point' holds once, got 3"
    assert told in capsys.readouterr().err
    file.write_text("design,f1,f2\n31,1,5\n3,2,3\n21,4,1\n")
    assert main(["report", str(file), "--out", str(out), "--design", "3"]) == 0
    assert "Chosen is design 3, with f1 2 and f2 3." in texts(out)
    assert main(["report", str(file), "--design", "21", "--limits", "f1<=3"]) == 2
    assert "got design 21; it violates f1" in capsys.readouterr().err
    file.write_text("name,f1,f2\nname plate,1,5\ntest point 1,2,3\ntest point 2,4,1\n")
    assert main(["report", str(file), "--out", str(out), "--design", "2", "--force"]) == 0
    assert "Chosen is test point 1, with f1 2 and f2 3." in texts(out)
    file.write_text("f1,f2\n1,5\n2,3\n4,1\n")
    assert main(["report", str(file), "--out", str(out), "--design", "3"]) == 0
    assert "Chosen is row 3, with f1 4 and f2 1." in texts(out)


def test_a_document_knows_no_options(tmp_path, capsys):
    """What hints at them is for the terminal."""
    file, out = tmp_path / "front.csv", tmp_path / "report.html"
    file.write_text("Versuch,f,g\n1,-1,5\n2,-2,3\n3,-4,1\n")
    command = ["report", str(file), "--out", str(out), "--maximize", "f"]
    fact = "f is maximised, and negative throughout"
    for options, hint in (([], "say --objectives"), (["--objectives", "f,g"], fact)):
        assert main([*command, *options]) == 0
        assert hint in " ".join(capsys.readouterr().out.split())
        assert " --" not in out.read_text("utf-8")
        assert fact in texts(out)


def test_when_a_study_was_begun_is_told(study, tmp_path, monkeypatch):
    monkeypatch.chdir(study.parent)
    out = tmp_path / "report.html"
    assert main(["report", study.name, "--out", str(out)]) == 0
    assert re.search(r"Study begun \d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC<", out.read_text("utf-8"))
    table = tmp_path / "tests.csv"
    assert main(["export", study.name, "--out", str(table)]) == 0
    monkeypatch.chdir(tmp_path)
    assert main(["report", "tests.csv", "--force"]) == 0
    assert "Study begun" not in (tmp_path / "report.html").read_text("utf-8")


def decision(**more):
    """A decision on bnh as the page saves it."""
    content = {
        "objectives": ["f1", "f2"],
        "limits": {"f1": [None, 60.0]},
        "chosen": "test point 5",
        "reason": "<cheap>",
        "page": {"date": "2026-01-31", "values": {"f1": 1.0, "f2": 2.0}, "state": {}},
    }
    return json.dumps(content | more)


def test_a_decision_of_the_page_is_reported(study, tmp_path, capsys):
    file, out = tmp_path / "decision.json", tmp_path / "report.html"
    file.write_text(decision())
    assert main(["report", str(study), "--out", str(out), "--decision", str(file)]) == 0
    told = texts(out)
    assert "Reason: <cheap>" in told
    assert any(text.startswith("Chosen is test point 5, with f1 ") for text in told)
    assert any("f1 was 1 and is " in text for text in told)  # what has changed is told
    assert ">f1 ≤ 60<" in out.read_text("utf-8")


@pytest.mark.parametrize(
    ("name", "label", "chosen"),
    [
        ("id", "7", "id 7"),
        ("test_point", "7", "test point 7"),
        ("car", "A 7", "A 7"),
        (None, "7", "row 7"),
    ],
)
def test_a_decision_finds_its_design_by_what_the_page_calls_it(tmp_path, name, label, chosen):
    file, table, out = tmp_path / "decision.json", tmp_path / "set.csv", tmp_path / "report.html"
    frame = pd.DataFrame({"f1": range(9), "f2": range(9, 0, -1)})
    if name is not None:
        frame.insert(0, name if name != "car" else "name", range(1, 10))
    if name == "car":
        frame["name"] = [f"A {i}" for i in range(1, 10)]
    frame.to_csv(table, index=False)
    page = {"date": "2026-01-31", "values": {"f1": 6.0, "f2": 3.0}}
    file.write_text(decision(chosen=chosen, page=page))
    assert main(["report", str(table), "--out", str(out), "--decision", str(file)]) == 0
    told = texts(out)
    assert f"Chosen is {chosen}, with f1 6 and f2 3." in told
    assert f"Chosen: {label}, unchanged since 2026-01-31." in told


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        ("[]", [], "must be a formulation"),
        (decision(), ["--limits", "f1<=3"], "--limits must be left out beside --decision"),
        (decision(), ["--design", "5"], "--design must be left out beside --decision"),
        (decision(page={"state": {"kept": ["test point 5"]}}), [], "decide by limits alone"),
        (decision(limits={"x9": [0, 1]}), [], "it limits 'x9'"),
    ],
)
def test_decisions_that_do_not_fit(study, tmp_path, capsys, content, options, message):
    file, out = tmp_path / "decision.json", tmp_path / "report.html"
    file.write_text(content)
    words = ["report", str(study), "--out", str(out), "--decision", str(file), *options]
    assert main(words) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()


def test_no_feasible_design_is_code_1_and_a_report(study, tmp_path, capsys):
    out = tmp_path / "report.html"
    assert main(["report", str(study), "--out", str(out), "--limits", "f1<=-1"]) == 1
    assert "no feasible design" in capsys.readouterr().out
    assert any("What stands in the way: f1 rejects most" in text for text in texts(out))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--out", "report.pdf"], "--out must be a file with the suffix .html or .htm"),
        (["--design", "1000"], "--design must be the number, or row, of a feasible test, got 1000"),
        (["--limits", "f3<=1"], "--limits must be one of"),
        (["--prefer", "cheap"], "--prefer must be one of"),
        (["--units", "f9=kg"], "--units must be one of"),
    ],
)
def test_mistakes(study, capsys, tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    assert main(["report", str(study), *options]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.glob("*.html"))


def test_a_zero_whose_sign_was_turned_is_a_plain_zero_to_readers(tmp_path, capsys):
    layout = Layout.of(1, ["mass", "gain"], maximize=["gain"])
    F = [[1.0, 0.0], [0.5, 2.0], [0.25, 5.0]]
    table = TestTable.of([1, 2, 3], [[0.5], [0.25], [0.75]], F, layout=layout)
    file, out = tmp_path / "tests.csv", tmp_path / "report.html"
    table.to_csv(file)
    assert main(["rank", str(file), "--representatives", "3"]) == 0
    printed = capsys.readouterr().out
    assert main(["report", str(file), "--out", str(out), "--design", "1"]) == 0
    told = texts(out)
    assert "Chosen is test point 1, with mass 1 and gain 0." in told
    for text in (printed, table.to_latex(), *told):
        assert not re.search(r"(?<!\w)-0(?![.\d])", text), text
