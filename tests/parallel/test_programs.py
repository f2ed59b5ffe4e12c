"""Runners in whole programs: they run without a guard, import what their parent does, and leave
no process behind."""

import contextlib
import os
import signal
import subprocess
import sys
import textwrap

import pytest

from tests.helpers.folders import write_files
from tests.helpers.processes import LONG, gone, posix


def start(code, folder=None, **options):
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)] if folder is None else [sys.executable, code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        cwd=folder,
        **options,
    )


def end(process, pids):
    """End a program and what it may have left, which may still hold its pipes open."""
    for pid in (process.pid, *pids):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    process.stderr.close()


SLOW = """
import os, time
from pymoo.core.problem import ElementwiseProblem
from pymoo_psi import RUNNER
import numpy as np

class Slow(ElementwiseProblem):  # in the main script, which has no guard
    def __init__(self, **kwargs):
        super().__init__(n_var=1, n_obj=1, xl=0, xu=1, **kwargs)
    def _evaluate(self, x, out, *args, **kwargs):
        time.sleep(0.1)
        out["F"] = x[0]

problem = Slow(elementwise_runner=RUNNER(2))
print(problem.evaluate(np.linspace(0, 1, 6)[:, None]).sum(), flush=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize("runner", ["ProcessRunner", "JoblibRunner"])
def test_a_script_without_a_guard_runs_and_ends(runner):
    assert start(SLOW.replace("RUNNER", runner)).communicate(timeout=LONG) == ("3.0\n", "")


# What a model may be at when its program ends: it tells its processes, then it never returns.

STUCK = """
import os, re, signal, subprocess, sys, time

def stuck(x):
    solvers = [subprocess.Popen(["sleep", "600"], start_new_session=new) for new in (False, True)]
    os.write(1, f"{os.getpid()} {solvers[0].pid} {solvers[1].pid}\\n".encode())
    re.match("(a+)+$", "a" * 60 + "b")  # holds the interpreter's lock for years

signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
"""
RUNNER = "from pymoo_psi import ProcessRunner\nProcessRunner(2, {})(stuck, [0, 1, 2])"
TASKS = """
from pymoo_psi import ProcessRunner
from pymoo_psi.parallel import Queue
queue = Queue(stuck, ProcessRunner(2))
queue.add(enumerate(range(9)))
list(queue)
"""
BLOCKS = """
from pymoo.core.problem import Problem
from pymoo_psi import investigate
class Stuck(Problem):
    def _evaluate(self, X, out, *args, **kwargs):
        stuck(X)
investigate(Stuck(n_var=1, n_obj=1, xl=0.0, xu=1.0), 1000, n_jobs=2)
"""


@posix
@pytest.mark.parametrize(
    ("program", "how"),
    [
        (RUNNER.format(""), signal.SIGKILL),
        pytest.param(BLOCKS, signal.SIGTERM, marks=pytest.mark.slow),
        pytest.param(RUNNER.format("timeout=1e4"), signal.SIGTERM, marks=pytest.mark.slow),
        # as Ctrl-C, but to the parent alone
        pytest.param(RUNNER.format(""), signal.SIGINT, marks=pytest.mark.slow),
        pytest.param(TASKS, signal.SIGKILL, marks=pytest.mark.slow),
    ],
    ids=["workers-SIGKILL", "blocks-SIGTERM", "timeout-SIGTERM", "workers-SIGINT", "tasks-SIGKILL"],
)
def test_no_process_outlives_its_program(program, how):
    """Neither a worker that is stuck, nor what the model has started there in any group."""
    process, pids = start(STUCK + program), []
    try:
        pids = [int(pid) for _ in range(2) for pid in process.stdout.readline().split()]
        os.kill(process.pid, how)
        assert process.wait(timeout=LONG) != 0
        assert len(pids) == 6
        assert all(map(gone, pids))
    finally:
        end(process, pids)


ABANDONED = """
from concurrent.futures import ThreadPoolExecutor
from pymoo_psi import ExecutorRunner, ProcessRunner
from pymoo_psi.parallel import Queue
queue = Queue(lambda x: x and stuck(x), RUNNER)
queue.add(enumerate([0, 1, 2]))
queue.wait()
"""


@posix
@pytest.mark.parametrize(
    "ending",
    [
        pytest.param(ABANDONED.replace("RUNNER", "ProcessRunner(2)"), marks=pytest.mark.slow),
        ABANDONED.replace("RUNNER", "ProcessRunner(2)") + "queue.close()",
        pytest.param(
            ABANDONED.replace("RUNNER", "ExecutorRunner(ThreadPoolExecutor(2))") + "queue.close()",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["abandoned", "closed", "executor"],
)
def test_a_program_with_a_stuck_model_ends(ending):
    """Python waits for the threads of an executor: an abandoned run must have ended theirs."""
    done = subprocess.run([sys.executable, "-c", STUCK + ending], capture_output=True, timeout=LONG)
    assert (done.returncode, done.stderr) == (0, b"")


@posix
def test_a_parent_whose_fork_lives_on_leaves_no_workers():
    """The fork has all the parent's pipes open."""
    process = start(
        STUCK
        + "from pymoo_psi import ProcessRunner\n"
        + "runner = ProcessRunner(2)\n"
        + "pids = runner(lambda x: {'pid': (os.getpid(), time.sleep(0.1))[0]}, range(8))\n"
        + "print(*{values['pid'] for values in pids}, flush=True)\n"
        + "if os.fork() == 0:\n"
        + "    print(os.getpid(), *runner(lambda x: {'': x}, [1, 2]), flush=True)\n"
        + "time.sleep(600)"
    )
    workers, fork = [], []
    try:
        workers = [int(pid) for pid in process.stdout.readline().split()]
        pid, values = process.stdout.readline().split(maxsplit=1)
        fork.append(int(pid))
        process.kill()
        assert values == "{'': 1} {'': 2}\n", "the fork has workers of its own"
        assert all(map(gone, workers))
    finally:
        end(process, [*workers, *fork])


# What workers import


@pytest.mark.slow
def test_workers_import_from_where_the_program_does(tmp_path):
    """Not from the current folder, which is not that of the program."""
    added = tmp_path / "added"
    texts = dict.fromkeys(
        [f"here/{name}.py" for name in ("json", "numpy", "pickle", "own")],
        "import os; os.write(1, b'from the current folder')",
    )
    texts["added/own.py"] = "def double(x):\n    return {'F': 2 * x}"
    texts["there/program.py"] = (
        "import sys\n"
        "from pymoo_psi import ProcessRunner\n"
        f"sys.path.append({str(added)!r})\n"
        "import own\n"
        "print(ProcessRunner(2)(own.double, [1, 2]))"
    )
    write_files(tmp_path, texts)
    process = start(str(tmp_path / "there/program.py"), folder=tmp_path / "here")
    assert process.communicate(timeout=LONG) == ("[{'F': 2}, {'F': 4}]\n", "")


SERVICE = """
from pathlib import Path
from pymoo.core.problem import ElementwiseProblem
from pymoo_psi import ProcessRunner, investigate
class Chatty(ElementwiseProblem):
    def _evaluate(self, x, out, *args, **kwargs):
        print("step", flush=True)
        out["F"] = x[0]
runner = ProcessRunner(2)
table = investigate(Chatty(n_var=1, n_obj=1, xl=0, xu=1, elementwise_runner=runner), 32)
Path("ok").write_text(str((table.status == "ok").sum()))
"""


@posix
@pytest.mark.slow
@pytest.mark.parametrize(
    "program", ["exec {} <&- >&- 2>&-", "exec {} <&- >&-", "ulimit -n 64; exec {}"]
)
def test_a_program_without_streams_or_with_few_files_loses_no_design(tmp_path, program):
    """A socket of a worker then has the number of a stream, to which a model may print."""
    (tmp_path / "service.py").write_text(SERVICE)
    subprocess.run(
        program.format(f"'{sys.executable}' service.py"),
        shell=True,
        cwd=tmp_path,
        timeout=LONG,
        check=True,
    )
    assert (tmp_path / "ok").read_text() == "32"
