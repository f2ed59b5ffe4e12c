"""Selectors by pymoo's convention: ``.do(F)`` returns the indices of the chosen rows.

Every selector here returns an index array, as several designs may be equally good, or none be of
the wanted rank; it chooses among the Pareto-optimal rows, and takes ``maximize=`` for objectives to
be maximised, as :func:`pymoo_psi.rank_of_efficiency` does. pymoo's ``PseudoWeights`` returns one
index, its ``HighTradeoffPoints`` an array or None.
:func:`pymoo_psi.selection.compare_selectors` takes them all.
"""

from __future__ import annotations

import numbers
import warnings
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.core.indicator import Indicator

from pymoo_psi._validation import Received, boolean, finite_array, invalid, mapping
from pymoo_psi.pareto import (
    LAST_PLACES,
    EfficiencyRanking,
    front_of,
    levels,
    rank_of_efficiency,
    ranking_from,
    unit_lengths,
)

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

# Bulges below this share of the ranges are none. A plane through extremes is right to about
# 1e-16 / 1e-6 of them, see below, and a billionth decides nothing.
_STRAIGHT = 1e-9
# Extremes whose directions from U differ by less than this span no plane: the set is degenerate.
_FLAT = 1e-6
# The worst term, and among rows that share it the sum of terms: the augmented distance
# max + rho * sum in the limit of a small rho.
_AUGMENTED = (partial(np.max, axis=1), partial(np.sum, axis=1))


class RankingSelector(Indicator):
    """A selection among the Pareto-optimal designs, all of which have been ranked.

    It derives from pymoo's ``Indicator``, the base of pymoo's own decision makers, because
    importing ``pymoo.core.decision_making`` pulls a module that SciPy has deprecated.
    """

    def __init__(self, *, normalize: bool = True) -> None:
        super().__init__()
        self.normalize = boolean("normalize", normalize)

    def do(self, F: Any, *, maximize: Collection[Any] = ()) -> Rows:
        """Return the indices of the chosen rows of ``F``.

        Args:
            F: ``(n, m)`` objective values, as for :func:`pymoo_psi.rank_of_efficiency`.
            maximize: The objectives to be maximised: column indices or, of a data frame, names.

        Example:
            >>> SalukvadzeOptimum().do(np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]))
            array([1])
            >>> SalukvadzeOptimum().do([[0.0, 0.0], [0.3, 0.6], [1.0, 1.0]], maximize=[1])
            array([1])
        """
        return self._choose(rank_of_efficiency(F, normalize=self.normalize, maximize=maximize))

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        raise NotImplementedError


class SalukvadzeOptimum(RankingSelector):
    """The designs nearest to the utopian point U; usually there is one.

    Args:
        normalize: Measure each objective in units of its range over the Pareto set; ``False``
            is the paper's plain Euclidean distance.

    Example:
        >>> import numpy as np
        >>> SalukvadzeOptimum().do(np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]))
        array([1])
    """

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        return ranking.salukvadze


class EfficientSubset(RankingSelector):
    """The designs M_Re of exactly one rank of efficiency; the set may be empty.

    For "this rank or better" take ``rank_of_efficiency(F).rank >= rank``.

    Args:
        rank: The rank of efficiency, 3 to 6; no design has rank 1 or 2.
        normalize: As for :class:`SalukvadzeOptimum`.

    Raises:
        ArgumentValueError: There is no such rank.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0]])
        >>> EfficientSubset(6).do(F), EfficientSubset(5).do(F), EfficientSubset(4).do(F)
        (array([2]), array([1]), array([3]))
    """

    def __init__(self, rank: int, *, normalize: bool = True) -> None:
        super().__init__(normalize=normalize)
        if rank not in (3, 4, 5, 6):
            raise invalid("rank", "3, 4, 5 or 6", rank)
        self.rank = rank

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        return ranking.subset(self.rank)


class CompromiseProgramming(RankingSelector):
    """The Pareto-optimal designs nearest to the utopian point U in a weighted L_p norm.

    ``.do(F)`` returns an index array: usually one design, all of them where several are equally
    near up to rounding. At p = 2 with equal weights it is the Salukvadze optimum.

    Args:
        p: Order of the norm, from 1 to ``numpy.inf``. The larger it is, the more the worst
            objective counts; at inf (Chebyshev) it counts alone, and among designs that tie in
            it the least sum of the weighted terms decides (the augmented Chebyshev distance).
        weights: ``(m,)`` weights >= 0 of the objectives inside the norm, not all 0; all 1 unless
            given. Only their ratios matter.
        normalize: As for :class:`SalukvadzeOptimum`.

    Raises:
        ArgumentValueError: ``p`` is no number from 1, a weight is negative, or all are 0; by
            ``.do``: the number of weights is not that of the objectives.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0]])
        >>> for p in (1, 2, np.inf):
        ...     print(CompromiseProgramming(p).do(F))
        [1]
        [2]
        [3]
        >>> CompromiseProgramming(weights=[1, 9]).do(F)
        array([4])
    """

    def __init__(
        self, p: float = 2, *, weights: ArrayLike | None = None, normalize: bool = True
    ) -> None:
        super().__init__(normalize=normalize)
        if not isinstance(p, numbers.Real) or not p >= 1:  # below 1 it is no norm; NaN is refused
            raise invalid("p", "a number from 1 to inf", p)
        self.p: float = float(p)
        self.weights: Array | None = _checked(weights)

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        (front, F), frame = front_of(ranking), ranking.frame
        measures = _AUGMENTED if np.isinf(self.p) else (partial(_norm, p=self.p),)
        return _least(front, frame.scaled(F), frame.sizes(F), self.weights, *measures)


class ReferencePoint(RankingSelector):
    """The Pareto-optimal designs nearest to a reference point, or that exceed it by most.

    They have the least achievement function max_j w_j (f_j − r_j) / (N_j − U_j), where r is the
    reference point and N − U the range of an objective (Wierzbicki 1980). Among
    designs that tie in it the least sum of the terms decides: the augmented function in the limit
    of a small augmentation. The point may be out of reach, or one that every objective can better.

    Args:
        point: ``(m,)`` the wanted value of each objective, in the directions of the ``F`` that
            ``.do(F, maximize=...)`` gets: of an objective to be maximised as it is, not negative.
        weights: ``(m,)`` weights >= 0, not all 0; all 1 unless given. Only their ratios matter.
        normalize: As for :class:`SalukvadzeOptimum`.

    Raises:
        ArgumentValueError: ``point`` is not finite, a weight is negative, or all are 0; by
            ``.do``: their number is not that of the objectives.
        ArgumentTypeError: ``point`` does not hold numbers.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0]])
        >>> ReferencePoint([0.0, 0.8]).do(F), ReferencePoint([0.6, 0.3]).do(F)
        (array([1]), array([2]))
    """

    def __init__(
        self, point: ArrayLike, *, weights: ArrayLike | None = None, normalize: bool = True
    ) -> None:
        super().__init__(normalize=normalize)
        self.point = finite_array("point", point)
        self.weights: Array | None = _checked(weights)

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        (front, F), frame = front_of(ranking), ranking.frame
        point = ranking.objectives.turned("point", self.point)
        sizes = np.maximum(frame.sizes(F), np.abs(point / frame.scale))
        return _least(front, (F - point) / frame.scale, sizes, self.weights, *_AUGMENTED)


class Knee(RankingSelector):
    """The Pareto-optimal design where the set bulges most towards the utopian point U.

    It lies farthest beyond the plane through the extreme designs (Das, Structural Optimization 18,
    1999); for two objectives it is ``CompromiseProgramming(1)``. There it costs more to improve
    any objective than it does between the extremes. ``.do(F)`` returns no index where there is no
    knee: if the set is straight or bulges away from U, or its extremes span no plane. Units and
    ranges do not matter to it. The extreme design of an objective is the one that is worst in it
    for the best in all others: of least largest, then least sum of the others, in units of the
    ranges (Deb and Jain 2014).

    Example:
        >>> import numpy as np
        >>> Knee().do(np.array([[0.0, 1.0], [0.2, 0.3], [0.5, 0.2], [1.0, 0.0]]))
        array([1])
        >>> Knee().do(np.array([[0.0, 1.0], [0.6, 0.6], [1.0, 0.0]]))
        array([], dtype=int64)
    """

    def __init__(self) -> None:
        super().__init__()

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        front, values = front_of(ranking)
        best = values.min(axis=0)
        lengths = unit_lengths(best, values.max(axis=0))
        bulge = _bulges(((values - best) / lengths)[:, np.isfinite(lengths)])
        if bulge.max(initial=0.0) <= _STRAIGHT:
            return front[:0]
        return np.asarray(front[levels(-bulge, _STRAIGHT) == 0])


def compare_selectors(
    F: Any, selectors: Mapping[str, Any], *, normalize: bool = True, maximize: Collection[Any] = ()
) -> dict[str, Rows]:
    """Return what several selectors choose from one set of designs.

    All get the Pareto-optimal rows only, since methods that take dominated rows into account would
    shift their scales by them. Those of this package know which objectives are maximised, so that
    a reference point is in the original directions; others get all objectives minimised.

    Args:
        F: ``(n, m)`` objective values, or what else :func:`pymoo_psi.rank_of_efficiency` takes.
        selectors: By name, anything with pymoo's ``.do(F)`` that returns an index, several, or
            None: those of this package, pymoo's ``PseudoWeights`` and ``HighTradeoffPoints``.
        normalize: Of a ranking that ``F`` is not yet; the selectors have options of their own.
        maximize: The objectives to be maximised, as for :func:`pymoo_psi.rank_of_efficiency`.

    Returns:
        By name of the selector, the indices of the rows it chooses, in its order; perhaps none.

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` does not fit, or a selector returns what is no
            index of a row.
        ArgumentTypeError: ``selectors`` is no mapping.

    Example:
        >>> F = [[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0], [1.0, 1.0]]
        >>> compare_selectors(F, {
        ...     "Salukvadze": SalukvadzeOptimum(),
        ...     "L1": CompromiseProgramming(1),
        ...     "L2": CompromiseProgramming(2),
        ... })
        {'Salukvadze': array([2]), 'L1': array([1]), 'L2': array([2])}
    """
    ranking = ranking_from(F, normalize, maximize)
    front, chosen = np.flatnonzero(ranking.pareto), {}
    n, objectives = len(front), ranking.objectives.rows(front)
    for name, selector in mapping("selectors", selectors, "names to selectors").items():
        own = isinstance(selector, RankingSelector)
        with warnings.catch_warnings():  # pymoo's HighTradeoffPoints switches all of them off
            answer: Any = selector.do(objectives if own else objectives.minimized)
        rows = np.atleast_1d([] if answer is None else answer)
        if len(rows) and (rows.dtype.kind not in "iu" or rows.min() < 0 or rows.max() >= n):
            rule = f"a selector that returns indices from 0 to {n - 1}"
            raise invalid(f"selectors[{name!r}]", rule, Received(repr(answer)))
        chosen[name] = front[rows.astype(np.intp)]
    return chosen


def _checked(weights: ArrayLike | None) -> Array | None:
    """Return ``(m,)`` weights, none negative and not all 0, so scaled that they sum to 1."""
    if weights is None:
        return None
    array = finite_array("weights", weights)
    if array.ndim != 1 or (array < 0).any() or not array.any():
        raise invalid("weights", "a list of numbers >= 0, not all of them 0", weights)
    ratios = array / array.max()  # first, as the sum of large weights overflows
    return np.asarray(ratios / ratios.sum())


@np.errstate(over="ignore")  # NumPy 1 warns where it divides denormal numbers
def _least(
    rows: Rows, d: Array, sizes: Array, weights: Array | None, *measures: Callable[..., Array]
) -> Rows:
    """Return the rows with the least measure of their weighted terms ``d``, up to rounding.

    Of several measures the next decides among rows that are equal in those before. ``sizes`` is how
    large the values behind the terms are.
    """
    weights = np.ones(d.shape[1]) if weights is None else weights
    if len(weights) != d.shape[1]:
        rule = f"{d.shape[1]} numbers, one for each objective"
        raise invalid("weights", rule, Received(f"{len(weights)}"))
    unit = np.abs(d).max() or 1.0  # no sum overflows
    terms, noise = weights * (d / unit), LAST_PLACES * (weights * (sizes / unit))
    for measure in measures:
        best = levels(measure(terms), float(measure(noise[None, :])[0])) == 0
        rows, terms = rows[best], terms[best]
    return rows


def _norm(terms: Array, p: float) -> Array:
    """Return the L_p norms of rows >= 0, which do not underflow at a large p."""
    largest = terms.max(axis=1)
    share = terms / np.where(largest > 0, largest, 1.0)[:, None]
    return np.asarray(largest * (share**p).sum(axis=1) ** (1 / p))


def _bulges(d: Array) -> Array:
    """Return how far ``(n, m)`` points lie beyond the plane of the extremes; 0 if there is none."""
    n, m = d.shape
    extremes = np.empty((m, m))
    for j in range(m if m > 1 else 0):
        others = np.delete(d, j, axis=1)
        extremes[j] = d[np.lexsort((d[:, j], others.sum(axis=1), others.max(axis=1)))[0]]
    if m < 2 or np.linalg.matrix_rank(extremes, tol=_FLAT) < m:
        return np.zeros(n)
    normal = np.linalg.solve(extremes, np.ones(m))  # the plane is d·normal = 1
    if (normal <= 0).any():
        return np.zeros(n)
    return np.asarray((1 - d @ normal) / np.linalg.norm(normal))
