"""The exact motion of many spheres at once: slip, then roll, to the exit or to rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.chute._follow import ROLLS, SLIPS, STALLS, follow_slip
from pymoo_psi.chute._slip import TINY, Array

FIELDS = (
    "time",
    "exit_speed",
    "slip_end",
    "slip_time",
    "exit_spin",
    "plane_work",
    "dissipation",
    "reached",
)

CHUNK = 16384  # designs that are followed together: their arrays stay in the cache


def slip_then_roll(*columns: Array) -> dict[str, Array]:
    """Return the fields of :class:`pymoo_psi.chute.Motion` under the full model (2.16)–(2.21).

    A design has the same values, to the last bit, in whatever batch.

    Args:
        *columns: u1, v_P, μ, c, r, ω_X0, ω_Y0, ω_Z0 as checked arrays of one shape.
    """
    shape = columns[0].shape
    flat = [column.reshape(-1) for column in columns]
    n = flat[0].size
    fields = {name: np.empty((n, 3) if name == "exit_spin" else n) for name in FIELDS}
    with np.errstate(all="ignore"):  # 0/0 and overflow have their limits taken explicitly
        for i in range(0, n, CHUNK):
            part = slice(i, i + CHUNK)
            solved = _solve_chunk(*(column[part] for column in flat))
            for name, value in zip(FIELDS, solved, strict=True):
                fields[name][part] = value
    return {name: value.reshape(shape + value.shape[1:]) for name, value in fields.items()}


def _solve_chunk(
    u1: Array, v_p: Array, mu: Array, c: Array, r: Array, wx0: Array, wy0: Array, wz0: Array
) -> tuple[Array, ...]:
    """The fields of `Motion` for (n,) arrays."""
    length = np.sqrt(1.0 + u1 * u1)
    a, b = u1 / length, mu / length
    wy0 = r * wy0
    vy0 = r * wx0 - v_p
    end = move(a, b, u1 / mu, c, wy0, vy0, length)
    stalls = end.phase == STALLS
    end.time[stalls] = np.inf
    slip_end = np.full(length.size, np.nan)
    np.divide(end.grip_way, length, out=slip_end, where=end.phase == ROLLS)
    reached = np.ones(length.size)
    reached[stalls] = np.clip((1.0 - end.left / length)[stalls], 0.0, 1.0 - 1e-16)

    # Energy: D = a x + W - dE with E = (v_C^2 + 0.4 (r omega)^2)/2
    turned = end.vy - vy0
    spun = end.speed - end.vx  # r omega_Y
    lost = a * length * reached - 0.5 * (end.speed - c) * (end.speed + c)
    lost -= 0.2 * ((spun - wy0) * (spun + wy0) + turned * (end.vy + vy0))
    spin = np.stack([(end.vy + v_p) / r, spun / r, wz0], axis=-1)
    work = 0.4 * v_p * turned
    return end.time, end.speed, slip_end, end.grip_time, spin, work, lost, reached


class State(NamedTuple):
    """Where (n,) spheres are after a given way.

    Attributes:
        time: t.
        speed: v_C.
        vx: v_AX.
        vy: v_AY.
        left: what is left of the way, 0 unless the sphere stalled.
        phase: SLIPS, ROLLS or STALLS.
        grip_time: time when rolling began, nan unless phase is ROLLS.
        grip_way: way when rolling began, meaningless unless phase is ROLLS.
    """

    time: Array
    speed: Array
    vx: Array
    vy: Array
    left: Array
    phase: NDArray[np.int8]
    grip_time: Array
    grip_way: Array


def move(a: Array, b: Array, tau: Array, c: Array, wy0: Array, vy0: Array, way: Array) -> State:
    """Follow (n,) spheres over a way: slip, then constant acceleration.

    Args:
        a: sin alpha.
        b: mu cos alpha.
        tau: a/b.
        c: initial speed.
        wy0: initial r omega_Y.
        vy0: initial v_AY.
        way: how far.
    """
    invariant = c + 0.4 * wy0
    time, vx, y, left, phase = follow_slip(b, tau, invariant, way, c - wy0, np.abs(vy0), c)
    # After slip: rolling, Eq. (2.20), or, for tau > 3.5, sliding straight down from rho = 0.
    free, steep = phase == ROLLS, tau > 3.5
    grip_time = np.where(free & ~steep, time, np.nan)
    grip_way = way - left
    rest = left * free
    speed = np.maximum((invariant + a * time + 0.4 * vx) / 1.4, 0.0)
    push = np.where(steep, a - b, a / 1.4)
    final = np.sqrt(speed * speed + 2.0 * push * rest)
    dt = 2.0 * rest / (speed + final + TINY)
    phase[free & (final == 0.0) & (rest > 0.0)] = STALLS  # u1 = 0 and no speed left
    final[phase == STALLS] = 0.0
    phase[(phase == ROLLS) & steep] = SLIPS
    vx = vx + (free & steep) * (a - 3.5 * b) * dt
    left = left * (phase == STALLS)
    return State(time + dt, final, vx, np.copysign(y, vy0), left, phase, grip_time, grip_way)
