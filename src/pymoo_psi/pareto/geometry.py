"""The three geometric criteria of a compromise point, seen from the utopian line UN.

U is the componentwise minimum (ideal) and N the componentwise maximum (nadir) of a Pareto set.
With d = f − U and e the unit vector from U to N,

    μ1 = |d|            the distance to U,
    μ2 = |d − (d·e) e|  the distance to the line UN,
    μ3 = d·e            the distance from U of the projection onto UN,

so that μ1² = μ2² + μ3² (paper, Section 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["UtopianFrame"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class UtopianFrame:
    """The points U and N and the scale in which distances are measured.

    Attributes:
        ideal: ``(m,)`` the positive utopian point U.
        nadir: ``(m,)`` the negative utopian point N, nowhere below U.
        normalize: Measure every objective in units of N − U; an objective with N = U, which
            tells no design from another, then counts for nothing.

    Example:
        >>> frame = UtopianFrame(np.array([0.0, 0.0]), np.array([4.0, 4.0]), normalize=False)
        >>> frame.distances(np.array([[0.0, 4.0], [3.0, 3.0]])).round(3)
        array([[4.   , 2.828, 2.828],
               [4.243, 0.   , 4.243]])
    """

    ideal: Array
    nadir: Array
    normalize: bool

    @property
    def scale(self) -> Array:
        """``(m,)`` the length by which each objective is divided."""
        span = self.nadir - self.ideal
        if not self.normalize:
            return np.ones_like(span)
        return np.where(span > 0, span, np.inf)

    @property
    def direction(self) -> Array:
        """``(m,)`` the unit vector e from U to N; zero if N = U."""
        span = (self.nadir - self.ideal) / self.scale
        largest = float(span.max())
        if largest <= 0:
            return span
        return span / largest / float(np.linalg.norm(span / largest))

    def distances(self, F: Array) -> Array:
        """Return the ``(n, 3)`` criteria (μ1, μ2, μ3) of the ``(n, m)`` points ``F``."""
        with np.errstate(over="ignore", invalid="ignore"):  # far outside UN: an infinite distance
            d = (F - self.ideal) / self.scale
            # In units of the length of UN, so that no square over- or underflows.
            unit = float(np.abs((self.nadir - self.ideal) / self.scale).max()) or 1.0
            d = d / unit
            along = d @ self.direction
            across = d - along[:, None] * self.direction
            return np.column_stack([_row_norm(d), _row_norm(across), along]) * unit

    def rounding(self, F: Array) -> float:
        """Bound the rounding error that the criteria of ``F`` carry.

        ``F`` is taken to be right to a few units in its last place, and m terms are summed.
        """
        return float(np.hypot.reduce(self.roundings(F)))

    def roundings(self, F: Array) -> Array:
        """Bound the rounding error of each term of a distance; an ``(m,)`` array."""
        size = np.maximum(np.abs(F).max(axis=0), np.maximum(abs(self.ideal), abs(self.nadir)))
        bounds: Array = 8 * np.finfo(np.float64).eps * size / self.scale
        return bounds


def _row_norm(rows: Array) -> Array:
    norm: Array = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return norm
