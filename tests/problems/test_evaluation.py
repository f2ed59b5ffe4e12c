"""Evaluation of models that misbehave: right values come out, or a failure with a reason.

A case is a model, for one design or for all at once, and the reason of design 2, or of every
design, as a pattern; where there is none, all values must be right: F = (x1, 10 - x1), G = -1.
"""

import os
import re

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.constraints.as_penalty import ConstraintsAsPenalty
from pymoo.core.mixed import MixedVariableGA
from pymoo.core.variable import Choice, Real
from pymoo.optimize import minimize

from pymoo_psi import PSI, FailureTolerant, Restricted, lp_tau
from pymoo_psi.problems import evaluate_designs
from tests.helpers.models import Model as OfFunction
from tests.helpers.refusals import warned

CULPRIT = 2
X = np.column_stack([np.arange(7.0), np.linspace(0.0, 1.0, 7)])


def right(x):
    return [x[0], 10 - x[0]]


class Panic(BaseException):
    """As of a Rust extension."""


# What a model does to right values, given the rows of the culprit among its designs


def raising(error):
    def change(x, out, culprit):
        if len(culprit):
            raise error

    return change


def giving(**values):
    return lambda x, out, culprit: out.update(values if len(culprit) else {})


def everywhere(name, change):
    return lambda x, out, culprit: out.update({name: change(out[name])})


def cell(name, value):
    def change(x, out, culprit):
        out[name][culprit, -1] = value

    return change


def changes_its_designs(x, out, culprit):
    x[:] = 99.0


BUFFERS, NOTE = {}, []


def reuses_arrays(x, out, culprit):
    buffer = BUFFERS.setdefault(x.shape, np.empty(np.shape(out["F"])))
    buffer[:] = out["F"]
    out["F"] = buffer


def changes_the_folder(x, out, culprit):
    os.chdir("/")


def gives_more(x, out, culprit):
    """A list of another length for every design, and one that is reused."""
    out.update(path=[1.0] * int(x[0]), note=NOTE)


FOR_ONE = {
    "raises": (raising(ZeroDivisionError("by zero")), "ZeroDivisionError: by zero"),
    "raises a long word": (raising(ValueError("x" * 999)), r"ValueError: x{385}\.\.\."),
    "exits": (raising(SystemExit(3)), "SystemExit: 3"),
    "panics": (raising(Panic("overflow")), "Panic: overflow"),
    "gives NaN": (giving(F=[np.nan, 1.0]), r"F is \[nan, 1.0\]"),
    "gives minus infinity": (giving(F=[1.0, -np.inf]), r"F is \[1.0, -inf\] though .*"),
    "forgets F": (giving(F=None), "F is missing"),
    "gives text": (giving(F=["low", "high"]), "F is not an array of numbers.*"),
    "gives cells": (giving(F=np.array(["1_0", "2"], object)), "F is not an array of numbers.*"),
    "gives masked values": (giving(F=np.ma.array([1.0, 2], mask=[0, 1])), r"F is \[1.0, nan\]"),
    "gives NaN for a constraint": (giving(G=np.nan), r"G is \[nan\]"),
    "gives an equality too many": (giving(H=[0.0]), r"H has shape \(1,\) instead of \(0,\)"),
    "changes its design": (changes_its_designs, None),
    "reuses an array": (reuses_arrays, None),
    "changes the folder": (changes_the_folder, None),
    "gives more, of many lengths": (gives_more, None),
    "gives a column": (giving(F=np.array([[2.0], [8.0]])), None),
    "is infeasible and infinite": (giving(F=[np.inf, 1.0], G=1.0), "infeasible"),
}
FOR_ALL = {
    "raises": (raising(FloatingPointError("underflow")), "FloatingPointError: underflow"),
    "gives NaN": (cell("F", np.nan), r"F is \[2.0, nan\]"),
    "gives masked values": (
        everywhere("F", lambda F: np.ma.masked_equal(F, CULPRIT)),
        r"F is \[nan, 8.0\]",
    ),
    "gives NaN for a constraint": (cell("G", np.nan), r"G is \[nan\]"),
    "gives rows for columns": (
        everywhere("F", np.transpose),
        (r"F has shape \(2, 1\) instead of \(1, 2\)",),
    ),
    "forgets F": (everywhere("F", lambda F: None), ("F is missing",)),
    "changes its designs": (changes_its_designs, None),
    "reuses arrays": (reuses_arrays, None),
    "gives columns": (everywhere("F", lambda F: [*F.T]), None),
    "gives the constraint as a vector": (everywhere("G", np.ravel), None),
}


def problem_of(change, *, elementwise):
    def results(x):
        out = {"F": np.stack(right(x.T), axis=-1), "G": np.full((*x.shape[:-1], 1), -1.0)}
        change(x, out, np.flatnonzero(np.atleast_2d(x)[:, 0] == CULPRIT))
        return out

    return OfFunction(results, n_var=2, n_ieq_constr=1, xu=[8, 1], elementwise=elementwise)


def check(values, F, G, reasons, expected):
    """Values are right where there is no reason, and reasons are where they are expected.

    Returns which designs have failed.
    """
    everywhere = isinstance(expected, tuple)
    lost = np.ones(len(values), dtype=bool) if everywhere else values == CULPRIT
    if expected in (None, "infeasible"):
        lost[:] = False
    assert [bool(reason) for reason in reasons] == lost.tolist()
    for reason in np.array(reasons, dtype=object)[lost]:
        assert re.fullmatch(expected[0] if everywhere else expected, reason), reason
    ok = ~lost & (values != CULPRIT) if expected == "infeasible" else ~lost
    np.testing.assert_array_equal(F[ok], np.column_stack(right(values[None]))[ok])
    np.testing.assert_array_equal(G[ok], -1.0)
    np.testing.assert_array_equal(F[lost], np.inf)
    return lost


@pytest.mark.filterwarnings("ignore:out.* is not kept in the table:UserWarning")
@pytest.mark.parametrize(
    ("model", "elementwise", "expected"),
    [
        pytest.param(model, elementwise, expected, id=f"{'one' if elementwise else 'all'}: {name}")
        for elementwise, cases in ((True, FOR_ONE), (False, FOR_ALL))
        for name, (model, expected) in cases.items()
    ],
)
def test_what_comes_out(model, elementwise, expected, tmp_path, in_folder):
    """Of an evaluation by pymoo, and of an investigation."""
    designs = X.copy()
    problem = FailureTolerant(problem_of(model, elementwise=elementwise))
    out = problem.evaluate(designs, return_as_dictionary=True, return_values_of=["F", "G"])
    lost = check(X[:, 0], out["F"], out["G"][:, :-1], out["failure"], expected)
    np.testing.assert_array_equal(out["G"][:, -1] > 1e9, lost)
    assert not out["G"][~lost, -1].any()
    assert [failure.reason for failure in problem.failures] == out["failure"][lost].tolist()
    assert [tuple(failure.design) for failure in problem.failures] == [*map(tuple, X[lost])]
    np.testing.assert_array_equal(designs, X)
    table = minimize(problem_of(model, elementwise=elementwise), PSI(16)).algorithm.table
    np.testing.assert_array_equal(table.X, [8, 1] * lp_tau(16, 2))
    reasons = [table.reasons.get(number, "") for number in table.numbers.tolist()]
    check(table.X[:, 0], table.F, table.G, reasons, expected)
    assert os.getcwd() == str(tmp_path)


def test_a_call_that_raises_is_repeated_by_design():
    """Only those of its part, one by one."""

    def breaking(X):
        if np.isin(X[:, 0], [703, 717, 740]).any():
            raise FloatingPointError("underflow")
        return {"F": X}

    problem = OfFunction(breaking, n_var=1, n_obj=1, elementwise=False)
    reasons = evaluate_designs(problem, np.arange(1000.0)[:, None])["failure"]
    assert np.flatnonzero(reasons).tolist() == [703, 717, 740]
    assert sum(len(X) for (X,) in problem.calls) <= 2 * 1000 + 2 * 64


@pytest.mark.parametrize("n", [2, 3, 64, 66, 67, 130])
@pytest.mark.parametrize("n_obj", [2, 3, 64])
def test_values_are_never_those_of_other_designs(n, n_obj):
    """Also where there are as many designs, in a part, as values of each."""

    def results(X):
        return {"F": X + np.arange(n_obj)}

    X = np.arange(100.0, 100 + n)[:, None]
    options = {"n_var": 1, "n_obj": n_obj, "elementwise": False}
    right = OfFunction(results, **options)
    np.testing.assert_array_equal(evaluate_designs(right, X)["F"], results(X)["F"])
    assert n == n_obj or len(right.calls[-1][0]) == n
    transposed = OfFunction(lambda X: {"F": results(X)["F"].T}, **options)
    assert evaluate_designs(transposed, X)["failure"].all()


def test_designs_by_name_are_copies_too():
    def moving(x):
        x["b"] = x.pop("a")
        return {"F": x["b"]}

    mixed = OfFunction(
        moving, vars={"a": Real(bounds=(0, 1)), "b": Choice(options=["u", "v"])}, n_obj=1
    )
    result = minimize(FailureTolerant(mixed), MixedVariableGA(pop_size=8), ("n_gen", 3), seed=1)
    assert all(set(x) == {"a", "b"} for x in result.pop.get("X"))


@pytest.mark.parametrize("wrap", [lambda p: p, lambda p: Restricted(p, {"x1": (0.0, 1.0)})])
def test_problems_that_transform_designs_are_not_bypassed(wrap):
    """pymoo's ConstraintsAsPenalty evaluates another problem and changes its values."""

    designs = np.array([[0.0], [0.25], [0.75]])
    size = {"n_var": 1, "n_obj": 1, "n_ieq_constr": 1}
    holed = OfFunction(lambda x: {"F": x[0], "G": x[0] - 0.5}, fails=lambda x: x[0] < 0.1, **size)
    out = evaluate_designs(ConstraintsAsPenalty(wrap(holed), penalty=100.0), designs)
    assert out["F"].tolist() == [[np.inf], [0.25], [25.75]]
    assert out["failure"].tolist() == ["ArithmeticError: no convergence", "", ""]


def test_further_values_stay_with_their_designs():
    stress = np.ones(2)  # the model uses this array for every design

    def talkative(x):
        if x[0] in (0, 2):
            raise ValueError
        stress[0] = x[0]
        return {"F": x[0], "H": 0.5, "stress": stress, "note": {"x": x[0]}}

    problem = OfFunction(talkative, n_var=1, n_obj=1, n_eq_constr=1, xu=9)
    out = FailureTolerant(problem).evaluate(np.arange(4.0)[:, None], return_as_dictionary=True)
    np.testing.assert_array_equal(out["stress"], [[np.nan] * 2, [1, 1], [np.nan] * 2, [3, 1]])
    assert out["note"].tolist() == [None, {"x": 1.0}, None, {"x": 3.0}]
    assert out["H"].tolist() == [[0.0], [0.5], [0.0], [0.5]]


def test_an_output_called_failure_is_left_out_with_a_warning():
    """A table keeps reasons there."""
    one = OfFunction(lambda x: {"F": right(x), "failure": x[0]}, n_var=1)
    together = OfFunction(lambda X: {"F": X, "failure": X[:, 0]}, n_var=2, elementwise=False)
    for problem, designs in ((one, X[:3, 1:]), (together, X[:3])):
        out = warned(r"out\['failure'\] is left out", evaluate_designs, problem, designs)
        assert set(out["failure"]) == {""}


@pytest.mark.parametrize("name", ["f", "x", "data", "copy"])
def test_an_output_with_a_name_of_pymoos_individuals_is_left_out_with_a_warning(name):
    """A table keeps it."""
    problem = OfFunction(lambda x: {"F": right(x), name: x[0], "mass": x[1]}, n_var=2)
    message = f"'{name}'.* is left out: pymoo's individuals have"
    result = warned(message, minimize, FailureTolerant(problem), NSGA2(4), ("n_gen", 2), seed=1)
    np.testing.assert_array_equal(result.pop.get("mass"), result.pop.get("X")[:, 1])
    table = minimize(problem, PSI(4)).algorithm.table
    np.testing.assert_array_equal(table[name], table.X[:, 0])
