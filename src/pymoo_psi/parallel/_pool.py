"""Worker processes, each of which can be ended alone; they also run the programs of users.

An executor of ``concurrent.futures`` breaks when a worker dies or hangs, or it ends the worker but
not what the model has started in it. Here each worker has its own channel and reports every design
that it finishes. So it is known which design a worker evaluates, and for how long: that design is
recorded, its worker is replaced, and nothing else is affected. ``_worker`` describes how a worker
ends with all that it has started.

Workers are kept for the next run of this process, for some minutes. One that is kept answers as a
new one would: it is used again under the same environment only, and ends where it has another
version of a module than this process.

Why not a library: joblib's loky gives up all tasks when one worker dies, and has no time limit for
one. Pebble has a time limit, replaces a dead worker alone, and adds little time to a task. But a
solver that the model has started outlives its worker; without a fork Pebble imports the main
module, so that a script needs a guard; and it has neither retries nor an end with a killed parent.
The guard and the retries around it would be the larger part of this file and ``_worker``.
"""

from __future__ import annotations

import atexit
import math
import os
import pickle
import shutil
import signal
import socket
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from multiprocessing import Pipe, spawn, util
from pathlib import Path
from time import monotonic, sleep
from typing import Any, NamedTuple

import cloudpickle

from pymoo_psi._modules import accept
from pymoo_psi._validation import Values
from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel import _worker
from pymoo_psi.parallel._evaluation import Answer, Result, Waiting, unloadable

_PATIENCE = 2.0  # seconds in which a worker may end by itself; some hundredths are enough
# Seconds in which a guard may end its worker and all processes that were started there; a busy
# machine may need them. If the guard is killed before, some processes are left behind.
_KILLING = 20.0
# Workers share the cores: in each of them, libraries of linear algebra would start a thread for
# every core, and joblib, in a model that uses it, as many workers.
_THREAD_LIMITS = (
    *(f"{library}_NUM_THREADS" for library in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR")),
    *("VECLIB_MAXIMUM_THREADS", "LOKY_MAX_CPU_COUNT"),
)
_ATTEMPTS = 2  # at a design whose process dies
# Sets of idle workers that are kept. A set has a worker for each core, or the workers of the last
# run if these are more.
_KEPT = 2


def environment_now(identity: tuple[str, bytes], threads: int) -> Values:
    """Return what may change the values of a model besides its code and its arguments.

    Args:
        identity: What the sender says; see :class:`Job`.
        threads: How many threads libraries may use, unless the environment limits them.
    """
    variables = dict.fromkeys(_THREAD_LIMITS, str(threads)) | os.environ
    path = [*sys.path]  # where modules are found
    return {
        "identity": identity,
        "variables": variables,
        "folder": os.getcwd(),
        "imports": (path, [*sys.argv]),
    }


class Job(NamedTuple):
    """What a worker is given at once: designs, or a piece of the points of a vectorised problem.

    Attributes:
        run: The name of the run, which has one function.
        function: The function, pickled.
        identity: Runs may share workers if this is equal: the name of the runner if code is sent by
            value, or else none; and what the problem says that its values depend on, pickled.
        timeout: Seconds that a design may take, or ``None``.
        designs: The designs, or the piece, with their indices. They are the queue's, which takes
            back what is left; workers have a copy.
        seconds: Seconds that the designs may take together. After twice that time, the designs that
            are not begun are left to other workers.
        environment: The environment of the run; ``None`` for that of whoever evaluates the job.
        is_again: Whether it has one design, of a job that an engine gave up.
        free: A semaphore of the workers of this machine that are free for the run; ``None`` where
            others evaluate.
    """

    run: str
    function: bytes
    identity: tuple[str, bytes]
    timeout: float | None
    designs: Waiting
    seconds: float = math.inf
    environment: Values | None = None
    is_again: bool = False
    free: Any = None


_IDLE: list[_Worker] = []  # the last ones at the end
_BUSY: dict[_Worker, str] = {}  # those at work, each on a job of the run of this name
# The last runs of which nobody reads the results; threads at work on one look for it.
_GIVEN_UP: deque[str] = deque(maxlen=256)
_IS_OVER = threading.Event()  # this process ends


def evaluate(job: Job) -> Answer:
    """Evaluate designs in a worker process; what is not begun in the time has no result.

    A design whose process dies is tried once more.

    Raises:
        WorkerError: No worker starts, none can load the function, or two have imported different
            versions of a module.
    """
    environment = job.environment or environment_now(job.identity, threads=1)
    results: list[Result] = []
    versions: dict[str, bytes] = {}
    n_deaths = 0  # of processes at the design that follows the results
    while not _is_given_up(job.run):
        left = [*job.designs][len(results) :]
        with _hired(environment, job.run) as worker:
            if not worker.start(job, left):
                continue
            new_results, end = worker.finish(job, left)
            if new_results:
                accept(versions, worker.versions)  # otherwise the worker ends, too
                results += new_results
                n_deaths = 0
        if not isinstance(end, OSError):
            return results, end, versions
        if not isinstance(end, TimeoutError):
            n_deaths += 1
            if n_deaths < _ATTEMPTS:
                continue
            end = OSError(f"its worker process died ({end}, {n_deaths} times)")
        index, _ = job.designs[len(results)]
        return [*results, (index, end, 0.0)], None, versions
    raise CancelledError


@contextmanager
def _hired(environment: Values, run: str) -> Iterator[_Worker]:
    """Yield a worker that was idle under the environment, or a new one.

    It is idle afterwards if it has not ended.
    """
    for worker in _IDLE[::-1]:
        if worker.environment == environment:
            with suppress(ValueError):  # other threads take them, too
                _IDLE.remove(worker)
                break
    else:
        worker = _Worker(environment)
    _BUSY[worker] = run
    if _is_given_up(run):  # by another thread
        worker.hang_up()
    try:
        yield worker
    except BaseException:
        worker.end()
        raise
    finally:
        _BUSY.pop(worker, None)
    if worker.process.returncode is None:
        _IDLE.append(worker)


def _is_given_up(run: str) -> bool:
    return run in _GIVEN_UP or _IS_OVER.is_set()


def give_up(run: str) -> None:
    """End the workers that are busy with a run, with all that a model has started there."""
    _GIVEN_UP.append(run)
    for worker, busy_with in list(_BUSY.items()):
        if busy_with == run:
            worker.hang_up()


def keep_idle(n_workers: int) -> None:
    """End idle workers but for the last ones."""
    _end(_IDLE[: -_KEPT * max(n_workers, os.cpu_count() or 1)])


def _end(workers: list[_Worker]) -> None:
    """End workers that are not busy; all of them end at the same time."""
    idle = []
    for worker in workers:
        with suppress(ValueError):  # another thread has taken it meanwhile
            _IDLE.remove(worker)
            idle.append(worker)
            worker.send(None)
    patient = monotonic() + _PATIENCE
    for worker in idle:
        worker.end(patient - monotonic())


class _Worker:
    """A worker process as this one sees it.

    Attributes:
        environment: The environment in which it was started.
        process: The process that Popen started: the guard of the one that evaluates.
        channel: The connection to it.
        run: The run whose function it has loaded last; empty if none.
        versions: Those of the modules that it has imported.
    """

    def __init__(self, environment: Values) -> None:
        self.environment = environment
        self.run = ""
        self.versions: dict[str, bytes] = {}
        self.channel, theirs = Pipe()
        # such as -P and -I, which say what may be imported
        flags = util._args_from_interpreter_flags()  # type: ignore[attr-defined]
        command = [spawn.get_executable(), *flags, _worker.__file__]
        with theirs:
            self.process = subprocess.Popen(
                command,
                stdin=theirs.fileno(),
                env=environment["variables"],
                cwd=environment["folder"],
                start_new_session=True,
            )
        # The worker imports from where this process does, but not its main module: what that
        # defines is sent by value, so that a script needs no guard and a notebook works.
        self.send(environment["imports"])

    def start(self, job: Job, designs: Sequence[tuple[int, Any]]) -> bool:
        """Let it evaluate designs, one after the other; return whether it has begun.

        While it loads the function, it has read all that was sent: this process never waits for it.

        Raises:
            WorkerError: It cannot load the function.
        """
        to_load = None
        if self.run != job.run:
            to_load = job.function
        self.send((to_load, deque(designs), job.seconds))
        flaw = self.receive()
        if isinstance(flaw, OSError):
            if self.run:  # a module has changed, or it has waited too long
                return False
            raise unloadable(f"the process ends before ({flaw})")
        if flaw is not None:
            raise flaw
        self.run = job.run
        return True

    def finish(
        self, job: Job, designs: Sequence[tuple[int, Any]]
    ) -> tuple[list[Result], EvaluationError | OSError | None]:
        """Return the results of the first designs that it was sent, and how it has ended.

        Returns:
            The results; and what happened at the next design: its error, or the loss of the
            process; ``None`` if there is no next one, or if it is left to others.
        """
        results: list[Result] = []
        while len(results) < len(designs):
            answer = self.receive(job.timeout)
            if isinstance(answer, dict):
                self.versions = answer
            elif isinstance(answer, tuple):
                results.append(answer)
            else:
                return results, answer
        return results, None

    def send(self, content: Any) -> None:
        """Send a message; a process that is gone is noticed when its answer is read."""
        # by value from __main__, which is another module there
        data = cloudpickle.dumps(content)
        with suppress(OSError):
            self.channel.send_bytes(data)

    def receive(self, timeout: float | None = None) -> Any:
        """Return the next message, or a loss: the process has ended, or no message came in time."""
        try:
            if self.channel.poll(timeout):
                return self.channel.recv()
        except (EOFError, OSError):  # it was closed, or reset
            return OSError(self.end(_PATIENCE))
        self.end()
        return TimeoutError(f"timed out after {timeout:g} s")

    def hang_up(self) -> None:
        """Make the guard kill the process, with what it has started, whatever they do."""
        with suppress(OSError), socket.socket(fileno=os.dup(self.channel.fileno())) as copy:
            copy.shutdown(socket.SHUT_RDWR)  # it reaches the guard though a fork holds it open

    def end(self, patience: float = 0.0) -> str:
        """Let the process end by itself, or kill it after some seconds; return how it ended."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(max(patience, 0.0))
        self.hang_up()
        self.channel.close()
        try:
            self.process.wait(_KILLING)
        except subprocess.TimeoutExpired:  # the guard itself is stuck
            self.process.kill()
            self.process.wait()
        code = self.process.returncode
        if 128 < code < 160:  # a guard reports signals as shells do
            return signal.Signals(code - 128).name
        return f"exit code {code}"


# Programs of users, each run by a worker, which ends it with this process, however that ends.


def run_program(
    words: Sequence[str], folder: Path, timeout: float | None
) -> tuple[int | None, bool]:
    """Run a program in a folder, where its output is written to ``stdout.txt`` and ``stderr.txt``.

    Args:
        words: The program and its arguments; a program that is not on PATH is one in the folder.
        folder: The folder.
        timeout: Seconds that it may take; None for no limit.

    Returns:
        Its exit code, the negative number of a signal, or None if it ran out of time; and whether
        processes that it had started ran on and were killed.

    Raises:
        OSError: The program cannot be started, or its worker was killed.
    """
    program = shutil.which(words[0]) or str(folder / words[0])
    call = [program, *words[1:]], str(folder), timeout, {**os.environ}
    if sys.platform == "win32":
        return _worker.run_program(call)
    function = pickle.dumps((_worker.run_program, {}))
    job = Job("programs", function, ("", b"programs"), None, deque([(0, call)]))
    results, failure, _ = evaluate(job)
    keep_idle(1)
    if failure is not None:
        raise failure.original or failure
    _, end, _ = results[0]
    if isinstance(end, OSError):
        raise end
    code, left_processes = end
    return code, left_processes


@atexit.register
def _end_all() -> None:
    _IS_OVER.set()
    for worker in list(_BUSY):
        worker.hang_up()
    while _BUSY:  # until no thread is at work
        sleep(0.005)
    _end(_IDLE[:])


def _forget() -> None:
    """Leave the workers alone in a fork: they are its parent's."""
    _IDLE.clear()
    _BUSY.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
