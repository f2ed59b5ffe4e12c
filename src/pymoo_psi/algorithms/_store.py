"""The study of a run: tests of earlier runs, and the storing of new ones."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import invalid
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.study import LAST, Study
from pymoo_psi.table import Layout, TestTable, columns_of, head_of, kinds_of_columns, table_of

# Seconds between two commits of a study: beside them a commit of some milliseconds does not count,
# and not much more is lost when the process is killed.
SECONDS = 1.0
# Seconds of computing, by all workers together, after which there is a commit in any case: results
# of slow designs that arrive together must not wait for the next one, perhaps for hours.
COMPUTED = 20.0


class Store:
    """The study of a run, or nothing where there is none.

    Attributes:
        study: The study file; ``None`` stores nothing.
        share: Which of the points are tested.
        layout: The columns that the problem promises.
        origin: Where the designs come from, for the readers of the study.
    """

    def __init__(self, options: RunOptions) -> None:
        self.share, self.study = options.part, None
        self._retry, self.layout, self.origin = options.retry, Layout.of(), ""
        if options.study is None:
            return
        path = Study(options.study).path
        if options.share is None and os.path.isdir(path):
            remedy = "with share=(k, n) it is a folder; 'pymoo-psi export' makes one study of it"
            raise invalid("study", "the name of a file", path, remedy)
        if options.share is not None and os.path.isfile(path):
            rule = "the name of a folder, new or of other shares, where there is a share"
            raise invalid("study", rule, path)
        self.study = Study(path if options.share is None else f"{path}/{self.share.file}")

    def begin(
        self, identity: Mapping[str, Any], layout: Layout, points: tuple[int, int] = (1, 1)
    ) -> None:
        """Create the study, or make sure that it belongs to the same problem.

        Args:
            identity: What makes the tests belong together: the :func:`problem_identity`; where
                the designs come from, as ``sampling``; and the user's ``key``.
            layout: The columns of its tests.
            points: For a share, the first and the last test point of the run.
        """
        # "LP-tau", not "LP-tau from point 1": every test has its number beside it
        self.layout, self.origin = layout, identity["sampling"].partition(" from ")[0]
        head = {**head_of(TestTable.empty(layout)), "problem": identity}
        if self.study is not None and self.share.of == 1:
            self.study.begin(head)
        elif self.study is not None:
            self.study.begin(head, self.share, points)

    def writing(self) -> AbstractContextManager[None]:
        """Keep others from testing points of the study while the body runs."""
        return nullcontext() if self.study is None else self.study.writing()

    def recall(self, numbers: NDArray[np.int64]) -> TestTable:
        """Return what is stored of increasing test points of the run and not to be retried."""
        if self.study is None or len(numbers) == 0:
            return TestTable.empty(self.layout)
        first, last = int(numbers[0]), int(numbers[-1])
        stored = self.stored(first, last - first + 1)
        # the file of a share may have come to hold points of other shares
        return stored.rows(np.isin(stored.numbers, numbers) & ~self.to_retry(stored))

    def stored(self, first: int = 1, count: int = LAST) -> TestTable:
        """Return what is stored of the test points from ``first`` on."""
        if self.study is None:
            return TestTable.empty(self.layout)
        columns = self.study.columns(first, count)
        known = kinds_of_columns(self.layout)
        # Tests of another run may have outputs that this one does not know yet.
        outputs = tuple(name for name in columns if name not in known)
        layout = replace(self.layout, outputs=self.layout.outputs + outputs)
        head = head_of(TestTable.empty(layout))
        return table_of(head, columns, self.study.path, TestTable)

    def to_retry(self, stored: TestTable) -> NDArray[np.bool_]:
        """``(n,)`` which of stored tests are failed ones to be evaluated once more."""
        again: NDArray[np.bool_] = stored.status == "failed"
        if self._retry != "failed":
            again &= np.isin(stored.numbers, [int(number) for number in self._retry])
        return again

    def known_designs(self) -> TestTable:
        """Return all that is stored; without failures where some are to be tried again."""
        stored = self.stored()
        return stored.rows(stored.status != "failed") if len(self._retry) else stored

    def keep(self, tests: TestTable, seconds: ArrayLike | None = None) -> None:
        """Store tests, and what each of them took; those that are stored already are left alone."""
        if self.study is not None and len(tests):
            self.study.append(columns_of(tests), origin=self.origin, seconds=seconds)


class _Terminated(KeyboardInterrupt):
    """SIGTERM, which like Ctrl-C no model takes for a failure of a design."""


@contextmanager
def stored_at_termination() -> Iterator[None]:
    """Let SIGTERM end the process after the body has stored what has arrived.

    Clusters send it before they kill. A handler of the user's is left alone.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return

    def interrupt(*_: Any) -> None:
        raise _Terminated

    signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except _Terminated:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGTERM)
        raise
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
