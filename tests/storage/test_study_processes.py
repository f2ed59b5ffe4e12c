"""Studies among processes that are killed, stopped, run out of disk, or write at the same time."""

import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

import pymoo_psi
from pymoo_psi.errors import StudyAccessError, StudyLockedError
from pymoo_psi.storage import Study, read_study
from pymoo_psi.storage import _database as database

forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="the workers of these tests are forks")

# What the workers know: the modules are imported once, and every worker is a fork of the server.
SERVER = """
import json, os, signal, sys, time, traceback
import numpy as np
from pymoo_psi import TestTable
from pymoo_psi.errors import PsiError, StudyAccessError
from pymoo_psi.table import Layout
from pymoo_psi.storage import Study, read_study

LAYOUT = Layout.of(2, 2, 1)
PROBLEM = {"problem": "days", "key": 1}

def block(first, count=4):
    rng = np.random.default_rng(first)
    X, F, G = (rng.normal(size=(count, k)) for k in (2, 2, 1))
    reasons = {first: f"diverged at {first}"} if first % 3 == 0 else {}
    return TestTable.of(np.arange(first, first + count), X, F, G, reasons=reasons, layout=LAYOUT)

def say(path, *words):
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.write(file, (" ".join(map(str, words)) + "\\n").encode())
    os.close(file)

def run(path, log, last, firsts=None):
    "Evaluate what is not stored, block after block."
    study = Study(path, wait=30)
    stored = set(study.begin(LAYOUT, PROBLEM).numbers.tolist())
    with study.writing():
        for first in range(1, last, 4) if firsts is None else firsts:
            if first not in stored:
                say(log, "evaluate", first)
                say(log, "committed", first, study.append(block(first)))

def serve():
    for line in sys.stdin:
        command, what = json.loads(line)
        if command == "wait":
            print(os.waitpid(what, 0)[1], flush=True)
            continue
        pid = os.fork()
        if pid:
            print(pid, flush=True)
            continue
        try:
            exec(what, globals())
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
"""
_known: dict = {}
exec(SERVER, _known)
block, LAYOUT, PROBLEM = (_known[name] for name in ("block", "LAYOUT", "PROBLEM"))


class Workers:
    def __init__(self):
        source = Path(pymoo_psi.__file__).parents[1]
        environment = os.environ | {"PYTHONPATH": str(source)}
        self.process = subprocess.Popen(
            [sys.executable, "-c", f"{SERVER}\nserve()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        )

    def _ask(self, *command):
        self.process.stdin.write(json.dumps(command) + "\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def start(self, source):
        """Run a source in a new process; return its id."""
        return self._ask("start", source)

    def wait(self, pid):
        """Return how a process ended: 0 if well."""
        return self._ask("wait", pid)

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()


@pytest.fixture(scope="module")
def workers():
    workers = Workers()
    yield workers
    workers.close()


def lines(path):
    return path.read_text().splitlines() if path.exists() else []


def until(condition, seconds=20):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)


def same(a, b):
    return a.equals(b) and all(getattr(a, n).tobytes() == getattr(b, n).tobytes() for n in "XFGH")


def whole(last, folder):
    """The table of an uninterrupted study."""
    study = Study(Path(folder) / "uninterrupted.db")
    study.begin(LAYOUT, PROBLEM)
    with study.writing():
        for first in range(1, last, 4):
            study.append(block(first))
    return study.table()


@forks
def test_a_study_killed_many_times_is_that_of_one_run(tmp_path, tmp_path_factory, workers):
    kills, last = 36, 4 * 260 + 1
    path, log = tmp_path / "s.db", tmp_path / "log"
    began = time.monotonic()
    uninterrupted = whole(last, tmp_path_factory.mktemp("whole"))
    pace = (time.monotonic() - began) / 260
    job = f"run({str(path)!r}, {str(log)!r}, {last})"
    chance = random.Random(7)
    for kill in range(kills):
        pid, seen = workers.start(job), len(lines(log))
        wanted = chance.randrange(1, 9) if kill >= 6 else 0  # the first ones while it is created
        until(lambda: len(lines(log)) >= seen + wanted)  # noqa: B023
        time.sleep(chance.uniform(0, 2 * pace))
        os.kill(pid, signal.SIGKILL)
        assert workers.wait(pid) == signal.SIGKILL
        if path.exists():
            said = {int(line.split()[1]) for line in lines(log) if line.startswith("committed")}
            numbers = set(read_study(path).numbers.tolist())
            assert said <= numbers  # after every kill, all that was returned is there
            assert all(set(range(n, n + 4)) <= numbers for n in numbers if n % 4 == 1)
    assert len(read_study(path)) < last - 1  # else it was not killed to the end
    assert workers.wait(workers.start(job)) == 0
    assert same(read_study(path), uninterrupted)
    committed: set = set()
    for line in lines(log):
        word, first, *written = line.split()
        assert first not in committed, "a committed block was evaluated again"
        if word == "committed":
            committed.add(first)
            assert written == ["4"]
    assert sorted(os.listdir(tmp_path)) == ["log", "s.db"]


@forks
def test_a_kill_between_commit_and_return_is_committed(tmp_path, workers):
    path, log = tmp_path / "s.db", tmp_path / "log"
    assert workers.wait(workers.start(f"run({str(path)!r}, {str(log)!r}, 9)")) == 0
    job = (
        "from pymoo_psi.storage import _database as database\n"
        "database._checkpoint = lambda db: os.kill(os.getpid(), signal.SIGKILL)\n"
        f"Study({str(path)!r}).append(block(9))"
    )
    assert workers.wait(workers.start(job)) == signal.SIGKILL
    assert Path(f"{path}-wal").stat().st_size > 0
    study = Study(path)
    assert len(study.table()) == 12
    assert study.append(block(9)) == 0
    assert sorted(os.listdir(tmp_path)) == ["log", "s.db"]
    assert same(study.table(), whole(13, tmp_path))


@forks
def test_the_second_writer_is_told_who_holds_the_study_or_waits(tmp_path, workers):
    path = tmp_path / "s.db"
    study = Study(path, wait=0)
    study.begin(LAYOUT, PROBLEM)
    study.append(block(1))
    ready, go = tmp_path / "ready", tmp_path / "go"
    hold = (
        f"with Study({str(path)!r}).writing():\n"
        f"    say({str(ready)!r}, 'ready')\n"
        f"    while not os.path.exists({str(go)!r}): time.sleep(0.01)\n"
        f"    Study({str(path)!r}).append(block(5))\n"
    )
    pid = workers.start(hold)
    until(ready.exists)
    who = rf"is being written by process {pid} on {socket.gethostname()} since \d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d UTC; waited 0 s: let it finish or stop it"
    with pytest.raises(StudyLockedError, match=who):
        study.append(block(9))
    began = time.monotonic()
    with pytest.raises(StudyLockedError, match=r"waited 0.3 s"), Study(path, wait=0.3).writing():
        pass
    assert 0.3 <= time.monotonic() - began < 5
    assert len(study.begin(LAYOUT, PROBLEM)) == len(study.numbers()) == 4  # readers do not wait
    other = workers.start(f"say({str(go)!r}, 'go')")
    assert Study(path, wait=20).append(block(9)) == 4
    assert workers.wait(pid) == workers.wait(other) == 0
    assert study.numbers().tolist() == list(range(1, 13))


@forks
def test_a_writer_that_was_killed_is_in_nobodys_way(tmp_path, workers):
    path, ready = tmp_path / "s.db", tmp_path / "ready"
    study = Study(path, wait=0)
    study.begin(LAYOUT, PROBLEM)
    for n in range(3):
        job = f"with Study({str(path)!r}).writing():\n    say({str(ready)!r}, 'x')\n    time.sleep(60)"
        pid = workers.start(job)
        until(lambda: len(lines(ready)) > n)  # noqa: B023
        os.kill(pid, signal.SIGKILL)
        workers.wait(pid)
        assert study.append(block(1 + 4 * n)) == 4
    assert sorted(os.listdir(tmp_path)) == ["ready", "s.db"]


@forks
def test_many_writers_at_once_lose_nothing(tmp_path, workers):
    path = tmp_path / "s.db"
    job = (
        f"study = Study({str(path)!r}, wait=60)\n"
        "study.begin(LAYOUT, PROBLEM)\n"
        "for first in {}: study.append(block(first))"
    )
    shares = [list(range(1 + 4 * k, 81, 12)) for k in range(3)] + [list(range(1, 81, 8))]
    pids = [workers.start(job.format(share)) for share in shares]
    assert [workers.wait(pid) for pid in pids] == [0] * 4
    assert same(read_study(path), whole(81, tmp_path))


@forks
def test_readers_see_whole_blocks_while_others_write(tmp_path, workers):
    path = tmp_path / "s.db"
    Study(path).begin(LAYOUT, PROBLEM)
    expected = whole(401, tmp_path)
    job = f"for first in range(1, 401, 4): Study({str(path)!r}).append(block(first))"
    pid, seen = workers.start(job), 0
    while seen < 400:
        table, numbers, rows = read_study(path), Study(path).numbers(), Study(path).rows(1, 400)
        assert seen <= len(table) <= len(numbers) <= len(rows)
        assert len(table) % 4 == len(numbers) % 4 == len(rows) % 4 == 0
        assert same(rows, expected.rows(np.arange(len(rows))))
        seen = len(table)
    assert workers.wait(pid) == 0


@forks
def test_a_fork_of_the_holder_does_not_hold(tmp_path, workers):
    path = str(tmp_path / "s.db")
    job = (
        f"study = Study({path!r}, wait=0)\n"
        "study.begin(LAYOUT, PROBLEM)\n"
        "with study.writing():\n"
        "    pid = os.fork()\n"
        "    if not pid:\n"
        "        try:\n"
        "            study.append(block(1))\n"
        "        except PsiError as error:\n"
        "            os._exit(7 if f'process {os.getppid()} on' in str(error) else 1)\n"
        "        os._exit(0)\n"
        "    assert os.waitpid(pid, 0)[1] >> 8 == 7\n"
        "    study.append(block(1))\n"
    )
    assert workers.wait(workers.start(job)) == 0
    assert len(read_study(path)) == 4


@forks
def test_ctrl_c_leaves_a_study_that_continues(tmp_path, workers):
    path, log = tmp_path / "s.db", tmp_path / "log"
    job = f"run({str(path)!r}, {str(log)!r}, 10**6)"
    quiet = f"signal.signal(signal.SIGINT, signal.default_int_handler)\ntry:\n    {job}\nexcept KeyboardInterrupt: pass"
    for _ in range(3):
        pid, seen = workers.start(quiet), len(lines(log))
        until(lambda: len(lines(log)) > seen + 4)  # noqa: B023
        os.kill(pid, signal.SIGINT)
        assert workers.wait(pid) == 0
        assert sorted(os.listdir(tmp_path)) == ["log", "s.db"]
    said = {int(line.split()[1]) for line in lines(log) if line.startswith("committed")}
    assert said <= set(read_study(path).numbers.tolist())


# Disks and rights


def test_a_full_disk_is_said_and_loses_nothing(tmp_path, monkeypatch):
    study = Study(tmp_path / "s.db")
    study.begin(LAYOUT, PROBLEM)
    study.append(block(1))
    connected = database.connected

    def small(path, options, patience):
        db = connected(path, options, patience)
        if options == "mode=rw" and not path.endswith("-lock"):
            db.execute("PRAGMA max_page_count = 5")
        return db

    with monkeypatch.context() as patched:
        patched.setattr(database, "connected", small)
        with pytest.raises(
            StudyAccessError,
            match=r"study .*s.db cannot be used: the disk is full; make room, then run again: what was committed before is still there",
        ):
            study.append(block(5, 1000))
    assert same(study.table(), block(1))
    assert study.append(block(5, 1000)) == 1000


@forks
def test_a_quota_is_said_and_loses_nothing(tmp_path, workers):
    path, log = tmp_path / "s.db", tmp_path / "log"
    job = (
        "import resource\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))\n"
        "try:\n"
        f"    run({str(path)!r}, {str(log)!r}, 10**6)\n"
        "except StudyAccessError as error:\n"
        f"    say({str(log)!r}, 'error', error)\n"
    )
    assert workers.wait(workers.start(job)) == 0
    *said, error = lines(log)
    assert f"study {path} cannot be used: the disk or its quota is full" in error
    assert "what was committed before is still there" in error
    committed = {int(line.split()[1]) for line in said if line.startswith("committed")}
    assert len(committed) > 20
    study = Study(path)
    assert committed <= set(study.begin(LAYOUT, PROBLEM).numbers.tolist())
    rest = max(committed) + 8
    job = f"run({str(path)!r}, {str(log)!r}, {rest})"
    assert workers.wait(workers.start(job)) == 0
    assert same(read_study(path), whole(rest, tmp_path))


def test_a_file_cannot_be_made_below_a_file_or_nowhere(tmp_path):
    (tmp_path / "file").write_text("")
    for name in ("file/s.db", "missing/s.db"):
        with pytest.raises(
            StudyAccessError,
            match=rf"study .*{name}-lock cannot be used: .*; check that its folder exists and that you may write",
        ):
            Study(tmp_path / name).begin(LAYOUT, PROBLEM)
    assert os.listdir(tmp_path) == ["file"]


@pytest.fixture
def open_folder():
    """A folder that every user can reach."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    yield folder
    folder.chmod(0o755)
    shutil.rmtree(folder)


# Rights do not bind root. What is imported late is imported before: the packages may be root's.
DROP = "block(1)\nif os.getuid() == 0: os.setgid(65534); os.setuid(65534)\n"


@forks
@pytest.mark.parametrize("state", ["at rest", "with a log"])
def test_a_read_only_folder_can_be_read_and_is_said_to_be_one(
    open_folder, tmp_path, workers, state, monkeypatch
):
    path, report = open_folder / "s.db", open_folder / "report"
    study = Study(path)
    study.begin(LAYOUT, PROBLEM)
    study.append(block(1))
    if state == "with a log":
        kept = tmp_path / "kept"
        kept.mkdir()
        monkeypatch.setattr(
            database,
            "_checkpoint",
            lambda db: [shutil.copy(f"{path}{s}", kept) for s in ("", "-wal")],
        )
        study.append(block(5))
        for name in ("s.db", "s.db-wal"):
            shutil.copy(kept / name, open_folder)
    expected = 4 if state == "at rest" else 8
    report.touch()
    report.chmod(0o666)
    for file in open_folder.glob("s.db*"):
        file.chmod(0o444)
    open_folder.chmod(0o555)
    before = {file.name: file.read_bytes() for file in open_folder.glob("s.db*")}
    job = DROP + (
        f"study = Study({str(path)!r})\n"
        f"assert len(study.begin(LAYOUT, PROBLEM)) == len(study.numbers()) == {expected}\n"
        "try:\n"
        "    study.append(block(9))\n"
        "except StudyAccessError as error:\n"
        f"    say({str(report)!r}, error)\n"
        "try:\n"
        f"    Study({str(open_folder / 'new.db')!r}).begin(LAYOUT, PROBLEM)\n"
        "except StudyAccessError as error:\n"
        f"    say({str(report)!r}, error)\n"
    )
    assert workers.wait(workers.start(job)) == 0
    appended, begun = lines(report)
    assert (
        appended
        == f"study {path}-lock cannot be used: Permission denied; check that its folder exists and that you may write the folder and the file"
    )
    assert begun.startswith(f"study {open_folder}/new.db-lock cannot be used: Permission denied;")
    assert {file.name: file.read_bytes() for file in open_folder.glob("s.db*")} == before


@forks
def test_a_read_only_file_is_said_to_be_one(open_folder, workers):
    path, report = open_folder / "s.db", open_folder / "report"
    Study(path).begin(LAYOUT, PROBLEM)
    Study(path).append(block(1))
    path.chmod(0o444)
    open_folder.chmod(0o777)
    job = DROP + (
        "try:\n"
        f"    Study({str(path)!r}).append(block(5))\n"
        "except StudyAccessError as error:\n"
        f"    say({str(report)!r}, error)\n"
    )
    assert workers.wait(workers.start(job)) == 0
    assert lines(report) == [
        f"study {path} cannot be used: it is read-only; check that its folder exists and that you may write the folder and the file"
    ]
    assert same(read_study(path), block(1))


def test_a_lock_that_is_no_database_is_named(tmp_path):
    study = Study(tmp_path / "s.db")
    study.begin(LAYOUT, PROBLEM)
    Path(f"{study.path}-lock").write_bytes(b"something else\n" * 100)
    with pytest.raises(pymoo_psi.PsiError, match="s.db-lock"):
        study.append(block(1))
    Path(f"{study.path}-lock").unlink()
    assert study.append(block(1)) == 4
