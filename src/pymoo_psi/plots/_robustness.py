"""How often designs stay the best when parameters are uncertain, and what they lose otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pymoo_psi._validation import instance, integer, invalid
from pymoo_psi.pareto import Robustness
from pymoo_psi.plots._style import MARKERS, WIDTH, inches, on_axes, page_style

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RobustDesigns:
    """The k most robust designs, the best first.

    Attributes:
        indices: ``(k,)`` their rows.
        labels: What each is called.
        optimum_share: ``(k,)`` share of scenarios in which it is the Salukvadze optimum.
        efficient_share: ``(k,)`` share in which its rank of efficiency is 5 or 6.
        infeasible_share: ``(k,)`` share in which it is infeasible.
        mean_regret: ``(k,)`` mean regret, NaN for a design that is never feasible.
        worst_regret: ``(k,)`` largest regret, likewise.
        n_scenarios: Number of scenarios.

    Example:
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from scipy.stats import uniform
        >>> from pymoo_psi import robustness
        >>> line = FunctionalProblem(1, [lambda x: x[0]], xl=0, xu=1)
        >>> loads = {"load": uniform(1, 2)}
        >>> result = robustness(lambda load: line, [[0.9], [0.2]], uncertainty=loads)
        >>> designs = robust_designs(result, labels=["heavy", "light"])
        >>> designs.labels, designs.optimum_share
        (('light', 'heavy'), array([1., 0.]))
    """

    indices: NDArray[np.intp]
    labels: tuple[str, ...]
    optimum_share: Array
    efficient_share: Array
    infeasible_share: Array
    mean_regret: Array
    worst_regret: Array
    n_scenarios: int


def robust_designs(
    robustness: Robustness, *, top: int = 12, labels: Sequence[object] | None = None
) -> RobustDesigns:
    """Pick the designs to draw.

    Args:
        robustness: From :func:`pymoo_psi.robustness`.
        top: How many designs, if there are so many.
        labels: Names of all n designs, such as test point numbers; their rows unless given.

    Raises:
        ArgumentValueError: ``top`` is below 1, or the number of labels is not n.

    Example:
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from scipy.stats import uniform
        >>> from pymoo_psi import robustness
        >>> line = FunctionalProblem(1, [lambda x: x[0]], xl=0, xu=1)
        >>> loads = {"load": uniform(1, 2)}
        >>> result = robustness(lambda load: line, [[0.9], [0.2]], uncertainty=loads)
        >>> robust_designs(result, top=1).indices
        array([1])
    """
    robustness = instance("robustness", robustness, Robustness, "robustness(...) gives one")
    n = len(robustness.optimum_share)
    if labels is not None and len(labels) != n:
        raise invalid("labels", f"{n} names", len(labels))
    best = robustness.order[: integer("top", top, minimum=1)]
    return RobustDesigns(
        best,
        tuple(str(i if labels is None else labels[i]) for i in best.tolist()),
        robustness.optimum_share[best],
        robustness.efficient_share[best],
        robustness.infeasible_share[best],
        robustness.mean_regret[best],
        robustness.worst_regret[best],
        len(robustness.scenarios),
    )


def draw_shares(designs: RobustDesigns, *, ax: Axes | None = None) -> Axes:
    """Draw how often each design is the optimum, of rank 5 or 6, and infeasible.

    Args:
        designs: From :func:`robust_designs`.
        ax: Axes to draw on; new ones by default.

    Returns:
        The axes.

    Example:
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from scipy.stats import uniform
        >>> from pymoo_psi import robustness
        >>> line = FunctionalProblem(1, [lambda x: x[0]], xl=0, xu=1)
        >>> loads = {"load": uniform(1, 2)}
        >>> result = robustness(lambda load: line, [[0.9], [0.2]], uncertainty=loads)
        >>> draw_shares(robust_designs(result)).get_xlabel()
        'share of 256 scenarios (%)'
    """
    looks = (
        ("rank 5 or 6", designs.efficient_share, MARKERS[5].colour, "", 0.3),
        ("Salukvadze optimum", designs.optimum_share, MARKERS[6].colour, "///", 0.0),
        ("infeasible", designs.infeasible_share, "0.55", "...", -0.3),
    )
    with on_axes(ax) as axes:
        place = np.arange(len(designs.indices))
        for name, share, colour, hatch, offset in looks:
            axes.barh(
                place - offset, 100 * share, height=0.28, color=colour, hatch=hatch,
                edgecolor="white", linewidth=0.0, label=name,
            )  # fmt: skip
        _designs_axis(axes, designs)
        axes.set_xlim(0, 100)
        axes.set_xlabel(f"share of {designs.n_scenarios} scenarios (%)")
        _legend_below(axes, ncols=3)
    return axes  # type: ignore[no-any-return]


def draw_regret(designs: RobustDesigns, *, ax: Axes | None = None) -> Axes:
    """Draw the mean and the largest regret of each design.

    Args:
        designs: From :func:`robust_designs`.
        ax: Axes to draw on; new ones by default.

    Returns:
        The axes.

    Example:
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from scipy.stats import uniform
        >>> from pymoo_psi import robustness
        >>> line = FunctionalProblem(1, [lambda x: x[0]], xl=0, xu=1)
        >>> loads = {"load": uniform(1, 2)}
        >>> result = robustness(lambda load: line, [[0.9], [0.2]], uncertainty=loads)
        >>> ax = draw_regret(robust_designs(result, labels=["heavy", "light"]))
        >>> [text.get_text() for text in ax.get_yticklabels()]  # the best on top
        ['light', 'heavy']
    """
    with on_axes(ax) as axes:
        place = np.arange(len(designs.indices))
        axes.hlines(place, designs.mean_regret, designs.worst_regret, color="0.6", linewidth=1.0)
        for name, regret, shape in (
            ("mean", designs.mean_regret, "o"),
            ("worst scenario", designs.worst_regret, ">"),
        ):
            axes.plot(
                regret, place, linestyle="none", marker=shape, markersize=4.5, label=name,
                color="#0072B2" if name == "mean" else "#D55E00",
            )  # fmt: skip
        _designs_axis(axes, designs)
        axes.set_xlim(0, None)
        axes.set_xlabel(r"regret: $\mu_1$ above the least of the scenario")
        _legend_below(axes, ncols=2)
    return axes  # type: ignore[no-any-return]


def robustness_page(
    robustness: Robustness,
    *,
    top: int = 12,
    labels: Sequence[object] | None = None,
    title: str = "",
) -> Figure:
    """Return the shares on the left and the regret on the right.

    Args:
        robustness: From :func:`pymoo_psi.robustness`.
        top: How many designs, the most robust first.
        labels: Names of all n designs; their rows unless given.
        title: What the designs are; the uncertain parameters follow it.

    Example:
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from scipy.stats import uniform
        >>> from pymoo_psi import robustness
        >>> line = FunctionalProblem(1, [lambda x: x[0]], xl=0, xu=1)
        >>> loads = {"load": uniform(1, 2)}
        >>> result = robustness(lambda load: line, [[0.9], [0.2]], uncertainty=loads)
        >>> len(robustness_page(result, title="Rods").axes)
        2
    """
    designs = robust_designs(robustness, top=top, labels=labels)
    with page_style():
        height = 50 + 6.5 * len(designs.indices)
        figure = Figure(figsize=inches(WIDTH, height), layout="constrained")
        left, right = figure.subplots(1, 2)
        draw_shares(designs, ax=left)
        draw_regret(designs, ax=right)
        right.set_ylabel("")
        ranges = ", ".join(
            f"{name} from {column.min():.3g} to {column.max():.3g}"
            for name, column in zip(robustness.parameters, robustness.scenarios.T, strict=True)
        )
        figure.suptitle(f"{title}\nuncertain: {ranges}".strip(), fontsize=9)
    return figure


def _designs_axis(axes: Axes, designs: RobustDesigns) -> None:
    axes.set_yticks(np.arange(len(designs.labels)), designs.labels)
    axes.set_ylim(len(designs.labels) - 0.4, -0.6)  # the best on top
    axes.set_ylabel("design")
    axes.grid(visible=False, axis="y")


def _legend_below(axes: Axes, *, ncols: int) -> None:
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=4.0, ncols=ncols,
        frameon=False, columnspacing=1.2, handletextpad=0.5,
    )  # fmt: skip
