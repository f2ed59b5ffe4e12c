"""PSI, limits, then proposals from the same tests, on a model of an engineer.

python -m benchmarks.real bracket --points 256 --proposals 128 --jobs 2
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
from pymoo.indicators.hv import HV
from pymoo.optimize import minimize

from benchmarks.machine import describe_machine, output, sized
from pymoo_psi import (
    PSI,
    Formulation,
    ProcessRunner,
    ProgramProblem,
    PsiError,
    Recorded,
    SurrogatePSI,
    TestTable,
)
from pymoo_psi.page import decision_page
from pymoo_psi.report import decision_report

EXAMPLES = ("bracket", "pipes", "charging")
# What an engineer asks for when the tests are there.
LIMITS: dict[str, dict[str, Any]] = {
    "bracket": {"mass": 1.5, "sag": 0.2},
    "pipes": {"pressure": (20, None)},
    "charging": {"time": 60, "charge": (3.5, None)},
}


def load(name: str) -> Any:
    """Return the problem of an example.

    Raises:
        ImportError: Its package is not installed.
        PsiError: Its program is not installed.
    """
    if name == "bracket":
        return ProgramProblem.from_toml(Path(__file__).parent / "bracket" / "bracket.toml")
    if name == "pipes":
        from benchmarks.real.pipe_sizes import PipeSizes

        return PipeSizes()
    from benchmarks.real.fast_charging import FastCharging

    return FastCharging()


def require_values(name: str, table: TestTable) -> None:
    """Require tests with finite values, and units: what an example promises wherever it runs."""
    evaluated = table.status != "failed"
    assert evaluated.any(), f"{name}: every design failed: {table.reasons}"
    assert np.isfinite(table.F[evaluated]).all(), f"{name}: an objective is not finite"
    assert table.schema.units, f"{name}: no column has a unit"


def front(table: TestTable, limits: dict[str, Any]) -> Any:
    """Return the objectives of the Pareto-optimal feasible designs, all minimised."""
    return table.F[table.under(limits=limits).pareto()]


def main() -> None:
    """Run an example, print its figures, and write its study, page and report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("example", choices=EXAMPLES, nargs=sized(None, "?"), default="pipes")
    parser.add_argument("--points", type=int, default=sized(256, 16))
    parser.add_argument("--proposals", type=int, default=sized(128, 4))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=output(Path("real")))
    given = parser.parse_args()
    folder, limits = given.out / given.example, LIMITS[given.example]
    folder.mkdir(parents=True, exist_ok=True)
    try:
        problem = load(given.example)
    except (ImportError, PsiError) as error:
        parser.exit(sized(2, 0), f"{error}\n")
    problem.elementwise_runner = ProcessRunner(given.jobs, timeout=300)
    problem = Recorded(problem, study=folder / "tests.db")
    print(describe_machine())

    def tests(algorithm: PSI) -> TestTable:
        began, before = time.perf_counter(), problem.n_evaluated
        table: TestTable = minimize(problem, algorithm, seed=1).algorithm.table
        spent = time.perf_counter() - began
        each = spent / max(problem.n_evaluated - before, 1)
        print(f"  {type(algorithm).__name__}: {spent:.0f} s, {each:.2f} s a test")
        require_values(given.example, table)
        return table

    first = tests(PSI(given.points))
    both = given.points + given.proposals
    proposed = tests(SurrogatePSI(both, n_points=given.points, limits=limits))
    # as many more points of the sequence, for comparison
    more = tests(PSI(given.proposals, first=given.points + 1))
    steps = {
        f"PSI, {given.points} points": first,
        f"and {given.proposals} proposals": proposed,
        f"or {given.proposals} points more": first.merge(more),
    }
    fronts = [front(table, limits) for table in steps.values()]
    every = np.concatenate(fronts)
    low, high = every.min(axis=0), every.max(axis=0)
    indicator = HV(ref_point=np.full(every.shape[1], 1.1))
    print(f"{given.example}, limits {limits}, {given.jobs} jobs")
    for (what, table), F in zip(steps.items(), fronts, strict=True):
        failed, eligible = (
            int((table.status == "failed").sum()),
            table.under(limits=limits).feasible().sum(),
        )
        volume = indicator((F - low) / (high - low)) / 1.1 ** F.shape[1] if len(F) else 0.0
        print(
            f"  {what}: {len(table)} tests, {failed} failed, {eligible} within the limits, "
            f"{len(F)} Pareto optimal, hypervolume {volume:.3f}"
        )
    decision_page(proposed, Formulation(limits=limits), title=given.example).save(
        folder / "page.html"
    )
    report = decision_report(proposed.under(limits=limits), title=given.example)
    report.save(folder / "report.html")
    print(f"  {report}; page and report in {folder}")


if __name__ == "__main__":
    main()
