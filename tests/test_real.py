"""Models of engineers, two designs of each, where their programs are installed."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.real.__main__ import EXAMPLES, load
from pymoo_psi import ProgramProblem, investigate

NEEDED = {"bracket": ("ccx", "gmsh"), "pipes": ("wntr",), "charging": ("pybamm",)}


@pytest.mark.parametrize("name", EXAMPLES)
def test_two_designs_of_a_real_model(name, tmp_path):
    for needed in NEEDED[name]:
        if name != "bracket":
            pytest.importorskip(needed)
        elif shutil.which(needed) is None:
            pytest.skip(f"{needed} is not installed")
    problem = load(name)
    if isinstance(problem, ProgramProblem):
        problem.program = replace(problem.program, folder=str(tmp_path))
    table = investigate(problem, 2, first=2)
    assert (table.status != "failed").any()
    assert np.isfinite(table.F[table.status != "failed"]).all()
    assert table.layout.units


def test_openmdao_runs_psi():
    pytest.importorskip("openmdao")
    from benchmarks.real.openmdao_beam import by_the_driver

    assert by_the_driver(8).layout.objectives == ("f1", "f2")
