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


@contextmanager
def progress_bar(progress: bool) -> Iterator[Callable[..., None]]:
    """Give a function that shows a share of 1 and a note; it does nothing without ``progress``.

    It shows them, and the time left, on pymoo's bar in a terminal or a notebook, elsewhere in a
    line now and then.
    """
    from pymoo.util.display.progress import ProgressBar

    if not progress:
        yield lambda share, note="": None
        return
    ipython = sys.modules.get("IPython")
    is_notebook = ipython is not None and hasattr(ipython.get_ipython(), "kernel")
    # A service may have no output at all.
    if not is_notebook and (sys.stdout is None or not sys.stdout.isatty()):
        yield _progress_on(None)
        return
    # The bar's own statistics are wrong: a hundredth of the rate ("0.2%/s" for 20), and a time left
    # that counts tests known before as tests of this run. A notebook keeps every state of a line.
    pause = 1.0 if is_notebook else 0.0
    with ProgressBar(stats=False, stats_end=False, refresh_secs=pause) as bar:
        yield _progress_on(bar)


def _progress_on(bar: Any) -> Callable[..., None]:
    """Return what shows a share and a note on a bar, or in lines of standard error without one."""
    due = time.monotonic() + _EVERY
    since = 0.0
    known = 0.0  # the first share, which was known before the run

    def show(share: float, note: str = "") -> None:
        nonlocal due, since, known
        now = time.monotonic()
        parts = []
        if note:
            parts.append(note)
        if known == 0:
            since = now
            known = share
        elif known < share < 1:
            seconds = (now - since) * (1 - share) / (share - known)
            parts.append(f"{timedelta(seconds=math.ceil(seconds))} left")
        if bar is not None:
            bar.set(share)
            bar.obj.text(", ".join(parts))
        elif now >= due:
            due = now + _EVERY
            print(", ".join([f"{share:.0%} done", *parts]), file=sys.stderr, flush=True)

    return show
