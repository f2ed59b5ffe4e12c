"""``pymoo-psi rank``: the places of the designs of a source, and remarks on a decision."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from pymoo_psi._validation import Values, counted
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._output import print_frame, require_output, say, write_frame
from pymoo_psi.cli._source import formulation_of, opened, say_source, with_choice
from pymoo_psi.errors import PsiError
from pymoo_psi.pareto import (
    EfficiencyRanking,
    cautions,
    explain,
    measured_in,
    number,
    ranking_frame,
    weights_sentence,
)
from pymoo_psi.selection import group_sentences
from pymoo_psi.table import (
    TestTable,
    confidence_sentence,
    constraint_costs,
    number_column,
    suffixes_for,
)

_N_REASONS = 4  # sentences that a reader takes in at a glance
_N_PRINTED = 12  # designs; all are in the file


def designs_frame(designs: TestTable, ranking: EfficiencyRanking) -> pd.DataFrame:
    """Return designs with their ranking, by place, for a file or to be printed.

    Columns: ``place``; ``test_point``, ``test`` or, of a file, ``row``; texts carried along;
    variables, objectives, outputs; ``mu1``, ``mu2``, ``mu3``, ``efficiency_rank``, ``pareto``.
    """
    layout = designs.layout
    number = number_column(designs.extra) if layout.label is None else "row"
    columns: Values = {number: designs.numbers}
    for name, cells in designs.extra.items():
        if name == "place":  # of words
            name = "place (text)"
        columns[name] = cells
    for name in (*layout.variables, *layout.objectives, *layout.outputs):
        columns[name] = designs.column(name)
    return ranking_frame(ranking, columns)


def most_violated(table: TestTable) -> str:
    """Say which constraint or limit most designs violate, and how many violate it alone."""
    n_computed = (table.status != "failed").sum()
    costs = constraint_costs(table)
    if not costs["rejects"].any():
        return f"{n_computed} of {counted(len(table), 'design')} have values"
    worst = costs.sort_values("rejects", ascending=False, kind="stable").iloc[0]
    n_infeasible = n_computed - table.feasible().sum()
    return (
        f"Infeasible: {n_infeasible} of {n_computed} with values; "
        f"{worst.name} rejects most: {worst['rejects']:.0f}, {worst['alone']:.0f} of them alone"
    )


def run_rank(options: Options) -> int:
    """Rank the designs of a source, write all if a file is named, and print the best."""
    path = options.file
    out = options.out
    require_output(out, suffixes_for("designs"), path, options.decision)
    formulation = formulation_of(options)
    table = opened(path, options, formulation)
    formulation = with_choice(formulation, table)
    if not table.eligible().any():
        raise PsiError(f"{path}: no feasible design. {most_violated(table)}")
    ranking = table.feasible_ranking()
    designs = table.rows(ranking.rows)
    frame = designs_frame(designs, ranking)
    if out is not None:  # before anything is printed, which may fail
        write_frame(frame, out, designs)

    say_source(path, table, formulation)
    say(*group_sentences(table))
    _say_set(path, designs, ranking)
    title = "The best compromises, by place:"
    say_best(frame, title, ranking, out)
    sure = confidence_sentence(table, int(ranking.salukvadze[0]))
    if sure:
        say(sure)
    return 0


def _say_set(path: Path, designs: TestTable, ranking: EfficiencyRanking) -> None:
    """Print the size of the set, its optima, and the ideal and the nadir of each objective."""
    layout = designs.layout
    optima = [ranking.name_of(row) for row in ranking.salukvadze.tolist()]
    if len(optima) > 5:
        optima = [*optima[:5], "…"]
    size = f"{counted(len(ranking.rank), 'design')}, {ranking.pareto.sum()} Pareto optimal"
    say(f"{path}: {size}; Salukvadze optimum: {'; '.join(optima)}")
    origin = "of the Pareto set"
    if designs.formulation.ranges:
        origin = "as fixed"
    for name, ideal, nadir in zip(layout.objectives, ranking.ideal, ranking.nadir, strict=True):
        direction = "maximize" if name in layout.maximize else "minimize"
        unit = ""
        if name in layout.units:
            unit = f" {layout.units[name]}"
        best = f"{number(ideal, 6)}{unit}"
        worst = f"{number(nadir, 6)}{unit}"
        say(f"  {direction} {name}: best {best}, worst {worst} {origin}")


def say_best(
    frame: pd.DataFrame,
    title: str,
    ranking: EfficiencyRanking,
    out: Path | None,
) -> None:
    """Print reasons against relying on the ranking, the best designs, and why the optimum is one.

    Args:
        frame: The frame of :func:`designs_frame`.
        title: Heading of the table.
        ranking: The ranking.
        out: The file to which the frame was written, if it was.
    """
    for caution in cautions(ranking):
        say(f"Attention: {caution}")
    best = frame.head(_N_PRINTED).round({"mu1": 4}).rename(columns={"efficiency_rank": "eff_rank"})
    # Place and number lead each part of a wide table, as dominated designs have no place.
    place = best.pop("place").astype("string").fillna("").str.ljust(len("place  "))
    name = best.columns[0]
    best.insert(0, f"place  {name}", place + best.pop(name).astype("string"))
    print_frame(best.drop(columns=["mu2", "mu3", "pareto"]), title)
    if out is not None:
        say(f"All {len(frame)} written to {out}")
    elif len(frame) > _N_PRINTED:
        say(f"({len(frame) - _N_PRINTED} more; --out FILE.csv writes all)")
    say(
        "place: by mu1, the distance to the ideal point; equal distances share a place, dominated "
        "designs have none. eff_rank: the rank of efficiency; 6 is the optimum, designs of ranks 5 "
        "to 3 are best in two of the three distances, and are often extreme designs, not "
        "compromises."
    )
    option = "(--no-normalize)"
    if ranking.frame.normalize:
        option = "(plain distances: --no-normalize)"
    say(f"{measured_in(ranking)} {option}.")
    say(*explain(ranking).sentences[:_N_REASONS])
    weights = weights_sentence(ranking, int(ranking.salukvadze[0]))
    if weights:
        say(weights)
