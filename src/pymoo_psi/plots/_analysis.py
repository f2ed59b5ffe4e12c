"""Sensitivities, feasibility, convergence, predictions of surrogates, robustness."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import NullLocator

from pymoo_psi._validation import Received, instance, integer, invalid
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.plots._markers import GREY, MARKERS
from pymoo_psi.plots._style import (
    CURVES,
    HUGE,
    LETTERS,
    labelled,
    legend_of,
    literal,
    new_figure,
    panels,
)
from pymoo_psi.plots._test_table import Column, _checked, name_axes
from pymoo_psi.selection import Robustness
from pymoo_psi.table import Convergence, Kind, Limits, Rule, TestTable, feasibility_rules

_PANELS = 3  # side by side


def plot_sensitivities(sensitivities: pd.DataFrame, *, top: int = 12, title: str = "") -> Figure:
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
        >>> figure = plot_sensitivities(sensitivities(table, ["f1", "f2"]))
        >>> [ax.get_title() for ax in figure.axes]
        ['f1', 'f2']
    """
    names = getattr(getattr(sensitivities, "index", None), "names", None)
    if names is None or list(names) != ["column", "variable"]:
        rule = "sensitivities must be what sensitivities(table) gives"
        raise ArgumentTypeError(f"{rule}, got {type(sensitivities).__name__}")
    top = integer("top", top, minimum=1)
    columns = sensitivities.index.unique("column").tolist()
    largest = sensitivities["first_order"].groupby(level="variable", sort=False).max()
    kept = set(largest.sort_values(ascending=False).index[:top])
    variables = [name for name in sensitivities.index.unique("variable") if name in kept]
    wide = min(_PANELS, max(len(columns), 1))
    with new_figure(22 + -(-len(columns) // wide) * (16 + 5.0 * len(variables))) as figure:
        grid = figure.subplots(-(-len(columns) // wide), wide, squeeze=False, sharey=True).ravel()
        for ax in grid[len(columns) :]:
            ax.remove()
        for ax, column in zip(grid, columns, strict=False):
            found = sensitivities.loc[column].loc[variables]
            place = np.arange(len(found))
            # An index is between 0 and 1; its estimate need not be.
            index = found.clip(0, 1)
            ax.barh(place, index["first_order"], 0.62, color=CURVES[0]["color"], linewidth=0)
            ax.hlines(place, index["lower"], index["upper"], color="black", linewidth=0.9)
            ax.set(xlim=(0, 1), xlabel="share of the variance")
            _name_rows(ax, variables, 32)
            constant = ": constant" if index["first_order"].isna().all() else ""
            ax.set_title(literal(column, 28) + constant)
        left_out = len(largest) - len(variables)
        rest = f", {left_out} variables with smaller ones left out" if left_out else ""
        figure.suptitle(f"{title}\nfirst-order sensitivities with 95 % bands{rest}".strip())
    return figure


def plot_feasibility(table: TestTable, limits: Limits | None = None, *, title: str = "") -> Figure:
    """Return the tests over the two variables that decide most on feasibility, and the best rule.

    The box is that of the rule with the largest share of feasible designs, as far as it is a
    matter of these two variables; its text is the title.

    Args:
        table: A test table.
        limits: Limits that a feasible design must keep.
        title: What was tested.

    Raises:
        PsiError: scikit-learn is not installed.
        ArgumentTypeError: ``table`` is no test table.
        ArgumentValueError: The table has fewer than two variables, or a limit does not fit.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import investigate
        >>> (ax,) = plot_feasibility(investigate(get_problem("tnk"), 512)).axes
        >>> ax.get_xlabel(), ax.get_ylabel()
        ('x2', 'x1')
    """
    layout = _checked(table).layout
    if len(layout.variables) < 2:
        found = Received(f"{len(layout.variables)}")
        raise invalid("the table", "one with two variables or more", found)
    rules = feasibility_rules(table, limits)
    names = list(dict.fromkeys([*rules.importance, *layout.variables]))[:2]
    feasible = table.feasible(limits)
    columns = [Column.of_variable(table, name) for name in names]
    with panels(1, 1, head=60.0) as (figure, (ax,)):
        for mask, name, look in (
            (~feasible, "not feasible", {"color": GREY, "marker": "x", "markersize": 2.6}),
            (feasible, "feasible", {"color": CURVES[0]["color"], "marker": "o", "markersize": 3.0}),
        ):
            x, y = (column.places[mask] for column in columns)
            ax.plot(x, y, linestyle="none", label=f"{name} ({mask.sum()})", **look)
        ax.set(xlim=columns[0].ends, ylim=columns[1].ends)
        _draw_rule(ax, table, rules.rules[0], dict(zip(names, columns, strict=True)))
        name_axes(ax, layout.label_of(names[0]), layout.label_of(names[1]), columns[0].options)
        if options := columns[1].options:
            ax.set_yticks(range(len(options)), [literal(option, 14) for option in options])
        legend_of(figure, labelled([ax]), ncols=3)
        figure.suptitle(f"{title}\n{fill(literal(rules.rules[0], 150), LETTERS)}".strip())
    return figure


def _draw_rule(ax: Axes, table: TestTable, rule: Rule, columns: dict[str, Column]) -> None:
    """Draw the box of a rule in the plane of two variables; of options, one a row of neighbours."""
    if not set(columns) & set(rule.box):
        return
    sides: list[list[tuple[float, float]]] = []
    for name, column in columns.items():
        part = rule.box.get(name, column.options or (None, None))
        if not column.options:
            # a whole number is inside of the box that it bounds
            half = 0.5 * (table.kinds[table.layout.variable(name)] is Kind.INTEGER)
            first, last = (np.nan if end is None else end for end in part)
            left, right = column.ends
            sides.append([(np.fmax(first - half, left), np.fmin(last + half, right))])
            continue
        allowed = part if isinstance(part, (list, tuple)) else [part]
        kept = sorted(column.options.index(option) for option in allowed)
        sides.append([(place - 0.5, place + 0.5) for place in kept])
    for k, ((left, right), (bottom, top)) in enumerate(product(*sides)):
        box = Rectangle(
            (left, bottom), right - left, top - bottom, zorder=5, label="_" if k else "best rule",
            facecolor="none", edgecolor="black", linewidth=1.2, linestyle="--",
        )  # fmt: skip
        ax.add_patch(box)


def plot_convergence(convergence: Convergence, *, title: str = "") -> Figure:
    """Return distance of the best design and hypervolume against tests.

    Args:
        convergence: From :func:`pymoo_psi.table.convergence`.
        title: What was tested; the verdict follows it.

    Raises:
        ArgumentTypeError: ``convergence`` is none.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> from pymoo_psi.table import convergence
        >>> table = investigate(VectorizedSphereChute(0.4), 256)
        >>> len(plot_convergence(convergence(table)).axes)
        2
    """
    found = instance("convergence", convergence, Convergence, "convergence(table) gives one")
    curves = {
        "distance $\\mu_1$ to $U$\nof the best design": found.mu1,
        "hypervolume\n(share of the last)": found.hypervolume,
    }
    with panels(2, 2) as (figure, axes):
        for ax, (name, values) in zip(axes, curves.items(), strict=True):
            known = np.where(np.isfinite(values), values, np.nan)
            ax.plot(found.tests, known, markersize=3.5, linewidth=1.2, **CURVES[0])
            ax.set_xscale("log", base=2)
            shown = found.tests[::-1][::2][::-1].tolist()  # every other one, the last among them
            ax.set_xticks(shown, [str(n) for n in shown])
            ax.xaxis.set_minor_locator(NullLocator())
            ax.set(title=name, xlabel="tests")
            ax.set_ylim(0, 1.1 * np.nan_to_num(known).max(initial=0) or 1)
        figure.suptitle(f"{title}\n{fill(found.verdict(), LETTERS)}".strip())
    return figure


def plot_predictions(predictions: pd.DataFrame, *, title: str = "") -> Figure:
    """Return for every objective and constraint the tested value against the predicted one.

    Points on the diagonal were predicted exactly. The darker a point the later its round: dark
    points near the diagonal say that the surrogates can be trusted now where they propose.

    Args:
        predictions: From :meth:`pymoo_psi.SurrogatePSI.predictions`.
        title: What the designs are.

    Raises:
        ArgumentValueError: The frame has no predictions.
        ArgumentTypeError: ``predictions`` is no frame.

    Example:
        >>> from pymoo.optimize import minimize
        >>> from pymoo_psi import SphereChute, SurrogatePSI
        >>> algorithm = minimize(SphereChute(model="rolling"), SurrogatePSI(36)).algorithm
        >>> figure = plot_predictions(algorithm.predictions())
        >>> [axes.get_title() for axes in figure.axes][:2]
        ['f1', 'f2']
    """
    frame = instance("predictions", predictions, pd.DataFrame, "SurrogatePSI.predictions() is one")
    suffix = "_predicted"
    names = [name.removesuffix(suffix) for name in frame.columns if name.endswith(suffix)]
    known = frame[frame["surrogate"] != ""] if names else frame[:0]
    if len(known) == 0:
        raise invalid("predictions", "of at least one tested proposal of a surrogate", len(frame))
    rounds = known["round"].to_numpy()
    shade = (0.75 * (1 - rounds / rounds.max())).astype(str)
    with panels(len(names), min(_PANELS, len(names))) as (figure, axes):
        for ax, name in zip(axes, names, strict=True):
            pairs = known[[name + suffix, name]].to_numpy(float)
            pairs = np.where(np.abs(pairs) < HUGE, pairs, np.nan)  # what axes can hold
            for look, kind in zip(CURVES, sorted(set(known["surrogate"])), strict=False):
                mine = (known["surrogate"] == kind).to_numpy()
                ax.scatter(
                    *pairs[mine].T, marker=look["marker"], s=12, c=shade[mine],
                    edgecolors=look["color"], linewidths=0.5, label=kind,
                )  # fmt: skip
            if np.isfinite(pairs[:, 1]).any():
                ax.axline((float(np.nanmedian(pairs[:, 1])),) * 2, slope=1, color="0.5", lw=0.6)
            name_axes(ax, "predicted", "found")
            ax.set_title(literal(name))
        legend_of(figure, labelled(axes), ncols=2)
        line = f"{len(known)} proposals in {rounds.max()} rounds, the later the darker"
        figure.suptitle(f"{title}\n{line}".strip())
    return figure


def plot_robustness(
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
        >>> left, right = plot_robustness(result, labels=["heavy", "light"], title="Rods").axes
        >>> [text.get_text() for text in left.get_yticklabels()]  # the best on top
        ['light', 'heavy']
    """
    found = instance("robustness", robustness, Robustness, "robustness(...) gives one")
    n = len(found.optimum_share)
    if labels is not None and len(labels) != n:
        raise invalid("labels", f"{n} names", len(labels))
    best = found.order[: integer("top", top, minimum=1)]
    place = np.arange(len(best))
    with new_figure(50 + 6.5 * len(best)) as figure:
        left, right = figure.subplots(1, 2)
        for name, share, colour, hatch, offset in (
            ("rank 5 or 6", found.efficient_share, MARKERS[5].colour, "", 0.3),
            ("Salukvadze optimum", found.optimum_share, MARKERS[6].colour, "///", 0.0),
            ("infeasible", found.infeasible_share, "0.55", "...", -0.3),
        ):
            left.barh(
                place - offset, 100 * share[best], height=0.28, color=colour, hatch=hatch,
                edgecolor="white", linewidth=0.0, label=name,
            )  # fmt: skip
        left.set_xlim(0, 100)
        left.set_xlabel(f"share of {len(found.scenarios)} scenarios (%)")
        mean, worst = found.mean_regret[best], found.worst_regret[best]
        right.hlines(place, mean, worst, color="0.6", linewidth=1.0)
        for name, regret, shape, look in (
            ("mean", mean, "o", CURVES[0]),
            ("worst scenario", worst, ">", CURVES[1]),
        ):
            style = {"linestyle": "none", "marker": shape, "color": look["color"]}
            right.plot(regret, place, markersize=4.5, label=name, **style)
        right.set_xlim(0, None)
        right.set_xlabel(r"regret: $\mu_1$ above the scenario's least")
        for ax in (left, right):
            _name_rows(ax, [i if labels is None else labels[i] for i in best.tolist()], 16)
        legend_of(figure, labelled([left, right]), ncols=5)
        left.set_ylabel("design")
        ranges = ", ".join(
            f"{literal(name)} from {column.min():.3g} to {column.max():.3g}"
            for name, column in zip(found.parameters, found.scenarios.T, strict=True)
        )
        figure.suptitle(f"{title}\n{fill(f'uncertain: {ranges}', LETTERS)}".strip())
    return figure


def _name_rows(ax: Axes, names: Sequence[object], letters: int) -> None:
    """Name the bars of a horizontal chart, the first on top."""
    ax.set_yticks(np.arange(len(names)), [literal(name, letters) for name in names])
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(visible=False, axis="y")
