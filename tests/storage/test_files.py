"""Study files that are not there, not ours, replaced, of another time, and the files beside them."""

import os
import shutil
import sqlite3
from contextlib import closing, nullcontext, suppress
from pathlib import Path

import numpy as np
import pytest

from pymoo_psi import TestTable
from pymoo_psi.errors import (
    StudyAccessError,
    StudyCorruptError,
    StudyError,
    StudyMismatchError,
    StudyVersionError,
)
from pymoo_psi.storage import Study, read_study
from pymoo_psi.table import Layout, columns_of, head_of
from tests.storage.studies import HEAD, begun, bits, block, contents

FIXTURE = Path(__file__).parent / "fixtures" / "study_version_1.db"


@pytest.fixture
def study(tmp_path):
    study = begun(tmp_path / "door")
    study.append(block(1, 8))
    return study


def calls(path):
    study = Study(path)
    return (
        lambda: read_study(path),
        lambda: study.begin(HEAD),
        lambda: study.append(block(1, 1)),
        lambda: study.columns(1, 5),
    )


def test_reading_creates_nothing(tmp_path):
    read, _, append, columns = calls(tmp_path / "none.db")
    for call in (read, append, columns):
        with pytest.raises(
            StudyAccessError, match=r"study .*none.db does not exist; check the name"
        ):
            call()
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
    for call in calls(path):
        with pytest.raises(
            StudyCorruptError,
            match=r"mine.db must be a study file of pymoo-psi, but it is .*; it was left as it is",
        ):
            call()
    assert contents(tmp_path) == before


def test_a_folder_is_no_study(tmp_path):
    with pytest.raises(StudyAccessError, match="is no file"):
        Study(tmp_path).begin(HEAD)


def test_a_file_cannot_be_made_below_a_file_or_nowhere(tmp_path):
    (tmp_path / "file").write_text("")
    for name in ("file/s.db", "missing/s.db"):
        with pytest.raises(
            StudyAccessError,
            match=rf"study .*{name}.pymoo-psi-lock cannot be used: .*; check that its folder exists and that you may write",
        ):
            begun(tmp_path / name)
    assert os.listdir(tmp_path) == ["file"]


# Files beside a study

TAKEN = (".pymoo-psi-lock", "-journal", "-wal", "-shm")  # names that SQLite or the lock needs
SUFFIXES = (*TAKEN, "-lock", "-new", "-format-1", ".tmp")
MINE = {
    "a text": lambda path: path.write_text("my notes\n" * 100),
    "nothing": lambda path: path.write_bytes(b""),
    "a study": lambda path: begun(path).append(block(1, 3)),
    "zeros": lambda path: path.write_bytes(bytes(5000)),
}


# An empty file of the lock's name is what a process leaves that is killed while it makes the lock.
CASES = [(s, m) for s in SUFFIXES for m in MINE if (s, m) != (".pymoo-psi-lock", "nothing")]


@pytest.mark.parametrize(("suffix", "what"), CASES)
def test_a_study_is_begun_without_touching_files_beside_it(tmp_path, suffix, what):
    """It is begun, or refused because of a name that SQLite or the lock needs."""
    beside = tmp_path / f"door{suffix}"
    MINE[what](beside)
    before = beside.read_bytes(), beside.stat().st_mtime_ns
    refused = suffix in TAKEN
    with pytest.raises(StudyError, match=str(beside)) if refused else nullcontext():
        begun(tmp_path / "door", wait=0).append(block(1, 2))
    assert sorted(os.listdir(tmp_path)) == [*([] if refused else ["door"]), beside.name]
    assert (beside.read_bytes(), beside.stat().st_mtime_ns) == before


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("make", [MINE["a text"], MINE["a study"]], ids=["a text", "a study"])
def test_a_study_is_continued_without_touching_files_beside_it(study, suffix, make):
    beside = Path(f"{study.path}{suffix}")
    make(beside)
    before = beside.read_bytes(), beside.stat().st_mtime_ns
    study.wait = 0
    with pytest.raises(StudyError, match=str(beside)) if suffix in TAKEN else nullcontext():
        study.append(block(9, 2))
    with suppress(StudyError):
        read_study(study.path)
    assert (beside.read_bytes(), beside.stat().st_mtime_ns) == before
    beside.unlink()
    study.append(block(9, 2))
    assert bits(read_study(study.path)[1]) == bits(block(1, 10))
    assert os.listdir(Path(study.path).parent) == ["door"]


def test_an_empty_lock_is_taken(study):
    """As a process leaves it that is killed before it has written who it is."""
    Path(f"{study.path}.pymoo-psi-lock").touch()
    assert study.append(block(9, 2)) == 2
    assert os.listdir(Path(study.path).parent) == ["door"]


# A study whose file is replaced while a run writes


def another_key(path, folder):
    begun(folder / "other", HEAD | {"problem": {"key": "v2"}}).append(block(1, 20, seed=1))
    os.replace(folder / "other", path)


def another_of_the_same_problem(path, folder):
    begun(folder / "other").append(block(1, 20))
    os.replace(folder / "other", path)


def an_older_copy(path, folder):
    shutil.copyfile(folder / "older", path)


def an_older_copy_by_rename(path, folder):
    os.replace(folder / "older", path)


def a_link_to_another(path, folder):
    another_key(folder / "linked", folder)
    os.unlink(path)
    os.link(folder / "linked", path)


def a_second_name(path, folder):
    os.link(path, folder / "second")


def of_the_first_format(path, folder):
    shutil.copyfile(FIXTURE, path)


REPLACED = [
    another_key,
    another_of_the_same_problem,
    an_older_copy,
    an_older_copy_by_rename,
    a_link_to_another,
    of_the_first_format,
]


@pytest.mark.parametrize("replace", [*REPLACED, a_second_name], ids=lambda f: f.__name__)
def test_a_replaced_study_is_noticed_at_the_next_commit(study, tmp_path, replace):
    shutil.copyfile(study.path, tmp_path / "older")
    study.append(block(9, 4))
    replace(study.path, tmp_path)
    before = contents(tmp_path)
    with pytest.raises(
        StudyError, match="has taken its place, and was left as it is|second name, a hard link"
    ):
        study.append(block(13, 4))
    assert contents(tmp_path) == before


@pytest.mark.parametrize("replace", REPLACED, ids=lambda f: f.__name__)
def test_a_replaced_study_is_noticed_before_its_tests_are_taken(study, tmp_path, replace):
    shutil.copyfile(study.path, tmp_path / "older")
    study.append(block(9, 4))
    replace(study.path, tmp_path)
    with pytest.raises(StudyMismatchError, match="has taken its place, and was left as it is"):
        study.columns(1, 8)


def test_a_copy_that_others_continued_is_taken(study, tmp_path):
    study.append(block(9, 4))
    os.replace(shutil.copy(study.path, tmp_path / "moved"), study.path)
    Study(study.path).append(block(13, 4))
    study.append(block(17, 4))
    assert bits(read_study(study.path)[1]) == bits(block(1, 20))


# Versions


def test_a_later_version_is_said_to_be_one(study):
    with closing(sqlite3.connect(study.path)) as db:
        db.execute("PRAGMA user_version = 4")
        db.execute("ALTER TABLE facts ADD COLUMN more")
        db.execute("UPDATE facts SET value = '1' WHERE name = 'seal'")
        db.commit()
    before = contents(Path(study.path).parent)
    for call in calls(study.path):
        with pytest.raises(
            StudyVersionError,
            match="has format 4, but this version of pymoo-psi knows formats up to 3; install a later one",
        ):
            call()
    assert contents(Path(study.path).parent) == before


# The first version. Its file was made under format version 1 by
#     study = Study("tests/fixtures/study_version_1.db")
#     study.begin(first_layout(), FIRST); study.append(first_table())
# A change of format adds a fixture and leaves this one.

FIRST = {
    "problem": "π",
    "kinds": ["real", "choice", "integer"],
    "sampling": {"first": 1},
    "key": None,
}


def first_layout(**kinds):
    return Layout.of(
        ["u", "steel", "n"], ["f1", "Kosten"], 1, 1, lower=[0.1, np.nan, 0], upper=[0.3, np.nan, 9], **kinds
    )  # fmt: skip


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


def exact(table):
    cells = [[(type(cell), repr(cell)) for cell in row] for row in table.X.tolist()]
    return cells, bits(columns_of(table))


def test_a_file_of_the_first_format_is_read(tmp_path):
    before = FIXTURE.read_bytes()
    table = TestTable.read_study(FIXTURE)
    assert exact(table) == exact(first_table())
    table.to_csv(tmp_path / "table.csv")
    assert TestTable.read_csv(tmp_path / "table.csv").equals(table)
    assert FIXTURE.read_bytes() == before


def test_a_file_of_the_first_format_is_continued_and_kept(tmp_path):
    study = Study(shutil.copy(FIXTURE, tmp_path / "s.db"))
    layout = first_layout(kinds=["real", "choice", "choice"])
    head = head_of(TestTable.empty(layout)) | {"problem": FIRST}
    with pytest.raises(StudyMismatchError, match='problem.key is null in the study, "v2" asked'):
        study.begin(head | {"problem": FIRST | {"key": "v2"}})
    study.begin(head)
    assert study.columns(2, 2)["steel"].tolist() == ["1.5", "1.5"]
    assert os.listdir(tmp_path) == ["s.db"]
    more = TestTable.of([4], [[0.2, "S", 1]], [[1, 2]], [[0]], [[0]], layout=layout)
    assert study.append(columns_of(more)) == 1
    table = TestTable.read_study(study.path)
    assert table.numbers.tolist() == [1, 2, 3, 4, 900]
    assert exact(table.rows([0, 1, 2, 4])) == exact(first_table())
    assert sorted(os.listdir(tmp_path)) == ["s.db", "s.db-format-1"]
    assert (tmp_path / "s.db-format-1").read_bytes() == FIXTURE.read_bytes()


def test_the_log_of_a_file_of_the_first_format_is_not_lost(tmp_path):
    """As a killed writer leaves it, whose last block is in the log only."""
    path, killed = tmp_path / "s.db", tmp_path / "killed"
    shutil.copy(FIXTURE, path)
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA wal_autocheckpoint = 0")
        db.execute("UPDATE study SET seal = seal || ''")
        db.execute("UPDATE study SET seal = CAST(seal AS BLOB)")
        killed.mkdir()
        for file in tmp_path.glob("s.db*"):
            shutil.copy(file, killed)
    assert (killed / "s.db-wal").stat().st_size > 0
    assert exact(TestTable.read_study(killed / "s.db")) == exact(first_table())
    study = Study(killed / "s.db")
    study.begin(
        head_of(TestTable.empty(first_layout(kinds=["real", "choice", "choice"])))
        | {"problem": FIRST}
    )
    more = TestTable.of([4], [[0.2, "S", 1]], [[1, 2]], [[0]], [[0]], layout=first_layout())
    study.append(columns_of(more) | {"n": np.array(["1"], dtype=object)})
    table = TestTable.read_study(study.path)
    assert exact(table.rows([0, 1, 2, 4])) == exact(first_table())
    assert sorted(os.listdir(killed)) == ["s.db", "s.db-format-1"]


def test_a_file_of_the_first_format_is_not_continued_over_another(tmp_path):
    study = Study(shutil.copy(FIXTURE, tmp_path / "s.db"))
    (tmp_path / "s.db-format-1").write_text("mine")
    before = contents(tmp_path)
    with pytest.raises(StudyAccessError, match="s.db-format-1 is there, the name under which"):
        study.append(columns_of(first_table()))
    assert contents(tmp_path) == before
