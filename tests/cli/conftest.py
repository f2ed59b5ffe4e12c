"""What is printed in tests is read as through a pipe, which has no width."""

import math
import os
from functools import partial

import pytest

from pymoo_psi.algorithms import refine
from pymoo_psi.cli import _output
from pymoo_psi.paper import _reproduction

os.environ.pop("COLUMNS", None)  # as pytest-xdist sets it
_output._EVERY = math.inf  # no lines in the log of a run that a busy machine makes long


@pytest.fixture
def coarse(monkeypatch):
    """Polish the paper's optima less: nine digits of them take most of the time of a run."""
    monkeypatch.setattr(_reproduction, "refine", partial(refine, tolerance=0.01))
