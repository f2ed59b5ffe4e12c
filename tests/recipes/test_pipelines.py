"""Our parts in pymoo's pipelines: samplings, problems that wrap others, choices from a front."""

import warnings
from functools import partial

import dill
import numpy as np
import pandas as pd
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.decomposition.asf import ASF
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import (
    PSI,
    FailureTolerant,
    Recorded,
    Restricted,
    Robust,
    SalukvadzeOptimum,
    TestTable,
    acceptability,
    cautions,
    explain,
    nsga3,
    rank_of_efficiency,
    representatives,
)
from pymoo_psi.plots import plot_objectives, plot_ranking
from pymoo_psi.selection import compare_selectors
from tests.recipes.test_algorithms import by_asking, mixed

with warnings.catch_warnings():  # pymoo.mcdm imports scipy.spatial.ckdtree, which is deprecated
    warnings.simplefilter("ignore", DeprecationWarning)
    from pymoo.mcdm.pseudo_weights import PseudoWeights

PROBLEM = get_problem("bnh")
# operators/sampling, customization/initialization, customization/mixed


class Whole(Problem):
    """Integers or bits in a vector."""

    def __init__(self, kind):
        super().__init__(n_var=12, n_obj=2, vtype=kind, xl=0, xu=1 if kind is bool else 5)

    def _evaluate(self, x, out, *args, **kwargs):
        assert ((x >= self.xl) & (x <= self.xu)).all()
        out["F"] = np.column_stack([x.sum(axis=1), (self.xu - x)[:, ::2].sum(axis=1)])


@pytest.mark.parametrize(
    "problem", [mixed(), Whole(int), Whole(bool)], ids=["mixed", "integers", "bits"]
)
def test_nsga3_takes_variables_of_every_kind(problem):
    result, again = (nsga3(problem, n_evaluations=120, seed=1) for _ in range(2))
    assert result.F.tolist() == again.F.tolist()
    assert result.algorithm.evaluator.n_eval == 120
    np.testing.assert_array_equal(problem.evaluate(result.X), result.F)


# getting_started/part_3, mcdm: choices from a front

SELECTORS = {
    "ASF": ASF(),
    "weights": PseudoWeights(np.array([0.3, 0.7])),
    "best": SalukvadzeOptimum(),
}


def bounds_of(plot):
    return lambda source: [ax.dataLim.bounds for ax in plot(source).axes]


@pytest.fixture(scope="module")
def front():
    return minimize(PROBLEM, NSGA2(40), ("n_gen", 8), seed=1)


@pytest.mark.parametrize(
    "ask",
    [
        lambda source: rank_of_efficiency(source).criteria,
        lambda source: explain(source).shares,
        lambda source: representatives(source, 3).rows,
        acceptability,
        lambda source: [caution.kind for caution in cautions(source)],
        lambda source: compare_selectors(source, SELECTORS),
        bounds_of(plot_ranking),
        bounds_of(plot_objectives),
    ],
)
def test_whatever_holds_a_front_is_taken(ask, front):
    table = TestTable.of(range(1, len(front.F) + 1), front.X, front.F)
    for source in (front, pd.DataFrame(front.F), table):
        np.testing.assert_equal(ask(source), ask(front.F))


def test_a_result_of_one_objective_is_a_front_of_one_design():
    assert explain(minimize(get_problem("sphere"), PSI(16), seed=1), 0).dominated_by == -1


# Problems that wrap others, in every way of running

WRAPPED = {
    "FailureTolerant": lambda problem, path: FailureTolerant(problem),
    "Recorded": lambda problem, path: Recorded(problem, study=path),
    "Restricted": lambda problem, path: Restricted(problem, {"x1": (0.2, 1.0)}),
    "Robust": lambda problem, path: Robust(problem, tolerances={"x1": 0.01}, n_scenarios=4),
}


def from_a_checkpoint(algorithm, problem):
    algorithm.setup(problem, termination=("n_gen", 3), seed=1).next()
    return dill.loads(dill.dumps(algorithm)).run()


@pytest.mark.parametrize("way", [by_asking, from_a_checkpoint])
@pytest.mark.parametrize("name", WRAPPED)
@pytest.mark.parametrize(
    "make", [partial(NSGA2, 10), partial(PSI, 30, block_size=10)], ids=["NSGA2", "PSI"]
)
def test_every_way_of_running_gives_one_result(make, name, way, tmp_path):
    expected = minimize(WRAPPED[name](PROBLEM, tmp_path / "a.db"), make(), ("n_gen", 3), seed=1)
    result = way(make(), WRAPPED[name](PROBLEM, tmp_path / "b.db"))
    np.testing.assert_array_equal(result.pop.get("X"), expected.pop.get("X"))
    np.testing.assert_array_equal(result.F, expected.F)
    assert (result.opt.get("CV") <= 0).all()
