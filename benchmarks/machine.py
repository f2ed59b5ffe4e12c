"""The machine on which a benchmark runs, and how times are measured."""

from __future__ import annotations

import os
import platform
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")

# The processes that a benchmark starts have the sizes of the benchmark.
QUICK = "--quick" in sys.argv or "BENCHMARKS_QUICK" in os.environ
"""Whether a benchmark only shows that it runs: ``python -m benchmarks.NAME --quick``."""
if QUICK:
    os.environ["BENCHMARKS_QUICK"] = "yes"
    sys.argv = [word for word in sys.argv if word != "--quick"]


def sized(usual: T, quick: T) -> T:
    """Return the usual size of a benchmark, or the one with which it only shows that it runs."""
    if QUICK:
        return quick
    return usual


def output(path: Path) -> Path:
    """Return a file or folder to write; a copy if a benchmark only shows that it runs."""
    if not QUICK:
        return path
    copy = Path(tempfile.mkdtemp(), path.name)
    if path.is_file():
        shutil.copy(path, copy)
    elif path.is_dir():
        copy.mkdir()
    return copy


def write_block(page: Path, begin: str, end: str, lines: Sequence[str]) -> None:
    """Write lines between two marks of a page."""
    before, rest = page.read_text("utf-8").split(begin)
    _, after = rest.split(end, 1)
    page.write_text("\n".join([f"{before}{begin}", "", *lines, "", f"{end}{after}"]), "utf-8")


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
