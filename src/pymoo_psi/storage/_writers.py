"""One writer at a time: a lock that says who holds it, and dies with the process that does.

The lock is SQLite's own lock on a small database beside the study, ``<study>-lock``. The system
releases it when the process ends, however it ends. The holder removes the file when it is done.
The hold is the process's: every :class:`Study` of the same file in it shares it.
"""

from __future__ import annotations

import json
import os
import secrets
import socket
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime, timezone

from pymoo_psi.errors import StudyLockedError
from pymoo_psi.storage._database import connected
from pymoo_psi.storage._errors import translated
from pymoo_psi.storage._reservation import holder, put_holder, reserve

_PAUSE = 0.05  # seconds between two attempts


@dataclass
class _Hold:
    """A lock this process has.

    Attributes:
        db: The connection in the transaction that is the lock.
        descriptor: The same file, kept open so that no other gets its inode number.
        threads: The threads that are in the body of :func:`writing`.
    """

    db: sqlite3.Connection
    descriptor: int
    threads: set[int] = field(default_factory=set)


# By process as well: a fork inherits the entries, but not the locks.
_HOLDS: dict[tuple[int, str], _Hold] = {}
_GUARD = threading.Lock()


@contextmanager
def writing(path: str, wait: float) -> Iterator[None]:
    """Be the only process that writes a study while the body runs.

    Args:
        path: The study file.
        wait: Seconds to wait for another writer.

    Raises:
        StudyLockedError: Another process is still writing; the message says which.
        StudyAccessError: The lock cannot be made beside the study.
    """
    key, thread = (os.getpid(), path), threading.get_ident()
    hold = _HOLDS.get(key)
    if hold is not None and thread in hold.threads:
        yield
        return
    try:
        _enter(key, thread, wait)
        yield
    finally:  # also of an interrupted entry
        _leave(key, thread)


def _enter(key: tuple[int, str], thread: int, wait: float) -> None:
    path = key[1]
    deadline = time.monotonic() + wait
    while True:
        with _GUARD:
            if key not in _HOLDS:
                with translated(f"{path}-lock"):
                    found = _attempt(f"{path}-lock")
                if isinstance(found, _Hold):
                    _HOLDS[key] = found
            if key in _HOLDS:
                _HOLDS[key].threads.add(thread)
                return
        if time.monotonic() >= deadline:
            raise StudyLockedError(
                f"study {path} is being written by {found}; waited {wait:g} s: "
                "let it finish or stop it, wait longer, or use another file"
            )
        time.sleep(_PAUSE)


def _leave(key: tuple[int, str], thread: int) -> None:
    with _GUARD:
        hold = _HOLDS.get(key)
        if hold is not None:
            hold.threads.discard(thread)
            if not hold.threads:
                del _HOLDS[key]
                _release(f"{key[1]}-lock", hold)


def _attempt(lock: str) -> _Hold | str:
    """Return the lock, or who has it."""
    me = json.dumps(
        {
            "host": socket.gethostname(),
            "pid": os.getpid(),
            "since": datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC"),
            "token": secrets.token_hex(8),
        }
    )
    while True:
        descriptor = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        db = hold = None
        try:
            db = connected(lock, "mode=rwc", 0)
            while _is_ours(db, lock, descriptor):
                if holder(db) == me:
                    hold = _Hold(db, descriptor)
                    return hold
                put_holder(db, me)  # ends the transaction; is it still ours after that?
            if not db.in_transaction:
                return _described(holder(db))
        finally:
            if hold is None:
                if db is not None:
                    db.close()
                os.close(descriptor)


def _is_ours(db: sqlite3.Connection, lock: str, descriptor: int) -> bool:
    """Say whether the connection gets the lock, and of the file that has the lock's name now."""
    if not reserve(db):
        return False
    with suppress(FileNotFoundError):
        return os.path.samestat(os.stat(lock), os.fstat(descriptor))
    return False


def _release(lock: str, hold: _Hold) -> None:
    # Others that have the file open find that it lost its name and begin anew. Where open files
    # cannot be removed, on Windows, it goes when nobody has it open.
    if os.name == "posix":
        with suppress(OSError):
            os.unlink(lock)
    hold.db.close()
    os.close(hold.descriptor)
    if os.name != "posix":
        with suppress(OSError):
            os.unlink(lock)


def _described(who: str | None) -> str:
    try:
        known = json.loads(who or "")
        return f"process {known['pid']} on {known['host']} since {known['since']}"
    except (ValueError, KeyError, TypeError):
        return "another process"
