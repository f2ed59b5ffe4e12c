"""A database for the sake of its lock: a transaction that only one connection can be in."""

from __future__ import annotations

import sqlite3

__all__ = ["holder", "put_holder", "reserve"]


def reserve(db: sqlite3.Connection) -> bool:
    """Begin a transaction that only one connection can be in; say whether it is this one."""
    db.execute("PRAGMA busy_timeout = 0")
    try:
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
        row = db.execute("SELECT who FROM holder").fetchone()
    except sqlite3.OperationalError:  # no such table yet, or just being written
        return None
    return None if row is None else str(row[0])


def put_holder(db: sqlite3.Connection, who: str) -> None:
    """Say who is in the transaction, and end it."""
    db.execute("PRAGMA busy_timeout = 10000")  # others may be reading just now
    db.execute("CREATE TABLE IF NOT EXISTS holder (who TEXT)")
    db.execute("DELETE FROM holder")
    db.execute("INSERT INTO holder VALUES (?)", (who,))
    db.execute("COMMIT")
