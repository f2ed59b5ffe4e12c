"""A run: it joins a source of points, an executor that evaluates them, and a store of tests.

It asks the source for points, takes what the store knows, lets no model run for a design that
violates a requirement, answers repetitions of a design from its known result, gives the other
points to the executor, keeps what arrives and gives it on in blocks. The table is the same for any
number of workers and any size of a block.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from pymoo_psi._validation import Designs, Numbers, identity_text, integer
from pymoo_psi.algorithms._executor import Block, Executor, Model, executor_of, values_of_table
from pymoo_psi.algorithms._limits import kept_tests, under_limits
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._sources import PlannedPoints, Points, Source, filled, unit_points
from pymoo_psi.algorithms._store import Recall, Store, StudyStore, stored_at_termination
from pymoo_psi.errors import PsiError
from pymoo_psi.parallel import Values
from pymoo_psi.problems import problem_identity
from pymoo_psi.study import LAST
from pymoo_psi.table import TestTable, design_keys

# Seconds between two commits of a study: a commit of some milliseconds does not count beside them,
# and not much more is lost when the process is killed.
SECONDS = 1.0
# Seconds of computing, by all workers together, after which there is a commit in any case: results
# of slow designs that arrive together must not wait for the next one, perhaps for hours.
COMPUTED = 20.0


class Run:
    """The testing of the points of a source.

    Args:
        model: The model, which makes tests of values.
        source: Where the points come from.
        executor: What evaluates them.
        store: Where tests are recalled and kept.
        repeats: The results by design, where designs recur; ``None`` if they do not.
    """

    def __init__(
        self,
        model: Model,
        source: Source,
        executor: Executor,
        store: Store,
        repeats: Repeats | None = None,
    ) -> None:
        self.model = model
        self.source = source
        self.executor = executor
        self.store = store
        self._repeats = repeats
        self._issued = Points.none()  # whose tests no block has given yet
        self._n_opened = 0  # how many of them are submitted, or known
        self._n_awaited = 0  # how many of them the next block waits for
        self._last = 0  # the number of the last of these
        self._arrived: list[Block] = []  # tests of issued points
        self._work: Generator[Block] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Copies begin at the next block; what is being evaluated stays here."""
        return self.__dict__ | {"_arrived": [], "_work": None}

    @property
    def n_left(self) -> int:
        """How many points have no test in a block so far; 0 where none is to come."""
        return len(self._issued) + self.source.n_left

    def tests(self) -> Generator[Block]:
        """Test all points; yield blocks as they arrive, in any order, those of a study too.

        Close it early to stop the workers.

        Raises:
            WorkerError: A worker process was lost, or the problem cannot be sent to one.
        """
        self._n_awaited = sys.maxsize
        self._last = LAST
        with closing(self._test_points()) as work:
            for block in work:
                self._give(block.numbers)
                yield block

    def next_points(self, count: int | None) -> Points:
        """Return the points of the next block, the same ones until they are tested.

        Args:
            count: How many, at most; ``None`` for all that the source has given, or gives now.
        """
        least = count or 1
        while len(self._issued) < least:
            points = self.source.ask(least - len(self._issued), self._n_free)
            if len(points) == 0:
                break
            self._issued = self._issued.joined(points)
        return self._issued.at(slice(0, count))

    def block(self, count: int | None) -> Block:
        """Test the next points; what arrives is stored within a second or two.

        Args:
            count: How many, as for :meth:`next_points`; there must be one.

        Returns:
            All their tests, by number.
        """
        points = self.next_points(count)
        last = int(points.numbers[-1])
        self._n_awaited = len(points)
        self._last = last
        with stored_at_termination(self.store):
            try:
                while self._n_arrived(last) < len(points):
                    if self._work is None:
                        self._work = self._test_points()
                    self._arrived.append(next(self._work))
                if self.executor.n_pending == 0:
                    self._end_work()  # which gives the lock back; workers are kept
            except BaseException:
                self.close()
                raise
        self._give(points.numbers)
        return self._take(last)

    def _give(self, numbers: Numbers) -> None:
        """Forget points whose tests are given."""
        is_left = ~np.isin(self._issued.numbers, numbers)
        self._issued = self._issued.at(is_left)
        self._n_opened -= len(numbers)

    def _n_arrived(self, last: int) -> int:
        return sum(int(np.count_nonzero(block.numbers <= last)) for block in self._arrived)

    def _take(self, last: int) -> Block:
        """Take what has arrived of the points up to a number."""
        blocks = []
        later = []
        for block in self._arrived:
            is_due = block.numbers <= last
            blocks.append(block.rows(is_due))
            if not is_due.all():
                later.append(block.rows(~is_due))
        self._arrived = later
        tests = by_number([block.tests for block in blocks])
        return Block(tests.numbers, tests, sum(block.n_called for block in blocks))

    def tell(self, tests: TestTable) -> None:
        """Take and store tests of the next points, which were evaluated elsewhere."""
        self.store.keep(tests)
        self._issued = self._issued.at(slice(len(tests), None))
        self.source.tell(tests)

    def close(self) -> None:
        """Give up what is being evaluated; what has arrived is in the study, if there is one."""
        self._end_work()
        self._arrived = []

    def _end_work(self) -> None:
        if self._work is not None:
            self._work.close()
        self._work = None

    @property
    def _n_free(self) -> int:
        return self.executor.n_workers - self.executor.n_pending

    def _test_points(self) -> Generator[Block]:
        """Test the awaited points, and some ahead; yield blocks as they arrive."""
        executor = self.executor
        self._n_opened = 0
        if self._repeats is not None:
            self._repeats.waiting.clear()
        with self.store.session() as recall:
            try:
                yield from self._open(recall, self._n_awaited)
                if executor.n_pending:  # nothing ahead of points that are all known
                    yield from self._open(recall, self._n_awaited + executor.ahead)
                began = time.monotonic()
                computed = 0.0
                while executor.n_pending:
                    computed += executor.wait()
                    is_late = computed >= COMPUTED or time.monotonic() - began >= SECONDS
                    is_complete = executor.n_pending == 0 or executor.first_pending > self._last
                    if is_late or is_complete or self.source.eager:
                        yield from self._keep(executor.take())
                        began = time.monotonic()
                        computed = 0.0
                    yield from self._open(recall, self._n_awaited + executor.ahead)
            finally:
                if executor.n_evaluated:
                    for _ in self._keep(executor.take()):
                        pass  # it is stored; nobody waits for it
                executor.close()

    def _open(self, recall: Recall, count: int) -> Iterator[Block]:
        """Open up to ``count`` issued points: yield known tests, and submit the other points."""
        while True:
            points = self._next_to_open(count)
            if len(points) == 0:
                return
            for block in self._arrived:  # when the run was at work before
                points = points.at(~np.isin(points.numbers, block.numbers))
            stored = recall(points.numbers)
            if len(stored):
                points = points.at(~np.isin(points.numbers, stored.numbers))
                yield from self._arrive(Block(stored.numbers, stored))
            if len(points):
                yield from self._submit(points)

    def _next_to_open(self, count: int) -> Points:
        """Return issued points, up to ``count`` of them; the source is asked for more if needed."""
        room = min(count - self._n_opened, self.executor.room)
        if room <= 0 or self._n_opened == self.n_left:
            return Points.none()
        if self._n_opened == len(self._issued):
            points = self.source.ask(room, self._n_free)
            self._issued = self._issued.joined(points)
        end = self._n_opened + room
        points = self._issued.at(slice(self._n_opened, end))
        self._n_opened += len(points)
        return points

    def _submit(self, points: Points) -> Iterator[Block]:
        """Submit points; those that need no evaluation are answered instead."""
        if self.model.has_requirements:
            violations = self.model.violations(points.matrix(self.model.space))
            is_unmet = (violations > 0).any(axis=1)
            n_unmet = np.count_nonzero(is_unmet)
            self.model.problem.n_not_run += n_unmet
            if n_unmet:
                yield from self._answer(points.at(is_unmet), [{"failure": ""}] * n_unmet)
            points = points.at(~is_unmet)
        if self._repeats is not None and len(points):
            X = points.matrix(self.model.space)
            new, known, values = self._repeats.split(points.numbers, X)
            if values:
                yield from self._answer(points.at(known), values)
            points = points.at(new)
        if len(points):
            self.executor.submit(points)

    def _answer(self, points: Points, values: Sequence[Values]) -> Iterator[Block]:
        """Keep and yield tests whose values are known without the model."""
        yield from self._keep(Block(points.numbers, self.model.tests(points, values)))

    def _keep(self, block: Block) -> Iterator[Block]:
        """Store and yield tests."""
        self.store.keep(block.tests, block.seconds)
        yield from self._arrive(block)

    def _arrive(self, block: Block) -> Iterator[Block]:
        """Yield tests that are stored, and those of the same designs that waited for them."""
        self.source.tell(block.tests)
        repeated: list[int] = []
        if self._repeats is not None:
            repeated, values = self._repeats.learn(block.tests)
            rows = np.searchsorted(self._issued.numbers, repeated)
            points = self._issued.at(rows)
        yield block
        if repeated:
            yield from self._answer(points, values)


class Repeats:
    """The results of a run by design, where designs recur as no variable is real.

    Args:
        tests: Known tests.

    Attributes:
        known: The values of every design that is known.
        waiting: For each design being evaluated, the numbers of the other points with it.
    """

    def __init__(self, tests: TestTable) -> None:
        self.known: dict[tuple[str, ...], Values] = {}
        self.waiting: dict[tuple[str, ...], list[int]] = {}
        self.learn(tests)

    def learn(self, tests: TestTable) -> tuple[list[int], list[Values]]:
        """Learn the results of tests; return the points that waited for them, and their values."""
        numbers = []
        answers = []
        for key, values in zip(design_keys(tests.X), values_of_table(tests), strict=True):
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
    n_jobs: int = 1,
    whole: bool = True,
    method: str = "",
) -> Run:
    """Return a run that tests the points of a sequence, or a share of them.

    Args:
        problem: A pymoo problem.
        n_points: How many points the run has, those of other shares too.
        options: The options of the run.
        keep: Which tests are needed: ``"all"``, the ``"feasible"`` ones, or the ``"pareto"`` set.
            Others are left out where they are evaluated, unless they are to be stored or repeated.
        n_jobs: Processes for a vectorised problem; -1 for as many as there are cores.
        whole: Whether all points are going to be tested, or a termination may end the run before.
        method: By what designs are proposed after these points, for the study; the caller changes
            the source of the run.
    """
    model = Model(problem, options)
    under_limits(TestTable.empty(model.layout), options.limits)  # wrong ones are refused here
    integer("n_points", n_points, minimum=1)
    if options.fill and model.has_requirements:
        n_points = filled(options, n_points, model.problem, model.space)
    n_dim = len(model.space.searched)
    points = unit_points(options, n_points, n_dim)
    sampling = options.sampling_in(n_dim)
    table = table_of_run(model, options, lambda: sampling.identity(n_points, options.seed) + method)
    store = Store(table)
    if options.study is not None:
        store = StudyStore(table, options)
    repeats = None
    if model.space.finite and (model.problem.elementwise or n_jobs == 1):
        repeats = Repeats(store.known())
    kept = None
    if keep != "all" and options.study is None and repeats is None:
        kept = partial(kept_tests, keep, options.limits)
    executor = executor_of(
        model,
        options,
        n_points=len(points),
        n_jobs=n_jobs,
        whole=whole,
        kept=kept,
    )
    return Run(model, PlannedPoints(points), executor, store, repeats)


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
        identity = problem_identity(model.problem, model.space)
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
        table = table.rows(np.argsort(table.numbers))
    return table
