"""PSI as a pymoo algorithm: its results and pymoo's contracts."""

import re
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest
from pymoo.core.evaluator import Evaluator
from pymoo.core.problem import Problem
from pymoo.core.variable import Choice
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import (
    PSI,
    ExecutorRunner,
    FailureTolerant,
    Formulation,
    LPTauSampling,
    ProcessRunner,
    QMCSampling,
    Recorded,
    Required,
    SphereChute,
    SurrogatePSI,
    VectorizedSphereChute,
    investigate,
)
from pymoo_psi.algorithms import _psi, _run
from pymoo_psi.files import read_table
from tests.algorithms.test_noisy import die
from tests.helpers.draws import rarely
from tests.helpers.models import Model, asked_and_told
from tests.helpers.refusals import flaw, refused

CHUTE = VectorizedSphereChute(0.4, model="rolling")


def test_individuals_are_those_of_pymoos_own_loop():
    """Made from the table at the end, or evaluated by pymoo where a user asks and tells."""
    osy = get_problem("osy")
    options = {"block_size": 33, "limits": {"f1": -20}}  # a last block of one
    ours = minimize(osy, PSI(100, **options))
    algorithm = asked_and_told(osy, PSI(100, evaluator=Evaluator(), **options))
    theirs = algorithm.result()
    assert ours.algorithm.evaluator.n_eval == algorithm.evaluator.n_eval == 100
    for name in ("X", "F", "G", "H", "CV", "FEAS", "test_point", "n_gen", "n_iter", "rank"):
        np.testing.assert_array_equal(ours.pop.get(name), theirs.pop.get(name), err_msg=name)
    assert ours.opt.get("test_point").tolist() == theirs.opt.get("test_point").tolist()
    assert ours.algorithm.table.equals(algorithm.table)


@pytest.mark.parametrize(
    "run",
    [
        lambda problem: minimize(problem, PSI(32)).X,
        lambda problem: minimize(problem, PSI(64), ("n_eval", 32)).X,
        lambda problem: minimize(problem, SurrogatePSI(32)).X,
        lambda problem: asked_and_told(problem, PSI(32, block_size=10)).result().X,
        lambda problem: investigate(problem, 32).best(),
        lambda problem: investigate(problem, 32, keep="pareto", block_size=10).best(),
        lambda problem: investigate(problem, 32, keep="feasible", study="s.db").best(),
    ],
)
def test_a_run_of_which_all_tests_failed_says_so_once(run, in_folder):
    """Its result has no front, which may also be one beyond the limits."""
    with pytest.warns(UserWarning, match="32 of 32 tests failed: F is missing; see") as warned:
        flaw(run, Model(lambda x: {"f": x}, n_var=2))
    assert len(warned) == 1


@pytest.mark.parametrize("wrapper", [lambda problem: problem, FailureTolerant])
@pytest.mark.parametrize("output", ["heat", "f", "data"])
def test_asking_and_telling_evaluates_a_discrete_design_once(wrapper, output):
    """And keeps an output named as an attribute of pymoo's individuals."""
    results = lambda x: {"F": [x[0], 2 - x[1]], output: x.sum()}  # noqa: E731
    problem = Model(results, fails=lambda x: x.sum() == 2, n_var=2, xu=2, vtype=int)
    algorithm = asked_and_told(wrapper(problem), PSI(40, block_size=7))
    assert len(problem.calls) == algorithm.evaluator.n_eval == 9
    assert algorithm.table.equals(investigate(problem, 40))


def test_telling_something_else_is_refused():
    algorithm = PSI(100, block_size=40).setup(CHUTE)
    first = algorithm.ask()
    refused(r"with F of shape \(4,\) for each, got shape \(0,\)", algorithm.tell, infills=first)
    first.set("F", np.ones((40, 4)))
    refused(r"with G of shape \(1,\) for each, got shape \(0,\)", algorithm.tell, infills=first)
    algorithm.evaluator.eval(CHUTE, first)
    refused(r"points in their order, \[1, 2, ", algorithm.tell, infills=first[::-1])


class Counting(Evaluator):
    """An evaluator of a user."""


@pytest.mark.parametrize("evaluator", [Counting(), Evaluator(callback=print)])
def test_an_evaluator_that_would_do_nothing_is_refused(evaluator):
    """It may ask and tell."""
    message = "evaluator must be pymoo's own without a callback"
    refused(message, minimize, CHUTE, PSI(4), evaluator=evaluator)


# A model with a further output; the first designs fail, and with them a whole block.
HEATED = Model(
    lambda x: {"F": [x[0] + x[1], x[1] - x[0]], "heat": 3 * x[1]},
    fails=lambda x: x[0] + x[1] < 0.3 or x[0] == x[1],
    n_var=2,
)
NAMED = {"names": {"f1": "mass", "f2": "gain"}, "maximize": ("gain",)}


@pytest.mark.parametrize("block_size", [2, 64])
def test_limits_on_variables_outputs_and_a_maximised_criterion(block_size, study_file):
    limits = {"x1": (0.25, None), "heat": 2.0, "gain": (-0.5, None)}
    whole = investigate(HEATED, 32, **NAMED)
    asked = whole.under(limits=limits)
    ok = whole.status == "ok"
    missing = [0.25 - whole.X[:, 0], whole["heat"] - 2, -0.5 - whole["gain"]]
    expected = np.maximum(missing, 0).sum(axis=0)
    assert asked.feasible().tolist() == (ok & (expected == 0)).tolist()
    for study in (None, study_file, study_file):
        result = minimize(
            HEATED, PSI(32, limits=limits, block_size=block_size, study=study, **NAMED)
        )
        assert result.opt.get("test_point").tolist() == whole.numbers[asked.pareto()].tolist()
        violation = result.pop.get("CV")[:, 0]
        np.testing.assert_allclose(violation[ok], expected[ok], atol=1e-15)
        assert (violation[~ok] > 0).all()


# A model that gives a further output of every fourth design only.
SOMETIMES = Model(
    lambda x: {
        "F": [x[0] + x[1], (x[0] - 1) ** 2 - x[1]],
        **({"heat": x[1]} if x[0] >= 0.75 else {}),
    },
    n_var=2,
)


@pytest.mark.parametrize("block_size", [1, 3, 64])
@pytest.mark.parametrize("keep", ["feasible", "pareto"])
def test_tests_without_an_output_with_a_limit_are_infeasible(keep, block_size):
    """However the tests are cut into blocks, of which whole ones may lack the output."""
    options = {"units": {"heat": "K"}}  # which promise the output, as the first test lacks it
    asked = investigate(SOMETIMES, 64, **options).under(Formulation(limits={"heat": 0.5}))
    expected = (asked.X[:, 0] >= 0.75) & (asked.X[:, 1] <= 0.5)
    np.testing.assert_array_equal(asked.feasible(), expected)
    options |= {"block_size": block_size}
    kept = investigate(SOMETIMES, 64, limits={"heat": 0.5}, keep=keep, **options)
    assert kept.equals(asked.take(getattr(asked, keep)()))


@pytest.mark.parametrize("gives", [lambda x: x[0] > 0, lambda x: x[0] == 0])
def test_outputs_are_asked_of_the_first_test_for_any_number_of_workers(gives):
    """It takes longest here; others end before it."""

    def slowly(x):
        time.sleep(0.3 * (x[0] == 0))
        return {"F": [x[0], x[1]]} | ({"heat": x[1]} if gives(x) else {})

    for runner in ({}, {"elementwise_runner": ProcessRunner(2)}):
        said = flaw(investigate, Model(slowly, n_var=2, **runner), 8, limits={"heat": 1})
        told = re.search("a name in limits must be one of .* got 'heat'; .* must have a unit", said)
        assert (said == "") == (told is None) == gives([0])


@pytest.mark.parametrize("keep", ["all", "feasible", "pareto"])
@pytest.mark.parametrize("elementwise", [True, False])
@pytest.mark.parametrize("asked", [{"limits": "heta<=1"}, {"formulation": Formulation(["heta"])}])
def test_a_misspelt_output_is_refused_at_the_first_test(keep, elementwise, asked, study_file):
    """What was computed is in the study; designs that fail have no outputs."""

    def hot(x):
        return {"F": x[..., :1], "heat": x[..., 1]}

    for study in (None, study_file):
        fails = (lambda x: x[0] == 0) if elementwise else None
        problem = Model(hot, fails=fails, n_var=2, n_obj=1, elementwise=elementwise)
        mistaken = partial(investigate, problem, 10_000, keep=keep, study=study, **asked)
        refused("a name in .* must be one of .*'heta'; did you mean 'heat'", mistaken)
        assert len(problem.calls) == (2 if elementwise else 1)
    if elementwise:
        assert len(read_table(study_file)) == 2
        refused("did you mean 'heat'", investigate, problem, 2, study=study_file, **asked)


def test_a_limit_on_a_choice_may_be_met_by_later_tests():
    """The problem knows the options; of four tests, the second has another one."""
    metal = {"metal": Choice(options=["oak", "tin"])}
    problem = Model(lambda x: {"F": [len(x["metal"])]}, vars=metal, n_obj=1)
    options = {"limits": "metal=tin", "block_size": 1}
    assert investigate(problem, 4, **options).feasible().tolist() == [False, True, False, True]
    refused("'oak', 'tin', got 'tni'", investigate, problem, 4, limits="metal in oak, tni")


@pytest.mark.parametrize("keep", ["all", "feasible", "pareto"])
@pytest.mark.parametrize("block_size", [7, 1000])
@pytest.mark.parametrize("name", ["bnh", "osy", *rarely("dtlz2")])
def test_investigate_is_psi_without_objects(monkeypatch, keep, block_size, name):
    """Also where what is not kept is dropped again and again."""
    monkeypatch.setattr(_run, "SECONDS", 0.0)  # blocks arrive one by one
    monkeypatch.setattr(_psi, "_WORTH_FILTERING", {"feasible": 20, "pareto": 20})
    problem = get_problem(name)
    whole = minimize(problem, PSI(300, first=3)).algorithm.table
    mask = {"all": np.ones(300, bool), "feasible": whole.feasible(), "pareto": whole.pareto()}[keep]
    table = investigate(problem, 300, first=3, keep=keep, block_size=block_size)
    assert table.equals(whole.take(mask))


def test_a_termination_is_asked_after_64_points():
    """However many there are."""
    seen = []
    callback = lambda algorithm: seen.append(algorithm.n_tested)  # noqa: E731
    minimize(CHUTE, PSI(100_000), ("n_gen", 3), callback=callback)
    assert seen == [64, 128, 192]


@pytest.mark.parametrize(("n", "share"), [(2050, None), (8200, (1, 4))])
def test_there_are_32_iterations_at_most(n, share):
    """The last one is smaller; from 2048 points on, 64 designs are too few."""
    algorithm = PSI(n, share=share).setup(CHUTE)
    algorithm.next()
    assert (algorithm.n_tested, algorithm.n_left) == (65, 2050 - 65)


def teeth():
    """A vectorised model of whole numbers."""
    return Model(
        lambda X: {"F": X[:, :1] ** 2.0},
        n_var=1,
        n_obj=1,
        xl=1,
        xu=6,
        vtype=int,
        elementwise=False,
    )


def test_a_repeated_design_is_evaluated_once_but_for_workers():
    """Those of a vectorised model know only their own points."""
    problem = teeth()
    table = investigate(problem, 40)
    assert (sum(len(X) for (X,) in problem.calls), table.repeats.sum()) == (6, 34)
    with ThreadPoolExecutor(2) as threads:
        assert investigate(teeth(), 40, runner=ExecutorRunner(threads, workers=2)).equals(table)


def test_an_algorithm_is_set_up_once():
    algorithm = PSI(8)
    assert algorithm.n_tested == len(algorithm.table) == 0
    for ask in (lambda: algorithm.n_left, algorithm.has_next, algorithm.next):
        refused("PSI must be set up, got one without a problem; call setup", ask)
    minimize(CHUTE, algorithm, copy_algorithm=False)
    refused("must be set up before it runs, got one that has tested 8", algorithm.setup, CHUTE)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_points": 0}, "n_points must be an integer >= 1, got 0"),
        ({"names": ["time"]}, r"a mapping from names such as f1 to your own, got \['time'\]"),
        ({"sampling": "lsh"}, r"sampling must be one of 'halton', .* 'lhs', 'lptau', "),
        ({"sampling": 3}, r"sampling must be a name such as 'lhs', LPTauSampling\(\), .* got 3"),
        ({"sampling": QMCSampling("lhs"), "first": 41}, "first must be 1 for the engine 'lhs'"),
        ({"limits": {"f9": 1.0}}, "a name in limits must be one of 'f1', .*, 'f4', 'x1', 'x2'"),
        ({"retry": "all"}, "retry must be one of 'failed', 'incomplete', got 'all'"),
        ({"sampling": LPTauSampling(first=2)}, "first of LPTauSampling must be 1 here, got 2; giv"),
    ],
)
@pytest.mark.parametrize(
    "run", [lambda **o: minimize(CHUTE, PSI(**o)), partial(investigate, CHUTE)]
)
def test_mistakes(run, options, message):
    refused(message, run, **{"n_points": 8} | options)


@pytest.mark.parametrize(
    ("run", "message"),
    [
        (lambda: investigate(CHUTE, 4, repeat=2), "^repeat must be 1 .* got 2; .*noisy"),
        (lambda: investigate(CHUTE, 8, keep="best"), "keep must be one of 'all', 'feasible', "),
        (lambda: minimize(CHUTE, PSI(10), sed=1), "keyword argument 'sed'; did you mean 'seed'"),
        (lambda: PSI(8, more=True), "more must be used with a study"),
        (lambda: PSI(8, share=(1, 2, 3)), "share must be a pair"),
        (lambda: PSI(8, share="12"), "share must be a pair"),
        (lambda: PSI(8, share=3), r"share must be a pair \(k, n\), the k-th of n parts, got 3"),
        (
            lambda: investigate(Problem(vars={"c": Choice(options=["x", None])}, n_obj=1), 4),
            "a value of c must be a number, True, False or text, got None; name options",
        ),
        (lambda: PSI(8, blocksize=5), "keyword argument 'blocksize'; did you mean 'block_size'"),
        (lambda: PSI(10, n_jobs=2), "keyword argument 'n_jobs'; give .* elementwise_runner=Jobli"),
        (lambda: minimize(CHUTE, PSI(8, study=5)), "study must be the name of a file, got 5"),
        (lambda: minimize(CHUTE, PSI(8, study="")), "study must be the name of a file, got ''"),
        (lambda: Recorded(CHUTE, None), "study must be the name of a file, got None"),
        (lambda: minimize(SphereChute, PSI(10)), "pass an instance, not the class"),
        (
            lambda: minimize(Problem(n_var=2, n_obj=2, xl=0, xu=np.inf), PSI(10)),
            "bounds of x1 of Problem must be finite and in .* order, got 0.0 and inf",
        ),
    ],
)
def test_other_mistakes(run, message):
    refused(message, run)


@pytest.mark.parametrize("algorithm", [PSI(256), PSI(256, block_size=30), PSI(40)])
def test_a_budget_of_evaluations_is_kept_exactly(algorithm):
    """Also where it is no multiple of a block; the points are those of the run without it."""
    n, problem = min(100, algorithm.n_points), get_problem("bnh")
    done = minimize(problem, algorithm, ("n_eval", 100)).algorithm
    assert done.evaluator.n_eval == n
    assert done.table.equals(investigate(problem, n))


@pytest.mark.parametrize(
    ("problem", "least"), [(Required(CHUTE, {"r": "x1 <= 1"}), 60), (teeth(), 6), (die(), 10)]
)
def test_points_without_an_evaluation_do_not_use_up_a_budget(problem, least):
    """But each test of a noisy model counts, also of designs that recur."""
    assert minimize(problem, PSI(1000), ("n_eval", least)).algorithm.evaluator.n_eval == least


@pytest.mark.parametrize("run", [lambda *args: minimize(*args).algorithm, asked_and_told])
def test_designs_that_violate_a_requirement_are_counted_once(run):
    problem = Required(CHUTE, {"r": "x1 <= 0.3"})
    algorithm = run(problem, PSI(32, block_size=8))
    assert problem.n_not_run == (algorithm.table.X[:, 0] > 0.3).sum() > 0
