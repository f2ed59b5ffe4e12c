"""The study file: what goes in comes out, what does not belong is refused, nothing is changed."""

import copy
import os
import pickle
import shutil
import sqlite3
import threading
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pymoo_psi import TestTable
from pymoo_psi.errors import (
    ArgumentTypeError,
    ArgumentValueError,
    PsiError,
    StudyLockedError,
    StudyMismatchError,
)
from pymoo_psi.storage import Study, read_study
from pymoo_psi.storage import _database as database
from pymoo_psi.storage._reservation import holder, put_holder, reserve
from pymoo_psi.table import Layout
from tests.storage.studies import LAYOUT, PROBLEM, bits, block, contents, new_study


@pytest.fixture
def study(tmp_path):
    return new_study(tmp_path)


# What goes in comes out

choices = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False),
    st.integers(),
    st.booleans(),
    st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])),
)
texts = st.text()


@st.composite
def tables(draw):
    n, n_var, m, n_ieq, n_eq = (
        draw(st.integers(*r)) for r in ((0, 6), (0, 3), (0, 3), (0, 2), (0, 2))
    )
    layout = Layout.of(
        n_var, m, n_ieq, n_eq, lower=draw(arrays(float, n_var, elements=st.floats(-1, 0)))
    )
    X = np.empty((n, n_var), dtype=object)
    for j in range(n_var):
        kind = choices if draw(st.booleans()) else st.floats(allow_nan=False, allow_infinity=False)
        X[:, j] = draw(st.lists(kind, min_size=n, max_size=n))
    F, G, H = (draw(arrays(float, (n, k), elements=st.floats())) for k in (m, n_ieq, n_eq))
    numbers = draw(st.lists(st.integers(1, 2**63 - 1), min_size=n, max_size=n, unique=True))
    reasons = {number: draw(texts) for number in numbers if draw(st.booleans())}
    return TestTable.of(np.array(numbers, dtype=int), X, F, G, H, reasons=reasons, layout=layout)


@settings(deadline=None, max_examples=40)
@given(tables(), st.data())
def test_a_table_comes_back_bit_for_bit_however_it_is_cut_into_blocks(
    tmp_path_factory, table, data
):
    path = tmp_path_factory.mktemp("study") / "s.db"
    study = Study(path)
    assert bits(study.begin(table.layout, {})) == bits(TestTable.empty(table.layout))
    cut = data.draw(st.integers(0, len(table)))
    written = [study.append(table.rows(np.arange(*ends))) for ends in ((cut, len(table)), (0, cut))]
    assert written == [len(table) - cut, cut]
    ordered = table.rows(np.argsort(table.numbers))
    assert bits(study.table()) == bits(read_study(path)) == bits(ordered)
    assert study.table().layout.difference(table.layout) == ""
    assert study.numbers().tolist() == ordered.numbers.tolist()
    assert os.listdir(path.parent) == ["s.db"]
    shutil.rmtree(path.parent)


def test_nan_keeps_its_payload_and_zero_its_sign(study):
    payload = np.frombuffer(b"\x01\x02\x03\x04\x05\x06\xf8\x7f" + b"\xff" * 8, dtype="<f8")
    study.append(
        TestTable.of([5], [[-0.0, 1.0]], [payload], [[-0.0]], reasons={5: " "}, layout=LAYOUT)
    )
    table = study.table()
    assert table.F.tobytes() == payload.tobytes()
    assert np.signbit([table.X[0, 0], table.G[0, 0]]).all()
    assert table.reasons == {5: " "}


def test_a_failed_design_without_a_reason_stays_without(study):
    arrays_ = block(1, 1)
    table = TestTable(LAYOUT, [1], arrays_.X, arrays_.F, arrays_.G, arrays_.H, ["failed"])
    study.append(table)
    assert bits(study.table()) == bits(table)


def test_rows_and_numbers(study):
    whole = block(1, 9, failed=[2, 8])
    study.append(whole.rows([6, 7, 8, 0, 1, 2]))
    assert study.numbers().tolist() == [1, 2, 3, 7, 8, 9]
    assert study.numbers().dtype == np.int64
    assert study.numbers("failed").tolist() == [2, 8]
    assert bits(study.rows(2, 6)) == bits(whole.rows([1, 2, 6]))
    assert len(study.rows(4, 3)) == len(study.rows(1, 0)) == len(study.rows(2**70, 2**70)) == 0
    with pytest.raises(ArgumentValueError, match="first must be an integer >= 1, got 0"):
        study.rows(0, 1)
    with pytest.raises(
        ArgumentValueError,
        match="status must be one of 'failed', 'infeasible', 'ok', got 'fail'; did you mean 'failed'",
    ):
        study.numbers("fail")


@pytest.mark.parametrize("x", [3, True, 0.5, "steel", 2**70])
def test_values_keep_their_type(tmp_path, x):
    table = TestTable.of([1, 2], np.array([[x], [x]], dtype=object), [[1.0], [2.0]])
    study = Study(tmp_path / "s.db")
    study.begin(table.layout, {})
    study.append(table)
    assert bits(study.table()) == bits(table)
    assert type(study.table().X[0].tolist()[0]) is type(x)


# Continuing


def test_beginning_again_continues(study):
    study.append(block(1, 3))
    before = contents(Path(study.path).parent)
    table = Study(study.path).begin(LAYOUT, dict(reversed(PROBLEM.items())))
    assert bits(table) == bits(block(1, 3))
    assert contents(Path(study.path).parent) == before
    assert study.fingerprint() == PROBLEM


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"problem": "belt"}, 'problem is "chute" in the study, "belt" asked'),
        ({"objectives": 2.0}, "objectives is 2 in the study, 2.0 asked"),
        ({"more": [1]}, r"more is absent in the study, \[1\] asked"),
        (
            {"key": "v2", "objectives": 3},
            'key is null in the study, "v2" asked; objectives is 2 in the study, 3 asked',
        ),
    ],
)
def test_another_fingerprint_is_refused(study, change, said):
    before = contents(Path(study.path).parent)
    with pytest.raises(
        StudyMismatchError,
        match=f"belongs to another problem: {said}. Give the name of another file",
    ):
        study.begin(LAYOUT, PROBLEM | change)
    assert contents(Path(study.path).parent) == before


def test_another_layout_is_refused(study):
    other = Layout.of(2, 2, 1, lower=[0.0, 0.0], upper=[1.0, 3.0])
    said = r"upper bound of x2: 2.0 against 3.0 \(study against asked\)"
    with pytest.raises(StudyMismatchError, match=said):
        study.begin(other, PROBLEM)
    foreign = block(1, 2)
    foreign = TestTable.of([1, 2], foreign.X, foreign.F, foreign.G, layout=other)
    with pytest.raises(
        StudyMismatchError, match=r"upper bound of x2: 2.0 against 3.0 \(study against block\)"
    ):
        study.append(foreign)
    assert len(study.table()) == 0


def test_bounds_that_are_not_known_or_infinite_continue(tmp_path):
    layout = Layout.of(["a", "ß"], 1, lower=[np.nan, -np.inf], upper=[np.inf, 0.1 + 0.2])
    for _ in range(2):
        table = Study(tmp_path / "s.db").begin(layout, {})
    assert table.layout.difference(layout) == ""


@pytest.mark.parametrize(
    ("fingerprint", "kind", "said"),
    [
        ([("a", 1)], ArgumentTypeError, "fingerprint must be a mapping"),
        ({1: 2}, ArgumentTypeError, "fingerprint must have names for keys, got 1"),
        (
            {"a": np.int64(3)},
            ArgumentTypeError,
            "plain JSON values, got .*3.* for 'a'; use numbers",
        ),
        (
            {"a": [np.nan]},
            ArgumentValueError,
            r"of finite numbers, without cycles, in 'a', got \[nan\]",
        ),
    ],
)
def test_a_fingerprint_is_plain_json(tmp_path, fingerprint, kind, said):
    with pytest.raises(kind, match=said):
        Study(tmp_path / "s.db").begin(LAYOUT, fingerprint)
    assert os.listdir(tmp_path) == []


# Adding


def test_what_is_stored_is_not_written_again(study):
    study.append(block(1, 4))
    before = contents(Path(study.path).parent)
    assert study.append(block(1, 4)) == 0
    assert study.append(block(1, 0)) == 0
    assert study.append(block(3, 2).rows([])) == 0
    assert contents(Path(study.path).parent) == before


def test_a_failed_test_is_replaced_by_its_repetition(study):
    study.append(block(1, 4, failed=[2, 3]))
    again = block(1, 4, seed=1, failed=[3])
    assert study.append(again.rows([1, 2])) == 2
    table = study.table()
    assert table.status[1] != "failed"
    assert table.reasons == {3: "reason 1 of 3"}
    assert bits(table.rows([1, 2])) == bits(again.rows([1, 2]))


def test_no_other_test_can_be_changed(study):
    study.append(block(1, 4, failed=[2]))
    before = bits(study.table())
    with pytest.raises(
        ArgumentValueError,
        match="got other results for test point 1; use another file if the model has changed",
    ):
        study.append(block(1, 6, seed=1))
    good = block(1, 4)
    moved = TestTable.of([5, 2], good.X[:2] / 2, good.F[:2], good.G[:2], layout=LAYOUT)
    with pytest.raises(ArgumentValueError, match="got other design for test point 2"):
        study.append(moved)
    assert bits(study.table()) == before  # nor is anything of the block there


def test_only_tables_of_tests_are_added(study):
    with pytest.raises(ArgumentTypeError, match="block must be a TestTable, got None"):
        study.append(None)
    with pytest.raises(ArgumentValueError, match="block must be without a prototype"):
        study.append(block(1, 1).with_prototype([0, 0], [1, 1]))


@pytest.mark.parametrize("place", ["put_head", "_checkpoint"])
def test_an_interrupted_block_is_there_whole_or_not_at_all(study, monkeypatch, place):
    study.append(block(1, 4))

    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(database, place, interrupt)
        with pytest.raises(KeyboardInterrupt):
            study.append(block(5, 4))
    committed = place == "_checkpoint"
    assert len(study.table()) == (8 if committed else 4)
    assert study.append(block(5, 4)) == (0 if committed else 4)
    assert os.listdir(Path(study.path).parent) == [Path(study.path).name]


# A value that can go anywhere


def test_a_study_is_a_name(study, monkeypatch):
    study.append(block(1, 2))
    for other in (
        copy.deepcopy(study),
        pickle.loads(pickle.dumps(study)),
        Study(study.path, wait=0),
    ):
        assert other == study
        assert hash(other) == hash(study)
        assert len(other.table()) == 2
    monkeypatch.chdir(Path(study.path).parent)
    relative = Study(Path(study.path).name)
    monkeypatch.chdir("/")
    assert relative.path == study.path
    with study.writing():
        assert pickle.loads(pickle.dumps(study)).append(block(3, 2)) == 2


@pytest.mark.parametrize(
    ("path", "wait", "said"),
    [
        (3, 0, "path must be the name of a file, got 3"),
        ("", 0, "path must be the name of a file, got ''"),
        ("s.db", -1, "wait must be 0 seconds or more, got -1.0"),
        ("s.db", "long", "wait must be a finite number, got 'long'"),
    ],
)
def test_wrong_arguments(path, wait, said):
    with pytest.raises(PsiError, match=said):
        Study(path, wait=wait)


# Readers and writers in one process


def test_readers_wait_for_nobody(study):
    study.append(block(1, 2))
    with closing(sqlite3.connect(study.path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        other.execute("DELETE FROM tests")
        with study.writing():
            assert len(study.table()) == len(study.numbers()) == len(study.rows(1, 5)) == 2
        other.execute("ROLLBACK")


def test_a_reader_in_the_middle_of_a_query_holds_up_nobody(study):
    study.append(block(1, 2))
    with closing(sqlite3.connect(study.path, isolation_level=None)) as reader:
        reader.execute("BEGIN")
        assert reader.execute("SELECT count(*) FROM tests").fetchone() == (2,)
        study.append(block(3, 2))
        assert reader.execute("SELECT count(*) FROM tests").fetchone() == (2,)
        assert len(study.table()) == 4
    study.append(block(5, 2))
    assert os.listdir(Path(study.path).parent) == [Path(study.path).name]
    assert len(study.table()) == 6


def test_a_program_that_keeps_the_file_busy_is_told_of(study, monkeypatch):
    monkeypatch.setattr(database, "_PATIENCE", 0.05)
    with closing(sqlite3.connect(study.path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(
            StudyLockedError, match="is kept busy by another program; close that program"
        ):
            study.append(block(1, 2))


def test_the_hold_is_nested_shared_by_threads_and_let_go(study):
    with study.writing(), study.writing():
        study.append(block(1, 2))
        thread = threading.Thread(target=study.append, args=(block(3, 2),))
        thread.start()
        thread.join()
        assert Path(f"{study.path}-lock").exists()
    assert not Path(f"{study.path}-lock").exists()
    assert len(study.table()) == 4


def test_a_lock_has_no_journal_beside_it(tmp_path):
    """SQLite finds a journal by name. A lock whose file was removed would roll back, and delete,
    that of the file which has the name now."""
    path = tmp_path / "s.db-lock"
    with closing(database.connected(str(path), "mode=rwc", 0)) as db:
        assert reserve(db)
        db.execute("CREATE TABLE what_is_written (x)")
        assert db.in_transaction
        assert [file.name for file in tmp_path.iterdir()] == ["s.db-lock"]


def test_what_a_lock_says_is_written_at_once(tmp_path):
    """One page is written whole, so that being killed meanwhile leaves no half of it."""
    path = tmp_path / "s.db-lock"
    with closing(database.connected(str(path), "mode=rwc", 0)) as db:
        for who in ("first", "it's me " * 40):
            assert reserve(db)
            put_holder(db, who)
            assert holder(db) == who
            assert db.execute("PRAGMA page_count").fetchone() == (1,)
    assert [file.name for file in tmp_path.iterdir()] == ["s.db-lock"]
