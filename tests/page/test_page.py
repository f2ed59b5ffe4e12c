"""The decision page in Python: its data, where they come from, and what is refused."""

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import PsiError, VectorizedSphereChute, investigate, rank_of_efficiency
from pymoo_psi.cli import _page, main
from pymoo_psi.page import decision_page
from pymoo_psi.page._data import DOMINATED, OPTIMUM, PROTOTYPE, Column
from tests.beams import CRITERIA, SETTINGS, beams

# The data


def test_it_says_how_much_it_shows():
    assert (
        repr(decision_page(beams(), CRITERIA, title="Beams"))
        == "DecisionPage('Beams': 400 of 400 designs)"
    )


def test_columns_groups_and_order():
    frame = beams()
    data = decision_page(frame, CRITERIA, **SETTINGS)
    ranking = rank_of_efficiency(frame[CRITERIA] * [1, 1, -1])
    assert [column.label for column in data.columns] == [
        "mass [kg]", "cost, total", "strength (max)", "width [mm]", "material",
        "μ1 (to U)", "μ2 (to line UN)", "μ3 (along UN)",
    ]  # fmt: skip
    assert data.labels[-1] == "prototype"  # drawn last, on top
    assert data.group[-1] == PROTOTYPE
    assert data.rank[-1] == -1
    rows = np.array([int(label) for label in data.labels[:-1]]) - 1001
    assert sorted(rows) == list(range(400))
    np.testing.assert_array_equal(data.rank[:-1], ranking.rank[rows])
    np.testing.assert_array_equal(data.group[:-1] == DOMINATED, ~ranking.pareto[rows])
    np.testing.assert_array_equal(data.columns[0].values[:-1], frame["mass"][rows])
    np.testing.assert_allclose(data.columns[-3].values[:-1], ranking.criteria[rows, 0], rtol=1e-14)
    U, span = ranking.ideal, ranking.nadir - ranking.ideal
    np.testing.assert_allclose(
        data.columns[-3].values[-1], np.linalg.norm(([1.4, 90.0, -0.2] - U) / span)
    )
    assert data.optima == [str(1001 + i) for i in ranking.salukvadze]
    assert (np.diff(data.group) >= 0).all()


def test_optima_without_rank_6_are_marked_and_told():
    """On a circle around U every design is as near to U, and none is the best in all pairs."""
    angle = np.linspace(0, np.pi / 2, 7)
    frame = pd.DataFrame({"a": np.sin(angle), "b": np.cos(angle)})
    assert rank_of_efficiency(frame, normalize=False).rank.max() < 6
    data = decision_page(frame, ["a", "b"], normalize=False)
    assert (data.group == OPTIMUM).sum() == len(data.optima) == 7
    assert data.remarks == ("No design has rank 6: several are equally near to U.",)
    assert decision_page(beams(), CRITERIA).remarks == ()


@pytest.mark.parametrize(
    ("values", "notation"),
    [
        ([1.98291, 2.0454], ("fixed", 5)),
        ([1.0, 7.0], ("fixed", 0)),
        ([100.5, 900.0], ("fixed", 1)),
        ([1e-9, 3e-9], ("exponent", 3)),
        ([1e12, 3e12], ("exponent", 3)),
        ([0.25, 0.25], ("fixed", 4)),
        ([np.nan, np.nan], ("fixed", 0)),
    ],
)
def test_numbers_are_written_with_digits_that_tell_designs_apart(values, notation):
    assert Column("c0", "a", "", "criterion", False, np.array(values)).notation == notation


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"objectives": ["mas"]}, "objectives must be one of .* got 'mas'; did you mean 'mass'?"),
        ({"objectives": []}, "objectives must be names of one column or more"),
        ({"objectives": "mass"}, "objectives must be a list of names, got 'mass'"),
        ({"objectives": ["mass", "mass"]}, "objectives must be columns that are named once"),
        ({"objectives": ["material"], "variables": (), "maximize": (), "prototype": None, "units": {}}, "column 'material' must be numbers, got .* in row 1"),
        ({"variables": ["depth"]}, "variables must be one of"),
        ({"variables": ["mass"]}, "variables must be columns that are named once, got 'mass'"),
        ({"maximize": ["width"]}, "maximize must be one of 'cost, total', 'mass', 'strength'"),
        ({"units": {"depth": "m"}}, "units must be one of"),
        ({"label": "name"}, "label must be one of"),
        ({"limits": {"width": 1.0}}, "limits must be one of 'cost, total', 'mass', 'strength'"),
        ({"limits": {"mass": "1"}}, "the limit on 'mass' must be a finite number"),
        ({"limits": {"mass": -9.0}}, "the limit on 'mass' must be at least .*, its best value"),
        ({"limits": {"strength": 9.0}}, "the limit on 'strength' must be at most .*, its best"),
        ({"normalize": "no"}, "normalize must be True or False"),
        ({"prototype": {"mass": 1.0}}, "prototype must be a design with a value for every objective"),
        ({"prototype": 3}, "prototype must be a mapping or a pandas.DataFrame, got int"),
        ({"frame": beams().iloc[:0]}, "frame must be of at least two designs .* got 0 rows"),
        ({"frame": beams().iloc[:1]}, "frame must be of at least two designs .* got 1 rows"),
        ({"frame": beams().to_numpy()}, "frame must be a pandas.DataFrame, got ndarray"),
        (
            {"frame": beams().assign(mass=[np.nan, *range(399)])},
            "column 'mass' must be finite, got nan in row 1; leave out designs that failed",
        ),
        (
            {"frame": beams().assign(width=np.inf)},
            "column 'width' must be finite, got inf in row 1",
        ),
    ],
)  # fmt: skip
def test_mistakes(change, message):
    arguments = {"frame": beams(), "objectives": CRITERIA, **SETTINGS, **change}
    with pytest.raises(PsiError, match=message):
        decision_page(**arguments)


# The command


def test_a_test_table_with_its_prototype(monkeypatch, tmp_path):
    """Names, variables and prototype come from the file."""
    made = {}
    monkeypatch.setattr(
        _page, "decision_page", lambda *a, **k: made.setdefault("page", decision_page(*a, **k))
    )
    tests = investigate(VectorizedSphereChute(0.4, model="rolling"), 64)
    tests = tests.with_prototype([0.5, 1.0], [2.0, 0.1, 0.5, 1.0], name="P1")
    tests.to_csv(tmp_path / "table.csv")
    assert main(["page", str(tmp_path / "table.csv"), "--out", str(tmp_path / "p.html")]) == 0
    page = made["page"]
    names = ["f1", "f2", "f3", "f4", "x1", "x2"]
    assert [column.name for column in page.columns[:6]] == names
    assert page.label_name == "test_point"
    assert set(page.labels) == {"P1", *map(str, tests.numbers[tests.eligible()])}
    assert page.labels[-1] == "P1"


def test_the_command(capsys, tmp_path):
    file, out = tmp_path / "set.csv", tmp_path / "page.html"
    beams().to_csv(file, index=False)
    beams().iloc[[3]].to_csv(tmp_path / "old.csv", index=False)
    names = ["--objectives", 'mass, "cost, total",strength', "--maximize", "strength"]
    more = ["--units", "mass=kg", "--prototype", str(tmp_path / "old.csv"), "--out", str(out)]
    more += ["--limits", "mass=0.9,strength>=-0.9"]
    assert main(["page", str(file), *names, *more]) == 0
    assert "400 designs by mass, cost, total, strength: open" in capsys.readouterr().out
    text = out.read_text("utf-8")
    assert text.lstrip().startswith("<!DOCTYPE html>")
    assert '"name":"mass","unit":"kg"' in text


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        ("", [], "set.csv: it is empty; it must hold a line of column names"),
        ("a,b\n", [], "set.csv: it holds column names, but no row"),
        ("a,b\n1,2\n", [], "frame must be of at least two designs to decide between, got 1 rows"),
        ("a,b\nx,y\nz,w\n", [], "set.csv: no column holds numbers"),
        ("a,b\n1,2\n3,n/e\n", ["--objectives", "a,b"], "row 2 (line 3) holds 'n/e' in the column 'b', text among numbers"),
        ("a,b\n1,2\n3,1\n", ["--objectives", "a,c"], "objectives must be one of 'a', 'b', got 'c'"),
        ("a,b\n1,2\n3,n/e\n", [], "row 2 (line 3) holds 'n/e' in the column 'b', text among numbers"),
        ("a,b\n1,2\n3,1\n", ["--units", "kg"], "--units must be of the form name=unit"),
        ("a,b\n1,2\n3,1\n", ["--limits", "a>=4"], "none of its 2 designs keeps the limits"),
        ("a,b\n1,2\n3,1\n", ["--limits", "c=2"], "limits must be one of 'a', 'b', got 'c'"),
        ("a,b\n1,2\n3,1\n", ["--out", "absent/page.html"], "No such file or directory"),
        ("a,b\n1,2\n3,1\n", ["--out", "set.csv"], "--out must be another file"),
        ("a,b\n1\n3,1,2\n", [], "row 1 (line 2) has 1 cell, the header 2"),
        ("SQLite format 3\0", [], "must be a study file of pymoo-psi, but it is none"),
    ],
)  # fmt: skip
def test_mistakes_on_the_command_line(capsys, tmp_path, monkeypatch, content, options, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "set.csv").write_text(content)
    assert main(["page", "set.csv", *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["set.csv"]


# Saving


def test_saving_replaces_whole_files_only(tmp_path):
    with pytest.raises(FileNotFoundError):
        decision_page(beams(), CRITERIA).save(tmp_path / "absent" / "page.html")
    (tmp_path / "page.html").write_text("old")
    with pytest.raises(PsiError):
        decision_page(beams(), ["absent"]).save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text() == "old"


def test_further_outputs_have_their_place():
    frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0], "heat": [1.0, np.nan, 3.0]})
    page = decision_page(frame, ["cost", "mass"], outputs=["heat"], units={"heat": "K"})
    (heat,) = (column for column in page.columns if column.role == "output")
    assert heat.label == "heat [K]"
    assert "Further outputs" in page.html()
    with pytest.raises(ValueError, match="outputs must be columns that are named once, got 'cost'"):
        decision_page(frame, ["cost", "mass"], outputs=["cost"])
