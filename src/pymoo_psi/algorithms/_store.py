"""The store of a run, which recalls and keeps tests if the run has a study."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._kinds import Kind, option_text
from pymoo_psi._modules import code_of
from pymoo_psi._validation import (
    Columns,
    FilePath,
    Head,
    Mask,
    Numbers,
    Values,
    identity_text,
    invalid,
)
from pymoo_psi.algorithms._model import Model, warn_of_output
from pymoo_psi.algorithms._sources import Points, RunOptions
from pymoo_psi.errors import PsiError, StudyAccessError
from pymoo_psi.files import stored_tests, table_with, with_remark_on_lacks
from pymoo_psi.problems import layers, problem_identity, requirement_texts
from pymoo_psi.study import ADDED, LAST, LASTING, Proposal, Study, StudyRun, identity_of_run
from pymoo_psi.table import (
    OUTPUT,
    POINT,
    RUN,
    TEST,
    Column,
    Decision,
    TestTable,
    columns_of,
    head_of,
    kinds_of_columns,
)

# Seconds between two looks at what people ask; each look takes about a millisecond.
_SECONDS = 0.5


class Store:
    """The store of a run without a study: its tests are in memory alone, and it recalls none.

    Args:
        model: The model of the run.
        options: The options of the run.
        sampling: Returns what a study calls the origin of the points.

    Attributes:
        empty: A table without tests: the columns that the problem promises, and what makes its
            tests belong together, the :func:`problem_identity`, ``sampling`` and ``key``.
        origin: Where the designs come from, for the readers of the study.
        advice: What is kept when a run is interrupted, and how it goes on.
        n_planned: How many points earlier calls have planned for the run.
    """

    advice = "no test is kept; with study='FILE.db' the same call would go on from the last"

    def __init__(self, model: Model, options: RunOptions, sampling: Callable[[], str]) -> None:
        self.empty = _table_of_run(model, options, sampling)
        self.origin = ""
        self.n_planned = 0

    def writing(self) -> AbstractContextManager[None]:
        """Keep other processes from adding to the run during the body of a ``with`` statement."""
        return nullcontext()

    def recall(self, points: Points) -> TestTable:
        """Return the stored tests of points, by number, without those to be retried."""
        return self.empty

    def known(self) -> TestTable:
        """Return the stored tests of the run, without those to be retried."""
        return self.empty

    def others(self) -> TestTable:
        """Return the tests of other runs of the same model, without those to be retried."""
        return self.empty

    def keep(self, tests: TestTable, seconds: ArrayLike | None = None) -> int:
        """Store tests, and what each of them took; return how many are new or replaced."""
        return 0

    def numbered(self, tests: TestTable) -> TestTable:
        """Return tests of the run by the numbers that they have in the study, each once.

        If these are not those of the points, columns say the run and the points.
        """
        return tests

    def remember_once(self, name: str, value: Any) -> Any:
        """Remember a value of the run by name, if it has none; return the remembered one."""
        return value

    def total(self, n_points: int) -> int:
        """Return how many points the run has in all if ``n_points`` are asked for.

        Those that are asked for as further ones are none while others, asked for before, are not
        tested.
        """
        return n_points

    def plan(self, n_points: int) -> None:
        """Note how many points the run is asked for."""

    def requests(self) -> list[Values]:
        """Return what people have asked of the run since the last call, in the order of time.

        The first call returns what still holds of what was asked before.
        """
        return []

    def answer(self, request: Values) -> None:
        """Store a request with the answer of the run, unless the file is busy."""

    def proposals(self) -> list[Proposal]:
        """Return all stored proposals, by number."""
        return []

    def propose(self, proposals: Sequence[Proposal]) -> Sequence[Proposal]:
        """Store proposals; return those that are stored under their numbers now."""
        return proposals


class StudyStore(Store):
    """The store of a run in a study.

    Its tests are on the disk alone: each method reads anew what it returns, with what other
    processes have added, and commits what it writes before it returns. When tests are kept is the
    decision of the run, as a commit takes some milliseconds.

    Within a run, tests are numbered by their points; see :meth:`numbered`.

    Args:
        model: The model of the run.
        options: The options of the run, with a study.
        sampling: Returns what the study calls the origin of the points.
        recalls: Whether the points of the run may have tests already.

    Attributes:
        study: The study.
        run: The number of the run in it.

    Raises:
        ArgumentValueError: The study is a folder without a share, or a file with one.
        StudyError: The study belongs to another model, or cannot be used.
    """

    def __init__(
        self,
        model: Model,
        options: RunOptions,
        sampling: Callable[[], str],
        *,
        recalls: bool = True,
    ) -> None:
        super().__init__(model, options, sampling)
        self.study = _study_of(options)
        self._model = model
        self._options = options
        self._recalls = recalls
        self._n_requests: int | None = None  # how many were read; None before the first look
        self._next_look = 0.0  # the time at which requests are read again
        self._begin()

    def _begin(self) -> None:
        """Begin the run in the study, or go on with it."""
        model = self._model
        options = self._options
        points = str((self.empty.problem or {})["sampling"])
        # "LP-tau", not "LP-tau from point 1": every test has its number beside it
        self.origin = points.partition(" from ")[0]
        self.advice = f"tests are kept in study {self.study.path}; the same call goes on from there"
        head = _head_of_run(self.empty, model)
        share = options.part if options.part.of > 1 else None
        identity = _identity_of_run(head, points, model)
        facts, run = self.study.begin(head, identity, share, model.revised)
        model.awaited.difference_update(facts.head["outputs"])
        self.run = run.number
        self._planned = run.planned
        for _, last in run.planned:
            self.n_planned = max(self.n_planned, last - options.first + 1)
        self._has_other_runs = len(facts.runs) > 1
        if model.noisy:  # tests of the same design all count, also in a folder of shares
            self.remember_once("noisy", True)
        command = getattr(layers(model.inner)[-1], "command_words", None)
        if command is not None:
            self.remember_once("command", command)
        if options.study_key is None:
            self._warn_of_edits(facts.runs)

    def _warn_of_edits(self, runs: Sequence[StudyRun]) -> None:
        """Say once of each edit that the study has tests of the former code."""
        code = code_of(self._model.problem)
        edited: set[str] = set()
        for run in runs:
            former = run.record.get("code", {})
            edited.update(name for name in code if former.get(name, code[name]) != code[name])
        if edited or any(run.record.get("code") != code for run in runs):
            with self.study.changes() as database:
                for run in database.runs():
                    database.record(run.number, code=code)
        if edited:
            warnings.warn(
                f"{' and '.join(sorted(edited))} changed since tests of {self.study.path} were "
                "made, which stay as they are; if the model has other results now, use another "
                "study. A study_key that you change with the model replaces this warning",
                stacklevel=2,
            )

    def writing(self) -> AbstractContextManager[None]:
        """See :class:`Store`."""
        return self.study.writing(self.run)

    def recall(self, points: Points) -> TestTable:
        """See :class:`Store`."""
        if not self._recalls:
            return self.empty
        numbers = points.numbers
        ends = int(numbers[0]), int(numbers[-1])
        if self._has_other_runs:  # they may have tested the same designs
            model = self._model
            with self.study.changes() as database:
                untested = points.without(database.test_points(self.run, *ends))
                keys = model.keys(untested.matrix(model.space))
                database.adopt(self.run, untested.numbers, keys, model.repeat, noisy=model.noisy)
        tests = self._stored(*ends)
        # The file of a share may hold points of other shares.
        return tests.take(np.isin(tests.numbers, numbers))

    def known(self) -> TestTable:
        """See :class:`Store`."""
        return self._stored(1, LAST)

    def _stored(self, first: int, last: int) -> TestTable:
        """Return the tests of test points ``first`` to ``last`` without those to be retried."""
        with self.study.reading() as database:
            columns = database.tests_of_run(self.run, first, last)
        columns = self.without_unmade(columns)
        tests = self.table(columns, POINT)
        return tests.take(~self.are_retried(tests, columns))

    def without_unmade(self, columns: Columns) -> Columns:
        """Return columns of stored tests without unmade ones, which are removed from the study.

        A run at work under other requirements may have added them after this one has begun.
        """
        is_unmade = self._model.unmade(columns)
        if not is_unmade.any():
            return columns
        with self.study.changes() as database:
            database.remove(columns["test"][is_unmade])
        return {name: cells[~is_unmade] for name, cells in columns.items()}

    def are_retried(self, tests: TestTable, columns: Columns) -> Mask:
        """``(n,)`` which of the tests of stored columns are to be evaluated once more.

        Tests that lack an objective, as they are older, count as failed in their table only.
        """
        has_failed: Mask = columns["status"] == "failed"
        if self._options.retry == "failed":
            return has_failed
        is_retried = np.zeros(len(tests), dtype=bool)
        if self._options.retry == "incomplete":
            table = self._model.under_so_far(tests)
            for name in (*self.empty.schema.objectives, *self._model.formulation.columns):
                is_retried |= np.isnan(table.column(name))
        return is_retried & ~has_failed

    def whole(self) -> TestTable:
        """Return all tests of the study, of whatever run, by their numbers."""
        tests = stored_tests(*self.study.contents())
        return replace(tests, decision=Decision(), remarks=())

    def others(self) -> TestTable:
        """See :class:`Store`."""
        if not self._has_other_runs:
            return self.empty
        columns = self.study.contents()[1]
        tests = self.table(columns, TEST)
        is_of_other = columns["run"] != self.run
        return tests.take(is_of_other & ~self.are_retried(tests, columns))

    def table(self, columns: Columns, number: str) -> TestTable:
        """Return the table of columns of the study; ``number`` is the column that numbers them."""
        if len(columns["test"]) == 0:
            return self.empty
        schema = self.empty.schema
        unknown = np.full(len(columns["test"]), np.nan)
        columns = dict.fromkeys((*self._model.default_limits, *schema.outputs), unknown) | columns
        # Those that a test was made under may be others.
        columns |= self._model.requirement_columns(columns) | {TEST: columns[number]}
        # Tests of another run may have outputs that this one does not know yet.
        promised = (*kinds_of_columns(schema), *_NUMBERS)
        outputs = []
        for name, cells in columns.items():
            if name not in promised and cells.dtype != object:  # texts are notes
                outputs.append(name)
        schema = schema.with_columns(*(Column(name, OUTPUT) for name in outputs))
        return with_remark_on_lacks(table_with(schema, columns), columns, self._model.formulation)

    def keep(self, tests: TestTable, seconds: ArrayLike | None = None) -> int:
        """See :class:`Store`."""
        columns = columns_of(tests, POINT)
        for name in tests.schema.outputs:
            if name in ADDED:
                del columns[name]
                warn_of_output(name, "in the study, which adds a column of this name")
        columns[POINT] = tests.numbers
        model = self._model
        return self.study.append(
            columns,
            run=self.run,
            repeat=model.repeat,
            noisy=model.noisy,
            origin=self.origin,
            seconds=seconds,
        )

    def numbered(self, tests: TestTable) -> TestTable:
        """See :class:`Store`."""
        with self.study.reading() as database:
            n_runs = database.count("runs")
            n_stored = database.count("tests WHERE status NOT NULL")
            others = database.other_numbers(self.run)
        points = tests.numbers.tolist()
        numbers = np.array([others.get(point, point) for point in points], dtype=np.int64)
        numbers, first = np.unique(numbers, return_index=True)
        tests = tests.take(first)
        if n_runs > 1:
            notes = {POINT: tests.numbers.tolist(), RUN: [self.run] * len(tests)}
            for name in notes.keys() & {*tests.schema.names}:  # an output
                del notes[name]
            tests = tests.with_notes(notes)
        return replace(renumbered(tests, numbers), n_stored=n_stored)

    def remember_once(self, name: str, value: Any) -> Any:
        """See :class:`Store`."""
        with self.study.changes() as database:
            record = database.record(self.run)
            if name not in record:
                record = database.record(self.run, **{name: value})
            return record[name]

    def total(self, n_points: int) -> int:
        """See :class:`Store`."""
        if not self._options.more:
            return n_points
        first = self._options.first
        with self.study.reading() as database:
            n_planned = self.n_planned or max(database.last_point(self.run) - first + 1, 0)
            tested = database.test_points(self.run, first)
        planned = self._options.part.numbers(first, first + n_planned - 1)
        if np.isin(planned, tested).all():
            return n_planned + n_points
        return n_planned

    def plan(self, n_points: int) -> None:
        """See :class:`Store`."""
        ends = [self._options.first, self._options.first + n_points - 1]
        if ends not in self._planned:
            with self.study.changes() as database:
                planned = database.record(self.run).get("planned", ())
                database.record(self.run, planned=[*planned, ends])

    def requests(self) -> list[Values]:
        """See :class:`Store`; the study is read twice a second."""
        now = time.monotonic()
        if now < self._next_look:
            return []
        self._next_look = now + _SECONDS
        steering = self.study.facts().steering
        requests = []
        for request in steering[self._n_requests or 0 :]:
            if request["is_over"]:
                continue
            if self._n_requests is None and request["action"] not in LASTING:
                answer = f"{request['answer']}; over when the run began"
                self.answer(request | {"answer": answer, "is_over": True})
            elif request["run"] in (0, self.run):
                requests.append(request)
        self._n_requests = len(steering)
        return requests

    def answer(self, request: Values) -> None:
        """See :class:`Store`."""
        with suppress(StudyAccessError), self.study.changes() as database:
            database.steer(request | {"run": self.run})

    def proposals(self) -> list[Proposal]:
        """See :class:`Store`."""
        return self.study.proposals(self.run)

    def propose(self, proposals: Sequence[Proposal]) -> Sequence[Proposal]:
        """See :class:`Store`."""
        with self.writing(), self.study.changes() as database:
            return database.propose(self.run, proposals)


def store_of(model: Model, options: RunOptions, sampling: Callable[[], str]) -> Store:
    """Return the store of a run, with a study if the options have one; see :class:`StudyStore`."""
    if options.study is None:
        return Store(model, options, sampling)
    return StudyStore(model, options, sampling)


def _study_of(options: RunOptions) -> Study:
    """Return the study of a run, or of its share.

    Raises:
        ArgumentValueError: It is a folder without a share, or a file with one.
    """
    path = Study(cast(FilePath, options.study)).path
    if os.path.exists(path) and os.path.isdir(path) != bool(options.share):
        rule = "a file or, for a share of the points, a folder"
        raise invalid("study", rule, path, "'pymoo-psi export' makes one file of a folder")
    if options.share:
        path = f"{path}/{options.part.file}"
    return Study(path, wait=options.study_wait)


def _head_of_run(table: TestTable, model: Model) -> Head:
    """Return what a study says of its model, and how its tests are asked."""
    problem = dict(table.problem or {})
    del problem["sampling"]  # it belongs to the run
    head = head_of(table) | {"problem": problem}
    if model.default_limits:
        head["limits"] = {name: limit.plain for name, limit in model.default_limits.items()}
    if model.has_requirements:
        rules = {}
        requirements = model.schema.of_role("inequality")[model.n_ieq_constr :]
        for name, requirement in zip(requirements, model.problem.required, strict=True):
            rules[name] = requirement.rule
        # By the problem's own names of the variables, which a run may name otherwise.
        head["requirements"] = {"variables": [*model.space.titles], "rules": rules}
    if model.program is not None:
        # Another expression, or an output more, completes what is stored.
        outputs = model.program.outputs.items()
        head["expressions"] = {name: output.expression for name, output in outputs}
    return head


def _identity_of_run(head: Head, sampling: str, model: Model) -> Head:
    """Return what determines the points of a run."""
    identity = identity_of_run(head, sampling, requirement_texts(model.problem), model.repeat)
    choices = head["problem"]["choices"]
    only = {}  # the values of choices and binary variables, where some are left out
    for variable in model.space.variables:
        values = [*map(option_text, variable.options)]
        if variable.kind is Kind.BINARY and variable.fixed:
            values = [str(variable.lower == 1)]
        if values and values != choices.get(variable.title):
            only[variable.title] = values
    if only:
        identity["only"] = only
    return identity


def _table_of_run(model: Model, options: RunOptions, sampling: Callable[[], str]) -> TestTable:
    """Return the table of a run without tests, with what makes its tests belong together.

    Args:
        model: The model.
        options: The options of the run.
        sampling: Returns what the study calls the origin of the points.

    Raises:
        PsiError: A file cannot hold the identity, and a study or a share needs it.
    """
    table = TestTable.empty(model.schema)
    try:
        identity, others = problem_identity(model.problem)
        if others and options.study is not None and options.study_key is None:
            warnings.warn(
                f"the study does not compare what the problem's {', '.join(others)} is made of; "
                "give a study_key, or the problem a method fingerprint()",
                stacklevel=2,
            )
        if model.program is not None:  # it completes stored tests by other expressions
            identity.pop("expressions", None)
        # The constraints of the model; requirements, which may change, follow them.
        identity["inequalities"] = model.n_ieq_constr
        text = identity_text(identity | {"sampling": sampling(), "key": options.study_key})
    except PsiError:
        # Shares must be of the same points, whether they are stored or not.
        if options.study is not None or options.part.of > 1:
            raise
        return table
    return replace(table, problem=json.loads(text))


# Columns of a study that a table of a single run does not have.
_NUMBERS = (TEST, RUN, POINT)


def renumbered(tests: TestTable, numbers: Numbers) -> TestTable:
    """Return tests with other numbers, ``(n,)``."""
    new = dict(zip(tests.numbers.tolist(), numbers.tolist(), strict=True))
    failures = {new[number]: reason for number, reason in tests.failures.items()}
    return replace(tests, numbers=numbers, failures=failures)


@contextmanager
def stored_at_termination(store: Store | None = None) -> Iterator[None]:
    """Let SIGTERM end the process after the body has stored what has arrived.

    Clusters send it before they kill. A handler of the user's is left alone. If there is a store,
    an interrupt that leaves the body says what is kept.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    is_default = in_main_thread and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    is_terminated = False

    def interrupt(*_: Any) -> None:
        nonlocal is_terminated
        is_terminated = True
        if sys.exc_info()[0] is not KeyboardInterrupt:  # a second signal while tests are stored
            raise KeyboardInterrupt  # which no model takes for a failure of a design

    if is_default:
        signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt as error:
        if store is not None:
            error.args = error.args or (store.advice,)  # the last line of what Python prints
        raise
    finally:
        if is_default:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
        if is_terminated:
            os.kill(os.getpid(), signal.SIGTERM)
