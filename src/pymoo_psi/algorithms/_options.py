"""The options of a run: one value that holds them, and the keywords by which users give them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, TypedDict, TypeVar

from pymoo.core.algorithm import Algorithm

from pymoo_psi._validation import (
    Entries,
    FilePath,
    Values,
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
from pymoo_psi.problems import require_known_keywords
from pymoo_psi.sequences import MAX_DIMENSIONS
from pymoo_psi.study import ALL, Share
from pymoo_psi.table import Formulation, Limits

Owner = TypeVar("Owner", bound=Callable[..., Any])


class StudyKeywords(TypedDict, total=False):
    """Options of every run that stores tests, as :class:`PSI` describes them."""

    study_key: str | None
    study_wait: float
    more: bool
    retry: Literal["failed", "incomplete"] | None
    names: Mapping[str, str] | None
    maximize: Collection[str] | None
    units: Mapping[str, str] | None


class PointKeywords(StudyKeywords, total=False):
    """Options of runs that test points of a sequence."""

    first: int
    sampling: UniformSampling | SequenceName | None
    seed: int | None
    limits: Limits | None
    formulation: Formulation | None
    study: FilePath | None
    log: Collection[str] | None
    requirements: Any


class AlgorithmKeywords(PointKeywords, total=False):
    """Options of algorithms: those of their runs, and those of pymoo's ``Algorithm``."""

    termination: Any
    output: Any
    display: Any
    callback: Any
    archive: Any
    return_least_infeasible: bool
    save_history: bool
    verbose: bool
    evaluator: Any


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
    sampling: UniformSampling | SequenceName | None = None
    seed: int | None = None
    limits: Limits | None = None
    formulation: Formulation | None = None
    share: tuple[int, int] | None = None
    study: FilePath | None = None
    study_key: str | None = None
    study_wait: float = 10.0
    more: bool = False
    retry: Literal["failed", "incomplete"] | None = None
    names: Mapping[str, str] | None = None
    maximize: Collection[str] | None = None
    units: Mapping[str, str] | None = None
    log: Collection[str] | None = None
    requirements: Any = None
    repeat: int = 1
    block_size: int | None = None
    runner: Runner | None = None
    keep: Literal["all", "feasible", "pareto"] = "all"

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


def run_options(
    owner: str, arguments: Entries, keywords: Any, **others: Any
) -> tuple[RunOptions, Values]:
    """Return the run options among keyword arguments, and the other arguments, which are pymoo's.

    Args:
        owner: Name of the callable, for the message.
        arguments: The keyword arguments.
        keywords: The ``TypedDict`` of those that the owner takes.
        **others: Further options of the run.

    Raises:
        ArgumentTypeError: A keyword is unknown; a near miss is pointed out.
    """
    known = (*keywords.__annotations__, *others)
    require_known_keywords(owner, object, arguments, more=known)
    of_pymoo = dict(arguments)
    for field in fields(RunOptions):
        if field.name in of_pymoo:
            others[field.name] = of_pymoo.pop(field.name)
    return RunOptions(**others), of_pymoo


def takes(keywords: Any) -> Callable[[Owner], Owner]:
    """Return a decorator that writes keywords into the signature that help and editors show.

    Args:
        keywords: The ``TypedDict`` that the function unpacks.
    """
    # The types themselves, as their names mean nothing in the module of the function.
    known = dict(inspect.signature(RunOptions, eval_str=True).parameters)
    known |= inspect.signature(Algorithm.__init__).parameters

    def expanded(function: Owner) -> Owner:
        signature = inspect.signature(function)
        parameters = list(signature.parameters.values())[:-1]  # without **options
        for name, parameter in known.items():
            if name in keywords.__annotations__:
                parameters.append(parameter.replace(kind=parameter.KEYWORD_ONLY))
        function.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        return function

    return expanded
