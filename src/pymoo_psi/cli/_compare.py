"""``pymoo-psi compare``: algorithms side by side on a problem, at equal cost."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from pymoo.core.problem import Problem

from pymoo_psi._files import whole_file
from pymoo_psi._validation import counted, integer, job_count
from pymoo_psi.cli._options import numbers_in
from pymoo_psi.cli._output import Log, print_frame, progress_bar, require_results, say, write_csv
from pymoo_psi.comparison import (
    INDICATORS,
    Comparison,
    Reference,
    Run,
    compare,
    conclusions,
    report,
)
from pymoo_psi.pareto import listed
from pymoo_psi.plots import save_comparison


def run_compare(
    problem: Problem,
    evaluations: str,
    seeds: int,
    algorithms: str,
    *,
    assess: str,
    reference: Path | None,
    jobs: int,
    out: Path | None,
    force: bool,
) -> int:
    """Compare, write all there is to a folder, and print the medians and the conclusions."""
    rule = "numbers of evaluations, each 1 or more, such as 256,1024,4096"
    budgets = numbers_in("--evaluations", evaluations, rule)
    integer("--seeds", seeds, minimum=1)
    job_count("--jobs", jobs)
    folder = None
    if out is not None:
        files = ["reference.npz", "runs.csv", "summary.csv", "tests.csv", "report.md"]
        folder = require_results(out, files, force=force)
    # Before the runs, so that a wrong file is told at once.
    known = None if reference is None else Reference.load(reference)
    names = list(dict.fromkeys(word.strip() for word in algorithms.split(",")))
    if learn := [name for name in names if name.startswith("surrogate")]:
        runs = counted(len(learn) * len({*budgets}) * seeds, "run")
        say(
            f"{runs} of {listed(learn)}: surrogates learn anew after every few designs, so that "
            f"some hundred evaluations take up to a minute a run, and thousands far longer. Fewer "
            f"--evaluations or --seeds shorten it."
        )
    with progress_bar() as bar:
        task, log = bar.add_task(f"runs on {problem.name()}", total=None), Log(bar)

        def advance(run: Run, ready: int, total: int) -> None:
            bar.update(task, completed=ready, total=total, description=str(run.task))
            log.tell(f"{ready} of {total} runs done")

        result = compare(
            problem,
            n_evaluations=budgets,
            seeds=seeds,
            algorithms=names,
            assess=assess,
            reference=known,
            folder=None if folder is None else folder / "runs",
            n_jobs=jobs,
            on_run=advance,
        )
    summary = result.summary()
    if folder is not None:  # before anything is printed, which may fail
        _write(result, summary, folder)
    print_frame(_for_print(summary), f"{problem.name()}: medians over the runs", lead=2)
    for sentence in conclusions(result):
        say(sentence)
    if out is not None:
        say(f"Tables, figures, report.md, the reference and the runs written to {out}")
    return 0


def _for_print(summary: pd.DataFrame) -> pd.DataFrame:
    columns = [*INDICATORS, "n_nondominated", "seconds"]
    frame = summary[["evaluations", "algorithm", "runs", *columns]].copy()
    quartiles = summary[["runs", "hypervolume_q1", "hypervolume_q3"]].to_numpy(float)
    texts = ["" if runs == 1 else f"{low:.4f} to {high:.4f}" for runs, low, high in quartiles]
    frame.insert(4, "quartiles", texts)
    frame["n_nondominated"] = frame["n_nondominated"].round().astype(int)
    return frame.rename(
        columns={"n_nondominated": "designs", "igd_plus": "IGD+", "optimum_distance": "to optimum"}
    )


def _write(result: Comparison, summary: pd.DataFrame, folder: Path) -> None:
    write_csv(result.to_frame(), folder / "runs.csv")
    write_csv(summary, folder / "summary.csv")
    tests = [result.tests(name).assign(indicator=name) for name in INDICATORS]
    write_csv(pd.concat(tests, ignore_index=True), folder / "tests.csv")
    with whole_file(folder / "report.md") as written:
        written.write_text(report(result), encoding="utf-8")
    result.reference.save(folder / "reference.npz")
    save_comparison(result, folder)
