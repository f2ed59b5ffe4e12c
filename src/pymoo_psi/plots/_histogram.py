"""Histograms: where the tested, the feasible and the Pareto-optimal designs lie."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pymoo_psi._validation import boolean
from pymoo_psi.plots._designs import FEASIBLE, GROUPS, PARETO, legend_below, literal, name_places
from pymoo_psi.plots._style import on_axes
from pymoo_psi.table import Histogram

Array = NDArray[np.float64]

_WRITTEN = 12  # bins over which there is room for the numbers

_LOOKS: dict[str, dict[str, Any]] = {
    "tested": {"facecolor": "0.9", "edgecolor": "0.55"},
    "feasible": {"facecolor": GROUPS[FEASIBLE].colour, "edgecolor": GROUPS[FEASIBLE].colour},
    "pareto": {"facecolor": GROUPS[PARETO].colour, "edgecolor": "black", "hatch": "////"},
}
_NAMES = {"tested": "tested", "feasible": "feasible", "pareto": "Pareto optimal"}
_PARTS = {"tested": (0.0, 1.0), "feasible": (0.08, 0.5), "pareto": (0.5, 0.92)}  # of a bin


def shares(counts: NDArray[np.int64]) -> Array:
    """``(k,)`` how many per cent of a group each bin holds; 0 where the group is empty.

    Example:
        >>> shares(np.array([1, 3]))
        array([25., 75.])
    """
    result: Array = 100.0 * counts / max(int(counts.sum()), 1)
    return result


def draw_histogram(
    histogram: Histogram,
    *,
    ax: Axes | None = None,
    legend: bool = True,
    numbers: bool = True,
    title: str = "",
) -> Axes:
    """Draw in each bin what share of the tested, feasible and Pareto-optimal designs it holds.

    The heights are per cent of each group, so that a few Pareto-optimal designs among thousands
    are seen: where the bars rise over the grey of the tested ones a group is denser than the
    tests. The counts themselves are in the legend and over the bins.

    Args:
        histogram: From :func:`pymoo_psi.table.histogram`.
        ax: Axes to draw on; new ones by default.
        legend: Put a legend with the number of designs of each group under the axes.
        numbers: Write the numbers of feasible and Pareto-optimal designs over the bins, if there
            are at most twelve.
        title: What the designs are; how many there are follows it.

    Returns:
        The axes.

    Example:
        >>> from pymoo_psi import TestTable
        >>> from pymoo_psi.table import histogram
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.2], [1.0]], [[1], [2], [3]])
        >>> ax = draw_histogram(histogram(table, "x1", limits={"f1": 2}))
        >>> [text.get_text() for text in ax.get_legend().get_texts()]
        ['tested (3)', 'feasible (2)', 'Pareto optimal (1)']
    """
    legend, numbers = boolean("legend", legend), boolean("numbers", numbers)
    edges = histogram.edges
    groups = {group: getattr(histogram, group) for group in _NAMES}
    with on_axes(ax) as axes:
        for group, counts in groups.items():
            start, end = _PARTS[group]
            width = np.diff(edges)
            axes.bar(
                edges[:-1] + start * width,
                shares(counts),
                (end - start) * width,
                align="edge",
                linewidth=0.5,
                label=f"{_NAMES[group]} ({counts.sum()})",
                **_LOOKS[group],
            )
        if numbers and len(edges) - 1 <= _WRITTEN:
            _write_numbers(axes, histogram)
        if len(edges) > 1:
            axes.set_xlim(edges[0], edges[-1])
        axes.set_ylim(0, 1.1 * max(1.0, *(shares(c).max(initial=0) for c in groups.values())))
        axes.set_xlabel(literal(histogram.variable))
        axes.set_ylabel("% of each group")
        axes.yaxis.set_major_locator(MaxNLocator(5))
        if histogram.values:
            name_places(axes.xaxis, histogram.values, room=60)
        else:
            axes.xaxis.set_major_locator(MaxNLocator(6))
        axes.set_title(f"{title}\n{groups['tested'].sum()} designs tested".strip())
        if legend:
            legend_below(axes)
    return axes  # type: ignore[no-any-return]


def _write_numbers(axes: Axes, histogram: Histogram) -> None:
    """Write over its bar how many designs of a group there are."""
    width = np.diff(histogram.edges)
    for group in ("feasible", "pareto"):
        counts = getattr(histogram, group)
        middle = histogram.edges[:-1] + sum(_PARTS[group]) / 2 * width
        for x, height, count in zip(middle, shares(counts), counts, strict=True):
            if count:
                axes.annotate(
                    str(count), (x, height), (0, 1.5), textcoords="offset points",
                    ha="center", va="bottom", fontsize=6,
                )  # fmt: skip
