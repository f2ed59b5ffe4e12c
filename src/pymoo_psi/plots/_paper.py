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
from matplotlib.colors import PowerNorm
from matplotlib.ticker import MaxNLocator

from pymoo_psi._validation import Received, counted, instance, invalid, known_name
from pymoo_psi.chute import MODELS, ChuteParameters, trajectory
from pymoo_psi.paper import Case, Reproduction, criterion_surfaces, salukvadze_functions
from pymoo_psi.pareto import percent
from pymoo_psi.plots._points import Column, Points, ranked_groups
from pymoo_psi.plots._style import Drawing, curves, legend_of, new_figure, panels, view

_MU = 0.4  # the paper's for Figures 7 and 8; it names none for Figures 3 to 6
_SURFACES_MU = (0.2, 0.6)
_UNITS = (
    "All quantities dimensionless: lengths over $L$, times over $(L/g)^{1/2}$, speeds over "
    "$(Lg)^{1/2}$, forces over $mg$."
)
_TRANSITION: dict[str, Any] = {"color": "0.35", "linestyle": ":", "linewidth": 1.0}

# Of each quantity the symbol, as mathematical text, and what it means.
_LABELS = {
    "u1": r"$u_1$, slope $\tan\,\alpha$",
    "u2": "$u_2$, plane speed $v_P$",
    "f1": "$f_1$, time",
    "f2": "$f_2$, energy balance",
    "f3": "$f_3$, height",
    "f4": "$f_4$, plane speed",
    # with a ring, as in the paper's Figure 3, since μ alone is the friction coefficient
    "mu1": r"$\mu_1^\circ$, distance to $U$",
    "mu2": r"$\mu_2^\circ$, distance to line $UN$",
    "mu3": r"$\mu_3^\circ$, distance along $UN$",
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
# The panels of Figure 8: columns of salukvadze_functions.
_FUNCTIONS: tuple[dict[str, str], ...] = (
    {"f1": "$f_1^S$, time", "exit_speed": "$v_{Cf}^S$, exit speed"},
    {
        "f2": "$f_2^S$, energy balance",
        "f3": r"$f_3^S$, height $\tan\,\alpha$",
        "f4": "$f_4^S$, plane speed $v_P$",
    },
)


def paper_figures(
    reproduction: Reproduction, *, model: str = "full"
) -> Iterator[tuple[str, Drawing]]:
    """Make the paper's figures one by one; :func:`save_figures` writes them.

    Figure 2 is for μ = 0.2 and 0.6, Figures 3 to 8 for μ = 0.4, or for the first case of the model
    if there is none with it. Figure 7 shows the motion under the full model, with slip, of the
    design that is the Salukvadze optimum under ``model``.

    Args:
        reproduction: The ranked cases; Figure 8 takes as many test points as they do.
        model: ``"full"`` or ``"rolling"``.

    Yields:
        The names ``figure_2`` to ``figure_8``, each with the figure.

    Raises:
        ArgumentValueError: The model is unknown or has no case.
        ArgumentTypeError: ``reproduction`` is none.

    Example:
        >>> from pymoo_psi.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "full", 64),))
        >>> name, figure = next(paper_figures(small))
        >>> name, figure.caption.split(";")[0]
        ('figure_2', 'Criteria over the design box, as surfaces and as contours')
    """
    case = shown_case(instance("reproduction", reproduction, Reproduction), model)
    yield "figure_2", _surfaces_figure(model)
    for number in _SPACES:
        yield f"figure_{number}", _points_figure(case, *_SPACES[number])
    yield "figure_7", _motion_figure(case)
    yield "figure_8", _functions_figure(case, reproduction.n_points)


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
        received = Received(repr(reproduction))
        raise invalid("reproduction", f"one with cases of the {model} model", received)
    return next((case for case in found if np.isclose(case.mu, _MU)), found[0])


def _subject(case: Case) -> str:
    return rf"{_MODEL_NAMES[case.model]}, $\mu$ = {case.mu:g}"


def _surfaces_figure(model: str) -> Drawing:
    """Return Figure 2, the criteria as surfaces, and as contours beside them."""
    with new_figure(232) as figure:
        rows, parts = 2 * len(_SURFACES_MU), []
        for row in range(rows):
            mu, name = _SURFACES_MU[row // 2], ("f1", "f2")[row % 2]
            u1, u2, criteria = criterion_surfaces(mu, model)
            # So that the colours' range is that of what there is, from 0.00 and not 1e-7 on.
            values = np.ma.masked_invalid(criteria[row % 2])
            norm = PowerNorm(0.6, np.floor(100 * values.min()) / 100, values.max())
            same: dict[str, Any] = {"cmap": "viridis", "norm": norm}
            space: Any = figure.add_subplot(rows, 2, 2 * row + 1, projection="3d")
            space.plot_surface(
                u1, u2, values, rcount=len(u1), ccount=len(u1), linewidth=0, antialiased=False,
                rasterized=True, **same,
            )  # fmt: skip
            space.zaxis.set_major_locator(MaxNLocator(5))
            # One view for all, nearly along u2: the criteria rise or fall with u1, and from either
            # end of it one of them would hide behind its own edge.
            space.view_init(elev=28, azim=-70)
            space.set_box_aspect((1.5, 1.2, 0.9), zoom=1.15)
            plane = figure.add_subplot(rows, 2, 2 * row + 2)
            # As many levels as colours tell apart, dense where the criterion is flat.
            levels = norm.inverse(np.linspace(0, 1, 11))
            filled = plane.contourf(u1, u2, values, levels, **same)
            plane.contour(u1, u2, values, levels, colors="white", linewidths=0.5)
            plane.set(xlabel=_LABELS["u1"], ylabel=_LABELS["u2"])
            space.set(xlabel="$u_1$", ylabel="$u_2$")
            figure.colorbar(filled, ax=plane, aspect=16, format="%.2g").set_label(_LABELS[name])
            letters = "abcdefgh"[2 * row : 2 * row + 2]
            parts.append(rf"({letters[0]}, {letters[1]}) {_LABELS[name]}, $\mu$ = {mu:g}")
        what = f"Criteria over the design box, as surfaces and as contours; {_MODEL_NAMES[model]}"
        figure.describe(what, f"{'; '.join(parts)}.", _UNITS)
    return figure


def _points_figure(case: Case, space: str, names: tuple[str, ...]) -> Drawing:
    """Return Figures 3 to 6, all points by pairs of coordinates, and the part with the ranked.

    A cloud in space would be seen from one side only; three pairs of coordinates show it whole.
    """
    matrices = (("u", case.designs.X), ("f", case.designs.F), ("mu", case.ranking.criteria))
    values = {
        f"{letter}{k}": column
        for letter, matrix in matrices
        for k, column in enumerate(matrix.T, start=1)
    }
    groups, ranked = ranked_groups(case.ranking), case.ranking.rank > 0
    every = np.ones_like(ranked)
    pairs = [*combinations(names, 2)]
    wide = max(len(pairs), 2)
    with panels(2 * len(pairs), wide, height=150.0 / wide) as (figure, axes):
        for shown, part in ((every, axes[: len(pairs)]), (ranked, axes[len(pairs) :])):
            columns = {name: Column(values[name], view(values[name][shown])) for name in names}
            for ax, (first, second) in zip(part, pairs, strict=True):
                Points(columns, groups).draw(ax, first, second)
                ax.set(xlabel=_LABELS[first], ylabel=_LABELS[second])
        legend_of(figure, axes, fontsize=8)
        above, below = ("(a)", "(b)") if len(pairs) == 1 else ("(a) to (c)", "(d) to (f)")
        points = counted(len(every), "point")
        what = f"{above} all {points}; {below} detail around the ranked ones."
        figure.describe(f"Pareto-optimal points {space}; {_subject(case)}", what, _UNITS)
    return figure


def _motion_figure(case: Case) -> Drawing:
    """Return Figure 7, the way of the optimum, with the slip phase shaded.

    Each curve is interrupted at the transition to rolling, where the forces jump.
    """
    best, parameters = int(case.ranking.salukvadze[0]), ChuteParameters(mu=case.mu)
    u1, v_p = case.designs.X[best].tolist()
    way = trajectory(u1, v_p, parameters)
    speed_and_time = np.column_stack([way.speed, way.time])
    columns = (speed_and_time, way.spin, way.slip_velocity, way.friction, way.normal)
    phases = [phase for phase in (way.slipping, ~way.slipping) if phase.any()]
    rolls = 0 < way.slip_end <= 1
    with panels(len(_PANELS), 2, head=5.0, height=50.0) as (figure, axes):
        for ax, (title, ordinate, names), values in zip(axes, _PANELS, columns, strict=True):
            for name, curve, look in zip(names, values.T, curves(), strict=False):
                for k, phase in enumerate(phases):
                    look |= {"marker": "", "label": "_" if k else name}
                    ax.plot(way.eta[phase], curve[phase], **look)
            ax.axvspan(0, np.nan_to_num(way.slip_end, nan=1.0), color="0.92", zorder=0, linewidth=0)
            if rolls:
                ax.axvline(way.slip_end, **_TRANSITION)
            ax.margins(y=0.12)
            ax.set(xlim=(0, 1), xlabel=r"$\eta$, share of the way (dimensionless)")
            ax.set_ylabel(f"{ordinate} (dimensionless)")
            ax.set_title(title, loc="left")
            ax.legend(fontsize=7)
        slip = "It slips (grey) all the way."
        if rolls:
            slip = (
                rf"It slips (grey) to $\eta_1$ = {way.slip_end:.3f} at $t_1$ = {way.slip_time:.3f},"
                f" {percent(way.slip_time / way.time[-1])} of the time, and then rolls."
            )
        figure.describe(
            rf"Transportation of the sphere, $\mu$ = {case.mu:g}: motion under the full model of "
            f"the Salukvadze optimum found under the {_MODEL_NAMES[case.model]}",
            f"Test point {case.designs.numbers[best]}:",
            rf"$u_1$ = tan $\alpha$ = {u1:.4f}, $u_2$ = $v_P$ = {v_p:.4f},",
            f"$c$ = {parameters.c:g}, $r$ = {parameters.r:g}, no initial spin.",
            f"Time $t$(1) = {way.time[-1]:.4f}, exit speed $v_{{Cf}}$ = {way.speed[-1]:.4f}.",
            slip,
            _UNITS,
        )
    return figure


def _functions_figure(case: Case, n: int) -> Drawing:
    """Return Figure 8, the optimum against the initial speed; that of ``case`` is marked."""
    found = salukvadze_functions(case.mu, case.model, n)
    with panels(len(_FUNCTIONS), 2, head=6.0, height=70.0) as (figure, axes):
        for ax, labels in zip(axes, _FUNCTIONS, strict=True):
            for (name, label), look in zip(labels.items(), curves(), strict=False):
                # one test point is the optimum of several speeds: steps
                ax.step(found["c"], found[name], label=label, where="mid", **look | {"marker": ""})
            c = ChuteParameters(mu=case.mu).c
            ax.axvline(c, label=f"$c$ = {c:g}", **_TRANSITION)
            ax.set(xlim=(0, None), xlabel="$c$, initial speed of the centre (dimensionless)")
            symbols = ", ".join(label.split(",")[0] for label in labels.values())
            ax.set_ylabel(f"{symbols} (dimensionless)")
            ax.legend(fontsize=7)
        ends = [
            f"{_FUNCTIONS[1][f].split(',')[0]} from {found[f].min():.3f} to {found[f].max():.3f}"
            for f in ("f2", "f4", "f3")
        ]
        figure.describe(
            f"Salukvadze optima of {counted(n, 'test point')} against the initial speed, in steps "
            f"from one test point to another; {_subject(case)}",
            "The paper: high $f_3^S$ by almost constant $f_2^S$ and $f_4^S$. Here:",
            f"{', '.join(ends)}.",
            _UNITS,
        )
    return figure
