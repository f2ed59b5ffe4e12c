"""How good an investigation is against the number of tests."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from pymoo_psi._validation import instance
from pymoo_psi.plots._style import CURVES, new_page, wrapped
from pymoo_psi.table import Convergence

_LETTERS = 96  # of a line over the width of a page
_NAMED = 6  # test points named beside the curve: the last ones, which are about the decision


def convergence_page(convergence: Convergence, *, title: str = "") -> Figure:
    """Return distance of the best design, hypervolume and covering radius against tests.

    Args:
        convergence: From :func:`pymoo_psi.table.convergence`.
        title: What was tested; the verdict follows it.

    Raises:
        ArgumentTypeError: ``convergence`` is none.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> from pymoo_psi.table import convergence
        >>> table = investigate(VectorizedSphereChute(0.4), 256)
        >>> len(convergence_page(convergence(table)).axes)
        3
    """
    found = instance("convergence", convergence, Convergence, "convergence(table) gives one")
    verdict = wrapped(found.verdict(), _LETTERS)
    with new_page(78.0) as figure:
        for ax, values, name in zip(
            figure.subplots(1, 3),
            (found.mu1, found.hypervolume, found.covering_radius),
            (
                r"distance $\mu_1$ of the best design to $U$",
                "hypervolume (share of the last)",
                "covering radius (sides of the box)",
            ),
            strict=True,
        ):
            _draw_curve(ax, found, np.where(np.isfinite(values), values, np.nan))
            ax.set_title(name)
            known = values[np.isfinite(values)]
            ax.set_ylim(0, 1.4 * known.max(initial=0) or 1)  # room for names over the last points
        _name_designs(figure.axes[0], found)
        figure.suptitle(f"{title}\n{verdict}".strip())
    return figure


def _draw_curve(ax: Axes, found: Convergence, values: object) -> None:
    ax.plot(found.tests, values, markersize=3.5, linewidth=1.2, **CURVES[0])  # type: ignore[arg-type]
    ax.set_xscale("log", base=2)
    shown = found.tests[::-1][::2][::-1]  # every other one, the last among them
    ax.set_xticks(shown, [str(n) for n in shown.tolist()])
    ax.set_xlim(found.tests[0] / 1.25, found.tests[-1] * 1.25)  # also where the first have none
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xlabel("tests")


def _name_designs(ax: Axes, found: Convergence) -> None:
    """Write the number of the best test point where it changes."""
    previous = 0
    for k in range(max(len(found.tests) - _NAMED, 0), len(found.tests)):
        number, height = int(found.optimum[k]), float(found.mu1[k])
        if number not in (0, previous) and np.isfinite(height):
            ax.annotate(
                f"no. {number}", (found.tests[k], height), (-1, 4), textcoords="offset points",
                ha="left", va="bottom", fontsize=6, rotation=60,
            )  # fmt: skip
        previous = number
