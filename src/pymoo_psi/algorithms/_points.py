"""The test points of a run: which they are, and where they lie."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.algorithms._sampling import LPTauSampling, UniformSampling
from pymoo_psi.sequences import lp_tau
from pymoo_psi.sequences._lp_tau import lp_tau_at
from pymoo_psi.storage._share import Share


@dataclass(frozen=True, eq=False)
class Cut:
    """Some of the points of a run, small enough to be sent to where they are tested.

    Attributes:
        share: Whose points they are.
        rounds: In which rounds it gets them.
        n_dim: In how many dimensions they lie.
        given: ``(n, n_dim)`` where, for points that are not of LPτ.
    """

    share: Share
    rounds: range | NDArray[np.int64]
    n_dim: int
    given: NDArray[np.float64] | None = None

    @property
    def numbers(self) -> NDArray[np.int64]:
        """``(n,)`` their numbers."""
        rounds = self.rounds
        return self.share.dealt(
            np.arange(rounds.start, rounds.stop) if isinstance(rounds, range) else rounds
        )

    @property
    def units(self) -> NDArray[np.float64]:
        """``(n, n_dim)`` points of the unit cube."""
        if self.given is not None:
            return self.given
        if self.share.of == 1 and isinstance(self.rounds, range):
            return lp_tau(len(self.rounds), self.n_dim, first=self.rounds.start + 1)
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
        self.first, self.last, self.share = first, first + n_points - 1, share
        if self.last >= 2**62:  # NumPy numbers them in int64, and a round beyond the last is asked
            raise invalid("first + n_points - 1", "below 2**62", self.last)
        self.n_dim = n_dim
        self._rounds = share.rounds(first, self.last)
        if len(self._rounds) == 0:
            remedy = "test as many points as there are shares, or more"
            rule = f"one that gets a point of points {first} to {self.last}"
            raise invalid("share", rule, Received(share), remedy)
        self._units = None
        if not isinstance(sampling, LPTauSampling):  # any part needs all before it, or all
            state = np.random.default_rng(seed)
            self._units = sampling.unit_points(n_points, n_dim, first=first, random_state=state)
        else:
            lp_tau(1, n_dim, first=self.last)  # too many dimensions or points are refused here

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self._rounds)

    def cut(self, rows: range | NDArray[np.intp]) -> Cut:
        """Return the points in some places, from 0."""
        start = self._rounds.start
        if isinstance(rows, range):
            cut = Cut(self.share, range(start + rows.start, start + rows.stop), self.n_dim)
        else:
            cut = Cut(self.share, start + rows, self.n_dim)
        if self._units is None:
            return cut
        return replace(cut, given=self._units[cut.numbers - self.first])
