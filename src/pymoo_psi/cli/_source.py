"""The values of options, the one way from options to a table, and what commands say of it.

The entries of a list are separated by commas; a name that has a comma is put in quotation marks, as
in ``--objectives '"time, s",mass'``. An option that takes a list may be given several times.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import replace
from pathlib import Path

import click
from click.core import ParameterSource

from pymoo_psi._validation import Entries, Names, Received, counted, instance, invalid, known_name
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._console import require_output, say
from pymoo_psi.pareto import RANKING_NAMES, decimal_mark, number
from pymoo_psi.table import Formulation, TestTable, entries_of, limits_of, read_table


def formulation_of(options: Options) -> Formulation:
    """Return the formulation of ``--decision`` with the additions of the other options.

    Raises:
        ArgumentValueError: An option cannot be read, or the file is not a decision.
        OSError: The file cannot be opened.
    """
    path = options.decision
    base = Formulation()
    if path is not None:
        base = Formulation.read_json(path)
    instance(f"page.values in {path}", base.page.get("values", {}), dict)  # untrusted input
    maximize = [*base.maximize, *entries_of(options.maximize)]
    limits = {**limits_of(base.limits), **limits_of(options.limits, "--limits")}
    computed = {**base.computed, **_computed_in(options.compute)}
    units = pairs_in("--units", getattr(options, "units", ()), "column=unit")
    for name, unit in units.items():
        decided = base.units.get(name, unit)
        if decided != unit:  # the limits of the decision would have another meaning
            raise invalid("--units", f"{name}={decided}, as decided", f"{name}={unit}")
    return replace(
        base,
        objectives=entries_of(options.objectives) or base.objectives,
        maximize=list(dict.fromkeys(maximize)),
        limits=limits,
        computed=computed,
        units={**base.units, **units},
        normalize=base.normalize and not options.no_normalize,
    )


def _computed_in(entries: Names) -> dict[str, str]:
    """Return the expressions of ``--compute`` by the name of their column."""
    expressions = {}
    for entry in entries:
        name, _, expression = map(str.strip, entry.partition("="))
        if not (name and expression):
            raise invalid("--compute", "of the form name=expression", entry)
        expressions[name] = expression
    return expressions


def typed_options(names: Names) -> list[str]:
    """Return the words of some options of the running command, those that were typed."""
    context = click.get_current_context()
    words = []
    for option in context.command.params:
        name = str(option.name)
        is_typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if name not in names or not is_typed:
            continue
        value = context.params[name]
        if value is True:
            words.append(option.opts[0])
            continue
        values = value if option.multiple else [value]
        for value in values:
            words += [option.opts[0], str(value)]
    return words


def opened(path: Path, options: Options, formulation: Formulation) -> TestTable:
    """Return the table of a source under a formulation; every command opens sources here.

    Raises:
        ArgumentValueError: The source is not a table, or an option does not fit it.
        OSError: The source cannot be opened.
    """
    formulated = None if formulation == Formulation() else formulation
    table = read_table(
        path,
        formulated,
        variables=entries_of(options.variables) or None,
        repeats=options.repeats,
        drop_incomplete=options.drop_incomplete,
        decimal=options.decimal,
        thousands=options.thousands,
        encoding=options.encoding,
        skip_rows=counts_in("--skip-rows", options.skip_rows, "numbers of lines, such as 1,3"),
        sheet=options.sheet,
    )
    require_free_names(table.layout.columns)
    # All that the command says of it is written as in the source.
    click.get_current_context().with_resource(decimal_mark(table.decimal))
    return table


def opened_by_options(options: Options, suffixes: Names) -> tuple[TestTable, Formulation]:
    """Return the table of the argument FILE, and the formulation of the options with its choice.

    Raises:
        ArgumentValueError: The output must not be written, the source is not a table, or an option
            does not fit it.
        OSError: A file cannot be opened.
    """
    path = options.file
    prototype = getattr(options, "prototype", None)
    require_output(options.out, suffixes, path, prototype, options.decision)
    formulation = formulation_of(options)
    table = opened(path, options, formulation)
    choice = table.formulation
    return table, replace(formulation, chosen=choice.chosen, reason=choice.reason)


def say_source(
    path: Path, table: TestTable, formulation: Formulation, *, ranked: bool = True
) -> None:
    """Print remarks on the rows of a source, on its objectives if none is named, on a decision.

    Args:
        path: The source.
        table: Its table under the formulation.
        formulation: The formulation that the options give.
        ranked: Whether infeasible designs are left out of the result.
    """
    layout = table.layout
    say(*table.remarks)
    if not formulation.objectives:
        say(f"Objectives: {', '.join(map(layout.label_of, layout.objectives))}")
    n_feasible = (table.status == "ok").sum()
    n_failed = (table.status == "failed").sum()
    if n_feasible < len(table):
        sentence = f"{n_feasible} of {counted(len(table), 'design')} are feasible"
        if n_failed:
            sentence += f", {n_failed} {layout.words.failed}"
        if ranked:
            sentence += "; the others are left out"
        say(f"{sentence}.")
    say(*decision_remarks(path, table, formulation))


def decision_remarks(path: Path, table: TestTable, formulation: Formulation) -> list[str]:
    """Return remarks on the chosen design of a decision, and the reason for it.

    Raises:
        ArgumentValueError: The decision has other directions than the table.
    """
    layout = table.layout
    if formulation.page:
        for name in layout.objectives:
            if name in layout.maximize and name not in formulation.maximize:
                rule = "about the same directions as the designs"
                raise invalid("--decision", rule, Received(f"{name} maximized in {path}"))
    remarks = []
    if formulation.chosen is not None:
        remarks.append(_remark_on_choice(table, formulation.chosen, formulation.page))
    if formulation.reason:
        remarks.append(f"Reason: {formulation.reason}")
    return remarks


def _remark_on_choice(table: TestTable, chosen: str, page: Entries) -> str:
    """Say whether the chosen design is what it was when the page saved the decision."""
    warning = f"Warning: {chosen}, the chosen design,"
    if chosen not in table.names:
        return f"{warning} is not among these."
    row = table.names.index(chosen)
    values = page.get("values", {})
    changes = []
    for name in table.layout.objectives:
        value = float(table.column(name)[row])  # values may hold anything
        if name in values and values[name] != value:
            changes.append(f"{name} was {values[name]} and is {number(value, 6)}")
    if changes:
        return f"{warning} has changed: {', '.join(changes)}."
    if not table.eligible()[row]:
        return f"{warning} violates the limits."
    if not values:
        return f"Chosen: {chosen}."
    date = str(page.get("date", "then"))
    return f"Chosen: {chosen}, unchanged since {date[:10]}."


def require_free_names(names: Iterable[str]) -> None:
    """Refuse names of columns that results give to the columns of a ranking."""
    for name in names:
        if name in RANKING_NAMES:
            remedy = "give it another name, by problem.names of a problem"
            raise invalid("the columns", "named unlike the columns of a ranking", name, remedy)


def pairs_in(
    option: str, entries: Names | None, form: str, names: Collection[str] | None = None
) -> dict[str, str]:
    """Return the values of entries ``name=value`` by name; a name may contain "=".

    Args:
        option: The option.
        entries: What was given for it.
        form: The form of an entry, for messages.
        names: The names that are known, if not any is allowed.

    Raises:
        ArgumentValueError: An entry has another form, or a name is unknown or occurs twice.

    Example:
        >>> pairs_in("--units", ["mass=kg", '"time, s=s"'], "column=unit", ["mass", "time, s"])
        {'mass': 'kg', 'time, s': 's'}
    """
    pairs = {}
    for part in entries_of(entries or ()):
        name, _, value = map(str.strip, part.rpartition("="))
        if not (name and value):
            raise invalid(option, f"of the form {form}", Received(part or "nothing"))
        if name in pairs:
            raise invalid(option, f"given once for each name, as {form}", Received(part))
        if names is not None:
            known_name(option, name, names)
        pairs[name] = value
    return pairs


def counts_in(option: str, text: str | None, form: str, mark: str = ",") -> tuple[int, ...]:
    """Return the integers, each 1 or more, of a list with commas or another mark, if it is given.

    Raises:
        ArgumentValueError: The text is something else; ``form`` says what it must be.

    Example:
        >>> counts_in("--evaluations", "1, 3", "numbers of test points")
        (1, 3)
    """
    if text is None:
        return ()
    parts = [part.strip() for part in text.split(mark)]
    # \d would take the digits of every script; 18 of them always fit an int64.
    if not all(re.fullmatch(r"[1-9][0-9]{0,17}", part) for part in parts):
        raise invalid(option, form, text)
    return tuple(map(int, parts))
