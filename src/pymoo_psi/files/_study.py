"""Studies as files of tests; see :mod:`pymoo_psi.study`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi._validation import AnyArray, Columns, FilePath, Names, counted
from pymoo_psi.files._format import FileFormat, SourceFile
from pymoo_psi.files._tests import described, table_of
from pymoo_psi.table import POINT, RUN, TestTable, choice_texts, columns_of, head_of


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
        with described(file.path):
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
    table = without_rejected(table, columns["status"])
    steered = [f"Steered {request}." for request in facts.requests]
    needed = (*table.schema.objectives, *table.formulation.allowed)
    return replace(table, facts=(*lacking(columns, needed), *steered))


def without_rejected(table: TestTable, status: AnyArray) -> TestTable:
    """Return tests without designs that never ran, for requirements that do not hold any more.

    Args:
        table: The tests.
        status: ``(n,)`` their status as stored.
    """
    is_rejected = status != "failed"
    for name in (*table.schema.objectives, *table.schema.outputs):
        is_rejected &= ~np.isfinite(table.column(name))
    if is_rejected.any():
        return table.take(~(is_rejected & table.under(limits={}).failed()))
    return table


def lacking(columns: Columns, names: Names) -> tuple[str, ...]:
    """Return a remark on tests of a study that are older than an output and lack its values.

    Args:
        columns: The columns of the tests.
        names: The objectives, and the columns that have limits.
    """
    was_ok = columns["status"] == "ok"
    unknown = np.full(len(was_ok), np.nan)
    counts = []
    for name in names:
        cells = columns.get(name, unknown)[was_ok]
        n_unknown = int((cells != cells).sum())  # NaN
        if n_unknown:
            counts.append(f"{name} in {counted(n_unknown, 'test')}")
    if not counts:
        return ()
    return (
        f"Values are missing, {' and '.join(counts)}: the model did not return them then; "
        "--retry incomplete runs these tests again.",
    )


def tests_of_folder(path: Path) -> TestTable:
    """Return the tests of all studies in a folder; a remark says which test points are missing.

    Raises:
        StudyMismatchError: The studies belong to different problems.
        StudyError: One of them is damaged, or there is none.
    """
    from pymoo_psi.study import read_folder

    facts, columns, missing = read_folder(path)
    with described(path):
        tests = stored_tests(facts, columns)
    if missing:
        return replace(tests, facts=(f"{missing}.", *tests.facts))
    return tests
