"""Indicators of quality against the number of evaluations.

What a run costs in time and what it brings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pymoo_psi._validation import known_name
from pymoo_psi.comparison import INDICATORS, Comparison
from pymoo_psi.plots._comparison_style import (
    algorithm_entries,
    budget_ticks,
    checked,
    counted,
    heading,
    logarithmic,
    looks,
    put_legend,
    rows_of,
)
from pymoo_psi.plots._style import WIDTH, inches, on_axes, page_style

Array = NDArray[np.float64]

_MEANINGS = {
    "hypervolume": "hypervolume (share of the box)",
    "igd_plus": "IGD+ (units of N − U)",
    "epsilon": "additive epsilon (units of N − U)",
    "optimum_distance": "optimum distance (units of N − U)",
}


@dataclass(frozen=True, eq=False)
class IndicatorCurves:
    """An indicator of a algorithms at b budgets, over the runs of each.

    Attributes:
        indicator: Such as ``"hypervolume"``.
        algorithms: Names of the algorithms.
        evaluations: The budgets, rising.
        median: ``(a, b)`` medians, infinite where the median run found nothing.
        lower: ``(a, b)`` first quartiles, values that occurred.
        upper: ``(a, b)`` third quartiles, likewise.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> curves = indicator_curves(comparison, "igd_plus")
        >>> curves.algorithms, curves.median.shape
        (('psi', 'nsga3'), (2, 2))
    """

    indicator: str
    algorithms: tuple[str, ...]
    evaluations: tuple[int, ...]
    median: Array
    lower: Array
    upper: Array

    @property
    def logarithmic(self) -> bool:
        """Whether the axis is logarithmic: of distances that are all above 0.

        Example:
            >>> one = np.array([[1.0]])
            >>> IndicatorCurves("epsilon", ("psi",), (64,), one, one - 1, one).logarithmic
            False
        """
        values = np.concatenate([self.lower, self.median, self.upper])
        known = values[np.isfinite(values)]
        return self.indicator != "hypervolume" and len(known) > 0 and bool((known > 0).all())

    @property
    def left_out(self) -> str:
        """What is not drawn, as it is infinite; empty if nothing is.

        Example:
            >>> one = np.array([[1.0]])
            >>> IndicatorCurves("epsilon", ("psi",), (64,), one, one, one + np.inf).left_out
            'infinite, not drawn: 1 quartile'
        """
        medians = int((~np.isfinite(self.median)).sum())
        quartiles = int((~np.isfinite(self.lower)).sum() + (~np.isfinite(self.upper)).sum())
        counts = [
            counted(n, what) for n, what in ((medians, "median"), (quartiles, "quartile")) if n
        ]
        return f"infinite, not drawn: {', '.join(counts)}" if counts else ""


def indicator_curves(comparison: Comparison, indicator: str) -> IndicatorCurves:
    """Take the medians and quartiles of an indicator from :meth:`.Comparison.summary`.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.

    Raises:
        ArgumentValueError: The indicator is unknown.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> median = indicator_curves(comparison, "hypervolume").median
        >>> bool((median[:, 0] < median[:, 1]).all())  # more evaluations, more hypervolume
        True
    """
    comparison = checked(comparison)
    known_name("indicator", indicator, INDICATORS)
    summary = comparison.summary().set_index(["algorithm", "evaluations"])
    names, budgets = comparison.algorithms, comparison.evaluations
    median, lower, upper = (
        np.array([[summary.loc[(name, n), column] for n in budgets] for name in names], float)
        for column in (indicator, f"{indicator}_q1", f"{indicator}_q3")
    )
    return IndicatorCurves(indicator, names, budgets, median, lower, upper)


def draw_indicator(curves: IndicatorCurves, *, legend: bool = True, ax: Axes | None = None) -> Axes:
    """Draw the medians as lines and the quartiles as bands.

    Infinite values are left out, and a line above the axes says so.

    Args:
        curves: From :func:`indicator_curves`.
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
        >>> ax = draw_indicator(indicator_curves(comparison, "epsilon"))
        >>> ax.get_yscale(), [tick.get_text() for tick in ax.get_xticklabels()]
        ('log', ['32', '64'])
    """
    median, lower, upper = (
        np.where(np.isfinite(values), values, np.nan)
        for values in (curves.median, curves.lower, curves.upper)
    )
    n, budgets = len(curves.algorithms), np.array(curves.evaluations, float)
    with on_axes(ax) as axes:
        budget_ticks(axes, curves.evaluations)
        beside = len(budgets) == 1  # the algorithms, as they make no lines
        if beside:
            axes.set_xlim(budgets[0] / 1.12 ** (n + 1), budgets[0] * 1.12 ** (n + 1))
        if np.isnan(median).all():
            axes.set_yticks([])
        if curves.logarithmic:
            logarithmic(axes, "y", (1.0, 2.0, 5.0))
        for k, look in enumerate(looks(curves.algorithms).values()):
            x = budgets * 1.12 ** (k - (n - 1) / 2) if beside else budgets
            band = {"color": look["color"], "linewidth": 0}
            axes.fill_between(x, lower[k], upper[k], alpha=0.15, **band)
            axes.vlines(x, lower[k], upper[k], color=look["color"], linewidth=0.8, alpha=0.6)
            axes.plot(x, median[k], markersize=4.0, linewidth=1.2, **look)
        axes.set_ylabel(_MEANINGS[curves.indicator])
        axes.set_title(curves.left_out, loc="right", fontsize=7)
        if legend:
            put_legend(axes, algorithm_entries(curves.algorithms))
    return axes  # type: ignore[no-any-return]


def indicators_page(comparison: Comparison) -> Figure:
    """Return the four indicators against evaluations.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> len(indicators_page(comparison).axes)
        4
    """
    comparison = checked(comparison)
    with page_style():
        figure = Figure(figsize=inches(WIDTH, 150.0), layout="constrained")
        for ax, indicator in zip(figure.subplots(2, 2).ravel(), INDICATORS, strict=True):
            draw_indicator(indicator_curves(comparison, indicator), legend=False, ax=ax)
        band = Patch(facecolor="0.5", alpha=0.3, linewidth=0)
        entries = algorithm_entries(comparison.algorithms)
        put_legend(figure, [*entries, ("bands: between the quartiles", band)])
        heading(figure, comparison, "quality against evaluations, medians", comparison.evaluations)
    return figure


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
