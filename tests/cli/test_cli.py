"""The command line: results on success, one clear line and exit code 2 on a mistake."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from pymoo.problems import get_problem

import pymoo_psi
from pymoo_psi import (
    PSI,
    FailureTolerant,
    PsiError,
    Recorded,
    SurrogatePSI,
    TestTable,
    VectorizedSphereChute,
    rank_of_efficiency,
)
from pymoo_psi.cli import _compare, _reproduce, main
from tests.table.exact_csv import EXACT


def run(capsys, *arguments):
    code = main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_reproduce_writes_and_prints_the_tables(capsys, monkeypatch, tmp_path, coarse):
    out, drawn = tmp_path / "new" / "folder", []
    # Their drawing is tested with the plots, and would take most of this test's time.
    monkeypatch.setattr(
        _reproduce,
        "save_figures",
        lambda result, folder, model, suffix: drawn.append((folder, model)),
    )
    code, printed, err = run(capsys, "reproduce", "--out", out, "--points", 64)
    assert code == 0
    assert err.splitlines()[0] == "done: mu = 0.2, rolling model"
    assert len(err.splitlines()) == 8  # six cases and two sets of figures, when there is no bar
    assert drawn == [(out, "full"), (out / "rolling", "rolling")]
    assert "the published tables follow from it" in printed
    assert printed.startswith("Not compared: the paper tests 4096 points, this run 64; ")
    assert "64 LPτ test points for each of 6 cases." in printed
    assert "Figures 3 to 8 are of mu = 0.4;" in printed
    assert "rolling model: 64 points are not enough. Twice as many would bring" in printed
    rows = pd.read_csv(out / "convergence.csv")
    assert len(rows) == 6 * 4  # three coefficients by two models; 8, 16, 32 and 64 points
    table_6_1 = pd.read_csv(out / "table_6_1.csv")
    last = rows[rows["tests"] == 64].merge(table_6_1, on=["model", "mu"])
    assert (last["optimum"] == last["test_point"]).all()
    assert (out / "convergence.png").exists()
    table = pd.read_csv(out / "table_6_1.csv")
    assert table.loc[table["model"] == "rolling", "paper_f1"].tolist() == [1.9829, 2.0454, 2.0454]
    assert list(pd.read_csv(out / "table_6_2.csv").columns) == list(table.columns)
    assert sorted(path.name for path in out.glob("*.csv")) == [
        "continuous_optima.csv",
        "convergence.csv",
        "table_6_1.csv",
        "table_6_2.csv",
    ]


@pytest.mark.parametrize(
    ("words", "told", "printed_rows"),
    [
        (["--mu", "0.3"], "Not compared: of such a chute nothing is published; the paper has", 0),
        (["--mu", "0.4", "--c", "0.5"], "Not compared: of such a chute nothing is published", 0),
        (["--mu", "0.4"], "Not compared: the paper's tables are of the rolling model and", 2),
        (["--mu", "0.4", "--model", "full"], "Not compared: the paper's tables are of", 1),
    ],
)
def test_another_chute_is_reproduced_and_compared_with_nothing(
    capsys, monkeypatch, tmp_path, coarse, words, told, printed_rows
):
    monkeypatch.setattr(_reproduce, "save_figures", lambda *args, **options: ())
    monkeypatch.setattr(_reproduce, "save_pages", lambda *args, **options: ())
    code, printed, _ = run(capsys, "reproduce", "--out", tmp_path, "--points", 32, *words)
    assert code == 0
    assert printed.startswith(told)
    assert ("this run mu = 0.4 with c = 0.5 and r = 0.1" in printed) == ("--c" in words)
    # The columns tell mu; the comment what else is not the paper's chute.
    remark = (tmp_path / "table_6_1.csv").read_text().partition("model,mu")[0].rstrip()
    assert remark == ("# chute with c = 0.5 and r = 0.1" if "--c" in words else "")
    table = pd.read_csv(tmp_path / "table_6_1.csv", comment="#")
    assert table["paper_f1"].notna().sum() == printed_rows
    assert printed.count("  printed  ") == printed_rows
    given = dict(zip(words[::2], words[1::2], strict=True))
    problem = VectorizedSphereChute(
        float(given["--mu"]), c=float(given.get("--c", 0.3193)), model=table["model"][0]
    )
    from pymoo.optimize import minimize

    result = minimize(problem, PSI(32))
    best = rank_of_efficiency(result.F, normalize=False).salukvadze
    np.testing.assert_allclose(table.loc[:0, "f1":"f4"], result.F[best], rtol=1e-12)


def test_solve_chute_by_psi(capsys, tmp_path):
    file = tmp_path / "front.csv"
    code, printed, err = run(
        capsys, "solve", "chute", "--mu", 0.4, "--model", "rolling", "--points", 256, "--out", file
    )
    assert (code, err) == (0, "")
    assert "VectorizedSphereChute by psi" in printed
    from pymoo.optimize import minimize

    result = minimize(VectorizedSphereChute(0.4, model="rolling"), PSI(256))
    written = pd.read_csv(file, **EXACT).set_index("test_point").loc[result.opt.get("test_point")]
    np.testing.assert_array_equal(written[["f1", "f2", "f3", "f4"]], result.F)
    np.testing.assert_array_equal(written[["x1", "x2"]], result.X)
    assert written["rank"].tolist() == rank_of_efficiency(result.F).rank.tolist()


def test_solve_by_nsga3_is_repeatable(capsys, tmp_path):
    files = [tmp_path / name for name in ("a.csv", "b.csv", "c.csv")]
    for file, seed in zip(files, (5, 5, 6), strict=True):
        code, printed, _ = run(
            capsys,
            "solve",
            "chute",
            "--model",
            "rolling",
            "--algorithm",
            "nsga3",
            "--points",
            200,
            "--seed",
            seed,
            "--out",
            file,
        )
        assert code == 0
        assert "by nsga3" in printed
    first, second, third = (file.read_text() for file in files)
    assert first == second != third


def test_solve_other_problems(capsys, tmp_path, monkeypatch):
    assert run(capsys, "solve", "bnh", "--points", 100)[0] == 0
    (tmp_path / "my_model.py").write_text(
        "from pymoo.problems.multi.bnh import BNH\nready = BNH()\nmake = BNH\nnumber = 3\n"
        "def broken():\n    raise RuntimeError('no licence')\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for attribute in ("ready", "make", "BNH"):
        assert run(capsys, "solve", f"my_model:{attribute}", "--points", 64)[0] == 0
    for attribute, reason in (
        ("number", "int"),
        ("broken", "no licence"),
        ("absent", "no attribute"),
    ):
        code, _, err = run(capsys, "solve", f"my_model:{attribute}")
        assert code == 2
        assert reason in err
        assert err.count("\n") == 1


def test_solve_in_processes(capsys):
    code, alone, _ = run(capsys, "solve", "chute", "--model", "rolling", "--points", 64)
    again, shared, _ = run(
        capsys, "solve", "chute", "--model", "rolling", "--points", 64, "--jobs", 2
    )
    assert code == again == 0
    assert alone.splitlines()[1:] == shared.splitlines()[1:]


def test_solve_continues_a_study(capsys, tmp_path):
    study = tmp_path / "chute.db"
    assert run(capsys, "solve", "chute", "--points", 100, "--study", study)[0] == 0
    code, printed, _ = run(capsys, "solve", "chute", "--points", 160, "--study", study)
    assert code == 0
    assert "160 tested, 100 of them from the study" in printed
    code, _, err = run(capsys, "solve", "chute", "--mu", 0.4, "--points", 160, "--study", study)
    assert code == 2
    assert "belongs to another problem" in err


def test_solve_by_surrogate_is_the_librarys_and_continues_a_study(capsys, tmp_path):
    study, file = tmp_path / "bnh.db", tmp_path / "front.csv"
    words = ["solve", "bnh", "--algorithm", "surrogate", "--seed", 3, "--limits", "f1=60"]
    words += ["--study", study, "--out", file, "--points"]
    assert run(capsys, *words, 28)[0] == 0
    code, printed, _ = run(capsys, *words, 36)
    assert code == 0
    assert "BNH by surrogate" in printed
    assert "36 tested, 28 of them from the study" in printed
    result = minimize(get_problem("bnh"), SurrogatePSI(36, limits={"f1": 60}), seed=3)
    written = pd.read_csv(file, **EXACT).set_index("test_point").loc[result.opt.get("test_point")]
    np.testing.assert_array_equal(written[["f1", "f2"]], result.F)
    code, _, err = run(capsys, "solve", "bnh", "--points", 36, "--study", study)
    assert (code, "then proposals in batches of 8, seed 3" in err) == (2, True)


def test_solve_by_nsga3_continues_a_study(capsys, tmp_path):
    words = ["solve", "osy", "--algorithm", "nsga3", "--points", 200]
    alone, study, shown = tmp_path / "alone.csv", tmp_path / "osy.db", tmp_path / "o.csv"
    assert run(capsys, *words, "--out", alone)[0] == 0
    problem = Recorded(FailureTolerant(get_problem("osy")), study=study)
    minimize(problem, NSGA2(20), ("n_gen", 1), seed=1)  # the seed gives the same first designs
    for stored in (20, 200):
        code, printed, _ = run(capsys, *words, "--study", study, "--out", shown)
        assert code == 0
        assert f"200 evaluated, {stored} of them from the study" in printed
    table = TestTable.read_study(study)
    assert len(table) == 200
    front, expected = pd.read_csv(shown, **EXACT), pd.read_csv(alone, **EXACT)
    pd.testing.assert_frame_equal(front.drop(columns="test_point"), expected, check_exact=True)
    rows = table.rows(front["test_point"].to_numpy() - 1)
    np.testing.assert_array_equal(rows.X, front[list(table.layout.variables)])
    assert run(capsys, "export", study, "--out", tmp_path / "all.csv")[0] == 0
    code, _, err = run(capsys, "solve", "osy", "--points", 64, "--study", study)
    assert (code, "an algorithm (Recorded)" in err) == (2, True)


def test_a_comparison_with_surrogates_says_first_that_it_takes_long(capsys, monkeypatch):
    def stopped(*arguments, **options):
        raise PsiError("stopped")

    monkeypatch.setattr(_compare, "compare", stopped)
    words = ["compare", "bnh", "--evaluations", "32,64", "--seeds", 3, "--algorithms"]
    code, printed, _ = run(capsys, *words, "psi,surrogate")
    assert code == 2
    assert printed.startswith("6 runs of surrogate: ")
    assert "Fewer --evaluations or --seeds shorten it." in printed
    assert run(capsys, *words, "psi,nsga3")[1] == ""


def test_a_model_that_hangs_or_dies_fails_alone(capsys, tmp_path, monkeypatch):
    """With --jobs or --timeout no design is evaluated in the process of the command."""
    (tmp_path / "hard_model.py").write_text(
        "import os, time\n"
        "from pymoo.core.problem import ElementwiseProblem\n"
        "class Hard(ElementwiseProblem):\n"
        "    def __init__(self):\n"
        "        super().__init__(n_var=1, n_obj=2, xl=0, xu=1)\n"
        "    def _evaluate(self, x, out, *args, **kwargs):\n"
        "        if x[0] == 0:\n"
        "            os._exit(3)\n"
        "        if x[0] == 0.5:\n"
        "            time.sleep(600)\n"
        "        out['F'] = [x[0], 1 - x[0]]\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    code, printed, err = run(
        capsys, "solve", "hard_model:Hard", "--points", 16, "--jobs", 2, "--timeout", 5,
        "--study", "hard.db", "--study-key", "v1",
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert "16 tested, 2 failed" in printed
    code, _, err = run(
        capsys,
        "solve",
        "hard_model:Hard",
        "--points",
        16,
        "--study",
        "hard.db",
        "--study-key",
        "v2",
    )
    assert code == 2
    assert "key" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["solve", "chute", "--out", "absent/x.csv"], "absent/x.csv: No such file or directory"),
        (["solve", "chute", "--study", "pyproject.toml"], "pyproject.toml"),
        (["solve", "chute", "--mu", "-1"], "mu must be a positive number, got -1.0"),
        (["solve", "chute", "--mu", "x"], "--mu must be a finite number, got 'x'"),
        (
            ["solve", "chute", "--model", "ful"],
            "--model must be one of 'full', 'rolling', got 'ful'; did you mean 'full'?",
        ),
        (["solve", "chute", "--points", "0"], "error: --points must be an integer >= 1, got 0"),
        (
            ["solve", "chute", "--algorithm", "nsga3", "--points", "0"],
            "error: --points must be an integer >= 1",
        ),
        (["solve", "zdt99"], "PROBLEM must be 'chute', the name of a pymoo test problem"),
        (
            ["solve", "zdt1", "--mu", "0.3"],
            "No such option: --mu; arguments of zdt1: --n-var",
        ),
        (["solve", "no_such_module:thing"], "No module named 'no_such_module'"),
        (
            ["solve", "zdt1", "--jobs", "0"],
            "--jobs must be 1 or more, or -1 for one per core, got 0",
        ),
        (
            ["solve", "chute", "--points", "64", "--out", "absent/folder/x.csv"],
            "No such file or directory",
        ),
        (["solve"], "Missing argument"),
        (["solv"], "No such command 'solv'"),
        (["optimise"], "No such command 'optimise'; there are reproduce, solve, compare"),
        (["reproduce", "--points", "-4", "--out", "."], "--points must be an integer >= 1, got -4"),
        (["reproduce", "--pionts", "4"], "No such option: --pionts"),
        (["reproduce", "--out", "pyproject.toml/x"], "pyproject.toml"),
    ],
)
def test_mistakes(capsys, arguments, message):
    code, printed, err = run(capsys, *arguments)
    assert code == 2
    assert message in err
    assert err.startswith("pymoo-psi: error: ")
    assert err.count("\n") == 1
    assert "Traceback" not in printed + err


def test_python_m_and_version():
    done = subprocess.run(
        [sys.executable, "-m", "pymoo_psi", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"pymoo-psi {pymoo_psi.__version__}\n"


@pytest.mark.parametrize("words", [[], ["-h"], ["--help"]])
def test_help(capsys, words):
    code, printed, err = run(capsys, *words)
    assert (code, err) == (0, "")
    assert "Usage: pymoo-psi [OPTIONS] COMMAND" in printed
    assert run(capsys, "rank", "-h")[1] == run(capsys, "rank", "--help")[1]
