"""The rule of feasibility is pymoo's, and stands still in the face of NaN."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pymoo.core.population import Population

from pymoo_psi.pareto import meets_constraints, violated_constraints

EDGES = st.sampled_from([-1.0, 0.0, 5e-324, 1e-5, -1e-4, 1e-4, 1.0001e-4, 1.0, np.inf, -np.inf])


@given(arrays(np.float64, (6, 2), elements=EDGES), arrays(np.float64, (6, 1), elements=EDGES))
def test_it_is_pymoos_rule(G, H):
    population = Population.new("X", np.zeros((6, 1)), F=np.zeros((6, 1)), G=G, H=H)
    pymoo = np.array([individual.feas for individual in population])
    np.testing.assert_array_equal(meets_constraints(G, H), pymoo)


def test_a_value_that_is_not_known_breaks_its_constraint():
    G, H = np.array([[np.nan, 0.0], [0.0, 0.0]]), np.array([[0.0], [np.nan]])
    assert violated_constraints(G, H).tolist() == [[True, False, False], [False, False, True]]
