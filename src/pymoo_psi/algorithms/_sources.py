"""The options of a run, its points, and the sources that they come from.

A run asks its source for points to test; see :class:`Source`. A new way to choose points is a new
source, in a file of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import (
    AnyArray,
    Array,
    Designs,
    FilePath,
    Numbers,
    Received,
    instance,
    integer,
    invalid,
    known_name,
)
from pymoo_psi.algorithms._sampling import (
    LPTauSampling,
    QMCSampling,
    SequenceName,
    UniformSampling,
    uniform_sampling,
)
from pymoo_psi.errors import PsiError
from pymoo_psi.parallel import Runner
from pymoo_psi.problems import DesignSpace
from pymoo_psi.sequences import MAX_DIMENSIONS, lp_tau, lp_tau_at
from pymoo_psi.study import ALL, Share
from pymoo_psi.table import Formulation, Limits, TestTable

# Declared, as type checkers that skip pymoo would take it for Any.
PointSequence: TypeAlias = UniformSampling | SequenceName
ByName = Mapping[str, str]  # texts by the name of a column
Retry = Literal["failed", "incomplete"]
Keep = Literal["all", "feasible", "pareto"]


class RunSettings(TypedDict, total=False):
    """The options of every run, as arguments; they are described by :class:`PSI`."""

    first: int
    sampling: PointSequence | None
    seed: int | None
    limits: Limits | None
    formulation: Formulation | None
    study: FilePath | None
    study_key: str | None
    study_wait: float
    more: bool
    retry: Retry | None
    names: ByName | None
    maximize: Collection[str] | None
    units: ByName | None
    log: Collection[str] | None
    requirements: Any


class AlgorithmSettings(RunSettings, total=False):
    """The options of every run, and those of pymoo's algorithms."""

    termination: Any
    callback: Any
    output: Any
    display: Any
    archive: Any
    evaluator: Any
    return_least_infeasible: bool
    save_history: bool
    verbose: bool


# The names of the options that every run has.
SETTINGS = RunSettings.__optional_keys__


@dataclass(frozen=True)
class RunOptions:
    """The options of a run: which points are tested, how, and where tests are stored.

    ``share`` and ``block_size`` are described by :class:`PSI`, the other ones that only some runs
    have by :func:`investigate`. ``may_end_early`` is whether a termination may end the run before
    all points are tested; if not, points are evaluated ahead of the blocks that are asked for.

    Raises:
        ArgumentValueError: A count is out of range, or there is no such action or share.
        ArgumentTypeError: An option has the wrong type.
    """

    first: int = 1
    sampling: PointSequence | None = None
    seed: int | None = None
    limits: Limits | None = None
    formulation: Formulation | None = None
    study: FilePath | None = None
    study_key: str | None = None
    study_wait: float = 10.0
    more: bool = False
    retry: Retry | None = None
    names: ByName | None = None
    maximize: Collection[str] | None = None
    units: ByName | None = None
    log: Collection[str] | None = None
    requirements: Any = None
    share: tuple[int, int] | None = None
    repeat: int = 1
    block_size: int | None = None
    runner: Runner | None = None
    keep: Keep = "all"
    may_end_early: bool = True

    def __post_init__(self) -> None:
        """Check what can be checked without a problem."""
        integer("first", self.first, minimum=1)
        uniform_sampling(self.sampling)
        if self.share is not None:
            Share.checked(self.share)
        if self.seed is not None:
            integer("seed", self.seed, minimum=0)
        integer("repeat", self.repeat, minimum=1)
        if self.block_size is not None:
            integer("block_size", self.block_size, minimum=1)
        if self.more and self.study is None:
            raise invalid(
                "more", "used with a study, which says what the run has", Received("none")
            )
        if self.retry is not None:
            known_name("retry", self.retry, ("failed", "incomplete"))
        if self.formulation is not None:
            instance("formulation", self.formulation, Formulation)
            if self.limits:
                remedy = "give them as Formulation(limits=...)"
                raise invalid("limits", "left out beside a formulation", self.limits, remedy)

    def sampling_in(self, n_dim: int) -> UniformSampling:
        """Return the sampling of points in ``n_dim`` dimensions."""
        sampling = uniform_sampling(self.sampling)
        if sampling is None:
            sampling = LPTauSampling()
            if n_dim > MAX_DIMENSIONS:
                sampling = QMCSampling("sobol", scramble=False)  # up to 21201 dimensions
        if self.more and not sampling.extendable:
            received = Received(sampling._name())
            raise invalid("more", "used with a sequence that can be continued", received)
        return sampling

    @property
    def part(self) -> Share:
        """The share of the points that is tested."""
        if self.share is None:
            return ALL
        return Share.checked(self.share)


@dataclass(frozen=True, eq=False)
class Points:
    """Points to test, which may be sent to other processes.

    Attributes:
        numbers: ``(n,)`` their numbers, each once; increasing as a source returns them.
        n_dim: In how many dimensions they lie.
        coordinates: ``(n, n_dim)`` the points of the unit cube; ``None`` for those of LPτ, which
            are computed from their numbers where they are needed.
        rounds: ``(n,)`` the round in which each was proposed, 0 for a point of a sequence; ``None``
            where nothing is proposed.
        designs: ``(n, n_var)`` their designs, where these are known.
    """

    numbers: Numbers
    n_dim: int
    coordinates: Array | None = None
    rounds: Array | None = None
    designs: Designs | None = None

    @classmethod
    def none(cls) -> Points:
        """Return no points."""
        return cls(np.zeros(0, dtype=np.int64), 0)

    def __len__(self) -> int:
        """Return how many points there are."""
        return len(self.numbers)

    def _arrays(self) -> dict[str, AnyArray]:
        """Return the arrays that there are beside the numbers, by name."""
        arrays = {name: getattr(self, name) for name in ("coordinates", "rounds", "designs")}
        return {name: array for name, array in arrays.items() if array is not None}

    @property
    def cube_points(self) -> Array:
        """``(n, n_dim)`` points of the unit cube."""
        if self.coordinates is not None:
            return self.coordinates
        if len(self) > 0 and (np.diff(self.numbers) == 1).all():  # all at once is faster
            return lp_tau(len(self), self.n_dim, first=int(self.numbers[0]))
        return lp_tau_at(self.numbers, self.n_dim)

    def matrix(self, space: DesignSpace) -> Designs:
        """Return their ``(n, n_var)`` designs."""
        if self.designs is not None:
            return self.designs
        return space.matrix(self.cube_points)

    def at(self, rows: Any) -> Points:
        """Return the points in some rows: indices, a mask or a slice."""
        arrays = {name: array[rows] for name, array in self._arrays().items()}
        return Points(self.numbers[rows], self.n_dim, **arrays)

    def without(self, numbers: ArrayLike) -> Points:
        """Return the points that have none of some numbers."""
        return self.at(~np.isin(self.numbers, numbers))

    def joined(self, others: Points) -> Points:
        """Return these points, followed by others of the same source."""
        if len(self) == 0:
            return others
        if len(others) == 0:
            return self
        numbers = np.concatenate([self.numbers, others.numbers])
        arrays = {}
        for name, array in self._arrays().items():
            arrays[name] = np.concatenate([array, getattr(others, name)])
        return Points(numbers, self.n_dim, **arrays)


class Source:
    """A source of points, which a run asks for the next ones.

    A run asks before a block and whenever workers can take more, and reports every test as it
    is ready, including tests that were stored or need no evaluation. Whatever decides about the
    next points (the known tests, the pending points, a formulation, how many are left) is kept in
    the source alone. Between two calls of ``ask`` it may be changed, for example to other limits,
    to more points, to a pause, or to a repetition of a design; the next call follows the change.

    A subclass writes ``n_left`` and ``ask``, and ``tell`` if its points depend on tests; ``direct``
    and ``extend`` if it can.

    Attributes:
        eager: Whether the next points are due before all earlier ones are tested, and depend on
            tests; these are then reported at once.
    """

    eager = False

    @property
    def n_left(self) -> int:
        """How many points are left; 0 at the end."""
        raise NotImplementedError

    def ask(self, count: int) -> Points:
        """Return the next points, numbered above all earlier ones; or none for now.

        Args:
            count: How many points can be used now. Points that belong together may be more.
        """
        raise NotImplementedError

    def tell(self, tests: TestTable) -> None:
        """Learn from tests of the points returned by :meth:`ask`, in any order."""

    def direct(self, formulation: Formulation) -> None:
        """Propose the next points for another formulation.

        Raises:
            PsiError: The points follow from no formulation.
        """
        raise PsiError("this search cannot be directed, only one by surrogates (SurrogatePSI) can")

    def extend(self, count: int) -> None:
        """Add ``count`` points.

        Raises:
            PsiError: The points cannot be continued.
        """
        raise PsiError("the points of this run cannot be continued; start another run for more")


class PlannedPoints(Source):
    """A source of points that do not depend on tests: those of a sequence, or designs.

    Args:
        points: The points.
        continued: Returns the first ``n`` points; ``None`` if they cannot be continued.
    """

    def __init__(self, points: Points, continued: Callable[[int], Points] | None = None) -> None:
        self._points = points
        self._continued = continued
        self._n_returned = 0

    def extend(self, count: int) -> None:
        """Add ``count`` points."""
        if self._continued is None:
            super().extend(count)
        else:
            self._points = self._continued(len(self._points) + count)

    @property
    def n_left(self) -> int:
        """How many points are left."""
        return len(self._points) - self._n_returned

    def ask(self, count: int) -> Points:
        """Return the next ``count`` points, or as many as are left."""
        start = self._n_returned
        self._n_returned = min(start + count, len(self._points))
        return self._points.at(slice(start, self._n_returned))


def unit_points(options: RunOptions, n_points: int, n_dim: int) -> Points:
    """Return the points of a run, or of its share of one.

    Those of LPτ are computed where they are needed, in a worker process too.

    Args:
        options: The options of the run.
        n_points: How many points the run has, those of other shares too.
        n_dim: In how many dimensions they lie.

    Raises:
        ArgumentValueError: There are no such points.
    """
    first = options.first
    last = first + n_points - 1
    sampling = options.sampling_in(n_dim)
    cube_points = None
    if isinstance(sampling, LPTauSampling):
        lp_tau(1, n_dim, first=last)  # too many dimensions or points are refused here
    else:  # any part of them needs all before it, or all
        random = np.random.default_rng(options.seed)
        array = sampling.unit_points(n_points, n_dim, first=first, random_state=random)
        cube_points = np.asarray(array, dtype=float)
        is_inside = (cube_points >= 0) & (cube_points <= 1)
        if cube_points.shape != (n_points, n_dim) or not is_inside.all():
            rule = f"{n_points} points of the unit cube of {n_dim} variables, in [0, 1)"
            raise invalid("unit_points of sampling", rule, array)
    numbers = options.part.numbers(first, last)
    if len(numbers) == 0:
        rule = f"one that gets a point of points {first} to {last}"
        remedy = "test as many points as there are shares"
        raise invalid("share", rule, Received(options.part), remedy)
    if cube_points is not None:
        cube_points = cube_points[numbers - first]
    return Points(numbers, n_dim, cube_points)
