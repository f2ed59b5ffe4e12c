"""What the tests ask of processes."""

import sys
import time

import cloudpickle
import pytest

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and process groups")

# Seconds that nothing takes, however busy the machine: only what is broken is waited for so long.
LONG = 300.0


def until(condition, every=0.005):
    """Wait until a condition holds, looking every so many seconds; return whether it does."""
    end = time.monotonic() + LONG
    while not (holds := condition()) and time.monotonic() < end:
        time.sleep(every)
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


# To workers this travels by value: to import it, and pytest with it, takes them longer.
cloudpickle.register_pickle_by_value(sys.modules[__name__])
