"""Shares: the points of one investigation divided among machines, and their files as one study."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, integer, invalid, wrong_type
from pymoo_psi.errors import StudyAccessError, StudyMismatchError
from pymoo_psi.study._study import Columns, Study, differences, span, studies_in

_GOLDEN = 2_654_435_769  # 2^32 divided by the golden ratio, rounded to an odd number


class Share(NamedTuple):
    """The k-th of n parts of the test points.

    The points are assigned in rounds of n consecutive numbers, of which each share gets one. So the
    first results of all shares together are the beginning of the sequence, which is uniform, a
    longer run extends every share, and whose a point is does not depend on how many there are.

    The k-th share does not get the k-th point of every round: the low binary digits of a number
    are the leading ones of a point of LPτ, so that every 64th point lies in one strip, a 64th of
    the first variable, which would be the hole that a lost share leaves. Each round begins with
    another share instead, by multiples of the golden ratio (Fibonacci hashing, Knuth, The Art of
    Computer Programming 3, section 6.4), and every share alone is spread over the bounds, too.

    Attributes:
        part: Which part, from 1 to ``of``.
        of: How many parts there are.
    """

    part: int
    of: int

    @classmethod
    def checked(cls, value: object) -> Share:
        """Return the share that a user gives as ``(k, n)``.

        Raises:
            ArgumentValueError: There is no k-th of n parts.
            ArgumentTypeError: It is no pair of integers.
        """
        if not isinstance(value, (tuple, list)) or len(value) != 2:
            raise wrong_type("share", "a pair (k, n), the k-th of n parts", value)
        of = integer("n of share=(k, n)", value[1], minimum=1)
        part = integer("k of share=(k, n)", value[0], minimum=1)
        if part > of:
            raise invalid("share", "(k, n) with k from 1 to n", Received(f"({part}, {of})"))
        return cls(part, of)

    def __str__(self) -> str:
        """Return "3 of 64"."""
        return f"{self.part} of {self.of}"

    @property
    def file(self) -> str:
        """Name of its file in a folder of studies, sorted by part."""
        return f"share-{self.part:0{len(str(self.of))}}-of-{self.of}.db"

    def rounds(self, first: int, last: int) -> range:
        """Return the rounds, from 0, in which it gets a point between ``first`` and ``last``."""
        start, stop = (first - 1) // self.of, (last - 1) // self.of + 1
        ends = self.numbers(np.array([start, stop - 1]))
        return range(start + int(ends[0] < first), stop - int(ends[1] > last))

    def numbers(self, rounds: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the test points that it gets in rounds."""
        # Only the lowest 32 bits of the product count, so that its overflow does no harm.
        moved = (rounds * _GOLDEN % 2**32) * self.of // 2**32
        return rounds * self.of + (self.part - 1 + moved) % self.of + 1


ALL = Share(1, 1)  # all points


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
    (first, last), of = span(known), known[0]["share"][1]
    absent = np.setdiff1d(np.arange(first, last + 1), numbers, assume_unique=True)
    if len(absent) == 0:
        return ""
    own = {k: Share(k, of) for k in range(1, of + 1)}
    points = {k: share.numbers(np.array(share.rounds(first, last))) for k, share in own.items()}
    lacking = [str(k) for k, has in points.items() if np.isin(has, absent).any()]
    return (
        f"{len(absent)} of {last - first + 1} test points are missing, the first is {absent[0]}; "
        f"of {of} shares these lack points: {', '.join(lacking)}"
    )
