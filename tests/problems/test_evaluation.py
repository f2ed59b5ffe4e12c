"""Evaluation of vectorised models: which designs are evaluated again, and whose values are whose."""

import numpy as np
import pytest
from pymoo.core.problem import Problem

from pymoo_psi.problems import evaluate_designs

X = np.column_stack([np.arange(64.0), np.linspace(0, 1, 64)])
LOST = [3, 17, 40]


class Recorded(Problem):
    """A vectorised model that notes how many designs each call has."""

    def __init__(self, spoil):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, n_eq_constr=1, xl=0, xu=64)
        self.spoil, self.sizes = spoil, []

    def _evaluate(self, X, out, *args, **kwargs):
        self.sizes.append(len(X))
        out["F"] = np.column_stack([X.sum(axis=1), -X[:, 1]])
        out["G"] = X[:, :1] - 50
        out["H"] = np.where(X[:, :1] == 5, 1.0, 0.0)
        self.spoil(X, out, np.isin(X[:, 0], LOST))


def nothing(X, out, lost):
    pass


def nan_objective(X, out, lost):
    out["F"][lost, 1] = np.nan


def infinite_objective(X, out, lost):
    out["F"][lost, 0] = -np.inf


def nan_constraint(X, out, lost):
    out["G"][lost] = np.nan


def nan_equality(X, out, lost):
    out["H"][lost] = np.nan


def error(X, out, lost):
    if lost.any():
        raise FloatingPointError("underflow")


def leave(X, out, lost):
    if lost.any():
        raise SystemExit(1)


@pytest.mark.parametrize(
    "spoil", [nothing, nan_objective, infinite_objective, nan_constraint, nan_equality]
)
def test_a_model_that_answers_is_called_once(spoil):
    problem = Recorded(spoil)
    reasons = evaluate_designs(problem, X)["failure"]
    assert problem.sizes == [64]
    assert np.flatnonzero(reasons).tolist() == ([] if spoil is nothing else LOST)


@pytest.mark.parametrize("spoil", [error, leave])
def test_a_model_that_raises_is_evaluated_once_more_one_by_one(spoil):
    problem = Recorded(spoil)
    reasons = evaluate_designs(problem, X)["failure"]
    assert problem.sizes == [64, *[1] * 64]
    assert np.flatnonzero(reasons).tolist() == LOST


def test_a_culprit_among_many_is_found_in_its_part():
    problem = Recorded(error)
    many = np.column_stack([np.arange(1000) - 700.0, np.zeros(1000)])
    reasons = evaluate_designs(problem, many)["failure"]
    assert np.flatnonzero(reasons).tolist() == [700 + i for i in LOST]
    assert sum(problem.sizes) < 1000 + 1000 + 2 * 64 + 1


def test_an_infinite_objective_of_an_infeasible_design_stands():
    def spoil(X, out, lost):
        out["F"][(X[:, 0] > 50) | (X[:, 0] == 5)] = np.inf

    problem = Recorded(spoil)
    assert not any(evaluate_designs(problem, X)["failure"])
    assert problem.sizes == [64]


def test_arrays_that_the_model_keeps_are_left_alone():
    kept = np.column_stack([X.sum(axis=1), -X[:, 1]])
    kept[LOST] = np.nan

    def spoil(X, out, lost):
        out["F"] = kept if len(X) == 64 else kept[X[:, 0].astype(int)]

    assert np.isinf(evaluate_designs(Recorded(spoil), X)["F"][LOST]).all()
    assert np.isnan(kept[LOST]).all()
