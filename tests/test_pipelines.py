"""PSI inside pymoo pipelines: as a start for other algorithms, and its result in pymoo's tools."""

import warnings

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.indicators.hv import Hypervolume
from pymoo.indicators.igd_plus import IGDPlus
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.visualization.scatter import Scatter

from pymoo_psi import PSI, LPTauSampling, SalukvadzeOptimum, lp_tau, nsga3, rank_of_efficiency

PROBLEM = get_problem("bnh")
VOLUME = Hypervolume(ref_point=np.array([140.0, 50.0]))


@pytest.fixture(scope="module")
def tested():
    return minimize(PROBLEM, PSI(200))


def test_lp_tau_starts_nsga3():
    directions = np.array([[0, 1.0], [0.5, 0.5], [1.0, 0]])
    algorithm = NSGA3(directions, pop_size=20, sampling=LPTauSampling())
    result = minimize(PROBLEM, algorithm, ("n_gen", 3), seed=1, save_history=True)
    lower, upper = PROBLEM.bounds()
    expected = lower + (upper - lower) * lp_tau(20, 2)
    started = result.history[0].off.get("X")
    np.testing.assert_array_equal(np.sort(started, axis=0), np.sort(expected, axis=0))


@pytest.mark.parametrize("make", [NSGA2, None])
def test_the_best_designs_start_another_algorithm(tested, make):
    """They come evaluated, so that the new run spends its budget on new designs only."""
    ranking = rank_of_efficiency(tested.F)
    best = tested.opt[np.argsort(ranking.criteria[:, 0])[:20]]
    if make is None:
        result = nsga3(PROBLEM, n_evaluations=300, seed=1, sampling=best)
        assert result.algorithm.evaluator.n_eval == 300
    else:
        result = minimize(PROBLEM, make(pop_size=20, sampling=best), ("n_gen", 15), seed=1)
    assert VOLUME.do(result.F) > VOLUME.do(best.get("F"))


def test_more_points_never_worsen_pymoos_indicators():
    """PSI(200) tests the points of PSI(50) again, and a Pareto set of more designs covers it.

    IGD+ and the hypervolume are the indicators that must respect this; plain IGD need not.
    """
    front = PROBLEM.pareto_front()
    results = [minimize(PROBLEM, PSI(n)).F for n in (50, 200, 800)]
    distances = [IGDPlus(front).do(F) for F in results]
    volumes = [VOLUME.do(F) for F in results]
    assert distances[0] > distances[1] > distances[2] > 0
    assert volumes[0] < volumes[1] < volumes[2] < VOLUME.do(front)


def test_pymoos_scatter_shows_every_pareto_optimal_design(tested):
    plot = Scatter().add(tested.F)
    plot.do()
    (shown,) = plot.ax.collections
    np.testing.assert_array_equal(shown.get_offsets(), tested.F)
    plot.fig.clear()


def test_the_result_holds_every_test_and_the_callers_own_problem(tested):
    assert tested.problem is PROBLEM
    assert tested.pop.get("test_point").tolist() == list(range(1, 201))
    assert set(tested.opt.get("test_point")) < set(range(1, 201))


def test_selectors_and_pymoos_decision_makers_take_turns(tested):
    with warnings.catch_warnings():  # the import pulls a module that SciPy has deprecated
        warnings.simplefilter("ignore")
        from pymoo.mcdm.pseudo_weights import PseudoWeights
    low, high = tested.F.min(axis=0), tested.F.max(axis=0)
    normalised = (tested.F - low) / (high - low)
    for selector in (SalukvadzeOptimum(), PseudoWeights(np.array([0.5, 0.5]))):
        chosen = normalised[selector.do(normalised)].reshape(-1, 2)
        assert len(chosen) >= 1
        assert (chosen < 1).all()
