"""Executors that lose tasks and workers, break, and change: nothing is lost or wrong."""

import copy
import os
import pickle
import time
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import cloudpickle
import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    ExecutorRunner,
    SurrogatePSI,
    VectorizedSphereChute,
    investigate,
)
from pymoo_psi.errors import WorkerError
from pymoo_psi.files import read_table
from tests.helpers.draws import rarely
from tests.helpers.models import Sum
from tests.helpers.processes import posix, until
from tests.helpers.refusals import refused


def sum_on(executor, before=lambda x: None, **options):
    return Sum(before, elementwise_runner=ExecutorRunner(executor, **options))


def wait(x):
    time.sleep(0.06)


class Scripted:
    """An executor on threads that does with its calls what a script says, and runs the others.

    Args:
        script: For each call an error that its future raises, a result, or None to run it.
    """

    def __init__(self, *script):
        self.script, self.pool = list(script), ThreadPoolExecutor(8)
        self.sent, self.futures = [], []

    def submit(self, function, *args):
        self.sent.append(args)
        what = self.script.pop(0) if self.script else None
        future = Future() if what is not None else self.pool.submit(function, *args)
        if isinstance(what, BaseException):
            future.set_exception(what)
        elif what is not None:
            future.set_result(what)
        self.futures.append(future)
        return future


@pytest.fixture(scope="module")
def processes():
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        yield executor


@posix
def test_a_model_that_kills_its_process(processes, study_file):
    """Bit-identical to a run in this process, but for the design that kills."""
    plain = investigate(Sum(), 48)
    assert minimize(sum_on(processes), PSI(48, study=study_file)).algorithm.table.equals(plain)
    table = investigate(sum_on(processes, lambda x: x[0] > 0.95 and os._exit(3)), 48)
    failed = plain.X[:, 0] > 0.95
    assert {*table.reasons} == {*plain.numbers[failed].tolist()} != set()
    assert {*table.reasons.values()} == {"its worker process died (exit code 3, 2 times)"}
    np.testing.assert_array_equal(table.F[~failed], plain.F[~failed])


@posix
@pytest.mark.slow
def test_surrogates_on_an_executor(processes, study_file):
    search = minimize(sum_on(processes), SurrogatePSI(32, study=study_file), seed=1)
    assert len(search.algorithm.table) == len(read_table(study_file)) == 32


@posix
def test_processes_of_python_end_what_is_given_up_and_stay(processes):
    """Otherwise an interpreter would wait for these designs, of ten minutes, at its end."""
    minimize(
        sum_on(processes, lambda x: time.sleep(600 * x[0])),
        PSI(64, block_size=1),
        termination=("n_eval", 1),
    )
    assert [*processes.map(abs, [-1] * 4)] == [1] * 4
    investigate(sum_on(processes), 8)


def test_a_vectorised_problem_on_an_executor(processes):
    problem, runner = VectorizedSphereChute(0.4), ExecutorRunner(processes)
    options = {"keep": "pareto", "limits": {"f1": 2.5}}
    table = investigate(problem, 3000, runner=runner, block_size=500, **options)
    assert table.equals(investigate(problem, 3000, **options))
    refused(
        "vectorised, got one that is evaluated one design", investigate, Sum(), 8, runner=runner
    )
    refused("runner must be of type Runner", investigate, problem, 8, runner=processes)


LOST = RuntimeError("the node is gone")


class Losing(Scripted):
    """An executor that gives up the third task so many times, whatever is sent in between."""

    def __init__(self, times):
        super().__init__()
        self.times = times

    def submit(self, function, *args):
        numbers = [[*dict(cloudpickle.loads(sent[2]).designs)] for sent in [*self.sent, args]]
        if numbers[2:3] == numbers[-1:] and self.times:
            self.times -= 1
            self.script = [LOST]
        return super().submit(function, *args)


@pytest.mark.parametrize("n_lost", [0, *rarely(1)])
def test_a_task_given_up_is_sent_again_once(n_lost):
    table = investigate(sum_on(Losing(n_lost + 1), wait, workers=1), 8)  # a design is a task
    assert [*table.reasons.values()] == [
        "its worker was lost (RuntimeError: the node is gone)"
    ] * n_lost
    kept = table.status == "ok"
    np.testing.assert_array_equal(table.F[kept], investigate(Sum(), 8).F[kept])


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ([LOST] * 20, "the workers cannot do the tasks .*the node is gone.*import pymoo_psi"),
        pytest.param(
            [ModuleNotFoundError("No module named 'beam'")],
            "cannot do the tasks .*'beam'",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            [None, None, BrokenExecutor("it broke")],
            "takes no more work .*it broke",
            marks=pytest.mark.slow,
        ),
        (
            [(("pymoo-psi 0.1", "Python 3.9"), b"")],
            "has pymoo-psi 0.1 and Python 3.9, this process",
        ),
    ],
)
def test_workers_that_can_do_nothing_end_the_run(study_file, script, message):
    """No design is recorded as failed."""
    executor = Scripted(*script)
    problem = sum_on(executor, workers=1)
    refused(message, investigate, problem, 30, error=WorkerError, study=study_file)
    assert not read_table(study_file).reasons
    executor.script = []
    assert investigate(problem, 30, study=study_file).equals(investigate(Sum(), 30))


class Gathering(Scripted):
    """An executor, the tasks of which wait until as many are under way as are wanted."""

    wanted = most = 0

    def submit(self, function, *args):
        def run():
            assert until(lambda: self.most >= self.wanted)
            return function(*args)

        future = super().submit(run)
        self.most = max(self.most, sum(not future.done() for future in self.futures))
        return future


def test_workers_join_and_leave():
    """At most two tasks a worker are under way, and all of those that have joined are busy."""
    executor, most = Gathering(), []

    def callback(algorithm):
        most.append(executor.most)
        executor.wanted = 4

    problem = sum_on(executor, wait, workers=lambda: 2 if executor.wanted else 1)
    minimize(problem, PSI(48, block_size=16), callback=callback)
    assert most == [2, 4, 4]


def test_tasks_not_begun_are_given_up():
    executor = Scripted()
    executor.pool = ThreadPoolExecutor(1)
    minimize(sum_on(executor, wait, workers=4), PSI(500, block_size=2), ("n_gen", 1))
    assert any(future.cancelled() for future in executor.futures)


def test_copies_have_the_executor_and_pickles_none(processes):
    problem, X = sum_on(processes, wait), np.array([[0.5, 0.25]])
    np.testing.assert_array_equal(copy.deepcopy(problem).evaluate(X), Sum().evaluate(X))
    algorithm = PSI(32, block_size=16)
    algorithm.setup(problem).next()
    algorithm = pickle.loads(pickle.dumps(algorithm))
    refused("the executor takes no more work", algorithm.next, error=WorkerError)
    algorithm.problem.elementwise_runner.executor = processes
    algorithm.run()
    assert algorithm.table.equals(investigate(Sum(), 32))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ExecutorRunner(Scripted()), "workers must be a number, or a function .*, got Scripted"),
        (lambda: ExecutorRunner(Scripted(), workers=0), "workers must be an integer >= 1"),
    ],
)  # fmt: skip
def test_what_is_no_runner_is_refused(make, message):
    refused(message, make)
