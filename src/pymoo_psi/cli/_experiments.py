"""``pymoo-psi compare`` and ``reproduce``: algorithms at equal cost, and the chute's paper."""

from __future__ import annotations

import shlex
import shutil
import sys
from pathlib import Path
from tempfile import mkdtemp

import pandas as pd

from pymoo_psi._validation import counted, integer, job_count
from pymoo_psi.cli._app import Compare, ModelName, Reproduce
from pymoo_psi.cli._output import (
    keeping,
    print_frame,
    progress,
    require_folder,
    require_results,
    say,
    write_csv,
)
from pymoo_psi.cli._problem import load_problem
from pymoo_psi.cli._source import counts_in
from pymoo_psi.comparison import INDICATORS, compare, conclusions
from pymoo_psi.paper import PAPER_MU, Case, reproduce
from pymoo_psi.parallel import in_parallel
from pymoo_psi.plots import paper_figures, plot_indicators, save_figures, shown_case
from pymoo_psi.problems import problem_name

# What the headings of the tables mean; the distance has no symbol, as μ is the friction here.
_HEADINGS = """mu: friction coefficient
design: number of the LPτ test point; 'printed' is the paper's row
f1: time; f2: energy balance; f3: height, the slope tan α; f4: speed of the plane; no units"""


def run_compare(options: Compare) -> int:
    """Compare, write all there is to a folder, and print the medians and the conclusions."""
    problem, out = load_problem(options.problem, options.context), options.out
    rule = "numbers of evaluations, each 1 or more, such as 256,1024,4096"
    given = options.evaluations
    budgets = None if given is None else counts_in("--evaluations", given, rule)
    integer("--seeds", options.seeds, minimum=1)
    job_count("--jobs", options.jobs)
    folder = None
    if out is not None:
        folder = require_results(
            out, ["runs.csv", "summary.csv", "tests.csv", "indicators.*"], force=options.force
        )
    # Runs without a folder for results are kept, too, until all are done.
    place = folder or Path(mkdtemp(prefix="comparison_"))

    def kept() -> str:
        runs = counted(len([*place.glob("runs/*.db")]), "run")
        where = "" if folder else f" with --out {shlex.quote(str(place))}"
        return f"{runs} kept; the same command{where} continues"

    try:
        with keeping(kept):
            result = compare(
                problem,
                n_evaluations=budgets,
                seeds=options.seeds,
                algorithms=list(dict.fromkeys(map(str.strip, options.algorithms.split(",")))),
                folder=place / "runs",
                n_jobs=options.jobs,
            )
    finally:
        if folder is None and not isinstance(sys.exc_info()[1], KeyboardInterrupt):
            shutil.rmtree(place, ignore_errors=True)
    summary = result.summary()
    if folder is not None:  # before anything is printed, which may fail
        write_csv(result.to_frame(), folder / "runs.csv")
        write_csv(summary, folder / "summary.csv")
        tests = [result.tests(name).assign(indicator=name) for name in INDICATORS]
        write_csv(pd.concat(tests, ignore_index=True), folder / "tests.csv")
        save_figures([("indicators", plot_indicators(result))], folder, 200, ".png")
    columns = [*INDICATORS, "n_nondominated", "seconds"]
    medians = summary[["evaluations", "algorithm", "runs", *columns]].copy()
    quartiles = summary[["runs", "hypervolume_q1", "hypervolume_q3"]].to_numpy(float)
    texts = ["" if runs == 1 else f"{low:.4f} to {high:.4f}" for runs, low, high in quartiles]
    medians.insert(4, "quartiles", texts)
    medians["n_nondominated"] = medians["n_nondominated"].round().astype(int)
    medians["seconds"] = [f"{seconds:.4f}" for seconds in medians["seconds"]]
    heads = {"n_nondominated": "designs", "igd_plus": "IGD+", "optimum_distance": "to optimum"}
    title = f"{problem_name(problem)}: medians over the runs"
    print_frame(medians.rename(columns=heads).round(4), title, lead=2)
    for sentence in conclusions(result):
        say(sentence)
    if out is not None:
        say(f"Tables, the figure and the runs written to {out}")
    return 0


def run_reproduce(options: Reproduce) -> int:
    """Compute the tables, print them with the paper's rows, and write them."""
    out, points, jobs = options.out, options.points, options.jobs
    integer("--points", points, minimum=1)
    job_count("--jobs", jobs)
    require_results(out, ["table_6_1.csv", "table_6_2.csv", "figure_*"], force=options.force)
    models = [each.value for each in ModelName if options.model in (None, each)]
    # The full model's are the results; those of the other one only check print.
    folders = {model: out / model if model == "rolling" else out for model in models}
    for folder in folders.values():
        folder.mkdir(exist_ok=True)
        require_folder(folder, str(folder))
    suffix = f".{options.figures.value}"
    coefficients = tuple(options.mu or PAPER_MU)
    # A set of figures for each model, beside the cases.
    with progress("cases", len(models) * (len(coefficients) + 1)) as show:
        done = 0

        def step(what: str) -> None:
            nonlocal done
            done += 1
            show(done, what)

        def advance(case: Case) -> None:
            step(f"mu = {case.mu}, {case.model} model")

        result = reproduce(points, mu=coefficients, models=models, n_jobs=jobs, on_case=advance)

        def draw(model: str) -> str:
            save_figures(paper_figures(result, model=model), folders[model], 200, suffix)
            return model

        # Figures take most of the time, so that a second process is worth its start.
        for _, model in in_parallel(draw, models, min(jobs, len(models)) if jobs > 0 else jobs):
            step(f"figures, {model} model")
    table_6_1, table_6_2 = result.table_6_1(), result.table_6_2()
    write_csv(table_6_1, out / "table_6_1.csv")
    write_csv(table_6_2, out / "table_6_2.csv")

    say(f"{counted(points, 'LPτ test point')} for each of {counted(len(result.cases), 'case')}.")
    print_frame(_stacked(table_6_1), "Table 6.1: Salukvadze optima")
    print_frame(_stacked(table_6_2), "Table 6.2: designs of rank 5 with f4 below the optimum's")
    for line in _HEADINGS.splitlines():
        say(line)
    if "rolling" in models:
        say("rolling: rolls from the start (Eq. 2.20); the published tables follow from it.")
    if "full" in models:
        say("full: slips, then rolls (Eqs. 2.16-2.21), as the paper's model is written.")
    written = [f"of the {model} model to {folder}" for model, folder in folders.items()]
    say(f"Tables written to {out}, figures {' and '.join(written)}.")
    if len(coefficients) > 1:
        shown = shown_case(result, models[0]).mu
        say(f"Figures 3 to 8 are of mu = {shown:g}; for those of another give it as the only --mu.")
    return 0


def _stacked(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table to print: below each computed row the printed one.

    Side by side they would be wider than a terminal, and are compared number by number.
    """
    criteria = ["f1", "f2", "f3", "f4"]
    rows: list[dict[str, object]] = []
    # The rolling model first, which the paper's tables follow from.
    ordered = table.sort_values(["model", "mu"], ascending=[False, True], kind="stable")
    for row in ordered.to_dict("records"):
        case = {"model": row["model"], "mu": f"{row['mu']:g}"}
        rows.append(case | {"design": row["test_point"]} | {f: row[f] for f in criteria})
        if row["paper_f1"] == row["paper_f1"]:  # not missing
            rows.append(case | {"design": "printed"} | {f: row[f"paper_{f}"] for f in criteria})
    return pd.DataFrame(rows, columns=["model", "mu", "design", *criteria]).round(4)
