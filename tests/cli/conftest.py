"""What is printed in tests is read as through a pipe, which has no width."""

import math
import os
from functools import cache, partial

import pytest
import typer.main

from pymoo_psi.algorithms import refine
from pymoo_psi.cli import _output
from pymoo_psi.paper import _reproduction

os.environ.pop("COLUMNS", None)  # as pytest-xdist sets it
# To make the command from its functions takes longer than most of its runs; it has no state.
typer.main.get_command = cache(typer.main.get_command)
_output._EVERY = math.inf  # no lines in the log of a run that a busy machine makes long


@pytest.fixture
def coarse(monkeypatch):
    """Polish the paper's optima less: nine digits of them take most of the time of a run."""
    monkeypatch.setattr(_reproduction, "refine", partial(refine, tolerance=0.01))
