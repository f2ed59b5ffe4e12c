"""What the tests ask of processes."""

import sys
import time

import pytest

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and process groups")


def gone(pid):
    """Whether a process ends within 30 s, or has."""
    for _ in range(600):
        try:
            with open(f"/proc/{pid}/stat") as stat:
                if stat.read().rpartition(")")[2].split()[0] == "Z":
                    return True
        except OSError:
            return True
        time.sleep(0.05)
    return False
