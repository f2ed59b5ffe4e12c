"""The program of a worker process and of its guard.

The package runs this file as a script: a guard, and its child that evaluates what it is sent. The
guard only waits for the end of its child or of the channel to the pool, and then kills the child
with all that a model has started in it. A thread in the worker could not do so while a model holds
the interpreter's lock in C code. A signal at the death of the parent (Linux) would come at the end
of the thread that started the worker, and would not reach what the model started. On Linux the
guard also finds processes that left the worker's group.

Messages to the worker: the path and the arguments of the program; then a pickled function, or None
for the one that it has, designs, and the seconds that they may take; None at the end. Messages from
it: when it has loaded a function, None, or an error that says why it cannot; for each design, in
turn and as soon as it is done, a ``Result``, after the versions of the users' modules if some were
imported since the last one, a dictionary; last, if designs are left, the error of the one that
raised, or None if it leaves them to other workers.

A worker that has loaded a function before, and cannot load another, ends, as a module that it has
imported may have changed; a new worker then says why it cannot. A worker also ends when it has
waited for some minutes.

A worker also runs the programs of users, one after the other, and ends each with all that it has
started.
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
from time import perf_counter, sleep
from typing import Any

# From <linux/prctl.h>: a signal at the end of the parent; orphans below become own children.
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36

_FIRST_DESCRIPTOR = 200  # of the channel: the first free one from there on; macOS allows 256

# A guard that imports nothing but the standard library forks before there are any threads, and
# stays small: so nothing heavy is imported here, nor anything from the current folder.


def main() -> None:
    """Serve the other end of the socket that is the standard input until the pool is gone."""
    import fcntl
    import resource

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the pool decides what an interrupt means
    _guard()
    from multiprocessing.connection import Connection

    # A model that writes into descriptors, or closes those that it does not know, as daemons do,
    # begins with the first.
    most, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    first = min(_FIRST_DESCRIPTOR, most - 1)
    channel = Connection(fcntl.fcntl(0, fcntl.F_DUPFD_CLOEXEC, first))
    # Nor does a solver that the model starts hold it open, or a fork of the model.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.register_at_fork(after_in_child=channel.close)
    with contextlib.suppress(EOFError, OSError):
        _serve(channel)


def _guard() -> None:
    """Fork; return in the child, and in the guard end with the child, as it ended."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    worker = os.fork()
    if worker == 0:
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        return
    os.setpgid(worker, worker)
    threading.Thread(target=_kill_at_hang_up, args=(worker,), daemon=True).start()
    pid = 0
    while pid != worker:
        pid, status = os.wait()  # it also reaps what has lost its parent
    _kill_descendants(worker)
    code = os.waitstatus_to_exitcode(status)
    if code < 0:  # a signal, reported as shells do
        code = 128 - code
    os._exit(code)


def _kill_at_hang_up(worker: int) -> None:
    """Kill the worker when the pool has disconnected or is gone.

    A fork of the parent may hold the pipe open; therefore the parent's number is checked.
    """
    parent = os.getppid()
    poller = select.poll()
    poller.register(0, 0)  # a hang-up of the standard input is always reported, messages are not
    while not poller.poll(1000) and os.getppid() == parent:
        pass
    with contextlib.suppress(ProcessLookupError, PermissionError):  # it has ended by itself
        os.killpg(worker, signal.SIGKILL)


def _kill_descendants(group: int) -> None:
    """Kill a process group and all children, on Linux orphans below them too."""
    guard = os.getpid()
    while True:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(group, signal.SIGKILL)
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


# Programs of users

_GRACE = 1.0  # seconds in which processes that a program has started may end


def run_program(call: tuple[list[str], str, float | None, dict[str, str]]) -> tuple[Any, bool]:
    """Run a program in a worker process, and kill all that it has started.

    Args:
        call: Its words, its folder, the seconds that it may take, and its environment.

    Returns:
        Its exit code, None after a timeout; and whether processes that it had started ran on.
    """
    import subprocess

    words, folder, timeout, environment = call
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    out = os.path.join(folder, "stdout.txt")
    err = os.path.join(folder, "stderr.txt")
    with open(out, "wb") as stdout, open(err, "wb") as stderr:
        process = subprocess.Popen(
            words,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=stderr,
            start_new_session=True,
        )
    code = None
    with contextlib.suppress(subprocess.TimeoutExpired):
        code = process.wait(timeout)
    if not hasattr(os, "killpg"):
        process.kill()
        return code, False
    left_processes = code is not None and _is_running(process.pid)
    _kill_descendants(process.pid)
    process.wait()
    return code, left_processes


def _is_running(group: int) -> bool:
    """Whether processes of a program that has ended are still running after a moment."""
    end = perf_counter() + _GRACE
    while perf_counter() < end:
        try:
            pid, _ = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:  # there are none, or the system gives orphans to others
            try:
                os.killpg(group, 0)
            except OSError:
                return False
            pid = 0
        if pid == 0:
            sleep(0.005)
    return True


_LINGERING = 300.0  # seconds in which a worker waits for work before it ends


def _serve(channel: Any) -> None:
    sys.path[:], sys.argv[:] = channel.recv()
    # Imported after the fork, and from where the pool imports.
    import cloudpickle

    from pymoo_psi._modules import versions
    from pymoo_psi.errors import EvaluationError, WorkerError
    from pymoo_psi.parallel._evaluation import (
        evaluate_here,
        loaded_function,
        sendable,
        sendable_result,
    )

    def send(message: Any) -> None:
        channel.send_bytes(cloudpickle.dumps(message))

    function: Any = None
    n_modules = 0
    while channel.poll(_LINGERING):
        message = channel.recv()
        if message is None:
            return
        pickled, designs, lasting = message
        if pickled is not None:
            try:
                function = loaded_function(pickled)
            except WorkerError as error:
                if function is None:  # or else a module has perhaps changed
                    send(error)
                return
        send(None)
        try:
            end = perf_counter() + 2 * lasting  # the rest is for others
            for result in evaluate_here(function, designs, end):
                if len(sys.modules) != n_modules:
                    n_modules = len(sys.modules)
                    send(versions())
                try:
                    data = pickle.dumps(result)
                except Exception:  # cloudpickle takes twice as long, and pickles more
                    data = cloudpickle.dumps(sendable_result(result))
                channel.send_bytes(data)
        except EvaluationError as error:
            send(sendable(error))
        else:
            if designs:
                send(None)


if __name__ == "__main__":
    main()
