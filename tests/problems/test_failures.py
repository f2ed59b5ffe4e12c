"""Designs that fail: which ones, with which reason, and that no algorithm goes astray."""

import numpy as np
import pytest
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.algorithms.soo.nonconvex.isres import ISRES
from pymoo.algorithms.soo.nonconvex.nelder import NelderMead
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.optimize import minimize

from pymoo_psi import PSI, FailureTolerant


def values(x):
    """Two objectives of a design, or what goes wrong at some first variables."""
    if x[0] == 1:
        raise ZeroDivisionError("float division by zero")
    if x[0] == 2:
        return [np.nan, 1.0]
    if x[0] == 5:
        return None
    return [x[0], x[1]]


REASONS = {1: "ZeroDivisionError: float division by zero", 2: "F is [nan, 1.0]", 5: "F is missing"}


class OneByOne(ElementwiseProblem):
    def __init__(self, n_ieq=1, n_eq=1, **kwargs):
        super().__init__(
            n_var=2, n_obj=2, n_ieq_constr=n_ieq, n_eq_constr=n_eq, xl=0, xu=20, **kwargs
        )

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = values(x)
        if self.n_ieq_constr:
            out["G"] = x[1] - 50
        if self.n_eq_constr:
            out["H"] = 0.0


X = np.column_stack([np.arange(12.0), np.linspace(0, 11, 12)])
BAD = list(REASONS)
GOOD = [0, 3, 4, *range(6, 12)]


@pytest.mark.parametrize(("n_ieq", "n_eq"), [(0, 0), (1, 1)])
def test_failed_designs_are_infeasible_with_their_reasons(n_ieq, n_eq):
    problem = FailureTolerant(OneByOne(n_ieq, n_eq))
    out = problem.evaluate(X, return_as_dictionary=True, return_values_of=["F", "G", "H"])
    np.testing.assert_array_equal(out["F"][GOOD], X[GOOD])
    assert (out["G"][BAD, -1] > 1e9).all()
    np.testing.assert_array_equal(out["G"][GOOD, -1], 0.0)
    assert out["G"].shape == (12, n_ieq + 1)
    assert out["H"].shape == (12, n_eq)
    reasons = out["failure"]
    assert not any(reasons[GOOD])
    assert reasons[1] == REASONS[1]
    assert [failure.reason for failure in problem.failures] == reasons[BAD].tolist()
    np.testing.assert_array_equal([failure.design for failure in problem.failures], X[BAD])


def test_further_values_stay_with_their_designs():
    class Talkative(ElementwiseProblem):
        def _evaluate(self, x, out, *args, **kwargs):
            if x[0] in (0, 2):
                raise ValueError
            out["F"], out["stress"], out["note"] = x[0], [x[0], 1.0], {"x": x[0]}

    problem = FailureTolerant(Talkative(n_var=1, n_obj=1, xl=0, xu=9))
    out = problem.evaluate(np.arange(4.0)[:, None], return_as_dictionary=True)
    np.testing.assert_array_equal(out["stress"], [[np.nan] * 2, [1, 1], [np.nan] * 2, [3, 1]])
    assert out["note"].tolist() == [None, {"x": 1.0}, None, {"x": 3.0}]


# Front and box


class Holed(Problem):
    """A front from (0, 1) to (1, 0), and NaN in a part of the box."""

    def __init__(self, hole=0.3, n_obj=2, **kwargs):
        super().__init__(n_var=3, n_obj=n_obj, xl=0, xu=1, **kwargs)
        self.hole = hole

    def _evaluate(self, X, out, *args, **kwargs):
        distance = ((X[:, 1:] - 0.5) ** 2).sum(axis=1)
        F = np.column_stack([X[:, 0] + distance, 1 - X[:, 0] + distance])[:, : self.n_obj]
        F[X[:, 1] < self.hole] = np.nan
        out["F"] = F


ONE = {
    "PSI": lambda: PSI(300),
    "GA": lambda: GA(pop_size=20),
    "DE": lambda: DE(pop_size=20),
    "PSO": lambda: PSO(pop_size=20),
    "ISRES": lambda: ISRES(),
    "NelderMead": lambda: NelderMead(),
    "CMAES": lambda: CMAES(x0=np.full(3, 0.5)),
}


@pytest.mark.parametrize("hole", [0.3, 0.97, 2.0])
@pytest.mark.parametrize("name", ONE)
def test_no_algorithm_warns_or_returns_a_failed_design(name, hole):
    """With some designs failing, nearly all, and all."""
    problem = FailureTolerant(Holed(hole, n_obj=1))
    result = minimize(problem, ONE[name](), ("n_gen", 5), seed=1)
    if hole == 0.3:
        assert result.F is not None
    if hole == 2.0:
        assert result.F is None or np.isinf(result.F).all()
    elif result.F is not None:
        assert np.isfinite(result.F).all()
        assert (np.atleast_1d(result.opt.get("failure")) == "").all()
