"""How long a design takes, whether it is worth sending, and how many travel together."""

from __future__ import annotations

import math
import statistics
from collections import deque

# Seconds that a chunk should last: long beside a message, short beside a batch.
LONGEST_CHUNK = 0.1
SHORTEST_CHUNK = 0.005

_TYPICAL_OVERHEAD = 0.01  # seconds for a batch sent to workers that wait
_REMEMBERED = 5
_TRUSTED_AT_ONCE = 1.0  # a first design that takes so many seconds is not an import


class Cost:
    """The seconds a design takes: the median of the last measurements.

    The median, because a first evaluation often loads libraries and a busy machine stalls.

    Example:
        >>> cost = Cost()
        >>> for designs, seconds in [(1, 0.3), (10, 0.02), (10, 0.02)]:
        ...     cost.add(designs, seconds)
        >>> cost.seconds
        0.002
    """

    def __init__(self) -> None:
        self._samples: deque[float] = deque(maxlen=_REMEMBERED)

    def add(self, designs: int, seconds: float) -> None:
        """Add the measurement of a number of designs evaluated one after the other."""
        self._samples.append(max(seconds, 1e-9) / designs)

    @property
    def seconds(self) -> float:
        """Seconds a design; nan before the first measurement."""
        return statistics.median_low(self._samples) if self._samples else math.nan

    @property
    def known(self) -> bool:
        """Whether the measurements can be relied on."""
        return len(self._samples) >= 3 or self.seconds >= _TRUSTED_AT_ONCE


class Overhead:
    """The seconds that sending a batch takes beyond the evaluations: the least of the last ones.

    The least, because a busy machine only ever adds to it.
    """

    def __init__(self) -> None:
        self._samples: deque[float] = deque([_TYPICAL_OVERHEAD], maxlen=_REMEMBERED)

    def add(self, elapsed: float, busy: float, workers: int) -> None:
        """Add a batch that took ``elapsed`` seconds, its evaluations ``busy`` seconds in all."""
        self._samples.append(max(elapsed - busy / workers, 0.0))

    @property
    def seconds(self) -> float:
        """Seconds a batch."""
        return min(self._samples)


def worth_sending(designs: int, cost: float, workers: int, overhead: float) -> bool:
    """Return whether workers save at least twice what sending costs.

    Args:
        designs: How many designs there are.
        cost: Seconds a design.
        workers: How many workers there are.
        overhead: Seconds that sending takes.

    Example:
        >>> worth_sending(100, 1e-2, 2, 0.01), worth_sending(100, 1e-5, 2, 0.01)
        (True, False)
    """
    return designs * cost * (1 - 1 / workers) > 2 * overhead


def chunk_size(remaining: int, workers: int, cost: float) -> int:
    """Return how many of the remaining designs travel together next.

    A chunk lasts up to ``LONGEST_CHUNK`` seconds; towards the end chunks shrink, so that all
    workers finish together, but not below ``SHORTEST_CHUNK``.

    Args:
        remaining: Designs not yet sent, at least 1.
        workers: How many workers there are.
        cost: Seconds a design; nan while unknown, when one is sent at a time.

    Example:
        >>> chunk_size(1000, 2, 0.01), chunk_size(20, 2, 0.01), chunk_size(3, 2, 0.01)
        (10, 5, 1)
    """
    if math.isnan(cost):
        return 1
    most = max(1, round(LONGEST_CHUNK / cost))
    least = math.ceil(SHORTEST_CHUNK / cost)
    fair = max(1, -(-remaining // (2 * workers)))
    return min(remaining, most, max(least, fair))
