"""What an investigation or a recorded problem remembers: a study file, or nothing."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import integer
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.storage import Study
from pymoo_psi.table import Layout, TestTable
from pymoo_psi.table._exchange import columns_of, head_of, kinds_of_columns, table_of


@dataclass
class Memory:
    """The tests of earlier runs, if there is a study, and the keeping of new ones.

    Attributes:
        study: The study file; ``None`` remembers nothing.
        retry: Numbers of failed test points to evaluate once more; ``None`` stands for all.
        origin: Where the designs come from, for the readers of the study.
    """

    study: Study | None
    retry: frozenset[int] | None
    origin: str = ""

    @classmethod
    def of(cls, path: str | PathLike[str] | None, retry: str | Collection[int]) -> Memory:
        """Return the memory in a study file, or none."""
        return cls(None if path is None else Study(path), retried(retry))

    def begin(self, layout: Layout, identity: Mapping[str, Any]) -> None:
        """Create the study, or make sure that it belongs to the same problem.

        Args:
            layout: The columns of its tests.
            identity: What makes the tests belong together: the :func:`problem_identity`; where
                the designs come from, as ``sampling``; and the user's ``key``.
        """
        if self.study is not None:
            # "LP-tau", not "LP-tau from point 1": every test has its number beside it
            self.origin = identity["sampling"].partition(" from ")[0]
            self.study.begin({**head_of(TestTable.empty(layout)), "problem": identity})

    @contextmanager
    def turn(self, layout: Layout, first: int, count: int) -> Iterator[TestTable]:
        """Give what is stored of test points; nobody else tests them while the body runs.

        Where all are stored there is nothing to test, and the study is not even locked.
        """
        stored = self.recall(layout, first, count)
        if self.study is None or len(stored) == count:
            yield stored
        else:
            with self.study.writing():
                # once more: another process may have stored some before we got the lock
                yield self.recall(layout, first, count)

    def recall(self, layout: Layout, first: int, count: int) -> TestTable:
        """Return what is stored of the test points from ``first`` on and not to be retried."""
        stored = self.stored(layout, first, count)
        return stored.rows(~self.to_retry(stored))

    def stored(self, layout: Layout, first: int, count: int) -> TestTable:
        """Return what is stored of the test points from ``first`` on."""
        nothing = TestTable.empty(layout)
        if self.study is None or count == 0:
            return nothing
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

    def keep(self, block: TestTable, seconds: float | None = None) -> None:
        """Store tests, and what one took; those that are stored already are left alone."""
        if self.study is not None and len(block):
            self.study.append(columns_of(block), origin=self.origin, seconds=seconds)


def retried(retry: str | Collection[int]) -> frozenset[int] | None:
    """Return the numbers of failed tests to evaluate once more; ``None`` for ``"failed"``, all."""
    if retry == "failed":
        return None
    if isinstance(retry, str) or not isinstance(retry, Collection):
        raise ArgumentTypeError(f"retry must be 'failed' or numbers of test points, got {retry!r}")
    return frozenset(integer("a number in retry", number, minimum=1) for number in retry)
