"""The study file as a database: its tables and statements, and how its connections behave.

The file is in WAL mode with full synchronisation. Every transaction is followed by a checkpoint
that empties the log, so that what was committed lies in the file itself: a log that is lost or
cut afterwards loses nothing. One row of the table ``study`` holds the number of tests and the
digest of them all, under a seal; it changes in the transaction that changes the tests.

No connection outlives a call. Readers never write: they take a file at rest as it is, and another
through SQLite's locks, which do not wait for a writer.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from pymoo_psi.errors import StudyError, StudyVersionError
from pymoo_psi.storage import _files as files
from pymoo_psi.storage._errors import corrupt, foreign, translated

T = TypeVar("T")

APPLICATION = 0x50534931  # "PSI1", in the header of the file
VERSION = 1  # of the tables below; also in the header
_TABLES = {
    "study": "CREATE TABLE study (layout TEXT NOT NULL, fingerprint TEXT NOT NULL, "
    "tests INTEGER NOT NULL, digest BLOB NOT NULL, seal BLOB NOT NULL)",
    "tests": "CREATE TABLE tests (number INTEGER PRIMARY KEY, x BLOB NOT NULL, y BLOB NOT NULL, "
    "status TEXT NOT NULL, reason TEXT, digest BLOB NOT NULL)",
}
_PATIENCE = 30.0  # seconds for the moments in which another connection opens or closes the file
_CHECKPOINT_PATIENCE = 500  # milliseconds, for readers in the middle of a query


class Head(NamedTuple):
    """The one row of the table ``study``, but for its seal."""

    layout: str
    fingerprint: str
    tests: int
    digest: bytes

    @property
    def seal(self) -> bytes:
        """Digest of the row and of the version of the tables."""
        sizes = f"{VERSION} {len(self.layout)} {len(self.fingerprint)} {self.tests:d};"
        texts = (sizes + self.layout + self.fingerprint).encode()
        return blake2b(texts + self.digest, digest_size=16).digest()


# Connections


def connected(path: str, options: str, patience: float) -> sqlite3.Connection:
    """Open a database; ``options`` are those of SQLite's URIs."""
    uri = f"{Path(path).as_uri()}?{options}"
    return sqlite3.connect(uri, uri=True, timeout=patience, isolation_level=None)


def create(path: str, head: Head) -> None:
    """Make a new study file, whole or not at all; the caller has made sure that there is none.

    Raises:
        StudyAccessError: It cannot be written there.
        StudyCorruptError: The log of a study is there, but not its file.
    """
    new = f"{path}-new"
    with translated(path):
        if files.has_log(path):
            raise corrupt(path, f"its log {path}-wal is there, but the file itself is missing")
        files.remove(new)  # what a process that was killed here left
        try:
            with closing(connected(new, "mode=rwc", _PATIENCE)) as db:
                db.execute("BEGIN")
                db.execute(f"PRAGMA application_id = {APPLICATION}")
                db.execute(f"PRAGMA user_version = {VERSION}")
                for statement in _TABLES.values():
                    db.execute(statement)
                db.execute("INSERT INTO study VALUES (?, ?, ?, ?, ?)", (*head, head.seal))
                db.execute("COMMIT")
                db.execute("PRAGMA journal_mode = WAL")
            os.replace(new, path)
        finally:
            files.remove(new)
        files.sync_name(path)


@contextmanager
def transaction(path: str) -> Iterator[sqlite3.Connection]:
    """Give a connection in a transaction: committed after the body, undone if it raises.

    Raises:
        StudyError: See :func:`pymoo_psi.storage._errors.translated`.
    """
    with translated(path):
        files.require_there(path)
        with closing(connected(path, "mode=rw", _PATIENCE)) as db:
            stored_head(db, path)  # before anything is written into what may be another's file
            for setting in ("synchronous = FULL", "fullfsync = ON", "checkpoint_fullfsync = ON"):
                db.execute(f"PRAGMA {setting}")
            db.execute("PRAGMA journal_mode = WAL")
            db.execute("BEGIN IMMEDIATE")
            try:
                yield db
                db.execute("COMMIT")
            except BaseException:
                if db.in_transaction:
                    db.execute("ROLLBACK")
                raise
            _checkpoint(db)


def _checkpoint(db: sqlite3.Connection) -> None:
    """Bring the log into the file; a reader that stays in its query leaves it to the next one."""
    db.execute(f"PRAGMA busy_timeout = {_CHECKPOINT_PATIENCE}")
    db.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()


def read(path: str, query: Callable[[sqlite3.Connection], T]) -> T:
    """Return what a query says of one state of the file, without changing file or log.

    Raises:
        StudyError: See :func:`pymoo_psi.storage._errors.translated`.
    """
    with translated(path):
        files.require_there(path)
        state = files.stamp_at_rest(path)
        if state is not None:  # no locks, and no files of SQLite's beside the study
            try:
                answer = _asked(path, "mode=ro&immutable=1", query)
            except (sqlite3.Error, StudyError, UnicodeDecodeError):
                if files.stamp_now(path) == state:
                    raise
            else:
                if files.stamp_now(path) == state:
                    return answer
        try:
            return _asked(path, "mode=ro", query)
        except sqlite3.OperationalError as error:
            if "is locked" in str(error):
                raise
        # A log in a folder, or on a full disk, where SQLite cannot make the index it reads it by.
        with files.copied(path) as copy:
            return _asked(copy, "mode=ro", query)


def _asked(path: str, options: str, query: Callable[[sqlite3.Connection], T]) -> T:
    with closing(connected(path, options, _PATIENCE)) as db:
        db.execute("PRAGMA cell_size_check = ON")
        db.execute("BEGIN")
        return query(db)


# Statements on a study


def stored_head(db: sqlite3.Connection, path: str, *, thorough: bool = False) -> Head:
    """Return the head of a study after making sure that the file is one.

    Args:
        db: The connection.
        path: The file, for messages.
        thorough: Have SQLite check every page of the file.

    Raises:
        StudyVersionError: A later version wrote it.
        StudyCorruptError: It is no study, or damaged.
    """
    if db.execute("PRAGMA application_id").fetchone()[0] != APPLICATION:
        raise foreign(path, "another file, empty, or damaged in its first bytes")
    version = db.execute("PRAGMA user_version").fetchone()[0]
    if version > VERSION and not _has_seal(db):
        raise StudyVersionError(
            f"study {path} has format {version}, but this version of pymoo-psi knows formats up "
            f"to {VERSION}; upgrade pymoo-psi: pip install --upgrade pymoo-psi"
        )
    tables = dict(db.execute("SELECT name, sql FROM sqlite_master"))
    if version != VERSION or tables != _TABLES:
        raise corrupt(path, "the description of its tables has changed")
    if thorough and (found := db.execute("PRAGMA quick_check(1)").fetchall()) != [("ok",)]:
        raise corrupt(path, str(found[0][0]).replace("\n", " "))
    if not _has_seal(db):
        raise corrupt(path, "the seal of its head is broken")
    return Head(*db.execute("SELECT layout, fingerprint, tests, digest FROM study").fetchone())


def _has_seal(db: sqlite3.Connection) -> bool:
    try:
        rows = db.execute("SELECT layout, fingerprint, tests, digest, seal FROM study").fetchall()
        return len(rows) == 1 and Head(*rows[0][:4]).seal == rows[0][4]
    except (sqlite3.DatabaseError, UnicodeError, AttributeError, TypeError, ValueError):
        return False  # no such table or column, or values of other types


def put_head(db: sqlite3.Connection, head: Head) -> None:
    """Replace the head."""
    statement = "UPDATE study SET layout = ?, fingerprint = ?, tests = ?, digest = ?, seal = ?"
    db.execute(statement, (*head, head.seal))


def stored_tests(db: sqlite3.Connection, first: int, last: int) -> Iterable[tuple[Any, ...]]:
    """Return the tests with numbers from ``first`` to ``last``, by number."""
    return db.execute(
        "SELECT number, x, y, status, reason, digest FROM tests "
        "WHERE number BETWEEN ? AND ? ORDER BY number",
        (first, last),
    )


def stored_numbers(db: sqlite3.Connection) -> list[tuple[int, str]]:
    """Return number and status of every test, by number."""
    return db.execute("SELECT number, status FROM tests ORDER BY number").fetchall()


def put_tests(db: sqlite3.Connection, rows: Iterable[tuple[Any, ...]]) -> None:
    """Insert tests, or replace those with the same number."""
    db.executemany("INSERT OR REPLACE INTO tests VALUES (?, ?, ?, ?, ?, ?)", rows)
