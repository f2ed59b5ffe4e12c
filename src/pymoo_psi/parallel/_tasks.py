"""Independent tasks on the workers that joblib's configuration asks for."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import Any

from pymoo_psi.errors import EvaluationError, WorkerError
from pymoo_psi.parallel._backend import active_workers
from pymoo_psi.parallel._cost import Cost
from pymoo_psi.parallel._outcome import RemoteTraceback
from pymoo_psi.parallel._pool import ProcessPool


def in_parallel(
    function: Callable[[Any], Any], tasks: Iterable[Any], n_jobs: int
) -> Iterator[tuple[int, Any]]:
    """Give the number and the result of each task as soon as it is done.

    Args:
        function: What to do with a task; it is sent to a worker once.
        tasks: The tasks; they are taken as workers get free, so that there may be any number.
        n_jobs: Number of workers, as of :class:`~pymoo_psi.JoblibRunner`; where it is 1, the tasks
            are done in this process.

    Raises:
        WorkerError: A worker was lost, or cannot load the function.
        Exception: What the function raises.
    """
    workers = active_workers(n_jobs)
    if workers.kind != "processes":
        from joblib import Parallel, delayed

        # One at a time: joblib would send many together that have been short so far.
        parallel = Parallel(workers.count, batch_size=1, return_as=workers.return_as)
        yield from parallel(delayed(_numbered)(function, *task) for task in enumerate(tasks))
    elif workers.count == 1:
        for number, task in enumerate(tasks):
            yield number, function(task)
    else:
        left = enumerate(tasks)
        # one under way and one that waits, so that no worker is idle while its result is read
        waiting = deque(islice(left, 2 * workers.count))
        done = ProcessPool().run(function, waiting, workers=workers.count, cost=Cost())
        try:
            for number, result, _ in done:
                waiting.extend(islice(left, 1))
                yield number, result
        except EvaluationError as error:
            if error.original is None:
                raise WorkerError(f"a worker process failed: {error.reason}") from error
            error.original.__cause__ = RemoteTraceback(error.trace)
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


def _numbered(function: Callable[[Any], Any], number: int, task: Any) -> tuple[int, Any]:
    return number, function(task)
