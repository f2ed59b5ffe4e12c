"""A study in a transaction: its tables in SQL, and what is read and changed in them.

The rule for tests is that of the table itself, UNIQUE (design, repeat): whichever run wants a
design gets the test that there is. ``plan`` says which test each point of a run has. A block of
tests first goes into a temporary table, in which SQLite finds out what is known of them.
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
from pymoo_psi._validation import Columns, Head, Integers, Mask, Received, Values, invalid
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
from pymoo_psi.study._integrity import SCHEMA, intact, reported

LAST = 2**63 - 1  # the largest number of a test

_TYPES = {Kind.INTEGER: "INTEGER", Kind.BINARY: "INTEGER", Kind.CHOICE: "TEXT"}

# The tests of points of a run.
_OF_RUN = "plan JOIN tests USING (test) WHERE run = ? AND point BETWEEN ? AND ? AND status NOT NULL"
# Columns of blocks and plan.
_JOINED = ("block_point", "block_number", "block_differs", "point", "proposal")
# A block of tests to be written, where SQLite finds what is known of them. It has the columns of
# ``tests``; ``test`` is NULL where no test is known. Besides there are ``block_point``, the point
# of a test; ``block_number``, the number that it gets if it is new; and ``block_differs``, whether
# the known test has not failed and has other results. It is kept for the next block, as SQLite
# prepares its statements anew for another one.
_BLOCK = """
    CREATE TEMP TABLE IF NOT EXISTS block AS
    SELECT 0 AS block_point, 0 AS block_number, 0 AS block_differs, * FROM tests LIMIT 0
"""
_WITH_PLANNED_TESTS = """
    UPDATE block SET test = (SELECT test FROM plan WHERE run = ? AND point = block_point)
"""
# Each test is a further one of its design.
_WITH_FURTHER_REPEATS = """
    UPDATE block SET repeat = counted.further FROM (
        SELECT rowid AS row, row_number() OVER (PARTITION BY design ORDER BY rowid)
            + (SELECT max(0, coalesce(max(repeat), 0)) FROM tests WHERE design = b.design)
            AS further
        FROM block AS b) AS counted
    WHERE block.rowid = counted.row
"""
# Other runs look for the first test of a design, which is missing while it is corrected.
_WITH_FIRST_REPEATS = """
    UPDATE block SET repeat = 1
    WHERE rowid IN (SELECT min(rowid) FROM block GROUP BY design)
        AND NOT EXISTS (SELECT 1 FROM tests WHERE design = block.design AND repeat = 1)
"""
# A design of a noisy model that recurs in the run is tested again for its point.
_WITH_RECURRING_DESIGNS = """
    UPDATE block SET repeat = -block_number WHERE test IS NULL AND (
        (design, repeat) IN
            (SELECT design, repeat FROM plan JOIN tests USING (test) WHERE run = ?)
        OR rowid NOT IN (SELECT min(rowid) FROM block GROUP BY design))
"""
# New designs have the stored tests of the same designs.
_WITH_TESTS_OF_DESIGNS = """
    UPDATE block SET test = coalesce(
        (SELECT test FROM tests WHERE design = block.design AND repeat = block.repeat), {})
    WHERE test IS NULL
"""
_CONTRADICTED = """
    SELECT point FROM block CROSS JOIN plan
    ON run = ? AND point = block_point AND plan.test = block.test WHERE block_differs
"""
_WITH_FREE_NUMBERS = """
    UPDATE block SET block_number = rowid
        + max((SELECT max(test) FROM tests), (SELECT max(block_number) FROM block))
    WHERE test IS NULL AND block_number IN (SELECT test FROM tests)
"""
_PLANNED = """
    INSERT INTO plan (run, point, test)
    SELECT ?, block_point, test FROM block WHERE test NOT NULL
    ON CONFLICT (run, point) DO UPDATE SET test = excluded.test
    WHERE test IS NOT excluded.test
"""
_OF_SQLITE = ("rowid", "oid", "_rowid_", "true", "false")  # names with a meaning of their own
_OF_TEST = ("design", "repeat", "status", "reason", "origin", "seconds")


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
        self.db.executescript(SCHEMA)
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
        steering[number - 1 : number] = [new | request]
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

    def add_proposal(self, run: int, proposal: Proposal, test: int | None = None) -> None:
        """Write a proposal of a run, and the number of its test if it has one already."""
        point, *entries = proposal
        self.db.execute("INSERT INTO plan VALUES (?, ?, ?, ?)", (run, point, test, _text(entries)))

    def proposals(self, run: int, first: int = 1, last: int = LAST) -> list[Proposal]:
        """Return the proposals of a run from test point ``first`` to ``last``."""
        proposals = self.assigned("run = ? AND point BETWEEN ? AND ?", run, first, last)
        return [proposal for *_, proposal in proposals]

    def assigned(self, where: str = "test", *arguments: int) -> list[tuple[int, int, Proposal]]:
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
        design = {name: np.array([value]) for name, value in proposal.content["design"].items()}
        # Without a key: until it is made, others may test the same design.
        design["test_point"] = np.array([proposal.test_point])
        self._begin_block(run, design, [None])
        self._write_new()
        test = int(self._integers("SELECT test FROM block")[0])
        self.add_proposal(run, proposal, test)
        return test, proposal

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
        self.db.execute("DROP TABLE IF EXISTS temp.block")  # as its columns may be others
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
        """Write tests of a run; return how many are new or changed; see :meth:`Study.append`."""
        self.widen(columns)
        self._begin_block(run, columns, self.keys(columns), repeat, noisy=noisy)
        wrong = self._contradicted(run)
        if len(wrong):
            raise invalid(
                "block",
                "of new test points, repetitions of failed ones, or what is stored",
                Received(f"other values for test point {wrong[0]} of run {run}"),
                f"use another file if the model has changed; study {self._path} is as it was",
            )
        n_changed = self._write_known()
        n_written = n_changed + self._write_new()
        if n_changed and repeat:  # people's own tests are planned, or in the log already
            self.log(f"run {run}", changed=n_changed)
        self.db.execute(_PLANNED, (run,))
        if n_written:
            process = [platform.node(), os.getpid()]
            if self.get("process") != process:
                self._set("process", process)
        return n_written

    def adopt(
        self, run: int, points: Integers, keys: Sequence[str], repeat: int, *, noisy: bool
    ) -> None:
        """Plan the tests that there are for points of a run with the same designs."""
        self._begin_block(run, {"test_point": points}, keys, repeat, noisy=noisy)
        self.db.execute(_PLANNED, (run,))

    def number_by_points(self) -> None:
        """Give each test of the only run the number of the first of its points."""
        self.db.execute("""
            UPDATE tests SET test = -first FROM
                (SELECT test AS number, min(point) AS first FROM plan GROUP BY test)
            WHERE number = test AND first < test
        """)
        self.db.execute("UPDATE tests SET test = -test WHERE test < 0")  # now none is taken

    def find(self, keys: Sequence[str]) -> Integers:
        """Return the first tests of n designs by their keys, 0 where there is none."""
        query = """
            SELECT coalesce((SELECT test FROM tests WHERE design = value AND repeat = 1), 0)
            FROM json_each(?) ORDER BY key
        """
        return self._integers(query, json.dumps(keys))

    def keys(self, columns: Columns) -> Sequence[str | None]:
        """Return a key of the design of each test; ``None`` if there are no variables."""
        head = self.head
        designs = [columns[name] for name in head["variables"]]
        if not designs:  # no design is another's
            return [None] * len(columns["test_point"])
        return keys_of_designs(designs, [*map(Kind, head["kinds"])])

    # Blocks of tests, in the order of the steps

    def _begin_block(
        self,
        run: int,
        columns: Columns,
        keys: Sequence[str | None],
        repeat: int = 1,
        *,
        noisy: bool = False,
    ) -> None:
        """Put tests into the table of a block, and find what is known of them."""
        points = columns["test_point"]
        numbers = columns.get("test", (run - 1) * ROOM + points)
        cells = {"block_point": points.tolist(), "block_number": numbers.tolist(), "design": keys}
        cells |= self._cells(columns) | {"repeat": [repeat] * len(points)}
        self.db.execute(_BLOCK)
        self.db.execute("DELETE FROM block")
        marks = ", ".join("?" * len(cells))
        rows = zip(*cells.values(), strict=True)
        self.db.executemany(f"INSERT INTO block ({', '.join(cells)}) VALUES ({marks})", rows)
        self.db.execute(_WITH_PLANNED_TESTS, (run,))
        if repeat == 0:
            self.db.execute(_WITH_FURTHER_REPEATS)
            self.db.execute(_WITH_FIRST_REPEATS)
        elif noisy:
            self.db.execute(_WITH_RECURRING_DESIGNS, (run,))
        self.db.execute(_WITH_TESTS_OF_DESIGNS.format("NULL"))

    def _contradicted(self, run: int) -> Integers:
        """Compare tests with the known ones; return points of the run that have other results.

        Values differ only where both tests have one.
        """
        self.db.execute(f"""
            UPDATE block SET block_differs = (
                SELECT tests.status <> 'failed' AND (block.status = 'failed'
                    OR coalesce(({self._row("tests.{}")}) <> ({self._row("block.{}")}), 0))
                FROM tests WHERE tests.test = block.test)
            WHERE test NOT NULL
        """)
        return self._integers(_CONTRADICTED, run)

    def _row(self, cell: str) -> str:
        """Return the values as a row in SQL, which may have none."""
        return ", ".join(["0", *(cell.format(sql) for sql, _ in self._columns.values())])

    def _write_known(self) -> int:
        """Add values that known tests lack, and replace failed and planned ones; return how many.

        A failed test that is made again stays the same one of its design.
        """
        names = self._written()
        completed = ", ".join(f"{name} = coalesce(tests.{name}, block.{name})" for name in names)
        replaced = ", ".join(f"{name} = block.{name}" for name in names)
        n_completed = self.db.execute(f"""
            UPDATE tests SET {completed} FROM block
            WHERE tests.test = block.test AND tests.status <> 'failed' AND NOT block_differs
                AND ({self._row("coalesce(tests.{0}, block.{0})")}) IS NOT ({self._row("tests.{}")})
        """).rowcount
        return (
            n_completed
            + self.db.execute(f"""
            UPDATE tests SET {replaced},
                repeat = iif(tests.status IS NULL, block.repeat, tests.repeat)
            FROM block
            WHERE tests.test = block.test AND (tests.status IS NULL OR tests.status = 'failed'
                AND (block.status <> 'failed' OR tests.reason <> block.reason))
        """).rowcount
        )

    def _written(self) -> list[str]:
        """Return the columns that known tests take from a block."""
        values = [sql for sql, _ in self._columns.values()]
        return ["design", "status", "reason", "origin", "seconds", *values]

    def _write_new(self) -> int:
        """Write the new tests; return how many there are."""
        self.db.execute(_WITH_FREE_NUMBERS)
        names = ", ".join(["repeat", *self._written()])
        n_written = self.db.execute(f"""
            INSERT INTO tests (test, {names})
            SELECT block_number, {names} FROM block WHERE test IS NULL ORDER BY rowid
            ON CONFLICT (design, repeat) DO NOTHING
        """).rowcount
        self.db.execute(_WITH_TESTS_OF_DESIGNS.format("block_number"))
        return n_written

    def _cells(self, columns: Columns) -> dict[str, list[Any]]:
        """Return columns of tests as lists by their names in SQL."""
        cells: dict[str, list[Any]] = {}
        for name in ("status", "origin", "seconds"):
            if name in columns:
                cells[name] = columns[name].tolist()
        if "reason" in columns:
            cells["reason"] = [reason or None for reason in columns["reason"].tolist()]
        for name, (sql, kind) in self._columns.items():
            if name in columns:
                cells[sql] = columns[name].astype(DTYPES[kind]).tolist()
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

    def tests_of_points(self, run: int) -> dict[int, int]:
        """Return the tests of the points of a run."""
        return dict(self.db.execute("SELECT point, test FROM plan WHERE run = ?", (run,)))

    def test_points(self, run: int, first: int) -> Integers:
        """Return the test points of a run with a test, from ``first`` on, increasing."""
        return self._integers(f"SELECT point FROM {_OF_RUN} ORDER BY point", run, first, LAST)

    def count(self, rows: str) -> int:
        """Return how many rows there are in SQL."""
        return int(self._integers(f"SELECT count(*) FROM {rows}")[0])

    def _integers(self, query: str, *arguments: Any) -> Integers:
        """Return the integers of a column."""
        return np.fromiter((row[0] for row in self.db.execute(query, arguments)), np.int64)


def _with_names_in_sql(names: Mapping[str, str], columns: Sequence[str]) -> dict[str, str]:
    """Return the names in SQL of columns, which they keep whatever the order of a later head is."""
    names = dict(names)
    taken = {*NOT_VALUES, *_OF_TEST, *_JOINED, *_OF_SQLITE, *map(str.lower, names.values())}
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


def _text(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
