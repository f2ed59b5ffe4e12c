"""What is printed in tests is read as through a pipe, which has no width."""

import os
import sys

import pytest

from pymoo_psi.cli import _experiments, main

os.environ.pop("COLUMNS", None)  # as pytest-xdist sets it

MODELS = '''
import math, os, pathlib, signal, time
import numpy as np
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Choice, Integer, Real

class Beam(Problem):
    """A cantilever of 2 m with a box section under 5 kN at its end, made of steel."""
    names = {"x1": "height", "x2": "width", "x3": "wall",
             "f1": "mass", "f2": "deflection", "g1": "overstress"}
    units = {"height": "mm", "mass": "kg", "deflection": "mm"}
    def __init__(self):
        super().__init__(n_var=3, n_obj=2, n_ieq_constr=1, xl=[60, 40, 2], xu=[200, 120, 10])
    def _evaluate(self, x, out, *args, **kwargs):
        height, width, wall = x.T
        area = height * width - (height - 2 * wall) * (width - 2 * wall)
        inertia = (width * height**3 - (width - 2 * wall) * (height - 2 * wall)**3) / 12
        stress = 5000 * 2000 * height / 2 / inertia
        out["F"] = np.column_stack([7.85e-6 * 2000 * area, 5000 * 2000**3 / (3 * 210e3 * inertia)])
        out["G"] = stress - 160
        out["stress"] = stress

class Root(ElementwiseProblem):
    """Fails for x1 < 0, in two ways."""
    def __init__(self):
        super().__init__(n_var=2, n_obj=2, xl=-1, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        if x[0] < -0.5:
            raise OSError("no licence")
        out["F"] = [math.sqrt(x[0]), 1 - x[1]]

class Mended(Root):
    def name(self):
        return "Root"
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [abs(x[0]), 1 - x[1]]

class Mixed(ElementwiseProblem):
    units = {"load": "kN"}
    def __init__(self):
        variables = {"a": Real(bounds=(0, 1)), "n": Integer(bounds=(1, 9)),
                     "steel": Choice(options=["S235", "S355", "S460"])}
        super().__init__(vars=variables, n_obj=2)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [x["a"] + x["n"], x["n"] - x["a"] + len(x["steel"])]
        if x["a"] > 0.5:
            out["load"] = x["a"]

class Sized(ElementwiseProblem):
    def __init__(self, length, *, n_ribs=2, **more):
        super().__init__(n_var=n_ribs, n_obj=2, xl=0, xu=length, **more)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [x.sum(), -x.sum()]

class Long(Sized):
    def __init__(self, steel=True, **more):
        super().__init__(100 if steel else 50, **more)

class Stopped(Root):
    """Ctrl-C is pressed in the seventh evaluation."""
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

class Hard(ElementwiseProblem):
    """Ends its process, and hangs."""
    def __init__(self):
        super().__init__(n_var=1, n_obj=2, xl=0, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        if x[0] == 0:
            os._exit(3)
        if x[0] == 0.5:
            time.sleep(600)
        out["F"] = [x[0], 1 - x[0]]

class Moves(Slow):
    def _evaluate(self, x, out, *args, **kwargs):
        pathlib.Path("was").touch()
        os.chdir("/")
        out["F"] = [x[0], 1 - x[0]]

def broken():
    raise RuntimeError("no licence")
'''


def joined(printed):
    """What is printed, without the breaks of its lines."""
    return " ".join(printed.split())


@pytest.fixture
def run(capsys, tmp_path, monkeypatch, in_folder):
    """Run the command in a folder with the models; return its code and what it prints."""
    (tmp_path / "models.py").write_text(MODELS, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))

    def command(*words):
        code = main([str(word) for word in words])
        printed = capsys.readouterr()
        assert "Traceback" not in printed.err
        return code, printed.out, printed.err

    yield command
    sys.modules.pop("models", None)


@pytest.fixture
def unplotted(monkeypatch):
    """No figures: drawing is tested with the plots, and takes most of the time."""
    monkeypatch.setattr(_experiments, "save_figures", lambda *args, **options: ())


@pytest.fixture
def said(run, said):
    """As everywhere, in the folder with the models."""
    return said
