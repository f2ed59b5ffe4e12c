"""Indicators of quality against the number of evaluations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pymoo_psi.arguments import known_name
from pymoo_psi.figures.comparison.parts import (
    algorithm_entries,
    budget_ticks,
    checked,
    counted,
    heading,
    logarithmic,
    looks,
    put_legend,
)
from pymoo_psi.figures.style import WIDTH, inches, on_axes, page_style
from pymoo_psi.studies.comparison import INDICATORS, Comparison

__all__ = ["IndicatorCurves", "draw_indicator", "indicator_curves", "indicators_page"]

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
