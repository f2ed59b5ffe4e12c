"""``pymoo-psi rank``: from a source to ranks of efficiency, and what is said of a choice."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pymoo_psi._output import whole_file
from pymoo_psi._validation import Received, counted, integer, invalid, known_name
from pymoo_psi.cli._app import Rank
from pymoo_psi.cli._output import print_frame, require_output, say, write_csv, write_json
from pymoo_psi.cli._source import formulation_of, number_in, opened, pairs_in
from pymoo_psi.errors import PsiError
from pymoo_psi.pareto import (
    RANKING_COLUMNS,
    EfficiencyRanking,
    alternative,
    cautions,
    explain,
    measured_in,
    number,
    percent,
    representatives,
)
from pymoo_psi.selection import (
    CompromiseProgramming,
    Knee,
    RankingSelector,
    ReferencePoint,
    compare_selectors,
)
from pymoo_psi.table import Formulation, TestTable

_REASONS = 4  # sentences that a reader takes in at a glance
_METHODS = ("weights", "chebyshev", "aspire", "knee")


def require_free_names(names: Iterable[str]) -> None:
    """Refuse columns that are named as those of a ranking, beside which they stand in results."""
    if taken := [name for name in names if name in RANKING_COLUMNS]:
        remedy = "give it another name, by problem.names of a problem"
        raise invalid("the columns", "named unlike the columns of a ranking", taken[0], remedy)


def designs_frame(
    designs: TestTable, ranking: EfficiencyRanking, asked: Formulation
) -> pd.DataFrame:
    """Return designs with their ranking, the best first, for a file or to be printed.

    Columns: ``test_point``, or ``row`` of a file; texts carried along; variables, objectives,
    constraints and outputs; ``mu1``, ``mu2``, ``mu3``, ``rank``, ``pareto``.

    Raises:
        ArgumentValueError: A column has the name of one of a ranking.
    """
    layout = designs.layout
    number = "test_point" if layout.label is None else "row"
    constraints = [name for name in layout.constraints if name not in limits_of(designs, asked)]
    names = (*layout.variables, *layout.objectives, *constraints, *layout.outputs)
    columns: dict[str, Any] = {number: designs.numbers, **designs.extra}
    columns |= {name: designs.column(name) for name in names}
    require_free_names(columns)
    columns |= dict(zip(("mu1", "mu2", "mu3"), ranking.criteria.T, strict=True))
    columns |= {"rank": ranking.rank, "pareto": ranking.pareto}
    return pd.DataFrame(columns).iloc[ranking.order]


def limits_of(table: TestTable, asked: Formulation) -> list[str]:
    """Return the constraints that limits have made, which repeat a column."""
    made = tuple(f"{name}{sign}" for name in asked.limits for sign in ("<=", ">="))
    return [name for name in table.layout.constraints if name.startswith(made)]


def best_designs(frame: pd.DataFrame, n: int) -> pd.DataFrame:
    """Return n designs of :func:`designs_frame` as they are printed, compromises first."""
    names = [*frame.columns.drop(["rank", "mu1", "mu2", "mu3"]), "rank", "mu1"]
    front = frame.get("pareto", pd.Series(data=True, index=frame.index))
    nearest = frame.iloc[np.lexsort((frame["mu1"], ~front))]
    return nearest[names].head(n).round({"mu1": 4})


def most_violated(table: TestTable) -> str:
    """Say which constraint or limit most designs violate, and how many violate it alone."""
    violated, names = table.violations()
    computed = int((table.status != "failed").sum())
    if not violated.any():
        return f"{computed} of {counted(len(table), 'design')} could be computed"
    rejects = violated.sum(axis=0)
    j = int(rejects.argmax())
    alone = int((violated[:, j] & (violated.sum(axis=1) == 1)).sum())
    return (
        f"Infeasible: {int(violated.any(axis=1).sum())} of {computed} that were computed; "
        f"{names[j]} rejects most: {int(rejects[j])}, {alone} of them alone"
    )


def say_source(path: Path, table: TestTable, asked: Formulation, *, ranked: bool = True) -> None:
    """Print what is known of a source's rows, of its columns if none was named, of a decision."""
    layout = table.layout
    for remark in table.remarks:
        say(remark)
    if not asked.objectives:
        say(f"Objectives: {', '.join(map(layout.label_of, layout.objectives))}")
    if (n := int((table.status == "ok").sum())) < len(table):
        rest = "; the others are left out" if ranked else ""
        say(f"{n} of {counted(len(table), 'design')} are feasible{rest}.")
    for line in decision_remarks(path, table, asked):
        say(line)


def decision_remarks(path: Path, table: TestTable, asked: Formulation) -> list[str]:
    """Return what there is to say of a decision, and what has changed since.

    Raises:
        ArgumentValueError: The decision is about other directions or units.
    """
    layout, page = table.layout, asked.page
    for name in layout.objectives if page else ():
        was, unit = page.get("units", {}).get(name), layout.units.get(name)
        other = name in layout.maximize and name not in asked.maximize
        if other or (was and unit and was != unit):
            what = "maximized" if other else f"in {unit}"
            rule = "about the same directions and units as the designs"
            raise invalid("--decision", rule, Received(f"{name} {what} in {path}"))
    remarks = [f"Reason: {asked.reason}"] if asked.reason else []
    if asked.chosen is None:
        return remarks
    chosen = f"Warning: {asked.chosen}, the chosen design,"
    if asked.chosen not in table.names:
        return [*remarks, f"{chosen} is not among these."]
    row, before = table.names.index(asked.chosen), page.get("values", {})
    changed = [
        f"{name} was {before[name]} and is {number(float(table.column(name)[row]), 6)}"
        for name in layout.objectives
        if name in before and before[name] != table.column(name)[row]
    ]
    if changed:
        return [*remarks, f"{chosen} has changed: {', '.join(changed)}."]
    if not table.eligible()[row]:
        return [*remarks, f"{chosen} is beyond the limits."]
    return [*remarks, f"Chosen: {asked.chosen}{', unchanged since then' if before else ''}."]


def run_rank(options: Rank) -> int:
    """Rank the designs of a source, write all if a file is named, and print the best."""
    path, out, figure = options.file, options.out, options.figure
    integer("--top", options.top, minimum=1)
    if options.representatives is not None:
        integer("--representatives", options.representatives, minimum=1)
    inputs, force = (path, options.formulation), options.force
    require_output(out, (".csv", ".xlsx", ".json"), *inputs, by="rank", force=force)
    suffixes = (".png", ".pdf", ".svg")
    require_output(figure, suffixes, *inputs, by="figure", force=force, option="--figure")
    formulation = formulation_of(options)
    table = opened(path, options, formulation)
    if not table.eligible().any():
        raise PsiError(f"{path}: no feasible design. {most_violated(table)}")
    rows, ranking = table.ranked(normalize=formulation.normalize)
    designs = table.rows(rows)
    layout, units = designs.layout, designs.layout.units
    selectors = preferences_in(options.prefer, layout.objectives, normalize=formulation.normalize)
    frame = designs_frame(designs, ranking, formulation)
    if out is not None:  # before anything is printed, which may fail
        if out.suffix.lower() == ".json":
            write_json(_content(path, designs, ranking, frame), out)
        else:
            write_csv(frame, out, layout, designs.chosen)
    if figure is not None:
        caption = _draw(ranking, units, path.name, figure)

    say_source(path, table, formulation)
    best = "; ".join(ranking.name_of(row) for row in ranking.salukvadze[:5].tolist())
    more = "; …" if len(ranking.salukvadze) > 5 else ""
    size = f"{counted(len(designs), 'design')}, {int(ranking.pareto.sum())} Pareto optimal"
    say(f"{path}: {size}; Salukvadze optimum: {best}{more}")
    for name, ideal, nadir in zip(layout.objectives, ranking.ideal, ranking.nadir, strict=True):
        way = "maximize" if name in layout.maximize else "minimize"
        unit = f" {units[name]}" if name in units else ""
        best, worst = (f"{number(end, 6)}{unit}" for end in (ideal, nadir))
        say(f"  {way} {name}: best {best}, worst {worst} of the Pareto set")
    say_best(
        frame,
        options.top,
        "The best compromises, the nearest to the ideal point first:",
        ranking,
        units,
    )
    if selectors:
        optimum = int(ranking.salukvadze[0])
        for entry, chosen in compare_selectors(ranking, selectors).items():
            say(f"{entry}: {alternative(ranking, chosen, optimum, units)}")
    if options.representatives is not None:
        _say_representatives(ranking, options.representatives)
    if out is not None:
        say(f"All {len(frame)} written to {out}")
    if figure is not None:
        say(f"Figure written to {figure}: {caption}")
    return 0


def say_best(
    frame: pd.DataFrame,
    n: int,
    title: str,
    ranking: EfficiencyRanking,
    units: Mapping[str, str],
) -> None:
    """Print the best n designs, what speaks against relying on them first, then why the optimum."""
    for caution in cautions(ranking):
        say(f"Attention: {caution}")
    print_frame(best_designs(frame, n), title)
    option = "; plain ones by --no-normalize" if ranking.frame.normalize else " (--no-normalize)"
    say(
        "mu1: distance to the ideal point; rank: 6 is the optimum, 5 to 3 are best in two of three "
        "distances, often ends of the set and no compromises."
    )
    say(f"{measured_in(ranking)}{option}.")
    for reason in _reasons(ranking, units):
        say(reason)


def _draw(ranking: EfficiencyRanking, units: Mapping[str, str], title: str, path: Path) -> str:
    """Write the figure of a ranking, and return its caption."""
    from pymoo_psi.plots import plot_ranking  # matplotlib is loaded where it draws

    kind = path.suffix[1:].lower()
    # By its maker the file is known when it is to be overwritten.
    maker = {"Software" if kind == "png" else "Creator": "pymoo-psi rank"}
    with whole_file(path) as written:
        drawn = plot_ranking(ranking, units=units, title=title)
        drawn.savefig(written, format=kind, dpi=200, metadata=maker)
    return drawn.caption


def _content(
    path: Path, designs: TestTable, ranking: EfficiencyRanking, frame: pd.DataFrame
) -> dict[str, Any]:
    """Return a ranking as plain values; what is no finite number is None, as JSON has none."""
    layout = designs.layout
    return {
        "file": path.name,
        "objectives": list(layout.objectives),
        "maximized": list(layout.maximize),
        "units": dict(layout.units),
        "normalized": ranking.frame.normalize,
        "ideal": dict(zip(layout.objectives, ranking.ideal.tolist(), strict=True)),
        "nadir": dict(zip(layout.objectives, ranking.nadir.tolist(), strict=True)),
        "reasons": _reasons(ranking, layout.units),
        "cautions": [str(caution) for caution in cautions(ranking)],
        "salukvadze_rows": designs.numbers[ranking.salukvadze].tolist(),
        "designs": [
            {
                name: None if isinstance(cell, float) and not math.isfinite(cell) else cell
                for name, cell in design.items()
            }
            for design in frame.to_dict("records")
        ],
    }


def _reasons(ranking: EfficiencyRanking, units: Mapping[str, str]) -> list[str]:
    units = {name: unit for name, unit in units.items() if name in ranking.objectives.names}
    return [*explain(ranking, int(ranking.salukvadze[0]), units=units).sentences[:_REASONS]]


def _say_representatives(ranking: EfficiencyRanking, k: int) -> None:
    few, objectives = representatives(ranking, k), ranking.objectives
    frame = pd.DataFrame(objectives.values[few.rows], columns=list(objectives.names))
    frame.insert(0, "design", [ranking.name_of(row) for row in few.rows])
    frame["stands for"] = [percent(share) for share in few.shares]
    n = counted(int(ranking.pareto.sum()), "Pareto-optimal design")
    print_frame(frame, f"{len(few.rows)} for {n}, none farther than {few.radius:.3g} from its own:")


def preferences_in(
    entries: Sequence[str] | None, names: Sequence[str], *, normalize: bool
) -> dict[str, RankingSelector]:
    """Return the selectors that entries of ``--prefer`` describe, by entry.

    ==================  ========================================================================
    weights:A=2,B=1     the nearest to the ideal point, with weights of all objectives
    chebyshev           the least bad worst objective; weights as above may follow a colon
    aspire:A=3,B=20     the nearest to wanted values, or the one that exceeds them by most
    knee                where the set bulges most towards the ideal point
    ==================  ========================================================================

    Raises:
        ArgumentValueError: There is no such method or objective, or numbers are missing.

    Example:
        >>> found = preferences_in(["aspire:cost=3,yield=20"], ["cost", "yield"], normalize=True)
        >>> found["aspire:cost=3,yield=20"].point
        array([ 3., 20.])
    """
    return {entry: _preference(entry, names, normalize) for entry in entries or ()}


def _preference(entry: str, names: Sequence[str], normalize: bool) -> RankingSelector:
    method, colon, text = entry.partition(":")
    method = known_name("--prefer", method.strip(), _METHODS)
    if method == "knee":
        return Knee()
    if method == "chebyshev" and not colon:
        return CompromiseProgramming(np.inf, normalize=normalize)
    form = f"with a number for every objective, such as {method}:" + ",".join(
        f'"{name}=1"' if "," in name else f"{name}=1" for name in names
    )
    given = pairs_in("--prefer", [text], form, names)
    if missing := [name for name in names if name not in given]:
        raise invalid("--prefer", form, Received(entry), f"{missing[0]} has none")
    values = [number_in("--prefer", given[name], form) for name in names]
    if method == "aspire":
        return ReferencePoint(values, normalize=normalize)
    p = 2 if method == "weights" else np.inf
    return CompromiseProgramming(p, weights=values, normalize=normalize)
