"""What the median run of each algorithm found, beside each other.

What a quarter, a half and three quarters of the runs of an algorithm attain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid, known_name
from pymoo_psi.comparison import Comparison
from pymoo_psi.pareto._indicators import attainment_surfaces
from pymoo_psi.plots._comparison_style import (
    algorithm_entries,
    budget_of,
    checked,
    counted,
    heading,
    looks,
    put_legend,
    reference_front,
    rows_of,
)
from pymoo_psi.plots._designs import literal, view
from pymoo_psi.plots._style import GREY, WIDTH, inches, on_axes, page_style

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MedianFronts:
    """Of each of a algorithms the run of median hypervolume.

    Attributes:
        evaluations: The budget.
        algorithms: Names of the algorithms.
        seeds: Seed of each run; ``None`` where nothing is left to chance.
        hypervolume: ``(a,)`` hypervolume of each.
        fronts: ``(n_i, m)`` objectives that each found, n_i >= 0.
        reference: ``(k, m)`` the reference set, in the units of the objectives.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> fronts = median_fronts(comparison)
        >>> fronts.evaluations, len(fronts.fronts)
        (64, 2)
    """

    evaluations: int
    algorithms: tuple[str, ...]
    seeds: tuple[int | None, ...]
    hypervolume: Array
    fronts: tuple[Array, ...]
    reference: Array

    def limits(self, objective: int) -> tuple[float, float]:
        """Return the ends of an axis that shows one objective, 0 to m - 1, of all fronts.

        Example:
            >>> front = np.array([[0.0, 2.0], [1.0, 1.0]])
            >>> MedianFronts(2, ("psi",), (None,), np.ones(1), (front,), front).limits(0)
            (-0.05, 1.05)
        """
        return view(np.concatenate([F[:, objective] for F in (*self.fronts, self.reference)]))


def median_fronts(comparison: Comparison, evaluations: int | None = None) -> MedianFronts:
    """Pick the run of median hypervolume of each algorithm.

    Of an even number of runs it is the lower of the two in the middle; of equal ones the first.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        evaluations: The budget; the largest by default.

    Raises:
        ArgumentValueError: There is no such budget.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> median_fronts(comparison, 32).seeds[0] is None  # PSI leaves nothing to chance
        True
    """
    comparison = checked(comparison)
    budget = budget_of(comparison, evaluations)
    quality = comparison.measures["hypervolume"].to_numpy(float)
    chosen = []
    for name in comparison.algorithms:
        rows = sorted(rows_of(comparison, name, budget), key=lambda row: quality[row])
        chosen.append(rows[(len(rows) - 1) // 2])
    runs = [comparison.runs[row] for row in chosen]
    return MedianFronts(
        budget,
        comparison.algorithms,
        tuple(run.task.seed for run in runs),
        quality[chosen],
        tuple(run.found(comparison.assess) for run in runs),
        reference_front(comparison),
    )


def draw_front(
    fronts: MedianFronts,
    algorithm: str,
    objectives: Sequence[str] = ("f1", "f2"),
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw what an algorithm found over the reference set, in the plane of two objectives.

    Args:
        fronts: From :func:`median_fronts`.
        algorithm: Its name.
        objectives: Two of ``"f1"``, ``"f2"``, …
        ax: Axes to draw on; new ones by default.

    Returns:
        The axes, as wide as the fronts of all algorithms take.

    Raises:
        ArgumentValueError: A name is unknown, or there are not two objectives.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> ax = draw_front(median_fronts(comparison), "psi")
        >>> len(ax.lines)  # the reference set, and the front
        2
    """
    k = fronts.algorithms.index(known_name("algorithm", algorithm, fronts.algorithms))
    known = [f"f{i + 1}" for i in range(fronts.reference.shape[1])]
    i, j = _two([known.index(known_name("objectives", name, known)) for name in objectives])
    front, look = fronts.fronts[k], looks(fronts.algorithms)[algorithm]
    with on_axes(ax) as axes:
        dots = {"linestyle": "none", "markeredgewidth": 0.0}
        axes.plot(*fronts.reference[:, [i, j]].T, marker="o", color=GREY, markersize=2.0, **dots)
        axes.plot(
            *front[:, [i, j]].T, marker=look["marker"], color=look["color"], markersize=3.0, **dots
        )
        if len(front) == 0:
            axes.text(0.5, 0.5, "nothing found", transform=axes.transAxes, ha="center")
        axes.set_xlim(fronts.limits(i))
        axes.set_ylim(fronts.limits(j))
        axes.set_xlabel(f"$f_{{{i + 1}}}$")
        axes.set_ylabel(f"$f_{{{j + 1}}}$")
        seed = "" if fronts.seeds[k] is None else f", seed {fronts.seeds[k]}"
        found = counted(len(front), "design")
        axes.set_title(
            f"{literal(algorithm, 24)}{seed}\n{found}, hypervolume {fronts.hypervolume[k]:.4f}",
            loc="left",
            fontsize=7.5,
        )
    return axes  # type: ignore[no-any-return]


def fronts_page(comparison: Comparison, evaluations: int | None = None) -> Figure:
    """Return the fronts of the median runs on common axes.

    Of two objectives each algorithm has one plane; of more a row of up to three, f1 against
    f2, f3 and f4.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        evaluations: The budget; the largest by default.

    Raises:
        ArgumentValueError: There is no such budget.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> len(fronts_page(comparison).axes)
        2
    """
    fronts = median_fronts(comparison, evaluations)
    names, n_planes = fronts.algorithms, min(comparison.objectives - 1, 3)
    wide = n_planes if n_planes > 1 else {1: 1, 2: 2, 4: 2}.get(len(names), 3)
    high = -(-len(names) * n_planes // wide)
    with page_style():
        height = 30.0 + high * (62.0 if wide < 3 else 50.0)
        figure = Figure(figsize=inches(WIDTH, height), layout="constrained")
        grid = figure.subplots(high, wide, squeeze=False).ravel()
        panels = [(name, f"f{j + 2}") for name in names for j in range(n_planes)]
        for ax, (name, other) in zip(grid, panels, strict=False):
            draw_front(fronts, name, ("f1", other), ax=ax)
            if other != "f2":
                ax.set_title("", loc="left")
        for ax in grid[len(panels) :]:
            ax.remove()
        dots = Line2D([], [], linestyle="none", marker="o", markersize=4.0, color=GREY)
        put_legend(figure, [("reference set, of all runs together", dots)])
        heading(figure, comparison, "runs of median hypervolume", [fronts.evaluations])
    return figure


def _two(objectives: list[int]) -> list[int]:
    if len(objectives) != 2:
        raise invalid("objectives", "two", len(objectives))
    return objectives


@dataclass(frozen=True, eq=False)
class Attainment:
    """Empirical attainment surfaces of a algorithms, for two objectives.

    A run attains a point if one of its own is no worse in either objective. Each surface is given
    by its ``(k, 2)`` corners by rising f1, in the units of the objectives; it has none where so
    many runs found nothing.

    Attributes:
        evaluations: The budget.
        algorithms: Names of the algorithms.
        quarter: Of each algorithm what a quarter of its runs attains, or more.
        median: What half of them attains.
        three_quarters: What three quarters of them attain.
        reference: ``(k, 2)`` the reference set.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> surfaces = attainment(comparison)
        >>> bool((surfaces.median[0] == surfaces.quarter[0]).all())  # PSI has one run
        True
    """

    evaluations: int
    algorithms: tuple[str, ...]
    quarter: tuple[Array, ...]
    median: tuple[Array, ...]
    three_quarters: tuple[Array, ...]
    reference: Array

    def limits(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the ends of the axes that show every surface.

        Example:
            >>> front = np.array([[0.0, 2.0], [1.0, 1.0]])
            >>> Attainment(2, ("psi",), (front,), (front,), (front,), front).limits()
            ((-0.05, 1.05), (0.95, 2.05))
        """
        sets = (*self.quarter, *self.median, *self.three_quarters, self.reference)
        f1, f2 = np.concatenate(sets).T
        return view(f1), view(f2)


def attainment(comparison: Comparison, evaluations: int | None = None) -> Attainment:
    """Find what a quarter, a half and three quarters of the runs of each algorithm attain.

    Args:
        comparison: From :func:`pymoo_psi.compare`, with two objectives.
        evaluations: The budget; the largest by default.

    Raises:
        ArgumentValueError: There is no such budget, or the problem has another number of
            objectives.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> f1, f2 = attainment(comparison).median[1].T
        >>> bool((np.diff(f1) > 0).all() and (np.diff(f2) < 0).all())
        True
    """
    comparison = checked(comparison)
    if comparison.objectives != 2:
        received = Received(f"{comparison.objectives} objectives")
        remedy = "fronts_page shows any number"
        raise invalid("comparison", "of a problem with two objectives", received, remedy)
    budget = budget_of(comparison, evaluations)
    surfaces = []
    for name in comparison.algorithms:
        rows = rows_of(comparison, name, budget)
        fronts = [comparison.runs[row].found(comparison.assess) for row in rows]
        surfaces.append(attainment_surfaces(fronts, [25.0, 50.0, 75.0]))
    quarter, median, three_quarters = (
        tuple(surface[p] for surface in surfaces) for p in (25.0, 50.0, 75.0)
    )
    reference = reference_front(comparison)
    return Attainment(budget, comparison.algorithms, quarter, median, three_quarters, reference)


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


def draw_attainment(
    surfaces: Attainment,
    algorithms: Sequence[str] | None = None,
    *,
    bands: bool = True,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw median surfaces as lines, with bands between those of a quarter and three quarters.

    Args:
        surfaces: From :func:`attainment`.
        algorithms: Names of those to draw; all by default.
        bands: Draw what lies between the surfaces of a quarter and three quarters of the runs.
        legend: Name them in the axes, if there are several; one alone is named above them.
        ax: Axes to draw on; new ones by default.

    Returns:
        The axes, as wide as the surfaces of all algorithms take.

    Raises:
        ArgumentValueError: A name is unknown.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> ax = draw_attainment(attainment(comparison), ["nsga3"])
        >>> len(ax.patches), len(ax.lines)  # a band; the reference set and a median
        (1, 2)
    """
    chosen = surfaces.algorithms if algorithms is None else algorithms
    chosen = [known_name("algorithms", name, surfaces.algorithms) for name in chosen]
    horizontal, vertical = surfaces.limits()
    right, top = horizontal[1], vertical[1]
    with on_axes(ax) as axes:
        axes.plot(
            *surfaces.reference.T, linestyle="none", marker="o", markersize=1.6, color=GREY,
            markeredgewidth=0.0,
        )  # fmt: skip
        for name in chosen:
            k, look = surfaces.algorithms.index(name), looks(surfaces.algorithms)[name]
            better = steps(surfaces.quarter[k], right, top)
            worse = steps(surfaces.three_quarters[k], right, top)
            if bands:
                band = np.concatenate([better, worse[::-1]])
                axes.fill(*band.T, color=look["color"], alpha=0.2, linewidth=0)
            edge = steps(surfaces.median[k], right, top)
            axes.plot(*edge.T, color=look["color"], linestyle=look["linestyle"], linewidth=1.3)
            if len(surfaces.median[k]) == 0 and len(chosen) == 1:
                text = "fewer than half of\nthe runs found any"
                axes.text(
                    0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=7
                )
        axes.set_xlim(horizontal)
        axes.set_ylim(vertical)
        axes.set_xlabel("$f_1$")
        axes.set_ylabel("$f_2$")
        title = literal(chosen[0], 18) if len(chosen) == 1 else ""
        axes.set_title(title, loc="left", fontsize=7.5)
        if legend and len(chosen) > 1:
            entries = zip(
                surfaces.algorithms, algorithm_entries(surfaces.algorithms, marker=""), strict=True
            )
            put_legend(axes, [entry for name, entry in entries if name in chosen])
    return axes  # type: ignore[no-any-return]


def attainment_page(comparison: Comparison, evaluations: int | None = None) -> Figure:
    """Return the median surfaces together in a large plane, and each with its band in a small one.

    Args:
        comparison: From :func:`pymoo_psi.compare`, with two objectives.
        evaluations: The budget; the largest by default.

    Raises:
        ArgumentValueError: There is no such budget, or the problem has another number of
            objectives.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> [ax.get_title(loc="left") for ax in attainment_page(comparison).axes]
        ['', 'psi', 'nsga3']
    """
    surfaces = attainment(comparison, evaluations)
    names = surfaces.algorithms
    alone = names if len(names) > 1 else ()
    with page_style():
        places = [(0, 2), (0, 3), (1, 2), (1, 3)]
        places += [(2 + k // 4, k % 4) for k in range(len(alone) - 4)]
        high = 1 + max([1, *(row for row, _ in places[: len(alone)])])
        figure = Figure(figsize=inches(WIDTH, 30.0 + 50.0 * high), layout="constrained")
        grid = figure.add_gridspec(high, 4)
        together = figure.add_subplot(grid[:2, :2] if alone else grid[:, :])
        draw_attainment(surfaces, bands=not alone, legend=False, ax=together)
        for name, place in zip(alone, places, strict=False):
            draw_attainment(surfaces, [name], ax=figure.add_subplot(grid[place]))
        band = Patch(facecolor="0.5", alpha=0.3, linewidth=0)
        dots = Line2D([], [], linestyle="none", marker="o", markersize=4.0, color=GREY)
        put_legend(figure, [
            *algorithm_entries(names, marker=""),
            ("bands: 25 to 75 % of the runs", band),
            ("reference set", dots),
        ])  # fmt: skip
        heading(figure, comparison, "what half of the runs attain", [surfaces.evaluations])
    return figure
