"""A study in stages: bounds, limits and outputs change, tests come from elsewhere; all is kept."""

import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

from pymoo_psi.files import read_table
from pymoo_psi.table import Limit
from tests.helpers.folders import write_files
from tests.helpers.studies import sql

SOLVER = """
import sys
width, height = map(float, sys.argv[1:])
with open({log!r}, "a") as log:
    print(width, height, file=log)
print("tip =", 1000 / (width * height**3))
print("stress =", 900 / (width * height**2))
"""
FILE = f"""
[variables]
width = {{bounds = [2, 4], unit = "mm"}}
height = {{bounds = [1, 9]}}
[program]
command = "{shlex.quote(sys.executable)} solver.py {{width}} {{height}}"
template = "model"
keep = "all"
[outputs]
tip = {{file = "stdout.txt", pattern = 'tip = (\\S+)'}}
mass = {{expression = "2*width*height", unit = "kg"}}
[objectives]
minimize = ["mass", "tip"]
[limits]
tip = "<= 4"
"""


SOLVE = ("solve", "beam.toml", "--study", "beam.db")


@pytest.fixture
def log(tmp_path, in_folder):
    log = tmp_path / "log"
    write_files("", {"model/solver.py": SOLVER.format(log=str(log)), "beam.toml": FILE})
    return log


def edit(old, new):
    text = Path("beam.toml").read_text()
    assert old in text
    Path("beam.toml").write_text(text.replace(old, new))


def add_stress(objectives='"mass", "stress"'):
    """An output more, which is an objective."""
    stress = "stress = {file = 'stdout.txt', pattern = 'stress = (\\S+)'}\n[objectives]"
    edit("[objectives]", stress)
    edit('"mass", "tip"', objectives)


def n_runs(log):
    lines = log.read_text().splitlines()
    assert len({*lines}) == len(lines), "a design ran twice"
    return len(lines)


def test_stages_share_one_study_and_no_design_runs_twice(log, said):
    said(*SOLVE, "--points", "8")
    said(*SOLVE, "--points", "4", "--bounds", "height=4:9")
    third = said(*SOLVE, "--points", "4", "--bounds", "height=5:9")
    assert "beam.db: 16 tests of 3 runs; " in third
    assert n_runs(log) == 16
    said(*SOLVE, "--points", "8")
    assert n_runs(log) == 16
    # a limit, an expression and a unit are edited: nothing runs
    edit("<= 4", "<= 2.5")
    edit("2*width*height", "3*width*height")
    assert "tip at most 2.5" in said(*SOLVE, "--points", "8")
    table = read_table("beam.db")
    assert table.limits == {"tip": Limit(upper=2.5)}
    assert table["mass"].tolist() == (3 * table["width"] * table["height"]).tolist()
    assert "tip at most 3" in said(*SOLVE, "--points", "8", "--limits", "tip<=3")
    # an output more: it is read from the folders that are kept
    add_stress()
    said(*SOLVE, "--points", "8")
    table = read_table("beam.db")
    assert table.schema.objectives == ("mass", "stress")
    assert table["stress"].tolist() == pytest.approx(
        (900 / (table["width"] * table["height"] ** 2)).tolist()
    )
    said(*SOLVE, "--points", "+4")
    assert n_runs(log) == len(table) + 4 == 20
    assert sql("beam.db", "SELECT count(*) FROM tests") == [(20,)]
    assert sql("beam.db", "SELECT count(*) FROM runs") == [(3,)]
    # an output that is read in another way is of another model
    edit("'tip = (\\S+)'", "'stress = (\\S+)'")
    assert "problem.parameters.outputs.tip.pattern" in said(*SOLVE, "--points", "8", code=2)


def test_an_output_of_no_folder_is_tested_on_request(log, said):
    edit('"all"', '"none"')
    said(*SOLVE, "--points", "4")
    add_stress()
    refusal = said(*SOLVE, "--points", "4", code=1)
    assert "--retry incomplete runs these tests again" in refusal
    assert n_runs(log) == 4
    mass = read_table("beam.db")["mass"]
    edit("mass = ", "weight = ")  # an output that is lost
    edit('"mass", "stress"', '"tip", "stress"')
    for _ in range(2):  # the second time nothing
        said(*SOLVE, "--points", "4", "--retry", "incomplete")
        assert len(log.read_text().splitlines()) == 8
    np.testing.assert_array_equal(read_table("beam.db")["mass"], mass)
    assert (read_table("beam.db")["stress"] > 0).all()


def test_outputs_are_read_from_folders_of_their_tests(log, said):
    """Folders of an older version of the program, with the same designs, are beside them."""
    said("solve", "beam.toml", "--study", "old.db", "--points", "4")
    solver = Path("model/solver.py").read_text()
    Path("model/solver.py").write_text(solver.replace("900 /", "700 /").replace("1000 /", "999 /"))
    solve = ("solve", "beam.toml", "--study", "new.db", "--points", "4")
    said(*solve)
    add_stress('"mass", "tip"')
    said(*solve)
    table = read_table("new.db")
    stress = 700 / (table["width"] * table["height"] ** 2)
    assert table["stress"].tolist() == pytest.approx(stress.tolist())
    edit("stress = {", "F = {")
    assert "force" in said(*solve, code=2)
