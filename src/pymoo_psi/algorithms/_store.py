"""What an investigation or a recorded problem remembers: a study file, or nothing."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Collection, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import collection, integer, invalid
from pymoo_psi.study import ALL, LAST, Share, Study
from pymoo_psi.table import Layout, TestTable, columns_of, head_of, kinds_of_columns, table_of

# Seconds between two commits of a study: beside them a commit of some milliseconds does not count,
# and not much more is lost when the process is killed.
SECONDS = 1.0
# Seconds of computing, by all workers together, after which there is a commit in any case: results
# of slow designs that arrive together must not wait for the next one, perhaps for hours.
COMPUTED = 20.0


@dataclass
class Memory:
    """The tests of earlier runs, if there is a study, and the keeping of new ones.

    Attributes:
        study: The study file; ``None`` remembers nothing.
        retry: Numbers of failed test points to evaluate once more; ``None`` stands for all.
        share: Which of the points are tested; all of them are the first of one share.
        origin: Where the designs come from, for the readers of the study.
    """

    study: Study | None
    retry: frozenset[int] | None
    share: Share = ALL
    origin: str = ""

    @classmethod
    def of(
        cls,
        path: str | PathLike[str] | None,
        retry: str | Collection[int],
        share: tuple[int, int] | None = None,
    ) -> Memory:
        """Return the memory in a study file, of a share in a folder of them, or none."""
        again = retried(retry)
        study = None if path is None else Study(path)
        if share is None:
            if study is not None and os.path.isdir(study.path):
                remedy = "with share=(k, n) it is a folder; 'pymoo-psi merge' makes one study of it"
                raise invalid("study", "the name of a file", study.path, remedy)
            return cls(study, again)
        part = Share.checked(share)
        if study is not None:
            if os.path.isfile(study.path):
                rule = "the name of a folder, new or of other shares, where there is a share"
                raise invalid("study", rule, study.path)
            study = Study(os.path.join(study.path, part.file))
        return cls(study, again, part)

    def begin(
        self, layout: Layout, identity: Mapping[str, Any], points: tuple[int, int] = (1, 1)
    ) -> None:
        """Create the study, or make sure that it belongs to the same problem.

        Args:
            layout: The columns of its tests.
            identity: What makes the tests belong together: the :func:`problem_identity`; where
                the designs come from, as ``sampling``; and the user's ``key``.
            points: For a share, the first and the last test point of the run.
        """
        if self.study is None:
            return
        # "LP-tau", not "LP-tau from point 1": every test has its number beside it
        self.origin = identity["sampling"].partition(" from ")[0]
        head = {**head_of(TestTable.empty(layout)), "problem": identity}
        if self.share.of == 1:
            self.study.begin(head)
        else:
            self.study.begin(head, self.share, points)

    def writing(self) -> AbstractContextManager[None]:
        """Keep others from testing points of the study while the body runs."""
        return nullcontext() if self.study is None else self.study.writing()

    def recall(self, layout: Layout, numbers: NDArray[np.int64]) -> TestTable:
        """Return what is stored of rising test points of the run and not to be retried."""
        if self.study is None or len(numbers) == 0:
            return TestTable.empty(layout)
        first, last = int(numbers[0]), int(numbers[-1])
        stored = self.stored(layout, first, last - first + 1)
        # the file of a share may have come to hold points of other shares
        return stored.rows(np.isin(stored.numbers, numbers) & ~self.to_retry(stored))

    def stored(self, layout: Layout, first: int, count: int) -> TestTable:
        """Return what is stored of the test points from ``first`` on."""
        if self.study is None:
            return TestTable.empty(layout)
        columns = self.study.columns(first, count)
        known = kinds_of_columns(layout)
        # Tests of another run may have outputs that this one does not know yet.
        outputs = tuple(name for name in columns if name not in known)
        head = head_of(TestTable.empty(replace(layout, outputs=layout.outputs + outputs)))
        return table_of(head, columns, self.study.path, TestTable)

    def to_retry(self, stored: TestTable) -> NDArray[np.bool_]:
        """``(n,)`` which of stored tests are failed ones to be evaluated once more."""
        again: NDArray[np.bool_] = stored.status == "failed"
        if self.retry is not None:
            again &= np.isin(stored.numbers, list(self.retry))
        return again

    def everything(self, layout: Layout) -> TestTable:
        """Return all that is stored; without failures where some are to be tried again."""
        stored = self.stored(layout, 1, LAST)
        retries = self.retry is None or len(self.retry) > 0
        return stored.rows(stored.status != "failed") if retries else stored

    def keep(self, block: TestTable, seconds: ArrayLike | None = None) -> None:
        """Store tests, and what each of them took; those that are stored already are left alone."""
        if self.study is not None and len(block):
            self.study.append(columns_of(block), origin=self.origin, seconds=seconds)


def retried(retry: str | Collection[int]) -> frozenset[int] | None:
    """Return the numbers of failed tests to evaluate once more; ``None`` for ``"failed"``, all."""
    if retry == "failed":
        return None
    numbers = collection("retry", retry, "'failed' or numbers of test points")
    return frozenset(integer("a number in retry", number, minimum=1) for number in numbers)


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
