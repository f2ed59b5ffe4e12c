"""A run: it joins a source of points, an executor that evaluates them, and a store of tests.

:meth:`Run.tests` and :meth:`Run.block` repeat one step (``_advance``), in which points go on from
one state to the next; the :class:`Ledger` knows the state of each:

- pending: the source has returned the point (``_ask``);
- started (``_start``): a test that the store has, or that needs no evaluation, is stored at once;
  the point is put into the queue of the executor otherwise;
- evaluated: a worker has returned its values (``_advance``);
- stored (``_store_evaluated``): the study has its test, and so has the source;
- taken (``_take``): the caller has the test, and the ledger forgets the point.

Before each step the run does what people ask of it. For the same points the table is the same for
any number of workers and any size of a block.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import timedelta
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import (
    Mask,
    Values,
    integer,
    invalid,
)
from pymoo_psi.algorithms._executor import Block, Evaluation, Executor
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._sources import (
    PlannedPoints,
    Points,
    RunOptions,
    Source,
    unit_points,
)
from pymoo_psi.algorithms._store import Store, renumbered, store_of, stored_at_termination
from pymoo_psi.errors import PsiError
from pymoo_psi.problems import require_no_permutation
from pymoo_psi.study import LAST, further_tests
from pymoo_psi.table import Decision, TestTable

# Seconds between two commits of a study: a commit of some milliseconds does not count beside them,
# and not much more is lost when the process is killed.
SECONDS = 1.0
# Seconds of computing, by all workers together, after which there is a commit in any case: results
# of slow designs that arrive together must not wait for the next one, perhaps for hours.
COMPUTED = 20.0
SourceOf = Callable[[Points, int, Model, Executor, Store], Source]
_PAUSE_SECONDS = 0.2  # between two looks whether a pause is over
_EVERY = 60.0  # seconds between two lines of a log


# The states of a point, in their order; 0 is before its start.
PENDING, STARTED, EVALUATED, STORED = range(4)


class Ledger:
    """The points of a run that its source has returned, until their tests are taken.

    Points are started in their order, and evaluated and stored in any order.

    Args:
        points: The points, all of which are pending.

    Attributes:
        points: ``(n,)`` the points, by number.
        states: ``(n,)`` the state of each.
        evaluations: What the evaluated ones have returned.
        seconds: How long these evaluations took, all together.
        blocks: The tests of the stored ones.
    """

    def __init__(self, points: Points) -> None:
        self.points = points
        # small, as each step looks at all of them
        self.states = np.full(len(points), PENDING, dtype=np.int8)
        self.blocks: list[Block] = []
        self.forget_evaluations()

    @property
    def n_started(self) -> int:
        """How many of the points, the first ones, are no longer pending."""
        return int(np.count_nonzero(self.states))

    def are_all(self, state: int, count: int) -> bool:
        """Whether the first points, so many of them, have reached a state."""
        return bool(self.states[:count].min(initial=STORED) >= state)

    def add(self, points: Points) -> None:
        """Add pending points, numbered above all earlier ones."""
        self.points = self.points.joined(points)
        self.states = np.append(self.states, np.zeros(len(points), dtype=np.int8))

    def start(self, count: int) -> Points:
        """Start the next points, ``count`` or as many as there are; return them."""
        n_started = self.n_started
        rows = slice(n_started, n_started + count)
        self.states[rows] = STARTED
        return self.points.at(rows)

    def evaluate(self, evaluation: Evaluation) -> None:
        """Note what the evaluation of points has returned."""
        self.evaluations.append(evaluation)
        self._mark(evaluation.numbers, EVALUATED)
        self.seconds += evaluation.seconds

    def forget_evaluations(self) -> None:
        """Forget what evaluations have returned, as it is stored."""
        self.evaluations: list[Evaluation] = []
        self.seconds = 0.0

    def store(self, block: Block) -> None:
        """Note tests that are stored."""
        self._mark(block.numbers, STORED)
        self.blocks.append(block)

    def _mark(self, numbers: ArrayLike, state: int) -> None:
        self.states[np.searchsorted(self.points.numbers, numbers)] = state

    def take(self, last: int) -> Iterator[Block]:
        """Take the stored tests of the points up to a number."""
        blocks = self.blocks
        self.blocks = []
        for block in blocks:
            is_due = block.numbers <= last
            if not is_due.all():  # otherwise a filter may have left out some of its tests
                self.blocks.append(block.rows(~is_due))
                block = block.rows(is_due)
            self.keep(~np.isin(self.points.numbers, block.numbers))
            yield block

    def keep(self, rows: Mask) -> None:
        """Keep some points, and drop the others."""
        self.points = self.points.at(rows)
        self.states = self.states[rows]


class Run:
    """The testing of the points of a source.

    Args:
        model: The model, which makes tests of values.
        source: Where the points come from.
        executor: What evaluates them.
        store: Where tests are recalled and kept.
        n_points: How many points the run has in all, those of other shares too.

    Attributes:
        n_taken: The tests of how many points it has returned.
        n_called: For how many of these the model was called.
        remarks: What people have added to it.
    """

    def __init__(
        self,
        model: Model,
        source: Source,
        executor: Executor,
        store: Store,
        n_points: int = 0,
    ) -> None:
        self.model = model
        self.n_points = n_points
        self.source = source
        self.executor = executor
        self.store = store
        self.n_taken = 0
        self.n_called = 0
        self.remarks: list[str] = []
        self._ledger = Ledger(Points.none())
        # Of the study, while points are evaluated, which may go on between two calls.
        self._lock: ExitStack | None = None
        self._last_commit = 0.0  # its time, or that of the beginning
        self._steering = "continue"  # the last request of people: to continue, pause or stop

    def __getstate__(self) -> Values:
        """Copies begin at the next block; what is being evaluated stays here."""
        return self.__dict__ | {"_ledger": Ledger(self._ledger.points), "_lock": None}

    def __del__(self) -> None:
        """Keep what is evaluated if nobody has closed the run."""
        self._end_testing()

    @property
    def n_left(self) -> int:
        """How many points are left whose tests no block has returned."""
        n_left = len(self._ledger.points)
        if self._steering != "stop":
            n_left += self.source.n_left
        return n_left

    # Blocks of tests

    def tests(self) -> Generator[TestTable]:
        """Test all points; yield tests as they are ready, in any order, those of a study too.

        Close it early to stop the workers.

        Raises:
            WorkerError: A worker process was lost, or the problem cannot be sent to one.
        """
        try:
            while self._advance(LAST):
                yield from self._take(LAST)
        finally:
            self.close()

    def next_points(self, count: int | None) -> Points:
        """Return the points of the next block, the same ones until they are tested.

        Args:
            count: How many, at most; ``None`` for all that the source has returned, or returns now.
        """
        ledger = self._ledger
        least = count or 1
        while len(ledger.points) < least:
            self._follow_requests()
            if self._steering == "stop":
                break
            if self._steering == "pause":
                self._advance(0)
            elif self._ask(least - len(ledger.points)) == 0:
                break
        return ledger.points.at(slice(0, count))

    def block(self, count: int | None) -> TestTable:
        """Test the next points; tests are stored within a second or two.

        Args:
            count: How many, as for :meth:`next_points`; there must be one.

        Returns:
            All their tests, by number, unless the run was stopped.
        """
        points = self.next_points(count)
        n_points = len(points)
        with stored_at_termination(self.store):
            try:
                while not self._ledger.are_all(STORED, n_points):
                    if not self._advance(n_points):
                        break
                if self.executor.queue.n_pending == 0:
                    self._end_testing()  # releases the lock; workers are kept
            except BaseException:
                self.close()
                raise
        last = int(points.numbers.max(initial=0))
        return by_number([*self._take(last)] or [self.store.empty])

    def tell(self, tests: TestTable) -> None:
        """Take and store tests of the next points, which were evaluated elsewhere."""
        self.store.keep(tests)
        self.executor.learn(tests)
        self._ledger.keep(~np.isin(self._ledger.points.numbers, tests.numbers))
        self.source.tell(tests)

    def known(self, points: Points) -> TestTable:
        """Return the tests of the points that need no evaluation, by number."""
        stored = self.store.recall(points)
        answers = self.executor.answers(points.without(stored.numbers))
        return by_number([stored, *(block.tests for block in answers)])

    def close(self) -> None:
        """Stop what is being evaluated; tests that are ready are in the study, if there is one."""
        self._end_testing()
        self._ledger = Ledger(self._ledger.points)

    def _end_testing(self) -> None:
        """Store what is evaluated, give up what is not, and release the lock of the study."""
        if self._lock is None:
            return
        try:
            self._store_evaluated()
        finally:
            self.executor.close()
            self._lock.close()
            self._lock = None

    def _take(self, last: int) -> Iterator[TestTable]:
        """Take the stored tests of the points up to a number."""
        for block in self._ledger.take(last):
            self.n_taken += len(block.numbers)
            if block.is_called:
                self.n_called += len(block.numbers)
            yield block.tests

    def numbered(self, tests: TestTable) -> TestTable:
        """Return tests of the run with the numbers that they have in the study."""
        table = self.store.numbered(tests)
        return replace(table, remarks=(*table.remarks, *self.remarks))

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
            return {"answer": self._direct(request)}
        if action == "more":
            return self._extend(request)
        self._steering = action
        self.executor.queue.is_paused = action != "continue"
        return {"answer": "done"}

    def _direct(self, request: Values) -> str:
        """Let the source follow another formulation; return what it searches."""
        text = json.dumps(request["formulation"]).encode()
        formulation = Decision.from_json(text, "the request").formulation
        formulation = self.model.with_default_limits(formulation)
        # a wrong one is refused here
        table = self.model.under_so_far(TestTable.empty(self.model.schema), formulation)
        self.source.direct(formulation)
        limits = [limit.written(name) for name, limit in table.limits.items()]
        objectives = ", ".join(table.schema.objectives)
        return f"{objectives} within {', '.join(limits) or 'no limits'}, from the next proposal"

    def _extend(self, request: Values) -> Values:
        """Add points to the run that the request was made to; a smaller call leaves it open."""
        n_further = further_tests(request["count"])
        n_planned = max(self.n_points, self.store.n_planned)
        total = request.get("points") or n_planned + n_further
        if self.n_points < total - n_further:
            return {"answer": request["answer"]}
        if total > self.n_points:
            self.source.extend(total - self.n_points)
            self.store.plan(total)
            self.n_points = total
            self.remarks.append(f"{request['name']} has asked for {n_further} of the tests.")
        return {"answer": f"{total} tests in all", "points": total}

    # From points to tests

    def _ask(self, count: int) -> int:
        """Ask the source for ``count`` points; return how many it has returned."""
        points = self.source.ask(count)
        if len(points) and self.executor.has_designs:
            # they are computed once, for the model and for the tests
            points = replace(points, designs=points.matrix(self.model.space))
        self._ledger.add(points)
        return len(points)

    def _advance(self, n_awaited: int) -> bool:
        """Follow requests; then store tests, start points, or wait; return whether any was left.

        Args:
            n_awaited: Of how many points, the first ones, the tests are awaited.
        """
        self._follow_requests()
        if self._is_commit_due(n_awaited):
            self._store_evaluated()
            return True
        points = self._next_to_start(n_awaited)
        if len(points):
            self._start(points)
            return True
        if self.executor.queue.n_pending:
            evaluation = self.executor.wait()
            if evaluation is not None:
                self._ledger.evaluate(evaluation)
                self.executor.require_outputs(evaluation)  # the evaluation is stored all the same
            return True
        if self._steering == "pause":
            time.sleep(_PAUSE_SECONDS)
            return True
        if self._steering == "stop":
            self._ledger.keep(self._ledger.states == STORED)
        return False

    def _is_commit_due(self, n_awaited: int) -> bool:
        """Whether to store the evaluated tests now."""
        ledger = self._ledger
        if not ledger.evaluations:
            return False
        queue = self.executor.queue
        # A thousand workers compute 20 s in a moment: their results of a second are kept together.
        much = max(COMPUTED, SECONDS * queue.runner.n_workers)
        is_late = ledger.seconds >= much or time.monotonic() - self._last_commit >= SECONDS
        is_complete = queue.n_pending == 0 or ledger.are_all(EVALUATED, n_awaited)
        return is_late or is_complete or self.source.eager

    def _next_to_start(self, n_awaited: int) -> Points:
        """Return the points to start next; ask the source if it has not returned them yet."""
        if self._steering != "continue":
            return Points.none()
        ledger = self._ledger
        count = self.executor.n_accepted(n_awaited - ledger.n_started)
        if count <= 0:
            return Points.none()
        if ledger.n_started == len(ledger.points) and self.source.n_left > 0:
            self._ask(count)
        return ledger.start(count)

    def _start(self, points: Points) -> None:
        """Recall the stored tests of points; lock the run and submit the others, if there are."""
        stored = self.store.recall(points)
        if len(stored) < len(points) and self._lock is None:
            lock = ExitStack()
            lock.enter_context(self.store.writing())
            self._lock = lock
            self._last_commit = time.monotonic()
            # another process may have stored some meanwhile
            stored = self.store.recall(points)
        if len(stored):
            points = points.without(stored.numbers)
            self._report(Block(stored.numbers, stored))
        if len(points):
            for block in self.executor.submit(points):
                self._store(block)

    def _store_evaluated(self) -> None:
        """Store the tests of evaluated points; after an interrupt it can be repeated."""
        ledger = self._ledger
        try:
            for block in self.executor.blocks(ledger.points, ledger.evaluations):
                self._store(block)
        except Exception:  # the run ends, which shall not store them once more
            ledger.forget_evaluations()
            raise
        ledger.forget_evaluations()
        self._last_commit = time.monotonic()

    def _store(self, block: Block) -> None:
        self.store.keep(block.tests, block.seconds)
        self._report(block)

    def _report(self, block: Block) -> None:
        """Report stored tests to the source."""
        self.source.tell(block.tests)
        self._ledger.store(block)


def run_of_sequence(
    problem: Any,
    n_points: int,
    options: RunOptions,
    *,
    method: str = "",
    n_first: int | None = None,
    repeat: int = 1,
    source_of: SourceOf | None = None,
) -> Run:
    """Return a run that tests the points of a sequence, or a share of them.

    Args:
        problem: A pymoo problem.
        n_points: How many points the run has, those of other shares too.
        options: The options of the run.
        method: By what designs are proposed after these points, for the study.
        n_first: How many of the points, at most, are of the sequence.
        repeat: Which of the tests of each design the run makes.
        source_of: Returns the source of the run, by the points of the sequence, the number of all
            points, the model, the executor and the store; by default its points are the sequence.
    """
    require_no_permutation(problem)
    model = Model(problem, options, repeat)
    model.under_so_far(TestTable.empty(model.schema))  # a wrong formulation is refused here
    integer("n_points", n_points, minimum=1)
    n_dim = len(model.space.searched)
    sampling = options.sampling_in(n_dim)
    n_first = n_first or LAST
    n_sampled = min(n_points, n_first)
    store = store_of(model, options, lambda: sampling.identity(n_sampled, options.seed) + method)
    n_all = store.total(n_points)
    points = unit_points(options, min(n_all, n_first), n_dim)
    store.plan(n_all)
    executor = Executor(model, options)
    if executor.recurs:
        executor.learn(store.known())
    if source_of is not None:
        source = source_of(points, n_all, model, executor, store)
    else:
        continued = None
        if sampling.extendable and options.share is None:
            continued = partial(unit_points, options, n_dim=n_dim)
        source = PlannedPoints(points, continued)
    return Run(model, source, executor, store, n_all)


def repeated_tests(
    tested: Callable[[Run], TestTable],
    problem: Any,
    n_points: int,
    options: RunOptions,
) -> tuple[Run, TestTable]:
    """Return the run of the first tests of all designs, and these tests followed by repeats.

    Args:
        tested: Returns the tests of a run.
        problem: A pymoo problem.
        n_points: How many points the run has.
        options: The options of the run.

    Raises:
        ArgumentValueError: There are repeats, and the problem is not noisy, or of shares.
    """
    if options.repeat > 1 and not getattr(problem, "noisy", False):
        remedy = "a stochastic model says so by noisy = True, or the command by --noisy"
        raise invalid("repeat", "1 for a model that is not noisy", options.repeat, remedy)
    if options.repeat > 1 and options.share:
        raise invalid("repeat", "1 with a share, which has one run", options.repeat)
    first = run_of_sequence(problem, n_points, options)
    table = tested(first)
    options = replace(options, more=False)
    for repeat in range(2, options.repeat + 1):
        run = run_of_sequence(problem, first.n_points, options, repeat=repeat)
        tests = tested(run)
        table = table.extended(renumbered(tests, tests.numbers + table.numbers.max()))
    return first, table


def by_number(tables: Sequence[TestTable]) -> TestTable:
    """Return tables that have no test in common as one, by number."""
    # Blocks of workers come in any order; rows that are sorted then need no second copy.
    first, *others = sorted(tables, key=lambda table: table.numbers.max(initial=0))
    table = first.extended(*others)
    if (np.diff(table.numbers) < 0).any():
        table = table.take(np.argsort(table.numbers, kind="stable"))  # faster for a few runs
    return table


# Progress


@contextmanager
def progress_bar(progress: bool) -> Iterator[Callable[..., None]]:
    """Give a function that shows a share of 1 and a note; it does nothing without ``progress``.

    It shows them, and the time left, on pymoo's bar in a terminal or a notebook, elsewhere in a
    line of standard error now and then.
    """
    if not progress:
        yield lambda share, note="": None
        return
    from pymoo.util.display.progress import ProgressBar

    ipython = sys.modules.get("IPython")
    is_notebook = ipython is not None and hasattr(ipython.get_ipython(), "kernel")
    # A service may have no output at all.
    if not is_notebook and (sys.stdout is None or not sys.stdout.isatty()):
        yield _shown_on(None)
        return
    # The bar's own statistics are wrong: a hundredth of the rate ("0.2%/s" for 20), and a time left
    # that counts tests known before as tests of this run. A notebook keeps every state of a line.
    pause = 1.0 if is_notebook else 0.0
    with ProgressBar(stats=False, stats_end=False, refresh_secs=pause) as bar:
        yield _shown_on(bar)


def _shown_on(bar: Any) -> Callable[..., None]:
    """Return what shows a share and a note on a bar, or in lines without one."""
    due = time.monotonic() + _EVERY
    start: tuple[float, float] | None = None  # the time, and the share that was known before

    def show(share: float, note: str = "") -> None:
        nonlocal due, start
        now = time.monotonic()
        start = start or (now, share)
        since, known = start
        parts = []
        if note:
            parts.append(note)
        if known < share < 1:
            seconds = (now - since) * (1 - share) / (share - known)
            parts.append(f"{timedelta(seconds=math.ceil(seconds))} left")
        if bar is not None:
            bar.set(share)
            bar.obj.text(", ".join(parts))
        elif now >= due:
            due = now + _EVERY
            print(", ".join([f"{share:.0%} done", *parts]), file=sys.stderr, flush=True)

    return show
