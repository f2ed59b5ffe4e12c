"""The pages of a comparison of algorithms, and as files beside each other in a folder.

Each algorithm has a colour, a line style and a marker of its own, the same on all pages.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from pymoo_psi._markers import GREY
from pymoo_psi._validation import Received, boolean, counted, instance, invalid, known_name
from pymoo_psi.comparison import INDICATORS, Comparison
from pymoo_psi.pareto._indicators import attainment_surfaces
from pymoo_psi.plots._style import (
    literal,
    named_legend,
    new_page,
    on_axes,
    save_pages,
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
_LETTERS = 108  # in a line of a legend over the width of a page, in its size of 7 points
_HANDLE = 3.6  # length of a line in a legend, so that its style shows
_BESIDE = 1.12  # factor between markers beside each other on an axis of evaluations
_LABEL = 0.09  # of the width of axes: room for the number of a budget

_DOTS: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": GREY}


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
        >>> from pymoo_psi.comparison import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_comparison(comparison, folder, dpi=20)]
        ['indicators.png', 'fronts.png', 'time.png', 'attainment.png']
    """
    return save_pages(_pages(_checked(comparison)), directory, dpi)


def _pages(comparison: Comparison) -> Iterator[tuple[str, Figure]]:
    yield "indicators.png", indicators_page(comparison)
    yield "fronts.png", fronts_page(comparison)
    yield "time.png", time_page(comparison)
    if comparison.objectives == 2:
        yield "attainment.png", attainment_page(comparison)


# What all pages share


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
    return [
        i
        for i, run in enumerate(comparison.runs)
        if (run.task.algorithm, run.task.n_evaluations) == (algorithm, evaluations)
    ]


def reference_front(comparison: Comparison) -> Array:
    """Return the ``(k, m)`` reference set in the units of the objectives."""
    frame = comparison.reference.frame
    front: Array = frame.ideal + (frame.nadir - frame.ideal) * comparison.reference.points
    return front


def looks(algorithms: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return colour, line style and marker of each algorithm."""
    ways = zip(cycle(_COLOURS), cycle(_STYLES), cycle(_MARKERS), strict=False)
    return {
        name: {"color": colour, "linestyle": style, "marker": marker}
        for name, (colour, style, marker) in zip(algorithms, ways, strict=False)
    }


def _entries(algorithms: Sequence[str], *, markers: bool = True) -> list[tuple[str, Artist]]:
    """Return for a legend the names of the algorithms, and a line of each."""
    return [
        (
            literal(name, 30),
            Line2D(
                [], [], color=look["color"], linestyle=look["linestyle"], linewidth=1.2,
                marker=look["marker"] if markers else "", markersize=4.0,
            ),
        )
        for name, look in looks(algorithms).items()
    ]  # fmt: skip


def _finish(
    figure: Figure,
    comparison: Comparison,
    what: str,
    evaluations: Sequence[int],
    legend: Sequence[tuple[str, Artist]],
) -> None:
    """Write over the axes what is drawn, of which problem and runs; put the legend under them."""
    seeds = comparison.measures["seed"]
    once = [
        literal(name, 30)
        for name, own in seeds.groupby(comparison.measures["algorithm"], sort=False)
        if own.isna().all()
    ]
    *before, last = evaluations
    budgets = f"{', '.join(map(str, before))} and " if before else ""
    n_seeds = seeds.dropna().nunique()
    count = counted(n_seeds, "seed") if n_seeds else "one run each"
    if once and n_seeds:
        count += f" (one run of {', '.join(once)})"
    figure.suptitle(
        f"{literal(comparison.problem)}: {what}\n{budgets}{counted(last, 'evaluation')}, {count}\n"
        f"assessed: {_ASSESSED[comparison.assess]}"
    )
    letters = [len(name) + 9 for name, _ in legend]  # 9 are as wide as a line and a gap
    ncols = len(letters)
    while ncols > 1 and _letters_across(letters, ncols) > _LETTERS:
        ncols -= 1
    named_legend(figure, legend, loc="outside lower center", ncols=ncols, handlelength=_HANDLE)


def _letters_across(letters: Sequence[int], ncols: int) -> int:
    return sum(int(column.max()) for column in np.array_split(letters, ncols))


def _logarithmic(axes: Axes, letter: str, ticks: Sequence[float]) -> None:
    """Make an axis logarithmic, with ticks at so many times a power of ten, as plain numbers."""
    getattr(axes, f"set_{letter}scale")("log")
    axis = axes.xaxis if letter == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=ticks))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


# Indicators of quality against the number of evaluations


def indicators_page(comparison: Comparison) -> Figure:
    """Return the four indicators against evaluations.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi.comparison import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> len(indicators_page(comparison).axes)
        4
    """
    comparison = _checked(comparison)
    with new_page(150.0) as figure:
        for ax, indicator in zip(figure.subplots(2, 2).ravel(), INDICATORS, strict=True):
            _draw_curves(ax, indicator_curves(comparison, indicator))
        band = Patch(facecolor="0.5", alpha=0.3, linewidth=0)
        legend = [*_entries(comparison.algorithms), ("bands: between the quartiles", band)]
        what = "quality against evaluations, medians"
        _finish(figure, comparison, what, comparison.evaluations, legend)
    return figure


def draw_indicator(
    comparison: Comparison, indicator: str, *, ax: Axes | None = None, legend: bool = True
) -> Axes:
    """Draw the medians of an indicator as lines and the quartiles as bands.

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
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi.comparison import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> ax = draw_indicator(comparison, "epsilon")
        >>> ax.get_yscale(), [tick.get_text() for tick in ax.get_xticklabels()]
        ('log', ['32', '64'])
    """
    comparison, legend = _checked(comparison), boolean("legend", legend)
    known_name("indicator", indicator, INDICATORS)
    curves = indicator_curves(comparison, indicator)
    with on_axes(ax) as axes:
        _draw_curves(axes, curves)
        if legend:
            entries = _entries(curves.algorithms)
            named_legend(axes, entries, loc="best", handlelength=_HANDLE)
    return axes


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
    """

    indicator: str
    algorithms: tuple[str, ...]
    evaluations: tuple[int, ...]
    median: Array
    lower: Array
    upper: Array

    @property
    def logarithmic(self) -> bool:
        """Whether the axis is logarithmic: of distances that are all above 0."""
        values = np.concatenate([self.lower, self.median, self.upper])
        known = values[np.isfinite(values)]
        return self.indicator != "hypervolume" and len(known) > 0 and bool((known > 0).all())

    @property
    def left_out(self) -> str:
        """What is not drawn, as it is infinite; empty if nothing is."""
        medians = int((~np.isfinite(self.median)).sum())
        quartiles = int((~np.isfinite(self.lower)).sum() + (~np.isfinite(self.upper)).sum())
        counts = [
            counted(n, what) for n, what in ((medians, "median"), (quartiles, "quartile")) if n
        ]
        return f"infinite, not drawn: {', '.join(counts)}" if counts else ""


def indicator_curves(comparison: Comparison, indicator: str) -> IndicatorCurves:
    """Take the medians and quartiles of an indicator from :meth:`.Comparison.summary`."""
    names, budgets = comparison.algorithms, comparison.evaluations
    frame = comparison.summary().set_index(["algorithm", "evaluations"])
    median, lower, upper = (
        np.array([[frame.loc[(name, n), column] for n in budgets] for name in names], float)
        for column in (indicator, f"{indicator}_q1", f"{indicator}_q3")
    )
    return IndicatorCurves(indicator, names, budgets, median, lower, upper)


def _draw_curves(axes: Axes, curves: IndicatorCurves) -> None:
    median, lower, upper = (
        np.where(np.isfinite(values), values, np.nan)
        for values in (curves.median, curves.lower, curves.upper)
    )
    n, budgets = len(curves.algorithms), np.array(curves.evaluations, float)
    _budget_ticks(axes, curves.evaluations)
    # With one budget there are no lines, and markers on one place would hide each other.
    beside = _BESIDE if len(budgets) == 1 else 1.0
    if len(budgets) == 1:
        axes.set_xlim(budgets[0] / beside ** (n + 1), budgets[0] * beside ** (n + 1))
    if np.isnan(median).all():
        axes.set_yticks([])  # matplotlib's would be of a range from 0 to 1 that nothing has
    if curves.logarithmic:
        _logarithmic(axes, "y", (1.0, 2.0, 5.0))
    for k, look in enumerate(looks(curves.algorithms).values()):
        x = budgets * beside ** (k - (n - 1) / 2)
        axes.fill_between(x, lower[k], upper[k], alpha=0.15, color=look["color"], linewidth=0)
        axes.vlines(x, lower[k], upper[k], color=look["color"], linewidth=0.8, alpha=0.6)
        axes.plot(x, median[k], markersize=4.0, linewidth=1.2, **look)
    axes.set_ylabel(_MEANINGS[curves.indicator])
    axes.set_title(curves.left_out, loc="right", fontsize=7)


def _budget_ticks(axes: Axes, evaluations: Sequence[int]) -> None:
    """Make a logarithmic axis of the evaluations, with ticks at the budgets."""
    low, high = evaluations[0], evaluations[-1]
    axes.set_xscale("log")
    pad = (high / low) ** 0.06 if high > low else 1.5
    axes.set_xlim(low / pad, high * pad)
    room = _LABEL * np.log(high / low)
    labels, last = [], -np.inf
    for budget in evaluations:
        free = np.log(budget) - last >= room
        last = np.log(budget) if free else last
        labels.append(str(budget) if free else "")
    axes.set_xticks(evaluations, labels)
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("evaluations")


# What a run costs in time and what it brings


def time_page(comparison: Comparison) -> Figure:
    """Return time against quality: each run small, the medians joined from budget to budget.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi.comparison import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> time_page(comparison).axes[0].get_ylabel()
        'hypervolume (share of the box)'
    """
    comparison = _checked(comparison)
    by_algorithm = comparison.measures.set_index("algorithm")
    with new_page(120.0) as figure:
        axes = figure.subplots()
        _logarithmic(axes, "x", (1.0, 3.0))
        for name, look in looks(comparison.algorithms).items():
            runs = by_algorithm.loc[[name], ["evaluations", "seconds", "hypervolume"]]
            axes.plot(
                runs["seconds"], runs["hypervolume"], linestyle="none", marker=look["marker"],
                color=look["color"], markersize=2.4, markeredgewidth=0.0, alpha=0.5,
            )  # fmt: skip
            medians = runs.groupby("evaluations").median()
            axes.plot(
                medians["seconds"], medians["hypervolume"], markersize=5.5, linewidth=1.2, **look
            )
        axes.set_xlabel("wall time of a run (s)")
        axes.set_ylabel(_MEANINGS["hypervolume"])
        dots = Line2D([], [], **{**_DOTS, "color": "0.5"}, markersize=2.4)
        legend = [*_entries(comparison.algorithms), ("small: single runs", dots)]
        what = "time and quality, medians joined from budget to budget"
        _finish(figure, comparison, what, comparison.evaluations, legend)
    return figure


# What the median run of each algorithm found


def fronts_page(comparison: Comparison, evaluations: int | None = None) -> Figure:
    """Return the fronts of the runs of median hypervolume on common axes.

    Of two objectives each algorithm has one plane; of more a row of up to three, f1 against
    f2, f3 and f4. Of an even number of runs it is the lower of the two in the middle.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        evaluations: The budget; the largest by default.

    Raises:
        ArgumentValueError: There is no such budget.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi.comparison import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> len(fronts_page(comparison).axes)
        2
    """
    comparison = _checked(comparison)
    budget = _budget_of(comparison, evaluations)
    reference = reference_front(comparison)
    chosen = median_runs(comparison, budget)
    fronts = [comparison.runs[row].found(comparison.assess) for row in chosen]
    n_planes = min(comparison.objectives - 1, 3)
    shown = range(1 + n_planes)
    limits = [view(np.concatenate([F[:, j] for F in (*fronts, reference)])) for j in shown]
    # Of two objectives up to three algorithms stand beside each other, four in two rows.
    wide = n_planes if n_planes > 1 else {1: 1, 2: 2, 4: 2}.get(len(fronts), 3)
    high = -(-len(fronts) * n_planes // wide)
    with new_page(30.0 + high * (62.0 if wide < 3 else 50.0)) as figure:
        grid = figure.subplots(high, wide, squeeze=False).ravel()
        for k, (name, look) in enumerate(looks(comparison.algorithms).items()):
            for j, ax in enumerate(grid[k * n_planes : (k + 1) * n_planes], start=1):
                ax.plot(*reference[:, [0, j]].T, **_DOTS, markersize=2.0, markeredgewidth=0.0)
                ax.plot(
                    *fronts[k][:, [0, j]].T, linestyle="none", marker=look["marker"],
                    color=look["color"], markersize=3.0, markeredgewidth=0.0,
                )  # fmt: skip
                if len(fronts[k]) == 0:
                    ax.text(0.5, 0.5, "nothing found", transform=ax.transAxes, ha="center")
                ax.set_xlim(limits[0])
                ax.set_ylim(limits[j])
                ax.set_xlabel("$f_1$")
                ax.set_ylabel(f"$f_{j + 1}$")
            run = comparison.runs[chosen[k]]
            seed = "" if run.task.seed is None else f", seed {run.task.seed}"
            quality = comparison.measures["hypervolume"].iloc[chosen[k]]
            grid[k * n_planes].set_title(
                f"{literal(name, 22)}{seed}\n{counted(len(fronts[k]), 'design')}, "
                f"hypervolume {quality:.4f}",
                loc="left",
                fontsize=7.5,
            )
        for ax in grid[len(fronts) * n_planes :]:
            ax.remove()
        dots = Line2D([], [], **_DOTS, markersize=4.0)
        legend = [("reference set, of all runs together", dots)]
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


# What a quarter, a half and three quarters of the runs attain


def attainment_page(comparison: Comparison, evaluations: int | None = None) -> Figure:
    """Return what half of the runs attain, together, and each with a band in axes of its own.

    A run attains a point if one of its own is no worse in either objective. The lines are the
    empirical attainment surfaces of half of the runs, the bands those between the surfaces of a
    quarter and three quarters.

    Args:
        comparison: From :func:`pymoo_psi.compare`, with two objectives.
        evaluations: The budget; the largest by default.

    Raises:
        ArgumentValueError: There is no such budget, or the problem has another number of
            objectives.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi.comparison import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> [ax.get_title(loc="left") for ax in attainment_page(comparison).axes]
        ['', 'psi', 'nsga3']
    """
    comparison = _checked(comparison)
    if comparison.objectives != 2:
        received = Received(f"{comparison.objectives} objectives")
        remedy = "fronts_page shows any number"
        raise invalid("comparison", "of a problem with two objectives", received, remedy)
    budget = _budget_of(comparison, evaluations)
    surfaces = attained_surfaces(comparison, budget)
    names = comparison.algorithms
    alone = names if len(names) > 1 else ()
    # The axes of all are two rows and columns wide; the others are right of them, then below.
    places = [(0, 2), (0, 3), (1, 2), (1, 3)]
    places += [(2 + k // 4, k % 4) for k in range(len(alone) - 4)]
    high = 1 + max([1, *(row for row, _ in places[: len(alone)])])
    with new_page(30.0 + 50.0 * high) as figure:
        grid = figure.add_gridspec(high, 4)
        together = figure.add_subplot(grid[:2, :2] if alone else grid[:, :])
        draw_surfaces(together, comparison, surfaces, names, bands=not alone)
        for name, place in zip(alone, places, strict=False):
            ax = figure.add_subplot(grid[place])
            draw_surfaces(ax, comparison, surfaces, [name], bands=True)
            ax.set_title(literal(name, 18), loc="left", fontsize=7.5)
        legend = [
            *_entries(names, markers=False),
            ("bands: 25 to 75 % of the runs", Patch(facecolor="0.5", alpha=0.3, linewidth=0)),
            ("reference set", Line2D([], [], **_DOTS, markersize=4.0)),
        ]
        _finish(figure, comparison, "what half of the runs attain", [budget], legend)
    return figure


Surfaces = dict[str, dict[float, Array]]


def attained_surfaces(comparison: Comparison, evaluations: int) -> Surfaces:
    """Return of each algorithm what a quarter, a half and three quarters of its runs attain.

    Each surface is given by its ``(k, 2)`` corners by rising f1, in the units of the objectives;
    it has none where so many runs found nothing.
    """
    return {
        name: attainment_surfaces(
            [
                comparison.runs[row].found(comparison.assess)
                for row in _rows_of(comparison, name, evaluations)
            ],
            list(_QUARTERS),
        )
        for name in comparison.algorithms
    }


def steps(surface: Array, right: float, top: float) -> Array:
    """Return the ``(k, 2)`` corners of the edge of what is attained, from top to right.

    Args:
        surface: Corners by rising f1; none for what nobody attains.
        right: f1 up to which the edge is drawn.
        top: f2 at which it begins.
    """
    if len(surface) == 0:
        return np.array([[right, top]])
    f1, f2 = surface.T
    edge = np.array([np.append(np.repeat(f1, 2), right), np.append(top, np.repeat(f2, 2))])
    return edge.T


def draw_surfaces(
    axes: Axes, comparison: Comparison, surfaces: Surfaces, names: Sequence[str], *, bands: bool
) -> None:
    """Draw the median surfaces of some algorithms, on axes as wide as those of all take."""
    reference = reference_front(comparison)
    every = [surface for own in surfaces.values() for surface in own.values()]
    horizontal, vertical = map(view, np.concatenate([*every, reference]).T)
    right, top = horizontal[1], vertical[1]
    axes.plot(*reference.T, **_DOTS, markersize=1.6, markeredgewidth=0.0)
    for name in names:
        look = looks(comparison.algorithms)[name]
        better, median, worse = (steps(surfaces[name][share], right, top) for share in _QUARTERS)
        if bands:
            band = np.concatenate([better, worse[::-1]])
            axes.fill(*band.T, color=look["color"], alpha=0.2, linewidth=0)
        axes.plot(*median.T, color=look["color"], linestyle=look["linestyle"], linewidth=1.3)
        if len(names) == 1 and len(surfaces[name][50.0]) == 0:
            axes.text(
                0.5, 0.5, "fewer than half of\nthe runs found any", transform=axes.transAxes,
                ha="center", va="center", fontsize=7,
            )  # fmt: skip
    axes.set_xlim(horizontal)
    axes.set_ylim(vertical)
    axes.set_xlabel("$f_1$")
    axes.set_ylabel("$f_2$")
