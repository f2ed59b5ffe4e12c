"""Choosing designs from a Pareto set by pymoo's convention: ``.do(F)`` returns indices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.indicator import Indicator

from pymoo_psi.arguments import boolean, broken_rule, integer
from pymoo_psi.pareto import EfficiencyRanking, rank_of_efficiency

__all__ = ["EfficientSubset", "SalukvadzeOptimum"]


class _RankingSelector(Indicator):
    """A selection by rank of efficiency.

    It derives from pymoo's ``Indicator``, the base of pymoo's own decision makers, because
    importing ``pymoo.core.decision_making`` pulls a module that SciPy has deprecated.
    """

    def __init__(self, *, normalize: bool) -> None:
        super().__init__()
        self.normalize = boolean("normalize", normalize)

    def do(self, F: Any, *args: Any, **kwargs: Any) -> NDArray[np.intp]:
        """Return the indices of the chosen rows of the ``(n, m)`` matrix ``F``, nearest U first."""
        F = np.asarray(F)
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

    def __init__(self, *, normalize: bool = True) -> None:
        super().__init__(normalize=normalize)

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        return ranking.salukvadze


class EfficientSubset(_RankingSelector):
    """The designs M_Re of one rank of efficiency; the set may be empty.

    Args:
        rank: The rank of efficiency, 1 to 6.
        normalize: As for :class:`SalukvadzeOptimum`.

    Example:
        >>> import numpy as np
        >>> F = np.array([[0.0, 1.0], [0.2, 0.5], [0.52, 0.19], [1.0, 0.0]])
        >>> EfficientSubset(6).do(F), EfficientSubset(5).do(F)
        (array([1]), array([], dtype=int64))
    """

    def __init__(self, rank: int, *, normalize: bool = True) -> None:
        super().__init__(normalize=normalize)
        self.rank = integer("rank", rank, minimum=1)
        if rank > 6:
            raise broken_rule("rank", "1 to 6", rank)

    def _choose(self, ranking: EfficiencyRanking) -> NDArray[np.intp]:
        return ranking.subset(self.rank)
