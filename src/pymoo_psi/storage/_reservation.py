"""A database for the sake of its lock: a transaction that only one connection can be in.

Its file may lose its name to another while connections are open. A journal, which SQLite finds by
the name, would then be taken for that of the wrong file; so it is kept in memory. What is written,
a view, fits into one page, so that a process that is killed leaves it whole.
"""

from __future__ import annotations

import sqlite3


def reserve(db: sqlite3.Connection) -> bool:
    """Begin a transaction that only one connection can be in; say whether it is this one."""
    db.execute("PRAGMA busy_timeout = 0")
    try:
        db.execute("PRAGMA journal_mode = MEMORY")
        db.execute("BEGIN IMMEDIATE")
    except sqlite3.OperationalError as error:
        if "is locked" in str(error):
            return False
        raise
    return True


def holder(db: sqlite3.Connection) -> str | None:
    """Return what the last one in the transaction said of itself, if anything."""
    db.execute("PRAGMA busy_timeout = 1000")  # it may be writing just now
    try:
        row = db.execute("SELECT who FROM writer").fetchone()
    except sqlite3.OperationalError:  # no such view yet, or just being written
        return None
    return None if row is None else str(row[0])


def put_holder(db: sqlite3.Connection, who: str) -> None:
    """Say who is in the transaction, and end it."""
    db.execute("PRAGMA busy_timeout = 10000")  # others may be reading just now
    text = who.replace("'", "''")
    db.execute("DROP VIEW IF EXISTS writer")
    db.execute(f"CREATE VIEW writer AS SELECT '{text}' AS who")
    db.execute("COMMIT")
