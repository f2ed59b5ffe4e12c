"""A study of whatever algorithm: nothing is lost, nothing evaluated twice, runs go on as one run."""

import re
from functools import partial

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.core.mixed import MixedVariableGA
from pymoo.core.variable import Binary, Choice, Integer, Real
from pymoo.operators.survival.rank_and_crowding import RankAndCrowding
from pymoo.optimize import minimize

from pymoo_psi import PSI, FailureTolerant, Recorded, Required, Robust, investigate
from pymoo_psi.algorithms import reference_directions
from pymoo_psi.errors import EvaluationError
from pymoo_psi.files import read_table
from tests.helpers.models import Model
from tests.helpers.refusals import interrupted, refused


def step(x):
    """With a stepped constraint that many designs violate alike."""
    return {
        "F": [x[0] + x[2] ** 2, 1 - x[0] + x[1] ** 2],
        "G": np.floor(3 * x[1] + 2 * x[2]) - 1,
        "lift": 2 * x[0],
    }


def failing_step(x):
    if x[2] > 0.7:
        raise ArithmeticError(f"no convergence at {x[2]}")
    return step(x)


def beam(x):
    cost = {"oak": 1.0, "steel": 3.0, "foam": 0.5}[x["metal"]]
    return {"F": [cost * x["width"] + x["n"], (5 - x["width"]) ** 2 / (1 + x["hollow"])]}


def model(results=step, **options):
    return Model(results, **{"n_var": 3, "n_ieq_constr": 1} | options)


def nsga3():
    return NSGA3(reference_directions(2, 10), pop_size=10)


def cmaes():
    from pymoo.algorithms.soo.nonconvex.cmaes import CMAES  # it takes a second to import

    return CMAES(x0=np.full(3, 0.4))


SINGLE = partial(model, lambda x: {"F": x[0] + x[2] ** 2}, n_obj=1, n_ieq_constr=0)
RUNS = {
    "nsga2": (model, lambda: NSGA2(10)),
    "nsga3": (model, nsga3),
    "nsga3-failing": (partial(model, failing_step), nsga3),
    "de": (SINGLE, lambda: DE(10)),
    "cmaes": (SINGLE, cmaes),
    "mixed": (
        partial(
            Model,
            beam,
            vars={
                "hollow": Binary(),
                "metal": Choice(options=["oak", "steel", "foam"]),
                "n": Integer(bounds=(0, 9)),
                "width": Real(bounds=(0, 5)),
            },
        ),
        lambda: MixedVariableGA(10, survival=RankAndCrowding()),
    ),
}


def solved(problem, algorithm):
    return minimize(problem, algorithm(), ("n_gen", 6), seed=5)


def recorded(problem, path, **options):
    return Recorded(FailureTolerant(problem), study=path, **options)


@pytest.mark.parametrize(("make", "algorithm"), RUNS.values(), ids=RUNS)
def test_an_interrupted_run_goes_on_without_a_difference(study_file, make, algorithm):
    plain, second = make(), make()
    whole = solved(FailureTolerant(plain), algorithm)
    interrupted(solved, recorded(make(stop=len(plain.calls) * 3 // 5), study_file), algorithm)
    stored = read_table(study_file)
    problem = recorded(second, study_file)
    result = solved(problem, algorithm)
    table = problem.table

    assert 0 < len(stored) < len(table)
    for name in ("X", "F"):
        assert repr(result.pop.get(name).tolist()) == repr(whole.pop.get(name).tolist())
    np.testing.assert_array_equal(result.F, whole.F)
    assert table.take(np.arange(len(stored))).equals(stored)
    # only what was under way when the first one stopped is evaluated again
    assert len({*map(repr, second.calls)}) == len(second.calls) == len(table) - len(stored)
    # each design is the test of its number
    rows = [table.row_of(number) for number in result.pop.get("test_point")]
    np.testing.assert_array_equal(table.F[rows], result.pop.get("F"))


# One batch


def batch(n=6):
    return np.random.default_rng(3).random((n, 3))


def values(problem, X):
    return problem.evaluate(X, return_values_of=["F", "G"])


@pytest.mark.parametrize(
    "arguments", [{}, {"return_values_of": ["G"]}, {"return_values_of": ["G", "F"]}]
)
@pytest.mark.parametrize("designs", [batch(), batch()[0]])
def test_what_is_returned_is_pymoos(study_file, arguments, designs):
    problem = Recorded(model(), study=study_file)
    got, expected = (p.evaluate(designs, **arguments) for p in (problem, model()))
    assert type(got) is type(expected)
    for a, b in zip(got, expected, strict=True):
        np.testing.assert_array_equal(a, b, strict=True)
    out = problem.evaluate(batch()[0], return_as_dictionary=True)
    assert (out["test_point"].item(), out["F"].shape) == (1, (2,))


def test_names_directions_and_outputs_are_those_of_the_problem(study_file):
    X = batch()
    told = {"names": {"f2": "gain", "x1": "width"}, "maximize": ["gain"], "units": {"lift": "N"}}
    first, again = (Recorded(model(), study=study_file, **told) for _ in range(2))
    out = first.evaluate(X, return_as_dictionary=True)
    np.testing.assert_array_equal(again.evaluate(X, return_values_of=["lift"]), 2 * X[:, 0])
    assert again.n_evaluated == 0
    np.testing.assert_array_equal(again.table.column("gain"), -out["F"][:, 1])
    assert again.table.schema.units == {"lift": "N"}
    assert [*map(np.shape, again.evaluate(np.zeros((0, 3))))] == [(0, 2), (0, 1)]


# Failures


@pytest.mark.parametrize(
    "wrap",
    [
        lambda tolerant, model, path: Recorded(tolerant(model), study=path),
        lambda tolerant, model, path: tolerant(Recorded(model, study=path)),
    ],
    ids=["within", "without"],
)
@pytest.mark.parametrize("failed_as", ["constraint", "penalty"])
def test_a_tolerant_problem_may_stand_within_or_without(study_file, failed_as, wrap):
    tolerant = partial(FailureTolerant, failed_as=failed_as)
    expected = tolerant(model(failing_step))
    answers = values(expected, batch(12))
    reasons = [failure.reason for failure in expected.failures]
    for _ in range(2):  # then from the file
        fragile = model(failing_step)
        problem = wrap(tolerant, fragile, study_file)
        np.testing.assert_equal(values(problem, batch(12)), answers)
        assert [failure.reason for failure in problem.failures] == reasons
    assert fragile.calls == []
    assert problem.table.schema.constraints == ("g1",)
    assert list(problem.table.reasons.values()) == reasons


def test_failures_of_a_tolerant_problem_are_failures_of_an_investigation(study_file):
    problem = Recorded(FailureTolerant(model(failing_step)), study=study_file)
    tested = minimize(problem, PSI(12)).algorithm.table
    assert tested.equals(investigate(model(failing_step), 12))
    assert problem.table.reasons == tested.reasons
    assert problem.n_evaluated == 12


def test_failures_within_other_wrappers(study_file):
    """A design that fails in every scenario is infeasible; a wrapper within has no failures."""
    robust = Robust(model(failing_step), tolerances={"x1": 0.01}, n_scenarios=4)
    result = solved(Recorded(robust, study=study_file), nsga3)
    np.testing.assert_array_equal(result.F, solved(FailureTolerant(robust), nsga3).F)
    assert read_table(study_file).reasons
    refused(r"say Recorded\(Required\(", Required, Recorded(FailureTolerant(robust), study_file))


def test_a_failure_ends_the_run_when_everything_is_stored(study_file):
    """With one message, whether the model fails or the study says that it did."""
    fragile, first = model(failing_step), batch(12)[batch(12)[:, 2] > 0.7][0]
    message = re.escape(f"ArithmeticError: no convergence at {first[2]}")
    for _ in range(2):
        refused(
            message, Recorded(fragile, study=study_file).evaluate, batch(12), error=EvaluationError
        )
    assert len(fragile.calls) == len(read_table(study_file)) == 12


def test_failures_are_tried_again_if_asked_for(study_file):
    X, repaired = batch(12), model()
    recorded(model(failing_step), study_file).evaluate(X)
    before = read_table(study_file)
    problem = recorded(repaired, study_file, retry="failed")
    for _ in range(2):
        problem.evaluate(X)
    np.testing.assert_array_equal(np.vstack(repaired.calls), X[before.status == "failed"])
    assert problem.table.numbers.tolist() == before.numbers.tolist()
    assert "failed" not in problem.table.status


# The study


def recorded_values(path, X=batch(), name="F", **options):  # noqa: B008
    return Recorded(model(**options), study=path).evaluate(X, return_values_of=[name])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"requires_kwargs": True}, "on the design alone"),
        ({"noisy": True}, "on the design alone"),
        ({"name": "dF"}, "further numbers of the model, got 'dF'"),
        ({"name": "drag"}, "got 'drag'; evaluate the problem within"),
        ({"vtype": int}, "integer values"),
        ({"X": batch() * np.nan}, "finite"),
    ],
)
def test_what_cannot_be_kept_is_refused(study_file, options, message):
    refused(message, recorded_values, study_file, **options)
