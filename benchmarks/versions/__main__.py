"""Compare two versions of the package on random cases: numbers, masks, ranks, written files.

    python -m benchmarks.versions OLD_PYTHON NEW_PYTHON --cases 1000 --seed 0
    python -m benchmarks.versions OLD_PYTHON NEW_PYTHON --kind tables --case 17

Each is the interpreter of an environment with one version; ``--new-path SRC`` sets PYTHONPATH of
the new one. All values must be equal, with NaN equal to NaN, but those in ``TOLERANCES``. A case
that one version alone refuses counts by itself; what a version has no name for is not compared.
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
    parser.add_argument("--new-path", help="PYTHONPATH of the new version")
    given = parser.parse_args()
    if len(found := {libraries(python) for python in (given.old, given.new)}) > 1:
        print("Not the same libraries:", *found, sep="\n")
    asked = {
        kind: [given.case or 0, number if given.case is None else 1]
        for kind, number in counts(given.cases).items()
        if given.kind in (None, kind)
    }
    sides = [given.old, None], [given.new, given.new_path]
    running = [start(*side, given.seed, json.dumps(asked)) for side in sides]
    old, new = map(result, running)
    print(
        f"{'kind':18}{'cases':>7}{'differ':>8}{'only old':>10}{'only new':>10}  names not in both"
    )
    total, reports = np.zeros(4, int), []
    for kind, (first, number) in asked.items():
        row, absent = np.array([number, 0, 0, 0]), set()
        for case, (before, after) in enumerate(zip(old[kind], new[kind], strict=True), start=first):
            verdict, names, missing = compared(kind, before, after)
            absent |= missing
            row[verdict] += verdict > 0
            if verdict > 0 and (given.case is not None or row[verdict] == 1):
                reports.append(f"--kind {kind} --case {case}: {WORDS[verdict]}")
                reports += [shown(name, before, after) for name in names[: 99 if given.case else 4]]
        total += row
        print(f"{kind:18}{row[0]:7}{row[1]:8}{row[2]:10}{row[3]:10}  {', '.join(sorted(absent))}")
    print(f"{'all':18}{total[0]:7}{total[1]:8}{total[2]:10}{total[3]:10}")
    print("only old, only new: a case that the other version refuses")
    print("\n".join(reports))
    sys.exit(int(total[1] > 0))


WORDS = ["", "different values", "refused by the new version", "refused by the old version"]


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


def compared(
    kind: str, old: Mapping[str, Any], new: Mapping[str, Any]
) -> tuple[int, list[str], set[str]]:
    """Return which word describes a case, the names that differ, and those not in both."""
    if ("error" in old) != ("error" in new):
        return 1, ["error"], set()
    refused = [{name for name, value in found.items() if refusal(value)} for found in (old, new)]
    if refused[1] - refused[0]:
        return 2, sorted(refused[1] - refused[0]), set()
    if refused[0] - refused[1]:
        return 3, sorted(refused[0] - refused[1]), set()
    both = [name for name in old if name in new]
    different = [name for name in both if not same(old[name], new[name], tolerance(kind, name))]
    return int(bool(different)), different, set(old) ^ set(new)


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
