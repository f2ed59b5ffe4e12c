"""Runs: an algorithm, a budget, a seed, and what came of it; each kept as a study."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import counted
from pymoo_psi.comparison._algorithms import Search
from pymoo_psi.errors import EvaluationError, PsiError, RunError, StudyMismatchError
from pymoo_psi.problems import (
    WrappedProblem,
    design_space,
    evaluate_designs,
    problem_identity,
    problem_layout,
)
from pymoo_psi.study import Study, write_study
from pymoo_psi.table import TestTable, columns_of, design_matrix, head_of, table_of

Array = NDArray[np.float64]

_KEPT = ("F", "G", "H", "failure")  # of each evaluation


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


def perform(problem: Any, search: Search, task: Task, folder: Path | None) -> Run:
    """Do a run, and keep it as a study in a folder if there is one.

    Raises:
        RunError: The problem or the algorithm raised; the message says in which run.
    """
    observed = ObservedProblem(problem, task.n_evaluations)
    began = time.perf_counter()
    try:
        # Without a seed an algorithm is deterministic, and any number will do.
        search(observed, task.n_evaluations, task.seed or 0)
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
    if folder is not None:
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

    Attributes:
        wrapped: The problem.
        failure: The design that failed last, if one did.
        evaluation_seconds: Wall time spent in the problem.
    """

    def __init__(self, problem: Any, budget: int) -> None:
        # NaN is replaced where values are checked; pymoo would look for it in the reasons, too.
        super().__init__(problem, elementwise=False, replace_nan_values_by=None)
        self.budget = self.left = budget
        self._space = design_space(problem)
        self.failure: EvaluationError | None = None
        self.evaluation_seconds = 0.0
        self._kept: list[dict[str, Any]] = []

    def do(self, X: Any, return_values_of: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Evaluate designs; pymoo calls this from ``evaluate``."""
        if len(X) > self.left:  # before a design beyond it is evaluated
            raise BudgetSpentError(f"the budget of {self.budget} evaluations is spent")
        designs = np.array(self._space.to_matrix(X))  # before a model changes them
        began = time.perf_counter()
        try:
            # Not by pymoo's `do`, which turns a transposed F round and fills in a missing G.
            out = evaluate_designs(self.wrapped, X, *args, stop=True, **kwargs)
        except EvaluationError as error:
            self.failure = error
            raise
        self.evaluation_seconds += time.perf_counter() - began
        self.left -= len(X)
        self._kept.append({"X": designs, **{name: out[name] for name in _KEPT}})
        return self.formatted(X, out, return_values_of)

    def tests(self) -> TestTable:
        """Return all designs that were evaluated, numbered from 1."""
        layout = problem_layout(self.wrapped, self._space)
        if not self._kept:
            return TestTable.empty(layout)
        X, F, G, H, failure = (
            np.concatenate([each[name] for each in self._kept]) for name in ("X", *_KEPT)
        )
        numbers = range(1, 1 + len(F))
        reasons = {number: text for number, text in zip(numbers, failure, strict=True) if text}
        X = design_matrix("X", X, layout.variables, layout.kinds)
        return TestTable.of(numbers, X, F, G, H, reasons=reasons, layout=layout)


class BudgetSpentError(PsiError):
    """An algorithm asked for more evaluations than it was given."""


# Runs as studies: each in a file of its own, written whole or not at all, so that processes side by
# side need no lock. Beside the tests the head has a "run".


def stored_runs(folder: Path, problem: Any) -> Iterator[Run]:
    """Give the runs in a folder, which is made if there is none.

    Raises:
        StudyMismatchError: A study of the folder is no run on this problem.
        StudyError: A file is damaged.
    """
    folder.mkdir(parents=True, exist_ok=True)
    asked = _head(TestTable.empty(problem_layout(problem, design_space(problem))), problem)
    for path in sorted(folder.glob("*.db")):
        facts, columns = Study(path).contents()
        head = facts["head"]
        run = head.pop("run", None)
        if run is None or json.dumps(head, sort_keys=True) != json.dumps(asked, sort_keys=True):
            raise StudyMismatchError(
                f"{path} is no run on this problem, but on another problem, or with other bounds "
                "or constants; give another folder"
            )
        task = Task(*(run.pop(name) for name in ("algorithm", "n_evaluations", "seed")))
        yield _run(task, table_of(head, columns, path, TestTable), **run)


def _head(tests: TestTable, problem: Any) -> dict[str, Any]:
    return {**head_of(tests), "problem": problem_identity(problem, design_space(problem))}
