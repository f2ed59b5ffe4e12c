"""NSGA-III as the alternative: budget, reference directions, repeatability."""

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.moo.unsga3 import UNSGA3
from pymoo.core.population import Population
from pymoo.core.problem import ElementwiseProblem
from pymoo.operators.sampling.rnd import PermutationRandomSampling
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.problems.single.flowshop_scheduling import FlowshopScheduling
from pymoo.problems.single.traveling_salesman import create_random_tsp_problem

from pymoo_psi import (
    PSI,
    FailureTolerant,
    LPTauSampling,
    Recorded,
    Restricted,
    SurrogatePSI,
    investigate,
    nsga3,
)
from pymoo_psi.algorithms import reference_directions
from pymoo_psi.problems import seed_ties
from tests.helpers.models import Model
from tests.helpers.refusals import refused, warned

CONSTRAINED = """
import sys
import numpy as np
from pymoo.algorithms.moo.unsga3 import UNSGA3
from pymoo.core.problem import ElementwiseProblem
from pymoo.problems import get_problem
from pymoo_psi import FailureTolerant, nsga3
from pymoo_psi.algorithms import reference_directions, run_within_budget

class Steps(ElementwiseProblem):
    def __init__(self, log=()):
        self.log = log
        super().__init__(n_var=4, n_obj=2, n_ieq_constr=1, xl=0.01, xu=1)
    def _evaluate(self, x, out, *args, **kwargs):
        if x[3] > 0.8:
            raise ValueError("no convergence")
        out["F"] = [x[0], 1 - x[0] + x[1] ** 2]
        out["G"] = [np.floor(4 * x[1] + 4 * x[2]) - 1]  # many designs violate it alike

def bits(result):
    return [result.pop.get(name).tobytes().hex() for name in ("X", "F", "G")]

np.random.seed(int(sys.argv[1]))
names = ("osy", "welded_beam", "c1dtlz1")
steps = [FailureTolerant(Steps()), FailureTolerant(Steps(["x1"]))]
for problem in [*map(get_problem, names), *steps]:
    print(*bits(nsga3(problem, n_evaluations=200, seed=1)))
unified = UNSGA3(reference_directions(2, 20), seed=1, termination=("n_eval", 200))
print(*bits(run_within_budget(unified, FailureTolerant(Steps()), 200)))
"""


def test_a_seed_repeats_a_run_in_any_process(monkeypatch, capsys):
    """Whatever the state of NumPy's own generator, and the hashes of texts."""
    command = (sys.executable, "-W", "error", "-c", CONSTRAINED, "3")
    environment = os.environ | {"PYTHONHASHSEED": "7"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        monkeypatch.setattr(sys, "argv", ["", "4"])
        state = np.random.get_state()  # noqa: NPY002 - the other process seeds it, too
        exec(CONSTRAINED, {"__name__": "constrained"})
        np.random.set_state(state)  # noqa: NPY002
        here, there = capsys.readouterr().out.split(), process.communicate()[0].split()
    assert len(here) == 18
    assert here == there


@pytest.mark.parametrize("algorithm", [NSGA3, UNSGA3])
def test_ties_are_drawn_evenly_and_smaller_violations_win(algorithm):
    """Of four designs one is feasible, one violates least, two violate alike."""
    population = Population.new(F=np.zeros((4, 2)), G=np.array([[2.0], [1.0], [2.0], [0.0]]))
    run = algorithm(np.eye(2))
    seed_ties(run)
    assert run.mating.selection is not algorithm(np.eye(2)).mating.selection  # which all share
    np.random.seed(1)  # noqa: NPY002 - pymoo 0.6.1.5 has no other generator
    winners = run.mating.selection.do(
        None, population, 1500, 2, False, random_state=np.random.default_rng(1)
    )
    # Each meets itself never and every other with the same chance, once in each pair of a
    # permutation: the feasible one wins 1/2 of all, the next all but that with it: 1/3.
    shares = np.bincount(winners.ravel(), minlength=4) / winners.size
    np.testing.assert_allclose(shares, [1 / 12, 1 / 3, 1 / 12, 1 / 2], atol=0.02)


def test_pymoos_options_pass_through():
    seen = []
    nsga3(
        get_problem("dtlz2"),
        n_evaluations=10_000,
        seed=1,
        ref_dirs=np.eye(3),
        pop_size=10,
        termination=("n_gen", 3),
        callback=lambda algorithm: seen.append(algorithm.evaluator.n_eval),
    )
    assert seen == [10, 20, 30]


@given(n_obj=st.integers(2, 10), n_points=st.integers(1, 300))
def test_reference_directions_fit(n_obj, n_points):
    directions = reference_directions(n_obj, n_points)
    assert len(directions) <= max(n_points, n_obj)
    assert (directions >= 0).all()
    np.testing.assert_allclose(directions.sum(axis=1), 1)
    assert len(np.unique(directions.round(9), axis=0)) == len(directions)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: nsga3(get_problem("dtlz2"), 0), "n_evaluations must be an integer >= 1, got 0"),
        (lambda: nsga3(get_problem("sphere"), 9), "at least 2 for NSGA-III, got 1; use PSI"),
        (lambda: nsga3(get_problem("bnh"), 9, popsize=3), "'popsize'; did you mean 'pop_size'"),
        (lambda: investigate(Tours(permutation=True), 8), "of permutations; search perm"),
    ],
)  # fmt: skip
def test_bad_arguments(make, message):
    refused(message, make)


DISTANCES = np.random.default_rng(1).random((2, 9, 9))


class Tours(ElementwiseProblem):
    """Time and tolls of a tour."""

    def __init__(self, high=7, **attributes):
        super().__init__(n_var=8, n_obj=2, xl=0, xu=high, vtype=int)
        vars(self).update(attributes)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = DISTANCES[:, x, np.roll(x, 1)].sum(axis=1)


@pytest.mark.parametrize(
    ("make", "options"),
    [
        (lambda study: Tours(), {"sampling": PermutationRandomSampling()}),
        (lambda study: Tours(high=8), {"sampling": PermutationRandomSampling()}),
        (lambda study: Restricted(Tours(), {}), {"sampling": PermutationRandomSampling()}),
        (lambda study: Recorded(Tours(permutation=True), study=study), {}),  # it says so
    ],
)
def test_permutations_stay_permutations(make, options, study_file):
    X = nsga3(make(study_file), 300, seed=1, **options).pop.get("X").astype(int)
    np.testing.assert_array_equal(np.sort(X), np.broadcast_to(np.arange(8), X.shape))
    assert len(np.unique(X, axis=0)) > 10


@pytest.mark.parametrize(
    "problem",
    [
        create_random_tsp_problem(6),
        FlowshopScheduling(np.random.default_rng(1).random((3, 6))),
    ],
)
@pytest.mark.parametrize(
    "search",
    [
        lambda problem: investigate(problem, 8),
        lambda problem: nsga3(problem, 8),
        lambda problem: minimize(FailureTolerant(problem), PSI(8)),
        lambda problem: minimize(problem, SurrogatePSI(16)),
        lambda problem: minimize(problem, NSGA2(8, sampling=LPTauSampling()), ("n_gen", 1)),
    ],
)
def test_permutations_are_no_independent_integers(problem, search):
    refused("of permutations; search permutations by nsga3", search, problem)


@pytest.mark.parametrize(("n", "high", "budget"), [(4, 3, 1), (8, 7, 5), (8, 8, 333)])
def test_integers_are_no_permutations_whatever_their_bounds(n, high, budget):
    """And a budget is used exactly, also one below the size of a population."""
    problem = Model(lambda x: {"F": [x.sum(), x.prod()]}, n_var=n, xu=high, vtype=int)
    if high == n - 1:
        warned("an attribute permutation", investigate, problem, 8)
        problem.permutation = False
    assert len(investigate(problem, 8)) == 8
    assert nsga3(problem, budget, seed=1).algorithm.evaluator.n_eval == budget
