"""Decision files: what page and rank take from them, and what they refuse."""

import json

import numpy as np
import pytest

from pymoo_psi import rank_of_efficiency
from pymoo_psi.cli import main
from pymoo_psi.page import decision_page
from pymoo_psi.page._data import payload
from pymoo_psi.page._decision import Decision
from tests.beams import CRITERIA, SETTINGS, beams


def content(**changes):
    """A decision on the beams, as the page writes it."""
    frame = beams()
    row = 88
    names = ["mass", "cost, total", "strength"]
    return {
        "pymoo_psi_decision": 1,
        "title": "Beams",
        "date": "2026-01-31",
        "criteria": [
            {"name": "mass", "unit": "kg", "maximize": False},
            {"name": "cost, total", "unit": "", "maximize": False},
            {"name": "strength", "unit": "", "maximize": True},
        ],
        "normalize": True,
        "limits": {"mass": [None, 0.6], "width": [3, None]},
        "categories": {"material": ["steel"]},
        "kept": None,
        "left": 96,
        "optimum": "1089",
        "chosen": {
            "label": "1089",
            "criteria": {name: float(frame[name][row]) for name in names},
            "variables": {},
        },
        "pins": ["1001"],
        "reason": "lighter than the old one",
        "verdict": ["Number 1089 is the Salukvadze optimum."],
        "view": {"dominated": True},
    } | changes


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the beams, and a decision on them."""
    monkeypatch.chdir(tmp_path)
    beams().to_csv("set.csv", index=False)
    (tmp_path / "d.json").write_text(json.dumps(content()))
    return tmp_path


def left():
    frame = beams()
    return frame[(frame["mass"] <= 0.6) & (frame["width"] >= 3) & (frame["material"] == "steel")]


def test_rank_takes_limits_criteria_and_directions_from_it(folder, capsys):
    assert main(["rank", "set.csv", "--decision", "d.json", "--out", "r.json"]) == 0
    told = capsys.readouterr().out
    assert "Reason: lighter than the old one" in told
    assert "Chosen: 1089, unchanged since 2026-01-31." in told
    assert "Warning" not in told
    designs = left()
    ranking = rank_of_efficiency(designs[CRITERIA], maximize=["strength"])
    written = json.loads((folder / "r.json").read_text())
    assert len(written["designs"]) == len(designs)
    assert written["salukvadze_rows"] == [designs.index[i] + 1 for i in ranking.salukvadze]


def test_the_page_opens_with_it(folder):
    settings = {name: value for name, value in SETTINGS.items() if name != "prototype"}
    page = decision_page(beams(), CRITERIA, decision=folder / "d.json", **settings)
    opens = payload(page)["opens_with"]
    assert opens["limits"] == {"mass": [None, 0.6], "width": [3.0, None]}
    assert opens["categories"] == {"material": ["steel"]}
    assert (opens["chosen"], opens["pins"], opens["dominated"]) == ("1089", ["1001"], True)
    assert opens["reason"] == "lighter than the old one"
    assert page.remarks == ("Chosen: 1089, unchanged since 2026-01-31.",)


@pytest.mark.parametrize(
    ("change", "warning"),
    [
        (lambda f: f.assign(mass=np.where(f["number"] == 1089, 0.3, f["mass"])), "mass was 0.279"),
        (lambda f: f[f["number"] != 1089], "1089, the chosen design, is not among these"),
        (lambda f: f.assign(width=f["width"] - 13), "1089, the chosen design, is beyond"),
    ],
)
def test_designs_that_changed_are_warned_of(folder, capsys, change, warning):
    change(beams()).to_csv("set.csv", index=False)
    assert main(["rank", "set.csv", "--decision", "d.json"]) == 0
    assert f"Warning: {warning}" in capsys.readouterr().out.replace("1089, the chosen design, has "
                                                                    "changed: ", "")  # fmt: skip
    assert main(["page", "set.csv", "--decision", "d.json", "--out", "p.html"]) == 0
    assert "Warning: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("made", "message"),
    [
        ("", "d.json: it is no decision that the page has saved"),
        ("[1, 2]", "d.json: it is no decision"),
        ("[" * 100_000, "d.json: it is no decision"),
        ({"pymoo_psi_decision": 2}, "open the page and save the decision again"),
        (content(limits={"mass": [2, 1]}), "the limit on 'mass' must be (lower, upper)"),
        (content(limits={"mass": ["1", None]}), "the limit on 'mass' must be a number"),
        (content(limits={"mass": [float("nan"), None]}), "the limit on 'mass' must be a number"),
        (content(limits={"mass": 1}), "it is no decision"),
        (content(criteria=[{"name": 1}]), "it is no decision"),
        (content(kept="all"), "it is no decision"),
        (content(chosen={"label": "1", "criteria": {"mass": 10**400}}), "it is no decision"),
        (content(limits={"depth": [1, None]}), "it limits 'depth', which set.csv does not have"),
        (content(limits={"material": [1, None]}), "d.json: "),
        (content(limits={"mass": [None, -9]}), "d.json: it leaves none of the 400 designs"),
        (
            content(
                criteria=[{"name": n, "unit": "", "maximize": False} for n in ("mass", "depth")]
            ),
            "d.json does not fit: --objectives must be one of",
        ),
    ],
)  # fmt: skip
def test_hostile_and_foreign_files_are_refused(folder, capsys, made, message):
    (folder / "d.json").write_text(made if isinstance(made, str) else json.dumps(made))
    assert main(["rank", "set.csv", "--decision", "d.json"]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert sorted(path.name for path in folder.iterdir()) == ["d.json", "set.csv"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--limits", "mass<=1"], "--limits must be left out beside --decision"),
        (["--no-normalize"], "--no-normalize must be left out beside --decision"),
        (
            ["--objectives", "mass,strength"],
            "it weighs mass, cost, total and strength, and set.csv",
        ),
        (["--objectives", 'mass,"cost, total",strength'], "there 'strength' is maximised"),
    ],
)
def test_options_that_contradict_it_are_refused(folder, capsys, options, message):
    assert main(["rank", "set.csv", "--decision", "d.json", *options]) == 2
    assert message in capsys.readouterr().err


def test_other_units_are_refused(folder):
    decided = Decision.read(folder / "d.json")
    with pytest.raises(ValueError, match="there 'mass' is in kg, in it in g"):
        decided.require("it", CRITERIA, ["strength"], {"mass": "g"}, [*CRITERIA, "width"])


def test_an_existing_design_may_be_chosen_and_kept(folder):
    settings = {name: value for name, value in SETTINGS.items() if name != "prototype"}
    existing = {"mass": 0.5, "cost, total": 0.6, "strength": 0.7, "width": 9.0, "material": "steel"}
    chosen = {"label": "prototype", "criteria": {name: existing[name] for name in CRITERIA}}
    decided = content(chosen=chosen | {"variables": {}}, kept=["1089", "prototype"])
    (folder / "d.json").write_text(json.dumps(decided))
    page = decision_page(
        beams(), CRITERIA, prototype=existing, decision=folder / "d.json", **settings
    )
    assert page.remarks == ("Chosen: prototype, unchanged since 2026-01-31.",)


def test_limits_of_page_and_rank_mean_the_same(folder):
    limits = ["--limits", "mass<=0.6,3<=width<=15,strength>=-1"]
    options = ["--objectives", 'mass,"cost, total",strength', "--maximize", "strength"]
    assert main(["rank", "set.csv", *options, *limits, "--out", "r.json"]) == 0
    written = json.loads((folder / "r.json").read_text())
    bounds = {"mass": (None, 0.6), "width": (3, 15), "strength": -1}
    page = decision_page(
        beams(), CRITERIA, variables=["width"], maximize=["strength"], limits=bounds
    )
    frame = beams()
    kept = np.ones(len(frame), dtype=bool)
    for name, (low, high) in page.limits.items():
        kept &= frame[name].between(low, high).to_numpy()
    assert len(written["designs"]) == kept.sum()
    assert payload(page)["opens_with"]["limits"]["strength"] == [-1.0, None]


def test_the_page_says_which_columns_it_does_not_show(folder, capsys):
    command = ["page", "set.csv", "--objectives", '"cost, total",mass', "--variables"]
    told = "; name what is to be seen there by --variables."
    assert main([*command, "width"]) == 0
    assert f"Not on the page: strength and material{told}" in capsys.readouterr().out
    assert main([*command, "width,material", "--limits", "strength<=1e9", "--force"]) == 0
    assert "Not on the page" not in capsys.readouterr().out


def test_a_file_does_not_steer_the_terminal(folder, capsys):
    """By sequences that clear it, or type into it, from a stranger's decision or table."""
    escape = "\x1b[2J\x07\x9b"
    (folder / "d.json").write_text(json.dumps(content(reason=f"light{escape}", date=escape)))
    assert main(["rank", "set.csv", "--decision", "d.json"]) == 0
    out = capsys.readouterr().out
    assert "Reason: light?[2J??" in out
    assert not set(escape[:1] + escape[-2:]) & set(out)
    criteria = [{"name": escape, "unit": "", "maximize": False}]
    (folder / "d.json").write_text(json.dumps(content(criteria=criteria)))
    command = ["rank", "set.csv", "--decision", "d.json", "--objectives", "mass,strength"]
    assert main(command) == 2
    assert "it weighs ?[2J??, and set.csv" in capsys.readouterr().err
