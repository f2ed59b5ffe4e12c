"""What every benchmark says about where it ran, and how it times."""

from __future__ import annotations

import os
import platform
import resource
import sys
import time
from collections.abc import Callable
from importlib.metadata import version


def describe_machine() -> str:
    """Return processor, cores, Python and the releases that matter, in one line."""
    model = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [
                line.split(":", 1)[1].strip() for line in file if line.startswith("model name")
            ]
        model = names[0] if names else model
    except OSError:
        pass
    packages = ", ".join(f"{name} {version(name)}" for name in ("pymoo", "numpy", "scipy"))
    return f"{model}, {os.cpu_count()} cores, Python {platform.python_version()}, {packages}"


def peak_megabytes() -> float:
    """Return the largest memory the process has had."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def processor_seconds(function: Callable[[], object], repeat: int = 1) -> float:
    """Return the shortest time of the processor, of all threads, of several calls."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)
