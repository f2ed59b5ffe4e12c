"""Studies that are written at once, and the files of a folder that are read as one study."""

from __future__ import annotations

import json
import os
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np

from pymoo_psi._validation import (
    Columns,
    FilePath,
    Head,
    Integers,
    Received,
    identity_text,
    invalid,
)
from pymoo_psi.errors import ArgumentValueError, StudyAccessError, StudyMismatchError
from pymoo_psi.study._database import Database, created
from pymoo_psi.study._facts import Facts, Share, identity_of_run, require_fellow
from pymoo_psi.study._study import Study, studies_in

_AT_A_TIME = 65_536  # rows that are in memory as Python objects at the same time


def write_study(path: FilePath, head: Head, columns: Columns) -> None:
    """Write tests as a new study, whole or not at all; see :class:`Study` for head and columns.

    Args:
        path: The file.
        head: The head; its ``problem`` may say the ``sampling`` of its points, or the identities of
            several ``runs`` by their numbers.
        columns: The columns of :meth:`Study.append`; and, if there are several runs, the ``run``
            and the number of each ``test``.

    Raises:
        StudyAccessError: The file exists already, or cannot be written.
    """
    file = Study(path).path
    if os.path.lexists(file):
        raise StudyAccessError(
            f"study {file} exists already and was left as it is; give the name of a new file"
        )
    stored_head = json.loads(identity_text({"problem": None, **head}))
    problem = stored_head["problem"] or {}
    sampling = problem.pop("sampling", None)
    identities = problem.pop("runs", None) or {"1": identity_of_run(stored_head, sampling)}
    points = np.asarray(columns["test_point"], dtype=np.int64)
    columns = {"test": points, "run": np.ones_like(points)} | columns
    if len({*zip(columns["run"].tolist(), points.tolist(), strict=True)}) < len(points):
        rule = "different ones"
        raise invalid("the runs and test points of a study", rule, Received("some that recur"))
    with created(file, stored_head) as database:
        for number, identity in identities.items():
            run = int(number)
            database.add_run(identity, run)
            (rows,) = np.nonzero(columns["run"] == run)
            for start in range(0, len(rows), _AT_A_TIME):
                part = rows[start : start + _AT_A_TIME]
                tests = {name: column[part] for name, column in columns.items()}
                database.append(run, tests, 0)


def read_folder(path: FilePath) -> tuple[Facts, Columns, str]:
    """Return the tests of all studies in a folder as those of one; see :class:`Study`.

    Returns:
        The facts, the columns, and which test points are missing; empty if none are.

    Raises:
        StudyMismatchError: Two studies belong to different problems, or have different results for
            the same test point.
        StudyError: One of them is damaged, or there is none; the message names the file.
    """
    files = studies_in(Path(path).resolve())
    if not files:
        raise StudyAccessError(f"folder {os.fspath(path)} holds no study; check the name")
    first = Study(files[0]).facts()
    n_shares = 1
    points = []
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        joined = Database(db, os.fspath(path))
        joined.begin(first.head)
        joined.add_run(first.runs[0].identity)
        for file in files:
            with Study(file).reading() as database:
                facts = database.facts
                columns = database.tests()
                points.append(database.test_points(1, 1))
            require_fellow(file, facts, first, f"in {files[0]}")
            if facts.share is not None:
                n_shares = facts.share[1]
            try:
                joined.append(1, columns)
            except ArgumentValueError as error:
                raise StudyMismatchError(
                    f"study {file} and one before it in the folder have different results for test "
                    f"points; move the file that is wrong, or older, to another folder ({error})"
                ) from error
        first = first._replace(head=joined.facts.head)
        return first, joined.tests(), _missing(n_shares, np.unique(np.concatenate(points)))


def _missing(n_shares: int, points: Integers) -> str:
    """Say how many test points each share lacks between the first and the last stored one."""
    if n_shares == 1 or len(points) == 0:
        return ""
    first = int(points[0])
    last = int(points[-1])
    counts = []
    for part in range(1, n_shares + 1):
        share = Share(part, n_shares)
        n_missing = len(np.setdiff1d(share.numbers(first, last), points))
        if n_missing:
            counts.append(f"{n_missing} of share {share}")
    if not counts:
        return ""
    return f"Missing between test points {first} and {last}: {', '.join(counts)}"
