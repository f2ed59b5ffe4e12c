"""A run: its options, one value for all that test designs; its points; and its study."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Collection, Generator, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass, fields, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, collection, finite_array, integer, invalid, known_name
from pymoo_psi.algorithms._sampling import (
    LPTauSampling,
    QMCSampling,
    UniformSampling,
    uniform_sampling,
)
from pymoo_psi.parallel import Result, Values
from pymoo_psi.problems import DesignSpace, require_known_keywords
from pymoo_psi.sequences import MAX_DIMENSIONS, lp_tau, lp_tau_at
from pymoo_psi.study import ALL, LAST, Share, Study
from pymoo_psi.table import Limits, TestTable, columns_of, head_of, kinds_of_columns, table_of

Array = NDArray[np.float64]

# Seconds between two commits of a study: beside them a commit of some milliseconds does not count,
# and not much more is lost when the process is killed.
SECONDS = 1.0
# Seconds of computing, by all workers together, after which there is a commit in any case: results
# of slow designs that arrive together must not wait for the next one, perhaps for hours.
COMPUTED = 20.0


@dataclass(frozen=True)
class RunOptions:
    """The options of a run, checked: which points are tested, how, and where tests are stored.

    Attributes:
        first: Number of the first point, from 1, which lies at the lower bounds. ``PSI(1024)``
            and ``PSI(3072, first=1025)`` together test the points of ``PSI(4096)``.
        sampling: Where the points come from: ``"lptau"`` by default, and for more than 51
            variables SciPy's points of Sobol', ``QMCSampling("sobol", scramble=False)``; or, as on
            the command line, ``"sobol"``, ``"halton"`` or ``"lhs"``, whose random points follow
            the seed; or another :class:`~pymoo_psi.UniformSampling`, such as
            :class:`~pymoo_psi.QMCSampling` or a sequence of your own.
        seed: Seed of a randomised sampling; in ``minimize``, pymoo's ``seed``.
        limits: Limits on objectives, variables and outputs, ``{"mass": 30, "width": (0.2, 0.4)}``;
            see :class:`TestTable`. A design that exceeds one counts as infeasible in the result;
            the table keeps it as it is, so that other limits can be tried on the table afterwards.
            So does one without a value that has a limit; if no test has it, the limit is refused.
        share: ``(k, n)`` tests the k-th of n parts of the points only. All n parts together, on as
            many machines, are the run without it; each is spread over all bounds.
        study: Name of a study file, in which tests are stored as they arrive, about every second;
            also when an interrupt, SIGTERM or a failure ends the run. The same call continues a
            study that was interrupted, a larger ``n_points`` extends it, and no stored design is
            evaluated again. With a ``share`` it is the name of a folder, in which each share has a
            file; :func:`~pymoo_psi.read_table` reads it as one study.
        study_key: What else the study depends on, such as a version or constants of the model; a
            study with another key is refused. The study itself compares name, variables, bounds
            and numbers of objectives and constraints, and the numbers and texts that the problem
            was made with and keeps, or what its method ``fingerprint()`` returns; it cannot see
            into the model.
        retry: ``"failed"`` evaluates what the study holds as failed once more.
        names: Names of your own for variables, objectives and constraints, by their default names:
            ``{"x1": "width", "f2": "efficiency", "g1": "stress"}``. The table, the study, files,
            plots and limits have them. Unless given, those of the problem's attribute ``names``.
        maximize: The objectives to be maximised, by these names. pymoo minimises, so that
            ``out["F"]`` holds such an objective with the sign turned; whatever is reached by name
            is in the original direction. Unless given, those of the problem's attribute
            ``maximize``; a list that leaves one of these out is refused, an empty one turns all
            of them off.
        units: Units of columns by these names, also of further outputs. Unless given, those of
            the problem's attribute ``units``.
        log: Variables whose scale is logarithmic: points are spread evenly, and surrogates see
            distances, in the logarithm. Unless given, those of the problem's attribute ``log``.
        requirements: Rules on variables, ``{"slender": "height <= 4*width"}`` or functions; see
            :class:`Required`. The model never runs for a design that violates one: it counts as
            infeasible. Unless given, those of the problem's attribute ``requirements``.
        fill: Go on in the sequence until ``n_points`` designs meet the requirements; the others
            are numbered, too.
        block_size: Points per iteration of ``PSI``, after each of which display, callback and
            termination are called: by default the run has 32 iterations, of at least 64 points.
            For ``investigate``, points that are evaluated together, at most.

    Raises:
        ArgumentValueError: A count is out of range, or there is no such action or share.
        ArgumentTypeError: An option has the wrong type.
    """

    first: int = 1
    sampling: UniformSampling | str | None = None
    seed: int | None = None
    limits: Limits | None = None
    share: tuple[int, int] | None = None
    study: str | PathLike[str] | None = None
    study_key: str | None = None
    retry: str | None = None
    names: Mapping[str, str] | None = None
    maximize: Collection[str] | None = None
    units: Mapping[str, str] | None = None
    log: Collection[str] | None = None
    requirements: Any = None
    fill: bool = False
    block_size: int | None = None

    def __post_init__(self) -> None:
        """Check what can be checked without a problem."""
        integer("first", self.first, minimum=1)
        object.__setattr__(self, "sampling", uniform_sampling(self.sampling))
        if self.block_size is not None:
            integer("block_size", self.block_size, minimum=1)
        if self.retry is not None:
            known_name("retry", self.retry, ("failed",))
        if self.log is not None:
            collection("log", self.log, "a list of variables", "one goes into a list too")

    def sampling_in(self, n_dim: int) -> UniformSampling:
        """Return where points of so many dimensions come from."""
        few = n_dim <= MAX_DIMENSIONS  # SciPy's Sobol' points have up to 21201
        default = LPTauSampling() if few else QMCSampling("sobol", scramble=False)
        return uniform_sampling(self.sampling) or default

    def points(self, n_points: int, n_dim: int) -> Points:
        """Return the points of which a run, or its share of one, consists.

        Those of LPτ are made when they are asked for, in a worker process too.

        Args:
            n_points: How many points the run has, those of other shares too.
            n_dim: In how many dimensions they lie.
        """
        first, last, sampling = self.first, self.first + n_points - 1, self.sampling_in(n_dim)
        units = None
        if isinstance(sampling, LPTauSampling):
            lp_tau(1, n_dim, first=last)  # too many dimensions or points are refused here
        else:  # any part needs all before it, or all
            state = np.random.default_rng(self.seed)
            made = sampling.unit_points(n_points, n_dim, first=first, random_state=state)
            units = finite_array("unit_points of sampling", made)
            if units.shape != (n_points, n_dim) or (units < 0).any() or (units > 1).any():
                rule = f"{n_points} points of the unit cube of {n_dim} variables, in [0, 1)"
                raise invalid("unit_points of sampling", rule, made)
        numbers = self.part.numbers(first, last)
        if len(numbers) == 0:
            rule = f"one that gets a point of points {first} to {last}"
            remedy = "test as many points as there are shares"
            raise invalid("share", rule, Received(self.part), remedy)
        return Points(numbers, n_dim, None if units is None else units[numbers - first])

    @property
    def part(self) -> Share:
        """The share of the points that is tested."""
        return ALL if self.share is None else Share.checked(self.share)


def run_options(
    owner: str, given: Mapping[str, Any], base: type = object, *, without: Collection[str] = ()
) -> tuple[RunOptions, dict[str, Any]]:
    """Return the run options among keyword arguments, and the others, which are pymoo's.

    Args:
        owner: Name of the callable, for the message.
        given: The keyword arguments.
        base: The pymoo class that takes the others.
        without: Run options that the owner does not take.

    Raises:
        ArgumentTypeError: A keyword is unknown; a near miss is pointed out.
    """
    known = {field.name for field in fields(RunOptions)} - {*without}
    require_known_keywords(owner, base, given, more=known)
    options = {name: value for name, value in given.items() if name in known}
    return RunOptions(**options), {n: v for n, v in given.items() if n not in known}


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a run, or some of them, which are sent to where they are tested.

    Attributes:
        numbers: ``(n,)`` their numbers, increasing.
        n_dim: In how many dimensions they lie.
        given: ``(n, n_dim)`` where, for points that are not of LPτ.
        rounds: ``(n,)`` the round in which each was proposed, 0 if it is of a sequence; ``None``
            where nothing is proposed.
        designs: ``(n, n_var)`` their designs, where these are given and not made of points.
    """

    numbers: NDArray[np.int64]
    n_dim: int
    given: Array | None = None
    rounds: Array | None = None
    designs: NDArray[Any] | None = None

    def __post_init__(self) -> None:
        """Write a range of numbers out."""
        object.__setattr__(self, "numbers", np.asarray(self.numbers, dtype=np.int64))

    def __reduce__(self) -> tuple[Any, ...]:
        """Send consecutive numbers as a range: half a megabyte takes as long as 7000 designs."""
        numbers: Any = self.numbers
        if self._consecutive:
            numbers = range(int(numbers[0]), int(numbers[-1]) + 1)
        return Points, (numbers, self.n_dim, self.given, self.rounds, self.designs)

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self.numbers)

    @property
    def _consecutive(self) -> bool:
        return len(self) > 0 and bool((np.diff(self.numbers) == 1).all())

    @property
    def units(self) -> Array:
        """``(n, n_dim)`` points of the unit cube."""
        if self.given is not None:
            return self.given
        if self._consecutive:  # all at once is faster
            return lp_tau(len(self.numbers), self.n_dim, first=int(self.numbers[0]))
        return lp_tau_at(self.numbers, self.n_dim)

    def matrix(self, space: DesignSpace) -> NDArray[Any]:
        """Return their ``(n, n_var)`` designs."""
        return space.matrix(self.units) if self.designs is None else self.designs

    def at(self, rows: NDArray[np.intp]) -> Points:
        """Return the points in some rows, from 0."""
        parts = (self.given, self.rounds, self.designs)
        return Points(
            self.numbers[rows], self.n_dim, *(None if a is None else a[rows] for a in parts)
        )

    def followed(self, numbers: NDArray[np.int64], units: Array, number_of_round: int) -> Points:
        """Return these points, followed by those that a round has proposed."""
        rounds = np.zeros(len(self)) if self.rounds is None else self.rounds
        rounds = np.append(rounds, np.full(len(numbers), float(number_of_round)))
        numbers, units = np.append(self.numbers, numbers), np.vstack([self.units, units])
        return Points(numbers, self.n_dim, units, rounds)


class Store:
    """The study of a run, or nothing where there is none.

    Args:
        options: The options of the run.
        table: A table without tests: the columns that the problem promises, and what makes its
            tests belong together, the :func:`problem_identity`, ``sampling`` and ``key``.

    Attributes:
        study: The study file; ``None`` stores nothing.
        layout: The columns that the problem promises.
        origin: Where the designs come from, for the readers of the study.
    """

    def __init__(self, options: RunOptions, table: TestTable) -> None:
        self.study, self.layout, self._retry = None, table.layout, options.retry
        self.origin = ""
        if options.study is None:
            return
        path, share = Study(options.study).path, options.part if options.share else None
        if os.path.exists(path) and os.path.isdir(path) != bool(share):
            rule = "the name of a folder with a share=(k, n), of a file without one"
            raise invalid("study", rule, path, "'pymoo-psi export' makes one file of a folder")
        self.study = Study(f"{path}/{share.file}" if share else path)
        # "LP-tau", not "LP-tau from point 1": every test has its number beside it
        self.origin = (table.problem or {})["sampling"].partition(" from ")[0]
        self.study.begin(head_of(table), share if share and share.of > 1 else None)

    def writing(self) -> AbstractContextManager[None]:
        """Keep others from testing points of the study while the body runs."""
        return nullcontext() if self.study is None else self.study.writing()

    def recall(self, numbers: NDArray[np.int64]) -> TestTable:
        """Return what is stored of increasing test points of the run and not to be retried."""
        if self.study is None or len(numbers) == 0:
            return TestTable.empty(self.layout)
        first, last = int(numbers[0]), int(numbers[-1])
        known = self.known(first, last - first + 1)
        # the file of a share may have come to hold points of other shares
        return known.rows(np.isin(known.numbers, numbers))

    def known(self, first: int = 1, count: int = LAST) -> TestTable:
        """Return what is stored of test points and not to be retried."""
        stored = self.stored(first, count)
        return stored.rows(~self.to_retry(stored))

    def stored(self, first: int = 1, count: int = LAST) -> TestTable:
        """Return what is stored of the test points from ``first`` on."""
        if self.study is None:
            return TestTable.empty(self.layout)
        columns = self.study.contents(first, count)[1]
        known = kinds_of_columns(self.layout)
        # Tests of another run may have outputs that this one does not know yet.
        outputs = tuple(name for name in columns if name not in known)
        layout = replace(self.layout, outputs=self.layout.outputs + outputs)
        head = head_of(TestTable.empty(layout))
        return table_of(head, columns, self.study.path, TestTable)

    def to_retry(self, stored: TestTable) -> NDArray[np.bool_]:
        """``(n,)`` which of stored tests are failed ones to be evaluated once more."""
        return np.asarray((stored.status == "failed") & (self._retry is not None))

    @property
    def kept(self) -> str:
        """What is kept of an interrupted run, and how it goes on."""
        if self.study is None:
            return "no test is kept; with study='FILE.db' the same call would go on from the last"
        return f"tests are kept in study {self.study.path}; the same call goes on from there"

    def keep(self, tests: TestTable, seconds: ArrayLike | None = None) -> None:
        """Store tests, and what each of them took; those that are stored already are left alone."""
        if self.study is not None and len(tests):
            self.study.append(columns_of(tests), origin=self.origin, seconds=seconds)


def in_groups(
    results: Generator[Result],
    keep: Callable[[NDArray[np.intp], tuple[Values, ...], NDArray[np.float64]], None],
    at_once: Callable[[Result], bool] = lambda result: False,
) -> Generator[None]:
    """Take results, a step for each, and keep them in groups, all of them whatever ends it.

    Args:
        results: The results; they are closed at the end.
        keep: Keeps a group, its indices, values and seconds; about every second, and at the end.
        at_once: Whether a result and those before it are to be kept without delay.
    """
    group: list[Result] = []
    began, computed = time.monotonic(), 0.0

    def flush() -> None:
        nonlocal began, computed
        indices, values, seconds = zip(*group, strict=True)
        group.clear()
        keep(np.array(indices), values, np.array(seconds))
        began, computed = time.monotonic(), 0.0

    try:
        with closing(results):
            for result in results:
                group.append(result)
                computed += result[2]
                late = computed >= COMPUTED or time.monotonic() - began >= SECONDS
                if at_once(result) or late:
                    flush()
                yield
    finally:
        if group:
            flush()


class _Terminated(KeyboardInterrupt):
    """SIGTERM, which like Ctrl-C no model takes for a failure of a design."""


@contextmanager
def stored_at_termination(store: Store | None = None) -> Iterator[None]:
    """Let SIGTERM end the process after the body has stored what has arrived.

    Clusters send it before they kill. A handler of the user's is left alone. Where there is a
    store, an interrupt that leaves the body says what is kept.
    """
    main = threading.current_thread() is threading.main_thread()
    ours = main and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL

    def interrupt(*_: Any) -> None:
        raise _Terminated

    if ours:
        signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt as error:
        if ours and isinstance(error, _Terminated):
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGTERM)
        if store is not None:
            error.args = error.args or (store.kept,)  # the last line of what Python prints
        raise
    finally:
        if ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
