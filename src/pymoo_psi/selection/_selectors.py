"""Choosing designs from a Pareto set by pymoo's convention: ``.do(F)`` returns indices.

Every selector here returns an index array, as several designs may be equally good, or none be of
the wanted rank; it chooses among the Pareto-optimal rows, and takes ``maximize=`` for objectives
of which more is better, as :func:`pymoo_psi.rank_of_efficiency` does. pymoo's ``PseudoWeights``
returns one index, its ``HighTradeoffPoints`` an array or None.
:func:`pymoo_psi.selection.compare_selectors` takes them all.
"""

from __future__ import annotations

import numbers
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.core.indicator import Indicator

from pymoo_psi._validation import (
    Received,
    boolean,
    collection,
    finite_array,
    finite_number,
    integer,
    invalid,
    wrong_type,
)
from pymoo_psi.pareto import EfficiencyRanking, Objectives, front_of, nondominated, ranking_of
from pymoo_psi.pareto._compromise import highest_achievement, knee, nearest_compromise
from pymoo_psi.problems._pymoo import call_of


class RankingSelector(Indicator):
    """A selection among the Pareto-optimal designs, all of which have been ranked.

    It derives from pymoo's ``Indicator``, the base of pymoo's own decision makers, because
    importing ``pymoo.core.decision_making`` pulls a module that SciPy has deprecated.
    """

    def __init__(self, *, normalize: bool = True) -> None:
        super().__init__()
        self.normalize = boolean("normalize", normalize)

    def __repr__(self) -> str:
        """Return the call that makes it."""
        return call_of(self)

    def do(self, F: Any, *, maximize: Collection[Any] = ()) -> NDArray[np.intp]:
        """Return the indices of the chosen rows of ``F``.

        Args:
            F: ``(n, m)`` objective values, an array or a data frame; one row may be ``(m,)``.
            maximize: The objectives to be maximised: column indices or, of a data frame, names.

        Example:
            >>> SalukvadzeOptimum().do(np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]))
            array([1])
            >>> SalukvadzeOptimum().do([[0.0, 0.0], [0.3, 0.6], [1.0, 1.0]], maximize=[1])
            array([1])
        """
        return self.chosen(objectives_of(F, maximize))

    def chosen(self, objectives: Objectives) -> NDArray[np.intp]:
        """Return what :meth:`do` returns, of objectives that know their names and senses."""
        pareto = nondominated(objectives.minimized)
        return self._choose(ranking_of(objectives, pareto, normalize=self.normalize))

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
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

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        return ranking.salukvadze


class EfficientSubset(RankingSelector):
    """The designs M_Re of exactly one rank of efficiency; the set may be empty.

    For "this rank or better" take ``rank_of_efficiency(F).rank >= rank``.

    Args:
        rank: The rank of efficiency, 3 to 6; no design has rank 1 or 2.
        normalize: As for :class:`SalukvadzeOptimum`.

    Raises:
        ArgumentValueError: There is no such rank.
        ArgumentTypeError: ``rank`` is not an integer.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0]])
        >>> EfficientSubset(6).do(F), EfficientSubset(5).do(F), EfficientSubset(4).do(F)
        (array([2]), array([1]), array([3]))
    """

    def __init__(self, rank: int, *, normalize: bool = True) -> None:
        super().__init__(normalize=normalize)
        self.rank = integer("rank", rank, minimum=3)
        if rank > 6:
            raise invalid("rank", "3 to 6", rank)

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
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
        ArgumentValueError: ``p`` is below 1, a weight is negative, or all are 0; by ``.do``: the
            number of weights is not that of the objectives.
        ArgumentTypeError: ``p`` is not a number.

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

    p: float
    weights: NDArray[np.float64] | None

    def __init__(
        self, p: float = 2, *, weights: ArrayLike | None = None, normalize: bool = True
    ) -> None:
        super().__init__(normalize=normalize)
        if isinstance(p, bool) or not isinstance(p, numbers.Real):
            raise wrong_type("p", "a number from 1 to inf", p)
        try:
            self.p = float(p)
        except OverflowError:  # an integer beyond floats
            self.p = np.nan
        if not self.p >= 1:  # below 1 it is no norm; written so that NaN is refused
            raise invalid("p", "a number from 1 to inf", p)
        self.weights = None if weights is None else checked_weights(weights)

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        return nearest_compromise(ranking, self.p, weights_of(len(ranking.ideal), self.weights))


class ReferencePoint(RankingSelector):
    """The Pareto-optimal designs that come nearest to what one aspires to, or exceed it by most.

    They have the least achievement function max_j w_j (f_j − r_j) / (N_j − U_j), where r is the
    reference point, the aspiration, and N − U the range of an objective (Wierzbicki 1980). Among
    designs that tie in it the least sum of the terms decides: the augmented function in the limit
    of a small augmentation. A point that is out of reach, and one that every objective can better,
    are both answered sensibly.

    Args:
        point: ``(m,)`` the wanted value of each objective, in the sense of the ``F`` that
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
        self.weights = None if weights is None else checked_weights(weights)

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        objectives = ranking.objectives
        weights = weights_of(len(objectives.names), self.weights)
        point = objectives.turned("point", self.point)
        return highest_achievement(ranking, point, weights)


class Lexicographic(RankingSelector):
    """The Pareto-optimal designs that are best in one objective, then in the next, and so on.

    Args:
        order: The objectives, the most important first: column indices or, of a data frame,
            names. Those that are left out do not count.
        tolerance: How much of the best value may be given up for the objectives that follow, as a
            share of the objective's range over the Pareto set, 0 to 1. With 0 the first objective
            decides alone unless designs tie in it; in the last one only the best remain.

    Raises:
        ArgumentValueError: ``order`` is empty or names an objective twice, ``tolerance`` is not
            from 0 to 1; by ``.do``: there is no such objective.
        ArgumentTypeError: ``order`` is no list.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0]])
        >>> Lexicographic([0, 1]).do(F), Lexicographic([0, 1], tolerance=0.2).do(F)
        (array([0]), array([1]))
    """

    def __init__(self, order: Collection[Any], *, tolerance: float = 0.0) -> None:
        super().__init__()
        self.order = tuple(collection("order", order, "a list of objectives"))
        if not self.order or len(set(self.order)) < len(self.order):
            raise invalid("order", "one or more objectives, each once", list(self.order))
        self.tolerance = finite_number("tolerance", tolerance)
        if not 0 <= self.tolerance <= 1:
            raise invalid("tolerance", "a share from 0 to 1", self.tolerance)

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        columns = [ranking.objectives.column("order", entry) for entry in self.order]
        rows, values = front_of(ranking)
        allowed = self.tolerance * np.ptp(values, axis=0)
        for k, j in enumerate(columns):
            last = k == len(columns) - 1
            kept = values[:, j] <= values[:, j].min() + (0.0 if last else allowed[j])
            rows, values = rows[kept], values[kept]
        return rows


class Knee(RankingSelector):
    """The Pareto-optimal design where the set bulges most towards the utopian point U.

    It lies farthest beyond the plane through the extreme designs (Das, Structural Optimization 18,
    1999); for two objectives it is ``CompromiseProgramming(1)``. There it costs more to improve
    any objective than it does between the extremes. ``.do(F)`` returns no index where there is no
    knee: if the set is straight or bulges away from U, or its extremes span no plane. Units and
    ranges do not matter to it.

    Example:
        >>> import numpy as np
        >>> Knee().do(np.array([[0.0, 1.0], [0.2, 0.3], [0.5, 0.2], [1.0, 0.0]]))
        array([1])
        >>> Knee().do(np.array([[0.0, 1.0], [0.6, 0.6], [1.0, 0.0]]))
        array([], dtype=int64)
    """

    def __init__(self) -> None:
        super().__init__()

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        return knee(ranking)


def objectives_of(F: Any, maximize: Collection[Any]) -> Objectives:
    """Return what ``.do(F)`` of a selector gets; one design may be a vector."""
    if not hasattr(F, "columns"):
        F = np.asanyarray(F)  # a mask is kept, to be refused
        F = F[None, :] if F.ndim == 1 else F
    return Objectives.of(F, maximize)


def checked_weights(weights: ArrayLike) -> NDArray[np.float64]:
    """Return ``(m,)`` weights, none negative and not all 0, so scaled that they sum to 1."""
    array = finite_array("weights", weights)
    if array.ndim != 1 or (array < 0).any() or not array.any():
        raise invalid("weights", "a list of numbers >= 0, not all of them 0", weights)
    ratios = array / array.max()  # first, as the sum of large weights overflows
    shares: NDArray[np.float64] = ratios / ratios.sum()
    return shares


def weights_of(m: int, weights: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Return ``(m,)`` weights of a selector, whose number is known by its ``.do`` only."""
    if weights is None:
        return np.ones(m)
    if len(weights) != m:
        raise invalid(
            "weights", f"{m} numbers, one for each objective", Received(f"{len(weights)}")
        )
    return weights
