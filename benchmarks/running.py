"""JoblibRunner beside the plain loop and pymoo's joblib runner: ``python -m benchmarks.running``.

All evaluate the same designs by the same model, generation after generation; first their values
are compared, then their times. The rounds alternate between the runners, so that another load of
the machine meets all of them, and the printed ratio is the median of the ratios of the rounds. The
first evaluation, in which workers start, is reported apart.

Then efficiency, the sum of run times divided by workers and wall time: 16 workers, 320 designs
whose run times are exponential with mean 0.2 s, asleep, so that two cores will do. PSI and
``investigate`` with a study, beside a plain loop that gives a free worker of ``concurrent.futures``
the next design and stores nothing. All workers have started and loaded
the model before; what that takes is told apart. The last designs end one after the other, so that
no way of running reaches 1: ``bound`` is what these run times allow without any overhead. Then the
same where short and long designs come in runs, so that the last ones say nothing of the next.

    python -m benchmarks.running efficiency     these parts alone

At last ``SurrogatePSI`` with a study, whose rounds wait for their slowest design or, asynchronous,
do not: 8 workers and run times of 1 s in the mean, 16 and 2 s, 256 evaluations. The workers have
started before; the last designs end within the time that is measured.

    python -m benchmarks.running proposals      this part alone

Models: ``cheap`` is ZDT1, one design at a time; ``busy`` also computes as many steps as took 10 ms
at the start; ``waiting`` sleeps for 10 ms, like a model that waits for another machine.
"""

from __future__ import annotations

import heapq
import itertools
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Executor, ProcessPoolExecutor, wait
from functools import partial
from tempfile import TemporaryDirectory
from typing import Any

import joblib
import numpy as np
import pymoo
from pymoo.core.problem import ElementwiseProblem, LoopedElementwiseEvaluation
from pymoo.optimize import minimize
from pymoo.parallelization.joblib import JoblibParallelization

from pymoo_psi import PSI, JoblibRunner, SurrogatePSI, investigate, lp_tau

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


WORKERS, DESIGNS, MEAN = 16, 320, 0.2


class Uneven(ElementwiseProblem):
    """Two objectives after a sleep, exponential with mean ``MEAN``, the same for a design."""

    def __init__(self, seconds: Callable[[Any], float], n_var: int = 2, **kwargs: Any) -> None:
        super().__init__(n_var=n_var, n_obj=2, xl=0.0, xu=1.0, **kwargs)
        self.seconds = seconds

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        time.sleep(self.seconds(x))
        out["F"] = [x[0] + x[1] ** 2, 1 - x[0] * x[1]]


def in_any_order(x: Any, mean: float = MEAN) -> float:
    seed = [int(value * 2**52) for value in x]
    return float(np.random.default_rng(seed).exponential(mean))


def in_runs(x: Any) -> float:
    return float(-MEAN * np.log1p(-((x[0] * 977 + x[1] * 31) % 1)))


def values_of(x: Any, seconds: Callable[[Any], float]) -> list[float]:
    out: dict[str, Any] = {}
    Uneven(seconds)._evaluate(x, out)
    return list(out["F"])


def as_completed_loop(executor: Executor, X: Any, seconds: Callable[[Any], float]) -> Any:
    """Give a worker that is free the next design; nothing is stored."""
    F, rows = np.zeros((len(X), 2)), iter(range(len(X)))
    under_way = {
        executor.submit(values_of, X[i], seconds): i for i in itertools.islice(rows, WORKERS)
    }
    while under_way:
        done, _ = wait(under_way, return_when=FIRST_COMPLETED)
        for future in done:
            F[under_way.pop(future)] = future.result()
        for i in itertools.islice(rows, len(done)):
            under_way[executor.submit(values_of, X[i], seconds)] = i
    return F


def bound(times: list[float]) -> float:
    """Return the efficiency of workers that take the next design at once."""
    free = [0.0] * WORKERS
    for one in times:
        heapq.heappush(free, heapq.heappop(free) + one)
    return sum(times) / WORKERS / max(free)


def efficiency(seconds: Callable[[Any], float]) -> None:
    X = lp_tau(DESIGNS, 2)
    expected = np.column_stack([X[:, 0] + X[:, 1] ** 2, 1 - X[:, 0] * X[:, 1]])
    times = [seconds(x) for x in X]
    print(f"\n{WORKERS} workers, {DESIGNS} designs {seconds.__name__.replace('_', ' ')}, of")
    print(f"{sum(times) / DESIGNS:.3f} s in the mean,")
    print(f"the longest {max(times):.2f} s; all give the values of the plain loop")
    print(f"  bound of these run times: {bound(times):.3f}")

    def measure(name: str, start: Callable[[], Any], run: Callable[[], Any]) -> None:
        began = time.perf_counter()
        start()
        started = time.perf_counter() - began
        walls = []
        for _ in range(2):
            began = time.perf_counter()
            F = run()
            walls.append(time.perf_counter() - began)
            if not np.array_equal(F, expected):
                sys.exit(f"{name} gives other values than the plain loop")
        shares = ", ".join(f"{sum(times) / WORKERS / wall:.3f}" for wall in walls)
        print(f"  {name:38} {shares}   (first use {started:.1f} s)", flush=True)

    def ours(name: str, **options: Any) -> None:
        problem = Uneven(seconds, elementwise_runner=JoblibRunner(WORKERS, **options))
        with TemporaryDirectory() as folder:
            studies = (f"{folder}/{k}.db" for k in itertools.count())
            measure(
                f"{name}, investigate with a study",
                lambda: investigate(problem, 3 * WORKERS, first=1000),
                lambda: investigate(problem, DESIGNS, study=next(studies)).F,
            )
            measure(
                f"{name}, minimize(PSI) with a study",
                lambda: None,
                lambda: minimize(problem, PSI(DESIGNS, study=next(studies))).algorithm.table.F,
            )

    with ProcessPoolExecutor(WORKERS) as executor:
        measure(
            "plain as-completed loop, no study",
            lambda: as_completed_loop(executor, X[:WORKERS], seconds),
            lambda: as_completed_loop(executor, X, seconds),
        )
    ours("our workers", in_process=False)
    ours("our workers, timeout", timeout=60.0)


def proposals(workers: int, mean: float, evaluations: int = 256) -> None:
    print(f"\n{workers} workers, SurrogatePSI({evaluations}), designs of {mean:g} s in the mean:")
    seconds = partial(in_any_order, mean=mean)
    for asynchronous in (False, True):
        runner = JoblibRunner(workers, in_process=False)
        problem = Uneven(seconds, n_var=6, elementwise_runner=runner)
        investigate(problem, 2 * workers, first=1000)
        with TemporaryDirectory() as folder:
            psi = SurrogatePSI(evaluations, asynchronous=asynchronous, study=f"{folder}/run.db")
            cpu, began = time.process_time(), time.perf_counter()
            X = minimize(problem, psi).algorithm.table.X
            wall, cpu = time.perf_counter() - began, time.process_time() - cpu
        use = sum(map(seconds, X)) / workers / wall
        what = "asynchronous" if asynchronous else "in rounds"
        print(f"  {what:16}{wall:8.1f} s, {use:.2f} of the workers' time used", end="")
        print(f"; {cpu / evaluations:.3f} s of this process a design", flush=True)


def main() -> int:
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, ", end="")
    if hasattr(os, "getloadavg"):
        print(f"load {os.getloadavg()[0]:.1f}, ", end="")
    print(f"{platform.system()}, Python {platform.python_version()}, ", end="")
    print(f"pymoo {pymoo.__version__}, joblib {joblib.__version__}; {N_JOBS} workers")
    if sys.argv[1:] == ["proposals"]:
        proposals(8, 1.0)
        proposals(16, 2.0)
        return 0
    if sys.argv[1:] != ["efficiency"]:
        compare("cheap", designs=100, generations=100)
        compare("waiting", designs=100, generations=2)
        compare("busy", designs=100, generations=2)
    for seconds in (in_any_order, in_runs):
        efficiency(seconds)
    proposals(8, 1.0)
    proposals(16, 2.0)
    return 0


if __name__ == "__main__":
    sys.exit(main())
