"""Studies among processes that are killed, stopped, run out of disk, or write at the same time."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pymoo_psi
from pymoo_psi.errors import StudyLockedError
from pymoo_psi.study import Study
from tests.helpers.processes import LONG, until
from tests.helpers.refusals import refused
from tests.helpers.studies import begun, bits, block, read, rows

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="these workers are forks")

# What the workers know: the modules are imported once, and every worker is a fork of the server.
SERVER = """
import json, os, signal, sys, tempfile, time, traceback
from pymoo_psi.errors import PsiError, StudyAccessError
from pymoo_psi.study import Study
from tests.helpers.studies import HEAD, begun, block, read

def say(path, *words):
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.write(file, (" ".join(map(str, words)) + "\\n").encode())
    os.close(file)

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


class Workers:
    def __init__(self):
        folders = (Path(pymoo_psi.__file__).parents[1], Path(__file__).parents[2])
        self.process = subprocess.Popen(
            [sys.executable, "-c", SERVER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, folders))},
        )

        # Run a source in a new process and return its id; return how a process ended, 0 if well.
        self.start = partial(self._ask, "start")
        self.wait = partial(self._ask, "wait")

    def _ask(self, *command):
        self.process.stdin.write(json.dumps(command) + "\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())


@pytest.fixture(scope="module")
def workers():
    workers = Workers()
    with workers.process:
        yield workers
        workers.process.stdin.close()


def lines(path):
    return path.read_text().splitlines() if path.exists() else []


def test_the_second_writer_waits_or_names_the_first(tmp_path, study_file, workers):
    study = begun(study_file, wait=0)
    study.append(block(1, 4))
    ready, go = tmp_path / "ready", tmp_path / "go"
    pid = workers.start(
        f"with Study({str(study_file)!r}).writing():\n"
        f"    say({str(ready)!r}, 'ready')\n"
        f"    while not os.path.exists({str(go)!r}): time.sleep(0.01)\n"
        f"    Study({str(study_file)!r}).append(block(5, 4))\n"
    )
    assert until(ready.exists)
    for wait in (0, 0.3):
        refused(
            f"is being written by another process; waited {wait} s",
            Study(study_file, wait=wait).append,
            block(9, 4),
            error=StudyLockedError,
        )
    begun(study_file)
    assert len(read(study_file)[1]["x"]) == 4  # readers do not wait
    other = workers.start(f"say({str(go)!r}, 'go')")
    assert Study(study_file, wait=LONG).append(block(9, 4)) == 4
    assert workers.wait(pid) == workers.wait(other) == 0
    assert bits(read(study_file)[1]) == bits(block(1, 12))


def test_a_writer_that_was_killed_is_in_nobodys_way(tmp_path, workers):
    path, ready = tmp_path / "s.db", tmp_path / "ready"
    study = begun(path, wait=0)
    for n in range(3):
        pid = workers.start(
            f"with Study({str(path)!r}).writing():\n    say({str(ready)!r}, 'x')\n    time.sleep({LONG})"
        )
        assert until(lambda: len(lines(ready)) > n)  # noqa: B023
        os.kill(pid, signal.SIGKILL)
        workers.wait(pid)
        assert Path(f"{path}-run-1.pymoo-psi-lock").exists()
        assert study.append(block(1 + 4 * n, 4)) == 4
    assert sorted(os.listdir(tmp_path)) == ["ready", "s.db"]


def test_readers_see_whole_blocks_while_others_write(study_file, workers):
    begun(study_file)
    pid = workers.start(
        f"for n in range(1, 101, 4): Study({str(study_file)!r}).append(block(n, 4))"
    )
    expected, seen = block(1, 100), 0
    while seen < 100:
        tests = read(study_file)[1]
        assert seen <= len(tests["x"])
        seen = len(tests["x"])
        assert seen % 4 == 0
        assert bits(tests) == bits(rows(expected, np.arange(seen)))
    assert workers.wait(pid) == 0


# Disks and rights


# Rights do not bind root. What Python and the packages import late is imported before, by doing all
# of it once: their folders may be root's alone.
DROP = """
with tempfile.TemporaryDirectory() as rehearsal:
    once = begun(rehearsal + "/s.db")
    once.append(block(1, 1))
    read(once.path)
if os.getuid() == 0: os.setgid(65534); os.setuid(65534)
"""


@pytest.mark.parametrize("rights", [0o555, 0o777])
def test_what_is_read_only_can_be_read(workers, rights):
    with tempfile.TemporaryDirectory() as name:  # below which every user can reach
        folder = Path(name)
        path, report = folder / "s.db", folder / "report"
        begun(path).append(block(1, 4))
        report.touch()
        report.chmod(0o666)
        path.chmod(0o444)
        folder.chmod(rights)
        before = path.read_bytes()
        job = DROP + (
            f"study = begun({str(path)!r})\n"
            "assert len(read(study.path)[1]['x']) == 4\n"
            "try:\n"
            "    study.append(block(9, 4))\n"
            "except StudyAccessError as error:\n"
            f"    say({str(report)!r}, error)\n"
        )
        assert workers.wait(workers.start(job)) == 0
        why = "Permission denied" if rights == 0o555 else "attempt to write a readonly database"
        assert lines(report)[0].startswith(f"study {path} cannot be used: {why}; see that its fol")
        assert path.read_bytes() == before
