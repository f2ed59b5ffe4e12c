"""What runs on several cores: a vectorised model at many points, and Pareto sets.

    python -m benchmarks.cores

All times are those of the clock, the shortest of several calls in a process that is new for each
line, after a small one that starts the workers. A process "on one core" is bound to it.

First one core and two give the same table of 2^18 points. Then points of ``VectorizedSphereChute``
are tested; the run keeps

- the designs that are feasible under limits, one in fourteen, all returned by the workers;
- their Pareto set, which the workers filter for dominance;
- all tests;
- the Pareto set without limits, on one core: most of them are Pareto optimal, and filtering them
  takes longer than the tests;
- the ranking of this set;
- the result of pymoo's ``minimize`` with 4096 points, in this process.

The last lines are of 10^6 designs on a simplex, all of them Pareto optimal, which are ranked, and
filtered by moocore alone.

Two cores of a shared or hyper-threaded machine are slower than twice one. The limit is measured
first: two runs of the first case on one core each, in parallel.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from typing import Any, NamedTuple

import moocore
import numpy as np
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, peak_megabytes, sized
from pymoo_psi import PSI, VectorizedSphereChute, investigate, rank_of_efficiency

PROBLEM = VectorizedSphereChute(0.4)
LIMITS = {"f1": 2.5, "f4": 0.6}


def kept(n_points: int, n_jobs: int, **options: Any) -> int:
    """Return how many tests an investigation keeps."""
    return len(investigate(PROBLEM, n_points, n_jobs=n_jobs, **options))


def ranked(n_points: int, n_jobs: int) -> int:
    """Return how many designs of a Pareto set are ranked."""
    table = investigate(PROBLEM, n_points, n_jobs=n_jobs, keep="pareto")
    return len(table.ranking().rank)


def minimized(n_points: int, n_jobs: int) -> int:
    """Return how many tests pymoo's ``minimize`` makes."""
    return len(minimize(PROBLEM, PSI(n_points)).algorithm.table)


@cache
def simplex(n_points: int) -> np.ndarray:
    """Return objectives none of which dominates another."""
    spread = np.random.default_rng(0).exponential(size=(n_points, 4))
    return np.asarray(spread / spread.sum(axis=1, keepdims=True))


def ranked_simplex(n_points: int, n_jobs: int) -> int:
    """Return how many designs of a simplex are ranked."""
    return int(rank_of_efficiency(simplex(n_points)).pareto.sum())


def filtered_simplex(n_points: int, n_jobs: int) -> int:
    """Return how many designs of a simplex moocore finds nondominated."""
    return int(moocore.is_nondominated(simplex(n_points), keep_weakly=True).sum())


class Case(NamedTuple):
    """Something to be measured.

    Attributes:
        run: Runs it for a number of points and of processes; returns how many tests it keeps.
        n_points: The number of points.
        repeat: How often it is measured.
    """

    run: Callable[..., int]
    n_points: int
    repeat: int


FEASIBLE = "feasible under limits"
PARETO = "Pareto set under limits"
ALL = "all tests"
UNLIMITED = "Pareto set without limits"
RANKED = "Pareto set without limits, ranked"
MINIMIZED = "`minimize(problem, PSI(4096))`"
SIMPLEX_SIZE = sized(10**6, 10**3)
SIMPLEX = "10^6 optimal designs of 4 objectives ranked"
FILTERED = "10^6 optimal designs of 4 objectives filtered by moocore"
CASES = {
    FEASIBLE: Case(partial(kept, keep="feasible", limits=LIMITS), sized(2**22, 2**12), 2),
    PARETO: Case(partial(kept, keep="pareto", limits=LIMITS), sized(2**22, 2**12), 2),
    ALL: Case(kept, sized(2**20, 2**12), 4),
    UNLIMITED: Case(partial(kept, keep="pareto"), sized(2**20, 2**12), 3),
    RANKED: Case(ranked, sized(2**20, 2**12), 3),
    MINIMIZED: Case(minimized, 2**12, sized(15, 1)),
    SIMPLEX: Case(ranked_simplex, SIMPLEX_SIZE, 2),
    FILTERED: Case(filtered_simplex, SIMPLEX_SIZE, 2),
}


class Figures(NamedTuple):
    """The figures of a case."""

    seconds: float
    kept: int
    megabytes: float


def measure(name: str, cores: set[int]) -> None:
    """Print the figures of a case in this process, which is bound to cores."""
    os.sched_setaffinity(0, cores)
    case = CASES[name]
    case.run(2**12, len(cores))
    if case.n_points == SIMPLEX_SIZE:
        simplex(SIMPLEX_SIZE)  # which is kept
    times = []
    for _ in range(case.repeat):
        began = time.perf_counter()
        n_kept = case.run(case.n_points, len(cores))
        times.append(time.perf_counter() - began)
    print(json.dumps(Figures(min(times), n_kept, peak_megabytes())))


def in_new_process(name: str, *cores: int) -> Figures:
    """Return what :func:`measure` prints in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.cores", name, *map(str, cores)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return Figures(*json.loads(done.stdout))


def require_equal_tables() -> None:
    """Check that two cores give the tables of one."""
    n_points = sized(2**18, 2**12)
    for options in ({"keep": "feasible", "limits": LIMITS}, {"keep": "pareto"}, {}):
        table = investigate(PROBLEM, n_points, n_jobs=1, **options)
        other = investigate(PROBLEM, n_points, n_jobs=2, **options)
        assert table.equals(other), "two cores do not give the table of one"


def rows() -> Iterator[tuple[str, str, str, float]]:
    """Yield lines: what is measured, the figure, the limit, and the figure as a share of it."""
    require_equal_tables()
    for name, least in ((FEASIBLE, 1.7), (PARETO, 1.5), (ALL, 1.5)):
        one = in_new_process(name, 0).seconds
        two = in_new_process(name, 0, 1).seconds
        label = f"2^{CASES[name].n_points.bit_length() - 1} points: {name}, two cores"
        figure = f"{one / two:.2f} times one ({one:.2f} s, {two:.2f} s)"
        yield label, figure, f"{least}", least * two / one
    for name, limit in ((UNLIMITED, 2.4), (RANKED, 2.8), (MINIMIZED, 0.055)):
        seconds = in_new_process(name, 0).seconds
        label = f"{name}, one core"
        if name != MINIMIZED:
            label = f"2^20 points: {label}"
        yield label, f"{seconds:.3g} s", f"{limit} s", seconds / limit
    ours = in_new_process(SIMPLEX, 0).seconds
    plain = in_new_process(FILTERED, 0).seconds
    figure = f"{ours / plain:.2f} of moocore's filter ({ours:.2f} s, {plain:.2f} s)"
    yield f"{SIMPLEX}, one core", figure, "1.0", ours / plain


def possible_speedup() -> str:
    """Say how much faster two cores can be than one."""
    alone = in_new_process(FEASIBLE, 0).seconds
    with ThreadPoolExecutor(2) as pool:
        runs = [pool.submit(in_new_process, FEASIBLE, core) for core in (0, 1)]
        parallel = max(run.result().seconds for run in runs)
    return (
        f"two processes that share nothing {parallel:.1f} s, one alone {alone:.1f} s: two cores "
        f"are at most {2 * alone / parallel:.2f} times one"
    )


def main() -> None:
    """Print all figures."""
    print(describe_machine())
    print(f"load of the last minute, by others: {os.getloadavg()[0]:.1f}")
    print(possible_speedup(), flush=True)
    for label, figure, limit, ratio in rows():
        print(f"{label}: {figure}, limit {limit}, ratio {ratio:.2f}", flush=True)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    if len(arguments) > 1:
        measure(arguments[0], set(map(int, arguments[1:])))
    else:
        main()
