"""The chute, the motion to its exit and along the way, and the four criteria of it."""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import (
    Array,
    Mask,
    Received,
    finite_array,
    integer,
    invalid,
    known_name,
)
from pymoo_psi.chute._slip import NUMBERS, ROLLS, STALLS, TINY, follow_slip

ModelName = Literal["full", "rolling"]
MODELS: tuple[ModelName, ...] = ("full", "rolling")
"""``"full"``: slip, then roll (Eqs. 2.16–2.21). ``"rolling"``: rolling from the start (2.20)."""


@dataclass(frozen=True, eq=False)
class ChuteParameters:
    """The parameters of the chute and of the sphere: everything but the two design variables.

    Each entry is a number, or an array where it varies from design to design; arrays broadcast
    against each other and against the designs.

    Attributes:
        mu: Friction coefficient μ > 0.
        c: Initial speed of the centre, V_C(0) / sqrt(L g) > 0 (0.3193 is 1 m/s for L = 1 m).
        r: Radius R / L > 0.
        omega0: The three initial spins (ω_X0, ω_Y0, ω_Z0), each a number or an array.

    Raises:
        ArgumentValueError: μ, c or r is not positive, or a value is not finite.
        ArgumentTypeError: A value is not a number.

    Example:
        >>> ChuteParameters(mu=0.4).c
        0.3193
    """

    mu: Any = 0.2
    c: Any = 0.3193
    r: Any = 0.1
    omega0: Any = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check every entry; arrays are kept as copies."""
        for name in ("mu", "c", "r"):
            array = finite_array(name, getattr(self, name))
            if (array <= 0).any():
                raise invalid(name, "positive", Received(str(array.min())))
            object.__setattr__(self, name, _kept(array))
        arrays = [finite_array(f"omega0[{k}]", spin) for k, spin in enumerate(self.omega0)]
        object.__setattr__(self, "omega0", tuple(map(_kept, arrays)))

    @property
    def columns(self) -> tuple[Any, ...]:
        """The six entries in the order μ, c, r, ω_X0, ω_Y0, ω_Z0.

        Example:
            >>> ChuteParameters(mu=0.4, c=0.5, r=0.1, omega0=(0, 1, 0)).columns
            (0.4, 0.5, 0.1, 0.0, 1.0, 0.0)
        """
        return (self.mu, self.c, self.r, *self.omega0)


def _kept(array: Array) -> float | Array:
    """Return a number as a float, an array as a copy."""
    if array.ndim:
        return array.copy()
    return float(array)


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a sphere from the entrance to the exit, one entry per design.

    A sphere with strong backspin may stop before the exit: it stalls. Its ``reached`` is then
    below 1, its ``time`` infinite and its ``exit_speed`` 0; spins, work and dissipation are those
    at the stall.

    Attributes:
        u1: Design variable tan α.
        v_p: Design variable v_P, the speed of the moving plane.
        time: Time t(1) from entrance to exit.
        exit_speed: Speed v_C of the centre at the exit.
        slip_end: η1 at which slip ends and rolling begins; 0 if the sphere rolls from the start,
            NaN if it slips all the way.
        slip_time: Time t1 at which slip ends; 0 and NaN as for ``slip_end``.
        exit_spin: Spins (ω_X, ω_Y, ω_Z) at the exit, along the last axis.
        plane_work: Work W that the moving plane does on the sphere.
        dissipation: Energy D that friction takes, so that ΔE = u1 + W − D with
            E = ½(v_C² + 0.4 r² ω²).
        reached: η reached, 1 at the exit.

    Example:
        The first sphere slips, then rolls; the second, on a steep chute, slips to the exit.

        >>> from pymoo_psi.chute import motion
        >>> moved = motion([0.2, 0.7], 0.1)
        >>> moved.slip_end.round(2), moved.reached
        (array([...,  nan]), array([1., 1.]))

        The gain in energy is what slope and plane give, less what friction takes.

        >>> spin = (moved.exit_spin**2).sum(axis=-1)
        >>> start = 0.5 * 0.3193**2
        >>> end = 0.5 * (moved.exit_speed**2 + 0.4 * 0.1**2 * spin)
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


def motion(
    u1: ArrayLike,
    v_p: ArrayLike,
    parameters: ChuteParameters | None = None,
    *,
    model: ModelName = "full",
) -> Motion:
    """Compute the motion of the sphere from the entrance to the exit.

    The motion of a design is bit-identical in any batch.

    Args:
        u1: tan α >= 0, any shape that broadcasts with the others.
        v_p: Speed of the plane, as for ``u1``.
        parameters: The parameters of the chute; :class:`ChuteParameters` () by default.
        model: ``"full"``, the paper's model MM, or ``"rolling"``, rolling from the start.

    Returns:
        The motion; its arrays have the common shape.

    Raises:
        ArgumentValueError: A value is not finite, u1 is negative or the model is unknown.
        ArgumentTypeError: An argument is not numeric.

    Example:
        >>> m = motion(0.2635, 0.1072, ChuteParameters(mu=0.4), model="rolling")
        >>> round(float(m.time), 4), round(float(m.exit_speed), 4)
        (2.0459, 0.6917)
    """
    known_name("model", model, MODELS)
    solve = _slip_then_roll
    if model == "rolling":
        solve = _roll
    columns = broadcast(u1, v_p, parameters)
    return Motion(columns[0], columns[1], *solve(*columns))


def criteria(motion: Motion) -> Array:
    """Return the four criteria of a motion, all to be minimised, Eqs. (3.1) to (3.4).

    f1 = t(1), the time; f2 = ``|ΔE − u1| = |W − D|``, the balance of the energy that enters from
    the plane and of that lost to friction; f3 = tan α, the height; f4 = v_P, the speed of the
    plane. Where the sphere stalls before the exit, f1 and f2 are infinite.

    Args:
        motion: The motion of n designs.

    Returns:
        ``(n, 4)`` array, or (..., 4) for designs of any other shape.

    Example:
        >>> criteria(motion([0.2635], [0.1072], ChuteParameters(mu=0.4), model="rolling")).round(4)
        array([[2.0459, 0.0476, 0.2635, 0.1072]])
    """
    balance = np.abs(motion.plane_work - motion.dissipation)
    f2 = np.where(motion.reached < 1, np.inf, balance)
    return np.stack([motion.time, f2, motion.u1, motion.v_p], axis=-1)


def broadcast(
    u1: ArrayLike, v_p: ArrayLike, parameters: ChuteParameters | None
) -> tuple[Array, ...]:
    """Return (u1, v_P, μ, c, r, ω_X0, ω_Y0, ω_Z0), checked and broadcast to one shape."""
    parameters = parameters or ChuteParameters()
    slope = finite_array("u1", u1)
    speed = finite_array("v_p", v_p)
    if (slope < 0).any():
        raise invalid("u1", "tan α >= 0", Received(str(slope.min())))
    columns = (slope, speed, *map(np.asarray, parameters.columns))
    if any(column.ndim for column in columns):
        columns = np.broadcast_arrays(*columns)
    return columns


def _slip_then_roll(*columns: Array) -> tuple[Array, ...]:
    """Return the fields of `Motion` after v_p under the full model, Eqs. (2.16) to (2.21).

    Args:
        *columns: u1, v_P, μ, c, r, ω_X0, ω_Y0, ω_Z0 as checked arrays of one shape.
    """
    shape = columns[0].shape
    with np.errstate(all="ignore"):  # 0/0 and overflow have their limits taken explicitly
        if columns[0].size == 1:
            fields = _solve(NUMBERS, *[column.item() for column in columns])
            arrays = map(np.asarray, fields)
            return tuple([array.reshape(shape + array.shape) for array in arrays])
        fields = _solve(np, *[column.reshape(-1) for column in columns])
        return tuple([field.reshape(shape + field.shape[1:]) for field in fields])


def _solve(
    xp: Any, u1: Any, v_p: Any, mu: Any, c: Any, r: Any, wx0: Any, wy0: Any, wz0: Any
) -> tuple[Any, ...]:
    """`_slip_then_roll` for (n,) arrays, xp being NumPy, or for floats, xp being `NUMBERS`."""
    length = xp.sqrt(1.0 + u1 * u1)
    a = u1 / length
    b = mu / length
    wy0 = r * wy0
    vy0 = r * wx0 - v_p
    end = move(xp, a, b, u1 / mu, c, wy0, vy0, length)
    time = xp.where(end.stalls, np.inf, end.time)
    # Never 1, though the stall may be within rounding of the exit.
    stalled_at = xp.maximum(xp.minimum(1.0 - end.left / length, 1.0 - 1e-16), 0.0)
    reached = xp.where(end.stalls, stalled_at, 1.0)

    # D = a x + W − ΔE with E = ½ (v_C² + 0.4 (r ω)²), ω_Z constant. Differences of squares are
    # written as products: nearly equal numbers would cancel.
    turned = end.vy - vy0  # r ω_X
    spun = end.speed - end.vx  # r ω_Y
    lost = a * length * reached - 0.5 * (end.speed - c) * (end.speed + c)
    lost -= 0.2 * ((spun - wy0) * (spun + wy0) + turned * (end.vy + vy0))
    spin = np.array([(end.vy + v_p) / r, spun / r, wz0]).T
    work = 0.4 * v_p * turned
    return time, end.speed, end.grip_way / length, end.grip_time, spin, work, lost, reached


State = namedtuple("State", "time speed vx vy left stalls grip_time grip_way")
"""The state of spheres after a given way; every entry is an (n,) array or a float.

Attributes:
    time: t.
    speed: v_C.
    vx: v_AX.
    vy: v_AY.
    left: what is left of the way, 0 unless the sphere stalls.
    stalls: whether the sphere stalls.
    grip_time: time when rolling begins, NaN if it does not.
    grip_way: way when rolling begins, NaN if it does not.
"""


def move(xp: Any, a: Any, b: Any, tau: Any, c: Any, wy0: Any, vy0: Any, way: Any) -> State:
    """Follow spheres over a way: slip, then constant acceleration.

    After slip a sphere rolls, Eq. (2.20), or beyond condition (2.12), τ > 3.5, slides straight down
    from ρ = 0.

    Args:
        xp: NumPy for arrays, `NUMBERS` for floats.
        a: (n,) array or float, sin α; so are all others.
        b: μ cos α.
        tau: a/b.
        c: initial speed.
        wy0: initial r ω_Y.
        vy0: initial v_AY.
        way: how far.
    """
    invariant = c + 0.4 * wy0
    time, vx, y, left, ending = follow_slip(xp, b, tau, invariant, way, c - wy0, abs(vy0), c)
    free = ending == ROLLS
    steep = tau > 3.5
    rest = xp.where(free, xp.maximum(left, 0.0), 0.0)
    speed = xp.maximum((invariant + a * time + 0.4 * vx) / 1.4, 0.0)  # at rest: not -1e-17
    push = xp.where(steep, a - b, a / 1.4)
    final = xp.sqrt(speed * speed + 2.0 * push * rest)
    dt = 2.0 * rest / (speed + final + TINY)
    slide = xp.where(free & steep, (a - 3.5 * b) * dt, 0.0)
    # On a level chute the slip may use up all speed: the sphere stalls where it would roll.
    stalls = (ending == STALLS) | (free & (final == 0.0) & (rest > 0.0))
    rolls = free & xp.logical_not(steep | stalls)
    speed = xp.where(stalls, 0.0, final)
    vy = xp.copysign(y, vy0)
    left = xp.where(stalls, left, 0.0)
    grip_time = xp.where(rolls, time, np.nan)
    grip_way = xp.where(rolls, way - rest, np.nan)
    return State(time + dt, speed, vx + slide, vy, left, stalls, grip_time, grip_way)


def _roll(*columns: Array) -> tuple[Array, ...]:
    """Return the fields of `Motion` after v_p for rolling from the start, Eq. (2.20) alone.

    Integrated from η = 0 with the initial spins kept as they are, it gives w(1) = c² + (10/7) u1
    and a spin ω_Y that grows by (v1 − c)/r. μ and v_P have no effect; condition (2.12), u1 <=
    3.5 μ, is left to the caller. ``dissipation`` is u1 + W − ΔE = 0.4 (c − r ω_Y0)(v1 − c), which
    is no physical loss: the sphere starts to roll with a spin that does not fit.
    """
    u1, _, _, c, r, wx0, wy0, wz0 = columns
    speed = np.sqrt(c**2 + 10 / 7 * u1)  # (2.20): dw/dη = 2 (1 + u1²)^½ sin α / 1.4
    gained = 10 / 7 * u1 / (speed + c)  # v1 − c without cancellation
    time = 2 * np.sqrt(1 + u1**2) / (speed + c)  # uniform acceleration along sec α
    slip_end, slip_time, work = np.zeros((3, *u1.shape))
    spin = np.stack([wx0, wy0 + gained / r, wz0], axis=-1)
    dissipation = 0.4 * (c - r * wy0) * gained
    return time, speed, slip_end, slip_time, spin, work, dissipation, np.ones_like(u1)


# Along the way: the exact state of one sphere at any η, and the forces on it


@dataclass(frozen=True, eq=False)
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
        ArgumentValueError: Fewer than two points, or as for :func:`motion`.
        ArgumentTypeError: An argument is not numeric.

    Example:
        >>> path = trajectory(0.2635, 0.1072, ChuteParameters(mu=0.4))
        >>> round(path.slip_end, 4), path.friction[0].round(3), path.friction[-1].round(3)
        (0.0922, array([-0.367,  0.123]), array([-0.073,  0.   ]))
    """
    columns = broadcast(u1, v_p, parameters)
    u1, v_p, mu, c, r, wx0, wy0, wz0 = (float(column) for column in columns)
    whole = motion(u1, v_p, parameters)
    slip_end = float(whole.slip_end)
    slip_time = float(whole.slip_time)
    eta, slipping = _points(float(whole.reached), slip_end, integer("n", n, minimum=2))

    # Every point is the end of a shorter way for the solver of the motion.
    length = np.hypot(1.0, u1)
    a = u1 / length
    b = mu / length
    tau = u1 / mu
    vx0 = c - r * wy0
    vy0 = r * wx0 - v_p
    with np.errstate(all="ignore"):  # 0/0 has its limit taken explicitly there
        at = move(np, *np.broadcast_arrays(a, b, tau, c, r * wy0, vy0, eta * length))
    time = at.time
    slip = np.column_stack([at.vx, at.vy])
    time[eta == slip_end] = slip_time
    slip[eta == slip_end] = 0.0

    # The forces, over m g.
    friction = -b * _direction(slip, tau, vx0, vy0)
    friction[~slipping] = [-2 / 7 * a, 0.0]  # (2.21)
    normal = np.column_stack([np.full(len(eta), 1.0 / length), np.abs(friction[:, 1])])

    # The spins follow from the velocity of the contact point.
    wx = (slip[:, 1] + v_p) / r
    wy = (at.speed - slip[:, 0]) / r
    spin = np.column_stack([wx, wy, np.full(len(eta), wz0)])
    return Trajectory(
        eta, time, at.speed, spin, slip, friction, normal, slipping, slip_end, slip_time
    )


def _points(reached: float, slip_end: float, n: int) -> tuple[Array, Mask]:
    """Return n points η along the way, and whether the sphere slips there.

    Where slip ends on the way, η1 is there twice: the last slipping and the first rolling point.
    """
    eta = np.linspace(0.0, reached, n)
    if not 0 < slip_end < 1:
        return eta, ~(eta >= slip_end)  # everywhere if slip does not end
    eta = np.append(eta[eta != slip_end], [slip_end, slip_end])
    eta.sort()
    slipping = eta < slip_end
    slipping[slipping.argmin()] = True
    return eta, slipping


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
    direction = slip / np.where(rho > 0, rho, 1.0)[:, None]
    if vy0:
        cosine = min(tau, 1.0)
        limit = [cosine, np.sign(vy0) * np.sqrt(1 - cosine**2)]
    elif vx0 < 0 and tau <= 3.5:
        limit = [-1.0, 0.0]
    else:  # beyond (2.12) slip does not end: from ρ = 0 on the sphere slides straight down
        limit = [1.0, 0.0]
    direction[rho == 0] = limit
    return direction
