"""Files of designs: every kind is read the same by ``rank`` and ``page``, or refused in a line."""

import json
import re

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import PsiError, TestTable, VectorizedSphereChute, investigate
from pymoo_psi.cli import main
from pymoo_psi.page import decision_page
from pymoo_psi.table import read_designs

COST, MASS = [1.5, 2.25, 3.0], [30.0, 2.5, 1.0]


@pytest.fixture
def written(tmp_path):
    def write(text, name="designs.csv"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
        return path

    return write


@pytest.mark.parametrize(
    "text",
    [
        ",cost,mass\n0,1.5,30\n1,2.25,2.5\n2,3,1\n",
        "Unnamed: 0,cost,mass\n0,1.5,30\n1,2.25,2.5\n2,3,1\n",
        "cost,mass,ID,remark\n1.5,30,7,a\n2.25,2.5,8,b\n3,1,9,\n",
        "cost,mass,mu1,mu2,mu3,rank,pareto\n1.5,30,1,1,1,6,True\n2.25,2.5,1,1,1,0,True\n3,1,2,2,2,0,False\n",
        "cost,mass,status\n1.5,30,ok\n0,0,infeasible\n2.25,2.5,ok\n3,1,ok\ninf,inf,failed\n",
        "mass,f1,cost\n30,1.5,1.5\n2.5,2.25,2.25\n1,3,3\n",
    ],
)
def test_labels_and_rankings_are_no_objectives(written, text):
    file = read_designs(written(text))
    roles = file.roles()
    if "f1" in text:  # one column called f1 says nothing about the others
        assert roles.objectives == ("mass", "f1", "cost")
    else:
        assert roles.objectives == ("cost", "mass")
    np.testing.assert_array_equal(file.values(["cost", "mass"]), np.column_stack([COST, MASS]))
    frame = file.frame(roles.objectives)
    assert frame["cost"].tolist() == COST


def test_names_tell_objectives_from_variables(written):
    columns = "test_point,x1,x2,f1,f2,g1,mu1,mu2,mu3,rank,pareto"
    file = read_designs(written(f"{columns}\n" + "1,2,3,4,5,6,7,8,9,6,True\n" * 2))
    roles = file.roles()
    assert (roles.objectives, roles.variables) == (("f1", "f2"), ("x1", "x2"))
    assert roles.label == "test_point"
    fact = (
        "Objectives: f1, f2; not as objectives: test_point, x1, x2, g1, mu1, mu2, mu3, rank, pareto"
    )
    told = file.told(roles)
    assert (told.fact, told) == (fact, f"{fact} (--objectives chooses others)")
    named = file.roles(["x1", "f1"], ["test_point"])
    assert (named.objectives, named.variables, named.label) == (("x1", "f1"), ("test_point",), None)
    with pytest.raises(PsiError, match="'f1' is the only column that can be an objective; if you"):
        file.roles(variables=["f2"])


@pytest.fixture(scope="module")
def table():
    tests = investigate(VectorizedSphereChute(0.4, omega0=(0, -30, 0)), 64)
    assert 0 < tests.eligible().sum() < 64
    return tests


def test_tables_and_studies_give_the_same_designs(table, tmp_path):
    table.to_csv(tmp_path / "t.csv")
    table.to_parquet(tmp_path / "t.parquet")
    study = tmp_path / "s.db"
    investigate(VectorizedSphereChute(0.4, omega0=(0, -30, 0)), 64, study=study)
    kept = table.rows(table.eligible())
    for name in ("t.csv", "t.parquet", "s.db"):
        file = read_designs(tmp_path / name)
        roles = file.roles()
        assert (roles.objectives, roles.variables) == (("f1", "f2", "f3", "f4"), ("x1", "x2"))
        np.testing.assert_array_equal(file.values(roles.objectives), kept.F)
        np.testing.assert_array_equal(file.values(roles.variables), kept.X)
        assert file.cells["test_point"].tolist() == kept.numbers.tolist()
        assert file.remarks == (f"{len(kept)} of 64 tests are feasible; the others are left out.",)


def test_rank_and_page_take_the_same_columns(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["solve", "chute", "--points", "64", "--study", "s.db", "--out", "front.csv"]) == 0
    assert main(["rank", "front.csv", "--out", "ranked.csv"]) == 0
    assert main(["rank", "front.csv", "--out", "ranked.json"]) == 0
    assert main(["export", "s.db", "--out", "table.csv"]) == 0
    capsys.readouterr()
    ranks = {}
    for name in ("front.csv", "ranked.csv", "ranked.json", "table.csv", "s.db"):
        assert main(["rank", name, "--out", "again.csv"]) == 0
        printed = capsys.readouterr().out
        assert "Objectives: f1, f2, f3, f4" in printed
        assert "row" not in printed.splitlines()[0].partition(";")[0]
        again = pd.read_csv("again.csv").set_index("test_point").sort_index()
        ranks[name] = again.loc[again["pareto"], ["f1", "mu1", "mu2", "mu3", "rank"]]
        assert main(["page", name]) == 0
        assert "designs by f1, f2, f3, f4: open" in capsys.readouterr().out
    for name, frame in ranks.items():
        pd.testing.assert_frame_equal(frame, ranks["s.db"], rtol=1e-12, obj=name)


def test_json_keeps_what_was_maximised(capsys, written, tmp_path):
    path, out = written("n,yield\n1,2\n2,3\n4,1\n"), tmp_path / "r.json"
    assert main(["rank", str(path), "--maximize", "yield", "--out", str(out)]) == 0
    first = json.loads(out.read_text("utf-8"))
    again = tmp_path / "again.json"
    assert main(["rank", str(out), "--out", str(again)]) == 0
    assert "maximise yield" in capsys.readouterr().out
    second = json.loads(again.read_text("utf-8"))
    assert second["designs"] == first["designs"]
    assert read_designs(out).roles().maximize == ("yield",)


def test_an_export_of_the_page_keeps_its_prototypes(written):
    text = (
        "number,f1,f2,mu1,mu2,mu3,rank,mark\nold,9,9,1,1,1,,prototype\n"
        "5,1,2,0,0,0,6,Salukvadze optimum\n7,2,1,1,1,1,0,\n8,3,3,1,1,1,0,dominated\n"
    )
    file = read_designs(written(text))
    assert file.cells["number"].tolist() == ["5", "7", "8"]
    roles = file.roles()
    frame = file.frame(roles.objectives)
    data = decision_page(frame, roles.objectives, label=roles.label, prototype=file.prototype)
    assert sorted(map(str, data.labels)) == ["5", "7", "8", "old"]
    assert data.labels[-1] == "old"
    assert (data.n_designs, len(data.labels)) == (3, 4)


def test_row_labels_without_a_heading_are_labels_of_the_page(written):
    file = read_designs(written(",a,b\nfirst,1,2\nsecond,2,1\n"))
    roles = file.roles()
    data = decision_page(file.frame(roles.objectives), roles.objectives, label=roles.label)
    assert sorted(data.labels) == ["first", "second"]


def test_choices_and_booleans_reach_the_page(tmp_path):
    tests = TestTable.of(
        [1, 2], [[0.5, "oak", True], [0.25, "ash", False]], [[1.0, 2.0], [2.0, 1.0]]
    )
    tests.to_csv(tmp_path / "t.csv")
    file = read_designs(tmp_path / "t.csv")
    frame = file.frame(["f1", "f2"])
    assert frame["x2"].tolist() == ["oak", "ash"]
    assert frame["x3"].tolist() == [True, False]
    with pytest.raises(PsiError, match="its column 'x2' holds no number at all"):
        file.frame(["x2", "f1"])


def test_numbers_are_read_to_the_last_digit(tmp_path):
    """Unlike those that pandas reads before 3.1 unless it is asked to."""
    F = np.random.default_rng(3).random((500, 2)) * 10.0 ** np.arange(-250, 250)[:, None]
    frame = pd.DataFrame(F, columns=["cost", "mass"])
    frame.to_csv(tmp_path / "designs.csv", index=False)
    frame = read_designs(tmp_path / "designs.csv").frame(["cost"])
    np.testing.assert_array_equal(frame[["cost", "mass"]], F)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"PAR1 and so on", "it cannot be read as Parquet"),
        ('{"a": 1}', "it is JSON, but none that 'pymoo-psi rank --out FILE.json' wrote; give the"),
        ("[1, 2]", "it is JSON, but none that"),
        ('{"a": ', "it is JSON, but none that"),
        ('{"objectives": ["a"], "maximized": [], "designs": []}', "its designs are missing"),
        ('{"objectives": ["a"], "maximized": [], "designs": [{"b": 1}]}', "lack columns"),
        ('{"objectives": ["a"], "maximized": [], "designs": [{"a": 1}, {}]}', "lack columns"),
        ("a,status\n1,failed\n", "none of its 1 designs is feasible"),
        ('# {"pymoo_psi_test_table": 1}\nf1\n1\n', "must be a table of tests, of to_csv or 'pymoo-psi export': its head"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_told_with_a_remedy(written, content, message):
    def values(path):
        file = read_designs(path)
        return file.values(file.roles().objectives)

    path = written(content)
    with pytest.raises(PsiError, match=message):
        values(path)


def test_naming_the_objectives_lets_other_columns_be(written):
    file = read_designs(written("a,b,empty\n1,x,\n2,y,\n"))
    with pytest.raises(PsiError, match="its column 'empty' holds no number at all; leave it out"):
        file.roles()
    assert file.roles(["a"]).objectives == ("a",)
    with pytest.raises(PsiError, match="objectives must be one of 'a', 'b', 'empty', got 'c'"):
        file.roles(["c"])
    with pytest.raises(PsiError, match="objectives names the column 'a' twice"):
        file.roles(["a", "a"])


def test_the_input_is_not_overwritten(capsys, written):
    path = written("a,b\n1,2\n2,1\n")
    link = path.with_name("link.csv")
    link.symlink_to(path)
    for command in ("rank", "page"):
        assert main([command, str(path), "--out", str(link)]) == 2
        assert "--out must be another file than the one that is read" in capsys.readouterr().err
    assert path.read_text("utf-8") == "a,b\n1,2\n2,1\n"


def test_a_file_is_told_in_a_line(tmp_path):
    path = tmp_path / "set.csv"
    path.write_text("id,cost,mass\nA,1.5,4\nB,2,1\n", encoding="utf-8")
    assert repr(read_designs(path)) == f"DesignFile({str(path)!r}: 2 designs; id, cost, mass)"


@pytest.mark.parametrize(
    ("rows", "label"),
    [
        ("V1,1,4\nV2,2,1\n", "Variante"),
        ("V1,1,4\nV1,2,1\n", None),  # names tell designs apart
        ("V1,1,4\n,2,1\n", None),
        ("7,1,4\n8,2,1\n", None),  # numbers are something to weigh
    ],
)
def test_the_first_column_names_the_designs_if_it_can(written, rows, label):
    file = read_designs(written(f"Variante,Masse,Kosten\n{rows}"))
    assert file.label == file.roles(["Masse", "Kosten"]).label == label
    assert file.roles(["Masse", "Kosten"], ["Variante"]).label is None
    assert file.called(label)[0] == ("row 1" if label is None else "V1")


def test_a_label_by_its_name_goes_before_the_first_column(written):
    path = written("material,cost,mass,id\niron,1,4,7\nwood,2,1,9\n")
    assert read_designs(path).label == "id"


def test_names_of_designs_go_before_numbers_of_rows(written):
    """As in what ``rank`` has written of a spreadsheet."""
    ranked = written("row,Variante,Masse,Kosten\n2,V2,2,1\n1,V1,1,4\n")
    assert read_designs(ranked).roles(["Masse", "Kosten"]).label == "Variante"
    assert read_designs(written("row,Masse,Kosten\n2,2,1\n1,1,4\n")).label == "row"


@pytest.mark.parametrize("name", ["Nr.", "nr", "No."])
def test_numbers_of_rows_are_no_objective(written, name):
    roles = read_designs(written(f"{name},Masse,NO\n7,1,4\n8,2,1\n")).roles()
    assert roles.objectives == ("Masse", "NO")
    assert roles.label == name


def test_a_first_column_that_counts_is_asked_about(written):
    counts = "counts the rows: if it only numbers designs, say --objectives"
    for cells, asked in (("7,8,9", True), ("7,8,8", False), ("7,9,8", False)):
        rows = "\n".join(f"{cell},{cell},4" for cell in cells.split(","))
        file = read_designs(written(f"Versuch,Masse,Preis\n{rows}\n"))
        assert (f"Versuch {counts}" in file.told(file.roles())) == asked
        assert "Masse counts" not in file.told(file.roles())


def test_all_titles_above_the_names_are_told_at_once(written):
    path = written("Series 5;;\nby M.;;\n\nmodel;cost;mass\nA;1;4\nB;2;1\n")
    with pytest.raises(PsiError, match=r"leave lines (.*) out by --skip-rows \1 if they") as told:
        read_designs(path)
    skipped = re.search("--skip-rows ([0-9,]+)", str(told.value))[1]
    lines = [int(number) for number in skipped.split(",")]
    assert read_designs(path, skip_rows=lines).names[0] == "model"
