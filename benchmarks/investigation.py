"""``investigate`` at scale, beside ``minimize(problem, PSI(n))`` over the same points, in one run.

    python -m benchmarks.investigation

First both are run on 4096 points and their tables compared; then 2^20 points of
``VectorizedSphereChute`` are investigated, their Pareto set taken and ranked, with the peak
memory of the process.
"""

from __future__ import annotations

import resource
import sys
import time

import numpy as np
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, seconds
from pymoo_psi import PSI, VectorizedSphereChute, investigate

SAMPLE = 4096
SCALE = 2**20


def peak_megabytes() -> float:
    """Return the largest memory the process has had."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def main() -> None:
    """Print every figure."""
    print(describe_machine())
    problem = VectorizedSphereChute(0.4)
    ours = investigate(problem, SAMPLE)
    theirs = minimize(problem, PSI(SAMPLE)).algorithm.table
    assert ours.equals(theirs), "the two ways do not give the same table"
    fast = seconds(lambda: investigate(problem, SAMPLE).pareto(), 5)
    slow = seconds(lambda: minimize(problem, PSI(SAMPLE)), 3)
    print(
        f"{SAMPLE} points: minimize(problem, PSI) {slow * 1e3:.0f} ms, "
        f"investigate with Pareto set {fast * 1e3:.0f} ms, ratio {slow / fast:.0f}"
    )
    before = peak_megabytes()
    start = time.perf_counter()
    table = investigate(problem, SCALE)
    tested = time.perf_counter()
    ranking = table.ranking(normalize=False)
    ranked = time.perf_counter()
    print(
        f"2^20 points: tested in {tested - start:.1f} s, Pareto set of {len(ranking.rank)} and "
        f"ranks in {ranked - tested:.1f} s, together {ranked - start:.1f} s; "
        f"peak memory {peak_megabytes():.0f} MB ({before:.0f} MB before)"
    )
    assert np.isin(ranking.rank, [0, 3, 4, 5, 6]).all()
    start = time.perf_counter()
    minimize(problem, PSI(SCALE // 16))
    took = time.perf_counter() - start
    print(f"minimize(problem, PSI(2^16)): {took:.1f} s for a sixteenth of the points")


if __name__ == "__main__":
    main()
