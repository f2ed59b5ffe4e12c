"""A damaged study: the intact committed tests or a clear error, and the file as it was."""

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from pymoo_psi import TestTable
from pymoo_psi.errors import StudyCorruptError
from pymoo_psi.storage import Study, read_study
from pymoo_psi.storage import _database as database
from pymoo_psi.table import Layout

LAYOUT = Layout.of(3, 2, 1)
PAGE = 4096


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def block(first, count):
    made = np.random.default_rng(first)
    X, F, G = (made.normal(size=(count, k)) for k in (3, 2, 1))
    reasons = {first: "no convergence " * 20}
    return TestTable.of(np.arange(first, first + count), X, F, G, reasons=reasons, layout=LAYOUT)


def same(a, b):
    return a.equals(b) and all(getattr(a, n).tobytes() == getattr(b, n).tobytes() for n in "XFGH")


class Found:
    """Puts damaged bytes where a study was, and says what becomes of them."""

    def __init__(self, folder, *states):
        self.folder, self.states, self.count = folder, states, 0

    def __call__(self, study, log=None):
        """Return the index of the state that is found, or None for the error."""
        self.count += 1
        place = self.folder / str(self.count)
        place.mkdir()
        path = place / "s.db"
        path.write_bytes(study)
        os.utime(path, (1e9, 1e9))  # a file just written is waited for
        if log is not None:
            Path(f"{path}-wal").write_bytes(log)
        try:
            table = read_study(path)
        except StudyCorruptError as error:
            text, found = str(error), None
        else:
            text = f"{path} it was left as it is"
            found = next(i for i, state in enumerate(self.states) if same(state, table))
        assert str(path) in text
        assert "it was left as it is" in text
        assert path.read_bytes() == study
        if log:
            assert Path(f"{path}-wal").read_bytes() == log
        shutil.rmtree(place)
        return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A study of many pages at rest: its bytes and its table."""
    study = Study(tmp_path_factory.mktemp("whole") / "s.db")
    study.begin(LAYOUT, {"problem": "damage"})
    for first in range(1, 201, 50):
        study.append(block(first, 50))
    return Path(study.path).read_bytes(), study.table()


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A study whose writer died between the commit of a block and the return of ``append``.

    Returns:
        Bytes of the file and of its log, the file after the checkpoint; the tables without and
        with the block.
    """
    study = Study(tmp_path_factory.mktemp("killed") / "s.db")
    study.begin(LAYOUT, {"problem": "damage"})
    study.append(block(1, 120))
    before, seen = study.table(), []
    checkpoint = database._checkpoint

    def noted(db):
        seen.extend(Path(study.path + suffix).read_bytes() for suffix in ("", "-wal"))
        checkpoint(db)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(database, "_checkpoint", noted)
        study.append(block(121, 60))
    return *seen, Path(study.path).read_bytes(), before, study.table()


def test_a_file_that_was_cut_is_recognised(tmp_path, whole, rng):
    data, table = whole
    assert len(data) >= 8 * PAGE
    found = Found(tmp_path, table)
    edges = [k + d for k in range(0, len(data), PAGE) for d in (-1, 0, 1)]
    lengths = {*edges, *range(0, 120, 7), *rng.integers(len(data), size=60).tolist()}
    assert all(found(data[:n]) is None for n in lengths if 0 <= n < len(data))
    assert found(data) == 0


def test_flipped_bytes_are_recognised_or_do_no_harm(tmp_path, whole, rng):
    data, table = whole
    found = Found(tmp_path, table)
    outcomes = {None: 0, 0: 0}
    for at in [*range(100), *rng.integers(len(data), size=1200).tolist()]:
        damaged = bytearray(data)
        damaged[at] ^= int(rng.integers(1, 256))
        outcomes[found(bytes(damaged))] += 1
    assert outcomes[None] > 600  # the rest hit what is empty or does not matter


def test_a_flipped_version_is_damage_not_a_later_version(tmp_path, whole):
    data = bytearray(whole[0])
    data[60] = 1
    assert Found(tmp_path, whole[1])(bytes(data)) is None


def test_blocks_of_zeros_are_recognised(tmp_path, whole, rng):
    data, table = whole
    found = Found(tmp_path, table)
    for start in range(0, len(data), PAGE):
        assert found(data[:start] + bytes(PAGE) + data[start + PAGE :]) is None
    for start in rng.integers(len(data) // 512, size=40) * 512:
        assert found(data[:start] + bytes(512) + data[start + 512 :]) in (0, None)


def test_an_old_page_among_new_ones_is_recognised(tmp_path, killed, rng):
    """As a disk leaves them that loses writes it has confirmed."""
    old, _, new, before, after = killed
    found = Found(tmp_path, before, after)
    old = old.ljust(len(new), b"\0")
    pages = [
        range(i, i + PAGE)
        for i in range(0, len(new), PAGE)
        if old[i : i + PAGE] != new[i : i + PAGE]
    ]
    assert len(pages) >= 3
    outcomes = {None: 0, 0: 0, 1: 0}
    for _ in range(40):
        mixed = bytearray(old)
        kept = [page for page in pages if rng.random() < 0.5] or pages[:1]
        for page in kept:
            mixed[page.start : page.stop] = new[page.start : page.stop]
        outcomes[found(bytes(mixed))] += 1
    assert outcomes[None] > 20  # the rest differ in counters only


def test_a_log_is_read_and_continued(tmp_path, killed):
    old, log, _, before, after = killed
    assert Found(tmp_path, before, after)(old, log) == 1
    (tmp_path / "s.db").write_bytes(old)
    (tmp_path / "s.db-wal").write_bytes(log)
    study = Study(tmp_path / "s.db")
    assert same(study.begin(LAYOUT, {"problem": "damage"}), after)
    study.append(block(181, 20))
    assert os.listdir(tmp_path) == ["s.db"]
    assert same(study.rows(1, 180), after)


def test_a_log_that_was_cut_is_the_block_that_was_not_returned_or_not(tmp_path, killed, rng):
    old, log, _, before, after = killed
    found = Found(tmp_path, before, after)
    frame = PAGE + 24
    edges = [32 + k * frame + d for k in range(len(log) // frame + 1) for d in (-1, 0, 1)]
    lengths = {*edges, *rng.integers(len(log), size=60).tolist()}
    outcomes = {n: found(old, log[:n]) for n in lengths if 0 <= n <= len(log)}
    assert outcomes.pop(len(log)) == 1
    assert set(outcomes.values()) == {0}


def test_flipped_bytes_of_a_log_are_recognised_or_do_no_harm(tmp_path, killed, rng):
    old, log, _, before, after = killed
    found = Found(tmp_path, before, after)
    for at in [*range(56), *rng.integers(len(log), size=500).tolist()]:
        damaged = bytearray(log)
        damaged[at] ^= int(rng.integers(1, 256))
        assert found(old, bytes(damaged)) in (0, 1, None)


def test_a_cut_log_of_a_checkpoint_that_was_cut_is_recognised(tmp_path, killed, rng):
    """Killed in the middle of the checkpoint, whole with its log; lost if that is damaged too."""
    old, log, new, before, after = killed
    found = Found(tmp_path, before, after)
    for _ in range(30):
        at = int(rng.integers(1, len(new) // PAGE)) * PAGE
        torn = new[:at] + old[at:]
        assert found(torn, log) == 1
        assert found(torn, log[: int(rng.integers(len(log)))]) in (0, 1, None)


def test_a_log_elsewhere_or_lost_after_append_loses_nothing(tmp_path, whole, rng):
    data, table = whole
    found = Found(tmp_path, table)
    assert found(data, b"") == 0
    assert found(data, b"not a log") == 0
    assert found(data, rng.bytes(3 * PAGE)) == 0


@pytest.mark.parametrize(
    "edit",
    [
        "DELETE FROM tests WHERE number = 7",
        "UPDATE tests SET number = 1000 WHERE number = 7",
        "UPDATE tests SET status = 'ok' WHERE number = 1",
        "UPDATE tests SET reason = NULL WHERE number = 1",
        "UPDATE tests SET x = 3 WHERE number = 7",
        "UPDATE tests SET y = (SELECT y FROM tests WHERE number = 8) WHERE number = 7",
        "INSERT INTO tests SELECT number + 1000, x, y, status, reason, digest FROM tests LIMIT 1",
        "UPDATE study SET tests = tests - 1",
        "UPDATE study SET fingerprint = '{}'",
        "DELETE FROM study",
        "CREATE TRIGGER t AFTER INSERT ON tests BEGIN DELETE FROM tests; END",
    ],
)
def test_edits_by_hand_are_recognised(tmp_path, whole, edit):
    path = tmp_path / "s.db"
    path.write_bytes(whole[0])
    with closing(sqlite3.connect(path)) as db:
        db.execute(edit)
        db.commit()
    before = path.read_bytes()
    study = Study(path)
    for call in (study.table, lambda: study.begin(LAYOUT, {"problem": "damage"})):
        with pytest.raises(
            StudyCorruptError, match=r"study .*s.db is damaged: .*restore it from a copy"
        ):
            call()
    assert path.read_bytes() == before


def test_an_old_row_in_a_new_study_is_recognised(tmp_path):
    study = Study(tmp_path / "s.db")
    study.begin(LAYOUT, {})
    failed = block(1, 3)
    study.append(failed)
    with closing(sqlite3.connect(study.path)) as db:
        old = db.execute("SELECT * FROM tests WHERE number = 1").fetchone()
    study.append(TestTable.of([1], failed.X[:1], failed.F[:1], failed.G[:1], layout=LAYOUT))
    with closing(sqlite3.connect(study.path)) as db:
        db.execute("REPLACE INTO tests VALUES (?, ?, ?, ?, ?, ?)", old)
        db.commit()
    with pytest.raises(StudyCorruptError, match="its tests are not those that were committed last"):
        study.table()
