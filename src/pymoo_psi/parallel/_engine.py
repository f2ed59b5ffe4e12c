"""The runners on guarded processes: of this machine, or of the workers of any executor.

Both are given jobs by ``submit``. A worker is a thread of this process, or what an executor of a
cluster has, such as Dask, Ray, MPI or SLURM. It evaluates the designs of a job in a process of its
own under the package's guard. So a design that hangs, or kills its process, costs that design, on
every engine, and the engine's own worker goes on.

An executor sees nothing but a function of this module, texts and bytes.
"""

from __future__ import annotations

import asyncio
import os
import platform
import secrets
import sys
import time
from collections import deque
from collections.abc import Callable, Collection, Generator
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import suppress
from functools import partial
from pathlib import Path
from pickle import PickleError
from queue import Empty, SimpleQueue
from tempfile import gettempdir
from threading import Event, Semaphore, Thread
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
    Answer,
    Function,
    Result,
    answer_by,
    one_line,
    pickled_function,
    sendable,
)
from pymoo_psi.parallel._pool import Job, environment_now, evaluate, give_up, keep_idle
from pymoo_psi.parallel._runner import JOBS_AHEAD, Queue, Runner

# What must agree in this process and in its workers, as functions and values travel by pickle.
_VERSIONS = (f"pymoo-psi {__version__}", f"Python {'.'.join(platform.python_version_tuple()[:2])}")

_POLLING_SECONDS = 0.05  # without a result, after which the reader may do something else
_ASKING = 0.2  # seconds between two looks at the number of workers
_LOOKING = 0.2  # seconds between two looks whether a run is given up
_PATIENCE = 30.0  # seconds in which workers end what is given up; a tenth is usual


class FutureRunner(Runner):
    """A runner that is given jobs by ``submit``.

    A subclass writes ``n_workers`` and ``submit``.
    """

    def results(self, queue: Queue) -> Generator[Result | None]:
        """Yield the results of a queue; see :class:`Runner`.

        A job that the engine gives up is sent again, each of its designs alone; a design whose job
        is given up again is lost. What was submitted is given up where the reader closes this.
        """
        job = self.job(queue.function)
        sent: dict[Any, Job] = {}
        done: SimpleQueue[Any] = SimpleQueue()

        def send(job: Job) -> None:
            future = self.submit(job)
            sent[future] = job
            _put_when_done(future, done)

        try:
            while sent or queue.waiting:  # a pause may hold what waits
                # A cluster may start its first worker when it has a job.
                while queue.is_ready and len(sent) < JOBS_AHEAD * max(1, self.n_workers):
                    send(job._replace(designs=queue.take(), seconds=queue.job_seconds))
                try:
                    future = done.get(timeout=_POLLING_SECONDS)
                except Empty:  # workers may have joined
                    yield None
                    continue
                finished = sent.pop(future)
                answer = self._answer_to(finished, future, queue)
                if answer is None:
                    for design in finished.designs:
                        send(finished._replace(designs=deque([design]), is_again=True))
                else:
                    yield from queue.results_of(*answer)
                    queue.take_back(finished.designs)
        finally:
            self.give_up(job.run, sent)

    def _answer_to(self, job: Job, future: Any, queue: Queue) -> Answer | None:
        """Return the answer to a job, or ``None`` if the engine gives it up for the first time.

        Raises:
            WorkerError: No job of the queue can be done.
        """
        try:
            return self.answer(future)
        except PsiError:  # the guard in the worker has raised it
            raise
        except Exception as error:
            _require_engine(error, job, queue)
            if not job.is_again:
                return None
            index, _ = job.designs[0]
            loss = OSError(f"its worker was lost ({one_line(error)})")
            return [(index, loss, 0.0)], None, {}

    def job(self, function: Function) -> Job:
        """Return a job of a new run, yet without designs.

        Raises:
            WorkerError: The function cannot be pickled.
        """
        pickled = pickled_function(function)
        identity = _identity(self._name, function, pickled)
        return Job(secrets.token_hex(8), pickled, identity, self.timeout, deque())

    def submit(self, job: Job) -> Any:
        """Return the future of a job: one of Python's, or an engine's that can be polled.

        Raises:
            WorkerError: The workers are gone.
        """
        raise NotImplementedError

    def answer(self, future: Any) -> Answer:
        """Return the answer of a future that is done.

        Raises:
            Exception: What the worker raised, or the engine.
        """
        answer: Answer = future.result()
        return answer

    def give_up(self, run: str, futures: Collection[Any]) -> None:
        """Give up the jobs of a run; what threads of this process have begun ends, too."""
        for future in futures:
            with suppress(Exception):  # an executor that is gone
                future.cancel()
        if futures:
            give_up(run)


def _put_when_done(future: Any, done: SimpleQueue[Any]) -> None:
    """Put a future into a queue as soon as it is done."""
    if hasattr(future, "add_done_callback"):
        future.add_done_callback(lambda _: done.put(future))
        return

    def wait_for_it() -> None:
        with suppress(BaseException):  # it is raised again where the result is read
            future.result()
        done.put(future)

    Thread(target=wait_for_it, daemon=True).start()


def _require_engine(error: Exception, job: Job, queue: Queue) -> None:
    """Refuse to go on if a job was given up because no job can be done.

    Raises:
        WorkerError: The executor is gone, or its workers cannot do the jobs of the queue.
    """
    if isinstance(error, BrokenExecutor) or (job.is_again and isinstance(error, CancelledError)):
        raise _gone(error) from error
    is_useless = isinstance(error, (ImportError, AttributeError, PickleError))
    if job.is_again:
        is_useless = not queue.samples  # no worker has done anything
    if is_useless:
        raise WorkerError(
            f"the workers cannot do the tasks ({one_line(error)}); they must be able to import "
            "pymoo_psi and what the model imports"
        ) from error


def _gone(error: BaseException) -> WorkerError:
    """Return the error for an executor that takes no more jobs."""
    return WorkerError(
        f"the executor takes no more work ({one_line(error)}); start it again and repeat the call: "
        "a study goes on"
    )


def _identity(runner: str, function: Any, pickled: bytes) -> tuple[str, bytes]:
    """Return by what runs know that they may share workers; see :class:`Job`.

    A worker may keep what a module has read from a file that the fingerprint of the function's
    ``problem`` includes. A class of the main module is sent by value, and a worker may also keep
    parts of its last version, which only calls of the same runner may use.
    """
    fingerprint = getattr(getattr(function, "problem", None), "fingerprint", None)
    parameters = None
    if callable(fingerprint):
        parameters = fingerprint()
    owner = ""
    if b"_make_function" in pickled or b"_make_skeleton" in pickled:  # cloudpickle's, of code
        owner = runner
    return owner, bytes(cloudpickle.dumps(parameters))


class ProcessRunner(FutureRunner):
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
    ``importlib.reload`` and make the problem again, or restart Python. A run also ends when a
    worker imports another version than this process or another worker has.

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
        self.n_jobs: int = job_count("n_jobs", n_jobs)

    @property
    def n_workers(self) -> int:
        """How many workers there are."""
        if self.n_jobs > 0:
            return self.n_jobs
        from joblib import cpu_count

        return int(cpu_count())

    def job(self, function: Function) -> Job:
        """Return a job of a new run in the environment of this process."""
        job = super().job(function)
        threads = max(1, (os.cpu_count() or 1) // self.n_workers)  # workers share the cores
        environment = environment_now(job.identity, threads)
        return job._replace(environment=environment, free=Semaphore(self.n_workers))

    def submit(self, job: Job) -> Future[Answer]:
        """Return the future of a job, which begins as soon as a worker is free."""
        future: Future[Answer] = Future()
        # A daemon, for which the interpreter does not wait at its end: its worker may be stuck.
        Thread(target=_answer, args=(job, future), daemon=True).start()
        return future

    def give_up(self, run: str, futures: Collection[Any]) -> None:
        """Give up the jobs of a run; see :class:`Runner`."""
        super().give_up(run, futures)
        wait([future for future in futures if not future.cancelled()])  # until no thread is at work
        keep_idle(self.n_workers)


class ExecutorRunner(FutureRunner):
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

    A copy is the same runner; a pickle has no executor, because executors cannot be sent: set that
    of ``algorithm.problem.elementwise_runner.executor``.

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
        if hasattr(executor, "get_executor"):  # a client of Dask
            executor = executor.get_executor(pure=False)
        if not hasattr(executor, "submit"):
            raise wrong_type(
                "executor",
                "an executor, which has a method submit, such as Dask's client.get_executor()",
                executor,
            )
        if workers is None:
            workers = _count_in(executor)
        elif not callable(workers):
            workers = partial(int, integer("workers", workers, minimum=1))
        if workers is None:
            raise invalid(
                "workers",
                "a number, or a function that returns one, as the executor does not say how many",
                Received(type(executor).__name__),
            )
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
                self._n_workers = int(self._count())
            except (OSError, asyncio.TimeoutError) as error:  # the scheduler is gone
                raise _gone(error) from error
            self._asked = now
        return self._n_workers

    def submit(self, job: Job) -> Any:
        """Return the future of a job."""
        name = secrets.token_hex(8)  # engines that know a task by its content repeat none
        try:
            return self.executor.submit(evaluate_packed, _VERSIONS, name, cloudpickle.dumps(job))
        except Exception as error:
            raise _gone(error) from error

    def answer(self, future: Any) -> Answer:
        """Return the answer of a future that is done.

        Raises:
            WorkerError: Its worker has other versions.
        """
        versions, packed = future.result()
        if versions != _VERSIONS:
            raise WorkerError(
                f"a worker has {' and '.join(versions)}, this process has "
                f"{' and '.join(_VERSIONS)}; install the same versions on the workers"
            )
        answer: Answer = cloudpickle.loads(packed)
        return answer

    def give_up(self, run: str, futures: Collection[Any]) -> None:
        """Give up the jobs of a run; see :class:`Runner`."""
        super().give_up(run, futures)
        # Python cancels nothing that it has sent to these workers, and waits for it at its end.
        if isinstance(self.executor, ProcessPoolExecutor) and sys.platform != "win32":
            running = [future for future in futures if not future.done()]
            if running:
                _end_by_mark(run, running)

    def __copy__(self) -> ExecutorRunner:
        """Return the runner itself: executors are not copied."""
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> ExecutorRunner:
        """Return the runner itself; pymoo copies its algorithms."""
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles have the settings, and an executor that can do nothing."""
        n_workers = max(1, self._n_workers)
        return partial(type(self), Executor(), workers=n_workers, timeout=self.timeout), ()


def _answer(job: Job, future: Future[Answer]) -> None:
    """Do a job once a worker is free, in a thread of its own."""
    with job.free:
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(evaluate(job))
        except BaseException as error:
            future.set_exception(error)


# In the workers of an executor


def evaluate_packed(
    versions: tuple[str, ...], name: str, packed: bytes
) -> tuple[tuple[str, ...], bytes]:
    """Evaluate designs in a worker of an executor, under a guard.

    Args:
        versions: Those of the sender.
        name: That of the task, different for each.
        packed: The pickled job.

    Returns:
        The worker's versions; and the pickled answer, empty if the worker has other versions.
    """
    if versions != _VERSIONS:
        return _VERSIONS, b""
    job: Job = cloudpickle.loads(packed)
    if sys.platform != "win32":
        is_done = Event()
        Thread(target=_follow_end, args=(job.run, is_done), daemon=True).start()
        try:
            results, failure, accepted = evaluate(job)
        finally:
            is_done.set()
        if failure is not None:
            failure = sendable(failure)
        answer = results, failure, accepted
    else:
        answer = answer_by(job.function, job.designs)
    return _VERSIONS, cloudpickle.dumps(answer)


def _mark_of_end(run: str) -> Path:
    """Return the file that is there while workers of the same machine give up a run."""
    return Path(gettempdir(), f"pymoo-psi-{run}")


def _end_by_mark(run: str, running: Collection[Future[Any]]) -> None:
    """Let workers of this machine give up a run."""
    mark = _mark_of_end(run)
    mark.touch()
    try:
        wait(running, _PATIENCE)
    finally:  # a second interrupt ends the wait
        mark.unlink(missing_ok=True)


def _follow_end(run: str, is_done: Event) -> None:
    """Give up a run in this worker where its mark says so, until its job is done."""
    mark = _mark_of_end(run)
    while not mark.exists():
        if is_done.wait(_LOOKING):
            return
    give_up(run)


# Engines


def _count_in(engine: Any) -> Callable[[], int] | None:
    """Return a function that returns how many tasks an engine runs at the same time, if known."""
    client: Any = getattr(engine, "_client", None)
    if hasattr(client, "nthreads"):  # of Dask
        return lambda: sum(client.nthreads().values())
    # The names are those of clusters and MPI, executorlib, and Python's executors.
    for name in ("num_workers", "max_workers", "_max_workers"):
        if isinstance(getattr(engine, name, None), int):
            return partial(getattr, engine, name)
    return None
