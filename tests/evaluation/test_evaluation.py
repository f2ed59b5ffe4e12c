"""Guarded evaluation of vectorised models: who is asked again, and that the values are the same."""

import numpy as np
import pytest
from pymoo.core.problem import Problem

from pymoo_psi import investigate
from pymoo_psi.evaluation import FailureTolerant
from pymoo_psi.evaluation._evaluator import evaluate_guarded

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


def test_a_sound_model_is_asked_once():
    problem = Recorded(nothing)
    assert not any(evaluate_guarded(problem, X).reasons)
    assert problem.sizes == [64]


@pytest.mark.parametrize("spoil", [nan_objective, infinite_objective, nan_constraint, nan_equality])
def test_only_designs_with_bad_values_are_asked_again(spoil):
    problem = Recorded(spoil)
    found = evaluate_guarded(problem, X)
    assert problem.sizes == [64, len(LOST)]
    assert [i for i, reason in enumerate(found.reasons) if reason] == LOST


@pytest.mark.parametrize("spoil", [error, leave])
def test_a_model_that_raises_is_asked_one_by_one(spoil):
    problem = Recorded(spoil)
    found = evaluate_guarded(problem, X)
    assert problem.sizes[-64:] == [1] * 64
    assert [i for i, reason in enumerate(found.reasons) if reason] == LOST


@pytest.mark.parametrize(
    "spoil", [nothing, nan_objective, infinite_objective, nan_constraint, error]
)
def test_values_and_reasons_are_those_of_the_guard(spoil):
    found = evaluate_guarded(Recorded(spoil), X)
    names = ["F", "G", "H", "failure"]
    guarded = FailureTolerant(Recorded(spoil)).evaluate(
        X, return_values_of=names, return_as_dictionary=True
    )
    np.testing.assert_array_equal(found.F, guarded["F"])
    np.testing.assert_array_equal(found.G, guarded["G"][:, :-1])
    np.testing.assert_array_equal(found.H, guarded["H"])
    assert found.reasons == list(guarded["failure"])


def test_an_infinite_objective_of_an_infeasible_design_stands():
    def spoil(X, out, lost):
        out["F"][(X[:, 0] > 50) | (X[:, 0] == 5)] = np.inf

    problem = Recorded(spoil)
    assert not any(evaluate_guarded(problem, X).reasons)
    assert problem.sizes == [64]


def test_arrays_that_the_model_keeps_are_left_alone():
    kept = np.column_stack([X.sum(axis=1), -X[:, 1]])
    kept[LOST] = np.nan

    def spoil(X, out, lost):
        out["F"] = kept if len(X) == 64 else kept[X[:, 0].astype(int)]

    assert np.isinf(evaluate_guarded(Recorded(spoil), X).F[LOST]).all()
    assert np.isnan(kept[LOST]).all()


def test_an_investigation_asks_again_for_the_failed_only():
    problem = Recorded(lambda X, out, lost: nan_objective(X, out, X[:, 0] >= 60))
    table = investigate(problem, 256, block_size=64)
    n_failed = int((table.status == "failed").sum())
    assert 0 < n_failed == (table.X[:, 0] >= 60).sum()
    assert sum(problem.sizes) == 256 + n_failed
