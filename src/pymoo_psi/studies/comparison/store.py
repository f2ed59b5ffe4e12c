"""Finished runs as files in a folder, so that a comparison goes on after an interruption.

Each run is a file of its own, written whole or not at all, so that processes side by side need no
lock. It holds arrays in NumPy's format; a file beside them says which problem they are on.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from hashlib import sha256
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi.errors import StudyCorruptError, StudyMismatchError
from pymoo_psi.investigation.whole_file import whole_file
from pymoo_psi.studies.comparison.identity import problem_text
from pymoo_psi.studies.comparison.run import Run, Task

__all__ = ["RunStore"]

_NUMBERS = ("n_evaluated", "seconds", "evaluation_seconds")


@dataclass(frozen=True)
class RunStore:
    """A folder of runs on one problem.

    Attributes:
        folder: The folder. Its file ``problem.json`` says which problem the runs are on.
    """

    folder: Path

    @classmethod
    def of(cls, folder: str | PathLike[str], problem: Any) -> RunStore:
        """Return the store in a folder, which is made if there is none.

        Raises:
            StudyMismatchError: The folder holds runs on another problem.
        """
        store = cls(Path(folder))
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
                return Run(task, stored["X"], stored["F"], stored["returned"], *numbers)
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
        if plain != task.algorithm:
            plain = f"{plain}.{sha256(task.algorithm.encode()).hexdigest()[:8]}"
        seed = "" if task.seed is None else f"_seed{task.seed}"
        return self.folder / f"{plain}_{task.n_evaluations}{seed}.npz"
