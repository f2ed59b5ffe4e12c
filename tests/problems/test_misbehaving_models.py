"""Models that misbehave, and what must come out of each: right values, or a failure with a reason.

A case is a model, for one design or for all at once, and the reason of design 2, or of every
design, as a pattern; where there is none, all values must be right: F = (x1, 10 - x1), G = -1.
"""

import os
import re

import numpy as np
import pytest
from pymoo.constraints.as_penalty import ConstraintsAsPenalty
from pymoo.core.mixed import MixedVariableGA
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Choice, Real
from pymoo.optimize import minimize

from pymoo_psi import PSI, FailureTolerant, lp_tau
from pymoo_psi.problems import evaluate_designs

CULPRIT = 2
X = np.column_stack([np.arange(7.0), np.linspace(0.0, 1.0, 7)])


def right(x):
    return [x[0], 10 - x[0]]


class Panic(BaseException):
    """As of a Rust extension."""


def at_culprit(change):
    """A model for one design that gives right values but at design 2."""

    def model(self, x, out):
        out["F"], out["G"] = right(x), -1.0
        if x[0] == CULPRIT:
            change(x, out)

    return model


def raising(error):
    def change(x, out):
        raise error

    return at_culprit(change)


def giving(name, value):
    return at_culprit(lambda x, out: out.update({name: value}))


def forgetting(name):
    return at_culprit(lambda x, out: out.pop(name))


# Models for one design


def changes_its_design(self, x, out):
    out["F"], out["G"] = right(x), -1.0
    x[:] = 99.0


def returns_its_design(self, x, out):
    x[1] = 10 - x[0]
    out["F"], out["G"] = x, -1.0


def reuses_an_array(self, x, out):
    self.buffer[:] = right(x)
    out["F"], out["G"] = self.buffer, -1.0


def reuses_a_list(self, x, out):
    self.note.append(float(x[0]))
    out["F"], out["G"], out["note"] = right(x), -1.0, self.note


def wanders_off(self, x, out):
    out["F"], out["G"] = right(x), -1.0
    os.chdir("/")


def gives_more(self, x, out):
    out["F"], out["G"] = right(x), -1.0
    out["path"] = [1.0] * int(x[0])  # of another length for every design


FOR_ONE = {
    "raises": (raising(ZeroDivisionError("by zero")), "ZeroDivisionError: by zero"),
    "raises without a message": (raising(AssertionError()), "AssertionError"),
    "exits": (raising(SystemExit(3)), "SystemExit: 3"),
    "gives NaN": (giving("F", [np.nan, 1.0]), r"F is \[nan, 1.0\]"),
    "gives infinity": (giving("F", [np.inf, 1.0]), r"F is \[inf, 1.0\] though .* feasible"),
    "gives None": (giving("F", None), "F is missing"),
    "gives nothing": (giving("F", []), r"F has shape \(0,\) instead of \(2,\)"),
    "gives one objective": (giving("F", 1.0), r"F has shape \(\) instead of \(2,\)"),
    "gives three objectives": (giving("F", [1, 2, 3]), r"F has shape \(3,\) instead of \(2,\)"),
    "gives text": (giving("F", ["low", "high"]), "F is not an array of numbers: .*"),
    "gives complex values": (giving("F", [1 + 2j, 1.0]), "F is not .* complex128"),
    "gives masked values": (
        giving("F", np.ma.array([1.0, 2.0], mask=[0, 1])),
        r"F is \[1.0, nan\]",
    ),
    "forgets F": (forgetting("F"), "F is missing"),
    "gives NaN for a constraint": (giving("G", np.nan), r"G is \[nan\]"),
    "changes its design": (changes_its_design, None),
    "returns its design": (returns_its_design, None),
    "reuses an array": (reuses_an_array, None),
    "reuses a list": (reuses_a_list, None),
    "wanders off": (wanders_off, None),
    "gives more, of many lengths": (gives_more, None),
    "gives texts of numbers": (giving("F", ["2", "8.0"]), None),
    "gives real complex values": (giving("F", np.array([2 + 0j, 8 + 0j])), None),
    "is infeasible and infinite": (
        at_culprit(lambda x, out: out.update(F=[np.inf, 1.0], G=1.0)),
        "infeasible",
    ),
}


# Models for all designs at once


def together(change):
    """A model for all designs that gives right values but for what ``change`` does to them."""

    def model(self, X, out):
        out["F"] = np.column_stack(right(X.T))
        out["G"] = np.full((len(X), 1), -1.0)
        change(self, X, out, np.flatnonzero(X[:, 0] == CULPRIT))

    return model


def replacing(name, make):
    return together(lambda self, X, out, culprit: out.update({name: make(out[name], culprit)}))


def raises_for_all(self, X, out, culprit):
    if len(culprit):
        raise FloatingPointError("underflow")


def cell(value, dtype=float):
    def make(F, culprit):
        F = F.astype(dtype)
        F[culprit, 1] = value
        return F

    return make


def mask(F, culprit):
    F = np.ma.array(F)
    F[culprit, 0] = np.ma.masked
    return F


def changes_its_designs(self, X, out, culprit):
    X[:] = 99.0


def returns_its_designs(self, X, out, culprit):
    X[:, 1] = 10 - X[:, 0]
    out["F"] = X


def reuses_arrays(self, X, out, culprit):
    self.buffers.setdefault(len(X), np.empty((len(X), 2)))[:] = out["F"]
    out["F"] = self.buffers[len(X)]


def leaves_out_the_failed(F, culprit):
    return np.delete(F, culprit, axis=0)


FOR_ALL = {
    "raises": (together(raises_for_all), "FloatingPointError: underflow"),
    "gives NaN": (replacing("F", cell(np.nan)), r"F is \[2.0, nan\]"),
    "gives infinity": (replacing("F", cell(np.inf)), r"F is \[2.0, inf\] though .* feasible"),
    "gives complex values": (replacing("F", cell(1j, complex)), "F is not .* complex128"),
    "gives objects": (replacing("F", cell("high", object)), "F is not an array .*'high'"),
    "gives masked values": (replacing("F", mask), r"F is \[nan, 8.0\]"),
    "gives NaN for a constraint": (
        replacing(
            "G", lambda G, culprit: np.where(np.arange(len(G))[:, None] == culprit, np.nan, G)
        ),
        r"G is \[nan\]",
    ),
    "leaves out the failed": (replacing("F", leaves_out_the_failed), r"F has shape \(0, 2\) .*"),
    "gives rows for columns": (
        replacing("F", lambda F, culprit: F.T),
        (r"F has shape \(2, 1\) instead of \(1, 2\)",),
    ),
    "forgets F": (replacing("F", lambda F, culprit: None), ("F is missing",)),
    "changes its designs": (together(changes_its_designs), None),
    "returns its designs": (together(returns_its_designs), None),
    "reuses arrays": (together(reuses_arrays), None),
    "gives columns": (replacing("F", lambda F, culprit: [*F.T]), None),
    "gives the constraint as a vector": (replacing("G", lambda G, culprit: G[:, 0]), None),
    "gives one note for all": (
        together(lambda self, X, out, culprit: out.update(note="calm", table=np.ones((3, 5)))),
        None,
    ),
}


def problem_of(model, *, elementwise):
    class Model(ElementwiseProblem if elementwise else Problem):
        def __init__(self):
            super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=[0, 0], xu=[8, 1])
            self.buffer, self.buffers, self.note = np.empty(2), {}, []

        def _evaluate(self, x, out, *args, **kwargs):
            model(self, x, out)

    return Model()


CASES = [
    pytest.param(model, elementwise, expected, id=f"{'one' if elementwise else 'all'}: {name}")
    for elementwise, cases in ((True, FOR_ONE), (False, FOR_ALL))
    for name, (model, expected) in cases.items()
]


def check(values, F, G, reasons, expected):
    """Values are right where there is no reason, and reasons are where they are expected."""
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


@pytest.mark.filterwarnings("ignore:the matrix subclass:PendingDeprecationWarning")
@pytest.mark.parametrize(("model", "elementwise", "expected"), CASES)
class TestWhatComesOut:
    def test_of_an_evaluation(self, model, elementwise, expected, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        designs = X.copy()
        problem = FailureTolerant(problem_of(model, elementwise=elementwise))
        out = problem.evaluate(designs, return_as_dictionary=True, return_values_of=["F", "G"])
        check(X[:, 0], out["F"], out["G"][:, :-1], out["failure"], expected)
        np.testing.assert_array_equal(designs, X)
        assert os.getcwd() == str(tmp_path)
        assert np.geterr()["under"] == "ignore"

    @pytest.mark.filterwarnings("ignore:out.* is not kept in the table:UserWarning")
    def test_of_an_investigation(self, model, elementwise, expected, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        result = minimize(problem_of(model, elementwise=elementwise), PSI(16))
        table = result.algorithm.table
        np.testing.assert_array_equal(table.X, [8, 1] * lp_tau(16, 2))
        np.testing.assert_array_equal(result.pop.get("X"), table.X)
        reasons = [table.reasons.get(number, "") for number in table.numbers.tolist()]
        check(table.X[:, 0], table.F, table.G, reasons, expected)


class Counted(Problem):
    """A vectorised model that gives F the wrong way round, and counts."""

    def __init__(self, n_obj):
        super().__init__(n_var=1, n_obj=n_obj, xl=0, xu=1)
        self.evaluated = 0

    def _evaluate(self, X, out, *args, **kwargs):
        self.evaluated += len(X)
        out["F"] = (np.arange(1.0, self.n_obj + 1)[None, :] + X).T


@pytest.mark.parametrize("n_obj", [2, 3, 4])
@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_a_matrix_the_wrong_way_round_is_refused_also_where_it_is_square(n, n_obj):
    problem = Counted(n_obj)
    out = evaluate_designs(problem, np.linspace(0, 1, n)[:, None])
    assert all(reason.startswith("F has shape") for reason in out["failure"])
    assert problem.evaluated <= 2 * n


def test_designs_by_name_are_copies_too():
    class Mixed(ElementwiseProblem):
        def __init__(self):
            variables = {"a": Real(bounds=(0, 1)), "b": Choice(options=["u", "v"])}
            super().__init__(vars=variables, n_obj=1)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = x["a"]
            x["b"] = x.pop("a")

    result = minimize(FailureTolerant(Mixed()), MixedVariableGA(pop_size=8), ("n_gen", 3), seed=1)
    assert all(set(x) == {"a", "b"} for x in result.pop.get("X"))
    table = minimize(Mixed(), PSI(8)).algorithm.table
    np.testing.assert_array_equal(table.X[:, 0].astype(float), table.F[:, 0])


def test_designs_by_name_are_copies_also_for_a_vectorised_model():
    class Mixed(Problem):
        def __init__(self):
            super().__init__(vars={"a": Real(bounds=(0, 1))}, n_obj=1)

        def _evaluate(self, X, out, *args, **kwargs):
            out["F"] = np.array([x.pop("a") for x in X])

    result = minimize(Mixed(), PSI(8))
    table = result.algorithm.table
    np.testing.assert_array_equal(table.X.astype(float), table.F)
    assert [x["a"] for x in result.pop.get("X")] == table.F[:, 0].tolist()
    assert FailureTolerant(Mixed()).evaluate([{"a": 0.5}])[0].tolist() == [[0.5]]


def test_problems_that_transform_designs_are_not_bypassed():
    """pymoo's ConstraintsAsPenalty evaluates another problem and changes its values."""

    class Holed(ElementwiseProblem):
        def __init__(self):
            super().__init__(n_var=1, n_obj=1, n_ieq_constr=1, xl=0, xu=1)

        def _evaluate(self, x, out, *args, **kwargs):
            if x[0] < 0.1:
                raise ValueError("hole")
            out["F"], out["G"] = x[0], x[0] - 0.5

    designs = np.array([[0.0], [0.25], [0.75]])
    out = evaluate_designs(ConstraintsAsPenalty(Holed(), penalty=100.0), designs)
    assert out["F"].tolist() == [[np.inf], [0.25], [25.75]]
    assert out["failure"].tolist() == ["ValueError: hole", "", ""]
