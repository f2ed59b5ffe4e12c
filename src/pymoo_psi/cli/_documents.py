"""``pymoo-psi rank``, ``page``, ``live``, ``report``, ``analyze``, ``export``: from a source.

Each command opens its source, makes something of the table, and says what a reader has to know of
both. Rank, page and report are about one choice; analyze is about the tests.
"""

from __future__ import annotations

import os
import shlex
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timezone
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pymoo_psi._names import named_as
from pymoo_psi._numbers import number
from pymoo_psi._output import with_unit
from pymoo_psi._validation import Names, Received, Values, counted, invalid
from pymoo_psi.analysis import (
    counts_sentence,
    decision_sentences,
    position_sentences,
    separation_sentences,
    switching_sentences,
)
from pymoo_psi.cli._app import OF_FORMULATION, OF_SOURCE, Options, path_in
from pymoo_psi.cli._console import (
    cells_of,
    command,
    continued,
    name_column,
    print_columns,
    print_text,
    proposal,
    require_output,
    results_folder,
    say,
    say_next,
    say_ranking,
    text_width,
    write_frame,
)
from pymoo_psi.cli._source import (
    choice_warnings,
    decision_remarks,
    opened,
    opened_by_options,
    require_feasible,
    say_source,
    typed_options,
)
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.files import STUDY, suffixes_for, write_table
from pymoo_psi.pareto import (
    RANKING_COLUMNS,
    Caution,
    EfficiencyRanking,
    cautions_of_distances,
    explain,
    measured_in,
    ranking_frame,
    weight_shares,
    weights_sentence,
    wrapped,
)
from pymoo_psi.table import (
    POINT,
    ROW,
    RUN,
    TEST,
    Schema,
    TestTable,
    free_name,
)

if TYPE_CHECKING:
    import pandas as pd

_N_PRINTED = 12  # variables
_N_IN_DETAIL = 40  # designs
_HTML = (".html", ".htm")


def write_ranking(table: TestTable, out: Path, only_pareto: bool = False) -> int:
    """Write the feasible designs by place, and return how many there are.

    The columns: ``place``; ``test`` or, of a file, ``row`` unless a column has this name; texts
    carried along; variables, objectives, outputs; ``mu1``, ``mu2``, ``mu3``, ``efficiency_rank``,
    ``pareto`` unless dominated designs are left out.

    Args:
        table: The tests.
        out: The file; it is written before anything is printed, which may fail.
        only_pareto: Whether dominated designs are left out.
    """
    ranking = table.feasible_ranking()
    designs = table.take(ranking.rows)
    schema = designs.schema
    columns: Values = {}
    if schema.label is None:
        columns[TEST] = designs.numbers
    elif ROW not in schema.names:
        columns[ROW] = designs.numbers
    for name in (*schema.notes, *schema.variables, *schema.objectives, *schema.outputs):
        columns[_beside_ranking(name, schema)] = designs.column(name)
    frame = ranking_frame(ranking, columns)
    if only_pareto:
        frame = frame[frame["pareto"]].drop(columns="pareto")
    write_frame(frame, out, designs)
    return len(frame)


def _beside_ranking(name: str, schema: Schema) -> str:
    """Return the name of a column beside those of a ranking."""
    if name in RANKING_COLUMNS:
        return free_name(name, {*schema.names, *RANKING_COLUMNS}, "source")
    return name


def run_rank(options: Options) -> int:
    """Rank the designs of a source, write all if a file is named, and print the best."""
    path = options.file
    table = opened_by_options(options, suffixes_for("designs"))
    require_feasible(path, table)
    notes: list[str] = []
    if options.out is not None:
        n_written = write_ranking(table, options.out)
        notes.append(f"{counted(n_written, 'design')} written to {options.out}.")
    cautions = cautions_of_distances(table.feasible_ranking())
    head = [*table.remarks, counts_sentence(table), *decision_remarks(table)]
    head += decision_sentences(table)
    if table.decision.positions:  # without any, pandas is not needed
        notes += position_sentences(table)
    separation = separation_sentences(table)
    following = command("pymoo-psi", "page", str(path), *typed_options(options, OF_SOURCE))
    if options.long:
        _say_all(table, cautions, head, [*notes, *separation])
        say_next(following)
    else:
        notes += separation[:1]
        say_ranking(table, cautions, head, notes, following, all_by="--long", out=options.out)
    return 0


def _say_all(table: TestTable, cautions: Sequence[Caution], head: Names, notes: Names) -> None:
    """Print the best designs with all columns, and on what the proposal depends."""
    columns = text_width()
    print_text(wrapped(head, columns))
    ranking = table.feasible_ranking()
    print_columns(_in_detail(table, ranking), "", mark=table.decimal)
    if len(ranking.rows) > _N_IN_DETAIL:
        say(f"… {len(ranking.rows) - _N_IN_DETAIL} more: --out FILE.csv")
    why = explain(ranking)
    steps = list(why.sentences[2:])
    if steps:
        steps.insert(0, "One step away:")
    sentences = [
        *proposal(table, cautions),
        *(f"Caution: {caution}" for caution in cautions),
        *steps,
        weights_sentence(ranking, why.row, weight_shares(ranking)),
        *switching_sentences(table),
        f"Places are by the distance from the best values. {measured_in(ranking)}.",
        *notes,
    ]
    print_text("\n" + wrapped([*filter(None, sentences)], columns))


def _in_detail(table: TestTable, ranking: EfficiencyRanking) -> list[tuple[str, list[Any]]]:
    """Return all columns of the first designs by place: names, places, objectives, the rest."""
    from pymoo_psi.page import number_formats

    rows = ranking.by_place[:_N_IN_DETAIL]
    places = ranking.place[rows].astype(str)
    places[~ranking.pareto[rows]] = "dominated"
    designs = table.take(ranking.rows[rows])
    schema = table.schema
    word, *names = name_column(table, rows)
    columns: list[tuple[str, list[Any]]] = [(word, names), ("place", [*places])]
    formats = number_formats(table)
    for name in (*schema.objectives, *schema.variables, *schema.outputs, *schema.notes):
        if name in {schema.label, RUN, POINT}:
            continue
        heading = with_unit(_beside_ranking(name, schema), schema[name].unit)
        if name in schema.objectives:
            heading += " ↑" if schema[name].maximize else " ↓"
        columns.append((heading, cells_of(designs.column(name), formats.get(name))))
    return columns


def run_page(options: Options) -> int:
    """Write the page and say where it is. Its reader can move the limits that it opens with."""
    from pymoo_psi.page import decision_page

    path = options.file
    out = options.out
    table = opened_by_options(options, _HTML)
    title = _title(options, table, path.stem)
    page = decision_page(table, prototype=_existing(options, table), title=title)
    further = shlex.join(_command_for_more(path, table))
    replace(page, origin=path.name, further=further).save(out)
    say_source(table.under(limits={}))
    say(f"{counted(len(page.table), 'design')}. Open {out} in a browser.")
    return 0


def run_live(options: Options) -> int:
    """Serve the page of a study until interrupted."""
    import webbrowser

    from pymoo_psi.server import serve

    def end_with_input() -> None:
        sys.stdin.read()
        os._exit(0)

    def show(address: str) -> None:
        say(address)
        if not options.file.exists():
            say(f"{options.file} does not exist yet; the page waits for its first tests.")
        if not options.no_browser:
            webbrowser.open(address)

    if options.attached:
        threading.Thread(target=end_with_input, daemon=True).start()
    serve(options.file, port=options.port, steer=options.steer, say=show)
    return 0


def _existing(options: Options, table: TestTable) -> TestTable | None:
    """Return existing designs, read by the marks of their own file.

    The options that say how the designs are read apply if these leave something open.
    """
    from pymoo_psi.page import existing_designs

    reading = {name: getattr(options, name) for name in ("decimal", "encoding", "sheet")}
    with named_as({}, reading):  # errors recommend no option that is not about this file
        try:
            return existing_designs(options.prototype, table)
        except ArgumentValueError:
            with suppress(ArgumentValueError):
                return existing_designs(options.prototype, table, **reading)
            raise


def _title(options: Options, table: TestTable, default: str) -> str:
    return options.title or str(table.decision.page.get("title") or default)


def run_report(options: Options) -> int:
    """Write the report and say where it is.

    Returns:
        0, or 1 if no design is feasible; the report then says which limits reject most designs.
    """
    from pymoo_psi.report import decision_report

    path = options.file
    out = options.out
    table = opened_by_options(options, _HTML)
    remarks = [*table.remarks, *choice_warnings(table)]
    now = datetime.now(timezone.utc)
    origin = f"{now.day} {now:%B %Y}"
    title = _title(options, table, path.name)
    if title != path.name:
        origin = f"{path.name} · {origin}"
    report = decision_report(
        table,
        design=options.design,
        title=title,
        question=options.question or "",
        about=[origin, *remarks],
        prototype=_existing(options, table),
    )
    words = ["pymoo-psi", "report", str(path), *typed_options(options, [*vars(options)])]
    more = _command_for_more(path, table, typed_options(options, OF_FORMULATION))
    made, further = ["\n".join(continued(command(*line))) for line in (words, more)]
    replace(report, command=made, further=further).save(out)
    say_source(table)
    say(*report.cautions, f"{report}. Open {out} in a browser, or print it.")
    return 0 if report.ranking is not None else 1


def run_analyze(options: Options) -> int:
    """Print sensitivities, sections and convergence; write tables and figures."""
    path = options.file
    table = opened(path, options)
    if not table.schema.variables:
        raise invalid("--variables", "given, as no column is named x1, x2, …", Received("none"))
    if options.out is not None:
        folder = results_folder(options.out)
    say_source(table)
    for name, say_analysis in _ANALYSES.items():
        try:
            frame = say_analysis(table)
        except PsiError as error:
            say(f"{name.capitalize()} not available: {error}.")
            continue
        if options.out is not None:
            _write_analysis(name, frame, folder, path.name)
    if options.out is not None:
        say(f"Tables and figures written to {options.out}")
    return 0


def _write_analysis(name: str, frame: pd.DataFrame, folder: Path, title: str) -> None:
    """Write the frame of an analysis, and its figure if there is one."""
    from pymoo_psi import plots

    plot = getattr(plots, f"plot_{name}", None)
    if plot is not None:
        plots.save_figures([(name, plot(frame, title=title))], folder, dpi=200)
    if frame.index.names != [None]:
        frame = frame.reset_index()
    write_frame(frame, folder / f"{name}.csv")


def _say_sensitivities(table: TestTable) -> pd.DataFrame:
    """Print the sensitivities, and return them to be written."""
    from pymoo_psi.analysis import even_part, sensitivities

    say(*even_part(table)[1])
    indices = sensitivities(table)
    shares = indices["first_order"]
    texts = shares.map("{:.2f}".format) + " ± " + (indices["upper"] - shares).map("{:.2f}".format)
    title = "First-order sensitivities: the share of the variance that a variable explains alone"
    greatest = shares.groupby(level="variable", sort=False).max()
    variables = greatest.sort_values(ascending=False).index.tolist()
    _print_by_variable(texts, variables, title, table.decimal)
    return indices


def _say_sections(table: TestTable) -> pd.DataFrame:
    """Print the least and the greatest value of each section, and return all to be written."""
    from pymoo_psi.algorithms import sections

    lines = sections(table, n_values=17)
    for name in ("expected", "lower", "upper", "error"):  # further digits mean nothing
        lines[name] = [float(f"{value:.4g}") for value in lines[name]]
    ends = lines.groupby(["column", "variable"], sort=False)["expected"].agg(["min", "max"])
    texts = ends["min"].map(number) + " … " + ends["max"].map(number)
    title = "Sections through the design: predicted objectives while one variable changes"
    _print_by_variable(texts, lines["variable"].unique().tolist(), title, table.decimal)
    errors = lines.groupby("column", sort=False)["error"].first()
    facts = [f"{name} {number(error, 2, mark=table.decimal)}" for name, error in errors.items()]
    say(f"Errors of prediction, in standard deviations of the tests: {', '.join(facts)}.")
    return lines


def _say_convergence(table: TestTable) -> pd.DataFrame:
    """Print the convergence with the number of tests, and return it to be written."""
    from pymoo_psi.analysis import convergence, convergence_sentence

    steps = convergence(table)
    frame = steps.drop(columns="hypervolume_error")
    title = "Convergence with the number of tests"
    print_columns(frame.reset_index().items(), title, mark=table.decimal)
    say(convergence_sentence(steps))
    return frame


def _command_for_more(path: Path, table: TestTable, purpose: Names = ()) -> list[str]:
    """Return the words of the command for 16 more tests of a study, if a command has begun it.

    Args:
        path: The source of the table; only a study can be continued.
        table: Its tests.
        purpose: Words of options that say what the tests are for.
    """
    from pymoo_psi.study import Study

    if path.suffix != STUDY.suffix or not table.schema.variables:
        return []
    words: list[str] = []
    for run in Study(path).facts().runs:
        words = shlex.split(run.record.get("command", "")) or words
    if not words:
        return []
    points = ["--points", "+16"]
    if words[0] == "ask":
        points = ["--points", "16", "--out", "next.csv"]
    words += ["--algorithm", "surrogate", "--study", str(path), *purpose, *points]
    return ["pymoo-psi", *words]


def _print_by_variable(texts: pd.Series[str], variables: list[str], title: str, mark: str) -> None:
    """Print numbers by column and variable as a table with a row for each of some variables."""
    columns = texts.index.unique("column").tolist()
    rows = texts.str.replace(".", mark).unstack("column").reindex(variables)[columns]
    print_columns(rows.rename_axis("variable").reset_index().head(_N_PRINTED).items(), title)
    if len(rows) > _N_PRINTED:
        say(f"({len(rows) - _N_PRINTED} variables not shown)")


_ANALYSES = {
    "sensitivities": _say_sensitivities,
    "sections": _say_sections,
    "convergence": _say_convergence,
}


def run_export(options: Options) -> int:
    """Write the tests of one source, or of several of one run, as one table or study.

    Several are merged by the numbers of their tests.
    """
    files = [path_in(source) for source in options.sources]
    out = options.out
    require_output(out, suffixes_for("tests"), *files)
    # Every test of a study, no means.
    options = Options(**vars(options) | {"average_by": options.average_by or False})
    tables = [opened(path, options) for path in files]
    try:
        table = reduce(TestTable.merge, tables)
    except PsiError as error:
        raise ArgumentValueError(f"{' and '.join(options.sources)}: {error}") from error
    write_table(table, out)
    for source in tables:
        say(*source.remarks)
    if out.suffix == STUDY.suffix and "problem" not in (table.problem or {}):
        say("The problem of the tests is unknown: no run can continue the study.")
    size = counted(len(table), table.schema.words["row"])
    say(f"{size} ({table.status_counts()}) written to {out}")
    return 0
