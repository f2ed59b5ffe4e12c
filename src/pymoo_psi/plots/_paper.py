"""The paper's figures 2 to 8.

The paper does not say which quantity is in which panel of Figure 7. Here the abscissa is the share
η of the way, and the panels are (a) speed of the centre and time, (b) spins, (c) slip velocity,
(d) friction force, (e) normal reactions.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from pymoo_psi._validation import Array, Received, counted, invalid
from pymoo_psi.chute import ChuteParameters, ModelName, Trajectory, trajectory
from pymoo_psi.paper import Case, Reproduction, criterion_surfaces, salukvadze_functions
from pymoo_psi.plots._points import Coordinate, Points, groups_in_words
from pymoo_psi.plots._style import (
    ACCENT,
    BESIDE,
    Drawing,
    Style,
    add_key,
    add_letters,
    curves,
    head_axes,
    name_lines,
    new_figure,
    panels,
    view,
)

_MU = 0.4  # as in the paper's Figures 7 and 8; Figures 3 to 6 state none
_SURFACES_MU = (0.2, 0.6)
_N_LEVELS = 12  # colours tell no more levels apart
_UNITS = (
    "All quantities dimensionless: lengths over $L$, times over $(L/g)^{1/2}$, speeds over "
    "$(Lg)^{1/2}$, forces over $mg$."
)
_TRANSITION: Style = {"color": "0.35", "linestyle": ":", "linewidth": 1.0}

# Symbol, as mathematical text, and meaning of each variable, objective and geometric criterion.
_LABELS = {
    "u1": r"$u_1$, slope $\tan\,\alpha$",
    "u2": "$u_2$, plane speed $v_P$",
    "f1": "$f_1$, time",
    "f2": "$f_2$, energy balance",
    "f3": "$f_3$, height",
    "f4": "$f_4$, plane speed",
    # The ring is that of the paper's Figure 3: μ alone is the friction coefficient.
    "mu1": r"$\mu_1^\circ$, distance to $U$",
    "mu2": r"$\mu_2^\circ$, distance to line $UN$",
    "mu3": r"$\mu_3^\circ$, distance along $UN$",
}
# Title and coordinates of each figure of points.
_SPACES = {
    3: (r"by geometric criteria $\mu_1^\circ, \mu_2^\circ, \mu_3^\circ$", ("mu1", "mu2", "mu3")),
    4: ("by variables $u_1, u_2$", ("u1", "u2")),
    5: ("by objectives $f_1, f_2, f_3$", ("f1", "f2", "f3")),
    6: ("by objectives $f_1, f_2, f_4$", ("f1", "f2", "f4")),
}
_MODEL_NAMES = {
    "full": "full model (slip, then roll)",
    "rolling": "rolling model (rolls from the start)",
}


_UNRANKED = "of rank 0"
_OPTIMUM = "Salukvadze optimum"
# Groups of points, rarer ranks on top; ranks 1 and 2 do not occur, 6 is the optimum's.
_RANKS: dict[str, tuple[int, Style]] = {
    _UNRANKED: (0, {"marker": ".", "color": "0.4", "markersize": 4.5, "zorder": 2.0}),
    "of rank 3": (3, {"marker": "^", "color": "#9ECAE1", "markersize": 5.0, "zorder": 4.0}),
    "of rank 4": (4, {"marker": "s", "color": "#4292C6", "markersize": 3.4, "zorder": 3.0}),
    "of rank 5": (5, {"marker": "D", "color": "#08519C", "markersize": 5.0, "zorder": 5.0}),
    _OPTIMUM: (6, {"marker": "*", "color": ACCENT, "markersize": 11.0, "zorder": 6.0}),
}

# The panels of Figure 8: columns of salukvadze_functions.
_FUNCTIONS = (
    {"f1": "$f_1^S$, time", "exit_speed": "$v_{Cf}^S$, exit speed"},
    {
        "f2": "$f_2^S$, energy balance",
        "f3": r"$f_3^S$, height $\tan\,\alpha$",
        "f4": "$f_4^S$, plane speed $v_P$",
    },
)


def paper_figures(
    reproduction: Reproduction,
    *,
    model: ModelName = "rolling",
) -> Iterator[tuple[str, Drawing]]:
    """Make the paper's figures one by one; :func:`save_figures` writes them.

    Figure 2 is for μ = 0.2 and 0.6. Figures 3 to 8 are for μ = 0.4, or for the first case of the
    model if none has this μ. Figure 7 shows the motion under the full model, with slip, of the
    Salukvadze optimum under ``model``.

    Args:
        reproduction: The ranked cases; Figure 8 takes as many test points as they do.
        model: ``"rolling"``, from which the printed tables follow, or ``"full"``.

    Yields:
        The names ``figure_2`` to ``figure_8``, each with the figure.

    Raises:
        ArgumentValueError: The model is unknown or has no case.

    Example:
        >>> from pymoo_psi.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "rolling", 64),))
        >>> name, figure = next(paper_figures(small))
        >>> name, figure.caption.split(";")[0]
        ('figure_2', 'Criteria over the variables, as surfaces and as contours')
    """
    case = _case(reproduction, model)
    yield "figure_2", _surfaces_figure(model)
    for number, (title, coordinates) in _SPACES.items():
        yield f"figure_{number}", _points_figure(case, title, coordinates)
    yield "figure_7", _motion_figure(case)
    yield "figure_8", _functions_figure(case, reproduction.n_points)


def _case(reproduction: Reproduction, model: str) -> Case:
    """Return the case of Figures 3 to 8: the first with the paper's μ, or else the first."""
    cases = [case for case in reproduction.cases if case.model == model]
    if not cases:
        received = Received(repr(reproduction))
        raise invalid("reproduction", f"one with cases of the {model} model", received)
    return min(cases, key=lambda case: not np.isclose(case.mu, _MU))


def _subject(case: Case) -> str:
    """Return the model and the friction coefficient for a caption."""
    return rf"{_MODEL_NAMES[case.model]}, $\mu$ = {case.mu:g}"


# Figure 2


def _surfaces_figure(model: ModelName) -> Drawing:
    """Return Figure 2: the criteria as surfaces, with contours beside them."""
    place = 0
    with new_figure(232) as figure:
        for mu in _SURFACES_MU:
            u1, u2, criteria = criterion_surfaces(mu, model)
            for name, values in zip(("f1", "f2"), criteria, strict=True):
                space = figure.add_subplot(4, 2, place + 1, projection="3d")
                plane = figure.add_subplot(4, 2, place + 2)
                label = rf"{_LABELS[name]}, $\mu$ = {mu:g}"
                _draw_criterion(space, plane, u1, u2, values, label)
                place += 2
        add_letters(figure)
        figure.describe(
            f"Criteria over the variables, as surfaces and as contours; {_MODEL_NAMES[model]}",
            "The steps between contours are equal.",
            _UNITS,
        )
    return figure


def _draw_criterion(
    space: Any,
    plane: Axes,
    u1: Array,
    u2: Array,
    values: Array,
    label: str,
) -> None:
    """Draw ``(n, n)`` values over the variables: a surface in space, contours in the plane."""
    values = np.ma.masked_invalid(values)
    levels = MaxNLocator(_N_LEVELS).tick_values(values.min(), values.max())
    colours: Style = {"cmap": "viridis", "vmin": levels[0], "vmax": levels[-1]}

    n = len(u1)
    space.plot_surface(
        u1,
        u2,
        values,
        rcount=n,
        ccount=n,
        linewidth=0,
        antialiased=False,
        rasterized=True,
        **colours,
    )
    space.zaxis.set_major_locator(MaxNLocator(5))
    # One view for all, nearly along u2: the criteria increase or decrease with u1, and seen from
    # either end of u1 one of them would hide behind its own edge.
    space.view_init(elev=28, azim=-70)
    space.set_box_aspect((1.5, 1.2, 0.9), zoom=1.15)
    space.set(xlabel="$u_1$", ylabel="$u_2$")
    space.tick_params(pad=-3)
    space.xaxis.labelpad = space.yaxis.labelpad = -8

    filled = plane.contourf(u1, u2, values, levels, **colours)
    plane.contour(u1, u2, values, levels, colors="white", linewidths=0.5)
    plane.set(xlabel=_LABELS["u1"], ylabel=_LABELS["u2"])
    space.figure.colorbar(filled, ax=plane, aspect=16, label=label)


# Figures 3 to 6


def _points_figure(case: Case, space: str, names: tuple[str, ...]) -> Drawing:
    """Return one of Figures 3 to 6: all points over pairs of coordinates, and a detail of each.

    A cloud in space would be seen from one side only; three pairs of coordinates show it whole.
    """
    pairs = list(combinations(names, 2))
    ranked = case.ranking.rank > 0
    groups = {}
    for name, (rank, style) in _RANKS.items():
        groups[name] = (style, case.ranking.pareto & (case.ranking.rank == rank))
    coordinates = np.hstack([case.designs.X, case.designs.F, case.ranking.criteria])
    n_columns = max(len(pairs), 2)
    with panels(2 * len(pairs), n_columns, head=10.0, height=150.0 / n_columns) as (figure, axes):
        figure.is_divisible = True
        for part, shown in ((axes[: len(pairs)], ranked | True), (axes[len(pairs) :], ranked)):
            columns = {}
            for name, values in zip(_LABELS, coordinates.T, strict=True):
                columns[name] = Coordinate(values, view(values[shown]))
            for ax, (first, second) in zip(part, pairs, strict=False):
                Points(columns, groups).draw(ax, first, second)
                ax.xaxis.set_label_text(_LABELS[first])
                ax.yaxis.set_label_text(_LABELS[second])
        figure.fit(add_key, figure, axes[:1])
        points = counted(len(ranked), "point")
        add_letters(figure)
        figure.describe(
            f"Pareto-optimal points {space}; {_subject(case)}",
            f"First all {points}, then a detail around the ranked points: "
            f"{groups_in_words(groups)}.",
            _UNITS,
        )
    return figure


# Figure 7


def _motion_figure(case: Case) -> Drawing:
    """Return Figure 7: the motion of the optimum, with the slip phase shaded."""
    best = case.ranking.salukvadze[0]
    u1, v_p = case.designs.X[best].tolist()
    parameters = ChuteParameters(mu=case.mu)
    motion = trajectory(u1, v_p, parameters)
    of_centre = np.column_stack([motion.speed, motion.time])
    quantities = {
        "speed and time": (("$v_C$, speed", "$t$, time"), of_centre),
        "spin": ((r"$\omega_X$", r"$\omega_Y$", r"$\omega_Z$"), motion.spin),
        "slip velocity": (("$v_{AX}$, along", "$v_{AY}$, across"), motion.slip_velocity),
        "friction force": (("$f_{AX}$, along", "$f_{AY}$, across"), motion.friction),
        "normal reactions": (("$n_A$, plane", "$n_B$, guide-wall"), motion.normal),
    }
    with panels(len(quantities), 2, head=5.0, height=42.0) as (figure, axes):
        figure.is_divisible = True
        for ax, (name, (curve_names, values)) in zip(axes, quantities.items(), strict=True):
            _draw_motion(ax, motion, values, curve_names)
            ax.set_ylabel(name)
            head_axes(ax)
        title = (
            rf"Transportation of the sphere, $\mu$ = {case.mu:g}: motion under the full model for "
            f"the Salukvadze optimum under the {_MODEL_NAMES[case.model]}"
        )
        design = rf"$u_1$ = tan $\alpha$ = {u1:.4f}, $u_2$ = $v_P$ = {v_p:.4f}"
        start = f"$c$ = {parameters.c:g}, $r$ = {parameters.r:g}, no initial spin."
        time = motion.time[-1]
        speed = motion.speed[-1]
        end = f"Time $t$(1) = {time:.4f}, exit speed $v_{{Cf}}$ = {speed:.4f}."
        add_letters(figure)
        figure.describe(
            title,
            f"Test point {case.designs.numbers[best]}: {design}, {start}",
            end,
            "It slips where the ground is grey.",
            _UNITS,
        )
    return figure


def _draw_motion(ax: Axes, motion: Trajectory, values: Array, names: tuple[str, ...]) -> None:
    """Draw the ``(n, k)`` values of k curves over the way, with the slip phase shaded.

    Each curve is interrupted at the transition to rolling, where the forces jump.
    """
    n_slipping = motion.slipping.sum()
    eta = np.insert(motion.eta, n_slipping, np.nan)
    values = np.insert(values, n_slipping, np.nan, axis=0)
    for name, curve, style in zip(names, values.T, curves(), strict=False):
        ax.plot(eta, curve, label=name, **style | {"marker": ""})
    name_lines(ax)
    slip_end = np.nan_to_num(motion.slip_end, nan=1.0)
    ax.axvspan(0, slip_end, color="0.92", zorder=0, linewidth=0)
    if slip_end < 1.0:
        ax.axvline(slip_end, **_TRANSITION)
    ax.margins(y=0.12)
    ax.set(xlim=(0, 1), xlabel=r"$\eta$, share of the way")


# Figure 8


def _functions_figure(case: Case, n: int) -> Drawing:
    """Return Figure 8: the optimum of ``n`` test points against the initial speed.

    The speed of ``case`` is marked.
    """
    functions = salukvadze_functions(case.mu, case.model, n)
    speed = ChuteParameters(mu=case.mu).c
    with panels(len(_FUNCTIONS), 2, head=10.0, height=70.0) as (figure, axes):
        figure.is_divisible = True
        styles = curves()
        for ax, labels in zip(axes, _FUNCTIONS, strict=True):
            _draw_functions(ax, functions, labels, styles)
            name_lines(ax)
            ax.axvline(speed, **_TRANSITION)
            ax.annotate(f"$c$ = {speed:g}", (speed, 1), (3, -8), ax.get_xaxis_transform(), **BESIDE)
        add_letters(figure)
        figure.describe(
            f"Salukvadze optima of {counted(n, 'test point')} against the initial speed, in steps "
            f"from one test point to another; {_subject(case)}",
            "The paper: high $f_3^S$ by almost constant $f_2^S$ and $f_4^S$.",
            _UNITS,
        )
    return figure


def _draw_functions(
    ax: Axes, functions: pd.DataFrame, labels: dict[str, str], styles: Iterator[Style]
) -> None:
    """Draw columns of a frame against the initial speed, each in the next style."""
    for name, label in labels.items():
        style = next(styles) | {"marker": ""}
        # One test point is the optimum for several speeds, which gives steps.
        ax.step(functions["c"], functions[name], label=label, where="mid", **style)
    ax.set_ylabel(", ".join(label.split(",")[0] for label in labels.values()))
    head_axes(ax)
    ax.set(xlim=(0, None), xlabel="$c$, initial speed of the centre")
