"""Shares: the points of one investigation divided among machines, and their studies as one."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pymoo_psi._validation import FilePath, Integers, Received, integer, invalid, wrong_type
from pymoo_psi.errors import ArgumentValueError, StudyAccessError, StudyMismatchError
from pymoo_psi.study._database import Columns, Facts, new_database
from pymoo_psi.study._study import SUFFIX, Study, require_fellow, studies_in

_GOLDEN = 2_654_435_769  # 2^32 divided by the golden ratio, rounded to an odd number


class Share(NamedTuple):
    """The k-th of n parts of the test points.

    The points are assigned in rounds of n consecutive numbers, of which each share gets one. So the
    first results of all shares together are the beginning of the sequence, which is uniform. A
    longer run extends every share, and the share of a point does not depend on their number.

    The k-th share does not get the k-th point of every round: the low binary digits of a number
    are the leading ones of a point of LPτ. Every 64th point lies in one strip, a 64th of the first
    variable, and a lost share would leave that strip empty. Instead each round begins with another
    share, by multiples of the golden ratio (Fibonacci hashing, Knuth, The Art of Computer
    Programming 3, section 6.4), so that every single share is spread over the bounds.

    Attributes:
        part: The part, from 1 to ``of``.
        of: The number of parts.
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
        part = integer("k and n of share=(k, n)", value[0], minimum=1)
        of = integer("k and n of share=(k, n)", value[1], minimum=1)
        if part > of:
            raise invalid("share", "(k, n) with k from 1 to n", Received(f"({part}, {of})"))
        return cls(part, of)

    def __str__(self) -> str:
        """Return "3 of 64"."""
        return f"{self.part} of {self.of}"

    @property
    def file(self) -> str:
        """The name of its file in a folder of studies; the names sort by part."""
        digits = len(str(self.of))
        return f"share-{self.part:0{digits}}-of-{self.of}{SUFFIX}"

    def numbers(self, first: int, last: int) -> Integers:
        """Return its test points from ``first`` to ``last``, increasing."""
        if self.of == 1:
            return np.arange(first, last + 1)
        rounds = np.arange((first - 1) // self.of, (last - 1) // self.of + 1)
        # Only the lowest 32 bits of the product count, so that its overflow does no harm.
        shifts = (rounds * _GOLDEN % 2**32) * self.of // 2**32
        places = (self.part - 1 + shifts) % self.of
        numbers = rounds * self.of + places + 1
        return numbers[(first <= numbers) & (numbers <= last)]


ALL = Share(1, 1)  # all points


def read_folder(path: FilePath) -> tuple[Facts, Columns, str]:
    """Return the tests of all studies in a folder as those of one; see :class:`Study`.

    Returns:
        The facts, the columns, and which test points are missing; empty if none are.

    Raises:
        StudyMismatchError: Two studies belong to different problems, or have different results for
            the same test point.
        StudyError: One of them is damaged, or there is none; the message names the file.
    """
    files = studies_in(Path(path).resolve())
    if not files:
        raise StudyAccessError(f"folder {os.fspath(path)} holds no study; check the name")
    contents = [Study(file).contents() for file in files]
    first = contents[0][0]
    n_shares = 1
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        joined = new_database(db, os.fspath(path), first)
        for file, (facts, columns) in zip(files, contents, strict=True):
            require_fellow(file, facts, first, f"in {files[0]}")
            if facts.share is not None:
                n_shares = facts.share[1]
            try:
                if len(columns["test"]):
                    joined.append(1, columns)
            except ArgumentValueError as error:
                raise StudyMismatchError(
                    f"study {file} and one before it in the folder have different results for test "
                    f"points; move the file that is wrong, or older, to another folder ({error})"
                ) from error
        columns = joined.tests()
    return first, columns, _missing(n_shares, columns["test"])


def _missing(n_shares: int, numbers: Integers) -> str:
    """Say how many test points each share lacks between the first and the last stored one."""
    if n_shares == 1 or len(numbers) == 0:
        return ""
    first = int(numbers[0])
    last = int(numbers[-1])
    counts = []
    for part in range(1, n_shares + 1):
        share = Share(part, n_shares)
        n_missing = len(np.setdiff1d(share.numbers(first, last), numbers))
        if n_missing:
            counts.append(f"{n_missing} of share {share}")
    if not counts:
        return ""
    return f"Missing between test points {first} and {last}: {', '.join(counts)}"
