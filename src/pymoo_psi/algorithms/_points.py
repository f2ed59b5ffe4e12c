"""The test points of a run: which they are, and where they lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.algorithms._sampling import LPTauSampling, UniformSampling
from pymoo_psi.sequences import lp_tau, lp_tau_at
from pymoo_psi.study import Share


@dataclass(frozen=True, eq=False)
class Cut:
    """Some of the points of a run, small enough to be sent to where they are tested.

    Attributes:
        numbers: ``(n,)`` their numbers.
        n_dim: In how many dimensions they lie.
        given: ``(n, n_dim)`` where, for points that are not of LPτ.
    """

    numbers: NDArray[np.int64]
    n_dim: int
    given: NDArray[np.float64] | None

    @property
    def units(self) -> NDArray[np.float64]:
        """``(n, n_dim)`` points of the unit cube."""
        if self.given is not None:
            return self.given
        if (np.diff(self.numbers) == 1).all():  # all at once is faster
            return lp_tau(len(self.numbers), self.n_dim, first=int(self.numbers[0]))
        return lp_tau_at(self.numbers, self.n_dim)


class Points:
    """The numbers of the test points of a run, or of its share of one, rising.

    Nothing of the size of the run is held for LPτ, whose points are made when they are asked for,
    in a worker process too.

    Args:
        first: Number of the first point of the run.
        n_points: How many points the run has.
        share: Which of them are meant.
        sampling: Where they lie.
        n_dim: In how many dimensions.
        seed: Of a randomised sampling.
    """

    def __init__(
        self,
        first: int,
        n_points: int,
        share: Share,
        sampling: UniformSampling,
        n_dim: int,
        seed: int | None,
    ) -> None:
        last = first + n_points - 1
        if last >= 2**62:  # NumPy numbers them in int64, and a round beyond the last is asked
            raise invalid("first + n_points - 1", "below 2**62", last)
        self._first, self._share, self._n_dim = first, share, n_dim
        self._rounds = share.rounds(first, last)
        if len(self._rounds) == 0:
            remedy = "test as many points as there are shares, or more"
            rule = f"one that gets a point of points {first} to {last}"
            raise invalid("share", rule, Received(share), remedy)
        self._units = None
        if not isinstance(sampling, LPTauSampling):  # any part needs all before it, or all
            state = np.random.default_rng(seed)
            self._units = sampling.unit_points(n_points, n_dim, first=first, random_state=state)
        else:
            lp_tau(1, n_dim, first=last)  # too many dimensions or points are refused here

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self._rounds)

    def cut(self, rows: range | NDArray[np.intp]) -> Cut:
        """Return the points in some places, from 0; one at least."""
        places = np.arange(rows.start, rows.stop) if isinstance(rows, range) else rows
        numbers = self._share.numbers(self._rounds.start + places)
        given = None if self._units is None else self._units[numbers - self._first]
        return Cut(numbers, self._n_dim, given)
