"""Choosing designs from a Pareto set by pymoo's convention: ``.do(F)`` returns indices.

Every selector here returns an index array, as several designs may be equally good, or none be of
the wanted rank; pymoo's ``PseudoWeights`` returns one index, its ``HighTradeoffPoints`` an array
or None. :func:`pymoo_psi.selection.compare_selectors` takes them all.
"""

from __future__ import annotations

import numbers
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.core.indicator import Indicator

from pymoo_psi._validation import Received, boolean, finite_array, integer, invalid
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.pareto import EfficiencyRanking, rank_of_efficiency
from pymoo_psi.pareto._compromise import nearest_compromise


class _RankingSelector(Indicator):
    """A selection by rank of efficiency.

    It derives from pymoo's ``Indicator``, the base of pymoo's own decision makers, because
    importing ``pymoo.core.decision_making`` pulls a module that SciPy has deprecated.
    """

    def __init__(self, *, normalize: bool = True) -> None:
        super().__init__()
        self.normalize = boolean("normalize", normalize)

    def do(self, F: Any, *args: Any, **kwargs: Any) -> NDArray[np.intp]:
        """Return the indices of the chosen rows of the ``(n, m)`` matrix ``F``, nearest U first.

        Example:
            >>> SalukvadzeOptimum().do(np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]))
            array([1])
        """
        F = np.asanyarray(F)  # a mask is kept, to be refused
        return self._choose(
            rank_of_efficiency(F[None, :] if F.ndim == 1 else F, normalize=self.normalize)
        )

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        raise NotImplementedError


class SalukvadzeOptimum(_RankingSelector):
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


class EfficientSubset(_RankingSelector):
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


class CompromiseProgramming(_RankingSelector):
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
            raise ArgumentTypeError(f"p must be a number from 1 to inf, got {p!r:.80}")
        try:
            self.p = float(p)
        except OverflowError:  # an integer beyond floats
            self.p = np.nan
        if not self.p >= 1:  # below 1 it is no norm; written so that NaN is refused
            raise invalid("p", "a number from 1 to inf", p)
        self.weights = None if weights is None else checked_weights(weights)

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        return nearest_compromise(ranking, self.p, weights_of(len(ranking.ideal), self.weights))


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
