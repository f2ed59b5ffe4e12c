"""Algorithms of pymoo, every multi-objective one, on designs that fail."""

import contextlib
import inspect

import numpy as np
import pymoo.algorithms.moo
import pytest
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.algorithms.soo.nonconvex.isres import ISRES
from pymoo.algorithms.soo.nonconvex.nelder import NelderMead
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.algorithm import Algorithm
from pymoo.optimize import minimize
from pymoo.util.ref_dirs import get_reference_directions

from pymoo_psi import PSI, FailureTolerant
from tests.helpers.draws import rarely
from tests.helpers.models import Model
from tests.helpers.parts import parts

ARGUMENTS = {
    "pop_size": 10,
    "ref_dirs": get_reference_directions("das-dennis", 2, n_partitions=9),
    "ref_points": np.array([[0.3, 0.7]]),
    "pop_per_ref_point": 10,
    "n_neighbors": 5,
}
UNCONSTRAINED = {"MOEAD", "ParallelMOEAD", "KGB", "DNSGA2"}  # refuse problems with constraints


def made(kind):
    known = inspect.signature(kind).parameters
    required = {name for name, p in known.items() if p.default is p.empty}
    names = (required | {"ref_dirs", "n_neighbors"}) & set(known) & set(ARGUMENTS)
    return kind(**{name: ARGUMENTS[name] for name in names or {"pop_size"}})


ALGORITHMS = {}
for kind in parts(pymoo.algorithms.moo, Algorithm):
    with contextlib.suppress(TypeError):  # PINSGA2 of pymoo 0.6.1.5
        ALGORITHMS[made(kind).__class__.__name__] = kind


def half(hole, scale=1.0, n_obj=2):
    """A front from (0, 1) to (1, 0) whose designs raise in a part of the box."""

    def results(x):
        distance = ((x[1:] - 0.4) ** 2).sum()
        return {"F": [scale * (x[0] + distance), 1 - x[0] + distance][:n_obj]}

    return Model(results, fails=lambda x: x[1] < hole, n_var=3, n_obj=n_obj)


# pymoo's SPEA2 divides by a span of 0 where a single design is left
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning:pymoo")
@pytest.mark.parametrize("name", ALGORITHMS)
@pytest.mark.parametrize(
    ("failed_as", "hole", "scale"),
    [
        ("constraint", 0.5, -1e6),
        ("penalty", 0.95, 1e12),
        pytest.param("constraint", 0.95, 1e12, marks=pytest.mark.slow),
        pytest.param("penalty", 0.5, -1e6, marks=pytest.mark.slow),
    ],
)
def test_no_failed_design_is_in_a_result(name, failed_as, hole, scale):
    problem = FailureTolerant(half(hole, scale), failed_as=failed_as)
    if (name, hole) == ("KGB", 0.95):
        pytest.skip("it samples more useful designs than a population may have")
    refusal = contextlib.nullcontext()
    if failed_as == "constraint" and name in UNCONSTRAINED:
        refusal = pytest.raises(AssertionError, match="constrain")
    with refusal:
        result = minimize(problem, made(ALGORITHMS[name]), ("n_gen", 5), seed=1)
        assert problem.failures
        assert hole == 0.95 or result.F is not None
        if result.F is not None:
            assert (result.opt.get("failure") == "").all()
            np.testing.assert_array_equal(result.F, half(hole, scale).evaluate(result.X))


@pytest.mark.parametrize("name", ["NSGA2", "MOEAD", "RVEA"])
def test_nothing_is_the_result_where_all_designs_fail(name):
    problem = FailureTolerant(half(2.0), failed_as="penalty")
    assert minimize(problem, made(ALGORITHMS[name]), ("n_gen", 3), seed=1).F is None


@pytest.mark.parametrize("hole", [0.97, *rarely(0.3, 2.0)])
@pytest.mark.parametrize(
    "make", [lambda: PSI(300), GA, DE, PSO, ISRES, NelderMead, lambda: CMAES(x0=np.full(3, 0.5))]
)
def test_no_algorithm_of_one_objective_returns_failed_designs(make, hole):
    """With some designs failing, nearly all, and all."""
    result = minimize(FailureTolerant(half(hole, n_obj=1)), make(), ("n_gen", 5), seed=1)
    assert result.F is not None or hole > 0.3
    if result.F is not None:
        assert (np.isinf(result.F) == (hole == 2.0)).all()
        assert ((np.atleast_1d(result.opt.get("failure")) == "") == (hole < 2.0)).all()


def test_penalties_are_worse_than_all_before():
    problem = FailureTolerant(half(0.5, -1e6), failed_as="penalty")
    assert not problem.has_constraints()
    X = np.random.default_rng(1).random((200, 3))
    F = problem.evaluate(X)
    failed = X[:, 1] < 0.5
    assert np.isfinite(F).all()
    assert (F[failed] > F[~failed].max(axis=0)).all()
    assert len(np.unique(F[failed], axis=0)) == failed.sum()
    np.testing.assert_array_equal(problem.evaluate(X[::-1])[::-1], F)


def test_what_fails_before_any_other_design_is_no_better_than_later_ones():
    problem = FailureTolerant(half(0.5, 1e6), failed_as="penalty")
    failed, other = (problem.evaluate(np.array([[0.9, x, 0.9]])) for x in (0.1, 0.9))
    assert (failed > other).all()
