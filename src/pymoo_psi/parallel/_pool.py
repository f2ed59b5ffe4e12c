"""A pool of worker processes that can end one evaluation alone, and programs under a guard.

An executor of ``concurrent.futures`` breaks when a worker dies or hangs, or it ends the worker but
not what the model has started in it. Here each worker has its own channel and reports every design
that it finishes. So the pool knows which design a worker evaluates, and for how long: that design
is recorded, its worker is replaced, and nothing else is affected. ``_worker`` describes how a
worker ends with all that it has started.

Why not a library: joblib's loky gives up all tasks when one worker dies, and has no time limit for
one. Pebble has a time limit, replaces a dead worker alone, and adds little time to a task. But a
solver that the model has started outlives its worker; without a fork Pebble imports the main
module, so that a script needs a guard; and it has neither retries nor an end with a killed parent.
The guard and the retries around it would be the larger part of this file and ``_worker``.
"""

from __future__ import annotations

import atexit
import json
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import weakref
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import Pipe, connection, spawn, util
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

import cloudpickle

from pymoo_psi.errors import WorkerError
from pymoo_psi.parallel import _worker
from pymoo_psi.parallel._evaluation import MOMENTS, Cost, Result, Values, Waiting

Lost = Callable[[Any, str], Values]

_PATIENCE = 2.0  # seconds for a worker to end by itself, which takes some hundredths
# Seconds for a guard to end its worker with all that was started there, as many as a busy machine
# may need. Some of it is left behind if the guard is killed before.
_KILLING = 20.0
# Workers share the cores: in each of them, libraries of linear algebra would start a thread for
# every core, and joblib, in a model that uses it, as many workers.
_THREAD_LIMITS = (
    *(f"{library}_NUM_THREADS" for library in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR")),
    *("VECLIB_MAXIMUM_THREADS", "LOKY_MAX_CPU_COUNT"),
)


class ProcessPool:
    """Worker processes that stay alive between runs and are replaced one by one.

    They end with the pool, with the interpreter, and with an error or an interrupt during a run.
    Several runs may go on at the same time: one in another thread, or in a callback that evaluates
    designs while a stream is read.

    """

    def __init__(self) -> None:
        self._own()

    def _own(self) -> None:
        """Begin without workers, in a fork too, which must leave those of its parent alone."""
        self._owner = os.getpid()
        self._idle: list[_Worker] = []
        weakref.finalize(self, _end_all, self._idle, self._owner)

    def run(
        self,
        pickled: bytes,
        lost: Lost,
        waiting: Waiting,
        cost: Cost,
        workers: int,
        timeout: float | None,
        threads: int | None = None,
    ) -> Generator[Result | None]:
        """Evaluate designs; yield the results as they come, and ``None`` after idle moments.

        Args:
            pickled: The function to evaluate, as :func:`pickled_function` returns it.
            lost: Returns the values of a design that was lost, given the reason.
            waiting: The designs, taken when a worker is free; more may be added meanwhile.
            cost: What a design takes, as measured so far; it takes further measurements.
            workers: How many processes to use.
            timeout: Seconds that the evaluation of a design may take; ``None`` for no limit.
            threads: How many threads libraries may use in a worker, unless the environment limits
                them; by default the cores are shared among the workers.

        Raises:
            EvaluationError: A design raised, or was lost and the function has no ``lost``.
            WorkerError: No worker starts, or none can load the function.
        """
        if self._owner != os.getpid():
            self._own()
        if threads is None:
            threads = max(1, (os.cpu_count() or 1) // workers)
        limit = timeout or math.inf
        run = _Run(pickled, lost, waiting, cost, workers, limit, threads, self._idle)
        try:
            yield from run.results()
        except BaseException:
            for worker in run.workers:  # all of them end at the same time
                worker.disconnect()
            _end_all(run.workers, self._owner)
            raise
        self._idle.extend(run.workers)


def _end_all(workers: list[_Worker], owner: int) -> None:
    if os.getpid() == owner:
        for worker in workers:
            worker.send(None)
        patient = monotonic() + _PATIENCE
        while workers:
            workers.pop().end(patient - monotonic())


class _Worker:
    """A worker process as the pool sees it, and the designs that it has.

    Args:
        threads: How many threads libraries may use in it, unless the environment limits them.

    Attributes:
        process: The process that Popen started: the guard of the one that evaluates.
        channel: The connection to it.
        function: The pickled function that was sent to it last.
        loaded: The pickled function that it has loaded.
        designs: The designs that it has, with their indices; it evaluates the first one.
        deadline: When it must have finished this one.
    """

    def __init__(self, threads: int) -> None:
        self.function = b""
        self.loaded = b""
        self.designs: Waiting = deque()
        self.deadline = math.inf
        self.channel, theirs = Pipe()
        # such as -P and -I, which say what may be imported
        flags = util._args_from_interpreter_flags()  # type: ignore[attr-defined]
        command = [spawn.get_executable(), *flags, _worker.__file__]
        environment = dict.fromkeys(_THREAD_LIMITS, str(threads)) | os.environ
        with theirs:
            self.process = subprocess.Popen(
                command,
                stdin=theirs.fileno(),
                env=environment,
                start_new_session=True,
            )
        # The worker imports from where this process does, but not its main module: what that
        # defines is sent by value, so that a script needs no guard and a notebook works.
        self.send((sys.path, sys.argv))

    def evaluate(self, function: bytes, designs: Waiting, timeout: float) -> None:
        """Let it evaluate designs, each within the timeout, by a function that it may have to load.

        While it loads, it has read all that was sent: this process never waits for it.
        """
        self.function = function
        self.designs = designs
        if self.loaded == function:
            self.deadline = monotonic() + timeout
            self.send((None, designs))
        else:
            self.deadline = math.inf
            self.send((function, designs))

    def send(self, content: Any) -> None:
        """Send a message; a process that is gone is noticed when its answer is read."""
        # by value from __main__, which is another module there
        data = cloudpickle.dumps(content)
        with suppress(OSError):
            self.channel.send_bytes(data)

    def receive(self) -> tuple[str, Any]:
        """Return kind and content of the next message; the kind is "died" after its end."""
        try:
            message: tuple[str, Any] = self.channel.recv()
        except (EOFError, OSError):  # closed, or reset
            return "died", None
        return message

    def disconnect(self) -> None:
        """Make the guard kill the process, with what it has started, whatever they do."""
        with suppress(OSError), socket.socket(fileno=os.dup(self.channel.fileno())) as copy:
            copy.shutdown(socket.SHUT_RDWR)  # it reaches the guard though a fork holds it open
        self.channel.close()

    def end(self, patience: float = 0.0) -> str:
        """Let the process end by itself, or kill it after some seconds; return how it ended."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(max(patience, 0.0))
        self.disconnect()
        try:
            self.process.wait(_KILLING)
        except subprocess.TimeoutExpired:  # the guard itself is stuck
            self.process.kill()
            self.process.wait()
        code = self.process.returncode
        if 128 < code < 160:  # a guard reports signals as shells do
            return signal.Signals(code - 128).name
        return f"exit code {code}"


@dataclass
class _Run:
    """One run: which designs wait, which worker has which designs, and which were tried."""

    pickled: bytes
    lost: Lost
    waiting: Waiting
    cost: Cost
    n_workers: int
    timeout: float
    threads: int
    idle: list[_Worker]
    workers: list[_Worker] = field(default_factory=list)
    tried: set[int] = field(default_factory=set)  # designs whose process died once

    def results(self) -> Iterator[Result | None]:
        """Yield the result of every design as it comes, until none waits or is evaluated.

        After a moment without a message, ``None`` is yielded.
        """
        while True:
            n_busy = sum(1 for worker in self.workers if worker.designs)
            n_useful = len(self.waiting) + n_busy
            if n_useful == 0:
                return
            while len(self.workers) < min(self.n_workers, n_useful):
                try:
                    worker = self.idle.pop(0)
                except IndexError:  # other threads take them, too
                    worker = _Worker(self.threads)
                self.workers.append(worker)
            for worker in self.workers:
                if self.waiting and not worker.designs:
                    self._feed(worker)
            now = monotonic()
            seconds_left = min(worker.deadline for worker in self.workers) - now
            channels = [worker.channel for worker in self.workers]
            ready = connection.wait(channels, max(0.0, min(seconds_left, MOMENTS)))
            if not ready:
                yield None
            for worker in list(self.workers):
                if worker.channel in ready:  # what has arrived counts, even if it is read late
                    yield from self._handle(worker, *worker.receive())
                elif now > worker.deadline:
                    yield from self._replace(worker, is_overdue=True)

    def _feed(self, worker: _Worker) -> None:
        size = self.cost.chunk(len(self.waiting), self.n_workers)
        chunk = deque(self.waiting.popleft() for _ in range(size))
        worker.evaluate(self.pickled, chunk, self.timeout)

    def _handle(self, worker: _Worker, kind: str, content: Any) -> Iterator[Result]:
        """Process a message of a worker, or its end."""
        if kind == "ready":
            worker.loaded = worker.function
            worker.deadline = monotonic() + self.timeout
        elif kind == "left":
            self._give_back(worker)
        elif kind == "raised":
            raise content
        elif kind == "unusable":
            raise _cannot_load(content)
        elif kind == "died":
            yield from self._replace(worker)
        else:
            index, design = worker.designs.popleft()
            worker.deadline = math.inf
            if worker.designs:
                worker.deadline = monotonic() + self.timeout
            if kind == "done":
                self.cost.samples.append(content[2])
                # before the result is yielded, as its reader may take a while
                if self.waiting and not worker.designs:
                    self._feed(worker)
                yield content
            else:
                yield index, self.lost(design, content), 0.0

    def _replace(self, worker: _Worker, is_overdue: bool = False) -> Iterator[Result]:
        """End a worker that has died or is overdue; another is hired. One design is lost."""
        self.workers.remove(worker)
        end = worker.end(0.0 if is_overdue else _PATIENCE)
        if not worker.loaded:
            raise _cannot_load(f"the process ends before ({end})")
        was_loading = worker.loaded != worker.function
        if was_loading or not worker.designs:
            self._give_back(worker)
            return
        index, design = worker.designs.popleft()
        self._give_back(worker)
        if is_overdue:
            yield index, self.lost(design, f"timed out after {self.timeout:g} s"), 0.0
        elif index in self.tried:
            reason = f"its worker process died ({end}, 2 times)"
            yield index, self.lost(design, reason), 0.0
        else:
            self.tried.add(index)
            self.waiting.appendleft((index, design))  # it is the next to be evaluated

    def _give_back(self, worker: _Worker) -> None:
        """Let any worker take the designs that one has not begun."""
        self.waiting.extendleft(reversed(worker.designs))
        worker.designs.clear()
        worker.deadline = math.inf


def _cannot_load(reason: str) -> WorkerError:
    return WorkerError(
        f"a worker process cannot load the problem: {reason}; define it in a module that can be "
        "imported, or in the main script"
    )


# Programs of users, each under a guard of its own, which is kept for the next program and ends it
# with this process, however that ends.

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
        _end_guard(guard)
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
        _end_guard(guard)
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


def _end_guard(guard: subprocess.Popen[bytes]) -> None:
    """End a guard with the program that it runs."""
    with guard:  # closes its pipes, which it takes for the sign to end, and waits
        pass


@atexit.register
def _end_idle() -> None:
    while _IDLE.get(os.getpid()):
        _end_guard(_IDLE[os.getpid()].pop())
