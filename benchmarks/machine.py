"""The machine on which a benchmark runs, and how times are measured."""

from __future__ import annotations

import os
import platform
import resource
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path


def describe_machine() -> str:
    """Return processor, cores, Python and the releases of packages that matter, in one line."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("pymoo", "numpy", "scipy"))
    python = f"Python {platform.python_version()}"
    return f"{_processor()}, {os.cpu_count()} cores, {python}, {packages}"


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def peak_megabytes() -> float:
    """Return the largest memory of the process so far."""
    unit = 1024
    if sys.platform == "darwin":
        unit = 1
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def processor_seconds(function: Callable[[], object], repeat: int = 1) -> float:
    """Return the shortest processor time of several calls, summed over all threads."""
    return _shortest(time.process_time, function, repeat)


def wall_seconds(function: Callable[[], object], repeat: int = 1) -> float:
    """Return the shortest time of several calls by the clock: of what runs on several cores."""
    return _shortest(time.perf_counter, function, repeat)


def _shortest(clock: Callable[[], float], function: Callable[[], object], repeat: int) -> float:
    times = []
    for _ in range(repeat):
        start = clock()
        function()
        times.append(clock() - start)
    return min(times)
