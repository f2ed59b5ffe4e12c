"""Runners for pymoo problems, the one on processes of this machine, and the progress of a run."""

from __future__ import annotations

import math
import secrets
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing, contextmanager
from datetime import timedelta
from functools import partial
from typing import Any

from pymoo_psi._modules import require_unchanged
from pymoo_psi._validation import Received, Values, invalid, job_count, positive_number
from pymoo_psi.errors import EvaluationError, WorkerError
from pymoo_psi.parallel._evaluation import (
    Cost,
    Function,
    Result,
    Waiting,
    evaluate_here,
)

# joblib is imported in the functions that need it: a worker imports this module, but not joblib.

# Workers take some tenths of a second to start, but once in a process: it is spread over the
# batches of an algorithm.
_START_SECONDS = 0.1
# What a batch takes beyond the evaluations: some messages, and the wait for the slowest chunk.
_BATCH_SECONDS = 0.005


def active_workers(n_jobs: int) -> int:
    """Return the number of workers for ``n_jobs``; joblib's configuration decides about -1."""
    from joblib.parallel import get_active_backend

    backend, configured = get_active_backend()
    if n_jobs == -1 and configured is not None:
        n_jobs = configured
    return max(1, int(backend.effective_n_jobs(n_jobs)))


class Runner:
    """An ``elementwise_runner`` of this package: it evaluates designs, or does tasks, elsewhere.

    A subclass writes

    - ``n_workers``: how many workers there are now; 0 if the first ones have not joined.
    - ``by_workers(f, waiting)``: results, and ``None`` between, with no design evaluated here.

    Attributes:
        elastic: Whether workers may join and leave during a run.
    """

    elastic = False

    def __init__(self, timeout: float | None) -> None:
        self.timeout = None if timeout is None else positive_number("timeout", timeout)
        if timeout and sys.platform == "win32":
            raise invalid("timeout", "None on Windows", timeout)
        self.cost = Cost()
        self.has_answered = False  # any worker, so that tasks can be done at all
        self.name = secrets.token_hex(8)
        self._problem: Any = None  # whose designs it was called for last

    @property
    def n_workers(self) -> int:
        """How many workers there are now."""
        raise NotImplementedError

    def by_workers(self, f: Function, waiting: Waiting) -> Generator[Result | None]:
        """Yield results, and ``None`` between; no design is evaluated in this process."""
        raise NotImplementedError

    def stream(self, f: Function, waiting: Waiting) -> Generator[Result | None]:
        """Evaluate the designs of a queue; yield each result as soon as it is there.

        Designs are taken from the queue when a worker is free for them. More may be added while the
        results are read, so that no worker waits for the slowest design of a batch. ``None`` is
        yielded after every moment without a result, so that the reader can do something else.

        Args:
            f: What to evaluate.
            waiting: A deque of pairs: an index, different for each, and a design. It is emptied.

        Yields:
            For each design its index, values, and the seconds of its evaluation; in any order.

        Raises:
            EvaluationError: A design raised or was lost.
            WorkerError: The problem cannot be sent to workers, they cannot import it, or all of
                them are gone.
        """
        return self.by_workers(f, waiting)

    def __call__(self, f: Function, X: Iterable[Any]) -> list[Values]:
        """Return ``f`` of each design of ``X``, in their order; pymoo calls this."""
        problem = getattr(f, "problem", f)
        if problem is not self._problem:  # a later change of its files does not end its run
            require_unchanged(problem)
            self._problem = problem
        waiting = deque(enumerate(X))
        values_of_designs: list[Any] = [None] * len(waiting)
        with closing(self.stream(f, waiting)) as results:
            for result in results:
                if result is not None:
                    index, values, _ = result
                    values_of_designs[index] = values
        return values_of_designs

    def tasks(self, function: Callable[[Any], Any], waiting: Waiting) -> Generator[tuple[int, Any]]:
        """Do the tasks of a queue; yield the index and the result of each as soon as it is done.

        Those of a single worker, unless others may join, are done in this process.

        Close the iterator early to stop the workers; the garbage collector would do so at any time
        and in any thread.

        Args:
            function: What to do with a task; it is sent to a worker once.
            waiting: A deque of pairs: an index, different for each, and a task. It is emptied; more
                tasks may be added while the results are read.

        Raises:
            WorkerError: A worker was lost, or cannot load the function.
            Exception: What the function raises.
        """
        while waiting and self.n_workers == 1 and not self.elastic:
            index, task = waiting.popleft()
            yield index, function(task)
        if not waiting:
            return
        try:
            with closing(self.by_workers(function, waiting)) as results:
                for result in results:
                    if result is not None:
                        yield result[:2]
        except EvaluationError as error:
            if error.original is None:
                raise WorkerError(f"a worker process failed: {error.reason}") from error
            raise error.original from error.original.__cause__


class JoblibRunner(Runner):
    """An ``elementwise_runner`` that evaluates the designs of any pymoo problem on many workers.

    The workers are separate processes. They stay alive between generations and receive chunks of
    designs, sized by the measured cost of a design. The first designs of a run are evaluated in
    this process to measure this cost; very cheap models stay there. Results come in the order of
    the designs and do not depend on this.

    On a cluster use an :class:`~pymoo_psi.ExecutorRunner`, or give each machine a ``share`` of the
    points. Inside ``joblib.parallel_config("dask")`` the workers are those of the cluster.

    If a worker process dies or runs out of time, at most one design fails; another worker evaluates
    the rest. A design whose process died is tried once more before it counts as failed. PSI and
    :class:`~pymoo_psi.FailureTolerant` record the reason; other problems stop with an
    :class:`~pymoo_psi.errors.EvaluationError`. On Windows the workers are those of joblib's loky,
    which end together if one dies, and there is no time limit.

    The workers import modules from the same places as this process. They are kept for some minutes
    for the next call of any runner. New workers start if a module was reloaded, or if the
    environment, the current folder, the number of workers or ``fingerprint()`` of the problem has
    changed; code of the main script or a notebook gets new workers with a new runner. Workers, and
    all processes that a model started in them, end with this process. If a model changes the
    current folder, the change is undone: in a worker after every design, in this process within
    milliseconds.

    No table mixes two versions of a model. A file of yours that was edited after its import is
    refused before anything is evaluated, here, by other runners, and without a runner: reload it by
    ``importlib.reload`` and make the problem again, or restart Python. A worker that imports
    another version than this process has is refused, too.

    Args:
        n_jobs: Number of workers; -1 is the number of ``joblib.parallel_config``, or else of
            cores.
        timeout: Seconds that the evaluation of one design may take; then its worker process is
            replaced. With a timeout no design is evaluated in this process.
        in_process: Whether designs may be evaluated in this process, to measure their cost or
            because they are cheap. Use ``False`` if a design takes minutes or may crash.

    Raises:
        ArgumentValueError: A number is out of range.
        ArgumentTypeError: An argument has the wrong type.
        EvaluationError: In use: a design raised or was lost.
        WorkerError: In use: the problem cannot be sent to worker processes, or they cannot
            import it, or they have another version of it.

    Example:
        >>> import numpy as np
        >>> from pymoo_psi import SphereChute
        >>> X = np.array([[0.2635, 0.1072], [0.3, 0.2]])
        >>> F, G = SphereChute(0.4, elementwise_runner=JoblibRunner(n_jobs=2)).evaluate(X)
        >>> np.array_equal(F, SphereChute(0.4).evaluate(X)[0])
        True
    """

    def __init__(
        self, n_jobs: int = -1, *, timeout: float | None = None, in_process: bool = True
    ) -> None:
        super().__init__(timeout)
        self.n_jobs = job_count("n_jobs", n_jobs)
        self.in_process = in_process
        self._started = False
        self._on_backend: tuple[Any, Runner] | None = None

    @property
    def n_workers(self) -> int:
        """How many workers there are now."""
        cluster = self._cluster()
        if cluster is not None:
            return cluster.n_workers
        return active_workers(self.n_jobs)

    @property
    def elastic(self) -> bool:  # type: ignore[override]
        """Whether workers may join and leave during a run."""
        return self._cluster() is not None

    def stream(self, f: Function, waiting: Waiting) -> Generator[Result | None]:
        """Evaluate the designs of a queue, cheap ones in this process; see :class:`Runner`."""
        count = self.n_workers
        overhead = _START_SECONDS
        if self._started:
            overhead = _BATCH_SECONDS

        def enough(left: int) -> bool:
            return self.cost.worth_sending(left, count, overhead)

        if self.in_process and self.timeout is None and self._cluster() is None:
            yield from evaluate_here(f, waiting, self.cost, enough)
        if waiting:
            self._started = True
            yield from self.by_workers(f, waiting)

    def by_workers(self, f: Function, waiting: Waiting) -> Generator[Result | None]:
        """Yield results, and ``None`` between; no design is evaluated in this process."""
        cluster = self._cluster()
        if cluster is not None:
            yield from cluster.by_workers(f, waiting)
            return
        from pymoo_psi.parallel._engine import Tasks

        executor = None
        if sys.platform == "win32":
            from joblib.externals.loky import get_reusable_executor

            executor = get_reusable_executor(self.n_workers)
        yield from Tasks(self, f, waiting, executor).results()

    def _cluster(self) -> Runner | None:
        """Return a runner on the cluster that joblib's configuration names, if it names one.

        Raises:
            ArgumentValueError: It names a backend whose workers cannot be used.
        """
        from joblib.parallel import get_active_backend

        backend, _ = get_active_backend()
        if not hasattr(backend, "client"):
            if type(backend).__module__.startswith("joblib."):
                return None
            name = type(backend).__name__
            rule = "one of joblib's own, or dask"
            remedy = "use ExecutorRunner(executor) for another engine"
            raise invalid("the backend of joblib.parallel_config", rule, Received(name), remedy)
        if self._on_backend is None or self._on_backend[0] is not backend:
            from pymoo_psi.parallel._engine import ExecutorRunner

            workers = None if self.n_jobs == -1 else active_workers(self.n_jobs)
            runner = ExecutorRunner(backend.client, workers=workers, timeout=self.timeout)
            self._on_backend = backend, runner
        return self._on_backend[1]

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles have the settings; workers and measurements stay here."""
        make = partial(type(self), self.n_jobs, timeout=self.timeout, in_process=self.in_process)
        return make, ()


def in_parallel(
    function: Callable[[Any], Any], tasks: Iterable[Any], n_jobs: int
) -> Generator[tuple[int, Any]]:
    """Do tasks; see :meth:`Runner.tasks`, also for what it yields and raises.

    Args:
        function: What to do with a task.
        tasks: The tasks; their numbers from 0 are the indices.
        n_jobs: Number of workers; 1 is this process.
    """
    return JoblibRunner(n_jobs).tasks(function, deque(enumerate(tasks)))


# The progress of a run: a bar in a terminal or a notebook, a line now and then in a log

_EVERY = 60.0  # seconds between two lines of a log


class Progress:
    """The share of 1 that is done and the time left, shown on a bar or in a line now and then.

    Args:
        bar: pymoo's bar; without one, lines go to standard error.
    """

    def __init__(self, bar: Any = None) -> None:
        self.bar = bar
        self.due = time.monotonic() + _EVERY
        self.since = 0.0
        self.known = 0.0  # the first share, which was known before the run

    def __call__(self, share: float, note: str = "") -> None:
        """Show a share and a note; in a log only if the next line is due."""
        now = time.monotonic()
        parts = []
        if note:
            parts.append(note)
        if self.known == 0:
            self.since = now
            self.known = share
        elif self.known < share < 1:
            seconds = (now - self.since) * (1 - share) / (share - self.known)
            parts.append(f"{timedelta(seconds=math.ceil(seconds))} left")
        if self.bar is not None:
            self.bar.set(share)
            self.bar.obj.text(", ".join(parts))
        elif now >= self.due:
            self.due = now + _EVERY
            print(", ".join([f"{share:.0%} done", *parts]), file=sys.stderr, flush=True)


@contextmanager
def progress_bar(progress: bool) -> Iterator[Callable[..., None]]:
    """Give a function that shows a share of 1 and a note; it does nothing without ``progress``.

    It shows them on pymoo's bar in a terminal or a notebook, elsewhere in a line now and then.
    """
    from pymoo.util.display.progress import ProgressBar

    if not progress:
        yield lambda share, note="": None
        return
    ipython = sys.modules.get("IPython")
    is_notebook = ipython is not None and hasattr(ipython.get_ipython(), "kernel")
    # A service may have no output at all.
    if not is_notebook and (sys.stdout is None or not sys.stdout.isatty()):
        yield Progress()
        return
    # The bar's own statistics are wrong: a hundredth of the rate ("0.2%/s" for 20), and a time left
    # that counts tests known before as tests of this run. A notebook keeps every state of a line.
    pause = 1.0 if is_notebook else 0.0
    with ProgressBar(stats=False, stats_end=False, refresh_secs=pause) as bar:
        yield Progress(bar)
