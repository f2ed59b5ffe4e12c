"""Sensitivities against exact indices, and rules against what they say."""

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import (
    Formulation,
    Recorded,
    SurrogatePSI,
    TestTable,
    investigate,
    lp_tau,
    read_table,
)
from pymoo_psi.algorithms import RunOptions, import_tests
from pymoo_psi.analysis import convergence, even_part, sensitivities
from pymoo_psi.table import Schema
from tests.helpers.refusals import refused


def table_of(X, F, **options):
    return TestTable.of(range(1, len(X) + 1), X, F, **options)


# Exact first-order indices: Ishigami and Homma 1990 with a = 7, b = 0.1.
A, B = 7.0, 0.1
VARIANCE = A**2 / 8 + B * np.pi**4 / 5 + B**2 * np.pi**8 / 18 + 0.5
ISHIGAMI = [0.5 * (1 + B * np.pi**4 / 5) ** 2 / VARIANCE, A**2 / 8 / VARIANCE, 0.0]


def ishigami(n, side=1):
    x = np.pi * (2 * lp_tau(n, 3) - 1)
    y = np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])
    return table_of(side * x, y[:, None])


def test_ishigami():
    found = sensitivities(ishigami(1024))
    assert np.abs(found["first_order"].to_numpy() - ISHIGAMI).max() < 0.03
    assert ((found["lower"] <= ISHIGAMI) & (found["upper"] >= ISHIGAMI)).all()
    # the order of the values of a variable has no direction
    np.testing.assert_allclose(sensitivities(ishigami(1024, side=-1)), found, atol=1e-9)


def mixed(u):
    """Two variables of each kind, as objects; and the effect of the first of each, of variance 1."""
    names = np.array(["iron", "tin", "wood", "clay", "zinc"])
    metals = np.floor(5 * u[:, 6:8]).astype(int)
    columns = [
        *u[:, :2].T,
        *np.floor(4 * u[:, 2:4]).astype(int).T,
        *(u[:, 4:6] >= 0.5).T,
        *names[metals].T,
        np.floor(40 * u[:, 8]).astype(int),
    ]
    effects = [
        np.sqrt(2) * np.sin(2 * np.pi * u[:, 0]),
        (columns[2] - 1.5) / np.sqrt(1.25),
        2 * columns[4] - 1,
        np.array([1, -1, 0.5, -0.5, 0])[metals[:, 0]] / np.sqrt(0.5),
    ]
    X = np.array([column.tolist() for column in columns], dtype=object).T
    return X, np.array(effects)


@pytest.mark.parametrize("n", [64, 128, 256, 512, 1024])
@pytest.mark.parametrize("first", [1, 1000])
def test_variables_of_every_kind_matter_or_not(n, first):
    """Also in the place where others explain all: few points of a sequence confound variables."""
    X, effects = mixed(lp_tau(n, 9, first=first))
    weights = np.vstack([np.ones(4), np.eye(4), [1, 0, 2, 0]])
    found = sensitivities(table_of(X, (weights @ effects).T))
    for k, weight in enumerate(weights, start=1):
        truth = np.zeros(9)
        truth[[0, 2, 4, 6]] = weight**2 / (weight**2).sum()
        rows = found.loc[f"f{k}"]
        np.testing.assert_allclose(rows["first_order"], truth, atol=0.2 if n == 64 else 0.08)
        assert (rows["lower"] <= truth + 0.005).all()
        assert (rows["upper"] >= truth - 0.005).all()
        assert (rows["first_order"][truth == 0] < 0.1).all()


def test_columns_are_named_and_failures_left_out():
    X = lp_tau(512, 3) * [1, 1, 0] + [0, 0, 0.5]  # the third is fixed
    F = np.column_stack([-X[:, 0], X[:, 1] - X[:, 0], 1 + 4e-16 * np.round(X[:, 1])])
    F[::50] = np.nan
    schema = Schema.of(["width", "height", "depth"], ["gain", "mass", "one"], maximize=["gain"])
    found = sensitivities(table_of(X, F, outputs={"heat": X[:, 1]}, schema=schema))
    assert found.index.unique("column").tolist() == ["gain", "mass", "one", "heat"]
    assert found.index.unique("variable").tolist() == ["width", "height"]
    index = found["first_order"].unstack()[["width", "height"]]
    np.testing.assert_allclose(
        index.loc[["gain", "mass", "one", "heat"]],
        [[1, 0], [0.5, 0.5], [np.nan, np.nan], [0, 1]],
        atol=0.05,
    )


def test_the_band_of_random_tests_holds_the_truth():
    """Of 200 tests at random points, 19 times of 20; one variable in two explains nothing."""
    rng, truth, held = np.random.default_rng(1), np.tile([0.25, 0], 4), []
    for _ in range(30):
        X, effects = mixed(rng.random((200, 9)))
        found = sensitivities(table_of(X[:, :8], effects.sum(axis=0)[:, None]))
        held.append((found["lower"] <= truth) & (found["upper"] >= truth))
    assert np.mean(held) > 0.95


def test_what_terms_explain_by_chance_is_taken_off():
    """Of noise no variable explains anything, on average; ten terms fit a tenth of 100 tests."""
    rng = np.random.default_rng(3)
    noise = rng.standard_normal((100, 60))
    found = sensitivities(table_of(rng.random((100, 3)), noise))["first_order"]
    assert abs(found.mean()) < 0.02
    # nor does a strong variable leave its neighbours a share of the rest
    x, y = rng.random((2, 100))
    found = sensitivities(table_of(np.column_stack([x, y]), 5 * x[:, None] + 0.3 * noise))
    assert abs(found["first_order"].unstack()["x2"].mean()) < 0.01


def test_only_points_before_proposals_are_a_sample():
    problem = get_problem("bnh")
    table = minimize(problem, SurrogatePSI(64, n_points=48), seed=1).algorithm.table
    part, said = even_part(table)
    assert part.equals(table.take(np.arange(48)))
    assert said[0].startswith("By the first 48 of 64 tests")
    asked = table.under(Formulation(objectives=["f2"], limits={"f1": 100}))
    expected = sensitivities(investigate(problem, 48), ["f2"])
    np.testing.assert_allclose(sensitivities(asked, ["f2"]), expected)
    assert convergence(table).index.tolist() == [12, 24, 48]
    refused("known of 40 tests or more, got 20", sensitivities, table.take(np.arange(20)))


@pytest.mark.parametrize("ask", [sensitivities, convergence])
@pytest.mark.parametrize("asked", [Formulation(), Formulation(objectives=["f2"])])
def test_what_an_algorithm_has_chosen_is_no_even_sample(study_file, ask, asked):
    minimize(Recorded(get_problem("bnh"), study=study_file), NSGA2(10), ("n_gen", 5), seed=1)
    refused("that algorithms or people have chosen", ask, read_table(study_file, asked))


def test_a_run_within_another_is_no_sample(study_file):
    problem = get_problem("bnh")
    import_tests(problem, investigate(problem, 64), RunOptions(study=study_file))
    investigate(problem, 64, study=study_file)
    refused("algorithms or people have chosen", even_part, read_table(study_file))


def test_of_designs_of_unknown_origin_it_is_said():
    X = np.random.default_rng(2).random((125, 3))
    table = table_of(X, X[:, :2])
    assert even_part(table)[1][0].startswith("It is unknown how designs were sampled: ")
    assert sensitivities(table).loc[("f1", "x1"), "first_order"] == pytest.approx(1, abs=0.01)
