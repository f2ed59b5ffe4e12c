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
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from pymoo_psi._validation import (
    Designs,
    Mask,
    Numbers,
    Received,
    Values,
    identity_text,
    integer,
    invalid,
)
from pymoo_psi.algorithms._executor import Block, BlockFilter, Executor, executor_of
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
_MANY = 2**16  # tests after which there is one, too, so that they are joined once
_MOMENT = 0.2  # seconds between two looks whether a pause is over


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
        # The queue has the points of the source, by number, whose tests no block has returned yet.
        # Those up to number last_started are submitted, or their tests are stored; tests that are
        # there are ready. Whoever asks for tests waits for the first n_awaited points.
        self._queue = Points.none()
        self._last_started = 0
        self._ready: list[Block] = []
        self._n_awaited = 0
        self._work: Generator[list[Block]] | None = None
        self._is_paused = False
        self._is_stopped = False

    def __getstate__(self) -> Values:
        """Copies begin at the next block; what is being evaluated stays here."""
        return self.__dict__ | {"_ready": [], "_work": None}

    @property
    def n_left(self) -> int:
        """How many points are left whose tests no block has returned."""
        if self._is_stopped:
            return len(self._queue)
        return len(self._queue) + self.source.n_left

    def tests(self) -> Generator[Block]:
        """Test all points; yield blocks as they are ready, in any order, those of a study too.

        Close it early to stop the workers.

        Raises:
            WorkerError: A worker process was lost, or the problem cannot be sent to one.
        """
        self._n_awaited = sys.maxsize
        with closing(self._test_points()) as work:
            for blocks in work:
                for block in blocks:
                    self._forget(block.numbers)
                    yield block

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
            points = self.source.ask(least - len(self._queue), self._n_free)
            if len(points) == 0 and not self.source.wait():
                break
            self._queue = self._queue.joined(points)
        return self._queue.at(slice(0, count))

    def block(self, count: int | None) -> Block:
        """Test the next points; tests are stored within a second or two.

        Args:
            count: How many, as for :meth:`next_points`; there must be one.

        Returns:
            All their tests, by number.
        """
        points = self.next_points(count)
        last = points.numbers.max(initial=0)
        self._n_awaited = len(points)
        with stored_at_termination(self.store):
            try:
                while not self._are_ready(self._queue.numbers[: self._n_awaited]).all():
                    self._advance()
                if self.executor.n_pending == 0:
                    self._end_work()  # which releases the lock; workers are kept
            except BaseException:
                self.close()
                raise
        block = self._take(last)
        self._forget(block.numbers)  # all points, unless the run is stopped
        return block

    def _advance(self) -> None:
        """Test points until some are ready, or to the end."""
        if self._work is None:
            self._work = self._test_points()
        blocks = next(self._work, None)
        if blocks is None:
            self._work = None
        else:
            self._ready += blocks

    def _follow_requests(self) -> None:
        """Do what people ask of the run, and say so in the study."""
        for request in self.store.requests():
            try:
                changes = self._follow(request)
            except (PsiError, LookupError, TypeError) as error:
                changes = {"answer": f"refused: {error}"}
            if changes["answer"] != request["answer"]:
                self.store.answer(request | changes)

    def _follow(self, request: dict[str, Any]) -> dict[str, Any]:
        """Do what one request asks, which may come again when the run goes on; return the answer.

        It comes with what else is to be known of the request from then on.
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
        self.executor.hold(action != "continue")
        return {"answer": "done"}

    def _forget(self, numbers: Numbers) -> None:
        """Forget points whose tests are returned."""
        # A stop may have dropped some of them.
        self._queue = self._queue.at(~np.isin(self._queue.numbers, numbers))

    def _are_ready(self, numbers: Numbers) -> Mask:
        """``(n,)`` for which of n points the tests are ready."""
        ready = [block.numbers for block in self._ready]
        return np.isin(numbers, np.concatenate([[], *ready]))

    def _take(self, last: int) -> Block:
        """Take the tests of the points up to a number."""
        blocks = []
        later = []
        for block in self._ready:
            is_due = block.numbers <= last
            blocks.append(block.rows(is_due))
            if not is_due.all():
                later.append(block.rows(~is_due))
        self._ready = later
        tests = by_number([block.tests for block in blocks] or [self.store.empty])
        return Block(tests.numbers, tests, sum(block.n_called for block in blocks))

    def tell(self, tests: TestTable) -> None:
        """Take and store tests of the next points, which were evaluated elsewhere."""
        self.store.keep(tests)
        self._queue = self._queue.at(slice(len(tests), None))
        self.source.tell(tests)

    def close(self) -> None:
        """Stop what is being evaluated; tests that are ready are in the study, if there is one."""
        self._end_work()
        self._ready = []

    def _end_work(self) -> None:
        if self._work is not None:
            self._work.close()
        self._work = None

    @property
    def _n_free(self) -> int:
        return self.executor.n_workers - self.executor.n_pending

    def _test_points(self) -> Generator[list[Block]]:
        """Test the awaited points, and some ahead; yield blocks as they are ready."""
        executor = self.executor
        self._last_started = 0
        if self._repeats is not None:
            self._repeats.waiting.clear()
        with self.store.session() as recall:
            try:
                self._follow_requests()
                yield from self._start(recall, self._n_awaited)
                if executor.n_pending:  # nothing ahead of points whose tests are all stored
                    yield from self._start(recall, self._n_awaited + executor.ahead)
                began = time.monotonic()
                computed = 0.0
                while executor.n_pending or self._is_paused:
                    if executor.n_pending:
                        computed += executor.wait()
                    else:
                        time.sleep(_MOMENT)
                    self._follow_requests()
                    if executor.n_evaluated and self._is_commit_due(began, computed):
                        yield self._keep(executor.take())
                        began = time.monotonic()
                        computed = 0.0
                    yield from self._start(recall, self._n_awaited + executor.ahead)
                if self._is_stopped:  # points without a test are left
                    self._queue = self._queue.at(self._are_ready(self._queue.numbers))
            finally:
                if executor.n_evaluated:
                    self._keep(executor.take())  # nobody waits for the blocks
                executor.close()

    def _is_commit_due(self, began: float, computed: float) -> bool:
        """Whether to store the tests evaluated since a time, in so many seconds of the workers."""
        executor = self.executor
        # of a thousand workers, results of a second are stored together, not two of them
        much = max(COMPUTED, SECONDS * executor.n_workers)
        is_late = computed >= much or time.monotonic() - began >= SECONDS
        last_awaited = self._queue.numbers[: self._n_awaited].max(initial=0)
        is_complete = executor.n_pending == 0 or executor.first_pending > last_awaited
        are_many = executor.n_evaluated >= _MANY
        return is_late or are_many or is_complete or self.source.eager

    def _start(self, recall: Recall, count: int) -> Generator[list[Block]]:
        """Start the first ``count`` points: recall stored tests, and submit the other points."""
        while True:
            points = self._next_to_start(count)
            if len(points) == 0:
                return
            is_ready = self._are_ready(points.numbers)  # when the run was at work before
            points = points.at(~is_ready)
            stored = recall(points)
            if len(stored):
                points = points.at(~np.isin(points.numbers, stored.numbers))
                yield self._report(Block(stored.numbers, stored))
            if len(points):
                yield self._submit(points)

    def _next_to_start(self, count: int) -> Points:
        """Return points to start, ``count`` being started; ask the source for more if needed."""
        n_started = int(np.count_nonzero(self._queue.numbers <= self._last_started))
        n_new = min(count - n_started, self.executor.room)
        if n_new <= 0 or self._is_paused or self._is_stopped:
            return Points.none()
        # a source that is eager to learn from tests knows all that are there before it is asked
        is_informed = not (self.source.eager and self.executor.n_evaluated)
        if n_started == len(self._queue) and self.source.n_left > 0 and is_informed:
            points = self.source.ask(n_new, self._n_free)
            self._queue = self._queue.joined(points)
        points = self._queue.at(slice(n_started, n_started + n_new))
        self._last_started = points.numbers.max(initial=self._last_started)
        return points

    def _submit(self, points: Points) -> list[Block]:
        """Submit points; return tests of those that need no evaluation."""
        blocks = []
        if self.model.has_requirements:
            violations = self.model.violations(points.matrix(self.model.space))
            is_unmet = (violations > 0).any(axis=1)
            n_unmet = np.count_nonzero(is_unmet)
            self.model.problem.n_not_run += n_unmet
            if n_unmet:
                blocks.append(self._answer(points.at(is_unmet), [{"failure": ""}] * n_unmet))
            points = points.at(~is_unmet)
        if self._repeats is not None and len(points):
            X = points.matrix(self.model.space)
            new, known, values = self._repeats.split(points.numbers, X)
            if values:
                blocks.append(self._answer(points.at(known), values))
            points = points.at(new)
        if len(points):
            self.executor.submit(points)
        return blocks

    def _keep(self, block: Block) -> list[Block]:
        """Store tests and report them; see :meth:`_report`."""
        self.store.keep(block.tests, block.seconds)
        return self._report(block)

    def _report(self, block: Block) -> list[Block]:
        """Report stored tests to the source; return them, and those of repetitions that waited."""
        self.source.tell(block.tests)
        if self._repeats is None:
            return [block]
        numbers, values = self._repeats.learn(block.tests)
        if not numbers:
            return [block]
        rows = np.searchsorted(self._queue.numbers, numbers)
        return [block, self._answer(self._queue.at(rows), values)]

    def _answer(self, points: Points, values: Sequence[Values]) -> Block:
        """Store, report and return tests whose values are known without the model."""
        block = Block(points.numbers, self.model.tests(points, values))
        self.store.keep(block.tests, block.seconds)
        self.source.tell(block.tests)
        return block


class Repeats:
    """The results of a run by design, where designs recur as no variable is real.

    Args:
        model: The model.
        tests: Known tests.

    Attributes:
        known: The values of every design that is known.
        waiting: For each design being evaluated, the numbers of the other points with it.
    """

    def __init__(self, model: Model, tests: TestTable) -> None:
        self._model = model
        self.known: dict[tuple[str, ...], Values] = {}
        self.waiting: dict[tuple[str, ...], list[int]] = {}
        self.learn(tests)

    def learn(self, tests: TestTable) -> tuple[list[int], list[Values]]:
        """Learn the results of tests; return the points that waited for them, and their values."""
        numbers = []
        answers = []
        for key, values in zip(design_keys(tests.X), self._model.values(tests), strict=True):
            self.known.setdefault(key, values)
            for number in self.waiting.pop(key, ()):
                numbers.append(number)
                answers.append(values)
        return numbers, answers

    def split(self, numbers: Numbers, X: Designs) -> tuple[list[int], list[int], list[Values]]:
        """Return which points, with designs X, to evaluate; which are known; and their values."""
        new = []
        known = []
        answers = []
        for row, key in enumerate(design_keys(X)):
            if key in self.known:
                known.append(row)
                answers.append(self.known[key])
            elif key in self.waiting:
                self.waiting[key].append(int(numbers[row]))
            else:
                self.waiting[key] = []
                new.append(row)
        return new, known, answers


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
    kept = None
    if keep != "all" and options.study is None and repeats is None:
        kept = BlockFilter(keep, model)
    executor = executor_of(
        model,
        options,
        n_points=len(points),
        runner=runner,
        may_end_early=may_end_early,
        kept=kept,
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
