"""A study in a transaction: its tables, and what is read and changed in them."""

from __future__ import annotations

import getpass
import json
import os
import platform
import secrets
import sqlite3
import zlib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from datetime import datetime, timezone
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._output import whole_file
from pymoo_psi._validation import AnyArray, Integers, Mask, Received, Values, counted, invalid
from pymoo_psi.errors import StudyVersionError
from pymoo_psi.study._lock import intact, reported, unreadable
from pymoo_psi.study._runs import ROOM, Head, StudyRun, points_of, same_points

Columns: TypeAlias = dict[str, AnyArray]
Proposal: TypeAlias = tuple[int, int, str, dict[str, Any]]
"""The test point, the round in which it was proposed, the algorithm that proposed it, and what else
the algorithm keeps, including the design."""

LAST = 2**63 - 1  # the largest number of a test
LASTING = ("search", "more")  # what people ask of a run that holds when it is continued
ACTIONS = (*LASTING, "pause", "continue", "stop")

_APPLICATION = 0x50534931
_VERSION = 5  # 4 is that of pymoo-psi 0.3, 1 to 3 are those of 0.1 and 0.2
_OF_0_3 = 4  # without runs and checksums
_TESTS = """
CREATE TABLE tests
    (test INTEGER PRIMARY KEY, run INTEGER, test_point INTEGER, status TEXT, reason TEXT,
    origin TEXT, seconds REAL, design_checksum INTEGER, row_checksum INTEGER)"""
_SCHEMA = f"""
PRAGMA application_id = {_APPLICATION};
PRAGMA user_version = {_VERSION};
CREATE TABLE study (name TEXT PRIMARY KEY, value TEXT, checksum INTEGER);
CREATE TABLE runs
    (run INTEGER PRIMARY KEY, points TEXT, record TEXT, last INTEGER, checksum INTEGER);
CREATE TABLE known
    (run INTEGER, test_point INTEGER, test INTEGER, PRIMARY KEY (run, test_point)) WITHOUT ROWID;
CREATE TABLE proposals
    (run INTEGER, test_point INTEGER, round INTEGER, origin TEXT, content TEXT, checksum INTEGER,
    PRIMARY KEY (run, test_point)) WITHOUT ROWID;
CREATE TABLE history (time TEXT, test INTEGER, content TEXT);
{_TESTS}"""
_TABLES = {
    _VERSION: ("study", "runs", "known", "proposals", "history", "tests"),
    _OF_0_3: ("study", "proposals", "tests"),
}
ADDED = ("test", "run", "origin", "seconds")  # columns of a study that no table of a model has
_NUMBERS = ("test", "run", "test_point")
_NOT_VALUES = (*_NUMBERS, "status", "reason", "origin", "seconds")
_FIXED = (*_NOT_VALUES, "design_checksum", "row_checksum")
_FIXED_IN_0_3 = ("test_point", "status", "reason", "origin", "seconds")
_GROUPS = ("variables", "objectives", "inequalities", "equalities", "outputs")
_TYPES = {Kind.INTEGER: "INTEGER", Kind.BINARY: "INTEGER", Kind.CHOICE: "TEXT"}
_AT_A_TIME = 65_536  # rows in memory as Python's objects

_Terms: TypeAlias = dict[str, tuple[str, Any]]
"""Expressions of SQL by the name of their column, and the dtype of its cells."""
_PROVENANCE: _Terms = {"origin": ("origin", np.object_), "seconds": ("seconds", np.float64)}


@dataclass
class Facts:
    """What is known of a study as a whole.

    Attributes:
        head: The columns and the formulation of the last run; see :meth:`Study.begin`.
        share: For a share of an investigation: its part and the number of parts.
        is_complete: Whether stored tests have all values that can be computed from others.
        n_changes: How often stored tests got other values, or were withdrawn.
        id: A random name.
        begun: When the file was made.
        process: The machine and the number of the last process that added tests.
        steering: Requests to runs, in the order of time. Each has its ``number``, ``time``, the
            ``name`` of the person, ``action``, one of ``ACTIONS``, its arguments, ``answer`` and
            ``run``, the run that has answered, or 0.
        runs: The runs.
    """

    head: Head
    share: Sequence[int] | None = None
    is_complete: bool = True
    n_changes: int = 0
    id: str = field(default_factory=lambda: secrets.token_hex(16))
    begun: str = field(default_factory=lambda: _now())
    process: Sequence[Any] = ("", 0)
    steering: list[Values] = field(default_factory=list)
    runs: list[StudyRun] = field(default_factory=list)

    @property
    def requests(self) -> list[str]:
        """The requests with their answers, each in a line."""
        return list(map("{time}, {name}: {action}: {answer}".format_map, self.steering))

    def run(self, number: int) -> StudyRun:
        """Return the run of a number."""
        for run in self.runs:
            if run.number == number:
                return run
        runs = ", ".join(str(run.number) for run in self.runs)
        raise invalid("run", f"one of the runs of the study, {runs}", number)

    def run_with(self, points: Head) -> StudyRun | None:
        """Return the run that has these points, or ``None``."""
        for run in self.runs:
            if same_points(run.points, points):
                return run
        return None


def _now() -> str:
    return datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")


def new_run(number: int, points: Head, last: int = 0) -> StudyRun:
    """Return a run that begins now, on this machine."""
    from pymoo_psi import __version__

    record = {
        "begun": _now(),
        "host": platform.node(),
        "user": getpass.getuser(),
        "pymoo-psi": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }
    return StudyRun(number, points, record, last)


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
        db.execute("COMMIT")


def new_database(db: sqlite3.Connection, path: str, facts: Facts) -> Database:
    """Return a new study in an empty database, in a transaction."""
    db.executescript(f"PRAGMA journal_mode = OFF; BEGIN; {_SCHEMA}")
    database = Database(db, path, facts)
    database.fill()
    return database


def is_of_0_3(db: sqlite3.Connection) -> bool:
    """Whether a database has the format of version 0.3."""
    return bool(db.execute("PRAGMA user_version").fetchone()[0] == _OF_0_3)


def opened(db: sqlite3.Connection, path: str) -> Database:
    """Return a study after making sure that the file is one, and nothing else.

    A study of version 0.3 becomes one of this version.
    """
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application == _APPLICATION and version not in _TABLES:
        raise StudyVersionError(
            f"study {path} has format {version}, but this version of pymoo-psi reads formats "
            f"{_OF_0_3} and {_VERSION}; continue it with the version that made it, or export it as "
            "CSV with that one"
        )
    # Other items, such as triggers, are refused: SQLite would run them by itself.
    query = (
        "SELECT name, type FROM sqlite_master WHERE name NOT LIKE 'sqlite!_%' ESCAPE '!' "
        "AND (name, type) <> ('designs', 'index')"
    )
    items = dict(db.execute(query))
    tables = dict.fromkeys(_TABLES.get(version, ()), "table")
    if application != _APPLICATION or items != tables:
        others = [f"the {kind} {name}" for name, kind in items.items() - tables.items()]
        raise unreadable(path, f"it holds {', '.join(others) or 'no tests'}")
    if version == _OF_0_3:
        return _converted(db, path)
    facts = Facts(**_stored_facts(_checked_rows(db, "study")))
    for number, points, record, last in _checked_rows(db, "runs ORDER BY run"):
        facts.runs.append(StudyRun(number, json.loads(points), json.loads(record), last))
    return Database(db, path, facts)


def _stored_facts(rows: Iterable[Sequence[Any]]) -> Values:
    return {name: json.loads(text) for name, text in rows}


def _checked_rows(
    db: sqlite3.Connection, source: str, arguments: Sequence[int] = ()
) -> list[tuple[Any, ...]]:
    """Return rows of a table after a comparison of their checksums."""
    rows = []
    for *row, checksum in db.execute(f"SELECT * FROM {source}", arguments):
        if text_checksum(tuple(row)) != checksum:
            table = source.partition(" ")[0]
            raise ValueError(f"a row of the table {table} was changed: {row[0]}")
        rows.append(tuple(row))
    return rows


def _converted(db: sqlite3.Connection, path: str) -> Database:
    """Return a study of version 0.3 as one of this version."""
    facts = Facts(**_stored_facts(db.execute("SELECT name, value FROM study")))
    terms = {"test": ("test_point", np.int64)} | _PROVENANCE
    terms |= _terms(_columns(facts.head, _FIXED_IN_0_3))
    columns = _read(db, terms, "tests")
    proposals = db.execute("SELECT test_point, round, origin, content FROM proposals").fetchall()
    for table in _TABLES[_OF_0_3]:
        db.execute(f"DROP TABLE {table}")
    for statement in _SCHEMA.split(";"):
        db.execute(statement)
    problem = facts.head.get("problem") or {}
    points = points_of(facts.head, problem.get("sampling")) | {"requirements": None}
    last = int(columns["test"].max(initial=0))
    facts.runs = [StudyRun(1, points, {"begun": facts.begun}, last)]
    database = Database(db, path, facts)
    database.fill()
    database.insert(columns | database.numbered(columns["test"]))
    for *proposal, content in proposals:
        database.add_proposals(1, [(*proposal, json.loads(content))])
    return database


class Database:
    """A study in a transaction.

    Args:
        db: The connection.
        path: The file.
        facts: What is known of the study as a whole; changes keep it up to date.
    """

    def __init__(self, db: sqlite3.Connection, path: str, facts: Facts) -> None:
        self.db = db
        self.facts = facts
        self._path = path

    # Facts and runs

    def fill(self) -> None:
        """Write the facts, runs and columns of a new study."""
        self._add_columns({})
        self.write_facts()
        for run in self.facts.runs:
            self._write_run(run)

    def write_facts(self) -> None:
        """Write the facts."""
        for name, value in vars(self.facts).items():
            if name != "runs":
                self._write("study", name, _text(value))

    def _write(self, table: str, *row: Any) -> None:
        """Write a row with its checksum; it takes the place of one with its key."""
        marks = "?, " * len(row)
        statement = f"INSERT OR REPLACE INTO {table} VALUES ({marks}?)"
        self.db.execute(statement, (*row, text_checksum(row)))

    def _write_run(self, run: StudyRun) -> None:
        self._write("runs", run.number, _text(run.points), _text(run.record), run.last)

    def add_run(self, points: Head) -> StudyRun:
        """Begin a run; return it."""
        ends = [run.start + max(run.last, 1) for run in self.facts.runs]
        run = new_run(1 + -(-max(ends) // ROOM), points)
        self._write_run(run)
        self.facts.runs.append(run)
        return run

    def change_run(self, number: int, **changes: Any) -> StudyRun:
        """Change what is known of a run; return it."""
        run = self.facts.run(number)
        changed = replace(run, **changes)
        self._write_run(changed)
        self.facts.runs[self.facts.runs.index(run)] = changed
        return changed

    def plan(self, number: int, last: int) -> StudyRun:
        """Note that a run is asked for test points up to ``last``; return it.

        Raises:
            ArgumentValueError: The tests of another run have these numbers.
        """
        run = self.facts.run(number)
        if last <= run.last:
            return run
        for other in self.facts.runs:
            if run.start < other.start < run.start + last:
                rule = f"at most {other.start - run.start} for run {number}, behind which are tests"
                remedy = "export the tests and continue with that study"
                raise invalid("the number of test points", rule, last, remedy)
        return self.change_run(number, last=last)

    def steer(self, request: Values) -> None:
        """Write a new request to the run at work, or one with its number and answer."""
        number = request.get("number", len(self.facts.steering) + 1)
        new = {"number": number, "time": _now(), "run": 0, "answer": "waits for the run"}
        self.facts.steering[number - 1 : number] = [new | request]
        self.write_facts()

    # Proposals

    def add_proposals(self, run: int, proposals: Sequence[Proposal]) -> None:
        """Write proposals of a run."""
        for *proposal, content in proposals:
            self._write("proposals", run, *proposal, _text(content))

    def proposals(self, run: int, first: int = 1, last: int = LAST) -> list[Proposal]:
        """Return the proposals of a run from test point ``first`` to ``last``."""
        source = "proposals WHERE run = ? AND test_point BETWEEN ? AND ? ORDER BY test_point"
        proposals = []
        with intact(self._path):
            rows = _checked_rows(self.db, source, (run, first, last))
            for _, test_point, proposed_in, origin, content in rows:
                proposals.append((test_point, proposed_in, origin, json.loads(content)))
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
        self.db.execute("INSERT INTO history VALUES (?, ?, ?)", (_now(), test, content))
        self.db.execute(f"DELETE FROM {table} WHERE {where}", key)
        self.db.execute("DELETE FROM known WHERE test = ?", (test,))
        self.facts.n_changes += 1
        self.write_facts()

    # The head

    def replace_head(self, head: Head) -> None:
        """Replace the head of the study by that of a run; no test is lost.

        Stored columns that the new head lacks become outputs.
        """
        if renames_columns(self.facts.head, head):
            columns = self._selected(_PROVENANCE, "tests ORDER BY test")
            columns = renamed_columns(columns, self.facts.head, head)
            names, _ = _changed_names(self.facts.head, head)
            renamed = {**self.facts.head}
            for group in ("objectives", "inequalities", "equalities"):
                renamed[group] = [names.get(name, name) for name in renamed[group]]
            self.facts.head = renamed
            self.db.execute("DROP TABLE tests")
            self.db.execute(_TESTS)
            self._add_columns({})
            self.insert(columns)
        if self._change_head(with_stored_columns(self.facts.head, head)):
            self.facts.is_complete = False
        self.write_facts()

    def widen(self, columns: Collection[str]) -> None:
        """Add the outputs that tests have to the columns of a study."""
        if self._change_head(with_outputs(self.facts.head, columns)):
            self.write_facts()

    def _change_head(self, head: Head) -> bool:
        """Change the head, if another is given, and add its columns; say whether it changed."""
        present = self.facts.head
        if head == present:
            return False
        self.facts.head = head
        self._add_columns(_columns(present))
        return True

    def _add_columns(self, present: Collection[str]) -> None:
        """Add the columns of the head that are not present."""
        require_other_names(self.facts.head)
        for name, (column, kind) in _columns(self.facts.head).items():
            if name not in present:
                self.db.execute(f"ALTER TABLE tests ADD COLUMN {column} {_TYPES.get(kind, '')}")

    # Tests

    def numbered(self, numbers: Integers) -> Columns:
        """Return the columns ``test``, ``run`` and ``test_point`` of the numbers of tests."""
        starts = np.array([run.start for run in self.facts.runs])
        rows = np.searchsorted(starts, numbers) - 1
        runs = np.array([run.number for run in self.facts.runs])
        return {"test": numbers, "run": runs[rows], "test_point": numbers - starts[rows]}

    def numbers_of(self, run: int, test_points: Integers) -> Integers:
        """Return the numbers of the tests of test points of a run."""
        numbers = np.asarray(test_points, dtype=np.int64) + self.facts.run(run).start
        known = dict(self.db.execute("SELECT test_point, test FROM known WHERE run = ?", (run,)))
        if known:
            pairs = zip(test_points.tolist(), numbers.tolist(), strict=True)
            numbers = np.array([known.get(point, own) for point, own in pairs], dtype=np.int64)
        return numbers

    def adopt(self, run: int, columns: Columns) -> None:
        """Assign tests of other runs to test points of a run that have the same designs.

        Points with tests of their own keep these. Repeated tests are made for one run only.
        """
        if len(self.facts.runs) == 1 or "repeat" in self.facts.run(run).points:
            return
        self.db.execute("CREATE INDEX IF NOT EXISTS designs ON tests (design_checksum)")
        designs = self._design_checksums(columns, len(columns["test_point"]))
        start = self.facts.run(run).start
        rows = []
        for point, design in zip(columns["test_point"].tolist(), designs.tolist(), strict=True):
            rows.append((run, point, design, start + point))
        self.db.executemany(
            "INSERT OR IGNORE INTO known SELECT ?1, ?2, min(test) FROM tests "
            "WHERE design_checksum = ?3 AND run <> ?1 "
            "AND NOT EXISTS (SELECT 1 FROM tests WHERE test = ?4) GROUP BY design_checksum",
            rows,
        )

    def _design_checksums(self, columns: Columns, n: int) -> Integers:
        """Return ``(n,)`` checksums of designs, which are equal where these are, bit for bit."""
        head = self.facts.head
        designs: Columns = {"": np.full(n, np.nan)}
        for name, kind in zip(head["variables"], map(Kind, head["kinds"]), strict=True):
            designs[name] = np.asarray(columns[name]).astype(DTYPES[kind])
        return checksums(designs)

    def remember(self, run: int, name: str, value: Any) -> Any:
        """Return an entry of the record of a run, which is this value if there is none yet."""
        record = self.facts.run(run).record
        if name in record:  # nothing is written
            return record[name]
        self.change_run(run, record={**record, name: value})
        return value

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
        self.write_facts()

    def append(self, run: int, columns: Columns) -> int:
        """Write tests of a run; return how many are new or changed; see :meth:`Study.append`."""
        self.adopt(run, columns)
        self.plan(run, int(columns["test_point"].max()))
        numbers = self.numbers_of(run, columns["test_point"])
        n = len(numbers)
        columns = columns | {"test": numbers, "run": np.full(n, run, dtype=np.int64)}
        columns = self._to_write(columns)
        n_written = len(columns["test"])
        if n_written:
            process = [platform.node(), os.getpid()]
            if self.facts.process != process:
                self.facts.process = process
                self.write_facts()
            self.widen(columns)
            self.insert(columns)
        return n_written

    def _to_write(self, columns: Columns) -> Columns:
        """Return the tests that are to be written, with all that the study knows of them.

        These are new ones, repetitions of failed ones, and stored ones that have more values now.
        Those that are stored keep the run and the test point for which they were first made.

        Raises:
            ArgumentValueError: A test of this run that did not fail would change.
        """
        numbers = columns["test"]
        stored = self.tests(int(numbers.min()), int(numbers.max()))
        _, rows, stored_rows = np.intersect1d(numbers, stored["test"], return_indices=True)
        if len(rows) == 0:
            return columns
        stored = rows_of(stored, stored_rows)
        given = rows_of(columns, rows)
        differs = differing(stored, given)
        is_replaced = differs & (stored["status"] == "failed")
        # What another run has tested meanwhile stays.
        is_wrong = differs & ~is_replaced & (stored["run"] == given["run"])
        if is_wrong.any():
            raise invalid(
                "block",
                "of new test points, repetitions of failed ones, or what is stored",
                Received(f"other values for test point {numbers[rows[is_wrong]][0]}"),
                f"use another file if the model has changed; study {self._path} is as it was",
            )
        is_written = np.full(len(numbers), True)
        is_written[rows] = is_replaced
        whole = dict(columns)
        for name in (columns.keys() | stored.keys()).difference(("origin", "seconds")):
            old = stored.get(name, np.full(len(rows), np.nan))
            new = columns.get(name, np.full(len(numbers), np.nan)).copy()
            # NaN, which differs from itself, is a value that is not known.
            is_taken = is_replaced | (~differs & (old != old) & (new[rows] == new[rows]))
            is_written[rows] |= is_taken
            new[rows] = np.where(is_taken, new[rows], old)
            whole[name] = new
        for name in ("run", "test_point"):
            whole[name] = whole[name].copy()
            whole[name][rows] = stored[name]
        if is_written[rows].any():
            self.facts.n_changes += 1
            self.write_facts()
        return rows_of(whole, is_written)

    def insert(self, columns: Columns) -> None:
        """Write tests; the origin and seconds of stored ones stay unless ``columns`` has others."""
        n = len(columns["test"])
        values = {}
        for name, (_, kind) in _columns(self.facts.head).items():
            # NaN where these tests lack an output.
            values[name] = columns.get(name, np.full(n, np.nan)).astype(DTYPES[kind])
        cells = {name: columns[name] for name in _NOT_VALUES if name in columns}
        cells["reason"] = np.where(columns["reason"] == "", np.array(None), columns["reason"])
        cells["design_checksum"] = self._design_checksums(values, n)
        kept = {name: columns[name] for name in (*_NUMBERS, "status", "reason")}
        cells["row_checksum"] = checksums(kept | values)
        for name, (column, _) in _columns(self.facts.head).items():
            cells[column] = values[name]
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
            StudyCorruptError: A row has another checksum.
        """
        ends = min(first, LAST), min(last, LAST)
        return self._selected({}, "tests WHERE test BETWEEN ? AND ? ORDER BY test", ends)

    def tests_of_run(self, run: int, first: int, last: int) -> Columns:
        """Return the tests of test points ``first`` to ``last`` of a run, in their order."""
        if len(self.facts.runs) == 1:
            start = self.facts.run(run).start
            return self.tests(start + first, start + last)
        points = self._points_of_run(run, first, last)
        source = f"({points}) AS points JOIN tests USING (test) ORDER BY point"
        columns = self._selected({"point": ("point", np.int64)}, source)
        columns["test_point"] = columns.pop("point")
        return columns

    def _selected(self, more: _Terms, source: str, arguments: Sequence[int] = ()) -> Columns:
        """Return tests of a source, after a comparison of their checksums."""
        # The number of a test says its run and test point, which are columns for other programs.
        checksum = f"row_checksum * (test = test_point + (run - 1) * {ROOM})"
        terms = {"": (checksum, np.int64), "test": ("test", np.int64)}
        terms |= _terms(_columns(self.facts.head)) | more
        with intact(self._path):
            columns = _read(self.db, terms, source, arguments)
            stored = columns.pop("")
            columns = self.numbered(columns["test"]) | columns
            kept = {name: column for name, column in columns.items() if name not in more}
            changed = columns["test"][stored != checksums(kept)]
        if len(changed):
            problem = f"{counted(len(changed), 'test')} changed, the first {changed[0]}"
            raise unreadable(self._path, problem)
        return columns

    def test_numbers(self) -> Integers:
        """Return the numbers of the tests."""
        # As one text: Python's objects for twenty thousand rows would take 10 ms.
        (text,) = self.db.execute("SELECT group_concat(test, ' ') FROM tests").fetchone()
        return np.fromstring(text or "", np.int64, sep=" ")

    def test_points(self, run: int, first: int) -> Integers:
        """Return the test points of a run from ``first`` on that have a test, increasing."""
        points = self._points_of_run(run, first, LAST)
        rows = self.db.execute(f"SELECT point FROM ({points}) AS points ORDER BY point")
        return np.fromiter((point for (point,) in rows), np.int64)

    def _points_of_run(self, run: int, first: int, last: int) -> str:
        """Return a query for the ``point`` and ``test`` of a run: own tests, and those assigned."""
        start = self.facts.run(run).start
        ends = f"{start + first} AND {min(start + last, LAST)}"
        return (
            f"SELECT test, test - {start} AS point FROM tests "
            f"WHERE run = {run} AND test BETWEEN {ends} "
            "UNION ALL SELECT test, test_point FROM known "
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
    for name in (columns.keys() & others.keys()).difference(_NOT_VALUES):
        one = columns[name]
        other = others[name]
        differ |= (one != other) & (one == one) & (other == other)  # NaN differs from itself
    return np.asarray(differ)


def _terms(columns: Mapping[str, tuple[str, Kind]]) -> _Terms:
    terms: _Terms = {}
    for name, (column, kind) in columns.items():
        # With the table: SQLite takes a quoted name that is no column for a text.
        terms[name] = (f"tests.{column}", DTYPES[kind])
    terms["status"] = ("status", np.object_)
    terms["reason"] = ("coalesce(reason, '')", np.object_)
    return terms


def _read(
    db: sqlite3.Connection, terms: _Terms, source: str, arguments: Sequence[int] = ()
) -> Columns:
    """Return the cells of terms in SQL."""
    columns = {name: [np.array([], dtype)] for name, (_, dtype) in terms.items()}
    query = ", ".join(term for term, _ in terms.values())
    cursor = db.execute(f"SELECT {query} FROM {source}", arguments)
    for rows in iter(lambda: cursor.fetchmany(_AT_A_TIME), []):
        for (name, (_, dtype)), cells in zip(terms.items(), zip(*rows, strict=True), strict=True):
            columns[name].append(np.array(cells, dtype))
    return {name: np.concatenate(parts) for name, parts in columns.items()}


# Heads


def require_other_names(head: Head) -> None:
    """Check that no column of a head has the name of one that a study adds."""
    for group in _GROUPS:
        for name in head.get(group, ()):
            if name in ADDED:
                rule = f"named unlike the columns that a study adds: {', '.join(ADDED)}"
                remedy = "give the problem, or the program, another name for it"
                raise invalid("a column of a study", rule, name, remedy)


def with_stored_columns(stored: Head, asked: Head) -> Values:
    """Return the head that a study has from now on; a column that is stored stays, as an output.

    Args:
        stored: The one that it has.
        asked: The one that a run asks for.
    """
    names = [name for group in _GROUPS[1:] for name in asked.get(group, ())]
    outputs = [*asked.get("outputs", ())]
    for group in _GROUPS[1:]:
        outputs += [name for name in stored.get(group, ()) if name not in names]
    if not outputs:
        return {**asked}
    return {**asked, "outputs": outputs}


def _changed_names(stored: Head, head: Head) -> tuple[dict[str, str], list[str]]:
    """Return new names of stored columns, and the stored objectives whose direction changes.

    A problem that knows its columns by their places, as pymoo's do, may rename them. An objective
    that is maximised now, or no longer, has values of the opposite sign.
    """
    names: dict[str, str] = {}
    if "objectives" not in (head.get("problem") or {}):  # its outputs have names of their own
        return names, []
    for group in ("objectives", "inequalities", "equalities"):
        new_names = head[group]
        if group == "inequalities":  # requirements follow those of the model
            new_names = new_names[: head.get("model_inequalities")]
        names |= zip(stored[group], new_names, strict=False)
    was_maximized = {names.get(name, name) for name in stored.get("maximize", ())}
    differing_names = was_maximized ^ {*head.get("maximize", ())}
    return names, [n for n in stored["objectives"] if names.get(n, n) in differing_names]


def renames_columns(stored: Head, head: Head) -> bool:
    """Whether another head has other names for stored columns, or other directions."""
    names, reversed_names = _changed_names(stored, head)
    return bool(reversed_names) or any(name != new for name, new in names.items())


def renamed_columns(columns: Columns, stored: Head, head: Head) -> Columns:
    """Return stored columns under the names, and in the directions, of another head."""
    names, reversed_names = _changed_names(stored, head)
    renamed = {}
    for name, cells in columns.items():
        if name in reversed_names:
            cells = -cells
        renamed[names.get(name, name)] = cells
    return renamed


def with_outputs(head: Head, columns: Collection[str]) -> Values:
    """Return a head with the outputs that tests have."""
    columns_of_head = {*_FIXED, *_columns(head)}
    outputs = [*head.get("outputs", ())]
    for name in columns:
        if name not in columns_of_head:
            outputs.append(name)
    if not outputs:
        return dict(head)
    return {**head, "outputs": outputs}


def _columns(head: Head, fixed: Collection[str] = _FIXED) -> dict[str, tuple[str, Kind]]:
    """Return for each name its column, quoted for SQL, and the kind of its cells."""
    kinds = dict(zip(head["variables"], map(Kind, head["kinds"]), strict=True))
    columns = {}
    taken = {*fixed}
    for group in _GROUPS:
        for name in head.get(group, ()):
            column = name
            while column.lower() in taken:  # SQL takes "a" and "A" for one name
                column += "_"
            taken.add(column.lower())
            quoted = column.replace('"', '""')
            columns[name] = (f'"{quoted}"', kinds.get(name, Kind.REAL))
    return columns


# Checksums of rows, by which a changed cell is noticed

Words: TypeAlias = NDArray[np.uint64]

# The finalizer of splitmix64 (Steele, Lea and Flood, OOPSLA 2014): a bijection, so that a cell
# with another value has another word.
_STEPS = ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB), (31, 1))


def checksums(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
    """Return ``(n,)`` checksums of n rows; a change of one cell changes the checksum of its row.

    They are sums over the columns, to which NaN and empty texts add nothing. So rows keep their
    checksums when a column is added in which they have no values.

    Args:
        columns: Arrays of n numbers or texts by name.
    """
    total = np.zeros(len(next(iter(columns.values()))), dtype=np.uint64)
    for name, cells in columns.items():
        salt = np.uint64(zlib.crc32(name.encode()) << 32)
        words = _mixed(_words(cells) ^ salt)
        words[_empty(cells)] = 0
        total += words
    return total.view(np.int64)


def _text(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)


def text_checksum(texts: Any) -> int:
    """Return the checksum of some texts or numbers."""
    return zlib.crc32(repr(texts).encode())


def _words(cells: NDArray[Any]) -> Words:
    """Return the bits of numbers; checksums of texts."""
    if cells.dtype.kind == "f":
        return np.ascontiguousarray(cells).view(np.uint64)
    if cells.dtype.kind in "biu":
        return cells.astype(np.int64).view(np.uint64)
    texts = cells.tolist()
    checksum_by_text = {text: zlib.crc32(text.encode(errors="surrogatepass")) for text in {*texts}}
    return np.array([checksum_by_text[text] for text in texts], dtype=np.uint64)


def _empty(cells: NDArray[Any]) -> NDArray[np.bool_]:
    """``(n,)`` which cells are NaN or empty texts."""
    if cells.dtype.kind == "f":
        return np.asarray(np.isnan(cells))
    return np.asarray(cells == "")


def _mixed(words: Words) -> Words:
    for shift, factor in _STEPS:
        words = (words ^ (words >> np.uint64(shift))) * np.uint64(factor)
    return words
