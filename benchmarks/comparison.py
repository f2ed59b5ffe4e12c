"""PSI against NSGA-III on sixteen problems: the benchmark in ``benchmarks/README.md``.

All of it, some thirty minutes on two cores; it continues after an interruption:

    python -m benchmarks.comparison

Some rows of it again, measured against the references kept from the whole benchmark, so that PSI's
numbers are the same to the last digit and the others' come from the same seeds:

    python -m benchmarks.comparison zdt1 --algorithms psi,nsga3 --evaluations 256,1024
"""

from __future__ import annotations

import argparse
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from benchmarks.comparison_problems import PROBLEMS, keep_reference, kept_reference, known_front
from benchmarks.machine import describe_machine
from pymoo_psi.comparison import INDICATORS, SIGNIFICANCE, Comparison, compare
from pymoo_psi.plots import plot_indicator

HERE = Path(__file__).parent
PICTURES = HERE / "pictures"
README = HERE / "README.md"
BUDGETS = (256, 1024, 4096, 16384)
ALGORITHMS = ("psi", "psi-scrambled", "nsga3", "psi+nsga3", "psi-scrambled+nsga3")
SEEDS = 11


def whole_benchmark(folder: Path, jobs: int) -> None:
    """Run everything; write references, pictures, CSV files and the table of the README."""
    comparisons: dict[str, Comparison] = {}
    for name, make in PROBLEMS.items():
        problem = make()
        comparisons[name] = compare(
            problem, n_evaluations=BUDGETS, seeds=SEEDS, algorithms=ALGORITHMS,
            reference_front=known_front(name, problem), folder=folder / name, n_jobs=jobs,
        )  # fmt: skip
        keep_reference(name, comparisons[name].reference)
        print(f"{name}: {len(comparisons[name].runs)} runs measured", flush=True)
    every = _joined(comparisons, lambda c: c.summary())
    every.to_csv(HERE / "comparison.csv", index=False)
    pictures(comparisons)
    text = "\n".join(wins(comparisons))
    marks = "<!-- comparison: written by python -m benchmarks.comparison -->", "<!-- end -->"
    block = f"{marks[0]}\n\nOn {describe_machine()}.\n\n{text}\n\n{marks[1]}"
    pattern = f"{re.escape(marks[0])}.*?{re.escape(marks[1])}"
    README.write_text(
        re.sub(pattern, lambda _: block, README.read_text("utf-8"), flags=re.DOTALL), "utf-8"
    )


def some_rows(names: list[str], algorithms: list[str], budgets: list[int], jobs: int) -> None:
    """Run rows of the benchmark again and print their measures."""
    for name in names:
        found = compare(
            PROBLEMS[name](), n_evaluations=budgets, seeds=SEEDS, algorithms=algorithms, n_jobs=jobs
        )
        reference, measures = kept_reference(name), found.to_frame()
        for k, run in enumerate(found.runs):
            for indicator, value in reference.measure(run.F).items():
                measures.loc[k, indicator] = value
        result = replace(found, reference=reference, measures=measures)
        columns = ["evaluations", "algorithm", "runs"]
        for indicator in INDICATORS:
            columns += [indicator, f"{indicator}_q1", f"{indicator}_q3"]
        print(f"{name}\n{result.summary()[columns].to_string(index=False)}\n", flush=True)


def _joined(comparisons: dict[str, Comparison], frame_of: Any) -> pd.DataFrame:
    frames = [frame_of(c).assign(problem=name) for name, c in comparisons.items()]
    joined = pd.concat(frames, ignore_index=True)
    return joined[["problem", *joined.columns.drop("problem")]]


def wins(comparisons: dict[str, Comparison]) -> list[str]:
    """Return how often one algorithm is surely better or worse than NSGA-III."""
    groups: dict[str, list[str]] = {"chute": [], "2 to 4 variables": [], "6 to 30 variables": []}
    for name, make in PROBLEMS.items():
        few = "2 to 4 variables" if make().n_var <= 4 else "6 to 30 variables"
        groups["chute" if name.startswith("chute") else few].append(name)
    lines = [
        "| against nsga3 | indicator | problems | "
        + " | ".join(f"{b} evaluations" for b in BUDGETS)
        + " |",
        f"|---|---|---|{'---|' * len(BUDGETS)}",
    ]
    for algorithm in ("psi", "psi-scrambled", "psi-scrambled+nsga3"):
        for indicator in ("hypervolume", "igd_plus", "optimum_distance"):
            for group, names in groups.items():
                tests = [comparisons[name].tests(indicator) for name in names]
                cells = [_score(tests, algorithm, budget) for budget in BUDGETS]
                label = f"{group} ({len(names)})"
                lines.append(f"| {algorithm} | {indicator} | {label} | {' | '.join(cells)} |")
    return lines


def _score(tests: list[pd.DataFrame], algorithm: str, budget: int) -> str:
    """Return how many tests at a budget an algorithm wins and loses against NSGA-III."""
    pair = {algorithm, "nsga3"}
    won = lost = 0
    for frame in tests:
        at = frame[(frame["evaluations"] == budget) & (frame["p_holm"] < SIGNIFICANCE)]
        row = at[at["better"].isin(pair) & at["worse"].isin(pair)]
        won += int((row["better"] == algorithm).sum())
        lost += int((row["better"] == "nsga3").sum())
    return f"{won} : {lost}"


def pictures(comparisons: dict[str, Comparison]) -> None:
    """Draw the hypervolume of every problem on one page."""
    figure = Figure(figsize=(11, 11.5), layout="constrained")
    panels = np.ravel(figure.subplots(4, 4))
    for axes, (name, comparison) in zip(panels, comparisons.items(), strict=True):
        plot_indicator(comparison, "hypervolume", axes)
        axes.set_title(f"{name}, {PROBLEMS[name]().n_var} variables", fontsize=9)
        axes.tick_params(labelsize=7)
    panels[0].legend(fontsize=7)
    figure.savefig(PICTURES / "comparison_hypervolume.png", dpi=110)


def main() -> None:
    """Run the whole benchmark, or rows of it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", choices=[[], *PROBLEMS], metavar="PROBLEM")
    parser.add_argument("--algorithms", default=",".join(ALGORITHMS))
    parser.add_argument("--evaluations", default=",".join(map(str, BUDGETS)))
    parser.add_argument("--jobs", type=int, default=-1)
    parser.add_argument("--folder", type=Path, default=HERE / "runs", help="keeps finished runs")
    given = parser.parse_args()
    if given.problems:
        budgets = [int(word) for word in given.evaluations.split(",")]
        some_rows(given.problems, given.algorithms.split(","), budgets, given.jobs)
    else:
        whole_benchmark(given.folder, given.jobs)


if __name__ == "__main__":
    main()
