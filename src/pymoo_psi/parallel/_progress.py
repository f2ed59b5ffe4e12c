"""The progress of a run: a bar in a terminal or a notebook, a line now and then in a log."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta

from pymoo_psi._validation import boolean

_EVERY = 60.0  # seconds between two lines of a log


class _TimeLeft:
    """The time that is left; the first share of 1 that is shown was known before the run."""

    def __init__(self) -> None:
        self.since = self.known = 0.0

    def __call__(self, share: float) -> str:
        if self.known == 0:
            self.since, self.known = time.monotonic(), share
        elif self.known < share < 1:
            seconds = (time.monotonic() - self.since) * (1 - share) / (share - self.known)
            return f"{timedelta(seconds=math.ceil(seconds))} left"
        return ""


class ProgressLines:
    """A line a minute on standard error, for output that goes to a file."""

    def __init__(self) -> None:
        self.left, self.due = _TimeLeft(), time.monotonic() + _EVERY

    def __call__(self, share: float) -> None:
        """Show a share of 1 that is done, if the next line is due."""
        left = self.left(share)
        if time.monotonic() >= self.due:
            self.due = time.monotonic() + _EVERY
            print(f"{share:.0%} done{left and ', '}{left}", file=sys.stderr, flush=True)


def progress_lines(progress: bool) -> ProgressLines | None:
    """Return what shows the progress where a bar, which rewrites its line, would be noise."""
    ipython = sys.modules.get("IPython")
    notebook = ipython is not None and hasattr(ipython.get_ipython(), "kernel")
    seen = sys.stdout.isatty() or notebook
    return ProgressLines() if boolean("progress", progress) and not seen else None


@contextmanager
def progress_bar(progress: bool) -> Iterator[Callable[[float], None]]:
    """Give a function that shows a share of 1, if it is asked for: on pymoo's bar, or in lines."""
    # imported here, since workers import this module, too
    from pymoo.util.display.progress import ProgressBar

    if (lines := progress_lines(progress)) or not progress:
        yield lines or (lambda share: None)
        return
    # The bar's own statistics are a hundredth of the rate, "0.2%/s" for 20, and a time left that
    # takes tests known before for tests of this run. A notebook keeps all that a line has been.
    pause = 0.0 if sys.stdout.isatty() else 1.0
    with ProgressBar(stats=False, stats_end=False, refresh_secs=pause) as bar:
        left = _TimeLeft()

        def show(share: float) -> None:
            bar.set(share)
            bar.obj.text(left(share))

        yield show
