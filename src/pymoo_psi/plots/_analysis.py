"""What drives the columns of a table, where its designs are feasible, and if they are enough."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from pymoo_psi._markers import GREY
from pymoo_psi._validation import Received, instance, integer, invalid
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.plots._designs import aside, checked_table
from pymoo_psi.plots._style import (
    CURVES,
    LETTERS,
    legend_below,
    literal,
    new_page,
    on_axes,
    wrapped,
)
from pymoo_psi.table import (
    Convergence,
    Kind,
    Limits,
    Rule,
    TestTable,
    feasibility_rules,
    value_ranks,
    values_in_order,
)

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

_LETTERS = 62  # of a line over axes of their own
_NAMED = 6  # test points named beside the curve: the last ones, which are about the decision


def sensitivity_page(sensitivities: pd.DataFrame, *, top: int = 12, title: str = "") -> Figure:
    """Return bars of the first-order sensitivities with their bands, one panel to a column.

    Args:
        sensitivities: From :func:`pymoo_psi.table.sensitivities`.
        top: How many variables to a panel: those with the largest index in any column, in the
            order of the table.
        title: What was tested.

    Raises:
        ArgumentTypeError: ``sensitivities`` is no such frame.
        ArgumentValueError: ``top`` is below 1.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> from pymoo_psi.table import sensitivities
        >>> table = investigate(VectorizedSphereChute(0.4), 256)
        >>> page = sensitivity_page(sensitivities(table, ["f1", "f2"]))
        >>> [ax.get_title() for ax in page.axes]
        ['f1', 'f2']
    """
    names = getattr(getattr(sensitivities, "index", None), "names", None)
    if names is None or list(names) != ["column", "variable"]:
        found = type(sensitivities).__name__
        raise ArgumentTypeError(
            f"sensitivities must be what sensitivities(table) gives, got {found}"
        )
    top = integer("top", top, minimum=1)
    columns = sensitivities.index.unique("column").tolist()
    largest = sensitivities["first_order"].groupby(level="variable", sort=False).max()
    kept = set(largest.sort_values(ascending=False).index[:top])
    variables = [name for name in sensitivities.index.unique("variable") if name in kept]
    wide = min(3, max(len(columns), 1))
    high = -(-len(columns) // wide)
    with new_page(22 + high * (16 + 5.0 * len(variables))) as figure:
        grid = figure.subplots(high, wide, squeeze=False, sharey=True).ravel()
        for ax in grid[len(columns) :]:
            ax.set_axis_off()
        for ax, column in zip(grid, columns, strict=False):
            found = sensitivities.loc[column].loc[variables]
            _draw_indices(ax, found["first_order"], found["lower"], found["upper"])
            ax.set_yticks(np.arange(len(variables)), [literal(name, 32) for name in variables])
            constant = ": constant" if found["first_order"].isna().all() else ""
            ax.set_title(literal(column, 28 - len(constant)) + constant)
        for ax in grid[max(len(columns) - wide, 0) : len(columns)]:
            ax.set_xlabel("share of the variance")
        left_out = len(largest) - len(variables)
        rest = f", {left_out} variables with smaller ones left out" if left_out else ""
        figure.suptitle(f"{title}\nfirst-order sensitivities with 95 % bands{rest}".strip())
    return figure


def _draw_indices(ax: Axes, index: Any, lower: Any, upper: Any) -> None:
    place = np.arange(len(index))
    # An index is between 0 and 1; its estimate need not be.
    ax.barh(place, np.maximum(index, 0), height=0.62, color=CURVES[0]["color"], linewidth=0)
    ax.hlines(place, np.clip(lower, 0, 1), np.clip(upper, 0, 1), color="black", linewidth=0.9)
    ax.set_xlim(0, 1)
    ax.set_ylim(len(index) - 0.4, -0.6)  # the first variable on top
    ax.grid(visible=False, axis="y")


def draw_feasibility(
    table: TestTable,
    limits: Limits | None = None,
    *,
    ax: Axes | None = None,
    legend: bool = True,
    title: str = "",
) -> Axes:
    """Draw the tests over the two variables that decide most on feasibility, and the best rule.

    The box is that of the rule with the largest share of feasible designs, as far as it is a
    matter of these two variables; its text is the title.

    Args:
        table: A test table.
        limits: Limits that a feasible design must keep.
        ax: Axes to draw on; new ones by default.
        legend: Put a legend under the axes.
        title: What was tested.

    Raises:
        PsiError: scikit-learn is not installed.
        ArgumentTypeError: ``table`` is no test table.
        ArgumentValueError: The table has fewer than two variables, or a limit does not fit.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import investigate
        >>> ax = draw_feasibility(investigate(get_problem("tnk"), 512))
        >>> ax.get_xlabel(), ax.get_ylabel()
        ('x2', 'x1')
    """
    table = checked_table(table)
    if len(table.layout.variables) < 2:
        found = Received(f"{len(table.layout.variables)}")
        raise invalid("the table", "one with two variables or more", found, "use draw_histogram")
    rules = feasibility_rules(table, limits)
    names = [*rules.importance, *table.layout.variables]
    first, second = list(dict.fromkeys(names))[:2]
    feasible = table.feasible(limits)
    x, y = (_places(table, name) for name in (first, second))
    with on_axes(ax) as axes:
        for mask, name, look in (
            (~feasible, "not feasible", {"color": GREY, "marker": "x", "markersize": 2.6}),
            (feasible, "feasible", {"color": CURVES[0]["color"], "marker": "o", "markersize": 3.0}),
        ):
            label = f"{name} ({mask.sum()})"
            axes.plot(x[mask], y[mask], linestyle="none", label=label, **look)
        _draw_rule(axes, table, rules.rules[0], (first, second))
        for name, axis in ((first, axes.xaxis), (second, axes.yaxis)):
            if not _is_number(table, name):
                options = values_in_order(table.column(name))
                axis.set_ticks(range(len(options)), [literal(option, 14) for option in options])
        axes.set_xlabel(literal(table.layout.label_of(first)))
        axes.set_ylabel(literal(table.layout.label_of(second)))
        rule = wrapped(literal(rules.rules[0], 150), _LETTERS)
        axes.set_title(f"{title}\n{rule}".strip())
        if legend:
            legend_below(axes, ncols=3)
    return axes


def _places(table: TestTable, variable: str) -> Array:
    """``(n,)`` where tests are drawn over a variable; those of single values side by side."""
    column = table.column(variable)
    if _is_number(table, variable):
        return column.astype(np.float64)
    _, ranks = value_ranks(column)
    return ranks + aside(table.numbers)


def _is_number(table: TestTable, variable: str) -> bool:
    return table.kinds[table.layout.variable(variable)] in (Kind.REAL, Kind.INTEGER)


def _draw_rule(ax: Axes, table: TestTable, rule: Rule, variables: tuple[str, str]) -> None:
    """Draw the box of a rule in the plane of two variables; of options, one for each row of them.

    Args:
        ax: Axes, their view set by the tests.
        table: The tests.
        rule: The rule.
        variables: What is on the horizontal and on the vertical axis.
    """
    if not set(variables) & set(rule.box):
        return
    sides: list[list[tuple[float, float]]] = []
    for variable, view in zip(variables, (ax.get_xlim(), ax.get_ylim()), strict=True):
        if _is_number(table, variable):
            low, high = rule.box.get(variable, (None, None))
            # a whole number is inside of the box that it bounds
            room = 0.5 * (table.kinds[table.layout.variable(variable)] is Kind.INTEGER)
            first, last = (end if end is not None else np.nan for end in (low, high))
            sides.append([(np.fmax(first - room, view[0]), np.fmin(last + room, view[1]))])
            continue
        options = values_in_order(table.column(variable))
        part = rule.box.get(variable, options)
        kept = sorted(options.index(o) for o in (part if isinstance(part, list) else [part]))
        rows = np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1)  # neighbours in one box
        sides.append([(row[0] - 0.5, row[-1] + 0.5) for row in rows])
    look: dict[str, Any] = {
        "facecolor": "none",
        "edgecolor": "black",
        "linewidth": 1.2,
        "linestyle": "--",
    }
    label = "best rule"
    for (left, right), (bottom, top) in product(*sides):
        box = Rectangle((left, bottom), right - left, top - bottom, zorder=5, label=label, **look)
        ax.add_patch(box)
        label = "_"  # named once


def convergence_page(convergence: Convergence, *, title: str = "") -> Figure:
    """Return distance of the best design, hypervolume and covering radius against tests.

    Args:
        convergence: From :func:`pymoo_psi.table.convergence`.
        title: What was tested; the verdict follows it.

    Raises:
        ArgumentTypeError: ``convergence`` is none.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> from pymoo_psi.table import convergence
        >>> table = investigate(VectorizedSphereChute(0.4), 256)
        >>> len(convergence_page(convergence(table)).axes)
        3
    """
    found = instance("convergence", convergence, Convergence, "convergence(table) gives one")
    verdict = wrapped(found.verdict(), LETTERS)
    sides = "sides of the box" if np.isfinite(found.covering_radius).any() else "no box is known"
    with new_page(82.0) as figure:
        for ax, values, name in zip(
            figure.subplots(1, 3),
            (found.mu1, found.hypervolume, found.covering_radius),
            (
                "distance $\\mu_1$ to $U$\nof the best design",
                "hypervolume\n(share of the last)",
                f"covering radius\n({sides})",
            ),
            strict=True,
        ):
            _draw_curve(ax, found, np.where(np.isfinite(values), values, np.nan))
            ax.set_title(name)
            known = values[np.isfinite(values)]
            ax.set_ylim(0, 1.4 * known.max(initial=0) or 1)  # room for names over the last points
        _name_designs(figure.axes[0], found)
        figure.suptitle(f"{title}\n{verdict}".strip())
    return figure


def _draw_curve(ax: Axes, found: Convergence, values: object) -> None:
    ax.plot(found.tests, values, markersize=3.5, linewidth=1.2, **CURVES[0])  # type: ignore[arg-type]
    ax.set_xscale("log", base=2)
    shown = found.tests[::-1][::2][::-1]  # every other one, the last among them
    ax.set_xticks(shown, [str(n) for n in shown.tolist()])
    ax.set_xlim(found.tests[0] / 1.25, found.tests[-1] * 1.25)  # also where the first have none
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xlabel("tests")


def _name_designs(ax: Axes, found: Convergence) -> None:
    """Write the number of the best test point where it changes."""
    previous = 0
    for k in range(max(len(found.tests) - _NAMED, 0), len(found.tests)):
        number, height = int(found.optimum[k]), float(found.mu1[k])
        if number not in (0, previous) and np.isfinite(height):
            ax.annotate(
                f"no. {number}", (found.tests[k], height), (-1, 4), textcoords="offset points",
                ha="left", va="bottom", fontsize=6, rotation=60,
            )  # fmt: skip
        previous = number
