"""Wrappers of problems: one that the package does not know passes through all of it."""

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import (
    PSI,
    FailureTolerant,
    LogScaled,
    Recorded,
    Required,
    Restricted,
    Robust,
    compare,
    investigate,
)
from pymoo_psi.errors import StudyMismatchError
from pymoo_psi.problems import WrappedProblem
from tests.helpers.models import Model
from tests.helpers.refusals import refused
from tests.problems.test_program import echo


class Mirrored(WrappedProblem):
    """The second variable counted downwards: other designs for the wrapped problem."""

    def designs_within(self, X):
        return X * [1.0, -1.0] + [0.0, 1.0]


class Priced(WrappedProblem):
    """The objectives at a price: other values of the same designs."""

    def __init__(self, problem, price):
        self.price = price
        super().__init__(problem)

    def values_from(self, X, evaluate):
        out = evaluate(self.designs_within(X))
        return out | {"F": out["F"] * self.price}

    def fingerprint(self):
        return {"price": self.price}


class Part(Restricted):
    """A wrapper of the package with other values."""

    price = 3.0
    values_from = Priced.values_from


def model(mirrored=False, price=1.0, **options):
    """Fails at a small x1; mirrored and with a price where it is asked to be."""

    def results(x):
        a, b = x * [1.0, -1.0] + [0.0, 1.0] if mirrored else x
        return {"F": np.array([a + b**2, 1 / (0.1 + a + b)]) * price, "G": a - b - 0.7}

    return Model(results, fails=lambda x: x[0] < 0.2, n_var=2, n_ieq_constr=1, **options)


# A problem that is wrapped, and the same one written by hand.
PAIRS = {
    "designs": (Mirrored(model()), model(mirrored=True)),
    "values": (Priced(model(), 3.0), model(price=3.0)),
    "a part": (Part(model(), {"x2": (0.0, 1.0)}), model(price=3.0)),
    "both": (Priced(Mirrored(model()), 3.0), model(mirrored=True, price=3.0)),
}
BOX = {"x2": (0.1, 0.8)}
RULE = ["x1 + x2 >= 0.5"]
AROUND = {
    "alone": lambda p: p,
    "Restricted": lambda p: Restricted(p, BOX),
    "LogScaled": lambda p: LogScaled(Restricted(p, {"x1": (0.1, 1.0)}), ["x1"]),
    "Required": lambda p: Required(p, RULE),
    "FailureTolerant": FailureTolerant,
    "Robust": lambda p: Robust(p, tolerances={"x1": 0.05}, n_scenarios=7),
    "several": lambda p: FailureTolerant(Required(Restricted(p, BOX), RULE)),
}
pairs = pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)


@pairs
@pytest.mark.parametrize("wrap", AROUND.values(), ids=AROUND)
def test_a_new_wrapper_equals_a_problem_by_hand(pair, wrap):
    wrapped, written = map(wrap, pair)
    expected = investigate(written, 20)
    assert investigate(wrapped, 20).equals(expected)
    assert minimize(wrapped, PSI(20, block_size=6)).algorithm.table.equals(expected)


@pairs
def test_recorded_and_tolerant(pair, study_file):
    wrapped, written = map(FailureTolerant, pair)
    expected = minimize(written, NSGA2(pop_size=12), ("n_gen", 3), seed=1)
    for n_evaluated in (36, 0):
        recorded = Recorded(wrapped, study=study_file)
        result = minimize(recorded, NSGA2(pop_size=12), ("n_gen", 3), seed=1)
        np.testing.assert_array_equal(result.F, expected.F)
        np.testing.assert_array_equal(result.pop.get("G"), expected.pop.get("G"))
        assert recorded.n_evaluated == n_evaluated
        assert (recorded.table.status == "failed").any()


@pytest.mark.parametrize("name", ["_evaluate", "do"])
def test_a_wrapper_that_evaluates_in_its_own_way_is_refused(name):
    """A table would not call it."""
    own = type("Own", (WrappedProblem,), {name: lambda *_: None})
    refused("Own must be without do and _evaluate .* override values_from", own, model())


def scenarios(limit):
    """Of a program with a limit, which is a constraint of each."""
    program = echo({"bounds": [1, 2]}, {"m": limit})
    return Robust(program, tolerances={"n": 0.1}, n_scenarios=1)


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        (Priced(model(), 3.0), Priced(model(), 4.0), "price"),
        (get_problem("bnh"), Mirrored(get_problem("bnh")), "wrappers"),
        (scenarios("<= 2"), scenarios("<= 3"), "another model"),
    ],
)
def test_a_study_tells_wrappers_apart(study_file, first, second, message):
    investigate(first, 4, study=study_file)
    refused(message, investigate, second, 4, study=study_file, error=StudyMismatchError)


@pytest.mark.parametrize("kept", [lambda problem, _: problem, Recorded])
def test_wrappers_that_use_values_are_within_the_tolerant_one(kept, study_file):
    """Failed designs would have values there."""
    problem = kept(FailureTolerant(model()), study_file)
    refused(r"without FailureTolerant, .*say \w+\(Required\(", Required, problem, RULE)


@pytest.mark.parametrize("wrap", AROUND.values(), ids=AROUND)
def test_the_wrapped_problem_has_its_callback(wrap):
    """As where pymoo evaluates it alone."""
    seen = []
    problem = Model(lambda x: {"F": x}, n_var=2, callback=lambda X, out: seen.extend(out["F"]))
    wrap(problem).evaluate(np.array([[0.3, 0.4], [0.6, 0.5]]))
    assert len(seen) == len(problem.calls) > 0


@pytest.mark.parametrize("elementwise", [True, False])
def test_nan_is_replaced_before_it_is_checked(elementwise, study_file):
    """By pymoo's option, in every way to evaluate a problem."""

    class Gap(Problem):
        def _evaluate(self, x, out, *args, **kwargs):
            first = x[..., 0]
            out["F"] = np.stack([np.where(first > 0.5, np.nan, first), x[..., 1]], axis=-1)

    def gap(**options):
        return Gap(n_var=2, n_obj=2, xl=0, xu=1, elementwise=elementwise, **options)

    filled = gap(replace_nan_values_by=9.0)
    X = np.array([[0.3, 0.4], [0.6, 0.5]])
    expected = [[0.3, 0.4], [9.0, 0.5]]
    wrappers = [Restricted(filled, BOX), FailureTolerant(filled), Recorded(filled, study_file)]
    for problem in (filled, *wrappers):
        np.testing.assert_array_equal(problem.evaluate(X, return_values_of=["F"]), expected)
    assert (investigate(filled, 8).status == "ok").all()
    assert (investigate(gap(), 8).status == "failed").any()
    # another number for NaN gives other values
    refused("replace_nan_values_by is 9.0", Recorded, gap(replace_nan_values_by=8.0), study_file)


def test_a_comparison_counts_the_values_that_failed_designs_have():
    """No algorithm of it gets another problem than the tolerant one."""
    tolerant = FailureTolerant(model())
    runs = compare(tolerant, n_evaluations=24, seeds=1, algorithms=["psi", "nsga3"], progress=False)
    assert runs.to_frame()["evaluated"].tolist() == [24, 24]
    assert tolerant.failures


def test_a_wrapper_that_changes_values_has_no_front():
    problem = get_problem("bnh")
    assert Priced(problem, 2.0).pareto_front() is None
    np.testing.assert_array_equal(FailureTolerant(problem).pareto_front(), problem.pareto_front())
