"""What goes wrong with a file, said in our words: which file, what happened, what to do."""

from __future__ import annotations

import errno
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager

from pymoo_psi.errors import StudyAccessError, StudyCorruptError, StudyError, StudyLockedError

_KEPT = "what was committed before is still there"
_DISK = f"make room, then run again: {_KEPT}"
_RIGHTS = "check that its folder exists and that you may write the folder and the file"

# SQLite's own texts, since Python 3.10 does not show its error codes.
_ACCESS = {
    "database or disk is full": f"the disk is full; {_DISK}",
    "disk I/O error": f"the disk or its quota is full, or the device failed; {_DISK}",
    "readonly database": f"it is read-only; {_RIGHTS}",
    "unable to open database file": f"it cannot be opened; {_RIGHTS}",
}
_ERRNO = {
    errno.ENOSPC: f"the disk is full; {_DISK}",
    errno.EDQUOT: f"the disk's quota is full; {_DISK}",
    errno.EFBIG: f"the file may not grow; {_DISK}",
}


def corrupt(path: str, what: str) -> StudyCorruptError:
    """Compose the error for a damaged study; the caller raises it."""
    return StudyCorruptError(
        f"study {path} is damaged: {what}; it was left as it is: restore it from a copy, "
        "or begin a study in another file"
    )


def foreign(path: str, what: str) -> StudyCorruptError:
    """Compose the error for a file that never was a study; the caller raises it."""
    return StudyCorruptError(
        f"{path} must be a study file of pymoo-psi, but it is {what}; it was left as it is: "
        "give the name of another file"
    )


@contextmanager
def translated(path: str) -> Iterator[None]:
    """Turn the errors of SQLite and the system in the body into ours, which name the file.

    Raises:
        StudyLockedError: The file is busy.
        StudyAccessError: It cannot be opened, read or written.
        StudyCorruptError: It is damaged, or not a database.
    """
    try:
        yield
    except StudyError:
        raise
    except (sqlite3.ProgrammingError, sqlite3.InterfaceError):
        raise  # a mistake of ours
    except sqlite3.Error as error:
        raise _from_sqlite(path, error) from error
    except UnicodeDecodeError as error:  # SQLite quotes damaged text in its message
        raise corrupt(path, "its text cannot be decoded") from error
    except OSError as error:
        text = _ERRNO.get(error.errno or 0, f"{error.strerror}; {_RIGHTS}")
        raise StudyAccessError(f"study {path} cannot be used: {text}") from error


def _from_sqlite(path: str, error: sqlite3.Error) -> StudyError:
    text = str(error)
    if "is locked" in text:
        return StudyLockedError(
            f"study {path} is kept busy by another program; close that program, then run again"
        )
    if "not a database" in text:
        return foreign(path, "none, or its first bytes are damaged")
    for known, meaning in _ACCESS.items():
        if known in text:
            return StudyAccessError(f"study {path} cannot be used: {meaning}")
    return corrupt(path, f"{text:.80}")
