"""Designs in many scenarios, against a slow loop over scenarios and designs."""

import statistics

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Binary, Choice, Real
from scipy import stats

from pymoo_psi import PsiError, VectorizedSphereChute, lp_tau, rank_of_efficiency, robustness
from pymoo_psi.pareto._scenarios import rank_scenario, tally
from pymoo_psi.selection._robustness import scenarios


class Beam(Problem):
    """A small family: the load shifts the objectives, the strength limits the designs."""

    def __init__(self, load, strength):
        super().__init__(n_var=2, n_obj=3, n_ieq_constr=1, n_eq_constr=1, xl=0.0, xu=2.0)
        self.load, self.strength = load, strength

    def _evaluate(self, x, out, *args, **kwargs):
        a, b = x.T
        out["F"] = np.column_stack([a + b, self.load / (0.1 + a), (b - self.load) ** 2])
        out["G"] = (self.load * b - self.strength)[:, None]
        out["H"] = np.zeros((len(x), 1))


class SlowBeam(ElementwiseProblem):
    """The same, one design at a time."""

    def __init__(self, load, strength):
        super().__init__(n_var=2, n_obj=3, n_ieq_constr=1, xl=0.0, xu=2.0)
        self.load, self.strength = load, strength

    def _evaluate(self, x, out, *args, **kwargs):
        a, b = x
        out["F"] = [a + b, self.load / (0.1 + a), (b - self.load) ** 2]
        out["G"] = [self.load * b - self.strength]


LOAD = {"load": stats.norm(1.0, 0.2), "strength": stats.uniform(0.2, 0.7)}
X = 2 * lp_tau(40, 2)


def by_hand(make_problem, X, points, parameters, normalize=True):
    """Every statistic of every design from lists over the scenarios."""
    n, seen = len(X), []
    for row in points:
        problem = make_problem(**dict(zip(parameters, row, strict=True)))
        F, G = problem.evaluate(np.array(X), return_values_of=["F", "G"])
        there = [i for i in range(n) if (G[i] <= 0).all()]
        scenario = {i: {"F": F[i].tolist()} for i in there}
        if there:
            ranking = rank_of_efficiency(F[there], normalize=normalize)
            for k, i in enumerate(there):
                scenario[i]["rank"] = ranking.rank[k]
                scenario[i]["optimum"] = k in ranking.salukvadze
                scenario[i]["pareto"] = ranking.pareto[k]
                scenario[i]["regret"] = ranking.criteria[k, 0] - ranking.criteria[:, 0].min()
        seen.append(scenario)
    return [[scenario[i] for scenario in seen if i in scenario] for i in range(n)]


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize("make_problem", [Beam, SlowBeam])
def test_agrees_with_the_oracle(make_problem, normalize):
    result = robustness(make_problem, X, uncertainty=LOAD, n_scenarios=30, normalize=normalize)
    points = scenarios(LOAD, 30)
    np.testing.assert_array_equal(result.scenarios, points)
    never = 0
    for i, lives in enumerate(by_hand(make_problem, X, points, LOAD, normalize)):
        assert result.infeasible_share[i] == pytest.approx(1 - len(lives) / 30)
        assert result.optimum_share[i] == sum(life["optimum"] for life in lives) / 30
        assert result.efficient_share[i] == sum(life["rank"] >= 5 for life in lives) / 30
        assert result.pareto_share[i] == sum(life["pareto"] for life in lives) / 30
        if not lives:
            never += 1
            assert np.isnan([*result.mean[i], *result.spread[i], *result.worst[i]]).all()
            assert np.isnan([result.mean_regret[i], result.worst_regret[i]]).all()
            continue
        for j in range(3):
            values = [life["F"][j] for life in lives]
            assert result.mean[i, j] == pytest.approx(statistics.fmean(values))
            assert result.spread[i, j] == pytest.approx(statistics.pstdev(values), abs=1e-9)
            assert result.worst[i, j] == max(values)
        regrets = [life["regret"] for life in lives]
        assert result.mean_regret[i] == pytest.approx(statistics.fmean(regrets), abs=1e-12)
        assert result.worst_regret[i] == pytest.approx(max(regrets), abs=1e-12)
    assert 0 < never < len(X)  # the family has designs that are never feasible
    assert result.optimum_share.sum() == pytest.approx(1)  # one optimum in each scenario


def test_scenarios_are_quantiles_of_lp_tau_without_the_origin():
    points = scenarios(LOAD, 255)
    assert points.shape == (255, 2)
    np.testing.assert_array_equal(
        points[:, 0], stats.norm(1, 0.2).ppf(lp_tau(255, 2, first=2)[:, 0])
    )
    # 255 LPτ points and the origin lie once in every interval of length 2^-8.
    cells = np.sort(np.floor(256 * LOAD["strength"].cdf(points[:, 1]) + 1e-6))
    np.testing.assert_array_equal(cells, np.arange(1, 256))

    class Quantile:
        def icdf(self, q):
            return 3 * q

    assert scenarios({"a": Quantile()}, 1).tolist() == [[1.5]]
    assert set(scenarios({"a": stats.randint(2, 4)}, 16)[:, 0]) == {2.0, 3.0}


def test_one_scenario_is_one_ranking():
    certain = {"mu": stats.uniform(0.4, 1e-300)}
    designs = np.array([1.4, 5.9]) * lp_tau(64, 2) + [0, 0.1]
    result = robustness(
        lambda mu: VectorizedSphereChute(mu, model="rolling"), designs,
        uncertainty=certain, n_scenarios=3, normalize=False,
    )  # fmt: skip
    F = VectorizedSphereChute(0.4, model="rolling").evaluate(designs)[0]
    ranking = rank_of_efficiency(F, normalize=False)
    np.testing.assert_array_equal(np.flatnonzero(result.optimum_share == 1), ranking.salukvadze)
    np.testing.assert_array_equal(result.efficient_share == 1, ranking.rank >= 5)
    np.testing.assert_allclose(result.mean, F)
    np.testing.assert_allclose(result.spread, 0, atol=1e-12)
    mu1 = ranking.criteria[:, 0]
    np.testing.assert_allclose(result.worst_regret, mu1 - mu1.min(), atol=1e-12)


def test_bounds_of_the_scenario_count_unless_told_otherwise():
    def make(mu):
        return VectorizedSphereChute(mu, model="rolling")

    designs, mu = [[0.3, 0.1], [1.2, 0.1]], {"mu": stats.uniform(0.2, 0.2)}
    points = scenarios(mu, 64)[:, 0]
    kept = robustness(make, designs, uncertainty=mu, n_scenarios=64)
    assert kept.infeasible_share[1] == np.mean(3.5 * points < 1.2) > 0
    free = robustness(make, designs, uncertainty=mu, n_scenarios=64, keep_bounds=False)
    assert free.infeasible_share.tolist() == [0, 0]


def test_processes_do_not_change_the_result():
    alone = robustness(Beam, X, uncertainty=LOAD, n_scenarios=20)
    shared = robustness(Beam, X, uncertainty=LOAD, n_scenarios=20, n_jobs=2)
    for name in ("mean", "spread", "worst", "optimum_share", "mean_regret"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(shared, name))


def test_named_variables():
    class Mixed(ElementwiseProblem):
        def __init__(self, k):
            super().__init__(
                vars={"a": Real(bounds=(0, 1)), "m": Choice(options=["x", "y"])}, n_obj=2
            )
            self.k = k

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = [x["a"], self.k * (1 - x["a"]) + (x["m"] == "y")]

    designs = [{"a": 0.2, "m": "x"}, {"a": 0.5, "m": "x"}, {"a": 0.5, "m": "y"}]
    result = robustness(Mixed, designs, uncertainty={"k": stats.uniform(1, 1)}, n_scenarios=4)
    frame = result.to_frame()
    assert frame.columns.tolist()[:2] == ["a", "m"]
    assert frame.loc[2, "m"] == "y"
    assert frame.loc[2, "pareto_share"] == 0


def test_named_designs_outside_the_bounds_of_a_scenario_are_infeasible_there():
    class Slope(ElementwiseProblem):
        def __init__(self, mu):
            super().__init__(vars={"u": Real(bounds=(0, mu)), "b": Binary()}, n_obj=2)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = [x["u"], -x["u"] - x["b"]]

    designs = [{"u": 0.2, "b": True}, {"u": 0.75, "b": True}]
    asked = {"uncertainty": {"mu": stats.uniform(0.5, 0.5)}, "n_scenarios": 63}
    kept = robustness(Slope, designs, **asked)
    assert kept.infeasible_share.tolist() == [0, np.mean(kept.scenarios[:, 0] < 0.75)]
    assert robustness(Slope, designs, **asked, keep_bounds=False).infeasible_share.tolist() == [
        0,
        0,
    ]


def test_designs_may_be_a_data_frame():
    frame = pd.DataFrame(X, columns=["width", "height"])
    result = robustness(Beam, frame, uncertainty=LOAD, n_scenarios=4)
    np.testing.assert_array_equal(result.X, X)


def test_frame():
    result = robustness(Beam, X, uncertainty=LOAD, n_scenarios=16, names=["mass", "sag", "gap"])
    frame = result.to_frame()
    shares = ["optimum_share", "efficient_share", "pareto_share", "infeasible_share"]
    statistic = [f"{n}_{s}" for n in ("mass", "sag", "gap") for s in ("mean", "spread", "worst")]
    assert frame.columns.tolist() == [
        "x1",
        "x2",
        *shares,
        "mean_regret",
        "worst_regret",
        *statistic,
    ]
    assert frame["optimum_share"].is_monotonic_decreasing
    np.testing.assert_array_equal(frame.sort_index()[["x1", "x2"]], X)
    np.testing.assert_array_equal(frame["sag_worst"].sort_index(), result.worst[:, 1])


arrays_of_scenarios = st.tuples(
    st.integers(1, 8), st.integers(1, 12), st.integers(1, 4), st.integers(0, 2**32 - 1)
)


@given(shape=arrays_of_scenarios)
def test_shares_and_statistics_are_consistent(shape):
    """On any arrays, with infeasible designs and infinite objectives, and duplicates."""
    s, n, m, seed = shape
    rng = np.random.default_rng(seed)
    F = rng.integers(0, 5, (s, n, m)).astype(float)
    F[rng.random((s, n, m)) < 0.05] = np.inf
    feasible = rng.random((s, n)) < 0.8
    rankings = [rank_scenario(f, ok, normalize=True) for f, ok in zip(F, feasible, strict=True)]
    points = np.zeros((s, 1))
    result = tally(
        rankings, X=np.zeros((n, 1)), parameters=["p"], scenarios=points, objectives="abcd"[:m]
    )
    valid = feasible & np.isfinite(F).all(axis=2)
    np.testing.assert_allclose(result.infeasible_share, 1 - valid.mean(axis=0))
    assert (result.optimum_share <= result.pareto_share).all()
    assert (result.efficient_share <= result.pareto_share).all()
    assert (result.pareto_share + result.infeasible_share <= 1 + 1e-12).all()
    there = valid.any(axis=0)
    assert (result.worst_regret[there] >= result.mean_regret[there] - 1e-12).all()
    assert (result.mean_regret[there] >= -1e-12).all()
    only = np.where(valid[..., None], F, np.nan)[:, there]
    np.testing.assert_allclose(result.mean[there], np.nanmean(only, axis=0))
    np.testing.assert_allclose(result.spread[there], np.nanstd(only, axis=0), atol=1e-12)
    np.testing.assert_array_equal(result.worst[there], np.nanmax(only, axis=0))


class Misfit(Problem):
    def __init__(self, load):
        super().__init__(n_var=2, n_obj=2 if load < 1 else 3, xl=0.0, xu=2.0)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = np.ones((len(x), self.n_obj))


def limited(mu):
    return VectorizedSphereChute(mu - 0.3, model="rolling")


MU = {"mu": stats.uniform(0.2, 0.2)}


@pytest.mark.parametrize(
    ("make_problem", "X", "options", "kind", "message"),
    [
        (Beam, X, {"uncertainty": {}}, ValueError, "uncertainty must be one or more parameters"),
        (Beam, X, {"uncertainty": [1]}, TypeError, "uncertainty must be a mapping from parameters"),
        (
            Beam, X, {"uncertainty": {"load": (0.3, 0.5)}}, TypeError,
            r"uncertainty\['load'\] must be a distribution such as scipy.stats.uniform",
        ),
        (
            Beam, X, {"uncertainty": {"load": stats.uniform(0, -1)}}, ValueError,
            r"uncertainty\['load'\] must be a distribution with finite quantiles",
        ),
        (Beam, X, {"uncertainty": LOAD, "n_scenarios": 0}, ValueError, "n_scenarios must be"),
        (Beam, X, {"uncertainty": LOAD, "n_jobs": 0}, ValueError, "n_jobs must be 1 or more"),
        (Beam, X, {"uncertainty": LOAD, "names": ["a"]}, ValueError, r"names must be 3 names, got \['a'\]"),
        (Beam, X[0], {"uncertainty": LOAD}, ValueError, "X must be two-dimensional"),
        (Beam, X[:0], {"uncertainty": LOAD}, ValueError, "X must be of at least one design"),
        (3, X, {"uncertainty": LOAD}, TypeError, "make_problem must be callable, got 3"),
        (lambda laod: Problem(n_var=2, n_obj=3, laod=laod), X, {"uncertainty": {"laod": stats.uniform(0.5, 1)}}, ValueError, "of parameters that Problem takes, got 'laod'"),
        (dict, X, {"uncertainty": LOAD}, TypeError, "the scenario load=1, strength=0.55 must give a problem"),
        (limited, [[0.1, 0.1]], {"uncertainty": MU}, ValueError, "the scenario mu=0.25 must .* mu must be a positive"),
        (Misfit, X, {"uncertainty": {"load": stats.uniform(0.5, 1)}}, ValueError, "one number of objectives, got 3 and 2"),
    ],
)  # fmt: skip
def test_mistakes(make_problem, X, options, kind, message):
    with pytest.raises(kind, match=message) as caught:
        robustness(make_problem, X, **options)
    assert isinstance(caught.value, PsiError)


def test_a_mistake_in_a_process_is_the_same_mistake():
    load = {"load": stats.uniform(0.5, 1)}
    with pytest.raises(PsiError, match="one number of objectives, got 3 and 2"):
        robustness(Misfit, X, uncertainty=load, n_jobs=2, n_scenarios=64)


def test_no_design_is_feasible():
    weak = {"load": stats.uniform(1, 1), "strength": stats.uniform(-2, 1)}
    result = robustness(Beam, X, uncertainty=weak, n_scenarios=4)
    assert result.infeasible_share.tolist() == [1.0] * len(X)
    assert result.optimum_share.sum() == 0


@pytest.mark.parametrize("elementwise", [True, False])
def test_a_model_that_changes_its_designs_changes_no_other_scenario(elementwise):
    class Wheels(Problem):
        def __init__(self, mu):
            super().__init__(n_var=1, n_obj=1, xl=0, xu=9, elementwise=elementwise)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = x.copy()
            x += 1

    mu = {"mu": stats.uniform(1, 1)}
    result = robustness(Wheels, [[1.0], [2.0]], uncertainty=mu, n_scenarios=4)
    assert result.X.tolist() == [[1.0], [2.0]]
    assert result.to_frame()["f1_worst"].sort_index().tolist() == [1.0, 2.0]


def test_named_designs_are_each_scenarios_own():
    class Wheels(ElementwiseProblem):
        def __init__(self, mu):
            super().__init__(vars={"a": Real(bounds=(0, 9))}, n_obj=1)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = x.pop("a")

    mu = {"mu": stats.uniform(1, 1)}
    result = robustness(Wheels, [{"a": 1.0}], uncertainty=mu, n_scenarios=4)
    assert result.X == ({"a": 1.0},)


def test_criteria_that_are_maximised_are_told_in_their_own_sense():
    """A problem that says so gives its yield with the sign turned; nothing else changes."""

    class Plant(Problem):
        def __init__(self, load, *, says=True):
            super().__init__(n_var=1, n_obj=2, xl=0.0, xu=1.0)
            self.load = load
            if says:
                self.names, self.maximize = {"f1": "cost", "f2": "yield"}, ["yield"]

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = np.hstack([x, -self.load * np.sqrt(x)])

    loads = {"load": stats.uniform(1.0, 2.0)}
    designs = [[0.01], [0.25], [1.0]]
    said = robustness(Plant, designs, uncertainty=loads, n_scenarios=15)
    plain = robustness(
        lambda load: Plant(load, says=False), designs, uncertainty=loads, n_scenarios=15
    )
    assert said.objectives == ("cost", "yield")
    load = said.scenarios[:, 0]
    assert said.mean[:, 1] == pytest.approx(load.mean() * np.array([0.1, 0.5, 1.0]))
    assert said.worst[:, 1] == pytest.approx(load.min() * np.array([0.1, 0.5, 1.0]))
    assert said.to_frame()["yield_worst"].min() > 0
    for name in ("optimum_share", "efficient_share", "mean_regret", "worst_regret", "spread"):
        assert (getattr(said, name) == getattr(plain, name)).all()
    assert (said.worst == plain.worst * [1.0, -1.0]).all()
