"""PSI compared with NSGA-III on sixteen problems: the benchmark in ``benchmarks/comparison.md``.

All of it takes some thirty minutes on two cores; it continues after an interruption:

    python -m benchmarks.comparison

To repeat some rows, measured against the stored references of the whole benchmark (PSI's numbers
are then the same to the last digit, and the others use the same seeds):

    python -m benchmarks.comparison zdt1 --algorithms psi,nsga3 --evaluations 256,1024
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from benchmarks.comparison_problems import PROBLEMS, keep_reference, kept_reference, known_front
from benchmarks.machine import describe_machine, output, sized, write_block
from pymoo_psi.comparison import INDICATORS, Comparison, compare
from pymoo_psi.plots import plot_indicator

HERE = Path(__file__).parent
PICTURES = output(HERE / "pictures")
PAGE = output(HERE / "comparison.md")
TABLE = output(HERE / "comparison.csv")
BUDGETS = sized((256, 1024, 4096, 16384), (64,))
ALGORITHMS = ("psi", "psi-scrambled", "nsga3", "psi+nsga3", "psi-scrambled+nsga3")
SEEDS = sized(11, 2)
NAMES = sized([*PROBLEMS], ["chute-rolling-0.4", "bnh", "zdt1"])
SIGNIFICANCE = 0.05
BEGIN = "<!-- comparison: written by python -m benchmarks.comparison -->"
END = "<!-- end -->"


def whole_benchmark(folder: Path, jobs: int) -> None:
    """Run everything; write references, pictures, the CSV file and ``comparison.md``."""
    comparisons: dict[str, Comparison] = {}
    for name in NAMES:
        problem = PROBLEMS[name]()
        comparison = compare(
            problem,
            n_evaluations=BUDGETS,
            seeds=SEEDS,
            algorithms=ALGORITHMS,
            reference_front=known_front(name, problem),
            folder=folder / name,
            n_jobs=jobs,
        )
        comparisons[name] = comparison
        keep_reference(name, comparison.reference)
        print(f"{name}: {len(comparison.runs)} runs measured", flush=True)
    summaries(comparisons).to_csv(TABLE, index=False)
    pictures(comparisons)
    write_block(PAGE, BEGIN, END, [f"On {describe_machine()}.", "", *wins(comparisons)])


def some_rows(names: list[str], algorithms: list[str], budgets: list[int], jobs: int) -> None:
    """Repeat rows of the benchmark and print their measures."""
    columns = ["evaluations", "algorithm", "runs"]
    for indicator in INDICATORS:
        columns += [indicator, f"{indicator}_q1", f"{indicator}_q3"]
    for name in names:
        comparison = compare(
            PROBLEMS[name](), n_evaluations=budgets, seeds=SEEDS, algorithms=algorithms, n_jobs=jobs
        )
        reference = kept_reference(name)
        measures = comparison.to_frame()
        for k, run in enumerate(comparison.runs):
            for indicator, value in reference.measure(run.F).items():
                measures.loc[k, indicator] = value
        comparison = replace(comparison, reference=reference, measures=measures)
        print(f"{name}\n{comparison.summary()[columns].to_string(index=False)}\n", flush=True)


def summaries(comparisons: dict[str, Comparison]) -> pd.DataFrame:
    """Return the summaries of all problems as one frame."""
    frames = []
    for name, comparison in comparisons.items():
        frame = comparison.summary()
        frame.insert(0, "problem", name)
        frames.append(frame)
    return pd.concat(frames, ignore_index=True)


def wins(comparisons: dict[str, Comparison]) -> list[str]:
    """Return a table: how often an algorithm is significantly better or worse than NSGA-III."""
    groups: dict[str, list[str]] = {"chute": [], "2 to 4 variables": [], "6 to 30 variables": []}
    for name in NAMES:
        if name.startswith("chute"):
            groups["chute"].append(name)
        elif PROBLEMS[name]().n_var <= 4:
            groups["2 to 4 variables"].append(name)
        else:
            groups["6 to 30 variables"].append(name)
    heads = " | ".join(f"{budget} evaluations" for budget in BUDGETS)
    lines = [
        f"| against nsga3 | indicator | problems | {heads} |",
        f"|---|---|---|{'---|' * len(BUDGETS)}",
    ]
    for algorithm in ("psi", "psi-scrambled", "psi-scrambled+nsga3"):
        for indicator in ("hypervolume", "igd_plus", "optimum_distance"):
            for group, names in groups.items():
                tests = [comparisons[name].tests(indicator) for name in names]
                scores = " | ".join(_score(tests, algorithm, budget) for budget in BUDGETS)
                lines.append(f"| {algorithm} | {indicator} | {group} ({len(names)}) | {scores} |")
    return lines


def _score(tests: list[pd.DataFrame], algorithm: str, budget: int) -> str:
    """Return how many tests at a budget an algorithm wins and loses against NSGA-III."""
    pair = {algorithm, "nsga3"}
    won = 0
    lost = 0
    for frame in tests:
        significant = (frame["evaluations"] == budget) & (frame["p_holm"] < SIGNIFICANCE)
        of_pair = frame["better"].isin(pair) & frame["worse"].isin(pair)
        better = frame.loc[significant & of_pair, "better"]
        won += int((better == algorithm).sum())
        lost += int((better == "nsga3").sum())
    return f"{won} : {lost}"


def pictures(comparisons: dict[str, Comparison]) -> None:
    """Draw the hypervolume of every problem on one page."""
    figure = Figure(figsize=(11, 11.5), layout="constrained")
    panels = np.ravel(figure.subplots(4, 4))
    for axes, (name, comparison) in zip(panels, comparisons.items(), strict=False):
        plot_indicator(comparison, "hypervolume", axes)
        axes.set_title(f"{name}, {PROBLEMS[name]().n_var} variables", fontsize=9)
        axes.tick_params(labelsize=7)
    panels[0].legend(fontsize=7)
    figure.savefig(PICTURES / "comparison_hypervolume.png", dpi=110)


def main() -> None:
    """Run the whole benchmark, or some rows of it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", choices=[[], *PROBLEMS], metavar="PROBLEM")
    parser.add_argument("--algorithms", default=",".join(ALGORITHMS))
    parser.add_argument("--evaluations", default=",".join(map(str, BUDGETS)))
    parser.add_argument("--jobs", type=int, default=-1)
    parser.add_argument(
        "--folder", type=Path, default=output(HERE / "runs"), help="keeps finished runs"
    )
    arguments = parser.parse_args()
    if not arguments.problems:
        whole_benchmark(arguments.folder, arguments.jobs)
        return
    algorithms = arguments.algorithms.split(",")
    budgets = [int(word) for word in arguments.evaluations.split(",")]
    some_rows(arguments.problems, algorithms, budgets, arguments.jobs)


if __name__ == "__main__":
    main()
