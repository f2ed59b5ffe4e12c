"""Linear equalities in requirements: designs meet them and fill what is left of the bounds evenly."""

from functools import partial

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.core.variable import Choice, Integer, Real
from pymoo.optimize import minimize
from scipy.stats import beta, ks_2samp, kstest

from pymoo_psi import (
    FailureTolerant,
    LPTauSampling,
    Recorded,
    Required,
    Restricted,
    SurrogatePSI,
    UniformSampling,
    investigate,
    nsga3,
)
from pymoo_psi.problems import design_space, with_requirements
from tests.helpers.models import Model
from tests.helpers.refusals import refused


class Mixture(Problem):
    """Shares of components a, b, c, ..., whose sum the model checks."""

    def __init__(self, lower, upper, requirements):
        self.names = {f"x{j}": "_abcdefgh"[j] for j in range(1, len(lower) + 1)}
        self.requirements = requirements
        super().__init__(n_var=len(lower), n_obj=2, xl=np.array(lower), xu=np.array(upper))

    def _evaluate(self, X, out, *args, **kwargs):
        out["F"] = np.column_stack([X[:, 0] ** 2 + X[:, 2], (X[:, 1] - 0.3) ** 2])


class Random(UniformSampling):
    def unit_points(self, n_points, n_dim, *, first=1, random_state=None):
        return np.random.default_rng(5).random((n_points, n_dim))


# lower and upper bounds, requirements, coefficients and constants of the last variables, each of
# which follows from the variables before
THREE = ([0, 0, 0.0], [0.6, 0.7, 0.5], ["a + b + c = 1"], [([-1, -1], 1)])
CASES = {
    "3": THREE,
    "4": ([0, 0.1, 0, 0.05], [0.5, 0.6, 0.4, 0.3], ["a + b + c + d = 1"], [([-1, -1, -1], 1)]),
    "5": (
        [0, 0.1, 0, 0.05, 0],
        [0.5, 0.4, 0.4, 0.3, 0.1],
        ["1 - a - b = c + d + e"],
        [([-1, -1, -1, -1], 1)],
    ),
    "8": (
        [0, 0.02, 0, 0.01, 0, 0.1, 0, 0],
        [0.5, 0.4, 0.3, 0.3, 0.1, 0.25, 0.02, 0.2],
        ["a + b + c + d + e + f + g + h = 1"],
        [([-1] * 7, 1)],
    ),
    "weighted": ([10, 0, -3.0], [20, 4, 50.0], ["c = (2*a - 3*b) / 2 + 1"], [([1, -1.5], 1)]),
    "coupled": (
        [0, 0, 0, 0.8],
        [1, 1, 1, 1.2],
        {"mix": "a + b + c = 1", "total": "d = 2*a + b"},
        [([-1, -1], 1), ([2, 1, 0], 0)],
    ),
}
cases = pytest.mark.parametrize(
    ("lower", "upper", "requirements", "rules"), CASES.values(), ids=CASES
)


def followed(X, rules):
    """Return designs with the variables that follow from others."""
    for coefficients, constant in rules:
        X = np.column_stack([X, X[:, : len(coefficients)] @ coefficients + constant])
    return X


def rejection(lower, upper, rules, count):
    """Return random designs, uniform within the bounds, by rejection."""
    n_free = len(lower) - len(rules)
    draw = partial(np.random.default_rng(11).uniform, lower[:n_free], upper[:n_free])
    designs = np.zeros((0, len(lower)))
    while len(designs) < count:
        X = followed(draw((100_000, n_free)), rules)
        designs = np.vstack([designs, X[((lower <= X) & (upper >= X)).all(axis=1)]])
    return designs[:count]


@cases
def test_every_design_meets_the_equalities_within_the_bounds(lower, upper, requirements, rules):
    table = investigate(Mixture(lower, upper, requirements), 16)
    assert investigate(Required(Mixture(lower, upper, requirements)), 16).equals(table)
    assert (table.status == "ok").all()
    assert ((lower <= table.X) & (upper >= table.X)).all()
    expected = followed(table.X[:, : len(lower) - len(rules)], rules)
    np.testing.assert_allclose(table.X, expected, rtol=0, atol=1e-12 * np.max(np.abs(upper)))


@cases
def test_designs_are_even_like_those_of_rejection(lower, upper, requirements, rules):
    reference = rejection(lower, upper, rules, 20_000)
    spread = reference.std(axis=0)
    X = investigate(Mixture(lower, upper, requirements), 4096).X
    assert np.abs((X.mean(axis=0) - reference.mean(axis=0)) / spread).max() < 0.02
    covariance = (np.cov(X.T) - np.cov(reference.T)) / np.outer(spread, spread)
    assert np.abs(covariance).max() < 0.03
    # two samples of independent designs: each variable, and sums and differences of any two
    Y = investigate(Mixture(lower, upper, requirements), 4096, sampling=Random()).X
    directions = np.random.default_rng(2).normal(size=(12, len(lower)))
    for direction in [*np.eye(len(lower)), *directions] / spread:
        assert ks_2samp(Y @ direction, reference @ direction).pvalue > 1e-3


def test_designs_near_the_upper_bounds_are_even():
    """What eight components lack of their bounds is uniform on a simplex (Dirichlet)."""
    X = investigate(Mixture([0.0] * 8, [0.1255] * 8, ["a + b + c + d + e + f + g + h = 1"]), 2048).X
    for lacking in (0.1255 - X.T) / 0.004:
        assert kstest(lacking, beta(1, 7).cdf).statistic < 0.03


@pytest.mark.parametrize("case", [CASES["5"], CASES["coupled"]])
def test_a_point_has_its_design_whatever_others_there_are(case):
    problem = Mixture(*case[:3])
    X = investigate(problem, 64).X
    np.testing.assert_array_equal(investigate(problem, 9).X, X[:9])
    np.testing.assert_array_equal(investigate(problem, 20, first=31, block_size=7).X, X[30:50])
    np.testing.assert_array_equal(LPTauSampling().do(problem, 64).get("X"), X)
    assert len(np.unique(X.round(9), axis=0)) == 64


@pytest.mark.parametrize("case", [CASES[name] for name in ("3", "5", "8", "weighted")])
def test_a_design_has_its_point(case):
    """Surrogates learn a design from elsewhere at the point that the sequence would have for it."""
    space = design_space(with_requirements(Mixture(*case[:3]), None))
    points = LPTauSampling().unit_points(64, len(case[0]) - 1, first=3)
    X = space.matrix(points)
    np.testing.assert_allclose(space.points(X), points, rtol=0, atol=1e-9)
    np.testing.assert_allclose(space.places(X), space.places_at(points), rtol=0, atol=1e-9)
    assert space.are_near(X).all()


def test_a_fixed_share_leaves_less_for_the_others():
    problem = Mixture(*THREE[:3])
    X = investigate(Restricted(problem, {"a": 0.2}), 32).X
    np.testing.assert_allclose(X[:, 0], 0.2)
    np.testing.assert_allclose(X.sum(axis=1), 1, atol=1e-12)
    np.testing.assert_array_equal(investigate(Restricted(Required(problem), {"a": 0.2}), 32).X, X)


def test_proposals_meet_equalities_and_inequalities():
    algorithm = SurrogatePSI(
        26, n_points=12, batch=7, requirements={"mix": "a + b + c + d + e = 1", "order": "a <= b"}
    )
    X = minimize(Mixture(*CASES["5"][:3]), algorithm, seed=1).algorithm.table.X
    np.testing.assert_allclose(X.sum(axis=1), 1, rtol=0, atol=1e-12)
    assert (X[12:, 0] <= X[12:, 1]).all()


def test_designs_of_others_may_be_rounded():
    problem = Required(Mixture(*THREE[:3]))
    X = np.array([[0.333333, 0.333333, 0.333334], [0.3333333333, 0.3333333333, 0.3333333333]])
    assert (problem.evaluate(X, return_values_of=["G"]) == 0).all()
    wrong = problem.evaluate(np.array([[0.3, 0.3, 0.3]]), return_values_of=["F", "G"])
    assert np.isinf(wrong[0]).all()
    np.testing.assert_allclose(wrong[1], 0.1)
    assert problem.n_not_run == 1


def test_an_equality_is_as_accurate_as_its_terms():
    """Also where these cancel: half a percent of a + b + 0.1 is 0.995 to 1."""
    problem = Required(Mixture([0, 0, 0], [200, 200, 1], ["a - b = 0.1"]))
    X = np.array([[100, 100, 0.5], [100, 99, 0.5], [100, 98.9, 0.5], [99, 100, 0.5]])
    np.testing.assert_allclose(problem.evaluate(X, return_values_of=["G"])[:, 0], [0, 0, 1, 1.1])


MIXED = Model(
    lambda x: {"F": x["n"]},
    vars={
        "x": Real(bounds=(1, 9)),
        "y": Real(bounds=(1, 9)),
        "n": Integer(bounds=(1, 5)),
        "s": Choice(options=["a", "b"]),
    },
    n_obj=1,
)


@pytest.mark.parametrize(
    ("problem", "requirements", "options", "message"),
    [
        *(
            (Mixture(*THREE[:2], None), requirements, {}, "equalit")
            for requirements in (
                ["a*b = 0.1"],
                ["a/b = 2"],
                ["abs(a) + b = 1"],
                ["sqrt(a) + b = 1"],
                ["a = 0.5"],
                ["1 = 1"],
                ["a + b == 1"],
                ["a = b = c"],
                ["a <= b = c"],
                ["a + b + c = 5"],
                ["a + b + c = 1", "a + b + c = 0.9"],
                ["a + b + c = 1", "a + b = 0.2"],
            )
        ),
        (MIXED, ["x + n = 5"], {}, "real and on a linear scale"),
        (MIXED, ["x + s = 5"], {}, "real and on a linear scale"),
        (MIXED, ["x + y = 10"], {"log": ["x"]}, "real and on a linear scale"),
    ],
)
def test_other_equalities_are_refused(problem, requirements, options, message):
    refused(message, investigate, problem, 4, requirements=requirements, **options)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("once", "again"),
    [
        (THREE[2], ["c + b = 1 - a"]),
        (THREE[2], ["2*a + 2*b + 2*c = 2"]),
        (THREE[2], ["(a + b + c)/3 = 1/3", "0.1*a + 0.1*b + 0.1*c = 0.1"]),
        (["a + b + c = 1", "a - b = 0.1"], ["2*a + c = 1.1"]),
    ],
)
def test_an_equality_that_follows_from_others_counts_once(once, again):
    repeated = investigate(Mixture(*THREE[:2], once + again), 32)
    np.testing.assert_array_equal(repeated.X, investigate(Mixture(*THREE[:2], once), 32).X)
    assert (repeated.status == "ok").all()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("bound", [0, 1])
def test_an_equality_may_leave_one_value_of_each_variable(n, bound):
    rule = " + ".join("abc"[:n]) + f" = {n * bound}"
    X = investigate(Mixture([0, 0, 0, 0], [1, 1, 1, 1], [rule]), 8).X
    assert (X[:, :n] == bound).all()
    assert len({*X[:, 3]}) == 8


def test_variables_of_equalities_are_real():
    table = investigate(MIXED, 16, requirements=["x + y = 10"])
    np.testing.assert_allclose(np.sum(table.X[:, :2], axis=1).astype(float), 10)
    assert {*table.X[:, 3]} == {"a", "b"}


def test_algorithms_that_search_between_bounds_are_refused(study_file):
    problem = Mixture(*THREE[:3])
    for searched in (Required(problem), FailureTolerant(problem), Recorded(problem, study_file)):
        refused("search it by PSI", minimize, searched, NSGA2(pop_size=10), ("n_gen", 2), seed=1)
    refused("search it by PSI", nsga3, problem, 20, seed=1)
