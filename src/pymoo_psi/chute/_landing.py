"""The last piece of slip: from next to the exit onto it.

The arguments are the states of :mod:`pymoo_psi.chute._follow`, row by row t, v_x, |v_y|, the
distance to go, v_C, b, tau, the invariant and the longest step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.chute._slip import RULES, Array, advance

Mask = NDArray[np.bool_]

NEAR = 0.02  # (1 + tau) times the log time to the exit below which `land` takes over


def near_exit(s: Array) -> Mask:
    """Whether states are so near the exit that :func:`land` is exact."""
    _, vx, y, h, v, b, tau, _, _ = s
    ahead = np.abs(b * h)
    near: Mask = (ahead * (1.0 + tau)) ** 2 < NEAR**2 * v * v * (vx * vx + y * y)
    near &= ahead < 0.2 * v * v  # far from a stall
    near &= vx > 0.0  # where `distance` cannot be short
    return near


def land(s: Array) -> None:
    """Move states next to the exit onto it, in place: one short step and one expansion.

    Both aim by series of second order in the time to the exit.
    """
    t, vx, y, h, v, b, tau, invariant, _ = s
    for last in (False, True):
        rho = np.sqrt(vx * vx + y * y)
        c, rate = vx / rho, b / rho
        lead = tau - c
        dt = h / v
        bend = b * lead * dt
        bend /= v
        bend *= 0.5
        dt *= 1.0 - bend * (1.0 - 2.0 * bend)
        z = rate * dt
        ds = z * (1.0 - 0.5 * (c * lead - 2.5) * z)
        half_turn = 0.5 * (y / rho) ** 2 * lead * ds
        if last:
            t += dt
            vx += b * (tau - 3.5 * (c + half_turn)) * dt
            y *= np.exp(-2.5 * ds)
            h[:] = 0.0
        else:
            q = ((rho - vx) / y) ** 2
            step = (1.0 + c + half_turn) * ds
            spent, slid, vx[:], y[:] = advance(vx, y, rho, q, b, tau, step, RULES[0])
            push = invariant + b * tau * t
            h -= ((push + 0.5 * b * tau * spent) * spent + 0.4 * slid) / 1.4
            v[:] = (push + b * tau * spent + 0.4 * vx) / 1.4
            t += spent
