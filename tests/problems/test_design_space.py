"""The box of a problem is taken as it is."""

import numpy as np
import pytest
from pymoo.core.problem import Problem
from pymoo.core.variable import Real

from pymoo_psi import LPTauSampling, investigate
from pymoo_psi.problems import design_space
from tests.helpers.refusals import refused, warned


@pytest.mark.parametrize("n", [1, 7, 13, 49])
def test_points_at_the_ends_keep_bounds_of_integers(n):
    (variable,) = design_space(Problem(n_var=1, n_obj=2, xl=3, xu=n + 2, vtype=int)).variables
    for first in range(n):
        for last in range(first, n):
            ends = np.array(variable.between(2.5 + first, 3.5 + last))
            assert variable.values(ends).tolist() == [3 + first, 3 + last]


def test_places_go_on_outside_the_bounds():
    space = design_space(Problem(n_var=2, n_obj=2, xl=[2.0, 1e-2], xu=[4.0, 1.0]), log=["x2"])
    matrix = np.array([[2.0, 1e-2], [4.0, 1.0], [0.0, 1e-4], [6.0, 1e2], [3.0, 0.0]])
    expected = [[0, 0], [1, 1], [-1, -1], [2, 2]]
    np.testing.assert_allclose(space.places(matrix[:4]), expected, atol=1e-12)
    np.testing.assert_allclose(space.points(matrix[:4]), np.clip(expected, 0, 1), atol=1e-12)
    assert space.are_near(matrix).tolist() == [True, True, False, False, False]
    assert space.are_near(matrix, 1.01).tolist() == [True, True, True, True, False]


def test_integers_with_names_are_no_places_in_a_permutation():
    """Without one, integers with such bounds may be, and a warning asks."""
    problem = Problem(n_var=4, n_obj=1, xl=0, xu=3, vtype=int)
    warned("an attribute permutation", LPTauSampling(), problem, 4)
    problem.names = {"x2": "teeth"}
    assert len(LPTauSampling()(problem, 4)) == 4


def test_names_of_variables_are_texts():
    problem = Problem(vars={0: Real(bounds=(0, 1))}, n_obj=1)
    refused("must be of type str, got int", investigate, problem, 4, error=TypeError)
