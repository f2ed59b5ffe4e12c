"""The study file: an SQLite database of tables that any program can read.

``tests`` has one row a test: ``number``, ``status``, ``reason`` (why it failed), ``origin`` (where
its design comes from), ``seconds`` (what its evaluation took, the mean of designs evaluated
together); then variables, criteria and constraints under their names, with ``_`` behind a name that
is taken; then two for us, ``negative_zeros`` and ``checksum``; then what else the model gives, its
outputs, each from the first test that has it. ``facts`` has a name and a value, as JSON, for what
holds of the whole study.

Values come back bit for bit. SQLite keeps every float64 but NaN, which is NULL here, and the sign
of -0.0: ``negative_zeros`` lists the columns where it stood. No value of a test is ever missing,
so that NULL means NaN and nothing else; further bits of a NaN are lost. Binary variables are 0
and 1, choices are texts.

What an algorithm has proposed is in a third table, ``proposals``, from before it is tested:
``number``; ``round``; ``origin``, by which surrogate; ``content``, JSON with the point of the unit
cube and the predictions; ``checksum``.

The checksum of a row is of all its cells. The facts hold the number of tests, the exclusive or of
their checksums, and a seal of the facts; they change in the transaction that changes the tests.

The file is in SQLite's WAL mode, so that readers and the writer do not wait for each other. Every
transaction is followed by a checkpoint: at rest the file itself holds everything, and readers
take it as it is, without locks, since SQLite's leave files beside it.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from hashlib import blake2b
from itertools import compress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._files import whole_file
from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._validation import Received, invalid
from pymoo_psi.errors import (
    StudyAccessError,
    StudyCorruptError,
    StudyError,
    StudyLockedError,
    StudyVersionError,
)

T = TypeVar("T")
Head: TypeAlias = Mapping[str, Any]
Columns: TypeAlias = dict[str, NDArray[Any]]
# The number of a test, the round in which and by what it was proposed, and what else is known.
Proposal: TypeAlias = tuple[int, int, str, dict[str, Any]]

APPLICATION = 0x50534931  # "PSI1", in the header of the file
# Of the tables, also in the header. Format 2 is the same but for outputs and criteria that are
# maximised, of which its readers know nothing: it is read, and continued as it is.
VERSION = 3
LAST = 2**63 - 1  # the largest number of a test point

_TYPES = {
    Kind.REAL: "REAL",
    Kind.INTEGER: "INTEGER",
    Kind.BINARY: "BOOLEAN",
    Kind.CHOICE: "TEXT",
}
_FRONT = {
    "number": "INTEGER PRIMARY KEY",
    "status": "TEXT",
    "reason": "TEXT",
    "origin": "TEXT",
    "seconds": "REAL",
}
_BACK = {"negative_zeros": "TEXT", "checksum": "INTEGER"}
MARK = b"SQLite format 3\0"  # how every database of SQLite begins
_MOST_COLUMNS = 2000 - len(_FRONT) - len(_BACK)  # SQLite's limit
AT_A_TIME = 65_536  # rows in memory as Python's objects
_PATIENCE = 30.0  # seconds for the moments in which another connection opens or closes the file
_CHECKPOINT_PATIENCE = 500  # milliseconds, for readers in the middle of a query
_IMMUTABLE = "mode=ro&immutable=1"  # for SQLite
# How the files begin that SQLite keeps beside a database; with zeros, or less, while they grow.
_BESIDE = {
    "-wal": (b"\x37\x7f\x06\x82", b"\x37\x7f\x06\x83"),
    "-shm": (b"\x18\xe2\x2d\x00", b"\x00\x2d\xe2\x18", bytes(4)),
    "-journal": (b"\xd9\xd5\x05\xf9", bytes(4)),
}

_ROOM = "make room, then run again: what was committed before is still there"
_RIGHTS = "check that its folder exists and that you may write the folder and the file"
# SQLite's own texts, since Python 3.10 does not show its error codes.
_ACCESS = {
    "database or disk is full": f"the disk is full; {_ROOM}",
    "disk I/O error": f"the disk or its quota is full, or the device failed; {_ROOM}",
    "readonly database": f"it is read-only; {_RIGHTS}",
    "unable to open database file": f"it cannot be opened; {_RIGHTS}",
}
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def corrupt(path: str, what: str) -> StudyCorruptError:
    """Compose the error for a damaged study; the caller raises it."""
    return StudyCorruptError(
        f"study {path} is damaged: {what}; it was left as it is: restore it from a copy, "
        "or move it away and run again what it held"
    )


def _foreign(path: str, what: str) -> StudyCorruptError:
    return StudyCorruptError(
        f"{path} must be a study file of pymoo-psi, but it is {what}; it was left as it is: "
        "give the name of another file, or move this one away"
    )


@contextmanager
def told(path: str) -> Iterator[None]:
    """Turn errors of SQLite and the system in the body into ours, which name the file.

    Raises:
        StudyLockedError: Another program keeps the file busy.
        StudyAccessError: It cannot be opened, read or written.
        StudyCorruptError: It is damaged, or not a database.
    """
    try:
        yield
    except (StudyError, sqlite3.ProgrammingError, sqlite3.InterfaceError):
        raise  # told already, or a mistake of ours
    except sqlite3.Error as error:
        text = str(error)
        if "is locked" in text:
            raise StudyLockedError(
                f"study {path} is kept busy by another program; close that program, then run again"
            ) from error
        if "not a database" in text:
            raise _foreign(path, "none, or its first bytes are damaged") from error
        for known, meaning in _ACCESS.items():
            if known in text:
                raise StudyAccessError(f"study {path} cannot be used: {meaning}") from error
        raise corrupt(path, f"{text:.80}") from error
    except UnicodeDecodeError as error:  # SQLite quotes damaged text in its message
        raise corrupt(path, "its text cannot be decoded") from error
    except OSError as error:
        rest = _ROOM if error.errno in _FULL else _RIGHTS
        raise StudyAccessError(f"study {path} cannot be used: {error.strerror}; {rest}") from error


# The file


def create(path: str, facts: Head) -> None:
    """Make a study file without tests, whole or not at all; there must be none of that name.

    Raises:
        StudyAccessError: It cannot be written there, or a name beside it is taken.
        ArgumentValueError: It has too many columns.
    """
    columns = ", ".join(f"{_quoted(name)} {type_}" for name, type_ in _sql_columns(facts).items())
    texts = {name: json.dumps(value, ensure_ascii=False) for name, value in facts.items()}
    texts |= {"tests": "0", "checksum": "0"}
    with told(path), whole_file(path) as new, closing(_connected(str(new), "mode=rwc")) as db:
        require_own(path, new=True)
        db.execute("PRAGMA journal_mode = OFF")  # it is thrown away if anything happens
        db.execute("BEGIN")
        db.execute(f"PRAGMA application_id = {APPLICATION}")
        db.execute(f"PRAGMA user_version = {VERSION}")
        db.execute(f"CREATE TABLE tests ({columns})")
        db.execute("CREATE TABLE facts (name TEXT PRIMARY KEY, value TEXT)")
        db.executemany("INSERT INTO facts VALUES (?, ?)", [*texts.items(), ("seal", _seal(texts))])
        db.execute("COMMIT")
        db.execute("PRAGMA journal_mode = WAL")


@contextmanager
def transaction(path: str) -> Iterator[sqlite3.Connection]:
    """Give a connection in a transaction: committed after the body, undone if it raises.

    Raises:
        StudyError: The file is not there, is busy, cannot be written, is damaged.
    """
    with told(path):
        _require_there(path)
        require_own(path)
        if os.stat(path).st_nlink > 1:
            raise StudyAccessError(
                f"study {path} has a second name, a hard link; SQLite keeps its log beside one "
                "name only, and writing by both damages it: continue with a copy"
            )
        with closing(_connected(path, "mode=rw")) as db:
            # NORMAL may lose the last commits of WAL mode in a power failure; append promises more.
            db.execute("PRAGMA synchronous = FULL")
            db.execute("PRAGMA journal_mode = WAL")
            # A plain BEGIN would take the write lock at the first change only, after reading;
            # SQLite then refuses at once, without the timeout, if another connection has written
            # meanwhile.
            db.execute("BEGIN IMMEDIATE")
            try:
                yield db
                if db.total_changes:
                    # In WAL mode SQLite counts only changes of the first page, where this lies.
                    version = db.execute("PRAGMA user_version").fetchone()[0]
                    db.execute(f"PRAGMA user_version = {version}")
                db.execute("COMMIT")
            except BaseException:
                if db.in_transaction:
                    db.execute("ROLLBACK")
                raise
            _checkpoint(db)


def _checkpoint(db: sqlite3.Connection) -> None:
    """Bring the log into the file, or leave that to the next transaction; both are committed.

    A reader in the middle of a query may be in the way, or a full disk.
    """
    with suppress(sqlite3.OperationalError):
        db.execute(f"PRAGMA busy_timeout = {_CHECKPOINT_PATIENCE}")
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()


def read(path: str, query: Callable[[sqlite3.Connection], T]) -> T:
    """Return what a query says of one state of the file, without changing file or log.

    Raises:
        StudyError: See :func:`told`.
    """
    with told(path):
        _require_there(path)
        # immutable: SQLite takes no locks and makes no files beside the study, which may lie in a
        # folder that cannot be written; it also trusts that nothing changes. If a transaction
        # brings its pages into the file meanwhile, the answer, or the damage, is of no state.
        while (before := stamp(path)) is not None:
            try:
                answer = _asked(path, _IMMUTABLE, query)
            except (sqlite3.Error, StudyError, UnicodeDecodeError):
                if before == stamp(path):
                    raise
            else:
                if before == stamp(path):
                    return answer
            # A query of seconds would meet a transaction every time, as long as a run goes on; a
            # copy takes a hundredth of that.
            with TemporaryDirectory() as folder:
                before, copy = stamp(path), os.path.join(folder, "study")
                shutil.copyfile(path, copy)
                if before is not None and before == stamp(path):
                    return _asked(copy, _IMMUTABLE, query)
        require_own(path)
        return _asked(path, "mode=ro", query)


def _asked(path: str, options: str, query: Callable[[sqlite3.Connection], T]) -> T:
    with closing(_connected(path, options)) as db:
        # Cells are checked when their page is read: damage is told before it passes for content.
        db.execute("PRAGMA cell_size_check = ON")
        db.execute("BEGIN")
        return query(db)


def _connected(path: str, options: str) -> sqlite3.Connection:
    """Open a database; ``options`` are those of SQLite's URIs."""
    # isolation_level=None: else Python's module begins transactions by itself where it sees fit.
    uri = f"{Path(path).as_uri()}?{options}"
    return sqlite3.connect(uri, uri=True, timeout=_PATIENCE, isolation_level=None)


def stamp(path: str) -> tuple[Any, ...] | None:
    """Return what every transaction changes; None if not all of the content lies in the file."""
    # A transaction is in the log before it is in the file, and there until all of it is. So the log
    # is looked at between two looks at the file: each sees what changed before or after it.
    while True:
        before = _version(path)
        for suffix in ("-wal", "-journal"):
            with suppress(FileNotFoundError):
                if os.path.getsize(path + suffix):
                    return None
        if before == _version(path):
            return before


def _version(path: str) -> tuple[Any, ...]:
    with open(path, "rb", buffering=0) as file:
        stat, header = os.fstat(file.fileno()), file.read(28)
    # The last four are SQLite's counter of changes. The time alone may stay as it is: clocks of
    # file systems tick every 1 to 10 ms, or every two seconds.
    return header[24:], stat.st_mtime_ns, stat.st_size, stat.st_ino


def is_database(path: str) -> bool:
    """Say whether a file begins as those of SQLite do."""
    with open(path, "rb") as file:
        return file.read(len(MARK)) == MARK


def _require_there(path: str) -> None:
    if not os.path.isfile(path):
        what = "is no file" if os.path.exists(path) else "does not exist"
        raise StudyAccessError(f"study {path} {what}; check the name")


def require_own(path: str, *, new: bool = False) -> None:
    """Keep SQLite from overwriting or removing files beside the study that are not its own."""
    for suffix, beginnings in _BESIDE.items():
        taken = new and os.path.lexists(path + suffix)
        if not new:
            with suppress(FileNotFoundError), open(path + suffix, "rb") as file:
                start = file.read(4)
                taken = not any(known.startswith(start) for known in beginnings)
        if taken:
            raise StudyAccessError(
                f"study {path} cannot be used: beside it lies {path}{suffix}, a name that SQLite "
                "uses; that file was left as it is: move it away, or give the study another name"
            )


# Facts


def stored_facts(db: sqlite3.Connection, path: str) -> dict[str, Any]:
    """Return the facts of a study after making sure that the file is one.

    Of a study of the first format, only that it is one: ``{"format": 1}``.

    Raises:
        StudyVersionError: A later version wrote it.
        StudyCorruptError: It is no study, or damaged.
    """
    if db.execute("PRAGMA application_id").fetchone()[0] != APPLICATION:
        raise _foreign(path, "another file, empty, or damaged in its first bytes")
    version = db.execute("PRAGMA user_version").fetchone()[0]
    if version == 1:
        return {"format": 1}
    try:
        texts = dict(db.execute("SELECT facts.name, facts.value FROM facts"))
        sealed = texts.pop("seal") == _seal(texts)
    except (sqlite3.DatabaseError, UnicodeError, KeyError, TypeError):
        sealed = False
    if version > VERSION and not sealed:
        raise StudyVersionError(
            f"study {path} has format {version}, but this version of pymoo-psi knows formats up "
            f"to {VERSION}; install a later one"
        )
    # The version stands in the header, which no seal covers, and once more among the facts.
    if version not in (2, VERSION) or not sealed or texts.get("format") != str(version):
        raise corrupt(path, "its facts are not those that were committed last")
    return {name: json.loads(text) for name, text in texts.items()}


def _seal(texts: Mapping[str, str]) -> str:
    # Sorted, as rows of a table have no order in SQL.
    content = json.dumps(sorted(texts.items())).encode()
    return json.dumps(blake2b(content, digest_size=16).hexdigest())


# Tests. Their cells are SQL's columns in their order: arrays of float64 and int64, lists of texts
# and None.


def stored_tests(
    db: sqlite3.Connection, path: str, facts: Head, first: int = 1, last: int = LAST
) -> Columns:
    """Return the tests with numbers from ``first`` to ``last``, by number, each one checked.

    Raises:
        StudyCorruptError: Tests are damaged; the message says which. Of all tests: one is missing.
    """
    cursor = _selected(db, facts, first, last)
    blocks = [_columns_of([], facts)]
    damaged: list[Any] = []
    total = 0
    while rows := cursor.fetchmany(AT_A_TIME):
        try:
            blocks.append(_columns_of(rows, facts))
            # Exclusive or, which has no order: a test is added or replaced without the others.
            total ^= int(np.bitwise_xor.reduce([row[-1] for row in rows]))
        except _DAMAGE:
            damaged += _damaged(rows, facts)
    if damaged:
        shown = ", ".join(f"{number!r:.20}" for number in damaged[:5])
        more = f" and {len(damaged) - 5} more" if len(damaged) > 5 else ""
        raise corrupt(path, f"the contents of test point {shown}{more} have changed")
    joined = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
    if first <= 1 and last >= LAST:
        tests = len(joined["test_point"])
        if tests != facts["tests"]:
            raise corrupt(path, f"it holds {tests} of {facts['tests']} tests")
        if total != facts["checksum"]:
            raise corrupt(path, "its tests are not those that were committed last")
    return joined


def changes(
    db: sqlite3.Connection, path: str, head: Head, cells: list[Any]
) -> tuple[NDArray[np.bool_], list[int]]:
    """Return which of n tests are to be written, and the checksums of those they replace.

    Origin and seconds may differ from what is stored, and the signs of zeros; that is no other
    result. Nor is an output that one of both does not have.

    Raises:
        ArgumentValueError: A test that did not fail would change.
    """
    new = np.ones(len(cells[0]), dtype=bool)
    replaced = []
    places = {number: i for i, number in enumerate(cells[0].tolist())}
    names = list(_sql_columns(head))
    last = len(names) - len(_BACK)  # behind the outputs, which end the columns of results
    outputs = range(last - len(head.get("outputs", ())), last)
    compared = [j for j in range(last) if j not in (3, 4, *outputs)]
    for stored in _selected(db, head, min(places, default=LAST), max(places, default=0)):
        if stored[0] not in places:
            continue
        i = places[stored[0]]
        pairs = [(stored[j], cells[j][i]) for j in compared]
        # NULL is how SQLite gives NaN back, and only a NaN differs from itself.
        pairs += [
            (stored[j], cells[j][i])
            for j in outputs
            if stored[j] is not None and not np.isnan(cells[j][i])
        ]
        if all(old == cell or (old is None and cell != cell) for old, cell in pairs):
            new[i] = False
        elif stored[1] == "failed":
            replaced.append(stored[-1])
        else:
            raise invalid(
                "block",
                "of new test points, repetitions of failed ones, or what is stored",
                Received(f"other values for test point {stored[0]}"),
                f"use another file if the model has changed; study {path} is as it was",
            )
    return new, replaced


def put_tests(
    db: sqlite3.Connection,
    facts: Head,
    cells: list[Any],
    new: NDArray[np.bool_],
    replaced: list[int],
) -> int:
    """Write tests, those that :func:`changes` says; return how many the study has then."""
    names = _sql_columns(facts)
    listed, marks = ", ".join(map(_quoted, names)), ", ".join("?" * len(names))
    lists = (cell if isinstance(cell, list) else cell.tolist() for cell in cells)
    rows = compress(zip(*lists, strict=True), new.tolist())
    db.executemany(f"INSERT OR REPLACE INTO tests ({listed}) VALUES ({marks})", rows)
    tests = int(facts["tests"] - len(replaced) + new.sum())
    total = np.bitwise_xor.reduce([facts["checksum"], *replaced, *cells[-1][new].tolist()])
    put_facts(db, tests=tests, checksum=int(total))
    return tests


def add_outputs(db: sqlite3.Connection, path: str, facts: Head, names: Sequence[str]) -> None:
    """Add columns for outputs that the study does not have; its tests have NaN in them.

    Raises:
        StudyCorruptError: A test is damaged, so that no new checksum can vouch for it.
        ArgumentValueError: There are too many columns.
    """
    stored_tests(db, path, facts)  # each one checked
    wider = {**facts, "outputs": [*facts.get("outputs", ()), *names]}
    for name, type_ in _sql_columns(wider).items():
        if name not in _sql_columns(facts):
            db.execute(f"ALTER TABLE tests ADD COLUMN {_quoted(name)} {type_}")
    # The checksum of a row is of all its cells, also of those that are new.
    cursor, total = _selected(db, wider, 1, LAST), 0
    while rows := cursor.fetchmany(AT_A_TIME):
        cells = _cells(rows, wider)
        sums = _checksums(cells[:-1])
        total ^= int(np.bitwise_xor.reduce(sums))
        pairs = zip(sums.tolist(), cells[0].tolist(), strict=True)
        db.executemany("UPDATE tests SET checksum = ? WHERE number = ?", pairs)
    db.execute(f"PRAGMA user_version = {VERSION}")
    put_facts(db, outputs=wider["outputs"], checksum=total, format=VERSION)


def put_facts(db: sqlite3.Connection, **changed: Any) -> None:
    """Change facts of a study, and their seal."""
    texts = dict(db.execute("SELECT name, value FROM facts WHERE name <> 'seal'"))
    texts |= {name: json.dumps(value, ensure_ascii=False) for name, value in changed.items()}
    rows = [*texts.items(), ("seal", _seal(texts))]
    db.executemany("INSERT OR REPLACE INTO facts VALUES (?, ?)", rows)


# Proposals: designs that an algorithm is going to test. A study without any has no table of them.


def put_proposals(db: sqlite3.Connection, proposals: Sequence[Proposal]) -> None:
    """Write proposals of numbers that have none yet."""
    db.execute(
        "CREATE TABLE IF NOT EXISTS proposals (number INTEGER PRIMARY KEY, round INTEGER, "
        "origin TEXT, content TEXT, checksum TEXT)"
    )
    rows = [(*head, json.dumps(content, ensure_ascii=False)) for *head, content in proposals]
    marked = [(*row, _proposal_checksum(row)) for row in rows]
    db.executemany("INSERT INTO proposals VALUES (?, ?, ?, ?, ?)", marked)


def stored_proposals(db: sqlite3.Connection, path: str, first: int, last: int) -> list[Proposal]:
    """Return the proposals with numbers from ``first`` to ``last``, by number, each one checked.

    Raises:
        StudyCorruptError: One is damaged.
    """
    if not db.execute("SELECT 1 FROM sqlite_master WHERE name = 'proposals'").fetchall():
        return []
    query = (
        "SELECT number, round, origin, content, checksum FROM proposals "
        "WHERE number BETWEEN ? AND ? ORDER BY number"
    )
    found = []
    for *row, checksum in db.execute(query, (first, last)):
        if _proposal_checksum(tuple(row)) != checksum:
            raise corrupt(path, f"the proposal of test point {row[0]!r:.20} has changed")
        found.append((*row[:3], json.loads(row[3])))
    return found


def _proposal_checksum(row: tuple[Any, ...]) -> str:
    return blake2b(json.dumps(row).encode(), digest_size=8).hexdigest()


def _selected(db: sqlite3.Connection, head: Head, first: int, last: int) -> sqlite3.Cursor:
    """Return the rows with numbers from ``first`` to ``last``, by number."""
    # A name in double quotes that is no column would be a text, but for the table before it.
    listed = ", ".join(f"tests.{_quoted(name)}" for name in _sql_columns(head))
    return db.execute(
        f"SELECT {listed} FROM tests WHERE number BETWEEN ? AND ? ORDER BY number",
        (min(first, LAST), min(last, LAST)),
    )


def _kinds(head: Head) -> dict[str, Kind]:
    """Return what each variable, criterion, constraint and output is, by name."""
    others = ("objectives", "inequalities", "equalities", "outputs")
    kinds = dict(zip(head["variables"], map(Kind, head["kinds"]), strict=True))
    # A study without outputs says nothing of them.
    return kinds | {name: Kind.REAL for group in others for name in head.get(group, ())}


def _sql_columns(head: Head) -> dict[str, str]:
    """Return SQL's columns and their types. SQL takes ``a`` and ``A`` for one name."""
    kinds = _kinds(head)
    if len(kinds) > _MOST_COLUMNS:
        rule = f"of at most {_MOST_COLUMNS} variables, criteria, constraints and outputs together"
        raise invalid("the problem of a study", rule, Received(len(kinds)))
    columns = dict(_FRONT)
    taken = {*_FRONT, *_BACK}
    for name, kind in kinds.items():
        while name.lower() in taken:
            name += "_"
        taken.add(name.lower())
        columns[name] = _TYPES[kind]
    return columns | _BACK


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def unknown_outputs(columns: Columns, head: Head) -> list[str]:
    """Return the names of columns of tests that a study does not have."""
    known = {"test_point", "status", "reason", *_kinds(head)}
    return [name for name in columns if name not in known]


def cells_of(
    columns: Columns,
    head: Head,
    origin: str | None = None,
    seconds: ArrayLike | None = None,
) -> list[Any]:
    """Return the cells of n tests, SQL's columns in their order, the checksums last.

    An output that the tests do not have is NaN.
    """
    n = len(columns["test_point"])
    columns = dict.fromkeys(head.get("outputs", ()), np.full(n, np.nan)) | columns
    values: list[Any] = []
    negative: dict[int, list[str]] = {}
    for name, kind in _kinds(head).items():
        column = columns[name]
        if kind is Kind.CHOICE:
            values.append(column.tolist())
        elif kind is Kind.REAL:
            for i in np.flatnonzero((column == 0) & np.signbit(column)).tolist():
                negative.setdefault(i, []).append(name)
            values.append(_stored_reals(column))
        else:
            values.append(column.astype(np.int64, casting="safe"))
    cells = [
        columns["test_point"].astype(np.int64, casting="safe"),
        columns["status"].tolist(),
        [reason or None for reason in columns["reason"].tolist()],
        [origin] * n,
        np.full(n, np.nan if seconds is None else seconds),
        *values,
        [json.dumps(negative[i]) if i in negative else None for i in range(n)],
    ]
    return [*cells, _checksums(cells)]


def _stored_reals(column: NDArray[Any]) -> NDArray[np.float64]:
    """Return what SQLite gives back of real numbers: one NaN, one zero."""
    reals = column.astype(np.float64, casting="safe")
    return np.where(np.isnan(reals), np.nan, reals + 0.0)


def _checksums(cells: list[Any]) -> NDArray[np.int64]:
    """``(n,)`` checksums of rows: of the bits of their numbers, then of their texts as JSON."""
    numbers = [column.view(np.int64) for column in cells if not isinstance(column, list)]
    # Little-endian whatever the machine, as files are carried to others.
    bits = np.stack(numbers, axis=1).astype("<i8").tobytes()
    width = 8 * len(numbers)
    ends: dict[tuple[Any, ...], bytes] = {}  # most rows have the same texts
    digests = []
    texts = zip(*(column for column in cells if isinstance(column, list)), strict=True)
    for i, text in enumerate(texts):
        if text not in ends:
            ends[text] = json.dumps(text).encode()
        row = bits[i * width : (i + 1) * width] + ends[text]
        digests.append(blake2b(row, digest_size=8).digest())
    return np.frombuffer(b"".join(digests), dtype="<i8").astype(np.int64)


# What a cell that was damaged can raise where it is of another type, and what a checksum does.
_DAMAGE = (TypeError, ValueError, OverflowError, KeyError, RecursionError)


def _columns_of(rows: Sequence[tuple[Any, ...]], head: Head) -> Columns:
    """Return checked rows of SQL as columns.

    Raises:
        ValueError: The checksum of a row is another one; or what else is in ``_DAMAGE``.
    """
    cells = _cells(rows, head)
    if (_checksums(cells[:-1]) != cells[-1]).any():
        raise ValueError("a checksum is another one")
    number, status, reason, _, _, *values, zeros, _ = cells
    result: Columns = {"test_point": number}
    for (name, kind), cell in zip(_kinds(head).items(), values, strict=True):
        texts = kind is Kind.CHOICE
        result[name] = np.fromiter(cell, object) if texts else cell.astype(DTYPES[kind])
    for i, names in enumerate(zeros):
        for name in () if names is None else json.loads(names):
            result[name][i] = -0.0
    result["status"] = np.fromiter(status, object)
    return result | {"reason": np.fromiter((text or "" for text in reason), object)}


def _cells(rows: Sequence[tuple[Any, ...]], head: Head) -> list[Any]:
    """Return rows of SQL as cells, columns as :func:`cells_of` gives them.

    Raises:
        ValueError: A cell is damaged; or what else is in ``_DAMAGE``.
    """
    types = list(_sql_columns(head).values())
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(types)
    dtypes = [np.float64 if t == "REAL" else None if t == "TEXT" else np.int64 for t in types]
    dtypes[0] = dtypes[-1] = np.int64
    return [
        list(column) if dtype is None else np.array(column, dtype=dtype)
        for column, dtype in zip(columns, dtypes, strict=True)
    ]


def _damaged(rows: list[tuple[Any, ...]], head: Head) -> list[Any]:
    """Return the numbers of rows that are not what was written."""
    try:
        _columns_of(rows, head)
    except _DAMAGE:
        half = len(rows) // 2
        if half == 0:
            return [rows[0][0]]
        return _damaged(rows[:half], head) + _damaged(rows[half:], head)
    return []
