"""A study in a transaction: the layout of the database, and what is read and changed in it.

- ``tests`` has one row for each test: ``test``, its number; ``design``, a key of its variables, and
  ``repeat``, which of the tests of the design it is, 1 unless the model is noisy or people repeat
  it; ``status``, NULL of a test that is planned; ``reason``, why it failed; ``origin``, where its
  design comes from; ``seconds``, the time of its evaluation (the mean of designs that were
  evaluated together); then variables, objectives, constraints and outputs under their names. A name
  that is taken gets ``_`` appended. NaN is NULL, binary variables are 0 and 1, choices are texts.
- ``plan`` has the points of the runs, the test that each of them has, and the proposals of an
  algorithm, or for people, which may be without a test.
- ``runs`` says for each run what determines its points, when, where and by which versions it was
  begun, and the points that it was asked for.
- ``meta`` has the facts about the whole file, as JSON. One of them is what people ask of a run
  while it works, and what the run answered.
- ``log`` says when stored tests were changed, by whom, and of corrections what they were before.

Runs that want the same design share its test, which is that of the first one. Its number says the
run and the point for which it was made: 3 000 017 is point 17 of run 4, and 17 that of the first
run, unless the number was taken.

Other programs may add views, indices and tables. Triggers are refused, as SQLite would run them
whenever a test is written.

Real numbers are in columns without a type, which keep all their bits: a column of type REAL would
turn -0.0 into 0.0.
"""

from __future__ import annotations

import json
import os
import platform
import secrets
import sqlite3
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from pymoo_psi._kinds import DTYPES, Kind, keys_of_designs
from pymoo_psi._output import whole_file
from pymoo_psi._validation import AnyArray, Columns, Head, Integers, Mask, Received, Values, invalid
from pymoo_psi.errors import StudyCorruptError
from pymoo_psi.study._facts import (
    ALL,
    NOT_VALUES,
    NUMBERS,
    ROOM,
    Facts,
    Share,
    StudyRun,
    beside,
    columns_of_head,
    now,
    record_of_run,
    require_other_names,
    with_outputs,
)
from pymoo_psi.study._integrity import intact, reported, unreadable

_APPLICATION = 0x50534931
_VERSION = 1
_TABLES = ("meta", "runs", "plan", "log", "tests")
# The tables of a new study; without a journal, as the file is thrown away if anything happens.
_SCHEMA = f"""
PRAGMA journal_mode = OFF;
BEGIN;
PRAGMA application_id = {_APPLICATION};
PRAGMA user_version = {_VERSION};
CREATE TABLE tests
    (test INTEGER PRIMARY KEY, design TEXT, repeat INTEGER, status TEXT, reason TEXT, origin TEXT,
    seconds REAL, UNIQUE (design, repeat));
CREATE TABLE plan
    (run INTEGER, point INTEGER, test INTEGER, proposal TEXT, PRIMARY KEY (run, point))
    WITHOUT ROWID;
CREATE TABLE runs (run INTEGER PRIMARY KEY, identity TEXT, record TEXT);
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT) WITHOUT ROWID;
CREATE TABLE log (time TEXT, who TEXT, what TEXT);
"""
LAST = 2**63 - 1  # the largest number of a test

_TYPES = {Kind.INTEGER: "INTEGER", Kind.BINARY: "INTEGER", Kind.CHOICE: "TEXT"}

# The tests of points of a run.
_OF_RUN = "plan JOIN tests USING (test) WHERE run = ? AND point BETWEEN ? AND ? AND status NOT NULL"
# Names in SQL that no value has: other columns of plan, and those with a meaning of their own.
_OTHER_NAMES = ("point", "proposal", "rowid", "oid", "_rowid_", "true", "false")


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


_FACTS = ("design", "repeat", "status", "reason", "origin", "seconds")
# A row of the table of tests: its number, the facts, and the values of the columns of the head.
_Row = tuple[Any, ...]
_REPEAT, _STATUS, _REASON = 2, 3, 4  # places in a row
_VALUES = slice(7, None)


def _contradicts(repetition: _Row, test: _Row) -> bool:
    """Whether a repetition of a test has other results; values of both can differ."""
    if test[_STATUS] in (None, "failed"):
        return False
    pairs = zip(test[_VALUES], repetition[_VALUES], strict=True)
    differs = any(old != new for old, new in pairs if old is not None and new is not None)
    return differs or repetition[_STATUS] == "failed"


def _completed(test: _Row, repetition: _Row) -> _Row:
    """Return what is kept of a test and a repetition.

    A planned test is made now, and a failed one is replaced. Another one gets the values that it
    lacks, unless the repetition contradicts it.
    """
    if test[_STATUS] is None:
        return repetition
    if test[_STATUS] == "failed":
        if repetition[_STATUS] == "failed" and repetition[_REASON] == test[_REASON]:
            return test
        return (*repetition[:_REPEAT], test[_REPEAT], *repetition[_STATUS:])
    if _contradicts(repetition, test):
        return test
    pairs = zip(test[_VALUES], repetition[_VALUES], strict=True)
    return (*test[: _VALUES.start], *(new if old is None else old for old, new in pairs))


class _Block:
    """Points of a run that are written together, with the stored tests of them and their designs.

    What is stored does not depend on how the tests of a run are divided into blocks.

    Args:
        database: The study.
        run: The run.
        points: The points.
        keys: The keys of their designs.
        numbers: The numbers of new tests, which others may have.
        repeat: Which of the tests of its design each point has; 0 for a further one.
        noisy: Whether a design that recurs in the run is tested again.

    Attributes:
        stored_tests: The stored tests by number.
        contradictions: The points whose tests have other results now.
    """

    def __init__(
        self,
        database: Database,
        run: int,
        points: Sequence[int],
        keys: Sequence[str | None],
        numbers: Sequence[int],
        repeat: int = 1,
        *,
        noisy: bool = False,
    ) -> None:
        self.contradictions: list[int] = []
        self._db = database.db
        self._names = database.names()
        self._run = run
        self._repeat = repeat
        self._noisy = noisy
        query = """
            SELECT point, test FROM plan JOIN tests USING (test)
            WHERE run = ? AND point IN (SELECT value FROM json_each(?))
        """
        self._stored_plan = dict(self._db.execute(query, (run, json.dumps(points))))
        self._plan = dict(self._stored_plan)
        (last,) = self._db.execute("SELECT coalesce(max(test), 0) FROM tests").fetchone()
        self._free_number = max(last, *numbers, 0) + 1
        known = [*self._plan.values(), *(number for number in numbers if number <= last)]
        # A join, as SQLite would sort the designs of a subquery. "value" may be a column of tests.
        query = f"""
            SELECT {", ".join(self._names)} FROM tests WHERE test IN (
                SELECT test FROM json_each(?) CROSS JOIN tests ON design = json_each.value
                UNION ALL SELECT value FROM json_each(?))
        """
        rows = self._db.execute(query, (json.dumps(keys), json.dumps(known)))
        self.stored_tests: dict[int, _Row] = {row[0]: row for row in rows}
        self._tests = dict(self.stored_tests)
        # By design and repeat.
        self._numbers = {row[1:_STATUS]: number for number, row in self._tests.items()}
        self._free_repeats: dict[str | None, int] = {}  # those before are taken
        self._tests_of_run: set[int] = set()
        if noisy:
            query = "SELECT test FROM plan WHERE run = ? AND test NOT NULL"
            self._tests_of_run.update(number for (number,) in self._db.execute(query, (run,)))

    def add(self, point: int, number: int, design: str | None, content: _Row) -> None:
        """Let a point have a test: the known one of its design, which may change, or a new one.

        Args:
            point: The point.
            number: The number of the test if it is new, unless another one has it.
            design: The key of its design.
            content: The row of the test after its repeat.
        """
        known_number, repeat = self.find(point, design)
        if known_number is not None:
            number = known_number
        elif number in self._tests:
            number = self._free_number
            self._free_number += 1
        test = (number, design, repeat, *content)
        if known_number is not None:
            stored = self._tests[number]
            if point in self._stored_plan and _contradicts(test, stored):
                self.contradictions.append(point)
            test = _completed(stored, test)
        self._tests[number] = test
        self._numbers[test[1:_STATUS]] = number
        self.assign(point, number)

    def assign(self, point: int, number: int) -> None:
        """Let a point have a test of the block by its number."""
        self._plan[point] = number
        self._tests_of_run.add(number)

    def find(self, point: int, design: str | None) -> tuple[int | None, int]:
        """Return the number of the test of a point, if there is one; and its repeat if it is new.

        Args:
            point: The point.
            design: The key of its design.
        """
        repeat = self._repeat
        if repeat == 0:
            repeat = self._free_repeat(design)
        elif self._noisy and self._numbers.get((design, repeat)) in self._tests_of_run:
            repeat = -((self._run - 1) * ROOM + point)  # for this point alone
        number = self._plan.get(point)
        if number is None and design is not None:
            number = self._numbers.get((design, repeat))
        return number, repeat

    def _free_repeat(self, design: str | None) -> int:
        """Return the first repeat that no test of a design has.

        It is 1 while the first test is corrected, as other runs look for that one.
        """
        repeat = self._free_repeats.get(design, 1)
        while (design, repeat) in self._numbers:
            repeat += 1
        self._free_repeats[design] = repeat
        return repeat

    def write(self) -> dict[int, _Row]:
        """Write the tests and the plan; return the tests that are new or changed, by number."""
        tests = _changes(self.stored_tests, self._tests)
        plan = _changes(self._stored_plan, self._plan)
        marks = ", ".join("?" * len(self._names))
        values = ", ".join(f"{name} = excluded.{name}" for name in self._names)
        self._db.executemany(
            f"INSERT INTO tests ({', '.join(self._names)}) VALUES ({marks}) "
            f"ON CONFLICT (test) DO UPDATE SET {values}",
            tests.values(),
        )
        # The points may have proposals.
        self._db.executemany(
            "INSERT INTO plan (run, point, test) VALUES (?, ?, ?) "
            "ON CONFLICT (run, point) DO UPDATE SET test = excluded.test",
            ((self._run, point, number) for point, number in plan.items()),
        )
        return tests


@contextmanager
def created(path: str, head: Head, share: Sequence[int] | None = None) -> Iterator[Database]:
    """Yield a new study, which becomes the file after the body, whole or not at all."""
    with (
        reported(path, OSError),
        whole_file(path) as new,
        closing(sqlite3.connect(new, isolation_level=None)) as db,
    ):
        database = Database(db, path)
        database.begin(head, share)
        yield database
        db.execute("COMMIT")


class Database:
    """A study in a transaction.

    Args:
        db: The connection.
        path: The file, for messages.
    """

    def __init__(self, db: sqlite3.Connection, path: str) -> None:
        self.db = db
        self._path = path

    # Facts

    def begin(self, head: Head, share: Sequence[int] | None = None) -> None:
        """Make the tables of a new study, in a transaction."""
        self.db.executescript(_SCHEMA)
        facts: Values = {"id": secrets.token_hex(16), "share": share, "columns": {}}
        facts |= {"steering": [], "process": ["", 0]}
        for name, value in facts.items():
            self._set(name, value)
        self._set_head(head)

    def _set(self, key: str, value: Any) -> None:
        self.db.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (key, _text(value)))

    def get(self, key: str) -> Any:
        """Return one of the facts that are stored as JSON."""
        (text,) = self.db.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        return json.loads(text)

    @cached_property
    def head(self) -> Values:
        """The columns and the formulation of the last run, without bounds."""
        head: Values = self.get("head")
        return head

    @property
    def facts(self) -> Facts:
        """The facts of the study as a whole."""
        with intact(self.db, self._path):
            meta = {key: json.loads(text) for key, text in self.db.execute("SELECT * FROM meta")}
            runs = self.runs()
            n_changes = self.count("log")
        facts = Facts(runs=runs, n_changes=n_changes, **meta)
        return facts._replace(head={**facts.head, **facts.bounds})

    def log(self, who: str, **what: Any) -> None:
        """Note who has changed stored tests, and how."""
        self.db.execute("INSERT INTO log VALUES (?, ?, ?)", (now(), who, _text(what)))

    def steer(self, request: Values) -> None:
        """Add a new request to the run at work, or replace one with its number and answer."""
        steering = self.get("steering")
        number = request.get("number", len(steering) + 1)
        new = {"number": number, "time": now(), "run": 0, "answer": "waits for the run"}
        steering[number - 1 : number] = [{**new, "is_over": False, **request}]
        self._set("steering", steering)

    # Runs

    def add_run(self, identity: Head, number: int | None = None) -> StudyRun:
        """Begin a run, by default with the next number; return it."""
        record = record_of_run()
        row = (number, _text(identity), _text(record))
        cursor = self.db.execute("INSERT INTO runs VALUES (?, ?, ?)", row)
        return StudyRun(int(cursor.lastrowid or 0), identity, record)

    def runs(self) -> list[StudyRun]:
        """Return the runs, by their numbers."""
        runs = []
        for number, *texts in self.db.execute("SELECT * FROM runs ORDER BY run"):
            runs.append(StudyRun(number, *map(json.loads, texts)))
        return runs

    def record(self, run: int, **entries: Any) -> Values:
        """Add entries to the record of a run; return it."""
        rows = self.db.execute("SELECT record FROM runs WHERE run = ?", (run,))
        record: Values = json.loads(rows.fetchone()[0]) | entries
        if entries:
            self.db.execute("UPDATE runs SET record = ? WHERE run = ?", (_text(record), run))
        return record

    def last_point(self, run: int) -> int:
        """Return the greatest point of a run that has a test or a proposal; 0 without any."""
        query = "SELECT coalesce(max(point), 0) FROM plan WHERE run = ?"
        return int(self._integers(query, run)[0])

    def n_left(self) -> int:
        """Return how many planned points have no test."""
        share = Share(*self.get("share") or ALL)
        n_left = 0
        for run in self.runs():
            planned = [share.numbers(first, last) for first, last in run.planned]
            points = np.concatenate([*planned, np.zeros(0, np.int64)])
            n_left += len(np.setdiff1d(points, self.test_points(run.number, 1)))
        return n_left

    # Proposals

    def add_proposal(self, run: int, proposal: Proposal) -> None:
        """Write a proposal of a run, yet without a test."""
        point, *entries = proposal
        self.db.execute("INSERT INTO plan VALUES (?, ?, NULL, ?)", (run, point, _text(entries)))

    def proposals(self, run: int, first: int = 1, last: int = LAST) -> list[Proposal]:
        """Return the proposals of a run from test point ``first`` to ``last``."""
        proposals = self.assigned("run = ? AND point BETWEEN ? AND ?", run, first, last)
        return [proposal for *_, proposal in proposals]

    def assigned(
        self, where: str = "test NOT NULL", *arguments: int
    ) -> list[tuple[int, int, Proposal]]:
        """Return the run and the test of proposals, by default of those that have a test."""
        query = f"SELECT run, test, point, proposal FROM plan WHERE proposal NOT NULL AND {where}"
        rows = []
        with intact(self.db, self._path):
            for run, test, point, text in self.db.execute(query, arguments):
                rows.append((run, test, Proposal(point, *json.loads(text))))
        return rows

    def propose(self, run: int, proposals: Sequence[Proposal]) -> Sequence[Proposal]:
        """Write proposals, in the order of their test points, unless others have these.

        Returns:
            The proposals that are stored under the test points now.
        """
        stored = self.proposals(run, proposals[0][0], proposals[-1][0])
        if stored:
            return stored
        for proposal in proposals:
            self.add_proposal(run, proposal)
        return proposals

    def assign(self, run: int, proposal: Proposal) -> tuple[int, Proposal]:
        """Plan a test of a proposed design as the next point of a run; return its number."""
        proposal = proposal._replace(test_point=self.last_point(run) + 1)
        self.add_proposal(run, proposal)
        point = proposal.test_point
        design = {name: np.array([value]) for name, value in proposal.content["design"].items()}
        number = (run - 1) * ROOM + point
        # Without a key: until it is made, others may test the same design.
        block = _Block(self, run, [point], [None], [number])
        (content,) = self._contents(design, 1)
        block.add(point, number, None, content)
        (number,) = block.write()
        return number, proposal

    def cancel(self, run: int, test: int, test_point: int) -> None:
        """Give up a planned test."""
        self.correct(test, "cancelled")
        self.db.execute("DELETE FROM tests WHERE test = ?", (test,))
        self.db.execute("DELETE FROM plan WHERE run = ? AND point = ?", (run, test_point))

    def correct(self, test: int, why: str) -> None:
        """Let a test be planned again; the log keeps its values."""
        cursor = self.db.execute("SELECT * FROM tests WHERE test = ?", (test,))
        names = [name for name, *_ in cursor.description]
        cells = dict(zip(names, cursor.fetchone(), strict=True))
        self.log("tell", test=test, why=why, cells=cells)
        self.db.execute("UPDATE tests SET design = NULL, status = NULL WHERE test = ?", (test,))

    # The head

    def replace_head(
        self, head: Head, revised: Callable[[Columns], tuple[Mask, Columns]] | None = None
    ) -> None:
        """Replace the head of the study by that of a run; no test that was made is lost.

        Stored columns that the new head lacks become outputs.

        Args:
            head: The new head.
            revised: Returns which of stored tests are to be made anew under it, and values of them
                that follow from others.
        """
        stored = self.head
        self._set_head(beside(head, stored))
        tests = self.tests()
        columns: Columns = {}
        if revised is not None:
            is_unmade, columns = revised(tests)
            self.remove(tests["test"][is_unmade])
        if columns:
            self.widen(columns)
            cells = self._cells(columns)
            changes = ", ".join(f"{name} = ?" for name in cells)
            rows = zip(*cells.values(), tests["test"].tolist(), strict=True)
            self.db.executemany(f"UPDATE tests SET {changes} WHERE test = ?", rows)
            self.log("study", completed=[*columns])

    def remove(self, numbers: Integers) -> None:
        """Remove tests by their numbers; the points that have them are to be tested."""
        removed = "WHERE test IN (SELECT value FROM json_each(?))"
        texts = (json.dumps(numbers.tolist()),)
        self.db.execute(f"UPDATE plan SET test = NULL {removed}", texts)
        self.db.execute(f"DELETE FROM tests {removed}", texts)

    def _set_head(self, head: Head) -> None:
        """Store a head; the table of tests gets the columns that it lacks."""
        require_other_names(head)
        self.head = {**head, **{side: None for side in ("lower", "upper") if side in head}}
        self._set("head", self.head)
        stored = self.get("columns")
        names = _with_names_in_sql(stored, columns_of_head(head))
        self._set("columns", names)
        self._columns = _columns_in_sql(self.head, names)
        for name, (sql, kind) in self._columns.items():
            if name not in stored:
                self.db.execute(f"ALTER TABLE tests ADD COLUMN {sql} {_TYPES.get(kind, '')}")

    def widen(self, columns: Collection[str]) -> None:
        """Add the outputs that tests have to the columns of a study."""
        head = self.head
        wider = with_outputs(head, columns)
        if wider != head:
            self._set_head(wider)

    # Writing tests

    def append(self, run: int, columns: Columns, repeat: int = 1, *, noisy: bool = False) -> int:
        """Write tests of a run; return how many are new or changed; see :meth:`Study.append`.

        What is stored does not depend on how the tests are divided into blocks.
        """
        self.widen(columns)
        points = columns["test_point"].tolist()
        numbers = columns.get("test", (run - 1) * ROOM + columns["test_point"]).tolist()
        keys = self.keys(columns)
        block = _Block(self, run, points, keys, numbers, repeat, noisy=noisy)
        contents = self._contents(columns, len(points))
        for point, number, key, content in zip(points, numbers, keys, contents, strict=True):
            block.add(point, number, key, content)
        if block.contradictions:
            raise invalid(
                "block",
                "of new test points, repetitions of failed ones, or what is stored",
                Received(f"other values for test point {block.contradictions[0]} of run {run}"),
                f"use another file if the model has changed; study {self._path} is as it was",
            )
        tests = block.write()
        n_changed = len(tests.keys() & block.stored_tests.keys())
        if n_changed and repeat:  # people's own tests are planned, or in the log already
            self.log(f"run {run}", changed=n_changed)
        process = [platform.node(), os.getpid()]
        if tests and self.get("process") != process:
            self._set("process", process)
        return len(tests)

    def adopt(
        self, run: int, points: Integers, keys: Sequence[str], repeat: int, *, noisy: bool
    ) -> None:
        """Plan the tests that there are for points of a run with the same designs."""
        block = _Block(self, run, points.tolist(), keys, [], repeat, noisy=noisy)
        for point, key in zip(points.tolist(), keys, strict=True):
            number, _ = block.find(point, key)
            if number is not None:
                block.assign(point, number)
        block.write()

    def number_by_points(self) -> None:
        """Give each test of the only run the number of the first of its points."""
        self.db.execute("""
            UPDATE tests SET test = -numbered.first FROM
                (SELECT test, min(point) AS first FROM plan GROUP BY test) AS numbered
            WHERE numbered.test = tests.test AND numbered.first < tests.test
        """)
        self.db.execute("UPDATE tests SET test = -test WHERE test < 0")  # now none is taken

    def find(self, keys: Sequence[str]) -> Integers:
        """Return the first tests of n designs by their keys, 0 where there is none."""
        query = """
            SELECT coalesce(test, 0) FROM json_each(?)
            LEFT JOIN tests ON design = json_each.value AND repeat = 1 ORDER BY json_each.key
        """
        return self._integers(query, json.dumps(keys))

    def keys(self, columns: Columns) -> Sequence[str | None]:
        """Return a key of the design of each test; ``None`` if there are no variables."""
        head = self.head
        designs = [columns[name] for name in head["variables"]]
        if not designs:  # no design is another's
            return [None] * len(columns["test_point"])
        return keys_of_designs(designs, [*map(Kind, head["kinds"])])

    def names(self) -> list[str]:
        """Return the names in SQL of the cells of a test."""
        return ["test", *_FACTS, *(sql for sql, _ in self._columns.values())]

    def _contents(self, columns: Columns, n: int) -> Iterator[_Row]:
        """Return the rows of n tests after their repeats."""
        cells = self._cells(columns)
        unknown = [None] * n
        return zip(*(cells.get(name, unknown) for name in self.names()[_STATUS:]), strict=True)

    def _cells(self, columns: Columns) -> dict[str, list[Any]]:
        """Return columns of tests as lists by their names in SQL."""
        cells: dict[str, list[Any]] = {}
        for name in ("status", "reason", "origin", "seconds"):
            if name in columns:
                cells[name] = _cells(columns[name])
        if "reason" in cells:
            cells["reason"] = [reason or None for reason in cells["reason"]]
        for name, (sql, kind) in self._columns.items():
            if name in columns:
                cells[sql] = _cells(columns[name].astype(DTYPES[kind]))
        return cells

    @cached_property
    def _columns(self) -> dict[str, tuple[str, Kind]]:
        """The columns of values by name: their quoted names in SQL, and their kinds."""
        return _columns_in_sql(self.head, self.get("columns"))

    # Reading tests

    def tests(self, first: int = 1, last: int = LAST) -> Columns:
        """Return the tests with numbers from ``first`` to ``last``, in the order of their numbers.

        Returns:
            The columns of :meth:`Study.append`, the number ``test``, and of the point for which it
            was made the ``run`` and ``test_point``.

        Raises:
            StudyCorruptError: A cell cannot be read.
        """
        ends = first, last
        source = "tests WHERE test BETWEEN ? AND ? AND status NOT NULL ORDER BY test"
        columns = self._selected(source, ends, "test")
        if self.count("runs") > 1:
            # SQLite takes the other columns from the row with the maximum, that of the run it was
            # made for.
            query = f"""
                SELECT test, run, point, max((run - 1) * {ROOM} + point = test)
                FROM tests JOIN plan USING (test)
                WHERE test BETWEEN ? AND ? AND status NOT NULL GROUP BY test ORDER BY test
            """
            rows = self.db.execute(query, ends)
            points = np.fromiter(rows, [(name, np.int64) for name in (*NUMBERS, "is_own")])
            columns |= {name: points[name] for name in NUMBERS}
        return columns

    def tests_of_run(self, run: int, first: int, last: int) -> Columns:
        """Return the tests of test points ``first`` to ``last`` of a run, in their order."""
        return self._selected(f"{_OF_RUN} ORDER BY point", (run, first, last), "point")

    def tests_with(self, numbers: Integers) -> Columns:
        """Return tests by their numbers."""
        source = "tests WHERE test IN (SELECT value FROM json_each(?)) ORDER BY test"
        return self._selected(source, (json.dumps(numbers.tolist()),), "test")

    def _selected(self, source: str, arguments: Sequence[Any], point: str) -> Columns:
        """Return tests of a source in SQL; ``point`` is an expression for their points."""
        expressions = ["test", "1", point]
        kinds: list[tuple[str, Any]] = [(name, np.int64) for name in NUMBERS]
        for name, (sql, kind) in self._columns.items():
            # With the table: SQLite takes a quoted name that is no column for a text.
            expressions.append(f"tests.{sql}")
            kinds.append((name, DTYPES[kind]))
        expressions += ["status", "coalesce(reason, '')"]
        kinds += [(name, np.object_) for name in ("status", "reason")]
        with intact(self.db, self._path):
            query = f"SELECT {', '.join(expressions)} FROM {source}"
            cells = np.fromiter(self.db.execute(query, arguments), kinds)
        return {name: np.ascontiguousarray(cells[name]) for name, _ in kinds}

    def test_numbers(self) -> Integers:
        """Return the numbers of the tests."""
        return self._integers("SELECT test FROM tests WHERE status NOT NULL")

    def other_numbers(self, run: int) -> dict[int, int]:
        """Return the numbers of the tests of a run's points that are not those of the points."""
        query = "SELECT point, test FROM plan WHERE run = ? AND test <> point"
        return dict(self.db.execute(query, (run,)))

    def test_points(self, run: int, first: int, last: int = LAST) -> Integers:
        """Return the test points of a run from ``first`` to ``last`` with a test, increasing."""
        return self._integers(f"SELECT point FROM {_OF_RUN} ORDER BY point", run, first, last)

    def count(self, rows: str) -> int:
        """Return how many rows there are in SQL."""
        return int(self._integers(f"SELECT count(*) FROM {rows}")[0])

    def _integers(self, query: str, *arguments: Any) -> Integers:
        """Return the integers of a column."""
        return np.fromiter((row[0] for row in self.db.execute(query, arguments)), np.int64)


# What is a study


def require_study(db: sqlite3.Connection, path: str) -> None:
    """Make sure that a file is a study; it may hold further tables, views and indices."""
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application == _APPLICATION and version != _VERSION:
        raise StudyCorruptError(
            f"study {path} has format {version}, but this version of pymoo-psi reads format "
            f"{_VERSION}; use the version that made it, or export it as CSV with that one"
        )
    query = "SELECT name FROM sqlite_master WHERE type = 'table'"
    tables = [name for (name,) in db.execute(query) if not name.startswith("sqlite_")]
    if application != _APPLICATION and tables:
        raise _of_others(path, tables)
    for name in _TABLES:
        if name not in tables:
            raise unreadable(path, f"it lacks the table {name}")
    for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'"):
        raise StudyCorruptError(
            f"study {path} has the trigger {name}, which would change what a run stores; it "
            f'was left as it is: remove the trigger (DROP TRIGGER "{name}")'
        )


# Databases of other programs by a table that they have, and how to export it.
_OTHERS = {
    "trial_values": (
        "Optuna",
        "optuna.load_study(study_name=None, storage='sqlite:///FILE').trials_dataframe()"
        ".to_csv('trials.csv')",
    ),
    "driver_iterations": (
        "OpenMDAO",
        "pandas.DataFrame([{**case.get_design_vars(), **case.get_objectives()} for case in "
        "openmdao.api.CaseReader('FILE').get_cases('driver')]).map(numpy.squeeze)"
        ".to_csv('cases.csv')",
    ),
}


def _of_others(path: str, tables: Sequence[str]) -> StudyCorruptError:
    """Return the error of a database of another program."""
    program = f"another program, with the tables {', '.join(tables):.80}"
    export = f"sqlite3 -header -csv FILE 'SELECT * FROM {tables[0]}' > designs.csv"
    for table, known in _OTHERS.items():
        if table in tables:
            program, export = known
    return StudyCorruptError(
        f"{path} is no study of pymoo-psi, but a database of {program}; it was left as it is: "
        f"export it as CSV by "
        f"{export.replace('FILE', path)}"
    )


# Columns in SQL


def _with_names_in_sql(names: Mapping[str, str], columns: Sequence[str]) -> dict[str, str]:
    """Return the names in SQL of columns, which they keep whatever the order of a later head is."""
    names = dict(names)
    taken = {*NOT_VALUES, *_FACTS, *_OTHER_NAMES, *map(str.lower, names.values())}
    for column in columns:
        if column not in names:
            names[column] = column
            while names[column].lower() in taken:  # SQL takes "a" and "A" for one name
                names[column] += "_"
            taken.add(names[column].lower())
    return names


def _columns_in_sql(head: Head, names: Mapping[str, str]) -> dict[str, tuple[str, Kind]]:
    """Return the columns of values by name: their quoted names in SQL, and their kinds."""
    kinds = dict.fromkeys(head.get("notes", ()), Kind.CHOICE)
    kinds |= zip(head["variables"], map(Kind, head["kinds"]), strict=True)
    columns = {}
    for name in columns_of_head(head):
        quoted = names[name].replace('"', '""')
        columns[name] = (f'"{quoted}"', kinds.get(name, Kind.REAL))
    return columns


def _changes(before: Mapping[int, Any], after: Mapping[int, Any]) -> dict[int, Any]:
    """Return the entries that are new or have another value."""
    return {key: value for key, value in after.items() if before.get(key) != value}


def _cells(column: AnyArray) -> list[Any]:
    """Return the cells of a column as SQLite has them: NaN is NULL."""
    cells: list[Any] = column.tolist()
    if column.dtype.kind == "f":
        for row in np.flatnonzero(np.isnan(column)):
            cells[row] = None
    return cells


def _text(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
