"""The errors of the package: every one derives from :class:`PsiError`."""

from __future__ import annotations

__all__ = ["ArgumentTypeError", "ArgumentValueError", "PsiError"]


class PsiError(Exception):
    """Base class of every error raised on purpose by ``pymoo_psi``."""


class ArgumentValueError(PsiError, ValueError):
    """An argument has the right type but a value that breaks a rule."""


class ArgumentTypeError(PsiError, TypeError):
    """An argument has a type that cannot be used."""
