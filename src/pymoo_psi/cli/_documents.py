"""``pymoo-psi page``, ``report``, ``analyze`` and ``export``: what is written of a source."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timezone
from functools import reduce
from importlib.metadata import version
from pathlib import Path

import pandas as pd

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._output import print_frame, require_output, results_folder, say, write_frame
from pymoo_psi.cli._source import decision_remarks, formulation_of, opened, say_source, with_choice
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table import (
    STUDY,
    Formulation,
    Layout,
    TestTable,
    format_of,
    read_table,
    suffixes_for,
)

_N_PRINTED = 12  # variables with the largest indices; all are in the file
_HTML = (".html", ".htm")


def run_page(options: Options) -> int:
    """Write the page and say where it is. Its reader can move the limits that it opens with."""
    from pymoo_psi.page import decision_page

    path = options.file
    out = options.out
    require_output(out, _HTML, path, options.prototype, options.decision)
    formulation = formulation_of(options)
    table = opened(path, options, replace(formulation, page={}))
    formulation = with_choice(formulation, table)
    page = decision_page(
        table,
        prototype=_prototype(options, formulation, table.layout),
        title=_title(options, formulation),
    )
    # The decisions that the page saves repeat the formulation of the table.
    saved = replace(formulation, limits=page.formulation.limits)
    replace(page, formulation=saved, origin=path.name).save(out)
    say_source(path, replace(table.under(limits={}), remarks=table.remarks), formulation)
    objectives = ", ".join(table.layout.objectives)
    say(f"{counted(len(page.table), 'design')} by {objectives}: open {out} in a browser")
    return 0


def _title(options: Options, formulation: Formulation) -> str:
    return options.title or str(formulation.page.get("title") or options.file.stem)


def _prototype(options: Options, formulation: Formulation, layout: Layout) -> TestTable | None:
    """Return the existing designs with the objectives of the table, if they are given."""
    if options.prototype is None:
        return None
    maximize = [name for name in layout.objectives if name in layout.maximize]
    same = replace(
        formulation,
        objectives=layout.objectives,
        maximize=maximize,
        relaxed=(),
        limits={},
        page={},
    )
    # Number format and encoding usually depend on who writes the files; skipped lines and units
    # depend on the file.
    return read_table(
        options.prototype,
        same,
        decimal=options.decimal,
        thousands=options.thousands,
        encoding=options.encoding,
    )


def run_report(options: Options) -> int:
    """Write the report and say where it is.

    Returns:
        0, or 1 if no design is feasible; the report then says which limits reject most designs.
    """
    from pymoo_psi.report import decision_report

    if options.check:
        return _run_check(options)
    if options.source is not None:
        raise invalid("SOURCE", "given with --check only", str(options.source))
    path = options.file
    out = options.out
    require_output(out, _HTML, path, options.decision)
    formulation = formulation_of(options)
    table = opened(path, options, formulation)
    formulation = with_choice(formulation, table)
    remarks = decision_remarks(path, table, replace(formulation, reason=""))
    date = f"{datetime.now(timezone.utc):%Y-%m-%d}"
    origin = f"{path.name}, {date}, pymoo-psi {version('pymoo-psi')}"
    chosen = _chosen(table, options.design, formulation.chosen)
    reason = ""  # of another design
    if chosen is not None and options.design in (None, formulation.chosen):
        reason = formulation.reason
    report = decision_report(
        table,
        design=chosen,
        reason=reason,
        title=_title(options, formulation),
        about=[origin, *table.remarks, *remarks],
    )
    report.save(out)
    say_source(path, table, formulation)
    say(*report.cautions, f"{report}: open {out} in a browser, or print it")
    return 0 if report.ranking is not None else 1


def _run_check(options: Options) -> int:
    """Make a report again and say the first claim that no longer holds.

    Returns:
        0, or 1 if a claim does not hold.
    """
    from pymoo_psi.report import check_report

    source = None
    if options.source is not None:
        source = opened(options.source, options, formulation_of(options))
    warnings, claim = check_report(options.file, source)
    for warning in warnings:
        say(f"Warning: {warning}")
    if claim:
        say(f"{options.file}: {claim}")
        return 1
    say(f"{options.file}: every text and number follows from the data in it.")
    if source is not None:
        say(f"They are those of {options.source}.")
    say("A check detects changes, not forgery.")
    return 0


def _chosen(table: TestTable, design: str | None, decided: str | None) -> str | None:
    """Return the name of the design of ``--design``, or else of the decision's design, if any.

    Args:
        table: The designs.
        design: The option.
        decided: Name of the design of the decision; it counts if it is still eligible.
    """
    names = table.names
    if design is None:
        if decided in names and table.eligible()[names.index(decided)]:
            return decided
        return None
    try:
        return names[table.row_of(design)]
    except ArgumentValueError:  # which names another argument
        rule = f"the name or the number of one design, such as {names[0]}"
        raise invalid("--design", rule, design) from None


def run_analyze(options: Options) -> int:
    """Print sensitivities and convergence; write tables and figures."""
    from pymoo_psi.algorithms import sections
    from pymoo_psi.plots import plot_sections, plot_sensitivities, save_figures
    from pymoo_psi.table import convergence, even_part, sensitivities

    path = options.file
    formulation = formulation_of(options)
    table = opened(path, options, formulation)
    if not table.layout.variables:
        raise invalid("--variables", "named for designs without x1, x2, …", Received("none"))
    out = _analysis_folder(path, options.out)
    indices = None
    steps = None
    remarks: list[str] = []
    try:
        remarks += even_part(table)[1]
        indices = sensitivities(table)
    except PsiError as error:
        remarks.append(f"Sensitivities not available: {error}.")
    try:
        steps = convergence(table)
    except PsiError as error:
        remarks.append(f"Convergence not available: {error}.")
    lines = None
    try:
        lines = sections(table, n_values=17)
        for name in ("expected", "low", "high", "error"):  # more digits would be none
            lines[name] = [float(f"{value:.4g}") for value in lines[name]]
    except PsiError as error:
        remarks.append(f"Sections not available: {error}.")
    if out is not None and lines is not None:
        write_frame(lines, out / "sections.csv")
        figure = plot_sections(lines, title=path.name)
        save_figures([("sections", figure)], out, 200, ".png")
    if out is not None and indices is not None:
        write_frame(indices.reset_index(), out / "sensitivities.csv")
        figure = plot_sensitivities(indices, title=path.name)
        save_figures([("sensitivities", figure)], out, 200, ".png")
    if out is not None and steps is not None:
        write_frame(steps.to_frame().reset_index(), out / "convergence.csv")

    say_source(path, table, formulation, ranked=False)
    say(*remarks)
    if indices is not None:
        _say_sensitivities(indices)
    if lines is not None:
        _say_sections(lines)
    if steps is not None:
        frame = steps.to_frame().reset_index()
        print_frame(frame.round(4), "Convergence with the number of tests")
        say(steps.verdict())
    if out is not None:
        say(f"Tables and figures written to {options.out}")
    return 0


def _analysis_folder(path: Path, out: Path | None) -> Path | None:
    """Return the folder for the results, if one is given; refuse one where they replace the source.

    Raises:
        ArgumentValueError: A result has the path of the source.
        OSError: The folder cannot be written to.
    """
    if out is None:
        return None
    folder = results_folder(out)
    for name in ("sensitivities.csv", "convergence.csv", "sections.csv"):
        if path.resolve() == folder.resolve() / name:
            raise invalid("--out", "another folder than that of the file read", str(out))
    return folder


def _say_sections(sections: pd.DataFrame) -> None:
    """Print the least and the greatest value of each objective along each variable."""
    columns = sections["column"].unique().tolist()
    rows = []
    for variable, of_variable in sections.groupby("variable", sort=False):
        row = {"variable": variable}
        for column in columns:
            values = of_variable.loc[of_variable["column"] == column, "expected"]
            row[column] = f"{values.min():.4g} … {values.max():.4g}"
        rows.append(row)
    title = "Sections through the design: each objective where one variable changes, as expected"
    print_frame(pd.DataFrame(rows[:_N_PRINTED]), title)
    errors = sections.groupby("column", sort=False)["error"].first()
    texts = [f"{column} {error:.2g}" for column, error in errors.items()]
    say(f"Errors of prediction, in standard deviations of the tests: {', '.join(texts)}.")
    if len(rows) > _N_PRINTED:
        say(f"({len(rows) - _N_PRINTED} variables not shown)")


def _say_sensitivities(indices: pd.DataFrame) -> None:
    cells = []
    for first_order, _, upper in indices.to_numpy().tolist():
        if math.isnan(first_order):  # of a column that does not vary
            cells.append("–")
        else:
            cells.append(f"{first_order:.2f} ± {upper - first_order:.2f}")
    columns = indices.index.unique("column")
    wide = pd.Series(cells, index=indices.index).unstack("column")[columns]
    largest = indices["first_order"].groupby(level="variable", sort=False).max()
    variables = largest.sort_values(ascending=False).index[:_N_PRINTED]
    title = "First-order sensitivities: the share of the variance that a variable explains alone"
    print_frame(wide.loc[variables].rename_axis("variable").reset_index(), title)
    if len(largest) > len(variables):
        say(f"({len(largest) - len(variables)} variables with smaller ones not shown)")


def run_export(options: Options) -> int:
    """Write the tests of one or several sources as one table or study.

    Several are merged by numbers of test points, as tests of one problem. If one is given as
    ``name=path``, they are experiments with different bounds or samplings, each under its name.
    """
    files, named = _named_files(options.sources)
    out = options.out
    require_output(out, suffixes_for("tests"), *files.values())
    formulation = formulation_of(options)
    tables = {name: opened(path, options, formulation) for name, path in files.items()}
    table = _joined(tables, named)
    file_format = format_of(out, "tests")
    file_format.save_tests(out, table)
    for name, source in tables.items():
        for remark in source.remarks:
            if len(tables) > 1:
                remark = f"{name}: {remark}"
            say(remark)
    if file_format is STUDY and "problem" not in (table.problem or {}):
        say("The problem of the tests is unknown: no run can continue the study.")
    size = counted(len(table), table.layout.words.row)
    say(f"{size} ({table.status_counts()}) written to {out}")
    return 0


def _named_files(sources: Sequence[str]) -> tuple[dict[str, Path], bool]:
    """Return the files of sources by name, and whether any is given as ``name=path``.

    Raises:
        ArgumentValueError: A name is missing or occurs twice.
    """
    files = {}
    named = False
    for source in sources:
        name = source
        file = source
        # The name of an existing file may contain "=".
        if "=" in source and not Path(source).exists():
            name, file = source.split("=", 1)
            named = True
        if not (name and file) or name in files:
            raise invalid("SOURCE", "of different names, as in name=path", Received(source))
        files[name] = Path(file).expanduser()
    return files, named


def _joined(tables: Mapping[str, TestTable], named: bool) -> TestTable:
    """Return the tests of all tables: of named ones as experiments, else by number.

    Raises:
        ArgumentValueError: They do not fit together.
    """
    try:
        if named:
            return TestTable.combined(tables)
        return reduce(TestTable.merge, tables.values())
    except PsiError as error:
        remedy = "NAME=SOURCE joins tests of other bounds and samplings of a problem"
        raise ArgumentValueError(f"{' and '.join(tables)}: {error}; {remedy}") from error
