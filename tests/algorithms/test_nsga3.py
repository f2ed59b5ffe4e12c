"""NSGA-III as the alternative: budget, reference directions, repeatability."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymoo.problems import get_problem

from pymoo_psi import PsiError, SphereChute, VectorizedSphereChute, nsga3
from pymoo_psi.algorithms._nsga3 import reference_directions


class Counted(VectorizedSphereChute):
    """Counts evaluations itself."""

    count = 0

    def _evaluate(self, x, out, *args, **kwargs):
        self.count += len(x)
        super()._evaluate(x, out, *args, **kwargs)


@pytest.mark.parametrize("budget", [1, 5, 100, 333])
def test_the_budget_is_used_exactly(budget):
    problem = Counted(0.4, model="rolling")
    result = nsga3(problem, n_evaluations=budget, seed=1)
    assert problem.count == budget == result.algorithm.evaluator.n_eval


def test_a_seed_repeats_a_run():
    runs = [nsga3(get_problem("dtlz2"), n_evaluations=300, seed=s).F for s in (3, 3, 4)]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


def test_it_comes_nearer_to_the_front_with_a_larger_budget():
    """On DTLZ2 the Pareto front is the unit sphere."""
    problem = get_problem("dtlz2", n_var=7, n_obj=3)
    few, many = (
        np.abs(np.linalg.norm(nsga3(problem, n_evaluations=n, seed=1).F, axis=1) - 1).mean()
        for n in (200, 4000)
    )
    assert many < few / 4


def test_stalling_designs_do_no_harm():
    """Backspin stops the sphere on gentle slopes; these designs have infinite objectives."""
    problem = SphereChute(1.0, c=0.1, omega0=(0, -20, 0))
    result = nsga3(problem, n_evaluations=300, seed=1)
    assert (result.G <= 0).all()
    assert np.isfinite(result.F).all()
    assert len(result.F) > 5


def test_pymoos_options_pass_through():
    seen = []
    result = nsga3(
        get_problem("dtlz2"),
        n_evaluations=10_000,
        seed=1,
        ref_dirs=np.eye(3),
        pop_size=10,
        termination=("n_gen", 3),
        callback=lambda algorithm: seen.append(algorithm.n_gen),
    )
    assert seen == [1, 2, 3]
    assert result.algorithm.evaluator.n_eval == 30


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
        (
            lambda: nsga3(get_problem("dtlz2"), n_evaluations=0),
            "n_evaluations must be an integer >= 1, got 0",
        ),
        (
            lambda: nsga3(get_problem("sphere"), n_evaluations=9),
            "at least 2 for NSGA-III, got 1; use one of",
        ),
        (
            lambda: nsga3(get_problem("dtlz2"), n_evaluations=9, popsize=3),
            "'popsize'; did you mean 'pop_size'",
        ),
        (lambda: nsga3("dtlz2", n_evaluations=9), "problem must be a pymoo Problem, got 'dtlz2'"),
    ],
)
def test_bad_arguments(make, message):
    with pytest.raises(PsiError, match=message):
        make()
