"""The paper's figures 2 to 8 as pages, 180 mm wide, and as files beside each other in a folder.

The paper does not say which quantity is in which panel of Figure 7. Here the abscissa is the share
η of the way, and the panels are (a) speed of the centre and time, (b) spins, (c) slip velocity,
(d) friction force, (e) normal reactions.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pymoo_psi._markers import MARKERS
from pymoo_psi._validation import Received, counted, instance, invalid, known_name
from pymoo_psi.chute import MODELS, ChuteParameters, Trajectory
from pymoo_psi.paper import Case, Reproduction
from pymoo_psi.paper._figures import (
    CriterionSurfaces,
    RankedPoints,
    SalukvadzeFunctions,
    criterion_surfaces,
    optimal_motion,
    ranked_points,
    salukvadze_functions,
)
from pymoo_psi.plots._style import (
    CURVES,
    enlarge_markers,
    new_page,
    save_pages,
)

Array = NDArray[np.float64]

_MU = 0.4  # the paper's for Figures 7 and 8; it names none for Figures 3 to 6
_SURFACES_MU = (0.2, 0.6)
_TITLE_PAD = 29.0  # points between axes and title, room for a legend of two rows
_TRANSITION: dict[str, Any] = {"color": "0.35", "linestyle": ":", "linewidth": 1.0}

# Of each quantity the symbol, as mathematical text, and what it means.
QUANTITIES = {
    "u1": ("$u_1$", r"slope $\tan\,\alpha$"),
    "u2": ("$u_2$", "plane speed $v_P$"),
    "f1": ("$f_1$", "time"),
    "f2": ("$f_2$", "energy balance"),
    "f3": ("$f_3$", "height"),
    "f4": ("$f_4$", "plane speed"),
    "mu1": (r"$\mu_1$", "distance to $U$"),
    "mu2": (r"$\mu_2$", "distance to line $UN$"),
    "mu3": (r"$\mu_3$", "distance along $UN$"),
}

# The figures of points; the title of each, and its coordinates.
_SPACES = {
    3: (r"geometric criteria $\mu_1, \mu_2, \mu_3$", ("mu1", "mu2", "mu3")),
    4: ("", ("u1", "u2")),
    5: ("objectives $f_1, f_2, f_3$", ("f1", "f2", "f3")),
    6: ("objectives $f_1, f_2, f_4$", ("f1", "f2", "f4")),
}

# The geometric criteria lie on the cone μ1² = μ2² + μ3², near the plane μ1 = μ3: seen from there.
_CONE_VIEW = (34, -155)

_MODEL_NAMES = {
    "full": "full model (slip, then roll)",
    "rolling": "rolling model (rolls from the start)",
}


class _Panel(NamedTuple):
    """A panel of Figure 7: its title, the symbol on its axis, and each curve's name."""

    title: str
    ordinate: str
    curves: tuple[str, ...]


_PANELS = (
    _Panel("(a) speed of the centre and time", "$v_C$, $t$", ("$v_C$, speed", "$t$, time")),
    _Panel("(b) spin of the sphere", r"$\omega$", (r"$\omega_X$", r"$\omega_Y$", r"$\omega_Z$")),
    _Panel("(c) slip velocity", "$v_A$", ("$v_{AX}$, along", "$v_{AY}$, across")),
    _Panel("(d) friction force", "$f_A$", ("$f_{AX}$, along", "$f_{AY}$, across")),
    _Panel("(e) normal reactions", "$n$", ("$n_A$, plane", "$n_B$, guide-wall")),
)


def paper_figures(
    reproduction: Reproduction, *, model: str = "full", numbers: Iterable[int] = range(2, 9)
) -> Iterator[tuple[int, Figure]]:
    """Make the paper's figures one by one.

    Figures 3 to 8 are for μ = 0.4. Figure 7 shows the motion under the full model, with slip, of
    the design that is the Salukvadze optimum under ``model``.

    Args:
        reproduction: The ranked cases; Figure 8 takes as many test points as they do.
        model: ``"full"`` or ``"rolling"``.
        numbers: Which figures, 2 to 8.

    Yields:
        The number of each figure with the figure.

    Raises:
        ArgumentValueError: The model is unknown or has no case with μ = 0.4, or there is no such
            figure.
        ArgumentTypeError: ``reproduction`` is none.

    Example:
        >>> from pymoo_psi.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "full", 64),))
        >>> [(number, figure)] = paper_figures(small, numbers=[4])
        >>> figure.get_suptitle().splitlines()[0]
        'Pareto-optimal points in the design box'
    """
    case = _case_of(instance("reproduction", reproduction, Reproduction), model)
    make: dict[int, Any] = {
        2: lambda: _surfaces_page([criterion_surfaces(mu, model) for mu in _SURFACES_MU]),
        **{number: partial(_points_page, case, *space) for number, space in _SPACES.items()},
        7: lambda: _motion_page(case),
        8: lambda: _functions_page(
            salukvadze_functions(_MU, model, reproduction.n_points), reproduction.n_points
        ),
    }
    for number in numbers:
        if number not in make:
            raise invalid("numbers", "of figures, 2 to 8", number)
        yield number, make[number]()


def save_figures(
    reproduction: Reproduction,
    directory: str | os.PathLike[str],
    *,
    model: str = "full",
    dpi: int = 200,
) -> tuple[Path, ...]:
    """Write ``figure_2.png`` … ``figure_8.png``: all of them, or none if one cannot be made.

    Args:
        reproduction: As for :func:`paper_figures`.
        directory: An existing folder; files of these names in it are replaced.
        model: ``"full"`` or ``"rolling"``.
        dpi: Dots per inch; a page is 180 mm wide.

    Returns:
        The paths written.

    Raises:
        ArgumentValueError: The model is unknown or has no case with μ = 0.4.
        OSError: The folder does not exist or cannot be written to.

    Example:
        >>> from pymoo_psi.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "full", 64),))
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.stem for path in save_figures(small, folder, dpi=20)]
        ['figure_2', 'figure_3', 'figure_4', 'figure_5', 'figure_6', 'figure_7', 'figure_8']
    """
    figures = paper_figures(reproduction, model=model)
    pages = ((f"figure_{number}.png", figure) for number, figure in figures)
    return save_pages(pages, directory, dpi)


def _case_of(reproduction: Reproduction, model: str) -> Case:
    known_name("model", model, MODELS)
    for case in reproduction.cases:
        if case.model == model and np.isclose(case.mu, _MU):
            return case
    have = ", ".join(f"{case.model} {case.mu:g}" for case in reproduction.cases)
    received = Received(f"the cases {have or 'none'}")
    raise invalid("reproduction", f"one with the case {model} {_MU:g}", received)


def _axis_label(name: str) -> str:
    return ", ".join(QUANTITIES[name])


def _subject(model: str, mu: float) -> str:
    return rf"{_MODEL_NAMES[model]}, $\mu$ = {mu:g}"


def _legend_above(axes: Axes) -> None:
    """Put a legend of two rows between the axes and their title, which is ``_TITLE_PAD`` away."""
    axes.legend(
        loc="lower left", bbox_to_anchor=(0, 0.98), ncols=2, borderpad=0, borderaxespad=0.3,
        columnspacing=1.5, handlelength=2.6, handletextpad=0.5, labelspacing=0.45,
    )  # fmt: skip


# Figure 2


def _surfaces_page(cases: Sequence[CriterionSurfaces]) -> Figure:
    """Return f1 on the left and f2 on the right, with one row for every friction coefficient."""
    with new_page(12 + 78 * len(cases), layout=None) as figure:
        figure.subplots_adjust(
            left=0.0, right=0.935, bottom=0.03, top=0.92, wspace=0.08, hspace=0.02
        )
        grid = figure.subplots(len(cases), 2, squeeze=False, subplot_kw={"projection": "3d"})
        for letter, row, surfaces in zip("abcdef", grid, cases, strict=False):
            for ax, name, f in zip(row, ("f1", "f2"), surfaces.f, strict=True):
                draw_surface(ax, surfaces.u1, surfaces.u2, f)
                ax.set_zlabel(_axis_label(name))
                title = rf"({letter}) $\mu$ = {surfaces.mu:g}: {_axis_label(name)}"
                ax.set_title(title, y=0.97)
        figure.suptitle(
            f"Criteria over the design box (all quantities dimensionless)\n"
            f"{_MODEL_NAMES[cases[0].model]}"
        )
    return figure


def draw_surface(axes: Any, u1: Array, u2: Array, f: Array) -> None:
    """Draw one criterion as a surface, shaded by its value, seen from its lower side.

    Args:
        axes: Three-dimensional axes.
        u1: ``(n, n)`` slopes, growing along the first axis.
        u2: ``(n, n)`` speeds of the plane.
        f: ``(n, n)`` the criterion; NaN leaves a hole.
    """
    values = np.ma.masked_invalid(f)  # so that the colours' range is that of what there is
    axes.plot_surface(
        u1, u2, values, cmap="viridis", norm=PowerNorm(0.6, values.min(), values.max()),
        rcount=len(f), ccount=len(f), linewidth=0.12, edgecolor="0.2",
    )  # fmt: skip
    axes.set_xlabel(_axis_label("u1"))
    axes.set_ylabel(_axis_label("u2"))
    # From its higher side a surface would hide what is behind.
    falls = values[0].mean() > values[-1].mean()  # along u1
    axes.view_init(elev=26, azim=-40 if falls else 130)
    axes.set_box_aspect(None, zoom=0.88)


# Figures 3 to 6


def _points_page(case: Case, space: str, names: tuple[str, ...]) -> Figure:
    """Return all points on the left, and on the right the part of the space with the ranked."""
    points = ranked_points(case, names)
    in_space = len(names) == 3
    with new_page(98, layout=None) as figure:
        if in_space:
            figure.subplots_adjust(left=0.045, right=0.945, bottom=0.15, top=0.89, wspace=0.10)
        else:
            figure.subplots_adjust(left=0.075, right=0.985, bottom=0.27, top=0.83, wspace=0.24)
        sides = figure.subplots(1, 2, subplot_kw={"projection": "3d"} if in_space else {})
        height = 0.95 if in_space else None
        for ax, shown, title in zip(
            sides,
            (points, points.nearby()),
            (f"all {counted(len(points.values), 'point')}", "detail around the ranked points"),
            strict=True,
        ):
            draw_points(ax, shown)
            ax.set_title(title, y=height)
        what = f"by {space}" if space else "in the design box"
        note = " (all quantities dimensionless)" if in_space else ""
        figure.suptitle(f"Pareto-optimal points {what}{note}\n{_subject(case.model, case.mu)}")
        entries = sides[0].get_legend_handles_labels()
        enlarge_markers(figure.legend(*entries, loc="lower center", ncols=3))
    return figure


def draw_points(axes: Any, points: RankedPoints) -> None:
    """Draw the points, each rank with a colour and a marker of its own, the optimum as a star."""
    in_space = len(points.names) == 3
    for name, members in points.groups().items():
        marker = MARKERS[6 if points.optimum[members[0]] else int(points.rank[members[0]])]
        plain = name == "unranked"
        axes.plot(
            *points.values[members].T,
            linestyle="none",
            marker=marker.shape,
            markersize=marker.size,
            markerfacecolor=marker.colour,
            markeredgecolor="none" if plain else "black",
            markeredgewidth=0.5,
            zorder=marker.level,
            label=f"{name} ({len(members)})",
            rasterized=plain,
        )
    for letter, name in zip("xyz", points.names, strict=False):
        axis = getattr(axes, f"{letter}axis")
        axis.set_label_text(_axis_label(name) + ("" if in_space else " (dimensionless)"))
        axis.set_major_locator(MaxNLocator(5))
    if in_space:
        elevation, azimuth = _CONE_VIEW if points.names[0] == "mu1" else (24, -60)
        axes.view_init(elev=elevation, azim=azimuth)
        axes.set_box_aspect(None, zoom=0.88)


# Figure 7


def _motion_page(case: Case) -> Figure:
    """Return the five panels in three rows, and in the sixth place what is known of the design."""
    best, way = optimal_motion(case)
    with new_page(200, layout=None) as figure:
        figure.subplots_adjust(
            left=0.08, right=0.975, bottom=0.055, top=0.865, wspace=0.26, hspace=0.72
        )
        *panels, facts = figure.subplots(3, 2).ravel()
        draw_motion(panels, way)
        facts.set_axis_off()
        facts.text(
            0.0, 1.2, _facts(case, best, way), va="top", linespacing=1.6,
            transform=facts.transAxes,
        )  # fmt: skip
        figure.suptitle(
            rf"Transportation of the sphere, $\mu$ = {case.mu:g}: motion under the full model"
            f"\nof the Salukvadze optimum found under the {_MODEL_NAMES[case.model]}"
        )
    return figure


def draw_motion(panels: Sequence[Axes], way: Trajectory) -> None:
    """Draw the five panels, with the transition from slip to rolling and the slip phase shaded.

    Each curve is interrupted at the transition, where the forces jump.
    """
    speed_and_time = np.column_stack([way.speed, way.time])
    columns = (speed_and_time, way.spin, way.slip_velocity, way.friction, way.normal)
    phases = [phase for phase in (way.slipping, ~way.slipping) if phase.any()]
    for axes, panel, values in zip(panels, _PANELS, columns, strict=True):
        for name, curve, look in zip(panel.curves, values.T, CURVES, strict=False):
            line = {"color": look["color"], "linestyle": look["linestyle"]}
            for k, phase in enumerate(phases):
                label = "_nolegend_" if k else name
                axes.plot(way.eta[phase], curve[phase], label=label, **line)
        slip_end = float(way.eta.max()) if math.isnan(way.slip_end) else way.slip_end
        if slip_end > 0:
            axes.axvspan(0, slip_end, color="0.92", zorder=0, linewidth=0)
        if 0 < way.slip_end <= 1:
            text = rf"$\eta_1$ = {way.slip_end:.3f}, $t_1$ = {way.slip_time:.3f}"
            axes.axvline(way.slip_end, label=text, **_TRANSITION)
        axes.margins(y=0.08)
        axes.set_xlim(0, 1)
        axes.set_xlabel(r"$\eta$, share of the way (dimensionless)")
        axes.set_ylabel(f"{panel.ordinate} (dimensionless)")
        axes.set_title(f"{panel.title}, full model", loc="left", pad=_TITLE_PAD)
        _legend_above(axes)


def _facts(case: Case, best: int, way: Trajectory) -> str:
    """Return what is known of the design in row ``best`` and of its motion, line by line."""
    u1, v_p = case.X[best].tolist()
    parameters = ChuteParameters(mu=case.mu)
    slip = ["slips (grey) all the way"]
    if np.isfinite(way.slip_end):
        slip = [
            r"slips (grey) up to $\eta_1$, $t_1$ (dotted line), then rolls:",
            f"slip takes {way.slip_end:.1%} of the way "
            f"and {way.slip_time / way.time[-1]:.1%} of the time",
        ]
    lines = [
        f"Salukvadze optimum: test point {case.test_point[best]}",
        rf"$u_1$ = tan $\alpha$ = {u1:.4f},  $u_2$ = $v_P$ = {v_p:.4f}",
        f"$c$ = {parameters.c:g},  $r$ = {parameters.r:g},  no initial spin",
        "",
        f"time $t$(1) = {way.time[-1]:.4f},  exit speed $v_{{Cf}}$ = {way.speed[-1]:.4f}",
        *slip,
        "",
        "All quantities dimensionless:",
        r"lengths over $L$, times over $(L/g)^{1/2}$,",
        r"speeds over $(Lg)^{1/2}$, forces over $mg$",
    ]
    return "\n".join(lines)


# Figure 8


def _functions_page(functions: SalukvadzeFunctions, n_points: int) -> Figure:
    """Return the time and the exit speed on the left, the other criteria on the right."""
    with new_page(88, layout=None) as figure:
        figure.subplots_adjust(left=0.08, right=0.975, bottom=0.13, top=0.76, wspace=0.22)
        left, right = figure.subplots(1, 2)
        f1, f2, f3, f4 = functions.F.T
        exit_speed = functions.exit_speed
        draw_functions(left, functions.c, {
            ("$f_1^S$", "time"): f1, ("$v_{Cf}^S$", "exit speed"): exit_speed,
        })  # fmt: skip
        draw_functions(right, functions.c, {
            ("$f_2^S$", "energy balance"): f2, ("$f_3^S$", r"height $\tan\,\alpha$"): f3,
            ("$f_4^S$", "plane speed $v_P$"): f4,
        })  # fmt: skip
        figure.suptitle(
            f"Salukvadze optima of {counted(n_points, 'test point')} against the initial speed\n"
            f"{_subject(functions.model, functions.mu)}"
        )
    return figure


def draw_functions(axes: Axes, c: Array, curves: dict[tuple[str, str], Array]) -> None:
    """Draw one to three functions against c, by symbol and meaning, with the paper's c marked."""
    for names, values, look in zip(curves, curves.values(), CURVES, strict=False):
        axes.plot(c, values, label=", ".join(names), markersize=3.0, linewidth=1.0, **look)
    paper_c = ChuteParameters(mu=_MU).c
    axes.axvline(paper_c, label=f"$c$ = {paper_c:g}", **_TRANSITION)
    axes.set_xlim(0, None)
    axes.set_xlabel("$c$, initial speed of the centre (dimensionless)")
    axes.set_ylabel(", ".join(symbol for symbol, _ in curves) + " (dimensionless)")
    _legend_above(axes)
