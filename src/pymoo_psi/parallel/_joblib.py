"""The runner on the workers of joblib."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing, suppress
from functools import partial
from itertools import islice
from time import sleep
from typing import Any

from pymoo_psi._modules import versions
from pymoo_psi._validation import job_count
from pymoo_psi.errors import EvaluationError, PsiError, WorkerError
from pymoo_psi.parallel._engine import ProcessRunner
from pymoo_psi.parallel._evaluation import (
    Answer,
    Result,
    answer_by,
    answer_of,
    one_line,
    pickled_function,
)
from pymoo_psi.parallel._runner import JOBS_AHEAD, Queue, Runner, raise_original

# joblib is imported in the functions that need it: the package is imported without it.

# Calls for each worker in one call of a backend that returns all results at its end.
_CALLS_TOGETHER = 32
# Milliseconds that loky may take to send jobs on; less than one is usual.
_ABORT_POLLS = 1000
# What may have changed since joblib's workers started: see _renew_workers.
_STATE: list[Any] = []


class JoblibRunner(Runner):
    """An ``elementwise_runner`` that evaluates the designs of any pymoo problem by joblib.

    ``joblib.Parallel`` evaluates, with the backend and the number of workers that
    ``joblib.parallel_config`` says: loky, which is joblib's default, threading, multiprocessing,
    dask, or another one. joblib keeps its workers for the next call. They receive chunks of
    designs, sized by the measured cost of a design; results come in the order of the designs and
    do not depend on this. joblib looks for results every 10 ms: a model that takes less time for a
    whole batch is faster without a runner.

    PSI and :class:`~pymoo_psi.FailureTolerant` record the designs for which the model raises. If a
    worker of loky dies, the designs that were under way are evaluated by a
    :class:`~pymoo_psi.ProcessRunner`, which finds the one that is to blame. With other backends the
    run ends with a :class:`~pymoo_psi.errors.WorkerError`, and the same call continues its study.

    What joblib does not promise: no design has a time limit; a program that a model has started may
    outlive its worker; joblib's multiprocessing waits forever for a worker that has died; threads
    share one current folder, which a model must not change. Use a
    :class:`~pymoo_psi.ProcessRunner` for models that hang, crash, or start programs; see the guide
    "Which runner?".

    Args:
        n_jobs: Number of workers; -1 is the number of ``joblib.parallel_config``, or else of
            cores. 1 evaluates in this process.
        backend: A backend of joblib, instead of that of ``joblib.parallel_config``.

    Raises:
        ArgumentValueError: A number is out of range.
        ArgumentTypeError: An argument has the wrong type.
        EvaluationError: In use: a design raised or was lost.
        WorkerError: In use: the problem cannot be sent to the workers, or they cannot import it, or
            they have another version of it, or a backend has lost them.

    Example:
        >>> import numpy as np
        >>> from pymoo_psi import SphereChute
        >>> X = np.array([[0.2635, 0.1072], [0.3, 0.2]])
        >>> F, G = SphereChute(0.4, elementwise_runner=JoblibRunner(n_jobs=2)).evaluate(X)
        >>> np.array_equal(F, SphereChute(0.4).evaluate(X)[0])
        True
    """

    in_rounds = True  # joblib takes no more calls after the last one that it knew

    def __init__(self, n_jobs: int = -1, *, backend: Any = None) -> None:
        super().__init__()
        self.n_jobs: int = job_count("n_jobs", n_jobs)
        self.backend = backend

    @property
    def n_workers(self) -> int:
        """How many workers there are now."""
        _, n_workers = self._active()
        return n_workers

    def _active(self) -> tuple[Any, int]:
        """Return joblib's active backend and the number of its workers."""
        from joblib import parallel_config
        from joblib.parallel import get_active_backend

        backend, n_jobs = get_active_backend()
        if self.backend is not None:
            with parallel_config(backend=self.backend):
                backend, _ = get_active_backend()
        if self.n_jobs != -1 or n_jobs is None:
            n_jobs = self.n_jobs
        return backend, max(1, int(backend.effective_n_jobs(n_jobs)))

    def results(self, queue: Queue) -> Generator[Result | None]:
        """Yield the results of a queue; see :class:`Runner`."""
        backend, n_workers = self._active()
        if n_workers == 1:
            yield from queue.evaluated_here()
        while queue.is_ready:
            yield from self._results(queue, backend, n_workers)

    def _results(self, queue: Queue, backend: Any, n_workers: int) -> Generator[Result | None]:
        """Yield the results of one call of joblib; what is added after its last job stays there."""
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        try:
            answers = _answers(queue, backend, n_workers)
            try:
                for answer in answers:
                    yield from queue.results_of(*answer)
            finally:
                with warnings.catch_warnings():  # joblib warns of calls that are given up
                    warnings.simplefilter("ignore")
                    answers.close()
        except PsiError:
            raise
        except Exception as error:
            if not isinstance(error, TerminatedWorkerError) or sys.platform == "win32":
                raise WorkerError(
                    f"joblib's workers cannot go on ({one_line(error)}); repeat the call: a study "
                    "goes on"
                ) from error
            yield from queue.go_on_with(ProcessRunner(n_workers))


def _answers(queue: Queue, backend: Any, n_workers: int) -> Generator[Answer]:
    """Let joblib do the jobs of a queue; yield the answers in any order.

    joblib asks for jobs by itself, in threads of its own, when workers are free: it would end the
    call if it had to wait for one.
    """
    from joblib import Parallel, delayed
    from joblib.parallel import LokyBackend

    if isinstance(backend, LokyBackend):
        _renew_workers()
        backend.abort_everything = partial(_abort_in_order, backend)
    call = partial(answer_of, queue.function)
    if not getattr(backend, "supports_sharedmem", False):
        call = partial(answer_by, pickled_function(queue.function))
    return_as = "generator_unordered"
    n_calls = None
    if not backend.supports_return_generator:
        return_as = "list"
        n_calls = _CALLS_TOGETHER * n_workers
    parallel = Parallel(
        n_workers,
        backend=backend,
        batch_size=1,
        pre_dispatch=JOBS_AHEAD * n_workers,
        return_as=return_as,
    )

    def calls() -> Iterator[Any]:
        while queue.is_ready:
            yield delayed(call)(queue.take())

    return (answer for answer in parallel(islice(calls(), n_calls)))


def _renew_workers() -> None:
    """Give up the workers that joblib has kept if new ones might give other values."""
    from joblib.externals.loky import get_reusable_executor

    state = [versions(), {**os.environ}, os.getcwd(), [*sys.path]]
    if state != _STATE:
        get_reusable_executor(reuse=True).shutdown()
        _STATE[:] = state


def _abort_in_order(backend: Any, **options: Any) -> None:
    """Abort what joblib runs on loky, once loky has sent on all that was submitted.

    Its thread fails at a job that joblib, when a result came, submitted there just before the
    abort: loky forgets all jobs, but not that this one is the next.
    """
    try:
        with suppress(Exception):  # the workers are lost, and nothing is sent
            last = backend._workers.submit(os.getpid)
            for _ in range(_ABORT_POLLS):
                if last.running() or last.done():
                    break
                sleep(0.001)
    finally:
        type(backend).abort_everything(backend, **options)


def in_parallel(
    function: Callable[[Any], Any], tasks: Iterable[Any], n_jobs: int
) -> Generator[tuple[int, Any]]:
    """Do tasks by joblib; yield the number of each, from 0, and its result as soon as it is done.

    Close the iterator early to stop the workers; the garbage collector would do so at any time and
    in any thread.

    Args:
        function: What to do with a task.
        tasks: The tasks.
        n_jobs: Number of workers; 1 is this process.

    Raises:
        WorkerError: A worker was lost, or cannot load the function.
        Exception: What the function raises.
    """
    with closing(Queue(function, JoblibRunner(n_jobs))) as queue:
        queue.add(enumerate(tasks))
        try:
            for number, result, _ in queue:
                yield number, result
        except EvaluationError as error:
            raise_original(error)


def runner_of_jobs(n_jobs: int, timeout: float | None = None) -> Runner:
    """Return a runner on guarded processes; on Windows, which has none, on joblib's workers.

    Raises:
        ArgumentValueError: There is a timeout, and the system is Windows.
    """
    if sys.platform == "win32" and timeout is None:
        return JoblibRunner(n_jobs)
    return ProcessRunner(n_jobs, timeout=timeout)
