"""What all runners have in common, and the progress of a run."""

from __future__ import annotations

import math
import secrets
import statistics
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing, contextmanager
from datetime import timedelta
from typing import Any

from pymoo_psi._modules import require_unchanged
from pymoo_psi._validation import Values, invalid, positive_number
from pymoo_psi.errors import EvaluationError, WorkerError
from pymoo_psi.parallel._evaluation import (
    Answer,
    Function,
    LostDesign,
    Result,
    Waiting,
    lost_values,
)


class Runner:
    """An ``elementwise_runner`` of this package: it evaluates designs, or does tasks, elsewhere.

    A subclass writes

    - ``n_workers``: how many workers there are now; 0 if the first ones have not joined.
    - ``stream(f, waiting)``: results, and ``None`` between.

    Attributes:
        samples: The last seconds that a design took, of which the median counts: a first evaluation
            often loads libraries, and a busy machine stalls.
        elastic: Whether workers may join and leave during a run.
        in_rounds: Whether designs that are added may wait for all that are being evaluated.
    """

    elastic = False
    in_rounds = False

    def __init__(self, timeout: float | None = None) -> None:
        self.timeout = None if timeout is None else positive_number("timeout", timeout)
        if timeout and sys.platform == "win32":
            raise invalid("timeout", "None on Windows", timeout)
        self.samples: deque[float] = deque(maxlen=5)
        self.name = secrets.token_hex(8)
        self._problem: Any = None  # whose designs it was called for last

    @property
    def n_workers(self) -> int:
        """How many workers there are now."""
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
        raise NotImplementedError

    def results_of(
        self, f: Function, under_way: dict[int, Any], answer: Answer
    ) -> Iterator[Result]:
        """Yield the results of an answer; their designs are under way no more.

        Raises:
            EvaluationError: A design raised or was lost.
        """
        results, failure = answer
        for index, values, seconds in results:
            design = under_way.pop(index)
            if isinstance(values, LostDesign):
                yield index, lost_values(f, design, values.reason), 0.0
            else:
                self.samples.append(seconds)
                yield index, values, seconds
        if failure is not None:
            raise failure

    def chunk(self, waiting: int, workers: int, lasting: float) -> int:
        """Return how many of the waiting designs to send together next, at least 1.

        They are at most half of a worker's share, so that all workers end together.

        Args:
            waiting: The number of waiting designs.
            workers: The number of workers.
            lasting: Seconds that the designs may take.
        """
        if not self.samples:
            return 1
        # 0 seconds where a clock is too coarse
        seconds = max(statistics.median_low(self.samples), 1e-9)
        half_share = math.ceil(waiting / (2 * workers))
        return max(1, min(int(lasting / seconds), half_share))

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
        try:
            with closing(self.stream(function, waiting)) as results:
                for result in results:
                    if result is not None:
                        yield result[:2]
        except EvaluationError as error:
            if error.original is None:
                raise WorkerError(f"a worker process failed: {error.reason}") from error
            raise error.original from error.original.__cause__


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
