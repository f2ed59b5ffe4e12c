"""Workers are kept for the next call, and never answer by what has changed since."""

import importlib
import subprocess
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from pymoo.core.problem import ElementwiseProblem

from pymoo_psi import ExecutorRunner, JoblibRunner, investigate
from pymoo_psi.errors import EvaluationError
from tests.processes import posix
from tests.refusals import refused

pytestmark = posix

MODEL = """
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


FILES = {
    "model.py": MODEL,
    "helper.py": "FACTOR = 1",
    "late.py": "def offset(): return 0",
    "data.txt": "0",
}


class Folder:
    """A folder with the files of a model, which is the current one."""

    def __init__(self, path):
        self.path = path
        for name, text in FILES.items():
            self.write(name, text)
        self.model = importlib.import_module("model")

    def write(self, name, text):
        (self.path / name).write_text(textwrap.dedent(text))

    def tests(self, scale=1.0, **options):
        options = {"n_jobs": 2} | options
        return investigate(self.model.Model(scale), 600, **options)


@pytest.fixture
def folder(tmp_path, monkeypatch, in_folder):
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    yield Folder(tmp_path)
    for name in ("model", "helper", "late"):
        sys.modules.pop(name, None)


def processes(table):
    return {*table["process"].astype(int).tolist()}


def require(table, factor, offset=0.0):
    np.testing.assert_array_equal(table.F[:, 0], factor * table.X[:, 0] + offset)


def test_the_next_call_has_the_same_workers_and_a_new_function(folder):
    first = folder.tests()
    second = folder.tests(scale=3.0)
    assert processes(first) & processes(second)
    assert len(processes(first) | processes(second)) <= 2
    require(second, 3)


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
        table = folder.tests()
        require(table, factor, offset)
        assert not former & processes(table)
        former |= processes(table)


def test_a_module_that_is_reloaded_counts_with_a_runner_too(folder):
    runner = JoblibRunner(2)
    options = {"runner": runner, "n_jobs": 1}
    require(folder.tests(**options), 1)
    folder.write("helper.py", "FACTOR = 30")
    importlib.reload(sys.modules["helper"])
    importlib.reload(folder.model)
    here = folder.tests(n_jobs=1)
    assert here.F.tobytes() == folder.tests(**options).F.tobytes()
    require(here, 30)


def test_an_executor_has_new_code_too(folder):
    with ThreadPoolExecutor(2) as executor:
        options = {"runner": ExecutorRunner(executor), "n_jobs": 1}
        before = folder.tests(**options)
        assert processes(before) & processes(folder.tests(**options))
        folder.write("helper.py", "FACTOR = 4.5")
        require(folder.tests(**options), 4.5)


def test_environment_and_folder_are_those_of_the_call(folder, monkeypatch, tmp_path_factory):
    for wanted in (0, 5):
        monkeypatch.setenv("WANTED", str(wanted))
        assert set(folder.tests()["wanted"]) == {wanted}
    other = tmp_path_factory.mktemp("other")
    (other / "data.txt").write_text("7")
    monkeypatch.chdir(other)
    require(folder.tests(), 1, 7)


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


def test_a_class_of_the_main_script_has_new_workers(tmp_path):
    (tmp_path / "kept.py").write_text("calls = []")
    (tmp_path / "script.py").write_text(MAIN)
    command = [sys.executable, "script.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("1.0\n1.0\n", "")


def test_a_call_after_one_that_raised_gets_its_own_answers():
    """What a worker was left with when a design raised is no answer to the next call."""

    class Doubled(ElementwiseProblem):
        def _evaluate(self, x, out, *args, **kwargs):
            if x[0] == 3:
                raise ValueError("the mesh is torn")
            out["F"] = 2 * x

    runner = JoblibRunner(2, in_process=False)
    problem = Doubled(n_var=1, n_obj=1, xl=0, xu=1000, elementwise_runner=runner)
    for start in range(0, 400, 100):
        X = np.arange(start + 10.0, start + 50.0)[:, None]
        torn = X.copy()
        torn[5] = 3
        refused("the mesh is torn", problem.evaluate, torn, error=EvaluationError)
        for _ in range(2):
            X += 10
            np.testing.assert_array_equal(problem.evaluate(X), 2 * X)
