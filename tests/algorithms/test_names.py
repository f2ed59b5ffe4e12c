"""Names, directions and units that a problem or an argument tells, and outputs that its model gives."""

from functools import partial

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import PSI, FailureTolerant, investigate
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, StudyMismatchError
from tests.helpers.models import Model
from tests.helpers.refusals import refused, warned

TOLD = {
    "names": {"x1": "width", "f2": "gain", "g1": "stress"},
    "maximize": ["gain"],
    "units": {"width": "mm", "heat": "K"},
}


def every(X):
    """Two objectives, the second the negative of what is to be maximised, and an output."""
    return {
        "F": np.column_stack([X.sum(axis=1), X[:, 0] * X[:, 1] - X[:, 0]]),
        "G": X[:, :1] - 0.7,
        "heat": X[:, :1] + 300,
    }


def one(x):
    """The same for one design, which may fail."""
    if x[1] == 0.5:
        raise ArithmeticError("no convergence")
    return {"F": [x.sum(), x[0] * x[1] - x[0]], "G": x[0] - 0.7, "heat": x[0] + 300}


def problem(results=every, **told):
    made = Model(results, n_var=2, n_ieq_constr=1, elementwise=results is not every)
    vars(made).update(told)
    return made


ONE = problem(one)


def test_attributes_of_the_problem_and_arguments_say_the_same():
    told = investigate(problem(**TOLD), 16)
    assert told.schema.names == ("width", "x2", "f1", "gain", "stress", "heat")
    assert told.schema.maximize == ("gain",)
    assert told.schema["heat"].heading == "heat [K]"
    assert np.array_equal(told.column("gain"), -told.F[:, 1])
    # A tolerant problem has the attributes of the one that it wraps; arguments win.
    for table in (
        investigate(problem(), 16, **TOLD),
        minimize(problem(), PSI(16, **TOLD)).algorithm.table,
        minimize(problem(**TOLD), PSI(16)).algorithm.table,
        investigate(FailureTolerant(problem(**TOLD)), 16),
    ):
        assert table.equals(told)
    other = investigate(problem(**TOLD), 16, names={}, maximize=(), units={})
    assert other.schema.names == ("x1", "x2", "f1", "f2", "g1", "heat")


@pytest.mark.parametrize(
    ("told", "error", "message"),
    [
        ({"names": {"x3": "height"}}, ArgumentValueError, "names must be one of 'f1', 'f2', 'g1', 'x1', 'x2', got 'x3'"),
        ({"names": {"x1": "x2"}}, ArgumentValueError, "names of a table must be distinct, .* got 'x2'"),
        ({"maximize": "f2"}, ArgumentTypeError, "maximize must be a list of names"),
        ({"log": "x2"}, ArgumentTypeError, "log (of the problem )?must be a list of"),
        ({"names": {"f2": "gain"}, "log": ["gain"]}, ArgumentValueError, "log must be one of 'x1', 'x2', got"),
        ({"maximize": ["gain"]}, ArgumentValueError, "maximize must be one of 'f1', 'f2', got 'gain'"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused(told, error, message):
    refused(message, investigate, problem(), 4, error=error, **told)
    refused(message, minimize, problem(**told), PSI(4), error=error)


def test_no_direction_of_the_problem_is_lost():
    refused(
        "that includes the problem's own, gain, got",
        investigate,
        problem(**TOLD),
        4,
        maximize=["f1"],
    )
    assert investigate(problem(**TOLD), 4, maximize=["f1", "gain"]).schema.maximize == (
        "f1",
        "gain",
    )


@pytest.mark.parametrize("names", [{"f2": "gain"}, {"f1": "f2", "f2": "f1"}, {}])
@pytest.mark.parametrize(
    "told",
    [
        {"maximize": ["f2"], "units": {"f2": "EUR"}},
        {"names": {"f2": "profit"}, "maximize": ["profit"], "units": {"profit": "EUR"}},
    ],
)
def test_a_column_keeps_direction_and_unit_under_another_name(told, names):
    schema = investigate(problem(**told), 4, names=names).schema
    assert schema.units == {names.get("f2", "f2"): "EUR"}
    assert schema.maximize == (names.get("f2", "f2"),)
    assert schema.objectives == (names.get("f1", "f1"), names.get("f2", "f2"))


def test_outputs_are_those_of_the_model(study_file):
    """By blocks, and from a study that is continued."""
    whole = investigate(ONE, 48, **TOLD)
    heat = np.where(whole.X[:, 1] == 0.5, np.nan, whole.X[:, 0] + 300)
    np.testing.assert_array_equal(whole.column("heat"), heat)
    assert np.isnan(heat).any()
    investigate(ONE, 20, study=study_file, **TOLD)
    result = minimize(ONE, PSI(48, study=study_file, **TOLD))
    assert result.algorithm.table.equals(whole)
    assert np.array_equal(result.pop.get("heat"), whole.column("heat"), equal_nan=True)


@pytest.mark.parametrize("failed_as", ["constraint", "penalty"])
def test_individuals_are_those_of_a_tolerant_problem(failed_as):
    """So that an optimiser may start from them, whoever has evaluated them."""
    tolerant = partial(FailureTolerant, ONE, failed_as=failed_as)
    told, run = PSI(16).setup(tolerant()), minimize(tolerant(), PSI(16)).algorithm
    infills = told.ask()
    infills.set("mark", 1.0)  # of the user, no output
    told.tell(infills=told.evaluator.eval(told.problem, infills))
    assert told.table.equals(run.table)
    for pop in (told.pop, run.pop):
        F, G = tolerant().evaluate(pop.get("X"), return_values_of=["F", "G"])
        np.testing.assert_array_equal(np.hstack([pop.get("F"), pop.get("G")]), np.hstack([F, G]))


def test_an_output_of_some_designs_may_have_a_unit():
    """Whatever designs are evaluated first, and together."""
    some = problem(lambda x: one(x) | ({"load": 1.0} if x[0] > 0.5 else {}), units={"load": "N"})
    whole = investigate(some, 16)
    np.testing.assert_array_equal(np.isnan(whole.column("load")), whole["x1"] <= 0.5)
    assert whole.schema.units == {"load": "N"}
    assert minimize(some, PSI(16, block_size=1)).algorithm.table.equals(whole)
    warned("no test of the table has the output 'load'", investigate, some, 2)


def test_vectorised_and_elementwise_models_give_the_same_outputs():
    """A column or a row of n; NaN of a design is no failure."""

    def further(X):
        x = X[:, 0]
        return {"flat": list(x), "hot": x > 0.5, "hole": np.where(x > 0.5, np.nan, 1.0)}

    told = Model(lambda X: every(X) | further(X), n_var=2, n_ieq_constr=1, elementwise=False)
    table = investigate(told, 16)
    wanted = {"heat": table["x1"] + 300, **further(table.X)}
    assert table.schema.outputs == tuple(wanted)
    for name, values in wanted.items():
        np.testing.assert_array_equal(table.column(name), values, err_msg=name)
    assert "failed" not in table.status


@pytest.mark.parametrize("block_size", [1, 3, 8])
def test_an_output_that_is_a_number_for_some_designs_is_kept_for_these(block_size):
    def f(x):
        return {"F": x, "heat": 1.5 if x[0] < 0.5 else "too hot"}

    algorithm = PSI(8, block_size=block_size)
    table = warned("no single number, such as 'too hot'", minimize, Model(f, n_var=2), algorithm)
    heat = table.algorithm.table.column("heat")
    np.testing.assert_array_equal(heat, np.where(table.algorithm.table.X[:, 0] < 0.5, 1.5, np.nan))


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("profile", [1.0, 2.0], "'profile'.* not kept in the table where it is no single number"),
        ("note", "fine", "'note'.* no single number, such as 'fine'"),
        ("status", 1.0, "'status'.* not kept in the table by this name"),
    ],
)
def test_what_is_not_kept_is_told(name, value, message):
    """Also where a design fails, which has none of it; dF is pymoo's."""
    more = {"dF": np.zeros((2, 2)), name: value}
    table = warned(message, investigate, problem(lambda x: one(x) | more), 4)
    assert table.schema.outputs == ("heat",)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"names": {"f1": "mass"}}, 'objectives.0 is "f1" in the study, "mass" asked'),
        ({"maximize": ["f2"]}, 'maximize.0 is absent in the study, "f2" asked'),
    ],
)
def test_a_study_keeps_its_first_names_and_directions(study_file, told, message):
    investigate(problem(), 8, study=study_file)
    refused(message, investigate, problem(), 8, study=study_file, error=StudyMismatchError, **told)
