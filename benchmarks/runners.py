"""The three runners, the plain loop and those of pymoo: ``python -m benchmarks.runners``.

Each evaluates 30 batches of 40 designs that sleep for 5 ms, as an algorithm with short generations
asks for them, by two workers: once in a process that has no workers yet, then with workers that are
kept. The first result is that of one design in a process that has no workers yet. At last one of 40
designs kills its process. Every value is compared with that of the plain loop.

All ways are measured in processes of their own, alternating, several times; medians are printed.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import Pool
from typing import Any

import numpy as np
from pymoo.core.problem import ElementwiseProblem, LoopedElementwiseEvaluation
from pymoo.parallelization.joblib import JoblibParallelization
from pymoo.parallelization.starmap import StarmapParallelization

from benchmarks.machine import describe_machine, sized
from pymoo_psi import ExecutorRunner, FailureTolerant, JoblibRunner, ProcessRunner

WORKERS = 2
SECONDS = 0.005
BATCHES = sized(30, 1)
ROUNDS = sized(3, 1)
DESIGNS = 40
KILLS = 7.0


class Model(ElementwiseProblem):
    """A sleep of 5 ms; one design kills its process."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(n_var=1, n_obj=1, xl=0.0, xu=100.0, **kwargs)

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        if x[0] == KILLS:
            os._exit(3)
        time.sleep(SECONDS)
        out["F"] = [x[0] ** 2]


RUNNERS: dict[str, Callable[[], Any]] = {
    "plain loop": LoopedElementwiseEvaluation,
    "starmap of a pool": lambda: StarmapParallelization(Pool(WORKERS).starmap),
    "pymoo's joblib": lambda: JoblibParallelization(WORKERS),
    "JoblibRunner": lambda: JoblibRunner(WORKERS),
    "ProcessRunner": lambda: ProcessRunner(WORKERS),
    "ExecutorRunner": lambda: ExecutorRunner(ProcessPoolExecutor(WORKERS)),
}
GUARDED = ("JoblibRunner", "ProcessRunner", "ExecutorRunner")


def measure(name: str) -> None:
    """Print the seconds of the first result, and of all batches with new and with kept workers."""
    X = 10 + np.arange(float(DESIGNS))[:, None]
    began = time.perf_counter()
    problem = Model(elementwise_runner=RUNNERS[name]())
    problem.evaluate(X[:1])
    first = time.perf_counter() - began
    seconds = []
    for _ in range(2):
        began = time.perf_counter()
        for _ in range(BATCHES):
            F = problem.evaluate(X)
            assert np.array_equal(F, X**2), f"{name} gives other values than the plain loop"
        seconds.append(time.perf_counter() - began)
    new, kept = seconds
    print(first, first + new, kept)


def lost(name: str) -> int:
    """Return how many of 40 designs have no result where one kills its process."""
    X = np.arange(float(DESIGNS))[:, None]
    problem = FailureTolerant(Model(elementwise_runner=RUNNERS[name]()))
    F = problem.evaluate(X)[0]
    kept = np.isfinite(F)
    assert np.array_equal(F[kept], X[kept] ** 2), f"{name} gives other values than the plain loop"
    return int(np.count_nonzero(~kept))


def main() -> None:
    """Print the table."""
    print(f"{describe_machine()}; {WORKERS} workers, {BATCHES} batches of {DESIGNS} designs")
    times: dict[str, list[list[float]]] = {name: [] for name in RUNNERS}
    for _ in range(ROUNDS):
        for name in RUNNERS:
            command = [sys.executable, "-m", "benchmarks.runners", name]
            line = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
            times[name].append([float(word) for word in line.split()])
    loop = [kept for _, _, kept in times["plain loop"]]
    print(f"{'':20}{'first result':>14}{'new workers':>24}{'kept workers':>24}")
    for name, rounds in times.items():
        first, new, kept = (statistics.median(column) for column in zip(*rounds, strict=True))
        speeds = []
        for k in (1, 2):
            ratios = [base / row[k] for base, row in zip(loop, rounds, strict=True)]
            speeds.append(statistics.median(ratios))
        print(
            f"{name:20}{first:12.2f} s{new:12.2f} s, {speeds[0]:.2f} times"
            f"{kept:12.2f} s, {speeds[1]:.2f} times"
        )
    print("\nOne of 40 designs kills its process; designs without a result:")
    for name in GUARDED:
        print(f"{name:20}{lost(name)}")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        measure(sys.argv[1])
    else:
        main()
