"""The notebook among the guides: a kernel runs it from top to bottom and shows what it shows."""

import json
import os
import shutil
import sys
from pathlib import Path

import pytest

import pymoo_psi
from tests.helpers.processes import printed_by

GUIDE = Path(pymoo_psi.__file__).parent / "guide" / "notebook.ipynb"


def outputs(path):
    """The outputs of each cell of code."""
    cells = json.loads(path.read_text("utf-8"))["cells"]
    return [cell["outputs"] for cell in cells if cell["cell_type"] == "code"]


def text(output):
    return "".join(output.get("text") or output["data"]["text/plain"])


@pytest.mark.slow
def test_the_notebook_runs_and_prints_what_is_in_it(tmp_path):
    run = Path(shutil.copy(GUIDE, tmp_path))  # it writes files beside itself
    printed_by(
        *(sys.executable, "-m", "jupyter", "execute", "--inplace", run),
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    found, printed = outputs(run), outputs(GUIDE)
    assert [[text(o) for o in cell] for cell in found] == [[text(o) for o in c] for c in printed]
    shown = {kind for cell in found for output in cell for kind in output.get("data", ())}
    assert shown == {"text/plain", "text/html", "image/png"}
    assert "<iframe" in "".join(found[5][0]["data"]["text/html"])
