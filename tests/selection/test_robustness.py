"""Designs in many scenarios, against a slow loop over scenarios and designs."""

import numpy as np
import pandas as pd
import pytest
from pymoo.core.problem import Problem
from pymoo.core.variable import Binary, Choice, Real
from scipy import stats

from pymoo_psi import FailureTolerant, Robust, lp_tau, rank_of_efficiency, robustness
from tests.helpers.models import Model
from tests.helpers.refusals import refused


def beam(load, strength):
    """A small family: the load shifts the objectives, the strength limits the designs."""

    def results(x):
        return {
            "F": [x[0] + x[1], load / (0.1 + x[0]), (x[1] - load) ** 2],
            "G": load * x[1] - strength,
            "H": 0.0,
        }

    return Model(results, n_var=2, n_obj=3, n_ieq_constr=1, n_eq_constr=1, xu=2.0)


LOAD = {"load": stats.norm(1.0, 0.2), "strength": stats.uniform(0.2, 0.7)}
X = 2 * lp_tau(40, 2)


def by_hand(X, points, normalize):
    """Every statistic of every design from lists over the scenarios."""
    found = [[] for _ in X]
    for row in points:
        F, G = beam(*row).evaluate(X, return_values_of=["F", "G"])
        there = np.flatnonzero((G <= 0).all(axis=1))
        if len(there):
            ranking = rank_of_efficiency(F[there], normalize=normalize)
            for k, i in enumerate(there):
                found[i].append(
                    {
                        "efficient": ranking.rank[k] >= 5,
                        "optimum": k in ranking.salukvadze,
                        "pareto": ranking.pareto[k],
                        "regret": ranking.criteria[k, 0] - ranking.criteria[:, 0].min(),
                    }
                )
    return found


def summary(found, n):
    """The columns of a design from what it is in the scenarios, of n, in which it is feasible."""
    counts = [sum(one[name] for one in found) for name in ("optimum", "efficient", "pareto")]
    regrets = [one["regret"] for one in found] or [np.nan]
    return [1 - len(found) / n, *np.divide(counts, n), np.mean(regrets), max(regrets)]


@pytest.mark.parametrize("normalize", [True, False])
def test_agrees_with_the_oracle(normalize):
    frame = robustness(beam, X, uncertainty=LOAD, n_scenarios=30, normalize=normalize)
    scenarios = Robust(beam, uncertainty=LOAD, n_scenarios=30).parameters
    expected = [summary(found, 30) for found in by_hand(X, scenarios, normalize)]
    shares = [f"{name}_share" for name in ("infeasible", "optimum", "efficient", "pareto")]
    found = frame.sort_index()[[*shares, "mean_regret", "worst_regret"]]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    # the family has designs that are never feasible
    assert 0 < found["mean_regret"].isna().sum() < len(X)
    assert found["optimum_share"].sum() == pytest.approx(1)  # one optimum in each scenario


def test_scenarios_are_quantiles_of_lp_tau_without_the_origin():
    class Quantile:
        def icdf(self, q):
            return 1 + 3 * q

    own = {"load": Quantile(), "strength": stats.randint(2, 4)}
    for uncertainty, quantile in ((LOAD, LOAD["load"].ppf), (own, own["load"].icdf)):
        points = Robust(beam, uncertainty=uncertainty, n_scenarios=16).parameters
        np.testing.assert_array_equal(points[:, 0], quantile(lp_tau(16, 2, first=2)[:, 0]))
    assert set(points[:, 1]) == {2.0, 3.0}


def mixed(k):
    """Named variables, of which one has a bound that is uncertain."""

    def model(x):
        a = x.pop("a")  # a model may change its designs
        return {"F": [a, 1 - a + (x["m"] == "y")]}

    return Model(
        model, vars={"a": Real(bounds=(0, k)), "m": Choice(options=["x", "y"]), "b": Binary()}
    )


def test_named_designs_and_bounds_of_the_scenario():
    designs = [
        {"a": 0.2, "m": "x", "b": True},
        {"a": 0.75, "m": "x", "b": True},
        {"a": 0.2, "m": "y", "b": False},
    ]
    options = {"uncertainty": {"k": stats.uniform(0.5, 0.5)}, "n_scenarios": 15}
    kept = robustness(mixed, designs, **options).sort_index()
    assert robustness(mixed, pd.DataFrame(designs), **options).sort_index().equals(kept)
    expected = [0, np.mean(Robust(mixed, **options).parameters[:, 0] < 0.75), 0]
    assert kept["infeasible_share"].tolist() == expected
    assert kept[["a", "m", "b"]].to_dict("records") == designs
    named = pd.DataFrame(X, columns=["x1", "x2"])[["x2", "x1"]]
    frame = robustness(beam, named, uncertainty=LOAD, n_scenarios=9)
    assert frame["optimum_share"].is_monotonic_decreasing
    np.testing.assert_array_equal(frame.sort_index()[["x1", "x2"]], X)


def brittle(load):
    """Fails below the load."""
    return Model(lambda x: {"F": x[0]}, fails=lambda x: x[0] < load, n_var=1, n_obj=1, xu=9.0)


def test_a_failing_design_is_infeasible_but_not_all():
    options = {"uncertainty": {"load": stats.uniform(0, 1)}, "n_scenarios": 15}
    result = robustness(brittle, [[0.5], [1.0]], **options)
    assert result["infeasible_share"].to_dict() == {0: 7 / 15, 1: 0}
    tolerant = robustness(lambda load: FailureTolerant(brittle(load)), [[0.5]], **options)
    assert tolerant.infeasible_share.tolist() == [7 / 15]
    refused("no convergence.*; if designs may fail", robustness, brittle, [[0.5]], **options)


@pytest.mark.parametrize(
    ("make_problem", "X", "options", "kind", "message"),
    [
        (beam, X[:, :1], {"uncertainty": LOAD, "n_scenarios": 1}, ValueError, "X must be designs of 2 variables"),
        (lambda laod: Problem(n_var=2, n_obj=3, laod=laod), X, {"uncertainty": {"laod": stats.uniform(0.5, 1)}}, ValueError, "of parameters that Problem takes, got 'laod'"),
    ],
)  # fmt: skip
def test_mistakes(make_problem, X, options, kind, message):
    refused(message, robustness, make_problem, X, error=kind, **options)
