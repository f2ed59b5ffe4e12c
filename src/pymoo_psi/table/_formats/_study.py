"""Studies: SQLite databases of tests, which runs continue."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._validation import FilePath
from pymoo_psi.table._formats._format import FileFormat, SourceFile
from pymoo_psi.table._formulation import limits_of
from pymoo_psi.table._head import (
    Columns,
    StoredTests,
    choice_texts,
    columns_of,
    head_of,
    lacking,
)
from pymoo_psi.table._layout import GROUPS, POINT, RUN

if TYPE_CHECKING:
    from pymoo_psi.study import Facts

# SQLite is imported where there is a study: most tables come without one.


class StudyFile(FileFormat):
    """A study as runs write it; see :mod:`pymoo_psi.study`."""

    suffix = ".db"
    writes = ("tests",)

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether a file is a database of SQLite."""
        return file.start.startswith(b"SQLite format 3\0")

    def read(self, file: SourceFile) -> StoredTests:
        """Return the tests of a study; SQLite opens it by name, so it cannot be a pipe."""
        from pymoo_psi.study import Study

        return stored_tests(*Study(file.path).contents())

    def save_tests(self, path: FilePath, table: Any) -> None:
        """Write a table as a new study, whole or not at all; extra columns are left out.

        Tests are written as they were before any limits, so that a run can continue the study.

        Raises:
            StudyAccessError: The file exists already, or cannot be written.
        """
        from pymoo_psi.study import write_study

        layout = replace(table.layout, label=None)
        tests = table.under(limits={})._with(layout=layout, extra={})
        head = head_of(tests)
        head.pop("chosen", None)
        limits = {}
        for name, limit in limits_of(table.formulation.limits).items():
            if name in table.layout.columns:
                limits[name] = limit
        if limits:
            head["limits"] = limits
        columns = columns_of(tests)
        if RUN in table.extra:
            for name in (RUN, POINT):
                columns[name] = table.extra[name].astype(np.int64)
        write_study(path, head, columns)

    def is_ours(self, path: Path) -> bool:
        """Return True: :meth:`save_tests` refuses every file that is there, and says so."""
        return True


def tests_of_folder(path: Path) -> StoredTests:
    """Return the tests of all studies in a folder; a remark says which test points are missing.

    Raises:
        StudyMismatchError: The studies belong to different problems.
        StudyError: One of them is damaged, or there is none.
    """
    from pymoo_psi.study import read_folder

    facts, columns, missing = read_folder(path)
    tests = stored_tests(facts, columns)
    if missing:
        return tests._replace(remarks=(f"{missing}.", *tests.remarks))
    return tests


def stored_tests(facts: Facts, columns: Columns) -> StoredTests:
    """Return tests of a study, whose limits are not part of their status.

    Args:
        facts: What is known of the study.
        columns: Its tests.
    """
    head = dict(facts.head)
    runs = facts.runs
    limits = head.pop("limits", {})
    problem = dict(head.get("problem") or {})
    if len(runs) == 1 and runs[0].number == 1:
        sampling = runs[0].points.get("sampling")
        if sampling is not None:
            problem["sampling"] = sampling
    else:
        head["extra"] = [POINT]
        if all(RUN not in head.get(group, ()) for group in GROUPS):
            head["extra"] = [RUN, POINT]
        columns = {**columns}
        for name in head["extra"]:
            columns[name] = choice_texts(columns[name].tolist())
        problem["runs"] = {str(run.number): dict(run.points) for run in runs}
        for side, end in (("lower", np.fmin), ("upper", np.fmax)):
            bounds = [np.array(run.points[side], dtype=np.float64) for run in runs]
            head[side] = end.reduce(bounds).tolist()
    head["problem"] = problem or None
    steered = [f"Steered {request}." for request in facts.steering]
    remarks = (*lacking(columns, (*head["objectives"], *limits)), *steered)
    return StoredTests(head, columns, remarks, limits, is_derived=True)
