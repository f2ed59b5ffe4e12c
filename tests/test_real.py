"""Models of engineers, two designs of each, where their programs are installed."""

import shutil
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

from benchmarks.real.__main__ import EXAMPLES, load
from pymoo_psi import ProgramProblem, investigate

INSTALLED = {
    "bracket": shutil.which("ccx") and shutil.which("gmsh"),
    "pipes": find_spec("wntr"),
    "charging": find_spec("pybamm"),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_two_designs_of_a_real_model(name, tmp_path):
    if not INSTALLED[name]:
        pytest.skip("its program is not installed")
    problem = load(name)
    if isinstance(problem, ProgramProblem):
        problem.program = replace(problem.program, folder=str(tmp_path))
    table = investigate(problem, 2, first=2)
    assert (table.status != "failed").any()
    assert np.isfinite(table.F[table.status != "failed"]).all()
    assert table.schema.units


def test_openmdao_runs_psi():
    pytest.importorskip("openmdao")
    from benchmarks.real.openmdao_beam import by_the_driver

    assert by_the_driver(8).schema.objectives == ("f1", "f2")
