"""What the tests ask of processes."""

import sys
import time

import cloudpickle
import pytest

from pymoo_psi.parallel import _pool

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and process groups")

# Seconds that nothing takes, however busy the machine: only what is broken is waited for so long.
LONG = 300.0


def until(condition):
    """Wait until a condition holds; return whether it does."""
    end = time.monotonic() + LONG
    while not (holds := condition()) and time.monotonic() < end:
        time.sleep(0.005)
    return holds


def gone(pid):
    """Whether a process ends, or has ended."""

    def ended():
        try:
            with open(f"/proc/{pid}/stat") as stat:
                return stat.read().rpartition(")")[2].split()[0] == "Z"
        except OSError:
            return True

    return until(ended)


def let_limits_pass(stuck, patch=setattr):
    """Let the time limit of workers pass as soon as nothing but stuck designs is under way.

    So a limit that no other design meets, however busy the machine, takes no time.

    Args:
        stuck: Says of a design whether it never ends, and may be ended now.
        patch: Sets an attribute, such as ``monkeypatch.setattr``.
    """
    clock, step = _pool.monotonic, _pool._Run._step
    ahead = 0.0

    def stepping(run):
        nonlocal ahead
        busy = [worker.at[0][1] for worker in run.workers if worker.at]
        if busy and all(map(stuck, busy)) and all(worker.ready for worker in run.workers):
            ahead += run.timeout
        yield from step(run)

    patch(_pool._Run, "_step", stepping)
    patch(_pool, "monotonic", lambda: clock() + ahead)
    patch(_pool, "_POLL", 0.05)


# To workers this travels by value: to import it, and pytest with it, takes them longer.
cloudpickle.register_pickle_by_value(sys.modules[__name__])
