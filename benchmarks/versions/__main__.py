"""Compare two versions of the package on random cases: numbers, masks, ranks, written files.

    python -m benchmarks.versions OLD_PYTHON NEW_PYTHON --cases 1000 --seed 0
    python -m benchmarks.versions OLD_PYTHON NEW_PYTHON --kind tables --case 17

Each is the interpreter of an environment with one version; ``--old-path SRC`` and ``--new-path
SRC`` set its PYTHONPATH. All values must be equal, with NaN equal to NaN, but those in
``TOLERANCES``; a value that one version alone gives is a difference, and so is an error of the new
version alone. A case that one version alone refuses counts by itself.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

SCRIPT = Path(__file__).with_name("cases.py")
# Relative, by kind and name; to the last bit elsewhere. Numbers in sentences are rounded there.
TOLERANCES: dict[tuple[str, str], float] = {}
LIBRARIES = ("numpy", "scipy", "pandas", "pymoo")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", help="only this kind")
    parser.add_argument("--case", type=int, help="only this case of the kind, shown in full")
    parser.add_argument("--old-path", help="PYTHONPATH of the old version")
    parser.add_argument("--new-path", help="PYTHONPATH of the new version")
    options = parser.parse_args()
    versions = {libraries(options.old), libraries(options.new)}
    if len(versions) > 1:
        print("Not the same libraries:", *versions, sep="\n")
    cases = {}
    for kind, number in counts(options.cases).items():
        if options.kind not in (None, kind):
            continue
        cases[kind] = [0, number] if options.case is None else [options.case, 1]
    words = [options.seed, json.dumps(cases)]
    running = [
        start(options.old, options.old_path, *words),
        start(options.new, options.new_path, *words),
    ]
    old, new = map(result, running)
    print(f"{'kind':18}{'cases':>7}{'differ':>8}{'only old':>10}{'only new':>10}{'errors':>8}")
    total = np.zeros(5, int)
    reports = []
    for kind, (first, number) in cases.items():
        row = np.array([number, 0, 0, 0, 0])
        for case, (before, after) in enumerate(zip(old[kind], new[kind], strict=True), start=first):
            verdict, names = compared(kind, before, after)
            if verdict == 0:
                continue
            row[verdict] += 1
            if options.case is None and row[verdict] > 1:
                continue
            reports.append(f"--kind {kind} --case {case}: {WORDS[verdict]}")
            most = 4 if options.case is None else 99
            reports += [shown(name, before, after) for name in names[:most]]
        total += row
        print(table_row(kind, row))
    print(table_row("all", total))
    print("only old, only new: a case that the other version refuses; errors: in both versions")
    print("\n".join(reports))
    sys.exit(int(total[1] + total[4] > 0))


WORDS = [
    "",
    "different values",
    "refused by the new version",
    "refused by the old version, or an error there",
    "an error in both versions",
]


def table_row(kind: str, row: Any) -> str:
    return f"{kind:18}{row[0]:7}{row[1]:8}{row[2]:10}{row[3]:10}{row[4]:8}"


def counts(cases: int) -> dict[str, int]:
    """Return how many cases of each kind there are, from the shares that the script tells."""
    text = SCRIPT.read_text("utf-8").partition("KINDS = {")[2].partition("}")[0]
    pairs = [pair.split(":") for pair in text.partition("\n")[2].split(",") if ":" in pair]
    shares = {name.strip(): int(share) for name, share in pairs}
    return {
        name: max(1, round(cases * share / sum(shares.values()))) for name, share in shares.items()
    }


def environment(path: str | None) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return kept | {"OMP_NUM_THREADS": "1"} | ({"PYTHONPATH": path} if path else {})


def libraries(python: str) -> str:
    ask = f"from importlib.metadata import version; print(*map(version, {LIBRARIES}))"
    return subprocess.run([python, "-c", ask], capture_output=True, text=True).stdout.strip()


def start(python: str, path: str | None, *words: Any) -> tuple[subprocess.Popen[bytes], Path]:
    """Start one version on the cases of a kind."""
    file = Path(tempfile.mkstemp(suffix=".pickle")[1])
    place = tempfile.gettempdir()
    command = [python, str(SCRIPT), str(file), *map(str, words)]
    return subprocess.Popen(command, env=environment(path), cwd=place), file


def result(running: tuple[subprocess.Popen[bytes], Path]) -> Any:
    process, file = running
    if process.wait() != 0:
        sys.exit(f"{' '.join(map(str, process.args))} ended with {process.returncode}")
    found = pickle.loads(file.read_bytes())
    file.unlink()
    return found


def compared(kind: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[int, list[str]]:
    """Return which word describes a case, and the names that differ."""
    if "error" in old and "error" in new:
        return 4, ["error"]
    if "error" in new:
        return 1, ["error"]
    if "error" in old:
        return 3, ["error"]
    refused = {name for name, value in old.items() if refusal(value)}
    refused_now = {name for name, value in new.items() if refusal(value)}
    if refused_now - refused:
        return 2, sorted(refused_now - refused)
    if refused - refused_now:
        return 3, sorted(refused - refused_now)
    different = sorted(set(old) ^ set(new))
    for name in old:
        if name in new and not same(old[name], new[name], tolerance(kind, name)):
            different.append(name)
    return int(bool(different)), different


def refusal(value: Any) -> bool:
    return isinstance(value, str) and value == "refused"


def tolerance(kind: str, name: str) -> float:
    near = [value for (k, n), value in TOLERANCES.items() if fnmatch(kind, k) and fnmatch(name, n)]
    return max(near, default=0.0)


def same(old: Any, new: Any, relative: float) -> bool:
    """Whether two values are equal, NaN to NaN."""
    if isinstance(old, Mapping):
        return list(old) == list(new) and all(same(old[k], new[k], relative) for k in old)
    if isinstance(old, list | tuple | np.ndarray) and np.asarray(old, object).ndim > 0:
        a, b = np.asarray(old, object), np.asarray(new, object)
        pairs = zip(a.ravel(), b.ravel(), strict=True)
        return a.shape == b.shape and all(same(x, y, relative) for x, y in pairs)
    if isinstance(old, float) and isinstance(new, float) and relative > 0:
        return math.isclose(old, new, rel_tol=relative) or (old != old and new != new)
    return bool(old == new or (old != old and new != new))


def shown(name: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    return "\n".join(
        [f"  {name}", f"    old {short(old.get(name))}", f"    new {short(new.get(name))}"]
    )


def short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) < 300 else f"{text[:300]} …"


if __name__ == "__main__":
    main()
