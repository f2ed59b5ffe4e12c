"""What a study file holds, checked: its problem, its tests, and what a block changes in them."""

from __future__ import annotations

import sqlite3

from pymoo_psi._validation import Received, invalid
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.storage import _database as database
from pymoo_psi.storage._errors import corrupt
from pymoo_psi.storage._identity import Identity
from pymoo_psi.storage._rows import DIGEST_SIZE, Row, checked, combined, table_of_rows
from pymoo_psi.table import TestTable

LAST = 2**63 - 1  # the largest number of a test point


def everything(path: str) -> tuple[Identity, TestTable]:
    """Return problem and tests of a study, every page, row and sum of it checked.

    Raises:
        StudyError: The file is damaged, no study, of a later version, or cannot be read.
    """

    def query(db: sqlite3.Connection) -> tuple[database.Head, list[Row]]:
        head = database.stored_head(db, path, thorough=True)
        rows = [checked(row, path) for row in database.stored_tests(db, 1, LAST)]
        if len(rows) != head.tests:
            raise corrupt(path, f"it holds {len(rows)} of {head.tests} tests")
        if combined(bytes(DIGEST_SIZE), *(row.digest for row in rows)) != head.digest:
            raise corrupt(path, "its tests are not those that were committed last")
        return head, rows

    head, rows = database.read(path, query)
    identity = identity_of(head, path)
    return identity, table_of_rows(identity.layout, rows, path)


def identity_of(head: database.Head, path: str) -> Identity:
    """Return the problem that is in the head of a study.

    Raises:
        StudyCorruptError: There is none in it.
    """
    try:
        return Identity.from_json(head.layout, head.fingerprint)
    except ArgumentValueError as error:
        raise corrupt(path, str(error)) from error


def changes(db: sqlite3.Connection, path: str, rows: list[Row]) -> tuple[list[Row], list[Row]]:
    """Return the rows to write, and the stored ones they replace.

    Raises:
        ArgumentValueError: A test that did not fail would change, or the design of one that did.
        StudyCorruptError: A stored test is damaged.
    """
    new, old = [], []
    for row in rows:
        for found in database.stored_tests(db, row.number, row.number):
            stored = checked(found, path)
            if stored == row:
                break
            if stored.status != "failed" or stored.x != row.x:
                what = "design" if stored.x != row.x else "results"
                raise invalid(
                    "block",
                    "of new test points, repetitions of failed ones, or what is stored",
                    Received(f"other {what} for test point {row.number}"),
                    f"use another file if the model has changed; study {path} is as it was",
                )
            old.append(stored)
        else:
            new.append(row)
    return new, old
