"""The runners: what is sent when, in which order it comes back, and what is never lost."""

import contextlib
import copy
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import joblib
import numpy as np
import pytest

from pymoo_psi import ExecutorRunner, FailureTolerant, JoblibRunner, ProcessRunner
from pymoo_psi.errors import EvaluationError, WorkerError
from pymoo_psi.parallel import Queue
from tests.helpers.draws import rarely
from tests.helpers.models import Model
from tests.helpers.processes import gone, posix, until
from tests.helpers.refusals import refused


def tear():
    raise ValueError("the mesh is torn")


MISBEHAVES = {
    3: tear,
    5: partial(time.sleep, 600),
    7: partial(os._exit, 3),
    11: lambda: os.kill(os.getpid(), signal.SIGKILL),
    13: partial(sys.exit, "no licence"),
}


def results(x):
    """Two objectives and the process; at some designs it misbehaves."""
    if x[0] in MISBEHAVES:
        MISBEHAVES[x[0]]()
    return {"F": [x[0] / 3 + x[1], (x[0] - 50) ** 2 / 7], "pid": os.getpid()}


def model(**options):
    return Model(results, n_var=2, xu=100.0, **options)


SHORT = 1.5  # seconds of a time limit that only a design that never ends meets


def designs(*first, n=40):
    """``n`` harmless designs, with the given ones among them."""
    X = np.column_stack([np.arange(20.0, 20.0 + n), np.linspace(0, 1, n)])
    X[4 : 4 + 6 * len(first) : 6, 0] = first
    return X


# The contract, for every way of running


class Polled:
    """An executor, the futures of which only say whether they are done, as submitit's do."""

    class Future:
        def __init__(self, future):
            self.done, self.result = future.done, future.result

    def __init__(self, executor):
        self.executor = executor

    def submit(self, *call):
        return self.Future(self.executor.submit(*call))


def on_threads(**options):
    return ExecutorRunner(ThreadPoolExecutor(2), **options)


@pytest.fixture(
    scope="module",
    params=[
        lambda: JoblibRunner(2),
        lambda: JoblibRunner(1),
        lambda: ProcessRunner(2),
        on_threads,
        *rarely(lambda: ExecutorRunner(Polled(ThreadPoolExecutor(2)), workers=2)),
    ],
    ids=["joblib", "here", "processes", "executor", "polled"],
)
def runner(request):
    return request.param()


class TestContract:
    @pytest.mark.parametrize("X", [designs(n=101), designs()[0]])
    def test_values_and_order_are_those_of_the_plain_loop(self, runner, X):
        np.testing.assert_array_equal(
            model(elementwise_runner=runner).evaluate(X), model().evaluate(X)
        )

    def test_no_designs_and_designs_by_name(self, runner):
        assert runner(lambda x: {}, np.zeros((0, 2))) == []
        named = [{"a": 1.5, "c": "s"}, {"a": 2.5, "c": "l"}]
        assert runner(dict, named) == named

    def test_a_model_may_change_the_folder(self, runner, tmp_path):
        """Relative file names, of this process and of the next design, stay where they were."""

        def wandering(x):
            before = os.getcwd()
            os.chdir(tmp_path)
            time.sleep(0.002)  # of models cheaper than that, several share their folder here
            return {"F": before}

        here = os.getcwd()
        runner = copy.copy(runner)  # that has measured nothing yet
        assert runner(wandering, range(5)) == [{"F": here}] * 5
        assert os.getcwd() == here

    def test_an_exception_names_the_design_and_is_the_cause(self, runner):
        text = r"design \[3\.0, 0\.1\d*\] cannot be evaluated: ValueError: the mesh is torn; FailureTolerant"
        with pytest.raises(EvaluationError, match=text) as caught:
            model(elementwise_runner=runner).evaluate(designs(3))
        assert isinstance(caught.value.__cause__, ValueError)
        np.testing.assert_array_equal(caught.value.design, designs(3)[4])
        # where a worker raised it, its traceback comes as a text
        here = getattr(runner, "n_jobs", 2) == 1
        assert "_evaluate" in str(caught.value.__cause__.__cause__) or here


# Workers


@pytest.fixture(
    scope="module", params=[lambda: ProcessRunner(2), *rarely(on_threads, lambda: JoblibRunner(2))]
)
def workers(request):
    """A runner for the tests after which its workers are as before."""
    return request.param()


@pytest.mark.parametrize("make", [ProcessRunner, *rarely(JoblibRunner)])
def test_a_runner_is_shared_by_nested_calls(make):
    workers = make(2)
    with contextlib.closing(Queue(lambda x: {"F": 2 * x}, workers)) as queue:
        queue.add(enumerate(range(5)))
        for index, values, _ in queue:
            assert workers(lambda x: {"F": -x}, [values["F"]]) == [{"F": -2 * index}]
    assert len(pickle.dumps(workers)) < 300


def test_joblib_evaluates_by_joblib_runner_and_by_no_other(monkeypatch):
    def refuse(*_):
        raise RuntimeError("joblib")

    monkeypatch.setattr(joblib.Parallel, "__call__", refuse)
    refused("joblib", JoblibRunner(2), abs, range(40), error=WorkerError)
    assert ProcessRunner(2)(abs, range(40)) == [*range(40)]


@pytest.fixture
def met(tmp_path):
    """Return a model that waits until n workers are at work, and those that have been."""

    def model(x, n):
        (tmp_path / f"{os.getpid()} {threading.get_ident()}").touch()
        assert until(lambda: len(os.listdir(tmp_path)) >= n)
        return {"F": x}

    return model, lambda: [tuple(map(int, name.split())) for name in os.listdir(tmp_path)]


@pytest.mark.parametrize(
    ("config", "workers_here"),
    [
        ({"backend": "threading", "n_jobs": 2}, "other threads"),
        ({"n_jobs": 1}, "this thread"),
        *(
            pytest.param(config, "none", marks=pytest.mark.slow)
            for config in (
                {"backend": "loky", "n_jobs": 2},
                {"backend": "multiprocessing", "n_jobs": 2},
                {"n_jobs": 3},
            )
        ),
    ],
)
def test_backend_and_number_of_jobs_are_those_of_joblibs_configuration(config, workers_here, met):
    model, workers = met
    n_jobs = config["n_jobs"]
    with joblib.parallel_config(**config):
        values = JoblibRunner()(partial(model, n=n_jobs), range(60))
    assert values == [{"F": x} for x in range(60)]
    assert len(workers()) == n_jobs
    assert ((os.getpid(), threading.get_ident()) in workers()) == (workers_here == "this thread")
    assert ({pid for pid, _ in workers()} == {os.getpid()}) == (workers_here != "none")


@pytest.mark.slow
def test_a_busy_thread_of_joblib_survives_a_failed_run(monkeypatch):
    """Its traceback would be an error here, as of any thread."""
    complete = joblib.parallel.BatchCompletionCallBack.__call__

    def complete_slowly(*args):
        complete(*args)
        time.sleep(0.02)  # jobs that it has submitted wait meanwhile

    monkeypatch.setattr(joblib.parallel.BatchCompletionCallBack, "__call__", complete_slowly)
    failing = model(elementwise_runner=JoblibRunner(2)).evaluate
    refused("the mesh is torn", failing, designs(3), error=EvaluationError)


class Locked(Exception):  # noqa: N818 - short for the reasons
    def __init__(self, text):
        super().__init__(text)
        self.lock = threading.Lock()


def test_whatever_is_raised_or_cannot_be_sent_is_recorded(workers):
    def odd(x):
        if x[0] < 2:
            raise [Locked("no key"), SystemExit("now")][int(x[0])]
        return {"F": x, "more": [threading.Lock(), 1][int(x[0]) - 2]}

    problem = FailureTolerant(Model(odd, n_var=1, n_obj=1, xu=9, elementwise_runner=workers))
    problem.evaluate(np.arange(4.0)[:, None])
    locked, exited, unsent = (failure.reason for failure in problem.failures)
    assert (locked, exited) == ("Locked: no key", "SystemExit: now")
    assert unsent.startswith("its values cannot be sent between processes: TypeError: cannot pick")


REASONS = {
    3: "ValueError: the mesh is torn",
    5: "timed out after 1.5 s",
    7: "its worker process died (exit code 3, 2 times)",
    11: "its worker process died (SIGKILL, 2 times)",
    13: "SystemExit: no licence",
}


@posix
@pytest.mark.parametrize(
    ("make", "lost"),
    [
        (lambda: ProcessRunner(2, timeout=SHORT), [3, 5, 11, 13]),
        pytest.param(lambda: ProcessRunner(2, timeout=SHORT), [*REASONS], marks=pytest.mark.slow),
        pytest.param(lambda: on_threads(timeout=SHORT), [*REASONS], marks=pytest.mark.slow),
        pytest.param(lambda: JoblibRunner(2), [3, 7], marks=pytest.mark.slow),
    ],
    ids=["some", "processes", "executor", "joblib"],
)
def test_time_limits_and_dead_workers_leave_the_others_unharmed(make, lost):
    problem = FailureTolerant(model(elementwise_runner=make()))
    X = designs(*lost)
    F, G = problem.evaluate(X)
    failed = np.flatnonzero(np.isinf(F).all(axis=1))
    assert X[failed, 0].tolist() == lost
    np.testing.assert_array_equal(failed, np.flatnonzero(G[:, 0]))
    others = np.delete(np.arange(len(X)), failed)
    np.testing.assert_array_equal(F[others], model().evaluate(X[others]))
    assert [failure.reason for failure in problem.failures] == [REASONS[x] for x in lost]
    F = problem.evaluate(designs())[0]  # by the workers that replaced the others
    np.testing.assert_array_equal(F, model().evaluate(designs()))


@posix
@pytest.mark.slow
def test_a_lost_design_stops_an_intolerant_problem():
    problem = model(elementwise_runner=ProcessRunner(1, timeout=1e4))
    refused(
        r"design \[7\.0, .*died \(exit code 3, 2 times\);",
        problem.evaluate,
        designs(7),
        error=EvaluationError,
    )
    assert len(problem.evaluate(designs())) == 40, "and it runs again"


def test_a_worker_that_dies_once_costs_nothing(tmp_path, workers):
    def once(x):
        mark = tmp_path / "dead"
        if x == 4 and not mark.exists():
            mark.touch()
            os._exit(1)
        return {"F": x}

    assert workers(once, range(12)) == [{"F": x} for x in range(12)]


@posix
def test_a_worker_killed_while_it_waits_blames_no_design():
    problem = model(elementwise_runner=ProcessRunner(1, timeout=1e4))
    for pid in {*problem.evaluate(designs(), return_as_dictionary=True)["pid"].astype(int)}:
        os.kill(pid, signal.SIGKILL)
        assert gone(pid)
    np.testing.assert_array_equal(problem.evaluate(designs()), model().evaluate(designs()))


@posix
def test_what_a_timed_out_model_started_ends_with_it(tmp_path):
    """Also in the first design of a worker."""
    pids = tmp_path / "pids"

    def with_solver(x):
        groups = (False, True)
        solvers = [subprocess.Popen(["sleep", "600"], start_new_session=new) for new in groups]
        pids.write_text(f"{os.getppid()} {os.getpid()} {solvers[0].pid} {solvers[1].pid}")
        solvers[0].wait()

    refused(
        "timed out after 1.5 s",
        ProcessRunner(1, timeout=SHORT),
        with_solver,
        [1],
        error=EvaluationError,
    )
    assert all(gone(int(pid)) for pid in pids.read_text().split())


@posix
@pytest.mark.parametrize("n_closed", [0, *rarely(61)])
def test_writing_into_descriptors_changes_no_value(n_closed):
    """Into all that a worker inherits. Each design has its own values, and nobody waits forever."""

    def f(x):
        print("step", x, flush=True)
        os.closerange(3, 3 + n_closed)
        for descriptor in range(3, 64):
            with contextlib.suppress(OSError):
                os.write(descriptor, os.urandom(5000))
        return {"F": float(x)}

    assert ProcessRunner(2, timeout=60.0)(f, range(12)) == [{"F": float(x)} for x in range(12)]


def test_problems_that_cannot_be_sent_are_errors(workers):
    class Absent:
        def __reduce__(self):
            return __import__, ("module_that_is_not_there",)

    for content, message in {
        threading.Lock(): "cannot be sent to worker processes: .*'_thread.lock'",
        Absent(): "cannot load the problem: ModuleNotFoundError",
    }.items():
        refused(message, workers, partial(dict, content=content), [1, 2], error=WorkerError)
