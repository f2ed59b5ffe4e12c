"""Designs that meet linear equalities, such as those of a mixture, filled evenly by points.

The map from the unit cube is the inverse of Rosenblatt's transformation (Ann. Math. Stat. 23, 1952,
470): each variable in turn has its distribution given those before it. This depends on the
distribution of the sum of the remaining variables, uniform and independent of each other.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from pymoo_psi._validation import AnyArray, Array, Mask, Received, invalid

Rows = tuple[tuple[float, ...], ...]

_INTERVALS = 1 << 14  # pieces of a distribution function, all linear: errors are about 1e-8
_ROUNDING = 1e-12  # share of the ranges of variables
_TINY = 1e-300
_TRIED = 200  # points to find one that meets all equalities
_LEAST = 0.1  # least share of points that meet them, so that these are enough


class _Equality:
    """Variables from 0 to 1 and an equality that they meet.

    Args:
        columns: The variables; the last one follows from the others and has the widest range.
        coefficients: ``(k,)`` their coefficients.
        total: What they add up to.
    """

    def __init__(self, columns: AnyArray, coefficients: Array, total: float) -> None:
        widths = np.abs(coefficients)
        is_reversed = coefficients < 0  # whether a variable counts from its upper bound
        total += widths[is_reversed].sum()
        if 2 * total > widths.sum():  # the distances from the other bounds are smaller
            is_reversed = ~is_reversed
            total = widths.sum() - total
        self._total = total
        self._sums = np.linspace(0, total, _INTERVALS + 1)
        # For each variable but the last: its column, its width, whether it is reversed, the widths
        # of those after it, and the distribution function of their sum at the sums.
        self._variables: list[Any] = []
        shares = np.minimum(self._sums / widths[-1], 1)
        for k in range(len(columns) - 2, -1, -1):
            others = widths[k + 1 :].sum()
            self._variables.insert(0, (columns[k], widths[k], is_reversed[k], others, shares))
            areas = np.cumsum(shares) - shares / 2
            shares = areas - np.interp(self._sums - widths[k], self._sums, areas)
            shares /= shares[-1] or 1.0  # 0 if each variable has one value

    def fill(self, points: Array) -> None:
        """Replace ``(n, n_var)`` points of the unit cube by positions that meet the equality.

        The columns of the equality change but for the last one.
        """
        rest = np.full(len(points), self._total)
        for column, width, is_reversed, others, shares in self._variables:
            low, high, least, most = self._given(rest, width, others, shares)
            share = most - points[:, column] * (most - least)
            values = np.clip(rest - np.interp(share, shares, self._sums), low, high)
            points[:, column] = np.abs(is_reversed - values / width)
            rest = rest - values

    def invert(self, positions: Array) -> None:
        """Replace positions by the points that :meth:`fill` replaces by them."""
        rest = np.full(len(positions), self._total)
        for column, width, is_reversed, others, shares in self._variables:
            _, _, least, most = self._given(rest, width, others, shares)
            values = np.abs(is_reversed - positions[:, column]) * width
            share = most - np.interp(rest - values, self._sums, shares)
            positions[:, column] = share / np.maximum(most - least, _TINY)
            rest = rest - values

    def _given(self, rest: Array, width: float, others: float, shares: Array) -> Any:
        """Return the ends of a variable given the rest of the total, and the shares there."""
        low = np.maximum(rest - others, 0)
        high = np.maximum(np.minimum(width, rest), low)
        most = np.interp(rest - low, self._sums, shares)
        least = np.interp(rest - high, self._sums, shares)
        return low, high, least, most


class Polytope:
    """The designs within bounds that meet linear equalities, and the map from the unit cube.

    Each equality makes one variable dependent on the others. Of equalities that share variables,
    one is filled exactly; a point whose design misses the bounds of another dependent variable is
    replaced by a random one, for which the point is the seed. So designs are evenly distributed,
    and that of a point does not depend on other points.

    Args:
        rows: For each equality the coefficients of all variables, and the constant that they add up
            to.
        lower: ``(n_var,)`` lower bounds.
        upper: ``(n_var,)`` upper bounds.

    Attributes:
        dependent: The dependent variables.

    Raises:
        ArgumentValueError: Few designs within the bounds meet the equalities, or none.
    """

    def __init__(self, rows: Rows, lower: tuple[float, ...], upper: tuple[float, ...]) -> None:
        coefficients = np.array(rows)[:, :-1]
        totals = np.array(rows)[:, -1:] - coefficients @ np.array(lower)[:, None]
        equations = np.hstack([coefficients * np.subtract(upper, lower), totals])
        self._rows, self.dependent = _eliminated(equations)
        is_consistent = len(self._rows) == len(self.dependent)
        share = 0.0
        if is_consistent:
            self._filled = self._equalities()
            points = np.random.default_rng(0).random((_TRIED, len(lower)))
            share = self._are_met(self._positions(points)).mean()
        if share < _LEAST:
            raise invalid(
                "requirements",
                f"equalities that {_LEAST:.0%} of points or more meet within the bounds",
                Received(f"{share:.1%}"),
                "correct them, widen the bounds, or replace an equality by two inequalities",
            )

    def _equalities(self) -> list[_Equality]:
        """Return what is filled exactly: of equalities that share variables the strictest."""
        equalities = []
        sizes = np.abs(self._rows[:, :-1])
        is_taken = np.full(sizes.shape[1], False)
        for k in np.argsort(-sizes.sum(axis=1), kind="stable"):
            columns = np.flatnonzero(sizes[k] > _ROUNDING)
            columns = columns[columns != self.dependent[k]]
            if not is_taken[columns].any():
                is_taken[columns] = True
                columns = np.append(columns, self.dependent[k])
                row = self._rows[k]
                equalities.append(_Equality(columns, row[columns], row[-1]))
        return equalities

    def positions(self, points: Array) -> Array:
        """Return ``(n, n_var)`` places of designs between the bounds, from 0 to 1.

        Args:
            points: ``(n, n_var)`` points of the unit cube, of any value for dependent variables.
        """
        positions = self._positions(points)
        for i in np.flatnonzero(~self._are_met(positions)):
            random = np.random.default_rng(points[i].view(np.uint64))
            tried = self._positions(random.random((_TRIED, points.shape[1])))
            positions[i] = tried[self._are_met(tried).argmax()]
        return positions

    def points(self, positions: Array) -> Array:
        """Return ``(n, n_var)`` points of places between the bounds, their inverse."""
        points = positions.copy()
        for equality in self._filled:
            equality.invert(points)
        return np.clip(points, 0, 1)

    def _positions(self, points: Array) -> Array:
        """Return positions, of which those of dependent variables may be outside of [0, 1]."""
        positions = points.copy()
        positions[:, self.dependent] = 0
        for equality in self._filled:
            equality.fill(positions)
        # not a matrix product, whose last digits depend on how many points there are
        sums = (positions[:, None] * self._rows[:, :-1]).sum(axis=2)
        positions[:, self.dependent] = self._rows[:, -1] - sums
        return positions

    def _are_met(self, positions: Array) -> Mask:
        """Return ``(n,)`` whether all dependent variables lie within their bounds."""
        distances = np.abs(positions[:, self.dependent] - 0.5)
        return np.asarray((distances <= 0.5 + _ROUNDING).all(axis=1))


def _eliminated(equations: Array) -> tuple[Array, list[int]]:
    """Return equations solved for one variable each, by Gauss-Jordan elimination.

    Args:
        equations: ``(k, n_var + 1)`` the coefficients of each, and the constant.

    Returns:
        The equations that differ from those before them, and the variables of these. An equation
        that contradicts those before it has none.
    """
    rows = np.zeros((0, equations.shape[1]))
    dependent: list[int] = []
    for equation in equations:
        row = equation - equation[dependent] @ rows
        pivot = int(np.abs(row[:-1]).argmax())
        rounding = _ROUNDING * np.abs(equation).max()
        if np.abs(row[pivot]) > rounding:
            row /= row[pivot]
            rows = np.vstack([rows - np.outer(rows[:, pivot], row), row])
            dependent.append(pivot)
        elif np.abs(row[-1]) > rounding:
            return np.vstack([rows, row]), dependent
    return rows, dependent


polytope = lru_cache(maxsize=64)(Polytope)
