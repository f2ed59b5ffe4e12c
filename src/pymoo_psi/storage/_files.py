"""The files of a study: its own, and those that SQLite keeps beside it while it is written."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from pymoo_psi.errors import StudyAccessError

_RESOLUTION = 0.02  # seconds; the clocks of file systems tick every 1 to 10 ms


def require_there(path: str) -> None:
    """Raise unless the study is there.

    Raises:
        StudyAccessError: There is nothing of that name, or no file.
    """
    if not os.path.isfile(path):
        what = "is no file" if os.path.exists(path) else "does not exist"
        raise StudyAccessError(f"study {path} {what}; check the name")


def has_log(path: str) -> bool:
    """Say whether there is a log with anything in it."""
    try:
        return os.path.getsize(f"{path}-wal") > 0
    except FileNotFoundError:
        return False


def stamp_at_rest(path: str) -> tuple[int, ...] | None:
    """Return what changes whenever the file does; None if not all of its content lies in it.

    A file just written may be written again within the resolution of its time; so wait for that.
    """
    stamp = stamp_now(path)
    if stamp is not None and abs(time.time() - stamp[0] / 1e9) < _RESOLUTION:
        time.sleep(_RESOLUTION)
        stamp = stamp if stamp_now(path) == stamp else None
    return stamp


def stamp_now(path: str) -> tuple[int, ...] | None:
    """Return the stamp of :func:`stamp_at_rest` without waiting."""
    if has_log(path) or os.path.exists(f"{path}-journal"):
        return None
    stamp = os.stat(path)
    return stamp.st_mtime_ns, stamp.st_size, stamp.st_ino


def remove(path: str) -> None:
    """Remove a database and what SQLite may have left beside it."""
    for suffix in ("", "-wal", "-shm", "-journal"):
        with suppress(FileNotFoundError):
            os.unlink(path + suffix)


def sync_name(path: str) -> None:
    """Make the name of a new file survive a loss of power."""
    if os.name == "posix":
        folder = os.open(os.path.dirname(path), os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


@contextmanager
def copied(path: str) -> Iterator[str]:
    """Give the path of a copy of study and log, in a folder for the time of the body."""
    with tempfile.TemporaryDirectory() as folder:
        copy = os.path.join(folder, "study")
        for suffix in ("", "-wal"):
            with suppress(FileNotFoundError):
                shutil.copyfile(path + suffix, copy + suffix)
        yield copy
