"""What the median run of each algorithm found, beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from pymoo_psi.arguments import broken_rule, known_name
from pymoo_psi.figures.comparison.parts import (
    budget_of,
    checked,
    counted,
    heading,
    looks,
    put_legend,
    reference_front,
    rows_of,
)
from pymoo_psi.figures.groups import literal, view
from pymoo_psi.figures.style import GREY, WIDTH, inches, on_axes, page_style
from pymoo_psi.studies.comparison import Comparison

__all__ = ["MedianFronts", "draw_front", "fronts_page", "median_fronts"]

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
        raise broken_rule("objectives", "two", len(objectives))
    return objectives
