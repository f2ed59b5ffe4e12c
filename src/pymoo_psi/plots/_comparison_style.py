"""What the figures of a comparison share: the looks of the algorithms, legends, headings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from pymoo_psi._validation import instance, invalid
from pymoo_psi.comparison import Comparison
from pymoo_psi.plots._designs import literal

Array = NDArray[np.float64]

# The lengths have no common factor: a look comes again after the product of them only.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")

_LETTERS = 108  # in a line of a legend over the width of a page

_ASSESSED = {
    "evaluated": "all feasible designs that a run evaluated",
    "returned": "the designs that a run returned",
}


def checked(comparison: Any) -> Comparison:
    """Return a comparison; anything else is refused."""
    return instance("comparison", comparison, Comparison, "compare(...) gives one")


def budget_of(comparison: Comparison, evaluations: int | None) -> int:
    """Return one of the budgets, the largest unless one is given."""
    if evaluations is None:
        return comparison.evaluations[-1]
    if evaluations not in comparison.evaluations:
        known = ", ".join(map(str, comparison.evaluations))
        raise invalid("evaluations", f"one of the budgets {known}", evaluations)
    return int(evaluations)


def rows_of(comparison: Comparison, algorithm: str, evaluations: int | None = None) -> list[int]:
    """Return the numbers of the runs of an algorithm, with one budget or all."""
    return [
        i
        for i, run in enumerate(comparison.runs)
        if run.task.algorithm == algorithm and evaluations in (None, run.task.n_evaluations)
    ]


def reference_front(comparison: Comparison) -> Array:
    """Return the ``(k, m)`` reference set in the units of the objectives."""
    frame = comparison.reference.frame
    front: Array = frame.ideal + (frame.nadir - frame.ideal) * comparison.reference.points
    return front


def counted(n: int, what: str) -> str:
    """Return a number of things in words.

    Example:
        >>> counted(1, "design"), counted(2, "design")
        ('1 design', '2 designs')
    """
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def looks(algorithms: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return colour, line style and marker of each algorithm."""
    ways = zip(cycle(_COLOURS), cycle(_STYLES), cycle(_MARKERS), strict=False)
    return {
        name: {"color": colour, "linestyle": style, "marker": marker}
        for name, (colour, style, marker) in zip(algorithms, ways, strict=False)
    }


def algorithm_entries(algorithms: Sequence[str], **further: Any) -> list[tuple[str, Artist]]:
    """Return for a legend the names of algorithms and how they are drawn."""
    return [
        (
            literal(name, 30),
            Line2D([], [], **{"markersize": 4.0, "linewidth": 1.2, **look, **further}),
        )
        for name, look in looks(algorithms).items()
    ]


def put_legend(owner: Axes | Figure, entries: Sequence[tuple[str, Artist]]) -> None:
    """Put a legend in axes, or under those of a page."""
    names, handles = zip(*entries, strict=True)
    place: dict[str, Any] = {"loc": "best"}
    if isinstance(owner, Figure):
        letters = [len(name) + 9 for name in names]
        fits = [n for n in range(1, len(names) + 1) if _width(letters, n) <= _LETTERS]
        ncols = max(fits, default=1)
        place = {"loc": "outside lower center", "ncols": ncols}
    made = owner.legend(handles, [" "] * len(names), fontsize=7, handlelength=3.6, **place)
    for text, name in zip(made.get_texts(), names, strict=True):
        text.set_text(name)  # given above, one that begins with an underscore would be left out


def _width(letters: Sequence[int], ncols: int) -> int:
    return sum(int(column.max()) for column in np.array_split(letters, ncols))


def budget_ticks(axes: Axes, evaluations: Sequence[int]) -> None:
    """Make a logarithmic axis of the evaluations, with ticks at the budgets."""
    low, high = evaluations[0], evaluations[-1]
    axes.set_xscale("log")
    pad = (high / low) ** 0.06 if high > low else 1.5
    axes.set_xlim(low / pad, high * pad)
    room = 0.09 * np.log(high / low)
    labels, last = [], -np.inf
    for budget in evaluations:
        free = np.log(budget) - last >= room
        last = np.log(budget) if free else last
        labels.append(str(budget) if free else "")
    axes.set_xticks(evaluations, labels)
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("evaluations")


def logarithmic(axes: Axes, letter: str, ticks: Sequence[float]) -> None:
    """Make an axis logarithmic, with ticks at so many times a power of ten, as plain numbers."""
    getattr(axes, f"set_{letter}scale")("log")
    axis = axes.xaxis if letter == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=ticks))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def heading(figure: Figure, comparison: Comparison, what: str, evaluations: Sequence[int]) -> None:
    """Write over the axes what is drawn, of which problem and runs, and what is assessed."""
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
        f"assessed: {_ASSESSED[comparison.assess]}",
        fontsize=9,
    )
