"""A run joins a source of points, an executor and a store; its options are visible."""

import dataclasses
import inspect

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    JoblibRunner,
    Recorded,
    SphereChute,
    SurrogatePSI,
    TestTable,
    VectorizedSphereChute,
    investigate,
    read_table,
)
from pymoo_psi.algorithms import PointAlgorithm, Points, RunOptions, Source, run_of_sequence
from pymoo_psi.study import Study

CHUTE = VectorizedSphereChute(0.4, model="rolling")


class Halving(Source):
    """Points of a sequence, then, one by one, half way from the best test to the middle."""

    def __init__(self, sequence, n_points):
        self.sequence, self.n_points = sequence, n_points
        self.given, self.tests = Points.none(), TestTable.empty()

    @property
    def n_left(self):
        return self.n_points - len(self.given)

    def tell(self, tests):
        self.tests = self.tests.extended(tests)

    def ask(self, count):
        points = Points.none()
        if len(self.given) == 0:
            points = dataclasses.replace(self.sequence, coordinates=self.sequence.cube_points)
        elif len(self.tests) == len(self.given):
            row = self.tests.numbers[self.tests.F[:, 0].argmin()] - 1
            unit = (self.given.cube_points[row] + 0.5) / 2
            number = len(self.given) + 1
            points = Points(np.array([number]), 2, unit[None])
        self.given = self.given.joined(points)
        return points


class HalvingPSI(PointAlgorithm):
    def __init__(self, n_points, options):
        super().__init__(n_points, options, None)

    def begin(self, options):
        run = run_of_sequence(self.problem, 8, options)
        run.source = Halving(run.source.ask(8), self.n_points)
        return run


@pytest.mark.parametrize("runner", [None, JoblibRunner(2, in_process=False)])
def test_a_source_of_points_is_all_that_a_new_method_needs(tmp_path, runner):
    problem = CHUTE if runner is None else SphereChute(0.4, elementwise_runner=runner)
    tables = []
    for n in (10, 12):
        algorithm = HalvingPSI(n, RunOptions(study=tmp_path / "s.db"))
        tables.append(minimize(problem, algorithm).algorithm.table)
    assert tables[1].take(np.arange(10)).equals(tables[0])
    assert read_table(tmp_path / "s.db").equals(tables[1])
    assert tables[1].numbers.tolist() == list(range(1, 13))


@pytest.mark.parametrize("n_before", [0, 8, 10])
def test_a_run_that_is_stopped_keeps_what_is_tested(study_file, monkeypatch, n_before):
    """Also in a block none of whose tests was ready."""
    monkeypatch.setattr("pymoo_psi.algorithms._store._SECONDS", 0.0)

    class Stopped(SphereChute):
        n_tested = 0

        def _evaluate(self, *args, **kwargs):
            super()._evaluate(*args, **kwargs)
            if self.n_tested == n_before:
                with Study(study_file).changes() as study:
                    study.steer({"name": "Bo", "action": "stop"})
            self.n_tested += 1

    tested = minimize(Stopped(0.4), PSI(400, block_size=4, study=study_file)).algorithm.table
    assert len(tested) in (n_before // 4 * 4, n_before + 1)
    stored = read_table(study_file)
    assert len(stored) == n_before + 1
    assert stored.take(np.arange(len(tested))).equals(tested)
    problem = Stopped(0.4)
    problem.n_tested = 400
    assert len(minimize(problem, PSI(400, study=study_file)).algorithm.table) == 400


@pytest.mark.parametrize("owner", [PSI, SurrogatePSI, investigate, Recorded])
def test_options_are_in_the_signature_with_their_defaults(owner):
    parameters = inspect.signature(owner).parameters
    assert all(p.kind != p.VAR_KEYWORD for p in parameters.values())
    shown = {name: p.default for name, p in parameters.items()}
    for field in dataclasses.fields(RunOptions):
        if field.name in shown and (owner, field.name) != (Recorded, "study"):
            assert shown[field.name] == field.default
    missing = {
        PSI: {"repeat", "runner", "keep"},
        SurrogatePSI: {"repeat", "share", "block_size", "runner", "keep"},
        investigate: set(),
        Recorded: {field.name for field in dataclasses.fields(RunOptions)},
    }
    assert {field.name for field in dataclasses.fields(RunOptions)} - missing[owner] <= {*shown}
