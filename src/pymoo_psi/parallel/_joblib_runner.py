"""A runner for pymoo problems: here while they are cheap, in worker processes, on a cluster."""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from time import perf_counter
from typing import Any

from pymoo_psi._validation import boolean, integer, job_count, positive_number
from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel._backend import Workers, active_workers
from pymoo_psi.parallel._cost import Cost, Overhead, chunk_size, worth_sending
from pymoo_psi.parallel._outcome import (
    Function,
    Values,
    evaluate_to_travel,
    one_line,
    raise_again,
    same_folder,
    same_process,
)
from pymoo_psi.parallel._pool import ProcessPool

_GLANCE = 1e-3  # seconds between two looks at the cost: long beside a look, short beside sending


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
        designs = list(X)
        if not designs:
            return []
        workers = active_workers(self.n_jobs)

        def enough(remaining: int) -> bool:
            return self._cost.known and worth_sending(
                remaining, self._cost.seconds, workers.count, self._overhead.seconds
            )

        here: list[Values] = []
        send = self._by_joblib if workers.kind == "cluster" else self._in_processes
        try:
            if workers.kind != "cluster" and self.in_process and self.timeout is None:
                here = evaluate_while(f, designs, self._cost, enough)
                if workers.kind == "threads":
                    send = self._by_joblib
            rest = designs[len(here) :]
            return here + send(f, rest, workers) if rest else here
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
        self._pool: ProcessPool | None = None

    def _in_processes(self, f: Function, designs: list[Any], workers: Workers) -> list[Values]:
        """Evaluate in worker processes, each of which can be ended alone."""
        if self._pool is None or self._pool.owner != os.getpid():
            self._pool = ProcessPool()
        results: list[Any] = [None] * len(designs)
        began, busy = perf_counter(), 0.0
        for index, values, seconds in self._pool.run(
            f,
            designs,
            workers=workers.count,
            timeout=self.timeout,
            retries=self.retries,
            cost=self._cost,
        ):
            results[index] = values
            busy += seconds
        self._overhead.add(perf_counter() - began, busy, workers.count)
        return results

    def _by_joblib(self, f: Function, designs: list[Any], workers: Workers) -> list[Values]:
        """Evaluate on a cluster or by threads; what a cluster loses is evaluated again, watched."""
        from joblib import Parallel, delayed

        results: list[Any] = [None] * len(designs)
        watched = partial(_watched_chunk, timeout=self.timeout, retries=self.retries)
        # Where a cluster has one worker, joblib uses none and calls the function here.
        watch = self.timeout is not None or (workers.count == 1 and not self.in_process)

        def tasks(evaluate: Callable[..., Any]) -> Iterator[Any]:
            missing = [index for index, values in enumerate(results) if values is None]
            while missing:
                # asked each time, since the cost becomes known on the way
                size = chunk_size(len(missing), workers.count, self._cost.seconds)
                indices, missing = missing[:size], missing[size:]
                yield delayed(evaluate)(f, indices, [designs[index] for index in indices])

        def collect(evaluate: Callable[..., Any]) -> None:
            began, busy = perf_counter(), 0.0
            parallel = Parallel(workers.count, batch_size=1, return_as=workers.return_as)
            for indices, found, seconds in parallel(tasks(evaluate)):
                for index, values in zip(indices, found, strict=True):
                    results[index] = values
                self._cost.add(len(found), seconds)
                busy += seconds
            self._overhead.add(perf_counter() - began, busy, workers.count)

        try:
            collect(watched if watch else _chunk)
        except EvaluationError:
            raise
        except Exception:  # a cluster has an error of its own for a worker that is lost
            if watch or workers.kind == "threads":
                raise
            collect(watched)
        return results


def evaluate_while(
    f: Function,
    designs: list[Any],
    cost: Cost,
    enough: Callable[[int], bool],
    clock: Callable[[], float] = perf_counter,
) -> list[Values]:
    """Evaluate designs in this process, measuring their cost, until there is enough.

    Args:
        f: What to evaluate.
        designs: The designs.
        cost: Takes a measurement for every design, or for every millisecond of cheap ones.
        enough: Given the number of designs left, says whether to stop; asked before the first
            design and after every measurement.
        clock: Seconds from anywhere.

    Returns:
        The values of the first designs, at most of all.
    """
    results: list[Values] = []
    n = len(designs)
    while len(results) < n and not enough(n - len(results)):
        known = cost.seconds
        size = 1 if math.isnan(known) else max(1, int(_GLANCE / known))
        block = designs[len(results) : len(results) + size]
        began = clock()
        try:
            with same_folder(), same_process():
                for design in block:
                    results.append(f(design))
        except EvaluationError:
            raise
        except Exception as error:
            culprit = designs[len(results)]
            raise EvaluationError(culprit, one_line(error), error) from error
        cost.add(len(block), clock() - began)
    return results


def _chunk(
    f: Function, indices: list[int], designs: list[Any]
) -> tuple[list[int], list[Values], float]:
    """Evaluate a chunk, in a worker of joblib."""
    began = perf_counter()
    values = [evaluate_to_travel(f, design) for design in designs]
    return indices, values, perf_counter() - began


_of_this_thread = threading.local()  # a cluster's worker may evaluate in several at a time


def _watched_chunk(
    f: Function, indices: list[int], designs: list[Any], timeout: float | None, retries: int
) -> tuple[list[int], list[Values], float]:
    """Evaluate a chunk in a process beside the worker of a cluster."""
    if not hasattr(_of_this_thread, "pool"):
        _of_this_thread.pool = ProcessPool()
    began = perf_counter()
    done = _of_this_thread.pool.run(
        f, designs, workers=1, timeout=timeout, retries=retries, cost=Cost()
    )
    values = [values for _, values, _ in sorted(done, key=lambda result: result[0])]
    return indices, values, perf_counter() - began
