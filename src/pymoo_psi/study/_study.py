"""The study file: an SQLite database of tables that any program can read.

- ``tests`` has one row for each test: ``test_point``, its number; ``status``; ``reason``, why it
  failed; ``origin``, where its design comes from; ``seconds``, the time of its evaluation (the mean
  of designs that were evaluated together); then variables, objectives, constraints and outputs
  under their names. A name that is taken gets ``_`` appended. NaN is NULL, binary variables are 0
  and 1, choices are texts. ``row_checksum`` is that of what a row holds but origin and seconds, see
  ``_checksum``: a cell that was changed, by whatever, is noticed when it is read.
- ``proposals`` has designs that an algorithm is going to test, with a checksum, too.
- ``study`` has the facts about the whole file: names, and values as JSON; and their checksum.

Real numbers are in columns without a type, which keep all their bits: a column of type REAL would
turn -0.0 into 0.0.

SQLite does the transactions, the recovery after a kill and the locks between readers and a commit,
with its rollback journal. At rest the file itself holds everything. Unlike SQLite's write-ahead
log, the journal also works on file systems that several machines share.
"""

from __future__ import annotations

import json
import os
import random
import secrets
import sqlite3
import sys
import threading
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from datetime import datetime, timezone
from os import PathLike
from pathlib import Path
from typing import IO, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._output import whole_file
from pymoo_psi._validation import (
    AnyArray,
    Integers,
    Mask,
    Received,
    Rows,
    counted,
    flat,
    identity_text,
    invalid,
    wrong_type,
)
from pymoo_psi.errors import (
    PsiError,
    StudyAccessError,
    StudyCorruptError,
    StudyLockedError,
    StudyMismatchError,
    StudyVersionError,
)
from pymoo_psi.study._checksum import checksums, text_checksum

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

Head: TypeAlias = Mapping[str, Any]
Facts: TypeAlias = dict[str, Any]
Columns: TypeAlias = dict[str, AnyArray]
Proposal: TypeAlias = tuple[int, int, str, dict[str, Any]]
"""The number of a test, the round in which it was proposed, the algorithm that proposed it, and
what else the algorithm keeps, including the design."""

LAST = 2**63 - 1  # the largest number of a test point

SUFFIX = ".db"  # of the studies in a folder
_APPLICATION = 0x50534931
_VERSION = 5  # 4 is that of pymoo-psi 0.3, 1 to 3 are those of 0.1 and 0.2
_UNCHECKED = 4  # without checksums; the next commit adds them
_SCHEMA = f"""
PRAGMA application_id = {_APPLICATION};
PRAGMA user_version = {_VERSION};
CREATE TABLE study (name TEXT PRIMARY KEY, value TEXT);
CREATE TABLE proposals
    (test_point INTEGER PRIMARY KEY, round INTEGER, origin TEXT, content TEXT, checksum INTEGER);
CREATE TABLE tests
    (test_point INTEGER PRIMARY KEY, status TEXT, reason TEXT, origin TEXT, seconds REAL,
    row_checksum INTEGER);
"""
_FIXED = ("test_point", "status", "reason", "origin", "seconds", "row_checksum")
_CHECKSUM = "checksum"  # of all other facts
_UNNAMED = ""  # the name of the checksums among columns, which no column has
_TYPES = {Kind.INTEGER: "INTEGER", Kind.BINARY: "INTEGER", Kind.CHOICE: "TEXT"}
_AT_A_TIME = 65_536  # rows in memory as Python's objects
_PATIENCE = 60.0  # seconds that a commit waits for readers, and readers for a commit
# Seconds between two attempts to lock a study, the first ones and the later ones: hundreds of
# writers must not keep a shared file system busy.
_FIRST_PAUSE, _LAST_PAUSE = 0.02, 0.3
# A plain BEGIN would take the write lock at the first change only, after reading.
_READ = "BEGIN"
_WRITE = "BEGIN IMMEDIATE"


class Study:
    """A study file, given by its name; it can be copied, pickled and shared by threads.

    The tests of a block are committed together, or none of them. They stay, whatever happens to
    the process later. Reading changes nothing and waits for a commit at most.

    A study knows no tables, only their heads, of values that JSON can hold, and their columns.

    Attributes:
        path: The absolute path of the file.
        wait: Seconds to wait for other processes that are writing the study.
    """

    def __init__(self, path: str | PathLike[str], *, wait: float = 10.0) -> None:
        if not isinstance(path, (str, PathLike)) or not os.fspath(path):
            raise wrong_type("study path", "the name of a file", path)
        self.path = os.path.realpath(path)
        for suffix in (*_JOURNALS, "-shm", _LOCK):
            if self.path.endswith(suffix):
                raise invalid(
                    "study path",
                    "another name than those of journals and locks of studies",
                    self.path,
                )
        self.wait = wait
        self._id: str | None = None  # of the study that was used; another file may take its place

    def begin(self, head: Head, share: tuple[int, int] | None = None) -> None:
        """Create the file, or make sure that an existing one belongs to the same problem.

        Args:
            head: ``variables``, ``objectives``, ``inequalities``, ``equalities``: names;
                ``kinds``: "real", "integer", "binary" or "choice" for each variable; and whatever
                else identifies the problem. Outputs are added by the tests.
            share: For a share of an investigation: its part and the number of parts. Its folder is
                made if necessary; the other studies in it must belong to the same problem and have
                the same number of parts.

        Raises:
            StudyMismatchError: The file belongs to another problem; the message says what differs.
            StudyError: The file is damaged, no study, of another version, or cannot be made or
                read.
            ArgumentTypeError: JSON cannot hold the head.
        """
        facts = {"head": json.loads(identity_text(head))}
        if share is not None:
            facts["share"] = [*share]
            folder = os.path.dirname(self.path)
            with _reported(self.path):
                os.makedirs(folder, exist_ok=True)
            for path in studies_in(folder):
                require_alike(path, Study(path).facts(), facts)
        if not os.path.exists(self.path):
            with self.writing():
                # The previous owner of the lock may have made it meanwhile.
                if not os.path.exists(self.path):
                    _create(self.path, facts)
        self._id = None
        require_alike(self.path, self.facts(), facts)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Keep other processes from writing while the body runs, so that none repeats its work.

        Without it, :meth:`append` does so for each block. It may be nested. Threads of this process
        wait for one another.

        Raises:
            StudyLockedError: Another process is writing. A killed process does not hold the lock.
            StudyAccessError: The folder cannot be written.
        """
        # By process, too, since a fork inherits the entries, but not the locks.
        key = (os.getpid(), self.path)
        # setdefault is one step: two threads never get a lock each.
        thread_lock = _THREAD_LOCKS.setdefault(key, threading.RLock())
        with thread_lock:
            if key in _HELD:  # nested
                yield
                return
            with _locked(self.path, self.wait):
                _HELD.add(key)
                try:
                    yield
                finally:
                    _HELD.remove(key)
                    with suppress(OSError):  # Windows removes no open file
                        os.unlink(self.path + _LOCK)

    def append(
        self, columns: Columns, *, origin: str | None = None, seconds: ArrayLike | None = None
    ) -> int:
        """Commit a block of n tests; after the return they are on the disk.

        A test that is already stored with the same values is skipped, even if one of the two lacks
        an output. A test that is stored as failed is replaced by its repetition. No other stored
        test can be changed.

        Args:
            columns: Columns of n cells: ``test_point``, the numbers; the variables, objectives and
                constraints by name, choices as texts; ``status``; ``reason``, texts; and the
                outputs of the model, numbers, which may differ from block to block.
            origin: Where the designs come from.
            seconds: How long the evaluation of a design took, one number or ``(n,)``.

        Returns:
            The number of tests that were new or replaced.

        Raises:
            StudyMismatchError: Another study has taken the place of this one.
            ArgumentValueError: A test is stored with other values.
            StudyLockedError: Another process is writing.
            StudyAccessError: The disk is full, or file or folder cannot be written.
            StudyCorruptError: The file is damaged.
        """
        with self.writing(), self._transaction(_WRITE) as (db, facts):
            head = facts["head"]
            new = _new_tests(db, self.path, facts, columns)
            if new.any():
                wider_head = _with_outputs(head, columns)
                if wider_head != head:
                    _add_columns(db, wider_head, present=_columns(head))
                    _put(db, head=wider_head)
                new_columns = {name: column[new] for name, column in columns.items()}
                new_seconds = np.full(len(new), seconds, dtype=np.float64)[new]
                _insert(db, wider_head, new_columns, origin, new_seconds)
        return int(new.sum())

    def facts(self) -> dict[str, Any]:
        """Return the facts about the whole file: ``head``, ``id``, ``begun``, ``share``.

        Raises:
            StudyMismatchError: Another study has taken the place of this one.
            StudyVersionError: Another version of the package wrote the file.
            StudyCorruptError: The file is damaged, or no study.
            StudyAccessError: The file does not exist or cannot be read.
        """
        with self._transaction(_READ) as (_, facts):
            return facts

    def contents(self, first: int = 1, count: int = LAST) -> tuple[dict[str, Any], Columns]:
        """Return the facts and the stored tests, both of the same moment.

        Args:
            first: Number of the first test point.
            count: Number of test points from there on.

        Returns:
            The facts, and the columns of the tests in the order of their numbers; see
            :meth:`append`.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self._transaction(_READ) as (db, facts):
            return facts, _selected(db, facts, first, first + count - 1)

    def numbers(self, first: int = 1, *, failed: bool = True) -> Integers:
        """Return the numbers of the stored tests, increasing.

        Args:
            first: Number of the first test point.
            failed: Whether failed tests are included.

        Raises:
            StudyError: As :meth:`facts`.
        """
        source = "FROM tests WHERE test_point >= ?"
        if not failed:
            source += " AND status <> 'failed'"
        with self._transaction(_READ) as (db, _):
            ends = f"SELECT count(*), min(test_point), max(test_point) {source}"
            n, least, greatest = db.execute(ends, (first,)).fetchone()
            if n > 0 and greatest - least + 1 == n:  # no need to read each of them
                return np.arange(least, greatest + 1, dtype=np.int64)
            rows = db.execute(f"SELECT test_point {source} ORDER BY test_point", (first,))
            return np.fromiter((number for (number,) in rows), np.int64)

    def propose(self, proposals: Sequence[Proposal]) -> list[Proposal]:
        """Commit designs that are going to be tested, unless others are stored under their numbers.

        Args:
            proposals: The proposals in the order of their numbers.

        Returns:
            The proposals that are stored under these numbers now.

        Raises:
            StudyError: As :meth:`append`.
        """
        with self.writing(), self._transaction(_WRITE) as (db, facts):
            stored = _proposals(db, facts, proposals[0][0], proposals[-1][0])
            if stored:
                return stored
            for number, proposed_in, origin, content in proposals:
                row = (number, proposed_in, origin, json.dumps(content, ensure_ascii=False))
                insert = "INSERT INTO proposals VALUES (?, ?, ?, ?, ?)"
                db.execute(insert, (*row, text_checksum(row)))
        return list(proposals)

    def proposals(self, first: int, count: int) -> list[Proposal]:
        """Return the proposals among the ``count`` test points from number ``first``.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self._transaction(_READ) as (db, facts):
            return _proposals(db, facts, first, first + count - 1)

    @contextmanager
    def _transaction(self, begin: str) -> Iterator[tuple[sqlite3.Connection, Facts]]:
        """Yield a connection in a transaction, and the facts of what is still the same study.

        If the body raises, its changes are undone.
        """
        with _reported(self.path):
            if not os.path.isfile(self.path):
                raise StudyAccessError(f"study {self.path} does not exist; check the name")
            _require_own_files(self.path)
            # "rw" also to read: SQLite then undoes what a killed writer has left, and takes a file
            # that must not be written as read-only. isolation_level=None: Python's module would
            # begin transactions by itself.
            uri = f"{Path(self.path).as_uri()}?mode=rw"
            connected = sqlite3.connect(uri, uri=True, timeout=_PATIENCE, isolation_level=None)
            with closing(connected) as db:
                db.execute("PRAGMA synchronous = EXTRA")  # a commit outlives a power failure
                db.execute("PRAGMA cell_size_check = ON")  # damage is reported, not read as content
                db.execute(begin)
                facts = _facts(db, self.path)
                if self._id not in (None, facts["id"]):
                    raise StudyMismatchError(
                        f"study {self.path} is not the one that this run began or continued: "
                        "another has taken its place, and was left as it is; put the right file "
                        "back, or run again to continue this one"
                    )
                if begin == _WRITE and facts["format"] == _UNCHECKED:
                    _add_checksums(db, facts)
                yield db, facts
                db.execute("COMMIT")
        self._id = facts["id"]


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
    stored_head = json.loads(identity_text({"problem": None, **head}))
    _create(file, {"head": _with_outputs(stored_head, columns)}, columns)


def studies_in(folder: str | PathLike[str]) -> list[str]:
    """Return the paths of the studies in a folder, sorted."""
    return sorted(map(str, Path(folder).glob(f"*{SUFFIX}")))


# The file


@contextmanager
def _reported(path: str) -> Iterator[None]:
    """Turn errors of SQLite, of the system and of unreadable content into errors of a study."""
    try:
        yield
    except PsiError:
        raise
    except (sqlite3.OperationalError, OSError) as error:
        problem = getattr(error, "strerror", None) or error
        raise StudyAccessError(
            f"study {path} cannot be used: {problem}; see that its folder exists, that you may "
            "write it, that the disk is not full, and that no other program keeps it busy; what "
            "was stored before is kept"
        ) from error
    except (sqlite3.DatabaseError, LookupError, TypeError, ValueError) as error:
        raise _unreadable(path, str(error)) from error


# Names beside a study: SQLite's journals, and what they begin with; see its file format.
_JOURNALS = {"-journal": b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", "-wal": b"\x37\x7f\x06"}


def _require_own_files(path: str) -> None:
    """Refuse foreign files with the names of journals of a study, which SQLite would remove."""
    for suffix, beginning in _JOURNALS.items():
        with suppress(FileNotFoundError), open(path + suffix, "rb") as file:
            start = file.read(len(beginning))
            # Zeros stand in a journal until all of it is on the disk.
            if start.strip(b"\0") and start != beginning:
                raise _foreign(path + suffix, f"a journal of the study {path}")


def _foreign(path: str, kind: str) -> StudyAccessError:
    problem = f"{path} has the name of {kind}, and is something else"
    return StudyAccessError(f"{problem}; it was left as it is: move it away")


def _unreadable(path: str, problem: str) -> StudyCorruptError:
    return StudyCorruptError(
        f"{path} is no study of pymoo-psi, or damaged: {problem:.80}; it was left as it is: "
        "restore it from a copy, or move it away and repeat the runs that it held"
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


def _facts(db: sqlite3.Connection, path: str) -> Facts:
    """Return the facts of a study after making sure that the file is one, and nothing else."""
    (application,) = db.execute("PRAGMA application_id").fetchone()
    (version,) = db.execute("PRAGMA user_version").fetchone()
    if application == _APPLICATION and version not in (_UNCHECKED, _VERSION):
        remedy = "install a later one"
        if version < _VERSION:
            remedy = "continue it with pymoo-psi 0.2.0, or export it as CSV with that version"
        raise StudyVersionError(
            f"study {path} has format {version}, but this version of pymoo-psi reads formats "
            f"{_UNCHECKED} and {_VERSION}; {remedy}"
        )
    # Other items, such as triggers, are refused: SQLite would run them by itself.
    query = "SELECT name, type FROM sqlite_master WHERE name NOT LIKE 'sqlite!_%' ESCAPE '!'"
    items = dict(db.execute(query))
    tables = dict.fromkeys(("study", "proposals", "tests"), "table")
    if application != _APPLICATION or items != tables:
        others = [f"the {kind} {name}" for name, kind in items.items() - tables.items()]
        raise _unreadable(path, f"it holds {', '.join(others) or 'no tests'}")
    texts = _texts(db)
    if version == _UNCHECKED and _CHECKSUM in texts:
        raise _unreadable(path, "the number of its format was changed")
    if version == _VERSION and texts.pop(_CHECKSUM, "") != str(text_checksum(texts)):
        raise _unreadable(path, "what it says of its columns was changed")
    facts = {name: json.loads(value) for name, value in texts.items()}
    _columns(facts["head"])  # a damaged head raises here
    facts["format"] = version
    return facts


def _texts(db: sqlite3.Connection) -> dict[str, str]:
    """Return the facts as they are stored, in the order of their names."""
    return dict(db.execute("SELECT name, value FROM study ORDER BY name"))


def _put(db: sqlite3.Connection, **facts: Any) -> None:
    insert = "INSERT OR REPLACE INTO study VALUES (?, ?)"
    for name, value in facts.items():
        db.execute(insert, (name, json.dumps(value, ensure_ascii=False)))
    texts = _texts(db)
    texts.pop(_CHECKSUM, None)
    db.execute(insert, (_CHECKSUM, str(text_checksum(texts))))


def _add_checksums(db: sqlite3.Connection, facts: Facts) -> None:
    """Make the format of version 0.3 the present one."""
    db.execute("ALTER TABLE tests ADD COLUMN row_checksum INTEGER")
    db.execute("ALTER TABLE proposals ADD COLUMN checksum INTEGER")
    columns = _selected(db, facts, 1, LAST)
    rows = zip(checksums(columns).tolist(), columns["test_point"].tolist(), strict=True)
    db.executemany("UPDATE tests SET row_checksum = ? WHERE test_point = ?", rows)
    for row in db.execute("SELECT test_point, round, origin, content FROM proposals").fetchall():
        update = "UPDATE proposals SET checksum = ? WHERE test_point = ?"
        db.execute(update, (text_checksum(row), row[0]))
    _put(db)
    db.execute(f"PRAGMA user_version = {_VERSION}")
    facts["format"] = _VERSION


def _proposals(db: sqlite3.Connection, facts: Facts, first: int, last: int) -> list[Proposal]:
    query = "SELECT * FROM proposals WHERE test_point BETWEEN ? AND ? ORDER BY test_point"
    proposals = []
    for row in db.execute(query, (first, last)):
        number, proposed_in, origin, content = row[:4]
        if facts["format"] == _VERSION and text_checksum(row[:4]) != row[4]:
            raise ValueError(f"the proposal of test point {number} was changed")
        proposals.append((number, proposed_in, origin, json.loads(content)))
    return proposals


# Tests


def _columns(head: Head) -> dict[str, tuple[str, Kind]]:
    """Return for each name its column, quoted for SQL, and the kind of its cells."""
    kinds = dict(zip(head["variables"], map(Kind, head["kinds"]), strict=True))
    columns = {}
    taken = {*_FIXED}
    for group in ("variables", "objectives", "inequalities", "equalities", "outputs"):
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


def _with_outputs(head: Head, columns: Columns) -> dict[str, Any]:
    """Return a head with the outputs that tests have."""
    columns_of_head = {*_FIXED[:3], *_columns(head)}
    outputs = [*head.get("outputs", ())]
    for name in columns:
        if name not in columns_of_head:
            outputs.append(name)
    if not outputs:
        return dict(head)
    return {**head, "outputs": outputs}


def _new_tests(db: sqlite3.Connection, path: str, facts: Facts, columns: Columns) -> Mask:
    """``(n,)`` which tests are new or repeat failed ones.

    Raises:
        ArgumentValueError: A test that did not fail would change.
    """
    numbers = columns["test_point"]
    stored = _selected(db, facts, int(numbers.min(initial=LAST)), int(numbers.max(initial=0)))
    _, rows, stored_rows = np.intersect1d(numbers, stored["test_point"], return_indices=True)
    differ = differing(stored, stored_rows, columns, rows)
    changed = numbers[rows][differ & (stored["status"][stored_rows] != "failed")]
    if len(changed):
        raise invalid(
            "block",
            "of new test points, repetitions of failed ones, or what is stored",
            Received(f"other values for test point {changed[0]}"),
            f"use another file if the model has changed; study {path} is as it was",
        )
    new = np.ones(len(numbers), dtype=bool)
    new[rows[~differ]] = False
    return new


def differing(columns: Columns, rows: Rows, others: Columns, other_rows: Rows) -> Mask:
    """``(n,)`` which of n pairs of tests differ in a value that both have."""
    differ = np.zeros(len(rows), dtype=bool)
    for name in columns.keys() & others.keys():
        one = columns[name][rows]
        other = others[name][other_rows]
        differ |= (one != other) & (one == one) & (other == other)  # NaN differs from itself
    return differ


def _insert(
    db: sqlite3.Connection, head: Head, columns: Columns, origin: str | None, seconds: ArrayLike
) -> None:
    """Write tests, in place of those with their numbers."""
    n = len(columns["test_point"])
    names = [*_FIXED]
    reasons = np.where(columns["reason"] == "", np.array(None), columns["reason"])
    values_by_name = {}
    for name, (column, kind) in _columns(head).items():
        # NaN where these tests lack an output.
        values = columns.get(name, np.full(n, np.nan))
        names.append(column)
        values_by_name[name] = values.astype(DTYPES[kind])
    stored = {**values_by_name}
    for name in ("test_point", "status", "reason"):
        stored[name] = columns[name]
    cells = [
        columns["test_point"],
        columns["status"],
        reasons,
        np.full(n, origin, dtype=object),
        np.full(n, seconds, dtype=np.float64),
        checksums(stored),
        *values_by_name.values(),
    ]
    marks = ", ".join("?" * len(cells))
    insert = f"INSERT OR REPLACE INTO tests ({', '.join(names)}) VALUES ({marks})"
    for start in range(0, n, _AT_A_TIME):
        block = [column[start : start + _AT_A_TIME].tolist() for column in cells]
        db.executemany(insert, zip(*block, strict=True))


def _selected(db: sqlite3.Connection, facts: Facts, first: int, last: int) -> Columns:
    """Return the tests with numbers from ``first`` to ``last``, in the order of their numbers.

    Raises:
        ValueError: A row has another checksum.
    """
    # By name: what is selected, and the type of its cells.
    terms: dict[str, tuple[str, Any]] = {"test_point": ("test_point", np.int64)}
    for name, (column, kind) in _columns(facts["head"]).items():
        # With the table: SQLite takes a quoted name that is no column for a text.
        terms[name] = (f"tests.{column}", DTYPES[kind])
    terms["status"] = ("status", np.object_)
    terms["reason"] = ("coalesce(reason, '')", np.object_)
    if facts["format"] == _VERSION:
        terms[_UNNAMED] = ("row_checksum", np.int64)
    cursor = db.execute(
        f"SELECT {', '.join(term for term, _ in terms.values())} "
        "FROM tests WHERE test_point BETWEEN ? AND ? ORDER BY test_point",
        (min(first, LAST), min(last, LAST)),
    )
    parts = {name: [np.array([], dtype)] for name, (_, dtype) in terms.items()}
    for rows in iter(lambda: cursor.fetchmany(_AT_A_TIME), []):
        for name, cells in zip(terms, zip(*rows, strict=True), strict=True):
            _, dtype = terms[name]
            parts[name].append(np.array(cells, dtype))
    columns = {name: np.concatenate(part) for name, part in parts.items()}
    stored = columns.pop(_UNNAMED, None)
    if stored is not None:
        changed = columns["test_point"][stored != checksums(columns)]
        if len(changed):
            raise ValueError(f"{counted(len(changed), 'test')} changed, the first {changed[0]}")
    return columns


# One writer at a time: a locked file beside the study. The operating system releases the lock when
# its process ends, however it ends.

_LOCK = ".pymoo-psi-lock"  # appended to the name of the study
# By process and study: the lock among the threads, and which studies the process holds.
_THREAD_LOCKS: dict[tuple[int, str], Any] = {}
_HELD: set[tuple[int, str]] = set()


def _locked(path: str, wait: float) -> IO[str]:
    """Return the open lock file of a study, locked for this process."""
    lock = path + _LOCK
    deadline = time.monotonic() + wait
    pause = _FIRST_PAUSE
    while True:
        with _reported(path):
            file = open(lock, "a")  # noqa: SIM115
        if file.tell() > 0:
            file.close()
            raise _foreign(lock, f"the lock of the study {path}")
        try:
            _lock(file.fileno())
            # The name may have passed to another file since this one was opened.
            if os.path.samestat(os.stat(lock), os.fstat(file.fileno())):
                return file
        except (BlockingIOError, PermissionError, FileNotFoundError):
            pass  # another process has it, or has removed it
        except OSError as error:
            file.close()
            raise StudyAccessError(
                f"study {path} cannot be used: its file system refuses locks ({error.strerror}), "
                "without which two processes could write at once; mount it with locks, or put the "
                "study on another file system"
            ) from error
        file.close()
        left = deadline - time.monotonic()
        if left <= 0:
            raise StudyLockedError(
                f"study {path} is being written by another process; waited {wait:g} s: "
                "let it finish or stop it, wait longer by study_wait, or use another file"
            )
        # At random times, so that of many processes that began together none is always too late.
        time.sleep(min(left, pause * random.uniform(0.5, 1.5)))
        pause = min(1.5 * pause, _LAST_PAUSE)


def _lock(descriptor: int) -> None:
    """Lock an open file for this process; an OSError says that another process has locked it.

    A fork does not inherit record locks of POSIX, so that no worker keeps the lock of its parent.
    """
    if sys.platform == "win32":
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


# Heads

# Entries that studies of version 0.3 do not have, and are not compared in.
_SINCE_0_4 = ("problem.parameters.hidden and linked files", "problem.functions")
_ASKED = ("limits", "ranges", "normalize", "chosen")  # entries of the formulation


def require_alike(path: str, facts: Facts, others: Facts, where: str = "asked") -> None:
    """Refuse a study of another problem, or of another number of shares.

    Args:
        path: The study, for the message.
        facts: The facts of the study.
        others: The facts of the problem, or of another study.
        where: Where these come from, for the message.

    Raises:
        StudyMismatchError: The facts differ.
    """
    stored = _compared(facts)
    other = _compared(others)
    for name in _SINCE_0_4:
        if name not in stored:
            other.pop(name, None)
    differences = []
    for name in {**stored, **other}:
        one = stored.get(name, "absent")
        two = other.get(name, "absent")
        if one != two:
            differences.append(f"{name} is {one:.120} in the study, {two:.120} {where}")
    if "share" in facts and "share" in others and facts["share"][1] != others["share"][1]:
        differences = [f"it is one of {facts['share'][1]} shares, not of {others['share'][1]}"]
    if differences:
        raise StudyMismatchError(
            f"study {path} belongs to another problem or search: {'; '.join(differences[:4])}. "
            "Give the name of another file, or the problem (and study_key) with which it was begun"
        )


def _compared(facts: Facts) -> dict[str, str]:
    """Return what must agree, as JSON, in which NaN is NaN and 2 is not 2.0.

    The name of the problem comes first, as it says most; outputs are those of the tests so far, and
    a formulation says how the tests are asked, not what they are.
    """
    head = {"problem": None, **facts["head"], "outputs": None}
    for name in _ASKED:
        head.pop(name, None)
    return flat(head)
