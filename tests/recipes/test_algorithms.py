"""The recipes of pymoo's documentation, each with every algorithm of ours.

A test names the page that it follows. However a run is made, looked at, stopped or taken up again,
its table is that of ``minimize(problem, algorithm, seed=1)``.
"""

import copy
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from multiprocessing.pool import ThreadPool

import dill
import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2, RankAndCrowdingSurvival
from pymoo.core.callback import Callback
from pymoo.core.evaluator import Evaluator
from pymoo.core.mixed import MixedVariableGA
from pymoo.core.problem import Problem
from pymoo.core.termination import NoTermination
from pymoo.core.variable import Binary, Choice, Integer, Real
from pymoo.indicators.hv import Hypervolume
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.problems.static import StaticProblem
from pymoo.termination import get_termination
from pymoo.termination.collection import TerminationCollection
from pymoo.termination.default import DefaultMultiObjectiveTermination
from pymoo.termination.ftol import MultiObjectiveSpaceTermination
from pymoo.termination.max_gen import MaximumGenerationTermination
from pymoo.termination.robust import RobustTermination
from pymoo.util.archive import MultiObjectiveArchive
from pymoo.util.display.multi import MultiObjectiveOutput
from pymoo.util.display.single import SingleObjectiveOutput
from pymoo.util.misc import termination_from_tuple

try:
    from pymoo.parallelization import DaskParallelization, StarmapParallelization
except ImportError:  # until pymoo 0.6.1.5
    from pymoo.core.problem import DaskParallelization, StarmapParallelization

from pymoo_psi import PSI, FailureTolerant, ProcessRunner, QMCSampling, SurrogatePSI
from tests.helpers.draws import rarely
from tests.helpers.models import Model

# Each tests 28 designs in three iterations.
ALGORITHMS = {
    "PSI": lambda **options: PSI(28, block_size=12, **options),
    "PSI of scrambled points": lambda **options: PSI(
        28, block_size=12, sampling=QMCSampling(), **options
    ),
    "SurrogatePSI": lambda **options: SurrogatePSI(28, n_points=12, batch=8, **options),
}
N, ITERATIONS = 28, 3
BNH = get_problem("bnh")


def plane(least=1.0, **options):
    """The constrained problem of the pages on constraints and on parallelisation."""
    return Model(
        lambda x: {"F": x[0] ** 2 + x[1] ** 2, "G": least - (x[0] + x[1])},
        **{"n_var": 2, "n_obj": 1, "n_ieq_constr": 1, "xu": 2} | options,
    )


PLANE = plane()


def mixed(n_obj=2):
    """The problem of the page on mixed variables, with one or two objectives."""

    def results(X):
        factor = (100 if X["b"] else 1) * (10 if X["x"] == "multiply" else 1)
        first, second = X["z"] ** 2 + X["y"] ** 2, (X["z"] + 2) ** 2 + (X["y"] - 1) ** 2
        return {"F": [first, factor * second][:n_obj]}

    return Model(
        results,
        vars={
            "b": Binary(),
            "x": Choice(options=["nothing", "multiply"]),
            "y": Integer(bounds=(-2, 2)),
            "z": Real(bounds=(-5, 5)),
        },
        n_obj=n_obj,
    )


@pytest.fixture(params=["PSI", "SurrogatePSI", *rarely("PSI of scrambled points")])
def make(request):
    return ALGORITHMS[request.param]


@pytest.fixture
def algorithm(make):
    return make()


# Where the loop around the algorithm is tested in many ways, surrogates take most of the time.
rarely_others = pytest.mark.parametrize(
    "make", ["PSI", *rarely("SurrogatePSI", "PSI of scrambled points")], indirect=True
)


@cache
def table_of(make, problem=BNH):
    return minimize(problem, make(), seed=1).algorithm.table


# interface/minimize, interface/result, algorithms/usage


def test_a_run_leaves_the_algorithm_as_it_is(make, algorithm):
    first, second = minimize(BNH, algorithm, seed=1), minimize(BNH, algorithm, seed=1)
    assert (algorithm.problem, algorithm.n_tested) == (None, 0)
    assert first.algorithm.table.equals(second.algorithm.table)


def by_asking(algorithm, problem):
    algorithm.setup(problem, termination=("n_gen", ITERATIONS), seed=1)
    while algorithm.has_next():
        algorithm.tell(infills=algorithm.evaluator.eval(problem, algorithm.ask()))
    return algorithm.result()


def test_asking_and_telling(make, algorithm):
    by_asking(algorithm, BNH)
    assert algorithm.ask() is None
    assert algorithm.table.equals(table_of(make))


def test_asking_and_telling_without_the_problem(make, algorithm):
    """The user evaluates, the loop decides on the end, and an evaluator takes the values in."""
    problem = Problem(n_var=2, n_obj=2, n_ieq_constr=2, xl=BNH.xl, xu=BNH.xu)
    algorithm.setup(problem, termination=NoTermination(), seed=1)
    for _ in range(ITERATIONS):
        population = algorithm.ask()
        F, G = BNH.evaluate(population.get("X"))
        Evaluator().eval(StaticProblem(problem, F=F, G=G), population)
        algorithm.tell(infills=population)
    np.testing.assert_array_equal(algorithm.table.X, table_of(make).X)
    np.testing.assert_array_equal(algorithm.table.F, table_of(make).F)


def test_nothing_feasible(make):
    problem = plane(least=5.0)
    assert minimize(problem, make(), seed=1).F is None
    least = minimize(problem, make(), seed=1, return_least_infeasible=True)
    assert least.CV[0] == least.pop.get("CV").min() == 5 - least.X.sum() > 0


def test_an_archive(make):
    result = minimize(BNH, make(archive=MultiObjectiveArchive()), seed=1)
    assert result.algorithm.table.equals(table_of(make))
    assert sorted(result.archive.get("test_point")) == sorted(result.opt.get("test_point"))


# interface/callback, interface/display, misc/convergence, getting_started/part_4


def state(algorithm):
    return (
        algorithm.n_gen,
        algorithm.evaluator.n_eval,
        len(algorithm.opt),
        algorithm.pop.get("F").min(),
    )


class Seen(Callback):
    def notify(self, algorithm):
        self.data.setdefault("states", []).append(state(algorithm))


def test_a_callback_and_the_history_see_every_iteration(make):
    volume = Hypervolume(ref_point=np.array([140.0, 50.0]))
    result = minimize(BNH, make(), seed=1, callback=Seen(), save_history=True)
    history, states = result.history, result.algorithm.callback.data["states"]
    # an entry counts the iteration that comes
    assert states == [(k, *state(entry)[1:]) for k, entry in enumerate(history, 1)]
    assert states[-1][:2] == (ITERATIONS, N)
    assert sum(len(entry.off) for entry in history) == len(history[-1].pop) == N
    volumes = [volume.do(entry.opt.get("F")) for entry in history]
    assert volumes == sorted(volumes)  # every test is kept, so that nothing is lost
    np.testing.assert_array_equal(history[-1].opt.get("F"), result.F)


@pytest.mark.parametrize(
    ("options", "problem", "column"),
    [
        ({}, BNH, "n_nds"),
        ({"output": MultiObjectiveOutput()}, BNH, "n_nds"),
        ({"output": SingleObjectiveOutput()}, PLANE, "f_min"),
    ],
    ids=["our own", "of several objectives", "of one"],
)
@rarely_others
def test_outputs(make, options, problem, column, capsys):
    minimize(problem, make(), seed=1, verbose=True, **copy.deepcopy(options))
    lines = capsys.readouterr().out.splitlines()
    heading, *_, last = (
        [cell.strip() for cell in line.split("|")] for line in lines if "|" in line
    )
    assert column in heading
    assert last[:2] == [str(ITERATIONS), str(N)]


# interface/termination


@pytest.mark.parametrize(
    ("termination", "iterations"),
    [
        (("n_gen", 2), 2),
        (("n_eval", 13), 2),
        (get_termination("n_gen", 100), 3),
        (("time", 1e-9), 1),
        (TerminationCollection(get_termination("n_gen", 2), get_termination("time", 300)), 2),
        (DefaultMultiObjectiveTermination(n_max_gen=2), 2),
        (RobustTermination(MultiObjectiveSpaceTermination(tol=1e9, n_skip=0), period=1), 2),
        (NoTermination(), 3),
        (None, 3),
    ],
    ids=lambda value: value if isinstance(value, int) else type(value).__name__,
)
@rarely_others
def test_terminations(make, termination, iterations):
    calls = []
    options = {"pf": BNH.pareto_front(), "callback": calls.append}
    result = minimize(BNH, make(), copy.deepcopy(termination), seed=1, **options)
    assert len(calls) == iterations
    table = result.algorithm.table
    assert result.opt.get("test_point").tolist() == table.numbers[table.pareto()].tolist()
    assert table_of(make).take(np.arange(len(table))).equals(table)


# misc/checkpoint


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (1, MaximumGenerationTermination(20)),
        (2, termination_from_tuple(("n_eval", 10**6))),
        (9, MaximumGenerationTermination(20)),
    ],
)
@rarely_others
def test_checkpoints_of_functional_runs(make, algorithm, before, after):
    minimize(BNH, algorithm, ("n_gen", before), seed=1, copy_algorithm=False)
    checkpoint = dill.loads(dill.dumps(algorithm))
    checkpoint.termination = copy.deepcopy(after)
    result = minimize(BNH, checkpoint, seed=1, copy_algorithm=False, verbose=False)
    assert result.algorithm.table.equals(table_of(make))
    assert result.algorithm.evaluator.n_eval == N


# customization/initialization, getting_started/part_3


@pytest.mark.parametrize("part", ["pop", "opt", "X"])
@rarely_others
def test_its_designs_start_another_algorithm(make, part):
    """As a population they come evaluated, as an array of designs they do not."""
    found = minimize(BNH, make(), seed=1)
    start = getattr(found, part)
    result = minimize(BNH, NSGA2(pop_size=len(start), sampling=start), ("n_gen", 1), seed=1)
    assert result.algorithm.evaluator.n_eval == (len(found.X) if part == "X" else 0)
    assert sorted(result.F.tolist()) == sorted(found.F.tolist())


# customization/mixed, constraints


@pytest.mark.parametrize("n_obj", [2, *rarely(1)])
def test_mixed_variables(make, n_obj):
    problem = mixed(n_obj)
    result = minimize(problem, make(), seed=1)
    assert {x["x"] for x in result.pop.get("X")} == {"nothing", "multiply"}
    np.testing.assert_array_equal(
        problem.evaluate(np.atleast_1d(result.X)), np.atleast_2d(result.F)
    )
    survival = {} if n_obj == 1 else {"survival": RankAndCrowdingSurvival()}
    genetic = MixedVariableGA(pop_size=N, sampling=result.pop, **survival)
    assert minimize(problem, genetic, ("n_gen", 2), seed=1).algorithm.evaluator.n_eval == N


# parallelization


@pytest.fixture(scope="module")
def runners():
    """pymoo's interfaces and ours, each as a runner of single designs."""
    with ThreadPool(2) as pool, ThreadPoolExecutor(2) as client:  # all pymoo asks of Dask's client
        yield {
            "starmap": StarmapParallelization(pool.starmap),
            "dask": DaskParallelization(client),
            "ours": ProcessRunner(n_jobs=2),
        }


@pytest.mark.parametrize("name", ["starmap", "ours", *rarely("dask")])
@pytest.mark.parametrize("wrap", [lambda problem: problem, FailureTolerant])
@rarely_others
def test_runners_change_no_result(make, runners, name, wrap):
    problem = wrap(plane(elementwise_runner=runners[name]))
    assert minimize(problem, make(), seed=1).algorithm.table.equals(table_of(make, PLANE))
