"""The figures as whole pages, 180 mm wide: what is drawn beside what."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.figure import Figure

from pymoo_psi.figures.points import RankedPoints, draw_points
from pymoo_psi.figures.sensitivity import SalukvadzeFunctions, draw_salukvadze_functions
from pymoo_psi.figures.style import (
    WIDTH,
    enlarged_markers,
    inches,
    model_name,
    page_style,
    quantity,
    subject,
)
from pymoo_psi.figures.surfaces import CriterionSurfaces, draw_surface
from pymoo_psi.figures.transport import MotionPanel, draw_motion_panel

__all__ = ["functions_page", "motion_page", "points_page", "surfaces_page"]


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
