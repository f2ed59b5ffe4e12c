"""SurrogatePSI: after the points of a sequence, designs that surrogates of all tests propose.

The proposals of a round follow from the tests known before it, the seed and the number of the
round, and they are stored before they are tested. So a run that was killed continues as if it had
not been interrupted.
"""

from __future__ import annotations

from concurrent.futures import Future, wait
from dataclasses import replace
from threading import Thread
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from pymoo_psi._validation import Array, Received, Rows, boolean, integer, invalid
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._options import RunOptions, SearchKeywords, run_options, takes
from pymoo_psi.algorithms._outputs import LearnedOutputs, TestedModel
from pymoo_psi.algorithms._proposals import (
    Goal,
    KnownTests,
    best_and_spread,
    drawn,
    propose,
    with_repeats,
)
from pymoo_psi.algorithms._psi import PointAlgorithm
from pymoo_psi.algorithms._run import Run, by_number, run_of_sequence
from pymoo_psi.algorithms._sections import space_of_table
from pymoo_psi.algorithms._sources import Points, Source
from pymoo_psi.algorithms._store import renumbered
from pymoo_psi.algorithms._surrogate_models import Fit, Learned, bounded
from pymoo_psi.pareto import hypervolume
from pymoo_psi.study import Proposal
from pymoo_psi.table import PROPOSAL_ROUND, Formulation, TestTable, design_keys

if TYPE_CHECKING:
    from typing_extensions import Unpack


# Lengths are fitted again when there are so many times as many tests; a fit takes as long as all
# else for some rounds. Each fit is a function of the first tests alone, so that a continued run
# does not depend on where it was interrupted.
_GROWTH = 1.1
# Designs in a round, which share the time of the surrogates. Small rounds learn more from each
# test, which matters most while little is known.
_BATCH, _FEW, _LITTLE = 8, 2, 64
# Part of the name of a run in its study, as 0.3.0 wrote it: with another one, a study would not
# continue, but begin another run.
_DEFAULT_BATCHES = "4, from 64 tests on 8"
_POINTS = 20  # enough to show a heavy tail; more would tell less than as many proposals
# Tests of which the surrogates of an asynchronous run are made when lengths are fitted again: a
# round takes longer with their second power, and thousands of workers wait for it.
_MOST_LEARNED = 2048
_LEAST = 4  # known tests, below which there is no surrogate
_DRAWS = 64  # of what surrogates predict for further tests
_REFERENCE = 1.1  # of the hypervolume, in units of the ranges of the Pareto set


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

    With a study, it learns from the tests of all runs, also within other bounds, and needs fewer
    points of the sequence, or none.

    Use it if a test takes seconds or more, or if there are many variables. After a few hundred
    tests, a proposal takes longer than a cheap model. The tests are no longer a uniform sample:
    histograms and correlations of the table show where it has searched.

    If the problem is ``noisy``, up to half of a round tests designs again: those whose repetition
    is expected to bring the best design nearer to the ideal point than a new design is. The table
    has all tests; ``table.averaged()`` has the means, its ``confidence()`` how sure they are.

    Args:
        n_evaluations: How many designs to test, the points of the sequence among them.
        n_points: How many points of the sequence come first, 20 by default.
        batch: How many designs a round proposes; by default 2, or as many as there are workers,
            while fewer than 64 tests are feasible, then 8. A smaller batch learns more from each
            test.
        asynchronous: Whether the next round starts as soon as one worker is free, instead of when
            all have finished. New designs keep away from those being tested. Proposals then depend
            on the order in which tests end, and the study keeps with each proposal which earlier
            tests were ``pending``. By default it is on with more workers than ``batch``, or 8, and
            with workers that may join and leave, such as those of an
            :class:`~pymoo_psi.ExecutorRunner`.
        **options: As for :class:`PSI`, without ``share`` and ``block_size``. Proposals follow the
            objectives, limits and ranges of a ``formulation``, or those of the problem under
            ``limits``. Computed columns are computed from surrogates. ``retry`` does not change
            earlier proposals. Three rounds of four avoid designs near failed ones.

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

    @takes(SearchKeywords)
    def __init__(
        self,
        n_evaluations: int,
        *,
        n_points: int | None = None,
        batch: int | None = None,
        asynchronous: bool | None = None,
        **options: Unpack[SearchKeywords],
    ) -> None:
        run, keywords = run_options("SurrogatePSI", options, SearchKeywords)
        integer("n_evaluations", n_evaluations, minimum=1)
        if batch is not None:
            integer("batch", batch, minimum=1)
        if asynchronous is not None:
            boolean("asynchronous", asynchronous)
        self._is_start_fixed = n_points is not None
        if n_points is None:
            n_points = _POINTS
        self._batch = batch
        self._asynchronous = asynchronous
        self._n_sequence = integer("n_points", n_points, minimum=1)
        super().__init__(n_evaluations, run, None, **keywords)

    def begin(self, options: RunOptions, may_end_early: bool) -> Run:
        """Return the run of ``self.problem``; see :class:`PointAlgorithm`."""
        self.seed = self.seed or 0
        batches = self._batch or _DEFAULT_BATCHES
        # of the points all, also where a run ends among them, as it may go on
        method = f", {self._n_sequence} points, then proposals in batches of {batches}"
        method += f", seed {self.seed}"
        options = replace(options, seed=self.seed)
        run = run_of_sequence(
            self.problem,
            self.n_points,
            options,
            may_end_early=may_end_early,
            method=method,
            n_first=self._n_sequence,
        )
        self.n_points = run.n_points
        executor = run.executor
        is_asynchronous = self._asynchronous
        if is_asynchronous is None:
            is_asynchronous = executor.elastic or executor.n_workers > (self._batch or _BATCH)
        if executor.n_workers == 0 and not executor.elastic:
            is_asynchronous = False
        sequence = run.source.ask(run.n_left, 0)
        n_left_out = self._n_left_out(run, sequence)
        if n_left_out:
            sequence = sequence.at(slice(0, self._n_sequence - n_left_out))
        n_proposed = max(0, self.n_points - self._n_sequence + n_left_out)
        run.source = SurrogateSource(
            run, sequence, n_proposed, self.seed, self._batch, is_asynchronous
        )
        return run

    def _n_left_out(self, run: Run, sequence: Points) -> int:
        """Return how many points of the sequence are proposed instead, as other runs have tests."""
        if self._is_start_fixed:
            return 0
        n_left_out = 0
        if len(run.store.known()) == 0:  # a run that was begun goes on as it was
            others = run.store.others()
            n_left_out = min(self._n_sequence, len(others))
            first = sequence.at(slice(0, self._n_sequence - n_left_out))
            tested = design_keys(others.X)
            if set(design_keys(first.matrix(run.model.space))).issubset(tested):
                n_left_out = self._n_sequence  # nothing new would be learned
        return int(run.store.remembered("points left out of the sequence", n_left_out))


class _Making(NamedTuple):
    """A round of proposals that is made.

    Attributes:
        pending: The points that were being tested when it began.
        n_tests: How many tests were known then.
        units: The ``(n, d)`` points that it proposes.
    """

    pending: Points
    n_tests: int
    units: Future[Array]


class SurrogateSource(Source):
    """Points of a sequence, then rounds of proposals from surrogates of all tests.

    Args:
        run: The run; its store keeps proposals before they are tested.
        sequence: The points that come first, those of the sequence.
        n_proposed: How many points are proposed.
        seed: The seed of the random numbers.
        batch: How many designs a round has; ``None`` follows the number of tests or of free
            workers.
        is_asynchronous: Whether free workers get the next round while others are at work.
    """

    def __init__(
        self,
        run: Run,
        sequence: Points,
        n_proposed: int,
        seed: int,
        batch: int | None,
        is_asynchronous: bool,
    ) -> None:
        self._model = run.model
        self._store = run.store
        self._asked = run.model.formulation
        self._sequence = replace(
            sequence, coordinates=sequence.units, rounds=np.zeros(len(sequence))
        )
        self._n_points = len(sequence) + n_proposed
        others = run.store.others()
        self._others = others.rows(run.model.space.has_options(others.X))
        self._n_dim = len(run.model.space.searched)
        self._seed = seed
        self._batch = batch
        self._executor = run.executor
        self._is_asynchronous = is_asynchronous
        self._points = self._sequence.at(slice(0, 0))  # all that were returned
        self._tests = run.store.empty
        self._ends = [len(sequence)]  # how many points there are at the start, after each round
        self._fitted: tuple[int, Learned | None] = (0, None)  # to how many of the first tests
        self._proposals: list[Proposal] | None = None  # of the study
        self._making: _Making | None = None
        self._n_meanwhile = 0  # tests that ended while the last round was made
        self._request = 0  # of people, whose formulation the proposals follow
        self._directed: tuple[Formulation, int] = self._asked, 0  # for the next round

    def __getstate__(self) -> dict[str, Any]:
        """Copies learn anew, which gives the same: a large matrix in each would fill the memory."""
        return self.__dict__ | {"_fitted": (0, None), "_making": None}

    @property
    def eager(self) -> bool:  # type: ignore[override]
        """Whether a round is due, although points are being tested; it begins with all tests."""
        if not self._is_asynchronous or self._making is not None or self.n_left == 0:
            return False
        return self._executor.n_workers - self._executor.n_pending_tasks >= -self._n_ahead

    @property
    def n_left(self) -> int:
        """How many points are left."""
        return self._n_points - len(self._points)

    def tell(self, tests: TestTable) -> None:
        """Learn from tests; a later test of the same point is left out."""
        is_new = ~np.isin(tests.numbers, self._tests.numbers)
        self._tests = self._tests.extended(tests.rows(is_new))

    def direct(self, formulation: Formulation, request: int) -> None:
        """Propose the next points for another formulation, that of a request."""
        self._directed = formulation, request

    def extend(self, count: int) -> None:
        """Add so many points, which are proposed."""
        self._n_points += count

    def ask(self, count: int, n_free: int) -> Points:
        """Return the points of the sequence, and then a round of proposals when one is due."""
        points = self._next(n_free)
        self._points = self._points.joined(points)
        return points

    def _next(self, n_free: int) -> Points:
        if len(self._points) == 0 and len(self._sequence) > 0:
            return self._sequence
        pending = self._points.at(~np.isin(self._points.numbers, self._tests.numbers))
        is_due = len(pending) == 0 or self.eager or self._making is not None
        if self.n_left == 0 or not is_due:
            return Points.none()
        first = int(self._points.numbers.max(initial=0)) + 1
        round_number = len(self._ends)
        units = self._round(first, n_free, pending)
        if len(units) == 0:
            return Points.none()
        self._ends.append(len(self._points) + len(units))
        units = units[: self.n_left]
        numbers = first + np.arange(len(units))
        return Points(numbers, self._n_dim, units, np.full(len(units), float(round_number)))

    def _table(self) -> TestTable:
        """Return the known tests, under the formulation."""
        tests = by_number([self._tests])
        if len(self._others):  # tests of other runs come first
            n_others = len(self._others)
            others = renumbered(self._others, np.arange(1, n_others + 1))
            own = renumbered(tests, n_others + np.arange(1, len(tests) + 1))
            tests = others.extended(own)
        return self._model.under(tests, self._asked)

    def _size(self, n_free: int, n_eligible: int) -> int:
        """Return the size of the next round, for so many free workers and eligible tests."""
        if self._batch is not None:
            return self._batch
        if self._is_asynchronous:
            # Enough for the free workers, for those that end before it is there, and while the
            # next round is in the making.
            return max(1, n_free + 2 * self._n_ahead)
        if n_eligible < _LITTLE:
            return max(_FEW, self._executor.n_workers)
        return _BATCH

    @property
    def _n_ahead(self) -> int:
        """How many designs are tested while a round is in the making, so that no worker waits."""
        n_workers = self._executor.n_workers
        return max(1, n_workers // 4, min(self._n_meanwhile, n_workers))

    def wait(self) -> bool:
        """Wait for proposals that are in the making; return whether there were any."""
        if self._making is None:
            return False
        wait([self._making.units])
        return True

    def _round(self, first: int, n_free: int, pending: Points) -> Array:
        """Return the points that a round proposes, those of the study if it has them.

        There are none while they are in the making.
        """
        round_number = len(self._ends)
        if self._proposals is None:
            self._proposals = self._store.proposals()
        stored = [proposal for proposal in self._proposals if proposal.test_point >= first]
        if not stored:
            if self._making is None:
                self._making = self._begin(n_free, pending)
            making = self._making
            if not making.units.done():
                return np.zeros((0, 0))
            self._making = None
            self._n_meanwhile = len(self._tests) - making.n_tests
            content: dict[str, Any] = {}
            if len(making.pending):  # all tests before them were known but these
                content["pending"] = making.pending.numbers.tolist()
            if self._request:
                content["request"] = self._request
            proposals = []
            for number, point in enumerate(making.units.result().tolist(), first):
                entries = {"point": point} | content
                proposals.append(Proposal(number, round_number, "surrogates", entries))
            # Another process may have proposed the same meanwhile: one file, one truth.
            stored = self._store.propose(proposals)
        points = []
        for _, round_of_proposal, _, content in stored:
            if round_of_proposal == round_number:
                points.append(content["point"])
        return np.array(points)

    def _begin(self, n_free: int, pending: Points) -> _Making:
        """Begin to make a round: in another thread if tests are to be stored meanwhile."""
        units: Future[Array] = Future()
        if self._directed[1] != self._request:  # not while a round is in the making
            self._asked, self._request = self._directed
            self._fitted = 0, None  # to other outputs
        table = self._table()
        size = self._size(n_free, int(table.eligible().sum()))
        is_first = np.isin(self._tests.numbers, self._sequence.numbers)
        n_uniform = int(np.count_nonzero(is_first)) + len(self._others)

        def make() -> None:
            try:
                # Several threads would spin at matrices as small as these, ten times as long where
                # other work is going on, and their sums differ in the last digits from those of
                # one.
                with threadpool_limits(limits=1, user_api="blas"):
                    units.set_result(self._proposed(size, pending, table, n_uniform))
            except BaseException as error:
                units.set_exception(error)

        if self._is_asynchronous:
            Thread(target=make, daemon=True).start()
        else:
            make()
        return _Making(pending, len(self._tests), units)

    def _proposed(self, size: int, pending: Points, table: TestTable, n_uniform: int) -> Array:
        """Return ``(size, d)`` points that surrogates of the tests propose."""
        outputs = LearnedOutputs(self._model, table, self._asked)
        tests = outputs.known_tests(n_uniform, pending.units)
        goal = outputs.goal
        learned = self._learned(tests, n_uniform, goal)
        round_number = len(self._ends) - 1
        random = np.random.default_rng([self._seed, round_number])
        points = propose(tests, learned, goal, size, round_number, random)
        if self._model.noisy and learned is not None:
            points = with_repeats(points, tests, learned, goal)
        return points

    def _learned(self, tests: KnownTests, n_uniform: int, goal: Goal) -> Learned | None:
        """Return what is learned of the tests, or ``None`` if too few are known.

        Lengths are fitted to the first tests. The others are appended round by round, also where a
        run continues, as the last digits depend on it.
        """
        n_tests = len(tests.points)
        n_fitted = n_uniform
        ends = [len(self._others) + end for end in self._ends]
        for end in ends:
            if n_fitted * _GROWTH <= end <= n_tests:
                n_fitted = end
        is_known = ~tests.unknown
        if is_known[:n_fitted].sum() < _LEAST:
            n_fitted = n_tests
        if self._fitted[0] != n_fitted:
            rows = np.flatnonzero(is_known[:n_fitted])
            learned = None
            if len(rows) >= _LEAST:
                learned = _fitted(tests, rows, int(is_known[:n_uniform].sum()), goal)
                if self._is_asynchronous and len(rows) > _MOST_LEARNED:
                    fit = learned.fit
                    chosen = rows[best_and_spread(tests.Y[rows], fit, goal, _MOST_LEARNED)]
                    learned.leave_out(tests.numbers[np.setdiff1d(rows, chosen)])
            self._fitted = n_fitted, learned
        learned = self._fitted[1]
        if learned is not None:
            for end in (n_fitted, *ends, n_tests):
                if end >= n_fitted:
                    rows = np.flatnonzero(is_known[:end])
                    learned.extend(tests.numbers[rows], goal.encode(tests.points[rows]))
        return learned


def _fitted(tests: KnownTests, rows: Rows, n_uniform: int, goal: Goal) -> Learned:
    """Return surrogates fitted to some rows of tests, to which tests can be appended.

    Args:
        tests: The tests.
        rows: The rows.
        n_uniform: How many of these, the first, are of the sequence.
        goal: The goal of the search.
    """
    Z = goal.encode(tests.points[rows])
    return Learned(Fit.of(Z, bounded(tests.Y[rows]), max(n_uniform, _LEAST), goal.n_obj))


def proposed_now(
    model: Model, table: TestTable, pending: Array, size: int, seed: int, round_number: int
) -> Array:
    """Return ``(size, d)`` points that surrogates of tests propose outside of a run.

    Args:
        model: The model.
        table: All tests, under what is asked.
        pending: ``(p, d)`` the points that are being tested.
        size: How many points to propose.
        seed: The seed of the random numbers.
        round_number: The number of the round, from 0.
    """
    random = np.random.default_rng([seed, round_number])
    with threadpool_limits(limits=1, user_api="blas"):
        outputs = LearnedOutputs(model, table, model.formulation)
        tests, learned = _learned_now(outputs, table, pending)
        return propose(tests, learned, outputs.goal, size, round_number, random)


class Prospects(NamedTuple):
    """What surrogates expect of further tests under a formulation.

    Attributes:
        n_tests: How many tests.
        found: The probability that one or more of them keep all constraints and limits.
        gain: By what share of the hypervolume they are expected to enlarge it; NaN while there are
            fewer than two Pareto-optimal tests.
    """

    n_tests: int
    found: float
    gain: float


def prospects(table: TestTable, n_tests: int = 16) -> Prospects:
    """Return what surrogates expect of further tests, which they would propose, without a test.

    Surrogates are fitted to the tests, designs are proposed for the formulation of the table, and
    their outputs are drawn from the predictions of the surrogates, each design for itself. They see
    neither requirements nor what lies far from all tests.

    Args:
        table: Tests, under a formulation.
        n_tests: How many further tests.

    Raises:
        ArgumentValueError: There are fewer than 4 tests with outputs, or more than 2048 tests.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4), 64)
        >>> prospects(table).gain > 0.01
        True
    """
    n = len(table)
    if n > _MOST_LEARNED:
        remedy = "take some of them, as by table.rows(...)"
        raise invalid("the table", f"of {_MOST_LEARNED} tests at most", Received(f"{n}"), remedy)
    model = TestedModel(space_of_table(table.tested), len(table.tested.layout.inequalities))
    random = np.random.default_rng(0)
    with threadpool_limits(limits=1, user_api="blas"):
        outputs = LearnedOutputs(model, table, table.formulation)
        goal = outputs.goal
        tests, learned = _learned_now(outputs, table, np.zeros((0, len(goal.low))))
        if learned is None:
            raise invalid("the table", f"of {_LEAST} tests with outputs or more", Received(f"{n}"))
        points = propose(tests, learned, goal, n_tests, 0, random)
        draws = drawn(tests, learned, goal, points, _DRAWS, random)
    found = float(np.mean([len(F) > 0 for F in draws]))
    front = table.F[table.pareto()]
    if len(front) < 2:
        return Prospects(n_tests, found, np.nan)
    # The reference point is in units of the front, of which fixed ranges may hold a part only.
    frame = table.under(normalize=True, ranges={}).ranking().frame
    low = frame.scaled(np.vstack([front, *draws])).min(axis=0)
    volumes = []
    for F in [front[:0], *draws]:
        both = frame.scaled(np.vstack([front, F]))
        volumes.append(hypervolume((both - low) / (_REFERENCE - low), 1.0)[0])
    return Prospects(n_tests, found, float(np.mean(volumes[1:]) / volumes[0] - 1))


def _learned_now(
    outputs: LearnedOutputs, table: TestTable, pending: Array
) -> tuple[KnownTests, Learned | None]:
    """Return what surrogates learn from, and what is learned, outside of a run."""
    n_uniform = len(table)
    if PROPOSAL_ROUND in table.layout.outputs:
        is_proposed = table.column(PROPOSAL_ROUND) > 0
        n_uniform = int(np.append(is_proposed, True).argmax())
    tests = outputs.known_tests(n_uniform, pending)
    goal = outputs.goal
    rows = np.flatnonzero(~tests.unknown)
    if len(rows) < _LEAST:
        return tests, None
    n_known_uniform = int(np.count_nonzero(~tests.unknown[:n_uniform]))
    learned = _fitted(tests, rows, n_known_uniform, goal)
    learned.extend(tests.numbers[rows], goal.encode(tests.points[rows]))
    return tests, learned
