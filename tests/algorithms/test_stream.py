"""The designs of a run as one stream: no barriers, no design twice, nothing lost."""

import copy
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import PSI, JoblibRunner, ProcessRunner, investigate
from pymoo_psi.files import read_table
from pymoo_psi.study import Study
from tests.helpers.draws import rarely
from tests.helpers.models import Model, Sum
from tests.helpers.processes import posix, until
from tests.helpers.refusals import interrupted


@pytest.mark.parametrize(
    ("study", "make"),
    [
        (True, ProcessRunner),
        pytest.param(False, ProcessRunner, marks=pytest.mark.slow),
        pytest.param(True, JoblibRunner, marks=pytest.mark.slow),
    ],
)
def test_the_order_of_arrival_changes_no_table(tmp_path, study, make):
    plain = minimize(Sum(), PSI(100)).algorithm.table
    problem = Sum(lambda x: time.sleep(x[0] * 977 % 0.01), elementwise_runner=make(2))
    path = tmp_path / "s.db" if study else None
    assert investigate(problem, 60, study=path, block_size=7).equals(plain.take(np.arange(60)))
    result = minimize(problem, PSI(100, study=path, block_size=9))
    assert result.algorithm.table.equals(plain)
    assert result.algorithm.evaluator.n_eval == (40 if study else 100)


def test_a_runner_with_a_call_of_its_own_gets_batches():
    sizes = []

    class Counting(JoblibRunner):
        def __call__(self, f, X):
            sizes.append(len(X))
            return super().__call__(f, X)

    investigate(Sum(elementwise_runner=Counting(1)), 8)
    assert sum(sizes) == 8


def test_no_worker_waits_for_the_slowest_of_a_block(tmp_path):
    """The first point ends only when all others are tested: no block is a barrier."""

    def held(x):
        (tmp_path / str(x.tolist())).touch()
        if not x.any():
            assert until(lambda: len(os.listdir(tmp_path)) == 100)

    problem, n_seen = Sum(held, elementwise_runner=ProcessRunner(3)), []
    options = {"callback": lambda algorithm: n_seen.append(len(os.listdir(tmp_path)))}
    minimize(problem, PSI(100, block_size=10), **options)
    assert n_seen == [100] * 10


def test_a_termination_bounds_what_is_evaluated_ahead(study_file):
    """At most 8 designs a worker beyond the block that it has seen; a study keeps them."""
    result = minimize(
        Sum(elementwise_runner=ProcessRunner(2)),
        PSI(500, block_size=10, study=study_file),
        ("n_eval", 10),
    )
    assert result.algorithm.n_tested == result.algorithm.evaluator.n_eval == 10
    assert 10 <= len(read_table(study_file)) <= 26


def test_a_copy_of_a_run_ahead_continues_alone():
    """Copies take what has arrived; what is being evaluated stays with the run."""
    algorithm = PSI(40, block_size=10).setup(Sum(elementwise_runner=ProcessRunner(1)))
    algorithm.next()
    for run in (copy.deepcopy(algorithm), algorithm):
        run.run()
        assert run.table.equals(investigate(Sum(), 40))


class TakingLong(ProcessRunner):
    """A runner of many workers, the results of which arrive together after long computing.

    Args:
        seconds: What each result is said to have taken.
        seen: Called after each result that has been taken.
    """

    def __init__(self, seconds, seen):
        super().__init__(1)
        self.seconds, self.seen = seconds, seen

    def results(self, queue):
        for index, values, _ in queue.evaluated_here():
            yield index, values, self.seconds
            self.seen()


@pytest.mark.parametrize("seconds", [0.01, 7.0, *rarely(30.0)])
def test_results_of_long_computing_are_stored_at_once(study_file, seconds):
    """At most 20 seconds of computing may be lost, though less than a second has passed."""
    stored = []
    runner = TakingLong(seconds, lambda: stored.append(len(read_table(study_file))))
    investigate(Sum(elementwise_runner=runner), 64, study=study_file)
    assert ((np.arange(1, 65) - stored) * seconds < 20).all()
    assert len(read_table(study_file)) == 64


ENDED = """
import os, signal, sys, time
import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize
from pymoo_psi import PSI, ProcessRunner

class Slow(ElementwiseProblem):
    def __init__(self, **kwargs):
        super().__init__(n_var=2, n_obj=2, xl=0, xu=1, **kwargs)
    def _evaluate(self, x, out, *args, **kwargs):
        a, b = np.ravel(x)
        if a == b == 0.5:  # the second one
            os.write(1, b"under way\\n")
            time.sleep(600)
        out["F"] = np.reshape([a + b**2, 1 - a * b], np.shape(x))

from pymoo_psi import Recorded, investigate
from pymoo_psi.algorithms import _run
from tests.helpers.refusals import interrupted
_run.SECONDS = 1e9  # no commit but the last

def evaluate(ledger, evaluation, evaluate=_run.Ledger.evaluate):
    evaluate(ledger, evaluation)
    os.write(1, b"a result has arrived\\n")

_run.Ledger.evaluate = evaluate
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
RUN
"""
OF_PSI = "minimize(Slow(RUNNER), PSI(64, study=sys.argv[1]))"
RECORDED = "Recorded(Slow(RUNNER), study=sys.argv[1]).evaluate(np.array([[0.2, 0.2], [0.5, 0.5]]))"
IN_WORKERS = "elementwise_runner=ProcessRunner(1, timeout=1e3)"


@posix
@pytest.mark.parametrize(
    ("run", "runner", "how"),
    [  # each with each other once
        (OF_PSI, "", signal.SIGINT),
        pytest.param(RECORDED, IN_WORKERS, signal.SIGTERM, marks=pytest.mark.slow),
        pytest.param(OF_PSI, IN_WORKERS, signal.SIGTERM, marks=pytest.mark.slow),
        pytest.param(RECORDED, "", signal.SIGINT, marks=pytest.mark.slow),
        pytest.param(
            "investigate(Slow(elementwise=False), 64, block_size=1, study=sys.argv[1])",
            "",
            signal.SIGTERM,
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_has_arrived_is_stored_at_the_end(tmp_path, how, runner, run):
    path = tmp_path / "s.db"
    code = ENDED.replace("RUN\n", run + "\n").replace("RUNNER", runner)
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    awaited = {b"a result has arrived\n", b"under way\n"}
    with process:
        while awaited:  # the designs of a worker begin in any order
            awaited.discard(process.stdout.readline())
        os.kill(process.pid, how)
    assert process.returncode in {signal.SIGINT: (-how, 128 + how, 1)}.get(how, (-how,))
    stored = read_table(path)
    assert 1 in stored.numbers
    assert not (stored.X == 0.5).all(axis=1).any()
    assert os.listdir(tmp_path) == ["s.db"]  # nor does a lock lie beside it


def test_what_has_arrived_is_stored_though_a_commit_is_interrupted(study_file, monkeypatch):
    """No other one is tried for an error."""
    for error, n_stored in ((KeyboardInterrupt, 4), (ValueError, 0)):

        def fail(*_, error=error, **options):
            monkeypatch.undo()
            raise error

        for run in (investigate, lambda *args, **to: minimize(args[0], PSI(args[1], **to))):
            study_file.unlink(missing_ok=True)
            monkeypatch.setattr(Study, "append", fail)
            with pytest.raises(error):
                run(Sum(), 4, study=study_file)
            assert len(read_table(study_file)) == n_stored


@pytest.mark.parametrize(
    "run",
    [
        lambda problem, study: minimize(problem, PSI(64, study=study)),
        lambda problem, study: investigate(problem, 64, study=study),
    ],
)
@pytest.mark.parametrize(
    ("study", "expected"),
    [(None, "no test is kept"), ("s.db", r"kept in study .*s\.db; the same call goes on")],
)
def test_an_interrupt_says_how_to_continue(in_folder, study, expected, run):
    interrupted(run, Model(lambda x: {"F": x}, n_var=2, stop=6), study, message=expected)


# Of 12 designs, three give a further output.
RARELY = Model(
    lambda x: {"F": [x[0] - x[1], x[1]]} | ({"heat": 10.0 + x[1]} if x[0] == 3 else {}),
    n_var=2,
    xu=[3, 2],
    vtype=int,
)


@pytest.mark.parametrize("block_size", [1, 4, 64])
@pytest.mark.parametrize("study", [False, True])
def test_repeated_designs_have_the_outputs_of_the_first(study_file, block_size, study):
    """Also in a block none of whose designs gives an output that others give."""
    path = study_file if study else None
    for n_points in (20, 64):
        table = investigate(RARELY, n_points, study=path, block_size=block_size)
    x, y = table.X.T
    np.testing.assert_array_equal(table.column("heat"), np.where(x == 3, 10.0 + y, np.nan))
    assert len(np.unique(table.X, axis=0)) == (~table.repeats).sum()
    assert table.repeats.any() != study  # a study has each design once
