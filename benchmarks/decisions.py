"""A decision directs the next tests: 64 + 32 tests under its limits against 64 + 128 without.

    python -m benchmarks.decisions --seeds 5
    python -m benchmarks.decisions --table

After 64 tests of ``SurrogatePSI``, a decision sets limits on objectives. 32 further tests are
proposed under the limits (``directed``), or 128 without them (``undirected``). Each problem has two
regions of decision, which follow from the best known Pareto set:

- ``middle``: all objectives are worse than at the best compromise by so much of their ranges, at
  most, that a tenth of the set is within these limits.
- ``side``: the same around a design that is better in the first objective than four fifths of the
  set.

Measured within the limits: the hypervolume as a share of the best known one, which is that of the
points of ``references/`` or of the best run; and by how much the distance of the best compromise
from the ideal point exceeds the least known one, in units of the ranges of the best known set
within the limits. Every run is stored in ``decisions.jsonl`` when it is finished.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import moocore
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pymoo.optimize import minimize

from benchmarks.learning import PROBLEMS, reference_of
from benchmarks.machine import output, sized, write_block
from pymoo_psi import Formulation, QMCSampling, SurrogatePSI, TestTable
from pymoo_psi.pareto import nondominated

Array = NDArray[np.float64]

KEPT = output(Path(__file__).parent / "decisions.jsonl")
PAGE = output(Path(__file__).parent / "decisions.md")
BEGIN = "<!-- decisions -->"
END = "<!-- end decisions -->"
# Ways to direct a search were compared on these, so that their numbers are optimistic.
TUNED = ("osy", "truss2d", "welded_beam", "dtlz2", "bnh", "cre22")
HELD_OUT = (
    "rcm12",
    "rcm18",
    "stepped_cantilever",
    "rcm21",
    "cre24",
    "rcm13",
    "ten_bar_truss",
    "cre32",
    "rcm19",
    "carside",
)
N_FIRST, N_DIRECTED, N_UNDIRECTED = sized((64, 32, 128), (16, 4, 8))
NEAR = 0.01
SHARE = 0.1  # of the best known Pareto set that is within the limits of a region


class Region(NamedTuple):
    """A region of decision.

    Attributes:
        name: Its name.
        limits: ``(m,)`` greatest values allowed.
        front: ``(n, m)`` the best known objectives within the limits.
    """

    name: str
    limits: Array
    front: Array

    @property
    def formulation(self) -> Formulation:
        """The decision."""
        limits = {f"f{j}": float(limit) for j, limit in enumerate(self.limits, 1)}
        return Formulation(limits=limits)

    def measured(self, F: Array) -> dict[str, float]:
        """Return hypervolume and distance of the best compromise for designs within the limits."""
        low = self.front.min(axis=0)
        ranges = np.ptp(self.front, axis=0)
        corner = (self.limits - low) / ranges
        scaled = (F - low) / ranges
        hypervolume = 0.0
        distance = np.inf
        if len(F) > 0:
            hypervolume = moocore.hypervolume(scaled, ref=corner)
            # better than the best known value is no worse than equal to it
            distance = np.linalg.norm(np.maximum(scaled, 0), axis=1).min()
        return {"hypervolume": hypervolume, "distance": distance}


def regions(name: str) -> list[Region]:
    """Return the two regions of decision of a problem."""
    reference = reference_of(name)
    scaled = reference.points
    low = reference.frame.ideal
    ranges = reference.frame.nadir - low
    front = low + scaled * ranges
    order = np.argsort(scaled[:, 0])
    designs = {
        "middle": np.linalg.norm(scaled, axis=1).argmin(),
        "side": order[len(order) // 5],
    }
    found = []
    for region, row in designs.items():
        margins = (scaled - scaled[row]).max(axis=1)
        margin = np.quantile(margins, SHARE)
        limits = low + (scaled[row] + margin) * ranges
        found.append(Region(region, limits, front[margins <= margin]))
    return found


def within(table: TestTable, region: Region) -> Array:
    """Return the Pareto-optimal objectives of the tests within the limits of a region."""
    F = table.F[table.feasible()]
    F = F[(region.limits >= F).all(axis=1)]
    if len(F) == 0:
        return F
    return F[nondominated(F)]


def tests(name: str, seed: int, n: int, **options: Any) -> TestTable:
    """Return n tests of ``SurrogatePSI``."""
    algorithm = SurrogatePSI(n, sampling=QMCSampling("sobol"), **options)
    result = minimize(PROBLEMS[name](), algorithm, seed=seed)
    table: TestTable = result.algorithm.table.under(Formulation())
    return table


def row_of(
    name: str, region: Region, seed: int, entry: str, F: Array, seconds: float
) -> dict[str, Any]:
    """Return what is stored of a run that has found the objectives F within the limits."""
    row: dict[str, Any] = {"problem": name, "region": region.name, "seed": seed, "entry": entry}
    for measured, value in region.measured(F).items():
        row[measured] = float(f"{value:.6g}")
    row["seconds"] = round(seconds, 2)
    return row


def run(name: str, seed: int) -> list[dict[str, Any]]:
    """Perform the tests of a problem with a seed, and measure them in its regions."""
    rows = []
    with TemporaryDirectory() as folder:
        first = Path(folder, "first.db")
        tests(name, seed, N_FIRST, study=first)
        content = first.read_bytes()
        tables = {}
        for region in regions(name):
            study = Path(folder, f"{region.name}.db")
            study.write_bytes(content)
            began = time.process_time()
            directed = tests(
                name, seed, N_FIRST + N_DIRECTED, study=study, formulation=region.formulation
            )
            tables[region.name] = directed, time.process_time() - began
        began = time.process_time()
        undirected = tests(name, seed, N_FIRST + N_UNDIRECTED, study=first)
        seconds = time.process_time() - began
    for region in regions(name):
        directed, seconds_directed = tables[region.name]
        entries = {
            "first": (undirected.take(np.arange(N_FIRST)), 0.0),
            "directed": (directed, seconds_directed),
            "undirected": (undirected, seconds),
        }
        for entry, (table, seconds_of_entry) in entries.items():
            F = within(table, region)
            rows.append(row_of(name, region, seed, entry, F, seconds_of_entry))
    return rows


def results() -> pd.DataFrame:
    """Return the stored runs, with their shares of the best known hypervolume."""
    rows = []
    if KEPT.exists():
        rows = [json.loads(line) for line in KEPT.read_text("utf-8").splitlines()]
    frame = pd.DataFrame(rows)
    if frame.empty:
        return frame
    best = {}
    least = {}
    for name in frame["problem"].unique():
        for region in regions(name):
            known = region.measured(region.front)
            best[name, region.name] = known["hypervolume"]
            least[name, region.name] = known["distance"]
    case = frame.groupby(["problem", "region"])
    keys = [*zip(frame["problem"], frame["region"], strict=True)]
    known_best = np.array([best[key] for key in keys])
    known_least = np.array([least[key] for key in keys])
    frame["share"] = frame["hypervolume"] / np.maximum(
        case["hypervolume"].transform("max"), known_best
    )
    frame["excess"] = frame["distance"] - np.minimum(case["distance"].transform("min"), known_least)
    return frame


def table(frame: pd.DataFrame) -> list[str]:
    """Return the table in Markdown: medians, and in parentheses the worst run."""
    lines = [
        "| problem, region | 64 | 64 + 32 directed | 64 + 128 undirected | directed ahead "
        "| best compromise within 0.01: directed | undirected |",
        f"|---|{'---|' * 6}",
    ]
    for name in (*TUNED, *HELD_OUT):
        for region in ("middle", "side"):
            runs = frame[(frame["problem"] == name) & (frame["region"] == region)]
            if runs.empty:
                continue
            shares = runs.pivot_table(index="seed", columns="entry", values="share")
            excess = runs.pivot_table(index="seed", columns="entry", values="excess")
            cells = []
            for entry in ("first", "directed", "undirected"):
                values = shares[entry]
                cells.append(f"{values.median():.3f} ({values.min():.3f})")
            n = len(shares)
            cells.append(f"{(shares['directed'] > shares['undirected']).sum()} of {n}")
            for entry in ("directed", "undirected"):
                cells.append(f"{(excess[entry] <= NEAR).sum()} of {n}")
            label = name if name in TUNED else f"{name} ◦"
            lines.append(f"| {label}, {region} | {' | '.join(cells)} |")
    return lines


def summary(frame: pd.DataFrame) -> list[str]:
    """Return what the runs say, of problems for tuning and of the others."""
    lines = []
    for title, names in (("Problems used for choosing", TUNED), ("Others", HELD_OUT)):
        runs = frame[frame["problem"].isin(names)]
        if runs.empty:
            continue
        index = ["problem", "region", "seed"]
        shares = runs.pivot_table(index=index, columns="entry", values="share")
        excess = runs.pivot_table(index=index, columns="entry", values="excess")
        ahead = (shares["directed"] > shares["undirected"]).mean()
        behind = (shares["directed"] < shares["undirected"]).mean()
        near = (excess[["directed", "undirected"]] <= NEAR).mean()
        shortfall = ((1 - shares["undirected"]) / (1 - shares["directed"]).clip(1e-4)).median()
        lines.append(
            f"- {title}: {len(shares)} cases; directed ahead in {100 * ahead:.0f} %, behind in "
            f"{100 * behind:.0f} %; what is missing {shortfall:.1f} times smaller in the median; "
            f"best compromise within {NEAR}: {100 * near['directed']:.0f} % against "
            f"{100 * near['undirected']:.0f} %; "
            f"shares below 0.05: {(shares['directed'] < 0.05).sum()} against "
            f"{(shares['undirected'] < 0.05).sum()}"
        )
    return lines


def main(arguments: Sequence[str] | None = None) -> None:
    """Perform the missing runs and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", default=sized([*TUNED, *HELD_OUT], ["bnh"]))
    parser.add_argument("--seeds", type=int, default=sized(5, 6))
    parser.add_argument("--table", action="store_true", help="only the table of the stored runs")
    options = parser.parse_args(arguments)
    if not options.table:
        frame = results()
        done = set()
        if not frame.empty:
            done = {*zip(frame["problem"], frame["seed"], strict=True)}
        for seed in range(options.seeds):
            for name in options.problems:
                if (name, seed) in done:
                    continue
                rows = run(name, seed)
                with KEPT.open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps(row) + "\n" for row in rows)
                print(name, seed, [row["hypervolume"] for row in rows], flush=True)
    frame = results()
    lines = [*summary(frame), "", *table(frame)]
    print("\n".join(lines))
    write_block(PAGE, BEGIN, END, lines)


if __name__ == "__main__":
    main()
