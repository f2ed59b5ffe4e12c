"""``pymoo-psi rank``: any CSV to ranks, one clear line for any mistake."""

import json

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import VectorizedSphereChute, investigate, rank_of_efficiency
from pymoo_psi.cli import main
from pymoo_psi.table import read_designs
from tests.table.exact_csv import EXACT

DESIGNS = """name,cost [k€],mass [kg],yield
"A, the first",1,2000000,0.1
B,2,1e6,0.3
C [bold],3,5e5,0.2
D,4,4e6,0.05
"""


@pytest.fixture
def rank(capsys, tmp_path):
    """Write a text to designs.csv and rank it."""

    def run(text, *options):
        file = tmp_path / "designs.csv"
        if isinstance(text, bytes):
            file.write_bytes(text)
        elif text is not None:
            file.write_text(text, encoding="utf-8")
        code = main(["rank", str(file), *map(str, options)])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def rows(printed):
    """The lines of the table, which end where the sentences begin."""
    below = printed.partition("---\n")[2]
    return below.partition("rank: ")[0].splitlines()


def test_a_table_on_the_terminal(rank):
    code, printed, err = rank(DESIGNS, "--maximize", "yield")
    assert (code, err) == (0, "")
    assert "4 designs, 3 Pareto optimal; Salukvadze optimum: row 2" in printed
    assert "maximise yield: best 0.3, worst 0.1 of the Pareto set" in printed
    lines = rows(printed)
    assert [line.split()[0] for line in lines] == ["2", "3", "1", "4"]
    for text in ("mass [kg]", "C [bold]", "A, the first", "0.05"):
        assert text in printed
    F = pd.DataFrame({"c": [1, 2, 3, 4], "m": [2e6, 1e6, 5e5, 4e6], "y": [0.1, 0.3, 0.2, 0.05]})
    mu1 = rank_of_efficiency(F, maximize=["y"]).criteria[1, 0]
    assert f"{mu1:.4f}" in lines[0]


def test_top(rank):
    _, printed, _ = rank(DESIGNS, "--top", 2)
    assert len(rows(printed)) == 2
    assert "The best by rank of efficiency:" in printed


def test_csv_out_keeps_every_cell(rank, tmp_path):
    out = tmp_path / "ranked.csv"
    code, printed, _ = rank(DESIGNS, "--maximize", "yield", "--out", out)
    assert code == 0
    assert f"All 4 written to {out}" in printed
    table = pd.read_csv(out, dtype=str, comment="#")
    assert table.columns.tolist() == [
        "row", "name", "cost [k€]", "mass [kg]", "yield", "mu1", "mu2", "mu3", "rank", "pareto",
    ]  # fmt: skip
    assert table["mass [kg]"].tolist() == ["1e6", "5e5", "2000000", "4e6"]
    assert table["rank"].tolist() == ["6", "0", "0", "0"]
    # What was ranked can be ranked again, the same way or another.
    before, again = out.read_text(encoding="utf-8"), tmp_path / "again.csv"
    code, printed, _ = rank(before, "--out", again)  # what is maximised stands in the file
    assert code == 0
    assert "Objectives: cost [k€], mass [kg], yield; not as objectives: row, name, mu1" in printed
    assert again.read_text(encoding="utf-8") == before
    assert rank(before, "--objectives", "cost [k€],mass [kg]", "--out", again)[0] == 0
    assert pd.read_csv(again, comment="#").columns.tolist() == table.columns.tolist()


def test_json_out(rank, tmp_path):
    out = tmp_path / "ranked.JSON"
    text = DESIGNS + "E,5,5e6,0.01\n,6,6e6,0.01\n"
    assert rank(text, "--maximize", "yield", "--no-normalize", "--out", out)[0] == 0
    content = json.loads(out.read_text(encoding="utf-8"))
    assert content["file"] == "designs.csv"
    assert content["objectives"] == ["cost [k€]", "mass [kg]", "yield"]
    assert content["maximized"] == ["yield"]
    assert content["normalized"] is False
    assert content["ideal"] == {"cost [k€]": 1.0, "mass [kg]": 5e5, "yield": 0.3}
    assert content["salukvadze_rows"] == [3]
    first = content["designs"][0]
    assert first == first | {"row": 3, "name": "C [bold]", "cost [k€]": 3, "mass [kg]": 5e5}
    assert first["rank"] == 6
    assert first["pareto"] is True
    assert content["designs"][-1]["name"] is None


def test_rows_are_those_of_the_file_also_where_designs_are_left_out(rank, tmp_path):
    """And a ranking that is ranked again keeps them, in whatever order its rows stand."""
    out = tmp_path / "ranked.json"
    text = "a,b\n,3\n9,0\n1,1\n0,9\n"
    code, printed, _ = rank(text, "--drop-incomplete", "--out", out)
    assert code == 0
    assert "Salukvadze optimum: row 3" in printed
    content = json.loads(out.read_text(encoding="utf-8"))
    assert content["salukvadze_rows"] == [3]
    assert {design["row"]: design["a"] for design in content["designs"]} == {2: 9, 3: 1, 4: 0}
    turned = out.read_text(encoding="utf-8")
    content["designs"].reverse()
    for again in (turned, json.dumps(content)):
        assert "Salukvadze optimum: row 3" in rank(again)[1]


def test_json_has_null_for_what_is_no_number(rank, tmp_path):
    """Distances of a dominated design that lies farther out than numbers reach."""
    out = tmp_path / "far.json"
    assert rank("cost\n1e308\n-1e308\n", "--objectives", "cost", "--out", out)[0] == 0
    content = json.loads(out.read_text("utf-8"), parse_constant=pytest.fail)
    assert [design["mu1"] for design in content["designs"]] == [0, None]


def test_ranks_are_the_librarys(rank, tmp_path):
    F = np.random.default_rng(5).random((60, 3))
    frame = pd.DataFrame(F, columns=["a", "b", "c"])
    out = tmp_path / "r.csv"
    for options, expected in (
        (["--maximize", "b,c"], rank_of_efficiency(F, maximize=[1, 2])),
        (["--maximize", "b", "--maximize", "c"], rank_of_efficiency(F, maximize=[1, 2])),
        (
            ["--objectives", "c,a", "--no-normalize"],
            rank_of_efficiency(F[:, [2, 0]], normalize=False),
        ),
    ):
        assert rank(frame.to_csv(index=False), *options, "--out", out)[0] == 0
        written = pd.read_csv(out, comment="#", **EXACT).sort_values("row")
        assert written["rank"].tolist() == expected.rank.tolist()
        assert written["pareto"].tolist() == expected.pareto.tolist()
        np.testing.assert_allclose(written[["mu1", "mu2", "mu3"]], expected.criteria, rtol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "a;b\n1;2\n2;1\n",
        "a\tb\n1\t2\n2\t1\n",
        "\ufeffa,b\r\n1,2\r\n2,1\r\n",
        "a, b \n 1, 2\n 2, 1\n",
        "# made by a tool\n# units: SI\na,b\n\n1,2\n\n2,1\n",
        "a,b,\n1,2,\n2,1,\n",
        ",a,b\n0,1,2\n1,2,1\n",
        'note,a,b\n"two\nlines, one cell",1,2\nx,2,1\n',
    ],
)
def test_other_kinds_of_files(rank, text):
    code, printed, err = rank(text)
    assert (code, err) == (0, "")
    assert "2 designs, 2 Pareto optimal" in printed
    assert printed.count("minimise") == 2


def test_one_row(rank):
    code, printed, _ = rank("a,b\n3,4\n")
    assert code == 0
    assert "1 design, 1 Pareto optimal; Salukvadze optimum: row 1" in printed


def test_an_objective_called_row(rank):
    code, _, err = rank("row,b\n1,2\n2,1\n")
    assert code == 2
    assert "'b' is the only column that can be an objective" in err
    code, printed, _ = rank("row,b\n1,2\n2,1\n", "--objectives", "row,b")
    assert code == 0
    lines = printed.splitlines()
    head = lines[lines.index("By rank:") + 1]
    assert head.split()[:2] == ["row", "b"]


def test_an_objective_called_mark(rank, tmp_path):
    """``mark`` is a column of the page's export only beside the columns of a ranking."""
    out = tmp_path / "out.csv"
    assert rank("mark,b\n1,2\n2,1\n", "--out", out)[0] == 0
    assert pd.read_csv(out)["mark"].tolist() == [1, 2]


def test_a_name_with_a_comma(rank):
    text = '"time, s",mass\n1,2\n2,1\n'
    code, printed, _ = rank(text, "--objectives", "time, s", "--objectives", "mass")
    assert code == 0
    assert "minimise time, s" in printed


def test_columns_of_text_are_carried_along(rank):
    code, printed, _ = rank("id,f\nx1,2\nx2,1\n", "--objectives", "f")
    assert code == 0
    assert "x2" in printed
    code, _, _ = rank("id,f,g\n1,2,1\n2b,1,2\n", "--objectives", "f,g")
    assert code == 0  # a column that is not asked for may hold anything


def test_a_test_table_of_this_package(rank, tmp_path):
    table = investigate(VectorizedSphereChute(0.4, model="rolling"), 64)
    file, out = tmp_path / "table.csv", tmp_path / "out.csv"
    table.to_csv(file)
    code, printed, err = rank(file.read_text(encoding="utf-8"), "--no-normalize", "--out", out)
    assert (code, err) == (0, "")
    feasible = table.rows(table.feasible())
    expected = rank_of_efficiency(feasible.F, normalize=False)
    written = pd.read_csv(out, **EXACT).sort_values("row")
    assert written["rank"].tolist() == expected.rank.tolist()
    assert written["test_point"].tolist() == feasible.numbers.tolist()
    assert "minimise f4" in printed
    assert read_designs(file).roles().objectives == ("f1", "f2", "f3", "f4")


def test_a_test_table_without_a_feasible_design(rank, tmp_path):
    table = investigate(VectorizedSphereChute(omega0=(0, -30, 0)), 8)
    table = table.rows(~table.feasible())
    assert len(table)
    table.to_csv(tmp_path / "table.csv")
    code, _, err = rank((tmp_path / "table.csv").read_text(encoding="utf-8"))
    assert code == 2
    assert f"none of its {len(table)} tests is feasible" in err
    table.rows([]).to_csv(tmp_path / "table.csv")  # as a study that has just begun
    code, _, err = rank((tmp_path / "table.csv").read_text(encoding="utf-8"))
    assert (code, "it holds no tests yet" in err) == (2, True)


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (None, [], "No such file or directory"),
        ("", [], "it is empty; it must hold a line of column names, then the designs"),
        ("\n \n", [], "it is empty"),
        ("# only a comment\n", [], "it is empty"),
        (",,\n , , \n", [], "it is empty"),
        ("a,b\n", [], "it holds column names, but no row"),
        ("1,2\n2,1\n", [], "its first line must name the columns, and holds numbers"),
        (
            "a,b\n1,2\n2,x1\n",
            [],
            "row 2 (line 3) holds 'x1' in the column 'b', text among numbers; correct it",
        ),
        (
            "#\na,b\n\n1,2\n2,1_0\n",
            [],
            "row 2 (line 5) holds '1_0' in the column 'b', text among numbers",
        ),
        (
            "a;b\n1;2,5\n2;1.5\n",
            [],
            "row 2 (line 3) holds '1.5' in the column 'b', with the decimal mark",
        ),
        (
            "a,b\n1,2\n2,\n",
            [],
            "row 2 (line 3) holds no number in the column 'b'; leave out such designs",
        ),
        (
            "a,b\n1,2\n2,-inf\n",
            [],
            "row 2 (line 3) holds -inf in the column 'b'; leave out such designs",
        ),
        ("a,b\n1,nan\n2,NaN\n", [], "its column 'b' holds no number at all; leave it out, or name"),
        ("a,b\nnan,nan\n", [], "its column 'a' holds no number at all"),
        ("a,b\n1,nan\n2,nan\n", ["--objectives", "b"], "its column 'b' holds no number at all"),
        ("a,b\nx,y\n", [], "no column holds numbers"),
        ("id,mu1\n1,2\n", [], "no column holds numbers that can be objectives"),
        ("a,b\nx,1\n", ["--objectives", "a"], "its column 'a' holds no number at all"),
        ("a,b,a\n1,2,3\n", [], "its header names the column 'a' 2 times"),
        (",a,\n1,2,3\n", [], "its header leaves columns without a name"),
        ("a,b\n1,2\n1,2,3\n", [], "row 2 (line 3) has 3 cells, the header 2"),
        ("a,b\n1\n", [], "row 1 (line 2) has 1 cell, the header 2"),
        (b"a,b\n\xff\xfe,1\n", [], "it is no UTF-8 text"),
        ("a,b\n" + 200_000 * "x" + ",1\n", [], "it is no text in rows and columns: field larger"),
        (DESIGNS, ["--objectives", "mass"], "--objectives must be one of"),
        (DESIGNS, ["--objectives", "yeild"], "did you mean 'yield'?"),
        (
            DESIGNS,
            ["--objectives", "yield,yield"],
            "--objectives must be columns that are named once, got 'yield'",
        ),
        (DESIGNS, ["--objectives", ""], "--objectives must be one of"),
        (DESIGNS, ["--maximize", "name"], "--maximize must be one of the objectives"),
        (DESIGNS, ["--maximize", "nothing"], "--maximize must be one of"),
        (DESIGNS, ["--top", "0"], "--top must be an integer >= 1, got 0"),
        (DESIGNS, ["--out", "x.xlsx"], "--out must be a file with the suffix .csv or .json"),
        (DESIGNS, ["--out", "absent/x.csv"], "No such file or directory"),
        (
            "rank,b\n1,2\n",
            ["--objectives", "rank,b"],
            "the objective 'rank' has the name of a column",
        ),
        (DESIGNS, ["--maximise", "yield"], "No such option"),
    ],
)
def test_mistakes(rank, text, options, message):
    code, printed, err = rank(text, *options)
    assert code == 2
    assert message in err
    assert err.startswith("pymoo-psi: error: ")
    assert err.count("\n") == 1
    assert "Traceback" not in printed + err


def test_a_folder_without_studies_is_no_file(capsys, tmp_path):
    assert main(["rank", str(tmp_path)]) == 2
    assert "holds no study; check the name" in capsys.readouterr().err


def test_a_mistake_writes_nothing(rank, tmp_path):
    out = tmp_path / "out.csv"
    assert rank("a,b\n1,x\n2,3\n", "--out", out)[0] == 2
    assert not out.exists()


def test_a_figure_in_the_format_of_its_suffix(rank, tmp_path):
    figure = tmp_path / "front.PDF"
    code, printed, _ = rank(DESIGNS, "--figure", figure)
    assert (code, printed.splitlines()[-1]) == (0, f"Figure written to {figure}")
    assert figure.read_bytes().startswith(b"%PDF-")
    code, _, err = rank(DESIGNS, "--figure", tmp_path / "front.jpg")
    assert code == 2
    assert "--figure must be a file with the suffix .png or .pdf or .svg" in err


def test_a_maximised_criterion_that_is_negative_throughout_is_asked_about(rank):
    """Who writes pymoo's F has turned its sign already, and would get the worst design."""
    for cells, asked in (("-3,-2,-1", True), ("-3,-2,1", False)):
        rows = "".join(f"{i},{cell}\n" for i, cell in enumerate(cells.split(",")))
        _, printed, _ = rank(f"f1,f2\n{rows}", "--maximize", "f2")
        assert ("f2 is maximised, and negative throughout" in printed) == asked
        assert "negative" not in rank(f"f1,f2\n{rows}")[1]
