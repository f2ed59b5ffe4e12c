"""The figures as whole pages, 180 mm wide: what is drawn beside what.

The figures of one model as files, beside each other in a folder.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from pymoo_psi._validation import Received, invalid, known_name
from pymoo_psi.chute import MODELS, ChuteParameters, trajectory
from pymoo_psi.plots._paper_curves import (
    CriterionSurfaces,
    MotionPanel,
    SalukvadzeFunctions,
    criterion_surfaces,
    draw_motion_panel,
    draw_salukvadze_functions,
    draw_surface,
    motion_panels,
    salukvadze_functions,
)
from pymoo_psi.plots._paper_points import (
    RankedPoints,
    design_points,
    draw_points,
    geometric_points,
    objective_points,
)
from pymoo_psi.plots._style import (
    WIDTH,
    enlarged_markers,
    inches,
    model_name,
    page_style,
    quantity,
    save_pages,
    subject,
)

if TYPE_CHECKING:
    from pymoo_psi.paper import Case, Reproduction


def surfaces_page(cases: Sequence[CriterionSurfaces]) -> Figure:
    """Return f1 on the left and f2 on the right, with one row for every friction coefficient."""
    with page_style():
        figure = Figure(figsize=inches(WIDTH, 12 + 78 * len(cases)))
        figure.subplots_adjust(
            left=0.0, right=0.935, bottom=0.03, top=0.92, wspace=0.08, hspace=0.02
        )
        for row, surfaces in enumerate(cases):
            for column, criterion in enumerate(("f1", "f2")):
                place = (len(cases), 2, 1 + 2 * row + column)
                ax = draw_surface(
                    surfaces, criterion, ax=figure.add_subplot(*place, projection="3d")
                )
                symbol, meaning = quantity(criterion)
                ax.set_title(
                    rf"({'abcdef'[row]}) $\mu$ = {surfaces.mu:g}: {symbol}, {meaning}", y=0.97
                )
        figure.suptitle(
            f"Criteria over the design box (all quantities dimensionless)\n"
            f"{model_name(cases[0].model)}",
            fontsize=9,
        )
    return figure


def points_page(points: RankedPoints, title: str) -> Figure:
    """Return all points on the left, and on the right the part of the space with the ranked."""
    in_space = len(points.names) == 3
    with page_style():
        figure = Figure(figsize=inches(WIDTH, 98))
        sides: dict[str, Any] = {"projection": "3d"} if in_space else {}
        figure.subplots_adjust(
            **{"left": 0.045, "right": 0.945, "bottom": 0.15, "top": 0.89, "wspace": 0.10}
            if in_space
            else {"left": 0.075, "right": 0.985, "bottom": 0.27, "top": 0.83, "wspace": 0.24}
        )
        whole = draw_points(points, ax=figure.add_subplot(1, 2, 1, **sides), legend=False)
        detail = draw_points(points.nearby(), ax=figure.add_subplot(1, 2, 2, **sides), legend=False)
        height = 0.95 if in_space else None
        whole.set_title(f"all {len(points.values)} points", y=height)
        detail.set_title("detail around the ranked points", y=height)
        note = " (all quantities dimensionless)" if in_space else ""
        figure.suptitle(f"{title}{note}\n{subject(points.model, points.mu)}", fontsize=9)
        handles, labels = whole.get_legend_handles_labels()
        legend = figure.legend(handles, labels, loc="lower center", ncols=3)
        enlarged_markers(legend)
    return figure


def motion_page(panels: Iterable[MotionPanel], title: str, facts: str) -> Figure:
    """Return the five panels in three rows, and in the sixth place what is known of the design."""
    with page_style():
        figure = Figure(figsize=inches(WIDTH, 200))
        figure.subplots_adjust(
            left=0.08, right=0.975, bottom=0.055, top=0.865, wspace=0.26, hspace=0.72
        )
        places = figure.subplots(3, 2).ravel()
        for ax, panel in zip(places[:-1], panels, strict=True):
            draw_motion_panel(panel, ax=ax)
        places[-1].set_axis_off()
        places[-1].text(0.0, 1.2, facts, va="top", linespacing=1.6, transform=places[-1].transAxes)
        figure.suptitle(title, fontsize=9)
    return figure


def functions_page(functions: SalukvadzeFunctions) -> Figure:
    """Return the time and the exit speed on the left, the other criteria on the right."""
    with page_style():
        figure = Figure(figsize=inches(WIDTH, 88))
        figure.subplots_adjust(left=0.08, right=0.975, bottom=0.13, top=0.76, wspace=0.22)
        for ax, names in zip(
            figure.subplots(1, 2), (("f1S", "vCfS"), ("f2S", "f3S", "f4S")), strict=True
        ):
            draw_salukvadze_functions(functions, names, ax=ax)
            ax.set_title("", loc="left")
        figure.suptitle(
            f"Salukvadze optima of {functions.n_points} test points against the initial speed\n"
            f"{subject(functions.model, functions.mu)}",
            fontsize=9,
        )
    return figure


_SURFACES_MU = (0.2, 0.6)
_MU = 0.4  # the paper's for Figures 7 and 8; it names none for Figures 3 to 6


def paper_figures(
    reproduction: Reproduction, *, model: str = "full"
) -> Iterator[tuple[int, Figure]]:
    """Make the paper's figures one by one.

    Figures 3 to 8 are for μ = 0.4. Figure 7 shows the motion under the full model, with slip, of
    the design that is the Salukvadze optimum under ``model``.

    Args:
        reproduction: The ranked cases; Figure 8 takes as many test points as they do.
        model: ``"full"`` or ``"rolling"``.

    Yields:
        The number of each figure, 2 to 8, with the figure.

    Raises:
        ArgumentValueError: The model is unknown or has no case with μ = 0.4.

    Example:
        >>> from pymoo_psi.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "full", 64),))
        >>> number, figure = next(paper_figures(small))
        >>> number
        2
    """
    case = _case(reproduction, known_name("model", model, MODELS))
    yield 2, surfaces_page([criterion_surfaces(mu, model=model) for mu in _SURFACES_MU])
    yield (
        3,
        points_page(
            geometric_points(case),
            r"Pareto-optimal points by geometric criteria $\mu_1, \mu_2, \mu_3$",
        ),
    )
    yield 4, points_page(design_points(case), "Pareto-optimal points in the design box")
    for number, last in ((5, 3), (6, 4)):
        yield (
            number,
            points_page(
                objective_points(case, ("f1", "f2", f"f{last}")),
                f"Pareto-optimal points by objectives $f_1, f_2, f_{last}$",
            ),
        )
    yield 7, _motion_figure(case)
    yield 8, functions_page(salukvadze_functions(_MU, model=model, n_points=reproduction.n_points))


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
        ...     [path.name for path in save_figures(small, folder, dpi=20)][:2]
        ['figure_2.png', 'figure_3.png']
    """
    figures = paper_figures(reproduction, model=model)
    pages = ((f"figure_{number}.png", figure) for number, figure in figures)
    return save_pages(pages, directory, dpi)


def _case(reproduction: Reproduction, model: str) -> Case:
    for case in reproduction.cases:
        if case.model == model and np.isclose(case.mu, _MU):
            return case
    have = ", ".join(f"{case.model} {case.mu:g}" for case in reproduction.cases)
    received = Received(f"the cases {have or 'none'}")
    raise invalid("reproduction", f"one with the case {model} {_MU:g}", received)


def _motion_figure(case: Case) -> Figure:
    best = case.ranking.salukvadze[0]
    u1, v_p = case.X[best].tolist()
    parameters = ChuteParameters(mu=case.mu)
    way = trajectory(u1, v_p, parameters)
    title = (
        rf"Transportation of the sphere, $\mu$ = {case.mu:g}: motion under the full model"
        f"\nof the Salukvadze optimum found under the {model_name(case.model)}"
    )
    share = way.slip_end, way.slip_time / way.time[-1]
    phases = [
        r"slips (grey) up to $\eta_1$, $t_1$ (dotted line), then rolls:",
        f"slip takes {share[0]:.1%} of the way and {share[1]:.1%} of the time",
    ]
    facts = [
        f"Salukvadze optimum: test point {case.test_point[best]}",
        rf"$u_1$ = tan $\alpha$ = {u1:.4f},  $u_2$ = $v_P$ = {v_p:.4f}",
        f"$c$ = {parameters.c:g},  $r$ = {parameters.r:g},  no initial spin",
        "",
        f"time $t$(1) = {way.time[-1]:.4f},  exit speed $v_{{Cf}}$ = {way.speed[-1]:.4f}",
        *(phases if np.isfinite(way.slip_end) else ["slips (grey) all the way"]),
        "",
        "All quantities dimensionless:",
        r"lengths over $L$, times over $(L/g)^{1/2}$,",
        r"speeds over $(Lg)^{1/2}$, forces over $mg$",
    ]
    return motion_page(motion_panels(way), title, "\n".join(facts))
