"""Which designs to test next: a search on surrogates fitted to all tests so far.

Everything here is a function of its arguments, random numbers included, so that an interrupted run
repeats its proposals.

The search looks for good values in many directions at once. In a direction w it minimises
max_j (F_j / w_j), the achievement function of Wierzbicki (1980), where F is 0 at the best values
and 1 at the worst values of the Pareto set.

:func:`propose` makes a round. A search on the means of the surrogates (:func:`_search`) finds
candidates; under a decision, a second search finds more near its best compromise. :func:`_selected`
takes the most promising ones, by rules that take turns. Few designs are not searched: while too few
tests are known, or most of them have failed.

Points lie in the unit cube of the variables. ``Z`` stands for points as surrogates see them
(:meth:`Goal.encode`), ``Y`` for outputs, ``T`` for outputs on the scales of their surrogates.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import ndtr

from pymoo_psi._validation import Array, Mask, Received, Rows, invalid
from pymoo_psi.algorithms._goal import Goal, Learned, Observations
from pymoo_psi.algorithms._nsga3 import reference_directions
from pymoo_psi.algorithms._surrogate_models import bounded, evenly_spread
from pymoo_psi.pareto import nondominated, pareto_rank

Random = np.random.Generator
# An aim maps (n, d) points to the (n, m) values that a search minimises, and to their (n, c) excess
# of each limit.
Aim = Callable[[Array], tuple[Array, Array]]
# glibc returns the memory of freed arrays to the system until a larger one has been freed. Without
# this, page faults double the time of a proposal from about 150 tests on.
np.empty(2**21)


# A round

# One round in this many does not avoid designs near failed ones, while failures may be random.
_ROUNDS_PER_RISKY_ROUND = 4
# One round in this many searches only near the best tests. Far from all tests surrogates promise
# most and are least reliable; near the best tests alone, a run that began in the wrong place would
# stay there.
_ROUNDS_PER_NEARBY_SEARCH = 3
# This many designs at the end of the search for the best compromise are candidates. Others beside
# them would be much the same.
_N_COMPROMISES = 20


def propose(
    tests: Observations,
    goal: Goal,
    learned: Learned | None,
    batch: int,
    round_number: int,
    random: Random,
) -> Array:
    """Return the ``(batch, d)`` points to test next.

    Args:
        tests: The tests so far.
        goal: What the search seeks.
        learned: What is learned of the tests with outputs; ``None`` if there are too few.
        batch: Number of designs.
        round_number: Number of the round, from 0.
        random: Random numbers of the round.
    """
    seen = tests.seen(goal)
    if learned is None:
        return _distant_points(seen, batch, goal, random)
    if learned.failures is None and (round_number + 1) % _ROUNDS_PER_RISKY_ROUND == 0:
        tests = replace(tests, has_failed=np.zeros_like(tests.has_failed))
    surrogates = _Surrogates(tests, goal, learned)
    candidates, front = _searched(surrogates, round_number, random)
    count = (len(seen) + batch) // 2 - len(seen) // 2  # every second one, also of odd batches
    unsure = _unsure_points(surrogates, count, random)
    seen = np.vstack([seen, goal.encode(unsure)])
    selected = _selected(candidates, front, surrogates.contraction, seen, batch - len(unsure))
    chosen = candidates.points[selected]
    proposals = np.vstack([unsure, chosen])
    n_missing = batch - len(proposals)
    if n_missing > 0:  # all candidates are tested, for example if there are few discrete designs
        seen = np.vstack([seen, goal.encode(chosen)])
        rest = _distant_points(seen, n_missing, goal, random)
        proposals = np.vstack([proposals, rest])
    return proposals


def _searched(
    surrogates: _Surrogates, round_number: int, random: Random
) -> tuple[_Candidates, Array]:
    """Return the designs that a search finds, and the scaled Pareto set of the tests."""
    goal = surrogates.goal
    points = _points_of_search(surrogates, round_number, random)
    predicted = surrogates.predicted(points)
    F = _front(surrogates)
    ranges = _ranges(F, predicted, goal)
    front = _scaled(F, ranges)
    worth = np.zeros(len(points))
    if goal.is_directed and len(front) > 0 and len(points) > 0:
        compromises = _compromises(surrogates, points, front, ranges, random)
        points = np.vstack([points, compromises])
        predicted = surrogates.predicted(points)
        worth = surrogates.worth(predicted, front, ranges)
    F = _scaled(predicted.promised, ranges)
    return _Candidates(points, predicted.Z, F, predicted.violation, worth), front


def _points_of_search(surrogates: _Surrogates, round_number: int, random: Random) -> Array:
    """Return the best points that a search finds, anywhere or in some rounds near tests."""
    goal = surrogates.goal
    best = surrogates.best_points(_POPULATION_SIZE // 4)
    start_of_search = _start_anywhere
    if round_number % _ROUNDS_PER_NEARBY_SEARCH == 1:
        start_of_search = _start_near
    start = start_of_search(best, surrogates.aim, goal, random)
    points = _search(surrogates.aim, start, surrogates.contraction, random)
    return points[_meets_requirements(points, goal)]


def _front(surrogates: _Surrogates) -> Array:
    """Return the objectives of the Pareto set of the tests; pending ones count as predicted."""
    tests = surrogates.tests
    pending = surrogates.predicted(tests.pending)
    eligible = tests.Y[tests.is_eligible, : surrogates.goal.n_obj]
    F = np.vstack([eligible, pending.promised[pending.violation <= 0]])
    return F[nondominated(F)]


def _compromises(
    surrogates: _Surrogates, points: Array, front: Array, ranges: Array, random: Random
) -> Array:
    """Return points near the best compromise; the search for it starts from other points."""
    goal = surrogates.goal

    def aim(points: Array) -> tuple[Array, Array]:
        predicted = surrogates.predicted(points)
        worth = surrogates.worth(predicted, front, ranges)
        return -worth[:, None], predicted.violation[:, None]

    start = _Population.of(aim, points, goal.low, goal.high).best(_POPULATION_SIZE, 0.0)
    found = _search(aim, start, 0.0, random)
    return found[_meets_requirements(found, goal)][:_N_COMPROMISES]


def _ranges(F: Array, predicted: _Predicted, goal: Goal) -> Array:
    """Return the ``(2, m)`` ranges by which objectives are scaled.

    Args:
        F: The objectives of a Pareto set.
        predicted: What is predicted of candidates; those that keep all limits count, if there are
            any.
        goal: What the search seeks, perhaps in given ranges.
    """
    if goal.ranges is not None:
        return goal.ranges
    promised = predicted.promised
    feasible = predicted.violation <= 0
    if feasible.any():
        promised = promised[feasible]
    both = np.vstack([F, promised])
    high = both.max(axis=0)
    if len(F) > 1:
        high = F.max(axis=0)
    return np.array([both.min(axis=0), high])


def _scaled(F: Array, ranges: Array) -> Array:
    """Return ``(n, m)`` objectives, 0 and 1 at the ends of ``(2, m)`` ranges."""
    low, high = ranges
    lengths = np.where(high > low, high - low, 1.0)
    return np.asarray((F - low) / lengths)


# What surrogates say of designs

# A search sees at most this many tests, evenly spread: the time of a round grows with their second
# power, and thousands of workers may wait for it.
_MOST_TESTS = 2048
# A prediction is taken to be better than its mean by this many standard deviations.
_OPTIMISM = 0.5
# If limits narrow a problem, and none of this many tests in a row keeps them although some test
# does, predictions have to keep away from limits by a standard deviation.
_MISSES_BEFORE_CAUTION = 4
# A design is avoided unless its distance from the nearest test with outputs is less than this share
# of that from the nearest failed test: in the middle between both it might lie on the boundary.
_SAFE_DISTANCE_RATIO = 0.7
# The worth of a design decreases by this share of its distance from the ideal point. So the least
# distance counts where a gain in it is too improbable for a number.
_WORTH_OF_DISTANCE = 1e-6
_LEAST_DIVISOR = 1e-6  # instead of distances and deviations of 0


class _Predicted(NamedTuple):
    """What surrogates expect of designs.

    Attributes:
        Z: ``(n, e)`` the designs as surrogates see them.
        T: ``(n, m)`` their objectives on the scales of the surrogates.
        deviations: ``(n, m)`` the standard deviations of these.
        promised: ``(n, m)`` the objectives, somewhat better than expected.
        violation: ``(n,)`` the sums of what exceeds limits.
    """

    Z: Array
    T: Array
    deviations: Array
    promised: Array
    violation: Array


@dataclass(eq=False)
class _Surrogates:
    """The surrogates of all outputs, which predict the objectives and the excess of designs.

    Attributes:
        tests: The tests so far.
        goal: What the search seeks.
        learned: What is learned of the tests.
        processes: The surrogate of each output.
        contraction: As :func:`_contraction` returns it.
    """

    tests: Observations
    goal: Goal
    learned: Learned

    def __post_init__(self) -> None:
        tests = self.tests
        learned = self.learned
        self.contraction = _contraction(learned, self.goal.n_obj)
        # the rows of the tests that are learned, and their outputs on their scales
        rows = np.flatnonzero(tests.is_known)
        self._rows = rows[evenly_spread(len(rows), _MOST_TESTS)]
        self._T = learned.to(bounded(tests.Y[self._rows]))
        Z = tests.Z[self._rows]
        pairs = zip(learned.outputs, self._T.T, strict=True)
        self.processes = [output.process(Z, t) for output, t in pairs]
        recent = tests.is_eligible[-_MISSES_BEFORE_CAUTION:]
        is_missing = tests.is_eligible.any() and not recent.any()
        self._is_cautious = self.goal.is_narrowed and is_missing

    def best_points(self, n: int) -> Array:
        """Return the points of the n best tests, the best first."""
        excess = self.goal.excess(self._T, self.learned, np.zeros_like(self._T))
        F = self._T[:, : self.goal.n_obj]
        best = _survivors(F, excess, n, self.contraction)
        return np.clip(self.tests.points[self._rows[best]], self.goal.low, self.goal.high)

    def aim(self, points: Array) -> tuple[Array, Array]:
        """Return ``(n, m)`` expected objectives on their scales, and all that forbids designs.

        These are exceeded limits, expected failures and violated requirements.
        """
        T, excess = self.outputs(points)
        columns = [excess, self.failure_risk(points), self.goal.violations(points)]
        return T[:, : self.goal.n_obj], np.column_stack(columns)

    def failure_risk(self, points: Array) -> Array:
        """Return ``(n,)`` by how much points are nearer to failed tests than to known ones."""
        if not self.tests.has_failed.any():
            return np.zeros(len(points))
        from_known, from_failed = self.failure_distances(points)
        return np.minimum(from_known - _SAFE_DISTANCE_RATIO * from_failed, 1.0)

    def failure_distances(self, points: Array) -> tuple[Array, Array]:
        """Return the ``(n,)`` distances of points from known tests, and those from failed ones."""
        Z = self.in_units_of_failures(self.goal.encode(points))
        tested = self.in_units_of_failures(self.tests.Z)
        return _nearest(Z, tested[self.tests.is_known]), _nearest(Z, tested[self.tests.has_failed])

    def in_units_of_failures(self, Z: Array) -> Array:
        """Return ``(n, e)`` designs in units in which close ones fail alike, if these are known."""
        kernel = self.learned.failures
        return Z if kernel is None else kernel.scaled(Z)

    def outputs(self, points: Array) -> tuple[Array, Array]:
        """Return ``(n, q)`` expected outputs on their scales, and what exceeds limits."""
        goal = self.goal
        Z = goal.encode(points)
        T = np.column_stack([process(Z) for process in self.processes])
        if goal.is_computed:
            T = self.learned.to(goal.computed(points, self.learned.back(T)))
        margins = np.zeros_like(T)
        if self._is_cautious:
            for j in goal.limits:
                margins[:, j] = self.processes[j].deviation(Z)
        return T, goal.excess(T, self.learned, margins)

    def predicted(self, points: Array) -> _Predicted:
        """Return what is expected of designs."""
        T, excess = self.aim(points)
        Z = self.goal.encode(points)
        objectives = self.processes[: self.goal.n_obj]
        deviations = np.column_stack([process.deviation(Z) for process in objectives])
        promised = self.learned.back(T - _OPTIMISM * deviations)
        return _Predicted(Z, T, deviations, promised, _violation(excess))

    def worth(self, predicted: _Predicted, front: Array, ranges: Array) -> Array:
        """Return ``(n,)`` what tests are worth for the best compromise.

        This is the design nearest to the ideal point. A test is worth by how much it is expected to
        bring the nearest one nearer (the expected improvement of Jones, Schonlau and Welch, J.
        Global Optim. 13, 1998). So a search returns to where surrogates err, for example where the
        larger one of two stresses changes: the true objective has an edge there, and surrogates
        round it off.

        Args:
            predicted: What is expected of n designs.
            front: ``(k, m)`` the Pareto set of the tests, scaled.
            ranges: ``(2, m)`` lower and upper values by which it is scaled.
        """
        F = _scaled(self.learned.back(predicted.T), ranges)
        better = _scaled(self.learned.back(predicted.T - predicted.deviations), ranges)
        worse = np.maximum(F, 0)  # by how much designs are worse than the ideal point
        distance = np.maximum(np.linalg.norm(worse, axis=1), _LEAST_DIVISOR)
        error = worse / distance[:, None] * (F - better)
        least = np.linalg.norm(np.maximum(front, 0), axis=1).min()
        deviation = np.linalg.norm(error, axis=1)
        z = (distance - least) / np.maximum(deviation, _LEAST_DIVISOR)
        gain = deviation * (np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) - z * ndtr(-z))
        return np.asarray(gain - _WORTH_OF_DISTANCE * distance)


def _violation(excess: Array) -> Array:
    """Return ``(n,)`` sums of the positive parts of ``(n, c)`` excesses."""
    return np.asarray(np.maximum(excess, 0).sum(axis=1))


def _meets_requirements(points: Array, goal: Goal) -> Mask:
    """Return ``(n,)`` whether points meet all requirements."""
    return np.asarray((goal.violations(points) <= 0).all(axis=1))


def _nearest(A: Array, B: Array) -> Array:
    """Return the ``(n,)`` distances of points from the nearest of ``(k, d)`` others."""
    return np.asarray(cdist(A, B).min(axis=1, initial=np.inf))


# The search

# The size and the length of the search. A proposal then takes less than 0.1 s with 512 tests of ten
# variables and twelve outputs.
_POPULATION_SIZE = 100
_N_GENERATIONS = 40
# A nearby search reaches this share of the cube's width, in every variable and to both sides,
# around this many of the best tests. Both were chosen once and not tuned, as was the optimism.
_NEARBY_HALF_WIDTH = 0.2
_N_NEARBY_CENTRES = 10
# If the errors of the surrogates of objectives reach this many standard deviations, only the middle
# of the front is searched. They are 0.2 on DTLZ2 with 13 variables and 0.04 on the chute.
_ERROR_OF_FULL_CONTRACTION = 0.2


class _Population(NamedTuple):
    """Designs of the search, each of them a row in every array.

    Attributes:
        points: ``(n, d)`` the designs.
        low: ``(n, d)`` lower limits for their children.
        high: ``(n, d)`` upper limits for their children.
        F: ``(n, m)`` the values that the search minimises.
        excess: ``(n, c)`` by how much they exceed each limit, as predicted.
    """

    points: Array
    low: Array
    high: Array
    F: Array
    excess: Array

    @classmethod
    def of(cls, aim: Aim, points: Array, low: Array, high: Array) -> _Population:
        """Return points within limits, which may be those of all, as an aim values them."""
        points, low, high = np.broadcast_arrays(np.clip(points, low, high), low, high)
        return cls(points, low, high, *aim(points))

    def best(self, n: int, contraction: float) -> _Population:
        """Return the n best designs, the best first."""
        rows = _survivors(self.F, self.excess, n, contraction)
        return _Population(*(column[rows] for column in self))

    def joined(self, other: _Population) -> _Population:
        """Return these designs followed by others."""
        pairs = zip(self, other, strict=True)
        return _Population(*(np.vstack(pair) for pair in pairs))


def _start_anywhere(best: Array, aim: Aim, goal: Goal, random: Random) -> _Population:
    """Return the best tests, variations of them, and random designs; the search is not limited."""
    d = best.shape[1]
    quarter = _POPULATION_SIZE // 4
    changed = random.random((quarter, d)) < max(0.3, 2 / d)
    origin = best[random.integers(len(best), size=quarter)]
    step = random.normal(0, 0.1, (quarter, d))
    varied = np.where(changed, origin + step, origin)
    n_random = _POPULATION_SIZE - len(best) - quarter
    anywhere = random.uniform(goal.low, goal.high, (n_random, d))
    points = np.vstack([best, varied, anywhere])
    return _Population.of(aim, points, goal.low, goal.high)


def _start_near(best: Array, aim: Aim, goal: Goal, random: Random) -> _Population:
    """Return designs near the best tests; the search stays near these."""
    d = best.shape[1]
    centres = random.integers(min(_N_NEARBY_CENTRES, len(best)), size=_POPULATION_SIZE)
    centre = best[centres]
    low = np.maximum(centre - _NEARBY_HALF_WIDTH, goal.low)
    high = np.minimum(centre + _NEARBY_HALF_WIDTH, goal.high)
    # At least three variables are changed, or three in ten.
    changed = random.random((_POPULATION_SIZE, d)) < max(0.3, 3 / d)
    step = random.uniform(-_NEARBY_HALF_WIDTH, _NEARBY_HALF_WIDTH, (_POPULATION_SIZE, d))
    points = np.where(changed, centre + step, centre)
    return _Population.of(aim, points, low, high)


def _search(aim: Aim, start: _Population, contraction: float, random: Random) -> Array:
    """Return the ``(k, d)`` points at the end of an evolution, the best first.

    If all of them exceed limits, the search has a single aim and ends in one place. Then an eighth
    of the points on the way is added, for :func:`_selected` to choose from.

    It is differential evolution (Storn and Price 1997) with small mutations, on arrays of all
    points: pymoo's NSGA-II, with an object for each point, tripled the time of a proposal.
    """
    n = len(start.points)
    tried = [start.points]
    population = start.best(n, contraction)
    for _ in range(_N_GENERATIONS):
        children = _children(population, aim, random)
        tried.append(children.points)
        population = population.joined(children).best(n, contraction)
    points = population.points
    if (population.excess > 0).any(axis=1).all():
        points = np.vstack([points, *(generation[::8] for generation in tried)])
    return points


def _children(parents: _Population, aim: Aim, random: Random) -> _Population:
    """Return as many new designs as there are parents, which are ordered, the best first."""
    points = parents.points
    n, d = points.shape
    # tournaments of two: the smaller index is the better design
    a, b, c = random.integers(n, size=(3, 2, n)).min(axis=1)
    difference = random.uniform(0.3, 0.9, (n, 1)) * (points[b] - points[c])
    crossed = random.random((n, d)) < random.uniform(0.1, 1.0, (n, 1))
    children = np.where(crossed, points[a] + difference, points[a])
    width = 10.0 ** random.uniform(-3, -0.5, (n, 1))
    mutated = random.random((n, d)) < 1 / d
    step = width * random.normal(size=(n, d))
    children = np.where(mutated, children + step, children)
    return _Population.of(aim, children, parents.low[a], parents.high[a])


def _survivors(F: Array, excess: Array, size: int, contraction: float) -> Rows:
    """Return the indices of the best designs, the best first.

    Designs that exceed nothing come first. With two objectives they are ordered as in NSGA-II (Deb
    et al. 2002), with more by :func:`_places`, as then almost all of them are Pareto optimal.
    Designs that exceed limits follow, ordered by their violation.

    Args:
        F: ``(n, m)`` objectives.
        excess: ``(n, c)`` by how much each limit is exceeded.
        size: Number of indices, at most.
        contraction: As :func:`_contraction` returns it.
    """
    violation = _violation(excess)
    kept = violation <= 0
    first = np.zeros(len(F))
    second = np.zeros(len(F))
    if kept.any() and F.shape[1] == 2:
        first[kept], second[kept] = _ranks(F[kept])
    elif kept.any():
        first[kept], second[kept] = _places(F[kept], contraction)
    return np.lexsort((second, first, violation))[:size]


def _ranks(F: Array) -> tuple[Rows, Array]:
    """Return ``(n,)`` the front of each design, and minus the distance of its neighbours there."""
    rank = pareto_rank(F)
    distances = np.zeros(len(F))
    for f in F.T:
        order = np.lexsort((f, rank))
        value = f[order]
        front = rank[order]
        gap = np.full(len(F), np.inf)  # a design at an end of its front has one neighbour only
        inner = (front[1:-1] == front[:-2]) & (front[1:-1] == front[2:])
        gap[1:-1][inner] = (value[2:] - value[:-2])[inner]
        distances[order] += gap / max(np.ptp(f), 1e-300)
    return rank, -distances


def _places(F: Array, contraction: float) -> tuple[Rows, Array]:
    """Return ``(n,)`` the best place of each design in any direction, and its best achievement."""
    ranges = np.array([F.min(axis=0), F[nondominated(F)].max(axis=0)])
    values = _achievements(_scaled(F, ranges), contraction)
    order = np.argsort(values, axis=0, kind="stable")
    places = np.argsort(order, axis=0)
    return places.min(axis=1), values.min(axis=1)


def _achievements(F: Array, contraction: float) -> Array:
    """Return the ``(n, w)`` achievements of ``(n, m)`` scaled objectives in w directions."""
    directions = _directions(F.shape[1], contraction)
    values = np.full((len(F), len(directions)), -np.inf)
    for f, shares in zip(F.T, directions.T, strict=True):
        np.maximum(values, f[:, None] / shares, out=values)
    # A small share of the sum decides between designs with the same worst objective.
    return np.asarray(values + 0.01 * F.sum(axis=1)[:, None])


def _contraction(learned: Learned, n_obj: int) -> float:
    """Return by how much directions are contracted towards the middle, 0 to 0.5.

    With three objectives or more, most directions are extreme: good in some at the cost of others.
    There inaccurate surrogates always promise more. So a search begins in the middle and widens as
    surrogates become accurate.
    """
    if n_obj <= 2:
        return 0.0
    errors = np.array([output.error for output in learned.outputs[:n_obj]])
    doubt = min(float(errors.mean()) / _ERROR_OF_FULL_CONTRACTION, 1.0)
    return round(doubt, 1) / 2  # few steps, as each has its table of directions


@lru_cache(maxsize=16)
def _directions(n_obj: int, contraction: float) -> Array:
    if n_obj == 1:
        return np.ones((1, 1))
    directions = reference_directions(n_obj, _POPULATION_SIZE)
    return np.maximum((1 - contraction) * directions + contraction / n_obj, 0.01)


# The selection

# By what a candidate is selected, in turn; without a decision, the compromise is a distance, too.
# Where surrogates err, the largest gain is promised again and again, whatever is tested near it; so
# most designs are selected by distance.
_RULES = ("gain", "distance", "compromise", "distance")
# While surrogates see no design that keeps all limits, the next ones have these distances from
# tests, in turn, in units of the cube's diagonal. Without distances, all of them would lie in the
# one place that looks best.
_INFEASIBLE_SPACINGS = (0.0, 0.03, 0.1, 0.01)
# Designs that are closer than this, in units of the cube's width, are the same.
_SAME_DESIGN_DISTANCE = 1e-6
# A compromise that is closer to a test than this distance is much the same.
_MIN_DISTANCE_FROM_TEST = 1e-3


class _Candidates(NamedTuple):
    """Designs to choose from, as predicted.

    Attributes:
        points: ``(n, d)`` the designs.
        Z: ``(n, e)`` the designs as surrogates see them.
        F: ``(n, m)`` their objectives, predicted optimistically and scaled.
        violation: ``(n,)`` the sums of what exceeds limits.
        worth: ``(n,)`` what their tests are worth for the best compromise; 0 if none is searched.
    """

    points: Array
    Z: Array
    F: Array
    violation: Array
    worth: Array


def _selected(
    candidates: _Candidates, front: Array, contraction: float, seen: Array, batch: int
) -> list[int]:
    """Return the indices of the candidates to be tested.

    A selected candidate counts like a test from then on.

    Args:
        candidates: The candidates.
        front: ``(k, m)`` the Pareto set of the tests, scaled.
        contraction: As :func:`_contraction` returns it.
        seen: ``(t, e)`` the tests, as surrogates see them.
        batch: How many to select; there are fewer if fewer are not tested yet.
    """
    Z = candidates.Z
    F = candidates.F
    achievements = _achievements(F, contraction)
    weights = _directions(front.shape[1], contraction).max(axis=1)
    best = achievements.max(axis=0, initial=-np.inf)  # in each direction, so far
    if len(front) > 0:
        best = _achievements(front, contraction).min(axis=0)
    distance = _nearest(Z, seen)
    gap = _nearest(F, front)  # from the nearest known objectives
    selected: list[int] = []
    while len(selected) < batch and (distance > _SAME_DESIGN_DISTANCE).any():
        turn = (len(seen) + len(selected)) % len(_RULES)
        gains = (np.maximum(best - achievements, 0) * weights).sum(axis=1)
        row = _next_selected(candidates, turn, gains, distance, gap)
        selected.append(row)
        distance = np.minimum(distance, _nearest(Z, Z[[row]]))
        gap = np.minimum(gap, _nearest(F, F[[row]]))
        best = np.minimum(best, achievements[row])
    return selected


def _next_selected(
    candidates: _Candidates, turn: int, gains: Array, distance: Array, gap: Array
) -> int:
    """Return the index of the candidate to be tested next, by the rule whose turn it is.

    Args:
        candidates: The candidates.
        turn: The index of the rule.
        gains: ``(n,)`` gains in all directions.
        distance: ``(n,)`` distances from tests.
        gap: ``(n,)`` distances from known objectives; infinite if there are none.
    """
    violation = candidates.violation
    worth = candidates.worth
    rows = np.flatnonzero(distance > _SAME_DESIGN_DISTANCE)
    feasible = rows[violation[rows] <= 0]
    if len(feasible) == 0:
        spacing = _INFEASIBLE_SPACINGS[turn] * np.sqrt(candidates.Z.shape[1])
        # After a search near the best tests, no candidate may be that far away.
        spacing = min(spacing, distance[rows].max() / 2)
        scores = np.where(distance >= spacing, -violation, -np.inf)
        return int(rows[scores[rows].argmax()])
    if _RULES[turn] == "compromise" and worth.any():
        scores = np.where(distance > _MIN_DISTANCE_FROM_TEST, worth, -np.inf)
    elif _RULES[turn] == "gain" and gains[feasible].max() > 0:
        scores = gains
    else:
        scores = np.where(np.isinf(gap), distance, gap)
    return int(feasible[scores[feasible].argmax()])


# Points that are not searched

# How often random designs are drawn, at most, to meet the requirements, and how many at once.
_MAX_DRAWS = 100
_DESIGNS_PER_DRAW = 1000
# While fewer tests than this for each variable are known, at most so many, and more have failed,
# every second design is one that may fail or not, chosen among a number of random ones.
_FEW_KNOWN_A_VARIABLE = 4
_FEW_KNOWN = 25
_UNSURE_DRAWS = 4000


def _distant_points(seen: Array, count: int, goal: Goal, random: Random) -> Array:
    """Return points far from all tests and from each other, chosen among random ones."""
    points = np.zeros((0, len(goal.low)))
    for _ in range(_MAX_DRAWS):
        drawn = random.uniform(goal.low, goal.high, (_DESIGNS_PER_DRAW, len(goal.low)))
        points = np.vstack([points, drawn[_meets_requirements(drawn, goal)]])
        if len(points) >= count:
            return points[_farthest(goal.encode(points), seen, count)]
    rule = f"met by at least {count} of {_MAX_DRAWS * _DESIGNS_PER_DRAW} random designs"
    remedy = "narrow the bounds of the variables, or loosen the requirements"
    raise invalid("requirements", rule, Received(f"{len(points)}"), remedy)


def _unsure_points(surrogates: _Surrogates, count: int, random: Random) -> Array:
    """Return points that may fail or not, if most tests have failed and few are known.

    Surrogates of few tests in a small region promise nothing elsewhere, and a search that avoids
    failures stays there. These points show how far the region extends, within all limits as far as
    these are learned; they are far from all tests.

    Args:
        surrogates: The surrogates.
        count: How many points to return, at most.
        random: Random numbers.
    """
    tests = surrogates.tests
    goal = surrogates.goal
    d = len(goal.low)
    few = min(int(tests.has_failed.sum()), _FEW_KNOWN_A_VARIABLE * d, _FEW_KNOWN)
    if surrogates.learned.failures is None or tests.is_known.sum() >= few:
        return np.zeros((0, d))
    points: Array = random.uniform(goal.low, goal.high, (_UNSURE_DRAWS, d))
    points = points[_meets_requirements(points, goal)]
    _, excess = surrogates.outputs(points)
    points = points[_violation(excess) <= 0]
    distances = np.sort(surrogates.failure_distances(points), axis=0)
    points = points[distances[0] > _SAFE_DISTANCE_RATIO * distances[1]]
    Z = surrogates.in_units_of_failures(goal.encode(points))
    seen = surrogates.in_units_of_failures(tests.seen(goal))
    return points[_farthest(Z, seen, count)]


def _farthest(Z: Array, seen: Array, count: int) -> list[int]:
    """Return the rows of at most ``count`` designs far from each other and from ``(t, e)`` tests.

    Args:
        Z: ``(n, e)`` the designs.
        seen: The tests.
        count: How many rows.
    """
    distance = _nearest(Z, seen)
    rows: list[int] = []
    while len(rows) < min(count, len(Z)):
        rows.append(int(distance.argmax()))
        distance = np.minimum(distance, _nearest(Z, Z[rows[-1:]]))
    return rows
