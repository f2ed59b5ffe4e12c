"""The values of options, the one way from options to a table, and what commands say of it.

The entries of a list are separated by commas; a name that has a comma is put in quotation marks, as
in ``--objectives '"time, s",mass'``. An option that takes a list may be given several times.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from itertools import chain
from pathlib import Path

import click
from click.core import ParameterSource

from pymoo_psi._numbers import number
from pymoo_psi._validation import Names, Received, invalid
from pymoo_psi.analysis import counts_sentence, none_left_reason
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._console import require_output, say
from pymoo_psi.errors import PsiError
from pymoo_psi.files import read_table
from pymoo_psi.pareto import RANKING_COLUMNS, explain
from pymoo_psi.table import (
    Decision,
    Formulation,
    TestTable,
    entries_of,
    limits_of,
    require_decimal_points,
)


def decision_in(options: Options) -> Decision:
    """Return the decision of ``--decision`` with what the other options add to its formulation.

    Raises:
        ArgumentValueError: An option cannot be read, or the file is not a decision.
        OSError: The file cannot be opened.
    """
    decision = Decision()
    if options.decision is not None:
        decision = Decision.read_json(options.decision)
    base = decision.formulation
    units = pairs_in("--units", getattr(options, "units", ()), "column=unit")
    for name, unit in units.items():
        decided = base.units.get(name, unit)
        if decided != unit:  # the limits of the decision would have another meaning
            raise invalid("--units", f"{name}={decided}, as decided", f"{name}={unit}")
    stated = Formulation(
        entries_of(options.objectives),
        maximize=list(dict.fromkeys(entries_of(options.maximize))),
        limits=limits_of(options.limits, "--limits"),
        computed=_computed_in(options.compute),
        units=units,
        normalize=not options.no_normalize,
    )
    return replace(decision, formulation=stated.combine_first(base))


def _computed_in(entries: Names) -> dict[str, str]:
    """Return the expressions of ``--compute`` by the name of their column."""
    expressions = {}
    for entry in entries:
        name, _, expression = map(str.strip, entry.partition("="))
        if not (name and expression):
            raise invalid("--compute", "of the form name=expression", entry)
        expressions[name] = expression
    return expressions


def typed_options(options: Options, names: Collection[str]) -> list[str]:
    """Return the words of some options, those that were typed."""
    context = options.context
    words = []
    for option in context.command.params:
        name = str(option.name)
        if name not in names or not isinstance(option, click.Option):
            continue
        if context.get_parameter_source(name) is not ParameterSource.COMMANDLINE:
            continue
        value = context.params[name]
        for entry in value if option.multiple else [value]:
            words.append(option.opts[0])
            if isinstance(entry, tuple):
                words.append(",".join(map(str, entry)))
            elif entry is not True:
                words.append(str(entry))
    return words


def opened(path: Path, options: Options) -> TestTable:
    """Return the table of a source under the decision of the options; all sources come from here.

    Raises:
        ArgumentValueError: The source is not a table, or an option does not fit it.
        OSError: The source cannot be opened.
    """
    table = read_table(
        path,
        decision_in(options),
        variables=entries_of(options.variables) or None,
        average_by=options.average_by,
        drop_incomplete=options.drop_incomplete,
        decimal=options.decimal,
        encoding=options.encoding,
        skip_rows=tuple(chain(*options.skip_rows)),
        sheet=options.sheet,
    )
    require_free_names((*table.schema.objectives, *table.schema.variables))
    if table.decimal == ",":
        require_decimal_points(options.limits, "--limits")
    return table


def opened_by_options(options: Options, suffixes: Names) -> TestTable:
    """Return the table of the argument FILE, if the output may be written.

    Raises:
        ArgumentValueError: The output must not be written, the source is not a table, or an option
            does not fit it.
        OSError: A file cannot be opened.
    """
    path = options.file
    if options.out is not None:
        prototype = getattr(options, "prototype", None)
        require_output(options.out, suffixes, path, prototype, options.decision)
    return opened(path, options)


def require_feasible(path: Path, table: TestTable) -> None:
    """Refuse a source of which no design is within the limits, and say which of them reject most.

    Raises:
        PsiError: There is none.
    """
    if not table.feasible().any():
        raise PsiError(f"{path}: No design is left: {none_left_reason(table)}")


def say_source(table: TestTable) -> None:
    """Print remarks on the rows of a source, on its objectives if none is named, on a decision."""
    say(*table.remarks)
    if not table.formulation.objectives:
        headings = [table.schema[name].heading for name in table.schema.objectives]
        say(f"Objectives: {', '.join(headings)}")
    if not table.feasible().all():
        say(counts_sentence(table))
    say(*decision_remarks(table))


def decision_remarks(table: TestTable) -> list[str]:
    """Return remarks on the chosen design of a decision, and the reason for it."""
    decision = table.decision
    remarks = choice_warnings(table)
    if decision.chosen is not None and not remarks:
        remarks.append(f"Chosen: {decision.chosen}.")
        why = explain(table, decision.chosen)
        if why.dominated_by >= 0:
            remarks.append(f"Warning: {why.standing}")
    if decision.reason:
        remarks.append(f"Reason: {decision.reason}")
    return remarks


def choice_warnings(table: TestTable) -> list[str]:
    """Warn if the chosen design is not there, or not as the page saved the decision.

    Raises:
        ArgumentValueError: The page had other directions than the designs.
    """
    decision = table.decision
    if decision.page:
        _require_directions(table)
    chosen = decision.chosen
    if chosen is None:
        return []
    warning = f"Warning: {chosen}, the chosen design,"
    if chosen not in table.names:
        return [f"{warning} is not among these designs."]
    row = table.names.index(chosen)
    values = decision.page.get("values", {})
    changes = []
    for name in table.schema.objectives:
        value = float(table.column(name)[row])
        if name in values and values[name] != value:  # a decision may hold any value
            now = number(value, 6, mark=table.decimal)
            changes.append(f"{name} was {values[name]} and is {now}")
    if changes:
        return [f"{warning} has changed: {', '.join(changes)}."]
    if not table.feasible()[row]:
        return [f"{warning} violates the limits."]
    return []


def _require_directions(table: TestTable) -> None:
    """Refuse a decision that was saved where other objectives were maximized."""
    for name in table.schema.objectives:
        if name in table.schema.maximize and name not in table.decision.formulation.maximize:
            rule = "about the same directions as the designs"
            raise invalid("--decision", rule, Received(f"{name} maximized among these"))


def require_free_names(names: Iterable[str]) -> None:
    """Refuse objectives and variables named as the columns of a ranking."""
    for name in names:
        if name in RANKING_COLUMNS:
            rule = "named unlike the columns of a ranking"
            remedy = "rename it, or name others by --objectives and --variables"
            raise invalid("objectives and variables", rule, name, remedy)


def pairs_in(option: str, entries: Names, form: str) -> dict[str, str]:
    """Return the values of entries ``name=value`` by name; a name may contain "=".

    Args:
        option: The option.
        entries: What was given for it.
        form: The form of an entry, for messages.

    Raises:
        ArgumentValueError: An entry has another form, or a name occurs twice.

    Example:
        >>> pairs_in("--units", ["mass=kg", '"time, s=s"'], "column=unit")
        {'mass': 'kg', 'time, s': 's'}
    """
    pairs: dict[str, str] = {}
    for part in entries_of(entries):
        name, _, value = map(str.strip, part.rpartition("="))
        if not (name and value) or name in pairs:
            rule = f"of the form {form}, once for each name"
            raise invalid(option, rule, Received(part or "nothing"))
        pairs[name] = value
    return pairs
