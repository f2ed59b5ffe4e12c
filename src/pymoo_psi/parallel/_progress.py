"""The progress of a run: a bar in a terminal or a notebook, a line now and then in a log."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import Any

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
