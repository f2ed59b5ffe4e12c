"""Every short figure beside its rival or limit, in one run: the table at the top of the README.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks

All times are those of the processor, which other work on the machine disturbs least.
"""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import moocore
import numpy as np

from benchmarks.machine import describe_machine, processor_seconds
from benchmarks.motion import compare_speed, designs
from pymoo_psi import TestTable, VectorizedSphereChute, investigate, rank_of_efficiency
from pymoo_psi.chute import ChuteParameters, criteria, motion

README = Path(__file__).with_name("README.md")
BEGIN, END = "<!-- figures: written by python -m benchmarks -->", "<!-- end figures -->"
POINTS = 200_000

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
    X = designs(POINTS, 0.4)
    F = criteria(motion(*X.T, problem.parameters))
    spread = np.random.default_rng(0).exponential(size=(POINTS // 2, 4))
    simplex = spread / spread.sum(axis=1, keepdims=True)
    plain = processor_seconds(lambda: moocore.is_nondominated(simplex, keep_weakly=True), 2)
    ranked = processor_seconds(lambda: rank_of_efficiency(simplex), 2)
    what = f"ranks of {POINTS // 2} optimal designs of 4 objectives"
    yield (
        what,
        f"{ranked:.2f} s",
        f"moocore's filter {plain:.2f} s",
        ranked / plain,
        "investigation",
    )
    plain = processor_seconds(lambda: moocore.is_nondominated(F, keep_weakly=True), 2)
    plain += processor_seconds(lambda: motion(*X.T, problem.parameters), 2)
    found = processor_seconds(lambda: investigate(problem, POINTS, keep="pareto"), 2)
    what, rival = f"Pareto set of {POINTS} points", f"motion and filter {plain:.2f} s"
    yield what, f"{found:.2f} s", rival, found / plain, "investigation"


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
    """Give the figures of a study, beside what SQLite takes for the same rows."""
    problem, path = VectorizedSphereChute(0.4), os.path.join(folder, "study.db")
    bare = processor_seconds(lambda: investigate(problem, POINTS))
    stored = processor_seconds(lambda: investigate(problem, POINTS, study=path)) - bare
    read = processor_seconds(lambda: TestTable.read_study(path), 2)
    with closing(sqlite3.connect(path)) as db:
        (table,) = db.execute("SELECT sql FROM sqlite_master WHERE name = 'tests'").fetchone()
        rows = db.execute("SELECT * FROM tests").fetchall()
    with closing(sqlite3.connect(os.path.join(folder, "plain.db"))) as db:
        db.execute(table)
        insert = f"INSERT INTO tests VALUES ({', '.join('?' * len(rows[0]))})"
        plain = processor_seconds(lambda: (db.executemany(insert, rows), db.commit()))
        fetched = processor_seconds(lambda: db.execute("SELECT * FROM tests").fetchall(), 2)
    for what, took, rival, limit in (
        ("stored", stored, "executemany", plain),
        ("read", read, "fetchall", fetched),
    ):
        rates = [f"{POINTS / seconds:.0f} a second" for seconds in (took, limit)]
        yield f"tests {what}", rates[0], f"{rival} {rates[1]}", took / limit, "storage"


def main() -> None:
    """Print the table, and put it into the README."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [*motions(), *fronts(), *starts(folder), *stores(folder)]
    lines = [
        "| what | figure | rival or limit | ratio | alone, in detail |",
        "|---|---|---|---|---|",
    ]
    for what, figure, limit, ratio, module in rows:
        command = f"`python -m benchmarks.{module}`" if module else ""
        lines.append(f"| {what} | {figure} | {limit} | {ratio:.2f} | {command} |")
    table = "\n".join([describe_machine(), "", *lines])
    print(table)
    before, rest = README.read_text("utf-8").split(BEGIN)
    README.write_text(f"{before}{BEGIN}\n\n{table}\n\n{END}{rest.split(END)[1]}", "utf-8")


if __name__ == "__main__":
    main()
