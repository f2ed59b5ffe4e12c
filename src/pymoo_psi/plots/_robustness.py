"""How often designs stay the best when parameters are uncertain, and what they lose otherwise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pymoo_psi._markers import MARKERS
from pymoo_psi._validation import instance, integer, invalid
from pymoo_psi.pareto import Robustness
from pymoo_psi.plots._style import CURVES, LETTERS, legend_below, literal, new_page, wrapped


def robustness_page(
    robustness: Robustness,
    *,
    top: int = 12,
    labels: Sequence[object] | None = None,
    title: str = "",
) -> Figure:
    """Return how often each design is the optimum, of rank 5 or 6 and infeasible, and its regret.

    Args:
        robustness: From :func:`pymoo_psi.robustness`.
        top: How many designs, the most robust first.
        labels: Names of all n designs, such as test point numbers; their rows unless given.
        title: What the designs are; the uncertain parameters follow it.

    Raises:
        ArgumentValueError: ``top`` is below 1, or the number of labels is not n.
        ArgumentTypeError: ``robustness`` is none.

    Example:
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from scipy.stats import uniform
        >>> from pymoo_psi import robustness
        >>> line = FunctionalProblem(1, [lambda x: x[0]], xl=0, xu=1)
        >>> loads = {"load": uniform(1, 2)}
        >>> result = robustness(lambda load: line, [[0.9], [0.2]], uncertainty=loads)
        >>> left, right = robustness_page(result, labels=["heavy", "light"], title="Rods").axes
        >>> [text.get_text() for text in left.get_yticklabels()]  # the best on top
        ['light', 'heavy']
    """
    robustness = instance("robustness", robustness, Robustness, "robustness(...) gives one")
    n = len(robustness.optimum_share)
    if labels is not None and len(labels) != n:
        raise invalid("labels", f"{n} names", len(labels))
    best = robustness.order[: integer("top", top, minimum=1)]
    with new_page(50 + 6.5 * len(best)) as figure:
        left, right = figure.subplots(1, 2)
        _draw_shares(left, robustness, best)
        _draw_regret(right, robustness, best)
        for ax in (left, right):
            ax.set_yticks(
                np.arange(len(best)),
                [literal(i if labels is None else labels[i], 16) for i in best.tolist()],
            )
            ax.set_ylim(len(best) - 0.4, -0.6)  # the best on top
            ax.grid(visible=False, axis="y")
        left.set_ylabel("design")
        ranges = ", ".join(
            f"{literal(name)} from {column.min():.3g} to {column.max():.3g}"
            for name, column in zip(robustness.parameters, robustness.scenarios.T, strict=True)
        )
        figure.suptitle(f"{title}\n{wrapped(f'uncertain: {ranges}', LETTERS)}".strip())
    return figure


def _draw_shares(axes: Axes, robustness: Robustness, best: NDArray[np.intp]) -> None:
    place = np.arange(len(best))
    for name, share, colour, hatch, offset in (
        ("rank 5 or 6", robustness.efficient_share, MARKERS[5].colour, "", 0.3),
        ("Salukvadze optimum", robustness.optimum_share, MARKERS[6].colour, "///", 0.0),
        ("infeasible", robustness.infeasible_share, "0.55", "...", -0.3),
    ):
        axes.barh(
            place - offset, 100 * share[best], height=0.28, color=colour, hatch=hatch,
            edgecolor="white", linewidth=0.0, label=name,
        )  # fmt: skip
    axes.set_xlim(0, 100)
    axes.set_xlabel(f"share of {len(robustness.scenarios)} scenarios (%)")
    legend_below(axes, ncols=3)


def _draw_regret(axes: Axes, robustness: Robustness, best: NDArray[np.intp]) -> None:
    place = np.arange(len(best))
    mean, worst = robustness.mean_regret[best], robustness.worst_regret[best]
    axes.hlines(place, mean, worst, color="0.6", linewidth=1.0)
    for name, regret, shape, look in (
        ("mean", mean, "o", CURVES[0]),
        ("worst scenario", worst, ">", CURVES[1]),
    ):
        axes.plot(
            regret, place, linestyle="none", marker=shape, markersize=4.5, label=name,
            color=look["color"],
        )  # fmt: skip
    axes.set_xlim(0, None)
    axes.set_xlabel(r"regret: $\mu_1$ above the scenario's least")
    legend_below(axes, ncols=2)
