"""Figure 8: the Salukvadze optimum as a function of the initial speed c of the centre.

For every c the test points are evaluated anew and the one nearest to the utopian point U is
taken. Its criteria and its exit speed are the paper's functions f_j^S(c) and v_Cf^S(c).

The whole Pareto set is not needed for that. The componentwise minimum over it is that over all
feasible points, since some point that has the least f_j is Pareto optimal; and with f ≥ U
a point that dominates another is nearer to U, so that the nearest of all is Pareto optimal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from pymoo_psi.arguments import Received, broken_rule, finite_array, integer, known_name
from pymoo_psi.chute import criteria, motion
from pymoo_psi.figures.style import (
    ABOVE,
    CURVES,
    axis_label,
    legend_above,
    on_axes,
    quantity,
    subject,
)
from pymoo_psi.problems import VectorizedSphereChute
from pymoo_psi.sequences import lp_tau

__all__ = ["SalukvadzeFunctions", "draw_salukvadze_functions", "salukvadze_functions"]

Array = NDArray[np.float64]

_DEFAULT_C = np.linspace(0.05, 1.0, 39)
_PAPER_C = 0.3193
_NAMES = ("f1S", "f2S", "f3S", "f4S", "vCfS")


@dataclass(frozen=True, eq=False)
class SalukvadzeFunctions:
    """The Salukvadze optimum for each of k initial speeds.

    Attributes:
        model: ``"full"`` or ``"rolling"``.
        mu: Friction coefficient.
        n_points: Test points from which each optimum was taken.
        c: ``(k,)`` initial speeds of the centre.
        test_point: ``(k,)`` numbers of the optimal test points.
        F: ``(k, 4)`` their criteria f1 to f4, of which f3 and f4 are the design.
        exit_speed: ``(k,)`` their exit speeds.

    Example:
        >>> functions = salukvadze_functions(0.4, [0.2, 0.8], n_points=256)
        >>> functions.F.shape, bool(functions.exit_speed[0] < functions.exit_speed[1])
        ((2, 4), True)
    """

    model: str
    mu: float
    n_points: int
    c: Array
    test_point: NDArray[np.intp]
    F: Array
    exit_speed: Array

    def curve(self, name: str) -> Array:
        """Return the ``(k,)`` values of ``"f1S"`` … ``"f4S"`` or ``"vCfS"``.

        Example:
            A sphere that enters faster is sooner at the exit.

            >>> f1 = salukvadze_functions(0.4, [0.2, 0.8], n_points=256).curve("f1S")
            >>> bool(f1[0] > f1[1])
            True
        """
        return self.exit_speed if name == "vCfS" else self.F[:, _NAMES.index(name)]


def salukvadze_functions(
    mu: float = 0.4,
    c: ArrayLike = _DEFAULT_C,
    *,
    model: str = "full",
    n_points: int = 4096,
    r: float = 0.1,
) -> SalukvadzeFunctions:
    """Find the Salukvadze optimum of the LPτ points for every initial speed.

    Args:
        mu: Friction coefficient μ > 0.
        c: ``(k,)`` initial speeds > 0; by default 0.05, 0.075, … 1.
        model: ``"full"`` or ``"rolling"``.
        n_points: Test points, the paper has 4096.
        r: Radius over L.

    Raises:
        ArgumentValueError: A parameter is out of range, or at some c every test point stalls.
        ArgumentTypeError: A parameter is not a number.

    Example:
        >>> functions = salukvadze_functions(0.4, [0.3193], model="rolling")
        >>> functions.F.round(4)
        array([[2.0458, 0.0476, 0.2635, 0.1072]])
    """
    speeds = finite_array("c", c)
    if speeds.ndim != 1:
        raise broken_rule("c", "a list of speeds", Received(f"shape {speeds.shape}"))
    n_points = integer("n_points", n_points, minimum=1)
    points = lp_tau(n_points, 2)
    numbers, F, exit_speed = np.zeros(len(speeds), dtype=np.intp), [], []
    for k, speed in enumerate(speeds):
        problem = VectorizedSphereChute(mu, c=float(speed), r=r, model=model)
        X = problem.xl + (problem.xu - problem.xl) * points
        moved = motion(X[:, 0], X[:, 1], problem.parameters, model=model)
        f = criteria(moved)
        numbers[k] = 1 + _nearest_to_utopia(f, float(speed))
        F.append(f[numbers[k] - 1])
        exit_speed.append(moved.exit_speed[numbers[k] - 1])
    return SalukvadzeFunctions(
        model, float(mu), n_points, speeds, numbers, np.reshape(F, (-1, 4)), np.array(exit_speed)
    )


def _nearest_to_utopia(f: Array, speed: float) -> int:
    exits = np.flatnonzero(np.isfinite(f).all(axis=1))
    if len(exits) == 0:
        raise broken_rule("c", "a speed at which some test point reaches the exit", speed)
    distance = np.linalg.norm(f[exits] - f[exits].min(axis=0), axis=1)
    return int(exits[distance.argmin()])


def draw_salukvadze_functions(
    functions: SalukvadzeFunctions,
    names: Sequence[str] = ("f1S", "vCfS"),
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw some of the functions against c, with the paper's own c marked.

    Args:
        functions: From :func:`salukvadze_functions`.
        names: One to three of ``"f1S"``, ``"f2S"``, ``"f3S"``, ``"f4S"``, ``"vCfS"``.
        ax: Axes to draw on; new ones by default.

    Returns:
        The axes.

    Raises:
        ArgumentValueError: A name is unknown, or there are more than three.

    Example:
        >>> functions = salukvadze_functions(0.4, [0.2, 0.8], n_points=64)
        >>> ax = draw_salukvadze_functions(functions, ["vCfS"])
        >>> len(ax.lines)  # the curve, and the paper's c
        2
    """
    names = [known_name("names", name, _NAMES) for name in names]
    if not 1 <= len(names) <= len(CURVES):
        raise broken_rule("names", "one to three functions", len(names))
    with on_axes(ax) as axes:
        for name, look in zip(names, CURVES, strict=False):
            axes.plot(
                functions.c,
                functions.curve(name),
                label=", ".join(quantity(name)),
                markersize=3.0,
                linewidth=1.0,
                **look,
            )
        axes.axvline(
            _PAPER_C, color="0.35", linestyle=":", linewidth=1.0, label=f"$c$ = {_PAPER_C}"
        )
        axes.set_xlim(0, None)
        axes.set_xlabel(axis_label("c"))
        axes.set_ylabel(", ".join(quantity(name).symbol for name in names) + " (dimensionless)")
        axes.set_title(
            f"Salukvadze optima\n{subject(functions.model, functions.mu)}", loc="left", pad=ABOVE
        )
        legend_above(axes, ncols=2)
    return axes  # type: ignore[no-any-return]
