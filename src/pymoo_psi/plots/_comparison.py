"""Figures of a comparison of algorithms, and as files beside each other in a folder.

Each algorithm has a colour, a line style and a marker of its own, the same in all figures.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from pymoo_psi._validation import counted, instance, invalid, known_name
from pymoo_psi.comparison import INDICATORS, Comparison
from pymoo_psi.plots._style import (
    GREY,
    Drawing,
    legend_of,
    literal,
    new_figure,
    panels,
    save_figures,
)

Array = NDArray[np.float64]

# The lengths have no common factor: a look comes again after the product of them only.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")

_MEANINGS = {
    "hypervolume": "hypervolume (share of the box)",
    "igd_plus": "IGD+ (units of N − U)",
    "epsilon": "additive epsilon (units of N − U)",
    "optimum_distance": "optimum distance (units of N − U)",
}
_BAND = Patch(color="0.8", label="quartiles")
_DOTS: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": GREY, "markeredgewidth": 0.0}


def save_comparison(
    comparison: Comparison,
    directory: str | os.PathLike[str],
    *,
    dpi: int = 200,
    suffix: str = ".png",
) -> tuple[Path, ...]:
    """Write the figures as files: all of them, or none if one cannot be made.

    They are ``indicators.png`` and ``fronts.png``.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        directory: An existing folder; files of these names in it are replaced.
        dpi: Dots per inch; a figure is 180 mm wide.
        suffix: ``".png"``, ``".pdf"`` or ``".svg"``.

    Returns:
        The paths written.

    Raises:
        ArgumentValueError: The suffix is another.
        OSError: The folder does not exist or cannot be written to.

    Example:
        >>> import tempfile
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi.comparison import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_comparison(comparison, folder, dpi=20)]
        ['indicators.png', 'fronts.png']
    """
    made = ((page.__name__, page(comparison)) for page in (plot_indicators, plot_fronts))
    named = ((name.removeprefix("plot_"), figure) for name, figure in made)
    return save_figures(named, directory, dpi, suffix)


def _checked(comparison: Any) -> Comparison:
    return instance("comparison", comparison, Comparison, "compare(...) gives one")


def _budget_of(comparison: Comparison, evaluations: int | None) -> int:
    """Return one of the budgets, the largest unless one is given."""
    if evaluations is None:
        return comparison.evaluations[-1]
    if evaluations not in comparison.evaluations:
        known = ", ".join(map(str, comparison.evaluations))
        raise invalid("evaluations", f"one of the budgets {known}", evaluations)
    return int(evaluations)


def _rows_of(comparison: Comparison, algorithm: str, evaluations: int) -> list[int]:
    """Return the indices of the runs of an algorithm with one budget, the worst first."""
    frame = comparison.measures.reset_index(drop=True)
    frame = frame[(frame["algorithm"] == algorithm) & (frame["evaluations"] == evaluations)]
    return frame.sort_values("hypervolume", kind="stable").index.tolist()


def _reference_front(comparison: Comparison) -> Array:
    """Return the ``(k, m)`` reference set in the original units and direction."""
    frame = comparison.reference.frame
    front: Array = frame.ideal + (frame.nadir - frame.ideal) * comparison.reference.points
    return front * comparison.layout.sign + 0.0  # no -0.0


def _looks(comparison: Comparison) -> dict[str, dict[str, Any]]:
    """Return colour, line style and marker of each algorithm."""
    ways = zip(cycle(_COLOURS), cycle(_STYLES), cycle(_MARKERS), strict=False)
    return {
        name: {"color": colour, "linestyle": style, "marker": marker}
        for name, (colour, style, marker) in zip(comparison.algorithms, ways, strict=False)
    }


def _finish(
    figure: Drawing,
    comparison: Comparison,
    what: str,
    evaluations: Sequence[int],
    legend: dict[str, Any],
) -> None:
    """Put the legend below; say in the caption what is drawn, of which problem and runs."""
    seeds = counted(max(comparison.measures["seed"].dropna().nunique(), 1), "seed")
    budgets = f"{', '.join(map(str, evaluations))} evaluations, {seeds}"
    figure.describe(f"{comparison.problem}: {what}", f"{budgets}.")
    names = {
        literal(name, 30): Line2D([], [], linewidth=1.2, markersize=4.0, **look)
        for name, look in _looks(comparison).items()
    }
    legend_of(figure, names | legend, ncols=4, handlelength=3.6, fontsize=7)


def plot_indicators(comparison: Comparison) -> Drawing:
    """Return the four indicators against evaluations: medians as lines, quartiles as bands.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        Of the comparison in the example of :func:`save_comparison`:

        >>> print(*(ax.get_ylabel().split(" (")[0] for ax in plot_indicators(comparison).axes))
        hypervolume IGD+ additive epsilon optimum distance
    """
    comparison = _checked(comparison)
    with new_figure(150.0) as figure:
        for ax, indicator in zip(figure.subplots(2, 2).ravel(), INDICATORS, strict=True):
            plot_indicator(comparison, indicator, ax)
        what = "quality against evaluations, medians and quartiles"
        legend = {"bands: quartiles": _BAND}
        _finish(figure, comparison, what, comparison.evaluations, legend)
    return figure


def plot_indicator(comparison: Comparison, indicator: str, ax: Axes) -> None:
    """Draw the medians of an indicator as lines and the quartiles as bands.

    Infinite values are left out, and a line above the axes says so.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.
        ax: Axes to draw on.

    Raises:
        ArgumentValueError: The indicator is unknown.

    Example:
        Of the comparison in the example of :func:`save_comparison`:

        >>> from matplotlib.figure import Figure
        >>> ax = Figure().add_subplot()
        >>> plot_indicator(comparison, "epsilon", ax)
        >>> ax.get_yscale(), [tick.get_text() for tick in ax.get_xticklabels()]
        ('log', ['32', '64'])
    """
    known_name("indicator", indicator, INDICATORS)
    frame = _checked(comparison).summary().set_index("algorithm")
    columns = [indicator, f"{indicator}_q1", f"{indicator}_q3"]
    found = frame[columns].to_numpy(float)
    known = found[np.isfinite(found)]
    ax.set_xscale("log")
    if indicator != "hypervolume" and len(known) and (known > 0).all():
        ax.set_yscale("log")
    for name, look in _looks(comparison).items():
        rows = frame.loc[[name]]
        median, lower, upper = rows[columns].replace(np.inf, np.nan).to_numpy(float).T
        x = rows["evaluations"].to_numpy(float)
        ax.fill_between(x, lower, upper, color=look["color"], alpha=0.18, linewidth=0)
        ax.plot(x, median, markersize=4.0, linewidth=0.9, label=literal(name, 30), **look)
    ax.set_xticks(comparison.evaluations, [str(n) for n in comparison.evaluations])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.margins(x=0.1)
    ax.set(xlabel="evaluations", ylabel=_MEANINGS[indicator])
    if len(known) < found.size:
        ax.set_title("infinite values are not drawn", loc="right", fontsize=7)


def plot_fronts(comparison: Comparison, evaluations: int | None = None) -> Drawing:
    """Return the fronts of the runs of median hypervolume on common axes.

    Of two objectives each algorithm has one plane; of more a row of up to three, f1 against
    f2, f3 and f4. Of an even number of runs it is the lower of the two in the middle.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        evaluations: The budget; the largest by default.

    Raises:
        ArgumentValueError: There is no such budget.

    Example:
        Of the comparison in the example of :func:`save_comparison`:

        >>> print(plot_fronts(comparison, evaluations=32).axes[1].get_title(loc="left"))
        (b) nsga3, seed ...
        ... designs, hypervolume 0...
    """
    budget = _budget_of(_checked(comparison), evaluations)
    labels = [
        literal(comparison.layout.label_of(name), 28) for name in comparison.layout.objectives
    ]
    reference, sign = _reference_front(comparison), comparison.layout.sign
    n_planes = min(comparison.objectives - 1, 3)
    wide = n_planes if n_planes > 1 else min(len(comparison.algorithms), 3)
    with panels(len(comparison.algorithms) * n_planes, wide) as (figure, grid):
        places = iter(grid)
        for name, look in _looks(comparison).items():
            # Of an even number of runs it is the lower of the two in the middle.
            rows = _rows_of(comparison, name, budget)
            row = rows[(len(rows) - 1) // 2]
            run, front = comparison.runs[row], comparison.runs[row].F * sign
            marks = {**look, "linestyle": "none", "markersize": 3.0, "markeredgewidth": 0.0}
            for j, ax in enumerate([next(places) for _ in range(n_planes)], start=1):
                ax.plot(*reference[:, [0, j]].T, **_DOTS, markersize=2.0)
                ax.plot(*front[:, [0, j]].T, **marks)
                ax.set(xlabel=labels[0], ylabel=labels[j])
                if j == 1:
                    seed = "" if run.task.seed is None else f", seed {run.task.seed}"
                    quality = f"hypervolume {comparison.measures['hypervolume'].iloc[row]:.4f}"
                    designs = counted(len(front), "design")
                    title = f"{literal(name, 18)}{seed}\n{designs}, {quality}"
                    ax.set_title(title, loc="left", fontsize=7.5)
        for j in range(n_planes):  # common axes
            same = grid[j::n_planes]
            for ax in same[1:]:
                ax.sharex(same[0])
                ax.sharey(same[0])
            same[0].autoscale()
        legend = {"reference set": Line2D([], [], **_DOTS, markersize=4.0)}
        _finish(figure, comparison, "runs of median hypervolume", [budget], legend)
    return figure
