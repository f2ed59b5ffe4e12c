"""The continuous Salukvadze optimum against a fine grid and closed forms."""

import numpy as np
import pytest
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi import PSI, VectorizedSphereChute, investigate, rank_of_efficiency
from pymoo_psi.algorithms import refine


class Parabolas(Problem):
    """Two parabolas over a square; by symmetry the optimum is at (0.5, 0)."""

    def __init__(self, limit=9.0, xl=0.0, xu=1.0):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=xl, xu=xu)
        self.limit = limit

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = np.column_stack([x[:, 0] ** 2 + x[:, 1], (1 - x[:, 0]) ** 2 + x[:, 1]])
        out["G"] = x[:, :1] - self.limit


def best_of(problem, n, **options):
    result = minimize(problem, PSI(n))
    ranking = rank_of_efficiency(result.F, **options)
    return result.X[ranking.salukvadze[0]], ranking


def test_a_constraint_is_kept():
    ranking = rank_of_efficiency([[0.0, 1.0], [1.0, 0.0]])
    refined = refine(Parabolas(limit=0.4), [0.1, 0.3], ranking)
    assert refined.x[0] <= 0.4
    np.testing.assert_allclose(refined.x, [0.4, 0], atol=1e-6)


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize("mu", [0.2, 0.4, 0.6])
def test_no_design_of_a_fine_grid_is_nearer(mu, normalize):
    problem = VectorizedSphereChute(mu, model="rolling")
    x0, ranking = best_of(problem, 1024, normalize=normalize)
    refined = refine(problem, x0, ranking)
    u1, v_p = np.meshgrid(np.linspace(0, 3.5 * mu, 200), np.linspace(0.1, 6, 200))
    F = problem.evaluate(np.column_stack([u1.ravel(), v_p.ravel()]), return_values_of=["F"])
    assert refined.distance <= ranking.frame.distances(F)[:, 0].min()
    assert refined.distance < refined.start_distance == ranking.criteria[ranking.salukvadze[0], 0]


@pytest.mark.parametrize("attribute", [True, False])
def test_an_objective_that_the_problem_has_turned(attribute):
    """f2 = 7 - (1 - x1)² - x2 is maximised, and given to pymoo with its sign turned."""

    class Turned(Parabolas):
        def _evaluate(self, x, out, *args, **kwargs):
            super()._evaluate(x, out)
            out["F"] -= [0.0, 7.0]

    plain, problem = Turned(), Turned()
    problem.maximize = ["f2"] if attribute else []
    table = investigate(problem, 64, maximize=["f2"])
    best = table.X[table.pareto()][table.ranking().salukvadze[0]]
    refined = refine(problem, best, table.ranking())
    expected = refine(plain, best, rank_of_efficiency(table.F))
    assert refined.x.tolist() == expected.x.tolist()
    assert refined.start_distance == table.ranking().criteria[:, 0].min()


def test_an_optimum_at_an_upper_bound_is_in_the_box():
    """-0.1 + (0.2 - -0.1) is above 0.2 in float64."""
    problem = Parabolas(xl=-0.1, xu=0.2)
    refined = refine(problem, [0.15, 0.0], rank_of_efficiency([[-1.0, 1.0], [1.0, -1.0]]))
    assert refined.x[0] == 0.2
