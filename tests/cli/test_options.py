"""Options that name columns: one parser for all commands, names with commas, lists, repetition."""

import numpy as np
import pytest

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
    names = {column.name for column in page(*options).columns if column.role == "criterion"}
    assert names == {"time, s", "mass"}
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
    told = [
        ("time, s", "s", True),
        ("mass", "kg", False),
        ("width, a", "mm", False),
        ("n", "", False),
    ]
    assert [(c.name, c.unit, c.maximize) for c in made.columns[:4]] == told
    assert made.limits == {"time, s": (1.5, np.inf), "mass": (-np.inf, 2.5)}


def test_limits_of_solve_are_repeatable(capsys):
    words = ["solve", "chute", "--points", "64"]
    printed = []
    for limits in (["--limits", "f1=2.2,f4<=1.5"], ["--limits", "f1=2.2", "--limits", "f4=1.5"]):
        assert main([*words, *limits]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1] != ""
