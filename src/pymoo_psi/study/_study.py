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
import sqlite3
import sys
import threading
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, nullcontext, suppress
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
    PsiError,
    StudyAccessError,
    StudyCorruptError,
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

# The versions 1 to 3 are those of pymoo-psi 0.1 and 0.2.
_APPLICATION, _VERSION = 0x50534931, 4
_SCHEMA = f"""
PRAGMA application_id = {_APPLICATION};
PRAGMA user_version = {_VERSION};
CREATE TABLE study (name TEXT PRIMARY KEY, value TEXT);
CREATE TABLE proposals (test_point INTEGER PRIMARY KEY, round INTEGER, origin TEXT, content TEXT);
CREATE TABLE tests
    (test_point INTEGER PRIMARY KEY, status TEXT, reason TEXT, origin TEXT, seconds REAL);
"""
_FIXED = ("test_point", "status", "reason", "origin", "seconds")
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

    def begin(self, head: Head, share: tuple[int, int] | None = None) -> None:
        """Create the file, or make sure that the one that is there belongs to the same problem.

        Args:
            head: ``variables``, ``objectives``, ``inequalities``, ``equalities``: names;
                ``kinds``: "real", "integer", "binary" or "choice" for each variable; and what
                else makes the problem what it is, but for its outputs, which tests bring.
            share: Which of how many shares of an investigation the file is, if it is one. Its
                folder is made if there is none; the other studies in it must belong to the same
                problem, too, and be shares of as many.

        Raises:
            StudyMismatchError: The file belongs to another problem; the message says what differs.
            StudyError: It is damaged, no study, of another version, or cannot be made or read.
            ArgumentTypeError: JSON cannot hold the head.
        """
        asked: dict[str, Any] = {"head": json.loads(identity_text(head))}
        if share is not None:
            asked["share"] = [*share]
            folder = os.path.dirname(self.path)
            with _reported(self.path):
                os.makedirs(folder, exist_ok=True)
            for path in sorted(Path(folder).glob("*.db")):
                _require_alike(str(path), Study(path).facts(), asked)
        with nullcontext() if os.path.exists(self.path) else self.writing():
            # Again, as the owner of the lock before may have made it.
            if not os.path.exists(self.path):
                _create(self.path, asked)
        self._seen = None
        _require_alike(self.path, self.facts(), asked)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Keep others from writing while the body runs, so that none repeats its work.

        Without it, :meth:`append` does so for the time of one block. It may be nested. Threads of
        this process wait for their turn.

        Raises:
            StudyLockedError: Another process is writing; one that was killed does not count.
            StudyAccessError: The folder cannot be written.
        """
        # setdefault is one step: two threads never get a lock each. By process, too, as a fork
        # inherits the entries, but not the locks.
        key = os.getpid(), self.path
        with _TURNS.setdefault(key, threading.RLock()):
            if key in _LOCKS:  # nested
                yield
                return
            with _locked(self.path, self.wait) as _LOCKS[key]:
                try:
                    yield
                finally:
                    del _LOCKS[key]
                    with suppress(OSError):  # Windows removes no open file
                        os.unlink(self.path + _LOCK)

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
                _add_columns(db, wider, known=_columns(head))
                _put(db, head=wider)
                seconds = np.full(len(new), seconds, dtype=np.float64)[new]
                chosen = {name: column[new] for name, column in columns.items()}
                _insert(db, wider, chosen, origin, seconds)
        return int(new.sum())

    def facts(self) -> dict[str, Any]:
        """Return what holds for the whole file: ``head``, ``id``, ``begun``, ``share``.

        Raises:
            StudyMismatchError: Another study has taken its place.
            StudyVersionError: Another version wrote it.
            StudyCorruptError: It is damaged, or no study.
            StudyAccessError: It does not exist or cannot be read.
        """
        with self._transaction() as (_, facts):
            return facts

    def contents(self, first: int = 1, count: int = LAST) -> tuple[dict[str, Any], Columns]:
        """Return the facts and the stored tests of one moment.

        Args:
            first: Number of the first test point of interest.
            count: How many test points from there are of interest.

        Returns:
            The facts, and the columns of the tests, by number; see :meth:`append`.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self._transaction() as (db, facts):
            return facts, _selected(db, facts["head"], first, first + count - 1)

    def numbers(self, first: int = 1, *, failed: bool = True) -> NDArray[np.int64]:
        """Return the numbers of the stored tests, increasing.

        Args:
            first: Number of the first test point of interest.
            failed: Whether failed tests are of interest, too.

        Raises:
            StudyError: As :meth:`facts`.
        """
        query = (
            "SELECT test_point FROM tests WHERE test_point >= ? AND (? OR status <> 'failed') "
            "ORDER BY test_point"
        )
        with self._transaction() as (db, _):
            rows = db.execute(query, (first, failed))
            return np.fromiter((number for (number,) in rows), np.int64)

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
            StudyError: As :meth:`facts`.
        """
        with self._transaction() as (db, _):
            return _proposals(db, first, first + count - 1)

    @contextmanager
    def _transaction(
        self, *, write: bool = False
    ) -> Iterator[tuple[sqlite3.Connection, dict[str, Any]]]:
        """Give a connection in a transaction, and the facts of what is still the same study.

        What the body has not finished is undone.
        """
        with self.writing() if write else nullcontext(), _reported(self.path):
            if not os.path.isfile(self.path):
                raise StudyAccessError(f"study {self.path} does not exist; check the name")
            # "rw" also to read: SQLite then undoes what a killed writer has left, and takes a file
            # that must not be written as read-only. isolation_level=None: Python's module would
            # begin transactions by itself.
            uri = f"{Path(self.path).as_uri()}?mode=rw"
            connected = sqlite3.connect(uri, uri=True, timeout=_PATIENCE, isolation_level=None)
            with closing(connected) as db:
                db.execute("PRAGMA synchronous = EXTRA")  # a commit outlives a power failure
                db.execute("PRAGMA cell_size_check = ON")  # damage is reported, not read as content
                # A plain BEGIN would take the write lock at the first change only, after reading.
                db.execute("BEGIN IMMEDIATE" if write else "BEGIN")
                facts = _facts(db, self.path)
                if self._seen not in (None, facts["id"]):
                    raise StudyMismatchError(
                        f"study {self.path} is not the one that this run began or continued: "
                        "another has taken its place, and was left as it is; put the right file "
                        "back, or run again to continue this one"
                    )
                yield db, facts
                db.execute("COMMIT")
        self._seen = facts["id"]


def write_study(path: str | PathLike[str], head: Head, columns: Columns) -> None:
    """Write tests as a new study, whole or not at all; see :class:`Study` for head and columns.

    Raises:
        StudyAccessError: There is a file of that name, or none can be written.
    """
    file = Study(path).path
    if os.path.lexists(file):
        raise StudyAccessError(
            f"study {file} exists already and was left as it is; give the name of a new file"
        )
    known = json.loads(identity_text({"problem": None, **head}))
    _create(file, {"head": _with_outputs(known, columns)}, columns)


# The file


@contextmanager
def _reported(path: str) -> Iterator[None]:
    """Turn errors of SQLite and the system, and of what cannot be read, into ours."""
    try:
        yield
    except PsiError:
        raise
    except (sqlite3.OperationalError, OSError) as error:
        raise StudyAccessError(
            f"study {path} cannot be used: {getattr(error, 'strerror', None) or error}; see that "
            "its folder exists, that you may write it, that the disk is not full, and that no "
            "other program keeps it busy; what was stored before is kept"
        ) from error
    except (sqlite3.DatabaseError, LookupError, TypeError, ValueError) as error:
        raise _unreadable(path, str(error)) from error


def _unreadable(path: str, what: str) -> StudyCorruptError:
    return StudyCorruptError(
        f"{path} is no study of pymoo-psi, or damaged: {what:.80}; it was left as it is: restore "
        "it from a copy, or move it away and run again what it held"
    )


def _create(path: str, facts: Mapping[str, Any], columns: Columns | None = None) -> None:
    """Make a study file, whole or not at all."""
    now = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
    with (
        _reported(path),
        whole_file(path) as new,
        closing(sqlite3.connect(new, isolation_level=None)) as db,
    ):
        # Without a journal, as the file is thrown away if anything happens.
        db.executescript(f"PRAGMA journal_mode = OFF; BEGIN; {_SCHEMA}")
        _add_columns(db, facts["head"])
        _put(db, id=secrets.token_hex(16), begun=now, **facts)
        if columns is not None:
            _insert(db, facts["head"], columns, None, np.nan)
        db.execute("COMMIT")


def _facts(db: sqlite3.Connection, path: str) -> dict[str, Any]:
    """Return the facts of a study after making sure that the file is one, and nothing else."""
    names = ("application_id", "user_version")
    mark, version = (db.execute(f"PRAGMA {name}").fetchone()[0] for name in names)
    if mark == _APPLICATION and version != _VERSION:
        older = "continue it with pymoo-psi 0.2.0, or export it as CSV with that version"
        raise StudyVersionError(
            f"study {path} has format {version}, but this version of pymoo-psi reads format "
            f"{_VERSION}; {older if version < _VERSION else 'install a later one'}"
        )
    # What SQLite would run by itself, such as a trigger, is not used.
    made = "SELECT name, type FROM sqlite_master WHERE name NOT LIKE 'sqlite!_%' ESCAPE '!'"
    held, own = dict(db.execute(made)), dict.fromkeys(("study", "proposals", "tests"), "table")
    if mark != _APPLICATION or held != own:
        more = [f"the {kind} {name}" for name, kind in held.items() - own.items()]
        raise _unreadable(path, f"it holds {', '.join(more) or 'no tests'}")
    facts = {name: json.loads(value) for name, value in db.execute("SELECT * FROM study")}
    _columns(facts["head"])  # what is no head shows here
    return facts


def _put(db: sqlite3.Connection, **facts: Any) -> None:
    rows = [(name, json.dumps(value, ensure_ascii=False)) for name, value in facts.items()]
    db.executemany("INSERT OR REPLACE INTO study VALUES (?, ?)", rows)


def _proposals(db: sqlite3.Connection, first: int, last: int) -> list[Proposal]:
    query = "SELECT * FROM proposals WHERE test_point BETWEEN ? AND ? ORDER BY test_point"
    return [(*row, json.loads(content)) for *row, content in db.execute(query, (first, last))]


# Tests


def _columns(head: Head) -> dict[str, tuple[str, Kind]]:
    """Return the column of each name, as SQL refers to it, and what its cells are."""
    kinds = dict(zip(head["variables"], map(Kind, head["kinds"]), strict=True))
    found: dict[str, tuple[str, Kind]] = {}
    taken = {*_FIXED}
    for group in ("variables", "objectives", "inequalities", "equalities", "outputs"):
        for name in head.get(group, ()):
            column = name
            while column.lower() in taken:  # SQL takes "a" and "A" for one name
                column += "_"
            taken.add(column.lower())
            quoted = column.replace('"', '""')
            found[name] = f'"{quoted}"', kinds.get(name, Kind.REAL)
    return found


def _add_columns(db: sqlite3.Connection, head: Head, known: Collection[str] = ()) -> None:
    for name, (column, kind) in _columns(head).items():
        if name not in known:
            db.execute(f"ALTER TABLE tests ADD COLUMN {column} {_TYPES.get(kind, '')}")


def _with_outputs(head: Head, columns: Columns) -> dict[str, Any]:
    """Return a head with the outputs that tests bring."""
    known = {*_FIXED[:3], *_columns(head)}
    added = [name for name in columns if name not in known]
    return {**head, "outputs": [*head.get("outputs", ()), *added]} if added else dict(head)


def _unknown(db: sqlite3.Connection, path: str, head: Head, columns: Columns) -> NDArray[np.bool_]:
    """``(n,)`` which tests are new or repeat failed ones.

    Raises:
        ArgumentValueError: A test that did not fail would change.
    """
    numbers = columns["test_point"]
    stored = _selected(db, head, int(numbers.min(initial=LAST)), int(numbers.max(initial=0)))
    _, here, there = np.intersect1d(numbers, stored["test_point"], return_indices=True)
    differ = _differing(stored, columns, there, here)
    for number in numbers[here][differ & (stored["status"][there] != "failed")]:
        rule = "of new test points, repetitions of failed ones, or what is stored"
        found = Received(f"other values for test point {number}")
        remedy = f"use another file if the model has changed; study {path} is as it was"
        raise invalid("block", rule, found, remedy)
    new = np.ones(len(numbers), dtype=bool)
    new[here[~differ]] = False
    return new


def _differing(
    stored: Columns, others: Columns, one: NDArray[np.intp], other: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """``(n,)`` which tests, of rows ``one`` and ``other``, differ in what is known of both."""
    differ = np.zeros(len(one), dtype=bool)
    for name in stored.keys() & others.keys():
        a, b = stored[name][one], others[name][other]
        differ |= (a != b) & (a == a) & (b == b)  # NaN, which differs from itself, is unknown
    return differ


def _insert(
    db: sqlite3.Connection, head: Head, columns: Columns, origin: str | None, seconds: ArrayLike
) -> None:
    """Write tests, in place of those with their numbers."""
    n, known = len(columns["test_point"]), _columns(head)
    reasons = np.where(columns["reason"] == "", np.array(None), columns["reason"])
    cells = [columns["test_point"], columns["status"], reasons]
    cells += [np.full(n, origin, dtype=object), np.full(n, seconds, dtype=np.float64)]
    for name, (_, kind) in known.items():
        # NaN: an output that these tests do not have.
        cells.append(columns.get(name, np.full(n, np.nan)).astype(DTYPES[kind]))
    names = ", ".join([*_FIXED, *(column for column, _ in known.values())])
    insert = f"INSERT OR REPLACE INTO tests ({names}) VALUES ({', '.join('?' * len(cells))})"
    for start in range(0, len(cells[0]), _AT_A_TIME):
        part = slice(start, start + _AT_A_TIME)
        db.executemany(insert, zip(*(column[part].tolist() for column in cells), strict=True))


def _selected(db: sqlite3.Connection, head: Head, first: int, last: int) -> Columns:
    """Return the tests with numbers from ``first`` to ``last``, by number."""
    known = _columns(head)
    dtypes = {name: DTYPES[kind] for name, (_, kind) in known.items()}
    dtypes = {"test_point": np.int64, **dtypes, "status": np.object_, "reason": np.object_}
    # A name in double quotes that is no column would be a text, but for the table before it.
    listed = [f"tests.{column}" for column, _ in known.values()]
    cursor = db.execute(
        f"SELECT {', '.join(['test_point', *listed, 'status'])}, coalesce(reason, '') "
        "FROM tests WHERE test_point BETWEEN ? AND ? ORDER BY test_point",
        (min(first, LAST), min(last, LAST)),
    )
    parts = {name: [np.array([], dtype)] for name, dtype in dtypes.items()}
    for rows in iter(lambda: cursor.fetchmany(_AT_A_TIME), []):
        for (name, dtype), cells in zip(dtypes.items(), zip(*rows, strict=True), strict=True):
            parts[name].append(np.array(cells, dtype))
    return {name: np.concatenate(part) for name, part in parts.items()}


# One writer at a time: a lock beside the study. The operating system releases it when its process
# ends, however it ends.

_LOCK = ".pymoo-psi-lock"  # behind the name of the study; nobody else uses it
_TURNS: dict[tuple[int, str], Any] = {}  # whose turn it is among the threads of a process
_LOCKS: dict[tuple[int, str], IO[str]] = {}


def _locked(path: str, wait: float) -> IO[str]:
    """Return the open lock of a study, which is this process's now."""
    lock, deadline = path + _LOCK, time.monotonic() + wait
    while True:
        with _reported(path):
            file = open(lock, "a")  # noqa: SIM115
        with suppress(BlockingIOError, PermissionError, FileNotFoundError):
            _lock(file.fileno())
            # The name may have passed to another file since this one was opened.
            if os.path.samestat(os.stat(lock), os.fstat(file.fileno())):
                return file
        file.close()
        if time.monotonic() >= deadline:
            raise StudyLockedError(
                f"study {path} is being written by another process; waited {wait:g} s: "
                "let it finish or stop it, wait longer, or use another file"
            )
        time.sleep(0.05)


def _lock(descriptor: int) -> None:
    """Lock an open file for this process; an OSError says that another has done so.

    A fork does not inherit locks of POSIX records: no worker that outlives its parent keeps them.
    """
    if sys.platform == "win32":
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


# Heads


def _require_alike(
    path: str, facts: Mapping[str, Any], asked: Mapping[str, Any], there: str = "asked"
) -> None:
    """Refuse a study of another problem, or of another number of shares."""
    # As JSON, NaN is NaN, and 2 is not 2.0. The name of the problem says most; outputs are those
    # that tests have brought so far.
    a, b = (flat({"problem": None, **f["head"], "outputs": None}) for f in (facts, asked))
    differing = [
        f"{name} is {a.get(name, 'absent'):.120} in the study, {b.get(name, 'absent'):.120} {there}"
        for name in {**a, **b}
        if a.get(name) != b.get(name)
    ]
    if len({known["share"][1] for known in (facts, asked) if "share" in known}) > 1:
        differing = [f"it is one of {facts['share'][1]} shares, not of {asked['share'][1]}"]
    if differing:
        raise StudyMismatchError(
            f"study {path} belongs to another problem or search: {'; '.join(differing[:4])}. "
            "Give the name of another file, or the problem (and study_key) with which it was begun"
        )


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

    def numbers(self, first: int, last: int) -> NDArray[np.int64]:
        """Return the test points from ``first`` to ``last`` that it gets, increasing."""
        if self.of == 1:
            return np.arange(first, last + 1)
        rounds = np.arange((first - 1) // self.of, (last - 1) // self.of + 1)
        # Only the lowest 32 bits of the product count, so that its overflow does no harm.
        moved = (rounds * _GOLDEN % 2**32) * self.of // 2**32
        numbers: NDArray[np.int64] = rounds * self.of + (self.part - 1 + moved) % self.of + 1
        return numbers[(first <= numbers) & (numbers <= last)]


ALL = Share(1, 1)  # all points


def read_folder(path: str | PathLike[str]) -> tuple[dict[str, Any], Columns, str]:
    """Return the tests of all studies in a folder as those of one; see :class:`Study`.

    Returns:
        The head, the columns, and which test points are missing; empty if none are.

    Raises:
        StudyMismatchError: Two of them belong to different problems, or have other results for
            the same test point.
        StudyError: One is damaged, or there is none; the message names the file.
    """
    files = sorted(map(str, Path(path).resolve().glob("*.db")))
    if not files:
        raise StudyAccessError(f"folder {os.fspath(path)} holds no study; check the name")
    facts, blocks = zip(*(Study(file).contents() for file in files), strict=True)
    for file, other in zip(files, facts, strict=True):
        _require_alike(file, other, facts[0], there=f"in {files[0]}")
    # A share has the outputs that its tests have brought so far, NaN where they did not.
    outputs = dict.fromkeys(name for f in facts for name in f["head"].get("outputs", ()))
    head = facts[0]["head"] | ({"outputs": [*outputs]} if outputs else {})
    columns = {}
    for name in blocks[0] | outputs:
        parts = [b.get(name, np.full(len(b["test_point"]), np.nan)) for b in blocks]
        columns[name] = np.concatenate(parts)
    source = np.repeat(np.arange(len(files)), [len(block["test_point"]) for block in blocks])
    # Stable, so that of a test that several files hold the first one is taken.
    order = np.argsort(columns["test_point"], kind="stable")
    columns = {name: column[order] for name, column in columns.items()}
    numbers = columns["test_point"]
    again = np.flatnonzero(numbers[1:] == numbers[:-1]) + 1
    for i in again[_differing(columns, columns, again, again - 1)]:
        one, other = (files[source[order[j]]] for j in (i - 1, i))
        raise StudyMismatchError(
            f"studies {one} and {other} have different results for test point {numbers[i]}; "
            "move the file that is wrong, or older, to another folder"
        )
    columns = {name: np.delete(column, again) for name, column in columns.items()}
    of = next((known["share"][1] for known in facts if "share" in known), 1)
    return head, columns, _missing(of, columns["test_point"])


def _missing(of: int, numbers: NDArray[np.int64]) -> str:
    """Say how many test points between those that are stored each share lacks."""
    if of == 1 or len(numbers) == 0:
        return ""
    shares = {k: Share(k, of).numbers(int(numbers[0]), int(numbers[-1])) for k in range(1, of + 1)}
    lack = {k: len(np.setdiff1d(points, numbers)) for k, points in shares.items()}
    lacking = ", ".join(f"{n} of share {Share(k, of)}" for k, n in lack.items() if n)
    ends = f"test points {numbers[0]} and {numbers[-1]}"
    return f"Missing between {ends}: {lacking}" if lacking else ""
