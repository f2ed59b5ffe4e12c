"""The study file: an SQLite database that any program can read; ``_database`` says what it has.

SQLite does the transactions, the recovery after a kill and the locks between readers and a commit,
with its rollback journal. At rest the file itself holds everything. Unlike SQLite's write-ahead
log, the journal also works on file systems that several machines share.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager
from glob import escape, glob
from pathlib import Path
from traceback import clear_frames

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import (
    Array,
    Columns,
    FilePath,
    Head,
    Integers,
    Mask,
    identity_text,
    invalid,
    wrong_type,
)
from pymoo_psi.errors import ArgumentValueError, StudyAccessError, StudyMismatchError
from pymoo_psi.study._database import Database, Proposal, created, require_study
from pymoo_psi.study._facts import (
    SUFFIX,
    Facts,
    Share,
    StudyRun,
    beside,
    identity_of_run,
    require_fellow,
    require_same_model,
)
from pymoo_psi.study._integrity import (
    BESIDE,
    connected,
    intact,
    locked,
    reported,
)

# What is in such files is no study, and a study deletes those that it has beside it.
_OF_OTHERS = (".csv", ".tsv", ".txt", ".json", ".xlsx", ".xls", ".toml", ".py", ".html")
_ROUNDED = 1e-9  # the most by which machines may differ in a result, relative to the largest one
_AT_A_TIME = 65_536  # rows that are in memory as Python objects at the same time


class Study:
    """A study file, given by its name; it can be copied, pickled and shared by threads.

    The tests of a block are committed together or not at all. Committed tests survive the end of
    the process. Reading changes nothing and at most waits for a commit.

    A study stores the columns of tables, and their heads as JSON.

    Attributes:
        path: The absolute path of the file.
        wait: Seconds to wait for other processes that are writing the study.
    """

    _id: str | None = None  # the study in use, as another file may take its place

    def __init__(self, path: FilePath, *, wait: float = 10.0) -> None:
        if not isinstance(path, (str, os.PathLike)):
            raise wrong_type("study", "the name of a file", path)
        if not os.fspath(path):
            raise invalid("study", "the name of a file", path)
        self.path: str = os.path.realpath(path)
        if self.path.lower().endswith((*_OF_OTHERS, *BESIDE)):
            raise invalid(
                "study",
                "a database with a name such as designs.db",
                os.fspath(path),
                "'pymoo-psi solve' reads tables by --from, and 'pymoo-psi export' writes them",
            )
        self.wait = wait

    def begin(
        self,
        head: Head,
        identity: Head,
        share: tuple[int, int] | None = None,
        revised: Callable[[Columns], tuple[Mask, Columns]] | None = None,
    ) -> tuple[Facts, StudyRun]:
        """Begin a run, or continue the one with the same identity; create the file if needed.

        Args:
            head: ``variables``, ``objectives``, ``inequalities``, ``equalities``: names;
                ``kinds``: "real", "integer", "binary" or "choice" for each variable; ``problem``,
                which identifies the model; and what else the formulation needs, such as limits.
                It replaces the head that the study has. Outputs are added by the tests.
            identity: What determines the points of the run.
            share: For a share of an investigation: its part and the number of parts. Its folder is
                made if necessary; the other studies in it must belong to the same model and points
                and have the same number of parts.
            revised: Returns which of stored tests are to be made anew under a new head, and values
                of them that follow from others.

        Returns:
            The facts, and the run.

        Raises:
            StudyMismatchError: The file belongs to another model; the message says what differs.
            StudyError: The file is damaged, no study, of another version, or cannot be made or
                read.
            ArgumentTypeError: JSON cannot hold the head.
        """
        head = json.loads(identity_text(head))
        new = Facts(head, [StudyRun(1, identity, {})], share=share)
        if share is not None:
            self._prepare_folder(new)
        self._create(head, identity, share)
        self._id = None
        stored = self.facts()
        require_same_model(self.path, stored.head, head)
        if stored.share is not None:
            require_fellow(self.path, stored, new)
        run = stored.run_with(identity)
        whole = beside(head, stored.head) | stored.bounds
        if run is not None and json.dumps(whole) == json.dumps(stored.head):
            return stored, run
        with self.changes() as database:
            database.replace_head(head, revised)
            run = database.facts.run_with(identity) or database.add_run(identity)
            return database.facts, run

    def _create(self, head: Head, identity: Head, share: tuple[int, int] | None) -> None:
        """Make the file, with its first run, unless there is one."""
        if os.path.exists(self.path):
            return
        with self.writing():
            # The previous owner of the lock may have made it meanwhile.
            if not os.path.exists(self.path):
                with created(self.path, head, share) as database:
                    database.add_run(identity)

    def _prepare_folder(self, facts: Facts) -> None:
        """Make the folder of shares; studies in it must be shares of the same points."""
        folder = os.path.dirname(self.path)
        with reported(self.path, OSError):
            os.makedirs(folder, exist_ok=True)
        for path in studies_in(folder):
            require_fellow(path, Study(path).facts(), facts)

    def writing(self, run: int = 1) -> AbstractContextManager[None]:
        """Return a context in which no other process can add to a run.

        Without it, :meth:`append` does so for each block. It may be nested. Other runs of the study
        can be added to meanwhile.

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
        repeat: int = 1,
        noisy: bool = False,
        origin: str | None = None,
        seconds: ArrayLike | None = None,
    ) -> int:
        """Commit a block of n tests; after the return they are on the disk.

        A design that has a test is not stored again, and the values of the test stay, also if one
        of the two lacks an output. A failed test is replaced by its repetition.

        Args:
            columns: Columns of n cells: ``test_point``, the numbers of the points in the run; the
                variables, objectives and constraints by name, choices as texts; ``status``;
                ``reason``, texts; and the outputs of the model, numbers, which may differ from
                block to block.
            run: The run of the points.
            repeat: Which of the tests of their designs these are, from 1; 0 for further ones.
            noisy: Whether a design that recurs in the run is tested again.
            origin: Where the designs come from.
            seconds: How long the evaluation of a design took, one number or ``(n,)``.

        Returns:
            The number of tests that were new or replaced.

        Raises:
            StudyMismatchError: Another study has taken the place of this one.
            ArgumentValueError: A test of the run is stored with other values.
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
            return database.append(run, columns | more, repeat, noisy=noisy)

    def facts(self) -> Facts:
        """Return the facts of the study as a whole.

        Raises:
            StudyMismatchError: Another study has taken the place of this one.
            StudyCorruptError: The file is damaged, no study, or of a later version.
            StudyAccessError: The file does not exist or cannot be read.
        """
        with self.reading() as database:
            return database.facts

    def contents(self) -> tuple[Facts, Columns]:
        """Return the facts and all stored tests, both of the same moment.

        Returns:
            The facts, and the columns of the tests in the order of their numbers: those of
            :meth:`append`, and the integers ``test``, the number, and ``run``.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self.reading() as database:
            return database.facts, database.tests()

    def proposals(self, run: int = 1) -> list[Proposal]:
        """Return the proposals of a run, by test point.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self.reading() as database:
            return database.proposals(run)

    def reading(self) -> AbstractContextManager[Database]:
        """Return a context in which the study can be read and does not change."""
        # A plain BEGIN would take the write lock at the first change only, after reading.
        return self._transaction("BEGIN")

    def changes(self) -> AbstractContextManager[Database]:
        """Return a context in which the study can be changed; changes are committed together."""
        return self._transaction("BEGIN IMMEDIATE")

    @contextmanager
    def _transaction(self, begin: str) -> Iterator[Database]:
        """Yield what is still the same study in a transaction; an error in the body undoes it.

        The file is open for no longer, so that it may be moved, and a fork inherits no connection.
        """
        if not os.path.isfile(self.path):
            raise StudyAccessError(f"study {self.path} does not exist; check the name")
        with reported(self.path), closing(connected(self.path)) as db:
            try:
                db.execute(begin)
                database = Database(db, self.path)
                with intact(db, self.path):
                    require_study(db, self.path)
                    stored_id = database.get("id")
                if self._id not in (None, stored_id):
                    raise StudyMismatchError(
                        f"study {self.path} is not the one that this run began or continued: "
                        "another has taken its place, and was left as it is; put the right file "
                        "back, or run again to continue this one"
                    )
                self._id = stored_id
                yield database
                db.execute("COMMIT")
            except KeyboardInterrupt as error:
                clear_frames(error.__traceback__)  # a cursor there would keep the file locked
                raise


def studies_in(folder: FilePath) -> list[str]:
    """Return the paths of the studies in a folder, sorted."""
    return sorted(glob(f"{escape(os.fspath(folder))}/*{SUFFIX}"))


def write_study(path: FilePath, head: Head, columns: Columns) -> None:
    """Write tests as a new study, whole or not at all; see :class:`Study` for head and columns.

    Args:
        path: The file.
        head: The head; its ``problem`` may say the ``sampling`` of its points, or the identities of
            several ``runs`` by their numbers.
        columns: The columns of :meth:`Study.append`; and, if there are several runs, the ``run``
            and the number of each ``test``.

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
    points = np.asarray(columns["test_point"], dtype=np.int64)
    columns = {"test": points, "run": np.ones_like(points)} | columns
    with created(file, stored_head) as database:
        for number, identity in identities.items():
            run = int(number)
            database.add_run(identity, run)
            (rows,) = np.nonzero(columns["run"] == run)
            for start in range(0, len(rows), _AT_A_TIME):
                part = rows[start : start + _AT_A_TIME]
                database.append(run, {name: cells[part] for name, cells in columns.items()}, 0)


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
    first = Study(files[0]).facts()
    n_shares = 1
    tests_by_file = {}
    points = []
    for file in files:
        with Study(file).reading() as database:
            facts = database.facts
            tests_by_file[file] = database.tests()
            points.append(database.test_points(1, 1))
        _require_same_points(file, facts, files[0], first)
        if facts.share is not None:
            _, n_shares = facts.share
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        joined = Database(db, os.fspath(path))
        joined.begin(first.head)
        _join(joined, first.runs[0], tests_by_file)
        missing = _missing(n_shares, np.unique(np.concatenate(points)))
        return first._replace(head=joined.facts.head), joined.tests(), missing


def _join(joined: Database, run: StudyRun, tests_by_file: Mapping[str, Columns]) -> None:
    """Write the tests of shares of a run into a study without tests, numbered by their points."""
    is_noisy = run.record.get("noisy", False)
    joined.add_run(run.identity)
    if joined.head["variables"] and not is_noisy:
        _require_same_results(tests_by_file, joined)
    for file, tests in tests_by_file.items():
        try:
            joined.append(1, tests, noisy=is_noisy)
        except ArgumentValueError as error:
            raise _other_results(file, error) from error
    joined.number_by_points()


def _require_same_points(file: str, facts: Facts, first_file: str, first: Facts) -> None:
    """Refuse a study that is no share of the points of the first one, or computes otherwise."""
    require_fellow(file, facts, first, f"in {first_file}")
    expressions = facts.head.get("expressions", {})
    for name, expression in first.head.get("expressions", {}).items():
        if expressions.get(name, expression) != expression:
            raise StudyMismatchError(
                f"study {file} has {name} = {expressions[name]}, and {first_file} has "
                f"{expression}; run both shares again, which computes {name} anew"
            )


def _require_same_results(tests_by_file: Mapping[str, Columns], joined: Database) -> None:
    """Refuse shares whose results for the same design differ by more than rounding.

    Args:
        tests_by_file: The tests of the shares.
        joined: The study of all shares, which knows the keys of designs.
    """
    names = joined.head["objectives"]
    largest = np.zeros(len(names))
    results: dict[str | None, Array] = {}
    for file, tests in tests_by_file.items():
        F = np.column_stack([tests[name] for name in names])
        np.maximum(largest, np.abs(F).max(axis=0, initial=0, where=np.isfinite(F)), out=largest)
        for test, key, row in zip(tests["test"], joined.keys(tests), F, strict=True):
            if not np.isfinite(row).all():  # a failed test
                continue
            former = results.setdefault(key, row)
            if (np.abs(row - former) > _ROUNDED * largest).any():
                raise _other_results(file, f"test {test}: {row.tolist()}, before {former.tolist()}")


def _other_results(file: str, detail: object) -> StudyMismatchError:
    return StudyMismatchError(
        f"study {file} and one before it in the folder have different results for the same design; "
        f"move the file that is wrong, or older, to another folder ({detail})"
    )


def _missing(n_shares: int, points: Integers) -> str:
    """Say how many test points each share lacks between the first and the last stored one."""
    if n_shares == 1 or len(points) == 0:
        return ""
    first = int(points[0])
    last = int(points[-1])
    counts = []
    for part in range(1, n_shares + 1):
        share = Share(part, n_shares)
        n_missing = len(np.setdiff1d(share.numbers(first, last), points))
        if n_missing:
            counts.append(f"{n_missing} of share {share}")
    if not counts:
        return ""
    return f"Missing between test points {first} and {last}: {', '.join(counts)}"
