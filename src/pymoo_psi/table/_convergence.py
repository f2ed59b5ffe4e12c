"""How the decision changed with the number of tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._output import Shown
from pymoo_psi._validation import Received, counted, invalid, positive_number
from pymoo_psi.pareto import UtopianFrame, hypervolume, listed, number, percent
from pymoo_psi.table._analysis import even_part
from pymoo_psi.table._layout import Limits
from pymoo_psi.table._table import TestTable

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_LEAST = 8  # tests of the first row; fewer have no front to speak of
# Of the hypervolume, in units of the last front's range: a little beyond its worst values, so that
# the designs at its ends count, too.
_REFERENCE = 1.1


@dataclass(frozen=True, eq=False, repr=False)
class Convergence(Shown):
    """What the first n tests would have decided, n doubling from row to row up to all of them.

    Distances are those of the ranking of all tests, so that rows can be compared. Where one design
    is the best in every objective they have no unit, and ``mu1``, ``hypervolume`` and ``moved``
    are NaN.

    Attributes:
        tests: ``(k,)`` numbers n of tests, increasing.
        feasible: ``(k,)`` how many are feasible.
        pareto: ``(k,)`` how many of these are Pareto optimal among the first n.
        hypervolume: ``(k,)`` what their front dominates, as a share of what the last one does.
        volume_error: ``(k,)`` standard error of that share; 0 where it is exact.
        optimum: ``(k,)`` the test point nearest to U by the ranking of the first n; 0 where no
            design is feasible.
        mu1: ``(k,)`` its distance to the U of all tests; infinite where there is none.
        moved: ``(k,)`` how far it lies from that of the row before: the largest difference in an
            objective, in units of the objective's range over the last front; NaN where there was
            none before.
        best: ``(k, m)`` its objectives, in the original directions; NaN where there is none.
        objectives: Their m names.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
        >>> found = convergence(table, normalize=False)
        >>> found.tests[-4:], found.optimum[-4:]
        (array([ 128,  256,  512, 1024]), array([  35,  205,  205, 1021]))
    """

    tests: Integers
    feasible: Integers
    pareto: Integers
    hypervolume: Array
    volume_error: Array
    optimum: Integers
    mu1: Array
    moved: Array
    best: Array
    objectives: tuple[str, ...]

    def __repr__(self) -> str:
        """Return how many tests there are, and what they decide."""
        return f"Convergence({self.tests[-1]} tests: the best is no. {self.optimum[-1]})"

    def to_frame(self) -> pd.DataFrame:
        """Return the rows, with index ``tests`` and a column for each other array.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> found = convergence(investigate(VectorizedSphereChute(0.4, model="rolling"), 64))
            >>> print(found.to_frame()[["pareto", "optimum", "mu1"]].round(2))
                   pareto  optimum   mu1
            tests
            8           6        5  0.78
            16         12       13  0.58
            32         18       21  0.49
            64         36       21  0.49
        """
        import pandas as pd

        names = ("feasible", "pareto", "hypervolume", "optimum", "mu1", "moved")
        frame = pd.DataFrame({name: getattr(self, name) for name in names})
        return frame.set_index(pd.Index(self.tests, name="tests"))

    def gains(self) -> tuple[float, float]:
        """Return what the last doubling of the tests brought.

        Returns:
            By what share of its μ1 the best design came nearer to U, and by what share the
            hypervolume grew; NaN if half of the tests had no feasible design, or if one design is
            the best in every objective.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
            >>> nearer, larger = convergence(table, normalize=False).gains()
            >>> round(nearer, 3), round(larger, 3)
            (0.006, 0.012)
        """
        if len(self.tests) < 2 or not np.isfinite(self.moved[-1]):
            return float("nan"), float("nan")
        (before, now), volume = self.mu1[-2:].tolist(), float(self.hypervolume[-2])
        larger = 1 / volume - 1 if volume > 0 else float("inf")
        return (before - now) / before if before > now else 0.0, larger

    def verdict(self, *, tolerance: float = 0.01) -> str:
        """Say what the last doubling of the tests changed in the decision, and what is not known.

        What the next one will change is not foretold: on known problems no estimate from the
        doublings before is right often enough.

        Args:
            tolerance: What share of its μ1 the best design must have come nearer, or of itself the
                hypervolume must have grown, to be worth the tests.

        Raises:
            ArgumentValueError: ``tolerance`` is not above 0.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
            >>> print(convergence(table, normalize=False).verdict())
            The last doubling, from 512 to 1024 tests, still changed the decision by more than ...
        """
        tolerance, n = positive_number("tolerance", tolerance), int(self.tests[-1])
        if len(self.tests) < 2 or not self.optimum[-2]:
            return (
                f"Too few tests to tell: {int(self.feasible[-1])} of {n} are feasible, and half of "
                "the tests must have had some."
            )
        last = f"The last doubling, from {self.tests[-2]} to {n} tests,"
        (nearer, larger), pairs = self.gains(), zip(self.objectives, *self.best[-2:], strict=True)
        changes = [f"{o} from {number(a)} to {number(b)}" for o, a, b in pairs if a != b]
        unknown = (
            "Not known: whether there is a better region between the tests, and how right the "
            "model is."
        )
        if np.isnan(nearer):
            changed = f"changed {listed(changes)}" if changes else "did not change it"
            one = "One design is the best in every objective"
            return f"{one}, so that distances have no unit. {last} {changed}. {unknown}"
        still = max(nearer, larger - 2 * self.volume_error[-2]) > tolerance
        what = "still changed the decision by more than" if still else "changed the decision by"
        grown = f"by {percent(larger)}" if np.isfinite(larger) else "from nothing"
        moved = f", which moved by {percent(self.moved[-1])} of a range" if changes else ""
        return (
            f"{last} {what} {'' if still else 'less than '}{percent(tolerance)}: it brought the "
            f"best design {percent(nearer)} nearer to U{moved}, and enlarged the hypervolume "
            f"{grown}. {unknown}"
        )


def convergence(
    table: TestTable, limits: Limits | None = None, *, normalize: bool = True
) -> Convergence:
    """Return what a half, a quarter, … of the tests would have decided, in the order of testing.

    Args:
        table: The tests of an investigation.
        limits: Limits that a feasible design must keep.
        normalize: Measure distances in units of the objectives' ranges, as for ``table.ranking``.

    Raises:
        ArgumentValueError: There is no feasible design, or fewer than eight tests; or the first
            ones are no smaller investigation within the same bounds, see :func:`even_part`.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 64)
        >>> convergence(table).pareto
        array([ 6, 12, 18, 36])
    """
    table, _ = even_part(table, ordered=True)
    if len(table) < _LEAST:
        raise invalid(
            "the table", f"of {_LEAST} tests or more", Received(counted(len(table), "test"))
        )
    ranking = table.ranking(limits, normalize=normalize)
    frame = ranking.frame
    scaled = UtopianFrame(frame.ideal, frame.nadir, True).scaled(table.F)
    sizes = [len(table)]
    while sizes[-1] // 2 >= _LEAST:
        sizes.append(sizes[-1] // 2)
    feasible, fronts, bests = [], [], []
    for n in reversed(sizes):
        first = table.rows(np.arange(n))
        feasible.append(int(first.feasible(limits).sum()))
        fronts.append(front := np.flatnonzero(first.pareto(limits)))
        if len(front):
            best = first.ranking(limits, normalize=normalize).salukvadze[0]
        bests.append(int(front[best]) if len(front) else -1)
    optima, known = np.array(bests), np.array(bests) >= 0
    shares = [hypervolume(scaled[front], _REFERENCE) for front in fronts]
    volumes, errors = np.array(shares).T / (shares[-1][0] or 1.0)
    mu1 = np.where(known, frame.distances(table.F[optima])[:, 0], np.inf)
    steps = np.abs(np.diff(scaled[optima], axis=0)).max(axis=1)
    moved = np.append(np.nan, np.where(known[:-1], steps, np.nan))
    if not frame.line.any():
        mu1, volumes, moved = np.full((3, len(sizes)), np.nan)
    return Convergence(
        tests=np.array(sizes[::-1]),
        feasible=np.array(feasible),
        pareto=np.array([len(front) for front in fronts]),
        hypervolume=volumes,
        volume_error=errors,
        optimum=np.where(known, table.numbers[optima], 0),
        mu1=mu1,
        moved=moved,
        best=np.where(known[:, None], table.F[optima] * table.layout.sign, np.nan),
        objectives=table.layout.objectives,
    )
