"""The same run on every engine: tables must be those of a serial run.

    python -m benchmarks.engines [mpi] [jobqueue] [submitit] [parsl] [array]

Each part runs PSI with a study, and SurrogatePSI, on four workers of an engine:

- ``mpi``: ``mpiexec -n 5 python -m mpi4py.futures``.
- ``jobqueue``: ``dask_jobqueue.SLURMCluster``, four jobs of one worker; two of them are cancelled
  by ``scancel`` during the run, and others take their place.
- ``submitit``: four designs at a time, each a job of SLURM, whose futures can only be polled.
- ``parsl``: parsl's executor of threads.
- ``array``: an array of four jobs of SLURM, each with a share of the points; one is cancelled and
  submitted again.

The parts with SLURM need a cluster; one node suffices.
"""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

from pymoo.optimize import minimize

from benchmarks.cluster import Asleep, new_study, repeated
from benchmarks.machine import QUICK, describe_machine, sized
from pymoo_psi import PSI, ExecutorRunner, SurrogatePSI, investigate, read_table

N = sized(120, 16)
MEAN = 0.2
FOLDER = str(Path.cwd())
# Where jobs on a node write; it must be a folder that all nodes see.
SHARED = os.environ.get("SHARED_FOLDER", tempfile.gettempdir())


def shared_folder() -> str:
    return tempfile.mkdtemp(dir=SHARED)


def run_on(
    name: str,
    runner: ExecutorRunner,
    log: str,
    n: int = N,
    disturb: Callable[[], None] | None = None,
) -> None:
    """Run both algorithms; print what they took and how many evaluations were repeated."""
    serial = investigate(Asleep(), n)
    problem = Asleep(MEAN, log, elementwise_runner=runner)
    if disturb is not None:
        threading.Thread(target=disturb, daemon=True).start()
    began = time.perf_counter()
    table = minimize(problem, PSI(n, study=new_study())).algorithm.table
    seconds = time.perf_counter() - began
    assert table.equals(serial), f"{name}: not the table of a serial run"
    text = f"{name}: PSI {n} tests in {seconds:.1f} s"
    if os.path.exists(log):
        text += f", {repeated(log)} evaluations repeated"
    problem = Asleep(MEAN, elementwise_runner=runner)
    result = minimize(problem, SurrogatePSI(40, study=new_study()))
    assert len(result.algorithm.table) == 40
    assert (result.algorithm.table.status == "ok").all()
    print(f"{text}; SurrogatePSI 40 tests", flush=True)


def mpi() -> None:
    """Run on MPI; this process starts another one, which is the driver."""
    command = ["mpiexec", "--allow-run-as-root", "--oversubscribe", "-n", "5", sys.executable]
    subprocess.run([*command, "-m", "mpi4py.futures", "-m", "benchmarks.engines", "mpi-driver"])


def mpi_driver() -> None:
    from mpi4py.futures import MPIPoolExecutor

    with MPIPoolExecutor() as executor:
        run_on("MPI", ExecutorRunner(executor), f"{shared_folder()}/log")


def jobs() -> list[str]:
    """Return the numbers of this user's running jobs."""
    command = ["squeue", "--noheader", "--states", "running", "--format", "%A"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def jobqueue() -> None:
    """Run on workers of Dask that are jobs of SLURM; cancel two."""
    from dask.distributed import Client
    from dask_jobqueue import SLURMCluster

    folder = shared_folder()
    with (
        SLURMCluster(
            cores=1,
            processes=1,
            memory="1GB",
            walltime="00:20:00",
            python=sys.executable,
            log_directory=folder,
            local_directory=folder,
            job_script_prologue=[f"cd {FOLDER}", f"export PYTHONPATH={FOLDER}"],
            scheduler_options={"dashboard_address": None},
        ) as cluster,
        Client(cluster) as client,
    ):
        cluster.adapt(minimum=4, maximum=4)
        client.wait_for_workers(4)

        def disturb() -> None:
            for _ in range(2):
                time.sleep(2)
                subprocess.run(["scancel", jobs()[0]], check=True)

        run_on(
            "SLURMCluster, two jobs cancelled",
            ExecutorRunner(client),
            f"{folder}/log",
            240,
            disturb,
        )


class SlurmExecutor(Executor):
    """submitit's executor with the interface of Python's."""

    def __init__(self, folder: str) -> None:
        import submitit

        logging.getLogger("submitit").setLevel(logging.ERROR)  # it asks for SLURM's accounting
        self._executor = submitit.AutoExecutor(folder)
        setup = [f"cd {FOLDER}"]
        self._executor.update_parameters(timeout_min=10, slurm_mem="1GB", slurm_setup=setup)

    def submit(self, function: Any, /, *args: Any, **kwargs: Any) -> Any:
        """Submit a job."""
        return self._executor.submit(function, *args, **kwargs)


def submitit() -> None:
    """Run each piece as a job of SLURM."""
    folder = shared_folder()
    run_on("submitit", ExecutorRunner(SlurmExecutor(folder), workers=4), f"{folder}/log", 12)


class ParslExecutor(Executor):
    """An executor of parsl with the interface of Python's."""

    def __init__(self, executor: Any) -> None:
        self._executor = executor

    def submit(self, function: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submit a task, without any wishes for its resources."""
        return self._executor.submit(function, {}, *args, **kwargs)


def parsl() -> None:
    """Run on parsl's threads."""
    from parsl.executors import ThreadPoolExecutor

    executor = ThreadPoolExecutor(max_threads=4)
    executor.start()
    runner = ExecutorRunner(ParslExecutor(executor), workers=4)
    run_on("parsl", runner, f"{shared_folder()}/log")
    executor.shutdown()


SCRIPT = """#!/bin/bash
cd {folder}
export PYTHONPATH={folder}
{python} -m pymoo_psi solve benchmarks.engines:Slow --points 240 \\
    --study {shares} --share "$SLURM_ARRAY_TASK_ID/4"
"""


class Slow(Asleep):
    """Designs of an exponentially distributed time, 0.2 s in the mean."""

    def __init__(self) -> None:
        super().__init__(MEAN, os.environ.get("SLOW_LOG"))


def array() -> None:
    """Run shares as an array of jobs; cancel one and submit it again."""
    folder = shared_folder()
    script = Path(folder) / "job.sh"
    shares = f"{folder}/shares"
    script.write_text(SCRIPT.format(folder=FOLDER, python=sys.executable, shares=shares))
    log = f"{folder}/log"
    environment = {**os.environ, "SLOW_LOG": log}

    def submitted(parts: str) -> subprocess.Popen[bytes]:
        command = ["sbatch", "--wait", f"--output={folder}/%a.out", "--array", parts, str(script)]
        return subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL)

    first = submitted("1-4")
    while not os.path.exists(log) or len(Path(log).read_text().splitlines()) < 60:
        time.sleep(0.1)
    running = subprocess.run(
        ["squeue", "--noheader", "--array", "--format", "%i"], capture_output=True, text=True
    ).stdout.split()
    subprocess.run(["scancel", "--signal=KILL", running[-1]], check=True)
    first.wait()
    assert submitted(running[-1].partition("_")[2]).wait() == 0
    serial = investigate(Asleep(), 240)
    assert read_table(shares).equals(serial), "not the table of a serial run"
    print(f"array of 4 shares, one job killed: {repeated(log)} evaluations repeated", flush=True)


PARTS = {
    "mpi": mpi,
    "jobqueue": jobqueue,
    "submitit": submitit,
    "parsl": parsl,
    "array": array,
}


def main(parts: list[str]) -> None:
    """Run the parts named, or all."""
    if parts == ["mpi-driver"]:
        mpi_driver()
        return
    print(describe_machine(), flush=True)
    for name, part in PARTS.items():
        if parts and name not in parts:
            continue
        try:
            part()
        except (ImportError, OSError) as error:
            if not QUICK:
                raise
            print(f"{name}: {error}")


if __name__ == "__main__":
    main(sys.argv[1:])
