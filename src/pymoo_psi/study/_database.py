"""A study in a transaction: its tables in SQL, and what is read and changed in them.

Studies are made by :func:`create`, in a file, or :func:`new_database`, in memory; :func:`opened`
makes sure that a file is one. All three give a :class:`Database`: runs, proposals, the head, tests.
Whoever changes its facts or runs calls :meth:`Database.save` before the commit.
"""

from __future__ import annotations

import json
import os
import platform
import sqlite3
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import closing
from typing import Any, NamedTuple

import numpy as np

from pymoo_psi._kinds import DTYPES, Kind, design_key
from pymoo_psi._output import whole_file
from pymoo_psi._validation import (
    Columns,
    Head,
    Integers,
    Mask,
    Received,
    Values,
    invalid,
)
from pymoo_psi.errors import StudyCorruptError
from pymoo_psi.study._facts import (
    ALL,
    NOT_VALUES,
    NUMBERS,
    ROOM,
    Facts,
    Renaming,
    Share,
    StudyRun,
    columns_of_head,
    new_run,
    now,
    require_other_names,
    with_outputs,
)
from pymoo_psi.study._integrity import intact, of_others, reported, require_no_trigger, unreadable

LAST = 2**63 - 1  # the largest number of a test

_APPLICATION = 0x50534931
_VERSION = 1
_SCHEMA = f"""
PRAGMA application_id = {_APPLICATION};
PRAGMA user_version = {_VERSION};
CREATE TABLE study (name TEXT PRIMARY KEY, value TEXT);
CREATE TABLE runs (run INTEGER PRIMARY KEY, points TEXT, record TEXT, last INTEGER);
CREATE TABLE adopted
    (run INTEGER, test_point INTEGER, test INTEGER, PRIMARY KEY (run, test_point),
    UNIQUE (run, test)) WITHOUT ROWID;
CREATE TABLE proposals
    (run INTEGER, test_point INTEGER, round INTEGER, origin TEXT, content TEXT,
    PRIMARY KEY (run, test_point)) WITHOUT ROWID;
CREATE TABLE history (time TEXT, test INTEGER, content TEXT);
CREATE TABLE tests
    (test INTEGER PRIMARY KEY, run INTEGER, test_point INTEGER, status TEXT, reason TEXT,
    origin TEXT, seconds REAL);
"""
_TABLES = ("study", "runs", "adopted", "proposals", "history", "tests")
_TYPES = {Kind.INTEGER: "INTEGER", Kind.BINARY: "INTEGER", Kind.CHOICE: "TEXT"}
_AT_A_TIME = 65_536  # rows that are in memory as Python objects at the same time


class Proposal(NamedTuple):
    """A design that is going to be tested.

    Attributes:
        test_point: Its test point in the run.
        round: The round in which it was proposed.
        origin: The algorithm that proposed it.
        content: The design, and what else the algorithm keeps.
    """

    test_point: int
    round: int
    origin: str
    content: Values


def create(path: str, facts: Facts, columns: Columns | None = None) -> None:
    """Make a study file, with the tests of its runs, whole or not at all."""
    with (
        reported(path, OSError),
        whole_file(path) as new,
        closing(sqlite3.connect(new, isolation_level=None)) as db,
    ):
        # Without a journal, as the file is thrown away if anything happens.
        database = new_database(db, path, facts)
        if columns is not None:
            database.insert(columns)
        database.save()
        db.execute("COMMIT")


def new_database(db: sqlite3.Connection, path: str, facts: Facts) -> Database:
    """Return a new study in an empty database, in a transaction."""
    db.executescript(f"PRAGMA journal_mode = OFF; BEGIN; {_SCHEMA}")
    return Database(db, path, facts)


def opened(db: sqlite3.Connection, path: str) -> Database:
    """Return a study after making sure that the file is one; it may hold further tables."""
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application == _APPLICATION and version != _VERSION:
        raise StudyCorruptError(
            f"study {path} has format {version}, but this version of pymoo-psi reads format "
            f"{_VERSION}; use the version that made it, or export it as CSV with that one"
        )
    query = (
        "SELECT name FROM sqlite_master WHERE type = 'table' "
        "AND name NOT LIKE 'sqlite!_%' ESCAPE '!'"
    )
    tables = [name for (name,) in db.execute(query)]
    if application != _APPLICATION and tables:
        raise of_others(path, tables)
    missing = [name for name in _TABLES if name not in tables]
    if missing:
        raise unreadable(path, f"it lacks the table {missing[0]}")
    require_no_trigger(db, path)
    rows = db.execute("SELECT name, value FROM study").fetchall()
    rows_of_runs = db.execute("SELECT run, points, record, last FROM runs ORDER BY run").fetchall()
    facts = Facts(**{name: json.loads(text) for name, text in rows})
    for number, identity, record, last in rows_of_runs:
        facts.runs.append(StudyRun(number, json.loads(identity), json.loads(record), last))
    return Database(db, path, facts, {*rows, *rows_of_runs})


class Database:
    """A study in a transaction.

    Args:
        db: The connection.
        path: The file.
        facts: What is known of the study as a whole; changes keep it up to date.
        saved: The rows of the tables ``study`` and ``runs``; none of a new study.
    """

    def __init__(
        self, db: sqlite3.Connection, path: str, facts: Facts, saved: Collection[Any] = ()
    ) -> None:
        self.db = db
        self.facts = facts
        self._path = path
        self._saved = saved
        if not saved:
            self._add_columns(())

    def save(self) -> None:
        """Write the facts and runs that have changed."""
        facts = dict(vars(self.facts))
        for run in facts.pop("runs"):
            self._write("runs", run.number, _text(run.identity), _text(run.record), run.last)
        for name, value in facts.items():
            self._write("study", name, _text(value))

    def _write(self, table: str, *row: Any) -> None:
        """Write a row, unless it is stored, in the place of one with its key."""
        if row not in self._saved:
            marks = ", ".join("?" * len(row))
            self.db.execute(f"INSERT OR REPLACE INTO {table} VALUES ({marks})", row)

    # Runs

    def add_run(self, identity: Head) -> StudyRun:
        """Begin a run; return it."""
        ends = [run.start + max(run.last, 1) for run in self.facts.runs]
        run = new_run(1 + -(-max(ends) // ROOM), identity)
        self.facts.runs.append(run)
        return run

    def n_left(self) -> int:
        """Return how many planned tests are not done."""
        share = Share(*self.facts.share or ALL)
        planned: set[int] = set()
        for run in self.facts.runs:
            for first, last in run.record.get("planned", ()):
                points = share.numbers(first, last)
                planned.update(self.numbers_of(run.number, points).tolist())
        return len(planned.difference(self.test_numbers().tolist()))

    def reserve(self, number: int, last: int) -> None:
        """Note that a run has test points up to ``last``.

        Raises:
            ArgumentValueError: The tests of another run have these numbers.
        """
        run = self.facts.run(number)
        for other in self.facts.runs:
            if run.start < other.start < run.start + last:
                most = other.start - run.start
                rule = f"at most {most} for run {number}, as run {other.number} follows"
                remedy = "export the tests and continue with that study"
                raise invalid("the number of test points", rule, last, remedy)
        run.last = max(run.last, last)

    def steer(self, request: Values) -> None:
        """Add a new request to the run at work, or replace one with its number and answer."""
        number = request.get("number", len(self.facts.steering) + 1)
        new = {"number": number, "time": now(), "run": 0, "answer": "waits for the run"}
        self.facts.steering[number - 1 : number] = [new | request]

    # Proposals

    def add_proposals(self, run: int, proposals: Sequence[Proposal]) -> None:
        """Write proposals of a run."""
        for *proposal, content in proposals:
            self._write("proposals", run, *proposal, _text(content))

    def proposals(self, run: int, first: int = 1, last: int = LAST) -> list[Proposal]:
        """Return the proposals of a run from test point ``first`` to ``last``."""
        query = (
            "SELECT test_point, round, origin, content FROM proposals "
            "WHERE run = ? AND test_point BETWEEN ? AND ? ORDER BY test_point"
        )
        proposals = []
        with intact(self.db, self._path):
            for point, number, origin, content in self.db.execute(query, (run, first, last)):
                proposals.append(Proposal(point, number, origin, json.loads(content)))
        return proposals

    def propose(self, run: int, proposals: Sequence[Proposal]) -> Sequence[Proposal]:
        """Write proposals, in the order of their test points, unless others have these.

        Returns:
            The proposals that are stored under the test points now.
        """
        stored = self.proposals(run, proposals[0][0], proposals[-1][0])
        if stored:
            return stored
        self.add_proposals(run, proposals)
        return proposals

    def discard(self, table: str, key: Mapping[str, int], test: int, why: str) -> None:
        """Move a row of ``tests`` or ``proposals`` to the history.

        Args:
            table: The table.
            key: Columns that identify the row, and their values.
            test: The number of the test.
            why: Why it is moved.
        """
        where = " AND ".join(f"{name} = :{name}" for name in key)
        cursor = self.db.execute(f"SELECT * FROM {table} WHERE {where}", key)
        names = [name for name, *_ in cursor.description]
        cells = dict(zip(names, cursor.fetchone(), strict=True))
        content = _text({"why": why, "cells": cells})
        self.db.execute("INSERT INTO history VALUES (?, ?, ?)", (now(), test, content))
        self.db.execute(f"DELETE FROM {table} WHERE {where}", key)
        self.db.execute("DELETE FROM adopted WHERE test = ?", (test,))
        self.facts.n_changes += 1

    # The head

    def replace_head(self, head: Head) -> None:
        """Replace the head of the study by that of a run; no test is lost.

        Stored columns that the new head lacks become outputs.
        """
        stored = self.facts.head
        renaming = Renaming.between(stored, head)
        present = [renaming.new_names.get(name, name) for name in columns_of_head(stored)]
        head = with_outputs(head, present)
        if head == stored:
            return
        self.facts.head = head
        self.facts.is_complete = False
        self._rename_columns(stored, renaming.new_names)
        self._add_columns(present)
        if renaming.turned:
            columns = self.tests()
            for name in renaming.turned:
                columns[name] = -columns[name]
            self.insert(columns)

    def _rename_columns(self, stored: Head, new_names: Mapping[str, str]) -> None:
        """Give columns of a stored head their names in the head; views and indices follow."""
        new_columns = _columns_of_values(self.facts.head)
        renamed = {}
        for name, (old, _) in _columns_of_values(stored).items():
            new, _ = new_columns[new_names.get(name, name)]
            if old != new:
                renamed[old] = new
        # By way of names that no column has, as two columns may change theirs for one another.
        for place, old in enumerate(renamed):
            self.db.execute(f'ALTER TABLE tests RENAME COLUMN {old} TO "pymoo-psi {place}"')
        for place, new in enumerate(renamed.values()):
            self.db.execute(f'ALTER TABLE tests RENAME COLUMN "pymoo-psi {place}" TO {new}')

    def widen(self, columns: Collection[str]) -> None:
        """Add the outputs that tests have to the columns of a study."""
        present = columns_of_head(self.facts.head)
        self.facts.head = with_outputs(self.facts.head, columns)
        self._add_columns(present)

    def _add_columns(self, present: Collection[str]) -> None:
        """Add the columns of the head that are not present."""
        require_other_names(self.facts.head)
        for name, (sql, kind) in _columns_of_values(self.facts.head).items():
            if name not in present:
                self.db.execute(f"ALTER TABLE tests ADD COLUMN {sql} {_TYPES.get(kind, '')}")

    # Tests

    def numbered(self, numbers: Integers) -> Columns:
        """Return the columns ``test``, ``run`` and ``test_point`` of the numbers of tests."""
        starts = np.array([run.start for run in self.facts.runs])
        rows = np.searchsorted(starts, numbers) - 1
        runs = np.array([run.number for run in self.facts.runs])
        return {"test": numbers, "run": runs[rows], "test_point": numbers - starts[rows]}

    def numbers_of(self, run: int, test_points: Integers) -> Integers:
        """Return the numbers of the tests of test points of a run."""
        start = self.facts.run(run).start
        rows = self.db.execute("SELECT test_point, test FROM adopted WHERE run = ?", (run,))
        adopted = dict(rows)
        numbers = [adopted.get(point, start + point) for point in test_points.tolist()]
        return np.array(numbers, dtype=np.int64)

    def adopt(self, run: int, columns: Columns) -> None:
        """Assign tests of other runs to test points of a run that have the same designs.

        Points with tests of their own keep these. Of points with the same design, the first gets
        the test, as a test has one number in the table of a run. Repeated tests are made for one
        run only, unless they are from elsewhere: the k-th repeats of designs get the k-th of these.
        In turn, tests of a noisy model from elsewhere get only tests with the same objectives.
        """
        repeats = {other.number: other.identity.get("repeat", 1) for other in self.facts.runs}
        repeat = repeats.pop(run)
        others = []
        for number, other_repeat in repeats.items():
            if repeat == 0 or other_repeat == 0 or repeat == other_repeat == 1:
                others.append(str(number))
        if not others:
            return
        head = self.facts.head
        compared = head["variables"]
        if repeat == 0:
            compared = compared + head["objectives"]
        stored_columns = _columns_of_values(head)
        quoted = []
        values = []
        for name in compared:
            sql, kind = stored_columns[name]
            quoted.append(sql)
            values.append(columns[name].astype(DTYPES[kind]).tolist())
        names = ", ".join(quoted)
        marks = ", ".join("?" * len(quoted))
        self.db.execute(f"CREATE INDEX IF NOT EXISTS tests_by_design ON tests ({names})")
        # In SQL, 0.0 is -0.0.
        self.db.create_function("design_key", -1, lambda *cells: design_key(cells))
        test_points = columns["test_point"]
        numbers = test_points + self.facts.run(run).start
        self.db.executemany(
            f"INSERT OR IGNORE INTO adopted SELECT {run}, ?, test FROM tests "
            f"WHERE ({names}) = ({marks}) AND design_key({names}) = design_key({marks}) "
            f"AND run IN ({', '.join(others)}) "
            "AND NOT EXISTS (SELECT 1 FROM tests WHERE test = ?) "
            f"ORDER BY test LIMIT 1 OFFSET {max(repeat - 1, 0)}",
            zip(test_points.tolist(), *values, *values, numbers.tolist(), strict=True),
        )

    def n_tests(self) -> dict[int, int]:
        """Return how many tests each run has, without those of other runs."""
        return dict(self.db.execute("SELECT run, count(*) FROM tests GROUP BY run"))

    def complete(self, completed: Callable[[Columns], Columns]) -> None:
        """Write values of stored tests that can be computed since the last change of the head.

        Args:
            completed: Returns columns with new values for the columns of all tests.
        """
        columns = self.tests()
        new = completed(columns)
        if new:
            self.widen(new)
            self.insert(columns | new)
            self.facts.n_changes += 1
        self.facts.is_complete = True

    def append(self, run: int, columns: Columns) -> int:
        """Write tests of a run; return how many are new or changed; see :meth:`Study.append`.

        Stored tests keep the run and the test point for which they were first made.
        """
        self.adopt(run, columns)
        self.reserve(run, int(columns["test_point"].max()))
        numbers = self.numbers_of(run, columns["test_point"])
        runs = np.full(len(numbers), run, dtype=np.int64)
        columns = columns | {"test": numbers, "run": runs}
        stored = self.tests(int(numbers.min()), int(numbers.max()))
        _, rows, stored_rows = np.intersect1d(numbers, stored["test"], return_indices=True)
        new = rows_of(columns, np.setdiff1d(np.arange(len(numbers)), rows))
        changed = self._changed(rows_of(stored, stored_rows), rows_of(columns, rows))
        n_changed = len(changed["test"])
        n_written = len(new["test"]) + n_changed
        if n_written:
            self.facts.process = [platform.node(), os.getpid()]
            self.facts.n_changes += n_changed
            self.widen(columns)
            self.insert(new)
            self.insert(changed)
        return n_written

    def _changed(self, stored: Columns, again: Columns) -> Columns:
        """Return what stored tests become by repetitions, without those that stay as they are.

        A failed test becomes its repetition, another one gets the values that it lacks. Repetitions
        of tests of other runs change nothing if they differ.

        Raises:
            ArgumentValueError: The repetition of a test that did not fail differs.
        """
        differ = differing(stored, again)
        is_redone = differ & (stored["status"] == "failed")
        is_wrong = differ & ~is_redone & (stored["run"] == again["run"])
        if is_wrong.any():
            first = int(is_wrong.argmax())
            test_point = f"test point {stored['test_point'][first]} of run {stored['run'][first]}"
            raise invalid(
                "block",
                "of new test points, repetitions of failed ones, or what is stored",
                Received(f"other values for {test_point}"),
                f"use another file if the model has changed; study {self._path} is as it was",
            )
        is_changed = is_redone.copy()
        changed = again | stored  # outputs that the model has lost stay
        for name in again.keys() - {*NUMBERS}:
            old = stored.get(name, np.full(len(differ), np.nan))
            new = again[name]
            is_taken = is_redone
            if name not in NOT_VALUES:  # NaN differs from itself
                is_taken = is_redone | (~differ & (old != old) & (new == new))
            changed[name] = np.where(is_taken, new, old)
            is_changed |= is_taken
        return rows_of(changed, is_changed)

    def insert(self, columns: Columns) -> None:
        """Write tests; the origin and seconds of stored ones stay unless ``columns`` has others."""
        n = len(columns["test"])
        cells = {name: columns[name] for name in NOT_VALUES if name in columns}
        cells["reason"] = np.where(columns["reason"] == "", np.array(None), columns["reason"])
        for name, (sql, kind) in _columns_of_values(self.facts.head).items():
            # NaN where these tests lack an output.
            cells[sql] = columns.get(name, np.full(n, np.nan)).astype(DTYPES[kind])
        marks = ", ".join("?" * len(cells))
        changes = ", ".join(f"{name} = excluded.{name}" for name in cells)
        statement = (
            f"INSERT INTO tests ({', '.join(cells)}) VALUES ({marks}) "
            f"ON CONFLICT (test) DO UPDATE SET {changes}"
        )
        for start in range(0, n, _AT_A_TIME):
            block = [column[start : start + _AT_A_TIME].tolist() for column in cells.values()]
            self.db.executemany(statement, zip(*block, strict=True))

    def tests(self, first: int = 1, last: int = LAST) -> Columns:
        """Return the tests with numbers from ``first`` to ``last``, in the order of their numbers.

        Raises:
            StudyCorruptError: A cell cannot be read.
        """
        ends = min(first, LAST), min(last, LAST)
        return self._selected("tests WHERE test BETWEEN ? AND ? ORDER BY test", ends)

    def tests_of_run(self, run: int, first: int, last: int) -> Columns:
        """Return the tests of test points ``first`` to ``last`` of a run, in their order."""
        points = self._points_of_run(run, first, last)
        source = f"({points}) AS points JOIN tests USING (test) ORDER BY points.point"
        return self._selected(source, (), "points.point")

    def _selected(
        self, source: str, arguments: Sequence[int], test_point: str = "test_point"
    ) -> Columns:
        """Return tests of a source in SQL; ``test_point`` is an expression for their points."""
        expressions = ["test", "run", test_point]
        kinds = [(name, DTYPES[Kind.INTEGER]) for name in NUMBERS]
        for name, (sql, kind) in _columns_of_values(self.facts.head).items():
            # With the table: SQLite takes a quoted name that is no column for a text.
            expressions.append(f"tests.{sql}")
            kinds.append((name, DTYPES[kind]))
        expressions += ["status", "coalesce(reason, '')"]
        kinds += [(name, DTYPES[Kind.CHOICE]) for name in ("status", "reason")]
        with intact(self.db, self._path):
            query = f"SELECT {', '.join(expressions)} FROM {source}"
            cells = np.fromiter(self.db.execute(query, arguments), kinds)
        return {name: np.ascontiguousarray(cells[name]) for name, _ in kinds}

    def test_numbers(self) -> Integers:
        """Return the numbers of the tests."""
        return self._integers("SELECT test FROM tests")

    def test_points(self, run: int, first: int, last: int = LAST) -> Integers:
        """Return the test points of a run from ``first`` to ``last`` with a test, increasing."""
        points = self._points_of_run(run, first, last)
        return self._integers(f"SELECT point FROM ({points}) AS points ORDER BY point")

    def _integers(self, query: str) -> Integers:
        """Return the integers of a column."""
        return np.fromiter((integer for (integer,) in self.db.execute(query)), np.int64)

    def _points_of_run(self, run: int, first: int, last: int) -> str:
        """Return a query for the ``point`` and ``test`` of a run: own tests, and those assigned."""
        start = self.facts.run(run).start
        ends = f"{start + first} AND {min(start + last, LAST)}"
        return (
            f"SELECT test, test - {start} AS point FROM tests "
            f"WHERE run = {run} AND test BETWEEN {ends} "
            "UNION ALL SELECT test, test_point FROM adopted "
            f"WHERE run = {run} AND test_point BETWEEN {first} AND {last}"
        )


def rows_of(columns: Columns, rows: Any) -> Columns:
    """Return some rows of columns."""
    return {name: column[rows] for name, column in columns.items()}


def differing(columns: Columns, others: Columns) -> Mask:
    """``(n,)`` which of n pairs of tests differ in a value that both have."""
    # Limits and requirements, which may change, say what is infeasible.
    has_failed = columns["status"] == "failed"
    other_failed = others["status"] == "failed"
    differ = has_failed != other_failed
    differ |= has_failed & other_failed & (columns["reason"] != others["reason"])
    for name in (columns.keys() & others.keys()).difference(NOT_VALUES):
        one = columns[name]
        other = others[name]
        differ |= (one != other) & (one == one) & (other == other)  # NaN differs from itself
    return np.asarray(differ)


def _columns_of_values(head: Head) -> dict[str, tuple[str, Kind]]:
    """Return the columns of a head by name: their quoted names in SQL, and their kinds."""
    kinds = dict(zip(head["variables"], map(Kind, head["kinds"]), strict=True))
    columns = {}
    taken = {*NOT_VALUES}
    for name in columns_of_head(head):
        column = name
        while column.lower() in taken:  # SQL takes "a" and "A" for one name
            column += "_"
        taken.add(column.lower())
        quoted = column.replace('"', '""')
        columns[name] = (f'"{quoted}"', kinds.get(name, Kind.REAL))
    return columns


def _text(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
