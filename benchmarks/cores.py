"""A vectorised model at many points on one core and on two.

    python -m benchmarks.cores [LOG2 OF POINTS]

First both give the same table of 2^18 points; then points of ``VectorizedSphereChute`` are tested
on one core and on two, twice in turn, and what is kept of them is

- the designs feasible under limits that one in fourteen keeps, which all came back from workers,
- their Pareto set, which was sifted where it was tested,
- all tests, of a quarter of the points, as these fill the memory,
- the Pareto set without limits, of a quarter of the points: most of them are Pareto optimal, and
  sifting the blocks' sets together, by threads of this process, takes as long as the tests.

Memory is the largest of this process, measured in one of its own for each case.

Two cores of a shared or hyper-threaded machine are not twice one. What they can be is told first,
by two runs of the first case on one core each, side by side.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from benchmarks.machine import describe_machine, peak_megabytes
from pymoo_psi import VectorizedSphereChute, investigate

LIMITS = {"f1": 2.5, "f4": 0.6}
CASES: dict[str, tuple[int, dict[str, Any]]] = {
    "feasible under limits": (1, {"keep": "feasible", "limits": LIMITS}),
    "Pareto set under limits": (1, {"keep": "pareto", "limits": LIMITS}),
    "all tests": (4, {}),
    "Pareto set without limits": (4, {"keep": "pareto"}),
}


def measure(case: str, exponent: int, n_jobs: int) -> None:
    """Print seconds, tests kept and megabytes of a run, after one that starts the workers."""
    problem = VectorizedSphereChute(0.4)
    part, options = CASES[case]
    investigate(problem, 2**12, n_jobs=n_jobs)
    began = time.perf_counter()
    kept = len(investigate(problem, 2**exponent // part, n_jobs=n_jobs, **options))
    print(json.dumps([time.perf_counter() - began, kept, peak_megabytes()]))


def apart(case: str, exponent: int, n_jobs: int) -> list[float]:
    """Return what :func:`measure` prints in a process that has done nothing else."""
    words = [sys.executable, "-m", "benchmarks.cores", case, str(exponent), str(n_jobs)]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    figures: list[float] = json.loads(done.stdout)
    return figures


def compare_cores(exponent: int) -> Iterator[tuple[str, int, list[float], list[float]]]:
    """Yield what is kept, of how many points, and the figures of one core and of two."""
    problem = VectorizedSphereChute(0.4)
    for name, (part, options) in CASES.items():
        one, two = (investigate(problem, 2**18, n_jobs=jobs, **options) for jobs in (1, 2))
        assert one.equals(two), "two cores do not give the table of one"
        runs = [(apart(name, exponent, 1), apart(name, exponent, 2)) for _ in range(2)]
        one, two = map(min, zip(*runs, strict=True))  # other work only lengthens a run
        yield name, 2**exponent // part, one, two


def main(exponent: int) -> None:
    """Print every figure."""
    print(describe_machine())
    name = next(iter(CASES))
    alone = apart(name, exponent, 1)[0]
    with ThreadPoolExecutor(2) as pool:
        beside = max(done[0] for done in pool.map(apart, [name] * 2, [exponent] * 2, [1] * 2))
    print(
        f"two runs side by side {beside:.1f} s, one alone {alone:.1f} s: two cores are at most "
        f"{2 * alone / beside:.2f} times one",
        flush=True,
    )
    for name, n, one, two in compare_cores(exponent):
        print(
            f"{name}, {one[1]} of {n} points: one core {one[0]:.1f} s ({n / one[0]:.0f} points a "
            f"second, {one[2]:.0f} MB), two {two[0]:.1f} s ({n / two[0]:.0f}, {two[2]:.0f} MB), "
            f"ratio {one[0] / two[0]:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    if len(sys.argv) > 2:
        measure(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 22)
