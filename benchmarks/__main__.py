"""All short benchmarks, each figure beside a rival or a limit: the table at the top of the README.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks

This takes five minutes. Times are processor times, which other work on the machine disturbs least.
Those of what runs on two cores and of the page are wall times and need an idle machine.
"""

from __future__ import annotations

import itertools
import os
import re
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from typing import NamedTuple

import moocore
import numpy as np

from benchmarks.cores import rows
from benchmarks.machine import describe_machine, output, processor_seconds, sized, wall_seconds
from benchmarks.motion import compare_speed, designs
from pymoo_psi import VectorizedSphereChute, investigate
from pymoo_psi.chute import ChuteParameters, criteria, motion
from pymoo_psi.files import read_table

README = output(Path(__file__).with_name("README.md"))
BEGIN = "<!-- figures: written by python -m benchmarks -->"
END = "<!-- end figures -->"
TESTS = sized(10**6, 2**12)
PARETO = sized(200_000, 2**12)


class Row(NamedTuple):
    """A row of the table.

    Attributes:
        label: What is measured.
        figure: The result.
        limit: The result of a rival, or a limit.
        ratio: The time or its inverse as a share of the limit; up to 1 is as good.
        module: The benchmark with more detail, if there is one.
    """

    label: str
    figure: str
    limit: str
    ratio: float
    module: str = ""


def motions() -> Iterator[Row]:
    """Yield the figures of the motion."""
    ratios = [compare_speed(mu) for mu in (0.2, 0.4, 0.6)]
    mean = float(np.exp(np.mean(np.log(ratios))))
    yield Row(
        "motions in the time of one `solve_ivp`", f"{mean:.0f}", "2500", 2500 / mean, "motion"
    )
    X = designs(2000, 0.4)
    parameters = ChuteParameters(mu=0.4)
    seconds = processor_seconds(lambda: [motion(*x, parameters) for x in X], 5)
    one = seconds / len(X) * 1e6
    yield Row("one motion at a time", f"{one:.0f} µs", "100 µs", one / 100, "motion")


def fronts() -> Iterator[Row]:
    """Yield the figures of Pareto sets, beside moocore's filter of the same rows."""
    problem = VectorizedSphereChute(0.4)
    X = designs(PARETO, 0.4)
    F = criteria(motion(*X.T, problem.parameters))
    plain = wall_seconds(lambda: moocore.is_nondominated(F, keep_weakly=True), 2)
    plain += wall_seconds(lambda: motion(*X.T, problem.parameters), 2)
    ours = wall_seconds(lambda: investigate(problem, PARETO, keep="pareto"), 2)
    label = f"Pareto set of {PARETO} points"
    yield Row(label, f"{ours:.2f} s", f"motion and filter {plain:.2f} s", ours / plain)


def cores() -> Iterator[Row]:
    """Yield what two cores give, and one."""
    for label, figure, limit, ratio in rows():
        yield Row(label, figure, limit, ratio, "cores")


def starts(folder: str) -> Iterator[Row]:
    """Yield the figures of the start, with compiled files."""
    path = Path(folder, "designs.csv")
    lines = ["a,b,c"]
    for a, b, c in np.random.default_rng(0).random((20, 3)).tolist():
        lines.append(f"{a},{b},{c}")
    path.write_text("\n".join(lines) + "\n")
    compiled = os.path.join(folder, "compiled")

    pandas = _seconds_of_python(compiled, "-c", "import pandas")
    ranked = _seconds_of_python(compiled, "-m", "pymoo_psi", "rank", str(path))
    limit = f"1.25 times `import pandas`, {pandas:.2f} s"
    yield Row("`pymoo-psi rank`, 20 designs", f"{ranked:.2f} s", limit, ranked / pandas / 1.25)
    helped = _seconds_of_python(compiled, "-m", "pymoo_psi", "--help")
    yield Row("`pymoo-psi --help`", f"{helped:.2f} s", "0.15 s", helped / 0.15)
    bare = _seconds_of_python(compiled, "-c", "import pymoo_psi")
    yield Row("`import pymoo_psi`", f"{bare:.3f} s", "0.03 s", bare / 0.03)


def _seconds_of_python(compiled: str, *arguments: str) -> float:
    """Return the shortest processor time of a new Python, with a folder for compiled files."""
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": compiled}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, *arguments]
    times = []
    for _ in range(sized(6, 2)):  # the first one compiles
        before = getrusage(RUSAGE_CHILDREN)
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
        after = getrusage(RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times)


def stores(folder: str) -> Iterator[Row]:
    """Yield the figures of a study, beside SQLite's own for the same rows."""
    problem = VectorizedSphereChute(0.4)
    path = os.path.join(folder, "study.db")
    bare = processor_seconds(lambda: investigate(problem, TESTS))
    stored = processor_seconds(lambda: investigate(problem, TESTS, study=path)) - bare
    read = processor_seconds(lambda: read_table(path))
    with closing(sqlite3.connect(path)) as db:
        (table,) = db.execute("SELECT sql FROM sqlite_master WHERE name = 'tests'").fetchone()
        fetched = processor_seconds(lambda: db.execute("SELECT * FROM tests").fetchall())
        rows = db.execute("SELECT * FROM tests").fetchall()
    with closing(sqlite3.connect(os.path.join(folder, "plain.db"))) as db:
        db.execute(table)
        insert = f"INSERT INTO tests VALUES ({', '.join('?' * len(rows[0]))})"
        inserted = processor_seconds(lambda: (db.executemany(insert, rows), db.commit()))
    yield _rate("tests stored", stored, 150_000, f"executemany {TESTS / inserted:.0f}")
    yield _rate("tests read", read, 300_000, f"fetchall {TESTS / fetched:.0f}")


def _rate(label: str, seconds: float, aim: int, rival: str) -> Row:
    """Return the row of a number of tests a second."""
    limit = f"{aim} a second ({rival})"
    return Row(label, f"{TESTS / seconds:.0f} a second", limit, aim * seconds / TESTS, "storage")


def pages() -> Iterator[Row]:
    """Yield the time of a slider's step on the decision page, if a browser is installed."""
    if find_spec("playwright") is None:
        return
    for n, limit in sized(((20_000, 33), (100_000, 100)), ((100, 33),)):
        command = [sys.executable, "-m", "benchmarks.page", str(n)]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        times = re.findall(r" [fx]1 +(\d+) +\d+ +\d+$", output, re.MULTILINE)
        slowest = max(map(int, times))
        label = f"page of {n} designs: a slider's step, median of the slowest kind"
        yield Row(label, f"{slowest} ms", f"{limit} ms", slowest / limit, "page")


def main() -> None:
    """Print each row when it is measured, and write the table into the README."""
    lines = ["| what | figure | rival or limit | ratio | in detail |", "|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        parts = (motions(), fronts(), cores(), starts(folder), stores(folder), pages())
        for row in itertools.chain.from_iterable(parts):
            command = ""
            if row.module:
                command = f"`python -m benchmarks.{row.module}`"
            line = f"| {row.label} | {row.figure} | {row.limit} | {row.ratio:.2f} | {command} |"
            lines.append(line)
            print(line, flush=True)
    git = ["git", "describe", "--always", "--dirty"]
    done = subprocess.run(git, cwd=README.parent, capture_output=True, text=True)
    table = "\n".join([f"{describe_machine()}; commit {done.stdout.strip()}", "", *lines])
    before, rest = README.read_text("utf-8").split(BEGIN)
    _, after = rest.split(END)
    README.write_text(f"{before}{BEGIN}\n\n{table}\n\n{END}{after}", "utf-8")


if __name__ == "__main__":
    main()
