"""Reasons not to rely on the Salukvadze optimum of a ranking.

The optimum is the design nearest to the ideal point. It is good advice only if distances
discriminate between designs, and if the point and the ranges do not depend on a single design. Each
check here is one such condition.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from functools import cached_property, partial
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from pymoo_psi._names import operand
from pymoo_psi._numbers import number, percent
from pymoo_psi._validation import Array, Mask, Rows
from pymoo_psi.pareto._acceptability import weight_shares, weights_sentence
from pymoo_psi.pareto._dominance import (
    dominated_by,
    nondominated,
    unit_lengths,
    without_rounding,
)
from pymoo_psi.pareto._explanation import change_of
from pymoo_psi.pareto._ranking import (
    EfficiencyRanking,
    nearest_of_front,
    rank_of_efficiency,
)
from pymoo_psi.pareto._sentences import capital, listed, sentence

NEAR = 0.01
"""Distances within 1 % of the least count as equal to it: models are seldom more accurate."""

ELSEWHERE = 0.1
"""Designs that differ by more than a tenth of a range in some objective are different choices.

On a straight front the designs within ``NEAR`` of the optimum differ from it by at most 7 % of a
range, so that a near tie beyond a tenth means a front that is curved or in pieces.
"""

EDGE = 0.01
"""Two values of an objective within 1 % of its range count as equal."""

OUTLIER = 2.0
"""A design that doubles a range is farther from all others than they are from each other."""

FAR = 10.0
"""A value farther from all others than ten times their range is not of the same kind."""

CROWD = 0.75
DECADES = 100.0
"""Of values spread evenly over four powers of ten, three quarters are in a tenth of their range.

The greatest is a hundred times their median. The least one may be near 0 by chance.
"""

SAME = 0.04
"""Objectives that differ by 4 % of their ranges, in the root mean square, are nearly one."""

# A smaller difference of shares means little, as many designs of a dense front share the weights.
_CLEAR_DIFFERENCE = 0.05
_OTHERS = 4  # the fewest other values that show what is usual
_NAMED = 3  # the most designs of a group that are named


class Caution(NamedTuple):
    """A reason to check the optimum of a ranking.

    Attributes:
        kind: ``"sign"``, ``"suspect"``, ``"ranges"``, ``"decades"``,
            ``"redundant"``, ``"constant"``, ``"equidistant"``, ``"tie"``, ``"near tie"``,
            ``"extreme"``, ``"outlier"``, ``"unstable"`` or ``"weights"``;
            see :func:`cautions`.
        sentence: The reason.
        remedy: A column to compute and to rank by in place of the objective,
            ``log_cost=log10(cost)``, if that helps; else empty.

    Example:
        >>> print(Caution("tie", "A and B are equally near."))
        A and B are equally near.
    """

    kind: str
    sentence: str
    remedy: str = ""

    def __str__(self) -> str:
        """Return the reason, and what to do if there is a remedy."""
        if not self.remedy:
            return self.sentence
        return f"{self.sentence} To rank so, compute '{self.remedy}' and rank by it instead."


@np.errstate(over="ignore", invalid="ignore")  # a dominated design may be infinitely far
def cautions(
    F: Any, *, normalize: bool | None = None, maximize: Collection[Any] = ()
) -> tuple[Caution, ...]:
    """Return the reasons not to rely on the Salukvadze optimum, the most serious first.

    =============== ============================================================================
    kind            reason
    =============== ============================================================================
    ``sign``        A maximised objective is nowhere above 0: its sign may have been turned.
    ``suspect``     Pareto-optimal designs have values in an objective unlike those of all others:
                    ten times their range away, k times as far if there are k such values, and
                    orders of magnitude away if all have one sign; or values that programs write
                    for failures (-9999, 1e30, -1 among positive values), away from all others by
                    their range.
    ``ranges``      Designs are better than the fixed range of an objective and count as having its
                    best value, or the range is a single value and has no effect.
    ``decades``     Most designs lie in a tenth of the range of an objective, whose values span
                    powers of ten. By its logarithm another design is the optimum.
    ``redundant``   Objectives differ from others by at most 4 % of a range, in the root mean
                    square, so that these count several times. Without them another design is the
                    optimum.
    ``constant``    Objectives, but not all, are equal for all Pareto-optimal designs.
    ``equidistant`` More than half of the designs, over half of a range, are within 1 % of the
                    least distance to the ideal point, as on a sphere around it.
    ``extreme``     The optimum is worst in an objective, within 1 % of the range of the
                    Pareto-optimal designs: it is no compromise. If normalised, the set bulges away
                    from the ideal point.
    ``tie``         A design that differs by more than a tenth of a range is also an optimum.
    ``near tie``    Such a design is at most 1 % farther.
    ``outlier``     Without a single other design that more than doubles a range, or without all
                    that are unlike the others, the optimum would be elsewhere, by more than a
                    tenth of a range.
    ``unstable``    The same without such a range.
    ``weights``     A design that differs by more than a tenth of a range is the best for more of
                    the weights within a factor of two of equal ones, by 5 % of them; see
                    :func:`acceptability`.
    =============== ============================================================================

    ``extreme`` to ``unstable`` are omitted for ``equidistant`` sets, where all of them hold. For
    ``outlier`` and ``unstable``, each design that is best or worst in an objective, except the
    optimum, is left out in turn, and the others are ranked again, including those that it
    dominated. In a Pareto set no other design can move the optimum. With dominated designs one
    other can: the only design that dominates one beyond N, which is not tried. Nothing is tried,
    and neither logarithms nor fewer objectives are, if you give ``ideal`` or ``nadir``.

    Args:
        F: A ranking, which has directions of its own; or ``(n, m)`` objective values as for
            :func:`pymoo_psi.rank_of_efficiency`.
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
        The range of f2 is 9 times as long because of design 4 alone. Without design 4, design 1 is
        proposed (f2 0.6 lower).
    """
    ranking = rank_of_efficiency(F, normalize=normalize, maximize=maximize)
    return cautions_with_weights(ranking, weight_shares(ranking))


@np.errstate(over="ignore", invalid="ignore")
def cautions_with_weights(ranking: EfficiencyRanking, shares: Array) -> tuple[Caution, ...]:
    """Return :func:`cautions` of a ranking whose ``(n,)`` :func:`weight_shares` are known."""
    optimum = _Optimum(ranking)
    return (*_of_distances(optimum), *_of_weights(optimum, shares))


@np.errstate(over="ignore", invalid="ignore")
def cautions_of_distances(ranking: EfficiencyRanking) -> tuple[Caution, ...]:
    """Return :func:`cautions` but that of other weights, which takes most of the time."""
    return tuple(_of_distances(_Optimum(ranking)))


def _caution(kind: str, remedy: str = "", **values: object) -> Caution:
    return Caution(kind, sentence(kind, **values), remedy)


class _Optimum:
    """The optimum of a ranking among the k Pareto-optimal designs: what rules look at.

    Designs are numbered by their rows in the ranking, or by their place i among the optimal ones.

    Attributes:
        ranking: The ranking.
        names: ``(m,)`` the names of the objectives.
        rows: ``(k,)`` the Pareto-optimal designs.
        values: ``(k, m)`` their objectives, minimised.
        varying: ``(m,)`` in which objectives they differ.
        d: ``(k, m)`` how far they are from the best values, in units of the ranges.
        mu: ``(k,)`` their distances to the ideal point.
        optima: Which of them are the optimum.
        best: The first of these.
        steps: ``(k, m)`` how far they are from that one, in units of the ranges.
        near: Which of them are almost as near to the ideal point as that one.
    """

    def __init__(self, ranking: EfficiencyRanking) -> None:
        self.ranking = ranking
        self.names = np.array([str(name) for name in ranking.objectives.names], dtype=object)
        self.rows = ranking.front
        self.values = ranking.optimal
        low = self.values.min(axis=0)
        self.varying: Mask = np.isfinite(unit_lengths(low, self.values.max(axis=0)))
        self.d = (self.values - low) / ranking.lengths
        self.mu = ranking.criteria[self.rows, 0]
        self.optima = np.searchsorted(self.rows, ranking.salukvadze)
        self.best = self.optima[0]
        self.steps = np.abs(self.d - self.d[self.best])
        self.near = np.flatnonzero(self.mu <= self.mu[self.best] * (1 + NEAR))

    def name_of(self, i: Any) -> str:
        """Return the name of a Pareto-optimal design."""
        return self.ranking.name_of(int(self.rows[i]))

    def names_of(self, rows: Rows) -> str:
        """Return a few names of designs, Pareto-optimal ones first, and how many more there are."""
        rows = rows[np.argsort(~self.ranking.pareto[rows], kind="stable")]
        names = [self.ranking.name_of(row) for row in rows[:_NAMED].tolist()]
        if len(rows) > _NAMED:
            names.append(f"{len(rows) - _NAMED} more")
        return listed(names)

    def greatest_change(self, steps: Array, after: Array, before: Array) -> str:
        """Return by how much the objective changes that changes most.

        Args:
            steps: ``(m,)`` the changes in units of the ranges.
            after: ``(m,)`` objectives of a design, minimised.
            before: ``(m,)`` those of the design with which it is compared.
        """
        j = int(steps.argmax())
        return change_of(self.ranking, j, after[j] - before[j])

    def again(self, F: Array) -> EfficiencyRanking:
        """Return the ranking of other values, measured in the same way."""
        return rank_of_efficiency(F, normalize=self.ranking.frame.normalize)

    @cached_property
    def near_front(self) -> Rows:
        """The rows of the Pareto-optimal designs, and of those that would be without these."""
        dominated = np.flatnonzero(~self.ranking.pareto)
        second = nondominated(self.ranking.objectives.minimized[dominated])
        return np.concatenate([self.rows, dominated[second]])

    @cached_property
    def unlike(self) -> Mask:
        """``(n, m)`` which values are below or above the usual ones, if the front has such."""
        columns = self.ranking.objectives.values.T
        return np.array([self._unlike_in(column) for column in columns]).T

    def _unlike_in(self, column: Array) -> Mask:
        """Return ``(n,)`` which values of an objective are unlike the usual ones of the front.

        Args:
            column: ``(n,)`` its values for all designs, in the original direction.
        """
        of_front = column[self.rows]
        usual = np.unique(of_front)
        if len(usual) <= _OTHERS:  # too few to show what is usual
            usual = np.unique(column[self.near_front])
        if len(usual) <= _OTHERS:
            return np.zeros(len(column), dtype=bool)
        low = -_first_unlike(-usual[::-1], -column)
        high = _first_unlike(usual, column)
        if usual[0] == -1 and usual[1] > 0:  # a code among positive values
            low = -1.0
        if of_front.min() > low and of_front.max() < high:
            return np.zeros(len(column), dtype=bool)
        return (column <= low) | (column >= high)

    @property
    def is_on_a_sphere(self) -> bool:
        """Whether most designs, from all over the set, are as near; not two ends that tie."""
        if len(self.near) < 3 or 2 * len(self.near) <= len(self.rows):
            return False
        return bool(np.ptp(self.d[self.near], axis=0).max() > 0.5)


# The rules. Each yields the cautions of a kind.


def _of_distances(optimum: _Optimum) -> Iterator[Caution]:
    """Yield the cautions of all rules that apply but that of other weights."""
    rules = [_sign, _suspect]
    is_fixed = optimum.ranking.frame.is_fixed
    if is_fixed:  # the ranges are the user's own, and stay where they are without any design
        rules += [_ranges]
    else:
        rules += [_decades, _redundant]
    if optimum.varying.any():
        rules += [_constant]
        if optimum.is_on_a_sphere:
            rules += [_equidistant]
        else:
            rules += [_extreme, _tie]
            if not is_fixed:
                rules += [_moved]
    for rule in rules:
        yield from rule(optimum)


def _sign(optimum: _Optimum) -> Iterator[Caution]:
    objectives = optimum.ranking.objectives
    for name, sign, column in zip(optimum.names, objectives.sign, objectives.values.T, strict=True):
        if sign < 0 and column.max() <= 0 > column.min():
            yield _caution("sign", objective=name)


def _suspect(optimum: _Optimum) -> Iterator[Caution]:
    objectives = optimum.ranking.objectives
    write = partial(number, mark=objectives.decimal)
    for j in np.flatnonzero(optimum.unlike.any(axis=0)):
        is_unlike = optimum.unlike[:, j]
        values = objectives.values[is_unlike, j]
        others = objectives.values[~is_unlike, j]
        yield _caution(
            "suspect",
            designs=capital(optimum.names_of(np.flatnonzero(is_unlike))),
            objective=optimum.names[j],
            values=" to ".join(dict.fromkeys([write(values.min()), write(values.max())])),
            low=write(others.min()),
            high=write(others.max()),
        )


def _ranges(optimum: _Optimum) -> Iterator[Caution]:
    """Yield the caution about fixed ranges that do not tell all designs apart."""
    frame = optimum.ranking.frame
    beyond = unit_lengths(optimum.values.min(axis=0), frame.ideal)
    is_narrow = np.isfinite(beyond) | (optimum.varying & np.isinf(frame.lengths))
    if is_narrow.any():
        yield _caution("ranges", objectives=listed([*optimum.names[is_narrow]]))


def _decades(optimum: _Optimum) -> Iterator[Caution]:
    """Yield cautions about objectives whose logarithms would propose another design."""
    objectives = optimum.ranking.objectives
    values = objectives.values[optimum.rows]
    low = values.min(axis=0)
    high = values.max(axis=0)
    crowd = np.mean(values <= low + 0.1 * (high - low), axis=0)
    is_wide = (low > 0) & (high >= DECADES * np.median(values, axis=0))
    for j in np.flatnonzero(is_wide & (crowd >= CROWD) & ~optimum.unlike.any(axis=0)):
        name = optimum.names[j]
        F = optimum.values.copy()
        F[:, j] = np.log10(values[:, j]) * objectives.sign[j]
        ranking = optimum.again(F)
        if np.isin(ranking.salukvadze, optimum.optima).any():
            continue
        end = "best"
        if objectives.sign[j] < 0:
            end = "worst"
        yield _caution(
            "decades",
            f"log_{name}=log10({operand(name)})",
            objective=name,
            decades=f"{np.log10(high[j] / low[j]):.0f}",
            share=percent(crowd[j], objectives.decimal),
            end=end,
            other=optimum.name_of(ranking.salukvadze[0]),
            optimum=optimum.name_of(optimum.best),
            place=ranking.place[optimum.best],
        )


def _redundant(optimum: _Optimum) -> Iterator[Caution]:
    """Yield the caution about objectives that nearly repeat others."""
    varying = np.flatnonzero(optimum.varying)
    first = varying[originals(optimum.d[:, varying])]
    is_twin = first < varying
    twins = varying[is_twin]
    if not len(twins):
        return
    optima = optimum.again(np.delete(optimum.values, twins, axis=1)).salukvadze
    if not np.isin(optima, optimum.optima).any():
        yield _caution(
            "redundant",
            twins=listed([*optimum.names[twins]]),
            originals=listed([*optimum.names[first[is_twin]]]),
            other=optimum.name_of(optima[0]),
        )


def _constant(optimum: _Optimum) -> Iterator[Caution]:
    if not optimum.varying.all():
        yield _caution("constant", objectives=listed([*optimum.names[~optimum.varying]]))


def _equidistant(optimum: _Optimum) -> Iterator[Caution]:
    yield _caution("equidistant", near=len(optimum.near), count=len(optimum.rows))


def _extreme(optimum: _Optimum) -> Iterator[Caution]:
    """Yield the caution about objectives in which the optimum is the worst."""
    if len(optimum.rows) <= 2:  # each of two designs is an extreme
        return
    lengths = optimum.d.max(axis=0)  # less than 1 if fixed ranges extend further
    margins = lengths - optimum.d  # from the worst values
    are_worst = margins <= EDGE * lengths
    is_last = margins[optimum.best] <= 0
    # Nearly so is no news where most designs are, as of values that span decades.
    is_crowded = are_worst.mean(axis=0) >= CROWD
    is_worst = optimum.varying & are_worst[optimum.best] & (is_last | ~is_crowded)
    if not is_worst.any():
        return
    worst = "the worst"
    if not is_last[is_worst].all():
        worst = "nearly the worst"
    # The first by place that is nowhere among the worst; place 2 may be worse still.
    better = np.flatnonzero(~are_worst[:, optimum.varying].any(axis=1))
    following = ""
    if len(better):
        places = optimum.ranking.place[optimum.rows[better]]
        first = places.argmin()
        name = optimum.name_of(better[first])
        following = sentence("next", place=places[first], other=name)
    objectives = listed(optimum.names[is_worst])
    yield _caution("extreme", worst=worst, objectives=objectives, next=following)


def _tie(optimum: _Optimum) -> Iterator[Caution]:
    """Yield the caution about the nearest design far from the optimum, if there is one."""
    elsewhere = optimum.near[optimum.steps[optimum.near].max(axis=1) > ELSEWHERE]
    if not len(elsewhere):
        return
    i = elsewhere[optimum.mu[elsewhere].argmin()]
    kind = "near tie"
    if i in optimum.optima:
        kind = "tie"
    farther = optimum.mu[i] / optimum.mu[optimum.best] - 1
    yield _caution(
        kind,
        design=capital(optimum.name_of(i)),
        optimum=optimum.name_of(optimum.best),
        farther=percent(farther, optimum.ranking.objectives.decimal),
        change=optimum.greatest_change(
            optimum.steps[i], optimum.values[i], optimum.values[optimum.best]
        ),
    )


def _moved(optimum: _Optimum) -> Iterator[Caution]:
    """Yield the caution about the designs without which the optimum moves most."""
    moves = [_without(optimum, *trial) for trial in _trials(optimum)]
    distance, caution = max(moves, key=itemgetter(0), default=(0.0, None))
    if caution and distance > ELSEWHERE:
        yield caution


def _trials(optimum: _Optimum) -> Iterator[tuple[Rows, Rows]]:
    """Yield the designs that are left out together, and the others that may be optimal then."""
    extremes = {*optimum.values.argmin(axis=0), *optimum.values.argmax(axis=0)}
    for i in sorted(extremes - {*optimum.optima}):
        row = optimum.rows[i]
        yield np.array([row]), optimum.near_front[optimum.near_front != row]
    # One of several unlike designs hides what another one does, also one that it dominates.
    is_unlike = np.asarray(optimum.unlike.any(axis=1))
    is_unlike[optimum.rows[optimum.optima]] = False
    if is_unlike[optimum.rows].any():
        F = without_rounding(optimum.ranking.objectives.minimized)
        usual = np.flatnonzero(~is_unlike)
        optimal = usual[nondominated(F[usual])]
        # On the present front, or on that without those which are left out before.
        left_out = is_unlike.copy()
        left_out[is_unlike] = ~dominated_by(F[is_unlike], F[optimal])
        yield np.flatnonzero(left_out), optimal


def _without(optimum: _Optimum, left_out: Rows, rows: Rows) -> tuple[float, Caution]:
    """Return how far the optimum moves without some designs, and the caution.

    Args:
        optimum: The optimum.
        left_out: The rows of these designs in the ranking.
        rows: The other rows that may be Pareto optimal without them.
    """
    ranking = optimum.ranking
    if ranking.pareto[rows].all():  # to filter many once more takes long
        places = np.searchsorted(optimum.rows, rows)
        F = optimum.values.T.take(places, axis=1).T  # still stored by column
    else:
        F = ranking.objectives.minimized[rows]
        optimal = nondominated(F)
        rows = rows[optimal]
        F = without_rounding(F[optimal])
    optima, frame = nearest_of_front(F, ranking.frame)
    # The shortest move from an optimum before to one after.
    before = optimum.values[optimum.optima]
    steps = np.abs(F[optima, None] - before) / frame.lengths
    moves = steps.max(axis=2)
    k, first = np.unravel_index(moves.argmin(), moves.shape)
    times = np.ptp(optimum.values, axis=0) / frame.lengths
    kind = "unstable"
    if times.max() >= OUTLIER:
        kind = "outlier"
    return moves[k, first], _caution(
        kind,
        designs=optimum.names_of(left_out),
        stretched=optimum.names[times.argmax()],
        times=number(times.max(), 3, mark=ranking.objectives.decimal),
        other=ranking.name_of(int(rows[optima[k]])),
        change=optimum.greatest_change(steps[k, first], F[optima[k]], before[first]),
    )


def _of_weights(optimum: _Optimum, shares: Array) -> Iterator[Caution]:
    """Yield the caution that another design is the best for more of the weights."""
    optimal = shares[optimum.rows]
    other = optimal.argmax()
    is_elsewhere = optimum.steps[other].max() > ELSEWHERE
    if is_elsewhere and optimal[other] > optimal[optimum.best] + _CLEAR_DIFFERENCE:
        row = int(optimum.rows[optimum.best])
        yield Caution("weights", weights_sentence(optimum.ranking, row, shares))


def originals(d: Array) -> Rows:
    """Return for each objective the first one that it nearly repeats; itself if it repeats none.

    Args:
        d: ``(k, m)`` how far the Pareto-optimal designs are from the best values, in units of the
            ranges.
    """
    first = []
    for column in d.T:
        differences = np.sqrt(np.mean((d.T - column) ** 2, axis=1))
        first.append((differences <= SAME).argmax())
    return np.array(first, dtype=np.intp)


def _first_unlike(values: Array, all_values: Array) -> float:
    """Return from which of the greatest values on, a quarter at most, they are unlike the others.

    Args:
        values: ``(k,)`` values of the front, distinct and increasing, k > 4.
        all_values: ``(n,)`` those of all designs.

    Returns:
        The value; infinity if all are alike.
    """
    quarter = len(values) // 4
    counts = np.arange(quarter, 0, -1)
    # For each count the least of so many greatest values, and the ends of the others.
    least = values[-counts]
    high = values[-counts - 1]
    low = values[quarter // 2]  # not the least value, which may be unlike the others, too
    # So many values are seldom far by chance: the more they are, the farther they have to be.
    ranges = (least - high) / (counts * (high - low))
    for i in np.flatnonzero(ranges > 1):
        # Values of dominated designs in between show that values are usual.
        below = all_values[all_values < least[i]].max()
        distance = (least[i] - below) / (counts[i] * (high[i] - low))
        if distance > 1 and _is_unlike(least[i], low, high[i], distance):
            return float(least[i])
    return np.inf


def _is_unlike(value: float, low: float, high: float, ranges: float) -> bool:
    """Whether a value above all others is a placeholder, such as 9999, or an outlier.

    Args:
        value: The value.
        low: The least of the others.
        high: The greatest.
        ranges: The distance to the others in units of their range; more than 1.
    """
    if re.fullmatch("9{3,}([.]0)?", str(abs(value))) or abs(value) >= 1e20:
        return True
    if ranges <= FAR:
        return False
    if value * low <= 0:  # the signs differ
        return True
    return bool(abs(np.log(value / high)) > abs(np.log(high / low)))
