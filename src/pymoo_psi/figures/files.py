"""Pages as files, all of them or none."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

from matplotlib.figure import Figure

from pymoo_psi.arguments import integer

__all__ = ["save_pages"]


def save_pages(
    pages: Iterable[tuple[str, Figure]], directory: str | os.PathLike[str], dpi: int
) -> tuple[Path, ...]:
    """Write pages as they are made; no file changes before the last one is ready.

    Args:
        pages: Names of files, with what is to be in them.
        directory: An existing folder; files of these names in it are replaced.
        dpi: Dots per inch.

    Returns:
        The paths written.
    """
    dpi = integer("dpi", dpi, minimum=1)
    target = Path(directory)
    with tempfile.TemporaryDirectory(dir=target, prefix=".figures.") as folder:
        ready = []
        for name, figure in pages:
            ready.append(Path(folder, name))
            figure.savefig(ready[-1], dpi=dpi)
        for path in ready:
            os.replace(path, target / path.name)
    return tuple(target / path.name for path in ready)
