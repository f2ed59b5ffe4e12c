"""The box of a problem is taken as it is."""

import numpy as np
from pymoo.core.problem import Problem

from pymoo_psi.problems import design_space


def test_points_at_the_ends_keep_bounds_of_integers():
    for n in (1, 7, 13, 49):
        space = design_space(Problem(n_var=1, n_obj=2, xl=3, xu=n + 2, vtype=int))
        (variable,) = space.variables
        for first in range(n):
            for last in range(first, n):
                ends = np.array(variable.between(2.5 + first, 3.5 + last))
                assert variable.values(ends).tolist() == [3 + first, 3 + last]
