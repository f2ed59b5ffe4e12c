"""How good an investigation is, and whether more tests are likely to change the decision."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._output import Shown
from pymoo_psi._validation import Received, counted, instance, invalid, positive_number
from pymoo_psi.pareto import UtopianFrame, hypervolume
from pymoo_psi.sequences import covering_radius
from pymoo_psi.table._layout import Limits
from pymoo_psi.table._table import TestTable

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_LEAST = 8  # tests of the first row; fewer have no front to speak of
# Doublings that an estimate is made of: a single one brings nothing every second time, by luck.
_DOUBLINGS = 3
# Of the hypervolume, in units of the last front's range: a little beyond its worst values, so that
# the designs at its ends count, too.
_REFERENCE = 1.1


@dataclass(frozen=True, eq=False, repr=False)
class Convergence(Shown):
    """What the first n tests would have decided, n doubling from row to row up to all of them.

    Distances are those of the ranking of all tests, so that rows can be compared.

    Attributes:
        tests: ``(k,)`` numbers n of tests, increasing.
        feasible: ``(k,)`` how many are feasible.
        pareto: ``(k,)`` how many of these are Pareto optimal among the first n.
        hypervolume: ``(k,)`` what their front dominates, as a share of what the last one does.
        optimum: ``(k,)`` the test point nearest to U by the ranking of the first n; 0 where no
            design is feasible.
        mu1: ``(k,)`` its distance to the U of all tests; infinite where there is none.
        moved: ``(k,)`` how far it lies from that of the row before: the largest difference in an
            objective, in units of the objective's range over the last front; NaN where there was
            none before.
        covering_radius: ``(k,)`` :func:`pymoo_psi.sequences.covering_radius` of the first n
            designs within the bounds, scaled to 1; NaN if these are not known.
        dimension: How many variables the tests vary.

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
    optimum: Integers
    mu1: Array
    moved: Array
    covering_radius: Array
    dimension: int

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

        columns = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "dimension"}
        return pd.DataFrame(columns).set_index("tests")

    def gains(self) -> tuple[float, float]:
        """Estimate what twice as many tests would bring.

        The n points of a sequence come as near to any place of d dimensions as n^(-1/d). If what
        is still missing shrinks like that, e(n) = c n^(-1/d), the last three doublings, which
        brought e(n/8) − e(n), tell c, and the next one brings e(n) − e(2n).

        Returns:
            By what share of its μ1 the best design would come nearer to U, and by what share the
            hypervolume would grow; NaN if there are no three doublings with feasible designs.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
            >>> nearer, larger = convergence(table, normalize=False).gains()
            >>> round(nearer, 3), round(larger, 3)
            (0.041, 0.01)
        """
        if len(self.tests) <= _DOUBLINGS or not np.isfinite(self.mu1[-1 - _DOUBLINGS]):
            return float("nan"), float("nan")
        ratio = 2.0 ** (-1.0 / max(self.dimension, 1))  # e(2n) / e(n)
        share = (1 - ratio) / (ratio**-_DOUBLINGS - 1)
        mu1, volume = self.mu1, self.hypervolume
        nearer = max(mu1[-1 - _DOUBLINGS] - mu1[-1], 0.0)  # a choice may have been luckier before
        larger = volume[-1] - volume[-1 - _DOUBLINGS]
        # With μ1 = 0 the best design is U itself, and a front of one design has no volume.
        return (
            float(share * nearer / mu1[-1]) if nearer else 0.0,
            float(share * larger / volume[-1]) if larger else 0.0,
        )

    def verdict(self, *, tolerance: float = 0.01) -> str:
        """Say whether more tests are likely to change the decision, why, and what is not known.

        Args:
            tolerance: What share of its μ1 the best design must come nearer, or of itself the
                hypervolume must grow, to be worth twice as many tests.

        Raises:
            ArgumentValueError: ``tolerance`` is not above 0.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
            >>> print(convergence(table, normalize=False).verdict())
            More tests are likely to change the decision: as the last 3 doublings went, 2048 ...
        """
        tolerance = positive_number("tolerance", tolerance)
        n, nearer, larger = int(self.tests[-1]), *self.gains()
        if np.isnan(nearer):
            return (
                f"Too few tests to tell: {int(self.feasible[-1])} of {n} are feasible, and the "
                f"last {_DOUBLINGS} doublings of their number must each have had some."
            )
        likely = "likely" if max(nearer, larger) > tolerance else "unlikely"
        since = int(self.tests[-1 - _DOUBLINGS])
        changes = int(np.count_nonzero(np.diff(self.optimum[-1 - _DOUBLINGS :])))
        moved = f", in the last doubling by {100 * self.moved[-1]:.0f} % of a criterion's range"
        last = moved if changes else ""
        gain, volume, worth = (f"{100 * share:.3g} %" for share in (nearer, larger, tolerance))
        lines = [
            f"More tests are {likely} to change the decision: as the last {_DOUBLINGS} doublings "
            f"went, {2 * n} instead of {n} would bring the best design {gain} nearer to U and "
            f"enlarge the hypervolume by {volume} (worth it from {worth} on).",
            f"From {since} to {n} tests the best design changed {_times(changes)}{last}.",
        ]
        if not changes:
            lines.append("That it did not change may be luck: look at the hypervolume.")
        radius = f" (radius {self.covering_radius[-1]:.2g} in bounds scaled to 1)"
        radius = "" if np.isnan(self.covering_radius[-1]) else radius  # without bounds
        lines.append(
            "Not known: whether there is a better region smaller than the holes between the "
            f"tests{radius}, and how right the model is."
        )
        return " ".join(lines)


def _times(count: int) -> str:
    return {0: "not at all", 1: "once", 2: "twice"}.get(count, f"{count} times")


def convergence(
    table: TestTable, limits: Limits | None = None, *, normalize: bool = True
) -> Convergence:
    """Return what a half, a quarter, … of the tests would have decided, in the order of testing.

    Args:
        table: The tests of an investigation.
        limits: Limits that a feasible design must keep.
        normalize: Measure distances in units of the objectives' ranges, as for ``table.ranking``.

    Raises:
        ArgumentValueError: There is no feasible design, fewer than eight tests, or tests of several
            experiments, whose first ones are no smaller investigation within the same bounds.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 64)
        >>> convergence(table).pareto
        array([ 6, 12, 18, 36])
    """
    if len(instance("table", table, TestTable)) < _LEAST:
        raise invalid(
            "the table", f"of {_LEAST} tests or more", Received(counted(len(table), "test"))
        )
    if len(names := [name for name, _ in table.layout.experiments]) > 1:
        raise invalid("the table", "of one experiment", Received(", ".join(names)))
    ranking = table.ranking(limits, normalize=normalize)
    frame = ranking.frame
    scaled = UtopianFrame(frame.ideal, frame.nadir, True).scaled(table.F)
    points = _unit_points(table)
    sizes = [len(table)]
    while sizes[-1] // 2 >= _LEAST:
        sizes.append(sizes[-1] // 2)
    feasible, fronts, bests, moved = [], [], [], []
    for n in reversed(sizes):
        first = table.rows(np.arange(n))
        feasible.append(int(first.feasible(limits).sum()))
        fronts.append(front := np.flatnonzero(first.pareto(limits)))
        known = len(front) > 0
        best = first.ranking(limits, normalize=normalize).salukvadze[0] if known else 0
        bests.append(int(front[best]) if known else -1)
        before = bests[-2] if len(bests) > 1 else -1
        step = np.abs(scaled[bests[-1]] - scaled[before]).max()
        moved.append(float(step) if known and before >= 0 else np.nan)
    volumes = np.array([hypervolume(scaled[front], _REFERENCE) for front in fronts])
    optima, tests = np.array(bests), np.array(sizes[::-1])
    mu1 = frame.distances(table.F[optima])[:, 0]
    radii = [covering_radius(points[:n]) if points.size else np.nan for n in tests]
    return Convergence(
        tests=tests,
        feasible=np.array(feasible),
        pareto=np.array([len(front) for front in fronts]),
        hypervolume=volumes / (volumes[-1] or 1.0),
        optimum=np.where(optima >= 0, table.numbers[optima], 0),
        mu1=np.where(optima >= 0, mu1, np.inf),
        moved=np.array(moved),
        covering_radius=np.array(radii),
        dimension=sum(len(set(column.tolist())) > 1 for column in table.X.T),
    )


def _unit_points(table: TestTable) -> Array:
    """Return ``(n, k)`` the designs by the variables that have bounds, these scaled to 0 and 1.

    Choices and binary variables have no distances, and fixed ones none to cover; k may be 0.
    """
    lower, upper = table.layout.lower, table.layout.upper
    wide = np.flatnonzero(upper > lower)  # False where NaN
    points = (table.X[:, wide].astype(np.float64) - lower[wide]) / (upper[wide] - lower[wide])
    return np.clip(points, 0.0, 1.0)
