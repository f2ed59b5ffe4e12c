"""Worker processes of our own, for what an executor cannot do: end one evaluation alone.

An executor treats a worker that dies or hangs as its own end. Here each worker has its own pipe
and tells every design it finishes, so the parent knows which design a worker is at and for how
long: that one is recorded, its worker is replaced, and nothing else is touched.
"""

from __future__ import annotations

import math
import os
import threading
import weakref
from collections import deque
from multiprocessing import connection
from time import monotonic
from typing import Any

import cloudpickle

from pymoo_psi.errors import WorkerError
from pymoo_psi.parallel._chunks import Cost, chunk_size
from pymoo_psi.parallel._outcome import Function, Values, lost_design, one_line, raise_again
from pymoo_psi.parallel._process import WorkerProcess

_POLL = 1.0  # seconds after which a worker is looked at even if its pipe is silent
_FALSE_STARTS = 2  # of new workers, after which the problem is to blame


class ProcessPool:
    """Worker processes that stay alive between batches and are replaced one by one.

    They end with the pool, with the interpreter, and with an error or an interrupt amid a batch.
    """

    def __init__(self) -> None:
        self._idle: list[WorkerProcess] = []
        self._lock = threading.Lock()
        self.cost = Cost()
        weakref.finalize(self, _dismiss, self._idle, os.getpid())

    @property
    def pids(self) -> list[int]:
        """The process numbers of the waiting workers."""
        return [worker.pid for worker in self._idle]

    def run(
        self,
        function: Function,
        designs: list[Any],
        *,
        workers: int,
        timeout: float = math.inf,
        retries: int = 1,
    ) -> list[Values]:
        """Evaluate designs and return their values in the same order.

        Args:
            function: What to evaluate; it is pickled, from ``__main__`` by value.
            designs: The designs.
            workers: How many processes to use.
            timeout: Seconds that the evaluation of a design may take.
            retries: How many times a design whose process died is tried again.

        Raises:
            EvaluationError: A design raised, or was lost and the function has no ``lost``.
            WorkerError: The function cannot be sent, or no worker starts.
        """
        try:
            pickled = cloudpickle.dumps(function)
        except Exception as error:
            raise WorkerError(
                f"the problem cannot be sent to worker processes: {one_line(error)}; keep open "
                "files, locks and connections out of it, or run it without workers"
            ) from error
        with self._lock:
            threads = max(1, (os.cpu_count() or 1) // workers)
            batch = _Batch(function, pickled, designs, workers, timeout, retries, self.cost)
            try:
                batch.run(self._idle, threads)
            except BaseException:
                for seat in batch.seats:
                    seat.worker.kill()
                raise
            self._idle.extend(seat.worker for seat in batch.seats)
        return batch.results

    def close(self) -> None:
        """End the workers; the next batch starts new ones."""
        _dismiss(self._idle, os.getpid())


def _dismiss(idle: list[WorkerProcess], owner: int) -> None:
    if os.getpid() == owner:  # not in a fork of the process that started them
        while idle:
            idle.pop().leave()


class _Seat:
    """A place in a batch: the worker in it now, its designs and since when it is at the first."""

    def __init__(self, worker: WorkerProcess) -> None:
        self.worker = worker
        self.begun = False
        self.at: deque[int] = deque()
        self.since = math.inf


class _Batch:
    """One call: which designs wait, which are under way where, and what came of the others."""

    def __init__(
        self,
        function: Function,
        pickled: bytes,
        designs: list[Any],
        workers: int,
        timeout: float,
        retries: int,
        cost: Cost,
    ) -> None:
        self.function, self.pickled, self.designs = function, pickled, designs
        self.workers, self.timeout, self.retries, self.cost = workers, timeout, retries, cost
        self.results: list[Any] = [None] * len(designs)
        self.seats: list[_Seat] = []
        self.waiting = deque(range(len(designs)))
        self.again: deque[int] = deque()  # designs whose worker died, each tried alone
        self.deaths = [0] * len(designs)
        self.missing = len(designs)
        self.false_starts = 0

    def run(self, idle: list[WorkerProcess], threads: int) -> None:
        for _ in range(min(self.workers, self.missing)):
            worker = idle.pop(0) if idle else WorkerProcess(threads)
            self.seats.append(_Seat(worker))
        while self.missing:
            for seat in self.seats:
                if not seat.at and (self.again or self.waiting):
                    self._feed(seat, threads)
            for seat in self._talking():
                self._listen(seat, threads)
            for seat in self.seats:
                if monotonic() - seat.since > self.timeout and not seat.worker.pipe.poll():
                    self._overdue(seat, threads)
                elif seat.at and not seat.worker.alive and not seat.worker.pipe.poll():
                    self._died(seat, threads)

    def _feed(self, seat: _Seat, threads: int) -> None:
        if not seat.worker.alive:  # it died while it was waiting: no design is to blame
            seat.worker.kill()
            seat.worker = WorkerProcess(threads)
        if self.again:
            chunk = [self.again.popleft()]
        else:
            size = chunk_size(len(self.waiting), self.workers, self.cost.seconds)
            chunk = [self.waiting.popleft() for _ in range(size)]
        seat.at = deque(chunk)
        seat.begun = False  # to start and to load is not to evaluate
        seat.worker.load(self.pickled)
        seat.worker.give([(index, self.designs[index]) for index in chunk])

    def _talking(self) -> list[_Seat]:
        """Wait for messages, at most until the next evaluation is overdue."""
        busy = [seat for seat in self.seats if seat.at]
        due = min(seat.since for seat in busy) + self.timeout
        pipes = [seat.worker.pipe for seat in busy]
        talking = connection.wait(pipes, max(0.0, min(_POLL, due - monotonic())))
        return [seat for seat in busy if seat.worker.pipe in talking]

    def _listen(self, seat: _Seat, threads: int) -> None:
        try:
            kind, *content = seat.worker.receive()
        except EOFError:
            self._died(seat, threads)
            return
        seat.since = monotonic()
        if kind == "begun":
            seat.begun = True
            seat.worker.proven = True
        elif kind == "done":
            index, values, seconds = content
            self.cost.add(1, seconds)
            self._settle(seat, values)
        elif kind == "lost":
            index, reason = content
            self._settle(seat, lost_design(self.function, self.designs[index], reason))
        elif kind == "raised":
            index, error = content
            error.design = self.designs[index]
            raise_again(type(error)(error.design, error.reason, error.original, error.trace))
        else:
            raise WorkerError(
                f"a worker process cannot load the problem: {content[0]}; define it in a module "
                "that can be imported, or in the main script"
            )

    def _settle(self, seat: _Seat, values: Values) -> None:
        self.results[seat.at.popleft()] = values
        self.missing -= 1
        if not seat.at:
            seat.since = math.inf

    def _overdue(self, seat: _Seat, threads: int) -> None:
        design = self.designs[seat.at[0]]
        self._settle(
            seat, lost_design(self.function, design, f"timed out after {self.timeout:g} s")
        )
        seat.worker.kill()
        self._replace(seat, threads)

    def _died(self, seat: _Seat, threads: int) -> None:
        how = seat.worker.end()
        if not seat.begun:  # no design is to blame
            self.false_starts += not seat.worker.proven
            if self.false_starts >= _FALSE_STARTS:
                raise WorkerError(
                    f"worker processes end before they begin ({how}); see what they print, "
                    "or run the problem without workers"
                )
        else:
            index = seat.at.popleft()
            self.deaths[index] += 1
            if self.deaths[index] <= self.retries:
                self.again.append(index)
            else:
                times = f", {self.deaths[index]} times" if self.deaths[index] > 1 else ""
                reason = f"its worker process died ({how}{times})"
                self.results[index] = lost_design(self.function, self.designs[index], reason)
                self.missing -= 1
        self._replace(seat, threads)

    def _replace(self, seat: _Seat, threads: int) -> None:
        """Give the seat a new worker and what the old one had still to do back to all."""
        self.waiting.extendleft(reversed(seat.at))
        seat.at.clear()
        seat.since = math.inf
        seat.worker = WorkerProcess(threads)
