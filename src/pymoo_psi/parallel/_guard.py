"""Programs under a guard, which ends them with all that they have started.

The guard is a process of its own, see ``_worker``, so that a program ends with this process too,
however it ends. It is kept for the next program.
"""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from multiprocessing import spawn
from pathlib import Path
from typing import Any, NamedTuple

from pymoo_psi.parallel import _worker

# Guards that run no program, by the process that started them: a fork must not use them.
_IDLE: dict[int, list[subprocess.Popen[bytes]]] = {}


class ProgramEnd(NamedTuple):
    """How a program ended.

    Attributes:
        code: Its exit code, the negative number of a signal, or None if it ran out of time.
        left_processes: Whether processes that it had started ran on and were killed.
    """

    code: int | None
    left_processes: bool = False


def run_program(words: Sequence[str], folder: Path, timeout: float | None) -> ProgramEnd:
    """Run a program in a folder, where its output is written to ``stdout.txt`` and ``stderr.txt``.

    Args:
        words: The program and its arguments; a program that is not on PATH is one in the folder.
        folder: The folder.
        timeout: Seconds that it may take; None for no limit.

    Raises:
        OSError: The program cannot be started.
    """
    program = shutil.which(words[0]) or str(folder / words[0])
    request = {
        "words": [program, *words[1:]],
        "folder": str(folder),
        "timeout": timeout,
        "environment": dict(os.environ),
    }
    guard = _guard()
    try:
        answer = _answer(guard, request)
    except BaseException:  # an interrupt, too: the guard ends the program
        _end(guard)
        raise
    _IDLE[os.getpid()].append(guard)
    if "error" in answer:
        raise OSError(answer["error"])
    return ProgramEnd(**answer)


def _guard() -> subprocess.Popen[bytes]:
    """Return a guard that runs no program."""
    idle = _IDLE.setdefault(os.getpid(), [])
    while idle:
        guard = idle.pop()
        if guard.poll() is None:
            return guard
        _end(guard)
    command = [spawn.get_executable(), "-I", "-S", _worker.__file__, "programs"]
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
    )


def _answer(guard: Any, request: dict[str, Any]) -> dict[str, Any]:
    guard.stdin.write(f"{json.dumps(request)}\n".encode())
    guard.stdin.flush()
    line = guard.stdout.readline()
    if not line:
        raise OSError("the guard of the program was killed")
    answer: dict[str, Any] = json.loads(line)
    return answer


def _end(guard: subprocess.Popen[bytes]) -> None:
    """End a guard with the program that it runs."""
    with guard:  # closes its pipes, which it takes for the sign to end, and waits
        pass


@atexit.register
def _end_idle() -> None:
    while _IDLE.get(os.getpid()):
        _end(_IDLE[os.getpid()].pop())
