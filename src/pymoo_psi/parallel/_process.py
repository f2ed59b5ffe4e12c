"""A worker process, seen from its parent: started, fed, killed, its end explained."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from multiprocessing import connection
from typing import Any

import cloudpickle

from pymoo_psi.parallel._worker import end_group

# The worker imports from where the parent does, but not the parent's main module: what that
# defines travels by value, so that a script needs no guard and a notebook works.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[2]); "
    "from pymoo_psi.parallel._worker import main; main(int(sys.argv[1]))"
)
_THREAD_LIMITS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_PATIENCE = 2.0  # seconds that an idle worker has to leave by itself


class WorkerProcess:
    """A running worker process and the pipe to it.

    Args:
        threads: How many threads the libraries of linear algebra may use in it, unless the
            environment says so already.

    Attributes:
        pipe: Where it is talked to.
        pid: Its process number.
        proven: Whether it has begun an evaluation.
    """

    def __init__(self, threads: int) -> None:
        self.pipe, theirs = connection.Pipe()
        self.proven = False
        self._loaded = b""
        environment = {name: str(threads) for name in _THREAD_LIMITS} | os.environ
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _BOOT, str(theirs.fileno()), json.dumps(sys.path)],
                stdin=subprocess.DEVNULL,
                env=environment,
                **_inheriting(theirs.fileno()),
            )
        finally:
            theirs.close()
        self.pid = self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    def load(self, function: bytes) -> None:
        """Send a pickled function unless the worker has it."""
        if function != self._loaded:
            self._send(("function", function))
            self._loaded = function

    def give(self, designs: list[tuple[int, Any]]) -> None:
        """Send numbered designs to evaluate."""
        self._send(("designs", designs))

    def receive(self) -> tuple[Any, ...]:
        """Return the next message.

        Raises:
            EOFError: The process has ended.
        """
        try:
            message: tuple[Any, ...] = cloudpickle.loads(self.pipe.recv_bytes())
        except OSError as error:  # reset instead of closed
            raise EOFError from error
        return message

    def kill(self) -> None:
        """End the process and what it has started, whatever they do."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            end_group(self.pid)
        self._process.wait()
        self.pipe.close()

    def leave(self) -> None:
        """Let an idle process end by itself; kill it if it does not."""
        self.pipe.close()
        try:
            self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self.kill()

    def end(self) -> str:
        """Return how the process, which has closed its pipe, came to its end."""
        try:
            code = self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            code = 0
        self.kill()
        if code >= 0:
            return f"exit code {code}"
        try:
            return signal.Signals(-code).name
        except ValueError:
            return f"signal {-code}"

    def _send(self, message: tuple[str, Any]) -> None:
        # A process that is gone is noticed when it is waited for.
        with contextlib.suppress(OSError):
            self.pipe.send_bytes(cloudpickle.dumps(message))


def _inheriting(handle: int) -> dict[str, Any]:
    """Return the options of ``Popen`` for one inherited handle and a group of its own."""
    if sys.platform == "win32":
        os.set_handle_inheritable(handle, True)
        return {
            "startupinfo": subprocess.STARTUPINFO(lpAttributeList={"handle_list": [handle]}),
            "creationflags": subprocess.CREATE_NEW_PROCESS_GROUP,
        }
    return {"pass_fds": (handle,), "start_new_session": True}
