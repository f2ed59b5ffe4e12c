"""The runners on guarded processes: of this machine, or of the workers of any executor.

This process sends tasks, each with some designs, and keeps every worker busy: a process of this
machine, or what an executor of a cluster has, such as Dask, Ray, MPI or SLURM. An executor sees
nothing but a function of this module, texts and bytes. Its worker gets the model's function when it
answers that it lacks it; it evaluates the designs in a process of its own under the package's
guard. So a design that hangs, or kills its process, costs that design, on every engine, and the
engine's own worker goes on.
"""

from __future__ import annotations

import asyncio
import os
import platform
import secrets
import sys
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor
from contextlib import suppress
from functools import partial
from pickle import PickleError
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any

import cloudpickle

from pymoo_psi import __version__
from pymoo_psi._validation import (
    Received,
    integer,
    invalid,
    job_count,
    wrong_type,
)
from pymoo_psi.errors import PsiError, WorkerError
from pymoo_psi.parallel._evaluation import (
    CHUNK_SECONDS,
    POLLING_SECONDS,
    Answer,
    Function,
    Result,
    Waiting,
    answer_by,
    lost_values,
    one_line,
    pickled_function,
    sendable,
)
from pymoo_psi.parallel._pool import Environment, Processes, Work
from pymoo_psi.parallel._runner import Runner

# What must agree in this process and in its workers, as functions and values travel by pickle.
_VERSIONS = (f"pymoo-psi {__version__}", f"Python {'.'.join(platform.python_version_tuple()[:2])}")

# Seconds of a task for each worker that there is: this process sends some hundreds of tasks a
# second, and a thousand workers must not ask for more.
_TASK_SECONDS = 0.002
# Tasks for each worker that are under way: one is evaluated while the next one waits beside it.
_TASKS_AHEAD = 2
_ASKING = 0.2  # seconds between two looks at the number of workers
# Bytes of a pickled function up to which each task brings it: this takes less time than a worker
# that has to ask for it.
_SMALL = 10_000
_KEPT = 4  # functions that a worker keeps, one of each run that it works for


class ProcessRunner(Runner):
    """An ``elementwise_runner`` that evaluates designs in guarded worker processes.

    For a model that may hang, crash, or start programs that do. If a worker process dies or runs
    out of time, at most one design fails; another worker evaluates the rest. A design whose process
    died is tried once more before it counts as failed. PSI and :class:`~pymoo_psi.FailureTolerant`
    record the reason; other problems stop with an :class:`~pymoo_psi.errors.EvaluationError`.

    The workers stay alive between generations and receive chunks of designs, sized by the measured
    cost of a design. Results come in the order of the designs and do not depend on this.

    The workers import modules from the same places as this process. They are kept for some minutes
    for the next call of any runner. New workers start if a module was reloaded, or if the
    environment, the current folder, the number of workers or ``fingerprint()`` of the problem has
    changed; code of the main script or a notebook gets new workers with a new runner. Workers, and
    all processes that a model started in them, end with this process. If a model changes the
    current folder, the change is undone after every design.

    No table mixes two versions of a model. A file of yours that was edited after its import is
    refused before anything is evaluated, here, by other runners, and without a runner: reload it by
    ``importlib.reload`` and make the problem again, or restart Python. A worker that imports
    another version than this process has is refused, too.

    Args:
        n_jobs: Number of workers; -1 is one for each core.
        timeout: Seconds that the evaluation of one design may take; then its worker process is
            replaced.

    Raises:
        ArgumentValueError: A number is out of range, or the system is Windows, where no process can
            end another with all that it has started.
        ArgumentTypeError: An argument has the wrong type.
        EvaluationError: In use: a design raised or was lost.
        WorkerError: In use: the problem cannot be sent to worker processes, or they cannot
            import it, or they have another version of it.

    Example:
        >>> import numpy as np
        >>> from pymoo_psi import SphereChute
        >>> runner = ProcessRunner(n_jobs=2, timeout=60)
        >>> X = np.array([[0.2635, 0.1072], [0.3, 0.2]])
        >>> F, G = SphereChute(0.4, elementwise_runner=runner).evaluate(X)
        >>> np.array_equal(F, SphereChute(0.4).evaluate(X)[0])
        True
    """

    def __init__(self, n_jobs: int = -1, *, timeout: float | None = None) -> None:
        super().__init__(timeout)
        if sys.platform == "win32":
            raise invalid(
                "the system of ProcessRunner", "Linux or macOS", "Windows", "use JoblibRunner"
            )
        self.n_jobs = job_count("n_jobs", n_jobs)

    @property
    def n_workers(self) -> int:
        """How many workers there are."""
        if self.n_jobs > 0:
            return self.n_jobs
        from joblib import cpu_count

        return int(cpu_count())

    def stream(self, f: Function, waiting: Waiting) -> Generator[Result | None]:
        """Evaluate the designs of a queue; see :class:`Runner`."""
        yield from Tasks(self, f, waiting).results()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles have the settings; workers and measurements stay here."""
        return partial(type(self), self.n_jobs, timeout=self.timeout), ()


class ExecutorRunner(Runner):
    """An ``elementwise_runner`` that evaluates designs on any ``concurrent.futures.Executor``.

    Such executors are ``client.get_executor()`` of ``dask.distributed``,
    ``mpi4py.futures.MPIPoolExecutor``, those of executorlib and parsl, and ``ProcessPoolExecutor``;
    the guide "More than one machine" has a few lines for Ray. The executor only needs ``submit``;
    futures that can only be polled, such as submitit's, are polled.

    With PSI, no worker waits for the slowest design of a block. Algorithms and studies work as with
    :class:`~pymoo_psi.ProcessRunner`; only this process writes the study. The workers must be able
    to import the same versions of ``pymoo_psi`` and of what the model imports from your folders;
    definitions in the main script or in a notebook are sent.

    Each worker evaluates in a separate process, which is kept for the next designs. A design that
    raises, exits, hangs or kills its process fails alone, with the reason; if the process died, the
    design is first tried once more. Designs of a lost worker run elsewhere, and a task that the
    engine gives up is sent once more. If the executor itself is gone, the run ends with a
    :class:`~pymoo_psi.errors.WorkerError`; the study is kept, and the same call continues it. On
    Windows designs are evaluated in the engine's own workers.

    A copy is the same runner; a pickle has no executor, because executors cannot be sent.

    Args:
        executor: The executor. It stays open.
        workers: How many tasks it runs at the same time: a number, or a function that returns it
            and is called several times a second, because workers may join and leave. By default the
            number that the executor has; for Dask the threads of all workers.
        timeout: Seconds that the evaluation of one design may take; then its process is replaced.

    Attributes:
        executor: The executor.

    Raises:
        ArgumentTypeError: An argument has the wrong type.
        ArgumentValueError: A number is out of range, or ``workers`` is missing and the executor
            does not say how many it has.
        EvaluationError: In use: a design raised or was lost.
        WorkerError: In use: the executor is gone, or its workers cannot load the problem.

    Example:
        >>> from concurrent.futures import ThreadPoolExecutor
        >>> from pymoo_psi import PSI, SphereChute, investigate
        >>> with ThreadPoolExecutor(2) as executor:
        ...     problem = SphereChute(0.4, elementwise_runner=ExecutorRunner(executor))
        ...     table = investigate(problem, 16)
        >>> table.equals(investigate(SphereChute(0.4), 16))
        True
    """

    elastic = True

    def __init__(
        self,
        executor: Any,
        *,
        workers: int | Callable[[], int] | None = None,
        timeout: float | None = None,
    ) -> None:
        if isinstance(executor, type) or not callable(getattr(executor, "submit", None)):
            rule = "an executor, which has a method submit, such as Dask's client.get_executor()"
            raise wrong_type("executor", rule, executor)
        client = getattr(executor, "_client", executor)
        if hasattr(client, "nthreads"):  # Dask's executor, or its client
            if executor is client:
                executor = client.get_executor(pure=False)
            if workers is None:

                def workers() -> int:
                    return sum(client.nthreads().values())

        if workers is None:
            workers = _count_in(executor)
        elif not callable(workers):
            workers = partial(int, integer("workers", workers, minimum=1))
        if workers is None:
            rule = "a number, or a function that returns one, as the executor does not say how many"
            raise invalid("workers", rule, Received(type(executor).__name__))
        super().__init__(timeout)
        self.executor = executor
        self._count = workers
        self._n_workers = 0
        self._asked = -_ASKING

    @property
    def n_workers(self) -> int:
        """How many workers there are now; 0 if the first ones have not joined."""
        now = time.monotonic()
        if now - self._asked >= _ASKING:
            try:
                count = self._count()
            except (OSError, asyncio.TimeoutError) as error:  # the scheduler is gone
                raise _gone(error) from error
            self._n_workers = integer("the result of workers", count, minimum=0)
            self._asked = now
        return self._n_workers

    def stream(self, f: Function, waiting: Waiting) -> Generator[Result | None]:
        """Evaluate the designs of a queue; see :class:`Runner`."""
        yield from Tasks(self, f, waiting, self.executor).results()

    def __copy__(self) -> ExecutorRunner:
        """Return the runner itself: executors are not copied."""
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> ExecutorRunner:
        """Return the runner itself; pymoo copies its algorithms."""
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles have the settings, and an executor that can do nothing."""
        return partial(type(self), Executor(), workers=1, timeout=self.timeout), ()


class Tasks:
    """The tasks of one run: which designs wait, which were sent, and which were sent twice.

    Args:
        runner: The runner.
        function: What to evaluate.
        waiting: The designs, taken when a worker is free; more may be added meanwhile.
        executor: The executor; ``None`` for processes of this machine.
    """

    def __init__(
        self, runner: Runner, function: Function, waiting: Waiting, executor: Any = None
    ) -> None:
        self._runner = runner
        self._function = function
        self._waiting = waiting
        pickled = pickled_function(function)
        self._name = secrets.token_hex(8)
        self._identity = _identity(runner, function, pickled)
        self._workers: Processes | _Cluster
        if executor is None:
            count = runner.n_workers
            threads = max(1, (os.cpu_count() or 1) // count)
            self._workers = Processes(count, Environment.now(self._identity, threads), pickled)
        else:
            self._workers = _Cluster(executor, pickled)
        self._sent: dict[Any, Waiting] = {}  # designs that were sent together, by their future
        self._done: SimpleQueue[Any] = SimpleQueue()  # futures
        self._sent_again: set[int] = set()  # designs of tasks that the engine gave up

    def results(self) -> Generator[Result | None]:
        """Yield results, and ``None`` after moments without one, until no design is left.

        What was sent is given up where the reader closes this; on a cluster, what has begun there
        goes on, and nobody reads it.
        """
        try:
            while True:
                self._fill()
                if not self._sent:
                    return
                try:
                    future = self._done.get(timeout=POLLING_SECONDS)
                except Empty:  # workers may have joined
                    yield None
                    continue
                yield from self._results_of(future, self._sent.pop(future))
        finally:
            for future in self._sent:
                with suppress(Exception):  # an executor that is gone
                    future.cancel()
            self._workers.close()

    def _fill(self) -> None:
        """Send tasks until all workers are busy."""
        if not self._waiting:
            return
        # A cluster may start its first worker when it has a task.
        n_workers = max(1, self._runner.n_workers)
        lasting = max(CHUNK_SECONDS, _TASK_SECONDS * n_workers)
        while self._waiting and len(self._sent) < _TASKS_AHEAD * n_workers:
            size = self._runner.chunk(len(self._waiting), n_workers, lasting)
            self._send(deque(self._waiting.popleft() for _ in range(size)), lasting)

    def _send(self, designs: Waiting, lasting: float, with_function: bool = False) -> None:
        work = Work(self._name, self._identity, designs, self._runner.timeout, lasting)
        future: Any = self._workers.submit(work, with_function)
        self._sent[future] = designs
        if hasattr(future, "add_done_callback"):
            future.add_done_callback(lambda _: self._done.put(future))
        else:  # it calls nobody when it is done
            Thread(target=self._await, args=(future,), daemon=True).start()

    def _await(self, future: Any) -> None:
        with suppress(BaseException):  # it is raised again where the result is read
            future.result()
        self._done.put(future)

    def _results_of(self, future: Any, waiting: Waiting) -> Iterator[Result]:
        """Yield the results of designs that were sent together; send what is left of them again."""
        try:
            answer = self._workers.answer(future)
        except PsiError:  # the guard in the worker has raised it
            raise
        except Exception as error:
            yield from self._given_up(waiting, error)
            return
        if answer is None:  # it lacks the function
            self._send(waiting, CHUNK_SECONDS, with_function=True)
            return
        designs = dict(waiting)
        yield from self._runner.results_of(self._function, designs, answer)
        self._waiting.extendleft(reversed(designs.items()))

    def _given_up(self, waiting: Waiting, error: Exception) -> Iterator[Result]:
        """Send designs again, each alone, whose task the engine gave up; lose them the next time.

        Raises:
            WorkerError: The executor is gone, or its workers cannot do any task.
        """
        if isinstance(error, BrokenExecutor):
            raise _gone(error) from error
        if isinstance(error, (ImportError, AttributeError, PickleError)):
            raise _unusable(error) from error
        for index, design in waiting:
            if index not in self._sent_again:
                self._sent_again.add(index)
                self._send(deque([(index, design)]), CHUNK_SECONDS)
            elif isinstance(error, CancelledError):
                raise _gone(error) from error
            elif not self._runner.samples:  # no worker has done anything
                raise _unusable(error) from error
            else:
                reason = f"its worker was lost ({one_line(error)})"
                yield index, lost_values(self._function, design, reason), 0.0


class _Cluster:
    """The workers of an executor.

    Args:
        executor: The executor.
        function: The pickled function.
    """

    def __init__(self, executor: Any, function: bytes) -> None:
        self._executor = executor
        self._function = function

    def submit(self, work: Work, with_function: bool) -> Any:
        """Return the future of an answer; workers that lack the function need it with the work."""
        function = None
        if with_function or len(self._function) <= _SMALL:
            function = self._function
        name = secrets.token_hex(8)  # engines that know a task by its content repeat none
        packed = cloudpickle.dumps(work)
        try:
            return self._executor.submit(evaluate, _VERSIONS, name, packed, function)
        except PsiError:
            raise
        except Exception as error:
            raise _gone(error) from error

    def answer(self, future: Any) -> Answer | None:
        """Return the answer of a future that is done, or ``None`` if its worker lacks the function.

        Raises:
            WorkerError: It has other versions.
        """
        versions, packed = future.result()
        if versions != _VERSIONS:
            raise WorkerError(
                f"a worker has {' and '.join(versions)}, this process has "
                f"{' and '.join(_VERSIONS)}; install the same versions on the workers"
            )
        if packed is None:
            return None
        answer: Answer = cloudpickle.loads(packed)
        return answer

    def close(self) -> None:
        """The workers are the executor's."""


def _gone(error: BaseException) -> WorkerError:
    return WorkerError(
        f"the executor takes no more work ({one_line(error)}); start it again and repeat the call: "
        "a study goes on"
    )


def _unusable(error: BaseException) -> WorkerError:
    return WorkerError(
        f"the workers cannot do the tasks ({one_line(error)}); they must be able to import "
        "pymoo_psi and what the model imports"
    )


def _identity(runner: Runner, function: Any, pickled: bytes) -> tuple[str, bytes]:
    """Return by what runs know that they may share workers; see :class:`Work`.

    A worker may keep what a module has read from a file that the fingerprint of the function's
    ``problem`` includes. A class of the main module is sent by value, and a worker may also keep
    parts of its last version, which only calls of the same runner may use.
    """
    fingerprint = getattr(getattr(function, "problem", None), "fingerprint", None)
    parameters = None
    if callable(fingerprint):
        with suppress(Exception):  # a run without a study needs no fingerprint
            parameters = fingerprint()
    owner = ""
    if b"_make_function" in pickled or b"_make_skeleton" in pickled:  # cloudpickle's, of code
        owner = runner.name
    return owner, bytes(cloudpickle.dumps(parameters))


# In the workers of an executor

_FUNCTIONS: OrderedDict[str, bytes] = OrderedDict()  # pickled, by their run; the last ones


def evaluate(
    versions: tuple[str, ...], name: str, packed: bytes, function: bytes | None
) -> tuple[tuple[str, ...], bytes | None]:
    """Evaluate designs in a worker of an executor, under a guard.

    Args:
        versions: Those of the sender.
        name: That of the task, different for each.
        packed: The pickled work.
        function: The pickled function, unless the worker is likely to have it.

    Returns:
        The worker's versions; and the pickled answer, or ``None`` if the worker lacks the function,
        or has other versions.
    """
    if versions != _VERSIONS:
        return _VERSIONS, None
    work: Work = cloudpickle.loads(packed)
    if function is not None:
        _FUNCTIONS[work.run] = function
        while len(_FUNCTIONS) > _KEPT:
            with suppress(KeyError):  # other threads of the worker do the same
                _FUNCTIONS.popitem(last=False)
    pickled = _FUNCTIONS.get(work.run)
    if pickled is None:
        return _VERSIONS, None
    if sys.platform != "win32":
        # One thread: the cores of a machine belong to all of its workers.
        processes = Processes(1, Environment.now(work.identity, threads=1), pickled)
        results, failure = processes.evaluate(work)
        if failure is not None:
            failure = sendable(failure)
        answer = results, failure
    else:
        answer = answer_by(pickled, work.designs)
    return _VERSIONS, cloudpickle.dumps(answer)


# Engines


def _count_in(engine: Any) -> Callable[[], int] | None:
    """Return a function that returns how many tasks an engine runs at the same time, if known."""
    # The names are those of clusters and MPI, executorlib, Python's executors and Python's pools.
    for name in ("num_workers", "max_workers", "_max_workers", "_processes"):
        if isinstance(getattr(engine, name, None), int):
            return partial(getattr, engine, name)
    return None
