"""The tables of a study, and the statements that read and change them in a transaction."""

from __future__ import annotations

import getpass
import json
import platform
import secrets
import sqlite3
from collections.abc import Collection, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from datetime import datetime, timezone
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._output import whole_file
from pymoo_psi._validation import AnyArray, Integers, Mask, Received, Rows, counted, invalid
from pymoo_psi.errors import StudyVersionError
from pymoo_psi.study._checksum import checksums, text_checksum
from pymoo_psi.study._lock import reported, unreadable
from pymoo_psi.study._runs import Head, StudyRun, points_of, same_points

Facts: TypeAlias = dict[str, Any]
Columns: TypeAlias = dict[str, AnyArray]
Proposal: TypeAlias = tuple[int, int, str, dict[str, Any]]
"""The test point, the round in which it was proposed, the algorithm that proposed it, and what else
the algorithm keeps, including the design."""

LAST = 2**63 - 1  # the largest number of a test

_APPLICATION = 0x50534931
_VERSION = 5  # 4 is that of pymoo-psi 0.3, 1 to 3 are those of 0.1 and 0.2
OF_0_3 = 4  # without runs and checksums; the next change adds them
_TESTS = """
CREATE TABLE tests
    (test INTEGER PRIMARY KEY, run INTEGER, test_point INTEGER, repeat INTEGER, status TEXT,
    reason TEXT, origin TEXT, seconds REAL, row_checksum INTEGER);
"""
_SCHEMA = f"""
PRAGMA application_id = {_APPLICATION};
PRAGMA user_version = {_VERSION};
CREATE TABLE IF NOT EXISTS study (name TEXT PRIMARY KEY, value TEXT);
CREATE TABLE runs
    (run INTEGER PRIMARY KEY, points TEXT, record TEXT, segments TEXT, checksum INTEGER,
    n_tests INTEGER);
CREATE TABLE known
    (run INTEGER, test_point INTEGER, test INTEGER, PRIMARY KEY (run, test_point)) WITHOUT ROWID;
CREATE TABLE proposals
    (run INTEGER, test_point INTEGER, round INTEGER, origin TEXT, content TEXT, checksum INTEGER,
    PRIMARY KEY (run, test_point)) WITHOUT ROWID;
CREATE TABLE history (time TEXT, test INTEGER, content TEXT, checksum INTEGER);
{_TESTS}"""
_TABLES = {
    _VERSION: ("study", "runs", "known", "proposals", "history", "tests"),
    OF_0_3: ("study", "proposals", "tests"),
}
_NUMBERS = ("test", "run", "test_point", "repeat")
_FIXED = (*_NUMBERS, "status", "reason", "origin", "seconds", "row_checksum")
_FIXED_IN_0_3 = ("test_point", "status", "reason", "origin", "seconds")
_GROUPS = ("variables", "objectives", "inequalities", "equalities", "outputs", "unused")
_CHECKSUM = "checksum"  # of all other facts
_TYPES = {Kind.INTEGER: "INTEGER", Kind.BINARY: "INTEGER", Kind.CHOICE: "TEXT"}
_AT_A_TIME = 65_536  # rows in memory as Python's objects


def create(
    path: str, facts: Mapping[str, Any], runs: Sequence[StudyRun], columns: Columns | None = None
) -> None:
    """Make a study file, whole or not at all.

    Args:
        path: The file.
        facts: Its head, and its share.
        runs: Its runs.
        columns: The tests of these runs.
    """
    with (
        reported(path),
        whole_file(path) as new,
        closing(sqlite3.connect(new, isolation_level=None)) as db,
    ):
        # Without a journal, as the file is thrown away if anything happens.
        db.executescript(f"PRAGMA journal_mode = OFF; BEGIN; {_SCHEMA}")
        _add_columns(db, facts["head"])
        put(db, id=secrets.token_hex(16), begun=_now(), **facts)
        for run in runs:
            _write_run(db, run)
        if columns is not None:
            insert(db, facts["head"], columns, None, np.nan)
            for run in runs:
                count_tests(db, run.number, int(np.count_nonzero(columns["run"] == run.number)))
        db.execute("COMMIT")


def _now() -> str:
    return datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")


# Facts


def read_facts(db: sqlite3.Connection, path: str) -> Facts:
    """Return the facts of a study after making sure that the file is one, and nothing else."""
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application == _APPLICATION and version not in _TABLES:
        remedy = "install a later one"
        if version < _VERSION:
            remedy = "continue it with pymoo-psi 0.2.0, or export it as CSV with that version"
        raise StudyVersionError(
            f"study {path} has format {version}, but this version of pymoo-psi reads formats "
            f"{OF_0_3} and {_VERSION}; {remedy}"
        )
    # Other items, such as triggers, are refused: SQLite would run them by itself.
    query = "SELECT name, type FROM sqlite_master WHERE name NOT LIKE 'sqlite!_%' ESCAPE '!'"
    items = dict(db.execute(query))
    tables = dict.fromkeys(_TABLES.get(version, ()), "table")
    if application != _APPLICATION or items != tables:
        others = [f"the {kind} {name}" for name, kind in items.items() - tables.items()]
        raise unreadable(path, f"it holds {', '.join(others) or 'no tests'}")
    texts = _texts(db)
    if version == OF_0_3 and _CHECKSUM in texts:
        raise unreadable(path, "the number of its format was changed")
    if version == _VERSION and texts.pop(_CHECKSUM, "") != str(text_checksum(texts)):
        raise unreadable(path, "what it says of its columns was changed")
    facts = {name: json.loads(value) for name, value in texts.items()}
    _columns(facts["head"], version)  # a damaged head raises here
    facts["format"] = version
    facts["runs"] = _runs(db, facts)
    return facts


def _texts(db: sqlite3.Connection) -> dict[str, str]:
    """Return the facts as they are stored, in the order of their names."""
    return dict(db.execute("SELECT name, value FROM study ORDER BY name"))


def put(db: sqlite3.Connection, **facts: Any) -> None:
    """Write facts."""
    statement = "INSERT OR REPLACE INTO study VALUES (?, ?)"
    for name, value in facts.items():
        db.execute(statement, (name, json.dumps(value, ensure_ascii=False)))
    texts = _texts(db)
    texts.pop(_CHECKSUM, None)
    db.execute(statement, (_CHECKSUM, str(text_checksum(texts))))


def convert(db: sqlite3.Connection, facts: Facts) -> None:
    """Make a study of version 0.3 one of this version."""
    columns = selected(db, facts, 1, LAST)
    rest = dict(zip(("origin", "seconds"), _rest(db, "test_point"), strict=True))
    proposals = stored_proposals(db, facts, 1, 1, LAST)
    db.execute("DROP TABLE tests")
    db.execute("DROP TABLE proposals")
    for statement in _SCHEMA.split(";"):
        db.execute(statement)
    _add_columns(db, facts["head"])
    for run in facts["runs"]:
        _write_run(db, run)
    insert(db, facts["head"], columns, rest["origin"], rest["seconds"])
    count_tests(db, 1, len(columns["test"]))
    add_proposals(db, 1, proposals)
    put(db)
    facts["format"] = _VERSION


def _rest(db: sqlite3.Connection, number: str) -> tuple[AnyArray, AnyArray]:
    """Return the origins and the seconds of all tests, in the order of their numbers."""
    rows = db.execute(f"SELECT origin, seconds FROM tests ORDER BY {number}").fetchall()
    origins = np.full(len(rows), None, dtype=object)
    origins[:] = [origin for origin, _ in rows]
    return origins, np.array([seconds for _, seconds in rows], dtype=np.float64)


# Runs


def _runs(db: sqlite3.Connection, facts: Facts) -> list[StudyRun]:
    none = np.zeros((0, 2), dtype=np.int64)
    if facts["format"] == OF_0_3:
        problem = facts["head"].get("problem") or {}
        points = points_of(facts["head"], problem.get("sampling")) | {"requirements": None}
        (last,) = db.execute("SELECT max(test_point) FROM tests").fetchone()
        segments = ((1, last, 0),) if last else ()
        return [StudyRun(1, points, {"begun": facts.get("begun")}, segments, none)]
    runs = []
    for row in db.execute("SELECT * FROM runs ORDER BY run").fetchall():
        number, points, record, segments, checksum, n_tests = row
        if text_checksum(row[:4]) != checksum:
            raise ValueError(f"what it says of run {number} was changed")
        query = "SELECT test_point, test FROM known WHERE run = ? ORDER BY test_point"
        known = np.array(db.execute(query, (number,)).fetchall(), dtype=np.int64).reshape(-1, 2)
        parts = tuple(map(tuple, json.loads(segments)))
        contents = json.loads(points), json.loads(record)
        runs.append(StudyRun(number, *contents, parts, known, n_tests))
    return runs


def run_of(facts: Facts, number: int) -> StudyRun:
    """Return the run of a number."""
    runs: list[StudyRun] = facts["runs"]
    for run in runs:
        if run.number == number:
            return run
    raise LookupError(f"run {number} is missing")


def run_with(runs: Sequence[StudyRun], points: Head) -> StudyRun | None:
    """Return the run that has these points, or ``None``."""
    for run in runs:
        if same_points(run.points, points):
            return run
    return None


def new_run(number: int, points: Head, segments: Sequence[Any] = ()) -> StudyRun:
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
    none = np.zeros((0, 2), dtype=np.int64)
    return StudyRun(number, points, record, tuple(segments), none)


def add_run(db: sqlite3.Connection, facts: Facts, points: Head) -> StudyRun:
    """Begin a run; return it."""
    run = new_run(1 + max(run.number for run in facts["runs"]), points)
    _write_run(db, run)
    facts["runs"].append(run)
    return run


def _write_run(db: sqlite3.Connection, run: StudyRun) -> None:
    texts = [json.dumps(part, ensure_ascii=False) for part in (run.points, run.record)]
    row = (run.number, *texts, json.dumps(run.segments))
    statement = "INSERT OR REPLACE INTO runs VALUES (?, ?, ?, ?, ?, ?)"
    db.execute(statement, (*row, text_checksum(row), run.n_tests))


def reserve(db: sqlite3.Connection, facts: Facts, run: StudyRun, first: int, last: int) -> StudyRun:
    """Keep numbers of tests for test points of a run; return the run as it is now."""
    greatest = 0
    if len(facts["runs"]) > 1:
        ends = [end + shift for other in facts["runs"] for _, end, shift in other.segments]
        greatest = max(ends, default=0)
    segments = run.with_points(first, last, greatest)
    if segments == run.segments:
        return run
    changed = replace(run, segments=segments)
    _write_run(db, changed)
    facts["runs"] = [changed if other.number == run.number else other for other in facts["runs"]]
    return changed


def remember(db: sqlite3.Connection, run: StudyRun, name: str, value: Any) -> None:
    """Write an entry of the record of a run."""
    _write_run(db, replace(run, record={**run.record, name: value}))


def count_tests(db: sqlite3.Connection, run: int, n_new: int) -> None:
    """Write that a run has more tests, by which others notice new ones."""
    db.execute("UPDATE runs SET n_tests = n_tests + ? WHERE run = ?", (n_new, run))


def tests_by_design(db: sqlite3.Connection, facts: Facts, run: int) -> dict[int, int]:
    """Return the tests of other runs by the checksum of their design."""
    columns = selected(db, facts, 1, LAST)
    is_of_others = columns["run"] != run
    tests: dict[int, int] = {}
    designs = design_checksums(facts["head"], columns)
    for design, test in zip(
        designs[is_of_others].tolist(), columns["test"][is_of_others].tolist(), strict=True
    ):
        tests.setdefault(design, test)
    return tests


def design_checksums(head: Head, columns: Columns) -> Integers:
    """Return ``(n,)`` checksums of designs, which are equal where these are, bit for bit."""
    designs = {}
    for name, kind in zip(head["variables"], map(Kind, head["kinds"]), strict=True):
        designs[name] = np.asarray(columns[name]).astype(DTYPES[kind])
    return checksums(designs)


def add_known(
    db: sqlite3.Connection, facts: Facts, run: StudyRun, rows: Sequence[tuple[int, int]]
) -> None:
    """Note for test points of a run the tests of other runs that have their designs.

    Args:
        db: The study.
        facts: Its facts.
        run: The run.
        rows: Test points and numbers of tests. Points that have a test are left out.
    """
    if not rows:
        return
    test_points = np.array([test_point for test_point, _ in rows], dtype=np.int64)
    stored = stored_test_points(db, facts, run, 1, failed=True)
    is_new = ~np.isin(test_points, stored)
    for (test_point, test), is_wanted in zip(rows, is_new.tolist(), strict=True):
        if is_wanted:
            statement = "INSERT INTO known VALUES (?, ?, ?)"
            db.execute(statement, (run.number, test_point, test))
    facts["runs"] = _runs(db, facts)


# Proposals


def add_proposals(db: sqlite3.Connection, run: int, proposals: Sequence[Proposal]) -> None:
    """Write proposals of a run."""
    for test_point, proposed_in, origin, content in proposals:
        text = json.dumps(content, ensure_ascii=False)
        row = (run, test_point, proposed_in, origin, text)
        db.execute("INSERT INTO proposals VALUES (?, ?, ?, ?, ?, ?)", (*row, text_checksum(row)))


def stored_proposals(
    db: sqlite3.Connection, facts: Facts, run: int, first: int, last: int
) -> list[Proposal]:
    """Return the proposals of a run from test point ``first`` to ``last``."""
    columns = "run, test_point, round, origin, content, checksum"
    where = "run = ? AND"
    if facts["format"] == OF_0_3:
        columns = "1, test_point, round, origin, content, NULL"
        where = "? AND"
    query = f"SELECT {columns} FROM proposals WHERE {where} test_point BETWEEN ? AND ?"
    proposals = []
    for row in db.execute(f"{query} ORDER BY test_point", (run, first, last)):
        _, test_point, proposed_in, origin, content, checksum = row
        if checksum is not None and text_checksum(row[:5]) != checksum:
            raise ValueError(f"the proposal of test point {test_point} was changed")
        proposals.append((test_point, proposed_in, origin, json.loads(content)))
    return proposals


class Requests:
    """Tests that people were asked for, and all tests of a study, in a transaction.

    Attributes:
        facts: The facts about the study.
        asked: By the number of its test, each request: ``run``, ``proposal``, ``design``, values by
            name; and ``of``, the test that it repeats, if it is none that was asked for.
        tests: The columns of all tests.
    """

    def __init__(self, db: sqlite3.Connection, facts: Facts) -> None:
        self._db = db
        self.facts = facts
        self.asked: dict[int, dict[str, Any]] = {}
        for run in facts["runs"]:
            for proposal in stored_proposals(db, facts, run.number, 1, LAST):
                content = proposal[3]
                if "test" in content:
                    request = {"run": run.number, "proposal": proposal}
                    self.asked[content["test"]] = content | request
        self.tests = selected(db, facts, 1, LAST)

    @property
    def pending(self) -> list[int]:
        """The numbers of the tests that were asked for and have no result."""
        numbers = {number for number, request in self.asked.items() if "of" not in request}
        return sorted(numbers.difference(self.tests["test"].tolist()))

    def add(self, run: int, proposals: Sequence[Proposal]) -> list[int]:
        """Ask for tests of points of a run; return their numbers."""
        if not proposals:
            return []
        test_points = np.array([proposal[0] for proposal in proposals])
        first, last = int(test_points.min()), int(test_points.max())
        reserved = reserve(self._db, self.facts, run_of(self.facts, run), first, last)
        # Tests of other runs that are known have other numbers.
        numbers = replace(reserved, known=reserved.known[:0]).tests(test_points)
        added: list[int] = numbers.tolist()
        for number, proposal in zip(added, proposals, strict=True):
            content = proposal[3] | {"test": number}
            proposal = (*proposal[:3], content)
            add_proposals(self._db, run, [proposal])
            self.asked[number] = content | {"run": run, "proposal": proposal}
        return added

    def repeat(self, test: int) -> int:
        """Return the number of a further test for a request, in a run of all repeats."""
        points = points_of(self.facts["head"], "repeats of tests")
        run = run_with(self.facts["runs"], points)
        if run is None:
            run = add_run(self._db, self.facts, points)
        request = self.asked[test]
        content = {"design": request["design"], "of": test}
        return self.add(run.number, [(run.planned + 1, *request["proposal"][1:3], content)])[0]

    def keep(self, columns: Columns) -> None:
        """Write tests of requests, ``columns`` with ``test`` and ``repeat``; see :meth:`append`."""
        requests = [self.asked[number] for number in columns["test"].tolist()]
        numbers = [(request["run"], request["proposal"][0]) for request in requests]
        self._db.executemany("DELETE FROM known WHERE run = ? AND test_point = ?", numbers)
        columns["run"], columns["test_point"] = np.array(numbers).T
        widen(self._db, self.facts, columns)
        origins = [request["proposal"][2] for request in requests]
        insert(self._db, self.facts["head"], columns, origins, np.nan)
        self._update()

    def discard(self, test: int, why: str) -> None:
        """Move a test to the history, or a request that has no test."""
        where, keys = "tests WHERE test = ?", [test]
        if test not in self.tests["test"]:
            request = self.asked.pop(test)
            where = "proposals WHERE run = ? AND test_point = ?"
            keys = [request["run"], request["proposal"][0]]
        cursor = self._db.execute(f"SELECT * FROM {where}", keys)
        names = [name for name, *_ in cursor.description]
        cells = dict(zip(names, cursor.fetchone(), strict=True))
        row = (_now(), test, json.dumps({"why": why, "cells": cells}, ensure_ascii=False))
        self._db.execute("INSERT INTO history VALUES (?, ?, ?, ?)", (*row, text_checksum(row)))
        self._db.execute(f"DELETE FROM {where}", keys)
        self._db.execute("DELETE FROM known WHERE test = ?", (test,))
        self.facts["n_changes"] = self.facts.get("n_changes", 0) + 1
        put(self._db, n_changes=self.facts["n_changes"])
        self._update()

    def _update(self) -> None:
        self.tests = selected(self._db, self.facts, 1, LAST)
        counts = "SELECT count(*) FROM tests WHERE tests.run = runs.run"
        self._db.execute(f"UPDATE runs SET n_tests = ({counts})")


# The head


def with_stored_columns(stored: Head, asked: Head) -> dict[str, Any]:
    """Return the head that a study has from now on.

    Args:
        stored: The one that it has; its columns stay.
        asked: The one that a run asks for.
    """
    named = {name for group in _GROUPS for name in asked.get(group, ())}
    head = {**asked}
    for group, groups in (
        ("outputs", ("objectives", "outputs")),
        ("unused", ("inequalities", "equalities", "unused")),
    ):
        names = [*asked.get(group, ())]
        for of_stored in groups:
            names += [name for name in stored.get(of_stored, ()) if name not in named]
        if names:
            head[group] = names
    return head


def ask(db: sqlite3.Connection, facts: Facts, asked: Head) -> None:
    """Change what a study says of its columns to what a run asks for; no test is lost."""
    stored = facts["head"]
    renamed = _renamed(stored, asked)
    turned = _turned(stored, asked, renamed)
    if renamed or turned:
        columns = selected(db, facts, 1, LAST)
        origins, seconds = _rest(db, "test")
        for name in turned:
            columns[name] = -columns[name]
        columns = {renamed.get(name, name): column for name, column in columns.items()}
        stored = _with_names(stored, renamed)
        db.execute("DROP TABLE tests")
        db.execute(_TESTS)
        _add_columns(db, stored)
        insert(db, stored, columns, origins, seconds)
    head = with_stored_columns(stored, asked)
    if head == stored:
        return
    _add_columns(db, head, present=_columns(stored))
    facts["head"] = head
    facts["is_complete"] = False
    put(db, head=head, is_complete=False)


def _renamed(stored: Head, asked: Head) -> dict[str, str]:
    """Return new names by stored ones, of columns that a problem knows by their place only."""
    renamed: dict[str, str] = {}
    problem = asked.get("problem") or {}
    if "objectives" not in problem:  # the outputs of this problem have names of their own
        return renamed
    n_inequalities = asked.get("model_inequalities")  # requirements follow these
    for group, n in (("objectives", None), ("inequalities", n_inequalities), ("equalities", None)):
        for name, new in zip(stored[group][:n], asked[group][:n], strict=False):
            if name != new:
                renamed[name] = new
    return renamed


def _turned(stored: Head, asked: Head, renamed: Mapping[str, str]) -> list[str]:
    """Return stored objectives of a problem whose direction says the sign of their values."""
    if "objectives" not in (asked.get("problem") or {}):
        return []
    names = []
    for name in stored["objectives"]:
        was_maximized = name in stored.get("maximize", ())
        is_maximized = renamed.get(name, name) in asked.get("maximize", ())
        if was_maximized != is_maximized:
            names.append(name)
    return names


def _with_names(head: Head, renamed: Mapping[str, str]) -> dict[str, Any]:
    changed = {**head}
    for group in _GROUPS:
        if group in head:
            changed[group] = [renamed.get(name, name) for name in head[group]]
    return changed


def widen(db: sqlite3.Connection, facts: Facts, columns: Columns) -> None:
    """Add the outputs that tests have to the columns of a study."""
    head = with_outputs(facts["head"], columns)
    if head != facts["head"]:
        _add_columns(db, head, present=_columns(facts["head"]))
        put(db, head=head)
        facts["head"] = head


def with_outputs(head: Head, columns: Collection[str]) -> dict[str, Any]:
    """Return a head with the outputs that tests have."""
    columns_of_head = {*_FIXED, *_columns(head)}
    outputs = [*head.get("outputs", ())]
    for name in columns:
        if name not in columns_of_head:
            outputs.append(name)
    if not outputs:
        return dict(head)
    return {**head, "outputs": outputs}


def _columns(head: Head, version: int = _VERSION) -> dict[str, tuple[str, Kind]]:
    """Return for each name its column, quoted for SQL, and the kind of its cells."""
    kinds = dict(zip(head["variables"], map(Kind, head["kinds"]), strict=True))
    columns = {}
    taken = {*_FIXED}
    if version == OF_0_3:
        taken = {*_FIXED_IN_0_3}
    for group in _GROUPS:
        for name in head.get(group, ()):
            column = name
            while column.lower() in taken:  # SQL takes "a" and "A" for one name
                column += "_"
            taken.add(column.lower())
            quoted = column.replace('"', '""')
            columns[name] = (f'"{quoted}"', kinds.get(name, Kind.REAL))
    return columns


def _add_columns(db: sqlite3.Connection, head: Head, present: Collection[str] = ()) -> None:
    for name, (column, kind) in _columns(head).items():
        if name not in present:
            db.execute(f"ALTER TABLE tests ADD COLUMN {column} {_TYPES.get(kind, '')}")


# Tests


def numbered(db: sqlite3.Connection, facts: Facts, number: int, columns: Columns) -> Columns:
    """Return columns of tests of a run with all numbers of a study."""
    run = run_of(facts, number)
    test_points = columns["test_point"]
    run = reserve(db, facts, run, int(test_points.min()), int(test_points.max()))
    n = len(test_points)
    numbers = {
        "test": run.tests(test_points),
        "run": np.full(n, number, dtype=np.int64),
        "test_point": np.array(test_points, dtype=np.int64),
        "repeat": np.ones(n, dtype=np.int64),
    }
    return columns | numbers


def to_write(
    db: sqlite3.Connection, path: str, facts: Facts, columns: Columns
) -> tuple[Columns, int]:
    """Return the tests that are to be written, with all that the study knows of them.

    These are new ones, repetitions of failed ones, and stored ones that have more values now. Those
    that are stored keep the run and the test point for which they were first made.

    Returns:
        The columns of these tests, and how many of them are new.

    Raises:
        ArgumentValueError: A test of this run that did not fail would change.
    """
    numbers = columns["test"]
    stored = selected(db, facts, int(numbers.min()), int(numbers.max()))
    _, rows, stored_rows = np.intersect1d(numbers, stored["test"], return_indices=True)
    has_failed = _failed(stored, stored_rows)
    is_of_run = stored["run"][stored_rows] == columns["run"][rows]
    differs = differing(stored, stored_rows, columns, rows)
    # What another run has tested meanwhile stays.
    replaces = differs & (is_of_run | has_failed)
    changed = numbers[rows][replaces & ~has_failed]
    if len(changed):
        raise invalid(
            "block",
            "of new test points, repetitions of failed ones, or what is stored",
            Received(f"other values for test point {changed[0]}"),
            f"use another file if the model has changed; study {path} is as it was",
        )
    adds = _adds_values(stored, stored_rows, columns, rows) & ~differs
    written = _with_stored(columns, rows, stored, stored_rows, adds)
    is_written = np.ones(len(numbers), dtype=bool)
    is_written[rows[~(replaces | adds)]] = False
    return _rows(written, is_written), len(numbers) - len(rows)


def _adds_values(stored: Columns, stored_rows: Rows, columns: Columns, rows: Rows) -> Mask:
    """``(n,)`` which of n pairs of tests have a value that the stored one lacks."""
    adds = np.zeros(len(rows), dtype=bool)
    for name in columns.keys() - {*_FIXED}:
        is_unknown = np.ones(len(rows), dtype=bool)
        if name in stored:
            one = stored[name][stored_rows]
            is_unknown = one != one  # NaN differs from itself
        other = columns[name][rows]
        adds |= is_unknown & (other == other)
    return adds


def _with_stored(
    columns: Columns, rows: Rows, stored: Columns, stored_rows: Rows, adds: Mask
) -> Columns:
    """Return columns of tests, with what only the stored ones among them have.

    Args:
        columns: The columns.
        rows: ``(n,)`` the rows of tests that are stored.
        stored: The columns of stored tests.
        stored_rows: ``(n,)`` the rows of these tests there.
        adds: ``(n,)`` which of them are stored tests with more values.
    """
    whole = {**columns}
    for name, values in stored.items():
        cells = np.array(columns.get(name, np.full(len(columns["test"]), np.nan)))
        if name in ("run", "test_point"):
            cells[rows] = values[stored_rows]
        is_unknown = adds & (cells[rows] != cells[rows])
        cells[rows[is_unknown]] = values[stored_rows[is_unknown]]
        whole[name] = cells
    return whole


def _failed(columns: Columns, rows: Rows) -> Mask:
    return np.asarray(columns["status"][rows] == "failed")


def differing(columns: Columns, rows: Rows, others: Columns, other_rows: Rows) -> Mask:
    """``(n,)`` which of n pairs of tests differ in a value that both have."""
    differ = np.zeros(len(rows), dtype=bool)
    for name in (columns.keys() & others.keys()).difference((*_NUMBERS, "status", "reason")):
        one = columns[name][rows]
        other = others[name][other_rows]
        differ |= (one != other) & (one == one) & (other == other)  # NaN differs from itself
    # Limits and requirements, which may change, say what is infeasible.
    failed = _failed(columns, rows)
    other_failed = _failed(others, other_rows)
    differ |= failed != other_failed
    differ |= failed & other_failed & (columns["reason"][rows] != others["reason"][other_rows])
    return differ


def insert(
    db: sqlite3.Connection, head: Head, columns: Columns, origin: Any, seconds: ArrayLike
) -> None:
    """Write tests, in place of those with their numbers."""
    n = len(columns["test"])
    names = [*_FIXED]
    reasons = np.where(columns["reason"] == "", np.array(None), columns["reason"])
    values_by_name = {}
    for name, (column, kind) in _columns(head).items():
        # NaN where these tests lack an output.
        values = columns.get(name, np.full(n, np.nan))
        names.append(column)
        values_by_name[name] = values.astype(DTYPES[kind])
    stored = {**values_by_name}
    for name in (*_NUMBERS, "status", "reason"):
        stored[name] = columns[name]
    origins = np.full(n, None, dtype=object)
    origins[:] = origin
    cells = [
        *(columns[name] for name in _NUMBERS),
        columns["status"],
        reasons,
        origins,
        np.full(n, seconds, dtype=np.float64),
        checksums(stored),
        *values_by_name.values(),
    ]
    marks = ", ".join("?" * len(cells))
    statement = f"INSERT OR REPLACE INTO tests ({', '.join(names)}) VALUES ({marks})"
    for start in range(0, n, _AT_A_TIME):
        block = [column[start : start + _AT_A_TIME].tolist() for column in cells]
        db.executemany(statement, zip(*block, strict=True))


def rewrite(db: sqlite3.Connection, facts: Facts, columns: Columns) -> None:
    """Write some columns of stored tests anew; see :meth:`Study.complete`."""
    stored = selected(db, facts, 1, LAST, with_unused=True)
    rows = np.searchsorted(stored["test"], columns["test"])
    origins, seconds = _rest(db, "test")
    changed = {name: column[rows] for name, column in stored.items()}
    insert(db, facts["head"], changed | columns, origins[rows], seconds[rows])


def selected(
    db: sqlite3.Connection, facts: Facts, first: int, last: int, *, with_unused: bool = False
) -> Columns:
    """Return the tests with numbers from ``first`` to ``last``, in the order of their numbers.

    Raises:
        ValueError: A row has another checksum.
    """
    version = facts["format"]
    number = "test_point" if version == OF_0_3 else "test"
    ends = min(first, LAST), min(last, LAST)
    # By name: what is selected, and the type of its cells.
    terms: dict[str, tuple[str, Any]] = {"test": (number, np.int64)}
    is_numbered = version == _VERSION and _has_other_numbers(db, *ends)
    if is_numbered:
        for name in _NUMBERS[1:]:
            terms[name] = (name, np.int64)
    for name, (column, kind) in _columns(facts["head"], version).items():
        # With the table: SQLite takes a quoted name that is no column for a text.
        terms[name] = (f"tests.{column}", DTYPES[kind])
    terms["status"] = ("status", np.object_)
    terms["reason"] = ("coalesce(reason, '')", np.object_)
    checksum = "NULL" if version == OF_0_3 else "row_checksum"
    columns = {name: [np.array([], dtype)] for name, (_, dtype) in terms.items()}
    query = ", ".join(term for term, _ in terms.values())
    cursor = db.execute(
        f"SELECT {checksum}, {query} FROM tests WHERE {number} BETWEEN ? AND ? ORDER BY {number}",
        ends,
    )
    stored_checksums: list[int] = []
    for rows in iter(lambda: cursor.fetchmany(_AT_A_TIME), []):
        found, *parts = zip(*rows, strict=True)
        stored_checksums.extend(found)
        for name, cells in zip(terms, parts, strict=True):
            columns[name].append(np.array(cells, terms[name][1]))
    whole = {name: np.concatenate(parts) for name, parts in columns.items()}
    if not is_numbered:
        ones = np.ones(len(whole["test"]), dtype=np.int64)
        whole |= {"run": ones, "test_point": whole["test"].copy(), "repeat": ones}
    if version == _VERSION:
        _require_checksums(whole, np.array(stored_checksums, dtype=np.int64))
    if not with_unused:
        for name in facts["head"].get("unused", ()):
            del whole[name]
    return whole


def _has_other_numbers(db: sqlite3.Connection, first: int, last: int) -> bool:
    """Whether tests are of several runs, or numbered unlike their points; to read them is slow."""
    query = (
        "SELECT EXISTS (SELECT 1 FROM tests WHERE test BETWEEN ? AND ? "
        "AND (run <> 1 OR test_point <> test OR repeat <> 1))"
    )
    (has_other,) = db.execute(query, (first, last)).fetchone()
    return bool(has_other)


def _require_checksums(columns: Columns, stored: Integers) -> None:
    changed = columns["test"][stored != checksums(columns)]
    if len(changed):
        raise ValueError(f"{counted(len(changed), 'test')} changed, the first {changed[0]}")


def selected_of_run(
    db: sqlite3.Connection, facts: Facts, run: StudyRun, first: int, last: int
) -> Columns:
    """Return the tests of test points ``first`` to ``last`` of a run, in their order."""
    parts = []
    for start, end, _ in run.ranges(first, last):
        columns = selected(db, facts, start, end)
        if len(facts["runs"]) > 1:
            columns = _rows(columns, columns["run"] == run.number)
        parts.append(columns)
    known = run.known_between(first, last)
    if len(known):
        test_points, tests = known.T
        columns = selected(db, facts, int(tests.min()), int(tests.max()))
        columns = _rows(columns, np.searchsorted(columns["test"], tests))
        columns["test_point"] = test_points
        parts.append(columns)
    if len(parts) == 0:
        return selected(db, facts, 1, 0)
    if len(parts) == 1:
        return parts[0]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return _rows(columns, np.argsort(columns["test_point"], kind="stable"))


def _rows(columns: Columns, rows: Any) -> Columns:
    return {name: column[rows] for name, column in columns.items()}


def stored_numbers(
    db: sqlite3.Connection, facts: Facts, first: int, last: int, failed: bool
) -> Integers:
    """Return the numbers of the stored tests from ``first`` to ``last``, increasing."""
    number = "test_point" if facts["format"] == OF_0_3 else "test"
    source = f"FROM tests WHERE {number} BETWEEN ? AND ?"
    if not failed:
        source += " AND status <> 'failed'"
    ends = f"SELECT count(*), min({number}), max({number}) {source}"
    n, least, greatest = db.execute(ends, (first, last)).fetchone()
    if n > 0 and greatest - least + 1 == n:  # no need to read each of them
        return np.arange(least, greatest + 1, dtype=np.int64)
    rows = db.execute(f"SELECT {number} {source} ORDER BY {number}", (first, last))
    return np.fromiter((test for (test,) in rows), np.int64)


def stored_test_points(
    db: sqlite3.Connection, facts: Facts, run: StudyRun, first: int, failed: bool
) -> Integers:
    """Return the test points of a run from ``first`` on that have a test, increasing."""
    parts = []
    for start, end, shift in run.ranges(first, LAST):
        parts.append(stored_numbers(db, facts, start, end, failed) - shift)
    test_points, tests = run.known_between(first, LAST).T
    if len(tests):
        stored = stored_numbers(db, facts, int(tests.min()), int(tests.max()), failed)
        parts.append(test_points[np.isin(tests, stored)])
    if len(parts) == 1:
        return parts[0]
    return np.sort(np.concatenate([np.zeros(0, dtype=np.int64), *parts]))
