"""Which designs to test next: a search on surrogates of all tests made so far.

Everything here is a function of its arguments, random numbers among them, so that a run that was
interrupted makes the same proposals again.

What is sought are good values in many directions at once: a direction w asks for a small
max_j (F_j / w_j), the achievement function of Wierzbicki (1980), with F measured from the best
values (0) to the worst of the Pareto set (1).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, invalid
from pymoo_psi.algorithms._nsga3 import reference_directions
from pymoo_psi.algorithms._surrogate_models import Fit, GaussianProcess, bounded
from pymoo_psi.pareto import nondominated, pareto_rank
from pymoo_psi.problems import DesignSpace

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Random = np.random.Generator
Map = Callable[[Array], Array]  # of n points
Judge = Callable[[Array], tuple[Array, Array]]  # objectives, and by how much bounds are exceeded

# Every so many rounds surrogates are searched only near the best tests. Far from all tests they
# promise most and know least; near them alone, a run that began in the wrong place stays there.
_NEARBY = 3
# Of the cube's width, in every variable; and of how many best tests, some for each part of a front.
# Both were chosen once and not varied, like the optimism below.
_NEAR, _CENTRES = 0.2, 10
_FORGIVING = 4  # every so many rounds, designs near failed ones are not avoided

# The search: as large and as long as the time for a proposal allows, below 0.1 s with 512 tests of
# ten variables and twelve outputs.
_SIZE, _GENERATIONS = 100, 40
_OPTIMISM = 0.5  # standard deviations by which a prediction may be better, when a gain is judged
_ATTEMPTS = 100  # to find random designs that meet the requirements, so many times _SIZE * 10
_SAME = 1e-6  # designs nearer than this are one
# Where surrogates see no design that keeps all limits, all but one of a round are so far apart and
# from tests, alternating, in units of the cube's diagonal: in the one place that looks best all
# would say the same.
_APART = (0.01, 0.03, 0.1)
# Standard deviations: surrogates that miss objectives by so much are searched in the middle of the
# front only. On DTLZ2 with 13 variables they miss them by 0.2, on the chute by 0.04.
_DOUBTFUL = 0.2
_EQUALITY = 0.01  # standard deviations within which a predicted equality counts as met


@dataclass(frozen=True)
class Goal:
    """What is sought: which outputs are to be small, and which have bounds to keep.

    Attributes:
        n_obj: The first so many outputs are objectives, to be small.
        bounds: ``(column, least, greatest)`` of constraints and of outputs that have limits;
            infinite if open.
        low: ``(d,)`` where designs begin that keep the limits on variables, in the unit cube.
        high: ``(d,)`` where they end.
        required: From ``(n, d)`` points to ``(n, k)`` by how much they violate requirements, which
            no proposal does.
        encode: From ``(n, d)`` points to what surrogates see, ``(n, e)``.
        compute: From ``(n, d)`` points and their ``(n, q)`` outputs to these, where some are known
            functions of variables and of the others.
    """

    n_obj: int
    bounds: Sequence[tuple[int, float, float]]
    low: Array
    high: Array
    required: Map
    encode: Map
    compute: Callable[[Array, Array], Array] | None = None

    def excess(self, T: Array, fit: Fit) -> Array:
        """Return ``(n, c)`` by how much outputs, on their scales, exceed what is allowed."""
        columns = [np.zeros((len(T), 0))]
        for j, least, greatest in self.bounds:
            within = _EQUALITY if least == greatest else 0.0
            if least > -np.inf:
                columns.append(fit.scales[j].to(least) - T[:, j] - within)
            if greatest < np.inf:
                columns.append(T[:, j] - fit.scales[j].to(greatest) - within)
        return np.column_stack(columns)


@dataclass(frozen=True)
class KnownTests:
    """The tests that surrogates learn from.

    Attributes:
        points: ``(n, d)`` points of the unit cube, which :class:`DesignSpace` makes designs of.
        Y: ``(n, q)`` outputs: objectives, inequality and equality constraints, others with limits.
        eligible: ``(n,)`` which keep all constraints and limits, and have finite objectives.
        failed: ``(n,)`` which have no outputs, though the model ran.
        unknown: ``(n,)`` these, and those that the model did not run for.
        pending: ``(p, d)`` points that are being tested; their outputs are expected to be as the
            surrogates predict them.
    """

    points: Array
    Y: Array
    eligible: Mask
    failed: Mask
    unknown: Mask
    pending: Array


def propose(
    tests: KnownTests, fit: Fit | None, goal: Goal, batch: int, turn: int, random: Random
) -> Array:
    """Return the ``(batch, d)`` points to test next.

    Args:
        tests: All tests.
        fit: Fitted to the tests, or to the first of them; ``None`` if there are too few.
        goal: What is sought.
        batch: How many designs.
        turn: Number of the round, from 0.
        random: Random numbers of the round.
    """
    # glibc returns the memory of freed arrays to the system as long as no larger one was freed:
    # without this, page faults double the time of a proposal from some 150 tests on.
    np.empty(2**21)
    known, encode = ~tests.unknown, goal.encode
    seen = encode(np.vstack([tests.points, tests.pending]))
    Z = seen[: len(known)][known]
    risk = _risk(Z, seen[: len(known)][tests.failed], turn)
    if fit is None:
        return _far(seen, risk, batch, goal, random)
    T = fit.to(bounded(tests.Y[known]))
    processes = [GaussianProcess(Z, *of) for of in zip(T.T, fit.lengths, strict=True)]

    def predict(points: Array) -> Array:
        at = encode(points)
        T = np.column_stack([process(at) for process in processes])
        return T if goal.compute is None else fit.to(goal.compute(points, fit.back(T)))

    def judge(points: Array) -> tuple[Array, Array]:
        predicted, unwanted = predict(points), risk(encode(points))
        excess = np.hstack([goal.excess(predicted, fit), unwanted, goal.required(points)])
        return predicted[:, : goal.n_obj], excess

    inward = _inward(fit, goal.n_obj)
    order = _survivors(T[:, : goal.n_obj], goal.excess(T, fit), _SIZE // 4, inward)
    best = tests.points[known][order]
    found = _search(judge, *_start(best, turn % _NEARBY == 1, goal, random), inward, random)
    found = found[(goal.required(found) <= 0).all(axis=1)]
    both, n = np.vstack([found, tests.pending]), len(found)
    expected, excess = judge(both)
    at = encode(both)
    deviation = np.column_stack([process.deviation(at) for process in processes[: goal.n_obj]])
    optimistic = fit.back(expected - _OPTIMISM * deviation)
    violated = np.maximum(excess, 0).sum(axis=1)
    pending = optimistic[n:][violated[n:] <= 0]
    front = np.vstack([tests.Y[tests.eligible, : goal.n_obj], pending])
    points = found[_choice(front, optimistic[:n], violated[:n], at[:n], seen, batch, inward)]
    if len(points) < batch:  # all that was found is tested: of a few discrete designs, say
        seen = np.vstack([seen, encode(points)])
        rest = _far(seen, risk, batch - len(points), goal, random)
        points = np.vstack([points, rest])
    return points


def encoded(space: DesignSpace, points: Array) -> Array:
    """Return points of the unit cube as surrogates see them.

    Points of one design are one there: a whole number is where it lies between its bounds, and a
    choice has a column for every option, as options have no order.
    """
    columns = []
    for variable, u in zip(space.searched, points.T, strict=True):
        if variable.kind.real:
            columns.append(u)
            continue
        count = int(variable.upper - variable.lower) + 1
        step = np.minimum(np.floor(u * count), count - 1)
        if variable.kind is Kind.CHOICE:
            columns += [(step == option).astype(float) for option in range(count)]
        else:
            columns.append(step / max(count - 1, 1))
    return np.column_stack(columns)


def _far(seen: Array, risk: Map, count: int, goal: Goal, random: Random) -> Array:
    """Return points far from all tests and from each other, rather where designs do not fail."""
    points = np.zeros((0, len(goal.low)))
    for _ in range(_ATTEMPTS):
        more = random.uniform(goal.low, goal.high, (_SIZE * 10, len(goal.low)))
        points = np.vstack([points, more[(goal.required(more) <= 0).all(axis=1)]])
        if len(points) >= count:
            break
    else:
        rule = f"met by {count} of {_ATTEMPTS * _SIZE * 10} random designs"
        raise invalid("requirements", rule, Received(f"{len(points)} that meet them"))
    at = goal.encode(points)
    distance = cdist(at, seen).min(axis=1)
    distance[risk(at)[:, 0] > 0] *= 0.1  # they are taken where nothing else is left
    chosen = []
    for _ in range(count):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, cdist(at, at[chosen[-1:]])[:, 0])
    return points[chosen]


def _risk(known: Array, failed: Array, turn: int) -> Map:
    """Return a function that is above 0, ``(k, 1)``, where designs are to be avoided.

    That is where failed tests outweigh the others, but not in every round: models are mended, and
    a failure may have been chance.
    """
    if len(failed) == 0 or turn % _FORGIVING == _FORGIVING - 1:
        return lambda Z: np.zeros((len(Z), 1))
    every = np.vstack([known, failed])
    # Weights fall as a normal density whose deviation is what tests are apart.
    apart = KDTree(every).query(every, k=2)[0][:, 1] if len(every) > 1 else np.ones(1)
    width = max(float(np.median(apart)), _SAME)

    def risk(Z: Array) -> Array:
        good, bad = (
            np.exp(-0.5 * (cdist(Z, those) / width) ** 2).sum(axis=1) for those in (known, failed)
        )
        # 0.01: the weight of a test three widths away; nothing is avoided farther from failures
        return np.asarray(bad / (good + bad + 0.01) - 0.5)[:, None]

    return risk


def _start(best: Array, near: bool, goal: Goal, random: Random) -> tuple[Array, Array, Array]:
    """Return where a search begins, and between which ``(k, d)`` bounds each of it stays."""
    d, best = best.shape[1], np.clip(best, goal.low, goal.high)
    if near:
        centre = best[random.integers(min(_CENTRES, len(best)), size=_SIZE)]
        low, high = np.maximum(centre - _NEAR, goal.low), np.minimum(centre + _NEAR, goal.high)
        # three variables at least are changed, or three in ten
        some = random.random((_SIZE, d)) < max(0.3, 3 / d)
        moved = centre + some * random.uniform(-_NEAR, _NEAR, (_SIZE, d))
        return np.clip(moved, low, high), low, high
    quarter = _SIZE // 4
    some = random.random((quarter, d)) < max(0.3, 2 / d)
    moved = best[random.integers(len(best), size=quarter)]
    moved = np.clip(moved + some * random.normal(0, 0.1, (quarter, d)), goal.low, goal.high)
    anywhere = random.uniform(goal.low, goal.high, (_SIZE - len(best) - quarter, d))
    start = np.vstack([best, moved, anywhere])
    return start, np.broadcast_to(goal.low, start.shape), np.broadcast_to(goal.high, start.shape)


def _search(
    judge: Judge, points: Array, low: Array, high: Array, inward: float, random: Random
) -> Array:
    """Return the ``(k, d)`` points that an evolution of given ones ends with.

    Where all exceed bounds it has but one aim, and ends in one place: then an eighth of the points
    on the way is added, for :func:`_choice` to choose from.

    Differential evolution (Storn and Price 1997) with small mutations, all points at once: with
    pymoo's NSGA-II, an object for each point, a proposal took three times as long.
    """
    n, d = points.shape
    F, C = judge(points)
    tried = [points]
    for generation in range(_GENERATIONS + 1):
        keep = _survivors(F, C, n, inward)
        points, F, C, low, high = points[keep], F[keep], C[keep], low[keep], high[keep]
        if generation == _GENERATIONS:
            break
        # tournaments of two, as the best come first
        a, b, c = (random.integers(n, size=(2, n)).min(axis=0) for _ in range(3))
        moved = points[a] + random.uniform(0.3, 0.9, (n, 1)) * (points[b] - points[c])
        crossed = random.random((n, d)) < random.uniform(0.1, 1.0, (n, 1))
        children = np.where(crossed, moved, points[a])
        width = 10.0 ** random.uniform(-3, -0.5, (n, 1))
        mutated = random.random((n, d)) < 1 / d
        children = children + mutated * width * random.normal(size=(n, d))
        children = np.clip(children, low[a], high[a])
        tried.append(children)
        f, c = judge(children)
        points, F, C = np.vstack([points, children]), np.vstack([F, f]), np.vstack([C, c])
        low, high = np.vstack([low, low[a]]), np.vstack([high, high[a]])
    if (C > 0).any(axis=1).all():
        points = np.vstack([points, *(some[::8] for some in tried)])
    return points


def _survivors(F: Array, C: Array, size: int, inward: float) -> NDArray[np.intp]:
    """Return the indices of the best designs, the best first.

    Those that exceed nothing come first. Of two objectives as in NSGA-II (Deb et al. 2002): those
    that fewer fronts lie before, then those farther from their neighbours in it. Of others by their
    best place in any direction, as of more than two objectives almost all designs are optimal.
    Those that exceed a limit follow, by how much.

    Args:
        F: ``(n, m)`` objectives.
        C: ``(n, c)`` by how much each bound is exceeded.
        size: How many, at most.
        inward: See :func:`_inward`.
    """
    violated = np.maximum(C, 0).sum(axis=1)
    kept = violated <= 0
    first, second = np.zeros((2, len(F)))
    if kept.any() and F.shape[1] == 2:
        first[kept] = rank = pareto_rank(F[kept])
        second[kept] = -_crowding(F[kept], rank)
    elif kept.any():
        # in units of the range of the Pareto set
        low, high = F[kept].min(axis=0), F[kept][nondominated(F[kept])].max(axis=0)
        values = _achievements((F[kept] - low) / np.where(high > low, high - low, 1.0), inward)
        first[kept] = np.argsort(np.argsort(values, axis=0, kind="stable"), axis=0).min(axis=1)
        second[kept] = values.min(axis=1)
    return np.lexsort((second, first, violated))[:size]


def _crowding(F: Array, rank: NDArray[np.integer]) -> Array:
    """Return ``(n,)`` how far the neighbours of each design in its front are from each other."""
    gaps = np.zeros(len(F))
    for f in F.T:
        order = np.lexsort((f, rank))
        value, front = f[order], rank[order]
        gap = np.full(len(F), np.inf)  # at the ends of a front
        inner = (front[1:-1] == front[:-2]) & (front[1:-1] == front[2:])
        gap[1:-1][inner] = (value[2:] - value[:-2])[inner]
        gaps[order] += gap / max(np.ptp(f), 1e-300)
    return gaps


def _achievements(F: Array, inward: float) -> Array:
    """Return the ``(n, w)`` achievements of ``(n, m)`` scaled objectives in w directions."""
    values = (F[:, None, :] / _directions(F.shape[1], inward)).max(axis=2)
    # a little of the sum: of two designs alike in the worst objective, the better one
    return np.asarray(values + 0.01 * F.sum(axis=1)[:, None])


def _inward(fit: Fit, n_obj: int) -> float:
    """Return by how much directions are drawn to the middle, 0 to a half.

    Of three objectives or more most directions are extreme: good in some at the cost of others.
    There a search goes on for ever at promises of surrogates that know little. So it begins in the
    middle, and goes out as far as surrogates are right.
    """
    if n_obj <= 2:
        return 0.0
    error = min(float(fit.errors[:n_obj].mean()) / _DOUBTFUL, 1.0)
    return round(error, 1) / 2  # a few steps, each of which has its table of directions


@lru_cache(maxsize=16)
def _directions(n_obj: int, inward: float) -> Array:
    if n_obj == 1:
        return np.ones((1, 1))
    directions = reference_directions(n_obj, _SIZE)
    return np.maximum((1 - inward) * directions + inward / n_obj, 0.01)


def _choice(
    front: Array, F: Array, violated: Array, at: Array, seen: Array, batch: int, inward: float
) -> list[int]:
    """Return the indices of the candidates to be tested.

    One half is what promises the largest gain, the other half what is farthest from all that is
    known in the space of objectives. If all candidates exceed a bound, those that do so least.

    Args:
        front: ``(k, m)`` objectives of the eligible tests.
        F: ``(n, m)`` predicted objectives of the candidates.
        violated: ``(n,)`` by how much bounds are exceeded, as predicted.
        at: ``(n, e)`` candidates as surrogates see them.
        seen: ``(t, e)`` the tests, as for ``at``.
        batch: How many to choose; fewer, if there are no more that are not tested.
        inward: See :func:`_inward`.
    """
    known = front[nondominated(front)]
    promising = F[violated <= 0] if (violated <= 0).any() else F
    both = np.vstack([known, promising])
    low = both.min(axis=0)
    high = (known if len(known) > 1 else both).max(axis=0)
    size = np.where(high > low, high - low, 1.0)
    known, F = (known - low) / size, (F - low) / size
    values = _achievements(F, inward)
    best = _achievements(known, inward).min(axis=0) if len(known) else values.max(axis=0)
    distance = cdist(at, seen).min(axis=1)
    apart = cdist(F, known).min(axis=1) if len(known) else np.full(len(F), np.inf)
    # in whose units the values of a direction are
    weights = _directions(F.shape[1], inward).max(axis=1)
    chosen: list[int] = []
    while len(chosen) < batch:
        new = np.flatnonzero(distance > _SAME)
        if len(new) == 0:
            break
        if (violated[new] > 0).all():
            least = _APART[len(chosen) % 3] * np.sqrt(at.shape[1]) if chosen else _SAME
            # as far as there are any, as of a search near the best tests
            new = new[distance[new] >= min(least, distance[new].max() / 2)]
            score = -violated
        else:
            new = new[violated[new] <= 0]
            gain = (np.maximum(best - values, 0) * weights).sum(axis=1)
            by_gain = len(chosen) < (batch + 1) // 2 and gain[new].max() > 0
            score = gain if by_gain else np.where(np.isinf(apart), distance, apart)
        k = int(new[score[new].argmax()])
        chosen.append(k)
        best = np.minimum(best, values[k])
        distance = np.minimum(distance, cdist(at, at[[k]])[:, 0])
        apart = np.minimum(apart, cdist(F, F[[k]])[:, 0])
    return chosen
