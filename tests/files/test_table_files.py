"""Frames and files: a round trip changes nothing, a damaged file is named."""

import csv
import json
import os
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import (
    Formulation,
    TestTable,
    VectorizedSphereChute,
    cautions,
    compare_designs,
    explain,
    investigate,
)
from pymoo_psi.files import format_of, read_table, write_table
from pymoo_psi.plots import plot_objectives, plot_ranking, plot_table
from pymoo_psi.study import NOT_VALUES
from pymoo_psi.table import RESERVED, Decision, Schema
from tests.helpers.draws import examples
from tests.helpers.processes import posix
from tests.helpers.refusals import flaw, refused

CSV = format_of("t.csv", "tests")
texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]))
finite = st.floats(allow_nan=False, allow_infinity=False)


# XML, and so a workbook, has no control characters; its readers may take others for line ends.
visible = st.text(st.characters(exclude_categories=["Cs", "Cc", "Cn", "Zl", "Zp"]))


@st.composite
def tables(draw, texts=texts):
    names = texts.filter(lambda name: name and name not in (*RESERVED, *NOT_VALUES))
    choices = st.one_of(finite, st.integers(1 - 2**63, 2**63 - 1), st.booleans(), texts)
    columns = [finite, st.integers(1 - 2**63, 2**63 - 1), st.booleans(), texts, choices]
    n, n_var, m, n_ieq, n_eq = (
        draw(st.integers(*r)) for r in ((0, 6), (0, 4), (0, 3), (0, 2), (0, 2))
    )
    n_out, n_notes = draw(st.integers(0, 2)), draw(st.integers(0, 2))
    width = n_var + m + n_ieq + n_eq + n_out + n_notes
    name = draw(st.lists(names, min_size=width, max_size=width, unique=True))
    notes = [name.pop() for _ in range(n_notes)]
    units = dict.fromkeys(name[:2], draw(st.sampled_from(["kg", "%", "µm; =1", "#{}"])))
    groups = [tuple(name.pop() for _ in range(k)) for k in (n_var, m, n_ieq, n_eq)]
    outputs = {key: draw(arrays(float, n, elements=st.floats())) for key in name}
    maximize = draw(st.sets(st.sampled_from(groups[1] + tuple(name)))) if m else set()
    lower = draw(arrays(float, n_var, elements=st.just(np.nan) | st.floats(-10, 10)))
    schema = Schema.of(
        *groups,
        lower=lower,
        upper=lower + draw(st.floats(0, 10)),
        eq_tolerance=draw(st.sampled_from([0.0, 1e-4])),
        outputs=name,
        maximize=sorted(maximize),
        units=units,
    )
    kinds = draw(st.lists(st.sampled_from(columns), min_size=n_var, max_size=n_var))
    X = np.empty((n, n_var), dtype=object)
    for j, kind in enumerate(kinds):
        X[:, j] = draw(st.lists(kind, min_size=n, max_size=n))
    F, G, H = (draw(arrays(float, (n, k), elements=st.floats())) for k in (m, n_ieq, n_eq))
    numbers = draw(st.lists(st.integers(1, 2**40), min_size=n, max_size=n, unique=True))
    failed = draw(st.sets(st.sampled_from(numbers))) if n else set()
    reasons = {number: draw(texts) for number in failed}
    numbers = np.array(numbers, dtype=int)
    cells = st.one_of(st.none(), columns[1], texts)
    notes = {key: draw(st.lists(cells, min_size=n, max_size=n)) for key in notes}
    label = draw(st.sampled_from([None, *notes]))
    table = TestTable.of(numbers, X, F, G, H, outputs=outputs, reasons=reasons, schema=schema, notes=notes, label=label)  # fmt: skip
    table = replace(table, decimal=draw(st.sampled_from(".,")), separator=";")
    return table.under(draw(decisions(groups[1], texts)))


@st.composite
def decisions(draw, objectives, texts):
    limits = dict.fromkeys(objectives[: draw(st.integers(0, 3))], (-1.0, 2.0))
    position = st.builds(
        dict,
        name=texts.filter(bool),
        date=st.sampled_from(["", "2026-05-01", "2026-05-01T10:30:00.123+02:00"]),
        reason=texts,
        limits=st.just(limits),
    )
    decided = draw(st.none() | st.builds(dict, chosen=texts, agree=st.lists(texts, max_size=2)))
    ranges = draw(st.sampled_from([None, {}, dict.fromkeys(objectives, (-1.5, 2.0))]))
    formulation = Formulation(limits=limits, normalize=draw(st.booleans()), ranges=ranges)
    positions = draw(st.lists(position, max_size=2))
    return Decision(formulation, draw(st.none() | texts), draw(texts), positions, decided)


def bits(table):
    """The cells of a table, zeros with their signs, and their types."""
    arrays = [table.numbers, table.X, table.F, *map(table.column, table.columns), table.status]
    return [[repr(v) for v in a.ravel().tolist()] for a in arrays] + [a.dtype for a in arrays]


def check_same(read, table):
    assert read.equals(table)
    assert bits(read) == bits(table)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tables")


# Options that look alike keep their types.
CELLS = ["12", 12, 12.0, True, "true", '"oak"', "oak", "NaN", "[1]", "{", "", " 7 ", "1e5", "null", "a\r\nb\rc", "_x000D_ _x005F_"]  # fmt: skip
ALIKE = TestTable.of(range(1, len(CELLS) + 1), [[cell] for cell in CELLS], np.ones((len(CELLS), 1)))


@examples(2)
@given(table=tables())
@example(table=ALIKE)
@example(table=TestTable.of([1, 2], [[0.0], [0.0]], [[1.0], [2.0]]))  # only studies are averaged
def test_a_round_trip_by_csv_changes_nothing(folder, table):
    table.to_csv(folder / "table.csv")
    check_same(read_table(str(folder / "table.csv")), table)


@given(table=tables(visible))
@example(table=ALIKE)
# Names that look like characters of a workbook.
@example(table=TestTable.of([1], [[0.5]], [[2.0]], schema=Schema.of(["_x0000_"], ["a_x0041_"])))
def test_a_round_trip_by_workbook_changes_nothing(folder, table):
    write_table(table, folder / "table.xlsx")
    check_same(read_table(folder / "table.xlsx"), table)


@examples(2)
@given(table=tables())
@example(table=TestTable.of([1], [[0.0]], [[1.0]], notes={"id": [2**64]}))  # too long for SQLite
def test_a_round_trip_by_study_changes_nothing(folder, table):
    path = folder / "table.db"
    path.unlink(missing_ok=True)
    write_table(table, path)
    check_same(read_table(path, average_by=False), table.take(np.argsort(table.numbers)))


EXAMPLE = TestTable.of(
    [3, 1, 2],
    np.array([[0.1, 5], [0.2, 7], [1 / 3, 9]], dtype=object),
    [[1.0, 2.0], [2.0, 1.0], [np.nan, np.inf]],
    G=[[-1.0], [0.5], [-1.0]],
    reasons={2: 'a "solver", #7\nsaid no'},
    schema=Schema.of(["α", "teeth"], 2, 1, lower=[0, 5], upper=[1, 9]),
)


def test_rows_and_columns_may_be_rearranged_by_hand(tmp_path):
    path = tmp_path / "t.csv"
    EXAMPLE.to_csv(path)
    cells = list(csv.reader(path.read_text("utf-8-sig").splitlines(keepends=True)))
    with path.open("w", encoding="utf-8-sig", newline="") as file:  # as a spreadsheet saves it
        for k, row in enumerate([cells[0], cells[2], cells[1], cells[3]]):
            csv.writer(file).writerow([row[5], "my remark" if k else "remark", *row[:5], *row[6:]])
        csv.writer(file).writerow([])
    assert read_table(path).equals(EXAMPLE.take([1, 0, 2]))


def head(**changes):
    """Replace entries of the head in the metadata."""

    def change(text):
        document = json.loads(text)
        document["pymoo-psi:head"] |= changes
        return json.dumps(document)

    return change


def replaced(old, new):
    return lambda text: text.replace(old, new, 1)


def cut(text):
    return text[: text.index("\n1,0.2") + 1]


TESTS = "it must be a table of tests, of to_csv or 'pymoo-psi export': .*"


@pytest.mark.parametrize(
    ("file", "damage", "message"),
    [
        ("table.csv-metadata.json", head(pymoo_psi_test_table=5), TESTS + "its format is 5, not 1"),
        ("table.csv-metadata.json", head(lower=["a", 5]), TESTS + "could not convert string to float: 'a'"),
        ("table.csv-metadata.json", lambda text: text[:-30], "table.csv-metadata.json is damaged; remove that"),
        ("table.csv-metadata.json", replaced('"pymoo-psi:rows": 3', '"pymoo-psi:rows": 4'), "it has 3 rows, and 4 by table.csv-metadata.json; restore both, or remove the latter"),
        ("table.csv", replaced("test,α", "test,a"), TESTS + "the column or entry 'α' is missing"),
        ("table.csv", cut, "it has 1 row, and 3 by"),
        ("table.csv", lambda text: "", "it is empty"),
        ("table.csv", replaced("\n1,0.2,7", "\n3,0.2,7"), TESTS + "must be distinct, got test 3 twice"),
        ("table.csv", replaced("\n1,0.2,7", "\n1,0.2,7.5"), TESTS + "the column 'teeth' holds other than integer values"),
        ("table.csv", replaced("\n1,0.2,7", "\n1,0,2,7"), "line 3 has 11 cells, most lines 10"),
    ],
)  # fmt: skip
def test_a_damaged_file_is_named_with_what_is_wrong(tmp_path, file, damage, message):
    EXAMPLE.to_csv(tmp_path / "table.csv")
    path = tmp_path / file
    path.write_text(damage(path.read_text("utf-8-sig")), "utf-8")
    refused(rf"table\.csv:? {message}", read_table, tmp_path / "table.csv", error=ValueError)


def test_all_sentences_and_figures_of_a_table_have_its_decimal_mark(tmp_path):
    path = tmp_path / "set.csv"
    path.write_text("name;cost;mass\nA;1,5;9,25\nB;2,25;4,5\nC;5,75;1,5\nD;5,8;1,4\n")
    table = read_table(path, Formulation(["cost", "mass"]))
    sentences = [explain(table, "A"), compare_designs(table, ["A", "B"]), *cautions(table)]
    assert "4,75 lower" in str(sentences[1])
    for figure in (plot_table(table), plot_objectives(table), plot_ranking(table.ranking())):
        figure.draw_without_rendering()
        sentences += [
            text.get_text() for text in figure.findobj(lambda one: hasattr(one, "get_text"))
        ]
    assert not re.search(r"\d\.\d", " ".join(map(str, sentences)))


@pytest.mark.parametrize("decimal", [".", ","])
def test_an_edited_number_is_read_in_the_notation_of_the_file(tmp_path, decimal):
    path = tmp_path / "table.csv"
    table = TestTable.of([1, 2], [[1.5], [2.5]], [[1.0, -0.0], [2.5, 1.0]])
    replace(table, decimal=decimal, separator=";").to_csv(path)
    text = path.read_text()
    path.write_text(text.replace(f"1{decimal}5", f"1{decimal}250", 1))
    assert read_table(path)["x1"].tolist() == [1.25, 2.5]
    path.write_text(text.replace(f"1{decimal}5", f"1{'.,'.strip(decimal)}250", 1))
    refused("'x1' holds other than real values", read_table, path)


@given(content=st.binary(max_size=200), position=st.integers(0, 1500), cut=st.integers(0, 40))
def test_no_damage_raises_anything_else(folder, content, position, cut):
    path = folder / "damaged.csv"
    EXAMPLE.to_csv(path)
    for file in (path, folder / "damaged.csv-metadata.json"):
        whole = file.read_bytes()
        for damaged in (
            content,
            whole[:position] + content + whole[position + cut :],
            whole[:position],
        ):
            file.write_bytes(damaged)
            assert re.search("damaged.csv|^$", flaw(read_table, path))  # it may be harmless
        file.write_bytes(whole)


@pytest.mark.parametrize("source", ["file", "folder"])
def test_a_run_continues_the_study_of_a_limited_table(tmp_path, study_file, source):
    """Limits say how tests are asked; what is stored are the tests, and the file keeps both."""
    problem = VectorizedSphereChute()
    asked = investigate(problem, 32).under(limits={"f1": 2.5}, normalize=False)
    write_table(asked, study_file)
    read = read_table({"file": study_file, "folder": tmp_path}[source])
    assert read.equals(asked)
    more = read_table(read, Formulation(limits="f2<=9"))  # in addition to those of the source
    assert ([*more.limits], more.formulation.normalize) == (["f1", "f2"], False)
    assert investigate(problem, 64, study=study_file).equals(investigate(problem, 64))


@pytest.mark.parametrize("suffix", ["csv", "xlsx"])
def test_a_spreadsheet_shows_designs_and_keeps_everything(tmp_path, suffix):
    """The first line names the columns, nothing stands beside the rows, the choice is kept."""
    schema = Schema.of(1, ["mass", "Ø"], maximize=["Ø"], units={"mass": "µg"})
    table = TestTable.of([1, 2], [[0.1], [0.5]], [[1 / 3, -3.0], [np.nan, -4.0]], schema=schema)
    limits = {"mass": 0.3}
    asked = Formulation(units={"x1": "mm"}, limits=limits, normalize=False)
    positions, decided = [{"name": "Ann", "limits": limits}], {"chosen": "test 2"}
    table = table.under(Decision(asked, "test 1", "=cheap", positions, decided))
    path = tmp_path / f"table.{suffix}"
    write_table(table, path)
    again = read_table(path, Formulation(limits={"mass": 0.2}))
    assert replace(again.decision, formulation=asked) == table.decision
    assert again.schema.units == {"mass": "µg", "x1": "mm"}
    raw = pd.read_csv(path) if suffix == "csv" else pd.read_excel(path)
    names = table.to_frame().rename(columns={"mass": "mass [µg]", "x1": "x1 [mm]"}).columns
    assert raw.columns.tolist() == ["test", *names]
    if suffix == "csv":  # spreadsheets take it for UTF-8 by its mark, which others do not need
        assert path.read_bytes().startswith(b"\xef\xbb\xbf")
        TestTable.of([1], [[0.5]], [[1]]).to_csv(path)
        assert path.read_bytes().isascii()


# Metadata


def test_metadata_say_in_csvw_what_the_columns_are(tmp_path):
    schema = Schema.of(["n", "steel"], ["=a", "b", "b [%]"], units={"=a": "k€", "b": "%"})
    X = np.array([[1, "oak"], [2, "#ash"]], dtype=object)
    table = TestTable.of([1, 2], X, [[1.5, 2, 3], [2.5, 1, 4]], schema=schema)
    table = replace(table, problem={"parameters": {"limit": 1.5, "text": "NaN, -Infinity \udcff"}})
    path = tmp_path / "my table.csv"
    table.to_csv(path)
    text = (tmp_path / "my table.csv-metadata.json").read_text("utf-8")
    document = json.loads(text, parse_constant=int)  # which no word of Python's passes
    facts = {"@context": "http://www.w3.org/ns/csvw", "url": "my%20table.csv", "pymoo-psi:rows": 2}
    assert facts.items() <= document.items()
    columns = document["tableSchema"]["columns"]
    assert columns[1:6] == [
        {"titles": "n", "datatype": "integer"},
        {"titles": "steel", "datatype": "string"},
        {"titles": "'=a [k€]", "datatype": "number", "schema:unitText": "k€"},
        {"titles": "b", "datatype": "number", "schema:unitText": "%"},  # as "b [%]" is another
        {"titles": "b [%]", "datatype": "number"},
    ]
    assert columns[-1]["datatype"] == {"base": "boolean", "format": "True|False"}
    assert read_table(path).problem == table.problem


def test_metadata_of_others_are_kept(tmp_path):
    path, metadata = tmp_path / "t.csv", tmp_path / "t.csv-metadata.json"
    EXAMPLE.to_csv(path)
    before = [path.read_bytes(), metadata.read_bytes()]
    # Neither is replaced if one cannot be written.
    with pytest.raises(TypeError):
        CSV.save(path, {"a": np.arange(3)}, {"pymoo_psi_designs": object()})
    assert [path.read_bytes(), metadata.read_bytes()] == before
    # What needs none has none.
    CSV.save(path, {"a": np.arange(3)})
    assert os.listdir(tmp_path) == ["t.csv"]
    others = '{"@context": "http://www.w3.org/ns/csvw", "url": "t.csv"}'
    metadata.write_text(others)
    refused("without t.csv-metadata.json of another program", EXAMPLE.to_csv, path)
    CSV.save(path, {"cost": np.arange(3), "mass": np.arange(3)[::-1]})
    assert metadata.read_text() == others
    assert read_table(path).schema.objectives == ("cost", "mass")


@posix
def test_links_have_metadata_and_pipes_have_none(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "t.csv").symlink_to(tmp_path / "there" / "t.csv")
    EXAMPLE.to_csv(tmp_path / "t.csv")
    assert sorted(os.listdir(tmp_path / "there")) == ["t.csv", "t.csv-metadata.json"]
    assert read_table(tmp_path / "t.csv").equals(EXAMPLE)
    EXAMPLE.to_csv("/dev/null")
    assert not os.path.exists("/dev/null-metadata.json")


def test_without_metadata_directions_are_asked_for(tmp_path):
    schema = Schema.of(1, ["mass", "gain"], maximize=["gain"], units={"mass": "kg"})
    table = TestTable.of([1, 2], [[0.1], [0.5]], [[1.0, -3.0], [2.0, -4.0]], schema=schema)
    path = tmp_path / "t.csv"
    table.to_csv(path)
    (tmp_path / "t.csv-metadata.json").unlink()
    refused(r"without t\.csv-metadata\.json, which .*; put it beside", read_table, path)
    refused("give the table itself", read_table, table.to_frame())
    asked = Formulation(objectives=["mass [kg]", "gain"], maximize=["gain"])
    assert read_table(path, asked).schema.maximize == ("gain",)
