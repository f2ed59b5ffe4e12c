"""What several selectors choose from one Pareto set, and which of them agree."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._output import Shown
from pymoo_psi._validation import Received, invalid, mapping, wrong_type
from pymoo_psi.pareto import EfficiencyRanking, Objectives, ranking_from
from pymoo_psi.selection._selectors import RankingSelector

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False, repr=False)
class SelectorComparison(Shown):
    """What k selectors choose from the same designs.

    Attributes:
        chosen: By name of the selector, the indices of the rows it chooses; perhaps none.
        ranking: The ranking of all rows by efficiency, against which the choices are shown.
        agreement: ``(k, k)`` share of the designs chosen by either of two selectors that both
            choose: 1 for the same choice, 0 for none in common, or where one chooses nothing.

    Example:
        >>> from pymoo_psi import CompromiseProgramming, SalukvadzeOptimum
        >>> F = [[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]
        >>> selectors = {"near U": SalukvadzeOptimum(), "f2": CompromiseProgramming(weights=[0, 1])}
        >>> choices = compare_selectors(F, selectors)
        >>> choices.chosen
        {'near U': array([1]), 'f2': array([2])}
        >>> choices.agreement
        array([[1., 0.],
               [0., 1.]])
    """

    chosen: Mapping[str, NDArray[np.intp]]
    ranking: EfficiencyRanking
    agreement: Array

    def __repr__(self) -> str:
        """Return how many choose from how many."""
        return f"SelectorComparison({len(self.chosen)} selectors, {len(self.votes)} designs)"

    @property
    def votes(self) -> NDArray[np.int64]:
        """``(n,)`` by how many selectors each row is chosen.

        Example:
            >>> from pymoo_psi import CompromiseProgramming, SalukvadzeOptimum
            >>> selectors = {"near U": SalukvadzeOptimum(), "L2": CompromiseProgramming(2)}
            >>> compare_selectors([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]], selectors).votes
            array([0, 2, 0])
        """
        every = np.concatenate([*self.chosen.values()])
        return np.bincount(every, minlength=len(self.ranking.rank))

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each selector and design it chooses.

        Returns:
            Columns: ``selector``, ``design`` (its row, or its label in the data frame that was
            given), the objectives, ``mu1``, ``mu2``, ``mu3``, ``rank``, ``votes`` of all
            selectors for it. A selector that chooses nothing has no row.

        Raises:
            ValueError: An objective has the name of one of the other columns, or the name of
                another objective.

        Example:
            >>> from pymoo_psi import CompromiseProgramming, SalukvadzeOptimum
            >>> least_f2 = CompromiseProgramming(weights=[0, 1])
            >>> selectors = {"near U": SalukvadzeOptimum(), "f2": least_f2}
            >>> choices = compare_selectors([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]], selectors)
            >>> print(choices.to_frame()[["selector", "design", "f1", "f2", "votes"]])
              selector  design   f1   f2  votes
            0   near U       1  0.3  0.4      1
            1       f2       2  1.0  0.0      1
        """
        counts = [len(rows) for rows in self.chosen.values()]
        every = np.concatenate([*self.chosen.values()])
        place = np.argsort(self.ranking.order)  # of each row in the frame
        frame: pd.DataFrame = self.ranking.to_frame().drop(columns="pareto").iloc[place[every]]
        frame.insert(0, "design", frame.index)
        frame.insert(0, "selector", np.repeat([*self.chosen], counts))
        frame.insert(len(frame.columns), "votes", self.votes[every])
        return frame.reset_index(drop=True)

    def agreement_frame(self) -> pd.DataFrame:
        """Return :attr:`agreement` with the names of the selectors on both sides.

        Example:
            >>> from pymoo_psi import CompromiseProgramming, SalukvadzeOptimum
            >>> selectors = {"near U": SalukvadzeOptimum(), "L2": CompromiseProgramming(2)}
            >>> print(compare_selectors([[0, 3], [1, 1], [3, 0]], selectors).agreement_frame())
                    near U   L2
            near U     1.0  1.0
            L2         1.0  1.0
        """
        import pandas as pd

        names = list(self.chosen)
        return pd.DataFrame(self.agreement, index=names, columns=names)


def compare_selectors(
    F: Any,
    selectors: Mapping[str, Any],
    *,
    normalize: bool = True,
    maximize: Collection[Any] = (),
) -> SelectorComparison:
    """Compare what several selectors choose from one set of designs.

    All get the Pareto-optimal rows only, since methods that take dominated rows into account would
    shift their scales by them. Those of this package know which objectives are maximised, so that
    a reference point is in the original directions; others get all objectives minimised. What a
    selector does to Python's warning filters is undone.

    Args:
        F: ``(n, m)`` objective values, an array or a data frame, or a ranking of them, which has
            its own ``normalize`` and ``maximize``.
        selectors: By name, anything with pymoo's ``.do(F)`` that returns an index, several, or
            None: those of this package, pymoo's ``PseudoWeights`` and ``HighTradeoffPoints``,
            methods of pymcdm in a :class:`pymoo_psi.selection.McdmMethod`.
        normalize: Of the ranking beside the choices; the selectors have options of their own.
        maximize: The objectives to be maximised, as for :func:`pymoo_psi.rank_of_efficiency`.

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` does not fit, or a selector returns what is no
            index of a row.
        ArgumentTypeError: ``selectors`` is no mapping to objects with ``.do``.

    Example:
        >>> from pymoo_psi import CompromiseProgramming, SalukvadzeOptimum
        >>> F = [[0.0, 1.0], [0.1, 0.72], [0.5, 0.4], [0.47, 0.48], [1.0, 0.0], [1.0, 1.0]]
        >>> choices = compare_selectors(F, {
        ...     "Salukvadze": SalukvadzeOptimum(),
        ...     "L1": CompromiseProgramming(1),
        ...     "L2": CompromiseProgramming(2),
        ... })
        >>> choices.agreement_frame()
                    Salukvadze   L1   L2
        Salukvadze         1.0  0.0  1.0
        L1                 0.0  1.0  0.0
        L2                 1.0  0.0  1.0
        >>> choices.to_frame()[["selector", "design", "f1", "f2", "rank", "votes"]]
             selector  design   f1    f2  rank  votes
        0  Salukvadze       2  0.5  0.40     6      2
        1          L1       1  0.1  0.72     5      1
        2          L2       2  0.5  0.40     6      2
    """
    mapping("selectors", selectors, "names to selectors")
    ranking = ranking_from(F, normalize, maximize)
    front = np.flatnonzero(ranking.pareto)
    objectives = ranking.objectives.rows(front)
    chosen = {
        name: front[_choice(f"selectors[{name!r}]", selector, objectives)]
        for name, selector in selectors.items()
    }
    # The Jaccard index of every pair; max(..., 1), as two empty choices have nothing to divide by.
    sets = [set(choice.tolist()) for choice in chosen.values()]
    agreement = np.array([[len(a & b) / max(len(a | b), 1) for b in sets] for a in sets])
    return SelectorComparison(chosen, ranking, agreement)


def _choice(name: str, selector: Any, objectives: Objectives) -> Rows:
    """Return what a selector chooses, each row once, in its own order, which may be of preference.

    Args:
        name: The selector, for messages.
        selector: One of this package, which knows names and directions, or any with ``.do(F)``.
        objectives: Of the Pareto-optimal designs.
    """
    if isinstance(selector, type) or not hasattr(selector, "do"):
        raise wrong_type(name, "an object with .do(F)", selector)
    if isinstance(selector, RankingSelector):
        return selector.chosen(objectives)
    n, F = len(objectives.values), objectives.minimized
    with warnings.catch_warnings():  # pymoo's HighTradeoffPoints switches all warnings off
        answer = selector.do(F)
    rows = np.atleast_1d(np.asarray([] if answer is None else answer))
    if len(rows) and (rows.dtype.kind not in "iu" or rows.min() < 0 or rows.max() >= n):
        rule = f"a selector that returns indices from 0 to {n - 1}"
        raise invalid(name, rule, Received(repr(answer)))
    return np.array(list(dict.fromkeys(rows.tolist())), dtype=np.intp)
