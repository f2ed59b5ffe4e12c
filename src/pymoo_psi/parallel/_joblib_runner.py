"""A runner for pymoo problems that uses joblib's workers when they pay, and own ones for limits."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import BrokenExecutor
from pickle import PicklingError
from time import perf_counter
from typing import Any

from joblib import Parallel, delayed

from pymoo_psi._validation import boolean, integer, job_count, positive_number
from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel._backend import WarmUp, Workers, active_workers
from pymoo_psi.parallel._chunks import Cost, Overhead, chunk_size, worth_sending
from pymoo_psi.parallel._in_process import evaluate_while
from pymoo_psi.parallel._outcome import Function, Values, evaluate_to_travel, raise_again
from pymoo_psi.parallel._pool import ProcessPool

# How joblib's executor reports a worker that died, and a function that it could not send.
_LOST = (BrokenExecutor, PicklingError)


class JoblibRunner:
    """Evaluate the designs of any pymoo problem on many workers: its ``elementwise_runner``.

    The workers stay alive between generations and are sent chunks of designs, sized by the
    measured cost of one. A model so cheap that sending its designs would cost more than it saves
    is evaluated in this process, where also the first designs of a run measure the cost while the
    workers start. Results come in the order of the designs and do not depend on any of this.

    Under ``joblib.parallel_config`` the runner uses the backend and the number of jobs given
    there, so that ``parallel_config("dask")``, ``"ray"`` or ``"spark"`` runs a study on a cluster
    without a change of code; then every design is sent to the cluster.

    A worker process that dies never takes a design with it: its designs are evaluated again, each
    watched alone, and the one that keeps killing its worker is reported. With a time limit all
    designs are watched from the start. What becomes of a design that is lost is up to the
    problem: :class:`~pymoo_psi.FailureTolerant` records the reason, any other stops with an
    :class:`~pymoo_psi.errors.EvaluationError`.

    Args:
        n_jobs: Number of workers; -1 is the number of ``parallel_config``, or else of cores.
        timeout: Seconds that the evaluation of one design may take; then its worker process is
            replaced. Every design is evaluated in a process that can be ended, on a cluster in
            one beside the cluster's worker.
        retries: How many times a design whose process died is tried again.
        in_process: Whether designs may be evaluated in this process, to measure their cost and
            while they are cheap. Say ``False`` if a design takes minutes or may crash.

    Raises:
        ArgumentValueError: A number is out of range.
        ArgumentTypeError: An argument has the wrong type.
        EvaluationError: In use: a design raised or was lost.
        WorkerError: In use: the problem cannot be sent to worker processes.

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
        workers = active_workers(self.n_jobs)
        if not designs:
            return []
        if workers.local and self.timeout is not None:
            return self._watched(f, designs, workers)
        if not workers.local:
            return self._sent(f, designs, workers)
        if workers.count == 1:
            return evaluate_while(f, designs, self._cost, lambda remaining: False)
        here = self._evaluated_here(f, designs, workers) if self.in_process else []
        if len(here) == len(designs):
            return here
        return here + self._sent(f, designs[len(here) :], workers)

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
        self._warming: WarmUp | None = None
        self._pool: ProcessPool | None = None

    def _evaluated_here(self, f: Function, designs: list[Any], workers: Workers) -> list[Values]:
        """Evaluate designs in this process until the others are worth sending."""

        def enough(remaining: int) -> bool:
            seconds = self._cost.seconds
            worth = self._cost.known and worth_sending(
                remaining, seconds, workers.count, self._overhead.seconds
            )
            if worth and self._warming is None and workers.slow_to_start:
                self._warming = WarmUp(f, workers)
            return worth and (self._warming is None or self._warming.ready)

        return evaluate_while(f, designs, self._cost, enough)

    def _sent(self, f: Function, designs: list[Any], workers: Workers) -> list[Values]:
        """Evaluate on joblib's workers; what they lose is evaluated again, watched."""
        results: list[Any] = [None] * len(designs)
        watch = self.timeout is not None
        try:
            self._collect(results, f, designs, workers, watch=watch)
        except EvaluationError as error:
            raise_again(error)
        except Exception as error:
            if workers.local and not isinstance(error, _LOST):
                raise
            missing = [index for index, values in enumerate(results) if values is None]
            again = [designs[index] for index in missing]
            if workers.local:
                found = self._watched(f, again, workers)
            elif watch:
                raise
            else:
                found = [None] * len(again)  # type: ignore[list-item]
                try:
                    self._collect(found, f, again, workers, watch=True)
                except EvaluationError as error:
                    raise_again(error)
            for index, values in zip(missing, found, strict=True):
                results[index] = values
        return results

    def _collect(
        self,
        results: list[Any],
        f: Function,
        designs: list[Any],
        workers: Workers,
        *,
        watch: bool,
    ) -> None:
        """Fill ``results`` through joblib, chunk by chunk as they arrive."""
        limit = math.inf if self.timeout is None else self.timeout

        def tasks() -> Iterator[Any]:
            start = 0
            while start < len(designs):
                size = chunk_size(len(designs) - start, workers.count, self._cost.seconds)
                chunk = designs[start : start + size]
                if watch:
                    yield delayed(_watched_chunk)(f, start, chunk, limit, self.retries)
                else:
                    yield delayed(_chunk)(f, start, chunk)
                start += size

        began, busy = perf_counter(), 0.0
        parallel = Parallel(workers.count, batch_size=1, return_as=workers.return_as)
        for start, values, seconds in parallel(tasks()):
            results[start : start + len(values)] = values
            self._cost.add(len(values), seconds)
            busy += seconds
        self._overhead.add(perf_counter() - began, busy, workers.count)

    def _watched(self, f: Function, designs: list[Any], workers: Workers) -> list[Values]:
        """Evaluate on worker processes of our own, one of which can be ended alone."""
        if self._pool is None:
            self._pool = ProcessPool()
        limit = math.inf if self.timeout is None else self.timeout
        return self._pool.run(
            f, designs, workers=workers.count, timeout=limit, retries=self.retries
        )


def _chunk(f: Function, start: int, designs: list[Any]) -> tuple[int, list[Values], float]:
    """Evaluate a chunk, in a worker of joblib."""
    began = perf_counter()
    values = [evaluate_to_travel(f, design) for design in designs]
    return start, values, perf_counter() - began


_of_this_thread = threading.local()


def _watched_chunk(
    f: Function, start: int, designs: list[Any], timeout: float, retries: int
) -> tuple[int, list[Values], float]:
    """Evaluate a chunk in a process beside the worker of a cluster."""
    if not hasattr(_of_this_thread, "pool"):
        _of_this_thread.pool = ProcessPool()
    began = perf_counter()
    values = _of_this_thread.pool.run(f, designs, workers=1, timeout=timeout, retries=retries)
    return start, values, perf_counter() - began
