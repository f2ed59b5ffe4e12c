"""Workers are kept for the next call, and never answer by what has changed since."""

import importlib
import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from pymoo_psi import ProcessRunner, investigate
from pymoo_psi.errors import EvaluationError
from tests.helpers.draws import rarely
from tests.helpers.folders import write_files
from tests.helpers.processes import posix
from tests.helpers.refusals import refused, warned

pytestmark = posix

MODEL = """\
"Figures of it are in plots."

import hashlib, os
from functools import cache
from pathlib import Path
from pymoo.core.problem import Problem
from helper import FACTOR

class Model(Problem):
    def __init__(self, scale=1.0):
        super().__init__(n_var=2, n_obj=1, xl=0, xu=1)
        self.scale = scale

    def fingerprint(self):
        return {"data": hashlib.sha256(Path("data.txt").read_bytes()).hexdigest()}

    def _evaluate(self, X, out, *args, **kwargs):
        from late import offset
        out["F"] = FACTOR * self.scale * X[:, :1] + data() + offset()
        out["process"] = [os.getpid()] * len(X)
        out["wanted"] = [float(os.environ.get("WANTED", 0))] * len(X)

@cache
def data():
    return float(Path("data.txt").read_text())
"""


class Folder:
    """A folder with the files of a model, which is the current one."""

    def __init__(self, path):
        self.path = path
        files = {
            "model.py": MODEL,
            "helper.py": "FACTOR = 1",
            "late.py": "def offset(): return 0",
            "data.txt": "0",
        }
        write_files(path, files)
        self.model = importlib.import_module("model")

    def write(self, name, text):
        (self.path / name).write_text(textwrap.dedent(text))

    def reload(self):
        importlib.reload(sys.modules["helper"])
        importlib.reload(self.model)

    def tests(self, scale=1.0, n_jobs=2, **options):
        return investigate(self.model.Model(scale), 600, n_jobs=n_jobs, **options)


@pytest.fixture
def folder(tmp_path, monkeypatch, in_folder):
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    yield Folder(tmp_path)
    for name in ("model", "helper", "late", "plots"):
        sys.modules.pop(name, None)


def processes(table):
    return {*table["process"].astype(int).tolist()}


def require(table, factor, offset=0.0):
    np.testing.assert_array_equal(table.F[:, 0], factor * table.X[:, 0] + offset)


def test_the_next_call_has_the_same_workers(folder, monkeypatch):
    first = processes(folder.tests())
    second = folder.tests(scale=3.0)
    assert first & processes(second)
    assert len(first | processes(second)) <= 2
    require(second, 3)
    # in another folder and environment, which are those of the call
    write_files(folder.path, {"other/data.txt": "7"})
    monkeypatch.chdir("other")
    monkeypatch.setenv("WANTED", "5")
    table = folder.tests()
    assert set(table["wanted"]) == {5}
    require(table, 1, 7)


@pytest.mark.slow
def test_a_file_that_changes_between_two_calls_counts(folder):
    """A module, one that it imports, one imported later, and data that the key depends on."""
    former = processes(folder.tests())
    for name, text, factor, offset in (
        ("helper.py", "FACTOR = 2.0", 2, 0),
        ("late.py", "def offset(): return 1.0", 2, 1),
        ("data.txt", "1.0", 2, 2),
        ("model.py", MODEL.replace("FACTOR *", "2 * FACTOR *"), 4, 2),
    ):
        folder.write(name, text)
        folder.reload()
        table = folder.tests()
        require(table, factor, offset)
        assert not former & processes(table)
        former |= processes(table)


CHANGED = "model.py has changed since it was imported; reload it"


@pytest.mark.parametrize("n_jobs", [1, *rarely(2)])
def test_no_run_begins_with_a_file_that_has_changed(folder, n_jobs):
    """Neither after a call, nor between the import and the first call; in a study too."""
    problem = folder.model.Model()
    options = {"n_jobs": n_jobs, "study": "model.db"}
    folder.write("plots.py", "COLOUR = 1")
    importlib.import_module("plots")
    folder.write("plots.py", "COLOUR = 2")  # that the model names in its docstring alone
    folder.write("model.py", MODEL)  # as it was
    require(folder.tests(**options), 1)
    folder.write("model.py", MODEL + "# edited")
    refused(CHANGED, folder.tests, **options)
    refused(CHANGED, investigate, problem, 600, **options)
    folder.reload()
    refused(CHANGED, investigate, problem, 600)  # it has the former class
    warned("^module model changed since tests of", folder.tests, **options)
    require(folder.tests(**options), 1)  # which is said once


def test_a_study_with_a_key_leaves_edits_to_it(folder):
    require(folder.tests(study="model.db", study_key="1"), 1)
    folder.write("model.py", MODEL.replace("FACTOR *", "2 * FACTOR *"))
    folder.reload()
    require(folder.tests(study="model.db", study_key="1"), 1)
    require(folder.tests(study="new.db", study_key="2"), 2)


EDITED = """
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from pymoo_psi import ExecutorRunner, ProcessRunner, PSI, investigate, nsga3
from pymoo_psi.errors import PsiError

from beam import Beam

executor = ThreadPoolExecutor(2)

def beam(runner):
    if runner is not None:
        return Beam(elementwise_runner=runner)
    return Beam()

def say():
    for runner in [None, ProcessRunner(2), ExecutorRunner(executor)]:
        for run in [
            lambda: investigate(beam(runner), 8).F,
            lambda: minimize(beam(runner), PSI(8)).F,
            lambda: nsga3(beam(runner), 8).F,
        ]:
            try:
                print(*{*run()[:, 0]})
            except PsiError as error:
                print("helper.py has changed" in str(error))

say()
Path("helper.py").write_text("FACTOR = 2.0")
say()
"""

BEAM = """
from pymoo.core.problem import ElementwiseProblem

import helper

class Beam(ElementwiseProblem):
    def __init__(self, **options):
        super().__init__(n_var=1, n_obj=2, xl=0, xu=1, **options)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [helper.FACTOR, x[0]]
"""


def ran(folder, script, **modules):
    """Run a script beside modules in a process of its own; return what it prints, errors too."""
    texts = {"script": script, **modules}
    write_files(folder, {f"{name}.py": text for name, text in texts.items()})
    return subprocess.run(
        [sys.executable, "script.py"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=True,
    ).stdout


@pytest.mark.slow
def test_every_runner_refuses_a_changed_file_alike(tmp_path):
    expected = "1.0\n" * 9 + "True\n" * 9
    assert ran(tmp_path, EDITED, helper="FACTOR = 1.0", beam=BEAM) == expected


MIXED = """
from pathlib import Path
from pymoo.core.problem import ElementwiseProblem
from pymoo_psi import ProcessRunner, investigate
from pymoo_psi.errors import WorkerError

import helper

class Beam(ElementwiseProblem):
    def __init__(self, **options):
        super().__init__(n_var=1, n_obj=1, xl=0, xu=1, **options)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = helper.FACTOR

Path("helper.py").write_text("FACTOR = 2.0")
try:
    investigate(Beam(elementwise_runner=ProcessRunner(2)), 8)
except WorkerError as error:
    print(error)
"""


@pytest.mark.slow
def test_a_worker_with_another_version_is_refused(tmp_path):
    """The class of a script is sent; the module that it uses is imported by the worker."""
    assert "a worker process has another version of helper.py" in ran(
        tmp_path, MIXED, helper="FACTOR = 1.0"
    )


LATE = """
import time
from pathlib import Path
from pymoo.core.problem import ElementwiseProblem
from pymoo_psi import RUNNER, investigate
from pymoo_psi.errors import WorkerError

class Beam(ElementwiseProblem):
    def __init__(self, **options):
        super().__init__(n_var=1, n_obj=1, xl=0, xu=1, **options)

    def _evaluate(self, x, out, *args, **kwargs):
        if x[0] == 0:
            import helper
            wait_for("begun")
            Path("helper.py").write_text("FACTOR = 2.00")
            Path("edited").touch()
        else:
            Path("begun").touch()
            wait_for("edited")
            import helper
        out["F"] = helper.FACTOR

def wait_for(name):
    while not Path(name).exists():
        time.sleep(0.01)

try:
    investigate(Beam(elementwise_runner=RUNNER(2)), 8)
except WorkerError as error:
    print(error)
"""


@pytest.mark.slow
@pytest.mark.parametrize("runner", ["ProcessRunner", "JoblibRunner"])
def test_workers_with_two_versions_are_refused(tmp_path, runner):
    """One imports a module before it is edited, another one after; the script never does."""
    assert ran(tmp_path, LATE.replace("RUNNER", runner), helper="FACTOR = 1.0").startswith(
        "helper has changed during the run"
    )


def test_libraries_of_workers_share_the_cores(monkeypatch):
    """Unless the user limits them."""
    expected = {f"{name}_NUM_THREADS": "4" for name in ("OMP", "OPENBLAS", "BLIS", "NUMEXPR")}
    expected |= {"VECLIB_MAXIMUM_THREADS": "4", "LOKY_MAX_CPU_COUNT": "4", "MKL_NUM_THREADS": "3"}
    for name in expected:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MKL_NUM_THREADS", "3")
    monkeypatch.setattr(os, "cpu_count", lambda: 9)
    limits = ProcessRunner(2)(lambda x: {name: os.environ[name] for name in expected}, [1])
    assert limits == [expected]


MAIN = """
from pymoo.core.problem import Problem
from pymoo_psi import investigate

class Model(Problem):
    def _evaluate(self, X, out, *args, **kwargs):
        import kept
        kept.calls.append(1)
        out["F"] = X[:, :1]
        out["calls"] = [len(kept.calls)] * len(X)

for _ in range(2):
    table = investigate(Model(n_var=1, n_obj=1, xl=0, xu=1), 64, n_jobs=2)
    print(table["calls"].max())
"""


@pytest.mark.slow
def test_a_class_of_the_main_script_has_new_workers(tmp_path):
    assert ran(tmp_path, MAIN, kept="calls = []") == "1.0\n1.0\n"


def test_a_call_after_an_error_gets_own_answers():
    """What a worker was left with when a design raised is no answer to the next call."""

    def doubled(x):
        if x == 3:
            raise ValueError("the mesh is torn")
        return {"F": 2 * x}

    runner = ProcessRunner(2)
    refused("the mesh is torn", runner, doubled, [8, 9, 3, 7, 6, 5], error=EvaluationError)
    assert runner(doubled, range(10, 22)) == [{"F": 2 * x} for x in range(10, 22)]
