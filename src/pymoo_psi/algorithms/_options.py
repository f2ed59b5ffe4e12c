"""The options of a run as one value; users give them as keyword arguments."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from pymoo_psi._validation import (
    FilePath,
    instance,
    integer,
    invalid,
    known_name,
    positive_number,
)
from pymoo_psi.algorithms._sampling import (
    LPTauSampling,
    QMCSampling,
    SequenceName,
    UniformSampling,
    uniform_sampling,
)
from pymoo_psi.parallel import Runner
from pymoo_psi.sequences import MAX_DIMENSIONS
from pymoo_psi.study import ALL, Share
from pymoo_psi.table import Formulation, Limits

# Declared, as type checkers that skip pymoo would take it for Any.
PointSequence: TypeAlias = UniformSampling | SequenceName
ByName = Mapping[str, str]  # texts by the name of a column
Retry = Literal["failed", "incomplete"]
Keep = Literal["all", "feasible", "pareto"]


@dataclass(frozen=True)
class RunOptions:
    """The options of a run: which points are tested, how, and where tests are stored.

    They are described where users give them: those of every run by :class:`PSI`, ``repeat``,
    ``runner`` and ``keep`` by :func:`investigate`.

    Raises:
        ArgumentValueError: A count is out of range, or there is no such action or share.
        ArgumentTypeError: An option has the wrong type.
    """

    first: int = 1
    sampling: PointSequence | None = None
    seed: int | None = None
    limits: Limits | None = None
    formulation: Formulation | None = None
    share: tuple[int, int] | None = None
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
    repeat: int = 1
    block_size: int | None = None
    runner: Runner | None = None
    keep: Keep = "all"

    def __post_init__(self) -> None:
        """Check what can be checked without a problem."""
        integer("first", self.first, minimum=1)
        uniform_sampling(self.sampling)
        if self.seed is not None:
            integer("seed", self.seed, minimum=0)
        integer("repeat", self.repeat, minimum=1)
        if self.block_size is not None:
            integer("block_size", self.block_size, minimum=1)
        positive_number("study_wait", self.study_wait)
        if self.more and self.study is None:
            raise invalid("more", "used with a study, which says what the run has", self.more)
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
        if sampling is not None:
            return sampling
        if n_dim <= MAX_DIMENSIONS:
            return LPTauSampling()
        return QMCSampling("sobol", scramble=False)  # up to 21201 dimensions

    @property
    def part(self) -> Share:
        """The share of the points that is tested."""
        if self.share is None:
            return ALL
        return Share.checked(self.share)
