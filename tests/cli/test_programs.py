"""A program's TOML file on the command line: written, tried, solved, ranked."""

import shlex
import sys
from pathlib import Path

import pytest

from pymoo_psi import ProgramProblem
from tests.helpers.folders import write_files

SOLVER = """
import sys
width, height = (float(line.split("=")[1]) for line in open("beam.inp"))
print("tip =", 1 / (width * height**3))
if width * height > 30:
    sys.exit("too heavy")
"""
FILE = f"""
[variables]
width = {{bounds = [2, 4], unit = "mm"}}
height = {{bounds = [1, 9], scale = "log"}}
[program]
command = "{shlex.quote(sys.executable)} solver.py"
template = "model"
files = ["beam.inp"]
[outputs]
tip = {{file = "stdout.txt", pattern = 'tip = (\\S+)'}}
mass = {{expression = "2*width*height", unit = "kg"}}
area = {{expression = "width*height", unit = "mm2"}}
[objectives]
minimize = ["mass", "tip"]
[limits]
mass = "<= 40"
[requirements]
slender = "height <= 2*width"
"""


@pytest.fixture
def beam(run):
    """The file of a program, and its template."""
    template = "width={width}\r\nheight={height:.6g}\r\n"
    write_files("", {"model/solver.py": SOLVER, "model/beam.inp": template, "beam.toml": FILE})


def test_the_example_is_a_file_to_edit(said):
    said("solve", "--new", "bracket.toml")
    text = Path("bracket.toml").read_text("utf-8")
    text = text.replace("ccx -i beam", f"{sys.executable} -V")
    write_files("", {"model/beam.inp": "{width} {height}", "bracket.toml": text})
    ProgramProblem.from_toml("bracket.toml")


def test_a_program_is_tried_solved_and_ranked(beam, said):
    printed = said("solve", "beam.toml", "--try", "--algorithm", "surrogate", "--limits", "mass<=9")
    assert '--limits "mass<=9" \\\n    --study beam.db\n' in printed
    folder = Path(printed.partition("Folder: ")[2].splitlines()[0])
    assert "Filled: beam.inp, line 1: width=3.0\nFilled: beam.inp, line 2: height=3\n" in printed
    assert (folder / "beam.inp").read_bytes().startswith(b"width=3.0\r\nheight=3")
    printed = said("solve", "beam.toml", "--points", 8, "--jobs", 2, "--study", "b.db")
    limits = "(slender: height <= 2*width, mass at most 40 kg)"
    assert f"within the limits {limits}" in " ".join(printed.split())
    assert "mass [kg]" in said("rank", "b.db", "--long")
    refused = said("rank", "beam.toml", code=2)
    assert "run pymoo-psi solve beam.toml --study beam.db, and read beam.db" in refused
    # the first designs violate a requirement, so that nothing is known of outputs yet
    said("solve", "beam.toml", "--points", 8, "--limits", "area<=12")


def test_what_is_wrong_is_said_by_try(beam, said):
    more = "[outputs]\nload = {file = 'load.txt', key = 'F'}\n"
    text = FILE.replace("tip = (", "Tip = (").replace("<= 40", "<= 4").replace("[outputs]", more)
    Path("beam.toml").write_text(text)
    printed = said("solve", "beam.toml", "--try", code=1)
    assert "Wrong: output load: the program left no file load.txt\n" in printed
    assert "Wrong: output tip: stdout.txt has no match of 'Tip = (\\S+)'\n" in printed
