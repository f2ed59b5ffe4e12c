"""Convergence of the decision with the number of tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._numbers import percent
from pymoo_psi._output import Shown
from pymoo_psi._validation import Array, Integers, Received, counted, invalid
from pymoo_psi.analysis._sampling import even_part
from pymoo_psi.pareto import UtopianFrame, hypervolume
from pymoo_psi.table import TestTable

if TYPE_CHECKING:
    import pandas as pd

_FIRST = 8  # tests of the first row of a convergence; fewer have no front to speak of
# The reference point of the hypervolume, in units of the last front's range: a little beyond its
# worst values, so that the designs at its ends count, too.
_REFERENCE = 1.1
# The least gain for which the other half of the tests is worth it: the share of μ1 by which the
# best design came nearer, or the share of the last hypervolume that the first half lacks.
_WORTH = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class Convergence(Shown):
    """The decision that the first n tests give; n doubles from row to row up to all tests.

    Distances use the scale of all tests, so that rows can be compared. If one design is the best in
    every objective, there is no scale, and ``mu1``, ``hypervolume`` and ``moved`` are NaN.

    Attributes:
        tests: ``(k,)`` numbers n of tests, increasing.
        feasible: ``(k,)`` how many are feasible.
        pareto: ``(k,)`` how many of these are Pareto optimal among the first n.
        hypervolume: ``(k,)`` what their front dominates, as a share of what the last one does.
        volume_error: ``(k,)`` standard error of that share; 0 where it is exact.
        optimum: ``(k,)`` the test nearest to U by the ranking of the first n; 0 where no
            design is feasible.
        mu1: ``(k,)`` its distance to the U of all tests; infinite where there is none.
        moved: ``(k,)`` how far it is from the optimum of the row before: the largest difference in
            an objective, in units of the objective's range over the last front; NaN if there was
            none.
        best: ``(k, m)`` its objectives, in the original directions; NaN where there is none.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
        >>> steps = convergence(table.under(normalize=False))
        >>> steps.tests[-4:], steps.optimum[-4:]
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

    def __repr__(self) -> str:
        """Return how many tests there are, and what they decide."""
        return f"Convergence({self.tests[-1]} tests: the best is no. {self.optimum[-1]})"

    def to_frame(self) -> pd.DataFrame:
        """Return a frame with the index ``tests`` and a column for each other array.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> steps = convergence(investigate(VectorizedSphereChute(0.4, model="rolling"), 64))
            >>> print(steps.to_frame()[["pareto", "optimum", "mu1"]].round(2))
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

    def verdict(self) -> str:
        """Return a sentence on what the last doubling of the tests changed in the decision.

        The effect of the next doubling is not predicted, because no such estimate proved reliable
        on problems with known solutions.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
            >>> print(convergence(table.under(normalize=False)).verdict())
            The last doubling, from 512 to 1024 tests, still mattered: it brought ...
        """
        n = int(self.tests[-1])
        if len(self.tests) < 2 or not self.optimum[-2]:
            return (
                f"Too few tests to tell: {int(self.feasible[-1])} of {n} are feasible, and half of "
                "the tests must have had some."
            )
        doubling = f"The last doubling, from {self.tests[-2]} to {n} tests,"
        unknown = (
            "Not known: whether there is a better region between the tests, and how right the "
            "model is."
        )
        if np.isnan(self.moved[-1]):  # distances have no unit
            is_same = np.array_equal(self.best[-1], self.best[-2])
            change = "nothing" if is_same else "the design that is the best in every objective"
            return f"{doubling} changed {change}. {unknown}"
        before, now = self.mu1[-2:].tolist()
        nearer = max(0.0, before - now) / (before or 1.0)
        share = self.hypervolume[-2]
        mattered = "hardly mattered"
        if max(nearer, 1 - share - 2 * self.volume_error[-2]) > _WORTH:
            mattered = "still mattered"
        return (
            f"{doubling} {mattered}: it brought the best design {percent(nearer)} nearer to the "
            f"ideal point, moved it by {percent(self.moved[-1])} of a range, and enlarged the "
            f"hypervolume from {percent(share)} of its present value. {unknown}"
        )


def convergence(table: TestTable) -> Convergence:
    """Return the decisions that the first half, quarter, … of the tests give.

    Args:
        table: The tests of an investigation.

    Raises:
        ArgumentValueError: There is no feasible design, there are fewer than eight tests, or an
            algorithm has chosen them, see :func:`even_part`.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 64)
        >>> convergence(table).pareto
        array([ 6, 12, 18, 36])
    """
    table, _ = even_part(table)
    if len(table) < _FIRST:
        received = Received(counted(len(table), "test"))
        raise invalid("the table", f"of {_FIRST} tests or more", received, "test more points")
    # What the first n tests decide, n doubling: their front, and their optimum or -1.
    n_sizes = (len(table) // _FIRST).bit_length()
    sizes = len(table) >> np.arange(n_sizes)[::-1]
    fronts = []
    optima = []
    for n in sizes:
        first = table.take(np.arange(n))
        fronts.append(np.flatnonzero(first.pareto()))
        optima.append(-1)
        if len(fronts[-1]):
            ranking = first.ranking()
            optima[-1] = int(ranking.rows[ranking.salukvadze[0]])
    # Measured in the units of the ranking of all tests; no optimum has NaN for its objectives.
    frame = table.ranking().frame
    scale = UtopianFrame(frame.ideal, frame.nadir, True)
    best = np.insert(table.F, len(table), np.nan, axis=0)[optima]
    mu1 = frame.distances(best)[:, 0]
    moved = np.abs(np.diff(scale.scaled(best), axis=0, prepend=np.nan)).max(axis=1)
    pairs = [hypervolume(scale.scaled(table.F[front]), _REFERENCE) for front in fronts]
    volumes, errors = np.array(pairs).T / (pairs[-1][0] or 1.0)
    if not frame.line.any():  # one design is the best in every objective
        mu1, volumes, moved = np.full((3, len(sizes)), np.nan)
    return Convergence(
        tests=sizes,
        feasible=np.cumsum(table.feasible())[sizes - 1],
        pareto=np.array([*map(len, fronts)]),
        hypervolume=volumes,
        volume_error=errors,
        optimum=np.append(table.numbers, 0)[optima],
        mu1=mu1,
        moved=moved,
        best=best * table.schema.sign,
    )
