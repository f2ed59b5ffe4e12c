"""A run joins a source of points, an executor and a store; its options are visible."""

import dataclasses
import inspect
from functools import partial

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    SurrogatePSI,
    investigate,
    read_table,
)
from pymoo_psi.algorithms import RunOptions
from tests.helpers.models import Sum
from tests.helpers.refusals import refused
from tests.helpers.steered import Steered


@pytest.mark.parametrize("n_before", [0, 8, 10])
def test_a_run_that_is_stopped_keeps_what_is_tested(study_file, n_before):
    """Also in a block none of whose tests was ready."""
    problem = Steered(study_file, {"action": "stop"}, at=n_before + 1)
    tested = minimize(problem, PSI(400, block_size=4, study=study_file)).algorithm.table
    assert len(tested) in (n_before // 4 * 4, n_before + 1)
    stored = read_table(study_file)
    assert len(stored) == n_before + 1
    assert stored.take(np.arange(len(tested))).equals(tested)
    assert len(minimize(problem, PSI(400, study=study_file)).algorithm.table) == 400


OF_EVERY_RUN = {field.name for field in dataclasses.fields(RunOptions)}
OF_EVERY_RUN -= {"repeat", "share", "block_size", "runner", "keep", "may_end_early"}


@pytest.mark.parametrize(
    ("owner", "run"),
    [(PSI, PSI), (SurrogatePSI, SurrogatePSI), (investigate, partial(investigate, Sum()))],
)
def test_options_of_every_run_are_described_and_misspelt_ones_refused(owner, run):
    described = inspect.getdoc(owner)
    # type checkers know names and values
    assert inspect.signature(owner).parameters["options"].annotation.startswith("Unpack")
    for name in OF_EVERY_RUN:
        assert f"    {name}: " in described
        message = f"{owner.__name__} got an unknown keyword argument .* did you mean '{name}'"
        refused(message, run, 8, error=TypeError, **{f"{name}_": None})
