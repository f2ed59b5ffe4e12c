"""Study files that are not there, foreign, damaged, replaced, or of another version."""

import errno
import os
import re
import sqlite3
import sys
from pathlib import Path

import numpy as np
import pytest

from pymoo_psi.errors import (
    StudyAccessError,
    StudyCorruptError,
    StudyError,
    StudyMismatchError,
)
from pymoo_psi.study import Study
from tests.helpers.processes import posix
from tests.helpers.refusals import refused
from tests.helpers.studies import (
    begun,
    bits,
    block,
    contents,
    read,
    sql,
)


@pytest.fixture
def study(tmp_path):
    study = begun(tmp_path / "door")
    study.append(block(1, 8))
    return study


CALLS = (
    read,
    lambda path: Study(path).append(block(1, 1)),
    lambda path: Study(path).contents()[1],
    begun,
)


def refused_and_left(path, message, calls=CALLS, error=StudyCorruptError):
    """Require that calls refuse the file, and change nothing in its folder."""
    before = contents(path.parent)
    for call in calls:
        refused(message, call, path, error=error)
    assert contents(path.parent) == before


@pytest.mark.skipif(sys.platform != "linux", reason="it lists what a process has open")
def test_a_study_is_open_only_while_it_is_used(study):
    """Elsewhere, an open file can be neither moved nor deleted."""
    study.append(block(9, 2))
    opened = {os.path.realpath(entry) for entry in Path("/proc/self/fd").iterdir()}
    assert os.path.realpath(study.path) not in opened


# Not there, foreign


def test_reading_creates_nothing(tmp_path):
    refused_and_left(
        tmp_path / "none.db", "none.db does not exist; check", CALLS[:3], StudyAccessError
    )


FOREIGN = {
    "empty": lambda path: path.write_bytes(b""),
    "csv": lambda path: path.write_text("test_point,x1\n1,0.5\n" * 1000),
    "short": lambda path: path.write_bytes(b"SQLite format 3\0"),
    "database": lambda path: sql(path, "PRAGMA user_version = 1", "CREATE TABLE tests (x)"),
    "wal database": lambda path: sql(path, "PRAGMA journal_mode = WAL", "CREATE TABLE t (x)"),
}


@pytest.mark.parametrize("make", FOREIGN.values(), ids=FOREIGN)
def test_a_foreign_file_is_left_alone(tmp_path, make):
    make(tmp_path / "mine.db")
    refused_and_left(tmp_path / "mine.db", r"mine.db is no study of .*; it was left as it is")


def test_the_error_of_a_damaged_study_is_what_sqlite_finds(study):
    query = "SELECT rootpage FROM sqlite_master WHERE name IN ('meta', 'sqlite_autoindex_tests_1')"
    (meta,), (index,) = sql(study.path, f"{query} ORDER BY name")
    pages = np.frombuffer(Path(study.path).read_bytes(), np.uint8).reshape(-1, 4096).copy()
    pages[meta - 1] = pages[index - 1]
    Path(study.path).write_bytes(pages.tobytes())
    refused_and_left(Path(study.path), "or damaged: .* in meta")


# A study whose file is replaced while a run writes


def test_a_replaced_study_is_noticed(study, tmp_path):
    study.append(block(9, 4))
    begun(tmp_path / "other").append(block(1, 20))  # of the same problem
    os.replace(tmp_path / "other", study.path)
    calls = (lambda path: study.append(block(13, 4)), lambda path: study.contents()[1])
    message = "has taken its place, and was left as it is"
    refused_and_left(Path(study.path), message, calls, StudyMismatchError)


# An ordinary database: what users add stays, except what changes tests


def test_views_of_users_stay_when_columns_are_added(study_file):
    study, expected, added = begun(study_file), block(1, 8), block(9, 4)
    study.append(expected, origin="LP-tau", seconds=0.5)
    sql(
        study_file,
        "CREATE VIEW light AS SELECT f2, origin, seconds FROM tests "
        "WHERE f1 < 0 AND origin NOT NULL ORDER BY test",
        "CREATE INDEX fast ON tests (f1)",
        "CREATE TABLE notes (test, note)",
        "INSERT INTO notes VALUES (7, 'noisy')",
    )
    study.append(added | {"heat": added["f1"]})
    assert sql(study_file, "SELECT * FROM notes") == [(7, "noisy")]
    light = [(f2, "LP-tau", 0.5) for f2 in expected["f2"][expected["f1"] < 0]]
    assert sql(study_file, "SELECT * FROM light") == light


REFUSED = {
    r"door has format 99, but .* reads format 1;": ["PRAGMA user_version = 99", "DROP TABLE meta"],
    "has the trigger loss, .*DROP TRIGGER": [
        "CREATE TRIGGER loss AFTER INSERT ON tests BEGIN DELETE FROM tests WHERE test < 9; END"
    ],
    "lacks the table meta": [
        "ALTER TABLE meta RENAME TO m",
        "CREATE VIEW meta(key, value) AS WITH RECURSIVE r(x) AS "
        "(SELECT 1 UNION ALL SELECT x + 1 FROM r) SELECT x, x FROM r",
    ],
}


@pytest.mark.parametrize("what", REFUSED)
def test_other_versions_and_replaced_tables_are_refused(study, what):
    sql(study.path, *REFUSED[what])
    refused_and_left(Path(study.path), what)


def test_a_full_disk_costs_nothing_stored(study, tmp_path, monkeypatch):
    connect = sqlite3.connect

    def full(*arguments, **options):
        db = connect(*arguments, **options)
        db.execute("PRAGMA max_page_count = 8")
        return db

    monkeypatch.setattr(sqlite3, "connect", full)
    said = "door cannot be used: .* full; .* disk is not full, .*what was stored before is kept"
    refused(said, study.append, block(9, 5000), error=StudyAccessError)
    assert bits(read(study.path)[1]) == bits(block(1, 8))


@posix
def test_a_file_system_without_locks_is_refused(study, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("fcntl.lockf", refuse)
    refused(
        "cannot be used: No locks available; .* file system has locks",
        study.append,
        block(9, 4),
        error=StudyAccessError,
    )


# Damage


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The bytes of a study of many pages."""
    study = begun(tmp_path_factory.mktemp("whole") / "s.db")
    study.append(block(1, 200, failed=[7]), origin="LP-tau")
    return Path(study.path).read_bytes()


def is_reported(path):
    """Damage is reported by an error that names the file, and the file is as it was."""
    refused_and_left(path, re.escape(str(path)), [read], StudyError)


def test_a_file_that_was_cut_is_recognised(study_file, whole):
    assert len(whole) >= 6 * 4096
    edges = {k + d for k in range(0, len(whole), 4096) for d in (-1, 0, 1)}  # of pages
    for n in {*edges, *range(0, 120, 7)} & {*range(len(whole))}:
        study_file.write_bytes(whole[:n])
        is_reported(study_file)


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE tests SET x = 'three' WHERE test = 7",
        "UPDATE tests SET n = NULL WHERE test = 7",
        "UPDATE tests SET status = CAST(x'ff' AS TEXT) WHERE test = 8",
        "UPDATE meta SET value = '{' WHERE key = 'head'",
        "DELETE FROM meta",
        "ALTER TABLE tests DROP COLUMN f2",
    ],
)
def test_edits_by_hand_that_cannot_be_read_are_reported(study_file, whole, statement):
    study_file.write_bytes(whole)
    sql(study_file, statement)
    is_reported(study_file)
