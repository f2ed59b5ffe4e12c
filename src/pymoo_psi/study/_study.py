"""The study file: an SQLite database of tables that any program can read.

- ``tests`` has one row for each test: ``test``, its number, which says the ``run`` and the
  ``test_point`` for which it was made, see :class:`StudyRun`; ``status``; ``reason``, why it
  failed; ``origin``, where its design comes from; ``seconds``, the time of its evaluation (the mean
  of designs that were evaluated together); then variables, objectives, constraints and outputs
  under their names. A name that is taken gets ``_`` appended. NaN is NULL, binary variables are 0
  and 1, choices are texts.
- ``runs`` says for each run what determines its points, when, where and by which versions it was
  begun, and the last point that it was asked for; ``adopted`` has the points of a run whose
  designs other runs had tested.
- ``proposals`` has designs that an algorithm or people are going to test.
- ``history`` has tests as they were before they were corrected, and when that was.
- ``study`` has the facts about the whole file: names, and values as JSON. One of them is what
  people ask of a run while it works, and what the run answered.

Other programs may add views, indices and tables. Triggers are refused, as SQLite would run them
whenever a test is written.

Real numbers are in columns without a type, which keep all their bits: a column of type REAL would
turn -0.0 into 0.0.

SQLite does the transactions, the recovery after a kill and the locks between readers and a commit,
with its rollback journal. At rest the file itself holds everything. Unlike SQLite's write-ahead
log, the journal also works on file systems that several machines share.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

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
from pymoo_psi.study._database import (
    LAST,
    Database,
    Proposal,
    create,
    new_database,
    opened,
)
from pymoo_psi.study._facts import (
    ROOM,
    SUFFIX,
    Facts,
    Renaming,
    Share,
    StudyRun,
    columns_of_head,
    identity_of_run,
    new_run,
    require_same_model,
    with_outputs,
)
from pymoo_psi.study._integrity import BESIDE, intact, locked, reported

_PATIENCE = 60.0  # seconds that a commit waits for readers, and readers for a commit
# What is in such files is no study, and other programs would not open one by such a name.
_OF_OTHERS = (".csv", ".tsv", ".txt", ".json", ".xlsx", ".xls", ".toml", ".py", ".html")
# A plain BEGIN would take the write lock at the first change only, after reading.
_READ = "BEGIN"
_WRITE = "BEGIN IMMEDIATE"


class Study:
    """A study file, given by its name; it can be copied, pickled and shared by threads.

    The tests of a block are committed together or not at all. Committed tests survive the end of
    the process. Reading changes nothing and at most waits for a commit.

    A study stores the columns of tables, and their heads as JSON.

    Attributes:
        path: The absolute path of the file.
        wait: Seconds to wait for other processes that are writing the study.
    """

    def __init__(self, path: FilePath, *, wait: float = 10.0) -> None:
        self.path = os.path.realpath(path)
        if self.path.lower().endswith(_OF_OTHERS):
            rule = "a database with a name such as designs.db"
            remedy = "tables are read by 'from', and written by 'pymoo-psi export'"
            raise invalid("study", rule, os.fspath(path), remedy)
        if self.path.lower().endswith(BESIDE):
            remedy = "a study deletes such files"
            raise invalid("study", "named unlike files beside a study", os.fspath(path), remedy)
        self.wait = wait
        self._head: Head | None = None  # the head of the run that was begun
        self._id: str | None = None  # the study in use, as another file may take its place

    def begin(
        self,
        head: Head,
        identity: Head | None = None,
        share: tuple[int, int] | None = None,
    ) -> tuple[Facts, StudyRun]:
        """Begin a run, or continue the one with the same identity; create the file if needed.

        Args:
            head: ``variables``, ``objectives``, ``inequalities``, ``equalities``: names;
                ``kinds``: "real", "integer", "binary" or "choice" for each variable; ``problem``,
                which identifies the model; and what else the formulation needs, such as limits.
                It replaces the head that the study has. Outputs are added by the tests.
            identity: What determines the points of the run; by default the bounds in the head.
            share: For a share of an investigation: its part and the number of parts. Its folder is
                made if necessary; the other studies in it must belong to the same model and points
                and have the same number of parts.

        Returns:
            The facts, and the run.

        Raises:
            StudyMismatchError: The file belongs to another model; the message says what differs.
            StudyError: The file is damaged, no study, of another version, or cannot be made or
                read.
            ArgumentTypeError: JSON cannot hold the head.
        """
        head = json.loads(identity_text(head))
        self._head = head
        if identity is None:
            identity = identity_of_run(head, None)
        facts = Facts(head, share, runs=[new_run(1, identity)])
        if share is not None:
            self._prepare_folder(facts)
        if not os.path.exists(self.path):
            with self.writing():
                # The previous owner of the lock may have made it meanwhile.
                if not os.path.exists(self.path):
                    create(self.path, facts)
        self._id = None
        stored = self.facts()
        require_same_model(self.path, stored.head, head)
        if stored.share is not None:
            require_fellow(self.path, stored, facts)
        run = stored.run_with(identity)
        whole = with_outputs(head, columns_of_head(stored.head))
        if run is not None and json.dumps(whole) == json.dumps(stored.head):
            return stored, run
        with ExitStack() as locks:
            # No other process writes under the names that are stored now.
            if Renaming.between(stored.head, head):
                for stored_run in stored.runs:
                    locks.enter_context(self.writing(stored_run.number))
            database = locks.enter_context(self.changes())
            database.replace_head(head)
            run = database.facts.run_with(identity) or database.add_run(identity)
            return database.facts, run

    def _prepare_folder(self, facts: Facts) -> None:
        """Make the folder of shares; studies in it must be shares of the same points."""
        folder = os.path.dirname(self.path)
        with reported(self.path, OSError):
            os.makedirs(folder, exist_ok=True)
        for path in studies_in(folder):
            require_fellow(path, Study(path).facts(), facts)

    def writing(self, run: int = 1) -> AbstractContextManager[None]:
        """Return a context in which no other process can add to a run.

        Without it, :meth:`append` does so for each block. It may be nested. Threads of this process
        wait for one another. Other runs of the study can be added to meanwhile.

        Raises:
            StudyLockedError: Another process is writing. A killed process does not hold the lock.
            StudyAccessError: The folder cannot be written.
        """
        return locked(self.path, run, self.wait)

    def append(
        self,
        columns: Columns,
        *,
        run: int = 1,
        origin: str | None = None,
        seconds: ArrayLike | None = None,
    ) -> int:
        """Commit a block of n tests; after the return they are on the disk.

        A test that is stored already with the same values is skipped, even if one of the two lacks
        an output. A failed test is replaced by its repetition. No other stored test can be changed.
        A design that another run has tested meanwhile is not stored again; both points share its
        test.

        Args:
            columns: Columns of n cells: ``test_point``, the numbers of the points in the run; the
                variables, objectives and constraints by name, choices as texts; ``status``;
                ``reason``, texts; and the outputs of the model, numbers, which may differ from
                block to block.
            run: The run of the points.
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
        n = len(columns["test_point"])
        if n == 0:
            return 0
        origins = np.full(n, origin, dtype=object)
        more = {"origin": origins, "seconds": np.full(n, seconds, dtype=np.float64)}
        with self.writing(run), self.changes() as database:
            head = database.facts.head
            if self._head is not None and Renaming.between(head, self._head):
                raise StudyMismatchError(
                    f"another run has given the objectives of study {self.path} other names or "
                    "directions since this one began; this one stored nothing more: run it again"
                )
            return database.append(run, columns | more)

    def facts(self) -> Facts:
        """Return the facts of the study as a whole.

        Raises:
            StudyMismatchError: Another study has taken the place of this one.
            StudyCorruptError: The file is damaged, no study, or of a later version.
            StudyAccessError: The file does not exist or cannot be read.
        """
        with self.reading() as database:
            return database.facts

    def contents(self, first: int = 1, count: int = LAST) -> tuple[Facts, Columns]:
        """Return the facts and stored tests, both of the same moment.

        Args:
            first: The number of the first test.
            count: How many numbers from there on.

        Returns:
            The facts, and the columns of the tests in the order of their numbers: those of
            :meth:`append`, and the integers ``test``, the number, and ``run``.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self.reading() as database:
            return database.facts, database.tests(first, first + count - 1)

    def proposals(self, run: int = 1) -> list[Proposal]:
        """Return the proposals of a run, by test point.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self.reading() as database:
            return database.proposals(run)

    def reading(self) -> AbstractContextManager[Database]:
        """Return a context in which the study can be read and does not change."""
        return self._transaction(_READ)

    def changes(self) -> AbstractContextManager[Database]:
        """Return a context in which the study can be changed; changes are committed together."""
        return self._transaction(_WRITE)

    @contextmanager
    def _transaction(self, begin: str) -> Iterator[Database]:
        """Yield what is still the same study in a transaction; an error in the body undoes it."""
        with reported(self.path):
            if not os.path.isfile(self.path):
                raise StudyAccessError(f"study {self.path} does not exist; check the name")
            with closing(self._connected()) as db:
                db.execute("PRAGMA synchronous = EXTRA")  # a commit outlives a power failure
                db.execute("PRAGMA cell_size_check = ON")  # damage is reported, not read
                db.execute(begin)
                with intact(db, self.path):
                    database = opened(db, self.path)
                if self._id not in (None, database.facts.id):
                    raise StudyMismatchError(
                        f"study {self.path} is not the one that this run began or continued: "
                        "another has taken its place, and was left as it is; put the right file "
                        "back, or run again to continue this one"
                    )
                yield database
                if begin == _WRITE:
                    database.save()
                db.execute("COMMIT")
        self._id = database.facts.id

    def _connected(self) -> sqlite3.Connection:
        """Return a connection to the file."""
        # "rw" also to read: SQLite then undoes what a killed writer has left, and takes a file
        # that must not be written as read-only. isolation_level=None: Python's module would
        # begin transactions by itself.
        uri = f"{Path(self.path).as_uri()}?mode=rw"
        return sqlite3.connect(uri, uri=True, timeout=_PATIENCE, isolation_level=None)


def require_fellow(path: str, facts: Facts, others: Facts, where: str = "asked") -> None:
    """Refuse a study that is no share of the same points as another one.

    Raises:
        StudyMismatchError: It is none; the message says what differs.
    """
    require_same_model(path, facts.head, others.head, where)
    if facts.share and others.share and facts.share[1] != others.share[1]:
        parts = f"one of {facts.share[1]} shares, not of {others.share[1]}"
        raise StudyMismatchError(f"study {path} is {parts}; give the name of another folder")
    if len(facts.runs) > 1 or others.run_with(facts.runs[0].identity) is None:
        raise StudyMismatchError(
            f"study {path} is a share of other points than those {where}; give the name of another "
            "folder, or join the shares by 'pymoo-psi export' and go on with that study"
        )


def write_study(path: FilePath, head: Head, columns: Columns) -> None:
    """Write tests as a new study, whole or not at all; see :class:`Study` for head and columns.

    Args:
        path: The file.
        head: The head; its ``problem`` may say the ``sampling`` of its points, or the identities of
            several ``runs`` by their numbers.
        columns: The columns of :meth:`Study.append`, and the ``run`` if there are several.

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
    test_points = np.asarray(columns["test_point"], dtype=np.int64)
    columns = {"run": np.ones(len(test_points), dtype=np.int64)} | columns
    columns["test"] = (columns["run"] - 1) * ROOM + test_points
    if len(np.unique(columns["test"])) < len(test_points):
        rule = "different ones, as numbers of tests follow from them"
        raise invalid("the runs and test points of a study", rule, Received("some that recur"))
    facts = Facts(with_outputs(stored_head, columns))
    for number, identity in identities.items():
        last = test_points[columns["run"] == int(number)].max(initial=0)
        facts.runs.append(new_run(int(number), identity, int(last)))
    create(file, facts, columns)


def studies_in(folder: FilePath) -> list[str]:
    """Return the paths of the studies in a folder, sorted."""
    return sorted(map(str, Path(folder).glob(f"*{SUFFIX}")))


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
    contents = [Study(file).contents() for file in files]
    first = contents[0][0]
    n_shares = 1
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        joined = new_database(db, os.fspath(path), first)
        for file, (facts, columns) in zip(files, contents, strict=True):
            require_fellow(file, facts, first, f"in {files[0]}")
            if facts.share is not None:
                n_shares = facts.share[1]
            columns = Renaming.between(facts.head, first.head).of_columns(columns)
            try:
                if len(columns["test"]):
                    joined.append(1, columns)
            except ArgumentValueError as error:
                raise StudyMismatchError(
                    f"study {file} and one before it in the folder have different results for test "
                    f"points; move the file that is wrong, or older, to another folder ({error})"
                ) from error
        columns = joined.tests()
    return first, columns, _missing(n_shares, columns["test"])


def _missing(n_shares: int, numbers: Integers) -> str:
    """Say how many test points each share lacks between the first and the last stored one."""
    if n_shares == 1 or len(numbers) == 0:
        return ""
    first = int(numbers[0])
    last = int(numbers[-1])
    counts = []
    for part in range(1, n_shares + 1):
        share = Share(part, n_shares)
        n_missing = len(np.setdiff1d(share.numbers(first, last), numbers))
        if n_missing:
            counts.append(f"{n_missing} of share {share}")
    if not counts:
        return ""
    return f"Missing between test points {first} and {last}: {', '.join(counts)}"
