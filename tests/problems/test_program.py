"""External programs: what is written, run, read and refused."""

import re
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from pymoo_psi import (
    ProcessRunner,
    ProgramProblem,
    Recorded,
    compare,
    investigate,
    read_table,
)
from pymoo_psi.errors import StudyMismatchError
from pymoo_psi.problems import LogScaled, Output
from tests.helpers.draws import rarely
from tests.helpers.folders import write_files
from tests.helpers.processes import gone, posix, until
from tests.helpers.refusals import refused

# A solver as one writes it: reads a deck, prints a log, leaves a table and JSON.
SOLVER = """
import json, sys, time
deck = dict(line.split("=") for line in open("beam.inp").read().split())
width, height, mode = float(deck["width"]), float(deck["height"]), deck["mode"]
print("step 1 stress = 9.0\\nstep 2 stress = %.17g" % (600 / width / height))
json.dump({"tip": {"u": [1 / (width * height**3), 0]}}, open("out.json", "w"))
open("table.csv", "w").write("t;F\\n0;1\\n1;%.17g\\n" % (width + height))
if mode == "hang":
    time.sleep(60)
if mode == "crash":
    sys.exit("no convergence in step 2")
if mode == "junk":
    open("out.json", "w").write("{")
"""
FILE = """
name = "beam"
key = "mesh 3"
[variables]
width = {bounds = [2, 4], unit = "mm"}
height = {bounds = [1, 9]}
mode = {choices = ["good"]}
[program]
command = "PYTHON solver.py"
template = "model"
files = ["beam.inp"]
[outputs]
stress = {file = "stdout.txt", pattern = "stress = (\\\\S+)", row = -1, unit = "MPa"}
tip = {file = "out.json", key = "tip.u.0"}
load = {file = "table.csv", column = "F", row = -1}
mass = {expression = "2*width*height", unit = "kg"}
[objectives]
minimize = ["mass", "tip"]
maximize = ["load"]
[limits]
stress = "<= 60"
"""


@pytest.fixture
def beam(tmp_path):
    """Return a function that writes the example, some texts of it replaced, and loads it."""
    template = "width={width:.17g}\nheight={height}\nmode={mode}\n"
    write_files(tmp_path, {"model/solver.py": SOLVER, "model/beam.inp": template})

    def load(*replaced, **kwargs):
        text = FILE.replace("PYTHON", sys.executable)
        for old, new in replaced:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "beam.toml").write_text(text)
        return ProgramProblem.from_toml(tmp_path / "beam.toml", **kwargs)

    return load


def runs(tmp_path):
    return sorted((tmp_path / "runs").glob("*"))


@pytest.mark.parametrize("jobs", [2, *rarely(1)])
def test_a_program_gives_the_numbers_of_its_formulas(beam, tmp_path, jobs):
    table = investigate(beam(elementwise_runner=ProcessRunner(jobs)), 5)
    width, height = table.X[:, :2].astype(float).T
    for name, expected in {
        "mass": 2 * width * height,
        "tip": 1 / (width * height**3),
        "load": width + height,
        "stress": 600 / width / height,
    }.items():
        np.testing.assert_allclose(table.column(name), expected, rtol=1e-15)
    np.testing.assert_array_equal(table.F[:, 2], -table.column("load"))
    np.testing.assert_array_equal(table.status == "ok", 600 / width / height <= 60)
    assert table.schema.units == {"width": "mm", "mass": "kg", "stress": "MPa"}
    assert table.schema.maximize == ("load",)
    assert runs(tmp_path) == []


def test_the_limits_of_a_program_hold_in_the_table_of_any_algorithm(beam, study_file):
    problem = beam()
    expected = investigate(problem, 5)
    recorded = Recorded(problem, study_file)
    assert recorded.table.limits == expected.limits
    designs = [dict(zip(problem.variables, row, strict=True)) for row in expected.X.tolist()]
    recorded.evaluate(np.array(designs))
    assert recorded.table.status.tolist() == expected.status.tolist()
    assert set(expected.status) == {"ok", "infeasible"}


@pytest.mark.parametrize(
    ("mode", "reason"),
    [
        ("crash", "exit code 1: no convergence in step 2"),
        ("junk", "output tip: no tip.u.0 in out.json"),
    ],
)
def test_a_failed_program_keeps_its_folder(beam, tmp_path, mode, reason):
    failing = ('"good"', f'"{mode}"')
    reasons = investigate(beam(failing), 2).reasons
    assert [text.startswith(reason) for text in reasons.values()] == [True, True]
    folders = [Path(text.split("see ")[1]) for text in reasons.values()]
    assert sorted(folders) == runs(tmp_path)
    assert (
        "see" not in investigate(beam(failing, ("files =", 'keep = "none"\nfiles =')), 1).reasons[1]
    )
    assert runs(tmp_path) == sorted(folders)


def test_a_hanging_program_ends_with_all_it_started(beam, tmp_path):
    (tmp_path / "model" / "hang.sh").write_text("sleep 71 & echo $! > pid; sleep 72")
    changed = [(f"{sys.executable} solver.py", "sh hang.sh"), ("files =", "timeout = 2\nfiles =")]
    assert investigate(beam(*changed), 1).reasons[1].startswith("timed out after 2 s")
    assert gone(int((runs(tmp_path)[0] / "pid").read_text()))


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("row = -1, unit", "unit", "has 2 times a match of .*say which one by row"),
        ('key = "tip.u.0"', 'key = "tip.v"', "no tip.v in out.json"),
        ('column = "F"', 'column = "G"', "has t, F, not one column 'G'"),
        ("2*width*height", "2/(width-width)", "output mass: it is inf"),
    ],
)
def test_what_cannot_be_read_fails_the_design(beam, old, new, match):
    assert re.search(match, investigate(beam((old, new)), 1).reasons[1])


PRINTED = {"m": {"file": "stdout.txt", "pattern": "(.+)"}}
WRITTEN = {"m": {"file": "out", "pattern": "(.+)"}}


def shell(tmp_path, script, outputs, template=(), **program):
    """A program of one variable, a script of the shell in a template."""
    folder = tmp_path / "template"
    write_files(folder, {"run.sh": script, **dict(template)})
    return ProgramProblem(
        {"x": {"bounds": [0, 1]}},
        {"command": "sh run.sh {x}", "template": str(folder), "folder": str(tmp_path / "runs")}
        | program,
        outputs,
        {"minimize": [*outputs]},
    )


def echo(n, limits=None, **expressions):
    """A program that prints its variable as m; other outputs are computed from it."""
    outputs = {name: {"expression": text} for name, text in expressions.items()}
    return ProgramProblem(
        {"n": n},
        {"command": "echo {n}", "keep": "none"},
        {"m": {"file": "stdout.txt", "pattern": "(.+)"}, **outputs},
        {"minimize": ["m", *outputs]},
        limits or {},
    )


def test_results_in_the_template_belong_to_no_design(tmp_path):
    """A program that writes no file fails; the file of an earlier run stays in the template."""
    outputs = {"n": {"file": "in", "pattern": "n=(.+)"}, "m": {"file": "out", "pattern": "(.+)"}}
    run = shell(tmp_path, "echo n=2 > in", outputs, {"out": "7", "in": "n=1\n"}).run({"x": 0.5})
    assert run.outputs == {"n": 2.0}
    assert "left no file out" in run.flaws[0]


def test_a_program_may_edit_its_input_in_place(tmp_path):
    """A result that was there before is none."""
    write_files(tmp_path, {"template/in": "x={x}\nm=0\n"})
    problem = ProgramProblem(
        {"x": (0.0, 1.0), "edit": {"choices": ["s/m=0/m=5/", "p"]}},
        {"command": "sed -i -n -e {edit} -e p in", "template": "template", "files": ["./in"]},
        {"m": {"file": "in", "pattern": "m=(.+)"}},
        {"minimize": ["m"]},
        base=tmp_path,
    )
    assert problem.run({"x": 0.5, "edit": "s/m=0/m=5/"}).outputs == {"m": 5.0}
    assert "left in as it was" in problem.run({"x": 0.5, "edit": "s/m=1/m=5/"}).flaws[0]


def test_files_that_editors_leave_do_not_count(tmp_path):
    problem = shell(tmp_path, "echo 5", PRINTED)
    identity = problem.fingerprint()
    (tmp_path / "template" / ".#run.sh").symlink_to("user@host.4711")
    write_files(tmp_path, {"template/__pycache__/solver.pyc": "compiled"})
    assert problem.run({"x": 0.5}).outputs == {"m": 5.0}
    assert problem.fingerprint() == identity


@pytest.mark.parametrize("path", ["{}/in", "../in", "a/../../in", "C:\\in", "\\\\server\\in"])
def test_paths_stay_in_the_folder_of_a_run(tmp_path, path):
    (tmp_path / "in").write_text("{x}")
    path = path.format(tmp_path)
    refused(
        "file must be a relative path inside the folder",
        shell,
        tmp_path,
        "",
        {"m": {"file": path, "pattern": "(.+)"}},
    )
    refused(
        "files must be a relative path inside the folder",
        shell,
        tmp_path,
        "",
        WRITTEN,
        files=[path],
    )


def test_all_that_a_run_copies_counts_for_a_study(tmp_path):
    """Linked folders and hidden files, too; what has changed is said by its name."""
    write_files(tmp_path, {"elsewhere/data": "1"})
    problem = shell(tmp_path, "cat .hidden link/data", PRINTED, {".hidden": ""})
    template = tmp_path / "template"
    (template / "link").symlink_to(tmp_path / "elsewhere")
    for name in ("link/data", ".hidden", "added.inp"):
        study = tmp_path / f"{Path(name).stem}.db"
        investigate(problem, 2, study=study)
        (template / name).write_text("2")
        refused(
            f"{name} in the template is not as in the study.*another file, or restore",
            investigate,
            problem,
            2,
            error=StudyMismatchError,
            study=study,
        )


@posix
def test_what_a_program_leaves_running_ends(tmp_path):
    """In its group and outside of it; what ends within a moment is waited for."""
    half = "(printf 1; echo $$ > pid; sleep 60; printf 2) > out & setsid sleep 61 &\necho $! > pid2"
    assert (
        "let the command wait for them" in shell(tmp_path, half, WRITTEN).run({"x": 0.5}).flaws[0]
    )
    assert all(gone(int(pid.read_text())) for pid in tmp_path.glob("runs/*/pid*"))
    assert shell(tmp_path, "(sleep 0.1; echo 12 > out) &", WRITTEN).run({"x": 0.5}).outputs == {
        "m": 12.0
    }


@posix
@pytest.mark.parametrize("how", [signal.SIGKILL, *rarely(signal.SIGINT)])
def test_a_program_ends_with_the_process_above_it(tmp_path, how):
    shell(
        tmp_path, "echo $$ > ../../pid; setsid sleep 62 & echo $! > ../../pid2; sleep 63", WRITTEN
    )
    code = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from pymoo_psi import ProgramProblem
ProgramProblem(
    {"x": {"bounds": [0, 1]}},
    {"command": "sh run.sh {x}", "template": "template"},
    {"m": {"file": "out", "pattern": "(.+)"}},
    {"minimize": ["m"]},
).run({"x": 0.5})
"""
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, stderr=subprocess.PIPE
    ) as run:
        pids = [tmp_path / "pid", tmp_path / "pid2"]
        assert until(lambda: all(pid.exists() and pid.read_text() for pid in pids))
        run.send_signal(how)
    assert all(gone(int(pid.read_text())) for pid in pids)


def test_all_wrong_outputs_of_a_run_are_reported(tmp_path):
    outputs = {name: {"file": "stdout.txt", "pattern": f"{name} = (.*)"} for name in "abcd"}
    outputs |= {"e": {"expression": "2*b"}, "f": {"expression": "2*d"}}
    run = shell(tmp_path, "echo a = 1; echo c = x; echo d = 3", outputs).run({"x": 0.5})
    assert run.outputs == {"a": 1.0, "d": 3.0, "f": 6.0}
    assert run.flaws == [
        "output b: stdout.txt has no match of 'b = (.*)'",
        "output c: 'x' in stdout.txt is no plain number",
    ]


def read_output(folder, content, settings):
    (folder / "out").write_bytes(content.encode() if isinstance(content, str) else content)
    return Output(file="out", **settings).read(folder)


NUMBER, COLUMN = {"pattern": "f = (.*)"}, {"column": "m"}


@pytest.mark.parametrize(
    ("content", "settings", "expected"),
    [
        ("f = -1.5D+03\n", NUMBER, -1500.0),
        ("w m\n5 10", COLUMN, 10),
        ("  w     m  \n  5    10  \n", COLUMN, 10),
        ('"tip speed" "m"\n1 10\n', COLUMN, 10),
        ("w|m\n5|10\n", COLUMN, 10),
        ("# made by hand\nw,m\n5,10\n", COLUMN, 10),
        ("tip speed   m\n0       5  10\n", COLUMN, 10),
        ("# w m\n5 10\n", COLUMN, 10),
        ("f = 1,5\n", {"pattern": "f = (.*)", "decimal": ","}, 1.5),
        ("f = -1,5E+03\n", {"pattern": "f = (.*)", "decimal": ","}, -1500.0),
        ("w;m\n1,5;1,250\n", {"column": "m", "decimal": ","}, 1.25),
        ("f = 0.12+103\n", {"pattern": "f = (.*)"}, 0.12e103),
        ("f = 12,5 mm\n", {"pattern": r"f = (\d+),"}, 12.0),
        ("f1-2=5mm\n", {"pattern": r"=(\d+)"}, 5.0),
        ("12.5,13.7\n", {"pattern": r"^([\d.]+)"}, 12.5),
        ("f-5\n", {"pattern": r"f-(\d+)"}, 5.0),
        ("Länge = 3\n".encode("cp1252"), {"pattern": "Länge = (.*)", "encoding": "cp1252"}, 3.0),
        ("Höhe;m\n3;5\n".encode("cp1252"), {"column": "Höhe", "encoding": "cp1252"}, 3.0),
        ("Länge = 3\r\n".encode("utf-16"), {"pattern": "^Länge = (.*)$"}, 3.0),
        ("Länge = 3\n".encode("utf-16-le"), {"pattern": "Länge = (.*)"}, 3.0),
        ("f = 3 \xe4\n".encode("cp1252"), {"pattern": "f = (\\S+)"}, 3.0),
        ('{"tip.u": {"x": [1, 7]}}', {"key": ["tip.u", "x", 1]}, 7.0),
        ('\ufeff{"tip": {"u": 7}}', {"key": "tip.u"}, 7.0),
        ("Solver 3\n\nrun of Monday, F in N\nt;F\n0;7\n", {"column": "F", "header": 4}, 7.0),
        ("force (N) = 7", {"pattern": r"force \(N\) = (\S+)"}, 7.0),
    ],
)
def test_numbers_are_read_as_programs_write_them(tmp_path, content, settings, expected):
    assert read_output(tmp_path, content, settings) == expected


@pytest.mark.parametrize(
    ("content", "settings", "flaw"),
    [
        *(
            (f"f = {text}\n", NUMBER, "is no plain number")
            for text in ("1.234,5", "12 MPa", "", "nan", "inf", "0x10", "1_000", "\u0663")
        ),
        ("w m\n1 5 10", COLUMN, "not one column 'm'"),  # R: names of rows in front
        ("     w   m\n0  5  10\n1  6  11", COLUMN, "not one column 'm'"),  # pandas
        ("tip speed m\n5 10\n", COLUMN, "not one column 'm'"),
        ("   m  tip speed\n0  5         10\n", COLUMN, "is no table"),
        ("w m n\n5 10\n", COLUMN, "not one column 'm'"),
        ("w,m\n1,5,10\n", COLUMN, "line 2 has 3 cells, most lines 2"),
        ("w;m\n1,5;1.250\n", COLUMN, "out has decimal commas; write decimal = ','"),
        ("w,m\n5,\n", COLUMN, "'' in out is no plain number"),
        ("w,m,m\n5,1,2\n", COLUMN, "names the column 'm' twice"),
        ("w,m\n", COLUMN, "it must hold a line of column names"),
        ("f = 1,5\n", {"pattern": "f = (.*)"}, "write decimal = ','"),
        ("f = 7.600e+02 N\n", {"pattern": r"f = ([\d.]+)"}, "is a part of a number; the group"),
        ("f = 10,050.00\n", {"pattern": r"f = (\d+)"}, "is a part of a number"),
        ("f = 10.5\n", {"pattern": r"f = (\d+)"}, "is a part of a number"),
        ("f = 1050\n", {"pattern": r"f.*(\d+)"}, "is a part of a number"),
        ("f = -5\n", {"pattern": r"f.*?(\d+)"}, "is a part of a number"),
        ("f = 1.250,5\n", {"pattern": "f = (.*)", "decimal": ","}, "no plain number"),
        ("f = 1.5\n", {"pattern": "f = (.*)", "decimal": ","}, "no plain number"),
        ("Länge = 3\n".encode("cp1252"), {"pattern": "Länge = (.*)"}, "encoding = 'cp1252'"),
        ("Höhe;m\n3;5\n".encode("cp1252"), {"column": "Höhe"}, "encoding = 'cp1252'"),
        ('{"tip.u": 7}', {"key": "tip.u"}, "key = ['tip.u', 'x']"),
        ("Solver 3\n\nt;F\n0;7\n", {"column": "F"}, "write header = 3"),
        ("Solver 3\nt;F\n0;7\n", {"column": "F", "header": 2, "row": 1}, "number 1"),
        ("f = 3\n", {"pattern": "f = (.*)", "encoding": "cp99"}, "unknown encoding: cp99"),
        ("w,m\n1,5\n", {"column": "m", "header": 9}, "1 to 2, got 3"),
    ],
)
def test_what_is_not_one_plain_number_has_a_remedy(tmp_path, content, settings, flaw):
    with pytest.raises((ValueError, LookupError), match=re.escape(flaw)):
        read_output(tmp_path, content, settings)


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        (r"f (N) = (\S+)", r"'f (N) = (\S+)', 2 groups; write \( and \)"),
        (r"f = \S+", r"got 'f = \S+', 0 groups"),
        (r"f = (\S+", r"got 'f = (\S+', missing ), unterminated subpattern"),
    ],
)
def test_a_wrong_pattern_is_shown_as_typed(pattern, message):
    refused(re.escape(message), Output, file="out", pattern=pattern)


TWO_ERRORS = "echo '*** ERROR: mesh'; echo '*** ERROR: more'; echo bye; exit 3"


@pytest.mark.parametrize(
    ("script", "listing", "flaw"),
    [
        (TWO_ERRORS, {"file": "stdout.txt"}, "mesh; exit code 3: bye"),
        (TWO_ERRORS, {"file": "stdout.txt", "row": -1}, "more; exit code 3: bye"),
        ("echo 'ERROR: mesh' > job.log", {"file": "stdout.txt"}, "output m: the program left no file out"),
        ("exit 3", {"file": "job.log"}, "exit code 3: no message"),  # that of an earlier run
    ],
)  # fmt: skip
def test_a_listing_says_why_a_program_failed(tmp_path, script, listing, flaw):
    problem = shell(
        tmp_path,
        script,
        WRITTEN,
        {"job.log": "ERROR: x"},
        error={"pattern": "ERROR: (.+)", **listing},
    )
    assert problem.run({"x": 0.5}).flaws[0].startswith(flaw)


@posix
def test_programs_are_on_the_path_or_in_the_folder(tmp_path, monkeypatch):
    problem = shell(tmp_path, "", PRINTED, {"solver": "#!/bin/sh\necho 1"}, command="solver {x}")
    (tmp_path / "template" / "solver").chmod(0o755)
    assert problem.run({"x": 0.5}).outputs == {"m": 1.0}
    (tmp_path / "solver").write_text("#!/bin/sh\necho 2")
    (tmp_path / "solver").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    assert problem.run({"x": 0.5}).outputs == {"m": 2.0}


def test_another_exit_code_may_mean_success(tmp_path, study_file):
    problem = shell(tmp_path, "echo 5; exit 1", PRINTED)
    allowed = shell(tmp_path, "echo 5; exit 1", PRINTED, exit_codes=[0, 1])
    # A study goes on with it; the tests that failed may be made again.
    assert investigate(problem, 1, study=study_file).reasons[1].startswith("exit code 1: 5")
    assert investigate(allowed, 1, study=study_file, retry="failed").F.tolist() == [[5]]


def test_a_choice_of_numbers_is_computed_with_in_a_study(study_file):
    for limits in ({}, {"twice": "<= 2"}):  # other limits complete the stored tests anew
        table = investigate(echo({"choices": [1, 2]}, limits, twice="2*n"), 2, study=study_file)
    assert table.status.tolist() == ["ok", "infeasible"]


@pytest.mark.parametrize("asked", [{"names": {"f1": "M"}}, {"maximize": ["m"]}])
def test_limits_hold_whatever_objectives_are_called(asked):
    table = investigate(echo({"choices": [1, 2]}, {"m": "<= 1"}), 2, **asked)
    assert table.status.tolist() == ["ok", "infeasible"]


def test_shares_of_two_expressions_are_no_table(tmp_path):
    for factor, part in ((2, 1), (2, 2), (3, 1)):
        investigate(echo((1, 2), e=f"{factor}*n"), 4, study=tmp_path / "shares", share=(part, 2))
    refused("has e = 2", read_table, tmp_path / "shares", error=StudyMismatchError)


@pytest.mark.parametrize(
    "use",
    [
        partial(investigate, n_points=2, names={"x1": "width", "f1": "m", "f2": "twice"}),
        lambda problem, study: investigate(LogScaled(problem), 2, study=study),
        lambda problem, study: compare(
            problem,
            n_evaluations=4,
            seeds=1,
            algorithms=["psi", "psi+nsga3"],
            folder=study,
            progress=False,
        ),
    ],
    ids=["other names", "logarithms", "comparison"],
)
def test_another_expression_is_another_model_where_no_test_is_completed(tmp_path, use):
    path, n = tmp_path / "kept", {"bounds": [1, 2], "scale": "log"}
    for _ in range(2):
        use(echo(n, e="2*n"), study=path)
    refused("another (model|problem)", use, echo(n, e="3*n"), study=path, error=StudyMismatchError)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ([("[variables]", "[variable]")], "did you mean 'variables'"),
        ([('minimize = ["mass"', 'minimize = ["mas"')], "did you mean 'mass'"),
        ([('template = "model"', 'template = "models"')], "template must be a folder"),
        ([("files =", 'folder = "model/r"\nfiles =')], "outside of"),
        (
            [('mode = {choices = ["good"]}', "mode = [1, 2]\nmore = [3, 4]")],
            "the variable more must be in",
        ),
        ([(sys.executable, "no-such-program")], "on PATH or in the template"),
        ([('stress = "<= 60"', 'stress = "60"')], "the limit on stress must be such as"),
        ([("pattern =", 'key = "a", pattern =')], "one of pattern, key and column"),
        ([("[limits]", "[limits")], "beam.toml"),
        ([('["beam.inp"]', '"beam.inp"')], "program: Expected `array`"),
        ([('"tip.u.0"', '"tip.(\\S+)"')], "between '…'"),
        ([("solver.py", "solver.py | tee log")], "sh run.sh"),
        ([("solver.py", "solver.py '")], "program: No closing quotation"),
        ([('unit = "mm"', "unit = 1")], "width: Expected `str`"),
        ([("[limits]", "[limits]\nwidth = '<= 3'")], "requirements"),
        ([("stress = (", "stress = ((")], "regular expression"),
    ],
)
def test_a_wrong_file_is_refused_before_any_run(beam, tmp_path, changes, match):
    refused(match, beam, *changes)
    with pytest.raises(FileNotFoundError, match="beam.dat"):
        beam(("beam.inp", "beam.dat"))
    assert runs(tmp_path) == []
