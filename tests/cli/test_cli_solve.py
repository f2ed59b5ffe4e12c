"""``pymoo-psi solve`` and ``export``: limits, studies, failures, nothing feasible, interruption."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from pymoo_psi import PSI, QMCSampling, TestTable, VectorizedSphereChute
from pymoo_psi.cli import main
from pymoo_psi.cli._solve import _failures
from tests.table.exact_csv import EXACT

MODELS = '''
import math, os, pathlib, signal, time
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Real

class Root(ElementwiseProblem):
    """Fails for x1 < 0, in two ways."""
    def __init__(self):
        super().__init__(n_var=2, n_obj=2, xl=-1, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        if x[0] < -0.5:
            raise OSError("no licence")
        out["F"] = [math.sqrt(x[0]), 1 - x[1]]

class Vectorized(Problem):
    def __init__(self):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = x[:, :2] ** 2 - x[:, ::-1]
        out["G"] = x[:, :1] - 0.75

class Never(ElementwiseProblem):
    def __init__(self):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=2, xl=-1, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        if x[0] < -0.5:
            raise OSError("no licence")
        out["F"], out["G"] = [x[0], -x[1]], [x[0], 2 - x[1]]

class Mended(Root):
    def name(self):
        return "Root"
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [abs(x[0]), 1 - x[1]]

class One(ElementwiseProblem):
    def __init__(self):
        super().__init__(n_var=1, n_obj=1, xl=0, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [(x[0] - 0.3) ** 2]

class Agreed(ElementwiseProblem):
    def __init__(self):
        super().__init__(n_var=2, n_obj=2, xl=0, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [x[0] + x[1], x[0] + 2 * x[1]]

class AgreedAtOnePoint(ElementwiseProblem):
    def __init__(self):
        bounds = {"x1": (2, 2), "x2": (0, 1)}
        super().__init__(vars={name: Real(bounds=pair) for name, pair in bounds.items()}, n_obj=2)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [x["x2"], 2 * x["x2"]]

class Stopped(Root):
    """Someone presses Ctrl-C in the seventh evaluation."""
    count = 0
    def _evaluate(self, x, out, *args, **kwargs):
        Stopped.count += 1
        if Stopped.count == 7:
            signal.raise_signal(signal.SIGINT)
        out["F"] = [x[0], 1 - x[0]]

class Slow(ElementwiseProblem):
    def __init__(self):
        super().__init__(n_var=1, n_obj=2, xl=0, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        pathlib.Path("started").touch()
        time.sleep(0.02)
        out["F"] = [x[0], 1 - x[0]]
'''


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    (tmp_path / "models_of_solve.py").write_text(MODELS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))

    def command(*words):
        words = [str(word).replace("models:", "models_of_solve:") for word in words]
        code = main(words)
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    yield command
    sys.modules.pop("models_of_solve", None)


@pytest.mark.parametrize("problem", ["chute", "models:Vectorized"])
@pytest.mark.parametrize("limits", [[], ["--limits", "f1=2,f2<=0.5"]])
def test_arrays_and_objects_give_the_same_file(run, problem, limits):
    """Without a study a vectorised problem is tested without pymoo's objects."""
    words = ["solve", problem, "--points", 300, *limits]
    code, plain, _ = run(*words, "--out", "plain.csv")
    again, stored, _ = run(*words, "--out", "stored.csv", "--study", "s.db")
    assert code == again == 0
    assert Path("plain.csv").read_text() == Path("stored.csv").read_text()
    assert plain.splitlines()[:-1] == stored.splitlines()[:-1]


def test_limits_are_those_of_psi(run):
    from pymoo.optimize import minimize

    assert (
        run("solve", "chute", "--points", 200, "--limits", "f1=2.2, f4<=1.5", "--out", "o.csv")[0]
        == 0
    )
    result = minimize(VectorizedSphereChute(), PSI(200, limits={"f1": 2.2, "f4": 1.5}))
    written = pd.read_csv("o.csv")
    assert sorted(written["test_point"]) == sorted(result.opt.get("test_point"))
    assert 0 < len(written) < 200


def test_reasons_of_failures_are_counted(run):
    code, printed, _ = run("solve", "models:Root", "--points", 64)
    assert code == 0
    assert "64 tested, 32 failed" in printed
    assert "Failed: 16 × OSError: no licence; 16 × ValueError: " in printed
    code, printed, _ = run("solve", "models:Root", "--points", 64, "--algorithm", "nsga3")
    assert code == 0
    assert "Failed: " in printed
    assert " × OSError: no licence" in printed


def test_reasons_that_quote_the_design_are_counted_together():
    """The cause stands behind a long command; who exits with 4 fails otherwise than with 3."""
    command = f"Error: {'long ' * 30}--x %s --y %s returned %d"
    given = [command % (x, 1e-7 * x, code) for x, code in ((0.25, 3), (0.5, 3), (0.75, 4))]
    (line,) = _failures(given)
    assert re.fullmatch(
        r"Failed: 2 × Error: long .*--x … --y … returned 3; 1 × .* returned 4", line
    )
    assert len(line) < 300
    assert _failures(["at 0.25"]) == ("Failed: 1 × at 0.25",)


def test_failed_designs_are_tried_again(run):
    words = ["--points", 64, "--study", "s.db"]
    assert run("solve", "models:Root", *words)[0] == 0
    failed = TestTable.read_study("s.db")
    numbers = failed.numbers[failed.status == "failed"]
    assert len(numbers) == 32
    some = ",".join(map(str, numbers[:2]))
    for given, left in (([], 32), (["--retry", some], 30), (["--retry", "failed"], 0)):
        assert run("solve", "models:Mended", *words, *given)[0] == 0
        assert (TestTable.read_study("s.db").status == "failed").sum() == left


def test_nothing_feasible_is_explained(run):
    code, printed, err = run("solve", "models:Never", "--points", 64, "--out", "o.csv")
    assert (code, err) == (1, "")
    assert "Never: no feasible design, 64 tested, 16 failed" in printed
    assert (
        "Infeasible: 48 of 48 that were computed; g2 rejects most: 48, 17 of them alone." in printed
    )
    assert "Failed: 16 × OSError: no licence" in printed
    assert "o.csv is not written" in printed
    assert not os.path.exists("o.csv")
    code, printed, _ = run("solve", "models:Never", "--points", 64, "--algorithm", "nsga3")
    assert code == 1
    assert "g2 rejects most" in printed
    code, printed, _ = run("solve", "chute", "--points", 64, "--limits", "f1=2.4,f2=-1")
    assert code == 1
    assert "64 of 64 that were computed; f2<=-1 rejects most: 64" in printed


def test_a_corner_that_dominates_everything_is_told(run):
    printed = run("solve", "models:Agreed", "--points", 64)[1]
    assert (
        "Test point 1 dominates all other feasible tests: the criteria do not conflict here, and "
        "there is nothing to choose. It lies in a corner of the box: the lower end of x1 and the "
        "lower end of x2." in printed
    )
    printed = run("solve", "models:Agreed", "--points", 64, "--box", "x1=0.3")[1]
    assert "It lies at the lower end of x2." in printed
    printed = run("solve", "models:AgreedAtOnePoint", "--points", 8)[1]
    assert "It lies at the lower end of x2." in printed
    assert "dominates all" not in run("solve", "bnh", "--points", 64)[1]


@pytest.mark.parametrize("engine", ["sobol", "halton", "lhs"])
def test_test_points_of_other_sequences_are_those_of_psi(run, engine):
    from pymoo.optimize import minimize

    words = ["solve", "chute", "--points", 64, "--sampling", engine, "--seed", 3]
    assert run(*words, "--out", "o.csv")[0] == 0
    psi = PSI(64, sampling=QMCSampling(engine))
    expected = minimize(VectorizedSphereChute(), psi, seed=3).opt.get("X")
    found = pd.read_csv("o.csv", **EXACT)[["x1", "x2"]]
    assert sorted(map(tuple, found.to_numpy())) == sorted(map(tuple, expected))


def test_one_design_is_one_design(run):
    assert "1 Pareto-optimal design, 16 tested" in run("solve", "models:One", "--points", 16)[1]


def test_a_study_becomes_a_table(run):
    assert run("solve", "models:Root", "--points", 64, "--study", "s.db")[0] == 0
    code, printed, err = run("export", "s.db", "--out", "table.csv")
    assert (code, err) == (0, "")
    assert "64 tests (32 ok, 0 infeasible, 32 failed) written to table.csv" in printed
    assert TestTable.read_csv("table.csv").equals(TestTable.read_study("s.db"))
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    assert run("export", "s.db", "--out", "table.parquet")[0] == 0
    assert TestTable.read_parquet("table.parquet").equals(TestTable.read_study("s.db"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--limits", "x1=2"], "--limits must be x1<=2 or x1>=2, as x1 is no criterion, got x1=2"),
        (["--limits", "f9<=2"], "a limit must be one of 'f1', 'f2', 'f3', 'f4'"),
        (["--limits", "2<=f1<=1"], "the limit on 'f1' must be (lower, upper) in rising order, got (2.0, 1.0)"),
        (["--limits", "1<=f1,f1>=0"], "--limits must be given once for each side of a column, got f1>=0"),
        (["--criterion", "r=f1/"], "the expression 'f1/' must be continued by a number"),
        (["--criterion", "f1=f2"], "--criterion must be a column, or of the form name=expression with a new name"),
        (["--criterion", "r=f1/f9"], "a column of 'f1/f9' must be one of"),
        (["--criterion", "rank=f1"], "--criterion must be named unlike the columns of a ranking"),
        (["--relax", "f1"], "--relax must be one of 'g1'"),
        (["--maximize", "g1"], "--maximize must be one of the objectives f1, f2, f3, f4, got 'g1'"),
        (["--formulation", "none.json"], "none.json: No such file"),
        (["--criterion", "r=f1/f2", "--algorithm", "nsga3"], "--criterion must be used with --algorithm psi"),
        (["--limits", "f1"], "--limits must be of the form criterion=number"),
        (["--limits", "f1<2"], "got f1<2; write <= for <"),
        (["--limits", "f1<=2,5"], "got f1<=2,5; write 2.5 for 2,5"),
        (["--limits", "f1<=2,5,f2<=3"], "got 5; write 2.5 for 2,5"),
        (["--sampling", "lhs", "--algorithm", "nsga3"], "--sampling must be used with --algorithm psi or surrogate"),
        (["--limits", "f1<=2.5e1 kg"], "got f1<=2.5e1 kg; write the number without its unit"),
        (["--limits", "f1=x"], "--limits must be of the form criterion=number"),
        (["--limits", "f1=1,"], "--limits must be of the form criterion=number"),
        (["--limits", "f1=2,f1=3"], "--limits must be given once for each side of a column"),
        (["--limits", "f9=2"], "--limits must be one of 'f1', 'f2', 'f3', 'f4', 'x1', 'x2', got 'f9'"),
        (["--limits", "f1=nan"], "--limits must be of the form criterion=number"),
        (["--limits", "f1=1", "--algorithm", "nsga3"], "--limits must be used with --algorithm psi"),
        (["--retry", "failed"], "--retry must be used with --study FILE.db"),
        (["--retry", "1,x", "--study", "s.db"], "--retry must be 'failed' or numbers"),
        (["--retry", "0", "--study", "s.db"], "--retry must be 'failed' or numbers"),
        (["--retry", "99", "--points", "16", "--study", "s.db"], "retry must be numbers of points"),
        (["--seed", "-1"], "--seed must be an integer >= 0"),
        (["--out", ""], "a file or folder must have a name, got ''"),
        (["--study-key", "v1"], "--study-key must be used with --study FILE.db"),
        (["--out", "front.xlsx"], "--out must be a file with the suffix .csv, got 'front.xlsx'"),
        (["--study", "s.csv"], "--study must be a study, with a suffix such as .db"),
        (["--points", "99999999999"], "error: "),
    ],
)  # fmt: skip
def test_mistakes(run, words, message):
    code, printed, err = run("solve", "chute", *words)
    assert code == 2
    assert message in err
    assert err.count("\n") == 1
    assert os.listdir() == ["models_of_solve.py"]


def test_shares_in_a_folder_are_one_study_to_every_command(run):
    words = ["solve", "chute", "--points", 64, "--study", "runs"]
    for part in ("1/3", "3/3"):
        code, printed, err = run(*words, "--share", part)
        assert (code, err) == (0, "")
    code, printed, _ = run("export", "runs", "--out", "part.csv")
    assert "of 64 test points are missing, " in printed
    assert "of 3 shares these lack points: 2" in printed
    assert "test points are missing" in run("rank", "runs")[1]
    assert run(*words, "--share", "2/3")[0] == 0
    code, printed, err = run("export", "runs", "--out", "all.csv")
    assert (code, err, "missing" in printed) == (0, "", False)
    assert run("solve", "chute", "--points", 64, "--study", "one.db")[0] == 0
    assert TestTable.read_csv("all.csv").equals(TestTable.read_study("one.db"))


def test_merged_studies_go_on(run):
    run("solve", "chute", "--points", 64, "--study", "runs", "--share", "1/2")
    run("solve", "chute", "--points", 64, "--study", "half.db")
    run("export", "half.db", "--out", "half.csv")
    code, printed, err = run("merge", "runs", "half.csv", "--out", "all.db")
    assert (code, err) == (0, "")
    assert "runs: 32 of 64 test points are missing" in printed
    assert "64 tests (64 ok, 0 infeasible, 0 failed) written to all.db" in printed
    printed = run("solve", "chute", "--points", 100, "--study", "all.db")[1]
    assert "100 tested, 64 of them from the study" in printed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["merge", "s.db", "--out", "s.db"], "--out must be the name of a new file, got 's.db'"),
        (["merge", "s.db", "other.db", "--out", "a.db"], "other.db does not fit those before it"),
        (["merge", "none.db", "--out", "a.db"], "none.db: No such file or directory"),
        (["merge", "--out", "a.db"], "Missing argument"),
        (["solve", "chute", "--share", "1/2"], "--share must be used with --study FOLDER"),
        (["solve", "chute", "--share", "3/2", "--study", "r"], "--share must be k/n"),
        (["solve", "chute", "--share", "1/2", "--study", "s.db"], "must be the name of a folder"),
        (["solve", "chute", "--share", "1/2", "--algorithm", "nsga3", "--study", "r"], "psi"),
    ],
)
def test_mistakes_of_shares_and_merge(run, words, message):
    run("solve", "chute", "--points", 8, "--study", "s.db")
    run("solve", "chute", "--points", 8, "--mu", 0.4, "--study", "other.db")
    code, _, err = run(*words)
    assert code == 2
    assert message in err
    assert err.count("\n") == 1
    assert not os.path.exists("a.db")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["absent.db", "--out", "t.csv"], "absent.db does not exist"),
        (["models_of_solve.py", "--out", "t.csv"], "must be a study file of pymoo-psi"),
        (["s.db"], "Missing option '--out'"),
        (["s.db", "--out", "t.txt"], "suffix .csv or .parquet"),
        (["s.csv", "--out", "s.csv"], "--out must be another file"),
    ],
)
def test_mistakes_of_export(run, words, message):
    code, _, err = run("export", *words)
    assert code == 2
    assert message in err
    assert err.count("\n") == 1


@pytest.fixture
def interruptible():
    """A job in the background ignores SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("more", [["--study", "s.db"], ["--algorithm", "nsga3"]])
def test_an_interruption_is_told_in_a_line(run, more, interruptible):
    code, printed, err = run("solve", "models:Stopped", "--points", 100, "--out", "o.csv", *more)
    assert (code, err) == (130, "pymoo-psi: interrupted\n")
    assert ("of 100 designs are in s.db; the same command continues" in printed) == ("s.db" in more)
    assert not [name for name in os.listdir() if name.endswith((".csv", ".tmp"))]


MAIN = """
import runpy, signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
runpy.run_module("pymoo_psi", run_name="__main__")
"""


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as POSIX has them")
@pytest.mark.parametrize(
    ("more", "how"),
    [
        (["--study", "s.db"], signal.SIGTERM),  # as clusters send it before they kill
        (["--jobs", "2"], signal.SIGINT),
    ],
)
def test_a_process_is_ended_by_a_signal_as_by_the_keyboard(run, tmp_path, more, how):
    words = ["solve", "models_of_solve:Slow", "--points", "100000", "--out", "o.csv", *more]
    process = subprocess.Popen(
        [sys.executable, "-c", MAIN, *words],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    while not (tmp_path / "started").exists() and process.poll() is None:
        time.sleep(0.05)
    time.sleep(0.2)
    os.killpg(process.pid, how)
    out, err = process.communicate()
    told = (130, "pymoo-psi: interrupted\n") if how == signal.SIGINT else (-how, "")
    assert (process.returncode, err) == told
    assert ("of 100000 designs are in s.db; the same command continues" in out) == ("s.db" in more)
    assert not [name for name in os.listdir() if name.endswith((".csv", ".tmp"))]
