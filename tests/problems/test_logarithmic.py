"""Logarithmic variables: as the same problem with its logarithms as variables."""

import logging
import pathlib
import re
from functools import partial

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.population import Population
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.repair import Repair
from pymoo.core.sampling import Sampling
from pymoo.core.variable import Choice, Real
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    FailureTolerant,
    LogScaled,
    QMCSampling,
    Restricted,
    Robust,
    SurrogatePSI,
    TestTable,
    compare,
    investigate,
    nsga3,
)
from pymoo_psi.analysis import histogram, sensitivities
from pymoo_psi.files import read_table
from pymoo_psi.plots import plot_table
from pymoo_psi.table import Kind, Schema
from tests.helpers.models import Model
from tests.helpers.refusals import refused


def values(exponent, height):
    return [exponent**2 + height, (exponent - 2) ** 2 + (height - 1) ** 2]


class Wide(ElementwiseProblem):
    """Area from 1e-4 to 1e3; what counts is its common logarithm."""

    def __init__(self, log=("area",)):
        self.names, self.log = {"x1": "area", "x2": "height"}, log
        super().__init__(n_var=2, n_obj=2, xl=[1e-4, 0.0], xu=[1e3, 2.0])

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = values(np.log10(x[0]), x[1])


def plain_model():
    """The same with the logarithm as its variable."""
    return Model(lambda x: {"F": values(*x)}, n_var=2, xl=[-4.0, 0.0], xu=[3.0, 2.0])


def exponents(X):
    return np.column_stack([np.log10(np.asarray(X, float)[:, 0]), np.asarray(X, float)[:, 1]])


def compared(name, problem):
    options = {"n_evaluations": 64, "seeds": 1, "progress": False}
    return compare(problem, algorithms=["psi", name], **options).runs[-1]


@pytest.mark.parametrize(
    "search",
    [
        lambda problem: investigate(problem, 64),
        lambda problem: investigate(problem, 64, sampling=QMCSampling("halton"), seed=1),
        lambda problem: minimize(problem, PSI(64)).algorithm.table,
        lambda problem: minimize(problem, SurrogatePSI(28, batch=4), seed=1).algorithm.table,
        lambda problem: nsga3(problem, n_evaluations=200, seed=1),
        *(partial(compared, name) for name in ("psi+nsga3", "nsga2")),
    ],
)
def test_every_search_is_that_of_the_logarithms(search):
    found, plain = search(Wide()), search(plain_model())
    np.testing.assert_allclose(exponents(found.X), plain.X.astype(float), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.F, plain.F, rtol=1e-9, atol=1e-9)


START = np.array([[10.0, 0.5], [100.0, 0.7], [5e-4, 0.1], [500.0, 1.5]])


class Given(Sampling):
    def _do(self, problem, n_samples, **kwargs):
        return START


@pytest.mark.parametrize("sampling", [START, Population.new(X=START), Given()])
@pytest.mark.parametrize("wrap", [lambda problem: problem, FailureTolerant])
def test_a_start_has_values(sampling, wrap):
    found = nsga3(wrap(Wide()), 60, seed=1, sampling=sampling, save_history=True)
    assert sorted(found.history[0].pop.get("X").tolist()) == sorted(START.tolist())
    assert found.algorithm.evaluator.n_eval == 60
    assert not np.isnan(found.pop.get("X")).any()


def test_an_evaluated_start_is_that_of_the_logarithms():
    front, expected = (
        nsga3(problem, 200, seed=1, sampling=minimize(problem, PSI(64)).opt).F
        for problem in (Wide(), plain_model())
    )
    assert len(front) > 10
    np.testing.assert_allclose(front, expected, rtol=1e-9, atol=1e-9)


def test_history_callbacks_and_repairs_have_values():
    class AtMost(Repair):
        def _do(self, problem, X, **kwargs):
            return np.column_stack([np.minimum(X[:, 0], 50.0), X[:, 1]])

    kept = []
    options = {"callback": lambda algorithm: kept.append(algorithm.pop.get("X").copy())}
    found = nsga3(Wide(), 100, seed=1, repair=AtMost(), save_history=True, **options)
    np.testing.assert_array_equal(kept, [algorithm.pop.get("X") for algorithm in found.history])
    np.testing.assert_array_equal(kept[-1], found.pop.get("X"))
    areas = np.array(kept)[..., 0]
    assert areas.min() >= 1e-4
    assert areas.max() == 50.0


def test_scaled_is_the_inverse_of_original():
    problem = LogScaled(Wide())
    np.testing.assert_allclose(problem.scaled(START[0]), [1.0, 0.5])
    np.testing.assert_allclose(problem.original(problem.scaled(START)), START)
    np.testing.assert_array_equal(problem.scaled(np.array([[0.0, 0.5]])), [[-4.0, 0.5]])


def test_requirements_hold_for_the_values_of_logarithmic_variables():
    wide = Wide()
    wide.requirements, wide.units = ["area <= 1"], {"x1": "m2", "height": "m"}
    table = investigate(LogScaled(wide), 64)
    assert table.schema.units == {"height": "m"}
    np.testing.assert_array_equal(table.feasible(), table["log10 area"] <= 0)
    found = minimize(LogScaled(wide), NSGA2(20), ("n_eval", 100), seed=1).pop
    assert found.get("feas").any()
    np.testing.assert_array_equal(found.get("feas"), found.get("X")[:, 0] <= 0)


def test_mixed_variables_may_be_logarithmic():
    variables = {"area": Real(bounds=(1e-4, 1e3)), "steel": Choice(options=["a", "b"])}
    mixed = Model(lambda x: {"F": values(np.log10(x["area"]), 1.0)}, vars=variables)
    exponent = np.log10(investigate(mixed, 128, log=["area"]).X[:, 0].astype(float))
    assert abs(np.quantile(exponent, [0.25, 0.5, 0.75]) - [-2.25, -0.5, 1.25]).max() < 0.1


def test_ends_of_bounds_and_limits_are_exact():
    """exp(log(10)) is 10.000000000000002: the lower bound would be beyond a limit at it."""
    ranges = {"xl": np.array([10.0, 0.1]), "xu": np.array([1000.0, 1.0])}
    problem = Model(lambda x: {"F": [x[0] * (1 + x[1]), 100 / x[0] + x[1]]}, n_var=2, **ranges)
    options = {"log": ["x1"], "limits": {"x1": (20, 300), "x2": (0.3, 0.9)}}
    assert investigate(problem, 1, log=["x1"]).X.tolist() == [[10.0, 0.1]]
    table = minimize(problem, SurrogatePSI(40, **options), seed=1).algorithm.table
    proposed = table.X[table["proposal_round"] > 0]
    assert len(proposed) > 10
    assert ((proposed >= [20, 0.3]) & (proposed <= [300, 0.9])).all()


def test_scenarios_of_logarithms_reach_beyond_the_bounds():
    plain = Model(lambda x: {"F": [10 ** x[0]]}, n_var=1, n_obj=1, xl=0, xu=1)
    scaled = Model(lambda x: {"F": [x[0]]}, n_var=1, n_obj=1, xl=1, xu=10)
    worst = [
        Robust(problem, tolerances={name: 0.1}, statistics="worst").evaluate(np.array([[1.0]]))
        for problem, name in ((plain, "x1"), (LogScaled(scaled, ["x1"]), "log10 x1"))
    ]
    np.testing.assert_allclose(worst[1][0], worst[0][0])
    assert worst[0][0][0, 0] > 11


def test_a_part_of_the_bounds_stays_logarithmic():
    table = investigate(Restricted(Wide(), {"area": (1e-2, 1e2)}), 64)
    expected = investigate(Restricted(plain_model(), {"x1": (-2.0, 2.0)}), 64)
    np.testing.assert_allclose(exponents(table.X), expected.X, atol=1e-9)
    bounds, plain = (
        np.array(each.under(limits={"f1": 1.0}).refined_bounds(margin=0.1))
        for each in (table, expected)
    )
    np.testing.assert_allclose(exponents(bounds), plain)


def test_analysis_is_that_of_the_logarithm(tmp_path):
    table, plain = investigate(Wide(), 256), investigate(plain_model(), 256)
    edges, expected = histogram(table, "area", bins=7).edges, histogram(plain, "x1", bins=7).edges
    np.testing.assert_allclose(np.log10(edges), expected)
    # equal up to rounding: ranks decide
    np.testing.assert_allclose(
        sensitivities(table)["first_order"], sensitivities(plain)["first_order"], atol=1e-9
    )
    table.to_csv(tmp_path / "table.csv")
    assert read_table(tmp_path / "table.csv").schema["area"].kind is Kind.LOG
    assert "log" in {axes.get_xscale() for axes in plot_table(table).axes}


@pytest.mark.parametrize("log", [{"area"}, frozenset({"x1"}), ["area"], ["area", "x1"]], ids=str)
def test_the_attribute_is_a_collection_of_names(log):
    assert investigate(Wide(log), 16).equals(investigate(Wide(("area",)), 16))


NAMES = "log must be one of 'area', 'height', 'x1', 'x2', got"


@pytest.mark.parametrize(
    ("attribute", "option", "message"),
    [
        (["are"], None, NAMES),
        (("area", "run"), None, NAMES),
        ({"area", "run"}, None, NAMES),
        ("area", None, "log of the problem must be a list of variables, got 'area'"),
        ("x1", None, "log of the problem must be a list of variables, got 'x1'"),
        ((), ["aera"], "did you mean 'area'"),
        ((), ["height"], "above 0"),
        ((), "area", "log must be a list of names, got 'area'"),
    ],
    ids=["misspelt", "tuple", "set", "text", "number", "option", "bounds", "text as option"],
)
def test_other_scales_are_refused(attribute, option, message):
    refused(re.escape(message), investigate, Wide(attribute), 4, log=option)


def test_names_say_of_which_columns_they_are():
    model = Wide(())
    model.names = ["area", "height"]
    refused("names of a problem must be a mapping from f1, x1, … to names", investigate, model, 4)


@pytest.mark.parametrize(
    "log",
    [
        *(None, True, print, logging.getLogger("wide"), pathlib.Path("run.log")),
        *({"x1": 1.0}, {}, frozenset(), [], np.ones((2, 2))),
    ],
)
def test_an_attribute_of_another_purpose_is_ignored(log):
    assert investigate(Wide(log), 16).equals(investigate(Wide(log=()), 16))


@pytest.mark.parametrize("bins", [1, 3, 4, 10])
@pytest.mark.parametrize(("low", "high"), [(0.1, 10.0), (0.3, 7.0), (1e-9, 1e5)])
def test_a_histogram_has_the_designs_on_its_bounds(low, high, bins):
    X = np.array([[low], [np.sqrt(low * high)], [high]])
    schema = Schema.of(1, 1, kinds=["log"], lower=[low], upper=[high])
    counts = histogram(TestTable.of([1, 2, 3], X, X, schema=schema), "x1", bins=bins)
    assert (counts.tested.sum(), counts.outside) == (3, (0, 0))
    assert counts.tested[0] >= 1 <= counts.tested[-1]
