"""The box of a problem is taken as it is, or refused."""

import numpy as np
import pytest
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Integer

from pymoo_psi import PsiError, investigate
from pymoo_psi.problems import design_space


def whole(lower, upper):
    return ElementwiseProblem(vars={"a": Integer(bounds=(lower, upper))}, n_obj=2)


@pytest.mark.parametrize(
    ("lower", "upper"), [(0, 2**53 + 1), (2**60, 2**60 + 7), (-(2**53) - 1, 0), (0, 2**64)]
)
def test_integers_that_float64_does_not_hold_are_refused(lower, upper):
    for problem in (whole(lower, upper), Problem(n_var=1, n_obj=2, xl=lower, xu=upper, vtype=int)):
        with pytest.raises(PsiError, match=r"below 2\^53 in size for an integer variable"):
            investigate(problem, 8)


def test_the_largest_integers_are_reached():
    (variable,) = design_space(whole(2**53 - 4, 2**53 - 1)).variables
    values = variable.values(np.array([0, 0.25, 0.5, 0.75]))
    assert values.tolist() == [2**53 - k for k in (4, 3, 2, 1)]


def test_limits_on_integers_are_kept_by_the_points_at_their_ends():
    """Also where k/n, rounded, lies in the part of the integer beside."""
    for n in (1, 7, 13, 49):
        (variable,) = design_space(whole(3, n + 2)).variables
        for first in range(n):
            for last in range(first, n):
                ends = np.array(variable.between(2.5 + first, 3.5 + last))
                assert variable.values(ends).tolist() == [3 + first, 3 + last]


def test_sizes_may_be_integers_of_numpy(tmp_path):
    problem = Problem(n_var=1, n_obj=np.int32(2), n_ieq_constr=np.int64(0), xl=0, xu=1)
    problem._evaluate = lambda X, out: out.update(F=np.hstack([X, 1 - X]))
    assert len(investigate(problem, 8, study=tmp_path / "a.db")) == 8
