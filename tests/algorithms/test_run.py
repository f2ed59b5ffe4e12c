"""A run joins a source of points, an executor and a store; its options are visible."""

import dataclasses
import inspect
import time

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    Recorded,
    SphereChute,
    SurrogatePSI,
    VectorizedSphereChute,
    investigate,
    read_table,
)
from pymoo_psi.algorithms import RunOptions
from pymoo_psi.study import Study

CHUTE = VectorizedSphereChute(0.4, model="rolling")


@pytest.mark.parametrize("n_before", [0, 8, 10])
def test_a_run_that_is_stopped_keeps_what_is_tested(study_file, n_before):
    """Also in a block none of whose tests was ready."""

    class Stopped(SphereChute):
        n_tested = 0

        def _evaluate(self, *args, **kwargs):
            super()._evaluate(*args, **kwargs)
            if self.n_tested == n_before:
                with Study(study_file).changes() as study:
                    study.steer({"name": "Bo", "action": "stop"})
                time.sleep(0.6)  # requests are read twice a second
            self.n_tested += 1

    tested = minimize(Stopped(0.4), PSI(400, block_size=4, study=study_file)).algorithm.table
    assert len(tested) in (n_before // 4 * 4, n_before + 1)
    stored = read_table(study_file)
    assert len(stored) == n_before + 1
    assert stored.take(np.arange(len(tested))).equals(tested)
    problem = Stopped(0.4)
    problem.n_tested = 400
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
