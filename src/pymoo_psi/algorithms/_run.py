"""A run: it joins a source of points, an executor that evaluates them, and a store of tests.

It asks the source for points, recalls the tests that are stored, lets no model run for a design
that violates a requirement, answers repetitions of a design from its known result, submits the
other points to the executor, stores the tests that arrive and returns them in blocks. For the same
points the table is the same for any number of workers and any size of a block.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from pymoo_psi._validation import (
    Mask,
    Numbers,
    Received,
    Values,
    identity_text,
    integer,
    invalid,
)
from pymoo_psi.algorithms._executor import Block, Executor, executor_of
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._sources import (
    PlannedPoints,
    Points,
    Source,
    unit_points,
)
from pymoo_psi.algorithms._store import Recall, Store, StudyStore, renumbered, stored_at_termination
from pymoo_psi.errors import PsiError
from pymoo_psi.parallel import Runner
from pymoo_psi.problems import problem_identity
from pymoo_psi.table import Formulation, TestTable, design_keys, limit_text

# Seconds between two commits of a study: a commit of some milliseconds does not count beside them,
# and not much more is lost when the process is killed.
SECONDS = 1.0
# Seconds of computing, by all workers together, after which there is a commit in any case: results
# of slow designs that arrive together must not wait for the next one, perhaps for hours.
COMPUTED = 20.0
# Tests after which there is a commit in any case, so that their tables are joined only once.
_MANY = 2**16
_PAUSE_SECONDS = 0.2  # between two looks whether a pause is over


class Run:
    """The testing of the points of a source.

    Args:
        model: The model, which makes tests of values.
        source: Where the points come from.
        executor: What evaluates them.
        store: Where tests are recalled and kept.
        repeats: The results by design, where designs recur; ``None`` if they do not.
        n_points: How many points the run has in all, those of other shares too.
    """

    def __init__(
        self,
        model: Model,
        source: Source,
        executor: Executor,
        store: Store,
        repeats: Repeats | None = None,
        n_points: int = 0,
    ) -> None:
        self.model = model
        self.n_points = n_points
        self.source = source
        self.executor = executor
        self.store = store
        self._repeats = repeats
        self._queue = _Queue()
        # the evaluation of the points in the queue, which is suspended between two blocks
        self._work: Generator[None] | None = None
        self._is_paused = False
        self._is_stopped = False

    def __getstate__(self) -> Values:
        """Copies begin at the next block; what is being evaluated stays here."""
        return self.__dict__ | {"_work": None}

    @property
    def n_left(self) -> int:
        """How many points are left whose tests no block has returned."""
        if self._is_stopped:
            return len(self._queue)
        return len(self._queue) + self.source.n_left

    # Blocks of tests

    def tests(self) -> Generator[Block]:
        """Test all points; yield blocks as they are ready, in any order, those of a study too.

        Close it early to stop the workers.

        Raises:
            WorkerError: A worker process was lost, or the problem cannot be sent to one.
        """
        self._queue.n_awaited = sys.maxsize
        try:
            while self._advance():
                yield from self._queue.take_all()
        finally:
            self.close()

    def next_points(self, count: int | None) -> Points:
        """Return the points of the next block, the same ones until they are tested.

        Args:
            count: How many, at most; ``None`` for all that the source has returned, or returns now.
        """
        least = count or 1
        while len(self._queue) < least:
            self._follow_requests()
            if self._is_stopped:
                break
            if self._is_paused:
                self._advance()
                continue
            if self._ask(least - len(self._queue)) == 0 and not self.source.wait():
                break
        return self._queue.points.at(slice(0, count))

    def block(self, count: int | None) -> Block:
        """Test the next points; tests are stored within a second or two.

        Args:
            count: How many, as for :meth:`next_points`; there must be one.

        Returns:
            All their tests, by number.
        """
        points = self.next_points(count)
        self._queue.n_awaited = len(points)
        with stored_at_termination(self.store):
            try:
                while not self._queue.are_ready(self._queue.awaited).all():
                    self._advance()
                if self.executor.n_pending_tasks == 0:
                    self._end_work()  # which releases the lock; workers are kept
            except BaseException:
                self.close()
                raise
        # all points, unless the run was stopped
        blocks = self._queue.take(points.numbers.max(initial=0))
        tests = by_number([block.tests for block in blocks] or [self.store.empty])
        return Block(tests.numbers, tests, sum(block.n_called for block in blocks))

    def tell(self, tests: TestTable) -> None:
        """Take and store tests of the next points, which were evaluated elsewhere."""
        self.store.keep(tests)
        self._queue.drop(tests.numbers)
        self.source.tell(tests)

    def close(self) -> None:
        """Stop what is being evaluated; tests that are ready are in the study, if there is one."""
        self._end_work()
        self._queue.ready = []

    def _advance(self) -> bool:
        """Test points until some are ready; return whether there were any left."""
        if self._work is None:
            self._work = self._test_points()
        for _ in self._work:
            return True
        self._work = None
        return False

    def _end_work(self) -> None:
        if self._work is not None:
            self._work.close()
        self._work = None

    # What people ask for

    def _follow_requests(self) -> None:
        """Do what people ask of the run, and say so in the study."""
        for request in self.store.requests():
            try:
                changes = self._follow(request)
            except (PsiError, LookupError, TypeError) as error:
                changes = {"answer": f"refused: {error}"}
            if changes["answer"] != request["answer"]:
                self.store.answer(request | changes)

    def _follow(self, request: Values) -> Values:
        """Do what one request asks, which may come again when the run goes on.

        Returns:
            The answer, and other entries of the request to be stored with it.
        """
        action = request["action"]
        if action == "search":
            text = json.dumps(request["formulation"]).encode()
            formulation = Formulation.from_json(text, "the request")
            formulation = self.model.with_default_limits(formulation)
            # a wrong one is refused here
            table = self.model.under_so_far(TestTable.empty(self.model.layout), formulation)
            self.source.direct(formulation, request["number"])
            limits = [limit_text(name, limit) for name, limit in table.limits.items()]
            objectives = ", ".join(table.layout.objectives)
            within = f"{objectives} within {', '.join(limits) or 'no limits'}"
            return {"answer": f"{within}, from the next proposal"}
        if action == "more":
            total = request.get("points")
            if total is None:
                total = self.n_points + integer("count", request["count"], minimum=1)
            if total > self.n_points:
                self.source.extend(total - self.n_points)
                self.n_points = total
            return {"answer": f"{total} tests in all", "points": total}
        self._is_paused = action == "pause"
        self._is_stopped = action == "stop"
        if action == "continue":
            self.executor.resume()
        else:
            self.executor.pause()
        return {"answer": "done"}

    # The work: from points to tests

    def _ask(self, count: int) -> int:
        """Ask the source for ``count`` points, for the queue; return how many it has returned."""
        points = self.source.ask(count)
        self._queue.append(points)
        return len(points)

    def _test_points(self) -> Generator[None]:
        """Test the awaited points, and some ahead; yield whenever tests are ready."""
        executor = self.executor
        self._queue.restart()
        if self._repeats is not None:
            self._repeats.restart()
        with self.store.session() as recall:
            try:
                self._follow_requests()
                yield from self._start(recall, self._queue.n_awaited)
                if executor.n_pending_tasks:  # nothing ahead of points whose tests are all stored
                    yield from self._start(recall, self._queue.n_awaited + executor.n_ahead)
                began = time.monotonic()
                computed = 0.0
                while executor.n_pending_tasks or self._is_paused:
                    if executor.n_pending_tasks:
                        computed += executor.wait()
                    else:
                        time.sleep(_PAUSE_SECONDS)
                    self._follow_requests()
                    if executor.n_evaluated and self._is_commit_due(began, computed):
                        self._keep(executor.take())
                        yield
                        began = time.monotonic()
                        computed = 0.0
                    yield from self._start(recall, self._queue.n_awaited + executor.n_ahead)
                if self._is_stopped:  # points without a test are left
                    is_ready = self._queue.are_ready(self._queue.points)
                    self._queue.drop(self._queue.points.numbers[~is_ready])
            finally:
                if executor.n_evaluated:
                    self._keep(executor.take())
                executor.close()

    def _is_commit_due(self, began: float, computed: float) -> bool:
        """Whether to store the evaluated tests now.

        Args:
            began: The time of the last commit.
            computed: Seconds of computing since then, of all workers together.
        """
        executor = self.executor
        # A thousand workers compute 20 s in a moment: their results of a second are kept together.
        much = max(COMPUTED, SECONDS * executor.n_workers)
        is_late = computed >= much or time.monotonic() - began >= SECONDS
        last_awaited = self._queue.awaited.numbers.max(initial=0)
        is_complete = executor.n_pending_tasks == 0 or executor.first_pending > last_awaited
        are_many = executor.n_evaluated >= _MANY
        return is_late or are_many or is_complete or self.source.eager

    def _start(self, recall: Recall, count: int) -> Generator[None]:
        """Start the first ``count`` points: recall stored tests, and submit the other points."""
        while not (self._is_paused or self._is_stopped):
            points = self._next_to_start(count)
            if len(points) == 0:
                return
            is_ready = self._queue.are_ready(points)  # when the run was at work before
            points = points.at(~is_ready)
            stored = recall(points)
            if len(stored):
                points = points.at(~np.isin(points.numbers, stored.numbers))
                self._report(Block(stored.numbers, stored))
            self._submit(points)
            yield

    def _next_to_start(self, count: int) -> Points:
        """Return points to start, ``count`` being started; ask the source for more if needed."""
        n_started = self._queue.n_started
        n_new = min(count - n_started, self.executor.room)
        if n_new <= 0:
            return Points.none()
        # A source that is eager is asked only when it knows all tests that are evaluated.
        is_informed = not (self.source.eager and self.executor.n_evaluated)
        if n_started == len(self._queue) and self.source.n_left > 0 and is_informed:
            self._ask(n_new)
        return self._queue.start(n_new)

    def _submit(self, points: Points) -> None:
        """Submit points; those that need no evaluation are answered."""
        if self.model.has_requirements and len(points):
            violations = self.model.violations(points.matrix(self.model.space))
            is_unmet = (violations > 0).any(axis=1)
            n_unmet = np.count_nonzero(is_unmet)
            self.model.problem.n_not_run += n_unmet
            self._answer(points.at(is_unmet), [{"failure": ""}] * n_unmet)
            points = points.at(~is_unmet)
        if self._repeats is not None and len(points):
            points = self._repeats.new(points)
            self._answer_repeats(self._repeats)
        if len(points):
            self.executor.submit(points)

    def _keep(self, block: Block) -> None:
        """Store and report tests."""
        self.store.keep(block.tests, block.seconds)
        self._report(block)

    def _report(self, block: Block) -> None:
        """Report stored tests to the source; they are ready, and those of their repetitions."""
        self.source.tell(block.tests)
        self._queue.ready.append(block)
        if self._repeats is not None:
            self._repeats.learn(block.tests)
            self._answer_repeats(self._repeats)

    def _answer_repeats(self, repeats: Repeats) -> None:
        """Answer the points whose designs have a result."""
        answers = repeats.take_answers()
        rows = np.searchsorted(self._queue.points.numbers, [*answers])
        self._answer(self._queue.points.at(rows), [*answers.values()])

    def _answer(self, points: Points, values: Sequence[Values]) -> None:
        """Store and report tests whose values are known without the model."""
        if len(points):
            self._keep(Block(points.numbers, self.model.tests(points, values)))


class _Queue:
    """The points of a run whose tests are not returned yet, by number.

    The first of them are started: they are submitted, or their tests are stored.

    Attributes:
        points: The points.
        n_awaited: How many of them, the first, are awaited.
        ready: The tests of started points, as far as they are there.
    """

    def __init__(self) -> None:
        self.points = Points.none()
        self.n_awaited = 0
        self.ready: list[Block] = []
        self._last_started = 0

    def __getstate__(self) -> Values:
        """Copies have all points and no tests."""
        return self.__dict__ | {"ready": []}

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self.points)

    @property
    def awaited(self) -> Points:
        """The points that are awaited."""
        return self.points.at(slice(0, self.n_awaited))

    @property
    def n_started(self) -> int:
        """How many points are started."""
        return int(np.count_nonzero(self.points.numbers <= self._last_started))

    def append(self, points: Points) -> None:
        """Append points of higher numbers."""
        self.points = self.points.joined(points)

    def drop(self, numbers: Numbers) -> None:
        """Drop points."""
        self.points = self.points.at(~np.isin(self.points.numbers, numbers))

    def start(self, count: int) -> Points:
        """Start the first points that are not started; return them."""
        first = self.n_started
        points = self.points.at(slice(first, first + count))
        self._last_started = points.numbers.max(initial=self._last_started)
        return points

    def restart(self) -> None:
        """Let no point be started."""
        self._last_started = 0

    def are_ready(self, points: Points) -> Mask:
        """``(n,)`` for which of n points the tests are ready."""
        numbers = [block.numbers for block in self.ready]
        return np.isin(points.numbers, np.concatenate([[], *numbers]))

    def take(self, last: int) -> list[Block]:
        """Take the tests of the points up to a number, each of which has one; drop these points."""
        blocks = []
        later = []
        for block in self.ready:
            is_due = block.numbers <= last
            blocks.append(block.rows(is_due))
            if not is_due.all():
                later.append(block.rows(~is_due))
        self.ready = later
        # A stop may have dropped some of the points.
        self.drop(np.concatenate([[], *[block.numbers for block in blocks]]))
        return blocks

    def take_all(self) -> Generator[Block]:
        """Take all tests that are ready, of which a filter may have left some out."""
        while self.ready:
            block = self.ready.pop(0)
            self.drop(block.numbers)
            yield block


class Repeats:
    """The results of a run by design, where designs recur as no variable is real.

    Points with the same design wait for the result of the first of them.

    Args:
        model: The model.
        tests: Known tests.
    """

    def __init__(self, model: Model, tests: TestTable) -> None:
        self._model = model
        self._values: dict[tuple[str, ...], Values] = {}  # of each design with a result
        self._waiting: dict[tuple[str, ...], list[int]] = {}  # points, by design
        self._answers: dict[int, Values] = {}  # the values of points that need not wait
        self.learn(tests)

    def restart(self) -> None:
        """Let no design be evaluated, and no point wait."""
        self._waiting.clear()

    def learn(self, tests: TestTable) -> None:
        """Learn the results of tests, for which points may wait."""
        for key, values in zip(design_keys(tests.X), self._model.values(tests), strict=True):
            self._values.setdefault(key, values)
            for number in self._waiting.pop(key, ()):
                self._answers[number] = values

    def new(self, points: Points) -> Points:
        """Return the points to evaluate; the others have a result, or wait for one."""
        rows = []
        keys = design_keys(points.matrix(self._model.space))
        for row, key in enumerate(keys):
            number = int(points.numbers[row])
            if key in self._values:
                self._answers[number] = self._values[key]
            elif key in self._waiting:
                self._waiting[key].append(number)
            else:
                self._waiting[key] = []
                rows.append(row)
        return points.at(rows)

    def take_answers(self) -> dict[int, Values]:
        """Take the values of points that need not wait any more, by their numbers."""
        answers = self._answers
        self._answers = {}
        return answers


def run_of_sequence(
    problem: Any,
    n_points: int,
    options: RunOptions,
    *,
    keep: str = "all",
    runner: Runner | None = None,
    may_end_early: bool = True,
    method: str = "",
    n_first: int | None = None,
    repeat: int = 1,
) -> Run:
    """Return a run that tests the points of a sequence, or a share of them.

    Args:
        problem: A pymoo problem.
        n_points: How many points the run has, those of other shares too.
        options: The options of the run.
        keep: Which tests are needed: ``"all"``, the ``"feasible"`` ones, or the ``"pareto"`` set.
            Others are left out where they are evaluated, unless they are to be stored or repeated.
        runner: What evaluates a vectorised problem; ``None`` is this process.
        may_end_early: Whether a termination may end the run before all points are tested.
        method: By what designs are proposed after these points, for the study; the caller changes
            the source of the run.
        n_first: How many of the points, at most, are of the sequence.
        repeat: Which of the tests of each design the run makes.
    """
    model = Model(problem, options, repeat)
    model.under_so_far(TestTable.empty(model.layout))  # a wrong formulation is refused here
    integer("n_points", n_points, minimum=1)
    n_dim = len(model.space.searched)
    sampling = options.sampling_in(n_dim)
    if options.more and not sampling.extendable:
        raise invalid("more", "used with a sequence that can be continued", Received(sampling))
    table = table_of_run(model, options, lambda: sampling.identity(n_points, options.seed) + method)
    store = Store(table)
    if options.study is not None:
        store = StudyStore(table, options, model)
    if options.more:
        n_points = store.total(n_points)
    points = unit_points(options, min(n_points, n_first or n_points), n_dim)
    store.plan(options.first + n_points - 1)
    repeats = None
    if model.space.finite and not model.noisy and (model.problem.elementwise or runner is None):
        repeats = Repeats(model, store.known())
    if options.study is not None or repeats is not None:
        keep = "all"
    executor = executor_of(
        model,
        options,
        n_points=len(points),
        runner=runner,
        may_end_early=may_end_early,
        keep=keep,
    )
    continued = None
    if sampling.extendable and options.share is None:
        continued = partial(unit_points, options, n_dim=n_dim)
    return Run(model, PlannedPoints(points, continued), executor, store, repeats, n_points)


def repeated_tests(
    tested: Callable[[Run], TestTable],
    problem: Any,
    n_points: int,
    options: RunOptions,
    keep: str = "all",
    runner: Runner | None = None,
) -> tuple[Run, TestTable]:
    """Return the run of the first tests of all designs, and these tests followed by repeats.

    Args:
        tested: Returns the tests of a run.
        problem: A pymoo problem.
        n_points: How many points the run has.
        options: The options of the run.
        keep: As for :func:`run_of_sequence`.
        runner: As for :func:`run_of_sequence`.

    Raises:
        ArgumentValueError: There are repeats, and the problem is not noisy, or of shares.
    """
    if options.repeat > 1 and not getattr(problem, "noisy", False):
        remedy = "a stochastic model says so by noisy = True, or the command by --noisy"
        raise invalid("repeat", "1 for a model that is not noisy", options.repeat, remedy)
    if options.repeat > 1 and options.share:
        raise invalid("repeat", "1 with a share, which has one run", options.repeat)
    first = run_of_sequence(problem, n_points, options, keep=keep, runner=runner)
    table = tested(first)
    options = replace(options, more=False)
    for repeat in range(2, options.repeat + 1):
        run = run_of_sequence(problem, first.n_points, options, runner=runner, repeat=repeat)
        tests = tested(run)
        table = table.extended(renumbered(tests, tests.numbers + table.numbers.max()))
    return first, table


def table_of_run(model: Model, options: RunOptions, sampling: Callable[[], str]) -> TestTable:
    """Return the table of a run without tests, with what makes its tests belong together.

    Args:
        model: The model.
        options: The options of the run.
        sampling: Returns what the study calls the origin of the points.

    Raises:
        PsiError: A file cannot hold the identity, and a study or a share needs it.
    """
    table = TestTable.empty(model.layout)
    try:
        identity = problem_identity(model.problem)
        text = identity_text(identity | {"sampling": sampling(), "key": options.study_key})
    except PsiError:
        # Shares must be of the same points, whether they are stored or not.
        if options.study is not None or options.part.of > 1:
            raise
        return table
    return replace(table, problem=json.loads(text))


def by_number(tables: Sequence[TestTable]) -> TestTable:
    """Return tables that have no test in common as one, by number."""
    # Blocks of workers come in any order; rows that are sorted then need no second copy.
    first, *others = sorted(tables, key=lambda table: table.numbers.max(initial=0))
    table = first.extended(*others)
    if (np.diff(table.numbers) < 0).any():
        table = table.rows(np.argsort(table.numbers, kind="stable"))  # faster for a few runs
    return table
