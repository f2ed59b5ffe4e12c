"""Every short figure beside its rival or limit, in one run: the table at the top of the README.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks

It takes five minutes. Times are those of the processor, which other work on the machine disturbs
least, but for two cores and the page: those are of the clock, and need a machine that is idle.
"""

from __future__ import annotations

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

import moocore
import numpy as np

from benchmarks.cores import compare_cores
from benchmarks.machine import describe_machine, processor_seconds
from benchmarks.motion import compare_speed, designs
from pymoo_psi import VectorizedSphereChute, investigate, rank_of_efficiency
from pymoo_psi.chute import ChuteParameters, criteria, motion
from pymoo_psi.table import read_table

README = Path(__file__).with_name("README.md")
BEGIN, END = "<!-- figures: written by python -m benchmarks -->", "<!-- end figures -->"
TESTS = 10**6
PARETO = 200_000

Row = tuple[str, str, str, float, str]  # what, figure, rival or limit, ratio, command


def motions() -> Iterator[Row]:
    """Give the figures of the motion."""
    mean = float(np.exp(np.mean([np.log(compare_speed(mu)) for mu in (0.2, 0.4, 0.6)])))
    yield "motions in the time of one `solve_ivp`", f"{mean:.0f}", "2500", 2500 / mean, "motion"
    X, p = designs(2000, 0.4), ChuteParameters(mu=0.4)
    one = processor_seconds(lambda: [motion(*x, p) for x in X], 5) / len(X) * 1e6
    yield "one motion at a time", f"{one:.0f} µs", "100 µs", one / 100, "motion"


def fronts() -> Iterator[Row]:
    """Give the figures of Pareto sets, beside moocore's filter of the same rows."""
    problem = VectorizedSphereChute(0.4)
    whole = processor_seconds(lambda: investigate(problem, 2**20).under(normalize=False).ranking())
    what = "2^20 points of the chute tested, filtered and ranked"
    yield what, f"{whole:.1f} s", "5 s", whole / 5, ""
    spread = np.random.default_rng(0).exponential(size=(10**6, 4))
    simplex = spread / spread.sum(axis=1, keepdims=True)
    plain = processor_seconds(lambda: moocore.is_nondominated(simplex, keep_weakly=True), 2)
    ranked = processor_seconds(lambda: rank_of_efficiency(simplex), 2)
    what, rival = "10^6 optimal designs of 4 objectives ranked", f"moocore's filter {plain:.1f} s"
    yield what, f"{ranked:.1f} s", rival, ranked / plain, ""
    X = designs(PARETO, 0.4)
    F = criteria(motion(*X.T, problem.parameters))
    plain = processor_seconds(lambda: moocore.is_nondominated(F, keep_weakly=True), 2)
    plain += processor_seconds(lambda: motion(*X.T, problem.parameters), 2)
    found = processor_seconds(lambda: investigate(problem, PARETO, keep="pareto"), 2)
    what, rival = f"Pareto set of {PARETO} points", f"motion and filter {plain:.2f} s"
    yield what, f"{found:.2f} s", rival, found / plain, ""


def cores() -> Iterator[Row]:
    """Give how much faster two cores are than one, for what a run may keep."""
    for kept, n, one, two in compare_cores(22):
        what, ratio = f"two cores, 2^{n.bit_length() - 1} points: {kept}", one[0] / two[0]
        yield what, f"{ratio:.2f} times one", "1.7", 1.7 / ratio, "cores"


def starts(folder: str) -> Iterator[Row]:
    """Give the figures of the start, all with compiled files."""
    path = os.path.join(folder, "designs.csv")
    rows = np.random.default_rng(0).random((20, 3)).tolist()
    Path(path).write_text("a,b,c\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows))
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": os.path.join(folder, "compiled")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)

    def run(*words: str) -> float:
        """Return the least time of the processor of a new Python."""
        times = []
        for _ in range(6):  # the first one compiles
            before = getrusage(RUSAGE_CHILDREN)
            command = [sys.executable, *words]
            subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
            after = getrusage(RUSAGE_CHILDREN)
            times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        return min(times)

    pandas, ranked = run("-c", "import pandas"), run("-m", "pymoo_psi", "rank", path)
    rival = f"1.25 times `import pandas`, {pandas:.2f} s"
    yield "`pymoo-psi rank`, 20 designs", f"{ranked:.2f} s", rival, ranked / pandas / 1.25, ""
    asked = run("-m", "pymoo_psi", "--help")
    yield "`pymoo-psi --help`", f"{asked:.2f} s", "0.15 s", asked / 0.15, ""
    bare = run("-c", "import pymoo_psi")
    yield "`import pymoo_psi`", f"{bare:.3f} s", "0.03 s", bare / 0.03, ""


def stores(folder: str) -> Iterator[Row]:
    """Give the figures of a study, and what SQLite takes for the same rows."""
    problem, path = VectorizedSphereChute(0.4), os.path.join(folder, "study.db")
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
        plain = processor_seconds(lambda: (db.executemany(insert, rows), db.commit()))
    for what, took, aim, rival, same in (
        ("stored", stored, 150_000, "executemany", plain),
        ("read", read, 300_000, "fetchall", fetched),
    ):
        limit = f"{aim} a second ({rival} {TESTS / same:.0f})"
        yield f"tests {what}", f"{TESTS / took:.0f} a second", limit, aim * took / TESTS, "storage"


def pages() -> Iterator[Row]:
    """Give how long a step of a slider takes on the decision page, where a browser is installed."""
    for n, limit in (20_000, 33), (100_000, 100):
        if find_spec("playwright"):
            command = [sys.executable, "-m", "benchmarks.page", str(n)]
            text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            worst = max(int(took) for took in re.findall(r" [fx]1 +(\d+) +\d+ +\d+$", text, re.M))
            what = f"page of {n} designs: a slider's step, median of the slowest kind"
            yield what, f"{worst} ms", f"{limit} ms", worst / limit, "page"


def main() -> None:
    """Print each row when it is measured, and put the table into the README."""
    rows = ["| what | figure | rival or limit | ratio | in detail |", "|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        for part in (motions(), fronts(), cores(), starts(folder), stores(folder), pages()):
            for what, figure, limit, ratio, module in part:
                command = f"`python -m benchmarks.{module}`" if module else ""
                rows.append(f"| {what} | {figure} | {limit} | {ratio:.2f} | {command} |")
                print(rows[-1], flush=True)
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"],
        cwd=README.parent,
        capture_output=True,
        text=True,
    ).stdout.strip()
    table = "\n".join([f"{describe_machine()}; commit {commit}", "", *rows])
    before, rest = README.read_text("utf-8").split(BEGIN)
    README.write_text(f"{before}{BEGIN}\n\n{table}\n\n{END}{rest.split(END)[1]}", "utf-8")


if __name__ == "__main__":
    main()
