"""The study of a run: tests of earlier runs, and the storing of new ones."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext, suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import counted, invalid
from pymoo_psi.algorithms._run import RunOptions
from pymoo_psi.errors import StudyError, StudyMismatchError
from pymoo_psi.parallel import Result, Values
from pymoo_psi.study import LAST, Study
from pymoo_psi.table import TestTable, columns_of, head_of, kinds_of_columns, table_of

# Seconds between two commits of a study: beside them a commit of some milliseconds does not count,
# and not much more is lost when the process is killed.
SECONDS = 1.0
# Seconds of computing, by all workers together, after which there is a commit in any case: results
# of slow designs that arrive together must not wait for the next one, perhaps for hours.
COMPUTED = 20.0


class Store:
    """The study of a run, or nothing where there is none.

    Args:
        options: The options of the run.
        table: A table without tests: the columns that the problem promises, and what makes its
            tests belong together, the :func:`problem_identity`, ``sampling`` and ``key``.
        points: The first and the last test point of a run of several shares.

    Attributes:
        study: The study file; ``None`` stores nothing.
        layout: The columns that the problem promises.
        origin: Where the designs come from, for the readers of the study.
    """

    def __init__(
        self, options: RunOptions, table: TestTable, points: tuple[int, int] = (1, 1)
    ) -> None:
        self.study, self.layout, self._retry = None, table.layout, options.retry
        self.origin = ""
        if options.study is None:
            return
        path, share = Study(options.study).path, options.part if options.share else None
        if os.path.exists(path) and os.path.isdir(path) != bool(share):
            rule = "the name of a folder with a share=(k, n), of a file without one"
            raise invalid("study", rule, path, "'pymoo-psi export' makes one file of a folder")
        self.study = Study(f"{path}/{share.file}" if share else path)
        # "LP-tau", not "LP-tau from point 1": every test has its number beside it
        self.origin = (table.problem or {})["sampling"].partition(" from ")[0]
        begun = self.study.facts()["head"]["problem"] if os.path.exists(self.study.path) else None
        if options.study_key is None and begun and (key := begun.get("key")) is not None:
            raise StudyMismatchError(
                f"study {self.study.path} was begun with study_key={key!r}, and none is given; "
                "give the same one, or the name of another file"
            )
        self.study.begin(head_of(table), share if share and share.of > 1 else None, points)

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

    def kept(self) -> str:
        """Say what is kept of an interrupted run, and how it goes on."""
        if self.study is None:
            return "no test is kept; with study='FILE.db' the same call would go on from the last"
        with suppress(StudyError):
            n = counted(len(self.study.columns(1, LAST)["test_point"]), "test")
            return f"{n} kept in study {self.study.path}; the same call goes on from there"
        return f"see study {self.study.path} for what is kept"

    def keep(self, tests: TestTable, seconds: ArrayLike | None = None) -> None:
        """Store tests, and what each of them took; those that are stored already are left alone."""
        if self.study is not None and len(tests):
            self.study.append(columns_of(tests), origin=self.origin, seconds=seconds)


def in_groups(
    results: Generator[Result],
    keep: Callable[[NDArray[np.intp], tuple[Values, ...], NDArray[np.float64]], None],
    at_once: Callable[[Result], bool] = lambda result: False,
) -> Generator[None]:
    """Take results, a step for each, and keep them in groups, all of them whatever ends it.

    Args:
        results: The results; they are closed at the end.
        keep: Keeps a group, its indices, values and seconds; about every second, and at the end.
        at_once: Whether a result and those before it are to be kept without delay.
    """
    group: list[Result] = []
    began, computed = time.monotonic(), 0.0

    def flush() -> None:
        nonlocal began, computed
        indices, values, seconds = zip(*group, strict=True)
        group.clear()
        keep(np.array(indices), values, np.array(seconds))
        began, computed = time.monotonic(), 0.0

    try:
        with closing(results):
            for result in results:
                group.append(result)
                computed += result[2]
                late = computed >= COMPUTED or time.monotonic() - began >= SECONDS
                if at_once(result) or late:
                    flush()
                yield
    finally:
        if group:
            flush()


class _Terminated(KeyboardInterrupt):
    """SIGTERM, which like Ctrl-C no model takes for a failure of a design."""


@contextmanager
def stored_at_termination(store: Store | None = None) -> Iterator[None]:
    """Let SIGTERM end the process after the body has stored what has arrived.

    Clusters send it before they kill. A handler of the user's is left alone. Where there is a
    store, an interrupt that leaves the body says what is kept.
    """
    main = threading.current_thread() is threading.main_thread()
    ours = main and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL

    def interrupt(*_: Any) -> None:
        raise _Terminated

    if ours:
        signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt as error:
        if ours and isinstance(error, _Terminated):
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGTERM)
        elif store is not None:
            error.args = error.args or (store.kept(),)  # the last line of what Python prints
        raise
    finally:
        if ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
