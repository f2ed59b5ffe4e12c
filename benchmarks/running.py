"""How much of the workers' time a run uses: ``python -m benchmarks.running``.

The efficiency is the sum of run times divided by workers and wall time: 16 workers and 320 designs
whose run times are exponential with mean 0.2 s. The models sleep, so that two cores are enough. PSI
and ``investigate`` with a study are compared with a plain loop without a study, which gives a free
worker of ``concurrent.futures`` the next design. All workers have started and loaded the model
before; the time for this is printed, too. As the last designs end one after another, no method can
reach 1: ``bound`` is the efficiency for these run times without overhead. The same is repeated with
short and long designs in sequences, so that the last run times do not predict the next one.
"""

from __future__ import annotations

import heapq
import itertools
import sys
import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Executor, ProcessPoolExecutor, wait
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, sized
from pymoo_psi import PSI, ProcessRunner, investigate, lp_tau

WORKERS = sized(16, 2)
DESIGNS = sized(320, 16)
MEAN = sized(0.2, 0.02)


class Uneven(ElementwiseProblem):
    """Two objectives after a sleep whose length is a function of the design."""

    def __init__(self, seconds: Callable[[Any], float], **kwargs: Any) -> None:
        super().__init__(n_var=2, n_obj=2, xl=0.0, xu=1.0, **kwargs)
        self.seconds = seconds

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        time.sleep(self.seconds(x))
        out["F"] = [x[0] + x[1] ** 2, 1 - x[0] * x[1]]


def in_any_order(x: Any) -> float:
    """Return an exponential run time that is random but the same for a design."""
    seed = [int(value * 2**52) for value in x]
    return float(np.random.default_rng(seed).exponential(MEAN))


def in_sequences(x: Any) -> float:
    """Return an exponential run time; consecutive designs have similar ones."""
    u = (x[0] * 977 + x[1] * 31) % 1
    return float(-MEAN * np.log1p(-u))


def values_of(x: Any, seconds: Callable[[Any], float]) -> list[float]:
    """Return the objectives of a design."""
    out: dict[str, Any] = {}
    Uneven(seconds)._evaluate(x, out)
    return list(out["F"])


def as_completed_loop(executor: Executor, X: Any, seconds: Callable[[Any], float]) -> Any:
    """Give each free worker the next design; nothing is stored."""
    F = np.zeros((len(X), 2))
    rows = iter(range(len(X)))
    under_way: dict[Any, int] = {}
    n_free = WORKERS
    while True:
        for row in itertools.islice(rows, n_free):
            under_way[executor.submit(values_of, X[row], seconds)] = row
        if not under_way:
            return F
        done, _ = wait(under_way, return_when=FIRST_COMPLETED)
        for future in done:
            F[under_way.pop(future)] = future.result()
        n_free = len(done)


def bound(times: list[float]) -> float:
    """Return the efficiency of workers that start the next design immediately."""
    ends = [0.0] * WORKERS
    for seconds in times:
        heapq.heappush(ends, heapq.heappop(ends) + seconds)
    return sum(times) / WORKERS / max(ends)


class Efficiency:
    """The efficiency of several ways to run the same designs.

    Args:
        seconds: The run time of each design.
    """

    def __init__(self, seconds: Callable[[Any], float]) -> None:
        self.seconds = seconds
        self.X = lp_tau(DESIGNS, 2)
        x1, x2 = self.X.T
        self.F = np.column_stack([x1 + x2**2, 1 - x1 * x2])
        self.times = [seconds(x) for x in self.X]
        name = seconds.__name__.replace("_", " ")
        print(f"\n{WORKERS} workers, {DESIGNS} designs {name}:")
        print(
            f"{sum(self.times) / DESIGNS:.3f} s in the mean, the longest {max(self.times):.2f} s;"
        )
        print("all ways give the values of the plain loop")
        print(f"  bound of these run times: {bound(self.times):.3f}")

    def measure(self, name: str, start: Callable[[], Any], run: Callable[[], Any]) -> None:
        """Print the efficiency of two runs, after a start of the workers."""
        began = time.perf_counter()
        start()
        started = time.perf_counter() - began
        shares = []
        for _ in range(2):
            began = time.perf_counter()
            F = run()
            wall = time.perf_counter() - began
            shares.append(f"{sum(self.times) / WORKERS / wall:.3f}")
            if not np.array_equal(F, self.F):
                sys.exit(f"{name} gives other values than the plain loop")
        print(f"  {name:38} {', '.join(shares)}   (first use {started:.1f} s)", flush=True)

    def measure_loop(self) -> None:
        """Measure the plain loop."""
        with ProcessPoolExecutor(WORKERS) as executor:
            self.measure(
                "plain as-completed loop, no study",
                lambda: as_completed_loop(executor, self.X[:WORKERS], self.seconds),
                lambda: as_completed_loop(executor, self.X, self.seconds),
            )

    def measure_runner(self, name: str, runner: ProcessRunner) -> None:
        """Measure both ways to run PSI with a runner."""
        problem = Uneven(self.seconds, elementwise_runner=runner)
        with TemporaryDirectory() as folder:
            studies = (f"{folder}/{k}.db" for k in itertools.count())
            self.measure(
                f"{name}, investigate with a study",
                lambda: investigate(problem, 3 * WORKERS, first=1000),
                lambda: investigate(problem, DESIGNS, study=next(studies)).F,
            )
            self.measure(
                f"{name}, minimize(PSI) with a study",
                lambda: None,
                lambda: minimize(problem, PSI(DESIGNS, study=next(studies))).algorithm.table.F,
            )


def efficiency(seconds: Callable[[Any], float]) -> None:
    """Print the efficiency of all ways to run designs."""
    ways = Efficiency(seconds)
    ways.measure_loop()
    ways.measure_runner("our workers", ProcessRunner(WORKERS))
    ways.measure_runner("our workers, timeout", ProcessRunner(WORKERS, timeout=60.0))


def main() -> None:
    """Print the efficiency of all ways to run designs, in any order and in sequences."""
    print(describe_machine())
    for seconds in (in_any_order, in_sequences):
        efficiency(seconds)


if __name__ == "__main__":
    main()
