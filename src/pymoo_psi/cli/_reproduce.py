"""``pymoo-psi reproduce``: the paper's tables, computed and compared."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd

from pymoo_psi._validation import integer, job_count
from pymoo_psi.cli._output import print_frame, progress_bar, require_folder, say, write_csv
from pymoo_psi.paper import PAPER_POINTS, Case, Reproduction, reproduce
from pymoo_psi.plots import points_page, save_figures
from pymoo_psi.plots._style import save_pages


def run_reproduce(out: Path, points: int, jobs: int, figures: str = "png") -> int:
    """Compute, print, compare and write the tables; return 1 if the paper is not matched."""
    integer("--points", points, minimum=1)
    job_count("--jobs", jobs)
    rolling = out / "rolling"
    rolling.mkdir(parents=True, exist_ok=True)
    require_folder(rolling, str(rolling))
    with progress_bar() as bar:
        # Three coefficients by two models, and a set of figures for each model.
        task = bar.add_task("Cases (friction coefficient, model)", total=8)

        def step(done: str) -> None:
            bar.update(task, advance=1, description=done)
            if bar.disable:  # no terminal: a line each, so that a log shows that it goes on
                with suppress(OSError):
                    print(f"done: {done}", file=sys.stderr, flush=True)

        def advance(case: Case) -> None:
            step(f"mu = {case.mu}, {case.model} model")

        result = reproduce(points, n_jobs=jobs, on_case=advance)
        for model, folder in (("full", out), ("rolling", rolling)):
            save_figures(result, folder, model=model, suffix=f".{figures}")
            step(f"figures, {model} model")
    table_6_1, table_6_2 = result.table_6_1(), result.table_6_2()
    write_csv(table_6_1, out / "table_6_1.csv")
    write_csv(table_6_2, out / "table_6_2.csv")
    write_csv(result.continuous_optima(), out / "continuous_optima.csv")

    with_refined = _beside(table_6_1, result.continuous_optima())
    print_frame(with_refined, "Table 6.1: Salukvadze optimal solutions")
    print_frame(_for_print(table_6_2), "Table 6.2: designs of rank 5 with f4 below the optimum's")
    say("'continuous': the best test point polished inside the box, against the same U and N.")
    say("Distances are plain, as in the paper; solve and rank take plain ones by --no-normalize.")
    say("The published tables follow from the rolling model (rolling from the start, Eq. 2.20).")
    say("The full model (slip, then roll, Eqs. 2.16-2.21) gives its own rows, listed as 'full'.")
    if points >= 8:  # fewer have no halves to compare with
        write_csv(_by_tests(result), out / "convergence.csv")
        save_pages([("convergence.png", points_page(result))], out, dpi=200)
        for line in _enough(result):
            say(line)
    say(f"Tables and figures of the full model written to {out}, of the rolling model to {rolling}")
    say(_closing_line(result))
    # Other numbers of points have optima of their own, which say nothing about the paper's.
    return 0 if points != PAPER_POINTS or all(result.agreement().values()) else 1


def _by_tests(result: Reproduction) -> pd.DataFrame:
    """Return what the first n points of each case would have decided."""
    return pd.concat(
        [
            pd.DataFrame({"model": case.model, "mu": case.mu}, index=[0]).merge(
                rows.to_frame().reset_index(), how="cross"
            )
            for case, rows in zip(result.cases, result.convergences, strict=True)
        ]
    )


def _enough(result: Reproduction) -> list[str]:
    """Say for each model whether more points would change the optimum by more than 1 %."""
    told = []
    for model in dict.fromkeys(case.model for case in result.cases):
        pairs = zip(result.cases, result.convergences, strict=True)
        found = [(case, rows) for case, rows in pairs if case.model == model]
        gains = np.array([rows.gains() for _, rows in found])
        if np.isnan(gains).any():
            told.append(f"{model} model: {result.n_points} points are too few to tell.")
            continue
        nearer, larger = 100 * gains.max(axis=0)
        left = max(100 * (1 - c.refined.distance / c.refined.start_distance) for c, _ in found)
        moved = max(100 * rows.moved[-1] for _, rows in found)
        answer = "not enough" if max(nearer, larger) > 1 else "enough, to 1 %"
        told.append(
            f"{model} model: {result.n_points} points are {answer}. Twice as many would bring the "
            f"optimum about {nearer:.2g} % nearer to U at most, and {larger:.2g} % hypervolume; "
            f"the last doubling moved it by up to {moved:.2g} % of a criterion's range, and the "
            f"continuous optimum is up to {left:.2g} % nearer."
        )
    return told


def _for_print(table: pd.DataFrame) -> pd.DataFrame:
    shorter = {name: name.replace("paper_", "paper ") for name in table.columns}
    return table.rename(columns=shorter).assign(mu=table["mu"].map(str))


def _beside(table: pd.DataFrame, optima: pd.DataFrame) -> pd.DataFrame:
    """Put the continuous optimum of each case under its best test point, with their distances."""
    points = table.merge(optima[["model", "mu", "best_point_distance"]], on=["model", "mu"])
    points = points.rename(columns={"best_point_distance": "distance"})
    continuous = optima.drop(columns="best_point_distance").assign(test_point="continuous")
    both = pd.concat([points.astype({"test_point": str}), continuous], ignore_index=True)
    rolling_first = both.sort_values(["model", "mu"], ascending=[False, True], kind="stable")
    return _for_print(rolling_first).rename(columns={"distance": "to U"})


def _closing_line(result: Reproduction) -> str:
    if result.n_points != PAPER_POINTS:
        return (
            f"Not compared: the paper tests {PAPER_POINTS} points, this run {result.n_points}; "
            f"run with --points {PAPER_POINTS} to compare."
        )
    agreement = result.agreement()
    held = "; ".join(text for text, holds in agreement.items() if holds)
    missed = "; ".join(text for text, holds in agreement.items() if not holds)
    return "".join(
        [
            f"Matched under rolling: {held or 'nothing'}.",
            f" NOT matched: {missed}." if missed else "",
        ]
    )
