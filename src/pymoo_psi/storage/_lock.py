"""One writer of a study at a time: a lock beside it, a file that says who its owner is.

The operating system releases the lock when its process ends, however it ends. The threads of a
process take turns. A file of the lock's name with anything else in it is left alone, and the study
is not written.
"""

from __future__ import annotations

import os
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Any

from pymoo_psi.errors import StudyAccessError, StudyLockedError
from pymoo_psi.storage._database import told

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_SUFFIX = ".pymoo-psi-lock"  # behind the name of the study; nobody else uses it
_MARK = "pymoo-psi study in use by "  # how every lock begins
_SIZE = 512  # bytes of a lock: all are written at once, over those of an owner that was killed
_PAUSE = 0.05  # seconds between two attempts


@dataclass
class _Turn:
    """Whose turn it is among the threads of this process, and the lock it has meanwhile."""

    thread: Any = field(default_factory=threading.RLock)
    depth: int = 0
    descriptor: int = -1


# By process too: a fork inherits the entries, but not the locks.
_TURNS: dict[tuple[int, str], _Turn] = {}


@contextmanager
def locked(path: str, wait: float) -> Iterator[None]:
    """Be the only process and thread that writes a study while the body runs; may be nested.

    Args:
        path: The study file.
        wait: Seconds to wait for another process. Threads of this one wait for each other as
            long as it takes.

    Raises:
        StudyLockedError: Another process is still writing; the message says which.
        StudyAccessError: Another file has the lock's name, or the folder cannot be written.
    """
    # setdefault is one step: between a test and an assignment another thread could come, and both
    # would have a turn of their own.
    turn = _TURNS.setdefault((os.getpid(), path), _Turn())
    with turn.thread:
        if turn.depth == 0:
            turn.descriptor = _taken(path, wait)
        turn.depth += 1
        try:
            yield
        finally:
            turn.depth -= 1
            if turn.depth == 0:
                _release(path + _SUFFIX, turn.descriptor)


def _taken(path: str, wait: float) -> int:
    """Return the descriptor of the lock, whose owner is this process now."""
    deadline = time.monotonic() + wait
    while True:
        with told(path + _SUFFIX):
            found = _attempt(path + _SUFFIX)
        if not isinstance(found, str):
            return found
        if time.monotonic() >= deadline:
            raise StudyLockedError(
                f"study {path} is being written by {found}; waited {wait:g} s: "
                "let it finish or stop it, wait longer, or use another file"
            )
        time.sleep(_PAUSE)


def _attempt(lock: str) -> int | str:
    """Return the descriptor of the lock, or who has it."""
    descriptor = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
    with ExitStack() as opened:
        opened.callback(os.close, descriptor)
        text = os.read(descriptor, _SIZE).decode("utf-8", "replace")
        if text and not text.startswith(_MARK):
            raise StudyAccessError(
                f"{lock} must be free for the lock of a study, but it is another file; it was left "
                "as it is: move it away, or give the study another name"
            )
        mine = False
        with suppress(FileNotFoundError):
            # The name may have passed to another file since this one was opened.
            mine = _lock(descriptor) and os.path.samestat(os.stat(lock), os.fstat(descriptor))
        if not mine:
            return text.removeprefix(_MARK).strip() or "another process"
        since = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
        owner = f"{_MARK}process {os.getpid()} on {socket.gethostname()} since {since}"
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, f"{owner:{_SIZE - 1}}\n".encode()[:_SIZE])
        opened.pop_all()  # it stays open as long as it is owned
        return descriptor


def _lock(descriptor: int) -> bool:
    """Lock an open file for this process, unless another has done so.

    Locks of POSIX records, as SQLite's own: a fork does not inherit them, so that no worker which
    outlives its parent keeps them.
    """
    try:
        if sys.platform == "win32":
            os.lseek(descriptor, _SIZE, os.SEEK_SET)  # what lies before can still be read
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True


def _release(lock: str, descriptor: int) -> None:
    # Others that have the file open find that it lost its name, and begin anew. Windows removes
    # no open file; there it goes when nobody has it open.
    if sys.platform == "win32":
        os.close(descriptor)
        with suppress(OSError):
            os.unlink(lock)
    else:
        with suppress(OSError):
            os.unlink(lock)
        os.close(descriptor)
