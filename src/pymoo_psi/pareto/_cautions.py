"""What speaks against relying on the Salukvadze optimum of a ranking.

The optimum is the design nearest to the ideal point. That is advice only as far as nearness tells
designs apart, and as the point and the ranges do not hang on a single design. Each check here is
one such condition.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import instance
from pymoo_psi.pareto._dominance import nondominated
from pymoo_psi.pareto._ranking import EfficiencyRanking, UtopianFrame, front_of
from pymoo_psi.pareto._rounding import settled, unit_lengths
from pymoo_psi.pareto._sentences import capital, label, listed, number, percent

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

NEAR = 0.01
"""Distances within 1 % of the least are as good as it: models seldom know more of a design."""

ELSEWHERE = 0.1
"""Designs that differ by more than a tenth of a range in some criterion are different choices.

On a straight front the designs within ``NEAR`` of the optimum differ from it by 7 % of a range at
most, so that a near tie beyond a tenth tells of a front that is curved or in pieces.
"""

EDGE = 0.01
"""Within 1 % of its range from the best or the worst, a criterion is at its edge."""

OUTWEIGHED = 10.0
"""Of ranges that differ by this factor, the smaller adds 1 % at most to a plain distance."""

OUTLIER = 2.0
"""A design that doubles a range lies farther from all others than they from each other."""

_FEW = 20  # of fewer designs many may have a rank, and all can be looked at
_NEARLY = ", to within 1 % of the range"
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
    """Say what speaks against relying on the Salukvadze optimum of a ranking.

    =============== ============================================================================
    kind            what is the case
    =============== ============================================================================
    ``alone``       All Pareto-optimal designs are the same one: there is nothing to weigh.
    ``constant``    Criteria are equal for all Pareto-optimal designs.
    ``redundant``   Criteria agree to within 1 % of their ranges, and so count more than once.
    ``scale``       Without normalising, a range is at least 10 times another, which then decides
                    nothing.
    ``equidistant`` More than half of the designs, over half of a range, are within 1 % of the
                    least distance to the ideal point, as on a sphere around it.
    ``tie``         Several designs that differ by more than 1 % of a range are the optimum.
    ``near tie``    A design that differs by more than a tenth of a range is at most 1 % farther.
    ``extreme``     The optimum is worst in a criterion, within 1 % of its range: it is no
                    compromise. The set bulges away from the ideal point.
    ``edge``        The optimum is best in a criterion, likewise: nobody knows what comes beyond.
    ``outlier``     Without a single other design that more than doubles a range, the optimum would
                    be elsewhere, by more than a tenth of a range.
    ``unstable``    The same, without such a range.
    ``unselective`` More than half of the designs have a rank.
    =============== ============================================================================

    ``tie`` to ``unstable`` are not told of sets that are ``equidistant``, where all of them hold.
    Leaving out a design means to rank the others anew, those that it dominated among them. Left out
    in turn are the designs that are alone the best or the worst in a criterion, but for the optimum
    itself. In a Pareto set no other can move the optimum; beside dominated designs one other can,
    and is not tried: the only one that dominates a design which lies beyond N.

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
    if not front.d.any():
        # One design, or one criterion, is nothing to be weighed from the start.
        expected = 1 in ranking.objectives.values.shape
        return () if expected else (Caution("alone", front.alone()),)
    told = {
        "constant": front.constant(),
        "redundant": front.redundant(),
        "scale": front.scale(),
        "equidistant": front.equidistant(),
    }
    if not told["equidistant"]:
        told |= {"tie": front.tie(), "near tie": front.near_tie(), "extreme": front.extreme()}
        told |= {"edge": front.edge(), **front.hanging()}
    told["unselective"] = front.unselective()
    return tuple(Caution(kind, sentence) for kind, sentence in told.items() if sentence)


@dataclass(frozen=True, eq=False)
class _Front:
    """The Pareto-optimal designs of a ranking.

    Attributes:
        ranking: The ranking.
        rows: ``(n,)`` which designs they are.
        values: ``(n, m)`` their objectives, minimised; those equal up to rounding are the same.
        d: ``(n, m)`` distances from the best in units of the ranges; 0 in a constant criterion.
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

    def alone(self) -> str:
        if len(self.rows) > 1:
            return f"All {len(self.rows)} Pareto-optimal designs have the same values."
        return "Only one design is Pareto optimal: the criteria do not conflict."

    def constant(self) -> str:
        equal = np.flatnonzero(~self.d.any(axis=0))
        if not len(equal):
            return ""
        return f"Equal for all Pareto-optimal designs, and without weight: {self._names(equal)}."

    def redundant(self) -> str:
        if len(self.rows) < 3:  # of two designs any two criteria are the same or opposite
            return ""
        left, groups = np.flatnonzero(self.d.any(axis=0)), []
        while len(left):
            apart = np.abs(self.d[:, left] - self.d[:, left[:1]]).max(axis=0)
            if (same := apart <= EDGE).sum() > 1:
                groups.append(self._names(left[same]))
            left = left[~same]
        if not groups:
            return ""
        return (
            f"Criteria that agree to within 1 % of their ranges, and so count more than once: "
            f"{'; '.join(groups)}."
        )

    def scale(self) -> str:
        ranges = np.ptp(self.values, axis=0)
        varying = np.flatnonzero(self.d.any(axis=0))
        most, least = (varying[pick(ranges[varying])] for pick in (np.argmax, np.argmin))
        if self.ranking.frame.normalize or ranges[most] < OUTWEIGHED * ranges[least]:
            return ""
        return (
            f"Without normalising, {self._name(most)} with a range of {number(ranges[most], 3)} "
            f"outweighs {self._name(least)} with one of {number(ranges[least], 3)}."
        )

    def equidistant(self) -> str:
        near = self.mu <= self.mu[self.best[0]] * (1 + NEAR)
        # More than half of the designs, and from all over the set.
        spread = np.ptp(self.d[near], axis=0).max() > 0.5
        if near.sum() < 3 or 2 * near.sum() <= len(near) or not spread:  # two ends only tie
            return ""
        return (
            f"{near.sum()} of {len(self.rows)} Pareto-optimal designs are within 1 % of the least "
            f"distance to the ideal point, as on a sphere around it: a preference must choose."
        )

    def tie(self) -> str:
        different = [i for i in self.best.tolist() if self._apart(i)[0] > EDGE]
        if not different:
            return ""
        first, other = (self._label(i) for i in (self.best[0], different[0]))
        more = f" and {len(different) - 1} more" if len(different) > 1 else ""
        return f"{capital(first)} is as near to the ideal point as {other}{more}."

    def near_tie(self) -> str:
        least = self.mu[self.best[0]]
        near = np.setdiff1d(np.flatnonzero(self.mu <= least * (1 + NEAR)), self.best)
        apart = np.abs(self.d[near] - self.d[self.best[0]])
        near = near[apart.max(axis=1) > ELSEWHERE]
        if not len(near):
            return ""
        other = int(near[self.mu[near].argmin()])
        more = f", one of {len(near)} such designs," if len(near) > 1 else ""
        share, j = self._apart(other)
        farther = percent(self.mu[other] / least - 1)
        only = "" if farther.startswith("less") else "only "
        return (
            f"{capital(self._label(other))}{more} is {only}{farther} farther from the ideal "
            f"point, and differs by {percent(share)} of the range in {self._name(j)}."
        )

    def extreme(self) -> str:
        worst = np.flatnonzero(self.d[self.best[0]] >= 1 - EDGE)
        if not len(worst) or len(self.rows) < 3:  # of two designs each is an extreme
            return ""
        exact = bool((self.d[self.best[0], worst] == 1).all())
        text = f"The optimum is the worst in {self._names(worst)}{'' if exact else _NEARLY}"
        if not self.ranking.frame.normalize:
            return f"{text}: it is no compromise."
        return (
            f"{text}: the set bulges away from the ideal point, so that no compromise is nearer to "
            f"it than the extreme designs."
        )

    def edge(self) -> str:
        shares, varying = self.d[self.best[0]], self.d.any(axis=0)
        best = np.flatnonzero(varying & (shares <= EDGE))
        if not len(best) or len(self.rows) < 3:
            return ""
        nearly = _NEARLY if shares[best].any() else ""
        text = f"The optimum is the best in {self._names(best)}{nearly}"
        return f"{text}: it lies at an edge of the set."

    def hanging(self) -> dict[str, str]:
        """Return the kind of the single design on which the optimum hangs most, with a sentence."""
        roles: dict[int, str] = {}
        for j in np.flatnonzero(self.d.any(axis=0)).tolist():
            for role, share in (("best", 0.0), ("worst", 1.0)):
                at = np.flatnonzero(self.d[:, j] == share)
                if len(at) == 1 and at[0] not in self.best:  # of two the other one stays
                    roles.setdefault(int(at[0]), f"the {role} in {self._name(j)}")
        without = [self._without(i, role) for i, role in roles.items()]
        moved, caution = max(without, key=lambda found: found[0], default=(0.0, {}))
        return caution if moved > ELSEWHERE else {}

    def _without(self, left_out: int, role: str) -> tuple[float, dict[str, str]]:
        """Return how far the optimum moves without a design, and the kind and sentence to tell."""
        objectives, frame = self.ranking.objectives, self.ranking.frame
        rows, values = np.delete(self.rows, left_out), np.delete(self.values, left_out, axis=0)
        dominated = np.flatnonzero(~self.ranking.pareto)
        F = objectives.values[dominated] * objectives.sign
        freed = (self.values[left_out] <= F).all(axis=1)
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
        j = int(steps[k, b].argmax())
        there = (
            f"{label(self.ranking, int(rows[new[k]]))}, which differs by "
            f"{percent(steps[k, b, j])} of the range in {self._name(j)}"
        )
        stretched = np.ptp(self.values, axis=0) / np.where(np.isinf(lengths), np.nan, lengths)
        who = capital(self._label(left_out))
        if np.nanmax(stretched, initial=0.0) >= OUTLIER:
            j = int(np.nanargmax(stretched))
            text = (
                f"{who} alone stretches the range of {self._name(j)} {number(stretched[j], 3)} "
                f"times; without it the optimum would be {there}."
            )
            return float(moved[k, b]), {"outlier": text}
        text = f"Without {self._label(left_out)}, {role}, the optimum would be {there}."
        return float(moved[k, b]), {"unstable": text}

    def unselective(self) -> str:
        ranked = int((self.ranking.rank[self.rows] > 0).sum())
        if len(self.rows) < _FEW or 2 * ranked <= len(self.rows):
            return ""
        return (
            f"{ranked} of {len(self.rows)} Pareto-optimal designs have a rank: ranks select little."
        )

    def _apart(self, i: int) -> tuple[float, int]:
        """Return by what share of a range a design differs most from the optimum, and in what."""
        apart = np.abs(self.d[i] - self.d[self.best[0]])
        return float(apart.max()), int(apart.argmax())

    def _label(self, i: int) -> str:
        return label(self.ranking, int(self.rows[i]))

    def _name(self, j: int) -> str:
        return str(self.ranking.objectives.names[j])

    def _names(self, columns: NDArray[np.intp]) -> str:
        return listed([self._name(j) for j in columns.tolist()])
