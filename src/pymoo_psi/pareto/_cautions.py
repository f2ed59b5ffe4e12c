"""Reasons not to rely on the Salukvadze optimum of a ranking.

The optimum is the design nearest to the ideal point. That is advice only as far as nearness
discriminates between designs, and as the point and the ranges do not depend on a single design.
Each check here is one such condition.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import instance
from pymoo_psi.pareto._dominance import nondominated
from pymoo_psi.pareto._ranking import EfficiencyRanking, UtopianFrame, front_of
from pymoo_psi.pareto._rounding import settled, unit_lengths
from pymoo_psi.pareto._sentences import capital, listed, number, percent, sentence

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

NEAR = 0.01
"""Distances within 1 % of the least are as good as it: models seldom know more of a design."""

ELSEWHERE = 0.1
"""Designs that differ by more than a tenth of a range in some objective are different choices.

On a straight front the designs within ``NEAR`` of the optimum differ from it by 7 % of a range at
most, so that a near tie beyond a tenth means a front that is curved or in pieces.
"""

EDGE = 0.01
"""Within 1 % of its range from the best or the worst, an objective is at its edge."""

OUTWEIGHED = 10.0
"""Of ranges that differ by this factor, the smaller adds 1 % at most to a plain distance."""

OUTLIER = 2.0
"""A design that doubles a range lies farther from all others than they from each other."""

_FEW = 20  # of fewer designs many may have a rank, and all can be looked at
_ROUNDING = 1e-9  # distances closer than this are equal, see _explanation.py


class Caution(NamedTuple):
    """One reason not to rely on the optimum of a ranking without a second look.

    Attributes:
        kind: ``"alone"``, ``"constant"``, ``"redundant"``, ``"scale"``, ``"equidistant"``,
            ``"tie"``, ``"near tie"``, ``"extreme"``, ``"edge"``, ``"outlier"``, ``"unstable"`` or
            ``"unselective"``; see :func:`cautions`.
        sentence: What is the case, in one sentence.

    Example:
        >>> print(Caution("tie", "A and B are equally near."))
        A and B are equally near.
    """

    kind: str
    sentence: str

    def __str__(self) -> str:
        """Return the sentence."""
        return self.sentence


@np.errstate(over="ignore", invalid="ignore")  # a dominated design may be infinitely far
def cautions(ranking: EfficiencyRanking) -> tuple[Caution, ...]:
    """Return the reasons not to rely on the Salukvadze optimum of a ranking.

    =============== ============================================================================
    kind            what is the case
    =============== ============================================================================
    ``alone``       All Pareto-optimal designs are the same one: there is nothing to weigh.
    ``constant``    Objectives are equal for all Pareto-optimal designs.
    ``redundant``   Objectives agree to within 1 % of their ranges, and so count more than once.
    ``scale``       Without normalising, a range is at least 10 times another, which then decides
                    nothing.
    ``equidistant`` More than half of the designs, over half of a range, are within 1 % of the
                    least distance to the ideal point, as on a sphere around it.
    ``tie``         Several designs that differ by more than 1 % of a range are the optimum.
    ``near tie``    A design that differs by more than a tenth of a range is at most 1 % farther.
    ``extreme``     The optimum is worst in an objective, within 1 % of its range: it is no
                    compromise. The set bulges away from the ideal point.
    ``edge``        The optimum is best in an objective, as above: the set may extend further.
    ``outlier``     Without a single other design that more than doubles a range, the optimum would
                    be elsewhere, by more than a tenth of a range.
    ``unstable``    The same, without such a range.
    ``unselective`` More than half of the designs have a rank.
    =============== ============================================================================

    ``tie`` to ``unstable`` are left out for sets that are ``equidistant``, where all of them hold.
    Leaving out a design means to rank the others anew, those that it dominated among them. Left out
    in turn are the designs that are alone the best or the worst in an objective, but for the
    optimum itself. In a Pareto set no other can move the optimum; beside dominated designs one
    other can, and is not tried: the only one that dominates a design which lies beyond N.

    Args:
        ranking: Of any designs, from :func:`pymoo_psi.rank_of_efficiency`.

    Returns:
        The cautions in the order above; none if the choice is clear.

    Raises:
        ArgumentTypeError: ``ranking`` is no ranking.

    Example:
        >>> from pymoo_psi import rank_of_efficiency
        >>> F = [[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]
        >>> cautions(rank_of_efficiency(F))
        ()
        >>> for caution in cautions(rank_of_efficiency([*F, [0.1, 0.7], [-0.1, 90.0]])):
        ...     print(caution)
        Design 4 alone stretches the range of f2 90 times; without it the optimum would be design 1,
        which differs by 60 % of the range in f2.
    """
    instance("ranking", ranking, EfficiencyRanking)
    front = _Front.of(ranking)
    if front.varying.any():
        return tuple(front.cautions())
    # One design, or one objective, is nothing to be weighed from the start.
    if 1 in ranking.objectives.values.shape:
        return ()
    kind = "alike" if len(front.rows) > 1 else "alone"
    return (Caution("alone", sentence(kind, count=len(front.rows))),)


@dataclass(frozen=True, eq=False)
class _Front:
    """The Pareto-optimal designs of a ranking.

    Attributes:
        ranking: The ranking.
        rows: ``(n,)`` which designs they are.
        values: ``(n, m)`` their objectives, minimised; those equal up to rounding are the same.
        d: ``(n, m)`` distances from the best in units of the ranges; 0 in a constant objective.
        mu: ``(n,)`` distances to the ideal point, as they were ranked.
        best: The positions of the Salukvadze optimum among the rows.
    """

    ranking: EfficiencyRanking
    rows: Rows
    values: Array
    d: Array
    mu: Array
    best: Rows

    @classmethod
    def of(cls, ranking: EfficiencyRanking) -> _Front:
        rows, values = front_of(ranking)
        low = values.min(axis=0)
        d = (values - low) / unit_lengths(low, values.max(axis=0))
        best = np.searchsorted(rows, ranking.salukvadze)
        return cls(ranking, rows, values, d, ranking.criteria[rows, 0], best)

    @property
    def varying(self) -> NDArray[np.bool_]:
        """``(m,)`` which objectives are not constant."""
        return np.asarray(self.d.any(axis=0))

    def cautions(self) -> Iterator[Caution]:
        yield from self.weights()
        near = self.mu <= self.mu[self.best[0]] * (1 + NEAR)
        n, k = len(self.rows), int(near.sum())
        # More than half of the designs, and from all over the set; not two ends that tie.
        if k >= 3 and 2 * k > n and np.ptp(self.d[near], axis=0).max() > 0.5:
            yield self.caution("equidistant", near=k, count=n)
        else:
            yield from self.ties(np.flatnonzero(near))
            if n >= 3:  # of two designs each is an extreme
                yield from self.extremes()
            yield from self.dependence()
        ranked = int((self.ranking.rank[self.rows] > 0).sum())
        if n >= _FEW and 2 * ranked > n:
            yield self.caution("unselective", ranked=ranked, count=n)

    def weights(self) -> Iterator[Caution]:
        """Objectives that count for nothing, or more than others."""
        varying = np.flatnonzero(self.varying)
        if len(equal := np.flatnonzero(~self.varying)):
            yield self.caution("constant", objectives=self.names(equal))
        left, groups = varying, []
        while len(left):
            apart = np.abs(self.d[:, left] - self.d[:, left[:1]]).max(axis=0)
            if (same := apart <= EDGE).sum() > 1:
                groups.append(self.names(left[same]))
            left = left[~same]
        if groups and len(self.rows) > 2:  # of two designs any two are the same or opposite
            yield self.caution("redundant", groups="; ".join(groups))
        ranges = np.ptp(self.values, axis=0)
        most, least = (int(varying[pick(ranges[varying])]) for pick in (np.argmax, np.argmin))
        if not self.ranking.frame.normalize and ranges[most] >= OUTWEIGHED * ranges[least]:
            yield self.caution(
                "scale",
                objective=self.name(most),
                range=number(ranges[most], 3),
                other=self.name(least),
                least=number(ranges[least], 3),
            )

    def ties(self, near: Rows) -> Iterator[Caution]:
        """Other designs as near to the ideal point as the optimum, or nearly."""
        apart = np.abs(self.d - self.d[self.best[0]]).max(axis=1)
        different = self.best[apart[self.best] > EDGE]
        if len(different):
            others = [self.design(different[0])]
            others += [f"{len(different) - 1} more"] if len(different) > 1 else []
            first = capital(self.design(self.best[0]))
            yield self.caution("tie", design=first, others=listed(others))
        near = np.setdiff1d(near, self.best)
        near = near[apart[near] > ELSEWHERE]
        if len(near):
            i = int(near[self.mu[near].argmin()])
            yield Caution(
                "near tie",
                sentence(
                    "near tie" if len(near) == 1 else "near ties",
                    design=capital(self.design(i)),
                    count=len(near),
                    farther=percent(self.mu[i] / self.mu[self.best[0]] - 1),
                    share=percent(apart[i]),
                    objective=self.name(int(np.abs(self.d[i] - self.d[self.best[0]]).argmax())),
                ),
            )

    def extremes(self) -> Iterator[Caution]:
        """Objectives in which the optimum is the worst or the best."""
        own = self.d[self.best[0]]
        if len(worst := np.flatnonzero(own >= 1 - EDGE)):
            template = "extreme" if self.ranking.frame.normalize else "plain extreme"
            yield Caution("extreme", sentence(template, objectives=self.names(worst)))
        if len(best := np.flatnonzero(self.varying & (own <= EDGE))):
            yield self.caution("edge", objectives=self.names(best))

    def dependence(self) -> Iterator[Caution]:
        """The single design without which the optimum would move farthest."""
        roles: dict[int, tuple[str, int]] = {}
        for j in np.flatnonzero(self.varying).tolist():
            for role, share in (("best", 0.0), ("worst", 1.0)):
                at = np.flatnonzero(self.d[:, j] == share)
                if len(at) == 1 and at[0] not in self.best:  # of two the other one stays
                    roles.setdefault(int(at[0]), (role, j))
        moves = [self.without(i, *role) for i, role in roles.items()]
        moved, caution = max(moves, key=lambda move: move[0], default=(0.0, None))
        if caution is not None and moved > ELSEWHERE:
            yield caution

    def without(self, i: int, role: str, extreme: int) -> tuple[float, Caution]:
        """Return how far the optimum moves without a design, and the caution about it."""
        objectives, frame = self.ranking.objectives, self.ranking.frame
        rows, values = np.delete(self.rows, i), np.delete(self.values, i, axis=0)
        dominated = np.flatnonzero(~self.ranking.pareto)
        F = objectives.values[dominated] * objectives.sign
        freed = (self.values[i] <= F).all(axis=1)
        if freed.any():  # what it dominates may be Pareto optimal without it
            rows = np.concatenate([rows, dominated[freed]])
            values = settled(np.vstack([values, F[freed]]))
            optimal = nondominated(values)
            rows, values = rows[optimal], values[optimal]
        # A point that the user has set stays.
        low, high = values.min(axis=0), values.max(axis=0)
        U = np.where(frame.ideal == self.values.min(axis=0), low, frame.ideal)
        N = np.where(frame.nadir == self.values.max(axis=0), high, frame.nadir)
        mu = UtopianFrame(U, N, frame.normalize).measured(values)[0][:, 0]
        new = np.flatnonzero(mu <= mu.min() * (1 + _ROUNDING))
        lengths = unit_lengths(low, high)
        steps = np.abs(values[new, None] - self.values[self.best]) / lengths
        if np.isin(rows[new], self.rows[self.best]).any():
            steps[:] = 0.0
        moved = steps.max(axis=2)
        k, b = np.unravel_index(moved.argmin(), moved.shape)
        stretched = np.ptp(self.values, axis=0) / lengths  # of a constant objective 0
        most = int(stretched.argmax())
        outlier = stretched[most] >= OUTLIER
        text = sentence(
            "outlier" if outlier else f"{role} unstable",
            design=capital(self.design(i)) if outlier else self.design(i),
            stretched=self.name(most),
            times=number(stretched[most], 3),
            extreme=self.name(extreme),
            other=self.ranking.name_of(int(rows[new[k]])),
            share=percent(moved[k, b]),
            objective=self.name(int(steps[k, b].argmax())),
        )
        return float(moved[k, b]), Caution("outlier" if outlier else "unstable", text)

    def caution(self, kind: str, **values: object) -> Caution:
        return Caution(kind, sentence(kind, **values))

    def design(self, i: int) -> str:
        return self.ranking.name_of(int(self.rows[i]))

    def name(self, j: int) -> str:
        return str(self.ranking.objectives.names[j])

    def names(self, columns: Rows) -> str:
        return listed([self.name(j) for j in columns.tolist()])
