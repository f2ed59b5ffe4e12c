"""Runs on a cluster: the share of the workers' time, what is lost with them, a thousand workers.

    python -m benchmarks.cluster [shares] [kills] [writers] [thousand]

``shares``: 8 and 16 workers of Dask in processes of their own, over TCP. A design takes 0.2 s,
exponentially distributed, asleep, so that a few cores suffice. In turns, 240 designs by Dask alone
as they are completed, and by PSI with a study; then SurrogatePSI with designs of 1 s. The share is
what the designs take together, divided by what the workers have. Tables must be those of a serial
run.

``kills``: three of eight workers are killed during a run; workers join; the driver is killed twice
and called again; two drivers use one study. Tables must be those of a serial run; repeated
evaluations are counted.

``writers``: 64, then 200 processes that add tests to one study at the same time.

``thousand``: SurrogatePSI on a simulated executor of 1000 workers, where a design takes 10 s, in
real time; the simulated workers take no time of the processor. Every ten seconds it prints the
share of their time that is used, and how many designs end in a second.
"""

from __future__ import annotations

import heapq
import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cloudpickle
import numpy as np
from distributed import Client, as_completed
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, sized
from pymoo_psi import PSI, ExecutorRunner, PsiError, SurrogatePSI, investigate, read_table

N = sized(240, 24)
MEAN = sized(0.2, 0.05)  # seconds of a design
SLOW_MEAN = sized(1.0, 0.05)  # of a design that SurrogatePSI proposes
ROUNDS = sized(3, 1)
WORKERS = sized(8, 3)  # of which some are killed
KILLED = sized(3, 1)
ENDS = sized((signal.SIGKILL, signal.SIGKILL, signal.SIGINT), (signal.SIGKILL,))  # of drivers


class Asleep(ElementwiseProblem):
    """Two objectives; a design sleeps for an exponentially distributed time that follows from it.

    Args:
        mean: Its mean in seconds.
        log: Name of a file that gets a line for each evaluation.
    """

    def __init__(self, mean: float = 0.0, log: str | None = None, **kwargs: Any) -> None:
        super().__init__(n_var=4, n_obj=2, xl=0, xu=1, **kwargs)
        self.mean = mean
        self.log = log

    def fingerprint(self) -> dict[str, Any]:
        """Say that the arguments change no value."""
        return {}

    def seconds(self, x: Any) -> Any:
        """Return what designs take."""
        return -self.mean * np.log1p(-((np.asarray(x) @ [7919.13, 31.7, 577.1, 1.3]) % 1))

    def _evaluate(self, x: Any, out: Any, *args: Any, **kwargs: Any) -> None:
        if self.log is not None:
            with open(self.log, "a") as file:
                file.write(f"{x.tolist()}\n")
        time.sleep(self.seconds(x))
        out["F"] = [x[0] + ((x[1:] - 0.3) ** 2).sum(), 1 - x[0] + (x[2:] ** 2).sum()]


class Timed(Asleep):
    """Designs that write into the log when they begin and end."""

    def _evaluate(self, x: Any, out: Any, *args: Any, **kwargs: Any) -> None:
        log, self.log = self.log, None
        begin = time.time()
        super()._evaluate(x, out)
        with open(log, "a") as file:
            file.write(f"{begin} {time.time()}\n")
        self.log = log


def alone(problem: Asleep, x: Any) -> Any:
    """Return the objectives of a design, by Dask alone."""
    out: dict[str, Any] = {}
    problem._evaluate(x, out)
    return out["F"]


class Processes:
    """A scheduler of Dask and its workers."""

    def __init__(self, n_workers: int) -> None:
        self.folder = tempfile.mkdtemp()
        self.file = f"{self.folder}/scheduler.json"
        self.all = [self._started("dask_scheduler", "--port", "0")]
        while not os.path.exists(self.file):
            time.sleep(0.05)
        for _ in range(n_workers):
            self.join()

    def join(self) -> None:
        """Start another worker."""
        options = ["--nthreads", "1", "--no-nanny", "--local-directory", self.folder]
        self.all.append(self._started("dask_worker", *options))

    def _started(self, module: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{module}", "--no-dashboard"]
        command += ["--scheduler-file", self.file, *options]
        return subprocess.Popen(command, stderr=subprocess.DEVNULL)


@contextmanager
def cluster(n_workers: int) -> Iterator[tuple[Processes, Client]]:
    """Yield processes and a client of them; they end with the body."""
    processes = Processes(n_workers)
    try:
        with Client(scheduler_file=processes.file) as client:
            client.wait_for_workers(n_workers)
            yield processes, client
    finally:
        for process in processes.all:
            process.kill()
            process.wait()


def new_study() -> str:
    return tempfile.mkdtemp() + "/study.db"


def shares(n_workers: int) -> None:
    """Print shares of the workers' time."""
    serial = investigate(Asleep(), N)
    taken = Asleep(MEAN).seconds(serial.X).sum() / n_workers
    with cluster(n_workers) as (_, client):
        runner = ExecutorRunner(client)
        problem = Asleep(MEAN, elementwise_runner=runner)
        designs = list(serial.X)
        client.gather(client.map(alone, [Asleep(MEAN)] * 2 * n_workers, designs[: 2 * n_workers]))
        investigate(problem, 4 * n_workers)  # which starts the processes of the workers
        best = Counter()
        for _ in range(ROUNDS):
            began = time.perf_counter()
            for future in as_completed(client.map(alone, [Asleep(MEAN)] * N, designs, pure=False)):
                future.result()
            best["dask"] = max(best["dask"], taken / (time.perf_counter() - began))
            began = time.perf_counter()
            table = minimize(problem, PSI(N, study=new_study())).algorithm.table
            best["psi"] = max(best["psi"], taken / (time.perf_counter() - began))
            assert table.equals(serial), "not the table of a serial run"
        print(
            f"{n_workers} workers: Dask alone {best['dask']:.2f}, PSI with a study "
            f"{best['psi']:.2f}, ratio {best['psi'] / best['dask']:.2f}",
            flush=True,
        )
        log = new_study() + ".log"
        problem = Timed(SLOW_MEAN, log, elementwise_runner=runner)
        n_tests = 20 * n_workers
        minimize(problem, SurrogatePSI(n_tests, study=new_study()))
        # after the start, before the end, where workers run out of designs
        rows = Path(log).read_text().splitlines()
        lines = sorted(tuple(map(float, row.split())) for row in rows)
        first, last = lines[n_tests // 4][0], lines[3 * n_tests // 4][0]
        used = sum(max(0.0, min(end, last) - max(begin, first)) for begin, end in lines)
        share = used / (last - first) / n_workers
        print(
            f"{n_workers} workers: SurrogatePSI, {n_tests} designs of {SLOW_MEAN:g} s: {share:.2f}",
            flush=True,
        )


DRIVER = """
import sys
from distributed import Client
from benchmarks.cluster import MEAN, Asleep
from pymoo_psi import ExecutorRunner, investigate
file, study, log, n = sys.argv[1:]
runner = ExecutorRunner(Client(scheduler_file=file))
investigate(Asleep(MEAN, log, elementwise_runner=runner), int(n), study=study, study_wait=600)
"""


def driver(processes: Processes, study: str, log: str, n: int = N) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-c", DRIVER, processes.file, study, log, str(n)]
    return subprocess.Popen(command, stderr=subprocess.DEVNULL)


def repeated(log: str) -> int:
    """Return how many evaluations were repetitions."""
    lines = Path(log).read_text().splitlines()
    return len(lines) - len({*lines})


def kills() -> None:
    """Kill workers and drivers; the tables must be those of a serial run."""
    serial = investigate(Asleep(), N)
    with cluster(WORKERS) as (processes, client):
        runner = ExecutorRunner(client)
        log = f"{processes.folder}/log"
        study = new_study()

        def disturb() -> None:
            for process in processes.all[1 : KILLED + 1]:
                time.sleep(1)
                process.kill()
            for _ in range(KILLED):
                processes.join()

        thread = threading.Thread(target=disturb)
        thread.start()
        problem = Asleep(MEAN, log, elementwise_runner=runner)
        table = minimize(problem, PSI(N, study=study)).algorithm.table
        thread.join()
        assert table.equals(serial), "not the table of a serial run"
        print(
            f"{KILLED} of {WORKERS} workers killed, {KILLED} joined: "
            f"{repeated(log)} evaluations repeated",
            flush=True,
        )

        log, study = f"{processes.folder}/log2", new_study()
        for how in ENDS:
            run = driver(processes, study, log)
            time.sleep(6)
            run.send_signal(how)
            run.wait()
        assert driver(processes, study, log).wait() == 0
        assert read_table(study).equals(serial), "not the table of a serial run"
        print(f"{len(ENDS)} drivers ended: {repeated(log)} evaluations repeated", flush=True)

        log, study = f"{processes.folder}/log3", new_study()
        drivers = [driver(processes, study, log) for _ in range(2)]
        assert [run.wait() for run in drivers] == [0, 0]
        assert read_table(study).equals(serial), "not the table of a serial run"
        print(f"two drivers on one study: {repeated(log)} evaluations repeated", flush=True)


def write(study: str, k: int, seconds: Any) -> None:
    """Add 16 tests to a study; put how long it took, or nothing if it failed."""
    began = time.perf_counter()
    try:
        investigate(Asleep(), 16, study=study, first=1 + 16 * k, study_wait=60)
        seconds.put(time.perf_counter() - began)
    except PsiError:
        seconds.put(None)


def writers(n: int) -> None:
    """Print how long n writers of one study take, and how many fail."""
    context = multiprocessing.get_context("fork")
    study = new_study()
    investigate(Asleep(), 16, study=study)
    seconds = context.Queue()
    processes = [context.Process(target=write, args=(study, k, seconds)) for k in range(n)]
    for process in processes:
        process.start()
    taken = [seconds.get() for _ in processes]
    for process in processes:
        process.join()
    assert read_table(study).equals(investigate(Asleep(), 16 * n)), "not the table of a serial run"
    longest = max(one for one in taken if one is not None)
    print(f"{n} writers of 16 tests: up to {longest:.1f} s, {taken.count(None)} failed", flush=True)


class Simulated:
    """An executor of many workers that only sleep: each task ends after what its design takes."""

    def __init__(self, n_workers: int, problem: Asleep) -> None:
        self.max_workers = n_workers
        self.problem = problem
        self.computed = 0.0  # seconds of the workers
        self.ended = 0  # designs
        self._free = n_workers
        self._queue: list[tuple[Any, Future[Any]]] = []
        self._running: list[tuple[float, int, Any, Future[Any]]] = []
        self._numbers = itertools.count()
        self._changed = threading.Condition()
        threading.Thread(target=self._serve, daemon=True).start()

    def submit(self, _: Any, versions: Any, name: str, work: bytes) -> Future[Any]:
        """Take a task; see :mod:`pymoo_psi.parallel`."""
        future: Future[Any] = Future()
        with self._changed:
            self._queue.append(((versions, cloudpickle.loads(work)), future))
            self._changed.notify()
        return future

    def _serve(self) -> None:
        while True:
            with self._changed:
                now = time.monotonic()
                while self._free and self._queue:
                    task, future = self._queue.pop(0)
                    seconds = sum(self.problem.seconds(x) for _, x in task[1].designs)
                    heapq.heappush(
                        self._running, (now + seconds, next(self._numbers), task, future)
                    )
                    self._free -= 1
                pause = 1.0
                if self._running:
                    pause = self._running[0][0] - now
                if pause > 0:
                    self._changed.wait(min(pause, 1.0))
                    continue
                _, _, (versions, job), future = heapq.heappop(self._running)
                self._free += 1
            f, _ = cloudpickle.loads(job.function)
            f.problem.mean = 0.0  # it has slept
            results = []
            for index, x in job.designs:
                seconds = float(self.problem.seconds(x))
                self.computed += seconds
                self.ended += 1
                results.append((index, f(x), seconds))
            if future.set_running_or_notify_cancel():
                future.set_result((versions, cloudpickle.dumps((results, None, {}))))


def thousand(n_workers: int, n_tests: int) -> None:
    """Print the share of a thousand workers' time that SurrogatePSI uses."""
    mean = sized(10.0, 0.1)
    executor = Simulated(n_workers, Asleep(mean))
    problem = Asleep(mean, elementwise_runner=ExecutorRunner(executor))

    def watch() -> None:
        began = time.monotonic()
        while True:
            computed, ended = executor.computed, executor.ended
            time.sleep(10)
            share = (executor.computed - computed) / 10 / n_workers
            text = f"{share:.2f} of the time, {(executor.ended - ended) / 10:.0f} designs a second"
            now = time.monotonic() - began
            print(f"{now:.0f} s: {executor.ended} tests, {text}", flush=True)

    threading.Thread(target=watch, daemon=True).start()
    minimize(problem, SurrogatePSI(n_tests, n_points=2 * n_workers, study=new_study()))


def main(parts: list[str]) -> None:
    """Run the parts named, or all."""
    print(describe_machine(), flush=True)
    if not parts or "shares" in parts:
        for n_workers in sized((8, 16), (2,)):
            shares(n_workers)
    if not parts or "kills" in parts:
        kills()
    if not parts or "writers" in parts:
        for n_writers in sized((64, 200), (4,)):
            writers(n_writers)
    if not parts or "thousand" in parts:
        thousand(*sized((1000, 12_000), (4, 40)))


if __name__ == "__main__":
    main(sys.argv[1:])
