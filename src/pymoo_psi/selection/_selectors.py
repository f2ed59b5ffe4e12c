"""Selectors with pymoo's interface: ``.do(F)`` returns the indices of the chosen rows.

Every selector here returns an array of indices, as several designs may be equally good, or none may
have the requested rank. It chooses among the Pareto-optimal rows and takes ``maximize=`` as
:func:`pymoo_psi.rank_of_efficiency` does. pymoo's ``PseudoWeights`` returns one index, its
``HighTradeoffPoints`` an array or None, and its decompositions, such as ``ASF``, values of which
the least is meant. :func:`pymoo_psi.selection.compare_selectors` accepts all of them.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pymoo.core.decomposition import Decomposition
from pymoo.core.indicator import Indicator

from pymoo_psi._validation import (
    Array,
    Entries,
    Rows,
    finite_array,
    invalid,
    is_real,
    require_shape,
    source_type,
)
from pymoo_psi.pareto import (
    LAST_PLACES,
    EfficiencyRanking,
    Preferences,
    levels,
    rank_of_efficiency,
    unit_lengths,
)

# A set with a bulge below this share of the ranges is straight. The plane through the extremes is
# accurate to about 1e-16 / 1e-6 of the ranges, see below.
_STRAIGHT = 1e-9
# Extremes whose directions from U differ by less than this span no plane: the set is degenerate.
_FLAT = 1e-6

_Measures = tuple[Callable[[Array], Array], ...]
"""Each takes ``(n, m)`` weighted terms and returns a value of each row, of which less is better.

A measure decides among rows that are equal in those before.
"""
_LARGEST_THEN_SUM: _Measures = (partial(np.max, axis=1), partial(np.sum, axis=1))
"""The augmented distance max + rho * sum in the limit of a small rho."""


class RankingSelector(Indicator):
    """A selector that chooses among the Pareto-optimal designs by their ranking.

    It derives from pymoo's ``Indicator``, the base class of pymoo's own decision makers, because
    ``pymoo.core.decision_making`` imports a module that SciPy has deprecated.
    """

    def __init__(self, *, normalize: bool | None = None) -> None:
        super().__init__()
        self.normalize = normalize

    def do(self, F: Any, *, maximize: Collection[Any] = ()) -> Rows:
        """Return the indices of the chosen rows of ``F``.

        Args:
            F: ``(n, m)`` objective values, as for :func:`pymoo_psi.rank_of_efficiency`.
            maximize: The objectives to be maximised: indices of columns, or the names of columns
                if ``F`` is a data frame.

        Example:
            >>> SalukvadzeOptimum().do(np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]))
            array([1])
            >>> SalukvadzeOptimum().do([[0.0, 0.0], [0.3, 0.6], [1.0, 1.0]], maximize=[1])
            array([1])
        """
        ranking = rank_of_efficiency(F, normalize=self.normalize, maximize=maximize)
        return _rows_of(F, ranking, self._choose(ranking))

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        raise NotImplementedError


class SalukvadzeOptimum(RankingSelector):
    """The designs nearest to the utopian point U, usually one.

    Args:
        normalize: Measure each objective in units of its range over the Pareto set; ``False``
            is the paper's plain Euclidean distance. By default ``True``, or as the table or ranking
            has it.

    Example:
        >>> import numpy as np
        >>> SalukvadzeOptimum().do(np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]))
        array([1])
    """

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        return ranking.salukvadze


class EfficientSubset(RankingSelector):
    """The designs M_Re with exactly one rank of efficiency; there may be none.

    The rank is a number of the paper, and 6 the rank of place 1. It is not an order: for the next
    best designs, use ``rank_of_efficiency(F).place``. For "this rank or better", use
    ``rank_of_efficiency(F).rank >= rank``.

    Args:
        rank: The rank of efficiency, 3 to 6; no design has rank 1 or 2.
        normalize: As for :class:`SalukvadzeOptimum`.

    Raises:
        ArgumentValueError: By ``.do``, if there is no such rank.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0]])
        >>> EfficientSubset(6).do(F), EfficientSubset(5).do(F), EfficientSubset(4).do(F)
        (array([2]), array([1]), array([3]))
    """

    def __init__(self, rank: int, *, normalize: bool | None = None) -> None:
        super().__init__(normalize=normalize)
        self.rank = rank

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        return ranking.subset(self.rank)


class CompromiseProgramming(RankingSelector):
    """The Pareto-optimal designs nearest to the utopian point U in a weighted L_p norm.

    Usually this is one design; several are returned if they are equally near, up to rounding. With
    p = 2 and equal weights it is the Salukvadze optimum.

    Args:
        p: Order of the norm, from 1 to ``numpy.inf``. The larger it is, the more the worst
            objective counts. With inf (Chebyshev) it counts alone; ties are broken by the least sum
            of the weighted terms (the augmented Chebyshev distance).
        weights: ``(m,)`` weights of the objectives inside the norm, or by name, >= 0 and not all 0;
            by default all 1. Only their ratios matter. They are raised to the power p with the
            differences: with p = 2, twice the weight counts four times.
        normalize: As for :class:`SalukvadzeOptimum`.

    Raises:
        ArgumentValueError: ``p`` is not a number >= 1. Also by ``.do``, if a weight is negative,
            all are 0, or their number is not that of the objectives.

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
        self, p: float = 2, *, weights: ArrayLike | None = None, normalize: bool | None = None
    ) -> None:
        super().__init__(normalize=normalize)
        # Below 1 it would not be a norm; the comparison rejects NaN, too.
        if not is_real(p) or not p >= 1:
            raise invalid("p", "a number from 1 to inf", p)
        self.p: float = float(p)
        self.weights = weights

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        terms = ranking.frame.scaled(ranking.optimal)
        sizes = ranking.frame.sizes(ranking.optimal)
        measures: _Measures = (partial(_norm, p=self.p),)
        if np.isinf(self.p):
            measures = _LARGEST_THEN_SUM
        weights = _of_sum_one(ranking, self.weights)
        return _least_weighted(ranking.front, terms, sizes, weights, measures)


class ReferencePoint(RankingSelector):
    """The Pareto-optimal designs nearest to a reference point, or farthest beyond it.

    They minimise the achievement function max_j w_j (f_j − r_j) / (N_j − U_j), where r is the
    reference point and N − U the range of an objective (Wierzbicki 1980). Ties are broken by the
    least sum of the terms: the augmented function in the limit of a small augmentation. The point
    may be out of reach, or worse than some designs in every objective.

    Args:
        point: ``(m,)`` the aspired value of each objective, or by name, in the original directions:
            the sign of an objective to be maximised is not changed.
        weights: ``(m,)`` weights, or by name, >= 0, not all 0; by default all 1. Only their ratios
            matter.
        normalize: As for :class:`SalukvadzeOptimum`.

    Raises:
        ArgumentValueError: By ``.do``, if ``point`` is not finite, a weight is negative, all are 0,
            or their number is not that of the objectives.
        ArgumentTypeError: By ``.do``, if ``point`` does not contain numbers.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0]])
        >>> ReferencePoint([0.0, 0.8]).do(F), ReferencePoint([0.6, 0.3]).do(F)
        (array([1]), array([2]))
    """

    def __init__(
        self, point: ArrayLike, *, weights: ArrayLike | None = None, normalize: bool | None = None
    ) -> None:
        super().__init__(normalize=normalize)
        self.point = point
        self.weights = weights

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        point = ranking.objectives.turned("point", self.point)
        scale = ranking.frame.scale
        terms = (ranking.optimal - point) / scale
        sizes = np.maximum(ranking.frame.sizes(ranking.optimal), np.abs(point / scale))
        weights = _of_sum_one(ranking, self.weights)
        return _least_weighted(ranking.front, terms, sizes, weights, _LARGEST_THEN_SUM)


class Preferred(RankingSelector):
    """The design that answers to questions find; see :class:`pymoo_psi.Preferences`.

    Args:
        answers: Those of :attr:`pymoo_psi.Preferences.answers`: two designs, as rows or labels of
            what is selected from, and between them ">" if the first is preferred, "=" if they are
            equally good.
        p: As for :class:`pymoo_psi.Preferences`.
        factor: As for :class:`pymoo_psi.Preferences`.
        normalize: As for :class:`SalukvadzeOptimum`.

    Raises:
        ArgumentValueError: By ``.do``, if an answer is not about two Pareto-optimal designs.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.1, 0.6], [0.4, 0.3], [0.8, 0.1], [1.0, 0.0]])
        >>> Preferred([]).do(F), Preferred([(1, ">", 2)]).do(F)
        (array([2]), array([1]))
    """

    def __init__(
        self,
        answers: Iterable[tuple[Any, str, Any]],
        *,
        p: float = 2,
        factor: float | None = None,
        normalize: bool | None = None,
    ) -> None:
        super().__init__(normalize=normalize)
        self.answers: list[tuple[Any, str, Any]] = [*answers]
        self.p = p
        self.factor = factor

    def _choose(self, ranking: EfficiencyRanking) -> Rows:
        person = Preferences(ranking, p=self.p, factor=self.factor)
        for one, relation, other in self.answers:
            person.add(one, relation, other)
        return np.array([person.row])


class Knee(RankingSelector):
    """The Pareto-optimal design where the set bulges most towards the utopian point U.

    It lies farthest beyond the plane through the extreme designs (Das, Structural Optimization 18,
    1999); for two objectives it is ``CompromiseProgramming(1)``. At a knee, improving any objective
    costs more than it does between the extremes. ``.do(F)`` returns no index if there is no knee:
    if the set is straight or bulges away from U, or if its extremes span no plane. The result does
    not depend on units and ranges. The extreme design of an objective is the best in all others:
    it has the least maximum of these, then the least sum, in units of the ranges (Deb and Jain
    2014).

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
        values = ranking.optimal
        best = values.min(axis=0)
        lengths = unit_lengths(best, values.max(axis=0))
        scaled = (values - best) / lengths
        bulge = _bulges(scaled[:, np.isfinite(lengths)])
        if bulge.max(initial=0.0) <= _STRAIGHT:
            return ranking.front[:0]
        return np.asarray(ranking.front[levels(-bulge, _STRAIGHT) == 0])


def compare_selectors(
    F: Any, selectors: Entries, *, normalize: bool | None = None, maximize: Collection[Any] = ()
) -> dict[str, Rows]:
    """Return what several selectors choose from one set of designs.

    Selectors of this package receive the ranking, with its directions and fixed points U and N, so
    that a reference point is in the original directions. Others receive the Pareto-optimal rows
    only, all objectives minimised in their own units; dominated rows would shift the scales of some
    methods. A decomposition of pymoo receives the same rows as distances from U, in units of the
    ranges N − U if these are normalised.

    Args:
        F: ``(n, m)`` objective values, or anything else that :func:`pymoo_psi.rank_of_efficiency`
            accepts, or a ranking.
        selectors: Selectors by name: objects with pymoo's ``.do(F)`` that returns an index, several
            indices, or None. They may be those of this package, pymoo's ``PseudoWeights`` and
            ``HighTradeoffPoints``, or others. Or pymoo's decompositions, such as ``ASF()`` with
            weights of 1, or a pair ``(ASF(), weights)`` with those of its ``do``; the row with the
            least value is chosen.
        normalize: Whether decompositions are normalised, and selectors of this package that do not
            say it themselves, as for :func:`pymoo_psi.rank_of_efficiency`.
        maximize: The objectives to be maximised, as for :func:`pymoo_psi.rank_of_efficiency`.

    Returns:
        For each selector by name, the indices of the rows that it chooses, in its order; there may
        be none.

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` is invalid.

    Example:
        >>> F = [[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0], [1.0, 1.0]]
        >>> compare_selectors(F, {
        ...     "Salukvadze": SalukvadzeOptimum(),
        ...     "L1": CompromiseProgramming(1),
        ...     "L2": CompromiseProgramming(2),
        ... })
        {'Salukvadze': array([2]), 'L1': array([1]), 'L2': array([2])}
    """
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    values = ranking.objectives.minimized[ranking.front]
    distances = ranking.frame.scaled(values)
    chosen = {}
    for name, selector in selectors.items():
        if isinstance(selector, RankingSelector):
            rows = selector.do(ranking)
        else:
            rows = np.atleast_1d(ranking.front[_chosen(name, selector, values, distances)])
        chosen[name] = _rows_of(F, ranking, rows)
    return chosen


def _chosen(name: str, selector: Any, values: Array, distances: Array) -> Any:
    """Return which of k Pareto-optimal rows a selector or decomposition with pymoo's interface has.

    Args:
        name: Its name, for messages.
        selector: What chooses, or a pair of a decomposition and its weights.
        values: ``(k, m)`` objectives, minimised.
        distances: ``(k, m)`` the same as distances from U.
    """
    if len(values) == 1:  # some cannot scale it
        return 0
    weights = np.ones(values.shape[1])
    if isinstance(selector, tuple):
        selector, weights = selector
    with warnings.catch_warnings():  # pymoo's HighTradeoffPoints switches all warnings off
        if isinstance(selector, Decomposition):
            return np.argmin(selector.do(distances.copy(), finite_array(name, weights)))
        rows = selector.do(values.copy())
    return [] if rows is None else rows


def _rows_of(F: Any, ranking: EfficiencyRanking, chosen: Rows) -> Rows:
    """Return the rows of F that are chosen from its ranking, which of a table are the feasible."""
    if source_type(F) == "table":
        return ranking.rows[chosen]
    return chosen


def _of_sum_one(ranking: EfficiencyRanking, weights: ArrayLike | None) -> Array:
    """Return ``(m,)`` weights, none negative and not all 0, scaled to the sum 1; or 1 for each."""
    sizes = ranking.objectives.minimized.shape[1:]
    if weights is None:
        return np.ones(sizes)
    array = finite_array("weights", ranking.objectives.in_order("weights", weights))
    require_shape("weights", array, sizes)
    if (array < 0).any() or not array.any():
        raise invalid("weights", "a list of numbers >= 0, not all of them 0", weights)
    return np.asarray(array / array.sum())


def _least_weighted(
    rows: Rows, terms: Array, sizes: Array, weights: Array, measures: _Measures
) -> Rows:
    """Return the rows with the least measure of their weighted terms, up to rounding.

    Args:
        rows: ``(n,)`` rows to choose from.
        terms: ``(n, m)`` the terms of each row, one for each objective.
        sizes: ``(m,)`` magnitudes of the values of which the terms are differences.
        weights: ``(m,)`` weights of the objectives.
        measures: What is least.
    """
    terms = weights * terms
    noise = LAST_PLACES * weights * sizes
    for measure in measures:
        tolerance = float(measure(noise[None, :])[0])
        values = measure(terms)
        best = values <= values.min() + tolerance
        rows = rows[best]
        terms = terms[best]
    return rows


def _norm(terms: Array, p: float) -> Array:
    """Return the L_p norms of rows of values >= 0, without underflow for large p."""
    largest = terms.max(axis=1)
    divisor = np.where(largest > 0, largest, 1.0)
    shares = terms / divisor[:, None]
    return np.asarray(largest * np.linalg.norm(shares, ord=p, axis=1))


def _bulges(d: Array) -> Array:
    """Return how far ``(n, m)`` points lie beyond the plane of the extremes; 0 if there is none."""
    n, m = d.shape
    flat = np.zeros(n)
    if m < 2:
        return flat
    extremes = np.empty((m, m))
    for j in range(m):
        others = np.delete(d, j, axis=1)
        order = np.lexsort((d[:, j], others.sum(axis=1), others.max(axis=1)))
        extremes[j] = d[order[0]]
    if np.linalg.matrix_rank(extremes, tol=_FLAT) < m:
        return flat
    normal = np.linalg.solve(extremes, np.ones(m))  # the plane is d·normal = 1
    if (normal <= 0).any():
        return flat
    return np.asarray((1 - d @ normal) / np.linalg.norm(normal))
