"""Histograms: where the tested, the feasible and the Pareto-optimal designs lie."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pymoo_psi._validation import boolean, counted
from pymoo_psi.plots._designs import FEASIBLE, GROUPS, PARETO, checked_table, name_places
from pymoo_psi.plots._style import legend_below, literal, on_axes, tick_counts
from pymoo_psi.table import Histogram, Key, Limits, TestTable, histogram

_WRITTEN = 12  # bins over which there is room for the numbers

_LOOKS: dict[str, dict[str, Any]] = {
    "tested": {"facecolor": "0.9", "edgecolor": "0.55"},
    "feasible": {"facecolor": GROUPS[FEASIBLE].colour, "edgecolor": GROUPS[FEASIBLE].colour},
    "pareto": {"facecolor": GROUPS[PARETO].colour, "edgecolor": "black", "hatch": "////"},
}
_NAMES = {"tested": "tested", "feasible": "feasible", "pareto": "Pareto optimal"}
_PARTS = {"tested": (0.0, 1.0), "feasible": (0.08, 0.5), "pareto": (0.5, 0.92)}  # of a bin


def draw_histogram(
    table: TestTable,
    variable: Key,
    limits: Limits | None = None,
    *,
    bins: int = 10,
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
        table: A test table.
        variable: Name or index of the variable.
        limits: Limits on columns.
        bins: Equal bins of the box of a real variable; others have one bin for each value.
        ax: Axes to draw on; new ones by default.
        legend: Put a legend with the number of designs of each group under the axes.
        numbers: Write the numbers of feasible and Pareto-optimal designs over the bins, if there
            are at most twelve.
        title: What the designs are; how many there are follows it.

    Returns:
        The axes.

    Raises:
        ArgumentValueError: The variable or a limited criterion is not in the table, or ``bins``
            is below 1.
        ArgumentTypeError: ``table`` is no test table, the limits are no mapping to numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.2], [1.0]], [[1], [2], [3]])
        >>> ax = draw_histogram(table, "x1", {"f1": 2})
        >>> [text.get_text() for text in ax.get_legend().get_texts()]
        ['tested (3)', 'feasible (2)', 'Pareto optimal (1)']
    """
    legend, numbers = boolean("legend", legend), boolean("numbers", numbers)
    found = histogram(checked_table(table), variable, bins=bins, limits=limits)
    with on_axes(ax) as axes:
        draw_bars(axes, found, numbers=numbers)
        axes.set_xlabel(literal(table.layout.label_of(found.variable)))
        tick_counts(axes, y=5)
        if found.values:
            name_places(axes, found.values, room=60)
        else:
            tick_counts(axes, x=6)
        axes.set_title(f"{title}\n{counted(found.tested.sum(), 'design')} tested".strip())
        if legend:
            legend_below(axes, ncols=2)
    return axes


def draw_bars(axes: Axes, found: Histogram, *, numbers: bool, tested: bool = True) -> None:
    """Draw the bars of each group, and over them how many designs they are.

    Args:
        axes: The axes.
        found: What is counted.
        numbers: Write the numbers over the bins.
        tested: Draw the tested designs, too; not where some are in no bin.
    """
    edges = found.edges
    width = np.diff(edges)
    top = 1.0
    for group, (start, end) in _PARTS.items():
        if group == "tested" and not tested:
            continue
        counts = getattr(found, group)
        heights = 100.0 * counts / max(int(counts.sum()), 1)  # 0 where the group is empty
        top = max(top, heights.max(initial=0))
        bars = axes.bar(
            edges[:-1] + start * width, heights, (end - start) * width, align="edge",
            linewidth=0.5, label=f"{_NAMES[group]} ({counts.sum()})", **_LOOKS[group],
        )  # fmt: skip
        if numbers and group != "tested" and len(counts) <= _WRITTEN:
            axes.bar_label(bars, [str(n or "") for n in counts], padding=1.5, fontsize=6)
    if len(edges) > 1:
        axes.set_xlim(edges[0], edges[-1])
    axes.set_ylim(0, 1.1 * top)
    axes.set_ylabel("% of each group")
