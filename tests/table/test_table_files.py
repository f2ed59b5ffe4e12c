"""Frames and files: a round trip changes nothing, a damaged file is named."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import Formulation, PsiError, TestTable, VectorizedSphereChute, investigate
from pymoo_psi.table import RESERVED, Layout, difference, read_table
from tests.table.asked import violations

SLOW = settings(deadline=None)  # files, and pandas imported by the first example
texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]))
finite = st.floats(allow_nan=False, allow_infinity=False)


# XML, and so a workbook, has no control characters; its readers may take others for line ends.
visible = st.text(st.characters(exclude_categories=["Cs", "Cc", "Cn", "Zl", "Zp"]))


@st.composite
def tables(draw, texts=texts):
    names = texts.filter(lambda name: name and name not in RESERVED)
    choices = st.one_of(finite, st.integers(1 - 2**63, 2**63 - 1), st.booleans(), texts)
    columns = [finite, st.integers(1 - 2**63, 2**63 - 1), st.booleans(), texts, choices]
    n, n_var, m, n_ieq, n_eq = (
        draw(st.integers(*r)) for r in ((0, 6), (0, 4), (0, 3), (0, 2), (0, 2))
    )
    n_out = draw(st.integers(0, 2))
    width = n_var + m + n_ieq + n_eq + n_out
    name = draw(st.lists(names, min_size=width, max_size=width, unique=True))
    units = dict.fromkeys(name[:2], draw(st.sampled_from(["kg", "%", "µm; =1", "#{}"])))
    groups = [tuple(name.pop() for _ in range(k)) for k in (n_var, m, n_ieq, n_eq)]
    outputs = {key: draw(arrays(float, n, elements=st.floats())) for key in name}
    maximize = draw(st.sets(st.sampled_from(groups[1] + tuple(name)))) if m else set()
    bound = st.one_of(st.just(np.nan), st.floats(-10, 10))
    lower = draw(arrays(float, n_var, elements=bound))
    layout = Layout.of(
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
    return TestTable.of(numbers, X, F, G, H, outputs=outputs, reasons=reasons, layout=layout)


def bits(table):
    """Everything a table holds, zeros with their signs."""
    arrays = [getattr(table, name) for name in ("numbers", "X", "F", "G", "H", "status")]
    return [[repr(v) for v in a.ravel().tolist()] for a in arrays] + [a.dtype for a in arrays]


def check_same(read, table):
    assert bits(read) == bits(table)
    assert read.reasons == table.reasons
    assert not difference(read, table)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tables")


@SLOW
@given(table=tables())
def test_a_round_trip_by_csv_changes_nothing(folder, table):
    table.to_csv(folder / "table.csv")
    check_same(read_table(str(folder / "table.csv")), table)


@SLOW
@given(table=tables(visible))
def test_a_round_trip_by_workbook_changes_nothing(folder, table):
    table.to_xlsx(folder / "table.xlsx")
    check_same(read_table(str(folder / "table.xlsx")), table)


@SLOW
@given(table=tables())
def test_the_frame_holds_what_the_table_holds(table):
    frame = table.to_frame()
    layout = table.layout
    assert frame.index.tolist() == table.numbers.tolist()
    for name in layout.columns:
        assert repr(frame[name].tolist()) == repr(table.column(name).tolist())
    assert frame["status"].tolist() == table.status.tolist()
    assert frame["pareto"].tolist() == table.pareto().tolist()
    named = violations(table)
    assert frame["violated"].tolist() == [", ".join(named.get(n, ())) for n in table.numbers]
    assert frame["reason"].tolist() == [table.reasons.get(n, "") for n in table.numbers]
    assert frame.columns.tolist() == [
        *layout.variables, *layout.objectives, *layout.constraints, *layout.outputs, *RESERVED[1:]
    ]  # fmt: skip


EXAMPLE = TestTable.of(
    [3, 1, 2],
    np.array([[0.1, 5], [0.2, 7], [1 / 3, 9]], dtype=object),
    [[1.0, 2.0], [2.0, 1.0], [np.nan, np.inf]],
    G=[[-1.0], [0.5], [-1.0]],
    reasons={2: 'a "solver", #7\nsaid no'},
    layout=Layout.of(["α", "teeth"], 2, 1, lower=[0, 5], upper=[1, 9]),
)


def test_options_that_could_be_taken_for_others_keep_their_types(tmp_path):
    cells = ["12", 12, 12.0, True, "true", '"oak"', "oak", "NaN", "[1]", "{", "", " 7 ", "1e5", "null"]  # fmt: skip
    table = TestTable.of(np.arange(1, 15), [[cell] for cell in cells], np.ones((14, 1)))
    table.to_csv(tmp_path / "t.csv")
    table.to_xlsx(tmp_path / "t.xlsx")
    for read in (read_table(tmp_path / "t.csv"), read_table(tmp_path / "t.xlsx")):
        assert [(type(v), v) for v in read.X[:, 0]] == [(type(v), v) for v in cells]


def test_rows_and_columns_may_be_rearranged_by_hand(tmp_path):
    path = tmp_path / "t.csv"
    EXAMPLE.to_csv(path)
    rest, head = path.read_text("utf-8-sig").rstrip().rsplit("\n", 1)
    cells = list(csv.reader(rest.splitlines(keepends=True)))
    with path.open("w", encoding="utf-8-sig", newline="") as file:  # as a spreadsheet saves it
        for k, row in enumerate([cells[0], cells[2], cells[1], cells[3]]):
            csv.writer(file).writerow([row[5], "my remark" if k else "remark", *row[:5], *row[6:]])
        csv.writer(file).writerows([[], head.split(",")])
    assert read_table(path).equals(EXAMPLE.rows([1, 0, 2]))


def head(**changes):
    """Replace entries of the JSON in the last line."""

    def change(text):
        rest, line = text.rstrip().rsplit("\n", 1)
        return f"{rest}\n# {json.dumps(json.loads(line[1:]) | changes)}\n"

    return change


def replaced(old, new):
    return lambda text: text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (head(pymoo_psi_test_table=5), "its format is 5, this version reads 2 to 4"),
        (replaced('"test_point","α"', '"test_point","a"'), "the column or entry 'α' is missing"),
        (replaced("\n1,0.2,7", "\n3,0.2,7"), "must be distinct, got test point 3 twice"),
        (replaced("\n1,0.2,7", "\n1,0.2,7.5"), "the column 'teeth' holds other than integer values"),
        (replaced("\n1,0.2,7", "\n1,0_2,7"), "the column 'α' holds other than real values"),
        (replaced("\n1,0.2,7", "\n1,0,2,7"), "its rows differ in length"),
        (replaced('"infeasible"', '"ok"'), "status must be ok where constraints and limits are met, .* got 'ok' for test point 1"),
        (lambda text: text[: text.index("\n1,0.2") + 1] + text[text.index("\n\n") :], "it holds 1 of 3 tests, so it was cut or edited; if that is meant, set \"tests\""),
    ],
)  # fmt: skip
def test_a_damaged_file_is_named_with_what_is_wrong(tmp_path, damage, message):
    path = tmp_path / "table.csv"
    EXAMPLE.to_csv(path)
    path.write_text(damage(path.read_text("utf-8-sig")), "utf-8")
    with pytest.raises(
        ValueError,
        match=rf"table\.csv must be a table of tests, of to_csv or 'pymoo-psi export': .*{message}",
    ) as caught:
        read_table(path)
    assert isinstance(caught.value, PsiError)


@SLOW
@given(content=st.binary(max_size=200), position=st.integers(0, 700), cut=st.integers(0, 40))
def test_no_damage_raises_anything_else(folder, content, position, cut):
    path = folder / "damaged.csv"
    EXAMPLE.to_csv(path)
    whole = path.read_bytes()
    for damaged in (
        content,
        whole[:position] + content + whole[position + cut :],
        whole[:position],
    ):
        path.write_bytes(damaged)
        try:
            read_table(path)
        except PsiError as error:
            message = str(error)
        else:
            message = "damaged.csv"  # the damage was harmless
        assert re.search("damaged.csv|source must be a whole test table", message)


def test_a_table_of_an_earlier_version_keeps_its_directions(tmp_path):
    """The head of 0.2.0 has "maximized" and stands first; a study of it comes as such a file."""
    layout = Layout.of(1, ["mass", "gain"], maximize=["gain"])
    table = TestTable.of([1, 2], [[0.1], [0.5]], [[1.0, -3.0], [2.0, -4.0]], layout=layout)
    path = tmp_path / "table.csv"
    table.to_csv(path)
    rest, _, last = path.read_text("utf-8").rstrip().rpartition("\n")
    head = json.loads(last[2:])
    head["pymoo_psi_test_table"] = 3
    head["maximized"] = head.pop("maximize")
    head["prototype"] = {"name": "now", "x": [0.3], "f": [1.5, -2.0]}  # which is not read
    path.write_text(f"# {json.dumps(head)}\n{rest}", "utf-8")
    assert read_table(path).equals(table)


@pytest.mark.parametrize("source", ["file", "folder"])
def test_a_run_continues_the_study_of_a_table_under_limits(tmp_path, source):
    """Limits say how tests are asked; what is stored are the tests, and the file keeps both."""
    problem = VectorizedSphereChute()
    asked = investigate(problem, 32).under(limits={"f1": 2.5}, normalize=False)
    path = tmp_path / "share.db"
    asked.to_study(path)
    read = read_table({"file": path, "folder": tmp_path}[source])
    assert read.equals(asked)
    assert (read.limits, read.formulation.normalize) == (asked.limits, False)
    assert read.under(limits={}, normalize=True).equals(investigate(problem, 32))
    longer = investigate(problem, 64, study=path)
    assert longer.equals(investigate(problem, 64))


@pytest.mark.parametrize("suffix", ["csv", "xlsx"])
def test_a_spreadsheet_shows_the_designs_alone_and_all_comes_back(tmp_path, suffix):
    """The first line names the columns, nothing stands beside the rows, the choice is kept."""
    layout = Layout.of(1, ["mass", "Ø"], maximize=["Ø"], units={"mass": "µg"})
    table = TestTable.of([1, 2], [[0.1], [0.5]], [[1 / 3, -3.0], [np.nan, -4.0]], layout=layout)
    limits = {"mass": 0.3}
    chosen = Formulation(chosen="test point 1", reason="=cheap", units={"x1": "mm"})
    table = table.under(replace(chosen, limits=limits, normalize=False))
    path = tmp_path / f"table.{suffix}"
    {"csv": table.to_csv, "xlsx": table.to_xlsx}[suffix](path)
    read = read_table(path)
    assert read.equals(table)
    chosen = read.formulation
    assert (chosen.chosen, chosen.reason) == ("test point 1", "=cheap")
    assert (chosen.limits, chosen.normalize) == (limits, False)
    assert read.layout.units == {"mass": "µg", "x1": "mm"}
    raw = pd.read_csv(path, comment="#") if suffix == "csv" else pd.read_excel(path)
    assert raw.columns.tolist() == ["test_point", *table.to_frame().columns]
    assert raw["mass"].isna().tolist() == [False, True]
    if suffix == "csv":  # spreadsheets take it for UTF-8, and its table ends at a blank line
        content = path.read_bytes()
        assert content.startswith(b"\xef\xbb\xbf")
        assert b"\n\n# {" in content
        TestTable.of([1], [[0.5]], [[1]]).to_csv(path)
        assert path.read_bytes().isascii()
