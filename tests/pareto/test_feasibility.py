"""The rule of feasibility is pymoo's, and stands still in the face of NaN."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pymoo.core.population import Population

from pymoo_psi.pareto import competes, meets_constraints, violated_constraints

EDGES = st.sampled_from([-1.0, 0.0, 5e-324, 1e-5, -1e-4, 1e-4, 1.0001e-4, 1.0, np.inf, -np.inf])


@given(arrays(np.float64, (6, 2), elements=EDGES), arrays(np.float64, (6, 1), elements=EDGES))
def test_it_is_pymoos_rule(G, H):
    population = Population.new("X", np.zeros((6, 1)), F=np.zeros((6, 1)), G=G, H=H)
    pymoo = np.array([individual.feas for individual in population])
    np.testing.assert_array_equal(meets_constraints(G, H), pymoo)


def test_a_value_that_is_not_known_breaks_its_constraint():
    G, H = np.array([[np.nan, 0.0], [0.0, 0.0]]), np.array([[0.0], [np.nan]])
    assert violated_constraints(G, H).tolist() == [[True, False, False], [False, False, True]]


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_designs_without_constraints_meet_them_all(shape):
    none = np.zeros((*shape, 0))
    assert meets_constraints(none, none).shape == shape
    assert meets_constraints(none, none).all()


def test_only_feasible_designs_with_finite_objectives_compete():
    F = np.array([[1.0, 2.0], [np.inf, 0.0], [0.0, np.nan], [0.0, 0.0]])
    assert competes(F, np.array([True, True, True, False])).tolist() == [True, False, False, False]
