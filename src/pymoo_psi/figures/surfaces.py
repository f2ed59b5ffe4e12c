"""Figure 2: the criteria f1 and f2 as surfaces over the design box.

f3 = u1 and f4 = u2 do not depend on the friction coefficient and are not drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from numpy.typing import NDArray

from pymoo_psi.arguments import integer, known_name
from pymoo_psi.figures.style import axis_label, on_axes, subject
from pymoo_psi.problems import VectorizedSphereChute

__all__ = ["CriterionSurfaces", "criterion_surfaces", "draw_surface"]

Array = NDArray[np.float64]

_DRAWN = ("f1", "f2")


@dataclass(frozen=True, eq=False)
class CriterionSurfaces:
    """The criteria on a grid over the design box.

    Attributes:
        model: ``"full"`` or ``"rolling"``.
        mu: Friction coefficient.
        u1: ``(n, n)`` slopes, growing along the first axis.
        u2: ``(n, n)`` speeds of the plane, growing along the second axis.
        f1: ``(n, n)`` times, NaN where the sphere stalls before the exit.
        f2: ``(n, n)`` energy balances, likewise.

    Example:
        >>> surfaces = criterion_surfaces(0.2, n=3)
        >>> surfaces.u1[:, 0].round(2), surfaces.u2[0]
        (array([0.  , 0.35, 0.7 ]), array([0.1 , 3.05, 6.  ]))
    """

    model: str
    mu: float
    u1: Array
    u2: Array
    f1: Array
    f2: Array


def criterion_surfaces(
    mu: float, *, model: str = "full", n: int = 41, c: float = 0.3193, r: float = 0.1
) -> CriterionSurfaces:
    """Compute f1 and f2 on a regular grid of n × n designs over the paper's box.

    Args:
        mu: Friction coefficient μ > 0; the box is [0, 3.5 μ] × [0.1, 6].
        model: ``"full"`` or ``"rolling"``.
        n: Designs along each side, 2 or more.
        c: Initial speed of the centre.
        r: Radius over L.

    Raises:
        ArgumentValueError: A parameter is out of range or the model is unknown.
        ArgumentTypeError: A parameter is not a number.

    Example:
        >>> surfaces = criterion_surfaces(0.2, model="rolling", n=5)
        >>> surfaces.f1.shape, float(surfaces.f1[0, 0].round(4))
        ((5, 5), 3.1319)
    """
    n = integer("n", n, minimum=2)
    problem = VectorizedSphereChute(mu, c=c, r=r, model=model)
    sides = [np.linspace(low, high, n) for low, high in zip(problem.xl, problem.xu, strict=True)]
    u1, u2 = np.meshgrid(*sides, indexing="ij")
    F = problem.evaluate(np.column_stack([u1.ravel(), u2.ravel()]), return_values_of=["F"])
    f1, f2 = np.where(np.isfinite(F), F, np.nan).T[:2].reshape(2, n, n)
    return CriterionSurfaces(problem.model, float(problem.parameters.mu), u1, u2, f1, f2)


def draw_surface(
    surfaces: CriterionSurfaces, criterion: str = "f1", *, ax: Axes | None = None
) -> Axes:
    """Draw one criterion as a surface, shaded by its value, seen from its lower side.

    Args:
        surfaces: From :func:`criterion_surfaces`.
        criterion: ``"f1"`` or ``"f2"``.
        ax: Three-dimensional axes to draw on; new ones by default.

    Returns:
        The axes.

    Raises:
        ArgumentValueError: The criterion is neither f1 nor f2.

    Example:
        >>> draw_surface(criterion_surfaces(0.2, n=5), "f2").name
        '3d'
    """
    criterion = known_name("criterion", criterion, _DRAWN)
    with on_axes(ax, three_d=True) as axes:
        values = np.ma.masked_invalid(getattr(surfaces, criterion))
        axes.plot_surface(
            surfaces.u1, surfaces.u2, values,
            cmap="viridis", norm=PowerNorm(0.6, values.min(), values.max()),
            rcount=len(values), ccount=len(values), linewidth=0.12, edgecolor="0.2",
        )  # fmt: skip
        axes.set_xlabel(axis_label("u1", unit=False))
        axes.set_ylabel(axis_label("u2", unit=False))
        axes.set_zlabel(axis_label(criterion, unit=False))
        axes.set_title(f"{axis_label(criterion)}\n{subject(surfaces.model, surfaces.mu)}")
        falls = values[0].mean() > values[-1].mean()  # along u1
        axes.view_init(elev=26, azim=-40 if falls else 130)
        axes.set_box_aspect(None, zoom=0.88)
    return axes  # type: ignore[no-any-return]
