"""The state of the sphere at the end of its way, and the arguments every solver takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, finite_array, invalid
from pymoo_psi.chute._parameters import ChuteParameters
from pymoo_psi.errors import ArgumentTypeError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """What the sphere has done when it leaves the chute, one entry per design.

    A sphere under strong backspin may come to a stop before the exit: it stalls. Its ``reached``
    is then below 1, its ``time`` infinite and its ``exit_speed`` 0; spins, work and dissipation
    are those at the stall.

    Attributes:
        u1: Design variable tan α.
        v_p: Design variable v_P, the speed of the moving plane.
        time: Time t(1) from entrance to exit.
        exit_speed: Speed v_C of the centre at the exit.
        slip_end: η1 at which slip ends and rolling begins; 0 if the sphere rolls from the start,
            NaN if it slips all the way.
        slip_time: Time t1 at which slip ends; 0 and NaN likewise.
        exit_spin: Spins (ω_X, ω_Y, ω_Z) at the exit, along the last axis.
        plane_work: Work W that the moving plane does on the sphere.
        dissipation: Energy D that friction takes, so that ΔE = u1 + W − D with
            E = ½(v_C² + 0.4 r² ω²).
        reached: η reached, 1 at the exit.

    Example:
        The first sphere slips, then rolls; on the steep chute the second slips all the way.

        >>> from pymoo_psi.chute import motion
        >>> moved = motion([0.2, 0.7], 0.1)
        >>> moved.slip_end.round(2), moved.reached
        (array([...,  nan]), array([1., 1.]))

        What the sphere gains in energy is what slope and plane give, less what friction takes.

        >>> spin = (moved.exit_spin**2).sum(axis=-1)
        >>> start, end = 0.5 * 0.3193**2, 0.5 * (moved.exit_speed**2 + 0.4 * 0.1**2 * spin)
        >>> np.allclose(end - start, moved.u1 + moved.plane_work - moved.dissipation)
        True
    """

    u1: Array
    v_p: Array
    time: Array
    exit_speed: Array
    slip_end: Array
    slip_time: Array
    exit_spin: Array
    plane_work: Array
    dissipation: Array
    reached: Array

    def __repr__(self) -> str:
        """Return how many designs there are and how they end."""
        stall, slip = self.reached < 1, np.isnan(self.slip_end)
        roll, slide = np.sum(~stall & ~slip), np.sum(~stall & slip)
        ends = f"{roll} roll at the exit, {slide} slip, {np.sum(stall)} stall"
        return f"Motion({self.u1.size} designs: {ends})"


def broadcast(
    u1: ArrayLike, v_p: ArrayLike, parameters: ChuteParameters | None
) -> tuple[Array, ...]:
    """Return (u1, v_P, μ, c, r, ω_X0, ω_Y0, ω_Z0), checked and broadcast to one shape."""
    parameters = ChuteParameters() if parameters is None else parameters
    if not isinstance(parameters, ChuteParameters):
        raise ArgumentTypeError(f"parameters must be ChuteParameters, got {parameters!r:.80}")
    slope, speed = finite_array("u1", u1), finite_array("v_p", v_p)
    if (slope < 0).any():
        raise invalid("u1", "tan α >= 0", Received(str(slope.min())))
    columns = (slope, speed, *parameters.columns)
    try:
        return tuple(np.broadcast_arrays(*columns))
    except ValueError as error:
        shapes = ", ".join(str(np.shape(column)) for column in columns)
        raise invalid(
            "u1, v_p and the parameters", "of shapes that broadcast together", Received(shapes)
        ) from error
