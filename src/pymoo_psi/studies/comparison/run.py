"""One run: an algorithm, a budget, a seed, and what came of it."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.problems.multi import BNH

from pymoo_psi.errors import PsiError, RunError
from pymoo_psi.host import design_space
from pymoo_psi.studies.comparison.contenders import Contender
from pymoo_psi.studies.comparison.observed import BudgetSpentError, ObservedProblem

__all__ = ["Run", "Task", "perform"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Task:
    """A run to be done.

    Attributes:
        algorithm: Name of the algorithm.
        n_evaluations: The budget.
        seed: The seed; ``None`` if the algorithm leaves nothing to chance.

    Example:
        >>> print(Task("nsga3", 1024, 7))
        nsga3, 1024 evaluations, seed 7
    """

    algorithm: str
    n_evaluations: int
    seed: int | None

    def __str__(self) -> str:
        """Return the run as a message names it."""
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"{self.algorithm}, {self.n_evaluations} evaluations{seed}"


@dataclass(frozen=True, eq=False)
class Run:
    """What an algorithm found with a budget.

    Attributes:
        task: Which run it is.
        X: ``(n, n_var)`` the feasible designs that no evaluated design dominates, as a matrix.
        F: ``(n, m)`` their objectives.
        returned: ``(k, m)`` objectives of the designs that the algorithm itself returned.
        n_evaluated: Designs evaluated, counted by the problem.
        seconds: Wall time of the run, without the counting.
        evaluation_seconds: The part of it that was spent in the problem.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> bnh = get_problem("bnh")
        >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
        >>> run = result.runs[0]
        >>> run.task, run.n_evaluated, run.evaluation_seconds < run.seconds
        (Task(algorithm='psi', n_evaluations=32, seed=None), 32, True)
    """

    task: Task
    X: NDArray[Any]
    F: Array
    returned: Array
    n_evaluated: int
    seconds: float
    evaluation_seconds: float

    def __repr__(self) -> str:
        """Return which run it is and how much it found."""
        return f"Run({self.task}: {len(self.F)} non-dominated designs)"

    def found(self, assess: str) -> Array:
        """Return the objectives to be assessed: ``"evaluated"`` or ``"returned"``.

        Example:
            >>> from pymoo.problems import get_problem
            >>> from pymoo_psi import compare
            >>> bnh = get_problem("bnh")
            >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
            >>> psi = result.runs[0]  # PSI returns the best of all that it evaluated
            >>> bool((psi.found("evaluated") == psi.found("returned")).all())
            True
        """
        return self.F if assess == "evaluated" else self.returned


def perform(problem: Any, contender: Contender, task: Task) -> Run:
    """Do a run.

    Raises:
        RunError: The problem or the algorithm raised; the message says in which run.
    """
    _warm_up(contender)
    observed = ObservedProblem(problem, task.n_evaluations)
    returned = np.zeros((0, problem.n_obj))
    began = time.perf_counter()
    try:
        returned = contender.search(observed, task.n_evaluations, task.seed or 0)
    except BudgetSpentError:
        pass  # what it evaluated within the budget is assessed
    except PsiError:
        raise
    except Exception as error:
        raise RunError(str(task), f"{type(error).__name__}: {error}") from error
    seconds = time.perf_counter() - began - observed.bookkeeping_seconds
    X, F = observed.front()
    return Run(
        task,
        design_space(problem).to_matrix(X),
        F,
        returned,
        observed.n_evaluated,
        seconds,
        observed.evaluation_seconds,
    )


_WARM: set[str] = set()


def _warm_up(contender: Contender) -> None:
    """Let an algorithm import what it needs, once a process; no run is charged for it."""
    if contender.name in _WARM or not contender.known:
        return
    _WARM.add(contender.name)
    with suppress(Exception):  # an algorithm that suits other problems only
        contender.search(ObservedProblem(BNH(), 16), 16, 0)
