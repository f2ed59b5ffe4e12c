"""Tests of a noisy model: seeds, repeats in a study that a kill cannot spoil, and their means."""

import numpy as np
import pytest
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    ProcessRunner,
    ProgramProblem,
    Restricted,
    SurrogatePSI,
    investigate,
    read_table,
)
from tests.helpers.refusals import interrupted


def model(x, seed):
    noise = np.random.default_rng(seed).standard_normal(2)
    return np.array([x[0], (1 - x[0]) ** 2 + x[1]]) + 0.05 * noise


class Queue(ElementwiseProblem):
    """A noisy model, which notes its calls and may be interrupted."""

    noisy = True

    def __init__(self, n_calls=10_000, **kwargs):
        super().__init__(n_var=2, n_obj=2, xl=0.0, xu=1.0, **kwargs)
        self.n_calls = n_calls
        self.calls = []

    def fingerprint(self):
        return {}

    def _evaluate(self, x, out, *args, seed, **kwargs):
        if len(self.calls) == self.n_calls:
            raise KeyboardInterrupt
        self.calls.append((*x, seed))
        out["F"] = model(x, seed)


def test_tests_have_seeds_and_designs_the_means_of_tests():
    problem = Queue()
    table = investigate(problem, 16, repeat=3)
    calls = np.array(problem.calls)
    assert len(calls) == 48
    assert len(np.unique(calls[:, 2])) == 48
    for x, F in zip(table.X, table.F, strict=True):
        tests = [model(x, int(seed)) for *design, seed in calls if np.array_equal(design, x)]
        assert len(tests) == 3
        assert np.allclose(F, np.mean(tests, axis=0))
    assert (table["tests"] == 3).all()
    assert table.remarks[0].startswith("16 designs, 48 tests")
    others = Restricted(Queue(elementwise_runner=ProcessRunner(2)), {"x1": (0.0, 1.0)})
    assert investigate(others, 16, repeat=3).equals(table)


def test_a_study_makes_only_the_tests_that_are_missing(study_file):
    interrupted(investigate, Queue(12), 8, repeat=2, study=study_file)
    second, third = Queue(), Queue()
    investigate(second, 8, repeat=2, study=study_file)
    table = investigate(third, 12, repeat=3, study=study_file)
    assert 4 <= len(second.calls) <= 16
    assert len(third.calls) == 36 - 16
    assert np.array_equal(table.F, investigate(Queue(), 12, repeat=3).F)


class Die(ElementwiseProblem):
    """A noisy model of few designs, whose tests may fail."""

    noisy = True

    def __init__(self, share_of_failures=0.0):
        super().__init__(n_var=1, n_obj=2, xl=0, xu=4, vtype=int)
        self.share_of_failures = share_of_failures

    def fingerprint(self):
        return {}

    def _evaluate(self, x, out, *args, seed, **kwargs):
        if np.random.default_rng(seed).random() < self.share_of_failures:
            raise ValueError
        out["F"] = [x[0] + seed, -x[0]]


def test_failed_tests_of_designs_that_recur_are_made_again(study_file):
    table = minimize(Die(0.4), PSI(20, study=study_file)).algorithm.table
    n_failed = np.count_nonzero(table.status == "failed")
    algorithm = minimize(Die(), PSI(20, study=study_file, retry="failed")).algorithm
    assert algorithm.evaluator.n_eval == n_failed > 5
    assert algorithm.table.equals(minimize(Die(), PSI(20)).algorithm.table)


def test_each_test_of_a_noisy_model_counts_in_a_budget():
    assert minimize(Die(), PSI(1000), ("n_eval", 10)).algorithm.evaluator.n_eval == 10


def test_designs_that_are_not_run_stay_infeasible():
    rule = {"low": "x1 <= 0.5"}
    table = investigate(Queue(), 16, repeat=2, requirements=rule)
    assert np.array_equal(table.status, investigate(Queue(), 16, requirements=rule).status)
    assert "infeasible" in table.status
    assert not table.reasons


@pytest.fixture
def program(tmp_path):
    (tmp_path / "model").mkdir()
    (tmp_path / "model/queue.py").write_text(
        "import random, sys\n"
        "random.seed(int(sys.argv[2]))\n"
        "print('wait =', float(sys.argv[1]) + random.random())\n"
    )
    path = tmp_path / "queue.toml"
    path.write_text(
        'variables.x = {bounds = [1, 9], kind = "integer"}\n'
        'program = {command = "python queue.py {x} {seed}", template = "model", keep = "none"}\n'
        'outputs.wait = {file = "stdout.txt", pattern = "wait = (.*)"}\n'
        'outputs.cost = {expression = "10 - x"}\n'
        'objectives.minimize = ["wait", "cost"]\n'
    )
    return path


def test_a_seed_in_a_command_makes_a_program_noisy(program, said):
    problem = ProgramProblem.from_toml(program)
    assert problem.noisy
    assert problem.run({"x": 2}).outputs == problem.run({"x": 2, "seed": 1}).outputs
    assert problem.run({"x": 2, "seed": 2}).outputs != problem.run({"x": 2}).outputs
    assert "--noisy" in said("solve", "zdt1", "--repeat", "2", code=2)


def test_an_export_keeps_every_test_of_a_design(program, tmp_path, study_file, capsys, said):
    solve = ["solve", str(program), "--points", "2", "--repeat", "2", "--study"]
    said(*solve, study_file)
    for name in ("tests.csv", "copy.db"):
        said("export", study_file, "--out", tmp_path / name)
    assert len(read_table(tmp_path / "tests.csv")) == 4
    # nothing is left to test
    assert "This run: no new test." in said(*solve, tmp_path / "copy.db")


def test_surrogates_of_a_noisy_model_propose_new_designs(study_file):
    table = minimize(Queue(), SurrogatePSI(28)).algorithm.table
    assert len(np.unique(table.X, axis=0)) == 28
    interrupted(minimize, Queue(24), SurrogatePSI(28, study=study_file))
    again = minimize(Queue(), SurrogatePSI(28, study=study_file)).algorithm.table
    assert again.equals(table)
