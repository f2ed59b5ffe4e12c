"""Tables of what files and studies hold: columns, and a head that says what they mean.

    table_of(head_of(table), columns_of(table)) is the table.

A file of designs has a shorter head, as not all of its columns are known: :func:`designs_head`. A
study has facts beside the head, and tests of several runs: :func:`stored_tests`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._validation import (
    AnyArray,
    Columns,
    Entries,
    FilePath,
    Head,
    Names,
    Values,
    counted,
)
from pymoo_psi.files._cells import SWAPPED, UnfitError
from pymoo_psi.files._format import FileFormat, SourceFile
from pymoo_psi.table import (
    DESIGNS_MARK,
    FORMAT,
    LABEL,
    MARK,
    NOTE,
    POINT,
    RUN,
    TEST,
    Decision,
    Formulation,
    Schema,
    TestTable,
    cells_of_kind,
    checked_numbers,
    choice_texts,
    choice_values,
    column_names,
    columns_of,
    decision_head,
    decision_of_head,
    head_of,
    kinds_of_columns,
    marks_of,
    names_of,
    result_columns,
    schema_of,
    units_of,
)

_TRUTHS = ("false", "true")
HEAD_REMEDY = "remove that description, and say --objectives and --maximize"


def table_of(head: Head, columns: Columns) -> TestTable:
    """Return the table of a head and columns.

    Args:
        head: As :func:`head_of` returns it.
        columns: As :func:`columns_of` returns them, in any order; further ones are not read. Only
            tests with the status "failed" have failed; others have the status that follows.

    Raises:
        KeyError: An entry or a column is missing.
        ArgumentValueError: They do not fit one another.
        ArgumentTypeError: As for ``ArgumentValueError``.
    """
    table = table_with(schema_of(head), columns)
    return replace(
        table,
        decision=decision_of_head(head),
        problem=head.get("problem"),
        decimal=head.get("decimal", "."),
        separator=head.get("separator", ","),
    )


def table_with(schema: Schema, columns: Columns) -> TestTable:
    """Return the table of a schema and columns, as :func:`table_of` does."""
    data: Columns = {}
    for column in schema.columns:
        cells = columns[column.name]
        if column.kind is Kind.CHOICE:
            cells = choice_values(cells)
        if column.role not in (LABEL, NOTE):
            cells = cells_of_kind(column.name, cells, column.kind)
        data[column.name] = cells
    results = result_columns(schema.names)
    numbers = checked_numbers(columns[TEST])
    has_failed = columns[results["status"]] == "failed"
    reasons = columns[results["reason"]][has_failed]
    table = TestTable(schema, data, numbers)
    failures = {}
    for number, reason in zip(numbers[has_failed].tolist(), reasons.tolist(), strict=True):
        # What follows from the values, without a limit, is no failure of the evaluation.
        if table.reasons.get(number) != reason:
            failures[number] = reason
    return replace(table, failures=failures)


@contextmanager
def described() -> Iterator[None]:
    """Turn errors of a source without a table into one that names the problem."""
    try:
        yield
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        problem = str(error)
        if isinstance(error, KeyError):
            problem = f"the column or entry {error} is missing"
        raise UnfitError(
            f"it must be a table of tests, of to_csv or 'pymoo-psi export': {problem}"
        ) from error


# The cells of a file, whose head is that of a table


def tests_of_cells(head: Head, cells: Entries) -> TestTable:
    """Return the tests in the cells of a file whose head is that of a table.

    Args:
        head: As :func:`marked` returns it.
        cells: Those of each column by its heading, texts or values.

    Raises:
        UnfitError: They are those of no table, or damaged.
    """
    with described():
        if head[MARK] != FORMAT:
            raise ValueError(f"its format is {head[MARK]!r:.20}, not {FORMAT}")
        # By name, not by place: people rearrange columns and add their own, which are not read.
        names = names_of([*cells], head.get("units", {}))
        cells_by_name = dict(zip(names, cells.values(), strict=True))
        columns = {}
        for name, kind in kinds_of_columns(schema_of(head)).items():
            try:
                columns[name] = _values(cells_by_name[name], kind, head.get("decimal", "."))
            except ValueError:
                rule = f"the column {name!r} holds other than {kind.value} values"
                raise ValueError(rule) from None
        return table_of(head, columns)


def _values(cells: Sequence[Any], kind: Kind, decimal: str) -> AnyArray:
    """Return the values of a column of a kind."""
    texts = ["" if cell is None else str(cell) for cell in cells]
    if kind is Kind.CHOICE:
        return np.fromiter(texts, object)
    if kind is Kind.BINARY:
        return np.array([_TRUTHS.index(text.lower()) for text in texts], dtype=bool)
    number: Any = int if kind is Kind.INTEGER else float
    values = []
    for cell, text in zip(cells, texts, strict=True):
        if decimal == "," and isinstance(cell, str):
            text = text.translate(SWAPPED)  # somebody's 1.250 is not 1.25
        values.append(number(text or "nan"))
    return np.array(values, DTYPES[kind])


# The head of a file of designs, whose columns are not all known


def designs_head(designs: TestTable, columns: Collection[str]) -> Values:
    """Return the head of a file of designs, with which :func:`read_table` reads what was written.

    Args:
        designs: The designs of the file.
        columns: Names of all columns of the file.
    """
    schema = designs.schema
    head = decision_head(designs.decision)
    head.pop("limits", None)  # the designs keep them
    return {
        DESIGNS_MARK: 1,
        "objectives": schema.objectives,
        "maximized": schema.maximize,
        "variables": schema.variables,
        "units": units_of(columns, schema.units),
        **head,
        **marks_of(designs),
    }


def stated_by_designs(head: Head) -> tuple[Decision, Names]:
    """Return the decision on designs and the names of their variables, as their head says.

    Raises:
        UnfitError: The head is damaged.
    """
    try:
        decision = decision_of_head(head)
        formulation = replace(
            decision.formulation,
            objectives=head.get("objectives", ()),
            maximize=head.get("maximized", ()),
            units=head.get("units", {}),
        )
        variables = column_names("variables", head.get("variables", ()))
        return replace(decision, formulation=formulation), variables
    except (TypeError, AttributeError, ValueError):
        raise UnfitError(
            "what it says of its columns is damaged or of a later version", HEAD_REMEDY
        ) from None


class StudyFile(FileFormat):
    """A study as runs write it; see :mod:`pymoo_psi.study`."""

    suffix = ".db"
    writes = ("tests",)

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether a file is a database of SQLite."""
        return file.start.startswith(b"SQLite format 3\0")

    def read(self, file: SourceFile) -> TestTable:
        """Return the tests of a study; SQLite opens it by name, so it cannot be a pipe."""
        from pymoo_psi.study import Study

        facts, columns = Study(file.path).contents()
        with described():
            return stored_tests(facts, columns)

    def save_tests(self, path: FilePath, table: TestTable) -> None:
        """Write a table as a new study, whole or not at all, so that a run can continue it.

        Raises:
            StudyAccessError: The file exists already, or cannot be written.
        """
        from pymoo_psi.study import NOT_VALUES, write_study

        notes = {*table.schema.notes} & {*NOT_VALUES}
        kept = replace(table, evaluated=table.evaluated.without(notes))
        # Limits are asked of the tests; what is stored are the tests.
        columns = columns_of(kept.under(limits={})) | {POINT: table.numbers}
        if "runs" in (table.problem or {}):
            for name in (RUN, POINT):
                columns[name] = table[name].astype(np.int64)
        write_study(path, head_of(kept), columns)

    def is_ours(self, path: Path) -> bool:
        """Return True: :meth:`save_tests` refuses every file that is there, and says so."""
        return True


def stored_tests(facts: Any, columns: Columns) -> TestTable:
    """Return tests of a study under its limits.

    Args:
        facts: What is known of the study.
        columns: Its tests.
    """
    head = dict(facts.head)
    problem = dict(head.get("problem") or {})
    runs = {run.number: run.identity for run in facts.runs}
    if [*runs] == [1]:
        sampling = runs[1].get("sampling")
        if sampling is not None:
            problem["sampling"] = sampling
    else:
        problem["runs"] = {str(number): dict(identity) for number, identity in runs.items()}
        head["notes"] = [*head.get("notes", ())]
        for name in (RUN, POINT):
            if name not in head["notes"]:
                head["notes"].append(name)
                columns = columns | {name: choice_texts(columns[name])}
    table = table_of({**head, "problem": problem or None}, columns)
    table = with_remark_on_lacks(table, columns, table.formulation)
    steered = [f"Steered {request}." for request in facts.requests]
    return replace(table, remarks=(*table.remarks, *steered))


def with_remark_on_lacks(table: TestTable, columns: Columns, formulation: Formulation) -> TestTable:
    """Return tests of a study with a remark if some are older than an output and lack its values.

    Args:
        table: The tests.
        columns: Their columns in the study.
        formulation: What is asked of them; objectives, and columns that have limits, are needed.
    """
    was_ok = columns["status"] == "ok"
    unknown = np.full(len(was_ok), np.nan)
    counts = []
    for name in (*table.schema.objectives, *formulation.allowed):
        cells = columns.get(name, unknown)[was_ok]
        n_unknown = int((cells != cells).sum())  # NaN
        if n_unknown:
            counts.append(f"{name} in {counted(n_unknown, 'test')}")
    if not counts:
        return table
    remark = (
        f"Values are missing, {' and '.join(counts)}: the model did not return them then; "
        "--retry incomplete runs these tests again."
    )
    return replace(table, remarks=(remark,))


def tests_of_folder(path: Path) -> TestTable:
    """Return the tests of all studies in a folder; a remark says which test points are missing.

    Raises:
        StudyMismatchError: The studies belong to different problems.
        StudyError: One of them is damaged, or there is none.
    """
    from pymoo_psi.study import read_folder

    facts, columns, missing = read_folder(path)
    with described():
        tests = stored_tests(facts, columns)
    if missing:
        return replace(tests, remarks=(f"{missing}.", *tests.remarks))
    return tests
