"""Figures of sensitivities, of fits to measurements and of comparisons of algorithms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from pymoo_psi._names import asked_under_a_formulation
from pymoo_psi._validation import Received, Rows, counted, instance, integer, wrong_type
from pymoo_psi.plots._points import checked
from pymoo_psi.plots._style import Drawing, curves, legend_of, literal, panels
from pymoo_psi.table import TestTable

if TYPE_CHECKING:  # figures of tables need neither of these, nor pymoo and SciPy
    from pymoo_psi.comparison import Comparison
    from pymoo_psi.problems import Identification

_PANELS = 3  # side by side
# Indicators with their labels.
_INDICATORS = {
    "hypervolume": "hypervolume (share of the box)",
    "igd_plus": "IGD+ (units of N − U)",
    "epsilon": "additive epsilon (units of N − U)",
    "optimum_distance": "optimum distance (units of N − U)",
}


def plot_sensitivities(sensitivities: pd.DataFrame, *, title: str = "") -> Drawing:
    """Return bars of the first-order sensitivities with their bands, one panel for each column.

    Args:
        sensitivities: From :func:`pymoo_psi.table.sensitivities`.
        title: Subject of the tests, with which the caption begins.

    Raises:
        ArgumentTypeError: ``sensitivities`` is not such a frame.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> from pymoo_psi.table import sensitivities
        >>> table = investigate(VectorizedSphereChute(0.4), 256)
        >>> figure = plot_sensitivities(sensitivities(table, ["f1", "f2"]))
        >>> [ax.get_title() for ax in figure.axes]
        ['f1', 'f2']
    """
    index = getattr(sensitivities, "index", pd.Index([]))
    if list(index.names) != ["column", "variable"]:
        received = Received(type(sensitivities).__name__)
        raise wrong_type("sensitivities", "a frame from sensitivities(table)", received)
    columns = index.unique("column").tolist()
    variables = index.unique("variable").tolist()
    n_columns = min(_PANELS, max(len(columns), 1))
    height = 16 + 5.0 * len(variables)
    with panels(len(columns), n_columns, head=22, height=height) as (figure, axes):
        for ax, column in zip(axes, columns, strict=True):
            # A sensitivity is between 0 and 1; its estimate need not be.
            estimates = sensitivities.loc[column].loc[variables].clip(0, 1)
            _draw_sensitivities(ax, estimates)
            name = literal(column, 24)
            if estimates["first_order"].isna().all():
                name += ": constant"
            ax.set_title(name)
            ax.tick_params(labelleft=False)
        for ax in axes[::n_columns]:
            ax.tick_params(labelleft=True)
        figure.describe(
            title,
            "First-order sensitivities: the share of a column's variance that each variable "
            "explains alone, with 95 % bands. The rest of the variance is interaction.",
        )
    return figure


def _draw_sensitivities(ax: Axes, estimates: pd.DataFrame) -> None:
    """Draw a bar and its band for each variable, from top to bottom."""
    places = np.arange(len(estimates))
    ax.barh(places, estimates["first_order"], 0.62, color="#0072B2", linewidth=0)
    ax.hlines(places, estimates["lower"], estimates["upper"], color="black", linewidth=0.9)
    ax.set(xlim=(0, 1), xlabel="share of the variance", ylim=(len(places) - 0.4, -0.6))
    ax.set_yticks(places, [literal(name, 32) for name in estimates.index])
    ax.grid(visible=False, axis="y")


@asked_under_a_formulation
def plot_identification(
    problem: Identification,
    table: TestTable,
    *,
    best: int = 3,
    title: str = "",
) -> Drawing:
    """Return the best designs' curves over the measurements, one panel for each measured column.

    Args:
        problem: The model and its experiments.
        table: Its tests.
        best: Number of designs to draw, those nearest to the ideal point.
        title: Subject of the tests, with which the caption begins.

    Raises:
        ArgumentTypeError: ``problem`` is not an :class:`~pymoo_psi.Identification`, or ``table``
            not a test table.
        ArgumentValueError: ``best`` is below 1, or no design is feasible.

    Example:
        >>> import numpy as np, pandas as pd
        >>> from pymoo_psi import Identification, investigate
        >>> t = np.linspace(0, 5, 30)
        >>> measured = {"cooling": pd.DataFrame({"t": t, "T": np.exp(-t / 2)})}
        >>> def decay(parameters, data):
        ...     return np.exp(-parameters["rate"] * data["t"])
        >>> problem = Identification(decay, measured, {"rate": (0, 1)})
        >>> (ax,) = plot_identification(problem, investigate(problem, 15)).axes
        >>> ax.get_title(), ax.get_xlabel(), ax.get_ylabel()
        ('cooling', 't', 'T')
    """
    from pymoo_psi.problems import Identification

    instance("problem", problem, Identification)
    integer("best", best, minimum=1)
    ranking = checked(table).feasible_ranking()
    chosen = ranking.rows[ranking.by_place[:best]]
    pairs = []
    for name, data in problem.experiments.items():
        for column in data.columns[1:]:
            pairs.append((name, column))
    with panels(len(pairs), min(len(pairs), _PANELS)) as (figure, axes):
        for ax, (name, column) in zip(axes, pairs, strict=True):
            _draw_fits(ax, problem, table, chosen, name, column)
        legend_of(figure, axes, ncols=best + 1)
        figure.describe(title, "Measured values, and the curves of the best designs.")
    return figure


def _draw_fits(
    ax: Axes,
    problem: Identification,
    table: TestTable,
    rows: Rows,
    experiment: str,
    column: str,
) -> None:
    """Draw a measured column of an experiment, and what the model gives for some designs."""
    data = problem.experiments[experiment]
    time = data.columns[0]
    ax.plot(data[time], data[column], ".", color="0.55", markersize=3, label="measured")
    for row, style in zip(rows, curves(), strict=False):
        design = dict(zip(problem.variables, table.X[row].tolist(), strict=True))
        series = problem.series(design, experiment)
        style = style | {"marker": "", "label": table.names[row]}
        ax.plot(data[time], series[column], **style)
    ax.set(title=literal(experiment), xlabel=literal(time), ylabel=literal(column))


def plot_indicators(comparison: Comparison) -> Drawing:
    """Return the four indicators against evaluations, with medians as lines, quartiles as bands.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Raises:
        ArgumentTypeError: ``comparison`` is not a comparison.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> comparison = compare(
        ...     get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> print(*(ax.get_ylabel().split(" (")[0] for ax in plot_indicators(comparison).axes))
        hypervolume IGD+ additive epsilon optimum distance
    """
    from pymoo_psi.comparison import Comparison

    instance("comparison", comparison, Comparison, "compare(...) returns one")
    with panels(4, 2, height=61.0) as (figure, axes):
        for ax, indicator in zip(axes, _INDICATORS, strict=True):
            plot_indicator(comparison, indicator, ax)
        legend_of(figure, axes, Patch(color="0.8", label="bands: quartiles"), ncols=4)
        n_seeds = comparison.measures["seed"].dropna().nunique()
        seeds = counted(max(n_seeds, 1), "seed")
        budgets = ", ".join(map(str, comparison.evaluations))
        figure.describe(
            f"{comparison.problem}: quality against evaluations, medians and quartiles",
            f"{budgets} evaluations, {seeds}.",
        )
    return figure


def plot_indicator(comparison: Comparison, indicator: str, ax: Axes) -> None:
    """Draw the medians of an indicator as lines and the quartiles as bands.

    Infinite values are left out, and a line above the axes says so.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.
        ax: Axes to draw on.
    """
    frame = comparison.summary().set_index("algorithm")
    columns = [indicator, f"{indicator}_q1", f"{indicator}_q3"]
    values = frame[columns].to_numpy(float)
    finite = values[np.isfinite(values)]
    ax.set_xscale("log")
    if indicator != "hypervolume" and len(finite) and (finite > 0).all():
        ax.set_yscale("log")
    for name, style in zip(comparison.algorithms, curves(), strict=False):
        rows = frame.loc[[name]]
        median, lower, upper = rows[columns].replace(np.inf, np.nan).to_numpy(float).T
        x = rows["evaluations"].to_numpy(float)
        ax.fill_between(x, lower, upper, color=style["color"], alpha=0.18, linewidth=0)
        ax.plot(x, median, markersize=4.0, linewidth=0.9, label=literal(name, 30), **style)
    ax.set_xticks(comparison.evaluations, [str(n) for n in comparison.evaluations])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.margins(x=0.1)
    ax.set(xlabel="evaluations", ylabel=_INDICATORS[indicator])
    if len(finite) < values.size:
        ax.set_title("infinite values are not drawn", loc="right", fontsize=7)
