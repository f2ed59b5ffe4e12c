"""How long a design takes, whether it is worth sending, and how many travel together."""

from __future__ import annotations

import math
import statistics
from collections import deque

# Seconds that a chunk should last. The longest is short beside a batch, so that all workers end
# together; the shortest is long beside the message that brings it, some 0.1 ms.
LONGEST_CHUNK = 0.1
SHORTEST_CHUNK = 0.005

_REMEMBERED = 5  # measurements: enough for a median, few enough to follow a model that changes
_TRUSTED = 3  # measurements whose median survives one slow import
_TRUSTED_AT_ONCE = 1.0  # a first design that takes so many seconds is not an import alone


class Cost:
    """The seconds a design takes: the median of the last measurements.

    The median, because a first evaluation often loads libraries and a busy machine stalls.
    """

    def __init__(self) -> None:
        self._samples: deque[float] = deque(maxlen=_REMEMBERED)

    def add(self, designs: int, seconds: float) -> None:
        """Add the measurement of a number of designs evaluated one after the other."""
        self._samples.append(max(seconds, 1e-9) / designs)  # 0 where a clock is too coarse

    @property
    def seconds(self) -> float:
        """Seconds a design; nan before the first measurement."""
        return statistics.median_low(self._samples) if self._samples else math.nan

    @property
    def known(self) -> bool:
        """Whether the measurements can be relied on."""
        return len(self._samples) >= _TRUSTED or self.seconds >= _TRUSTED_AT_ONCE

    def worth_sending(self, designs: int, workers: int, overhead: float) -> bool:
        """Return whether workers surely save at least twice what sending costs.

        Twice, because both are estimates, and a batch in this process cannot go wrong.

        Args:
            designs: How many designs there are.
            workers: How many workers there are.
            overhead: Seconds that sending takes.
        """
        return self.known and designs * self.seconds * (1 - 1 / workers) > 2 * overhead


def chunk_size(remaining: int, workers: int, cost: float) -> int:
    """Return how many of the remaining designs travel together next.

    A chunk lasts up to ``LONGEST_CHUNK`` seconds; towards the end chunks shrink, so that all
    workers finish together, but not below ``SHORTEST_CHUNK``.

    Args:
        remaining: Designs not yet sent, at least 1.
        workers: How many workers there are.
        cost: Seconds a design; nan while unknown, when one is sent at a time.
    """
    if math.isnan(cost):
        return 1
    most = max(1, round(LONGEST_CHUNK / cost))
    least = math.ceil(SHORTEST_CHUNK / cost)
    fair = max(1, -(-remaining // (2 * workers)))
    return min(remaining, most, max(least, fair))
