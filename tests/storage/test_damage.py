"""A damaged study: the intact committed tests or a clear error, and the file as it was."""

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from pymoo_psi.errors import StudyCorruptError, StudyError
from pymoo_psi.storage import Study, _database, read_study
from tests.storage.studies import HEAD, begun, bits, block, rows

PAGE = 4096


@pytest.fixture
def rng():
    return np.random.default_rng(5)


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
        told, found = f"{path} left as it", None
        try:
            found = self.states.index(bits(read_study(path)[1]))
        except StudyError as error:
            told = str(error)
        assert str(path) in told
        assert "left as it" in told
        assert path.read_bytes() == study
        if log:
            assert Path(f"{path}-wal").read_bytes() == log
        else:
            assert set(os.listdir(place)) <= {"s.db", "s.db-wal"}
        shutil.rmtree(place)
        return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A study of many pages at rest: its bytes and its tests."""
    study = begun(tmp_path_factory.mktemp("whole") / "s.db")
    for first in range(1, 201, 50):
        study.append(block(first, 50, failed=[first]), origin="LP-tau")
    return Path(study.path).read_bytes(), bits(read_study(study.path)[1])


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A study whose writer died between the commit of a block and the return of ``append``.

    Returns:
        Bytes of the file and of its log, the file after the checkpoint; the tests without and
        with the block.
    """
    study = begun(tmp_path_factory.mktemp("killed") / "s.db")
    study.append(block(1, 120))
    before, seen = bits(read_study(study.path)[1]), []
    checkpoint = _database._checkpoint

    def noted(db):
        seen.extend(Path(study.path + suffix).read_bytes() for suffix in ("", "-wal"))
        checkpoint(db)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_database, "_checkpoint", noted)
        study.append(block(121, 60))
    return *seen, Path(study.path).read_bytes(), before, bits(read_study(study.path)[1])


def test_a_file_that_was_cut_is_recognised(tmp_path, whole, rng):
    data, tests = whole
    assert len(data) >= 6 * PAGE
    found = Found(tmp_path, tests)
    edges = [k + d for k in range(0, len(data), PAGE) for d in (-1, 0, 1)]
    lengths = {*edges, *range(0, 120, 7), *rng.integers(len(data), size=60).tolist()}
    assert all(found(data[:n]) is None for n in lengths if 0 <= n < len(data))
    assert found(data) == 0


def test_flipped_bits_are_recognised_or_do_no_harm(tmp_path, whole, rng):
    data, tests = whole
    found = Found(tmp_path, tests)
    outcomes = {None: 0, 0: 0}
    places = [*range(100), *rng.integers(len(data), size=150).tolist()]
    for at in places:
        damaged = bytearray(data)
        damaged[at] ^= 1 << int(rng.integers(8))
        outcomes[found(bytes(damaged))] += 1
    assert outcomes[None] > len(places) / 3  # the rest hit what is empty or does not matter


def test_a_flipped_version_is_damage_not_a_later_version(tmp_path, whole):
    for version in (0, 1, 2, 4, 2**24):
        data = bytearray(whole[0])
        data[60:64] = version.to_bytes(4, "big")
        assert Found(tmp_path, whole[1])(bytes(data)) is None


def test_blocks_of_zeros_are_recognised(tmp_path, whole, rng):
    data, tests = whole
    found = Found(tmp_path, tests)
    for start in range(0, len(data), PAGE):
        # SQLite's index of the names of facts is the one page that the tests do without.
        assert found(data[:start] + bytes(PAGE) + data[start + PAGE :]) in (0, None)
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
        for page in [page for page in pages if rng.random() < 0.5] or pages[:1]:
            mixed[page.start : page.stop] = new[page.start : page.stop]
        outcomes[found(bytes(mixed))] += 1
    assert outcomes[None] > 20  # the rest differ in counters only


def test_a_log_is_read_and_continued(tmp_path, killed):
    old, log, _, before, after = killed
    assert Found(tmp_path, before, after)(old, log) == 1
    (tmp_path / "s.db").write_bytes(old)
    (tmp_path / "s.db-wal").write_bytes(log)
    study = begun(tmp_path / "s.db")
    assert bits(study.columns(1, 200)) == after
    study.append(block(181, 20))
    assert os.listdir(tmp_path) == ["s.db"]
    assert bits(study.columns(1, 180)) == after


def test_a_log_that_was_cut_is_the_block_that_was_not_returned_or_not(tmp_path, killed, rng):
    old, log, _, before, after = killed
    found = Found(tmp_path, before, after)
    frame = PAGE + 24
    edges = [32 + k * frame + d for k in range(len(log) // frame + 1) for d in (-1, 0, 1)]
    lengths = {*edges, *rng.integers(len(log), size=60).tolist()}
    outcomes = {n: found(old, log[:n]) for n in lengths if 0 <= n <= len(log)}
    assert outcomes.pop(len(log)) == 1
    assert set(outcomes.values()) == {0}


def test_flipped_bits_of_a_log_are_recognised_or_do_no_harm(tmp_path, killed, rng):
    old, log, _, before, after = killed
    found = Found(tmp_path, before, after)
    for at in [*range(56), *rng.integers(len(log), size=60).tolist()]:
        damaged = bytearray(log)
        damaged[at] ^= 1 << int(rng.integers(8))
        assert found(old, bytes(damaged)) in (0, 1, None)


def test_a_log_of_a_checkpoint_that_was_cut_is_read_or_recognised_as_damaged(tmp_path, killed, rng):
    """Killed in the middle of the checkpoint, whole with its log; lost if that is damaged too."""
    old, log, new, before, after = killed
    found = Found(tmp_path, before, after)
    for _ in range(20):
        at = int(rng.integers(1, len(new) // PAGE)) * PAGE
        torn = new[:at] + old[at:]
        assert found(torn, log) == 1
        assert found(torn, log[: int(rng.integers(len(log)))]) in (0, 1, None)


def test_a_log_that_is_lost_after_a_commit_loses_nothing(tmp_path, whole):
    assert Found(tmp_path, whole[1])(whole[0], b"") == 0


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        ("DELETE FROM tests WHERE number = 7", "it holds 199 of 200 tests"),
        ("UPDATE tests SET number = 1000 WHERE number = 7", "test point 1000 have changed"),
        ("UPDATE tests SET status = 'ok' WHERE number = 1", "test point 1 have changed"),
        ("UPDATE tests SET status = NULL WHERE number = 2", "test point 2 have changed"),
        ("UPDATE tests SET reason = NULL WHERE number = 1", "test point 1 have changed"),
        ("UPDATE tests SET origin = 'guess' WHERE number < 4", "test point 1, 2, 3 have changed"),
        ("UPDATE tests SET seconds = 1", "test point 1, 2, 3, 4, 5 and 195 more have changed"),
        ("UPDATE tests SET x = 3 WHERE number = 7", "test point 7 have changed"),
        ("UPDATE tests SET x = 'three' WHERE number = 7", "test point 7 have changed"),
        ("UPDATE tests SET n = NULL WHERE number IN (7, 9)", "test point 7, 9 have changed"),
        ("UPDATE tests SET f1 = NULL WHERE number = 8", "test point 8 have changed"),
        ("UPDATE tests SET f1 = x'00' WHERE number = 8", "test point 8 have changed"),
        ("UPDATE tests SET metal = 7 WHERE number = 8", "test point 8 have changed"),
        ("UPDATE tests SET negative_zeros = '[\"f1\"]' WHERE number = 8", "test point 8 have changed"),
        ("UPDATE tests SET negative_zeros = 'f1' WHERE number = 8", "test point 8 have changed"),
        ("UPDATE tests SET checksum = 'a' WHERE number = 8", "test point 8 have changed"),
        ("UPDATE tests SET status = CAST(x'ff' AS TEXT) WHERE number = 8", "decode"),
        ("INSERT INTO tests SELECT number + 1000, status, reason, origin, seconds, x, n, hollow, metal, f1, f2, g1, h1, negative_zeros, checksum FROM tests LIMIT 1", "test point 1001 have changed"),
        ("UPDATE facts SET value = '199' WHERE name = 'tests'", "its facts are not those"),
        ("UPDATE facts SET value = '[]' WHERE name = 'lower'", "its facts are not those"),
        ("UPDATE facts SET name = 'lowest' WHERE name = 'lower'", "its facts are not those"),
        ("DELETE FROM facts", "its facts are not those"),
        ("DROP TABLE tests", "no such table: tests"),
        ("ALTER TABLE tests DROP COLUMN f2", "no such column: tests.f2"),
    ],
)  # fmt: skip
def test_edits_by_hand_are_recognised_and_told(tmp_path, whole, edit, said):
    path = tmp_path / "s.db"
    path.write_bytes(whole[0])
    with closing(sqlite3.connect(path)) as db:
        db.execute(edit)
        db.commit()
    before = path.read_bytes()
    for call in (lambda: read_study(path), lambda: begun(path).columns(1, 2000)):
        if said.startswith("it holds") and call.__code__.co_names[0] == "begun":
            continue
        with pytest.raises(
            StudyCorruptError,
            match=f"study .*s.db is damaged: .*{said}.*; .*restore it from a copy",
        ):
            call()
    assert path.read_bytes() == before


def test_an_old_row_in_a_new_study_is_recognised(tmp_path):
    study = begun(tmp_path / "s.db")
    study.append(block(1, 3, failed=[1]))
    with closing(sqlite3.connect(study.path)) as db:
        old = db.execute("SELECT * FROM tests WHERE number = 1").fetchone()
    study.append(rows(block(1, 3), [0]))
    with closing(sqlite3.connect(study.path)) as db:
        db.execute(f"REPLACE INTO tests VALUES ({', '.join('?' * len(old))})", old)
        db.commit()
    with pytest.raises(StudyCorruptError, match="its tests are not those that were committed last"):
        read_study(study.path)


def test_a_damaged_study_takes_no_more_tests(tmp_path, whole):
    path = tmp_path / "s.db"
    path.write_bytes(whole[0])
    study = Study(path)
    study.begin(HEAD)
    with closing(sqlite3.connect(path)) as db:
        db.execute("UPDATE facts SET value = '[]' WHERE name = 'lower'")
        db.commit()
    before = path.read_bytes()
    with pytest.raises(StudyCorruptError, match="its facts are not those"):
        study.append(block(201, 4))
    assert path.read_bytes() == before
