"""Files written whole and without formulas; HTML in which names are data."""

import csv
import os
import re
import stat
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import PSI, Recorded, SphereChute, TestTable, representatives
from pymoo_psi._output import ROWS, whole_file
from pymoo_psi.files import read_table
from pymoo_psi.page import decision_page
from pymoo_psi.table import Schema
from tests.helpers.formulas import CELLS
from tests.helpers.processes import posix

EVIL = "<b>cost</b> & \"co\" <script>alert('1')</script>"


@pytest.fixture(scope="module")
def table():
    rng = np.random.default_rng(3)
    schema = Schema.of(["width"], [EVIL, "gain"], maximize=["gain"], units={"width": "mm<i>"})
    F = np.column_stack([np.arange(40.0), -(np.arange(40.0) ** 2)])
    return TestTable.of(1 + np.arange(40), rng.random((40, 1)), F, schema=schema)


def shown(thing):
    """The page that a notebook shows, as elements; markup from names would be among them."""
    page = ET.fromstring(f"<div>{thing._repr_html_().replace('scoped', '')}</div>")
    tags = {element.tag for element in page.iter()}
    assert tags <= {"div", "p", "style", "table", "thead", "tbody", "tr", "th", "td"}
    rows = [[cell.text or "" for cell in row] for row in page.iter("tr")]
    return " ".join(p.text for p in page.iter("p")), rows


@pytest.mark.parametrize(
    "view",
    [lambda table: table, TestTable.ranking, lambda table: representatives(table, 3)],
)
def test_names_are_data_in_a_notebook(table, view):
    text, rows = shown(view(table))
    assert text.startswith(type(view(table)).__name__)
    assert 1 < len(rows) <= ROWS + 2
    assert "<b>cost</b>" in text + str(rows)


def test_runs_are_shown_as_their_tables(tmp_path):
    problem = Recorded(SphereChute(), study=tmp_path / "a.db")
    for one in (minimize(problem, PSI(12)).algorithm, problem):
        text, rows = shown(one)
        assert text.startswith(f"{type(one).__name__} TestTable(12 tests")
        assert len(rows) == ROWS + 2


def test_a_page_is_kept_from_the_notebook(table):
    page = decision_page(table, title=EVIL)
    (frame,) = ET.fromstring(f"<div>{page._repr_html_()}</div>")
    assert frame.tag == "iframe"
    assert frame.get("srcdoc").split() == page.html().split()  # XML makes spaces of line ends
    assert "allow-same-origin" not in frame.get("sandbox")


def test_a_long_table_shows_its_first_rows(table):
    text, (heading, _, *rows) = shown(table)
    assert f"The first {ROWS} of 40 rows" in text
    assert heading == ["", "width [mm<i>]", EVIL, "gain (max)", "status"]
    assert [row[0] for row in rows] == [str(n) for n in range(1, 1 + ROWS)]


# Files


def live(path):
    """The cells that a spreadsheet would run, those of the comment too."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        cells = [cell for mark in ",;" for row in csv.reader(file, delimiter=mark) for cell in row]
    number = re.compile(r"[+-]?([0-9.,]*(e[+-]?[0-9]+)?|inf|nan)", re.IGNORECASE)
    return [
        c for c in cells if c.startswith(tuple("=+-@＝＋－＠\t\r\n")) and not number.fullmatch(c)
    ]


def test_written_tables_hold_no_formulas_and_come_back(tmp_path, said, in_folder):
    """Names and cells, in the head too, where a comma in a name would begin a cell."""
    names = ["=1+1", "a,=cmd|' /C calc'!A0", "＝b", "@n;=2", "-x", "\t=t", "'=q", "''"]
    schema = Schema.of(names[:2], names[2:4], names[4:5], outputs=names[5:], units={"＝b": "=u,+v"})
    cells = [cell for cell in CELLS if not any(mark in cell for mark in ",;%")]
    n = len(cells)
    table = TestTable.of(
        1 + np.arange(n), [[cell, 0.5] for cell in cells], np.random.default_rng(1).random((n, 2)),
        np.full((n, 1), -1.0), outputs=dict.fromkeys(names[5:], np.arange(n)), schema=schema,
    )  # fmt: skip
    path = tmp_path / "tests.csv"
    table.to_csv(path)
    assert read_table(path).equals(table)
    assert live(path) == []
    said("rank", "tests.csv", "--maximize", "＝b", "--out", "ranks.csv")
    assert live(tmp_path / "ranks.csv") == []
    assert read_table("ranks.csv").schema.maximize == ("＝b",)


def write(path, text="new"):
    with whole_file(path) as written:
        written.write_text(text)


def test_a_failed_write_leaves_the_old_file(tmp_path):
    file = tmp_path / "front.csv"
    write(file, "old")
    # The error comes after half of the file.
    with pytest.raises(OSError, match="disk full"), whole_file(file) as written:  # noqa: PT012
        written.write_text("half")
        raise OSError("disk full")
    assert file.read_text() == "old"
    assert os.listdir(tmp_path) == ["front.csv"]


def test_an_error_names_the_file_asked_for(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"absent.front\.csv'$"):
        write(tmp_path / "absent" / "front.csv")


@posix
@pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
def test_a_file_that_is_replaced_keeps_its_mode(tmp_path, mode):
    file = tmp_path / "front.csv"
    write(file, "old")
    file.chmod(mode)
    write(file)
    assert (file.read_text(), stat.S_IMODE(file.stat().st_mode)) == ("new", mode)
