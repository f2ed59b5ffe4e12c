"""The motion along the way: the exact state of one sphere at any η, and the forces on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pymoo_psi._validation import Array, Mask, integer, invalid
from pymoo_psi.chute._motion import ChuteParameters, broadcast, motion, move


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """The motion of one sphere along the way under the full model.

    Where slip ends on the way, η1 occurs twice: as the last slipping and as the first rolling
    point, so that the jump of the forces shows. A trajectory that stalls ends there.

    Attributes:
        eta: ``(n,)`` share η of the way, from 0.
        time: ``(n,)`` time t.
        speed: ``(n,)`` speed v_C of the centre.
        spin: ``(n, 3)`` spins ω_X, ω_Y, ω_Z.
        slip_velocity: ``(n, 2)`` velocity v_AX, v_AY of the contact point relative to the plane.
        friction: ``(n, 2)`` friction f_AX, f_AY over m g; it opposes the slip velocity.
        normal: ``(n, 2)`` reactions n_A of the plane and n_B of the guide-wall over m g.
        slipping: ``(n,)`` whether the sphere slips.
        slip_end: η1 where slip ends; NaN if it does not, 0 if the sphere rolls from the start.
        slip_time: Time t1 at which slip ends; NaN and 0 as for ``slip_end``.

    Example:
        Once the sphere rolls, the contact point does not slip.

        >>> path = trajectory(0.2635, 0.1072, ChuteParameters(mu=0.4), n=5)
        >>> path.eta.round(2)
        array([0.  , 0.09, 0.09, 0.25, 0.5 , 0.75, 1.  ])
        >>> path.slipping
        array([ True,  True, False, False, False, False, False])
        >>> float(abs(path.slip_velocity[~path.slipping]).max())
        0.0
    """

    eta: Array
    time: Array
    speed: Array
    spin: Array
    slip_velocity: Array
    friction: Array
    normal: Array
    slipping: Mask
    slip_end: float
    slip_time: float

    def __repr__(self) -> str:
        """Return when the slip ends."""
        return f"Trajectory(slip_end={self.slip_end!r}, slip_time={self.slip_time!r})"


def trajectory(
    u1: float, v_p: float, parameters: ChuteParameters | None = None, *, n: int = 201
) -> Trajectory:
    """Follow one sphere through the chute under the full model, exactly at every point.

    Args:
        u1: tan α >= 0.
        v_p: Speed of the plane.
        parameters: The parameters of the chute, all of them numbers.
        n: Number of points, evenly spaced over the way that is covered; η1 is added.

    Returns:
        The trajectory.

    Raises:
        ArgumentValueError: More than one design, fewer than two points, or as for :func:`motion`.
        ArgumentTypeError: An argument is not numeric.

    Example:
        >>> path = trajectory(0.2635, 0.1072, ChuteParameters(mu=0.4))
        >>> round(path.slip_end, 4), path.friction[0].round(3), path.friction[-1].round(3)
        (0.0922, array([-0.367,  0.123]), array([-0.073,  0.   ]))
    """
    columns = broadcast(u1, v_p, parameters)
    if columns[0].ndim:
        raise invalid("u1, v_p and the parameters", "numbers, for one design", columns[0].shape)
    u1, v_p, mu, c, r, wx0, wy0, wz0 = (float(column) for column in columns)
    moved = motion(u1, v_p, parameters)
    slip_end = float(moved.slip_end)
    slip_time = float(moved.slip_time)
    points = np.linspace(0.0, float(moved.reached), integer("n", n, minimum=2))
    slips_then_rolls = 0 < slip_end < 1
    if slips_then_rolls:
        points = np.append(points[points != slip_end], [slip_end, slip_end])
        points.sort()

    # Every point is the end of a shorter way, so that the solver of the motion serves here.
    length = np.hypot(1.0, u1)
    a = u1 / length
    b = mu / length
    tau = u1 / mu
    vx0 = c - r * wy0
    vy0 = r * wx0 - v_p
    with np.errstate(all="ignore"):  # 0/0 has its limit taken explicitly there
        at = move(np, *np.broadcast_arrays(a, b, tau, c, r * wy0, vy0, points * length))
    time = at.time
    slip = np.column_stack([at.vx, at.vy])
    slipping = points < slip_end
    if np.isnan(slip_end):
        slipping = np.isnan(at.grip_time)
    if slips_then_rolls:
        last = int(np.flatnonzero(points == slip_end)[0])
        slipping[last] = True
        time[last : last + 2] = slip_time
        slip[last : last + 2] = 0.0
    friction = -b * _direction(slip, tau, vx0, vy0)
    friction[~slipping] = [-2 / 7 * a, 0.0]  # (2.21)
    plane = np.full(len(points), 1.0 / length)
    wall = np.abs(friction[:, 1])
    normal = np.column_stack([plane, wall])
    wx = (slip[:, 1] + v_p) / r
    wy = (at.speed - slip[:, 0]) / r
    spin = np.column_stack([wx, wy, np.full(len(points), wz0)])
    return Trajectory(
        points, time, at.speed, spin, slip, friction, normal, slipping, slip_end, slip_time
    )


def _direction(slip: Array, tau: float, vx0: float, vy0: float) -> Array:
    """Return the unit vectors (cos θ, sin θ); where slip vanishes, the limit before that.

    Slip across the chute vanishes last where τ < 1, with θ → arccos τ; else θ → 0.

    Args:
        slip: (n, 2) slip velocities, the first of which need not be that at the start.
        tau: u1/μ.
        vx0: v_AX at the start.
        vy0: v_AY at the start.
    """
    rho = np.hypot(slip[:, 0], slip[:, 1])
    direction = np.zeros_like(slip)
    np.divide(slip, rho[:, None], out=direction, where=rho[:, None] > 0)
    if vy0:
        cosine = min(tau, 1.0)
        limit = [cosine, np.sign(vy0) * np.sqrt(1 - cosine**2)]
    elif vx0 < 0 and tau <= 3.5:
        limit = [-1.0, 0.0]
    else:  # beyond (2.12) slip does not end: from ρ = 0 on the sphere slides straight down
        limit = [1.0, 0.0]
    direction[rho == 0] = limit
    return direction
