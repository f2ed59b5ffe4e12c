"""``pymoo-psi rank``: from a source to ranks of efficiency, and what is said of a choice."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._output import print_frame, require_output, say, write_frame
from pymoo_psi.cli._source import formulation_of, opened, with_choice
from pymoo_psi.errors import PsiError
from pymoo_psi.pareto import EfficiencyRanking, cautions, explain, measured_in, number
from pymoo_psi.table import Formulation, TestTable, constraint_costs

_REASONS = 4  # sentences that a reader takes in at a glance
_SHOWN = 12  # designs printed; all are in the file


def designs_frame(designs: TestTable, ranking: EfficiencyRanking) -> pd.DataFrame:
    """Return designs with their ranking, the best first, for a file or to be printed.

    Columns: ``test_point``, or ``row`` of a file; texts carried along; variables, objectives,
    outputs; ``mu1``, ``mu2``, ``mu3``, ``rank``, ``pareto``.
    """
    layout = designs.layout
    first = "test_point" if layout.label is None else "row"
    columns: dict[str, Any] = {first: designs.numbers, **designs.extra}
    names = [*layout.variables, *layout.objectives, *layout.outputs]
    columns |= {name: designs.column(name) for name in names}
    columns |= dict(zip(("mu1", "mu2", "mu3"), ranking.criteria.T, strict=True))
    columns |= {"rank": ranking.rank, "pareto": ranking.pareto}
    return pd.DataFrame(columns).iloc[ranking.order]


def most_violated(table: TestTable) -> str:
    """Say which constraint or limit most designs violate, and how many violate it alone."""
    tested, costs = int((table.status != "failed").sum()), constraint_costs(table)
    if not costs["rejects"].any():
        return f"{tested} of {counted(len(table), 'design')} could be computed"
    worst = costs.sort_values("rejects", ascending=False, kind="stable").iloc[0]
    return (
        f"Infeasible: {tested - int(table.feasible().sum())} of {tested} that were computed; "
        f"{worst.name} rejects most: {worst['rejects']:.0f}, {worst['alone']:.0f} of them alone"
    )


def say_source(path: Path, table: TestTable, asked: Formulation, *, ranked: bool = True) -> None:
    """Print what is known of a source's rows, of its columns if none was named, of a decision."""
    layout = table.layout
    for remark in table.remarks:
        say(remark)
    if not asked.objectives:
        say(f"Objectives: {', '.join(map(layout.label_of, layout.objectives))}")
    if (n := int((table.status == "ok").sum())) < len(table):
        rest = "; the others are left out" * ranked
        say(f"{n} of {counted(len(table), 'design')} are feasible{rest}.")
    for line in decision_remarks(path, table, asked):
        say(line)


def decision_remarks(path: Path, table: TestTable, asked: Formulation) -> list[str]:
    """Return what there is to say of a decision, and what has changed since.

    Raises:
        ArgumentValueError: The decision is about other directions.
    """
    layout, page = table.layout, asked.page
    for name in layout.objectives if page else ():
        if name in layout.maximize and name not in asked.maximize:
            rule = "about the same directions as the designs"
            raise invalid("--decision", rule, Received(f"{name} maximized in {path}"))
    reason = [f"Reason: {asked.reason}"] if asked.reason else []
    if asked.chosen is None:
        return reason
    chosen, before = f"Warning: {asked.chosen}, the chosen design,", page.get("values", {})
    if asked.chosen not in table.names:
        return [f"{chosen} is not among these.", *reason]
    row = table.names.index(asked.chosen)
    changed = [
        f"{name} was {before[name]} and is {number(float(table.column(name)[row]), 6)}"
        for name in layout.objectives
        if name in before and before[name] != table.column(name)[row]
    ]
    if changed:
        return [f"{chosen} has changed: {', '.join(changed)}.", *reason]
    if not table.eligible()[row]:
        return [f"{chosen} is beyond the limits.", *reason]
    since = f", unchanged since {str(page.get('date', 'then'))[:10]}" if before else ""
    return [f"Chosen: {asked.chosen}{since}.", *reason]


def run_rank(options: Options) -> int:
    """Rank the designs of a source, write all if a file is named, and print the best."""
    path, out = options.file, options.out
    require_output(out, (".csv", ".xlsx"), path, options.decision)
    asked = formulation_of(options)
    table = opened(path, options, asked)
    asked = with_choice(asked, table)
    if not table.eligible().any():
        raise PsiError(f"{path}: no feasible design. {most_violated(table)}")
    rows, ranking = table.ranked(normalize=asked.normalize)
    designs = table.rows(rows)
    layout, units = designs.layout, designs.layout.units
    frame = designs_frame(designs, ranking)
    if out is not None:  # before anything is printed, which may fail
        write_frame(frame, out, layout, designs.chosen)

    say_source(path, table, asked)
    best = "; ".join(ranking.name_of(row) for row in ranking.salukvadze[:5].tolist())
    more = "; …" if len(ranking.salukvadze) > 5 else ""
    size = f"{counted(len(designs), 'design')}, {int(ranking.pareto.sum())} Pareto optimal"
    say(f"{path}: {size}; Salukvadze optimum: {best}{more}")
    of = "as fixed" if layout.ranges else "of the Pareto set"
    for name, ideal, nadir in zip(layout.objectives, ranking.ideal, ranking.nadir, strict=True):
        way = "maximize" if name in layout.maximize else "minimize"
        unit = f" {units[name]}" if name in units else ""
        best, worst = (f"{number(end, 6)}{unit}" for end in (ideal, nadir))
        say(f"  {way} {name}: best {best}, worst {worst} {of}")
    title = "The best compromises, the nearest to the ideal point first:"
    say_best(frame, title, ranking, units, out)
    return 0


def say_best(
    frame: pd.DataFrame,
    title: str,
    ranking: EfficiencyRanking,
    units: Mapping[str, str],
    out: Path | None,
) -> None:
    """Print the best designs, what speaks against relying on them first, then why the optimum.

    Args:
        frame: Of :func:`designs_frame`.
        title: Heading of the table.
        ranking: The ranking.
        units: Units of objectives, and of other columns.
        out: The file to which the frame was written, if it was.
    """
    for caution in cautions(ranking):
        say(f"Attention: {caution}")
    nearest = frame.iloc[np.lexsort((frame["mu1"], ~frame["pareto"]))].head(_SHOWN)
    told = ["mu1", "mu2", "mu3", "rank", *(["pareto"] * bool(frame["pareto"].all()))]
    shown = nearest[[*frame.columns.drop(told), "rank", "mu1"]]
    print_frame(shown.round({"mu1": 4}), title)
    if out is not None:
        say(f"All {len(frame)} written to {out}")
    elif len(frame) > _SHOWN:
        say(f"({len(frame) - _SHOWN} more; --out FILE.csv writes all)")
    option = "; plain ones by --no-normalize" if ranking.frame.normalize else " (--no-normalize)"
    say(
        "mu1: distance to the ideal point; rank: 6 is the optimum, 5 to 3 are best in two of three "
        "distances, often ends of the set and no compromises."
    )
    say(f"{measured_in(ranking)}{option}.")
    units = {name: unit for name, unit in units.items() if name in ranking.objectives.names}
    for reason in explain(ranking, int(ranking.salukvadze[0]), units=units).sentences[:_REASONS]:
        say(reason)
