"""The pages of a comparison as files, beside each other in a folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from matplotlib.figure import Figure

from pymoo_psi.comparison import Comparison
from pymoo_psi.plots._comparison_fronts import attainment_page, fronts_page
from pymoo_psi.plots._comparison_indicators import indicators_page, time_page
from pymoo_psi.plots._comparison_style import checked
from pymoo_psi.plots._style import save_pages


def save_comparison(
    comparison: Comparison, directory: str | os.PathLike[str], *, dpi: int = 200
) -> tuple[Path, ...]:
    """Write the pages as files: all of them, or none if one cannot be made.

    They are ``indicators.png``, ``fronts.png``, ``time.png`` and, for two objectives,
    ``attainment.png``.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        directory: An existing folder; files of these names in it are replaced.
        dpi: Dots per inch; a page is 180 mm wide.

    Returns:
        The paths written.

    Raises:
        OSError: The folder does not exist or cannot be written to.

    Example:
        >>> import tempfile
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_comparison(comparison, folder, dpi=20)]
        ['indicators.png', 'fronts.png', 'time.png', 'attainment.png']
    """
    return save_pages(_pages(checked(comparison)), directory, dpi)


def _pages(comparison: Comparison) -> Iterator[tuple[str, Figure]]:
    yield "indicators.png", indicators_page(comparison)
    yield "fronts.png", fronts_page(comparison)
    yield "time.png", time_page(comparison)
    if comparison.objectives == 2:
        yield "attainment.png", attainment_page(comparison)
