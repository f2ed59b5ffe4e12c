"""Methods of multi-criteria decision-making from elsewhere as selectors.

The methods of pymcdm (extra ``mcdm``) score alternatives, ``method(matrix, weights, types)``, and
say by ``method.rank(scores)`` which score is best. Nothing here imports pymcdm: any object with
these two calls will do.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.core.indicator import Indicator

from pymoo_psi._validation import Received, invalid, wrong_type
from pymoo_psi.pareto import EfficiencyRanking, front_of, unit_lengths
from pymoo_psi.selection._selectors import (
    RankingSelector,
    checked_weights,
    objectives_of,
    weights_of,
)

Array = NDArray[np.float64]

_RADIUS = 0.125  # of neighbours, pymoo's own
_BLOCK, _CANDIDATES = 64, 2048  # points whose differences, 1 MB an array, stay in the cache


class McdmMethod(Indicator):
    """A method of pymcdm, such as TOPSIS or VIKOR, as a selector with pymoo's ``.do(F)``.

    ``.do(F)`` returns an index array of the rows the method ranks first: usually one, all of
    them if they tie. Objectives are handed over as costs. A constant objective, which tells no
    design from another and by which several methods would divide, is left out.

    Args:
        method: An instance, such as ``pymcdm.methods.TOPSIS()``.
        weights: ``(m,)`` weights >= 0, not all 0; equal unless given. Only ratios matter.

    Raises:
        ArgumentTypeError: ``method`` cannot be called so; a class was given for an instance.
        ArgumentValueError: A weight is negative, or all are 0; by ``.do``: their number is not
            that of the objectives, or the method finds no scores for ``F``.

    Example:
        >>> import numpy as np
        >>> class WeightedSum:
        ...     def __call__(self, matrix, weights, types):
        ...         return matrix @ weights
        ...     def rank(self, scores):
        ...         return 1 + np.searchsorted(np.sort(scores), scores)
        >>> F = np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]])
        >>> McdmMethod(WeightedSum()).do(F)
        array([1])
        >>> McdmMethod(WeightedSum(), weights=[1, 9]).do(F)
        array([2])
    """

    def __init__(self, method: Any, *, weights: ArrayLike | None = None) -> None:
        super().__init__()
        if isinstance(method, type) or not callable(method) or not hasattr(method, "rank"):
            rule = "a method of pymcdm such as pymcdm.methods.TOPSIS()"
            raise wrong_type("method", rule, method)
        self.method = method
        self.weights = None if weights is None else checked_weights(weights)

    def do(self, F: Any, *, maximize: Collection[Any] = ()) -> NDArray[np.intp]:
        """Return the indices of the rows of ``F`` that the method ranks first.

        Args:
            F: ``(n, m)`` objective values, an array or a data frame; one row may be ``(m,)``.
            maximize: The objectives to be maximised: column indices or, of a data frame, names.

        Example:
            >>> from pymcdm.methods import TOPSIS
            >>> McdmMethod(TOPSIS()).do(np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]))
            array([1])
        """
        F = objectives_of(F, maximize).minimized
        weights = weights_of(F.shape[1], self.weights)
        # A weight of 0 goes too: methods with logarithms or powers of weights have no use for it.
        counts = np.isfinite(unit_lengths(F.min(axis=0), F.max(axis=0))) & (weights > 0)
        if not counts.any():  # nothing tells one design from another
            return np.arange(len(F))
        ranks = self._ranks(F[:, counts], weights[counts] / weights[counts].sum())
        return np.flatnonzero(ranks == ranks.min())

    def _ranks(self, F: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        name = type(self.method).__name__
        try:
            with np.errstate(all="ignore"):  # what comes of it is told by the scores
                # pymcdm's types: -1 is a cost.
                scores = np.asarray(self.method(F, weights, -np.ones(F.shape[1], dtype=int)))
            usable = scores.shape == (len(F),) and bool(np.isfinite(scores).all())
        except ValueError as error:
            raise invalid("F", f"fit for {name}", Received("an error"), str(error)) from error
        if not usable:
            raise invalid("F", f"fit for {name}", Received("no finite scores"))
        return np.asarray(self.method.rank(scores), dtype=np.float64)


class HighTradeoff(RankingSelector):
    """What pymoo's ``HighTradeoffPoints`` chooses, in units of the ranges and of any set.

    A design stays if leaving it for any neighbour costs much more than it gains: more by two
    standard deviations than for the other designs, or the one for which it costs most if that is
    more than one above the mean (Rachmawati and Srinivasan 2009). Neighbours are the designs
    within an eighth of the ranges, with fewer than 2 m of them the nearest 2 m. Such a design is a
    knee in its surroundings, where :class:`Knee` finds the knee of the whole set.

    ``.do(F)`` returns an index array; no index if no design stands out. All pairs of neighbours
    count: 10 000 designs take about a second, ten times as many a hundred times as long.

    Args:
        normalize: Measure each objective in units of its range, which pymoo's own selector leaves
            to its caller, though its radius of 0.125 takes for granted.

    Example:
        >>> import numpy as np
        >>> f1 = np.linspace(0, 1, 21)
        >>> F = np.column_stack([f1, np.where(f1 < 0.5, 1 - 1.8 * f1, 0.2 - 0.2 * f1)])
        >>> HighTradeoff().do(F)
        array([10])
    """

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        front, values = front_of(ranking)
        points = ranking.frame.scaled(values)
        # Of equal designs one: pymoo divides their differences, 0 by 0. Nor can it tell which of
        # two designs stands out.
        distinct, which = np.unique(points, axis=0, return_inverse=True)
        if len(distinct) < 3:
            return front[:0]
        mu = _least_tradeoffs(distinct)
        mean, deviation = mu.mean(), mu.std()
        found = np.flatnonzero((mu - mean >= 2 * deviation) & (deviation > 0))
        if not len(found) and mu.max() - mean > deviation > 0:
            found = np.array([mu.argmax()])
        return front[np.isin(which.ravel(), found)]


def _least_tradeoffs(points: Array) -> Array:
    """``(n,)`` what leaving each of ``(n, m)`` points for a neighbour costs at least for its gain.

    Losses over gains, summed over the objectives; the neighbours are those within ``_RADIUS``, or,
    if that are fewer than 2 m with the point itself, the nearest 2 m. The points are distinct, and
    none dominates another, so that each gain is above 0.
    """
    from scipy.spatial import KDTree  # a fifth of a second, at every start of a command

    n, m = points.shape
    tree = KDTree(points)
    mu, count = np.full(n, np.inf), np.zeros(n, dtype=np.intp)
    # Points that are next to each other in the tree have most of their neighbours in common: a
    # block of them against all candidates needs no list of pairs, which would take the most time.
    for start in range(0, n, _BLOCK):
        rows = tree.indices[start : start + _BLOCK]
        own = points[rows]
        reached = (points >= own.min(axis=0) - _RADIUS) & (points <= own.max(axis=0) + _RADIUS)
        near = points[reached.all(axis=1)]
        for first in range(0, len(near), _CANDIDATES):
            others = near[first : first + _CANDIDATES]
            loss, gain, square = np.zeros((3, len(rows), len(others)))
            for j in range(m):
                step = others[:, j] - own[:, j, None]
                loss += np.maximum(step, 0)
                gain -= np.minimum(step, 0)
                square += step**2
            inside = square <= _RADIUS**2
            count[rows] += np.count_nonzero(inside, axis=1)
            ratio = np.full(loss.shape, np.inf)
            np.divide(loss, gain, out=ratio, where=inside & (gain > 0))
            mu[rows] = np.minimum(mu[rows], ratio.min(axis=1))
    least = min(2 * m, n - 1)
    few = np.flatnonzero(count < least)
    if len(few):
        step = points[tree.query(points[few], k=least + 1)[1][:, 1:]] - points[few, None]
        mu[few] = (np.maximum(step, 0).sum(axis=2) / np.maximum(-step, 0).sum(axis=2)).min(axis=1)
    return mu
