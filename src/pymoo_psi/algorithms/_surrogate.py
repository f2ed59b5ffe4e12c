"""SurrogatePSI: after the points of a sequence, designs that surrogates of all tests propose.

The proposals of a round follow from the tests known before it, the seed and the number of the
round, and they are stored before they are tested. So a run that was killed continues as if it had
not been interrupted.

A round takes the known tests as :class:`Observations` of what a :class:`Goal` needs, fits a
Gaussian process to each output (:func:`learned_from`), searches these for designs that promise most
in many directions, and selects a batch of them (:func:`propose`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import threadpool_limits

from pymoo_psi._validation import Array, Designs, Values, integer
from pymoo_psi.algorithms._executor import Executor
from pymoo_psi.algorithms._goal import LEAST_LEARNED, Goal, Learned, Observations, learned_from
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._proposals import propose
from pymoo_psi.algorithms._psi import PointAlgorithm
from pymoo_psi.algorithms._run import Run, by_number, run_of_sequence
from pymoo_psi.algorithms._sources import AlgorithmSettings, Points, RunOptions, Source
from pymoo_psi.algorithms._store import Store, renumbered
from pymoo_psi.algorithms._surrogate_models import REACH
from pymoo_psi.study import Proposal
from pymoo_psi.table import PROPOSAL_ROUND, Formulation, TestTable

if TYPE_CHECKING:
    from typing_extensions import Unpack

# Kernels are fitted again when there are this many times as many tests as at the last fit, as a fit
# takes as long as everything else in several rounds. Each fit is a function of the first tests
# alone, so that a continued run does not depend on where it was interrupted.
_GROWTH = 1.1
# The designs of a round share the time of the surrogates. While few tests are eligible, rounds are
# smaller: these learn more from each test, which matters most while little is known.
_BATCH = 8
_FIRST_BATCH = 2
_FEW_ELIGIBLE = 64
_DEFAULT_BATCHES = "2, from 64 tests on 8"  # in the name of a run in its study
# The points of the sequence show a heavy tail. More of them would tell less than as many proposals.
_POINTS = 20


class SurrogatePSI(PointAlgorithm):
    """Test points of a sequence first, then designs that surrogates propose.

    It begins as :class:`PSI`. Then each round fits surrogates of all objectives and constraints to
    all tests, searches them for a batch of designs, and tests these. Surrogates are Gaussian
    processes; every third round searches near the best tests. Outputs of a
    :class:`~pymoo_psi.ProgramProblem` that are expressions are computed from the variables and from
    surrogates of its other outputs.

    Result and table are those of :class:`PSI`: every test is numbered and kept, and limits can be
    set afterwards. The tests of the sequence come first; the output ``proposal_round`` of the table
    is 0 for them and the number of the round for proposals.

    Unless it is asynchronous, the run is determined by its arguments, the seed, 0 by default, and,
    without ``batch``, the number of workers beyond two.
    With a study, an interrupted run makes the same tests when it is called again, and a larger
    ``n_evaluations`` adds to them. Proposals are always stored before they are tested, and no
    stored test is repeated.

    A ``formulation`` directs the proposals, not the tests: a study of one formulation continues
    under another one, such as a decision made after the first tests. The table, and the designs of
    the result, are those of the formulation; ``res.F`` has the problem's objectives of these
    designs.

    Some models return infinity, or one large number, as the objective of a meaningless design.
    Surrogates use the worst of the other values instead if several tests of the sequence show this
    number. Surrogates learn a constraint better if it also states by how much it is met, instead of
    0.

    With a study, it learns from the tests of all runs within the bounds, and needs fewer points of
    the sequence, or none. It also learns from tests that are outside by at most the width of the
    bounds.

    Use it if a test takes seconds or more, or if there are many variables. After a few hundred
    tests, a proposal takes longer than a cheap model. The tests are no longer a uniform sample:
    histograms and correlations of the table show where it has searched.

    If the problem is ``noisy``, each proposal is a new design all the same, which is tested once;
    :func:`investigate` tests designs several times.

    Args:
        n_evaluations: How many designs to test, the points of the sequence among them.
        n_points: How many points of the sequence come first, 20 by default. Of a smaller
            ``n_evaluations`` all are such points; a study goes on from there with a larger one.
        batch: How many designs a round proposes; by default 2, or as many as there are workers,
            while fewer than 64 tests are feasible, then 8. A smaller batch learns more from each
            test.
        asynchronous: Whether the next round starts as soon as one worker is free, instead of when
            all have finished. New designs keep away from those being tested. Proposals then depend
            on the order in which tests end, and the study keeps with each proposal which earlier
            tests were ``pending``. By default it is on with more workers than ``batch``, or 8, and
            with workers that may join and leave, such as those of an
            :class:`~pymoo_psi.ExecutorRunner`. A :class:`~pymoo_psi.JoblibRunner` evaluates a
            round at a time.
        first: Number of the first point of the sequence; see :class:`PSI` for this and all that
            follow.
        sampling: Where the points of the sequence come from.
        seed: Seed of the proposals and of a randomised sampling.
        limits: Limits on objectives, variables and outputs, under which proposals are made.
        formulation: Used instead of ``limits``. Proposals follow its objectives, limits and ranges;
            computed columns are computed from surrogates.
        study: Name of a study file.
        study_key: A version or constants of the model.
        study_wait: Seconds to wait for other processes that are writing the study.
        more: Whether ``n_evaluations`` counts additional tests of a study.
        retry: Which stored tests are evaluated again, ``"failed"`` or ``"incomplete"`` ones, for
            example after a repair of the model; earlier proposals do not change. Proposals avoid
            designs that are close to failed ones, in lengths that are learned from failed tests and
            others. While failures may be random, one round of four does not avoid them.
            While most tests have failed and few have not, every second proposal is a design that
            may fail: it shows where else the model runs.
        names: Names for variables, objectives and constraints, by their default names.
        maximize: The objectives to maximize.
        units: Units of columns.
        log: Variables with a logarithmic scale.
        requirements: Rules on variables.
        **options: The options from ``first`` on, and those of pymoo's algorithms.

    Raises:
        ArgumentValueError: As for :class:`PSI`.
        ArgumentTypeError: As for :class:`PSI`.
        StudyError: As for :class:`PSI`.

    Example:
        >>> from pymoo.optimize import minimize
        >>> from pymoo_psi import SphereChute
        >>> res = minimize(SphereChute(0.4, model="rolling"), SurrogatePSI(28))
        >>> res.algorithm.table.column("proposal_round")[20:].tolist()
        [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0]
    """

    def __init__(
        self,
        n_evaluations: int,
        *,
        n_points: int | None = None,
        batch: int | None = None,
        asynchronous: bool | None = None,
        **options: Unpack[AlgorithmSettings],
    ) -> None:
        integer("n_evaluations", n_evaluations, minimum=1)
        if batch is not None:
            integer("batch", batch, minimum=1)
        self._is_start_fixed = n_points is not None
        if n_points is None:
            n_points = _POINTS
        self._batch = batch
        self._asynchronous = asynchronous
        self._n_sequence = integer("n_points", n_points, minimum=1)
        super().__init__(n_evaluations, RunOptions(), **options)

    def begin(self, options: RunOptions) -> Run:
        """Return the run of ``self.problem``; see :class:`PointAlgorithm`."""
        self.seed = self.seed or 0
        batches = self._batch or _DEFAULT_BATCHES
        # The text names all points of the sequence, even if a run ends among them: it may go on.
        method = f", {self._n_sequence} points, then proposals in batches of {batches}"
        method += f", seed {self.seed}"
        options = replace(options, seed=self.seed)
        run = run_of_sequence(
            self.problem,
            self.n_points,
            options,
            method=method,
            n_first=self._n_sequence,
            source_of=self._source,
        )
        self.n_points = run.n_points
        return run

    def _source(
        self,
        sequence: Points,
        n_points: int,
        model: Model,
        executor: Executor,
        store: Store,
    ) -> SurrogateSource:
        """Return the source of a run of ``n_points``."""
        runner = executor.queue.runner
        is_asynchronous = self._asynchronous
        if is_asynchronous is None:
            is_asynchronous = runner.elastic or runner.n_workers > (self._batch or _BATCH)
        if runner.in_rounds or (runner.n_workers == 0 and not runner.elastic):
            is_asynchronous = False
        return SurrogateSource(
            sequence.at(slice(0, self._n_first(sequence, model, store))),
            n_points,
            model,
            executor,
            store,
            self.seed or 0,
            self._batch,
            is_asynchronous,
        )

    def _n_first(self, sequence: Points, model: Model, store: Store) -> int:
        """Return how many points of the sequence come first: fewer if other runs have tests."""
        if self._is_start_fixed:
            return self._n_sequence
        n_first = self._n_sequence
        if len(store.known()) == 0:  # a run that was begun goes on as it was
            others = store.others()
            others = others.take(model.space.are_near(others.X))
            n_first = max(n_first - len(others), 0)
            designs = sequence.at(slice(0, n_first)).matrix(model.space)
            if set(model.keys(designs)).issubset(model.keys(others.X)):
                n_first = 0  # all are known: they would take the place of new tests
        n_left_out = self._n_sequence - n_first
        name = "points left out of the sequence"
        return self._n_sequence - int(store.remember_once(name, n_left_out))


@dataclass(eq=False)
class SurrogateSource(Source):
    """Points of a sequence, then rounds of proposals from surrogates of all tests.

    Attributes:
        sequence: The points that come first, those of the sequence.
        n_points: How many points there are in all.
        model: The model of the tests.
        executor: What tests the points, and says how many workers are free.
        store: Where proposals are kept before they are tested.
        seed: The seed of the random numbers.
        batch: How many designs a round has; ``None`` follows the number of tests or of free
            workers.
        is_asynchronous: Whether free workers get the next round while others are at work.
    """

    sequence: Points
    n_points: int
    model: Model
    executor: Executor  # not its queue, of which there is no copy
    store: Store
    seed: int
    batch: int | None
    is_asynchronous: bool

    def __post_init__(self) -> None:
        # The points to return next: the sequence, or what is left of a round. A round may be longer
        # than the run, which may get more points later.
        sequence = self.sequence
        rounds = np.zeros(len(sequence))
        self._ready = replace(sequence, coordinates=sequence.cube_points, rounds=rounds)
        self._points = self._ready.at(slice(0, 0))  # all that were returned
        self._ends = [len(sequence)]  # how many points there are at the start, after each round
        others = self.store.others()
        self._others = others.take(self.model.space.are_near(others.X, REACH))
        self._tests = self.store.empty
        self._formulation = self.model.formulation  # which the next round follows
        self._learned: Learned | None = None
        self._n_fitted = 0  # to how many of the first tests kernels are fitted

    @property
    def eager(self) -> bool:  # type: ignore[override]
        """Whether a round is due, although points are being tested; it begins with all tests."""
        if not self.is_asynchronous or self.n_left == 0:
            return False
        return self._n_waiting <= self._n_ahead

    @property
    def n_left(self) -> int:
        """How many points are left."""
        return self.n_points - len(self._points)

    def tell(self, tests: TestTable) -> None:
        """Learn from tests; a later test of the same point is left out."""
        is_new = ~np.isin(tests.numbers, self._tests.numbers)
        self._tests = self._tests.extended(tests.take(is_new))

    def direct(self, formulation: Formulation) -> None:
        """Propose the next points for another formulation."""
        self._formulation = formulation
        self._n_fitted = 0

    def extend(self, count: int) -> None:
        """Add ``count`` points, which are proposed."""
        self.n_points += count

    def ask(self, count: int) -> Points:
        """Return the points that are ready: first the sequence, then each round when it is due."""
        is_due = self.eager or len(self._pending()) == 0
        if self.n_left == 0 or not is_due:
            return Points.none()
        if len(self._ready) == 0:
            self._ready = self._next_round()
        points = self._ready.at(slice(0, self.n_left))
        self._ready = self._ready.at(slice(len(points), None))
        self._points = self._points.joined(points)
        return points

    def _pending(self) -> Points:
        """Return the points that are being tested."""
        return self._points.without(self._tests.numbers)

    def _next_round(self) -> Points:
        """Return the points of the next round, which are stored."""
        round_number = len(self._ends)
        first = int(self._points.numbers.max(initial=0)) + 1
        points = self._stored_points(round_number)
        if len(points) == 0:
            proposals = []
            for number, content in enumerate(self._new_round(), first):
                proposals.append(Proposal(number, round_number, "surrogates", content))
            # Another process may have stored the same round meanwhile, which then counts: all
            # processes on one file test the same designs.
            self._proposals.extend(self.store.propose(proposals))
            points = self._stored_points(round_number)
        self._ends.append(len(self._points) + len(points))
        numbers = first + np.arange(len(points))
        rounds = np.full(len(points), float(round_number))
        return Points(numbers, points.shape[1], points, rounds)

    @cached_property
    def _proposals(self) -> list[Proposal]:  # read when the first round is due
        return self.store.proposals()

    def _stored_points(self, round_number: int) -> Array:
        """Return the ``(n, d)`` points of a round that is stored; none of another one."""
        stored = [proposal for proposal in self._proposals if proposal.round == round_number]
        return np.array([proposal.content["point"] for proposal in stored])

    def _new_round(self) -> list[Values]:
        """Make a round; return what is stored of each of its points."""
        pending = self._pending()
        content: Values = {}
        if len(pending):  # all tests before the round were known but these
            content["pending"] = pending.numbers.tolist()
        # On matrices as small as these, several threads take ten times as long where other work is
        # going on, and their sums differ in the last digits from those of one.
        with threadpool_limits(limits=1, user_api="blas"):
            points = self._proposed_points(pending)
        return [{"point": point} | content for point in points.tolist()]

    def _size(self, n_eligible: int) -> int:
        """Return the size of the next round; ``n_eligible`` tests are eligible."""
        if self.batch is not None:
            return self.batch
        if self.is_asynchronous:
            # Enough for the free workers, for those that end before it is there, and while the
            # next round is being made.
            return max(1, 2 * self._n_ahead - self._n_waiting)
        if n_eligible < _FEW_ELIGIBLE:
            return max(_FIRST_BATCH, self.executor.queue.runner.n_workers)
        return _BATCH

    @property
    def _n_waiting(self) -> int:
        """How many designs wait for workers; negative while workers have none."""
        return self.executor.queue.n_pending - self.executor.queue.runner.n_workers

    @property
    def _n_ahead(self) -> int:
        """How many designs have to wait: workers take them while a round is being made."""
        return max(1, self.executor.queue.runner.n_workers // 4)

    def _table(self) -> TestTable:
        """Return the known tests, under the formulation."""
        tests = by_number([self._tests])
        n_others = len(self._others)
        if n_others > 0:  # tests of other runs come first
            others = renumbered(self._others, np.arange(1, n_others + 1))
            own = renumbered(tests, n_others + tests.numbers)
            tests = others.extended(own)
        return self.model.under_so_far(tests, self._formulation)

    def _proposed_points(self, pending: Points) -> Array:
        """Return the ``(n, d)`` points of a round, beside those that are being tested."""
        table = self._table()
        is_first = np.isin(self._tests.numbers, self._points.numbers[: self._ends[0]])
        n_uniform = len(self._others) + int(np.count_nonzero(is_first))
        goal = Goal.of(table, self.model)
        tests = Observations.of(table, goal, n_uniform, pending.cube_points)
        self._learn(tests, goal)
        n_rounds = len(self._ends) - 1  # before this one
        random = np.random.default_rng([self.seed, n_rounds])
        size = self._size(int(table.feasible().sum()))
        return propose(tests, goal, self._learned, size, n_rounds, random)

    def _learn(self, tests: Observations, goal: Goal) -> None:
        """Fit kernels again if there are enough new tests."""
        n_tests = len(tests.points)
        n_fitted = tests.n_uniform
        for end in self._ends:
            n_known_then = len(self._others) + end
            if n_fitted * _GROWTH <= n_known_then <= n_tests:
                n_fitted = n_known_then
        if np.count_nonzero(tests.is_known[:n_fitted]) < LEAST_LEARNED:
            n_fitted = n_tests
        if self._n_fitted != n_fitted:
            self._learned = learned_from(tests, goal, n_fitted)
            self._n_fitted = n_fitted


def proposed_now(
    model: Model,
    tests: TestTable,
    pending: Sequence[Values],
    size: int,
    seed: int,
    round_number: int,
) -> Designs:
    """Return ``(size, n_var)`` designs that surrogates of tests propose outside of a run.

    Args:
        model: The model.
        tests: All tests.
        pending: The designs that are being tested, by name; choices as texts.
        size: How many designs to propose.
        seed: The seed of the random numbers.
        round_number: The number of the round, from 0.
    """
    space = model.space
    table = model.under_so_far(tests.take(space.are_near(tests.X, REACH)))
    n_uniform = len(table)
    if PROPOSAL_ROUND in table.schema.outputs:
        is_proposed = table.column(PROPOSAL_ROUND) > 0
        n_uniform = int(np.append(is_proposed, True).argmax())
    names = model.schema.variables
    X = model.designs({name: np.array([design[name] for design in pending]) for name in names})
    goal = Goal.of(table, model)
    points = space.points(X[space.are_near(X)])
    observations = Observations.of(table, goal, n_uniform, points)
    random = np.random.default_rng([seed, round_number])
    with threadpool_limits(limits=1, user_api="blas"):
        learned = learned_from(observations, goal, len(table))
        return space.matrix(propose(observations, goal, learned, size, round_number, random))
