"""The figures of one model as files, beside each other in a folder."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from pymoo_psi.arguments import Received, broken_rule, integer, known_name
from pymoo_psi.chute import MODELS, ChuteParameters, trajectory
from pymoo_psi.figures.pages import functions_page, motion_page, points_page, surfaces_page
from pymoo_psi.figures.points import design_points, geometric_points, objective_points
from pymoo_psi.figures.sensitivity import salukvadze_functions
from pymoo_psi.figures.style import model_name
from pymoo_psi.figures.surfaces import criterion_surfaces
from pymoo_psi.figures.transport import motion_panels

if TYPE_CHECKING:
    from pymoo_psi.studies.paper import Case, Reproduction

__all__ = ["paper_figures", "save_figures"]

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
        >>> from pymoo_psi.studies.paper import Reproduction, solve_case
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
        >>> from pymoo_psi.studies.paper import Reproduction, solve_case
        >>> small = Reproduction(64, (solve_case(0.4, "full", 64),))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in save_figures(small, folder, dpi=20)][:2]
        ['figure_2.png', 'figure_3.png']
    """
    dpi = integer("dpi", dpi, minimum=1)
    target = Path(directory)
    with tempfile.TemporaryDirectory(dir=target, prefix=".figures.") as folder:
        ready = []
        for number, figure in paper_figures(reproduction, model=model):
            ready.append(Path(folder, f"figure_{number}.png"))
            figure.savefig(ready[-1], dpi=dpi)
        for path in ready:
            os.replace(path, target / path.name)
    return tuple(target / path.name for path in ready)


def _case(reproduction: Reproduction, model: str) -> Case:
    for case in reproduction.cases:
        if case.model == model and np.isclose(case.mu, _MU):
            return case
    have = ", ".join(f"{case.model} {case.mu:g}" for case in reproduction.cases)
    received = Received(f"the cases {have or 'none'}")
    raise broken_rule("reproduction", f"one with the case {model} {_MU:g}", received)


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
