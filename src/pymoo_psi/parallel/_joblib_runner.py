"""A runner for pymoo problems: here while they are cheap, in worker processes, on a cluster."""

from __future__ import annotations

import math
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from pymoo_psi._validation import boolean, integer, job_count, positive_number
from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel._backend import Workers, active_workers
from pymoo_psi.parallel._cost import START_SECONDS, Cost, Overhead, chunk_size, worth_sending
from pymoo_psi.parallel._outcome import (
    Function,
    Result,
    Values,
    Waiting,
    evaluate_to_travel,
    one_line,
    raise_again,
    same_folder,
    same_process,
)
from pymoo_psi.parallel._pool import ProcessPool

GLANCE = 1e-3  # seconds between two looks at the cost: long beside a look, short beside sending


class JoblibRunner:
    """Evaluate the designs of any pymoo problem on many workers: its ``elementwise_runner``.

    The workers are processes of their own. They stay alive between generations and are sent
    chunks of designs, sized by the measured cost of one. A model so cheap that sending its designs
    would cost more than it saves is evaluated in this process, as are the first designs of a run,
    which measure the cost. Results come in the order of the designs and do not depend on any of
    this.

    Under ``joblib.parallel_config`` the runner uses the number of jobs given there, and threads
    or a cluster if they are given: ``parallel_config("dask")``, ``"ray"`` or ``"spark"`` runs a
    study on a cluster without a change of code; then every design is sent to the cluster.

    A worker process that dies or runs out of time takes one design with it at most, which is told
    with the reason; the others are evaluated by the worker that replaces it. What becomes of a
    design that is lost is up to the problem: :class:`~pymoo_psi.FailureTolerant` records the
    reason, any other stops with an :class:`~pymoo_psi.errors.EvaluationError`.

    The workers import from where this process does, and end with it, however it ends, with all
    that a model has started in them. A model may change the current folder: afterwards it is the
    same as before, in a worker after every design, here after every millisecond at least.

    Args:
        n_jobs: Number of workers; -1 is the number of ``parallel_config``, or else of cores.
        timeout: Seconds that the evaluation of one design may take; then its worker process is
            replaced. Every design is evaluated in a process that can be ended, on a cluster in
            one beside the cluster's worker. To start and to import the problem, a worker has as
            long, but at least 20 seconds.
        retries: How many times a design whose process died is tried again.
        in_process: Whether designs may be evaluated in this process, to measure their cost and
            while they are cheap, or by threads of it. Say ``False`` if a design takes minutes or
            may crash: then none is, even if there is one worker.

    Raises:
        ArgumentValueError: A number is out of range.
        ArgumentTypeError: An argument has the wrong type.
        EvaluationError: In use: a design raised or was lost.
        WorkerError: In use: the problem cannot be sent to worker processes, or they cannot
            import it.

    Example:
        >>> import numpy as np
        >>> from pymoo_psi import SphereChute
        >>> X = np.array([[0.2635, 0.1072], [0.3, 0.2]])
        >>> F, G = SphereChute(0.4, elementwise_runner=JoblibRunner(n_jobs=2)).evaluate(X)
        >>> np.array_equal(F, SphereChute(0.4).evaluate(X)[0])
        True
    """

    def __init__(
        self,
        n_jobs: int = -1,
        *,
        timeout: float | None = None,
        retries: int = 1,
        in_process: bool = True,
    ) -> None:
        self.n_jobs = job_count("n_jobs", n_jobs)
        self.timeout = None if timeout is None else positive_number("timeout", timeout)
        self.retries = integer("retries", retries, minimum=0)
        self.in_process = boolean("in_process", in_process)
        self._forget()

    def __call__(self, f: Function, X: Iterable[Any]) -> list[Values]:
        """Return ``f`` of each design of ``X``, in order; this is pymoo's contract."""
        waiting = deque(enumerate(X))
        results: list[Any] = [None] * len(waiting)
        for index, values, _ in self._results(f, waiting, starting=0.0):
            results[index] = values
        return results

    def stream(self, f: Function, waiting: Waiting) -> Iterator[Result]:
        """Evaluate the designs of a queue; give each result as soon as it is there.

        Designs are taken from the queue when a worker is free for them, so that more may be
        added while the results are read: then no worker waits for the slowest design of a batch.

        Args:
            f: What to evaluate.
            waiting: A deque of pairs: an index, different for each, and a design. It is emptied.

        Returns:
            For each design its index, values, and the seconds of its evaluation; in any order.

        Raises:
            EvaluationError: A design raised or was lost.
            WorkerError: The problem cannot be sent to worker processes, or they cannot import it.

        Example:
            >>> from collections import deque
            >>> waiting = deque(enumerate([1.0, 2.0]))
            >>> def double(x):
            ...     return {"F": 2 * x}
            >>> for index, values, seconds in JoblibRunner(2).stream(double, waiting):
            ...     print(index, values)
            ...     if index == 0:
            ...         waiting.append((2, 3.0))
            0 {'F': 2.0}
            1 {'F': 4.0}
            2 {'F': 6.0}
        """
        return self._results(f, waiting, starting=0.0 if self._idle else START_SECONDS)

    def _results(self, f: Function, waiting: Waiting, *, starting: float) -> Iterator[Result]:
        """Give what :meth:`stream` gives; to start workers takes so many seconds at least."""
        if not waiting:
            return
        workers = active_workers(self.n_jobs)

        def enough(remaining: int) -> bool:
            overhead = max(starting, self._overhead.seconds)
            return self._cost.known and worth_sending(
                remaining, self._cost.seconds, workers.count, overhead
            )

        here = self.in_process and self.timeout is None
        # A time limit asks for processes that can be ended, which on this machine are our own.
        by_joblib = {
            "cluster": True,
            "loky": self.timeout is None,
            "threads": here,
            "processes": False,
        }[workers.kind]
        try:
            if here and workers.kind != "cluster":
                yield from evaluate_here(f, waiting, self._cost, enough)
            if waiting:
                began, busy = perf_counter(), 0.0
                send = self._by_joblib if by_joblib else self._in_processes
                for result in send(f, waiting, workers):
                    busy += result[2]
                    yield result
                self._overhead.add(perf_counter() - began, busy, workers.count)
        except EvaluationError as error:
            raise_again(error)

    def __getstate__(self) -> dict[str, Any]:
        """Copies and pickles take the settings; workers and measurements stay."""
        return {name: v for name, v in self.__dict__.items() if not name.startswith("_")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Start with the settings only."""
        self.__dict__.update(state)
        self._forget()

    def _forget(self) -> None:
        self._cost = Cost()
        self._overhead = Overhead()
        self._idle: list[ProcessPool] = []

    def _in_processes(self, f: Function, waiting: Waiting, workers: Workers) -> Iterator[Result]:
        """Evaluate in worker processes, each of which can be ended alone."""
        # Each call has a pool to itself: another may come from a thread, or from a callback that
        # evaluates designs while a stream is being read.
        pool = self._idle.pop() if self._idle else ProcessPool()
        if pool.owner != os.getpid():
            pool = ProcessPool()
        yield from pool.run(
            f,
            waiting,
            workers=workers.count,
            timeout=self.timeout,
            retries=self.retries,
            cost=self._cost,
        )
        self._idle[:] = [pool]

    def _by_joblib(self, f: Function, waiting: Waiting, workers: Workers) -> Iterator[Result]:
        """Evaluate on a cluster or by threads; what a cluster loses is evaluated again, watched."""
        from joblib import Parallel, delayed

        under_way: dict[int, Any] = {}
        watched = partial(_watched_chunk, timeout=self.timeout, retries=self.retries)
        # Where a cluster has one worker, joblib uses none and calls the function here.
        watch = self.timeout is not None or (workers.count == 1 and not self.in_process)

        def tasks(evaluate: Callable[..., Any]) -> Iterator[Any]:
            while waiting:
                # asked each time, since the cost becomes known on the way
                size = chunk_size(len(waiting), workers.count, self._cost.seconds)
                chunk = [waiting.popleft() for _ in range(size)]
                under_way.update(chunk)
                yield delayed(evaluate)(f, chunk)

        def results(evaluate: Callable[..., Any]) -> Iterator[Result]:
            while waiting:  # joblib asks for no more tasks once there were none
                parallel = Parallel(workers.count, batch_size=1, return_as=workers.return_as)
                for done in parallel(tasks(evaluate)):
                    for index, values, seconds in done:
                        del under_way[index]
                        self._cost.add(1, seconds)
                        yield index, values, seconds

        try:
            yield from results(watched if watch else _chunk)
        except EvaluationError:
            raise
        except Exception:  # a cluster has an error of its own for a worker that is lost
            if watch or workers.kind == "threads":
                raise
            waiting.extendleft(reversed(under_way.items()))
            under_way.clear()
            yield from results(watched)


def evaluate_here(
    f: Function,
    waiting: Waiting,
    cost: Cost,
    enough: Callable[[int], bool],
    *,
    glance: float = GLANCE,
    clock: Callable[[], float] = perf_counter,
) -> Iterator[Result]:
    """Evaluate designs in this process, measuring their cost, until there is enough.

    Args:
        f: What to evaluate.
        waiting: The designs; they are taken from it.
        cost: Takes a measurement for every design, or for every millisecond of cheap ones.
        enough: Given the number of designs left, says whether to stop; asked before the first
            design and after every measurement.
        glance: Seconds of work between two results and two measurements, at least a design's.
        clock: Seconds from anywhere.
    """
    while waiting and not enough(len(waiting)):
        known = cost.seconds
        size = 1 if math.isnan(known) else max(1, min(int(glance / known), len(waiting)))
        block = [waiting.popleft() for _ in range(size)]
        found: list[Values] = []
        raised: BaseException | None = None
        began = clock()
        # Nothing is given from within: whoever reads the results would have the model's settings.
        with same_folder(), same_process(), np.errstate():
            try:
                for _, design in block:
                    found.append(f(design))
            except BaseException as error:
                raised = error
        seconds = clock() - began
        # What was there before an interrupt or an error is given first.
        for (index, _), values in zip(block, found, strict=False):
            yield index, values, seconds / size
        if raised is not None:
            if isinstance(raised, EvaluationError) or not isinstance(raised, Exception):
                raise raised
            culprit = block[len(found)][1]
            raise EvaluationError(culprit, one_line(raised), raised) from raised
        cost.add(size, seconds)


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
    done = pool.run(f, deque(designs), workers=1, timeout=timeout, retries=retries, cost=Cost())
    return list(done)
