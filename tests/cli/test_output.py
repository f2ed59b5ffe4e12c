"""What the command writes and prints on any terminal: nothing is lost, and no traceback comes."""

import csv
import os
import subprocess
import sys

import pandas as pd
import pytest

from pymoo_psi.cli import _output, main
from tests.formulas import CELLS, INERT
from tests.processes import posix

DESIGNS = "name,µ,×\nα,1,2\nβ,2,1\n"


def run(*words, folder, **environment):
    """The command in a process of its own, as a shell starts it."""
    return subprocess.run(
        [sys.executable, "-m", "pymoo_psi", *words],
        cwd=folder, capture_output=True, env={**os.environ, **environment},
    )  # fmt: skip


def test_a_table_without_rows_says_so(capsys):
    _output.print_frame(pd.DataFrame({"mu": [], "design": []}), "Designs of rank 5")
    assert capsys.readouterr().out == "Designs of rank 5: none\n"


def test_exported_texts_are_no_formulas(tmp_path):
    """But for that every cell is as it was, numbers too."""
    frame = pd.DataFrame({"-a": [-1.5] * len(CELLS), "=b": CELLS, "c": [None, *CELLS[1:]]})
    _output.write_csv(frame, tmp_path / "out.csv")
    with open(tmp_path / "out.csv", newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["'-a", "'=b", "c"]
    assert rows[0] == ["-1.5", INERT[CELLS[0]], ""]
    assert rows[1:] == [["-1.5", INERT[cell], INERT[cell]] for cell in CELLS[1:]]
    assert list(frame) == ["-a", "=b", "c"]  # the frame itself is as it was


def test_a_ranked_file_runs_nothing(tmp_path):
    (tmp_path / "set.csv").write_text('note,a,b\n"=cmd|""/C calc""!A0",-1,2\n-2+3,2,-1\n-,3,-2\n')
    words = ["--objectives", "a,b", "--out", str(tmp_path / "out.csv")]
    assert main(["rank", str(tmp_path / "set.csv"), *words]) == 0
    written = pd.read_csv(tmp_path / "out.csv", dtype=str).set_index("row").sort_index()
    assert written["note"].tolist() == ['\'=cmd|"/C calc"!A0', "'-2+3", "-"]
    assert written["a"].tolist() == ["-1", "2", "3"]
    assert written["b"].tolist() == ["2", "-1", "-2"]


def test_a_terminal_without_greek_loses_nothing(tmp_path):
    (tmp_path / "µ.csv").write_text(DESIGNS, encoding="utf-8")
    done = run(
        "rank", "µ.csv", "--out", "×.csv", folder=tmp_path,
        PYTHONIOENCODING="ascii", LC_ALL="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"2 designs, 2 Pareto optimal" in done.stdout
    assert b"minimise ?: best 1, worst 2" in done.stdout
    assert (tmp_path / "×.csv").read_text("utf-8").count("\n") == 3


@posix
def test_a_file_name_that_is_no_text_is_used_as_it_is(tmp_path, monkeypatch, capsys):
    name = os.fsdecode(b"\xff\xe9")
    (tmp_path / f"{name}.csv").write_text(DESIGNS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    done = run("rank", f"{name}.csv", "--out", f"{name}.json", folder=tmp_path)
    assert (done.returncode, done.stderr) == (0, b"")
    for command, out in (("rank", f"{name}-ranked.csv"), ("page", f"{name}.html")):
        assert main([command, f"{name}.csv", "--out", out]) == 0
        assert capsys.readouterr().err == ""
    outs = (f"{name}.json", f"{name}-ranked.csv", f"{name}.html")
    assert all((tmp_path / out).exists() for out in outs)


@posix
@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["--help"], 0),
        (["rank", "set.csv", "--out", "out.csv"], 0),
        (["solve", "chute", "--points", "64", "--limits", "f1=-1"], 1),
        (["absent"], 2),
    ],
)
def test_a_reader_who_has_seen_enough_is_no_error(tmp_path, words, code):
    """The pipe is closed before anything is printed; the code is that of the result."""
    (tmp_path / "set.csv").write_text("a,b\n1,2\n2,1\n")
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "pymoo_psi", *words],
        cwd=tmp_path, stdout=writing, stderr=subprocess.PIPE,
    )  # fmt: skip
    os.close(writing)
    assert done.returncode == code
    assert done.stderr.count(b"\n") == (code == 2)
    assert b"Traceback" not in done.stderr
    assert ("--out" in words) == (tmp_path / "out.csv").exists()


@posix
@pytest.mark.parametrize(
    ("stream", "words", "code"),
    [
        (">&- 2>&-", "rank set.csv --out out.csv", 0),
        (">&-", "--help", 0),
        ("2>&-", "absent", 2),
        (">/dev/full", "rank set.csv --out out.csv", 2),
        ("2>/dev/full", "absent", 2),
    ],
)
def test_streams_that_are_closed_or_full(tmp_path, stream, words, code):
    (tmp_path / "set.csv").write_text("a,b\n1,2\n2,1\n")
    done = subprocess.run(
        ["sh", "-c", f"exec {sys.executable} -m pymoo_psi {words} {stream}"],
        cwd=tmp_path, capture_output=True,
    )  # fmt: skip
    assert done.returncode == code
    assert b"Traceback" not in done.stderr + done.stdout
    assert ("out.csv" in words) == (tmp_path / "out.csv").exists()


MODEL = """
import os, pathlib
from pymoo.core.problem import ElementwiseProblem

class Moves(ElementwiseProblem):
    def __init__(self):
        super().__init__(n_var=1, n_obj=2, xl=0, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        pathlib.Path("was").touch()
        os.chdir("/")
        out["F"] = [x[0], 1 - x[0]]
"""


@pytest.fixture
def moving_model(tmp_path, monkeypatch):
    (tmp_path / "moving_model.py").write_text(MODEL)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield
    sys.modules.pop("moving_model", None)


def test_a_model_that_changes_the_folder_moves_no_output(tmp_path, moving_model, capsys):
    assert main(["solve", "moving_model:Moves", "--points", "4", "--out", "o.csv"]) == 0
    assert capsys.readouterr().err == ""
    assert (tmp_path / "was").exists()
    assert (tmp_path / "o.csv").exists()


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="a folder in which nobody may write")
@pytest.mark.parametrize(
    "words",
    [
        ["solve", "moving_model:Moves", "--out", "/proc/o.csv"],
        ["solve", "moving_model:Moves", "--algorithm", "nsga3", "--out", "/proc/o.csv"],
        ["compare", "moving_model:Moves", "--evaluations", "4", "--out", "/proc/o"],
        ["compare", "moving_model:Moves", "--evaluations", "4", "--out", "/proc"],
        ["reproduce", "--out", "/proc/o"],
        ["rank", "set.csv", "--out", "/proc/o.csv"],
        ["page", "set.csv", "--out", "/proc/o.html"],
        ["export", "set.csv", "--out", "/proc/o.csv"],
    ],
)
def test_a_folder_that_cannot_be_written_is_found_before_the_run(
    capsys, moving_model, tmp_path, words
):
    (tmp_path / "set.csv").write_text("a,b\n1,2\n2,1\n")
    assert main(words) == 2
    printed, error = capsys.readouterr()
    assert (printed, error.count("\n")) == ("", 1)
    assert "/proc" in error
    assert not (tmp_path / "was").exists()
    assert {*os.listdir(tmp_path)} <= {"__pycache__", "moving_model.py", "set.csv"}


def test_the_home_folder_is_found_behind_an_equals_sign(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    (tmp_path / "set.csv").write_text("a,b\n1,2\n2,1\n")
    assert main(["rank", "~/set.csv", "--out=~/out.csv"]) == 0
    assert (tmp_path / "out.csv").exists()


def test_a_narrow_reader_is_shown_every_number(tmp_path, monkeypatch, capsys):
    """Columns that do not fit stand below; a cell that ends with … would be another number."""
    names = ["mass of the gearbox", "noise, level", "axial force"]
    (tmp_path / "set.csv").write_text(
        f'"{names[0]}","{names[1]}","{names[2]}"\n1234.5,71.25,3\n987.25,75.5,1\n', "utf-8"
    )
    monkeypatch.setenv("COLUMNS", "40")
    assert main(["rank", str(tmp_path / "set.csv"), "--out", str(tmp_path / "o.csv")]) == 0
    table = capsys.readouterr().out.partition("By rank:\n")[2].partition("rank: ")[0]
    assert "…" not in table
    assert max(map(len, table.splitlines())) <= 40
    for text in (*names, "1234.5", "987.25", "71.25", "75.5", "rank"):
        assert text in table
    rows = [line.split()[0] for line in table.splitlines() if line[:3].strip().isdigit()]
    assert rows == rows[:2] * (len(rows) // 2)  # the row leads each part
    assert len(rows) > 2
    assert "(not shown in 40 columns: mu1, mu2, mu3,\npareto)" in table


def test_an_error_is_broken_between_words_on_a_terminal_and_one_line_elsewhere(capsys, monkeypatch):
    words = ["solve", "bnh", "--points", "8", "--limits", "f1"]
    assert main(words) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "40")
    assert main(words) == 2
    lines = capsys.readouterr().err.splitlines()
    assert max(map(len, lines)) <= 40 or "<=" in max(lines, key=len)  # a limit stays whole
    assert " ".join(lines) == line.rstrip()


@pytest.mark.parametrize("algorithm", ["psi", "surrogate", "nsga3"])
def test_a_log_shows_that_a_run_goes_on(capsys, monkeypatch, algorithm):
    """Without a terminal there is no bar, and a slow model would run for hours without a word."""
    words = ["solve", "bnh", "--points", "20", "--algorithm", algorithm]
    assert (main(words), capsys.readouterr().err) == (0, "")  # in less than a minute
    monkeypatch.setattr(_output, "_EVERY", 0.0)
    assert main(words) == 0
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("20 of 20 evaluated")
    assert ("feasible, 0 failed" in last) == (algorithm != "nsga3")


def test_a_log_shows_that_a_comparison_goes_on(capsys, monkeypatch):
    monkeypatch.setattr(_output, "_EVERY", 0.0)
    words = ["compare", "bnh", "--algorithms", "psi,nsga3", "--evaluations", "8", "--seeds", "2"]
    assert main(words) == 0
    assert capsys.readouterr().err.splitlines()[-1] == "3 of 3 runs done"
