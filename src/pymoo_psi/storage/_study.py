"""A study: the tests of an investigation in a file, block after block."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import finite_number, integer, invalid, known_name
from pymoo_psi.errors import ArgumentTypeError, StudyMismatchError
from pymoo_psi.storage import _database as database
from pymoo_psi.storage._contents import LAST, changes, everything, identity_of
from pymoo_psi.storage._errors import corrupt
from pymoo_psi.storage._identity import Identity
from pymoo_psi.storage._rows import (
    DIGEST_SIZE,
    Row,
    checked,
    combined,
    rows_of_table,
    table_of_rows,
)
from pymoo_psi.storage._writers import writing
from pymoo_psi.table import Layout, TestTable


@dataclass(frozen=True)
class Study:
    """A study file, by name: it may be copied, pickled and sent to other processes.

    The tests of a block are committed together, or none of them. They stay, whatever happens to
    the process later. Reading never waits for a writer and never changes the file.

    Attributes:
        path: The file; an absolute path, whatever was given.
        wait: Seconds to wait for another process that is writing the study.

    Example:
        >>> import os, tempfile
        >>> folder = tempfile.TemporaryDirectory()
        >>> study = Study(os.path.join(folder.name, "chute.db"))
        >>> study.begin(Layout.of(1, 1), {"problem": "chute"})
        TestTable(0 tests: 0 ok, 0 infeasible, 0 failed; 1 variable, 1 criterion, 0 constraints)
        >>> study.append(TestTable.of([1, 2], X=[[0.5], [0.25]], F=[[3.0], [2.0]]))
        2
        >>> study.numbers()
        array([1, 2])
        >>> folder.cleanup()
    """

    path: str
    wait: float

    def __init__(self, path: str | PathLike[str], *, wait: float = 10.0) -> None:
        if not isinstance(path, (str, PathLike)) or not os.fspath(path):
            raise ArgumentTypeError(f"path must be the name of a file, got {path!r:.80}")
        seconds = finite_number("wait", wait)
        if seconds < 0:
            raise invalid("wait", "0 seconds or more", seconds)
        object.__setattr__(self, "path", os.path.realpath(path))
        object.__setattr__(self, "wait", seconds)

    def begin(self, layout: Layout, fingerprint: Mapping[str, Any]) -> TestTable:
        """Create the file, or continue it after a check of everything in it.

        Args:
            layout: Names, bounds and tolerance of the tests to come.
            fingerprint: Plain JSON values by name that make the problem what it is. A value the
                caller does not want compared has no place in it.

        Returns:
            The tests that are stored already, by number.

        Raises:
            StudyMismatchError: The file belongs to another problem; the message says what differs.
            StudyCorruptError: The file is damaged, or no study.
            StudyVersionError: A later version wrote it.
            StudyAccessError: It cannot be created or read.
            StudyLockedError: Another process is just creating it.
            ArgumentTypeError: Layout or fingerprint are not what they must be.
        """
        asked = Identity.of(layout, fingerprint)
        if not os.path.lexists(self.path):
            with writing(self.path, self.wait):
                if not os.path.lexists(self.path):
                    head = database.Head(*asked.to_json(), 0, bytes(DIGEST_SIZE))
                    database.create(self.path, head)
        stored, table = everything(self.path)
        stored.require(asked, self.path)
        return table

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Keep other processes from writing while the body runs, so that none repeats its work.

        Without it, :meth:`append` does so for the time of one block. It may be nested.

        Raises:
            StudyLockedError: Another process is writing; the message says which, where, and since
                when. One that was killed is in nobody's way.
            StudyAccessError: The folder cannot be written.
        """
        with writing(self.path, self.wait):
            yield

    def append(self, block: TestTable) -> int:
        """Commit a block of tests; after the return they are on the disk.

        A test that is stored already with the same results is left alone. One that is stored as
        failed is replaced by its repetition. No other stored test can be changed.

        Returns:
            How many tests were new or replaced.

        Raises:
            StudyMismatchError: The block has another layout.
            ArgumentValueError: A test is stored with other results, or the block has a prototype.
            ArgumentTypeError: It is no table.
            StudyLockedError: Another process is writing.
            StudyAccessError: The disk is full, or file or folder cannot be written.
            StudyCorruptError: The file is damaged.
        """
        if not isinstance(block, TestTable):
            raise ArgumentTypeError(f"block must be a TestTable, got {block!r:.80}")
        if block.prototype is not None:
            raise invalid(
                "block", "without a prototype", block, "give it to the table that is read"
            )
        rows = rows_of_table(block)
        with writing(self.path, self.wait), database.transaction(self.path) as db:
            head = database.stored_head(db, self.path)
            difference = identity_of(head, self.path).layout.difference(block.layout)
            if difference:
                raise StudyMismatchError(
                    f"study {self.path} belongs to another problem than the block: {difference} "
                    "(study against block)"
                )
            new, old = changes(db, self.path, rows)
            if new:
                digest = combined(head.digest, *(row.digest for row in new + old))
                database.put_tests(db, new)
                tests = head.tests + len(new) - len(old)
                database.put_head(db, head._replace(tests=tests, digest=digest))
        return len(new)

    def table(self) -> TestTable:
        """Return all stored tests, by number, after a check of everything in the file.

        Raises:
            StudyCorruptError: The file is damaged, or no study.
            StudyVersionError: A later version wrote it.
            StudyAccessError: It does not exist or cannot be read.
        """
        return everything(self.path)[1]

    def rows(self, first: int, count: int) -> TestTable:
        """Return the stored tests among the ``count`` test points from number ``first``.

        Raises:
            StudyError: As :meth:`table`; of the tests, those that are returned are checked.
        """
        first, count = integer("first", first, minimum=1), integer("count", count, minimum=0)

        def query(db: sqlite3.Connection) -> tuple[database.Head, list[Row]]:
            head = database.stored_head(db, self.path)
            last = min(first + count - 1, LAST)
            found = database.stored_tests(db, min(first, LAST), last)
            return head, [checked(row, self.path) for row in found]

        head, rows = database.read(self.path, query)
        return table_of_rows(identity_of(head, self.path).layout, rows, self.path)

    def numbers(self, status: str | None = None) -> NDArray[np.int64]:
        """Return the numbers of the stored tests, in order.

        Args:
            status: "ok", "infeasible" or "failed"; of all tests unless given.

        Raises:
            StudyError: As :meth:`table`; the results are not checked, their number is.
        """
        if status is not None:
            known_name("status", status, ("ok", "infeasible", "failed"))

        def query(db: sqlite3.Connection) -> list[tuple[int, str]]:
            head, found = database.stored_head(db, self.path), database.stored_numbers(db)
            if len(found) != head.tests:
                raise corrupt(self.path, f"it holds {len(found)} of {head.tests} tests")
            return found

        found = database.read(self.path, query)
        chosen = [number for number, of in found if status is None or of == status]
        return np.array(chosen, dtype=np.int64)

    def fingerprint(self) -> dict[str, Any]:
        """Return what the study was begun with.

        Raises:
            StudyError: As :meth:`table`; the tests are not checked.
        """
        head = database.read(self.path, lambda db: database.stored_head(db, self.path))
        return identity_of(head, self.path).fingerprint


def read_study(path: str | PathLike[str]) -> TestTable:
    """Return the tests of a study file, by number; the file is not changed, nor created.

    Raises:
        StudyCorruptError: The file is damaged, or no study.
        StudyVersionError: A later version wrote it.
        StudyAccessError: It does not exist or cannot be read.
    """
    return Study(path).table()
