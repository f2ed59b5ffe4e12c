"""The test points of a run: which they are, and where they lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._sampling import LPTauSampling, UniformSampling
from pymoo_psi.sequences import lp_tau, lp_tau_at


@dataclass(frozen=True, eq=False)
class Points:
    """Some points of a run, small enough to be sent to where they are tested.

    Attributes:
        numbers: ``(n,)`` their numbers, increasing.
        n_dim: In how many dimensions they lie.
        given: ``(n, n_dim)`` where, for points that are not of LPτ.
        rounds: ``(n,)`` the round in which each was proposed, 0 if it is of a sequence; ``None``
            where nothing is proposed.
    """

    numbers: NDArray[np.int64]
    n_dim: int
    given: NDArray[np.float64] | None = None
    rounds: NDArray[np.float64] | None = None

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self.numbers)

    @property
    def units(self) -> NDArray[np.float64]:
        """``(n, n_dim)`` points of the unit cube."""
        if self.given is not None:
            return self.given
        if len(self) and (np.diff(self.numbers) == 1).all():  # all at once is faster
            return lp_tau(len(self.numbers), self.n_dim, first=int(self.numbers[0]))
        return lp_tau_at(self.numbers, self.n_dim)

    def at(self, rows: NDArray[np.intp]) -> Points:
        """Return the points in some rows, from 0."""
        given, rounds = (None if a is None else a[rows] for a in (self.given, self.rounds))
        return Points(self.numbers[rows], self.n_dim, given, rounds)


class PointSequence:
    """The points of a sequence of which a run, or its share of one, consists.

    Nothing of the size of the run is held for LPτ, whose points are made when they are asked for,
    in a worker process too.

    Args:
        options: The options of the run.
        n_points: How many points the run has, those of other shares too.
        sampling: Where they lie.
        n_dim: In how many dimensions.
    """

    def __init__(
        self, options: RunOptions, n_points: int, sampling: UniformSampling, n_dim: int
    ) -> None:
        self._first, self._n_dim, self._share = options.first, n_dim, options.part
        last = options.first + n_points - 1
        self._units = None
        if not isinstance(sampling, LPTauSampling):  # any part needs all before it, or all
            state = np.random.default_rng(options.seed)
            self._units = sampling.unit_points(
                n_points, n_dim, first=options.first, random_state=state
            )
        else:
            lp_tau(1, n_dim, first=last)  # too many dimensions or points are refused here
        self._rounds = self._share.rounds(options.first, last)
        if len(self._rounds) == 0:
            rule = f"one that gets a point of points {options.first} to {last}"
            remedy = "test as many points as there are shares, or more"
            raise invalid("share", rule, Received(self._share), remedy)

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self._rounds)

    def at(self, rows: NDArray[np.intp]) -> Points:
        """Return the points in some rows, from 0."""
        numbers = self._share.numbers(self._rounds.start + rows)
        given = None if self._units is None else self._units[numbers - self._first]
        return Points(numbers, self._n_dim, given)
