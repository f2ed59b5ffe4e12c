"""PSI with a study file and with designs that fail: nothing is lost, nothing is done twice."""

import json
import os
import random
import signal
import subprocess
import sys

import pytest
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    SphereChute,
)
from pymoo_psi.errors import StudyMismatchError
from pymoo_psi.table import read_table
from tests.refusals import refused


class Counted(ElementwiseProblem):
    """Two parabolas over a square; counts its evaluations and fails where it is told to."""

    def __init__(self, broken=()):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0, xu=1)
        self.seen, self.broken = [], set(broken)

    def _evaluate(self, x, out, *args, **kwargs):
        self.seen.append(tuple(x))
        if len(self.seen) in self.broken:
            raise RuntimeError(f"no convergence at {x[0]}")
        out["F"] = [x[0] ** 2 + x[1], (1 - x[0]) ** 2 + x[1]]
        out["G"] = [x[0] - 0.9]


def run(problem, n, path, **options):
    return minimize(problem, PSI(n, study=path, block_size=16, **options)).algorithm.table


@pytest.mark.parametrize(
    ("other", "options", "message"),
    [
        (SphereChute(0.4, model="rolling"), {}, "model"),
        (SphereChute(0.5, lower=(0, 0.1), upper=(1.4, 6)), {}, "mu"),
        (SphereChute(0.4), {"study_key": "v2"}, "key"),
    ],
)
def test_another_problem_is_refused(study_file, other, options, message):
    run(SphereChute(0.4), 16, study_file)
    before = study_file.read_bytes()
    refused(message, run, other, 16, study_file, error=StudyMismatchError, **options)
    assert study_file.read_bytes() == before


def test_failed_designs_are_recorded_and_retried(study_file):
    table = run(Counted(broken={3, 7}), 32, study_file)
    assert table.numbers[table.status == "failed"].tolist() == [3, 7]
    assert table.reasons[3].startswith("RuntimeError: no convergence at")
    assert not table.feasible()[[2, 6]].any()
    again = Counted()
    assert run(again, 32, study_file).equals(table)
    assert again.seen == []
    healed = run(again, 32, study_file, retry="failed")
    assert len(again.seen) == 2
    assert healed.equals(minimize(Counted(), PSI(32)).algorithm.table)


# The modules are imported once: every run is a fork of this script, begun by the name of its log,
# after which may stand the seconds until it ends as by a kill: at once, and nothing
# of Python runs. A kill from here would come when the process of the test has its turn.
SCRIPT = """
import json, os, signal, sys, time
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize
from pymoo_psi import PSI

class Logged(ElementwiseProblem):
    def __init__(self, log):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0, xu=1)
        self.log = log

    def fingerprint(self):
        return {}  # its arguments change no value

    def _evaluate(self, x, out, *args, **kwargs):
        with open(self.log, "a") as log:
            log.write(json.dumps(list(x)) + "\\n")
        time.sleep(0.001)
        out["F"] = [x[0] ** 2 + x[1], (1 - x[0]) ** 2 + x[1]]
        out["G"] = [x[0] - 0.9]

for line in sys.stdin:
    pids = []
    for word in line.split():
        pids.append(os.fork())
        if not pids[-1]:
            log, seconds = word.split("@")
            if seconds:
                signal.setitimer(signal.ITIMER_REAL, float(seconds))
            minimize(Logged(log), PSI(200, study=sys.argv[1], study_wait=300, block_size=5))
            os._exit(0)
    print(*(os.waitpid(pid, 0)[1] for pid in pids), flush=True)
"""


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    path = tmp_path_factory.mktemp("shared") / "s.db"
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:

        def run(*runs):
            print(*runs, file=process.stdin, flush=True)
            return list(map(int, process.stdout.readline().split()))

        yield run, path
        process.stdin.close()


@pytest.fixture(scope="module")
def whole():
    return minimize(Counted(), PSI(200)).algorithm.table


forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="the runs of these tests are forks")


KILLS = 6


@forks
def test_a_study_killed_many_times_is_the_study_of_one_run(server, whole):
    """Kills at random moments: the finished table is that of an uninterrupted run, bit for bit,
    and no run evaluates a point that was committed before it."""
    run, path = server
    rng, kills, ended = random.Random(1), 0, None
    by_design = {tuple(x): n for x, n in zip(whole.X.tolist(), whole.numbers.tolist(), strict=True)}
    while kills < KILLS or ended != 0:
        committed = set(read_table(path).numbers.tolist()) if path.exists() else set()
        if ended == 0:  # finished before its kill: begin a new study
            for file in path.parent.glob("s.db*"):  # a log too, if there was nothing left to test
                file.unlink()
            committed = set()
        log = path.with_name(f"log{kills}")
        log.unlink(missing_ok=True)
        (ended,) = run(f"{log}@{rng.uniform(1e-4, 0.08) if kills < KILLS else ''}")
        kills += ended == signal.SIGALRM
        assert ended in (0, signal.SIGALRM)
        lines = log.read_text().splitlines() if log.exists() else []
        assert not {by_design[tuple(json.loads(line))] for line in lines} & committed
    assert read_table(path).equals(whole)
