"""The workers that joblib's configuration asks for: ours, threads, or those of a cluster."""

from __future__ import annotations

import threading
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from functools import cache, partial
from time import perf_counter
from typing import Any

from pymoo_psi.parallel._cost import Cost, chunk_size
from pymoo_psi.parallel._outcome import Function, Result, Waiting, evaluate_to_travel
from pymoo_psi.parallel._pool import ProcessPool

# joblib is imported in the functions that need it: a worker, which imports this, does not.


@dataclass(frozen=True)
class Workers:
    """What joblib would use now.

    Attributes:
        count: How many evaluations run at the same time.
        kind: ``"processes"`` of our own, ``"threads"`` of this process, or a ``"cluster"``, as
            which joblib's loky counts where it is configured.
    """

    count: int
    kind: str


def active_workers(n_jobs: int) -> Workers:
    """Return the workers for ``n_jobs`` jobs; -1 leaves the number to ``parallel_config``."""
    from joblib.parallel import get_active_backend

    backend, configured = get_active_backend()
    if n_jobs == -1 and configured is not None:
        n_jobs = configured
    name, kind = type(backend).__name__, "cluster"
    if type(backend).__module__ == "joblib._parallel_backends":
        n_jobs = _cores() if n_jobs == -1 else n_jobs
        if name == "ThreadingBackend":
            kind = "threads"
        # What is configured is always the same object; joblib's default is a new one each time.
        elif name != "LokyBackend" or get_active_backend()[0] is not backend:
            kind = "processes"
    return Workers(max(1, backend.effective_n_jobs(n_jobs)), kind)


@cache
def _cores() -> int:
    """Return the number of cores; joblib reads it from files, which takes longer than a batch."""
    from joblib import cpu_count

    return int(cpu_count())


def by_joblib(
    f: Function,
    waiting: Waiting,
    workers: Workers,
    cost: Cost,
    *,
    timeout: float | None = None,
    retries: int = 1,
) -> Generator[Result]:
    """Evaluate by threads, or on a cluster in processes beside its workers.

    A model that ends its process must not end a cluster's worker: with joblib's Dask backend the
    run would wait for that worker's results forever.

    The arguments are those of :meth:`ProcessPool.run`; time limit and retries are not for threads.
    """
    from joblib.parallel import Parallel, delayed, get_active_backend

    evaluate: Callable[..., list[Result]] = _chunk
    if workers.kind == "cluster":
        evaluate = partial(_watched_chunk, timeout=timeout, retries=retries)
    unordered = get_active_backend()[0].supports_return_generator

    def tasks() -> Iterator[Any]:
        while waiting:
            # asked each time, since the cost becomes known on the way
            size = chunk_size(len(waiting), workers.count, cost.seconds)
            yield delayed(evaluate)(f, [waiting.popleft() for _ in range(size)])

    while waiting:  # joblib asks for no more tasks once there were none
        # One at a time: joblib would send many together that have been short so far.
        return_as = "generator_unordered" if unordered else "list"
        parallel = Parallel(workers.count, batch_size=1, return_as=return_as)
        chunks = iter(parallel(tasks()))
        try:
            for chunk in chunks:
                for index, values, seconds in chunk:
                    cost.add(1, seconds)
                    yield index, values, seconds
        finally:
            with warnings.catch_warnings():
                # Of results that nobody reads: who stops amid a run knows that.
                warnings.simplefilter("ignore", UserWarning)
                if isinstance(chunks, Generator):
                    chunks.close()


def _chunk(f: Function, designs: list[tuple[int, Any]]) -> list[Result]:
    """Evaluate a chunk, in a worker of joblib."""
    done = []
    for index, design in designs:
        began = perf_counter()
        values = evaluate_to_travel(f, design)
        done.append((index, values, perf_counter() - began))
    return done


_of_this_thread = threading.local()  # a cluster's worker may evaluate in several at a time


def _watched_chunk(
    f: Function, designs: list[tuple[int, Any]], timeout: float | None, retries: int
) -> list[Result]:
    """Evaluate a chunk in a process beside the worker of a cluster."""
    if not hasattr(_of_this_thread, "pool"):
        _of_this_thread.pool = ProcessPool()
    pool: ProcessPool = _of_this_thread.pool
    done = pool.run(f, deque(designs), Cost(), workers=1, timeout=timeout, retries=retries)
    return list(done)
