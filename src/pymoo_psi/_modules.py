"""Versions of the modules of users, so that no run mixes two versions of a model.

A process keeps the version of a module that it has imported; a worker that starts later imports
the file as it is then. So the content of each file is noted when this process imports it. A run is
refused if a file has changed since, and a worker refuses a model if it has another version of a
module than the process that sent it. Answers of workers bring their versions, as a model may import
modules when it runs; a run accepts one version of each.

Modules of the standard library and of installed packages do not count.
"""

from __future__ import annotations

import ast
import inspect
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import source_hash
from pathlib import Path
from typing import Any

from pymoo_psi.errors import ArgumentValueError, WorkerError

REMEDY = "reload it and what imports it (importlib.reload) and make the problem again, or restart"

_INSTALLED = (os.path.dirname(os.__file__), os.path.dirname(__file__))
# The version of each module as it was imported last; empty for those that are not of users.
_NOTED: dict[str, bytes] = {}
_RELOADED: set[str] = set()  # modules that were imported with another content before


def watch() -> None:
    """Note the modules that this process has imported, and from now on those that it imports.

    A later look would be too late, as a file may change between its import and the first run. So
    Python finds modules by the ``find_spec`` of this one.
    """
    versions()
    finders: list[Any] = sys.meta_path
    finders.insert(finders.index(PathFinder), sys.modules[__name__])


def find_spec(name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
    """Find a module as Python does, and note its version."""
    spec = PathFinder.find_spec(name, path, target)
    if spec is not None:
        _note(name, spec.origin)
    return spec


def _note(name: str, file: str | None) -> None:
    version = b""
    if file and not file.startswith(_INSTALLED) and "-packages" not in file:
        with suppress(OSError):  # it is no file
            version = version_of(file)
    if name in sys.modules and _NOTED.setdefault(name, version) != version:
        _RELOADED.add(name)
    _NOTED[name] = version


def version_of(file: str) -> bytes:
    """Return the version of a file as it is now."""
    return source_hash(Path(file).read_bytes())


def versions() -> dict[str, bytes]:
    """Return the versions of the modules of users that this process has, by their names."""
    for name in sys.modules.keys() - _NOTED.keys():
        # imported before this package, or found by another finder
        _note(name, getattr(sys.modules.get(name), "__file__", None))
    return {
        name: version
        for name, version in _NOTED.copy().items()  # other threads may import, too
        if version and name in sys.modules and name != "__main__"
    }


def require_unchanged(model: Any) -> None:
    """Refuse a problem or a function if a file has changed since it was imported.

    A problem of a former class has the former code, even if the file was reloaded.

    Raises:
        ArgumentValueError: A file has changed.
    """
    for layer in _layers(model):
        if _has_former_code(layer):
            raise _changed(layer.__module__)
    current = versions()
    for name, version in _versions_of(model, current).items():
        if version != current[name]:
            raise _changed(name)


def code_of(model: Any) -> dict[str, str]:
    """Return the versions of the code of a problem: its modules, and its classes in a script."""
    code = {}
    for name, version in _versions_of(model, versions()).items():
        code[f"module {name}"] = version.hex()
    for layer in _layers(model):
        for kind in type(layer).__mro__:
            if kind.__module__ == "__main__":
                with suppress(OSError, TypeError):  # it was typed
                    source = inspect.getsource(kind).encode()
                    code[f"class {kind.__name__}"] = source_hash(source).hex()
    return code


def _layers(model: Any) -> list[Any]:
    """Return a problem and those that it wraps."""
    layers = []
    while model is not None:
        layers.append(model)
        model = getattr(model, "wrapped", None)
    return layers


def _versions_of(model: Any, current: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the versions of the files of a problem as they are now, by the names of modules.

    They are that of its class, those of all modules whose names occur in it, and so on.
    """
    names = [getattr(layer, "__module__", "") for layer in _layers(model)]
    now = {}
    for name in names:  # which grows
        file = getattr(sys.modules.get(name), "__file__", None) or ""
        if name not in current or not os.path.isfile(file):
            continue
        source = Path(file).read_bytes()
        now[name] = source_hash(source)
        words = _names_in(source)
        for other in current:
            if other.rpartition(".")[2] in words and other not in names:
                names.append(other)
    return now


@cache
def _names_in(source: bytes) -> set[str]:
    """Return the names in the code of a module, and texts that may be names of modules."""
    names: set[str] = set()
    with suppress(SyntaxError, ValueError):  # it is no source
        for node in ast.walk(ast.parse(source)):
            for field in ("id", "attr", "name", "module", "value"):
                name = getattr(node, field, None)
                if isinstance(name, str):
                    names.update(name.split("."))
    return names


def _has_former_code(model: Any) -> bool:
    """Whether the class of a model is no longer that of its module, which was reloaded."""
    kind = type(model)
    if kind.__module__ not in _RELOADED or kind.__qualname__ != kind.__name__:  # of a function
        return False
    return getattr(sys.modules.get(kind.__module__), kind.__name__, kind) is not kind


def _changed(module: str) -> ArgumentValueError:
    file = os.path.basename(sys.modules[module].__file__ or "")
    return ArgumentValueError(
        f"the problem cannot be run: {file} has changed since it was imported; {REMEDY}"
    )


def accept(known: dict[str, bytes], others: Mapping[str, bytes]) -> None:
    """Add the versions of a worker to those that a run has accepted.

    Raises:
        WorkerError: Another version of a module is known.
    """
    for name, version in others.items():
        if known.setdefault(name, version) != version:
            raise WorkerError(
                f"{name} has changed during the run, and workers have imported two versions of it; "
                "repeat the call, with another study if one was given"
            )
