"""What keeps a study intact: errors that name the damage, and a lock for each run."""

from __future__ import annotations

import os
import random
import sqlite3
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import IO, Any

from pymoo_psi.errors import PsiError, StudyAccessError, StudyCorruptError, StudyLockedError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_LOCK = ".pymoo-psi-lock"  # appended to the name of a study, for its first run
# The ends of the names of files that SQLite, and this package, keep beside a study and delete.
BESIDE = ("-journal", "-wal", "-shm", _LOCK)
# Seconds between two attempts to lock a study, the first ones and the later ones: hundreds of
# writers must not keep a shared file system busy.
_FIRST_PAUSE, _LAST_PAUSE = 0.02, 0.3

# By process and lock file: the lock among the threads, and which locks the process holds.
_THREAD_LOCKS: dict[tuple[int, str], Any] = {}
_HELD: set[tuple[int, str]] = set()

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
            "write it, that the disk is not full, and that no other program keeps it busy; what "
            "was stored before is kept"
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
        problem = str(error) if found == "ok" else found
        raise unreadable(path, problem) from error


def require_no_trigger(db: sqlite3.Connection, path: str) -> None:
    """Refuse a study with a trigger, which SQLite would run when a test is written."""
    query = "SELECT name FROM sqlite_master WHERE type = 'trigger'"
    for (name,) in db.execute(query):
        raise StudyCorruptError(
            f"study {path} has the trigger {name}, which would change what a run stores; it was "
            f'left as it is: remove the trigger (DROP TRIGGER "{name}")'
        )


def unreadable(path: str, problem: str) -> StudyCorruptError:
    """Return the error of a file that is no study, or damaged."""
    return StudyCorruptError(
        f"{path} is no study of pymoo-psi, or damaged: {problem:.80}; it was left as it is: "
        "restore it from a copy, or move it away and repeat the runs that it held"
    )


# Databases of other programs by a table that they have, and how to export it.
_OTHERS = {
    "trial_values": (
        "Optuna",
        "optuna.load_study(study_name=None, storage='sqlite:///FILE').trials_dataframe()"
        ".to_csv('trials.csv')",
    ),
    "driver_iterations": (
        "OpenMDAO",
        "pandas.DataFrame([{**case.get_design_vars(), **case.get_objectives()} for case in "
        "openmdao.api.CaseReader('FILE').get_cases('driver')]).map(numpy.squeeze)"
        ".to_csv('cases.csv')",
    ),
}


def of_others(path: str, tables: Sequence[str]) -> StudyCorruptError:
    """Return the error of a database of another program."""
    program = f"another program, with the tables {', '.join(tables):.80}"
    export = f"sqlite3 -header -csv FILE 'SELECT * FROM {tables[0]}' > designs.csv"
    for table, known in _OTHERS.items():
        if table in tables:
            program, export = known
    return StudyCorruptError(
        f"{path} is no study of pymoo-psi, but a database of {program}; it was left as it is: "
        f"export it as CSV by "
        f"{export.replace('FILE', path)}"
    )


# Locks


@contextmanager
def locked(path: str, run: int, wait: float) -> Iterator[None]:
    """Keep other processes from adding to a run of a study; it may be nested.

    A run has one writer at a time, by a locked file beside the study. The operating system releases
    the lock when its process ends, however it ends.
    """
    lock = path + _LOCK
    if run > 1:
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
        with reported(path, OSError):
            file = open(lock, "a")  # noqa: SIM115
        try:
            _lock(file.fileno())
            # The name may have passed to another file since this one was opened.
            if os.path.samestat(os.stat(lock), os.fstat(file.fileno())):
                return file
        except (BlockingIOError, PermissionError, FileNotFoundError):
            pass  # another process has it, or has removed it
        except OSError as error:
            file.close()
            raise StudyAccessError(
                f"study {path} cannot be used: its file system refuses locks ({error.strerror}), "
                "without which two processes could write at once; mount it with locks, or put the "
                "study on another file system"
            ) from error
        file.close()
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
