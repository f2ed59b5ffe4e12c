"""``pymoo-psi rank``: from a file of any Pareto set to ranks of efficiency."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pymoo_psi._files import whole_file
from pymoo_psi._validation import counted, integer
from pymoo_psi.cli._choice import (
    preferences_in,
    reasons,
    say_choice,
    say_preferences,
    say_representatives,
)
from pymoo_psi.cli._decision import decided_designs, under_decision
from pymoo_psi.cli._groups import ColumnOptions, FileOptions
from pymoo_psi.cli._options import designs_of
from pymoo_psi.cli._output import print_frame, require_output, say, write_csv
from pymoo_psi.pareto import RANKING_COLUMNS, EfficiencyRanking, cautions, rank_of_efficiency
from pymoo_psi.table import DesignFile
from pymoo_psi.table._design_file import unfit
from pymoo_psi.table._roles import Roles


def run_rank(
    path: Path,
    columns: ColumnOptions,
    written: FileOptions,
    *,
    decision: Path | None,
    normalize: bool,
    prefer: Sequence[str],
    representatives: int | None,
    out: Path | None,
    figure: Path | None,
    force: bool,
    top: int,
) -> int:
    """Rank the designs of a file, write all if a file is named, and print the best."""
    top = integer("--top", top, minimum=1)
    if representatives is not None:
        integer("--representatives", representatives, minimum=1)
    if out is not None:
        require_output(out, (".csv", ".json"), path, decision, by="rank", force=force)
    if figure is not None:
        suffixes = (".png", ".pdf", ".svg")
        require_output(
            figure, suffixes, path, decision, by="figure", force=force, option="--figure"
        )
    if decision is None:
        file, roles, remarks = designs_of(path, columns, written)
    else:
        file, roles, remarks, decided = decided_designs(path, columns, written, decision, normalize)
        file, decisions = under_decision(file, roles, decided)
        remarks, normalize = [*remarks, *decisions], decided.normalize
    names = list(roles.objectives)
    if taken := [name for name in names if name in RANKING_COLUMNS]:
        raise unfit(path, f"the objective {taken[0]!r} has the name of a column that is added")
    selectors = preferences_in(prefer, names, normalize=normalize)
    # Numbers rank, and what is written are the cells: float64 would not give all digits back.
    F = pd.DataFrame(file.values(names), columns=names)
    more = [name for name in names if name in roles.maximize]
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=more)
    frame = _ranked(file, file.cells, ranking)
    ranking = ranking.with_labels(file.called(roles.label))
    if out is not None:  # before anything is printed, which may fail
        if out.suffix.lower() == ".json":
            _write_json(file, roles, ranking, out)
        else:
            numbers = [name for name, c in file.columns.items() if c.numbers is not None]
            # What only the options have said of the columns of a plain file is said again with
            # them; but a sense must not be lost on the way.
            told = roles if roles.maximize or file.known else None
            write_csv(frame, out, told, _units(file), numbers)
    units = {name: unit for name, unit in _units(file).items() if name in names}
    if figure is not None:
        from pymoo_psi.plots import (
            literal,
            plot_ranking,
        )  # matplotlib is loaded where something is drawn

        with whole_file(figure) as drawn:
            page = plot_ranking(ranking, units=units, title=literal(path.name, 60))
            kind = figure.suffix[1:].lower()
            # By its maker the file is known when it is to be overwritten.
            maker = {"Software" if kind == "png" else "Creator": "pymoo-psi rank"}
            page.savefig(drawn, format=kind, dpi=200, metadata=maker)
    for remark in remarks:
        say(remark)
    _print(file, roles, ranking, frame, top)
    say_choice(ranking, units)
    say_preferences(ranking, selectors, units)
    if representatives is not None:
        say_representatives(ranking, representatives)
    if out is not None:
        say(f"All {len(frame)} written to {out}")
    if figure is not None:
        say(f"Figure written to {figure}")
    return 0


def _ranked(file: DesignFile, cells: pd.DataFrame, ranking: EfficiencyRanking) -> pd.DataFrame:
    """Return designs with the ranking beside them, the best first.

    ``row`` is the row of the file, from 1, unless the file has a column of that name, as an
    earlier ranking has: then its numbers stay. Columns of an earlier ranking are replaced.
    """
    frame = cells.drop(columns=list(RANKING_COLUMNS), errors="ignore")
    if "row" not in frame:
        frame.insert(0, "row", file.rows)
    frame[["mu1", "mu2", "mu3"]] = ranking.criteria
    frame["rank"], frame["pareto"] = ranking.rank, ranking.pareto
    return frame.iloc[ranking.order]


def _print(
    file: DesignFile, roles: Roles, ranking: EfficiencyRanking, ranked: pd.DataFrame, top: int
) -> None:
    names = list(roles.objectives)
    best = ranked.head(top)
    n, found = len(ranking.rank), len(ranking.salukvadze)
    # A criterion may be called "row"; then the rows of the file are told.
    rows = file.rows if "row" in names else ranked["row"].sort_index().to_numpy()
    optimum = ", ".join(str(rows[i]) for i in ranking.salukvadze[:5])
    if roles.label not in (None, "row", "") and found == 1:
        optimum += f" ({roles.label} {file.cells[roles.label][int(ranking.salukvadze[0])]})"
    say(
        f"{file.path}: {counted(n, 'design')}, {int(ranking.pareto.sum())} Pareto optimal; "
        f"Salukvadze optimum: row {optimum}{', …' if found > 5 else ''}"
    )
    units = _units(file)
    for name, ideal, nadir in zip(names, ranking.ideal, ranking.nadir, strict=True):
        sense = "maximise" if name in roles.maximize else "minimise"
        unit = f" {units[name]}" if name in units else ""
        say(f"  {sense} {name}: best {ideal:.6g}{unit}, worst {nadir:.6g}{unit} of the Pareto set")
    number = [] if "row" in names else ["row"]
    # Tests go by their numbers; that these are their rows, too, need not be told.
    if roles.label is not None and [*map(str, best[roles.label])] == [*map(str, best["row"])]:
        number = [roles.label]
    taken = (*number, *names, *RANKING_COLUMNS, "row")
    others = [name for name in best.columns if name not in taken]
    distances = ["mu1", "mu2", "mu3"]
    shown = best[[*number, *others, *names, "rank", *distances, "pareto"]]
    known = [name for name in (*number, *others, *names) if name in file.columns]
    plain = [name for name in known if file.columns[name].numbers is not None]
    title = "The best by rank of efficiency:" if len(best) < len(ranking.rank) else "By rank:"
    print_frame(shown, title, plain=plain, spare=[[*distances, "pareto"], others])


def _units(file: DesignFile) -> dict[str, str]:
    return {name: column.unit for name, column in file.columns.items() if column.unit}


def _write_json(file: DesignFile, roles: Roles, ranking: EfficiencyRanking, out: Path) -> None:
    frame = _ranked(file, file.frame(roles.objectives), ranking)
    columns = {name: [_value(cell) for cell in frame[name].tolist()] for name in frame.columns}
    content = {
        # A name that is no Unicode holds lone surrogates, which cannot be written as UTF-8.
        "file": os.fsencode(file.path.name).decode("utf-8", "replace"),
        "objectives": list(roles.objectives),
        "maximized": list(roles.maximize),
        "units": _units(file),
        "normalized": ranking.frame.normalize,
        "ideal": dict(zip(roles.objectives, ranking.ideal.tolist(), strict=True)),
        "nadir": dict(zip(roles.objectives, ranking.nadir.tolist(), strict=True)),
        "reasons": reasons(ranking, _units(file)),
        "cautions": [str(caution) for caution in cautions(ranking)],
        "salukvadze_rows": file.rows[ranking.salukvadze].tolist(),
        "designs": [
            dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)
        ],
    }
    with whole_file(out) as written:
        text = json.dumps(content, ensure_ascii=False, indent=1, allow_nan=False)
        written.write_text(text + "\n", encoding="utf-8")


def _value(cell: Any) -> Any:
    """Return a cell as JSON can hold it: None for nothing, or for what is no finite number."""
    # JSON has no NaN or Infinity (RFC 8259, section 6); Python would write them unless forbidden.
    if isinstance(cell, float) and not np.isfinite(cell):
        return None
    return None if cell == "" else cell
