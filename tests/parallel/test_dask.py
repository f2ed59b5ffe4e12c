"""A cluster of Dask, two workers in processes of their own: what is lost costs nothing."""

import os
import subprocess
import sys

import joblib
import numpy as np
import pytest
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import PSI, ExecutorRunner, JoblibRunner, VectorizedSphereChute, investigate
from pymoo_psi.errors import WorkerError
from pymoo_psi.files import read_table
from tests.helpers.processes import posix, until
from tests.helpers.refusals import refused

pytestmark = posix
PYTHON = [sys.executable, "-W", "ignore", "-m"]


class Sum(ElementwiseProblem):
    """Two objectives; the output ``elsewhere`` is 1 in a worker of the cluster."""

    def __init__(self, ballast=b"", **kwargs):
        super().__init__(n_var=2, n_obj=2, xl=0, xu=1, **kwargs)
        self.ballast = ballast

    def fingerprint(self):
        return {}

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [x[0] + x[1] ** 2, 1 - x[0] * x[1]]
        out["elsewhere"] = float(os.environ.get("CLUSTER", 0))


@pytest.fixture
def cluster(tmp_path):
    """A scheduler and two workers: their processes, and a client."""
    distributed = pytest.importorskip("distributed")  # which takes long, for slow tests only
    file = tmp_path / "scheduler.json"
    options = ["--scheduler-file", str(file), "--no-dashboard"]
    worker = [*PYTHON, "distributed.cli.dask_worker", *options, "--no-nanny", "--nthreads", "1"]
    commands = [[*PYTHON, "distributed.cli.dask_scheduler", *options, "--port", "0"]]
    commands += [[*worker, "--local-directory", str(tmp_path)]] * 2
    processes = []
    for command in commands:
        environment = os.environ | {"CLUSTER": "1"}
        processes.append(subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL))
        assert until(file.exists)
    with distributed.Client(scheduler_file=str(file), timeout=2, set_as_default=False) as client:
        client.wait_for_workers(2)
        yield processes, client
    for process in processes:
        process.kill()
        process.wait()


@pytest.mark.slow
def test_clusters_of_dask_evaluate_and_may_be_lost(cluster, tmp_path, monkeypatch, said):
    (scheduler, worker, _), client = cluster
    with joblib.parallel_config("dask", client=client):
        table = investigate(Sum(elementwise_runner=JoblibRunner()), 40)
        chute = investigate(VectorizedSphereChute(0.4), 2000, runner=JoblibRunner())
    assert (table.column("elsewhere") == 1).all()
    assert chute.equals(investigate(VectorizedSphereChute(0.4), 2000))
    monkeypatch.chdir(tmp_path)
    arguments = ["solve", f"{__name__}:Sum", "--points", "40", "--study", "s.db"]
    said(*arguments, "--cluster", client.scheduler.address)
    assert read_table("s.db").equals(table)
    # A worker is killed, then the scheduler.
    path, plain = tmp_path / "killed.db", investigate(Sum(), 96)
    runner = ExecutorRunner(client)
    problem = Sum(os.urandom(500_000), elementwise_runner=runner)

    def kill(algorithm):
        if algorithm.n_tested == 64:
            worker.kill()

    run = minimize(problem, PSI(96, study=path, block_size=32), callback=kill).algorithm
    assert (run.table.column("elsewhere") == 1).all()
    np.testing.assert_array_equal(run.table.F, plain.F)
    assert until(lambda: runner.n_workers == 1)
    scheduler.kill()
    refused("takes no more work", investigate, problem, 192, error=WorkerError, study=path)
    stored = read_table(path)
    assert len(stored) >= 96
    assert not stored.reasons
    table = investigate(Sum(), 192, study=path)
    np.testing.assert_array_equal(table.F, investigate(Sum(), 192).F)
