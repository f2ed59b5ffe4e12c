"""The bar of a run, in a terminal or a notebook."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta

from pymoo_psi._validation import boolean


@contextmanager
def progress_bar(progress: bool) -> Iterator[Callable[[float], None]]:
    """Give a function that shows a share of 1 on pymoo's bar, if it is asked for and seen.

    The bar rewrites its line, which a notebook does as a terminal; in a file it would be noise.
    """
    # imported here, since workers import this module, too
    from pymoo.util.display.progress import ProgressBar

    ipython = sys.modules.get("IPython")
    notebook = ipython is not None and hasattr(ipython.get_ipython(), "kernel")
    if not boolean("progress", progress) or not (sys.stdout.isatty() or notebook):
        yield lambda share: None
        return
    # The bar's own statistics are a hundredth of the rate, "0.2%/s" for 20, and a time left that
    # takes tests known before for tests of this run. A notebook keeps all that a line has been.
    with ProgressBar(stats=False, stats_end=False, refresh_secs=float(notebook)) as bar:
        since = known = 0.0

        def show(share: float) -> None:
            nonlocal since, known
            left = ""
            if known == 0:  # tests that were known before come first
                since, known = time.monotonic(), share
            elif known < share < 1:
                seconds = (time.monotonic() - since) * (1 - share) / (share - known)
                left = f"{timedelta(seconds=math.ceil(seconds))} left"
            bar.set(share)
            bar.obj.text(left)

        yield show
