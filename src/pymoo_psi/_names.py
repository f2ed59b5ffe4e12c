"""Names of the package: imported at their first use, and those that went with version 0.4."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, NoReturn, ParamSpec, TypeVar

import lazy_loader

from pymoo_psi.errors import ArgumentTypeError

Arguments = ParamSpec("Arguments")
Answer = TypeVar("Answer")

# Below this line of a stub stand the names that only other subpackages use.
_SHARED = "# isort: split"


def attach_names(
    module: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a subpackage.

    Args:
        module: Name of the subpackage.
        file: Its ``__init__.py``; the stub is beside it.

    Returns:
        The two functions find all names of the stub; ``__all__`` has the public ones.
    """
    getattribute, directory, _ = lazy_loader.attach_stub(module, file)
    stub = Path(file).with_suffix(".pyi").read_text(encoding="utf-8")
    public, _, _ = stub.partition(_SHARED)
    return getattribute, directory, re.findall(r"import \w+ as (\w+)", public)


class Renamed:
    """An attribute or method of another name; whoever asks for the old one is told the new one."""

    def __init__(self, instead: str) -> None:
        self._instead = instead

    def __set_name__(self, owner: type[Any], name: str) -> None:
        """Learn the old name."""
        self._name = name

    def __get__(self, instance: object, owner: type[Any]) -> NoReturn:
        """Raise the error of a missing attribute."""
        raise AttributeError(f"{self._name} is gone since 0.4; use {self._instead}")


def asked_under_a_formulation(function: Callable[Arguments, Answer]) -> Callable[Arguments, Answer]:
    """Refuse the limits that a question took before a table carried its formulation."""
    parameters = inspect.signature(function).parameters.values()
    positional = sum(p.kind is not p.KEYWORD_ONLY for p in parameters)

    @wraps(function)
    def checked(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Answer:
        if len(args) > positional or not {"limits", "normalize"}.isdisjoint(kwargs):
            rule = "takes neither limits nor normalize since 0.4"
            remedy = "ask table.under(limits=..., normalize=...)"
            raise ArgumentTypeError(f"{function.__name__} {rule}; {remedy}")
        return function(*args, **kwargs)

    return checked
