"""The registry of file formats: a format that is added works wherever files are read and written."""

import json
from pathlib import Path

import pytest

from pymoo_psi.files import FORMATS, FileFormat, read_table, suffixes_for


class Records(FileFormat):
    """One object of JSON: the head and the columns."""

    suffix = ".records"
    writes = ("tests", "designs")

    def recognizes(self, file):
        return file.start.startswith(b'{"head"')

    def read(self, file):
        content = json.loads(file.text)
        return content["columns"], content["head"]

    def write(self, path, columns, head):
        cells = {name: column.tolist() for name, column in columns.items()}
        path.write_text(json.dumps({"head": head, "columns": cells}), encoding="utf-8")


@pytest.fixture
def formats(in_folder):
    """An empty folder, and the formats with a further one."""
    before = [*FORMATS]
    FORMATS.insert(0, Records())
    yield FORMATS
    FORMATS[:] = before


def test_the_command_reads_and_writes_it(formats, said, tmp_path):
    said("solve", "bnh", "--points", 64, "--study", "s.db")
    said("export", "s.db", "--out", "t.records")
    assert read_table("t.records").equals(read_table("s.db"))
    words = ["--limits", "f1<=60", "--units", "f1=kg"]
    ranked = said("rank", "t.records", *words, "--out", "r.records")
    assert ranked.replace("t.records", "s.db") == said("rank", "s.db", *words, "--out", "r.records")
    assert read_table("r.records").schema.units == {"f1": "kg"}
    Path("t.records").rename("pipe")  # recognized by its content
    assert read_table("pipe").equals(read_table("s.db"))
    Path("o.records").write_text("a")  # of another program
    assert "remove the file first" in said("export", "s.db", "--out", "o.records", code=2)


def test_other_suffixes_are_refused_by_those_that_there_are(formats, said, tmp_path):
    (tmp_path / "set.csv").write_text("a,b\n1,2\n2,1\n")
    rule = "a file with the suffix .csv or .xlsx or .records"
    assert rule in said("rank", "set.csv", "--out", "o.json", code=2)
    assert suffixes_for("tests") == [".csv", ".xlsx", ".db", ".records"]
