"""Objectives over scenarios: closed forms of linear Gaussian models."""

import numpy as np
import pytest
from scipy import stats

from pymoo_psi import (
    FailureTolerant,
    Required,
    Restricted,
    Robust,
    SphereChute,
    VectorizedSphereChute,
    investigate,
    lp_tau,
)
from pymoo_psi.errors import StudyMismatchError
from tests.helpers.draws import rarely
from tests.helpers.models import Model
from tests.helpers.refusals import refused

A = np.array([[1.0, 2.0], [-3.0, 0.5]])


def linear(load=0.0, elementwise=False):
    """F = A x + load, and one constraint x1 + x2 + load <= 2."""
    return Model(
        lambda x: {"F": x @ A.T + load, "G": x.sum(axis=-1, keepdims=True) + load - 2},
        n_var=2,
        n_ieq_constr=1,
        elementwise=elementwise,
    )


SIGMA = np.array([0.1, 0.2])
X = lp_tau(9, 2, first=2)


def tail(q):
    """The mean of the worst of a standard normal distribution: the inverse Mills ratio."""
    return stats.norm.pdf(stats.norm.ppf(q)) / (1 - q)


@pytest.mark.parametrize("make", [linear, *rarely(lambda load: linear(load, elementwise=True))])
@pytest.mark.parametrize(
    ("statistic", "factor", "within"),
    [
        ("cvar:0.9", tail(0.9), 0.03),
        pytest.param("cvar:0.5", tail(0.5), 0.01, marks=pytest.mark.slow),
        pytest.param("mean", 0.0, 1e-12, marks=pytest.mark.slow),
    ],
)
def test_linear_models_with_normal_tolerances_have_closed_forms(make, statistic, factor, within):
    robust = Robust(
        make, tolerances={"x1": stats.norm(0, 0.1), "x2": stats.norm(0, 0.2)},
        uncertainty={"load": stats.norm(0.3, 0.1)},
        statistics=statistic, n_scenarios=255, failure_probability=0.25,
    )  # fmt: skip
    F, G = robust.evaluate(X)
    spread = np.sqrt((A**2 @ SIGMA**2) + 0.1**2)
    np.testing.assert_allclose(F, X @ A.T + 0.3 + factor * spread, atol=within)
    violated = stats.norm(X.sum(axis=1) + 0.3, np.sqrt((SIGMA**2).sum() + 0.1**2)).sf(2)
    np.testing.assert_allclose(G[:, 0], violated - 0.25, atol=0.01)


# The worst quarter of 63 is 15.75 of them: 0.97 to 0.53 in steps, and a part of the next.
QUARTER = (np.arange(62, 32, -2).sum() + 0.75 * 32) / 15.75 / 64


@pytest.mark.parametrize(
    ("statistics", "factor"),
    [
        ("worst", 62 / 64),
        ("cvar:0.99", 62 / 64),
        ("cvar:0.75", QUARTER),
        ("mean", 0.0),
        (["worst", "mean"], [62 / 64, 0.0]),
    ],
)
def test_one_tolerance_has_its_quantiles_exactly(statistics, factor):
    """2^k - 1 LPτ points of one dimension are the quantiles of i / 2^k."""
    robust = Robust(linear(), tolerances={"x1": 0.1}, n_scenarios=63, statistics=statistics)
    expected = X @ A.T + 0.1 * np.multiply(factor, np.abs(A[:, 0]))
    np.testing.assert_allclose(robust.evaluate(X)[0], expected, atol=1e-12)


def infinite_below_0(x):
    return {"F": x[0] if x[0] >= 0 else np.inf}


# One fails beyond 1, one does not run there.
BRITTLE = Model(infinite_below_0, fails=lambda x: x[0] > 1, n_var=1, n_obj=1)
RULED = Model(infinite_below_0, n_var=1, n_obj=1)
RULED.requirements = ["x1 <= 1"]


@pytest.mark.parametrize(
    ("problem", "reasons"), [(BRITTLE, ["ArithmeticError: no convergence"]), (RULED, [])]
)
def test_scenarios_that_fail_or_may_not_run_are_violated(problem, reasons):
    """A design that fails in all of them has failed."""
    robust = Robust(problem, tolerances={"x1": 0.5}, n_scenarios=63, failure_probability=0.1)
    F, G = robust.evaluate(np.array([[0.5], [0.25], [1.0], [9.0]]))
    assert G[:, 0] == pytest.approx([-0.1, 15 / 63 - 0.1, 31 / 63 - 0.1, 0.9])
    inside = 0.5 + robust.offsets
    expected = [inside.mean(), (inside - 0.25)[inside >= 0.25].mean()]
    assert F[[0, 1, 3], 0] == pytest.approx([*expected, np.inf])
    assert set(investigate(robust, 32).status) == {"ok", "infeasible"}
    tolerant = FailureTolerant(robust)
    tolerant.evaluate(np.array([[0.5], [1.0], [9.0]]))
    assert [failure.reason for failure in tolerant.failures] == reasons


@pytest.mark.parametrize("failed_as", ["constraint", "penalty"])
def test_the_values_that_a_tolerant_problem_gives_to_failed_designs_do_not_count(failed_as):
    options = {"tolerances": {"x1": 0.5}, "n_scenarios": 63, "failure_probability": 0.5}
    tolerant = FailureTolerant(BRITTLE, failed_as=failed_as)
    expected = investigate(Robust(BRITTLE, **options), 32)
    assert investigate(Robust(tolerant, **options), 32).equals(expected)


@pytest.mark.parametrize("n", [3, 10, 49])
def test_the_share_of_violations_may_equal_the_probability(n):
    """1 - 0.7 is more than 0.3 in float64; 3 of 10 are not."""
    for k in range(1, n):
        robust = Robust(BRITTLE, tolerances={"x1": 0.5}, n_scenarios=n, failure_probability=k / n)
        at = 1 - np.sort(robust.offsets[:, 0])[-k - 1 : n - k + 1].mean()  # k are beyond 1
        ((F,),), ((G,),) = robust.evaluate(np.array([[at]]))
        assert np.isfinite(F)
        assert G == 0


@pytest.mark.parametrize(
    "changed",
    [
        {"tolerances": {"x2": 0.06}},
        {"statistics": "mean"},
        {"failure_probability": 0.5},
        {"problem": VectorizedSphereChute(0.5, upper=(1.4, 6))},
        {"problem": Required(VectorizedSphereChute(0.4, upper=(1.4, 6)), ["x1 <= 0.5"])},
    ],
    ids=lambda changed: next(iter(changed)),
)
def test_its_study_is_its_own(study_file, changed):
    chute = VectorizedSphereChute(0.4, upper=(1.4, 6))
    given = {"problem": chute, "tolerances": {"x2": 0.05}, "statistics": "cvar:0.9"}
    investigate(Robust(**given), 8, study=study_file)
    refused(
        "belongs to another model",
        investigate,
        Robust(**given | changed),
        8,
        study=study_file,
        error=StudyMismatchError,
    )
    assert len(investigate(Robust(**given), 16, study=study_file)) == 16


def test_names_are_kept_but_those_of_constraints():
    problem = linear()
    problem.names = {"x1": "width", "f2": "yield", "g1": "stress"}
    problem.maximize, problem.units = ("yield",), {"x1": "mm", "yield": "%", "g1": "MPa"}
    table = investigate(Robust(problem, tolerances={"width": 0.1}), 4)
    assert table.schema.names == ("width", "x2", "f1", "yield", "g1")
    assert table.schema.units == {"width": "mm", "yield": "%"}


CHUTE = SphereChute()


@pytest.mark.parametrize(
    ("problem", "options", "kind", "message"),
    [
        (CHUTE, {}, ValueError, "uncertainty or tolerances must be given"),
        (CHUTE, {"tolerances": {"x3": 1}}, ValueError, "a variable of tolerances must be one of 'x1', 'x2'"),
        (CHUTE, {"tolerances": {"x1": 0.1}, "statistics": "cvar:1"}, ValueError, "statistics must be"),
        (CHUTE, {"tolerances": {"x1": 0.1}, "statistics": "cvar:0.0"}, ValueError, "statistics must be"),
        (CHUTE, {"tolerances": {"x1": 0.1}, "failure_probability": 1}, ValueError, "failure_probability must be from 0 to below 1"),
        (CHUTE, {"tolerances": {"x1": 0.1}, "n_scenarios": 0}, ValueError, "n_scenarios must be an integer >= 1, got 0"),
        (CHUTE, {"uncertainty": {"mu": stats.norm(0.4, 0.01)}}, TypeError, "problem must be a function of mu that returns a pymoo problem"),
        (SphereChute, {"uncertainty": {"mu": 0.4}}, TypeError, r"uncertainty\['mu'\] must be a distribution such as"),
        (Restricted(CHUTE, {"x1": 0.5}), {"tolerances": {"x1": 0.1}}, ValueError, "tolerances must be of real variables that are neither fixed nor in an equality"),
        (Required(CHUTE, ["x1 + x2 = 1"]), {"tolerances": {"x1": 0.1}}, ValueError, "nor in an equality, got .x1.; fix it or give the rule outside"),
        (SphereChute, {"uncertainty": {"mu": stats.norm(0.4, -0.01)}}, ValueError, r"uncertainty\['mu'\] must be finite"),
    ],
)  # fmt: skip
def test_mistakes(problem, options, kind, message):
    refused(message, Robust, problem, error=kind, **options)


def test_statistics_are_one_for_each_objective():
    with pytest.raises(ValueError, match="could not be broadcast"):
        Robust(CHUTE, tolerances={"x1": 0.1}, statistics=["mean"] * 3)
