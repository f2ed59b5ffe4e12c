"""The decision page in Python: its data, where they come from, and what is refused."""

import json

import numpy as np
import pandas as pd
import pytest
from pymoo.problems import get_problem

from pymoo_psi import PsiError, TestTable, VectorizedSphereChute, investigate, rank_of_efficiency
from pymoo_psi.cli import _page, main
from pymoo_psi.page import decision_page
from pymoo_psi.page._data import Scale, notation_of, payload, witnesses
from pymoo_psi.pareto import nondominated
from pymoo_psi.table import Layout
from tests.beams import CRITERIA, SETTINGS, beams

# The data


def test_it_says_how_much_it_shows():
    page = decision_page(beams(), CRITERIA, title="Beams")
    assert repr(page) == "DecisionPage('Beams': 400 designs)"


def test_all_designs_are_there_in_the_order_of_the_frame():
    frame = beams()
    data = decision_page(frame, CRITERIA, **SETTINGS)
    ranking = rank_of_efficiency(frame[CRITERIA], maximize=["strength"])
    assert [column.name for column in data.columns] == [*CRITERIA, "width", "material"]
    assert [column.unit for column in data.columns] == ["kg", "", "", "mm", ""]
    assert data.labels[:-1].tolist() == frame["number"].astype(str).tolist()
    assert data.labels[-1] == "prototype"
    assert data.n_designs == 400
    np.testing.assert_array_equal(data.columns[0].values[:-1], frame["mass"])
    assert data.columns[0].values[-1] == SETTINGS["prototype"]["mass"]
    np.testing.assert_array_equal(data.ranking.rank, ranking.rank)
    assert data.optima == [str(1001 + i) for i in ranking.salukvadze]


def test_of_each_dominated_design_a_dominator_is_named():
    rng = np.random.default_rng(3)
    front = np.abs(rng.normal(size=(3000, 4)))
    front = 1.2 - front / np.linalg.norm(front, axis=1)[:, None]
    for F in (front + 0.02 * rng.random((3000, 1)) ** 3, rng.integers(0, 9, (500, 3)) / 7.0):
        optimal = nondominated(F)
        found = witnesses(F, optimal)
        np.testing.assert_array_equal(found < 0, optimal)
        by = found[~optimal]
        assert optimal[by].all()
        assert (F[by] <= F[~optimal]).all()
        assert (F[by] < F[~optimal]).any(axis=1).all()


def test_designs_without_all_criteria_are_counted():
    frame = beams()
    frame.loc[[3, 5], "mass"] = [np.nan, np.inf]
    frame.loc[[5, 7], "strength"] = np.nan
    page = decision_page(frame, CRITERIA, failed={"timeout": 4}, infeasible=2, **SETTINGS)
    assert page.n_designs == 397
    assert page.failed == {"no finite mass": 2, "no finite strength": 1, "timeout": 4}
    sent = payload(page)
    assert sent["failed"]["count"] == 7
    assert sent["failed"]["reasons"][0] == ["timeout", 4]
    assert sent["infeasible"] == 2


@pytest.mark.parametrize(
    ("values", "scale"),
    [
        ([*np.linspace(1, 3, 298), 1e30, 1e30], (1, 3, False)),
        ([*np.linspace(-1, 3, 299), -1e30], (-1, 3, False)),
        ([*np.logspace(0, 6, 300), 1e30], (1, 1e6, True)),
        ([0.0] * 290 + [1.0] * 10, (0, 1, False)),
        ([5.0] * 4, (5, 5, False)),
        ([1.0, 1000.0], (1, 1000, False)),
        ([], (0, 0, False)),
    ],
)
def test_outliers_set_no_scale(values, scale):
    found = Scale.of(np.array(values))
    assert (found.low, found.high, found.log) == pytest.approx(scale)


def test_designs_have_one_name_each():
    sent = payload(decision_page(beams(), CRITERIA, **SETTINGS))
    assert sent["ids"] is None
    twice = beams().assign(number=[1, 1, *range(2, 400)])
    old = pd.DataFrame({name: [1.0, 2.0] for name in CRITERIA}, index=["2", "new"])
    sent = payload(decision_page(twice, CRITERIA, label="number", prototype=old))
    assert sent["ids"][:3] == ["1 #1", "1 #2", "2"]
    assert sent["ids"][-2:] == ["2 (existing 1)", "new"]


def test_designs_of_one_label_are_called_as_by_the_commands(tmp_path, capsys):
    path = tmp_path / "set.csv"
    path.write_text("id,mass,cost\nA,9,1\nB,,3\nC,1,9\nA,4,4\nA,3,5\n", encoding="utf-8")
    assert main(["page", str(path), "--out", str(tmp_path / "page.html")]) == 0
    html = (tmp_path / "page.html").read_text("utf-8")
    sent = json.loads(html.split('id="payload">')[1].split("</script>")[0])
    assert sent["ids"] == ["A #1", "C", "A #4", "A #5"]
    capsys.readouterr()
    for limit, best in (("mass<=9", "A #4"), ("mass<=4", "A #5")):
        main(["rank", str(path), "--drop-incomplete", "--limits", limit])
        assert f"{best} is the Salukvadze optimum" in capsys.readouterr().out


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
    assert notation_of(np.array(values)) == notation


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
        ({"limits": {"depth": 1.0}}, "limits must be one of .* got 'depth'"),
        ({"limits": {"mass": "1"}}, "the limit on 'mass' must be a number"),
        ({"limits": {"mass": (2, 1)}}, r"the limit on 'mass' must be \(lower, upper\)"),
        ({"limits": {"material": 1}}, "column 'material' must be numbers"),
        ({"limits": {"mass": -9.0}}, "limits must be kept by one design or more, got none of 400"),
        ({"limits": {"strength": 9.0}}, "limits must be kept by one design or more, got none of 400"),
        ({"normalize": "no"}, "normalize must be True or False"),
        ({"prototype": {"mass": 1.0}}, "prototype must be a design with a value for every objective"),
        ({"prototype": 3}, "prototype must be a mapping or a pandas.DataFrame, got int"),
        ({"frame": beams().iloc[:0]}, "frame must be of one design or more .* got none in 0 rows"),
        ({"frame": beams().to_numpy()}, "frame must be a pandas.DataFrame or a TestTable, got ndarray; of pymoo's res.F give"),
        (
            {"frame": beams().assign(mass=np.nan)},
            "frame must be of one design or more with a finite value of every objective, got none in 400",
        ),
        (
            {"prototype": {"mass": 1.0, "cost, total": np.inf, "strength": 0.0}},
            "column 'cost, total' must be finite, got inf in row 1",
        ),
        (
            {"frame": beams().assign(mass=np.resize([-1.5e308, 1.5e308, 0], 400))},
            r"column 'mass' must be of finite range, got -1.5e\+308 to 1.5e\+308",
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
        ("a,b\nx,1\nx,\n", ["--objectives", "b", "--decision", "absent.json"], "absent.json: No such file"),
        ("a,b\nx,y\nz,w\n", [], "set.csv: no column holds numbers"),
        ("a,b\n1,2\n3,n/e\n", ["--objectives", "a,b"], "row 2 (line 3) holds 'n/e' in the column 'b', text among numbers"),
        ("a,b\n1,2\n3,1\n", ["--objectives", "a,c"], "objectives must be one of 'a', 'b', got 'c'"),
        ("a,b\n1,2\n3,n/e\n", [], "row 2 (line 3) holds 'n/e' in the column 'b', text among numbers"),
        ("a,b,c\n1,2,0\n3,1,0\n", ["--objectives", "a,b", "--units", "c=kg"], "got 'c'; --variables shows further"),
        ("a,b\n1,2\n3,1\n", ["--prototype", "V08"], "--prototype must be a file of existing designs, got 'V08'"),
        ("a,b\n1,2\n3,1\n", ["--units", "kg"], "--units must be of the form name=unit"),
        ("a,b\n1,2\n3,1\n", ["--units", "a=kg,a=g"], "--units must be given once for each column"),
        ("a,b\n1,2\n3,1\n", ["--limits", "a>=4"], "--limits must be kept by one design or more, got none of 2"),
        ("a,b\n1,2\n3,1\n", ["--limits", "c=2"], "--limits must be one of 'a', 'b', got 'c'"),
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
    assert (heat.name, heat.unit) == ("heat", "K")
    assert "Further outputs" in page.html()
    with pytest.raises(ValueError, match="outputs must be columns that are named once, got 'cost'"):
        decision_page(frame, ["cost", "mass"], outputs=["cost"])


def test_infeasible_tests_of_a_table_are_not_ranked_as_designs():
    """The frame of a whole table has them, and the best of all is mostly one of them."""
    table = investigate(get_problem("bnh"), 16)
    assert (table.status == "infeasible").any()
    with pytest.raises(PsiError, match=r"frame must be of feasible designs.*table\.feasible"):
        decision_page(table.to_frame(), ["f1", "f2"])
    feasible = table.rows(table.feasible())
    assert decision_page(feasible.to_frame(), ["f1", "f2"]).n_designs == len(feasible)


def test_a_test_table_says_itself_what_its_columns_are():
    """Its frame alone has lost the senses: all would be minimised without a word."""
    layout = Layout.of(
        1, ["mass", "gain"], 1, outputs=["heat"], maximize=["gain"],
        units={"mass": "kg", "g1": "MPa"},
    )  # fmt: skip
    table = TestTable.of(
        [1, 2, 3, 4],
        [[0.1], [0.2], [0.3], [0.4]],
        [[1, -1], [2, -4], [3, -3], [np.inf, np.inf]],
        G=[[-1], [-1], [1], [0]],
        outputs={"heat": [5, 6, 7, 8]},
        reasons={4: "no mesh"},
        layout=layout,
    )
    page = decision_page(table)
    assert {c.name: (c.role, c.maximize, c.unit) for c in page.columns} == {
        "x1": ("variable", False, ""),
        "mass": ("criterion", False, "kg"),
        "gain": ("criterion", True, ""),
        "heat": ("output", False, ""),
    }
    assert (page.ids, page.failed, page.infeasible) == (["1", "2"], {"no mesh": 1}, 1)
    assert page.ranking.objectives.values.tolist() == [[1, 1], [2, 4]]
    with pytest.raises(PsiError, match=r"maximize must be left out.*knows it.*table\.under"):
        decision_page(table, maximize=["gain"])


def test_outputs_may_be_at_the_ends_of_floats(tmp_path):
    """As numbers that a program has never set; axes and digits are nobody's concern there."""
    ends = [np.finfo(float).max, -np.finfo(float).max, 5e-324]
    frame = pd.DataFrame({"a": [1, 2, 3], "b": [3, 2, 1], "unset": ends, "tiny": [0, 5e-324, -0.0]})
    page = decision_page(frame, ["a", "b"], outputs=["unset", "tiny"])
    assert page.html()
