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

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

STILL = 1e-13  # slip speed that counts as none: below the error of the integrator
NOISE = 1e-18  # absolute error of the slip velocity, which must get below STILL
LONGEST = 1e9  # log time s: an event always ends the slip before

State = np.ndarray  # (6,) t, x, v_C, v_x, v_y and the dissipation D


def integrate(
    u1: float, v_p: float, mu: float, c: float, r: float, wx0: float, wy0: float, wz0: float
) -> dict[str, float]:
    """Return fields of the motion of one design under the full model, by name."""
    length = math.hypot(1, u1)
    a = u1 / length
    b = mu / length
    tau = u1 / mu
    start = np.array([0.0, 0.0, c, c - r * wy0, r * wx0 - v_p, 0.0])
    (t, x, v_c, v_x, v_y, lost), is_at_rest = _slip(start, b, tau, length)
    reached = 1.0
    if is_at_rest:
        t = math.inf
        v_c = 0.0
        reached = x / length
    elif math.hypot(v_x, v_y) < 2 * STILL:  # slip has ended before the exit
        push = a - b
        slide = a - 3.5 * b
        if tau <= 3.5:  # (2.12): friction can hold the contact point
            push = a / 1.4
            slide = 0.0
        v_end = math.sqrt(v_c**2 + 2 * push * (length - x))
        dt = 2 * (length - x) / (v_end + v_c)
        t += dt
        v_c = v_end
        v_y = 0.0
        lost += b * slide * dt**2 / 2
    work = 0.4 * v_p * (v_y + v_p - r * wx0)
    return {
        "time": t,
        "exit_speed": v_c,
        "plane_work": work,
        "dissipation": lost,
        "reached": reached,
    }


def _slip(start: State, b: float, tau: float, length: float) -> tuple[State, bool]:
    """Integrate the slip to the exit, to its end or to rest.

    Returns:
        The state there, and whether the sphere is at rest.
    """

    def field(s: float, y: State) -> list[float]:
        _, _, v_c, v_x, v_y, _ = y
        rho = math.hypot(v_x, v_y)
        pull = tau * rho
        return [rho / b, v_c * rho / b, pull - v_x, pull - 3.5 * v_x, -2.5 * v_y, rho**2]

    def exit_reached(s: float, y: State) -> Any:
        return y[1] - length

    def is_at_rest(s: float, y: State) -> Any:
        return y[2]

    def slip_ended(s: float, y: State) -> float:
        return math.hypot(y[3], y[4]) - STILL

    if slip_ended(0.0, start) <= 0:
        return start, False
    events: list[Any] = [exit_reached, is_at_rest, slip_ended]
    for event in events:
        event.terminal = True
    atol = [1e-14, 1e-14, 1e-14, NOISE, NOISE, 1e-14]
    span = (0.0, LONGEST)
    solution = solve_ivp(field, span, start, "DOP853", events=events, rtol=1e-12, atol=atol)
    # The last point is the event, which SciPy locates to rounding.
    return solution.y[:, -1], len(solution.t_events[1]) > 0
