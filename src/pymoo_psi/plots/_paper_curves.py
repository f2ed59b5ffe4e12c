"""Figure 2: the criteria f1 and f2 as surfaces over the design box.

f3 = u1 and f4 = u2 do not depend on the friction coefficient and are not drawn.

Figure 7: kinematics (a, b, c) and dynamics (d, e) of the sphere on its way to the exit.

The paper does not say which quantity is in which panel. Here the abscissa is the share η of the
way, and the panels are (a) speed of the centre and time, (b) spins, (c) slip velocity,
(d) friction force, (e) normal reactions.

Figure 8: the Salukvadze optimum as a function of the initial speed c of the centre.

For every c the test points are evaluated anew and the one nearest to the utopian point U is
taken. Its criteria and its exit speed are the paper's functions f_j^S(c) and v_Cf^S(c).

The whole Pareto set is not needed for that. The componentwise minimum over it is that over all
feasible points, since some point that has the least f_j is Pareto optimal; and with f ≥ U
a point that dominates another is nearer to U, so that the nearest of all is Pareto optimal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, finite_array, integer, invalid, known_name
from pymoo_psi.chute import Trajectory, criteria, motion
from pymoo_psi.plots._style import (
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


@dataclass(frozen=True, eq=False)
class MotionPanel:
    """Curves over the way that share one panel.

    Attributes:
        letter: ``"a"`` to ``"e"``.
        title: What the curves are.
        ordinate: The text on the vertical axis.
        symbols: Symbol and meaning of each of the m curves.
        eta: ``(n,)`` share of the way.
        values: ``(n, m)`` the curves.
        slipping: ``(n,)`` which points are before the transition from slip to rolling.
        slip_end: η1 of the transition; NaN if the sphere slips all the way, 0 if it never does.
        slip_time: t1 of the transition, likewise.

    Example:
        >>> from pymoo_psi.chute import trajectory
        >>> speed = motion_panels(trajectory(0.2635, 0.1072))[0]
        >>> speed.symbols
        ('$v_C$, speed', '$t$, time')
    """

    letter: str
    title: str
    ordinate: str
    symbols: tuple[str, ...]
    eta: Array
    values: Array
    slipping: NDArray[np.bool_]
    slip_end: float
    slip_time: float


def motion_panels(trajectory: Trajectory) -> tuple[MotionPanel, ...]:
    """Arrange a trajectory in the five panels of Figure 7.

    Args:
        trajectory: From :func:`pymoo_psi.chute._trajectory`.

    Returns:
        Panels (a) to (e).

    Example:
        >>> from pymoo_psi.chute import trajectory
        >>> [panel.letter for panel in motion_panels(trajectory(0.2635, 0.1072))]
        ['a', 'b', 'c', 'd', 'e']
    """
    way = trajectory

    def panel(
        letter: str, title: str, ordinate: str, symbols: tuple[str, ...], values: Array
    ) -> MotionPanel:
        return MotionPanel(
            letter, title, f"{ordinate} (dimensionless)", symbols, way.eta, values,
            way.slipping, float(way.slip_end), float(way.slip_time),
        )  # fmt: skip

    return (
        panel(
            "a",
            "speed of the centre and time",
            "$v_C$, $t$",
            ("$v_C$, speed", "$t$, time"),
            np.column_stack([way.speed, way.time]),
        ),
        panel(
            "b",
            "spin of the sphere",
            r"$\omega$",
            (r"$\omega_X$", r"$\omega_Y$", r"$\omega_Z$"),
            way.spin,
        ),
        panel(
            "c",
            "slip velocity",
            "$v_A$",
            ("$v_{AX}$, along", "$v_{AY}$, across"),
            way.slip_velocity,
        ),
        panel(
            "d",
            "friction force",
            "$f_A$",
            ("$f_{AX}$, along", "$f_{AY}$, across"),
            way.friction,
        ),
        panel(
            "e",
            "normal reactions",
            "$n$",
            ("$n_A$, plane", "$n_B$, guide-wall"),
            way.normal,
        ),
    )


def draw_motion_panel(panel: MotionPanel, *, ax: Axes | None = None) -> Axes:
    """Draw the curves of a panel, the transition from slip to rolling and the slip phase shaded.

    Each curve is interrupted at the transition, where the forces jump.

    Args:
        panel: From :func:`motion_panels`.
        ax: Axes to draw on; new ones by default.

    Returns:
        The axes.

    Example:
        >>> from pymoo_psi.chute import trajectory
        >>> friction = motion_panels(trajectory(0.2635, 0.1072))[3]
        >>> draw_motion_panel(friction).get_title(loc="left")
        '(d) friction force, full model'
    """
    with on_axes(ax) as axes:
        phases = [panel.slipping, ~panel.slipping]
        for symbol, values, look in zip(panel.symbols, panel.values.T, CURVES, strict=False):
            label = symbol
            for phase in phases:
                if phase.any():
                    axes.plot(
                        panel.eta[phase],
                        values[phase],
                        color=look["color"],
                        linestyle=look["linestyle"],
                        label=label,
                    )
                    label = "_nolegend_"
        if 0 < panel.slip_end <= 1:
            axes.axvspan(0, panel.slip_end, color="0.92", zorder=0, linewidth=0)
            axes.axvline(
                panel.slip_end,
                color="0.35",
                linestyle=":",
                linewidth=1.0,
                label=rf"$\eta_1$ = {panel.slip_end:.3f}, $t_1$ = {panel.slip_time:.3f}",
            )
        elif math.isnan(panel.slip_end):
            axes.axvspan(0, float(panel.eta.max()), color="0.92", zorder=0, linewidth=0)
        axes.margins(y=0.08)
        axes.set_xlim(0, 1)
        axes.set_xlabel(axis_label("eta"))
        axes.set_ylabel(panel.ordinate)
        axes.set_title(f"({panel.letter}) {panel.title}, full model", loc="left", pad=ABOVE)
        legend_above(axes, ncols=2)
    return axes  # type: ignore[no-any-return]


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
        raise invalid("c", "a list of speeds", Received(f"shape {speeds.shape}"))
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
        raise invalid("c", "a speed at which some test point reaches the exit", speed)
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
        raise invalid("names", "one to three functions", len(names))
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
