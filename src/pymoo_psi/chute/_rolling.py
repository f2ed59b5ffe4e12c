"""Rolling from the start: the closed form behind the published tables.

Integrating Eq. (2.20) from η = 0, with the initial spins kept as they are, gives
w(1) = c² + (10/7) u1 and a spin ω_Y that grows by (v1 − c)/r. With ω(0) = 0 this is not the
motion of the paper's complete model, in which the sphere slips first, but its Tables 6.1 and 6.2
follow from it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def roll(
    u1: Array, v_p: Array, mu: Array, c: Array, r: Array, wx0: Array, wy0: Array, wz0: Array
) -> tuple[Array, ...]:
    """Return the fields of :class:`pymoo_psi.chute.Motion` after v_p for pure rolling.

    The arguments broadcast to one shape. μ and v_P do not enter: condition (2.12), u1 <= 3.5 μ,
    is the caller's.

    ``dissipation`` is u1 + W − ΔE, what the energy balance lacks. It is 0.4 (c − r ω_Y0)(v1 − c)
    and is no physical loss: it comes from starting to roll with a spin that does not fit.
    """
    u1, _, _, c, r, wx0, wy0, wz0 = np.broadcast_arrays(u1, v_p, mu, c, r, wx0, wy0, wz0)
    speed = np.sqrt(c**2 + 10 / 7 * u1)  # (2.20): dw/dη = 2 (1 + u1²)^½ sin α / 1.4
    gained = 10 / 7 * u1 / (speed + c)  # v1 − c without cancellation
    time = 2 * np.sqrt(1 + u1**2) / (speed + c)  # uniform acceleration along sec α
    slip_end, slip_time, work = (np.zeros_like(u1) for _ in range(3))
    spin = np.stack([wx0, wy0 + gained / r, wz0], axis=-1)
    lacks = 0.4 * (c - r * wy0) * gained
    return time, speed, slip_end, slip_time, spin, work, lacks, np.ones_like(u1)
