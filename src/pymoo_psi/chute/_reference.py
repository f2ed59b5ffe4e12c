"""The motion integrated numerically by ``scipy.integrate.solve_ivp``: slow, plain, independent.

While the sphere slips, the friction direction is undefined where the slip velocity vanishes, and
time is a bad variable there. With the logarithmic time s, dt = (ρ/b) ds, Eqs. (2.17) become

    dv_x/ds = τ ρ − 3.5 v_x,   dv_y/ds = −2.5 v_y,   dv_C/ds = τ ρ − v_x,
    dt/ds = ρ/b,   dx/ds = v_C ρ/b,   dD/ds = ρ²,

with b = μ cos α, τ = tan α / μ, ρ = |(v_x, v_y)|: smooth to the end of slip, which is at s = ∞.
The integration stops at ρ = 1e-13, which changes the end state by about that much. The motion after
that has constant acceleration: rolling with a/1.4 (2.20), or straight sliding with a − b if
τ > 3.5.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import Array
from pymoo_psi.chute._motion import ChuteParameters, Motion, broadcast

_STILL = 1e-13  # slip speed that counts as none: below the error of the integrator
_NOISE = 1e-18  # absolute error of the slip velocity, which must get below _STILL
_LONGEST = 1e9  # log time s: an event always ends the slip before

_State = Array  # (6,) t, x, v_C, v_x, v_y and the dissipation D


def integrate(u1: ArrayLike, v_p: ArrayLike, parameters: ChuteParameters | None = None) -> Motion:
    """Integrate the full model design by design, as an independent check of :func:`motion`.

    Args:
        u1: tan α >= 0, any shape that broadcasts with the others.
        v_p: Speed of the plane, as for ``u1``.
        parameters: The parameters of the chute; :class:`ChuteParameters` () by default.

    Returns:
        The motion under the full model, as :func:`motion` gives it.

    Raises:
        ArgumentValueError: As for :func:`motion`.
        ArgumentTypeError: As for :func:`motion`.

    Example:
        >>> from pymoo_psi.chute import motion
        >>> exact = motion(0.2635, 0.1072)
        >>> integrated = integrate(0.2635, 0.1072)
        >>> bool(abs(exact.time - integrated.time) < 1e-9)
        True
    """
    columns = broadcast(u1, v_p, parameters)
    designs = np.stack([column.ravel() for column in columns], axis=-1)
    ends = np.array([_one_design(*design) for design in designs.tolist()])
    ends = ends.reshape(*columns[0].shape, 10)
    time, speed, end, end_time, *spins, work, lost, reached = np.moveaxis(ends, -1, 0)
    spin = np.stack(spins, axis=-1)
    u1, v_p = columns[:2]
    return Motion(u1, v_p, time, speed, end, end_time, spin, work, lost, reached)


def _one_design(
    u1: float, v_p: float, mu: float, c: float, r: float, wx0: float, wy0: float, wz0: float
) -> tuple[float, ...]:
    """Return t, v_C, η1, t1, the three spins, W, D and η reached of one design."""
    length = math.hypot(1, u1)
    a = u1 / length
    b = mu / length
    tau = u1 / mu
    start = np.array([0.0, 0.0, c, c - r * wy0, r * wx0 - v_p, 0.0])
    (t, x, v_c, v_x, v_y, lost), is_at_rest = _slip(start, b, tau, length)
    reached = 1.0
    slip_end = math.nan
    slip_time = math.nan
    if is_at_rest:
        t = math.inf
        v_c = 0.0
        reached = x / length
    elif math.hypot(v_x, v_y) < 2 * _STILL:  # slip has ended before the exit
        push = a - b
        slide = a - 3.5 * b
        if tau <= 3.5:  # (2.12): friction can hold the contact point
            slip_end = x / length
            slip_time = t
            push = a / 1.4
            slide = 0.0
        v_end = math.sqrt(v_c**2 + 2 * push * (length - x))
        dt = 2 * (length - x) / (v_end + v_c)
        t += dt
        v_c = v_end
        v_x = slide * dt
        v_y = 0.0
        lost += b * slide * dt**2 / 2
    wx = (v_y + v_p) / r
    wy = (v_c - v_x) / r
    work = 0.4 * v_p * (r * wx - r * wx0)
    return t, v_c, slip_end, slip_time, wx, wy, wz0, work, lost, reached


def _slip(start: _State, b: float, tau: float, length: float) -> tuple[_State, bool]:
    """Integrate the slip to the exit, to its end or to rest.

    Returns:
        The state there, and whether the sphere is at rest.
    """
    from scipy.integrate import solve_ivp  # takes a quarter of a second to import

    def field(s: float, y: _State) -> list[float]:
        _, _, v_c, v_x, v_y, _ = y
        rho = math.hypot(v_x, v_y)
        pull = tau * rho
        return [rho / b, v_c * rho / b, pull - v_x, pull - 3.5 * v_x, -2.5 * v_y, rho**2]

    def exit_reached(s: float, y: _State) -> Any:
        return y[1] - length

    def is_at_rest(s: float, y: _State) -> Any:
        return y[2]

    def slip_ended(s: float, y: _State) -> float:
        return math.hypot(y[3], y[4]) - _STILL

    if slip_ended(0.0, start) <= 0:
        return start, False
    events: list[Any] = [exit_reached, is_at_rest, slip_ended]
    for event in events:
        event.terminal = True
    atol = [1e-14, 1e-14, 1e-14, _NOISE, _NOISE, 1e-14]
    span = (0.0, _LONGEST)
    solution = solve_ivp(field, span, start, "DOP853", events=events, rtol=1e-12, atol=atol)
    # The last point is the event, which SciPy locates to rounding.
    return solution.y[:, -1], len(solution.t_events[1]) > 0
