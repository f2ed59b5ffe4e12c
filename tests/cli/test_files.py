"""What the command writes and prints: nothing is lost or overwritten, on any terminal."""

import os
import re
import shutil
import subprocess
import sys
import zipfile

import pandas as pd
import pytest

from pymoo_psi.files import read_table
from tests.helpers.processes import posix

FRONT = "a,b\n1,2\n2,1\n3,0\n"


@pytest.fixture
def front(tmp_path):
    """A file of three designs."""
    (tmp_path / "set.csv").write_text(FRONT)


@pytest.fixture
def folder(run, tmp_path, undrawn, said, front):
    said("solve", "bnh", "--points", "32", "--study", "s.db")
    return tmp_path


@pytest.mark.parametrize(
    "words",
    ["solve bnh --points 16 --out o.csv", "rank set.csv --out o.csv", "export s.db --out o.csv",
     "page set.csv --out o.html", "report s.db --out o.html", "rank set.csv --out o.xlsx"],
)  # fmt: skip
def test_older_results_are_replaced_whole(folder, words, said):
    out = folder / words.split()[-1]
    said(*words.split())
    new = out.read_bytes()
    if out.suffix == ".html":
        out.write_bytes(3 * new)
    said(*words.split())
    assert abs(len(out.read_bytes()) - len(new)) < 10  # a workbook holds its time
    out.write_bytes(others := b"a;b\n1;2\n")
    assert "remove the file first" in said(*words.split(), code=2)
    assert out.read_bytes() == others


def workbook_of_others(path):
    pd.DataFrame({"a": [1]}).to_excel(path.with_suffix(".xlsx"), index=False)
    path.with_suffix(".xlsx").rename(path)


def archive(path):
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("a", "b")


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@pytest.mark.parametrize(
    "write",
    [
        archive,
        workbook_of_others,
        lambda path: path.write_bytes(b"PK,a\n1,2\n"),
        lambda path: shutil.copy(path.with_name("s.db"), path),
    ],
)
def test_files_of_others_stay_whatever_they_are(folder, suffix, write, said):
    out = folder / f"o{suffix}"
    write(out)
    before = out.read_bytes()
    assert "remove the file first" in said("rank", "set.csv", "--out", out.name, code=2)
    assert out.read_bytes() == before


def test_what_is_read_and_a_study_are_never_overwritten(folder, said):
    before = {name: (folder / name).read_bytes() for name in ("s.db", "set.csv")}
    for words in ("rank set.csv --out set.csv", "export s.db --out s.db",
                  "page set.csv --out set.html --prototype set.html",
                  "rank set.csv --decision a.csv --out a.csv",
                  "solve dtlz2 --n-obj 2 --study d.db --from a.csv --out a.csv"):  # fmt: skip
        assert re.search("another .* read", said(*words.split(), code=2))
    said("export", "set.csv", "--out", "s.db", code=2)
    assert {name: (folder / name).read_bytes() for name in before} == before


def test_folders_of_results_keep_files_of_others(folder, said):
    compare = "compare bnh --evaluations 16 --seeds 2 --algorithms psi,nsga2 --out ."
    (folder / "tests.csv").write_text(FRONT)
    assert "a folder without tests.csv of another program" in said(*compare.split(), code=2)
    assert (folder / "tests.csv").read_text() == FRONT
    (folder / "tests.csv").unlink()
    said(*compare.split())
    said(*compare.split())


def test_metadata_of_others_are_found_before_the_run(folder, said):
    others = folder / "o.csv-metadata.json"
    others.write_text('{"url": "o.csv"}')
    assert "got 'o.csv-metadata.json'; choose another name" in said(
        "solve", "models:Moves", "--out", "o.csv", code=2
    )
    assert others.read_text() == '{"url": "o.csv"}'
    # Those of ours do not give a file of others away.
    said("export", "s.db", "--out", "t.csv")
    (folder / "t.csv").write_text(FRONT)
    assert "got 't.csv'; choose another name" in said("export", "s.db", "--out", "t.csv", code=2)
    assert (folder / "t.csv").read_text() == FRONT


def test_a_ranking_comes_back_with_its_metadata(said, tmp_path):
    frame = pd.DataFrame({"name": ["A", "#B", "C", "D"], "a": [1, 2, 3, 4], "b": [1, 2, 3, 5]})
    frame.to_excel("set.xlsx", index=False)
    (tmp_path / "o.csv").touch()  # as by mktemp
    said("rank", "set.xlsx", "--maximize", "b", "--units", "a=µg", "--out", "o.csv")
    table = read_table("o.csv")
    assert sorted(table.names) == sorted(read_table("set.xlsx").names)
    assert (table.schema.maximize, table.schema.units) == (("b",), {"a": "µg"})
    assert read_table("o.csv", skip_rows=[3]).names == [*table.names[:1], *table.names[2:]]
    ranked = (tmp_path / "o.csv").read_text("utf-8")
    (tmp_path / "o.csv").write_text(ranked.replace(",b,", ",c,", 1), "utf-8")
    refusal = "it has no column 'b', an objective by its description; restore this name"
    assert refusal in said("rank", "o.csv", code=2)
    (tmp_path / "o.csv").write_text(ranked, "utf-8")
    (tmp_path / "o.csv-metadata.json").unlink()
    refusal = "it is without o.csv-metadata.json, which says what the columns are; put it beside"
    assert refusal in said("rank", "o.csv", code=2)
    said("rank", "o.csv", "--objectives", "a [µg],b", "--maximize", "b")


@posix
@pytest.mark.parametrize(
    ("stream", "words", "code"),
    [
        pytest.param(">/dev/full", "rank set.csv --out out.csv", 2, marks=pytest.mark.slow),
        pytest.param("2>&-", "absent", 2, marks=pytest.mark.slow),
        pytest.param("| true", "rank set.csv --out out.csv", 0, marks=pytest.mark.slow),
    ],
)
def test_streams_that_are_closed_or_full(tmp_path, stream, words, code, front):
    done = subprocess.run(
        ["sh", "-c", f"{sys.executable} -m pymoo_psi {words} {stream}"],
        cwd=tmp_path, capture_output=True,
    )  # fmt: skip
    assert done.returncode == code
    assert b"Traceback" not in done.stderr + done.stdout
    assert ("out.csv" in words) == (tmp_path / "out.csv").exists()


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="a folder in which nobody may write")
@pytest.mark.parametrize(
    "words",
    [
        "solve models:Moves --out /proc/o.csv",
        "compare models:Moves --evaluations 4 --out /proc/o",
        "reproduce --out /proc/o",
        "rank set.csv --out /proc/o.csv",
        "page set.csv --out /proc/o.html",
        "export set.csv --out /proc/o.csv",
    ],
)
def test_an_unwritable_folder_is_found_before_the_run(said, tmp_path, words, front):
    assert "/proc" in said(*words.split(), code=2)
    assert not (tmp_path / "was").exists()


def test_the_home_folder_is_found_behind_an_equals_sign(said, monkeypatch, tmp_path, front):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    said("rank", "~/set.csv", "--out=~/out.csv")
    assert (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    ("words", "note"),
    [("solve bnh --points 20", " feasible, 0 failed"),
     ("solve bnh --points 20 --algorithm surrogate", " feasible, 0 failed"),
     ("solve bnh --points +2 --algorithm surrogate --study s.db", " feasible, 0 failed"),
     ("solve bnh --points 20 --algorithm nsga3", ""),
     pytest.param("reproduce --points 8 --mu 0.4 --model full --out r", "mu = 0.4, full model",
                  marks=pytest.mark.slow)],
)  # fmt: skip
def test_a_log_shows_that_a_run_goes_on(run, said, monkeypatch, words, note, undrawn):
    """Without a terminal there is no bar, and a slow model would run for hours without a word."""
    assert run(*words.split())[2] == ""
    monkeypatch.setattr("pymoo_psi.algorithms._run._EVERY", 0.0)
    log = said(*words.split())
    assert log.splitlines()[-1].startswith("100% done")
    assert note in log
    assert log.count("100% done") == 1


def test_directions_are_read_where_arrows_cannot_be_written(front, tmp_path):
    """As in a pipe on Windows."""
    command = [sys.executable, "-m", "pymoo_psi", "rank", "set.csv", "--maximize", "b"]
    options = {"cwd": tmp_path, "env": os.environ | {"PYTHONIOENCODING": "cp1252"}}
    printed = subprocess.check_output(command, **options).decode("cp1252")
    assert printed.split("\n\n")[1].split()[:6] == ["place", "row", "a", "v", "b", "^"]
