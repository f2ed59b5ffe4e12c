"""Several runs in one study: a design is tested once, whichever run asks for it first."""

import numpy as np
import pandas as pd
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    Recorded,
    Restricted,
    TestTable,
    investigate,
)
from pymoo_psi.algorithms import RunOptions, import_tests
from pymoo_psi.analysis import even_part, sensitivities
from pymoo_psi.files import read_table, write_table
from pymoo_psi.study import Study
from pymoo_psi.table import Formulation, Schema
from tests.helpers.models import Model
from tests.helpers.refusals import refused, warned


def results(x):
    return {"F": [x[0] + x[1] ** 2, 1 - x[0] + x[1] ** 2], "heat": x[0] - x[1]}


@pytest.fixture
def model():
    return Model(results, n_var=2)


def test_the_number_of_a_test_says_run_and_point(model, study_file):
    first = investigate(model, 8, study=study_file)
    part = Restricted(model, {"x1": (0.5, 1)})
    assert investigate(part, 8, study=study_file).numbers.tolist() == [*range(1_000_001, 1_000_009)]
    longer = investigate(model, 16, study=study_file)
    assert longer.numbers[:8].tolist() == first.numbers.tolist() == list(range(1, 9))
    assert (longer.numbers == longer["test_point"])[longer.numbers < 1_000_000].all()
    by_point = np.argsort(longer["test_point"].astype(int))
    np.testing.assert_array_equal(longer.X[by_point], investigate(model, 16).X)
    # point 1 of the second run has the number of point 1 000 001, which gets the next above all
    for first, number in ((1_000_000, 1_000_000), (1_000_001, 1_000_009)):
        assert investigate(model, 1, study=study_file, first=first).numbers.tolist() == [number]


def test_an_interrupted_run_is_finished_before_more_points(model, study_file):
    assert len(investigate(model, 8, study=study_file, more=True)) == 8
    assert len(investigate(model, 8, study=study_file, more=True)) == 16
    algorithm = PSI(32, study=study_file, block_size=8).setup(model)
    for _ in range(3):  # of 32 points, 16 are known; then the run ends
        algorithm.next()
    assert len(investigate(model, 8, study=study_file, more=True)) == 32
    assert len(investigate(model, 8, study=study_file, more=True)) == 40


@pytest.mark.parametrize("asked", [{"limits": "heat<=0.5"}, {"computed": {"cold": "-heat"}}])
def test_tests_are_retried_that_lack_what_is_asked(asked, model, study_file):
    investigate(Model(lambda x: {"F": results(x)["F"]}, n_var=2), 8, study=study_file)
    options = {"study": study_file, "formulation": Formulation(**asked), "retry": "incomplete"}
    for _ in range(2):  # the second time nothing
        heat = investigate(model, 12, **options)["heat"]
        np.testing.assert_array_equal(heat, investigate(Model(results, n_var=2), 12)["heat"])
        assert len(model.calls) == 12


def test_results_in_another_unit_are_refused(model, study_file):
    options = RunOptions(study=study_file, units={"f1": "kg"}, log=["x2"])
    part = Restricted(model, {"x2": (0.1, 1)})
    schema = Schema.of(["x1", "x2"], ["f1", "f2"], units={"f1": "g"})
    grams = TestTable.of([1], [[0.25, 0.5]], [[1000.0, 3.0]], schema=schema)
    refused("'f1' must be that of the formulation, kg, got 'g'", import_tests, part, grams, options)
    negative = pd.DataFrame({"x1": [0.25], "x2": [-0.5], "f1": [1.0], "f2": [3.0]})
    refused("x2 must be above 0", import_tests, part, negative, options)


def test_analysis_says_which_tests_are_an_even_sample(model, study_file):
    investigate(Restricted(model, {"x1": (0, 0.1)}), 16, study=study_file)
    investigate(model, 64, study=study_file)
    minimize(Recorded(model, study_file), NSGA2(8), ("n_gen", 12), seed=1)
    part, sentences = even_part(read_table(study_file))
    # The lower corner is a test of the first run.
    assert sentences[0] == "By 63 tests of run 2 alone."
    assert sorted(map(tuple, part.X)) == sorted(map(tuple, investigate(model, 64).X))[1:]
    np.testing.assert_allclose(
        sensitivities(read_table(study_file), ["heat"])["first_order"], 0.5, atol=0.1
    )


def test_a_study_says_when_and_where_runs_began(model, study_file):
    investigate(model, 4, study=study_file)
    (run,) = Study(study_file).facts().runs
    assert {"begun", "host", "python", "numpy", "pymoo-psi"} <= {*run.record}


def test_several_runs_are_written_without_a_change(model, study_file, tmp_path):
    investigate(model, 8, study=study_file)
    investigate(Restricted(model, {"x1": (0, 0.5)}), 8, study=study_file)
    table = read_table(study_file)
    for name in ("copy.db", "copy.csv", "copy.xlsx"):
        write_table(table, tmp_path / name)
        assert read_table(tmp_path / name).equals(table), name
    assert investigate(model, 8, study=tmp_path / "copy.db").X.tolist() == table.X[:8].tolist()
    assert len(model.calls) == 15  # the corner of both is one design


@pytest.mark.parametrize("name", ["run", "test_point", "origin", "seconds"])
def test_added_columns_replace_no_values(name, study_file, model):
    """Such an objective is refused; a further output is left out, which is said."""
    refused(
        f"a column of a study.*'{name}'",
        investigate,
        model,
        4,
        study=study_file,
        names={"f1": name},
    )
    assert not study_file.exists()
    problem = Model(lambda x: {"F": [x[0], 1 - x[0]], name: x[0] - x[1]}, n_var=2)
    for part in (problem, Restricted(problem, {"x1": (0.5, 1)})):
        message = f"out\\['{name}'\\] is not kept in the study"
        table = warned(message, investigate, part, 4, study=study_file)
        np.testing.assert_array_equal(table[name], table.X[:, 0] - table.X[:, 1])
        assert name not in read_table(study_file).schema.outputs
