"""A worker process, seen from inside: a guard, and its child that evaluates what it is sent.

The pool runs this file as a script. The guard only waits for the end of its child or of the pipe
to the pool, and then kills the child with all that a model has started in it. A thread in the
worker would do but for a model that holds the interpreter's lock in C code; a signal at the death
of the parent (Linux) would come at the end of the thread that started the worker, and not reach
what the model started. On Linux the guard finds these also where they left the worker's group.

Messages to the worker: ``("function", pickled)``, where None is the function it has;
``("designs", Waiting)``; ``("leave", None)``. Messages from it: ``("ready", None)``, or
``("unusable", text)`` for a function that cannot be loaded; for each design, in turn and as soon as
it is done, ``("done", Result)``, ``("raised", error)`` or ``("unsent", text)`` if its values cannot
be; ``("left", None)`` where the designs that are left of a chunk are for others.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import pickle
import select
import signal
import sys
import threading
from multiprocessing import connection
from typing import Any

# From <linux/prctl.h>: a signal at the end of the parent; orphans below become own children.
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36

# A guard that holds nothing but the standard library forks before there are any threads, and
# stays small: so nothing heavy is imported here, nor anything from the current folder.


def main(handle: int) -> None:
    """Serve the other end of an inherited pipe until the pool says so or is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the pool decides what an interrupt means
    os.set_inheritable(handle, False)  # a solver started by the model must not hold it open
    _guard(handle)
    pipe = connection.Connection(handle)
    os.register_at_fork(after_in_child=pipe.close)  # a fork of the model has nothing to say
    sys.path[:], sys.argv[:] = pickle.loads(pipe.recv_bytes())
    with contextlib.suppress(EOFError, OSError):
        _serve(pipe)


def _guard(handle: int) -> None:
    """Fork; return in the child, and in the guard end with the child, as it ended."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    worker = os.fork()
    if worker == 0:
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        return
    os.setpgid(worker, worker)
    threading.Thread(target=_kill_at_hang_up, args=(handle, worker), daemon=True).start()
    pid = 0
    while pid != worker:
        pid, status = os.wait()  # it also reaps what has lost its parent
    _kill_descendants(worker)
    code = os.waitstatus_to_exitcode(status)
    os._exit(code if code >= 0 else 128 - code)  # as shells do


def _kill_at_hang_up(handle: int, worker: int) -> None:
    """Kill the worker when the pool has disconnected or is gone.

    A fork of the pool's process may hold the pipe open; hence the look at the parent's number.
    """
    parent = os.getppid()
    poller = select.poll()
    poller.register(handle, 0)  # 0: a hang-up is always reported, messages are not
    while not poller.poll(1000) and os.getppid() == parent:
        pass
    os.killpg(worker, signal.SIGKILL)


def _kill_descendants(worker: int) -> None:
    """Kill what a dead worker has left: its group and, on Linux, what has left the group."""
    guard = os.getpid()
    while True:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(worker, signal.SIGKILL)
        with contextlib.suppress(OSError), open(f"/proc/{guard}/task/{guard}/children") as file:
            for pid in file.read().split():
                os.kill(int(pid), signal.SIGKILL)
        try:
            os.wait()  # the children of the killed are the guard's next
        except ChildProcessError:
            return


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def _serve(pipe: connection.Connection) -> None:
    # Imported after the fork, and from where the pool imports.
    import cloudpickle

    from pymoo_psi.errors import EvaluationError
    from pymoo_psi.parallel._evaluation import evaluate_chunk, one_line, sendable

    def send(kind: str, content: Any = None) -> None:
        try:
            data = pickle.dumps((kind, content))
        except Exception:  # cloudpickle takes twice as long, and pickles more
            data = cloudpickle.dumps((kind, content))
        pipe.send_bytes(data)

    function: Any = None
    while True:
        kind, content = cloudpickle.loads(pipe.recv_bytes())
        if kind == "leave":
            return
        if kind == "function":
            try:
                function = function if content is None else cloudpickle.loads(content)
            except BaseException as error:  # a module may exit when it is imported
                send("unusable", one_line(error))
            else:
                send("ready")
            continue
        try:
            for result in evaluate_chunk(function, content):
                try:
                    send("done", result)
                except Exception as error:  # before a byte is sent, or as the pool is gone
                    send("unsent", one_line(error))
        except EvaluationError as error:
            send("raised", sendable(error))
        if content:
            send("left")


if __name__ == "__main__":
    main(int(sys.argv[1]))
