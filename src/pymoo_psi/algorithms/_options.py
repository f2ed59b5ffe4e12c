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
    boolean,
    collection,
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
from pymoo_psi.problems import require_known_keywords
from pymoo_psi.sequences import MAX_DIMENSIONS
from pymoo_psi.study import ALL, Share
from pymoo_psi.table import Formulation, Limits

Owner = TypeVar("Owner", bound=Callable[..., Any])


class StudyKeywords(TypedDict, total=False):
    """Options of every run that stores tests, as :class:`RunOptions` describes them."""

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


class RunKeywords(PointKeywords, total=False):
    """Options of runs that test nothing but points of a sequence."""

    share: tuple[int, int] | None
    block_size: int | None


class InvestigateKeywords(RunKeywords, total=False):
    """Options of :func:`investigate`."""

    repeat: int


class AlgorithmKeywords(TypedDict, total=False):
    """What else the constructor of pymoo's ``Algorithm`` takes."""

    termination: Any
    output: Any
    display: Any
    callback: Any
    archive: Any
    return_least_infeasible: bool
    save_history: bool
    verbose: bool
    evaluator: Any


class SearchKeywords(PointKeywords, AlgorithmKeywords, total=False):
    """Options of :class:`SurrogatePSI`."""


class PSIKeywords(RunKeywords, AlgorithmKeywords, total=False):
    """Options of :class:`PSI`."""


@dataclass(frozen=True)
class RunOptions:
    """The options of a run: which points are tested, how, and where tests are stored.

    Attributes:
        first: Number of the first point, from 1, which lies at the lower bounds. ``PSI(1024)``
            and ``PSI(3072, first=1025)`` together test the points of ``PSI(4096)``.
        sampling: Where the points come from: ``"lptau"`` by default, and for more than 51 variables
            the Sobol' points of SciPy, ``QMCSampling("sobol", scramble=False)``; or, as on the
            command line, ``"sobol"``, ``"halton"`` or ``"lhs"``, whose random points follow the
            seed; or another :class:`~pymoo_psi.UniformSampling`, such as
            :class:`~pymoo_psi.QMCSampling` or a sequence of your own.
        seed: Seed of a randomised sampling; in ``minimize``, pymoo's ``seed``.
        limits: Limits on objectives, variables and outputs, ``{"mass": 30, "width": (0.2, 0.4)}``;
            see :class:`TestTable`. A design that exceeds a limit, or has no value for it, counts as
            infeasible. The table keeps the design, so that other limits can be tried afterwards. A
            limit on an unknown column is an error.
        formulation: Used instead of ``limits`` to change objectives, directions, limits, computed
            columns and constraints. The study keeps the original values; the table shows them under
            the formulation.
        share: ``(k, n)`` tests only the k-th of n parts of the points. The n parts together equal
            the run without ``share``; each part covers all bounds.
        study: Name of a study file. Tests are stored about every second, so that a kill costs the
            results of the last one, and also when an interrupt, SIGTERM or a failure ends the run.
            The table has the tests of this run, the file those of all runs. The same call continues
            an interrupted study, and a larger ``n_points`` extends it; no stored design is
            evaluated again. With a ``share`` it is the name of a folder with a file for each share,
            which :func:`~pymoo_psi.read_table` reads as one study.
        study_key: A version or constants of the model; a study rejects a changed key. The study
            itself compares name, variables, choices and number of objectives, and the numbers and
            texts that the problem was made with (arguments of its class that it keeps as
            attributes of the same name, but no paths), or what its method ``fingerprint()``
            returns. It does not know attributes of the class or the code of the model. Other
            bounds, samplings or requirements start another run in the same study.
        more: Whether ``n_points`` counts additional points of a study. If an interrupted run left
            points untested, the call tests only these.
        study_wait: Seconds to wait for other processes that are writing the study.
        retry: ``"failed"`` evaluates failed tests again; ``"incomplete"`` evaluates tests that lack
            a newer objective or a newer output with a limit.
        names: Names for variables, objectives and constraints, by their default names: ``{"x1":
            "width", "f2": "efficiency", "g1": "stress"}``. Tables, studies, files, plots and limits
            use them. By default those of the problem's attribute ``names``.
        maximize: The objectives to maximize, by these names. pymoo minimizes, so ``out["F"]`` holds
            their negatives; columns in tables have the original values. By default the problem's
            attribute ``maximize``; a list that omits one of these is an error, and an empty list
            minimizes all.
        units: Units of columns by these names, also of further outputs. By default those of the
            problem's attribute ``units``.
        log: Variables with a logarithmic scale: points are spread evenly, and surrogates measure
            distances, in the logarithm. By default those of the problem's attribute ``log``.
        requirements: Rules on variables, ``{"slender": "height <= 4*width"}`` or ``{"mix": "a + b +
            c = 1"}``, or functions; see :class:`Required`. The model never runs for a design that
            violates one: it counts as infeasible. By default those of the problem's attribute
            ``requirements``.
        repeat: Number of tests for each design if the problem is ``noisy``; designs are compared by
            their means. A larger number continues a study.
        block_size: Points per iteration of ``PSI``; display, callback and termination are called
            after each iteration. By default there are at most 32 iterations of at least 64 points.
            For ``investigate``, the most points that are evaluated together.

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

    def __post_init__(self) -> None:
        """Check what can be checked without a problem."""
        integer("first", self.first, minimum=1)
        object.__setattr__(self, "sampling", uniform_sampling(self.sampling))
        if self.seed is not None:
            integer("seed", self.seed, minimum=0)
        integer("repeat", self.repeat, minimum=1)
        if self.block_size is not None:
            integer("block_size", self.block_size, minimum=1)
        positive_number("study_wait", self.study_wait)
        if boolean("more", self.more) and self.study is None:
            raise invalid("more", "used with a study, which says what the run has", self.more)
        if self.retry is not None:
            known_name("retry", self.retry, ("failed", "incomplete"))
        if self.formulation is not None:
            instance("formulation", self.formulation, Formulation)
            if self.limits:
                remedy = "give them as Formulation(limits=...)"
                raise invalid("limits", "left out beside a formulation", self.limits, remedy)
        if self.log is not None:
            collection("log", self.log, "a list of variables", "one goes into a list too")

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


def run_options(owner: str, arguments: Entries, keywords: Any) -> tuple[RunOptions, Values]:
    """Return the run options among keyword arguments, and the other arguments, which are pymoo's.

    Args:
        owner: Name of the callable, for the message.
        arguments: The keyword arguments.
        keywords: The ``TypedDict`` of those that the owner takes.

    Raises:
        ArgumentTypeError: A keyword is unknown; a near miss is pointed out.
    """
    require_known_keywords(owner, object, arguments, more=keywords.__annotations__)
    others = dict(arguments)
    options = {}
    for field in fields(RunOptions):
        if field.name in others:
            options[field.name] = others.pop(field.name)
    return RunOptions(**options), others


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
