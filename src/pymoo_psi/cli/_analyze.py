"""``pymoo-psi analyze``: what drives tests, where they are feasible, and whether they suffice."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from pymoo_psi.cli._groups import ColumnOptions
from pymoo_psi.cli._options import formulation_of, judged, tests_in
from pymoo_psi.cli._output import print_frame, require_results, say, say_sentences, write_csv
from pymoo_psi.plots import (
    literal,
    plot_convergence,
    plot_feasibility,
    plot_sensitivities,
    save_figures,
)
from pymoo_psi.table import convergence, feasibility_rules, sensitivities

# Criteria up to which hypervolumes take seconds: of 300 designs one second with seven criteria, but
# hours with eight, and of 40 designs hours with fifteen.
_VOLUME = 7
_SHOWN = 12  # variables printed, those with the largest indices; all are in the file


def run_analyze(path: Path, columns: ColumnOptions, out: Path | None, *, force: bool) -> int:
    """Print sensitivities, rules of feasibility and convergence; write tables and pictures."""
    table, missing = tests_in(path)
    layout = table.layout
    groups = (layout.columns, layout.objectives, layout.maximize, layout.constraints)
    asked = formulation_of(columns, *groups)
    table = judged(table, asked)
    # What is limited is a column anyway; its distance to the limit tells nothing more.
    known = {*layout.columns, *asked.computed}.difference(layout.variables)
    if out is not None:
        written = ["sensitivities.csv", "convergence.*", "sensitivities.*", "feasibility.*"]
        require_results(out, written, force=force)
    found = sensitivities(table, [name for name in table.layout.columns if name in known])
    rules = feasibility_rules(table)
    # The first of combined tests are one experiment, the others another box: no convergence.
    experiments = [name for name, _ in layout.experiments]
    few = len(table.layout.objectives) <= _VOLUME
    steps = convergence(table) if few and len(experiments) < 2 else None
    if out is not None:
        write_csv(found.reset_index(), out / "sensitivities.csv")
        title = literal(path.name, 60)
        pages: dict[str, Any] = {"sensitivities": plot_sensitivities(found, title=title)}
        if steps is not None:
            write_csv(steps.to_frame().reset_index(), out / "convergence.csv")
            pages["convergence"] = plot_convergence(steps, title=title)
        if len(layout.variables) > 1:
            pages["feasibility"] = plot_feasibility(table, title=title).figure
        save_figures(pages.items(), out, 200, ".png")

    if missing:
        say(f"{path}: {missing}.")
    largest = found["first_order"].groupby(level="variable", sort=False).max()
    shown = largest.sort_values(ascending=False).index[:_SHOWN]
    cells = [
        f"{index:.2f} ± {(upper - index):.2f}"
        for index, upper in zip(found["first_order"], found["upper"], strict=True)
    ]
    wide = pd.Series(cells, index=found.index).unstack("column")[found.index.unique("column")]
    title = "First-order sensitivities: the share of the variance that a variable explains alone"
    print_frame(wide.loc[shown].rename_axis("variable").reset_index(), title)
    if left_out := len(largest) - len(shown):
        say(f"({left_out} variables with smaller ones not shown)")
    say("Where designs are feasible:")
    for rule in rules.rules:
        say(f"  {rule}")
    if not few:
        say(
            f"Whether more tests would change the decision is not told: with more than {_VOLUME} "
            f"criteria the hypervolume takes too long to compute; --objectives names fewer."
        )
    elif steps is None:
        say(
            f"The tests are of {len(experiments)} experiments, {', '.join(experiments)}: where "
            f"these are dense counts for more above, and whether more tests would change the "
            f"decision can be told of each one alone."
        )
    else:
        print_frame(steps.to_frame().reset_index(), "What the first tests would have decided")
        say_sentences([steps.verdict()])
    if out is not None:
        say(f"Tables and pictures written to {out}")
    return 0
