"""All short benchmarks, each figure beside a rival or a limit: the table at the top of the README.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks

This takes five minutes. Times are processor times, which other work on the machine disturbs least.
Those of what runs on two cores and of the page are wall times and need an idle machine. Limits that
are a time hold for the machine of the table; all others are ratios of one run.
"""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from typing import NamedTuple

import moocore
import numpy as np

from benchmarks import storage
from benchmarks.cores import rows, simplex
from benchmarks.machine import (
    describe_machine,
    output,
    processor_seconds,
    sized,
    wall_seconds,
    write_block,
)
from benchmarks.motion import compare_speed, designs, microseconds_of_one
from pymoo_psi import VectorizedSphereChute, cautions, investigate, rank_of_efficiency
from pymoo_psi.chute import criteria, motion

README = output(Path(__file__).with_name("README.md"))
BEGIN = "<!-- figures: written by python -m benchmarks -->"
END = "<!-- end figures -->"
PARETO = sized(200_000, 2**12)
SOLVE = ("solve", "bnh", "--points", "64")
PACKAGES = ("click", "msgspec", "numpy", "pandas", "moocore", "scipy", "pymoo", "matplotlib")


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
    one = microseconds_of_one()
    yield Row("one motion at a time", f"{one:.0f} µs", "85 µs", one / 85, "motion")


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
    front = simplex(PARETO)
    ranked = processor_seconds(lambda: rank_of_efficiency(front), 2)
    ranking = rank_of_efficiency(front)
    found = processor_seconds(lambda: cautions(ranking))
    limit = f"their ranking {ranked:.2f} s"
    yield Row(f"cautions of {PARETO} optimal designs", f"{found:.2f} s", limit, found / ranked)


def cores() -> Iterator[Row]:
    """Yield what two cores give, and one."""
    for label, figure, limit, ratio in rows():
        yield Row(label, figure, limit, ratio, "cores")


def starts(folder: str) -> Iterator[Row]:
    """Yield the figures of commands from their start, with compiled files, and what they import."""
    small = _designs_file(folder, 20)
    large = _designs_file(folder, sized(20_000, 100))
    page = os.path.join(folder, "page.html")
    pandas = ["-c", "import pandas"]
    pymoo = ["-c", "import pymoo.optimize, pymoo.problems.multi"]
    python = ["-c", "import click"]
    command = ["-m", "pymoo_psi"]
    cases = (
        ("`pymoo-psi rank`, 20 designs", [*command, "rank", small], pandas, 0.75),
        (
            "`pymoo-psi solve bnh --points 64`",
            [*command, "solve", "bnh", "--points=64"],
            pymoo,
            1.5,
        ),
        ("`pymoo-psi rank`, 20 000 designs", [*command, "rank", large], pandas, 2.3),
        (
            "`pymoo-psi page`, 20 000 designs",
            [*command, "page", large, "--out", page],
            pandas,
            3,
        ),
        ("`pymoo-psi --help`", [*command, "--help"], python, 3),
        ("`import pymoo_psi`", ["-c", "import pymoo_psi"], python, 1),
    )
    compiled = os.path.join(folder, "compiled")
    for label, words, rival, times in cases:
        theirs = _seconds_of_python(compiled, *rival)
        ours = _seconds_of_python(compiled, *words)
        _, _, imported = rival[1].partition(" ")
        limit = f"{times} times `import {imported}`, {theirs:.2f} s"
        figure = f"{ours:.2f} s; imports {', '.join(_packages(words)) or 'nothing large'}"
        yield Row(label, figure, limit, ours / theirs / times)


def _designs_file(folder: str, n: int) -> str:
    """Write a file of designs with four objectives, all Pareto optimal, and return its path."""
    path = Path(folder, f"designs_{n}.csv")
    rows = [",".join(map(str, row)) for row in simplex(n).tolist()]
    path.write_text("\n".join(["a,b,c,d", *rows, ""]))
    return str(path)


def _packages(words: list[str]) -> list[str]:
    """Return which of the larger packages a new Python imports."""
    command = [sys.executable, "-X", "importtime", *words]
    log = subprocess.run(command, check=True, capture_output=True, text=True).stderr
    modules = re.findall(r"^import time:.*\| +(\w+)$", log, re.MULTILINE)
    return [name for name in PACKAGES if name in modules]


def _seconds_of_python(compiled: str, *arguments: str) -> float:
    """Return the shortest processor time of a new Python, with a folder for compiled files."""
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": compiled}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, *arguments]
    times = []
    for _ in range(sized(6, 2)):  # the first call compiles
        before = getrusage(RUSAGE_CHILDREN)
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
        after = getrusage(RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times)


def stores(folder: str) -> Iterator[Row]:
    """Yield the figures of a study, beside SQLite's own for the same rows."""
    for label, figure, limit, ratio in storage.rows(folder):
        yield Row(label, figure, limit, ratio, "storage")


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
    place = f"{describe_machine()}; commit {done.stdout.strip()}"
    write_block(README, BEGIN, END, [place, "", *lines])


if __name__ == "__main__":
    main()
