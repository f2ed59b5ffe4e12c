"""Tests of a noisy model: seeds, repeats in a study that a kill cannot spoil, and their means."""

import numpy as np
import pytest
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
from tests.helpers.folders import write_files
from tests.helpers.models import Model, asked_and_told
from tests.helpers.refusals import interrupted, refused


def waiting(x, seed):
    noise = np.random.default_rng(seed).standard_normal(2)
    return {"F": np.array([x[0], (1 - x[0]) ** 2 + x[1]]) + 0.05 * noise}


def queue(**options):
    return Model(waiting, n_var=2, noisy=True, **options)


def test_tests_have_seeds_and_designs_the_means_of_tests():
    problem = queue()
    table = investigate(problem, 16, repeat=3)
    assert len({seed for _, seed in problem.calls}) == len(problem.calls) == 48
    for x, F in zip(table.X, table.F, strict=True):
        tests = [waiting(*call)["F"] for call in problem.calls if (call[0] == x).all()]
        assert len(tests) == 3
        assert np.allclose(F, np.mean(tests, axis=0))
    assert (table["tests"] == 3).all()
    assert table.remarks[0].startswith("16 designs, 48 tests")
    others = Restricted(queue(elementwise_runner=ProcessRunner(2)), {"x1": (0.0, 1.0)})
    assert investigate(others, 16, repeat=3).equals(table)


def test_a_study_makes_only_the_tests_that_are_missing(study_file):
    interrupted(investigate, queue(stop=12), 8, repeat=2, study=study_file)
    second, third = queue(), queue()
    investigate(second, 8, repeat=2, study=study_file)
    table = investigate(third, 12, repeat=3, study=study_file)
    assert 4 <= len(second.calls) <= 16
    assert len(third.calls) == 36 - 16
    assert np.array_equal(table.F, investigate(queue(), 12, repeat=3).F)


def die(share_of_failures=0.0):
    """A noisy model of few designs, whose tests may fail."""

    def thrown(x, seed):
        if np.random.default_rng(seed).random() < share_of_failures:
            raise ValueError
        return {"F": [x[0] + seed, -x[0]]}

    return Model(thrown, n_var=1, xu=4, vtype=int, noisy=True)


def test_failed_tests_of_designs_that_recur_are_made_again(study_file):
    table = minimize(die(0.4), PSI(20, study=study_file)).algorithm.table
    algorithm = minimize(die(), PSI(20, study=study_file, retry="failed")).algorithm
    assert algorithm.evaluator.n_eval == (table.status == "failed").sum() > 5
    assert algorithm.table.equals(minimize(die(), PSI(20)).algorithm.table)


def test_a_design_is_tested_at_least_once():
    refused("repeat must be an integer >= 1, got 0", investigate, die(), 4, repeat=0)


@pytest.mark.parametrize("options", [{}, {"requirements": ["x1 + x2 >= 0.5"]}])
def test_asking_and_telling_gives_the_model_the_same_seeds(options):
    within = {"x1": (0.2, 1.0)}
    problem = Restricted(queue(), within)
    algorithm = asked_and_told(problem, PSI(20, block_size=7, **options))
    assert algorithm.table.equals(investigate(Restricted(queue(), within), 20, **options))


def test_designs_that_are_not_run_stay_infeasible():
    table = investigate(queue(), 16, repeat=2, requirements=["x1 <= 0.5"])
    assert table.status.tolist() == ["infeasible" if x > 0.5 else "ok" for x in table["x1"]]
    assert not table.reasons


@pytest.fixture
def program(tmp_path):
    files = {
        "model/queue.py": "import random, sys\n"
        "random.seed(int(sys.argv[2]))\n"
        "print('wait =', float(sys.argv[1]) + random.random())\n",
        "queue.toml": 'variables.x = {bounds = [1, 9], kind = "integer"}\n'
        'program = {command = "python queue.py {x} {seed}", template = "model", keep = "none"}\n'
        'outputs.wait = {file = "stdout.txt", pattern = "wait = (.*)"}\n'
        'outputs.cost = {expression = "10 - x"}\n'
        'objectives.minimize = ["wait", "cost"]\n',
    }
    write_files(tmp_path, files)
    return tmp_path / "queue.toml"


def test_a_seed_in_a_command_makes_a_program_noisy(program, said):
    problem = ProgramProblem.from_toml(program)
    assert problem.noisy
    without, first, second = (
        problem.run({"x": 2} | seed).outputs for seed in ({}, {"seed": 1}, {"seed": 2})
    )
    assert without == first != second
    assert "--noisy" in said("solve", "zdt1", "--repeat", "2", code=2)


def test_an_export_keeps_every_test_of_a_design(program, tmp_path, study_file, said):
    solve = ["solve", program, "--points", "2", "--repeat", "2", "--study"]
    said(*solve, study_file)
    for name in ("tests.csv", "copy.db"):
        said("export", study_file, "--out", tmp_path / name)
    assert len(read_table(tmp_path / "tests.csv")) == 4
    # nothing is left to test
    assert "This run: no new test." in said(*solve, tmp_path / "copy.db")


def test_surrogates_of_a_noisy_model_propose_new_designs(study_file):
    table = minimize(queue(), SurrogatePSI(28)).algorithm.table
    assert len(np.unique(table.X, axis=0)) == 28
    interrupted(minimize, queue(stop=24), SurrogatePSI(28, study=study_file))
    assert minimize(queue(), SurrogatePSI(28, study=study_file)).algorithm.table.equals(table)
