"""Runs: an algorithm, a budget, a seed, and what came of it; done, kept and found again."""

from __future__ import annotations

import copy
import re
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.problems.multi import BNH

from pymoo_psi._files import whole_file
from pymoo_psi._kinds import Kind
from pymoo_psi._validation import counted, identity_text
from pymoo_psi.comparison._algorithms import NamedAlgorithm
from pymoo_psi.errors import (
    EvaluationError,
    PsiError,
    RunError,
    StudyCorruptError,
    StudyMismatchError,
)
from pymoo_psi.pareto import competes, meets_constraints, nondominated
from pymoo_psi.problems import evaluate_designs
from pymoo_psi.problems._design_space import DesignSpace, design_space
from pymoo_psi.problems._identity import problem_identity
from pymoo_psi.problems._wrapped import WrappedProblem

Array = NDArray[np.float64]

_NUMBERS = ("n_evaluated", "seconds", "evaluation_seconds")

_warm: set[str] = set()  # names of the algorithms that have run once in this process


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
        returned: ``(k, m)`` objectives of the designs that the algorithm itself returned.
        n_evaluated: Designs evaluated, counted by the problem.
        seconds: Wall time of the run, without the counting.
        evaluation_seconds: The part of it that was spent in the problem.
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
        """Return the objectives to be assessed: ``"evaluated"`` or ``"returned"``."""
        return self.F if assess == "evaluated" else self.returned


def perform(problem: Any, algorithm: NamedAlgorithm, task: Task) -> Run:
    """Do a run.

    Raises:
        RunError: The problem or the algorithm raised; the message says in which run.
    """
    _warm_up(algorithm)
    observed = ObservedProblem(problem, task.n_evaluations)
    returned = np.zeros((0, problem.n_obj))
    began = time.perf_counter()
    try:
        # Without a seed an algorithm is deterministic, and any number will do.
        returned = algorithm.search(observed, task.n_evaluations, task.seed or 0)
    except BudgetSpentError:
        pass  # what it evaluated within the budget is assessed
    except EvaluationError as error:
        observed.failure = error
    except PsiError:
        raise
    except Exception as error:
        raise RunError(str(task), f"{type(error).__name__}: {error}") from error
    if observed.failure is not None:  # also where PSI has recorded it and gone on: one rule for all
        reason = f"a design that failed: {observed.failure.reason}"
        raise RunError(str(task), reason) from observed.failure
    seconds = time.perf_counter() - began - observed.counting_seconds
    X, F = observed.front()
    return Run(
        task,
        design_space(problem).free.to_matrix(X),
        F,
        returned,
        observed.n_evaluated,
        seconds,
        observed.evaluation_seconds,
    )


def _warm_up(algorithm: NamedAlgorithm) -> None:
    """Let an algorithm import what it needs, once a process; no run is charged for it."""
    if algorithm.name in _warm or not algorithm.known:
        return
    _warm.add(algorithm.name)
    with suppress(Exception):  # an algorithm that suits other problems only
        algorithm.search(ObservedProblem(BNH(), 16), 16, 0)


class ObservedProblem(WrappedProblem):
    """A problem that counts, times and keeps what an algorithm evaluates, and ends at a budget.

    That the problem counts, not the algorithm, makes the cost of all algorithms the same thing.

    Args:
        problem: The problem that is wrapped, whose variables, bounds, objectives and constraints
            it takes over.
        budget: How many designs may be evaluated.

    Attributes:
        wrapped: The problem.
        n_evaluated: Designs evaluated so far.
        failure: The design that failed last, if one did.
        evaluation_seconds: Wall time spent in the problem.
        counting_seconds: Wall time spent here, which is no part of the algorithm's.
    """

    def __init__(self, problem: Any, budget: int) -> None:
        # NaN is replaced where values are checked; pymoo would look for it in the reasons, too.
        super().__init__(problem, elementwise=False, replace_nan_values_by=None)
        self.budget = budget
        self.failure: EvaluationError | None = None
        self.n_evaluated = 0
        self.evaluation_seconds = self.counting_seconds = 0.0
        self._kept: list[tuple[Any, Array]] = []

    def do(self, X: Any, return_values_of: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Evaluate designs; pymoo calls this from ``evaluate``."""
        began = time.perf_counter()
        if self.n_evaluated + len(X) > self.budget:  # before a design beyond it is evaluated
            raise BudgetSpentError(
                f"an algorithm must keep its budget of {self.budget} evaluations, got a request "
                f"for {self.n_evaluated + len(X)}"
            )
        designs = copy.deepcopy(X)  # before a model may change those that it is given
        asked = time.perf_counter()
        try:
            # Not by pymoo's `do`, which turns a transposed F round and fills in a missing G.
            out = evaluate_designs(self.wrapped, X, *args, stop=True, **kwargs)
        except EvaluationError as error:
            self.failure = error
            raise
        answered = time.perf_counter()
        self.n_evaluated += len(X)
        F, G, H = out["F"], out["G"], out["H"]
        # Only those that can be in a front are kept, so that memory follows the feasible designs.
        rows = np.flatnonzero(competes(F, meets_constraints(G, H)))
        self._kept.append((designs[rows], F[rows]))
        self.evaluation_seconds += answered - asked
        out |= dict.fromkeys({*return_values_of} - {*out})
        formatted: dict[str, Any] = self._format_dict(out, len(X), return_values_of)
        self.counting_seconds += asked - began + time.perf_counter() - answered
        return formatted

    def front(self) -> tuple[Any, Array]:
        """Return the feasible designs that no evaluated one dominates, and their objectives."""
        if not self._kept:
            return np.zeros((0, self.n_var)), np.zeros((0, self.n_obj))
        X, F = (np.concatenate(parts) for parts in zip(*self._kept, strict=True))
        best = nondominated(F)
        return X[best], F[best]


class BudgetSpentError(PsiError):
    """An algorithm asked for more evaluations than it was given."""


@dataclass(frozen=True)
class RunStore:
    """A folder of runs on one problem, so that a comparison goes on after an interruption.

    Each run is a file of its own, written whole or not at all, so that processes side by side
    need no lock.

    Attributes:
        folder: The folder. Its file ``problem.json`` says which problem the runs are on.
        space: The variables of the problem.
    """

    folder: Path
    space: DesignSpace

    @classmethod
    def of(cls, folder: str | PathLike[str], problem: Any) -> RunStore:
        """Return the store in a folder, which is made if there is none.

        Raises:
            StudyMismatchError: The folder holds runs on another problem.
        """
        store = cls(Path(folder), design_space(problem).free)
        store.folder.mkdir(parents=True, exist_ok=True)
        asked = problem_text(problem)
        path = store.folder / "problem.json"
        if not path.exists():
            with whole_file(path) as written:
                written.write_text(asked, encoding="utf-8")
        elif path.read_text(encoding="utf-8") != asked:
            raise StudyMismatchError(
                f"{folder} holds runs on another problem, or with other bounds or constants "
                f"(see {path}); give another folder"
            )
        return store

    def load(self, task: Task) -> Run | None:
        """Return a run if it is stored.

        Raises:
            StudyCorruptError: The file is no run, or damaged.
        """
        path = self._path(task)
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
                numbers = (stored[name].item() for name in _NUMBERS)
                X = stored["X"]
                X = _values(self.space, X) if X.dtype.kind == "U" else X
                return Run(task, X, stored["F"], stored["returned"], *numbers)
        except FileNotFoundError:
            return None
        except Exception as error:  # whatever is wrong with a file that is no archive
            raise StudyCorruptError(f"{path} is no stored run: {error}; remove it") from error

    def save(self, run: Run) -> None:
        """Write a run."""
        numbers: dict[str, Any] = {name: getattr(run, name) for name in _NUMBERS}
        X = run.X.astype(str) if run.X.dtype == object else run.X
        with whole_file(self._path(run.task)) as path, path.open("wb") as file:
            np.savez_compressed(file, X=X, F=run.F, returned=run.returned, **numbers)

    def _path(self, task: Task) -> Path:
        """Return a name that can be read, and that no other task has."""
        plain = re.sub(r"[^A-Za-z0-9+-]+", "_", task.algorithm)
        # The user's names may differ in what no file name may hold, such as "a/b" and "a b", or
        # be longer than one may be.
        if plain != task.algorithm or len(plain) > 80:
            name = task.algorithm.encode(errors="surrogatepass")
            plain = f"{plain[:80]}.{sha256(name).hexdigest()[:8]}"
        seed = "" if task.seed is None else f"_seed{task.seed}"
        return self.folder / f"{plain}_{task.n_evaluations}{seed}.npz"


def _values(space: DesignSpace, texts: NDArray[np.str_]) -> NDArray[np.object_]:
    """Return designs of variables of several types, which are stored as texts."""
    X = np.empty(texts.shape, dtype=object)
    for j, (variable, column) in enumerate(zip(space.variables, texts.T, strict=True)):
        read: dict[Kind, Callable[[str], Any]] = {
            Kind.REAL: float,
            Kind.INTEGER: int,
            Kind.BINARY: "True".__eq__,
            Kind.CHOICE: {str(option): option for option in variable.options}.__getitem__,
        }
        X[:, j] = [read[variable.kind](text) for text in column.tolist()]
    return X


def problem_text(problem: Any) -> str:
    """Return name, variables, bounds, sizes and own fingerprint of a problem as JSON."""
    space = design_space(problem)
    bounds = {"lower": space.lower.tolist(), "upper": space.upper.tolist()}
    return identity_text(problem_identity(problem, space) | bounds, sort_keys=True, indent=1)
