"""``pymoo-psi page``, ``report``, ``analyze`` and ``export``: what is made of a source."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timezone
from functools import reduce
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._output import print_frame, require_output, results_folder, say, write_frame
from pymoo_psi.cli._rank import decision_remarks, say_source
from pymoo_psi.cli._source import formulation_of, opened, with_choice
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table import STATUSES, Formulation, TestTable, read_table

_SHOWN = 12  # variables printed, those with the largest indices; all are in the file
_HTML = (".html", ".htm")


def run_page(options: Options) -> int:
    """Write the page and say where it is. Its reader can move the limits that it opens with."""
    from pymoo_psi.page import decision_page

    path, out, prototype = options.file, options.out, options.prototype
    require_output(out, _HTML, path, prototype, options.decision)
    asked = formulation_of(options)
    question = replace(asked, limits={}, page={})
    table = opened(path, options, question)
    asked = with_choice(asked, table)
    former = None
    if prototype is not None:
        layout = table.layout
        more = [name for name in layout.objectives if name in layout.maximize]
        same = replace(question, objectives=layout.objectives, maximize=more, relaxed=())
        # Marks and encoding are a habit of who writes files; titles and units are of one file.
        habit = {key: getattr(options, key) for key in ("decimal", "thousands", "encoding")}
        former = read_table(prototype, same, **habit)
    opens = replace(asked, objectives=(), maximize=(), relaxed=(), computed={})
    title = options.title or str(asked.page.get("title") or path.stem)
    page = decision_page(table, opens, prototype=former, title=title)
    # What the table was asked is repeated in the decisions that the page saves.
    repeated = replace(asked, limits=page.formulation.limits)
    replace(page, formulation=repeated, origin=path.name).save(out)
    remarks = table.under(Formulation(limits=asked.limits)).remarks
    say_source(path, replace(table, remarks=remarks), asked)
    size, objectives = counted(len(page.table), "design"), ", ".join(table.layout.objectives)
    say(f"{size} by {objectives}: open {out} in a browser")
    return 0


def run_report(options: Options) -> int:
    """Write the report and say where it is.

    Returns:
        0, or 1 if no design is feasible; the report then says what stands in the way.
    """
    from pymoo_psi.report import decision_report

    path, out = options.file, options.out
    require_output(out, _HTML, path, options.decision)
    asked = formulation_of(options)
    # What each limit costs is reported, so that they are not among the constraints.
    table = opened(path, options, replace(asked, limits={}))
    asked = with_choice(asked, table)
    limited = table.under(Formulation(limits=asked.limits))
    decided = decision_remarks(path, limited, replace(asked, reason=""))
    about = f"{path.name}, {datetime.now(timezone.utc):%Y-%m-%d}, pymoo-psi {version('pymoo-psi')}"
    chosen = _chosen(limited, options.design, asked.chosen)
    report = decision_report(
        table,
        asked.limits,
        normalize=asked.normalize,
        design=chosen,
        reason=asked.reason if options.design in (None, asked.chosen) and chosen else "",
        title=options.title or str(asked.page.get("title") or path.stem),
        about=[about, *limited.remarks, *decided],
    )
    report.save(out)
    say_source(path, limited, asked)
    for line in report.cautions:
        say(line)
    say(f"{report}: open {out} in a browser, or print it")
    return 0 if report.ranking is not None else 1


def _chosen(table: TestTable, design: str | None, decided: str | None) -> int | None:
    """Return the number of the design that an option names, or else a decision, if it is left."""
    named: list[tuple[str, int]] = list(zip(table.names, table.numbers.tolist(), strict=True))
    if design is None:
        left = [pair for pair, kept in zip(named, table.eligible(), strict=True) if kept]
        return dict(left).get(decided or "")
    # "7" is enough of "test point 7", and of "number 7" where a column "number" names designs.
    found = [number for name, number in named if design in (name, name.rpartition(" ")[2])]
    if len(found) != 1:
        rule = f"the name or the number of one design, such as {table.names[0]}"
        raise invalid("--design", rule, Received(f"{design}, of {len(found) or 'no'} designs"))
    return found[0]


def run_analyze(options: Options) -> int:
    """Print sensitivities and convergence; write tables and pictures."""
    from pymoo_psi.plots import plot_sensitivities, save_figures
    from pymoo_psi.table import convergence, even_part, sensitivities

    path, out, asked = options.file, options.out, formulation_of(options)
    table = opened(path, options, asked)
    layout = table.layout
    if not layout.variables:
        raise invalid("--variables", "named for designs without x1, x2, …", Received("none"))
    if out is not None:
        out = results_folder(out)
        if path.resolve() in [out.resolve() / f"{n}.csv" for n in ("sensitivities", "convergence")]:
            raise invalid("--out", "another folder than that of the file read", str(options.out))
    # The distance to a limit says nothing that the column does not.
    made = tuple(f"{name}{sign}" for name in asked.limits for sign in ("<=", ">="))
    names = [n for n in layout.columns[len(layout.variables) :] if not n.startswith(made)]
    found, steps, remarks = None, None, list[str]()
    try:
        remarks += even_part(table)[1]
        found = sensitivities(table, names)
    except PsiError as error:
        remarks.append(f"Sensitivities not available: {error}.")
    try:
        steps = convergence(table)
    except PsiError as error:
        remarks.append(f"Convergence not available: {error}.")
    if out is not None:
        if found is not None:
            write_frame(found.reset_index(), out / "sensitivities.csv")
            figure = plot_sensitivities(found, title=path.name)
            save_figures([("sensitivities", figure)], out, 200, ".png")
        if steps is not None:
            write_frame(steps.to_frame().reset_index(), out / "convergence.csv")

    say_source(path, table, asked, ranked=False)
    for remark in remarks:
        say(remark)
    if found is not None:
        _say_sensitivities(found)
    if steps is not None:
        decided = steps.to_frame().reset_index().round(4)
        print_frame(decided, "What the first tests would have decided")
        say(steps.verdict())
    if out is not None:
        say(f"Tables and pictures written to {options.out}")
    return 0


def _say_sensitivities(found: pd.DataFrame) -> None:
    triples = found.to_numpy().tolist()  # nan for a column that does not vary
    cells = [f"{s:.2f} ± {upper - s:.2f}" if s == s else "–" for s, _, upper in triples]
    wide = pd.Series(cells, index=found.index).unstack("column")[found.index.unique("column")]
    largest = found["first_order"].groupby(level="variable", sort=False).max()
    shown = largest.sort_values(ascending=False).index[:_SHOWN]
    title = "First-order sensitivities: the share of the variance that a variable explains alone"
    print_frame(wide.loc[shown].rename_axis("variable").reset_index(), title)
    if left_out := len(largest) - len(shown):
        say(f"({left_out} variables with smaller ones not shown)")


def run_export(options: Options) -> int:
    """Write the tests of one or several sources as one table or study.

    Several are merged by numbers of test points, as of one problem. If one is given as
    ``name=path``, they are experiments of other bounds or samplings, each under its name.
    """
    joined, files = False, dict[str, Path]()
    for source in options.sources:
        # A file may have a sign in its name, and is meant where it is there.
        *named, file = [source] if Path(source).exists() else source.split("=", 1)
        name = named[0] if named else source
        if not (name and file) or name in files:
            raise invalid("SOURCE", "of different names, as in name=path", Received(source))
        joined, files[name] = joined or bool(named), Path(file).expanduser()
    out = options.out
    require_output(out, (".csv", ".xlsx", ".db"), *files.values())
    asked = formulation_of(options)
    tables = {name: opened(path, options, asked) for name, path in files.items()}
    try:
        table = TestTable.combined(tables) if joined else reduce(TestTable.merge, tables.values())
    except PsiError as error:
        remedy = "NAME=SOURCE joins tests of other bounds and samplings of a problem"
        raise ArgumentValueError(f"{' and '.join(tables)}: {error}; {remedy}") from error
    suffix = out.suffix.lower()
    {".csv": table.to_csv, ".xlsx": table.to_xlsx, ".db": table.to_study}[suffix](out)
    for name, each in tables.items():
        for remark in each.remarks:
            say(f"{name}: {remark}" if len(tables) > 1 else remark)
    if suffix == ".db" and "problem" not in (table.problem or {}):
        say("It is unknown of which problem the tests are: no run continues the study.")
    counts = [f"{np.sum(table.status == status)} {status}" for status in STATUSES]
    say(f"{counted(len(table), 'test')} ({', '.join(counts)}) written to {out}")
    return 0
