"""What the tests ask of processes."""

import subprocess
import sys
import time
from pathlib import Path

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


def printed_by(*command, **options):
    """Return what a program prints, which must end well."""
    done = subprocess.run(command, capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def gone(pid):
    """Whether a process ends, or has ended."""

    def ended():
        try:
            return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
        except OSError:
            return True

    return until(ended)


# To workers this travels by value: to import it, and pytest with it, takes them longer.
cloudpickle.register_pickle_by_value(sys.modules[__name__])
