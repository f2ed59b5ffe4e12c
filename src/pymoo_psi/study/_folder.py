"""A folder of studies, the shares of one investigation, read as one study."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.errors import StudyAccessError, StudyMismatchError
from pymoo_psi.study._share import Share
from pymoo_psi.study._study import Columns, Study, differences, span, studies_in

_SHOWN = 6  # ranges of missing points, and shares that lack some, in a message


def read_folder(path: str | PathLike[str]) -> tuple[dict[str, Any], Columns, str]:
    """Return the tests of all studies in a folder as those of one; see :func:`read_study`.

    Returns:
        The head, the columns, and which test points are missing; empty if none are.

    Raises:
        StudyMismatchError: Two of them belong to different problems, or have other results for
            the same test point.
        StudyError: One is damaged, or there is none; the message names the file.
    """
    folder = os.path.realpath(path)
    files = studies_in(folder)
    if not files:
        raise StudyAccessError(f"folder {folder} holds no study; check the name")
    facts, blocks = zip(*(Study(file).contents() for file in files), strict=True)
    head = dict(facts[0]["head"])
    for file, other in zip(files, facts, strict=True):
        if differing := differences(other["head"], head, "in the first", "in the second"):
            raise StudyMismatchError(
                f"studies {file} and {files[0]} belong to different problems: {differing}; "
                "keep one folder for each problem"
            )
    # A share has the outputs that its tests have brought so far, NaN where they did not.
    outputs = tuple(dict.fromkeys(name for f in facts for name in f["head"].get("outputs", ())))
    head |= {"outputs": list(outputs)} if outputs else {}
    columns = {}
    for name in {**dict.fromkeys(outputs), **blocks[0]}:
        parts = [b.get(name, np.full(len(b["test_point"]), np.nan)) for b in blocks]
        columns[name] = np.concatenate(parts)
    source = np.repeat(np.arange(len(files)), [len(block["test_point"]) for block in blocks])
    # Stable, so that of a test that several files hold the first one is taken.
    order = np.argsort(columns["test_point"], kind="stable")
    columns = {name: column[order] for name, column in columns.items()}
    numbers = columns["test_point"]
    again = np.flatnonzero(numbers[1:] == numbers[:-1]) + 1
    for column in columns.values():
        one, other = column[again], column[again - 1]
        # NaN is the value that differs from itself.
        for i in again[(one != other) & ((one == one) | (other == other))]:
            pair = [files[source[order[j]]] for j in (i - 1, i)]
            raise StudyMismatchError(
                f"studies {' and '.join(pair)} have different results for test point {numbers[i]}; "
                "move the file that is wrong, or older, to another folder"
            )
    columns = {name: np.delete(column, again) for name, column in columns.items()}
    return head, columns, _missing(facts, columns["test_point"])


def _missing(studies: Sequence[Mapping[str, Any]], numbers: NDArray[np.int64]) -> str:
    """Say which test points of an investigation are not stored in any of its shares."""
    known = [facts for facts in studies if "share" in facts]
    if not known:
        return ""
    first, last = span(known)
    of = known[0]["share"][1]
    absent = np.setdiff1d(np.arange(first, last + 1), numbers, assume_unique=True)
    if len(absent) == 0:
        return ""
    lacking = []
    for part in range(1, of + 1):
        share = Share(part, of)
        own = share.numbers(np.array(share.rounds(first, last)))
        if n := int(np.isin(own, absent, assume_unique=True).sum()):
            lacking.append(f"{part} ({'all' if n == len(own) else n} of {len(own)})")
    return (
        f"{len(absent)} of {last - first + 1} test points are missing: {_short(_ranges(absent))}; "
        f"of {of} shares these lack points: {_short(lacking)}"
    )


def _ranges(numbers: NDArray[np.int64]) -> list[str]:
    """Return increasing numbers as texts of ranges: "3", "7 to 12"."""
    starts = np.flatnonzero(np.diff(numbers, prepend=numbers[:1] - 2) > 1)
    ends = [*(starts[1:] - 1), len(numbers) - 1]
    pairs = zip(numbers[starts].tolist(), numbers[ends].tolist(), strict=True)
    return [f"{a}" if a == b else f"{a} to {b}" for a, b in pairs]


def _short(texts: list[str]) -> str:
    return ", ".join(texts[:_SHOWN] + ["…"] * (len(texts) > _SHOWN))
