"""Independent tasks on the workers that joblib's configuration asks for."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from itertools import islice
from typing import Any

from pymoo_psi.errors import EvaluationError, WorkerError
from pymoo_psi.parallel._backend import active_workers, by_joblib
from pymoo_psi.parallel._cost import Cost
from pymoo_psi.parallel._outcome import remote_traceback
from pymoo_psi.parallel._pool import ProcessPool

# Tasks for each worker that are under way, wait for it, or are done and wait to be read: two are
# sent ahead, and as many may be done while this process is busy with earlier ones.
AHEAD = 4


def in_parallel(
    function: Callable[[Any], Any], tasks: Iterable[Any], n_jobs: int
) -> Generator[tuple[int, Any]]:
    """Give the number and the result of each task as soon as it is done.

    Whoever may leave amid the results closes this, which ends the workers: what the collector of
    garbage does, it does at any time and in any thread.

    Args:
        function: What to do with a task; it is sent to a worker once.
        tasks: The tasks; they are taken as results are read, so that there may be any number.
        n_jobs: Number of workers, as of :class:`~pymoo_psi.JoblibRunner`; where it is 1, the tasks
            are done in this process.

    Raises:
        WorkerError: A worker was lost, or cannot load the function.
        Exception: What the function raises.
    """
    workers = active_workers(n_jobs)
    if workers.count == 1 and workers.kind == "processes":
        for number, task in enumerate(tasks):
            yield number, function(task)
        return
    left = enumerate(tasks)
    waiting = deque(islice(left, AHEAD * workers.count))
    if workers.kind == "processes":
        done = ProcessPool().run(function, waiting, Cost(), workers=workers.count)
    else:
        done = by_joblib(function, waiting, workers, Cost())
    try:
        with closing(done):
            for number, result, _ in done:
                yield number, result
                waiting.extend(islice(left, 1))
    except EvaluationError as error:
        if error.original is None:
            raise WorkerError(f"a worker process failed: {error.reason}") from error
        error.original.__cause__ = remote_traceback(error)
        raise error.original from None


def in_order(numbered: Iterable[tuple[int, Any]]) -> Iterator[Any]:
    """Give numbered results in the order of their numbers, each as soon as it can be."""
    waiting: dict[int, Any] = {}
    turn = 0
    for number, result in numbered:
        waiting[number] = result
        while turn in waiting:
            yield waiting.pop(turn)
            turn += 1
