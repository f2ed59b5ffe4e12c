"""``pymoo-psi compare`` and ``reproduce``: algorithms at equal cost, and the chute's paper."""

from __future__ import annotations

import re
from functools import partial
from itertools import count
from pathlib import Path

import pandas as pd

from pymoo_psi._validation import counted
from pymoo_psi.algorithms import progress_bar
from pymoo_psi.chute import ModelName
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._console import print_columns, results_folder, say, write_frame
from pymoo_psi.cli._problem import load_problem
from pymoo_psi.comparison import INDICATORS, Comparison, compare
from pymoo_psi.paper import PAPER_MU, Reproduction, reproduce
from pymoo_psi.parallel import in_parallel
from pymoo_psi.plots import paper_figures, plot_indicators, save_figures
from pymoo_psi.problems import problem_name
from pymoo_psi.table import entries_of

# Explains the headings and the words of the tables.
_HEADINGS = """mu: friction; test_point: number of the LPτ point; 1356 in the paper is 2571
f1: time; f2: energy balance; f3: height, the slope tan α; f4: speed of the plane; no units
paper_f1 to paper_f4: as the paper prints them
rolling: rolls from the start (Eq. 2.20); the published tables follow from it
full: slips, then rolls (Eqs. 2.16-2.21), as the paper's model is written
rank of efficiency: of the paper; 6 is the optimum; lower ranks are no places (see guide method)"""
_OF_COMPARISONS = """hypervolume: of all evaluated designs, a share of the box of the reference
effect: the probability that a run of 'better' is better than one of 'worse'
p_holm: exact rank-sum test (Mann-Whitney), corrected for all lines (Holm)
An algorithm without random numbers, such as psi, has 1 run: against it, exact sign test"""
_TITLES = {
    "6_1": "Table 6.1: Salukvadze optima",
    "6_2": "Table 6.2: designs whose rank of efficiency is 5, with f4 below the optimum's",
}


def run_compare(options: Options) -> int:
    """Compare algorithms, write all results to a folder, print the medians and the tests."""
    problem = load_problem(options)
    name = problem_name(problem)
    out = options.out or Path("comparison_" + re.sub(r"\W+", "_", name))
    folder = results_folder(out)
    try:
        result = compare(
            problem,
            n_evaluations=options.evaluations,
            seeds=options.seeds,
            algorithms=entries_of([options.algorithms]),
            folder=folder / "runs",
            n_jobs=options.jobs,
        )
    except KeyboardInterrupt:
        remedy = f"finished runs are kept in {out}; the same command continues"
        raise KeyboardInterrupt(remedy) from None
    _write_comparison(result, folder)  # first, as printing may fail
    _print_comparison(result, name)
    say(f"Tables, figures and the runs written to {out}")
    return 0


def _write_comparison(result: Comparison, folder: Path) -> None:
    tests = [result.tests(name).assign(indicator=name) for name in INDICATORS]
    write_frame(result.to_frame(), folder / "runs.csv")
    write_frame(result.summary(), folder / "summary.csv")
    write_frame(pd.concat(tests, ignore_index=True), folder / "tests.csv")
    save_figures([("indicators", plot_indicators(result))], folder, dpi=200)


def _print_comparison(result: Comparison, name: str) -> None:
    """Print the medians of each algorithm, and the tests of their differences."""
    columns = ["evaluations", "algorithm", "runs", *INDICATORS, "n_nondominated", "seconds"]
    headings = {
        "evaluations": "tests",
        "n_nondominated": "designs",
        "igd_plus": "IGD+",
        "optimum_distance": "to optimum",
    }
    medians = result.summary()[columns].rename(columns=headings)
    medians["seconds"] = medians["seconds"].map("{:.4f}".format)
    print_columns(medians.items(), f"{name}: medians over the runs", n_keys=2)
    tests = result.tests().drop(columns="p").rename(columns=headings)
    title = "Hypervolume by pairs; a difference is significant where p_holm < 0.05"
    print_columns(tests.items(), title)
    say(*_OF_COMPARISONS.splitlines())


def run_reproduce(options: Options) -> int:
    """Compute the tables, write them and the figures, and print the tables."""
    folder = results_folder(options.out)
    result = _reproduced(options)
    points = counted(options.points, "LPτ test point")
    say(f"{points} for each of {counted(len(result.cases), 'case')}.")
    for name, table in {"6_1": result.table_6_1(), "6_2": result.table_6_2()}.items():
        write_frame(table, folder / f"table_{name}.csv")
        values = table[table.columns[3:]]  # in four decimals, as printed
        texts = values.map("{:.4f}".format, na_action="ignore")
        print_columns(table.assign(**texts).items(), _TITLES[name], n_keys=2)
    say(*_HEADINGS.splitlines())
    say(f"Tables and figures written to {options.out}.")
    return 0


def _reproduced(options: Options) -> Reproduction:
    """Solve the cases and draw their figures, and show the progress."""
    mu = [*dict.fromkeys(options.mu or PAPER_MU)]
    models: list[ModelName] = ["rolling", "full"]  # the printed tables follow from the first
    if options.model is not None:
        models = [options.model]
    n_steps = len(models) * (len(mu) + 1)  # each model has its cases and a set of figures
    steps = count(1)
    with progress_bar(True) as show:

        def show_step(note: str) -> None:
            show(next(steps) / n_steps, note)

        result = reproduce(
            options.points,
            mu=mu,
            models=models,
            n_jobs=options.jobs,
            callback=lambda case: show_step(f"mu = {case.mu}, {case.model} model"),
        )
        # Figures take most of the time, so that a second process is worth its start.
        draw = partial(_draw_paper, result, options.out)
        for number, _ in in_parallel(draw, models, options.jobs):
            show_step(f"figures of the {models[number]} model")
    return result


def _draw_paper(result: Reproduction, out: Path, model: ModelName) -> None:
    """Write the figures of a model, those of the full one into a folder of its own."""
    if model == "full":
        out /= "full"
    save_figures(paper_figures(result, model=model), results_folder(out), dpi=200)
