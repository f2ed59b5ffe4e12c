"""Study files that are not there, not ours, or of another time."""

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from pymoo_psi import TestTable
from pymoo_psi.errors import StudyAccessError, StudyCorruptError, StudyVersionError
from pymoo_psi.storage import Study, read_study
from pymoo_psi.table import Layout
from tests.storage.studies import LAYOUT, PROBLEM, bits, block, contents, new_study

FIXTURE = Path(__file__).parent / "fixtures" / "study_version_1.db"


@pytest.fixture
def study(tmp_path):
    return new_study(tmp_path)


def test_reading_creates_nothing(tmp_path):
    for call in (
        read_study,
        lambda path: Study(path).numbers(),
        lambda path: Study(path).append(block(1, 1)),
    ):
        with pytest.raises(
            StudyAccessError, match=r"study .*none.db does not exist; check the name"
        ):
            call(tmp_path / "none.db")
    assert os.listdir(tmp_path) == []


def other_database(path, pragma="user_version = 1"):
    with closing(sqlite3.connect(path)) as db:
        db.execute(f"PRAGMA {pragma}")
        db.execute("CREATE TABLE tests (number INTEGER PRIMARY KEY)")


FOREIGN = {
    "empty": lambda path: path.write_bytes(b""),
    "csv": lambda path: path.write_text("test_point,x1\n1,0.5\n" * 1000),
    "short": lambda path: path.write_bytes(b"SQLite format 3\0"),
    "database": other_database,
    "wal database": lambda path: other_database(path, "journal_mode = WAL"),
}


@pytest.mark.parametrize("make", FOREIGN.values(), ids=FOREIGN)
def test_a_foreign_file_is_left_alone(tmp_path, make):
    path = tmp_path / "mine.db"
    make(path)
    before = contents(tmp_path)
    study = Study(path)
    for call in (
        read_study,
        lambda _: study.begin(LAYOUT, PROBLEM),
        lambda _: study.append(block(1, 1)),
    ):
        with pytest.raises(
            StudyCorruptError,
            match=r"mine.db must be a study file of pymoo-psi, but it is .*; it was left as it is",
        ):
            call(path)
    assert contents(tmp_path) == before


def test_a_folder_is_no_study(tmp_path):
    with pytest.raises(StudyAccessError, match="is no file"):
        Study(tmp_path).begin(LAYOUT, PROBLEM)


def test_a_log_without_its_file_is_not_taken_for_that_of_a_new_study(tmp_path):
    (tmp_path / "s.db-wal").write_bytes(b"committed tests")
    with pytest.raises(
        StudyCorruptError, match="its log .*s.db-wal is there, but the file itself is missing"
    ):
        Study(tmp_path / "s.db").begin(LAYOUT, PROBLEM)
    assert contents(tmp_path) == {"s.db-wal": b"committed tests"}


def test_a_later_version_is_said_to_be_one(study):
    study.append(block(1, 2))
    with closing(sqlite3.connect(study.path)) as db:
        db.execute("PRAGMA user_version = 2")
        db.execute("ALTER TABLE study ADD COLUMN more")
        db.execute("UPDATE study SET seal = x'00'")
        db.commit()
    before = contents(Path(study.path).parent)
    for call in (
        study.table,
        lambda: study.begin(LAYOUT, PROBLEM),
        lambda: study.append(block(3, 1)),
    ):
        with pytest.raises(
            StudyVersionError,
            match="has format 2, but this version of pymoo-psi knows formats up to 1; upgrade pymoo-psi",
        ):
            call()
    assert contents(Path(study.path).parent) == before


# The first version. Its file was made by
#     study = Study("tests/fixtures/study_version_1.db")
#     study.begin(first_layout(), FIRST); study.append(first_table())
# under format version 1. A change of format adds a fixture and leaves this one.

FIRST = {
    "problem": "π",
    "kinds": ["real", "choice", "integer"],
    "sampling": {"first": 1},
    "key": None,
}


def first_layout():
    return Layout.of(
        ["u", "steel", "n"], ["f1", "Kosten"], 1, 1, lower=[0.1, np.nan, 0], upper=[0.3, np.nan, 9]
    )


def first_table():
    X = [[0.1 + 0.2, "S235", 3], [0.1, 1.5, True], [0.3, 1.5, 2.5], [-0.0, "", 2**70]]
    F = [[1 / 3, -0.0], [np.inf, 1e-310], [np.nan, np.nan], [-np.inf, 7.0]]
    reasons = {3: "ZeroDivisionError: ÷ by 0\nin line 7", 900: "f1 is -inf"}
    H = [[0.0], [1e-4], [np.nan], [0.0]]
    return TestTable.of(
        [1, 2, 3, 900],
        X,
        F,
        [[0.0], [1.0], [np.nan], [-1.0]],
        H,
        reasons=reasons,
        layout=first_layout(),
    )


def test_a_file_of_the_first_version_opens_and_continues(tmp_path):
    before = FIXTURE.read_bytes()
    assert bits(read_study(FIXTURE)) == bits(first_table())
    assert FIXTURE.read_bytes() == before
    study = Study(shutil.copy(FIXTURE, tmp_path))
    assert bits(study.begin(first_layout(), FIRST)) == bits(first_table())
    more = TestTable.of([4], [[0.2, "S", 1]], [[1, 2]], [[0]], [[0]], layout=first_layout())
    study.append(more)
    assert study.table().merge(first_table()).numbers.tolist() == [1, 2, 3, 4, 900]
