"""What --help says holds: its examples can be pasted, and it fits a terminal of 80 columns."""

import os
import re
import shlex
import sys
from inspect import signature

import pytest

import pymoo_psi
from pymoo_psi import Formulation, paper
from pymoo_psi.cli import _experiments
from pymoo_psi.cli._app import app
from pymoo_psi.files import read_table
from tests.helpers.draws import rarely
from tests.helpers.folders import write_files
from tests.helpers.processes import printed_by

EXPERIMENTS = ["analyze", "compare", "reproduce"]


@pytest.mark.parametrize(
    "command",
    [
        "",
        "solve",
        "ask",
        "tell",
        "rank",
        "prefer",
        "page",
        "export",
        *rarely("report", *EXPERIMENTS),
    ],
)
def test_every_example_runs_as_printed(command, said, monkeypatch, undrawn, unplotted, in_folder):
    # The paper's points take most of the time.
    reproduce = _experiments.reproduce
    monkeypatch.setattr(_experiments, "reproduce", lambda n, **more: reproduce(min(n, 16), **more))
    text = said(*command.split(), "--help")
    examples = re.findall(r"^ +(pymoo-psi .*)$", text.partition("Examples:")[2], re.MULTILINE)
    assert examples
    assert command in examples[-1]
    for example in examples:
        _, *words = shlex.split(example)
        assert "error: " not in said(*words), example


@pytest.mark.parametrize(
    "command", ["", "solve", "ask", "tell", "rank", "page", "report", "export", *EXPERIMENTS]
)
def test_help_fits_80_columns_and_tells_each_command_whole(command, said, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = said(*command.split(), "--help")
    assert max(map(len, text.splitlines())) <= 80
    assert "..." not in text.partition("Commands:")[2]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("solve", "Missing argument 'PROBLEM'"),
        ("solve bnh --no-normalise", "--no-normalize"),
        ("solve models.py", "module:attribute (beam:Beam)"),
        ("solve no_such_module:thing", "No module named 'no_such_module'"),
        ("solve chute --timeout 1", "evaluates one design at a time if --timeout is given"),
        ("solve chute --study pyproject.toml", "pyproject.toml"),
        (
            "solve chute --limits f1<=2,5",
            "got 5; join limits by commas; use <= or >=, plain numbers",
        ),
        ("solve chute --objectives f1 --algorithm nsga3", "then pymoo-psi rank FILE.db"),
        ("solve chute --share 3/2 --study r", "--share must be (k, n) with k from 1 to n"),
        ("solve chute --share a/2 --study r", "'--share': 'a' is not a valid whole number."),
        ("solve chute --jobs 0", "error: --jobs must be 1 or more, or -1 for one per core, got 0"),
        ("rank set.csv --out no/x.csv", "--out needs a folder that exists"),
        ("analyze set.csv --out set.csv", "--out must be a folder, got 'set.csv'"),
        ("rank set.csv --units c=kg", "--units must be one of"),
        ("report set.csv --design 9", "--design must be the name of one design"),
        ("solve bnh --algorithm nsga4", "'nsga4' is not one of 'psi'"),
        ("solve bnh --bounds x9=1:2", "error: --bounds must be one of"),
        ("solve bnh --log x1", "x1 in --log must be a real variable whose lower bound is above 0"),
        ("solve bnh --noisy --study n.db", "--noisy must be left out for a problem that is called"),
        ("solve bnh --repeat 3", "error: --repeat must be 1"),
        ("solve bnh --points +8", "error: --points +N must be used with a study"),
        ("solve bnh --maximize f9", "error: --maximize must be one of"),
        ("solve bnh --limits f9<=2", "a name in --limits must be one of"),
        ("solve bnh --compute f1=f2", "a name in --compute must be unlike other columns"),
        ("solve chute --mu=-1", "error: --mu must be positive"),
        ("solve chute --model rollin", "error: --model must be one of"),
        ("rank set.csv --variables x9", "error: set.csv: --variables must be one of"),
        ("rank set.csv --skip-rows 99", "error: set.csv: --skip-rows must be"),
        ("rank set.csv --decimal ;", "error: set.csv: --decimal must be"),
        ("rank set.csv --average-by c9", "error: set.csv: --average-by must be one of"),
        ("rank set.csv --maximize f9", "error: set.csv: --maximize must be one of"),
        ("page set.csv --average-by q", "--average-by must be one of"),
        ("solve bnh --log x9", "error: --log must be one of"),
        ("solve bnh --study box.csv", "--study must be a database with a name such as"),
        (
            "rank set.csv --variables x --average-by variables",
            "--average-by must be the column that names designs, as there are no variables",
        ),
        ("solve bnh --study s.db --from set.csv", "row 3, x1 must be one real number, got nan"),
        ("rank ''", "a file or folder must have a name, got ''"),
        ("solve bnh --from set.csv", "--from must be used with --study"),
        ("rank study_key.csv", "error: study_key.csv: No such file"),
        ("solve models:Sized", "its arguments: length, n_ribs"),
        ("solve models:Sized --lenth 1", "--length"),
        ("solve models:broken", "no licence"),
        ("solve models:absent", "no attribute"),
        ("solve models:Mixed --bounds steel=S9", "one of 'S235'"),
        ("solve models:Mixed --bounds n=1:2:3", "n of --bounds must be"),
        ("rank set.csv --compute =f1", "--compute must be of the form name=expression"),
        ("rank set.csv --units f1=kg,f1=g", "column=unit, once for each name, got f1=g"),
        ("solve bnh --cluster s.json --algorithm nsga3", "--algorithm psi if a problem takes many"),
        (
            "solve bnh --points +4 --algorithm nsga3 --study s.db",
            "--algorithm must be psi or surrogate for --points +N, got 'nsga3'",
        ),
    ],
)
def test_a_mistake_is_one_line_and_code_2(words, message, said, tmp_path):
    text = "x,x1,x2,g1,g2,f1,f2\n1,1,1,0,0,1,5\n2,2,2,0,0,2,4\n,,3,0,0,3,3\n"
    write_files(tmp_path, {"pyproject.toml": "[project]\n", "set.csv": text})
    err = said(*shlex.split(words), code=2)
    assert message in err
    assert err.startswith("pymoo-psi: error: ")
    assert {*os.listdir(tmp_path)} <= {"models.py", "pyproject.toml", "set.csv", "r", "__pycache__"}


def test_python_m_and_version():
    printed = printed_by(sys.executable, "-m", "pymoo_psi", "--version")
    assert printed == f"pymoo-psi {pymoo_psi.__version__}\n"


def test_options_are_named_as_the_librarys_arguments(said):
    options = {
        word.replace("-", "_") for word in re.findall(r"--([a-z-]+)", said("rank", "--help"))
    }
    arguments = {*signature(read_table).parameters} - {"source", "formulation"}
    assert arguments <= options
    assert {"objectives", "maximize", "limits"} <= options & {*signature(Formulation).parameters}


def default_of(function, name):
    return signature(function).parameters[name].default


# Defaults of the commands and those of Python; the rest are said in the help.
SAME = {
    ("solve", "repeat"): (pymoo_psi.investigate, "repeat"),
    ("solve", "jobs"): (pymoo_psi.investigate, "n_jobs"),
    ("compare", "seeds"): (pymoo_psi.compare, "seeds"),
    ("compare", "algorithms"): (pymoo_psi.compare, "algorithms"),
    ("compare", "jobs"): (pymoo_psi.compare, "n_jobs"),
    ("reproduce", "points"): (paper.reproduce, "n_points"),
    ("reproduce", "jobs"): (paper.reproduce, "n_jobs"),
}
# What Python asks for, or leaves to pymoo, or has no use for.
ONLY_THERE = {
    "solve": {"algorithm", "seed"},
    "ask": {"points", "algorithm", "seed"},
    "page": {"out"},
    "live": {"host"},
    "prefer": {"out"},
    "report": {"out"},
    "reproduce": {"out"},
}


def test_every_default_of_a_command_is_that_of_python(said):
    found = set()
    for name, command in app.commands.items():
        for option in command.params:
            default = option.to_info_dict().get("default")
            if default in (None, False, (), []) or option.param_type_name == "argument":
                continue
            found.add((name, option.name))
            if option.name in ONLY_THERE.get(name, ()):
                assert f"[default: {default}" in " ".join(said(name, "--help").split())
            else:
                of_python = default_of(*SAME[name, option.name])
                assert default == of_python or default.split(",") == list(of_python)
    assert found >= SAME.keys()
