"""A runner for pymoo problems: here while they are cheap, in worker processes, on a cluster."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from pymoo_psi._validation import boolean, integer, job_count, positive_number
from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel._backend import active_workers, by_joblib
from pymoo_psi.parallel._cost import Cost
from pymoo_psi.parallel._outcome import (
    Function,
    Result,
    Values,
    Waiting,
    one_line,
    raise_again,
    same_folder,
    same_process,
)
from pymoo_psi.parallel._pool import ProcessPool

GLANCE = 1e-3  # seconds between two looks at the cost: long beside a look, short beside sending
# To start workers takes about a second, but only once in a run: for a first batch it is spread over
# ten of them, as an algorithm has at least. A stream may be the whole run.
_START_SECONDS = 1.0
# What a batch takes beyond the evaluations: some messages, and the wait for the slowest chunk.
_BATCH_SECONDS = 0.005


class JoblibRunner:
    """Evaluate the designs of any pymoo problem on many workers: its ``elementwise_runner``.

    The workers are processes of their own. They stay alive between generations and are sent
    chunks of designs, sized by the measured cost of one. A model so cheap that sending its designs
    would cost more than it saves is evaluated in this process, as are the first designs of a run,
    which measure the cost. Results come in the order of the designs and do not depend on any of
    this.

    Under ``joblib.parallel_config`` the runner uses the number of jobs given there, and threads
    or a cluster if they are given: ``parallel_config("dask")``, ``"ray"`` or ``"spark"`` runs a
    study on a cluster without a change of code; then every design is sent to the cluster, and
    evaluated in a process beside the cluster's worker, which a crash leaves unharmed.

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
            replaced. Every design is evaluated in a process that can be ended. To start and to
            import the problem, a worker has as long, but at least 20 seconds.
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
        self._cost = Cost()
        self._pool = ProcessPool()
        self._started = False

    def __call__(self, f: Function, X: Iterable[Any]) -> list[Values]:
        """Return ``f`` of each design of ``X``, in order; this is pymoo's contract."""
        waiting = deque(enumerate(X))
        results: list[Any] = [None] * len(waiting)
        for index, values, _ in self._results(f, waiting, _START_SECONDS / 10):
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
        return self._results(f, waiting, _START_SECONDS)

    def _results(self, f: Function, waiting: Waiting, starting: float) -> Iterator[Result]:
        """Give what :meth:`stream` gives; to start workers takes so many seconds."""
        if not waiting:
            return
        workers = active_workers(self.n_jobs)
        here = self.in_process and self.timeout is None
        try:
            if here and workers.kind != "cluster":

                def enough(remaining: int) -> bool:
                    overhead = _BATCH_SECONDS if self._started else starting
                    return self._cost.worth_sending(remaining, workers.count, overhead)

                yield from evaluate_here(f, waiting, self._cost, enough)
            if not waiting:
                return
            self._started = True
            if workers.kind == "cluster" or (workers.kind == "threads" and here):
                run = partial(by_joblib, f, waiting, workers, self._cost)
            else:  # a time limit asks for processes that can be ended
                if self._pool.owner != os.getpid():
                    self._pool = ProcessPool()
                run = partial(self._pool.run, f, waiting, self._cost, workers=workers.count)
            yield from run(timeout=self.timeout, retries=self.retries)
        except EvaluationError as error:
            raise_again(error)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles take the settings; workers and measurements stay."""
        settings = {name: v for name, v in vars(self).items() if not name.startswith("_")}
        return partial(type(self), **settings), ()


def evaluate_here(
    f: Function,
    waiting: Waiting,
    cost: Cost,
    enough: Callable[[int], bool],
    *,
    glance: float = GLANCE,
) -> Iterator[Result]:
    """Evaluate designs in this process, measuring their cost, until there is enough.

    Args:
        f: What to evaluate.
        waiting: The designs; they are taken from it.
        cost: Takes a measurement for every design, or for every millisecond of cheap ones.
        enough: Given the number of designs left, says whether to stop; asked before the first
            design and after every measurement.
        glance: Seconds of work between two results and two measurements, at least a design's.
    """
    while waiting and not enough(len(waiting)):
        known = cost.seconds
        size = 1 if math.isnan(known) else max(1, min(int(glance / known), len(waiting)))
        block = [waiting.popleft() for _ in range(size)]
        found: list[Values] = []
        raised: BaseException | None = None
        began = perf_counter()
        # Nothing is given from within: whoever reads the results would have the model's settings.
        with same_folder(), same_process(), np.errstate():
            try:
                for _, design in block:
                    found.append(f(design))
            except BaseException as error:
                raised = error
        seconds = perf_counter() - began
        # What was there before an interrupt or an error is given first.
        for (index, _), values in zip(block, found, strict=False):
            yield index, values, seconds / size
        if raised is not None:
            if isinstance(raised, EvaluationError) or not isinstance(raised, Exception):
                raise raised
            culprit = block[len(found)][1]
            raise EvaluationError(culprit, one_line(raised), raised) from raised
        cost.add(size, seconds)
