"""Figure 7: kinematics (a, b, c) and dynamics (d, e) of the sphere on its way to the exit.

The paper does not say which quantity is in which panel. Here the abscissa is the share η of the
way, and the panels are (a) speed of the centre and time, (b) spins, (c) slip velocity,
(d) friction force, (e) normal reactions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pymoo_psi.chute import Trajectory
from pymoo_psi.figures.style import ABOVE, CURVES, axis_label, legend_above, on_axes

__all__ = ["MotionPanel", "draw_motion_panel", "motion_panels"]

Array = NDArray[np.float64]


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
        trajectory: From :func:`pymoo_psi.chute.trajectory`.

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
