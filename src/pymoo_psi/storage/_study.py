"""A study: the tests of an investigation in a file, block after block."""

from __future__ import annotations

import filecmp
import json
import os
import secrets
import shutil
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from datetime import datetime, timezone
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._files import whole_file
from pymoo_psi._validation import identity_text, wrong_type
from pymoo_psi.errors import (
    StudyAccessError,
    StudyError,
    StudyLockedError,
    StudyMismatchError,
)
from pymoo_psi.storage import _database as database
from pymoo_psi.storage._database import Columns, Head, Proposal
from pymoo_psi.storage._format_1 import head_of_format_1, read_format_1
from pymoo_psi.storage._lock import locked
from pymoo_psi.storage._share import Share, studies_in

# Facts that are not of the head: of the file itself, and of the share that it is.
_OWN = ("format", "id", "begun", "tests", "checksum", "share", "points")


class Study:
    """A study file, by name: it may be copied, pickled, sent to processes and shared by threads.

    The tests of a block are committed together, or none of them. They stay, whatever happens to
    the process later. Reading never waits for a writer and never changes the file.

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
        self._kinds: Sequence[str] = ()  # of the variables, for a study of the first format
        # Its id and number of tests when it was seen last. Tests are never removed: a file with
        # another id or with fewer of them is not the one that was there.
        self._seen: tuple[str, int] | None = None

    def begin(
        self, head: Head, share: Share | None = None, points: tuple[int, int] = (1, 1)
    ) -> None:
        """Create the file, or make sure that the one that is there belongs to the same problem.

        Of a file that is there no more is read than its facts.

        Args:
            head: ``variables``, ``objectives``, ``inequalities``, ``equalities``: names;
                ``kinds``: "real", "integer", "binary" or "choice" for each variable; and what
                else makes the problem what it is, but for its outputs, which tests bring.
            share: Which share of an investigation the file is, if it is one. The other studies in
                its folder must belong to the same problem, too, and be shares of as many.
            points: First and last test point of that investigation, kept to tell what is missing.

        Raises:
            StudyMismatchError: The file belongs to another problem; the message says what differs.
            StudyError: It is damaged, no study, of a later version, or cannot be made or read.
            ArgumentTypeError: JSON cannot hold the head.
        """
        asked = json.loads(identity_text(head))
        self._kinds, self._seen = asked["kinds"], None
        own: dict[str, Any] = {}
        if share is not None:
            own = {"share": [share.part, share.of], "points": list(points)}
            self._require_others_alike(asked, share)
        if not os.path.lexists(self.path):
            with self.writing():
                # Again, as the owner of the lock before may have made it.
                if not os.path.lexists(self.path):
                    database.create(self.path, _begun() | asked | own)
        facts = database.read(self.path, self._facts)
        if facts["format"] == 1:  # which knows no kinds
            facts["kinds"] = asked["kinds"]
        if differing := differences(facts, asked, "in the study", "asked"):
            raise StudyMismatchError(
                f"study {self.path} belongs to another problem: {differing}. Give the "
                "name of another file, or the problem (and study_key) with which it was begun"
            )
        if own and facts.get("share") != own["share"]:
            raise StudyMismatchError(
                f"study {self.path} must be share {share}, and is none; move it away"
            )
        if own and facts["points"] != (known := span([facts, own])):
            with self.writing(), database.transaction(self.path) as db:
                database.put_facts(db, points=known)

    def _require_others_alike(self, head: Head, share: Share) -> None:
        """Refuse a share of another problem or cut than the other studies in its folder."""
        for path in studies_in(os.path.dirname(self.path)):
            try:
                facts = database.read(path, Study(path)._facts)
            except StudyError:
                continue  # it is in nobody's way, and told when the folder is read
            if facts.get("share", [1, share.of])[1] != share.of:
                raise StudyMismatchError(
                    f"study {path} is one of {facts['share'][1]} shares, and its folder takes no "
                    f"share {share}: give a share of {facts['share'][1]}, or continue with the "
                    "study that 'pymoo-psi merge' makes of the folder"
                )
            if facts["format"] > 1 and (other := differences(facts, head, "there", "asked")):
                raise StudyMismatchError(
                    f"study {path} in the same folder belongs to another problem: {other}. Give "
                    "the name of another folder, or the problem (and study_key) of that study"
                )

    def writing(self) -> AbstractContextManager[None]:
        """Keep others from writing while the body runs, so that none repeats its work.

        Without it, :meth:`append` does so for the time of one block. It may be nested. Threads of
        this process wait for their turn.

        Raises:
            StudyLockedError: Another process is writing; the message says which, where, and since
                when. One that was killed is in nobody's way.
            StudyAccessError: The folder cannot be written.
        """
        return locked(self.path, self.wait)

    def append(
        self,
        columns: Columns,
        *,
        origin: str | None = None,
        seconds: ArrayLike | None = None,
    ) -> int:
        """Commit a block of n tests; after the return they are on the disk.

        A test that is stored already with the same values is left alone. One that is stored as
        failed is replaced by its repetition. No other stored test can be changed.

        Args:
            columns: ``(n,)`` each: ``test_point``, the numbers; the variables, criteria and
                constraints by name, choices as texts; ``status``; ``reason``, texts; and numbers
                that the model gives besides, its outputs, which may be others each time.
            origin: Where the designs come from.
            seconds: What the evaluation of a design took, one number or ``(n,)``.

        Returns:
            How many tests were new or replaced.

        Raises:
            StudyMismatchError: Another study, or an older copy of this one, has taken its place.
            ArgumentValueError: A test is stored with other values.
            StudyLockedError: Another process is writing.
            StudyAccessError: The disk is full, or file or folder cannot be written.
            StudyCorruptError: The file is damaged.
        """
        facts = database.read(self.path, self._facts)
        if facts["format"] == 1:
            self._convert()
            facts = database.read(self.path, self._facts)

        def changes(db: sqlite3.Connection) -> tuple[list[Any], NDArray[np.bool_], list[int]]:
            facts = self._facts(db)
            cells = database.cells_of(columns, facts, origin, seconds)
            return cells, *database.changes(db, self.path, facts, cells)

        # Without the lock first: a run that repeats what is stored waits for nobody and writes
        # nothing. Under the lock it is asked again, since another writer may have stored the tests
        # meanwhile, or outputs that this one does not know.
        if not database.read(self.path, changes)[1].any():
            return 0
        with self.writing(), database.transaction(self.path) as db:
            if added := database.unknown_outputs(columns, stored := self._facts(db)):
                database.add_outputs(db, self.path, stored, added)
            cells, new, replaced = changes(db)
            tests = database.put_tests(db, self._facts(db), cells, new, replaced)
        self._seen = (facts["id"], tests)
        return int(new.sum())

    def columns(self, first: int, count: int) -> Columns:
        """Return the stored tests among the ``count`` test points from number ``first``, checked.

        Raises:
            StudyMismatchError: Another study, or an older copy of this one, has taken its place.
            StudyError: A test is damaged, or the file cannot be read.
        """
        last = first + count - 1

        def query(db: sqlite3.Connection) -> Columns:
            facts = self._facts(db)
            if facts["format"] > 1:
                return database.stored_tests(db, self.path, facts, first, last)
            columns = read_format_1(db, self.path, self._kinds)[1]
            wanted = (first <= columns["test_point"]) & (columns["test_point"] <= last)
            return {name: column[wanted] for name, column in columns.items()}

        return database.read(self.path, query)

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
        first, last = proposals[0][0], proposals[-1][0]
        with self.writing(), database.transaction(self.path) as db:
            self._facts(db)
            if not (stored := database.stored_proposals(db, self.path, first, last)):
                database.put_proposals(db, proposals)
        return stored or list(proposals)

    def proposals(self, first: int, count: int) -> list[Proposal]:
        """Return what is proposed of the ``count`` test points from number ``first``, checked.

        Raises:
            StudyError: As :meth:`columns`.
        """

        def query(db: sqlite3.Connection) -> list[Proposal]:
            self._facts(db)
            return database.stored_proposals(db, self.path, first, first + count - 1)

        return database.read(self.path, query)

    def _facts(self, db: sqlite3.Connection) -> dict[str, Any]:
        """Return the facts of the file after making sure that it is still the same study."""
        facts = database.stored_facts(db, self.path)
        if self._seen is not None:
            name, tests = self._seen
            replaced = ""
            if facts.get("id") != name:
                replaced = "another study"
            elif facts["tests"] < tests:
                replaced = "an older copy of it"
            if replaced:
                raise StudyMismatchError(
                    f"study {self.path} is not the one that this run began or continued: "
                    f"{replaced} has taken its place, and was left as it is; put the right file "
                    "back, or run again to continue this one"
                )
        if facts["format"] == 1:
            return facts | head_of_format_1(db, self.path)[0]
        self._seen = (facts["id"], facts["tests"])
        return facts

    def _convert(self) -> None:
        """Give a study of the first format today's; the old file stays, as ``<study>-format-1``."""
        kept = f"{self.path}-format-1"
        with self.writing(), database.told(self.path):
            if database.read(self.path, self._facts)["format"] > 1:
                return  # another process has done so
            head, columns = database.read(
                self.path, lambda db: read_format_1(db, self.path, self._kinds)
            )
            with database.transaction(self.path):
                pass  # which ends with a checkpoint
            if database.stamp(self.path) is None:  # its log must not lie beside the new file
                raise StudyLockedError(
                    f"study {self.path} has format 1 and cannot be continued while another "
                    "program reads it; close that program, then run again"
                )
            if os.path.lexists(kept) and not filecmp.cmp(kept, self.path, shallow=False):
                raise StudyAccessError(
                    f"study {self.path} has format 1 and cannot be continued: {kept} is there, "
                    "the name under which it would be kept; move that file away"
                )
            with whole_file(kept) as copy:
                shutil.copyfile(self.path, copy)
            with whole_file(self.path) as new:
                database.create(str(new), _begun() | head)
                Study(new).append(columns)


def read_study(path: str | PathLike[str]) -> tuple[dict[str, Any], Columns]:
    """Return the head and all tests of a study, by number, after a check of everything in it.

    Returns:
        The head with which it was begun, and the columns of its tests; see :class:`Study`.

    Raises:
        StudyCorruptError: The file is damaged, or no study.
        StudyVersionError: A later version wrote it.
        StudyAccessError: It does not exist or cannot be read.
    """
    facts, columns = read_facts(Study(path).path)
    return head_in(facts), columns


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
    with database.told(file), whole_file(file) as new:
        database.require_own(file, new=True)
        database.create(str(new), _begun() | {"problem": None} | dict(head))
        study = Study(new)
        for start in range(0, len(columns["test_point"]), database.AT_A_TIME):
            part = slice(start, start + database.AT_A_TIME)
            study.append({name: column[part] for name, column in columns.items()})


def read_facts(file: str) -> tuple[dict[str, Any], Columns]:
    """Return the facts of a study, of the first format its head only, and all its tests."""

    def query(db: sqlite3.Connection) -> tuple[dict[str, Any], Columns]:
        facts = database.stored_facts(db, file)
        if facts["format"] == 1:
            return read_format_1(db, file)
        return facts, database.stored_tests(db, file, facts)

    return database.read(file, query)


def begun(file: str) -> str:
    """Return when a study was begun.

    Raises:
        StudyError: It is none, or damaged.
    """
    path = os.path.realpath(file)
    return str(database.read(path, lambda db: database.stored_facts(db, path)["begun"]))


def _begun() -> dict[str, Any]:
    now = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
    return {"format": database.VERSION, "id": secrets.token_hex(16), "begun": now}


def head_in(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of the facts is the head."""
    return {name: value for name, value in facts.items() if name not in _OWN}


def span(shares: Sequence[Mapping[str, Any]]) -> list[int]:
    """Return the first and the last point of the investigations that shares are of."""
    firsts, lasts = zip(*(facts["points"] for facts in shares), strict=True)
    return [min(firsts), max(lasts)]


def differences(facts: Mapping[str, Any], head: Head, here: str, there: str) -> str:
    """Say in what the head among facts differs from another one; empty if in nothing."""
    # A prototype is carried along, and outputs are those that tests have brought so far.
    free = {"prototype": None, "outputs": None}
    one, other = ({**h, **free} for h in (head_in(facts), head))
    pairs = list(_differences(_by_variable(one), _by_variable(other)))
    # The name of the problem says more than its variables, of which there may be many.
    pairs.sort(key=lambda pair: pair[0] != "problem.problem")
    told = [f"{name} is {_short(a)} {here}, {_short(b)} {there}" for name, a, b in pairs]
    more = len(told) - _TOLD
    return "; ".join(told[:_TOLD]) + (f"; and {more} more" if more > 0 else "")


def _by_variable(head: Head) -> dict[str, Any]:
    """Return a head whose messages name the variable of a bound or kind, not its index."""
    keys = ("lower", "upper", "kinds")
    return {**head, **{k: dict(zip(head["variables"], head[k], strict=True)) for k in keys}}


def _differences(stored: Any, asked: Any, name: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield where two JSON values differ, and both; NaN is equal to NaN, 2 is not 2.0."""
    if isinstance(stored, dict) and isinstance(asked, dict):
        for key in sorted({*stored, *asked}):
            inner = f"{name}.{key}" if name else key
            yield from _differences(stored.get(key, _ABSENT), asked.get(key, _ABSENT), inner)
    elif isinstance(stored, list) and isinstance(asked, list) and len(stored) == len(asked):
        for i, pair in enumerate(zip(stored, asked, strict=True)):
            yield from _differences(*pair, f"{name}[{i}]")
    elif _shown(stored) != _shown(asked):
        yield name, _shown(stored), _shown(asked)


_ABSENT = object()
_TOLD = 4  # differences that a message names


def _short(text: str) -> str:
    return text if len(text) <= 120 else f"{text[:117]}..."


def _shown(value: Any) -> str:
    return "absent" if value is _ABSENT else json.dumps(value, ensure_ascii=False)
