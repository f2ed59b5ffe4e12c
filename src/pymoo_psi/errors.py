"""The errors of the package: every one derives from :class:`PsiError`."""

from __future__ import annotations

from typing import Any

__all__ = [
    "ArgumentTypeError",
    "ArgumentValueError",
    "EvaluationError",
    "PsiError",
    "RunError",
    "StudyAccessError",
    "StudyCorruptError",
    "StudyError",
    "StudyLockedError",
    "StudyMismatchError",
    "StudyVersionError",
    "WorkerError",
]


class PsiError(Exception):
    """Base class of every error raised on purpose by ``pymoo_psi``."""


class ArgumentValueError(PsiError, ValueError):
    """An argument has the right type but a value that breaks a rule."""


class ArgumentTypeError(PsiError, TypeError):
    """An argument has a type that cannot be used."""


class StudyError(PsiError):
    """A study file cannot be used as asked; what is stored in it is as it was."""


class StudyMismatchError(StudyError):
    """The study file belongs to another problem."""


class StudyCorruptError(StudyError):
    """The file is damaged, or is not a study file; it is left untouched."""


class StudyVersionError(StudyError):
    """The study file was written by a later version of the package."""


class StudyLockedError(StudyError):
    """Another process is writing the study."""


class StudyAccessError(StudyError, OSError):
    """The study file is not there, or cannot be read or written: rights, a full disk."""


class EvaluationError(PsiError, RuntimeError):
    """A design cannot be evaluated: the model raises, or its evaluation is lost on the way.

    Attributes:
        design: The design.
        reason: Why, as one line.
        original: What the model raised, if it did and if it can travel between processes.
        trace: The traceback in the process of the evaluation, if that was another one.
    """

    def __init__(
        self,
        design: Any,
        reason: str,
        original: BaseException | None = None,
        trace: str = "",
    ) -> None:
        shown = " ".join(str(getattr(design, "tolist", lambda: design)()).split())
        if len(shown) > 200:
            shown = f"{shown[:197]}..."
        super().__init__(
            f"design {shown} cannot be evaluated: {reason}; "
            "FailureTolerant(problem) records such designs and goes on"
        )
        self.design = design
        self.reason = reason
        self.original = original
        self.trace = trace

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the arguments of the constructor, not by the message."""
        return type(self), (self.design, self.reason, self.original, self.trace)


class RunError(PsiError, RuntimeError):
    """A run of a comparison ended in an error of the algorithm or of the problem."""

    def __init__(self, run: str, reason: str) -> None:
        super().__init__(
            f"the run of {run} ended in {reason}; FailureTolerant(problem) goes on where designs "
            "fail, and an algorithm that does not suit the problem is left out of algorithms"
        )
        self.run, self.reason = run, reason

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the arguments of the constructor, not by the message."""
        return type(self), (self.run, self.reason)


class WorkerError(PsiError, RuntimeError):
    """Worker processes cannot be used: the problem does not travel, or they do not start."""
