"""A vectorised model at many points on one core and on two.

    python -m benchmarks.cores [LOG2 OF POINTS] [PYTHON WITH ANOTHER VERSION]

All times are those of the clock, of the second call in a process. With the Python of another
version, that one and this one are measured in turns, and the numbers of tests kept compared.

First both give the same table of 2^18 points. Then points of ``VectorizedSphereChute`` are tested
on one core and on two, twice in turn. The run keeps

- the designs that are feasible under limits, one in fourteen, all returned by the workers;
- their Pareto set, which the workers filter for dominance;
- all tests, for a quarter of the points, as these fill the memory;
- the Pareto set without limits, for a quarter of the points: most of them are Pareto optimal, and
  filtering them, by threads of this process, takes as long as the tests;
- the ranking of this set;
- the result of pymoo's ``minimize`` with 4096 points, in this process.

Memory is the largest of the process, which is a new one for each case.

Two cores of a shared or hyper-threaded machine are slower than twice one. The limit is measured
first: two runs of the first case on one core each, in parallel.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, peak_megabytes
from pymoo_psi import PSI, VectorizedSphereChute, investigate

RANKED = "Pareto set without limits, ranked"
MINIMIZED = "minimize"
LIMITS = {"f1": 2.5, "f4": 0.6}
# What is kept: the divisor of the number of points, and the options of the run.
CASES: dict[str, tuple[int, dict[str, Any]]] = {
    "feasible under limits": (1, {"keep": "feasible", "limits": LIMITS}),
    "Pareto set under limits": (1, {"keep": "pareto", "limits": LIMITS}),
    "all tests": (4, {}),
    "Pareto set without limits": (4, {"keep": "pareto"}),
    RANKED: (4, {"keep": "pareto"}),
    MINIMIZED: (1024, {}),
}


class Figures(NamedTuple):
    """The figures of a run."""

    seconds: float
    kept: int
    megabytes: float


def measure(case: str, exponent: int, n_jobs: int) -> None:
    """Print the figures of a run, after another one that starts the workers."""
    problem = VectorizedSphereChute(0.4)
    divisor, options = CASES[case]

    def run(n_points: int) -> int:
        if case == MINIMIZED:
            return len(minimize(problem, PSI(n_points)).algorithm.table)
        table = investigate(problem, n_points, n_jobs=n_jobs, **options)
        if case == RANKED:
            table.ranking()
        return len(table)

    run(2**12)
    began = time.perf_counter()
    kept = run(2**exponent // divisor)
    seconds = time.perf_counter() - began
    print(json.dumps(Figures(seconds, kept, peak_megabytes())))


def in_new_process(case: str, exponent: int, n_jobs: int, python: str = sys.executable) -> Figures:
    """Return what :func:`measure` prints in a process of its own."""
    command = [python, "-m", "benchmarks.cores", case, str(exponent), str(n_jobs)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return Figures(*json.loads(done.stdout))


def compare_cores(exponent: int) -> Iterator[tuple[str, int, Figures, Figures]]:
    """Yield what is kept, the number of points, and the figures of one core and of two."""
    problem = VectorizedSphereChute(0.4)
    for case, (divisor, options) in CASES.items():
        if case == MINIMIZED:
            continue
        table = investigate(problem, 2**18, n_jobs=1, **options)
        other = investigate(problem, 2**18, n_jobs=2, **options)
        assert table.equals(other), "two cores do not give the table of one"
        one_core = []
        two_cores = []
        for _ in range(2):
            one_core.append(in_new_process(case, exponent, 1))
            two_cores.append(in_new_process(case, exponent, 2))
        # The fastest run of each, as other work can only slow a run down.
        yield case, 2**exponent // divisor, min(one_core), min(two_cores)


def possible_speedup(exponent: int) -> None:
    """Print how much faster two cores can be than one."""
    case = next(iter(CASES))
    alone = in_new_process(case, exponent, 1).seconds
    with ThreadPoolExecutor(2) as pool:
        runs = [pool.submit(in_new_process, case, exponent, 1) for _ in range(2)]
        parallel = max(run.result().seconds for run in runs)
    print(
        f"two runs in parallel {parallel:.1f} s, one alone {alone:.1f} s: two cores are at most "
        f"{2 * alone / parallel:.2f} times one",
        flush=True,
    )


def compare_versions(exponent: int, python: str) -> None:
    """Print the shortest times of another version and of this one, in turns."""
    for case in CASES:
        for n_jobs in (1, 2):
            others = []
            times = []
            for _ in range(3):
                other = in_new_process(case, exponent, n_jobs, python)
                figures = in_new_process(case, exponent, n_jobs)
                assert other.kept == figures.kept, "another table"
                others.append(other.seconds)
                times.append(figures.seconds)
            ratio = min(times) / min(others)
            print(
                f"{case}, on {n_jobs}: {min(others):.2f} s, now {min(times):.2f} s ({ratio:.2f})",
                flush=True,
            )


def main(exponent: int) -> None:
    """Print all figures."""
    print(describe_machine())
    possible_speedup(exponent)
    for case, n, one, two in compare_cores(exponent):
        print(f"{case}, {one.kept} of {n} points:", end=" ")
        for name, figures in (("one core", one), ("two", two)):
            rate = f"{n / figures.seconds:.0f} points a second"
            print(f"{name} {figures.seconds:.1f} s ({rate}, {figures.megabytes:.0f} MB)", end=", ")
        print(f"ratio {one.seconds / two.seconds:.2f}", flush=True)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    if len(arguments) > 2:
        measure(arguments[0], int(arguments[1]), int(arguments[2]))
    elif len(arguments) == 2:
        compare_versions(int(arguments[0]), arguments[1])
    elif arguments:
        main(int(arguments[0]))
    else:
        main(22)
