"""The errors of the package: every one derives from :class:`PsiError`."""

from __future__ import annotations

from textwrap import shorten
from typing import Any


class PsiError(Exception):
    """Base class of every error raised on purpose by ``pymoo_psi``.

    Example:
        >>> from pymoo_psi import lp_tau
        >>> try:
        ...     lp_tau(4, 60)
        ... except PsiError as error:
        ...     print(error)
        n_dim must be at most 51 for LPτ, got 60; use QMCSampling, whose engines have no such limit
    """


# The errors of arguments, files and runs are also the built-in ones: code that catches ValueError
# or OSError, as callers of NumPy and of open() do, works with this package, too.
class ArgumentValueError(PsiError, ValueError):
    """An argument has the right type but a value that violates a rule.

    Example:
        >>> from pymoo_psi import lp_tau
        >>> lp_tau(-1, 2)
        Traceback (most recent call last):
        pymoo_psi.errors.ArgumentValueError: n_points must be an integer >= 0, got -1
    """


class ArgumentTypeError(PsiError, TypeError):
    """An argument has a type that cannot be used.

    Example:
        >>> from pymoo_psi import lp_tau
        >>> lp_tau(2.5, 2)
        Traceback (most recent call last):
        pymoo_psi.errors.ArgumentTypeError: n_points must be an integer >= 0, got 2.5
    """


class StudyError(PsiError):
    """A study file cannot be used; its content is unchanged.

    Example:
        It catches every problem with a study:

        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> try:
        ...     investigate(VectorizedSphereChute(), 8, study="absent/chute.db")
        ... except StudyError as error:
        ...     print("no study:", error)
        no study: ...absent/chute.db...
    """


class StudyMismatchError(StudyError):
    """The study file belongs to another problem, or another file has taken its place meanwhile.

    Example:
        >>> import os, tempfile
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     study = os.path.join(folder, "chute.db")
        ...     table = investigate(VectorizedSphereChute(mu=0.2), 8, study=study)
        ...     try:
        ...         investigate(VectorizedSphereChute(mu=0.4), 8, study=study)
        ...     except StudyMismatchError as error:
        ...         print("mu" in str(error))
        True
    """


class StudyCorruptError(StudyError):
    """The file is damaged, is no study, or has a format of a later version; it is left untouched.

    Example:
        >>> import pathlib, tempfile
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "notes.db")
        ...     size = path.write_text("no study at all")
        ...     try:
        ...         investigate(VectorizedSphereChute(), 8, study=path)
        ...     except StudyCorruptError:
        ...         print(path.read_text())
        no study at all
    """


class StudyLockedError(StudyError):
    """Another process is writing the study."""


class StudyAccessError(StudyError, OSError):
    """The study file does not exist, or cannot be read or written.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> try:
        ...     investigate(VectorizedSphereChute(), 8, study="absent/chute.db")
        ... except OSError as error:
        ...     print(type(error).__name__)
        StudyAccessError
    """


class EvaluationError(PsiError, RuntimeError):
    """A design cannot be evaluated: the model raises, or the process that evaluates it ends.

    Attributes:
        design: The design.
        reason: The reason, in one line.
        original: The exception that the model raised, if any. Its cause has the traceback of
            another process; if it cannot be pickled, a RuntimeError replaces it.

    Example:
        >>> from pymoo_psi import JoblibRunner
        >>> def model(x):
        ...     raise ArithmeticError("no convergence")
        >>> try:
        ...     JoblibRunner()(model, [[0.0]])
        ... except EvaluationError as error:
        ...     print(error.design, error.reason)
        [0.0] ArithmeticError: no convergence
    """

    def __init__(self, design: Any, reason: str, original: BaseException | None = None) -> None:
        super().__init__(
            f"design {_in_a_line(design)} cannot be evaluated: {reason}; "
            "FailureTolerant(problem), or PSI, records such designs and goes on"
        )
        self.design = design
        self.reason = reason
        self.original = original
        self.__cause__ = original

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the arguments of the constructor, not by the message."""
        # Exceptions rebuild themselves from args, here the message: unpickling in the parent of a
        # worker would raise a TypeError instead of this error.
        return type(self), (self.design, self.reason, self.original)


class WorkerError(PsiError, RuntimeError):
    """Worker processes cannot be used: they do not start, or the problem cannot be sent to them.

    Example:
        >>> import threading
        >>> from pymoo_psi import ProcessRunner
        >>> lock = threading.Lock()
        >>> def model(x):
        ...     with lock:
        ...         return {"F": [0.0]}
        >>> try:
        ...     ProcessRunner(timeout=60)(model, [[0.5]])
        ... except WorkerError as error:
        ...     print(error)
        the problem cannot be sent to worker processes: ...keep open files, locks and connections...
    """


def _in_a_line(design: Any) -> str:
    """Return a design as one line, cut: many variables would bury the reason of an error."""
    if isinstance(design, dict):  # of mixed variables
        design = ", ".join(f"{name} = {value}" for name, value in design.items())
    elif hasattr(design, "tolist"):  # numbers of NumPy, which are shown with all digits
        design = design.tolist()
    return shorten(str(design), 200, placeholder="...")
