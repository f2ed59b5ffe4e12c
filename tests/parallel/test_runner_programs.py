"""Runners in whole programs: they run without a guard, and leave no worker behind."""

import os
import signal
import subprocess
import sys
import textwrap

import pytest

from tests.processes import gone, posix

PROGRAM = """
import os, signal, sys, time
from pymoo.core.problem import ElementwiseProblem
from pymoo_psi import JoblibRunner
import numpy as np

class Slow(ElementwiseProblem):  # in the main script, which has no guard
    def __init__(self, **kwargs):
        super().__init__(n_var=1, n_obj=1, xl=0, xu=1, **kwargs)
    def _evaluate(self, x, out, *args, **kwargs):
        os.write(1, b"at %d\\n" % os.getpid())
        time.sleep(SECONDS)
        out["F"] = x[0]

signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
problem = Slow(elementwise_runner=JoblibRunner(2, OPTIONS))
print(problem.evaluate(np.linspace(0, 1, 6)[:, None]).sum(), flush=True)
"""


def program(seconds, options):
    code = textwrap.dedent(PROGRAM).replace("SECONDS", str(seconds)).replace("OPTIONS", options)
    return subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.parametrize("options", ["timeout=100.0", "in_process=False", ""])
def test_a_script_without_a_guard_runs_and_ends(options):
    out, err = program(0.01, options).communicate(timeout=60)
    assert out.splitlines()[-1] == "3.0", err
    assert err == ""


@posix
@pytest.mark.parametrize("options", ["timeout=100.0", "in_process=False"])
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL], ids=["SIGINT", "SIGKILL"])
def test_an_interrupted_program_leaves_no_workers(options, how):
    process = program(600, options)
    try:
        workers = [int(process.stdout.readline().split()[1]) for _ in range(2)]
        os.kill(process.pid, how)  # as Ctrl-C would, but to the parent alone
        process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert process.returncode != 0
    assert all(gone(pid) for pid in workers)
