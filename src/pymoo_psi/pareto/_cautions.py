"""Reasons not to rely on the Salukvadze optimum of a ranking.

The optimum is the design nearest to the ideal point. That is advice only as far as nearness
discriminates between designs, and as the point and the ranges do not depend on a single design.
Each check here is one such condition.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import counted
from pymoo_psi.pareto._dominance import nondominated, settled, unit_lengths
from pymoo_psi.pareto._ranking import EfficiencyRanking, UtopianFrame, front_of, ranking_from
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
"""Within 1 % of its range two values of an objective are alike."""

OUTWEIGHED = 10.0
"""Of ranges that differ by this factor, the smaller adds 1 % at most to a plain distance."""

OUTLIER = 2.0
"""A design that doubles a range lies farther from all others than they from each other."""

FAR = 10.0
"""A value farther from all others than ten times their range is no value of the same kind."""

_OTHERS = 4  # values that tell what is usual
_ROUNDING = 1e-9  # distances closer than this are equal, see _explanation.py


class Caution(NamedTuple):
    """One reason not to rely on the optimum of a ranking without a second look.

    Attributes:
        kind: ``"suspect"``, ``"sign"``, ``"unlike"``, ``"alone"``, ``"constant"``,
            ``"redundant"``, ``"scale"``, ``"equidistant"``, ``"tie"``, ``"near tie"``,
            ``"extreme"``, ``"edge"``, ``"outlier"`` or ``"unstable"``; see :func:`cautions`.
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
def cautions(
    F: Any, *, normalize: bool = True, maximize: Collection[Any] = ()
) -> tuple[Caution, ...]:
    """Return the reasons not to rely on the Salukvadze optimum, the gravest first.

    =============== ============================================================================
    kind            what is the case
    =============== ============================================================================
    ``suspect``     The optimum has a value unlike those of all other designs in an objective: ten
                    times their range away, in orders of magnitude, too, if all have one sign; or
                    such as programs write for failures (-9999, 1e30, -1 among positive ones) and
                    away from all others by their range.
    ``sign``        A maximised objective is nowhere above 0, as where its sign has been turned.
    ``unlike``      A Pareto-optimal design other than the optimum has such a value.
    ``alone``       All Pareto-optimal designs have the same values: there is nothing to weigh.
    ``constant``    Objectives are equal for all Pareto-optimal designs.
    ``redundant``   Objectives agree to within 1 % of their ranges, and so count more than once.
    ``scale``       Without normalising, a range is at least 10 times another, which then decides
                    nothing.
    ``equidistant`` More than half of the designs, over half of a range, are within 1 % of the
                    least distance to the ideal point, as on a sphere around it.
    ``tie``         Several designs that differ by more than 1 % of a range are the optimum.
    ``near tie``    A design that differs by more than a tenth of a range is at most 1 % farther.
    ``extreme``     The optimum is worst in an objective, within 1 % of its range: it is no
                    compromise. If normalised, the set bulges away from the ideal point.
    ``edge``        The optimum is best in an objective, as for ``extreme``: the set may extend
                    further.
    ``outlier``     Without a single other design that more than doubles a range, the optimum would
                    be elsewhere, by more than a tenth of a range.
    ``unstable``    The same, without such a range.
    =============== ============================================================================

    ``tie`` to ``unstable`` are left out for sets that are ``equidistant``, where all of them hold.
    Leaving out a design means to rank the others anew, those that it dominated among them. Left out
    in turn are the designs that are alone the best or the worst in an objective, but for the
    optimum itself. In a Pareto set no other can move the optimum; beside dominated designs one
    other can, and is not tried: the only one that dominates a design which lies beyond N.

    Args:
        F: A ranking, which has its own ``normalize`` and ``maximize``; or ``(n, m)`` objective
            values as for :func:`pymoo_psi.rank_of_efficiency`.
        normalize: As for :func:`pymoo_psi.rank_of_efficiency`.
        maximize: As for :func:`pymoo_psi.rank_of_efficiency`.

    Returns:
        The cautions in the order above; none if the choice is clear.

    Raises:
        ArgumentValueError: ``F`` or ``maximize`` does not fit.
        ArgumentTypeError: ``F`` does not hold real numbers.

    Example:
        >>> F = [[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]
        >>> cautions(F)
        ()
        >>> for caution in cautions([*F, [0.1, 0.7], [-0.1, 9.0]]):
        ...     print(caution)
        Design 4 alone stretches the range of f2 9 times; without it the optimum would be design 1,
        which differs by 60 % of the range in f2.
    """
    checks = _Checks(ranking_from(F, normalize, maximize))
    return (*checks.of_values(), *checks.of_objectives(), *checks.of_optimum())


def _caution(kind: str, **values: object) -> Caution:
    return Caution(kind, sentence(kind, **values))


class _Checks:
    """The checks of a ranking, in the order of the table.

    Attributes:
        rows: ``(k,)`` the Pareto-optimal designs.
        values: ``(k, m)`` their objectives, minimised.
        d: ``(k, m)`` the same in units of the ranges, from 0 to 1; 0 in a constant objective.
        best: Which of them are the optimum.
    """

    def __init__(self, ranking: EfficiencyRanking) -> None:
        self.ranking = ranking
        self.names = np.array([str(name) for name in ranking.objectives.names], dtype=object)
        self.rows, self.values = front_of(ranking)
        low, high = self.values.min(axis=0), self.values.max(axis=0)
        self.d = (self.values - low) / unit_lengths(low, high)
        self.best = np.searchsorted(self.rows, ranking.salukvadze)

    def design(self, i: Any) -> str:
        """Return the name of a Pareto-optimal design, as sentences begin with it."""
        return capital(self.ranking.name_of(int(self.rows[i])))

    @cached_property
    def near(self) -> Rows:
        """The Pareto-optimal designs, and those that would be without these."""
        dominated = np.flatnonzero(~self.ranking.pareto)
        second = nondominated(self.ranking.objectives.minimized[dominated])
        return np.concatenate([self.rows, dominated[second]])

    def of_values(self) -> Iterator[Caution]:
        """What is the case of single values, whatever the ranking makes of them."""
        objectives, rows, later = self.ranking.objectives, self.rows, list[Caution]()
        columns = zip(objectives.names, objectives.sign, objectives.values.T, strict=True)
        for name, sign, column in columns:
            if sign < 0 and column.max() <= 0 > column.min():
                later.append(_caution("sign", objective=name))
            front, every = column[rows], np.unique(column)
            pool = np.unique(front)  # a front of few values tells little of what is usual
            pool = pool if len(pool) > _OTHERS else np.unique(column[self.near])
            for value, others in ((pool[0], pool[1:]), (pool[-1], pool[:-1])):
                found, between = np.flatnonzero(front == value), np.abs(every - value)
                if len(others) < _OTHERS or not len(found):
                    continue
                # Dominated designs in between tell that such values are usual.
                if not _is_unlike(float(value), others, float(between[between > 0].min())):
                    continue
                low, high = number(float(others[0])), number(float(others[-1]))
                said = {"objective": name, "value": number(float(value)), "low": low, "high": high}
                if len(best := np.intersect1d(found, self.best)):
                    yield _caution("suspect", design=self.design(best[0]), **said)
                else:
                    one = f"{self.design(found[0])} has a value"
                    several = f"{counted(len(found), 'design')} have values"
                    said["designs"] = one if len(found) == 1 else several
                    later.append(_caution("unlike", **said))
        yield from sorted(later, key=lambda caution: caution.kind)  # "sign" before "unlike"

    def of_objectives(self) -> Iterator[Caution]:
        """What is the case of the objectives over the Pareto set."""
        n, varying = len(self.rows), self.d.any(axis=0)
        if not varying.any():
            # One design, or one objective, is nothing to be weighed from the start.
            if 1 not in self.ranking.objectives.values.shape:
                yield _caution("alone")
            return
        if not varying.all():
            yield _caution("constant", objectives=listed(self.names[~varying]))
        left, groups = np.flatnonzero(varying), []
        while len(left):
            same = np.abs(self.d[:, left] - self.d[:, left[:1]]).max(axis=0) <= EDGE
            if same.sum() > 1:
                groups.append(listed(self.names[left[same]]))
            left = left[~same]
        if groups and n > 2:  # of two designs any two objectives are the same or opposite
            yield _caution("redundant", groups="; ".join(groups))
        ranges, of = np.ptp(self.values, axis=0)[varying], self.names[varying]
        most, least = ranges.argmax(), ranges.argmin()
        if not self.ranking.frame.normalize and ranges[most] >= OUTWEIGHED * ranges[least]:
            lengths = {"range": number(ranges[most], 3), "least": number(ranges[least], 3)}
            yield _caution("scale", objective=of[most], other=of[least], **lengths)

    def of_optimum(self) -> Iterator[Caution]:
        """What is the case of the optimum, and of designs that are almost as near."""
        d, best, names, n = self.d, self.best, self.names, len(self.rows)
        if not d.any():
            return
        mu = self.ranking.criteria[self.rows, 0]
        near = np.flatnonzero(mu <= mu[best[0]] * (1 + NEAR))
        # More than half of the designs, and from all over the set; not two ends that tie.
        if len(near) >= 3 and 2 * len(near) > n and np.ptp(d[near], axis=0).max() > 0.5:
            yield _caution("equidistant", near=len(near), count=n)
            return
        steps = np.abs(d - d[best[0]])
        apart = steps.max(axis=1)
        if len(different := best[apart[best] > EDGE]):
            others = [self.ranking.name_of(int(self.rows[different[0]]))]
            others += [f"{len(different) - 1} more"] if len(different) > 1 else []
            yield _caution("tie", design=self.design(best[0]), others=listed(others))
        near = np.setdiff1d(near, best)
        if len(near := near[apart[near] > ELSEWHERE]):
            i = near[mu[near].argmin()]
            yield _caution(
                "near tie",
                design=self.design(i),
                farther=percent(mu[i] / mu[best[0]] - 1),
                share=percent(apart[i]),
                objective=names[steps[i].argmax()],
            )
        if n > 2:  # of two designs each is an extreme
            if (worst := d[best[0]] >= 1 - EDGE).any():
                yield _caution("extreme", objectives=listed(names[worst]))
            if (first := d.any(axis=0) & (d[best[0]] <= EDGE)).any():
                yield _caution("edge", objectives=listed(names[first]))
        # Those alone at an end; of two the other one stays.
        ends = [np.flatnonzero(column == share) for column in d.T for share in (0.0, 1.0)]
        alone = dict.fromkeys(int(at[0]) for at in ends if len(at) == 1 and at[0] not in best)
        moves = [self.without(i) for i in alone]
        if moves and (most := max(moves, key=lambda move: move[0]))[0] > ELSEWHERE:
            yield most[1]

    def without(self, i: int) -> tuple[float, Caution]:
        """Return how far the optimum moves without a design of the front, and what to say then."""
        ranking, values, frame = self.ranking, self.values, self.ranking.frame
        others, left = np.delete(self.rows, i), np.delete(values, i, axis=0)
        dominated = np.flatnonzero(~ranking.pareto)
        F = ranking.objectives.values[dominated] * ranking.objectives.sign
        freed = (values[i] <= F).all(axis=1)
        if freed.any():  # what it dominates may be Pareto optimal without it
            others = np.concatenate([others, dominated[freed]])
            left = settled(np.vstack([left, F[freed]]))
            optimal = nondominated(left)
            others, left = others[optimal], left[optimal]
        # A point that the user has set stays.
        low, high = left.min(axis=0), left.max(axis=0)
        U = np.where(frame.ideal == values.min(axis=0), low, frame.ideal)
        N = np.where(frame.nadir == values.max(axis=0), high, frame.nadir)
        mu = UtopianFrame(U, N, frame.normalize).measured(left)[0][:, 0]
        new = np.flatnonzero(mu <= mu.min() * (1 + _ROUNDING))
        lengths = unit_lengths(low, high)
        steps = np.abs(left[new, None] - values[self.best]) / lengths
        if np.isin(others[new], self.rows[self.best]).any():
            steps[:] = 0.0
        moved = steps.max(axis=2)
        k, b = np.unravel_index(moved.argmin(), moved.shape)
        stretched = np.ptp(values, axis=0) / lengths  # of a constant objective 0
        outlier = stretched.max() >= OUTLIER
        return float(moved[k, b]), _caution(
            "outlier" if outlier else "unstable",
            design=self.design(i) if outlier else ranking.name_of(int(self.rows[i])),
            stretched=self.names[stretched.argmax()],
            times=number(stretched.max(), 3),
            other=ranking.name_of(int(others[new[k]])),
            share=percent(moved[k, b]),
            objective=self.names[steps[k, b].argmax()],
        )


def _is_unlike(value: float, others: Array, gap: float) -> bool:
    """Whether a value below or above ``(k,)`` ordered others, by a gap, is none of their kind."""
    low, high = float(others[0]), float(others[-1])
    if value == -1.0 and low > 0:
        return True
    if re.fullmatch("9{3,}([.]0)?", str(abs(value))) or abs(value) >= 1e20:
        return gap > high - low
    far = gap > FAR * (high - low)
    if far and min(value * low, value * high) > 0:  # of one sign
        orders = np.abs(np.log([value / low, value / high]))
        far = bool(orders.min() > np.log(high / low) * np.sign(low))
    return far
