"""Reasons not to rely on the Salukvadze optimum of a ranking.

The optimum is the design nearest to the ideal point. That is advice only as far as nearness
discriminates between designs, and as the point and the ranges do not depend on a single design.
Each check here is one such condition.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto._dominance import nondominated, unit_lengths
from pymoo_psi.pareto._ranking import EfficiencyRanking, UtopianFrame, front_of, ranking_from
from pymoo_psi.pareto._sentences import capital, listed, number, percent, sentence

Array = NDArray[np.float64]

NEAR = 0.01
"""Distances within 1 % of the least are as good as it: models seldom know more of a design."""

ELSEWHERE = 0.1
"""Designs that differ by more than a tenth of a range in some objective are different choices.

On a straight front the designs within ``NEAR`` of the optimum differ from it by 7 % of a range at
most, so that a near tie beyond a tenth means a front that is curved or in pieces.
"""

EDGE = 0.01
"""Within 1 % of its range two values of an objective are alike."""

OUTLIER = 2.0
"""A design that doubles a range lies farther from all others than they from each other."""

FAR = 10.0
"""A value farther from all others than ten times their range is no value of the same kind."""

_OTHERS = 4  # values that tell what is usual
_ROUNDING = 1e-9  # distances closer than this are equal, see _explanation.py


class Caution(NamedTuple):
    """One reason not to rely on the optimum of a ranking without a second look.

    Attributes:
        kind: ``"sign"``, ``"suspect"``, ``"unlike"``, ``"constant"``,
            ``"equidistant"``, ``"tie"``, ``"near tie"``, ``"extreme"``, ``"edge"``,
            ``"outlier"`` or ``"unstable"``; see :func:`cautions`.
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
    ``sign``        A maximised objective is nowhere above 0, as where its sign has been turned.
    ``suspect``     The optimum has a value unlike those of all other designs in an objective: ten
                    times their range away, in orders of magnitude, too, if all have one sign; or
                    such as programs write for failures (-9999, 1e30, -1 among positive ones) and
                    away from all others by their range.
    ``unlike``      A Pareto-optimal design other than the optimum has such a value.
    ``constant``    Objectives, but not all, are equal for all Pareto-optimal designs.
    ``equidistant`` More than half of the designs, over half of a range, are within 1 % of the
                    least distance to the ideal point, as on a sphere around it.
    ``tie``         A design that differs by more than a tenth of a range is the optimum, too.
    ``near tie``    Such a design is at most 1 % farther.
    ``extreme``     The optimum is worst in an objective, within 1 % of its range: it is no
                    compromise. If normalised, the set bulges away from the ideal point.
    ``edge``        The optimum is best in an objective, as for ``extreme``: the set may extend
                    further.
    ``outlier``     Without a single other design that more than doubles a range, the optimum would
                    be elsewhere, by more than a tenth of a range.
    ``unstable``    The same, without such a range.
    =============== ============================================================================

    ``tie`` to ``unstable`` are left out for sets that are ``equidistant``, where all of them hold.
    Leaving out a design means to rank the others anew, those that it dominated among them; it is
    not tried where ``ideal`` or ``nadir`` are your own. Left out in turn are the designs that are
    the best or the worst in an objective, but for the optimum itself. In a Pareto set no other can
    move the optimum; beside dominated designs one other can, and is not tried: the only one that
    dominates a design which lies beyond N.

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
        Without design 4, which alone stretches the range of f2 9 times, the optimum would be
        design 1, which differs by 60 % of the range in f2.
    """
    checks = _Checks(ranking_from(F, normalize, maximize))
    return (*checks.of_values(), *checks.of_optimum())


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

    def near(self) -> NDArray[np.intp]:
        """Return the Pareto-optimal designs, and those that would be without these."""
        dominated = np.flatnonzero(~self.ranking.pareto)
        second = nondominated(self.ranking.objectives.minimized[dominated])
        return np.concatenate([self.rows, dominated[second]])

    def of_values(self) -> Iterator[Caution]:
        """What is the case of single values, whatever the ranking makes of them."""
        objectives, unlike = self.ranking.objectives, list[Caution]()
        columns = zip(objectives.names, objectives.sign, objectives.values.T, strict=True)
        for name, sign, column in columns:
            if sign < 0 and column.max() <= 0 > column.min():
                yield _caution("sign", objective=name)
            front, every = column[self.rows], np.unique(column)
            pool = np.unique(front)  # a front of few values tells little of what is usual
            pool = pool if len(pool) > _OTHERS else np.unique(column[self.near()])
            for value, others in ((pool[0], pool[1:]), (pool[-1], pool[:-1])):
                found, between = np.flatnonzero(front == value), np.abs(every - value)
                if len(others) < _OTHERS or not len(found):
                    continue
                # Dominated designs in between tell that such values are usual.
                if not _is_unlike(float(value), others, float(between[between > 0].min())):
                    continue
                best = [i for i in found if i in self.best]
                own, low, high = (number(float(v)) for v in (value, others[0], others[-1]))
                said = {"design": self.design([*best, *found][0]), "objective": name, "value": own}
                unlike.append(_caution("suspect" if best else "unlike", **said, low=low, high=high))
        yield from sorted(unlike, key=lambda caution: caution.kind)

    def of_optimum(self) -> Iterator[Caution]:
        """What is the case of the optimum, and of designs that are almost as near."""
        d, best, names, n = self.d, self.best, self.names, len(self.rows)
        varying = d.any(axis=0)
        if not varying.any():
            return
        if not varying.all():
            yield _caution("constant", objectives=listed(names[~varying]))
        mu = self.ranking.criteria[self.rows, 0]
        near = np.flatnonzero(mu <= mu[best[0]] * (1 + NEAR))
        # More than half of the designs, and from all over the set; not two ends that tie.
        if len(near) >= 3 and 2 * len(near) > n and np.ptp(d[near], axis=0).max() > 0.5:
            yield _caution("equidistant", near=len(near), count=n)
            return
        steps = np.abs(d - d[best[0]])
        apart = steps.max(axis=1)
        if len(near := near[apart[near] > ELSEWHERE]):
            i = near[mu[near].argmin()]
            yield _caution(
                "tie" if i in best else "near tie",
                design=self.design(i),
                optimum=self.ranking.name_of(int(self.rows[best[0]])),
                farther=percent(mu[i] / mu[best[0]] - 1),
                share=percent(apart[i]),
                objective=names[steps[i].argmax()],
            )
        if n > 2:  # of two designs each is an extreme
            if (worst := d[best[0]] >= 1 - EDGE).any():
                yield _caution("extreme", objectives=listed(names[worst]))
            if (first := varying & (d[best[0]] <= EDGE)).any():
                yield _caution("edge", objectives=listed(names[first]))
        values, frame = self.values, self.ranking.frame
        ends = {*values.argmin(axis=0), *values.argmax(axis=0)} - {*best}
        if (values.min(axis=0) > frame.ideal).any() or (values.max(axis=0) < frame.nadir).any():
            ends = set()  # points of the user's own stay where they are
        moves = [self.without(i) for i in sorted(ends)]
        if moves and (most := max(moves, key=lambda move: move[0]))[0] > ELSEWHERE:
            yield most[1]

    def without(self, i: int) -> tuple[float, Caution]:
        """Return how far the optimum moves without a design of the front, and what to say then."""
        F, values = self.ranking.objectives.minimized, self.values
        # What it dominates may be Pareto optimal without it.
        freed = (values[i] <= F).all(axis=1) & ~self.ranking.pareto
        rows = np.append(np.delete(self.rows, i), np.flatnonzero(freed))
        if freed.any():
            rows = rows[nondominated(F[rows])]
        left = F[rows]
        frame = UtopianFrame(left.min(axis=0), left.max(axis=0), self.ranking.frame.normalize)
        mu1, lengths = frame.distances(left)[:, 0], unit_lengths(frame.ideal, frame.nadir)
        new = np.flatnonzero(mu1 <= mu1.min() * (1 + _ROUNDING))
        steps = np.abs(left[new, None] - values[self.best]) / lengths
        moved, times = steps.max(axis=2), np.ptp(values, axis=0) / lengths
        k, b = np.unravel_index(moved.argmin(), moved.shape)
        return float(moved[k, b]), _caution(
            "outlier" if times.max() >= OUTLIER else "unstable",
            design=self.ranking.name_of(int(self.rows[i])),
            stretched=self.names[times.argmax()],
            times=number(times.max(), 3),
            other=self.ranking.name_of(int(rows[new[k]])),
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
