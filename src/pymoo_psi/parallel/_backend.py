"""The workers that joblib's configuration asks for: processes, threads, or those of a cluster."""

from __future__ import annotations

import threading
import warnings
from collections import deque
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from functools import cache
from time import perf_counter
from typing import Any

from pymoo_psi.parallel._evaluation import (
    CHUNK,
    Cost,
    Function,
    Result,
    Waiting,
    evaluate_chunk,
)
from pymoo_psi.parallel._pool import ProcessPool

# joblib is imported in the functions that need it: a worker, which imports this, does not.


@dataclass(frozen=True)
class Workers:
    """What joblib would use now.

    Attributes:
        count: How many evaluations run at the same time.
        kind: ``"processes"`` of our own, ``"threads"`` of this process, or a ``"cluster"``.
    """

    count: int
    kind: str


def active_workers(n_jobs: int) -> Workers:
    """Return the workers for ``n_jobs`` jobs; -1 leaves the number to ``parallel_config``."""
    from joblib.parallel import get_active_backend

    backend, configured = get_active_backend()
    if n_jobs == -1 and configured is not None:
        n_jobs = configured
    kind = "cluster"
    if type(backend).__module__ == "joblib._parallel_backends":  # loky's processes are ours
        n_jobs = _cores() if n_jobs == -1 else n_jobs
        kind = "threads" if type(backend).__name__ == "ThreadingBackend" else "processes"
    return Workers(max(1, backend.effective_n_jobs(n_jobs)), kind)


@cache
def _cores() -> int:
    """Return the number of cores; joblib reads it from files, which takes longer than a batch."""
    from joblib import cpu_count

    return int(cpu_count())


def evaluate_by_joblib(
    f: Function, waiting: Waiting, cost: Cost, workers: Workers, timeout: float | None, retries: int
) -> Generator[Result]:
    """Evaluate by threads, or on a cluster in processes beside its workers.

    A model that ends its process must not end a cluster's worker: with joblib's Dask backend the
    run would wait for that worker's results forever.

    The arguments are those of :meth:`ProcessPool.run`; time limit and retries are not for threads.
    """
    from joblib.parallel import Parallel, delayed, get_active_backend

    def tasks() -> Iterator[Any]:
        while waiting:
            # asked each time, since the cost becomes known on the way
            size = cost.chunk(len(waiting), workers.count)
            chunk = [waiting.popleft() for _ in range(min(size, len(waiting)))]
            if workers.kind == "cluster":
                yield delayed(_beside)(f, chunk, timeout, retries)
            else:
                yield delayed(_chunk)(f, chunk)

    unordered = get_active_backend()[0].supports_return_generator
    while waiting:  # joblib asks for no more tasks once there were none
        # One at a time: joblib would send many together that have been short so far.
        return_as = "generator_unordered" if unordered else "list"
        answers = iter(Parallel(workers.count, batch_size=1, return_as=return_as)(tasks()))
        try:
            for results, rest in answers:
                waiting.extendleft(reversed(rest))
                for result in results:
                    cost.add(result[2])
                    yield result
        finally:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # that results are not read
                if isinstance(answers, Generator):
                    answers.close()


Answer = tuple[list[Result], list[tuple[int, Any]]]  # results, and designs that are left


def _chunk(f: Function, chunk: list[tuple[int, Any]]) -> Answer:
    """Evaluate a chunk in a thread."""
    answers = evaluate_chunk(f, [design for _, design in chunk])
    done = [(i, *answer) for (i, _), answer in zip(chunk, answers, strict=False)]
    return done, chunk[len(done) :]


_of_this_thread = threading.local()  # a cluster's worker may evaluate in several at a time


def _beside(
    f: Function, chunk: list[tuple[int, Any]], timeout: float | None, retries: int
) -> Answer:
    """Evaluate a chunk in a process beside the worker of a cluster."""
    if not hasattr(_of_this_thread, "pool"):
        _of_this_thread.pool = ProcessPool()
    pool: ProcessPool = _of_this_thread.pool
    waiting, began = deque(chunk), perf_counter()
    done: list[Result] = []
    rest: list[tuple[int, Any]] = []
    for result in pool.run(f, waiting, Cost(), 1, timeout, retries):
        done.append(result)
        if perf_counter() - began > 2 * CHUNK:
            rest += waiting
            waiting.clear()
    return done, rest
