"""The study file: an SQLite database of tables that any program can read.

- ``tests`` has one row for each test: ``test``, its number; ``run`` and ``test_point``, the point
  for which it was made; ``repeat``, which of the tests of its design it is; ``status``; ``reason``,
  why it failed; ``origin``, where its design comes from; ``seconds``, the time of its evaluation
  (the mean of designs that were evaluated together); then variables, objectives, constraints and
  outputs under their names. A name that is taken gets ``_`` appended. NaN is NULL, binary variables
  are 0 and 1, choices are texts. ``row_checksum`` is that of what a row holds but origin and
  seconds, see ``_checksum``: a cell that was changed, by whatever, is noticed when it is read.
- ``runs`` says for each run what determines its points, when, where and by which versions it was
  begun, and the numbers of its tests; ``known`` has the points of a run whose designs other runs
  had tested.
- ``proposals`` has designs that an algorithm or people are going to test; those that are asked of
  people have the number of their test, and when they were cancelled if they were.
- ``history`` has tests as they were before they were corrected or withdrawn, and when that was.
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
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import Integers, identity_text, invalid, wrong_type
from pymoo_psi.errors import StudyAccessError, StudyMismatchError
from pymoo_psi.study._database import (
    LAST,
    OF_0_3,
    Columns,
    Facts,
    Proposal,
    Requests,
    add_known,
    add_proposals,
    add_run,
    ask,
    convert,
    count_tests,
    create,
    design_checksums,
    insert,
    new_run,
    numbered,
    put,
    read_facts,
    remember,
    reserve,
    rewrite,
    run_of,
    run_with,
    selected,
    selected_of_run,
    stored_numbers,
    stored_proposals,
    stored_test_points,
    tests_by_design,
    to_write,
    widen,
    with_outputs,
    with_stored_columns,
)
from pymoo_psi.study._lock import RESERVED_SUFFIXES, locked, reported, require_own_journals
from pymoo_psi.study._runs import Head, points_of, require_same_model, segments_of

SUFFIX = ".db"  # of the studies in a folder
_PATIENCE = 60.0  # seconds that a commit waits for readers, and readers for a commit
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
        for suffix in RESERVED_SUFFIXES:
            if self.path.endswith(suffix):
                raise invalid(
                    "study path",
                    "another name than those of journals and locks of studies",
                    self.path,
                )
        self.wait = wait
        self._id: str | None = None  # of the study that was used; another file may take its place
        # Of which run, how many tests the other runs have and how many were changed; the tests of
        # the other runs by their designs.
        self._others: tuple[tuple[int, int, int], dict[int, int]] = (0, 0, 0), {}

    def begin(
        self,
        head: Head,
        points: Head | None = None,
        share: tuple[int, int] | None = None,
        planned: tuple[int, int] | None = None,
    ) -> Facts:
        """Begin a run, or continue the one that has the same points; create the file if needed.

        Args:
            head: ``variables``, ``objectives``, ``inequalities``, ``equalities``: names;
                ``kinds``: "real", "integer", "binary" or "choice" for each variable; ``problem``,
                which identifies the model; and what else says how tests are asked, such as limits.
                It takes the place of the head that the study has. Outputs are added by the tests.
            points: What determines the points of the run; by default the bounds in the head.
            share: For a share of an investigation: its part and the number of parts. Its folder is
                made if necessary; the other studies in it must belong to the same model and points
                and have the same number of parts.
            planned: The first and the last test point that the run is asked for, for which numbers
                of tests are kept.

        Returns:
            The facts, see :meth:`facts`, and the ``run``, a :class:`StudyRun`.

        Raises:
            StudyMismatchError: The file belongs to another model; the message says what differs.
            StudyError: The file is damaged, no study, of another version, or cannot be made or
                read.
            ArgumentTypeError: JSON cannot hold the head.
        """
        asked = json.loads(identity_text(head))
        if points is None:
            points = points_of(asked, None)
        facts: Facts = {"head": asked}
        if share is not None:
            facts["share"] = [*share]
            self._require_fellow_shares(facts, points)
        if not os.path.exists(self.path):
            with self.writing():
                # The previous owner of the lock may have made it meanwhile.
                if not os.path.exists(self.path):
                    segments = [(*planned, 0)] if planned else []
                    create(self.path, facts, [new_run(1, points, segments)])
        self._id = None
        stored = self.facts()
        require_same_model(self.path, stored["head"], asked)
        require_same_share(self.path, stored, facts)
        run = run_with(stored["runs"], points)
        head = with_stored_columns(stored["head"], asked)
        is_known = run is not None and (planned is None or all(map(run.has, planned)))
        if is_known and json.dumps(head) == json.dumps(stored["head"]):
            return stored | {"run": run}
        if run is None and "share" in stored:
            raise StudyMismatchError(
                f"study {self.path} is a share of other points; give the name of another folder, "
                "or join the shares by 'pymoo-psi export' and go on with that study"
            )
        with self._transaction(_WRITE) as (db, stored):
            ask(db, stored, asked)
            run = run_with(stored["runs"], points)
            if run is None:
                run = add_run(db, stored, points)
            if planned:
                run = reserve(db, stored, run, *planned)
        return stored | {"run": run}

    def _require_fellow_shares(self, facts: Facts, points: Head) -> None:
        """Make the folder of a share, and refuse one with shares of something else."""
        folder = os.path.dirname(self.path)
        with reported(self.path):
            os.makedirs(folder, exist_ok=True)
        for path in studies_in(folder):
            stored = Study(path).facts()
            require_same_model(path, stored["head"], facts["head"])
            require_same_share(path, stored, facts)
            if run_with(stored["runs"], points) is None:
                raise StudyMismatchError(
                    f"study {path} is a share of other points; give the name of another folder"
                )

    @contextmanager
    def writing(self, run: int = 1) -> Iterator[None]:
        """Keep other processes from adding to a run while the body does, so none repeats its work.

        Without it, :meth:`append` does so for each block. It may be nested. Threads of this process
        wait for one another. Other runs of the study can be added to meanwhile.

        Raises:
            StudyLockedError: Another process is writing. A killed process does not hold the lock.
            StudyAccessError: The folder cannot be written.
        """
        with locked(self.path, run, self.wait):
            yield

    def remember(self, run: int, name: str, value: Any) -> Any:
        """Return an entry of the record of a run; it becomes this value if there is none yet.

        Raises:
            StudyError: As :meth:`append`.
        """
        record = run_of(self.facts(), run).record
        if name in record:
            return record[name]
        with self._transaction(_WRITE) as (db, facts):
            remember(db, run_of(facts, run), name, value)
        return value

    def append(
        self,
        columns: Columns,
        *,
        run: int = 1,
        origin: str | None = None,
        seconds: ArrayLike | None = None,
    ) -> int:
        """Commit a block of n tests; after the return they are on the disk.

        A test that is already stored with the same values is skipped, even if one of the two lacks
        an output. A test that is stored as failed is replaced by its repetition. No other stored
        test can be changed. A design that another run has tested meanwhile is not stored again: its
        test is that of the point, too.

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
        if len(columns["test_point"]) == 0:
            return 0
        with self.writing(run), self._transaction(_WRITE) as (db, facts):
            self._adopt(db, facts, run, columns)
            columns = numbered(db, facts, run, columns)
            columns["seconds"] = np.full(len(columns["test"]), seconds, dtype=np.float64)
            columns, n_new = to_write(db, self.path, facts, columns)
            n_written = len(columns["test"])
            if n_written:
                widen(db, facts, columns)
                insert(db, facts["head"], columns, origin, columns["seconds"])
                count_tests(db, run, n_new)
        return n_written

    def adopt(self, columns: Columns, run: int) -> None:
        """Take tests of other runs for those of points of a run that have the same designs.

        Args:
            columns: ``test_point`` and the variables of n points, as for :meth:`append`.
            run: The run.

        Raises:
            StudyError: As :meth:`append`.
        """
        if len(self.facts()["runs"]) > 1:
            with self._transaction(_WRITE) as (db, facts):
                self._adopt(db, facts, run, columns)

    def _adopt(self, db: sqlite3.Connection, facts: Facts, run: int, columns: Columns) -> None:
        """Note the tests of other runs with the designs of points; see :meth:`adopt`."""
        n_others = sum(other.n_tests for other in facts["runs"] if other.number != run)
        if n_others == 0:
            return
        state = run, n_others, facts.get("n_changes", 0)
        if self._others[0] != state:
            self._others = state, tests_by_design(db, facts, run)
        tests = self._others[1]
        designs = design_checksums(facts["head"], columns).tolist()
        rows = []
        for test_point, design in zip(columns["test_point"].tolist(), designs, strict=True):
            if design in tests:
                rows.append((test_point, tests[design]))
        add_known(db, facts, run_of(facts, run), rows)

    def facts(self) -> dict[str, Any]:
        """Return the facts about the whole file: ``head``, ``id``, ``begun``, ``share``, ``runs``.

        Raises:
            StudyMismatchError: Another study has taken the place of this one.
            StudyVersionError: Another version of the package wrote the file.
            StudyCorruptError: The file is damaged, or no study.
            StudyAccessError: The file does not exist or cannot be read.
        """
        with self._transaction(_READ) as (_, facts):
            return facts

    def contents(
        self, first: int = 1, count: int = LAST, *, run: int | None = None
    ) -> tuple[dict[str, Any], Columns]:
        """Return the facts and stored tests, both of the same moment.

        Args:
            first: The number of the first test; of a run, its first test point.
            count: How many numbers, or test points, from there on.
            run: The run whose tests are returned; ``None`` for all tests.

        Returns:
            The facts, and the columns of the tests in the order of their numbers: those of
            :meth:`append`, and the integers ``test``, the number; ``run``; and ``repeat``. Of a
            run, they are in the order of its test points, which ``test_point`` has.

        Raises:
            StudyError: As :meth:`facts`.
        """
        last = min(first + count - 1, LAST)
        with self._transaction(_READ) as (db, facts):
            if run is None:
                return facts, selected(db, facts, first, last)
            return facts, selected_of_run(db, facts, run_of(facts, run), first, last)

    def numbers(self, first: int = 1, *, failed: bool = True, run: int | None = None) -> Integers:
        """Return the numbers of the stored tests, or the test points of a run, increasing.

        Args:
            first: The number of the first test, or the first test point of the run.
            failed: Whether failed tests are included.
            run: The run; ``None`` for all tests.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self._transaction(_READ) as (db, facts):
            if run is None:
                return stored_numbers(db, facts, first, LAST, failed)
            return stored_test_points(db, facts, run_of(facts, run), first, failed)

    def complete(self, columns: Columns) -> None:
        """Write what stored tests lacked after the last change of the head.

        Args:
            columns: ``test``, the numbers of n tests, and the columns with new values, which are
                NaN where they are not known; other columns stay as they are.

        Raises:
            StudyError: As :meth:`append`.
        """
        with self._transaction(_WRITE) as (db, facts):
            if len(columns) > 1:
                widen(db, facts, columns)
                rewrite(db, facts, columns)
            put(db, is_complete=True)

    def propose(self, proposals: Sequence[Proposal], run: int = 1) -> list[Proposal]:
        """Commit designs that are going to be tested, unless others are stored under their numbers.

        Args:
            proposals: The proposals in the order of their test points.
            run: Their run.

        Returns:
            The proposals that are stored under these test points now.

        Raises:
            StudyError: As :meth:`append`.
        """
        with self.writing(run), self._transaction(_WRITE) as (db, facts):
            stored = stored_proposals(db, facts, run, proposals[0][0], proposals[-1][0])
            if stored:
                return stored
            add_proposals(db, run, proposals)
        return list(proposals)

    def proposals(self, first: int, count: int, run: int = 1) -> list[Proposal]:
        """Return the proposals among the ``count`` test points from ``first`` of a run.

        Raises:
            StudyError: As :meth:`facts`.
        """
        with self._transaction(_READ) as (db, facts):
            return stored_proposals(db, facts, run, first, min(first + count - 1, LAST))

    @contextmanager
    def requests(self) -> Iterator[Requests]:
        """Yield the tests that people are asked for; what the body changes is committed together.

        Raises:
            StudyError: As :meth:`append`.
        """
        with self._transaction(_WRITE) as (db, facts):
            yield Requests(db, facts)

    @contextmanager
    def _transaction(self, begin: str) -> Iterator[tuple[sqlite3.Connection, Facts]]:
        """Yield a connection in a transaction, and the facts of what is still the same study.

        If the body raises, its changes are undone.
        """
        with reported(self.path):
            if not os.path.isfile(self.path):
                raise StudyAccessError(f"study {self.path} does not exist; check the name")
            require_own_journals(self.path)
            # "rw" also to read: SQLite then undoes what a killed writer has left, and takes a file
            # that must not be written as read-only. isolation_level=None: Python's module would
            # begin transactions by itself.
            uri = f"{Path(self.path).as_uri()}?mode=rw"
            connected = sqlite3.connect(uri, uri=True, timeout=_PATIENCE, isolation_level=None)
            with closing(connected) as db:
                db.execute("PRAGMA synchronous = EXTRA")  # a commit outlives a power failure
                db.execute("PRAGMA cell_size_check = ON")  # damage is reported, not read as content
                db.execute(begin)
                facts = read_facts(db, self.path)
                if self._id not in (None, facts["id"]):
                    raise StudyMismatchError(
                        f"study {self.path} is not the one that this run began or continued: "
                        "another has taken its place, and was left as it is; put the right file "
                        "back, or run again to continue this one"
                    )
                if begin == _WRITE and facts["format"] == OF_0_3:
                    convert(db, facts)
                yield db, facts
                db.execute("COMMIT")
        self._id = facts["id"]


def require_same_share(path: str, facts: Facts, others: Facts) -> None:
    """Refuse a study that is one of another number of shares."""
    if "share" in facts and "share" in others and facts["share"][1] != others["share"][1]:
        parts = f"one of {facts['share'][1]} shares, not of {others['share'][1]}"
        raise StudyMismatchError(f"study {path} is {parts}; give the name of another folder")


def write_study(path: str | PathLike[str], head: Head, columns: Columns) -> None:
    """Write tests as a new study, whole or not at all; see :class:`Study` for head and columns.

    Args:
        path: The file.
        head: The head; its ``problem`` may say the ``sampling`` of its points, or the points of
            several ``runs`` by their numbers.
        columns: The columns of :meth:`Study.contents`; of a single run, ``test_point`` is enough.

    Raises:
        StudyAccessError: There is a file of that name, or none can be written.
    """
    file = Study(path).path
    if os.path.lexists(file):
        raise StudyAccessError(
            f"study {file} exists already and was left as it is; give the name of a new file"
        )
    stored_head = json.loads(identity_text({"problem": None, **head}))
    problem = stored_head["problem"] or {}
    sampling = problem.pop("sampling", None)
    points_by_run = problem.pop("runs", None) or {"1": points_of(stored_head, sampling)}
    columns = _with_numbers(columns)
    runs = []
    for number, points in points_by_run.items():
        is_of_run = columns["run"] == int(number)
        test_points = columns["test_point"][is_of_run]
        segments = segments_of(test_points, columns["test"][is_of_run])
        runs.append(new_run(int(number), points, segments))
    create(file, {"head": with_outputs(stored_head, columns)}, runs, columns)


def _with_numbers(columns: Columns) -> Columns:
    """Return columns of tests with the numbers that those of a single run need not have."""
    ones = np.ones(len(columns["test_point"]), dtype=np.int64)
    test_points = np.asarray(columns["test_point"], dtype=np.int64)
    return {"test": test_points, "run": ones, "repeat": ones} | columns


def studies_in(folder: str | PathLike[str]) -> list[str]:
    """Return the paths of the studies in a folder, sorted."""
    return sorted(map(str, Path(folder).glob(f"*{SUFFIX}")))
