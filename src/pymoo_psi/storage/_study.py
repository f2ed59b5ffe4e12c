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
from numpy.typing import NDArray

from pymoo_psi._files import whole_file
from pymoo_psi.errors import (
    ArgumentTypeError,
    StudyAccessError,
    StudyLockedError,
    StudyMismatchError,
)
from pymoo_psi.storage import _database as database
from pymoo_psi.storage._database import Columns, Head
from pymoo_psi.storage._format_1 import head_of_format_1, read_format_1
from pymoo_psi.storage._lock import locked

_OWN = ("format", "id", "begun", "tests", "checksum")  # facts that are not of the head


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
            raise ArgumentTypeError(f"path must be the name of a file, got {path!r:.80}")
        self.path: str = os.path.realpath(path)
        self.wait = wait
        self._kinds: Sequence[str] = ()  # of the variables, for a study of the first format
        # Its id and number of tests when it was seen last. Tests are never removed: a file with
        # another id or with fewer of them is not the one that was there.
        self._seen: tuple[str, int] | None = None

    def begin(self, head: Head) -> None:
        """Create the file, or make sure that the one that is there belongs to the same problem.

        Of a file that is there no more is read than its facts.

        Args:
            head: ``variables``, ``objectives``, ``inequalities``, ``equalities``: names;
                ``kinds``: "real", "integer", "binary" or "choice" for each variable; and what
                else makes the problem what it is, but for its outputs, which tests bring.

        Raises:
            StudyMismatchError: The file belongs to another problem; the message says what differs.
            StudyError: It is damaged, no study, of a later version, or cannot be made or read.
            ArgumentTypeError: JSON cannot hold the head.
        """
        try:
            asked = json.loads(json.dumps(head))
        except (TypeError, ValueError, RecursionError) as error:
            raise ArgumentTypeError(
                "what fingerprint() of a problem returns must hold plain values, numbers, texts, "
                f"True, False, None, lists and dicts of Python: {error}"
            ) from None
        self._kinds, self._seen = asked["kinds"], None
        if not os.path.lexists(self.path):
            with self.writing():
                # Again, as the owner of the lock before may have made it.
                if not os.path.lexists(self.path):
                    database.create(self.path, _begun() | asked)
        facts = database.read(self.path, self._facts)
        if facts["format"] == 1:  # which knows no kinds
            facts["kinds"] = asked["kinds"]
        facts.pop("outputs", None)
        differences = list(_differences(_by_variable(_head(facts)), _by_variable(asked)))
        if differences:
            raise StudyMismatchError(
                f"study {self.path} belongs to another problem: {'; '.join(differences)}. Give the "
                "name of another file, or the problem (and study_key) with which it was begun"
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
        seconds: float | None = None,
    ) -> int:
        """Commit a block of n tests; after the return they are on the disk.

        A test that is stored already with the same values is left alone. One that is stored as
        failed is replaced by its repetition. No other stored test can be changed.

        Args:
            columns: ``(n,)`` each: ``test_point``, the numbers; the variables, criteria and
                constraints by name, choices as texts; ``status``; ``reason``, texts; and numbers
                that the model gives besides, its outputs, which may be others each time.
            origin: Where the designs come from.
            seconds: What the evaluation of a design took.

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
    file = Study(path).path

    def query(db: sqlite3.Connection) -> tuple[dict[str, Any], Columns]:
        facts = database.stored_facts(db, file)
        if facts["format"] == 1:
            return read_format_1(db, file)
        return _head(facts), database.stored_tests(db, file, facts)

    return database.read(file, query)


def _begun() -> dict[str, Any]:
    now = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
    return {"format": database.VERSION, "id": secrets.token_hex(16), "begun": now}


def _head(facts: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in facts.items() if name not in _OWN}


def _by_variable(head: Head) -> dict[str, Any]:
    """Return a head whose messages name the variable of a bound or kind, not its index."""
    keys = ("lower", "upper", "kinds")
    return {**head, **{k: dict(zip(head["variables"], head[k], strict=True)) for k in keys}}


def _differences(stored: Any, asked: Any, name: str = "") -> Iterator[str]:
    """Say where two JSON values differ; NaN is equal to NaN, 2 is not 2.0."""
    if isinstance(stored, dict) and isinstance(asked, dict):
        for key in sorted({*stored, *asked}):
            inner = f"{name}.{key}" if name else key
            yield from _differences(stored.get(key, _ABSENT), asked.get(key, _ABSENT), inner)
    elif isinstance(stored, list) and isinstance(asked, list) and len(stored) == len(asked):
        for i, pair in enumerate(zip(stored, asked, strict=True)):
            yield from _differences(*pair, f"{name}[{i}]")
    elif _shown(stored) != _shown(asked):
        yield f"{name} is {_shown(stored)} in the study, {_shown(asked)} asked"


_ABSENT = object()


def _shown(value: Any) -> str:
    return "absent" if value is _ABSENT else json.dumps(value, ensure_ascii=False)
