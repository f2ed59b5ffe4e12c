"""Finished runs as files in a folder, so that a comparison goes on after an interruption.

Each run is a file of its own, written whole or not at all, so that processes side by side need no
lock. It holds arrays in NumPy's format and, as JSON, what it is a run of.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from hashlib import sha256
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi.algorithms.memory import problem_identity
from pymoo_psi.errors import StudyCorruptError, StudyMismatchError
from pymoo_psi.host import design_space
from pymoo_psi.investigation.whole_file import whole_file
from pymoo_psi.studies.comparison.run import Run, Task

__all__ = ["RunStore"]

_NUMBERS = ("n_evaluated", "seconds", "evaluation_seconds")


@dataclass(frozen=True)
class RunStore:
    """A folder of runs on one problem.

    Attributes:
        folder: The folder.
        problem: Name, variables, bounds and sizes of the problem as JSON: runs on another
            problem are refused.
    """

    folder: Path
    problem: str

    @classmethod
    def of(cls, folder: str | PathLike[str], problem: Any) -> RunStore:
        """Return the store in a folder, which is made if there is none."""
        Path(folder).mkdir(parents=True, exist_ok=True)
        space = design_space(problem)
        bounds = {"lower": space.lower.tolist(), "upper": space.upper.tolist()}
        identity = json.dumps({**problem_identity(problem, space), **bounds}, sort_keys=True)
        return cls(Path(folder), identity)

    def load(self, task: Task) -> Run | None:
        """Return a run if it is stored.

        Raises:
            StudyMismatchError: The folder holds runs on another problem.
            StudyCorruptError: The file is no run, or damaged.
        """
        path = self._path(task)
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        except FileNotFoundError:
            return None
        except Exception as error:  # whatever is wrong with a file that is no archive
            raise StudyCorruptError(f"{path} is no stored run: {error}; remove it") from error
        if str(arrays["problem"]) != self.problem:
            raise StudyMismatchError(
                f"{self.folder} holds runs on another problem, or with other bounds or constants; "
                "give another folder"
            )
        numbers = (arrays[name].item() for name in _NUMBERS)
        return Run(task, arrays["X"], arrays["F"], arrays["returned"], *numbers)

    def save(self, run: Run) -> None:
        """Write a run."""
        arrays: dict[str, Any] = {name: getattr(run, name) for name in _NUMBERS}
        X = run.X.astype(str) if run.X.dtype == object else run.X
        with whole_file(self._path(run.task)) as path, path.open("wb") as file:
            np.savez_compressed(
                file, X=X, F=run.F, returned=run.returned, problem=self.problem, **arrays
            )

    def _path(self, task: Task) -> Path:
        """Return a name that can be read, and that no other task has."""
        plain = re.sub(r"[^A-Za-z0-9+-]+", "_", task.algorithm)
        if plain != task.algorithm:
            plain = f"{plain}.{sha256(task.algorithm.encode()).hexdigest()[:8]}"
        seed = "" if task.seed is None else f"_seed{task.seed}"
        return self.folder / f"{plain}_{task.n_evaluations}{seed}.npz"
