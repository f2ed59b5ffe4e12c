"""The motion integrated numerically by ``scipy.integrate.solve_ivp``: slow, plain, independent.

While the sphere slips, the friction direction is undefined where the slip velocity vanishes, and
time is a bad variable there. With the logarithmic time s, dt = (ρ/b) ds, Eqs. (2.17) become

    dv_x/ds = τ ρ − 3.5 v_x,   dv_y/ds = −2.5 v_y,   dv_C/ds = τ ρ − v_x,
    dt/ds = ρ/b,   dx/ds = v_C ρ/b,   dD/ds = ρ²,

with b = μ cos α, τ = tan α / μ, ρ = |(v_x, v_y)|: smooth to the end of slip, which is at s = ∞.
The integration stops at ρ = 1e-13, which changes the end state by about that much. What follows
has constant acceleration: rolling with a/1.4 (2.20), or straight sliding with a − b if τ > 3.5.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi.chute._motion import ChuteParameters, Motion, broadcast

_STILL = 1e-13  # slip speed that counts as none: below the integrator's own error
_NOISE = 1e-18  # absolute error of the slip velocity, which must get below _STILL
_LONGEST = 1e9  # log time s: an event always ends the slip before


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
        >>> moved, checked = motion(0.2635, 0.1072), integrate(0.2635, 0.1072)
        >>> bool(abs(moved.time - checked.time) < 1e-9)
        True
    """
    columns = broadcast(u1, v_p, parameters)
    rows = np.stack([column.ravel() for column in columns], axis=-1).tolist()
    solved = np.array([_one_design(*row) for row in rows]).reshape(*columns[0].shape, 10)
    time, speed, end, end_time, *spins, work, lost, reached = np.moveaxis(solved, -1, 0)
    spin = np.stack(spins, axis=-1)
    u1, v_p = columns[:2]
    return Motion(u1, v_p, time, speed, end, end_time, spin, work, lost, reached)


def _one_design(
    u1: float, v_p: float, mu: float, c: float, r: float, wx0: float, wy0: float, wz0: float
) -> tuple[float, ...]:
    """Return t, v_C, η1, t1, the three spins, W, D and η reached of one design."""
    from scipy.integrate import solve_ivp  # takes a quarter of a second to import

    length, b, tau = math.hypot(1, u1), mu / math.hypot(1, u1), u1 / mu

    def field(s: float, y: NDArray[np.float64]) -> list[float]:
        _, _, v_c, v_x, v_y, _ = y
        rho = math.hypot(v_x, v_y)
        return [rho / b, v_c * rho / b, tau * rho - v_x, tau * rho - 3.5 * v_x, -2.5 * v_y, rho**2]

    events: list[Any] = [  # at the exit, stalled, no slip any more
        lambda s, y: y[1] - length,
        lambda s, y: y[2],
        lambda s, y: math.hypot(y[3], y[4]) - _STILL,
    ]
    for event in events:
        event.terminal = True

    y = np.array([0.0, 0.0, c, c - r * wy0, r * wx0 - v_p, 0.0])
    slips_out = stalls = False
    if math.hypot(y[3], y[4]) > _STILL:
        atol = [1e-14, 1e-14, 1e-14, _NOISE, _NOISE, 1e-14]
        accuracy: dict[str, Any] = {"rtol": 1e-12, "atol": atol}
        solution = solve_ivp(field, (0.0, _LONGEST), y, "DOP853", events=events, **accuracy)
        y = solution.y[:, -1]  # at the event, which SciPy locates to rounding
        ends = [len(times) > 0 for times in solution.t_events or ()]
        slips_out, stalls = not ends[2], ends[1]

    t, x, v_c, v_x, v_y, dissipated = y
    reached, slip_end, slip_time = 1.0, math.nan, math.nan
    if stalls:
        t, reached, v_c = math.inf, x / length, 0.0
    elif not slips_out:
        if tau <= 3.5:  # (2.12): friction can hold the contact point
            slip_end, slip_time, a, slide = x / length, t, u1 / length / 1.4, 0.0
        else:
            a = u1 / length - b
            slide = u1 / length - 3.5 * b
        v_end = math.sqrt(v_c**2 + 2 * a * (length - x))
        dt = 2 * (length - x) / (v_end + v_c)
        t, v_c, v_x = t + dt, v_end, slide * dt
        dissipated += b * slide * dt**2 / 2
    wx = (v_y + v_p) / r if slips_out else v_p / r
    spin, work = (wx, (v_c - v_x) / r, wz0), 0.4 * v_p * (r * wx - r * wx0)
    return t, v_c, slip_end, slip_time, *spin, work, dissipated, reached
