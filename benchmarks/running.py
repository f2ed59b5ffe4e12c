"""JoblibRunner beside the plain loop and pymoo's joblib runner: ``python -m benchmarks.running``.

All evaluate the same designs by the same model, generation after generation; first their values
are compared, then their times. The rounds alternate between the runners, so that another load of
the machine meets all of them, and the printed ratio is the median of the ratios of the rounds. The
first evaluation, in which workers start, is reported apart.

Models: ``cheap`` is ZDT1, one design at a time; ``busy`` also computes as many steps as took 10 ms
at the start; ``waiting`` sleeps for 10 ms, like a model that waits for another machine.
"""

from __future__ import annotations

import os
import platform
import statistics
import sys
import time
from typing import Any

import joblib
import numpy as np
import pymoo
from pymoo.core.problem import ElementwiseProblem, LoopedElementwiseEvaluation
from pymoo.parallelization.joblib import JoblibParallelization

from pymoo_psi import JoblibRunner

N_JOBS = 2
ROUNDS = 9
TEN_MS = 0.01


def work(steps: int) -> float:
    total = 0.0
    for step in range(steps):
        total += step * 0.5
    return total


def steps_in_ten_ms() -> int:
    steps, fastest = 100_000, 9.0
    for _ in range(20):
        start = time.perf_counter()
        work(steps)
        fastest = min(fastest, time.perf_counter() - start)
    return round(steps * TEN_MS / fastest)


class Model(ElementwiseProblem):
    """ZDT1 one design at a time, with 10 ms of work or of waiting if wanted."""

    def __init__(self, kind: str, steps: int, **kwargs: Any) -> None:
        super().__init__(n_var=30, n_obj=2, xl=0.0, xu=1.0, **kwargs)
        self.kind = kind
        self.steps = steps

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        if self.kind == "waiting":
            time.sleep(TEN_MS)
        elif self.kind == "busy":
            work(self.steps)
        g = 1 + 9 / 29 * x[1:].sum()
        out["F"] = [x[0], g * (1 - np.sqrt(x[0] / g))]


def runners() -> dict[str, Any]:
    return {
        "plain loop": LoopedElementwiseEvaluation(),
        "JoblibRunner": JoblibRunner(N_JOBS),
        "  workers only": JoblibRunner(N_JOBS, in_process=False),
        "pymoo's joblib": JoblibParallelization(N_JOBS),
    }


def compare(kind: str, designs: int, generations: int) -> None:
    steps = steps_in_ten_ms()
    X = np.random.default_rng(1).random((designs, 30))
    problems = {name: Model(kind, steps, elementwise_runner=r) for name, r in runners().items()}

    def seconds(name: str) -> float:
        start = time.perf_counter()
        for _ in range(generations):
            problems[name].evaluate(X)
        return time.perf_counter() - start

    plain, first = problems["plain loop"].evaluate(X), {}
    for name, problem in problems.items():
        start = time.perf_counter()
        values = problem.evaluate(X)
        first[name] = time.perf_counter() - start
        if not np.array_equal(plain, values):
            sys.exit(f"{name} gives other values than the plain loop")
    rounds = [{name: seconds(name) for name in problems} for _ in range(ROUNDS)]
    print(f"\n{kind}: {generations} generations of {designs} designs; the same values")
    print(f"  {'':16}{'first':>10}{'median':>12}   times as fast as the plain loop")
    for name in problems:
        times = [one[name] for one in rounds]
        ratios = sorted(one["plain loop"] / one[name] for one in rounds)
        print(
            f"  {name:16}{first[name]:10.3f} s{statistics.median(times):8.3f} s"
            f"   {statistics.median(ratios):.2f}  ({ratios[0]:.2f} to {ratios[-1]:.2f})"
        )


def main() -> int:
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, ", end="")
    if hasattr(os, "getloadavg"):
        print(f"load {os.getloadavg()[0]:.1f}, ", end="")
    print(f"{platform.system()}, Python {platform.python_version()}, ", end="")
    print(f"pymoo {pymoo.__version__}, joblib {joblib.__version__}; {N_JOBS} workers")
    compare("cheap", designs=100, generations=100)
    compare("waiting", designs=100, generations=2)
    compare("busy", designs=100, generations=2)
    return 0


if __name__ == "__main__":
    sys.exit(main())
