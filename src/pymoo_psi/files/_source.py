"""From a source of any kind to a table: :func:`read_table` is the only way to open one.

A source holds tests, with a head that describes all columns, or cells, whose head states less.
Cells become designs: rows that do not count are left out, columns are read as numbers. Then each
column gets a role, by the formulation, the source or its name, and a table is made.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from shlex import quote
from typing import Any, Literal

import numpy as np

from pymoo_psi._kinds import Kind, first_of, kind_of_cells
from pymoo_psi._names import argument, name_of, named_as
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Columns,
    Entries,
    FilePath,
    Head,
    Names,
    Received,
    collection,
    counted,
    invalid,
    known_names,
    name_list,
    real_array,
    source_type,
)
from pymoo_psi.analysis import average_repeats, has_repeats, undeclared_repeats
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.files._cells import (
    Cells,
    TextColumn,
    UnfitError,
    cells_of_frame,
    is_blank,
    read_columns,
    require_designs,
)
from pymoo_psi.files._format import SourceFile
from pymoo_psi.files._formats import recognized
from pymoo_psi.files._tests import stated_by_designs, tests_of_cells, tests_of_folder
from pymoo_psi.pareto import EQ_TOLERANCE, RANKING_COLUMNS, listed
from pymoo_psi.table import (
    EQUALITY,
    INEQUALITY,
    LABEL,
    MARK,
    NOTE,
    OBJECTIVE,
    OUTPUT,
    RESULTS,
    ROW,
    RUN,
    STATUSES,
    TEST,
    VARIABLE,
    Column,
    Decision,
    Formulation,
    Limit,
    Schema,
    TestTable,
    added_columns,
    decision_of,
    entry_of,
    names_of,
    texts_of,
)

# Columns that name designs, and after them columns that number the rows of a file, which names of
# designs say better. The last ones do so only if they hold consecutive numbers, in any order: "no"
# is also an exhaust gas.
_NAMING = (TEST, "test_point", "label", "name", "id", "design")
_COUNTING = (ROW, "index", "nr", "nr.", "no.", "nummer", "#", "unnamed: 0", "number", "pos.")
_TRIALS = (
    "no",
    "trial",
    "sample",
    "run",
    "case",
    "experiment",
    "iteration",
    "versuch",
    "probe",
    "pos",
)
_LABELS = (*_NAMING, *_COUNTING, *_TRIALS)
# Those under which nobody writes what is ranked, as under "index" or "design".
_IDS = {"id", "nr", "nr.", "no.", "nummer", "#", "pos."}
# Names as papers and pymoo number them, with a unit or without: f1, X1, x_1, g1, "f1 [kg]".
_NUMBERED = re.compile(r"(?P<letter>[fxugh])_?(?P<number>\d+)(?:\s*[\[(].*[\])])?", re.IGNORECASE)
_ROLES = {"f": OBJECTIVE, "x": VARIABLE, "u": VARIABLE, "g": INEQUALITY, "h": EQUALITY}
_MET = {INEQUALITY: Limit(upper=0.0), EQUALITY: Limit(-EQ_TOLERANCE, EQ_TOLERANCE)}
# By its marks an export of the page is recognized.
_MARK = re.compile(r"place \d+|dominated|outside the limits|prototype")
# Words by which other programs say that a design has failed, but not "no errors".
_FAILURE = re.compile(
    r"(?!(?:.*\W)?(?:no|0|without|ohne|keine?)[\s_-])(?:.*[\W_])?"
    r"(?:fail(?:s|ed|ure)?|errors?|time[\s_-]?out|timed[\s_-]?out|abort(?:ed)?|"
    r"cancell?ed|crash(?:ed)?|killed|interrupted|pruned|diverged?|(?:not|non|un)[\s_-]?converged|"
    r"invalid|infeasible|unfeasible|rejected|nok|not[\s_-]?ok|fehler|fehlgeschlagen|abgebrochen|"
    r"divergiert|ungültig)(?:[\s_:;,.!(].*)?",
    re.IGNORECASE | re.DOTALL,
)
# Marks of an objective to be maximised, in its name: "range ↑", "range [km] (max)".
_UPWARD = re.compile(
    r"[↑▲⬆]|[(\[](?:max\.?|maximi[sz]ed?|(?:more|higher|larger) is better)[)\]]", re.IGNORECASE
)
_FEW = 6  # the most texts that a remark lists
# Integers as programs write them, so not 007, a label. 18 digits are below 2^63.
_INTEGER = re.compile(r"-?(?:0|[1-9][0-9]{0,17})")


def read_table(
    source: str | PathLike[str] | Any,
    formulation: Formulation | Decision | None = None,
    *,
    variables: Names | None = None,
    average_by: str | Literal[False] | None = None,
    drop_incomplete: bool = False,
    decimal: str | None = None,
    encoding: str | None = None,
    skip_rows: Collection[int] = (),
    sheet: str | None = None,
) -> TestTable:
    r"""Return the table in a source of any kind, which is read once, so that it may be a pipe.

    A table of tests keeps its layout. Designs of other sources are feasible, have no bounds, and
    are numbered by their rows, from 1. Their objectives are the first of these that exist: those
    that the formulation names; those that the source states, as rankings and exports of the page
    do; f1, f2, … (beside x1, x2, … or alone, also F1, f_1 or f1 [kg]); all columns of numbers
    except labels, codes such as 01067, and x1, x2, …, which are variables. Other columns of numbers
    become outputs, all others notes. ``remarks`` states what a reader must know about rows and
    columns, such as missing shares, or columns of numbers that are no objectives by these rules.

    An ambiguous number is refused, such as ``1.250`` if the point may be a thousands separator; the
    message names the option that decides. A column of numbers with other cells is refused, too. If
    the formulation names the objectives, only the columns that it names must be readable.

    Args:
        source: A path, a data frame, an ``(n, m)`` array of objectives or a result, an algorithm or
            a population of pymoo, all minimised, or a :class:`TestTable`. A path leads to a study
            or a folder of studies; a text with commas, semicolons, tabs, bars or spaces between its
            cells; a workbook (.xlsx); a list of designs in JSON; or a file of a format that was
            added to ``FORMATS``.
        formulation: Objectives, directions and limits, in addition to what the source states: its
            limits on other columns hold, and it is ranked without normalisation if either says so.
            :meth:`TestTable.under` without a source replaces all of them.
        variables: Names of the columns with design variables; by default as the source says.
        average_by: The column whose equal values mark tests of one design, or ``"variables"``; the
            design is their mean, see :func:`~pymoo_psi.analysis.average_repeats`. By default only
            repeated tests of a study are averaged, by variables; ``False`` averages nothing.
        drop_incomplete: Count designs without a finite objective as failed, instead of refusing the
            source.
        decimal: The decimal mark of texts, ``"."`` or ``","``; the other one may then divide
            thousands, as spaces and apostrophes may.
        encoding: The encoding of a text; by its byte-order mark, or UTF-8, unless given.
        skip_rows: Numbers of lines to leave out, from 1, such as titles and lines of units.
        sheet: Name of the sheet of a workbook; the only one unless given.

    Raises:
        OSError: The file cannot be opened.
        ArgumentValueError: The source is not a table of named columns with at least one design, a
            row is named as a sum or statistic, such as Total, its last row is the sum of others, a
            required column cannot be read, or the formulation does not fit.
        StudyError: The file is a database but no study, or a damaged one.
        PsiError: A package that reads such files is not installed.

    Example:
        >>> import os, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = os.path.join(folder, "set.csv")
        ...     _ = Path(path).write_text("id;cost;mass\nA;1,5;1.250\nB;2;980\n")
        ...     table = read_table(path, Formulation(maximize=["mass"]), decimal=",")
        >>> table.column("mass"), table.schema.maximize, table.names
        (array([1250.,  980.]), ('mass',), ['A', 'B'])
    """
    path = Path(source) if source_type(source) == "file" else None
    asked = decision_of(formulation)
    skipped = frozenset(collection("skip_rows", skip_rows, "a list of numbers of lines"))
    try:
        content = _content(source, asked.formulation.units, encoding, skipped, sheet)
        is_study = path is not None and isinstance(content, TestTable)
        if not isinstance(content, TestTable) and MARK in content[1]:
            content = tests_of_cells(content[1], content[0].columns)
        if isinstance(content, TestTable):
            for name, value in (("skip_rows", skip_rows), ("variables", variables)):
                if value:
                    raise invalid(name, "left out for a table of tests, which has its own", value)
            table = content
        else:
            cells, head = content
            head = {**head, "decimal": decimal or head.get("decimal")}
            if average_by in cells.columns:
                head["label"] = average_by
            elif path is not None and not average_by:
                # Of others, equal rows are repeated tests, or what their owner counts.
                cells = _without_copies(cells)
            cells = _designs(cells, head, asked.formulation)
            table = _table(cells, head, asked.formulation, variables)
            incomplete = _incomplete(cells, table, asked.formulation, drop_incomplete)
            if not average_by:  # else such a row is a test of a design that may have others
                table = replace(table, remarks=(*table.remarks, *incomplete))
        # One more limit, as a command adds it, must not drop those that are part of a file.
        decision = asked.combine_first(table.decision)
        if average_by or (average_by is None and is_study and has_repeats(table)):
            with named_as({"by": name_of("average_by")}):
                table = average_repeats(replace(table, decision=decision), average_by)
        elif formulation is not None:
            table = table.under(decision)
    except ArgumentValueError as error:
        if path is None and not isinstance(error, UnfitError):
            raise
        subject = path or f"the {name_of('source')}"
        raise ArgumentValueError(f"{subject}: {error}") from None
    designs = table.take(table.feasible())
    remarks = [*table.remarks]
    if average_by is None and not isinstance(source, TestTable):
        remarks += undeclared_repeats(designs)
    return replace(table, remarks=(*remarks, *_failures(designs)))


# From sources to cells


def _content(
    source: Any,
    units: Entries,
    encoding: str | None = None,
    skip_rows: Collection[int] = (),
    sheet: str | None = None,
) -> TestTable | tuple[Cells, Head]:
    """Return what a source holds: a table, or cells and their head, names without units."""
    kind = source_type(source)
    content: Any
    if kind != "file":
        if skip_rows:
            raise invalid("skip_rows", "left out for data in Python", [*skip_rows])
        content = _content_of_object(source, kind)
    elif Path(source).is_dir():
        content = tests_of_folder(Path(source))
    else:
        with Path(source).open("rb") as stream:
            file = SourceFile(Path(source), stream, encoding, skip_rows, sheet)
            content = recognized(file).read(file)
    if isinstance(content, TestTable):
        return content
    cells, head = content
    if not isinstance(cells, Cells):  # of a format that a user has added
        import pandas as pd

        cells, _ = cells_of_frame(pd.DataFrame(dict(cells), dtype=object))
    if MARK in head:  # it has all names
        return cells, head
    stated, _ = stated_by_designs(head)
    names = names_of([*cells.columns], {**units, **stated.formulation.units})
    return replace(cells, columns=dict(zip(names, cells.columns.values(), strict=True))), head


def _content_of_object(source: Any, kind: str) -> TestTable | tuple[Cells, Head]:
    """Return what an object of Python holds, by its type."""
    if isinstance(source, TestTable):
        return source
    if kind == "frame":
        return cells_of_frame(source)
    if kind in ("result", "population"):
        return _table_of_population(getattr(source, "opt", source))
    F = real_array("source", source, "or give a data frame or the path of a file")
    if F.ndim != 2 or F.size == 0:
        raise invalid("source", "of shape (n, m)", Received(f"shape {F.shape}"))
    columns = {f"f{j + 1}": column for j, column in enumerate(F.T.tolist())}
    return Cells(columns, range(1, len(F) + 1)), {"objectives": [*columns]}


def _table_of_population(population: Any) -> TestTable:
    """Return the designs of a population of pymoo.

    Objectives are called f1, f2, …, constraints g1 and h1, variables x1 or by their names.
    """
    if population is None or len(population) == 0:
        raise invalid("source", "a result of pymoo with designs", Received("none"))
    X, F, G, H = population.get("X", "F", "G", "H")
    numbers = range(1, len(F) + 1)
    return _named_by_rows(TestTable.of(numbers, [*X], F, G, H), numbers)


def _named_by_rows(table: TestTable, rows: Sequence[int]) -> TestTable:
    """Return a table whose designs are called by the numbers of their rows."""
    label = "design" if ROW in table.schema.values else ROW
    return table.with_notes({label: table.data.get(label, rows)}, label)


def source_columns(
    source: FilePath | Any,
    units: Entries,
    *,
    decimal: str | None,
    sheet: str | None,
) -> tuple[Cells, dict[str, TextColumn]]:
    """Return the cells of a source that is no table of tests, and its columns with their numbers.

    Args:
        source: A file or a data frame.
        units: Units that may follow the names of columns.
        decimal: The decimal mark, if it is known.
        sheet: The sheet of a workbook.

    Raises:
        OSError: The file cannot be opened.
        UnfitError: It is no table of named columns.
    """
    content = _content(source, units, sheet=sheet)
    if isinstance(content, TestTable) or MARK in content[1]:
        raise UnfitError("it is a table of tests, and not one of numbers alone")
    cells, head = content
    columns = read_columns(cells, decimal, separator=head.get("separator", ""))
    for name, column in columns.items():
        if column.unit and column.unit != units.get(name):
            remedy = f"write it without {column.unit}, in the unit of the column"
            problem = cells.place(name, 0)
            columns[name] = column._replace(numbers=None, problem=problem, remedy=remedy)
    return cells, columns


# The rows that are designs


def _without_copies(cells: Cells) -> Cells:
    """Return the first of rows that are equal in all cells."""
    texts = [[str(cell).strip() for cell in column] for column in cells.columns.values()]
    is_new = first_of(zip(*texts, strict=True)) == np.arange(len(cells.rows))
    return cells.kept(is_new.tolist(), "equal to another one in all cells")


def _designs(cells: Cells, head: Head, formulation: Formulation) -> Cells:
    """Return the cells of feasible designs.

    Raises:
        ArgumentValueError: No design is feasible, or it is not known which columns are what.
    """
    columns = cells.columns
    place, mark = added_columns(columns, present=True)
    derived: tuple[str, ...] = ()  # what a program has written beside the columns of designs
    # A failed design may hold anything, so it is left out before numbers are read.
    if {*RESULTS} <= {*columns} and {*map(str, columns["status"])} <= {*STATUSES}:
        derived = RESULTS  # of a table of tests
        cells = cells.kept([status == "ok" for status in columns["status"]], "not feasible")
    elif {place, mark} <= {*columns} and all(map(_MARK.fullmatch, map(str, columns[mark]))):
        derived = (place, mark)  # of a page
        cells = cells.kept([text != "prototype" for text in columns[mark]], "prototypes of a page")
    elif {*RANKING_COLUMNS} <= {*columns}:
        derived = RANKING_COLUMNS
    is_stated = head.get("objectives") or formulation.objectives
    if not is_stated and (derived == RESULTS or (derived and "metadata" in head)):
        raise UnfitError(
            f"it is without {head.get('metadata', 'its table')}, which says what the columns are",
            "put it beside the file or give the table itself, or say --objectives and --maximize "
            "(Formulation(objectives=..., maximize=...))",
        )
    others = {name: column for name, column in cells.columns.items() if name not in derived}
    return replace(cells, columns=others)


# The columns and their roles


def _labelled(
    cells: Cells, head: Head, objectives: Collection[str]
) -> tuple[dict[str, TextColumn], str | None, list[str]]:
    """Return the columns, the name of the one that names the designs, and of all that number them.

    Args:
        cells: The cells.
        head: What the source says of them.
        objectives: Columns that the user calls objectives, which name no designs.
    """
    labels = [name for name in _labels(cells) if name not in objectives]
    columns = read_columns(cells, head.get("decimal"), labels, head.get("separator", ""))
    label = head.get("label")
    if label not in columns:  # also where it follows from others
        label = _label(columns, labels)
    if label is not None:
        labels.append(label)
    if label == TEST and RUN in columns:
        labels.append(RUN)
    return columns, label, labels


def _labels(cells: Cells) -> list[str]:
    """Return the columns that name or number the designs, by their names, the best one first."""
    labels = []
    for name, column in cells.columns.items():
        is_label = _word(name) in _LABELS
        if _word(name) in _TRIALS:
            numbers = np.sort(_integers(column))
            is_label = len(numbers) > 2 and _count_on(numbers)
        if is_label:
            labels.append(name)
    return sorted(labels, key=lambda name: _LABELS.index(_word(name)))


def _word(name: str) -> str:
    return name.strip().lower()


def _label(columns: Mapping[str, TextColumn], labels: Names) -> str | None:
    """Return the column that names the designs, or None.

    A column such as "id" names them. Without one, the first column that does not number rows names
    them if it holds texts that all differ: such lists are common, under "Variante" as under
    "Model", but not under "x1". So it does before numbers under "test" or "design". Otherwise a
    column that numbers the rows does.
    """
    best = next(iter(labels), None)
    first = next((name for name in columns if name not in labels), None)
    if first is None or _NUMBERED.fullmatch(first):
        return best
    column = columns[first]
    names = {cell for cell in column.cells if isinstance(cell, str) and not is_blank(cell)}
    if len(names) < len(column.cells) or column.numbers is not None or column.problem:
        return best
    if best is None:
        return first
    order = [*columns]
    is_behind = columns[best].numbers is not None and order.index(first) < order.index(best)
    if column.codes is None and (is_behind or _word(best) not in _NAMING):
        return first
    return best


def _count_on(numbers: Array) -> bool:
    """Whether each number is by 1 greater than the one before it."""
    return bool((numbers[1:] == numbers[:-1] + 1).all())  # unlike a difference, never overflows


def _claims(
    columns: Mapping[str, TextColumn],
    formulation: Formulation,
    named: Names,
    variables: Names,
    labels: Names,
) -> dict[str, str]:
    """Return what each column is taken for, "" for nothing; objectives first.

    Args:
        columns: The columns that follow from no others.
        formulation: What the user says.
        named: The objectives that the user or the source names, if any.
        variables: The variables that the user or the source names, if any.
        labels: The columns that name or number designs.

    Raises:
        ArgumentValueError: A column is not there, or fewer than two may be objectives.
    """
    free = {name: columns[name] for name in columns if name not in (*labels, *variables)}
    numbered = _numbered(free)
    objectives = [name for name in named if name not in formulation.computed]
    objectives = objectives or _of_role(numbered, OBJECTIVE)
    if not objectives:
        others = [name for name in free if name not in numbered]
        objectives = [name for name in others if columns[name].has_numbers()]
    if not named:  # what has a direction is an objective
        asked = {*objectives, *formulation.maximize}.difference(variables)
        objectives = [name for name in columns if name in asked]
    if len(objectives) < (1 if named else 2):
        raise UnfitError(
            "two columns or more must be of numbers, without labels, variables and codes such as "
            f"01067, got {', '.join(objectives) or 'none'}",
            f"to rank by one alone, or by such columns, name them by {argument('objectives')}",
        )
    claims = {  # the first that has a column decides
        OBJECTIVE: known_names("objectives", objectives, columns),
        VARIABLE: known_names("variables", variables or _of_role(numbered, VARIABLE), columns),
        OUTPUT: formulation.columns,  # it is computed with, or limited
        LABEL: labels,
        INEQUALITY: _of_role(numbered, INEQUALITY),
        EQUALITY: _of_role(numbered, EQUALITY),
    }
    taken = {}
    for name in (*objectives, *columns):
        taken[name] = next((claim for claim, names in claims.items() if name in names), "")
    return taken


def _numbered(columns: Mapping[str, TextColumn]) -> dict[str, str]:
    """Return the roles of columns such as f1, x1 and g1, if they number objectives and variables.

    They do beside x1, if no other columns hold numbers, or as f1, f2, … without gaps: F1 and
    f2 [Hz] beside cost and mass may be a force and a frequency. Without f1, none is an objective by
    its name.
    """
    roles = {}
    firsts = set()
    are_all = True
    for name, column in columns.items():
        match = _NUMBERED.fullmatch(name)
        if match is not None:
            letter = match["letter"].lower()
            roles[name] = _ROLES[letter]
            if match["number"] == "1":
                firsts.add(letter)
        elif column.may_hold_numbers():
            are_all = False
    plain = {name for name in columns if re.fullmatch(r"f\d+", name)}
    is_series = len(plain) > 1 and plain == {f"f{j + 1}" for j in range(len(plain))}
    if "f" in firsts and ("x" in firsts or are_all or is_series):
        return roles
    if "x" in firsts:
        return {name: role for name, role in roles.items() if role != OBJECTIVE}
    return {}


def _of_role(roles: Mapping[str, str], role: str) -> list[str]:
    """Return the columns with a role."""
    return [name for name in roles if roles[name] == role]


def _role(column: TextColumn, claim: str) -> str:
    """Return the role of a column, by what it is taken for and what it holds.

    A label is a note until the table has it; a constraint is an output, as a file does not say that
    it is one.
    """
    if claim in (OBJECTIVE, OUTPUT):
        return claim
    if claim == VARIABLE and not column.problem and not column.gaps().any():
        return VARIABLE
    if claim == LABEL or column.numbers is None:
        return NOTE
    return OUTPUT


def _mismatches(
    cells: Cells,
    columns: Mapping[str, TextColumn],
    claims: Mapping[str, str],
    roles: Mapping[str, str],
) -> Iterator[str]:
    """Yield why columns are no variables or constraints, as which they are named.

    Args:
        cells: All cells.
        columns: The columns.
        claims: What they are taken for by :func:`_claims`.
        roles: What they are.
    """
    for name, claim in claims.items():
        column = columns[name]
        if claim == VARIABLE and roles[name] != VARIABLE:
            problem = column.problem or cells.place(name, int(column.gaps().argmax()))
            yield f"{name} is no variable: {problem}."
        elif claim in _MET and roles[name] == OUTPUT:
            limit = _MET[claim]
            n_beyond = int((limit.excess(name, column.require_numbers()) > 0).sum())
            if n_beyond:
                yield (
                    f"{name} is no constraint; {counted(n_beyond, 'design')} would violate one. If "
                    f"it is one, say --limits {quote(limit.written(name))}, or limits= in Python."
                )


def _guesses(
    cells: Cells,
    columns: Mapping[str, TextColumn],
    claims: Mapping[str, str],
    maximize: Collection[str],
) -> Iterator[str]:
    """Yield what a reader must check where neither user nor source names the objectives.

    Args:
        cells: All cells.
        columns: The columns.
        claims: What they are taken for by :func:`_claims`.
        maximize: What is to be maximised.
    """
    name, *_ = claims
    first = columns[name].require_numbers()
    if len(first) > 2 and first[0].is_integer() and _count_on(first):
        yield (
            f"{name}, taken as an objective, counts the rows; if it only numbers designs, name the "
            "objectives."
        )
    unranked = []
    for name, claim in claims.items():
        column = columns[name]
        if claim == OBJECTIVE and name not in maximize and _UPWARD.search(name):
            option = f"--maximize {quote(entry_of(name))}, or maximize= in Python"
            yield f"{name} is minimised unless you say {option}."
        elif claim == LABEL:
            if _holds_more(column, cells):
                unranked.append(name)
        elif claim == "" or (claim in _MET and column.numbers is None):
            if column.may_hold_numbers():
                unranked.append(name)
            elif column.holds_times():
                yield f"{name} holds times; to rank by it, write them as numbers."
    if unranked:
        yield f"Not ranked: {_listed_few(unranked)}; to rank by others, name the objectives."


def _listed_few(names: list[str]) -> str:
    """Return names as a sentence lists them, and how many others there are beside a few."""
    n_others = len(names) - _FEW
    return listed([*names[:_FEW], f"{n_others} more"] if n_others > 0 else names)


def _holds_more(column: TextColumn, cells: Cells) -> bool:
    """Whether a column that names or numbers designs may hold what a reader ranks."""
    numbers = column.numbers
    if _word(column.name) not in _LABELS:
        return column.codes is not None
    if numbers is None:
        return False
    if column.name == next(iter(cells.columns)) or _word(column.name) in _IDS:
        names = numbers.tolist()
        return len({*names}) < len(names) or not all(map(float.is_integer, names))
    return not (numbers[0] in (0, 1) and _count_on(numbers))  # as rows are numbered


# From columns to a table


def _table(
    cells: Cells,
    head: Head,
    formulation: Formulation,
    variables: Names | None,
) -> TestTable:
    """Return the table of designs; the columns that a formulation needs must be readable."""
    decision, stated_variables = stated_by_designs(head)
    stated = decision.formulation
    directed = {*formulation.objectives, *formulation.maximize}
    columns, label, labels = _labelled(cells, head, directed)
    require_designs(columns, labels, label, cells)
    named = formulation.objectives or stated.objectives
    for name in stated.objectives:
        if name not in columns and not formulation.objectives:
            raise UnfitError(
                f"it has no column {name!r}, an objective by its description",
                f"restore this name, or name the objectives by {argument('objectives')}",
            )
    variables = tuple(name_list("variables", variables or stated_variables))
    claims = _claims(columns, formulation, named, variables, labels)
    roles = {name: _role(columns[name], claim) for name, claim in claims.items()}
    maximize = {*stated.maximize, *formulation.maximize}
    remarks = [*cells.remarks, *_mismatches(cells, columns, claims, roles)]
    if not named:
        remarks += _guesses(cells, columns, claims, maximize)
    numbers = np.array(cells.rows)
    if roles.get(TEST) == NOTE:
        del roles[TEST]
        numbers = np.array(_integers(columns[TEST].cells))  # none if one is no integer
        if len({*numbers.tolist()}) < len(cells.rows) or numbers.min() < 1:
            raise UnfitError(f"its column {TEST} must number the designs from 1; rename it")
    data = {name: _values(columns[name], role) for name, role in roles.items()}
    of_cells = {name: column.unit for name, column in columns.items() if column.unit}
    units = {**formulation.units, **of_cells, **stated.units}
    ranges = stated.with_objectives(_of_role(claims, OBJECTIVE)).ranges
    asked = Formulation(limits=stated.limits, normalize=stated.normalize, ranges=ranges or None)
    marks = {column.decimal for column in columns.values()}
    table = TestTable(
        _schema(data, roles, units, maximize),
        data,
        numbers,
        decision=replace(decision, formulation=asked),
        decimal=max(marks, key=".,".index),
        separator=head.get("separator", ",").replace(" ", ","),
        remarks=tuple(remarks),
    )
    if label == TEST:
        return table
    if label in table.schema.notes:
        return table.with_notes({}, label)
    return _named_by_rows(table, cells.rows)


def _schema(
    data: Columns, roles: Mapping[str, str], units: Entries, maximize: Collection[str]
) -> Schema:
    """Return what the columns of a table are; a text has its unit in it."""
    columns = []
    for name, cells in data.items():
        column = Column(name, roles[name], Kind.CHOICE)
        if column.role != NOTE:
            is_maximized = name in maximize and column.role != VARIABLE
            kind = kind_of_cells(cells)
            column = Column(name, column.role, kind, units.get(name, ""), is_maximized)
        columns.append(column)
    return Schema(tuple(columns))


def _values(column: TextColumn, role: str) -> AnyArray:
    """``(n,)`` the values of a column: numbers, booleans, texts without blanks around them.

    Raises:
        ArgumentValueError: An objective or output is not of numbers.
    """
    if role in (OBJECTIVE, OUTPUT) or (role == VARIABLE and column.codes is not None):
        return column.require_numbers()
    integers = _integers(column.cells)
    if role == NOTE:
        cells: list[Any] = []
        for cell in column.cells:
            # A time stamp is a text.
            is_plain = cell is None or isinstance(cell, (int, float))
            cells.append(cell if is_plain else str(cell).strip())
        return np.fromiter(integers or cells, object)
    if integers:
        return np.array(integers, dtype=np.int64)
    if column.numbers is not None:
        return column.numbers
    if {*column.texts} <= {"True", "False"}:
        return np.isin(column.texts, "True")
    return np.fromiter(column.texts, object)


def _failures(table: TestTable) -> list[str]:
    """Return remarks on columns with words for a failure, with the limits that leave them out."""
    remarks = []
    for name in table.schema.of_role(NOTE):
        counts = Counter(texts_of(table[name]).tolist())
        words = list(filter(_FAILURE.fullmatch, counts))
        if name in table.limits or not words:
            continue
        failed = counted(sum(counts.pop(word) for word in words), "design")
        # An entry of a list may be empty, but not the first.
        others = sorted(counts, key=bool, reverse=True)
        remedy = "check whether they count"
        if 1 <= len(others) <= _FEW:
            limit = quote(Limit(texts=tuple(others)).written(name))
            remedy = f"to leave them out, say --limits {limit}, or limits= in Python"
        remarks.append(f"{failed} with {_listed_few(words)} as {name}; {remedy}.")
    return remarks


def _incomplete(cells: Cells, table: TestTable, formulation: Formulation, drop: bool) -> list[str]:
    """Refuse designs that are asked for and lack a finite objective, or return a remark on them."""
    objectives = table.schema.objectives
    lacking = ~np.isfinite([table.data[name] for name in objectives])
    for name, limit in formulation.combine_first(table.formulation).allowed.items():
        if name in table.data:
            excess = limit.excess(name, table.data[name])
            lacking &= (excess == 0) | np.isinf(excess)  # an unknown value is not beyond a limit
    rows = np.flatnonzero(lacking.any(axis=0)).tolist()
    if not rows:
        return []
    if not drop:
        name = objectives[lacking[:, rows[0]].argmax()]
        raise UnfitError(
            cells.place(name, rows[0]),
            f"leave out such designs by {argument('drop_incomplete', True)}",
        )
    n = counted(len(rows), "incomplete design")
    return [f"{n} left out, the first in {cells.where(rows[0])}."]


def _integers(cells: Sequence[Any]) -> list[int]:
    """Return cells as integers; nothing if one is no integer."""
    texts = [str(cell).strip() for cell in cells]
    if not all(map(_INTEGER.fullmatch, texts)):
        return []
    return list(map(int, texts))
