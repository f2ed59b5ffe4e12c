"""A study of whatever algorithm: nothing is lost, nothing evaluated twice, runs go on as one run."""

import re

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.core.mixed import MixedVariableGA
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Binary, Choice, Integer, Real
from pymoo.operators.survival.rank_and_crowding import RankAndCrowding
from pymoo.optimize import minimize

from pymoo_psi import PSI, FailureTolerant, Recorded, investigate
from pymoo_psi.algorithms import reference_directions
from pymoo_psi.errors import EvaluationError
from pymoo_psi.files import read_table
from pymoo_psi.study import Study
from tests.helpers.refusals import interrupted, refused
from tests.helpers.studies import rows


class Model(ElementwiseProblem):
    """A square with a stepped constraint that many designs violate alike; counts, and stops."""

    def __init__(self, stop=None, fails=False, n_obj=2, **options):
        if "vars" not in options:
            options |= {"n_var": 3, "n_ieq_constr": int(n_obj > 1), "xl": 0, "xu": 1}
        super().__init__(n_obj=n_obj, **options)
        self.seen, self.stop, self.fails = [], stop, fails
        self.is_mixed = "vars" in options

    def fingerprint(self):
        return {}  # its arguments change no value

    def _evaluate(self, x, out, *args, **kwargs):
        if len(self.seen) == self.stop:
            raise KeyboardInterrupt
        self.seen.append(repr(x))
        if self.is_mixed:
            cost = {"oak": 1.0, "steel": 3.0, "foam": 0.5}[x["metal"]]
            out["F"] = [cost * x["width"] + x["n"], (5 - x["width"]) ** 2 / (1 + x["hollow"])]
            return
        if self.fails and x[2] > 0.7:
            raise ArithmeticError(f"no convergence at {x[2]}")
        out["F"] = [x[0] + x[2] ** 2, 1 - x[0] + x[1] ** 2][: self.n_obj]
        if self.n_ieq_constr:
            out["G"] = np.floor(3 * x[1] + 2 * x[2]) - 1


VARIABLES = {
    "hollow": Binary(),
    "metal": Choice(options=["oak", "steel", "foam"]),
    "n": Integer(bounds=(0, 9)),
    "width": Real(bounds=(0, 5)),
}


def nsga3():
    return NSGA3(reference_directions(2, 10), pop_size=10)


def cmaes():
    from pymoo.algorithms.soo.nonconvex.cmaes import CMAES  # it takes a second to import

    return CMAES(x0=np.full(3, 0.4))


RUNS = {
    "nsga2": ({}, lambda: NSGA2(10)),
    "nsga3": ({}, nsga3),
    "nsga3-failing": ({"fails": True}, nsga3),
    "de": ({"n_obj": 1}, lambda: DE(10)),
    "cmaes": ({"n_obj": 1}, cmaes),
    "mixed": ({"vars": VARIABLES}, lambda: MixedVariableGA(10, survival=RankAndCrowding())),
}


def solved(problem, algorithm, n_gen=6):
    return minimize(problem, algorithm, ("n_gen", n_gen), seed=5)


def recorded(model, path, **options):
    return Recorded(model if model.is_mixed else FailureTolerant(model), study=path, **options)


def population(result):
    return [repr(x) if isinstance(x, dict) else x.tobytes() for x in result.pop.get("X")]


@pytest.mark.parametrize("name", RUNS)
def test_an_interrupted_run_goes_on_without_a_difference(tmp_path, name):
    options, algorithm = RUNS[name]
    plain = Model(**options)
    whole = solved(plain if plain.is_mixed else FailureTolerant(plain), algorithm())
    first = Model(stop=len(plain.seen) * 3 // 5, **options)
    interrupted(solved, recorded(first, tmp_path / "s.db"), algorithm())
    stored = read_table(tmp_path / "s.db")
    second = Model(**options)
    problem = recorded(second, tmp_path / "s.db")
    result = solved(problem, algorithm())

    assert 0 < len(stored) < len(problem.table)
    assert population(result) == population(whole)
    np.testing.assert_array_equal(result.pop.get("F"), whole.pop.get("F"))
    np.testing.assert_array_equal(result.F, whole.F)
    assert problem.table.take(np.arange(len(stored))).equals(stored)
    # only what was under way when the first one stopped is evaluated again
    assert len(set(second.seen)) == len(second.seen) == len(problem.table) - len(stored)
    # each design is the test of its number
    rows = {number: row for row, number in enumerate(problem.table.numbers.tolist())}
    F = problem.table.F[[rows[number] for number in result.pop.get("test_point")]]
    np.testing.assert_array_equal(F, result.pop.get("F"))


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
    problem = Recorded(Model(), study=study_file)
    got, expected = (p.evaluate(designs, **arguments) for p in (problem, Model()))
    assert type(got) is type(expected)
    for a, b in zip(got, expected, strict=True):
        np.testing.assert_array_equal(a, b, strict=True)
    out = problem.evaluate(batch()[0], return_as_dictionary=True)
    assert (out["test_point"].item(), out["F"].shape) == (1, (2,))


def test_names_directions_and_outputs_are_those_of_the_problem(tmp_path):
    class Winged(Model):
        def _evaluate(self, x, out, *args, **kwargs):
            super()._evaluate(x, out, *args, **kwargs)
            out["lift"] = 2 * x[0]

    X = batch()
    told = {"names": {"f2": "gain", "x1": "width"}, "maximize": ["gain"], "units": {"lift": "N"}}
    first, again = (Recorded(Winged(), study=tmp_path / "s.db", **told) for _ in range(2))
    out = first.evaluate(X, return_as_dictionary=True)
    np.testing.assert_array_equal(again.evaluate(X, return_values_of=["lift"]), 2 * X[:, 0])
    assert again.n_evaluated == 0
    np.testing.assert_array_equal(again.table.column("gain"), -out["F"][:, 1])
    assert again.table.schema.units == {"lift": "N"}


# Failures


@pytest.mark.parametrize("name", ["within", "without"])
@pytest.mark.parametrize("failed_as", ["constraint", "penalty"])
def test_a_tolerant_problem_may_stand_within_or_without(tmp_path, failed_as, name):
    X = batch(12)
    expected = FailureTolerant(Model(fails=True), failed_as=failed_as)
    answers = values(expected, X)
    reasons = [failure.reason for failure in expected.failures]
    path = tmp_path / "s.db"
    for _ in range(2):  # then from the file
        model = Model(fails=True)
        if name == "within":
            problem = Recorded(FailureTolerant(model, failed_as=failed_as), study=path)
        else:
            problem = FailureTolerant(Recorded(model, study=path), failed_as=failed_as)
        assert problem.n_ieq_constr == expected.n_ieq_constr
        for got, answer in zip(values(problem, X), answers, strict=True):
            np.testing.assert_array_equal(got, answer)
        assert [failure.reason for failure in problem.failures] == reasons
    assert model.seen == []
    assert problem.table.schema.constraints == ("g1",)
    assert list(problem.table.reasons.values()) == reasons


def test_a_failure_ends_the_run_when_everything_is_stored(study_file):
    """With one message, whether the model fails or the study says that it did."""
    model, first = Model(fails=True), batch(12)[batch(12)[:, 2] > 0.7][0]
    message = re.escape(f"ArithmeticError: no convergence at {first[2]}")
    for _ in range(2):
        problem = Recorded(model, study=study_file)
        refused(message, problem.evaluate, batch(12), error=EvaluationError)
    assert len(model.seen) == len(read_table(study_file)) == 12


def test_failures_are_tried_again_if_asked_for(tmp_path):
    X, path = batch(12), tmp_path / "s.db"
    recorded(Model(fails=True), path).evaluate(X)
    before, model = read_table(path), Model()
    problem = recorded(model, path, retry="failed")
    for _ in range(2):
        problem.evaluate(X)
    failed = before.numbers[before.status == "failed"]
    assert model.seen == [repr(x) for x in X[failed - 1]]
    assert problem.table.numbers.tolist() == before.numbers.tolist()
    assert "failed" not in problem.table.status


# The study


def test_a_corrected_test_of_another_run_has_new_values(study_file):
    first = investigate(Model(), 2, study=study_file)
    problem = recorded(Model(), study_file)
    assert values(problem, first.X)[0].tolist() == first.F.tolist()
    study = Study(study_file)
    columns = rows(study.contents()[1], slice(0, 1))
    with study.changes() as database:
        database.correct(1, "corrected")
    study.append(columns | {"f1": np.array([7.0])})
    problem.evaluate(batch(1))  # by which it looks into the study
    assert values(problem, first.X)[0][:, 0].tolist() == [7.0, first.F[1, 0]]


class Noisy(Model):
    noisy = True


def recorded_values(path, X, name="F", **options):
    return Recorded(Model(**options), study=path).evaluate(X, return_values_of=[name])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: recorded_values(path, batch(), requires_kwargs=True), "on the design alone"),
        (lambda path: Recorded(Noisy(), study=path), "on the design alone"),
        (lambda path: recorded_values(path, batch(), "dF"), "further numbers of the model, got 'dF'"),
        (lambda path: recorded_values(path, batch(), "lift"), "got 'lift'; evaluate the problem within"),
        (lambda path: recorded_values(path, batch(), vtype=int), "integer values"),
        (lambda path: recorded_values(path, batch() * np.nan), "finite"),
    ],
)  # fmt: skip
def test_what_cannot_be_kept_is_refused(tmp_path, make, message):
    refused(message, make, tmp_path / "s.db")


# With pymoo's tools


def test_an_investigation_of_a_recorded_problem_has_own_numbers(tmp_path):
    """Those of the study are none of its outputs, of which it would warn."""
    problem = Recorded(Model(), study=tmp_path / "s.db")
    problem.evaluate(np.full((1, 3), 0.5))
    assert minimize(problem, PSI(3, first=2)).algorithm.table.equals(
        minimize(Model(), PSI(3, first=2)).algorithm.table
    )
    assert problem.n_evaluated == 3, "the first of them is answered from the study"
