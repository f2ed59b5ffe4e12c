"""The bar of a run, in a terminal or a notebook."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta

from pymoo.util.display.progress import ProgressBar

from pymoo_psi._validation import boolean

# Shares of the first second are of tests that were known, or of a run that ends soon.
_KNOWN = 1.0


@contextmanager
def progress_bar(progress: bool) -> Iterator[Callable[[float], None]]:
    """Give a function that shows a share of 1 on pymoo's bar, if it is asked for and seen.

    The bar rewrites its line, which a notebook does as a terminal; in a file it would be noise.
    """
    notebook = _in_notebook()
    if not boolean("progress", progress) or not (sys.stdout.isatty() or notebook):
        yield lambda share: None
        return
    # The bar's own statistics are a hundredth of the rate, "0.2%/s" for 20, and a time left that
    # takes tests known before for tests of this run. A notebook keeps all that a line has been.
    refresh = 1.0 if notebook else 0.0
    with ProgressBar(stats=False, stats_end=False, refresh_secs=refresh) as bar:
        start = time.monotonic()
        since, known = start, 0.0

        def show(share: float) -> None:
            nonlocal since, known
            now = time.monotonic()
            bar.set(share)
            # Nor does the first share tell how long a test takes: workers start before it.
            if now - start < _KNOWN or known == 0:
                since, known = now, share
            elif known < share < 1:
                left = (now - since) * (1 - share) / (share - known)
                bar.obj.text(f"{timedelta(seconds=math.ceil(left))} left")
            else:
                bar.obj.text("")

        yield show


def _in_notebook() -> bool:
    """Whether a kernel of Jupyter runs this; its output is no terminal."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")
