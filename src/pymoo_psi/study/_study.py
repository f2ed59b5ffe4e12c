"""The study file: an SQLite database of tables that any program can read.

``tests`` has one row a test: ``test_point``, its number; ``status``; ``reason``, why it failed;
``origin``, where its design comes from; ``seconds``, what its evaluation took (the mean of designs
evaluated together); then variables, objectives, constraints and outputs under their names, with
``_`` behind a name that is taken. NaN is NULL, binary variables are 0 and 1, choices are texts.
``proposals`` has designs that an algorithm is going to test. ``study`` has names and values, as
JSON, of what holds for the whole file.

A real number is in a column without a type, which keeps all its bits: one of type REAL would turn
-0.0 into 0.0.

Transactions, recovery after a kill and the locks between readers and a commit are SQLite's, with
its rollback journal: at rest the file itself holds everything, and file systems shared by several
machines are no obstacle, as they are for its write-ahead log.
"""

from __future__ import annotations

import json
import os
import secrets
import socket
import sqlite3
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from datetime import datetime, timezone
from os import PathLike
from pathlib import Path
from typing import IO, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._output import whole_file
from pymoo_psi._validation import Received, flat, identity_text, integer, invalid, wrong_type
from pymoo_psi.errors import (
    StudyAccessError,
    StudyCorruptError,
    StudyError,
    StudyLockedError,
    StudyMismatchError,
    StudyVersionError,
)

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

Head: TypeAlias = Mapping[str, Any]
Columns: TypeAlias = dict[str, NDArray[Any]]
# The number of a test, the round in which and by what it was proposed, and what else is known.
Proposal: TypeAlias = tuple[int, int, str, dict[str, Any]]

LAST = 2**63 - 1  # the largest number of a test point

_APPLICATION = 0x50534931  # "PSI1", in the header of the file
_VERSION = 4  # of the tables, also in the header; 1 to 3 are those of pymoo-psi 0.1 and 0.2
_FIXED = {
    "test_point": "INTEGER PRIMARY KEY", "status": "TEXT", "reason": "TEXT", "origin": "TEXT",
    "seconds": "REAL",
}  # fmt: skip
_TABLES = {
    "proposals": "(test_point INTEGER PRIMARY KEY, round INTEGER, origin TEXT, content TEXT)",
    "study": "(name TEXT PRIMARY KEY, value TEXT)",
}
_TYPES = {Kind.INTEGER: "INTEGER", Kind.BINARY: "INTEGER", Kind.CHOICE: "TEXT"}
_GOLDEN = 2_654_435_769  # 2^32 divided by the golden ratio, rounded to an odd number
_AT_A_TIME = 65_536  # rows in memory as Python's objects
_PATIENCE = 60.0  # seconds for readers to end their query before a commit, and for that commit


class Study:
    """A study file, by name: it may be copied, pickled, sent to processes and shared by threads.

    The tests of a block are committed together, or none of them. They stay, whatever happens to
    the process later. Reading waits for a commit at most and changes nothing.

    A study knows no tables, only their head, of values that JSON can hold, and their columns.

    Attributes:
        path: The file; an absolute path, whatever was given.
        wait: Seconds to wait for another process that is writing the study.
    """

    def __init__(self, path: str | PathLike[str], *, wait: float = 10.0) -> None:
        if not isinstance(path, (str, PathLike)) or not os.fspath(path):
            raise wrong_type("study path", "the name of a file", path)
        self.path: str = os.path.realpath(path)
        self.wait = wait
        self._seen: str | None = None  # its id, by which another file in its place is noticed

    def begin(
        self, head: Head, share: tuple[int, int] | None = None, points: tuple[int, int] = (1, 1)
    ) -> None:
        """Create the file, or make sure that the one that is there belongs to the same problem.

        Args:
            head: ``variables``, ``objectives``, ``inequalities``, ``equalities``: names;
                ``kinds``: "real", "integer", "binary" or "choice" for each variable; and what
                else makes the problem what it is, but for its outputs, which tests bring.
            share: Which of how many shares of an investigation the file is, if it is one. Its
                folder is made if there is none; the other studies in it must belong to the same
                problem, too, and be shares of as many.
            points: First and last test point of that investigation, kept to tell what is missing.

        Raises:
            StudyMismatchError: The file belongs to another problem; the message says what differs.
            StudyError: It is damaged, no study, of another version, or cannot be made or read.
            ArgumentTypeError: JSON cannot hold the head.
        """
        asked = json.loads(identity_text(head))
        own: dict[str, Any] = {} if share is None else {"share": [*share], "points": [*points]}
        others, of = list[str](), share and share[1]
        if share is not None:
            folder = os.path.dirname(self.path)
            with _reported(self.path):
                os.makedirs(folder, exist_ok=True)
            others = [path for path in studies_in(folder) if path != self.path]
        for path in others:
            _require_alike(path, Study(path).facts(), asked, of)
        with nullcontext() if os.path.exists(self.path) else self.writing():
            # Again, as the owner of the lock before may have made it.
            if not os.path.exists(self.path):
                _create(self.path, {"head": asked, **own})
        self._seen = None
        facts = self.facts()
        _require_alike(self.path, facts, asked, of)
        if share is not None:
            if facts.get("share") != own["share"]:
                raise StudyMismatchError(
                    f"study {self.path} must be share {own['share']}, and is none; move it away"
                )
            (first, last), (begun, end) = points, facts["points"]
            if first < begun or last > end:
                with self._transaction(write=True) as (db, _):
                    _put(db, points=[min(first, begun), max(last, end)])

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Keep others from writing while the body runs, so that none repeats its work.

        Without it, :meth:`append` does so for the time of one block. It may be nested. Threads of
        this process wait for their turn.

        Raises:
            StudyLockedError: Another process is writing; the message says which, where, and since
                when. One that was killed does not count.
            StudyAccessError: The folder cannot be written.
        """
        # setdefault is one step: two threads never get a lock each. By process, too, as a fork
        # inherits the entries, but not the locks.
        lock = _LOCKS.setdefault((os.getpid(), self.path), _Lock())
        with lock.thread:
            if lock.file is not None:  # nested
                yield
                return
            lock.file = _locked(self.path, self.wait)
            try:
                yield
            finally:
                with suppress(OSError):  # Windows removes no open file
                    os.unlink(self.path + _LOCK)
                lock.file.close()
                lock.file = None

    def append(
        self, columns: Columns, *, origin: str | None = None, seconds: ArrayLike | None = None
    ) -> int:
        """Commit a block of n tests; after the return they are on the disk.

        A test that is stored already with the same values is left alone, also if one of both lacks
        an output. One that is stored as failed is replaced by its repetition. No other stored test
        can be changed.

        Args:
            columns: ``(n,)`` each: ``test_point``, the numbers; the variables, objectives and
                constraints by name, choices as texts; ``status``; ``reason``, texts; and numbers
                that the model gives besides, its outputs, which may be others each time.
            origin: Where the designs come from.
            seconds: What the evaluation of a design took, one number or ``(n,)``.

        Returns:
            How many tests were new or replaced.

        Raises:
            StudyMismatchError: Another study has taken its place.
            ArgumentValueError: A test is stored with other values.
            StudyLockedError: Another process is writing.
            StudyAccessError: The disk is full, or file or folder cannot be written.
            StudyCorruptError: The file is damaged.
        """
        with self._transaction(write=True) as (db, facts):
            head = facts["head"]
            new = _unknown(db, self.path, head, columns)
            if new.any():
                wider = _with_outputs(head, columns)
                for name in list(_sql_columns(wider))[len(_sql_columns(head)) :]:
                    db.execute(f"ALTER TABLE tests ADD COLUMN {_quoted(name)}")
                _put(db, head=wider)
                took = np.full(len(new), np.nan if seconds is None else seconds)
                chosen = {name: column[new] for name, column in columns.items()}
                _insert(db, wider, chosen, origin, took[new])
        return int(new.sum())

    def columns(self, first: int, count: int) -> Columns:
        """Return the stored tests among the ``count`` test points from number ``first``.

        Raises:
            StudyMismatchError: Another study has taken its place.
            StudyError: The file is damaged or cannot be read.
        """
        return self.contents(first, count)[1]

    def facts(self) -> dict[str, Any]:
        """Return what holds for the whole file: ``head``, ``id``, ``begun``, ``share``, ….

        Raises:
            StudyError: As :meth:`columns`.
        """
        with self._transaction() as (_, facts):
            return facts

    def contents(self, first: int = 1, count: int = LAST) -> tuple[dict[str, Any], Columns]:
        """Return the facts, and the tests that :meth:`columns` returns, of one moment, by number.

        Raises:
            StudyError: As :meth:`columns`.
        """
        with self._transaction() as (db, facts):
            return facts, _selected(db, self.path, facts["head"], first, first + count - 1)

    def propose(self, proposals: Sequence[Proposal]) -> list[Proposal]:
        """Commit designs that are going to be tested, unless others are stored under their numbers.

        Args:
            proposals: Number, round, origin, and what else is known of each, as JSON can hold it;
                by number.

        Returns:
            The proposals that are stored under these numbers now.

        Raises:
            StudyError: As :meth:`append`.
        """
        with self._transaction(write=True) as (db, _):
            if stored := _proposals(db, proposals[0][0], proposals[-1][0]):
                return stored
            rows = [(*row, json.dumps(content, ensure_ascii=False)) for *row, content in proposals]
            db.executemany("INSERT INTO proposals VALUES (?, ?, ?, ?)", rows)
        return list(proposals)

    def proposals(self, first: int, count: int) -> list[Proposal]:
        """Return what is proposed of the ``count`` test points from number ``first``.

        Raises:
            StudyError: As :meth:`columns`.
        """
        with self._transaction() as (db, _):
            return _proposals(db, first, first + count - 1)

    @contextmanager
    def _transaction(
        self, *, write: bool = False
    ) -> Iterator[tuple[sqlite3.Connection, dict[str, Any]]]:
        """Give a connection in a transaction, and the facts of what is still the same study."""
        with self.writing() if write else nullcontext(), _connected(self.path) as db:
            # A plain BEGIN would take SQLite's write lock at the first change only, after reading.
            db.execute("BEGIN IMMEDIATE" if write else "BEGIN")
            facts = _facts(db, self.path)
            if self._seen not in (None, facts["id"]):
                raise StudyMismatchError(
                    f"study {self.path} is not the one that this run began or continued: another "
                    "has taken its place, and was left as it is; put the right file back, or run "
                    "again to continue this one"
                )
            yield db, facts
            db.execute("COMMIT")
        self._seen = facts["id"]


def read_study(path: str | PathLike[str]) -> tuple[dict[str, Any], Columns]:
    """Return the head and all tests of a study, by number.

    Returns:
        The head with which it was begun, and the columns of its tests; see :class:`Study`.

    Raises:
        StudyCorruptError: The file is damaged, or no study.
        StudyVersionError: Another version wrote it.
        StudyAccessError: It does not exist or cannot be read.
    """
    facts, columns = Study(path).contents()
    return facts["head"], columns


def write_study(path: str | PathLike[str], head: Head, columns: Columns) -> None:
    """Write tests as a new study, whole or not at all; see :class:`Study` for head and columns.

    Raises:
        StudyAccessError: There is a file of that name, or none can be written.
        ArgumentValueError: There are too many columns.
    """
    file = Study(path).path
    if os.path.lexists(file):
        raise StudyAccessError(
            f"study {file} exists already and was left as it is; give the name of a new file"
        )
    known = json.loads(identity_text({"problem": None, **head}))
    _create(file, {"head": _with_outputs(known, columns)}, columns)


def studies_in(folder: str) -> list[str]:
    """Return the studies in a folder, the files named ``*.db``."""
    with _reported(folder):
        names = sorted(os.listdir(folder))
    return [os.path.join(folder, name) for name in names if name.endswith(".db")]


# The file


@contextmanager
def _reported(path: str) -> Iterator[None]:
    """Turn errors of SQLite and the system in the body into ours, which name the file."""
    try:
        yield
    except (sqlite3.DatabaseError, UnicodeDecodeError, OSError) as error:
        if isinstance(error, (StudyError, sqlite3.ProgrammingError)):
            raise
        # By their texts, since Python 3.10 does not show SQLite's codes.
        text = (isinstance(error, OSError) and error.strerror) or str(error)
        if "is locked" in text:
            raise StudyLockedError(
                f"study {path} is kept busy by another program; close that program, then run again"
            ) from error
        if "not a database" in text:
            raise _foreign(path) from error
        system = ("is full", "disk I/O", "readonly", "unable to open", "too many")
        if isinstance(error, OSError) or any(words in text for words in system):
            raise StudyAccessError(
                f"study {path} cannot be used: {text}; see that its folder exists, that you may "
                "write it, and that there is room; what was stored before is kept"
            ) from error
        raise _corrupt(path, text) from error


def _corrupt(path: str, what: str) -> StudyCorruptError:
    return StudyCorruptError(
        f"study {path} is damaged: {what:.80}; it was left as it is: restore it from a copy, "
        "or move it away and run again what it held"
    )


def _foreign(path: str) -> StudyCorruptError:
    return StudyCorruptError(
        f"{path} must be a study file of pymoo-psi, but it is none, or its first bytes are "
        "damaged; it was left as it is: give the name of another file, or move this one away"
    )


@contextmanager
def _connected(path: str) -> Iterator[sqlite3.Connection]:
    """Give a connection; what the body has not committed is undone."""
    with _reported(path):
        if not os.path.isfile(path):
            what = "is no file" if os.path.exists(path) else "does not exist"
            raise StudyAccessError(f"study {path} {what}; check the name")
        # "rw" also to read: SQLite then undoes what a killed writer has left, and takes a file that
        # must not be written as read-only. isolation_level=None: Python's module would begin
        # transactions by itself.
        uri = f"{Path(path).as_uri()}?mode=rw"
        db = sqlite3.connect(uri, uri=True, timeout=_PATIENCE, isolation_level=None)
        with closing(db):
            db.execute("PRAGMA synchronous = EXTRA")  # a commit outlives a power failure
            db.execute("PRAGMA cell_size_check = ON")  # damage is reported, not read as content
            yield db


def _create(path: str, facts: Mapping[str, Any], columns: Columns | None = None) -> None:
    """Make a study file, whole or not at all."""
    now = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
    with (
        _reported(path),
        whole_file(path) as new,
        closing(sqlite3.connect(new, isolation_level=None)) as db,
    ):
        db.execute("PRAGMA journal_mode = OFF")  # the file is thrown away if anything happens
        db.execute("BEGIN")
        db.execute(f"PRAGMA application_id = {_APPLICATION}")
        db.execute(f"PRAGMA user_version = {_VERSION}")
        tests = {**_FIXED, **_sql_columns(facts["head"])}
        listed = ", ".join(f"{_quoted(name)} {type_}" for name, type_ in tests.items())
        for name, made in {**_TABLES, "tests": f"({listed})"}.items():
            db.execute(f"CREATE TABLE {name} {made}")
        _put(db, id=secrets.token_hex(16), begun=now, **facts)
        if columns is not None:
            _insert(db, facts["head"], columns, None, np.nan)
        db.execute("COMMIT")


def _facts(db: sqlite3.Connection, path: str) -> dict[str, Any]:
    """Return the facts of a study after making sure that the file is one, and nothing else."""
    names = ("application_id", "user_version")
    mark, version = (db.execute(f"PRAGMA {name}").fetchone()[0] for name in names)
    if mark != _APPLICATION:
        raise _foreign(path)
    if version != _VERSION:
        older = "continue it with pymoo-psi 0.2.0, or export it as CSV with that version"
        raise StudyVersionError(
            f"study {path} has format {version}, but this version of pymoo-psi reads format "
            f"{_VERSION}; {older if version < _VERSION else 'install a later one'}"
        )
    # What SQLite would run by itself, such as a trigger, is not used.
    own = {"tests", *_TABLES}
    made = "SELECT type, name FROM sqlite_master WHERE name NOT LIKE 'sqlite!_%' ESCAPE '!'"
    for kind, name in db.execute(made):
        if kind != "table" or name not in own:
            raise _corrupt(path, f"it holds the {kind} {name!r:.40}, which is none of its own")
    try:
        facts = {n: json.loads(v) for n, v in db.execute("SELECT name, value FROM study")}
        facts["id"], _ = str(facts["id"]), _sql_columns(facts["head"])
    except (TypeError, ValueError, KeyError) as error:
        raise _corrupt(path, f"its head cannot be read ({error!r})") from error
    return facts


def _put(db: sqlite3.Connection, **facts: Any) -> None:
    rows = [(name, json.dumps(value, ensure_ascii=False)) for name, value in facts.items()]
    db.executemany("INSERT OR REPLACE INTO study VALUES (?, ?)", rows)


def _proposals(db: sqlite3.Connection, first: int, last: int) -> list[Proposal]:
    query = "SELECT * FROM proposals WHERE test_point BETWEEN ? AND ? ORDER BY test_point"
    return [(*row, json.loads(content)) for *row, content in db.execute(query, (first, last))]


# Tests


def _kinds(head: Head) -> dict[str, Kind]:
    """Return what each variable, objective, constraint and output is, by name."""
    others = ("objectives", "inequalities", "equalities", "outputs")
    kinds = dict(zip(head["variables"], map(Kind, head["kinds"]), strict=True))
    return kinds | {name: Kind.REAL for group in others for name in head.get(group, ())}


def _sql_columns(head: Head) -> dict[str, str]:
    """Return SQL's columns of what a head names, and their types."""
    columns: dict[str, str] = {}
    taken = {*_FIXED}
    for name, kind in _kinds(head).items():
        while name.lower() in taken:  # SQL takes "a" and "A" for one name
            name += "_"
        taken.add(name.lower())
        columns[name] = _TYPES.get(kind, "")
    return columns


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _with_outputs(head: Head, columns: Columns) -> dict[str, Any]:
    """Return a head with the outputs that tests bring."""
    known = {"test_point", "status", "reason", *_kinds(head)}
    added = [name for name in columns if name not in known]
    return {**head, "outputs": [*head.get("outputs", ()), *added]} if added else dict(head)


def _unknown(db: sqlite3.Connection, path: str, head: Head, columns: Columns) -> NDArray[np.bool_]:
    """``(n,)`` which tests are new or repeat failed ones.

    Raises:
        ArgumentValueError: A test that did not fail would change.
    """
    numbers = columns["test_point"]
    ends = (int(numbers.min()), int(numbers.max())) if len(numbers) else (1, 0)
    stored = _selected(db, path, head, *ends)
    _, here, there = np.intersect1d(numbers, stored["test_point"], return_indices=True)
    shared = columns.keys() & stored.keys()
    pairs = {name: (columns[name][here], stored[name][there]) for name in shared}
    same = ~_differing(pairs, len(here), head.get("outputs", ()))
    for number in numbers[here][~same & (stored["status"][there] != "failed")]:
        rule = "of new test points, repetitions of failed ones, or what is stored"
        found = Received(f"other values for test point {number}")
        remedy = f"use another file if the model has changed; study {path} is as it was"
        raise invalid("block", rule, found, remedy)
    new = np.ones(len(numbers), dtype=bool)
    new[here[same]] = False
    return new


def _differing(
    pairs: Mapping[str, tuple[NDArray[Any], NDArray[Any]]], n: int, outputs: Sequence[str]
) -> NDArray[np.bool_]:
    """``(n,)`` which of two tests differ; an output that one of them lacks is no difference."""
    differ = np.zeros(n, dtype=bool)
    for name, (one, other) in pairs.items():
        # NaN is the value that differs from itself.
        unknown = np.logical_or if name in outputs else np.logical_and
        differ |= ~((one == other) | unknown(one != one, other != other)).astype(bool)
    return differ


def _insert(
    db: sqlite3.Connection, head: Head, columns: Columns, origin: str | None, seconds: ArrayLike
) -> None:
    """Write tests, in place of those with their numbers."""
    n = len(columns["test_point"])
    cells = [
        columns["test_point"].astype(np.int64, casting="safe"),
        columns["status"],
        np.fromiter((reason or None for reason in columns["reason"]), object, n),
        np.full(n, origin, dtype=object),
        np.full(n, seconds, dtype=np.float64),
    ]
    for name, kind in _kinds(head).items():
        # NaN: an output that these tests do not have.
        column = columns[name] if name in columns else np.full(n, np.nan)
        cells.append(column.astype(DTYPES[kind], casting="safe"))
    names = ", ".join(map(_quoted, (*_FIXED, *_sql_columns(head))))
    insert = f"INSERT OR REPLACE INTO tests ({names}) VALUES ({', '.join('?' * len(cells))})"
    for start in range(0, len(cells[0]), _AT_A_TIME):
        part = slice(start, start + _AT_A_TIME)
        db.executemany(insert, zip(*(column[part].tolist() for column in cells), strict=True))


def _selected(db: sqlite3.Connection, path: str, head: Head, first: int, last: int) -> Columns:
    """Return the tests with numbers from ``first`` to ``last``, by number."""
    kinds = _kinds(head)
    names = ["test_point", *kinds, "status", "reason"]
    dtypes = [np.int64, *(DTYPES[kind] for kind in kinds.values()), np.object_, np.object_]
    # A name in double quotes that is no column would be a text, but for the table before it.
    listed = ", ".join(f"tests.{_quoted(name)}" for name in _sql_columns(head))
    cursor = db.execute(
        f"SELECT test_point, {listed}{', ' * bool(listed)}status, coalesce(reason, '') "
        "FROM tests WHERE test_point BETWEEN ? AND ? ORDER BY test_point",
        (min(first, LAST), min(last, LAST)),
    )
    blocks: list[list[NDArray[Any]]] = []
    try:
        while not blocks or len(blocks[-1][0]) == _AT_A_TIME:
            rows = cursor.fetchmany(_AT_A_TIME)
            cells = zip(*rows, strict=True) if rows else [()] * len(names)
            blocks.append([np.array(c, dtype=d) for c, d in zip(cells, dtypes, strict=True)])
    except (TypeError, ValueError, OverflowError) as error:
        raise _corrupt(path, f"a cell is not of its column's type ({error})") from error
    joined = [np.concatenate(parts) for parts in zip(*blocks, strict=True)]
    return dict(zip(names, joined, strict=True))


# One writer at a time: a lock beside the study, a file that says who its owner is. The operating
# system releases it when its process ends, however it ends.

_LOCK = ".pymoo-psi-lock"  # behind the name of the study; nobody else uses it


@dataclass
class _Lock:
    """Whose turn it is among the threads of this process, and the lock that they share."""

    thread: Any = field(default_factory=threading.RLock)
    file: Any = None


_LOCKS: dict[tuple[int, str], _Lock] = {}


def _locked(path: str, wait: float) -> IO[str]:
    """Return the open lock of a study, whose owner is this process now."""
    lock, deadline = path + _LOCK, time.monotonic() + wait
    while True:
        with _reported(path):
            file = open(lock, "a+", encoding="utf-8", errors="replace")  # noqa: SIM115
        with suppress(BlockingIOError, PermissionError, FileNotFoundError):
            _lock(file.fileno())
            # The name may have passed to another file since this one was opened.
            if os.path.samestat(os.stat(lock), os.fstat(file.fileno())):
                now = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
                file.truncate(0)  # what an owner has left that was killed
                file.write(f"process {os.getpid()} on {socket.gethostname()} since {now}")
                file.flush()
                return file
        file.seek(0)
        owner = file.read() or "another process"
        file.close()
        if time.monotonic() >= deadline:
            raise StudyLockedError(
                f"study {path} is being written by {owner}; waited {wait:g} s: "
                "let it finish or stop it, wait longer, or use another file"
            )
        time.sleep(0.05)


def _lock(descriptor: int) -> None:
    """Lock an open file for this process; an OSError says that another has done so.

    A fork does not inherit locks of POSIX records: no worker that outlives its parent keeps them.
    """
    if sys.platform == "win32":
        os.lseek(descriptor, 4096, os.SEEK_SET)  # what lies before can still be read
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


# Heads


def _require_alike(
    path: str, facts: Mapping[str, Any], head: Head, of: int | None = None, there: str = "asked"
) -> None:
    """Refuse a study of another problem, or of another number of shares than ``of``."""
    # NaN is NaN, and 2 is not 2.0.
    a, b = flat(_by_variable(facts["head"])), flat(_by_variable(head))
    differing = [
        f"{name} is {a.get(name, 'absent'):.120} in the study, {b.get(name, 'absent'):.120} {there}"
        for name in {**a, **b}
        if a.get(name) != b.get(name)
    ]
    if of and facts.get("share", (1, of))[1] != of:
        differing = [f"it is one of {facts['share'][1]} shares, not of {of}"]
    if differing:
        raise StudyMismatchError(
            f"study {path} belongs to another problem or search: {'; '.join(differing[:4])}. "
            "Give the name of another file, or the problem (and study_key) with which it was begun"
        )


def _by_variable(head: Head) -> dict[str, Any]:
    """Return what of a head is compared; messages name the variable of a bound, not its index."""
    named = {
        key: dict(zip(head["variables"], head[key], strict=True))
        for key in ("lower", "upper", "kinds")
    }
    # The name of the problem says most. Outputs are those that tests have brought so far.
    return {"problem": None, **head, **named, "outputs": None}


# Shares: the points of one investigation divided among machines, and their files as one study


class Share(NamedTuple):
    """The k-th of n parts of the test points.

    The points are assigned in rounds of n consecutive numbers, of which each share gets one. So the
    first results of all shares together are the beginning of the sequence, which is uniform, a
    longer run extends every share, and whose a point is does not depend on how many there are.

    The k-th share does not get the k-th point of every round: the low binary digits of a number
    are the leading ones of a point of LPτ, so that every 64th point lies in one strip, a 64th of
    the first variable, which would be the hole that a lost share leaves. Each round begins with
    another share instead, by multiples of the golden ratio (Fibonacci hashing, Knuth, The Art of
    Computer Programming 3, section 6.4), and every share alone is spread over the bounds, too.

    Attributes:
        part: Which part, from 1 to ``of``.
        of: How many parts there are.
    """

    part: int
    of: int

    @classmethod
    def checked(cls, value: object) -> Share:
        """Return the share that a user gives as ``(k, n)``.

        Raises:
            ArgumentValueError: There is no k-th of n parts.
            ArgumentTypeError: It is no pair of integers.
        """
        if not isinstance(value, (tuple, list)) or len(value) != 2:
            raise wrong_type("share", "a pair (k, n), the k-th of n parts", value)
        part, of = (integer("k and n of share=(k, n)", v, minimum=1) for v in value)
        if part > of:
            raise invalid("share", "(k, n) with k from 1 to n", Received(f"({part}, {of})"))
        return cls(part, of)

    def __str__(self) -> str:
        """Return "3 of 64"."""
        return f"{self.part} of {self.of}"

    @property
    def file(self) -> str:
        """Name of its file in a folder of studies, sorted by part."""
        return f"share-{self.part:0{len(str(self.of))}}-of-{self.of}.db"

    def rounds(self, first: int, last: int) -> range:
        """Return the rounds, from 0, in which it gets a point between ``first`` and ``last``."""
        start, stop = (first - 1) // self.of, (last - 1) // self.of + 1
        ends = self.numbers(np.array([start, stop - 1]))
        return range(start + int(ends[0] < first), stop - int(ends[1] > last))

    def numbers(self, rounds: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the test points that it gets in rounds."""
        return rounds * self.of + (self.part - 1 + _moved(rounds, self.of)) % self.of + 1


def _moved(rounds: NDArray[np.int64], of: int) -> NDArray[np.int64]:
    """Return by how many places the shares are moved in rounds."""
    # Only the lowest 32 bits of the product count, so that its overflow does no harm.
    moved: NDArray[np.int64] = (rounds * _GOLDEN % 2**32) * of // 2**32
    return moved


ALL = Share(1, 1)  # all points


def read_folder(path: str | PathLike[str]) -> tuple[dict[str, Any], Columns, str]:
    """Return the tests of all studies in a folder as those of one; see :func:`read_study`.

    Returns:
        The head, the columns, and which test points are missing; empty if none are.

    Raises:
        StudyMismatchError: Two of them belong to different problems, or have other results for
            the same test point.
        StudyError: One is damaged, or there is none; the message names the file.
    """
    folder = os.path.realpath(path)
    files = studies_in(folder)
    if not files:
        raise StudyAccessError(f"folder {folder} holds no study; check the name")
    facts, blocks = zip(*(Study(file).contents() for file in files), strict=True)
    head = dict(facts[0]["head"])
    for file, other in zip(files, facts, strict=True):
        _require_alike(file, other, head, there=f"in {files[0]}")
    # A share has the outputs that its tests have brought so far, NaN where they did not.
    outputs = tuple(dict.fromkeys(name for f in facts for name in f["head"].get("outputs", ())))
    head |= {"outputs": list(outputs)} if outputs else {}
    columns = {}
    for name in {**dict.fromkeys(outputs), **blocks[0]}:
        parts = [b.get(name, np.full(len(b["test_point"]), np.nan)) for b in blocks]
        columns[name] = np.concatenate(parts)
    source = np.repeat(np.arange(len(files)), [len(block["test_point"]) for block in blocks])
    # Stable, so that of a test that several files hold the first one is taken.
    order = np.argsort(columns["test_point"], kind="stable")
    columns = {name: column[order] for name, column in columns.items()}
    numbers = columns["test_point"]
    again = np.flatnonzero(numbers[1:] == numbers[:-1]) + 1
    pairs = {name: (column[again], column[again - 1]) for name, column in columns.items()}
    for i in again[_differing(pairs, len(again), ())]:
        one, other = (files[source[order[j]]] for j in (i - 1, i))
        raise StudyMismatchError(
            f"studies {one} and {other} have different results for test point {numbers[i]}; "
            "move the file that is wrong, or older, to another folder"
        )
    columns = {name: np.delete(column, again) for name, column in columns.items()}
    return head, columns, _missing(facts, columns["test_point"])


def _missing(studies: Sequence[Mapping[str, Any]], numbers: NDArray[np.int64]) -> str:
    """Say which test points of an investigation are not stored in any of its shares."""
    known = [facts for facts in studies if "share" in facts]
    if not known:
        return ""
    firsts, lasts = zip(*(facts["points"] for facts in known), strict=True)
    first, last, of = min(firsts), max(lasts), known[0]["share"][1]
    absent = np.setdiff1d(np.arange(first, last + 1), numbers, assume_unique=True)
    if len(absent) == 0:
        return ""
    rounds = (absent - 1) // of
    parts = np.unique((absent - 1 - _moved(rounds, of)) % of + 1)
    return (
        f"{len(absent)} of {last - first + 1} test points are missing, the first is {absent[0]}; "
        f"of {of} shares these lack points: {', '.join(map(str, parts))}"
    )
