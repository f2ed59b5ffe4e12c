"""Runs: an algorithm spends a budget on a problem; the results are kept as a study.

The algorithms by name:

``psi``
    Parameter Space Investigation with the LPτ points. Deterministic: one run.
``psi-scrambled``
    The same with SciPy's scrambled Sobol' points. Different seeds show how much depends on the
    choice of points.
``nsga3``
    NSGA-III (:func:`pymoo_psi.nsga3`).
``nsga2``
    NSGA-II with the population size of :func:`pymoo_psi.nsga3`.
``psi+nsga3``
    Half the budget for PSI, the rest for NSGA-III, which starts from the best test points.
``psi-scrambled+nsga3``
    The same with scrambled points.
``surrogate``
    LPτ points, then designs that surrogates propose (:class:`pymoo_psi.SurrogatePSI`); for a few
    hundred evaluations.
``surrogate-scrambled``
    The same with scrambled points.

The first LPτ points are the corner of the lower bounds and the middle of the bounds. Many test
problems have Pareto-optimal designs there by coincidence, which says nothing about a method. The
variants with scrambled points avoid this.
"""

from __future__ import annotations

import copy
import json
import time
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import ReferenceDirectionSurvival
from pymoo.core.algorithm import Algorithm
from pymoo.core.termination import NoTermination
from pymoo.optimize import minimize
from pymoo.termination.default import DefaultTermination

from pymoo_psi._validation import (
    Array,
    Designs,
    Entries,
    Head,
    Values,
    collection,
    counted,
    identity_facts,
    invalid,
    known_name,
    wrong_type,
)
from pymoo_psi.algorithms import (
    PSI,
    Points,
    QMCSampling,
    UniformSampling,
    nsga3,
    operators,
    population_size,
    reference_directions,
    run_within_budget,
    table_of_values,
    vary_logarithms,
)
from pymoo_psi.errors import PsiError, StudyMismatchError
from pymoo_psi.files import table_of
from pymoo_psi.problems import (
    Wrapper,
    design_space,
    evaluate_designs,
    problem_identity,
    problem_schema,
)
from pymoo_psi.study import Study, write_study
from pymoo_psi.table import POINT, Schema, TestTable, columns_of, head_of

DEFAULT_ALGORITHMS = ("psi", "psi-scrambled", "nsga3", "psi+nsga3")

_FEW = (64, 128, 256)  # with surrogates a run of 4096 evaluations would take minutes


@dataclass(frozen=True)
class Search:
    """How an algorithm searches.

    Attributes:
        run: Takes a problem, a number of evaluations and a seed, and evaluates so many designs.
        is_random: Whether the designs depend on the seed.
        budgets: The numbers of evaluations by default; powers of 2, as so many LPτ points form
            complete nets.
    """

    run: Callable[[Any, int, int], object]
    is_random: bool = True
    budgets: tuple[int, ...] = (256, 1024, 4096)


def searches(algorithms: Collection[str] | Entries) -> dict[str, Search]:
    """Return the search of each algorithm by name.

    Args:
        algorithms: Names; or a mapping from the user's names to such names, to pymoo algorithms,
            which are copied for each run, or to functions that take a number of evaluations and
            return a new algorithm.

    Raises:
        ArgumentValueError: A name is unknown, or there is none.
        ArgumentTypeError: The argument is something else.
    """
    if not isinstance(algorithms, Mapping):
        names = collection("algorithms", algorithms, "names or a mapping")
        algorithms = dict(zip(names, names, strict=True))
    if not algorithms:
        raise invalid("algorithms", f"one or more, such as {', '.join(DEFAULT_ALGORITHMS)}", [])
    return {str(name): _search(name, algorithm) for name, algorithm in algorithms.items()}


def _search(name: Any, algorithm: Any) -> Search:
    """Return the search of one entry of a mapping of algorithms."""
    if isinstance(algorithm, type):
        rule = "a name, an algorithm or a function"
        remedy = f"give lambda n: {algorithm.__name__}(...)"
        raise wrong_type(f"algorithms[{name!r}]", rule, algorithm, remedy)
    if isinstance(algorithm, Algorithm):
        return Search(partial(_run_algorithm, lambda _: algorithm))
    if callable(algorithm):
        return Search(partial(_run_algorithm, algorithm))
    return SEARCHES[known_name("algorithms", algorithm, SEARCHES)]


# Functions of the module, so that they can be sent to processes.


def _nsga3(problem: Any, n: int, seed: int) -> None:
    nsga3(problem, n_evaluations=n, seed=seed)


def _psi_then_nsga3(sampling: UniformSampling | None, problem: Any, n: int, seed: int) -> None:
    """Spend half the budget on PSI with the points of a sampling, the rest on NSGA-III."""
    n_psi = max(n // 2, 1)
    n_nsga3 = n - n_psi
    tested = minimize(problem, PSI(n_psi, sampling=sampling), seed=seed).pop
    if n_nsga3 == 0:
        return
    size = population_size(problem.n_obj, n_nsga3)
    # NSGA-III's own selection among the tests: feasible designs first, the best, well spread.
    survival = ReferenceDirectionSurvival(reference_directions(problem.n_obj, size))
    random = np.random.default_rng(seed)
    n_start = min(size, len(tested))
    start = survival.do(problem, tested, n_survive=n_start, random_state=random)
    nsga3(problem, n_evaluations=n_nsga3, seed=seed, sampling=start)


def _surrogate_psi(n: int, **options: Any) -> Algorithm:
    from pymoo_psi.algorithms import SurrogatePSI  # brings half of SciPy, a second

    return SurrogatePSI(n, **options)


def _nsga2(problem: Any, n: int, seed: int) -> None:
    size = population_size(problem.n_obj, n)
    algorithm = NSGA2(pop_size=size, seed=seed, **operators(problem))
    vary_logarithms(algorithm, problem)
    run_within_budget(algorithm, problem, n, termination=NoTermination())


def _run_algorithm(make: Callable[[int], Any], problem: Any, n: int, seed: int) -> None:
    """Run the algorithm that a function returns for a budget."""
    # A copy even if it was made for this run: all instances of SPEA2 share one survival, which
    # would carry the ideal point of one run into the next.
    algorithm = copy.deepcopy(make(n))
    options = getattr(algorithm, "options", None)
    if getattr(options, "study", None) is not None:  # it would answer for another run
        raise invalid("an algorithm", "without a study; compare has folder=", algorithm)
    algorithm.seed = seed
    # The budget ends the run, not the default criteria of NSGA-II and others, which ended long
    # runs before half of their evaluations.
    if algorithm.termination is None or isinstance(algorithm.termination, DefaultTermination):
        algorithm.termination = NoTermination()
    run_within_budget(algorithm, problem, n)


_SCRAMBLED = QMCSampling("sobol")
SEARCHES: dict[str, Search] = {
    "psi": Search(partial(_run_algorithm, PSI), is_random=False),
    "psi-scrambled": Search(partial(_run_algorithm, partial(PSI, sampling=_SCRAMBLED))),
    "nsga3": Search(_nsga3),
    "nsga2": Search(_nsga2),
    "surrogate": Search(partial(_run_algorithm, _surrogate_psi), budgets=_FEW),
    "surrogate-scrambled": Search(
        partial(_run_algorithm, partial(_surrogate_psi, sampling=_SCRAMBLED)), budgets=_FEW
    ),
    "psi+nsga3": Search(partial(_psi_then_nsga3, None)),
    "psi-scrambled+nsga3": Search(partial(_psi_then_nsga3, _SCRAMBLED)),
}


# Runs

_KEPT = ("F", "G", "H", "failure")  # the outputs of an evaluation that are kept


@dataclass(frozen=True)
class Task:
    """A run to be done.

    Attributes:
        algorithm: Name of the algorithm.
        n_evaluations: The budget.
        seed: The seed; ``None`` if the designs do not depend on it.
    """

    algorithm: str
    n_evaluations: int
    seed: int | None

    def __str__(self) -> str:
        """Return the run as messages name it."""
        text = f"{self.algorithm}, {counted(self.n_evaluations, 'evaluation')}"
        if self.seed is None:
            return text
        return f"{text}, seed {self.seed}"


@dataclass(frozen=True, eq=False)
class RunResult:
    """The results of a run.

    Attributes:
        task: Algorithm, budget and seed.
        X: ``(n, n_var)`` the feasible designs that no evaluated design dominates, as a matrix.
        F: ``(n, m)`` their objectives.
        n_evaluated: Number of designs evaluated, counted by the problem.
        seconds: Wall time of the run.
        evaluation_seconds: Wall time spent in the problem.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> compare(get_problem("bnh"), n_evaluations=16, algorithms=["psi"]).runs[0]
        RunResult(psi, 16 evaluations: 11 non-dominated designs)
    """

    task: Task
    X: Designs
    F: Array
    n_evaluated: int
    seconds: float
    evaluation_seconds: float

    def __repr__(self) -> str:
        """Return the task and the number of non-dominated designs."""
        return f"RunResult({self.task}: {len(self.F)} non-dominated designs)"


def _result(task: Task, tests: TestTable, **seconds: float) -> RunResult:
    """Return a run from the table of all its designs and its times."""
    best = tests.pareto()
    return RunResult(task, tests.X[best], tests.F[best], len(tests), **seconds)


def perform(
    problem: Any, by_name: Mapping[str, Search], folder: Path | None, task: Task
) -> RunResult:
    """Perform a run, and store it as a study in a folder if there is one.

    Raises:
        PsiError: The problem or the algorithm raised; the message says in which run.
    """
    observed = ObservedProblem(problem, task.n_evaluations)
    began = time.perf_counter()
    failure = _spend(observed, by_name[task.algorithm], task)
    times = {
        "seconds": time.perf_counter() - began,
        "evaluation_seconds": observed.evaluation_seconds,
    }
    if failure:
        raise PsiError(
            f"the run of {task} ended in {failure}; use FailureTolerant(problem) if designs fail, "
            "and leave out of algorithms what does not suit the problem"
        )
    tests = observed.tests()
    if folder is not None:
        head = _head(tests, problem) | {"run": asdict(task) | times}
        write_study(folder / _file_name(task), head, columns_of(tests, POINT))
    return _result(task, tests, **times)


def _spend(observed: ObservedProblem, search: Search, task: Task) -> str:
    """Spend the budget of a run, and return what has ended it before; empty if nothing has."""
    try:
        with warnings.catch_warnings():
            # of PSI, which goes on after the end; the failure has the reason
            warnings.filterwarnings("ignore", f".* failed: {EndOfRunError.__name__}")
            search.run(observed, task.n_evaluations, task.seed or 0)
    except EndOfRunError:
        return observed.failure
    except Exception as error:
        if observed.failure:
            return observed.failure
        if isinstance(error, PsiError):
            raise
        return f"{type(error).__name__}: {error}"
    return observed.failure


def _file_name(task: Task) -> str:
    """Return a readable name of a file that no other task has."""
    name = f"{quote(task.algorithm, safe='+ ')}_{task.n_evaluations}"
    if task.seed is not None:
        name += f"_seed{task.seed}"
    return f"{name}.db"


class ObservedProblem(Wrapper):
    """A problem that counts, times and keeps the evaluations of an algorithm within a budget.

    As the problem counts, and not the algorithm, the cost means the same for all algorithms. It
    ends a run that exceeds its budget, or in which a design fails: PSI alone would go on.

    Args:
        problem: The problem that is wrapped, with its variables, bounds, objectives and
            constraints.
        budget: Number of designs that may be evaluated.

    Attributes:
        wrapped: The problem.
        left: How many designs may still be evaluated.
        failure: The design that has failed and so ended the run; or an empty text.
        evaluation_seconds: Wall time spent in the problem.
    """

    same_front = True

    def __init__(self, problem: Any, budget: int) -> None:
        # pymoo would look for NaN in the reasons of failures, too; values are checked elsewhere.
        super().__init__(problem, elementwise=False, replace_nan_values_by=None)
        self.left = budget
        self.failure = ""
        self.evaluation_seconds = 0.0
        self._kept: list[Values] = []

    def do(self, X: Any, return_values_of: Any, **kwargs: Any) -> Values:
        """Evaluate designs; pymoo calls this from ``evaluate``."""
        if len(X) > self.left:
            raise EndOfRunError
        designs = np.array(design_space(self.wrapped).to_matrix(X))  # before a model changes them
        began = time.perf_counter()
        # pymoo's own `do` would transpose a wrong F and fill in a missing G.
        out = evaluate_designs(self.wrapped, X, **kwargs)
        for reason in filter(None, out["failure"]):
            self.failure = f"a design that failed: {reason}"
            self.left = 0  # PSI takes the error for that of a design, and asks for the next ones
            raise EndOfRunError
        self.evaluation_seconds += time.perf_counter() - began
        self.left -= len(X)
        self._kept.append({"X": designs, **{name: out[name] for name in _KEPT}})
        return self.formatted(X, out, return_values_of)

    def tests(self) -> TestTable:
        """Return all designs that were evaluated, numbered from 1."""
        values = {}
        for name in ("X", *_KEPT):
            values[name] = np.concatenate([evaluation[name] for evaluation in self._kept])
        X = values.pop("X")
        points = Points(np.arange(1, 1 + len(X)), 0)
        return table_of_values(_schema(self.wrapped), points, X, values)


class EndOfRunError(PsiError):
    """The end of a run: a design has failed, or its budget is spent."""


# Each run is stored as a study in its own file, which is written completely or not at all, so that
# parallel processes need no lock. In addition to the tests, the head has a "run".


def stored_results(folder: Path, problem: Any) -> Iterator[RunResult]:
    """Yield the runs in a folder, which is created if it does not exist.

    Raises:
        StudyMismatchError: A study in the folder is not a run on this problem.
        StudyError: A file is damaged.
    """
    folder.mkdir(parents=True, exist_ok=True)
    expected = _head(TestTable.empty(_schema(problem)), problem)
    _, others = problem_identity(problem)
    if others:
        warnings.warn(
            f"the folder does not compare what the problem's {', '.join(others)} is made of; "
            "give the problem a method fingerprint()",
            stacklevel=4,
        )
    for path in sorted(folder.glob("*.db")):
        facts, columns = Study(path).contents()
        head = dict(facts.head)
        run = head.pop("run", None)
        if run is None or _facts(head, expected) != _facts(expected, head):
            raise StudyMismatchError(
                f"{path} is not a run on this problem, but on another problem, or with other "
                "bounds or constants; give another folder"
            )
        task = Task(run.pop("algorithm"), run.pop("n_evaluations"), run.pop("seed"))
        yield _result(task, table_of(head, columns), **run)


def _facts(head: Head, other: Head) -> tuple[str, dict[str, str]]:
    """Return what identifies the problem of a run, as far as another head is compared with it."""
    columns = {name: value for name, value in head.items() if name != "problem"}
    facts = identity_facts(head.get("problem") or {}, other.get("problem") or {})
    return json.dumps(columns, sort_keys=True), facts


def _schema(problem: Any) -> Schema:
    """Return the columns of the tests of runs, which are without outputs."""
    schema = problem_schema(problem, design_space(problem))
    return schema.without(schema.outputs)


def _head(tests: TestTable, problem: Any) -> Values:
    """Return the head of a study of a run, which identifies the problem."""
    identity, _ = problem_identity(problem)
    return {**head_of(tests), "problem": identity}
