"""What a run costs in time and what it brings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from pymoo_psi.figures.comparison.parts import (
    algorithm_entries,
    checked,
    heading,
    logarithmic,
    looks,
    put_legend,
    rows_of,
)
from pymoo_psi.figures.style import WIDTH, inches, on_axes, page_style
from pymoo_psi.studies.comparison import Comparison

__all__ = ["RunTimes", "draw_times", "run_times", "time_page"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RunTimes:
    """Wall time and hypervolume of the runs of a algorithms with b budgets.

    Attributes:
        algorithms: Names of the algorithms.
        evaluations: The budgets, rising.
        seconds: Of each algorithm the ``(r,)`` wall times of its runs.
        hypervolume: Of each algorithm the ``(r,)`` hypervolumes of its runs.
        median_seconds: ``(a, b)`` medians of the wall time.
        median_hypervolume: ``(a, b)`` medians of the hypervolume.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> [len(seconds) for seconds in run_times(comparison).seconds]
        [2, 4]
    """

    algorithms: tuple[str, ...]
    evaluations: tuple[int, ...]
    seconds: tuple[Array, ...]
    hypervolume: tuple[Array, ...]
    median_seconds: Array
    median_hypervolume: Array


def run_times(comparison: Comparison) -> RunTimes:
    """Take the times and the hypervolumes of all runs, and their medians.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> run_times(comparison).median_hypervolume.shape
        (2, 2)
    """
    comparison = checked(comparison)
    names, budgets = comparison.algorithms, comparison.evaluations
    columns = [comparison.measures[name].to_numpy(float) for name in ("seconds", "hypervolume")]
    seconds, hypervolume = (
        tuple(column[rows_of(comparison, name)] for name in names) for column in columns
    )
    medians = (
        np.array([[np.median(column[rows_of(comparison, name, n)]) for n in budgets]
                  for name in names])
        for column in columns
    )  # fmt: skip
    return RunTimes(names, budgets, seconds, hypervolume, *medians)


def draw_times(times: RunTimes, *, legend: bool = True, ax: Axes | None = None) -> Axes:
    """Draw each run as a small marker, and the medians joined from budget to budget.

    Args:
        times: From :func:`run_times`.
        legend: Name the algorithms in the axes.
        ax: Axes to draw on; new ones by default.

    Returns:
        The axes.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> ax = draw_times(run_times(comparison))
        >>> ax.get_xlabel(), ax.get_xscale()
        ('wall time of a run (s)', 'log')
    """
    with on_axes(ax) as axes:
        logarithmic(axes, "x", (1.0, 3.0))
        for k, look in enumerate(looks(times.algorithms).values()):
            axes.plot(
                times.seconds[k], times.hypervolume[k], linestyle="none", marker=look["marker"],
                color=look["color"], markersize=2.4, markeredgewidth=0.0, alpha=0.5,
            )  # fmt: skip
            axes.plot(
                times.median_seconds[k], times.median_hypervolume[k], markersize=5.5,
                linewidth=1.2, **look,
            )  # fmt: skip
        axes.set_xlabel("wall time of a run (s)")
        axes.set_ylabel("hypervolume (share of the box)")
        if legend:
            put_legend(axes, algorithm_entries(times.algorithms))
    return axes  # type: ignore[no-any-return]


def time_page(comparison: Comparison) -> Figure:
    """Return time against quality.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> time_page(comparison).axes[0].get_ylabel()
        'hypervolume (share of the box)'
    """
    times = run_times(comparison)
    with page_style():
        figure = Figure(figsize=inches(WIDTH, 120.0), layout="constrained")
        draw_times(times, legend=False, ax=figure.subplots())
        dots = Line2D([], [], linestyle="none", marker="o", markersize=2.4, color="0.5")
        entries = algorithm_entries(times.algorithms)
        put_legend(figure, [*entries, ("small: single runs", dots)])
        heading(
            figure,
            comparison,
            "time and quality, medians joined from budget to budget",
            times.evaluations,
        )
    return figure
