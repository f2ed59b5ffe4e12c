"""A run joins a source of points, an executor and a store; its options are visible."""

import dataclasses
import inspect

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    Recorded,
    SurrogatePSI,
    investigate,
    read_table,
)
from pymoo_psi.algorithms import RunOptions
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


@pytest.mark.parametrize(
    ("owner", "missing"),
    [
        (PSI, {"repeat", "runner", "keep"}),
        (SurrogatePSI, {"repeat", "share", "block_size", "runner", "keep"}),
        (investigate, set()),
        (
            Recorded,
            {"repeat", "share", "block_size", "runner", "keep", "first", "sampling", "seed"}
            | {"limits", "formulation", "study", "more", "log", "requirements"},
        ),
    ],
)
def test_options_are_in_the_signature_with_their_defaults(owner, missing):
    shown = inspect.signature(owner).parameters
    for field in dataclasses.fields(RunOptions):
        if field.name not in missing:
            assert shown[field.name].default == field.default
