"""Names of the package, and of its arguments.

Names are imported at their first use, and found by those of other packages. In errors an argument
has the name that the user has given it, such as that of an option.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType
from typing import Any

import lazy_loader

# Below this line of a stub stand the names that only other subpackages use.
_SHARED = "# isort: split"

# What users of pymoo, pandas and SciPy look for in a class or module, and what to use here.
_OTHER_NAMES = {
    "TestTable": {
        "page": "decision_page(table)",
        "report": "decision_report(table)",
        "explain": "pymoo_psi.explain(table)",
        "to_excel": "pymoo_psi.write_table(table, path)",
        "plot": "the functions of pymoo_psi.plots",
        "head": "to_frame().head()",
        "loc": "take(rows)",
        "iloc": "take(rows)",
        "query": "under(limits=...)",
        "pareto_front": "take(table.pareto())",
        "opt": "best()",
    },
    "EfficiencyRanking": {
        "best": "salukvadze",
        "head": "to_frame().head()",
        "plot": "the functions of pymoo_psi.plots",
    },
    "pymoo_psi": {
        "minimize": "pymoo.optimize.minimize",
        "sensitivities": "pymoo_psi.analysis.sensitivities",
        "sobol": "lp_tau",
    },
}

# What errors call arguments that the user has not given, or by another name.
_NAMES: ContextVar[Mapping[str, str]] = ContextVar("_NAMES", default=MappingProxyType({}))


EDIT = "an edit of the file"  # what an error recommends where a command has no option for it
# Arguments that users give as options of a command; None in Python.
_OPTIONS: ContextVar[Collection[str] | None] = ContextVar("_OPTIONS", default=None)


@contextmanager
def named_as(names: Mapping[str, str], options: Collection[str] | None = None) -> Iterator[None]:
    """Give arguments other names in errors.

    Args:
        names: The names of some arguments.
        options: The arguments that a command has as options; errors recommend no others.
    """
    if options is None:
        options = _OPTIONS.get()
    before = _NAMES.set({**_NAMES.get(), **names})
    before_options = _OPTIONS.set(options)
    try:
        yield
    finally:
        _NAMES.reset(before)
        _OPTIONS.reset(before_options)


def name_of(subject: str) -> str:
    """Return the subject of an error, in which an argument has the name that the user knows.

    The argument is the subject, or ends it: "'f9' in limits".
    """
    place, blank, argument = subject.rpartition(" ")
    if place and not place.endswith((" of", " in", ":")):
        return subject
    return f"{place}{blank}{_NAMES.get().get(argument, argument)}"


def operand(name: str) -> str:
    """Return the name of a column as expressions have it: in backquotes if it is no plain word.

    Example:
        >>> operand("mass"), operand("mass of all")
        ('mass', '`mass of all`')
    """
    if re.fullmatch(r"[^\W\d]\w*", name):  # unlike an identifier of Python, without N·m
        return name
    doubled = name.replace("`", "``")
    return f"`{doubled}`"


def argument(name: str, value: Any = None) -> str:
    """Return an argument, with its value if there is one, as an error recommends it.

    Example:
        >>> argument("skip_rows", [3])
        'read_table(..., skip_rows=[3])'
        >>> with named_as({}, ["skip_rows", "drop_incomplete"]):
        ...     argument("skip_rows", [3]), argument("drop_incomplete", True), argument("sheet")
        ('--skip-rows 3', '--drop-incomplete', 'an edit of the file')
    """
    options = _OPTIONS.get()
    if options is None:
        if name == "objectives":  # an attribute, unlike the others
            return "Formulation(objectives=...)"
        given = "..." if value is None else repr(value)
        return f"read_table(..., {name}={given})"  # which also opens sources of pages and reports
    if name not in options:
        return EDIT
    option = f"--{name.replace('_', '-')}"
    if value is None or value is True:
        return option
    return f"{option} {repr(value).strip('[]')}"


def require_no_other_name(owner: str, name: str) -> None:
    """Refuse a name that the owner, a class or module, has not but other packages have.

    Raises:
        AttributeError: What it is called here.
    """
    instead = _OTHER_NAMES.get(owner, {}).get(name)
    if instead is not None:
        raise AttributeError(f"{owner} has no {name!r}; use {instead}")


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
    find, directory, _ = lazy_loader.attach_stub(module, file)

    def attribute(name: str) -> Any:
        require_no_other_name(module, name)
        return find(name)

    stub = Path(file).with_suffix(".pyi").read_text(encoding="utf-8")
    public, _, _ = stub.partition(_SHARED)
    return attribute, directory, re.findall(r"import \w+ as (\w+)", public)
