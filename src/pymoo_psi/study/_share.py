"""Shares: the points of one investigation divided among machines, a file for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, integer, invalid, wrong_type

_GOLDEN = 2_654_435_769  # 2^32 divided by the golden ratio, rounded to an odd number


@dataclass(frozen=True)
class Share:
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
