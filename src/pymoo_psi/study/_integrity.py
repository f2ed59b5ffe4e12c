"""What keeps a study intact: connections, errors that name the damage, and a lock for each run."""

from __future__ import annotations

import os
import random
import sqlite3
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from pymoo_psi.errors import PsiError, StudyAccessError, StudyCorruptError, StudyLockedError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_LOCK = ".pymoo-psi-lock"  # the end of the name of a lock
# The ends of the names of files that SQLite, and this package, keep beside a study and delete.
BESIDE = ("-journal", "-wal", "-shm", _LOCK)
# Seconds between two attempts to lock a study, the first ones and the later ones: hundreds of
# writers must not keep a shared file system busy.
_FIRST_PAUSE, _LAST_PAUSE = 0.02, 0.3

_PATIENCE = 60.0  # seconds that a commit waits for readers, and readers for a commit

# By process and lock file: the lock among the threads, and which locks the process holds.
_THREAD_LOCKS: dict[tuple[int, str], Any] = {}
_HELD: set[tuple[int, str]] = set()

_SETTINGS = """
PRAGMA synchronous = EXTRA; -- a commit outlives a power failure
PRAGMA cell_size_check = ON; -- damage is reported, not read
PRAGMA temp_store = MEMORY;
PRAGMA cache_size = -65536; -- 64 MB, as designs are spread over their index
"""

# Files


def connected(path: str) -> sqlite3.Connection:
    """Return a connection to a file that exists, without a transaction."""
    # "rw" also to read: SQLite then undoes what a killed writer has left, and takes a file
    # that must not be written as read-only. isolation_level=None: Python's module would
    # begin transactions by itself.
    uri = f"{Path(path).as_uri()}?mode=rw"
    db = sqlite3.connect(uri, uri=True, timeout=_PATIENCE, isolation_level=None)
    try:
        db.executescript(_SETTINGS)
    except sqlite3.Error:  # it is no database
        db.close()
        raise
    return db


# Errors


@contextmanager
def reported(path: str, *system: type[OSError]) -> Iterator[None]:
    """Turn errors of SQLite, and of the system if ``OSError`` is given, into errors of a study."""
    errors: tuple[type[Exception], ...] = (sqlite3.OperationalError, *system)
    try:
        yield
    except PsiError:
        raise
    except errors as error:
        problem = getattr(error, "strerror", None) or error
        raise StudyAccessError(
            f"study {path} cannot be used: {problem}; see that its folder exists, that you may "
            "write it, that the disk is not full, that the file system has locks, and that no "
            "other program keeps it busy; what was stored before is kept"
        ) from error
    except sqlite3.DatabaseError as error:
        raise unreadable(path, str(error)) from error


@contextmanager
def intact(db: sqlite3.Connection, path: str) -> Iterator[None]:
    """Turn errors of a body that only reads content into those of a damaged study.

    They say what SQLite's own check finds in the file, or else what could not be read.
    """
    try:
        yield
    except PsiError:
        raise
    except (LookupError, TypeError, ValueError) as error:
        (found,) = db.execute("PRAGMA integrity_check(1)").fetchone()
        raise unreadable(path, str(error) if found == "ok" else found) from error


def unreadable(path: str, problem: str) -> StudyCorruptError:
    """Return the error of a file that is no study, or damaged."""
    return StudyCorruptError(
        f"{path} is no study of pymoo-psi, or damaged: {problem:.80}; it was left as it is: "
        "restore it from a copy, or move it away and repeat the runs that it held"
    )


# Locks


@contextmanager
def locked(path: str, run: int, wait: float) -> Iterator[None]:
    """Keep other processes from adding to a run of a study; it may be nested.

    A run has one writer at a time, by a locked file beside the study. The operating system releases
    the lock when its process ends, however it ends.
    """
    lock = f"{path}-run-{run}{_LOCK}"
    # By process, too, since a fork inherits the entries, but not the locks.
    key = (os.getpid(), lock)
    # setdefault is one step: two threads never get a lock each.
    thread_lock = _THREAD_LOCKS.setdefault(key, threading.RLock())
    with thread_lock:
        if key in _HELD:  # nested
            yield
            return
        with _opened(lock, path, wait):
            _HELD.add(key)
            try:
                yield
            finally:
                _HELD.remove(key)
                with suppress(OSError):  # Windows removes no open file
                    os.unlink(lock)


def _opened(lock: str, path: str, wait: float) -> IO[str]:
    """Return the open lock file of a study, locked for this process."""
    deadline = time.monotonic() + wait
    pause = _FIRST_PAUSE
    while True:
        with reported(path, OSError), ExitStack() as closing_file:
            file = closing_file.enter_context(open(lock, "a"))
            # Another process may have it, or have removed it.
            with suppress(BlockingIOError, PermissionError, FileNotFoundError):
                _lock(file.fileno())
                # The name may have passed to another file since this one was opened.
                if os.path.samestat(os.stat(lock), os.fstat(file.fileno())):
                    closing_file.pop_all()
                    return file
        left = deadline - time.monotonic()
        if left <= 0:
            raise StudyLockedError(
                f"study {path} is being written by another process; waited {wait:g} s: "
                "let it finish or stop it, wait longer by study_wait, or use another file"
            )
        # At random times, so that of many processes that began together none is always too late.
        time.sleep(min(left, pause * random.uniform(0.5, 1.5)))
        pause = min(1.5 * pause, _LAST_PAUSE)


def _lock(descriptor: int) -> None:
    """Lock an open file for this process; an OSError says that another process has locked it.

    A fork does not inherit record locks of POSIX, so that no worker keeps the lock of its parent.
    """
    if sys.platform == "win32":
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
