"""The bar of a run, in a terminal or a notebook."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from pymoo.util.display.progress import ProgressBar

from pymoo_psi._validation import boolean


@contextmanager
def progress_bar(progress: bool) -> Iterator[Callable[[float], None]]:
    """Give a function that shows a share of 1 on pymoo's bar, if it is asked for and seen.

    The bar rewrites its line, which a notebook does as a terminal; in a file it would be noise.
    """
    if not boolean("progress", progress) or not (sys.stdout.isatty() or _in_notebook()):
        yield lambda share: None
        return
    with ProgressBar() as bar:
        yield bar.set


def _in_notebook() -> bool:
    """Whether a kernel of Jupyter runs this; its output is no terminal."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")
