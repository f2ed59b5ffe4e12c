"""Options that name columns: one parser for all commands, names with commas, lists, repetition."""

import pytest
from pymoo.problems.multi import BNH

from pymoo_psi.cli import _page, main
from pymoo_psi.page import decision_page

DESIGNS = '"time, s",mass,"width, a",n\n1,2,5,1\n2,1,6,2\n3,3,7,3\n'


@pytest.fixture
def page(monkeypatch, tmp_path):
    """The page that the command makes."""
    made = []
    monkeypatch.setattr(
        _page, "decision_page", lambda *args, **more: made.append(decision_page(*args, **more)) or made[-1]
    )  # fmt: skip
    (tmp_path / "set.csv").write_text(DESIGNS, encoding="utf-8")

    def run(*options):
        words = ["page", str(tmp_path / "set.csv"), "--out", str(tmp_path / "p.html"), *options]
        assert main(words) == 0
        return made[-1]

    return run


@pytest.mark.parametrize(
    "options",
    [
        ["--objectives", "time, s", "--objectives", "mass"],
        ["--objectives", '"time, s",mass'],
        ["--objectives", 'mass, "time, s"'],
    ],
)
def test_page_and_rank_take_the_same_objectives(page, capsys, tmp_path, options):
    assert {*page(*options).table.layout.objectives} == {"time, s", "mass"}
    capsys.readouterr()
    assert main(["rank", str(tmp_path / "set.csv"), *options]) == 0
    printed = capsys.readouterr().out
    assert "minimise time, s" in printed
    assert "minimise mass" in printed
    assert printed.count("minimise") == 2


def test_all_options_of_names_take_names_with_commas(page):
    made = page(
        "--objectives", "time, s", "--objectives", "mass", "--variables", "width, a",
        "--variables", "n", "--maximize", "time, s", "--units", "time, s=s", "--units",
        'mass=kg,"width, a=mm"', "--limits", "time, s>=1.5", "--limits", "mass<=2.5",
    )  # fmt: skip
    layout = made.table.layout
    assert (layout.objectives, layout.maximize) == (("time, s", "mass"), ("time, s",))
    assert layout.variables == ("width, a", "n")
    assert layout.units == {"time, s": "s", "mass": "kg", "width, a": "mm"}
    assert made.formulation.limits == {"time, s": (1.5, None), "mass": (None, 2.5)}


def test_limits_of_solve_are_repeatable(capsys):
    words = ["solve", "chute", "--points", "64"]
    printed = []
    for limits in (["--limits", "f1=2.2,f4<=1.5"], ["--limits", "f1=2.2", "--limits", "f4=1.5"]):
        assert main([*words, *limits]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1] != ""


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("rank set.csv --objectives mass,n --prefer weights:mass=-1,n=1", "--prefer: weights must be"),
        ("rank set.csv --objectives mass,n --prefer order:mass,tolerance=2", "--prefer: tolerance must"),
        ("rank set.csv --criterion r=mass/", "--criterion: an expression must be arithmetic"),
        ("rank set.csv --criterion r=mass/zz", "--criterion: a column of 'mass/zz' must be one of"),
        ("rank set.csv --formulation asked.json", "--formulation: a column of the formulation must"),
        ("page set.csv --limits mass<=-1", "--limits must be kept by one design or more"),
        ("solve bnh --points 8 --limits 5<=f1<=4", "--limits: the limit on 'f1' must be (lower"),
        ("solve bnh --points 8 --limits g1<=1", "--limits: a limit must be on a criterion, a variable "
         "or an output, got 'g1'; leave the constraint out by --relax to give"),
        ("solve bnh --points 8 --formulation asked.json", "--formulation: objectives must be one of"),
        ("solve bnh --points 8 --box x1=3:2", "--box: x1 of box must be (lower, upper) in rising"),
        ("solve bnh --points 8 --study .", "--study must be the name of a file, got"),
        ("solve bnh --points x", "Invalid value for '--points': "),
        ("rank set.csv --top 1.5", "Invalid value for '--top': "),
        ("solve bnh --out=", "Invalid value for '--out': a file or folder must have a name"),
        ("solve bnh --algorithm nsga3 --limits f1=3", "--limits must be used with --algorithm psi or "
         "surrogate, got 'nsga3'; keep the tests by --study FILE.db, then pymoo-psi rank FILE.db --limits"),
        ("solve bnh --algorithm surrogate --relax g1", "--relax must be used with --algorithm psi"),
        ("solve tests.cli.test_options:Backwards --maximize f1", "PROBLEM tests.cli.test_options:Backwards: maximize must"),
        ("reproduce --out set.csv", "--out must be a folder, got the file set.csv"),
    ],
)  # fmt: skip
def test_a_message_names_what_was_typed(monkeypatch, capsys, tmp_path, words, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "set.csv").write_text(DESIGNS, encoding="utf-8")
    (tmp_path / "asked.json").write_text('{"objectives": ["nope"]}')
    assert main(words.split()) == 2
    error = capsys.readouterr().err.removeprefix("pymoo-psi: error: ")
    assert error.startswith(told)


class Backwards(BNH):
    """A problem that says itself, wrongly, what is maximised."""

    maximize = ("f3",)


def test_designs_that_lack_a_limited_number_are_not_beyond_the_limit(capsys, tmp_path):
    path = tmp_path / "set.csv"
    path.write_text("a,b\n1,5\n2,\n3,2\n4,1\n5,9\n", encoding="utf-8")
    assert main(["rank", str(path), "--limits", "b<=5,0.500<=a"]) == 0
    printed = capsys.readouterr().out
    assert "Limits: b <= 5, a >= 0.5\n" in printed  # as they were read
    assert "1 design beyond the limits: left out.\n" in printed
    assert "1 design without a number in a limited column: left out.\n" in printed


def test_objectives_are_told_unless_they_were_typed(capsys, tmp_path):
    path = tmp_path / "set.csv"
    path.write_text(DESIGNS, encoding="utf-8")
    for options, told in [([], True), (["--objectives", "mass,n"], False)]:
        assert main(["rank", str(path), "--limits", "mass<=2", *options]) == 0
        assert ("Objectives: " in capsys.readouterr().out) == told
