"""The paper's figures 2 to 8, 180 mm wide, and as files beside each other in a folder.

The paper does not say which quantity is in which panel of Figure 7. Here the abscissa is the share
η of the way, and the panels are (a) speed of the centre and time, (b) spins, (c) slip velocity,
(d) friction force, (e) normal reactions.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import combinations
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pymoo_psi._validation import Received, counted, instance, invalid, known_name
from pymoo_psi.chute import MODELS, ChuteParameters, Trajectory, trajectory
from pymoo_psi.paper import (
    INITIAL_SPEEDS,
    Case,
    Reproduction,
    criterion_surfaces,
    salukvadze_functions,
)
from pymoo_psi.pareto import percent
from pymoo_psi.plots._style import (
    CURVES,
    Drawing,
    draw_points,
    labelled,
    legend_of,
    new_figure,
    save_figures,
)
from pymoo_psi.plots._tables import near_ranked, rank_groups

Array = NDArray[np.float64]

_MU = 0.4  # the paper's for Figures 7 and 8; it names none for Figures 3 to 6
_SURFACES_MU = (0.2, 0.6)
_UNITS = (
    "All quantities dimensionless: lengths over $L$, times over $(L/g)^{1/2}$, speeds over "
    "$(Lg)^{1/2}$, forces over $mg$."
)
_TRANSITION: dict[str, Any] = {"color": "0.35", "linestyle": ":", "linewidth": 1.0}

# Of each quantity the symbol, as mathematical text, and what it means.
QUANTITIES = {
    "u1": ("$u_1$", r"slope $\tan\,\alpha$"),
    "u2": ("$u_2$", "plane speed $v_P$"),
    "f1": ("$f_1$", "time"),
    "f2": ("$f_2$", "energy balance"),
    "f3": ("$f_3$", "height"),
    "f4": ("$f_4$", "plane speed"),
    # with a ring, as in the paper's Figure 3, since μ alone is the friction coefficient
    "mu1": (r"$\mu_1^\circ$", "distance to $U$"),
    "mu2": (r"$\mu_2^\circ$", "distance to line $UN$"),
    "mu3": (r"$\mu_3^\circ$", "distance along $UN$"),
}

# The figures of points; the title of each, and its coordinates.
_SPACES = {
    3: (r"by geometric criteria $\mu_1^\circ, \mu_2^\circ, \mu_3^\circ$", ("mu1", "mu2", "mu3")),
    4: ("in the design box", ("u1", "u2")),
    5: ("by objectives $f_1, f_2, f_3$", ("f1", "f2", "f3")),
    6: ("by objectives $f_1, f_2, f_4$", ("f1", "f2", "f4")),
}

_MODEL_NAMES = {
    "full": "full model (slip, then roll)",
    "rolling": "rolling model (rolls from the start)",
}


# The panels of Figure 7: the title, the symbol on the axis, and each curve's name.
_PANELS = (
    ("speed of the centre and time", "$v_C$, $t$", ("$v_C$, speed", "$t$, time")),
    ("spin of the sphere", r"$\omega$", (r"$\omega_X$", r"$\omega_Y$", r"$\omega_Z$")),
    ("slip velocity", "$v_A$", ("$v_{AX}$, along", "$v_{AY}$, across")),
    ("friction force", "$f_A$", ("$f_{AX}$, along", "$f_{AY}$, across")),
    ("normal reactions", "$n$", ("$n_A$, plane", "$n_B$, guide-wall")),
)


def paper_figures(
    reproduction: Reproduction, *, model: str = "full", numbers: Iterable[int] = range(2, 9)
) -> Iterator[tuple[int, Drawing]]:
    """Make the paper's figures one by one.

    Figure 2 is for μ = 0.2 and 0.6, Figures 3 to 8 for μ = 0.4, or for the first case of the model
    if there is none with it. Figure 7 shows the motion under the full model, with slip, of the
    design that is the Salukvadze optimum under ``model``.

    Args:
        reproduction: The ranked cases; Figure 8 takes as many test points as they do.
        model: ``"full"`` or ``"rolling"``.
        numbers: Which figures, 2 to 8.

    Yields:
        The number of each figure with the figure.

    Raises:
        ArgumentValueError: The model is unknown or has no case, or there is no such figure.
        ArgumentTypeError: ``reproduction`` is none.

    Example:
        >>> from pymoo_psi.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "full", 64),))
        >>> [(number, figure)] = paper_figures(small, numbers=[4])
        >>> figure.caption.split(";")[0]
        'Pareto-optimal points in the design box'
    """
    case = shown_case(instance("reproduction", reproduction, Reproduction), model)
    n = reproduction.n_points
    make: dict[int, Any] = {
        2: lambda: _surfaces_figure(model),
        **{number: partial(_points_figure, case, *space) for number, space in _SPACES.items()},
        7: lambda: _motion_figure(case),
        8: lambda: _functions_figure(
            salukvadze_functions(case.mu, model, n),
            # a smooth line needs fewer
            salukvadze_functions(case.mu, model, n, INITIAL_SPEEDS[::2], refined=True),
            n,
            case,
        ),
    }
    for number in numbers:
        if number not in make:
            raise invalid("numbers", "of figures, 2 to 8", number)
        yield number, make[number]()


def save_paper_figures(
    reproduction: Reproduction,
    directory: str | os.PathLike[str],
    *,
    model: str = "full",
    numbers: Iterable[int] = range(2, 9),
    dpi: int = 200,
    suffix: str = ".png",
) -> tuple[Path, ...]:
    """Write ``figure_2.png`` … ``figure_8.png``: all of them, or none if one cannot be made.

    Args:
        reproduction: As for :func:`paper_figures`.
        directory: An existing folder; files of these names in it are replaced.
        model: ``"full"`` or ``"rolling"``.
        numbers: Which figures, 2 to 8.
        dpi: Dots per inch; a page is 180 mm wide.
        suffix: ``".png"``, ``".pdf"`` or ``".svg"``. In the vector formats the thousands of
            unranked points and the surfaces stay pictures of ``dpi``, so that files stay small.

    Returns:
        The paths written.

    Raises:
        ArgumentValueError: The model is unknown or has no case, there is no such figure, or the
            suffix is another.
        OSError: The folder does not exist or cannot be written to.

    Example:
        >>> from pymoo_psi.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "full", 64),))
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_paper_figures(small, folder, numbers=[4])]
        ['figure_4.png']
    """
    figures = paper_figures(reproduction, model=model, numbers=numbers)
    named = ((f"figure_{number}", figure) for number, figure in figures)
    return save_figures(named, directory, dpi, suffix)


def shown_case(reproduction: Reproduction, model: str) -> Case:
    """Return the case of Figures 3 to 8: the paper's, or else the first.

    Example:
        >>> from pymoo_psi.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "full", 64),))
        >>> shown_case(small, "full").mu
        0.4
    """
    known_name("model", model, MODELS)
    found = [case for case in reproduction.cases if case.model == model]
    if not found:
        have = ", ".join(f"{case.model} {case.mu:g}" for case in reproduction.cases)
        received = Received(f"the cases {have or 'none'}")
        raise invalid("reproduction", f"one with cases of the {model} model", received)
    return next((case for case in found if np.isclose(case.mu, _MU)), found[0])


def _axis_label(name: str) -> str:
    return ", ".join(QUANTITIES[name])


def _subject(case: Case) -> str:
    return rf"{_MODEL_NAMES[case.model]}, $\mu$ = {case.mu:g}"


# Figure 2


def _surfaces_figure(model: str) -> Drawing:
    """Return the criteria of each friction coefficient, as surfaces with contours beside them."""
    with new_figure(58 * 2 * len(_SURFACES_MU), layout=None) as figure:
        figure.subplots_adjust(
            left=0.02, right=0.945, bottom=0.06, top=0.97, wspace=0.16, hspace=0.36
        )
        rows, told = 2 * len(_SURFACES_MU), []
        for k, mu in enumerate(_SURFACES_MU):
            u1, u2, criteria = criterion_surfaces(mu, model)
            for row, (name, f) in enumerate(zip(("f1", "f2"), criteria, strict=True), start=2 * k):
                # So that the colours' range is that of what there is.
                values = np.ma.masked_invalid(f)
                norm = PowerNorm(0.6, values.min(), values.max())
                same: dict[str, Any] = {"cmap": "viridis", "norm": norm}
                space = figure.add_subplot(rows, 2, 2 * row + 1, projection="3d")
                draw_surface(space, u1, u2, values, **same)
                plane = figure.add_subplot(rows, 2, 2 * row + 2)
                # As many levels as colours tell apart, dense where the criterion is flat.
                levels = norm.inverse(np.linspace(0, 1, 11))
                filled = plane.contourf(u1, u2, values, levels, **same)
                plane.contour(u1, u2, values, levels, colors="white", linewidths=0.5)
                plane.set(xlabel=_axis_label("u1"), ylabel=_axis_label("u2"))
                bar = figure.colorbar(filled, ax=plane, aspect=16, format="%.2g")
                bar.set_label(_axis_label(name))
                told.append(rf"({ascii_lowercase[2 * row]}, {ascii_lowercase[2 * row + 1]}) ")
                told[-1] += rf"{_axis_label(name)}, $\mu$ = {mu:g}"
        what = "Criteria over the design box, as surfaces and as contours"
        figure.describe(f"{what}; {_MODEL_NAMES[model]}", f"{'; '.join(told)}.", _UNITS)
    return figure


def draw_surface(axes: Any, u1: Array, u2: Array, f: Array, **look: Any) -> None:
    """Draw one criterion as a surface.

    Args:
        axes: Three-dimensional axes.
        u1: ``(n, n)`` slopes, growing along the first axis.
        u2: ``(n, n)`` speeds of the plane.
        f: ``(n, n)`` the criterion; masked values leave a hole.
        look: Colours.
    """
    axes.plot_surface(
        u1, u2, f, rcount=len(f), ccount=len(f), linewidth=0, antialiased=False, rasterized=True,
        **look,
    )  # fmt: skip
    axes.set_xlabel(_axis_label("u1"))
    axes.set_ylabel(_axis_label("u2"))
    axes.zaxis.set_major_locator(MaxNLocator(5))
    # One view for all, nearly along u2: the criteria rise or fall with u1, and from either end of
    # it one of them would hide behind its own edge.
    axes.view_init(elev=28, azim=-70)
    axes.set_box_aspect((1.5, 1.2, 0.9), zoom=1.15)


# Figures 3 to 6


def _points_figure(case: Case, space: str, names: tuple[str, ...]) -> Drawing:
    """Return all points by pairs of coordinates, and the part of the space with the ranked.

    A cloud in space would be seen from one side only; three pairs of coordinates show it whole.
    """
    groups, values = rank_groups(case.ranking), coordinates(case, names)
    pairs = tuple(combinations(range(len(names)), 2))
    rows, columns = (2, 3) if len(pairs) == 3 else (1, 2)
    with new_figure(150 if rows == 2 else 98) as figure:
        grid = figure.subplots(rows, columns)
        views = (np.ones(len(values), dtype=bool), near_ranked(values, groups))
        for line, shown in zip(grid.reshape(2, -1), views, strict=True):
            for ax, (j, k) in zip(line, pairs, strict=True):
                draw_points(ax, values[:, j], values[:, k], groups, shown)
                ax.set_xlabel(_axis_label(names[j]))
                ax.set_ylabel(_axis_label(names[k]))
                ax.locator_params(nbins=5)
        first, second = ("(a)", "(b)") if len(pairs) == 1 else ("(a) to (c)", "(d) to (f)")
        figure.describe(
            f"Pareto-optimal points {space}; {_subject(case)}",
            f"{first} all {counted(len(values), 'point')}; {second} detail around the ranked ones.",
            _UNITS,
        )
        legend_of(figure, labelled(grid.flat), ncols=3)
    return figure


def coordinates(case: Case, names: Sequence[str]) -> Array:
    """Return ``(n, k)`` values of a case: of u1, u2, f1 … f4 and μ1, μ2, μ3 (``mu1`` …)."""
    columns = {
        f"{letter}{k}": column
        for letter, matrix in (("u", case.X), ("f", case.F), ("mu", case.ranking.criteria))
        for k, column in enumerate(matrix.T, start=1)
    }
    return np.column_stack([columns[name] for name in names])


# Figure 7


def _motion_figure(case: Case) -> Drawing:
    """Return the five panels in three rows."""
    best = int(case.ranking.salukvadze[0])
    u1, v_p = case.X[best].tolist()
    way = trajectory(u1, v_p, ChuteParameters(mu=case.mu))
    with new_figure(155, layout=None) as figure:
        figure.subplots_adjust(
            left=0.08, right=0.975, bottom=0.065, top=0.965, wspace=0.26, hspace=0.46
        )
        *panels, sixth = figure.subplots(3, 2).ravel()
        sixth.remove()
        draw_motion(panels, way)
        figure.describe(
            rf"Transportation of the sphere, $\mu$ = {case.mu:g}: motion under the full model of "
            f"the Salukvadze optimum found under the {_MODEL_NAMES[case.model]}",
            *_facts(case, best, way),
        )
    return figure


def draw_motion(panels: Sequence[Axes], way: Trajectory) -> None:
    """Draw the five panels, with the transition from slip to rolling and the slip phase shaded.

    Each curve is interrupted at the transition, where the forces jump.
    """
    speed_and_time = np.column_stack([way.speed, way.time])
    columns = (speed_and_time, way.spin, way.slip_velocity, way.friction, way.normal)
    phases = [phase for phase in (way.slipping, ~way.slipping) if phase.any()]
    for axes, (title, ordinate, names), values in zip(panels, _PANELS, columns, strict=True):
        for name, curve, look in zip(names, values.T, CURVES, strict=False):
            line = {"color": look["color"], "linestyle": look["linestyle"]}
            for k, phase in enumerate(phases):
                label = "_nolegend_" if k else name
                axes.plot(way.eta[phase], curve[phase], label=label, **line)
        slip_end = float(way.eta.max()) if math.isnan(way.slip_end) else way.slip_end
        if slip_end > 0:
            axes.axvspan(0, slip_end, color="0.92", zorder=0, linewidth=0)
        if 0 < way.slip_end <= 1:
            # The caption says what the line is.
            axes.axvline(way.slip_end, label="_nolegend_", **_TRANSITION)
        axes.margins(y=0.12)
        axes.set_xlim(0, 1)
        axes.set_xlabel(r"$\eta$, share of the way (dimensionless)")
        axes.set_ylabel(f"{ordinate} (dimensionless)")
        axes.set_title(title, loc="left")
        axes.legend(fontsize=7)


def _facts(case: Case, best: int, way: Trajectory) -> list[str]:
    """Return what is known of the design in row ``best`` and of its motion."""
    u1, v_p = case.X[best].tolist()
    parameters = ChuteParameters(mu=case.mu)
    slip = "It slips (grey) all the way."
    if np.isfinite(way.slip_end):
        slip = (
            rf"It slips (grey) to $\eta_1$ = {way.slip_end:.3f} at $t_1$ = {way.slip_time:.3f}, "
            f"{percent(way.slip_time / way.time[-1])} of the time, and rolls from the dotted line."
        )
    return [
        f"Test point {case.test_point[best]}:",
        rf"$u_1$ = tan $\alpha$ = {u1:.4f}, $u_2$ = $v_P$ = {v_p:.4f},",
        f"$c$ = {parameters.c:g}, $r$ = {parameters.r:g}, no initial spin.",
        f"Time $t$(1) = {way.time[-1]:.4f}, exit speed $v_{{Cf}}$ = {way.speed[-1]:.4f}.",
        slip,
        _UNITS,
    ]


# Figure 8


def _functions_figure(optima: pd.DataFrame, refined: pd.DataFrame, n: int, case: Case) -> Drawing:
    """Return the time and the exit speed on the left, the other criteria on the right.

    The initial speed of ``case``, for which the other figures are, is marked.
    """
    with new_figure(76, layout=None) as figure:
        figure.subplots_adjust(left=0.08, right=0.975, bottom=0.14, top=0.94, wspace=0.22)
        c = ChuteParameters(mu=case.mu).c
        for ax, columns in zip(
            figure.subplots(1, 2), (["f1", "exit_speed"], ["f2", "f3", "f4"]), strict=True
        ):
            _draw_functions(ax, optima, refined, columns)
            ax.axvline(c, label=f"$c$ = {c:g}", **_TRANSITION)
            ax.legend(fontsize=7)
        ends = [
            f"{_FUNCTIONS[f][0]} from {refined[f].min():.3f} to {refined[f].max():.3f}"
            for f in ("f2", "f4", "f3")
        ]
        figure.describe(
            f"Salukvadze optima of {counted(n, 'test point')} (marks), and refined within the box "
            f"(lines), against the initial speed; {_subject(case)}",
            "The paper: high $f_3^S$ by almost constant $f_2^S$ and $f_4^S$. Here, refined:",
            f"{', '.join(ends)}.",
            _UNITS,
        )
    return figure


_FUNCTIONS = {
    "f1": ("$f_1^S$", "time"),
    "f2": ("$f_2^S$", "energy balance"),
    "f3": ("$f_3^S$", r"height $\tan\,\alpha$"),
    "f4": ("$f_4^S$", "plane speed $v_P$"),
    "exit_speed": ("$v_{Cf}^S$", "exit speed"),
}


def _draw_functions(
    axes: Axes, optima: pd.DataFrame, refined: pd.DataFrame, columns: Sequence[str]
) -> None:
    """Draw functions of the initial speed: test points as marks, refined optima as lines."""
    for name, look in zip(columns, CURVES, strict=False):
        style = {"color": look["color"], "linestyle": look["linestyle"], "linewidth": 1.2}
        axes.plot(refined["c"], refined[name], label=", ".join(_FUNCTIONS[name]), **style)
        axes.plot(optima["c"], optima[name], look["marker"], color=look["color"], markersize=2.6)
    axes.set_xlim(0, None)
    axes.set_xlabel("$c$, initial speed of the centre (dimensionless)")
    axes.set_ylabel(", ".join(_FUNCTIONS[name][0] for name in columns) + " (dimensionless)")
