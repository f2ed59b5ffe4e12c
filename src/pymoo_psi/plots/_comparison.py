"""Figures of a comparison of algorithms, and as files beside each other in a folder.

Each algorithm has a colour, a line style and a marker of its own, the same in all figures.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import AutoLocator, NullLocator
from numpy.typing import NDArray

from pymoo_psi._validation import Received, counted, instance, invalid, known_name
from pymoo_psi.comparison import INDICATORS, Comparison, shift
from pymoo_psi.pareto import attainment_surfaces
from pymoo_psi.plots._markers import GREY
from pymoo_psi.plots._style import (
    legend_of,
    literal,
    logarithmic,
    new_figure,
    on_axes,
    save_figures,
    view,
)

Array = NDArray[np.float64]

# The lengths have no common factor: a look comes again after the product of them only.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")

_ASSESSED = {
    "evaluated": "all feasible designs that a run evaluated",
    "returned": "the designs that a run returned",
}
_MEANINGS = {
    "hypervolume": "hypervolume (share of the box)",
    "igd_plus": "IGD+ (units of N − U)",
    "epsilon": "additive epsilon (units of N − U)",
    "optimum_distance": "optimum distance (units of N − U)",
}
_QUARTERS = (25.0, 50.0, 75.0)  # per cent of the runs
_LEGEND_LETTERS = 108  # in a line of a legend over the width of a figure
_BESIDE = 1.12  # factor between markers beside each other on an axis of evaluations, at most
_SHARE = 0.45  # of the gap between budgets is for the markers of one of them
_LABEL = 0.09  # of the width of axes: space for the number of a budget
_TASK = ["algorithm", "evaluations"]
_WHISKER = Line2D([], [], linestyle="none", marker="|", color="0.4", markersize=9.0)
_DOTS: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": GREY}


def save_comparison(
    comparison: Comparison,
    directory: str | os.PathLike[str],
    *,
    dpi: int = 200,
    suffix: str = ".png",
) -> tuple[Path, ...]:
    """Write the figures as files: all of them, or none if one cannot be made.

    They are ``indicators.png``, ``differences.png`` (of two algorithms or more), ``fronts.png``,
    ``time.png`` and, for two objectives, ``attainment.png``.

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
        ['indicators.png', 'differences.png', 'fronts.png', 'time.png', 'attainment.png']
    """
    return save_figures(_figures(_checked(comparison)), directory, dpi, suffix)


def _figures(comparison: Comparison) -> Iterator[tuple[str, Figure]]:
    yield "indicators", plot_indicators(comparison)
    if len(comparison.algorithms) > 1:
        yield "differences", plot_differences(comparison)
    yield "fronts", plot_fronts(comparison)
    yield "time", plot_time(comparison)
    if comparison.objectives == 2:
        yield "attainment", plot_attainment(comparison)


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
    """Return the indices of the runs of an algorithm with one budget."""
    frame = comparison.measures
    chosen = (frame["algorithm"] == algorithm) & (frame["evaluations"] == evaluations)
    return np.flatnonzero(chosen).tolist()


def _reference_front(comparison: Comparison) -> Array:
    """Return the ``(k, m)`` reference set in the original units and direction."""
    frame = comparison.reference.frame
    front: Array = frame.ideal + (frame.nadir - frame.ideal) * comparison.reference.points
    return front * comparison.layout.sign + 0.0  # no -0.0


def _labels(comparison: Comparison) -> list[str]:
    return [literal(comparison.layout.label_of(name), 28) for name in comparison.layout.objectives]


def looks(algorithms: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return colour, line style and marker of each algorithm."""
    ways = zip(cycle(_COLOURS), cycle(_STYLES), cycle(_MARKERS), strict=False)
    return {
        name: {"color": colour, "linestyle": style, "marker": marker}
        for name, (colour, style, marker) in zip(algorithms, ways, strict=False)
    }


def _entries(algorithms: Sequence[str]) -> dict[str, Any]:
    """Return for a legend the names of the algorithms, and a line of each."""
    return {
        literal(name, 30): Line2D([], [], linewidth=1.2, markersize=4.0, **look)
        for name, look in looks(algorithms).items()
    }


def _finish(
    figure: Figure,
    comparison: Comparison,
    what: str,
    evaluations: Sequence[int],
    legend: dict[str, Any],
) -> None:
    """Write above the axes what is drawn, of which problem and runs; put the legend below."""
    seeds = comparison.measures["seed"]
    groups = seeds.groupby(comparison.measures["algorithm"], sort=False)
    once = [literal(name, 30) for name, own in groups if own.isna().all()]
    n_seeds = seeds.dropna().nunique()
    count = counted(n_seeds, "seed") if n_seeds else "one run each"
    if once and n_seeds:
        count += f" (one run of {', '.join(once)})"
    *before, last = evaluations
    budgets = f"{', '.join(map(str, before))} and " if before else ""
    figure.suptitle(
        f"{literal(comparison.problem)}: {what}\n{budgets}{counted(last, 'evaluation')}, {count}\n"
        f"assessed: {_ASSESSED[comparison.assess]}"
    )
    letters = [len(name) + 9 for name in legend]  # 9 are as wide as a line and a gap
    ncols = len(letters)
    while sum(map(max, np.array_split(letters, ncols))) > _LEGEND_LETTERS and ncols > 1:
        ncols -= 1
    style = {"handlelength": 3.6, "fontsize": 7}
    legend_of(figure, legend, loc="outside lower center", ncols=ncols, **style)


# Indicators of quality against the number of evaluations


def plot_indicators(comparison: Comparison) -> Figure:
    """Return the four indicators against evaluations: medians as lines, quartiles as whiskers.

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
            plot_indicator(comparison, indicator, ax=ax, legend=False)
        legend = {**_entries(comparison.algorithms), "whiskers: quartiles": _WHISKER}
        what = "quality against evaluations, medians"
        _finish(figure, comparison, what, comparison.evaluations, legend)
    return figure


def plot_indicator(
    comparison: Comparison, indicator: str, *, ax: Axes | None = None, legend: bool = True
) -> Axes:
    """Draw the medians of an indicator as lines and the quartiles as whiskers.

    Infinite values are left out, and a line above the axes says so.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.
        ax: Axes to draw on; new ones by default.
        legend: Name the algorithms in the axes.

    Returns:
        The axes.

    Raises:
        ArgumentValueError: The indicator is unknown.

    Example:
        Of the comparison in the example of :func:`save_comparison`:

        >>> ax = plot_indicator(comparison, "epsilon")
        >>> ax.get_yscale(), [tick.get_text() for tick in ax.get_xticklabels()]
        ('log', ['32', '64'])
    """
    names, budgets = _checked(comparison).algorithms, comparison.evaluations
    known_name("indicator", indicator, INDICATORS)
    frame = comparison.summary().set_index(_TASK)
    median, lower, upper = (
        np.array([[frame.loc[(name, n), column] for n in budgets] for name in names], float)
        for column in (indicator, f"{indicator}_q1", f"{indicator}_q3")
    )
    curves = _Curves(indicator, names, budgets, median, lower, upper)
    with on_axes(ax) as axes:
        _draw_curves(axes, curves, names)
        axes.set_ylabel(_MEANINGS[indicator])
        if legend:
            legend_of(axes, _entries(names), handlelength=3.6, fontsize=7)
    return axes


def plot_differences(comparison: Comparison, to: str = "") -> Figure:
    """Return how the other algorithms differ from one, with intervals, against evaluations.

    The marks are the medians of all differences between runs of both, or of all ratios for
    distances above 0; the whiskers are the 95 % intervals that belong to
    :meth:`.Comparison.tests`, before these are corrected for their number. An interval that does
    not reach the line of no difference separates the two algorithms.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        to: Name of the algorithm that the others are compared with; the first one by default.

    Raises:
        ArgumentValueError: There is no such algorithm, or no other.

    Example:
        Of the comparison in the example of :func:`save_comparison`:

        >>> [ax.get_ylabel() for ax in plot_differences(comparison).axes][1:]
        ['IGD+, ratio', 'additive epsilon, ratio', 'optimum distance, ratio']
    """
    names = _checked(comparison).algorithms
    to = known_name("to", to, names) if to else names[0]
    if len(names) < 2:
        raise invalid("comparison", "of two algorithms or more", Received("one"))
    with new_figure(150.0) as figure:
        for ax, indicator in zip(figure.subplots(2, 2).ravel(), INDICATORS, strict=True):
            curves = difference_curves(comparison, indicator, to)
            _draw_curves(ax, curves, names)
            meaning = _MEANINGS[indicator]
            ratios = f"{meaning.split(' (')[0]}, ratio"
            ax.set_ylabel(ratios if curves.shown == "ratio" else f"{meaning},\ndifference")
        legend = _entries(names)
        del legend[literal(to, 30)]
        legend[f"no difference from {literal(to, 30)}"] = Line2D([], [], color="0.25")
        legend["whiskers: 95 % intervals, where there are runs enough"] = _WHISKER
        what = f"the others against {literal(to, 30)}"
        _finish(figure, comparison, what, comparison.evaluations, legend)
    return figure


def difference_curves(comparison: Comparison, indicator: str, to: str) -> _Curves:
    """Return the differences of the other algorithms from one, or ratios of distances above 0."""
    frame = comparison.measures
    known = frame[indicator].to_numpy(float)
    ratio = indicator != "hypervolume" and bool((np.isfinite(known) & (known > 0)).all())
    runs = {key: part[indicator].to_numpy(float) for key, part in frame.groupby(_TASK, sort=False)}
    fixed = {name for name, seeds in frame.groupby("algorithm")["seed"] if seeds.isna().all()}
    others = tuple(name for name in comparison.algorithms if name != to)
    budgets = comparison.evaluations
    found = np.zeros((3, len(others), len(budgets)))
    for i, name in enumerate(others):
        for j, budget in enumerate(budgets):
            a, b = runs[to, budget], runs[name, budget]
            one = (to in fixed) != (name in fixed)
            found[:, i, j] = (
                np.exp(shift(np.log(a), np.log(b), fixed=one)) if ratio else shift(a, b, fixed=one)
            )
    median, lower, upper = found
    shown = "ratio" if ratio else "difference"
    return _Curves(indicator, others, budgets, median, lower, upper, shown)


@dataclass(frozen=True, eq=False)
class _Curves:
    """An indicator of a algorithms at b budgets, over the runs of each.

    Attributes:
        indicator: Such as ``"hypervolume"``.
        algorithms: Names of the algorithms.
        evaluations: The budgets, increasing.
        median: ``(a, b)`` medians, infinite where the median run found nothing.
        lower: ``(a, b)`` first quartiles, or lower ends of intervals, NaN where there are too few
            runs.
        upper: ``(a, b)`` third quartiles or upper ends, as for ``lower``.
        shown: "median" of the indicator, or "difference" or "ratio" of two algorithms.
    """

    indicator: str
    algorithms: tuple[str, ...]
    evaluations: tuple[int, ...]
    median: Array
    lower: Array
    upper: Array
    shown: str = "median"

    @property
    def logarithmic(self) -> bool:
        """Whether the axis is logarithmic: of distances that are all above 0, and of ratios."""
        values = np.concatenate([self.lower, self.median, self.upper])
        known = values[np.isfinite(values)]
        positive = len(known) > 0 and bool((known > 0).all())
        return positive and self.indicator != "hypervolume" and self.shown != "difference"

    @property
    def left_out(self) -> str:
        """What is not drawn, as it is infinite; empty if nothing is."""
        medians = int((~np.isfinite(self.median)).sum())
        ends = int(np.isinf(self.lower).sum() + np.isinf(self.upper).sum())
        end = "quartile" if self.shown == "median" else "interval end"
        counts = [counted(n, what) for n, what in ((medians, self.shown), (ends, end)) if n]
        return f"infinite, not drawn: {', '.join(counts)}" if counts else ""


def _draw_curves(axes: Axes, curves: _Curves, algorithms: Sequence[str]) -> None:
    """Draw curves beside each other at each budget; looks are those among all algorithms."""
    median, lower, upper = (
        np.where(np.isfinite(values), values, np.nan)
        for values in (curves.median, curves.lower, curves.upper)
    )
    n, budgets = len(curves.algorithms), np.array(curves.evaluations, float)
    gap = float(np.diff(np.log(budgets)).min(initial=np.log(_BESIDE) * n / _SHARE))
    beside = min(np.exp(_SHARE * gap / n), _BESIDE)
    _budget_ticks(axes, curves.evaluations, beside ** (n / 2 + 0.5))
    if np.isnan(median).all():
        axes.set_yticks([])  # matplotlib's would be of a range from 0 to 1 that nothing has
    if curves.logarithmic:
        logarithmic(axes, "y", (1.0, 2.0, 5.0))
    known = looks(algorithms)
    for k, name in enumerate(curves.algorithms):
        look, x = known[name], budgets * beside ** (k - (n - 1) / 2)
        axes.vlines(x, lower[k], upper[k], color=look["color"], linewidth=1.1)
        axes.plot(x, median[k], markersize=4.0, linewidth=0.9, **look)
    if curves.shown != "median":
        none = 1.0 if curves.shown == "ratio" else 0.0
        axes.axhline(none, color="0.25", linewidth=1.0, zorder=1.0)
    if curves.logarithmic:
        low, high = axes.get_ylim()
        if sum(low <= tick <= high for tick in axes.get_yticks()) < 2:  # as between 0.6 and 1.4
            axes.yaxis.set_major_locator(AutoLocator())
    axes.set_title(curves.left_out, loc="right", fontsize=7)


def _budget_ticks(axes: Axes, evaluations: Sequence[int], pad: float) -> None:
    """Make a logarithmic axis of the evaluations, with ticks at the budgets."""
    low, high = evaluations[0], evaluations[-1]
    axes.set_xscale("log")
    pad = max(pad, (high / low) ** 0.06)
    axes.set_xlim(low / pad, high * pad)
    width = _LABEL * np.log(high / low)
    labels, last = [], -np.inf
    for budget in evaluations:
        free = np.log(budget) - last >= width
        last = np.log(budget) if free else last
        labels.append(str(budget) if free else "")
    axes.set_xticks(evaluations, labels)
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("evaluations")


def plot_time(comparison: Comparison) -> Figure:
    """Return time against quality: each run small, the medians joined from budget to budget.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        Of the comparison in the example of :func:`save_comparison`:

        >>> plot_time(comparison).axes[0].get_ylabel()
        'hypervolume (share of the box)'
    """
    by_algorithm = _checked(comparison).measures.set_index("algorithm")
    with new_figure(120.0) as figure:
        axes = figure.subplots()
        logarithmic(axes, "x", (1.0, 3.0))
        for name, look in looks(comparison.algorithms).items():
            runs = by_algorithm.loc[[name], ["evaluations", "seconds", "hypervolume"]]
            dots = {**look, "linestyle": "none", "markeredgewidth": 0.0, "alpha": 0.5}
            axes.plot(runs["seconds"], runs["hypervolume"], markersize=2.4, **dots)
            medians = runs.groupby("evaluations").median()
            line: dict[str, Any] = {"markersize": 5.5, "linewidth": 1.2}
            axes.plot(medians["seconds"], medians["hypervolume"], **line, **look)
        axes.set_xlabel("wall time of a run (s)")
        axes.set_ylabel(_MEANINGS["hypervolume"])
        dot = Line2D([], [], **{**_DOTS, "color": "0.5"}, markersize=2.4)
        legend = {**_entries(comparison.algorithms), "small: single runs": dot}
        what = "time and quality, medians joined from budget to budget"
        _finish(figure, comparison, what, comparison.evaluations, legend)
    return figure


# Fronts of the median run of each algorithm


def plot_fronts(comparison: Comparison, evaluations: int | None = None) -> Figure:
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
        nsga3, seed ...
        ... designs, hypervolume 0...
    """
    budget = _budget_of(_checked(comparison), evaluations)
    reference, labels = _reference_front(comparison), _labels(comparison)
    chosen, sign = median_runs(comparison, budget), comparison.layout.sign
    fronts = [comparison.runs[row].found(comparison.assess) * sign for row in chosen]
    n_planes = min(comparison.objectives - 1, 3)
    limits = [
        view(np.concatenate([F[:, j] for F in (*fronts, reference)])) for j in range(1 + n_planes)
    ]
    # Of two objectives up to three algorithms stand beside each other, four in two rows.
    wide = n_planes if n_planes > 1 else {1: 1, 2: 2, 4: 2}.get(len(fronts), 3)
    high = -(-len(fronts) * n_planes // wide)
    with new_figure(30.0 + high * (62.0 if wide < 3 else 50.0)) as figure:
        grid = figure.subplots(high, wide, squeeze=False).ravel()
        for k, (name, look) in enumerate(looks(comparison.algorithms).items()):
            marks = {**look, "linestyle": "none", "markersize": 3.0, "markeredgewidth": 0.0}
            for j, ax in enumerate(grid[k * n_planes : (k + 1) * n_planes], start=1):
                ax.plot(*reference[:, [0, j]].T, **_DOTS, markersize=2.0, markeredgewidth=0.0)
                ax.plot(*fronts[k][:, [0, j]].T, **marks)
                if len(fronts[k]) == 0:
                    ax.text(0.5, 0.5, "nothing found", transform=ax.transAxes, ha="center")
                ax.set(xlim=limits[0], ylim=limits[j], xlabel=labels[0], ylabel=labels[j])
            run = comparison.runs[chosen[k]]
            seed = "" if run.task.seed is None else f", seed {run.task.seed}"
            quality = comparison.measures["hypervolume"].iloc[chosen[k]]
            title = (
                f"{literal(name, 22)}{seed}\n{counted(len(fronts[k]), 'design')}, "
                f"hypervolume {quality:.4f}"
            )
            grid[k * n_planes].set_title(title, loc="left", fontsize=7.5)
        for ax in grid[len(fronts) * n_planes :]:
            ax.remove()
        legend = {"reference set": Line2D([], [], **_DOTS, markersize=4.0)}
        _finish(figure, comparison, "runs of median hypervolume", [budget], legend)
    return figure


def median_runs(comparison: Comparison, evaluations: int) -> list[int]:
    """Return of each algorithm the index of its run of median hypervolume with one budget.

    Of an even number of runs it is the lower of the two in the middle; of equal ones the first.
    """
    quality = comparison.measures["hypervolume"].to_numpy(float)
    chosen = []
    for name in comparison.algorithms:
        rows = sorted(_rows_of(comparison, name, evaluations), key=lambda row: quality[row])
        chosen.append(rows[(len(rows) - 1) // 2])
    return chosen


# Attainment of a quarter, a half and three quarters of the runs


def plot_attainment(comparison: Comparison, evaluations: int | None = None) -> Figure:
    """Return what half of the runs attain, together, and how far it is from the reference set.

    A run attains a point if one of its own is no worse in either objective. The lines are the
    empirical attainment surfaces of half of the runs, the bands those between the surfaces of a
    quarter and three quarters. Each algorithm also has axes of its own with the distance: by how
    much both objectives of the reference set must get worse, at each place along the front, until
    the algorithm attains them.

    Args:
        comparison: From :func:`pymoo_psi.compare`, with two objectives.
        evaluations: The budget; the largest by default.

    Raises:
        ArgumentValueError: There is no such budget, or the problem has another number of
            objectives.

    Example:
        Of the comparison in the example of :func:`save_comparison`:

        >>> [ax.get_title(loc="left") for ax in plot_attainment(comparison).axes]
        ['', 'psi', 'nsga3']
    """
    if _checked(comparison).objectives != 2:
        received = Received(f"{comparison.objectives} objectives")
        remedy = "plot_fronts shows any number"
        raise invalid("comparison", "of a problem with two objectives", received, remedy)
    budget = _budget_of(comparison, evaluations)
    surfaces = {
        name: attainment_surfaces(
            [comparison.runs[row].found(comparison.assess)
             for row in _rows_of(comparison, name, budget)],
            list(_QUARTERS),
        )
        for name in comparison.algorithms
    }  # fmt: skip
    names = comparison.algorithms
    # The axes of all are two rows and columns wide; the others are right of them, then below.
    places = [(0, 2), (0, 3), (1, 2), (1, 3)]
    places += [(2 + k // 4, k % 4) for k in range(len(names) - 4)]
    high = 1 + max([1, *(row for row, _ in places[: len(names)])])
    with new_figure(30.0 + 50.0 * high) as figure:
        grid = figure.add_gridspec(high, 4)
        _draw_surfaces(figure.add_subplot(grid[:2, :2]), comparison, surfaces)
        alone = [figure.add_subplot(grid[place]) for place in places[: len(names)]]
        top = 0.0
        for ax, name in zip(alone, names, strict=True):
            top = max(top, _draw_distance(ax, comparison, name, surfaces[name]))
            ax.set_title(literal(name, 18), loc="left", fontsize=7.5)
        for ax in alone:
            ax.set_ylim(0, 1.05 * top or 1.0)
        legend = {
            **_entries(names),
            "bands: 25 to 75 % of the runs": Patch(facecolor="0.5", alpha=0.3, linewidth=0),
            "reference set": Line2D([], [], **_DOTS, markersize=4.0),
        }
        what = "what half of the runs attain, and how far it is from the reference set"
        _finish(figure, comparison, what, [budget], legend)
    return figure


def steps(surface: Array, right: float, top: float) -> Array:
    """Return the ``(k, 2)`` corners of the edge of what is attained, from top to right.

    Args:
        surface: Corners by increasing f1; none where nothing is attained.
        right: f1 up to which the edge is drawn.
        top: f2 at which it begins.
    """
    if len(surface) == 0:
        return np.array([[right, top]])
    f1, f2 = surface.T
    edge = np.array([np.append(np.repeat(f1, 2), right), np.append(top, np.repeat(f2, 2))])
    return edge.T


def _draw_surfaces(
    axes: Axes, comparison: Comparison, surfaces: dict[str, dict[float, Array]]
) -> None:
    """Draw the median surface of each algorithm."""
    sign, reference = comparison.layout.sign, _reference_front(comparison)
    every = [surface[50.0] * sign for surface in surfaces.values()]
    ends = [view(column) for column in np.concatenate([*every, reference]).T]
    # In the original direction the worst value is at the left or below where more is better.
    right, top = (max(end * s for end in both) for both, s in zip(ends, sign, strict=True))
    axes.plot(*reference.T, **_DOTS, markersize=1.6, markeredgewidth=0.0)
    for name, look in looks(comparison.algorithms).items():
        edge = steps(surfaces[name][50.0], right, top) * sign
        axes.plot(*edge.T, color=look["color"], linestyle=look["linestyle"], linewidth=1.3)
    first, second = _labels(comparison)
    axes.set(xlim=ends[0], ylim=ends[1], xlabel=first, ylabel=second)


def _draw_distance(
    axes: Axes, comparison: Comparison, name: str, surfaces: dict[float, Array]
) -> float:
    """Draw how far surfaces are from the reference set along the front; return the farthest."""
    look = looks(comparison.algorithms)[name]
    place = np.linspace(-1, 1, 201)
    better, median, worse = (shortfall(comparison, surfaces[share], place) for share in _QUARTERS)
    axes.fill_between(place, better, worse, color=look["color"], alpha=0.25, linewidth=0)
    axes.plot(place, median, color=look["color"], linestyle=look["linestyle"], linewidth=1.2)
    axes.set_xlim(-1, 1)
    axes.set_xticks([-1, 1], [f"best\n{literal(n, 9)}" for n in comparison.layout.objectives])
    axes.set_ylabel("distance (units of N − U)", fontsize=7)
    if np.isnan(median).all():
        axes.text(
            0.5, 0.5, "fewer than half of\nthe runs found any", transform=axes.transAxes,
            ha="center", va="center", fontsize=7,
        )  # fmt: skip
    return float(np.nan_to_num([median, worse]).max())


def shortfall(comparison: Comparison, surface: Array, place: Array) -> Array:
    """Return by how much a surface is worse than the reference set, along the front.

    Args:
        comparison: Whose reference set and scale.
        surface: ``(k, 2)`` corners in the units of the objectives, minimised.
        place: ``(n,)`` differences of the first and the second objective in the scale, from -1,
            at the best first objective, to 1.

    Returns:
        ``(n,)`` in the scale, in both objectives at once, which is the additive epsilon of that
        place; NaN where nothing is attained.
    """
    reached = []
    for corners in (comparison.reference.frame.scaled(surface), comparison.reference.points):
        # On the diagonal (t/2 + s, −t/2 + s) a corner c is attained from s = max(...) on.
        first, second = corners[:, :1] - place / 2, corners[:, 1:] + place / 2
        reached.append(np.maximum(first, second).min(axis=0, initial=np.inf))
    surplus: Array = reached[0] - reached[1] if len(surface) else np.full(len(place), np.nan)
    return surplus
