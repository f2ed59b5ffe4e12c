"""What is learned from tests: sensitivities, fits, comparisons."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from pymoo_psi._renamed import asked_under_a_formulation
from pymoo_psi._validation import counted, instance, integer, known_name
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.plots._points import checked
from pymoo_psi.plots._style import Drawing, curves, legend_of, literal, panels
from pymoo_psi.table import TestTable

if TYPE_CHECKING:  # what tests are drawn of needs neither, nor pymoo and SciPy
    from pymoo_psi.comparison import Comparison
    from pymoo_psi.problems import Identification

_PANELS = 3  # side by side
_MEANINGS = {
    "hypervolume": "hypervolume (share of the box)",
    "igd_plus": "IGD+ (units of N − U)",
    "epsilon": "additive epsilon (units of N − U)",
    "optimum_distance": "optimum distance (units of N − U)",
}


def plot_sensitivities(sensitivities: pd.DataFrame, *, title: str = "") -> Drawing:
    """Return bars of the first-order sensitivities with their bands, one panel to a column.

    Args:
        sensitivities: From :func:`pymoo_psi.table.sensitivities`.
        title: What was tested; begins the caption.

    Raises:
        ArgumentTypeError: ``sensitivities`` is no such frame.

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
    columns = sensitivities.index.unique("column").tolist()
    variables = sensitivities.index.unique("variable").tolist()
    wide, height = min(_PANELS, max(len(columns), 1)), 16 + 5.0 * len(variables)
    with panels(len(columns), wide, head=22, height=height) as (figure, axes):
        for k, (ax, column) in enumerate(zip(axes, columns, strict=True)):
            # An index is between 0 and 1; its estimate need not be.
            index = sensitivities.loc[column].loc[variables].clip(0, 1)
            place = np.arange(len(index))
            ax.barh(place, index["first_order"], 0.62, color="#0072B2", linewidth=0)
            ax.hlines(place, index["lower"], index["upper"], color="black", linewidth=0.9)
            ax.set(xlim=(0, 1), xlabel="share of the variance", ylim=(len(place) - 0.4, -0.6))
            ax.set_yticks(place, [literal(name, 32) for name in variables])
            ax.tick_params(labelleft=k % wide == 0)
            ax.grid(visible=False, axis="y")
            constant = ": constant" if index["first_order"].isna().all() else ""
            ax.set_title(literal(column, 24) + constant)
        what = "what share of the variance of a column each variable explains alone"
        rest = "with 95 % bands; what they lack to 1 is interaction."
        figure.describe(title, f"First-order sensitivities: {what}, {rest}")
    return figure


@asked_under_a_formulation
def plot_identification(
    problem: Identification,
    table: TestTable,
    *,
    best: int = 3,
    title: str = "",
) -> Drawing:
    """Return the best designs' curves over the measurements, one panel to a measured column.

    Args:
        problem: The model and its experiments.
        table: Its tests.
        best: How many designs are drawn, those of the highest ranks of efficiency.
        title: What was tested; begins the caption.

    Raises:
        ArgumentTypeError: ``problem`` is no :class:`~pymoo_psi.Identification`, or ``table`` no
            test table.
        ArgumentValueError: ``best`` is below 1, no design is feasible, or a limit does not fit.

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
    chosen = ranking.rows[ranking.order[:best]]
    pairs = [(n, column) for n, data in problem.experiments.items() for column in data.columns[1:]]
    with panels(len(pairs), min(len(pairs), _PANELS)) as (figure, axes):
        for ax, (name, column) in zip(axes, pairs, strict=True):
            data = problem.experiments[name]
            time = data.columns[0]
            ax.plot(data[time], data[column], ".", color="0.55", markersize=3, label="measured")
            for row, look in zip(chosen, curves(), strict=False):
                design = dict(zip(problem.variables, table.X[row].tolist(), strict=True))
                found = problem.series(design, name)
                ax.plot(data[time], found[column], **look | {"marker": ""}, label=table.names[row])
            ax.set(title=literal(name), xlabel=literal(time), ylabel=literal(column))
        legend_of(figure, axes, ncols=best + 1)
        figure.describe(title, "Measured values, and the curves of the best designs.")
    return figure


def plot_indicators(comparison: Comparison) -> Drawing:
    """Return the four indicators against evaluations: medians as lines, quartiles as bands.

    Args:
        comparison: From :func:`pymoo_psi.compare`.

    Raises:
        ArgumentTypeError: ``comparison`` is none.

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

    instance("comparison", comparison, Comparison, "compare(...) gives one")
    with panels(4, 2, height=61.0) as (figure, axes):
        for ax, indicator in zip(axes, _MEANINGS, strict=True):
            plot_indicator(comparison, indicator, ax)
        legend_of(figure, axes, Patch(color="0.8", label="bands: quartiles"), ncols=4)
        seeds = counted(max(comparison.measures["seed"].dropna().nunique(), 1), "seed")
        budgets = ", ".join(map(str, comparison.evaluations))
        what = f"{comparison.problem}: quality against evaluations, medians and quartiles"
        figure.describe(what, f"{budgets} evaluations, {seeds}.")
    return figure


def plot_indicator(comparison: Comparison, indicator: str, ax: Axes) -> None:
    """Draw the medians of an indicator as lines and the quartiles as bands.

    Infinite values are left out, and a line above the axes says so.

    Args:
        comparison: From :func:`pymoo_psi.compare`.
        indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.
        ax: Axes to draw on.

    Raises:
        ArgumentValueError: The indicator is unknown.
    """
    known_name("indicator", indicator, _MEANINGS)
    frame = comparison.summary().set_index("algorithm")
    columns = [indicator, f"{indicator}_q1", f"{indicator}_q3"]
    found = frame[columns].to_numpy(float)
    known = found[np.isfinite(found)]
    ax.set_xscale("log")
    if indicator != "hypervolume" and len(known) and (known > 0).all():
        ax.set_yscale("log")
    for name, look in zip(comparison.algorithms, curves(), strict=False):
        rows = frame.loc[[name]]
        median, lower, upper = rows[columns].replace(np.inf, np.nan).to_numpy(float).T
        x = rows["evaluations"].to_numpy(float)
        ax.fill_between(x, lower, upper, color=look["color"], alpha=0.18, linewidth=0)
        ax.plot(x, median, markersize=4.0, linewidth=0.9, label=literal(name, 30), **look)
    ax.set_xticks(comparison.evaluations, [str(n) for n in comparison.evaluations])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.margins(x=0.1)
    ax.set(xlabel="evaluations", ylabel=_MEANINGS[indicator])
    if len(known) < found.size:
        ax.set_title("infinite values are not drawn", loc="right", fontsize=7)
