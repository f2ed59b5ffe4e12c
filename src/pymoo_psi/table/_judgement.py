"""Which tests are feasible, which compete and which are Pareto optimal, under limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.pareto import EfficiencyRanking, nondominated
from pymoo_psi.pareto._feasibility import competes
from pymoo_psi.pareto._objectives import Objectives
from pymoo_psi.pareto._ranking import ranking_of
from pymoo_psi.table._layout import Key, Limits
from pymoo_psi.table._limits import limit_vector, within_limits
from pymoo_psi.table._records import Records

if TYPE_CHECKING:
    from typing_extensions import Self


Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class JudgedRecords(Records):
    """Tested points with the sets of designs that limits on criteria leave."""

    def feasible(self, limits: Limits | None = None) -> Mask:
        """``(n,)`` which designs are "ok" and keep the limits.

        Raises:
            ArgumentValueError: A criterion is not known, or a limit is NaN.
            ArgumentTypeError: The limits are no mapping to numbers.

        Example:
            >>> from pymoo_psi import TestTable
            >>> X, F, G = [[0.1], [0.5], [0.9]], [[1], [2], [3]], [[0.5], [0.0], [0.0]]
            >>> table = TestTable.of([1, 2, 3], X, F, G)
            >>> table.feasible()
            array([False,  True,  True])
            >>> table.feasible({"f1": 2})
            array([False,  True, False])
        """
        ok: Mask = self.status == "ok"
        return ok & within_limits(self.F, limit_vector(limits, self.layout))

    def eligible(self, limits: Limits | None = None) -> Mask:
        """``(n,)`` which designs are feasible and have finite criteria, so that they compete.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("inf")]]).eligible()
            array([ True, False])
        """
        return competes(self.F, self.feasible(limits))

    def pareto(self, limits: Limits | None = None) -> Mask:
        """``(n,)`` which designs are Pareto optimal among the eligible ones.

        Example:
            Without a limit on f1 no design beats another; with one there are fewer to compare.

            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1, 3], [2, 2], [3, 3]])
            >>> table.pareto()
            array([ True,  True, False])
            >>> table.pareto({"f1": 1.5})
            array([ True, False, False])
        """
        mask = self.eligible(limits)
        if self.F.shape[1] > 0:  # without criteria no design is better than another
            mask[mask] = nondominated(self.F[mask])
        return mask

    def ranking(self, limits: Limits | None = None, *, normalize: bool = True) -> EfficiencyRanking:
        """Rank the Pareto-optimal designs by efficiency; see :func:`~pymoo_psi.rank_of_efficiency`.

        Returns:
            The ranking of ``self.F[self.pareto(limits)]``, in that order, without another search
            for the Pareto set.

        Raises:
            ArgumentValueError: There is no design to rank, or a limit does not fit.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> front = table.rows(table.pareto())
            >>> front.numbers[table.ranking().salukvadze]
            array([2])
        """
        front = self.F[self.pareto(limits)]
        if len(front) == 0:
            failed = np.sum(self.status == "failed")
            found = Received(f"none of {len(self)} tests, of which {failed} failed")
            remedy = "see its reasons" if failed else "loosen the limits, or test more points"
            raise invalid("the table", "one with a feasible design", found, remedy)
        known = np.ones(len(front), dtype=bool)
        return ranking_of(Objectives.of(front), known, normalize=normalize)

    def sorted_by(self, criterion: Key, limits: Limits | None = None) -> Self:
        """Return the ordered test table of a criterion: the feasible designs, the best first.

        It is a table again, for the next question, a frame or a file. Equal designs stay in the
        order of testing; those whose criterion is NaN come last.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[2, 5], [1, 6], [3, 4]])
            >>> table.sorted_by("f1").numbers, table.sorted_by("f1", {"f2": 5}).numbers
            (array([2, 1, 3]), array([1, 3]))
        """
        values = self.F[:, self.layout.objective(criterion)]
        rows = np.flatnonzero(self.feasible(limits))
        return self.rows(rows[np.argsort(values[rows], kind="stable")])
