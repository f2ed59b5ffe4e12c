"""Requirements: a model never runs for a design that violates one."""

from functools import partial

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.core.problem import Problem
from pymoo.core.variable import Choice, Integer, Real
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import (
    PSI,
    FailureTolerant,
    Formulation,
    ProcessRunner,
    ProgramProblem,
    Recorded,
    Required,
    Restricted,
    SurrogatePSI,
    investigate,
    nsga3,
)
from pymoo_psi.algorithms import RunOptions, import_tests
from pymoo_psi.files import write_table
from tests.helpers.draws import rarely
from tests.helpers.models import Model
from tests.helpers.refusals import refused


def one(x):
    """Of one design, which meets the requirement."""
    assert x[1] <= 2 * x[0], "the model ran for a design that violates a requirement"
    return {"F": [x[0], 1 / (0.1 + x[0]) + x[1]], "G": x.sum() - 2, "heat": x[0] * x[1]}


def rows(X):
    """Of several designs."""
    return {"F": np.array([one(x)["F"] for x in X]), "G": X.sum(axis=1, keepdims=True) - 2}


def plain(results=one, **options):
    options |= {"n_var": 2, "n_ieq_constr": 1, "xu": [1.0, 3.0], "elementwise": results is one}
    problem = Model(results, **options)
    problem.names = {"x1": "width", "x2": "height"}
    problem.requirements = {"slender": "height <= 2*width"}
    return problem


vectorised = partial(plain, rows)


def mixed():
    problem = Model(
        lambda x: {"F": [x["teeth"], x["module"]]},
        vars={
            "teeth": Integer(bounds=(8, 30)),
            "module": Real(bounds=(0, 8)),
            "steel": Choice(options=["a", "b"]),
        },
    )
    problem.requirements = ["teeth <= 2*module + 10", "module >= 1"]
    return problem


@pytest.mark.parametrize("algorithm", [NSGA2(pop_size=20), SMSEMOA(pop_size=20)])
@pytest.mark.parametrize(
    "make",
    [
        plain,
        vectorised,
        lambda: Restricted(plain(), {"width": (0.1, 0.9)}),
        *rarely(lambda: plain(elementwise_runner=ProcessRunner(2))),
    ],
)
def test_algorithms_of_pymoo_find_designs_that_meet_them(algorithm, make):
    result = minimize(Required(make()), algorithm, ("n_eval", 100), seed=1)
    assert (result.X[:, 1] <= 2 * result.X[:, 0]).all()
    np.testing.assert_allclose(result.F[:, 0], result.X[:, 0])


@pytest.mark.parametrize(
    "wrap", [lambda ruled, path: ruled, lambda ruled, path: Recorded(ruled, path)]
)
def test_nsga3_runs_no_design_that_violates_one(study_file, wrap):
    problem = mixed()
    ruled = Required(problem)
    assert len(nsga3(wrap(ruled, study_file), n_evaluations=100, seed=1).F)
    assert len(problem.calls) + ruled.n_not_run == 100
    assert 0 < len(problem.calls) < 100
    for (x,) in problem.calls:
        assert 1 <= x["module"] >= x["teeth"] / 2 - 5


@pytest.mark.parametrize("problem", [plain(), vectorised()])
def test_values_are_infinite_without_a_run(problem):
    X = np.random.default_rng(1).random((50, 2)) * [1, 3]
    met = X[:, 1] <= 2 * X[:, 0]
    out = Required(problem).evaluate(X, return_as_dictionary=True)
    for name in ("F", "G"):
        expected = problem.evaluate(X[met], return_as_dictionary=True)[name]
        np.testing.assert_array_equal(out[name][met][:, : expected.shape[1]], expected)
    assert np.isinf(out["F"][~met]).all()
    assert (out["G"][~met, 0] == 0).all()
    np.testing.assert_allclose(out["G"][:, 1], X[:, 1] - 2 * X[:, 0])


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        (["x1 <= x2"], [True, False, True]),
        (["x1 >= x2"], [False, True, True]),
        (["1 <= x1/x2 <= 2"], [False, True, False]),
        (["2 >= x1 + x2 >= 1"], [True, False, False]),
    ],
)
def test_a_rule_is_what_it_says(rule, expected):
    problem = Required(Problem(n_var=2, n_obj=1, xl=0.0, xu=3.0), rule)
    X = np.array([[0.5, 1.0], [2.0, 1.0], [0.0, 0.0]])  # 0/0 is no number and meets nothing
    assert (problem.amounts(X) <= 0)[:, 0].tolist() == expected


@pytest.mark.parametrize(
    ("rules", "match"),
    [
        (["width <= hieght"], "did you mean 'height'"),
        (["width < height"], "inequality"),
        (["width"], "inequality"),
        (["0 <= width >= 1"], "inequality"),
        (["width <= "], "arithmetic"),
        ("width <= 1", "a list of texts"),
        ({"a": 3}, "an inequality as text"),
    ],
)
def test_wrong_rules_are_refused(rules, match):
    refused(match, Required, plain(), rules)


@pytest.mark.parametrize(
    "make", [plain, vectorised, *rarely(lambda: plain(elementwise_runner=ProcessRunner(2)))]
)
def test_psi_reports_designs_that_violate_one_as_infeasible(make):
    table = investigate(make(), 64)
    met = table.X[:, 1] <= 2 * table.X[:, 0]
    assert 10 < met.sum() < 54
    assert (table.status[~met] == "infeasible").all()
    assert np.isfinite(table.F[met]).all()
    assert {*table.to_frame()["violated"][~met]} == {"slender: height <= 2*width"}
    run = minimize(Required(make()), PSI(64))
    assert run.algorithm.table.equals(table)
    assert run.algorithm.evaluator.n_eval == met.sum()


def test_a_study_continues_with_them(study_file):
    investigate(plain(), 20, study=study_file)
    assert investigate(plain(), 48, study=study_file).equals(investigate(plain(), 48))
    stricter = investigate(plain(), 48, study=study_file, requirements=["height <= width"])
    alone = investigate(plain(), 48, requirements=["height <= width"])
    by_point = np.argsort(stricter["test_point"])
    np.testing.assert_array_equal(stricter.X[by_point], alone.X)
    np.testing.assert_array_equal(stricter.status[by_point], alone.status)


def test_rules_compute_with_numbers_alone():
    refused(
        "only columns of numbers can be .* 'steel' holds",
        investigate,
        Required(mixed(), ["steel <= 4"]),
        4,
    )


def test_surrogates_propose_only_designs_that_meet_them():
    table = minimize(plain(), SurrogatePSI(28, batch=4), seed=1).algorithm.table
    assert (table["proposal_round"][20:] > 0).all()
    assert (table.X[20:, 1] <= 2 * table.X[20:, 0]).all()
    table = minimize(mixed(), SurrogatePSI(28, batch=4), seed=1).algorithm.table
    assert (table.status[table.column("proposal_round") > 0] == "ok").all()


def test_designs_that_violate_requirements_are_asked_of_nobody():
    """They come evaluated, whatever evaluates the others."""
    problem = plain()
    algorithm = PSI(32).setup(problem)
    algorithm.tell(infills=algorithm.evaluator.eval(problem, algorithm.ask()))
    assert all(x[1] <= 2 * x[0] for (x,) in problem.calls)
    assert algorithm.table.equals(investigate(plain(), 32))


@pytest.mark.parametrize("name", ["slender", "low"])
@pytest.mark.parametrize("wrap", [Required, lambda problem: problem])
def test_requirements_of_the_problem_hold_beside_others(name, wrap):
    """One of the same name takes its place."""
    table = investigate(wrap(plain()), 64, requirements={name: "height <= 3*width - 1"})
    x, y = table.X.T
    is_met = y <= 3 * x - 1
    own = ("g1",)
    if name != "slender":
        is_met &= y <= 2 * x
        own = ("g1", "slender: height <= 2*width")
    np.testing.assert_array_equal(np.isfinite(table.F).all(axis=1), is_met)
    assert table.schema.constraints == (*own, f"{name}: height <= 3*width - 1")


@pytest.mark.parametrize("wrap", [FailureTolerant, lambda p: FailureTolerant(Required(p))])
def test_a_failing_model_is_not_run_again(wrap):
    problem = Model(lambda x: {"F": x}, fails=lambda x: x[0] > 0.5, n_var=2)
    problem.requirements = ["x2 <= 2*x1"]
    tolerant = wrap(problem)
    tolerant.evaluate(np.random.default_rng(1).random((40, 2)))
    runs = {tuple(x) for (x,) in problem.calls}
    assert len(problem.calls) == len(runs) > len(tolerant.failures) > 0


def bars(rules):
    """A program, one of whose objectives follows from the variables alone."""
    command = "python -S -c \"print('mass =', {w}*{h})\""
    return ProgramProblem(
        {"w": {"bounds": [1, 4]}, "h": {"bounds": [1, 4]}},
        {"command": command, "keep": "none"},
        {
            "mass": {"file": "stdout.txt", "pattern": r"mass = (\S+)"},
            "stress": {"expression": "100/(w*h*h)"},
        },
        {"minimize": ["mass", "stress"]},
        requirements=rules,
    )


def test_values_of_a_design_may_be_in_any_order():
    command = "python -S -c \"print('mass =', {w}+{h})\""
    variables = {"w": [1, 4], "h": [1, 4], "steel": {"choices": ["S", "T"]}}
    outputs = {"mass": {"file": "stdout.txt", "pattern": r"mass = (\S+)"}}
    minimize, rule = {"minimize": ["mass"]}, ["w + 2*h = 5"]
    program = {"command": command + " {steel}", "keep": "none"}
    problem = ProgramProblem(variables, program, outputs, minimize, requirements=rule)
    assert problem.evaluate(np.array([{"steel": "S", "h": 1.0, "w": 3.0}]))[0] == 4


def by_psi(problem, study):
    return investigate(problem, 16, study=study)


def by_another_algorithm(problem, study):
    res = minimize(Recorded(problem, study), NSGA2(16), ("n_gen", 1), seed=1)
    return res.problem.table


@pytest.mark.parametrize(
    ("of", "rules"),
    [
        (lambda rules: Required(get_problem("bnh"), rules), ["x1 + x2 <= {}", "2", "4"]),
        (bars, ["h <= {}*w", "0.5", "1.5"]),
    ],
    ids=["a function", "a program"],
)
@pytest.mark.parametrize("tested", [by_psi, by_another_algorithm])
def test_designs_that_did_not_run_are_tested_when_requirements_allow_it(
    of, rules, tested, study_file
):
    rule, narrow, loose = rules
    n_feasible = []
    for requirements in [{"r": rule.format(narrow)}, {"r": rule.format(loose)}, {}]:
        table = tested(of(requirements), study_file)
        n_feasible.append(table.feasible().sum())
        assert not table.reasons
    fresh = tested(of({}), study_file.with_suffix(".fresh"))
    assert n_feasible[0] < n_feasible[1] < n_feasible[2]
    assert sorted(table.F.tolist()) == sorted(fresh.F.tolist())
    # the first requirement holds for the tests of the others
    assert tested(of({"r": rule.format(narrow)}), study_file).feasible().sum() == n_feasible[0]


def test_failures_and_infinite_values_of_a_model_stay_when_requirements_change(study_file):
    calls = []

    def some(x):
        calls.append(tuple(x))
        assert x[0] < 0.8, "too wide"
        if x[1] > 0.5:
            return {"F": [np.inf, np.inf], "G": 1.0}
        return {"F": [x[0], 1 - x[0]], "G": -1.0}

    model = Model(some, n_var=2, n_ieq_constr=1)
    investigate(model, 16, study=study_file, requirements=["x1 >= 0.1"])
    table = investigate(model, 16, study=study_file)
    fresh = investigate(model, 16)
    assert len(calls) == len({*calls}) + 16 == 32
    assert sorted(table.reasons.values()) == sorted(fresh.reasons.values())
    assert sorted(table.status) == sorted(fresh.status)


def test_the_reason_of_an_infinite_objective_is_the_requirement_left_out():
    rule = {"mix": "x1 + x2 <= 4"}
    table = investigate(get_problem("bnh"), 16, requirements=rule)
    table = table.under(Formulation(omitted=["mix: x1 + x2 <= 4"]))
    assert {*table.reasons.values()} == {"f1 is inf"}


def test_names_of_a_user_leave_those_of_requirements():
    rule = {"mix": "x1 + x2 <= 4"}
    text = "mix: x1 + x2 <= 4"
    for names in ({"f1": "cost", "g1": "load"}, {}, {"g3": "mixture"}):
        table = investigate(get_problem("bnh"), 4, requirements=rule, names=names)
        assert table.schema.constraints == (names.get("g1", "g1"), "g2", names.get("g3", text))


def test_designs_that_did_not_run_elsewhere_are_no_tests(tmp_path):
    table = investigate(get_problem("bnh"), 16, requirements=["x1 + x2 <= 4"])
    table.to_csv(tmp_path / "bnh.csv")
    for source, name in ((table, "a.db"), (tmp_path / "bnh.csv", "b.db")):
        options = RunOptions(study=tmp_path / name)
        imported = import_tests(get_problem("bnh"), source, options)
        assert len(imported) == np.isfinite(table.F).all(axis=1).sum() < 16
        assert not investigate(get_problem("bnh"), 16, study=tmp_path / name).reasons


def test_runs_under_other_requirements_may_be_at_work_together(study_file):
    problem = get_problem("bnh")
    bounded = Recorded(Required(problem, ["x1 + x2 <= 4"]), study_file)
    whole = Recorded(problem, study_file)
    X = np.array([[3.0, 3.0], [1.0, 1.0]])
    assert np.isinf(bounded.evaluate(X)[0][0]).all()
    np.testing.assert_array_equal(whole.evaluate(X)[0], problem.evaluate(X)[0])
    assert (bounded.evaluate(X)[1][0] > 0).any()


@pytest.mark.parametrize("rules", [{"mix": "x1 + x2 <= 4"}, {"mix": "x1 + x2 <= 5"}, {}])
def test_an_exported_study_goes_on_under_any_requirements(tmp_path, rules):
    bnh = get_problem("bnh")
    table = investigate(bnh, 16, requirements={"mix": "x1 + x2 <= 4"}, study=tmp_path / "a.db")
    write_table(table, tmp_path / "b.db")
    again = investigate(bnh, 32, requirements=rules, study=tmp_path / "b.db")
    expected = investigate(bnh, 32, requirements=rules)
    assert again.feasible().sum() == expected.feasible().sum()
    assert {*map(tuple, again.X[again.pareto()])} == {*map(tuple, expected.X[expected.pareto()])}
