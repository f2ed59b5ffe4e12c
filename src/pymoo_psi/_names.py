"""Names of the package: imported at their first use, and those that went with version 0.4."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lazy_loader

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
