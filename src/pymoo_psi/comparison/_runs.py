"""Runs: an algorithm, a budget, a seed, and what came of it; each kept as a study."""

from __future__ import annotations

import copy
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.comparison._algorithms import NamedAlgorithm
from pymoo_psi.errors import EvaluationError, PsiError, RunError, StudyMismatchError
from pymoo_psi.parallel import active_workers
from pymoo_psi.problems import (
    WrappedProblem,
    design_space,
    evaluate_designs,
    problem_identity,
    problem_layout,
    problem_name,
)
from pymoo_psi.study import read_study, write_study
from pymoo_psi.table import Layout, TestTable, columns_of, design_matrix, head_of, table_of

Array = NDArray[np.float64]

_TRIAL = 256  # evaluations of a trial, which so takes a second or two with surrogates
_WARM = 0.5  # seconds of evaluations after which their time is known


@dataclass(frozen=True)
class Task:
    """A run to be done.

    Attributes:
        algorithm: Name of the algorithm.
        n_evaluations: The budget.
        seed: The seed; ``None`` if the algorithm is deterministic.
    """

    algorithm: str
    n_evaluations: int
    seed: int | None

    def __str__(self) -> str:
        """Return the run as a message names it."""
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"{self.algorithm}, {counted(self.n_evaluations, 'evaluation')}{seed}"


@dataclass(frozen=True, eq=False)
class Run:
    """What an algorithm found with a budget.

    Attributes:
        task: Which run it is.
        X: ``(n, n_var)`` the feasible designs that no evaluated design dominates, as a matrix.
        F: ``(n, m)`` their objectives.
        n_evaluated: Designs evaluated, counted by the problem.
        seconds: Wall time of the run.
        evaluation_seconds: The part of it that was spent in the problem.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> compare(get_problem("bnh"), n_evaluations=16, algorithms=["psi"]).runs[0]
        Run(psi, 16 evaluations: 11 non-dominated designs)
    """

    task: Task
    X: NDArray[Any]
    F: Array
    n_evaluated: int
    seconds: float
    evaluation_seconds: float

    def __repr__(self) -> str:
        """Return which run it is and how much it found."""
        return f"Run({self.task}: {len(self.F)} non-dominated designs)"


def _run(task: Task, tests: TestTable, **seconds: float) -> Run:
    """Return a run from all designs that it tested, and what it took."""
    best = tests.pareto()
    return Run(task, tests.X[best], tests.F[best], len(tests), **seconds)


def perform(problem: Any, algorithm: NamedAlgorithm, task: Task, folder: Path) -> Run:
    """Do a run, and keep it as a study in a folder.

    Raises:
        RunError: The problem or the algorithm raised; the message says in which run.
    """
    observed = ObservedProblem(problem, task.n_evaluations)
    began = time.perf_counter()
    try:
        # Without a seed an algorithm is deterministic, and any number will do.
        algorithm.search(observed, task.n_evaluations, task.seed or 0)
    except (BudgetSpentError, EvaluationError):
        pass  # what it evaluated within the budget is measured; the problem knows its failure
    except PsiError:
        raise
    except Exception as error:
        raise RunError(str(task), f"{type(error).__name__}: {error}") from error
    if observed.failure is not None:  # also where PSI has recorded it and gone on: one rule for all
        reason = f"a design that failed: {observed.failure.reason}"
        raise RunError(str(task), reason) from observed.failure
    took = {"seconds": time.perf_counter() - began}
    took["evaluation_seconds"] = observed.evaluation_seconds
    tests = observed.tests()
    head = {**_head(tests, problem), "run": {**asdict(task), **took}}
    # a name that can be read, and that no other task has
    seed = "" if task.seed is None else f"_seed{task.seed}"
    file = f"{quote(task.algorithm, safe='+ ')}_{task.n_evaluations}{seed}.db"
    write_study(folder / file, head, columns_of(tests))
    return _run(task, tests, **took)


class ObservedProblem(WrappedProblem):
    """A problem that counts, times and keeps what an algorithm evaluates, and ends at a budget.

    That the problem counts, not the algorithm, makes the cost of all algorithms the same thing.

    Args:
        problem: The problem that is wrapped, whose variables, bounds, objectives and constraints
            it takes over.
        budget: How many designs may be evaluated.
        evaluate: What gives the values, as :func:`pymoo_psi.problems.evaluate_designs` does.

    Attributes:
        wrapped: The problem.
        n_evaluated: Designs evaluated so far.
        failure: The design that failed last, if one did.
        evaluation_seconds: Wall time spent in the problem.
    """

    def __init__(
        self, problem: Any, budget: int, evaluate: Callable[..., Any] = evaluate_designs
    ) -> None:
        # NaN is replaced where values are checked; pymoo would look for it in the reasons, too.
        super().__init__(problem, elementwise=False, replace_nan_values_by=None)
        self.budget, self.model = budget, evaluate
        self.failure: EvaluationError | None = None
        self.n_evaluated = 0
        self.evaluation_seconds = 0.0
        self._kept: list[tuple[Any, dict[str, Any]]] = []

    def do(self, X: Any, return_values_of: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Evaluate designs; pymoo calls this from ``evaluate``."""
        if self.n_evaluated + len(X) > self.budget:  # before a design beyond it is evaluated
            raise BudgetSpentError(f"the budget of {self.budget} evaluations is spent")
        designs = copy.deepcopy(X)  # before a model may change those that it is given
        began = time.perf_counter()
        try:
            # Not by pymoo's `do`, which turns a transposed F round and fills in a missing G.
            out = self.model(self.wrapped, X, *args, stop=True, **kwargs)
        except EvaluationError as error:
            self.failure = error
            raise
        self.evaluation_seconds += time.perf_counter() - began
        self.n_evaluated += len(X)
        self._kept.append((designs, {name: out[name] for name in ("F", "G", "H", "failure")}))
        return self.formatted(X, out, return_values_of)

    def tests(self) -> TestTable:
        """Return all designs that were evaluated, numbered from 1."""
        layout, space = _layout(self.wrapped), design_space(self.wrapped)
        if not self._kept:
            return TestTable.empty(layout)
        designs, values = zip(*self._kept, strict=True)
        F, G, H, failure = (
            np.concatenate([out[name] for out in values]) for name in ("F", "G", "H", "failure")
        )
        X = space.to_matrix(np.concatenate(designs))
        numbers = range(1, 1 + len(F))
        reasons = {number: text for number, text in zip(numbers, failure, strict=True) if text}
        X = design_matrix("X", X, layout.variables, layout.kinds)
        return TestTable.of(numbers, X, F, G, H, reasons=reasons, layout=layout)


class BudgetSpentError(PsiError):
    """An algorithm asked for more evaluations than it was given."""


# What a comparison will take: algorithms on a stand-in of the problem, and a few evaluations of it.


def seconds_of_algorithms(
    problem: Any, algorithms: Mapping[str, NamedAlgorithm], tasks: Sequence[Task]
) -> dict[str, float]:
    """Return about how long each algorithm itself takes for its tasks, without the problem.

    Raises:
        ArgumentValueError: Some of the algorithms cannot run on such a problem.
    """
    seconds, unable = {}, []
    for name in dict.fromkeys(task.algorithm for task in tasks):
        budgets = [task.n_evaluations for task in tasks if task.algorithm == name]
        try:
            seconds[name] = _seconds_of_algorithm(problem, algorithms[name], budgets)
        except Exception as error:
            unable.append(f"{name} ({type(error).__name__}: {error})")
    if unable:
        received = Received(counted(len(unable), "other"))
        rule = f"able to run on {problem_name(problem)}"
        raise invalid("algorithms", rule, received, f"leave out {'; '.join(unable)}")
    return seconds


def costs(problem: Any, tasks: Sequence[Task], seconds: Mapping[str, float], n_jobs: int) -> str:
    """Return in words how much there is to do, and about how long it takes.

    Args:
        problem: The problem, of which a few designs are evaluated.
        tasks: The runs to be done.
        seconds: The time that their algorithms take for themselves.
        n_jobs: Number of workers.
    """
    each, workers = _seconds_of_evaluation(problem), active_workers(n_jobs).count
    needs = {
        name: own + each * sum(task.n_evaluations for task in tasks if task.algorithm == name)
        for name, own in seconds.items()
    }
    n, whole = sum(task.n_evaluations for task in tasks), sum(needs.values()) / workers
    text = f"{problem_name(problem)}: {counted(len(tasks), 'run')} of {counted(n, 'evaluation')}"
    if whole < 60:
        return f"{text} in all, less than a minute"
    parts = ", ".join(
        f"{name} {timedelta(seconds=round(own / workers))}" for name, own in needs.items()
    )
    about = timedelta(seconds=round(whole))
    return f"{text} in all, about {about} ({parts}; {each:.2g} s an evaluation)"


def _seconds_of_algorithm(problem: Any, algorithm: NamedAlgorithm, budgets: list[int]) -> float:
    """Return about how long the algorithm itself takes for its budgets, without the problem."""

    def tried(n: int) -> float:
        began = time.perf_counter()
        with suppress(BudgetSpentError):
            algorithm.search(ObservedProblem(problem, n, _invented), n, 0)
        return time.perf_counter() - began

    n = min(*budgets, _TRIAL)
    try:
        tried(n)  # loads modules
    except Exception:
        n = min(budgets)  # it may be made for its whole budget
    # Measured: the time of surrogates grows with the square of the budget.
    return tried(n) * sum((budget / n) ** (2 if algorithm.learns else 1) for budget in budgets)


def _invented(problem: Any, X: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
    """Return values that cost nothing: distances to points on the diagonal, all feasible."""
    space = design_space(problem)
    points = space.points(space.to_matrix(X))
    to = np.linspace(0.0, 1.0, problem.n_obj)
    distant = -1.0 - points.mean(axis=1, keepdims=True)
    return {
        "F": ((points[:, :, None] - to) ** 2).sum(axis=1),
        "G": distant * np.ones(problem.n_ieq_constr),
        "H": np.zeros((len(X), problem.n_eq_constr)),
        "failure": np.full(len(X), "", dtype=object),
    }


def _seconds_of_evaluation(problem: Any) -> float:
    """Return what an evaluation takes, of a model that takes several designs at once its share."""
    space, seconds = design_space(problem), 0.0
    points = np.random.default_rng(0).random((64, len(space.free.variables)))
    designs = space.designs(space.matrix(points))
    for n in (1, 8, 64):  # the first evaluation may load or start something
        began = time.perf_counter()
        evaluate_designs(problem, designs[:n])
        seconds = time.perf_counter() - began
        if seconds > _WARM:
            break
    return seconds / n


# Runs as studies: each in a file of its own, written whole or not at all, so that processes side by
# side need no lock. Beside the tests the head has a "run".


def stored_runs(folder: Path, problem: Any) -> Iterator[Run]:
    """Give the runs in a folder, which is made if there is none.

    Raises:
        StudyMismatchError: A study of the folder is no run on this problem.
        StudyError: A file is damaged.
    """
    folder.mkdir(parents=True, exist_ok=True)
    asked = _head(TestTable.empty(_layout(problem)), problem)
    for path in sorted(folder.glob("*.db")):
        head, columns = read_study(path)
        run = head.pop("run", None)
        if run is None or json.dumps(head, sort_keys=True) != json.dumps(asked, sort_keys=True):
            raise StudyMismatchError(
                f"{path} is no run on this problem, but on another problem, or with other bounds "
                "or constants; give another folder"
            )
        task = Task(*(run.pop(name) for name in ("algorithm", "n_evaluations", "seed")))
        yield _run(task, table_of(head, columns, path, TestTable), **run)


def _layout(problem: Any) -> Layout:
    return problem_layout(problem, design_space(problem))


def _head(tests: TestTable, problem: Any) -> dict[str, Any]:
    return {**head_of(tests), "problem": problem_identity(problem, design_space(problem))}
