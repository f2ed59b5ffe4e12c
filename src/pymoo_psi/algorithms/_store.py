"""The store of a run: it recalls and keeps tests in a study, or does nothing without one."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import Mask, Numbers, invalid
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.study import LAST, Proposal, Study
from pymoo_psi.table import TestTable, columns_of, head_of, kinds_of_columns, table_of

Recall = Callable[[Numbers], TestTable]


class Store:
    """A store that keeps nothing: that of a run without a study.

    Args:
        table: A table without tests: the columns that the problem promises.

    Attributes:
        empty: This table.
        origin: Where the designs come from, for the readers of the study.
        advice: What is kept when a run is interrupted, and how it goes on.
    """

    advice = "no test is kept; with study='FILE.db' the same call would go on from the last"

    def __init__(self, table: TestTable) -> None:
        self.empty = table
        self.origin = ""

    @contextmanager
    def session(self) -> Iterator[Recall]:
        """Yield a function that recalls tests; it locks the study when a test is missing.

        The lock is released at the end of the body.
        """
        yield self.recall

    def recall(self, numbers: Numbers) -> TestTable:
        """Return the stored tests of increasing numbers, without those to be retried."""
        return self.empty

    def known(self) -> TestTable:
        """Return all stored tests, without those to be retried."""
        return self.empty

    def keep(self, tests: TestTable, seconds: ArrayLike | None = None) -> None:
        """Store tests, and what each of them took; those that are stored already are left alone."""

    def proposals(self) -> list[Proposal]:
        """Return all stored proposals, by number."""
        return []

    def propose(self, proposals: Sequence[Proposal]) -> list[Proposal]:
        """Store proposals; return those that are stored under their numbers now."""
        return list(proposals)


class StudyStore(Store):
    """A store that keeps tests in a study.

    Args:
        table: A table without tests: the columns that the problem promises, and what makes its
            tests belong together, the :func:`problem_identity`, ``sampling`` and ``key``.
        options: The options of the run.

    Raises:
        ArgumentValueError: The study is a folder without a share, or a file with one.
        StudyError: The study belongs to another problem, or cannot be used.
    """

    def __init__(self, table: TestTable, options: RunOptions) -> None:
        super().__init__(table)
        self._retry = options.retry is not None
        self._stored = np.zeros(0, dtype=np.int64)  # numbers, as far as they are known
        self._was_locked = False
        path = Study(options.study or "").path
        if os.path.exists(path) and os.path.isdir(path) != bool(options.share):
            rule = "the name of a folder with a share=(k, n), of a file without one"
            raise invalid("study", rule, path, "'pymoo-psi export' makes one file of a folder")
        if options.share:
            path = f"{path}/{options.part.file}"
        self.study = Study(path, wait=options.study_wait)
        # "LP-tau", not "LP-tau from point 1": every test has its number beside it
        self.origin = (table.problem or {})["sampling"].partition(" from ")[0]
        self.advice = f"tests are kept in study {self.study.path}; the same call goes on from there"
        self.study.begin(head_of(table), options.part if options.part.of > 1 else None)

    @contextmanager
    def session(self) -> Iterator[Recall]:
        """Yield a function that recalls tests; it locks the study when a test is missing."""
        with ExitStack() as lock:
            is_locked = False

            def recall_or_lock(numbers: Numbers) -> TestTable:
                nonlocal is_locked
                if not self._was_locked:
                    self._look(numbers)
                if not is_locked and not np.isin(numbers, self._stored).all():
                    lock.enter_context(self.study.writing())
                    is_locked = True
                    self._was_locked = True
                    self._look(numbers)  # another process may have stored some meanwhile
                if not np.isin(numbers, self._stored).any():
                    return self.empty
                return self.recall(numbers)

            yield recall_or_lock

    def _look(self, numbers: Numbers) -> None:
        """Learn which tests are stored, from the first of increasing numbers on."""
        if not np.isin(numbers, self._stored).all():
            self._stored = self.study.numbers(int(numbers[0]), failed=not self._retry)

    def recall(self, numbers: Numbers) -> TestTable:
        """Return the stored tests of increasing numbers, without those to be retried."""
        if len(numbers) == 0:
            return self.empty
        first, last = int(numbers[0]), int(numbers[-1])
        tests = self.known(first, last - first + 1)
        is_wanted = np.isin(tests.numbers, numbers)
        if is_wanted.all():  # without a copy
            return tests
        return tests.rows(is_wanted)  # the file of a share may hold points of other shares

    def known(self, first: int = 1, count: int = LAST) -> TestTable:
        """Return stored tests, without those to be retried; see :meth:`stored`."""
        tests = self.stored(first, count)
        if not self._retry:
            return tests
        return tests.rows(~self.to_retry(tests))

    def stored(self, first: int = 1, count: int = LAST) -> TestTable:
        """Return what is stored of ``count`` test points from number ``first`` on."""
        columns = self.study.contents(first, count)[1]
        layout = self.empty.layout
        promised = kinds_of_columns(layout)
        # Tests of another run may have outputs that this one does not know yet.
        outputs = tuple(name for name in columns if name not in promised)
        layout = replace(layout, outputs=layout.outputs + outputs)
        return table_of(head_of(TestTable.empty(layout)), columns, self.study.path)

    def to_retry(self, tests: TestTable) -> Mask:
        """``(n,)`` which of stored tests have failed and are to be evaluated once more."""
        if not self._retry:
            return np.zeros(len(tests), dtype=bool)
        return np.asarray(tests.status == "failed")

    def keep(self, tests: TestTable, seconds: ArrayLike | None = None) -> None:
        """Store tests, and what each of them took; those that are stored already are left alone."""
        if len(tests):
            self.study.append(columns_of(tests), origin=self.origin, seconds=seconds)

    def proposals(self) -> list[Proposal]:
        """Return all stored proposals, by number."""
        return self.study.proposals(1, LAST)

    def propose(self, proposals: Sequence[Proposal]) -> list[Proposal]:
        """Store proposals; return those that are stored under their numbers now."""
        return self.study.propose(proposals)


class _Terminated(KeyboardInterrupt):
    """SIGTERM, which like Ctrl-C no model takes for a failure of a design."""


@contextmanager
def stored_at_termination(store: Store | None = None) -> Iterator[None]:
    """Let SIGTERM end the process after the body has stored what has arrived.

    Clusters send it before they kill. A handler of the user's is left alone. If there is a store,
    an interrupt that leaves the body says what is kept.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    is_default = in_main_thread and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL

    def interrupt(*_: Any) -> None:
        raise _Terminated

    if is_default:
        signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt as error:
        if is_default and isinstance(error, _Terminated):
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGTERM)
        if store is not None:
            error.args = error.args or (store.advice,)  # the last line of what Python prints
        raise
    finally:
        if is_default:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
