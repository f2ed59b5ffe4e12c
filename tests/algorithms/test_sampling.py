"""Sampling operators inside pymoo's algorithms."""

import numpy as np
import pytest
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from scipy.stats import qmc

from pymoo_psi import (
    PSI,
    LPTauSampling,
    QMCSampling,
    Restricted,
    SurrogatePSI,
    UniformSampling,
    investigate,
    lp_tau,
)
from tests.helpers.models import Model
from tests.helpers.refusals import refused

PROBLEM, MANY, TWO = get_problem("zdt1", n_var=4), get_problem("zdt1", n_var=60), get_problem("bnh")


@pytest.mark.parametrize("engine", ["sobol", "halton", "latin_hypercube", "lhs", "poisson_disk"])
def test_engines_fill_the_box_repeatably(engine):
    X, again, other = (
        QMCSampling(engine).do(TWO, 20, random_state=np.random.default_rng(seed)).get("X")
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(X, again)
    assert not np.array_equal(X, other)
    assert X.shape == (20, 2)
    assert ((TWO.xl <= X) & (TWO.xu >= X)).all()


def test_beyond_51_variables_the_points_are_scipys():
    """Numbered as they come: a run in two parts has the points of one, as with LPτ."""
    table = minimize(MANY, PSI(40)).algorithm.table
    np.testing.assert_array_equal(table.X, qmc.Sobol(60, scramble=False).random_base2(6)[:40])
    assert investigate(MANY, 13).merge(investigate(MANY, 27, first=14)).equals(table)
    # the free variables count, not those of the whole problem
    few = Restricted(MANY, {f"x{j}": 0.0 for j in range(52, 61)})
    np.testing.assert_array_equal(investigate(few, 8).X[:, :51], lp_tau(8, 51))


@pytest.mark.parametrize("engine", ["sobol", "halton"])
@pytest.mark.parametrize("scramble", [False, True])
def test_a_continued_sequence_is_the_whole_one(engine, scramble):
    sampling = QMCSampling(engine, scramble=scramble)
    whole, *parts = (
        sampling.unit_points(n, 3, first=first, random_state=np.random.default_rng(5))
        for n, first in ((37, 1), (16, 1), (1, 17), (20, 18))
    )
    np.testing.assert_array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: investigate(TWO, 8, sampling="lhs", share=(1, 2)), "seed must be given for randomised points in a study or a share"),
        (lambda: investigate(TWO, 8, sampling="lhs", seed=1, more=True, study="s.db"), "more must be used with a sequence that can be continued"),
        (lambda: QMCSampling("soboll"), "got 'soboll'; did you mean 'sobol'"),
        (lambda: LPTauSampling().do(MANY, 10), "at most 51 for LPτ, got 60; use QMCSampling"),
        (lambda: investigate(PROBLEM, 8, sampling=Kronecker(shift=0.5)), "unit_points of sampling must be 8 points"),
        (lambda: QMCSampling("poisson_disk").do(TWO, 100_000), "n_samples must be at most .* use another engine"),
    ],
)  # fmt: skip
def test_bad_arguments(call, message, in_folder):
    refused(message, call)


# Three variables, the second of which has one value.
PINNED = Model(
    lambda x: {"F": [x[0] + x[1], 1 - x[0] + (x[2] - 0.3) ** 2]},
    n_var=3,
    xl=np.array([0.0, 2.0, 0.0]),
    xu=np.array([1.0, 2.0, 1.0]),
)


@pytest.mark.parametrize(
    "run",
    [
        lambda problem: minimize(problem, PSI(16)).algorithm.table,
        lambda problem: investigate(problem, 16, sampling="halton", seed=1),
        lambda problem: minimize(problem, SurrogatePSI(28, batch=4), seed=1).algorithm.table,
    ],
)
def test_equal_bounds_fix_a_variable_as_restricted_does(run):
    """It takes no dimension of the points, and surrogates do not see it."""
    table = run(PINNED)
    assert (table.X[:, 1] == 2).all()
    np.testing.assert_array_equal(table.X, run(Restricted(PINNED, {"x2": 2.0})).X)


class Kronecker(UniformSampling):
    """A sequence of a user's own."""

    def __init__(self, root=2.0, shift=0.0):
        super().__init__()
        self.root, self.shift = root, shift

    def unit_points(self, n_points, n_dim, *, first=1, random_state=None):
        numbers = np.arange(first, first + n_points)[:, None]
        return numbers * np.sqrt(self.root + np.arange(n_dim)) % 1 + self.shift


@pytest.mark.parametrize("share", [None, (2, 3)])
def test_a_sequence_of_users_is_known_by_its_attributes(tmp_path, share):
    path, options = tmp_path / "s", {"block_size": 4, "share": share}
    whole = minimize(PROBLEM, PSI(40, sampling=Kronecker(), **options)).algorithm.table
    np.testing.assert_array_equal(whole.X, Kronecker().unit_points(40, 4)[whole.numbers - 1])
    minimize(PROBLEM, PSI(17, sampling=Kronecker(), study=path, **options))
    again = minimize(PROBLEM, PSI(40, sampling=Kronecker(), study=path, **options)).algorithm
    assert again.evaluator.n_eval < len(whole)
    assert again.table.equals(whole)
    if share is None:
        assert set(investigate(PROBLEM, 40, sampling=Kronecker(3.0), study=path)["run"]) == {2}
