"""SurrogatePSI: a run is determined, kept, continued and judged, on any problem that PSI takes."""

import dataclasses
import os
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from pymoo.core.variable import Binary, Choice, Integer, Real
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.problems.functional import FunctionalProblem

from pymoo_psi import (
    PSI,
    Formulation,
    ProcessRunner,
    Recorded,
    Restricted,
    SurrogatePSI,
    investigate,
)
from pymoo_psi.files import read_table
from pymoo_psi.problems import ProgramProblem, ProgramRun, design_space
from pymoo_psi.study import Study
from tests.helpers.draws import rarely
from tests.helpers.models import Model
from tests.helpers.processes import posix, printed_by
from tests.helpers.refusals import interrupted, refused


def frame(a, n, b, c):
    if n == 3 and a > 0.5:
        raise ArithmeticError("no mesh")
    m = {"steel": 3.0, "wood": 1.0, 3: 2.0}[c]
    return {
        "F": [a**2 + m + n, (a - 1) ** 2 + 10 / n / m + 1 - b],
        "G": [n - 7.5],
        "weight": 2 * m,
    }


def mixed(**options):
    """All kinds of variables, a constraint, failures and a further output."""
    return Model(
        lambda x: frame(**x),
        vars={
            "a": Real(bounds=(-1, 2)),
            "n": Integer(bounds=(1, 9)),
            "b": Binary(),
            "c": Choice(options=["steel", "wood", 3]),
        },
        n_ieq_constr=1,
        **options,
    )


def run(problem, n, **options):
    options = {"batch": 4} | options  # half the rounds, which take the time
    return minimize(problem, SurrogatePSI(n, **options), seed=1).algorithm


BNH = get_problem("bnh")


@pytest.fixture(scope="module")
def undisturbed():
    return run(mixed(), 36)


# What it finds


@pytest.mark.parametrize("limit", [(5.0, 30.0), *rarely((None, 20.0), (60.0, None))])
def test_a_maximised_objective_is_its_negative(limit):
    """Its limits and fixed range, too: maximised under its name, f1 is -F, and no design differs."""
    asked = Formulation(limits={"f1": limit}, ranges={"f1": (0, 136), "f2": (4, 50)})
    turned = tuple(None if end is None else -end for end in reversed(limit))
    turned = Formulation(limits={"f1": turned}, ranges={"f1": (-136, 0), "f2": (4, 50)})
    plain = run(BNH, 28, formulation=asked).table
    maximised = run(BNH, 28, maximize=["f1"], formulation=turned).table
    np.testing.assert_array_equal(maximised.X, plain.X)
    np.testing.assert_array_equal(maximised.column("f1"), -plain.column("f1"))
    assert plain.feasible()[20:].mean() > 0.7


@pytest.mark.parametrize(
    "asked",
    [
        {"objectives": ["f2", "x1"], "maximize": ["x1"]},
        *rarely(
            {"objectives": ["g1", "weight"]},
            {"objectives": ["far", "f2"], "computed": {"half": "f1 / 2", "far": "half * (1 + x2)"}},
            {"omitted": ["g1"], "limits": {"g1": (0.1, None)}},
            {"objectives": ["f1"], "maximize": ["f1"], "limits": {"share": (None, 0.4)},
             "computed": {"share": "f2 / (f1 + 1)"}},
        ),
    ],
)  # fmt: skip
def test_a_formulation_directs_the_proposals_and_changes_no_test(asked):
    """More of them than of points of PSI are on its front; F has the problem's objectives."""

    class Weighed(type(BNH)):
        def _evaluate(self, x, out, *args, **kwargs):
            super()._evaluate(x, out, *args, **kwargs)
            out["weight"] = x[:, 0] + x[:, 1]

    problem, formulation = Weighed(), Formulation(**asked)
    search = run(problem, 40, formulation=formulation)
    tests = search.table.under(Formulation())
    np.testing.assert_array_equal(tests.F, problem.evaluate(tests.X)[0])
    optimal = search.table.numbers[search.table.pareto()]
    assert {*search.opt.get("test_point")} == {*optimal.tolist()}
    points = investigate(problem, 40, first=1001)
    pareto = tests.extended(dataclasses.replace(points, problem=None)).under(formulation).pareto()
    assert pareto[20:40].mean() > 2 * pareto[40:].mean()


def test_limits_on_variables_and_outputs_direct_proposals():
    limits = {"n": (4, 6), "a": (None, 0.5), "c": ["wood", "3"]}
    table = run(mixed(), 28, limits=limits | {"weight": (3, None)}).table
    assert table.under(limits=limits).feasible()[20:].all()
    assert (table["weight"][20:] >= 3).mean() > 0.8


def test_variables_of_any_kind_may_be_objectives():
    asked = Formulation(objectives=["f1", "n", "a"], maximize=["n"])
    assert (run(mixed(), 28, formulation=asked).table["a"][20:] < 0).all()


@pytest.mark.parametrize("limit", [(1.1, 1.3), *rarely((None, 1.4), (1.2, None))])
def test_designs_without_a_limited_value_are_not_promising(limit):
    """The best objectives are where the model gives no heat, and there no limit is kept."""

    def silent(x):
        F = [(x[1] - 0.3) ** 2 - x[0], (x[1] - 0.6) ** 2 - x[0]]
        return {"F": F} if x[0] > 0.5 else {"F": F, "heat": 1 + x[0]}

    table = run(Model(silent, n_var=2), 36, limits={"heat": limit}, units={"heat": "K"}).table
    known = np.isfinite(table.column("heat"))
    assert known[:20].mean() < 0.6
    assert known[20:].mean() > 0.65
    assert table.feasible()[20:].mean() > table.feasible()[:20].mean()


def test_penalties_do_not_blind_the_surrogates():
    def penalised(x, penalty):
        away = 1 + 4 * ((x[1:] - 0.37) ** 2).sum()
        F = [x[0] * away, (1 - np.sqrt(x[0])) * away] if x[0] >= 0.4 else [penalty, penalty]
        return {"F": F, "G": [0.4 - x[0]]}

    infinite, large = (
        run(Model(partial(penalised, penalty=penalty), n_var=3, n_ieq_constr=1), 28).table
        for penalty in (np.inf, 1e9)
    )
    np.testing.assert_array_equal(infinite.X, large.X)
    assert (infinite.F[20:].sum(axis=1) < 1.2).mean() > 0.5


# What it keeps


def test_the_first_tests_are_the_points_of_psi(undisturbed):
    points, table = minimize(mixed(), PSI(20)).algorithm.table, undisturbed.table
    assert table.numbers.tolist() == list(range(1, 37))
    np.testing.assert_array_equal(table.X[:20], points.X)
    np.testing.assert_array_equal(table.F[:20], points.F)
    rounds = np.where(table.failed(), np.nan, np.repeat(np.arange(5), [20, 4, 4, 4, 4]))
    np.testing.assert_array_equal(table["proposal_round"], rounds)


@pytest.mark.parametrize("n", [25, *rarely(40)])
def test_a_run_is_the_beginning_of_a_longer_one(undisturbed, n):
    np.testing.assert_array_equal(run(mixed(), n).table.X[:36], undisturbed.table.X[:n])


@posix
@pytest.mark.slow
@pytest.mark.parametrize("case", ["asynchronous", "evidence"])
def test_runs_killed_again_and_again_lose_and_repeat_nothing(case, tmp_path):
    """The benchmark, with fewer kills; it ends with an error where anything differs."""
    command = [sys.executable, "-m", "benchmarks.kills", case, "2"]
    root = Path(__file__).parents[2]
    environment = os.environ | {"PYTHONPATH": f"{root / 'src'}{os.pathsep}{root}"}
    assert "2 kills" in printed_by(*command, cwd=tmp_path, env=environment)


class InAnyOrder(ProcessRunner):
    """So many designs at a time, which end in any order.

    None ends while a worker waits for the next proposals, unless all ``total`` designs are there.
    """

    def __init__(self, n_jobs, total):
        super().__init__(n_jobs)
        self.random, self.total = np.random.default_rng(1), total
        self.most = self.given = 0

    def results(self, queue):
        at = []
        while queue.waiting or at:
            while queue.waiting and len(at) < self.n_jobs:
                at.append(queue.take().popleft())
                self.given += 1
            self.most = max(self.most, len(at))
            if len(at) < self.n_jobs and self.given < self.total:
                time.sleep(0.001)
                yield None
                continue
            index, design = at.pop(self.random.integers(len(at)))
            yield from queue.results_of([(index, queue.function(design), 1.0)])


@pytest.mark.parametrize(
    ("workers", "options"),
    [
        pytest.param(3, {}, marks=pytest.mark.slow, id="three"),
        pytest.param(30, {"termination": ("n_gen", 100)}, id="ended"),
    ],
)
def test_workers_get_proposals_while_others_are_tested(study_file, workers, options):
    first, last = InAnyOrder(workers, 40), InAnyOrder(workers, 10)
    options |= {"study": study_file, "asynchronous": True, "limits": {"weight": (2, 5)}}
    interrupted(run, mixed(elementwise_runner=first, stop=30), 40, **options)
    stored, proposed = read_table(study_file), Study(study_file).proposals()
    assert len(stored) == 30
    # each was made from all tests before it but for those that were being made
    for number, *_, content in proposed[3:]:
        assert 0 < len(content["pending"]) <= 2 * workers
        assert max(content["pending"]) < number
    algorithm = run(mixed(elementwise_runner=last), 40, **options)
    assert (first.most, last.most) == (workers, min(workers, 10))
    assert algorithm.evaluator.n_eval == 10
    assert algorithm.table.numbers.tolist() == list(range(1, 41))
    assert algorithm.table.under(Formulation()).take(stored.numbers - 1).equals(stored)
    units = [content["point"] for *_, content in proposed]
    tested = design_space(mixed()).matrix(np.array(units))[: 40 - 20]
    np.testing.assert_array_equal(algorithm.table.X[20 : 20 + len(tested)], tested)


def test_proposals_are_added_after_points_whose_number_counts(study_file):
    run(BNH, 24, study=study_file, sampling="lhs")
    longer = run(BNH, 28, study=study_file, sampling="lhs")
    assert longer.evaluator.n_eval == 4
    assert longer.table.equals(run(BNH, 28, sampling="lhs").table)


def test_a_limit_may_be_on_an_output_that_no_stored_test_has(study_file):
    def warm(x, **heat):
        return {"F": [x[0], (1 - x[0]) ** 2 + x[1]], **heat}

    minimize(Model(warm, n_var=2), PSI(20, study=study_file))
    problem = Model(lambda x: warm(x, heat=x[0]), n_var=2)
    table = run(problem, 16, study=study_file, limits={"heat": (0.5, None)}).table
    assert (table["proposal_round"] > 0).all()
    assert (table["heat"][4:] > 0.45).mean() > 0.5


def off_centre(x):
    return ((x - 0.85) ** 2).sum()


def unequal(x):
    return (x[1] - x[0]) ** 2


def test_tests_of_other_bounds_are_learned_where_they_are(study_file):
    """As if they were on the edge of the bounds, they would be taken for bad designs near it."""

    wide = FunctionalProblem(3, [off_centre], xl=0, xu=10)
    minimize(wide, PSI(40, study=study_file))
    part = Restricted(wide, dict.fromkeys(("x1", "x2", "x3"), (0.0, 1.0)))
    table = run(part, 40, study=study_file, batch=None).table
    assert (table["proposal_round"] == 0).sum() >= 18  # one or two of the 40 are within these
    assert table["f1"].min() < 1e-6


def test_other_values_of_a_fixed_variable_are_not_learned(study_file):
    whole = FunctionalProblem(2, [unequal], xl=0, xu=1)
    minimize(whole, PSI(40, study=study_file))
    part = Restricted(whole, {"x1": 0.3})
    both = (run(part, 28, **options).table.X for options in ({"study": study_file}, {}))
    np.testing.assert_array_equal(*both)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_evaluations": 0}, "n_evaluations must be an integer >= 1, got 0"),
        ({"share": (1, 2)}, "share"),
        ({"limits": {"f1": 1}, "formulation": Formulation()}, "limits must be left out beside a"),
        ({"formulation": {"objectives": ["f1"]}}, "formulation must be of type"),
    ],
)
def test_what_cannot_be_is_told(options, message):
    refused(message, SurrogatePSI, **{"n_evaluations": 8, **options})


class Bar(ProgramProblem):
    """A program that gives the force; all else is computed from it and the variables."""

    def __init__(self, goals):
        outputs = {
            "force": {"file": "stdout.txt", "pattern": "(.*)"},
            "area": {"expression": "a**3 * sin(9 * b)"},
            "stress": {"expression": "force / (a + 0.01)"},
            "gain": {"expression": "area - 5 * force**2"},
        }
        super().__init__(
            {"a": (0, 1), "b": (0, 1)},
            {"command": "echo {a} {b}"},
            outputs,
            goals,
            {"stress": "<= 40"},
        )

    def run(self, values, *, keep=False):
        a, b = values["a"], values["b"]
        force, area = np.sin(5 * a) + b, a**3 * np.sin(9 * b)
        outputs = {"stress": force / (a + 0.01), "gain": area - 5 * force**2}
        return ProgramRun(Path(), outputs={"force": force, "area": area, **outputs})


@pytest.mark.parametrize(
    "wrap", [lambda bar, path: bar, *rarely(lambda bar, path: Recorded(bar, study=path))]
)
def test_what_is_an_expression_is_computed_and_not_learned(wrap, study_file):
    """The least area is -1; where nothing is computed, the first round reaches -0.4."""
    bar = wrap(Bar({"minimize": ["area"], "maximize": ["gain"]}), study_file)
    assert run(bar, 24).table.F[20:, 0].min() < -0.99


def test_an_objective_that_expressions_need_is_learned():
    """Though it is none of the decision's."""
    asked = Formulation(objectives=["stress"])
    assert (
        run(Bar({"minimize": ["force"]}), 24, formulation=asked).table["stress"][20:].min() < -1.04
    )
